"""Table 3 of the paper: a B-spline surface through the cloud and the front on it, against the front on the cloud.

The surface is a bicubic least-squares spline of scipy (FITPACK) over the plane of the cloud's two longest axes, its
knots made denser while that helps,
as a surface modeller would (only the last fit is timed). The front looks at the surface through
samples at the parameters of the points, so that both ways run the very same code on as many points.
"""

from __future__ import annotations

import statistics
import warnings
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from scipy.interpolate import LSQBivariateSpline
from shapes import Shape, make

import scantruss as st

from .measure import measure
from .page import Section
from .ratios import seconds

PAPER = {"scallop": 398 / 34, "clam": 705 / 42, "limpet": 553 / 39, "cloth": 414 / 27}
POINTS = 100_000
STEP = 1.4  #: knots are made denser by this factor ...
GAIN = 0.05  #: ... until the residual falls by less than this share


@dataclass(frozen=True)
class Comparison:
    """Both ways on one example."""

    name: str
    cloud: float  #: front on the cloud, whole run [s]
    fit: float  #: fitting the surface [s]
    surface: float  #: sampling the surface and the same run on it [s]
    knots: int
    figures: tuple[str, str]  #: G, CV and distance to the true surface of both grids

    @property
    def ratio(self) -> float:
        """Seconds by way of the surface for a second on the cloud."""
        return (self.fit + self.surface) / self.cloud

    def row(self) -> str:
        return (
            f"| {self.name} | {self.cloud:.3g} | {self.fit:.3g} | {self.surface:.3g} | {self.knots} x {self.knots} |"
            f" {self.ratio:.2f} | {PAPER[self.name]:.1f} | {self.figures[0]} | {self.figures[1]} |"
        )


def frame_of(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return parameters and height (3, N) over the plane of the two longest axes, the axes and the centre."""
    centre = points.mean(axis=0)
    axes = np.linalg.svd((points - centre)[:: max(1, len(points) // 5000)], full_matrices=False)[2]
    return ((points - centre) @ axes.T).T, axes, centre


def fit(local: np.ndarray, knots: int) -> LSQBivariateSpline:
    """Return the least-squares surface with `knots` inner knots a side."""
    u, v, w = local
    inner = [np.linspace(t.min(), t.max(), knots + 2)[1:-1] for t in (u, v)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # corners of the plane without points: FITPACK says so
        return LSQBivariateSpline(u, v, w, *inner)


def choose_knots(local: np.ndarray, length: float) -> int:
    """Return the knots a side from which on denser ones bring the residual down by less than GAIN; not timed."""
    knots, last = max(4, int(np.ptp(local[0]) / (1.5 * length))), np.inf
    while True:
        residual = float(np.std(local[2] - fit(local, knots)(*local[:2], grid=False)))
        if residual > (1 - GAIN) * last:
            return round(knots / STEP)
        knots, last = round(knots * STEP), residual


def on_surface(points: np.ndarray, knots: int) -> tuple[np.ndarray, float]:
    """Return the points moved onto the surface fitted to them, and the seconds of the fit alone."""
    local, axes, centre = frame_of(points)
    started = perf_counter()
    surface = fit(local, knots)
    fitted = perf_counter() - started
    return np.stack([*local[:2], surface(*local[:2], grid=False)], axis=1) @ axes + centre, fitted


def compare(shape: Shape, rounds: int) -> Comparison:
    """Return both ways on one shape, in turn, medians."""
    settings = st.Settings(length=shape.length)
    knots = choose_knots(frame_of(shape.points)[0], shape.length)
    sample, _ = on_surface(shape.points, knots)
    grids = [st.grid_from_points(shape.points, settings), st.grid_from_points(sample, settings)]
    times = []
    for _ in range(rounds):
        cloud = seconds(lambda: st.grid_from_points(shape.points, settings))
        started = perf_counter()
        sample, fitted = on_surface(shape.points, knots)
        st.grid_from_points(sample, settings)
        times.append((cloud, fitted, perf_counter() - started - fitted))
    cloud, fitted, surface = (statistics.median(column) for column in zip(*times, strict=True))
    found = [measure(shape, grid, shape.length) for grid in grids]
    figures = [f"{m.shape_mean:.3f}, {m.cv:.3f}, {m.distance:.2f}{'' if m.right else ', wrong'}" for m in found]
    return Comparison(shape.name, cloud, fitted, surface, knots, (figures[0], figures[1]))


HEADER = (
    "| example | cloud [s] | B-spline fit [s] | front on the surface [s] | knots | ratio | the paper's |"
    " cloud: G, CV, distance | surface: G, CV, distance |\n"
    "| --- | ---: | ---: | ---: | --- | ---: | ---: | --- | --- |"
)


def table3(rounds: int = 3) -> list[Comparison]:
    """Return the four examples."""
    return [compare(make(name, POINTS), rounds) for name in PAPER]


NOTE = """\
The same clouds and the same code of the front; the other way first fits a bicubic spline with scipy (knots as dense
as helps; only one fit is timed) and looks at that surface instead. Ratio: seconds by way of the surface for one on
the cloud. Distance: mean distance of the nodes from the true surface, in standard deviations of the noise. The paper's
ratios are of its own fitting code; a library of today fits far faster."""


def section(command: str) -> Section:
    """Return the section of docs/numbers.md."""
    rows = table3()
    finding = f"Through a surface the same takes **{statistics.median(row.ratio for row in rows):.1f} times** as long (median of four)."
    lost = tuple(
        f"Through a B-spline surface, {row.name}: {row.ratio:.2f} of our time." for row in rows if row.ratio < 1
    )
    text = NOTE + "\n\n" + "\n".join([HEADER, *(row.row() for row in rows)])
    return Section("Table 3: by way of a surface", command, finding, text, lost)
