"""The same work in this process, in processes and on a cluster; a worker that dies ends it with one line at most."""

import gc
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jobs import Deadly, add, die, leave_once, refuse

from scantruss.errors import FormatError, InputError, ScanTrussError
from scantruss.runtime import cluster as module
from scantruss.runtime.cluster import JOBS_PER_WORKER, Cluster, Processes, Workers, open_workers
from scantruss.scan.stream import thin_scan


@contextmanager
def small_cluster() -> Iterator[str]:
    """Give the address of a cluster within this process."""
    distributed = pytest.importorskip("distributed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cluster = distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0", silence_logs=50
        )
    try:
        yield cluster.scheduler_address
    finally:
        cluster.close()


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A cluster for all tests that leave it whole."""
    with small_cluster() as found:
        yield found


def test_work_is_done_here_in_turn() -> None:
    assert list(Workers().run(add, iter([5, 6]), 10)) == [(0, 15), (1, 16)]


def test_processes_do_all_jobs_and_read_what_is_shared() -> None:
    with Processes(2) as crew:
        assert dict(crew.run(add, range(9), 10)) == {number: number + 10 for number in range(9)}
        assert dict(crew.run(add, range(3), 20)) == {number: number + 20 for number in range(3)}
        assert dict(crew.run(add, [7])) == {0: 7}


@pytest.mark.parametrize(("work", "shared"), [(die, None), (add, Deadly())], ids=["at work", "as it starts"])
def test_a_process_that_dies_ends_the_run_with_one_line_and_leaves_no_file(
    work: Callable[..., Any], shared: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with (
        pytest.raises(ScanTrussError, match="a worker died, perhaps for lack of memory; use fewer workers"),
        Processes(2) as crew,
    ):
        list(crew.run(work, range(4), shared))
    assert not list(tmp_path.iterdir())


def test_what_is_shared_but_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    with Processes(2) as crew:
        assert isinstance(crew, Processes)
        shutil.rmtree(crew._folder.name)
        with pytest.raises(ScanTrussError, match=r"cannot write to the temporary folder .*; use --workers 1"):
            list(crew.run(add, [1], 2))


def test_at_most_two_jobs_a_process_are_asked_for_ahead_of_their_results() -> None:
    taken = []

    def jobs() -> Iterator[int]:
        for job in range(20):
            taken.append(job)
            yield job

    with Processes(2) as crew:
        for done, _ in enumerate(crew.run(add, jobs(), 1), 1):
            assert len(taken) < done + JOBS_PER_WORKER * crew.count
    assert taken == list(range(20))


def test_what_a_job_refuses_comes_out() -> None:
    with pytest.raises(FormatError, match="job 1 is refused"), Processes(1) as crew:
        list(crew.run(refuse, [1]))


def test_a_cluster_does_all_jobs_and_says_what_is_refused(address: str) -> None:
    with open_workers(scheduler=address) as crew:
        assert crew.count == 2 and address in crew.words
        assert dict(crew.run(add, range(9), 10)) == {number: number + 10 for number in range(9)}
        assert dict(crew.run(add, range(2))) == {0: 0, 1: 1}
        with pytest.raises(FormatError, match="job 3 is refused"):
            list(crew.run(refuse, [3]))


def test_a_cluster_of_another_version_is_refused(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_version", lambda: "0.0.7")
    with pytest.raises(InputError, match=r"have scantruss 0\.0\.7, this is"):
        open_workers(scheduler=address)


@pytest.mark.parametrize("scheduler", ["tcp://127.0.0.1:1", "nonsense://"])
def test_a_scheduler_that_does_not_answer_is_refused(scheduler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(module, "SECONDS_TO_ANSWER", 0.3)
    gc.disable()  # a client that is closed by a collection while another starts waits for ever
    try:
        with pytest.raises(InputError, match="no scheduler answers"):
            Cluster(scheduler)
        assert not [one for one in gc.get_objects() if type(one).__name__ == "Client" and one.status != "closed"]
    finally:
        gc.enable()


def test_a_port_where_something_else_answers_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            with suppress(OSError), server.accept()[0] as caller:
                caller.settimeout(1.0)
                caller.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
                while caller.recv(1000):  # until the other side leaves, or says no more
                    pass

        server.settimeout(30.0)
        answering = threading.Thread(target=answer)
        answering.start()
        with pytest.raises(InputError, match=r"no scheduler answers at tcp.*something else answers there"):
            Cluster(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        answering.join()


RUN = "import sys; from scantruss.cli.main import main; sys.exit(main(sys.argv[1:]))"


@pytest.fixture(scope="module")
def long_runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """Words of commands that take several processes some seconds."""
    folder = tmp_path_factory.mktemp("long")
    x, y = np.meshgrid(np.linspace(0, 10, 200), np.linspace(0, 10, 200))
    scan, out = str(folder / "scan.npy"), str(folder / "out.ply")
    np.save(scan, np.column_stack([x.ravel(), y.ravel(), np.sin(x.ravel() / 3)]))
    for number in range(4):
        np.save(folder / f"{number}.npy", np.random.default_rng(number).uniform(0, 10, (500_000, 3)))
    return {
        "thin": [
            "thin",
            str(folder / "?.npy"),
            "-o",
            out,
            "--spacing",
            "0.01",
            "--keep",
            "nearest",
            "--boundary",
            "--workers",
            "2",
        ],
        "sweep": ["sweep", scan, "--length", "0.1,0.11", "-o", out, "--workers", "2"],
    }


def processes_of(group: int) -> list[str]:
    """Return the command lines of all living processes of a group."""
    said = subprocess.run(
        ["ps", "-A", "-ww", "-o", "pgid=,stat=,args="], capture_output=True, text=True, check=True
    ).stdout
    rows = [line.split(None, 2) for line in said.splitlines()]
    return [row[2] for row in rows if row[0] == str(group) and row[1][0] != "Z" and len(row) > 2]


@pytest.mark.skipif(not hasattr(os, "killpg") or not shutil.which("ps"), reason="no groups of processes here")
@pytest.mark.parametrize(
    ("command", "number", "wait", "status", "line"),
    [
        *(("thin", signal.SIGINT, wait, 130, "interrupted; nothing was written") for wait in (0.0, 0.1, 0.3, 0.8)),
        *(("sweep", signal.SIGINT, wait, 130, "interrupted; nothing was written") for wait in (0.0, 0.3)),
        *((command, signal.SIGTERM, 0.1, 143, "stopped; nothing was written") for command in ("thin", "sweep")),
    ],
)
def test_processes_stopped_while_they_start_leave_one_line_and_nothing_else(
    long_runs: dict[str, list[str]], command: str, number: signal.Signals, wait: float, status: int, line: str
) -> None:
    words = long_runs[command]
    with subprocess.Popen(
        [sys.executable, "-c", RUN, *words], stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as run:
        try:
            while run.poll() is None and not any("spawn_main" in told for told in processes_of(run.pid)):
                time.sleep(0.01)
            time.sleep(wait)
            os.killpg(run.pid, number)  # to all of them, as a terminal does
            said = run.communicate(timeout=60)[1]
            *notes, last = said.splitlines()
            assert last == f"scantruss: {line}" and run.returncode == status
            assert notes in ([], ["on 2 processes of this machine"])
            assert not Path(words[words.index("-o") + 1]).exists()
            patience = time.monotonic() + 10
            while left := processes_of(run.pid):
                assert time.monotonic() < patience, left
                time.sleep(0.05)
        finally:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(run.pid, signal.SIGKILL)


def test_without_dask_a_scheduler_is_refused_and_processes_serve(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    with open_workers(3) as crew:
        assert isinstance(crew, Processes) and crew.count == 3
    with pytest.raises(InputError, match=r"needs dask.*uv sync --extra cluster"):
        open_workers(scheduler="tcp://127.0.0.1:8786")


def test_one_worker_is_this_process_and_none_is_refused() -> None:
    assert open_workers(1).alone
    with pytest.raises(InputError, match="workers must be 1 or more"):
        open_workers(0)


def test_more_workers_than_a_machine_can_feed_are_refused_before_one_starts() -> None:
    with pytest.raises(InputError, match=r"1,000,000 workers are too many for this machine; use at most \d+"):
        open_workers(1_000_000)


@pytest.mark.parametrize("keep", ["mean", "nearest"])
def test_the_thinned_scan_is_the_same_to_the_byte_on_a_cluster(
    keep: str, address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(thin_scan, "FEWEST_POINTS_OF_TILE", 70)
    points = np.random.default_rng(4).uniform(0, 9, (1000, 3))
    np.save(tmp_path / "one.npy", points[:600])
    np.savetxt(tmp_path / "two.xyz", points[600:])
    names = [tmp_path / "one.npy", tmp_path / "two.xyz"]
    wanted = thin_scan.thin_scan(names, 1.0, keep=keep, boundary=True)
    shares = []
    with open_workers(scheduler=address) as crew:
        found = thin_scan.thin_scan(
            names, 1.0, keep=keep, boundary=True, workers=crew, progress=lambda stage, share: shares.append(share)
        )
        assert found.points.tobytes() == wanted.points.tobytes()
        assert (found.read, found.dropped, found.boundary) == (1000, 0, wanted.boundary)
        with pytest.raises(FormatError, match="does not exist"):
            thin_scan.thin_scan([tmp_path / "three.xyz"], 1.0, workers=crew)
    assert len(shares) > 8 and shares[-1] == 1.0


def test_a_worker_of_a_cluster_that_dies_is_made_good(tmp_path: Path) -> None:
    with small_cluster() as address, open_workers(scheduler=address) as crew:
        found = dict(crew.run(leave_once, range(5), str(tmp_path)))
    assert (tmp_path / "left").exists()
    assert found == {number: number for number in range(5)}
