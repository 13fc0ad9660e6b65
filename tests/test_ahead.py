"""On the first run a second process compiles for the optimization; it changes nothing and is never left over."""

import gc
import os
import subprocess
import sys
import time

import numpy as np
import pytest
from marks import needs_jit
from shapes import make

from scantruss import ahead
from scantruss.commands.shared import STAGES, note_compiling
from scantruss.kernels import compile as compiling
from scantruss.report.terminal import Bars


@pytest.fixture(autouse=True)
def nothing_installed(monkeypatch):
    """No machine code comes with the package."""
    monkeypatch.setattr(compiling, "INSTALLED", None)


class Process:
    """Stands for the second process."""

    def __init__(self, patient=True):
        self.calls, self.patient, self.status = [], patient, None

    def poll(self):
        return self.status

    def wait(self, timeout):
        self.calls.append("wait")
        if not self.patient:
            raise subprocess.TimeoutExpired("python", timeout)

    def kill(self):
        self.calls.append("kill")

    def communicate(self):
        self.calls.append("communicate")


@pytest.fixture
def started(monkeypatch):
    """What was started, where nothing is compiled yet and two processors are there."""
    processes = []
    monkeypatch.setattr(ahead, "are_compiled", lambda method, *stages: False)
    monkeypatch.setattr(ahead, "can_be_stored", lambda: True)
    monkeypatch.setattr(ahead, "processors", lambda: 2)
    monkeypatch.setattr(ahead, "compile_last", lambda: processes[-1][1].calls.append("last"))

    def popen(words, **_):
        processes.append((words, Process()))
        return processes[-1][1]

    monkeypatch.setattr(subprocess, "Popen", popen)
    return processes


def test_it_is_waited_for_before_the_optimization_and_ended(started):
    seen = []
    with ahead.CompileAhead("paper", lambda *stage: seen.append(stage)) as progress:
        ((words, process),) = started
        assert words[-1] == "paper"
        progress("front", 0.5)
        assert not process.calls
        progress("optimize", 0.0)
        progress("optimize", 0.5)
        assert process.calls == ["last", "wait", "kill", "communicate"]
    assert process.calls == ["last", "wait", "kill", "communicate"]
    assert seen == [("front", 0.5), ("optimize", 0.0), ("optimize", 0.5)]


def test_it_ends_where_the_run_is_refused_or_interrupted(started):
    with pytest.raises(KeyboardInterrupt), ahead.CompileAhead("default", print):
        raise KeyboardInterrupt
    assert started[0][1].calls == ["kill", "communicate"]


def test_garbage_is_collected_again_afterwards(started):
    with ahead.CompileAhead("default", print):
        assert not gc.isenabled()
    assert gc.isenabled()


def test_patience_has_an_end(started):
    with ahead.CompileAhead("default", lambda *_: None) as progress:
        started[0][1].patient = False
        progress("optimize", 0.0)
    assert started[0][1].calls == ["last", "wait", "kill", "communicate"]


def test_what_it_has_done_is_not_done_again(started):
    with ahead.CompileAhead("default", lambda *_: None) as progress:
        started[0][1].status = 0
        progress("optimize", 0.0)
    assert started[0][1].calls == ["wait", "kill", "communicate"]


@pytest.mark.parametrize(
    "name, value",
    [
        ("are_compiled", lambda method, *stages: True),
        ("can_be_stored", lambda: False),
        ("processors", lambda: 1),
    ],
)
def test_it_starts_only_where_it_is_of_use(started, monkeypatch, name, value):
    monkeypatch.setattr(ahead, name, value)
    with ahead.CompileAhead("default", lambda *_: None) as progress:
        progress("optimize", 0.0)
    assert not started


def test_where_it_cannot_start_this_process_does_all(started, monkeypatch):
    def refuse(*_, **__):
        raise OSError("no process")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    seen = []
    with ahead.CompileAhead("default", lambda *stage: seen.append(stage)) as progress:
        progress("optimize", 0.0)
    assert seen == [("optimize", 0.0)]


def test_it_leaves_when_the_process_that_started_it_is_no_more():
    code = "import time; from scantruss import ahead; ahead.compile_optimization = lambda _: time.sleep(600)\n"
    words = [sys.executable, "-c", code + "ahead.main('default')"]
    with subprocess.Popen(words, stdin=subprocess.PIPE) as process:
        time.sleep(0.1)
        process.stdin.close()
        assert process.wait(60) == 1


COMPILED = """
import sys
from scantruss.ahead import compile_last, compile_optimization
from scantruss.kernels.linking import Kernel
from scantruss.settings import Settings
import numpy as np
import scantruss as st

def kernels():
    modules = [module for name, module in sys.modules.items() if name.startswith("scantruss.kernels.")]
    return {v.__name__: v for module in modules for v in vars(module).values() if isinstance(v, Kernel)}

def called():
    return {name for name, kernel in kernels().items() if kernel.alone.signatures}

compile_optimization(Settings(length=1.0, method=sys.argv[1]))
ahead = called()
compile_last()
assert called() == ahead
points = np.load(sys.argv[2])
st.grid_from_points(points, Settings(length=float(sys.argv[3]), method=sys.argv[1]))
assert {"land_nodes", "fill_rings", "lower_distances", "doubtful_pairs", "nearest_nodes"} < ahead
for name, kernel in kernels().items():
    assert len(kernel.alone.signatures) <= 1, name  # neither compiled for other types by the example ...
    assert len(kernel.overloads) <= 1 + (name == "fill_row"), name  # ... nor twice by kernels, but rows of both kinds
"""


@needs_jit
@pytest.mark.parametrize("method", ["default", "paper"])
def test_the_example_compiles_for_the_types_of_a_run(method, tmp_path):
    np.save(tmp_path / "points.npy", make("scallop", 5_000).points)
    words = [sys.executable, "-c", COMPILED, method, str(tmp_path / "points.npy"), "12"]
    done = subprocess.run(words, capture_output=True, text=True, env=os.environ)
    assert done.returncode == 0, done.stderr


class Notes(Bars):
    """Bars that keep what they are to say."""

    def __init__(self):
        super().__init__()
        self.lines = []

    def note(self, line):
        self.lines.append(line)


@needs_jit
def test_a_line_says_that_a_long_compile_is_about_to_come_and_only_then(tmp_path, monkeypatch):
    """After `info` only the kernels of the boundary are stored; a `grid` still compiles for long."""
    monkeypatch.setattr(compiling, "FOLDER", tmp_path)
    stages = STAGES
    for stored, compiles in (
        ((), stages),
        (("boundary.free_directions-86.py311.1.nbc",), stages[1:]),
        (("advance.advance-150.py311.1.nbc",), stages[2:]),
        (("search.search-300.py311.1.nbc", "landing.land_nodes-33.py311.1.nbc"), ()),
    ):
        for name in stored:
            (tmp_path / name).write_bytes(b"")
        for stage in stages:
            bars = Notes()
            with note_compiling(bars, "default", stage):
                pass
            assert bool(bars.lines) == (stage in compiles)
        bars = Notes()
        with note_compiling(bars, "default", *stages):
            pass
        assert bool(bars.lines) == bool(compiles)
    assert not ahead.are_compiled("paper", "front") and not ahead.are_compiled("paper", "optimize")


@needs_jit
def test_a_run_says_it_once_however_many_parts_of_it_compile(tmp_path, monkeypatch):
    """A scan that is thinned while it is read compiles for that, then for its boundary, then for the grid."""
    monkeypatch.setattr(compiling, "FOLDER", tmp_path)
    bars = Notes()
    for stages in ((), STAGES[:1], STAGES):

        @compiling.kernel
        def twice(x):
            return 2.0 * x

        with note_compiling(bars, "default", *stages):
            assert twice(4.0) == 8.0
    assert bars.lines == ["compiling kernels, once on this machine"]


@needs_jit
def test_where_nothing_can_be_stored_every_run_compiles(monkeypatch):
    monkeypatch.setattr(compiling, "FOLDER", None)
    bars = Notes()
    with note_compiling(bars, "default", "boundary"):
        pass
    assert bars.lines == ["compiling kernels"] and not ahead.can_be_stored()


@needs_jit
def test_the_first_kernel_that_is_not_stored_is_told_of_once_and_a_stored_one_never(tmp_path, monkeypatch):
    monkeypatch.setattr(compiling, "FOLDER", tmp_path)

    def fresh():
        @compiling.kernel
        def twice(x):
            return 2.0 * x

        @compiling.kernel
        def thrice(x):
            return 3.0 * x

        return twice, thrice

    for lines in (["compiling kernels, once on this machine"], []):
        bars = Notes()
        with note_compiling(bars):
            assert [kernel(4.0) for kernel in fresh()] == [8.0, 12.0]
        assert bars.lines == lines
    with note_compiling(bars):
        pass
    fresh()[0](1)  # for another type, and when nobody listens any more
    assert bars.lines == []
