"""Points of a Parquet file by pyarrow: the columns are those a text file would be read by."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError
from ..units import metres_of_columns
from .columns import check_not_degrees, find_attributes, find_columns
from .content import Content
from .kinds import read_head, reading_as, wrong_kind

ROWS_AT_ONCE = 1 << 18  # rows


def read_parquet(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a Parquet file and the wanted attributes."""
    head = read_head(path)
    if not head.startswith(b"PAR1"):
        raise wrong_kind(path, head, "a Parquet file")
    import pyarrow.parquet as parquet

    with reading_as(path, "Parquet"), parquet.ParquetFile(path, memory_map=True) as file:
        return _read(path, file, wanted)


def metres_of_parquet(path: Path) -> tuple[float | None, float | None]:
    """Return the metres per unit of x and y, and of z, that the columns name, without reading them; None if they do not."""
    with suppress(Exception):  # if the file is damaged, reading the points reports how
        import pyarrow.parquet as parquet

        names = parquet.read_schema(path).names
        if columns := find_columns(names):
            return metres_of_columns(path, [names[c] for c in columns])
    return None, None


def _read(path: Path, file: Any, wanted: Sequence[str]) -> Content:
    names = file.schema_arrow.names
    columns = find_columns(names)
    if columns is None:
        check_not_degrees(path, names)
        raise FormatError(f"{path} has no columns named x, y and z; it has {', '.join(names)[:120] or 'none'}")
    found = find_attributes(names, wanted)
    places = [*columns, *found.values()]
    chosen = list(dict.fromkeys(names[place] for place in places))
    parts = []
    for batch in file.iter_batches(ROWS_AT_ONCE, columns=chosen):
        parts.append(np.column_stack([_numbers(path, batch, names[place]) for place in places]))
    table = np.concatenate(parts) if parts else np.empty((0, len(places)))
    attributes = {name: table[:, 3 + i] for i, name in enumerate(found)}
    return Content(
        np.ascontiguousarray(table[:, :3]), attributes, *metres_of_columns(path, [names[c] for c in columns])
    )


def _numbers(path: Path, batch: Any, name: str) -> np.ndarray:
    """Return a column as float64, missing values as NaN."""
    import pyarrow

    column = batch.column(batch.schema.get_field_index(name))
    try:
        values = column.cast(pyarrow.float64()).to_numpy(zero_copy_only=False)
    except pyarrow.ArrowException:
        raise FormatError(f"{path}: column {name} must hold numbers, it holds {column.type}") from None
    return np.asarray(values, dtype=np.float64)
