"""What a grid, a cloud and settings say of themselves, and their pictures in notebooks."""

import json
from collections.abc import Callable
from html import unescape
from typing import Any

import numpy as np
from shapes import make
from small_grids import dome
from typed import known

import scantruss as st
from scantruss.report.notebook import cloud_picture, grid_picture, settings_table, show_pictures


def test_they_say_in_one_line_what_they_are() -> None:
    grid, points = dome().replace(unit="mm"), np.random.default_rng(0).uniform(0, [10.0, 20.0, 5.0], (3000, 3))
    said = repr(grid)
    assert f"{len(grid.nodes):,} nodes" in said and f"{len(grid.edges):,} members of" in said and " mm" in said
    cloud = repr(st.PointCloud.from_array(points, unit="m", name="roof.ply"))
    assert cloud.startswith("PointCloud(roof.ply: 3,000 points, ") and cloud.endswith(" m)")
    assert repr(st.Settings(length=4.7, effort="best")) == "Settings(length=4.7, effort='best')"
    assert all("\n" not in words and len(words) < 100 for words in (said, cloud))


def test_so_does_each_step() -> None:
    cloud, settings = (
        st.PointCloud.from_array(make("two_holes", 4000).points),
        st.Settings(length=make("two_holes", 4000).length),
    )
    surface, boundary = st.find_boundary(st.sample_surface(cloud, settings), settings)
    boundary, constraints = st.find_constraints(
        surface, boundary, settings.replace(fixed=[surface.scan[0] + surface.origin])
    )
    assert repr(surface).startswith("SurfaceSamples(") and "samples of 4,000 points, pieces 1, area " in repr(surface)
    assert repr(boundary).startswith(f"Boundary({len(boundary.loops)} loops: ") and repr(boundary).count(
        "(hole)"
    ) == len(boundary.internal)
    assert repr(constraints) == "Constraints(1 fixed nodes, 0 fixed lines, 0 ridges)"


def test_notebooks_show_a_picture_of_each() -> None:
    kept = {}

    class Formatter:
        def for_type_by_name(self, module: str, name: str, function: Callable[..., Any]) -> None:
            kept[module, name] = function

    class Shell:
        class display_formatter:  # noqa: N801
            formatters = {"image/png": Formatter(), "text/html": Formatter()}  # noqa: RUF012

    show_pictures(Shell())
    shown: list[tuple[Any, Callable[[Any], bytes | None]]] = [
        (dome(), grid_picture),
        (st.PointCloud.from_array(make("cloth", 5000).points), cloud_picture),
    ]
    for value, picture in shown:
        kind = type(value)
        assert kept[kind.__module__, kind.__name__] is picture
        assert known(picture(value)).startswith(b"\x89PNG")
    settings = st.Settings(length=4.7, fixed=[(k, 0.0, 0.0) for k in range(40)])
    assert kept[type(settings).__module__, "Settings"] is settings_table
    table = settings_table(settings)
    assert table.count("<tr>") == 2 and "4.7" in table and "desired member length" in table and "..." in table
    assert grid_picture(dome().replace(triangles=np.zeros((0, 3), np.int64))) is None


def test_a_notebook_shows_a_grid_to_turn() -> None:
    grid = dome()
    text = grid.show()._repr_html_()
    assert (
        text.startswith('<iframe srcdoc="&lt;!doctype html&gt;') and text.count("<") == 2
    )  # all of the page is escaped
    assert f"{len(grid.edges):,} members" in text and "http" not in text.lower().replace("http-equiv", "")


def test_a_notebook_shows_a_scan_to_turn() -> None:
    points = np.random.default_rng(4).uniform(0, 1, (400, 3)) * [8.0, 6.0, 1.0] + [4.5e5, 5.3e6, 0.0]
    text = unescape(st.PointCloud.from_array(points, unit="m", name="hall.ply").show()._repr_html_())
    assert text.startswith("<iframe") and "400 of 400 points are drawn, in m" in text
    data = json.loads(text.partition('id="data">')[2].partition("</script>")[0])
    assert data["nodes"] == "" and len(data["home"]) == 400 and np.ptp(np.array(data["home"])[:, 0]) < 8.0
