"""Values as a type checker can follow them: what may be None elsewhere, and places as kernels take them."""

from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")


def known(value: T | None) -> T:
    """Return a value that must be there."""
    assert value is not None
    return value


def xyz(place: Iterable[float]) -> tuple[float, float, float]:
    """Return the three coordinates of a place."""
    x, y, z = map(float, place)
    return x, y, z
