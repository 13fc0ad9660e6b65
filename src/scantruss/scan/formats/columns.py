"""Which columns hold x, y, z and the attributes of points, by their names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ...errors import InputError

_BESIDE = "coordinates?|coord|position|pos|points?|pt|vertex|world|global|local|scan|axis|value|p|v"
_DIRECT = tuple(re.compile(f"(?:{_BESIDE})?{axis}(?:{_BESIDE})?") for axis in "xyz")
_COUNTED = tuple(re.compile(f"(?:{_BESIDE}|xyz)(?:{number})") for number in "012")
_MAP = (
    re.compile("e|east|eastings?|rechtswert|ost|ostwert"),
    re.compile("n|north|northings?|hochwert|nord|nordwert"),
    re.compile("z|h|heights?|elev|elevations?|alt|altitude|level|hoehe|hhe"),
)
_FAMILIES = (_DIRECT, _COUNTED, _MAP, (*_DIRECT[:2], _MAP[2]))
_NUMBER_OF_POINT = re.compile("id|ids|nr|no|num|number|index|idx|point|pointid|pt|name|label|fid|punkt|punktnummer|")

#: attribute -> names that columns and properties have for it, in lower case, letters and digits only
COLUMN_NAMES = {
    "class": ("classification", "class", "scalarclassification", "classid"),
    "return_number": ("returnnumber", "return", "scalarreturnnumber", "returnnum"),
    "return_count": ("numberofreturns", "returns", "scalarnumberofreturns", "numreturns", "returncount"),
    "confidence": ("confidence", "scalarconfidence", "conf"),
    "nx": ("nx", "normalx", "scalarnx", "xnormal"),
    "ny": ("ny", "normaly", "scalarny", "ynormal"),
    "nz": ("nz", "normalz", "scalarnz", "znormal"),
    "red": ("red", "r", "colorred", "diffusered", "scalarred"),
    "green": ("green", "g", "colorgreen", "diffusegreen", "scalargreen"),
    "blue": ("blue", "b", "colorblue", "diffuseblue", "scalarblue"),
    "rgb": ("rgb", "rgba"),
}
NORMAL_COLUMNS = ("nx", "ny", "nz")  # attributes that are a normal together


def clean_name(name: str) -> str:
    """Return a column name in lower case, ASCII letters and digits only, without quotes, brackets and unit."""
    name = re.sub(r"\(.*?\)|\[.*?\]|<.*?>", "", name.strip().strip("\"'").lower())
    name = re.sub(r"[\s_.:/-]+(mm|cm|m|ft|feet|foot|in|inch|inches|met(er|re)s?)\s*$", "", name)
    return re.sub(r"[^0-9a-z]", "", name)


def find_columns(names: Sequence[str]) -> tuple[int, int, int] | None:
    """Return the columns named x, y, z (or easting, northing, height); None if a name is missing."""
    clean = [clean_name(name) for name in names]
    for family in _FAMILIES:
        found = [next((i for i, name in enumerate(clean) if axis.fullmatch(name)), -1) for axis in family]
        if min(found) >= 0 and len(set(found)) == 3:
            return found[0], found[1], found[2]
    return None


def find_attributes(names: Sequence[str], wanted: Sequence[str]) -> dict[str, int]:
    """Return the columns that hold the wanted attributes, by their names; missing ones are left out."""
    clean = [clean_name(name) for name in names]
    return {
        attribute: column
        for attribute in wanted
        if (column := next((clean.index(name) for name in COLUMN_NAMES[attribute] if name in clean), -1)) >= 0
    }


def fit_columns(names: Sequence[str], width: int, has_row_names: bool) -> tuple[int, int, int] | None:
    """Return the columns of x, y, z for rows of a given width; None if the names do not fit the rows.

    Parameters
    ----------
    names : words of a header line
    width : fields of a row
    has_row_names : whether the first field of the rows is a label or a running number, which a header may leave out
    """
    if len(names) > width:
        return find_columns(names[-width:])  # "columns: x y z"
    found = find_columns(names)
    if not found or len(names) == width:
        return found
    if has_row_names and len(names) == width - 1 and not _NUMBER_OF_POINT.fullmatch(clean_name(names[0])):
        return found[0] + 1, found[1] + 1, found[2] + 1
    if sorted(found) == [0, 1, 2] or _NUMBER_OF_POINT.fullmatch(clean_name(names[0])):
        return found
    return None


def check_not_degrees(path: Path, names: Sequence[str]) -> None:
    """Refuse names of longitude and latitude where there are no lengths."""
    clean = {clean_name(name) for name in names}
    if clean & {"lon", "long", "lng", "longitude"} and clean & {"lat", "latitude"}:
        raise InputError(
            f"{path} has longitude and latitude in degrees, and a grid needs lengths; project it to a plane system such"
            " as UTM first (QGIS, pyproj), with columns x, y, z"
        )
