"""``scantruss clean``: a scan in, a clean cloud out, and a line on what each step did."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..settings import JUDGE_OUTLIERS
from .outputs import claim, claim_clouds
from .shared import cloud_file_notes, note_compiling, read_scan

if TYPE_CHECKING:
    from ..scan.clean.steps import CleanCloud
    from .options import Parser

LARGEST_VALUES = {"duplicates": 1.0, "loose-pieces": 0.5, "layer-distance": 20.0}  # beyond these most of a scan is lost
SHARES = {  # option, step that it steers, metavar, default, what it is
    "duplicates": ("SHARE", 0.01, "remove points closer to an earlier one than this share of the spacing"),
    "outlier-distance": (
        "NUMBER",
        3.0,
        "remove points this many times farther from others than their neighbours are; 0: none",
    ),
    "loose-pieces": (
        "SHARE",
        0.005,
        "remove detached pieces with less than this share of all points, and narrow clouds of any size; 0: none",
    ),
    "layer-distance": ("NUMBER", 2.0, "merge two layers up to this many spacings apart"),
}
KEEP_OPTIONS = {
    "duplicates": ("keep-duplicates", "keep duplicate points"),
    "outlier-distance": ("keep-outliers", "keep outliers"),
    "loose-pieces": ("keep-pieces", "keep loose pieces"),
    "layer-distance": ("keep-layers", "keep doubled layers"),
}


def clean_parser() -> Parser:
    """Options of ``scantruss clean``."""
    from .options import Parser, add_outs, add_reading, number

    parser = Parser(
        "clean",
        "SCAN OUT [options]",
        "Remove duplicates, outliers, loose pieces, doubled layers and noise from a scan; compute normals.",
    )
    parser.add_argument("scan", metavar="SCAN", help="scan file")
    add_outs(parser, "clean cloud; the suffix names the format", "?")
    parser.add_argument("--report", metavar="FILE.json", help="save what each step did")
    steps = parser.add_argument_group("steps, in this order")
    for name, (metavar, default, words) in SHARES.items():
        steps.add_argument(
            f"--{name}", metavar=metavar, type=number, default=default, help=f"{words} (default {default})"
        )
        keep, about = KEEP_OPTIONS[name]
        steps.add_argument(f"--{keep}", action="store_true", help=about)
    steps.add_argument(
        "--judge-outliers",
        metavar="|".join(JUDGE_OUTLIERS),
        choices=JUDGE_OUTLIERS,
        default="auto",
        help="when to look for outliers: auto, if points stand alone, as a grid does; or always",
    )
    steps.add_argument("--no-smooth", action="store_true", help="leave points where they are: remove no noise")
    steps.add_argument(
        "--spacing",
        metavar="NUMBER",
        type=number,
        help="keep one point in each search box of this width, in scan units",
    )
    steps.add_argument("--no-normals", action="store_true", help="write no normals")
    add_reading(parser)
    return parser


def clean(values: Namespace) -> None:
    """Clean a scan and save it."""
    from ..report.terminal import Bars, print_lines
    from ..runtime.files import SaveTogether
    from ..scan.formats.writing import write_points
    from .options import READING, settings_of

    outs, report = _outputs(values)
    chosen = {name: value for name, value in vars(values).items() if name in READING}  # steps share names with settings
    settings = settings_of(Namespace(**chosen, length=1.0))
    steps = _steps(values)
    with Bars() as bars:
        cloud = read_scan(values.scan, settings, bars)
        from ..scan.clean.steps import clean_points

        with note_compiling(bars):
            result = clean_points(cloud, **steps, progress=bars)
    with SaveTogether("" if values.force else "cloud") as save:
        points = result.points + result.origin
        for out in outs:
            write_points(save.beside(out), points, normals=result.normals, unit=result.unit, origin=result.origin)
        if report is not None:
            save.json(report, figures_of_cleaning(result, len(cloud.points)))
    lines = [f"{len(cloud.points):,} points read"] + [step.words for step in result.steps]
    written = [*map(str, outs), *([str(report)] if report else [])]
    notes = [note for out in outs for note in cloud_file_notes(out)]
    print_lines([*lines, f"wrote {' '.join(written)}: {len(result.points):,} points", *notes])


def _outputs(values: Namespace) -> tuple[list[Path], Path | None]:
    """Return where the results go, checked before anything is read."""
    from ..runtime.places import check_place

    outs, taken = claim_clouds(values, "clean cloud")
    report = check_place(values.report, (".json",)) if values.report else None
    if report is not None:
        claim(report, "report", taken, force=values.force)
    return outs, report


def _steps(values: Namespace) -> dict[str, Any]:
    """Return the arguments of `clean_points`."""
    given = vars(values)
    steps: dict[str, Any] = {
        "smooth": not values.no_smooth,
        "normals": not values.no_normals,
        "spacing": values.spacing,
        "judge_outliers": values.judge_outliers,
    }
    for name in SHARES:
        field = name.replace("-", "_")
        steps[field] = None if given[KEEP_OPTIONS[name][0].replace("-", "_")] else given[field]
        if steps[field] is not None and not 0 <= steps[field] < float("inf"):
            raise InputError(f"--{name} must be a number of 0 or more, got {given[field]:g}")
        if (steps[field] or 0.0) > LARGEST_VALUES.get(name, float("inf")):
            _, default, words = SHARES[name]
            raise InputError(
                f"--{name} {given[field]:g} would {words.partition(',')[0]}, and so most of the scan;"
                f" it must be at most {LARGEST_VALUES[name]:g} (default {default:g})"
            )
        if name == "outlier-distance" and 0 < (steps[field] or 0.0) < 1:
            raise InputError(f"--{name} {given[field]:g} would remove most of the scan; it must be 0, or 1 or more")
    if values.spacing is not None and not 0 < values.spacing < float("inf"):
        raise InputError(f"--spacing must be a positive length in the scan's unit, got {values.spacing:g}")
    return steps


def figures_of_cleaning(result: CleanCloud, points: int) -> dict[str, Any]:
    """Return all figures of a run, ready for JSON."""
    return {
        "points_read": points,
        "points": len(result.points),
        "unit": result.unit,
        "steps": [{"name": step.name, "count": step.count, "words": step.words} for step in result.steps],
    }
