"""The limpet of example 3 as a shell of glued laminated timber, 19 m long: solved, buckling looked at, no timber clause checked."""

from pathlib import Path

from clouds import make

import scantruss as st
from scantruss.report.structural.contents import report_parts
from scantruss.report.structural.html import encode_html
from scantruss.report.structural.source import ReportSource
from scantruss.structure.modes import worst_buckling
from scantruss.structure.options import StructureSettings
from scantruss.structure.report import StructureReport, report_structure
from scantruss.structure.statics import factor_stiffness
from scantruss.structure.variants import truss_arguments

SETTINGS = StructureSettings(
    scale=200, section="R120x240", material="GL24h", supports="boundary", joints="2e6",
    loads=("self", "cladding:0.4kN/m2", "snow:1kN/m2", "half-snow:1kN/m2@0"),
)  # fmt: skip


def main(folder: Path = Path()) -> StructureReport:
    """Make the structure 1:200, solve it under its weight, cladding and snow, and write its report."""
    grid = st.grid_from_points(make("limpet", 60_000).points, st.Settings(length=7.8, unit="mm"))
    truss = st.Truss.from_grid(grid, **truss_arguments(SETTINGS))
    factored = factor_stiffness(truss)
    solution = st.solve(truss, factored)
    report = report_structure(solution, buckling=worst_buckling(factored, solution, 2))
    source = ReportSource("limpet", "", SETTINGS, solution, report)
    (folder / "limpet.html").write_bytes(encode_html(report_parts(source)))
    uls = [case for case in solution.all_results() if case.state == "ULS"]
    stress = max(float(abs(case.stresses).sum(axis=1).max()) for case in uls)
    print(f"{truss.mass:,.0f} kg, {1e-6 * stress:.2f} MPa at most, for timber design to judge: {report.warnings[0]}")
    return report


if __name__ == "__main__":
    main()
