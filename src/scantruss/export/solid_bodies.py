"""3MF and STL of a structure as it is built: every member between its balls, and the balls, each a closed surface of its own.

One solid for a printer, at a scale and with members thick enough, is made by `scantruss print` instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

import numpy as np

from .. import __version__
from ..errors import FormatError
from .bodies import Bodies, bodies_of
from .model import Model
from .outlines import ball_of, outlines_of, prism_of
from .solid_files import MODEL, OBJECT, encode_package, stl_of_corners
from .style import FileStyle
from .workbook import NOT_IN_XML

MILLIMETRES = 1e3  #: in a metre; programs take the numbers of STL for millimetres

Shape = tuple[np.ndarray, np.ndarray]  # vertices, triangles


def encode_3mf_bodies(model: Model, style: FileStyle) -> bytes:
    """Return a 3MF package in metres relative to the origin: an object for each member and node, named by its mark."""
    bodies = _bodies(model, style, "3MF")
    shapes = _shapes(bodies)
    objects = [
        OBJECT.format(
            number=number,
            name="shape",
            vertices="\n".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in vertices.tolist()),
            triangles="\n".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in triangles.tolist()),
        )
        for number, (vertices, triangles) in enumerate(shapes, 1)
    ]
    items = []
    for number, (mark, shape, frame) in enumerate(_placed_parts(model, bodies), len(shapes) + 1):
        words = " ".join(map(repr, frame.ravel().tolist()))
        objects.append(
            f'<object id="{number}" name={quoteattr(NOT_IN_XML.sub("?", mark))} type="model"><components>'
            f'<component objectid="{shape + 1}" transform="{words}"/></components></object>'
        )
        items.append(f'<item objectid="{number}"/>')
    return encode_package(
        MODEL.format(unit="meter", version=__version__, objects="\n".join(objects), items="".join(items))
    )


def encode_stl_bodies(model: Model, style: FileStyle) -> bytes:
    """Return a binary STL file in millimetres relative to the origin."""
    bodies = _bodies(model, style, "STL")
    shapes = _shapes(bodies)
    return stl_of_corners(
        (
            ((shapes[shape][0] @ frame[:3] + frame[3]) * MILLIMETRES)[shapes[shape][1]].astype(np.float32)
            for _, shape, frame in _placed_parts(model, bodies)
        ),
        "mm",
    )


def _bodies(model: Model, style: FileStyle, name: str) -> Bodies:
    bodies = bodies_of(model, style)
    if bodies is None or not len(model.members):
        raise FormatError(f"{name} holds bodies, and the members of a grid have no thickness; give --tube")
    return bodies


def _shapes(bodies: Bodies) -> list[Shape]:
    """Return the shapes of which all parts are made: a member of length 1 for each section, and a ball."""
    return [
        *(prism_of(outlines_of(section)) for section in bodies.sections),
        *([ball_of(bodies.ball)] if bodies.ball else []),
    ]


def _placed_parts(model: Model, bodies: Bodies) -> Iterator[tuple[str, int, np.ndarray]]:
    """Yield the mark of each part, the number of its shape, and its (4, 3) frame: rows for x, y, z and the place [m]."""
    nodes = model.local * model.metres
    frames = np.concatenate([bodies.axes, np.zeros((len(bodies.axes), 1, 3))], axis=1)
    frames[:, 3] = nodes[model.members[:, 0]] + bodies.axes[:, 0] * bodies.inset[:, None]
    frames[:, 0] *= bodies.lengths[:, None]
    yield from zip(model.member_marks, bodies.section_of.tolist(), frames, strict=True)
    if bodies.ball:
        for mark, place in zip(model.node_marks, nodes, strict=True):
            yield mark, len(bodies.sections), np.vstack([np.eye(3), place])
