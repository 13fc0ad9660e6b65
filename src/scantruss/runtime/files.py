"""Writing files so that nothing half-written is ever left behind.

A file is written beside its place under another name and renamed when it is whole, so that a full disk or a killed run
leaves what was there before.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from collections.abc import Collection, Mapping
from pathlib import Path

from ..errors import FormatError


def check_place(path: str | Path, suffixes: Collection[str]) -> Path:
    """Return the path if a file can be written there; ask before any long work.

    Parameters
    ----------
    path : str or Path
        File to be written.
    suffixes : collection of str
        The suffixes that can be written, in lower case.

    Raises
    ------
    FormatError
        The suffix is unknown, the folder does not exist or cannot be written to, or a folder has this name.
    """
    path = Path(path)
    if path.suffix.lower() not in suffixes:
        raise FormatError(f'no format for "{path.suffix or path.name}"; use one of {" ".join(sorted(suffixes))}')
    folder = path.parent
    try:
        path.lstat()
    except OSError as error:
        if error.errno not in (
            errno.ENOENT,
            errno.ENOTDIR,
        ):  # a name that is too long, a ring of links, a folder barred
            raise FormatError(f"cannot write {path}: {error.strerror or error}; choose another name") from None
    if not folder.exists():
        raise FormatError(f"cannot write {path}: the folder {folder} does not exist; make it first or choose another")
    if not folder.is_dir():
        raise FormatError(f"cannot write {path}: {folder} is a file, not a folder; choose another folder")
    if path.is_dir():
        raise FormatError(f"cannot write {path}: it is a folder; give the name of a file")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FormatError(f"cannot write {path}: no permission to write in the folder {folder}; choose another")
    if path.exists() and not os.access(path, os.W_OK):
        raise FormatError(f"cannot write {path}: the file is write-protected; choose another name")
    return path


def write_files(contents: Mapping[Path, bytes]) -> list[Path]:
    """Write files that belong together: all of them or none.

    Parameters
    ----------
    contents : mapping of Path to bytes
        What each file is to hold.

    Returns
    -------
    list of Path
        The files written, in the order given.

    Raises
    ------
    FormatError
        A file could not be written (full disk, no permission); no half-written file is left.
    """
    waiting: dict[Path, Path] = {}  # temporary file -> its final place
    path = Path()
    try:
        for path, content in contents.items():
            place = Path(os.path.realpath(path))  # a link stays a link
            temporary = place.with_name(f".scantruss-{os.getpid()}-{secrets.token_hex(4)}.part")
            waiting[temporary] = place
            with temporary.open("xb") as stream:
                stream.write(content)
        for temporary, place in waiting.items():
            path = place
            temporary.replace(place)
    except OSError as error:
        words = error.strerror or error
        raise FormatError(f"cannot write {path.name}: {words}; make room or choose another folder") from None
    finally:
        for temporary in waiting:
            with contextlib.suppress(OSError):  # the first error is the one to tell
                temporary.unlink(missing_ok=True)
    return list(contents)
