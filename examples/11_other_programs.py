"""From a scan to other programs: a great court as IFC, SAF and DXF, with sections, supports, loads and results where these hold them."""

from pathlib import Path

from clouds import make

import scantruss as st


def main(folder: Path = Path()) -> st.Truss:
    """Make a grid and a structure of it, solve it, and write it for BIM, analysis, CAD and a browser."""
    grid = st.grid_from_points(make("court", 30_000).points, st.Settings(length=5.5, unit="m"))
    truss = st.Truss.from_grid(grid, section="CHS168.3x8", supports="loop:1+loop:2", loads="self,snow:0.6kN/m2")
    solution = st.solve(truss)
    for name in ("court.ifc", "court.saf.xlsx", "court.dxf", "court.glb"):
        st.write(solution, folder / name)
    print(truss)
    return truss


if __name__ == "__main__":
    main()
