"""A Chromium for tests that open pages, where one is installed: one for all tests of a process, with a fresh profile for each."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = """
--headless --no-sandbox --no-first-run --no-default-browser-check --remote-debugging-port=0 --disable-dev-shm-usage
--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist --webgl-antialiasing-mode=none
--disable-background-networking --disable-background-timer-throttling --disable-backgrounding-occluded-windows
--disable-renderer-backgrounding --disable-ipc-flooding-protection --disable-hang-monitor --disable-extensions
--disable-component-update --disable-breakpad --disable-sync --disable-popup-blocking --hide-scrollbars --mute-audio
--force-color-profile=srgb --password-store=basic about:blank
""".split()  # drawn by software
# of a window: drawn by software, the smaller the sooner; and of one whose drawing is looked at or clicked on [pixel]
WINDOW, LARGE_WINDOW = {"width": 700, "height": 420}, {"width": 1280, "height": 720}
PATIENCE = 120.0  # of a machine that is busy with other tests: until a browser is there, and of each thing that is waited for in it [s]


class Chromium:
    """A browser that listens on an address of its own, for Playwright to connect to."""

    def __init__(self, program: str) -> None:
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        words = [program, *FLAGS, f"--user-data-dir={self._profile.name}"]
        self._process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.address = self._found(Path(self._profile.name) / "DevToolsActivePort")

    def _found(self, said: Path) -> str:
        """Return the address, once the browser has said it: its port and a path."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:  # ends: time passes
            lines = said.read_text().split() if said.exists() else []
            if len(lines) == 2:
                return f"ws://127.0.0.1:{lines[0]}{lines[1]}"
            if self.has_ended:
                break
            time.sleep(0.02)
        self.close()
        raise RuntimeError("Chromium did not start")

    @property
    def has_ended(self) -> bool:
        """Whether it is no more, as after a crash."""
        return self._process.poll() is not None

    def close(self) -> None:
        """End the browser."""
        self._process.terminate()
        self._process.wait(PATIENCE)
        self._profile.cleanup()


@cache
def chromium() -> Chromium:
    """Return the browser of this process. Skip where none is installed."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip("no Chromium is installed")
    return Chromium(found)


def close_chromium() -> None:
    """End the browser of this process, if there is one."""
    if chromium.cache_info().currsize:
        chromium().close()
        chromium.cache_clear()


@contextmanager
def open_page(address: str, size: dict[str, int] = WINDOW) -> Iterator[tuple[Any, list[str]]]:
    """Open an address in a window of some size; give the page and a list to which its errors are added. Skip where there is no browser."""
    playwright = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    if chromium().has_ended:
        close_chromium()
    at = chromium().address
    with playwright.sync_playwright() as started:
        browser = started.chromium.connect_over_cdp(at)
        try:
            context = browser.new_context(viewport=size)
            context.set_default_timeout(1000 * PATIENCE)
            page = context.new_page()
            errors: list[str] = []
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.goto(address)
            yield page, errors
        finally:
            browser.close()  # with all that was opened here; the process goes on
