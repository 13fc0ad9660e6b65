"""Input files for Abaqus and CalculiX: a linear static step for each load case, whose loads take the place of those before.

Members of a pinned structure are trusses (T3D2) for both. Rigid ones are cubic beams (B33) for Abaqus. CalculiX lacks these; its beams
of 12 displacements (U1) are right in the plane of their first axis only: version 2.20 has s(3,9) = s(3,3) in e_c3d_u1.f, where the
sign is minus. So a member is two of them, one for each plane, each with half of its area.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import FormatError
from ..runtime.ours import MADE_BY
from ..structure.statics import dead_loads
from .model import Model, line_loads, nodal_loads
from .style import FileStyle

if TYPE_CHECKING:
    from ..structure.catalogue import Material
    from ..structure.truss import LoadCase, Truss

PER_LINE = 16  #: numbers in a line of a set
NUMBER_WIDTH = 20  #: letters of a number, as CalculiX reads them
ROUND_TUBE = 1e-3  #: share by which the torsional inertia of a section may differ from Iy + Iz in CalculiX
LARGEST_POISSON_RATIO = 0.49  #: greatest Poisson's ratio that is written
NO_SHEAR = 1e5  #: shear factor at which a beam of CalculiX is one without deformation by shear


def encode_inp(model: Model, style: FileStyle) -> bytes:
    """Return the input file of a structure in m, N and kg, in the frame of the scan."""
    truss = model.truss
    if truss is None:
        raise FormatError("Abaqus holds structures; make one of the grid with scantruss structure")
    ends = truss.end_stiffness
    if not truss.pinned and style.inp == "calculix":
        _check_calculix(truss)
    elif not truss.pinned and (np.isfinite(ends) & (ends > 0)).any():
        raise FormatError(
            "Abaqus input holds no springs at the ends of members; use --joints rigid or pinned, or another format"
        )
    return ("\n".join(_lines(model, truss, style.inp)) + "\n").encode("utf-8")


def _check_calculix(truss: Truss) -> None:
    """Refuse what the beams of CalculiX are not."""
    if np.isfinite(truss.end_stiffness).any():
        raise FormatError("beams of CalculiX have no hinges or springs at their ends; use --joints rigid or pinned")
    if any(case.settlement is not None for case in truss.cases):
        raise FormatError("beams of CalculiX do not follow supports that settle; use --joints pinned or another format")
    if _poisson(truss.material) > LARGEST_POISSON_RATIO:
        raise FormatError(
            f"beams of CalculiX are isotropic, and {truss.material.name} is not; use --joints pinned or another format"
        )
    for own in truss.sections:
        if abs(own.torsion / (own.inertia_y + own.inertia_z) - 1) > ROUND_TUBE:
            raise FormatError(
                f"beams of CalculiX have the torsional inertia Iy + Iz, as round tubes, and {own.name} has not; use another format"
            )


def _short(values: np.ndarray) -> list[str]:
    """Return numbers as text, to the last bit where that is short enough, else to 13 digits."""
    return [word if len(word := repr(value)) <= NUMBER_WIDTH else f"{value:.13g}" for value in values.tolist()]


def _number(value: float) -> str:
    """Return a number as text; whole ones keep their point, without which CalculiX stops."""
    return _short(np.array([value], float))[0]


def _plain(words: str) -> str:
    return "".join(letter if letter.isprintable() and letter not in ',*="' else " " for letter in words)


def _set(kind: str, name: str, numbers: np.ndarray) -> Iterator[str]:
    """Yield a set of elements or nodes, counted from 1."""
    if len(numbers):
        yield f'*{kind}, {kind}="{_plain(name)}"'
        for start in range(0, len(numbers), PER_LINE):
            yield ", ".join(map(str, (numbers[start : start + PER_LINE] + 1).tolist()))


def _lines(model: Model, truss: Truss, program: str) -> Iterator[str]:
    yield "*HEADING"
    yield f"{MADE_BY}; m N kg; nodes and members are counted from 1 in the order of their marks"
    for each in truss.combinations:
        yield f"** combination {_plain(each.name)}: {' + '.join(f'{factor:g} {_plain(case)}' for case, factor in each.factors)}"
    yield "*NODE, NSET=nodes"
    numbered = zip(range(1, len(model.local) + 1), *map(_short, model.nodes.T), strict=True)
    yield from map("%d, %s, %s, %s".__mod__, numbered)
    calculix = program == "calculix" and not truss.pinned
    if calculix:
        yield "*USER ELEMENT, TYPE=U1, NODES=2, INTEGRATION POINTS=2, MAXDOF=6"
    yield f"*ELEMENT, TYPE={'T3D2' if truss.pinned else 'U1' if calculix else 'B33'}, ELSET=members"
    ends, first = (truss.members + 1).T.tolist(), range(1, len(truss.members) + 1)
    yield from map("%d, %d, %d".__mod__, zip(first, *ends, strict=True))
    if calculix:
        second = range(len(truss.members) + 1, 2 * len(truss.members) + 1)
        yield "*ELEMENT, TYPE=U1, ELSET=second"
        yield from map("%d, %d, %d".__mod__, zip(second, *ends, strict=True))
    for number, name in enumerate(model.groups):
        yield from _set("ELSET", f"group {name}", np.flatnonzero(model.group_of == number))
    yield from _set("NSET", "supports", model.supported)
    yield from _beams_of_calculix(truss) if calculix else _sections(truss)
    supports = truss.supports[:, :3] if truss.pinned else truss.supports
    yield "*BOUNDARY"
    yield from (f"{node + 1}, {way + 1}, {way + 1}" for node, way in np.argwhere(np.isinf(supports)).tolist())
    number = len(truss.members) * (1 + calculix)
    for node, way in np.argwhere(np.isfinite(supports) & (supports > 0)).tolist():
        number += 1
        yield from (f"*ELEMENT, TYPE=SPRING1, ELSET=spring{number}", f"{number}, {node + 1}")
        yield from (f"*SPRING, ELSET=spring{number}", f"{way + 1}", _number(supports[node, way]))
    settling = any(case.settlement is not None for case in truss.cases)
    for case in truss.cases:
        yield from _step(truss, case, supports if settling else None, calculix)


def _poisson(material: Material) -> float:
    return material.young / (2 * material.shear) - 1


def _material(material: Material) -> tuple[str, ...]:
    poisson = min(_poisson(material), LARGEST_POISSON_RATIO)  # of trusses alone, which do not feel it
    head = ("*MATERIAL, NAME=material", "*ELASTIC", f"{material.young!r}, {_number(poisson)}")
    return (*head, "*DENSITY", f"{material.density!r}")


def _beams_of_calculix(truss: Truss) -> Iterator[str]:
    """Yield the sections of two beams a member: bending along local y about z, and along z about y."""
    yield from _material(truss.material)
    for plane, (axis, inertia) in enumerate(((1, "inertia_z"), (2, "inertia_y"))):
        forms = [
            "*ELSET, ELSET=e%d\n%d\n*BEAM SECTION, SECTION=GENERAL, MATERIAL=material, ELSET=e%d\n"
            f"{_number(own.area / 2)}, {_number(getattr(own, inertia))}, 0.0, 0.0, {NO_SHEAR!r}\n%s, %s, %s"
            for own in truss.sections
        ]
        first = 1 + plane * len(truss.members)
        for number, (section, way) in enumerate(
            zip(truss.section_of.tolist(), zip(*map(_short, truss.axes[:, axis].T), strict=True), strict=True), first
        ):
            yield forms[section] % (number, number, number, *way)


def _sections(truss: Truss) -> Iterator[str]:
    material, y = truss.material, zip(*map(_short, truss.axes[:, 1].T), strict=True)
    if truss.pinned:
        yield from _material(material)
        for number, each in enumerate(truss.sections):
            own = np.flatnonzero(truss.section_of == number)
            yield from _set("ELSET", f"section {each.name}", own)
            if len(own):
                yield from (
                    f'*SOLID SECTION, ELSET="section {_plain(each.name)}", MATERIAL=material',
                    _number(each.area),
                )
        return
    forms = [
        f"*ELSET, ELSET=member%d\n%d\n*BEAM GENERAL SECTION, SECTION=GENERAL, ELSET=member%d, DENSITY={material.density!r}\n"
        f"{_number(own.area)}, {_number(own.inertia_y)}, 0.0, {_number(own.inertia_z)}, {_number(own.torsion)}\n"
        f"%s, %s, %s\n{material.young!r}, {material.shear!r}"  # axis 1; axis 2 is z then
        for own in truss.sections
    ]
    for number, (section, axis) in enumerate(zip(truss.section_of.tolist(), y, strict=True), 1):
        yield forms[section] % (number, number, number, *axis)
    loose = np.argwhere(truss.end_stiffness == 0).tolist()
    if loose:
        yield "*RELEASE"
        yield from (f"{member + 1}, S{end + 1}, M{axis + 1}" for member, end, axis in loose)


def _step(truss: Truss, case: LoadCase, supports: np.ndarray | None, calculix: bool) -> Iterator[str]:
    """Yield a load case; `supports` where some case settles, so that each has to say all that is held."""
    yield from (f'*STEP, NAME="{_plain(case.name)}"', "*STATIC")
    if supports is not None:
        yield "*BOUNDARY, OP=NEW"
        moved = np.full(supports.shape, np.nan)
        if case.settlement is not None:
            moved[:, :3] = case.settlement
        for node, way in np.argwhere(np.isinf(supports)).tolist():
            value = "" if np.isnan(moved[node, way]) else f", {_number(moved[node, way])}"
            yield f"{node + 1}, {way + 1}, {way + 1}{value}"
    nodal = nodal_loads(truss, case)
    line = np.zeros((0, 3)) if truss.pinned else line_loads(truss, case)
    if calculix:  # whose beams carry no loads along them: those at the ends move nodes alike
        nodal = nodal_loads(truss, replace(case, nodal=None)) + dead_loads(truss, case)[0].reshape(nodal.shape)
        line = line[:0]
    yield "*CLOAD, OP=NEW"
    yield from _loaded(nodal, range(1, 7))
    if len(line):
        yield "*DLOAD, OP=NEW"
        yield from _loaded(line, ("PX", "PY", "PZ"))
    yield from ("*NODE PRINT, NSET=nodes", "U", "*END STEP")


def _loaded(values: np.ndarray, ways: Sequence[str | int]) -> Iterator[str]:
    """Yield a line for each value that is not 0: node or member from 1, way, value."""
    rows, columns = np.nonzero(values)
    named = [ways[k] for k in columns.tolist()]
    return map("%d, %s, %s".__mod__, zip((rows + 1).tolist(), named, _short(values[rows, columns]), strict=True))
