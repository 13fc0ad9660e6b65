"""Example 3 of the paper: an oval limpet with a nearly pointed apex, down to the model for the 3D printer."""

from pathlib import Path

from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> st.Grid:
    """Make the grid, keep it whole as JSON, and print it at its own size with 1 mm members."""
    shell = make("limpet")
    grid = st.grid_from_points(shell.points, st.Settings(length=7.8, unit="mm"))
    print(grid.quality)
    st.write(grid, folder / "limpet.json")
    again = st.read_grid(folder / "limpet.json")  # nodes, triangles, settings: nothing is lost
    st.print_model(again, folder / "limpet.3mf", member_diameter=1.0, node_diameter=1.8)
    return grid


if __name__ == "__main__":
    main()
