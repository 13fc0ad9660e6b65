"""What stands in a picture beside the grid: every warning, numbers at the places, which axis is shown up, what is left out faintly."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from small_grids import cloud_over, dome, icosahedron, make_grid
from test_picture import has_colour, pixels
from typed import xyz

import scantruss as st
from scantruss.export.drawing import picture
from scantruss.export.drawing.camera import choose_camera
from scantruss.export.drawing.left_out import NO_GRID_COLOUR, Missed, Shown
from scantruss.export.drawing.legend import Legend, Row, legends
from scantruss.export.drawing.picture import encode_picture
from scantruss.export.drawing.style import PictureStyle
from scantruss.grid.certificate import Certificate, Fault, LeftOut
from scantruss.grid.upward import facing_of, facing_up, guessed_up, known_upward

NOTHING_FOUND = Certificate("", 1.0, True, True, 1, 1, 1, 1, 1, 0)


def texts_of(
    grid: st.Grid, monkeypatch: pytest.MonkeyPatch, cloud: st.PointCloud | None = None, **style: Any
) -> list[Any]:
    """The words in a picture of a grid."""
    painted: list[Any] = []

    def paint(*given: Any) -> bytes:
        painted.append(given)
        return b""

    monkeypatch.setattr(picture, "paint", paint)
    encode_picture(grid, cloud, style=PictureStyle(**style))
    return list(painted[0][2])


def test_the_words_of_a_legend_stand_beside_its_longest_number() -> None:
    """The words of the tenth row began in its number."""
    rows = [Row("closes a hole", str(number)) for number in (1, 9, 10)]
    signs, words = Legend(rows, (0.0, 0.0), 1.0).texts[::2], Legend(rows, (0.0, 0.0), 1.0).texts[1::2]
    letter = Legend(rows[:2], (0.0, 0.0), 1.0).texts[1].x - signs[0].x
    assert len({text.x for text in words}) == 1 and words[2].x - signs[2].x > letter + 0.5


def turned_over(grid: st.Grid) -> st.Grid:
    """The same sheet with triangles that look down, as those of a net between masts or of a pit."""
    return grid.replace(nodes=grid.nodes * [1.0, 1.0, -1.0], triangles=grid.triangles)


@pytest.mark.parametrize("axis", [1, 2])
def test_a_sheet_that_faces_down_hangs_and_is_not_turned_over(axis: int) -> None:
    """A net between masts, a bowl and a quarry face down: y or z of their files is up all the same."""
    grid = dome(unit="mm")
    hung = grid.replace(nodes=np.roll(grid.nodes, axis - 2, axis=1), triangles=grid.triangles[:, ::-1])
    assert choose_camera(hung.nodes, hung.triangles).ground @ np.eye(3)[axis] == pytest.approx(1.0)
    assert guessed_up(hung) == ("" if axis == 2 else "y")
    assert guessed_up(turned_over(grid)) == ""


@pytest.mark.parametrize("turn", [0.0, 30.0, 90.0, 180.0])
def test_a_facade_stands_whichever_way_it_faces(turn: float) -> None:
    """A wall with windows set back, 20 wide and 12 high in a file with z up and without a unit, was drawn lying."""
    x, z = (axis.ravel() for axis in np.meshgrid(np.linspace(0.0, 20.0, 41), np.linspace(0.0, 12.0, 31)))
    nodes = np.column_stack([x, np.where((x % 4 > 1) & (x % 4 < 3) & (z % 3 > 1), 0.4, 0.0), z])
    number = np.arange(len(x)).reshape(31, 41)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    turned = dome(unit="").replace(nodes=nodes @ [[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]], triangles=triangles)
    assert guessed_up(turned) == ""


def test_each_open_piece_that_faces_down_is_turned_over_and_a_bowl_is_not() -> None:
    """The floor under an umbrella faced up, its roof down: in pictures one of them showed its back."""
    roof, bowl = dome(unit="mm"), icosahedron()
    low = bowl.nodes[:, 2] < 0.1 * np.ptp(bowl.nodes[:, 2])
    bowl = bowl.replace(triangles=bowl.triangles[low[bowl.triangles].sum(axis=1) > 1])  # its lower half, outside down
    number = len(roof.nodes)
    pieces = make_grid(
        [*roof.nodes, *(roof.nodes - [0.0, 0.0, 50.0]), *(bowl.nodes + [90.0, 0.0, 0.0])],
        [*roof.triangles[:, ::-1], *(roof.triangles + number), *(bowl.triangles + 2 * number)],
    )
    faced = facing_up(pieces, cloud_over(pieces)).triangles
    assert np.array_equal(faced[: len(roof.triangles)], roof.triangles)
    assert np.array_equal(faced[len(roof.triangles) :], pieces.triangles[len(roof.triangles) :])
    once = facing_up(pieces.replace(triangles=faced), cloud_over(pieces))
    assert np.array_equal(once.triangles, faced)


def test_a_wall_with_level_pavement_before_it_stands_and_faces_the_pavement() -> None:
    """Without a unit it was drawn lying, with one from behind."""
    sheet = dome()
    ground = sheet.nodes * [1.0, 1.0, 0.0]
    ground -= ground.min(axis=0)
    wall = ground[:, [0, 2, 1]]  # both meet along y = 0
    for turn in (0.0, 29.0, 61.0):
        cos, sin = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        nodes = np.concatenate([ground, wall]) @ [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]
        triangles = np.concatenate([sheet.triangles[:, ::-1], sheet.triangles + len(ground)])
        grid = make_grid(nodes, [*triangles, (0, len(ground), 1)])  # one piece
        assert guessed_up(grid) == ""
        facing = facing_of(grid.nodes, facing_up(grid, cloud_over(grid)).triangles)
        assert facing[2] > 0.3 and facing @ [-sin, cos, 0.0] > 0.3
        assert choose_camera(nodes, grid.triangles).ground @ [0.0, 0.0, 1.0] == pytest.approx(1.0)


def test_a_level_floor_under_a_grid_tells_that_z_is_up() -> None:
    body = icosahedron()
    body = body.replace(nodes=body.nodes * [1.0, 2.0, 1.0])
    assert known_upward(body, None) is None
    on_floor = replace(NOTHING_FOUND, left_out=(LeftOut("floor", 900, 0.2, (0.0, 0.0, -9.0), 30.0),))
    assert guessed_up(body.replace(certificate=on_floor)) == ""


def test_a_picture_with_a_guessed_axis_up_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    body = icosahedron()
    body = body.replace(nodes=body.nodes * [1.0, 2.0, 1.0])
    assert any("shows y up" in text.words and "--unit m" in text.words for text in texts_of(body, monkeypatch))
    assert not any("up" in text.words for text in texts_of(dome(unit="m"), monkeypatch))


@pytest.mark.parametrize("views", [("auto",), ("auto", "top")])
def test_every_warning_is_in_the_legend(views: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Also those without a place, more than are marked, and longer than the picture is wide."""
    grid = dome()
    warnings = [Fault("gap", f"bridges gap {k}", xyz(node)) for k, node in enumerate(grid.nodes[:8])]
    warnings += [Fault("aside", "leaves out 10.8% of the points"), Fault("unfollowed", "follows not " + 60 * "a rib ")]
    texts = texts_of(
        grid.replace(certificate=replace(NOTHING_FOUND, warnings=tuple(warnings))), monkeypatch, views=views
    )
    said = " ".join(text.words for text in texts if text.align == "left" and text.words.strip())
    assert all(warning.words.strip() in said for warning in warnings)
    wide = PictureStyle(views=views).size or (picture.PICTURE_SIZE if len(views) == 1 else picture.PANELS_SIZE)
    assert all(text.x + 0.62 * text.size * len(text.words) < wide[0] for text in texts if text.align == "left")


def test_a_long_legend_says_the_faults_first_and_how_much_more_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    faults = tuple(Fault(f"k{k}", f"is wrong in way {k}") for k in range(12))
    warnings = tuple(Fault(f"w{k}", f"is odd in way {k}", xyz(dome().nodes[k])) for k in range(18))
    texts = texts_of(dome().replace(certificate=replace(NOTHING_FOUND, faults=faults, warnings=warnings)), monkeypatch)
    said = [text.words for text in texts if text.align == "left" and len(text.words) > 1]
    assert said[0] == "This grid fails its certificate:" and said[1:13] == [fault.words for fault in faults]
    assert (
        len(said) == picture.MOST_LEGEND_ROWS and said[-1] == f"and {1 + 30 - 19} more, listed in a report (--report)"
    )


def warned(grid: st.Grid, number: int) -> st.Grid:
    """A grid with so many warnings, as many gaps bridged, and places for all of them."""
    places = [xyz(node) for node in grid.nodes]
    warnings = tuple(Fault(f"w{k}", f"is odd in way {k}" + " and in a few more" * 2, places[k]) for k in range(number))
    gaps = tuple(LeftOut("gap", 0, 0.0, place, 1.5) for place in places[number : 2 * number])
    return grid.replace(certificate=replace(NOTHING_FOUND, warnings=warnings, left_out=gaps))


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (1.0, 1.0, 4.0), (5.0, 1.0, 1.0)])
@pytest.mark.parametrize("views", [("auto",), ("auto", "front")])
def test_a_long_legend_leaves_more_than_half_of_the_picture_to_the_grid(
    stretch: tuple[float, ...], views: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With twenty lines one below the other, a retaining wall and an elk took a sixth of their pictures."""
    grid = dome(unit="m")
    grid = grid.replace(nodes=grid.nodes * stretch)
    painted: list[Any] = []

    def paint(*given: Any) -> bytes:
        painted.append(given)
        return b""

    monkeypatch.setattr(picture, "paint", paint)
    for each in (grid, warned(grid, 20)):
        encode_picture(each, None, style=PictureStyle(views=views))
    plain, full = (np.concatenate([s.shape.reshape(-1, 2) for s in given[1][1:]]) for given in painted)
    assert (np.ptp(full, axis=0) > 0.6 * np.ptp(plain, axis=0)).all()
    lines = [text for text in painted[1][2] if text.align == "left"]
    assert max(text.x + 0.62 * text.size * len(text.words) for text in lines) < painted[1][0][0]


def test_a_short_legend_has_one_column_and_lines_that_go_on_stay_together() -> None:
    rows = [Row("a word " * 30, str(number)) for number in range(1, 13)]
    (one,) = legends(rows[:1], 1500.0, (0.0, 0.0), 15.0)
    assert one.columns == [one.rows]
    for legend in legends(rows, 1500.0, (0.0, 0.0), 15.0):
        assert len(legend.columns) <= legend.number
        assert not any(column[0].goes_on for column in legend.columns)
        assert [row for column in legend.columns for row in column] == legend.rows


def test_each_number_in_a_picture_is_in_its_legend(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of which the line is left out, as the legend is long, are not drawn."""
    texts = texts_of(warned(dome(), 20), monkeypatch)
    drawn = {text.words for text in texts if text.over}
    explained = {text.words for text in texts if text.align == "left" and len(text.words) < 3}
    assert len(drawn) > 10 and drawn <= explained
    assert any(text.words.endswith(" more, listed in a report (--report)") for text in texts)


def test_each_ring_has_the_number_of_its_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small ones too, and two at one place have numbers that do not lie on each other."""
    grid = dome()
    one, two, three = (xyz(node) for node in grid.nodes[[20, 70, 110]])
    found = (Fault("gap", "bridges a gap", one, (two, three)), Fault("missed", "cuts off a corner", one))
    texts = texts_of(grid.replace(certificate=replace(NOTHING_FOUND, warnings=found)), monkeypatch)
    numbers = [text for text in texts if text.over]
    assert sorted(text.words for text in numbers) == ["1", "1", "1", "2"]
    places = np.array([(text.x, text.y) for text in numbers])
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 1e9 * np.eye(4)
    assert apart.min() > 0.9 * numbers[0].size


def test_the_legend_says_at_which_number_points_lie_far_off(monkeypatch: pytest.MonkeyPatch) -> None:
    grid, cloud = dome(), cloud_over(dome())
    far = Missed("9 points: farther than a member from the grid", grid.nodes[:9], NO_GRID_COLOUR, True, "far")
    monkeypatch.setattr(picture, "shown_points", lambda *_: Shown(grid.nodes, (far,)))
    found = replace(NOTHING_FOUND, warnings=(Fault("far", "misses 9 points", xyz(grid.nodes[0])),))
    texts = texts_of(grid.replace(certificate=found), monkeypatch, cloud)
    assert any(text.words.endswith("from the grid, at 1") for text in texts)


def test_a_floor_before_the_grid_does_not_hide_it_and_a_column_behind_it_is_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    grid, cloud = dome(unit="m"), cloud_over(dome(unit="m"))
    rng = np.random.default_rng(4)
    floor = np.column_stack([rng.uniform(-15, 15, (9000, 2)), np.full(9000, -9.0)])
    column = np.column_stack([rng.uniform(-0.5, 0.5, (2000, 2)), rng.uniform(-6.0, -1.0, 2000)])
    bare = pixels(encode_picture(grid, None, caption=False, style=PictureStyle(views=("bottom",))))
    for points, view in ((floor, "bottom"), (column, "top")):
        shown = Shown(grid.nodes, (Missed("floor", points, NO_GRID_COLOUR, False, "floor"),))
        monkeypatch.setattr(picture, "shown_points", lambda *_, shown=shown: shown)
        drawn = pixels(encode_picture(grid, cloud, caption=False, style=PictureStyle(views=(view,))))
        middle = drawn[550:650, 750:850]
        assert has_colour(middle, NO_GRID_COLOUR) == 0
        if view == "bottom":
            assert np.abs(middle - bare[550:650, 750:850]).mean() < 40
        else:
            towards = np.abs(middle - 255 * NO_GRID_COLOUR).sum(axis=2)
            assert (towards < np.abs(bare[550:650, 750:850] - 255 * NO_GRID_COLOUR).sum(axis=2).min()).mean() > 0.02
