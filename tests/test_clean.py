"""Each step of cleaning does what it says on twins of which the truth is known, and nothing where there is nothing to do."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapes import Shape, make
from typed import known

import scantruss as st
from scantruss import clean_points
from scantruss.cli.main import main
from scantruss.kernels.geometry import kd_tree as trees
from scantruss.scan.clean.duplicates import find_near_duplicates, find_repeated, has_repeats
from scantruss.scan.clean.nearby import Nearby
from scantruss.scan.clean.pieces import find_loose_pieces
from scantruss.scan.clean.thinning import thin_to
from scantruss.surface.samples import sample_surface


def spacing_of(shape: Shape, count: int) -> float:
    return float(np.sqrt(shape.area / count))


def count_of(cloud: st.CleanCloud, name: str) -> int:
    return next(step.count for step in cloud.steps if step.name == name)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt((np.asarray(values) ** 2).mean()))


def sides(shape: Shape, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Cosines of the normals with those of the true surface, whose triangles all face one side."""
    a, b, c = (shape.surface.nodes[shape.surface.triangles[:, k]] for k in range(3))
    true = np.cross(b - a, c - a)
    nearest = cKDTree((a + b + c) / 3).query(points)[1]
    return (true[nearest] * normals).sum(axis=1) / np.linalg.norm(true[nearest], axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_the_tree_finds_what_a_look_at_all_points_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.concatenate([rng.random((300, 3)), 1e-3 * rng.random((300, 3)), np.zeros((5, 3))])
    near = Nearby.of(points)
    assert np.array_equal(near.tree.points, points[near.tree.ids])
    away = np.sort(((near.tree.points[:, None] - near.tree.points) ** 2).sum(axis=2), axis=1)
    assert np.allclose(near.squares, away[:, 1:17], rtol=1e-12, atol=0)
    stack, found = np.empty(2 * trees.STACK_LEVELS, np.int64), np.empty(700, np.int64)
    count = trees.within(near.tree, 0.5, 0.5, 0.5, 0.3, stack, found)
    inside = ((near.tree.points - 0.5) ** 2).sum(axis=1) <= 0.09
    assert np.array_equal(np.sort(found[:count]), np.flatnonzero(inside))


def test_few_points_have_few_neighbours() -> None:
    near = Nearby.of(np.random.default_rng(0).random((5, 3)))
    assert (near.neighbors[:, 4:] == -1).all() and np.isinf(near.squares[:, 4:]).all()
    assert (near.neighbors[:, :4] >= 0).all()


def test_repeats_are_all_found_and_the_first_of_each_stays() -> None:
    rng = np.random.default_rng(0)
    some = rng.random((4000, 3))
    points = some[rng.integers(0, 4000, 9000)]
    _, first = np.unique(points, axis=0, return_index=True)
    expected = np.ones(9000, bool)
    expected[first] = False
    assert np.array_equal(find_repeated(points), expected)
    assert has_repeats(points) and not has_repeats(some)


def test_near_duplicates_go_and_nothing_else() -> None:
    shape = make("scallop", 20_000)
    spacing = spacing_of(shape, 20_000)
    rng = np.random.default_rng(0)
    again = shape.points[:5000] + 0.001 * spacing * rng.normal(size=(5000, 3))
    out = find_near_duplicates(np.concatenate([shape.points, again]), 0.01)
    assert out[20_000:].mean() > 0.995
    assert out[:20_000].mean() < 0.002
    assert find_near_duplicates(make("scallop", 20_000, density_ratio=25.0).points, 0.01).mean() < 0.002


def test_loose_small_pieces_go_and_lines_of_a_scanner_stay() -> None:
    shape = make("gable", 20_000)
    spacing = spacing_of(shape, 20_000)
    rng = np.random.default_rng(0)
    debris = np.array([0.0, 0.0, 60.0]) + 2 * spacing * rng.normal(size=(30, 3))
    near = Nearby.of(np.concatenate([shape.points, debris]))
    assert np.array_equal(np.flatnonzero(near.in_order(find_loose_pieces(near, 0.002))), np.arange(20_000, 20_030))
    lines = Nearby.of(make("scallop", 20_000, scan_lines=1.5).points)
    assert not find_loose_pieces(lines, 0.05).any()
    two = Nearby.of(make("two_patches", 20_000).points)
    assert not find_loose_pieces(two, 0.002).any()


@pytest.mark.parametrize("name", ["scallop", "cloth", "gable", "torus", "two_holes", "l_plate", "thin_strip"])
def test_noise_falls_to_a_third_and_the_rim_stays(name: str) -> None:
    spacing = spacing_of(make(name, 15_000), 15_000)
    shape = make(name, 15_000, noise=0.3 * spacing)
    clean = clean_points(shape.points, normals=False, outlier_distance=None)
    points = clean.points + clean.origin
    before, after = shape.points[clean.kept], shape.distance(points)
    assert rms(after) <= rms(shape.distance(before)) / 3
    moved = np.linalg.norm(points - before, axis=1)
    if shape.loops:
        rim = cKDTree(np.concatenate(shape.loops)).query(before)[0] < spacing
        assert rim.sum() > 100 and np.quantile(moved[rim], 0.999) <= spacing
        ends = np.concatenate(shape.loops)  # every part of the true boundary has a clean point as near as before
        gone = cKDTree(points).query(ends)[0] - cKDTree(before).query(ends)[0]
        assert gone.max() <= spacing


def test_a_ridge_is_not_rounded() -> None:
    """Of the points within two spacings of the ridge as many lie near it as before; a mean of both sides would be far below."""
    spacing = spacing_of(make("gable", 15_000), 15_000)
    shape = make("gable", 15_000, noise=0.2 * spacing)
    clean = clean_points(shape.points, normals=False)
    points = clean.points + clean.origin
    at_ridge = np.abs(points[:, 0]) < 2 * spacing
    assert rms(shape.distance(points[at_ridge])) < 0.75 * rms(shape.distance(shape.points[clean.kept][at_ridge]))


def test_two_layers_become_one() -> None:
    first, second = make("scallop", 15_000), make("scallop", 15_000, seed=1)
    spacing = spacing_of(first, 60_000)
    as_it_is = clean_points(second.points, smooth=False, outlier_distance=None, duplicates=None, loose_pieces=None)
    both = np.concatenate([first.points, second.points + 0.8 * spacing * known(as_it_is.normals)])
    clean = clean_points(both, smooth=False)
    assert count_of(clean, "layers") > 0.75 * len(both)
    away = first.distance(clean.points + clean.origin)
    thick = away.std()
    assert abs(away.mean() - 0.4 * spacing) < 0.1 * spacing and thick < 0.2 * spacing
    assert count_of(clean_points(first.points, smooth=False), "layers") == 0
    kept = clean_points(both, smooth=False, layer_distance=None)
    assert np.array_equal(kept.points + kept.origin, both[kept.kept])


@pytest.mark.parametrize("gap", [0.6, 1.0, 1.5])
def test_layers_up_to_their_distance_become_one(gap: float) -> None:
    """A patch no wider than they are apart sees its own layer, and half of the other: it would only smear both."""
    first, second = make("sphere", 6_000), make("sphere", 6_000, seed=1)
    spacing = spacing_of(first, 12_000)
    outwards = second.points / np.linalg.norm(second.points, axis=1)[:, None]
    both = np.concatenate([first.points, second.points + gap * spacing * outwards])
    clean = clean_points(both)
    assert count_of(clean, "layers") > 0.9 * len(both)
    away = first.distance(clean.points + clean.origin)
    assert np.median(abs(away - np.median(away))) < 0.15 * gap * spacing


def test_a_corrugated_surface_is_no_pair_of_layers() -> None:
    """Crests and troughs lie at two distances from a wide patch, as layers do, but neighbours on the same side of it."""
    rng = np.random.default_rng(0)
    points = np.zeros((12_000, 3))
    points[:, :2] = rng.uniform(0.0, 100.0, (12_000, 2))
    points[:, 2] = 0.7 * np.sin(points[:, 0] * 2.0 * np.pi / 5.0)
    assert count_of(clean_points(points), "layers") == 0


def test_one_point_stays_in_each_box_and_none_is_made_up() -> None:
    shape = make("cloth", 20_000)
    stays = thin_to(shape.points, 2.0)
    boxes = np.floor((shape.points - shape.points.min(axis=0)) / 2.0)
    assert stays.sum() == len(np.unique(boxes, axis=0)) == len(np.unique(boxes[stays], axis=0))
    for box in np.unique(boxes, axis=0)[::37]:
        inside = np.flatnonzero((boxes == box).all(axis=1))
        away = np.linalg.norm(shape.points[inside] - shape.points[inside].mean(axis=0), axis=1)
        assert stays[inside[away.argmin()]]


@pytest.mark.parametrize(
    "name, lines",
    [
        ("scallop", 4.0),
        ("clam", 0.0),
        ("two_holes", 0.0),
        ("sphere", 0.0),
        ("torus", 0.0),
        ("saddle", 4.0),
        ("gable", 0.0),
        ("fold_over", 0.0),
    ],
)
def test_normals_face_one_side(name: str, lines: float) -> None:
    lines *= spacing_of(make(name, 15_000), 15_000)
    shape = make(name, 15_000, scan_lines=lines)
    clean = clean_points(shape.points)
    side = sides(shape, clean.points + clean.origin, known(clean.normals))
    assert np.allclose(np.linalg.norm(known(clean.normals), axis=1), 1)
    assert min((side > 0).mean(), (side < 0).mean()) < 1e-3
    assert np.quantile(np.abs(side), 0.05) > 0.9
    if name in ("sphere", "torus"):
        a, b, c = (shape.surface.nodes[shape.surface.triangles[:, k]] for k in range(3))
        volume = (a * np.cross(b, c)).sum()  # positive where the triangles of the truth face outwards
        assert np.sign(side.mean()) == np.sign(volume)


def test_a_one_sided_surface_is_said_to_be_one() -> None:
    assert "one-sided" in clean_points(make("moebius", 15_000).points).steps[-1].words
    assert "one-sided" not in clean_points(make("scallop", 15_000).points).steps[-1].words


def test_dense_clouds_of_strays_go() -> None:
    """Points scattered around a place as densely as those of the surface, which they touch."""
    shape = make("scallop", 30_000, outliers=0.1)
    rng = np.random.default_rng(0)
    spots = shape.points[shape.distance(shape.points) < 1][:4] + np.array([0.0, 0.0, 2.5])
    clouds = np.concatenate([spot + 1.5 * rng.normal(size=(150, 3)) for spot in spots])
    clean = clean_points(np.concatenate([shape.points, clouds]), smooth=False, normals=False)
    away = shape.distance(clean.points + clean.origin)
    assert (away > 2 * spacing_of(shape, 30_000)).sum() <= 0.005 * 3600
    assert (clean.kept[away < 4 * shape.noise] < len(shape.points)).sum() > 0.994 * 30_000


def test_a_narrow_cloud_goes_however_many_points_it_has_and_nothing_where_the_share_is_none() -> None:
    shape = make("gable", 20_000)
    rng = np.random.default_rng(0)
    debris = np.array([0.0, 0.0, 60.0]) + 4.0 * spacing_of(shape, 20_000) * rng.normal(size=(2_000, 3))
    few = np.array([0.0, 0.0, -60.0]) + 0.5 * spacing_of(shape, 20_000) * rng.normal(size=(5, 3))
    near = Nearby.of(np.concatenate([shape.points, debris, few]))

    def loose(share: float) -> np.ndarray:
        return near.in_order(find_loose_pieces(near, share))

    for share in (1e-6, 0.005):
        found = loose(share)
        assert found[20_000:22_000].mean() > 0.95 and found[22_000:].all() and not found[:20_000].any()
    assert not loose(0.0).any()


def test_switched_off_all_points_come_back() -> None:
    points = make("scallop", 5000, outliers=0.1, duplicates=0.1).points
    nothing: dict[str, Any] = dict.fromkeys(("duplicates", "outlier_distance", "loose_pieces", "layer_distance"))
    clean = clean_points(points, **nothing, smooth=False, normals=False)
    assert np.array_equal(clean.points + clean.origin, points) and clean.normals is None and clean.steps == ()


def test_a_stray_distance_of_0_keeps_all_as_for_a_grid() -> None:
    points = make("scallop", 5000, outliers=0.1).points
    clean = clean_points(points, outlier_distance=0, duplicates=None, loose_pieces=0, smooth=False, normals=False)
    assert len(clean.points) == len(points)


def test_info_names_the_command_whose_options_keep_what_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shape = make("scallop", 10_000, outliers=0.1, duplicates=0.2)
    np.save(tmp_path / "a.npy", shape.points)
    assert main(["info", str(tmp_path / "a.npy"), "--length", str(shape.length)]) == 0
    said = "".join(capsys.readouterr())
    assert "outliers are left out; scantruss grid --outlier-distance 0 keeps them" in said
    assert "points are left out; scantruss grid --no-drop-duplicates keeps them" in said


def test_the_same_scan_gives_the_same_bytes() -> None:
    points = make("scallop", 20_000, outliers=0.05, duplicates=0.05).points
    one, other = clean_points(points), clean_points(points.copy())
    assert (
        one.points.tobytes() == other.points.tobytes()
        and known(one.normals).tobytes() == known(other.normals).tobytes()
    )


def test_a_scan_far_from_zero_is_cleaned_the_same() -> None:
    points = make("scallop", 10_000, outliers=0.05).points
    far = clean_points(points + np.array([4.0e6, 5.0e6, 100.0]))
    assert [step.count for step in far.steps] == [step.count for step in clean_points(points).steps]


@pytest.mark.parametrize(
    "wrong", [{"spacing": 0.0}, {"spacing": -1.0}, {"outlier_distance": np.nan}, {"duplicates": -0.1}]
)
def test_impossible_numbers_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(st.InputError, match=next(iter(wrong))):
        clean_points(make("scallop", 2000).points, **wrong)


def test_next_to_nothing_is_refused() -> None:
    with pytest.raises(st.InputError, match="points are left"):
        clean_points(np.random.default_rng(0).random((10, 3)))


def test_the_command_counts_what_it_does_and_writes_normals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shape = make("scallop", 10_000, outliers=0.1, duplicates=0.2)
    scan, out, report = tmp_path / "scan.npy", tmp_path / "clean.xyz", tmp_path / "report.json"
    np.save(scan, shape.points)
    assert main(["clean", str(scan), str(out), "--report", str(report), "--spacing", "1"]) == 0
    said = capsys.readouterr().out
    assert "2,000 duplicate points left out" in said and "outliers left out" in said
    figures = json.loads(report.read_text())
    assert figures["points_read"] == 13_000
    assert [step["name"] for step in figures["steps"]] == [
        "duplicates", "near_duplicates", "outliers", "pieces", "layers", "noise", "spacing", "normals",
    ]  # fmt: skip
    assert np.loadtxt(out).shape == (figures["points"], 6)


def test_how_far_points_moved_has_the_unit_of_the_scan() -> None:
    points = make("cloth", 4000).points
    said = {
        unit: [step.words for step in clean_points(points, unit=unit).steps if step.name == "noise"]
        for unit in ("mm", "")
    }
    assert said["mm"][0].endswith(" mm (rms)") and said["mm"][0].replace(" mm", "") == said[""][0]


def test_the_command_refuses_before_it_reads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scan = tmp_path / "scan.xyz"
    np.savetxt(scan, make("scallop", 500).points)
    for words, line in (
        (["out.what"], "no format for a cloud"),
        ([str(scan)], "would overwrite the scan"),
        (["out.ply", "--spacing", "0"], "--spacing must be a positive length in the scan's unit, got 0"),
        (["out.ply", "--duplicates", "-1"], "--duplicates must be a number of 0 or more, got -1"),
        (["out.ply", "--outlier-distance", "-1"], "--outlier-distance must be a number of 0 or more, got -1"),
    ):
        assert main(["clean", str(scan), *words]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and line in said
    assert list(tmp_path.iterdir()) == [scan]


def test_the_command_overwrites_no_file_of_the_scan_and_no_polygon(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    points = make("scallop", 500).points
    for name in ("a.xyz", "b.xyz"):
        np.savetxt(name, points)
    Path("ring.csv").write_text("-99,-99\n99,-99\n99,99\n-99,99\n")
    held = {path: path.read_bytes() for path in Path().iterdir()}
    for words in (["b.xyz"], ["ring.csv", "--crop", "ring.csv"]):
        assert main(["clean", "*.xyz", *words]) == 2
        assert f"{words[0]} would overwrite the" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in Path().iterdir()} == held


def test_repeats_are_left_out_of_a_grid_where_there_are_many() -> None:
    shape = make("scallop", 10_000, duplicates=0.5)
    cloud, own = st.PointCloud.from_array(shape.points), st.Settings(length=shape.length)
    assert sample_surface(cloud, own).repeated == 5000
    for kept in (own.replace(clean=False), own.replace(drop_duplicates=False)):
        assert sample_surface(cloud, kept).repeated == 0
        assert len(sample_surface(cloud, kept).surface.points) == 15_000


def test_without_cleaning_a_grid_keeps_strays() -> None:
    shape = make("scallop", 10_000, outliers=0.1)
    cloud = st.PointCloud.from_array(shape.points)
    assert sample_surface(cloud, st.Settings(length=shape.length)).outliers > 900
    assert sample_surface(cloud, st.Settings(length=shape.length, clean=False)).outliers == 0
    word: Any = "no"
    with pytest.raises(st.InputError, match="clean"):
        st.Settings(length=1.0, clean=word)
