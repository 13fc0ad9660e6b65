"""Quality, sides and crossings of triangles and segments (Eqs. 5-9)."""

from __future__ import annotations

import math

from ...runtime.jit import kernel
from .vectors import Vector, across, cross, dot, norm, subtract, unit


@kernel
def shape_quality(a: Vector, b: Vector, c: Vector) -> float:
    """Lo's shape quality phi (Eq. 5, [26]): 4 sqrt(3) area / (sum of squared sides), 1 for a regular triangle, 0 for a flat one."""
    ab, bc, ca = subtract(b, a), subtract(c, b), subtract(a, c)
    total = dot(ab, ab) + dot(bc, bc) + dot(ca, ca)
    if total == 0.0:
        return 0.0
    return 2.0 * math.sqrt(3.0) * norm(cross(ab, ca)) / total


@kernel
def size_quality(length: float, l1: float, l2: float) -> float:
    """Size quality rho (Eq. 6): how close the two new sides, l1 and l2, are to a length."""
    if l1 <= 0.0 or l2 <= 0.0 or length <= 0.0:
        return 0.0
    return min(l1 / length, length / l1) * min(l2 / length, length / l2)


@kernel
def quality(a: Vector, b: Vector, p: Vector, length: float, alpha1: float, alpha2: float) -> float:
    """Quality delta of a triangle on the segment ab (Eq. 5), its new sides compared with `length`."""
    return alpha1 * shape_quality(a, b, p) + alpha2 * size_quality(length, norm(subtract(p, a)), norm(subtract(p, b)))


@kernel
def on_unmeshed_side(a: Vector, b: Vector, p: Vector, normal: Vector) -> bool:
    """Eq. 7 with n the outer normal of the surface: p lies to the left of ab."""
    return dot(cross(subtract(b, a), subtract(p, a)), normal) > 0.0


@kernel
def angle_from(base: Vector, arm: Vector, normal: Vector) -> float:
    """Angle from `base` anticlockwise to `arm` in the plane of a unit normal, 0 to 2 pi."""
    b, a = dot(base, normal), dot(arm, normal)
    angle = math.atan2(dot(cross(base, arm), normal), dot(base, arm) - a * b)
    return angle if angle >= 0.0 else angle + 2.0 * math.pi


@kernel
def onto_tangent_plane(p: Vector, origin: Vector, u: Vector, v: Vector) -> tuple[float, float]:
    """Coordinates of a place in the tangent plane of u and v (Sec. 3.4)."""
    d = subtract(p, origin)
    return dot(d, u), dot(d, v)


@kernel
def _side(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@kernel
def segments_cross(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]
) -> bool:
    """Eqs. 8 and 9: whether the segments ab and cd cross in the plane (touching does not count)."""
    return _side(c, a, b) * _side(d, a, b) < 0.0 and _side(a, c, d) * _side(b, c, d) < 0.0


@kernel
def lines_cross(a: Vector, b: Vector, c: Vector, d: Vector, near: float) -> bool:
    """Eqs. 8 and 9 in space: whether ab and cd cross in the plane parallel to both and half-way between them.

    Lines that pass each other at more than `near` lie on different sheets and do not cross.
    """
    ab, cd = subtract(b, a), subtract(d, c)
    normal = cross(ab, cd)
    size = norm(normal)
    if size <= 1e-9 * norm(ab) * norm(cd) or abs(dot(subtract(c, a), normal)) > near * size:
        return False
    u = unit(ab)
    v = unit(cross(normal, u))
    return segments_cross(
        onto_tangent_plane(a, a, u, v),
        onto_tangent_plane(b, a, u, v),
        onto_tangent_plane(c, a, u, v),
        onto_tangent_plane(d, a, u, v),
    )


@kernel
def inside_triangle(
    p: tuple[float, float], a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]
) -> bool:
    """Whether p lies in the anticlockwise triangle abc or on its sides."""
    return _side(a, b, p) >= 0.0 and _side(b, c, p) >= 0.0 and _side(c, a, p) >= 0.0


@kernel
def share_on_segment(p: Vector, a: Vector, b: Vector) -> float:
    """Share of b in the place of the segment ab that is nearest to p, 0 to 1."""
    ab = subtract(b, a)
    square = dot(ab, ab)
    return min(max(dot(subtract(p, a), ab) / square, 0.0), 1.0) if square > 0.0 else 0.0


@kernel
def distance_to_segment(p: Vector, a: Vector, b: Vector) -> float:
    """Distance of a place from the segment ab."""
    ab, ap = subtract(b, a), subtract(p, a)
    t = share_on_segment(p, a, b)
    return norm((ap[0] - t * ab[0], ap[1] - t * ab[1], ap[2] - t * ab[2]))


@kernel
def across_edge(edge: Vector, arm: Vector) -> Vector:
    """Component of a vector at right angles to an edge; the vector itself if the edge has no length."""
    square = dot(edge, edge)
    t = dot(arm, edge) / square if square > 0.0 else 0.0
    return arm[0] - t * edge[0], arm[1] - t * edge[1], arm[2] - t * edge[2]


@kernel
def distance_to_triangle(p: Vector, a: Vector, b: Vector, c: Vector) -> float:
    """Distance of a place from the triangle abc."""
    ab, ac, ap = subtract(b, a), subtract(c, a), subtract(p, a)
    normal = cross(ab, ac)
    square = dot(normal, normal)
    if square > 0.0:
        second, third = dot(cross(ap, ac), normal), dot(cross(ab, ap), normal)
        if second >= 0.0 and third >= 0.0 and second + third <= square:
            return abs(dot(ap, normal)) / math.sqrt(square)
    return min(distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a))


@kernel
def foot_on_triangle(p: Vector, a: Vector, b: Vector, c: Vector) -> Vector:
    """Shares of the corners in the place of the triangle abc that is nearest to p; they are 0 or more and add up to 1."""
    ab, ac, ap = subtract(b, a), subtract(c, a), subtract(p, a)
    normal = cross(ab, ac)
    square = dot(normal, normal)
    if square > 0.0:
        second, third = dot(cross(ap, ac), normal) / square, dot(cross(ab, ap), normal) / square
        if second >= 0.0 and third >= 0.0 and second + third <= 1.0:
            return 1.0 - second - third, second, third
    t, u, v = share_on_segment(p, a, b), share_on_segment(p, b, c), share_on_segment(p, c, a)
    first, second, third = distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)
    if first <= second and first <= third:
        return 1.0 - t, t, 0.0
    if second <= third:
        return 0.0, 1.0 - u, u
    return v, 0.0, 1.0 - v


@kernel
def turned(direction: Vector, normal: Vector, angle: float) -> Vector:
    """Unit vector in the plane of a unit normal, turned anticlockwise by an angle from a direction."""
    flat = subtract(
        direction,
        (normal[0] * dot(direction, normal), normal[1] * dot(direction, normal), normal[2] * dot(direction, normal)),
    )
    length = norm(flat)
    if length <= 0.0:
        flat, length = across(normal), 1.0
    side = cross(normal, flat)
    c, s = math.cos(angle) / length, math.sin(angle) / length
    return c * flat[0] + s * side[0], c * flat[1] + s * side[1], c * flat[2] + s * side[2]
