"""How long work tells how far it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called with the stage and the share of it that is done, 0 to 1; it may raise to cancel."""
