"""Hashes of grids, which show whether a change of the code has changed a grid: `python -m benchmarks.digest`.

    python -m benchmarks.digest --write OLD.json               # before the change
    python -m benchmarks.digest --compare OLD.json             # after it; exits 1 where a grid differs
    python -m benchmarks.digest --compare OLD.json NEW.json    # two files, nothing is computed

The last bits of a grid depend on the processor and on numba, so only digests of one machine can be compared, and none is kept in the
repository. Warm it takes some four minutes of one core. It knows scantruss by its public names only, so it can look at another
checkout: PYTHONPATH=CHECKOUT/src python -m benchmarks.digest ... from here.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import scantruss as st

from .digest_clouds import CLOUDS

HOMES = (parent / "shared" / "data" for parent in Path(__file__).resolve().parents)
DATA = next((home for home in HOMES if home.exists()), Path("shared/data"))
CALLED: dict[str, str] = {}  # names of settings below, and how `Settings` calls them now where it is otherwise
LINE = (((-2.2, -0.4, 0.0), (0.0, 0.5, 0.0), (2.2, 0.3, 0.0)),)
PLACES = ((-3.0, -2.0, 0.0, 0.8), (3.0, 2.0, 0.0, 1.3))

# name: cloud, settings; the member length is 1 unless it is said
PAIRS: dict[str, tuple[str, dict[str, Any]]] = {
    f"{cloud} {effort}": (cloud, {"effort": effort})
    for cloud in ("plate", "bumps", "dome", "ring")
    for effort in ("quick", "normal")
}
PAIRS |= {f"{cloud} quick": (cloud, {"effort": "quick"})
          for cloud in ("ball", "torus", "pieces", "strip", "roof", "noisy", "rough", "twice", "strays", "far", "small unit", "sparse",
                        "uneven", "holes", "rolled", "few", "line", "lattice", "box", "cone")}  # fmt: skip
PAIRS |= {f"{cloud} paper": (cloud, {"method": "paper"})
          for cloud in ("plate", "bumps", "dome", "ring", "ball", "pieces", "roof", "noisy", "strip", "holes", "far")}  # fmt: skip
PAIRS |= {
    "bumps best": ("bumps", {"effort": "best"}),
    "ring best": ("ring", {"effort": "best"}),
    "ball normal": ("ball", {}),
    "torus normal": ("torus", {}),
    "roof normal": ("roof", {}),
    "holes normal": ("holes", {}),
    "roof without ridges": ("roof", {"ridge_angle": 0.0}),
    "roof small ridge angle": ("roof", {"ridge_angle": 20.0, "effort": "quick"}),
    "fixed nodes": ("plate", {"fixed": ((0.4, 0.3, 0.0), (-2.1, 1.2, 0.0))}),
    "fixed nodes paper": ("plate", {"fixed": ((0.4, 0.3, 0.0), (-2.1, 1.2, 0.0)), "method": "paper"}),
    "fixed line": ("plate", {"fixed_lines": LINE, "effort": "quick"}),
    "fixed line and nodes": ("plate", {"fixed_lines": LINE, "fixed": ((1.5, -1.9, 0.0),)}),
    "fixed line paper": ("plate", {"fixed_lines": LINE, "method": "paper"}),
    "fixed node off the scan": ("plate", {"fixed": ((40.0, 0.0, 0.0),)}),
    "length at places": ("plate", {"length_field": PLACES, "length": 0.0}),
    "length at places paper": ("plate", {"length_field": PLACES, "length": 0.0, "method": "paper"}),
    "length by curvature": ("bumps", {"length_field": "curvature:0.8:1.5", "length": 0.0, "effort": "quick"}),
    "length by curvature of a ball": ("torus", {"length_field": "curvature:0.9:1.4", "length": 0.0}),
    "holes kept": ("holes", {"fill_holes": 0.0}),
    "holes filled": ("holes", {"fill_holes": 14.0}),
    "holes filled paper": ("holes", {"fill_holes": 14.0, "method": "paper"}),
    "prefer lengths": ("bumps", {"prefer": "lengths"}),
    "prefer shapes": ("bumps", {"prefer": "shapes"}),
    "advance from all": ("ring", {"advance_from": "all", "effort": "quick"}),
    "advance from all paper": ("ring", {"advance_from": "all", "method": "paper"}),
    "case 3 quadrangle": ("bumps", {"case3": "quadrangle", "method": "paper"}),
    "box size": ("bumps", {"box_size": 0.15, "effort": "quick"}),
    "box size paper": ("bumps", {"box_size": 0.4, "method": "paper"}),
    "no cleaning": ("strays", {"clean": False, "effort": "quick"}),
    "no cleaning twice": ("twice", {"clean": False, "effort": "quick"}),
    "stray distance": ("strays", {"stray_distance": 6.0, "effort": "quick"}),
    "weights": ("bumps", {"shape_weight": 0.4, "size_weight": 2.0, "length_weight": 0.7, "effort": "quick"}),
    "search paper": ("bumps", {"search_range": 1.5, "nearness": 0.6, "merge_angle": 80.0, "method": "paper"}),
    "smoothing": ("bumps", {"smooth_passes": 20, "smooth_forward": 0.5, "max_deviation": 0.05, "effort": "quick"}),
    "smoothing paper": ("bumps", {"smooth_passes": 20, "max_deviation": 0.05, "method": "paper"}),
    "boundary": ("ring", {"boundary_radius": 0.3, "corner_angle": 60.0, "effort": "quick"}),
    "length 1.7": ("bumps", {"length": 1.7}),
    "length too small": ("plate", {"length": 0.01}),
    "length too large": ("plate", {"length": 100.0}),
    "ball paper quadrangle": ("ball", {"case3": "quadrangle", "method": "paper"}),
}  # fmt: skip

SHAPES = {  # shapes of the tests: number of points, settings, factor of the suggested length
    "scallop": (6000, {"effort": "quick"}, 2.0),
    "two_holes": (6000, {"method": "paper"}, 2.0),
    "cloth": (6000, {}, 2.0),
    "stadium": (6000, {"effort": "quick"}, 2.0),
}
RANDOM = (3, 8, 21)  # seeds of random surfaces of the tests
WRITTEN = ("bumps quick", "holes normal", "fixed line", "roof paper")  # their OBJ files are hashed too

REAL: dict[str, tuple[str, dict[str, Any]]] = {
    "kitten": ("real/kitten.xyz", {"effort": "quick"}),
    "vase": ("real/blackVase.ply", {"effort": "quick"}),
    "fandisk": ("real/fandisk.ply", {"effort": "quick"}),
    "face": ("real/humface.csv", {"effort": "quick"}),
    "quarry": ("real/quarry_samp53-utm-ground.pcd", {"effort": "quick"}),
    "real scallop paper": ("real/scallop.ply", {"method": "paper"}),
    "twin clam": ("twins/twin_ex2_clam.laz", {"effort": "quick"}),
    "nasty outliers": ("twins/nasty_outliers.laz", {"effort": "quick"}),
    "nasty duplicates": ("twins/nasty_duplicates.laz", {"effort": "quick"}),
    "nasty utm": ("twins/nasty_utm.laz", {"method": "paper"}),
}
MEMBERS = 22  # members along the longest side of a real scan


def hash_of(*parts: bytes) -> str:
    """Return the first half of a SHA-256."""
    return hashlib.sha256(b"|".join(parts)).hexdigest()[:32]


def settings_of(given: dict[str, Any]) -> st.Settings:
    """Return settings by the names used here; a length of 0 is left to the field."""
    values = {"length": 1.0} | given
    if not values["length"]:
        del values["length"]
    return st.Settings(**{CALLED.get(name, name): value for name, value in values.items()})


def told(make: Callable[[], st.Grid], written: bool = False) -> dict[str, Any]:
    """Return what is to be remembered of a grid, or of the class of its failure."""
    try:
        grid = make()
    except st.ScanTrussError as error:
        return {"error": type(error).__name__}
    except TypeError as error:  # a setting that is not there any more
        return {"error": str(error)}
    fields = (grid.nodes, grid.triangles, grid.fixed, grid.lines, grid.origin)
    found = {"nodes": len(grid.nodes), "grid": hash_of(*(np.ascontiguousarray(field).tobytes() for field in fields))}
    if written:
        with tempfile.TemporaryDirectory() as folder:
            st.write(grid, Path(folder) / "grid.obj")
            found["obj"] = hash_of((Path(folder) / "grid.obj").read_bytes())
    return found


@cache
def cloud(name: str) -> np.ndarray:
    """Return the points of a cloud of this file."""
    return CLOUDS[name]()


def small() -> Iterator[tuple[str, Callable[[], dict[str, Any]]]]:
    """Pairs that need no data."""
    for name, (of, given) in PAIRS.items():
        yield (
            name,
            lambda of=of, given=given, name=name: told(
                lambda: st.grid_from_points(cloud(of), settings_of(given)), name in WRITTEN
            ),
        )
    from random_surfaces import random_surface
    from shapes import make

    for name, (count, given, times) in SHAPES.items():

        def of_shape(name=name, count=count, given=given, times=times):  # type: ignore[no-untyped-def]
            shape = make(name, count, pose=True)
            return told(
                lambda: st.grid_from_points(shape.points, settings_of(given | {"length": times * shape.length}))
            )

        yield f"shape {name}", of_shape
    for seed in RANDOM:

        def of_seed(seed=seed):  # type: ignore[no-untyped-def]
            shape = random_surface(seed)
            return told(
                lambda: st.grid_from_points(shape.points, settings_of({"length": shape.length, "effort": "quick"}))
            )

        yield f"random surface {seed}", of_seed
    yield "bundled bust", lambda: told(lambda: _of_file(_bundled(), {"effort": "quick"}))
    yield "bundled bust normal", lambda: told(lambda: _of_file(_bundled(), {}))
    yield "bundled bust paper", lambda: told(lambda: _of_file(_bundled(), {"method": "paper"}))
    yield "thinned while read", thinned
    yield "cleaned points", cleaned
    yield "spliced", spliced


def _bundled() -> Path:
    return Path(st.__file__).parent / "data" / "nefertiti.ply"


def _of_file(path: Path, given: dict[str, Any]) -> st.Grid:
    length = st.read_points(path).extent / MEMBERS
    return st.grid_from_scan(path, settings_of({"length": float(f"{length:.3g}")} | given))


def thinned() -> dict[str, Any]:
    """A scan file thinned while it is read."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.xyz"
        np.savetxt(path, cloud("dense"), fmt="%.6f")
        return told(lambda: st.grid_from_scan(path, settings_of({"thin_spacing": 0.08, "effort": "quick"})))


def cleaned() -> dict[str, Any]:
    """The points that cleaning leaves."""
    found = st.clean_points(np.concatenate([cloud("strays"), cloud("twice") + [30.0, 0, 0]]))
    assert found.normals is not None
    return {
        "points": len(found.points),
        "cloud": hash_of(*(f.tobytes() for f in (found.points, found.normals, found.kept))),
    }


def spliced() -> dict[str, Any]:
    """Poses of three scans of a body, and what is merged of them, as the command writes them."""
    from range_scans import around, body, scans_of

    chance = np.random.default_rng(4)
    scans, _ = scans_of(body(3), around(4, chance), chance)
    with tempfile.TemporaryDirectory() as folder:
        names = [f"scan{number}.xyz" for number in range(len(scans))]
        for name, points in zip(names, scans, strict=True):
            np.savetxt(Path(folder) / name, points, fmt="%.5f")
        call = [sys.executable, "-m", "scantruss", "splice", *names, "-o", "whole.ply", "--unit", "m"]
        done = subprocess.run(call, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            return {"error": f"exit {done.returncode}"}
        files = sorted(Path(folder).glob("whole*"))
        poses = json.loads((Path(folder) / "whole.poses.json").read_text())
        merged = st.read_points(Path(folder) / "whole.ply").points
        return {"files": [f.name for f in files], "points": len(merged), "cloud": hash_of(merged.tobytes()),
                "poses": hash_of(json.dumps(_matrices(poses)).encode())}  # fmt: skip


def _matrices(value: Any) -> list[Any]:
    """Return the numbers of a pose file, so that other words in it do not count."""
    if isinstance(value, dict):
        return [number for name in sorted(value) for number in _matrices(value[name])]
    if isinstance(value, list):
        return [number for item in value for number in _matrices(item)]
    return [value] if isinstance(value, float) else []


def real() -> Iterator[tuple[str, Callable[[], dict[str, Any]]]]:
    """Pairs of shared scans that are there."""
    for name, (path, given) in REAL.items():
        if (DATA / path).exists():
            yield f"real: {name}", lambda path=path, given=given: told(lambda: _of_file(DATA / path, given))
        else:
            print(f"{name}: {path} is not here", file=sys.stderr)


def digest(only: str = "") -> dict[str, Any]:
    """Return the digest of the scantruss that is imported."""
    found = {}
    for group in (small, real):
        for name, make in group():
            if re.search(only, name):
                before = process_time()
                found[name] = make()
                print(
                    f"{name:32} {process_time() - before:6.1f} s  {json.dumps(found[name])}",
                    file=sys.stderr,
                    flush=True,
                )
    return found


def differences(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """Return a line for each pair of which the digests differ; pairs that one of them has not are not compared."""
    return [f"{name}: {old[name]} -> {new[name]}" for name in old if name in new and old[name] != new[name]]


def main() -> int:
    """Do what the command line says; return the exit status."""
    line = argparse.ArgumentParser(
        "python -m benchmarks.digest", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    line.add_argument("--write", type=Path, metavar="NEW", help="write the digest")
    line.add_argument(
        "--compare", type=Path, nargs="+", metavar="OLD", help="print what differs from OLD; with NEW of two files"
    )
    line.add_argument("--only", default="", help="only pairs whose name this regular expression finds")
    options = line.parse_args()
    given = [json.loads(path.read_text()) for path in options.compare or ()]
    new = given[1] if len(given) > 1 else digest(options.only)
    if options.write:
        options.write.write_text(json.dumps(new, indent=1) + "\n")
    changed = differences(given[0], new) if given else []
    print("\n".join([*changed, f"{len(changed)} of {len(new)} pairs differ" if given else f"{len(new)} pairs"]))
    return bool(changed)


if __name__ == "__main__":
    sys.exit(main())
