"""Make the pictures of docs/gallery.md: python scripts/make_gallery.py."""

from __future__ import annotations

import io
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / "docs" / "gallery"
sys.path.append(str(ROOT / "examples"))

from clouds import make  # noqa: E402

from scantruss.cli.demo_files import DEMOS  # noqa: E402
from scantruss.cli.main import main  # noqa: E402


def roof(count: int = 80_000) -> np.ndarray:
    """Return the scan of a roof of 30 x 20 m with a curved edge and an oval opening [m]."""
    rng = np.random.default_rng(5)
    x, y = rng.uniform(-15, 15, 2 * count), rng.uniform(-10, 10, 2 * count)
    kept = (abs(y) < 10 - 1.5 * np.cos(x * np.pi / 15) ** 2) & (((x - 4) / 3) ** 2 + ((y - 1) / 2) ** 2 > 1)
    x, y = x[kept][:count], y[kept][:count]
    z = 5 * np.cos(x * np.pi / 36) * np.cos(y * np.pi / 26) + 1.2 * np.sin(x / 4) * np.cos(y / 5) + 4
    return np.column_stack([x, y, z]) + rng.normal(0, 0.004, (len(x), 3))


def terrain(count: int = 120_000) -> np.ndarray:
    """Return the scan of a hilly terrain of 300 x 200 m [m]."""
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0, 300, count), rng.uniform(0, 200, count)
    z = 14 * np.sin(x / 48) * np.cos(y / 37) + 6 * np.sin(x / 21 + 1) * np.sin(y / 27) + 0.05 * x
    return np.column_stack([x, y, z]) + rng.normal(0, 0.05, (count, 3))


SCANS: dict[str, Callable[[], np.ndarray]] = {
    "roof.npy": roof,
    "terrain.npy": terrain,
    "cloth.npy": lambda: make("cloth").points,
    "scallop.npy": lambda: make("scallop").points,
    "stadium.npy": lambda: make("stadium").points,
}
PICTURES = {
    "shell": "grid {shell} shell.png --length 1.2 --effort best --view=-20,30",
    "roof": "grid roof.npy roof.png --length 1.2 --unit m --effort best",
    "stadium": "grid stadium.npy stadium.png --length 3.9 --unit mm",
    "cloth": "grid cloth.npy cloth.png --length 2.75 --unit mm --effort best",
    "scallop": "grid scallop.npy scallop.png --length 4.7 --unit mm",
    "terrain": "grid terrain.npy terrain.png --length curvature:6:14 --unit m",
    "bust": "grid {bust} bust.png --length 16 --unit mm",
}


def run() -> None:
    """Make the scans in a folder of their own, run each command there and keep its picture, small."""
    PLACE.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for scan, points in SCANS.items():
            np.save(folder / scan, points())
        for title, command in PICTURES.items():
            words = [str(folder / word) if word.endswith((".npy", ".png")) else word for word in command.split()]
            if main([word.format(shell=DEMOS["shell"].scan, bust=DEMOS["bust"].scan) for word in words]):
                sys.exit(f"{title} failed")
            picture = Image.open(io.BytesIO((folder / f"{title}.png").read_bytes())).convert("RGB").resize((800, 600))
            picture.quantize(128).save(PLACE / f"{title}.png", optimize=True)


if __name__ == "__main__":
    run()
