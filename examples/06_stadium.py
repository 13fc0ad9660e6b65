"""Example 6 of the paper: the limpet with an elliptic hole, a stadium; from a file, with its settings beside it."""

from pathlib import Path

import numpy as np
from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> st.Grid:
    """Save the scan as text, read it again, make the grid and a picture."""
    scan = folder / "stadium.xyz"
    np.savetxt(scan, make("stadium", 60_000).points, fmt="%.4f")
    cloud = st.read_points(scan, unit="mm")
    grid = st.grid_from_scan(scan, st.Settings(length=3.9, unit="mm"))
    loops = [len(loop) for loop in grid.boundary_loops]
    print(f"{len(grid.nodes)} nodes, boundaries of {loops} members, {grid.quality}")
    st.write(grid, folder / "stadium.png", cloud=cloud)
    return grid


if __name__ == "__main__":
    main()
