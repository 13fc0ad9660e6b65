"""Draw docs/picture.png, the panels of the README, from the bundled scans: python scripts/make_picture.py."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from scantruss.cli.demo_files import DEMOS, MEMBER_DIAMETER, NODE_DIAMETER
from scantruss.export.drawing.picture import draw_panels
from scantruss.export.solid import build_solid
from scantruss.pipeline import grid_from_cloud, grid_from_scan
from scantruss.scan.formats.reading import read_points

PLACE = Path(__file__).resolve().parents[1] / "docs" / "picture.png"


def make_picture(path: Path = PLACE) -> None:
    """Draw scan, grid and printed model of the shell, and beside them the grid of the bust."""
    shell, bust = DEMOS["shell"], DEMOS["bust"]
    cloud = read_points(shell.scan, unit=shell.settings.unit)
    grid = grid_from_cloud(cloud, shell.settings)
    solid = build_solid(
        grid, member_diameter=1e-3 * MEMBER_DIAMETER, node_diameter=1e-3 * NODE_DIAMETER, scale=shell.scale
    )
    other = grid_from_scan(bust.scan, bust.settings), bust.view, "grid of a bust"
    draw_panels(cloud, grid, solid.vertices, solid.triangles, path, view=shell.view, beside=other)
    with Image.open(path) as image:
        small = image.convert("RGB").quantize(128)
    small.save(path, optimize=True)


if __name__ == "__main__":
    make_picture()
    print(f"wrote {PLACE}")
