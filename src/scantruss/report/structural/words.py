"""Loads and supports in words that need no command line to be understood."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

SUPPORT_NAMES = {
    "corners": "corners of the boundary", "boundary": "the longest boundary loop of each piece", "fixed": "fixed nodes of the grid",
}  # fmt: skip
SUPPORT_KINDS = {"loop": "boundary loop {}", "line": "line {}", "lowest": "nodes up to {} above the lowest"}


def supports_in_words(where: str) -> str:
    """Return in words which nodes are supported, such as "boundary loop 1 and corners of the boundary"."""
    found = []
    for word in where.split("+"):
        kind, _, value = word.strip().partition(":")
        value = f"{value} m" if kind == "lowest" and re.fullmatch(r"[\d.]+", value) else spaced(value)
        named = SUPPORT_KINDS.get(kind, "").format(value) if value else SUPPORT_NAMES.get(kind, "")
        found.append(named or word.strip())
    return " and ".join(found)


def load_words(load: str | Mapping[str, Any]) -> str:
    """Return a load in words, such as "snow 1 kN/m2 on the area in plan"."""
    if not isinstance(load, str):
        words = load_words(str(load["load"])) if "load" in load else ""
        name = str(load.get("case", "")) or words or "load"
        return f"{name} ({words})" if words and name != words else name
    kind, _, rest = load.strip().partition(":")
    rest, _, direction = rest.partition("@")
    value, _, coefficient = rest.partition(":")
    value = spaced(value)
    towards = f"towards {direction} degrees from x"
    match kind:
        case "self":
            return "self-weight"
        case "cladding":
            return f"cladding {value} on the surface"
        case "snow":
            return f"snow {value} on the area in plan"
        case "half-snow":
            ways = {"": "towards +x, +y, -x and -y in turn", "all": "in every direction in turn"}
            return f"snow {value} on half of the area in plan, {ways.get(direction, towards)}"
        case "wind" if "/" in coefficient:
            pushed, pulled = coefficient.split("/", 1)
            return f"wind {value} {towards}, coefficients {pushed} on what faces it and {pulled} on the rest"
        case "wind":
            return f"wind {value}, coefficient {coefficient or '1'} on the surface"
        case "temperature":
            return f"change of temperature {value}"
    return load.strip()


def spaced(value: str) -> str:
    """Return a quantity with a blank before its unit: 1 kN/m2."""
    return re.sub(r"^([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(?=[^\d\s.])", r"\1 ", value.strip())


def fixed(value: float, decimals: int) -> str:
    """Return a number with so many decimals, thousands apart, and no sign of nil."""
    words = f"{value:,.{decimals}f}"
    return words[1:] if float(words.replace(",", "")) == 0.0 and words.startswith("-") else words
