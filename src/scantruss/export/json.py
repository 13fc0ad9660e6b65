"""Our own format: JSON that holds a grid without loss.

What a grid is (nodes, triangles, fixed nodes, members and nodes along lines, origin, unit, deviation, settings, quality before) and its
certificate, which needs the scan, are read back to the last bit. What follows from it (members, boundary loops, quality,
topology) is written for other programs and not read back. No dates and no names are written: the same grid gives the same
bytes.
"""

from __future__ import annotations

import json
import math
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..errors import FormatError, InputError
from ..grid.alike import Alike
from ..grid.certificate import Certificate
from ..grid.grid import Grid
from ..grid.line_sets import FIXED_LINE, RIDGE, LineSet, sets_of
from ..grid.panels import panel_of_triangles, table_of
from ..grid.quality import GridQuality
from ..runtime.ours import BYTES_WITH_MARK
from ..settings import UNITS, Settings
from .model import Model, model_of_grid, model_of_truss

FORMAT = "scantruss-grid"
FORMAT_VERSION = 1  # of the files of grids; later ones are refused


def encode_model(model: Model) -> bytes:
    """Return the text of the JSON file of a grid or a structure."""
    if model.truss is None:
        return encode_json(model.as_grid("JSON"))
    from ..structure.json import encode_structure

    return encode_structure(model.truss, model.solution, model.report)


def encode_json(grid: Grid) -> bytes:
    """Return the text of the JSON file, one line per node, member and triangle."""
    deviation = None if grid.deviation is None else np.asarray(grid.deviation, float).tolist()
    values: dict[str, Any] = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "version": __version__,
        "unit": grid.unit,
        "origin": np.asarray(grid.origin, np.float64).tolist(),
        **({"system": grid.system} if grid.system else {}),
        "settings": None if grid.settings is None else grid.settings.to_dict(),
        "quality": _known(grid.quality.to_dict()),
        "before": None if grid.before is None else _known(grid.before.to_dict()),
        "topology": grid.topology.to_dict(),
        "certificate": None if grid.certificate is None else grid.certificate.to_dict(),
        "fixed": np.flatnonzero(grid.fixed).tolist(),
        "lines": grid.lines.tolist(),
        "fixed_lines": sets_of(grid, FIXED_LINE),
        "ridges": sets_of(grid, RIDGE),
        "boundary_loops": [loop.tolist() for loop in grid.boundary_loops],
        "nodes": np.asarray(grid.nodes, np.float64).tolist(),
        "members": grid.edges.tolist(),
        "triangles": grid.triangles.tolist(),
        "deviation": deviation and [_number(d) for d in deviation],
    }
    if grid.panels is not None:
        values["panels"] = grid.panel_loops
    if grid.alike is not None:
        values["alike"] = grid.alike.to_dict()
    if grid.desired is not None:
        values["desired"] = np.asarray(grid.desired, float).tolist()
    parts = [
        f"{json.dumps(key)}: {_lines(value) if key in ROW_ARRAYS else _text(value)}" for key, value in values.items()
    ]
    return ("{\n" + ",\n".join(parts) + "\n}\n").encode("utf-8")


ROW_ARRAYS = ("nodes", "members", "triangles", "panels", "boundary_loops", "lines", "fixed_lines", "ridges")


def _number(value: Any) -> Any:
    """Return null for what is not a number in JSON."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _known(figures: dict[str, Any]) -> dict[str, Any]:
    """Return figures with null for those that are not known."""
    return {name: _number(value) for name, value in figures.items()}


def _text(value: Any) -> str:
    """Return JSON of a value on one line; numbers of numpy count as numbers."""
    return json.dumps(value, allow_nan=False, ensure_ascii=False, default=lambda number: number.item())


def _lines(rows: list[Any]) -> str:
    """Return JSON of a list, one line per row."""
    return "[\n" + ",\n".join(map(_text, rows)) + "\n]" if rows else "[]"


def read_json(path: Path) -> Model:
    """Read a grid or a structure from our own JSON formats; a structure with load cases is solved again.

    Raises
    ------
    FormatError
        The file cannot be read, or it is neither.
    """
    from ..structure.json import STRUCTURE_FORMAT, read_checked

    with suppress(OSError), path.open("rb") as file:
        if f'"format": "{STRUCTURE_FORMAT}"'.encode() not in file.read(BYTES_WITH_MARK):
            return model_of_grid(read_grid(path))
    from ..structure.statics import solve

    truss, checked = read_checked(path)
    used = None if checked is None else checked[0]
    return model_of_truss(truss, solve(truss) if truss.cases else None, utilization=used)


def read_grid(path: str | Path) -> Grid:
    """Read a grid from our own JSON format, without loss.

    Parameters
    ----------
    path : str or Path
        File written by `write(grid, "....json")` or the command `scantruss grid`.

    Raises
    ------
    FormatError
        The file cannot be read, or it is not one of our grids.
    """
    try:
        values = json.loads(Path(path).read_text(encoding="utf-8"), parse_constant=_refuse_constant)
    except OSError as error:
        raise FormatError(f"cannot read {path}: {error.strerror or error}") from None
    except (ValueError, RecursionError):
        raise FormatError(f"{path} is not JSON; a grid saved as .json by scantruss grid is needed") from None
    kind = str(values.get("format")) if isinstance(values, dict) else ""
    if kind == "scantruss-structure":
        raise FormatError(
            f"{path} is a structure; name the grid, saved as .json by scantruss grid, that it was made of"
        )
    if not isinstance(values, dict) or kind != FORMAT:
        raise FormatError(f'{path} has no "format": "{FORMAT}"; a grid saved as .json by scantruss grid is needed')
    version = values.get("format_version")
    if version is None:
        raise FormatError(f"{path} is a damaged grid: format_version is missing; write it again with scantruss grid")
    if not isinstance(version, int) or not 1 <= version <= FORMAT_VERSION:
        raise FormatError(
            f"{path} has format_version {version!r}, known is up to {FORMAT_VERSION}; read it with a newer ScanTruss"
        )
    try:
        return _grid_from(values)
    except (InputError, KeyError, TypeError, ValueError) as error:
        words = f"{error.args[0]} is missing" if isinstance(error, KeyError) else error
        raise FormatError(f"{path} is a damaged grid: {words}; write it again with scantruss grid") from None


def _refuse_constant(word: str) -> float:
    """Refuse NaN and Infinity, which are not JSON."""
    raise ValueError(f"{word} is not a number")


def _grid_from(values: dict[str, Any]) -> Grid:
    """Return the grid that the plain values describe; ValueError, TypeError or KeyError where they do not."""
    unit = values["unit"]
    if unit not in UNITS:
        raise ValueError(f"unknown unit {unit!r}")
    nodes = _floats(values["nodes"], "nodes", 3)
    triangles = _ids(values["triangles"], "triangles", len(nodes), 3)
    fixed = np.zeros(len(nodes), bool)
    fixed[_ids(values["fixed"], "fixed", len(nodes), 1).ravel()] = True
    deviation = values.get("deviation")
    if deviation is not None:
        deviation = _floats([math.nan if d is None else d for d in deviation], "deviation", 1).ravel()
        if len(deviation) != len(nodes):
            raise ValueError(f"{len(deviation)} deviations for {len(nodes)} nodes")
    desired = values.get("desired")
    if desired is not None and len(desired) != len(nodes):
        raise ValueError(f"{len(desired)} desired lengths for {len(nodes)} nodes")
    settings, before, certificate, alike = (values.get(name) for name in ("settings", "before", "certificate", "alike"))
    return Grid(
        nodes=nodes,
        triangles=triangles,
        panels=_panels(values.get("panels"), triangles, len(nodes)),
        fixed=fixed,
        lines=_ids(values.get("lines", []), "lines", len(nodes), 2),
        line_sets=(
            *_line_sets(values.get("fixed_lines", []), FIXED_LINE, len(nodes)),
            *_line_sets(values.get("ridges", []), RIDGE, len(nodes)),
        ),
        origin=_floats([values["origin"]], "origin", 3)[0],
        unit=unit,
        system=str(values.get("system", "")),
        deviation=deviation,
        desired=None if desired is None else _floats(desired, "desired", 1).ravel(),
        settings=None if settings is None else Settings.from_dict(settings),
        before=None if before is None else GridQuality(**before, unit=unit),
        certificate=None if certificate is None else Certificate.from_dict(certificate),
        alike=None if alike is None else Alike(**alike),
    )


def _panels(given: Any, triangles: np.ndarray, limit: int) -> np.ndarray | None:
    """Return the table of panels of more than three nodes, checked against their triangles; None where there are none."""
    if given is None:
        return None
    loops = [_ids(loop, "panels", limit, 1).ravel().tolist() for loop in given]
    if any(len(set(loop)) != len(loop) or len(loop) < 3 for loop in loops):
        raise ValueError("a panel must have three different nodes or more")
    panels = table_of(loops)
    owner = panel_of_triangles(panels)
    if len(owner) != len(triangles) or not (triangles[:, :, None] == panels[owner][:, None]).any(axis=2).all():
        raise ValueError("the triangles must be those of the panels, one after the other")
    return panels


def _line_sets(given: Any, kind: str, limit: int) -> list[LineSet]:
    """Return the sets of nodes of one kind."""
    return [
        LineSet(str(each["name"]), kind, _ids(each["nodes"], "nodes of a line", limit, 1).ravel()) for each in given
    ]


def _floats(rows: Any, name: str, columns: int) -> np.ndarray:
    """Return rows of numbers as an (N, columns) float64 array; strings and ragged rows are refused."""
    array = np.asarray(rows)
    if array.size and array.dtype.kind not in "if":
        raise ValueError(f"{name} must be numbers")
    return _shaped(array.astype(np.float64), name, columns)


def _ids(rows: Any, name: str, limit: int, columns: int) -> np.ndarray:
    """Return rows of ids from 0 to below `limit` as an (N, columns) int64 array."""
    array = np.asarray(rows)
    if array.size and (array.dtype.kind != "i" or array.min() < 0 or array.max() >= limit):
        raise ValueError(f"{name} must be ids of nodes, 0 to {limit - 1}")
    return _shaped(array.astype(np.int64), name, columns)


def _shaped(array: np.ndarray, name: str, columns: int) -> np.ndarray:
    """Return the array with the given number of columns, or refuse."""
    if array.size == 0:
        return array.reshape(0, columns)
    if array.shape != ((len(array), columns) if columns > 1 else (len(array),)):
        raise ValueError(f"{name} must have {columns} columns, got shape {array.shape}")
    return array.reshape(-1, columns)
