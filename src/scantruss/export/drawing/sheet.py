"""One picture of many: all grids of a sweep side by side."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...runtime.ours import MADE_BY
from .strokes import INK_COLOUR, PAPER_COLOUR

PICTURE_OF_SHEET = (560, 420)  #: of one of them, all of which is shown [pixel]
TITLE_HEIGHT = 60  # above each [pixel]
PICTURES_IN_A_ROW = 4  # in a row


def encode_sheet(pictures: Sequence[tuple[str, bytes]]) -> bytes:
    """Return one PNG of PNGs with a title each, row by row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    columns = min(PICTURES_IN_A_ROW, max(len(pictures), 1))
    rows = -(-len(pictures) // columns)
    wide, tall = columns * PICTURE_OF_SHEET[0], rows * (PICTURE_OF_SHEET[1] + TITLE_HEIGHT)
    figure = Figure(figsize=(wide / 100, tall / 100), dpi=100, facecolor=tuple(PAPER_COLOUR))
    canvas: Any = FigureCanvasAgg(figure)
    for number, (title, png) in enumerate(pictures):
        x, y = (
            number % columns * PICTURE_OF_SHEET[0],
            tall - (number // columns) * (PICTURE_OF_SHEET[1] + TITLE_HEIGHT) - TITLE_HEIGHT,
        )
        with Image.open(io.BytesIO(png)) as image:
            small = image.convert("RGB").resize(PICTURE_OF_SHEET, Image.Resampling.LANCZOS)
        figure.figimage(np.asarray(small), x, y - PICTURE_OF_SHEET[1], origin="upper")
        figure.text(
            (x + PICTURE_OF_SHEET[0] / 2) / wide,
            (y + TITLE_HEIGHT / 2) / tall,
            title,
            fontsize=12,
            color=tuple(INK_COLOUR),
            ha="center",
            va="center",
            family="DejaVu Sans",
        )
    stream = io.BytesIO()
    canvas.print_png(stream, metadata={"Software": MADE_BY})
    return stream.getvalue()
