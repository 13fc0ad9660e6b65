"""The three shells of freeGrid, the benchmark for gridshells (Bruno et al. 2023), as quads with few different joints."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import scantruss as st

SHELLS = {
    "barrel": 1.56,
    "dome": 1.5,
    "hypar": 1.46,
}  # and the members that give about as many joints as the baselines have [m]
HALF_SPAN, RISE = 15.0, 3.75  # of the parabola that all are made of [m]
RIM_POINTS = 2000  # along the boundary
NOISE = 0.005  # standard deviation of each coordinate [m]


def points_of(name: str, count: int) -> np.ndarray:
    """Return a scan (N, 3) of a shell [m]: a barrel on a square, a dome on a circle, a hypar on a square on its corner."""
    rng = np.random.default_rng(0)
    angle = np.linspace(0, 2 * np.pi, RIM_POINTS, endpoint=False)
    around = np.array([np.cos(angle), np.sin(angle)])
    x, y = rng.uniform(-HALF_SPAN, HALF_SPAN, (2, 2 * count))
    bend = RISE / HALF_SPAN**2
    inside = {"barrel": abs(x) < HALF_SPAN, "dome": x**2 + y**2 < HALF_SPAN**2, "hypar": abs(x) + abs(y) < HALF_SPAN}[
        name
    ]
    reach = {"barrel": abs(around).max(axis=0), "dome": np.ones(RIM_POINTS), "hypar": abs(around).sum(axis=0)}[name]
    x, y = np.concatenate([HALF_SPAN * around / reach, [x[inside][:count], y[inside][:count]]], axis=1)
    if name == "barrel":
        y *= 15.6034 / HALF_SPAN  # as long as the arc
    z = RISE + bend * ({"barrel": 0.0, "dome": -(y**2), "hypar": y**2}[name] - x**2)
    places = np.stack([x, y, z], axis=1)
    return np.asarray(places + NOISE * rng.normal(size=places.shape))


def planarity(grid: st.Grid) -> float:
    """Return 1 + the mean over the panels of the mean distance of the corners from their plane over half the perimeter."""
    off = []
    for loop in grid.panel_loops:
        corners = grid.nodes[loop] - grid.nodes[loop].mean(axis=0)
        normal = np.linalg.svd(corners)[2][2]
        perimeter = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).sum()
        off.append(np.abs(corners @ normal).mean() / (perimeter / 2))
    return float(1 + np.mean(off))


def main(folder: Path = Path(), names: Sequence[str] = tuple(SHELLS), count: int = 40_000) -> dict[str, st.PartKinds]:
    """Make the quads of each shell, move their nodes so that joints are alike, and print freeGrid's metrics of buildability."""
    made = {}
    for name in names:
        settings = st.Settings(length=SHELLS[name], unit="m", cells="quad")
        grid = st.grid_from_points(points_of(name, count), settings)
        found = made[name] = st.few_joints(grid)
        few = found.grid
        st.write(few, folder / f"{name}.obj")
        print(
            f"{name}: planarity {planarity(few):.3f}, {len(few.nodes)} joints of {len(found.representative)} kinds ({found.before} before),"
            f" {len(few.edges)} members, length {1 + few.quality.length_cv:.3f}, {few.lengths.sum():,.0f} m of members"
        )
    return made


if __name__ == "__main__":
    main()
