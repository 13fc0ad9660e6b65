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
    CLAUSES_CHECKED,
    MemberChecks,
    buckling_curve,
    section_class,
    span_of,
    strengths,
    utilizations,
)
from scantruss.structure.quantities import FORCE, FORCE_PER_LENGTH, LENGTH, PRESSURE, quantity
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


@pytest.mark.parametrize(
    ("text", "units", "metric"),
    [("20psf", PRESSURE, 957.605), ("1ksf", PRESSURE, 47_880.26), ("1kip", FORCE, 4448.2216), ("12in", LENGTH, 0.3048),
     ("2.5ft", LENGTH, 0.762), ("1klf", FORCE_PER_LENGTH, 14_593.9)],
)  # fmt: skip
def test_american_units_are_those_of_the_tables(text: str, units: dict[str, float], metric: float) -> None:
    """NIST SP 811, appendix B.9."""
    assert quantity(text, units, "load") == pytest.approx(metric, rel=1e-5)


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
    used = dict(zip(CLAUSES_CHECKED, utilizations(strength, solve(truss)["load"])[0], strict=True))
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
    used = dict(zip(CLAUSES_CHECKED, utilizations(strengths(result.truss), result)[0], strict=True))
    assert used["6.2.1(7) bending and axial force"] == pytest.approx(10 / 21.22, rel=1e-3)
    assert used["6.2.6 shear"] == pytest.approx(5 / 224.0, rel=1e-3)
    pulled = solve(make_truss(nodes, members, {0: HELD}, forces(2, {1: (304.75e3, 0, -5e3)})))["load"]
    used = dict(zip(CLAUSES_CHECKED, utilizations(strengths(pulled.truss), pulled)[0], strict=True))
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


@pytest.mark.parametrize(
    ("name", "figures"),
    [  # A cm2, I y, I z cm4, W pl y, W pl z cm3, I t cm4 as the tables of rolled sections print them
        ("IPE80", (7.64, 80.1, 8.49, 23.2, 5.8, 0.70)),
        ("IPE200", (28.5, 1943, 142, 221, 44.6, 6.98)),
        ("IPE300", (53.8, 8356, 604, 628, 125, 20.1)),
        ("IPE600", (156, 92080, 3387, 3512, 486, 165)),
        ("HEA100", (21.2, 349, 134, 83.0, 41.1, 5.24)),
        ("HEA200", (53.8, 3692, 1336, 429, 204, 21.0)),
        ("HEA300", (112.5, 18260, 6310, 1383, 641, 85.2)),
        ("HEB200", (78.1, 5696, 2003, 643, 306, 59.3)),
        ("HEB300", (149.1, 25170, 8563, 1869, 870, 185)),
    ],
)
def test_rolled_sections_have_the_properties_of_the_tables(name: str, figures: tuple[float, ...]) -> None:
    section = find_section(name)
    found = (
        section.area * 1e4, section.inertia_y * 1e8, section.inertia_z * 1e8, section.plastic_y * 1e6, section.plastic_z * 1e6,
        section.torsion * 1e8,
    )  # fmt: skip
    assert found == pytest.approx(figures, rel=6e-3)


AREAS = {  # cm2, from the tables: one for every size that is bundled
    "IPE": (7.64, 10.3, 13.2, 16.4, 20.1, 23.9, 28.5, 33.4, 39.1, 45.9, 53.8, 62.6, 72.7, 84.5, 98.8, 115.5, 134.4, 156.0),
    "HEA": (21.2, 25.3, 31.4, 38.8, 45.3, 53.8, 64.3, 76.8, 86.8, 97.3, 112.5, 124.4, 133.5, 142.8, 159.0, 178.0, 197.5),
    "HEB": (26.0, 34.0, 43.0, 54.3, 65.3, 78.1, 91.0, 106.0, 118.4, 131.4, 149.1, 161.3, 170.9, 180.6, 197.8, 218.0, 238.6),
}  # fmt: skip
INERTIAS = {  # I y, cm4
    "IPE": (80.1, 171, 318, 541, 869, 1317, 1943, 2772, 3892, 5790, 8356, 11770, 16270, 23130, 33740, 48200, 67120, 92080),
    "HEA": (349, 606, 1033, 1673, 2510, 3692, 5410, 7763, 10450, 13670, 18260, 22930, 27690, 33090, 45070, 63720, 86970),
    "HEB": (450, 864, 1509, 2492, 3831, 5696, 8091, 11260, 14920, 19270, 25170, 30820, 36660, 43190, 57680, 79890, 107200),
}  # fmt: skip


@pytest.mark.parametrize("series", AREAS)
def test_every_rolled_size_has_the_area_and_stiffness_of_the_tables(series: str) -> None:
    found = [section for section in bundled_sections() if section.name.startswith(series)]
    assert [section.area * 1e4 for section in found] == pytest.approx(AREAS[series], rel=4e-3)
    assert [section.inertia_y * 1e8 for section in found] == pytest.approx(INERTIAS[series], rel=2e-3)


def test_rolled_sections_have_the_classes_and_curves_of_the_tables() -> None:
    """Table 5.2: web 28.4 and flange 4.14 of IPE200; table 6.2 with h / b of 2 and of 1."""
    slim, wide = find_section("IPE200"), find_section("HEB200")
    assert [section_class(slim, find_material(name)) for name in ("S235", "S355", "S460")] == [1, 2, 3]
    assert section_class(wide, STEEL) == 1 and section_class(find_section("IPE400"), STEEL) == 4  # 38.5 > 42 x 0.814
    assert [buckling_curve(slim, STEEL, axis) for axis in "yz"] == ["a", "b"]
    assert [buckling_curve(wide, STEEL, axis) for axis in "yz"] == ["b", "c"]
    assert buckling_curve(slim, find_material("S460"), "z") == "a0"


def test_an_i_beam_buckles_sideways_at_the_moment_worked_out_by_hand() -> None:
    """IPE300 in S235, 3 m between forks.

    pi2 E I z / L2 = 1390 kN, I w = 126e3 cm6, so M,cr = 1390 sqrt(126e3 / 603.8 / 1e4 + 81e3 x 20.1e-8 / 1.390) = 251 kNm,
    slenderness sqrt(628.4 x 0.235 / 251) = 0.767, phi 0.854, chi 0.814 on curve a; shear area 53.8 - 32.1 + 4.0 = 25.7 cm2.
    """
    truss = make_truss([(0, 0, 0), (3.0, 0, 0)], [(0, 1)], {0: HELD, 1: HELD}, forces(2, {1: (0, 0, 0)}),
                       sections=(find_section("IPE300"),), material=find_material("S235"))  # fmt: skip
    strength = strengths(truss)
    assert find_section("IPE300").warping == pytest.approx(126e-9, rel=5e-3)
    assert strength.lateral[0] == pytest.approx(0.814, abs=2e-3)
    assert strength.shear[0, 1] == pytest.approx(25.7e-4 * 235e6 / np.sqrt(3), rel=2e-3)


def test_tubes_do_not_buckle_sideways() -> None:
    truss = Truss.from_grid(dome(6, 40.0), scale=50, supports="boundary")
    assert (strengths(truss).lateral == 1).all()


def test_own_i_sections_come_from_csv(tmp_path: Path) -> None:
    table = tmp_path / "own.csv"
    head = "name,shape,depth [mm],width [mm],thickness [mm],flange [mm],fillet [mm]\n"
    table.write_text(head + "B1,I,200,100,5.6,8.5,12\n")
    assert find_section(str(table)).inertia_y == find_section("IPE200").inertia_y
    table.write_text(head + "B1,I,20,100,5.6,8.5,12\n")
    with pytest.raises(st.FormatError, match="do not fit into depth"):
        find_section(str(table))
