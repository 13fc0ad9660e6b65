"""Where results go: checked before anything is read, so that no run is wasted and no input overwritten."""

from __future__ import annotations

import os
import re
from argparse import Namespace
from pathlib import Path

from ..errors import FormatError
from ..runtime.ours import check_ours
from ..settings import CURVATURE
from ..settings.values import SYMMETRIES_FOUND

Taken = dict[Path, str]  # place of a file -> what is there
OPTION_VALUE = re.compile(r"[a-z-]{2,}:[-+]?\d")  # begin of the value of an option, such as snow:1kN/m2
FILE_SUFFIX = re.compile(r"\.[a-z]\w*$", re.IGNORECASE)  # end of the name of a file


def inputs_of(values: Namespace) -> Taken:
    """Return the files that a command line names for reading."""
    from ..scan.formats.paths import files_of

    given = vars(values)
    named = [(str(file), "scan") for file in files_of(given.get("scans") or given["scan"])]
    single = (
        ("settings", "settings"),
        ("poses", "poses"),
        ("structure", "settings of the structure"),
        ("fixed_file", "list of fixed nodes"),
    )
    named += [(given.get(name) or "", what) for name, what in single]
    named += [(name, "file of lengths") for name in _lengths(given.get("length")) if not name.startswith(CURVATURE)]
    named += [(name, "fixed line") for name in given.get("fixed_lines", ())]
    named += [(name, "mirror planes") for name in [given.get("symmetry")] if name and name not in SYMMETRIES_FOUND]
    named += [(name, "boundary") for name in given.get("boundary", ())]
    named += [(name, "polygon") for name in given.get("crop", ()) if Path(name).is_file()]
    return {Path(name).resolve(): what for name, what in named if name}


def _lengths(given: object) -> list[str]:
    """Return the values of ``--length`` that are not numbers."""
    values = [value for _, value in given] if isinstance(given, list) else [given]
    return [value for value in values if isinstance(value, str)]


def claim(path: Path, what: str, taken: Taken, *, force: bool = False, kind: str = "result") -> None:
    """Claim a path for an output, unless an input or another output is there, or a file that ScanTruss did not write."""
    if (before := taken.get(path.resolve())) is not None:
        raise FormatError(f"the {what} {path} would overwrite the {before}; choose another name")
    if not force:
        check_ours(path, "result" if path.suffix.lower() == ".json" else kind)
    taken[path.resolve()] = what


def outs_of(values: Namespace) -> list[Path]:
    """Return the results that a command line names, in their order.

    Raises
    ------
    UsageError
        None is named.
    """
    from .options import UsageError

    given = getattr(values, "outs", None) or []
    words = [*([given] if isinstance(given, str) else given), *values.more_outs]
    if other := next((word for word in words if OPTION_VALUE.match(word) and not FILE_SUFFIX.search(word)), None):
        raise UsageError(
            f"{other} is not a file to write; if it belongs to the option before it, separate its values by commas, without blanks"
        )
    outs = [Path(word) for word in words]
    if not outs:
        how = "write it last or as -o OUT" if hasattr(values, "outs") else "write it as -o OUT"
        raise UsageError(f"missing OUT, the file of the result; {how}")
    return outs


def claim_clouds(values: Namespace, what: str) -> tuple[list[Path], Taken]:
    """Return the clouds that a command line names as results, and all files it names, once it is known that they can be written."""
    from ..scan.formats.writing import check_cloud_output

    outs, taken = [check_cloud_output(out) for out in outs_of(values)], inputs_of(values)
    for out in outs:
        claim(out, what, taken, force=values.force, kind="cloud")
    return outs, taken


def result_folder(path: str | Path) -> Path:
    """Return the folder for results, if it can be written to, or made."""
    folder = Path(path)
    there = next((place for place in (folder, *folder.parents) if place.exists()), folder)
    if not there.is_dir():
        raise FormatError(f"{there} is a file; name a folder for the results")
    if not os.access(there, os.W_OK | os.X_OK):
        raise FormatError(f"cannot write to {folder}: no permission to write in the folder {there}; choose another")
    return folder


def wrote_line(files: dict[Path, int]) -> str:
    """Say what was written, and how many tables stand beside a .csv; files: how many there are of each place that was named."""
    beside = [
        f"; {count - 1} more tables beside {out}, as {out.stem}_*{out.suffix}"
        for out, count in files.items()
        if count > 1
    ]
    return f"wrote {' '.join(map(str, files))}{''.join(beside)}"
