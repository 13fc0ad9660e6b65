"""Abaqus' input files: cubic beams (B33), of a pinned structure trusses (T3D2), with a linear perturbation step for each load case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..errors import FormatError
from ..runtime.ours import MARK
from .model import Model, line_loads, nodal_loads
from .style import FileStyle

if TYPE_CHECKING:
    from ..structure.truss import LoadCase, Truss

PER_LINE = 16  #: numbers in a line of a set


def encode_inp(model: Model, style: FileStyle) -> bytes:
    """Return the input file of a structure in m, N and kg, in the frame of the scan."""
    truss = model.truss
    if truss is None:
        raise FormatError("Abaqus holds structures; make one of the grid with scantruss structure")
    ends = truss.end_stiffness
    if not truss.pinned and (np.isfinite(ends) & (ends > 0)).any():
        raise FormatError(
            "Abaqus input holds no springs at the ends of members; use --joints rigid or pinned, or another format"
        )
    return ("\n".join(_lines(model, truss)) + "\n").encode("utf-8")


def _plain(words: str) -> str:
    return "".join(letter if letter.isprintable() and letter not in ',*="' else " " for letter in words)


def _set(kind: str, name: str, numbers: np.ndarray) -> Iterator[str]:
    """Yield a set of elements or nodes, counted from 1."""
    if len(numbers):
        yield f'*{kind}, {kind}="{_plain(name)}"'
        for start in range(0, len(numbers), PER_LINE):
            yield ", ".join(map(str, (numbers[start : start + PER_LINE] + 1).tolist()))


def _lines(model: Model, truss: Truss) -> Iterator[str]:
    yield "*HEADING"
    yield f"{MARK}; m N kg; nodes and members are counted from 1 in the order of their marks"
    for each in truss.combinations:
        yield f"** combination {_plain(each.name)}: {' + '.join(f'{factor:g} {_plain(case)}' for case, factor in each.factors)}"
    yield "*NODE, NSET=nodes"
    yield from (f"{number}, {x!r}, {y!r}, {z!r}" for number, (x, y, z) in enumerate(model.nodes.tolist(), 1))
    yield f"*ELEMENT, TYPE={'T3D2' if truss.pinned else 'B33'}, ELSET=members"
    yield from (f"{number}, {start + 1}, {end + 1}" for number, (start, end) in enumerate(truss.members.tolist(), 1))
    for number, name in enumerate(model.groups):
        yield from _set("ELSET", f"group {name}", np.flatnonzero(model.group_of == number))
    yield from _set("NSET", "supports", model.supported)
    yield from _sections(truss)
    supports = truss.supports[:, :3] if truss.pinned else truss.supports
    yield "*BOUNDARY"
    yield from (f"{node + 1}, {way + 1}, {way + 1}" for node, way in np.argwhere(np.isinf(supports)).tolist())
    number = len(truss.members)
    for node, way in np.argwhere(np.isfinite(supports) & (supports > 0)).tolist():
        number += 1
        yield from (f"*ELEMENT, TYPE=SPRING1, ELSET=spring{number}", f"{number}, {node + 1}")
        yield from (f"*SPRING, ELSET=spring{number}", f"{way + 1}", repr(float(supports[node, way])))
    for case in truss.cases:
        yield from _step(truss, case)


def _sections(truss: Truss) -> Iterator[str]:
    material, y = truss.material, truss.axes[:, 1].tolist()
    if truss.pinned:
        yield from (
            "*MATERIAL, NAME=material",
            "*ELASTIC",
            f"{material.young!r}, {material.young / (2 * material.shear) - 1!r}",
        )
        yield from ("*DENSITY", f"{material.density!r}")
        for number, each in enumerate(truss.sections):
            own = np.flatnonzero(truss.section_of == number)
            yield from _set("ELSET", f"section {each.name}", own)
            if len(own):
                yield from (f'*SOLID SECTION, ELSET="section {_plain(each.name)}", MATERIAL=material', repr(each.area))
        return
    forms = [
        f"*ELSET, ELSET=member%d\n%d\n*BEAM GENERAL SECTION, SECTION=GENERAL, ELSET=member%d, DENSITY={material.density!r}\n"
        f"{own.area!r}, {own.inertia_y!r}, 0.0, {own.inertia_z!r}, {own.torsion!r}\n"
        f"%r, %r, %r\n{material.young!r}, {material.shear!r}"  # axis 1; axis 2 is z then
        for own in truss.sections
    ]
    for number, (section, axis) in enumerate(zip(truss.section_of.tolist(), y, strict=True), 1):
        yield forms[section] % (number, number, number, *axis)
    loose = np.argwhere(truss.end_stiffness == 0).tolist()
    if loose:
        yield "*RELEASE"
        yield from (f"{member + 1}, S{end + 1}, M{axis + 1}" for member, end, axis in loose)


def _step(truss: Truss, case: LoadCase) -> Iterator[str]:
    yield f'*STEP, NAME="{_plain(case.name)}", PERTURBATION'
    yield "*STATIC"
    if case.settlement is not None:
        yield "*BOUNDARY, OP=MOD"
        moved = np.argwhere(~np.isnan(case.settlement)).tolist()
        yield from (f"{node + 1}, {way + 1}, {way + 1}, {float(case.settlement[node, way])!r}" for node, way in moved)
    nodal = nodal_loads(truss, case)
    if nodal.any():
        yield "*CLOAD"
        yield from _loaded(nodal, range(1, 7))
    line = np.zeros((0, 3)) if truss.pinned else line_loads(truss, case)
    if line.any():
        yield "*DLOAD"
        yield from _loaded(line, ("PX", "PY", "PZ"))
    yield from ("*NODE PRINT", "U", "*END STEP")


def _loaded(values: np.ndarray, ways: Sequence[str | int]) -> Iterator[str]:
    """Yield a line for each value that is not 0: node or member from 1, way, value."""
    rows, columns = np.nonzero(values)
    named = [ways[k] for k in columns.tolist()]
    return map("%d, %s, %r".__mod__, zip((rows + 1).tolist(), named, values[rows, columns].tolist(), strict=True))
