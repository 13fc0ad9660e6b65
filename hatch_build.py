"""Compile the kernels when the package is installed, as an extension in C would be, so that its first run need not.

Runs the usual commands where nothing is stored yet and puts the machine code beside the package: in the wheel, or in `src` where
the installation is editable. `scantruss.runtime.jit` looks there first; where the kernels have changed since, or another
processor, Python or numba meets them, they compile on the first run instead, as they do where this fails. SCANTRUSS_COMPILE=0
leaves it out, for a wheel that is to serve all machines.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PLACE = Path("scantruss") / "machine_code"
PATIENCE = 600.0  # most that the commands may take [s]
COMMANDS = (
    "info shell.npy",
    "grid {shell} demo.obj --length 1",
    "grid {bust} bust.obj --length 24",
    "grid shell.npy shell.obj shell.json --length 1",
    "structure shell.json structure.json --unit m --supports boundary --path worst --path-steps 1",
    "grid shell.npy quads.obj --length 1 --cells quad",
    "grid shell.npy paper.obj --length 1 --method paper",
    "grid shell.npy field.obj --length curvature:0.8:1.5",
    "grid rough.npy rough.obj --length 1 --effort quick",
    "clean shell.npy clean.ply",
    "thin clean.ply -o thin.ply --spacing 0.2",
)


class CompileKernels(BuildHookInterface):
    """The hook of the build."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and add what came of it."""
        if os.environ.get("SCANTRUSS_COMPILE") == "0":
            return
        source = Path(self.root) / "src"
        folder = source / PLACE if version == "editable" else self._beside_the_wheel()
        try:
            compile_kernels(source, folder)
        except (OSError, subprocess.SubprocessError, ValueError) as error:
            self.app.display_warning(f"the kernels are not compiled now but by the first run: {error}")
            return
        if version != "editable":
            build_data["force_include"][str(folder)] = PLACE.as_posix()
            build_data.update(pure_python=False, infer_tag=True)

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Leave nothing beside the wheel."""
        shutil.rmtree(self._beside_the_wheel(), ignore_errors=True)

    def _beside_the_wheel(self) -> Path:
        return Path(self.directory) / PLACE.name


def compile_kernels(source: Path, folder: Path) -> None:
    """Run the commands of the package in `source` and put the machine code they store into `folder`, in place of any there."""
    with tempfile.TemporaryDirectory() as name:
        environment = dict(os.environ, NUMBA_CACHE_DIR=name, NUMBA_DISABLE_JIT="0", SCANTRUSS_INSTALLED="0")
        environment["PYTHONPATH"] = os.pathsep.join([str(source), *filter(None, [os.environ.get("PYTHONPATH")])])
        words = [sys.executable, str(Path(__file__).resolve())]
        subprocess.run(words, cwd=name, env=environment, check=True, timeout=PATIENCE, stdout=subprocess.DEVNULL)
        (stored,) = Path(name, "scantruss").glob("kernels-*")
        fresh = folder.with_name(f"{folder.name}-{os.getpid()}")
        for room in stored.iterdir():
            shutil.copytree(room, fresh / stored.name / room_of(room))
        shutil.rmtree(folder, ignore_errors=True)
        fresh.rename(folder)


def room_of(folder: Path) -> str:
    """Return the name of a folder of kernels without the hash of its path that numba appends (`scantruss.runtime.cache.room_of`)."""
    return folder.name.rpartition("_")[0]


def run() -> None:
    """Run the commands one after the other, in this process."""
    import numpy as np

    from scantruss.cli.demo_files import DEMOS
    from scantruss.cli.main import main

    rng = np.random.default_rng(1)
    x, y = rng.uniform(-10.0, 10.0, (2, 120_000))
    x, y = np.compress(np.hypot(x - 2.0, y) > 3.0, [x, y], axis=1)  # a dense shell with a hole
    np.save("shell.npy", np.column_stack([x, y, (x * x + y * y) / -30.0 + rng.normal(0.0, 0.02, len(x))]))
    x, y = np.meshgrid(*2 * [np.linspace(-4.0, 4.0, 81)])  # so rough that it is smoothed, and its grid mended
    np.save("rough.npy", np.column_stack([x.ravel(), y.ravel(), rng.normal(0.0, 0.2, x.size)]))
    for command in COMMANDS:
        words = [word.format(**{name: demo.scan for name, demo in DEMOS.items()}) for word in command.split()]
        if status := main(words):
            sys.exit(status)


if __name__ == "__main__":
    run()
