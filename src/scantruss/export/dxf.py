"""DXF by ezdxf: a line for each member, a face for each panel, a block with its mark for each node, on layers by group.

Nothing lies on layer 0, which some programs do not import. The mark of a line or face is its extended data and, on layers that
can be switched off, a text.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..runtime.ours import MADE_BY
from .bodies import bodies_of
from .model import Model
from .style import FileStyle

if TYPE_CHECKING:
    from ezdxf.layouts import BlockLayout

INSUNITS = {"": 0, "inch": 1, "foot": 2, "mm": 4, "cm": 5, "m": 6}  #: values of that header
NOT_IN_NAMES = re.compile(r"[<>/\\\":;?*|=`,\x00-\x1f]")  #: of layers
DXF_COLOURS = {"boundary": 5, "inner": 7}  #: of the layers of members; 3 for lines
APPLICATION = "SCANTRUSS"  #: of the extended data
BALL_SYMBOL = 0.03  #: radius of a ball whose diameter is not known, in mean member lengths
TEXT = 0.06  #: height of the marks, in mean member lengths


def encode_dxf(model: Model, style: FileStyle) -> bytes:
    """Return a DXF file of version 2010 in the unit and the frame of the scan."""
    import ezdxf
    from ezdxf import options

    kept = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True  # no dates, no random identifiers
    try:
        drawing = ezdxf.new("R2010")
        drawing.header["$INSUNITS"] = INSUNITS[model.unit]
        drawing.header["$MEASUREMENT"] = 0 if model.unit in ("inch", "foot") else 1
        drawing.appids.add(APPLICATION)
        for name, colour in _layers(model).items():
            drawing.layers.add(name, color=colour)
        mean = float(model.lengths.mean()) if len(model.lengths) else 1.0
        known = bodies_of(model, style) if model.truss is not None or style.tube is not None else None
        radius = known.ball / model.metres if known is not None and known.ball else BALL_SYMBOL * mean
        _ball(drawing.blocks.new("NODE"))
        _support(drawing.blocks.new("SUPPORT"))
        first = int(str(drawing.entitydb.handles), 16) + 1
        entities = _Entities(first, drawing.modelspace().layout_key)
        _draw(model, entities, radius, mean)
        drawing.entitydb.handles.reset(f"{entities.next:X}")
        for kind in sorted(
            drawing.entitydb.dxf_types_in_use()
        ):  # ezdxf takes them from a set, in another order each time
            drawing.classes.add_class(kind)
        text = io.StringIO()
        drawing.write(text)
    finally:
        options.write_fixed_meta_data_for_testing = kept
    head, mark, tail = text.getvalue().partition("SECTION\n  2\nENTITIES\n")
    return "".join([f"999\n{MADE_BY}\n", head, mark, *entities.lines, tail]).encode("utf-8", "replace")


class _Entities:
    """The text of the entities of the model space: ezdxf takes ten times as long for them."""

    def __init__(self, first: int, owner: str) -> None:
        self.next, self.owner = first, owner
        self.lines: list[str] = []

    def add(self, form: str, rows: Iterable[tuple[Any, ...]], count: int) -> None:
        """Add `count` rows of entities, each by a form of `_entity` whose %X are handles in a row."""
        self.lines += [form % row for row in rows]
        self.next += count

    def insert(
        self, block: str, layer: str, places: np.ndarray, size: float, words: dict[str, tuple[list[str], str]]
    ) -> None:
        """Add copies of a block at (K, 3) places with attributes, each K texts and their layer; none of them hidden."""
        count = len(words) + 2
        scale = f" 41\n{size}\n 42\n{size}\n 43\n{size}\n"
        form = _entity("INSERT", layer, self.owner, f"100\nAcDbBlockReference\n 66\n1\n  2\n{block}\n{AT}{scale}")
        columns = [_handles(self.next, count, len(places)), *places.T.tolist()]
        for number, (tag, (texts, where)) in enumerate(words.items()):  # each below the one before
            body = f"100\nAcDbText\n{AT} 40\n{size}\n  1\n%s\n100\nAcDbAttribute\n  2\n{tag}\n 70\n0\n"
            form += _entity("ATTRIB", where, "%X", body)
            moved = places + [size, size * (1 - 1.5 * number), 0.0]
            columns += [_handles(self.next + 1 + number, count, len(places)), columns[0], *moved.T.tolist(), texts]
        form += _entity("SEQEND", layer, "%X", "")
        columns += [_handles(self.next + count - 1, count, len(places)), columns[0]]
        self.add(form, zip(*columns, strict=True), count * len(places))


AT = " 10\n%r\n 20\n%r\n 30\n%r\n"  #: form of a place


def _entity(kind: str, layer: str, owner: str, body: str) -> str:
    """Return the form of an entity: its handle, then what the layer, the owner and the body hold."""
    return f"  0\n{kind}\n  5\n%X\n330\n{owner}\n100\nAcDbEntity\n  8\n{layer}\n{body}"


def _handles(first: int, step: int, count: int) -> range:
    return range(first, first + step * count, step)


def _draw(model: Model, to: _Entities, radius: float, mean: float) -> None:
    nodes = model.nodes
    texts = [tuple(map(repr, place)) for place in nodes.tolist()]
    corners = [[f" 1{k}\n{x}\n 2{k}\n{y}\n 3{k}\n{z}\n" for x, y, z in texts] for k in range(4)]
    start, end = model.members.T.tolist()
    marks, count = [_one_line(mark) for mark in model.member_marks], len(model.members)
    marked = f"1001\n{APPLICATION}\n1000\n%s\n"
    line = _entity("LINE", "%s", to.owner, f"100\nAcDbLine\n%s%s{marked}")
    text = _entity(
        "TEXT", "marks members", to.owner, f"100\nAcDbText\n{AT} 40\n{TEXT * mean}\n  1\n%s\n100\nAcDbText\n"
    )
    columns = (
        _handles(to.next, 2, count), layers_of_members(model), [corners[0][k] for k in start], [corners[1][k] for k in end],
        marks, _handles(to.next + 1, 2, count), *nodes[model.members].mean(axis=1).T.tolist(), marks,
    )  # fmt: skip
    to.add(line + text, zip(*columns, strict=True), 2 * count)
    faces: list[tuple[Any, ...]] = []
    for mark, loop in zip(map(_one_line, model.panel_marks), model.panel_loops, strict=True):
        for begin in range(
            1, len(loop) - 2 + len(loop) % 2, 2
        ):  # a face has four corners at most: more are a fan of faces
            a, b, c, d = loop[0], loop[begin], loop[begin + 1], loop[min(begin + 2, len(loop) - 1)]
            hidden = 1 * (begin > 1) + 8 * (begin + 2 < len(loop) - 1)
            places = corners[0][a] + corners[1][b] + corners[2][c] + corners[3][d]
            faces.append((to.next + len(faces), places, f" 70\n{hidden}\n" * bool(hidden), mark))
    to.add(_entity("3DFACE", "panels", to.owner, f"100\nAcDbFace\n%s%s{marked}"), faces, len(faces))
    marks = [_one_line(mark) for mark in model.node_marks]
    to.insert("NODE", "nodes", nodes, radius, {"MARK": (marks, "marks nodes")})
    held = model.supported.tolist()
    words = {
        "MARK": ([marks[node] for node in held], "supports"),
        "HELD": ([held_words(model, node) for node in held], "supports"),
    }
    to.insert("SUPPORT", "supports", nodes[model.supported], 2 * radius, words)


def _one_line(word: str) -> str:
    """Return a word that ends no line of the file."""
    return word if word.isprintable() else " ".join(word.split())


def held_words(model: Model, node: int) -> str:
    """Return how a node is held, such as "ux uy uz", with stiffnesses [N/m, Nm/rad] of springs."""
    if model.truss is None:
        return "fixed node"
    ways = zip(["ux", "uy", "uz", "rx", "ry", "rz"], model.truss.supports[node].tolist(), strict=True)
    return " ".join(name if np.isinf(value) else f"{name}={value:g}" for name, value in ways if value)


def layers_of_members(model: Model) -> list[str]:
    """Return the layer of each member: its group, and its section where there are several."""
    groups = [layer_name(f"members {name}") for name in model.groups]
    if model.truss is None or len(model.truss.sections) == 1:
        return [groups[k] for k in model.group_of.tolist()]
    both = zip(model.group_of.tolist(), model.truss.section_of.tolist(), strict=True)
    return [layer_name(f"{groups[k]} {model.truss.sections[s].name}") for k, s in both]


def layer_name(words: str) -> str:
    """Return words without what a name of a layer cannot hold."""
    return NOT_IN_NAMES.sub("_", words)[:255]


def _layers(model: Model) -> dict[str, int]:
    """Return the layers with their colours."""
    members = dict.fromkeys(layers_of_members(model))
    colours = {name: next((c for word, c in DXF_COLOURS.items() if f" {word}" in name), 3) for name in members}
    return colours | {"panels": 9, "nodes": 1, "supports": 6, "marks members": 8, "marks nodes": 8}


def _ball(block: BlockLayout) -> None:
    """Draw a ball of radius 1, of triangles."""
    from ezdxf.render.forms import sphere

    ball = sphere(12, 6, radius=1.0)
    ball.render_polyface(block, {"layer": "nodes"})
    block.add_attdef("MARK", (1.0, 1.0, 0.0), dxfattribs={"layer": "marks nodes", "height": 1.0})


def _support(block: BlockLayout) -> None:
    """Draw a pyramid with its tip at the node."""
    corners = [(-0.5, -0.5, -1.0), (0.5, -0.5, -1.0), (0.5, 0.5, -1.0), (-0.5, 0.5, -1.0)]
    for one, other in zip(corners, corners[1:] + corners[:1], strict=True):
        block.add_3dface([(0.0, 0.0, 0.0), one, other], {"layer": "supports"})
    for tag in ("MARK", "HELD"):
        block.add_attdef(tag, (0.0, 0.0, -1.0), dxfattribs={"layer": "supports", "height": 0.3, "invisible": 1})
