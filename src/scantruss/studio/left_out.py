"""What of a scan is not in the grid, in the words of the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..report.figures import left_out_lines
from ..scan.cloud import WITHOUT_COORDINATES
from .scan_parts import selected

if TYPE_CHECKING:
    from .state import StudioState

MOST_LEFT_OUT = 8  #: of what is left out, on the page


def words_left_out(state: StudioState) -> list[str]:
    """Return what the grid of a state leaves out, what was not taken of the scan, and what of these only the studio knows of."""
    cloud, whole, certificate = state.cloud, state.whole, None if state.grid is None else state.grid.certificate
    if cloud is None:
        return []
    unread = [*cloud.left_out, *((WITHOUT_COORDINATES, cloud.dropped) for _ in range(cloud.dropped > 0))]
    lines = left_out_lines(certificate) if certificate is not None else [_line(*each) for each in unread]
    if whole is None:
        return lines
    if state.settings.classes or state.settings.crop:
        _, counts = selected(whole, state.settings)
        known = dict(unread)
        lines += [_line(words, count) for words, count in counts.items() if count and words not in known]
    if state.cleaning is not None:
        said = f": {'; '.join(state.cleaning.words)}" if state.cleaning.words else ""
        lines.append(_line(f"removed by Clean{said}", int(state.cleaning.removes.sum())))
    if state.removed is not None:
        lines.append(_line("removed by hand", int(state.removed.sum())))
    return lines


def words_on_page(lines: list[str]) -> str:
    """Return as many lines as the page has room for, and how many more there are."""
    more = [f"and {len(lines) - MOST_LEFT_OUT} more, in the report of the grid"] if len(lines) > MOST_LEFT_OUT else []
    return "\n\n".join([*lines[:MOST_LEFT_OUT], *more])


def _line(words: str, count: int) -> str:
    return f"left out: {count:,} points {words}"
