"""The project file, .scantruss: a zip with the scan's points, the settings, the grid and the structure."""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError, ScanTrussError
from ..export.formats import model_of
from ..export.json import encode_json, encode_model, read_grid
from ..export.model import Model
from ..grid.grid import Grid
from ..runtime.files import temporary_folder, write_files
from ..runtime.ours import MARK
from ..scan.cloud import PointCloud
from ..settings import Settings
from ..structure.options import StructureSettings, read_structure_settings

PROJECT_FORMAT, PROJECT_VERSION = "scantruss-project", 1
PROJECT_PARTS = ("made_by.npy", "project.json", "scan.npz", "structure.toml", "grid.json", "structure.json")
FIXED_DATE = (1980, 1, 1, 0, 0, 0)  # the same project gives the same bytes
LARGEST_PART = 8_000_000_000  #: of what is unpacked [bytes]


@dataclass(frozen=True, eq=False)
class Project:
    """What a project file holds."""

    cloud: PointCloud
    settings: Settings
    grid: Grid | None
    structure_text: str  #: settings of the structure, as TOML
    solved: bool  #: whether there are results, which are computed again

    @property
    def structure_settings(self) -> StructureSettings:
        """The settings of the structure."""
        with temporary_folder() as folder:
            place = folder / "structure.toml"
            place.write_text(self.structure_text, encoding="utf-8")
            return read_structure_settings(place)


def save_project(path: Path, project: Project, structure: Model | None = None) -> None:
    """Write a project file beside its place, and rename it when it is whole.

    Raises
    ------
    FormatError
        It cannot be written; the one before is left as it was.
    """
    cloud = project.cloud
    arrays = {"points": cloud.points, "origin": np.asarray(cloud.origin, np.float64)}
    if cloud.normals is not None:
        arrays["normals"] = cloud.normals
    head = {
        "format": PROJECT_FORMAT, "format_version": PROJECT_VERSION, "made_by": MARK,
        "scan": {"unit": cloud.unit, "system": cloud.system, "name": Path(cloud.name).name, "dropped": cloud.dropped,
                 "notes": list(cloud.notes), "left_out": [list(part) for part in cloud.left_out]},
        "settings": project.settings.to_dict(), "solved": project.solved,
    }  # fmt: skip
    parts = {
        "made_by.npy": _npy(np.array(MARK)),
        "project.json": (json.dumps(head, indent=1, ensure_ascii=False) + "\n").encode(),
        "scan.npz": _zipped({f"{name}.npy": _npy(array) for name, array in arrays.items()}, zipfile.ZIP_STORED),
        "structure.toml": project.structure_text.encode(),
    }
    if project.grid is not None:
        parts["grid.json"] = encode_json(project.grid)
    if project.solved and structure is not None:
        parts["structure.json"] = encode_model(model_of(structure))
    write_files({path: _zipped(parts, zipfile.ZIP_DEFLATED)})


def read_project(path: Path) -> Project:
    """Read a project file.

    Raises
    ------
    FormatError
        It cannot be read, or it is no project.
    """
    try:
        with zipfile.ZipFile(path) as file:
            if any(file.getinfo(name).file_size > LARGEST_PART for name in file.namelist()):
                raise ValueError("a part is too large")
            parts = {name: file.read(name) for name in file.namelist() if name in PROJECT_PARTS}
    except OSError as error:
        raise FormatError(f"cannot read {path}: {error.strerror or error}") from None
    except (zipfile.BadZipFile, ValueError, EOFError, NotImplementedError) as error:
        raise FormatError(f"{path} is no project of scantruss studio, or a damaged one: {error}") from None
    try:
        return _project_of(parts)
    except ScanTrussError as error:
        raise FormatError(f"{path} is a damaged project: {error}") from None
    except (KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile) as error:
        words = f"{error.args[0]} is missing" if isinstance(error, KeyError) else error
        raise FormatError(f"{path} is no project of scantruss studio, or a damaged one: {words}") from None


def _project_of(parts: dict[str, bytes]) -> Project:
    head: dict[str, Any] = json.loads(parts["project.json"])
    if head["format"] != PROJECT_FORMAT or head["format_version"] > PROJECT_VERSION:
        raise ValueError(f"format {head['format']} {head['format_version']}; a newer ScanTruss reads it")
    scan = head["scan"]
    with np.load(io.BytesIO(parts["scan.npz"]), allow_pickle=False) as arrays:
        cloud = PointCloud(
            points=np.ascontiguousarray(arrays["points"], np.float64).reshape(-1, 3),
            origin=np.asarray(arrays["origin"], np.float64).reshape(3),
            normals=np.asarray(arrays["normals"], np.float64).reshape(-1, 3) if "normals" in arrays else None,
            unit=scan["unit"], system=str(scan.get("system", "")), name=scan["name"],
            dropped=int(scan["dropped"]), notes=tuple(scan["notes"]),
            left_out=tuple((str(why), int(count)) for why, count in scan["left_out"]),
        )  # fmt: skip
    if not len(cloud.points) or not np.isfinite(cloud.points).all():
        raise ValueError("points must be numbers")
    grid = None
    if "grid.json" in parts:
        with temporary_folder() as folder:
            place = folder / "grid.json"
            place.write_bytes(parts["grid.json"])
            grid = read_grid(place)
    settings = Settings.from_dict(head["settings"])
    return Project(cloud, settings, grid, parts["structure.toml"].decode(), bool(head["solved"]) and grid is not None)


def _npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=False)
    return stream.getvalue()


def _zipped(parts: dict[str, bytes], way: int) -> bytes:
    """Return a zip of parts, without dates."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        for name, content in parts.items():
            file.writestr(zipfile.ZipInfo(name, FIXED_DATE), content, way)
    return stream.getvalue()
