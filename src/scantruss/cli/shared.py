"""What several commands share: read a scan, thin it to fit, and report what a user should know about it."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import unit_words, words_of_number, words_of_place

if TYPE_CHECKING:
    import numpy as np

    from ..grid.certificate import Certificate
    from ..report.terminal import Bars
    from ..scan.cloud import PointCloud
    from ..scan.stream.thin_scan import Thinned
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples
    from .options import Parser

# least share of the surface that has two layers, from which on a twentieth of the points is off a grid of one sheet, and distance within
# which all others lie where it follows both [distance of the layers]
LEAST_SHARE_OF_LAYERS, NEAR_BOTH_LAYERS = 0.15, 0.35
MOST_PIECES = 5  # pieces that are named one by one
SHORTEST_ADVISED, LONGEST_ADVISED = 1.1, 2.0  # members that are advised where corners are doubtful [member lengths]
SCAN_HELP = "scan file, or a pattern in quotes such as 'tiles/*.laz': several files that are one scan"


def add_memory(parser: Parser) -> None:
    """Add the option that says how large a scan may be."""
    from .options import size_of_memory

    parser.add_argument(
        "--memory",
        metavar="SIZE",
        type=size_of_memory,
        help="memory that a scan may take, e.g. 4GB; a larger scan is thinned (default: half of the free memory)",
    )


def read_scan(path: str, settings: Settings, bars: Bars) -> PointCloud:
    """Read a scan, and report points that are left out."""
    from ..scan.formats.reading import read_points

    bars("read", 0.0)
    if settings.thin_spacing:
        cloud = read_thinned_scan(path, settings, bars)
    else:
        cloud = read_points(path, unit=settings.unit, selection=settings.selection)
    bars("read", 1.0)
    report_cloud(bars, cloud)
    return cloud


def report_cloud(bars: Bars, cloud: PointCloud | Thinned, name: str = "") -> None:
    """Report what was left out or converted, with the name of the cloud if it is one of several."""
    notes = list(cloud.notes)
    if cloud.dropped:
        notes.append(f"{cloud.dropped:,} points with NaN or infinite coordinates are left out")
    for note in notes:
        bars.note(note if name in note else f"{name}: {note}")


def cloud_file_notes(out: Path, *, selects: bool = True) -> list[str]:
    """Notes on a cloud that is written: what its format could hold but is not kept.

    `selects`: the command has options for taking points by class and return.
    """
    suffix = out.suffix.lower()
    if suffix in (".las", ".laz"):
        more = "; choose points by --class and --returns" if selects else ""
        return [f"classes, returns, colours and reference system are not kept{more}"]
    return []


def thin_to_fit(path: str, settings: Settings, memory: float | None) -> Settings:
    """Return the settings with the spacing to which a scan must be thinned, where it is larger than memory."""
    from ..scan.stream.fit import spacing_to_fit

    spacing = spacing_to_fit(path, settings, memory)
    return settings.replace(thin_spacing=spacing) if spacing else settings


def with_some_length(values: Namespace) -> Namespace:
    """Return the values of a command line with a length that is to be chosen later, where none is given."""
    from .options import has_length

    return values if has_length(values) else Namespace(**(vars(values) | {"length": 1.0}))


def settings_to_read(values: Namespace, settings: Settings, bars: Bars) -> Settings:
    """Return the settings with which a scan fits into memory; for one without a length yet, those of a first look."""
    from .options import has_length

    settings = thin_to_fit(values.scan, settings, values.memory)
    if settings.thin_spacing and not has_length(values) and "thin_spacing" not in values:
        from ..scan.stream.fit import spacing_to_look

        settings = settings.replace(thin_spacing=spacing_to_look(values.scan, settings, bars))
    return settings


def read_thinned_scan(path: str, settings: Settings, bars: Bars) -> PointCloud:
    """Read a scan while thinning it, and report that."""
    from ..scan.stream.fit import read_thinned

    with note_compiling(bars):
        cloud, read = read_thinned(path, settings, bars)
    unit = f" {cloud.unit}" if cloud.unit else ""
    bars.note(
        f"thinned while it was read, from {read:,} points to {len(cloud.points):,}, in boxes of {settings.thin_spacing:g}{unit};"
        " --thin-spacing 0 keeps all points"
    )
    return cloud


def note_outliers(
    bars: Bars, cloud: PointCloud, settings: Settings, command: str = "", listed: Certificate | None = None
) -> None:
    """Report points that were left out of the scan, and the option that keeps them; `command` is named if it is of another command.

    listed : certificate that lists the pieces that were left out, if there is one: they may hang on a limb
    """
    from ..surface.samples import sample_surface

    samples = sample_surface(cloud, settings)
    say = f"{command} " if command else ""
    if samples.repeated:
        bars.note(f"{samples.repeated:,} duplicate points are left out; {say}--no-drop-duplicates keeps them")
    if samples.outliers:
        one = samples.outliers == 1
        say_outliers = "1 outlier is left out" if one else f"{samples.outliers:,} outliers are left out"
        bars.note(f"{say_outliers}; {say}--outlier-distance 0 keeps {'it' if one else 'them'}")
    pieces, share = samples.left_out
    if pieces and listed is None:
        bars.note(
            f"{pieces:,} {'piece' if pieces == 1 else 'pieces'}, {words_of_number(100 * share, 2)} % of the scanned surface, left out:"
            " too small for this length or compared with the others"
        )


def note_layers(bars: Bars, cloud: PointCloud, settings: Settings, made: Certificate | None = None) -> None:
    """Report two layers of the scan closer than half a member, and what to do; not where the grid that was made follows both."""
    from ..surface.samples import sample_surface

    distance, share = sample_surface(cloud, settings).layers
    if share > 0.0 and not settings.thin_walls and not follows_both_layers(made, distance, share):
        unit = f" {cloud.unit}" if cloud.unit else ""
        bars.note(
            f"the scan has two layers about {words_of_number(distance, 2)}{unit} apart on {share:.0%} of its surface,"
            " such as top and underside; the grid is one sheet between or on them: crop one layer away for a grid of the other,"
            " or try --thin-walls for both"
        )


def follows_both_layers(made: Certificate | None, distance: float, share: float) -> bool:
    """Whether a grid follows both of two layers some distance apart: one sheet lies half of that off a twentieth of the points or more.

    share : of the surface that has two layers, of whose points one sheet follows half at most
    """
    away = None if made is None else made.scan_distance
    return away is not None and share >= LEAST_SHARE_OF_LAYERS and away.p95 < NEAR_BOTH_LAYERS * distance


def note_corners(bars: Bars, cloud: PointCloud, settings: Settings) -> None:
    """Report points so far apart along the boundary that its corners are doubtful, and the length that shows them."""
    from ..boundary.find import find_boundary
    from ..boundary.offset import length_that_shows_corners
    from ..scan.member_length import round_length
    from ..surface.samples import sample_surface

    if settings.boundary:
        return
    _, boundary = find_boundary(sample_surface(cloud, settings), settings)
    worst = max(boundary.loops, key=lambda loop: loop.beyond, default=None)
    if worst is None:
        return
    length, unit = length_that_shows_corners(worst.beyond, settings.length), unit_words(cloud.unit)
    if length > settings.length:
        where = words_of_place(cloud.origin + worst.points[worst.sparse_at])
        longer = f"longer members, from {round_length(length, 'up'):g}{unit}, show them better, and "
        longer = longer if SHORTEST_ADVISED <= length / settings.length <= LONGEST_ADVISED else ""
        bars.note(
            f"the points are random and sparse: near {where} they end on average about {words_of_number(worst.beyond, 2)}{unit}"
            f" before the boundary, so corners may be missed or false; {longer}--boundary gives them"
        )


def box_around(low: np.ndarray, high: np.ndarray, margin: float) -> str:
    """Return the words of `--crop box:` for what lies between two places, and a margin, exact to a tenth of it."""
    decimals = max(0, math.ceil(1.0 - math.log10(margin)))
    return ",".join(f"{c:.{decimals}f}" for c in (*low - margin, *high + margin))


def _has_floor(samples: SurfaceSamples, length: float) -> bool:
    """Whether one of the pieces would be taken for a floor if z were known to be up."""
    from ..surface.floor import find_floor

    return find_floor(samples.surface.mean, samples.piece, tuple(samples.pieces), length) is not None


def note_pieces(bars: Bars, cloud: PointCloud, settings: Settings) -> None:
    """List the pieces of a scan with their sizes, and how to take one alone; nothing if there is only one.

    A box is named only where no other of these pieces reaches into it.
    """
    import numpy as np

    from ..surface.samples import sample_surface

    samples = sample_surface(cloud, settings)
    if len(samples.pieces) + len(samples.not_chosen) < 2:
        return
    if samples.floor is not None:
        bars.note("a level, flat piece under the others is taken for the floor and left out; --piece all keeps it")
    elif not cloud.z_is_up and settings.piece == "auto" and _has_floor(samples, settings.length):
        bars.note(
            "a level, flat piece lies under the others, as a floor does; where the unit is m or foot it is left out, as z is up then"
        )
    unit = f" {cloud.unit}" if cloud.unit else ""
    named = samples.named_pieces
    large = list(named.values())
    all_places = samples.surface.mean + cloud.origin
    option = "--piece" if settings.keep_rods else "--no-keep-rods --piece"
    for number, piece in list(named.items())[:MOST_PIECES]:
        places = all_places[samples.piece == piece]
        low, high = places.min(axis=0), places.max(axis=0)
        size = " x ".join(words_of_number(side, 3) for side in high - low)
        of_others = np.isin(samples.piece, large) & (samples.piece != piece)
        box, in_box = box_around(low, high, samples.surface.radius), (all_places >= low) & (all_places <= high)
        crop = "" if (in_box.all(axis=1) & of_others).any() else f", --crop box:{box} all in its box"
        bars.note(f"piece {number}: {size}{unit}; {option} {number} takes it alone{crop}")
    if len(large) > MOST_PIECES:
        more = len(large) - MOST_PIECES
        bars.note(f"and {more} smaller piece{'s' if more > 1 else ''}")


@contextmanager
def note_compiling(bars: Bars) -> Iterator[None]:
    """Report, once a run, that kernels are being compiled, which takes long."""
    from ..runtime.jit import KERNEL_FOLDER, report_compiling

    words = (
        "compiling kernels that no run has used yet, each once on this machine"
        if KERNEL_FOLDER
        else "compiling kernels"
    )
    with report_compiling(lambda: bars.note_once(words)):
        yield
