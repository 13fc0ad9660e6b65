"""Example 4 of the paper: the plaster of a cloth hung from its four corners; the corners are nodes, the supports."""

from pathlib import Path

import numpy as np
from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> st.Grid:
    """Make the grid and print how far its nodes are from the four corners and from the true surface."""
    plaster = make("cloth")
    grid = st.grid_from_points(plaster.points, st.Settings(length=2.75, unit="mm"))
    nodes = grid.nodes + grid.origin
    print(grid.quality)
    for corner in plaster.corners:
        print(f"a node {np.linalg.norm(nodes - corner, axis=1).min():.3f} mm from the corner {np.round(corner, 1)}")
    st.write(grid, folder / "cloth.csv")
    return grid


if __name__ == "__main__":
    main()
