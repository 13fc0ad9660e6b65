"""The command ``scantruss structure``: supports, loads, linear statics and checks of a saved grid."""

from __future__ import annotations

import shlex
from argparse import SUPPRESS, Namespace
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .grids import add_grid, read_saved_grid
from .outputs import Taken, claim, outs_of
from .styles import add_decimal_comma

if TYPE_CHECKING:
    import numpy as np

    from ..grid.grid import Grid
    from ..runtime.progress import Progress
    from ..structure.options import StructureSettings
    from ..structure.path import Path as StructurePath
    from ..structure.report import StructureReport
    from ..structure.results import Solution
    from ..structure.truss import Truss
    from .options import Parser

REPORT_SUFFIXES = (".html", ".pdf", ".png")  # of what a person reads; the others are those of `export.formats`
OWN_OPTIONS = (  # name, metavar, help; the same names stand in a settings file
    ("scale", "SCALE", "size of the structure over that of the grid (default 1)"),
    ("unit", "UNIT", "unit of a grid that has none: mm, cm, m, inch or foot"),
    ("section", "NAME|FILE", "CHS114.3x5 (default), CFCHS114.3x5 (cold formed), SHS100x5, IPE200, HEA200, R100x200 or FILE.csv[:NAME]"),
    ("material", "NAME|FILE", "S235 to S460 (default S355), 6082-T6, C24, GL24h or FILE.csv[:NAME]"),
    ("supports", "WHERE|FILE",
     "corners, boundary, lowest:H, fixed, ends, line:NAME, loop:N, a node such as N001, or several joined by +; or a file of"
     " positions X,Y,Z in the frame of the scan"),
    ("support_type", "TYPE", "pinned (default), fixed, roller or springs:K, with K such as 5MN/m"),
    ("joints", "TYPE",
     "rigid (default), pinned (axial forces only; default of double layers) or the stiffness of springs at member ends in Nm/rad"),
    ("loads", "LOAD,...|FILE",
     "such as self,cladding:0.5kN/m2,snow:1kN/m2,half-snow:1kN/m2,wind:0.8kN/m2:-0.7,temperature:30K, or a file with a list of"
     " loads (default self)"),
    ("node_allowance", "SHARE", "weight of the nodes over that of the members, such as 0.15 or 15%% (default 0)"),
    ("double_layer", "DEPTH,...", "add a second layer this far below, in metres of the structure or with a unit, and webs between; more"
     " depths add more layers, as in 1.2,0.8"),
    ("second_layer", "dual|same", "for a double layer: nodes under the triangles (default) or under the nodes"),
    ("depth_along", "normal|vertical", "for a double layer: along the smoothed normals (default) or along z"),
    ("held_layer", "outer|inner", "for a double layer: the one that is supported (default outer, the grid)"),
    ("layer_edges", "tapered|closed", "for a double layer: how it ends at the boundary (default tapered for dual, closed for same)"),
    ("sharp_bends", "refuse|reduce", "for a double layer: what to do where the grid bends too sharply for its depth (default refuse)"),
    ("size", "COUNT", "choose sections like --section, at most this many different ones, until all members pass and the structure"
     " buckles at 10 times its loads or more"),
    ("size_by", "WAY", "members (default), groups (boundary, lines, inner, of each piece) or rings: what gets the same section"),
    ("buckling", "COUNT", "linear buckling factors of the combination that buckles first (default 0)"),
    ("frequencies", "COUNT", "lowest natural frequencies (default 0)"),
    ("path", "worst|NAME", "geometrically nonlinear path of a load case or combination; worst is the one that buckles first"),
    ("path_steps", "COUNT", "most steps of the path (default 30)"),
    ("path_factor", "NUMBER", "load factor at which the path ends (default twice the linear buckling factor)"),
    ("imperfection", "KIND", "for the path: mode (default, span/300), mode:30mm, scan (the scan against its fair surface), none"),
)  # fmt: skip


def structure_parser() -> Parser:
    """Options of ``scantruss structure``."""
    from .options import Parser, add_outs, number, scale, share, whole_number

    parser = Parser(
        "structure",
        "GRID OUT [OUT ...] --supports corners [--section CHS114.3x5] [--loads self,snow:1kN/m2] [options]",
        "Make a structure of a saved grid and solve it: supports, loads, linear statics, checks by EN 1993-1-1.",
    )
    add_grid(parser, "grid saved as .json by scantruss grid")
    add_outs(
        parser,
        "structure with its results; the suffix names the format; .html and .pdf are reports, .png a picture",
        "*",
    )
    parser.add_argument("--report", metavar="FILE", help="figures as .json, in m, N and kg, or a page as .html")
    parser.add_argument(
        "--settings", metavar="FILE", help="all of these options in a .toml or .json file, with combinations and limits"
    )
    for name, metavar, about in OWN_OPTIONS:
        kind = {"NUMBER": number, "COUNT": whole_number, "SCALE": scale, "SHARE": share}.get(metavar, str)
        parser.add_argument("--" + name.replace("_", "-"), metavar=metavar, type=kind, default=SUPPRESS, help=about)
    add_decimal_comma(parser)
    parser.add_argument("--path-plot", metavar="FILE.png", help="picture of the path: load factor against displacement")
    parser.add_argument(
        "--dry-run", action="store_true", help="print the size and time of the path without computing it"
    )
    parser.add_argument("--keep-failed", action="store_true", help="also accept a grid that failed its certificate")
    return parser


def structure(values: Namespace) -> None:
    """Make the structure of a saved grid, solve it and save it."""
    from ..export.formats import STRUCTURE, check_output, model_of
    from ..export.style import FileStyle
    from ..report.terminal import Bars, print_lines
    from ..runtime.files import SaveTogether
    from ..runtime.places import check_place
    from .convert import claim_models, write_models

    outs = [check_output(out, STRUCTURE, also=REPORT_SUFFIXES) for out in outs_of(values)]
    if not Path(values.grid).exists():
        raise InputError(f"there is no file {values.grid}; structure needs a grid saved as .json by scantruss grid")
    report_place = None if values.report is None else check_place(values.report, (".json", ".html"))
    plot = None if values.path_plot is None else check_place(values.path_plot, (".png",))
    settings = structure_settings(values)
    if plot is not None and not settings.path:
        raise InputError("--path-plot shows a path; ask for one with --path worst")
    taken = _inputs(values)
    claim_models(outs, taken, force=values.force, what="structure")
    if report_place is not None:
        claim(report_place, "report", taken, force=values.force)
    if plot is not None:
        claim(plot, "picture", taken, force=values.force)
    from ..grid.certificate import check_passed
    from ..structure.doubts import certificate_words
    from ..structure.path_report import encode_path, path_expectation
    from ..structure.truss import Truss

    with Bars() as bars, SaveTogether("" if values.force else "result") as save:
        grid = read_saved_grid(values.grid, values.merge, values.keep_failed, bars)
        check_passed(grid, values.keep_failed)
        bars("structure", 0.1)
        truss = Truss.from_grid(grid, **_arguments(grid, settings))
        if values.dry_run:
            print_lines([path_expectation(truss, settings.path_steps)])
            return
        weighed = report_place is not None or any(out.suffix.lower() in (".html", ".pdf") for out in outs)
        solution, report = _solved(truss, grid, settings, weighed, bars)
        of_grid = certificate_words(grid)
        bars("report", 0.0)
        models = [out for out in outs if out.suffix.lower() not in REPORT_SUFFIXES]
        written = write_models(
            model_of(solution, report=report), models, save, bars, FileStyle(decimal_comma=values.decimal_comma)
        )
        for out in outs:
            if out not in models:
                save.beside(out).write_bytes(_encoded(out, values, settings, solution, report, of_grid))
                written.append(out)
        if report_place is not None and report_place.suffix.lower() == ".html":
            save.beside(report_place).write_bytes(_encoded(report_place, values, settings, solution, report, of_grid))
        elif report_place is not None:
            save.json(report_place, report.to_dict() | {"warnings_of_grid": of_grid})
        if plot is not None and report.path is not None:
            save.beside(plot).write_bytes(encode_path(report.path))
    _print_report(report, settings.supports, of_grid, [*written, *(place for place in (report_place, plot) if place)])


def _solved(
    truss: Truss, grid: Grid, settings: StructureSettings, weighed: bool, bars: Progress
) -> tuple[Solution, StructureReport]:
    """Size, solve and check a structure as its settings ask; `weighed`: with the weight for each number of sections."""
    from ..structure.doubts import doubts_of_settings
    from ..structure.modes import vibration_modes, worst_buckling
    from ..structure.report import report_structure
    from ..structure.sizing import SizingRound, size_members, weight_curve
    from ..structure.statics import factor_stiffness, solve

    rounds: list[SizingRound] = []
    weights = None
    if settings.size:
        plain, truss = truss, size_members(truss, settings.size, settings.checks, rounds, by=settings.size_by)
        if weighed:
            weights = weight_curve(plain, truss, settings.size, settings.checks, settings.size_by)
    factored = factor_stiffness(truss)
    solution = solve(truss, factored)
    bars("modes", 0.4)
    modes = settings.buckling or int(settings.size > 0)
    buckling = worst_buckling(factored, solution, modes) if modes else None
    vibration = vibration_modes(factored, settings.frequencies) if settings.frequencies else None
    del factored  # a path makes its own, and they are large
    path = _path(truss, settings, bars) if settings.path else None
    bars("checks", 0.8)
    found: dict[str, Any] = {
        "buckling": buckling, "vibration": vibration, "path": path, "rounds": rounds, "weights": weights
    }  # fmt: skip
    return solution, report_structure(solution, settings.checks, doubts_of_settings(settings, grid), **found)


def _print_report(report: StructureReport, supports: str, of_grid: Sequence[str], wrote: Sequence[Path]) -> None:
    """Print the table of a structure, its lines, its warnings and the files that were written; supports: as asked for."""
    from ..report.structural.words import supports_in_words
    from ..report.terminal import print_lines, print_table
    from ..structure.doubts import support_words
    from ..structure.report_lines import (
        STRUCTURE_HEAD,
        half_lines,
        mode_lines,
        node_lines,
        sizing_lines,
        structure_lines,
        unlisted_lines,
    )

    truss = report.truss
    print_table(STRUCTURE_HEAD, structure_lines(report))
    counts = report.to_dict()["sections"]
    names = (
        " ".join(f"{name} ({count:,})" for name, count in counts.items()) if len(counts) > 1 else truss.sections[0].name
    )
    print_lines(
        [
            *unlisted_lines(report),
            *half_lines(report),
            f"{len(truss.nodes):,} nodes, {len(truss.members):,} members of {names} {truss.material.name},"
            f" {truss.lengths.mean():.3g} m long on average, {truss.mass:,.0f} kg without nodes",
            *node_lines(truss),
            f"{support_words(truss)}{f', {supports_in_words(supports)}' if supports else ''}",
            *sizing_lines(report),
            *mode_lines(report),
            *(
                []
                if report.buckling or report.path
                else ["the stability of the whole is not looked at; --buckling 1 does"]
            ),
            *(f"warning: {words}" for words in report.warnings),
            *_line_of_grid(of_grid, listed=any(place.suffix.lower() in (".html", ".pdf") for place in wrote)),
            f"wrote {' '.join(map(str, wrote))}",
        ]
    )


def _line_of_grid(of_grid: Sequence[str], *, listed: bool) -> list[str]:
    """Return one line on the faults and warnings of the certificate of the grid; listed: whether a report was written, with all."""
    if len(of_grid) < 2:
        return [f"warning: {words}" for words in of_grid]
    first, where = of_grid[0].partition(" (near ")[0], "the report" if listed else "a report (.html, .pdf)"
    return [f"warning: the certificate of the grid has {len(of_grid)} warnings, all in {where}: {first}, ..."]


def _encoded(
    out: Path,
    values: Namespace,
    settings: StructureSettings,
    solution: Solution,
    report: StructureReport,
    of_grid: Sequence[str],
) -> bytes:
    """Return what a report or a picture of the structure holds."""
    from ..report.structural.contents import overview_picture, report_parts
    from ..report.structural.source import ReportSource

    if out.suffix.lower() == ".png":
        from ..export.drawing.structure import encode_structure_picture

        return encode_structure_picture(solution.truss, overview_picture(solution, report))
    from ..export.formats import model_of
    from ..export.page import encode_page
    from ..export.style import FileStyle
    from ..report.structural.html import encode_html
    from ..report.structural.pdf import encode_pdf

    source = ReportSource(Path(values.grid).name, _command_line(values), settings, solution, report, of_grid)
    parts = report_parts(source)
    if out.suffix.lower() == ".pdf":
        return encode_pdf(parts)
    return encode_html(parts, encode_page(model_of(solution, report=report), FileStyle()))


def _command_line(values: Namespace) -> str:
    """Return the command line with these values."""
    words = ["scantruss", "structure", values.grid, *map(str, outs_of(values))]
    for name in ("settings", "report", "path_plot", *(name for name, _, _ in OWN_OPTIONS)):
        if vars(values).get(name) is not None:
            words += [f"--{name.replace('_', '-')}", f"{vars(values)[name]}"]
    return shlex.join([*words, *["--decimal-comma"] * values.decimal_comma, *["--keep-failed"] * values.keep_failed])


def _path(truss: Truss, settings: StructureSettings, progress: Progress) -> StructurePath:
    """Return the nonlinear path that the settings ask for."""
    from ..structure.nonlinear import solve_path

    return solve_path(
        truss,
        "" if settings.path == "worst" else settings.path,
        imperfection=settings.imperfection,
        steps=settings.path_steps,
        stop_factor=settings.path_factor or None,
        progress=progress,
    )


def structure_settings(values: Namespace) -> StructureSettings:
    """Return the settings of a command line: those of ``--settings``, overridden by explicit options."""
    from ..structure.options import StructureSettings, loads_of_words, read_structure_settings

    kept = read_structure_settings(values.settings) if values.settings else StructureSettings()
    given = {spec.name: vars(values)[spec.name] for spec in fields(StructureSettings) if spec.name in vars(values)}
    if "loads" in given:
        given["loads"] = loads_of_words(given["loads"])
    return kept.replace(**given)


def _inputs(values: Namespace) -> Taken:
    """Return the files that the command line names for reading."""
    named = [(values.grid, "grid"), (values.settings, "settings")]
    words = [*str(vars(values).get("loads", "")).split(",")]
    words += [str(vars(values).get(name, "")).partition(".csv:")[0] for name in ("section", "material", "supports")]
    named += [(word, "file of the structure") for word in words if word and Path(word).is_file()]
    return {Path(name).resolve(): what for name, what in named if name}


def _arguments(grid: Grid, settings: StructureSettings) -> dict[str, Any]:
    """Return the settings as `Truss.from_grid` takes them."""
    from ..structure.variants import truss_arguments

    given = truss_arguments(settings)
    if Path(settings.supports).is_file():
        given["supports"] = _nodes_near(grid, settings.supports)
    return given


def _nodes_near(grid: Grid, path: str) -> np.ndarray:
    """Return the nodes at the positions of a file, each within half a member."""
    import numpy as np

    from .positions import read_positions

    found, reach = [], float(grid.lengths.mean()) / 2
    for place in read_positions(path):
        distance = np.linalg.norm(grid.scan_nodes - place, axis=1)
        if distance.min() > reach:
            words = ", ".join(f"{c:g}" for c in place)
            raise InputError(f"{path}: no node lies within half a member, {reach:.3g} {grid.unit}, of {words}")
        found.append(int(distance.argmin()))
    return np.unique(found)
