"""Wavefront OBJ: nodes, triangles and members in the scan's own frame."""

from __future__ import annotations

import numpy as np

from .. import __version__
from ..grid.grid import Grid

FAILED_LINE = "failed its certificate: it "  #: line of a file whose grid failed, before what is wrong with it
GRID_KINDS = {"triangle": "triangular", "quad": "quadrangular", "hexagon": "hexagonal"}  # of a grid truss, by its cells


def header_lines(grid: Grid) -> list[str]:
    """Return what the comments of a file say: the program, unit, length and counts; no dates and no file names."""
    lines = [
        f"ScanTruss {__version__}: {GRID_KINDS[grid.cells]} grid truss",
        f"unit: {grid.unit or 'not known'}",
        f"nodes: {len(grid.nodes)}, members: {len(grid.edges)}, {grid.panels_are}: {len(grid.panel_table)}",
    ]
    if grid.settings is not None:
        longest = "" if grid.desired is None else f" to {float(np.max(grid.desired, initial=0.0))!r}"
        lines.insert(2, f"desired member length: {float(grid.settings.length)!r}{longest}")
    if grid.certificate is not None and not grid.certificate.passed:
        lines.insert(1, FAILED_LINE + " and ".join(fault.words for fault in grid.certificate.faults))
    return lines


def encode_obj(grid: Grid, elements: str = "faces") -> bytes:
    """Return the text of an OBJ file: `v` with every digit of a float64, then `f` and `l` counted from 1.

    Parameters
    ----------
    grid : Grid
    elements : faces for the panels, lines for the members, or both; members that are sides of no panel are always there
    """
    lines = [f"# {line}" for line in header_lines(grid)]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in grid.scan_nodes.tolist()]
    if elements in ("faces", "both"):
        lines += ["f " + " ".join(str(node + 1) for node in loop) for loop in grid.panel_loops]
    members = grid.edges if elements in ("lines", "both") else grid.edges[grid.edge_uses == 0]
    lines += [f"l {a} {b}" for a, b in (members + 1).tolist()]
    return ("\n".join(lines) + "\n").encode("ascii")
