"""Write files whole: beside their place first, renamed when all are complete.

A full disk, an error or an interrupted run leaves what was there before. A link stays a link, a pipe stays a pipe.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

from ..errors import FormatError
from .ours import FORCE_ARGUMENT, MADE_BY, check_ours
from .stopping import is_clean, left_behind, put_into_place, signals_held


class SaveTogether:
    """Write several files, all or none.

    ::

        with SaveTogether() as save:
            write(grid, save.beside("out/grid.obj"))
            save.json("out/report.json", values)

    With a `kind`, "cloud" or "result", a file that is there is replaced only if ScanTruss wrote it and it is of that kind; .json
    is a result either way. Whatever a writer makes in the folder it is given moves along, so the two files of a format stay together.
    """

    def __init__(self, kind: str = "") -> None:
        self._kind = kind
        self._folders: dict[Path, Path] = {}  # place -> temporary folder in it
        self._made: list[Path] = []  # folders of results that did not exist before

    def __enter__(self) -> SaveTogether:
        """Start."""
        left_behind(self._remove)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Move the files into place, or leave nothing behind."""
        try:
            if kind is None:
                self._move()
            elif isinstance(error, FormatError):
                raise FormatError(self._in_place(str(error))) from None
        finally:
            with signals_held():
                self._remove()
                is_clean(self._remove)

    def _remove(self) -> None:
        """Remove what is not in place."""
        for folder in (*self._folders.values(), *reversed(self._made)):
            shutil.rmtree(folder, ignore_errors=True)

    def make_folder(self, folder: str | Path) -> Path:
        """Make a folder for results; it is removed again if the run fails."""
        folder = Path(folder)
        missing = [place for place in (folder, *folder.parents) if not place.exists()]
        with signals_held():
            folder.mkdir(parents=True, exist_ok=True)
            self._made.extend(reversed(missing))
        return folder

    def beside(self, path: str | Path) -> Path:
        """Return where to write the file that is to end up at `path`."""
        path = Path(path)
        return self._folder(path.parent) / path.name

    def json(self, path: str | Path, values: dict[str, Any]) -> None:
        """Save plain values as readable JSON."""
        text = json.dumps({"made_by": MADE_BY, **values}, indent=2, ensure_ascii=False, allow_nan=False)
        self.beside(path).write_text(text + "\n", encoding="utf-8", newline="\n")

    def _folder(self, place: Path) -> Path:
        """Return the temporary folder in a place."""
        if place not in self._folders:
            with signals_held():
                self._folders[place] = Path(tempfile.mkdtemp(prefix=".scantruss-", dir=place))
        return self._folders[place]

    def _in_place(self, message: str) -> str:
        """Name the places that the user knows in a message of a writer."""
        for place, folder in self._folders.items():
            message = message.replace(str(folder), str(place))
        return message

    def _move(self) -> None:
        """Put all files into place: into pipes first, as these can fail, then by renaming."""
        written = [
            (file, place / file.name) for place, folder in self._folders.items() for file in sorted(folder.iterdir())
        ]
        moves, pipes = [], []
        for file, target in written:
            if self._kind:
                check_ours(target, "result" if target.suffix.lower() == ".json" else self._kind)
            if target.is_dir():
                raise FormatError(f"cannot write {target}: it is a folder; name a file")
            if target.exists() and not target.is_file():
                pipes.append((file, target))
            elif target.is_symlink():
                moves.append(self._beside_linked(file, target))
            else:
                moves.append((file, target))
        for file, target in pipes:
            with file.open("rb") as source, target.open("wb") as pipe:
                shutil.copyfileobj(source, pipe)
        with put_into_place():
            for file, target in moves:
                file.replace(target)
            self._made.clear()

    def _beside_linked(self, file: Path, link: Path) -> tuple[Path, Path]:
        """Return a copy of a file beside what a link points to, which may be on another disk, and that place."""
        linked = Path(os.path.realpath(link))
        folder = Path(tempfile.mkdtemp(prefix="linked-", dir=self._folder(linked.parent)))
        return Path(shutil.copyfile(file, folder / file.name)), linked


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Give a folder that is removed after the block, and however the command ends."""
    with signals_held():
        folder = Path(tempfile.mkdtemp(prefix="scantruss-"))
        remove = partial(shutil.rmtree, folder, ignore_errors=True)
        left_behind(remove)
    try:
        yield folder
    finally:
        with signals_held():
            remove()
            is_clean(remove)


def write_files(contents: Mapping[Path, bytes], *, force: bool = False, kind: str = "result") -> list[Path]:
    """Write files that belong together, all or none.

    Parameters
    ----------
    contents : mapping of Path to bytes
        Content of each file.
    force : bool
        Whether to write over a file that ScanTruss did not write, or that is of another kind.
    kind : str
        "result" or "cloud".

    Returns
    -------
    list of Path
        The files written, in the order given.

    Raises
    ------
    FormatError
        A file could not be written (full disk, no permission), no half-written file is left; or one is there that is not ours.
    """
    path = Path()
    if not force:
        for path in contents:
            check_ours(path, kind, FORCE_ARGUMENT)
    try:
        with SaveTogether() as save:
            for path, content in contents.items():
                with save.beside(path).open("xb") as stream:
                    stream.write(content)
    except OSError as error:
        words = error.strerror or error
        raise FormatError(f"cannot write {path.name}: {words}; make room or choose another folder") from None
    return list(contents)
