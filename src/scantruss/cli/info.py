"""The command ``scantruss info``: what a scan holds, and which member lengths suit it."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from ..errors import OneSidedError, words_of_number
from .shared import (
    SCAN_HELP,
    add_memory,
    note_compiling,
    note_corners,
    note_layers,
    note_outliers,
    note_pieces,
    read_scan,
    settings_to_read,
    with_some_length,
)

if TYPE_CHECKING:
    from .options import Parser


def info_parser() -> Parser:
    """Options of ``scantruss info``."""
    from .options import DECIDING, READING, Parser, add_settings

    parser = Parser(
        "info",
        "SCAN [options]",
        "Print points, extent, spacing, noise and boundaries of a scan, and what some member lengths give.",
    )
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    add_memory(parser)
    add_settings(parser, ("length", "method", "thin_spacing", *READING))
    add_settings(parser, DECIDING, "the grid that is to be made of it")
    return parser


def info(values: Namespace) -> None:
    """Print what a scan holds."""
    from ..boundary.find import find_boundary
    from ..report.advice import Advice
    from ..report.figures import cloud_lines, loop_rows, surface_lines
    from ..report.lengths import advice_lines, advice_rows
    from ..report.terminal import Bars, print_lines, print_table
    from ..scan.member_length import check_length, length_range
    from ..surface.samples import sample_surface
    from .floors import words_of_floor
    from .largest_piece import words_of_largest_piece
    from .options import has_length, settings_of

    settings = settings_of(with_some_length(values))
    with Bars() as bars:
        settings = settings_to_read(values, settings, bars)
        cloud = read_scan(values.scan, settings, bars)
        print_lines(cloud_lines(cloud))
        low, high = length_range(cloud)
        if has_length(values):
            check_length(cloud, settings)
        elif low > high:  # no length is possible, as the lines say
            return
        words = ""  # of a way out where no length passes
        with note_compiling(bars):
            if not settings.length_field:
                advice = Advice(cloud, settings, bars)
                length = settings.length if has_length(values) else advice.suggest()
                print_table(*advice_rows(advice, length, cloud))
                print_lines(advice_lines(advice, length, cloud))
                if not advice.passes:
                    tried = settings.replace(length=length)
                    words = words_of_floor(bars, cloud, tried) or words_of_largest_piece(bars, cloud, tried)
                    print_lines([words.removeprefix("; ")] * bool(words))
                # a scan that looks one-sided as it is has the boundaries of the grid that passes
                passing = [trial.grid for trial in advice.tried if trial.passed and trial.length == length]
                made = passing[0].settings if passing and passing[0] is not None else None
                settings = (made or advice.settings).replace(length=length, effort=settings.effort)
            try:
                samples, boundary = find_boundary(sample_surface(cloud, settings), settings, progress=bars)
            except OneSidedError as error:
                if settings.length_field or (
                    not words and str(error) in {str(each.fault) for each in advice.tried if each.length == length}
                ):
                    raise
                return  # why no length passes was said, and it is another reason, or a way out was
        note_outliers(bars, cloud, settings, "scantruss grid")
        note_layers(bars, cloud, settings)
        note_pieces(bars, cloud, settings)
        note_corners(bars, cloud, settings)
    print_lines(surface_lines(cloud, samples))
    field = samples.surface.field
    longest = f" to {words_of_number(settings.length * field.max(), 4)}" if settings.length_field else ""
    print_lines([f"boundaries for members of {settings.length:g}{longest} {cloud.unit}".rstrip() + ":"])
    if boundary.loops:
        print_table(("boundary", "length", "corners"), loop_rows(boundary))
    else:
        print_lines(["none, the scan is closed"])
