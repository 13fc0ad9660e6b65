"""From a 3D scan straight to a free-form grid truss (Ding, Xu and Luo 2017)."""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_HOMES = {
    "ScanTrussError": "errors", "InputError": "errors", "FrontError": "errors", "FormatError": "errors",
    "CertificateError": "errors",
    "Settings": "settings",
    "PointCloud": "scan.cloud", "read_points": "scan.readers",
    "clean_points": "clean.steps", "CleanCloud": "clean.steps",
    "sample_surface": "scan.sites",
    "Boundary": "boundary", "find_boundary": "boundary",
    "find_constraints": "lines.find",
    "orientation_fields": "rows",
    "advance_front": "front", "advance_fronts": "candidates", "optimize_fronts": "candidates",
    "Grid": "grid.grid", "GridQuality": "grid.quality", "Topology": "grid.quality",
    "optimize_grid": "grid.optimize",
    "Certificate": "grid.certificate", "certify": "grid.proof",
    "grid_from_points": "pipeline", "grid_from_scan": "pipeline",
    "write": "export.formats", "read_grid": "export.json_file",
    "print_model": "export.solid",
}  # fmt: skip

__all__ = sorted([*_HOMES, "__version__"])


def __getattr__(name: str) -> Any:
    """Import a public name on first use, so that the command line starts quickly."""
    if name not in _HOMES:
        raise AttributeError(f"module 'scantruss' has no attribute {name!r}")
    return getattr(importlib.import_module(f"scantruss.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return __all__
