"""STEP (AP214): the axes of the members as trimmed lines, or the bodies of members and nodes; with their marks, on layers by group."""

from __future__ import annotations

import numpy as np

from ..errors import FormatError
from .bodies import bodies_of
from .model import Model
from .part21 import Part21, Ref, Word
from .step_bodies import add_bodies
from .style import FileStyle

SCHEMA = "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }"
PREFIX = {"mm": ".MILLI.", "cm": ".CENTI.", "m": "$"}


def encode_step(model: Model, style: FileStyle) -> bytes:
    """Return a STEP file: axes in the frame of the scan in the unit of the grid (inches and feet become metres), or bodies.

    Bodies are in metres and relative to the origin, as kernels of CAD programs work to 1e-7 mm near 0; the product has the origin.

    Raises
    ------
    FormatError
        Bodies are asked for, and the members of a grid have no thickness.
    """
    return _encode_bodies(model, style) if style.step == "bodies" else _encode_axes(model)


def _encode_bodies(model: Model, style: FileStyle) -> bytes:
    bodies = bodies_of(model, style)
    if bodies is None:
        raise FormatError("STEP bodies need sections, and the members of a grid have no thickness; give --tube")
    file = Part21(SCHEMA, "ScanTruss")
    context = _context(file, PREFIX["m"])
    members, balls = add_bodies(file, model, bodies)
    name = "members and nodes"
    shape = file.add("ADVANCED_BREP_SHAPE_REPRESENTATION", name, (_frame(file), *members, *balls), context)
    _product(file, shape, f"relative to the origin {' '.join(map(repr, (model.origin * model.metres).tolist()))} m")
    _layers(file, model, members)
    if balls:
        file.add("PRESENTATION_LAYER_ASSIGNMENT", "nodes", "", balls)
    return file.encode()


def _encode_axes(model: Model) -> bytes:
    file = Part21(SCHEMA, "ScanTruss")
    unit = model.unit if model.unit in PREFIX else "m"
    size = 1.0 if model.unit == unit else model.metres
    context = _context(file, PREFIX[unit])
    nodes = model.nodes * size
    points = [
        file.add("CARTESIAN_POINT", mark, each) for mark, each in zip(model.node_marks, nodes.tolist(), strict=True)
    ]
    ends = nodes[model.members]
    lengths = np.maximum(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), 1e-300)
    along = ((ends[:, 1] - ends[:, 0]) / lengths[:, None]).tolist()
    curves = []
    table = zip(model.member_marks, model.members.tolist(), along, lengths.tolist(), strict=True)
    for mark, (start, end), direction, length in table:
        vector = file.add("VECTOR", "", file.add("DIRECTION", "", direction), length)
        line = file.add("LINE", mark, points[start], vector)
        curves.append(
            file.add("TRIMMED_CURVE", mark, line, (points[start],), (points[end],), Word(".T."), Word(".CARTESIAN."))
        )
    curves_of = file.add("GEOMETRIC_CURVE_SET", "members", curves or points[:1])
    shape = file.add(
        "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION", "members", (_frame(file), curves_of), context
    )
    _product(file, shape, "")
    _layers(file, model, curves)
    return file.encode()


def _frame(file: Part21) -> Ref:
    zero = file.add("CARTESIAN_POINT", "", (0.0, 0.0, 0.0))
    up, x = file.add("DIRECTION", "", (0.0, 0.0, 1.0)), file.add("DIRECTION", "", (1.0, 0.0, 0.0))
    return file.add("AXIS2_PLACEMENT_3D", "", zero, up, x)


def _layers(file: Part21, model: Model, members: list[Ref]) -> None:
    """Put the members of each group on a layer."""
    for number, name in enumerate(model.groups):
        mine = [members[k] for k in np.flatnonzero(model.group_of == number).tolist()]
        if mine:
            file.add("PRESENTATION_LAYER_ASSIGNMENT", f"members {name}", "", mine)


def _context(file: Part21, prefix: str) -> Ref:
    """Add units, and the context that has them."""
    length = file.complex("LENGTH_UNIT()", "NAMED_UNIT(*)", f"SI_UNIT({prefix},.METRE.)")
    angle = file.complex("NAMED_UNIT(*)", "PLANE_ANGLE_UNIT()", "SI_UNIT($,.RADIAN.)")
    solid = file.complex("NAMED_UNIT(*)", "SI_UNIT($,.STERADIAN.)", "SOLID_ANGLE_UNIT()")
    nearness = file.add(
        "UNCERTAINTY_MEASURE_WITH_UNIT", Word("LENGTH_MEASURE(1.E-6)"), length, "distance_accuracy_value", ""
    )
    return file.complex(
        "GEOMETRIC_REPRESENTATION_CONTEXT(3)",
        f"GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{nearness:d}))",
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length:d},#{angle:d},#{solid:d}))",
        "REPRESENTATION_CONTEXT('','3D')",
    )


def _product(file: Part21, shape: Ref, description: str) -> None:
    """Add what makes a product of a shape."""
    application = file.add("APPLICATION_CONTEXT", "automotive design")
    file.add("APPLICATION_PROTOCOL_DEFINITION", "international standard", "automotive_design", 2000, application)
    product = file.add(
        "PRODUCT", "ScanTruss", "ScanTruss", description, (file.add("PRODUCT_CONTEXT", "", application, "mechanical"),)
    )
    file.add("PRODUCT_RELATED_PRODUCT_CATEGORY", "part", None, (product,))
    version = file.add("PRODUCT_DEFINITION_FORMATION", "", "", product)
    stage = file.add("PRODUCT_DEFINITION_CONTEXT", "part definition", application, "design")
    definition = file.add("PRODUCT_DEFINITION", "design", "", version, stage)
    file.add("SHAPE_DEFINITION_REPRESENTATION", file.add("PRODUCT_DEFINITION_SHAPE", "", "", definition), shape)
