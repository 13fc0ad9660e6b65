"""Numbers with units as people write them: 0.5kN/m2, 20psf, 20K, 12mm."""

from __future__ import annotations

import math
import re

from ..errors import InputError

POUND_FORCE, FOOT_LENGTH = 0.45359237 * 9.80665, 0.3048  #: force [N] and length [m], exact (NIST SP 811, appendix B)
METRIC_FORCE = {"N": 1.0, "kN": 1e3, "MN": 1e6}  #: [N]
FORCE = {"lbf": POUND_FORCE, "kip": 1e3 * POUND_FORCE} | METRIC_FORCE  #: [N]
LENGTH = {"in": FOOT_LENGTH / 12, "ft": FOOT_LENGTH, "mm": 1e-3, "cm": 1e-2, "m": 1.0}  #: [m]
PRESSURE = {f"{name}/m2": value for name, value in METRIC_FORCE.items()} | {
    "Pa": 1.0, "kPa": 1e3, "psf": POUND_FORCE / FOOT_LENGTH**2, "ksf": 1e3 * POUND_FORCE / FOOT_LENGTH**2,
}  # fmt: skip  #: [N/m2]
FORCE_PER_LENGTH = {"plf": POUND_FORCE / FOOT_LENGTH, "klf": 1e3 * POUND_FORCE / FOOT_LENGTH} | {
    f"{name}/m": value for name, value in METRIC_FORCE.items()
} | {"N/mm": 1e3, "kN/mm": 1e6}  # fmt: skip  #: [N/m]
TEMPERATURE = {"C": 1.0, "K": 1.0}  #: of a change [K]


def split_loads(words: str) -> list[str]:
    """Return the loads between commas of "self,snow:1kN/m2".

    Raises
    ------
    InputError
        A comma stands within a number.
    """
    if comma := re.search(r"([^,:@/]*[:@/][-+]?\d+),(\d+[^,]*)", words):
        raise InputError(f"a comma divides loads; write {comma[1]}.{comma[2]} with a point, not {comma[0]}")
    return [word.strip() for word in words.split(",") if word.strip()]


def quantity(text: object, units: dict[str, float], what: str, *, plain: bool = False) -> float:
    """Return the value of "0.5kN/m2" in SI units.

    Parameters
    ----------
    text : str or float
        Number and unit; `plain`: a number alone is in SI units.
    units : dict
        Known units with their size in SI units.
    what : str
        For the message.

    Raises
    ------
    InputError
        No number, no unit, or one of another kind.
    """
    if plain_comma := re.match(r"\s*([-+]?\d+),(\d+)", str(text)):
        raise InputError(
            f"{what} is {text!r}; write it with a point, {plain_comma[1]}.{plain_comma[2]}, not with a comma"
        )
    found = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\S*)\s*", str(text))
    example = next(reversed(units)) if "kN/m2" not in units else "kN/m2"
    if found:
        unit = found[2].replace("²", "2").replace("^2", "2").replace("°", "")
        try:
            value = float(found[1]) * (units[unit] if unit or not plain else 1.0)
            if math.isfinite(value):
                return value
        except (KeyError, ValueError):
            pass
        if not unit:
            raise InputError(f"the unit is missing: {what} is {text!r}; write it as {found[1]}{example}")
    raise InputError(f"{what} must be a number with one of the units {' '.join(units)}, got {text!r}")
