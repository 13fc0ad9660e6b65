"""The entry point: little is imported before Ctrl-C is handled."""

from __future__ import annotations

import gc

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
    gc.freeze()  # the end of a process would go through all objects for cycles, for a seventh of a short command
    return status
