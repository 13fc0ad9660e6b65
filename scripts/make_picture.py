"""Draw docs/picture.png, the three panels of the README, from the bundled scan: python scripts/make_picture.py."""

from __future__ import annotations

from pathlib import Path

from scantruss.cli.demo_files import MEMBER_DIAMETER, NODE_DIAMETER, SCALE, SCAN, demo_settings
from scantruss.export.drawing.picture import draw_panels
from scantruss.export.solid import build_solid
from scantruss.pipeline import grid_from_cloud
from scantruss.scan.formats.reading import read_points

PLACE = Path(__file__).resolve().parents[1] / "docs" / "picture.png"


def make_picture(path: Path = PLACE) -> None:
    """Draw scan, grid and printed model side by side."""
    settings = demo_settings()
    cloud = read_points(SCAN, unit=settings.unit)
    grid = grid_from_cloud(cloud, settings)
    solid = build_solid(grid, member_diameter=MEMBER_DIAMETER, node_diameter=NODE_DIAMETER, scale=SCALE)
    draw_panels(cloud, grid, solid.vertices, solid.triangles, path)


if __name__ == "__main__":
    make_picture()
    print(f"wrote {PLACE}")
