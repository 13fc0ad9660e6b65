"""Settings: what is refused, what survives a file, and that the docs and the options show every field."""

import json
import math
import runpy
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scantruss.cli.options import Parser as OptionParser
from scantruss.cli.options import add_settings, option_of, settings_of
from scantruss.cli.positions import read_positions
from scantruss.errors import FormatError, InputError
from scantruss.pipeline import grid_from_points
from scantruss.scan.cloud import PointCloud
from scantruss.settings import Settings

ROOT = Path(__file__).resolve().parents[1]

lengths = st.floats(1e-6, 1e6)
coordinates = st.floats(-1e7, 1e7)


def parse(*words: str) -> Settings:
    parser = OptionParser("grid", "", "")
    parser.add_argument("--settings")
    parser.add_argument("--fixed-file")
    add_settings(parser)
    return settings_of(parser.read(words))


@pytest.mark.parametrize("length", [0, -1, math.nan, math.inf, "4", None])
def test_a_length_that_is_no_positive_number_is_refused(length: Any) -> None:
    with pytest.raises(InputError, match="length must be a positive number"):
        Settings(length=length)


def test_lengths_given_as_a_length_are_told_where_they_belong() -> None:
    for lengths in ("curvature:1:2", [(0.0, 0.0, 0.0, 1.0)]):
        with pytest.raises(InputError, match=r"give curvature:MIN:MAX or rows of lengths as length_field"):
            Settings(length=lengths)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"unknown setting 'lenght' \(did you mean length\?\)"):
        Settings.from_dict({"lenght": 1.0})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("method", "best"), ("unit", "furlong"), ("advance_from", "inside"), ("case3", "split"), ("max_deviation", 0.0),
        ("max_deviation", math.nan), ("merge_angle", 30.0), ("smooth_passes", -1), ("fixed", ((1, 2),)),
        ("fixed", (("a", 2, 3),)),
        ("fixed", ((1, 2, math.nan),)),
    ],
)  # fmt: skip
def test_an_impossible_value_is_refused_by_its_name(name: str, value: Any) -> None:
    with pytest.raises(InputError, match="fixed" if name == "fixed" else name):
        Settings(length=1.0, **{name: value})


@given(lengths, st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=3))
def test_a_file_keeps_settings_exactly(length: float, fixed: list[tuple[float, float, float]]) -> None:
    settings = Settings(length=length, fixed=tuple(fixed), method="paper")
    assert Settings.from_dict(json.loads(json.dumps(settings.to_dict()))) == settings


def test_a_file_is_read_on_its_own_or_inside_a_report(tmp_path: Path) -> None:
    settings = Settings(length=4.7, fixed=((0, 0, 12),))
    (tmp_path / "alone.json").write_text(json.dumps(settings.to_dict()))
    (tmp_path / "report.json").write_text(json.dumps({"settings": settings.to_dict(), "points": 3}))
    assert Settings.read(tmp_path / "alone.json") == Settings.read(tmp_path / "report.json") == settings


@pytest.mark.parametrize("text", ["", "[]", "{", '{"length": 1, "colour": 2}', '{"method": "paper"}', '{"length": []}'])
def test_a_file_that_holds_no_settings_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "bad.json").write_text(text)
    with pytest.raises(InputError):
        Settings.read(tmp_path / "bad.json")


def test_every_field_has_words_an_option_and_a_line_in_the_docs() -> None:
    parser = OptionParser("grid", "", "")
    add_settings(parser)
    text = " ".join(parser.format_help().split())
    for spec in fields(Settings):
        assert spec.metadata["help"]
        assert option_of(spec.name) in text


def test_the_table_in_the_docs_is_current() -> None:
    table = runpy.run_path(str(ROOT / "scripts" / "make_settings_table.py"))["settings_table"]()
    assert (ROOT / "docs" / "settings.md").read_text(encoding="utf-8") == table, "run scripts/make_settings_table.py"


@given(lengths, st.tuples(coordinates, coordinates, coordinates))
def test_options_bring_every_number_through_exactly(length: float, position: tuple[float, float, float]) -> None:
    settings = parse("--length", repr(length), "--fixed", ",".join(map(repr, position)), "--case3", "quadrangle")
    assert settings == Settings(length=length, fixed=(position,), case3="quadrangle")


def test_options_override_a_settings_file_field_by_field(tmp_path: Path) -> None:
    kept = Settings(length=4.7, method="paper", max_deviation=0.1, fixed=((1, 2, 3),))
    (tmp_path / "kept.json").write_text(json.dumps(kept.to_dict()))
    assert parse("--settings", str(tmp_path / "kept.json")) == kept
    changed = parse("--settings", str(tmp_path / "kept.json"), "--length", "5", "--max-deviation", "none")
    assert changed == kept.replace(length=5.0, max_deviation=None)


@pytest.mark.parametrize(
    "text",
    [
        "1,2,-3\n4,5,6.5\n",
        "x,y,z\n1,2,-3\n4,5,6.5",
        "1;2;-3\r\n4;5;6,5\r\n",
        "1\t2\t-3\n4\t5\t6.5",
        "# fixed\n1 2 -3\n\n 4  5  6.5 \n",
        "name,x,y,z\na,1,2,-3\nb,4,5,6.5\n",
        "\ufeffx;y;z\n1;2;-3\n4;5;6.5\n",
        '"x","y","z"\n"1","2","-3"\n"4","5","6.5"\n',
        "1, 2, -3, first\n4, 5, 6.5, second\n",
    ],
)
def test_fixed_nodes_are_read_from_any_text(tmp_path: Path, text: str) -> None:
    (tmp_path / "fixed.csv").write_text(text, encoding="utf-8")
    assert read_positions(tmp_path / "fixed.csv") == [(1, 2, -3), (4, 5, 6.5)]
    assert parse("--length", "1", "--fixed", "7,8,9", "--fixed-file", str(tmp_path / "fixed.csv")).fixed == (
        (7, 8, 9),
        (1, 2, -3),
        (4, 5, 6.5),
    )


@pytest.mark.parametrize(
    "text",
    ["", "x,y,z\n", "1,2\n", "1,2,3\n4,5\n", "1,2,3\nend\n", "a,b,c\nd,e,f\n1,2,3\n", "1,2,3\nnan,0,0\n", "inf,0,0\n"],
)
def test_a_file_without_fixed_nodes_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "fixed.csv").write_text(text)
    with pytest.raises(FormatError, match=r"fixed\.csv"):
        read_positions(tmp_path / "fixed.csv")


def test_a_file_that_is_nested_too_deeply_is_no_settings_file(tmp_path: Path) -> None:
    path = tmp_path / "deep.json"
    path.write_text("[" * 200_000)
    with pytest.raises(InputError, match="not a settings file"):
        Settings.read(path)


@pytest.mark.parametrize(
    "taken",
    [
        {"crop": "box:0,0,-1,5,10,1"},
        {"classes": 2},
        {"returns": "first"},
        {"confidence": 0.5},
        {"z_unit": "foot"},
        {"thin_spacing": 0.3},
    ],
)
def test_what_chooses_points_of_a_file_is_refused_for_an_array(taken: dict[str, Any]) -> None:
    """It was ignored: the grid was of all points."""
    settings = Settings(length=1.0, **taken)
    with pytest.raises(InputError, match=f"{next(iter(taken))} acts while a scan file is read"):
        grid_from_points(np.zeros((10, 3)), settings)


def test_a_cloud_gives_the_grid_of_its_points() -> None:
    points = np.random.default_rng(3).uniform([0.0, 0.0, 0.0], [6.0, 4.0, 0.01], (3_000, 3))
    settings = Settings(length=1.0, effort="quick")
    cloud = PointCloud.from_array(points, unit="m")
    one, other = grid_from_points(cloud, settings), grid_from_points(points, settings)
    assert one.unit == "m" and np.array_equal(one.scan_nodes, other.scan_nodes)
