"""Small whole files of every format that is read, to read them back, to break them and to fuzz them."""

from __future__ import annotations

import base64
import gzip
import io
import json
import struct
import tempfile
import warnings
import zlib
from pathlib import Path
from typing import Any

import ezdxf
import laspy
import lzf
import meshio
import numpy as np
import rasterio
import rasterio.errors
import trimesh
from copc_file import copc
from e57_file import Column, write_scans
from numpy.lib import recfunctions

from scantruss.scan.formats.writing import write_points

COUNT = 120
TURN = (
    '<pose type="Structure"><rotation type="Structure"><w type="Float">0.6</w><x type="Float">0</x><y type="Float">0</y>'
    '<z type="Float">0.8</z></rotation><translation type="Structure"><x type="Float">100</x><y type="Float">5</y>'
    '<z type="Float">1</z></translation></pose>'
)
TURNED = np.array([[-0.28, -0.96, 0], [0.96, -0.28, 0], [0, 0, 1]])  # the same as a matrix
MOVED = np.array([100.0, 5.0, 1.0])


def plate(count: int = COUNT) -> np.ndarray:
    """Points with three decimals on a slightly arched plate, (count, 3)."""
    x, y = np.random.default_rng(8).random((2, count)) * [[40], [30]]
    return np.round(np.stack([x, y, 0.02 * x * (40 - x)], axis=1), 3)


def pcd(fields: list[tuple[str, str, np.ndarray]], data: str, more: str = "") -> bytes:
    """Return a PCD file of fields: name, type of numpy, values (N,) or (N, count)."""
    count = len(fields[0][2])
    columns = [
        np.asarray(values).reshape(count, *np.shape(values)[1:] or (1,)).astype(kind) for _, kind, values in fields
    ]
    kinds = [column.dtype for column in columns]
    head = (
        f"# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {' '.join(name for name, _, _ in fields)}\n"
        f"SIZE {' '.join(str(kind.itemsize) for kind in kinds)}\n"
        f"TYPE {' '.join({'f': 'F', 'i': 'I', 'u': 'U'}[kind.kind] for kind in kinds)}\n"
        f"COUNT {' '.join(str(column.shape[1]) for column in columns)}\nWIDTH {count}\nHEIGHT 1\n"
        f"{more or 'VIEWPOINT 0 0 0 1 0 0 0'}\nPOINTS {count}\nDATA {data}\n"
    ).encode()
    if data == "ascii":
        rows = zip(*(column.tolist() for column in columns), strict=True)
        lines = ["  ".join(f"{value!r}" for cell in row for value in cell) for row in rows]
        return head + "\n".join(lines).encode() + b"\n"
    if data == "binary":
        return head + b"".join(b"".join(column[i].tobytes() for column in columns) for i in range(count))
    raw = b"".join(column.tobytes() for column in columns)
    packed = lzf.compress(raw)
    assert packed is not None and len(packed) < len(raw)
    return head + struct.pack("<II", len(packed), len(raw)) + packed


def las(
    points: np.ndarray,
    suffix: str = ".las",
    records: tuple[laspy.VLR, ...] = (),
    version: str = "1.4",
    **fields: np.ndarray,
) -> bytes:
    """Return a LAS or LAZ file with attributes and variable length records."""
    header = laspy.LasHeader(point_format=6 if version == "1.4" else 1, version=version)
    header.scales, header.offsets = [0.001] * 3, [0.0] * 3
    header.vlrs.extend(records)
    record = laspy.LasData(header)
    record.x, record.y, record.z = points.T
    for name, values in fields.items():
        record[name] = values
    file = io.BytesIO()
    record.write(file, do_compress=suffix == ".laz")
    return file.getvalue()


def e57(*scans: tuple[list[Column], str]) -> bytes:
    """Return an E57 file of scans: columns and the XML of a pose."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.e57"
        write_scans(path, scans)
        return path.read_bytes()


def axes(points: np.ndarray, kind: str = "double", **options: float) -> list[Column]:
    """Return the columns of cartesian coordinates."""
    return [Column(f"cartesian{axis}", points[:, i], kind, **options) for i, axis in enumerate("XYZ")]  # type: ignore[arg-type]


def written(suffix: str, points: np.ndarray) -> bytes:
    """Return what our writer makes of points."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{suffix}"
        write_points(path, points, unit="m")
        return path.read_bytes()


def text(points: np.ndarray, head: str = "", sign: str = " ") -> bytes:
    return (head + "".join(sign.join(f"{c:.3f}" for c in row) + "\n" for row in points)).encode()


def stl(points: np.ndarray) -> bytes:
    corners = points[: len(points) // 3 * 3].reshape(-1, 9)
    facets = b"".join(struct.pack("<12fH", 0, 0, 1, *row, 0) for row in corners)
    return bytes(80) + struct.pack("<I", len(corners)) + facets


def stl_text(points: np.ndarray) -> bytes:
    lines = ["solid a"]
    for corners in points[: len(points) // 3 * 3].reshape(-1, 3, 3):
        lines += ["facet normal 0 0 1", " outer loop", *(f"  vertex {x!r} {y!r} {z!r}" for x, y, z in corners.tolist())]
        lines += [" endloop", "endfacet"]
    return ("\n".join(lines) + "\nendsolid a\n").encode()


def ply_ascii(points: np.ndarray) -> bytes:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n" + "".join(f"property float {a}\n" for a in "xyz")
    faces = "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    return text(points, head + faces) + b"3 0 1 2\n3 1 2 3\n"


def npy(points: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, points)
    return file.getvalue()


def whole_files() -> dict[str, bytes]:
    """Return whole files by their names, one or more of every suffix; Parquet only where pyarrow is installed."""
    p = plate()
    three = list(zip("xyz", ["f4", "f8", "f4"], p.T, strict=True))
    rows = recfunctions.unstructured_to_structured(p, np.dtype([(a, "f8") for a in "xyz"]))
    files = {f"own{suffix}": written(suffix, p) for suffix in (".ply", ".laz", ".npz", ".pcd", ".csv")}
    files |= {
        "a.ply": ply_ascii(p), "a.las": las(p), "a.laz": las(p, ".laz"), "a.copc.laz": copc(p)[0],
        "a.xyz": text(p), "a.txt": text(p, "# x y z\n"), "a.asc": text(p, "", "\t"), "a.csv": text(p, "X;Y;Z\n", ";"),
        "a.pts": text(p, f"{len(p)}\n"), "a.xyz.gz": gzip.compress(text(p), mtime=0),
        "a.pcd": pcd(three, "ascii"), "b.pcd": pcd(three, "binary"),
        "c.pcd": pcd([*three, ("label", "u4", np.zeros(len(p)))], "binary_compressed"),
        "a.e57": e57((axes(p, "scaled", low=-10, high=60_000, scale=0.001), TURN), (axes(p), "")),
        "a.stl": stl(p), "b.stl": stl_text(p), "a.npy": npy(p), "b.npy": npy(rows), "b.e57": e57((axes(p), "")),
        "a.obj": b"".join(b"v " + line + b"\n" for line in text(p).splitlines()) + b"f 1 2 3\n",
        "a.off": text(p, f"OFF\n{len(p)} 1 0\n") + b"3 0 1 2\n",
    }  # fmt: skip
    files |= {
        "a.glb": glb(p), "a.gltf": gltf(p), "a.3mf": threemf(p), "a.tif": geotiff(p), "a.dxf": dxf(p), "a.vtu": vtu(p),
        "a.vtp": vtp(p, "ascii"), "b.vtp": vtp(p, "binary"), "c.vtp": vtp(p, "raw"), "d.vtp": vtp(p, "zlib"),
    }  # fmt: skip
    if parquet := parquet_file(p):
        files["a.parquet"] = parquet
    return files


def glb(points: np.ndarray) -> bytes:
    """A cloud as trimesh writes it; y is up."""
    return bytes(trimesh.Scene(trimesh.PointCloud(points[:, [0, 2, 1]] * [1, 1, -1])).export(file_type="glb"))


def gltf(points: np.ndarray) -> bytes:
    """The same as text, with its buffer within."""
    held = trimesh.Scene(trimesh.PointCloud(points[:, [0, 2, 1]] * [1, 1, -1])).export(file_type="gltf")
    model = json.loads(held.pop("model.gltf"))
    for buffer in model["buffers"]:
        buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(held[buffer["uri"]]).decode()
    return json.dumps(model).encode()


def threemf(points: np.ndarray) -> bytes:
    """A mesh as trimesh writes it."""
    faces = np.arange(len(points) // 3 * 3).reshape(-1, 3)
    mesh = trimesh.Trimesh(points, faces, process=False)
    mesh.units = "meter"
    return bytes(mesh.export(file_type="3mf"))


def geotiff(points: np.ndarray, **others: Any) -> bytes:
    """A raster of 12 x 10 heights as GDAL writes it, in UTM zone 33."""
    profile = {"driver": "GTiff", "width": 12, "height": len(points) // 12, "count": 1, "dtype": "float64", "crs": "EPSG:25833",
               "transform": rasterio.Affine(3.0, 0, 380_000.0, 0, -3.0, 5_810_000.0)} | others  # fmt: skip
    heights = points[: 12 * (len(points) // 12), 2].reshape(1, -1, 12).repeat(profile["count"], 0)
    with rasterio.MemoryFile() as memory:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rasterio.errors.NotGeoreferencedWarning)
            with memory.open(**profile) as file:
                if "width" not in others:  # else it is left empty
                    file.write(heights.astype(profile["dtype"]))
        return bytes(memory.read())


def dxf(points: np.ndarray, unit: int = 6) -> bytes:
    """Points as ezdxf writes them."""
    drawing = ezdxf.new(units=unit)
    for place in points.tolist():
        drawing.modelspace().add_point(place)
    stream = io.StringIO()
    drawing.write(stream)
    return stream.getvalue().encode()


def vtu(points: np.ndarray) -> bytes:
    """Points as meshio writes them, packed by zlib."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.vtu"
        meshio.Mesh(points, [("vertex", np.arange(len(points)).reshape(-1, 1))]).write(path)
        return path.read_bytes()


def vtp(points: np.ndarray, form: str) -> bytes:
    """Points with normals by the description of the format: ascii, binary, raw (appended) or packed by zlib."""
    arrays, appended = [], b""
    for name, values in (("Points", points), ("N", np.tile([0.0, 0, 1], (len(points), 1)))):
        data = values.astype("<f8").tobytes()
        said = f'<DataArray type="Float64" Name="{name}" NumberOfComponents="3" format='
        if form == "ascii":
            arrays.append(f'{said}"ascii">{" ".join(map(repr, values.ravel().tolist()))}</DataArray>')
        elif form == "raw":
            arrays.append(f'{said}"appended" offset="{len(appended)}"/>')
            appended += struct.pack("<Q", len(data)) + data
        elif form == "binary":
            arrays.append(
                f'{said}"binary">{base64.b64encode(struct.pack("<Q", len(data)) + data).decode()}</DataArray>'
            )
        else:
            blocks = [data[k : k + 1024] for k in range(0, len(data), 1024)]
            packed = [zlib.compress(block) for block in blocks]
            heads = struct.pack(f"<{3 + len(blocks)}Q", len(blocks), 1024, len(blocks[-1]) % 1024, *map(len, packed))
            words = base64.b64encode(heads) + base64.b64encode(b"".join(packed))
            arrays.append(f'{said}"binary">{words.decode()}</DataArray>')
    packer = ' compressor="vtkZLibDataCompressor"' if form == "zlib" else ""
    head = f'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64"{packer}>'
    body = f'<PolyData><Piece NumberOfPoints="{len(points)}"><PointData Normals="N">{arrays[1]}</PointData>'
    tail = f"<Points>{arrays[0]}</Points></Piece></PolyData>"
    more = b'<AppendedData encoding="raw">\n_' + appended + b"\n</AppendedData>" if form == "raw" else b""
    return (head + body + tail).encode() + more + b"</VTKFile>\n"


def parquet_file(points: np.ndarray) -> bytes | None:
    """Return a Parquet file with columns in another order; None without pyarrow."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        return None
    file = io.BytesIO()
    parquet.write_table(
        pyarrow.table({"Z": points[:, 2], "name": ["a"] * len(points), "Y": points[:, 1], "x": points[:, 0]}), file
    )
    return file.getvalue()
