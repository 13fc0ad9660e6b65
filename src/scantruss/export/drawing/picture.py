"""Pictures: the grid over its scan, and three panels (scan, grid, printed model).

The painter's way: everything is projected, sorted by depth and painted back to front by matplotlib's Agg, without
pyplot and without any state that outlives the call. The same grid gives the same bytes.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from ...grid.grid import Grid
from ...runtime.files import check_place, write_files
from ...runtime.ours import MARK
from ...scan.cloud import PointCloud
from .camera import choose_camera
from .strokes import (
    INK,
    PAPER,
    Strokes,
    cloud_strokes,
    dot_strokes,
    framed,
    grid_strokes,
    look,
    shadow_strokes,
    solid_strokes,
)

SIZE = (1600, 1200)  #: of a picture [pixel]
PANELS = (2400, 800)  #: of three panels [pixel]


def encode_picture(grid: Grid, cloud: PointCloud | None = None, *, caption: bool = True) -> bytes:
    """Return a shaded picture of the grid over its scan, PNG.

    Parameters
    ----------
    grid : Grid
        What to show.
    cloud : PointCloud, optional
        The scan, drawn as fine dots.
    caption : bool
        Whether to write the figures of the grid below it.
    """
    wide, tall = SIZE
    strokes = []
    if len(grid.triangles):
        camera = choose_camera(grid.nodes, grid.triangles)
        camera = framed(grid.nodes, grid.triangles, camera, (90, 90, wide - 90, tall - 80))
        strokes = grid_strokes(grid, cloud, look(grid.nodes, grid.triangles, camera, SIZE))
    return _paint(SIZE, strokes, [(wide / 2, 40, caption_of(grid), 15)] if caption else [])


def encode_cloud(cloud: PointCloud) -> bytes:
    """Return a picture of a scan, PNG: its points seen from obliquely above."""
    return _paint(SIZE, [cloud_strokes(cloud, SIZE)], [])


def caption_of(grid: Grid) -> str:
    """Return the figures of a grid in one line."""
    quality = grid.quality
    return (
        f"{len(grid.nodes)} nodes   {len(grid.edges)} members   {len(grid.triangles)} triangles      "
        f"member length {quality.length_mean:.4g} ± {quality.length_std:.2g} {grid.unit}".rstrip()
        + f"      shape quality {quality.shape_mean:.3f} ± {quality.shape_std:.3f}"
    )


def draw_panels(cloud: PointCloud, grid: Grid, vertices: np.ndarray, triangles: np.ndarray, path: str | Path) -> Path:
    """Draw scan, grid and printed model side by side.

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

    Returns
    -------
    Path
        The file written.
    """
    path = check_place(path, (".png",))
    wide, tall = PANELS
    camera = choose_camera(grid.nodes, grid.triangles)
    boxes = [(wide / 3 * k + 40, 80, wide / 3 * (k + 1) - 40, tall - 40) for k in range(3)]
    eyes = [framed(grid.nodes, grid.triangles, camera, box) for box in boxes[:2]]
    scan, net = (look(grid.nodes, grid.triangles, eye, PANELS) for eye in eyes)
    own = framed(vertices, triangles, camera.around(vertices), boxes[2])
    strokes = [
        dot_strokes(cloud, grid, scan, over=False),
        *grid_strokes(grid, None, net),
        shadow_strokes(vertices, triangles, own),
        solid_strokes(look(vertices, triangles, own, PANELS, mapped=False)),
    ]
    titles = (f"scan: {len(cloud.points):,} points", f"grid: {len(grid.edges):,} members", "printed model")
    texts = [(wide / 3 * (k + 0.5), 40.0, title, 17.0) for k, title in enumerate(titles)]
    return write_files({path: _paint(PANELS, strokes, texts)})[0]


def _paint(
    size: tuple[int, int], strokes: Sequence[Strokes], texts: Iterable[tuple[float, float, str, float]]
) -> bytes:
    """Return the picture as PNG: strokes back to front, then texts (x, y, words, size) [pixel]."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100, facecolor=tuple(PAPER))
    canvas: Any = FigureCanvasAgg(figure)
    axes: Any = figure.add_axes((0, 0, 1, 1), xlim=(0, size[0]), ylim=(0, size[1]), autoscale_on=False)
    axes.set_axis_off()
    if strokes:
        axes.add_collection(_collection(strokes), autolim=False)
    for x, y, words, points in texts:
        axes.text(x, y, words, fontsize=points * 0.72, color=tuple(INK), ha="center", va="center", family="DejaVu Sans")
    stream = io.BytesIO()
    canvas.print_png(stream, metadata={"Software": MARK})  # unlike savefig it asks no settings of the user
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
