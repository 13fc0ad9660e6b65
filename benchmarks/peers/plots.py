"""The plots of the comparison, as SVG with the same bytes for the same rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .runs import Row
from .tables import OURS
from .ways import WAYS

COLORS = ("#0b6e4f", "#14a76c", "#7bd3a8", "#1f4e9c", "#5b8ad6", "#9c2f6f", "#c2185b", "#e07a1f", "#b58900", "#7a3fb0",
          "#a678de", "#6b4f3a", "#5f6b73")  # fmt: skip


def scatter(rows: Sequence[Row], across: tuple[str, str], up: tuple[str, str], file: Path) -> None:
    """Draw one figure of all grids over another, a colour a way, hollow where the topology is wrong."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot, ticker

    settings: dict[Any, Any] = {
        "svg.hashsalt": "scantruss",
        "svg.fonttype": "path",
        "font.size": 9,
        "font.family": "DejaVu Sans",
    }
    with pyplot.rc_context(settings):
        figure, axes = pyplot.subplots(figsize=(9, 5), layout="constrained")
        drawn = 0
        for color, way in zip(COLORS, WAYS, strict=True):
            own = [row for row in rows if row.way == way.name and row.done]
            own = [
                row
                for row in own
                if all(math.isfinite(row.value(name)) and row.value(name) > 0 for name, _ in (across, up))
            ]
            drawn += len(own)
            for right in (True, False):
                some = [row for row in own if row.right == right]
                axes.scatter(
                    [row.value(across[0]) for row in some], [row.value(up[0]) for row in some],
                    s=70 if way.name in OURS else 40, marker="D" if way.name in OURS else "o", linewidths=1.4,
                    facecolors=color if right else "none", edgecolors=color,
                )  # fmt: skip
            if own:
                axes.scatter([], [], color=color, marker="D" if way.name in OURS else "o", label=way.name)
        axes.scatter([], [], facecolors="none", edgecolors="#555555", label="hollow: wrong topology")
        scale = "log" if drawn else "linear"
        axes.set(xscale=scale, yscale=scale, xlabel=across[1], ylabel=up[1])
        axes.grid(True, which="both", linewidth=0.3, color="#cccccc")
        axes.set_axisbelow(True)
        for axis in (axes.xaxis, axes.yaxis):
            if drawn:
                axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
                axis.set_minor_formatter(ticker.NullFormatter())
            axis.set_major_formatter("{x:g}")
        figure.legend(loc="outside right center", frameon=False)
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
        pyplot.close(figure)


def draw(rows: Sequence[Row], folder: Path) -> list[str]:
    """Draw both plots and return their names."""
    scatter(rows, ("seconds", "seconds"), ("cv", "CV of the member lengths"), folder / "peers-time.svg")
    scatter(
        rows,
        ("boundary", "boundary off the true one [members]"),
        ("cv", "CV of the member lengths"),
        folder / "peers-boundary.svg",
    )
    return ["peers-time.svg", "peers-boundary.svg"]
