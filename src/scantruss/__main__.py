"""``python -m scantruss`` is the command line."""

import sys

from .cli.start import start

if __name__ == "__main__":
    sys.exit(start())
