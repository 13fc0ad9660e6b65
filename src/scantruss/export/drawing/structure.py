"""Pictures of a structure: its members coloured by a force, a utilization or a displacement, moved or where they are."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from ...grid.upward import AGAINST_GRAVITY
from ...runtime.ours import MADE_BY
from ...structure.truss import Truss
from .camera import Camera, choose_camera
from .strokes import INK_COLOUR, PAPER_COLOUR, look

FORCES, USED, MOVED, SIZES = "forces", "utilization", "displacements", "sizes"  #: scales of colours
COLOUR_SCALES = {
    FORCES: ("#a50f15", "#e0745a", "#b6babd", "#6c9fd0", "#174a91"),  # compression red, tension blue
    USED: ("#bcc7cd", "#86b4bd", "#2f7fa0", "#14355e"),
    SIZES: ("#bcc7cd", "#86b4bd", "#2f7fa0", "#14355e"),
    MOVED: ("#aab4ba", "#74a98f", "#e0a33a", "#a8321c"),
}
OVERUSED_COLOUR = "#d81e2c"  #: colour of a utilization over 1
MEMBER_PICTURE = (1500, 940)  #: size of a picture of members [pixel]
MOST_VECTORS = 8000  #: lines and triangles of a picture in a PDF; more are drawn as pixels
NOTES_HEIGHT = 18  #: height of the notes below a picture [pixel]
UNMOVED_COLOUR = np.array([0.72, 0.73, 0.74, 1.0])  #: colour of members where they were before they moved
SHELL_SHADES = np.array([0.80, 0.985])  #: grey of triangles in the shade and in the light
DRAWN_MOVE = 0.06  #: size of the greatest displacement in a picture over that of the structure
WEBP_QUALITY = 78  #: of a picture within a page


@dataclass(frozen=True, eq=False)
class MemberPicture:
    """What a picture of a structure shows."""

    title: str
    label: str  #: of the colour bar, with its unit
    values: np.ndarray  #: (M,) what the colours of the members mean
    colours: str  #: FORCES, USED, MOVED or SIZES
    moves: np.ndarray | None = None  #: (V, 3) displacements [m], drawn times `factor`
    factor: float = 1.0
    most: float | None = None  #: where the colours end; None: at the greatest of `values`


def moved_picture(truss: Truss, title: str, moves: np.ndarray) -> MemberPicture:
    """Return a picture of displacements (V, 3) [m], drawn so large that they can be seen."""
    size = np.linalg.norm(moves, axis=1)
    factor = float(f"{_drawn(truss) / max(float(size.max()), 1e-300):.1g}")
    return MemberPicture(
        title,
        "displacement [mm]",
        1e3 * size[truss.members].mean(axis=1),
        MOVED,
        moves,
        factor,
        1e3 * float(size.max()),
    )


def mode_picture(truss: Truss, title: str, shape: np.ndarray) -> MemberPicture:
    """Return a picture of a mode (V, 3), which has no size of its own."""
    size = np.linalg.norm(shape, axis=1)
    most = float(size.max()) or 1.0
    return MemberPicture(
        title,
        "displacement over the greatest",
        size[truss.members].mean(axis=1) / most,
        MOVED,
        shape * _drawn(truss) / most,
        most=1.0,
    )


def _drawn(truss: Truss) -> float:
    """Return how far the node that moves most is drawn from its place [m]."""
    return DRAWN_MOVE * float(np.linalg.norm(np.ptp(truss.nodes, axis=0)))


@contextmanager
def drawing_defaults() -> Iterator[None]:
    """Draw with the defaults of matplotlib, whatever the user's own are: same input, same bytes."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        yield


def encode_structure_picture(truss: Truss, shown: MemberPicture, size: tuple[int, int] = MEMBER_PICTURE) -> bytes:
    """Return a picture of a structure with its title, PNG."""
    from matplotlib.figure import Figure

    with drawing_defaults():
        figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100, facecolor=tuple(PAPER_COLOUR))
        figure.text(
            0.5, 0.965, shown.title, ha="center", va="center", fontsize=13, color=tuple(INK_COLOUR), parse_math=False
        )
        draw_members(figure, (0.01, 0.01, 0.98, 0.92), truss, shown)
        return png_of(figure)


def png_of(figure: Any) -> bytes:
    """Return a figure as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    stream = io.BytesIO()
    canvas: Any = FigureCanvasAgg(figure)
    canvas.print_png(stream, metadata={"Software": MADE_BY})
    return stream.getvalue()


def webp_of(figure: Any) -> bytes:
    """Return a figure as WebP, a third of the size of a PNG."""
    from PIL import Image

    stream = io.BytesIO()
    with Image.open(io.BytesIO(png_of(figure))) as image:
        image.convert("RGB").save(stream, "WEBP", quality=WEBP_QUALITY, method=6)
    return stream.getvalue()


def draw_members(figure: Any, place: tuple[float, float, float, float], truss: Truss, shown: MemberPicture) -> None:
    """Draw a picture and its colour bar into a part of a figure (left, bottom, width, height)."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap

    left, bottom, width, height = place
    inches = figure.get_size_inches()
    size = 100 * inches[0] * width * 0.88, 100 * inches[1] * height  # as if of 100 pixels an inch
    axes = figure.add_axes((left, bottom, width * 0.88, height), xlim=(0, size[0]), ylim=(0, size[1]))
    axes.set_axis_off()
    nodes = truss.nodes if shown.moves is None else truss.nodes + shown.factor * shown.moves
    camera = choose_camera(truss.nodes, truss.triangles, AGAINST_GRAVITY)
    margin = 0.03 * size[0]
    box = (margin, margin + NOTES_HEIGHT, size[0] - margin, size[1] - margin)
    camera = camera.framed(np.concatenate([truss.nodes, nodes]), box)
    colours = LinearSegmentedColormap.from_list(shown.colours, COLOUR_SCALES[shown.colours])
    mappable = ScalarMappable(
        _scale(shown), colours.with_extremes(over=OVERUSED_COLOUR) if shown.colours == USED else colours
    )
    axes.add_collection(_members_and_shell(truss, nodes, shown, camera, mappable), autolim=False)
    mark = float(np.clip(0.2 * camera.zoom * np.median(truss.lengths), 1.5, 4.5))
    held = np.flatnonzero(truss.supports.any(axis=1))
    axes.plot(
        *camera.project(nodes[held])[0].T,
        "^",
        markersize=mark,
        markerfacecolor="white",
        markeredgecolor=tuple(INK_COLOUR),
        markeredgewidth=0.9,
    )
    _add_colour_bar(figure, (left + width * 0.9, bottom + height * 0.14, width * 0.018, height * 0.72), shown, mappable)
    axes.text(margin, 4, "\u25b3 support" if len(held) else "", fontsize=8, color=tuple(INK_COLOUR), va="bottom")
    if shown.factor != 1.0 and shown.moves is not None:
        axes.text(
            0.15 * size[0],
            4,
            f"displacements drawn {shown.factor:g} times",
            fontsize=8,
            color=tuple(INK_COLOUR),
            va="bottom",
        )


def _members_and_shell(truss: Truss, nodes: np.ndarray, shown: MemberPicture, camera: Camera, mappable: Any) -> Any:
    """Return members, shell and unmoved members as one collection in the order of painting; nodes : (V, 3) as they are shown."""
    from matplotlib.collections import PolyCollection

    flat, near = camera.project(nodes)
    shell = len(truss.triangles) > 0 and not truss.member_sets  # it would hide the second layer
    view = look(nodes, truss.triangles, camera, (0, 0), mapped=False) if shell else None
    step = 0.5 * float(truss.lengths.mean())
    width_of = _widths(truss, camera.zoom)
    lines = _lines(flat, truss.members)
    parts = [
        (
            near[truss.members].mean(axis=1) + step,
            lines,
            np.zeros((len(lines), 4)),
            mappable.to_rgba(shown.values),
            width_of,
        )
    ]
    if view is not None:
        shade = SHELL_SHADES[0] + (SHELL_SHADES[1] - SHELL_SHADES[0]) * view.light
        grey = np.column_stack([shade, shade, shade, np.full(len(shade), 0.85)])
        parts.append((view.key, view.corners, grey, np.zeros_like(grey), np.zeros(len(grey))))
    if shown.moves is not None:
        still, behind = camera.project(truss.nodes)
        lines = _lines(still, truss.members)
        colour = np.broadcast_to(UNMOVED_COLOUR, (len(lines), 4))
        parts.append((behind[truss.members].mean(axis=1), lines, np.zeros((len(lines), 4)), colour, 0.4 * width_of))
    order = np.argsort(np.concatenate([part[0] for part in parts]), kind="stable")
    shape, fill, line, widths = (cast(Any, np.concatenate([part[k] for part in parts])[order]) for k in range(1, 5))
    return PolyCollection(shape, closed=False, facecolors=fill, edgecolors=line, linewidths=0.72 * widths,
                          capstyle="round", joinstyle="round", antialiaseds=True, rasterized=len(shape) > MOST_VECTORS)  # fmt: skip


def _add_colour_bar(figure: Any, box: tuple[float, float, float, float], shown: MemberPicture, mappable: Any) -> None:
    """Add what the colours of a picture mean into a part of a figure."""
    bar = figure.add_axes(box)
    made = figure.colorbar(
        mappable, cax=bar, extend="max" if shown.colours == USED and shown.values.max() > 1 else "neither"
    )
    made.set_label(shown.label, fontsize=9, color=tuple(INK_COLOUR))
    made.outline.set_linewidth(0.5)
    bar.tick_params(labelsize=8, colors=tuple(INK_COLOUR), width=0.5)


def _scale(shown: MemberPicture) -> Any:
    """Return what takes values to colours: forces around nil, utilizations up to 1, the rest from nil."""
    from matplotlib.colors import Normalize

    most = shown.most or float(np.abs(shown.values).max(initial=0.0)) or 1.0
    if shown.colours == FORCES:
        return Normalize(-most, most)
    return Normalize(0.0, min(most, 1.0) if shown.colours == USED else most)


def _lines(flat: np.ndarray, members: np.ndarray) -> np.ndarray:
    """Return (M, 3, 2) lines as triangles that repeat a corner."""
    return flat[members[:, [0, 1, 1]]]


def _widths(truss: Truss, zoom: float) -> np.ndarray:
    """Return the (M,) widths of the members: those of their sections, and not too thin or bold to be read [pixel]."""
    own = np.array([section.width for section in truss.sections])[truss.section_of] * zoom
    bold = 0.09 * zoom * float(np.median(truss.lengths))
    return np.clip(own, min(max(bold, 0.9), 2.6), 4.0)
