"""Normals that a scan comes with keep the two sides of something thin apart; those that cannot be trusted are not used."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as some
from scipy.spatial import cKDTree

import scantruss as st
from scantruss.scan.formats.faces import normals_from_faces
from scantruss.scan.normals import face_as_given
from scantruss.surface.given_normals import GivenNormals, given_normals
from scantruss.surface.samples import sample_surface

GAP = 0.03  # between the two blocks, a third of the spacing of their points
HALF = 1.0  # size of a block


def block(side: float) -> trimesh.Trimesh:
    """A rounded cube of size 2, x^6 + y^6 + z^6 = 1, to one side of the plane x = 0, as a mesh with 2,562 points."""
    mesh = trimesh.creation.icosphere(subdivisions=4)
    points = np.asarray(mesh.vertices)
    mesh.vertices = points / (points**6).sum(axis=1, keepdims=True) ** (1 / 6) + [side * (HALF + GAP / 2), 0, 0]
    return mesh


def blocks() -> trimesh.Trimesh:
    """Two blocks that nearly touch: by their points alone the two walls between them are one."""
    return trimesh.util.concatenate([block(-1.0), block(1.0)])


@pytest.fixture(params=[".obj", ".ply", ".stl", ".off"])
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """The blocks in each format of meshes."""
    path = tmp_path / f"blocks{request.param}"
    blocks().export(path)
    return path


def outward(points: np.ndarray) -> np.ndarray:
    """The normals of the blocks at some of their points."""
    side = np.where(points[:, :1] < 0.0, -1.0, 1.0) * [HALF + GAP / 2, 0, 0]
    normals = (points - side) ** 5
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_a_mesh_gives_its_points_the_normals_of_its_faces(file: Path) -> None:
    cloud = st.read_points(file)
    assert cloud.normals is not None and given_normals(cloud) is not None
    assert ((cloud.normals * outward(cloud.points + cloud.origin)).sum(axis=1) > 0.97).all()


def test_walls_nearer_than_a_spacing_are_not_linked(file: Path) -> None:
    """Without normals they are."""
    cloud, settings = st.read_points(file), st.Settings(length=0.35)
    for scan, are_linked in ((cloud, False), (st.PointCloud.from_array(cloud.points + cloud.origin), True)):
        samples = sample_surface(scan, settings)
        surface = samples.surface
        sample, k = np.nonzero(surface.neighbors >= 0)
        left = surface.mean[:, 0] + scan.origin[0] < 0.0
        assert (left[sample] != left[surface.neighbors[sample, k]]).any() == are_linked
        assert len(samples.pieces) == (1 if are_linked else 2)


def test_bodies_that_nearly_touch_get_a_closed_grid_each(file: Path) -> None:
    grid = st.grid_from_scan(file, st.Settings(length=0.35, effort="quick"))
    assert len(grid.nodes) - len(grid.edges) + len(grid.triangles) == 4
    assert grid.certificate is not None and grid.certificate.missing < 0.01


def test_faces_of_any_number_of_corners_give_normals() -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0]], float)
    normals = normals_from_faces(square, [np.array([[0, 1, 2, 3]]), np.array([[1, 4, 2]])])
    assert normals is not None and np.allclose(normals, [0, 0, 1])


@given(some.integers(0, 1000))
def test_a_point_whose_faces_face_each_other_away_has_no_normal(seed: int) -> None:
    """Both sides of one triangle, as scanners leave them: what is left of their sum is chance."""
    points = np.random.default_rng(seed).normal(size=(5, 3))
    fin, other = np.array([[0, 1, 2], [2, 1, 0]]), np.array([[2, 3, 4]])
    normals = normals_from_faces(points, [fin, other])
    assert normals is not None
    assert (normals[:2] == 0.0).all()
    across = np.cross(points[3] - points[2], points[4] - points[2])
    np.testing.assert_allclose(normals[2:], np.tile(across / np.linalg.norm(across), (3, 1)), atol=1e-9)


@given(some.integers(0, 1000), some.floats(0.05, 0.95))
def test_samples_without_a_normal_face_as_those_around_them(seed: int, unknown: float) -> None:
    """On a ball whose samples all face inwards before, with normals given at some of them alone."""
    rng = np.random.default_rng(seed)
    outwards = rng.normal(size=(300, 3))
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    neighbors = cKDTree(outwards).query(outwards, 9)[1][:, 1:]
    facing = np.where((rng.random(300) < unknown)[:, None], 0.0, outwards)
    facing[np.linalg.norm(outwards - outwards[0], axis=1) < 0.6] = 0.0
    normals = -outwards
    face_as_given(normals, facing, neighbors)
    assert ((normals * outwards).sum(axis=1) > 0.99).all() == facing.any()


@pytest.mark.parametrize(
    "faces",
    [
        pytest.param([[0, 1, 2], [0, 1, 3]], id="wound both ways"),
        pytest.param([[0, 1, 9]], id="no such point"),
        pytest.param([[0, 1, -1]], id="negative"),
    ],
)
def test_faces_that_say_nothing_of_the_sides_give_none(faces: list[list[int]]) -> None:
    assert normals_from_faces(np.eye(4, 3), [np.array(faces)]) is None


def test_normals_of_either_sign_are_not_trusted() -> None:
    points = np.asarray(blocks().vertices)
    sign = np.where(np.random.default_rng(0).random(len(points)) < 0.5, -1.0, 1.0)[:, None]
    assert GivenNormals.of(points, outward(points)) is not None
    assert GivenNormals.of(points, sign * outward(points)) is None


def test_a_few_normals_that_face_the_wrong_way_are_turned_and_walls_stay_apart() -> None:
    points = np.asarray(blocks().vertices)
    wrong, between = np.random.default_rng(3).random(len(points)) < 0.02, np.abs(points[:, 0]) < 0.15
    found = GivenNormals.of(points, np.where(wrong[:, None], -1.0, 1.0) * outward(points))
    assert found is not None and (wrong & ~between).sum() > 50
    inward = (found.normals * outward(points)).sum(axis=1) < 0.0
    assert not inward[~wrong].any() and not inward[~between].any()  # between the walls points of both lie around each


@pytest.mark.parametrize("thickness", [0.2, 0.4, 0.8])
def test_normals_of_a_plate_thinner_than_its_spacing_are_not_turned_by_its_other_side(thickness: float) -> None:
    """Of points drawn at random one in fifty has ten of its twelve nearest on the other side."""
    rng = np.random.default_rng(6)
    upper = rng.random(20_000) < 0.5
    points = np.column_stack([rng.uniform(0.0, 100.0, (20_000, 2)), thickness * upper + rng.normal(0.0, 0.03, 20_000)])
    normals, wrong = np.zeros((20_000, 3)), rng.choice(20_000, 20, replace=False)
    normals[:, 2] = np.where(upper, 1.0, -1.0)
    given = normals.copy()
    given[wrong] *= -1.0
    found = GivenNormals.of(points, given)
    assert found is not None
    inward = (found.normals * normals).sum(axis=1) < 0.0
    assert not np.delete(inward, wrong).any()


def test_columns_of_normals_are_read_and_follow_the_points(tmp_path: Path) -> None:
    """Those of points that are left out leave with them."""
    points = np.random.default_rng(1).random((500, 3))
    points[7] = np.nan
    normals = np.tile([0.0, 0.6, 0.8], (500, 1)) * np.arange(1, 501)[:, None]
    table = np.empty(500, [(name, float) for name in ("x", "y", "z", "nx", "ny", "nz")])
    for name, column in zip(table.dtype.names or (), np.hstack([points, normals]).T, strict=True):
        table[name] = column
    np.save(tmp_path / "scan.npy", table)
    cloud = st.read_points(tmp_path / "scan.npy")
    assert cloud.normals is not None and np.array_equal(cloud.normals, np.delete(normals, 7, axis=0))
