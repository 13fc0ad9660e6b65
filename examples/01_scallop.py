"""Example 1 of the paper: a ribbed scallop valve with ears at the hinge, step by step; Table 2 before and after."""

from pathlib import Path

from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> st.Grid:
    """Make the grid of the valve in its four steps, save it and a picture of it over its scan."""
    shell = make("scallop")
    cloud = st.PointCloud.from_array(shell.points, unit="mm")
    settings = st.Settings(length=4.7, unit="mm")  # l_e, the desired length of the members
    boundary = st.find_boundary(cloud, settings)  # one loop; the corners of the ears become nodes
    front = st.advance_front(cloud, boundary, settings)
    grid = st.optimize_grid(front, cloud, settings)
    print(f"before {front.quality}")
    print(f"after  {grid.quality}")
    st.write(grid, folder / "scallop.obj")
    st.write(grid, folder / "scallop.png", cloud=cloud)
    return grid


if __name__ == "__main__":
    main()
