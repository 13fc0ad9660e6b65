"""One picture of many: all grids of a sweep side by side."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...runtime.ours import MARK
from .strokes import INK, PAPER

PICTURE = (560, 420)  #: of one of them, all of which is shown [pixel]
TITLE = 60  # above each [pixel]
PICTURES_IN_A_ROW = 4  # in a row


def encode_sheet(pictures: Sequence[tuple[str, bytes]]) -> bytes:
    """Return one PNG of PNGs with a title each, row by row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    columns = min(PICTURES_IN_A_ROW, max(len(pictures), 1))
    rows = -(-len(pictures) // columns)
    wide, tall = columns * PICTURE[0], rows * (PICTURE[1] + TITLE)
    figure = Figure(figsize=(wide / 100, tall / 100), dpi=100, facecolor=tuple(PAPER))
    canvas: Any = FigureCanvasAgg(figure)
    for number, (title, png) in enumerate(pictures):
        x, y = number % columns * PICTURE[0], tall - (number // columns) * (PICTURE[1] + TITLE) - TITLE
        with Image.open(io.BytesIO(png)) as image:
            small = image.convert("RGB").resize(PICTURE, Image.Resampling.LANCZOS)
        figure.figimage(np.asarray(small), x, y - PICTURE[1], origin="upper")
        figure.text(
            (x + PICTURE[0] / 2) / wide,
            (y + TITLE / 2) / tall,
            title,
            fontsize=12,
            color=tuple(INK),
            ha="center",
            va="center",
            family="DejaVu Sans",
        )
    stream = io.BytesIO()
    canvas.print_png(stream, metadata={"Software": MARK})
    return stream.getvalue()
