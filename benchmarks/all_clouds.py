"""Every cloud with a known answer through the whole chain, a line each: `python -m benchmarks.all_clouds [names]`."""

from __future__ import annotations

import argparse
import sys
import traceback
from time import perf_counter

from shapes import SHAPES, Shape, make

import scantruss as st

from .measure import measure

VARIANTS: dict[str, dict[str, object]] = {
    "": {},
    "utm": {"scale": 0.2, "offset": (500_000.0, 4_500_000.0, 100.0), "pose": False},
    "dups": {"count": 80_000, "duplicates": 0.75},
    "pose": {"pose": True},
    "dense25": {"density_ratio": 25.0},
    "noisy": {"noise": 0.35},
    "outliers": {"outliers": 0.1},
    "chance": {"even": False},
    "lines": {"scan_lines": 1.1},
}


def jobs(names: list[str], seeds: int) -> list[tuple[str, str, int]]:
    """Return names, variants and seeds: every shape, and the variants of the scallop."""
    found = [(name, "", seed) for name in names for seed in range(seeds)]
    return found + [("scallop", variant, 0) for variant in VARIANTS if variant and "scallop" in names]


def run(shape: Shape, variant: str, seed: int, method: str, share: float) -> bool:
    """Print the line of one grid; return whether its topology is right."""
    length = shape.length * share
    label = f"{shape.name + ' ' + variant:22s} {seed} {method[:3]} {share:.2f}"
    started = perf_counter()
    try:
        grid = st.grid_from_points(shape.points, st.Settings(length=length, method=method))
    except st.InputError as error:
        print(f"{label} refused: {error}"[:240], flush=True)
        return not shape.orientable
    except Exception as error:
        where = traceback.extract_tb(sys.exc_info()[2])[-1]
        print(f"{label} FAILED {type(error).__name__}: {error} at {where.name}:{where.lineno}"[:240], flush=True)
        return False
    seconds = perf_counter() - started
    found = measure(shape, grid, length)
    print(f"{label} {found.line()} s {seconds:.2f}", flush=True)
    return found.right


def main() -> int:
    """Run what the arguments name; the exit status is 1 if any topology is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=[])
    parser.add_argument("--methods", default="default,paper")
    parser.add_argument("--shares", default="1,1.4", help="member lengths in suggested lengths")
    parser.add_argument("--seeds", type=int, default=1)
    options = parser.parse_args()
    wrong = total = 0
    for name, variant, seed in jobs(options.names or list(SHAPES), options.seeds):
        shape = make(name, seed=seed, **VARIANTS[variant])  # type: ignore[arg-type]
        for method in options.methods.split(","):
            for share in options.shares.split(","):
                wrong += not run(shape, variant, seed, method, float(share))
                total += 1
    print(f"{wrong} of {total} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
