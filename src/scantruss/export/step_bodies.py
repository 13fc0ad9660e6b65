"""Bodies in STEP: members and balls as solids bounded by planes, cylinders and spheres (advanced boundary representation)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .bodies import Bodies
from .model import Model
from .outlines import Outline, Side, outlines_of
from .part21 import Part21, Ref, Word

ALONG_EDGE, AGAINST_EDGE = Word(".T."), Word(".F.")

Edge = tuple[Ref, Word]  # an edge, and whether a loop follows it as it runs


@dataclass(frozen=True, eq=False)
class MemberFrame:
    """Where a member lies: its start, its axes, its length [m]."""

    start: np.ndarray  #: (3,)
    axes: np.ndarray  #: (3, 3) rows along, y, z
    length: float
    directions: tuple[Ref, Ref, Ref]  #: the axes in the file

    def at(self, place: tuple[float, float], end: int) -> tuple[float, float, float]:
        """Return a place of the section at the start (0) or the end (1) of the member."""
        x, y, z = (self.start + self.axes.T @ np.array([end * self.length, *place])).tolist()
        return x, y, z


def add_bodies(file: Part21, model: Model, bodies: Bodies) -> tuple[list[Ref], list[Ref]]:
    """Add the solids of members and of balls, named by their marks, relative to the origin [m]; return both."""
    nodes = model.local * model.metres
    outlines = [outlines_of(section) for section in bodies.sections]
    starts = nodes[model.members[:, 0]] + bodies.axes[:, 0] * bodies.inset[:, None]
    members = []
    for number, mark in enumerate(model.member_marks):
        axes = bodies.axes[number]
        along, y, z = (file.add("DIRECTION", "", axis) for axis in axes.tolist())
        frame = MemberFrame(starts[number], axes, float(bodies.lengths[number]), (along, y, z))
        members.append(_member(file, mark, frame, outlines[bodies.section_of[number]]))
    if not bodies.ball:
        return members, []
    up, x = file.add("DIRECTION", "", (0.0, 0.0, 1.0)), file.add("DIRECTION", "", (1.0, 0.0, 0.0))
    return members, [
        _ball(file, mark, place, bodies.ball, up, x) for mark, place in zip(model.node_marks, nodes, strict=True)
    ]


def _member(file: Part21, mark: str, frame: MemberFrame, outlines: tuple[Outline, ...]) -> Ref:
    faces: list[Ref] = []
    starts, ends = list[list[Edge]](), list[list[Edge]]()
    for number, outline in enumerate(outlines):
        first, last, sides = _mantle(file, frame, outline, outward=number == 0)
        starts.append(first)
        ends.append(last)
        faces += sides
    along, y, _ = frame.directions
    for end, loops in enumerate((starts, ends)):
        middle = file.add("CARTESIAN_POINT", "", frame.at((0.0, 0.0), end))
        plane = file.add("PLANE", "", file.add("AXIS2_PLACEMENT_3D", "", middle, along, y))
        bounds = [
            file.add("FACE_OUTER_BOUND" if k == 0 else "FACE_BOUND", "", _loop(file, _turned(loop, (k == 0) != (end == 1))), ALONG_EDGE)
            for k, loop in enumerate(loops)
        ]  # fmt: skip
        faces.append(file.add("ADVANCED_FACE", "", bounds, plane, ALONG_EDGE if end else AGAINST_EDGE))
    return file.add("MANIFOLD_SOLID_BREP", mark, file.add("CLOSED_SHELL", "", faces))


def _mantle(
    file: Part21, frame: MemberFrame, outline: Outline, outward: bool
) -> tuple[list[Edge], list[Edge], list[Ref]]:
    """Add the faces along a member; return the edges at its start, at its end, and the faces.

    Faces of the outer outline look outward, those of an opening into it.
    """
    count = len(outline)
    corners = [[file.add("CARTESIAN_POINT", "", frame.at(side.start, end)) for side in outline] for end in (0, 1)]
    vertices = [[file.add("VERTEX_POINT", "", point) for point in points] for points in corners]
    vector = file.add("VECTOR", "", frame.directions[0], frame.length)
    uprights = [
        file.add(
            "EDGE_CURVE", "", vertices[0][k], vertices[1][k], file.add("LINE", "", corners[0][k], vector), ALONG_EDGE
        )
        for k in range(count)
    ]
    rings: list[list[Ref]] = [[], []]
    faces = []
    for k, side in enumerate(outline):
        following = (k + 1) % count
        for end in (0, 1):
            curve, runs = _curve(file, frame, side, outline[following], corners[end][k], end)
            rings[end].append(file.add("EDGE_CURVE", "", vertices[end][k], vertices[end][following], curve, runs))
        around: list[Edge] = [
            (rings[0][k], ALONG_EDGE), (uprights[following], ALONG_EDGE), (rings[1][k], AGAINST_EDGE), (uprights[k], AGAINST_EDGE),
        ]  # fmt: skip
        surface, sense = _surface(file, frame, side, outline[following], corners[0][k])
        loop = _loop(file, around if outward else _turned(around, True))
        bound = file.add("FACE_OUTER_BOUND", "", loop, ALONG_EDGE)
        faces.append(file.add("ADVANCED_FACE", "", (bound,), surface, ALONG_EDGE if sense == outward else AGAINST_EDGE))
    first: list[Edge] = [(edge, ALONG_EDGE) for edge in rings[0]]
    last: list[Edge] = [(edge, ALONG_EDGE) for edge in rings[1]]
    return first, last, faces


def _curve(file: Part21, frame: MemberFrame, side: Side, following: Side, corner: Ref, end: int) -> tuple[Ref, Word]:
    """Add the line or circle of a side at one end; return it, and whether the side runs along it."""
    if side.centre is None:
        step = np.subtract(following.start, side.start)
        length = float(np.hypot(*step))
        direction = file.add("DIRECTION", "", (frame.axes[1:].T @ (step / length)).tolist())
        return file.add("LINE", "", corner, file.add("VECTOR", "", direction, length)), ALONG_EDGE
    along, y, _ = frame.directions
    centre = file.add("CARTESIAN_POINT", "", frame.at(side.centre, end))
    radius = float(np.hypot(*np.subtract(side.start, side.centre)))
    circle = file.add("CIRCLE", "", file.add("AXIS2_PLACEMENT_3D", "", centre, along, y), radius)
    return circle, ALONG_EDGE if side.turns_left else AGAINST_EDGE


def _surface(file: Part21, frame: MemberFrame, side: Side, following: Side, corner: Ref) -> tuple[Ref, bool]:
    """Add the surface of a side; return it, and whether its normal points to the right of the side, out of the outline."""
    along, y, _ = frame.directions
    if side.centre is not None:
        centre = file.add("CARTESIAN_POINT", "", frame.at(side.centre, 0))
        radius = float(np.hypot(*np.subtract(side.start, side.centre)))
        place = file.add("AXIS2_PLACEMENT_3D", "", centre, along, y)
        return file.add("CYLINDRICAL_SURFACE", "", place, radius), side.turns_left
    step = np.subtract(following.start, side.start)
    step = step / np.hypot(*step)
    right = file.add("DIRECTION", "", (frame.axes[1:].T @ np.array([step[1], -step[0]])).tolist())
    return file.add("PLANE", "", file.add("AXIS2_PLACEMENT_3D", "", corner, right, along)), True


def _loop(file: Part21, edges: list[Edge]) -> Ref:
    return file.add("EDGE_LOOP", "", [file.add("ORIENTED_EDGE", "", Word("*"), Word("*"), *each) for each in edges])


def _turned(edges: list[Edge], turn: bool) -> list[Edge]:
    """Return a loop, or the same loop the other way round."""
    if not turn:
        return edges
    return [(edge, AGAINST_EDGE if way == ALONG_EDGE else ALONG_EDGE) for edge, way in reversed(edges)]


def _ball(file: Part21, mark: str, place: np.ndarray, radius: float, up: Ref, x: Ref) -> Ref:
    """Add a ball of two halves, which meet in a circle."""
    frame = file.add("AXIS2_PLACEMENT_3D", "", file.add("CARTESIAN_POINT", "", place.tolist()), up, x)
    vertex = file.add("VERTEX_POINT", "", file.add("CARTESIAN_POINT", "", (place + [radius, 0.0, 0.0]).tolist()))
    edge = file.add("EDGE_CURVE", "", vertex, vertex, file.add("CIRCLE", "", frame, radius), ALONG_EDGE)
    sphere = file.add("SPHERICAL_SURFACE", "", frame, radius)
    halves = [
        file.add("ADVANCED_FACE", "", (file.add("FACE_OUTER_BOUND", "", _loop(file, [(edge, way)]), ALONG_EDGE),), sphere, ALONG_EDGE)
        for way in (ALONG_EDGE, AGAINST_EDGE)
    ]  # fmt: skip
    return file.add("MANIFOLD_SOLID_BREP", mark, file.add("CLOSED_SHELL", "", halves))
