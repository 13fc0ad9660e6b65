"""What commands say of a scan: the same words in all of them."""

from pathlib import Path

import numpy as np
import pytest
from shapes import make

from scantruss.cli.main import main
from scantruss.cli.shared import report_cloud
from scantruss.report.terminal import Bars
from scantruss.scan.cloud import PointCloud


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with a scan of which some points are no numbers."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SCANTRUSS_TRACEBACK", "1")
    points = make("scallop", 20_000).points
    points[::16] = np.nan
    np.save("scan.npy", points)


@pytest.mark.parametrize(
    "words", ["info scan.npy", "info scan.npy --thin-spacing 1", "thin scan.npy -o a.npy --spacing 1"]
)
def test_points_that_are_no_numbers_are_told_of_in_the_same_words(
    words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words.split()) == 0
    assert "\n1,250 points with NaN or infinite coordinates are left out\n" in "\n" + capsys.readouterr().err


def test_one_of_several_clouds_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    notes = (
        "7 points outside the box are left out",
        "a.las is in foot and is converted to m, the unit of the first file",
    )
    cloud = PointCloud(np.zeros((1, 3)), np.zeros(3), dropped=2, notes=notes)
    for name in ("", "a.las"):
        report_cloud(Bars(), cloud, name)
    nans = "2 points with NaN or infinite coordinates are left out"
    assert capsys.readouterr().err.splitlines() == [*notes, nans, f"a.las: {notes[0]}", notes[1], f"a.las: {nans}"]
