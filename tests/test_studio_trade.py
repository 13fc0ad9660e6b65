"""Few different parts in the studio: the trade is that of the library, what is taken that of the command line, and it can be undone."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from studio_dome import done, session_of_dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.layouts.trade import COUNTS_TRIED
from scantruss.studio.outputs import command_of_project, settings_files
from scantruss.studio.session import Session
from scantruss.studio.state import Trade
from scantruss.studio.trade_tool import curve_of, words_of_present


def present(session: Session) -> Trade:
    """Return the trade, which must be known."""
    trade = session.state.trade
    assert trade is not None
    return trade


@pytest.mark.parametrize(("parts", "tolerance"), [("lengths", 0.02), ("joints", 0.05), ("panels", 0.06)])
def test_what_is_taken_of_the_trade_is_what_the_command_line_makes(
    parts: str, tolerance: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = session_of_dome(tmp_path, 10.0)
    before = session.grid
    assert before is not None
    session.find_trade(parts, tolerance, mirrored=parts == "panels")
    done(session)
    trade = present(session)
    numbers = [each.number for each in trade.traded]
    assert numbers == sorted(set(numbers), reverse=True)
    assert numbers == list(COUNTS_TRIED) if parts == "lengths" else len(numbers) > 1
    middle = trade.traded[len(numbers) // 2]
    session.take_traded(middle.number)
    done(session)
    taken = session.grid
    assert taken is not None and taken.certificate is not None and taken.certificate.passed
    assert taken.alike is not None and taken.alike.count == middle.number and taken.deviation is not None
    assert f"**{middle.number} " in words_of_present(trade, session.state)
    assert session.state.trade is trade  # another number can be taken
    again = Session()
    again.open(tmp_path / "dome.scantruss")
    assert again.grid is not None and again.grid.alike == taken.alike
    monkeypatch.chdir(tmp_path)
    for name, content in settings_files(session.state).items():
        Path(name).write_bytes(content)
    commands = [line for line in command_of_project(session.state).splitlines() if not line.startswith("#")]
    assert len(commands) == 2 and f"--parts {parts}" in commands[1]
    for line in commands:
        assert main(line.split()[1:]) == 0
    few = st.read_grid("few.json")
    assert np.array_equal(few.nodes, taken.nodes) and few.alike == taken.alike
    session.undo()
    assert session.grid is before and session.state.trade is trade


def test_a_trade_needs_a_finished_grid_and_goes_with_it(tmp_path: Path) -> None:
    with pytest.raises(st.InputError, match="press Generate"):
        Session().find_trade("lengths", 0.01)
    session = session_of_dome(tmp_path, 10.0)
    with pytest.raises(st.InputError, match="press Find what fewer cost"):
        session.take_traded(5)
    session.find_trade("lengths", 0.2)
    done(session)
    session.take_traded(4)  # of 5 and 3: no more than that
    done(session)
    assert session.grid is not None and session.grid.alike is not None and session.grid.alike.count == 3
    session.state = replace(session.state, trade=None)  # as in a project of before
    with pytest.raises(st.InputError, match="lengths of this grid have been made equal"):
        session.find_trade("joints", 0.01)
    session.generate()
    done(session)
    assert session.state.trade is None


@pytest.mark.parametrize("parts", ["lengths", "panels"])
def test_a_trade_is_kept_in_the_project(parts: str, tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 10.0)
    session.find_trade(parts, 0.05)
    done(session)
    trade = present(session)
    place = tmp_path / "dome.scantruss"
    written = place.read_bytes()
    session.save()
    assert place.read_bytes() == written
    for take in (None, trade.traded[1].number):  # with the grid before, and with another
        if take is not None:
            session.take_traded(take)
            done(session)
        again = Session()
        again.open(place)
        kept = present(again)
        assert (kept.parts, kept.off_scan) == (trade.parts, trade.off_scan) and (kept.before is again.grid) == (
            take is None
        )
        assert np.array_equal(kept.before.nodes, trade.before.nodes)
        for one, other in zip(kept.traded, trade.traded, strict=True):
            assert one._replace(grid=other.grid) == other and one.grid.alike == other.grid.alike
            assert np.array_equal(one.grid.nodes, other.grid.nodes)
            assert np.array_equal(one.grid.triangles, other.grid.triangles)
        again.take_traded(trade.traded[-1].number)
        done(again)
        assert (
            again.grid is not None
            and again.grid.alike is not None
            and again.grid.alike.count == trade.traded[-1].number
        )


def test_a_trade_that_is_stopped_keeps_what_was_found(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 10.0)

    def stop_at_second() -> None:
        if session.state.trade is not None and len(session.state.trade.traded) == 2:
            session.stop()

    end = session.listen(stop_at_second)
    session.find_trade("lengths", 0.02)
    done(session)
    end()
    assert [each.number for each in present(session).traded] == list(COUNTS_TRIED[:2])
    again = Session()
    again.open(tmp_path / "dome.scantruss")
    assert [each.number for each in present(again).traded] == list(COUNTS_TRIED[:2])


def test_the_curve_has_a_place_to_click_for_each_number(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 10.0)
    session.find_trade("lengths", 0.2)
    done(session)
    trade = present(session)
    svg = curve_of(trade, 7)
    assert re.findall(r'data-field="at most" data-low="(\d+)"', svg) == [str(count) for count in sorted(COUNTS_TRIED)]
    assert svg.count('stroke-width="2"') == 1  # the present one
    assert svg.count("<circle") == 3 * len(COUNTS_TRIED) and "nan" not in svg
    assert json.loads(json.dumps(words_of_present(trade, session.state))).startswith("the grid as it was")
