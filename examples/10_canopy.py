"""A canopy that follows the hills below it, on nine feet that are fixed nodes, and lifted by wind."""

from pathlib import Path

from clouds import make

import scantruss as st
from scantruss.structure.json import encode_structure
from scantruss.structure.modes import worst_buckling
from scantruss.structure.report import StructureReport, report_structure
from scantruss.structure.sizing import size_members
from scantruss.structure.statics import factor_stiffness


def main(folder: Path = Path()) -> StructureReport:
    """Make the grid with nodes on the feet, size its tubes for snow and wind, and say what the feet must hold."""
    roof = make("canopy", 40_000)
    grid = st.grid_from_points(
        roof.points, st.Settings(length=2.5, unit="m", fixed=tuple(map(tuple, roof.fixed.tolist())))
    )
    truss = st.Truss.from_grid(
        grid, section="CHS114.3x5", supports="fixed", support_type="fixed", loads="self,cladding:0.3kN/m2,snow:0.8kN/m2,wind:0.7kN/m2:-1.2",
    )  # fmt: skip
    truss = size_members(truss, 2)
    factored = factor_stiffness(truss)
    solution = st.solve(truss, factored)
    report = report_structure(solution, buckling=worst_buckling(factored, solution, 1))
    (folder / "canopy.json").write_bytes(encode_structure(truss, solution, report))
    lift = -solution["ULS 1 self + 1 cladding + 1.5 wind"].reactions[:, 2].min()
    print(
        f"{truss.mass:,.0f} kg of {', '.join(s.name for s in truss.sections)}; a foot is lifted by {lift / 1e3:.1f} kN at most"
    )
    return report


if __name__ == "__main__":
    main()
