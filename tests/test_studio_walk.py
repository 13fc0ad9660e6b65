"""What a person meets on a walk through the page of the studio: what stays in sight, what is kept as set, what is marked as old."""

import gc
import io
from itertools import count
from pathlib import Path
from threading import Event, Thread
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from browser import LARGE_WINDOW, PATIENCE, open_page
from PIL import Image
from studio_person import choose, click_corners, field, see, served_dome, tab, tick, until, until_drawn

from scantruss.grid.marks import node_marks
from scantruss.studio.browsers import Browsers
from scantruss.studio.server import serve_browsers, start_server


def ready(page: Any, session: Any) -> None:
    """Wait until nothing runs."""
    assert session.worker.wait(PATIENCE)
    see(page, "text=Generate")


def greens(page: Any) -> int:
    """Return how many pixels of the drawing have the colour of a support, in light or shade."""
    picture = Image.open(io.BytesIO(page.screenshot(clip={"x": 0, "y": 160, "width": 800, "height": 430})))
    red, green, blue = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(int).T
    return int(((green > 60) & (red < 0.4 * green) & (blue < 0.6 * green)).sum())


def say(page: Any, name: str, text: str) -> None:
    """Type into a field."""
    field(page, name).fill(text)


def test_what_is_refused_or_old_is_told_from_what_is(tmp_path: Path) -> None:
    with served_dome(tmp_path) as (address, session, _), open_page(address) as (page, errors):
        ready(page, session)
        tab(page, "Out")
        see(page, "text=this is the quick preview")
        assert "--effort quick" in page.inner_text("pre:visible")
        undo = page.locator("button:has-text('Undo')").first
        assert "takes back" in undo.get_attribute("title") and "ends what runs" not in undo.get_attribute("title")
        tab(page, "Design")
        page.click("text=Holes and ridges")
        tick(page, "find and draw them")
        see(page, "text=none found")
        assert field(page, "click to").input_value() == "switch hole or ridge"
        tab(page, "Structure")
        assert until(lambda: field(page, "click to").input_value() == "select"), "it ended with its tab"
        see(page, "text=this is the quick preview")
        assert until(lambda: greens(page) > 100), "supports are drawn before they are solved"
        say(page, "supports", "cornets")
        see(page, "text=did you mean corners?")
        assert until(lambda: greens(page) == 0)
        say(page, "supports", "corners")
        assert until(lambda: 0 < greens(page) < 1000)
        page.click("button:has-text('Generate')")
        see(page, "text=this is the quick preview", state="hidden")
        assert not session.state.is_live
        assert session.grid is not None
        first, last = node_marks(session.grid)[0], node_marks(session.grid)[-1]
        say(page, "supports", "fixed")
        page.click("button:has-text('Run')")
        see(page, "text=place some in Constraints")
        say(page, "supports", "boundary")  # corrected: nothing is refused any more
        see(page, ".studio-refused", state="detached")
        page.click("button:has-text('Run')")
        see(page, "text=lowest frequency")
        say(page, "supports", first)
        see(page, "text=before the last change, supports boundary")
        say(page, "supports", f"boundary+{last}")
        page.click("button:has-text('Run')")
        see(page, "text=before the last change", state="detached")
        page.click("text=Sizing and modes")
        say(page, "most sections", "2")
        see(page, "text=the section is chosen by sizing, at most 2")
        assert page.locator("text=Sizing and modes (sections chosen by sizing, at most 2)").count() == 1
        tab(page, "Design")
        say(page, "exactly", "60")
        see(page, "text=length 60 m is too large")
        assert field(page, "exactly").input_value() == "60" and session.settings.length != 60
        page.click("button:has-text('See all')")
        see(page, ".studio-refused", state="detached")
        assert until(lambda: field(page, "exactly").input_value() == f"{session.settings.length:g}")
        tab(page, "Scan")
        page.click("text=Crop")
        say(page, "crop", "box:1,2")
        page.locator("button:has-text('Crop')").last.click()
        see(page, ".studio-refused:has-text('crop must be')")
        say(page, "crop", "box:0,0,9,9")
        see(page, ".studio-refused", state="detached")
        assert errors == []


def test_progress_and_steps_stay_in_sight_and_draw_scan_as_set(tmp_path: Path) -> None:
    with served_dome(tmp_path) as (address, session, _), open_page(address) as (page, errors):
        ready(page, session)
        see(page, "text=ready")
        assert not field(page, "draw scan").is_checked()
        field(page, "draw scan").click()
        choose(page, "m", "cm")
        ready(page, session)
        page.wait_for_timeout(500)
        assert field(page, "draw scan").is_checked()
        assert until(lambda: session.settings.unit == "cm" and session.grid is not None)
        assert field(page, "draw scan").is_checked()
        tab(page, "Structure")
        page.click("text=Sizing and modes")
        viewport = page.locator(".mantine-ScrollArea-viewport").first
        places = []
        for down in (0, 400):
            viewport.evaluate(f"(each) => each.scrollTop = {down}")
            page.wait_for_timeout(300)
            boxes = [page.locator(each).first.bounding_box() for each in
                     (".studio-head", "[role=progressbar]", "button:has-text('Generate')", "button:has-text('Undo')")]  # fmt: skip
            places.append([box["y"] for box in boxes])
            assert all(box["y"] >= 0 and box["y"] + box["height"] <= 260 for box in boxes)
            assert all(np.diff(places[-1]) > 0)
        assert viewport.evaluate("(each) => each.scrollTop") > 100
        for name in ("Stop", "Undo"):
            page.locator(f"button:has-text('{name}')").first.click(trial=True)
        assert errors == []


def test_undo_drops_the_last_corner_of_a_polygon_and_one_that_crosses_itself_is_refused(tmp_path: Path) -> None:
    with served_dome(tmp_path) as (address, session, pages), open_page(address, LARGE_WINDOW) as (page, errors):
        ready(page, session)
        session.measure(((1.0, 1.0, 1.0), (2.0, 2.0, 1.0)))
        page.click("text=Crop")
        page.click("button:has-text('Polygon')")
        see(page, "input[value='corner of crop']")
        until_drawn(pages)
        click_corners(page, pages, (300, 250), (550, 250), (550, 500))
        assert until(lambda: field(page, "crop").input_value().count(",") == 5)
        page.mouse.click(420, 150)
        see(page, "text=the polygon would cross itself")
        assert field(page, "crop").input_value().count(",") == 5
        page.mouse.click(300, 500)
        assert until(lambda: field(page, "crop").input_value().count(",") == 7)
        page.keyboard.press("Control+z")
        assert until(lambda: field(page, "crop").input_value().count(",") == 5)
        assert session.state.tape and session.history.words[0] == "tape"  # which stays
        assert errors == []


def test_a_page_says_when_the_server_has_gone_and_goes_on_when_it_is_back(tmp_path: Path) -> None:
    with served_dome(tmp_path) as (address, session, pages), open_page(address) as (page, errors):
        ready(page, session)
        tab(page, "Design")
        with page.expect_response("**/alive"):
            pass
        assert page.locator("text=Connection lost").count() == 0
        pages.stop()
        see(page, "text=Connection lost")
        server, _ = start_server("127.0.0.1", int(urlsplit(address).port or 0))
        again = serve_browsers(server, Browsers(session))
        try:
            see(page, "text=Connection lost", state="detached")
            see(page, "text=dome.scantruss")
            tab(page, "Design")
            length = session.settings.length
            page.focus("[role=slider]:visible")
            page.keyboard.press("ArrowRight")
            assert until(lambda: session.settings.length > length)
        finally:
            again.stop()
        assert errors == []


def test_a_page_is_not_written_to_once_its_server_has_stopped(tmp_path: Path) -> None:
    """A slider that is set calls what listens to it, of which viser then waits for nothing on a server that is no more."""
    with served_dome(tmp_path) as (address, session, pages), open_page(address) as (page, errors):
        ready(page, session)
        length, ended = session.settings.length, Event()

        def change() -> None:
            for k in count():  # ends: with the test
                session.set_length(length * (1.0 + 0.001 * (k % 100)))
                if ended.is_set():
                    return

        changing = Thread(target=change)
        changing.start()
        page.wait_for_timeout(300)
        pages.stop()
        ended.set()
        changing.join()
        gc.collect()  # says what was never awaited
        assert errors == []
