"""The one decorator of all kernels: compile, cache, never fail for want of a folder.

numba looks only at the file of the kernel itself when it decides whether its stored machine code is still good, so after an
edit of a callee in another file it would silently run old code. The machine code is therefore kept in a folder that is named
after the contents of *all* kernel files. Where no folder can be written the kernels compile in memory. What the usual commands
need is compiled when the package is installed (`hatch_build.py`), lies beside it and is looked at first.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import llvmlite.binding
import numba
import numpy as np
from numba.core import event

from .cache import compiled

F = TypeVar("F", bound=Callable[..., object])


def _processor() -> str:
    """What numba compiles for: the processor that it finds, or that its settings name."""
    try:
        features = numba.config.CPU_FEATURES or llvmlite.binding.get_host_cpu_features().flatten()
    except RuntimeError:  # which LLVM does not know of this one
        features = ""
    return f"{numba.config.CPU_NAME or llvmlite.binding.get_host_cpu_name()} {features}"


def _contents() -> str:
    """Digest of all kernel files, of what compiles them and of what for."""
    digest = hashlib.sha256(f"{numba.__version__} {sys.version_info[:2]} {_processor()}".encode())
    digest.update(os.environ.get("NUMBA_BOUNDSCHECK", "").encode())
    for path in sorted((Path(__file__).parents[1] / "kernels").rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _home() -> Path:
    """Where machine code is kept: NUMBA_CACHE_DIR, else the user's cache folder."""
    named = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    if named:
        return Path(named)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home())
    return Path.home() / (".cache" if sys.platform != "darwin" else "Library/Caches")


def _folder() -> Path | None:
    """The folder of the machine code, made and tried; None where nothing can be written."""
    try:
        homes = [_home()]
    except RuntimeError:  # no home folder
        homes = []
    for home in (*homes, Path(tempfile.gettempdir()) / f"scantruss-{os.getuid() if hasattr(os, 'getuid') else 'user'}"):
        folder = home / "scantruss" / FOLDER_NAME
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return None


def _installed() -> Path | None:
    """The folder of the machine code that came with the package; None where none did, or it is of other kernels.

    SCANTRUSS_INSTALLED=0 leaves it aside: to measure a first run that compiles.
    """
    if os.environ.get("SCANTRUSS_INSTALLED") == "0":
        return None
    folder = Path(__file__).parents[1] / "machine_code" / FOLDER_NAME
    return folder if folder.is_dir() else None


FOLDER_NAME = f"kernels-{_contents()}"
KERNEL_FOLDER = _folder()
INSTALLED_FOLDER = _installed()


@contextmanager
def report_compiling(tell: Callable[[], None]) -> Iterator[None]:
    """Call `tell` once, before the first function that is compiled meanwhile; never where all are found on disk."""

    class FirstOnly(event.Listener):  # type: ignore[misc]
        heard = False

        def on_start(self, event: Any) -> None:
            if not self.heard:
                self.heard = True
                tell()

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:compile", FirstOnly()):
        yield


def record_type(**fields: type[np.generic] | tuple[type[np.generic], int]) -> np.dtype[np.void]:
    """Return the type of records with named fields: numbers, or rows of so many numbers.

    ``np.zeros(5, POINT)[2].weight`` is a field of one of five records; kernels and plain Python read and write it alike.
    """
    return np.dtype(
        (np.record, [(name, *(kind if isinstance(kind, tuple) else (kind,))) for name, kind in fields.items()])
    )


def new_record(kind: np.dtype[np.void]) -> np.record:
    """Return one record of a type, all zero."""
    return cast(np.record, np.zeros(1, kind)[0])


def kernel(function: F) -> F:
    """Compile a function of arrays and numbers on its first call; releases the GIL.

    Parameters
    ----------
    function : a loop over arrays, numbers and NamedTuples of arrays

    Returns
    -------
    callable
        The compiled function; the plain one where NUMBA_DISABLE_JIT is set.
    """
    return cast(F, compiled(function, KERNEL_FOLDER, INSTALLED_FOLDER))
