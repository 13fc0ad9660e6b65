"""The command ``scantruss info``: what a scan holds, and which lengths of members it carries."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from .shared import SCAN, add_memory, note_compiling, note_outliers, read_scan, thin_to_fit

if TYPE_CHECKING:
    from .options import Parser


def info_parser() -> Parser:
    """Options of ``scantruss info``."""
    from .options import READING, Parser, add_settings

    parser = Parser(
        "info", "SCAN [options]", "Points, extent, spacing and boundaries of a scan, and a sensible range for --length."
    )
    parser.add_argument("scan", metavar="SCAN", help=SCAN)
    add_memory(parser)
    add_settings(parser, ("length", "method", "thin_spacing", *READING))
    return parser


def info(values: Namespace) -> None:
    """Print what a scan holds."""
    from ..report.figures import cloud_lines, loop_rows
    from ..report.terminal import Bars, print_lines, print_table
    from ..scan.member_length import check_length, suggest_length
    from .options import settings_of

    given = "length" in values
    settings = settings_of(values if given else Namespace(**vars(values), length=1.0))
    with Bars() as bars:
        settings = thin_to_fit(values.scan, settings, values.memory)
        if settings.thin_spacing and not given and "thin_spacing" not in values:
            from ..scan.stream.fit import spacing_to_look

            settings = settings.replace(thin_spacing=spacing_to_look(values.scan, settings, bars))
        cloud = read_scan(values.scan, settings, bars)
        print_lines(cloud_lines(cloud))
        settings = settings if given else settings.replace(length=suggest_length(cloud))
        check_length(cloud, settings)
        with note_compiling(bars):
            from ..boundary.find import find_boundary
            from ..surface.samples import sample_surface

            samples, boundary = find_boundary(sample_surface(cloud, settings), settings, progress=bars)
        note_outliers(bars, cloud, settings, "scantruss grid")
    field = samples.surface.field
    longest = f" to {settings.length * field.max():.4g}" if settings.length_field else ""
    print_lines([f"boundaries for members of {settings.length:g}{longest} {cloud.unit}".rstrip() + ":"])
    if boundary.loops:
        print_table(("boundary", "length", "corners"), loop_rows(boundary))
    else:
        print_lines(["none, the scan is closed"])
