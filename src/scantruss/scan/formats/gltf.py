"""glTF and GLB files: the vertices of all meshes in the scene, placed by their nodes, in metres and with z up.

The reader is our own: libraries drop vertices without a face, or merge them.
"""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError
from .content import Content
from .faces import normals_from_faces
from .kinds import kind_of, read_head, reading_as, wrong_kind

GLB_HEAD = 12  # bytes: the word glTF, the version, the length of the file
CHUNK_HEAD = 8  # bytes: the length of a part of the file and its kind
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942  # kinds of parts
COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}  # types of numbers
TRIANGLE_LIST = 4  # mode of a primitive; the others are not read as faces
PACKED_MESHES = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
Z_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # rows are where x, y (up) and z of the file go

Gltf = dict[str, Any]


def read_gltf(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a .glb or .gltf file in metres, with normals where all of it is triangles."""
    head = read_head(path)
    if kind_of(head) not in ("a glTF file", "a JSON file"):
        raise wrong_kind(path, head, "a glTF file")
    with reading_as(path, "glTF"):
        held, blob = _glb(path) if head.startswith(b"glTF") else (_json(path, path.read_bytes()), None)
        if packed := [name for name in PACKED_MESHES if name in held.get("extensionsUsed", ())]:
            raise FormatError(f"{path} is compressed ({packed[0]}); export it without compression")
        buffers = [_buffer(path, each, blob) for each in held.get("buffers", ())]
        points, faces, count = list[np.ndarray](), list[np.ndarray](), 0
        all_faces = True
        for matrix, mesh in _placed_meshes(path, held):
            read: dict[int, int] = {}  # accessor -> its first point, as parts of a mesh may share their vertices
            for part in held["meshes"][mesh]["primitives"]:
                accessor = part["attributes"]["POSITION"]
                if accessor not in read:
                    read[accessor] = count
                    places = _numbers(path, held, buffers, accessor, 3) @ matrix[:3, :3].T + matrix[:3, 3]
                    points.append(places @ Z_UP)
                    count += len(places)
                if part.get("mode", TRIANGLE_LIST) != TRIANGLE_LIST:
                    all_faces = False
                    continue
                size = held["accessors"][accessor]["count"]
                ids = (
                    _numbers(path, held, buffers, part["indices"], 1).ravel() if "indices" in part else np.arange(size)
                )
                faces.append(ids[: len(ids) // 3 * 3].reshape(-1, 3).astype(np.int64) + read[accessor])
    if not points:
        raise FormatError(f"{path} has no mesh and no points in its scene")
    together = np.concatenate(points)
    return Content(
        together, metres=1.0, z_metres=1.0, normals=normals_from_faces(together, faces) if all_faces else None
    )


def _glb(path: Path) -> tuple[Gltf, bytes | None]:
    data = path.read_bytes()
    version, length = np.frombuffer(data, "<u4", 2, 4).tolist() if len(data) >= GLB_HEAD else (0, 0)
    if version != 2:
        raise FormatError(f"{path} is a GLB file of version {version}; version 2 is read, so export it again")
    if length > len(data):
        raise FormatError(f"{path} ends early: its header promises {length:,} bytes, got {len(data):,}; copy it again")
    held, blob, place = None, None, GLB_HEAD
    while place + CHUNK_HEAD <= length:  # each turn goes past one part
        size, kind = np.frombuffer(data, "<u4", 2, place).tolist()
        part = data[place + CHUNK_HEAD : place + CHUNK_HEAD + size]
        if kind == JSON_CHUNK and held is None:
            held = _json(path, part)
        elif kind == BINARY_CHUNK and blob is None:
            blob = part
        place += CHUNK_HEAD + size
    if held is None:
        raise FormatError(f"{path} has no description of its scene; copy it again")
    return held, blob


def _json(path: Path, text: bytes) -> Gltf:
    held = json.loads(text.decode("utf-8"))
    if not isinstance(held, dict) or "asset" not in held:
        raise FormatError(f"{path} is JSON but not glTF: it has no asset; export it again")
    return held


def _buffer(path: Path, buffer: Gltf, blob: bytes | None) -> bytes:
    """Return the bytes of a buffer: of the GLB, in the text, or of a file beside it."""
    uri = buffer.get("uri")
    if uri is None:
        data = blob or b""
    elif uri.startswith("data:"):
        try:
            data = base64.b64decode(uri.partition(",")[2], validate=True)
        except binascii.Error:
            raise FormatError(f"{path} has damaged base64; export it again") from None
    else:
        place = path.parent / Path(uri).name
        if not place.is_file():
            raise FormatError(f"{path} needs the file {Path(uri).name} beside it, which is missing")
        data = place.read_bytes()
    if len(data) < buffer["byteLength"]:
        raise FormatError(
            f"{path} ends early: a buffer has {len(data):,} of {buffer['byteLength']:,} bytes; copy it again"
        )
    return data


def _placed_meshes(path: Path, held: Gltf) -> Iterator[tuple[np.ndarray, int]]:
    """Yield where each mesh of the scene lies, (4, 4), and its number."""
    nodes = held.get("nodes", [])
    scenes = held.get("scenes", [])
    roots = scenes[held.get("scene", 0)].get("nodes", ()) if scenes else range(len(nodes))
    waiting, visits = [(np.eye(4), root) for root in roots], 0
    while waiting:  # ends: no more visits than nodes
        parent, number = waiting.pop(0)
        visits += 1
        if visits > len(nodes):
            raise FormatError(f"{path} has a node in two places of its scene; export it again")
        matrix = parent @ _matrix(nodes[number])
        if "mesh" in nodes[number]:
            yield matrix, nodes[number]["mesh"]
        waiting += [(matrix, child) for child in nodes[number].get("children", ())]


def _matrix(node: Gltf) -> np.ndarray:
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), float)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _numbers(path: Path, held: Gltf, buffers: list[bytes], number: int, width: int) -> np.ndarray:
    """Return the numbers of an accessor (N, width)."""
    accessor = held["accessors"][number]
    if "sparse" in accessor or "bufferView" not in accessor:
        raise FormatError(f"{path} has sparse accessors, which are not read; export it without")
    view = held["bufferViews"][accessor["bufferView"]]
    kind = np.dtype(COMPONENTS[accessor["componentType"]])
    count, step = int(accessor["count"]), int(view.get("byteStride") or width * kind.itemsize)
    start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
    data = buffers[view["buffer"]]
    if (
        count < 0
        or start < 0
        or step < kind.itemsize
        or (count and start + (count - 1) * step + width * kind.itemsize > len(data))
    ):
        raise FormatError(
            f"{path} ends early: an accessor promises {count:,} values that its buffer does not hold; copy it again"
        )
    rows = np.ndarray((count, width), kind, data, start, (step, kind.itemsize))
    if width == 1:
        return rows
    places = rows.astype(np.float64)
    if accessor.get("normalized") and kind.kind in "iu":
        places = np.maximum(places / np.iinfo(kind).max, -1.0)
    return places
