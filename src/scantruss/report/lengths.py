"""What `scantruss info` says of member lengths: what came of each that was tried, which pass, and which to take."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..attempts.limit import only_leaves_out
from ..check.refusal import MOST_ACCEPTED, option_accepting
from ..errors import words_of_number, words_of_place
from .ladder import SOME_WALL

if TYPE_CHECKING:
    from ..errors import Place
    from ..scan.cloud import PointCloud
    from .advice import Advice
    from .length_trial import LengthTrial

LEFT_OUT_ALIKE = 1.1  # ratio of the shares of the scan that grids leave out up to which they are alike
MOST_WORDS = 2  # kinds of loss, or faults, that are named for a length


def advice_rows(advice: Advice, length: float, cloud: PointCloud) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return head and rows of a table: what comes of a member length, of those around it and of others that were tried."""
    radius, unit = advice.radius, f" [{cloud.unit}]" if cloud.unit else ""
    rows: list[tuple[str, ...]] = []
    if not advice.is_spent:
        advice.try_length(length)
    trials: dict[float, LengthTrial | None] = dict.fromkeys(advice.around(length))
    advice.settle()
    trials |= {trial.length: trial for trial in advice.tried}
    for each in sorted(trials):
        trial = trials[each]
        members = advice.members(each) if trial is None or trial.grid is None else len(trial.grid.edges)
        rows.append(
            (
                f"{each:g}",
                f"{members:,}",
                words_of_number(each**2 / (8.0 * radius), 2) if each <= 2.0 * radius else "-",
                f"{each / cloud.spacing:.3g}",
                result_of(trial),
            )
        )
    return (f"length{unit}", "members", f"sag L^2/8R{unit}", "L / spacing", "a quick run"), rows


def result_of(trial: LengthTrial | None) -> str:
    """Return in a few words what came of a length: what is lost and why, or why no grid passes."""
    if trial is None:
        return "not tried"
    if trial.fault is not None:
        return f"{_no_grid(trial)}: {_why(trial)}"
    found = trial.grid.certificate if trial.grid is not None else None
    if found is None:
        return "passes"
    count = len(found.warnings)
    parts = [f"passes with {count} warning{'s' if count > 1 else ''}" if count else "passes"]
    shares: dict[str, float] = {}
    for part in found.left_out:
        if not part.asked and part.kind != "duplicates":
            shares[part.words] = shares.get(part.words, 0.0) + part.share
    parts += [
        f"{share:.1%} {words}"
        for words, share in sorted(shares.items(), key=lambda kind: -kind[1])[:MOST_WORDS]
        if share >= 0.0005
    ]
    parts += [warning.words for warning in found.warnings if warning.kind == "sparse"]
    parts += ["loses ridges"] * any(warning.kind == "lost" for warning in found.warnings)
    for kind, what in (("hole", "closed"), ("gap", "bridged")):
        number = sum(part.number for part in found.left_out if part.kind == kind)
        parts += [f"{number} {kind}{'s' if number > 1 else ''} {what}"] * (number > 0)
    return ", ".join(parts)


def _no_grid(trial: LengthTrial) -> str:
    """Say that no grid passes, or that those do not that were made."""
    if not trial.paused:
        return "no quick run passes"
    return f"none of the first {trial.grids} grids passes" if trial.grids > 1 else "the first grid does not pass"


def _why(trial: LengthTrial) -> str:
    """Return the first faults of the grid that came out, or why none did."""
    grid = getattr(trial.fault, "grid", None)
    if grid is not None and grid.certificate is not None:
        return " and ".join(fault.words.partition(";")[0] for fault in grid.certificate.faults[:MOST_WORDS])
    return str(trial.fault).partition(";")[0]


def advice_lines(advice: Advice, length: float, cloud: PointCloud) -> list[str]:
    """Return how noisy and how bent the scan is, which lengths pass, and which to take."""
    unit, radius = f" {cloud.unit}" if cloud.unit else "", advice.radius
    trial = next((each for each in advice.tried if each.length == length), None)
    bent = (
        f"R = {words_of_number(radius, 3)}{unit}: 95 % of the scan is bent less"
        if np.isfinite(radius)
        else "no bend beyond its noise was found"
    )
    lines = [bent]
    if trial is not None and trial.grid is not None and trial.grid.certificate is not None:
        noise = trial.grid.certificate.noise
        lines.append(
            f"noise {words_of_number(noise, 2)}{unit}, {noise / cloud.spacing:.2g} of a spacing, {noise / length:.2g} of a member"
        )
    lines += passing_lines(advice.tried, unit)
    if trial is not None and not trial.passed:
        where = trial.fault.where if trial.fault is not None else None
        place = "" if where is None else f" (near {words_of_place(where)})"
        passing = [each.length for each in advice.tried if each.passed]
        near = min(passing, key=lambda other: abs(np.log(other / length)), default=None)
        near = advice.nearby(length) if near is None and not advice.is_spent else near
        lines += [f"at {length:g}{unit}: {_no_grid(trial)}: {_why(trial)}{place}"]
        lines += [
            f"try --length {near:g}"
            if near
            else f"no length passes of those tried{usual_cause(advice.tried, advice.wall)}"
        ]
        lines += [] if near else accepted_line(advice.tried)
    else:
        lines.append(f"try --length {length:g}")
    return lines


def accepted_line(trials: list[LengthTrial]) -> list[str]:
    """Return a length whose grid only leaves out too much, the shortest of those alike, and the option that accepts that; else nothing."""
    leaving_out = [
        (trial, trial.fault.grid.certificate)
        for trial in trials
        if trial.leaves_out and trial.fault is not None and only_leaves_out(trial.fault)
    ]
    least = min((found.missing for _, found in leaving_out), default=1.0)
    if least > MOST_ACCEPTED:
        return []
    trial, found = next(each for each in leaving_out if each[1].missing <= LEFT_OUT_ALIKE * least)
    without = "its thin limbs" if trial.loses_limbs else f"{found.missing:.0%} of the scan"
    return [f"with --length {trial.length:g} {option_accepting(found)} a grid without {without} passes"]


def usual_cause(trials: list[LengthTrial], wall: tuple[float, float] = (0.0, 0.0)) -> str:
    """Return why most lengths that were tried get no grid, as at one of them that gets none for this, and what to do.

    Only the faults that the table names count.

    wall : how thick the thin walls of the scan are, and their share of it
    """
    causes: dict[str, list[tuple[float, str, Place | None]]] = {}
    for tried, fault in ((trial.length, trial.fault) for trial in trials if trial.fault is not None):
        found = fault.grid.certificate if fault.grid is not None else None
        faults = {
            each.kind: (tried, f"the grid {each.words}".partition(";")[0], each.where)
            for each in (found.faults[:MOST_WORDS] if found is not None else ())
        }
        for kind, cause in (faults or {str(fault): (tried, str(fault).partition(";")[0], fault.where)}).items():
            causes.setdefault(kind, []).append(cause)
    if not causes:
        return "; clean or crop the scan first"
    own = max(causes.values(), key=lambda each: (len(each), _are_alike(each)))
    length, said, where = own[len(own) // 2]
    place = "" if where is None else f" (near {words_of_place(where)})"
    why = f"as {said}" if _are_alike(own) else f"for faults of one kind, as at {length:g}: {said}"
    return f", {len(own)} of {len(trials)} {why}{place}; {_way_out_of(trials, *wall)}"


def _way_out_of(trials: list[LengthTrial], thickness: float, share: float) -> str:
    """Return what to do where no length passes: walls thinner than most members need shorter ones, and points for these."""
    if share < SOME_WALL or sum(trial.length > thickness for trial in trials) <= len(trials) / 2:
        return "clean or crop the scan there first"
    return (
        f"{share:.0%} of the scan is walls about {words_of_number(thickness, 2)} thick, thinner than most of these members:"
        " scan them more densely, so that shorter ones follow both sides, or crop them away"
    )


def _are_alike(causes: list[tuple[float, str, Place | None]]) -> bool:
    """Whether the same is said of all lengths."""
    return len({words for _, words, _ in causes}) == 1


def passing_lines(trials: list[LengthTrial], unit: str) -> list[str]:
    """Return between which lengths all that were tried pass, the shortest first; nothing where none passes."""
    spans: list[list[float]] = []
    begins = True
    for trial in trials:
        if trial.passed and begins:
            spans.append([])
        if trial.passed:
            spans[-1].append(trial.length)
        begins = not trial.passed
    if not spans:
        return []
    parts = [f"{span[0]:g}" if len(span) == 1 else f"{span[0]:g} to {span[-1]:g}" for span in spans]
    return [f"passes, of the {len(trials)} lengths tried: {', '.join(parts)}{unit}"]
