"""The analysis model of IFC: nodes, members, supports, releases, load cases and results.

Loads and reactions at nodes are in the axes of the model, forces along members in those of the member on the face towards its end.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FormatError
from .bodies import Bodies
from .ifc_file import Ifc, Profiles
from .model import STATIONS_WRITTEN, line_loads, temperatures
from .part21 import Ref, Word, typed

if TYPE_CHECKING:
    from ..structure.results import CaseResult
    from ..structure.truss import LoadCase, Truss

SOURCES = {"permanent": ".DEAD_LOAD_G.", "snow": ".SNOW_S.", "wind": ".WIND_W.", "temperature": ".TEMPERATURE_T."}
GLOBAL, LOCAL = Word(".GLOBAL_COORDS."), Word(".LOCAL_COORDS.")


def add_analysis(ifc: Ifc, bodies: Bodies, profiles: Profiles, parts: list[Ref]) -> None:
    """Add the analysis model of a structure; `parts`: its members in the physical view, none where there is no such view."""
    truss, add = ifc.model.truss, ifc.add
    assert truss is not None
    points = [add("IFCVERTEXPOINT", add("IFCCARTESIANPOINT", each)) for each in truss.nodes.tolist()]
    nodes = _connections(ifc, truss, points)
    members = _curve_members(ifc, truss, points)
    profiles.associate(ifc, "curve members", bodies, members, usage=False)
    _releases(ifc, truss, nodes, members)
    cases = {case.name: _case(ifc, truss, case, nodes, members) for case in truss.cases}
    groups = list(cases.values())
    for each in truss.combinations:
        found = ifc.root(
            "IFCSTRUCTURALLOADGROUP", "combination", each.name, each.name, each.state, None, Word(".LOAD_COMBINATION."),
            Word(".NOTDEFINED."), Word(".NOTDEFINED."), None, each.state,
        )  # fmt: skip
        groups.append(found)
        for case, factor in each.factors:
            if case not in cases:
                raise FormatError(f"the combination {each.name!r} names no load case {case!r}")
            name = f"{each.name} {case}"
            ifc.relate("IFCRELASSIGNSTOGROUPBYFACTOR", name, (cases[case],), None, found, float(factor))
    results = [] if ifc.model.solution is None else [
        _results(ifc, case, cases[case.name], nodes, members) for case in ifc.model.solution.cases
    ]  # fmt: skip
    model = ifc.root(
        "IFCSTRUCTURALANALYSISMODEL", "analysis", "", "Analysis model", None, None, Word(".LOADING_3D."), None, groups or None,
        results or None, ifc.place,
    )  # fmt: skip
    ifc.relate("IFCRELASSIGNSTOGROUP", "analysis", [*nodes, *members], None, model)
    ifc.relate("IFCRELDECLARES", "analysis", ifc.project, (model,))
    for mark, part, member in zip(truss.member_marks, parts, members, strict=False):
        ifc.relate("IFCRELASSIGNSTOPRODUCT", mark, (member,), None, part)


def _held(kind: str, value: float) -> Any:
    """Return how one direction is held: rigid, free or with a stiffness [N/m, Nm/rad]."""
    return typed("IFCBOOLEAN", value > 0) if value == 0 or math.isinf(value) else typed(kind, float(value))


def _condition(ifc: Ifc, name: str, stiffness: tuple[float, ...]) -> Ref:
    kinds = ("IFCLINEARSTIFFNESSMEASURE",) * 3 + ("IFCROTATIONALSTIFFNESSMEASURE",) * 3
    return ifc.add("IFCBOUNDARYNODECONDITION", name, *map(_held, kinds, stiffness))


def _topology(ifc: Ifc, kind: str, item: Ref) -> Ref:
    shape = ifc.add("IFCTOPOLOGYREPRESENTATION", ifc.reference, "Reference", kind, (item,))
    return ifc.add("IFCPRODUCTDEFINITIONSHAPE", None, None, (shape,))


def _connections(ifc: Ifc, truss: Truss, points: list[Ref]) -> list[Ref]:
    """Add the nodes with their supports, each kind of which stands once."""
    kinds: dict[tuple[float, ...], Ref] = {}
    made = []
    for mark, point, stiffness in zip(truss.node_marks, points, map(tuple, truss.supports.tolist()), strict=True):
        if any(stiffness) and stiffness not in kinds:
            kinds[stiffness] = _condition(ifc, f"support {len(kinds) + 1}", stiffness)
        made.append(
            ifc.root(
                "IFCSTRUCTURALPOINTCONNECTION", "point connection", mark, mark, None, None, ifc.place,
                _topology(ifc, "Vertex", point), kinds.get(stiffness), None,
            )
        )  # fmt: skip
    return made


def _curve_members(ifc: Ifc, truss: Truss, points: list[Ref]) -> list[Ref]:
    kind = Word(".PIN_JOINED_MEMBER." if truss.pinned else ".RIGID_JOINED_MEMBER.")
    made = []
    for mark, (start, end), z in zip(
        truss.member_marks, truss.members.tolist(), truss.axes[:, 2].tolist(), strict=True
    ):
        edge = ifc.add("IFCEDGE", points[start], points[end])
        made.append(
            ifc.root(
                "IFCSTRUCTURALCURVEMEMBER", "curve member", mark, mark, None, None, ifc.place, _topology(ifc, "Edge", edge),
                kind, ifc.add("IFCDIRECTION", z),
            )
        )  # fmt: skip
    return made


def _releases(ifc: Ifc, truss: Truss, nodes: list[Ref], members: list[Ref]) -> None:
    """Connect the ends of the members to their nodes; what is rigid in all directions needs no condition."""
    kinds: dict[tuple[float, ...], Ref | None] = {(math.inf, math.inf): None}
    for number, (mark, member) in enumerate(zip(truss.member_marks, members, strict=True)):
        for end, node in enumerate(truss.members[number].tolist()):
            springs = (0.0, 0.0) if truss.pinned else tuple(truss.end_stiffness[number, end].tolist())
            if springs not in kinds:
                kinds[springs] = _condition(ifc, f"joint {len(kinds)}", (math.inf,) * 4 + springs)
            ifc.relate(
                "IFCRELCONNECTSSTRUCTURALMEMBER", f"{mark} {end}", member, nodes[node], kinds[springs], None, None, None
            )


def _act(
    ifc: Ifc, name: str, mark: str, on: Ref, load: Ref, more: tuple[Any, ...], description: str | None = None
) -> Ref:
    """Add an action or a reaction on a node or a member, where it lies."""
    act = ifc.root(name, name, mark, mark, description, None, None, None, load, *more)
    ifc.relate("IFCRELCONNECTSSTRUCTURALACTIVITY", f"{name} {mark}", on, act)
    return act


def _case(ifc: Ifc, truss: Truss, case: LoadCase, nodes: list[Ref], members: list[Ref]) -> Ref:
    """Add a load case with its loads."""
    permanent = case.action == "permanent"
    weight = (0.0, 0.0, -float(case.self_weight)) if case.self_weight else None
    found = ifc.root(
        "IFCSTRUCTURALLOADCASE", "case", case.name, case.name, None, None, Word(".LOAD_CASE."),
        Word(".PERMANENT_G." if permanent else ".VARIABLE_Q."), Word(SOURCES.get(case.action, ".NOTDEFINED.")), None, None,
        weight,
    )  # fmt: skip
    acts: list[Ref] = []
    if case.nodal is not None:
        for node in np.flatnonzero(case.nodal.any(axis=1)).tolist():
            load = ifc.add("IFCSTRUCTURALLOADSINGLEFORCE", None, *case.nodal[node].tolist())
            mark = f"{case.name} {truss.node_marks[node]}"
            acts.append(_act(ifc, "IFCSTRUCTURALPOINTACTION", mark, nodes[node], load, (GLOBAL, False)))
    if case.settlement is not None:
        for node in np.flatnonzero(np.nan_to_num(case.settlement).any(axis=1)).tolist():
            moved = [None if math.isnan(value) else value for value in case.settlement[node].tolist()]
            load = ifc.add("IFCSTRUCTURALLOADSINGLEDISPLACEMENT", None, *moved, None, None, None)
            mark = f"{case.name} {truss.node_marks[node]} settlement"
            acts.append(_act(ifc, "IFCSTRUCTURALPOINTACTION", mark, nodes[node], load, (GLOBAL, False)))
    along = (GLOBAL, False, Word(".TRUE_LENGTH."), Word(".CONST."))
    line = line_loads(truss, case, weight=False)
    for number in np.flatnonzero(line.any(axis=1)).tolist():
        load = ifc.add("IFCSTRUCTURALLOADLINEARFORCE", None, *line[number].tolist(), None, None, None)
        mark = f"{case.name} {truss.member_marks[number]}"
        acts.append(_act(ifc, "IFCSTRUCTURALLINEARACTION", mark, members[number], load, along))
    for number, change in enumerate(temperatures(truss, case, "IFC").tolist()):
        if change:
            load = ifc.add("IFCSTRUCTURALLOADTEMPERATURE", None, change, None, None)
            mark = f"{case.name} {truss.member_marks[number]} temperature"
            acts.append(_act(ifc, "IFCSTRUCTURALLINEARACTION", mark, members[number], load, along))
    if acts:
        ifc.relate("IFCRELASSIGNSTOGROUP", f"case {case.name}", acts, None, found)
    return found


def _results(ifc: Ifc, case: CaseResult, group: Ref, nodes: list[Ref], members: list[Ref]) -> Ref:
    """Add the displacements, support reactions and member forces of a load case."""
    truss, add = case.truss, ifc.add
    found = ifc.root(
        "IFCSTRUCTURALRESULTGROUP", "results", case.name, case.name, None, None, Word(".FIRST_ORDER_THEORY."), group, True
    )  # fmt: skip
    acts: list[Ref] = []
    for node, moved in enumerate(case.displacements.tolist()):
        load = add("IFCSTRUCTURALLOADSINGLEDISPLACEMENT", None, *moved)
        mark = f"{case.name} {truss.node_marks[node]} displacement"
        acts.append(_act(ifc, "IFCSTRUCTURALPOINTREACTION", mark, nodes[node], load, (GLOBAL,), "displacement"))
    for node in np.flatnonzero(truss.supports.any(axis=1)).tolist():
        load = add("IFCSTRUCTURALLOADSINGLEFORCE", None, *case.reactions[node].tolist())
        mark = f"{case.name} {truss.node_marks[node]} reaction"
        description = "force of the support on the structure"
        acts.append(_act(ifc, "IFCSTRUCTURALPOINTREACTION", mark, nodes[node], load, (GLOBAL,), description))
    forces = case.along[:, STATIONS_WRITTEN].tolist()
    description = "forces on the face towards the end"
    for number, length in enumerate(truss.lengths.tolist()):
        values = [add("IFCSTRUCTURALLOADSINGLEFORCE", None, *each) for each in forces[number]]
        load = add("IFCSTRUCTURALLOADCONFIGURATION", None, values, ((0.0,), (length / 2,), (length,)))
        mark = f"{case.name} {truss.member_marks[number]} forces"
        more = (LOCAL, Word(".DISCRETE."))
        acts.append(_act(ifc, "IFCSTRUCTURALCURVEREACTION", mark, members[number], load, more, description))
    ifc.relate("IFCRELASSIGNSTOGROUP", f"results {case.name}", acts, None, found)
    return found
