"""Digests of many grids, to see that a change of the code leaves every grid as it was, to the byte.

    python -m benchmarks.digest before.json            write the digests of this state
    python -m benchmarks.digest after.json before.json write them, compare; status 1 where one differs

Machine code and libraries decide over the last bits, so digests are compared on one machine and not kept in the repository.
Only public names are used, so that it runs on any two states.
"""

from __future__ import annotations

import hashlib
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import scantruss as st

TESTS = Path(__file__).parents[1] / "tests"
SHARED = Path(__file__).parents[2] / "shared" / "data"
Case = tuple[str, Callable[[], Any], dict[str, Any]]  # a name, what gives the points or the file, settings


def _shape(name: str, count: int = 20_000) -> Callable[[], Any]:
    from shapes import make

    return lambda: make(name, count).points


def _hard(name: str, seed: int = 0) -> Callable[[], Any]:
    from hard_scans import hard

    return lambda: hard(name, seed).points


def made_cases() -> Iterator[Case]:
    """Yield the clouds that are made here, with the settings of each."""
    from shapes import make
    from small_clouds import ball, cap, ring, sheet, tire

    lengths = {name: make(name, 2000).length for name in
               ("scallop", "clam", "limpet", "cloth", "two_holes", "stadium", "great_court", "sphere", "torus", "saddle",
                "two_patches", "thin_strip", "fold_over", "gable", "pantheon", "l_plate", "flat_plate", "terrain")}  # fmt: skip
    for name, length in lengths.items():
        yield f"{name} quick", _shape(name), {"length": length, "effort": "quick"}
    for name in ("scallop", "two_holes", "gable", "torus", "thin_strip", "great_court"):
        yield f"{name} normal", _shape(name), {"length": lengths[name]}
    for name in ("limpet", "stadium", "sphere", "gable"):
        yield f"{name} best", _shape(name, 12_000), {"length": 1.3 * lengths[name], "effort": "best"}
    for name in ("scallop", "clam", "two_holes", "gable", "sphere", "two_patches"):
        yield f"{name} paper", _shape(name), {"length": lengths[name], "method": "paper"}
    yield "clam dense", _shape("clam", 150_000), {"length": lengths["clam"]}
    yield "cloth many nodes", _shape("cloth", 60_000), {"length": 0.4 * lengths["cloth"]}
    hole = {"length": lengths["two_holes"]}
    yield "paper from all", _shape("two_holes"), hole | {"method": "paper", "advance_from": "all"}
    yield "paper quadrangle", _shape("scallop"), {"length": 4.7, "method": "paper", "case3": "quadrangle"}
    yield "holes filled", _shape("two_holes"), hole | {"fill_holes": 200.0}
    yield "holes kept", _shape("stadium"), {"length": lengths["stadium"], "fill_holes": 0.0}
    for prefer in ("lengths", "shapes"):
        yield f"prefer {prefer}", _shape("limpet"), {"length": lengths["limpet"], "prefer": prefer}
    yield "coarser samples", _shape("scallop"), {"length": 4.7, "box_size": 0.26}
    yield "no ridges", _shape("gable"), {"length": 5.0, "ridge_angle": 0.0}
    yield "curvature", _shape("cloth"), {"length_field": "curvature:2:5"}
    plate = sheet(12.0, 8.0, 0.15, noise=0.01)
    places = [(x, y, 0.0, 1.0 + abs(x) / 6) for x in (-5.0, 0.0, 5.0) for y in (-3.0, 3.0)]
    yield "lengths at places", lambda: plate, {"length_field": places, "effort": "best"}
    fixed = [(0.3, 0.2, 0.0), (3.1, -1.7, 0.0), (-4.4, 2.2, 0.0)]
    for method in ("default", "paper"):
        yield f"fixed nodes {method}", lambda: plate, {"length": 1.0, "fixed": fixed, "method": method}
    lines = [[(-6.0, 0.0, 0.0), (0.0, 1.0, 0.0), (6.0, 0.0, 0.0)], [(0.0, -4.0, 0.0), (0.0, 4.0, 0.0)]]
    yield "fixed lines", lambda: plate, {"length": 1.0, "fixed_lines": lines}
    ringed = [(2.5 * np.cos(t), 2.5 * np.sin(t), 0.0) for t in np.linspace(0.0, 2 * np.pi, 33)]
    ringed[-1] = ringed[0]
    yield "fixed ring", lambda: plate, {"length": 1.0, "fixed_lines": [ringed], "fixed": [(0.0, 0.0, 0.0)]}
    yield "far from the origin", lambda: cap(5.0, 1.2, 0.2) + [5e5, 4.5e6, 100.0], {"length": 1.0}
    yield "ring", lambda: ring(2.0, 6.0, 0.2), {"length": 1.0}
    yield "tire", lambda: tire(5.0, 2.0, 0.2), {"length": 1.0, "effort": "quick"}
    yield "repeated points", lambda: np.repeat(sheet(9, 7, 0.2), 3, axis=0), {"length": 1.0}
    yield "two pieces", lambda: np.concatenate([ball(2.5, 3000), sheet(6, 5, 0.2) + [9.0, 0, 0]]), {"length": 1.0}
    for name in ("noisy", "strays", "flat_strays", "uneven_density", "dropouts", "doubled", "sparse", "rolled", "island",
                 "neck", "rough_ground", "zigzag", "shadows", "thin_wall"):  # fmt: skip
        from hard_scans import hard

        yield f"hard {name}", _hard(name), {"length": hard(name, 0).length, "effort": "quick"}


REAL = {
    "scallop.ply": 1.9, "bunny_zipper.ply": 0.006, "bunnyDouble.e57": 0.006, "humface.csv": 7.0, "demosthenes_lowres.ply": 0.15,
    "nefertiti_lowres.obj": 24.0, "kitten.xyz": 0.07, "hillside_hexbin-crop.las": 8.0, "quarry_samp53-utm-ground.pcd": 12.0,
    "rocker_arm.ply": 0.0408, "fandisk.ply": 0.279, "cheburashka.obj": 0.0394,
}  # fmt: skip


def real_cases() -> Iterator[Case]:
    """Yield the real scans, where they are at hand."""
    for name, length in REAL.items():
        path = SHARED / "real" / name
        if path.exists():
            yield f"real {name}", partial(Path, path), {"length": length, "effort": "quick"}
    for path in sorted((SHARED / "twins").glob("nasty_*.laz")):
        length = 0.94 if "utm" in path.name else 4.7
        yield f"twin {path.name}", partial(Path, path), {"length": length}


def digest_of(points: Any, settings: dict[str, Any]) -> str:
    """Return the digest of the grid of points or a file; the kind of error where there is none."""
    make = st.grid_from_scan if isinstance(points, Path) else st.grid_from_points
    try:
        grid = make(points, st.Settings(**settings))
    except st.FrontError as error:  # a refusal of the scan itself would be a mistake here
        return type(error).__name__
    digest = hashlib.sha256()
    for array in (grid.nodes, grid.triangles, grid.fixed, grid.lines, grid.origin):
        digest.update(np.ascontiguousarray(array).tobytes())
    with tempfile.TemporaryDirectory() as folder:
        for name in ("grid.obj", "grid.ply"):
            st.write(grid, Path(folder) / name)
            digest.update(Path(folder, name).read_bytes())
    return f"{digest.hexdigest()[:20]} {len(grid.nodes)} nodes"


def main(words: list[str]) -> int:
    """Write the digests, and compare them where others are named."""
    sys.path.insert(0, str(TESTS))
    found = {}
    for name, points, settings in [*made_cases(), *real_cases()]:
        started = time.perf_counter()
        found[name] = digest_of(points(), settings)
        print(f"{name:28} {found[name]:36} {time.perf_counter() - started:6.2f} s", flush=True)
    Path(words[0]).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    if len(words) < 2:
        return 0
    before = json.loads(Path(words[1]).read_text(encoding="utf-8"))
    differing = [name for name in {**before, **found} if before.get(name) != found.get(name)]
    for name in differing:
        print(f"differs: {name}: {before.get(name)} -> {found.get(name)}")
    print(f"{len(found) - len(differing)} of {len(found)} alike")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
