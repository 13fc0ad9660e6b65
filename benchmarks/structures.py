"""Speed of structures as ratios of one run: against PyNite, of many load cases, modes and paths against one solution, and its growth."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from small_grids import dome
from small_trusses import pynite_model

import scantruss as st
from scantruss.structure.checks import span_of
from scantruss.structure.modes import buckling_modes
from scantruss.structure.nonlinear import solve_path
from scantruss.structure.statics import factor_stiffness
from scantruss.structure.truss import Truss

from .page import Section
from .ratios import Ratio, table

SIDE = 71  #: nodes along a side: 5,041 nodes, 14,840 members
SIDES = (32, 45, 71, 100, 141)  #: 1,024 to 19,881 nodes
GROWTH_AIM = 1.3  #: exponent of time over nodes
LONG_PATH = 30
NOTE = """\
A shallow dome of tubes over a square, its boundary supported, half the snow in one direction a case. Seconds of the processor, all threads,
of the analysis alone: the models stand ready. Medians, the smallest of two for PyNite, the path and the growth, in turn in one process.
The exponent of the growth is that of least squares over logarithms."""


@dataclass(frozen=True)
class GrowthOfStructures:
    """Seconds of one load case, and of four buckling modes, over the number of nodes."""

    nodes: tuple[int, ...]
    one_case: tuple[float, ...]  #: [s]
    four_modes: tuple[float, ...]  #: [s]
    command: tuple[float, ...]  #: `scantruss structure` with its start, from file to file [s]

    def exponent(self, times: tuple[float, ...]) -> float:
        return float(np.polyfit(np.log(self.nodes), np.log(times), 1)[0])

    def rows(self) -> list[str]:
        columns = zip(self.nodes, self.one_case, self.four_modes, self.command, strict=True)
        shown = [f"| {n:,} | {a:.3f} | {b:.3f} | {c:.2f} |" for n, a, b, c in columns]
        last = f"| exponent | {self.exponent(self.one_case):.2f} | {self.exponent(self.four_modes):.2f} | |"
        head = "| nodes | one load case [s] | four buckling modes [s] | `scantruss structure`, two load cases [s] |"
        return [head, "| ---: | ---: | ---: | ---: |", *shown, last]


def shell(side: int, cases: int = 1) -> Truss:
    """Return a dome with so many nodes along a side and load cases."""
    loads = ",".join(f"half-snow:1kN/m2@{36 * k}" for k in range(cases))
    grid = dome(side, 2.0, unit="m")
    return Truss.from_grid(
        grid, section="CHS114.3x5", material="S355", supports="boundary", support_type="fixed", loads=loads
    )


def processor(work: Callable[[], Any]) -> float:
    """Return the seconds of the processor that a call takes."""
    began = process_time()
    work()
    return process_time() - began


def least(work: Callable[[], Any], rounds: int = 2) -> float:
    """Return the fewest seconds of the processor of some calls."""
    return min(processor(work) for _ in range(rounds))


def command_on(side: int) -> float:
    """Return the seconds of the processor that `scantruss structure` takes on a dome; Linux."""
    with tempfile.TemporaryDirectory() as folder:
        st.write(dome(side, 2.0, unit="m"), Path(folder) / "grid.json")
        words = [
            "structure",
            f"{folder}/grid.json",
            f"{folder}/out.json",
            "--supports",
            "boundary",
            "--loads",
            "self,snow:1kN/m2",
        ]
        process = subprocess.Popen([sys.executable, "-m", "scantruss", *words], stdout=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError("scantruss structure failed")
    return used.ru_utime + used.ru_stime


def growth(sides: tuple[int, ...]) -> GrowthOfStructures:
    """Return the times of structures of several sizes."""
    nodes, one, modes, command = [], [], [], []
    for side in sides:
        truss = shell(side)
        factored, solution = factor_stiffness(truss), st.solve(truss)
        nodes.append(len(truss.nodes))
        one.append(least(lambda: st.solve(truss)))  # noqa: B023
        modes.append(least(lambda: buckling_modes(factored, solution.cases[0], 4)))  # noqa: B023
        command.append(command_on(side))
    return GrowthOfStructures(tuple(nodes), tuple(one), tuple(modes), tuple(command))


def section(command_line: str, quick: bool = False) -> Section:
    """Return the section; quick: a dome of 961 nodes, and no growth."""
    side, rounds = (31, 3) if quick else (SIDE, 5)
    one, ten = shell(side), shell(side, 10)
    factored, solution = factor_stiffness(one), st.solve(one)  # compiles, or loads what was compiled
    turns = [
        (processor(lambda: st.solve(one)), processor(lambda: st.solve(ten)),
         processor(lambda: buckling_modes(factored, solution.cases[0], 4)))
        for _ in range(rounds)
    ]  # fmt: skip
    single, many, modes = (float(np.median(times)) for times in zip(*turns, strict=True))
    modes_of_it = buckling_modes(factored, solution.cases[0], 1)
    bent = modes_of_it.shapes[0] * span_of(one) / 300
    path = least(lambda: solve_path(one, buckling=modes_of_it, imperfection=bent, steps=LONG_PATH, beyond=LONG_PATH), 1)
    both = least(lambda: solve_path(one, buckling=modes_of_it, steps=LONG_PATH, beyond=LONG_PATH), 1)
    other = pynite_model(one, solution.cases)
    theirs = least(lambda: other.analyze_linear(check_stability=False))
    rows = [
        Ratio("one load case / PyNite, sparse solver", single, theirs, 0.06),
        Ratio("ten load cases / one", many, single, 2.0),
        Ratio("four buckling modes / one load case", modes, single, 8.0),
        Ratio(f"nonlinear path of {LONG_PATH} steps / one load case", path, single, 60.0),
        Ratio("the same with both signs of the mode, two paths up to the limit / one load case", both, single, 120.0),
    ]
    lost = [f"{row.what}: {row.ratio:.2f}, the aim is at most {row.aim:g}." for row in rows if row.lost]
    parts = [NOTE, f"{len(one.nodes):,} nodes, {len(one.members):,} members:", table(rows)]
    if not quick:
        grown = growth(SIDES)
        parts.append("\n".join(grown.rows()))
        for what, times in (("one load case", grown.one_case), ("four buckling modes", grown.four_modes)):
            if grown.exponent(times) > GROWTH_AIM:
                lost.append(
                    f"Growth of {what}: exponent {grown.exponent(times):.2f}, the aim is at most {GROWTH_AIM:g}."
                )
    ours, cases = rows[0].ratio, rows[1].ratio
    finding = f"One load case takes **{ours:.3f}** of the time of PyNite, ten of them **{cases:.2f}** of one."
    return Section("Structures", command_line, finding, "\n\n".join(parts), tuple(lost), ("PyNiteFEA",))
