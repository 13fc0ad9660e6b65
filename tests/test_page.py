"""The page of a grid or a structure: it holds the data, asks nothing of the network, and a browser shows it."""

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import open_page

import scantruss as st
from scantruss.export.drawing.structure import OVERUSED_COLOUR
from scantruss.export.formats import losses, model_of
from scantruss.export.page import encode_page
from scantruss.export.style import FileStyle
from scantruss.grid.grid import Grid
from scantruss.grid.line_sets import FIXED_LINE, LineSet
from scantruss.scan.cloud import PointCloud
from scantruss.structure.report import report_structure


def sheet(count: int = 6, origin: tuple[float, float, float] = (4.5e5, 5.3e6, 120.0)) -> Grid:
    """Return a flat grid of equal triangles, far from the origin of its frame."""
    across, up = np.meshgrid(np.arange(count), np.arange(count))
    nodes = np.stack([across + 0.5 * up, up * 3**0.5 / 2, 0.1 * np.sin(across)], axis=-1).reshape(-1, 3).astype(float)
    first = (across + count * up)[:-1, :-1].ravel()
    low, high = [first, first + 1, first + count], [first + 1, first + count + 1, first + count]
    triangles = np.concatenate([np.stack(low, axis=1), np.stack(high, axis=1)])
    return Grid(
        nodes=nodes, triangles=triangles, fixed=np.zeros(len(nodes), bool), origin=np.array(origin), unit="m",
        settings=st.Settings(length=1.0),
    )  # fmt: skip


def data_of(page: bytes) -> dict[str, Any]:
    """Return what the page holds."""
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page.decode(), re.DOTALL)
    found: dict[str, Any] = json.loads(text)
    return found


def page_of(grid: Grid, cloud: PointCloud | None = None) -> bytes:
    """Return the page of a grid."""
    return encode_page(model_of(grid, cloud=cloud), FileStyle())


class Balanced(HTMLParser):
    """Refuses tags that are not closed in their order."""

    VOID = frozenset({"meta", "input", "br", "img", "link"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note a tag."""
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Close the last one."""
        assert self.open.pop() == tag


def test_the_page_holds_nodes_to_the_last_bit_and_the_scan_to_a_part_of_its_box() -> None:
    grid = sheet()
    rng = np.random.default_rng(4)
    cloud = PointCloud.from_array(grid.scan_nodes.mean(axis=0) + rng.normal(0, 2, (500, 3)), unit="m")
    found = data_of(page_of(grid, cloud))
    assert np.frombuffer(base64.b64decode(found["nodes"]), "<f8").tobytes() == grid.nodes.tobytes()
    assert np.array_equal(np.frombuffer(base64.b64decode(found["members"]), "<i4").reshape(-1, 2), grid.edges)
    assert np.array_equal(np.frombuffer(base64.b64decode(found["triangles"]), "<i4").reshape(-1, 3), grid.triangles)
    low, high = np.array(found["scan"]["low"]), np.array(found["scan"]["high"])
    share = np.frombuffer(base64.b64decode(found["scan"]["points"]), "<u2").reshape(-1, 3) / 65535
    points = low + share * (high - low) + found["origin"]
    assert np.abs(points - (cloud.points + cloud.origin)).max() <= (high - low).max() / 65535
    lengths = next(one["values"] for one in found["tables"]["members"] if one["name"] == "length")
    assert np.allclose(lengths, grid.lengths, rtol=1e-5)


def test_the_page_asks_nothing_of_the_network_and_its_tags_are_closed() -> None:
    text = page_of(sheet()).decode()
    assert not re.search(r"https?:|\bsrc=|\bhref=|@import|url\(|fetch\(|XMLHttpRequest|WebSocket|import\(", text)
    parser = Balanced()
    parser.feed(text)
    assert parser.open == []


def test_more_than_one_has_a_colour_of_its_own_and_a_small_scan_is_held_whole() -> None:
    solution = st.solve(st.Truss.from_grid(sheet(), section="CHS33.7x3.2", supports="boundary", loads="snow:50kN/m2"))
    page = encode_page(model_of(solution, report=report_structure(solution)), FileStyle())
    (used,) = (each for each in data_of(page)["colorings"] if each["name"] == "utilization")
    assert used["most"] == [1.0, OVERUSED_COLOUR]
    for count, said in ((60_000, []), (60_001, ["HTML holds no more than 60,000 points of the scan"])):
        cloud = PointCloud(np.zeros((count, 3)), np.zeros(3))
        assert losses(model_of(sheet(), cloud=cloud), "a.html") == said


def test_words_of_a_user_end_no_script() -> None:
    grid = sheet()
    lines = LineSet("</script><b>", FIXED_LINE, np.array([7, 8, 9]))
    text = page_of(grid.replace(lines=np.array([[7, 8], [8, 9]]), line_sets=(lines,))).decode()
    assert "</script><b>" not in text
    assert "</script><b>" in data_of(text.encode())["tables"]["members"][3]["values"]


def test_5000_members_with_a_whole_scan_are_below_5_mb() -> None:
    grid = sheet(42)
    rng = np.random.default_rng(1)
    cloud = PointCloud.from_array(grid.scan_nodes[0] + rng.uniform(0, 40, (200_000, 3)), unit="m")
    assert len(grid.edges) > 5000
    assert len(page_of(grid, cloud)) < 5_000_000


def test_a_browser_shows_the_page_and_tells_of_what_is_clicked(tmp_path: Path) -> None:
    place = tmp_path / "page.html"
    place.write_bytes(page_of(sheet()))
    with open_page(place.as_uri()) as (page, errors):
        page.wait_for_function(
            "() => { const c = document.getElementById('canvas'), g = c.getContext('webgl2'), p = new Uint8Array(4 * c.width * c.height);"
            " g.readPixels(0, 0, c.width, c.height, g.RGBA, g.UNSIGNED_BYTE, p);"
            " return new Set(new Uint32Array(p.buffer)).size > 20 }"  # not blank
        )
        page.fill("#mark", "m0007")
        assert "M0007" in page.inner_text("#row")
        page.uncheck("#show-nodes")
        page.uncheck("#show-pins")
        page.click("#canvas")
        assert re.match(r"(member|panel)\s+[MP]\d+", page.inner_text("#row"))
        page.focus("#canvas")
        page.keyboard.press("Escape")
        assert page.inner_text("#row").startswith("Click a node")
        assert errors == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_is_readable(scheme: str) -> None:
    """WCAG AA: contrast of 4.5 between text and what lies below it."""
    style = page_of(sheet()).decode().split("</style>")[0]
    chosen = style.partition("prefers-color-scheme: dark")[2 if scheme == "dark" else 0]
    colors = dict(re.findall(r"--(\w+): (#\w+)", chosen))

    def light(name: str) -> float:
        digits = colors[name][1:] if len(colors[name]) == 7 else "".join(2 * c for c in colors[name][1:])
        share = [int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4)]
        red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in share)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    for ink in ("ink", "soft", "warn"):
        for room in ("page", "room"):
            low, high = sorted((light(ink), light(room)))
            assert (high + 0.05) / (low + 0.05) >= 4.5, (ink, room)
