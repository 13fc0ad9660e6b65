"""Designs beside one another are coloured by the same, with one legend."""

from pathlib import Path

import numpy as np
import pytest
from studio_dome import done, session_of_dome
from studio_view import choose, view_of

from scantruss.studio.session import Session
from scantruss.studio.state import NO_GRID
from scantruss.studio.tone import to_be_seen
from scantruss.studio.view import StudioView


def titles(view: StudioView) -> list[str]:
    """Return the titles of the legends of members that are seen."""
    return [each.title for each in view.legends.shown if each.title != "loads"]


def colors(view: StudioView, part: str) -> np.ndarray:
    """Return the colours of lines that are drawn (M, 2, 3)."""
    handle = view.scene.api.get_handle_by_name(part)
    assert handle is not None
    return np.asarray(getattr(handle, "colors"))  # noqa: B009


def test_a_kept_design_is_coloured_by_what_the_present_one_is(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.keep_design("bare")
    session.set_structure(section="CHS60.3x4", frequencies=0)
    session.run_structure()
    done(session)
    session.keep_design("light")
    session.set_structure(section="CHS114.3x5")
    session.run_structure()
    done(session)
    with view_of(session) as view:
        assert view.look.coloring.value == "utilization"
        choose(view, view.compare.other, "light")
        scale = view.look.scale
        assert scale is not None and titles(view) == ["utilization"] and not view.compare.lack.visible
        present, kept = scale.of_designs
        assert kept.max() > present.max()
        assert view.legends.shown[-1].ends == scale.shown_ends and scale.ends == (present.min(), kept.max())
        for part, values in (("/grid/members", present), ("/beside/members", kept)):
            assert np.array_equal(colors(view, part)[:, 0], to_be_seen(scale.colors(values)))

        choose(view, view.compare.other, "bare")
        assert view.look.coloring.value == "member length" and titles(view) == ["member length"]
        assert (
            "**bare** has no structure: no utilization; both are coloured by member length" in view.compare.lack.content
        )
        assert np.array_equal(colors(view, "/grid/members"), colors(view, "/beside/members"))  # it is the same grid

        choose(view, view.compare.other, "light")  # what was wanted comes back
        assert view.look.coloring.value == "utilization" and not view.compare.lack.visible
        choose(view, view.compare.over, True)
        assert titles(view) == ["light: distance from the present design"]
        choose(view, view.compare.distance, False)
        assert titles(view) == ["light: utilization"]

    again = Session(tmp_path / "dome.scantruss")
    again.open(tmp_path / "dome.scantruss")
    with view_of(again) as view:
        choose(view, view.compare.other, "light")  # solved again
        assert view.look.scale is not None and np.allclose(view.look.scale.of_designs[1], kept)


def test_a_grid_that_comes_after_none_is_coloured(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    with view_of(session) as view:
        assert view.look.coloring.value == "member length" and "data-field" in view.look.bars.content
        choose(view, view.look.coloring, "members at a node")
        session.change("none", **NO_GRID)
        session.tell()
        assert view.look.coloring.value == "plain" and view.look.bars.content == ""
        session.undo()
        assert view.look.coloring.value == "members at a node" and titles(view) == ["members at a node"]


def test_designs_in_other_units_share_a_scale_in_the_unit_of_the_present_one_or_none(tmp_path: Path) -> None:
    """A design in metres stood in the colours of one in millimetres: its 0.9 m were 0.9 mm."""
    session = session_of_dome(tmp_path, 6.0)
    session.keep_design("metres")
    grid = session.state.designs[0].grid
    lengths = np.sort(grid.lengths)
    for unit, factor in (("mm", 1000.0), ("", None)):
        session.set_unit(unit)
        done(session)
        assert session.grid is not None and session.grid.unit == unit
        with view_of(session) as view:
            choose(view, view.compare.other, "metres")
            scale = view.look.scale
            if factor is None:
                assert "member length" not in view.look.coloring.options
                assert view.compare.lack.visible and "is in m: no member length" in view.compare.lack.content
            else:
                assert scale is not None and scale.unit == unit
                assert np.sort(scale.of_designs[1]) == pytest.approx(factor * lengths, rel=1e-3)
