"""The printed model: one watertight manifold solid with every opening of the grid."""

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from small_grids import cloud_over, dome, fan, icosahedron, make_grid, two_pieces

import scantruss as st
from scantruss.cli.demo_files import DEMOS, save_demo
from scantruss.export.solid import build_solid, is_watertight
from scantruss.export.solid_files import Solid, encode_3mf, encode_stl, lattice_step, put_on_lattice
from scantruss.grid.certificate import Certificate, Fault

GRIDS = [fan, icosahedron, two_pieces, dome]
SIZES: dict[str, Any] = {"member_diameter": 0.8, "node_diameter": 1.4}


def expected_genus(grid: st.Grid) -> tuple[int, int]:
    """E - V + 1 of each piece, summed, by walking from node to node."""
    neighbours: dict[int, set[int]] = {}
    for a, b in grid.edges.tolist():
        neighbours.setdefault(a, set()).add(b)
        neighbours.setdefault(b, set()).add(a)
    left, pieces = set(neighbours), 0
    while left:
        pieces, waiting = pieces + 1, [left.pop()]
        while waiting:
            found = neighbours[waiting.pop()] & left
            left -= found
            waiting += found
    return len(grid.edges) - len(neighbours) + pieces, pieces


def test_the_demo_saves_the_settings_its_grid_was_made_with(tmp_path: Path) -> None:
    """They differ from those asked for where no grid of the default method passes its certificate."""
    made = st.Settings(length=24.0, unit="mm", method="paper")
    grid = dome(4, 24.0, settings=made)
    save_demo(DEMOS["bust"], tmp_path, grid, cloud_over(grid))
    assert st.Settings.from_dict(json.loads((tmp_path / "grid.settings.json").read_text())) == made


def test_the_model_of_the_demo_is_a_model_in_the_unit_of_its_scan(tmp_path: Path) -> None:
    grid = dome(4, 1.0, unit="m")
    save_demo(DEMOS["shell"], tmp_path, grid, cloud_over(grid))
    size = trimesh.load(tmp_path / "model.3mf", force="mesh").extents
    np.testing.assert_allclose(size[:2], 0.005 * np.ptp(grid.nodes, axis=0)[:2] + 0.002, rtol=0.01)


@pytest.mark.parametrize("suffix", [".3mf", ".stl"])
@pytest.mark.parametrize("make", GRIDS)
def test_an_independent_reader_finds_one_watertight_solid_with_every_opening(
    make: Callable[..., st.Grid], suffix: str, tmp_path: Path
) -> None:
    grid = make()
    solid = st.print_model(grid, tmp_path / f"a{suffix}", **SIZES)
    mesh = trimesh.load(tmp_path / f"a{suffix}", force="mesh")
    genus, pieces = expected_genus(grid)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0
    assert len(mesh.split()) == pieces == solid.components == solid.expected_components
    assert mesh.euler_number == 2 * pieces - 2 * genus
    assert solid.genus == solid.expected_genus == genus and solid.notes == []
    assert mesh.volume == pytest.approx(solid.volume, rel=1e-5)


@pytest.mark.parametrize("make", GRIDS)
def test_volume_lies_between_the_parts_alone_and_their_sum(make: Callable[..., st.Grid]) -> None:
    grid = make()
    solid = build_solid(grid, **SIZES)
    members, nodes = len(grid.edges), len(np.unique(grid.edges))
    bar = 12 / 2 * np.sin(2 * np.pi / 12) * 0.4**2  # area of a member with 12 sides
    ball = 4 / 3 * np.pi * 0.7**3
    outside_nodes = bar * (grid.lengths.sum() - members * 1.4)
    assert outside_nodes + nodes * 0.8 * ball < solid.volume < bar * grid.lengths.sum() + nodes * ball


def test_solid_lies_around_the_grid_at_scale() -> None:
    grid = fan()
    for scale in (0.5, 1.0, 3.0):
        solid = build_solid(grid, scale=scale, **SIZES)
        low, high = grid.nodes.min(axis=0) * scale, grid.nodes.max(axis=0) * scale
        assert np.all(solid.vertices.min(axis=0) >= low - 0.7 - 1e-9)
        assert np.all(solid.vertices.max(axis=0) <= high + 0.7 + 1e-9)
        assert np.all(np.abs(solid.vertices.max(axis=0) - high - 0.7) < 0.05)


def test_every_vertex_is_at_the_radius_of_a_part_or_inside_it() -> None:
    grid = icosahedron()
    solid = build_solid(grid, **SIZES)
    start, end = grid.nodes[grid.edges[:, 0]], grid.nodes[grid.edges[:, 1]]
    along = ((solid.vertices[:, None] - start) * (end - start)).sum(axis=2) / grid.lengths**2
    nearest = start + np.clip(along, 0, 1)[:, :, None] * (end - start)
    to_member = np.linalg.norm(solid.vertices[:, None] - nearest, axis=2).min(axis=1)
    to_node = np.linalg.norm(solid.vertices[:, None] - grid.nodes, axis=2).min(axis=1)
    assert np.all((to_member <= 0.4 + 1e-9) | (to_node <= 0.7 + 1e-9))
    assert np.all((to_member >= 0.4 * np.cos(np.pi / 12) - 1e-9) | (to_node >= 0.7 * 0.9))


@pytest.mark.parametrize("suffix", [".3mf", ".stl"])
def test_same_grid_same_bytes(suffix: str, tmp_path: Path) -> None:
    for name in "ab":
        st.print_model(dome(), tmp_path / f"{name}{suffix}", **SIZES)
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize(
    ("unit", "word"),
    [
        ("mm", "millimeter"),
        ("cm", "centimeter"),
        ("m", "meter"),
        ("inch", "inch"),
        ("foot", "foot"),
        ("", "millimeter"),
    ],
)
def test_3mf_carries_the_unit(unit: str, word: str) -> None:
    package = zipfile.ZipFile(io.BytesIO(encode_3mf(build_solid(fan(unit=unit), **SIZES))))
    assert f'<model unit="{word}"' in package.read("3D/3dmodel.model").decode()
    assert package.namelist()[0] == "[Content_Types].xml"
    assert {entry.date_time for entry in package.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_stl_has_the_length_its_count_says() -> None:
    data = encode_stl(build_solid(fan(), **SIZES))
    assert len(data) == 84 + 50 * int.from_bytes(data[80:84], "little") and not data.startswith(b"solid")


@pytest.mark.parametrize("size", [1e-4, 1e-2, 1.0, 1e3, 1e6])
def test_float32_and_welding_readers_do_not_tear_it_at_any_size(size: float, tmp_path: Path) -> None:
    solid = build_solid(icosahedron(10 * size), member_diameter=0.8 * size, node_diameter=1.4 * size)
    vertices, together = put_on_lattice(solid)
    assert together == 0 and len(np.unique(vertices, axis=0)) == len(vertices)
    assert np.abs(vertices - solid.vertices).max() < 40 * lattice_step(solid.vertices) < 1e-3 * 20 * size
    (tmp_path / "a.stl").write_bytes(encode_stl(solid))
    assert trimesh.load(tmp_path / "a.stl").is_watertight


def near_twins() -> Solid:
    """Two tetrahedra that have a corner nearly in common, nearer than float32 can tell."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    vertices = np.concatenate([corners + 1, (1 - corners) - 1e-12])
    triangles = np.concatenate([faces, faces[:, ::-1] + 4])
    return Solid(vertices, triangles, "mm", 1 / 3, 2, 0, 2, 0)


def test_vertices_that_float32_would_weld_are_moved_apart() -> None:
    solid = near_twins()
    assert is_watertight(solid.triangles)
    _, joined = np.unique(solid.vertices.astype(np.float32), axis=0, return_inverse=True)
    assert joined.max() == 6  # so they would be welded ...
    vertices, together = put_on_lattice(solid)
    _, joined = np.unique(vertices, axis=0, return_inverse=True)
    assert together == 0 and joined.max() == 7 and is_watertight(joined.ravel()[solid.triangles])  # ... and are not


def test_stl_that_would_be_torn_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scantruss.export.solid_files.put_on_lattice", lambda solid: put_on_lattice(solid, rounds=0))
    with pytest.raises(st.FormatError, match=r"1 vertices coincide in float32; write a \.3mf"):
        encode_stl(near_twins())


def test_is_watertight_sees_a_hole_a_turned_triangle_and_a_double_one() -> None:
    faces = icosahedron().triangles
    assert is_watertight(faces)
    assert not is_watertight(faces[1:])
    assert not is_watertight(np.concatenate([faces[1:], faces[:1, ::-1]]))
    assert not is_watertight(np.concatenate([faces, faces[:1]]))
    assert not is_watertight(faces[:0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"node_diameter": 0.5}, "node diameter 0.5 mm is smaller than the member diameter 0.8 mm"),
        ({"node_diameter": 10.0}, "node diameter 10 mm is not smaller than the shortest member, 10 mm long"),
        ({"member_diameter": 11.0, "node_diameter": 12.0}, "member diameter 11 mm is not smaller"),
        ({"scale": 0.1}, "the shortest member, 1 mm long at scale 0.1"),
        ({"member_diameter": 0.0}, "member diameter must be a positive number, got 0"),
        ({"node_diameter": float("nan")}, "node diameter must be a positive number, got nan"),
        ({"scale": -1.0}, "scale must be a positive number, got -1"),
        ({"sides": 2}, "sides must be a whole number between 3 and 256, got 2"),
    ],
)
def test_sizes_that_do_not_suit_are_refused_in_words_and_figures(
    change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    with pytest.raises(st.InputError) as error:
        st.print_model(fan(), tmp_path / "a.3mf", **(SIZES | change))
    assert words in str(error.value) and "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_nothing_to_print_is_refused(tmp_path: Path) -> None:
    with pytest.raises(st.InputError, match="no members"):
        st.print_model(make_grid([(0, 0, 0)], []), tmp_path / "a.3mf", **SIZES)


@pytest.mark.parametrize("name", ["a.obj", "a", "none/a.3mf"])
def test_the_place_is_looked_at_before_the_work(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scantruss.export.solid.build_solid", None)
    with pytest.raises(st.FormatError):
        st.print_model(fan(), tmp_path / name, **SIZES)


def test_openings_that_the_thickness_closes_are_said() -> None:
    flat = make_grid([(0, 0, 0), (10, 0, 0), (5, 1.2, 0)], [(0, 1, 2)])
    solid = build_solid(flat, member_diameter=2.0, node_diameter=2.0)
    assert (solid.genus, solid.expected_genus) == (0, 1)
    assert solid.notes == [
        "1 of 1 openings are closed where parts touch; thinner members and nodes keep the openings of the grid"
    ]


def test_pieces_that_touch_are_said() -> None:
    a = fan()
    both = make_grid([*a.nodes, *(a.nodes + np.array([0, 0, 0.6]))], [*a.triangles, *(a.triangles + 7)])
    solid = build_solid(both, **SIZES)
    assert (solid.components, solid.expected_components) == (1, 2)
    assert solid.notes[0] == "pieces of the grid touch: 2 pieces became 1 bodies"


def test_a_grid_that_failed_is_printed_only_where_that_is_asked_for(tmp_path: Path) -> None:
    grid = dome(5)
    fault = Fault("cover", "leaves out 30% of the scan")
    nothing: dict[str, Any] = dict.fromkeys(
        ("reach", "pieces", "scan_pieces", "boundary_loops", "scan_loops", "euler", "handles"), 1
    )
    failed = Certificate(unit="", manifold=True, orientable=True, faults=(fault,), **nothing)
    grid = grid.replace(certificate=failed)
    sizes: dict[str, Any] = {"member_diameter": 0.1, "node_diameter": 0.2}
    with pytest.raises(st.CertificateError, match="failed its certificate: it leaves out 30% of the scan"):
        st.print_model(grid, tmp_path / "a.stl", **sizes)
    assert not (tmp_path / "a.stl").exists()
    assert st.print_model(grid, tmp_path / "a.stl", **sizes, keep_failed=True).components == 1
