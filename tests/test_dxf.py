"""DXF read back by ezdxf, whose audit finds nothing, and by a reader of bare pairs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from small_grids import dome, fan
from test_convert import UTM, roof

import scantruss as st
from scantruss.export.style import FileStyle
from scantruss.grid.line_sets import LineSet

NAME = "Träger 'Süd' <中文>/1"


def sheet(unit: str = "m") -> st.Grid:
    line = LineSet(NAME, "fixed line", np.array([0, 1, 2]))
    return fan(4.0, unit=unit, origin=UTM, fixed=(1,), lines=np.array([[0, 1], [1, 2]]), line_sets=(line,))


def written(what: Any, path: Path, style: FileStyle | None = None) -> Any:
    st.write(what, path, style=style)
    drawing = ezdxf.readfile(path)
    audit = drawing.audit()
    assert [str(error.message) for error in (*audit.errors, *audit.fixes)] == []
    return drawing


def mark_of(entity: Any) -> str:
    return str(entity.get_xdata("SCANTRUSS")[0].value)


def test_a_grid_is_lines_faces_and_blocks_on_layers_of_their_own(tmp_path: Path) -> None:
    grid = sheet()
    drawing = written(grid, tmp_path / "Dach 屋顶.dxf")
    space = drawing.modelspace()
    assert drawing.header["$INSUNITS"] == 6 and "0" not in {entity.dxf.layer for entity in space}
    lines = {mark_of(line): line for line in space.query("LINE")}
    assert list(lines) == [f"M{k:04d}" for k in range(1, 13)]
    for line, (start, end) in zip(lines.values(), grid.edges, strict=True):
        assert np.abs(np.array(line.dxf.start) - grid.scan_nodes[start]).max() < 1e-6
        assert np.abs(np.array(line.dxf.end) - grid.scan_nodes[end]).max() < 1e-6
    assert {line.dxf.layer for line in lines.values()} == {
        "members boundary",
        "members inner",
        "members Träger 'Süd' _中文__1",
    }
    faces = {mark_of(face): face for face in space.query("3DFACE")}
    for face, corners in zip(faces.values(), grid.triangles, strict=True):
        assert np.abs(np.array(face.wcs_vertices()[:3]) - grid.scan_nodes[corners]).max() < 1e-6
    balls = space.query('INSERT[name=="NODE"]')
    assert [ball.get_attrib_text("MARK") for ball in balls] == [f"N{k:03d}" for k in range(1, 8)]
    assert np.abs(np.array([ball.dxf.insert for ball in balls]) - grid.scan_nodes).max() < 1e-6
    (support,) = space.query('INSERT[name=="SUPPORT"]')
    assert (support.get_attrib_text("MARK"), support.get_attrib_text("HELD")) == ("N002", "fixed node")
    assert sorted(text.dxf.text for text in space.query("TEXT")) == sorted(lines)
    handles = [entity.dxf.handle for entity in drawing.entitydb.values()]
    assert len(set(handles)) == len(handles) and max(int(h, 16) for h in handles) < int(drawing.header["$HANDSEED"], 16)


@pytest.mark.parametrize(("unit", "code"), [("", 0), ("inch", 1), ("foot", 2), ("mm", 4), ("cm", 5), ("m", 6)])
def test_the_unit_is_that_of_the_grid(unit: str, code: int, tmp_path: Path) -> None:
    assert written(dome(4, unit=unit), tmp_path / "a.dxf").header["$INSUNITS"] == code


def test_supports_of_a_structure_say_how_they_hold(tmp_path: Path) -> None:
    truss = roof(support_type="springs:5MN/m")
    truss = truss.replace(
        sections=(
            *truss.sections,
            st.Truss.from_grid(dome(3, unit="m"), supports="boundary", section="SHS100x5").sections[0],
        ),
        section_of=np.arange(len(truss.members)) % 2,
    )
    drawing = written(truss, tmp_path / "a.dxf", FileStyle(ball=200.0))
    supports = drawing.modelspace().query('INSERT[name=="SUPPORT"]')
    assert {each.get_attrib_text("HELD") for each in supports} == {"ux=5e+06 uy=5e+06 uz=5e+06"}
    assert {each.get_attrib_text("MARK") for each in supports} == {
        truss.node_marks[k] for k in np.flatnonzero(truss.supports.any(axis=1))
    }
    assert {ball.dxf.xscale for ball in drawing.modelspace().query('INSERT[name=="NODE"]')} == {0.1}
    assert {line.dxf.layer for line in drawing.modelspace().query("LINE")} == {
        f"members {group} {section.name}" for group in ("boundary", "inner") for section in truss.sections
    }


def test_a_reader_of_bare_pairs_finds_the_same_lines(tmp_path: Path) -> None:
    grid = sheet()
    st.write(grid, tmp_path / "a.dxf")
    words = (tmp_path / "a.dxf").read_text(encoding="utf-8").splitlines()
    pairs = list(zip((int(word) for word in words[::2]), words[1::2], strict=True))
    starts = [k for k, pair in enumerate(pairs) if pair == (0, "LINE")]
    found = []
    for start in starts:
        values = {}
        for code, value in pairs[start + 1 :]:
            if code == 0:
                break
            values[code] = value
        found.append([[float(values[10 + end + 10 * axis]) for axis in range(3)] for end in (0, 1)])
    np.testing.assert_array_equal(np.array(found), grid.scan_nodes[grid.edges])
