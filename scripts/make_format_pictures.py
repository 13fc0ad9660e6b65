"""Make the pictures of docs/formats-output.md: files of the court of example 8, opened and drawn by programs that are not ours.

python scripts/make_format_pictures.py; needs LibreOffice Calc (soffice) and pdftoppm.
"""

import runpy
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import ezdxf
import ifcopenshell
import ifcopenshell.geom
import matplotlib
import numpy as np
import openpyxl
from ezdxf.addons.drawing import matplotlib as dxf_drawing
from openpyxl.worksheet.properties import PageSetupProperties
from PIL import Image, ImageOps

import scantruss as st

matplotlib.use("Agg")
ROOT = Path(__file__).resolve().parents[1]
FORMAT_PICTURES = ROOT / "docs" / "formats"
LIGHT = np.array([0.35, -0.55, 0.75])  # direction from which bodies are lit


def main() -> None:
    """Write the files and draw them."""
    sys.path.insert(0, str(ROOT / "examples"))
    FORMAT_PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        runpy.run_path(str(ROOT / "examples" / "08_great_court.py"))["main"](place)
        truss = st.read_structure(place / "roof.json")
        st.write(truss, place / "roof.dxf")
        st.write(truss, place / "roof.ifc")
        drawing = ezdxf.readfile(place / "roof.dxf")
        for name in ("marks members", "marks nodes"):
            drawing.layers.get(name).off()
        dxf_drawing.qsave(
            drawing.modelspace(), str(place / "dxf.png"), bg="#FFFFFF", fg="#000000", dpi=150, size_inches=(7, 5)
        )
        draw_ifc_bodies(place / "roof.ifc", place / "ifc.png")
        st.write(truss, place / "roof.saf.xlsx")
        draw_saf_members(place / "roof.saf.xlsx", place / "saf.png")
        for name in ("dxf", "ifc", "saf"):
            with Image.open(place / f"{name}.png") as image:
                small = image.convert("RGB").quantize(64, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
                small.save(FORMAT_PICTURES / f"{name}.png", optimize=True)


def draw_ifc_bodies(path: Path, picture: Path) -> None:
    """Draw the bodies of members and balls as the geometry kernel of ifcopenshell meshes them."""
    from matplotlib import pyplot
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    file = ifcopenshell.open(str(path))
    parts = [*file.by_type("IfcMember"), *file.by_type("IfcDiscreteAccessory")]
    options = ifcopenshell.geom.settings()
    options.set("use-world-coords", True)
    options.set("mesher-angular-deflection", 1.0)
    iterator = ifcopenshell.geom.iterator(options, file, 2, include=parts)
    corners: list[np.ndarray] = []
    assert iterator.initialize()
    while True:
        mesh: Any = iterator.get().geometry
        vertices, faces = np.array(mesh.verts).reshape(-1, 3), np.array(mesh.faces).reshape(-1, 3)
        corners.append(vertices[faces])
        if not iterator.next():
            break
    whole = np.concatenate(corners)
    normals = np.cross(whole[:, 1] - whole[:, 0], whole[:, 2] - whole[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    shade = np.clip(0.35 + 0.6 * (normals @ (LIGHT / np.linalg.norm(LIGHT))), 0.15, 0.95)
    figure = pyplot.figure(figsize=(7, 5), dpi=150)
    axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    axes.add_collection3d(Poly3DCollection(whole, facecolors=np.repeat(shade[:, None], 3, axis=1) * [0.75, 0.85, 1.0]))
    low, high = whole.reshape(-1, 3).min(axis=0), whole.reshape(-1, 3).max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.02)
    axes.view_init(35, -60)
    axes.set_axis_off()
    figure.subplots_adjust(0, 0, 1, 1)
    figure.savefig(picture)


def draw_saf_members(path: Path, picture: Path) -> None:
    """Print the sheet of the members by LibreOffice; openpyxl leaves its first rows and what is not empty, a page wide."""
    book = openpyxl.load_workbook(path)
    for name in book.sheetnames:
        if name != "StructuralCurveMember":
            del book[name]
    sheet = book.active
    sheet.delete_rows(22, sheet.max_row)
    for column in sheet.iter_cols():
        if column[0].value == "Id" or not any(cell.value for cell in column[1:]):
            sheet.column_dimensions[column[0].column_letter].hidden = True
    sheet.print_options.gridLines = True
    sheet.page_setup.orientation, sheet.page_setup.fitToHeight = "landscape", 0
    sheet.sheet_properties.pageSetUpPr = PageSetupProperties(fitToPage=True)
    book.save(path)
    subprocess.run(
        ["soffice", "--headless", "--convert-to", "pdf", "--outdir", str(path.parent), str(path)], check=True
    )
    pages = path.with_name(f"{path.stem}.pdf")
    subprocess.run(
        ["pdftoppm", "-r", "220", "-png", "-singlefile", str(pages), str(picture.with_suffix(""))], check=True
    )
    with Image.open(picture) as page:
        lit = ImageOps.invert(page.convert("L")).crop((0, 150, page.width, page.height - 150)).getbbox()
        assert lit is not None
        page.crop((lit[0], lit[1] + 150, lit[2], lit[3] + 150)).save(picture)


if __name__ == "__main__":
    main()
