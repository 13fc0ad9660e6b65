"""Install, run the demo and the tests on every supported Python: `python scripts/test_all_pythons.py [pytest's arguments]`; needs uv.

Each Python gets a wheel of its own, so that none takes the machine code of another; one that uv can neither find nor fetch fails.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

PYTHONS = ("3.11", "3.12", "3.13", "3.14")
ROOT = Path(__file__).resolve().parents[1]
INSTALLED = ("--isolated", "--no-editable", "--reinstall-package", "scantruss", "--group", "test")


def interpreter(python: str) -> str:
    """Return the newest Python of a version that pyenv has, which uv sees only where it is switched on; else the version."""
    versions = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv") / "versions"
    places = [path / "bin" / "python" for path in versions.glob(f"{python}.*") if path.name.replace(".", "").isdigit()]
    newest = max(places, key=lambda place: int(place.parts[-3].rpartition(".")[2]), default=None)
    return python if newest is None else str(newest)


def works(python: str, arguments: list[str]) -> bool:
    """Whether the package installs on a Python, makes the grid of the demo and passes the tests."""
    with tempfile.TemporaryDirectory() as folder:
        demo = subprocess.run(
            ["uv", "run", "--python", interpreter(python), *INSTALLED, "scantruss", "demo", f"{folder}/demo"], cwd=ROOT
        )
    tests = [
        "uv",
        "run",
        "--python",
        interpreter(python),
        *INSTALLED[:2],
        *INSTALLED[4:],
        "python",
        "-m",
        "pytest",
        "-q",
        *arguments,
    ]
    return not demo.returncode and not subprocess.run(tests, cwd=ROOT).returncode


def main() -> int:
    failed = []
    for python in PYTHONS:
        print(f"== Python {python}", flush=True)
        if not works(python, sys.argv[1:]):
            failed.append(python)
    print(f"failed on {' '.join(failed)}" if failed else f"passed on {' '.join(PYTHONS)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
