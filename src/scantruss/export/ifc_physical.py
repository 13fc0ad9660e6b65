"""The physical view of IFC: members, balls and panels, each with its mark, in groups and with quantities."""

from __future__ import annotations

import math

import numpy as np

from ..structure.truss import area_vectors
from .bodies import Bodies, member_axes
from .ifc_file import Ifc, Profiles
from .part21 import Ref, Word, typed

MEMBER, NOT_DEFINED = Word(".MEMBER."), Word(".NOTDEFINED.")


def add_physical(ifc: Ifc, bodies: Bodies | None, profiles: Profiles | None) -> list[Ref]:
    """Add the parts of the building; return the members."""
    model = ifc.model
    place = ifc.add("IFCLOCALPLACEMENT", ifc.place, ifc.add("IFCAXIS2PLACEMENT3D", ifc.zero, None, None))
    building = ifc.root(
        "IFCBUILDING", "building", "", "Building", None, None, place, None, None, Word(".ELEMENT."), None, None, None
    )
    ifc.relate("IFCRELAGGREGATES", "site", ifc.site, (building,))
    points = [ifc.add("IFCCARTESIANPOINT", each) for each in (model.local * model.metres).tolist()]
    members = _members(ifc, bodies, profiles, points)
    nodes = _nodes(ifc, bodies, points)
    panels = _panels(ifc, place)
    if parts := [*members, *nodes, *panels]:
        ifc.relate("IFCRELCONTAINEDINSPATIALSTRUCTURE", "building", parts, building)
    named = {name: np.flatnonzero(model.group_of == number) for number, name in enumerate(model.groups)}
    for kind, group, found in [
        *(("members", name, [members[k] for k in ids.tolist()]) for name, ids in named.items()),
        *(("nodes", name, [nodes[k] for k in ids.tolist()]) for name, ids in model.node_sets.items()),
    ]:
        if found:
            group_of = ifc.root("IFCGROUP", kind, group, f"{kind} {group}", None, None)
            ifc.relate("IFCRELASSIGNSTOGROUP", f"{kind} {group}", found, None, group_of)
    return members


def _members(ifc: Ifc, bodies: Bodies | None, profiles: Profiles | None, points: list[Ref]) -> list[Ref]:
    """Add the members, with bodies where their section is known, and with their axes."""
    model, add = ifc.model, ifc.add
    truss = model.truss
    density = None if truss is None else truss.material.density

    axes = (bodies.axes if bodies is not None else member_axes(model)).tolist()
    lengths = (model.lengths * model.metres).tolist()
    made = []
    for number, (start, end) in enumerate(model.members.tolist()):
        mark, (x, y, _), length = model.member_marks[number], axes[number], lengths[number]
        frame = add("IFCAXIS2PLACEMENT3D", points[start], add("IFCDIRECTION", x), add("IFCDIRECTION", y))
        line = add("IFCPOLYLINE", (ifc.zero, add("IFCCARTESIANPOINT", (0.0, 0.0, length))))
        shapes = [add("IFCSHAPEREPRESENTATION", ifc.axis, "Axis", "Curve3D", (line,))]
        section = None
        if bodies is not None and profiles is not None:
            section, inset = bodies.sections[bodies.section_of[number]], float(bodies.inset[number])
            at = add("IFCAXIS2PLACEMENT3D", add("IFCCARTESIANPOINT", (0.0, 0.0, inset)), None, None) if inset else None
            solid = add(
                "IFCEXTRUDEDAREASOLID", profiles.profiles[bodies.section_of[number]], at, ifc.up, float(bodies.lengths[number])
            )  # fmt: skip
            shapes.append(add("IFCSHAPEREPRESENTATION", ifc.body, "Body", "SweptSolid", (solid,)))
        member = ifc.root(
            "IFCMEMBER", "member", mark, mark, None, None if section is None else section.name,
            add("IFCLOCALPLACEMENT", ifc.place, frame), add("IFCPRODUCTDEFINITIONSHAPE", None, None, shapes), mark, MEMBER,
        )  # fmt: skip
        made.append(member)
        values = {
            "Mark": typed("IFCIDENTIFIER", mark),
            "Group": typed("IFCLABEL", model.groups[model.group_of[number]]),
            "StartNode": typed("IFCIDENTIFIER", model.node_marks[start]),
            "EndNode": typed("IFCIDENTIFIER", model.node_marks[end]),
            "SystemLength": typed("IFCPOSITIVELENGTHMEASURE", length),
        }
        if model.utilization is not None and math.isfinite(model.utilization[number]):
            values["Utilization"] = typed("IFCREAL", float(model.utilization[number]))
        ifc.properties("ScanTruss_Member", mark, values, (member,))
        if bodies is not None and section is not None:
            cut = float(bodies.lengths[number])
            quantities = [
                add("IFCQUANTITYLENGTH", "Length", None, None, cut, None),
                add("IFCQUANTITYAREA", "CrossSectionArea", None, None, section.area, None),
                add("IFCQUANTITYVOLUME", "NetVolume", None, None, section.area * cut, None),
            ]
            if density is not None:
                quantities.append(add("IFCQUANTITYWEIGHT", "NetWeight", None, None, section.area * cut * density, None))
            name = "Qto_MemberBaseQuantities"
            found = ifc.root("IFCELEMENTQUANTITY", name, mark, name, None, None, quantities)
            ifc.relate("IFCRELDEFINESBYPROPERTIES", f"{name} {mark}", (member,), found)
    if made:
        ifc.properties("Pset_MemberCommon", "", {"LoadBearing": typed("IFCBOOLEAN", True)}, tuple(made))
    if bodies is not None and profiles is not None:
        profiles.associate(ifc, "members", bodies, made, usage=True)
        for number, section in enumerate(bodies.sections):
            mine = [made[k] for k in np.flatnonzero(bodies.section_of == number).tolist()]
            kind = ifc.root("IFCMEMBERTYPE", "member type", section.name, section.name, *[None] * 6, MEMBER)
            ifc.relate("IFCRELASSOCIATESMATERIAL", f"type {section.name}", (kind,), profiles.sets[number])
            ifc.relate("IFCRELDEFINESBYTYPE", f"member {section.name}", mine, kind)
    return made


def _nodes(ifc: Ifc, bodies: Bodies | None, points: list[Ref]) -> list[Ref]:
    """Add the nodes: balls of one shape, or points where no ball is known."""
    model, add = ifc.model, ifc.add
    ball = None if bodies is None or not bodies.ball else _ball(ifc, bodies.ball)
    held = set(model.supported.tolist())
    made = []
    for mark, point in zip(model.node_marks, points, strict=True):
        frame = add("IFCAXIS2PLACEMENT3D", point, None, None)
        if ball is None:
            shape = add("IFCSHAPEREPRESENTATION", ifc.reference, "Reference", "Point", (ifc.zero,))
        else:
            copy = add("IFCMAPPEDITEM", *ball)
            shape = add("IFCSHAPEREPRESENTATION", ifc.body, "Body", "MappedRepresentation", (copy,))
        node = ifc.root(
            "IFCDISCRETEACCESSORY", "node", mark, mark, None, "node" if ball is None else "ball",
            add("IFCLOCALPLACEMENT", ifc.place, frame), add("IFCPRODUCTDEFINITIONSHAPE", None, None, (shape,)), mark, NOT_DEFINED,
        )  # fmt: skip
        made.append(node)
    for word, ids in (("supported", held), ("free", set(range(len(made))) - held)):
        if ids:
            of = tuple(made[k] for k in sorted(ids))
            ifc.properties("ScanTruss_Node", word, {"Supported": typed("IFCBOOLEAN", word == "supported")}, of)
    return made


def _ball(ifc: Ifc, radius: float) -> tuple[Ref, Ref]:
    """Add the shape of a ball, half a disc turned about its diameter; return what a copy of it is made of."""
    add = ifc.add
    places = add("IFCCARTESIANPOINTLIST2D", ((0.0, -radius), (radius, 0.0), (0.0, radius)))
    pieces = (typed("IFCARCINDEX", (1, 2, 3)), typed("IFCLINEINDEX", (3, 1)))
    outline = add("IFCINDEXEDPOLYCURVE", places, pieces, Word(".F."))
    half = add("IFCARBITRARYCLOSEDPROFILEDEF", Word(".AREA."), None, outline)
    axis = add("IFCAXIS1PLACEMENT", ifc.zero, add("IFCDIRECTION", (0.0, 1.0, 0.0)))
    solid = add("IFCREVOLVEDAREASOLID", half, None, axis, 2 * math.pi)
    shape = add("IFCSHAPEREPRESENTATION", ifc.body, "Body", "SweptSolid", (solid,))
    source = add("IFCREPRESENTATIONMAP", add("IFCAXIS2PLACEMENT3D", ifc.zero, None, None), shape)
    return source, add("IFCCARTESIANTRANSFORMATIONOPERATOR3D", None, None, ifc.zero, None, None)


def _panels(ifc: Ifc, place: Ref) -> list[Ref]:
    """Add the panels: triangles without thickness, two or more for one of more than three nodes."""
    model, add = ifc.model, ifc.add
    nodes, count = model.local * model.metres, [len(loop) - 2 for loop in model.panel_loops]
    pieces = np.split(model.triangles, np.cumsum(count)[:-1]) if count else []
    made = []
    for mark, loop, own in zip(model.panel_marks, model.panel_loops, pieces, strict=True):
        places = add("IFCCARTESIANPOINTLIST3D", nodes[loop].tolist())
        number = {node: k for k, node in enumerate(loop, 1)}
        index = tuple(tuple(number[node] for node in each) for each in own.tolist())
        area = float(np.linalg.norm(area_vectors(nodes, own), axis=1).sum())
        face = add("IFCTRIANGULATEDFACESET", places, None, Word(".F."), index, None)
        shape = add("IFCSHAPEREPRESENTATION", ifc.body, "Body", "Tessellation", (face,))
        shapes = add("IFCPRODUCTDEFINITIONSHAPE", None, None, (shape,))
        plate = ifc.root("IFCPLATE", "panel", mark, mark, None, "panel", place, shapes, mark, NOT_DEFINED)
        made.append(plate)
        name = "Qto_PlateBaseQuantities"
        found = ifc.root(
            "IFCELEMENTQUANTITY",
            name,
            mark,
            name,
            None,
            None,
            (add("IFCQUANTITYAREA", "NetArea", None, None, area, None),),
        )
        ifc.relate("IFCRELDEFINESBYPROPERTIES", f"{name} {mark}", (plate,), found)
    return made
