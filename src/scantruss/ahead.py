"""The first run on a machine: a second process compiles what the optimization needs while this one is at the front.

numba compiles one kernel at a time in a process, and the first run does little else. What the second process stores this one
finds; where the second cannot start, or fails, this one compiles all by itself.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from . import kernels
from .machine import processors

if TYPE_CHECKING:
    import numpy as np

    from .settings import Settings

PATIENCE = 120.0  # most that we wait for the second process [s]; then we compile what it has not
START = "import sys; sys.path.insert(0, sys.argv[1]); from scantruss.ahead import main; main(sys.argv[2])"


class CompileAhead(AbstractContextManager["CompileAhead"]):
    """A second process that compiles for a method; a ``progress(stage, share)`` that waits for it before the optimization.

    It starts only where the kernels are not stored yet and a second processor is there, and never outlives this process.
    """

    def __init__(self, method: str, progress: Callable[[str, float], None]) -> None:
        self._method = method
        self._progress = progress
        self._process: subprocess.Popen[bytes] | None = None
        self._collects = False

    def __enter__(self) -> CompileAhead:
        """Start the second process, if it is of use."""
        if not sys.executable or processors() < 2 or not can_be_stored() or are_compiled(self._method, "optimize"):
            return self
        package = str(Path(__file__).resolve().parents[1])
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", START, package, self._method],
                stdin=subprocess.PIPE,  # its end tells the second process that this one is no more
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        except OSError:
            return self
        self._collects = gc.isenabled()
        gc.disable()  # compiling makes much that stays, and looking through it again and again takes a tenth of the time
        return self

    def __call__(self, stage: str, share: float) -> None:
        """Pass on how far a stage is."""
        self._progress(stage, share)
        if stage == "optimize" and self._process is not None:
            if self._process.poll() is None:
                compile_last()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(PATIENCE)
            self._end()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the second process."""
        self._end()
        if self._collects:
            gc.enable()

    def _end(self) -> None:
        if self._process is not None:
            process, self._process = self._process, None
            process.kill()
            process.communicate()


def can_be_stored() -> bool:
    """Whether machine code can be kept, where one process finds that of another."""
    from .kernels.compile import FOLDER

    return FOLDER is not None


def are_compiled(method: str, *stages: str) -> bool:
    """Whether the kernels of some stages of the chain are stored: those that take long are looked for."""
    from .kernels import advance, boundary, landing, search, smoothing
    from .kernels.compile import is_compiled

    needed: dict[str, tuple[Callable[..., object], ...]] = {
        "boundary": (boundary.free_directions,),
        "front": (advance.advance_by_cases, advance.advance) if method == "paper" else (advance.advance,),
        "optimize": (smoothing.state_of if method == "paper" else search.search, landing.land_nodes),
    }
    return is_compiled(*(function for stage in stages for function in needed[stage]))


def compile_optimization(settings: Settings) -> None:
    """Optimize a grid of six triangles on a plate, by the functions that optimize any other."""
    import numpy as np

    from .boundary import Boundary, Loop
    from .grid.grid import Grid
    from .grid.halves import Halves
    from .grid.optimize import improve
    from .grid.proof import certify
    from .grid.relief import Relief
    from .kernels.boxes import new_boxes
    from .kernels.sites import put_all
    from .kernels.surface import Surface
    from .scan.sites import Sites

    rows = np.arange(-6.0, 7.0) / 5.0
    places = np.stack([*np.meshgrid(rows, rows, indexing="ij"), np.zeros((13, 13))], axis=2).reshape(-1, 3)
    count = len(places)
    apart = ((places[:, None] - places) ** 2).sum(axis=2)
    nearest = np.argsort(apart, axis=1, kind="stable")[:, 1:13]
    neighbors = np.where(np.take_along_axis(apart, nearest, axis=1) < 0.15, nearest, -1)
    normals, scratch = np.zeros((count, 3)), np.zeros(count, np.int64)
    normals[:, 2] = 1.0
    scale = np.array([settings.length, 0.2, 0.65, 8.0, 0.26])
    surface = Surface(
        places,
        np.arange(count + 1),
        places,
        normals,
        neighbors,
        scale,
        scratch,
        scratch.copy(),
        np.zeros(1, np.int64),
        np.ones(count),
    )
    boxes = new_boxes(places.min(axis=0), places.max(axis=0), 0.4, count, count)
    put_all(boxes, places, np.arange(count))
    sites = Sites(surface, boxes, scratch.copy(), np.zeros(count), 0.2, 5.76, 5.76, (0,), measured=count)
    nodes, triangles = six_triangles()
    loop = Loop(nodes[1:], np.zeros(1, np.int64), True, 6.0, 0)
    boundary = Boundary((loop,), sites)
    grid = Grid(nodes, triangles, np.zeros(7, np.bool_), np.zeros(3))
    relief = Relief.from_grid(grid, surface, boundary.rim, boundary.corners, settings.length)
    relief.to_grid(grid)
    improve(relief, sites, np.zeros((0, 3)), settings)
    Halves(relief.net, relief.net.degree > 0)  # which so small a grid is not kicked in
    certify(relief.to_grid(grid), boundary, settings)


def six_triangles() -> tuple[np.ndarray, np.ndarray]:
    """Return nodes (7, 3) and triangles (6, 3) of a hexagon around the origin with sides of 1."""
    import numpy as np

    angle = np.arange(6) * np.pi / 3.0
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(6)], axis=1)
    fan = np.array([[0, 1 + i, 1 + (i + 1) % 6] for i in range(6)])
    return np.concatenate([np.zeros((1, 3)), rim]), fan


def compile_last() -> None:
    """Do what the second process comes to last, while it is at the rest: it finds this stored."""
    from .grid.cover import boxes_of, distances_to_scan
    from .grid.crossings import find_crossings

    nodes, triangles = six_triangles()
    find_crossings(nodes, triangles)
    distances_to_scan(nodes, nodes, boxes_of(nodes, 0.5), 1.0)


def main(method: str) -> None:
    """Compile for a method, but no longer than the process lives that has started this one."""
    gc.disable()
    kernels.of_command = True
    threading.Thread(target=_leave_at_end_of_input, daemon=True).start()
    from .settings import Settings

    compile_optimization(Settings(length=1.0, method=method))


def _leave_at_end_of_input() -> None:
    sys.stdin.buffer.read()
    os._exit(1)
