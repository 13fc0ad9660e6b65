"""What files hold of quads, hexagons and layers, read back by libraries that are not ours."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
import rhino3dm
import trimesh
from shapely.geometry import shape
from small_cells import Loops, comb, grid_of, vault
from small_grids import dome
from test_convert import UTM

import scantruss as st
from scantruss.grid.marks import member_marks, node_marks, numbered, panel_marks


@pytest.mark.parametrize("make", [vault, comb])
def test_quads_and_hexagons_are_whole_polygons_and_rows(
    make: Callable[[], tuple[np.ndarray, Loops]], tmp_path: Path
) -> None:
    nodes, loops = make()
    grid = grid_of(nodes, loops, origin=UTM, unit="m")
    for what in (grid, st.Truss.from_grid(grid, supports="boundary")):
        st.write(what, tmp_path / "a.geojson")
        features = json.loads((tmp_path / "a.geojson").read_text(encoding="utf-8"))["features"]
        found = {f["properties"]["mark"]: shape(f["geometry"]) for f in features if f["properties"]["kind"] == "panel"}
        assert list(found) == panel_marks(grid)
        for polygon, loop in zip(found.values(), loops, strict=True):
            assert polygon.geom_type == "Polygon" and polygon.is_valid
            assert np.abs(np.array(polygon.exterior.coords)[:-1] - grid.scan_nodes[loop]).max() < 1e-6
        st.write(what, tmp_path / "a.xlsx")
        book = openpyxl.load_workbook(tmp_path / "a.xlsx")
        rows = list(book["Panels"].iter_rows(min_row=2, values_only=True))
        marks = node_marks(grid)
        assert [row[0] for row in rows] == panel_marks(grid)
        assert [[each for each in row[1:] if each] for row in rows] == [[marks[k] for k in loop] for loop in loops]
        assert dict(book["Model"].iter_rows(values_only=True))["panels"] == len(loops)


def test_a_csv_has_the_marks_and_groups_of_all_files(tmp_path: Path) -> None:
    """The members of layers are in another order there, so that their numbers are not those of their marks."""
    truss = st.Truss.from_grid(dome(4, unit="m"), supports="boundary", double_layer=1.0)
    for what, marks, members in (
        (truss, truss.member_marks, np.sort(truss.members, axis=1)),
        (dome(4), member_marks(dome(4)), dome(4).edges),
    ):
        st.write(what, tmp_path / "a.csv")
        rows = list(csv.DictReader((tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()))
        mark = dict(zip(map(tuple, members.tolist()), marks, strict=True))
        pairs = [tuple(sorted((int(row["start"]), int(row["end"])))) for row in rows]
        assert [row["mark"] for row in rows] == [mark[pair] for pair in pairs] and all(row["group"] for row in rows)
        nodes = list(csv.DictReader((tmp_path / "a_nodes.csv").read_text(encoding="utf-8").splitlines()))
        assert [row["mark"] for row in nodes] == numbered("N", len(nodes), 3)


def test_layers_are_edges_of_ply(tmp_path: Path) -> None:
    truss = st.Truss.from_grid(dome(4, unit="m"), supports="boundary", double_layer=1.0)
    st.write(truss, tmp_path / "a.ply")
    held: Any = trimesh.load(tmp_path / "a.ply", process=False)
    np.testing.assert_allclose(held.vertices, truss.nodes + truss.origin, atol=1e-6)
    edges = held.metadata["_ply_raw"]["edge"]["data"]
    ends = np.stack([edges["vertex1"], edges["vertex2"]], axis=1)
    sides = {tuple(sorted(pair)) for face in truss.triangles.tolist() for pair in pairwise([*face, face[0]])}
    assert sides | set(map(tuple, np.sort(ends, axis=1).tolist())) == set(
        map(tuple, np.sort(truss.members, axis=1).tolist())
    )


def test_panels_of_many_nodes_have_their_marks_in_rhino(tmp_path: Path) -> None:
    nodes, loops = comb()
    st.write(grid_of(nodes, loops), tmp_path / "a.3dm")
    outlines = [each for each in rhino3dm.File3dm.Read(str(tmp_path / "a.3dm")).Objects
                if isinstance(each.Geometry, rhino3dm.PolylineCurve)]  # fmt: skip
    assert [each.Attributes.GetUserString("mark") for each in outlines] == numbered("P", len(loops), 4)
    for each, loop in zip(outlines, loops, strict=True):
        corners = [each.Geometry.Point(k) for k in range(each.Geometry.PointCount)]
        np.testing.assert_allclose([(p.X, p.Y, p.Z) for p in corners], nodes[[*loop, loop[0]]], atol=1e-12)
