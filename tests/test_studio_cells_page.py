"""Quads and a double layer on the page of the studio, in a browser: what is drawn, what a click finds, what is downloaded."""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from browser import LARGE_WINDOW, PATIENCE, open_page
from PIL import Image
from studio_person import choose, field, see, served_dome, tab, tick, until


def drawn(page: Any) -> int:
    """Return how many pixels of the drawing members cover, away from what is said on it."""
    picture = Image.open(io.BytesIO(page.screenshot(clip={"x": 300, "y": 160, "width": 500, "height": 550})))
    return int((np.asarray(picture.convert("RGB")) < 200).any(axis=2).sum())


def at_rest(page: Any) -> int:
    """Return how many pixels are drawn once two pictures after each other have as many."""
    counts = [0, -1]

    def is_at_rest() -> bool:
        page.wait_for_timeout(700)
        counts[:] = [counts[1], drawn(page)]
        return counts[0] == counts[1]

    assert until(is_at_rest)
    return counts[1]


def saved(page: Any, button: str, place: Path) -> Path:
    """Download a file by the button that says so."""
    with page.expect_download() as download:
        page.click(f"button:has-text('{button}')")
    download.value.save_as(place)
    return place


def test_a_person_makes_quads_and_a_double_layer(tmp_path: Path) -> None:
    with served_dome(tmp_path) as (address, session, _), open_page(address, LARGE_WINDOW) as (page, errors):
        see(page, "text=Generate")
        tab(page, "Grid")
        tick(page, "draw panels", False)
        see(page, "text=undo: unit", state="attached")
        assert until(lambda: session.grid is not None) and session.worker.wait(PATIENCE)
        with_diagonals = at_rest(page)
        tab(page, "Design")
        choose(page, "triangle", "quad")
        see(page, "text=/ quads .quick preview/")
        tick(page, "planar panels")
        page.click("button:has-text('Generate')")
        see(page, "text=undo: generate")
        see(page, "text=/, off plane 0[.]/")
        grid = session.grid
        assert grid is not None and grid.cells == "quad" and grid.settings is not None and grid.settings.planar
        assert until(lambda: 0 < drawn(page) < 0.85 * with_diagonals)  # two of three rows of members are left
        tab(page, "Grid")
        tick(page, "draw panels")
        page.mouse.click(410, 370)
        see(page, "text=/(node|member|panel) [NMP]\\d+/")
        tab(page, "Out")
        read = json.loads(saved(page, "Download the grid", tmp_path / "grid.json").read_text())
        assert len(read["panels"]) == len(grid.panel_table) and {len(panel) for panel in read["panels"]} == {4}
        tab(page, "Structure")
        page.click("button:has-text('Run')")
        see(page, "text=mass without nodes")
        field(page, "loads").fill("self")
        single = at_rest(page)
        page.click("text=Double layer and joints")
        field(page, "depth").fill("70")
        page.click("button:has-text('Run')")
        see(page, "[role=alert]:has-text('too much where the grid bends')")
        field(page, "depth").fill("0.8")
        page.click("button:has-text('Run')")
        see(page, "text=/^web .* members of/")
        assert session.solution is not None and len(session.solution.truss.members) > 3 * len(grid.edges)
        assert until(lambda: drawn(page) > 1.1 * single)
        tab(page, "Out")
        read = json.loads(saved(page, "Download the structure", tmp_path / "structure.json").read_text())
        assert len(read["members"]) == len(session.solution.truss.members)
        page.click("button:has-text('Undo')")
        see(page, "text=redo: run")
        page.reload()
        tab(page, "Design")
        see(page, "input[value='quad']")
        assert errors == []
