"""Work out every proof of docs/verification.md and write its table: python scripts/make_verification.py.

Each proof is a figure of a textbook, a standard or another solver, and what ScanTruss finds for it.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from small_grids import dome  # noqa: E402
from small_trusses import (  # noqa: E402
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
from test_nonlinear import elastica, perfect, toggle, williams  # noqa: E402

from scantruss.structure.catalogue import find_material, find_section  # noqa: E402
from scantruss.structure.checks import CLAUSES_CHECKED, strengths, utilizations  # noqa: E402
from scantruss.structure.modes import buckling_modes, vibration_modes  # noqa: E402
from scantruss.structure.statics import factor_stiffness, solve  # noqa: E402
from scantruss.structure.truss import LoadCase, Truss  # noqa: E402

PLACE = ROOT / "docs" / "verification.md"
HEAD = "| what | reference | theirs | ours | off by |\n| --- | --- | --- | --- | --- |\n"
START, END = "<!-- table -->\n", "<!-- end of table -->"
TIMOSHENKO = "Timoshenko and Gere, Theory of Elastic Stability, 2.1"
GERE = "Gere and Goodno, Mechanics of Materials, table H-1"
SHELL = "cladding:0.5kN/m2,wind:0.8kN/m2:0.8/-0.5@30"


class Proof(NamedTuple):
    """A figure that is known, and what we find."""

    what: str
    unit: str
    reference: str
    theirs: float
    ours: float
    within: float = 5e-5  #: greatest difference over theirs

    @property
    def off(self) -> float:
        """Difference over theirs."""
        return abs(self.ours - self.theirs) / abs(self.theirs)


def proofs() -> list[Proof]:
    """Return all proofs, in their order in the docs."""
    return [*_statics(), *_space_truss(), *_stability(), *_paths(), *_sections(), *_checks(), *_shells()]


def _statics() -> Iterator[Proof]:
    """Yield beams, frames and bars."""
    nodes, members = line_of(3.0, 4)
    spread = LoadCase("line", line=np.tile([0, 0, -1000.0], (4, 1)))
    tip, line = solve(make_truss(nodes, members, {0: HELD}, forces(5, {4: (0, 0, -1000.0)}), spread)).cases
    yield Proof(
        "cantilever 3 m, 1 kN at its tip: deflection",
        "mm",
        f"{GERE}: P L3 / 3 E I",
        1e6 * 27 / (3 * EI),
        -1e3 * tip.displacements[4, 2],
    )
    yield Proof(
        "the same, 1 kN/m: deflection",
        "mm",
        f"{GERE}: q L4 / 8 E I",
        1e6 * 81 / (8 * EI),
        -1e3 * line.displacements[4, 2],
    )
    height, span, force = 4.0, 6.0, 1000.0
    frame = make_truss(
        [(0, 0, 0), (0, 0, height), (span, 0, height), (span, 0, 0)], [(0, 1), (1, 2), (3, 2)], {0: HELD, 3: HELD},
        forces(4, {1: (force, 0, 0)}), sections=(stiff_along(),),
    )  # fmt: skip
    result, k = solve(frame)["load"], height / span
    source = "Kleinlogel, Rahmenformeln, frame 41"
    yield Proof(
        "portal 4 x 6 m, 1 kN at its corner: moment at a foot",
        "Nm",
        source,
        force * height / 2 * (3 * k + 1) / (6 * k + 1),
        abs(result.reactions[0, 4]),
    )
    yield Proof(
        "the same: moment at a corner",
        "Nm",
        source,
        force * height / 2 * 3 * k / (6 * k + 1),
        abs(result.along[1, 0, 4]),
    )
    angle, leg = np.radians([10, 130, 250]), math.hypot(2, 3)
    feet = np.stack([2 * np.cos(angle), 2 * np.sin(angle), 0 * angle], axis=1)
    tripod = make_truss([*feet, (0, 0, 3.0)], [(0, 3), (1, 3), (2, 3)], dict.fromkeys(range(3), HINGED),
                        forces(4, {3: (0, 0, -9000.0)}), pinned=True)  # fmt: skip
    result = solve(tripod)["load"]
    yield Proof(
        "tripod 3 m high, 9 kN: force in a leg", "N", "polygon of forces", -3000 * leg / 3, float(result.axial[0, 0])
    )
    yield Proof(
        "the same: the apex sinks",
        "mm",
        "P L / 3 E A cos2",
        9e6 * leg / (3 * EA * (3 / leg) ** 2),
        -1e3 * result.displacements[3, 2],
    )
    spring = 1e5
    beam = make_truss([(0, 0, 0), (4.0, 0, 0)], [(0, 1)], {0: HELD, 1: HELD}, LoadCase("line", line=np.array([[0, 0, -2000.0]])),
                      end_stiffness=np.full((1, 2, 2), spring))  # fmt: skip
    end = 2000 * 16 / 12 / (1 + 2 * EI / (spring * 4))
    yield Proof(
        "beam 4 m on springs of 100 kNm/rad, 2 kN/m: end moment",
        "Nm",
        "slope-deflection, Monforton and Wu 1963",
        end,
        abs(solve(beam)["line"].along[0, 0, 4]),
    )
    settled = LoadCase("settled", settlement=np.array([[np.nan] * 3, [np.nan, np.nan, -0.01]]))
    warm = LoadCase("warm", temperature=np.array([30.0]))
    settled_, warm_ = solve(make_truss([(0, 0, 0), (4.0, 0, 0)], [(0, 1)], {0: HELD, 1: HELD}, settled, warm)).cases
    yield Proof(
        "fixed beam 4 m, an end settles 10 mm: end moment",
        "Nm",
        "slope-deflection: 6 E I d / L2",
        6 * EI * 0.01 / 16,
        abs(settled_.reactions[0, 4]),
    )
    yield Proof(
        "fixed bar, 30 K warmer: force",
        "kN",
        "Hooke: E A alpha T",
        -EA * 12e-6 * 30 / 1e3,
        float(warm_.axial[0, 0]) / 1e3,
    )


def _space_truss() -> Iterator[Proof]:
    """Yield the star dome."""
    sinks = -float(solve(star_dome()).cases[0].displacements[0, 2])
    reference = "Levy and Spillers, Analysis of Geometrically Nonlinear Structures, 2.4.2"
    yield Proof("star dome of 24 bars, 220.46 lb on its crown, linear: crown sinks", "in", reference, 0.20641184, sinks)


def _stability() -> Iterator[Proof]:
    """Yield columns and a beam that swings."""
    count, length = 16, 4.0
    nodes = np.linspace(0, 1, count + 1)[:, None] * np.array([0, 0, length])
    members = np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)
    top = (np.inf, np.inf, 0.0, 0.0, 0.0, np.inf)
    ends = {
        "fixed at its foot": (2.0, HELD, FREE),
        "hinged at both ends": (1.0, (*HINGED[:5], np.inf), top),
        "fixed and hinged": (0.699157, HELD, top),
        "fixed at both ends": (0.5, HELD, (np.inf, np.inf, 0.0, np.inf, np.inf, np.inf)),
    }
    for name, (share, foot, head) in ends.items():
        truss = make_truss(nodes, members, {0: foot, count: head}, forces(count + 1, {count: (0, 0, -1000.0)}))
        factored = factor_stiffness(truss)
        ours = buckling_modes(factored, solve(truss, factored)["load"], 1).values[0]
        yield Proof(
            f"column 4 m {name}: critical load",
            "kN",
            TIMOSHENKO,
            math.pi**2 * EI / (share * length) ** 2 / 1e3,
            float(ours),
        )
    held = (np.inf, np.inf, np.inf, np.inf, 0.0, 0.0)
    beam = make_truss(
        nodes[:, [2, 0, 1]] * 1.5, members, {0: held, count: held}, LoadCase("self", "permanent", self_weight=1.0)
    )
    first = math.pi / (2 * 36) * math.sqrt(EI / (TUBE.area * STEEL.density))
    yield Proof(
        "beam 6 m on two supports: frequency",
        "Hz",
        "Chopra, Dynamics of Structures, 16.3",
        first,
        float(vibration_modes(factor_stiffness(beam), 1).values[0]),
    )


def _paths() -> Iterator[Proof]:
    """Yield limits and large displacements of nonlinear paths."""
    high, half = 0.5, 10.0
    length = math.hypot(half, high)
    rise = math.sqrt(
        (length * half**2) ** (2 / 3) - half**2
    )  # at the limit: the moved bar is the cube root of L half2 long
    now = math.hypot(half, rise)
    limit = 2 * EA * (length - now) / length * rise / now / 1e3
    path = perfect(toggle(high, half, pinned=True), stop_factor=40.0)
    reference = "von Mises truss: 2 E A (L - l) / L h / l, greatest where l3 = L b2"
    yield Proof("two pinned bars 10 x 0.5 m: limit", "kN", reference, limit, path.limit_factor or 0.0, 1e-5)
    path = perfect(williams(), stop_factor=1.2)
    yield Proof(
        "toggle of two fixed members: limit", "lb", "Williams 1964", 34.0, 34.0 * (path.limit_factor or 0.0), 5e-3
    )
    load, down, away = elastica(1.0)
    nodes, members = (
        np.linspace(0, 5.0, 17)[:, None] * [1.0, 0.0, 0.0],
        np.stack([np.arange(16), np.arange(1, 17)], axis=1),
    )
    tip = forces(17, {16: (0, 0, -load * EI / 25.0)})
    path = perfect(make_truss(nodes, members, {0: HELD}, tip, sections=(stiff_along(factor=1e3),)), stop_factor=1.0)
    reference = "elastica, Bisshopp and Drucker 1945"
    moved = path.displacements[-1, 16]
    yield Proof(
        "cantilever 5 m, force that turns its tip by 1 rad: tip sinks", "m", reference, 5 * down, -moved[2], 1e-3
    )
    yield Proof("the same: tip lies out", "m", reference, 5 * away, 5 + moved[0], 1e-3)
    moved = perfect(bend(), stop_factor=1.0).displacements[-1, -1]
    reference = "Bathe and Bolourchi 1979"
    what = "bend of 45 degrees, radius 100 in, 600 lb across its plane: tip moves"
    for way, theirs, within in (("along", -23.5, 4e-3), ("back", 13.4, 2e-2), ("across", 53.4, 2e-3)):
        ours = float(moved[("along", "back", "across").index(way)])
        yield Proof(f"{what} {way}", "in", reference, theirs, ours, within)


def bend() -> Truss:
    """Return the eighth of a ring of a square bar, 1 in wide, held at one end and loaded across its plane at the other."""
    count = 16
    turn = np.linspace(0.0, math.pi / 4, count + 1)
    nodes = 100.0 * np.stack([np.sin(turn), np.cos(turn) - 1.0, np.zeros(count + 1)], axis=1)
    members = np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)
    bar = replace(TUBE, area=1.0, inertia_y=1 / 12, inertia_z=1 / 12, torsion=1 / 6)
    soft = replace(STEEL, young=1e7, shear=5e6)
    tip = forces(count + 1, {count: (0, 0, 600.0)})
    return make_truss(nodes, members, {0: HELD}, tip, sections=(bar,), material=soft)


def star_dome() -> Truss:
    """Return the star dome of 24 bars with a load on its crown [in, lb]."""
    turn = np.radians(60.0 * np.arange(6))
    inner = np.stack([9.8425 * np.cos(turn), 9.8425 * np.sin(turn), np.full(6, 2.4472)], axis=1)
    outer = np.stack([19.685 * np.cos(turn + np.pi / 6), 19.685 * np.sin(turn + np.pi / 6), np.zeros(6)], axis=1)
    around, next_one = np.arange(1, 7), np.roll(np.arange(1, 7), -1)
    pairs = [(np.zeros(6, np.int64), around), (around, next_one), (around, around + 6), (next_one, around + 6)]
    members = np.concatenate([np.stack(pair, axis=1) for pair in pairs])
    nodes = np.concatenate([[[0.0, 0.0, 3.2346]], inner, outer])
    bar, steel = replace(TUBE, area=0.0155), replace(STEEL, young=3e7)
    feet = {node: HINGED for node in range(7, 13)}
    crown = forces(13, {0: (0, 0, -220.46)})
    return make_truss(nodes, members, feet, crown, sections=(bar,), material=steel, pinned=True)


def _sections() -> Iterator[Proof]:
    """Yield properties of sections, as the standards print them."""
    printed = {
        "CHS114.3x5": ("EN 10210-2", 17.2, 257.0),
        "CHS219.1x10": ("EN 10210-2", 65.7, 3598.0),
        "SHS100x5": ("EN 10210-2", 18.7, 279.0),
        "IPE300": ("tables of EN 10365", 53.8, 8356.0),
        "HEA200": ("tables of EN 10365", 53.8, 3692.0),
        "HEB300": ("tables of EN 10365", 149.1, 25170.0),
    }
    for name, (source, area, inertia) in printed.items():
        section = find_section(name)
        yield Proof(f"{name}: area", "cm2", source, area, section.area * 1e4, 4e-3)
        yield Proof(f"{name}: second moment", "cm4", source, inertia, section.inertia_y * 1e8, 3e-3)


def _checks() -> Iterator[Proof]:
    """Yield checks of members, worked out by hand."""
    truss = make_truss([(0, 0, 0), (0, 0, 3.0)], [(0, 1)], {0: HELD, 1: (np.inf, np.inf, 0.0, np.inf, np.inf, np.inf)},
                       forces(2, {1: (0, 0, -200e3)}))  # fmt: skip
    strength = strengths(truss)
    by_hand = "EN 1993-1-1 6.3.1, by hand"
    yield Proof("CHS114.3x5 S355, 3 m: relative slenderness", "", by_hand, 1.015, float(strength.relative[0, 0]), 1e-3)
    yield Proof("the same: N,b,Rd", "kN", by_hand, 399.4, float(strength.buckling[0]) / 1e3, 2e-3)
    result = solve(make_truss(*line_of(2.0, 1), {0: HELD}, forces(2, {1: (0, 0, -5e3)})))["load"]
    used = dict(zip(CLAUSES_CHECKED, utilizations(strengths(result.truss), result)[0], strict=True))
    yield Proof(
        "cantilever 2 m, 5 kN: use in bending",
        "",
        "EN 1993-1-1 6.2.5, by hand",
        10 / 21.22,
        float(used["6.2.1(7) bending and axial force"]),
        1e-3,
    )
    beam = make_truss([(0, 0, 0), (3.0, 0, 0)], [(0, 1)], {0: HELD, 1: HELD}, forces(2, {}), sections=(find_section("IPE300"),),
                      material=find_material("S235"))  # fmt: skip
    yield Proof(
        "IPE300 S235, 3 m: chi LT", "", "EN 1993-1-1 6.3.2.2, by hand", 0.814, float(strengths(beam).lateral[0]), 2e-3
    )


def _shells() -> Iterator[Proof]:
    """Yield shells in an independent solver, where it is installed."""
    if find_spec("Pynite") is None:
        return
    for supports in ("boundary", "corners"):
        truss = Truss.from_grid(dome(6, 40.0), scale=50, supports=supports, support_type="fixed", loads=SHELL)
        solution = solve(truss)
        model = pynite_model(truss, solution.cases)
        model.analyze_linear()
        for case in solution.cases:
            moves = [
                [getattr(model.nodes[mark], way)[case.name] for way in ("DX", "DY", "DZ")] for mark in truss.node_marks
            ]
            axial = np.array([-model.members[mark].axial(0, case.name) for mark in truss.member_marks])
            what = f"shell of {len(truss.members)} members, {supports} supported, {case.name}"
            yield Proof(
                f"{what}: greatest displacement",
                "mm",
                "PyNite",
                1e3 * float(np.linalg.norm(moves, axis=1).max()),
                1e3 * case.displacement_max,
                1e-3,
            )
            yield Proof(
                f"{what}: greatest compression",
                "kN",
                "PyNite",
                float(axial.min()) / 1e3,
                float(case.along[:, 0, 0].min()) / 1e3,
                1e-3,
            )


def row_of(proof: Proof) -> str:
    """Return the row of a proof."""
    off = "< 1e-6" if proof.off < 1e-6 else f"{proof.off:.0e}"
    what = f"{proof.what} [{proof.unit}]" if proof.unit else proof.what
    return f"| {what} | {proof.reference} | {proof.theirs:.5g} | {proof.ours:.5g} | {off} |\n"


def main() -> None:
    """Write the table into the page."""
    text = PLACE.read_text(encoding="utf-8")
    before, _, rest = text.partition(START)
    after = rest.partition(END)[2]
    rows = "".join(map(row_of, proofs()))
    PLACE.write_text(f"{before}{START}{HEAD}{rows}{END}{after}", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
