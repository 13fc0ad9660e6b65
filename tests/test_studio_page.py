"""The studio as it is served: who is refused, and what a person sees in a browser."""

import io
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import openpyxl
import pytest
import trimesh
from browser import LARGE_WINDOW, PATIENCE, WINDOW, open_page
from PIL import Image
from studio_person import (
    choose,
    click_corners,
    drag,
    field,
    free_port,
    see,
    served_dome,
    tab,
    tick,
    until,
    until_drawn,
    write_dome,
)

import scantruss as st
from scantruss.cli.main import main
from scantruss.studio.colours import colors_of
from scantruss.studio.scan_steps import LARGEST_UPLOAD, TOO_LARGE
from scantruss.studio.server import PAGE_SCRIPTS, Guard, address_to_open, start_server
from scantruss.studio.session import Session
from scantruss.studio.tab_out import words_of_suffix


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[str, Session, Any]]:
    """Serve a studio with a shallow dome."""
    with served_dome(tmp_path) as given:
        yield given


def status(address: str, **head: str) -> int:
    """Return the status that a request gets."""
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=head), timeout=PATIENCE) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        error.close()
        return error.code


def test_only_our_own_page_is_served(served: tuple[str, Session, Any]) -> None:
    address, *_ = served
    assert status(address) == 200
    assert status(address, Origin="http://example.org") == 403
    assert status(address, Host="example.org") == 403
    assert status(address + "../../../../etc/passwd") == 404
    with urllib.request.urlopen(address, timeout=PATIENCE) as answer:
        assert answer.headers["X-Frame-Options"] == "DENY"  # no other page shows it within itself
        page = answer.read()
        assert int(answer.headers["Content-Length"]) == len(page)
        assert all(each.read_bytes() in page for each in PAGE_SCRIPTS)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ({"Host": "127.0.0.1:80"}, ""),
        ({"Host": "localhost:80", "Origin": "http://localhost:80", "Upgrade": "websocket"}, ""),
        ({"Host": "localhost:80", "Origin": "http://localhost:81", "Upgrade": "websocket"}, "other sites"),
        ({"Host": "localhost:80", "Origin": "null", "Upgrade": "websocket"}, "other sites"),
        ({"Host": "localhost:80", "Upgrade": "websocket"}, "where it comes from"),
        ({"Host": "evil.example:80"}, "machine it runs on"),
    ],
)
def test_the_guard_of_this_machine(head: dict[str, str], words: str) -> None:
    refused = Guard("127.0.0.1").refusal("/", head)
    assert words in refused if words else refused == ""


def test_beyond_this_machine_a_token_is_asked_for() -> None:
    guard = Guard("0.0.0.0")
    head = {"Host": "office:80"}
    assert "token" in guard.refusal("/", head) and "token" in guard.refusal("/?token=no", head)
    assert guard.refusal(f"/?token={guard.token}", head) == ""
    assert guard.refusal("/", head | {"Cookie": f"scantruss_studio={guard.token}"}) == ""
    assert "other sites" in guard.refusal(f"/?token={guard.token}", head | {"Origin": "http://evil.example"})
    assert len(guard.token) > 20 and Guard("0.0.0.0").token != guard.token


def test_the_address_that_is_printed_can_be_opened() -> None:
    assert address_to_open("127.0.0.1", 80, "") == "http://localhost:80/"
    assert address_to_open("office", 80, "abc") == "http://office:80/?token=abc"
    assert address_to_open("fd00::1", 80, "abc") == "http://[fd00::1]:80/?token=abc"
    for everywhere in ("0.0.0.0", "::"):
        assert f"//{everywhere}:" not in (given := address_to_open(everywhere, 80, "abc")) and "[::]" not in given
        assert urlsplit(given).hostname and given.endswith(":80/?token=abc")


def test_a_port_that_is_taken_is_refused() -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(st.InputError, match="choose another with --port"):
            start_server("127.0.0.1", other.getsockname()[1])


def test_without_viser_the_command_names_the_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("scantruss.studio.server.find_spec", lambda name: None)
    assert main(["studio", "--no-open"]) == 2
    assert "uv sync --extra studio" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("studio none.ply --no-open", "there is no file none.ply"),
        ("studio a.xyz --no-open", "a.scantruss exists already"),
        ("studio a.xyz --project b.zip --no-open", "use one of .scantruss"),
        ("studio --port 99999 --no-open", "--port needs a number"),
    ],
)
def test_what_cannot_be_opened_is_one_line(
    words: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    monkeypatch.chdir(tmp_path)
    Path("a.xyz").write_text("0 0 0\n")
    Path("a.scantruss").write_text("somebody's")
    assert main(words.split()) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1
    assert Path("a.scantruss").read_text() == "somebody's"


def test_colours_span_the_values() -> None:
    values = np.array([1.0, np.nan, 3.0])
    colors, low, high = colors_of(values, None)
    assert (low, high) == (1.0, 3.0) and len(np.unique(colors, axis=0)) == 3
    assert colors_of(values, 1.5)[1:] == (0.0, 3.0)


def shown_colors(page: Any) -> np.ndarray:
    """Return the pixels (N, 3) of the drawing."""
    picture = Image.open(io.BytesIO(page.screenshot(clip={"x": 0, "y": 160, "width": 880, "height": 550})))
    return np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(int)


def is_orange(pixels: np.ndarray) -> np.ndarray:
    """Return which pixels (N, 3) have the colour of a fixed node, in light or shade (N,)."""
    red, green, blue = pixels.T
    found: np.ndarray = (red > 150) & (green > 0.3 * red) & (green < 0.62 * red) & (blue < 0.25 * red)
    return found


def downloaded(page: Any, kind: str, old: str, suffix: str, folder: Path) -> Path:
    """Download a grid or a structure in a format."""
    choose(page, words_of_suffix(old), words_of_suffix(suffix))
    with page.expect_download() as download:
        page.click(f"button:has-text('Download the {kind}')")
    download.value.save_as(folder / f"{kind}{suffix}")
    return folder / f"{kind}{suffix}"


FAINT = """() => {  // what is written with less contrast than 4.5 to 1 (WCAG 2.1, 1.4.3), and edges of controls with less than 3 (1.4.11)
  const light = (c) => { const f = c.map((v) => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    return 0.2126 * f[0] + 0.7152 * f[1] + 0.0722 * f[2]; };
  const parts = (s) => { const m = s.match(/[\\d.]+/g).map(Number); return m.length > 3 ? m : [...m, 1]; };
  const behind = (e) => { for (let p = e; p; p = p.parentElement) {
    const b = parts(getComputedStyle(p).backgroundColor); if (b[3] > 0.9) return b; } return [255, 255, 255]; };
  const contrast = (...pair) => { const [a, b] = pair.map((c) => light(c.slice(0, 3)) + 0.05); return Math.max(a, b) / Math.min(a, b); };
  return [...document.querySelectorAll("body *")].filter((e) => {
    if (!e.getClientRects().length || e.tagName === "STYLE") return false;
    const style = getComputedStyle(e), isInput = e.tagName === "INPUT";
    const around = isInput ? behind(e.parentElement) : null;
    const edges = [style.borderColor, style.backgroundColor].map(parts);
    if (isInput && Math.max(...edges.map((edge) => contrast(edge, around))) < 3) return true;
    const says = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()) || (isInput && e.type === "text" && e.value);
    return says && contrast(parts(style.color), behind(e)) < 4.5;
  }).map((e) => `${e.className} ${e.textContent || e.value}`);
}"""


def test_a_person_makes_a_grid_and_a_structure(served: tuple[str, Session, Any], tmp_path: Path) -> None:
    address, session, pages = served
    with open_page(address, LARGE_WINDOW) as (page, errors):
        asked: list[Any] = []
        page.on("request", lambda request: asked.append(request.url))
        see(page, "text=Generate")
        page.click("text=Crop >> nth=0")
        field(page, "crop").fill("box:0,0,9,10")
        page.get_by_role("button", name="Crop", exact=True).last.click()
        see(page, "text=of 3,600 points")
        tab(page, "Design")
        page.focus("[role=slider]:visible")
        page.keyboard.press("ArrowRight")
        see(page, "text=(quick preview)")
        slid = f"{session.settings.length:g}"
        assert until(lambda: field(page, "exactly").input_value() == slid)
        length = float(f"{1.1 * session.settings.length:.3g}")
        field(page, "exactly").fill(f"{length:g}")
        page.click("button:has-text('Generate')")  # at once
        see(page, "text=undo: generate")
        see(page, "text=(quick preview)", state="detached")
        assert session.grid is not None and session.grid.settings is not None
        assert session.settings.length == session.grid.settings.length == length
        see(page, "text=certificate: passed")
        assert page.evaluate(FAINT) == []
        tab(page, "Grid")
        bars = page.locator("[data-field=between]")
        ends = [bars.nth(k).bounding_box() for k in (6, 17)]  # brushed from one to the other
        drag(page, *((box["x"] + 2, box["y"] + 20) for box in ends))
        assert until(lambda: "," in field(page, "between").input_value())
        low, high = map(float, field(page, "between").input_value().split(","))
        inside = ((session.grid.lengths >= low - 1e-5) & (session.grid.lengths <= high + 1e-5)).sum()
        see(page, f"text={inside} of {len(session.grid.edges)} members")
        tab(page, "Design")
        page.click("text=Few different parts")
        field(page, "tolerance").fill("20%")
        page.click("button:has-text('Find what fewer cost')")
        page.click("svg [data-low='5'] rect")
        see(page, "text=undo: 5 lengths")
        assert session.worker.wait(PATIENCE) and session.grid.alike is not None and session.grid.alike.count == 5
        page.click("button:has-text('Undo')")
        tab(page, "Constraints")
        page.click("button:has-text('Place by clicks')")
        see(page, "input[value='place fixed node']")
        page.mouse.click(410, 350)
        see(page, "text=undo: fixed node")
        assert session.worker.wait(PATIENCE) and len(session.settings.fixed) == 1
        (place,) = session.settings.fixed
        assert abs(place[2] - (2 - 0.04 * ((place[0] - 5) ** 2 + (place[1] - 5) ** 2))) < 1e-6  # it lies on the scan
        assert session.grid is not None and session.grid.fixed.sum() == 1
        until_drawn(pages)
        drag(page, (410, 350), (460, 330))
        assert until(lambda: session.settings.fixed != (place,)) and session.worker.wait(PATIENCE)
        (moved,) = session.settings.fixed
        assert abs(moved[2] - (2 - 0.04 * ((moved[0] - 5) ** 2 + (moved[1] - 5) ** 2))) < 1e-6
        for _ in range(2):
            page.locator("body").press("Control+z")
        see(page, "text=redo: fixed node")
        assert until(lambda: session.settings.fixed == ())
        tab(page, "Design")
        page.click("text=Length brush")
        page.click("button:has-text('Paint')")
        see(page, "input[value='paint length']")
        until_drawn(pages)
        drag(page, (400, 380), (470, 360))
        see(page, "text=undo: paint")
        assert len({row[3] for row in session.settings.length_field}) == 2
        page.click("button:has-text('Undo')")
        see(page, "text=redo: paint")
        tab(page, "Constraints")
        page.click("button:has-text('Draw by clicks')")
        see(page, "input[value='draw line']")
        for x in (360, 460):
            page.mouse.click(x, 380)
            page.wait_for_timeout(300)
        page.click("button:has-text('Finish')")
        see(page, "text=undo: fixed line")
        assert session.worker.wait(PATIENCE) and session.grid.line_sets[0].name == "line 1"
        choose(page, "draw line", "select")
        page.mouse.click(410, 370)
        see(page, "text=/(node|member|panel) [NMP]\\d+/")
        tab(page, "Structure")
        field(page, "supports").hover()
        hint = page.wait_for_selector("[role=tooltip]").bounding_box()  # beside the panel: it covers no control
        assert hint["x"] + hint["width"] <= page.locator(".studio-head").bounding_box()["x"]
        field(page, "section").fill("none such")
        page.click("button:has-text('Run')")
        see(page, "[role=alert]:has-text('none such')")  # on the drawing too: the panel may have been scrolled
        field(page, "section").fill("CHS114.3x5")
        page.click("button:has-text('Run')")
        see(page, "text=mass without nodes")
        assert session.worker.wait(PATIENCE) and session.solution is not None
        tab(page, "Grid")
        choose(page, "utilization", "member length")
        assert len(np.unique(shown_colors(page), axis=0)) > 50  # something is drawn
        field(page, "dark page").click()
        see(page, "[data-mantine-color-scheme=dark]", state="attached")
        assert page.evaluate(FAINT) == []
        tab(page, "Compare")
        page.click("button:has-text('Keep this design')")
        see(page, "text=the present one")
        page.set_viewport_size({"width": 1024, "height": 768})  # a tablet
        tab(page, "Out")
        read = trimesh.load(downloaded(page, "grid", ".json", ".obj", tmp_path), process=False)
        assert np.allclose(read.vertices, session.grid.scan_nodes, atol=1e-6)
        assert len(read.faces) == len(session.grid.triangles) and len(read.edges_unique) == len(session.grid.edges)
        saf = downloaded(page, "structure", ".json", ".saf.xlsx", tmp_path)
        rows = openpyxl.load_workbook(saf, read_only=True)["StructuralCurveMember"].max_row
        assert rows == len(session.grid.edges) + 1
        ifc = downloaded(page, "structure", ".saf.xlsx", ".ifc", tmp_path).read_text()
        assert ifc.startswith("ISO-10303-21") and ifc.count("=IFCMEMBER(") == len(session.grid.edges)
        assert not [url for url in asked if not url.startswith((address, "data:", "blob:"))]
        assert errors == []


class Served:
    """A studio in a process of its own, which can be killed and begun again."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._port = folder, free_port()
        self._process: subprocess.Popen[str] | None = None
        self.address = f"http://127.0.0.1:{self._port}/"

    def begin(self, source: str) -> None:
        """Serve a scan or a project."""
        command = [sys.executable, "-m", "scantruss", "studio", source, "--port", str(self._port), "--no-open"]
        self._process = subprocess.Popen(command, cwd=self._folder, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None and "studio at" in self._process.stdout.readline()

    def kill(self) -> None:
        """Kill the server at once, whatever it is at."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate(timeout=PATIENCE)


@pytest.fixture
def killable(tmp_path: Path) -> Iterator[Served]:
    """Give a studio of a shallow dome that has not begun."""
    pytest.importorskip("viser", reason="viser is not installed")
    write_dome(tmp_path)
    server = Served(tmp_path)
    try:
        yield server
    finally:
        server.kill()


def test_a_server_that_is_killed_loses_nothing_but_what_it_was_at(killable: Served, tmp_path: Path) -> None:
    write_dome(tmp_path, 90)
    killable.begin("dome.xyz")
    with open_page(killable.address) as (page, _):
        see(page, "text=Generate")
        choose(page, "not known", "m")
        tab(page, "Design")
        field(page, "exactly").fill("0.5")  # many members, whose sizing takes a while
        page.click("button:has-text('Generate')")
        see(page, "text=undo: generate")
        said = page.inner_text("p:has-text('members')").partition("\n")[0]
        killable.kill()
        killable.begin("dome.scantruss")  # the page, which lost it, goes on by itself
        see(page, "text=undo: generate", state="detached")
        tab(page, "Design")
        see(page, f"text={said.strip()}")
        tab(page, "Structure")
        page.click("button:has-text('Run')")
        see(page, "text=undo: run")
        figures = page.inner_text("p:has-text('mass without nodes')")
        page.click("text=Sizing and modes")
        page.wait_for_timeout(500)  # until it has opened
        field(page, "section").fill("CHS139.7x5")
        field(page, "most sections").fill("6")
        page.click("button:has-text('Run')")
        see(page, "[role=status]:has-text('weight curve')")
        killable.kill()
        assert not list(tmp_path.glob("*.tmp*")), "nothing half written is left"
        killable.begin("dome.scantruss")
        see(page, "text=The structure was solved before the last change")
        tab(page, "Design")
        see(page, f"text={said.strip()}")
        tab(page, "Structure")
        assert page.inner_text("p:has-text('mass without nodes')") == figures
        page.click("text=Sizing and modes")
        assert (field(page, "section").input_value(), field(page, "most sections").input_value()) == ("CHS139.7x5", "6")
        field(page, "most sections").fill("0")
        page.click("button:has-text('Run')")
        see(page, "text=undo: run")
        see(page, "[role=status]:has-text('ready')")


def test_the_time_of_what_runs_goes_on_while_the_server_says_nothing(served: tuple[str, Session, Any]) -> None:
    address, session, _ = served
    with open_page(address) as (page, errors):
        see(page, "text=Generate")
        assert session.worker.wait(PATIENCE)
        session.worker._progress("optimize", 0.5)  # the last that is heard
        seconds = "Number(/optimize (\\d+) s/.exec(document.querySelector('[role=status]').textContent)?.[1] ?? 0)"
        page.wait_for_function(f"{seconds} >= 2")
        first = page.evaluate(seconds)
        page.wait_for_function(f"{seconds} > {first}")  # a busy page may skip a second
        session.worker._tell(None)
        see(page, "[role=status]:has-text('ready')")
        assert errors == []


def test_a_click_on_what_is_said_on_the_drawing_reaches_the_drawing(served: tuple[str, Session, Any]) -> None:
    address, session, pages = served
    with open_page(address, LARGE_WINDOW) as (page, errors):
        see(page, "text=Generate")
        assert session.worker.wait(PATIENCE)
        page.click("text=Crop >> nth=0")
        page.click("button:has-text('Polygon')")
        said = page.locator("[role=alert]:has-text('click the corners')")
        said.element_handle().wait_for_element_state("stable")
        until_drawn(pages)
        box = said.bounding_box()
        covered = (box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        click_corners(page, pages, (500, 300), (400, 500), covered)
        assert until(lambda: len(field(page, "crop").input_value().split(",")) == 6), "three corners of two coordinates"
        assert errors == []


def test_a_file_that_is_too_large_is_not_sent(served: tuple[str, Session, Any], tmp_path: Path) -> None:
    address, session, _ = served
    for name, rows in (("large.xyz", 900), ("small.xyz", 400)):
        np.savetxt(tmp_path / name, np.stack([*np.divmod(np.arange(rows), 20), np.zeros(rows)], axis=1), "%.1f")
    with open_page(address) as (page, errors):
        see(page, "text=Generate")
        words = page.locator("[data-largest]")
        assert words.get_attribute("data-largest") == str(LARGEST_UPLOAD) and not words.is_visible()
        page.evaluate("document.querySelector('[data-largest]').dataset.largest = 10000")
        page.set_input_files("input[type=file]", tmp_path / "large.xyz")
        see(page, f"text={TOO_LARGE}")
        page.set_input_files("input[type=file]", tmp_path / "small.xyz")
        see(page, "text=400 points")
        assert not words.is_visible() and session.history.words[0] == "open small.xyz"
        assert errors == []


UNREACHED = """() => {  // controls that are seen and that the Tab key has not been on, or on which nothing showed that it was
  const all = `button:not([tabindex='-1']), input, [role=slider], [role=tab], canvas[data-engine],
    [data-with-border] > .mantine-Paper-root:first-child`;
  return [...document.querySelectorAll(all)].filter((e) => e.checkVisibility() && !e.disabled && !seen.has(e))
    .map((e) => e.getAttribute("aria-label") || e.textContent || e.outerHTML.slice(0, 150));
}"""
NOTE_FOCUS = """() => {
  const e = document.activeElement, style = getComputedStyle(e);
  const isNamed = e.getAttribute("aria-label") || e.labels?.length || e.textContent.trim();
  if (isNamed && style.outlineStyle === "solid" && parseFloat(style.outlineWidth) >= 2) seen.add(e);
  return e === document.body;
}"""


def test_keys_alone_reach_everything(served: tuple[str, Session, Any]) -> None:
    address, session, _ = served
    with open_page(address, LARGE_WINDOW) as (page, errors):
        see(page, "text=Generate")
        assert session.worker.wait(PATIENCE)
        page.evaluate("() => { window.seen = new Set(); }")
        for name in ("Scan", "Design", "Constraints", "Grid", "Compare", "Structure", "Out"):
            page.focus(f"[role=tab]:has-text('{name}')")
            page.keyboard.press("Enter")
            for head in page.locator("[data-with-border] > [aria-expanded=false]:visible").all()[::-1]:
                head.focus()
                page.keyboard.press("Enter")
            assert until(lambda: page.locator("[data-with-border] > [aria-expanded=false]:visible").count() == 0)
            for _ in range(600):  # from where it is to the end, and all around
                page.keyboard.press("Tab")
                if page.evaluate(NOTE_FOCUS) and not page.evaluate(UNREACHED):
                    break
            assert page.evaluate(UNREACHED) == [], name
        tab(page, "Constraints")
        page.focus("button:has-text('Place by clicks')")
        page.keyboard.press("Enter")
        see(page, "input[value='place fixed node']")
        while (
            page.evaluate("document.activeElement.tagName") != "CANVAS"
        ):  # ends: it is in the ring that Tab goes around, as was seen
            page.keyboard.press("Shift+Tab")
        page.keyboard.press("Enter")  # the cross begins in the middle of the drawing, where the dome is
        assert until(lambda: len(session.settings.fixed) == 1) and session.worker.wait(PATIENCE)
        (place,) = session.settings.fixed
        assert until(lambda: bool(is_orange(shown_colors(page)).sum() > 10))  # its ball is drawn
        page.keyboard.press(" ")
        for _ in range(5):
            page.keyboard.press("ArrowRight")
            page.wait_for_timeout(50)
        page.keyboard.press(" ")
        assert until(lambda: session.settings.fixed != (place,))
        assert len(session.settings.fixed) == 1 and session.settings.fixed[0][0] > place[0]
        assert errors == []


def test_what_goes_is_shown_within_the_scan(served: tuple[str, Session, Any]) -> None:
    address, session, _ = served
    with open_page(address, LARGE_WINDOW) as (page, errors):
        see(page, "text=Generate")
        assert until(lambda: session.grid is not None) and session.worker.wait(PATIENCE)
        tab(page, "Grid")
        for name in ("draw members", "draw panels"):
            tick(page, name, False)

        def drawn() -> int:
            return int((shown_colors(page) != 255).any(axis=1).sum())

        tab(page, "Scan")
        assert not field(page, "draw scan").is_checked() and until(lambda: drawn() < 60_000)
        empty = drawn()  # but for the legend and what the browser says
        page.click("text=Clean >> nth=0")
        page.click("button:has-text('Show what goes')")
        see(page, "text=of 3,600 points go")
        assert field(page, "draw scan").is_checked() and until(lambda: drawn() > empty + 2000)
        assert errors == []


def test_a_tap_is_a_click(served: tuple[str, Session, Any]) -> None:
    address, _, pages = served
    with open_page(address) as (page, errors):
        tablet = page.context.browser.new_context(viewport={"width": 1024, "height": 768}, has_touch=True).new_page()
        tablet.set_default_timeout(1000 * PATIENCE)
        page.close()
        tablet.goto(address)
        see(tablet, "text=Generate")
        tablet.tap("[role=tab]:has-text('Constraints')")
        tablet.tap("button:has-text('Place by clicks')")
        see(tablet, "input[value='place fixed node']")
        until_drawn(pages)
        tablet.touchscreen.tap(284, 384)  # the middle of the drawing, where the dome is
        see(tablet, "text=undo: fixed node")
        assert errors == []


def test_two_browsers_have_a_project_each(served: tuple[str, Session, Any]) -> None:
    address, session, _ = served
    with open_page(address) as (page, errors):
        see(page, "text=dome.scantruss")
        other = page.context.browser.new_page(viewport=WINDOW)
        other.set_default_timeout(1000 * PATIENCE)
        other.goto(address)
        see(other, "text=dome-2.scantruss")
        assert session.worker.wait(PATIENCE)
        before, grid = session.settings, session.grid
        tab(other, "Design")
        other.focus("[role=slider]:visible")
        other.keyboard.press("ArrowRight")
        see(other, "text=(quick preview)")
        assert session.settings is before and session.grid is grid
        page.reload()
        see(page, "text=dome.scantruss")
        assert errors == []
