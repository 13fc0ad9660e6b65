"""What to do about pieces that spoil a scan: the largest alone, tried before it is named."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import ScanTrussError

if TYPE_CHECKING:
    from ..report.terminal import Bars
    from ..scan.cloud import PointCloud
    from ..settings import Settings

LEAST_OF_SCAN = 0.5  # share of the scan that the largest piece is at least


def words_of_largest_piece(bars: Bars, cloud: PointCloud, settings: Settings) -> str:
    """Name the nearest length at which a grid of the largest of several pieces passes, tried by quick runs; nothing if none does."""
    from ..report.advice import Advice
    from ..surface.samples import sample_surface

    if settings.length_field or settings.piece not in ("auto", "all"):
        return ""
    try:
        samples = sample_surface(cloud, settings)
        if len(samples.pieces) < 2 or (samples.piece == samples.named_pieces[1]).mean() < LEAST_OF_SCAN:
            return ""
        advice = Advice(cloud, settings.replace(piece="1"), bars)
        trial = advice.try_length(settings.length)
        length = trial.length if trial is not None and trial.passed else advice.nearby(settings.length)
    except ScanTrussError:
        return ""
    return f"; the largest piece alone gets a grid with --piece 1 --length {length:g}" if length is not None else ""
