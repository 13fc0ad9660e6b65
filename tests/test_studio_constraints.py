"""What a person draws on the scan in the studio: lines, arrows of rows, lengths by a brush."""

from pathlib import Path

import numpy as np
import pytest
from studio_dome import done, session_of_dome

import scantruss as st
from scantruss.boundary.find import find_boundary
from scantruss.errors import LengthError
from scantruss.front.orientation_field import STARTS_OF_EFFORTS, lattice_along, usual_starts
from scantruss.pipeline import grid_from_cloud
from scantruss.studio.drawn_lines import ScannedPoints, numbers_of, points_of
from scantruss.studio.frame import DRAWN_EXTENT, SceneFrame
from scantruss.studio.length_brush import MOST_PAINTED, painted, places_to_paint
from scantruss.studio.session import Session
from scantruss.studio.symmetry_tool import corners_of_plane, ends_on, upright_plane
from scantruss.surface.samples import sample_surface

HEIGHT = 6.0


@pytest.fixture(scope="module")
def dome() -> st.PointCloud:
    """Return the points of a half sphere of radius 6, at national coordinates."""
    golden = np.pi * (3 - np.sqrt(5)) * np.arange(6000)
    z = (np.arange(6000) + 0.5) / 6000
    around = np.sqrt(1 - z**2)
    points = HEIGHT * np.stack([around * np.cos(golden), around * np.sin(golden), z], axis=1)
    return st.PointCloud.from_array(points + [4.5e5, 5.3e6, 0.0], unit="m")


SETTINGS = st.Settings(length=1.0, unit="m", effort="quick")


def test_a_line_between_two_points_follows_the_scan(dome: st.PointCloud) -> None:
    scanned = ScannedPoints.of(dome, SETTINGS)
    middle = np.array([4.5e5, 5.3e6, 0.0])
    ends = np.array([scanned.nearest(middle + [-5.0, 1.0, 3.2]), scanned.nearest(middle + [5.0, -1.0, 3.2])])
    line = scanned.along(ends, SETTINGS.length)
    assert np.array_equal(line[[0, -1]], ends)
    assert np.abs(np.linalg.norm(line - middle, axis=1) - HEIGHT).max() < 0.02
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert steps.max() <= 0.5 * SETTINGS.length
    assert steps.sum() < 1.02 * HEIGHT * np.arccos(
        (ends - middle)[0] @ (ends - middle)[1] / HEIGHT**2
    )  # of a great circle
    SETTINGS.replace(fixed_lines=(line.tolist(),))


def test_a_fixed_node_that_is_placed_near_a_corner_of_the_boundary_means_the_corner(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    for x, y in ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0)):
        inwards = np.array([5.0 - x, 3.0 - y]) / 20.0
        place = np.array([x + inwards[0], y + inwards[1], 1.0])
        corner = session.corner_near(place)
        assert corner is not None and np.linalg.norm(corner[:2] - [x, y]) < 0.1 * session.settings.length
        session.fix((tuple(corner.tolist()),))  # a grid can have it
    assert session.corner_near(np.array([5.0, 3.0, 2.0])) is None


def test_typed_numbers_are_refused_in_words() -> None:
    assert points_of("1, 2 3; 4 5 6;") == [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)]
    for text in ("1 2", "1 2 3 4", "1 2 x"):
        with pytest.raises(st.InputError, match="needs points x, y, z"):
            points_of(text)
        with pytest.raises(st.InputError, match="six numbers"):
            numbers_of(text, 6, "six numbers")


def test_a_dab_changes_the_lengths_around_it_alone(dome: st.PointCloud) -> None:
    at = ScannedPoints.of(dome, SETTINGS).nearest(np.array([4.5e5, 5.3e6, HEIGHT]))
    first = painted(dome, SETTINGS, at, 2.0, 0.5)
    rows = np.array(first.length_field, float)
    assert 20 < len(rows) == len(places_to_paint(dome, SETTINGS)) <= MOST_PAINTED
    near = np.linalg.norm(rows[:, :3] - at, axis=1) <= 2.0
    assert near.any() and (rows[near, 3] == 0.5).all() and (rows[~near, 3] == 1.0).all() and first.length == 0.5
    scaled = first.replace(length=1.0)  # the whole field twice as long
    again = np.array(painted(dome, scaled, at, 1e-3, 4.0).length_field, float)[:, 3]
    assert (again == 4.0).sum() == 1 and set(again[again < 4.0]) == {1.0, 2.0}
    with pytest.raises(st.InputError, match="positive length and radius"):
        painted(dome, SETTINGS, at, 2.0, 0.0)


def test_a_lattice_begins_along_the_arrow(dome: st.PointCloud) -> None:
    top = (4.5e5, 5.3e6, HEIGHT)
    settings = SETTINGS.replace(rows_along=(*top, 3.0, 4.0, 0.5), effort="normal")
    samples, _ = find_boundary(sample_surface(dome, settings), settings)
    sample, ahead, _ = lattice_along(samples, settings.rows_along)
    normal = samples.surface.normals[sample]
    assert abs(np.dot(ahead, normal)) < 1e-9 and np.dot(ahead, [0.6, 0.8, 0.0]) > 0.99 * np.linalg.norm(ahead)
    assert usual_starts(samples, settings) == STARTS_OF_EFFORTS["normal"][:1]
    with pytest.raises(st.InputError, match="begins off the scan"):
        lattice_along(samples, (0.0, 0.0, 0.0, 1.0, 0.0, 0.0))
    with pytest.raises(st.InputError, match="square to the scan"):
        lattice_along(samples, (*top, 0.0, 0.0, 1.0))


def test_rows_run_along_the_arrow() -> None:
    points = np.random.default_rng(3).uniform(0, 12, (5000, 2))
    angle = np.radians(25.0)
    arrow = (6.0, 6.0, 0.0, np.cos(angle), np.sin(angle), 0.0)
    grid = st.grid_from_points(np.column_stack([points, np.zeros(5000)]), SETTINGS.replace(rows_along=arrow))
    ends = (grid.nodes + grid.origin)[grid.edges]
    inner = (np.abs(ends.mean(axis=1)[:, :2] - 6) < 4).all(axis=1)
    ahead = (ends[:, 1] - ends[:, 0])[inner]
    off = np.degrees(np.arctan2(ahead[:, 1], ahead[:, 0]) - angle)
    assert np.median(np.abs((off + 30) % 60 - 30)) < 3.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rows_along": (1.0, 2.0)}, "six numbers"),
        ({"rows_along": (1, 2, 3, 0, 0, 0)}, "six numbers"),
        ({"rows_along": "x"}, "six numbers"),
        ({"rows_along": (1, 2, 3, 1, 0, 0), "cells": "quad"}, "needs cells triangle"),
    ],
)
def test_an_arrow_that_is_none_is_refused(given: dict[str, object], words: str) -> None:
    with pytest.raises(st.InputError, match=words):
        SETTINGS.replace(**given)


def test_a_mirror_plane_is_drawn_where_it_is(dome: st.PointCloud) -> None:
    frame, normal = SceneFrame.of(dome), np.array([1.0, 2.0, 0.0]) / np.sqrt(5)
    corners = corners_of_plane(frame, np.array([4.5e5, 5.3e6, 2.0, 1.0, 2.0, 0.0]))
    places = frame.from_scene(corners) - [4.5e5, 5.3e6, 2.0]
    assert np.abs(places @ normal).max() < 1e-5 and np.ptp(corners, axis=0).max() < 1.3 * DRAWN_EXTENT


def test_a_mirror_plane_is_dragged_by_its_ends_on_the_scan(dome: st.PointCloud) -> None:
    """The plane stands upright through both places; its ends are where it leaves the scan, on the plane."""
    middle = np.array([4.5e5, 5.3e6, 0.0])
    begin, end = middle + [-3.0, -4.0, 3.3], middle + [3.0, 4.0, 3.3]
    plane = np.array(upright_plane(begin, end))
    assert plane[5] == 0.0 and np.linalg.norm(plane[3:]) == pytest.approx(1.0)
    assert np.abs((np.stack([begin, end, middle]) - plane[:3]) @ plane[3:]).max() < 1e-2
    ends = ends_on(ScannedPoints.of(dome, SETTINGS).places, plane, 1.0)
    assert ends is not None and np.abs((ends - plane[:3]) @ plane[3:]).max() < 1e-6
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(2 * HEIGHT, rel=0.02)
    moved = upright_plane(ends[0], ends[1])
    assert abs(np.dot(moved[3:], plane[3:])) == pytest.approx(1.0, abs=1e-6)
    assert ends_on(ScannedPoints.of(dome, SETTINGS).places, np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), 1.0) is None
    with pytest.raises(st.InputError, match="above each other"):
        upright_plane(middle, middle + [0.0, 0.0, 2.0])


def test_a_painted_length_leaves_the_length_elsewhere_and_no_field_brings_it_back(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.set_length(1.6)
    done(session)
    assert session.cloud is not None
    at = ScannedPoints.of(session.cloud, session.settings).nearest(np.array([2.0, 2.0, 2.0]))
    for length in (0.8, 0.6, 1.2):
        session.paint(painted(session.cloud, session.settings, at, 1.5, length))
        done(session)
        assert session.state.main_length == pytest.approx(1.6) and session.settings.length == length
    session.set_length(1.2)  # the painted one with it
    done(session)
    assert session.settings.length == pytest.approx(0.9) and session.state.main_length == pytest.approx(1.2)
    again = Session()
    again.open(tmp_path / "dome.scantruss")
    assert again.state.main_length == session.state.main_length
    session.unpaint()
    done(session)
    assert session.settings.length == pytest.approx(1.2) and not session.settings.length_field
    assert session.grid is not None and abs(session.grid.lengths.mean() - 1.2) < 0.15
    session.undo()
    assert session.settings.length == pytest.approx(0.9) and session.settings.length_field


def test_a_length_that_the_scan_cannot_have_is_refused_when_it_is_typed(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    before, cloud = session.state, session.cloud
    assert cloud is not None
    for length in (60.0, 0.02):
        with pytest.raises(LengthError) as typed:
            session.set_length(length)
        assert session.state is before
        with pytest.raises(LengthError) as generated:
            grid_from_cloud(cloud, session.settings.replace(length=length))
        assert str(typed.value) == str(generated.value)
