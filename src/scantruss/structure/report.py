"""The report of a structure: its figures as plain values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import words_of_number
from .checks import CLAUSES_CHECKED, MemberChecks, span_of, strengths, use_words, utilizations
from .doubts import doubts_of
from .groups import member_groups_of
from .layers import LayerChecks, check_layers
from .modes import Modes
from .path import Path
from .path_report import path_figures, path_warnings
from .results import CaseResult, Solution
from .sizing import SizingRound
from .truss import Truss

SOFTEST_SPAN_RATIO = 3.0  # span over displacement, rounded, below which its number says nothing


@dataclass(frozen=True)
class CaseFigures:
    """Figures of a load case or a combination."""

    name: str
    state: str  #: case, ULS or SLS
    applied: tuple[float, ...]  #: [N]
    reactions: tuple[float, ...]  #: [N]
    displacement_max: float  #: [m]
    force_min: float  #: smallest axial force, compression negative [N]
    force_max: float  #: [N]
    utilization_max: float | None  #: by EN 1993-1-1; None where no clause applies
    governing: str  #: the member of that, and its clause
    equilibrium_error: float  #: relative


@dataclass(frozen=True, eq=False)
class StructureReport:
    """All figures of a structure."""

    truss: Truss
    cases: tuple[CaseFigures, ...]
    utilization: np.ndarray | None  #: (M,) the greatest of all ULS combinations, or of all cases where there are none
    governing: tuple[str, ...]  #: (M,) the clause and load of that
    warnings: tuple[str, ...]
    buckling: Modes | None = None  #: of the combination that buckles first, where it was asked for
    vibration: Modes | None = None  #: where it was asked for
    rounds: tuple[SizingRound, ...] = ()  #: of sizing
    weights: dict[int, float] | None = (
        None  #: mass sized with at most so many different sections, see `weight_curve` [kg]
    )
    path: Path | None = None  #: where it was asked for
    layers: LayerChecks | None = None  #: of a double layer

    def __repr__(self) -> str:
        """Say how much is used and moved, and how many warnings there are."""
        used = "not checked" if self.utilization is None else f"utilization {self.utilization.max():.3g}"
        moved = max(case.displacement_max for case in self.cases)
        return f"StructureReport({self.truss!r}, {used}, moves {1e3 * moved:.3g} mm, {len(self.warnings)} warnings)"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; SI units."""
        cases = {
            case.name: {
                name: list(value) if isinstance(value, tuple) else value
                for name, value in vars(case).items()
                if name != "name"
            }
            for case in self.cases
        }
        judged = [case for case in self.cases if case.state == "ULS"] or list(self.cases)
        used = [case.utilization_max for case in judged if case.utilization_max is not None]
        counts = np.bincount(self.truss.section_of, minlength=len(self.truss.sections)).tolist()
        values: dict[str, Any] = {
            "mass": self.truss.mass,
            "cases": cases,
            "displacement_max": max(case.displacement_max for case in self.cases),
            "force_min": min(case.force_min for case in self.cases),
            "force_max": max(case.force_max for case in self.cases),
            "utilization_max": max(used) if used else None,
            "sections": {section.name: count for section, count in zip(self.truss.sections, counts, strict=True)},
            "groups": self._groups(),
            "warnings": list(self.warnings),
        }
        if self.layers is not None:
            values["layers"] = self.layers.to_dict(self.truss)
        if self.buckling is not None:
            values["buckling_factors"] = self.buckling.values.tolist()
            values["buckling_case"] = self.buckling.of
        if self.vibration is not None:
            values["frequencies"] = self.vibration.values.tolist()
        if self.rounds:
            values["sizing_rounds"] = [asdict(each) for each in self.rounds]
        if self.weights is not None:
            values["mass_by_sections"] = {str(count): mass for count, mass in self.weights.items()}
        if self.path is not None:
            values |= path_figures(self.path)
        return values

    def _groups(self) -> dict[str, Any]:
        """Return count, mean length [m], its coefficient of variation, mass [kg], sections and greatest utilization of every group."""
        names, group_of = member_groups_of(self.truss)
        found = {}
        for number, name in enumerate(names):
            mine = group_of == number
            lengths = self.truss.lengths[mine]
            found[name] = {
                "members": int(mine.sum()),
                "length_mean": float(lengths.mean()),
                "length_cv": float(lengths.std() / lengths.mean()),
                "mass": float(self.truss.member_mass[mine].sum()),
                "sections": [self.truss.sections[k].name for k in np.unique(self.truss.section_of[mine])],
                "utilization_max": None if self.utilization is None else float(self.utilization[mine].max()),
            }
        return found


def report_structure(
    solution: Solution,
    checks: MemberChecks | None = None,
    notes: Sequence[str] = (),
    *,
    buckling: Modes | None = None,
    vibration: Modes | None = None,
    rounds: Sequence[SizingRound] = (),
    weights: dict[int, float] | None = None,
    path: Path | None = None,
) -> StructureReport:
    """Return the figures of all load cases and combinations, the checks of the members, and warnings.

    Parameters
    ----------
    solution : Solution
        Result of `solve`.
    checks : MemberChecks, optional
        Buckling length, partial factors, limits.
    notes : sequence of str
        Further warnings, of whoever made the structure.
    buckling, vibration : Modes, optional
        Results of `worst_buckling` and `vibration_modes`.
    rounds : sequence of SizingRound
        Those of `size_members`.
    weights : dict of int to float, optional
        That of `weight_curve`.
    path : Path, optional
        That of `solve_path`.
    """
    truss, checks = solution.truss, checks or MemberChecks()
    strength = strengths(truss, checks)
    any_uls: bool = any(combination.state == "ULS" for combination in truss.combinations)
    worst, clause, load = (
        np.zeros(len(truss.members)),
        np.zeros(len(truss.members), int),
        np.zeros(len(truss.members), int),
    )
    figures: list[CaseFigures] = []
    for number, result in enumerate(solution.all_results()):
        each = utilizations(strength, result) if strength.known else None
        figures.append(_figures_of(result, each))
        if each is not None and (result.state == "ULS" or not any_uls):
            more = each.max(axis=1) > worst
            worst[more], clause[more], load[more] = each.max(axis=1)[more], each.argmax(axis=1)[more], number
    governing = tuple(f"{CLAUSES_CHECKED[c]}, {figures[k].name}" for c, k in zip(clause, load, strict=True))
    warnings = [*truss.warnings, *doubts_of(truss), *notes]
    if not strength.known:
        why = "not steel" if truss.material.kind != "steel" else "of class 4 (EN 1993-1-1 table 5.2)"
        warnings.append(f"no member is checked: {truss.material.name} {truss.sections[0].name} is {why}")
    elif (over := int((worst > 1).sum())) > 0:
        most = int(worst.argmax())
        words = f"{truss.member_marks[most]} {use_words(worst[most])} by {governing[most]}"
        warnings.append(
            f"{over:,} of {len(worst):,} members {'is' if over == 1 else 'are'} used beyond 1, the most {words}"
        )
    warnings += _limits(truss, figures, checks)
    if buckling is not None and (least := float(buckling.values.min(initial=math.inf))) < checks.buckling_factor:
        less = f"the structure buckles at {least:.3g} times {buckling.of}"
        enough = f"less than {checks.buckling_factor:g}: analysis of first order and its checks are not enough (EN 1993-1-1 5.2.1(3))"
        warnings.append(f"{less}: it does not carry this load" if least < 1.0 else f"{less}, {enough}")
    layers = check_layers(truss) if truss.member_sets else None
    warnings += layers.warnings(truss) if layers is not None else []
    warnings += path_warnings(path) if path is not None else []
    return StructureReport(
        truss=truss,
        cases=tuple(figures),
        utilization=worst if strength.known else None,
        governing=governing if strength.known else (),
        warnings=tuple(warnings),
        buckling=buckling,
        vibration=vibration,
        rounds=tuple(rounds),
        weights=weights,
        path=path,
        layers=layers,
    )


def _figures_of(result: CaseResult, used: np.ndarray | None) -> CaseFigures:
    most = None if used is None else divmod(int(used.argmax()), used.shape[1])
    return CaseFigures(
        name=result.name,
        state=result.state,
        applied=tuple(result.applied.tolist()),
        reactions=tuple(result.reaction.tolist()),
        displacement_max=result.displacement_max,
        force_min=float(result.axial.min()),
        force_max=float(result.axial.max()),
        utilization_max=None if used is None else float(used.max()),
        governing="" if most is None else f"{result.truss.member_marks[most[0]]} {CLAUSES_CHECKED[most[1]]}",
        equilibrium_error=result.equilibrium_error,
    )


def _limits(truss: Truss, figures: Sequence[CaseFigures], checks: MemberChecks) -> list[str]:
    """Return warnings of slender members and great displacements."""
    warnings = []
    radius = np.array([section.radius for section in truss.sections])[truss.section_of]
    slender = checks.effective_length * truss.lengths / radius
    if (over := slender > checks.slenderness).any():
        first = truss.member_marks[int(slender.argmax())]
        warnings.append(
            f"{over.sum():,} of {len(over):,} members are more slender than {checks.slenderness:g}, the most {first} with"
            f" {slender.max():.0f}"
        )
    service = [each for each in figures if each.state == "SLS"] or [each for each in figures if each.state == "case"]
    most = max(service, key=lambda case: case.displacement_max)
    span = span_of(truss)
    if span > 0 and most.displacement_max > span / checks.deflection:
        ratio = span / most.displacement_max
        words = f"span/{ratio:.0f}, more than" if ratio > SOFTEST_SPAN_RATIO else "too large for a design, more than"
        warnings.append(
            f"the displacement of {words_of_number(1e3 * most.displacement_max, 3)} mm under {most.name} is {words}"
            f" span/{checks.deflection:g} of the span {span:.3g} m"
        )
    return warnings
