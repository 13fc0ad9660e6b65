"""Figures of ScanTruss against what others need for the same; `python -m benchmarks` writes docs/numbers.md."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))  # the clouds are those of the tests
