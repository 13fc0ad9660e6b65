"""Write a printed model in parts: plates of parts with plug joints, or balls with sockets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...grid.certificate import check_passed
from ...grid.grid import Grid
from ...grid.marks import member_marks, node_marks, numbered
from ...runtime.files import write_files
from ...runtime.places import check_place
from ..csv import encode_table
from ..engraving import letter_height
from ..solid import SUFFIXES, as_solid
from ..solid_files import Solid, encode_3mf, encode_stl
from .nodes import build_nodes
from .parts import build_parts
from .plates import Bed, lay_out, together

USUAL_CLEARANCE = 0.15  # of joints over the diameter of the members, where none is given


@dataclass(frozen=True, eq=False)
class PrintedParts:
    """What was written."""

    files: tuple[str, ...]  #: names, a plate or a ball each, then the list of rods
    parts: int
    unit: str
    size: tuple[float, float, float]  #: of the largest part, as it lies [printed unit]
    volume: float  #: of all parts [printed unit cubed]
    notes: tuple[str, ...]  #: what a user should know


def print_parts(
    grid: Grid,
    path: str | Path,
    *,
    member_diameter: float,
    node_diameter: float,
    scale: float = 1.0,
    bed: Bed | None = None,
    sockets: bool = False,
    clearance: float | None = None,
    sides: int = 12,
    marks: bool = False,
    keep_failed: bool = False,
    force: bool = False,
) -> PrintedParts:
    """Write the grid in printed parts: cut to fit a bed with plug joints, or a ball with sockets for each node.

    Parameters
    ----------
    grid : Grid
        The grid; its coordinates are multiplied by `scale`.
    path : str or Path
        File ending in .3mf or .stl; a number or the mark of the node goes behind its stem.
    member_diameter, node_diameter : float
        Diameters of the printed members, or rods, and nodes, not scaled [unit of the grid].
    scale : float
        Size of the model over the size of the grid.
    bed : (width, depth, height), optional
        Size of the printer's bed; parts lie on it in rows, a file for each plate [unit of the grid].
    sockets : bool
        A ball for each node, with sockets for rods, in place of a model cut into parts.
    clearance : float, optional
        Gap between a peg or rod and its socket, all around; by default 0.15 members [unit of the grid].
    sides : int
        Sides of a member.
    marks : bool
        Engrave the mark of each node on its ball.
    keep_failed : bool
        Print a grid even if it failed its certificate.
    force : bool
        Whether to write over files that ScanTruss did not write.

    Raises
    ------
    InputError
        Diameters, clearance or bed do not suit the grid.
    CertificateError
        The grid failed its certificate.
    FormatError
        A file cannot be written.
    """
    path = check_place(path, SUFFIXES)
    check_passed(grid, keep_failed)
    if bed is not None and (len(bed) != 3 or not all(0 < side < math.inf for side in bed)):
        raise InputError(f"the bed must be three positive numbers, width x depth x height, got {bed}")
    gap = USUAL_CLEARANCE * member_diameter if clearance is None else clearance
    contents: dict[Path, bytes] = {}
    if sockets:
        parts, floor = build_nodes(
            grid,
            member=member_diameter,
            node=node_diameter,
            scale=scale,
            clearance=gap,
            sides=max(sides, 32),
            marks=marks,
        )
    elif bed is None:
        raise InputError(
            "parts need the bed on which they are to fit, such as --bed 200x200x200 for a grid in mm, or --sockets"
        )
    else:
        parts = build_parts(
            grid,
            member=member_diameter,
            node=node_diameter,
            scale=scale,
            bed=bed,
            clearance=gap,
            sides=sides,
            marks=marks,
        )
    if bed is None:
        named = [(part.name, [(part.name, as_solid(part.lying(), grid.unit, 1, part.genus))]) for part in parts]
    else:
        plates = lay_out(parts, bed, node_diameter, grid.unit)
        named = list(zip(numbered("", len(plates), 1), plates, strict=True))
    for name, plate in named:
        contents[path.with_name(f"{path.stem}_{name}{path.suffix}")] = _encode(plate, path.suffix.lower())
    if sockets:
        contents[path.with_name(f"{path.stem}_rods.csv")] = _rods(grid, floor, scale)
    write_files(contents, force=force)
    solids = [solid for _, plate in named for _, solid in plate]
    sizes = np.array([np.ptp(solid.vertices, axis=0) for solid in solids])
    lost = [name for _, plate in named for name, solid in plate if solid.notes]
    return PrintedParts(
        files=tuple(each.name for each in contents),
        parts=len(parts),
        unit=grid.unit,
        size=tuple(sizes[sizes.prod(axis=1).argmax()].tolist()),
        volume=sum(solid.volume for solid in solids),
        notes=(
            *_letters(grid, node_diameter, marks),
            *([f"openings are closed where members touch: {', '.join(lost[:4])}"] if lost else []),
        ),
    )


def _letters(grid: Grid, node_diameter: float, marks: bool) -> list[str]:
    """Say how high the letters of marks are."""
    if not marks:
        return []
    height = letter_height(node_marks(grid)[0], node_diameter / 2)
    return [f"marks are {height:.2g} {grid.unit} high".replace("  ", " ")]


def _encode(plate: list[tuple[str, Solid]], suffix: str) -> bytes:
    solids = [solid for _, solid in plate]
    if suffix == ".3mf":
        return encode_3mf(*solids, names=[name for name, _ in plate])
    return encode_stl(together(solids))


def _rods(grid: Grid, floor: np.ndarray, scale: float) -> bytes:
    """Return the list of the rods between balls with sockets."""
    unit = f" [{grid.unit}]" if grid.unit else ""
    lengths = grid.lengths * scale - floor[grid.edges].sum(axis=1)
    nodes = node_marks(grid)
    rows = [
        (mark, nodes[a], nodes[b], length)
        for mark, (a, b), length in zip(member_marks(grid), grid.edges.tolist(), lengths.tolist(), strict=True)
    ]
    return encode_table(["rod", "start", "end", f"length{unit}"], rows)
