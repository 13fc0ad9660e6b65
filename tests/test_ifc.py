"""IFC read back by ifcopenshell, held to the schema and its where-rules, and meshed by its geometry kernel."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.geolocation
import ifcopenshell.util.placement
import ifcopenshell.util.shape
import ifcopenshell.util.unit
import ifcopenshell.validate
import numpy as np
import pytest
from small_grids import dome, fan
from test_convert import UTM, roof

import scantruss as st
from scantruss.export.formats import read_model
from scantruss.export.style import FileStyle
from scantruss.structure.catalogue import Section
from scantruss.structure.truss import LoadCase

TUBE = FileStyle(tube=(60.0, 3.0), ball=110.0)


pytestmark = pytest.mark.filterwarnings(  # the library leaves a file open
    "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)


def written(what: Any, path: Path, style: FileStyle | None = None, *, rules: bool = False) -> Any:
    """Write an IFC file and open it by the library, once its validator, and the where-rules if asked for, have found nothing."""
    st.write(what, path, style=style)
    file = ifcopenshell.open(str(path))
    logger = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(file, logger, express_rules=rules)
    assert [statement["message"] for statement in logger.statements] == []
    assert ifcopenshell.util.unit.calculate_unit_scale(file) == 1.0
    return file


def sheet(path: Path, unit: str = "mm") -> st.Grid:
    """A small grid with names from all over, far from the origin."""
    line = st.grid.line_sets.LineSet("Träger 'Süd' 中文 🙂", "fixed line", np.array([0, 1, 2]))
    return fan(4000.0, unit=unit, origin=UTM * 1000, fixed=(1,), lines=np.array([[0, 1], [1, 2]]), line_sets=(line,))


BODIES = ("IfcMember", "IfcDiscreteAccessory", "IfcPlate")


def volumes(file: Any, kinds: tuple[str, ...] = BODIES) -> dict[str, float]:
    """Return the volume of each part by its mark, as the geometry kernel meshes it."""
    settings = ifcopenshell.geom.settings()
    settings.set("mesher-angular-deflection", 0.2)
    found = {}
    for part in [part for kind in kinds for part in file.by_type(kind)]:
        shape = ifcopenshell.geom.create_shape(settings, part)
        assert len(shape.geometry.faces) > 0, part
        found[part.Name] = ifcopenshell.util.shape.get_volume(shape.geometry)
    return found


def properties(part: Any) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for relation in part.IsDefinedBy:
        definition = relation.RelatingPropertyDefinition
        for each in getattr(definition, "HasProperties", ()):
            found[each.Name] = each.NominalValue.wrappedValue
        for each in getattr(definition, "Quantities", ()):
            found[each.Name] = each[3]
    return found


def test_members_balls_and_panels_of_a_grid(tmp_path: Path) -> None:
    grid = sheet(tmp_path)
    file = written(grid, tmp_path / "Dach 屋顶.ifc", TUBE)
    members = {part.Name: part for part in file.by_type("IfcMember")}
    nodes = {part.Name: part for part in file.by_type("IfcDiscreteAccessory")}
    assert list(nodes) == [f"N{k:03d}" for k in range(1, 8)] and len(file.by_type("IfcPlate")) == 6
    places = np.array(
        [ifcopenshell.util.placement.get_local_placement(part.ObjectPlacement)[:3, 3] for part in nodes.values()]
    )
    assert np.abs(places - grid.scan_nodes / 1000).max() < 1e-6
    by_kernel = volumes(file)
    for (mark, part), (start, end) in zip(members.items(), grid.edges.tolist(), strict=True):
        frame = ifcopenshell.util.placement.get_local_placement(part.ObjectPlacement)
        along = (grid.nodes[end] - grid.nodes[start]) / np.linalg.norm(grid.nodes[end] - grid.nodes[start])
        np.testing.assert_allclose(frame[:3, 2], along, atol=1e-9)
        assert np.linalg.det(frame[:3, :3]) == pytest.approx(1.0)
        values = properties(part)
        cut = 4.0 - 2 * math.sqrt(0.055**2 - 0.03**2)
        assert values["Length"] == pytest.approx(cut) and values["SystemLength"] == pytest.approx(4.0)
        assert (values["StartNode"], values["EndNode"]) == (f"N{start + 1:03d}", f"N{end + 1:03d}")
        volume = math.pi * 0.003 * 0.057 * cut
        assert values["NetVolume"] == pytest.approx(volume)
        assert by_kernel[mark] == pytest.approx(volume, rel=0.02)
        (profile,) = {relation.RelatingMaterial.ForProfileSet.MaterialProfiles[0].Profile
                      for relation in part.HasAssociations if relation.is_a("IfcRelAssociatesMaterial")}  # fmt: skip
        assert (profile.Radius, profile.WallThickness) == (0.03, 0.003)
    for mark in nodes:
        assert by_kernel[mark] == pytest.approx(4 / 3 * math.pi * 0.055**3, rel=0.03)
    groups = {
        group.Name: {part.Name for part in group.IsGroupedBy[0].RelatedObjects} for group in file.by_type("IfcGroup")
    }
    assert groups["nodes line:Träger 'Süd' 中文 🙂"] == {"N001", "N002", "N003"} and groups["nodes fixed"] == {"N002"}
    assert len(groups["members boundary"]) == 6 and "members Träger 'Süd' 中文 🙂" in groups


def test_a_grid_without_a_tube_is_lines_and_points(tmp_path: Path) -> None:
    file = written(sheet(tmp_path), tmp_path / "a.ifc")
    assert {
        shape.RepresentationIdentifier
        for part in file.by_type("IfcMember")
        for shape in part.Representation.Representations
    } == {"Axis"}
    with pytest.raises(st.FormatError, match="needs a unit"):
        st.write(dome(4, unit=""), tmp_path / "b.ifc")
    with pytest.raises(st.FormatError, match="shorter than its balls"):
        st.write(fan(80.0), tmp_path / "b.ifc", style=TUBE)


@pytest.mark.parametrize(
    ("section", "shape", "joints"),
    [
        ("SHS100x5", "IfcRectangleHollowProfileDef", "rigid"),
        ("R100x200", "IfcRectangleProfileDef", "rigid"),
        ("IPE200", "IfcIShapeProfileDef", "rigid"),
        ("HEB300", "IfcIShapeProfileDef", "pinned"),
    ],
)
def test_other_sections_have_the_area_of_the_catalogue(section: str, shape: str, joints: str, tmp_path: Path) -> None:
    truss = roof(3, section=section, joints=joints, supports="boundary")
    file = written(truss, tmp_path / "a.ifc", FileStyle(ifc="physical", ball=0.0))
    assert {profile.is_a() for profile in file.by_type("IfcProfileDef")} == {shape}
    assert not file.by_type("IfcStructuralItem")
    by_kernel = volumes(file, BODIES[:1])
    for mark, length in zip(truss.member_marks, truss.lengths, strict=True):
        assert by_kernel[mark] == pytest.approx(truss.sections[0].area * length, rel=0.01)
    part = file.by_type("IfcMember")[0]
    frame = ifcopenshell.util.placement.get_local_placement(part.ObjectPlacement)
    np.testing.assert_allclose(frame[:3, :3].T, truss.axes[0][[1, 2, 0]], atol=1e-12)  # y, z, x of the member


def stiffness(condition: Any) -> list[float]:
    if condition is None:
        return [math.inf] * 6
    values = [condition[k].wrappedValue for k in range(1, 7)]
    return [math.inf if value is True else 0.0 if value is False else value for value in values]


@pytest.mark.parametrize("pinned", [False, True])
def test_supports_releases_loads_and_results_are_those_of_the_structure(pinned: bool, tmp_path: Path) -> None:
    truss = roof(3, joints="pinned" if pinned else "rigid", supports="boundary")
    rng = np.random.default_rng(2)
    count = len(truss.nodes)
    held = np.flatnonzero(truss.supports.any(axis=1))
    supports = truss.supports.copy()
    supports[held[0]] = [5e6, math.inf, 0.0, 0.0, 3e5, math.inf]
    springs = truss.end_stiffness.copy()
    springs[3, 0], springs[5, 1] = [0.0, 3e5], [1e5, math.inf]
    settled = np.full((count, 3), np.nan)
    settled[held[2], 2] = -0.005
    nodal = rng.normal(size=(count, 6)) * ([1, 1, 1, 0, 0, 0] if pinned else 1)
    odd = LoadCase("Träger 中", nodal=nodal, line=rng.normal(size=(len(truss.members), 3)),
                   strain=rng.normal(size=len(truss.members)) * 1e-4, settlement=settled)  # fmt: skip
    truss = truss.replace(supports=supports, cases=(*truss.cases, odd), end_stiffness=springs)
    solution = st.solve(truss)
    file = written(solution, tmp_path / "a.ifc", FileStyle(ifc="analysis" if pinned else "both"), rules=not pinned)
    assert bool(file.by_type("IfcMember")) != pinned
    (model,) = file.by_type("IfcStructuralAnalysisModel")
    nodes = {part.Name: part for part in file.by_type("IfcStructuralPointConnection")}
    members = {part.Name: part for part in file.by_type("IfcStructuralCurveMember")}
    assert tuple(nodes) == truss.node_marks and tuple(members) == truss.member_marks
    shift = ifcopenshell.util.placement.get_local_placement(model.SharedPlacement)[:3, 3]
    places = {}
    for number, (mark, part) in enumerate(nodes.items()):
        (shape,) = part.Representation.Representations
        assert (shape.RepresentationType, shape.Items[0].is_a()) == ("Vertex", "IfcVertexPoint")
        places[shape.Items[0].id()] = number
        place = np.array(shape.Items[0].VertexGeometry.Coordinates) + shift
        assert np.abs(place - truss.nodes[number] - UTM).max() < 1e-6
        free = stiffness(part.AppliedCondition) if part.AppliedCondition else [0.0] * 6
        assert free == truss.supports[number].tolist(), mark
    releases = {}
    for relation in file.by_type("IfcRelConnectsStructuralMember"):
        ends = members[relation.RelatingStructuralMember.Name].Representation.Representations[0].Items[0]
        where = list(nodes).index(relation.RelatedStructuralConnection.Name)
        end = [places[ends.EdgeStart.id()], places[ends.EdgeEnd.id()]].index(where)
        releases[relation.RelatingStructuralMember.Name, end] = stiffness(relation.AppliedCondition)
    for number, (mark, part) in enumerate(members.items()):
        edge = part.Representation.Representations[0]
        assert edge.RepresentationType == "Edge"
        both = [places[edge.Items[0].EdgeStart.id()], places[edge.Items[0].EdgeEnd.id()]]
        assert both == truss.members[number].tolist()
        np.testing.assert_allclose(part.Axis.DirectionRatios, truss.axes[number, 2])
        for end in (0, 1):
            expected = [0.0, 0.0] if pinned else springs[number, end].tolist()
            assert releases[mark, end] == [math.inf] * 4 + expected
    cases = {case.Name: case for case in file.by_type("IfcStructuralLoadCase")}
    assert list(cases) == [case.name for case in truss.cases]
    for case in truss.cases:
        weight = cases[case.name].SelfWeightCoefficients
        assert (weight or (0, 0, 0))[2] == -case.self_weight
        nodal, line = np.zeros((count, 6)), np.zeros((len(truss.members), 3))
        warm, moved = np.zeros(len(truss.members)), np.full((count, 3), np.nan)
        acts = [act for group in cases[case.name].IsGroupedBy for act in group.RelatedObjects]
        for act in acts:
            where, load = act.AssignedToStructuralItem[0].RelatingElement.Name, act.AppliedLoad
            values = [value or 0.0 for value in tuple(load)[1:7]] if len(load) > 6 else []
            if load.is_a("IfcStructuralLoadSingleForce"):
                nodal[list(nodes).index(where)] += values
            elif load.is_a("IfcStructuralLoadSingleDisplacement"):
                moved[list(nodes).index(where)] = [np.nan if value is None else value for value in tuple(load)[1:4]]
            elif load.is_a("IfcStructuralLoadLinearForce"):
                line[list(members).index(where)] += values[:3]
            else:
                warm[list(members).index(where)] += load.DeltaTConstant
        none = np.zeros(1)
        np.testing.assert_allclose(nodal, (case.nodal if case.nodal is not None else none) + np.zeros_like(nodal))
        np.testing.assert_allclose(line, (case.line if case.line is not None else none) + np.zeros_like(line))
        strain = none if case.strain is None else case.strain / truss.material.alpha
        np.testing.assert_allclose(
            warm, (none if case.temperature is None else case.temperature) + strain + 0 * warm, atol=1e-12
        )
        np.testing.assert_array_equal(moved, moved * np.nan if case.settlement is None else case.settlement)
    factors: dict[str, list[tuple[str, float]]] = {}
    for relation in file.by_type("IfcRelAssignsToGroupByFactor"):
        factors.setdefault(relation.RelatingGroup.Name, []).append((relation.RelatedObjects[0].Name, relation.Factor))
    assert factors == {each.name: list(each.factors) for each in truss.combinations}
    for group in file.by_type("IfcStructuralResultGroup"):
        result = solution[group.ResultForLoadGroup.Name]
        for act in group.IsGroupedBy[0].RelatedObjects:
            where, load = act.AssignedToStructuralItem[0].RelatingElement.Name, act.AppliedLoad
            if load.is_a("IfcStructuralLoadConfiguration"):
                number = list(members).index(where)
                assert [location[0] for location in load.Locations] == [
                    0.0,
                    truss.lengths[number] / 2,
                    truss.lengths[number],
                ]
                np.testing.assert_allclose([tuple(each)[1:7] for each in load.Values], result.along[number, [0, 4, 8]])
            else:
                known = result.reactions if load.is_a("IfcStructuralLoadSingleForce") else result.displacements
                np.testing.assert_allclose(tuple(load)[1:7], known[list(nodes).index(where)])


def test_both_views_of_a_structure_belong_together(tmp_path: Path) -> None:
    truss = roof(3, loads="self")
    file = written(truss, tmp_path / "a.ifc")
    pairs = {r.RelatedObjects[0].Name: r.RelatingProduct.Name for r in file.by_type("IfcRelAssignsToProduct")}
    assert pairs == {mark: mark for mark in truss.member_marks}
    masses = [properties(part)["NetWeight"] for part in file.by_type("IfcMember")]
    (first, *_), (density,) = truss.sections, {7850.0}
    assert isinstance(first, Section)
    assert sum(masses) == pytest.approx(
        first.area * density * sum(properties(p)["Length"] for p in file.by_type("IfcMember"))
    )
    first_bytes = (tmp_path / "a.ifc").read_bytes()
    ids = {root.Name: root.GlobalId for root in file.by_type("IfcMember")}
    moved = truss.replace(nodes=truss.nodes + 0.01)
    again = written(moved, tmp_path / "a.ifc")
    assert {root.Name: root.GlobalId for root in again.by_type("IfcMember")} == ids
    assert (tmp_path / "a.ifc").read_bytes() != first_bytes


@pytest.mark.parametrize("edition", ["IFC4", "IFC4X3"])
def test_a_scan_with_a_reference_system_is_placed_by_a_map_conversion(edition: str, tmp_path: Path) -> None:
    truss = roof(2 if edition == "IFC4X3" else 3).replace(system="EPSG:25833")
    style = FileStyle(ifc_schema=edition)
    file = written(st.solve(truss), tmp_path / "a.ifc", style, rules=edition == "IFC4X3")
    assert file.schema == edition
    (conversion,) = file.by_type("IfcMapConversion")
    assert conversion.TargetCRS.Name == "EPSG:25833"
    xyz = ifcopenshell.util.geolocation.auto_xyz2enh(file, 1.0, 2.0, 3.0)
    np.testing.assert_allclose(xyz, truss.origin + [1.0, 2.0, 3.0], rtol=0, atol=1e-6)
    node = file.by_type("IfcDiscreteAccessory")[0]
    place = ifcopenshell.util.placement.get_local_placement(node.ObjectPlacement)[:3, 3]
    assert np.abs(place - truss.nodes[0]).max() < 1e-9
    back = read_model(tmp_path / "a.ifc")
    assert back.system == "EPSG:25833" and back.grid is not None
    gaps = np.linalg.norm(back.nodes[:, None] - (truss.nodes + truss.origin)[None], axis=2).min(axis=1)
    assert gaps.max() < 1e-6
