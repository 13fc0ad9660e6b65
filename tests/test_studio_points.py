"""Points in the studio: their own colours and classes, those removed by hand, the tape, and where projects are saved."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from e57_file import Column
from scan_files import axes, e57, pcd
from scipy.spatial.transform import Rotation

import scantruss as st
from scantruss.cli.main import main
from scantruss.scan.formats.own_colors import own_colors
from scantruss.scan.formats.reading import read_points
from scantruss.studio.browsers import Browsers
from scantruss.studio.colours import (
    CLASSES,
    OWN_COLORS,
    colorings_of_scan,
    colors_of,
    colors_of_scan,
    histogram_of,
    marked,
    rgb_of,
)
from scantruss.studio.frame import distance_to_see
from scantruss.studio.outputs import TAKEN, command_of_project, settings_files
from scantruss.studio.pictures import about_z, angle_to_see, facing, over
from scantruss.studio.project import save_project
from scantruss.studio.remove_tool import seen_within
from scantruss.studio.scale import decimals_of, round_ends, set_scale
from scantruss.studio.scene import BARB_WIDTH, barbed, spread
from scantruss.studio.session import Session

RNG = np.random.default_rng(7)
X, Y = (each.ravel() for each in np.meshgrid(np.linspace(0, 9, 40), np.linspace(0, 7, 30)))
P = np.stack([X, Y, 0.2 * np.sin(X)], axis=1)
COLORS = RNG.integers(0, 256, (len(P), 3)).astype(np.uint8)
COLORS[0] = 255


def written_in_color(folder: Path, suffix: str) -> Path:
    """Write the points and their colours in a format, with numbers as its programs write them."""
    path = folder / f"roof{suffix}"
    red, green, blue = COLORS.T.astype(int)
    if suffix == ".las":
        laspy = pytest.importorskip("laspy")
        file = laspy.LasData(laspy.LasHeader(point_format=2, version="1.2"))
        file.header.scales = np.full(3, 1e-4)
        file.x, file.y, file.z = P.T
        file.red, file.green, file.blue = (257 * each for each in (red, green, blue))
        file.classification = (X > 4).astype(np.uint8)
        file.write(path)
    elif suffix == ".e57":
        more = [Column(f"color{name}", each, "integer", low=0, high=255)
                for name, each in zip(("Red", "Green", "Blue"), (red, green, blue), strict=True)]  # fmt: skip
        path.write_bytes(e57(([*axes(P), *more], "")))
    elif suffix == ".pcd":
        packed = (red << 16 | green << 8 | blue).astype(np.uint32).view(np.float32)
        places = [(name, "f8", P[:, k]) for k, name in enumerate("xyz")]
        path.write_bytes(pcd([*places, ("rgb", "f4", packed)], "binary"))
    elif suffix == ".ply":
        head = "".join(f"property float {axis}\n" for axis in "xyz")
        head += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
        rows = "\n".join(f"{x:.9g} {y:.9g} {z:.9g} {r} {g} {b}" for (x, y, z), (r, g, b) in zip(P, COLORS, strict=True))
        path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(P)}\n{head}end_header\n{rows}\n")
    else:
        share = COLORS / 255.0 if suffix == ".csv" else COLORS
        table = np.column_stack([P, *([np.zeros(len(P))] if suffix == ".pts" else []), share])
        np.savetxt(path, table, "%.9g", "," if suffix == ".csv" else " ",
                   header="x,y,z,R,G,B" if suffix == ".csv" else str(len(P)), comments="")  # fmt: skip
    return path


def opened(path: Path, project: Path | None = None) -> Session:
    """Open a scan, without a quick grid after each step: it is not looked at."""
    session = Session(project, folder=path.parent)
    session.open(path)
    session.show_quick = lambda: False  # type: ignore[method-assign]
    return session


@pytest.mark.parametrize("suffix", [".las", ".ply", ".pcd", ".e57", ".csv", ".pts"])
def test_a_scan_has_its_own_colours(suffix: str, tmp_path: Path) -> None:
    session = opened(written_in_color(tmp_path, suffix))
    assert colorings_of_scan(session.state)[0] == OWN_COLORS
    found, legend = colors_of_scan(session.state, np.arange(len(P)), OWN_COLORS)
    assert np.array_equal(found, COLORS) and legend is None
    session.crop(("box:2,1,7,6",))
    kept = (X >= 2) & (X <= 7) & (Y >= 1) & (Y <= 6)
    assert session.cloud is not None and len(session.cloud.points) == kept.sum()
    assert np.array_equal(colors_of_scan(session.state, np.arange(kept.sum()), OWN_COLORS)[0], COLORS[kept])


def test_a_scan_without_colours_has_none(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.xyz", P)
    assert OWN_COLORS not in colorings_of_scan(opened(tmp_path / "a.xyz").state)
    assert own_colors({}) is None
    assert own_colors(dict.fromkeys(("red", "green", "blue"), np.zeros(9))) is None  # nobody has measured black alone


def test_classes_are_coloured_and_named(tmp_path: Path) -> None:
    session = opened(written_in_color(tmp_path, ".las"))
    colors, legend = colors_of_scan(session.state, np.arange(len(P)), CLASSES)
    assert len(np.unique(colors, axis=0)) == 2 and legend is not None
    assert [words for _, words in legend.marks if words == "1 unclassified"] and "1 unclassified" in legend.html()
    assert len(np.unique(colors[X > 4.01], axis=0)) == 1


def test_points_removed_by_hand_stay_away_and_come_back(tmp_path: Path) -> None:
    place = tmp_path / "roof.scantruss"
    session = opened(written_in_color(tmp_path, ".ply"), place)
    with pytest.raises(st.InputError, match="no points are marked"):
        session.remove_points(np.zeros(len(P), np.bool_))
    session.remove_points(X < 2)
    session.crop(("box:0,0,9,5",))
    cloud = session.cloud
    assert cloud is not None
    session.remove_points(cloud.points[:, 0] + cloud.origin[0] > 8)
    kept = (X >= 2) & (X <= 8) & (Y <= 5)
    assert np.array_equal(session.state.taken(), kept)
    again = Session()
    again.open(place)
    assert again.cloud is not None and session.cloud is not None
    assert np.array_equal(again.cloud.points, session.cloud.points) and np.array_equal(again.state.taken(), kept)
    assert np.array_equal(colors_of_scan(again.state, np.arange(kept.sum()), OWN_COLORS)[0], COLORS[kept])
    (tmp_path / TAKEN).write_bytes(settings_files(session.state)[TAKEN])
    assert f"grid {TAKEN}" in command_of_project(session.state)  # no option removes them: the points go along
    read = read_points(tmp_path / TAKEN)
    assert np.array_equal(read.points, session.cloud.points) and np.array_equal(read.origin, session.cloud.origin)
    session.undo()
    assert session.state.taken().sum() == ((X >= 2) & (Y <= 5)).sum()
    session.restore_points()
    assert session.state.taken().sum() == (Y <= 5).sum()


def test_a_rectangle_holds_what_the_camera_sees_in_it() -> None:
    position, target, fov, aspect = np.array([6.0, -9.0, 7.0]), np.zeros(3), 0.7, 1.6
    camera = SimpleNamespace(wxyz=facing(position, target), position=position, fov=fov, aspect=aspect)
    places = RNG.uniform(-4, 4, (500, 3))
    ends = np.array([[0.3, 0.25], [0.8, 0.6]])
    ahead = (target - position) / np.linalg.norm(target - position)
    right = np.cross(ahead, [0, 0, 1]) / np.linalg.norm(np.cross(ahead, [0, 0, 1]))
    down = np.cross(ahead, right)
    for place, is_inside in zip(places, seen_within(places, camera, ends), strict=True):  # the pinhole, written out
        depth = (place - position) @ ahead
        x = 0.5 + (place - position) @ right / depth / (2 * np.tan(fov / 2) * aspect)
        y = 0.5 + (place - position) @ down / depth / (2 * np.tan(fov / 2))
        assert is_inside == (0.3 <= x <= 0.8 and 0.25 <= y <= 0.6)


def test_the_tape_is_a_step_and_part_of_the_project(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.xyz", P)
    session = opened(tmp_path / "a.xyz", tmp_path / "a.scantruss")
    ends = ((0.0, 0.0, 0.0), (3.0, 4.0, 0.0))
    session.measure(ends)
    again = Session()
    again.open(tmp_path / "a.scantruss")
    assert again.state.tape == ends
    session.measure(())
    counts = []
    for _ in range(2):
        session.undo()
        counts.append(len(session.state.tape))
    assert counts == [2, 0] and session.history.words[1] == "tape"


def test_each_scan_that_is_opened_has_a_project_of_its_own(tmp_path: Path) -> None:
    for name in "ab":
        np.savetxt(tmp_path / f"{name}.xyz", P + (name == "b"))
    session = opened(tmp_path / "a.xyz", tmp_path / "a.scantruss")
    session.set_unit("m")
    first = (tmp_path / "a.scantruss").read_bytes()
    session.open_path("b.xyz")
    assert session.worker.wait(120) and session.place == tmp_path / "b.scantruss" and session.place.exists()
    assert (tmp_path / "a.scantruss").read_bytes() == first
    session.undo()
    assert session.place == tmp_path / "a.scantruss" and session.settings.unit == "m"
    session.open_path("a.scantruss")
    assert session.worker.wait(120) and session.place == tmp_path / "a.scantruss" and session.settings.unit == "m"


def test_a_project_that_another_browser_has_open_is_opened_as_a_copy(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.xyz", P)
    browsers = Browsers(opened(tmp_path / "a.xyz", tmp_path / "a.scantruss"))
    (_, first), (_, second) = browsers.join(None), browsers.join(None)
    first.set_unit("m")
    second.open_path("a.scantruss")
    assert second.worker.wait(120) and second.settings.unit == "m"
    assert first.place == tmp_path / "a.scantruss" and second.place not in (None, first.place)
    browsers.stop()


def test_a_new_browser_has_the_first_scan_under_its_own_name(tmp_path: Path) -> None:
    for name in ("a.xyz", "b.xyz"):
        np.savetxt(tmp_path / name, P)
    browsers = Browsers(opened(tmp_path / "a.xyz", tmp_path / "a.scantruss"))
    _, first = browsers.join(None)
    first.open_path("b.xyz")
    assert first.worker.wait(120) and first.place == tmp_path / "b.scantruss"
    _, second = browsers.join(None)
    assert second.cloud is not None and second.cloud.name == "a.xyz"
    assert second.place == tmp_path / "a-2.scantruss"
    browsers.stop()


@pytest.mark.parametrize("name", ["../out.xyz", "/etc/passwd", "none.xyz", "inner/../../out.xyz", ""])
def test_a_path_of_another_folder_is_refused(name: str, tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    np.savetxt(tmp_path / "out.xyz", P)
    np.savetxt(home / "a.xyz", P)
    session = opened(home / "a.xyz")
    with pytest.raises(st.InputError):
        session.open_path(name)
    (home / "link.xyz").symlink_to(tmp_path / "out.xyz")
    with pytest.raises(st.InputError, match="only files within"):
        session.open_path("link.xyz")


def test_a_project_whose_cleaning_named_the_taken_points_still_opens(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As projects of format 3 did."""
    far = np.concatenate([P, [[4.0, 3.0, 9.0]]])
    np.savetxt(tmp_path / "a.xyz", far)
    session = opened(tmp_path / "a.xyz")
    session.crop(("box:2,0,9,7",))
    session.propose_cleaning(3.0, 0.005)
    assert session.worker.wait(120)
    session.clean()
    taken, cleaning = session.state.taken(), session.state.cleaning
    assert cleaning is not None and not taken[-1] and cleaning.removes.sum() == 1
    chosen = far[:, 0] >= 2
    monkeypatch.setattr("scantruss.studio.project.PROJECT_VERSION", 3)
    object.__setattr__(cleaning, "removes", cleaning.removes[chosen])
    save_project(tmp_path / "old.scantruss", session.state)
    again = Session()
    again.open(tmp_path / "old.scantruss")
    assert np.array_equal(again.state.taken(), taken)


def test_a_crop_keeps_the_cleaning_and_the_command_line_does_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    far = np.concatenate([P, [[4.0, 3.0, 9.0]]])
    np.savetxt(tmp_path / "a.xyz", far)
    session = opened(tmp_path / "a.xyz", tmp_path / "a.scantruss")
    session.propose_cleaning(3.0, 0.005)
    assert session.worker.wait(120)
    session.clean()
    box = "box:2,1,-1,7,6,10"
    session.crop((box,))
    inside = (X >= 2) & (X <= 7) & (Y >= 1) & (Y <= 6)
    cloud = session.cloud
    assert cloud is not None and len(cloud.points) == inside.sum()  # the outlier above stays away
    assert session.state.cropped_off().sum() == (~inside).sum()
    again = Session()
    again.open(tmp_path / "a.scantruss")
    assert again.state.cleaning is not None and again.state.cleaning.crop == ()
    clean = command_of_project(session.state).splitlines()[0]
    assert "--crop" not in clean and box not in clean
    settings = json.loads(settings_files(session.state)["settings.json"])
    monkeypatch.chdir(tmp_path)
    assert main(clean.split()[1:]) == 0
    read = read_points("clean.ply", selection=st.Settings.from_dict(settings).selection)
    assert np.allclose(read.points + read.origin, cloud.points + cloud.origin, atol=1e-9)
    session.undo()
    session.undo()
    session.crop((box,))
    session.propose_cleaning(3.0, 0.005)
    assert session.worker.wait(120)
    session.clean()
    session.crop((box, "box:3,1,-1,7,6,10"))
    assert session.state.cleaning is not None and session.state.whole is not None  # what is left was looked at
    session.crop(())
    assert session.history.words[0] == "no crop, not cleaned" and session.cloud is session.state.whole.cloud


def test_the_first_view_shows_all_of_a_scan_and_little_more() -> None:
    rng, back = np.random.default_rng(3), np.array([0.8, -1.4, 0.9])
    for aspect in (0.4, 1.0, 1.8):
        points = rng.uniform(-1, 1, (200, 3)) * rng.uniform(0.5, 5.0, 3)
        place = distance_to_see(points, back, 0.65, aspect) * back / np.linalg.norm(back)
        w, x, y, z = facing(place, np.zeros(3))
        seen = (points - place) @ Rotation.from_quat([x, y, z, w]).as_matrix()
        edge = (np.abs(seen[:, :2]) / seen[:, 2:] / [np.tan(0.325) * aspect, np.tan(0.325)]).max()
        assert edge == pytest.approx(1.0, rel=1e-6)


def test_what_is_drawn_of_loads() -> None:
    places, along = RNG.uniform(-5, 5, (40, 3)), RNG.normal(size=(40, 3))
    segments = barbed(places, along).reshape(40, 5, 2, 3)
    assert np.allclose(segments[:, :, 1], places[:, None])  # all end at the tip
    assert np.allclose(segments[:, 0, 0], places - along)
    back = places[:, None] - segments[:, 1:, 0]
    ahead = along / np.linalg.norm(along, axis=1)[:, None]
    off = np.linalg.norm(back - (back @ ahead[:, :, None]) * ahead[:, None], axis=2)
    assert np.allclose(off, BARB_WIDTH)
    taken = spread(places, 10)
    gaps = np.linalg.norm(places[taken][:, None] - places[taken], axis=2) + 99 * np.eye(10)
    rest = np.linalg.norm(places[:, None] - places[taken], axis=2).min(axis=1)
    assert len(set(taken.tolist())) == 10 and gaps.min() >= rest.max()  # farthest first: none is left farther off
    assert np.array_equal(spread(places[:3], 10), [0, 1, 2])


def test_a_picture_lies_over_its_background() -> None:
    pixels = np.zeros((2, 3, 4), np.uint8)
    pixels[0, 0] = (10, 20, 30, 255)
    pixels[1, 1] = (200, 0, 0, 127)
    seen = over(pixels, np.array((255, 255, 255), np.uint8))
    assert tuple(seen[0, 0]) == (10, 20, 30) and tuple(seen[0, 1]) == (255, 255, 255)
    assert 225 < seen[1, 1, 0] < 230 and 126 < seen[1, 1, 1] < 130


@pytest.mark.parametrize(("low", "high"), [(0.7685, 1.255), (0.000917, 0.04773), (-17.85, 1.556), (6, 6), (3, 7)])
def test_the_ends_of_a_slider_are_round(low: float, high: float) -> None:
    begin, end, step = round_ends(low, high)
    assert begin <= low and high <= end <= high + 1.01 * step and len(f"{end:g}") <= 7
    assert low == high or 90 < (high - low) / step < 1010


def test_a_scale_with_given_ends_and_colours_beyond_it() -> None:
    values = np.array([0.2, 0.7, 1.0, 4.0])
    colors, low, high = colors_of(values, None, (0.2, 1.0))
    assert (low, high) == (0.2, 1.0) and np.array_equal(colors[2], colors[3])
    assert rgb_of("#d81e2c") == (216, 30, 44)


def test_a_turntable_shows_all_of_the_scan_and_little_more() -> None:
    rng = np.random.default_rng(4)
    points = rng.uniform(-1, 1, (500, 3)) * [5.0, 3.0, 1.5]
    target, aspect = np.zeros(3), 16 / 9
    places = np.array([about_z(turn) @ [8.0, -14.0, 9.0] for turn in np.linspace(0, 2 * np.pi, 36, endpoint=False)])
    half = np.tan(angle_to_see(points, places, target, aspect) / 2)
    most = []
    for place in places:
        w, x, y, z = facing(place, target)
        seen = (points - place) @ Rotation.from_quat([x, y, z, w]).as_matrix()  # x right, y down, z ahead
        most.append((np.abs(seen[:, :2]) / seen[:, 2:] / [half * aspect, half]).max())
    assert max(most) == pytest.approx(1 / 1.1, rel=1e-6)
    assert angle_to_see(points, np.array([[0.5, 0.0, 0.0]]), target, aspect) == np.pi


def test_bars_stand_for_the_values_that_they_hold() -> None:
    values = np.array([1.0, 2.0, 2.0, 2.4, 3.0, np.nan, 9.0])
    html = histogram_of(values, 1.0, 9.0, lambda middles: colors_of(middles, None, (1.0, 9.0))[0], (2.0, 3.0))
    bars = re.findall(r'title="(\d+)" data-field="between" data-low="(\S+)" data-high="(\S+)".*?opacity:([\d.]+)', html)
    held = [(int(count), float(low), float(high)) for count, low, high, _ in bars if int(count)]
    assert held == [(1, 1.0, 1.0), (2, 2.0, 2.0), (1, 2.4, 2.4), (1, 3.0, 3.0), (1, 9.0, 9.0)]
    clear = [float(low) for count, low, _, opacity in bars if int(count) and opacity == "1"]
    assert clear == [2.0, 2.4, 3.0]
    red = histogram_of(values, 1.0, 9.0, lambda middles: marked(colors_of(middles, None)[0], middles, 3.0, "#d81e2c"))
    assert red.count("background:rgb(216,30,44)") == 18  # of 24 bars those above 3


def test_a_slider_has_as_many_decimals_as_its_step_needs() -> None:
    assert [decimals_of(step) for step in (100.0, 1.0, 0.5, 0.02, 0.001, 3e-7)] == [0, 0, 1, 2, 3, 7]
    slider = SimpleNamespace(
        min=0.5, max=2.0, step=0.01, precision=2
    )  # of lengths of metres, before a small scan is opened
    set_scale(slider, 0.0133, 0.12, 0.001)
    assert round(0.041, slider.precision) == 0.041 and (slider.min, slider.max, slider.step) == (0.0133, 0.12, 0.001)
