"""Sizing: sections of the catalogue for all members, few different ones, so that all checks pass."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .catalogue import Section, bundled_sections
from .checks import MemberChecks, section_class, strengths, utilizations
from .groups import WAYS_TO_GROUP, member_groups_of
from .modes import worst_buckling
from .results import CaseResult
from .statics import factor_stiffness, solve
from .truss import Truss

MOST_SIZING_ROUNDS = 60  #: of solving and choosing
GROWTH_A_ROUND = 1.5  #: most that the lightest section grows in a round where the structure buckles too early


@dataclass(frozen=True)
class SizingRound:
    """A round of sizing, before its sections grow."""

    mass: float  #: of all members [kg]
    sections: int  #: different ones
    utilization: float  #: the greatest of all members and combinations
    buckling: float | None  #: least factor of linear buckling; None while members do not pass


def candidates(truss: Truss) -> list[Section]:
    """Return the sections that may replace the first of a structure, lightest first.

    They are those of the catalogue with its shape, series (IPE, HEA, HEB) and finish, of class 1 to 3, whose second moment of area is
    greater than that of all lighter ones: a heavier one resists more in every way.

    Raises
    ------
    InputError
        The material is not steel, or the catalogue has no sections of this kind.
    """
    like, material = truss.sections[0], truss.material
    if material.kind != "steel":
        raise InputError(f"sizing follows checks of steel, and {material.name} is {material.kind}; leave --size out")
    kind = [s for s in bundled_sections() if _kind(s) == _kind(like)]
    chain: list[Section] = []
    for section in sorted(kind, key=lambda s: (s.area, -s.inertia_y)):
        better = not chain or (section.inertia_y > chain[-1].inertia_y and section.plastic_y > chain[-1].plastic_y)
        if better and section_class(section, material) < 4:
            chain.append(section)
    if not chain:
        raise InputError(f"the catalogue has no sections like {like.name} to choose from; name a CHS, SHS or I section")
    return chain


def _why_not_larger(truss: Truss, last: Section) -> str:
    """Say why larger sections of the catalogue are not taken; "" where there are none."""
    larger = [s for s in bundled_sections() if _kind(s) == _kind(last) and s.plastic_y > last.plastic_y]
    slender = [s.name for s in larger if section_class(s, truss.material) == 4]
    if not slender:
        return ""
    return (
        f" ({slender[0]}{' and others' if len(slender) > 1 else ''} of class 4 in {truss.material.name} are left out)"
    )


def _kind(section: Section) -> tuple[str, str, str]:
    """Return what stays when a section is replaced."""
    return section.shape, section.finish, section.name.rstrip("0123456789.") if section.shape == "I" else ""


def size_members(
    truss: Truss,
    count: int,
    checks: MemberChecks | None = None,
    rounds: list[SizingRound] | None = None,
    *,
    by: str = "members",
) -> Truss:
    """Return the structure with sections that pass all checks under all ULS combinations (all load cases where there are none).

    All members begin with the lightest section. Each round solves the structure and gives every member the lightest section
    that resists its forces, never a lighter one than before; then the sections are made few, at the least mass, by heavier
    ones. Once all pass, the lightest sections grow until the structure buckles at no less than the factor of the checks (EN 1993-1-1
    5.2.1(3)). Fewer sections are used if they are lighter, as they may be if buckling decides.

    Parameters
    ----------
    truss : Truss
        Its first section gives the kind.
    count : int
        Most different sections.
    checks : MemberChecks, optional
        Buckling length, partial factors.
    rounds : list of SizingRound, optional
        Each round of the structure that is returned is added to it.
    by : str
        "groups" or "rings": all members of one have the same section, see `member_groups_of`; "members": each has its own.

    Raises
    ------
    InputError
        The heaviest section does not pass, or there is nothing to choose from.
    """
    if count < 1:
        raise InputError(f"the number of different sections must be 1 or more, got {count}")
    best: tuple[Truss, list[SizingRound]] | None = None
    refused: InputError | None = None
    for number in range(1, count + 1):
        own: list[SizingRound] = []
        try:
            sized = _sized(truss, number, checks or MemberChecks(), own, by)
        except InputError as error:
            refused = error
            continue
        if best is None or sized.mass < best[0].mass:
            best = sized, own
    if best is None:
        assert refused is not None
        raise refused
    if rounds is not None:
        rounds += best[1]
    return best[0]


def _sized(truss: Truss, count: int, checks: MemberChecks, rounds: list[SizingRound], by: str) -> Truss:
    """Return the structure with at most so many sections, whether or not fewer would be lighter."""
    chain = candidates(truss)
    chosen = np.zeros(len(truss.members), np.int64)
    group_of = np.arange(len(chosen)) if by == WAYS_TO_GROUP[0] else member_groups_of(truss, by)[1]
    for _ in range(MOST_SIZING_ROUNDS):
        chosen = _few(chosen, truss.lengths, np.array([section.area for section in chain]), count)
        truss = truss.replace(sections=tuple(chain), section_of=chosen)
        factored = factor_stiffness(truss)
        solution = solve(truss, factored)
        judged = solution.judged_results()
        needed = _same_in_groups(_needed(truss, judged, chosen, checks), group_of)
        least = None
        if (needed <= chosen).all():
            least = float(worst_buckling(factored, solution, 1).values.min(initial=np.inf))
            if least < checks.buckling_factor:
                needed = _stiffer(chosen, chain, checks.buckling_factor / least)
        used = max(float(_use(truss, result, checks).max()) for result in judged)
        rounds.append(SizingRound(truss.mass, len(np.unique(chosen)), used, least))
        if (needed <= chosen).all():
            kept, numbers = np.unique(chosen, return_inverse=True)
            return truss.replace(sections=tuple(chain[k] for k in kept), section_of=numbers.ravel().astype(np.int64))
        if needed.max() == len(chain):
            mark = truss.member_marks[int(needed.argmax())]
            raise InputError(
                f"no section up to {chain[-1].name} is enough at {mark}{_why_not_larger(truss, chain[-1])};"
                " use more supports or shorter members"
            )
        chosen = np.maximum(chosen, needed)
    raise InputError(f"the sections still change after {MOST_SIZING_ROUNDS} rounds; name a heavier --section")


def _same_in_groups(needed: np.ndarray, group_of: np.ndarray) -> np.ndarray:
    """Return for each member the greatest of its group."""
    most = np.zeros(int(group_of.max()) + 1, np.int64)
    np.maximum.at(most, group_of, needed)
    return most[group_of]


def _stiffer(chosen: np.ndarray, chain: list[Section], factor: float) -> np.ndarray:
    """Return sections of which the lightest has grown in bending, as much as buckling lacks and at most half as much again."""
    inertia = np.array([section.inertia_y for section in chain])
    least = int(chosen.min())
    grown = max(least + 1, int(np.searchsorted(inertia, inertia[least] * min(factor, GROWTH_A_ROUND))))
    return np.maximum(chosen, grown)


def weight_curve(
    truss: Truss, sized: Truss, count: int, checks: MemberChecks | None = None, by: str = "members"
) -> dict[int, float]:
    """Return the mass [kg] of a structure sized with at most 1, 2, ..., `count` different sections; `sized` is the last of them."""
    curve: dict[int, float] = {}
    for number in range(1, count):
        with suppress(InputError):
            mass = _sized(truss, number, checks or MemberChecks(), [], by).mass
            curve[number] = min([mass, *curve.values()])
    return curve | {count: sized.mass}


def _needed(truss: Truss, judged: list[CaseResult], chosen: np.ndarray, checks: MemberChecks) -> np.ndarray:
    """Return for each member the first section of the structure, from the chosen one on, that resists its forces of every combination."""
    needed = chosen.copy()
    for result in judged:
        for _ in range(len(truss.sections)):
            now = np.minimum(needed, len(truss.sections) - 1)
            over = _use(truss.replace(section_of=now), result, checks) > 1
            if not (over & (needed < len(truss.sections))).any():
                break
            needed = np.where(over, now + 1, needed)
    return needed


def _use(truss: Truss, result: CaseResult, checks: MemberChecks) -> np.ndarray:
    """Return the (M,) greatest utilization of members under the forces of a result."""
    used: np.ndarray = utilizations(strengths(truss, checks), result).max(axis=1)
    return used


def _few(chosen: np.ndarray, lengths: np.ndarray, areas: np.ndarray, count: int) -> np.ndarray:
    """Return sections, none lighter than before and at most `count` different ones, of the least volume: dynamic programming."""
    kinds = np.unique(chosen)
    if len(kinds) <= count:
        return chosen
    length = np.array([lengths[chosen == kind].sum() for kind in kinds])
    total = np.concatenate([[0.0], np.cumsum(length)])
    best = np.full((count + 1, len(kinds) + 1), np.inf)
    best[:, 0] = 0.0
    start = np.zeros((count + 1, len(kinds) + 1), np.int64)
    for groups in range(1, count + 1):
        for end in range(1, len(kinds) + 1):  # the last group is kinds[first:end], all as the heaviest of them
            volume = best[groups - 1, :end] + (total[end] - total[:end]) * areas[kinds[end - 1]]
            start[groups, end] = int(volume.argmin())
            best[groups, end] = volume.min()
    made, end = chosen.copy(), len(kinds)
    for groups in range(count, 0, -1):
        first = int(start[groups, end])
        made[np.isin(chosen, kinds[first:end])] = kinds[end - 1]
        end = first
        if end == 0:
            break
    return made
