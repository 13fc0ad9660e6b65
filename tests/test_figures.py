"""Figures of a grid against slow twins."""

import dataclasses

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from small_grids import dome

from scantruss import Certificate, Grid, Settings
from scantruss.check.limits import places_to_look_at
from scantruss.errors import words_of_number, words_of_share
from scantruss.grid.certificate import Fault, LeftOut, Spread, Worst
from scantruss.kernels.geometry.components import component_labels
from scantruss.report.figures import distance_lines, left_out_lines, line_lines
from scantruss.report.terminal import print_table


@pytest.mark.kernels
@example(np.array([[1.0, 1, 1]] * 5 + [[0.0, 0, 0]]))
@given(arrays.arrays(np.float64, (6, 3), elements=st.floats(-5, 5, width=16)))
def test_angles_are_those_of_textbooks(nodes: np.ndarray) -> None:
    triangles = np.array([(0, 1, 2), (3, 4, 5), (2, 5, 1)])
    for t, angles in zip(
        triangles, Grid(nodes, triangles, np.zeros(len(nodes), bool), np.zeros(3)).angles, strict=True
    ):
        for k in range(3):
            u, w = nodes[t[(k + 1) % 3]] - nodes[t[k]], nodes[t[(k + 2) % 3]] - nodes[t[k]]
            known = np.degrees(np.arctan2(np.linalg.norm(np.cross(u, w)), u @ w + 0.0))
            assert angles[k] == pytest.approx(known, abs=1e-9)


@pytest.mark.parametrize(
    ("value", "digits", "words"),
    [
        (1441.2, 3, "1,440"),
        (1720.4, 4, "1,720"),
        (-17984.6, 4, "-17,980"),
        (1234.56, 6, "1,234.56"),
        (999.96, 4, "1,000"),
        (110.4, 2, "110"),
        (-230.0, 1, "-200"),
        (3.14159, 3, "3.14"),
        (1e-5, 3, "1e-05"),
        (2.5e10, 3, "2.5e+10"),
    ],
)
def test_numbers_for_readers_have_a_power_of_ten_only_where_they_are_huge(
    value: float, digits: int, words: str
) -> None:
    assert words_of_number(value, digits) == words


@pytest.mark.kernels
@given(st.integers(1, 30), st.lists(st.tuples(st.integers(0, 29), st.integers(0, 29)), max_size=40))
def test_things_joined_by_links_have_the_lowest_of_them_as_label(count: int, links: list[tuple[int, int]]) -> None:
    pairs = np.array([(a % count, b % count) for a, b in links], np.int64).reshape(-1, 2)
    groups = {thing: {thing} for thing in range(count)}
    for a, b in pairs.tolist():
        both = groups[a] | groups[b]
        for thing in both:
            groups[thing] = both
    assert component_labels(count, pairs[:, 0], pairs[:, 1]).tolist() == [min(groups[thing]) for thing in range(count)]


def test_an_outlier_is_not_the_point_farthest_from_the_grid() -> None:
    away, kept = Spread(0.01, 8.0, 8.4, Worst(9.0, (1.0, 2.0, 3.0))), Worst(0.4, (4.0, 5.0, 6.0))
    parts = (LeftOut("outliers", 20, 0.02, farthest=9.0),)
    found = Certificate(
        "m", 0.5, True, True, 1, 1, 1, 1, 1, 0, points=1000, left_out=parts, scan_distance=away, farthest_kept=kept
    )
    assert found.worst_places() == [("point farthest from the grid, outliers aside", kept, False)]
    assert Certificate.from_dict(found.to_dict()) == found


def test_one_point_is_no_points() -> None:
    part = LeftOut("rods", 1, 0.001, (1.0, 2.0, 3.0), 0.0)
    found = Certificate("m", 0.5, True, True, 1, 1, 1, 1, 1, 0, points=1000, left_out=(part,))
    assert left_out_lines(found)[0].startswith("left out: 1 point (0.10%) columns")
    far = dataclasses.replace(found, left_out=(LeftOut("far", 1, 0.001, (1.0, 2.0, 3.0), 0.0, 0.5),))
    assert places_to_look_at(far, (0.0, 0.0, 0.0))[0].words == "misses 1 point (0.10%) by up to 0.5 m"


@pytest.mark.parametrize(("largest", "listed"), [(8.5, True), (0.7, False)])
def test_the_farthest_point_is_said_to_be_left_out_where_it_is(largest: float, listed: bool) -> None:
    floor = LeftOut("floor", 130, 0.13, (0.0, 0.0, 0.0), 36.0, 8.5)
    away = Spread(0.01, 8.0, 8.4, Worst(largest, (1.0, 2.0, 3.0)))
    parts = (floor, LeftOut("outliers", 20, 0.02, farthest=3.0), LeftOut("of other classes", 900, 0.4, asked=True))
    found = Certificate("m", 0.5, True, True, 1, 1, 1, 1, 1, 0, points=1000, left_out=parts, scan_distance=away)
    (line, _), ((name, _, _),) = distance_lines(found), found.worst_places()
    assert (found.farthest_listed is floor) == listed == name.endswith(", one left out")
    said = (
        "; 15.00% of them are listed as left out, the farthest among them: in a floor under the others (near 1, 2, 3)"
    )
    assert line.endswith(said) == listed


@pytest.mark.parametrize(
    ("sharpest", "words"), [(103.0, "no ridge is followed"), (150.0, "no ridge: no sharp edge is")]
)
def test_no_ridge_is_only_said_to_be_there_where_no_fold_is_sharp(sharpest: float, words: str) -> None:
    found = Certificate("m", 0.5, True, True, 1, 1, 1, 1, 1, 0, sharpest_fold=Worst(sharpest, (0.0, 0.0, 0.0)))
    grid = dataclasses.replace(dome(), certificate=found, settings=Settings(length=4.0, ridge_angle=40.0))
    (line,) = line_lines(grid)
    assert line.startswith(words)
    lost = dataclasses.replace(found, warnings=(Fault("lost", "cuts across ridges of the scan: 3 m"),))
    assert line_lines(dataclasses.replace(grid, certificate=lost)) == ["no ridge is followed"]


def test_in_a_table_words_start_and_figures_end_below_each_other(capsys: pytest.CaptureFixture[str]) -> None:
    print_table(("length", "members", "a quick run"), [("2.3", "22,410", "not tried"), ("13", "86", "passes")])
    assert capsys.readouterr().out.splitlines() == [
        "length  members  a quick run",
        "2.3      22,410  not tried",
        "13           86  passes",
    ]


def test_a_share_that_is_not_none_is_not_said_to_be_none() -> None:
    """6 of 200,000 points were "6 points (0.00%)"."""
    assert [words_of_share(each) for each in (0.0, 6 / 90_000, 6 / 200_000, 0.1234)] == [
        "0.00%",
        "0.01%",
        "less than 0.01%",
        "12.34%",
    ]
