"""The picture of a refusal: the grid that fails, or the scan alone, with the places of the faults in red."""

from __future__ import annotations

from textwrap import wrap

import numpy as np

from ...errors import FrontError
from ...scan.cloud import PointCloud
from .legend import FAULT_COLOUR, Ring, Text
from .picture import PICTURE_SIZE, encode_picture, paint
from .strokes import cloud_strokes, oblique_view
from .style import PictureStyle

LINE_CHARACTERS = 110  # characters in a line


def encode_refusal(error: FrontError, cloud: PointCloud, *, style: PictureStyle | None = None) -> bytes:
    """Return a picture of why there is no grid, PNG.

    Parameters
    ----------
    error : FrontError
        With the grid that fails its certificate, or with a place alone: then it is marked on the scan.
    cloud : PointCloud
        The scan.
    style : PictureStyle, optional
        Views and size of the picture.
    """
    if error.grid is not None and len(error.grid.triangles) and error.grid.certificate is not None:
        return encode_picture(error.grid, cloud, style=style)
    size = (style.size if style else None) or PICTURE_SIZE
    em = 22.0 * min(size[0] / PICTURE_SIZE[0], size[1] / PICTURE_SIZE[1])  # height of the letters
    lines = wrap(str(error), LINE_CHARACTERS)
    texts = [
        Text(2 * em, size[1] - (2 + 1.6 * k) * em, words, em, "left", FAULT_COLOUR) for k, words in enumerate(lines)
    ]
    below = size[0], round(size[1] - (2 + 1.6 * len(lines)) * em)
    rings = []
    if error.where is not None:
        place = np.array([error.where]) - cloud.origin
        ((x, y),), _ = oblique_view(cloud, below)(place)
        rings = [Ring(float(x), float(y), 1.6 * em, FAULT_COLOUR), Ring(float(x), float(y), 3.2 * em, FAULT_COLOUR)]
    return paint(size, [cloud_strokes(cloud, below)], texts, rings)
