"""Work that is the same wherever it is done: in this process, in processes of our own, or on a Dask cluster.

``workers.run(work, jobs, shared)`` yields ``(number, work(job, shared))`` in the order in which they are done; `shared` goes to each
worker once. A worker that dies is made good: what it had is done again.
"""

from __future__ import annotations

import gc
import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from importlib.util import find_spec
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from types import TracebackType
from typing import Any, TypeVar

from .. import __version__
from ..errors import InputError, ScanTrussError
from .parallel import processors

Job = TypeVar("Job")
Result = TypeVar("Result")
Work = Callable[[Job, Any], Result]

AHEAD = 2  # jobs that wait for each worker: results must not pile up faster than they are taken
EACH = 4  # most workers for each processor: more only take memory
DEATHS = 3  # times that a worker may die before anything else is done
PATIENCE = 10.0  # for a scheduler to answer [s]
NEEDS_DASK = 'needs dask and distributed: python -m pip install "scantruss[cluster]"'


class Workers(AbstractContextManager["Workers"]):
    """Nobody but this process; the others build on it."""

    count = 1
    alone = True  #: nobody else works, so that a job may use all processors
    words = "in this process"

    def run(self, work: Work[Job, Result], jobs: Iterable[Job], shared: Any = None) -> Iterator[tuple[int, Result]]:
        """Yield the number of each job and its result, in the order in which they are done."""
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
    count : int, optional
        How many on this machine; the number of processors by default.
    scheduler : str
        Address of the scheduler of a Dask cluster, as ``tcp://10.0.0.5:8786``, to work there.

    Raises
    ------
    InputError
        No such number, no such cluster, or dask is not installed where a cluster is named.
    """
    if scheduler:
        if not has_dask():
            raise InputError(f"--scheduler {NEEDS_DASK}")
        return Cluster(0, scheduler)
    count = processors() if count is None else count
    if count < 1:
        raise InputError(f"workers must be 1 or more, got {count}")
    if count > (most := EACH * max(processors(), 2)):
        raise InputError(f"{count:,} workers are too many for this machine; use at most {most}")
    if count == 1:
        return Workers()
    return Cluster(count) if has_dask() else Processes(count)


def has_dask() -> bool:
    """Whether a Dask cluster can be used."""
    return find_spec("distributed") is not None


class Processes(Workers):
    """Processes of our own on this machine, for want of Dask."""

    alone = False

    def __init__(self, count: int) -> None:
        self.count = count
        self.words = f"on {count} processes of this machine"
        self._begun: list[_Process] = []

    def run(self, work: Work[Job, Result], jobs: Iterable[Job], shared: Any = None) -> Iterator[tuple[int, Result]]:
        """Yield the number of each job and its result, in the order in which they are done."""
        coming = enumerate(jobs)
        waiting: dict[int, Job] = {}
        deaths = 0
        while True:
            with _undisturbed():
                pool = ProcessPoolExecutor(self.count, _Spawn(shared, self._begun))
            with pool:
                try:
                    for number, result in _in_pool(pool, work, coming, waiting, AHEAD * self.count):
                        deaths = 0
                        yield number, result
                    return
                except BrokenProcessPool:
                    deaths += 1
                    if deaths > DEATHS:
                        raise _keeps_dying() from None
                except BaseException:
                    self._end()  # or leaving the pool waits for jobs that nobody wants
                    raise

    def _end(self) -> None:
        """End all processes, whatever they do."""
        with _undisturbed():
            while self._begun:
                self._begun.pop().kill()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the processes, also where who took their results was interrupted between two of them."""
        self._end()


class _Spawn(SpawnContext):
    """How processes of a pool begin: afresh, and noted in a list."""

    def __init__(self, shared: Any, begun: list[_Process]) -> None:
        super().__init__()
        self._shared, self._begun = shared, begun

    def Process(self, *words: Any, **options: Any) -> _Process:  # type: ignore[override]  # noqa: N802
        return _Process(self._shared, self._begun, *words, **options)


class _Process(SpawnProcess):
    """A process that is told what all jobs need when it has begun, and ends with who began it, not by ctrl-C.

    Told while it begins, as by the initializer of a pool, one that dies would leave its parent waiting for ever.
    """

    def __init__(self, shared: Any, begun: list[_Process], *words: Any, **options: Any) -> None:
        super().__init__(*words, **options)
        self._common, self._teller = multiprocessing.Pipe(duplex=False)
        self._shared, self._begun = shared, begun

    def __getstate__(self) -> dict[str, Any]:
        """Return what the process gets while it begins."""
        return {name: value for name, value in vars(self).items() if name not in ("_teller", "_shared", "_begun")}

    def start(self) -> None:
        """Begin."""
        super().start()
        self._begun.append(self)
        self._common.close()  # so that telling ends when the process does
        threading.Thread(target=_tell, args=(self._teller, self._shared), daemon=True).start()
        self._shared = None  # it may be large

    def run(self) -> None:
        """Work; this is the other process."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # on Windows nobody has held it
        threading.Thread(target=_leave_with_parent, daemon=True).start()
        with self._common:
            _SHARED[0] = self._common.recv()
        super().run()


def _tell(teller: Connection, shared: Any) -> None:
    """Send to a process what all jobs need, unless it dies."""
    with teller, suppress(OSError):
        teller.send(shared)


def _leave_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _in_pool(
    pool: ProcessPoolExecutor,
    work: Work[Job, Result],
    coming: Iterator[tuple[int, Job]],
    waiting: dict[int, Job],
    ahead: int,
) -> Iterator[tuple[int, Result]]:
    """Run jobs in a pool; `waiting` holds those that are begun and not done, also when the pool breaks."""
    running: dict[Future[Result], int] = {}
    for number, job in waiting.items():
        running[_submit(pool, work, job)] = number
    while True:
        while len(running) < ahead and (new := next(coming, None)) is not None:
            waiting[new[0]] = new[1]
            running[_submit(pool, work, new[1])] = new[0]
        if not running:
            return
        done, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            result = future.result()
            number = running.pop(future)
            del waiting[number]
            yield number, result


def _submit(pool: ProcessPoolExecutor, work: Work[Job, Result], job: Job) -> Future[Result]:
    """Give a job to a pool, which may start a process for it."""
    with _undisturbed():
        return pool.submit(_with_shared, work, job)


_SHARED: list[Any] = [None]  # of this process


def _with_shared(work: Callable[[Any, Any], Any], job: Any) -> Any:
    return work(job, _SHARED[0])


def _keeps_dying() -> ScanTrussError:
    return ScanTrussError("the workers die again and again, perhaps for want of memory; use fewer of them")


class Cluster(Workers):
    """A Dask cluster: the user's, or one on this machine for as long as the work takes."""

    alone = False

    def __init__(self, count: int, scheduler: str = "") -> None:
        from distributed import Client

        self._ends = ExitStack()
        failure: ScanTrussError | None = None
        try:
            cluster = scheduler or self._ends.enter_context(_local_cluster(count))
            self._client = self._ends.enter_context(Client(cluster, timeout=PATIENCE))
            versions = self._client.run(_version)
        except ModuleNotFoundError:
            versions = {scheduler: ""}
        except Exception as error:  # what answers may be anything, and its first bytes a length
            failure = _no_cluster(scheduler, error)
        except BaseException:
            self._ends.close()
            raise
        if failure is not None:  # out of reach of the error, which holds a client that came up by half
            self._ends.close()
            gc.collect()  # or that one is closed while the next one starts, and each waits for the other
            raise failure
        other = sorted({version or "none" for version in versions.values() if version != __version__})
        if other or not versions:
            self._ends.close()
            raise InputError(
                f"the workers at {scheduler} have scantruss {other[0]}, this is {__version__}; install the same there"
                if other
                else f"the cluster at {scheduler} has no workers; start some"
            )
        self.count = len(versions)
        self.words = f"on {self.count} workers " + (f"at {scheduler}" if scheduler else "of this machine (dask)")

    def run(self, work: Work[Job, Result], jobs: Iterable[Job], shared: Any = None) -> Iterator[tuple[int, Result]]:
        """Yield the number of each job and its result, in the order in which they are done."""
        from concurrent.futures import CancelledError

        from distributed import as_completed
        from distributed.scheduler import KilledWorker

        coming = enumerate(jobs)
        done = as_completed()
        running: dict[str, tuple[int, Job]] = {}
        common = self._share(shared)
        deaths = 0

        def submit(number: int, job: Job) -> None:
            future = self._client.submit(work, job, common, pure=False)
            running[future.key] = number, job
            done.add(future)

        while True:
            while len(running) < AHEAD * self.count and (new := next(coming, None)) is not None:
                submit(*new)
            if not running:
                return
            future = next(done)
            number, job = running.pop(future.key)
            try:
                result = future.result()
            except (CancelledError, KilledWorker):  # what was shared may have died with its workers
                deaths += 1
                if deaths > DEATHS:
                    raise _keeps_dying() from None
                common = self._share(shared)
                submit(number, job)
                continue
            deaths = 0
            yield number, result

    def _share(self, shared: Any) -> Any:
        """Send to all workers what all jobs need."""
        return None if shared is None else self._client.scatter(shared, broadcast=True, hash=False)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let go of the cluster; end it where it is our own."""
        self._ends.close()


def _local_cluster(count: int) -> Any:
    """Return a cluster on this machine; interrupted while it starts it is ended first, as half of one cannot be."""
    from distributed import LocalCluster

    made: list[Any] = []
    options = {"threads_per_worker": 1, "dashboard_address": ":0", "silence_logs": logging.CRITICAL}
    try:
        with _undisturbed():
            made.append(LocalCluster(n_workers=count, **options))
    except BaseException:  # ctrl-C, or the command line's word for a polite end
        for cluster in made:
            with suppress(Exception):
                cluster.close()
        raise
    return made[0]


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Put off ctrl-C and a polite end until a block is done, as what is started by half can neither be used nor ended.

    Threads and processes that it starts do not get ctrl-C at all, or they would die of it with a traceback: who started them ends them.
    """
    came: list[int] = []
    with ExitStack() as stack:
        stack.callback(_send_on, came)
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):  # any other thread may take what is held here
                if callable(kept := signal.getsignal(number)):
                    signal.signal(number, lambda number, frame: came.append(number))
                    stack.callback(signal.signal, number, kept)
        if hasattr(signal, "pthread_sigmask"):
            resource_tracker.ensure_running()  # would lift it again
            stack.callback(signal.pthread_sigmask, signal.SIG_SETMASK, signal.pthread_sigmask(signal.SIG_BLOCK, []))
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield


def _send_on(came: list[int]) -> None:
    """Let signals have the effect that was put off."""
    for number in came:
        signal.raise_signal(number)


def _no_cluster(scheduler: str, error: Exception) -> InputError:
    """Return what to say where a cluster cannot be used."""
    said = " ".join(str(error).split())[:80] or type(error).__name__
    if scheduler:
        said = said if isinstance(error, OSError | ValueError) else "something else answers there"
        return InputError(f"no scheduler answers at {scheduler} ({said}); check the address")
    return InputError(f"the workers of this machine do not start ({said}); use --workers 1")


def _version() -> str:
    return __version__
