"""``scantruss thin``: thin a scan of any size; and the options for workers."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from .outputs import claim_clouds
from .shared import cloud_file_notes, note_compiling, report_cloud

if TYPE_CHECKING:
    from ..report.terminal import Bars
    from ..runtime.cluster import Workers
    from .options import Parser
POINTS_FOR_WORKERS = 20_000_000  # points of which several workers thin a scan by default


def thin_parser() -> Parser:
    """Options of ``scantruss thin``."""
    from .options import Parser, add_outs, add_reading, number

    parser = Parser(
        "thin",
        "SCAN... -o OUT --spacing S [options]",
        "Thin a scan of any size to one point per box; only the result is kept in memory.",
    )
    parser.add_argument(
        "scans", metavar="SCAN", nargs="+", help="scan files, or patterns in quotes such as 'tiles/*.laz'"
    )
    add_outs(parser, "thinned scan; the suffix names the format")
    parser.add_argument("--spacing", metavar="S", type=number, required=True, help="side of a box [scan unit]")
    parser.add_argument(
        "--keep",
        metavar="mean|nearest",
        default="mean",
        help="what is kept of a box: the mean of its points (default), or the point nearest to it",
    )
    parser.add_argument(
        "--boundary", dest="outermost", action="store_true", help="also keep the outermost points at the boundary"
    )
    add_workers(parser)
    add_reading(parser)
    return parser


def add_workers(parser: Parser) -> None:
    """Add the options for workers."""
    from .options import whole_number

    parser.add_argument(
        "--workers", metavar="N", type=whole_number, help="worker processes on this machine; 1: this process only"
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", default="", help="Dask cluster, e.g. tcp://10.0.0.5:8786")


def thin(values: Namespace) -> None:
    """Thin a scan and write it."""
    from ..report.terminal import Bars, print_lines
    from ..runtime.files import SaveTogether
    from ..scan.formats.writing import write_points
    from ..scan.stream.opened import open_scan
    from ..scan.stream.thin_scan import check_enough, thin_open_scan
    from ..scan.stream.thinning import check_spacing
    from .options import selection_of

    check_spacing(values.spacing)
    outs, _ = claim_clouds(values, "thinned scan")
    scan = open_scan(values.scans, getattr(values, "unit", ""), selection_of(values))
    sources = scan.sources
    few = sum(source.points for source in sources) < POINTS_FOR_WORKERS
    with Bars() as bars, workers_of(values, bars, 1 if few else None) as workers:
        for source in sources:
            if source.whole and source.points > POINTS_FOR_WORKERS:
                bars.note(f"{source.path} cannot be read in parts, so it is read whole")
        with note_compiling(bars):
            result = thin_open_scan(
                scan, values.spacing, keep=values.keep, boundary=values.outermost, workers=workers, progress=bars
            )
        check_enough(result, values.spacing, "--spacing")
        report_cloud(bars, result)
        bars("write", 0.0)
        with SaveTogether("" if values.force else "cloud") as save:
            for out in outs:
                write_points(save.beside(out), result.points, unit=result.unit)
    boundary = f", {result.boundary:,} of them along the boundary" if values.outermost else ""
    line = f"{result.read:,} points thinned to {len(result.points):,}{boundary}; wrote {' '.join(map(str, outs))}"
    print_lines([line, *(note for out in outs for note in cloud_file_notes(out))])


def workers_of(values: Namespace, bars: Bars, count: int | None) -> Workers:
    """Return the workers of the command line, with a note if there are several."""
    from ..runtime.cluster import open_workers

    workers = open_workers(count if values.workers is None else values.workers, values.scheduler)
    if not workers.alone:
        bars.note(workers.words)
    return workers
