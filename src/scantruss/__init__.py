"""From a 3D scan straight to a free-form grid truss (Ding, Xu and Luo 2017)."""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_HOMES = {
    "ScanTrussError": "errors", "InputError": "errors", "FrontError": "errors", "FormatError": "errors",
    "CertificateError": "errors",
    "Settings": "settings",
    "PointCloud": "scan.cloud", "read_points": "scan.formats.reading",
    "clean_points": "scan.clean.steps", "CleanCloud": "scan.clean.steps",
    "sample_surface": "surface.samples",
    "Boundary": "boundary.find", "find_boundary": "boundary.find",
    "find_constraints": "constraints.find",
    "orientation_fields": "front.orientation_field",
    "advance_front": "front.advance", "advance_fronts": "candidates", "optimize_fronts": "candidates",
    "Grid": "grid.grid", "GridQuality": "grid.quality", "Topology": "grid.quality",
    "optimize_grid": "improve.optimize",
    "Certificate": "grid.certificate", "certify": "check.certify",
    "grid_from_points": "pipeline", "grid_from_scan": "pipeline",
    "write": "export.formats", "read_grid": "export.json",
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
