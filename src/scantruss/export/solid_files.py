"""Files for 3D printers: 3MF, which carries the unit, and binary STL.

Readers of these files keep coordinates as float32, and those of STL know which vertices are one only by equal
coordinates. Some vertices of a union lie so near to each other that rounding would weld them and tear the surface open. All
vertices are therefore put on a lattice that float32 holds exactly, and those that coincide are moved apart by a step or two of
it.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .. import __version__
from ..errors import FormatError

#: 3MF's words for our units; millimeter where it is not known
UNIT_NAMES = {"mm": "millimeter", "cm": "centimeter", "m": "meter", "inch": "inch", "foot": "foot"}
STL_TRIANGLE = np.dtype(
    [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
)  #: of a binary STL file
ROUNDS_OF_MOVING = 32  #: of moving apart

CONTENT_TYPES = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"""
RELATIONS = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""
MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<model unit="{unit}" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<metadata name="Application">ScanTruss {version}</metadata>
<resources>
{objects}
</resources>
<build>{items}</build>
</model>
"""
OBJECT = """<object id="{number}" name="{name}" type="model"><mesh>
<vertices>
{vertices}
</vertices>
<triangles>
{triangles}
</triangles>
</mesh></object>"""


@dataclass(frozen=True, eq=False)
class Solid:
    """The closed surface around the members and nodes of a grid."""

    vertices: np.ndarray  #: (N, 3) float64 [printed unit], relative to the grid's origin
    triangles: np.ndarray  #: (M, 3) int64, anticlockwise seen from outside
    unit: str  #: unit of the grid, "" if it is not known
    volume: float  #: [printed unit cubed]
    components: int  #: bodies that do not touch
    genus: int  #: openings one could pull a thread through, of all components together
    expected_components: int  #: pieces of the grid
    expected_genus: int  #: E - V + 1 summed over the pieces of the grid

    @property
    def notes(self) -> list[str]:
        """What a user should know about it; empty if the solid keeps every opening of the grid."""
        lines = []
        if self.components < self.expected_components:
            lines.append(f"pieces of the grid touch: {self.expected_components} pieces became {self.components} bodies")
        if (lost := self.expected_genus - self.genus) != 0:
            what = f"{abs(lost)} of {self.expected_genus} openings are {'closed' if lost > 0 else 'added'}"
            lines.append(f"{what} where parts touch; thinner members and nodes keep the openings of the grid")
        return lines


def lattice_step(vertices: np.ndarray) -> float:
    """Return the step of a lattice around 0 whose points float32 holds exactly [printed unit].

    A power of two, 2^-22 of the size; not below 2^-25, as some readers weld what is nearer than 1e-8 whatever the unit.
    """
    size = 2.0 ** math.ceil(math.log2(max(float(np.abs(vertices).max()), 1e-30)))
    return max(size * 2.0**-22, min(2.0**-25, size * 2.0**-16))


def put_on_lattice(solid: Solid, rounds: int = ROUNDS_OF_MOVING) -> tuple[np.ndarray, int]:
    """Return the vertices on the lattice, each at a place of its own, and how many are still at another's place.

    Parameters
    ----------
    solid : what to write
    rounds : how often those that coincide are moved apart

    Returns
    -------
    vertices : np.ndarray
        (N, 3) float32 [printed unit].
    together : int
        Vertices that still coincide with another one; 0 if it worked.
    """
    step = lattice_step(solid.vertices)
    cell = np.rint(solid.vertices / step).astype(np.int64)
    inward = None
    for turn in range(rounds + 1):
        late = _later_ones(cell)
        if len(late) == 0 or turn == rounds:
            return (cell * step).astype(np.float32), len(late)
        inward = -_vertex_normals(solid) if inward is None else inward
        shift = np.rint(inward[late] * (turn + 1)).astype(np.int64)
        shift[:, 0] += (shift == 0).all(axis=1)
        cell[late] += shift
    raise AssertionError


def _later_ones(cell: np.ndarray) -> np.ndarray:
    """Return the ids of the rows that an earlier row equals."""
    order = np.lexsort((np.arange(len(cell)), *cell.T))
    same = (cell[order[1:]] == cell[order[:-1]]).all(axis=1)
    return np.sort(order[1:][same])


def _vertex_normals(solid: Solid) -> np.ndarray:
    """Return (N, 3) unit normals pointing out of the solid; zero where there is none."""
    a, b, c = solid.vertices[solid.triangles.T]
    normal = np.cross(b - a, c - a)
    total = np.zeros_like(solid.vertices)
    for corner in solid.triangles.T:
        for axis in range(3):
            total[:, axis] += np.bincount(corner, normal[:, axis], len(total))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    normals: np.ndarray = np.divide(total, length, out=np.zeros_like(total), where=length > 0)
    return normals


def encode_3mf(*solids: Solid, names: Sequence[str] = ("grid truss",)) -> bytes:
    """Return a 3MF package with an object for each solid; the unit is theirs, millimetre where it is not known. No dates, no random ids."""
    objects = []
    for number, (solid, name) in enumerate(zip(solids, names, strict=True), 1):
        vertices, _ = put_on_lattice(solid)
        objects.append(
            OBJECT.format(
                number=number,
                name=name,
                vertices="\n".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in vertices.tolist()),
                triangles="\n".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in solid.triangles.tolist()),
            )
        )
    model = MODEL.format(
        unit=UNIT_NAMES.get(solids[0].unit, "millimeter"),
        version=__version__,
        objects="\n".join(objects),
        items="".join(f'<item objectid="{number + 1}"/>' for number in range(len(solids))),
    )
    return encode_package(model)


def encode_package(model: str) -> bytes:
    """Return the package of a model in the XML of 3MF."""
    parts = {"[Content_Types].xml": CONTENT_TYPES, "_rels/.rels": RELATIONS, "3D/3dmodel.model": model}
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as package:
        for name, text in parts.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            entry.create_system = 3
            package.writestr(entry, text.encode("utf-8"))
    return stream.getvalue()


def encode_stl(solid: Solid) -> bytes:
    """Return a binary STL file; watertight after welding equal coordinates, or refused.

    Raises
    ------
    FormatError
        Some vertices are the same in float32.
    """
    vertices, together = put_on_lattice(solid)
    if together:
        raise FormatError(f"STL cannot hold this solid: {together} vertices coincide in float32; write a .3mf instead")
    return stl_of_corners([vertices[solid.triangles]], solid.unit)


def stl_of_corners(parts: Iterable[np.ndarray], unit: str) -> bytes:
    """Return the binary STL file of triangles by their corners (T, 3, 3) float32, part by part so that memory holds them once."""
    tables = [_stl_table(corners) for corners in parts]
    header = f"ScanTruss {__version__}, unit: {unit or 'not known'}".encode("ascii").ljust(80)
    count = sum(map(len, tables)) // STL_TRIANGLE.itemsize
    return b"".join([header, count.to_bytes(4, "little"), *tables])


def _stl_table(corners: np.ndarray) -> bytes:
    wide = corners.astype(np.float64)
    normal = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    table = np.zeros(len(corners), STL_TRIANGLE)
    table["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    table["corners"] = corners
    return table.tobytes()
