"""A great court: from the scan of a roof between a rectangle and a circle to sized tubes and a report to read."""

import json
from pathlib import Path
from typing import Any

from clouds import make

import scantruss as st
from scantruss.cli.main import main as run


def main(folder: Path = Path()) -> dict[str, Any]:
    """Make the grid, then what `scantruss structure` makes of it, at most two sizes of tubes that pass; return its figures."""
    roof = make("court", 30_000)
    grid = st.grid_from_points(roof.points, st.Settings(length=5.5, unit="m"))
    st.write(grid, folder / "court.json")
    words = [
        "structure",
        folder / "court.json",
        folder / "roof.json",
        folder / "roof.html",
        "--report",
        folder / "figures.json",
    ]
    words += ["--supports", "loop:1+loop:2", "--section", "CHS168.3x8", "--material", "S355", "--size", 2]
    words += [
        "--loads",
        "self,cladding:0.6kN/m2,snow:0.6kN/m2,wind:0.6kN/m2:-0.6",
        "--node-allowance",
        0.1,
    ]
    if run([str(word) for word in [*words, "--frequencies", 1, "--quiet", "--force"]]):
        raise SystemExit("the court is no structure")
    figures: dict[str, Any] = json.loads((folder / "figures.json").read_text())
    print(f"{figures['mass'] / 1e3:.1f} t of {figures['sections']}, utilization {figures['utilization_max']:.2f},")
    print(f"buckling factor {figures['buckling_factors'][0]:.3g}, {figures['frequencies'][0]:.3g} Hz")
    return {"nodes": len(grid.nodes), "members": len(grid.edges), **figures}


if __name__ == "__main__":
    main()
