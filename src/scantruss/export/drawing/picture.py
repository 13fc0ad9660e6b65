"""Pictures: the grid over its scan, and three panels (scan, grid, printed model).

The painter's way: everything is projected, sorted such that what is in front comes last, and painted by matplotlib's Agg, without
pyplot and without any state that outlives the call. The same grid gives the same bytes.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ...errors import words_of_number
from ...grid.grid import Grid
from ...grid.upward import known_upward, picture_notes
from ...runtime.files import write_files
from ...runtime.ours import MADE_BY
from ...runtime.places import check_place
from ...scan.cloud import PointCloud
from .camera import Camera, choose_camera
from .left_out import Shown, shown_points
from .legend import (
    FAULT_COLOUR,
    Ring,
    Row,
    Text,
    legends,
    places_marked,
    rings_and_numbers,
    rows_of_marks,
    scale_bar,
)
from .strokes import (
    INK_COLOUR,
    MOST_POINTS,
    PAPER_COLOUR,
    Strokes,
    cloud_strokes,
    dot_strokes,
    framed,
    grid_strokes,
    look,
    missed_strokes,
    placed,
    shadow_strokes,
    solid_strokes,
    some_of,
)
from .style import PictureStyle

if TYPE_CHECKING:
    from PIL.Image import Image

Box = tuple[float, float, float, float]  #: left, bottom, right and top of a part of a picture [pixel]
PICTURE_SIZE = (1600, 1200)  #: of a picture [pixel]
MOST_LEGEND_ROWS = 20  # rows of the legend of a picture, so that it leaves room for the grid
PANELS_SIZE = (2400, 800)  #: of three panels, or of several views [pixel]


def encode_picture(
    grid: Grid, cloud: PointCloud | None = None, *, caption: bool = True, style: PictureStyle | None = None
) -> bytes:
    """Return a shaded picture of the grid over its scan, PNG; what the grid leaves out of the scan is coloured.

    Parameters
    ----------
    grid : Grid
        What to show.
    cloud : PointCloud, optional
        The scan, drawn as fine dots.
    caption : bool
        Whether to write the figures of the grid below it, a scale bar, what the colours mean and where to look.
    style : PictureStyle, optional
        Views and size of the picture.
    """
    style = style or PictureStyle()
    wide, tall = style.size or (PICTURE_SIZE if len(style.views) == 1 else PANELS_SIZE)
    em = 15.0 * min(wide / PICTURE_SIZE[0], tall / PANELS_SIZE[1])  # height of the letters
    strokes: list[Strokes] = []
    texts = [Text(wide / 2, 2.7 * em, caption_of(grid), em)] if caption else []
    rings: list[Ring] = []
    lines: list[np.ndarray] = []
    if len(grid.triangles):
        shown = shown_points(grid, cloud) if cloud is not None else None
        rows = _legend_rows(grid, cloud, shown) if caption else []
        width, upward = wide / len(style.views), known_upward(grid, cloud)
        cameras = [choose_camera(grid.nodes, grid.triangles, upward, name) for name in style.views]
        low, high = (7.5 if caption else 5) * em, tall - 5.5 * em
        boxes = [(width * k + 6 * em, low, width * (k + 1) - 6 * em, high) for k in range(len(cameras))]
        more = None if shown is None else some_of(shown.framed, MOST_POINTS[True])
        fits = [
            (legend, _fit(grid, cameras, [legend.boxes_beside(box, alone=len(boxes) == 1) for box in boxes], more))
            for legend in legends(rows, wide - 12 * em, (6 * em, tall - 4.1 * em), em)
        ]
        legend, fitted = max(fits, key=lambda fit: min(camera.zoom for camera, _ in fit[1]))
        for number, (camera, box) in enumerate(fitted):
            view = look(grid.nodes, grid.triangles, camera, (wide, tall))
            strokes += grid_strokes(grid, None if shown is None else shown.followed, view)
            strokes += [missed_strokes(part.points, part.colour, view, box) for part in (shown.missed if shown else ())]
            if caption:
                line, words = scale_bar(view.camera, box[2], 4.7 * em, width, grid.unit, em)
                lines, texts = [*lines, line], [*texts, words]
                more_rings, numbers = rings_and_numbers(grid, view.camera, em, {row.sign for row in rows})
                rings, texts = [*rings, *more_rings], [*texts, *numbers]
                if len(style.views) > 1:
                    texts.append(Text(width * (number + 0.5), tall - 2.5 * em, style.views[number], 1.2 * em))
        texts += legend.texts
    return paint((wide, tall), strokes, texts, rings, lines)


def _fit(
    grid: Grid, cameras: Sequence[Camera], boxes: Sequence[Sequence[Box]], more: np.ndarray | None
) -> list[tuple[Camera, Box]]:
    """Return each camera framed in the one of its boxes [pixel] in which the grid and further points (N, 3) are largest, and that box."""
    tried = [
        [(framed(grid.nodes, grid.triangles, camera, box, more), box) for box in some]
        for camera, some in zip(cameras, boxes, strict=True)
    ]
    return [max(some, key=lambda each: each[0].zoom) for some in tried]


def plot_grid(grid: Grid, cloud: PointCloud | None, views: tuple[str, ...], size: tuple[int, int] | None) -> Image:
    """Return the picture of `encode_picture` as an image that notebooks show."""
    from PIL.Image import open as open_image

    return open_image(io.BytesIO(encode_picture(grid, cloud, style=PictureStyle(views=views, size=size))))


def _legend_rows(grid: Grid, cloud: PointCloud | None, shown: Shown | None) -> list[Row]:
    """Return what colours and numbers mean, line by line: faults first."""
    missed, unread = (shown.missed, shown.unread) if shown else ((), ())
    failed = grid.certificate is not None and not grid.certificate.passed
    marks = sorted(rows_of_marks(grid), key=lambda row: row.colour is not FAULT_COLOUR)
    room = MOST_LEGEND_ROWS - failed - len(missed) - len(unread)
    if len(marks) > room:
        marks = [*marks[: room - 1], Row(f"and {len(marks) - room + 1} more, listed in a report (--report)", "+")]
    rows, explained = [Row("This grid fails its certificate:", "", FAULT_COLOUR)] * failed, {row.sign for row in marks}
    rows += [row for row in marks if row.colour is FAULT_COLOUR]
    for part in missed:
        numbers = [str(number) for number, mark in enumerate(places_marked(grid), 1) if mark.kind == part.kind]
        numbers = [number for number in numbers if number in explained]
        rows.append(Row(f"{part.words}{', at ' if numbers else ''}{', '.join(numbers)}", "\u25cf", part.colour))
    rows += [Row(words) for words in unread]
    rows += [row for row in marks if row.colour is not FAULT_COLOUR]
    return [*rows, *(Row(words) for words in picture_notes(grid, cloud))]


def encode_cloud(cloud: PointCloud) -> bytes:
    """Return a picture of a scan, PNG: its points seen from obliquely above."""
    return paint(PICTURE_SIZE, [cloud_strokes(cloud, PICTURE_SIZE)], [])


def caption_of(grid: Grid) -> str:
    """Return the figures of a grid in one line."""
    quality = grid.quality
    return (
        f"{len(grid.nodes)} nodes   {len(grid.edges)} members   {len(grid.panel_table)} {grid.panels_are}      "
        f"member length {words_of_number(quality.length_mean, 4)} ± {words_of_number(quality.length_std, 2)} {grid.unit}".rstrip()
        + f"      shape quality {quality.shape_mean:.3f} ± {quality.shape_std:.3f}"
    )


def draw_panels(
    cloud: PointCloud,
    grid: Grid,
    vertices: np.ndarray,
    triangles: np.ndarray,
    path: str | Path,
    *,
    view: str = "auto",
    beside: tuple[Grid, str, str] | None = None,
) -> Path:
    """Draw scan, grid and printed model side by side; with another grid beside them, two by two.

    Parameters
    ----------
    cloud : PointCloud
        The scan.
    grid : Grid
        Its grid.
    vertices, triangles : np.ndarray
        (N, 3) and (M, 3), the solid of `build_solid`; any scale.
    path : str or Path
        File ending in .png.
    view : str
        See `choose_camera`.
    beside : (Grid, str, str), optional
        Another grid, its own view and its name.

    Returns
    -------
    Path
        The file written.
    """
    path = check_place(path, (".png",))
    rows, columns = (1, 3) if beside is None else (2, 2)
    size, (wide, tall) = (PANELS_SIZE[0], rows * PANELS_SIZE[1]), (PANELS_SIZE[0] / columns, PANELS_SIZE[1])
    corners = [(wide * column, tall * row) for row in reversed(range(rows)) for column in range(columns)]
    boxes = [(x + 40, y + 80, x + wide - 40, y + tall - 40) for x, y in corners]
    camera = choose_camera(grid.nodes, grid.triangles, known_upward(grid, cloud), view)
    eyes = [framed(grid.nodes, grid.triangles, camera, box) for box in boxes[:2]]
    scan, net = (look(grid.nodes, grid.triangles, eye, size) for eye in eyes)
    own = framed(vertices, triangles, camera.around(vertices), boxes[2])
    strokes = [
        dot_strokes(placed(cloud, grid), float(np.mean(grid.lengths)), scan, over=False),
        *grid_strokes(grid, None, net),
        shadow_strokes(vertices, triangles, own),
        solid_strokes(look(vertices, triangles, own, size, mapped=False)),
    ]
    titles = [f"scan: {len(cloud.points):,} points", f"grid: {len(grid.edges):,} members", "printed model"]
    if beside is not None:
        other, its_view, name = beside
        camera = choose_camera(other.nodes, other.triangles, known_upward(other, None), its_view)
        eye = framed(other.nodes, other.triangles, camera, boxes[3])
        strokes += grid_strokes(other, None, look(other.nodes, other.triangles, eye, size))
        titles.append(f"{name}: {len(other.edges):,} members")
    texts = [Text(x + wide / 2, y + 40.0, title, 17.0) for (x, y), title in zip(corners, titles, strict=True)]
    return write_files({path: paint(size, strokes, texts)})[0]


def paint(
    size: tuple[int, int],
    strokes: Sequence[Strokes],
    texts: Iterable[Text],
    rings: Sequence[Ring] = (),
    lines: Iterable[np.ndarray] = (),
) -> bytes:
    """Return the picture as PNG: strokes back to front, then lines (N, 2) [pixel], rings and texts."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patheffects import withStroke

    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100, facecolor=tuple(PAPER_COLOUR))
    canvas: Any = FigureCanvasAgg(figure)
    axes: Any = figure.add_axes((0, 0, 1, 1), xlim=(0, size[0]), ylim=(0, size[1]), autoscale_on=False)
    axes.set_axis_off()
    if strokes:
        axes.add_collection(_collection(strokes), autolim=False)
    for line in lines:
        axes.plot(*line.T, color=tuple(INK_COLOUR), linewidth=1.5, solid_capstyle="butt", solid_joinstyle="miter")
    for ring in rings:
        axes.plot([ring.x], [ring.y], "o", markersize=0.72 * ring.size, markeredgecolor=tuple(ring.colour),
                  markerfacecolor="none", markeredgewidth=1.6)  # fmt: skip
    edge = [withStroke(linewidth=2.2, foreground=tuple(PAPER_COLOUR))]
    for text in texts:
        axes.text(text.x, text.y, text.words, fontsize=text.size * 0.72, color=tuple(text.colour), ha=text.align,
                  va="center", family="DejaVu Sans", parse_math=False, path_effects=edge if text.over else None)  # fmt: skip
    stream = io.BytesIO()
    canvas.print_png(stream, metadata={"Software": MADE_BY})  # unlike savefig it asks no settings of the user
    return stream.getvalue()


def _collection(strokes: Sequence[Strokes]) -> Any:
    """Return all strokes as one collection in the order of painting."""
    from matplotlib.collections import PolyCollection

    order = np.argsort(np.concatenate([s.key for s in strokes]), kind="stable")
    joined = [np.concatenate([getattr(s, name) for s in strokes])[order] for name in ("shape", "fill", "line", "width")]
    shape, fill, line, width = joined
    return PolyCollection(
        cast(Any, shape),
        closed=False,
        facecolors=fill,
        edgecolors=line,
        linewidths=width * 0.72,  # points of a picture with 100 pixels an inch
        capstyle="round",
        joinstyle="round",
        antialiaseds=True,
        snap=False,
    )
