"""The figures of a run: plain values for `--report`, rows for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..boundary.curves import length_around
from ..check.limits import WARN_LEFT_OUT
from ..errors import words_of_count, words_of_number, words_of_place, words_of_share
from ..grid.certificate import near
from ..grid.line_sets import FIXED_LINE, RIDGE, sets_of
from ..kernels.geometry.components import component_labels
from ..scan.checks import usual_extent
from ..scan.cloud import WITHOUT_COORDINATES

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.certificate import Certificate
    from ..grid.grid import Grid
    from ..scan.cloud import PointCloud
    from ..surface.samples import SurfaceSamples


AS_LONG = 2.0 / 3.0  # share of the longest boundary loop of a piece from which another is as likely its outer boundary
MOST_LINES = 6  # lines of a kind that are named one by one
OUTLIERS_WIDEN = 0.05  # share of the extent by which outliers make that of all points larger, from which both are given


def report_of(grid: Grid, points: int) -> dict[str, Any]:
    """Return everything that `--report` saves, as plain values.

    Parameters
    ----------
    grid : Grid
        The result.
    points : int
        Points of the scan that were used.
    """
    return {
        "points": points,
        "nodes": len(grid.nodes),
        "members": len(grid.edges),
        "triangles": len(grid.triangles),
        **({} if grid.panels is None else {"panels": len(grid.panels), "cells": grid.cells}),
        "line_members": len(grid.lines),
        "fixed_lines": sets_of(grid, FIXED_LINE),
        "ridges": sets_of(grid, RIDGE),
        "quality": grid.quality.to_dict(),
        "before": grid.before.to_dict() if grid.before is not None else None,
        "topology": grid.topology.to_dict(),
        "certificate": grid.certificate.to_dict() if grid.certificate is not None else None,
        "seconds": dict(grid.seconds),
        "settings": grid.settings.to_dict() if grid.settings is not None else None,
        "version": __version__,
    }


def count_holes(grid: Grid) -> int:
    """Count the loops that are not the outer boundary of their piece: every piece with a boundary has one."""
    label = component_labels(len(grid.nodes), grid.edges[:, 0], grid.edges[:, 1])
    pieces = {int(label[loop[0]]) for loop in grid.boundary_loops}
    return len(grid.boundary_loops) - len(pieces)


def quality_rows(grid: Grid) -> list[tuple[str, str, str]]:
    """Return the figures of Table 2: name, before, after optimization."""
    rows: tuple[tuple[str, str, str], ...] = (
        ("shape quality, mean", "shape_mean", "{:.4f}"),
        ("shape quality, std", "shape_std", "{:.4f}"),
        ("shape quality, smallest", "shape_min", "{:.3f}"),
        ("member length, mean", "length_mean", "{:.4g}"),
        ("member length, std", "length_std", "{:.3g}"),
        ("length std / mean", "length_cv", "{:.4f}"),
        ("length / desired, mean", "stretch_mean", "{:.4f}"),
        ("the same, std / mean", "stretch_cv", "{:.4f}"),
        ("smallest angle [degree]", "angle_min", "{:.1f}"),
        ("largest angle [degree]", "angle_max", "{:.1f}"),
        ("nodes of six members", "valence6", "{:.0%}"),
    )
    if grid.cells != "triangle":
        rows = (
            *rows[:-1],
            (f"nodes of {'four' if grid.cells == 'quad' else 'three'} members", "regular", "{:.0%}"),
            ("panels off their plane", "planarity_max", "{:.2%}"),
        )
    after, before = grid.quality.to_dict(), grid.before.to_dict() if grid.before is not None else {}
    unit = f" [{grid.unit}]" if grid.unit else ""
    return [
        (
            name + (unit if key.startswith("length_") and key != "length_cv" else ""),
            _said(before[key], form) if key in before else "",
            _said(after[key], form),
        )
        for name, key, form in rows
        if key in after
    ]


def _said(value: float, form: str) -> str:
    """Return a number in a form, one such as "{:.4g}" without a power of ten."""
    return words_of_number(value, int(form[3])) if form.endswith("g}") else form.format(value)


def grid_lines(grid: Grid, points: int) -> list[str]:
    """Return counts, topology, deviation and times in words."""
    topology = grid.topology
    loops = topology.boundary_loops
    lines = [
        f"{len(grid.nodes)} nodes, {len(grid.edges)} members, {len(grid.panel_table)} {grid.panels_are} from {points:,} points",
        f"{topology.components} {'piece' if topology.components == 1 else 'pieces'}, "
        + (f"{loops} boundary {'loop' if loops == 1 else 'loops'}{_holes_in_words(grid)}" if loops else "closed"),
    ]
    lines += line_lines(grid)
    bridging = 0 if grid.deviation is None else len(grid.nodes) - len(grid.measured_deviation)
    if bridging:
        lie = "lies" if bridging == 1 else "lie"
        lines.append(f"{words_of_count(bridging, 'node')} {lie} over closed holes, where the scan has no points")
    if grid.certificate is not None:
        lines += distance_lines(grid.certificate)
        lines += left_out_lines(grid.certificate)
        lines.append(f"certificate: {grid.certificate}")
        lines += warning_lines(grid.certificate)
    if grid.seconds:
        lines.append("seconds: " + ", ".join(f"{stage} {seconds:.2f}" for stage, seconds in grid.seconds.items()))
    return lines


def _holes_in_words(grid: Grid) -> str:
    """Return how many boundary loops are holes; nothing where two of a piece are about the longest, as of a body on four feet."""
    label = component_labels(len(grid.nodes), grid.edges[:, 0], grid.edges[:, 1])
    lengths: dict[int, list[float]] = {}
    for loop in grid.boundary_loops:
        lengths.setdefault(int(label[loop[0]]), []).append(length_around(grid.nodes[loop]))
    if any(sorted(own)[-2] > AS_LONG * max(own) for own in lengths.values() if len(own) > 1):
        return ""
    count = count_holes(grid)
    return ", no hole" if count == 0 else f", {count} of them {'a hole' if count == 1 else 'holes'}"


def line_lines(grid: Grid) -> list[str]:
    """Return how many fixed lines and ridges there are, with their nodes and lengths; that no ridge is there where one was looked for."""
    unit, lines = f" {grid.unit}" if grid.unit else "", []
    for kind in (FIXED_LINE, RIDGE):
        sets = sets_of(grid, kind)
        each = [
            f"{line['name']} of {len(line['nodes'])} nodes, {words_of_number(line['length'], 4)}{unit}"
            for line in sets[:MOST_LINES]
        ]
        each += [f"and {len(sets) - MOST_LINES} more"] * (len(sets) > MOST_LINES)
        if sets:
            total = sum(line["length"] for line in sets)
            count = (
                f"{len(sets)} {kind}{'s' if len(sets) > 1 else ''}, {words_of_number(total, 4)}{unit} in all"
                if len(sets) > 1
                else f"1 {kind}"
            )
            lines.append(f"{count}: {'; '.join(each)}")
    made = grid.settings
    if made is not None and made.ridge_angle > 0.0 and made.method == "default" and not sets_of(grid, RIDGE):
        level, found = 180.0 - made.ridge_angle, grid.certificate
        sharp = found is not None and found.sharpest_fold is not None and found.sharpest_fold.value < level
        lost = found is not None and any(warning.kind in ("lost", "ridge") for warning in found.warnings)
        none = f": no sharp edge is folded to less than {level:g} degrees, 180 is level"
        lines.append("no ridge is followed" if sharp or lost else f"no ridge{none}")
    return lines


def first_line(certificate: Certificate) -> list[str]:
    """Return what a user must know first: that ScanTruss, by its own judgement, left out much of the points or of the surface."""
    sparse = [f"the grid {warning.words}" for warning in certificate.warnings if warning.kind == "sparse"]
    if certificate.judged_out <= WARN_LEFT_OUT:
        return sparse
    own = [part for part in certificate.left_out if part.points and not part.asked and part.kind != "duplicates"]
    kinds = dict.fromkeys(part.words for part in own)
    return [
        f"{certificate.judged_out:.1%} of the scan, {sum(part.points for part in own):,} of {certificate.points:,} points,"
        f" is not in the grid: {'; '.join(kinds)}",
        *sparse,
    ]


def distance_lines(certificate: Certificate) -> list[str]:
    """Return how far scan and grid lie apart, in the scan's unit and in members."""
    unit, member = f" {certificate.unit}" if certificate.unit else "", 2.0 * certificate.reach
    lines = [
        f"{name}: 50 % within {words_of_number(spread.p50, 3)}, 95 % {words_of_number(spread.p95, 3)},"
        f" 99 % {words_of_number(spread.p99, 3)}, all {words_of_number(spread.largest.value, 3)}{unit}"
        f" ({spread.p50 / member:.2g}, {spread.p95 / member:.2g}, {spread.p99 / member:.2g},"
        f" {spread.largest.value / member:.2g} members)"
        for name, spread in (
            ("points to grid", certificate.scan_distance),
            ("triangles to scan", certificate.triangle_distance),
            ("nodes to scan", certificate.node_distance),
        )
        if spread is not None
    ]
    lines[:1] = [line + _of_left_out(certificate) for line in lines[:1]]
    return [*lines, f"points around nodes: {offset_words(certificate)}"]


def _of_left_out(certificate: Certificate) -> str:
    """Return what part of the points that are measured is listed as left out, where the farthest of them is of it; else nothing."""
    of_it, spread = certificate.farthest_listed, certificate.scan_distance
    if of_it is None or spread is None:
        return ""
    share = sum(part.points for part in certificate.left_out if part.farthest is not None) / certificate.points
    return f"; {words_of_share(share)} of them are listed as left out, the farthest among them: {of_it.words}{near(spread.largest.where)}"


def offset_words(certificate: Certificate) -> str:
    """Return how far the points around nodes lie outside of them on the mean, and how far they scatter."""
    unit, member = f" {certificate.unit}" if certificate.unit else "", 2.0 * certificate.reach
    bias, most, scatter = certificate.node_bias, certificate.node_bias_p95, certificate.node_scatter
    return (
        f"bias {bias:+.2g}, 95 % within {words_of_number(most, 2)}, scatter {words_of_number(scatter, 2)}{unit}"
        f" ({bias / member:+.2g}, {most / member:.2g}, {scatter / member:.2g} members)"
    )


def left_out_lines(certificate: Certificate) -> list[str]:
    """Return what the grid does not follow, with counts, places and sizes."""
    unit, lines = f" {certificate.unit}" if certificate.unit else "", []
    for part in certificate.left_out:
        if part.kind == "far" and part.where is not None:  # a warning reports it
            continue
        size = f"{words_of_number(part.size or 0.0, 3)}{unit} {'long' if part.kind == 'limbs' else 'across'}"
        place = "" if part.where is None else f", near ({words_of_place(part.where)}), {size}"
        if part.together is not None and part.where is not None and part.together < part.points:
            some = f"{part.together:,} of them together" if part.together > 1 else "each alone, one"
            place = f", {some} near ({words_of_place(part.where)})" + f", {size}" * (part.together > 1)
        place = f", up to {words_of_number(part.size or 0.0, 3)}{unit} across" if part.number > 1 else place
        count = f"{words_of_count(part.points, 'point')} ({words_of_share(part.share)}) " if part.points else ""
        asked = ", as asked for" if part.asked and part.kind != WITHOUT_COORDINATES else ""
        lines.append(f"left out: {count}{part.words}{place}{asked}" if count else f"{part.words}{place}")
    return lines


def warning_lines(certificate: Certificate) -> list[str]:
    """Return a line for each warning, with its place."""
    return [f"warning: the grid {warning.words}{near(warning.where)}" for warning in certificate.warnings]


def certificate_rows(certificate: Certificate) -> list[tuple[str, str, str]]:
    """Return the worst places of a grid: name, figure, place in the scan's own frame."""
    unit = f" {certificate.unit}" if certificate.unit else ""
    return [
        (name, f"{words_of_number(worst.value, 4)}{' degrees' if of_angle else unit}", words_of_place(worst.where))
        for name, worst, of_angle in certificate.worst_places()
    ]


def cloud_lines(cloud: PointCloud) -> list[str]:
    """Return points, extent, spacing, unit and the range of member lengths, in words."""
    from ..scan.member_length import denser_words, length_range

    low, high = length_range(cloud)
    unit = f" {cloud.unit}" if cloud.unit else ""
    bulk, far = _bulk(cloud)
    extent = " x ".join(words_of_number(side, 4) for side in np.ptp(bulk, axis=0))
    lowest = [f"{value:.10g}" for value in cloud.origin + bulk.min(axis=0)]
    lines = [
        f"points   {len(cloud.points)}"
        + (f" ({cloud.dropped} more left out: NaN or infinite)" if cloud.dropped else ""),
        f"extent   {extent}{unit}, from {' '.join(lowest)}{far}",
        f"spacing  {words_of_number(cloud.spacing, 4)}{unit}",
        f"unit     {cloud.unit or 'not known; give it with --unit mm|cm|m|inch|foot'}",
    ]
    if low > high:
        lines.append(
            f"no length fits: the points need members of at least {low:g}{unit}, and the scan is too small for more than {high:g}"
            f"; {denser_words(cloud)}"
        )
    else:
        lines.append(f"length   {low:g} to {high:g}{unit}")
    return lines


def _bulk(cloud: PointCloud) -> tuple[np.ndarray, str]:
    """Return the points without a few so far away that they are none of the scan, and how many these are, in words."""
    if cloud.usual_extent == cloud.extent:
        return cloud.points, ""
    low, high = usual_extent(cloud.points)
    kept = (np.abs(cloud.points - 0.5 * (low + high)) <= high - low).all(axis=1)
    return cloud.points[kept], f", without {words_of_count(int((~kept).sum()), 'point')} far away"


def surface_lines(cloud: PointCloud, samples: SurfaceSamples) -> list[str]:
    """Return the extent of the surface, in words, where outliers make that of the points larger."""
    sides, of_points = np.ptp(samples.measured_points, axis=0), np.ptp(cloud.points, axis=0)
    if (of_points - sides).max() < OUTLIERS_WIDEN * of_points.max():
        return []
    unit = f" {cloud.unit}" if cloud.unit else ""
    return [f"surface {' x '.join(words_of_number(side, 4) for side in sides)}{unit}, without outliers"]


def loop_rows(boundary: Boundary) -> list[tuple[str, ...]]:
    """Return kind, length and corners of each loop."""
    return [
        ("external" if loop.external else "internal", words_of_number(loop.length, 4), str(len(loop.corners)))
        for loop in boundary.loops
    ]
