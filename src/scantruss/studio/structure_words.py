"""How the page says scales, factors, masses and what a structure is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .layers_tool import words_of_depths

if TYPE_CHECKING:
    from .state import StudioState


def scale_of_text(text: str) -> float:
    """Return the number of "0.01" or "1:100"; a ValueError where it is none."""
    first, colon, second = text.partition(":")
    number = float(second) if colon else 1.0
    if not number > 0:
        raise ValueError
    return float(first) / number


def text_of_scale(scale: float) -> str:
    """Return a scale as people write it: 0.002 as 1:500, 500 as 500:1; a number where it is no ratio to one."""
    for ratio, words in ((1.0 / scale, "1:{:g}"), (scale, "{:g}:1")):
        if ratio >= 1.0 and abs(ratio - round(ratio)) <= 1e-9 * ratio:
            return words.format(round(ratio))
    return f"{scale:g}"


def weight_bars(weights: dict[int, float]) -> str:
    """Return the mass of a sized structure by the number of its sections as HTML bars."""
    most = max(weights.values()) or 1.0
    rows = "".join(
        f'<tr><td>{count}</td><td style="width:60%"><div style="height:.8em;background:#3b6d8c;width:{100 * mass / most:.1f}%">'
        f"</div></td><td>{mass:,.0f} kg</td></tr>"
        for count, mass in sorted(weights.items())
    )
    return (
        f'<table style="font-size:.85em;width:100%;padding:0 .6em"><caption style="text-align:left;padding:0 .6em">mass by'
        f" the most different sections</caption>{rows}</table>"
    )


def times_of(factor: float) -> str:
    """Return a factor with three digits, written out."""
    return f"{float(f'{factor:.3g}'):,.0f}" if factor >= 100 else f"{factor:.3g}"


def words_of_asked(state: StudioState) -> str:
    """Return how the structure that is shown is supported, of what it is made and what it carries."""
    shown = state.shown_structure
    layers = f", double layer {words_of_depths(shown)}" if shown.double_layer else ""
    return f"supports {shown.supports}, {shown.section}, {shown.material}, {','.join(map(str, shown.loads))}{layers}"
