"""Table 2 of the paper: its examples 1-4 after optimization, by the paper to the letter and by default."""

from __future__ import annotations

from dataclasses import dataclass

from shapes import make

import scantruss as st

from .measure import Measured, measure
from .page import Section

PAPER = {  # mean G, std G, std L / mean L
    "scallop": (0.962, 0.041, 0.120),
    "clam": (0.970, 0.035, 0.109),
    "limpet": (0.981, 0.028, 0.095),
    "cloth": (0.974, 0.038, 0.119),
}
NOTE = """\
Mean and standard deviation of G, std L / mean L, mean length in desired lengths, share of inner nodes with six members,
largest distance of the true boundary from that of the grid in members, mean distance of the nodes from the true surface in
standard deviations of the noise. The paper's shells are not public, so the clouds are similar ones."""


@dataclass(frozen=True)
class Example:
    """One grid of one example."""

    name: str
    method: str
    found: Measured

    def losses(self) -> list[str]:
        """Return in words where the figures are worse than the paper's."""
        mean, spread, variation = PAPER[self.name]
        pairs = [
            ("mean G", self.found.shape_mean, mean, self.found.shape_mean < mean),
            ("std G", self.found.shape_std, spread, self.found.shape_std > spread),
            ("std L / mean L", self.found.cv, variation, self.found.cv > variation),
        ]
        worse = [
            f"{self.name}, {self.method}: {what} {got:.3f}, the paper {theirs:.3f}."
            for what, got, theirs, bad in pairs
            if bad
        ]
        return worse if self.found.right else [*worse, f"{self.name}, {self.method}: wrong topology."]

    def row(self) -> str:
        f = self.found
        return (
            f"| {self.name} | {self.method} | {f.shape_mean:.3f} | {f.shape_std:.3f} | {f.cv:.3f} | {f.length:.3f} |"
            f" {f.valence6:.2f} | {f.boundary:.2f} | {f.distance:.2f} | {f.nodes} |"
        )


def examples() -> list[Example]:
    """Return the four examples by both methods."""
    found = []
    for name in PAPER:
        shape = make(name)
        for method in ("paper", "default"):
            grid = st.grid_from_points(shape.points, st.Settings(length=shape.length, method=method))
            found.append(Example(name, method, measure(shape, grid, shape.length)))
    return found


def table(rows: list[Example]) -> str:
    """Return the table, the paper's own figures beside ours."""
    head = "| example | by | mean G | std G | CV | length | six | boundary | distance | nodes |"
    lines = [head, "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"]
    for name, (mean, spread, variation) in PAPER.items():
        lines.append(f"| {name} | the paper, its own shell | {mean} | {spread} | {variation} | | | | | |")
        lines += [row.row() for row in rows if row.name == name]
    return "\n".join(lines)


def section(command: str) -> Section:
    """Return the section of docs/numbers.md."""
    rows = examples()
    best = sum(row.found.shape_mean for row in rows if row.method == "default") / len(PAPER)
    theirs = sum(mean for mean, _, _ in PAPER.values()) / len(PAPER)
    finding = f"By default mean G is **{best:.3f}**, the paper reports {theirs:.3f} (means of the four examples)."
    lost = tuple(loss for row in rows for loss in row.losses())
    return Section("Table 2: the examples of the paper", command, finding, NOTE + "\n\n" + table(rows), lost)
