"""PLY: nodes and triangles in the scan's own frame, binary."""

from __future__ import annotations

import numpy as np

from ..grid.grid import Grid
from .obj import header_lines


def encode_ply(grid: Grid) -> bytes:
    """Return a binary little endian PLY file: double coordinates, one `vertex_indices` list per panel.

    Members that are sides of no panel, such as those of layers, are edges of `vertex1` and `vertex2`.
    """
    edges = grid.edges[grid.edge_uses == 0]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {line}" for line in header_lines(grid)),
        f"element vertex {len(grid.nodes)}",
        "property double x",
        "property double y",
        "property double z",
        f"element face {len(grid.panel_table)}",
        "property list uchar int vertex_indices",
        *([f"element edge {len(edges)}", "property int vertex1", "property int vertex2"] if len(edges) else []),
        "end_header",
    ]
    faces = b"".join(bytes([len(loop)]) + np.array(loop, "<i4").tobytes() for loop in grid.panel_loops)
    head = ("\n".join(header) + "\n").encode("ascii")
    return head + grid.scan_nodes.astype("<f8").tobytes() + faces + edges.astype("<i4").tobytes()
