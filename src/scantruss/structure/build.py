"""From a grid to a structure: units, normals, supports and loads of `Truss.from_grid`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..grid.marks import member_marks, node_marks, numbered
from ..grid.panels import area_vectors_of, first_triangles, panel_of_triangles, turned_panels
from ..layouts.double_layer import DoubleLayer
from ..layouts.double_layer import double_layer as make_double_layer
from ..layouts.framework import Framework
from ..scan.vectors import units
from ..settings import UNITS
from .areas import turned_pieces
from .catalogue import Material, Section, find_material, find_section
from .loads import cases_of, usual_combinations
from .quantities import LENGTH, quantity
from .supports import node_sets, support_nodes, support_stiffness
from .truss import HELD_LAYERS, Combination, Truss, area_vectors

if TYPE_CHECKING:
    from ..grid.grid import Grid


def truss_of_grid(
    grid: Grid,
    *,
    scale: float,
    unit: str,
    section: str | Section,
    material: str | Material,
    supports: str | np.ndarray,
    support_type: str,
    loads: str | Sequence[Any],
    joints: str | float,
    node_allowance: float,
    combinations: Sequence[Combination] | None,
    double_layer: str | float | Sequence[float],
    second_layer: str,
    depth_along: str,
    held_layer: str,
    layer_edges: str,
    sharp_bends: str,
) -> Truss:
    """Return the structure of a grid; see `Truss.from_grid`."""
    if grid.unit and unit and unit != grid.unit:
        raise InputError(f"the grid is in {grid.unit}, not in {unit}; leave --unit out")
    metres = scale_of(grid.unit or unit, scale)
    layered = double_layer != ""
    if held_layer not in HELD_LAYERS:
        raise InputError(f"the held layer must be {' or '.join(HELD_LAYERS)}, got {held_layer!r}")
    truss = _one_layer(
        grid,
        metres,
        find_section(section) if isinstance(section, str) else section,
        find_material(material) if isinstance(material, str) else material,
        joints or ("pinned" if layered else "rigid"),
    ).replace(scale=float(scale))
    held = support_nodes(truss, supports)
    if layered and isinstance(grid, Framework):
        raise InputError(
            "a double layer is made of panels, and some members of the grid are on none; leave it out, or take them out"
        )
    if layered:
        outer = grid.replace(
            nodes=truss.nodes, triangles=truss.triangles, panels=truss.panels, origin=truss.origin, unit="m"
        )
        layers = make_double_layer(
            outer, _depths(double_layer), second=second_layer, along=depth_along, edges=layer_edges, bends=sharp_bends
        )
        truss = _with_layers(truss, layers)
        held = layers.under[held] if held_layer == "inner" else held
    truss = truss.replace(supports=support_stiffness(len(truss.nodes), held, support_type))
    cases = cases_of(truss, loads, node_allowance)
    return truss.replace(
        cases=cases, combinations=usual_combinations(cases) if combinations is None else tuple(combinations)
    )


def _one_layer(grid: Grid, metres: float, section: Section, material: Material, joints: str | float) -> Truss:
    """Return the structure of a grid without supports and loads, its panels turned to what loads it from above.

    metres : in one unit of the grid
    """
    pinned, spring = _joints(joints)
    nodes = np.ascontiguousarray(grid.nodes, float) * metres
    members, triangles = np.asarray(grid.edges, np.int64), np.asarray(grid.triangles, np.int64)
    if len(members) == 0:
        raise InputError("the grid has no members; a structure needs some")
    marks = member_marks(grid)
    lengths = np.linalg.norm(nodes[members[:, 0]] - nodes[members[:, 1]], axis=1)
    if lengths.min() <= 0:
        raise InputError(f"member {marks[int(lengths.argmin())]} has no length; a structure needs nodes apart")
    turned = turned_pieces(nodes, triangles)  # a shell is loaded from above
    panels, normals_of_panels = _turned_panels(grid, nodes, turned)
    triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
    node_normals = np.zeros_like(nodes)
    for corner in panels.T:
        np.add.at(node_normals, corner[corner >= 0], normals_of_panels[corner >= 0])
    of_triangle = slice(None) if grid.panels is None else panel_of_triangles(panels)
    return Truss(
        nodes=nodes,
        members=members,
        triangles=triangles,
        panels=None if grid.panels is None else panels,
        node_normals=units(node_normals),
        member_normals=units(_at_members(grid, units(normals_of_panels)[of_triangle])),
        sections=(section,),
        section_of=np.zeros(len(members), np.int64),
        material=material,
        supports=np.zeros((len(nodes), 6)),
        end_stiffness=np.full((len(members), 2, 2), spring),
        pinned=pinned,
        node_sets=node_sets(grid),
        origin=np.asarray(grid.origin, float) * metres,
        system=grid.system if metres == 1.0 else "",  # at a scale, or in feet, the coordinates are no longer those
        node_marks=tuple(node_marks(grid)),
        member_marks=tuple(marks),
        alike=None if grid.alike is None else replace(grid.alike, member=grid.alike.member * metres),
    )


def _with_layers(truss: Truss, layers: DoubleLayer) -> Truss:
    """Return a structure of one layer with the second and the webs; what the first names stays."""
    count, members = len(layers.nodes), len(layers.members)
    spring = truss.end_stiffness[0, 0, 0]
    normals = units(layers.normals[layers.members].sum(axis=1))
    normals[: len(truss.members)] = truss.member_normals
    return truss.replace(
        nodes=layers.nodes,
        members=layers.members,
        node_normals=np.concatenate([truss.node_normals, layers.normals[len(truss.nodes) :]]),
        member_normals=normals,
        section_of=np.zeros(members, np.int64),
        supports=np.zeros((count, 6)),
        end_stiffness=np.full((members, 2, 2), spring),
        member_sets=layers.groups,
        layers=layers.layers,
        alike=None,
        node_marks=tuple(numbered("N", count, 3)),
        member_marks=tuple(numbered("M", members, 4)),
    )


def _depths(words: str | float | Sequence[float]) -> list[float]:
    """Return the depths of layers such as "0.8m" or "1.2,800mm", or in metres [m]."""
    each = words.split(",") if isinstance(words, str) else words if isinstance(words, Sequence) else [words]
    return [quantity(word, LENGTH, "the depth of a double layer", plain=True) for word in each]


def scale_of(unit: str, scale: float) -> float:
    """Return the metres of the structure for one unit of the grid.

    Raises
    ------
    InputError
        The unit is not known, or the scale is no positive number.
    """
    if not (isinstance(scale, int | float) and 0 < scale < math.inf):
        raise InputError(f"scale must be a positive number, got {scale!r}")
    metres = UNITS.get(unit)
    if not metres:
        known = " ".join(name for name in UNITS if name)
        got = f"no unit {unit!r}" if unit else "the unit of the grid is not known"
        raise InputError(f"{got}, and a structure needs lengths in metres; give --unit, one of {known}")
    return metres * scale


def _joints(joints: str | float) -> tuple[bool, float]:
    """Return whether members carry axial forces only, and the stiffness of the springs at their ends."""
    if joints == "pinned":
        return True, 0.0
    if joints == "rigid":
        return False, math.inf
    try:
        stiffness = float(joints)
    except (TypeError, ValueError):
        stiffness = -1.0
    if not stiffness > 0:
        raise InputError(f"joints must be rigid, pinned or a rotational stiffness in Nm/rad, got {joints!r}")
    return False, stiffness


def _turned_panels(grid: Grid, nodes: np.ndarray, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the panels (P, K), those of the turned triangles (T,) the other way round, and their area vectors (P, 3).

    A panel that is not plane has one normal however it is cut into triangles, so mirrored members get mirrored axes.
    """
    if grid.panels is None:
        areas = area_vectors(nodes, grid.triangles)
        return np.asarray(grid.triangles, np.int64), np.where(turned[:, None], -areas, areas)
    panels = turned_panels(grid.panels, turned[first_triangles(grid.panels)])
    return panels, area_vectors_of(nodes, panels)


def _at_members(grid: Grid, normals: np.ndarray) -> np.ndarray:
    """Return the (E, 3) sums of the normals of the triangles at each member."""
    total = np.zeros((len(grid.edges), 3))
    at = grid.half_edge_edges
    np.add.at(total, at[at >= 0], np.tile(normals, (3, 1))[at >= 0])
    return total
