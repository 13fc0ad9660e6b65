"""The page that ``--report page.html`` writes: one file with view, tables, plots, certificate and settings."""

import json
import re
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from browser import open_page

from scantruss.cli.main import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a grid of a shallow dome and its structure, each with its page."""
    place = tmp_path_factory.mktemp("pages")
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 10, 50), np.linspace(0, 10, 50)))
    np.savetxt(place / "dome.xyz", np.stack([x, y, 2 - 0.04 * ((x - 5) ** 2 + (y - 5) ** 2)], axis=1))
    grid = f"grid {place}/dome.xyz {place}/dome.json --length 2 --unit m --effort quick --report {place}/page.html"
    assert main(grid.split()) == 0
    assert (
        main(f"structure {place}/dome.json {place}/s.json --supports boundary --report {place}/structure.html".split())
        == 0
    )
    return place


def test_the_page_has_what_the_run_found(folder: Path) -> None:
    text = unescape((folder / "page.html").read_text())
    grid = json.loads((folder / "dome.json").read_text())
    settings = json.loads((folder / "dome.settings.json").read_text())
    assert all(json.dumps(name) in text for name in settings if name != "made_by")
    assert f"{len(grid['nodes']):,} nodes" in text and "certificate" in text.lower()
    assert "scantruss grid" in text and "--settings" in text
    assert text.count("<img ") >= 4 and text.count("<table") >= 5 and "passed" in text
    assert not re.search(r"""(src|href)=["']?https?:""", text)


def test_a_browser_opens_both_from_disk(folder: Path) -> None:
    with open_page((folder / "page.html").as_uri()) as (page, errors):
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        for name in ("page.html", "structure.html"):
            page.goto((folder / name).as_uri())
            view = page.frame_locator("iframe")
            view.locator("#mark").fill("M0001")
            view.locator("#mark").press("Enter")
            view.locator("#coloring").wait_for()
            assert "M0001" in view.locator("#row").inner_text()
            assert page.locator("figure img").count() >= 1
        assert errors == [] and not [url for url in asked if url.startswith("http")]


def test_a_report_of_another_kind_is_refused_before_the_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(f"grid {folder}/dome.xyz {folder}/o.json --length 2 --report {folder}/page.pdf".split()) == 2
    assert ".html" in capsys.readouterr().err and not (folder / "o.json").exists()
