"""Make the schedules of a grid or a structure."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..check.folds import fold_angles
from ..errors import InputError
from ..grid.alike import JOINTS, PANELS
from ..grid.certificate import check_passed
from ..grid.marks import member_marks, node_marks, panel_marks
from ..grid.panels import across_of, heights_of
from ..layouts.kinds import families_of_grid
from ..settings import UNITS
from ..structure.truss import Truss
from .bolts import NO_BOLTS, PITCHES, bolted_radii, choose_bolts
from .clusters import Clusters, PanelSizes, cluster_lengths, cluster_nodes, cluster_panels
from .forces import Checked, Forces, find_forces, grid_of_structure
from .joints import Joints, check_grid, clear_radii, find_joints
from .kinds import TypesWithImages, types_of_kinds
from .mirror_images import node_images, panel_images
from .parts import Parts, Stock
from .records import Column, Schedules, column
from .tables import all_tables

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from .settings import ScheduleSettings

METALS = ("steel", "aluminium")  # materials of which balls are made
SMALLEST_LENGTH, LARGEST_LENGTH = 1e-3, 1e9  # lengths of which a schedule can be made [mm]


def schedule(
    what: Grid | Truss, settings: ScheduleSettings, *, keep_failed: bool = False, checked: Checked | None = None
) -> Schedules:
    """Return the schedules of nodes, members and panels, their types, quantities and warnings.

    Parameters
    ----------
    what : Grid or Truss
        A grid, whose coordinates are multiplied by the scale of the settings, or a structure, which has its own size, sections,
        material, marks and forces.
    settings : ScheduleSettings
        Tubes of a grid, bolts of a structure, balls, tolerances, building frame, limits.
    keep_failed : bool
        Accept a grid that failed its certificate.
    checked : (utilization, governing), optional
        Of the members of a structure; without it they are checked with the defaults (`scantruss.structure.checks`).

    Raises
    ------
    InputError
        The unit is not known, the grid is not an oriented manifold of members with a length, or the structure cannot be solved.
    CertificateError
        The grid failed its certificate.
    """
    forces: Forces | None = None
    if isinstance(what, Truss):
        grid, order = grid_of_structure(what)
        settings = _of_structure(settings, what)
    else:
        grid = what
        check_passed(grid, keep_failed)
    unit, size = _size(grid, settings)
    check_grid(grid)
    longest = float(grid.lengths.max()) * size
    if not SMALLEST_LENGTH <= longest <= LARGEST_LENGTH:
        raise InputError(
            f"the longest member would be {longest:g} mm long; check --scale {settings.scale:g} and the unit, {unit}"
        )
    joints, marks = find_joints(grid), (node_marks(grid), member_marks(grid))
    bolt: np.ndarray | None = None
    kind: np.ndarray | None = None
    if isinstance(what, Truss):
        kind = what.section_of[order]
        forces = find_forces(what, order, checked)
        marks = list(what.node_marks), [what.member_marks[k] for k in order.tolist()]
        if settings.bolts != NO_BOLTS:
            bolt = choose_bolts(np.maximum(forces.high, 0.0), settings.bolts)
            joints = replace(joints, bolt=bolt[joints.member])
    stock = _stock(grid, settings, forces)
    clear = clear_radii(joints, stock.width)
    needed = _needed(joints, stock.width, clear, settings)
    if (nodes := types_of_kinds(grid, JOINTS)) is None:
        node_types = cluster_nodes(joints, settings.angle_tolerance)
        nodes = TypesWithImages(node_types, node_images(node_types, joints, settings.angle_tolerance))
    radius = np.where(joints.valence > 0, _radii(needed, nodes.types, settings.ball), 0.0)
    length = grid.lengths * size
    cut = length - radius[grid.edges].sum(axis=1)
    cut_of_family = cut + _to_family(grid) * size
    members = grid.panel_members
    sizes = PanelSizes(np.where(members >= 0, length[members], np.nan))
    if grid.panels is not None:
        across, height = across_of(grid.nodes, grid.panels), heights_of(grid.nodes, grid.panels)
        sizes = PanelSizes(sizes.sides, size * across, size * height)
    if grid.alike is None or (panels := types_of_kinds(grid, PANELS, size * grid.alike.member)) is None:
        panel_types = cluster_panels(sizes, settings.tolerance)
        panels = TypesWithImages(panel_types, panel_images(panel_types, sizes, settings.tolerance))
    return all_tables(
        Parts(
            grid=grid,
            settings=settings,
            unit=unit,
            size=size,
            joints=joints,
            stock=stock,
            forces=forces,
            bolt=bolt,
            clear=clear,
            needed=needed,
            radius=radius,
            length=length,
            cut=cut,
            cut_of_family=cut_of_family,
            fold=inner_folds(grid),
            node_types=nodes.types,
            node_images=nodes.image,
            panel_sizes=sizes,
            panel_types=panels.types,
            panel_images=panels.image,
            length_types=_length_types(cut, cut_of_family, settings.tolerance, kind),
            node_marks=marks[0],
            member_marks=marks[1],
            panel_marks=panel_marks(grid),
        )
    )


def _of_structure(settings: ScheduleSettings, truss: Truss) -> ScheduleSettings:
    """Return the settings with what a structure brings along, unless they contradict it."""
    for name, nothing in (("tube", None), ("scale", 1.0), ("unit", "")):
        if getattr(settings, name) != nothing:
            raise InputError(f"a structure has a {name} of its own; leave --{name} out")
    return replace(settings, scale=truss.scale)


def _to_family(grid: Grid) -> np.ndarray:
    """Return by how much each member (E,) is shorter than its family [scan unit]; 0 where lengths were not made few."""
    if (found := families_of_grid(grid)) is None:
        return np.zeros(len(grid.edges))
    lengths, of = found
    shorter: np.ndarray = lengths[of] - grid.lengths
    return shorter


def _length_types(cut: np.ndarray, cut_of_family: np.ndarray, tolerance: float, kind: np.ndarray | None) -> Clusters:
    """Return the types of members by the cut lengths (E,) of their families; misfits are of their own cut lengths (E,)."""
    types = cluster_lengths(cut_of_family, tolerance, kind)
    return replace(types, misfit=np.abs(cut - cut_of_family[types.representative[types.of]]))


def _size(grid: Grid, settings: ScheduleSettings) -> tuple[str, float]:
    """Return the unit of a grid, and what it is in the structure [mm]."""
    if grid.unit and settings.unit not in ("", grid.unit):
        raise InputError(f"the grid is in {grid.unit}, so the unit cannot be {settings.unit}; leave --unit out")
    unit = grid.unit or settings.unit
    metres = UNITS[unit]
    if metres is None:
        raise InputError(
            "the unit of the grid is not known, and a schedule needs it; give --unit mm, cm, m, inch or foot"
        )
    return unit, 1000.0 * metres * settings.scale


def _stock(grid: Grid, settings: ScheduleSettings, forces: Forces | None) -> Stock:
    """Return what the members are cut from."""
    count = len(grid.edges)
    if forces is not None:
        truss, material = forces.truss, forces.truss.material
        names = column("section", "", forces.sections), column("material", "", [material.name] * count)
        mass = (truss.of_section("area") * material.density)[forces.order] / 1000.0
        ball = settings.density or (material.density if material.kind in METALS else None)
        return Stock(1000.0 * forces.width, mass, names, ball)
    if settings.tube is None:
        raise InputError("the tubes of the members are missing; give them with --tube, such as --tube 114.3x5")
    columns: tuple[Column, ...] = (column("tube", "mm", [settings.tube] * count),)
    mass = None
    if settings.wall is not None:
        columns = (*columns, column("wall", "mm", [settings.wall] * count))
        if settings.density is not None:
            area = math.pi * settings.wall * (settings.tube - settings.wall)
            mass = np.full(count, area * settings.density / 1e9)
    return Stock(np.full(count, settings.tube), mass, columns, settings.density)


def _needed(joints: Joints, width: np.ndarray, clear: np.ndarray, settings: ScheduleSettings) -> np.ndarray:
    """Return the radius of the smallest ball of each node that clears its members, with the clearance, and its bolts (V,) [mm]."""
    gap = width / 10.0 if settings.clearance is None else np.full(len(width), settings.clearance)
    needed = np.zeros(len(joints.valence))
    np.maximum.at(needed, joints.node, (width / 2.0 + gap)[joints.member])
    at = joints.node[joints.pairs[:, 0]]
    np.maximum.at(needed, at, clear + gap[joints.member[joints.pairs]].max(axis=1))
    if joints.bolt.any():
        bolts = np.where(joints.bolt > 0, joints.bolt, max(PITCHES))  # none is large enough: the largest
        np.maximum.at(needed, at, bolted_radii(joints.angle, bolts[joints.pairs], settings.thread, settings.sleeve))
    return needed


def _radii(needed: np.ndarray, types: Clusters, ball: float | None) -> np.ndarray:
    """Return the radius of the balls: the given one, or for all nodes of a type the largest that one of them needs."""
    if ball is not None:
        return np.full(len(needed), ball / 2.0)
    largest = np.zeros(len(types.representative) + 1)
    np.maximum.at(largest, types.of, needed)
    return largest[types.of]


def inner_folds(grid: Grid) -> np.ndarray:
    """Return the angle between the panels at each member, inside (E,) [degree]: 180 level, less over a ridge, more in a valley."""
    fold = fold_angles(grid)
    two = np.flatnonzero(grid.edge_triangles[:, 1] >= 0)
    first, second = grid.triangles[grid.edge_triangles[two]].transpose(1, 0, 2)
    a, b, c = (grid.nodes[first[:, k]] for k in range(3))
    across = grid.nodes[
        second.sum(axis=1) - grid.edges[two].sum(axis=1)
    ]  # the node of the second that is not on the member
    valley = ((across - a) * np.cross(b - a, c - a)).sum(axis=1) > 0
    fold[two[valley]] = 360.0 - fold[two[valley]]
    return fold
