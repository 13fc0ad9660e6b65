"""Thin a generated scan of any size, and say how fast, with how much memory, by how many workers.

``python -m benchmarks.thin [--points 1e8] [--spacing 0.1] [--folder DIR] [--suffix .laz .ply]``; every run is a process of its own,
so that its memory can be told. The memory of workers is not in the figure.
"""

from __future__ import annotations

import argparse
import hashlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

BLOCK = 1_000_000  # points
READ = """
import sys, time
from scantruss.scan.stream.chunks import read_chunks
from scantruss.scan.stream.tiles import find_source, tiles_of
if __name__ == "__main__":
    begun = time.perf_counter()
    count = sum(len(chunk.points) for tile in tiles_of([find_source(sys.argv[1])]) for chunk in read_chunks(tile))
    print(count, time.perf_counter() - begun)
"""
THIN = """
import resource, sys, time
from scantruss.scan.stream.thin_scan import thin_scan
from scantruss.scan.stream.thinning import thin_points
from scantruss.runtime.cluster import open_workers
import numpy as np
if __name__ == "__main__":
    name, spacing, workers, keep, boundary = sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), sys.argv[4], sys.argv[5] == "boundary"
    for way in ("mean", "nearest"):
        thin_points(np.eye(3), 1.0, keep=way, boundary=True)  # compiled beforehand
    with open_workers(workers) as crew:
        begun = time.perf_counter()
        found = thin_scan([name], spacing, keep=keep, boundary=boundary, workers=crew)
        spent = time.perf_counter() - begun
    np.save(sys.argv[6], found.points)
    print(found.read, len(found.points), spent, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def blocks(count: int) -> Iterator[np.ndarray]:
    """Yield the points of an arched plate of 100 x 80 with a round hole, strip by strip, noise 0.02."""
    for begin in range(0, count, BLOCK):
        rng = np.random.default_rng(begin)
        size = min(BLOCK, count - begin)
        x = rng.uniform(0, 100, size + size // 5)
        y = rng.uniform(80 * begin / count, 80 * (begin + size) / count, len(x))
        outside = np.hypot(x - 60, y - 45) > 12
        x, y = x[outside], y[outside]
        while len(x) < size:  # strips across the hole
            x, y = np.concatenate([x, x]), np.concatenate([y, y])
        x, y = x[:size], y[:size]
        yield np.stack([x, y, 0.003 * x * (100 - x) + 0.002 * y * (80 - y) + rng.normal(0, 0.02, size)], axis=1)


def generate(path: Path, count: int) -> None:
    """Write a scan of so many points, LAS, LAZ or PLY."""
    if path.suffix == ".ply":
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n"
        head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
        with path.open("wb") as file:
            file.write(head.encode())
            for points in blocks(count):
                file.write(points.astype("<f4").tobytes())
        return
    import laspy

    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 1e-4), np.zeros(3)
    with laspy.open(path, "w", header=header) as file:
        for points in blocks(count):
            record = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
            record.x, record.y, record.z = points.T
            file.write_points(record)


def run(code: str, *words: object) -> list[float]:
    """Run code in a process of its own and return the numbers it prints."""
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "run.py"
        script.write_text(code)
        done = subprocess.run(
            [sys.executable, str(script), *map(str, words)], stdout=subprocess.PIPE, text=True, check=True
        )
    return [float(word) for word in done.stdout.split()[-4:]]


def main() -> None:
    """Generate, read, thin; print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=float, default=1e8)
    parser.add_argument("--spacing", type=float, nargs="+", default=[0.2, 0.05])
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "scantruss-thin")
    parser.add_argument("--suffix", nargs="+", default=[".laz", ".ply"])
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--keep", nargs="+", default=["mean", "nearest", "boundary"])
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    print("file | way | spacing | workers | seconds | M points/s | boxes | MB | digest")
    for suffix in options.suffix:
        path = options.folder / f"scan-{options.points:.0e}{suffix}"
        if not path.exists():
            begun = time.perf_counter()
            generate(path, int(options.points))
            print(f"generated {path} in {time.perf_counter() - begun:.0f} s", flush=True)
        count, spent = run(READ, path)
        print(f"{suffix} | reading alone | | 1 | {spent:.1f} | {count / spent / 1e6:.2f} | | |", flush=True)
        for spacing in options.spacing:
            for keep in options.keep:
                for workers in options.workers:
                    out = options.folder / "thinned.npy"
                    way = ("mean", "boundary") if keep == "boundary" else (keep, "")
                    count, boxes, spent, memory = run(THIN, path, spacing, workers, *way, out)
                    digest = hashlib.sha256(out.read_bytes()).hexdigest()[:8]
                    print(
                        f"{suffix} | {keep} | {spacing:g} | {workers} | {spent:.1f} | {count / spent / 1e6:.2f} |"
                        f" {boxes:,.0f} | {memory:.0f} | {digest}",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
