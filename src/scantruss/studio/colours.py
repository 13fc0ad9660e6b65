"""Colours of values, their legends and histograms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from ..check.distances import distances_to_grid
from ..export.page_tables import PageColumn
from ..surface.chosen_samples import KEPT
from ..surface.samples import sample_surface
from .legend import ColourLegend

if TYPE_CHECKING:
    from .state import StudioState

#: light enough to be seen on a dark page (3 to 1 on its background), dark enough on a light one, and rising in lightness
RISING_COLOURS = np.array([(126, 87, 194), (74, 117, 190), (33, 145, 140), (94, 190, 88), (214, 196, 60)], float)
DIVERGING_COLOURS = np.array([(178, 24, 43), (239, 138, 98), (200, 200, 200), (103, 169, 207), (33, 102, 172)], float)
PLAIN_COLOUR = np.array([60, 90, 110], np.uint8)
DIMMED_COLOUR = np.array([215, 218, 220], np.uint8)
HISTOGRAM_BINS = 24  #: of a histogram
FAINT_BAR = 0.3  #: opacity of a bar that is not chosen
BRUSHED = "between"  #: label of the field that a brushed histogram fills
AROUND_POINT = 10  #: neighbours of which the normal of a point is made
OUTLIERS_IN_RED = "outliers in red"
FROM_GRID = "distance from the grid"
OWN_COLORS, CLASSES = "own colours", "class"  #: of scans that have them
SCAN_COLOURINGS = ("height", FROM_GRID, "normals", OUTLIERS_IN_RED, "plain")
CLASS_NAMES = {
    0: "never classified", 1: "unclassified", 2: "ground", 3: "low vegetation", 4: "medium vegetation", 5: "high vegetation",
    6: "building", 7: "low noise", 9: "water", 10: "rail", 11: "road", 13: "wire guard", 14: "wire", 15: "tower", 17: "bridge deck",
    18: "high noise",
}  # fmt: skip  # ASPRS, LAS 1.4 R15 table 17
MOST_CLASSES = 24  #: that are listed
CLASS_COLORS = np.array([
    (120, 120, 120), (160, 160, 160), (166, 118, 29), (178, 223, 138), (102, 166, 30), (27, 120, 55), (214, 69, 65), (231, 41, 138),
    (117, 112, 179), (56, 108, 176), (90, 60, 130), (60, 60, 60), (255, 170, 60), (250, 128, 114), (128, 177, 211), (141, 90, 60),
], np.uint8)  # fmt: skip
OUTLIER_COLOR = np.array([200, 20, 20], np.uint8)


def ramp(share: np.ndarray, stops: np.ndarray) -> np.ndarray:
    """Return (N, 3) uint8 colours of shares from 0 to 1."""
    at = np.clip(share, 0.0, 1.0) * (len(stops) - 1)
    return np.stack([np.interp(at, np.arange(len(stops)), stops[:, k]) for k in range(3)], axis=1).astype(np.uint8)


def values_of(column: PageColumn) -> np.ndarray:
    """Return the values of a column (N,), NaN where they are not known."""
    return np.array([np.nan if value is None else value for value in column.values], float)


def colors_of(
    values: np.ndarray, middle: float | None, ends: tuple[float, float] | None = None
) -> tuple[np.ndarray, float, float]:
    """Return (N, 3) uint8 colours of values (N,), and what the ends of the scale stand for; plain where a value is NaN.

    Parameters
    ----------
    middle : float, optional
        Of a scale to both sides.
    ends : (float, float), optional
        Of the scale; by default the least and the greatest value.
    """
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    low, high = ends or (low, high)
    if middle is not None:
        far = max(high - middle, middle - low) or 1e-9
        low, high = middle - far, middle + far
    share = np.full(len(values), 0.5) if high <= low else (values - low) / (high - low)
    colors = ramp(np.nan_to_num(share), RISING_COLOURS if middle is None else DIVERGING_COLOURS)
    colors[~np.isfinite(values)] = PLAIN_COLOUR
    return colors, low, high


def legend_of(words: str, unit: str, low: float, high: float, diverging: bool) -> ColourLegend:
    """Return the legend of a colouring between two values."""
    stops = tuple(
        (round(r), round(g), round(b)) for r, g, b in (DIVERGING_COLOURS if diverging else RISING_COLOURS).tolist()
    )
    return ColourLegend(words, unit, (low, high), stops)


def legend_of_names(words: str, names: Sequence[str], *numbers: np.ndarray) -> ColourLegend:
    """Return the legend of what has one of some names, by numbers from 1, (N,) of each design: a mark for each, with how many there are."""
    colors, _, _ = colors_of(1.0 + np.arange(len(names)), None)
    counts = np.stack([np.bincount(each.astype(np.int64), minlength=len(names) + 1)[1:] for each in numbers], axis=1)
    rows = zip(names, colors.tolist(), counts.tolist(), strict=True)
    return ColourLegend(
        words,
        marks=tuple(((r, g, b), f"{name}, {' and '.join(f'{k:,}' for k in held)}") for name, (r, g, b), held in rows),
    )


def rgb_of(color: str) -> tuple[int, int, int]:
    """Return the parts of a colour such as #d81e2c, from 0 to 255."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue


def marked(colors: np.ndarray, values: np.ndarray, most: float, color: str) -> np.ndarray:
    """Return colours (N, 3) of values (N,) with another one, such as #d81e2c, where a value is above `most`."""
    above = np.nan_to_num(values) > most
    return np.where(above[:, None], rgb_of(color), colors).astype(np.uint8) if above.any() else colors


def histogram_of(
    values: np.ndarray,
    low: float,
    high: float,
    color_of: Callable[[np.ndarray], np.ndarray],
    chosen: tuple[float, float] | None = None,
) -> str:
    """Return a histogram of values from `low` to `high` as HTML, its bars in the colours of the drawing.

    A click on a bar, or dragging from one to another, gives their values to the field `BRUSHED`.

    Parameters
    ----------
    color_of : callable
        ``color_of(values)`` (K, 3) uint8.
    chosen : (float, float), optional
        Outside of which bars are faint.
    """
    known = np.sort(values[np.isfinite(values)])
    counts, ends = np.histogram(known, HISTOGRAM_BINS, (low, high if high > low else low + 1.0))
    after = np.cumsum(counts) + np.searchsorted(known, low)
    colors = color_of(0.5 * (ends[1:] + ends[:-1]))
    held = [  # by each bar: its values, or where there are none its ends
        (known[end - count], known[end - 1]) if count else (begin, stop)
        for count, end, begin, stop in zip(counts, after, ends[:-1], ends[1:], strict=True)
    ]
    first, last = chosen or (-np.inf, np.inf)
    clear = [1.0 if begin <= last and end >= first else FAINT_BAR for begin, end in held]
    bars = "".join(
        f'<div title="{count:,}" data-field="{BRUSHED}" data-low="{begin:.6g}" data-high="{end:.6g}" tabindex="-1"'
        f' style="flex:1;height:100%;display:flex;align-items:flex-end;cursor:pointer;opacity:{opacity:g}"><div style="width:100%;'
        f'height:{max(100 * count / max(counts.max(), 1), 1.0 if count else 0.0):.1f}%;background:rgb({r},{g},{b})"></div></div>'
        for count, (begin, end), opacity, (r, g, b) in zip(counts.tolist(), held, clear, colors.tolist(), strict=True)
    )
    return (
        f'<div style="display:flex;height:3.5em;margin:0 .6em;gap:1px;touch-action:none;user-select:none">{bars}</div>'
    )


def colorings_of_scan(state: StudioState) -> tuple[str, ...]:
    """Return the colourings that a scan can have."""
    whole = state.whole
    own = (OWN_COLORS,) if whole is not None and whole.colors is not None else ()
    return (*own, *((CLASSES,) if whole is not None and whole.classes is not None else ()), *SCAN_COLOURINGS)


def colors_of_scan(state: StudioState, taken: np.ndarray, wanted: str) -> tuple[np.ndarray, ColourLegend | None]:
    """Return (K, 3) uint8 colours of some points of the scan of a state, and their legend, where there is one.

    Parameters
    ----------
    taken : (K,) int, the points that are drawn
    wanted : str, of `colorings_of_scan`
    """
    cloud, grid, whole = state.cloud, state.grid, state.whole
    assert cloud is not None
    points = cloud.points[taken]
    if wanted in (OWN_COLORS, CLASSES) and whole is not None:
        of_whole = np.flatnonzero(state.taken())[taken]
        if wanted == OWN_COLORS and whole.colors is not None:
            return whole.colors[of_whole], None
        if wanted == CLASSES and whole.classes is not None:
            numbers = whole.classes[of_whole].astype(np.int64)
            return CLASS_COLORS[numbers % len(CLASS_COLORS)], legend_of_classes(np.unique(numbers).tolist())
    if wanted == "normals":
        normals = cloud.normals[taken] if cloud.normals is not None else _normals(points)
        return (127.5 * (normals + 1.0)).astype(np.uint8), None
    if wanted == OUTLIERS_IN_RED:
        kept = sample_surface(cloud, state.settings).judged[taken] == KEPT
        red, green, blue = OUTLIER_COLOR.tolist()
        legend = ColourLegend("scan", marks=(((red, green, blue), f"outliers, {int((~kept).sum()):,} of those drawn"),))
        return np.where(kept[:, None], PLAIN_COLOUR, OUTLIER_COLOR), legend
    if wanted == FROM_GRID and grid is not None:
        places = np.ascontiguousarray(points + cloud.origin - grid.origin)
        values, _ = distances_to_grid(places, grid, float(grid.lengths.mean()))
        values = np.minimum(values, float(np.quantile(values, 0.99)))
    elif wanted == "height":
        values = points[:, 2] + cloud.origin[2]
    else:
        return np.broadcast_to(PLAIN_COLOUR, points.shape), None
    colors, low, high = colors_of(values, None)
    return colors, legend_of(wanted, cloud.unit, low, high, False)


def legend_of_classes(numbers: list[int]) -> ColourLegend:
    """Return the legend of classes."""
    marks = (
        (CLASS_COLORS[k % len(CLASS_COLORS)].tolist(), f"{k} {CLASS_NAMES.get(k, '')}".strip())
        for k in numbers[:MOST_CLASSES]
    )
    return ColourLegend("class", marks=tuple(((r, g, b), words) for (r, g, b), words in marks))


def _normals(points: np.ndarray) -> np.ndarray:
    """Return the normals of points (K, 3) by their neighbours, turned upwards."""
    if len(points) <= AROUND_POINT:
        return np.tile([0.0, 0.0, 1.0], (len(points), 1))
    _, near = cKDTree(points).query(points, AROUND_POINT)
    spread = points[near] - points[near].mean(axis=1, keepdims=True)
    _, vectors = np.linalg.eigh(np.einsum("kni,knj->kij", spread, spread))
    normals: np.ndarray = vectors[:, :, 0]
    return np.where(normals[:, 2:] < 0, -normals, normals)
