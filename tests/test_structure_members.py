"""Catalogues and checks: values of the standards, worked out by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_grids import dome
from small_trusses import HELD, HINGED, STEEL, TUBE, forces, line_of, make_truss

import scantruss as st
from scantruss.structure.catalogue import bundled_materials, bundled_sections, find_material, find_section
from scantruss.structure.checks import (
    CLAUSES,
    MemberChecks,
    buckling_curve,
    section_class,
    span_of,
    strengths,
    utilizations,
)
from scantruss.structure.report import report_structure
from scantruss.structure.statics import solve
from scantruss.structure.truss import LoadCase, Truss


@pytest.mark.parametrize(
    ("name", "figures"),
    [  # A cm2, I cm4, W el cm3, W pl cm3, I t cm4 as the tables of EN 10210-2 print them
        ("CHS114.3x5", (17.2, 257, 45.0, 59.8, 514)),
        ("CHS219.1x10", (65.7, 3598, 328, 438, 7197)),
        ("SHS100x5", (18.7, 279, 55.9, 66.4, 439)),
    ],
)
def test_sections_have_the_properties_of_the_standard(name: str, figures: tuple[float, ...]) -> None:
    section = find_section(name)
    found = (
        section.area * 1e4,
        section.inertia_y * 1e8,
        section.elastic_y * 1e6,
        section.plastic_y * 1e6,
        section.torsion * 1e8,
    )
    assert found == pytest.approx(figures, rel=3e-3)


def test_a_rectangle_stands_on_its_edge() -> None:
    section = find_section("R100x200")
    assert section.inertia_y == pytest.approx(0.1 * 0.2**3 / 12) and section.inertia_z == pytest.approx(
        0.2 * 0.1**3 / 12
    )
    assert section.torsion == pytest.approx(0.229 * 0.2 * 0.1**3, rel=2e-3)  # Roark: beta = 0.229 for sides 1 : 2


def test_every_bundled_row_names_its_source_and_is_sound() -> None:
    assert len({section.name for section in bundled_sections()}) == len(bundled_sections()) > 200
    for section in bundled_sections():
        assert section.source and section.finish in ("hot", "cold")
        assert 0 < section.area < section.width * section.depth and section.elastic_y < section.plastic_y
    assert all(material.source for material in bundled_materials())


@pytest.mark.parametrize("name", ["chs114.3X5.0", " CHS 114.3 x 5", "CHS114.3x5"])
def test_a_name_is_known_however_it_is_written(name: str) -> None:
    assert find_section(name).name == "CHS114.3x5"


@pytest.mark.parametrize(
    ("name", "near"), [("CHS114x5", "CHS114.3x5"), ("chs50x5", "CHS60.3x5"), ("SHS101x5", "SHS100x5")]
)
def test_an_unknown_section_is_refused_with_the_nearest(name: str, near: str) -> None:
    with pytest.raises(st.InputError, match=rf"no section .*nearest are .*{near}"):
        find_section(name)


def test_an_unknown_material_is_refused_with_the_nearest() -> None:
    with pytest.raises(st.InputError, match=r"no material 'S350'.*S355"):
        find_material("S350")


def test_own_sections_and_materials_come_from_csv(tmp_path: Path) -> None:
    table = tmp_path / "own.csv"
    table.write_text("name,shape,width [mm],depth [mm],thickness [mm]\nT1,CHS,100,,4\nB1,R,60,120,\n")
    assert find_section(f"{table}:T1").area == pytest.approx(np.pi * 96 * 4 * 1e-6)
    assert find_section(f"{table}:b1").inertia_y == pytest.approx(0.06 * 0.12**3 / 12)
    with pytest.raises(st.InputError, match="holds 2 sections; name one"):
        find_section(str(table))
    table.write_text("name,shape,width [mm],thickness [mm]\nT1,CHS,100,60\n")
    with pytest.raises(st.FormatError, match=r"row 1 .*leave no hole"):
        find_section(str(table))
    materials = tmp_path / "m.csv"
    head = "name,kind,E [GPa],G [GPa],density [kg/m3],alpha [1e-6/K],yield [MPa],ultimate [MPa]\n"
    materials.write_text(head + "ours,steel,200,80,7800,11,300,400\n")
    assert find_material(str(materials)).young == 200e9
    materials.write_text(head + "ours,steel,-200,80,7800,11,300,400\n")
    with pytest.raises(st.FormatError, match="positive"):
        find_material(str(materials))


def test_classes_and_curves_are_those_of_the_tables() -> None:
    """EN 1993-1-1 table 5.2: d / t of 50, 70, 90 epsilon squared; table 6.2."""
    tube = find_section("CHS508x6.3")  # d / t = 80.6
    assert [section_class(tube, find_material(name)) for name in ("S235", "S275", "S355")] == [3, 4, 4]
    assert section_class(TUBE, STEEL) == 1 and section_class(find_section("SHS300x6.3"), STEEL) == 4  # c / t = 44.6
    assert [buckling_curve(find_section(n), STEEL) for n in ("CHS114.3x5", "CFCHS114.3x5", "R50x100")] == [
        "a",
        "c",
        "c",
    ]
    assert buckling_curve(TUBE, find_material("S460")) == "a0"


def test_a_column_buckles_at_the_load_worked_out_by_hand() -> None:
    """EN 1993-1-1 6.3.1 for CHS114.3x5 in S355, 3 m: 3000 / 38.68 / 76.4 = 1.015, phi 1.101, chi 0.655, 17.17 cm2 x 355 x chi."""
    truss = make_truss([(0, 0, 0), (0, 0, 3.0)], [(0, 1)], {0: HELD, 1: (np.inf, np.inf, 0.0, np.inf, np.inf, np.inf)},
                       forces(2, {1: (0, 0, -200e3)}))  # fmt: skip
    strength = strengths(truss)
    assert strength.relative[0] == pytest.approx([1.015, 1.015], rel=1e-3)
    assert strength.buckling[0] == pytest.approx(399.4e3, rel=2e-3)
    used = dict(zip(CLAUSES, utilizations(strength, solve(truss)["load"])[0], strict=True))
    assert used["6.2.3 tension"] == 0 and used["6.2.4 compression"] == pytest.approx(200 / 609.5, rel=1e-3)
    assert (
        used["6.3.1 flexural buckling"]
        == pytest.approx(used["6.3.3 bending and compression"])
        == pytest.approx(0.5008, rel=2e-3)
    )
    half = strengths(truss, MemberChecks(effective_length=0.5))
    assert half.relative[0] == pytest.approx(strength.relative[0] / 2) and half.buckling[0] > strength.buckling[0]


def test_a_beam_is_used_by_its_moment_and_shear() -> None:
    """EN 1993-1-1 6.2.5, 6.2.6 by hand: W pl f y = 59.77 cm3 x 355 = 21.22 kNm; 2 A / pi x f y / sqrt 3 = 224.0 kN."""
    nodes, members = line_of(2.0, 1)
    result = solve(make_truss(nodes, members, {0: HELD}, forces(2, {1: (0, 0, -5e3)})))["load"]
    used = dict(zip(CLAUSES, utilizations(strengths(result.truss), result)[0], strict=True))
    assert used["6.2.1(7) bending and axial force"] == pytest.approx(10 / 21.22, rel=1e-3)
    assert used["6.2.6 shear"] == pytest.approx(5 / 224.0, rel=1e-3)
    pulled = solve(make_truss(nodes, members, {0: HELD}, forces(2, {1: (304.75e3, 0, -5e3)})))["load"]
    used = dict(zip(CLAUSES, utilizations(strengths(pulled.truss), pulled)[0], strict=True))
    assert used["6.2.3 tension"] == pytest.approx(0.5, rel=1e-3)
    assert used["6.2.1(7) bending and axial force"] == pytest.approx(0.5 + 10 / 21.22, rel=1e-3)


def test_twice_the_load_is_twice_the_use_in_bending_and_more_in_buckling() -> None:
    truss = Truss.from_grid(dome(8, 40.0), supports="boundary", scale=50, loads="snow:1kN/m2")
    strength = strengths(truss)
    result = solve(truss)["snow"]
    one = utilizations(strength, result)
    two = utilizations(strength, replace(result, **{p: 2 * getattr(result, p) for p in ("natural", "line", "nodal")}))
    assert two[:, [0, 1, 2, 4]] == pytest.approx(2 * one[:, [0, 1, 2, 4]])
    assert (two >= 2 * one - 1e-12).all()


def test_what_is_no_steel_of_class_1_to_3_is_not_checked_and_says_so() -> None:
    grid = dome(6, 40.0)
    for section, material in (("R60x120", "GL24h"), ("CHS508x6.3", "S355")):
        report = report_structure(
            solve(Truss.from_grid(grid, supports="boundary", scale=50, section=section, material=material))
        )
        assert report.to_dict()["utilization_max"] is None and report.utilization is None
        assert any("no member is checked" in words for words in report.warnings)


def test_warnings_say_what_is_beyond_a_limit() -> None:
    truss = Truss.from_grid(
        dome(6, 40.0), scale=200, section="CHS21.3x2.6", loads="self,snow:5kN/m2", supports="corners"
    )
    said = " ".join(report_structure(solve(truss)).warnings)
    assert "are used beyond 1" in said and "more slender than 200" in said and "more than span/300" in said
    assert not report_structure(solve(Truss.from_grid(dome(6, 40.0), supports="boundary", scale=50))).warnings


def test_the_span_is_twice_the_way_to_the_nearest_support() -> None:
    nodes, _ = line_of(10.0, 1)
    middle = make_truss(
        [*nodes, (5, 0, 1)], [(0, 2), (2, 1)], {0: HINGED, 1: HINGED}, LoadCase("self", self_weight=1.0)
    )
    assert span_of(middle) == pytest.approx(10.0)


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), "1"])
def test_limits_must_be_positive(value: float) -> None:
    with pytest.raises(st.InputError, match="gamma_m0 must be a positive number"):
        MemberChecks(gamma_m0=value)
