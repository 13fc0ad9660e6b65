"""Decimal numbers in the bytes of a text file, rounded to the nearest double as Python rounds them."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel

POWERS = 10.0 ** np.arange(23)  # exact, all of them
FULL = 100_000_000_000_000_000  # a mantissa above takes no further digit
WHOLE = 1 << 53  # whole numbers below are doubles
CORRECTION_ERROR = 1e-12  # of a correction: what its own rounding may change
BAD, GOOD, SLOW = 0, 1, 2  # no number; a number; a number whose rounding must be left to Python


@kernel
def split(value: float) -> tuple[float, float]:
    """Two halves of a double, 26 bits each (Veltkamp)."""
    large = 134217729.0 * value
    high = large - (large - value)
    return high, value - high


@kernel
def times(a: float, b: float) -> tuple[float, float]:
    """Product and what its rounding lost (Dekker)."""
    product = a * b
    a1, a0 = split(a)
    b1, b0 = split(b)
    return product, ((a1 * b1 - product) + a1 * b0 + a0 * b1) + a0 * b0


@kernel
def scaled(mantissa: int, rest: float, power: int) -> tuple[float, int]:
    """(mantissa + rest) * 10**power, and whether its rounding is certain: GOOD or SLOW.

    rest : digits that the mantissa has no room for, below 1.
    """
    if mantissa == 0 and rest == 0.0:
        return 0.0, GOOD
    if power < -22 or power > 22:
        return 0.0, SLOW
    scale = POWERS[abs(power)]
    main = float(mantissa)
    if mantissa < WHOLE and rest == 0.0:
        return (main / scale if power < 0 else main * scale), GOOD
    small = float(mantissa - int(main)) + rest
    if power < 0:
        value = main / scale
        product, lost = times(value, scale)
        left = (main - product) - lost
        step, doubt = (left + small) / scale, (abs(left) + abs(small)) / scale * CORRECTION_ERROR
    else:
        value, lost = times(main, scale)
        step, doubt = lost + small * scale, (abs(lost) + abs(small) * scale) * CORRECTION_ERROR
    result = value + step
    certain = value + (step - doubt) == result and value + (step + doubt) == result
    return result, GOOD if certain else SLOW


@kernel
def number(data: np.ndarray, start: int, stop: int, comma: bool) -> tuple[float, int, int]:
    """The number that starts at a byte: its value, the byte behind it, and BAD, GOOD or SLOW.

    data : uint8. comma : a comma is a decimal sign too.
    """
    i = start
    negative = i < stop and data[i] == 45
    if i < stop and (data[i] == 45 or data[i] == 43):
        i += 1
    if i + 2 < stop and data[i] | 32 == 110 and data[i + 1] | 32 == 97 and data[i + 2] | 32 == 110:
        return np.nan, i + 3, GOOD
    mantissa, rest, weight, power, digits, fraction = 0, 0.0, 0.1, 0, 0, False
    while i < stop:
        digit = int(data[i]) - 48
        if 0 <= digit <= 9:
            digits += 1
            if mantissa < FULL:
                mantissa = 10 * mantissa + digit
                power -= fraction
            else:
                rest += digit * weight
                weight *= 0.1
                power += not fraction
        elif not fraction and (digit == -2 or (comma and digit == -4)):
            fraction = True
        else:
            break
        i += 1
    if digits == 0:
        return 0.0, i, BAD
    if i < stop and data[i] | 32 == 101:
        i, shown, down = i + 1, 0, False
        if i < stop and (data[i] == 45 or data[i] == 43):
            down = data[i] == 45
            i += 1
        first = i
        while i < stop and 48 <= data[i] <= 57:
            shown = min(10 * shown + int(data[i]) - 48, 100_000)
            i += 1
        if i == first:
            return 0.0, i, BAD
        power += -shown if down else shown
    value, state = scaled(mantissa, rest, power)
    return (-value if negative else value), i, state


@kernel
def read_rows(
    data: np.ndarray, stop: int, separator: int, comma: bool, place: np.ndarray, table: np.ndarray, slow: np.ndarray
) -> tuple[int, int]:
    """Rows of whole lines and how many numbers are SLOW; -1 rows where a line is not of plain numbers.

    data : uint8, lines that end with LF. separator : one byte, 0 for blanks. place : column of `table` for each field of a line,
    -1 for those left out. slow : (S, 4) int64, filled with row, column, first and last byte of numbers for Python.
    """
    row, late, i = 0, 0, 0
    while i < stop:
        field, seen = 0, 0
        while i < stop and data[i] != 10:
            while i < stop and (data[i] == 32 or (data[i] == 9 and separator != 9)):
                i += 1
            if i < stop and data[i] == 13 and i + 1 < stop and data[i + 1] == 10:
                i += 1
            if i >= stop or data[i] == 10:
                break
            if field < len(place) and place[field] >= 0:
                value, end, state = number(data, i, stop, comma)
                if state == BAD or row >= len(table) or (state == SLOW and late >= len(slow)):
                    return -1, 0
                table[row, place[field]] = value
                if state == SLOW:
                    slow[late, 0], slow[late, 1], slow[late, 2], slow[late, 3] = row, place[field], i, end
                    late += 1
                i = end
                seen += 1
            while i < stop and data[i] != 10 and data[i] != separator:
                if data[i] == 35 or (data[i] == 13 and (i + 1 >= stop or data[i + 1] != 10)):
                    return -1, 0
                if separator == 0 and (data[i] == 32 or data[i] == 9):
                    break
                if field < len(place) and place[field] >= 0 and data[i] != 32 and data[i] != 9 and data[i] != 13:
                    return -1, 0
                i += 1
            if i < stop and data[i] == separator:
                i += 1
            field += 1
        if field > 0:
            if seen < table.shape[1]:
                return -1, 0
            row += 1
        i += 1
    return row, late
