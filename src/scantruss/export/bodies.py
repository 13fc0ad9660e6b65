"""The bodies of members and nodes: sections, balls, and where the members meet the balls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import FormatError
from .model import Model
from .style import FileStyle

if TYPE_CHECKING:
    from ..structure.catalogue import Section


@dataclass(frozen=True, eq=False)
class Bodies:
    """What is built of the lines of a model [m]."""

    sections: tuple[Section, ...]
    section_of: np.ndarray  #: (M,) int64
    axes: np.ndarray  #: (M, 3, 3) local axes as rows: x along the member, z nearest to the normal of the surface
    ball: float  #: radius of the balls; 0 for none
    inset: np.ndarray  #: (M,) from a node to the end of the member at its ball
    lengths: np.ndarray  #: (M,) from end to end


def bodies_of(model: Model, style: FileStyle) -> Bodies | None:
    """Return the bodies of a structure, or of a grid whose tube the style names; None where nothing says how thick members are.

    A member ends where the corners of its section meet the ball.

    Raises
    ------
    FormatError
        The unit of a grid with a tube is not known, or a member is shorter than its balls.
    """
    from ..structure.catalogue import circular_hollow

    metres = model.metres
    if model.truss is not None:
        sections, section_of, axes = model.truss.sections, model.truss.section_of, model.truss.axes
    elif style.tube is not None:
        if not model.unit:
            raise FormatError("a tube has a diameter in mm, and the unit of the grid is not known; give it with --unit")
        diameter, wall = style.tube
        assert wall is not None
        sections = (circular_hollow(f"CHS{diameter:g}x{wall:g}", diameter / 1e3, wall / 1e3),)
        section_of, axes = np.zeros(len(model.members), np.int64), member_axes(model)
    else:
        return None
    reach = np.array(
        [each.width / 2 if each.shape == "CHS" else math.hypot(each.width, each.depth) / 2 for each in sections]
    )
    ball = 2 * float(reach.max()) if style.ball is None else style.ball / 2e3
    inset = np.sqrt(np.maximum(ball**2 - reach**2, 0.0))[section_of]
    lengths = model.lengths * metres - 2 * inset
    if len(lengths) and lengths.min() <= 0:
        mark = model.member_marks[int(lengths.argmin())]
        raise FormatError(
            f"member {mark} is shorter than its balls of {2e3 * ball:.4g} mm; give smaller ones with --ball"
        )
    return Bodies(sections, section_of, axes, ball, inset, lengths)


def member_axes(model: Model) -> np.ndarray:
    """Return the (M, 3, 3) local axes of the members of a grid, z as near to upwards as can be."""
    from ..structure.truss import local_axes

    ends = model.local[model.members]
    along = (ends[:, 1] - ends[:, 0]) / np.maximum(model.lengths, 1e-300)[:, None]
    return local_axes(along, np.tile([0.0, 0.0, 1.0], (len(along), 1)))
