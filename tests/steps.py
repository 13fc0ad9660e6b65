"""The steps before the front, as `pipeline.make_grid` takes them."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent
from typing import Any, NamedTuple

from typed import known

from scantruss import (
    Grid,
    PointCloud,
    Settings,
    advance_front,
    find_boundary,
    find_constraints,
    optimize_grid,
    orientation_fields,
    sample_surface,
)
from scantruss.boundary.find import Boundary
from scantruss.constraints.find import Constraints
from scantruss.front.orientation_field import Field, FieldStart
from scantruss.kernels.front.candidate_nodes import CandidateNodes
from scantruss.surface.samples import SurfaceSamples


class Steps(NamedTuple):
    """What a front needs."""

    samples: SurfaceSamples
    boundary: Boundary
    constraints: Constraints


def lines_of_readme() -> str:
    """Return the lines of Python that the README shows, step by step."""
    readme = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    return dedent(readme.partition("in Python, step by step:\n")[2].partition("\nor in one call:")[0])


def steps_of(cloud: PointCloud, settings: Settings) -> Steps:
    """Return the samples, the boundary and the constraints of a scan."""
    samples, boundary = find_boundary(sample_surface(cloud, settings), settings)
    return Steps(samples, *find_constraints(samples, boundary, settings))


def boundary_of(cloud: PointCloud, settings: Settings) -> Boundary:
    """Return the boundary of a scan."""
    return find_boundary(sample_surface(cloud, settings), settings)[1]


def front_of(cloud: PointCloud, settings: Settings, way: FieldStart | None = None, **others: Any) -> Grid:
    """Return what a front leaves behind that comes to rows laid in a way; None: that makes all of its nodes itself."""
    steps = steps_of(cloud, settings)
    (field,) = (
        orientation_fields(steps.samples, steps.boundary, settings, [way])
        if way
        else (Field(FieldStart(laid=False), None),)
    )
    return advance_front(*steps, settings, field.nodes, **others)


def rows_of(steps: Steps, length: float, way: FieldStart) -> CandidateNodes:
    """Return the nodes of rows laid in a way."""
    (field,) = orientation_fields(steps.samples, steps.boundary, Settings(length=length), [way])
    return known(field.nodes)


def optimized(grid: Grid, cloud: PointCloud, settings: Settings, places: Any = ()) -> Grid:
    """Return a grid improved, with nodes at some places (K, 3) in the scan's own frame."""
    steps = steps_of(cloud, settings.replace(fixed=tuple(map(tuple, places)) or settings.fixed))
    return optimize_grid(grid, *steps, settings)
