"""Ctrl-C and SIGTERM: a run ends wherever it is, with one line, and leaves nothing half-written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from stopped_runs import ENDS, Command, Run, make_scan, seconds_of, stop_at

from scantruss.runtime import stopping
from scantruss.runtime.files import SaveTogether, temporary_folder
from scantruss.runtime.stopping import Stopped, signals_heard

Commands = dict[str, tuple[Command, float]]

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="no groups of processes here")
STUCK = """
import os, signal, sys, threading, time
from pathlib import Path
from scantruss.cli import main, start
from scantruss.runtime.files import SaveTogether, temporary_folder

def run(words):
    with temporary_folder() as folder, SaveTogether() as save:
        (folder / "part").write_text("half")
        save.beside(Path("out.obj")).write_text("half")
        save.make_folder("results")
        print("there", flush=True)
        while True:
            try:
                {wait}
            except BaseException:
                pass  # as in a destructor, or in a library that goes on

main.run = run
sys.exit(start.start())
"""
LOOP = "deaf(np.zeros(1))"  # a kernel that goes on for long
KERNEL = """
import numpy as np
from scantruss.runtime.jit import kernel

@kernel
def deaf(a):
    for i in range(10**12):
        a[0] = a[0] * 0.5 + i
    return a[0]
"""
JOIN = "threading.Thread(target=time.sleep, args=(1000,)).start(); time.sleep(1000)"


INTERRUPTS_AN_IMPORT = """
import signal, sys

class Interrupts:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Interrupts())
"""


@pytest.mark.parametrize("name", ["__main__", "cli", "cli.start", "runtime", "runtime.stopping", "cli.main", "errors"])
def test_an_interruption_is_one_line_from_the_first_of_our_imports_on(tmp_path: Path, name: str) -> None:
    (tmp_path / "sitecustomize.py").write_text(INTERRUPTS_AN_IMPORT.format(name=f"scantruss.{name}"))
    paths = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    words = [sys.executable, "-m", "scantruss", "--version"]
    run = subprocess.run(words, env=os.environ | {"PYTHONPATH": paths}, capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (130, "scantruss: interrupted; nothing was written\n")


def test_a_program_that_imports_us_keeps_its_own_answer_to_interruptions() -> None:
    code = "import signal; kept = signal.getsignal(signal.SIGINT); import scantruss; scantruss.Settings"
    subprocess.run([sys.executable, "-c", f"{code}; assert signal.getsignal(signal.SIGINT) is kept"], check=True)


@pytest.mark.parametrize("number", list(ENDS))
@pytest.mark.parametrize("wait", ["time.sleep(1000)", LOOP, JOIN])
def test_what_never_comes_back_is_ended_and_cleaned_up(tmp_path: Path, number: signal.Signals, wait: str) -> None:
    code = (KERNEL if wait == LOOP else "") + STUCK.format(wait=wait)
    script, place, temporary = tmp_path / "stuck.py", tmp_path / "place", tmp_path / "tmp"
    place.mkdir()
    temporary.mkdir()
    script.write_text(code)
    environment = os.environ | {"TMPDIR": str(temporary), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    with subprocess.Popen(
        [sys.executable, script], cwd=place, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        assert run.stdout is not None and run.stdout.readline() == "there\n"
        run.send_signal(number)
        try:
            said = run.communicate(timeout=60)[1]
        finally:
            run.kill()
    status, word = ENDS[number]
    assert (run.returncode, said) == (status, f"scantruss: {word}; nothing was written\n")
    assert list(place.iterdir()) == [] and list(temporary.iterdir()) == []


@pytest.fixture(scope="module")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Commands:
    """Commands on a small scan, and how long each runs."""
    scan = tmp_path_factory.mktemp("scan") / "scan.ply"
    make_scan(scan, 30_000)
    grid = str(scan.with_name("grid.json"))
    words = ["grid", str(scan), grid, "--length", "6", "--effort", "quick", "--quiet"]
    subprocess.run([sys.executable, "-m", "scantruss", *words], check=True)
    some = {
        "grid": Command(
            ("grid", str(scan), "out.obj", "out.csv", "--length", "4"),
            frozenset(["out.obj", "out.csv", "out_nodes.csv", "out.settings.json"]),
        ),
        "print": Command(
            ("print", grid, "out.3mf", "--member-diameter", "1", "--node-diameter", "1.8"), frozenset(["out.3mf"])
        ),
        "clean": Command(("clean", str(scan), "out.ply"), frozenset(["out.ply"])),
        "sweep": Command(
            ("sweep", str(scan), "--length", "5,6", "--effort", "quick", "-o", "out", "--workers", "2"),
            frozenset(["out"]),
        ),
    }
    return {name: (command, seconds_of(command)) for name, command in some.items()}


@pytest.mark.parametrize("name", ["grid", "print", "clean", "sweep"])
def test_commands_stopped_at_random_moments_leave_nothing(commands: Commands, name: str) -> None:
    """A short version of `python -m benchmarks.stops`, which looks at the time as well."""
    command, seconds = commands[name]
    rng = np.random.default_rng(3)
    for number in ENDS:
        faults = stop_at(command, rng.uniform(0, seconds), number)[1]
        assert [fault for fault in faults if not fault.startswith("took")] == []


def test_a_run_that_is_not_stopped_has_no_fault(commands: Commands, tmp_path: Path) -> None:
    """What the check of a stopped run looks at tells a whole result from a half-written one."""
    run = Run(commands["grid"][0], tmp_path)
    said = run.process.communicate()[1]
    assert run.faults(signal.SIGINT, 0.0, said) == []
    (run.folder / "out.obj").unlink()
    assert "left" in run.faults(signal.SIGINT, 0.0, said)[0]


def test_results_are_put_into_place_together_whatever_comes_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A signal between the first file and the last waits until all are there."""
    replace = Path.replace

    def replace_and_stop(self: Path, target: Path) -> Path:
        signal.raise_signal(signal.SIGINT)
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", replace_and_stop)
    with pytest.raises(stopping.Stopped), stopping.signals_heard(), SaveTogether() as save:
        for name in "abc":
            save.beside(tmp_path / name).write_text(name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "c"]
    assert stopping.words_of_stop(signal.SIGINT) == "interrupted; what was written is whole"


def test_what_is_left_behind_is_removed_at_the_end_of_the_command(tmp_path: Path) -> None:
    """Where a stop comes between the end of a block and its clean-up."""
    save = SaveTogether()
    with stopping.signals_heard():
        save.__enter__()
        save.beside(tmp_path / "a").write_text("half")
    assert list(tmp_path.iterdir()) == []


def test_only_the_first_signal_is_an_interruption_and_what_is_ignored_stays_so() -> None:
    kept = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with stopping.signals_heard():
            signal.raise_signal(signal.SIGTERM)
            with pytest.raises(stopping.Stopped):
                signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            assert stopping.asked() == signal.SIGINT
    finally:
        signal.signal(signal.SIGTERM, kept)


def test_a_stop_where_nothing_can_be_raised_says_nothing_nor_does_what_it_left_half_made(
    capfd: pytest.CaptureFixture[str],
) -> None:
    class Last:
        def __init__(self, end: Callable[[], None]) -> None:
            self.end = end

        def __del__(self) -> None:
            self.end()

    class HalfMade:
        def __init__(self) -> None:
            signal.raise_signal(signal.SIGTERM)
            self.handle = 0

        def __del__(self) -> None:
            del self.handle

    def fail() -> None:
        raise ValueError

    hook = sys.unraisablehook
    sys.unraisablehook = sys.__unraisablehook__
    try:
        with signals_heard():
            Last(fail)
            assert "ValueError" in capfd.readouterr().err
            Last(lambda: signal.raise_signal(signal.SIGINT))
            assert stopping.asked() == signal.SIGINT
        with signals_heard(), suppress(Stopped):
            HalfMade()
        assert stopping.asked() == signal.SIGTERM
        assert not capfd.readouterr().err
        assert sys.unraisablehook is sys.__unraisablehook__
    finally:
        sys.unraisablehook = hook


def test_a_temporary_folder_goes_with_its_block(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    with pytest.raises(ValueError, match="no"), temporary_folder() as folder:
        assert folder.parent == tmp_path
        raise ValueError("no")
    assert list(tmp_path.iterdir()) == []
