"""Structures of one grid with other supports and another rise, each sized and solved, for choosing the lightest."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .modes import worst_buckling
from .options import StructureSettings
from .report import report_structure
from .sizing import size_members
from .statics import factor_stiffness, solve
from .truss import Truss

if TYPE_CHECKING:
    from ..grid.grid import Grid

OF_ANALYSIS = (
    "checks",
    "size",
    "size_by",
    "buckling",
    "frequencies",
    "path",
    "path_steps",
    "path_factor",
    "imperfection",
)  #: settings that the structure itself does not depend on


@dataclass(frozen=True)
class Variants:
    """What is tried on every grid."""

    settings: StructureSettings
    supports: tuple[str, ...]
    rises: tuple[float, ...]  #: height of the structure over that of the grid


@dataclass(frozen=True)
class VariantFigures:
    """What has come out of a variant."""

    supports: str
    rise: float
    fault: str = ""  #: why it is no structure
    mass: float = 0.0  #: [kg]
    sections: tuple[str, ...] = ()
    utilization: float | None = None
    buckling: float | None = None  #: least factor of linear buckling; None where nothing is compressed
    displacement: float = 0.0  #: greatest of the SLS combinations [m]
    warnings: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether it is a structure without a warning."""
        return not self.fault and not self.warnings


def solve_variants(grid: Grid, variants: Variants) -> tuple[VariantFigures, ...]:
    """Return the result of every pair of supports and rise, supports first."""
    return tuple(
        _solved(grid, variants.settings, where, rise) for where in variants.supports for rise in variants.rises
    )


def lightest(variants: list[VariantFigures]) -> VariantFigures | None:
    """Return the lightest variant that passed, the first of equal ones."""
    return min((each for each in variants if each.passed), key=lambda each: each.mass, default=None)


def truss_arguments(settings: StructureSettings) -> dict[str, Any]:
    """Return the settings as `Truss.from_grid` takes them."""
    return {spec.name: getattr(settings, spec.name) for spec in fields(settings) if spec.name not in OF_ANALYSIS}


def _solved(grid: Grid, settings: StructureSettings, supports: str, rise: float) -> VariantFigures:
    """Return the figures of one variant, or why it is no structure."""
    raised = grid.replace(nodes=grid.nodes * [1.0, 1.0, rise]) if rise != 1.0 else grid
    try:
        truss = Truss.from_grid(raised, **(truss_arguments(settings) | {"supports": supports}))
        if settings.size:
            truss = size_members(truss, settings.size, settings.checks, by=settings.size_by)
        factored = factor_stiffness(truss)
        solution = solve(truss, factored)
        buckling = worst_buckling(factored, solution, 1)
    except InputError as error:
        return VariantFigures(supports, rise, fault=" ".join(str(error).split()))
    report = report_structure(solution, settings.checks, buckling=buckling)
    service = [case for case in report.cases if case.state == "SLS"] or [
        case for case in report.cases if case.state == "case"
    ]
    return VariantFigures(
        supports=supports,
        rise=rise,
        mass=truss.mass,
        sections=tuple(section.name for section in truss.sections),
        utilization=report.to_dict()["utilization_max"],
        buckling=float(buckling.values[0]) if len(buckling.values) else None,
        displacement=max(case.displacement_max for case in service),
        warnings=report.warnings,
    )
