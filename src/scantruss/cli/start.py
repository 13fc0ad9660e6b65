"""The entry point: little is imported before Ctrl-C is handled."""

from __future__ import annotations

import os


def start() -> int:
    """Run the command line; an interruption during imports is one line too."""
    try:
        from ..runtime.stopping import leave_to_watch, watch

        watch()
        from .main import main
    except KeyboardInterrupt:
        os.write(2, b"scantruss: interrupted; nothing was written\n")
        os._exit(130)
    status = main()
    leave_to_watch()
    return status
