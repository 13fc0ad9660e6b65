"""Range scans of a body with known poses: what a scanner sees from one side, each in a frame of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """A rotation (3, 3), all alike likely."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def random_pose(rng: np.random.Generator, far: float = 3.0) -> np.ndarray:
    """A pose (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = random_rotation(rng), far * rng.normal(size=3)
    return pose


def body(seed: int, bumps: int = 14, height: float = 0.3) -> Callable[[np.ndarray], np.ndarray]:
    """A star-shaped body about the origin: a function from directions (N, 3) to radii (N,)."""
    rng = np.random.default_rng(seed)
    centre = rng.normal(size=(bumps, 3))
    centre /= np.linalg.norm(centre, axis=1)[:, None]
    size, width = rng.uniform(-height, height, bumps), rng.uniform(0.15, 0.5, bumps)
    return lambda u: 1.0 + (size * np.exp(-(((u[:, None] - centre) / width[:, None]) ** 2).sum(axis=2))).sum(axis=1)


def surface(radius: Callable[[np.ndarray], np.ndarray], u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and outward normals of a body in given directions (N, 3)."""
    u = u / np.linalg.norm(u, axis=1)[:, None]
    across = np.cross(u, np.eye(3)[np.abs(u).argmin(axis=1)])
    step, points = 1e-4, radius(u)[:, None] * u
    ahead = []
    for aside in (across, np.cross(u, across)):
        v = u + step * aside
        v /= np.linalg.norm(v, axis=1)[:, None]
        ahead.append(radius(v)[:, None] * v - points)
    normal = np.cross(ahead[0], ahead[1])
    normal *= np.sign((normal * u).sum(axis=1))[:, None]
    return points, normal / np.linalg.norm(normal, axis=1)[:, None]


def scans_of(
    radius: Callable[[np.ndarray], np.ndarray],
    views: Iterable[ArrayLike],
    rng: np.random.Generator,
    count: int = 12_000,
    noise: float = 0.0,
    scale: float = 1.0,
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Scans [(N, 3)] of a body from view directions, and the poses (4, 4) from the frame of each into that of the body.

    What is drawn for one does not depend on how many points the other shows: rounding decides that for the last ones.
    """
    scans, poses = [], []
    for view in views:
        points, normal = surface(radius, rng.normal(size=(count, 3)))
        is_seen = normal @ (np.asarray(view) / np.linalg.norm(view)) > 0.3
        spacing = np.sqrt(4 * np.pi / count) * 0.5
        pose = random_pose(rng)
        world = scale * (points + noise * spacing * rng.normal(size=points.shape))[is_seen]
        pose[:3, 3] *= scale
        poses.append(pose)
        scans.append((world - pose[:3, 3]) @ pose[:3, :3])
    return scans, poses


def around(count: int, rng: np.random.Generator) -> np.ndarray:
    """View directions (count, 3) around a body, some from above and some from below."""
    turn = 2 * np.pi * np.arange(count) / count
    return np.stack([np.cos(turn), np.sin(turn), rng.uniform(-0.5, 0.5, count)], axis=1)


def errors_of(
    found: Mapping[str, np.ndarray], true: Sequence[np.ndarray], scans: Sequence[np.ndarray], names: Sequence[str]
) -> tuple[float, float]:
    """Largest rotation [degree] and mean displacement [scan unit] of poses by name against true ones, in the frame of the first."""
    home_found, home_true = (np.linalg.inv(p) for p in (found[names[0]], true[0]))
    turned, moved = [], []
    for name, pose, points in zip(names, true, scans, strict=True):
        if name in found:
            a, b = home_found @ found[name], home_true @ pose
            cosine = 0.5 * (np.trace(a[:3, :3].T @ b[:3, :3]) - 1.0)
            turned.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
            moved.append(np.linalg.norm(points @ (a - b)[:3, :3].T + (a - b)[:3, 3], axis=1).mean())
    return max(turned), max(moved)
