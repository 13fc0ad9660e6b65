"""How the certificate of a grid is made.

A grid that does not pass is refused by `pipeline`: rather no result than a wrong one that looks right.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..grid.certificate import Certificate, Fault, Spread, Worst, place_of
from ..runtime.parallel import side_by_side
from ..surface.chosen_samples import KEPT, LIMB, OUTLIER, SLIT
from .bare import mostly_bare
from .boundaries import places_aside, stops_short
from .crossings import find_crossings
from .crushed import crushed_parts, frayed, spikes
from .defects import faults_in_space, faults_of_topology, fixed_off_scan
from .distances import Distances, measure_distances, offsets_from_points
from .doubtful import doubtful_places
from .folds import fold_angles
from .gaps import bridged_gaps, openings_closed
from .handles import false_handles
from .hanging import hanging_nodes, nodes_off_sheets
from .irregular import count_irregular
from .joined import parts_joined
from .left_out import asked_for, closed_holes, first_and_more, parts_left_out, without_caps
from .limits import COVER_REACH, limits_of, mostly_rounded, places_to_look_at, widened_limits
from .missed import farthest_followed, largest_patch_missed, points_missed, shares_rounded
from .openings import boundary_faults
from .refusal import passed_grid
from .sheets import cut_apart, faults_on_sheets, nodes_of_samples, torn_apart
from .slits import feet_on, narrow_gaps
from .sparse import sparse_parts
from .steps import unfollowed_steps
from .unfollowed import broken_ridges, mostly_unfollowed, off_mean_surface, rounded_peaks, unfollowed_parts

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples


def certify(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Certificate:
    """Return the certificate of a grid.

    Parameters
    ----------
    grid : Grid
        Of the same origin as the scan.
    samples : SurfaceSamples
        The surface samples of the scan, with all points that were read.
    boundary : Boundary
        Boundary loops of the scan.
    settings : Settings
        `length` is the desired member length, `fill_holes` tells which holes are closed, `fixed` where nodes must be; the limits of
        a grid that can be built.

    Returns
    -------
    Certificate
        Nothing is raised where it does not pass; see `Certificate.faults`.
    """
    return judge(grid, samples, boundary, settings).whole_certificate()


@dataclass(frozen=True, eq=False)
class Judged:
    """A grid that was measured, with all that is wrong with it, as far as a search needs it."""

    grid: Grid
    samples: SurfaceSamples
    boundary: Boundary
    settings: Settings
    certificate: Certificate  #: without other warnings than those of its limits, closed holes, bridged gaps, and offsets of its nodes
    found: Distances | None  #: None for a grid without triangles

    @property
    def checked_grid(self) -> Grid:
        """The grid with the certificate as far as it goes."""
        return self.grid.replace(certificate=self.certificate)

    def certified_grid(self) -> Grid:
        """Return the grid with all that its certificate says, and the distances of its nodes of which that names the largest."""
        away = self.grid.deviation if self.found is None else self.found.nodes
        return self.grid.replace(certificate=self.whole_certificate(), deviation=away)

    @cached_property
    def false_handles(self) -> list[Fault]:
        """Faults where the grid has handles that its scan does not have: no search takes one away."""
        found, grid, length = self.found, self.grid, self.settings.length
        if found is None or not self.certificate.handles:
            return []
        members = _desired_at_points(grid, found, length)
        return false_handles(grid, self.samples, found.scan / members, self.certificate, length)

    def whole_certificate(self) -> Certificate:
        """Return the certificate with all that it says."""
        found, length = self.found, self.settings.length
        if found is None:
            return self.certificate
        grid, samples, boundary, settings = self.grid, self.samples, self.boundary, self.settings
        members = _desired_at_points(grid, found, length)
        followed = _to_follow(samples)
        missed_at = place_of(samples.scan[farthest_followed(found.scan, followed, members)] + samples.origin)
        rough = samples.moved
        feet = feet_on(grid, samples, found, length)
        offsets, (gaps, bridged), doubtful, aside, beyond, beside, (apart, handles), bare, peaks = side_by_side(
            lambda: _offsets(grid, samples, length),
            lambda: bridged_gaps(grid, samples, boundary, length),
            lambda: [] if settings.boundary else doubtful_places(grid, samples, length, boundary.corners, found.scan),
            lambda: _at_boundary(grid, samples, boundary, found, followed, members, length),
            lambda: boundary_faults(grid, samples, boundary, length),
            lambda: [] if rough else _beside(grid, samples, found, followed, members),
            lambda: (cut_apart(grid, samples, found, length), self.false_handles),
            lambda: mostly_bare(grid, samples, feet, length),
            lambda: [] if rough else rounded_peaks(grid, samples, found, followed, members),
        )
        scatter = offsets.get("node_scatter", 0.0) if rough else 0.0
        cut_but_near = followed | np.isin(samples.judged, (LIMB, SLIT))  # stubs of limbs are rounded off, not left out
        rounded, beyond_scatter = shares_rounded(grid, samples, found, cut_but_near, members, scatter)
        too_far = mostly_rounded(beyond_scatter, missed_at)
        places = places_to_look_at(self.certificate, missed_at, 0.0 if too_far else rounded)
        closed = asked_for(closed_holes(samples, boundary), settings.fill_at, length)
        gaps = asked_for(without_caps(gaps, samples), settings.fill_at, length)
        slits, narrow, parts = narrow_gaps(grid, samples, feet, found, [*closed, *gaps], length)
        bridged = [each for each in bridged if each.kind == "bridged" or not each.is_said_by(parts)]
        holes = [*closed, *first_and_more([*(gap for gap in gaps if gap not in parts), *slits])]
        joined = parts_joined(grid, samples, length, [*bridged, *narrow])
        lids = openings_closed(holes, [*bridged, *narrow], samples, length, grid.unit)
        crushed = crushed_parts(grid, samples, found, length)
        too_frayed = frayed(crushed, found, followed, members)
        too_sparse, sparse = sparse_parts(samples, found, members, settings.allow_missing)
        return replace(
            self.certificate,
            left_out=(*self.certificate.left_out, *holes),
            faults=(
                *self.certificate.faults,
                *too_sparse,
                *too_frayed,
                *beyond,
                *handles,
                *bare,
                *(each for each in bridged if each.kind == "bridged"),
                *too_far,
            ),
            warnings=(  # what is lost or closed first, members last
                *sparse,
                *apart,
                *places,
                *lids,
                *(each for each in bridged if each.kind == "gap"),
                *narrow,
                *joined,
                *beside,
                *peaks,
                *crushed,
                *aside,
                *doubtful,
                *self.certificate.warnings,
            ),
            **offsets,
        )


def judge(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Judged:
    """Return a grid with what is wrong with it; parameters as of `certify`."""
    empty = "has no triangles" if len(grid.triangles) == 0 else ""
    if empty or not np.isfinite(grid.nodes).all():
        fault = Fault("empty", empty or "has nodes that are nowhere")
        bare = replace(_topology(grid, samples, boundary, settings), faults=(fault,))
        return Judged(grid, samples, boundary, settings, bare, None)
    length = settings.length
    found = measure_distances(grid, samples, length)
    nearest, cuts, certificate = side_by_side(
        lambda: nodes_of_samples(grid, samples, length),
        lambda: find_crossings(grid.nodes, grid.triangles, grid.origin),
        lambda: replace(_topology(grid, samples, boundary, settings), **_extremes(grid, settings)),
    )
    certificate = replace(certificate, crossings=len(cuts), **_apart(grid, samples, found, length))
    members = _desired_at_points(grid, found, length)
    patch = largest_patch_missed(samples, found.scan, members, COVER_REACH * members)
    faults = [
        *faults_of_topology(grid, certificate, boundary),
        *faults_in_space(grid, certificate, cuts, settings, patch),
    ]
    too_far, poor = limits_of(grid, found, settings)
    known = {fault.kind for fault in faults}
    if "cover" in known:
        known.add("sheets")  # of what is left out already
    on_sheets = faults_on_sheets(grid, samples, nearest, length)
    if not any(fault.kind == "torn" for fault in on_sheets):
        on_sheets += torn_apart(samples, found.scan * length / members, length)
    further = (
        *too_far,
        *on_sheets,
        *hanging_nodes(grid, samples, found, length),
        *nodes_off_sheets(grid, samples, length),
        *spikes(grid, samples, found, length),
        *_mostly_unfollowed(grid, samples, found, length),
    )
    faults += [fault for fault in further if fault.kind not in known]
    certificate = replace(
        certificate,
        faults=tuple(faults),
        warnings=(*poor, *fixed_off_scan(grid, found, length)),
        widened=widened_limits(settings),
    )
    return Judged(grid, samples, boundary, settings, certificate, found)


def checked(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Grid:
    """Return the grid with its certificate and the distances of its nodes, whether it passes or not."""
    return judge(grid, samples, boundary, settings).certified_grid()


def certified(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Grid:
    """Return the grid with its certificate: rather no result than a wrong one that looks right; see `passed_grid`."""
    return passed_grid(checked(grid, samples, boundary, settings))


def _topology(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Certificate:
    """Return what a grid is and what its scan is, apart from where they lie."""
    found = grid.topology
    closed = found.manifold and found.orientable
    return Certificate(
        unit=grid.unit,
        reach=COVER_REACH * settings.length,
        manifold=found.manifold,
        orientable=found.orientable,
        pieces=found.components,
        scan_pieces=len(samples.pieces),
        boundary_loops=found.boundary_loops,
        scan_loops=sum(loop.cut != "close" for loop in boundary.loops),
        euler=found.euler,
        handles=(2 * found.components - found.boundary_loops - found.euler) // 2 if closed else None,
    )


def _apart(grid: Grid, samples: SurfaceSamples, found: Distances, length: float) -> dict[str, Any]:
    """Return how far the scan lies from the grid and the grid from the scan, and what is left out."""
    at_nodes = _desired(grid, length)
    at_triangles = at_nodes[grid.triangles].mean(axis=1)
    members = at_triangles[found.triangle]
    known = found.triangles[np.isfinite(found.triangles)]
    in_reach = known <= COVER_REACH * at_triangles[np.isfinite(found.triangles)]
    beyond = points_missed(samples, found.scan, COVER_REACH * members)
    left_out = parts_left_out(samples, found, members, COVER_REACH * members)
    return {
        "points": len(samples.scan),
        "left_out": left_out,
        "missing": max(0.0, float(beyond.mean()) - sum(part.share for part in left_out if part.kind == "pieces")),
        "scan_within_reach": float((found.scan <= COVER_REACH * members).mean()),
        "grid_within_reach": float(in_reach.mean()) if len(known) else 1.0,
        "scan_distance": _spread(found.scan, samples.scan, grid, length / members),
        "farthest_kept": _worst(
            np.where(samples.judged == OUTLIER, np.nan, found.scan), samples.scan, grid, length / members
        ),
        "triangle_distance": _spread(
            found.triangles, grid.nodes[grid.triangles].mean(axis=1), grid, length / at_triangles
        ),
        "node_distance": _spread(found.nodes, grid.nodes, grid, length / at_nodes),
        "noise": float(np.median(found.noise)),
    }


def _offsets(grid: Grid, samples: SurfaceSamples, length: float) -> dict[str, float]:
    """Return the bias of the nodes and the scatter of the points about them; nothing where there are no points around any."""
    bias, scatter = offsets_from_points(grid, samples, length)
    known = np.isfinite(bias)
    if not known.any():
        return {}
    bias = bias[known]
    return {
        "node_bias": float(bias.mean()),
        "node_bias_p95": float(np.quantile(np.abs(bias), 0.95)),
        "node_scatter": float(np.median(scatter[known])),
    }


def _desired(grid: Grid, length: float) -> np.ndarray:
    """Return the desired length at each node (V,)."""
    return np.full(len(grid.nodes), length) if grid.desired is None else grid.desired


def _desired_at_points(grid: Grid, found: Distances, length: float) -> np.ndarray:
    """Return the desired length at each point that was read (N,): that of the nearest triangle."""
    lengths: np.ndarray = _desired(grid, length)[grid.triangles].mean(axis=1)[found.triangle]
    return lengths


def _to_follow(samples: SurfaceSamples) -> np.ndarray:
    """Return which points a grid is to follow (N,) bool."""
    followed: np.ndarray = (samples.judged == KEPT) & ~samples.elsewhere
    return followed


def _mostly_unfollowed(grid: Grid, samples: SurfaceSamples, found: Distances, length: float) -> list[Fault]:
    """Return a fault where a grid does not follow its scan; of a rough one the roughness is scatter."""
    judged = off_mean_surface if samples.moved else mostly_unfollowed
    return judged(grid, samples, found, _to_follow(samples), _desired_at_points(grid, found, length))


def _beside(
    grid: Grid, samples: SurfaceSamples, found: Distances, followed: np.ndarray, members: np.ndarray
) -> list[Fault]:
    """Return a warning of what a grid does not follow though it lies along it; parameters as of `unfollowed_parts`."""
    parts = unfollowed_parts(grid, samples, found, followed, members)
    return [*(parts or unfollowed_steps(grid, samples, found, followed, members)), *broken_ridges(grid, members)]


def _at_boundary(
    grid: Grid,
    samples: SurfaceSamples,
    boundary: Boundary,
    found: Distances,
    followed: np.ndarray,
    members: np.ndarray,
    length: float,
) -> list[Fault]:
    """Return warnings of where the boundary of a grid is not that of its scan; parameters as of `stops_short`."""
    aside = places_aside(grid, boundary, length, samples)
    return aside + stops_short(grid, samples, found, followed, members, aside)


def _spread(values: np.ndarray, places: np.ndarray, grid: Grid, weight: np.ndarray) -> Spread | None:
    """Return the quantiles of distances (K,), and the one that is largest times its weight (K,) with its place (K, 3)."""
    known = values[np.isfinite(values)]
    worst = _worst(values, places, grid, weight)
    if worst is None:
        return None
    p50, p95, p99 = np.quantile(known, [0.5, 0.95, 0.99]).tolist()
    return Spread(p50, p95, p99, worst)


def _extremes(grid: Grid, settings: Settings) -> dict[str, Any]:
    """Return the worst members, angles, fold and fixed node, and how many irregular nodes there are."""
    halves = grid.nodes[grid.edges].mean(axis=1)
    corners = grid.nodes[grid.panel_table].reshape(-1, 3)
    irregular, forced = count_irregular(grid)
    return {
        "shortest_member": _worst(grid.lengths, halves, grid, -1.0),
        "longest_member": _worst(grid.lengths, halves, grid),
        "smallest_angle": _worst(grid.corner_angles.ravel(), corners, grid, -1.0),
        "largest_angle": _worst(grid.corner_angles.ravel(), corners, grid),
        "sharpest_fold": _worst(fold_angles(grid), halves, grid, -1.0),
        "fixed_error": _fixed_error(grid, settings),
        "irregular": irregular,
        "irregular_forced": forced,
    }


def _worst(values: np.ndarray, places: np.ndarray, grid: Grid, weight: float | np.ndarray = 1.0) -> Worst | None:
    """Return the value (K,) that is largest times its weight, the smallest for weight -1, and its place (K, 3); None of none."""
    known = np.flatnonzero(np.isfinite(values))
    if len(known) == 0:
        return None
    at = known[np.argmax((weight * values)[known])]
    return Worst(float(values[at]), place_of(places[at] + grid.origin))


def _fixed_error(grid: Grid, settings: Settings) -> Worst | None:
    """Return the largest distance of a position of the settings from the nearest fixed node."""
    if not settings.fixed:
        return None
    positions = np.array(settings.fixed) - grid.origin
    nodes = grid.nodes[grid.fixed] if grid.fixed.any() else grid.nodes
    return _worst(np.linalg.norm(positions[:, None] - nodes, axis=2).min(axis=1), positions, grid)
