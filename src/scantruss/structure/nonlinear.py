"""The path of a structure under a growing load: geometrically nonlinear statics by arc length.

Each step ends on a sphere around the state before, its radius the arc length (Crisfield 1981), whose equation is solved together with
equilibrium in linearized form (Schweizerhof and Wriggers 1986). The tangent of the state before serves as long as the iterations that
are left are likely to take less time than a new one; they are mixed (Anderson 1965), which makes up for most of its age.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..runtime.progress import Progress
from .corotational import Response
from .equilibrium import Equilibrium, LoadedState, Tangent
from .frame import LENGTHEN
from .imperfections import Imperfection, imperfection_of
from .mechanism import product
from .mixture import Mixture
from .modes import Modes, buckling_modes, worst_buckling
from .path import Path
from .statics import Factored, factor_stiffness, solve
from .truss import LoadCase, Truss

PATH_STEPS = 30  #: of a path at most, unless told otherwise
FIRST_STEPS = 10  #: the first step is this part of the way to where linear theory buckles
STEPS_BEYOND = 5  #: steps after the structure has lost its stability
FACTOR_AT_END = 2.0  #: of the linear buckling factor, at which a path ends that stays stable
UNBUCKLED_FACTOR = 10.0  #: load factor at which a path ends that stays stable where linear theory does not buckle
BALANCED_ERROR = 1e-9  #: error of equilibrium at which a step has converged
MOST_ITERATIONS = 50  #: of a step at most
WANTED_WORK = 11  #: iterations of a step, and four more for each tangent; more make the next shorter
#: least cosine of a step to its start, greatest change of stiffness along it; else it is halved
SMOOTH_STEP = (0.8, 0.5)
SMOOTH_CUTS = 5  #: halvings of a step for that
MOST_TANGENTS = 6  #: factored within a step at most
ROUGH_GUESS = 0.2  #: error of a first guess above which the tangent of the state before is of no use
FIRST_RATE = 0.1  #: share of the error that an iteration is taken to leave before it is known
ITERATIONS_OF_TANGENT = 15.0  #: iterations that take as long as a tangent; a new one is factored if more are likely
ARC_GROWTH = (0.5, 1.5)  #: of the arc length from step to step
MOST_CUTS = 10  #: halvings of a step, after which a path ends
PLACE_REFINEMENTS = 14  #: of the place where stability is lost
CRITICAL_SHARE = 1e-3  #: share of the smallest eigenvalue, and of the arc length, at which stability is lost
NEARLY_SAME = (0.05, 1e-5)  #: or the share of the arc length with a relative distance of load factors
SAME_FACTOR = 1e-7  #: relative distance of load factors that are one


def solve_path(
    truss: Truss,
    load: str = "",
    *,
    imperfection: str | np.ndarray = "mode",
    buckling: Modes | None = None,
    steps: int = PATH_STEPS,
    stop_factor: float | None = None,
    beyond: int = STEPS_BEYOND,
    progress: Progress | None = None,
) -> Path:
    """Return how a structure moves under a growing load, past the limit that it carries.

    Members are co-rotational (see `corotational`), supports and joints those of the structure. All of a combination grows together,
    temperature, lack of fit and settlements too. An imperfection of the shape of a mode is tried with both signs, and the path is that
    which loses its stability first.

    Parameters
    ----------
    truss : Truss
        With supports and load cases.
    load : str
        Load case or combination; "" is the one that buckles first by linear theory.
    imperfection : str or (V, 3) array
        mode (the lowest linear buckling mode, its greatest displacement span/300), mode:30mm, scan (the grid against its fair
        surface), scan:30mm, none; or displacements of the nodes [m].
    buckling : Modes, optional
        Linear buckling of the structure, where it is known already; `load` is theirs then.
    steps : int
        At most; more where stability is lost is looked for are not counted.
    stop_factor : float, optional
        Load factor at which a path ends; by default `FACTOR_AT_END` times the linear buckling factor.
    beyond : int
        Steps after the structure has lost its stability.
    progress : Progress, optional
        Called after each step.

    Returns
    -------
    Path
        Each of its states in equilibrium to `BALANCED_ERROR`. It ends after at most `steps` steps of at most `MOST_CUTS` halvings of
        at most `MOST_ITERATIONS` iterations; `Path.ended` says why.

    Raises
    ------
    InputError
        There is no such load, nothing can move, a number is out of range, or the structure is a mechanism.
    """
    if steps < 1 or beyond < 0 or not (stop_factor is None or 0 < stop_factor < math.inf):
        raise InputError(f"a path needs 1 step or more and a positive load factor, got {steps} and {stop_factor}")
    factored = factor_stiffness(truss)
    if factored.factor is None:
        raise InputError("every node is fixed, so nothing can move and there is no path")
    modes = buckling or _first_mode(factored, load)
    linear = float(modes.values[0]) if len(modes.values) else None
    case = combined_case(truss, modes.of)
    last = stop_factor or (FACTOR_AT_END * linear if linear else UNBUCKLED_FACTOR)
    shapes = list(imperfection_of(truss, imperfection, modes))
    factored = replace(factored, factor=None)  # as large as a tangent, of which several are kept
    found: tuple[_Walk, Imperfection] | None = None
    for shape in shapes:
        limit = found[0].limit_factor if found else None
        end = last if limit is None else min(last, limit)
        bent = truss.replace(nodes=shape.perfect + shape.moves)
        balance = Equilibrium(replace(factored, truss=bent), case)
        walk = _Walk(balance, min(linear or math.inf, last) / FIRST_STEPS, end, steps, beyond, progress)
        walk.run(to_critical=len(shapes) > 1)
        now = walk.limit_factor
        if found is None or (now is not None and (limit is None or now < limit * (1 - SAME_FACTOR))):
            found = walk, shape
        del walk, balance
    assert found is not None
    chosen, shape = found
    chosen.run()  # beyond where stability is lost, where it has not gone on
    return chosen.path(modes.of, shape, linear)


def _first_mode(factored: Factored, load: str) -> Modes:
    """Return the lowest linear buckling mode of a load, or of that which buckles first."""
    solution = solve(factored.truss, factored)
    return buckling_modes(factored, solution[load], 1) if load else worst_buckling(factored, solution, 1)


def combined_case(truss: Truss, name: str) -> LoadCase:
    """Return the loads of a case or combination as one case."""
    cases = {case.name: case for case in truss.cases}
    if name in cases:
        return cases[name]
    factors = next((each.factors for each in truss.combinations if each.name == name), None)
    if factors is None or any(case not in cases for case, _ in factors):
        raise InputError(f"no load case or combination {name!r}; there are {', '.join(cases)}")
    sums: dict[str, Any] = {}
    for case, factor in factors:
        for part in ("nodal", "line", "temperature", "strain", "settlement"):
            if (value := getattr(cases[case], part)) is not None:
                sums[part] = sums.get(part, 0.0) + factor * np.nan_to_num(value)
    return LoadCase(name, self_weight=sum(factor * cases[case].self_weight for case, factor in factors), **sums)


class _Walk:
    """One path, step by step."""

    def __init__(
        self, balance: Equilibrium, first: float, end: float, steps: int, beyond: int, progress: Progress | None
    ) -> None:
        self.balance, self.end, self.steps, self.beyond, self.progress = balance, end, steps, beyond, progress
        self.arc = first  # of the first step as a load factor, until it is known as a length
        self.states: list[LoadedState] = [balance.start()]
        self.negative = [0]
        self.critical: int | None = None
        self.kind = self.ended = ""
        self.done = self.after = 0
        self.back = np.zeros(0)
        self.soft = 0.0

    @property
    def limit_factor(self) -> float | None:
        """The load factor at which the structure loses its stability, as far as is known."""
        return None if self.critical is None else self.states[self.critical].factor

    def run(self, *, to_critical: bool = False) -> None:
        """Take steps until the path ends, or stability is lost; from there it can go on."""
        if self.ended:
            return
        here = self._place(self.states[-1])
        if not self.done:
            self.soft, self.back = self._norm(here.towards), here.towards
            self.arc *= self.soft
        while self.done < self.steps:  # each turn takes a step, or the path ends
            for cut in range(MOST_CUTS + 1):
                step = None  # lets go of its tangent
                step = self._step(here, self.back, self.arc)
                if step is not None and (cut >= SMOOTH_CUTS or self._is_smooth(here, step)):
                    break
                self.arc /= 2
            else:
                self.ended = f"no state of equilibrium was found beyond the factor {here.state.factor:.4g}"
                return
            there, taken, work = step
            del step
            self.done += 1
            if there.tangent.negative == 0 and there.state.factor >= self.end:
                there = self._at_factor(here, taken, there)
            elif self.critical is None and there.tangent.negative:
                state, known = there.state, (there.tangent.smallest, there.state.factor, self._falls(there, taken))
                del there  # lets go of its tangent
                self._find_critical(here, self.back, self.arc, known)
                there = self._place(state)
            self._keep(there)
            if self.progress is not None:
                self.progress("path", self.done / self.steps)
            if there.state.factor >= self.end * (1 - SAME_FACTOR):
                self.ended = f"the load factor {self.end:.4g} is reached"
                return
            if self.critical is not None:
                self.after += 1
                if self.after > self.beyond:
                    self.ended = f"{self.beyond} steps beyond the {self.kind}"
                    return
            here, self.back = there, taken
            self.arc *= min(max(math.sqrt(WANTED_WORK / work), ARC_GROWTH[0]), ARC_GROWTH[1])
            if to_critical and self.critical is not None:
                return
        self.ended = f"{self.steps} steps are done"

    def path(self, name: str, imperfection: Imperfection, linear: float | None) -> Path:
        """Return what was found."""
        balance = self.balance
        answers = [balance.answer(state) for state in self.states]
        pairs = list(zip(self.states, answers, strict=True))
        return Path(
            truss=balance.truss,
            name=name,
            imperfection=imperfection,
            factors=np.array([state.factor for state in self.states]),
            displacements=np.stack([state.displacements for state in self.states]),
            reactions=np.stack([balance.reactions(state, answer) for state, answer in pairs]),
            axial=np.stack([answer.natural[:, LENGTHEN] for answer in answers]),
            equilibrium_errors=np.array(
                [0.0] + [balance.error(*pair, balance.unbalanced(*pair)) for pair in pairs[1:]]
            ),
            negative_pivots=np.array(self.negative),
            critical=self.critical,
            kind=self.kind,
            ended=self.ended,
            linear_factor=linear,
        )

    def _keep(self, place: _Place) -> None:
        self.states.append(place.state)
        self.negative.append(place.tangent.negative)

    def _norm(self, step: np.ndarray) -> float:
        return math.sqrt(float(np.square(step * self.balance.weights).sum()))

    def _place(self, state: LoadedState) -> _Place:
        """Return a state of equilibrium with its tangent."""
        response = self.balance.respond(state, tangents=True)
        tangent = self.balance.tangent(response)
        return _Place(state, response, tangent, tangent.solve(self.balance.direction(response)))

    def _step(
        self, here: _Place, back: np.ndarray, arc: float, to: float | None = None
    ) -> tuple[_Place, np.ndarray, int] | None:
        """Return the state at an arc length, or at the load factor `to`, with the way there and the work; None if none is found."""
        balance, tangent, towards = self.balance, here.tangent, here.towards
        scale = balance.weights**2
        ahead = product(back, scale * towards)
        more = math.copysign(arc / self._norm(towards), ahead) if to is None else to - here.state.factor
        taken, state = more * towards, here.state
        first = step = taken
        mixture, fresh, rate, error = Mixture(balance.weights), 0, 1.0, 0.0
        for iteration in range(1, MOST_ITERATIONS + 1):
            last, state = state, balance.moved(state, step, more)
            answer = balance.answer(state)
            if answer.too_far or not np.isfinite(answer.forces).all():
                return None
            left = balance.unbalanced(state, answer)
            before, error = error, balance.error(state, answer, left)
            if error <= BALANCED_ERROR:
                if to is None and product(taken, scale * first) <= 0:  # it has turned back
                    return None
                tangent = here.tangent  # lets go of a newer one, which takes much memory
                return self._place(state), taken, iteration + 4 * fresh
            if iteration == 1:
                rate = 1.0 if error > ROUGH_GUESS else FIRST_RATE
            else:
                rate = error / before if iteration == 2 else math.sqrt(rate * error / before)
            if rate >= 1 or math.log(BALANCED_ERROR / error) < ITERATIONS_OF_TANGENT * math.log(rate):
                if fresh == MOST_TANGENTS:
                    return None
                fresh, rate, mixture = fresh + 1, FIRST_RATE, Mixture(balance.weights)
                before_it = here.response if last is here.state else balance.respond(last)
                response = balance.respond(state, foreseen=balance.foresee(before_it, step), tangents=True)
                tangent = here.tangent  # lets go of a newer one, which takes much memory
                tangent = balance.tangent(response)
                towards = tangent.solve(balance.direction(response))
            step, more = tangent.solve(left[balance.free]), 0.0
            if to is None:
                off = (self._norm(taken) ** 2 - arc**2) / 2 + product(taken, scale * step)
                more = -off / product(taken, scale * towards)
                step = step + more * towards
            step, more = mixture.improved(step, more)
            taken = taken + step
        return None

    def _falls(self, place: _Place, taken: np.ndarray) -> bool:
        """Whether the load falls as the path goes on."""
        return product(taken, self.balance.weights**2 * place.towards) < 0

    def _is_smooth(self, here: _Place, step: tuple[_Place, np.ndarray, int]) -> bool:
        """Whether a step follows the path closely: it goes on as it began, and the stiffness (Bergan 1980) changes little."""
        there, taken, _ = step
        weighted = self.balance.weights**2 * taken
        before, after = (product(weighted, place.towards) / self._norm(place.towards) for place in (here, there))
        cosine = abs(before) / self._norm(taken)
        stiffness = [self.soft / self._norm(place.towards) for place in (here, there)]
        change = abs(stiffness[1] * math.copysign(1.0, after * before) - stiffness[0])
        return cosine >= SMOOTH_STEP[0] and change <= SMOOTH_STEP[1] * max(1.0, stiffness[0])

    def _at_factor(self, here: _Place, taken: np.ndarray, there: _Place) -> _Place:
        """Return the state at the load factor where the path is to end, or the one beyond it."""
        found = self._step(here, taken, 0.0, self.end)
        return there if found is None or found[0].tangent.negative else found[0]

    def _find_critical(self, here: _Place, back: np.ndarray, arc: float, known: tuple[float, float, bool]) -> None:
        """Keep the last stable state before an arc length, where the smallest eigenvalue of the tangent is nil: regula falsi (Illinois).

        Known of the state there are that eigenvalue, the load factor, and whether the load falls.
        """
        low, high = 0.0, arc
        value = start = here.tangent.smallest
        beyond, beyond_factor, falls = known
        last: tuple[LoadedState, int, float] | None = None  # without its tangent, which takes much memory
        last_factor = here.state.factor
        kept: bool | None = None
        for _ in range(PLACE_REFINEMENTS):
            share = value / (value - beyond)
            middle = low + (high - low) * min(max(share, 0.01), 0.99)
            found = self._step(here, back, middle)
            if found is None:  # try the middle, once
                if value == -beyond:
                    break
                value = -beyond
                continue
            stable = found[0].tangent.negative == 0
            if stable:
                low, value = middle, found[0].tangent.smallest
                last, last_factor = (found[0].state, found[0].tangent.negative, value), found[0].state.factor
                beyond /= 2 if stable is kept else 1
            else:
                high, beyond, beyond_factor = middle, found[0].tangent.smallest, found[0].state.factor
                falls = self._falls(found[0], found[1])
                value /= 2 if stable is kept else 1
            kept = stable
            found = None
            near = abs(beyond_factor - last_factor) < NEARLY_SAME[1] * abs(last_factor)
            softest = here.tangent.smallest if last is None else last[2]
            if softest < CRITICAL_SHARE * start or high - low < (NEARLY_SAME[0] if near else CRITICAL_SHARE) * arc:
                break
        if last is not None:
            self.states.append(last[0])
            self.negative.append(last[1])
        self.critical = len(self.states) - 1
        self.kind = "limit point" if falls else "bifurcation"


@dataclass(frozen=True, eq=False)
class _Place:
    """A state of equilibrium, and where the path goes from there."""

    state: LoadedState
    response: Response
    tangent: Tangent
    towards: np.ndarray  # (F,) displacements for a load factor of 1
