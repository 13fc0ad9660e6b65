"""The main job on a bundled scan: a shell on four feet, or the bust of Nefertiti (see data/NOTICE)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..settings import UNITS, Settings

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..scan.cloud import PointCloud

DEMO_RESULTS = ("grid.obj", "grid.json", "grid.png", "grid.settings.json", "report.json", "model.3mf")
MEMBER_DIAMETER = 1.2  #: of the printed model [mm]
NODE_DIAMETER = 2.0  #: of the printed model [mm]


@dataclass(frozen=True)
class Demo:
    """A bundled scan, the grid that is made of it and how it is shown."""

    file: str  #: in the folder `data`
    settings: Settings
    scale: float  #: of the printed model
    view: str  #: of the picture, see `PictureStyle`

    @property
    def scan(self) -> Path:
        """Where the scan is."""
        return Path(__file__).parents[1] / "data" / self.file


DEMOS = {
    "shell": Demo("shell.ply", Settings(length=1.0, unit="m"), 0.005, "-20,30"),  # 1:200, 160 mm long
    "bust": Demo("nefertiti.ply", Settings(length=24.0, unit="mm"), 0.25, "40,15"),  # 124 mm high
}


def save_demo(demo: Demo, folder: Path, grid: Grid, cloud: PointCloud, *, force: bool = False) -> list[Path]:
    """Save grid, picture, report, settings and printable model together, or nothing.

    Parameters
    ----------
    demo : Demo
        What was made.
    folder : Path
        Where to; made if missing.
    grid : Grid
        Grid of its scan.
    cloud : PointCloud
        Its scan.
    force : bool
        Replace files that ScanTruss did not write.

    Returns
    -------
    list of Path
        What was written.
    """
    from ..export.formats import write
    from ..export.printed.apart import print_apart
    from ..export.style import FileStyle
    from ..report.figures import report_of
    from ..runtime.files import SaveTogether

    millimetre = 1e-3 / (UNITS[grid.unit] or 1e-3)
    style = FileStyle(views=(demo.view,))
    with SaveTogether("" if force else "result") as save:
        save.make_folder(folder)
        for name in DEMO_RESULTS[:3]:
            write(grid, save.beside(folder / name), cloud=cloud, style=style)
        save.json(folder / "grid.settings.json", (grid.settings or demo.settings).to_dict())
        save.json(folder / "report.json", report_of(grid, len(cloud.points)))
        print_apart(
            grid,
            save.beside(folder / "model.3mf"),
            member_diameter=MEMBER_DIAMETER * millimetre,
            node_diameter=NODE_DIAMETER * millimetre,
            scale=demo.scale,
        )
    return [folder / name for name in DEMO_RESULTS]
