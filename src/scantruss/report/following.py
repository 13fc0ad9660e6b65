"""Which length to take in place of one that closes openings or loses ridges, or above which the next fails: a longer or a shorter one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .ladder import A_FEW, BETWEEN, FIRST_TWO, LOST_ALIKE, NEARLY_NEXT, PASSED_OVER, STEPS_TO_FOLLOW, two_digits

if TYPE_CHECKING:
    from .advice import Advice
    from .length_trial import LengthTrial

# members above which a grid is larger than most that are built: no ridge is worth so many where longer members pass as well
MEMBERS_FOR_RIDGES = 9_000
MORE_RIDGE = 2.0  # by how much more ridge a grid of longer members must follow to be taken for that, in their length
# ... or how many of the warnings it may have at most where openings are closed that it does not see
FEWER_WARNINGS = 0.5


def length_that_follows(advice: Advice, trial: LengthTrial) -> float:
    """Return the length of a trial that passes, or a longer or shorter one if that follows what this one does not, and loses no more.

    That is openings which this one closes, or ridges which it loses. A longer one is taken only if the next above it passes too.
    """
    if not trial.follows_less:
        return trial.length
    longer = advice.try_length(advice.next_above(trial.length), FIRST_TWO)
    if longer is not None and longer.passed and is_plainer(longer, trial):
        beyond = advice.try_length(advice.next_above(longer.length), FIRST_TWO)
        if beyond is not None and beyond.passed:
            return longer.length
    return _shorter_that_follows(advice, trial)


def is_plainer(longer: LengthTrial, trial: LengthTrial) -> bool:
    """Whether a grid of longer members follows more ridges than one that loses some, or spans no opening and cuts off no limb.

    As of ground with trees: a grid that climbs into some of them closes openings there that are none.
    """
    if longer.follows_less >= trial.follows_less or longer.lost > trial.lost + LOST_ALIKE:
        return False
    if trial.follows_less == 1:
        gain = longer.ridges_followed - trial.ridges_followed
        return longer.warnings <= trial.warnings and gain >= MORE_RIDGE * longer.length
    return longer.is_whole and longer.warnings <= FEWER_WARNINGS * trial.warnings


def _shorter_that_follows(advice: Advice, trial: LengthTrial) -> float:
    """Return the length of a trial, or a shorter one.

    Lengths between may follow no more, or not pass, as those too long for steps and too short for the slope along them.
    """
    above, passed_over, all_pass = trial, 0, True
    only_ridges = trial.follows_less == 1
    for _ in range(STEPS_TO_FOLLOW):
        below = advice.next_below(above.length)
        if only_ridges and all_pass and advice.members(below) > MEMBERS_FOR_RIDGES:
            break
        shorter = advice.try_length(below, FIRST_TWO) if below < above.length else None
        if shorter is None or (shorter.passed and shorter.lost > trial.lost + LOST_ALIKE):
            break
        if shorter.passed and above.passed and shorter.follows_less < trial.follows_less:
            return below
        passed_over += shorter.passed
        all_pass &= shorter.passed
        if passed_over > PASSED_OVER and only_ridges:
            break
        above = shorter
    return trial.length


def shorter_with_next_above(advice: Advice, length: float) -> float | None:
    """Return a length below one that passes which passes too, with what is next above it; None where there is none.

    It is the next below, or one between the two where that fails, as in scans with gaps: what bridges them is too long, shorter members
    see others.
    """
    below = advice.next_below(length)
    trial = advice.try_length(below, A_FEW)
    if trial is not None and trial.passed and length <= NEARLY_NEXT * below:
        return below
    between = two_digits(BETWEEN * length)
    tried = (advice.try_length(each, A_FEW) for each in (between, advice.next_above(between)))
    return between if all(trial is not None and trial.passed for trial in tried) else None
