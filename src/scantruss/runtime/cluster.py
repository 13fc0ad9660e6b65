"""Run the same work in this process, in processes on this machine, or on a Dask cluster.

``workers.run(work, jobs, shared)`` yields ``(number, work(job, shared))`` as jobs are done; `shared` goes to each worker once.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import pickle
import signal
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack
from functools import lru_cache
from importlib.util import find_spec
from itertools import islice
from multiprocessing import resource_tracker
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from .. import __version__
from ..errors import InputError, ScanTrussError, how_to_install
from .parallel import processors
from .stopping import is_clean, left_behind, signals_held

Job = TypeVar("Job")
Result = TypeVar("Result")
Work = Callable[[Job, Any], Result]

JOBS_PER_WORKER = 2  # jobs submitted per worker; more would let results pile up in memory
MOST_PER_PROCESSOR = 4  # workers; more only take memory
SECONDS_TO_ANSWER = 10.0  # time a scheduler has to answer [s]
NEEDS_DASK = f"needs dask and distributed; install them with: {how_to_install('cluster')}"
WORKER_DIED = "a worker died, perhaps for lack of memory; use fewer workers"


class Workers(AbstractContextManager["Workers"]):
    """Work in this process alone; base class of the others."""

    count = 1
    alone = True  #: nobody else works, so a job may use all processors
    words = "in this process"

    def run(self, work: Work[Job, Result], jobs: Iterable[Job], shared: Any = None) -> Iterator[tuple[int, Result]]:
        """Yield the number of each job and its result, in the order in which jobs are done."""
        for number, job in enumerate(jobs):
            yield number, work(job, shared)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the workers."""


def open_workers(count: int | None = None, scheduler: str = "") -> Workers:
    """Return workers, to be used in a ``with`` statement.

    Parameters
    ----------
    count : processes on this machine; the number of processors by default; optional
    scheduler : address of the scheduler of a running Dask cluster, for example ``tcp://10.0.0.5:8786``

    Raises
    ------
    InputError
        The number is out of range, the cluster does not answer, or Dask is not installed.
    """
    if scheduler:
        return Cluster(scheduler)
    count = processors() if count is None else count
    if count < 1:
        raise InputError(f"workers must be 1 or more, got {count}")
    if count > (most := MOST_PER_PROCESSOR * max(processors(), 2)):
        raise InputError(f"{count:,} workers are too many for this machine; use at most {most}")
    return Processes(count) if count > 1 else Workers()


class Processes(Workers):
    """A pool of processes on this machine, each a fresh interpreter."""

    alone = False

    def __init__(self, count: int) -> None:
        self.count = count
        self.words = f"on {count} processes of this machine"
        self._others = set(multiprocessing.active_children())
        self._folder = tempfile.TemporaryDirectory(prefix="scantruss-", ignore_cleanup_errors=True)
        _start_tracker()
        self._pool = ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), initializer=_begin)
        left_behind(self._kill)

    def run(self, work: Work[Job, Result], jobs: Iterable[Job], shared: Any = None) -> Iterator[tuple[int, Result]]:
        """Yield the number of each job and its result, in the order in which jobs are done."""
        path = self._share(shared)
        coming = enumerate(jobs)
        running: dict[Future[Result], int] = {}
        try:
            while True:
                for number, job in islice(coming, JOBS_PER_WORKER * self.count - len(running)):
                    with signals_held():  # a process that is half started can be neither used nor ended
                        running[self._pool.submit(_with_shared, work, job, path)] = number
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    yield running.pop(future), future.result()
        except BrokenProcessPool:
            raise ScanTrussError(WORKER_DIED) from None

    def _share(self, shared: Any) -> str:
        """Write what all jobs need to a file: a worker that dies while it is sent data would block the sender."""
        if shared is None:
            return ""
        try:
            with tempfile.NamedTemporaryFile(dir=self._folder.name, delete=False) as file:
                pickle.dump(shared, file, pickle.HIGHEST_PROTOCOL)
        except OSError as error:
            raise ScanTrussError(
                f"cannot write to the temporary folder {self._folder.name}: {error.strerror or error}; use --workers 1"
            ) from None
        return file.name

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the processes, after an error whatever they do."""
        with signals_held():
            if kind:
                self._kill()
            self._pool.shutdown(cancel_futures=True)
            self._folder.cleanup()
            is_clean(self._kill)

    def _kill(self) -> None:
        """End the processes, whatever they do."""
        for process in set(multiprocessing.active_children()) - self._others:
            process.kill()
        self._folder.cleanup()


def _start_tracker() -> None:
    """Start what removes the semaphores of a pool that is ended hard, silent about it; later it would let signals through again."""
    with signals_held():
        kept = os.environ.get("PYTHONWARNINGS")
        os.environ["PYTHONWARNINGS"] = "ignore"
        resource_tracker.ensure_running()
        if kept is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = kept


def _begin() -> None:
    """Prepare a new process: it ends with its parent, not by Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(1)


def _with_shared(work: Callable[[Any, Any], Any], job: Any, path: str) -> Any:
    return work(job, _read_shared(path) if path else None)


@lru_cache(1)
def _read_shared(path: str) -> Any:
    return pickle.loads(Path(path).read_bytes())


class Cluster(Workers):
    """A Dask cluster that the user has started."""

    alone = False

    def __init__(self, scheduler: str) -> None:
        if find_spec("distributed") is None:
            raise InputError(f"--scheduler {NEEDS_DASK}")
        with ExitStack() as stack:
            self._client = stack.enter_context(_connect(scheduler))
            try:
                versions = self._client.run(_version)
            except ModuleNotFoundError:
                versions = {scheduler: ""}
            if not versions:
                raise InputError(f"the cluster at {scheduler} has no workers; start some")
            if other := sorted({version or "none" for version in versions.values() if version != __version__}):
                raise InputError(
                    f"the workers at {scheduler} have scantruss {other[0]}, this is {__version__}; install the same there"
                )
            self._ends = stack.pop_all()
        self.count = len(versions)
        self.words = f"on {self.count} workers at {scheduler}"

    def run(self, work: Work[Job, Result], jobs: Iterable[Job], shared: Any = None) -> Iterator[tuple[int, Result]]:
        """Yield the number of each job and its result, in the order in which jobs are done; Dask repeats lost jobs."""
        from concurrent.futures import CancelledError

        from distributed import as_completed
        from distributed.scheduler import KilledWorker

        common = None if shared is None else self._client.scatter(shared, broadcast=True, hash=False)
        coming = enumerate(jobs)
        done = as_completed()
        running: dict[str, int] = {}
        while True:
            for number, job in islice(coming, JOBS_PER_WORKER * self.count - len(running)):
                future = self._client.submit(work, job, common, pure=False)
                running[future.key] = number
                done.add(future)
            if not running:
                return
            future = next(done)
            try:
                result = future.result()
            except (CancelledError, KilledWorker):
                raise ScanTrussError(WORKER_DIED) from None
            yield running.pop(future.key), result

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let go of the cluster."""
        self._ends.close()


def _connect(scheduler: str) -> Any:
    """Return a client of a scheduler; whatever answers there may be something else."""
    from distributed import Client

    try:
        return Client(scheduler, timeout=SECONDS_TO_ANSWER)
    except Exception as error:
        reason = " ".join(str(error).split())[:80] or type(error).__name__
        reason = reason if isinstance(error, OSError | ValueError) else "something else answers there"
    gc.collect()  # the client that failed closes now: found later, while another starts, both would wait for one lock
    raise InputError(f"no scheduler answers at {scheduler} ({reason}); check the address")


def _version() -> str:
    return __version__
