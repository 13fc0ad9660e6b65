"""The project file, .scantruss: a zip with the scan's points, the settings, the grid and the structure."""

from __future__ import annotations

import io
import json
import weakref
import zipfile
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..errors import FormatError, ScanTrussError
from ..export.formats import model_of
from ..export.json import encode_json, encode_model, read_grid
from ..grid.grid import Grid
from ..runtime.files import temporary_folder, write_files
from ..runtime.ours import MADE_BY
from ..scan.cloud import PointCloud
from ..settings import Settings
from ..structure.options import StructureSettings, read_structure_settings, settings_text
from ..structure.results import Solution
from .project_trade import TRADE_BEFORE, TRADE_HEAD, TRADE_NODES, head_of_trade, nodes_of_trade, trade_of_parts
from .scan_parts import UP_AXES, Cleaning, WholeScan, part_of_scan, taken_of_scan
from .state import Design, StudioState, Trade
from .support_places import placed_supports

PROJECT_FORMAT, PROJECT_VERSION = "scantruss-project", 5
CLEANING_OF_PART = 3  #: last version in which a cleaning named the points of the part that was taken
PROJECT_PARTS = ("made_by.npy", "project.json", "scan.npz", "removed.npy", "by_hand.npy", "structure.toml", "solved.toml", "grid.json",
                 "structure.json", TRADE_HEAD, TRADE_NODES, TRADE_BEFORE)  # fmt: skip
FIXED_DATE = (1980, 1, 1, 0, 0, 0)  # the same project gives the same bytes
Part = TypeVar("Part")
LARGEST_PART = 8_000_000_000  #: of what is unpacked [bytes]


def save_project(path: Path, state: StudioState) -> None:
    """Write a project file beside its place, and rename it when it is whole.

    Raises
    ------
    FormatError
        It cannot be written; the one before is left as it was.
    """
    assert state.cloud is not None
    whole = state.whole or WholeScan(state.cloud)
    cloud, cleaning = whole.cloud, state.cleaning
    solved = state.grid is not None and state.solution is not None
    head = {
        "format": PROJECT_FORMAT, "format_version": PROJECT_VERSION, "made_by": MADE_BY,
        "scan": {"unit": cloud.unit, "system": cloud.system, "name": Path(cloud.name).name, "dropped": cloud.dropped,
                 "notes": list(cloud.notes), "up": whole.up, "left_out": [list(part) for part in cloud.left_out]},
        "cleaning": None if cleaning is None else [cleaning.outlier_distance, cleaning.loose_pieces, list(cleaning.crop)],
        "settings": state.settings.to_dict(), "solved": solved, "quick": state.is_live,
        "asked": None if state.asked is None else state.asked.to_dict(),
        "tape": [list(end) for end in state.tape],
        "unpainted": state.unpainted,
        "support_places": [[mark, list(place)] for mark, place in state.support_places],
        "designs": [_head_of_design(each, state) for each in state.designs],
    }  # fmt: skip
    parts = {
        "made_by.npy": _npy(np.array(MADE_BY)),
        "project.json": (json.dumps(head, indent=1, ensure_ascii=False) + "\n").encode(),
        "scan.npz": _kept(_SCANS, whole, _encode_scan),
        "structure.toml": settings_text(state.structure_settings).encode(),
    }
    if cleaning is not None:
        parts["removed.npy"] = _npy(np.packbits(cleaning.removes))
    if state.removed is not None:
        parts["by_hand.npy"] = _npy(np.packbits(state.removed))
    if state.grid is not None:
        parts["grid.json"] = _kept(_GRIDS, state.grid, encode_json)
    if solved and state.solution is not None:
        parts["solved.toml"] = settings_text(state.shown_structure).encode()
        parts["structure.json"] = _kept(
            _STRUCTURES, state.solution, lambda solution: encode_model(model_of(solution, report=state.report))
        )
    if (trade := state.trade) is not None:
        parts |= {
            TRADE_HEAD: head_of_trade(trade, state.grid),
            TRADE_NODES: _kept(_TRADES, trade, lambda one: _npz(nodes_of_trade(one))),
        }
        if trade.before is not state.grid:
            parts[TRADE_BEFORE] = _kept(_GRIDS, trade.before, encode_json)
    parts |= {f"design-{k}.json": _kept(_GRIDS, each.grid, encode_json) for k, each in enumerate(state.designs, 1)}
    write_files({path: _zipped(parts, zipfile.ZIP_DEFLATED, stored=("scan.npz", TRADE_NODES))}, force=True)


_SCANS: weakref.WeakKeyDictionary[WholeScan, bytes] = weakref.WeakKeyDictionary()
_GRIDS: weakref.WeakKeyDictionary[Grid, bytes] = weakref.WeakKeyDictionary()
_STRUCTURES: weakref.WeakKeyDictionary[Solution, bytes] = weakref.WeakKeyDictionary()
_TRADES: weakref.WeakKeyDictionary[Trade, bytes] = weakref.WeakKeyDictionary()


def _head_of_design(design: Design, state: StudioState) -> dict[str, Any]:
    """Return all of a design but its grid."""
    return {
        "name": design.name, "figures": [list(row) for row in design.figures], "of_scan": design.cloud is state.cloud,
        "asked": None if design.asked is None else design.asked.to_dict(), "unpainted": design.unpainted,
        "quick": design.is_live,
        "structure": None if design.solved_with is None else settings_text(design.solved_with),
    }  # fmt: skip


def _design_of(head: dict[str, Any], grid: Grid, cloud: PointCloud) -> Design:
    asked, structure = head.get("asked"), head.get("structure", head.get("layered"))  # of layers only, once
    return Design(
        head["name"],
        grid,
        tuple((a, b) for a, b in head["figures"]),
        cloud if head.get("of_scan", False) else None,
        None if asked is None else Settings.from_dict(asked),
        float(head.get("unpainted", 1.0)),
        bool(head.get("quick", False)),
        None if structure is None else _structure_settings_of(structure.encode()),
    )


def _kept(known: weakref.WeakKeyDictionary[Part, bytes], part: Part, encode: Callable[[Part], bytes]) -> bytes:
    """Return the bytes of a part, encoded once: a project is saved after each step, of which most leave the scan as it is."""
    if (content := known.get(part)) is None:
        content = known[part] = encode(part)
    return content


def _encode_scan(whole: WholeScan) -> bytes:
    cloud = whole.cloud
    arrays = {"points": cloud.points, "origin": np.asarray(cloud.origin, np.float64)}
    if cloud.normals is not None:
        arrays["normals"] = cloud.normals
    if whole.classes is not None:
        arrays["classes"] = whole.classes
    if whole.colors is not None:
        arrays["colors"] = whole.colors
    return _npz(arrays)


def read_project(path: Path) -> tuple[StudioState, bool]:
    """Return the state that a project file holds, and whether its structure was solved, which is done again.

    Raises
    ------
    FormatError
        It cannot be read, or it is no project.
    """
    try:
        with zipfile.ZipFile(path) as file:
            if any(file.getinfo(name).file_size > LARGEST_PART for name in file.namelist()):
                raise ValueError("a part is too large")
            parts = {
                name: file.read(name) for name in file.namelist() if name in PROJECT_PARTS or name.startswith("design-")
            }
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


def _project_of(parts: dict[str, bytes]) -> tuple[StudioState, bool]:
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
        classes = np.asarray(arrays["classes"]) if "classes" in arrays else None
        colors = np.asarray(arrays["colors"], np.uint8).reshape(-1, 3) if "colors" in arrays else None
    if not len(cloud.points) or not np.isfinite(cloud.points).all():
        raise ValueError("points must be numbers")
    grid = _grid_of(parts["grid.json"]) if "grid.json" in parts else None
    asked, settings = head.get("asked"), Settings.from_dict(head["settings"])
    whole, cleaning = WholeScan(cloud, classes, colors, _up_of(scan)), None
    if (numbers := head.get("cleaning")) is not None:
        of = np.ones(len(cloud.points), np.bool_)
        if head["format_version"] <= CLEANING_OF_PART:
            of = taken_of_scan(whole, settings)
        removes = np.zeros(len(of), np.bool_)
        removes[of] = _bits(parts["removed.npy"], int(of.sum()))
        of_part = tuple(map(str, numbers[2])) if len(numbers) > 2 else settings.crop
        cleaning = Cleaning(float(numbers[0]), float(numbers[1]), removes, crop=of_part)
    removed = _bits(parts["by_hand.npy"], len(cloud.points)) if "by_hand.npy" in parts else None
    structure_settings = _structure_settings_of(parts["structure.toml"])
    known = tuple((str(mark), (float(x), float(y), float(z))) for mark, (x, y, z) in head.get("support_places", ()))
    part = part_of_scan(whole, settings, cleaning, removed)
    state = StudioState(
        cloud=part,
        settings=settings,
        unpainted=float(head.get("unpainted", 1.0)),
        grid=grid,
        asked=None if asked is None else Settings.from_dict(asked),
        trade=trade_of_parts(parts, grid, _grid_of),
        is_live=bool(head.get("quick", False)) and grid is not None,
        structure_settings=structure_settings,
        support_places=placed_supports(structure_settings.supports, known, grid),
        solved_with=_structure_settings_of(parts["solved.toml"]) if "solved.toml" in parts else None,
        designs=tuple(
            _design_of(each, _grid_of(parts[f"design-{k}.json"]), part)
            for k, each in enumerate(head.get("designs", ()), 1)
        ),
        whole=whole,
        cleaning=cleaning,
        removed=removed,
        tape=tuple(tuple(map(float, end)) for end in head.get("tape", ())),
    )
    return state, bool(head["solved"]) and grid is not None


def _up_of(scan: dict[str, Any]) -> str:
    up = str(scan.get("up", "z"))
    if up not in UP_AXES:
        raise ValueError(f"no axis {up} points up")
    return up


def _grid_of(content: bytes) -> Grid:
    with temporary_folder() as folder:
        place = folder / "grid.json"
        place.write_bytes(content)
        return read_grid(place)


def _structure_settings_of(content: bytes) -> StructureSettings:
    with temporary_folder() as folder:
        place = folder / "structure.toml"
        place.write_bytes(content)
        return read_structure_settings(place)


def _bits(content: bytes, count: int) -> np.ndarray:
    """Return so many truth values (N,) of a packed part."""
    found: np.ndarray = np.unpackbits(np.load(io.BytesIO(content), allow_pickle=False), count=count).astype(np.bool_)
    return found


def _npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=False)
    return stream.getvalue()


def _npz(arrays: dict[str, np.ndarray]) -> bytes:
    return _zipped({f"{name}.npy": _npy(array) for name, array in arrays.items()}, zipfile.ZIP_DEFLATED)


def _zipped(parts: dict[str, bytes], way: int, stored: Collection[str] = ()) -> bytes:
    """Return a zip of parts, without dates; those that are zips themselves are only stored."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        for name, content in parts.items():
            file.writestr(zipfile.ZipInfo(name, FIXED_DATE), content, zipfile.ZIP_STORED if name in stored else way)
    return stream.getvalue()
