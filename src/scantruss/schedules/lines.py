"""Schedules in a few lines: how much there is of what, and what is warned of."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import words_of_number
from ..grid.alike import JOINTS, PANELS
from ..structure.loads import MOST_ALLOWANCE
from .clashes import HEAVY_BALLS

if TYPE_CHECKING:
    from ..grid.alike import Alike
    from .records import Schedule, Schedules
    from .settings import ScheduleSettings


def schedule_lines(made: Schedules, settings: ScheduleSettings, alike: Alike | None = None) -> list[str]:
    """Say how much there is of what, and what is warned of; `alike` says which parts were made so."""
    within = {JOINTS: f"{settings.angle_tolerance:g} degrees", PANELS: f"{settings.tolerance:g} mm"}
    if alike is not None and alike.parts in within:
        within[alike.parts] = f"{100 * alike.tolerance:g} %, as they were made alike"
    cut = sum(value for value in made.lengths["total"] if isinstance(value, float))
    lines = [
        f"{len(made.nodes):,} nodes of {len(made.node_types):,} types within {within[JOINTS]}"
        + mirrored_words(made.node_types),
        f"{len(made.members):,} members of {len(made.lengths):,} lengths within {settings.tolerance:g} mm, cut {words_of_number(cut, 4)} m",
        f"{len(made.panels):,} panels of {len(made.panel_types):,} types within {within[PANELS]}"
        + mirrored_words(made.panel_types),
    ]
    return [*lines, *schedule_warnings(made.warnings)]


def mirrored_words(types: Schedule) -> str:
    """Say how many types there are if mirror images count once; nothing where there are as many."""
    if all(each.name != "mirror image" for each in types.columns):
        return ""
    first = types.columns[0].values
    seen = {
        frozenset((own, image)) for own, image in zip(first, types["mirror image"], strict=True) if image is not None
    }
    alone = sum(image is None for image in types["mirror image"])
    once = len(seen) + alone
    return f", {once:,} if mirror images count once" if once < len(first) else ""


def schedule_warnings(warnings: Schedule) -> list[str]:
    """Say of each kind of warning how many there are, and the worst."""
    lines = []
    for words in dict.fromkeys(warnings["warning"]):
        rows = [row for row in warnings.rows if row[0] == words]
        _, at, _, worst, given, measure, *_ = max(rows, key=lambda row: abs(float(row[3] or 0) - float(row[4] or 0)))
        value, limit = float(worst or 0), None if given is None else float(given)
        most = f"{words_of_number(value, 4)} {measure}".rstrip() + ("" if at is None else f" at {at}")
        if words == HEAVY_BALLS and limit is not None:
            way = (
                f"structure --node-allowance {value / 100:.2f} takes that into account"
                if value <= 100 * MOST_ALLOWANCE
                else f"structure takes {MOST_ALLOWANCE:.0%} at most: thinner tubes or longer members make balls lighter beside them"
            )
            lines.append(
                f"warning: the balls weigh {value:.0f} % of the members, and the structure was solved with {limit:.0f} % for its nodes;"
                f" {way}"
            )
        elif limit is None:  # what is never carried at all
            lines.append(f"warning: {words}; the greatest is {most}")
        elif len(rows) == 1:
            lines.append(f"warning: {words}: {most}, limit {words_of_number(limit, 4)}")
        else:
            lines.append(f"warning: {words}: {len(rows):,}, the worst {most}, limit {words_of_number(limit, 4)}")
    return lines
