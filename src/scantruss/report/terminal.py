"""The terminal: a progress bar for each stage, and tables; rich is imported only when there is something to draw."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager
from types import TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID


quiet = False  #: print nothing: neither bars nor notes nor results


class Bars(AbstractContextManager["Bars"]):
    """A progress bar for each stage on stderr, if that is a terminal, and notes on stderr.

    An object is a ``progress(stage, share)`` for the functions of the library.
    """

    def __init__(self) -> None:
        self._rich: RichProgress | None = None
        self._tasks: dict[str, TaskID] = {}
        self._current = ""
        self._said: set[str] = set()

    def __enter__(self) -> Bars:
        """Start drawing, if stderr is a terminal."""
        if sys.stderr.isatty() and not quiet:
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

            columns = (TextColumn("{task.description:<12}"), BarColumn(), TimeElapsedColumn())
            self._rich = Progress(*columns, console=Console(stderr=True), transient=True)
            self._rich.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the bars."""
        if self._rich is not None:
            self._rich.stop()

    def __call__(self, stage: str, share: float) -> None:
        """Show how far a stage is."""
        if self._rich is None:
            return
        if stage != self._current:
            if self._current:
                self._rich.update(self._tasks[self._current], completed=1.0)
            self._current = stage
        if stage not in self._tasks:
            self._tasks[stage] = self._rich.add_task(stage, total=1.0)
        self._rich.update(self._tasks[stage], completed=min(max(share, 0.0), 1.0))

    def note(self, line: str) -> None:
        """Print one line, above the bars if there are any."""
        if quiet:
            return
        if self._rich is not None:
            self._rich.console.print(line, highlight=False, markup=False)
        else:
            print(line, file=sys.stderr, flush=True)

    def note_once(self, line: str) -> None:
        """Print one line, unless it has been printed in this way before."""
        if line not in self._said:
            self._said.add(line)
            self.note(line)


def print_lines(lines: list[str]) -> None:
    """Print plain lines as they are."""
    if lines and not quiet:
        print("\n".join(lines))


def print_table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> None:
    """Print a table, words to the left and figures to the right: drawn by rich on a terminal, plain columns elsewhere."""
    if quiet:
        return
    texts = [i == 0 or any(row[i][:1].isalpha() for row in rows) for i in range(len(head))]
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.table import Table

        table = Table(*head, box=None, pad_edge=False)
        for column, is_text in zip(table.columns, texts, strict=True):
            column.justify = "left" if is_text else "right"
        for row in rows:
            table.add_row(*row)
        Console().print(table)
        return
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    for row in [head, *rows]:
        cells = [
            cell.ljust(width) if is_text else cell.rjust(width)
            for cell, width, is_text in zip(row, widths, texts, strict=True)
        ]
        print("  ".join(cells).rstrip())
