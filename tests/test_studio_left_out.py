"""The page says what of a scan is not in the grid, as the command line does."""

from pathlib import Path

import numpy as np
import pytest
from studio_dome import done
from studio_view import view_of

from scantruss.cli.main import main
from scantruss.studio.left_out import MOST_LEFT_OUT, words_left_out, words_on_page
from scantruss.studio.session import Session

CROP = "box:0,0,-1,10,8,9"


def write_scan(path: Path) -> None:
    """Write a dome with a small piece beside it, points on no surface, some twice, and what a crop leaves out."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 10, 50), np.linspace(0, 10, 50)))
    dome = np.stack([x, y, 2 - 0.04 * ((x - 5) ** 2 + (y - 5) ** 2)], axis=1)
    strays = np.random.default_rng(3).uniform([0.0, 0.0, 4.0], [10.0, 10.0, 8.0], (30, 3))
    u, v = (each.ravel() for each in np.meshgrid(np.linspace(4, 5, 6), np.linspace(4, 5, 6)))
    piece = np.stack([u, v, -0.5 + 0.1 * u], axis=1)
    np.savetxt(path, np.concatenate([dome, strays, piece, dome[:40]]), fmt="%.6f")


def test_what_is_left_out_is_said_as_the_command_line_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_scan(Path("dome.xyz"))
    main(f"grid dome.xyz g.json --length 1.5 --unit m --effort quick --crop {CROP} --keep-failed".split())
    out = capsys.readouterr().out
    said = [line for line in out.splitlines() if line.startswith("left out:")]
    assert len(said) >= 3 and any("outside the box" in line for line in said)
    session = Session(folder=tmp_path)
    session.open(tmp_path / "dome.xyz")
    session.set_unit("m")
    session.change("length", settings=session.settings.replace(length=1.5, effort="quick"))
    session.crop((CROP,))
    session.generate()
    done(session)
    with view_of(session) as view:
        assert words_left_out(session.state) == said
        assert view.scan.left_out.visible and view.scan.left_out.content == words_on_page(said)
        session.propose_cleaning(3.0, 0.0)
        done(session)
        session.clean()
        session.remove_points(np.arange(len(session.cloud.points)) < 7)  # type: ignore[union-attr]
        assert session.worker.wait(60.0)
        lines = words_left_out(session.state)
        outside = next(line for line in said if "outside the box" in line).partition(" (")[0]
        assert f"{outside} outside the box" in lines  # which no file says that is clean already
        assert any("points removed by Clean: " in line for line in lines)
        assert lines[-1] == "left out: 7 points removed by hand"


def test_a_long_list_is_cut_and_says_so() -> None:
    lines = [f"left out: {k} points" for k in range(MOST_LEFT_OUT + 3)]
    assert words_on_page(lines).endswith("and 3 more, in the report of the grid") and words_on_page([]) == ""
