"""Example 5 of the paper: the valve with two holes; from the external boundary or from all boundaries (Fig. 5)."""

from pathlib import Path

from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> dict[str, st.Grid]:
    """Make the grid both ways of Sec. 3.6 and compare them."""
    shell = make("two_holes")
    grids = {}
    for source in ("external", "all"):
        grid = st.grid_from_points(shell.points, st.Settings(length=4.7, unit="mm", advance_from=source))
        print(f"{source:8s} {grid.topology.boundary_loops} loops, {grid.quality}")
        st.write(grid, folder / f"two-holes-{source}.obj")
        grids[source] = grid
    return grids


if __name__ == "__main__":
    main()
