"""Pictures of grids and clouds in notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..scan.cloud import PointCloud


def show_pictures(shell: Any) -> None:
    """Let an IPython shell show a `Grid` and a `PointCloud` as a picture."""
    formatter = shell.display_formatter.formatters["image/png"]
    formatter.for_type_by_name("scantruss.grid.grid", "Grid", grid_picture)
    formatter.for_type_by_name("scantruss.scan.cloud", "PointCloud", cloud_picture)


def grid_picture(grid: Grid) -> bytes | None:
    """Return a grid as PNG; None of one without triangles."""
    from ..export.drawing.picture import encode_picture

    return encode_picture(grid) if len(grid.triangles) else None


def cloud_picture(cloud: PointCloud) -> bytes | None:
    """Return a cloud as PNG."""
    from ..export.drawing.picture import encode_cloud

    return encode_cloud(cloud)
