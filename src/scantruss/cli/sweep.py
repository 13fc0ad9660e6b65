"""``scantruss sweep``: a grid for every combination of settings."""

from __future__ import annotations

import argparse
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FormatError, InputError
from .grid import choose_length
from .outputs import Taken, claim, inputs_of, result_folder
from .shared import add_memory, note_compiling, read_scan, settings_to_read, with_some_length
from .thin import add_workers, workers_of

if TYPE_CHECKING:
    from ..settings import Settings
    from ..structure.variants import Variants
    from ..sweep import Outcome, Trial
    from .options import Parser

SWEEP_FILES = ("table.csv", "table.md", "index.html", "overview.png")  # of a sweep
SWEEP_STRUCTURES = ("structures.csv", "structures.md")  # of a sweep with structures


def sweep_parser() -> Parser:
    """Options of ``scantruss sweep``."""
    from .options import Parser, add_force, add_settings

    parser = Parser(
        "sweep",
        "SCAN [--length 3,4,5] [--effort quick,normal ...] -o FOLDER [options]",
        "Make a grid for every combination of settings: a table and pictures, for choosing a design.\n"
        "Every setting takes one value or several, separated by commas; the scan is read once. Without\n"
        "--length, the length that info suggests is used.",
    )
    parser.add_argument("scan", metavar="SCAN", help="scan file")
    parser.add_argument("-o", "--out", metavar="FOLDER", required=True, help="folder of the results")
    parser.add_argument("--settings", metavar="FILE", help="settings saved beside an earlier result")
    parser.add_argument("--fixed-file", metavar="FILE", help="positions that must become nodes, one X,Y,Z per line")
    add_force(parser)
    add_memory(parser)
    add_workers(parser)
    add_settings(parser)
    for action in parser._actions:
        if action.dest not in ("help", "scan", "out", "settings", *ONE_AT_LEAST) and action.type is not None:
            action.type = _several(action.type)
    group = parser.add_argument_group("STRUCTURE: which length, supports and rise give the lightest one")
    group.add_argument(
        "--structure", metavar="FILE", help="settings of scantruss structure (.toml or .json) for every grid"
    )
    group.add_argument("--supports", metavar="WHERE,...", help="supports to try (default those of the file)")
    group.add_argument("--rise", metavar="NUMBER,...", help="heights to try, over the height of the grid (default 1)")
    return parser


MOST_RISE = 10.0  #: greatest height over that of the grid
# one value only
ONE_AT_LEAST = (
    "memory", "workers", "fixed", "fixed_lines", "plain_at", "fill_at", "no_ridge_at", "rows_along", "unit", "z_unit", "returns",
    "confidence",
    "thin_spacing",
)  # fmt: skip


def _several(kind: Any) -> Callable[[str], list[Any]]:
    """Return a parser of values separated by commas, each kept with its text."""

    def read(text: str) -> list[Any]:
        words = [word.strip() for word in text.split(",") if word.strip()]
        if not words:
            raise argparse.ArgumentTypeError(f"needs one value or several, separated by commas, got {text!r}")
        return [(word, kind(word)) for word in words]

    return read


def sweep(values: Namespace) -> None:
    """Make many grids and report them."""
    from ..report.choosing import head_of, rows_of_designs, structure_table
    from ..report.terminal import Bars, print_lines, print_table
    from ..sweep import sweep as make_grids
    from .options import has_length

    folder = result_folder(values.out)
    trials, varied = trials_of_words(with_some_length(values))
    variants = variants_of(values)
    claim_results(folder, trials, inputs_of(values), values.force, SWEEP_STRUCTURES if variants else ())
    shortest = min((trial.settings for trial in trials), key=lambda settings: settings.length)
    with Bars() as bars:
        fitting = settings_to_read(values, shortest, bars)
        cloud = read_scan(values.scan, fitting, bars)
        if not has_length(values):
            length = choose_length(cloud, shortest, bars)[0].length
            trials = [replace(trial, settings=trial.settings.replace(length=length)) for trial in trials]
        if variants:
            from ..structure.build import scale_of

            scale_of(cloud.unit or variants.settings.unit, variants.settings.scale)  # before the long work
        if fitting.thin_spacing:
            thin = {"thin_spacing": fitting.thin_spacing}
            trials = [replace(trial, settings=trial.settings.replace(**thin)) for trial in trials]
        compiling = note_compiling(bars)
        with compiling, workers_of(values, bars, None if len(trials) > 1 else 1) as workers:
            outcomes = make_grids(cloud, trials, workers, bars, variants)
        head, rows = head_of(varied, cloud.unit), rows_of_designs(trials, outcomes)
        if not any(outcome.grid for outcome in outcomes):
            raise InputError(f"no grid came out of {len(trials)} trials; the first: {outcomes[0].fault}")
        tables = [(head, rows), *([structure_table(varied, trials, outcomes)] if variants else [])]
        _save(folder, f"Grids of {Path(values.scan).name}", trials, outcomes, tables, values.force)
    for table in tables:
        print_table(*table)
    print_lines(
        [
            *(_lightest_line(trials, outcomes) if variants else []),
            f"wrote {sum(bool(o.grid) for o in outcomes)} grids, table and pictures to {folder}",
        ]
    )


def variants_of(values: Namespace) -> Variants | None:
    """Return the structures that are to be made of every grid, None where there is no ``--structure``."""
    from ..structure.options import read_structure_settings
    from ..structure.variants import Variants
    from .options import UsageError, number

    if not values.structure:
        if values.supports or values.rise:
            raise UsageError("--supports and --rise need --structure FILE, the settings of the structure")
        return None
    settings = read_structure_settings(values.structure)
    supports = tuple(word.strip() for word in (values.supports or settings.supports).split(",") if word.strip())
    if not supports:
        raise InputError(f"no supports: name some in {values.structure} or with --supports")
    try:
        rises = tuple(number(word) for word in (values.rise or "1").split(","))
    except argparse.ArgumentTypeError as error:
        raise UsageError(f"--rise {error}") from None
    if not all(0 < rise < MOST_RISE for rise in rises):
        raise UsageError(f"--rise needs numbers above 0 and below {MOST_RISE:g}, got {values.rise}")
    return Variants(settings, supports, rises)


def _lightest_line(trials: list[Trial], outcomes: list[Outcome]) -> list[str]:
    """Return which structure is the lightest of those that pass, in a line."""
    from ..structure.variants import lightest

    found = [(trial, lightest(list(outcome.structures))) for trial, outcome in zip(trials, outcomes, strict=True)]
    passed = [(each.mass, trial.title, each) for trial, each in found if each]
    if not passed:
        return ["no structure passes without a warning"]
    _, title, best = min(passed, key=lambda one: one[0])
    return [
        f"lightest: {title}, supports {best.supports}, rise {best.rise:g}: {best.mass:,.0f} kg of {' '.join(best.sections)}"
    ]


def claim_results(folder: Path, trials: list[Trial], taken: Taken, force: bool, more: tuple[str, ...] = ()) -> None:
    """Refuse a folder where a result cannot be written, or would replace something else."""
    from ..runtime.ours import check_ours
    from ..runtime.places import check_place

    names = (*SWEEP_FILES, *more, *(f"{trial.name}{end}" for trial in trials for end in (".json", ".png")))
    for name in names:
        claim(folder / name, "result", taken, force=True)
        if folder.exists():
            check_place(folder / name, (Path(name).suffix,))
    for name in () if force else names:
        check_ours(folder / name, "result")
    _refuse_earlier_sweep(folder, {trial.name for trial in trials})


def _refuse_earlier_sweep(folder: Path, names: set[str]) -> None:
    """Refuse a folder with grids that the new table would not know, though they stand beside it."""
    if not (folder / SWEEP_FILES[0]).exists():
        return
    grids = (path.stem for path in sorted(folder.glob("*.json")) if path.with_suffix(".png").exists())
    if others := [name for name in grids if name not in names]:
        more = f" and {len(others) - 1:,} more" if len(others) > 1 else ""
        raise FormatError(
            f"{folder} holds grids of another sweep, {others[0]}{more}; name another folder, or remove these first"
        )


def trials_of_words(values: Namespace) -> tuple[list[Trial], tuple[str, ...]]:
    """Return a trial for every combination of the values on the command line, and the names of what is varied."""
    from ..sweep import trials_of
    from .options import option_of, settings_of

    lists = {name: value for name, value in vars(values).items() if _is_list(value)}
    varied = {name: value for name, value in lists.items() if len(value) > 1}

    def choose(pick: tuple[int, ...]) -> Settings:
        one = {name: value[0][1] for name, value in lists.items()}
        one |= {name: varied[name][number][1] for name, number in zip(varied, pick, strict=True)}
        return settings_of(Namespace(**(vars(values) | one)))

    words = {option_of(name).removeprefix("--"): [word for word, _ in value] for name, value in varied.items()}
    return trials_of(words, choose), tuple(words)


def _is_list(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], tuple) and len(value[0]) == 2


def _save(
    folder: Path,
    title: str,
    trials: list[Trial],
    outcomes: list[Any],
    tables: list[tuple[tuple[str, ...], list[Any]]],
    force: bool,
) -> None:
    """Save grids, pictures and tables together, or nothing; `claim_results` knows their names."""
    from ..export.drawing.sheet import encode_sheet
    from ..report.choosing import encode_choice, encode_table_csv, encode_table_markdown, title_of
    from ..runtime.files import SaveTogether
    from ..runtime.ours import kind_of_ours

    with SaveTogether("" if force else "result") as save:
        save.make_folder(folder)
        for trial, outcome in zip(trials, outcomes, strict=True):
            if outcome.grid:
                save.beside(folder / f"{trial.name}.json").write_bytes(outcome.grid)
                save.beside(folder / f"{trial.name}.png").write_bytes(outcome.picture)
        both = zip(trials, outcomes, strict=True)
        pictures = [(title_of(trial, outcome), outcome.picture) for trial, outcome in both if outcome.picture]
        grids, *structures = [(encode_table_csv(*table), encode_table_markdown(*table)) for table in tables]
        contents = [*grids, encode_choice(title, tables, trials, outcomes), encode_sheet(pictures)]
        for name, content in zip(SWEEP_FILES, contents, strict=True):
            save.beside(folder / name).write_bytes(content)
        for name, content in zip(SWEEP_STRUCTURES, *structures, strict=True) if structures else ():
            save.beside(folder / name).write_bytes(content)
    for trial, outcome in zip(trials, outcomes, strict=True):
        if not outcome.grid:  # left by an earlier sweep; this table says there is no grid
            for end in (".json", ".png"):
                (folder / f"{trial.name}{end}").unlink(missing_ok=True)
    for name in () if structures else SWEEP_STRUCTURES:
        if kind_of_ours(folder / name):
            (folder / name).unlink()
