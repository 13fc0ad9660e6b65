"""A grid that was saved as .json is opened in the studio where its scan is open, and refused with what to do where it is not."""

from pathlib import Path

import numpy as np
import pytest
from studio_dome import PATIENCE, done, session_of_dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.formats import model_of, write
from scantruss.studio.grid_files import changes_of_grid
from scantruss.studio.session import Session


def test_a_saved_grid_is_taken_with_its_settings(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 8.0)
    saved, grid = session.files("grid", ".json")["grid.json"], session.grid
    session.set("length", length=1.7)
    done(session)
    assert grid is not None and session.state.is_live
    session.open_upload("kept.json", saved)
    done(session)
    assert session.grid is not None and session.files("grid", ".json")["grid.json"] == saved
    assert session.settings.length == 2.5 and session.grid.settings == grid.settings
    taken = session.state
    assert not taken.is_stale and not taken.is_live and session.history.words[0] == "open kept.json"
    again = Session()
    again.open(tmp_path / "dome.scantruss")
    assert again.files("grid", ".json")["grid.json"] == saved
    session.undo()
    assert session.settings.length == 1.7
    (tmp_path / "grid.json").write_bytes(saved)
    session.open_path("grid.json")
    done(session)
    assert session.settings.length == 2.5


def test_what_is_no_grid_of_the_scan_is_refused(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 8.0)
    grid = session.grid
    assert grid is not None
    for name, other in (
        ("away", grid.replace(nodes=grid.nodes + [0.0, 0.0, 3.0])),
        ("no grid of the scan", grid.replace(nodes=grid.nodes * [1.0, 0.6, 1.0])),
        ("cm", grid.replace(unit="cm")),
    ):
        write(model_of(other), tmp_path / "other.json")
        session.open_upload("other.json", (tmp_path / "other.json").read_bytes())
        assert (
            session.worker.wait(PATIENCE)
            and "other.json is" in session.message
            and str(tmp_path) not in session.message
        ), name
        assert session.grid is grid
    session.open_upload("table.json", b"[1, 2]")
    assert session.worker.wait(PATIENCE) and "a grid saved as .json" in session.message and session.grid is grid
    with pytest.raises(st.InputError, match="open the scan first"):
        changes_of_grid(Session().state, tmp_path / "other.json")


def test_the_studio_does_not_begin_with_a_grid(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("viser", reason="viser is not installed")
    monkeypatch.chdir(tmp_path)
    np.savetxt("a.xyz", np.zeros((1, 3)))
    Path("grid.json").write_text("{}")
    assert main(["studio", "grid.json", "--no-open"]) == 2
    err = capsys.readouterr().err
    assert "open the scan first, then the grid" in err and err.count("\n") == 1
    assert not Path("grid.scantruss").exists()
