"""Read big files, side by side with bare libraries: `python -m benchmarks.readers FOLDER [--points N] [--pandas PYTHON]`.

Makes the files in FOLDER where they are not there yet. Each reading is a process of its own; figures are its cpu seconds
without imports, the least of several rounds, both sides in turn. pandas runs in another Python that has it.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np
from e57_file import Column, write_scans

from scantruss.scan.formats.writing import write_points

ROUNDS = 3
OURS = "from scantruss.scan.formats.reading import read_content\n"
OUR_CLOUD = "from scantruss.scan.formats.reading import read_points\n"
CASES = (  # suffix, imports of the other, what it does, its name
    (
        ".ply",
        "import numpy as np",
        "np.fromfile(path, np.dtype([(a, '<f8') for a in 'xyz']), offset=START)",
        "numpy.fromfile",
    ),
    (".las", "import laspy", "laspy.read(path).xyz", "laspy.read(...).xyz"),
    (".laz", "import laspy", "laspy.read(path).xyz", "laspy.read(...).xyz"),
    (".e57", "import e57", "e57.read_points(str(path)).points", "e57.read_points"),
    (".pcd", "import numpy as np", "np.fromfile(path, '<f8', offset=START)", "numpy.fromfile"),
    (".xyz", "import pandas", "pandas.read_csv(path, sep=' ', header=None)", "pandas.read_csv"),
    (".csv", "import pandas", "pandas.read_csv(path)", "pandas.read_csv"),
)
WATCH = """
import sys, time, resource
from pathlib import Path
{imports}
path = Path(sys.argv[1])
began = time.process_time()
{work}
print(time.process_time() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--points", type=int, default=10_000_000)
    parser.add_argument("--pandas", default=sys.executable, help="a Python that has pandas")
    options = parser.parse_args()
    print(
        "| file | size | ours, reader | ours, cloud | the other | ratio of the readers | ratio of the cloud | our peak |"
    )
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for suffix, imports, work, name in CASES:
        path = made(options.folder / f"points{suffix}", options.points)
        start = path.stat().st_size - 24 * options.points
        other_python = options.pandas if "pandas" in imports else sys.executable
        commands = (
            (other_python, imports, work.replace("START", str(start))),
            (sys.executable, OURS, "read_content(path)"),
            (sys.executable, OUR_CLOUD, "read_points(path)"),
        )
        rounds = [[measure(path, *command) for command in commands] for _ in range(ROUNDS)]
        other, reader, cloud = (min(times[i][0] for times in rounds) for i in range(3))
        peak = max(times[2][1] for times in rounds)
        print(
            f"| `{suffix}` | {path.stat().st_size / 1e6:.0f} MB | {reader:.2f} s | {cloud:.2f} s | {other:.2f} s, `{name}` |"
            f" {reader / other:.2f} | {cloud / other:.2f} | {peak:.0f} MB |",
            flush=True,
        )


def made(path: Path, count: int) -> Path:
    """Return a file of so many points on a national grid, with three decimals."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        points = np.random.default_rng(0).random((count, 3)) * [400, 300, 30]
        points = np.round(points + [500_000, 4_500_000, 100], 3)
        if path.suffix == ".e57":
            write_scans(path, [([Column(f"cartesian{axis}", points[:, i]) for i, axis in enumerate("XYZ")], "")])
        else:
            write_points(path, points, unit="m")
    return path


def measure(path: Path, python: str, imports: str, work: str) -> tuple[float, float]:
    """Return cpu seconds and the largest memory [MB] of a reading in a fresh process."""
    code = WATCH.format(imports=imports, work=work)
    done = subprocess.run([python, "-c", code, str(path)], capture_output=True, text=True, check=True)
    seconds, memory = done.stdout.split()
    return float(seconds), float(memory)


if __name__ == "__main__":
    main()
