"""The legend of a colouring: as HTML on the page, and drawn into pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path

import numpy as np

Rgb = tuple[int, int, int]
LETTERS_HIGH = 60  #: height of a picture over that of a letter of its legends
LEAST_WIDE = 12.0  #: of a scale in a picture [height of a letter]
LINE_HIGH, SCALE_HIGH, MARK_WIDE = (
    1.5,
    0.9,
    1.0,
)  #: of a line of a legend in a picture, its scale and a mark [height of a letter]
LEGEND_BEHIND, LEGEND_LETTERS = {False: (255, 255, 255), True: (30, 32, 36)}, {False: (0, 0, 0), True: (240, 240, 240)}
"""Behind and of the letters of a legend in a picture of a light and a dark page."""


@dataclass(frozen=True)
class ColourLegend:
    """What colours stand for: a scale between two values, marks of single colours, or both."""

    title: str
    unit: str = ""
    ends: tuple[float, float] | None = None  #: of the scale; None where there is none
    stops: tuple[Rgb, ...] = ()  #: colours of the scale, evenly spaced
    marks: tuple[tuple[Rgb, str], ...] = ()

    @property
    def name(self) -> str:
        """The title with the unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    @property
    def values(self) -> tuple[str, ...]:
        """What stands below the scale, from end to end."""
        if self.ends is None:
            return ()
        low, high = self.ends
        return tuple(f"{value:.4g}" for value in (low, (low + high) / 2, high))

    def with_mark(self, color: Rgb, words: str) -> ColourLegend:
        """Return the legend with another mark."""
        return replace(self, marks=(*self.marks, (color, words)))

    def html(self) -> str:
        """Return it as HTML."""
        scale = ""
        if self.ends is not None:
            stops = ",".join(f"rgb{color}" for color in self.stops)
            ends = "".join(f"<span>{value}</span>" for value in self.values)
            scale = (
                f'<div style="height:.8em;background:linear-gradient(to right,{stops})"></div>'
                f'<div style="display:flex;justify-content:space-between">{ends}</div>'
            )
        marks = "".join(
            '<div style="display:flex;gap:.5em;align-items:center"><span style="width:.9em;height:.9em;flex:none;'
            f'background:rgb{color}"></span>{escape(words)}</div>'
            for color, words in self.marks
        )
        return f'<div style="padding:0 .6em;font-size:.85em">{escape(self.name)}{scale}{marks}</div>'


def with_legends(pixels: np.ndarray, legends: Sequence[ColourLegend], is_dark: bool) -> np.ndarray:
    """Return a picture (H, W, 3) uint8 with legends in its lower left corner."""
    if not legends:
        return pixels
    import matplotlib
    from PIL import Image, ImageDraw, ImageFont

    letter = max(len(pixels) // LETTERS_HIGH, 6)
    font = ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), letter)
    picture = Image.fromarray(pixels)
    draw = ImageDraw.Draw(picture)
    line, mark = round(LINE_HIGH * letter), round(MARK_WIDE * letter)
    lines = sum(1 + 2 * (each.ends is not None) + len(each.marks) for each in legends)
    words = [draw.textlength(each.name, font) for each in legends]
    words += [2 * mark + draw.textlength(said, font) for each in legends for _, said in each.marks]
    wide = round(max(LEAST_WIDE * letter, *words))
    left, top = 2 * letter, len(pixels) - 2 * letter - lines * line
    draw.rectangle((left - letter, top - letter, left + wide + letter, len(pixels) - letter), LEGEND_BEHIND[is_dark])
    for each in legends:
        draw.text((left, top), each.name, LEGEND_LETTERS[is_dark], font)
        top += line
        if each.ends is not None:
            at = np.linspace(0, len(each.stops) - 1, wide)
            colors = np.array(each.stops, float)
            ramp = np.stack([np.interp(at, np.arange(len(colors)), colors[:, k]) for k in range(3)], axis=1)
            scale = np.repeat(np.rint(ramp).astype(np.uint8)[None], round(SCALE_HIGH * letter), axis=0)
            picture.paste(Image.fromarray(np.ascontiguousarray(scale)), (left, top))
            top += line
            for share, said in zip((0.0, 0.5, 1.0), each.values, strict=True):
                beside = share * (wide - draw.textlength(said, font))
                draw.text((left + beside, top), said, LEGEND_LETTERS[is_dark], font)
            top += line
        for color, said in each.marks:
            draw.rectangle((left, top, left + mark, top + mark), color)
            draw.text((left + 2 * mark, top), said, LEGEND_LETTERS[is_dark], font)
            top += line
    return np.asarray(picture)
