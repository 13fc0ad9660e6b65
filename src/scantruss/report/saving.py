"""Files that appear all together or not at all."""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any

from ..errors import FormatError


class SaveTogether:
    """Write files beside their places; rename them into place only when everything has succeeded.

    ::

        with SaveTogether() as save:
            write(grid, save.beside("out/grid.obj"))
            save.json("out/report.json", values)

    Whatever a writer makes in the folder it is given moves along, so a format of two files stays together.
    """

    def __init__(self) -> None:
        self._folders: dict[Path, Path] = {}  # place -> temporary folder in it
        self._made: list[Path] = []  # folders of results that did not exist before

    def __enter__(self) -> SaveTogether:
        """Start."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Move the files into place, or leave nothing behind."""
        try:
            if kind is None:
                self._move()
                self._made.clear()
            elif isinstance(error, FormatError):
                raise FormatError(self._in_place(str(error))) from None
        finally:
            for folder in self._folders.values():
                shutil.rmtree(folder, ignore_errors=True)
            for folder in reversed(self._made):
                shutil.rmtree(folder, ignore_errors=True)

    def make_folder(self, folder: str | Path) -> Path:
        """Make a folder for results, taken away again if the run fails."""
        folder = Path(folder)
        missing = [place for place in (folder, *folder.parents) if not place.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        self._made.extend(reversed(missing))
        return folder

    def beside(self, path: str | Path) -> Path:
        """Return where to write the file that shall end up at `path`."""
        path = Path(path)
        place = path.parent
        if place not in self._folders:
            self._folders[place] = Path(tempfile.mkdtemp(prefix=".scantruss-", dir=place))
        return self._folders[place] / path.name

    def json(self, path: str | Path, values: dict[str, Any]) -> None:
        """Save plain values as readable JSON."""
        text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False)
        self.beside(path).write_text(text + "\n", encoding="utf-8", newline="\n")

    def _in_place(self, message: str) -> str:
        """Name the places that the user knows in a message of a writer."""
        for place, folder in self._folders.items():
            message = message.replace(str(folder), str(place))
        return message

    def _move(self) -> None:
        """Rename all files into place."""
        moves = [
            (file, place / file.name) for place, folder in self._folders.items() for file in sorted(folder.iterdir())
        ]
        for _, target in moves:
            if target.is_dir():
                raise FormatError(f"cannot write {target}: it is a folder; name a file")
        for file, target in moves:
            file.replace(target)
