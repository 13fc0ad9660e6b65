"""The command ``scantruss grid``: a scan in, a grid and its settings out."""

from __future__ import annotations

import shlex
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from ..errors import CertificateError, FormatError, FrontError, LengthError, LinesError, OneSidedError
from ..settings.values import ROTATION_NUMBERS
from .outputs import claim, inputs_of, outs_of
from .shared import (
    SCAN_HELP,
    add_memory,
    note_compiling,
    note_corners,
    note_layers,
    note_outliers,
    note_pieces,
    read_scan,
    settings_to_read,
    with_some_length,
)
from .styles import add_styles, style_of

if TYPE_CHECKING:
    from ..export.style import FileStyle
    from ..grid.grid import Grid
    from ..report.advice import Advice
    from ..report.terminal import Bars
    from ..scan.cloud import PointCloud
    from ..settings import Settings
    from .options import Parser


def grid_parser() -> Parser:
    """Options of ``scantruss grid``."""
    from .options import Parser, add_outs, add_settings

    parser = Parser(
        "grid",
        "SCAN OUT [OUT ...] [--length L] [options]",
        "Turn a scan into a triangular grid truss of a desired member length.\n"
        "The options are in three groups: for every day, for experts, and for the method of the paper only.",
    )
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    add_outs(parser, "results; the suffix names the format", "*")
    files = parser.add_argument_group("files")
    files.add_argument(
        "--settings", metavar="FILE", help="settings saved beside an earlier result; options given here take precedence"
    )
    files.add_argument("--fixed-file", metavar="FILE", help="positions that must become nodes, one X,Y,Z per line")
    files.add_argument(
        "--report",
        metavar="FILE.json|FILE.html",
        help="save all figures of the run, or a page with 3D view, tables, plots, certificate and settings",
    )
    files.add_argument(
        "--keep-failed",
        action="store_true",
        help="also write a grid that fails its certificate; the exit status is 3 either way",
    )
    add_memory(parser)
    add_styles(parser)
    add_settings(parser)
    return parser


def grid(values: Namespace) -> None:
    """Make a grid and save it with its settings."""
    from ..export.formats import check_model_unit
    from ..report.figures import report_of
    from ..report.terminal import Bars
    from ..runtime.files import SaveTogether
    from .idle_options import idle_options
    from .options import has_length, settings_of

    outs, style = outs_of(values), style_of(values)
    settings = settings_of(with_some_length(values))
    settings_file = outs[0].with_suffix(".settings.json")
    report = Path(values.report) if values.report else None
    check_outputs(values, outs, settings_file, report)
    with Bars() as bars:
        started = perf_counter()
        settings = settings_to_read(values, settings, bars)
        cloud = read_scan(values.scan, settings, bars)
        for out in outs:
            check_model_unit(out, cloud.unit)
        spent = perf_counter() - started
        advice = None
        if not has_length(values):
            settings, advice = choose_length(cloud, settings, bars)
        for words in idle_options(values, cloud, settings):
            bars.note(words)
        try:
            result = grid_with_notes(
                cloud, settings, bars, keep_failed=values.keep_failed, read_seconds=spent, advice=advice
            )
        except FrontError as error:
            draw_refusal(error, cloud, outs, style, bars, force=values.force)
            raise
    from ..export.formats import model_of
    from .convert import write_models

    with Bars() as bars, SaveTogether("" if values.force else "result") as save:
        alone = not any(out.suffix.lower() == ".json" for out in outs)  # that file holds all
        written = write_models(model_of(result, cloud=cloud), outs, save, bars, style, say_losses=alone)
        save.json(settings_file, (result.settings or settings).to_dict())
        if report is not None and report.suffix.lower() == ".html":
            from ..report.grid_page import encode_grid_report

            save.beside(report).write_bytes(encode_grid_report(result, cloud, command_line_of(values)))
        elif report is not None:
            save.json(report, report_of(result, len(cloud.points)))
    show_grid(result, len(cloud.points), [*written, settings_file, *([report] if report else [])])
    if result.certificate is not None and not result.certificate.passed:
        raise CertificateError("the grid fails its certificate, and was written because of --keep-failed")


def command_line_of(values: Namespace) -> str:
    """Return the command line that repeats this run with the settings that are saved beside its results."""
    outs = [str(out) for out in outs_of(values)]
    settings = str(outs_of(values)[0].with_suffix(".settings.json"))
    return shlex.join(["scantruss", "grid", values.scan, *outs, "--settings", settings])


def check_outputs(values: Namespace, outs: list[Path], settings_file: Path, report: Path | None) -> None:
    """Refuse outputs that cannot be written, before anything is read or computed."""
    from ..export.formats import check_output
    from ..runtime.ours import check_ours
    from ..runtime.places import check_place
    from .convert import claim_models

    taken = inputs_of(values)
    if not values.force:
        for out in outs:  # before its suffix is: a pattern without quotes may name several scans
            if out.resolve() not in taken:
                check_ours(out, "result")
    claim_models([check_output(out) for out in outs], taken, force=values.force, what="grid")
    if report is not None:
        claim(check_place(report, (".json", ".html")), "report", taken, force=values.force)
    check_place(settings_file, (".json",))
    if taken.get(settings_file.resolve(), "settings") != "settings":  # a run may repeat the settings it saved itself
        raise FormatError(f"{settings_file} is where the settings of this run are saved; name another file")
    if not values.force:
        check_ours(settings_file, "result")


def grid_with_notes(
    cloud: PointCloud,
    settings: Settings,
    bars: Bars,
    *,
    keep_failed: bool = False,
    read_seconds: float = 0.0,
    advice: Advice | None = None,
) -> Grid:
    """Run the chain, with a note if kernels must be compiled; `advice` is what the length was chosen by."""
    from ..pipeline import grid_from_cloud

    with note_compiling(bars):
        try:
            grid = grid_from_cloud(cloud, settings, progress=bars, keep_failed=keep_failed, read_seconds=read_seconds)
        except LengthError as error:
            if not settings.length_field:
                bars.note(f"{error}; lengths nearby are tried")
            raise LengthError(f"{error}{nearby_words(bars, cloud, settings, advice)}") from None
        except LinesError as error:
            raise LinesError(f"{error}{nearby_words(bars, cloud, settings, advice)}", error.lines) from None
        except FrontError as error:
            note_layers(bars, cloud, settings)
            note_pieces(bars, cloud, settings)
            from .floors import words_of_floor

            lead = words_of_floor(bars, cloud, settings) or nearby_words(bars, cloud, settings, advice, error)
            words = f"{error}{lead}"
            raise type(error)(words, error.grid, error.where) from None
        except OneSidedError as error:
            from .largest_piece import words_of_largest_piece

            raise OneSidedError(f"{error}{words_of_largest_piece(bars, cloud, settings)}") from None
    made = grid.settings or settings
    smoothed = made.smooth_scale != settings.smooth_scale
    if smoothed:
        note_smoothed(bars, cloud, settings, grid)
    for name, words in {
        "judge_outliers": "no grid passes with the outliers of this scan, so they are left out, as with --judge-outliers always",
        "sharp_edges": "no grid passes without a look at the sharp edges of this body, so it is made as with --sharp-edges",
        "thin_walls": "walls of this scan, or gaps in it, are thinner than a member, so the grid runs on both sides, as with --thin-walls",
        "plain_body": "no grid passes with all thin limbs and slits of this body, so it is made without, as with --plain-body",
        "plain_at": "no grid passes with all thin limbs and slits of this body, so it is made without some, as with --plain-at",
        "keep_rods": "no grid follows the columns, scaffold or cables of this scan: what was found of them is left out",
        "limb_girth": f"no grid passes with all thin limbs cut off, so it is made as with --limb-girth {made.limb_girth:g}",
        "ridge_angle": "a grid along the folds of this scan fails or is far less even, so it has no ridges, as with --ridge-angle 0",
        "box_size": f"no grid passes with the usual sample spacing, so it is made as with --box-size {made.box_size or 0:g}",
        "effort": f"no grid passes with --effort {settings.effort}, so it is made as with --effort {made.effort}",
        "method": "no grid of the default method passes its certificate here, so it is made by the method of the paper",
    }.items():
        if getattr(made, name) != getattr(settings, name) and not (smoothed and name == "ridge_angle"):
            bars.note(words)
    if settings.symmetry:
        bars.note(words_of_symmetry([row for row in made.symmetry if not isinstance(row, str)]))
    note_outliers(bars, cloud, made, listed=grid.certificate)
    note_layers(bars, cloud, made, grid.certificate)
    note_corners(bars, cloud, made)
    note_pieces(bars, cloud, made)
    return grid


def words_of_symmetry(rows: Sequence[Sequence[float]]) -> str:
    """Return which symmetry a grid keeps, in words."""
    words = "; ".join(", ".join(f"{c:.4g}" for c in row) for row in rows)
    if len(rows[0]) == ROTATION_NUMBERS and len(rows) == 2:
        return (
            f"the same when turned by 360/{rows[0][-1]:.0f} degrees about an axis, and turned over about a line of the surface,"
            f" as points, axes and parts: {words}"
        )
    if len(rows[0]) == ROTATION_NUMBERS:
        return f"the same when turned by 360/{rows[0][-1]:.0f} degrees about an axis, as point, axis and parts: {words}"
    return f"symmetric in {len(rows)} mirror plane{'s' * (len(rows) != 1)}, as point and normal: {words}"


def note_smoothed(bars: Bars, cloud: PointCloud, settings: Settings, grid: Grid) -> None:
    """Report that a rough scan, or one of thin walls, was smoothed, and how far that has taken the nodes from its points."""
    from ..report.figures import offset_words
    from ..surface.samples import sample_surface

    assert grid.settings is not None and grid.certificate is not None
    scale = grid.settings.smooth_scale
    what = "both sides of the thin walls" if sample_surface(cloud, settings).layers[1] > 0.0 else "the roughness"
    words = "a member" if scale == 1.0 else f"{scale:g} members"
    bars.note(
        f"no grid follows {what} of this scan, so it is smoothed over {words}, as with --smooth-scale {scale:g}"
        f" --ridge-angle 0: nodes lie on the mean surface; points around nodes: {offset_words(grid.certificate)}"
    )


def choose_length(cloud: PointCloud, settings: Settings, bars: Bars) -> tuple[Settings, Advice]:
    """Return the settings with the length that `info` suggests, with a note, and what was tried for it."""
    from ..report.advice import Advice

    with note_compiling(bars):
        advice = Advice(cloud, settings, bars)
        length = advice.suggest()
    passes = (
        "as scantruss info suggests" if advice.passes else "at which no quick run passes, nor at others that were tried"
    )
    bars.note(f"no --length is given; using {length:g}{f' {cloud.unit}' if cloud.unit else ''}, {passes}")
    return settings.replace(length=length), advice


def nearby_words(
    bars: Bars, cloud: PointCloud, settings: Settings, advice: Advice | None = None, refused: FrontError | None = None
) -> str:
    """Name the nearest length at which a grid passes, tried by quick runs; nothing if lengths vary over the scan."""
    from ..report.advice import Advice
    from ..report.lengths import accepted_line
    from .largest_piece import words_of_largest_piece

    if settings.length_field:
        return ""
    unit = f" {cloud.unit}" if cloud.unit else ""
    if advice is not None and advice.tried and not advice.passes:
        lengths = f"{advice.tried[0].length:g} to {advice.tried[-1].length:g}{unit}"
        way_out = (
            "".join(accepted_line(advice.tried))
            or words_of_largest_piece(bars, cloud, settings).removeprefix("; ")
            or "clean or crop the scan where it fails"
        )
        return f"; no grid passes with the lengths tried, {lengths}, either: {way_out}"
    if (length := Advice(cloud, settings, bars).nearby(settings.length, refused)) is not None:
        return f"; a grid passes with --length {length:g} ({f'{cloud.unit}, ' if cloud.unit else ''}tried with --effort quick)"
    return words_of_largest_piece(bars, cloud, settings) or (
        f"; no grid passes with the lengths tried near {settings.length:g}{unit} either: scantruss info looks for one farther off,"
        " else clean or crop the scan where it fails"
    )


def draw_refusal(
    error: FrontError, cloud: PointCloud, outs: Sequence[Path], style: FileStyle, bars: Bars, *, force: bool
) -> None:
    """Write the pictures among the results, with the places of the faults in red; nothing else is written."""
    from ..export.drawing.refusal import encode_refusal
    from ..runtime.files import SaveTogether

    pictures = [out for out in outs if out.suffix.lower() == ".png"]
    if not pictures:
        return
    with SaveTogether("" if force else "result") as save:
        for out in pictures:
            save.beside(out).write_bytes(encode_refusal(error, cloud, style=style))
    bars.note(f"wrote {' '.join(map(str, pictures))}, which shows the places in red; nothing else is written")


def show_grid(result: Grid, points: int, written: Sequence[Path]) -> None:
    """Print the figures of Table 2, the worst places and what was written."""
    from ..report.figures import certificate_rows, first_line, grid_lines, quality_rows
    from ..report.terminal import print_lines, print_table

    if result.certificate is not None:
        print_lines(first_line(result.certificate))
    print_table(("", "before", "after optimization"), quality_rows(result))
    if result.certificate is not None:
        print_table(("worst", "", "at"), certificate_rows(result.certificate))
    print_lines([*grid_lines(result, points), "wrote " + " ".join(map(str, written))])
