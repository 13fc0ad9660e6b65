"""What the studio takes of a scan: the same points as the command line does."""

import contextlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from studio_view import view_of

import scantruss as st
from scantruss.cli.main import main
from scantruss.scan.formats.reading import read_points
from scantruss.selection import Selection, polygon_text
from scantruss.studio.crop_tool import check_rings, crosses_itself
from scantruss.studio.frame import SceneFrame
from scantruss.studio.outputs import TAKEN, command_of_project, settings_files
from scantruss.studio.scan_parts import UP_AXES
from scantruss.studio.session import Session
from scantruss.studio.state import StudioState
from scantruss.studio.view import StudioView

PATIENCE = 120.0


def waves() -> np.ndarray:
    """Return the points of a wavy roof of 20 by 12 at national coordinates, and a few far above it."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 20, 81), np.linspace(0, 12, 49)))
    roof = np.stack([x, y, np.sin(x / 4) + 0.03 * y + 0.01 * x], axis=1)
    above = np.stack([np.linspace(3, 17, 8), np.full(8, 6.0), np.full(8, 9.0)], axis=1)
    return np.concatenate([roof, above]) + [4.5e5, 5.3e6, 100.0]


@pytest.fixture(scope="module")
def las(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Save the roof with two classes: east and west."""
    laspy = pytest.importorskip("laspy")
    place = tmp_path_factory.mktemp("scan") / "roof.las"
    points = waves()
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.scales, header.offsets = np.full(3, 0.001), np.floor(points.min(axis=0))
    file = laspy.LasData(header)
    file.x, file.y, file.z = points.T
    file.classification = np.where(points[:, 0] < 4.5e5 + 10.2, 2, 6).astype(np.uint8)
    file.write(place)
    return place


def opened(place: Path, project: Path) -> Session:
    """Open a scan, without a quick grid after each step: it is not looked at."""
    session = Session(project)
    session.open(place)
    session.show_quick = lambda: False  # type: ignore[method-assign]
    return session


def test_a_crop_and_classes_take_what_reading_takes(las: Path, tmp_path: Path) -> None:
    session = opened(las, tmp_path / "roof.scantruss")
    whole = session.cloud
    assert whole is not None and session.state.whole is not None and session.state.whole.held_classes == (2, 6)
    crop = ("polygon:450003,5300001,450018,5300001,450018,5300011,450003,5300008",)
    for classes, crops in (((6,), ()), ((), crop), ((2,), crop)):
        session.choose_classes(classes)
        session.crop(crops)
        read = read_points(las, selection=Selection(classes=classes, crop=crops))
        assert session.cloud is not None
        assert np.array_equal(session.cloud.points, read.points) and np.array_equal(session.cloud.origin, read.origin)
        again = Session()
        again.open(tmp_path / "roof.scantruss")
        assert again.cloud is not None and np.array_equal(again.cloud.points, read.points)
        assert again.state.whole is not None and len(again.state.whole.cloud.points) == len(whole.points)
    with pytest.raises(st.InputError, match=r"no point of .*roof\.las is left"):
        session.crop(("box:0,0,1,1",))
    session.crop(())
    session.choose_classes((2, 6))
    assert session.cloud is whole and not session.settings.classes and not session.settings.crop
    session.undo()
    assert session.settings.classes == (2,)


def test_what_is_red_goes_and_the_command_line_does_the_same(
    las: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = opened(las, tmp_path / "roof.scantruss")
    with pytest.raises(st.InputError, match="Show what goes"):
        session.clean()
    session.crop(("box:450000,5300000,450019,5300012",))
    before = session.cloud
    assert before is not None
    session.propose_cleaning(3.0, 0.005)
    assert session.worker.wait(PATIENCE) and session.message == ""
    found = session.proposed()
    assert found is not None and session.cloud is before
    session.propose_cleaning(0.0, 0.0)
    assert session.worker.wait(PATIENCE)
    with pytest.raises(st.InputError, match="nothing is red"):
        session.clean()
    assert session.cloud is before
    session.propose_cleaning(3.0, 0.005)
    assert session.worker.wait(PATIENCE)
    high = before.points[:, 2] + before.origin[2] > 105
    assert found.removes[high].all() and found.removes.sum() == high.sum() == 8
    session.clean()
    cleaned = session.cloud
    assert cleaned is not None and len(cleaned.points) == len(before.points) - 8 and session.proposed() is None
    again = Session()
    again.open(tmp_path / "roof.scantruss")
    assert again.cloud is not None and np.array_equal(again.cloud.points, cleaned.points)
    clean, grid, _ = command_of_project(session.state).splitlines()
    assert clean.startswith("scantruss clean roof.las clean.ply --crop box:450000") and "grid clean.ply" in grid
    monkeypatch.chdir(tmp_path)
    Path("roof.las").write_bytes(las.read_bytes())
    assert main(clean.split()[1:]) == 0
    read = read_points("clean.ply")
    assert np.allclose(read.points + read.origin, cleaned.points + cleaned.origin, atol=1e-9)
    with pytest.raises(st.InputError, match="cleaned already"):
        session.propose_cleaning(3.0, 0.005)
        assert session.worker.wait(PATIENCE)
        session.clean()
    session.crop(())  # begins anew
    assert session.state.cleaning is None and session.state.whole is not None
    assert session.cloud is session.state.whole.cloud


@pytest.mark.parametrize(
    ("corners", "crosses"),
    [
        ([(0, 0), (2, 0), (2, 2), (0, 2)], False),
        ([(0, 0), (2, 2), (2, 0), (0, 2)], True),
        ([(0, 0), (4, 0), (4, 3), (1, 3), (1, 2), (3, 2), (3, 1), (0, 1)], False),  # a hook
        ([(0, 0), (4, 0), (4, 3), (1, 3), (1, -1)], True),
        ([(0, 0), (1, 0), (0, 1)], False),
    ],
)
def test_a_polygon_that_crosses_itself_is_told_from_others(corners: list[tuple[float, float]], crosses: bool) -> None:
    assert crosses_itself(corners, closed=True) == crosses
    assert crosses_itself(corners[::-1], closed=True) == crosses
    assert not crosses_itself(corners[:3], closed=False)
    if crosses:
        with pytest.raises(st.InputError, match="crosses itself"):
            check_rings(polygon_text([corners]))
    else:
        check_rings(polygon_text([corners]))


def test_a_scan_is_turned_to_stand_on_any_axis_of_its_file_and_back(las: Path, tmp_path: Path) -> None:
    session = opened(las, tmp_path / "roof.scantruss")
    assert session.cloud is not None
    before = session.cloud.points + session.cloud.origin
    session.fix((tuple(before[1000].tolist()),))
    session.measure((tuple(before[0].tolist()), tuple(before[1].tolist())))
    for up, axes in UP_AXES.items():
        session.turn(up)
        after = session.cloud.points + session.cloud.origin
        height = before[:, "xyz".index(up[-1])] * (-1.0 if "-" in up else 1.0)
        assert np.abs(after[:, 2] - height).max() < 1e-6, "that axis points up"
        assert np.abs(after - before @ np.array(axes, float).T).max() < 1e-6
        assert np.linalg.det(np.array(axes, float)) == 1.0, "no mirror image"
    assert session.settings.fixed == () and session.state.tape == () and session.grid is None
    assert command_of_project(session.state).startswith(f"scantruss grid {TAKEN} ")
    (tmp_path / TAKEN).write_bytes(settings_files(session.state)[TAKEN])
    read = read_points(tmp_path / TAKEN)
    assert np.abs(read.points + read.origin - (session.cloud.points + session.cloud.origin)).max() < 1e-6
    again = Session()
    again.open(tmp_path / "roof.scantruss")
    assert again.state.whole is not None and again.state.whole.up == "-x"
    session.turn("z")
    assert np.abs(session.cloud.points + session.cloud.origin - before).max() < 1e-6
    assert TAKEN not in command_of_project(session.state)


def test_the_camera_stays_where_points_go_and_sees_all_of_another_crop(las: Path, tmp_path: Path) -> None:
    session = opened(las, tmp_path / "roof.scantruss")
    camera, seen = SimpleNamespace(position=(8.0, -14.0, 9.0), look_at=(1.0, 2.0, 0.5)), list[str]()
    client = SimpleNamespace(camera=camera, atomic=contextlib.nullcontext)
    view: Any = SimpleNamespace(client=client, overview=lambda: seen.append("all"))

    def places(state: StudioState) -> np.ndarray:
        assert state.cloud is not None
        return SceneFrame.of(state.cloud).from_scene(np.array([camera.position, camera.look_at]))

    first = session.state
    assert first.cloud is not None
    before = places(first)
    session.remove_points(first.cloud.points[:, 0] > np.median(first.cloud.points[:, 0]))  # half of it
    StudioView._look_again(view, first, session.state)
    assert seen == [] and np.abs(places(session.state) - before).max() < 1e-5
    second = session.state
    session.crop(("box:450001,5300001,450008,5300008",))
    StudioView._look_again(view, second, session.state)
    assert seen == ["all"]


def test_a_scan_that_stands_on_another_axis_is_told_to_be_turned(tmp_path: Path) -> None:
    turn, high = (
        each.ravel() for each in np.meshgrid(np.linspace(0, 2 * np.pi, 60, endpoint=False), np.linspace(0, np.pi, 60))
    )
    points = np.stack([np.sin(high) * np.cos(turn), 2.0 * np.cos(high), np.sin(high) * np.sin(turn)], axis=1)
    np.savetxt(tmp_path / "egg.xyz", points)
    session = Session()
    session.open(tmp_path / "egg.xyz")
    session.set("length", length=0.6)
    assert session.worker.wait(PATIENCE) and session.grid is not None
    with view_of(session) as view:
        assert view.scan.seems.visible and "**y** is up" in view.scan.seems.content
        session.turn("y")
        session.set("length", length=0.6)
        assert session.worker.wait(PATIENCE) and session.grid is not None
        assert not view.scan.seems.visible
        session.turn("x")
        session.set("length", length=0.6)
        assert session.worker.wait(PATIENCE) and "**y** is up" in view.scan.seems.content  # the axis of the file
