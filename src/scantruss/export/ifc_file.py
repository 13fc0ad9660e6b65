"""What both views of an IFC file share: units, place, sections, material, groups.

All numbers are in m, N, kg and s. Coordinates are
relative to the placement of the site, which is the origin of the scan; where the reference system is known, the map conversion holds
the origin and the site lies at 0. Identifiers follow from the marks and that origin, so a
part keeps its own when it is written again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .bodies import Bodies
from .model import Model
from .part21 import Part21, Ref, Word, ifc_guid, typed

if TYPE_CHECKING:
    from ..structure.catalogue import Material, Section

IFC_SCHEMAS = {"IFC4": "IFC4", "IFC4X3": "IFC4X3_ADD2"}  #: edition -> word of its schema
VIEW = "ViewDefinition [notYetAssigned]"
SI = (  # kind, prefix, unit
    ("LENGTHUNIT", None, "METRE"), ("AREAUNIT", None, "SQUARE_METRE"), ("VOLUMEUNIT", None, "CUBIC_METRE"),
    ("PLANEANGLEUNIT", None, "RADIAN"), ("MASSUNIT", "KILO", "GRAM"), ("TIMEUNIT", None, "SECOND"),
    ("FORCEUNIT", None, "NEWTON"), ("PRESSUREUNIT", None, "PASCAL"), ("THERMODYNAMICTEMPERATUREUNIT", None, "KELVIN"),
)  # fmt: skip
DERIVED = {  # kind -> powers of units
    "LINEARFORCEUNIT": {"FORCEUNIT": 1, "LENGTHUNIT": -1},
    "TORQUEUNIT": {"FORCEUNIT": 1, "LENGTHUNIT": 1},
    "LINEARSTIFFNESSUNIT": {"FORCEUNIT": 1, "LENGTHUNIT": -1},
    "ROTATIONALSTIFFNESSUNIT": {"FORCEUNIT": 1, "LENGTHUNIT": 1, "PLANEANGLEUNIT": -1},
    "MASSDENSITYUNIT": {"MASSUNIT": 1, "LENGTHUNIT": -3},
    "MODULUSOFELASTICITYUNIT": {"FORCEUNIT": 1, "LENGTHUNIT": -2},
    "SHEARMODULUSUNIT": {"FORCEUNIT": 1, "LENGTHUNIT": -2},
    "THERMALEXPANSIONCOEFFICIENTUNIT": {"THERMODYNAMICTEMPERATUREUNIT": -1},
    "MOMENTOFINERTIAUNIT": {"LENGTHUNIT": 4},
}


class Ifc(Part21):
    """An IFC file under construction."""

    def __init__(self, model: Model, schema: str = "IFC4") -> None:
        super().__init__(IFC_SCHEMAS[schema], VIEW)
        self.model = model
        self.up = self.add("IFCDIRECTION", (0.0, 0.0, 1.0))
        self.x = self.add("IFCDIRECTION", (1.0, 0.0, 0.0))
        self.zero = self.add("IFCCARTESIANPOINT", (0.0, 0.0, 0.0))
        here = self.add("IFCAXIS2PLACEMENT3D", self.zero, None, None)
        self.context = self.add("IFCGEOMETRICREPRESENTATIONCONTEXT", None, "Model", 3, 1e-6, here, None)
        self.axis, self.body, self.reference = (self._part(name) for name in ("Axis", "Body", "Reference"))
        units = self.add("IFCUNITASSIGNMENT", self._units())
        self.project = self.root(
            "IFCPROJECT", "project", "", "ScanTruss", None, None, None, None, (self.context,), units
        )
        origin = (model.origin * model.metres).tolist()
        mapped = bool(model.system) and model.unit == "m"  # the numbers of the file are then those of the system
        if mapped:
            system = self.add("IFCPROJECTEDCRS", model.system, *[None] * 6)
            self.add("IFCMAPCONVERSION", self.context, system, *origin, 1.0, 0.0, 1.0)
        at = self.zero if mapped else self.add("IFCCARTESIANPOINT", origin)
        place = self.add("IFCAXIS2PLACEMENT3D", at, None, None)
        self.place = self.add("IFCLOCALPLACEMENT", None, place)  #: of all that is relative to the origin
        self.site = self.root(
            "IFCSITE", "site", "", "Site", None, None, self.place, None, None, Word(".ELEMENT."), *[None] * 5
        )
        self.relate("IFCRELAGGREGATES", "project", self.project, (self.site,))

    def root(self, name: str, kind: str, mark: str, *values: Any) -> Ref:
        """Add an instance with an identifier of its own; without history."""
        return self.add(name, ifc_guid(self.model.guid(f"ifc {kind}", mark)), None, *values)

    def relate(self, name: str, mark: str, *values: Any) -> Ref:
        """Add a relation without name; `mark` distinguishes it from others of its kind."""
        return self.root(name, name, mark, None, None, *values)

    def properties(self, name: str, mark: str, values: dict[str, Any], of: tuple[Ref, ...]) -> Ref:
        """Add a set of properties to parts; a value is one with its type."""
        singles = [self.add("IFCPROPERTYSINGLEVALUE", key, None, value, None) for key, value in values.items()]
        found = self.root("IFCPROPERTYSET", name, mark, name, None, singles)
        return self.relate("IFCRELDEFINESBYPROPERTIES", f"{name} {mark}", of, found)

    def _part(self, name: str) -> Ref:
        return self.add(
            "IFCGEOMETRICREPRESENTATIONSUBCONTEXT", name, "Model", *[Word("*")] * 4, self.context, None,
            Word(".MODEL_VIEW."), None,
        )  # fmt: skip

    def _units(self) -> list[Ref]:
        units = {
            kind: self.add("IFCSIUNIT", Word("*"), Word(f".{kind}."), prefix and Word(f".{prefix}."), Word(f".{name}."))
            for kind, prefix, name in SI
        }
        for kind, powers in DERIVED.items():
            parts = [self.add("IFCDERIVEDUNITELEMENT", units[unit], power) for unit, power in powers.items()]
            units[kind] = self.add("IFCDERIVEDUNIT", parts, Word(f".{kind}."), None)
        return list(units.values())

    def profile(self, section: Section) -> Ref:
        """Add the profile of a section: its x is the local y of the member, its y the local z."""
        head = (Word(".AREA."), section.name, None)
        if section.shape == "CHS":
            return self.add("IFCCIRCLEHOLLOWPROFILEDEF", *head, section.width / 2, section.thickness)
        if section.shape == "SHS":
            wall = section.thickness
            size = (section.width, section.depth, wall, wall, 1.5 * wall)
            return self.add("IFCRECTANGLEHOLLOWPROFILEDEF", *head, *size)
        if section.shape == "I":
            size = (section.width, section.depth, section.thickness, section.flange, section.fillet)
            return self.add("IFCISHAPEPROFILEDEF", *head, *size, None, None)
        return self.add("IFCRECTANGLEPROFILEDEF", *head, section.width, section.depth)

    def material(self, material: Material) -> Ref:
        """Add a material with its properties."""
        found = self.add("IFCMATERIAL", material.name, None, material.kind)
        sets: dict[str, dict[str, tuple[str, float]]] = {
            "Pset_MaterialCommon": {"MassDensity": ("IFCMASSDENSITYMEASURE", material.density)},
            "Pset_MaterialMechanical": {
                "YoungModulus": ("IFCMODULUSOFELASTICITYMEASURE", material.young),
                "ShearModulus": ("IFCMODULUSOFELASTICITYMEASURE", material.shear),
                "ThermalExpansionCoefficient": ("IFCTHERMALEXPANSIONCOEFFICIENTMEASURE", material.alpha),
            },
        }
        if material.kind == "steel":
            sets["Pset_MaterialSteel"] = {
                "YieldStress": ("IFCPRESSUREMEASURE", material.yield_strength),
                "UltimateStress": ("IFCPRESSUREMEASURE", material.ultimate),
            }
        for name, values in sets.items():
            singles = [
                self.add("IFCPROPERTYSINGLEVALUE", key, None, typed(kind, value), None)
                for key, (kind, value) in values.items()
            ]
            self.add("IFCMATERIALPROPERTIES", name, None, singles, found)
        return found


class Profiles:
    """The sections with their material, each once."""

    def __init__(self, ifc: Ifc, bodies: Bodies) -> None:
        truss = ifc.model.truss
        material = None if truss is None else ifc.material(truss.material)
        self.profiles = [ifc.profile(section) for section in bodies.sections]
        self.sets = [
            ifc.add(
                "IFCMATERIALPROFILESET", section.name, None,
                (ifc.add("IFCMATERIALPROFILE", section.name, None, material, profile, None, "LoadBearing"),), None,
            )
            for section, profile in zip(bodies.sections, self.profiles, strict=True)
        ]  # fmt: skip

    def associate(self, ifc: Ifc, kind: str, bodies: Bodies, parts: list[Ref], usage: bool) -> None:
        """Give parts, one for each member, the section and material of theirs."""
        for number, (section, found) in enumerate(zip(bodies.sections, self.sets, strict=True)):
            mine = [parts[k] for k in np.flatnonzero(bodies.section_of == number).tolist()]
            if mine:
                used = (
                    ifc.add("IFCMATERIALPROFILESETUSAGE", found, 5, None) if usage else found
                )  # 5: mid-depth centreline
                ifc.relate("IFCRELASSOCIATESMATERIAL", f"{kind} {number} {section.name}", mine, used)
