"""Times and frame rates of the studio beside an empty page of viser, in a headless Chromium: python -m benchmarks.studio.

Needs the groups test and the extra studio, a Chromium and Linux. Software rendering: figures of the two are compared, never taken alone;
times of the processor, of server and browser together, for others may use the machine.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import scantruss as st
from scantruss.pipeline import grid_from_cloud
from scantruss.studio.browsers import Browsers
from scantruss.studio.opening import DATA_FOLDER, read_whole
from scantruss.studio.server import serve_browsers, start_server
from scantruss.studio.session import Session

FLAGS = "--no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist".split()
COUNT = "() => { window.frames_seen = 0; const tick = () => { window.frames_seen++; requestAnimationFrame(tick); }; tick(); }"
DRAGGED = 6.0  #: how long the view is turned [s]


def wavy(count: int) -> np.ndarray:
    """Return about so many points of a wavy roof over 60 by 40."""
    side = int(np.sqrt(count / 1.5))
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 60, int(1.5 * side)), np.linspace(0, 40, side)))
    return np.stack([x, y, 4 * np.sin(x / 9) * np.cos(y / 11)], axis=1)


def serve(session: Session | None) -> tuple[str, Any]:
    """Serve a studio, or an empty page of viser."""
    server, _ = start_server("127.0.0.1", 0)
    if session is None:
        server.scene.world_axes.visible = True
    else:
        serve_browsers(server, Browsers(session))
    return f"http://127.0.0.1:{server.get_port()}/", server


def processor_seconds() -> float:
    """Return the seconds of the processor that this process and those it has started have taken."""
    parents, spent = dict[int, int](), dict[int, int]()
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = place.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        parents[int(place.parent.name)] = int(fields[1])
        spent[int(place.parent.name)] = sum(map(int, fields[11:15]))
    ours = {os.getpid()}
    while (
        more := {child for child, parent in parents.items() if parent in ours} - ours
    ):  # ends: processes are finitely many
        ours |= more
    return sum(spent.get(each, 0) for each in ours) / os.sysconf("SC_CLK_TCK")


def first_picture(browser: Any, address: str) -> float:
    """Return the seconds of the processor until the middle of a page is no longer of one colour."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    began, before = time.perf_counter(), processor_seconds()
    page.goto(address)
    while time.perf_counter() - began < 120:
        shot = page.screenshot(clip={"x": 330, "y": 200, "width": 400, "height": 380})
        if len(shot) > 1500:  # one colour compresses to less
            break
    spent = processor_seconds() - before
    page.close()
    return spent


def seconds_of_frame(browser: Any, address: str, wait: float) -> float:
    """Return the seconds of the processor for a frame while the view is turned."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.goto(address)
    page.wait_for_timeout(1000 * wait)
    page.evaluate(COUNT)
    page.mouse.move(400, 400)
    page.mouse.down()
    began, before, taken = time.perf_counter(), page.evaluate("window.frames_seen"), processor_seconds()
    while (spent := time.perf_counter() - began) < DRAGGED:
        page.mouse.move(400 + 100 * np.sin(3 * spent), 400 + 40 * np.cos(2 * spent))
    seconds = (processor_seconds() - taken) / max(page.evaluate("window.frames_seen") - before, 1)
    page.mouse.up()
    page.close()
    return float(seconds)


def seconds_of(work: Any, rounds: int = 3) -> float:
    """Return the least seconds that some work takes."""
    spent = []
    for _ in range(rounds):
        began = time.perf_counter()
        work()
        spent.append(time.perf_counter() - began)
    return min(spent)


def main() -> None:
    """Measure and print."""
    from playwright.sync_api import sync_playwright

    rows: list[tuple[str, float, float]] = []
    cloud = st.PointCloud.from_array(wavy(100_000), unit="m")
    settings = st.Settings(length=2.0, effort="quick", unit="m")
    session = Session()
    session.change("open", cloud=cloud, settings=settings)
    lengths = iter(np.linspace(1.9, 2.2, 40))

    def live() -> None:
        session.live(float(next(lengths)))
        session.worker.wait(600)

    live()
    rows.append(("live quick grid of 100,000 points / library call [s]", seconds_of(live),
                 seconds_of(lambda: grid_from_cloud(cloud, settings.replace(length=float(next(lengths)))))))  # fmt: skip

    def generate() -> None:
        session.change("length", settings=settings.replace(length=float(next(lengths)), effort="normal"))
        session.generate()
        session.worker.wait(600)

    rows.append(("Generate / library call [s]", seconds_of(generate, 2), seconds_of(
        lambda: grid_from_cloud(cloud, settings.replace(length=float(next(lengths)), effort="normal")), 2)))  # fmt: skip
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as started:
        browser = started.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
        empty, empty_server = serve(None)
        shell = Session(folder=Path(folder))
        shell.change("open", cloud=read_whole(DATA_FOLDER / "shell.ply"))
        page, server = serve(shell)
        first_picture(browser, empty)
        rows.append(("first picture of the bundled scan / empty page [s]",
                     min(first_picture(browser, page) for _ in range(3)),
                     min(first_picture(browser, empty) for _ in range(3))))  # fmt: skip
        server.stop()
        large = Session()
        many = st.PointCloud.from_array(wavy(1_000_000), unit="m")
        large.change("open", cloud=many, settings=settings.replace(length=0.9))
        large.show_quick()
        large.worker.wait(600)
        assert large.grid is not None, large.message
        print(f"{len(many.points):,} points, {len(large.grid.edges):,} members", flush=True)
        page, server = serve(large)
        frames = [(seconds_of_frame(browser, page, 15.0), seconds_of_frame(browser, empty, 5.0)) for _ in range(2)]
        rows.append(
            ("a frame of 10,000 members / of an empty page [s]", min(f[0] for f in frames), min(f[1] for f in frames))
        )
        server.stop()
        empty_server.stop()
        browser.close()
    for words, ours, theirs in rows:
        print(f"{words}: {ours:.3g} / {theirs:.3g} = {ours / theirs:.2f}")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
