"""Every format of the table by a reader that is not ours: nodes within 1e-6 m far from the origin, the same marks, names from all over.

A format that is added has to be added here.
"""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import ezdxf
import ifcopenshell
import ifcopenshell.util.placement
import meshio
import numpy as np
import openpyxl
import pytest
import rhino3dm
import trimesh
from small_grids import dome
from test_convert import UTM

import scantruss as st
from scantruss.export.formats import FORMATS, suffixes_of, write
from scantruss.grid.line_sets import LineSet
from scantruss.settings import UNITS

NAME = 'Träger "Süd" 中文 屋顶'  #: of a line; quotes are replaced where they end a name
WORDS = ("Träger", "中文 屋顶")
NUMBER = r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?"

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")


class Found(NamedTuple):
    """What a reader finds."""

    places: Any  #: of the nodes, in the unit of the file
    marks: Any = ()  #: of the nodes
    names: str = ""  #: all names
    unit: str = ""  #: as the file says it; "" where the caller knows it
    exact: float = 1e-6  #: [m]


def from_csv(path: Path) -> Found:
    with path.with_name(f"{path.stem}_nodes.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert head[1].startswith("x [")
    return Found([row[1:4] for row in rows], names=" ".join(row[-1] for row in rows), unit=head[1][3:-1])


def from_json(path: Path) -> Found:
    held = json.loads(path.read_text(encoding="utf-8"))
    unit = held.get("unit") or held["units"]["length"]
    names = json.dumps(held.get("fixed_lines") or held.get("node_sets"), ensure_ascii=False)
    return Found(np.array(held["nodes"]) + held["origin"], held.get("node_marks", ()), names, unit)


def from_obj(path: Path) -> Found:
    text = path.read_text(encoding="utf-8")
    return Found(re.findall(rf"^v ({NUMBER}) ({NUMBER}) ({NUMBER})$", text, re.MULTILINE))


def from_ply(path: Path) -> Found:
    return Found(meshio.read(path).points)


def from_3dm(path: Path) -> Found:
    file = rhino3dm.File3dm.Read(str(path))
    unit = {"Meters": "m", "Millimeters": "mm"}[str(file.Settings.ModelUnitSystem).rpartition(".")[2]]
    points = [each for each in file.Objects if each.Geometry.ObjectType == rhino3dm.ObjectType.Point]
    places = [(p.Geometry.Location.X, p.Geometry.Location.Y, p.Geometry.Location.Z) for p in points]
    return Found(places, [p.Attributes.Name for p in points], " ".join(layer.Name for layer in file.Layers), unit)


def from_compas(path: Path) -> Found:
    data = json.loads(path.read_text(encoding="utf-8"))["graph"]["data"]
    nodes = data["node"].values()
    names = " ".join(edge["group"] for edges in data["edge"].values() for edge in edges.values())
    return Found(
        [(n["x"], n["y"], n["z"]) for n in nodes], [n["mark"] for n in nodes], names, data["attributes"]["unit"]
    )


def from_dxf(path: Path) -> Found:
    drawing = ezdxf.readfile(path)
    nodes = drawing.modelspace().query('INSERT[name=="NODE"]')
    names = " ".join(layer.dxf.name for layer in drawing.layers)
    return Found([tuple(n.dxf.insert) for n in nodes], [n.get_attrib_text("MARK") for n in nodes], names,
                 {4: "mm", 6: "m"}[drawing.header["$INSUNITS"]])  # fmt: skip


def from_geojson(path: Path) -> Found:
    held = json.loads(path.read_text(encoding="utf-8"))
    nodes = [each for each in held["features"] if each["properties"]["kind"] == "node"]
    names = " ".join(each["properties"].get("group", "") for each in held["features"])
    marks = [each["properties"]["mark"] for each in nodes]
    return Found([each["geometry"]["coordinates"] for each in nodes], marks, names, held["unit"])


def from_glb(path: Path) -> Found:
    scene: Any = trimesh.load(path)
    content = path.read_bytes()
    head = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
    (matrix,) = (matrix for matrix, shape in map(scene.graph.get, scene.graph.nodes_geometry) if shape == "panels")
    places = trimesh.transform_points(scene.geometry["panels"].vertices, matrix)[:, [0, 2, 1]] * [1, -1, 1]
    apart = [place for k, place in enumerate(places) if np.abs(places[:k] - place).max(axis=1).min(initial=1.0) > 0.1]
    return Found(np.array(apart) + head["nodes"][0]["extras"]["origin"], unit="m", exact=1e-4)


def from_html(path: Path) -> Found:
    return Found(None, names=path.read_text(encoding="utf-8"))


def from_ifc(path: Path) -> Found:
    file = ifcopenshell.open(str(path))
    nodes = file.by_type("IfcDiscreteAccessory")
    places = [ifcopenshell.util.placement.get_local_placement(n.ObjectPlacement)[:3, 3] for n in nodes]
    return Found(places, [n.Name for n in nodes], " ".join(g.Name for g in file.by_type("IfcGroup")), "m")


def from_inp(path: Path) -> Found:
    text = path.read_text(encoding="utf-8").partition("*NODE")[2].partition("\n*")[0]
    return Found([row.split(",")[1:4] for row in text.splitlines()[1:]], unit="m")


def from_karamba(path: Path) -> Found:
    held = json.loads(path.read_text(encoding="utf-8"))
    names = " ".join(each["group"] for each in held["elements"])
    return Found(held["points"], held["point_ids"], names, held["length"])


def from_py(path: Path) -> Found:
    text = path.read_text(encoding="utf-8")
    return Found(re.findall(rf"ops\.node\(\d+, ({NUMBER}), ({NUMBER}), ({NUMBER})\)", text), unit="m")


def from_s2k(path: Path) -> Found:
    text = path.read_text(encoding="utf-8")
    rows = re.findall(rf"Joint=(\w+) .*XorR=({NUMBER})\s+Y=({NUMBER})\s+Z=({NUMBER})", text)
    return Found([row[1:] for row in rows], [row[0] for row in rows], text, "m")


def from_saf(path: Path) -> Found:
    book = openpyxl.load_workbook(path)
    rows = list(book["StructuralPointConnection"].iter_rows(min_row=2, values_only=True))
    names = " ".join(str(cell) for row in book["StructuralCurveMember"].iter_rows(values_only=True) for cell in row)
    return Found([row[1:4] for row in rows], [row[0] for row in rows], names, "m")


def from_solid(path: Path) -> Found:
    """The boxes around members and balls hold all nodes; the origin is that of the structure."""
    scene: Any = trimesh.load(path)
    size = 1.0 if path.suffix == ".3mf" else 1e-3
    return Found(np.array(scene.bounds) * size + UTM, unit="m", exact=0.2)


def from_step(path: Path) -> Found:
    text = path.read_text(encoding="ascii")
    rows = re.findall(rf"CARTESIAN_POINT\('(N\d+)',\(({NUMBER}),({NUMBER}),({NUMBER})\)\)", text)
    names = re.sub(r"\\X2\\([0-9A-F]+)\\X0\\", lambda found: bytes.fromhex(found[1]).decode("utf-16-be"), text)
    return Found([row[1:] for row in rows], [row[0] for row in rows], names, "mm" if ".MILLI." in text else "m")


def from_tcl(path: Path) -> Found:
    text = path.read_text(encoding="utf-8")
    return Found(re.findall(rf"^\s+node \d+ ({NUMBER}) ({NUMBER}) ({NUMBER})$", text, re.MULTILINE), unit="m")


def from_vtu(path: Path) -> Found:
    return Found(meshio.read(path).points, names=path.read_text(encoding="utf-8"))


def from_xlsx(path: Path) -> Found:
    book = openpyxl.load_workbook(path)
    head, *rows = book["Nodes"].iter_rows(values_only=True)
    names = " ".join(str(row[3]) for row in book["Members"].iter_rows(values_only=True))
    return Found([row[1:4] for row in rows], [row[0] for row in rows], names, str(head[1])[3:-1])


READERS_OF: dict[str, Callable[[Path], Found]] = {
    ".csv": from_csv, ".json": from_json, ".obj": from_obj, ".ply": from_ply, ".3dm": from_3dm, ".compas.json": from_compas,
    ".dxf": from_dxf, ".geojson": from_geojson, ".glb": from_glb, ".html": from_html, ".ifc": from_ifc, ".inp": from_inp,
    ".karamba.json": from_karamba, ".py": from_py, ".s2k": from_s2k, ".saf.xlsx": from_saf, ".3mf": from_solid, ".stl": from_solid,
    ".step": from_step, ".stp": from_step, ".tcl": from_tcl, ".vtu": from_vtu, ".xlsx": from_xlsx,
}  # fmt: skip
WITHOUT_NAMES = (".obj", ".ply", ".glb", ".inp", ".py", ".tcl", ".3mf", ".stl")  # they hold no groups


def grid_in(unit: str) -> st.Grid:
    """A grid with a line of a name from all over, far from the origin."""
    size = 1.0 / (UNITS[unit] or 1.0)
    line = LineSet(NAME, "fixed line", np.array([1, 5, 9, 13]))
    pairs = np.array([[1, 5], [5, 9], [9, 13]])
    return dome(4, 4.0 * size, origin=UTM * size, unit=unit, lines=pairs, line_sets=(line,))


CASES = [(kind, suffix) for kind in ("grid", "structure") for suffix in suffixes_of(kind) if suffix != ".png"]


def test_every_format_has_a_reader_here() -> None:
    assert READERS_OF.keys() == FORMATS.keys() - {".png"}


@pytest.mark.parametrize(("kind", "suffix"), CASES)
def test_nodes_marks_and_names_are_the_same_in_every_format(kind: str, suffix: str, tmp_path: Path) -> None:
    grid = grid_in("mm" if kind == "grid" else "m")
    what: Any = grid
    if kind == "structure":
        what = st.solve(st.Truss.from_grid(grid, supports="boundary", loads="self,snow:1kN/m2"))
    path = tmp_path / f"Dach 屋顶 ü{suffix}"
    write(what, path)
    found = READERS_OF[suffix](path)
    metres = UNITS[found.unit or grid.unit] or 1.0
    there = grid.scan_nodes * (UNITS[grid.unit] or 1.0)
    if found.places is not None:
        places = np.array(found.places, float) * metres
        if suffix in (".3mf", ".stl"):
            there = np.array([there.min(axis=0), there.max(axis=0)])
        elif suffix == ".glb":  # in the order of the panels
            places = np.array([min(places, key=lambda place: np.abs(place - other).max()) for other in there])
        assert places.shape == there.shape and np.abs(places - there).max() < found.exact
    if len(found.marks):
        assert list(found.marks) == [f"N{k:03d}" for k in range(1, len(grid.nodes) + 1)]
    if suffix not in WITHOUT_NAMES:
        assert all(word in found.names for word in WORDS)


def write_all(folder: str) -> None:
    """Write a grid and a structure in every format, for a process of its own."""
    grid = grid_in("m")
    solved = st.solve(st.Truss.from_grid(grid, supports="boundary", loads="self,snow:1kN/m2"))
    for kind, suffix in CASES:
        write(grid if kind == "grid" else solved, Path(folder, f"{kind}{suffix}"))


def test_processes_with_other_seeds_of_words_write_the_same_bytes(tmp_path: Path) -> None:
    command = [sys.executable, "-c", "import sys, test_every_format as t; t.write_all(sys.argv[1])"]
    path = os.pathsep.join([str(Path(__file__).parent), *filter(None, sys.path)])
    running = []
    for seed in ("1", "2"):
        (tmp_path / seed).mkdir()
        environment = os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": path}
        running.append(subprocess.Popen([*command, str(tmp_path / seed)], env=environment))
    assert [each.wait(timeout=300) for each in running] == [0, 0]
    names = [sorted(each.name for each in (tmp_path / seed).iterdir()) for seed in ("1", "2")]
    assert names[0] == names[1] and len(names[0]) > len(CASES)
    different = [
        name for name in names[0] if (tmp_path / "1" / name).read_bytes() != (tmp_path / "2" / name).read_bytes()
    ]
    assert different == []
