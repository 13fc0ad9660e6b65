"""Schedules of structures: forces, bolts and balls by hand, marks and masses of the structure, the command."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_grids import dome, fan
from test_schedules import numbers

import scantruss as st
from scantruss.cli.main import main
from scantruss.schedules.bolts import PITCHES, bolted_radii, choose_bolts, stress_area, tension_resistance
from scantruss.schedules.forces import grid_of_structure
from scantruss.schedules.lines import schedule_warnings
from scantruss.structure.json import read_checked
from scantruss.structure.truss import LoadCase

LOADS = "self,snow:2kN/m2,half-snow:2kN/m2"


def roof(**others: Any) -> st.Truss:
    given: dict[str, Any] = {"section": "CHS60.3x4", "supports": "corners", "loads": LOADS}
    return st.Truss.from_grid(dome(6, 2.0, unit="m"), **(given | others))


@pytest.mark.parametrize(
    ("size", "area"),
    [(12, 84.3), (16, 157), (20, 245), (24, 353), (27, 459), (30, 561), (36, 817), (39, 976), (48, 1470), (56, 2030), (64, 2680)],
)  # fmt: skip
def test_stress_areas_are_those_of_the_tables(size: int, area: float) -> None:
    """ISO 898-1 table 4 up to M39, DIN 13-28 beyond; three digits."""
    assert stress_area(size) == pytest.approx(area, rel=3e-3)


def test_a_bolt_is_the_smallest_that_carries_its_tension() -> None:
    assert tension_resistance(20, "10.9") == pytest.approx(0.9 * 1000 * 244.8 / 1.25, rel=1e-3)  # 176.3 kN
    assert tension_resistance(20, "8.8") == pytest.approx(0.8 * tension_resistance(20, "10.9"))
    limits = [tension_resistance(size, "8.8") for size in PITCHES]
    assert limits == sorted(limits)
    tension = np.array([0.0, *(limit * (1 + sign * 1e-9) for limit in limits for sign in (-1, 1))])
    chosen = choose_bolts(tension, "8.8").tolist()
    sizes = list(PITCHES)
    assert chosen == [12, *(each for pair in zip(sizes, [*sizes[1:], 0], strict=True) for each in pair)]


@pytest.mark.parametrize("pair", [(20, 20), (12, 30), (30, 12)])
@pytest.mark.parametrize("angle", [20.0, 35.0, 60.0, 90.0, 120.0, 175.0])
def test_bolts_and_sleeves_do_not_meet_in_the_ball(angle: float, pair: tuple[int, int]) -> None:
    """Points of one bolt in the ball, and of one sleeve on it, lie in no other; in a little smaller ball some do, at sharp angles."""
    thread, sleeve = 1.1, 1.8
    radius = float(bolted_radii(np.array([angle]), np.array([pair]), thread, sleeve)[0])
    axes = np.array([(1, 0, 0), (math.cos(math.radians(angle)), math.sin(math.radians(angle)), 0)])
    share, turn = np.meshgrid(np.linspace(0, 1, 400), np.linspace(0, 2 * np.pi, 73), indexing="ij")

    def meets(ball: float) -> bool:
        flats = [math.sqrt(max(ball**2 - (sleeve * each / 2) ** 2, 0.0)) for each in pair]
        found = False
        for outer, reach in ((1.0, [(flat - thread * each, flat) for flat, each in zip(flats, pair, strict=True)]),
                             (sleeve, [(flat, flat + 50.0) for flat in flats])):  # fmt: skip
            along = reach[0][0] + share * (reach[0][1] - reach[0][0])
            half = outer * pair[0] / 2
            points = np.stack([along, half * np.cos(turn), half * np.sin(turn)], axis=-1)
            far = points @ axes[1]
            off = np.linalg.norm(points - far[..., None] * axes[1], axis=-1)
            found |= bool(((far > reach[1][0]) & (far < reach[1][1]) & (off < outer * pair[1] / 2 - 1e-9)).any())
        return found

    assert not meets(radius)
    assert angle > 60 or pair != (20, 20) or meets(radius - 1.0)


def test_a_structure_brings_marks_sections_forces_and_masses() -> None:
    truss = roof()
    made = st.schedule(truss, st.ScheduleSettings())
    grid, order = grid_of_structure(truss)
    assert list(made.members["member"]) == [truss.member_marks[k] for k in order.tolist()]
    assert list(made.nodes["node"]) == list(truss.node_marks)
    np.testing.assert_allclose(numbers(made.members, "length"), 1e3 * truss.lengths[order])
    np.testing.assert_allclose(grid.scan_nodes * truss.scale, truss.nodes + truss.origin)
    solution = st.solve(truss)
    judged = [solution[each.name] for each in truss.combinations if each.state == "ULS"]
    axial = np.stack([each.axial for each in judged])
    low, high = axial[:, :, 0].min(axis=0), axial[:, :, 1].max(axis=0)
    np.testing.assert_allclose(numbers(made.members, "force min"), low[order] / 1e3)
    np.testing.assert_allclose(numbers(made.members, "force max"), high[order] / 1e3)
    for case, force, member in zip(made.members["case of max"], high[order], order, strict=True):
        assert solution[str(case)].axial[member, 1] == force
    limit = [tension_resistance(int(str(bolt)[1:]), "10.9") for bolt in made.members["bolts"]]
    assert (np.maximum(numbers(made.members, "force max"), 0) * 1e3 <= limit).all()
    assert set(made.members["section"]) == {"CHS60.3x4"} and set(made.members["material"]) == {"S355"}
    cut = numbers(made.members, "cut length") / 1e3
    np.testing.assert_allclose(numbers(made.members, "mass"), cut * truss.sections[0].area * 7850)
    rows: dict[Any, list[Any]] = {(item, group): others for item, group, *others in made.quantities.rows}
    count, _, _, _, mass = rows["members", "CHS60.3x4"]
    assert count == len(order) and mass == pytest.approx(cut.sum() * truss.sections[0].area * 7850)
    assert sum(each[0] for (item, _), each in rows.items() if item == "bolts") == 2 * len(order)
    held = truss.supports.any(axis=1)
    assert [value is not None for value in made.nodes["reaction"]] == held.tolist()
    worst = max(float(np.linalg.norm(each.reactions[:, :3], axis=1).max()) for each in judged)
    assert np.nanmax(numbers(made.nodes, "reaction")) == pytest.approx(worst / 1e3)


def test_sections_of_several_widths_need_balls_that_clear_the_widest() -> None:
    truss = roof()
    slim = st.schedule(truss, st.ScheduleSettings(bolts="none"))
    both = st.Truss.from_grid(dome(6, 2.0, unit="m"), section="CHS114.3x5", supports="corners", loads=LOADS)
    wide = st.schedule(both, st.ScheduleSettings(bolts="none"))
    mixed = truss.replace(
        sections=(*truss.sections, *both.sections),
        section_of=np.arange(len(truss.members)) % 2,
        member_marks=truss.member_marks,
    )
    made = st.schedule(mixed, st.ScheduleSettings(bolts="none"))
    needed = [numbers(each.nodes, "ball needed") for each in (slim, made, wide)]
    assert (
        (needed[0] <= needed[1] + 1e-9).all()
        and (needed[1] <= needed[2] + 1e-9).all()
        and needed[1].max() > needed[0].max()
    )
    kinds = dict(zip(made.lengths["length type"], made.lengths["section"], strict=True))
    assert all(
        kinds[kind] == section
        for kind, section in zip(made.members["length type"], made.members["section"], strict=True)
    )
    assert {group for item, group, *_ in made.quantities.rows if item == "members"} == {"CHS60.3x4", "CHS114.3x5"}
    assert "bolts" not in [each.name for each in made.members.columns]


def test_nodes_with_other_bolts_are_other_types() -> None:
    truss = st.Truss.from_grid(fan(1000.0), section="CHS60.3x4", supports="boundary", loads="self")
    pull = np.zeros((7, 6))
    pull[1:, :3] = 60e3 * truss.nodes[1:] / np.linalg.norm(truss.nodes[1:], axis=1, keepdims=True)
    pull[1] *= 5
    held = np.zeros((7, 6))
    held[:, 2], held[0, :3] = math.inf, math.inf
    held[2, :2] = math.inf
    pulled = truss.replace(cases=(LoadCase("pull", nodal=pull),), combinations=(), supports=held)
    alike, other = (st.schedule(each, st.ScheduleSettings()) for each in (truss, pulled))
    assert len(alike.node_types) == 2
    assert len(set(other.members["bolts"])) > 1 and len(other.node_types) > 2


def test_what_a_structure_lacks_is_warned_of_with_its_place() -> None:
    truss = roof(section="CHS33.7x3.2", loads="self,snow:60kN/m2")
    made = st.schedule(truss, st.ScheduleSettings(bolts="4.6", slenderness=50.0))
    found: dict[Any, list[Any]] = {}
    for row in made.warnings.rows:
        found.setdefault(row[0], []).append(row[1:])
    slender = 1e-3 * numbers(made.members, "length") / truss.sections[0].radius
    np.testing.assert_allclose(numbers(made.members, "slenderness"), slender)
    assert len(found["slender member"]) == (slender > 50).sum() > 0
    used = numbers(made.members, "utilization")
    assert len(found["utilization above one"]) == (used > 1).sum() > 0 and all(
        row[5] is not None for row in found["slender member"]
    )
    assert len(found["bolts are chosen for tension and carry no moments"]) == 1
    (bolts,) = (line for line in schedule_warnings(made.warnings) if "no moments" in line)
    assert re.fullmatch(r"warning: bolts are chosen .* no moments; the greatest is [\d.]+ kNm at M\d+", bolts)
    strong = tension_resistance(64, "4.6") / 1e3
    assert len(found.get("no bolt carries the tension", [])) == (numbers(made.members, "force max") > strong).sum()


def test_balls_heavier_than_the_structure_allows_for_are_told_with_what_allows_for_them() -> None:
    truss = roof()
    made = st.schedule(truss, st.ScheduleSettings())
    share = math.fsum(numbers(made.nodes, "mass")) / truss.mass
    (said,) = (line for line in schedule_warnings(made.warnings) if "balls weigh" in line)
    assert f"weigh {100 * share:.0f} % of the members" in said and f"--node-allowance {share:.2f} takes" in said
    allowed = roof(node_allowance=share)
    assert not any(
        "balls weigh" in line for line in schedule_warnings(st.schedule(allowed, st.ScheduleSettings()).warnings)
    )


def test_no_allowance_for_balls_is_advised_that_a_structure_refuses() -> None:
    heavy = roof(section="CHS21.3x2.6", scale=0.02)
    made = st.schedule(heavy, st.ScheduleSettings())
    assert math.fsum(numbers(made.nodes, "mass")) > 2 * heavy.mass
    (said,) = (line for line in schedule_warnings(made.warnings) if "balls weigh" in line)
    assert "--node-allowance" not in said and "structure takes 200% at most" in said


def test_what_is_said_twice_is_refused() -> None:
    for values in ({"tube": 60.0}, {"scale": 2.0}, {"unit": "mm"}):
        with pytest.raises(st.InputError, match=f"a structure has a {next(iter(values))} of its own"):
            st.schedule(roof(), st.ScheduleSettings(**values))
    with pytest.raises(st.InputError, match="no load case"):
        st.schedule(roof().replace(cases=(), combinations=()), st.ScheduleSettings())
    with pytest.raises(st.InputError, match="--tube 114"):
        st.schedule(fan(1000.0), st.ScheduleSettings())


def test_members_on_no_panel_are_scheduled_too() -> None:
    truss = roof()
    whole = st.schedule(truss, st.ScheduleSettings())
    made = st.schedule(truss.replace(triangles=truss.triangles[:0]), st.ScheduleSettings())
    assert set(made.members["group"]) == {"frame"} and len(made.panels) == 0
    np.testing.assert_allclose(numbers(made.members, "cut length"), numbers(whole.members, "cut length"), rtol=1e-12)


def test_the_command_takes_a_structure_with_what_it_says_of_the_checks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(dome(5, 2.0, unit="m"), "grid.json")
    Path("s.toml").write_text('effective_length = 2.0\nsupports = "corners"\nloads = "self,snow:2kN/m2"\n')
    assert main(["structure", "grid.json", "roof.json", "--settings", "s.toml"]) == 0
    assert main(["schedule", "roof.json", "a.xlsx", "a.csv"]) == 0
    assert "25 nodes of" in capsys.readouterr().out
    truss, checked = read_checked("roof.json")
    assert checked is not None
    made = st.schedule(truss, st.ScheduleSettings(), checked=checked)
    assert checked[0].max() == max(numbers(made.members, "utilization"))
    assert checked[0].max() > 1.05 * max(numbers(st.schedule(truss, st.ScheduleSettings()).members, "utilization"))
    assert main("schedule roof.json b.csv --tube 60x4".split()) == 2
    assert "leave --tube out" in capsys.readouterr().err
    text = Path("roof.json").read_text()
    Path("roof.json").write_text(text.replace('"utilization": [\n', '"utilization": [\n1.0,\n', 1))
    assert main("schedule roof.json b.csv".split()) == 2
    said = capsys.readouterr().err
    assert "damaged structure" in said and said.count("\n") == 1 and not Path("b.csv").exists()
