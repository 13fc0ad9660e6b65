"""Sizing: all members pass with few sections, and no group is heavier than it must be."""

import itertools
from typing import Any

import numpy as np
import pytest
from small_grids import dome

import scantruss as st
from scantruss.grid.line_sets import FIXED_LINE, LineSet
from scantruss.structure.checks import MemberChecks
from scantruss.structure.groups import member_groups_of
from scantruss.structure.modes import worst_buckling
from scantruss.structure.report import report_structure
from scantruss.structure.sizing import SizingRound, _few, candidates, size_members, weight_curve
from scantruss.structure.statics import factor_stiffness
from scantruss.structure.truss import Truss

LOADS = "self,cladding:0.5kN/m2,snow:1kN/m2"


def shell(**others: Any) -> Truss:
    usual: dict[str, Any] = {"loads": LOADS, "supports": "corners"}
    return Truss.from_grid(dome(8, 40.0), scale=75, **(usual | others))


@pytest.mark.parametrize("count", [1, 2, 4])
def test_all_members_pass_with_few_sections(count: int) -> None:
    sized = size_members(shell(), count)
    report = report_structure(st.solve(sized)).to_dict()
    assert report["utilization_max"] <= 1 and 1 <= len(report["sections"]) <= count
    assert all(number > 0 for number in report["sections"].values())
    factored = factor_stiffness(sized)
    assert worst_buckling(factored, st.solve(sized, factored), 1).values[0] >= 10


def test_more_sections_are_lighter() -> None:
    members_only = MemberChecks(buckling_factor=1e-3)
    masses = [size_members(shell(), count, members_only).mass for count in (1, 2, 4)]
    assert masses[0] > masses[1] > masses[2]


def test_one_section_lighter_would_not_do() -> None:
    truss = size_members(shell(), 1)
    chain = candidates(shell())
    lighter = chain[[section.name for section in chain].index(truss.sections[0].name) - 1]
    weaker = truss.replace(sections=(lighter,))
    factored = factor_stiffness(weaker)
    solution = st.solve(weaker, factored)
    used = report_structure(solution).to_dict()["utilization_max"]
    assert used > 1 or worst_buckling(factored, solution, 1).values[0] < 10


def test_candidates_resist_more_the_heavier_they_are() -> None:
    for name in ("CHS114.3x5", "CFCHS114.3x5", "SHS100x5", "HEA200"):
        chain = candidates(shell(section=name))
        for light, heavy in itertools.pairwise(chain):
            assert light.area < heavy.area and light.inertia_y < heavy.inertia_y and light.plastic_y < heavy.plastic_y
        assert len(chain) > 5


@pytest.mark.parametrize("seed", range(5))
def test_few_sections_have_the_least_volume(seed: int) -> None:
    """The same by trying all."""
    rng = np.random.default_rng(seed)
    chosen, lengths, areas = rng.integers(0, 6, 30), rng.uniform(1, 3, 30), np.cumsum(rng.uniform(0.1, 1, 6))
    made = _few(chosen, lengths, areas, 3)
    assert (made >= chosen).all() and len(np.unique(made)) <= 3
    ways = itertools.combinations(range(6), 3)
    volumes = []
    for way in ways:
        if max(way) >= chosen.max():
            up = np.array(way)[np.searchsorted(way, chosen)]
            volumes.append((lengths * areas[up]).sum())
    assert (lengths * areas[made]).sum() == pytest.approx(min(volumes))


@pytest.mark.parametrize("by", ["groups", "rings"])
def test_the_members_of_a_group_have_one_section(by: str) -> None:
    sized = size_members(shell(), 4, by=by)
    names, group_of = member_groups_of(sized, by)
    for number in range(len(names)):
        assert len(np.unique(sized.section_of[group_of == number])) == 1
    report = report_structure(st.solve(sized)).to_dict()
    assert report["utilization_max"] <= 1 and sized.mass >= size_members(shell(), 4).mass * 0.999


def test_groups_are_boundary_lines_and_the_rest_of_each_piece() -> None:
    grid = dome(8, 40.0)
    names, group_of = member_groups_of(Truss.from_grid(grid, supports="boundary", scale=50))
    assert names == ("boundary", "inner") and (group_of == 0).sum() == (grid.edge_triangles[:, 1] < 0).sum()
    names, ring = member_groups_of(Truss.from_grid(grid, supports="boundary", scale=50), "rings")
    assert names[:2] == ("ring 0", "ring 1") and set(ring[group_of == 0]) == {0}
    line = grid.replace(line_sets=(LineSet("rib", FIXED_LINE, np.arange(27, 30)),))
    names, group_of = member_groups_of(Truss.from_grid(line, supports="boundary", scale=50))
    assert names == ("boundary", "inner", "line:rib") and (group_of == 2).sum() == 2
    count = len(grid.nodes)
    two = grid.replace(
        nodes=np.concatenate([grid.nodes, grid.nodes + [500, 0, 0]]),
        triangles=np.concatenate([grid.triangles, grid.triangles + count]),
        fixed=np.tile(grid.fixed, 2),
    )
    names, _ = member_groups_of(Truss.from_grid(two, supports="boundary", scale=50))
    assert names == ("piece 1 boundary", "piece 1 inner", "piece 2 boundary", "piece 2 inner")
    with pytest.raises(st.InputError, match="grouped by groups or rings"):
        member_groups_of(shell(), "colour")


def test_what_cannot_be_sized_is_refused() -> None:
    with pytest.raises(st.InputError, match="GL24h is timber"):
        size_members(shell(material="GL24h", section="R50x100"), 2)
    with pytest.raises(st.InputError, match="no sections like R50x100"):
        size_members(shell(section="R50x100"), 2)
    with pytest.raises(st.InputError, match=r"no section up to CHS\S+ is enough at M\d+"):
        size_members(shell(loads="snow:1000kN/m2"), 2)
    with pytest.raises(st.InputError, match=r"up to IPE270 .* \(IPE300 and others of class 4 in S355 are left out\)"):
        size_members(shell(section="IPE200", loads="snow:1000kN/m2"), 2)


@pytest.mark.parametrize("factor", [8.0, 10.0, 20.0])
def test_more_sections_are_never_heavier(factor: float) -> None:
    checks = MemberChecks(buckling_factor=factor)
    rounds: list[SizingRound] = []
    truss = shell(loads="self,wind:5kN/m2:-1,half-snow:2kN/m2")
    sized = [size_members(truss, count, checks, rounds if count == 3 else None) for count in (1, 2, 3)]
    masses = [each.mass for each in sized]
    assert masses[0] >= masses[1] >= masses[2]
    assert rounds[-1].mass == pytest.approx(masses[2]) and len(sized[2].sections) <= 3
    assert list(weight_curve(truss, sized[2], 3, checks).values()) == pytest.approx(masses)
