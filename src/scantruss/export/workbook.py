"""Workbooks without dates: the same tables give the same bytes."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterable, Mapping
from typing import Any

from ..runtime.ours import MARK

NO_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip file can hold
NOT_IN_XML = re.compile("[\x00-\x08\x0b-\x1f\ufffe\uffff]")  # that a name of a line may hold

Rows = Iterable[Iterable[Any]]


def encode_workbook(sheets: Mapping[str, Rows]) -> bytes:
    """Return a plain workbook of sheets, numbers as numbers and text as text, also where it begins with "="."""
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell

    book = Workbook(write_only=True)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        formula = WriteOnlyCell(sheet)
        for row in rows:
            cells = list(row)
            for number, value in enumerate(cells):
                if isinstance(value, str):
                    cells[number] = value = NOT_IN_XML.sub("?", value)
                    if value.startswith("="):
                        formula.value, formula.data_type = value, "s"
                        cells[number] = formula
            sheet.append(cells)
    book.properties.creator = MARK
    stream = io.BytesIO()
    book.save(stream)
    return without_dates(stream.getvalue())


def without_dates(content: bytes) -> bytes:
    """Return a workbook without the time at which it was written."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            part = old.read(name)
            if name == "docProps/core.xml":
                part = re.sub(rb">\d{4}-\d\d-\d\dT[\d:.]+Z?<", b">1980-01-01T00:00:00Z<", part)
            new.writestr(zipfile.ZipInfo(name, NO_DATE), part, zipfile.ZIP_DEFLATED)
    return stream.getvalue()
