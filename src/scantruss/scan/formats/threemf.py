"""3MF files: the vertices of all objects that are built, placed, in the unit of the model."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...errors import FormatError
from .content import Content
from .faces import normals_from_faces
from .kinds import read_head, reading_as, wrong_kind
from .packed import check_size

METRES_3MF = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}
MODEL_PART = "3D/3dmodel.model"  # where the model is, unless the relations of the package say another place
MOST_PARTS_3MF = 1_000_000  # objects that are built, those within others included

PlacedMeshes = list[tuple[np.ndarray, np.ndarray]]  # points (N, 3) and triangles (T, 3) of each mesh


def read_3mf(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a 3MF file, with normals by its triangles."""
    root = _root(path)
    with reading_as(path, "3MF"):
        space = root.tag[: root.tag.index("}") + 1] if root.tag.startswith("{") else ""
        objects = {each.get("id", ""): each for each in root.iter(f"{space}object")}
        meshes: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        parts: PlacedMeshes = []
        items = [(item.get("objectid", ""), _frame(item), 0) for item in root.iter(f"{space}item")]
        waiting = items or [(name, np.vstack([np.eye(3), np.zeros(3)]), 0) for name in objects]
        visits = 0
        while waiting:  # ends: no more visits than MOST_PARTS_3MF
            name, frame, depth = waiting.pop()
            visits += 1
            if depth > len(objects) or visits > MOST_PARTS_3MF:
                raise FormatError(f"{path} has objects within each other without end; export it again")
            each = objects[name]
            mesh = each.find(f"{space}mesh")
            if mesh is not None:
                if name not in meshes:
                    meshes[name] = _mesh(mesh, space)
                points, triangles = meshes[name]
                parts.append((points @ frame[:3] + frame[3], triangles))
            for inner in each.iter(f"{space}component"):
                own = _frame(inner)
                waiting.append(
                    (
                        inner.get("objectid", ""),
                        np.vstack([own[:3] @ frame[:3], own[3] @ frame[:3] + frame[3]]),
                        depth + 1,
                    )
                )
        if not parts or not sum(len(points) for points, _ in parts):
            raise FormatError(f"{path} holds no mesh")
        together = np.concatenate([points for points, _ in reversed(parts)])
        starts = np.cumsum([0, *(len(points) for points, _ in reversed(parts))])
        faces = [
            triangles + start
            for (_, triangles), start in zip(reversed(parts), starts[:-1], strict=True)
            if len(triangles)
        ]
        metres = METRES_3MF[root.get("unit", "millimeter")]
    return Content(together, metres=metres, normals=normals_from_faces(together, faces))


def metres_of_3mf(path: Path) -> float:
    """Return the metres of the unit of a 3MF file."""
    with reading_as(path, "3MF"):
        return METRES_3MF[_root(path).get("unit", "millimeter")]


def _root(path: Path) -> ElementTree.Element:
    head = read_head(path)
    if not head.startswith(b"PK"):
        raise wrong_kind(path, head, "a 3MF file")
    with reading_as(path, "3MF"), zipfile.ZipFile(path) as package:
        names = package.namelist()
        relations = package.read("_rels/.rels").decode("utf-8") if "_rels/.rels" in names else ""
        target = re.search(r'Target="/?([^"]+\.model)"', relations)
        name = target[1] if target else MODEL_PART
        if name not in names:
            raise FormatError(f"{path} is not a 3MF file but a zip archive; a 3MF file holds a 3D model")
        check_size(path, package.getinfo(name).file_size)
        text = package.read(name)
        if b"<!DOCTYPE" in text:
            raise FormatError(f"{path} has entities of its own, which no 3MF file needs; export it again")
        return ElementTree.fromstring(text)


def _mesh(mesh: ElementTree.Element, space: str) -> tuple[np.ndarray, np.ndarray]:
    points = [[float(v.get(axis, "")) for axis in "xyz"] for v in mesh.iter(f"{space}vertex")]
    triangles = [[int(t.get(corner, "")) for corner in ("v1", "v2", "v3")] for t in mesh.iter(f"{space}triangle")]
    return np.array(points, float).reshape(-1, 3), np.array(triangles, np.int64).reshape(-1, 3)


def _frame(element: ElementTree.Element) -> np.ndarray:
    """Return the (4, 3) transform of rows of coordinates."""
    words = element.get("transform")
    return np.vstack([np.eye(3), np.zeros(3)]) if words is None else np.array(words.split(), float).reshape(4, 3)
