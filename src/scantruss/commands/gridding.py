"""``scantruss info``, ``grid``, ``print`` and ``demo``.

Outputs and settings are checked before anything is read; everything heavy is imported inside the functions.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from ..errors import CertificateError, FormatError, InputError
from ..settings import CURVATURE

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..options import Parser
    from ..report.terminal import Bars
    from ..scan.cloud import PointCloud
    from ..settings import Settings


SCAN = "scan file, or a pattern in quotes such as 'tiles/*.laz': several files that are one scan"


def info_parser() -> Parser:
    """Options of ``scantruss info``."""
    from ..options import READING, Parser, add_settings

    parser = Parser(
        "info", "SCAN [options]", "Points, extent, spacing and boundaries of a scan, and a sensible range for --length."
    )
    parser.add_argument("scan", metavar="SCAN", help=SCAN)
    add_memory(parser)
    add_settings(parser, ("length", "method", "thin_spacing", *READING))
    return parser


def info(values: Namespace) -> None:
    """Print what a scan holds."""
    from ..options import settings_of
    from ..pipeline import check_length, suggest_length
    from ..report.figures import cloud_lines, loop_rows
    from ..report.terminal import Bars, print_lines, print_table

    given = "length" in values
    settings = settings_of(values if given else Namespace(**vars(values), length=1.0))
    with Bars() as bars:
        settings = thin_to_fit(values.scan, settings, values.memory)
        if settings.thin_spacing and not given and "thin_spacing" not in values:
            from ..scan.fit import spacing_to_look

            settings = settings.replace(thin_spacing=spacing_to_look(values.scan, settings))
        cloud = read_scan(values.scan, settings, bars)
        print_lines(cloud_lines(cloud))
        settings = settings if given else settings.replace(length=suggest_length(cloud))
        check_length(cloud, settings)
        with note_compiling(bars, settings.method, "boundary"):
            from ..boundary import find_boundary

            boundary = find_boundary(cloud, settings, progress=bars)
        note_strays(bars, cloud, settings)
    field = boundary.sites.surface.field
    longest = f" to {settings.length * field.max():.4g}" if settings.length_field else ""
    print_lines([f"boundaries for members of {settings.length:g}{longest} {cloud.unit}".rstrip() + ":"])
    if boundary.loops:
        print_table(("boundary", "length", "corners"), loop_rows(boundary))
    else:
        print_lines(["none, the scan is closed"])


def grid_parser() -> Parser:
    """Options of ``scantruss grid``."""
    from ..options import Parser, add_settings

    parser = Parser(
        "grid",
        "SCAN OUT [OUT ...] --length L [options]",
        "Turn a scan into a triangular grid truss of a desired member length.",
    )
    parser.add_argument("scan", metavar="SCAN", help=SCAN)
    parser.add_argument("outs", metavar="OUT", nargs="+", help="results; the suffix names the format")
    files = parser.add_argument_group("files")
    files.add_argument(
        "--settings", metavar="FILE", help="settings saved beside an earlier result; options given here win"
    )
    files.add_argument("--fixed-file", metavar="FILE", help="positions that must become nodes: X,Y,Z a line")
    files.add_argument("--report", metavar="FILE.json", help="save all figures of the run")
    files.add_argument(
        "--keep-failed",
        action="store_true",
        help="write a grid that fails its certificate too; the exit status is 3 either way",
    )
    add_memory(parser)
    add_settings(parser)
    return parser


def add_memory(parser: Parser) -> None:
    """Add the option that says how large a scan may be."""
    from ..options import size_of_memory

    parser.add_argument(
        "--memory",
        metavar="SIZE",
        type=size_of_memory,
        help="a larger scan is thinned, as 4GB (default: half of what is free)",
    )


def grid(values: Namespace) -> None:
    """Make a grid and save it with its settings."""
    from ..options import settings_of
    from ..report.figures import report_of
    from ..report.saving import SaveTogether
    from ..report.terminal import Bars

    settings = settings_of(values)
    outs = [Path(out) for out in values.outs]
    settings_file = outs[0].with_suffix(".settings.json")
    report = Path(values.report) if values.report else None
    check_outputs(values, outs, settings_file, report)
    with Bars() as bars:
        started = perf_counter()
        settings = thin_to_fit(values.scan, settings, values.memory)
        cloud = read_scan(values.scan, settings, bars)
        spent = perf_counter() - started
        result = make_grid(cloud, settings, bars, keep_failed=values.keep_failed, read_seconds=spent)
    from ..export.formats import write

    written: list[Path] = []
    with SaveTogether() as save:
        for out in outs:
            written += [out.with_name(file.name) for file in write(result, save.beside(out), cloud=cloud)]
        save.json(settings_file, (result.settings or settings).to_dict())
        if report is not None:
            save.json(report, report_of(result, len(cloud.points)))
    show_grid(result, len(cloud.points), [*written, settings_file, *([report] if report else [])])
    if result.certificate is not None and not result.certificate.passed:
        raise CertificateError("the grid fails its certificate, and was written because of --keep-failed")


def check_outputs(values: Namespace, outs: list[Path], settings_file: Path, report: Path | None) -> None:
    """Refuse outputs that cannot be written, before anything is read or computed."""
    from ..export.csv_file import nodes_path
    from ..export.files import check_place
    from ..export.formats import check_output
    from ..scan.paths import files_of

    inputs = [(str(file), "scan") for file in files_of(values.scan)]
    inputs += [(values.settings, "settings"), (values.fixed_file, "list of fixed nodes")]
    if isinstance(length := vars(values).get("length"), str) and not length.startswith(CURVATURE):
        inputs.append((length, "file of lengths"))
    inputs += [(name, "fixed line") for name in getattr(values, "fixed_lines", ())]
    inputs += [(name, "polygon") for name in getattr(values, "crop", ()) if Path(name).is_file()]
    taken = {Path(name).resolve(): what for name, what in inputs if name}
    for out in outs:
        _take(check_output(out), "grid", taken)
        if out.suffix.lower() == ".csv":
            _take(nodes_path(out), "table of nodes", taken)
    if report is not None:
        _take(check_place(report, (".json",)), "report", taken)
    check_place(settings_file, (".json",))
    if taken.get(settings_file.resolve(), "settings") != "settings":  # a run may repeat the settings it saved itself
        raise FormatError(f"{settings_file} is where the settings of this run are saved; name another file")


def _take(path: Path, what: str, taken: dict[Path, str]) -> None:
    """Claim a path for an output, unless something else is there."""
    if (before := taken.get(path.resolve())) is not None:
        raise FormatError(f"the {what} {path} would overwrite the {before}; name another file")
    taken[path.resolve()] = what


def read_scan(path: str, settings: Settings, bars: Bars) -> PointCloud:
    """Read a scan, and say so where points were left out."""
    from ..scan.readers import read_points

    bars("read", 0.0)
    if settings.thin_spacing:
        cloud = read_thinned_scan(path, settings, bars)
    else:
        cloud = read_points(path, unit=settings.unit, selection=settings.selection)
    bars("read", 1.0)
    for note in cloud.notes:
        bars.note(note)
    if cloud.dropped:
        bars.note(f"{cloud.dropped} points with NaN or infinite coordinates are left out")
    return cloud


def said_of_cloud_file(out: Path, unit: str) -> list[str]:
    """What to say of a cloud that is written: what its format has places for and is not kept, and a unit that it assumes."""
    suffix = out.suffix.lower()
    if suffix in (".las", ".laz"):
        return ["classes, returns, colours and reference system are not kept; --class and --returns choose before"]
    if suffix == ".e57" and not unit:
        return [
            "E57 is in metres, and the unit of the scan is not known: its numbers are written as metres; --unit says it"
        ]
    return []


def thin_to_fit(path: str, settings: Settings, memory: float | None) -> Settings:
    """Return the settings with the spacing to which a scan must be thinned, where it is larger than memory."""
    from ..scan.fit import spacing_to_fit

    spacing = spacing_to_fit(path, settings, memory)
    return settings.replace(thin_spacing=spacing) if spacing else settings


def read_thinned_scan(path: str, settings: Settings, bars: Bars) -> PointCloud:
    """Read a scan that is thinned while it is read, and say so."""
    from ..scan.fit import read_thinned

    with note_compiling(bars):
        cloud, read = read_thinned(path, settings, bars)
    unit = f" {cloud.unit}" if cloud.unit else ""
    bars.note(
        f"thinned while it was read, from {read:,} points to {len(cloud.points):,} in boxes of {settings.thin_spacing:g}{unit};"
        " --thin-spacing 0 takes all"
    )
    return cloud


def make_grid(
    cloud: PointCloud, settings: Settings, bars: Bars, *, keep_failed: bool = False, read_seconds: float = 0.0
) -> Grid:
    """Run the chain, and say so where kernels must be compiled."""
    from ..ahead import CompileAhead
    from ..pipeline import check_length, grid_from_cloud

    check_length(cloud, settings)
    said = note_compiling(bars, settings.method, "boundary", "front", "optimize")
    with said, CompileAhead(settings.method, bars) as progress:
        grid = grid_from_cloud(cloud, settings, progress=progress, keep_failed=keep_failed, read_seconds=read_seconds)
    if grid.settings is not None and grid.settings.ridge_angle != settings.ridge_angle:
        bars.note("no grid keeps the ridges of this scan, so it is made without, as with --ridge-angle 0")
    if grid.settings is not None and grid.settings.box_size != settings.box_size:
        bars.note(
            f"no finer look at this scan gives a grid that passes, so it is made as with --box-size {grid.settings.box_size:g}"
        )
    if grid.settings is not None and grid.settings.method != settings.method:
        bars.note("no grid of the default method passes its certificate here, so it is made by that of the paper")
    note_strays(bars, cloud, settings)
    return grid


def note_strays(bars: Bars, cloud: PointCloud, settings: Settings) -> None:
    """Say so where stray points were left out."""
    from ..scan.sites import prepare_sites

    sites = prepare_sites(cloud, settings)
    if sites.repeated:
        bars.note(f"{sites.repeated:,} repeated points are left out; --no-drop-repeated keeps them")
    if sites.strays:
        bars.note(f"{sites.strays:,} stray points are left out; --stray-distance 0 keeps them")


@contextmanager
def note_compiling(bars: Bars, method: str = "default", *stages: str) -> Iterator[None]:
    """Say so, once, where kernels must be compiled, which takes long: at the start where the stages are known to need it."""
    from ..ahead import are_compiled, can_be_stored
    from ..kernels.compile import tell_of_compiling

    def tell() -> None:
        bars.note("compiling kernels, once on this machine" if can_be_stored() else "compiling kernels")

    if are_compiled(method, *stages):
        with tell_of_compiling(tell):
            yield
    else:
        tell()
        yield


def show_grid(result: Grid, points: int, written: Sequence[Path]) -> None:
    """Print the figures of Table 2, the worst places and what was written."""
    from ..report.figures import certificate_rows, grid_lines, quality_rows
    from ..report.terminal import print_lines, print_table

    print_table(("", "before", "after optimization"), quality_rows(result))
    if result.certificate is not None:
        print_table(("worst", "", "at"), certificate_rows(result.certificate))
    print_lines([*grid_lines(result, points), "wrote " + " ".join(map(str, written))])


def print_parser() -> Parser:
    """Options of ``scantruss print``."""
    from ..options import Parser, number

    usage = "GRID OUT.3mf|OUT.stl --member-diameter D --node-diameter D [--scale S]"
    parser = Parser("print", usage, "Make one watertight solid, members and nodes, for a 3D printer.")
    parser.add_argument("grid", metavar="GRID", help="grid saved as .json by scantruss grid")
    parser.add_argument("out", metavar="OUT", help="model, .3mf or .stl")
    parser.add_argument("--member-diameter", metavar="D", type=number, required=True, help="diameter of the members")
    parser.add_argument("--node-diameter", metavar="D", type=number, required=True, help="diameter of the nodes")
    parser.add_argument("--scale", metavar="S", type=number, default=1.0, help="scale of the model (default 1)")
    return parser


def print_solid(values: Namespace) -> None:
    """Make the printable model of a saved grid."""
    from ..export.files import check_place
    from ..report.saving import SaveTogether
    from ..report.terminal import print_lines

    out = check_place(values.out, (".3mf", ".stl"))
    if not Path(values.grid).exists():
        raise InputError(f"there is no file {values.grid}; print needs a grid saved as .json by scantruss grid")
    if out.exists() and out.samefile(values.grid):
        raise FormatError(f"the model {out} would overwrite the grid; name another file")
    from ..export.json_file import read_grid
    from ..export.solid import print_model

    result = read_grid(values.grid)
    with SaveTogether() as save:
        solid = print_model(
            result,
            save.beside(out),
            member_diameter=values.member_diameter,
            node_diameter=values.node_diameter,
            scale=values.scale,
        )
    size = " x ".join(f"{side:.4g}" for side in solid.vertices.max(axis=0) - solid.vertices.min(axis=0))
    bodies = "one watertight solid" if solid.components == 1 else f"{solid.components} watertight solids"
    print_lines([*solid.notes, *said_of_model(out, solid.unit), f"wrote {out}: {bodies}, {size} {solid.unit}".rstrip()])


def said_of_model(out: Path, unit: str) -> list[str]:
    """What to say of the unit that a printer will take a model for."""
    if out.suffix.lower() == ".stl" and unit != "mm":
        return [
            f"STL holds no unit and printers take it for mm; its numbers are {unit or 'of a unit that is not known'}"
        ]
    if not unit:
        return ["the unit of the grid is not known, so the model says mm; scantruss grid --unit says it"]
    return []


def demo_parser() -> Parser:
    """Options of ``scantruss demo``."""
    from ..options import Parser

    parser = Parser(
        "demo", "[FOLDER]", "Make grid, report, picture and printable model of a bundled scan, the bust of Nefertiti."
    )
    parser.add_argument(
        "folder", metavar="FOLDER", nargs="?", default="scantruss-demo", help="default ./scantruss-demo"
    )
    return parser


def demo(values: Namespace) -> None:
    """Do the main job on the bundled scan."""
    from ..demo import SCAN, demo_settings, save_demo
    from ..report.terminal import Bars

    folder = Path(values.folder)
    if folder.exists() and not folder.is_dir():
        raise FormatError(f"{folder} is a file; name a folder for the demo")
    with Bars() as bars:
        cloud = read_scan(str(SCAN), demo_settings(), bars)
        result = make_grid(cloud, demo_settings(), bars)
        bars("picture, solid", 0.0)
        written = save_demo(folder, result, cloud)
    show_grid(result, len(cloud.points), written)
