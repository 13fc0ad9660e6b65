"""Cleaning a scan, one module a step: what Sec. 2.2 of the paper leaves to the scanner's software.

``from scantruss.scan.clean import clean_points`` does them all. The chain of `scantruss grid` takes single steps.
"""

from __future__ import annotations

from typing import Any

__all__ = ["CleanCloud", "clean_points"]


def __getattr__(name: str) -> Any:
    """Import what is public on first use: the chain needs single steps only, and `surface.samples` is among those that take them."""
    if name not in __all__:
        raise AttributeError(f"module 'scantruss.scan.clean' has no attribute {name!r}")
    from . import steps

    return getattr(steps, name)
