"""Write schedules: one workbook, or a CSV file for each table."""

from __future__ import annotations

import io
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

from ..errors import FormatError
from ..export.csv import encode_table
from ..export.workbook import NOT_IN_XML, without_dates
from ..runtime.files import write_files
from ..runtime.ours import MADE_BY
from ..runtime.places import check_place
from .records import Schedule, Schedules, Value, Workbook

SCHEDULE_SUFFIXES = (".csv", ".xlsx")
DECIMALS = {
    "mm": "0.0",
    "degree": "0.00",
    "kg": "0.00",
    "kN": "0.00",
    "kNm": "0.00",
    "m": "0.000",
    "m2": "0.000",
}  # shown in a cell; it holds all digits
MOST_ROWS = 1_048_576  # of a sheet
MAIN_TABLE = "members"  # the table in the CSV file that is named


def schedule_paths(path: Path) -> dict[str, Path]:
    """Return the place of each table of a .csv: members in the named file, `roof.csv`, others beside it, `roof_node_types.csv`."""
    names = [spec.name for spec in fields(Schedules)]
    return {name: path if name == MAIN_TABLE else path.with_name(f"{path.stem}_{name}{path.suffix}") for name in names}


def write_schedules(
    schedules: Schedules, path: str | Path, *, decimal_comma: bool = False, force: bool = False
) -> list[Path]:
    """Write schedules: all tables in one workbook, or in one CSV file each; the same schedules give the same bytes.

    Parameters
    ----------
    schedules : Schedules
        What to write.
    path : str or Path
        File ending in .xlsx, or in .csv: the table of members, the others beside it.
    decimal_comma : bool
        Whether a .csv has decimal commas, and semicolons between the columns.
    force : bool
        Whether to write over files that ScanTruss did not write.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    FormatError
        Unknown suffix, no such folder, no space; nothing half-written is left.
    """
    path = check_place(path, SCHEDULE_SUFFIXES)
    if path.suffix.lower() == ".xlsx":
        if (rows := max(len(table) for table in schedules.tables) + 2) > MOST_ROWS:
            raise FormatError(
                f"cannot write {path}: a sheet holds {MOST_ROWS:,} rows and {rows:,} are needed; write .csv"
            )
        return write_files({path: encode_xlsx(schedules)}, force=force)
    places = schedule_paths(path)
    tables: dict[Path, Schedule] = {places[name]: table for name, table in schedules.named.items()}
    return write_files(
        {place: encode_table(table.heads, table.rows, decimal_comma=decimal_comma) for place, table in tables.items()},
        force=force,
    )


def encode_xlsx(schedules: Workbook) -> bytes:
    """Return a workbook with a sheet for each table: the header frozen, numbers as numbers, sums in the last row."""
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Alignment, Font
    from openpyxl.utils import get_column_letter

    book = Workbook(write_only=True)
    bold, wrapped = Font(bold=True), Alignment(wrap_text=True, vertical="top")

    for table in schedules.tables:
        sheet = book.create_sheet(table.title)
        sheet.freeze_panes = "B2"
        cells, heavy = (
            [WriteOnlyCell(sheet) for _ in table.columns] for _ in range(2)
        )  # written at once, so used for all rows
        for number, column in enumerate(table.columns, 1):
            longest = max((len(value) for value in column.values if isinstance(value, str)), default=0)
            sheet.column_dimensions[get_column_letter(number)].width = min(max(11, longest + 2), 50)
            for cell in (cells[number - 1], heavy[number - 1]):
                if any(isinstance(value, float) for value in column.values):
                    cell.number_format = DECIMALS.get(column.unit, "0.0000")
            heavy[number - 1].font, heavy[number - 1].alignment = bold, wrapped
        sheet.append(_filled(heavy, table.heads))
        for row in table.rows:
            sheet.append(_filled(cells, row))
        sums = [column.sum for column in table.columns[1:]]
        if any(value is not None for value in sums):
            sheet.append(_filled(heavy, ["sum", *sums]))
    book.properties.creator = MADE_BY
    stream = io.BytesIO()
    book.save(stream)
    return without_dates(stream.getvalue())


def _filled(cells: list[Any], values: Iterable[Value]) -> list[Any]:
    """Return the cells with values in them."""
    for cell, value in zip(cells, values, strict=True):
        cell.value = NOT_IN_XML.sub("?", value) if isinstance(value, str) else value
        if isinstance(value, str):
            cell.data_type = "s"  # a name such as "=B2" is no formula
    return cells
