"""Views of pictures and decimal commas wherever a command writes pictures and tables."""

from pathlib import Path

import pytest
from PIL import Image
from small_grids import dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.drawing.picture import PANELS_SIZE

STRUCTURE = ["--supports", "boundary"]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a saved grid and its structure."""
    monkeypatch.chdir(tmp_path)
    st.write(dome(5, unit="m"), "grid.json")
    assert main(["structure", "grid.json", "roof.json", *STRUCTURE]) == 0
    return tmp_path


@pytest.mark.parametrize("twice", [False, True])
@pytest.mark.parametrize(
    "command",
    [
        "convert grid.json",
        "convert roof.json",
        "families grid.json --count 3 --tolerance 0.2",
        "structure grid.json --supports boundary",
        "schedule grid.json --tube 60",
        "setout roof.json",
    ],
)
def test_tables_have_decimal_commas_if_asked_for(command: str, twice: bool, place: Path) -> None:
    name, source, *rest = command.split()
    for _ in range(1 + twice):  # a table of ours with semicolons is known as one
        assert main([name, source, "points.csv", *rest]) == 0
        assert main([name, source, "commas.csv", "--decimal-comma", *rest]) == 0
    for points, commas in zip(sorted(place.glob("points*.csv")), sorted(place.glob("commas*.csv")), strict=True):
        one, other = points.read_text(encoding="utf-8"), commas.read_text(encoding="utf-8")
        assert one.count(";") == 0 and other.splitlines()[0] == one.splitlines()[0].replace(",", ";")
        assert len(one.splitlines()) == len(other.splitlines())
    assert "," in (place / "commas.csv").read_text().partition("\n")[2]


@pytest.mark.parametrize("command", ["convert", "families"])
def test_pictures_are_taken_from_the_sides_asked_for(command: str, place: Path) -> None:
    assert main([command, "grid.json", "two.png", "--view", "top", "--view", "front"]) == 0
    assert main([command, "grid.json", "small.png", "--size", "400x300"]) == 0
    for name, size in (("two.png", PANELS_SIZE), ("small.png", (400, 300))):
        with Image.open(name) as picture:
            assert picture.size == size
