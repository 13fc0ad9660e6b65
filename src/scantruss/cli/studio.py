"""The command ``scantruss studio``: the road from scan to structure in a browser."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError

if TYPE_CHECKING:
    from .options import Parser


def studio_parser() -> Parser:
    """Options of ``scantruss studio``."""
    from .options import Parser, add_force, whole_number

    parser = Parser(
        "studio",
        "[SCAN|PROJECT] [options]",
        "Open a page in the browser: length, grid, structure, files. A project is saved after each step.",
    )
    parser.add_argument("source", metavar="SCAN|PROJECT", nargs="?", help="a scan, or a project saved as .scantruss")
    parser.add_argument(
        "--project", metavar="FILE.scantruss", help="where the project is saved (default: NAME.scantruss here)"
    )
    parser.add_argument(
        "--port",
        metavar="NUMBER",
        type=whole_number,
        default=8080,
        help="port to listen on (default 8080); 0: any free one",
    )
    parser.add_argument(
        "--host", metavar="ADDRESS", default="127.0.0.1", help="address to listen on; from other machines a token is needed"
    )  # fmt: skip
    parser.add_argument("--no-open", action="store_true", help="do not open a browser")
    add_force(parser)
    return parser


def studio(values: Namespace) -> None:
    """Serve the page until it is interrupted."""
    from ..studio.server import check_viser

    check_viser()
    if not 0 <= values.port < 65536:
        raise InputError(f"--port needs a number from 0 to 65535, got {values.port}")
    project = project_of(values)
    import sys
    import time
    import webbrowser

    from ..report.terminal import print_lines
    from ..studio.browsers import Browsers
    from ..studio.server import address_to_open, serve_browsers, start_server
    from ..studio.session import Session

    session = Session(project, folder=Path.cwd())
    if values.source is not None:
        session.open(Path(values.source))
        session.show_quick()
    browsers = Browsers(session)
    server, guard = start_server(values.host, values.port)
    pages = serve_browsers(server, browsers)
    try:
        address = address_to_open(values.host, server.get_port(), guard.token)
        saved = f"saved as {project} after each step" if project is not None else "saved here as soon as a scan is open"
        print_lines([f"studio at {address}", f"the project is {saved}; end with Ctrl-C"])
        sys.stdout.flush()  # for whoever reads it from a pipe, as nothing else is said
        if not values.no_open:
            webbrowser.open(address)
        while True:  # until Ctrl-C or SIGTERM, as servers do
            time.sleep(3600.0)
    finally:
        browsers.stop()
        pages.stop()


def project_of(values: Namespace) -> Path | None:
    """Return where the project is saved; nowhere where neither a scan nor a place is named.

    Raises
    ------
    FormatError, InputError
        Nothing can be saved there, or another file is there.
    """
    from ..runtime.ours import check_ours
    from ..runtime.places import check_place

    suffix, source = ".scantruss", None if values.source is None else Path(values.source)
    opens = source is not None and source.suffix.lower() == suffix
    if source is not None and not source.is_file():
        raise InputError(f"there is no file {source}; name a scan or a project saved as {suffix}")
    if values.project is None:
        place = source if opens or source is None else Path(source.with_suffix(suffix).name)
    else:
        place = Path(values.project)
    if place is None:
        return None
    check_place(place, (suffix,))
    if place != source and place.exists():
        if not values.force:
            raise InputError(
                f"{place} exists already; open it with: scantruss studio {place}, or save elsewhere with --project"
            )
        check_ours(place, "result")
    return place
