"""Scans in frames of their own come together where the truth says; what does not belong is refused by name."""

import json
import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from range_scans import around, body, errors_of, random_pose, scans_of
from scipy.spatial import cKDTree

import scantruss as st
from scantruss.cli.main import main
from scantruss.cli.splice import splice_parser
from scantruss.errors import FormatError, InputError
from scantruss.runtime import parallel
from scantruss.scan.cloud import PointCloud, measure_spacing
from scantruss.scan.register import splice_scans
from scantruss.scan.register.pose_file import pose_values, read_poses
from scantruss.scan.register.run import Splice
from scantruss.scan.register.saving import splice_values

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
NAMES = ["a", "b", "c", "d"]
COUNT = 8000  # points all around a body
OTHER_VIEWS = ("chin", "ear_back", "top")  # of the bunny, from above and below: these take most of the time


def clouds_of(scans: Iterable[np.ndarray]) -> list[PointCloud]:
    return [PointCloud.from_array(scan) for scan in scans]


@pytest.fixture(scope="module")
def scanned() -> tuple[list[np.ndarray], list[np.ndarray], Splice]:
    """Four scans around a body, their poses, and what became of them."""
    rng = np.random.default_rng(6)
    scans, poses = scans_of(body(1), around(4, rng), rng, count=COUNT, noise=0.1)
    return scans, poses, splice_scans(clouds_of(scans), NAMES)


def test_scans_come_together_without_help(scanned: tuple[list[np.ndarray], list[np.ndarray], Splice]) -> None:
    scans, poses, result = scanned
    turned, moved = errors_of(result.poses, poses, scans, NAMES)
    assert set(result.poses) == set(NAMES) and not result.left_out
    assert turned < 0.5 and moved < 0.4 * result.spacing
    assert result.frame == "a" and np.array_equal(result.poses["a"], np.eye(4))
    assert result.spacing == pytest.approx(np.median([measure_spacing(scan) for scan in scans]))


def test_every_residual_is_that_of_the_layers(scanned: tuple[list[np.ndarray], list[np.ndarray], Splice]) -> None:
    """A pair's residual, by slow means: the distance of each point from the plane of the nearest points of the other scan."""
    scans, _, result = scanned
    placed = {
        name: scan @ result.poses[name][:3, :3].T + result.poses[name][:3, 3]
        for name, scan in zip(NAMES, scans, strict=False)
    }
    assert len(result.pairs) >= 4
    for pair in result.pairs:
        a, b = placed[pair.first], placed[pair.second]
        tree = cKDTree(b)
        away, near = tree.query(a, 12)
        a, near = a[away[:, 0] < 2 * result.spacing], near[away[:, 0] < 2 * result.spacing]
        patch = b[near] - b[near].mean(axis=1, keepdims=True)
        normal = np.linalg.svd(patch)[2][:, 2]
        off = np.abs(((a - b[near].mean(axis=1)) * normal).sum(axis=1))
        assert pair.residual < 2.0 * np.sqrt((off**2).mean())  # places are means of points, so they lie closer
        assert pair.residual > 0.2 * np.sqrt((off**2).mean())
        assert 0.0 < pair.overlap <= 1.0 and 0.9 < pair.agreement <= 1.0


def test_the_order_of_the_scans_does_not_matter(scanned: tuple[list[np.ndarray], list[np.ndarray], Splice]) -> None:
    scans, _, result = scanned
    again = splice_scans(clouds_of(scans[::-1]), NAMES[::-1])
    assert again.frame == "d"
    home = np.linalg.inv(result.poses["d"])
    for name in NAMES:
        assert np.allclose(again.poses[name], home @ result.poses[name], atol=1e-9)
    assert {frozenset((p.first, p.second)): p.residual for p in again.pairs} == pytest.approx(
        {frozenset((p.first, p.second)): p.residual for p in result.pairs}
    )


def test_the_same_to_the_byte_with_one_thread(
    scanned: tuple[list[np.ndarray], list[np.ndarray], Splice], monkeypatch: pytest.MonkeyPatch
) -> None:
    scans, _, _result = scanned
    monkeypatch.setattr(parallel, "processors", lambda: 1)
    again = splice_scans(clouds_of(scans[:2]), NAMES[:2])
    monkeypatch.setattr(parallel, "processors", lambda: 3)
    once_more = splice_scans(clouds_of(scans[:2]), NAMES[:2])
    assert again.cloud.points.tobytes() == once_more.cloud.points.tobytes()
    assert all(again.poses[name].tobytes() == once_more.poses[name].tobytes() for name in again.poses)


def test_a_stranger_is_left_out_by_name(scanned: tuple[list[np.ndarray], list[np.ndarray], Splice]) -> None:
    scans, poses, _ = scanned
    rng = np.random.default_rng(9)
    stranger, _ = scans_of(body(77), [(1.0, 0.2, 0.1)], rng, count=COUNT)
    result = splice_scans(clouds_of([stranger[0], *scans[:3]]), ["stranger", *NAMES[:3]])
    assert result.left_out == ("stranger",) and result.frame == "a"
    assert not any("stranger" in (pair.first, pair.second) for pair in result.pairs)
    turned, moved = errors_of(result.poses, poses[:3], scans[:3], NAMES[:3])
    assert turned < 0.5 and moved < 0.4 * result.spacing


def test_scans_without_overlap_are_refused_by_name() -> None:
    rng = np.random.default_rng(2)
    scans, _ = scans_of(body(1), [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)], rng, count=COUNT)
    with pytest.raises(InputError, match="front, back do not fit together"):
        splice_scans(clouds_of(scans), ["front", "back"])


def test_a_sphere_fits_in_many_ways_and_is_refused() -> None:
    rng = np.random.default_rng(2)
    scans, _ = scans_of(lambda u: np.ones(len(u)), around(3, rng), rng, count=6000)
    with pytest.raises(InputError, match="do not fit together"):
        splice_scans(clouds_of(scans))


@pytest.fixture(scope="module")
def saddles() -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Two scans of a saddle, which looks the same when turned by half a turn, and their poses."""
    rng = np.random.default_rng(7)
    scans, poses = [], []
    for seed, side in enumerate((-1.0, 1.0)):
        x, y = np.random.default_rng(seed).uniform(-1, 1, (2, 12_000))
        whole = np.stack([x, y, 0.45 * (x * x - y * y)], axis=1)
        seen = whole[np.hypot(x - 0.35 * side, y) < 0.75]
        pose = random_pose(rng)
        poses.append(pose)
        scans.append((seen - pose[:3, 3]) @ pose[:3, :3])
    return scans, poses


def test_a_body_that_looks_the_same_when_turned_is_refused_unless_poses_are_given(
    saddles: tuple[list[np.ndarray], list[np.ndarray]],
) -> None:
    scans, poses = saddles
    with pytest.raises(InputError, match=r"in more ways than one.*--poses"):
        splice_scans(clouds_of(scans), NAMES[:2])
    given = splice_scans(clouds_of(scans), NAMES[:2], poses=dict(zip(NAMES, poses, strict=False)))
    turned, moved = errors_of(given.poses, poses, scans, NAMES[:2])
    assert turned < 0.5 and moved < 0.6 * given.spacing and not given.left_out


def test_given_poses_that_do_not_hold_do_not_switch_doubt_off(
    saddles: tuple[list[np.ndarray], list[np.ndarray]],
) -> None:
    scans, _ = saddles
    rng = np.random.default_rng(100)
    with pytest.raises(InputError, match="in more ways than one"):
        splice_scans(clouds_of(scans), NAMES[:2], poses={name: random_pose(rng) for name in NAMES[:2]})


def test_units_do_not_matter() -> None:
    """The same scans a thousand times as large, far from the origin."""
    rng = np.random.default_rng(4)
    scans, _ = scans_of(body(1), around(4, rng)[:3], rng, noise=0.1)
    far = np.array([4e5, 5e6, 100.0])
    large = splice_scans(clouds_of([1000.0 * scan + far for scan in scans[:2]]), NAMES[:2])
    small = splice_scans(clouds_of([*scans[:2], 39.37 * scans[2]]), [*NAMES[:2], "inches"])
    assert small.left_out == ("inches",)  # one scan in another unit is no obstacle
    move = np.eye(4)
    move[:3, :3] *= 1000.0
    move[:3, 3] = far
    for name in NAMES[:2]:
        expected = move @ small.poses[name] @ np.linalg.inv(move)
        assert np.abs(large.poses[name][:3, :3] - expected[:3, :3]).max() < 2e-4
        places = 1000.0 * scans[NAMES.index(name)] + far
        apart = (places @ (large.poses[name] - expected)[:3, :3].T) + (large.poses[name] - expected)[:3, 3]
        assert np.abs(apart).max() < 0.2 * large.spacing


def test_the_whole_has_one_layer_as_dense_as_one_scan(
    scanned: tuple[list[np.ndarray], list[np.ndarray], Splice],
) -> None:
    scans, poses, result = scanned
    spacing = result.spacing
    true = [scan @ pose[:3, :3].T + pose[:3, 3] for scan, pose in zip(scans, poses, strict=False)]
    home = poses[0] @ np.eye(4)
    whole = (result.cloud.points + result.cloud.origin) @ home[:3, :3].T + home[:3, 3]
    assert sum(result.kept.values()) == len(whole)
    places = np.concatenate(true)[::40]
    counts = np.array([[len(found) for found in cKDTree(scan).query_ball_point(places, 8 * spacing)] for scan in true])
    merged = np.array([len(found) for found in cKDTree(whole).query_ball_point(places, 8 * spacing)])
    share = merged / counts.max(axis=0)
    assert np.quantile(share, 0.02) > 0.6 and np.quantile(share, 0.98) < 1.3
    assert np.median(counts.sum(axis=0) / counts.max(axis=0)) > 1.4  # not so by itself
    radius = body(1)

    def off(points: np.ndarray) -> float:
        far = np.linalg.norm(points, axis=1)
        return np.abs(far - radius(points / far[:, None])).mean()

    assert off(whole) < 1.02 * off(np.concatenate(true))


def test_poses_to_start_from_and_poses_as_they_are(scanned: tuple[list[np.ndarray], list[np.ndarray], Splice]) -> None:
    scans, poses, result = scanned
    rough = {}
    for name, pose in zip(NAMES, poses, strict=False):
        turn = np.array([[0, -0.03, 0.02], [0.03, 0, -0.02], [-0.02, 0.02, 0]])
        u, _, v = np.linalg.svd(np.eye(3) + turn * (NAMES.index(name) - 2))
        nudge = np.eye(4)
        nudge[:3, :3] = u @ v
        rough[name] = nudge @ pose
    started = splice_scans(clouds_of(scans), NAMES, poses=rough)
    assert max(errors_of(started.poses, poses, scans, NAMES)) < 0.2
    kept = splice_scans(clouds_of(scans), NAMES, poses=dict(zip(NAMES, poses, strict=False)), use_poses=True)
    for name, pose in zip(NAMES, poses, strict=False):
        assert np.allclose(kept.poses[name], pose, atol=1e-12)
    assert {(p.first, p.second) for p in kept.pairs} >= {(p.first, p.second) for p in result.pairs if p.overlap > 0.1}
    with pytest.raises(InputError, match="no pose is given for d"):
        splice_scans(clouds_of(scans), NAMES, poses=dict(zip(NAMES[:3], poses, strict=False)), use_poses=True)


def test_wrong_poses_taken_as_they_are_are_told(scanned: tuple[list[np.ndarray], list[np.ndarray], Splice]) -> None:
    scans, _, result = scanned
    assert result.contradicting == () and result.alone == ()
    for shift in (1.5, 50.0):  # spacings: over the others but off them, and nowhere near
        pose = result.poses[NAMES[0]].copy()
        pose[:3, 3] += shift * result.spacing
        wrong = splice_scans(clouds_of(scans), NAMES, poses=result.poses | {NAMES[0]: pose}, use_poses=True)
        assert NAMES[0] in wrong.alone and set(NAMES[1:]).isdisjoint(wrong.alone)
        assert all(NAMES[0] in (pair.first, pair.second) for pair in wrong.contradicting)
        assert bool(wrong.contradicting) == (shift < 10.0)


def test_a_pair_of_which_nothing_agrees_is_listed_without_a_residual() -> None:
    plate = np.stack([*np.meshgrid(np.arange(60.0), np.arange(40.0)), np.zeros((40, 60))], axis=2).reshape(-1, 3)
    pose = np.eye(4)
    pose[2, 3] = 3.0
    clouds = [PointCloud.from_array(plate), PointCloud.from_array(plate)]
    result = splice_scans(clouds, ["one", "other"], poses={"one": np.eye(4), "other": pose}, use_poses=True)
    (pair,) = result.contradicting
    assert pair.agreement == 0.0 and pair.residual is None and result.alone == ("one", "other")
    assert '"residual": null' in json.dumps(splice_values(result))


def test_poses_taken_as_they_are_are_measured_like_those_that_were_found(
    scanned: tuple[list[np.ndarray], list[np.ndarray], Splice],
) -> None:
    scans, _, result = scanned
    again = splice_scans(clouds_of(scans), NAMES, poses=result.poses, use_poses=True)
    assert {(p.first, p.second) for p in again.pairs} == {(p.first, p.second) for p in result.pairs}
    for found, given in zip(result.pairs, again.pairs, strict=True):
        for figure in ("overlap", "agreement", "residual"):
            assert getattr(given, figure) == pytest.approx(getattr(found, figure), rel=1e-6)


@pytest.mark.parametrize(
    "clouds, words",
    [
        (["mm"], "at least 2 scans, got 1"),
        (["mm", "m"], "must be in one unit"),
    ],
)
def test_what_cannot_be_spliced_is_refused(clouds: list[str], words: str) -> None:
    points = np.random.default_rng(0).random((100, 3))
    with pytest.raises(InputError, match=words):
        splice_scans([PointCloud.from_array(points, unit=unit) for unit in clouds])


# the files and the command


def test_poses_are_read_back_as_they_were_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    poses = {f"{k}.ply": random_pose(rng) for k in range(40)}
    path = tmp_path / "poses.json"
    path.write_text(json.dumps({"scans": {name: pose_values(pose) for name, pose in poses.items()}}))
    for name, pose in read_poses(path).items():
        assert np.allclose(pose, poses[name], atol=1e-14)
        x, y, z, w = pose_values(pose)["quaternion"]
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        assert np.allclose(turn, pose[:3, :3], atol=1e-12)
    path.write_text(json.dumps({n: {"R": p[:3, :3].tolist(), "t": p[:3, 3].tolist()} for n, p in poses.items()}))
    assert all(np.allclose(pose, poses[name], atol=1e-14) for name, pose in read_poses(path).items())


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "not a JSON file"),
        ("[" * 100_000, "not a JSON file"),
        ("[]", "holds no poses"),
        ("{}", "holds no poses"),
        ('{"a": 3}', "needs a 4 x 4 matrix"),
        ('{"a": [[1, 0], [0, 1]]}', "needs a 4 x 4 matrix"),
        ('{"a": {"R": [1, 2], "t": [0, 0, 0]}}', "needs a 4 x 4 matrix"),
        ('{"a": [[1,0,0,NaN],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}', "needs a 4 x 4 matrix"),
        ('{"a": [[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]}', "not a rigid motion"),
        ('{"a": [[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]}', "not a rigid motion"),
    ],
)
def test_a_broken_file_of_poses_is_refused(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "poses.json"
    path.write_text(text)
    with pytest.raises(FormatError, match=words):
        read_poses(path)


@pytest.fixture
def place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scanned: tuple[list[np.ndarray], list[np.ndarray], Splice]
) -> Path:
    """A folder with two scans in it, which is where the command runs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SCANTRUSS_TRACEBACK", "1")
    for name, scan in zip("ab", scanned[0], strict=False):
        np.savetxt(f"{name}.xyz", scan, fmt="%.8f")
    return tmp_path


def test_the_command_writes_the_whole_and_the_poses(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["splice", "*.xyz", "-o", "whole.ply", "--unit", "m"]) == 0
    said = capsys.readouterr().out
    assert "2 of 2 scans in the frame of a.xyz" in said and "a.xyz - b.xyz" in said
    values = json.loads(Path("whole.poses.json").read_text())
    assert values["frame"] == "a.xyz" and values["unit"] == "m" and set(values["scans"]) == {"a.xyz", "b.xyz"}
    assert all({"residual", "residual_spacings", "overlap"} <= set(pair) for pair in values["pairs"])
    assert len(st.read_points("whole.ply").points) == sum(scan["kept"] for scan in values["scans"].values())
    first = Path("whole.ply").read_bytes()
    assert main(["splice", "a.xyz", "b.xyz", "-o", "again.ply", "--unit", "m"]) == 0
    assert Path("again.ply").read_bytes() == first
    assert Path("again.poses.json").read_bytes() == Path("whole.poses.json").read_bytes()
    assert main(["splice", "*.xyz", "-o", "kept.ply", "--poses", "whole.poses.json", "--use-poses", "--unit", "m"]) == 0
    kept = json.loads(Path("kept.poses.json").read_text())
    for name, scan in values["scans"].items():
        assert np.allclose(kept["scans"][name]["matrix"], scan["matrix"], atol=1e-12)
    same = ["-o", "whole.ply", "--poses", "whole.poses.json", "--use-poses", "--unit", "m"]
    assert main(["splice", "*.xyz", *same]) == 0  # a run may replace the poses that it starts from
    assert json.loads(Path("whole.poses.json").read_text())["scans"] == kept["scans"]


@pytest.mark.parametrize(
    "words, said",
    [
        (["a.xyz", "-o", "out.ply"], "at least 2 scans"),
        (["a.xyz", "a.xyz", "-o", "out.ply"], "given twice"),
        (["a.xyz", "none.xyz", "-o", "out.ply"], "none.xyz"),
        (["none*.xyz", "a.xyz", "-o", "out.ply"], "no file fits"),
        (["a.xyz", "b.xyz", "-o", "out.abc"], "abc"),
        (["a.xyz", "b.xyz", "-o", "nowhere/out.ply"], "nowhere"),
        (["a.xyz", "b.xyz", "-o", "a.xyz"], "overwrite"),
        (["a.xyz", "b.xyz"], "missing"),
        (["a.xyz", "b.xyz", "-o", "out.ply", "--use-poses"], "needs --poses"),
        (["a.xyz", "b.xyz", "-o", "out.ply", "--poses", "none.json"], "none.json"),
    ],
)
def test_a_refusal_is_one_line_and_writes_nothing(
    place: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    before = sorted(place.iterdir())
    assert main(["splice", *words]) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1 and told.startswith("scantruss: ")
    assert sorted(place.iterdir()) == before


def test_one_that_fits_nowhere_is_named_and_all_of_them_can_be_demanded(
    place: Path,
    capsys: pytest.CaptureFixture[str],
    scanned: tuple[list[np.ndarray], list[np.ndarray], Splice],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, _, result = scanned
    result = replace(result, left_out=("x.xyz", "y.xyz"), doubtful=("y.xyz",))
    monkeypatch.setattr("scantruss.scan.register.splice_scans", lambda *_, **__: result)
    assert main(["splice", "*.xyz", "-o", "out.ply"]) == 0
    said = "".join(capsys.readouterr())
    assert "x.xyz fits nowhere" in said and "y.xyz fits in more ways than one" in said and "4 of 6 scans" in said
    assert json.loads(Path("out.poses.json").read_text())["left_out"] == ["x.xyz", "y.xyz"]
    assert main(["splice", "*.xyz", "-o", "all.ply", "--all"]) == 2
    assert "x.xyz fits nowhere" in capsys.readouterr().err and not Path("all.ply").exists()


@pytest.mark.parametrize("suffix", [".las", ".laz", ".ply"])
def test_what_is_said_of_the_file_names_only_options_that_splice_has(
    place: Path,
    capsys: pytest.CaptureFixture[str],
    scanned: tuple[list[np.ndarray], list[np.ndarray], Splice],
    monkeypatch: pytest.MonkeyPatch,
    suffix: str,
) -> None:
    monkeypatch.setattr("scantruss.scan.register.splice_scans", lambda *_, **__: scanned[2])
    assert main(["splice", "*.xyz", "-o", f"out{suffix}"]) == 0
    said = capsys.readouterr().out.partition("wrote ")[2]
    assert ("reference system are not kept" in said) == (suffix in (".las", ".laz"))
    options = set(re.findall(r"--[a-z][a-z-]*", said))
    assert options <= set(splice_parser()._option_string_actions)


def test_it_can_be_stopped(scanned: tuple[list[np.ndarray], list[np.ndarray], Splice]) -> None:
    def stop(stage: str, share: float) -> None:
        if stage == "match":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        splice_scans(clouds_of(scanned[0]), NAMES, progress=stop)


def shared(folder: str, poses: str) -> tuple[list[str], list[PointCloud], list[np.ndarray]]:
    """Names, clouds and true poses of the scans in a folder of the shared data, every eighth point."""
    true = read_poses(DATA / folder / poses)
    names = [name for name in sorted(true) if not name.startswith(OTHER_VIEWS)]  # from the sides alone
    clouds = [st.read_points(DATA / folder / name) for name in names]
    thinned = [PointCloud.from_array((cloud.points + cloud.origin)[::8]) for cloud in clouds]
    return names, thinned, [true[name] for name in names]


@pytest.mark.skipif(not DATA.exists(), reason="the shared scans are not here")
@pytest.mark.parametrize(
    "folder, poses", [("twins/twin_scans", "ex3_limpet_poses.json"), ("real/bunny_scans", "poses.json")]
)
def test_shared_scans_come_together_where_the_truth_says(folder: str, poses: str) -> None:
    names, clouds, true = shared(folder, poses)
    result = splice_scans(clouds, names)
    assert not result.left_out
    turned, moved = errors_of(result.poses, true, [cloud.points + cloud.origin for cloud in clouds], names)
    assert turned < 0.5 and moved < 0.7 * result.spacing
