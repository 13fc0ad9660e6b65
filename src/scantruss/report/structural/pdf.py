"""The report of a structure as PDF: the same parts set on A4 pages, with pictures as vectors."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

from ...export.drawing.strokes import INK_COLOUR
from ...export.drawing.structure import drawing_defaults
from ...runtime.ours import MADE_BY
from .parts import DataTable, Headline, Illustration, Listing, PointList, ReportPart, SectionHead, Sentence

A4 = (595.28, 841.89)  #: A4 [pt]
PAGE_MARGIN, TOP_MARGIN, PAGE_FOOT = 48.0, 50.0, 52.0  #: margins, the right one as the left [pt]
TEXT_WIDTH = A4[0] - 2 * PAGE_MARGIN
TEXT_SIZE, SMALL_TEXT_SIZE, CODE_SIZE = 9.0, 7.2, 7.0  #: sizes of letters [pt]
LEAST_TABLE = 4.5  #: size of the letters of a table so wide that it does not fit otherwise [pt]
PIXELS_TO_AN_INCH = 220  #: to an inch, of pictures of very many members
MEASURED_SIZE = 100.0  #: size of the letters that are measured [pt]
LINE_SPACING = 1.42  #: from line to line, in sizes of letters
PAGE_HEAD = 30.0  #: height of the head of a section [pt]
COLUMN_GAP = 9.0  #: between columns [pt]
BOLD_WIDTH = 1.18  #: width of bold letters over that of plain ones
GREY_COLOUR, RULE_COLOUR, WARNING_COLOUR = "#5b6675", "#8b95a1", "#a85a00"


class PdfPages:
    """Pages that are filled from the top; what does not fit begins a new one."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.figures: list[Any] = []
        self.y = 0.0  #: what is free above the lower margin ends here [pt]

    def room(self, height: float) -> float:
        """Return the top of a space of some height, on a new page if need be."""
        if not self.figures or self.y - height < PAGE_FOOT:
            from matplotlib.figure import Figure

            self.figures.append(Figure(figsize=(A4[0] / 72, A4[1] / 72), facecolor="white"))
            self.y = A4[1] - TOP_MARGIN
        top = self.y
        self.y -= height
        return top

    def keep(self, height: float) -> None:
        """Begin a new page unless this one has room for some height."""
        if self.y - height < PAGE_FOOT:
            self.y = 0.0

    def text(self, x: float, y: float, words: str, size: float = TEXT_SIZE, **style: Any) -> None:
        """Set a line of text with its base at y."""
        style.setdefault("color", tuple(INK_COLOUR))
        self.figures[-1].text(x / A4[0], y / A4[1], words, fontsize=size, va="baseline", parse_math=False, **style)

    def rule(self, y: float, width: float = TEXT_WIDTH, colour: str = RULE_COLOUR, bold: float = 0.5) -> None:
        """Draw a line from margin to margin."""
        from matplotlib.lines import Line2D

        ends = [PAGE_MARGIN / A4[0], (PAGE_MARGIN + width) / A4[0]]
        self.figures[-1].add_artist(Line2D(ends, [y / A4[1]] * 2, color=colour, linewidth=bold))

    def lines(
        self,
        lines: Sequence[str],
        size: float = TEXT_SIZE,
        indent: float = 0.0,
        spacing: float = LINE_SPACING,
        **style: Any,
    ) -> None:
        """Set lines of text."""
        for line in lines:
            top = self.room(spacing * size)
            self.text(PAGE_MARGIN + indent, top - 1.05 * size, line, size, **style)


def encode_pdf(parts: Sequence[ReportPart]) -> bytes:
    """Return the parts of a report as PDF; the same parts give the same bytes."""
    from matplotlib.backends.backend_pdf import PdfPages as PdfFile

    title = next((part.words for part in parts if isinstance(part, Headline)), "Structure")
    with drawing_defaults():
        pages = PdfPages(title)
        for part, after in zip(parts, [*parts[1:], None], strict=True):
            if isinstance(part, SectionHead):  # it stays with what follows
                pages.keep(PAGE_HEAD + (TEXT_WIDTH * after.tall + 40 if isinstance(after, Illustration) else 60))
            _SETTERS[type(part)](pages, part)
        stream = io.BytesIO()
        kept = {"Title": title, "Creator": MADE_BY, "Producer": MADE_BY, "CreationDate": None}
        with PdfFile(stream, metadata=kept) as file:
            for number, figure in enumerate(pages.figures, 1):
                for x, words, side in (
                    (PAGE_MARGIN, title, "left"),
                    (A4[0] - PAGE_MARGIN, f"{number} / {len(pages.figures)}", "right"),
                ):
                    figure.text(x / A4[0], 30 / A4[1], words, fontsize=7, color=GREY_COLOUR, ha=side, parse_math=False)
                file.savefig(figure, dpi=PIXELS_TO_AN_INCH)
    return stream.getvalue()


def _headline(pages: PdfPages, part: Headline) -> None:
    pages.lines(_wrapped(part.words, 19, TEXT_WIDTH), 19, weight="bold")
    pages.lines(_wrapped(part.below, TEXT_SIZE, TEXT_WIDTH), TEXT_SIZE, color=GREY_COLOUR)
    pages.room(6)


def _section_head(pages: PdfPages, part: SectionHead) -> None:
    top = pages.room(PAGE_HEAD)
    pages.text(PAGE_MARGIN, top - 20, part.words, 12, weight="bold")
    pages.rule(top - 25, colour="#58869e", bold=1.2)


def _sentence(pages: PdfPages, part: Sentence) -> None:
    pages.room(3)
    pages.lines(
        _wrapped(part.words, TEXT_SIZE, TEXT_WIDTH),
        TEXT_SIZE,
        color=WARNING_COLOUR if part.warns else tuple(INK_COLOUR),
    )


def _point_list(pages: PdfPages, part: PointList) -> None:
    pages.room(3)
    for words in part.words:
        first, *rest = _wrapped(words, 8.2, TEXT_WIDTH - 10)
        pages.lines([f"\u2013 {first}"], 8.2)
        pages.lines(rest, 8.2, indent=7.5)


def _listing(pages: PdfPages, part: Listing) -> None:
    pages.room(4)
    family = "DejaVu Sans Mono"
    for line in part.text.splitlines():
        pages.lines(
            _wrapped(line, CODE_SIZE, TEXT_WIDTH - 8, family) or [""], CODE_SIZE, indent=8, spacing=1.28, family=family
        )


def _data_table(pages: PdfPages, part: DataTable) -> None:
    """Set a table with columns as wide as their cells; the last column of words is wrapped if there is too little room."""
    size, widths = _fitting(part)
    gap = COLUMN_GAP * size / SMALL_TEXT_SIZE
    rights = [PAGE_MARGIN + sum(widths[: column + 1]) + gap * column for column in range(len(widths))]

    def row(cells: Sequence[str], **style: Any) -> None:
        wrapped = [_wrapped(cell, size, width + 0.5) or [""] for cell, width in zip(cells, widths, strict=True)]
        height = LINE_SPACING * size * max(map(len, wrapped)) + 1.6
        if pages.y - height < PAGE_FOOT:
            pages.y = 0.0
            head()
        top = pages.room(height)
        for column, lines in enumerate(wrapped):
            left = column in part.words
            for number, line in enumerate(lines):
                x = rights[column] - widths[column] if left else rights[column]
                pages.text(
                    x, top - LINE_SPACING * size * (number + 0.8), line, size, ha="left" if left else "right", **style
                )

    def head() -> None:
        wrapped = [
            _wrapped(cell, size, width / BOLD_WIDTH + 0.5) or [""]
            for cell, width in zip(part.head, widths, strict=True)
        ]
        most = max(map(len, wrapped))
        top = pages.room(LINE_SPACING * size * most + 5)
        for column, lines in enumerate(wrapped):
            left = column in part.words
            for number, line in enumerate(lines):
                x = rights[column] - widths[column] if left else rights[column]
                y = top - LINE_SPACING * size * (most - len(lines) + number + 0.8)
                pages.text(x, y, line, size, ha="left" if left else "right", weight="bold")
        pages.rule(pages.y + 2.5, rights[-1] - PAGE_MARGIN)

    pages.room(4)
    pages.keep(5 * LINE_SPACING * size)
    head()
    for cells in part.rows:
        row(cells)
    if part.note:
        pages.lines(_wrapped(part.note, SMALL_TEXT_SIZE, TEXT_WIDTH), SMALL_TEXT_SIZE, color=GREY_COLOUR)


def _fitting(part: DataTable) -> tuple[float, list[float]]:
    """Return the size of the letters of a table and the widths of its columns [pt]."""
    size = SMALL_TEXT_SIZE
    columns = list(zip(part.head, *part.rows, strict=True))
    while True:  # the letters become smaller, down to LEAST_TABLE
        widths = [
            max(
                [_width(cell, size) for cell in cells[1:]]
                + [max(_width(word, size) * BOLD_WIDTH for word in cells[0].split(" "))]
            )
            for cells in columns
        ]
        lack = sum(widths) + COLUMN_GAP * size / SMALL_TEXT_SIZE * (len(widths) - 1) - TEXT_WIDTH
        wide = max(part.words, key=lambda column: widths[column])
        if lack <= 0:
            return size, widths
        if widths[wide] - lack > 16 * size or size <= LEAST_TABLE:
            widths[wide] = max(widths[wide] - lack, 8 * size)
            return size, widths
        size -= 0.3


def _illustration(pages: PdfPages, part: Illustration) -> None:
    caption = _wrapped(part.caption, 8.2, TEXT_WIDTH)
    height = TEXT_WIDTH * part.tall
    top = pages.room(height + LINE_SPACING * 8.2 * len(caption) + 12)
    pages.y = top - height - 4
    place = (PAGE_MARGIN / A4[0], (top - height) / A4[1], TEXT_WIDTH / A4[0], height / A4[1])
    part.draw(pages.figures[-1], place)
    pages.lines(caption, 8.2, color=GREY_COLOUR)
    pages.y -= 8


_SETTERS: dict[type, Callable[[PdfPages, Any], None]] = {
    Headline: _headline, SectionHead: _section_head, Sentence: _sentence, PointList: _point_list, Listing: _listing,
    DataTable: _data_table, Illustration: _illustration,
}  # fmt: skip


def _wrapped(words: str, size: float, width: float, family: str = "DejaVu Sans") -> list[str]:
    """Return lines no wider than `width`, broken at spaces, or anywhere within a word that is too long."""
    lines: list[str] = []
    line = ""
    for word in _pieces(words, size, width, family):
        longer = f"{line} {word}" if line else word
        if line and _width(longer, size, family) > width:
            lines.append(line)
            line = word
        else:
            line = longer
    return [*lines, line] if line else lines


def _pieces(words: str, size: float, width: float, family: str) -> Iterator[str]:
    """Yield words, long ones in pieces."""
    for word in words.split(" "):
        while len(word) > 1 and _width(word, size, family) > width:
            fits = next((k for k in range(len(word) - 1, 1, -1) if _width(word[:k], size, family) <= width), 1)
            yield word[:fits]
            word = word[fits:]
        yield word


@cache
def _width(words: str, size: float, family: str = "DejaVu Sans") -> float:
    """Return the width of a line of text [pt]."""
    font = _font(family)
    font.set_size(MEASURED_SIZE, 72)  # large, as small letters are rounded to whole pixels
    font.set_text(words)
    return float(font.get_width_height()[0]) / 64 * size / MEASURED_SIZE


@cache
def _font(family: str) -> Any:
    from matplotlib.font_manager import findfont, get_font

    return get_font(findfont(family))
