"""Options that change nothing where they are given, which is said."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

    from ..scan.cloud import PointCloud
    from ..settings import Settings

DEFAULT_ONLY = ("effort", "ridge_angle", "no_ridge_at", "sharp_edges", "fold_weight")  # settings


def idle_options(values: Namespace, cloud: PointCloud, settings: Settings) -> Iterator[str]:
    """Yield a line for each option of a command line that changes nothing."""
    from .options import PAPER_ONLY, option_of

    given = vars(values)
    if settings.method == "default" and (names := [option_of(name) for name in PAPER_ONLY if name in given]):
        yield f"{', '.join(names)}: for --method paper; the default method uses this only where its rows of nodes fail"
    if settings.method == "paper" and (names := [option_of(name) for name in DEFAULT_ONLY if name in given]):
        yield f"{', '.join(names)}: for the default method; --method paper does without"
    elif settings.no_ridge_at:
        yield from _places_without_ridge(cloud, settings)
    if settings.plain_at:
        yield from _places_without_limb(cloud, settings)


def _places_without_ridge(cloud: PointCloud, settings: Settings) -> Iterator[str]:
    from ..constraints.find import wanted_ridges
    from ..constraints.ridges import without
    from ..errors import ScanTrussError, words_of_place
    from ..surface.samples import sample_surface

    plain = settings.replace(no_ridge_at=())
    try:
        samples = sample_surface(cloud, plain)
        ridges = wanted_ridges(samples, plain)
    except ScanTrussError:  # which the run says
        return
    for place in settings.no_ridge_at:
        if len(without(ridges, [np.array(place, float) - samples.origin], settings.length)) == len(ridges):
            yield f"no ridge passes {words_of_place(tuple(place))}, so --no-ridge-at changes nothing there"


def _places_without_limb(cloud: PointCloud, settings: Settings) -> Iterator[str]:
    from ..errors import ScanTrussError, words_of_place
    from ..surface.samples import sample_surface

    if settings.plain_body:
        yield "--plain-at: --plain-body takes all limbs off already"
        return
    try:
        kept = sample_surface(cloud, settings.replace(plain_at=())).judged
        for place in settings.plain_at:
            if np.array_equal(kept, sample_surface(cloud, settings.replace(plain_at=(place,))).judged):
                yield f"no thin limb or slit is near {words_of_place(tuple(place))}, so --plain-at changes nothing there"
    except ScanTrussError:  # which the run says
        return
