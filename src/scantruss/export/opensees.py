"""OpenSees, as Tcl or Python: a structure whose load cases are solved one after another, and whose displacements are printed.

The local axes are ours: `vecxz` is the normal of the surface. Members of a pinned structure are truss elements; springs at ends are
zeroLength elements between a node and a second node at its place. Both scripts are made of one list of commands.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FormatError
from ..runtime.ours import MADE_BY
from .model import Model, line_loads, nodal_loads
from .style import FileStyle

if TYPE_CHECKING:
    from ..structure.truss import LoadCase, Truss

Command = tuple[Any, ...]  # a name and its values; of many alike each value is a column: a list, or one for all
RIGID_PART = 1e5  #: stiffness of a rigid part of a spring joint, times the bending or torsional stiffness of the member

TCL_RUN = """
proc solve {} {
    constraints Transformation
    numberer RCM
    system %(system)s
    test NormUnbalance 1.0e-3 2
    integrator LoadControl 1.0
    algorithm Linear
    analysis Static
    analyze 1
}
puts "case node ux uy uz%(turns)s"
foreach number {%(numbers)s} {
    wipe
    build_model
    case$number
    solve
    for {set node 1} {$node <= %(nodes)d} {incr node} {
        puts "$number $node [nodeDisp $node]"
    }
}
"""
PYTHON_RUN = """

def solve():
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("%(system)s")
    ops.test("NormUnbalance", 1.0e-3, 2)
    ops.integrator("LoadControl", 1.0)
    ops.algorithm("Linear")
    ops.analysis("Static")
    ops.analyze(1)


if __name__ == "__main__":
    print("case node ux uy uz%(turns)s")
    for number, case in enumerate([%(cases)s], 1):
        ops.wipe()
        build_model()
        case()
        solve()
        for node in range(1, %(nodes)d + 1):
            print(number, node, *ops.nodeDisp(node))
"""


class Written(str):
    """A number that is turned into text once, as many members share it."""

    __repr__ = str.__str__


def encode_tcl(model: Model, style: FileStyle) -> bytes:
    """Return the script for OpenSees itself."""
    truss = _truss(model)
    lines = [*(f"# {words}" for words in _head(truss)), "", "proc build_model {} {"]
    lines += [*_tcl(_model(model, truss), "    "), "}"]
    for number, case in enumerate(truss.cases, 1):
        lines += [
            "",
            f"proc case{number} {{}} {{ # {_plain(case.name)}",
            "    timeSeries Linear 1",
            "    pattern Plain 1 1 {",
        ]
        lines += [*_tcl(_loads(truss, case), "        "), "    }", "}"]
    return "\n".join([*lines, TCL_RUN % _words(truss)]).encode("utf-8")


def encode_py(model: Model, style: FileStyle) -> bytes:
    """Return the script for the Python interpreter of OpenSees."""
    truss = _truss(model)
    lines = [*(f"# {words}" for words in _head(truss)), "", "try:", "    import openseespy.opensees as ops"]
    lines += ["except ImportError:", "    import opensees.openseespy as ops"]
    lines += ["", "", "def build_model():", *_python(_model(model, truss))]
    for number, case in enumerate(truss.cases, 1):
        lines += ["", "", f"def case{number}():  # {_plain(case.name)}", '    ops.timeSeries("Linear", 1)']
        lines += ['    ops.pattern("Plain", 1, 1)', *_python(_loads(truss, case))]
    return "\n".join([*lines, PYTHON_RUN % _words(truss)]).encode("utf-8")


def _truss(model: Model) -> Truss:
    if model.truss is None:
        raise FormatError("OpenSees holds structures; make one of the grid with scantruss structure")
    if not model.truss.cases:
        raise FormatError("OpenSees solves load cases, and this structure has none; give it --loads")
    return model.truss


def _plain(words: str) -> str:
    """Return words that end neither a line nor a block."""
    return "".join(letter if letter.isprintable() and letter not in '{}[]\\"$;' else " " for letter in words)


def _head(truss: Truss) -> list[str]:
    """Return what a reader of the script should know."""
    comments = [
        MADE_BY,
        "units: m, N, kg; nodes and members are counted from 1, in the order of their marks; local z lies along the normal",
        *(f"load case {number}: {_plain(case.name)}" for number, case in enumerate(truss.cases, 1)),
    ]
    for each in truss.combinations:
        factors = " + ".join(f"{factor:g} {_plain(case)}" for case, factor in each.factors)
        comments.append(f"combination {_plain(each.name)}: {factors}")
    if any(case.temperature is not None or case.strain is not None for case in truss.cases):
        comments.append(
            "strains without force are forces E A strain at the ends: take that from the axial forces of such cases"
        )
    return comments


def _words(truss: Truss) -> dict[str, str | int]:
    numbers = range(1, len(truss.cases) + 1)
    return {
        "nodes": len(truss.nodes),
        "turns": "" if truss.pinned else " rx ry rz",
        "numbers": " ".join(map(str, numbers)),
        "cases": ", ".join(f"case{number}" for number in numbers),
        "system": "UmfPack",
    }


def _written(commands: list[Command], head: str, between: str, tail: str, indent: str) -> Iterator[str]:
    """Yield the lines of commands, whose name stands in the head."""
    word = str if between == " " else repr
    for name, *values in commands:
        before = indent + head % name
        if not any(type(value) is list for value in values):
            yield before + between.join(map(word, values)) + tail
            continue
        form = between.join("%s" if type(value) is list else word(value).replace("%", "%%") for value in values)
        lists = [map(word, value) for value in values if type(value) is list]
        yield from map((before + form + tail).__mod__, zip(*lists, strict=True))


def _tcl(commands: list[Command], indent: str) -> Iterator[str]:
    return _written(commands, "%s ", " ", "", indent)


def _python(commands: list[Command]) -> Iterator[str]:
    return _written(commands, "ops.%s(", ", ", ")", "    ")


def _settling(truss: Truss) -> np.ndarray:
    """Return which displacements (V, 3) some load case imposes."""
    settled = np.zeros((len(truss.nodes), 3), bool)
    for case in truss.cases:
        if case.settlement is not None:
            settled |= ~np.isnan(case.settlement)
    return settled


def _model(model: Model, truss: Truss) -> list[Command]:
    """Return the commands that make nodes, supports and members."""
    count = 3 if truss.pinned else 6
    made: list[Command] = [("model", "basic", "-ndm", 3, "-ndf", count)]
    made.append(("node", list(range(1, len(truss.nodes) + 1)), *model.nodes.T.tolist()))
    supports = truss.supports[:, :count]
    fixed = np.isinf(supports)
    fixed[:, :3] &= ~_settling(truss)
    made += [("fix", node + 1, *map(int, fixed[node].tolist())) for node in np.flatnonzero(fixed.any(axis=1)).tolist()]
    extra = _Extra(made, len(truss.nodes), len(truss.members))
    for node in np.flatnonzero((np.isfinite(supports) & (supports > 0)).any(axis=1)).tolist():
        ground = extra.node(model.nodes[node].tolist())
        made.append(("fix", ground, *[1] * count))
        held = [(way + 1, value) for way, value in enumerate(supports[node].tolist()) if 0 < value < np.inf]
        extra.springs(ground, node + 1, held)
    _members(model, truss, made, extra)
    return made


class _Extra:
    """Counts what is made besides the nodes and members: second nodes at a place, springs and their materials."""

    def __init__(self, made: list[Command], nodes: int, elements: int) -> None:
        self.made, self.nodes, self.elements, self.materials = made, nodes, elements, 1

    def node(self, place: list[float]) -> int:
        """Make a node and return its number."""
        self.nodes += 1
        self.made.append(("node", self.nodes, *place))
        return self.nodes

    def springs(
        self, one: int, other: int, held: list[tuple[int, float]], axes: list[list[float]] | None = None
    ) -> None:
        """Join two nodes by springs along and about axes, each a number from 1 and a stiffness."""
        first = self.materials + 1
        self.materials += len(held)
        self.elements += 1
        numbers = list(range(first, self.materials + 1))
        self.made += [("uniaxialMaterial", "Elastic", k, value) for k, (_, value) in zip(numbers, held, strict=True)]
        along: Command = () if axes is None else ("-orient", *axes[0], *axes[1])
        ways = [way for way, _ in held]
        self.made.append(("element", "zeroLength", self.elements, one, other, "-mat", *numbers, "-dir", *ways, *along))


def _members(model: Model, truss: Truss, made: list[Command], extra: _Extra) -> None:
    """Add the members, with springs at their ends."""
    material, axes = truss.material, truss.axes
    made.append(("uniaxialMaterial", "Elastic", 1, material.young))
    numbers, sections = list(range(1, len(truss.members) + 1)), truss.section_of.tolist()
    if truss.pinned:
        areas = [truss.sections[k].area for k in sections]
        made.append(("element", "Truss", numbers, *(truss.members.T + 1).tolist(), areas, 1))
        return
    stiffness = [
        [
            Written(repr(value))
            for value in (each.area, material.young, material.shear, each.torsion, each.inertia_y, each.inertia_z)
        ]
        for each in truss.sections
    ]
    made.append(("geomTransf", "Linear", numbers, *axes[:, 2].T.tolist()))
    springy = np.isfinite(truss.end_stiffness).any(axis=2)
    both, lengths = (truss.members + 1).tolist(), truss.lengths
    for member in np.flatnonzero(springy.any(axis=1)).tolist():
        own, ends, frame = truss.sections[sections[member]], both[member], axes[member].tolist()
        rigid = RIGID_PART * material.young * max(own.inertia_y, own.inertia_z, own.torsion) / float(lengths[member])
        for which in np.flatnonzero(springy[member]).tolist():
            joint = ends[which]
            ends[which] = extra.node(model.nodes[joint - 1].tolist())
            made.append(("equalDOF", joint, ends[which], 1, 2, 3))
            about_y, about_z = truss.end_stiffness[member, which].tolist()
            held = [(4, rigid), (5, min(about_y, rigid)), (6, min(about_z, rigid))]
            extra.springs(joint, ends[which], [(way, value) for way, value in held if value], frame)
    shared = [[stiffness[k][column] for k in sections] for column in range(6)]
    start, end = [ends[0] for ends in both], [ends[1] for ends in both]
    made.append(("element", "elasticBeamColumn", numbers, start, end, *shared, numbers))


def _loads(truss: Truss, case: LoadCase) -> list[Command]:
    """Return the loads of a case: forces on nodes, lines along members in local axes, imposed displacements."""
    nodal = nodal_loads(truss, case)
    loaded = np.flatnonzero(nodal.any(axis=1))
    made: list[Command] = [("load", (loaded + 1).tolist(), *nodal[loaded].T.tolist())]
    if not truss.pinned:
        line = line_loads(truss, case)
        loaded = np.flatnonzero(line.any(axis=1))
        x, y, z = np.einsum("mij,mj->mi", truss.axes[loaded], line[loaded]).T.tolist()
        made.append(("eleLoad", "-ele", (loaded + 1).tolist(), "-type", "-beamUniform", y, z, x))
    for node, way in np.argwhere(_settling(truss)).tolist():
        value = 0.0 if case.settlement is None else float(np.nan_to_num(case.settlement[node, way]))
        made.append(("sp", node + 1, way + 1, value))
    return made
