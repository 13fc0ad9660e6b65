"""What all tests share: Hypothesis without deadlines (kernels compile on their first call) and without chance.

A shell has what it starts in the background ignore interrupts, and so does all that this starts in turn; the tests that
interrupt a run would then wait for it to its end, and fail.
"""

import gc
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Generator
from contextlib import suppress
from pathlib import Path

import pytest
from browser import close_chromium
from hypothesis import settings

from scantruss.runtime.memory import RARELY

settings.register_profile("scantruss", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("scantruss")

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of each worker, as there are as many workers as processors

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

LONGEST = {
    f"test_{name}"
    for name in ("studio_page", "studio_cells_page", "studio_walk", "register", "candidates", "wide_ridges")
}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the modules that have tests of half a minute, so that no process is left alone with one in the end."""
    items.sort(key=lambda item: item.path.stem not in LONGEST)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keep the garbage collector off what is loaded: it stays to the end, and each look at it takes a third of a second."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(RARELY)  # so that no command sets it aside again
        gc.enable()


def pytest_configure(config: pytest.Config) -> None:
    """Keep bytecode with pytest's cache where Python may write none beside modules: hundreds of processes import us, a second each."""
    cache = getattr(config, "cache", None)
    if not sys.dont_write_bytecode or cache is None:
        return
    with suppress(OSError):  # of a folder that cannot be written
        folder = str(cache.mkdir("bytecode"))
        for left in Path(folder + tempfile.gettempdir()).glob("pytest-of-*"):  # of what earlier tests copied
            shutil.rmtree(left, ignore_errors=True)
        sys.pycache_prefix, sys.dont_write_bytecode = folder, False
        os.environ["PYTHONPYCACHEPREFIX"] = folder  # of what is started from here, workers among it
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def pytest_sessionfinish() -> None:
    """End the browser that the tests of a process share."""
    close_chromium()
