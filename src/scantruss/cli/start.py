"""The entry point: little is imported before Ctrl-C is handled."""

from __future__ import annotations

from .. import end_at_once


def start() -> int:
    """Run the command line; an interruption during imports is one line too."""
    try:
        from ..runtime.stopping import leave_to_watch, watch

        watch()
        from .main import main
    except KeyboardInterrupt:
        end_at_once()
    status = main()
    leave_to_watch()
    return status
