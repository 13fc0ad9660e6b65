"""Example 7 of the paper: three fixed nodes for supports, the first of them close to the boundary."""

from pathlib import Path

import numpy as np
from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> st.Grid:
    """Make the grid of the valve with nodes exactly at three positions."""
    shell = make("scallop")
    supports = tuple(tuple(map(float, position)) for position in shell.fixed)
    grid = st.grid_from_points(shell.points, st.Settings(length=4.7, unit="mm", fixed=supports))
    for position in supports:
        away = np.linalg.norm(grid.nodes + grid.origin - position, axis=1).min()
        print(f"fixed node at {np.round(position, 2)}: a node {away:.1e} mm away")
    print(f"{grid.quality}, worst triangle {grid.quality.shape_min:.2f}")
    st.write(grid, folder / "fixed-nodes.json")
    return grid


if __name__ == "__main__":
    main()
