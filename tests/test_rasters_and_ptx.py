"""Rasters (ESRI ASCII grids, GeoTIFF), scenes and models (glTF, 3MF, VTK, DXF), and PTX files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import meshio
import numpy as np
import pytest
import rasterio
import trimesh
from scan_files import dxf, geotiff, plate
from test_convert import roof

import scantruss as st
from scantruss.scan.formats.geotiff import read_geotiff, terrain_chunks
from scantruss.scan.formats.gltf import read_gltf
from scantruss.scan.formats.ptx import read_ptx
from scantruss.scan.formats.raster import read_asc
from scantruss.scan.formats.reading import read_content
from scantruss.scan.formats.vtk_xml import read_vtk_xml
from scantruss.scan.stream.thin_scan import thin_scan

#: written by vtk 9.7.2, which is too large a package for tests: (60 or 1600) points 40 a row, height x y / 4, one normal
VTK_FILES = Path(__file__).parent / "vtk_files"
HEIGHTS = np.array([[1.5, 2, 3, 4], [5, -9999, 7, 8], [9, 10, 11, 12.25]])


def raster(path: Path, head: str, heights: np.ndarray = HEIGHTS, end: str = "\n") -> Path:
    rows = end.join(" ".join(map(repr, row)) for row in heights.tolist())
    path.write_text(head.replace("\n", end) + rows + end, encoding="ascii", newline="")
    return path


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("middle", [False, True])
def test_cells_of_a_raster_are_points_at_their_centres(middle: bool, end: str, tmp_path: Path) -> None:
    x, y, word = (380_001.0, 5_810_001.0, "center") if middle else (380_000.0, 5_810_000.0, "corner")
    head = f"NCOLS 4\nNROWS 3\nXLL{word.upper()} {x}\nyll{word} {y}\nCELLSIZE 2\nNODATA_value -9999\n"
    found = read_asc(raster(tmp_path / "a.asc", head, end=end))
    slow = [
        (380_001.0 + 2 * j, 5_810_001.0 + 2 * (2 - i), HEIGHTS[i, j]) for i in range(3) for j in range(4) if HEIGHTS[i, j] != -9999
    ]  # fmt: skip
    np.testing.assert_array_equal(found.points, slow)
    assert found.left_out == {"in cells without data": 1}
    cloud = st.read_points(tmp_path / "a.asc")
    assert len(cloud.points) == 11 and ("in cells without data", 1) in cloud.left_out


def test_a_raster_with_two_sizes_of_cell_and_without_no_data(tmp_path: Path) -> None:
    found = read_asc(raster(tmp_path / "a.asc", "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ndx 1\ndy 10\n"))
    assert len(found.points) == 12 and found.points[:, 1].max() == 25.0 and found.points[:, 0].max() == 3.5


def test_columns_of_text_are_still_read(tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(50, 3))
    np.savetxt(tmp_path / "a.asc", points)
    np.testing.assert_allclose(st.read_points(tmp_path / "a.asc").points, points, atol=1e-6)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("ncols 4\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 1\n", "12 heights where its head promises 16"),
        ("ncols 4\nnrows 3\nxllcorner 0\ncellsize 1\n", "no yllcorner"),
        ("ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\n", "no usable"),
        ("ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize x\n", "not a number"),
        ("ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize -1\n", "no usable"),
    ],
)
def test_damaged_rasters_are_refused(head: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(st.FormatError, match=said):
        st.read_points(raster(tmp_path / "a.asc", head))


def ptx(places: list[tuple[np.ndarray, np.ndarray]]) -> str:
    """Scans, each of (N, 3) points in the frame of its scanner and a 4 x 4 matrix for rows of coordinates."""
    text = ""
    for points, matrix in places:
        text += f"{len(points)}\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
        text += "".join(" ".join(map(repr, row)) + "\n" for row in matrix.tolist())
        text += "".join(" ".join(map(repr, row)) + " 0.5 10 20 30\n" for row in points.tolist())
    return text


def test_scans_of_a_ptx_file_are_placed_and_empty_directions_left_out(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    turn = np.eye(4)
    turn[:3, :3] = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]  # x goes to y
    turn[3, :3] = [1.5, 2, 3]
    one, other = rng.normal(size=(2, 40, 3))
    other[::5] = 0
    (tmp_path / "a.ptx").write_text(ptx([(one, np.eye(4)), (other, turn)]), encoding="ascii")
    found = read_ptx(tmp_path / "a.ptx")
    kept = other[other.any(axis=1)]
    moved = np.stack([1.5 - kept[:, 1], 2 + kept[:, 0], 3 + kept[:, 2]], axis=1)
    np.testing.assert_allclose(found.points, np.concatenate([one, moved]), rtol=0, atol=1e-13)
    assert found.left_out == {"without a return": 8}
    cloud = st.read_points(tmp_path / "a.ptx")
    assert cloud.unit == "m" and len(cloud.points) == 72


@pytest.mark.parametrize("change", ["short", "word", "head", "ragged"])
def test_damaged_ptx_files_are_refused(change: str, tmp_path: Path) -> None:
    text = ptx([(np.random.default_rng(1).normal(size=(20, 3)), np.eye(4))])
    lines = text.splitlines()
    if change == "short":
        lines = lines[:-3]
    elif change == "word":
        lines[15] = "a b c"
    elif change == "head":
        lines[7] = "1 2"
    else:
        lines[15] = "1 2"
    (tmp_path / "a.ptx").write_text("\n".join(lines) + "\n", encoding="ascii")
    with pytest.raises(st.FormatError, match=r"a\.ptx"):
        st.read_points(tmp_path / "a.ptx")


def test_a_geotiff_gives_the_centres_of_its_cells_with_unit_and_system(tmp_path: Path) -> None:
    heights = np.where(np.arange(120) % 7 == 0, -9999.0, plate()[:, 2])
    points = np.column_stack([plate()[:, :2], heights])
    turned = (
        rasterio.Affine.translation(380_000.0, 5_810_000.0)
        @ rasterio.Affine.rotation(30)
        @ rasterio.Affine.scale(3.0, -3.0)
    )
    (tmp_path / "a.tif").write_bytes(
        geotiff(points, nodata=-9999.0, transform=turned, tiled=True, blockxsize=16, blockysize=16)
    )
    cloud = st.read_points(tmp_path / "a.tif")
    slow = [(*(turned @ (k % 12 + 0.5, k // 12 + 0.5)), heights[k]) for k in range(120) if heights[k] != -9999.0]
    np.testing.assert_allclose(cloud.points + cloud.origin, slow, rtol=0, atol=1e-9)
    assert (cloud.unit, cloud.system) == ("m", "EPSG:25833") and cloud.left_out == (("in cells without data", 18),)
    thinned = thin_scan(tmp_path / "a.tif", 0.01)
    np.testing.assert_allclose(np.sort(thinned.points, axis=0), np.sort(slow, axis=0), rtol=0, atol=1e-9)
    assert (thinned.unit, thinned.system) == ("m", "EPSG:25833")


def test_heights_of_a_geotiff_have_their_own_unit(tmp_path: Path) -> None:
    (tmp_path / "a.tif").write_bytes(geotiff(plate(), crs="EPSG:2263+6360", dtype="float32"))  # feet, heights in feet
    cloud = st.read_points(tmp_path / "a.tif")
    assert cloud.unit == "foot" and np.ptp(cloud.points[:, 2]) == pytest.approx(np.ptp(plate()[:, 2]), rel=1e-4)


def test_a_large_raster_is_read_some_rows_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.tif").write_bytes(geotiff(plate()))
    whole = read_geotiff(tmp_path / "a.tif").points
    monkeypatch.setattr("scantruss.scan.formats.geotiff.CELLS_PER_CHUNK", 30)
    parts = [content.points for content in terrain_chunks(tmp_path / "a.tif")]
    assert len(parts) == 5
    np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_a_missing_extra_of_a_reader_is_one_line_with_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.tif").write_bytes(geotiff(plate()))
    monkeypatch.setattr("scantruss.scan.formats.extras.find_spec", lambda name: None)
    with pytest.raises(st.FormatError, match=r"rasterio.*uv sync --extra terrain"):
        st.read_points(tmp_path / "a.tif")


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_a_scene_is_placed_by_its_nodes_and_turned_upright(suffix: str, tmp_path: Path) -> None:
    """Against trimesh: nodes within nodes, one of them turned and stretched."""
    body = trimesh.creation.icosphere(subdivisions=1)
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3], [4, 5, 6]) @ np.diag([1.0, 2.0, 3.0, 1.0])
    scene.add_geometry(body, node_name="a", transform=trimesh.transformations.translation_matrix([10, 20, 30]))
    scene.add_geometry(body, node_name="b", parent_node_name="a", transform=turn)
    scene.add_geometry(trimesh.PointCloud(body.vertices[:5] + 50.0), node_name="c")
    held = scene.export(file_type=suffix[1:])
    for name, data in held.items() if isinstance(held, dict) else [(f"model{suffix}", held)]:
        (tmp_path / name).write_bytes(data)
    found = read_gltf(tmp_path / f"model{suffix}")
    there = np.concatenate([trimesh.transform_points(scene.geometry[shape].vertices, matrix)
                            for matrix, shape in (scene.graph[node] for node in "abc")])  # fmt: skip
    upright = np.stack([there[:, 0], -there[:, 2], there[:, 1]], axis=1)
    order = [np.lexsort(np.round(each, 3).T) for each in (found.points, upright)]
    np.testing.assert_allclose(found.points[order[0]], upright[order[1]], rtol=0, atol=1e-4)
    assert found.metres == 1.0 and found.normals is None  # a part without faces


def test_a_mesh_of_a_scene_has_the_normals_of_its_faces(tmp_path: Path) -> None:
    body = trimesh.creation.icosphere(subdivisions=2)
    for suffix in (".glb", ".3mf"):
        body.export(tmp_path / f"a{suffix}")
        content = read_content(tmp_path / f"a{suffix}")
        assert content.normals is not None and len(content.points) == len(body.vertices)
        outward = content.points / np.linalg.norm(content.points, axis=1, keepdims=True)
        assert (content.normals * outward).sum(axis=1).min() > 0.99


def test_objects_of_a_3mf_file_are_placed_in_its_unit(tmp_path: Path) -> None:
    truss = roof(3)
    st.write(truss, tmp_path / "a.3mf")
    content = read_content(tmp_path / "a.3mf")
    scene: Any = trimesh.load(tmp_path / "a.3mf")
    assert content.metres == 1.0 and len(content.points) == len(scene.to_geometry().vertices)
    np.testing.assert_allclose([content.points.min(axis=0), content.points.max(axis=0)], scene.bounds, atol=1e-6)


@pytest.mark.parametrize("form", ["ascii", "base64", "appended", "raw", "zlib", "lzma"])
@pytest.mark.parametrize("suffix", [".vtp", ".vtu"])
def test_files_that_vtk_wrote_are_read(suffix: str, form: str) -> None:
    content = read_vtk_xml(VTK_FILES / f"{form}{suffix}")
    x, y = np.divmod(np.arange(1600 if form in ("zlib", "lzma") else 60), 40)[::-1]
    np.testing.assert_array_equal(content.points, np.stack([x, y, 0.25 * x * y], axis=1))
    assert content.normals is not None and np.allclose(content.normals, [0.0, 0.6, 0.8])


@pytest.mark.parametrize("packed", ["", "zlib", "lzma"])
@pytest.mark.parametrize("binary", [True, False])
def test_files_that_meshio_wrote_are_read(binary: bool, packed: str, tmp_path: Path) -> None:
    """Of as many points as packed blocks are several for."""
    mesh = meshio.Mesh(plate(9000), [("triangle", np.arange(9000).reshape(-1, 3))])
    mesh.write(tmp_path / "a.vtu", binary=binary, **({"compression": packed or None} if binary else {}))
    np.testing.assert_array_equal(read_vtk_xml(tmp_path / "a.vtu").points, plate(9000))


@pytest.mark.parametrize(("code", "unit"), [(0, ""), (1, "inch"), (2, "foot"), (4, "mm"), (5, "cm"), (6, "m")])
def test_points_of_a_drawing_have_its_unit(code: int, unit: str, tmp_path: Path) -> None:
    (tmp_path / "a.dxf").write_bytes(dxf(plate(), code))
    cloud = st.read_points(tmp_path / "a.dxf")
    np.testing.assert_array_equal(cloud.points + cloud.origin, plate())
    assert cloud.unit == thin_scan(tmp_path / "a.dxf", 1e-3).unit == unit


def test_points_within_blocks_of_a_drawing_are_read(tmp_path: Path) -> None:
    """A survey places a block for each point, a station another with several."""
    drawing = ezdxf.new()
    drawing.header["$INSUNITS"] = 6
    mark, station, empty = (drawing.blocks.new(name) for name in ("MARK", "STATION", "NORTH"))
    mark.add_point((0, 0, 0))
    mark.add_circle((0, 0), 0.1)
    station.add_blockref("MARK", (1, 0, 0))
    station.add_blockref("MARK", (0, 2, 0))
    empty.add_line((0, 0), (0, 1))
    space = drawing.modelspace()
    for place in plate(50).tolist():
        space.add_blockref("MARK", place, {"rotation": 30})
    space.add_blockref("STATION", (10, 20, 5), {"rotation": 90})
    space.add_blockref("NORTH", (0, 0, 0))
    drawing.saveas(tmp_path / "a.dxf")
    cloud = st.read_points(tmp_path / "a.dxf")
    there = [*plate(50).tolist(), (10, 21, 5), (8, 20, 5)]
    np.testing.assert_allclose(cloud.points + cloud.origin, there, atol=1e-9)
    assert "1 other entities of a.dxf are not read" in cloud.notes
