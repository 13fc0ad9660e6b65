"""Measure everything and write docs/numbers.md: `python -m benchmarks [--data DIR] [--seeds N]`.

A few minutes without scans (`--data` or SCANTRUSS_DATA names their folder) and with few random surfaces.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from . import all_scans, first_figures, quality, random_surfaces, table3
from .ratios import machine, table

FILE = Path(__file__).resolve().parents[1] / "docs" / "numbers.md"


def main() -> None:
    """Measure and write, losses first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", help="folder of the scans; SCANTRUSS_DATA if left out")
    parser.add_argument("--seeds", type=int, default=100, help="random surfaces (default 100)")
    options = parser.parse_args()
    print("speed ...", flush=True)
    speed = first_figures.first_figures()
    print("the examples of the paper ...", flush=True)
    examples = quality.examples()
    print("by way of a surface ...", flush=True)
    surface = table3.table3()
    print("random surfaces ...", flush=True)
    random = random_surfaces.section(options.seeds)
    print("all scans ...", flush=True)
    scans = all_scans.section(all_scans.data_folder(options.data))
    losses = [f"- {row.what}: {row.ratio:.2f}, the aim is at most {row.aim:g}." for row in speed if row.lost]
    losses += [f"- By way of a B-spline surface, {c.name}: {c.ratio:.2f} of our time." for c in surface if c.ratio < 1]
    losses += [f"- {loss}" for example in examples for loss in example.losses()]
    parts = [
        "# Numbers\n\nWritten by `uv run --group benchmarks python -m benchmarks`; all figures of one run.",
        f"Machine: {machine()};\nshared with other work, so ratios count, not seconds. Medians, both sides in turn.",
        "## What is lost\n\n" + ("\n".join(losses) if losses else "Nothing of what is measured here."),
        "## Speed\n\n" + table(speed),
        "## Table 2: the examples of the paper\n\n" + quality.NOTE + "\n\n" + quality.table(examples),
        "## Table 3: by way of a surface\n\n" + NOTE + "\n\n" + "\n".join([table3.HEADER, *(c.row() for c in surface)]),
        "## All twins and real scans\n\n" + scans,
        "## Random surfaces\n\n" + random,
    ]
    beside = FILE.with_suffix(".part")
    beside.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    beside.replace(FILE)
    print(FILE.read_text(encoding="utf-8"))


NOTE = """\
The same clouds and the same code of the front; the other way first fits a bicubic spline with scipy (knots as dense
as helps; only one fit is timed) and looks at that surface instead. Ratio: seconds by way of the surface for one on
the cloud. Distance: mean distance of the nodes from the true surface, in standard deviations of the noise. The paper's
ratios are of its own fitting code; a library of today fits far faster."""

if __name__ == "__main__":
    main()
