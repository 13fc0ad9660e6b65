"""Head of the panel: what the studio is at, what was refused, what undo and redo would take.

It is always as high, so that nothing below it moves under a pointer.
"""

from __future__ import annotations

from html import escape
from time import monotonic
from typing import Any

from .scan_steps import LARGEST_UPLOAD, TOO_LARGE
from .session import Session

WAYS_BACK = ("undo", "redo")


class Head:
    """Words and a bar of progress above all tabs."""

    def __init__(self, gui: Any) -> None:
        self._words = gui.add_html("")
        gui.add_html(words_of_large_upload())
        self._progress = gui.add_progress_bar(0.0)

    def show(self, session: Session) -> None:
        """Show what a session is at."""
        taken = [f"{way}: {what}" for way, what in zip(WAYS_BACK, session.history.words, strict=True) if what]
        self._words.content = (
            f'<div class="studio-head"><div role="status">{words_of_session(session)}{time_of_session(session)}</div>'
            f"<small>{escape(' · '.join(taken)) or '&nbsp;'}</small></div>"
        )
        self._progress.value = 100.0 * session.share if session.stage else 0.0


def words_of_session(session: Session) -> str:
    """Return what a session is at as HTML."""
    if session.message:
        return f'<div class="studio-refused"><b>Refused:</b> {escape(session.message)}</div>'
    if session.stage:
        return "stopping" if session.worker.is_stopping else escape(session.stage)
    if session.was_stopped:
        return "stopped; what was there before is kept"
    if session.found[0] is session.state:
        return escape(session.found[1])
    if session.state.is_stale:
        return "The grid was made before the last change: press <b>Generate</b>"
    if session.state.is_structure_stale:
        return "The structure was solved before the last change: press <b>Run</b>"
    return "ready"


def time_of_session(session: Session) -> str:
    """Return for how long a session has been at what runs, as HTML; the page lets it go on by itself (`page_script.js`)."""
    if not session.stage or session.message:
        return ""
    seconds = int(monotonic() - session.began)
    return f' <span aria-hidden="true" data-seconds="{seconds}">{f"{seconds} s" if seconds else ""}</span>'


def words_of_large_upload() -> str:
    """Return what the page says of a file that is larger than it sends; hidden until one is chosen (`page_script.js`)."""
    return (
        f'<p hidden role="alert" data-largest="{LARGEST_UPLOAD}" style="padding:0 .6em"><b>Refused:</b> {TOO_LARGE}</p>'
    )
