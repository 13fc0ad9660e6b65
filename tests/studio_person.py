"""What a person does on the page of the studio, for tests that drive a browser: tabs, fields, lists, presses."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import PATIENCE

from scantruss.studio.browsers import Browsers
from scantruss.studio.server import serve_browsers, start_server
from scantruss.studio.session import Session

PORTS = range(
    20_000, 32_000
)  # none of those that a system gives to whoever connects, which would take one while its server is away


def free_port() -> int:
    """Return a port that nobody uses; processes look for theirs from different ones on."""
    for port in (PORTS[(97 * os.getpid() + k) % len(PORTS)] for k in range(len(PORTS))):
        with socket.socket() as trial, suppress(OSError):
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind(("127.0.0.1", port))
            return port
    raise RuntimeError("no port is free")


@contextmanager
def served_session(session: Session) -> Iterator[tuple[str, Any]]:
    """Serve a session; give the address of its page and the pages, which stop the server."""
    server, _ = start_server("127.0.0.1", free_port())
    pages = serve_browsers(server, Browsers(session))
    try:
        yield f"http://127.0.0.1:{server.get_port()}/", pages
    finally:
        session.stop()
        pages.stop()


def write_dome(folder: Path, rows: int = 60) -> Path:
    """Write the scan of a shallow dome, 10 by 10 and 2 high, with so many rows of as many points."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 10, rows), np.linspace(0, 10, rows)))
    np.savetxt(folder / "dome.xyz", np.stack([x, y, 2 - 0.04 * ((x - 5) ** 2 + (y - 5) ** 2)], axis=1))
    return folder / "dome.xyz"


@contextmanager
def served_dome(folder: Path) -> Iterator[tuple[str, Session, Any]]:
    """Serve a studio with a shallow dome in metres; give its address, its session and its pages."""
    pytest.importorskip("viser", reason="viser is not installed")
    session = Session(folder / "dome.scantruss")
    session.open(write_dome(folder))
    session.set_unit("m")
    with served_session(session) as (address, pages):
        yield address, session, pages


def until_drawn(pages: Any) -> None:
    """Wait until the page that was opened last has drawn all that the server has sent: it is asked for a picture, which comes after it."""
    _, view = list(pages._views.values())[-1]
    view.client.get_render(8, 8, timeout=PATIENCE)


def click_corners(page: Any, pages: Any, *places: tuple[float, float]) -> None:
    """Click the corners of a polygon on the page that was opened last, each once the one before has been taken."""
    _, view = list(pages._views.values())[-1]
    for count, place in enumerate(places, start=1):
        page.mouse.click(*place)
        assert until(lambda count=count: len(view.scan.crop._corners) == count)  # type: ignore[misc]


def until(holds: Callable[[], bool], seconds: float = PATIENCE) -> bool:
    """Wait until something holds; whether it does."""
    end = time.monotonic() + seconds
    while not holds() and time.monotonic() < end:  # ends: time passes
        time.sleep(0.05)
    return holds()


def see(page: Any, selector: str, state: str = "visible") -> None:
    """Wait until something is visible, hidden, attached or detached, looking more often than Playwright, which soon does twice a second."""
    found = page.locator(selector).first
    states = {
        "visible": found.is_visible,
        "hidden": found.is_hidden,
        "attached": lambda: found.count() > 0,
        "detached": lambda: found.count() == 0,
    }
    assert until(states[state]), f"{selector} is not {state}"


def tab(page: Any, name: str) -> None:
    """Go to a step."""
    page.click(f"[role=tab]:has-text('{name}')")
    see(page, f"[role=tab][aria-selected=true]:has-text('{name}')")


def field(page: Any, name: str) -> Any:
    """Return the text field, box or list with a label."""
    return page.locator(f"xpath=//label[normalize-space(.)='{name}']/following::input[1]").first


def tick(page: Any, name: str, wanted: bool = True) -> None:
    """Tick or untick a box; again, as a person would, where a press does nothing."""
    box = field(page, name)
    for _ in range(3):
        if box.is_checked() != wanted:
            box.click()
        if until(lambda: bool(box.is_checked()) == wanted, 2.0):
            return
    raise AssertionError(f"'{name}' stays as it was")


def choose(page: Any, old: str, new: str) -> None:
    """Choose something else in a drop-down list, as a person does."""
    page.locator(f"input[value='{old}']:visible").first.click()
    page.get_by_role("option", name=new, exact=True).first.click()


def drag(page: Any, begin: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag from one place of the page to another."""
    page.mouse.move(*begin)
    page.mouse.down()
    page.mouse.move(*end, steps=8)
    page.wait_for_timeout(400)
    page.mouse.up()
