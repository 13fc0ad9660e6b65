"""Statics: textbook values to four digits, laws that hold for every structure, and an independent solver."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csc_matrix
from shapes import make
from small_grids import dome, fan
from small_trusses import (
    EA,
    EI,
    FREE,
    HELD,
    HINGED,
    STEEL,
    TUBE,
    forces,
    line_of,
    make_truss,
    pynite_model,
    stiff_along,
)

import scantruss as st
from scantruss.grid.grid import Grid
from scantruss.structure import modes as modes_module
from scantruss.structure.lanczos import largest_eigenpairs
from scantruss.structure.modes import buckling_modes, vibration_modes, worst_buckling
from scantruss.structure.ordering import dissected
from scantruss.structure.report import report_structure
from scantruss.structure.statics import factor_stiffness, solve
from scantruss.structure.substructures import factor_by_parts
from scantruss.structure.truss import LoadCase, Truss

FOUR_DIGITS = 5e-5
LOADS = "self,cladding:0.5kN/m2,snow:1kN/m2,half-snow:1kN/m2,wind:0.8kN/m2:0.8/-0.5@30,temperature:30K"


def shell(**others: Any) -> Truss:
    """A dome of members of 2 m."""
    return Truss.from_grid(dome(8, 40.0), scale=50, **({"loads": LOADS, "supports": "boundary"} | others))


def line_load(count: int, load: tuple[float, float, float]) -> LoadCase:
    return LoadCase("line", line=np.tile(np.array(load), (count, 1)))


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0.6, 0, 0.8), (0, 0, 1)])
def test_cantilever_bends_as_the_textbook_says(axis: tuple[float, float, float]) -> None:
    """Gere and Goodno, Mechanics of Materials, table H-1: P L3 / 3 E I, P L2 / 2 E I; q L4 / 8 E I."""
    length, force = 3.0, 1000.0
    nodes, members = line_of(length, 4, axis)
    across = np.cross(axis, [0.36, 0.48, 0.8])
    across /= np.linalg.norm(across)
    cases = (forces(5, {4: tuple(force * across)}), line_load(4, tuple(force * across)))
    tip, spread = solve(make_truss(nodes, members, {0: HELD}, *cases)).cases
    assert tip.displacements[4, :3] == pytest.approx(across * force * length**3 / (3 * EI), rel=1e-9, abs=1e-12)
    assert np.linalg.norm(tip.displacements[4, 3:]) == pytest.approx(force * length**2 / (2 * EI), rel=1e-9)
    assert spread.displacements[4, :3] == pytest.approx(across * force * length**4 / (8 * EI), rel=1e-9, abs=1e-12)
    assert np.linalg.norm(spread.reactions[0, 3:]) == pytest.approx(force * length**2 / 2)
    assert np.hypot(*tip.greatest[0, 4:6]) == pytest.approx(force * length)
    assert tip.equilibrium_error < 1e-12 and spread.equilibrium_error < 1e-12


def test_a_portal_frame_has_the_moments_of_kleinlogel() -> None:
    """Kleinlogel, Rahmenformeln, frame 41: both feet fixed, force P at the top.

    With k = h / l of equal sections: at the feet P h (3 k + 1) / 2 (6 k + 1), at the corners P h 3 k / 2 (6 k + 1).
    """
    height, span, force = 4.0, 6.0, 1000.0
    nodes = [(0, 0, 0), (0, 0, height), (span, 0, height), (span, 0, 0)]
    truss = make_truss(
        nodes, [(0, 1), (1, 2), (3, 2)], {0: HELD, 3: HELD}, forces(4, {1: (force, 0, 0)}), sections=(stiff_along(),)
    )
    result = solve(truss)["load"]
    k = height / span
    foot, corner = force * height / 2 * np.array([3 * k + 1, 3 * k]) / (6 * k + 1)
    assert abs(result.reactions[0, 4]) == pytest.approx(foot, rel=FOUR_DIGITS)
    assert np.abs(result.along[1, [0, -1], 4]) == pytest.approx(corner, rel=FOUR_DIGITS)
    assert abs(result.reactions[0, 2]) == pytest.approx(2 * corner / span, rel=FOUR_DIGITS)


def test_a_tripod_has_the_forces_of_its_polygon() -> None:
    """By hand: three legs at an angle to the vertical share P / 3 cos; the apex sinks by P L / 3 E A cos2."""
    angle = np.radians([10, 130, 250])
    feet = np.stack([2 * np.cos(angle), 2 * np.sin(angle), 0 * angle], axis=1)
    truss = make_truss(
        [*feet, (0, 0, 3.0)], [(0, 3), (1, 3), (2, 3)], dict.fromkeys(range(3), HINGED),
        forces(4, {3: (0, 0, -9000.0)}), pinned=True,
    )  # fmt: skip
    result, leg = solve(truss)["load"], math.hypot(2, 3)
    assert result.axial == pytest.approx(np.full((3, 2), -3000 * leg / 3))
    assert result.displacements[3] == pytest.approx([0, 0, -9000 * leg / (3 * EA * (3 / leg) ** 2), 0, 0, 0])
    assert result.stresses[:, 0] == pytest.approx(-1000 * leg / TUBE.area)


@pytest.mark.parametrize("spring", [math.inf, 1e5, 1e3, 1e-6])
def test_springs_at_the_ends_share_the_moment(spring: float) -> None:
    """Slope-deflection, Monforton and Wu 1963: q L2 / 12 / (1 + 2 E I / k L) at the ends; the middle has q L2 / 8 less that."""
    length, load = 4.0, 2000.0
    truss = make_truss(
        [(0, 0, 0), (length, 0, 0)], [(0, 1)], {0: HELD, 1: (*HELD[:5], 0.0)}, line_load(1, (0, 0, -load)),
        end_stiffness=np.full((1, 2, 2), spring),
    )  # fmt: skip
    result = solve(truss)["line"]
    end = load * length**2 / 12 / (1 + 2 * EI / (spring * length))
    assert -result.along[0, 0, 4] == pytest.approx(-end, rel=1e-6, abs=1e-3)
    assert np.abs(result.along[0, 4, 4]) == pytest.approx(load * length**2 / 8 - end, rel=1e-6)
    assert result.along[0, [0, -1], 2] == pytest.approx([-load * length / 2, load * length / 2])
    assert result.greatest[0, 4] == pytest.approx(max(end, load * length**2 / 8 - end), rel=1e-6)


def test_the_greatest_moment_within_a_member_is_found() -> None:
    """By hand: on a beam with q and a moment M at one end, R2 / 2 q with the reaction R = q L / 2 - M / L; between the stations."""
    load, length, moment = 1000.0, 4.0, 700.0
    case = LoadCase("line", line=np.array([[0, 0, -load]]), nodal=np.array([[0.0] * 6, [0, 0, 0, 0, moment, 0]]))
    truss = make_truss([(0, 0, 0), (length, 0, 0)], [(0, 1)], {0: (*HELD[:4], 0.0, np.inf), 1: HINGED}, case)
    result = solve(truss)["line"]
    reaction = load * length / 2 - moment / length
    assert result.reactions[0, 2] == pytest.approx(reaction)
    assert result.greatest[0, 4] == pytest.approx(reaction**2 / (2 * load))
    assert result.greatest[0, 4] > np.abs(result.along[0, :, 4]).max()


def test_temperature_and_lack_of_fit_press_where_members_are_held() -> None:
    held = make_truss(
        [(0, 0, 0), (2, 0, 0), (5, 0, 0)], [(0, 1), (1, 2)], {0: HELD, 2: HELD},
        LoadCase("warm", temperature=np.full(2, 30.0)), LoadCase("long", strain=np.array([0.001, 0.0])),
    )  # fmt: skip
    warm, long = solve(held).cases
    assert warm.axial == pytest.approx(np.full((2, 2), -EA * 12e-6 * 30))
    assert long.axial == pytest.approx(np.full((2, 2), -EA * 0.001 * 2 / 5))
    free = held.replace(supports=np.array([HELD, FREE, FREE]))
    warm, long = solve(free).cases
    assert warm.axial == pytest.approx(0.0, abs=1e-6) and long.axial == pytest.approx(0.0, abs=1e-6)
    assert warm.displacements[2, 0] == pytest.approx(12e-6 * 30 * 5) and long.displacements[2, 0] == pytest.approx(
        0.002
    )


def test_a_support_that_settles_bends_a_held_beam() -> None:
    """Slope-deflection: 6 E I d / L2 at both ends."""
    settled = LoadCase("settled", settlement=np.array([[np.nan] * 3, [np.nan, np.nan, -0.01]]))
    result = solve(make_truss([(0, 0, 0), (4.0, 0, 0)], [(0, 1)], {0: HELD, 1: HELD}, settled))["settled"]
    assert np.abs(result.reactions[:, 4]) == pytest.approx(6 * EI * 0.01 / 16)
    assert result.displacements[1, 2] == -0.01 and result.equilibrium_error < 1e-12


def test_patch_of_the_beam_bends_to_a_parabola() -> None:
    """A moment at the end of uneven members: one curvature everywhere, w = M x2 / 2 E I."""
    nodes, members = line_of(5.0, 7)
    result = solve(make_truss(nodes, members, {0: HELD}, forces(8, {7: (0, 0, 0, 0, -1000.0, 0)})))["load"]
    assert result.displacements[:, 2] == pytest.approx(1000 * nodes[:, 0] ** 2 / (2 * EI), abs=1e-12)
    assert result.along[:, :, 4] == pytest.approx(-1000.0)


def test_patch_of_the_bar_keeps_a_strain_that_is_the_same_everywhere() -> None:
    """The boundary of a flat lattice moves by a linear field: so do the nodes within, and parallel members have one force."""
    grid = dome(7, 10.0)
    flat = grid.replace(nodes=grid.nodes * [1, 1, 0])
    truss = Truss.from_grid(flat, scale=1, unit="mm", supports="boundary", joints="pinned")
    field = truss.nodes @ np.array([[1e-3, 4e-4, 0], [4e-4, -2e-3, 0], [0, 0, 0]])
    rim = np.isinf(truss.supports[:, 0])
    supports = truss.supports.copy()
    supports[:, 2] = np.inf
    moved = np.where(rim[:, None], field, np.nan)
    truss = truss.replace(supports=supports, cases=(LoadCase("field", settlement=moved),), combinations=())
    found = solve(truss)["field"].displacements[:, :3]
    assert found == pytest.approx(field, abs=1e-12)


@pytest.mark.parametrize("joints", ["rigid", "pinned", "5000"])
@pytest.mark.parametrize("support_type", ["pinned", "fixed", "springs:5MN/m"])
def test_every_case_and_combination_is_in_equilibrium(joints: str, support_type: str) -> None:
    truss = shell(joints=joints, support_type=support_type)
    for result in solve(truss).all_results():
        assert result.equilibrium_error < 1e-9
        size = np.abs(result.reactions[:, :3]).sum()
        assert result.applied + result.reaction == pytest.approx(np.zeros(3), abs=1e-9 * size)


def test_loads_have_the_sums_that_areas_give() -> None:
    truss = shell()
    cases = {case.name: case.applied for case in solve(truss).cases}
    surface, plan = np.linalg.norm(truss.triangle_areas, axis=1).sum(), truss.triangle_areas[:, 2].sum()
    assert cases["self"] == pytest.approx([0, 0, -truss.mass * 9.80665], abs=1e-6)
    assert cases["cladding"] == pytest.approx([0, 0, -500 * surface])
    assert cases["snow"] == pytest.approx([0, 0, -1000 * plan])
    assert cases["half-snow 0"] + cases["half-snow 180"] == pytest.approx(cases["snow"])
    assert cases["temperature"] == pytest.approx(np.zeros(3), abs=1e-6)
    heavier = shell(node_allowance=0.15, loads="self")
    assert solve(heavier)["self"].applied == pytest.approx(1.15 * cases["self"], abs=1e-6)


def test_uniform_wind_on_a_closed_surface_sums_to_nothing() -> None:
    from small_grids import icosahedron

    truss = Truss.from_grid(icosahedron(40.0), scale=50, supports="N001+N002+N003", loads="wind:1kN/m2:-0.5")
    assert solve(truss)["wind"].applied == pytest.approx(np.zeros(3), abs=1e-8)


def test_a_structure_turned_about_z_has_the_same_forces() -> None:
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    grid = dome(8, 40.0)
    same: Any = {"supports": "boundary", "scale": 50, "section": "R80x160", "material": "C24"}
    same["loads"] = "self,cladding:0.5kN/m2,snow:1kN/m2,wind:0.8kN/m2:-0.7"
    truss = Truss.from_grid(grid, **same)
    turned = Truss.from_grid(grid.replace(nodes=grid.nodes @ turn.T), **same)
    for one, other in zip(solve(truss).cases, solve(turned).cases, strict=True):
        assert other.natural == pytest.approx(one.natural, rel=1e-7, abs=1e-7 * np.abs(one.natural).max())
        assert other.displacements[:, :3] == pytest.approx(one.displacements[:, :3] @ turn.T, abs=1e-10)


def test_the_unit_of_a_grid_makes_no_difference() -> None:
    millimetres = dome(8, 2000.0)
    metres = millimetres.replace(nodes=millimetres.nodes / 1000, unit="m")
    for one, other in zip(
        solve(Truss.from_grid(millimetres, supports="boundary", loads=LOADS)).cases,
        solve(Truss.from_grid(metres, supports="boundary", loads=LOADS)).cases,
        strict=True,
    ):
        assert other.displacements == pytest.approx(one.displacements, rel=1e-7, abs=1e-12)


def test_a_grid_turned_over_is_loaded_from_above_all_the_same() -> None:
    grid = dome(6, 40.0)
    over = grid.replace(triangles=grid.triangles[:, ::-1])
    one, other = (
        solve(Truss.from_grid(each, supports="boundary", scale=50, loads="snow:1kN/m2"))["snow"]
        for each in (grid, over)
    )
    assert other.applied == pytest.approx(one.applied) and one.applied[2] < 0


def test_local_axes_follow_the_surface() -> None:
    truss = shell()
    axes = truss.axes
    assert axes @ axes.transpose(0, 2, 1) == pytest.approx(np.tile(np.eye(3), (len(axes), 1, 1)))
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert ((axes[:, 2] * truss.member_normals).sum(axis=1) > 0.99).all() and (axes[:, 2, 2] > 0).all()


def test_combinations_are_those_of_en_1990() -> None:
    truss = shell(loads="self,cladding:0.5kN/m2,snow:1kN/m2,wind:0.8kN/m2:-0.7")
    by_name = {each.name: dict(each.factors) for each in truss.combinations}
    assert by_name["ULS 1.35 self + 1.35 cladding + 1.5 snow + 0.9 wind"]["wind"] == 0.9
    assert by_name["ULS 1.35 self + 1.35 cladding + 1.5 wind + 0.75 snow"]["snow"] == 0.75
    assert "ULS 1 self + 1 cladding + 1.5 wind" in by_name and "SLS 1 self + 1 cladding + 1 wind + 0.5 snow" in by_name
    solution = solve(truss)
    both = solution["ULS 1.35 self + 1.35 cladding + 1.5 snow"]
    parts = 1.35 * solution["self"].applied + 1.35 * solution["cladding"].applied + 1.5 * solution["snow"].applied
    assert both.applied == pytest.approx(parts)


def test_results_say_what_they_are_in_a_line() -> None:
    solution = solve(shell())
    for each, words in (
        (solution, "Solution(Truss("),
        (solution["self"], "CaseResult('self', moves "),
        (report_structure(solution), "StructureReport(Truss("),
    ):
        assert repr(each).startswith(words) and len(repr(each)) < 250


def test_halves_of_snow_never_act_together() -> None:
    for each in shell().combinations:
        assert sum("snow" in name for name, _ in each.factors) <= 1


@pytest.mark.parametrize(
    ("truss", "words"),
    [
        (lambda: Truss.from_grid(fan(40.0), supports="boundary", scale=50, joints="pinned"), r"N001 moves along \(0, 0, 1\)"),
        (lambda: shell(support_type="roller"), "let the whole structure move; hold more directions"),
        (lambda: shell(supports="N003"), "let the whole structure move; use more supports"),
        (lambda: shell(supports="N001+N008+N057+N064", joints="pinned"), r"N\d+ moves along .* with it N\d+"),
        (lambda: make_truss([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1), (1, 2)], {0: HINGED, 2: HINGED},
                            forces(3, {1: (1, 0, 0)}), pinned=True), r"N002 moves along"),
        (lambda: make_truss([(0, 0, 0), (1, 0, 0)], [(0, 1)], {0: HELD, 1: HINGED}, forces(2, {0: (1, 0, 0)}),
                            end_stiffness=np.zeros((1, 2, 2))), r"N002 turns about"),
        (lambda: make_truss([(0, 0, 0), (1, 0, 0), (5, 5, 5)], [(0, 1)], {0: HELD}, forces(3, {1: (1, 0, 0)})),
         "no member holds the node N003"),
        (lambda: make_truss([(0, 0, 0), (1, 0, 0)], [(0, 1)], {}, forces(2, {1: (1, 0, 0)})), "no supports"),
    ],
)  # fmt: skip
def test_a_mechanism_is_named_and_never_solved(truss: Any, words: str) -> None:
    with pytest.raises(st.InputError, match=words) as caught:
        solve(truss())
    assert "\n" not in str(caught.value)


def test_a_slender_structure_is_no_mechanism() -> None:
    """A chain of a hundred members: soft, and right."""
    nodes, members = line_of(100.0, 100)
    result = solve(make_truss(nodes, members, {0: HELD}, forces(101, {100: (0, 0, -1.0)})))["load"]
    assert result.displacements[100, 2] == pytest.approx(-1e6 / (3 * EI), rel=1e-4)


def coarse_grid(name: str) -> Grid:
    """A grid of about a hundred nodes from the scan of a shell, in mm."""
    scan = make(name, 12_000).points
    length = math.sqrt(np.ptp(scan[:, :2], axis=0).prod()) / 9
    return st.grid_from_points(scan, st.Settings(length=length, effort="quick", unit="mm"))


GRIDS: dict[str, tuple[Callable[[], Grid], str]] = {  # and their supports
    **{f"dome {count} {supports}": (partial(dome, count, 40.0), supports)
       for count in (5, 8) for supports in ("boundary", "corners", "lowest:0.5")},
    **{name: (partial(coarse_grid, name), "boundary") for name in ("scallop", "limpet", "stadium", "cloth", "clam", "great_court")},
}  # fmt: skip


@pytest.mark.parametrize("name", GRIDS)
def test_pynite_agrees(name: str) -> None:
    """The same nodes, members and forces in an independent solver."""
    pytest.importorskip("Pynite")
    grid, supports = GRIDS[name][0](), GRIDS[name][1]
    truss = Truss.from_grid(
        grid,
        unit="mm",
        scale=2000.0 / float(grid.lengths.mean()),
        supports=supports,
        support_type="fixed",
        loads="cladding:0.5kN/m2,wind:0.8kN/m2:0.8/-0.5@30",
    )
    ours = solve(truss)["cladding"], solve(truss)["wind 30"]
    model = pynite_model(truss, ours)
    model.analyze_linear()
    for case in ours:
        theirs = np.array(
            [[getattr(model.nodes[m], d)[case.name] for d in ("DX", "DY", "DZ")] for m in truss.node_marks]
        )
        assert case.displacements[:, :3] == pytest.approx(theirs, abs=1e-3 * np.abs(theirs).max())
        axial = np.array([-model.members[m].axial(0, case.name) for m in truss.member_marks])
        assert case.along[:, 0, 0] == pytest.approx(axial, abs=1e-3 * np.abs(axial).max())


def test_sections_of_two_sizes_are_two_stiffnesses() -> None:
    """Two bars in a row: each lengthens by F L / E A."""
    thick = replace(TUBE, area=2 * TUBE.area)
    truss = make_truss(
        [(0, 0, 0), (1, 0, 0), (3, 0, 0)], [(0, 1), (1, 2)], {0: HELD}, forces(3, {2: (1000.0, 0, 0)}),
        sections=(TUBE, thick), section_of=np.array([0, 1]),
    )  # fmt: skip
    assert solve(truss)["load"].displacements[:, 0] == pytest.approx([0, 1000 / EA, 2000 / EA])


ENDS = {  # Timoshenko and Gere, Theory of Elastic Stability, 2.1 to 2.4: buckling length over length, supports of the ends
    "cantilever": (2.0, HELD, FREE),
    "hinged": (1.0, (np.inf, np.inf, np.inf, 0, 0, np.inf), (np.inf, np.inf, 0, 0, 0, np.inf)),
    "held and hinged": (0.699157, HELD, (np.inf, np.inf, 0, 0, 0, np.inf)),
    "held": (0.5, HELD, (np.inf, np.inf, 0, np.inf, np.inf, np.inf)),
}


@pytest.mark.parametrize("ends", ENDS)
def test_a_column_buckles_at_the_load_of_euler(ends: str) -> None:
    share, foot, top = ENDS[ends]
    length, count = 4.0, 16
    nodes = np.linspace(0, 1, count + 1)[:, None] * np.array([0, 0, length])
    members = np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)
    truss = make_truss(nodes, members, {0: foot, count: top}, forces(count + 1, {count: (0, 0, -1000.0)}))
    factored = factor_stiffness(truss)
    modes = buckling_modes(factored, solve(truss, factored)["load"], 2)
    assert 1000 * modes.values[0] == pytest.approx(math.pi**2 * EI / (share * length) ** 2, rel=FOUR_DIGITS)
    assert modes.values[1] == pytest.approx(modes.values[0])  # about the other axis of a tube
    assert np.abs(modes.shapes).max() == 1.0


def test_many_freedoms_have_the_modes_of_few() -> None:
    """Sparse and dense eigenvalues of one structure are the same."""
    truss = Truss.from_grid(dome(7, 40.0), scale=50, supports="boundary", joints=20000.0, loads="self,snow:1kN/m2")
    factored = factor_stiffness(truss)
    snow = solve(truss, factored)["snow"]
    sparse = buckling_modes(factored, snow, 3).values, vibration_modes(factored, 3).values
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(modes_module, "FEW_FREEDOMS", 10**6)
        dense = buckling_modes(factored, snow, 3).values, vibration_modes(factored, 3).values
    assert sparse[0] == pytest.approx(dense[0], rel=1e-6) and sparse[1] == pytest.approx(dense[1], rel=1e-6)


def test_modes_are_the_same_wherever_they_are_looked_for() -> None:
    """A shift beyond the first mode is found out by its pivots and taken back; none that helps is no harm."""
    truss = Truss.from_grid(dome(7, 40.0), scale=50, supports="boundary", loads="snow:1kN/m2")
    factored = factor_stiffness(truss)
    snow = solve(truss, factored)["snow"]
    usual = buckling_modes(factored, snow, 3).values
    for shifts in ((1.3, 0.8), (1.3,), ()):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(modes_module, "MODE_SHIFTS", shifts)
            assert buckling_modes(factored, snow, 3).values == pytest.approx(usual, rel=1e-8)


def test_both_modes_of_a_double_value_are_found_among_many_freedoms() -> None:
    """A slender column of a tube buckles and swings about both axes alike."""
    nodes, members = line_of(8.0, 50, (0, 0, 1))
    truss = make_truss(nodes, members, {0: HELD}, forces(51, {50: (0, 0, -1000.0)}))
    factored = factor_stiffness(truss)
    for modes in (buckling_modes(factored, solve(truss, factored)["load"], 6), vibration_modes(factored, 6)):
        assert modes.values[::2] == pytest.approx(modes.values[1::2], rel=1e-8)
        assert (np.diff(modes.values[::2]) > 0.1 * modes.values[0]).all()
        sideways = modes.shapes[:, :, :2].reshape(6, -1)
        sideways /= np.linalg.norm(sideways, axis=1)[:, None]
        assert all(abs(one @ other) < 1 - 1e-3 for one, other in zip(sideways[::2], sideways[1::2], strict=True))


@pytest.mark.parametrize("count", [1, 5, 40])
def test_lanczos_finds_the_largest_eigenvalues_of_a_dense_twin(count: int) -> None:
    rng = np.random.default_rng(count)
    basis = np.linalg.qr(rng.standard_normal((40, 40)))[0]
    matrix = basis @ np.diag([9.0, 9.0, *np.linspace(-3, 5, 36), 0.0, 0.0]) @ basis.T
    metric = np.diag(rng.uniform(1, 3, 40))
    factor = factor_by_parts(csc_matrix(metric), np.array([0, 40]))
    found = largest_eigenpairs(factor, csc_matrix(matrix), csc_matrix(metric), count, 1e-10)
    assert found is not None
    values, vectors = found
    expected = eigh(matrix, metric, eigvals_only=True)[::-1][:count]
    assert values == pytest.approx(expected, abs=1e-9) and vectors.shape == (40, count)
    assert matrix @ vectors == pytest.approx(metric @ vectors * values, abs=1e-7)


@pytest.mark.parametrize("count", [2, 5, 23])
def test_nodes_are_eliminated_in_an_order_that_fills_in_little(count: int) -> None:
    truss = Truss.from_grid(dome(count, 40.0), scale=50, supports="boundary", loads="self")
    rank, first = dissected(truss)
    assert np.array_equal(np.sort(rank), np.arange(len(rank)))
    assert first[0] == 0 and first[-1] == len(rank) and (np.diff(first) > 0).all()
    joined = np.eye(len(rank)) * 9
    joined[tuple(truss.members.T)] = joined[tuple(truss.members.T[::-1])] = -1.0
    inorder = np.argsort(rank)
    matrices = [csc_matrix(joined[order][:, order]) for order in (np.arange(len(rank)), inorder)]
    fill = [len(factor_by_parts(matrix, first).values) for matrix in matrices]
    assert fill[1] < 0.8 * fill[0] or count < 6


def test_a_large_structure_that_is_only_pulled_does_not_buckle() -> None:
    """A chain that hangs, of more displacements than are solved at once."""
    nodes, members = line_of(40.0, 60, (0, 0, -1))
    truss = make_truss(nodes, members, {0: HELD}, forces(61, {60: (0, 0, -1000.0)}))
    factored = factor_stiffness(truss)
    assert len(buckling_modes(factored, solve(truss, factored)["load"], 2).values) == 0


def test_hinged_members_of_a_frame_stay_straight_when_it_buckles() -> None:
    """By hand: a column on a hinge, held at its top by a spring k sideways, falls over at k L."""
    springs = (1e4, 1e4, 0.0, 0.0, 0.0, np.inf)
    for pinned in (True, False):
        supports = {0: HELD, 1: springs if pinned else (*springs[:3], *HELD[3:])}
        load, ends = forces(2, {1: (0, 0, -1000.0)}), np.full((1, 2, 2), 1e-9)
        truss = make_truss([(0, 0, 0), (0, 0, 3.0)], [(0, 1)], supports, load, pinned=pinned, end_stiffness=ends)
        factored = factor_stiffness(truss)
        found = buckling_modes(factored, solve(truss, factored)["load"], 1)
        assert 1000 * found.values[0] == pytest.approx(1e4 * 3.0, rel=1e-6)


def test_what_is_only_pulled_does_not_buckle() -> None:
    truss = make_truss([(0, 0, 0), (0, 0, 3.0)], [(0, 1)], {0: HELD}, forces(2, {1: (0, 0, 1000.0)}))
    factored = factor_stiffness(truss)
    assert len(buckling_modes(factored, solve(truss, factored)["load"], 2).values) == 0


@pytest.mark.parametrize("axis", [(1, 0, 0), (0.6, 0.0, 0.8)])
def test_a_beam_swings_at_the_frequency_of_the_textbook(axis: tuple[float, float, float]) -> None:
    """Chopra, Dynamics of Structures, 16.3: a beam on two supports has n2 pi / 2 L2 sqrt(E I / m)."""
    length, count = 6.0, 16
    nodes = np.linspace(0, 1, count + 1)[:, None] * length * np.asarray(axis)
    members = np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)
    held = (np.inf, np.inf, np.inf, np.inf, 0.0, 0.0) if axis[2] == 0 else (np.inf, np.inf, np.inf, 1e9, 0.0, 1e9)
    truss = make_truss(nodes, members, {0: held, count: held}, LoadCase("self", "permanent", self_weight=1.0))
    first = math.pi / (2 * length**2) * math.sqrt(EI / (TUBE.area * STEEL.density))
    found = vibration_modes(factor_stiffness(truss), 2).values
    assert found[0] == pytest.approx(first, rel=FOUR_DIGITS)
    heavy = vibration_modes(factor_stiffness(truss.replace(cases=(LoadCase("self", "permanent", self_weight=4.0),))), 1)
    assert heavy.values[0] == pytest.approx(found[0] / 2)


def test_the_worst_combination_buckles_first() -> None:
    truss = shell()
    factored = factor_stiffness(truss)
    solution = solve(truss, factored)
    worst = worst_buckling(factored, solution, 2)
    assert worst.of.startswith("ULS") and 0 < worst.values[0] <= worst.values[1]
    each = buckling_modes(factored, solution[worst.of], 1).values[0]
    assert worst.values[0] == pytest.approx(each, rel=1e-6)
