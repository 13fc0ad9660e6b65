"""Make docs/studio.gif and docs/studio/*.png by walking through the studio: python scripts/make_studio_pictures.py.

Needs the group test, the extra studio and a Chromium.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image

from scantruss.studio.browsers import Browsers
from scantruss.studio.opening import DATA_FOLDER, EXAMPLES, read_whole
from scantruss.studio.scan_parts import WholeScan
from scantruss.studio.server import serve_browsers, start_server
from scantruss.studio.session import Session
from scantruss.studio.tab_compare import NO_OTHER

DOCS = Path(__file__).resolve().parents[1] / "docs"
FLAGS = "--no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist".split()
PAGE_SIZE = {"width": 1280, "height": 720}
FRAME_SIZE = (800, 450)  # of the GIF [pixel]
GIF_COLORS, PNG_COLORS = 128, 256
PATIENCE = 120.0  # [s]
MOST_WAITS = 30  # for a drawing that changes


class Walk:
    """A page that is walked through, and what was seen of it."""

    def __init__(self, page: Any, session: Session) -> None:
        self.page, self.session = page, session
        self.frames: list[Image.Image] = []
        self.milliseconds: list[int] = []

    def see(self, milliseconds: int, name: str = "") -> None:
        """Take a picture for the GIF, and one of its own where it has a name."""
        picture = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
        self.frames.append(picture.resize(FRAME_SIZE, Image.Resampling.LANCZOS))
        self.milliseconds.append(milliseconds)
        if name:
            small = picture.resize((960, 540), Image.Resampling.LANCZOS)
            small.quantize(PNG_COLORS).save(DOCS / "studio" / f"{name}.png", optimize=True)

    def rest(self, milliseconds: int = 800) -> None:
        """Wait until nothing runs and the page has drawn it."""
        assert self.session.worker.wait(PATIENCE) and not self.session.message, self.session.message
        self.page.wait_for_timeout(milliseconds)

    def settle(self) -> None:
        """Wait until the drawing does not change any more, as when light comes up on a slow machine."""
        before = b""
        for _ in range(MOST_WAITS):
            if before == (before := self.page.screenshot()):
                return
            self.page.wait_for_timeout(2000)

    def tab(self, name: str) -> None:
        """Go to a step."""
        self.page.click(f"[role=tab]:has-text('{name}')")
        self.page.wait_for_timeout(300)

    def push(self, name: str) -> None:
        """Push a button."""
        self.page.locator(f"button:visible:has-text('{name}')").first.click()

    def field(self, label: str) -> Any:
        """Return the field with a label."""
        return self.page.locator(f"xpath=//label[normalize-space(.)='{label}']/following::input[1]").first

    def choose(self, label: str, value: str) -> None:
        """Choose of a list."""
        self.field(label).click()
        self.page.get_by_role("option", name=value, exact=True).first.click()

    def drag(self, begin: tuple[int, int], end: tuple[int, int]) -> None:
        """Drag over the drawing, and see it in between."""
        self.page.mouse.move(*begin)
        self.page.mouse.down()
        for share in (0.35, 0.7, 1.0):
            x, y = (a + share * (b - a) for a, b in zip(begin, end, strict=True))
            self.page.mouse.move(x, y, steps=3)
            self.page.wait_for_timeout(400)
            self.see(250)
        self.page.mouse.up()


def walk(tour: Walk) -> None:
    """Go from the scan to the files."""
    page, session = tour.page, tour.session
    page.wait_for_selector("text=Generate")
    page.wait_for_timeout(3000)
    page.evaluate("document.querySelectorAll('.mantine-Notifications-notification button').forEach((b) => b.click())")
    page.wait_for_timeout(800)
    tour.see(2200, "scan")
    tour.tab("Design")
    session.show_quick()
    tour.rest(2500)
    tour.see(1200)
    page.focus("[role=slider]:visible")
    for _ in range(4):  # the length slides
        for _ in range(4):
            page.keyboard.press("ArrowRight")
        tour.rest(1200)
        tour.see(500)
    tour.field("exactly").fill("1")
    page.wait_for_timeout(1000)
    tour.rest(1500)
    tour.see(900)
    page.click("text=Holes and ridges")
    tour.field("find and draw them").click()
    page.wait_for_selector("text=close hole 1")
    tour.rest(1200)
    tour.see(1200)
    tour.field("close hole 1").click()
    page.wait_for_timeout(500)
    tour.rest(1500)
    tour.see(1300)
    tour.field("close hole 1").click()
    page.wait_for_timeout(500)
    tour.rest(1500)
    tour.field("find and draw them").click()
    tour.tab("Constraints")
    tour.push("Place by clicks")
    page.wait_for_timeout(300)
    page.mouse.click(330, 440)
    page.wait_for_selector("text=undo: fixed node")
    tour.rest(1500)
    tour.see(1000)
    tour.drag((330, 440), (420, 425))
    page.wait_for_timeout(500)
    tour.rest(1500)
    tour.see(1000)
    tour.push("Generate")
    page.wait_for_selector("text=undo: generate", timeout=60_000)
    tour.tab("Grid")
    tour.rest(1500)
    tour.see(1500, "grid")
    tour.tab("Structure")
    tour.push("Run")
    page.wait_for_selector("text=mass without nodes", timeout=60_000)
    tour.rest(2000)
    tour.see(1800, "structure")
    tour.choose("shape under", "snow")
    tour.rest(2000)
    tour.see(1500)
    tour.choose("shape under", "as built")
    tour.tab("Grid")
    tour.field("as tubes and balls").click()
    tour.rest(4000)
    tour.settle()
    tour.see(1800, "daylight")
    tour.field("as tubes and balls").click()
    tour.tab("Compare")
    tour.push("Keep this design")
    page.wait_for_selector("text=the present one")
    tour.tab("Design")
    tour.field("exactly").fill("1.8")
    page.wait_for_timeout(1000)
    tour.rest(1500)
    tour.tab("Compare")
    tour.choose("beside", "A")
    tour.rest(3000)
    tour.see(2500, "compare")
    tour.tab("Out")
    tour.rest()
    tour.see(2500)


def walk_further(tour: Walk) -> None:
    """Make a grid of quads and a double layer, each for a picture of its own."""
    page = tour.page
    tour.tab("Compare")
    tour.choose("beside", NO_OTHER)
    tour.tab("Design")
    page.click("text=Holes and ridges")
    tour.field("exactly").fill("1.4")
    page.wait_for_timeout(1000)
    tour.choose("cells", "quad")
    tour.field("planar panels").click()
    tour.push("Generate")
    page.wait_for_selector("text=undo: generate", timeout=60_000)
    tour.tab("Grid")
    tour.choose("grid", "panels off their plane, over the mean diagonal")
    tour.tab("Design")
    tour.rest(2500)
    tour.settle()
    tour.see(0, "quads")
    tour.choose("cells", "triangle")
    tour.field("exactly").fill("2.2")
    tour.push("Generate")
    page.wait_for_timeout(1000)
    tour.rest(1500)
    tour.tab("Structure")
    page.click("text=Double layer and joints")
    page.wait_for_timeout(500)
    tour.field("depth").fill("1.2")
    tour.push("Run")
    page.wait_for_selector("text=/^web .* members of/", timeout=60_000)
    page.locator("xpath=//label[normalize-space(.)='loads']/following::input[1]").last.uncheck()
    page.mouse.move(1040, 500)
    page.mouse.wheel(0, -220)  # up to the fields again
    page.mouse.move(500, 690)
    tour.rest(2500)
    tour.settle()
    tour.see(0, "layers")


def main() -> None:
    """Walk and write."""
    from playwright.sync_api import sync_playwright

    (DOCS / "studio").mkdir(exist_ok=True)
    chromium = next(filter(None, map(shutil.which, ("chromium", "google-chrome"))))
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as started:
        session = Session(Path(folder) / "shell.scantruss")
        file, settings = EXAMPLES["shell"]
        whole = WholeScan(read_whole(DATA_FOLDER / file))
        session.change("open shell.ply", whole=whole, cloud=whole.cloud, settings=settings)
        server, _ = start_server("127.0.0.1", 0)
        serve_browsers(server, Browsers(session))
        browser = started.chromium.launch(executable_path=chromium, args=FLAGS)
        tour = Walk(browser.new_page(viewport=PAGE_SIZE), session)
        tour.page.goto(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=1")  # however slow the machine is
        walk(tour)
        walk_further(Walk(tour.page, session))
        browser.close()
        session.stop()
        server.stop()
    first, *others = [frame.quantize(GIF_COLORS, dither=Image.Dither.NONE) for frame in tour.frames]
    first.save(
        DOCS / "studio.gif", save_all=True, append_images=others, duration=tour.milliseconds, loop=0, optimize=True
    )


if __name__ == "__main__":
    main()
