"""Types of a grid whose joints or panels were made alike: the kinds they were made, mirror images apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..grid.grid import Grid
from ..layouts.kinds import kinds_of_grid, parts_alike
from .clusters import Clusters, sorted_by_count
from .mirror_images import NO_IMAGE, image_of


class TypesWithImages(NamedTuple):
    """Types of nodes or panels, and which are mirror images."""

    types: Clusters
    image: np.ndarray  #: (K,) the type that is the mirror image of each, itself if it has an axis; else NO_IMAGE


def types_of_kinds(grid: Grid, parts: str, unit: float | None = None) -> TypesWithImages | None:
    """Return the types of nodes or panels that were made alike; None where they were not.

    A kind whose mirror images count for the same gives two types, if some fit turned over only: the second is represented by the part
    that is nearest to the mirror image of the first.

    Parameters
    ----------
    grid : Grid
    parts : str
        What they are, of `scantruss.grid.alike`.
    unit : float, optional
        What the mean member is in the structure [mm], for misfits of panels in mm; without it those of unit directions in degrees.
    """
    found, alike = kinds_of_grid(grid, parts), grid.alike
    if found is None or alike is None:
        return None
    vectors_of = parts_alike(grid)
    vectors = vectors_of.vectors(grid.nodes)
    upright, _ = vectors_of.misfits(vectors, found.representative, mirrored=False)
    own = upright[np.arange(len(found.of)), found.of]
    turned = found.mirrored & (own > alike.tolerance)
    misfit = np.where(turned, found.misfit, own)
    number = len(found.representative)
    of, one, second = found.of.copy(), found.representative.tolist(), dict[int, int]()
    for kind in np.unique(of[turned]).tolist():
        items = np.flatnonzero(turned & (found.of == kind))
        of[items] = len(one)
        one.append(int(items[misfit[items].argmin()]))
        second |= {one[kind]: one[-1], one[-1]: one[kind]}
    assert len(one) == number + len(second) // 2
    shown = 2.0 * np.degrees(np.arcsin(np.minimum(misfit / 2.0, 1.0))) if unit is None else unit * misfit
    types = sorted_by_count(of, np.array(one, np.int64), np.where(of >= 0, shown, np.nan))
    reached = vectors_of.image_misfits(vectors, types.representative)
    place = {item: k for k, item in enumerate(types.representative.tolist())}
    image = np.full(len(place), NO_IMAGE)
    for item, k in place.items():
        if item in second:
            image[k] = place[second[item]]
        elif not alike.mirrored or reached[k, k] <= alike.tolerance:
            image[k] = image_of(reached[k], k, alike.tolerance)
    return TypesWithImages(types, image)
