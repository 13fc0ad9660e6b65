"""The files of a scan by their headers: where their points are, their units, and how they are read."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...selection import Selection
from ..formats.common_unit import to_common_unit
from ..formats.content import Content
from ..formats.las import note_on_heights
from ..formats.paths import FileNames, files_of
from ..formats.reading import check_systems, joint_notes, stays_in_system, system_of_all
from ..units import check_unit
from .chunks import Reading
from .source import Source
from .tiles import find_source


class OpenScan(NamedTuple):
    """The files of a scan by their headers."""

    sources: list[Source]
    reading: Reading
    notes: tuple[str, ...]  #: notes on their units
    system: str = ""  #: reference system of the points as they are read


def open_scan(names: FileNames, unit: str = "", selection: Selection | None = None) -> OpenScan:
    """Return the headers of the files of a scan, how their points are read, and notes on both.

    Parameters
    ----------
    names : files or patterns
    unit : the unit given by the user
    selection : which points are taken; all by default; optional
    """
    check_unit(unit)
    selection = selection or Selection()
    files = files_of(names)
    sources = [find_source(path, selection.needs) for path in files]
    check_systems(files, [source.system for source in sources])
    units: list[str] = []
    all_notes, systems = [], []
    none = Content(np.empty((0, 3)))
    for source in sources:
        common = next((own for own in units if own), "")
        _, own, notes = to_common_unit(source.path, source.applied_to(none), unit, selection.z_unit, common)
        units.append(own)
        all_notes.append(notes)
        systems.append((source.system, stays_in_system(source.applied_to(none), own)))
    common, notes = joint_notes(files, units, all_notes)
    airborne = next((source for source in sources if source.kind == "las"), None)
    if airborne and airborne.z_metres is None and common != "foot" and not selection.z_unit:
        notes = (*notes, *filter(None, [note_on_heights(airborne.path)]))
    return OpenScan(sources, Reading(unit, selection, common), notes, system_of_all(systems))
