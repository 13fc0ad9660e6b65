"""The studio without a browser: steps taken back, browsers apart, holes and ridges switched, what lies under a click, colours."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import scantruss as st
from scantruss.studio.browsers import MOST_BROWSERS, Browsers
from scantruss.studio.certificate_list import merged
from scantruss.studio.compare import comparison, deviation
from scantruss.studio.features import HOLES, RIDGES, features_to_switch, switched_off
from scantruss.studio.frame import SceneFrame, SectionPlane
from scantruss.studio.outputs import project_file, settings_files
from scantruss.studio.picking import nearest_member, nearest_panel, pick
from scantruss.studio.scene import Scene, drawn_as_rods, turns_from_z
from scantruss.studio.session import Session
from scantruss.studio.tone import seen, to_be_seen

PATIENCE = 120.0


def pierced_roof() -> np.ndarray:
    """Return the points of a gable roof over 16 by 12 with a round hole of radius 2 in one side."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-8, 8, 110), np.linspace(-6, 6, 90)))
    kept = np.hypot(x - 4.2, y) > 2.0
    return np.stack([x[kept] + 5000.0, y[kept], 6 - 0.8 * np.abs(x[kept])], axis=1)


@pytest.fixture
def roof(tmp_path: Path) -> Session:
    """Open the roof, its length set."""
    np.savetxt(tmp_path / "roof.xyz", pierced_roof(), fmt="%.5f")
    session = Session(tmp_path / "roof.scantruss")
    session.open(tmp_path / "roof.xyz")
    session.change("length", settings=session.settings.replace(length=1.2, effort="quick"))
    return session


def done(session: Session) -> Session:
    """Wait until nothing runs."""
    assert session.worker.wait(PATIENCE) and session.message == ""
    return session


def test_holes_and_ridges_are_switched_one_by_one_and_the_grid_follows(roof: Session) -> None:
    roof.wants_features = True
    roof.generate()
    first = done(roof).grid
    assert first is not None and [line.name for line in first.line_sets] == ["ridge 1"]
    assert first.topology.boundary_loops == 2
    kinds = [each.kind for each in roof.features]
    assert sorted(kinds) == sorted([HOLES, RIDGES])
    for kind in (HOLES, RIDGES):
        roof.switch(kinds.index(kind))
        done(roof)
    plain = roof.grid
    assert plain is not None and plain.line_sets == () and plain.topology.boundary_loops == 1
    assert set(switched_off(roof.features, roof.settings)) == {0, 1}
    assert roof.cloud is not None
    for length in (0.9, 1.6):  # the places name the same hole and ridge at other lengths
        other = roof.settings.replace(length=length)
        assert set(switched_off(features_to_switch(roof.cloud, other), other)) == {0, 1}
    for _ in range(2):
        roof.undo()
    assert roof.grid is first and roof.settings.fill_at == () == roof.settings.no_ridge_at


@pytest.mark.parametrize(
    ("place", "words"), [((0.0, -6.0, 6.0), "outer boundary"), ((0.0, 0.0, 60.0), "not at the scan")]
)
def test_a_place_without_a_hole_is_refused(place: tuple[float, float, float], words: str) -> None:
    settings = st.Settings(length=1.2, effort="quick", fill_at=(place,))
    with pytest.raises(st.InputError, match=words):
        st.grid_from_points(pierced_roof() - [5000.0, 0.0, 0.0], settings)


def test_undo_and_redo_go_the_same_way_back_and_forth(roof: Session) -> None:
    states = [roof.state]
    roof.fix(((5000.0, 0.0, 6.0),))
    done(roof)
    states.append(roof.state)
    roof.set_structure(section="CHS60.3x4")
    states.append(roof.state)
    roof.keep_design("A")
    states.append(roof.state)
    for earlier in states[-2::-1]:
        roof.undo()
        assert roof.settings == earlier.settings and roof.grid is earlier.grid
        assert roof.state.structure_settings == earlier.structure_settings and roof.state.designs == earlier.designs
    for later in states[1:]:
        roof.redo()
        assert roof.state is later
    roof.redo()  # there is nothing more
    assert roof.state is states[-1]
    roof.undo()
    roof.set_structure(section="CHS76.1x4")
    assert roof.history.words[1] == ""  # a new step ends what could be done again


def test_a_slider_that_moves_is_one_step(roof: Session) -> None:
    for length in (1.3, 1.4, 1.5):
        roof.live(length)
    done(roof)
    roof.undo()
    assert roof.settings.length == 1.2


def test_a_project_holds_all_of_it(roof: Session, tmp_path: Path) -> None:
    roof.set_unit("m")
    roof.fix(((5000.0, 0.0, 6.0),))
    done(roof)
    roof.keep_design("first & best")
    roof.set("length", length=1.5)
    done(roof).run_structure()
    done(roof)
    assert roof.place is not None
    again = Session()
    again.open(roof.place)
    for name in ("settings", "asked", "is_live", "structure_settings"):
        assert getattr(again.state, name) == getattr(roof.state, name)
    assert again.solution is not None and again.state.designs[0].name == "first & best"
    assert np.array_equal(again.state.designs[0].grid.nodes, roof.state.designs[0].grid.nodes)
    assert project_file(again.state, roof.place) == project_file(roof.state, roof.place)
    assert project_file(roof.state, roof.place)[roof.place.name] == roof.place.read_bytes()
    assert "first &amp; best" in comparison(list(roof.state.designs))
    uploaded = Session(folder=tmp_path)
    uploaded.open_upload("../roof.scantruss", roof.place.read_bytes())
    done(uploaded)
    assert uploaded.place == tmp_path / "roof-2.scantruss" and uploaded.settings == roof.settings
    (tmp_path / "out").mkdir()
    for name, content in settings_files(roof.state).items():
        (tmp_path / "out" / name).write_bytes(content)
    assert st.Settings.read(tmp_path / "out" / "settings.json") == roof.state.asked


def test_two_browsers_do_not_mix(roof: Session) -> None:
    browsers = Browsers(roof)
    one, first = browsers.join(None)
    two, second = browsers.join(None)
    assert first is roof and second is not roof and one != two and second.cloud is roof.cloud
    assert {first.place, second.place} == {roof.place, roof.place and roof.place.with_name("roof-2.scantruss")}
    second.set("length", length=2.0)
    done(second)
    assert roof.settings.length == 1.2
    assert browsers.join(two) == (two, second)  # another page of the same browser
    assert browsers.join("guessed")[1] not in (first, second)
    browsers.leave(one)
    three, third = browsers.join(None)
    assert third is roof  # nobody had it open
    assert browsers.join(one)[1] is not roof and three != one  # it is that of another browser now


def test_too_many_browsers_are_refused() -> None:
    browsers = Browsers(Session())
    for _ in range(MOST_BROWSERS):
        browsers.join(None)
    with pytest.raises(st.InputError, match="close one"):
        browsers.join(None)


def test_the_bundled_examples_open(tmp_path: Path) -> None:
    session = Session(folder=tmp_path)
    session.open_example("bust")
    done(session)
    assert session.grid is not None and session.grid.unit == "mm" and session.state.is_live
    assert session.place == tmp_path / "nefertiti.scantruss" and session.place.exists()


def test_what_a_ray_hits_is_what_a_slow_look_finds() -> None:
    rng = np.random.default_rng(1)
    nodes = rng.uniform(-1, 1, (40, 3)) + [0.0, 0.0, 5.0]
    panels = np.array([rng.choice(40, 3, replace=False) for _ in range(30)])
    members = np.array([rng.choice(40, 2, replace=False) for _ in range(30)])
    eye = np.zeros(3)
    for _ in range(60):
        ahead = rng.uniform(-0.15, 0.15, 3) + [0.0, 0.0, 1.0]
        ahead /= np.linalg.norm(ahead)
        depths = []
        for a, b, c in nodes[panels]:
            depth, *shares = np.linalg.solve(np.stack([ahead, a - b, a - c], axis=1), a - eye)
            depths.append(depth if min(shares) >= 0 and sum(shares) <= 1 and depth > 0 else np.inf)
        hit = nearest_panel(nodes[panels], eye, ahead)
        assert (hit is None) == np.isinf(min(depths))
        if hit is not None:
            assert hit[0] == int(np.argmin(depths)) and hit[1] == pytest.approx(min(depths))
        angles = []
        for a, b in nodes[members]:
            along = a + np.linspace(0, 1, 2001)[:, None] * (b - a)
            off = np.linalg.norm(along - (along @ ahead)[:, None] * ahead, axis=1) / (along @ ahead)
            angles.append(float(off.min()))
        found = nearest_member(nodes[members], eye, ahead)
        assert found is None or angles[found[0]] < 0.013
        assert found is not None or min(angles) > 0.0115
    for number in range(5):
        at = nodes[number] / np.linalg.norm(nodes[number])
        assert pick(nodes, members[:0], panels[:0], eye, at) is not None
    assert pick(nodes, members[:0], panels[:0], eye, np.array([0.0, 0.0, -1.0])) is None


def test_pins_that_would_lie_on_each_other_are_one_with_all_their_numbers() -> None:
    places = np.array([[0, 0, 0], [5, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1], [5, 0.2, 0], [9, 9, 9]], float)
    found = merged(places)
    assert [words for words, _ in found] == ["1, 3, 4 +1", "2, 6", "7"]
    assert np.allclose(found[0][1], places[[0, 2, 3, 4]].mean(axis=0)) and np.allclose(found[2][1], places[6])


def test_what_panels_hide_is_not_picked() -> None:
    nodes = np.array([[-1, -1, 2], [1, -1, 2], [0, 1, 2], [0, 0, 4]], float)
    none = np.zeros((0, 2), int)
    ahead = np.array([0.0, 0.0, 1.0])
    assert pick(nodes, none, np.array([[0, 1, 2]]), np.zeros(3), ahead) == ("panels", 0)
    assert pick(nodes, none, np.zeros((0, 3), int), np.zeros(3), ahead) == ("nodes", 3)


def test_the_frame_and_back_is_nothing_and_a_section_cuts_at_its_plane() -> None:
    cloud = st.PointCloud.from_array(pierced_roof())
    frame = SceneFrame.of(cloud)
    places = cloud.points[:50] + cloud.origin
    assert np.allclose(frame.from_scene(frame.to_scene(places)), places, atol=1e-5)
    ends = frame.to_scene(cloud.points[:600] + cloud.origin).reshape(-1, 2, 3)
    clipped, kept = SectionPlane(0, -2.5).clipped(ends)
    assert clipped[:, :, 0].max() <= -2.5 + 1e-5
    inside = np.logical_and(*(ends[:, :, 0] <= -2.5).T)
    assert np.array_equal(clipped[inside[kept]], ends[inside])
    assert set(np.flatnonzero(~inside & (ends[:, :, 0] <= -2.5).any(axis=1))) <= set(kept.tolist())


def test_lines_are_seen_in_the_colours_of_the_legend() -> None:
    from scantruss.studio.colours import DIMMED_COLOUR, DIVERGING_COLOURS, PLAIN_COLOUR, RISING_COLOURS, ramp

    shares = np.linspace(0, 1, 60)
    wanted = np.concatenate(
        [ramp(shares, RISING_COLOURS), ramp(shares, DIVERGING_COLOURS), PLAIN_COLOUR[None], DIMMED_COLOUR[None]]
    )
    assert np.abs(seen(to_be_seen(wanted)) - wanted).max() < 8
    measured = np.array([[139, 204, 201]])  # of a line in Chromium, drawn in (33, 145, 140)
    assert np.abs(seen(np.array([[33, 145, 140]])) - measured).max() < 1


def test_tubes_turn_from_z_to_their_members() -> None:
    ahead = np.random.default_rng(2).normal(size=(50, 3))
    ahead = np.concatenate([ahead / np.linalg.norm(ahead, axis=1)[:, None], [[0, 0, 1.0]], [[0, 0, -1.0]]])
    w, x, y, z = turns_from_z(ahead).T
    turned = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)], axis=1)
    assert np.allclose(turned, ahead, atol=1e-6)


@pytest.mark.parametrize("sides", [3, 8])
def test_a_tube_lies_around_its_member_and_is_closed_around(sides: int) -> None:
    drawn = dict[str, Any]()

    def draw(name: str, corners: np.ndarray, faces: np.ndarray, *others: Any, **more: Any) -> None:
        drawn[name] = corners, faces

    api = SimpleNamespace(
        add_batched_meshes_simple=draw,
        set_up_direction=lambda way: None,
        configure_environment_map=lambda *_, **__: None,
        configure_default_lights=lambda *_, **__: None,
        add_light_ambient=lambda *_, **__: None,
        set_background_image=lambda _: None,
        remove_by_name=lambda _: None,
    )
    ends = np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]])
    Scene(api).tubes("/tubes", ends, np.zeros((1, 3), np.uint8), 0.1, sides)
    corners, faces = drawn["/tubes"]
    assert np.hypot(corners[:, 0], corners[:, 1]) == pytest.approx(1.0) and set(corners[:, 2].tolist()) == {0.0, 1.0}
    a, b, c = corners[faces.astype(int)].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert area == pytest.approx(2 * sides * np.sin(np.pi / sides))  # of all sides, none twice
    assert (np.einsum("tc,tc->t", np.cross(b - a, c - a), (a + b + c) * [1, 1, 0]) > 0).all()  # seen from outside


def test_layers_are_seen_as_rods_where_there_are_too_many_members_for_lines() -> None:
    layered: Any = SimpleNamespace(truss=SimpleNamespace(layers=np.zeros(3)))
    single: Any = SimpleNamespace(truss=SimpleNamespace(layers=None))
    rods = [drawn_as_rods(layered, number) for number in (4_000, 4_001, 20_000, 20_001)]
    assert rods == [False, True, True, False] and not drawn_as_rods(single, 9_000)


def test_a_grid_does_not_differ_from_itself(roof: Session) -> None:
    roof.generate()
    grid = done(roof).grid
    assert grid is not None and deviation(grid, grid).max() < 1e-9
    lifted = grid.replace(nodes=grid.nodes + [0.0, 0.0, 0.1])
    assert 0.05 < deviation(lifted, grid).max() <= 0.1 + 1e-9


def test_a_fixed_node_off_the_scan_is_not_taken_and_blocks_no_other(roof: Session) -> None:
    with pytest.raises(st.InputError, match="away from the scan; it must lie within half a member"):
        roof.fix(((0.0, 0.0, 0.0),))
    assert len(roof.settings.fixed) == 0
    roof.fix(((4997.0, 1.0, 3.6),))
    assert len(done(roof).settings.fixed) == 1


def test_a_kept_design_is_taken_as_the_present_one(roof: Session, tmp_path: Path) -> None:
    roof.generate()
    done(roof)
    first, asked = roof.grid, roof.settings
    roof.keep_design("A")
    roof.set_length(1.6)
    done(roof)
    roof.generate()
    done(roof)
    second = roof.grid
    assert first is not None and second is not None and len(second.nodes) < len(first.nodes)
    roof.keep_design("B")
    again = Session()
    again.open(tmp_path / "roof.scantruss")
    for session in (roof, again):
        session.take_design("A")
        assert session.grid is not None and np.array_equal(session.grid.nodes, first.nodes)
        assert session.settings == asked and not session.state.is_stale and not session.state.is_live
        session.undo()
        assert session.grid is not None and np.array_equal(session.grid.nodes, second.nodes)
    with pytest.raises(st.InputError, match="no design is chosen"):
        roof.take_design("C")
    roof.crop(("box:4993,-6,5008,6",))
    done(roof)
    with pytest.raises(st.InputError, match="A was made of another scan or of another part"):
        roof.take_design("A")
