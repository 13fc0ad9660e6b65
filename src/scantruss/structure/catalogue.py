"""Sections and materials: the bundled catalogues, own ones from CSV, and their properties by the formulas of the standards."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import TypeVar

from ..errors import FormatError, InputError

CATALOGUES = Path(__file__).parent / "data"
#: names of hollow sections of AISC in inches: HSS4.5x0.237 is circular, HSS4x4x1/4 square
AMERICAN = re.compile(r"HSS(\d*\.?\d+)X(?:(\d*\.?\d+)X)?(\d*\.?\d+)(?:/(\d+))?", re.IGNORECASE)
INCH = 0.0254  #: [m]
SHAPES = ("CHS", "SHS", "R", "I")  #: circular and square hollow sections, solid rectangles, rolled I sections


@dataclass(frozen=True)
class Section:
    """A cross-section; y is its axis along the surface, z that along the normal [m]."""

    name: str
    shape: str  #: CHS, SHS, R or I
    width: float  #: along y; the diameter of a CHS [m]
    depth: float  #: along z [m]
    thickness: float  #: of the wall, of the web of an I; 0 of a solid one [m]
    finish: str  #: hot, cold, or "" of a solid one
    area: float  #: [m2]
    inertia_y: float  #: about y, that is for loads along the normal [m4]
    inertia_z: float  #: [m4]
    torsion: float  #: torsion constant [m4]
    elastic_y: float  #: elastic section modulus about y [m3]
    elastic_z: float  #: [m3]
    plastic_y: float  #: plastic section modulus about y [m3]
    plastic_z: float  #: [m3]
    source: str = ""
    flange: float = 0.0  #: thickness of the flanges of an I [m]
    fillet: float = 0.0  #: radius between web and flanges of an I [m]

    @property
    def warping(self) -> float:
        """The warping constant of an I section, 0 of others [m6]."""
        return self.inertia_z * (self.depth - self.flange) ** 2 / 4 if self.shape == "I" else 0.0

    @property
    def radius(self) -> float:
        """The smaller radius of gyration [m]."""
        return math.sqrt(min(self.inertia_y, self.inertia_z) / self.area)


@dataclass(frozen=True)
class Material:
    """A linear elastic material with characteristic strengths."""

    name: str
    kind: str  #: steel, aluminium, timber or other
    young: float  #: E [Pa]
    shear: float  #: G [Pa]
    density: float  #: [kg/m3]
    alpha: float  #: thermal expansion [1/K]
    yield_strength: float  #: of timber that in bending [Pa]
    ultimate: float  #: [Pa]
    source: str = ""


def circular_hollow(name: str, diameter: float, thickness: float, finish: str = "hot", source: str = "") -> Section:
    """Return a circular hollow section [m] (formulas of EN 10210-2 and EN 10219-2, annexes)."""
    inner = diameter - 2 * thickness
    inertia = math.pi * (diameter**4 - inner**4) / 64
    elastic, plastic = 2 * inertia / diameter, (diameter**3 - inner**3) / 6
    area = math.pi * (diameter**2 - inner**2) / 4
    values = (area, inertia, inertia, 2 * inertia, elastic, elastic, plastic, plastic)
    return Section(name, "CHS", diameter, diameter, thickness, finish, *values, source=source)


def square_hollow(name: str, width: float, thickness: float, finish: str = "hot", source: str = "") -> Section:
    """Return a hot finished square hollow section [m], corners with radii of 1.5 and 1.0 thicknesses (EN 10210-2, annex)."""
    outer, inner, clear = 1.5 * thickness, thickness, width - 2 * thickness
    area_out, second_out, lever_out = _corner(outer, width / 2)
    area_in, second_in, lever_in = _corner(inner, clear / 2)
    area = width**2 - clear**2 - 4 * (area_out - area_in)
    inertia = (width**4 - clear**4) / 12 - 4 * (second_out + area_out * lever_out**2)
    inertia += 4 * (second_in + area_in * lever_in**2)
    plastic = (width**3 - clear**3) / 4 - 4 * area_out * lever_out + 4 * area_in * lever_in
    middle = (outer + inner) / 2
    perimeter = 4 * (width - thickness) - 2 * middle * (4 - math.pi)
    enclosed = (width - thickness) ** 2 - middle**2 * (4 - math.pi)
    torsion = thickness**3 * perimeter / 3 + 4 * enclosed**2 * thickness / perimeter
    elastic = 2 * inertia / width
    values = (area, inertia, inertia, torsion, elastic, elastic, plastic, plastic)
    return Section(name, "SHS", width, width, thickness, finish, *values, source=source)


def _corner(radius: float, reach: float) -> tuple[float, float, float]:
    """Return area and second moment of what a rounded corner lacks of a sharp one, and its lever if the sharp one is at `reach`."""
    lever = reach - (10 - 3 * math.pi) / (12 - 3 * math.pi) * radius
    second = (1 / 3 - math.pi / 16 - 1 / (3 * (12 - 3 * math.pi))) * radius**4
    return (1 - math.pi / 4) * radius**2, second, lever


def rolled_i(
    name: str, depth: float, width: float, web: float, flange: float, fillet: float, source: str = ""
) -> Section:
    """Return a hot rolled I section [m], its web along z.

    The torsion constant is that of ArcelorMittal, Sections and Merchant Bars: flanges, web and the circles inscribed where they meet.
    """
    clear = depth - 2 * flange
    corner, second, lever = _corner(fillet, clear / 2)
    across = web - (_corner(fillet, web / 2)[2])  # fillets lie outside the web
    area = 2 * width * flange + clear * web + 4 * corner
    inertia_y = (width * depth**3 - (width - web) * clear**3) / 12 + 4 * (second + corner * lever**2)
    inertia_z = (2 * flange * width**3 + clear * web**3) / 12 + 4 * (second + corner * across**2)
    plastic_y = web * depth**2 / 4 + (width - web) * (depth - flange) * flange + 4 * corner * lever
    plastic_z = width**2 * flange / 2 + clear * web**2 / 4 + 4 * corner * across
    circle = ((fillet + web / 2) ** 2 + (fillet + flange) ** 2 - fillet**2) / (2 * fillet + flange)
    torsion = 2 / 3 * (width - 0.63 * flange) * flange**3 + clear * web**3 / 3
    torsion += 2 * web / flange * (0.145 + 0.1 * fillet / flange) * circle**4
    values = (area, inertia_y, inertia_z, torsion, 2 * inertia_y / depth, 2 * inertia_z / width, plastic_y, plastic_z)
    return Section(name, "I", width, depth, web, "hot", *values, source=source, flange=flange, fillet=fillet)


def rectangle(name: str, width: float, depth: float, source: str = "") -> Section:
    """Return a solid rectangle [m]; torsion constant by Young and Budynas, Roark's Formulas, 7th ed., table 10.1 case 4."""
    long, short = max(width, depth), min(width, depth)
    ratio = short / long
    torsion = long * short**3 * (1 / 3 - 0.21 * ratio * (1 - ratio**4 / 12))
    elastic_y, elastic_z = width * depth**2 / 6, depth * width**2 / 6
    inertia_y, inertia_z = width * depth**3 / 12, depth * width**3 / 12
    values = (width * depth, inertia_y, inertia_z, torsion, elastic_y, elastic_z, 1.5 * elastic_y, 1.5 * elastic_z)
    return Section(name, "R", width, depth, 0.0, "", *values, source=source)


def find_section(name: str) -> Section:
    """Return a section by name (`CHS114.3x5` or `114.3x5`, `SHS100x5`, `R100x200` of width x depth in mm), or from a CSV file.

    `FILE.csv` is a file with one section, `FILE.csv:NAME` one of several; see `read_sections` for its columns.

    Raises
    ------
    InputError
        No such section; the message names the nearest ones.
    """
    if found := re.fullmatch(r"R(\d+\.?\d*)x(\d+\.?\d*)", _key(name).upper().replace("X", "x")):
        width, depth = float(found[1]) / 1e3, float(found[2]) / 1e3
        if min(width, depth) > 0:
            return rectangle(f"R{found[1]}x{found[2]}", width, depth, "dimensions given")
    if american := AMERICAN.fullmatch(name.strip()):
        raise InputError(
            f"no section {name!r} is known: American ones are not bundled; nearest in size is {_nearest_to(american).name}"
        )
    if re.fullmatch(r"\d+\.?\d*x\d+\.?\d*", _key(name)):  # a tube, as `schedule` takes it
        name = f"CHS{name}"
    return _find(name, "section", bundled_sections, read_sections)


def find_material(name: str) -> Material:
    """Return a material by name (`S355`, `GL24h`), or from a CSV file as `find_section` does.

    Raises
    ------
    InputError
        No such material; the message names the nearest ones.
    """
    return _find(name, "material", bundled_materials, read_materials)


@cache
def bundled_sections() -> tuple[Section, ...]:
    """Return the sections of the bundled catalogue."""
    return (*read_sections(CATALOGUES / "sections.csv"), *read_sections(CATALOGUES / "i_sections.csv"))


@cache
def bundled_materials() -> tuple[Material, ...]:
    """Return the materials of the bundled catalogue."""
    return read_materials(CATALOGUES / "materials.csv")


def read_sections(path: str | Path) -> tuple[Section, ...]:
    """Return the sections of a CSV file.

    Columns `name`, `shape` (CHS, SHS, R or I), `width [mm]` (diameter of a CHS), and `thickness [mm]`, of rectangles `depth [mm]`,
    of I sections `depth [mm]`, `thickness [mm]` (web), `flange [mm]` and `fillet [mm]`; `finish` (hot or cold) and `source` may be there.

    Raises
    ------
    FormatError
        The file cannot be read, or a line describes no section.
    """
    return tuple(_rows(path, "sections", _section_of))


def read_materials(path: str | Path) -> tuple[Material, ...]:
    """Return the materials of a CSV file with the columns of the bundled one.

    Columns `name`, `kind`, `E [GPa]`, `G [GPa]`, `density [kg/m3]`, `alpha [1e-6/K]`, `yield [MPa]`, `ultimate [MPa]`, `source`.

    Raises
    ------
    FormatError
        The file cannot be read, or a line describes no material.
    """
    return tuple(_rows(path, "materials", _material_of))


Named = TypeVar("Named", Section, Material)


def _find(
    name: str,
    what: str,
    bundled: Callable[[], tuple[Named, ...]],
    read: Callable[[str | Path], tuple[Named, ...]],
) -> Named:
    """Return what has a name, in the bundled catalogue or a file of one's own."""
    path, _, inner = name.partition(".csv:")
    if name.lower().endswith(".csv") or inner:
        own = read(f"{path}.csv" if inner else name)
        if not inner and len(own) > 1:
            raise InputError(f"{name} holds {len(own)} {what}s; name one, as in {name}:{own[0].name}")
        return own[0] if not inner else _named(inner, what, own)
    return _named(name, what, bundled())


def _named(name: str, what: str, known: tuple[Named, ...]) -> Named:
    by_key = {_key(each.name): each for each in known}
    if (key := _key(name)) in by_key:
        return by_key[key]
    near = [word for word in sorted(by_key, key=lambda word: _distance(key, word)) if _distance(key, word) < math.inf]
    near = near or get_close_matches(key, by_key, 3, 0.4) or list(by_key)
    raise InputError(f"no {what} {name!r} is known; nearest are {' '.join(by_key[word].name for word in near[:3])}")


def _nearest_to(american: re.Match[str]) -> Section:
    """Return the bundled hollow section of a shape and a size next to those of an American one."""
    wide, square = float(american[1]) * INCH, american[2] is not None
    thick = float(american[3]) * INCH / max(float(american[4] or 1), 1.0)
    known = [each for each in bundled_sections() if each.shape == ("SHS" if square else "CHS")]
    return min(known, key=lambda one: abs(one.width - wide) / one.width + abs(one.thickness - thick) / one.thickness)


def _distance(one: str, other: str) -> float:
    """Return how far the numbers in two names are apart; infinite if there are none, or the letters differ."""
    first, second = (re.split(r"(\d+\.?\d*)", word) for word in (one, other))
    if first[::2] != second[::2] or len(first) < 2:
        return math.inf
    pairs = zip(map(float, first[1::2]), map(float, second[1::2]), strict=True)
    return sum(abs(math.log(max(a, 1e-9) / max(b, 1e-9))) for a, b in pairs)


def _key(name: str) -> str:
    """Return a name without what does not matter: case, spaces, zeros behind the decimal point."""
    word = name.replace("\u00d7", "x").replace(" ", "").replace(",", ".").lower()
    return re.sub(r"(\.\d*?)0+(?=x|$)", lambda found: found[1].rstrip("."), word)


def _rows(path: str | Path, what: str, make: Callable[[dict[str, str]], Named]) -> Iterable[Named]:
    """Yield what the lines of a CSV file describe; comments begin with #."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"cannot read the {what} {path}: {getattr(error, 'strerror', '') or error}") from None
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    rows = list(csv.DictReader(lines, skipinitialspace=True))
    if not rows:
        raise FormatError(f"{path} holds no {what}; it needs a header and a line for each")
    for number, row in enumerate(rows, 1):
        try:
            yield make({key.split("[")[0].strip().lower(): (value or "").strip() for key, value in row.items() if key})
        except (KeyError, ValueError, TypeError, AttributeError) as error:
            words = f"no column {error.args[0]}" if isinstance(error, KeyError) else error
            raise FormatError(f"{path}: row {number} of the {what} cannot be used: {words}") from None


def _section_of(row: dict[str, str]) -> Section:
    name, shape, source = row["name"], row["shape"].upper(), row.get("source", "")
    width = _positive(row, "width") / 1e3
    if shape == "R":
        return rectangle(name, width, _positive(row, "depth") / 1e3, source)
    if shape == "I":
        depth, web, flange = (_positive(row, column) / 1e3 for column in ("depth", "thickness", "flange"))
        fillet = _positive(row, "fillet") / 1e3
        if 2 * (flange + fillet) >= depth or web + 2 * fillet >= width:
            raise ValueError("flanges, web and fillets do not fit into depth and width")
        return rolled_i(name, depth, width, web, flange, fillet, source)
    if shape not in SHAPES:
        raise ValueError(f"shape must be one of {' '.join(SHAPES)}, got {row['shape']!r}")
    thickness, finish = _positive(row, "thickness") / 1e3, row.get("finish") or "cold"
    if 2 * thickness >= width:
        raise ValueError(f"walls of {1e3 * thickness:g} mm leave no hole in {1e3 * width:g} mm")
    if finish not in ("hot", "cold"):
        raise ValueError(f"finish must be hot or cold, got {finish!r}")
    make = circular_hollow if shape == "CHS" else square_hollow
    return make(name, width, thickness, finish, source)


def _material_of(row: dict[str, str]) -> Material:
    return Material(
        name=row["name"],
        kind=row["kind"].lower(),
        young=_positive(row, "e") * 1e9,
        shear=_positive(row, "g") * 1e9,
        density=_positive(row, "density"),
        alpha=float(row["alpha"]) * 1e-6,
        yield_strength=_positive(row, "yield") * 1e6,
        ultimate=_positive(row, "ultimate") * 1e6,
        source=row.get("source", ""),
    )


def _positive(row: dict[str, str], column: str) -> float:
    """Return a number of a row that must be positive and finite."""
    value = float(row[column])
    if not 0 < value < math.inf:
        raise ValueError(f"{column} must be a positive number, got {row[column]}")
    return value
