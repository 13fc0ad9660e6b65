"""Rows of buttons, each of which has words of its own while the pointer rests on it: viser has one tooltip for a whole row."""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape
from typing import Any


class ButtonRows:
    """Makes rows of buttons, and tells the page their words (`page_keys.js`)."""

    def __init__(self, gui: Any) -> None:
        self._gui = gui
        self._hints: dict[str, dict[str, str]] = {}

    def add(self, label: str, hints: Mapping[str, str]) -> Any:
        """Add a row with a label that no other row has; `hints` has the words of each button by its name."""
        self._hints[label] = dict(hints)
        return self._gui.add_button_group(label, tuple(hints))

    def html(self) -> str:
        """Return what the page reads the words from."""
        return f'<div class="studio-unseen" hidden data-hints="{escape(json.dumps(self._hints))}"></div>'
