"""Make the bundled scan of a shell, src/scantruss/data/shell.ply: python scripts/make_demo_shell.py [FILE].

A thin concrete shell on four feet, about 30 x 20 m, with free edges that rise between the feet and two openings. Its form is that of
a hanging net turned upside down, by force densities (Schek 1974). Five stations of a terrestrial scanner see it from below: the
density falls with distance and incidence, lamps cast shadows, the range has noise, edges leave mixed pixels, the air outliers.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.interpolate import RectBivariateSpline
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

PLACE = Path(__file__).resolve().parents[1] / "src" / "scantruss" / "data" / "shell.ply"
CELLS = (60, 40)  # of the net
CUT = 5  # cells that a foot cuts off each corner of the net
FEET = np.array([[-15.0, -9.5, 0.0], [15.5, -10.5, 0.0], [14.0, 10.0, 0.5], [-14.5, 9.0, 0.0]])  # their middles [m]
FOOT = 2.2  # width of a foot [m]
RISE = 7.5  # of the crown above the ground [m]
EDGE = 36.0  # force density of the edges in that of the net
OPENINGS = ((0.62, 0.52, 0.085, 0.12), (0.3, 0.45, 0.05, 0.075))  # ellipses: middle and radii in the net, from 0 to 1
STATIONS = np.array(
    [[-11.5, -6.5, 1.6], [-11.0, 6.0, 1.6], [0.0, -1.5, 1.6], [10.5, 6.5, 1.6], [12.0, -7.0, 1.6]]
)  # [m]
LAMPS = np.array([[-5.0, 0.0, 3.6], [0.5, 3.5, 3.6], [4.0, -4.0, 3.6], [10.0, 2.0, 3.2]])  # middles [m]
LAMP = 0.35  # radius of a lamp [m]
STEP = 0.0275  # of both angles of the scanner [radian]
RANGE_NOISE, STATION_NOISE = 0.003, 0.002  # standard deviations: of a range, and of the place of a station [m]
RIM = 0.05  # width of the strip of the edge where a point may be a mixed pixel [m]
MIXED = 0.2  # share of these
BEHIND = 0.8  # how far these lie behind the edge on the mean [m]
OUTLIERS = 1_800  # in the air
AIR = np.array([[-18.0, -13.0, 0.2], [18.0, 13.0, 9.0]])  # the box of the outliers [m]
GRAZING = 0.12  # cosine of the incidence below which nothing returns

Surface = Callable[[np.ndarray, np.ndarray], np.ndarray]


def form() -> Surface:
    """Return the form of the shell: places (N, 3) of parameters (N,), (N,) from 0 to 1 [m]."""
    nodes = np.stack(np.meshgrid(*(np.arange(n + 1) for n in CELLS), indexing="ij"), axis=-1).reshape(-1, 2)
    ids = np.arange(len(nodes)).reshape(CELLS[0] + 1, CELLS[1] + 1)
    place, fixed = np.zeros((len(nodes), 3)), np.zeros(len(nodes), bool)
    corners = np.array([[0, 0], [CELLS[0], 0], CELLS, [0, CELLS[1]]])
    for corner, foot, other in zip(corners, FEET, np.roll(FEET, 2, axis=0), strict=True):
        steps = np.abs(nodes - corner)
        inside = steps.sum(axis=1) <= CUT  # the net ends at the last of these
        inward = (other - foot)[:2] / np.linalg.norm((other - foot)[:2])
        turn = np.sign((corner[0] > 0) - 0.5) * np.sign((corner[1] > 0) - 0.5)
        along = np.array([inward[1], -inward[0]]) * turn
        share = (steps[inside, 0] - steps[inside, 1]) / CUT / 2.0
        back = (CUT - steps[inside].sum(axis=1)) / CUT
        place[inside] = foot
        place[inside, :2] += FOOT * (share[:, None] * along - 0.5 * back[:, None] * inward)
        fixed |= inside
    one = np.concatenate([ids[:-1].ravel(), ids[:, :-1].ravel()])
    other = np.concatenate([ids[1:].ravel(), ids[:, 1:].ravel()])
    border = ((nodes == 0) | (nodes == CELLS)).any(axis=1)
    force = np.where(border[one] & border[other], EDGE, 1.0)
    rows, columns = np.concatenate([one, other, one, other]), np.concatenate([one, other, other, one])
    matrix = coo_array((np.concatenate([force, force, -force, -force]), (rows, columns))).tocsr()
    free = ~fixed
    held = matrix[free][:, fixed] @ place[fixed]
    solved = spsolve(
        matrix[free][:, free].tocsc(), np.column_stack([-held, np.ones(free.sum())])
    )  # without load; by load
    place[free] = solved[:, :3]
    place[free, 2] += solved[:, 3] * (RISE - place[free, 2].max()) / solved[:, 3].max()
    u, v = (np.linspace(0.0, 1.0, n + 1) for n in CELLS)
    splines = [RectBivariateSpline(u, v, place[:, axis].reshape(len(u), len(v))) for axis in range(3)]
    return lambda u, v: np.column_stack([spline.ev(u, v) for spline in splines])


def is_shell(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return where parameters (N,), (N,) lie on the shell: in no opening, and not beyond a foot."""
    x, y = np.minimum(u, 1 - u) * CELLS[0], np.minimum(v, 1 - v) * CELLS[1]
    kept = (x >= 0) & (y >= 0) & (x + y >= CUT)
    for a, b, wide, tall in OPENINGS:
        kept &= ((u - a) / wide) ** 2 + ((v - b) / tall) ** 2 > 1
    return kept


def directions(places: np.ndarray, stations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors (N, 3) from stations to places, and their distances (N,) [m]."""
    away = places - stations
    distance = np.linalg.norm(away, axis=1)
    return away / distance[:, None], distance


def seen_from(station: np.ndarray, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the ids (M,) of the places (N, 3) that a station measures: one for each step of its two angles."""
    ray, _ = directions(places, station)
    seen = np.abs((ray * normals).sum(axis=1)) > GRAZING
    for lamp in LAMPS:
        along = ray @ (lamp - station)
        seen &= np.linalg.norm(station + along[:, None] * ray - lamp, axis=1) > LAMP
    angles = np.stack([np.arctan2(ray[:, 1], ray[:, 0]), np.arcsin(ray[:, 2])], axis=1) / STEP
    cells = np.round(angles).astype(np.int64)
    order = np.argsort(
        np.abs(angles - cells).max(axis=1) + 10.0 * ~seen, kind="stable"
    )  # the first of a cell is at its middle
    _, first = np.unique(cells[order], axis=0, return_index=True)
    return order[first][seen[order[first]]]


def scan(seed: int = 7) -> np.ndarray:
    """Return the points (N, 3) of the scan [m]."""
    rng = np.random.default_rng(seed)
    surface, step = form(), 1e-4
    u, v = rng.uniform(size=(2, 2_000_000))
    u, v = np.compress(is_shell(u, v), [u, v], axis=1)
    places = surface(u, v)
    along, across = (surface(u + step, v) - places) / step, (surface(u, v + step) - places) / step
    normals = np.cross(along, across)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    du, dv = RIM / np.linalg.norm(along, axis=1), RIM / np.linalg.norm(across, axis=1)
    inner = is_shell(u + du, v) & is_shell(u - du, v) & is_shell(u, v + dv) & is_shell(u, v - dv)
    parts = []
    for station in STATIONS:
        which = seen_from(station, places, normals)
        ray, _ = directions(places[which], station)
        error = rng.normal(0.0, RANGE_NOISE, len(which))
        mixed = (
            ~inner[which] & (places[which, 2] > FOOT) & (rng.uniform(size=len(which)) < MIXED)
        )  # none where it stands
        error[mixed] += rng.exponential(BEHIND, mixed.sum())
        parts.append(places[which] + rng.normal(0.0, STATION_NOISE, 3) + error[:, None] * ray)
    return np.concatenate([*parts, rng.uniform(AIR[0], AIR[1], (OUTLIERS, 3))])


def write_ply(points: np.ndarray, path: Path) -> None:
    """Write points as float32 in a binary PLY file."""
    names = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat binary_little_endian 1.0\ncomment unit m\nelement vertex {len(points)}\n{names}end_header\n"
    path.write_bytes(head.encode() + points.astype("<f4").tobytes())


if __name__ == "__main__":
    place = Path(sys.argv[1]) if len(sys.argv) > 1 else PLACE
    write_ply(scan(), place)
    print(f"wrote {place}")
