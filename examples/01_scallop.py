"""Example 1 of the paper: a ribbed scallop valve with ears at the hinge, step by step; Table 2 before and after."""

from pathlib import Path

from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> st.Grid:
    """Make the grid of the valve step by step, save it and a picture of it over its scan."""
    shell = make("scallop")
    cloud = st.PointCloud.from_array(shell.points, unit="mm")
    settings = st.Settings(length=4.7, unit="mm")  # l_e, the desired length of the members
    surface = st.sample_surface(cloud, settings)  # samples with normals
    surface, boundary = st.find_boundary(surface, settings)  # one loop; the corners of the ears become nodes
    boundary, constraints = st.find_constraints(surface, boundary, settings)  # no fixed nodes, no lines
    fields = st.orientation_fields(surface, boundary, settings)  # candidate nodes for the front
    fronts = st.advance_fronts(surface, boundary, constraints, fields, settings)
    grid = st.optimize_fronts(fronts, surface, boundary, constraints, settings)  # the best, with its certificate
    print(f"before {grid.before}")
    print(f"after  {grid.quality}")
    st.write(grid, folder / "scallop.obj")
    st.write(grid, folder / "scallop.png", cloud=cloud)
    return grid


if __name__ == "__main__":
    main()
