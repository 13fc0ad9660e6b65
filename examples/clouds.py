"""The clouds of the examples are those of the tests: generators with known answers, see tests/shapes.py."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))

from shapes import Shape, make

__all__ = ["Shape", "make"]
