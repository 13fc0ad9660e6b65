"""GLB, glTF in one file: members as tubes, coloured by their utilization, nodes, panels and the scan, as a browser shows them.

Metres, y up, relative to the origin, which stands in the extras of the root: what draws it reckons in float32.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ..runtime.ours import MADE_BY
from .bodies import bodies_of, member_axes
from .model import Model
from .style import FileStyle

SIDES_OF_TUBE = 8  #: of a tube
SCAN_POINTS = 200_000  #: of the scan
TUBE_SYMBOL = 1 / 60  #: radius of a member without section, in mean member lengths
Y_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  #: quaternion that turns z up into y up
STEEL_COLOUR, PANEL_COLOUR = (0.55, 0.6, 0.66, 1.0), (0.75, 0.82, 0.9, 0.45)
BALL_COLOUR, SCAN_COLOUR = (0.25, 0.27, 0.3, 1.0), (0.1, 0.1, 0.1, 1.0)
COLOUR_RAMP = np.array(
    [(38, 130, 142), (94, 201, 98), (253, 200, 37), (200, 30, 30)], float
)  #: of utilization 0, 1/3, 2/3, 1 and more
FLOAT, UINT, BYTE = 5126, 5125, 5121  #: of glTF
AS_POINTS, AS_TRIANGLES = 0, 4  # how glTF draws a primitive


class _Buffer:
    """The binary part, with its views and accessors."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, array: np.ndarray, kind: int, shape: str, target: int, **more: Any) -> int:
        """Add an array and return its accessor; limits of what has three columns."""
        content = np.ascontiguousarray(array).tobytes()
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content), "target": target})
        self.data += content + b"\0" * (-len(content) % 4)
        limits = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()} if shape == "VEC3" else {}
        view = {"bufferView": len(self.views) - 1, "componentType": kind, "count": len(array), "type": shape}
        self.accessors.append(view | limits | more)
        return len(self.accessors) - 1


def encode_glb(model: Model, style: FileStyle) -> bytes:
    """Return a GLB file; of a grid without a unit one metre a unit."""
    metres = model.metres
    nodes = model.local * metres
    mean = float(model.lengths.mean()) * metres if len(model.members) else 1.0
    bodies = bodies_of(model, style) if model.truss is not None or style.tube is not None else None
    if bodies is None:
        radii, axes, ball = (
            np.full(len(model.members), TUBE_SYMBOL * mean),
            member_axes(model),
            1.5 * TUBE_SYMBOL * mean,
        )
    else:
        widths = np.array([max(each.width, each.depth) / 2 for each in bodies.sections])
        radii, axes, ball = widths[bodies.section_of], bodies.axes, bodies.ball
    buffer = _Buffer()
    meshes: list[dict[str, Any]] = []
    materials: list[dict[str, Any]] = []

    def mesh(
        name: str, places: np.ndarray, colour: tuple[float, ...], triangles: np.ndarray | None, **more: Any
    ) -> None:
        """Add a mesh with a material of its own, or points."""
        if len(places) == 0 or (triangles is not None and len(triangles) == 0):
            return
        attributes = {"POSITION": buffer.add(places.astype("<f4"), FLOAT, "VEC3", 34962), **more}
        part: dict[str, Any] = {"attributes": attributes, "mode": AS_POINTS, "material": len(materials)}
        if triangles is not None:
            part |= {
                "mode": AS_TRIANGLES,
                "indices": buffer.add(triangles.astype("<u4").ravel(), UINT, "SCALAR", 34963),
            }
        surface = {"baseColorFactor": list(colour), "metallicFactor": 0.0, "roughnessFactor": 0.7}
        blend = {"alphaMode": "BLEND"} if colour[3] < 1 else {}
        materials.append({"name": name, "pbrMetallicRoughness": surface, "doubleSided": True} | blend)
        meshes.append({"name": name, "primitives": [part]})

    places, normals, triangles = _tubes(nodes, model.members, radii, axes)
    more, colour = (
        {"NORMAL": buffer.add(normals.astype("<f4"), FLOAT, "VEC3", 34962)} if len(normals) else {},
        STEEL_COLOUR,
    )
    if model.utilization is not None and len(normals):
        shades = np.repeat(linear(colours_of(model.utilization)), 2 * SIDES_OF_TUBE, axis=0)
        more["COLOR_0"] = buffer.add(shades, BYTE, "VEC4", 34962, normalized=True)
        colour = (1.0, 1.0, 1.0, 1.0)
    mesh("members", places, colour, triangles, **more)
    if ball:
        mesh("nodes", *_balls(nodes, ball))
    mesh("panels", nodes, PANEL_COLOUR, model.triangles)
    if model.cloud is not None:
        points = model.cloud.points[:: -(-len(model.cloud.points) // SCAN_POINTS)]
        mesh("scan", (points + (model.cloud.origin - model.origin)) * metres, SCAN_COLOUR, None)
    about = {"origin": (model.origin * metres).tolist(), "unit": "m", "unit of the grid": model.unit}
    root = {"name": "ScanTruss", "rotation": Y_UP, "children": list(range(1, len(meshes) + 1)), "extras": about}
    if not meshes:
        del root["children"]
    content = {
        "asset": {"version": "2.0", "generator": MADE_BY},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [root, *({"name": each["name"], "mesh": k} for k, each in enumerate(meshes))],
        "meshes": meshes, "materials": materials, "accessors": buffer.accessors, "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}] if buffer.data else [],
    }  # fmt: skip
    text = json.dumps({key: value for key, value in content.items() if value != []}, ensure_ascii=False).encode("utf-8")
    text += b" " * (-len(text) % 4)
    chunks = _chunk(text, b"JSON") + (_chunk(bytes(buffer.data), b"BIN\0") if buffer.data else b"")
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks


def colours_of(utilization: np.ndarray) -> np.ndarray:
    """Return the (M, 4) colours of utilizations, red from 1 on; grey where there is none."""
    share = np.clip(np.nan_to_num(utilization), 0.0, 1.0) * (len(COLOUR_RAMP) - 1)
    low = np.minimum(share.astype(int), len(COLOUR_RAMP) - 2)
    shades = COLOUR_RAMP[low] + (COLOUR_RAMP[low + 1] - COLOUR_RAMP[low]) * (share - low)[:, None]
    shades[np.isnan(utilization)] = 128.0
    return np.column_stack([shades.round(), np.full(len(shades), 255.0)]).astype(np.uint8)


def linear(colours: np.ndarray) -> np.ndarray:
    """Return colours as glTF wants them: in proportion to the light (IEC 61966-2-1), not as screens count it."""
    share = colours / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    light[:, 3] = share[:, 3]
    return (255 * light).round().astype(np.uint8)


def _chunk(content: bytes, kind: bytes) -> bytes:
    return len(content).to_bytes(4, "little") + kind + content


def _tubes(
    nodes: np.ndarray, members: np.ndarray, radii: np.ndarray, axes: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places, normals and triangles of open tubes around the members, two rings each."""
    angle = 2 * np.pi * np.arange(SIDES_OF_TUBE) / SIDES_OF_TUBE
    normals = axes[:, None, 1] * np.cos(angle)[:, None] + axes[:, None, 2] * np.sin(angle)[:, None]
    rings = nodes[members][:, :, None] + (radii[:, None, None] * normals)[:, None]
    here, there = np.arange(SIDES_OF_TUBE), (np.arange(SIDES_OF_TUBE) + 1) % SIDES_OF_TUBE
    one = np.concatenate(
        [
            np.stack([here, there, here + SIDES_OF_TUBE], 1),
            np.stack([there, there + SIDES_OF_TUBE, here + SIDES_OF_TUBE], 1),
        ]
    )
    triangles = one + 2 * SIDES_OF_TUBE * np.arange(len(members))[:, None, None]
    return rings.reshape(-1, 3), np.repeat(normals, 2, axis=0).reshape(-1, 3), triangles.reshape(-1, 3)


def _balls(nodes: np.ndarray, radius: float) -> tuple[np.ndarray, tuple[float, ...], np.ndarray]:
    """Return places, colour and triangles of balls, each an octahedron with every triangle divided in four."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [(a, b, c) for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    faces = [face if np.linalg.det(corners[list(face)]) > 0 else face[::-1] for face in faces]
    edges = sorted({tuple(sorted(pair)) for face in faces for pair in zip(face, face[1:] + face[:1], strict=True)})
    number = {edge: 6 + k for k, edge in enumerate(edges)}
    middle = np.array([corners[list(edge)].mean(axis=0) for edge in edges])
    places = np.concatenate([corners, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
    small = []
    for a, b, c in faces:
        ab, bc, ca = (number[min(pair), max(pair)] for pair in ((a, b), (b, c), (c, a)))
        small += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    triangles = np.array(small) + len(places) * np.arange(len(nodes))[:, None, None]
    return (nodes[:, None] + radius * places).reshape(-1, 3), BALL_COLOUR, triangles.reshape(-1, 3)
