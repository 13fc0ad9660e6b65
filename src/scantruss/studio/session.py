"""Session: what a studio works on (scan, settings, grid, structure) and the steps that change it; no browser is needed."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import InputError, ScanTrussError, words_of_error
from ..export.formats import STRUCTURE, check_output, check_unit, model_of, suffixes_of, write
from ..export.model import Model
from ..grid.grid import Grid
from ..pipeline import grid_from_cloud
from ..runtime.files import temporary_folder
from ..runtime.progress import Progress
from ..scan.cloud import PointCloud
from ..scan.member_length import exact_range, length_range, suggest_length
from ..scan.stream.fit import read_to_fit, spacing_to_fit, spacing_to_look
from ..settings import Settings
from ..structure.options import StructureSettings, loads_of_words, settings_text
from ..structure.report import StructureReport, report_structure
from ..structure.statics import Solution, solve
from ..structure.truss import Truss
from ..structure.variants import truss_arguments
from .project import Project, read_project, save_project
from .worker import Worker

LARGEST_UPLOAD = 500_000_000  #: of a scan that comes through the page [bytes]
MOST_LIVE_MEMBERS = 60_000  #: of a quick grid that is made while the length changes
DEFAULT_STRUCTURE = StructureSettings(supports="boundary", loads=("self", "snow:1kN/m2"))
STRUCTURE_WORDS = ("supports", "support_type", "section", "material", "loads")  #: what the page asks for


class Session:
    """The state of a studio.

    Parameters
    ----------
    project : Path, optional
        File that is saved after each step; none: nothing is saved.
    tell : callable, optional
        Called, from any thread, whenever something has changed.
    """

    def __init__(self, project: Path | None = None, tell: Callable[[], None] = lambda: None) -> None:
        self.place, self.tell = project, tell
        self.cloud: PointCloud | None = None
        self.settings = Settings(length=1.0)
        self.grid: Grid | None = None
        self.is_live = False  #: whether the grid is a quick one, made while the length was chosen
        self.structure_settings = DEFAULT_STRUCTURE
        self.solution: Solution | None = None
        self.report: StructureReport | None = None
        self.message = ""  #: why the last step was refused, in the words of the command line
        self.stage, self.share = "", 0.0
        self.worker = Worker(self._end, self._progress)

    # ---- the scan

    def open(self, path: Path) -> None:
        """Open a scan or a project.

        Raises
        ------
        ScanTrussError
            It cannot be read.
        """
        if path.suffix.lower() == ".scantruss":
            self._take(read_project(path))
            return
        cloud = read_whole(path)
        self._start(cloud)
        self.save()

    def open_upload(self, name: str, content: bytes) -> None:
        """Open a scan that came through the page, as a step of the worker."""

        def read(progress: Progress) -> None:
            if len(content) > LARGEST_UPLOAD:
                raise InputError(
                    f"a scan of more than {LARGEST_UPLOAD:,} bytes; name it on the command line: scantruss studio SCAN"
                )
            own = Path(name.replace("\\", "/")).name
            with temporary_folder() as folder:
                path = folder / (own or "scan")
                path.write_bytes(content)
                progress("read", 0.1)
                cloud = read_whole(path)
            self._start(replace(cloud, name=own))
            self.save()

        self.worker.ask(read)

    def _start(self, cloud: PointCloud) -> None:
        self.cloud, self.grid, self.solution, self.report = cloud, None, None, None
        self.settings = Settings(length=suggest_length(cloud), unit=cloud.unit)

    def set_unit(self, unit: str) -> None:
        """Take the unit of the scan's coordinates; the grid of the scan without it is gone."""
        if self.cloud is not None:
            self.stop()
            self.cloud, self.grid, self.solution, self.report = (
                replace(self.cloud, unit=unit, system=""),
                None,
                None,
                None,
            )
        self.settings = self.settings.replace(unit=unit)

    def length_bounds(self) -> tuple[float, float]:
        """Return the lengths that the slider offers: about the suggested one, within what the scan allows [scan unit]."""
        if self.cloud is None:
            return 0.5, 2.0
        low, high = length_range(self.cloud)
        wished = suggest_length(self.cloud)
        return max(low, wished / 3), max(low, min(high, wished * 3))

    # ---- the grid

    def live(self, length: float) -> bool:
        """Make a quick grid of a length, unless a run that was asked for is under way; the newest request wins."""
        self.settings = self.settings.replace(length=length)
        return self.worker.ask(lambda progress: self._make("quick", progress, live=True), quick=True)

    def generate(self) -> None:
        """Make the grid with the effort of the settings."""
        self.worker.ask(lambda progress: self._make(self.settings.effort, progress))

    def stop(self) -> None:
        """Stop what runs; the grid before it stays."""
        self.worker.stop()

    def _make(self, effort: str, progress: Progress, *, live: bool = False) -> None:
        if self.cloud is None:
            raise InputError("there is no scan yet; open one")
        cloud, settings = self.cloud, self.settings.replace(effort=effort)
        low, high = exact_range(cloud)
        if live and not low <= settings.length <= high:
            return  # Generate says why
        progress("boundary", 0.0)
        grid = grid_from_cloud(cloud, settings, progress=progress)
        if self.cloud is not cloud or (live and len(grid.edges) > MOST_LIVE_MEMBERS):
            return
        self.grid, self.is_live, self.solution, self.report = grid, live, None, None
        if not live:
            self.save()

    # ---- the structure

    def set_structure(self, **words: str) -> None:
        """Take what the page says of supports, section, material and loads.

        Raises
        ------
        InputError
            It names a file, which the page may not read, or cannot be used.
        """
        for name, text in words.items():
            for part in (text, *text.split(","), text.partition(".csv")[0]):
                named = part.strip()
                if (
                    named.lower().endswith((".csv", ".toml", ".json", ".txt"))
                    or ".csv:" in named
                    or Path(named).is_file()
                ):
                    raise InputError(f"{name} names a file, {named}; files are read by the command line only")
        given: dict[str, Any] = dict(words)
        if "loads" in given:
            given["loads"] = loads_of_words(given["loads"])
        self.structure_settings = self.structure_settings.replace(**given)

    def run_structure(self) -> None:
        """Make the structure of the grid and solve it."""

        def run(progress: Progress) -> None:
            progress("structure", 0.1)
            self._solve()
            self.is_live = False  # a quick grid with a structure is kept
            self.save()

        self.worker.ask(run)

    def _solve(self) -> None:
        if self.grid is None:
            raise InputError("there is no grid yet; press Generate")
        truss = Truss.from_grid(self.grid, **truss_arguments(self.structure_settings))
        solution = solve(truss)
        self.solution, self.report = solution, report_structure(solution, self.structure_settings.checks)

    # ---- files

    def model(self, kind: str) -> Model:
        """Return the grid or the structure.

        Raises
        ------
        InputError
            There is none yet.
        """
        if kind == STRUCTURE:
            if self.solution is None:
                raise InputError("there is no structure yet; press Run")
            return model_of(self.solution, report=self.report)
        if self.grid is None:
            raise InputError("there is no grid yet; press Generate")
        return model_of(self.grid, cloud=self.cloud)

    def files(self, kind: str, suffix: str) -> dict[str, bytes]:
        """Return the files of a format by their names.

        Raises
        ------
        ScanTrussError
            There is nothing to write, or the format cannot hold it.
        """
        if suffix not in suffixes_of(kind):
            raise InputError(f"no format {suffix} of a {kind}; use one of {' '.join(suffixes_of(kind))}")
        model = self.model(kind)
        with temporary_folder() as folder:
            path = check_output(folder / f"{kind}{suffix}", kind)
            check_unit(path, model.unit)
            return {file.name: file.read_bytes() for file in write(model, path)}

    def settings_file(self) -> bytes:
        """Return the settings as `scantruss grid` saves them."""
        made = self.settings if self.grid is None or self.grid.settings is None else self.grid.settings
        return (json.dumps(made.to_dict(), indent=1, ensure_ascii=False) + "\n").encode()

    def command(self) -> str:
        """Return the command lines that repeat the grid and the structure."""
        name = Path(self.cloud.name).name if self.cloud is not None and self.cloud.name else "SCAN"
        made = self.settings if self.grid is None or self.grid.settings is None else self.grid.settings
        words = ["scantruss", "grid", name, "grid.json", "--settings", "grid.settings.json"]
        lines = [
            shlex.join(words),
            f"# grid.settings.json: --length {made.length:g} --effort {made.effort} and all else",
        ]
        if self.solution is not None:
            given = self.structure_settings
            loads = ",".join(map(str, given.loads))
            options = {"supports": given.supports, "support-type": given.support_type, "section": given.section,
                       "material": given.material, "loads": loads}  # fmt: skip
            words = ["scantruss", "structure", "grid.json", "structure.json"]
            lines.append(
                shlex.join([*words, *(word for name, value in options.items() for word in (f"--{name}", value))])
            )
        return "\n".join(lines)

    def save(self) -> None:
        """Save the project, where there is a place for it: written beside it, then renamed."""
        if self.place is None or self.cloud is None:
            return
        grid = None if self.is_live else self.grid
        save_project(
            self.place,
            Project(
                self.cloud,
                self.settings,
                grid,
                settings_text(self.structure_settings),
                solved=grid is not None and self.solution is not None,
            ),
            None if self.solution is None else self.model(STRUCTURE),
        )

    def _take(self, project: Project) -> None:
        self.cloud, self.settings, self.grid = project.cloud, project.settings, project.grid
        self.structure_settings, self.is_live = project.structure_settings, False
        self.solution = self.report = None
        if project.solved:
            self._solve()

    # ---- what the worker tells

    def _progress(self, stage: str, share: float) -> None:
        changed = stage != self.stage or abs(share - self.share) >= 0.02
        self.stage, self.share = stage, share
        if changed:
            self.tell()

    def _end(self, error: Exception | None) -> None:
        self.stage, self.share = "", 0.0
        self.message = "" if error is None else words_of(error)
        self.tell()


def read_whole(path: Path) -> PointCloud:
    """Read a scan; one that is larger than memory is thinned while it is read, as for a first look."""
    settings = Settings(length=1.0)
    if spacing_to_fit(path, settings):
        settings = settings.replace(thin_spacing=spacing_to_look(path, settings))
    cloud, _ = read_to_fit(path, settings)
    return cloud


def words_of(error: Exception) -> str:
    """Return an error in the words of the command line."""
    if isinstance(error, ScanTrussError):
        return " ".join(words_of_error(error).split())
    if isinstance(error, MemoryError):
        return "not enough memory; use fewer points or a larger length"
    if isinstance(error, OSError):
        return str(error.strerror or error)
    return f"a bug in ScanTruss, {type(error).__name__}: {error}; the studio goes on"
