"""Where the program begins: little is imported before Ctrl-C is listened to."""

from __future__ import annotations

import os


def start() -> int:
    """Run the command line; an interruption while its modules are imported is one line too."""
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
