"""Why a grid does not pass its checks, in the words of a refusal, and what gives a grid all the same."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..errors import CertificateError
from .limits import LIMBS_KEPT

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..grid.certificate import Certificate
    from ..grid.grid import Grid

FAULTS_NAMED = 3  # faults that a refusal names
MOST_ACCEPTED = 0.3  # share of the scan that is missed above which no refusal names the setting that accepts it


def passed_grid(grid: Grid) -> Grid:
    """Return a grid whose certificate passes.

    Raises
    ------
    CertificateError
        It does not pass. Names the first place of a fault.
    """
    if grid.certificate is None or grid.certificate.passed:
        return grid
    raise refusal_of(grid)


def refusal_of(grid: Grid, complete: Callable[[], CertificateError] | None = None) -> CertificateError:
    """Return why a grid does not pass; `complete` makes the same with the whole certificate, where the grid has only its faults."""
    certificate = grid.certificate
    assert certificate is not None
    count = len(certificate.faults)
    named = count if count <= FAULTS_NAMED + 1 else FAULTS_NAMED  # one more takes no more words than that there is one
    words = _listed([fault.words for fault in certificate.faults[:named]])
    words += f", and has {count - named} other faults" if count > named else ""
    where = next((fault.where for fault in certificate.faults if fault.where), None)
    return CertificateError(f"the grid {words}; {_way_out(certificate)}", grid, where, complete)


def _listed(words: list[str]) -> str:
    """Return what is wrong as one part of a sentence."""
    return ", ".join(words[:-1]) + f" and {words[-1]}" if len(words) > 1 else words[0]


def option_accepting(found: Certificate) -> str:
    """Return the option with which what a grid misses of the scan is accepted."""
    return f"--allow-missing {math.ceil(100.0 * found.missing) / 100.0:g}"


def _way_out(found: Certificate) -> str:
    """Return what gives a grid all the same: the setting that accepts what is wrong if that alone is, else `--keep-failed`."""
    kinds = {fault.kind for fault in found.faults}
    limbs = sum(part.share for part in found.left_out if part.kind == "limbs") > 0.5 * found.missing
    if kinds == {"cover"} and found.missing > MOST_ACCEPTED:
        return f"{LIMBS_KEPT if limbs else 'choose the part that is wanted with --crop or --piece'}; --keep-failed gives it all the same"
    if kinds <= {"unfollowed", "rounded"}:
        return "shorter members follow it; --keep-failed gives it all the same"
    if kinds == {"sparse"}:
        return "longer members cover it, --allow-missing accepts more of the scan missing"
    if kinds <= {"beyond", "bridged"}:
        return "shorter members keep to it, --crop leaves out what lies beyond it; --keep-failed gives it all the same"
    if "hanging" in kinds or kinds == {"spike"}:
        return "--crop or --piece leaves out what lies off the surface, shorter members keep to it; --keep-failed gives it all the same"
    if kinds == {"cover"} and found.missing > 0.0:
        return f"{f'{LIMBS_KEPT}, ' * limbs}{option_accepting(found)} accepts that"
    return "--keep-failed gives it all the same"
