"""Run the tests on every Python that is supported: `python scripts/test_all_pythons.py [pytest's arguments]`; needs uv."""

import subprocess
import sys
from pathlib import Path

PYTHONS = ("3.11", "3.12", "3.13", "3.14")
ROOT = Path(__file__).resolve().parents[1]


def main() -> int:
    failed = []
    for python in PYTHONS:
        print(f"== Python {python}", flush=True)
        words = ["uv", "run", "--python", python, "--isolated", "--group", "test", "python", "-m", "pytest", "-q"]
        if subprocess.run([*words, *sys.argv[1:]], cwd=ROOT).returncode:
            failed.append(python)
    print(f"failed on {' '.join(failed)}" if failed else f"passed on {' '.join(PYTHONS)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
