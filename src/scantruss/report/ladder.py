"""Which member lengths are tried in which order, and how many grids that may cost."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..errors import LinesError
from ..scan.member_length import length_range, round_length, suggest_length
from ..surface.samples import sample_surface
from ..surface.shape import wall_of_surface

if TYPE_CHECKING:
    from ..scan.cloud import PointCloud
    from ..settings import Settings

# grids that are made of a length before others are tried: where many are to be tried, usually, and when it is tried again
FIRST_TWO, A_FEW, SOME_MORE = 2, 4, 8
#: lengths to try in turn after the usual one, as multiples of it, with how many grids are made of each
LONGER_FIRST = (
    (1.4, A_FEW), (2.0, A_FEW), (1.0, SOME_MORE), (2.8, A_FEW), (1 / 1.4, A_FEW), (2.0, SOME_MORE), (1.4, SOME_MORE),
    (2.8, SOME_MORE), (0.5, A_FEW),
)  # fmt: skip
#: the same where the usual one passes, leaves out much or is torn: members are too long for thin parts rather than too short
SHORTER_FIRST = (
    (1 / 1.4, A_FEW), (1.4, A_FEW), (1.0, SOME_MORE), (0.5, A_FEW), (2.0, A_FEW), (1 / 1.4, SOME_MORE), (1.4, SOME_MORE),
    (2.8, A_FEW), (2.0, SOME_MORE),
)  # fmt: skip
#: lengths to try where none has passed, and where limbs are too thin besides, so that the third grid is that of the body without them
LAST_LENGTHS = ((1.4, FIRST_TWO), (2.0, FIRST_TWO), (2.8, FIRST_TWO))
LAST_WITH_LIMBS = ((0.85, 3), (0.6, 3), (2.0, FIRST_TWO))
LAST_PER_LENGTH = 3.0  # grids that are made for each of them, counted by their cost
NEARLY_NEXT = 1.45  # ratio of lengths that pass up to which the longer one stands for the next to the shorter
LINES_OF_A_SCANNER = 5  # fewest lines of points that may be those of a scanner
BETWEEN = 0.87  # ratio of a length between two, of which the longer passes, to that
NEXT_LENGTH = 1.4  # a length is suggested if that many times it passes too
STEPS_TO_FOLLOW = 4  # such steps that are gone down from one that closes openings or loses ridges to one that does not
PASSED_OVER = 1  # most lengths between that pass and follow no more where it is only ridges or narrow parts
SAME_LENGTH = 1.08  # ratio of lengths up to which what has come of one stands for the other
# lengths that are tried in place of one that failed
NEARBY_LENGTHS = (1.12, 0.9, 1.25, 0.8, 1.4, 0.7, 1.7, 0.6, 2.0, 0.5, 2.8)
# spacings in a member from which holes in the sampling are seldom taken for holes of the surface
SURE_PER_SPACING = 8.0
LENGTH_OF_WALL = 0.8  # of the thickness of a wall: at 1.4 times that, too, both of its sides are kept apart
MOSTLY_WALL = 0.4  # share of a scan on a thin wall from which on lengths are chosen for that
LEAST_OF_WALL = 5.0  # least length for a wall, in spacings
# share of the scan up to which lengths lose as much as one another, and how many times as much where all lose more
LOST_ALIKE, LOST_ALIKE_SHARE = 0.002, 1.2
MOST_LOST = 0.01  # share of the scan that may be lost at a length that is suggested
MOST_TRIED = 20.0  # grids that are made for a suggestion, or to find a length nearby, each counted by its cost
POINTS_LOOKED_AT = 2_000_000  # points that are looked at for that
LEAST_TRIED = 5.0  # grids that are made for that even where the scan has more points
TRIED_AROUND = 6.0  # grids that are made besides for the lengths of the table, one each
MOST_IN_ALL = MOST_TRIED + TRIED_AROUND
TRIED_USUAL = 4.0  # grids that are made at the usual length where no length nearby passes
FAR_TOO_SHORT = 0.2  # share of the shortest possible length below which the usual one is looked at alone: that length is in another unit
POINTS_PER_MEMBER = 9  # points that cost as much as a member of the grid
MOST_MEMBERS = 60_000  # members of a grid that is made to try a length
CLOSE_BEND = 0.95  # share of the scan that is less bent than the radius that is named
# lengths one after the other, all of whose grids are far from passing or fail by their fronts, beyond which none on that side is tried
HOPELESS_NEARBY = 2
# lengths that were tried from which on only longer ones are looked at where there is no hope for any
HOPELESS_LENGTHS = 3
# lengths that are tried beside the usual one where none of these passes, as multiples of it
BESIDE_USUAL = (1.12, 0.9, 1.25)
SOME_WALL = 0.1  # share of a scan on thin walls from which on these are named where no length passes


def usual_length(cloud: PointCloud, settings: Settings) -> float:
    """Return the length that suits a scan; where the lines of a scanner are too far apart for it, the next that sees a surface.

    Raises
    ------
    LinesError
        The points lie along lines at every length, or along so few that these are none of a scanner.
    """
    usual, (_, longest) = suggest_length(cloud), length_range(cloud)
    steps = math.ceil(math.log(max(longest / usual, 1.0), NEXT_LENGTH))
    refused: LinesError | None = None
    for step in range(steps + 1):
        length = usual if step == 0 else min(two_digits(usual * NEXT_LENGTH**step), longest)
        try:
            sample_surface(cloud, settings.replace(length=length))
        except LinesError as error:
            refused = refused or error
            if refused.lines < LINES_OF_A_SCANNER:
                break
        else:
            return length
    assert refused is not None
    raise refused


def two_digits(length: float) -> float:
    """Return a length rounded to the nearest of two digits."""
    return round_length(length, "nearest")


def length_of_wall(cloud: PointCloud, settings: Settings, usual: float) -> float | None:
    """Return the length that keeps both sides of a thin wall apart, as of a bowl; None where there is none, or too few points.

    usual : length below which a wall is thin
    """
    thickness, share = thin_wall(cloud, settings, usual)
    length = LENGTH_OF_WALL * thickness
    return length if share >= MOSTLY_WALL and length >= LEAST_OF_WALL * cloud.spacing else None


def thin_wall(cloud: PointCloud, settings: Settings, usual: float) -> tuple[float, float]:
    """Return how thick walls are that are thinner than the usual length [scan unit], and the share of the scan that they are."""
    samples = sample_surface(cloud, settings.replace(length=max(0.5 * usual, length_range(cloud)[0])))
    return wall_of_surface(samples, usual)
