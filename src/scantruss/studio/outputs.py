"""What a studio gives away: files of every format, the settings, and the command lines that repeat the work."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path

from ..errors import InputError
from ..export.formats import (
    STRUCTURE,
    check_model_unit,
    check_output,
    losses,
    model_of,
    shown_otherwise,
    suffixes_of,
    write,
)
from ..export.model import Model
from ..runtime.files import temporary_folder
from ..scan.formats.writing import write_points
from ..settings import Settings
from ..structure.options import settings_text
from .project import save_project
from .state import StudioState

TAKEN = "taken.ply"  # the points that are taken, where some were removed by hand or the scan was turned
EFFORT_OF_PREVIEW = "quick"
PREVIEW_WORDS = "this is the quick preview; press **Generate** for the final grid"
CLEANED = "clean.ply"  # the scan without the points that were removed


Note = Callable[[str], None]


def unsaid(words: str) -> None:
    """Take a note that nobody wants."""


def model_to_show(state: StudioState, kind: str) -> Model:
    """Return the grid or the structure of a state.

    Raises
    ------
    InputError
        There is none yet.
    """
    if kind == STRUCTURE:
        if state.solution is None:
            raise InputError("there is no structure yet; press Run")
        return model_of(state.solution, report=state.report)
    if state.grid is None:
        raise InputError("there is no grid yet; press Generate")
    return model_of(state.grid, cloud=state.cloud)


def output_files(state: StudioState, kind: str, suffix: str, note: Note = unsaid) -> dict[str, bytes]:
    """Return the files of a format by their names.

    Parameters
    ----------
    note : callable
        ``note(words)`` takes what the command line would say of them.

    Raises
    ------
    ScanTrussError
        There is nothing to write, or the format cannot hold it.
    """
    if suffix not in suffixes_of(kind):
        raise InputError(f"no format {suffix} of a {kind}; use one of {' '.join(suffixes_of(kind))}")
    model = model_to_show(state, kind)
    with temporary_folder() as folder:
        path = check_output(folder / f"{kind}{suffix}", kind)
        check_model_unit(path, model.unit)
        files = {file.name: file.read_bytes() for file in write(model, path)}
    for words in (*losses(model, path), *shown_otherwise(model, path)):
        note(words)
    return files


def project_file(state: StudioState, place: Path | None) -> dict[str, bytes]:
    """Return the project of a state as a file by its name: that of the place where it is saved, or of the scan.

    Raises
    ------
    InputError
        There is no scan.
    """
    if state.cloud is None:
        raise InputError("there is no scan yet; open one")
    name = f"{Path(state.cloud.name or 'scan').stem}.scantruss" if place is None else place.name
    with temporary_folder() as folder:
        save_project(folder / name, state)
        return {name: (folder / name).read_bytes()}


def _of_the_file(state: StudioState) -> Settings:
    """Return the settings that make the grid from the file that is read: a cleaned one holds the chosen points only."""
    made = state.settings if state.grid is None or state.asked is None else state.asked
    if state.is_live:
        made = made.replace(effort=EFFORT_OF_PREVIEW)
    if not state.is_of_file:
        return made.replace(classes=(), crop=())
    if state.cleaning is None:
        return made
    return made.replace(classes=(), crop=tuple(part for part in made.crop if part not in state.cleaning.crop))


def settings_files(state: StudioState) -> dict[str, bytes]:
    """Return the settings of the grid and of the structure as the command line reads them, and the points.

    The points are there where some were removed by hand or the scan was turned, which no option repeats.
    """
    made = _of_the_file(state)
    files = {"settings.json": (json.dumps(made.to_dict(), indent=1, ensure_ascii=False) + "\n").encode()}
    if state.solution is not None:
        files["structure.toml"] = settings_text(state.shown_structure).encode()
    if not state.is_of_file and state.cloud is not None:
        with temporary_folder() as folder:
            cloud = state.cloud
            write_points(
                folder / TAKEN, cloud.points + cloud.origin, normals=cloud.normals, unit=cloud.unit, origin=cloud.origin
            )
            files[TAKEN] = (folder / TAKEN).read_bytes()
    return files


def command_of_project(state: StudioState) -> str:
    """Return the command lines that repeat the grid and the structure with the files of `settings_files`."""
    name = Path(state.cloud.name).name if state.cloud is not None and state.cloud.name else "SCAN"
    made, lines = _of_the_file(state), []
    if not state.is_of_file:
        name = TAKEN
    elif state.cleaning is not None:
        classes = state.settings.classes
        taken = ["--class", ",".join(map(str, classes))] if classes else []
        taken += [word for part in state.cleaning.crop for word in ("--crop", part)]
        lines.append(shlex.join(["scantruss", "clean", name, CLEANED, *taken, *state.cleaning.options]))
        name = CLEANED
    cells = "" if made.cells == Settings.cells else f" --cells {made.cells}"
    lines += [
        shlex.join(["scantruss", "grid", name, "grid.json", "--settings", "settings.json"]),
        f"# settings.json: --length {made.length:g}{cells} --effort {made.effort} and all else",
    ]
    grid = "grid.json"
    if state.grid is not None and (alike := state.grid.alike) is not None:
        grid = "few.json"
        options = ["--parts", alike.parts, "--tolerance", f"{100 * alike.tolerance:g}%", "--count", str(alike.count)]
        options += ["--mirrored", "same"] if alike.mirrored else []
        lines.append(shlex.join(["scantruss", "families", "grid.json", grid, *options, "--scan", name]))
    if state.solution is not None:
        lines.append(shlex.join(["scantruss", "structure", grid, "structure.json", "--settings", "structure.toml"]))
    return "\n".join(lines)
