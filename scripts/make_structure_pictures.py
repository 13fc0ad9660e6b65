"""Make the pictures of docs/structure.md, of the court of example 8: python scripts/make_structure_pictures.py."""

import io
import runpy
import sys
import tempfile
from pathlib import Path

from PIL import Image

import scantruss as st
from scantruss.export.drawing.structure import encode_structure_picture, mode_picture, moved_picture
from scantruss.report.structural.contents import overview_picture
from scantruss.structure.modes import worst_buckling
from scantruss.structure.report import report_structure
from scantruss.structure.statics import factor_stiffness

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / "docs" / "structure"
SIZE = (1200, 750)


def main() -> None:
    """Run the example and draw its structure."""
    sys.path.insert(0, str(ROOT / "examples"))
    with tempfile.TemporaryDirectory() as folder:
        figures = runpy.run_path(str(ROOT / "examples" / "08_great_court.py"))["main"](Path(folder))
        truss = st.read_structure(Path(folder) / "roof.json")
    factored = factor_stiffness(truss)
    solution = st.solve(truss, factored)
    modes = worst_buckling(factored, solution, 1)
    service = max(
        (case for case in solution.all_results() if case.state == "SLS"), key=lambda case: case.displacement_max
    )
    pictures = {
        "utilization": overview_picture(solution, report_structure(solution)),
        "displacements": moved_picture(truss, f"displacements under {service.name}", service.displacements[:, :3]),
        "buckling": mode_picture(truss, f"buckling mode 1, factor {modes.values[0]:.3g}", modes.shapes[0]),
    }
    PLACE.mkdir(exist_ok=True)
    for name, shown in pictures.items():
        with Image.open(io.BytesIO(encode_structure_picture(truss, shown, SIZE))) as image:
            small = image.convert("RGB").quantize(256, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
            small.save(PLACE / f"{name}.png", optimize=True)
    print(
        {
            name: figures[name]
            for name in ("nodes", "members", "mass", "sections", "utilization_max", "displacement_max")
        }
    )
    print(
        {
            name: figures[name]
            for name in ("force_min", "buckling_factors", "buckling_case", "frequencies", "mass_by_sections")
        }
    )


if __name__ == "__main__":
    main()
