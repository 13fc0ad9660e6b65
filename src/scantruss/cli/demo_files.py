"""The main job on a bundled scan: the bust of Nefertiti (see data/NOTICE)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..settings import Settings

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..scan.cloud import PointCloud

SCAN = Path(__file__).parents[1] / "data" / "nefertiti.ply"
RESULTS = ("grid.obj", "grid.json", "grid.png", "grid.settings.json", "report.json", "model.3mf")
LENGTH = 24.0  #: members of the demo [mm]; the bust is 495 mm high
SCALE = 0.25  #: of the printed model, so that it stands 124 mm high
MEMBER_DIAMETER = 1.2  #: of the printed model [mm]
NODE_DIAMETER = 2.0  #: of the printed model [mm]


def demo_settings() -> Settings:
    """Return the settings of the demo."""
    return Settings(length=LENGTH, unit="mm")


def save_demo(folder: Path, grid: Grid, cloud: PointCloud, *, force: bool = False) -> list[Path]:
    """Save grid, picture, report, settings and printable model together, or nothing.

    Parameters
    ----------
    folder : Path
        Where to; made if missing.
    grid : Grid
        Grid of the bundled scan.
    cloud : PointCloud
        The bundled scan.
    force : bool
        Replace files that ScanTruss did not write.

    Returns
    -------
    list of Path
        What was written.
    """
    from ..export.formats import write
    from ..report.figures import report_of
    from ..runtime.files import SaveTogether
    from .print import print_apart

    with SaveTogether("" if force else "result") as save:
        save.make_folder(folder)
        for name in RESULTS[:3]:
            write(grid, save.beside(folder / name), cloud=cloud)
        save.json(folder / "grid.settings.json", (grid.settings or demo_settings()).to_dict())
        save.json(folder / "report.json", report_of(grid, len(cloud.points)))
        print_apart(
            grid,
            save.beside(folder / "model.3mf"),
            member_diameter=MEMBER_DIAMETER,
            node_diameter=NODE_DIAMETER,
            scale=SCALE,
        )
    return [folder / name for name in RESULTS]
