"""A nonlinear path as figures, in words and as a picture."""

from __future__ import annotations

import io
from typing import Any

from ..runtime.ours import MADE_BY
from .nonlinear import MOST_CUTS, PATH_STEPS
from .path import Path
from .truss import Truss

SECONDS_OF_STEP = 1.5e-5  #: of a step for each displacement of a node, on a usual machine
GROWTH_OF_STEP = 1.2  #: power of the displacements by which this grows
EXTRA_STEPS = 10  #: that a path needs to find where stability is lost


def path_figures(path: Path) -> dict[str, Any]:
    """Return the figures of a path as plain values; m and load factors."""
    node, shape = path.truss.node_marks[path.node], path.imperfection
    return {
        "limit_factor": path.limit_factor,
        "limit_kind": path.kind,
        "path": {
            "case": path.name,
            "ended": path.ended,
            "imperfection": shape.kind,
            "imperfection_max": shape.largest,
            "imperfection_node": path.truss.node_marks[shape.node],
            "linear_factor": path.linear_factor,
            "node": node,
            "factors": path.factors.tolist(),
            "displacements": path.moves.tolist(),
            "negative_pivots": path.negative_pivots.tolist(),
            "equilibrium_error": float(path.equilibrium_errors.max()),
        },
    }


def path_words(path: Path) -> str:
    """Return one line on a path."""
    shape = path.imperfection
    bent = "" if shape.kind == "none" else f" with an imperfection ({shape.kind}) of {1e3 * shape.largest:.3g} mm"
    linear = "" if path.linear_factor is None else f", linear buckling at {path.linear_factor:.4g}"
    if path.limit_factor is None:
        return f"nonlinear path of {path.name}{bent}: stable up to the factor {path.factors.max():.4g}{linear}; {path.ended}"
    return (
        f"nonlinear path of {path.name}{bent}: {path.kind} at the factor {path.limit_factor:.4g}{linear}; {path.ended}"
    )


def path_warnings(path: Path) -> list[str]:
    """Return what is to be known about a path."""
    warnings = []
    if path.kind == "bifurcation":
        advice = "a larger imperfection" if path.imperfection.kind == "mode" else "an imperfection, such as mode"
        warnings.append(
            f"the path passes a bifurcation at the factor {path.limit_factor:.4g}: the structure leaves it there; take {advice}"
        )
    if path.limit_factor is not None and path.limit_factor < 1:
        warnings.append(
            f"the structure does not carry {path.name}: it loses its stability at {path.limit_factor:.3g} times it"
        )
    if path.limit_factor is None and "reached" not in path.ended:
        warnings.append(f"the path found no limit: {path.ended}")
    return warnings


def path_expectation(truss: Truss, steps: int = PATH_STEPS) -> str:
    """Return a line that says how long a path may take, and computes nothing."""
    freedoms = len(truss.nodes) * (3 if truss.pinned else 6)
    seconds = (steps + EXTRA_STEPS) * SECONDS_OF_STEP * freedoms * max(freedoms / 3e4, 1e-2) ** (GROWTH_OF_STEP - 1)
    time = f"{max(seconds, 1):.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
    return (
        f"{len(truss.nodes):,} nodes, {len(truss.members):,} members, {freedoms:,} displacements: a path of {steps} steps takes"
        f" about {time} on a usual machine, up to twice that for a mode with both signs, up to"
        f" {2**MOST_CUTS:,} shorter steps where it is hard"
    )


def draw_path(axes: Any, path: Path) -> None:
    """Draw load factors against displacements, unstable states dashed."""
    moves = 1e3 * path.moves
    end = len(moves) if path.critical is None else path.critical + 1
    axes.plot(moves[:end], path.factors[:end], "-o", color="#1f4e79", markersize=3, label="stable before the limit")
    if path.critical is not None:
        axes.plot(moves[end - 1 :], path.factors[end - 1 :], "--o", color="#b03a2e", markersize=3, label="beyond")
        axes.plot(moves[end - 1], path.factors[end - 1], "o", color="#b03a2e", markersize=9, markerfacecolor="none")
        words = f"{path.kind} {path.limit_factor:.4g}"
        at_right = moves[end - 1] > 0.5 * (moves.min() + moves.max())  # the words stay within the axes
        side = "right" if at_right else "left"
        axes.annotate(words, (moves[end - 1], path.factors[end - 1]), (0, 10), textcoords="offset points", ha=side)
    axes.margins(y=0.12)
    axes.legend(fontsize=9)


def moves_label(path: Path) -> str:
    """Return what the displacements of a path are."""
    return f"displacement of {path.truss.node_marks[path.node]} [mm]"


def encode_path(path: Path) -> bytes:
    """Return the picture of a path as PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5.6), dpi=100, facecolor="white")
    canvas: Any = FigureCanvasAgg(figure)
    axes: Any = figure.add_subplot()
    draw_path(axes, path)
    axes.set_xlabel(moves_label(path))
    axes.set_ylabel("load factor")
    axes.set_title(
        f"{path.name}; imperfection: {path.imperfection.kind}, {1e3 * path.imperfection.largest:.3g} mm", fontsize=10
    )
    axes.grid(alpha=0.3)
    stream = io.BytesIO()
    canvas.print_png(stream, metadata={"Software": MADE_BY})
    return stream.getvalue()
