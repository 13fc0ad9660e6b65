"""What the command line says of a file that it writes stands on the page after the download of that file."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from studio_dome import done, session_of_dome
from studio_view import PATIENCE, choose, press, view_of

from scantruss.cli.main import main
from scantruss.export.formats import GRID, STRUCTURE
from scantruss.studio.further_files import SCHEDULES
from scantruss.studio.page_words import in_words_of_page
from scantruss.studio.tab_out import words_of_suffix


def until(holds: Callable[[], bool]) -> bool:
    """Wait until something holds; whether it does."""
    end = time.monotonic() + PATIENCE
    while not holds() and time.monotonic() < end:  # ends: time passes
        time.sleep(0.02)
    return holds()


def test_notes_of_the_command_line_stand_on_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.set_structure(section="CHS114.3x5", frequencies=0, loads="self,snow:1kN/m2,wind:0.8kN/m2")
    session.run_structure()
    done(session)
    assert session.state.report is not None
    assert any("wind without a coefficient" in words for words in session.state.report.warnings)
    monkeypatch.chdir(tmp_path)
    Path("s.json").write_bytes(session.files("structure", ".json")["structure.json"])
    capsys.readouterr()
    assert main("convert s.json s.obj".split()) == 0
    of_format = [
        line.partition("scantruss: ")[2] or line for line in capsys.readouterr().err.splitlines() if "holds no" in line
    ]
    assert main("schedule s.json s.xlsx".split()) == 0
    of_schedules = [line for line in capsys.readouterr().out.splitlines() if not line.startswith("wrote ")]
    assert of_format and any("balls weigh" in line for line in of_schedules)
    with view_of(session) as view:
        out, sent = view.files, view.client.sent
        choose(view, out.suffix[STRUCTURE], words_of_suffix(".obj"))
        press(view, out.buttons[STRUCTURE])
        assert until(lambda: "structure.obj" in sent and out.notes.visible)
        assert out.notes.content == f"**structure.obj**:\n\n- {of_format[0]}"
        press(view, out.buttons[GRID])  # a .json holds all
        assert until(lambda: "grid.json" in sent and not out.notes.visible)
        choose(view, out.further, SCHEDULES)
        press(view, out.that)
        assert until(lambda: "schedules.xlsx" in sent and out.notes.visible)
        assert all(f"- {in_words_of_page(line)}" in out.notes.content for line in of_schedules)
