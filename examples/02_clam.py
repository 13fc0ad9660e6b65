"""Example 2 of the paper: a deep clam valve with a steep margin, by the paper to the letter and by the default method."""

from pathlib import Path

from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> dict[str, st.Grid]:
    """Make both grids and save them."""
    shell = make("clam")
    grids = {}
    for method in ("paper", "default"):
        grid = st.grid_from_points(shell.points, st.Settings(length=1.9, unit="mm", method=method))
        print(f"{method:8s} {grid.quality}, {grid.quality.valence6:.0%} of the inner nodes have six members")
        st.write(grid, folder / f"clam-{method}.ply")
        grids[method] = grid
    return grids


if __name__ == "__main__":
    main()
