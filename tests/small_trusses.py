"""Structures made by hand, for the tests of statics."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from scantruss.structure.catalogue import Section, find_material, find_section
from scantruss.structure.results import CaseResult
from scantruss.structure.truss import LoadCase, Truss

TUBE, STEEL = find_section("CHS114.3x5"), find_material("S355")
EA = STEEL.young * TUBE.area
EI = STEEL.young * TUBE.inertia_y
FREE, HINGED, HELD = (0.0,) * 6, (np.inf,) * 3 + (0.0,) * 3, (np.inf,) * 6


def stiff_along(section: Section = TUBE, factor: float = 1e6) -> Section:
    """Return a section that hardly lengthens, as textbooks take it."""
    return replace(section, area=section.area * factor)


def make_truss(
    nodes: ArrayLike, members: ArrayLike, supports: Mapping[int, tuple[float, ...]], *cases: LoadCase, **others: Any
) -> Truss:
    """Return a structure of lists; normals point up, or along y of members that stand."""
    nodes = np.asarray(nodes, float)
    members = np.asarray(members, np.int64)
    held = np.zeros((len(nodes), 6))
    for node, stiffness in supports.items():
        held[node] = stiffness
    given: dict[str, Any] = {
        "triangles": np.zeros((0, 3), np.int64),
        "node_normals": np.tile([0.0, 0.0, 1.0], (len(nodes), 1)),
        "member_normals": np.tile([0.0, 0.0, 1.0], (len(members), 1)),
        "sections": (TUBE,),
        "section_of": np.zeros(len(members), np.int64),
        "material": STEEL,
        "supports": held,
        "end_stiffness": np.full((len(members), 2, 2), np.inf),
        "cases": cases,
        "node_marks": tuple(f"N{k:03d}" for k in range(1, len(nodes) + 1)),
        "member_marks": tuple(f"M{k:04d}" for k in range(1, len(members) + 1)),
    }
    return Truss(nodes=nodes, members=members, **(given | others))


def forces(truss_nodes: int, loads: dict[int, tuple[float, ...]], name: str = "load") -> LoadCase:
    """Return a load case of forces, or of forces and moments, on nodes."""
    nodal = np.zeros((truss_nodes, 6))
    for node, load in loads.items():
        nodal[node, : len(load)] = load
    return LoadCase(name, nodal=nodal)


def line_of(length: float, count: int, axis: tuple[float, float, float] = (1, 0, 0)) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes along a line, unevenly spaced, and the members between them."""
    place = np.linspace(0, 1, count + 1) ** 1.3 * length
    return place[:, None] * np.asarray(axis, float), np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)


def pynite_model(truss: Truss, results: Iterable[CaseResult]) -> Any:
    """Return a structure of tubes, held where it is supported, with the nodal loads of some results, for PyNite to solve."""
    from Pynite import FEModel3D

    model = FEModel3D()
    model.add_material("steel", STEEL.young, STEEL.shear, 0.3, STEEL.density)
    model.add_section("tube", TUBE.area, TUBE.inertia_y, TUBE.inertia_z, TUBE.torsion)
    for mark, place in zip(truss.node_marks, truss.nodes, strict=True):
        model.add_node(mark, *map(float, place))
    for mark, (a, b) in zip(truss.member_marks, truss.members, strict=True):
        model.add_member(mark, truss.node_marks[a], truss.node_marks[b], "steel", "tube")
    for node in np.flatnonzero(truss.supports.any(axis=1)):
        model.def_support(truss.node_marks[node], *[True] * 6)
    for case in results:
        for mark, force in zip(truss.node_marks, case.nodal, strict=True):
            for way, value in zip(("FX", "FY", "FZ"), force, strict=False):
                model.add_node_load(mark, way, float(value), case=case.name)
        model.add_load_combo(case.name, {case.name: 1.0})
    return model
