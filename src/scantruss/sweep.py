"""Grids of one scan by many settings, for choosing a design: made side by side, shown in a table and in pictures."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .errors import FrontError, InputError
from .pipeline import grid_from_cloud
from .runtime.progress import Progress
from .structure.variants import VariantFigures, Variants, solve_variants

if TYPE_CHECKING:
    from .runtime.cluster import Workers
    from .scan.cloud import PointCloud
    from .settings import Settings


@dataclass(frozen=True)
class Trial:
    """Settings to be tried, and what is different in them."""

    name: str  #: of its files
    title: str  #: for people
    varied: tuple[str, ...]  #: values of what is varied, in words
    settings: Settings


@dataclass(frozen=True)
class Outcome:
    """What has come out of a trial: plain values, so that it travels."""

    fault: str = ""  #: why there is no grid
    grid: bytes = b""  #: JSON file
    picture: bytes = b""  #: PNG file
    figures: tuple[str, ...] = ()  #: as in `FIGURES`
    warnings: int = 0  #: of the certificate
    structures: tuple[VariantFigures, ...] = ()  #: of the grid, where they are asked for


FIGURES = (
    "nodes",
    "members",
    "length",
    "length std/mean",
    "shape",
    "shape min",
    "angle min",
    "angle max",
    "irregular",
    "forced",
    "deviation max",
)


def trials_of(varied: Mapping[str, Sequence[str]], choose: Callable[[tuple[int, ...]], Settings]) -> list[Trial]:
    """Return a trial for every combination of values, the last name changing first.

    Parameters
    ----------
    varied : mapping of str to sequence of str
        Name of each setting that has several values, and these in words.
    choose : returns the settings for the number of one value of each
    """
    picks: list[tuple[int, ...]] = [()]
    for values in varied.values():
        picks = [(*pick, number) for pick in picks for number in range(len(values))]
    trials = []
    for pick in picks:
        words = tuple(values[number] for values, number in zip(varied.values(), pick, strict=True))
        name = "_".join(f"{key}-{_file_name(word)}" for key, word in zip(varied, words, strict=True)) or "grid"
        title = ", ".join(f"{key} {word}" for key, word in zip(varied, words, strict=True)) or "grid"
        trials.append(Trial(name, title, words, choose(pick)))
    if len({trial.name for trial in trials}) < len(trials):
        raise InputError("a value is named twice; name each once")
    return trials


def _file_name(word: str) -> str:
    return re.sub(r"[^\w.+-]+", "-", word).strip("-")


def sweep(
    cloud: PointCloud,
    trials: Sequence[Trial],
    workers: Workers,
    progress: Progress | None = None,
    variants: Variants | None = None,
) -> list[Outcome]:
    """Return what comes out of each trial, in their order; the same to the byte for any number of workers.

    With `variants` each grid also becomes structures with each of their supports and rises.
    """
    outcomes: dict[int, Outcome] = {}
    for number, outcome in workers.run(try_settings, [(trial.settings, variants) for trial in trials], cloud):
        outcomes[number] = outcome
        if progress:
            progress("grids", len(outcomes) / len(trials))
    return [outcomes[number] for number in range(len(trials))]


def try_settings(job: tuple[Settings, Variants | None], cloud: PointCloud) -> Outcome:
    """Return the grid of a cloud by some settings with its structures, or why there is none: the work of a worker."""
    from .export.drawing.picture import encode_picture
    from .export.json import encode_json

    settings, variants = job
    try:
        grid = grid_from_cloud(cloud, settings)
    except (FrontError, InputError) as error:
        return Outcome(fault=" ".join(str(error).split()))
    return Outcome(
        grid=encode_json(grid),
        picture=encode_picture(grid, cloud),
        figures=_figures(grid),
        warnings=len(grid.certificate.warnings) if grid.certificate else 0,
        structures=solve_variants(grid, variants) if variants else (),
    )


def _figures(grid: Any) -> tuple[str, ...]:
    quality, certificate = grid.quality, grid.certificate
    deviation = quality.node_deviation_max
    return (
        str(len(grid.nodes)),
        str(len(grid.edges)),
        f"{quality.length_mean:.4g}",
        f"{quality.length_cv:.4f}",
        f"{quality.shape_mean:.4f}",
        f"{quality.shape_min:.3f}",
        f"{quality.angle_min:.1f}",
        f"{quality.angle_max:.1f}",
        str(certificate.irregular) if certificate else "",
        str(certificate.irregular_forced) if certificate else "",
        "" if deviation is None else f"{deviation:.3g}",
    )
