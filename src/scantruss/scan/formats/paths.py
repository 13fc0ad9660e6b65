"""The files of one scan: a file, a shell pattern, or several of these."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from glob import glob
from pathlib import Path

from ...errors import FormatError

FileNames = str | Path | Iterable[str | Path]


def files_of(source: FileNames) -> list[Path]:
    """Return the files that a name, a pattern such as ``tiles/*.laz``, or several of these mean.

    The files of a pattern come in the order of their names (`**` looks into folders), each file once; a file whose name holds
    pattern characters is taken as that file.

    Raises
    ------
    FormatError
        A pattern fits no file, or there is no name at all.
    """
    names = [source] if isinstance(source, str | Path) else list(source)
    found = [file for name in names for file in _files(name)]
    if not found:
        raise FormatError("no scan file is named; name a file, or a pattern such as 'tiles/*.laz'")
    return list(dict.fromkeys(found))


def name_of_files(source: FileNames) -> str:
    """Return a short name for all of them, for messages."""
    if isinstance(source, str | Path):
        return Path(source).name
    names = [Path(name).name for name in source]
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more" if names else ""


def _files(name: str | Path) -> list[Path]:
    text = os.fspath(name)
    if not re.search(r"[*?\[]", text) or os.path.lexists(text):
        return [Path(name)]
    files = sorted(Path(file) for file in glob(text, recursive=True) if Path(file).is_file())  # noqa: PTH207 - absolute and relative patterns alike
    if not files:
        raise FormatError(f"no file fits the pattern {text}; check the folder and the suffix")
    return files
