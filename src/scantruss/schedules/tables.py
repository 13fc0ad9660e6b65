"""The tables of a schedule, from what was found of the nodes, members and panels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..grid.alike import JOINTS
from ..grid.groups import BOUNDARY, INNER, member_groups
from ..grid.marks import numbered
from ..grid.panels import diagonals_of, panel_of_triangles, planarity_of
from ..layouts.kinds import families_of_grid
from ..structure.truss import area_vectors
from .bolts import bolt_mark
from .clashes import warnings_table
from .clusters import Clusters, holes_of_types
from .inner_panels import inner_panels, layer_column, layered_grid
from .joints import angle_between
from .mirror_images import NO_IMAGE
from .places import boundary_nodes, building_places, into_building, rings
from .records import Column, Schedule, Schedules, Value, column

if TYPE_CHECKING:
    from .parts import Parts

DEGREE = "degree"
LEAST_ACROSS = 1e-6  # of a normal across its member, below which the twist is undefined
NO_BOLT_ENOUGH = 1000  # more than any bolt: stands for one that no bolt is large enough for


def all_tables(parts: Parts) -> Schedules:
    """Return all schedules."""
    ring = rings(parts.grid, building_places(parts.grid, parts.settings)[:, 2])
    groups = list(layered.own_groups) if (layered := layered_grid(parts)) else member_groups(parts.grid)
    ball, member = parts.ball_masses, _member_masses(parts)
    return Schedules(
        nodes=_nodes(parts, ring, ball),
        drilling=_drilling(parts),
        members=_members(parts, ring, groups, member),
        panels=_panels(parts),
        node_types=_node_types(parts, ball),
        panel_types=_panel_types(parts),
        lengths=_lengths(parts),
        quantities=_quantities(parts, groups, ball, member),
        warnings=warnings_table(parts),
        inner_panels=inner_panels(parts) if layered else None,
    )


def _member_masses(parts: Parts) -> np.ndarray | None:
    """Return the mass of each member (E,), as long as it is cut [kg]; None without a density."""
    return None if parts.stock.mass is None else np.maximum(parts.cut, 0.0) * parts.stock.mass


def _kilonewtons(name: str, forces: np.ndarray) -> Column:
    """Return a column of forces, given in N."""
    return column(name, "kN", forces / 1000.0)


def _node_forces(parts: Parts, used: np.ndarray) -> list[Column]:
    """Return the columns of the greatest forces at the nodes of a structure, and of their largest bolts."""
    if (forces := parts.forces) is None:
        return []
    low, high = np.full((2, len(parts.grid.nodes)), [[np.inf], [-np.inf]])
    for ends in parts.grid.edges.T:
        np.minimum.at(low, ends, forces.low)
        np.maximum.at(high, ends, forces.high)
    columns = [_kilonewtons(name, each[used]) for name, each in (("force min", low), ("force max", high))]
    columns.append(_kilonewtons("reaction", forces.reaction[used]))
    if parts.bolt is None:
        return columns
    largest = np.zeros(len(low), np.int64)
    np.maximum.at(largest, parts.joints.node, np.where(parts.joints.bolt > 0, parts.joints.bolt, NO_BOLT_ENOUGH))
    marks = [bolt_mark(each) if each < NO_BOLT_ENOUGH else None for each in largest[used].tolist()]
    return [*columns, column("largest bolt", "", marks)]


def _member_forces(parts: Parts) -> list[Column]:
    """Return the columns of forces and checks of the members of a structure, and of their bolts."""
    if (forces := parts.forces) is None:
        return []
    columns = [
        _kilonewtons("force min", forces.low),
        column("case of min", "", forces.low_case),
        _kilonewtons("force max", forces.high),
        column("case of max", "", forces.high_case),
        column("moment", "kNm", forces.moment / 1000.0),
        column("slenderness", "", forces.slenderness),
    ]
    if forces.utilization is not None:
        columns += [column("utilization", "", forces.utilization), column("governed by", "", forces.governing)]
    if parts.bolt is not None:
        columns.append(column("bolts", "", [bolt_mark(each) for each in parts.bolt.tolist()]))
    return columns


def _mass(mass: np.ndarray | None) -> list[Column]:
    """Return the column of masses where they are known."""
    return [] if mass is None else [column("mass", "kg", mass, summed=True)]


def _of(marks: Sequence[str], ids: np.ndarray) -> list[str]:
    """Return the marks of some items."""
    return [marks[number] for number in ids.tolist()]


def _xyz(name: str, unit: str, places: np.ndarray) -> list[Column]:
    """Return three columns of coordinates or of a direction."""
    return [column(f"{name} {axis}".strip(), unit, places[:, k]) for k, axis in enumerate("xyz")]


def _type_marks(letters: str, types: Clusters) -> list[str]:
    return numbered(letters, len(types.representative), 3)


def _nodes(parts: Parts, ring: np.ndarray, mass: np.ndarray | None) -> Schedule:
    """One row for each node with members."""
    joints, used = parts.joints, np.flatnonzero(parts.joints.valence)
    least, turn = np.full((2, len(joints.valence)), np.inf)
    np.minimum.at(least, joints.node[joints.pairs[:, 0]], joints.angle)
    np.fmin.at(turn, joints.node, joints.turn_to_next)  # NaN at a node of one member
    return Schedule(
        "Nodes",
        (
            column("node", "", _of(parts.node_marks, used)),
            column("node type", "", _of(_type_marks("NT", parts.node_types), parts.node_types.of[used])),
            column("ring", "", ring[used]),
            *layer_column(parts, used),
            *_xyz("scan", parts.unit, parts.grid.scan_nodes[used]),
            *_xyz("", "mm", building_places(parts.grid, parts.settings)[used] * parts.size),
            column("valence", "", joints.valence[used]),
            *_xyz("normal", "", into_building(joints.normal[used], parts.settings)),
            column("smallest angle", DEGREE, least[used]),
            column("smallest angle in tangent plane", DEGREE, turn[used]),
            column("ball needed", "mm", 2.0 * parts.needed[used]),
            column("ball", "mm", 2.0 * parts.radius[used]),
            *_node_forces(parts, used),
            *_mass(None if mass is None else mass[used]),
        ),
    )


def _drilling(parts: Parts) -> Schedule:
    """One row for each hole of each ball, in the frame of the ball."""
    joints, alike = parts.joints, parts.grid.alike
    over = alike is not None and alike.parts == JOINTS
    bolts = [
        column("bolt", "", [bolt_mark(each) for each in joints.bolt.tolist()]),
        column("thread", "mm", np.where(joints.bolt > 0, joints.bolt * parts.settings.thread, np.nan)),
    ]
    return Schedule(
        "Drilling",
        (
            column("node", "", _of(parts.node_marks, joints.node)),
            column("hole", "", np.arange(len(joints.node)) - joints.start[joints.node] + 1),
            column("member", "", _of(parts.member_marks, joints.member)),
            column("hole of type", "", holes_of_types(joints, parts.node_types, over=over) + 1),
            column("azimuth", DEGREE, joints.azimuth),
            column("angle to normal", DEGREE, joints.tilt),
            *_xyz("ball", "", joints.own),
            column("angle to next", DEGREE, joints.to_next),
            column("angle to next in tangent plane", DEGREE, joints.turn_to_next),
            *(bolts if parts.bolt is not None else ()),
        ),
    )


def end_angles(parts: Parts) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return of each member the angles to the normals of its start and end, towards the other node, and the twist (E,) [degree].

    The twist is the angle by which the normal of the start must be turned about the member, right-handed from start to end, to lie in one
    plane with that of the end; NaN of a member along a normal.
    """
    nodes, edges = parts.grid.nodes, parts.grid.edges
    axis = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    first, second = parts.joints.normal[edges[:, 0]], parts.joints.normal[edges[:, 1]]
    flat = [normal - (normal * axis).sum(axis=1, keepdims=True) * axis for normal in (first, second)]
    twist = np.degrees(np.arctan2((np.cross(*flat) * axis).sum(axis=1), (flat[0] * flat[1]).sum(axis=1)))
    twist[np.minimum(*(np.linalg.norm(each, axis=1) for each in flat)) < LEAST_ACROSS] = np.nan
    return angle_between(first, axis), angle_between(second, -axis), twist


def _members(parts: Parts, ring: np.ndarray, groups: list[str], mass: np.ndarray | None) -> Schedule:
    """One row for each member."""
    edges = parts.grid.edges
    start, end, twist = end_angles(parts)
    return Schedule(
        "Members",
        (
            column("member", "", parts.member_marks),
            column("start", "", _of(parts.node_marks, edges[:, 0])),
            column("end", "", _of(parts.node_marks, edges[:, 1])),
            column("group", "", groups),
            column("ring", "", ring[edges].max(axis=1)),
            column("length type", "", _of(_type_marks("L", parts.length_types), parts.length_types.of)),
            *_families(parts),
            column("length", "mm", parts.length, summed=True),
            column("start deduction", "mm", parts.radius[edges[:, 0]]),
            column("end deduction", "mm", parts.radius[edges[:, 1]]),
            column("cut length", "mm", parts.cut, summed=True),
            *parts.stock.columns,
            column("start angle to normal", DEGREE, start),
            column("end angle to normal", DEGREE, end),
            column("twist", DEGREE, twist),
            *_member_forces(parts),
            *_mass(mass),
        ),
    )


def _families(parts: Parts) -> list[Column]:
    """Return the columns of the families of lengths, shortest first, where the members were made to be of few."""
    if (found := families_of_grid(parts.grid)) is None:
        return []
    lengths, of = found
    marks = numbered("F", len(lengths), 2)
    return [column("family", "", _of(marks, of)), column("family length", "mm", lengths[of] * parts.size)]


def _areas(parts: Parts) -> np.ndarray:
    """Return the area of each panel (P,) [m2]."""
    grid = parts.grid
    areas = np.linalg.norm(area_vectors(grid.nodes, grid.triangles), axis=1)
    if grid.panels is not None:
        areas = np.bincount(panel_of_triangles(grid.panels), areas, len(grid.panels))
    return areas * (parts.size / 1000.0) ** 2


def _panels(parts: Parts) -> Schedule:
    """One row for each panel; side 1 runs from node 1 to node 2, and so on."""
    grid = parts.grid
    sides, panels = grid.panel_members, grid.panel_table
    width = range(panels.shape[1])
    neighbour = grid.edge_panels[sides].sum(axis=2) - np.arange(len(sides))[:, None]  # -1 beyond the boundary
    neighbour[sides < 0] = -1
    fold = np.where(sides >= 0, parts.fold[sides], np.nan)
    marks = [*parts.panel_marks, None]
    corners = [*parts.node_marks, None]
    return Schedule(
        "Panels",
        (
            column("panel", "", parts.panel_marks),
            *(column(f"node {k + 1}", "", [corners[v] for v in panels[:, k].tolist()]) for k in width),
            column("panel type", "", _of(_type_marks("PT", parts.panel_types), parts.panel_types.of)),
            *(column(f"side {k + 1}", "mm", parts.sides[:, k]) for k in width),
            *(column(f"angle {k + 1}", DEGREE, grid.corner_angles[:, k]) for k in width),
            *_out_of_plane(parts),
            column("area", "m2", _areas(parts), summed=True),
            *(column(f"neighbour {k + 1}", "", [marks[t] for t in neighbour[:, k].tolist()]) for k in width),
            *(column(f"fold {k + 1}", DEGREE, fold[:, k]) for k in width),
        ),
    )


def _out_of_plane(parts: Parts) -> list[Column]:
    """Return how far the corners of panels of more than three nodes lie off their mean planes; nothing of triangles."""
    panels, nodes = parts.grid.panels, parts.grid.nodes
    if panels is None:
        return []
    off = planarity_of(nodes, panels) * diagonals_of(nodes, panels) * parts.size
    return [column("off its plane", "mm", off)]


def _types(title: str, letters: str, types: Clusters, marks: Sequence[str], unit: str, *more: Column) -> Schedule:
    """One row for each type, the most frequent first."""
    return Schedule(
        title,
        (
            column(title.lower().removesuffix("s").replace("length", "length type"), "", _type_marks(letters, types)),
            column("count", "", types.counts, summed=True),
            column("representative", "", _of(marks, types.representative)),
            *more,
            column("largest misfit", unit, types.misfit[types.worst]),
            column("misfit at", "", _of(marks, types.worst)),
        ),
    )


def _images(letters: str, types: Clusters, image: np.ndarray) -> Column:
    """Return the column of the types that are mirror images; nothing where there is none."""
    marks = _type_marks(letters, types)
    return column("mirror image", "", [None if k == NO_IMAGE else marks[k] for k in image.tolist()])


def _node_types(parts: Parts, mass: np.ndarray | None) -> Schedule:
    """One row for each type of node; how it is drilled stands at its representative."""
    types, one = parts.node_types, parts.node_types.representative
    more = [] if mass is None else [column("mass of one", "kg", mass[one])]
    return _types(
        "Node types", "NT", types, parts.node_marks, DEGREE,
        column("valence", "", parts.joints.valence[one]), column("ball", "mm", 2.0 * parts.radius[one]), *more,
        _images("NT", types, parts.node_images),
    )  # fmt: skip


def _panel_types(parts: Parts) -> Schedule:
    """One row for each type of panel."""
    types, one = parts.panel_types, parts.panel_types.representative
    return _types(
        "Panel types", "PT", types, parts.panel_marks, "mm",
        *(column(f"side {k + 1}", "mm", parts.sides[one, k]) for k in range(parts.sides.shape[1])),
        column("area of one", "m2", _areas(parts)[one]),
        _images("PT", types, parts.panel_images),
    )  # fmt: skip


def _lengths(parts: Parts) -> Schedule:
    """One row for each type of member."""
    types = parts.length_types
    total = np.bincount(types.of, parts.cut_of_family) / 1000.0
    stock = parts.stock.columns if parts.forces is not None else ()
    return _types(
        "Lengths", "L", types, parts.member_marks, "mm",
        *(column(each.name, "", [each.values[k] for k in types.representative.tolist()]) for each in stock),
        column("cut length", "mm", parts.cut_of_family[types.representative]), column("total", "m", total, summed=True),
    )  # fmt: skip


def _quantities(parts: Parts, groups: list[str], ball: np.ndarray | None, member: np.ndarray | None) -> Schedule:
    """One row for each group of nodes and members, and one for all panels."""
    rows: list[tuple[Value, ...]] = []
    on_boundary, used = boundary_nodes(parts.grid), parts.joints.valence > 0

    def total(values: np.ndarray | None, chosen: np.ndarray) -> float | None:
        return None if values is None else float(values[chosen].sum())

    for group, chosen in ((BOUNDARY, on_boundary & used), (INNER, ~on_boundary & used)):
        if chosen.any():
            rows.append(("nodes", group, int(chosen.sum()), None, None, None, total(ball, chosen)))
    if parts.forces is not None:
        layered = layered_grid(parts) is not None
        names_of = zip(groups, parts.forces.sections, strict=True)
        groups = [f"{group} {section}" if layered else section for group, section in names_of]
    of_member = np.array(groups)
    names = dict.fromkeys(groups)
    for group in [*(name for name in (BOUNDARY, INNER) if name in names), *sorted(names.keys() - {BOUNDARY, INNER})]:
        chosen = of_member == group
        length, cut = (total(values / 1000.0, chosen) for values in (parts.length, parts.cut))
        rows.append(("members", group, int(chosen.sum()), length, cut, None, total(member, chosen)))
    if parts.bolt is not None:
        for size in np.unique(parts.bolt[parts.bolt > 0]).tolist():
            count = 2 * int((parts.bolt == size).sum())
            rows.append(("bolts", f"M{size} {parts.settings.bolts}", count, None, None, None, None))
    areas = _areas(parts)
    rows.append(("panels", "all", len(areas), None, None, float(areas.sum()), None))
    heads = (
        ("item", ""),
        ("group", ""),
        ("count", ""),
        ("length", "m"),
        ("cut length", "m"),
        ("area", "m2"),
        ("mass", "kg"),
    )
    columns = [
        column(name, unit, values, summed=name == "mass")
        for (name, unit), values in zip(heads, zip(*rows, strict=True), strict=True)
    ]
    return Schedule("Quantities", tuple(columns if ball is not None or member is not None else columns[:-1]))
