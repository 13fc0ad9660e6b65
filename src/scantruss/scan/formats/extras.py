"""Libraries that an extra brings: refused in one line where they are not installed."""

from __future__ import annotations

from importlib.util import find_spec

from ...errors import FormatError, how_to_install


def need_library(what: str, library: str, extra: str) -> None:
    """Refuse a format whose library is not installed.

    Raises
    ------
    FormatError
        It is missing; the message has the command that installs it.
    """
    if library and find_spec(library) is None:
        raise FormatError(f"{what} needs {library}, which is not installed; install it with: {how_to_install(extra)}")
