"""What a line of folds is by the angles and gains along it: even, sharp, a lip, made."""

from __future__ import annotations

import numpy as np

FOLD_STRIDE = 0.25  # step from place to place along a fold [member lengths]
NEARLY_FULL_ANGLE = 0.9  # share of the ridge angle that counts as full: noise takes some away
LEAST_FULL_SHARE = 0.55  # least share of a ridge that has the full angle, unless that part is long enough
LONG_FULL = 2.5  # length of a ridge with the full angle that is enough, whatever its share [member lengths]
GAIN_OF_SURE = 90.0  # median gain of a line of folds that is sure, at least
GAIN_OF_MADE, LEAST_MADE = 1200.0, 4.0  # the same of one that was made, and its length [member lengths]
# bend from which on a fold is an edge, as waves are less steep, and median gain of such a line that was made or broke off
BEND_OF_EDGE, GAIN_OF_EDGE = np.radians(85.0), 500.0
# bend, median gain and length of a wide fold that goes on for longer than one that has grown [member lengths]
STEEP_FOLD, GAIN_OF_LONG, LONG_WIDE = np.radians(60.0), 800.0, 12.0
LEAST_ROUGH_RIDGE = 6.0  # least length of a line of folds on a rough scan [member lengths]
# share of the ridge angle by which half of such a line is folded at least, where it is not sure and longer
ROUGH_SHARE = 1.4
LEAST_SURE_ROUGH = 12.0  # least length of a sure line there that is folded by less [member lengths]
# bend of a wide fold from which on it is a lip, unless sharp edges of bodies are looked for
TURNS_BACK = np.radians(125.0)
PLACES_OF_TURN = 3  # places on both sides from which the turn of a line is taken
CORNER_TURN = 25.0  # by how much a line turns more in a corner than before and after it [degree]
SHORTEST_LINE_OF_FOLDS = 1.0  # least length of a line of folds [member lengths]
LEAST_FULL_LENGTH = 0.75  # least length of it with the full angle [member lengths]
SHARPEST_FOLD_ANGLE = 125.0  # a surface that bends by more is not folded but turns back: two sheets [degree]
SHARPEST_LIP = 200.0  # most that a surface bends at a wide fold, whose sides are known: the lip of a thin body turns by 180 [degree]
SHARPEST_EDGE = 155.0  # most that a surface bends at a fold where sharp edges of bodies are looked for [degree]
# median change of the bend from place to place, at most, of folds by up to 50 degrees and by 70 or more [degree]: blunt crests of nature
# are as sharp as blunt ridges that were made, but not as even
EVEN_FOLDS = (0.5, 3.5)
BLUNT_FOLD, ACUTE_FOLD = 50.0, 70.0  # angles of folds between which the allowed change of the bend grows [degree]
BY_NOISE = 0.2  # change of the bend that noise explains, for the root of the gain 1 [radian]
NEARLY_EVEN = 1.5  # times that change up to which a long line of folds may be a ridge beside others that are even
WIDE_UNEVEN = 2.0  # further change of the bend that is allowed of wide folds, whose places are less certain [degree]
SURE_GAIN = 25.0  # median gain, at least (F statistic)


def squares_between(places: np.ndarray, folds: np.ndarray) -> np.ndarray:
    """Squared distances (M, K) of places (M, 3) from those of folds (K,) FOLD."""
    squares: np.ndarray = ((places[:, None] - folds["place"]) ** 2).sum(axis=2)
    return squares


def runs_along(folds: np.ndarray, others: list[np.ndarray], length: float) -> bool:
    """Whether most of a line of folds (K,) FOLD lies within a length of others."""
    if not others:
        return False
    nearest = np.min([squares_between(folds["place"], other).min(axis=1) for other in others], axis=0)
    return bool((nearest < length**2).mean() > 0.5)


def is_lip(folds: np.ndarray, sharpest: float) -> bool:
    """Whether a line of wide folds (K,) FOLD is the lip of a thin body, at which the surface turns by more than at an edge [degree]."""
    return bool(np.median(folds["bend"]) >= np.radians(sharpest))


def is_made(folds: np.ndarray) -> bool:
    """Whether a line of wide folds (K,) FOLD is so long, and so steep or between sides so even, that it was made or broke off.

    Waves and what has grown are not.
    """
    is_edge = BEND_OF_EDGE <= np.median(folds["bend"]) < TURNS_BACK
    least = GAIN_OF_EDGE if is_edge else GAIN_OF_MADE
    return len(folds) * FOLD_STRIDE >= LEAST_MADE and bool(np.median(folds["gain"]) >= least)


def is_long_edge(folds: np.ndarray) -> bool:
    """Whether a line of wide folds (K,) FOLD is steep and goes on for longer than what has grown, if less even than what was made."""
    bend, gain = np.median(folds["bend"]), np.median(folds["gain"])
    return len(folds) * FOLD_STRIDE >= LONG_WIDE and bool(STEEP_FOLD <= bend < TURNS_BACK and gain >= GAIN_OF_LONG)


def is_sure(folds: np.ndarray, angle: float) -> bool:
    """Whether a line of folds (K,) FOLD is sharp, and so clear of the noise that no wide fold shows better where it runs."""
    return is_sharp(folds, angle) and bool(np.median(folds["gain"]) >= GAIN_OF_SURE)


def is_sharp(folds: np.ndarray, angle: float) -> bool:
    """Whether a line of folds (K,) FOLD has the full angle along enough of it."""
    full = folds["bend"] >= NEARLY_FULL_ANGLE * angle
    size = float(full.sum()) * FOLD_STRIDE
    return bool(size >= LONG_FULL or (size >= LEAST_FULL_LENGTH and full.mean() >= LEAST_FULL_SHARE))


def parts_of_fold(folds: np.ndarray) -> list[np.ndarray]:
    """The parts (K,) FOLD of a line of folds between its corners, where its direction turns more than before and after."""
    count = len(folds)
    if count < 4 * PLACES_OF_TURN:
        return [folds]
    ahead = folds["place"][PLACES_OF_TURN:] - folds["place"][:-PLACES_OF_TURN]
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1), 1e-300)[:, None]
    turn = np.zeros(count)
    turn[PLACES_OF_TURN : count - PLACES_OF_TURN] = np.arccos(
        np.clip((ahead[PLACES_OF_TURN:] * ahead[:-PLACES_OF_TURN]).sum(axis=1), -1.0, 1.0)
    )
    usual = np.maximum(np.roll(turn, 2 * PLACES_OF_TURN), np.roll(turn, -2 * PLACES_OF_TURN))
    parts, first = [], 0
    for k in range(PLACES_OF_TURN, count - PLACES_OF_TURN):
        if (
            turn[k] - usual[k] > np.radians(CORNER_TURN)
            and turn[k] == turn[k - PLACES_OF_TURN : k + PLACES_OF_TURN + 1].max()
        ):
            parts.append(folds[first : k + 1])
            first = k
    return [*parts, folds[first:]]


def is_clear_on_rough(folds: np.ndarray, angle: float) -> bool:
    """Whether an even line of folds (K,) FOLD is so long, sharp or sure that it is a ridge where many other places look folded."""
    long = len(folds) * FOLD_STRIDE
    if float(np.median(folds["bend"])) >= ROUGH_SHARE * angle:
        return long >= LEAST_ROUGH_RIDGE
    return long >= LEAST_SURE_ROUGH and is_sure(folds, angle)


def is_long(folds: np.ndarray, angle: float) -> bool:
    """Whether a sure line of folds (K,) FOLD has the full angle along so much of it that it says what kind of scan this is."""
    full = folds["bend"] >= NEARLY_FULL_ANGLE * angle
    return is_sure(folds, angle) and float(full.sum()) * FOLD_STRIDE >= LONG_FULL


def is_even(
    folds: np.ndarray, angle: float, sharpest: float = SHARPEST_FOLD_ANGLE, slack: float = 0.0, times: float = 1.0
) -> bool:
    """Whether a line of folds (K,) FOLD, a stride apart, has an angle and is as even as a ridge, or so many times less.

    What bends evenly is.
    """
    angles = folds["bend"]
    if len(folds) * FOLD_STRIDE < SHORTEST_LINE_OF_FOLDS or (angles >= angle).sum() * FOLD_STRIDE < LEAST_FULL_LENGTH:
        return False
    ahead = np.diff(folds["place"], axis=0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1), 1e-300)[:, None]
    bends = np.cross(ahead[1:], ahead[:-1])
    uneven = float(np.median(np.linalg.norm(np.diff(bends, axis=0), axis=1))) if len(bends) > 1 else 0.0
    gain, bend = float(np.median(folds["gain"])), np.degrees(float(np.median(angles)))
    most = np.radians(np.interp(bend, (BLUNT_FOLD, ACUTE_FOLD), EVEN_FOLDS) + slack) + BY_NOISE / np.sqrt(
        max(gain, 1.0)
    )
    return bool(gain >= SURE_GAIN and uneven <= times * most and bend < sharpest)


def smoothed(places: np.ndarray) -> np.ndarray:
    """Places (K, 3) along a fold with less of their noise; the ends stay."""
    smooth = places.copy()
    for reach in (1, 2):
        if len(places) > 2 * reach:
            weights = (reach + 1.0 - np.abs(np.arange(-reach, reach + 1))) / (reach + 1.0) ** 2
            last = len(places) - 2 * reach
            smooth[reach : len(places) - reach] = sum(w * places[o : o + last] for o, w in enumerate(weights))
    return smooth
