"""Part 21 of ISO 10303, the text in which IFC and STEP are written: instances with numbers, no dates."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Any
from uuid import UUID

from ..runtime.ours import MADE_BY

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$"  #: of identifiers in IFC
NOT_PLAIN = re.compile(r"[^ -~]+")
PART21_HEAD = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION(({view}),'2;1');
FILE_NAME('','1980-01-01T00:00:00',(''),(''),{mark},{mark},'');
FILE_SCHEMA(({schema}));
ENDSEC;
DATA;
"""


class Word(str):
    """A value that stands as it is: an enumeration such as .AREA., or a value with its type."""


class Ref(int):
    """The number of an instance."""


class Part21:
    """A file under construction.

    ::

        file = Part21("IFC4", view)
        point = file.add("IFCCARTESIANPOINT", (0.0, 0.0, 1.0))
    """

    def __init__(self, schema: str, view: str) -> None:
        self._lines = [PART21_HEAD.format(view=quoted(view), mark=quoted(MADE_BY), schema=quoted(schema))]

    def add(self, name: str, *values: Any) -> Ref:
        """Add an instance and return its number; None is "$", a tuple or list is an aggregate."""
        number = len(self._lines)
        self._lines.append(f"#{number}={name}({','.join([_WORDS[type(value)](value) for value in values])});\n")
        return Ref(number)

    def complex(self, *parts: str) -> Ref:
        """Add an instance of several types, each with its values in words, and return its number."""
        number = len(self._lines)
        self._lines.append(f"#{number}=({' '.join(parts)});\n")
        return Ref(number)

    def encode(self) -> bytes:
        """Return the file."""
        return ("".join(self._lines) + "ENDSEC;\nEND-ISO-10303-21;\n").encode("ascii")


def real(value: float) -> str:
    """Return a number with all its digits, and the point that Part 21 wants."""
    text = repr(value)
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    return f"{mantissa}{'' if '.' in mantissa else '.'}E{exponent}"


def quoted(text: str) -> str:
    """Return a text in quotes; letters beyond ASCII by their numbers."""
    plain = text.replace("\\", "\\\\").replace("'", "''")
    return f"'{plain if plain.isascii() and plain.isprintable() else NOT_PLAIN.sub(_by_number, plain)}'"


def _by_number(found: re.Match[str]) -> str:
    if ord(max(found[0])) > 0xFFFF:
        return f"\\X4\\{found[0].encode('utf-32-be', 'replace').hex().upper()}\\X0\\"
    return f"\\X2\\{found[0].encode('utf-16-be', 'replace').hex().upper()}\\X0\\"


def typed(name: str, value: Any) -> Word:
    """Return a value with its type, such as IFCLABEL('N001')."""
    return Word(f"{name}({_WORDS[type(value)](value)})")


def ifc_guid(identifier: UUID) -> str:
    """Return an identifier in the 22 digits of IFC."""
    number = identifier.int
    return "".join([DIGITS[number >> shift & 63] for shift in range(126, -1, -6)])


def _list(values: Iterable[Any]) -> str:
    return f"({','.join([_WORDS[type(value)](value) for value in values])})"


_WORDS: dict[type, Callable[[Any], str]] = {
    float: real,
    int: str,
    str: quoted,
    bool: lambda value: ".T." if value else ".F.",
    type(None): lambda value: "$",
    Ref: lambda value: f"#{int(value)}",
    Word: str.__str__,
    tuple: _list,
    list: _list,
}
