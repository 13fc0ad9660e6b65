"""Where a file may be written: its suffix, its folder, and what may stand in the way."""

from __future__ import annotations

import errno
import os
from collections.abc import Collection
from difflib import get_close_matches
from pathlib import Path

from ..errors import FormatError

#: suffix of another program -> suffix of the format that it reads
RELATED_SUFFIXES = {
    ".dwg": ".dxf", ".dgn": ".dxf", ".rvt": ".ifc", ".igs": ".step", ".iges": ".step", ".sat": ".step", ".gltf": ".glb",
    ".fbx": ".glb", ".dae": ".glb", ".usdz": ".glb", ".shp": ".geojson", ".gpkg": ".geojson", ".kml": ".geojson", ".ods": ".xlsx",
    ".sdb": ".s2k", ".gh": ".karamba.json", ".bdf": ".inp",
}  # fmt: skip


def suffix_of(path: Path, suffixes: Collection[str]) -> str:
    """Return which of some suffixes, in lower case, a name ends in, the longest of several; "" for none."""
    name = path.name.lower()
    return max(
        (suffix for suffix in suffixes if name.endswith(suffix.lower()) and name != suffix), key=len, default=""
    ).lower()


def nearest_suffix(path: Path, suffixes: Collection[str]) -> str:
    """Return words on which of some suffixes is nearest to that of a path, by its letters or by what it is for; "" where none is."""
    own, both = path.suffix.lower(), "".join(path.suffixes[-2:]).lower()
    double = [suffix for suffix in suffixes if suffix.count(".") > 1]  # such as .saf.xlsx
    near = (
        get_close_matches(both, double, 1, 0.8)
        or [suffix for suffix in suffixes if suffix == RELATED_SUFFIXES.get(own)]
        or get_close_matches(own, suffixes, 1, 0.6)
    )
    return f"; the nearest is {near[0]}" if near else ""


def check_place(path: str | Path, suffixes: Collection[str]) -> Path:
    """Return the path if a file can be written there; ask before any long work.

    Parameters
    ----------
    path : file to be written
    suffixes : collection of str
        The suffixes that can be written, in lower case.

    Raises
    ------
    FormatError
        The suffix is unknown, the folder does not exist or cannot be written to, or a folder has this name.
    """
    path = Path(path)
    if not suffix_of(path, suffixes):
        raise FormatError(
            f'no format for "{path.suffix or path.name}"; use one of {" ".join(sorted(set(suffixes)))}'
            f"{nearest_suffix(path, suffixes)}"
        )
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
