"""The entry point: little is imported before Ctrl-C is handled."""

from __future__ import annotations

import os


def start() -> int:
    """Run the command line; an interruption during imports is one line too."""
    try:
        from .main import main
    except KeyboardInterrupt:
        os.write(2, b"scantruss: interrupted; nothing was written\n")
        return 130
    return main()
