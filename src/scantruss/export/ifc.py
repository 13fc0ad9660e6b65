"""IFC4: parts of a building for a grid; for a structure these, its analysis model and its results."""

from __future__ import annotations

from .bodies import bodies_of
from .ifc_analysis import add_analysis
from .ifc_file import Ifc, Profiles
from .ifc_physical import add_physical
from .model import Model
from .part21 import Ref
from .style import FileStyle


def encode_ifc(model: Model, style: FileStyle) -> bytes:
    """Return an IFC4 file: physical parts of a grid; of a structure these, its analysis model and its results."""
    ifc = Ifc(model, style.ifc_schema)
    bodies = bodies_of(model, style)
    profiles = None if bodies is None else Profiles(ifc, bodies)
    members: list[Ref] = []
    if model.truss is None or style.ifc != "analysis":
        members = add_physical(ifc, bodies, profiles)
    if model.truss is not None and style.ifc != "physical":
        assert bodies is not None and profiles is not None
        add_analysis(ifc, bodies, profiles, members)
    return ifc.encode()
