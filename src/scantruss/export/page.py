"""HTML: a grid or a structure as one page with a 3D view, its figures, certificate and settings.

Nodes are stored as float64 and read back to the last bit, points of the scan to 1/65535 of their box. WebGL 2 draws it.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import words_of_number
from ..grid.certificate import near
from ..grid.grid import Grid
from ..runtime.ours import MADE_BY
from ..scan.checks import usual_extent
from ..scan.cloud import PointCloud
from ..structure.checks import use_words
from .model import Model, model_of_grid
from .page_tables import Pin, colorings_of, pins_of, tables_of
from .style import PAGE_POINTS, FileStyle

PAGE_FOLDER = Path(__file__).parent
POINTS_TO_FIT = 1000  #: of a scan, which fit into its first view
NOTEBOOK_HEIGHT = 640  #: of a page within a notebook [pixel]
PAGE_LAYERS = (("members", True), ("nodes", True), ("panels", True), ("scan", False), ("pins", True))


def encode_page(model: Model, style: FileStyle) -> bytes:
    """Return the page of a grid or a structure."""
    tables = tables_of(model)
    grid = model.grid if model.truss is None else None
    certificate = None if grid is None else grid.certificate
    pins = [] if certificate is None else pins_of(certificate)
    mean = float(model.lengths.mean()) if len(model.members) else 1.0
    data: dict[str, Any] = {
        "unit": model.unit,
        "origin": model.origin.tolist(),
        "nodes": _packed(model.local, "<f8"),
        "members": _packed(model.members, "<i4"),
        "triangles": _packed(model.triangles, "<i4"),
        **({"loops": model.panel_loops} if model.panels.shape[1] > 3 else {}),
        "scan": _scan(model),
        "tables": {
            kind: [each._asdict() for each in columns]
            for kind, columns in tables.items()
        },
        "colorings": colorings_of(tables),
        "places": [{"words": f"{pin.words} {pin.value}".strip(), "where": (np.array(pin.where) - model.origin).tolist()} for pin in pins],
        "reach": mean,
        **({} if len(model.local) else {"home": _bulk(model)}),
    }  # fmt: skip
    is_scan = not len(model.local)
    what = "scan" if is_scan else "structure" if grid is None else "grid"
    title, below = _head_lines(model, what)
    hidden = " hidden" * is_scan
    parts = [
        f"<h1>{escape(title)}</h1>",
        f'<p class="below">{escape(below)}</p>',
        f'<h2{hidden}><label for="coloring">Colour</label></h2><select id="coloring"{hidden}></select><p>',
        *(
            f'<label{" hidden" * (is_scan and name != what)}><input type="checkbox" id="show-{name}"'
            f"{' checked' * (on or name == what)}> {name}</label>"
            for name, on in PAGE_LAYERS
        ),
        f'</p><h2{hidden}><label for="mark">Selected</label></h2>',
        f'<input type="search" id="mark" placeholder="mark, such as M0001" autocomplete="off"{hidden}>',
        f'<div id="row" aria-live="polite"{hidden}></div>',
        _certificate(model, pins),
        "" if is_scan else f"<h2>Figures</h2>{_table(_figures(model))}",
        _settings(model),
        '<details><summary>Keys and gestures</summary><p class="note">Drag: turn. Shift or right button and drag, or two'
        " fingers: move. Wheel, pinch, + and -: nearer, farther. Arrows: turn, with shift: move. Home: all of it."
        f' Escape: nothing selected.</p></details><p class="note">{MADE_BY}</p>',
    ]
    text = json.dumps(data, allow_nan=False, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    return "\n".join(
        [
            f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n<meta name="generator" content="{MADE_BY}">',
            f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{escape(title)}</title>',
            f"<style>\n{_own('page.css')}</style></head><body>",
            f'<main id="view"><canvas id="canvas" tabindex="0" role="img" aria-label="3D view of the {what}"></canvas>',
            '<div id="legend" hidden><div id="what"></div><div id="ramp"></div><div id="ends"></div></div></main>',
            '<aside id="side">',
            *parts,
            f'</aside>\n<script type="application/json" id="data">{text}</script>',
            f"<script>\n{_own('page.js')}</script></body></html>\n",
        ]
    ).encode()


def _head_lines(model: Model, what: str) -> tuple[str, str]:
    """Return the title of a page and the line below it."""
    unit = f", in {model.unit}" if model.unit else ""
    if what == "scan":
        cloud = model.cloud
        drawn = (
            ""
            if cloud is None
            else f"{min(len(cloud.points), PAGE_POINTS):,} of {len(cloud.points):,} points are drawn"
        )
        return (cloud.name if cloud is not None else "") or "Scan", f"{drawn}{unit}"
    title = f"{'Grid truss' if what == 'grid' else 'Structure'}, {len(model.local):,} nodes"
    return title, f"{len(model.members):,} members, {len(model.panels):,} panels{unit}"


class PageView:
    """A page within a notebook."""

    def __init__(self, page: bytes) -> None:
        self.page = page

    def _repr_html_(self) -> str:
        text = escape(self.page.decode("utf-8"))
        return f'<iframe srcdoc="{text}" style="width:100%;height:{NOTEBOOK_HEIGHT}px;border:0" title="grid"></iframe>'


def view_of_grid(grid: Grid, cloud: PointCloud | None = None) -> PageView:
    """Return the page of a grid for a notebook."""
    return PageView(encode_page(model_of_grid(grid, cloud), FileStyle()))


def view_of_cloud(cloud: PointCloud) -> PageView:
    """Return the page of a scan for a notebook."""
    none, names = np.zeros((0, 3), np.int64), tuple[str, ...]()
    model = Model(
        local=np.zeros((0, 3)), origin=np.asarray(cloud.origin, np.float64), members=none[:, :2], triangles=none, panels=none,
        unit=cloud.unit, node_marks=names, member_marks=names, panel_marks=names, groups=names, group_of=none[:, 0], cloud=cloud,
    )  # fmt: skip
    return PageView(encode_page(model, FileStyle()))


def _own(name: str) -> str:
    return (PAGE_FOLDER / name).read_text(encoding="utf-8")


def _packed(array: np.ndarray, kind: str) -> str:
    """Return the numbers of an array, little endian, in base64."""
    return base64.b64encode(np.ascontiguousarray(array, kind).tobytes()).decode("ascii")


def _scan(model: Model) -> dict[str, Any]:
    """Return points of the scan, evenly taken, as shares of their box."""
    if model.cloud is None or not len(model.cloud.points):
        return {"points": "", "low": [0.0] * 3, "high": [0.0] * 3}
    points = model.cloud.points[:: max(1, -(-len(model.cloud.points) // PAGE_POINTS))]
    points = points + (model.cloud.origin - model.origin)
    low, high = points.min(axis=0), points.max(axis=0)
    share = (points - low) / np.where(high > low, high - low, 1.0)
    return {"points": _packed(np.rint(65535 * share), "<u2"), "low": low.tolist(), "high": high.tolist()}


def _bulk(model: Model) -> list[list[float]]:
    """Return some points of the scan, without those far from most others, relative to the origin of the model."""
    if model.cloud is None:
        return []
    low, high = usual_extent(model.cloud.points)
    some = model.cloud.points[:: max(1, len(model.cloud.points) // POINTS_TO_FIT)]
    inside = some[((some >= low) & (some <= high)).all(axis=1)] + (model.cloud.origin - model.origin)
    places: list[list[float]] = inside.tolist()
    return places


def _table(rows: Sequence[tuple[str, str]]) -> str:
    cells = (f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table>{''.join(cells)}</table>"


def _certificate(model: Model, pins: Sequence[Pin]) -> str:
    """Return the certificate with its places as buttons, and what is wrong with it first."""
    if model.grid is None or model.truss is not None:
        return ""
    if (certificate := model.grid.certificate) is None:
        return "<h2>Certificate</h2><p>None: this grid was not checked against its scan.</p>"
    warnings = [f"warning: the grid {warning.words}{near(warning.where)}" for warning in certificate.warnings]
    words = [f'<p class="warn">{escape(each)}</p>' for each in warnings]
    buttons = [
        f'<button class="place" data-place="{k}"><span>{k + 1} {escape(pin.words)}</span><span>{escape(pin.value)}</span></button>'
        for k, pin in enumerate(pins)
    ]
    kind = "" if certificate.passed else ' class="warn"'
    return "\n".join(["<h2>Certificate</h2>", f"<p{kind}>{escape(str(certificate))}</p>", *words, *buttons])


def _figures(model: Model) -> list[tuple[str, str]]:
    """Return the figures of a grid, or the greatest of a structure."""
    unit = f" [{model.unit}]" if model.unit else ""
    if model.truss is None and model.grid is not None and len(model.members):
        quality = model.grid.quality
        return [
            (f"member length, mean{unit}", words_of_number(quality.length_mean, 4)),
            ("length std / mean", f"{quality.length_cv:.4f}"),
            ("shape quality G, mean", f"{quality.shape_mean:.4f}"),
            ("shape quality G, smallest", f"{quality.shape_min:.3f}"),
            ("angles [degree]", f"{quality.angle_min:.1f} to {quality.angle_max:.1f}"),
            ("inner nodes of six members", f"{quality.valence6:.0%}"),
        ]
    rows = [(f"member length, mean{unit}", words_of_number(model.lengths.mean(), 4))] if len(model.members) else []
    if model.truss is not None:
        rows.append(("mass without nodes [kg]", f"{model.truss.mass:,.0f}"))
        rows.append(("supports", f"{len(model.supported):,}"))
    if model.solution is not None:
        every = list(model.solution.all_results())
        service = [result for result in every if result.state == "SLS"] or every  # as the report of a structure does
        if service:
            most, name = max((result.displacement_max, result.name) for result in service)
            rows.append((f"greatest displacement, {name} [mm]", words_of_number(1e3 * most, 3)))
    if model.utilization is not None and np.isfinite(model.utilization).any():
        rows.append(("greatest utilization", use_words(float(np.nanmax(model.utilization)))))
    return rows


def _settings(model: Model) -> str:
    """Return the settings of a grid, and the command that repeats it with them."""
    if model.truss is not None or model.grid is None or model.grid.settings is None:
        return ""
    text = json.dumps(model.grid.settings.to_dict(), indent=1, ensure_ascii=False)
    return (
        "<h2>To make it again</h2><pre>scantruss grid SCAN OUT --settings FILE.settings.json</pre>"
        "<details><summary>FILE.settings.json, which scantruss grid saves beside its results</summary>"
        f"<pre>{escape(text)}</pre></details>"
    )
