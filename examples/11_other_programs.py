"""From a scan to other programs: a roof as IFC, SAF and DXF, with sections, supports, loads and results where they can hold them."""

from pathlib import Path

from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> st.Truss:
    """Make a grid, a structure 300 times its size, solve it, and write it for BIM, analysis and CAD."""
    grid = st.grid_from_points(make("stadium", 30_000).points, st.Settings(length=6.0, unit="mm"))
    truss = st.Truss.from_grid(grid, scale=300, section="CHS114.3x5", supports="boundary", loads="self,snow:1kN/m2")
    solution = st.solve(truss)
    for name in ("stadium.ifc", "stadium.saf.xlsx", "stadium.dxf", "stadium.glb"):
        st.write(solution, folder / name)
    print(truss)
    return truss


if __name__ == "__main__":
    main()
