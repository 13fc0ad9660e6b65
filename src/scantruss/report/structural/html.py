"""The report of a structure as one HTML file: style and pictures within, nothing from the network."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

from ...export.drawing.structure import drawing_defaults, webp_of
from ...runtime.ours import MADE_BY
from .parts import DataTable, Headline, Illustration, Listing, PointList, ReportPart, SectionHead, Sentence

PICTURE_INCHES = 11.0  #: width of a picture in the page, at 100 pixels an inch
PAGE_STYLE = """\
:root { color-scheme: light } * { box-sizing: border-box }
body { font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; color: #1a2433; background: #fff;
  max-width: 70rem; margin: 2.5rem auto; padding: 0 1.5rem }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 } .below { color: #5b6675; margin: .3rem 0 1.5rem }
h2 { font-size: 1.2rem; margin: 2.4rem 0 .6rem; padding-bottom: .25rem; border-bottom: 2px solid #58869e }
table { border-collapse: collapse; font-size: .87rem; font-variant-numeric: tabular-nums; margin: .6rem 0 }
.wide { overflow-x: auto } th, td { padding: .22rem .8rem .22rem 0; text-align: right; vertical-align: top }
th { border-bottom: 1px solid #8b95a1; font-weight: 600; vertical-align: bottom }
td { border-bottom: 1px solid #e6e9ec } tr:hover td { background: #f4f7f8 } .w { text-align: left }
ul { margin: .4rem 0; padding-left: 1.2rem } li { margin: .1rem 0 } .note { color: #5b6675; font-size: .87rem }
.warn { background: #fdf3e7; border-left: 4px solid #d08323; padding: .45rem .8rem; margin: .5rem 0 }
pre { background: #f4f6f7; border: 1px solid #e0e4e7; border-radius: 4px; padding: .8rem 1rem; font-size: .82rem;
  white-space: pre-wrap; overflow-wrap: anywhere }
figure { margin: 1rem 0 1.6rem } img { width: 100%; height: auto; border: 1px solid #e6e9ec }
iframe { width: 100%; height: 40rem; border: 1px solid #c9d0d6 } @media print { iframe { display: none } }
figcaption { color: #38434f; font-size: .92rem; margin-top: .35rem }
@media print { html { font-size: 10.5px } body { margin: 0; max-width: none; font-size: 1rem }
  figure, tr { break-inside: avoid } h2 { break-after: avoid } }"""


def encode_html(parts: Sequence[ReportPart], view: bytes = b"") -> bytes:
    """Return the parts of a report as one page, with the page of a 3D view within it."""
    title = next((part.words for part in parts if isinstance(part, Headline)), "Structure")
    with drawing_defaults():
        written = [_html(part) for part in parts]
    if view:
        written.insert(1, f'<iframe title="3D view" srcdoc="{escape(view.decode())}"></iframe>')
    body = "\n".join(written)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n<meta name="generator" content="{MADE_BY}">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{escape(title)}</title>\n'
        f'<style>\n{PAGE_STYLE}\n</style></head><body>\n{body}\n<p class="note">{MADE_BY}</p>\n</body></html>\n'
    ).encode()


def _html(part: ReportPart) -> str:
    """Return a part as HTML."""
    match part:
        case Headline():
            return f'<h1>{escape(part.words)}</h1>\n<p class="below">{escape(part.below)}</p>'
        case SectionHead():
            return f"<h2>{escape(part.words)}</h2>"
        case Sentence():
            kind = ' class="warn"' if part.warns else ""
            return f"<p{kind}>{escape(part.words)}</p>"
        case PointList():
            return "<ul>" + "".join(f"<li>{escape(words)}</li>" for words in part.words) + "</ul>"
        case Listing():
            return f"<pre>{escape(part.text)}</pre>"
        case DataTable():
            return _table(part)
        case Illustration():
            return _figure(part)


def _table(part: DataTable) -> str:
    """Return a table; words stand left, numbers right."""
    classes = [' class="w"' if column in part.words else "" for column in range(len(part.head))]
    head = "".join(f"<th{kind}>{escape(cell)}</th>" for kind, cell in zip(classes, part.head, strict=True))
    rows = "\n".join(
        "<tr>" + "".join(f"<td{kind}>{escape(cell)}</td>" for kind, cell in zip(classes, row, strict=True)) + "</tr>"
        for row in part.rows
    )
    note = f'<p class="note">{escape(part.note)}</p>' if part.note else ""
    return f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody></table></div>{note}'


def _figure(part: Illustration) -> str:
    """Return a picture with its caption, the picture within the page."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(PICTURE_INCHES, PICTURE_INCHES * part.tall), dpi=100, facecolor="white")
    part.draw(figure, (0.005, 0.005, 0.99, 0.99))
    text = base64.b64encode(webp_of(figure)).decode("ascii")
    words = escape(part.caption)
    return f'<figure><img alt="{words}" src="data:image/webp;base64,{text}"><figcaption>{words}</figcaption></figure>'
