"""No press of the studio is lost, however late the page, the server and what runs are.

Each test holds back what a loaded machine may hold back, at the worst moment.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from browser import LARGE_WINDOW, PATIENCE, open_page
from studio_dome import done, session_of_dome
from studio_person import field, see, served_dome, served_session, tab, until

from scantruss.grid.grid import Grid
from scantruss.layouts.on_scan import ScanOfGrid
from scantruss.layouts.trade import COUNTS_TRIED, traded_lengths
from scantruss.runtime.progress import Progress
from scantruss.studio import server, trade_steps
from scantruss.studio.head import words_of_session
from scantruss.studio.session import Session
from scantruss.studio.worker import StoppedError, Worker

LONG = (
    "what is refused at such length that it takes three lines or four of a panel that is no wider than this one, which "
    * 2
)
PRESS_TAKES = 300  #: from the pointer down to the pointer up [ms]


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[str, Session, Any]]:
    """Serve a studio with a shallow dome."""
    with served_dome(tmp_path) as given:
        yield given


def press_while(page: Any, selector: str, changes: Any) -> None:
    """Press the middle of a control, and change the page before the pointer comes up."""
    box = page.locator(selector).first.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    changes()
    page.wait_for_timeout(PRESS_TAKES)
    page.mouse.up()


def test_a_press_counts_though_a_run_begins_or_is_refused_meanwhile(served: tuple[str, Session, Any]) -> None:
    address, session, _ = served
    with open_page(address) as (page, errors):
        see(page, "text=Generate")
        assert session.worker.wait(PATIENCE)
        see(page, "text=ready")

        def say(stage: str, message: str) -> None:
            session.stage, session.share, session.message = stage, 0.5, message
            session.tell()

        before = page.locator("button:has-text('Generate')").bounding_box()
        for stage, message in (("front", ""), ("", LONG)):
            say(stage, message)
            page.wait_for_timeout(PRESS_TAKES)
            assert page.locator("button:has-text('Generate')").bounding_box() == before, (
                "nothing moves under the pointer"
            )
            say("", "")
            page.wait_for_timeout(PRESS_TAKES)
        press_while(page, "button:has-text('Generate')", lambda: say("front", ""))
        assert until(lambda: session.history.words[0] == "generate")
        assert errors == []


def test_a_press_means_the_control_that_it_began_on(served: tuple[str, Session, Any]) -> None:
    address, session, _ = served
    with open_page(address, LARGE_WINDOW) as (page, errors):
        see(page, "text=Generate")
        assert session.worker.wait(PATIENCE)
        see(page, "text=ready")
        page.evaluate(
            "window.generate = [...document.querySelectorAll('button')].find((e) => e.textContent === 'Generate')"
        )
        press_while(page, "button:has-text('Generate')", lambda: page.evaluate("generate.style.marginTop = '60px'"))
        assert until(lambda: session.history.words[0] == "generate") and session.worker.wait(PATIENCE)
        box = page.locator("button:has-text('Undo')").bounding_box()
        page.mouse.move(box["x"] + 20, box["y"] + 10)  # a press that is dragged off its control is taken back
        page.mouse.down()
        page.mouse.move(300, 500, steps=4)
        page.mouse.up()
        page.wait_for_timeout(PRESS_TAKES)
        assert session.history.words[0] == "generate"
        assert errors == []


def test_presses_that_come_at_once_all_count(served: tuple[str, Session, Any]) -> None:
    """A page that was busy takes what was pressed meanwhile at once; viser sends one message of a panel in 50 ms."""
    address, session, _ = served
    with open_page(address) as (page, errors):
        see(page, "text=Generate")
        assert session.worker.wait(PATIENCE)
        tab(page, "Grid")
        page.evaluate("""() => {
          const buttons = [...document.querySelectorAll("button")], named = (words) => buttons.find((e) => e.textContent === words);
          const boxes = [...document.querySelectorAll("input[type=checkbox]")].filter((e) => e.checkVisibility());
          boxes[0].click(); named("Generate").click(); boxes[1].click();
        }""")  # fmt: skip
        assert until(lambda: session.history.words[0] == "generate")
        assert not field(page, "draw members").is_checked() and not field(page, "draw panels").is_checked()
        assert session.worker.wait(PATIENCE)
        told = list[tuple[str, str]]()
        session.listen(lambda: told.append(session.history.words))
        page.evaluate("""() => {
          const buttons = [...document.querySelectorAll("button")], named = (words) => buttons.find((e) => e.textContent === words);
          named("Undo").click(); named("Redo").click(); named("Stop").click();
        }""")  # fmt: skip
        assert until(lambda: any(one[1] == other[0] == "generate" for one, other in pairwise(told)))  # back, and again
        assert session.history.words == ("generate", "")
        assert errors == []


def test_what_was_typed_counts_for_a_press_before_its_pause_is_over(
    served: tuple[str, Session, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scantruss.studio.typed_fields.TYPING_PAUSE", PATIENCE)
    address, session, _ = served
    with open_page(address) as (page, errors):
        see(page, "text=Generate")
        assert session.worker.wait(PATIENCE)
        tab(page, "Design")
        length = float(f"{1.3 * session.settings.length:.3g}")
        field(page, "exactly").fill(f"{length:g}")
        page.click("button:has-text('Generate')")
        assert until(lambda: session.history.words[0] == "generate")
        assert session.worker.wait(PATIENCE) and session.grid is not None and session.grid.settings is not None
        assert not session.state.is_live and session.grid.settings.length == session.settings.length == length
        assert errors == []


def test_what_the_server_writes_meanwhile_comes_between_no_characters(
    served: tuple[str, Session, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However late what is written comes: no pause of typing is over, and none before the next character is too long."""
    monkeypatch.setattr("scantruss.studio.typed_fields.TYPING_PAUSE", 2 * PATIENCE)
    patient = [tmp_path / script.name for script in server.PAGE_SCRIPTS]
    for script, copy in zip(server.PAGE_SCRIPTS, patient, strict=True):
        copy.write_text(re.sub(r"TYPES_ON = \d+", f"TYPES_ON = {2000 * PATIENCE:.0f}", script.read_text()))
    monkeypatch.setattr(server, "PAGE_SCRIPTS", tuple(patient))
    address, session, pages = served
    with open_page(address) as (page, errors):
        see(page, "text=Generate")
        assert session.worker.wait(PATIENCE)
        tab(page, "Design")
        length = field(page, "exactly")
        (_, view) = next(iter(pages._views.values()))

        heard = list[str]()

        async def hear(_: Any) -> None:
            heard.append(view.design.length.value)

        view.design.length.on_update(hear)

        def write(text: str) -> None:
            view.design.length.value = text
            view.client.flush()
            assert until(lambda: length.input_value() == text)

        def until_heard(text: str) -> None:
            """Wait for what was typed: viser does not send what was written before that comes."""
            assert until(lambda: heard[-1:] == [text])

        length.select_text()
        page.evaluate("new Promise((seen) => requestAnimationFrame(() => setTimeout(seen)))")  # the page has seen it
        write("3.3")
        page.keyboard.insert_text("1")
        until_heard("1")
        write("4.4")
        page.keyboard.type(".2")
        assert length.input_value() == "1.2"
        page.keyboard.press("ArrowLeft")
        page.keyboard.press("Backspace")
        assert length.input_value() == "12"
        page.keyboard.press("ControlOrMeta+a")
        page.evaluate("new Promise((seen) => requestAnimationFrame(() => setTimeout(seen)))")
        until_heard("12")
        write("5.5")
        page.keyboard.type("1.7")
        assert length.input_value() == "1.7"
        page.click("button:has-text('Generate')")
        assert until(lambda: session.history.words[0] == "generate") and session.worker.wait(PATIENCE)
        assert session.settings.length == 1.7 and length.input_value() == "1.7"
        assert errors == []


def test_a_number_of_the_curve_counts_while_the_trade_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    session = session_of_dome(tmp_path, 10.0)
    goes_on, found = Event(), traded_lengths

    def in_steps(before: Any, tolerance: float, counts: Any, *others: Any) -> Any:
        if counts[0] == COUNTS_TRIED[2]:
            goes_on.wait(PATIENCE)
        return found(before, tolerance, counts, *others)

    monkeypatch.setattr(trade_steps, "traded_lengths", in_steps)
    with served_session(session) as (address, _), open_page(address) as (page, errors):
        see(page, "text=Generate")
        tab(page, "Design")
        page.click("text=Few different parts")
        field(page, "tolerance").fill("20%")
        page.click("button:has-text('Find what fewer cost')")
        number = COUNTS_TRIED[1]
        see(page, f"svg [data-low='{number}'] rect", state="attached")
        page.click(f"svg [data-low='{number}'] rect")
        goes_on.set()  # another number of lengths comes while the number on the curve is being taken
        assert until(lambda: session.grid is not None and session.grid.alike is not None)
        assert session.worker.wait(PATIENCE) and session.grid is not None and session.grid.alike is not None
        assert session.grid.alike.count == number
        page.click("button:has-text('Undo')")
        assert until(lambda: session.grid is not None and session.grid.alike is None)
        page.click(f"svg [data-low='{number}'] rect")  # the same again
        assert until(lambda: session.grid is not None and session.grid.alike is not None)
        assert errors == []


def test_a_number_that_is_pressed_again_counts_though_its_run_was_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    session = session_of_dome(tmp_path, 10.0)
    session.find_trade("lengths", 0.2)
    done(session)
    certified, tried = ScanOfGrid.certified, Event()

    def stopped_first(scan: ScanOfGrid, grid: Grid) -> Grid:
        if tried.is_set():
            return certified(scan, grid)
        tried.set()
        raise StoppedError

    monkeypatch.setattr(ScanOfGrid, "certified", stopped_first)
    with served_session(session) as (address, _), open_page(address) as (page, errors):
        see(page, "text=Generate")
        tab(page, "Design")
        page.click("text=Few different parts")
        page.click("svg [data-low='5'] rect")
        assert until(tried.is_set) and session.worker.wait(PATIENCE)
        assert session.grid is not None and session.grid.alike is None
        page.wait_for_timeout(500)
        page.click("svg [data-low='5'] rect")
        assert until(lambda: session.grid is not None and session.grid.alike is not None)
        assert errors == []


def test_a_quick_task_is_taken_while_one_that_was_stopped_comes_to_its_end() -> None:
    begun, let, seen = Event(), Event(), list[str]()
    worker = Worker(lambda error: None, lambda stage, share: None)

    def long(progress: Progress) -> None:
        begun.set()
        let.wait(30.0)
        progress("on", 0.5)
        seen.append("long")

    assert worker.ask(long) and begun.wait(30.0)
    assert not worker.ask(lambda progress: seen.append("refused"), quick=True)
    worker.stop()
    assert worker.ask(lambda progress: seen.append("quick"), quick=True)
    let.set()
    assert worker.wait(30.0) and seen == ["quick"]


def test_stop_says_that_it_stops_and_that_it_has(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 10.0)
    begun, let = Event(), Event()

    def long(progress: Progress) -> None:
        progress("boundary", 0.5)
        begun.set()
        let.wait(30.0)
        progress("front", 0.5)

    session.worker.ask(long)
    assert begun.wait(30.0) and words_of_session(session) == "boundary"
    session.stop()
    assert words_of_session(session) == "stopping"
    let.set()
    assert session.worker.wait(30.0) and words_of_session(session).startswith("stopped")
    session.worker.ask(lambda progress: progress("boundary", 0.5))
    assert session.worker.wait(30.0) and not words_of_session(session).startswith("stopped")
    session.stop()
    assert not words_of_session(session).startswith("stop")


def test_quick_tasks_of_another_kind_do_not_replace_one_another(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 10.0)
    begun, let = Event(), Event()

    def first(progress: Progress) -> None:
        begun.set()
        let.wait(30.0)

    session.worker.ask(first, quick=True)
    assert begun.wait(30.0)
    session.set("length", length=2.0)
    session.show_features()  # while the quick grid still waits
    let.set()
    done(session)
    assert session.grid is not None and session.grid.settings is not None and session.grid.settings.length == 2.0


def test_what_is_set_to_what_it_is_leaves_the_grid(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 10.0)
    before = session.state
    session.set("length", length=before.settings.length)
    done(session)
    assert session.state is before
