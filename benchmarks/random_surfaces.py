"""Random surfaces through the whole chain: `python -m benchmarks.random_surfaces --seeds 1000` on all processors.

Each seed is a cloud with known topology: smooth (`tests/random_surfaces.py`), or with edges (`tests/edged_surfaces.py`).
Right: a grid of that topology that passes its certificate. Wrong: a grid that passes, of another topology. Refused: an error
in words, by its first fault.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np
from edged_surfaces import FAMILIES, edged_surface, family_of
from random_surfaces import RandomSurface, random_surface

import scantruss as st

from .measure import Measured, measure
from .page import Section


@dataclass(frozen=True)
class Outcome:
    """What became of one seed."""

    seed: int
    result: str  #: right wrong refused
    fault: str  #: of a refused one: the kinds of its faults, or the class of the error
    words: str
    found: Measured | None  #: of a grid that came out
    extra: int = 0  #: irregular nodes beyond those that are forced
    name: str = ""
    seconds: float = 0.0

    def line(self) -> str:
        """Return all in one line."""
        figures = self.found.line() if self.found else ""
        return f"{self.name} {self.seconds:.1f} s {self.result} {self.fault} {self.words} {figures}".rstrip()


def judge(surface: RandomSurface, seed: int, settings: st.Settings) -> Outcome:
    """Return what becomes of a surface with some settings."""
    try:
        grid = st.grid_from_points(surface.points, settings)
    except st.CertificateError as error:
        assert error.grid.certificate is not None
        kinds = " ".join(fault.kind for fault in error.grid.certificate.faults)
        return Outcome(seed, "refused", kinds, f"{error} {error.where}", None)
    except st.ScanTrussError as error:
        return Outcome(seed, "refused", type(error).__name__, str(error), None)
    found, certificate = measure(surface, grid, settings.length), grid.certificate  # type: ignore[arg-type]
    assert certificate is not None
    extra = certificate.irregular - certificate.irregular_forced
    return Outcome(seed, "right" if found.right else "wrong", "", "", found, extra)


KINDS = {"smooth": random_surface, "edged": edged_surface}


def try_seed(seed: int, method: str = "default", effort: str = "normal", kind: str = "smooth") -> Outcome:
    """Return what becomes of a seed."""
    surface = KINDS[kind](seed)
    started = perf_counter()
    outcome = judge(surface, seed, st.Settings(length=surface.length, method=method, effort=effort))
    return replace(outcome, name=surface.name, seconds=perf_counter() - started)


def try_seeds(
    seeds: Iterable[int], method: str, effort: str, kind: str = "smooth", processes: int | None = None
) -> Iterator[Outcome]:
    """Yield what becomes of the seeds in their order, on all processors or as many as are named."""
    work = partial(try_seed, method=method, effort=effort, kind=kind)
    if processes == 1:
        yield from map(work, seeds)
        return
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(work, seeds, chunksize=4)


HEADER = (
    "| by | seeds | right | wrong | refused | mean G: mean, least | min G: least | CV: mean, most | angles | six |"
    " length | distance | boundary |\n" + "| --- |" + " ---: |" * 12
)
NOTE = """\
Smooth random heights over random areas with concave boundaries, 0 to 4 holes, necks and gaps of three members or more,
20 to 120 points a member squared and up to four times denser at one end, noise up to a tenth of a member, any pose and unit.
Right: the topology of the surface, and the certificate passed. Length: mean length in desired lengths, least and most.
Distance: mean distance of the nodes from the true surface in standard deviations of the noise, mean and largest of all seeds with
noise. Boundary: largest distance of the true boundary from that of the grid, in members."""


def row(name: str, outcomes: list[Outcome]) -> str:
    """Return the row of a table."""
    count = Counter(outcome.result for outcome in outcomes)
    found = [outcome.found for outcome in outcomes if outcome.found]
    start = f"| {name} | {len(outcomes)} | {count['right']} | {count['wrong']} | {count['refused']} |"
    if not found:
        return start + " |" * 8
    shape, cv, length, boundary = (
        np.array([getattr(f, key) for f in found]) for key in ("shape_mean", "cv", "length", "boundary")
    )
    noisy = np.array([f.distance for f in found if f.distance_in == "noise"] or [np.nan])
    return (
        f"{start} {shape.mean():.4f}, {shape.min():.4f} | {min(f.shape_min for f in found):.2f} |"
        f" {cv.mean():.4f}, {cv.max():.4f} | {min(f.angle_min for f in found):.0f}-{max(f.angle_max for f in found):.0f} |"
        f" {np.mean([f.valence6 for f in found]):.2f} | {length.min():.3f}-{length.max():.3f} |"
        f" {noisy.mean():.2f}, {noisy.max():.2f} | {boundary.mean():.2f}, {boundary.max():.2f} |"
    )


def failures(outcomes: list[Outcome]) -> str:
    """Return all that is not right, by its fault, with the seeds."""
    bad = [outcome for outcome in outcomes if outcome.result != "right"]
    kinds = Counter((outcome.result, outcome.fault) for outcome in bad)
    return "\n".join(
        f"- {result} {fault}: ".replace(" :", ":")
        + f"{number} (seeds {', '.join(str(o.seed) for o in bad if (o.result, o.fault) == (result, fault))})"
        for (result, fault), number in kinds.most_common()
    )


FAMILY_HEADER = "| family | seeds | right | wrong | refused | seconds: median | most |\n| --- |" + " ---: |" * 6


def family_rows(outcomes: list[Outcome]) -> str:
    """Return a row for each family of surfaces with edges, and one for all."""

    def row_of(name: str, some: list[Outcome]) -> str:
        count, seconds = Counter(o.result for o in some), np.array([o.seconds for o in some])
        return (
            f"| {name} | {len(some)} | {count['right']} | {count['wrong']} | {count['refused']} |"
            f" {np.median(seconds):.1f} | {seconds.max():.1f} |"
        )

    groups = {name: [o for o in outcomes if family_of(o.seed) == name] for name in FAMILIES}
    rows = [row_of(name, some) for name, some in groups.items() if some]
    return "\n".join([FAMILY_HEADER, *rows, row_of("all", outcomes)])


EDGED_NOTE = """\
Surfaces with edges: roofs, folded plates, sawtooth and star folds, vaults over squares and rectangles, boxes, drums, stepped discs,
cones, pyramids and other polyhedra, closed and open, for grids of 300 to 3,000 nodes; 20 to 120 points a member squared, noise up to
.15 of their spacing or .06 of a member, edges sharp or rounded with up to a member, any pose and unit. By quick, on all processors:"""


def edged_section(seeds: int) -> str:
    """Return the part of docs/numbers.md on surfaces with edges: a row for each family, and every failure."""
    outcomes = list(try_seeds(range(seeds), "default", "quick", "edged"))
    return "\n\n".join([EDGED_NOTE, family_rows(outcomes), failures(outcomes) or "No failure."])


def page_section(command: str, seeds: int) -> Section:
    """Return the section of docs/numbers.md."""
    smooth = section(seeds)
    rows = [line.split("|") for line in smooth.splitlines() if line.startswith(("| quick", "| normal"))]
    lost = [f"By {row[1].strip()}: {row[4].strip()} wrong, {row[5].strip()} refused of {row[2].strip()}." for row in rows
            if row[4].strip() != "0" or row[5].strip() != "0"]  # fmt: skip
    right = {row[1].strip(): row[3].strip() for row in rows}
    finding = f"Normal is right on **{right['normal']} of {seeds}** random surfaces, quick on {right['quick']}."
    return Section("Random surfaces", command, finding, f"{smooth}\n\n{edged_section(seeds)}", tuple(lost))


def section(seeds: int, methods: Iterable[tuple[str, str]] = (("default", "quick"), ("default", "normal"))) -> str:
    """Return the section of docs/numbers.md: a row for each method and effort, and every failure."""
    rows, bad = [HEADER], []
    for method, effort in methods:
        outcomes = list(try_seeds(range(seeds), method, effort))
        name = effort if method == "default" else method
        rows.append(row(name, outcomes))
        bad.append(f"By {name}:\n\n{failures(outcomes)}" if failures(outcomes) else f"By {name}: no failure.")
    return "\n\n".join([NOTE, "\n".join(rows), *bad])


def main() -> int:
    """Run what the arguments name; the exit status is 1 if any seed is not right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100, help="how many")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--method", default="default")
    parser.add_argument("--effort", default="normal")
    parser.add_argument("--kind", choices=KINDS, default="smooth")
    parser.add_argument("--processes", type=int, help="how many at once (default: all processors)")
    parser.add_argument("--lines", action="store_true", help="print the line of every seed, not only of failures")
    options = parser.parse_args()
    outcomes = []
    seeds = range(options.first, options.first + options.seeds)
    for outcome in try_seeds(seeds, options.method, options.effort, options.kind, options.processes):
        outcomes.append(outcome)
        if options.lines or outcome.result != "right":
            print(outcome.line(), flush=True)
    if options.kind == "edged":
        print(family_rows(outcomes))
    print(f"{HEADER}\n{row(f'{options.method} {options.effort}', outcomes)}\n\n{failures(outcomes)}".rstrip())
    return int(any(outcome.result != "right" for outcome in outcomes))


if __name__ == "__main__":
    sys.exit(main())
