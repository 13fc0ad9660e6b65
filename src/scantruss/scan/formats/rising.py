"""A first column without a name that only rises: the number of a point, a time, or x."""

from __future__ import annotations

import numpy as np

from .layout import Layout

NAME_IT = "a first line that names the columns (time x y z ...) settles it"


def rises(values: np.ndarray) -> bool:
    """Whether each value is larger than the one before; missing ones do not count."""
    return bool((np.diff(values[np.isfinite(values)]) > 0).all())


def is_number_of_point(values: np.ndarray) -> bool:
    """Whether values are whole numbers that only rise, with or without gaps."""
    return rises(values) and not (values[np.isfinite(values)] % 1).any()


def has_unnamed_first(layout: Layout) -> bool:
    """Whether the first of four or more columns may be a number, a time or x, as no header names it."""
    return not layout.named and layout.width > 3 and layout.columns[0] == 0


def first_column_note(name: str, layout: Layout, *parts: np.ndarray) -> tuple[str, ...]:
    """Return what should be said of how the first column of a file, or of parts of it, is taken; () where it is plain."""
    values = np.concatenate(parts) if parts else np.empty(0)
    if not has_unnamed_first(layout) or len(values) < 3:
        return ()
    if len(layout.columns) == 4 and is_number_of_point(values):
        if all((np.diff(part[np.isfinite(part)]) == 1).all() for part in parts):
            return ()
        return (
            f"the first column of {name}, whole numbers that only rise, is taken as the number of a point; {NAME_IT}",
        )
    if len(layout.columns) == 4:
        return (
            f"the first column of {name} counts up at the start, but not all through, and is taken as x; {NAME_IT}",
        )
    if rises(values):
        return (f"the first column of {name} only rises, as times do, and is taken as x; {NAME_IT}",)
    return ()
