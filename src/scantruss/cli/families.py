"""The command ``scantruss families``: members of few lengths, few different joints or panels."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..grid.alike import JOINTS, LENGTHS, PANELS
from .outputs import claim, outs_of
from .styles import add_styles, style_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..grid.grid import Grid
    from ..layouts.alike import PartKinds
    from ..layouts.families import Families
    from ..layouts.on_scan import ScanOfGrid
    from .options import Parser

    OffScan = Callable[[Grid], float] | None
    Outcome = tuple[dict[str, Any], list[str], Callable[[], bytes]]

USUAL_LENGTHS = 12  # that are aimed at
WARNED_OFF_SCAN = 0.05  # distance of a node from the scan that is warned of beyond [mean members]
MIRROR_IMAGES = ("different", "same")  # what mirror images are


def families_parser() -> Parser:
    """Options of ``scantruss families``."""
    from .options import Parser, add_outs, share, whole_number

    parser = Parser(
        "families",
        "GRID OUT [OUT ...] [--parts lengths|joints|panels] [--tolerance 1%%] [--count 12] [--scan SCAN] [options]",
        "Move the nodes of a saved grid along its surface, so that its members have few lengths, or its joints or panels are of few kinds.",
    )
    parser.add_argument("grid", metavar="GRID", help="grid saved as .json by scantruss grid")
    add_outs(parser, "results; the suffix names the format", "*")
    parser.add_argument(
        "--parts",
        choices=(LENGTHS, JOINTS, PANELS),
        default=LENGTHS,
        help="what is made alike: lengths of members, joints (the directions of their members) or panels (default lengths)",
    )
    parser.add_argument(
        "--tolerance",
        metavar="SHARE",
        type=share,
        default=0.01,
        help="largest misfit of a member, as a share of the mean member; root mean square of the directions of a joint or of the corners"
        " of a panel (default 1%%)",
    )
    parser.add_argument(
        "--count",
        metavar="COUNT",
        type=whole_number,
        help=f"lengths or kinds to aim at (default {USUAL_LENGTHS} lengths; of joints and panels as few kinds as possible)",
    )
    parser.add_argument(
        "--mirrored",
        choices=MIRROR_IMAGES,
        help="whether mirror images of joints or panels are of one kind, as flat panels are if they may be turned over (default different)",
    )
    parser.add_argument(
        "--uneven",
        metavar="SHARE",
        type=share,
        help="for joints: by how much members may differ from the mean one, except those that already differ more (default 20%%)",
    )
    parser.add_argument("--scan", metavar="SCAN", help="scan to check the new grid against, for its certificate")
    parser.add_argument(
        "--report",
        metavar="FILE",
        help="families with their members, or kinds with their parts, before and after, .json",
    )
    parser.add_argument(
        "--plot",
        metavar="FILE.png",
        help="number of lengths or kinds against the largest misfit and, with --scan, against the distance from the scan",
    )
    parser.add_argument(
        "--keep-failed", action="store_true", help="also accept and write a grid that fails its certificate"
    )
    add_styles(parser)
    return parser


def families(values: Namespace) -> None:
    """Write a saved grid with members of few lengths, or few kinds of joints or panels."""
    from ..export.formats import GRID, check_output
    from ..report.terminal import Bars, print_lines
    from ..runtime.files import SaveTogether
    from ..runtime.places import check_place
    from .convert import claim_models, write_models

    outs = [check_output(out, GRID) for out in outs_of(values)]
    if not Path(values.grid).exists():
        raise InputError(f"there is no file {values.grid}; families needs a grid saved as .json by scantruss grid")
    report = None if values.report is None else check_place(values.report, (".json",))
    plot = None if values.plot is None else check_place(values.plot, (".png",))
    taken = {Path(name).resolve(): what for name, what in ((values.grid, "grid"), (values.scan, "scan")) if name}
    if values.parts == LENGTHS and values.mirrored is not None:
        raise InputError("lengths have no mirror images; leave --mirrored out, or use --parts joints or panels")
    if values.parts != JOINTS and values.uneven is not None:
        raise InputError(f"--uneven is for --parts joints; leave it out with {values.parts}")
    claim_models(outs, taken, force=values.force)
    for place, what in ((report, "report"), (plot, "picture")):
        if place is not None:
            claim(place, what, taken, force=values.force)
    from ..export.json import read_grid
    from ..export.model import model_of_grid
    from ..grid.certificate import check_passed
    from ..layouts.families import Families

    with Bars() as bars, SaveTogether("" if values.force else "result") as save:
        bars("read", 0.0)
        before = read_grid(values.grid)
        check_passed(before, values.keep_failed)
        bars("families", 0.1)
        found = _alike(before, values)
        scan = _scan_of(before, values) if values.scan else None
        made = scan.certified(found.grid, keep_failed=values.keep_failed) if scan else found.grid
        off_scan = scan and scan.farthest_node
        if isinstance(found, Families):
            figures, words, picture = _of_lengths(before, found, values, off_scan)
        else:
            figures, words, picture = _of_kinds(before, found, values, off_scan)
        wrote = write_models(model_of_grid(made), outs, save, bars, style_of(values))
        if report is not None:
            save.json(report, figures)
        if plot is not None:
            save.beside(plot).write_bytes(picture())
    wrote += [place for place in (report, plot) if place is not None]
    print_lines([*words, *_verdict(made, values), f"wrote {' '.join(map(str, wrote))}"])


def _scan_of(grid: Grid, values: Namespace) -> ScanOfGrid:
    """Read the scan with the settings of a grid."""
    from ..layouts.on_scan import ScanOfGrid
    from ..scan.formats.reading import read_points

    if (settings := grid.settings) is None:
        raise InputError(f"{values.grid} does not say with which settings it was made; leave --scan out")
    return ScanOfGrid.of(read_points(values.scan, settings.unit, settings.selection), settings)


def _alike(before: Grid, values: Namespace) -> Families | PartKinds:
    """Return the grid with its lengths, joints or panels alike."""
    from ..layouts.families import few_lengths
    from ..layouts.joints_alike import USUAL_UNEVENNESS, few_joints
    from ..layouts.panels_alike import few_panels

    if values.parts == LENGTHS:
        return few_lengths(before, values.tolerance, _lengths_wanted(values))
    count, mirrored = 1 if values.count is None else values.count, values.mirrored == MIRROR_IMAGES[1]
    if values.parts == JOINTS:
        uneven = USUAL_UNEVENNESS if values.uneven is None else values.uneven
        return few_joints(before, values.tolerance, count, mirrored=mirrored, uneven=uneven)
    return few_panels(before, values.tolerance, count, mirrored=mirrored)


def _lengths_wanted(values: Namespace) -> int:
    """Return how many lengths are aimed at."""
    return USUAL_LENGTHS if values.count is None else int(values.count)


def _of_lengths(before: Grid, found: Families, values: Namespace, off_scan: OffScan) -> Outcome:
    """Return the figures of lengths, the same in words, and what draws them."""
    from ..export.drawing.families import encode_lengths
    from ..layouts.families import family_report
    from ..layouts.trade import traded_lengths

    figures = family_report(before, found, values.tolerance)

    def picture() -> bytes:
        trade = list(traded_lengths(before, values.tolerance, off_scan=off_scan))
        return encode_lengths(trade, None if off_scan is None else off_scan(before) / float(before.lengths.mean()))

    return figures, _words(figures), picture


def _of_kinds(before: Grid, found: PartKinds, values: Namespace, off_scan: OffScan) -> Outcome:
    """Return the figures of joints or panels, the same in words, and what draws them."""
    from ..export.drawing.families import encode_kinds
    from ..layouts.alike import kinds_report
    from ..layouts.trade import Traded, traded_kinds

    figures = kinds_report(before, found, values.tolerance)
    trade: list[Traded] = []
    if values.report is not None or values.plot is not None:
        trade = traded_kinds(before, found, off_scan)
        figures["trade"] = [each.to_dict() for each in trade]
    words = _words_of_kinds(figures, values.parts)
    far = 0.0 if off_scan is None else off_scan(found.grid) / float(before.lengths.mean())
    if far > WARNED_OFF_SCAN:
        words.append(
            f"warning: a node is {far:.2g} members off the scan; more kinds, by --count, keep nodes nearer: see the trade of --report"
        )
    return figures, words, lambda: encode_kinds(trade, values.parts)


def _words(figures: dict[str, Any]) -> list[str]:
    """Return what has come out in words."""
    lines = [
        f"{what} of the mean member: {each['before']} lengths before, {each['after']} after"
        for what, each in figures["lengths_needed"].items()
    ]
    lines.append(
        f"{len(figures['families'])} families hold {100 * figures['members_within']:.3g} % of the members,"
        f" the largest misfit is {100 * figures['misfit_max']:.3g} %, nodes moved by {figures['moved_max']:.2g} members at most"
    )
    if figures["members_within"] < 1:
        lines.append("warning: some members are in no family within the tolerance; use a larger --count or --tolerance")
    return lines


def _words_of_kinds(figures: dict[str, Any], parts: str) -> list[str]:
    """Return what has come out of joints or panels in words."""
    counted = "nodes" if parts == JOINTS else "panels"
    kinds = figures["kinds"]
    return [
        f"{figures['kinds_before']} kinds of {parts} before, {len(kinds)} after, of {sum(each[counted] for each in kinds)} {parts},"
        f" within {100 * figures['tolerance']:g} %{', mirror images alike' if figures['mirror_images_alike'] else ''}",
        f"the largest misfit is {100 * figures['misfit_max']:.3g} %, nodes moved by {figures['moved_max']:.2g} members at most,"
        f" lengths vary by {100 * figures['length_cv']:.3g} %",
    ]


def _verdict(made: Grid, values: Namespace) -> list[str]:
    """Return what the certificate of the new grid says, or that it has none."""
    from ..report.figures import warning_lines

    if made.certificate is None or not values.scan:
        return ["the grid has no certificate now; --scan SCAN checks it again"]
    return [f"certificate: {made.certificate}", *warning_lines(made.certificate)]
