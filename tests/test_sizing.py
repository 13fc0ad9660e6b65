"""Sizing: all members pass with few sections, and no group is heavier than it must be."""

import itertools
from typing import Any

import numpy as np
import pytest
from small_grids import dome

import scantruss as st
from scantruss.structure.checks import MemberChecks
from scantruss.structure.modes import worst_buckling
from scantruss.structure.report import report_structure
from scantruss.structure.sizing import _few, candidates, size_members
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


def test_what_cannot_be_sized_is_refused() -> None:
    with pytest.raises(st.InputError, match="GL24h is timber"):
        size_members(shell(material="GL24h", section="R50x100"), 2)
    with pytest.raises(st.InputError, match="no sections like R50x100"):
        size_members(shell(section="R50x100"), 2)
    with pytest.raises(st.InputError, match=r"no section up to CHS\S+ is enough at M\d+"):
        size_members(shell(loads="snow:1000kN/m2"), 2)
