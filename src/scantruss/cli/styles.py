"""Options of how files are written where their formats leave a choice: views of pictures, decimal commas, what an OBJ holds."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING, Any

from ..export.drawing.style import VIEWS
from ..export.style import OBJ_ELEMENTS, FileStyle

if TYPE_CHECKING:
    from argparse import _ArgumentGroup

    Options = ArgumentParser | _ArgumentGroup


def add_styles(parser: ArgumentParser) -> None:
    """Add the options of the files of a grid: pictures, OBJ and tables."""
    from .options import picture_size

    styles = parser.add_argument_group("pictures and tables")
    styles.add_argument(
        "--view",
        dest="views",
        metavar="NAME",
        action="append",
        help=f"side from which a picture is taken: {', '.join(VIEWS)} or AZIMUTH,ELEVATION in degrees; repeatable, side by side",
    )
    styles.add_argument("--size", metavar="WIDTHxHEIGHT", type=picture_size, help="size of a picture in pixels")
    styles.add_argument(
        "--obj", metavar="|".join(OBJ_ELEMENTS), default="faces", help="what .obj holds: triangles, members, or both"
    )
    add_decimal_comma(styles)


def add_decimal_comma(parser: Options) -> None:
    """Add the option of tables with decimal commas."""
    parser.add_argument(
        "--decimal-comma", action="store_true", help="write .csv with decimal commas and semicolons between columns"
    )


def style_of(values: Namespace, **more: Any) -> FileStyle:
    """Return the styles of the files, as the options say."""
    views = tuple(values.views or ("auto",))
    return FileStyle(views=views, size=values.size, obj=values.obj, decimal_comma=values.decimal_comma, **more)
