"""From files to a PointCloud."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...errors import FormatError, InputError
from ...runtime.places import nearest_suffix
from ...selection import Selection
from ..checks import degrees_note, extent_note, extent_of, single_precision_note
from ..cloud import PointCloud
from ..units import check_unit, name_of
from .choose import box_around_boxes, check_attributes, choose, cropped_boxes, describe_points, places_in
from .columns import NORMAL_COLUMNS
from .common_unit import to_common_unit
from .content import Content
from .copc import WantedBox
from .kinds import read_head
from .las import Places, read_las
from .packed import unpacked
from .paths import FileNames, files_of, name_of_files
from .table import PACKED, READERS

# suffixes of files whose columns of normals are read
WITH_NORMALS = {".ply", ".pcd", ".npy", ".npz", ".parquet", ".xyz", ".txt", ".csv", ".pts", ".asc"}


@dataclass(frozen=True, eq=False)
class Part:
    """The points of one file after selection, in one unit."""

    points: np.ndarray  #: (N, 3) [unit]
    unit: str
    system: str  #: reference system, "" if the file does not say it
    count: int  #: points in the file
    left_out: dict[str, int]  #: points that the file marks as none, and points that each part of the selection left out
    held: str  #: what could have been selected, if nothing was
    notes: tuple[str, ...]
    normals: np.ndarray | None = None  #: (N, 3)
    cropped: dict[str, np.ndarray] = field(default_factory=dict)  #: (2, 3) the box around what each crop left out
    in_system: bool = True  #: whether the points are still in the units of that system


def read_points(path: FileNames, unit: str = "", selection: Selection | None = None) -> PointCloud:
    """Return the points of a scan; the suffix decides the format.

    Parameters
    ----------
    path : str, Path or several of them
        A file with one of the suffixes in `READERS` (also packed: .xyz.gz), a pattern such as ``tiles/*.laz``, or several
        of these that together are one scan.
    unit : str
        Unit of the coordinates: mm, cm, m, inch, foot, or "" for what the file says.
    selection : Selection, optional
        Which points are kept; all by default.

    Returns
    -------
    PointCloud
        All points that are kept, in the order of the files, with normals if all files have normals or faces; colours and other
        properties are ignored. `notes` says what was left out or converted.

    Raises
    ------
    FormatError
        A file is missing, empty, damaged, or of another kind than its suffix says.
    InputError
        The points cannot be used: too few, mostly NaN, all on a line; degrees; the unit is not known; nothing is selected.
    """
    check_unit(unit)
    selection = selection or Selection()
    files = files_of(path)
    parts: list[Part] = []
    for file in files:
        common = next((part.unit for part in parts if part.unit), "")
        parts.append(read_part(file, unit, selection, common))
    points, unit, notes = _join(files, parts)
    if not len(points):
        raise _nothing_left(files, parts)
    normals = [part.normals for part in parts if part.normals is not None]
    given = np.concatenate(normals) if len(normals) == len(parts) else None
    cloud = PointCloud.from_array(points, unit=unit, name=name_of_files(path), normals=given)
    left_out = add_counts([*(part.left_out for part in parts), dict(cloud.left_out)])
    common_system = system_of_all([(part.system, part.in_system) for part in parts])
    notes = (*notes, *cloud.notes, *degrees_note(cloud), *single_precision_note(cloud))
    every = [part.cropped for part in parts]
    cropped = {
        words: box_around_boxes([boxes[words] for boxes in every if words in boxes])
        for boxes in every
        for words in boxes
    }
    return replace(
        cloud, notes=notes, left_out=tuple(left_out.items()), cropped=tuple(cropped.items()), system=common_system
    )


def read_part(path: Path, unit: str, selection: Selection, common: str = "") -> Part:
    """Return the selected points of one file, brought to the unit `common` where its own is known; see `read_points`."""

    def places_of(header: Content) -> list[WantedBox]:
        return places_in_file(path, header, unit, selection, common)

    has_columns = not WITH_NORMALS.isdisjoint(suffix.lower() for suffix in path.suffixes[-2:])  # .xyz.gz too
    wanted = (*selection.needs, *(NORMAL_COLUMNS if has_columns else ()))
    content = read_content(path, wanted, places_of if selection.crop else None)
    if all(name in content.attributes for name in NORMAL_COLUMNS):
        content = replace(content, normals=np.column_stack([content.attributes[name] for name in NORMAL_COLUMNS]))
    return select(path, content, unit, selection, common)


def places_in_file(path: Path, header: Content, unit: str, selection: Selection, common: str) -> list[WantedBox]:
    """Return the boxes around what is cropped in the unit of a file, by what it says."""
    scale, _, _ = to_common_unit(path, replace(header, points=np.ones((1, 3))), unit, selection.z_unit, common)
    return places_in(selection.crop, scale[0])


def select(
    path: Path, content: Content, unit: str, selection: Selection, common: str = "", described: int | None = None
) -> Part:
    """Return what is selected of some points of a file; if nothing is, about `described` of them are described, or all."""
    check_attributes(path, content.attributes, selection)
    points, unit, notes = to_common_unit(path, content, unit, selection.z_unit, common)
    kept, chosen = choose(points, content.attributes, selection)
    held = "" if kept.any() else _describe(points, content, described)
    normals, cropped = content.normals, dict[str, np.ndarray]()
    if not kept.all():
        cropped = cropped_boxes(points, kept, selection) if selection.crop else cropped
        points = points[kept]
        normals = normals if normals is None else normals[kept]
    left_out = add_counts([content.left_out, chosen, content.unread])
    count = len(points) + sum(left_out.values())
    in_system = stays_in_system(content, unit)
    return Part(points, unit, content.system, count, left_out, held, notes, normals, cropped, in_system)


def _describe(points: np.ndarray, content: Content, most: int | None) -> str:
    """Return what could be selected, judged by points from all parts of the file, as the first may all be NaN."""
    some = slice(None, None, max(len(points) // most, 1) if most else 1)
    return describe_points(points[some], {name: values[some] for name, values in content.attributes.items()})


def read_content(path: Path, wanted: Sequence[str] = (), places_of: Places | None = None) -> Content:
    """Return the content of a file unchanged: all points and the wanted attributes.

    Where the file has a table of places only the points near `places_of` what it says of its units are read.
    """
    read_head(path)
    with ExitStack() as stack:
        inner = path
        if path.suffix.lower() == PACKED and Path(path.stem).suffix.lower() in READERS:
            inner = stack.enter_context(unpacked(path))
        try:
            reader = READERS[inner.suffix.lower()]
        except KeyError:
            known = " ".join(sorted(READERS))
            near = nearest_suffix(path, READERS)
            if path.suffix.lower() == ".json":
                near = "; a grid or a structure goes to scantruss structure, schedule or convert"
            raise FormatError(f'no reader for "{path.suffix}" ({path.name}); use one of {known}{near}') from None
        try:
            with np.errstate(all="ignore"):  # values that are not finite are counted and left out later
                return read_las(inner, wanted, places_of) if reader is read_las else reader(inner, wanted)
        except OSError as error:
            raise FormatError(f"{path} cannot be read: {error.strerror or ' '.join(str(error).split())}") from None
        except MemoryError:
            raise FormatError(f"{path} does not fit into the memory of this computer; thin the scan first") from None


def _join(files: Sequence[Path], parts: Sequence[Part]) -> tuple[np.ndarray, str, tuple[str, ...]]:
    """Return the points of all files in one unit, the unit, and notes."""
    check_systems(files, [part.system for part in parts])
    unit, notes = joint_notes(files, [part.unit for part in parts], [part.notes for part in parts])
    points = parts[0].points if len(parts) == 1 else np.concatenate([part.points for part in parts])
    notes = (*notes, *left_out_note([part.left_out for part in parts]))
    return points, unit, (*notes, *extent_note(files, [extent_of(part.points) for part in parts]))


def joint_notes(
    files: Sequence[Path], units: Sequence[str], notes: Sequence[Sequence[str]]
) -> tuple[str, tuple[str, ...]]:
    """Return the unit of all files of a scan, "" if none says one, and the notes on them, each once."""
    unit = next((unit for unit in units if unit), "")
    once: dict[str, None] = {}
    for file, own, words in zip(files, units, notes, strict=True):
        once.update(dict.fromkeys(words))
        if unit and not own:
            once[f"{file.name} does not state its unit and is taken to be in {unit} like the others"] = None
    return unit, tuple(once)


def left_out_note(parts: Sequence[Mapping[str, int]]) -> tuple[str, ...]:
    """Return a note on the points that are left out of the parts of a scan."""
    return tuple(f"{count:,} points {words} are left out" for words, count in add_counts(parts).items())


def add_counts(parts: Sequence[Mapping[str, int]]) -> dict[str, int]:
    """Return the sums of counts by their words."""
    sums: dict[str, int] = {}
    for part in parts:
        for words, count in part.items():
            sums[words] = sums.get(words, 0) + count
    return sums


def check_systems(files: Sequence[Path], systems: Sequence[str]) -> None:
    """Refuse files whose reference systems are known to differ."""
    for by_code in (True, False):
        named = [(f, system) for f, system in zip(files, systems, strict=True) if system]
        named = [(f, system) for f, system in named if system.startswith("EPSG:") == by_code]
        for file, system in named[1:]:
            if system != named[0][1]:
                raise InputError(
                    f"{file} is in {system} and {named[0][0]} in {named[0][1]}; files of one scan must share a reference"
                    " system, so bring them to one first (PDAL filters.reprojection)"
                )


def stays_in_system(content: Content, unit: str) -> bool:
    """Return whether x and y of a file are still in the unit of its reference system once they are in `unit`."""
    return not content.degrees and (content.metres is None or name_of(content.metres) == unit)


def system_of_all(systems: Sequence[tuple[str, bool]]) -> str:
    """Return the reference system of a scan by those of its files, each with whether the points are still in it; "" for none."""
    named = [(system, kept) for system, kept in systems if system]
    return named[0][0] if named and all(kept for _, kept in named) else ""


def _nothing_left(files: Sequence[Path], parts: Sequence[Part]) -> Exception:
    count = sum(part.count for part in parts)
    if not count:
        return FormatError(
            f"{files[0]} holds no points" if len(files) == 1 else f"none of {len(files)} files holds points"
        )
    left_out = add_counts([part.left_out for part in parts])
    counts = ", ".join(f"{number:,} {words}" for words, number in left_out.items() if number)
    held = next((part.held for part in parts if part.held), "")
    has = f"; {'the scan has' if len(parts) == 1 else 'some of them have'}{held}" if held else ""
    return InputError(f"no point of {name_of_files(files)} is left: of {count:,} points {counts}{has}")
