"""Measure and write docs/numbers.md: `uv run --group benchmarks python -m benchmarks [SECTION]`.

Without a section all of them, one after the other, each written as soon as it is measured. By what parts of it took, some
four to eight hours on two cores, nearly all of it for the other ways; stopped and called again, their runs that were kept
(benchmarks/runs) are not done again. `--quick`: two clouds, about four minutes of processor time.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from . import own
from .page import Section, write

PARTS = ("speed", "structures", "examples", "surface", "random", "scans", "peers")
QUICK_PARTS = ("speed", "examples", "peers")
PATHS = ("--data", "--page")  # options whose values say more of a machine than of a measurement


def _speed(options: argparse.Namespace, command: str) -> Section:
    from .speed import section

    return section(command, options.quick)


def _structures(options: argparse.Namespace, command: str) -> Section:
    from .structures import section

    return section(command, options.quick)


def _examples(options: argparse.Namespace, command: str) -> Section:
    from .quality import section

    return section(command)


def _surface(options: argparse.Namespace, command: str) -> Section:
    from .table3 import section

    return section(command)


def _random(options: argparse.Namespace, command: str) -> Section:
    from . import random_surfaces

    return random_surfaces.page_section(command, options.seeds)


def _scans(options: argparse.Namespace, command: str) -> Section | None:
    from . import all_scans

    return all_scans.page_section(command, all_scans.data_folder(options.data))


def _peers(options: argparse.Namespace, command: str) -> Section:
    from .peers import clouds, runs, section, ways

    if options.quick:
        chosen: tuple[clouds.Cloud, ...] = section.QUICK_CLOUDS
        some, limit = section.QUICK_WAYS, section.QUICK_LIMIT
    else:
        chosen = tuple(clouds.clouds(options.shapes, options.points, options.nodes, options.noises))
        some = tuple(way for way in ways.WAYS if not options.ways or any(part in way.name for part in options.ways))
        limit = section.LIMIT
    repeats = section.QUICK_REPEATS if options.quick else runs.REPEATS
    rows = section.measured(chosen, some, limit=options.limit or limit, repeats=repeats, fresh=options.fresh)
    return section.section(rows, command, *([options.page.parent] if options.page else []))


MAKERS: dict[str, Callable[[argparse.Namespace, str], Section | None]] = {
    "speed": _speed,
    "structures": _structures,
    "examples": _examples,
    "surface": _surface,
    "random": _random,
    "scans": _scans,
    "peers": _peers,
}


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _counts(text: str) -> list[int]:
    return [int(float(word)) for word in _words(text)]


def _numbers(text: str) -> list[float]:
    return [float(word) for word in _words(text)]


def told(arguments: Sequence[str]) -> str:
    """Return the command line as the page tells it: a path is a plain word there."""
    words: list[str] = []
    for word in arguments:
        option = word.partition("=")[0]
        if words and words[-1] in PATHS:
            words.append(words[-1].lstrip("-").upper())
        elif option in PATHS and option != word:
            words += [option, option.lstrip("-").upper()]
        else:
            words.append(word)
    return shlex.join(words)


def parser() -> argparse.ArgumentParser:
    """Return the command line."""
    from .peers.clouds import NODES, NOISES, POINTS, SHAPES

    whole = argparse.ArgumentParser(
        "python -m benchmarks",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,  # `told` knows the options by their whole names
    )
    whole.add_argument("part", nargs="?", default="all", choices=["all", *PARTS, "own", "compare"],
                       help="all (the default), one section, own (our own figures as JSON) or compare (two of these)")  # fmt: skip
    whole.add_argument("files", nargs="*", type=Path, help="of own: where to write; of compare: OLD NEW")
    whole.add_argument("--quick", action="store_true", help="a small part, some three minutes")
    whole.add_argument(
        "--page",
        type=Path,
        help="the page to write instead of docs/numbers.md; all else that is written goes beside it",
    )
    whole.add_argument("--data", help="scans: their folder; SCANTRUSS_DATA if left out")
    whole.add_argument("--seeds", type=int, default=100, help="random: how many surfaces (default 100)")
    whole.add_argument(
        "--tolerance",
        type=float,
        default=own.TOLERANCE,
        help=f"compare: how much slower is no matter (default {own.TOLERANCE:g})",
    )
    for name, kind, default in (("shapes", _words, SHAPES), ("points", _counts, POINTS), ("nodes", _counts, NODES),
                                ("noises", _numbers, NOISES), ("ways", _words, ())):  # fmt: skip
        shown = ",".join(map(str, default)) or "all"
        whole.add_argument(
            f"--{name}", type=kind, default=default, help=f"peers: some of them, by commas (default {shown})"
        )
    whole.add_argument("--limit", type=float, help="peers: seconds for one run (default 300, quick 30)")
    whole.add_argument("--fresh", action="store_true", help="peers: run again what was kept")
    return whole


def main(arguments: Sequence[str] | None = None) -> int:
    """Do what the arguments say; return the exit status."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    whole = parser()
    options = whole.parse_intermixed_args(arguments)
    if options.part == "compare":
        if len(options.files) != 2:
            whole.error("compare needs two files: OLD NEW")
        old, new = options.files
        try:
            return own.compare(old, new, options.tolerance)
        except (OSError, ValueError) as error:
            whole.error(str(error))
    if (options.files and options.part != "own") or len(options.files) > 1:
        whole.error("files are for own (one) and compare (two)")
    page = {"file": options.page} if options.page else {}
    names = (QUICK_PARTS if options.quick else PARTS) if options.part == "all" else (options.part,)
    for name in names:
        if name == "own":
            continue
        print(f"{name} ...", flush=True)
        section = MAKERS[name](options, told(arguments))
        if section is None:
            print(f"{name}: nothing measured, the page keeps what it has")
            continue
        write(section, **page)
        print(f"{section.finding}\n", flush=True)
    if options.part in ("all", "own"):
        beside = options.page.with_name(own.FILE.name) if options.page else own.FILE
        own.save(own.record(options.quick), options.files[0] if options.files else beside)
    return 0


if __name__ == "__main__":
    sys.exit(main())
