"""The command ``scantruss splice``: overlapping scans in frames of their own become one cloud."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, words_of_number
from ..settings import UNITS
from .outputs import claim, claim_clouds
from .shared import cloud_file_notes, note_compiling, report_cloud

if TYPE_CHECKING:
    from ..report.terminal import Bars
    from ..scan.cloud import PointCloud
    from ..scan.register import Splice
    from .options import Parser


def splice_parser() -> Parser:
    """Options of ``scantruss splice``."""
    from .options import Parser, add_outs

    parser = Parser(
        "splice",
        "SCAN SCAN [SCAN ...] -o OUT [options]",
        "Move overlapping scans, each in its own frame, into one frame and merge them. The frame is that of the first scan\n"
        "that fits. The poses, and how well each pair of scans agrees, are saved beside OUT as .poses.json.",
    )
    parser.add_argument("scans", metavar="SCAN", nargs="+", help="scan files, or patterns such as 'scans/*.ply'")
    add_outs(parser, "merged cloud; the suffix names the format")
    parser.add_argument(
        "--poses", metavar="FILE", help="poses to start from, for all scans or some, e.g. .poses.json of an earlier run"
    )
    parser.add_argument(
        "--use-poses", action="store_true", help="take the poses as they are: no alignment, only residuals and merging"
    )
    parser.add_argument("--all", action="store_true", help="fail if any scan fits nowhere")
    parser.add_argument("--unit", choices=[unit for unit in UNITS if unit], default="", help="unit of all scans")
    return parser


def splice(values: Namespace) -> None:
    """Splice scans and save the whole with its poses."""
    from ..report.terminal import Bars
    from ..runtime.files import SaveTogether
    from ..scan.formats.writing import write_points

    files = scan_files(values.scans)
    outs, poses_file = merged_outputs(values)
    names = names_of(files)
    with Bars() as bars:
        result = splice_files(values, files, names, bars)
        bars("write", 0.0)
        from ..scan.register.saving import splice_values

        with SaveTogether("" if values.force else "cloud") as save:
            points, origin = result.cloud.points + result.cloud.origin, result.cloud.origin
            for out in outs:
                write_points(save.beside(out), points, normals=None, unit=result.unit, origin=origin)
            save.json(poses_file, splice_values(result))
    show_splice(result, [*outs, poses_file])


def scan_files(words: list[str]) -> list[Path]:
    """Return the files that names and patterns match, in order."""
    from ..scan.formats.paths import files_of

    files = [file for word in words for file in files_of(word)]
    if len(files) < 2:
        raise InputError(f"splicing needs at least 2 scans, got {len(files)}")
    seen: set[Path] = set()
    for file in files:
        if file.resolve() in seen:
            raise InputError(f"{file} is given twice; name every scan once")
        seen.add(file.resolve())
    return files


def names_of(files: list[Path]) -> list[str]:
    """Return the names of the scans: those of the files, with their folders where names repeat."""
    names = [file.name for file in files]
    return names if len(set(names)) == len(names) else [file.as_posix() for file in files]


def merged_outputs(values: Namespace) -> tuple[list[Path], Path]:
    """Return the clouds and the file of poses; what cannot be written is refused before anything is read or computed."""
    from ..runtime.places import check_place

    outs, taken = claim_clouds(values, "merged cloud")
    poses_file = check_place(outs[0].with_suffix(".poses.json"), (".json",))
    if taken.get(poses_file.resolve()) != "poses":  # a run may replace the poses that it starts from
        claim(poses_file, "file of poses", taken, force=values.force)
    if values.use_poses and not values.poses:
        raise InputError("--use-poses needs --poses FILE, the poses to be used")
    return outs, poses_file


def splice_files(values: Namespace, files: list[Path], names: list[str], bars: Bars) -> Splice:
    """Read the scans and splice them; report what is left out."""
    from ..scan.formats.reading import read_points
    from ..scan.register import splice_scans
    from ..scan.register.pose_file import read_poses

    poses = read_poses(values.poses) if values.poses else {}
    unknown = sorted(name for name in poses if name not in names and Path(name).name not in names)
    if values.poses and len(unknown) == len(poses):
        raise InputError(f"{values.poses} holds no pose of the scans given; it has {', '.join(unknown[:5])}")
    clouds: list[PointCloud] = []
    for place, (file, name) in enumerate(zip(files, names, strict=True)):
        bars("read", place / len(files))
        cloud = read_points(file, unit=values.unit)
        report_cloud(bars, cloud, name)
        clouds.append(cloud)
    with note_compiling(bars):
        result = splice_scans(clouds, names, poses=poses, use_poses=values.use_poses, progress=bars)
    reasons = [
        f"{name} {'fits in more ways than one' if name in result.doubtful else 'fits nowhere'}"
        for name in result.left_out
    ]
    if reasons and values.all:
        raise InputError(f"{'; '.join(reasons)}; leave it out, or give its pose with --poses")
    for reason in reasons:
        bars.note(f"{reason} among the others and is left out; give its pose with --poses to keep it")
    for pair in result.contradicting:
        bars.note(
            f"{pair.first} and {pair.second} contradict each other in the poses given: of what lies over the other"
            f" {100.0 * pair.agreement:.0f} % lies on it"
        )
    for name in result.alone:
        bars.note(f"{name} agrees with no other scan in the poses given")
    return result


def show_splice(result: Splice, written: list[Path]) -> None:
    """Print the pairs, the worst of them and what was written."""
    from ..report.terminal import print_lines, print_table

    unit = f" {result.unit}" if result.unit else ""
    rows = [
        (
            f"{pair.first} - {pair.second}",
            f"{100.0 * pair.overlap:.0f} %",
            f"{100.0 * pair.agreement:.0f} %",
            "-" if pair.residual is None else f"{words_of_number(pair.residual, 4)}{unit}",
            "-" if pair.residual is None else f"{pair.residual / result.spacing:.2f}",
        )
        for pair in result.pairs
    ]
    print_table(("pair", "overlap", "agreement", "residual", "in spacings"), rows)
    count, frame = len(result.poses), result.frame or "the poses given"
    line = f"{count} of {count + len(result.left_out)} scans in the frame of {frame}"
    print_lines(
        [
            f"{line}, spacing {words_of_number(result.spacing, 4)}{unit}, {len(result.cloud.points):,} points",
            "wrote " + " ".join(map(str, written)),
            *cloud_file_notes(written[0], selects=False),
        ]
    )
