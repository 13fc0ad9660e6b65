"""Pictures of grids and clouds, and tables of settings, in notebooks."""

from __future__ import annotations

from dataclasses import fields
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..scan.cloud import PointCloud
    from ..settings import Settings

MOST_LETTERS = 60  # of a value in a table


def show_pictures(shell: Any) -> None:
    """Let an IPython shell show a `Grid` and a `PointCloud` as a picture, `Settings` as a table."""
    pictures, pages = (shell.display_formatter.formatters[kind] for kind in ("image/png", "text/html"))
    pictures.for_type_by_name("scantruss.grid.grid", "Grid", grid_picture)
    pictures.for_type_by_name("scantruss.scan.cloud", "PointCloud", cloud_picture)
    pages.for_type_by_name("scantruss.settings.settings", "Settings", settings_table)


def grid_picture(grid: Grid) -> bytes | None:
    """Return a grid as PNG; None of one without triangles."""
    from ..export.drawing.picture import encode_picture

    return encode_picture(grid) if len(grid.triangles) else None


def cloud_picture(cloud: PointCloud) -> bytes | None:
    """Return a cloud as PNG."""
    from ..export.drawing.picture import encode_cloud

    return encode_cloud(cloud)


def settings_table(settings: Settings) -> str:
    """Return the settings that are not the default as a table in HTML: name, value, unit and what it is."""
    about = {spec.name: spec.metadata for spec in fields(settings)}
    rows = []
    for name, value in settings.chosen.items():
        words = repr(value) if len(repr(value)) <= MOST_LETTERS else f"{repr(value)[:MOST_LETTERS]} ..."
        cells = (name, words, about[name]["unit"], about[name]["help"])
        rows.append("<tr>" + "".join(f'<td style="text-align:left">{escape(cell)}</td>' for cell in cells) + "</tr>")
    return f"<table>{''.join(rows)}</table>"
