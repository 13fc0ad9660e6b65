"""Options of the command line: one for every field of `Settings`, made from the fields.

The parser is argparse and not cyclopts for a quick start: ``--help`` takes 0.05 s instead of 0.4 s.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any, NoReturn

from ..errors import InputError, decimal_comma_words
from ..selection import Selection, read_crop
from ..settings import CURVATURE, RECORDS, Settings
from ..settings.values import SYMMETRIES_FOUND
from .positions import position, read_planes, read_polylines, read_positions

WITH_UNIT = re.compile(r"[-+]?\d*[.,]?\d+\s*([a-z]+|\"|')", re.IGNORECASE)  # a number with its unit


UNIT_OPTIONS = ("--unit", "--z-unit")


class UsageError(InputError):
    """The command line cannot be understood."""


#: what other programs call an option -> its name here
WORDS_OF_OTHERS = {
    "output": "out", "overwrite": "force", "f": "force", "l": "length", "mesh-size": "length", "edge-length": "length",
    "quads": "cells", "quad": "cells", "hexagons": "cells", "hole-fill": "fill-holes",
    "close-holes": "fill-holes", "units": "unit", "silent": "quiet", "layer": "class",
}  # fmt: skip


class Parser(argparse.ArgumentParser):
    """The parser of one command: plain one-line errors, options and files in any order, negative numbers as values."""

    def __init__(self, command: str, usage: str, description: str) -> None:
        super().__init__(
            prog=f"scantruss {command}",
            usage=f"scantruss {command} {usage}",
            description=description,
            allow_abbrev=False,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        self.add_argument("-q", "--quiet", action="store_true", help="print nothing but errors")

    def error(self, message: str) -> NoReturn:
        """Raise instead of printing the usage and exiting."""
        message = re.sub(r"^argument (-\S*)", r"\1", message.replace("argument OUT: ", ""))
        message = message.replace("the following arguments are required:", "missing")
        raise UsageError(f"{message}; see {self.prog} --help")

    def read(self, words: Sequence[str]) -> argparse.Namespace:
        """Return the values of the command line."""
        words = _with_usual_units(_join_negative(words))
        values, rest = self.parse_known_intermixed_args(words)
        self._check_once(words)
        if rest:
            unknown = next((word for word in rest if word.startswith("-")), None)
            if unknown is None:
                self.error(f"too many arguments: {' '.join(rest)}; put a pattern such as *.ply in quotes")
            self.error(f"unknown option {unknown.partition('=')[0]}{self._nearest(unknown)}")
        return values

    def _check_once(self, words: Sequence[str]) -> None:
        """Refuse an option that is given twice and keeps one value: the first would go without a word."""
        seen: set[str] = set()
        for word in words[: words.index("--")] if "--" in words else words:
            name = word.partition("=")[0]
            action = self._option_string_actions.get(name)
            if action is None or type(action).__name__ != "_StoreAction":
                continue
            if action.dest in seen:
                self.error(f"{name} is given twice; give it once, with commas between values where it takes several")
            seen.add(action.dest)

    def _nearest(self, word: str) -> str:
        """Guess which option was meant: one with the same beginning, else the most similar one."""
        from difflib import get_close_matches

        word = word.partition("=")[0]
        begin = sorted((name for name in self._option_string_actions if name.startswith(word)), key=len)
        known = {name.lstrip("-"): name for name in self._option_string_actions}  # dashes make all names alike
        close = get_close_matches(word.lstrip("-"), known, 1, 0.7)
        near = begin[0] if len(word) > 2 and begin else known[close[0]] if close else ""
        near = near or known.get(WORDS_OF_OTHERS.get(word.lstrip("-"), "-"), "")
        return f" (did you mean {near}?)" if near else ""


def add_force(parser: argparse.ArgumentParser) -> None:
    """Add the option that lets results replace files that ScanTruss did not write."""
    parser.add_argument("--force", action="store_true", help="replace files that ScanTruss did not write")


def add_outs(parser: Parser, help: str, positional: str = "") -> None:
    """Add ``-o OUT``, repeatable, and results as further files: none ("") or the number of them as argparse counts."""
    if positional:
        parser.add_argument("outs", metavar="OUT", nargs=positional, default=[], help=help)
    parser.add_argument(
        "-o", "--out", dest="more_outs", metavar="OUT", action="append", default=[],
        help="OUT as an option; repeatable" if positional else f"{help}; repeatable",
    )  # fmt: skip
    add_force(parser)


def _join_negative(words: Sequence[str]) -> list[str]:
    """Join ``--option -3`` to ``--option=-3``: argparse takes "-1,2,-3" and "-inf" for options."""
    joined: list[str] = []
    for word in words:
        if re.match(r"-(\.?\d|inf|nan)", word) and joined and re.fullmatch(r"--[a-z][a-z0-9-]*", joined[-1]):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _with_usual_units(words: Sequence[str]) -> list[str]:
    """Name units as we do, such as foot for ft."""
    from ..scan.units import usual_unit

    named = list(words)
    for number, word in enumerate(words):
        option, equals, value = word.partition("=")
        if option in UNIT_OPTIONS and equals:
            named[number] = f"{option}={usual_unit(value)}"
        elif option in UNIT_OPTIONS and number + 1 < len(words):
            named[number + 1] = usual_unit(words[number + 1])
    return named


def number(text: str) -> float:
    """Return a number, or refuse the text."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"needs a number{_why_no_number(text)}") from None


def _why_no_number(text: str) -> str:
    """Say of a text that is nearly a number what is wrong with it, to follow "needs a number"."""
    if comma := decimal_comma_words(text):
        return comma
    if text.endswith("%"):
        return f" without %, got {text}; one percent is 0.01"
    if found := WITH_UNIT.fullmatch(text):
        return f" without {found[1]}, got {text}; --help names its unit"
    return f", got {text!r}"


def numbers(text: str) -> tuple[float, ...]:
    """Return numbers with commas between them, or refuse the text."""
    return tuple(number(word.strip()) for word in text.split(","))


def length_or_field(text: str) -> float | str:
    """Return the value of ``--length``: a number, else "curvature:MIN:MAX" or the name of a file of lengths as it stands."""
    with suppress(ValueError):
        return float(text)
    if text.startswith(CURVATURE) or Path(text).is_file():
        return text
    needs = f"needs a number, a file of lengths or {CURVATURE}MIN:MAX"
    if comma := decimal_comma_words(text):
        raise argparse.ArgumentTypeError(f"{needs}{comma}")
    if found := WITH_UNIT.fullmatch(text):
        raise argparse.ArgumentTypeError(
            f"{needs} in the unit of the scan, without {found[1]} (info prints the unit, --unit sets it);"
            f" convert {text} to that unit"
        )
    if re.search("[a-z]", text, re.IGNORECASE) and re.search(r"[./\\]", text):
        raise argparse.ArgumentTypeError(f"{needs}; there is no file {text}")
    raise argparse.ArgumentTypeError(f"{needs}, got {text!r}")


def number_or_none(text: str) -> float | None:
    """Return a number, or None for the word "none"."""
    return None if text.lower() == "none" else number(text)


def whole_number(text: str) -> int:
    """Return a whole number, or refuse the text."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"needs a whole number, got {text!r}") from None


def share(text: str) -> float:
    """Return 0.01 of "1%" or "0.01"."""
    try:
        return float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        raise argparse.ArgumentTypeError(f"needs a share such as 1% or 0.01, got {text!r}") from None


def scale(text: str) -> float:
    """Return 0.01 of "1:100" or "0.01"."""
    first, colon, second = text.partition(":")
    try:
        return float(first) / (float(second) if colon else 1.0)
    except (ValueError, ZeroDivisionError):
        raise argparse.ArgumentTypeError(f"needs a scale such as 0.01 or 1:100, got {text!r}") from None


def size_of_memory(text: str) -> float:
    """Return the bytes of "4GB", "500 MB" or "123456"."""
    found = re.fullmatch(r"(\d+\.?\d*|\.\d+)\s*([kmgt]?)i?b?", text.strip().lower())
    if not found or float(found[1]) <= 0:
        raise argparse.ArgumentTypeError(f"needs a size such as 4GB or 500MB, got {text!r}")
    return float(found[1]) * 1000.0 ** " kmgt".index(found[2] or " ")


def picture_size(text: str) -> tuple[int, int]:
    """Return width and height of "1600x1200" [pixel]."""
    found = re.fullmatch(r"(\d+)\s*[x,]\s*(\d+)", text.strip().lower())
    if not found:
        raise argparse.ArgumentTypeError(f"needs WIDTHxHEIGHT in pixels such as 1600x1200, got {text!r}")
    return int(found[1]), int(found[2])


_KINDS: dict[str, tuple[Callable[[str], Any], str]] = {
    "float": (number, "NUMBER"),
    "float | None": (number_or_none, "NUMBER"),
    "int": (whole_number, "COUNT"),
    "str": (str, "NAME"),
}


def option_of(name: str) -> str:
    """Return the option of a field; a length field is a value of ``--length``, names of lines come with ``--fixed-line``."""
    renamed = {"fixed_lines": "fixed_line", "line_names": "fixed_line", "classes": "class"}
    return "--" + renamed.get(name, name).removesuffix("_field").replace("_", "-")


def describe(spec: Field[Any]) -> str:
    """Return the help for a field: what it is, its place in the paper, its default."""
    about = spec.metadata
    notes = [note for note in (about["symbol"], about["source"]) if note]
    if spec.default is not MISSING and spec.name != "length" and spec.default not in ("", (), None):
        value = spec.default
        words = (
            ("off", "on")[value]
            if isinstance(value, bool)
            else f"{value:g}"
            if isinstance(value, float)
            else f"{value}"
        )
        notes.append(f"default {words}" + (f" {about['unit']}s" if about["unit"] else ""))
    elif about["unit"]:
        notes.append(f"in {about['unit']}s")
    return (str(about["help"]) + (f" ({'; '.join(notes)})" if notes else "")).replace("%", "%%")


#: everyday settings, and those that matter only to `--method paper` and fronts without a lattice; the rest is for experts
EVERY_DAY = (
    "length", "cells", "effort", "prefer", "unit", "classes", "crop", "piece", "boundary", "fill_holes", "fixed", "fixed_lines",
    "ridge_angle",
)  # fmt: skip
PAPER_ONLY = (
    "advance_from", "shape_weight", "size_weight", "length_weight", "search_range", "nearness", "merge_angle", "case3",
    "max_deviation", "smooth_forward", "smooth_backward", "smooth_passes",
)  # fmt: skip


WITH_OTHERS = ("length_field", "line_names")  #: settings that the options of others set too


def add_settings(parser: Parser, names: Sequence[str] = (), title: str = "the scan") -> None:
    """Add one option for every field of `Settings` in three parts, or for the named ones in one; only options that are given are set."""
    specs = [spec for record in RECORDS for spec in fields(record) if spec.name not in WITH_OTHERS]
    if names:
        _add_options(parser.add_argument_group(title), (spec for spec in specs if spec.name in names))
        return
    by_name = {spec.name: spec for spec in specs}
    _add_options(parser.add_argument_group("EVERYDAY"), (by_name[name] for name in EVERY_DAY))
    for record in RECORDS:
        title = f"EXPERT: {(record.__doc__ or '').rstrip('.').lower()}"
        own = [spec for spec in specs if spec in fields(record) and spec.name not in EVERY_DAY + PAPER_ONLY]
        if own:
            _add_options(parser.add_argument_group(title), own)
    _add_options(parser.add_argument_group("PAPER: for --method paper"), (by_name[name] for name in PAPER_ONLY))


def _add_options(group: argparse._ArgumentGroup, specs: Iterable[Field[Any]]) -> None:
    """Add one option for every field to a group of options."""
    for spec in specs:
        choices = spec.metadata["choices"]
        options: dict[str, Any] = {"dest": spec.name, "default": argparse.SUPPRESS, "help": describe(spec)}
        if spec.name in ("fixed", "plain_at", "fill_at", "no_ridge_at"):
            options |= {"action": "append", "type": position, "metavar": "X,Y,Z"}
            options["help"] += "; repeatable"
        elif spec.name == "rows_along":
            options |= {"type": numbers, "metavar": "X,Y,Z,DX,DY,DZ"}
        elif spec.name == "length":
            options |= {"type": length_or_field, "metavar": "NUMBER|FILE|curvature:MIN:MAX"}
        elif spec.name in ("fixed_lines", "boundary"):
            options |= {"action": "append", "metavar": "FILE"}
            options["help"] += (
                "; a text file of points X,Y,Z, with an empty line or a new `name` between polylines; repeatable"
            )
        elif spec.name == "symmetry":
            options["metavar"] = "auto|rotation|FILE"
        elif spec.name == "classes":
            options |= {"action": "append", "metavar": "NUMBER,..."}
            options["help"] += "; repeatable"
        elif spec.name == "crop":
            options |= {"action": "append", "metavar": "BOX|SPHERE|FILE"}
            options["help"] += "; repeatable: a point must lie in all of them"
        elif spec.type == "bool":
            options["action"] = argparse.BooleanOptionalAction
        else:
            kind, metavar = _KINDS.get(str(spec.type), (str, "VALUE"))
            options |= {"type": kind, "metavar": "|".join(choices) if choices else metavar}
        group.add_argument(option_of(spec.name), **options)


READING = ("unit", "z_unit", "classes", "returns", "confidence", "crop")  #: settings that steer how scans are read
#: settings of a grid that decide at which lengths it passes
DECIDING = (
    "piece", "boundary", "fill_holes", "fill_at", "ridge_angle", "no_ridge_at", "outlier_distance", "keep_rods", "limb_girth", "cut_thin",
    "smooth_scale", "allow_missing",
)  # fmt: skip


def add_reading(parser: Parser) -> None:
    """Add the options that steer how scans are read: units and which points are taken; see `selection_of`."""
    add_settings(parser, READING)


def selection_of(values: argparse.Namespace) -> Selection:
    """Return what the options of `add_reading` select; files of polygons are read here."""
    given = _with_crops({name: value for name, value in vars(values).items() if name in READING and name != "unit"})
    return Selection(**given)


def _with_crops(given: dict[str, Any]) -> dict[str, Any]:
    """Return options with the polygons of files in place of their names."""
    return given | ({"crop": tuple(map(read_crop, given["crop"]))} if "crop" in given else {})


def has_length(values: argparse.Namespace) -> bool:
    """Whether the command line or its settings give a member length."""
    return "length" in vars(values) or bool(vars(values).get("settings"))


def settings_of(values: argparse.Namespace) -> Settings:
    """Return the settings of a command line: those of ``--settings``, overridden by explicit options."""
    given = vars(values)
    kept = Settings.read(given["settings"]).to_dict() if given.get("settings") else {}
    explicit = _with_crops({spec.name: given[spec.name] for spec in fields(Settings) if spec.name in given})
    if given.get("fixed_file"):
        explicit["fixed"] = (*explicit.get("fixed", ()), *read_positions(given["fixed_file"]))
    if isinstance(explicit.get("length"), float):
        explicit["length_field"] = ""  # one number means one length everywhere
    elif "length" in explicit:
        from ..scan.formats.lengths import read_lengths

        named = explicit.pop("length")
        explicit["length_field"] = named if named.startswith(CURVATURE) else read_lengths(named)
        kept.pop("length", None)
    if "fixed_lines" in explicit:
        named_lines = [line for path in explicit["fixed_lines"] for line in read_polylines(path)]
        explicit["fixed_lines"] = tuple(points for _, points in named_lines)
        explicit["line_names"] = tuple(name for name, _ in named_lines)
    if explicit.get("symmetry", "auto") not in SYMMETRIES_FOUND:
        explicit["symmetry"] = read_planes(explicit["symmetry"])
    if "boundary" in explicit:
        explicit["boundary"] = tuple(
            ring for path in explicit["boundary"] for _, ring in read_polylines(path, "boundary")
        )
    merged = kept | explicit
    if "length" not in merged and not merged.get("length_field"):
        raise UsageError(
            "--length is missing, the desired member length in the scan's unit; scantruss info SCAN suggests one"
        )
    return Settings.from_dict(merged)
