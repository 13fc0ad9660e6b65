"""The command line: it reads the arguments, and is the only place that reports errors and exits.

A refusal is one line on stderr and an exit status of `HELP`; nothing is written then. Heavy imports wait for a command.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial

from .. import __version__
from ..errors import CertificateError, InputError, ScanTrussError, did_you_mean, words_of_error
from ..runtime.stopping import SIGNAL_STATUS, asked, note_printed, signals_heard, words_of_stop

HELP = f"""\
scantruss {__version__}: from a 3D scan straight to a grid truss with nearly equal members

  scantruss info  SCAN                     points, extent, spacing, boundaries and a suitable --length
  scantruss clean SCAN OUT                 remove duplicates, outliers, loose pieces, doubled layers and noise
  scantruss grid  SCAN OUT [OUT ...] --length L
                                           make the grid; the suffix of each OUT names its format
  scantruss thin  SCAN... -o OUT --spacing S
                                           thin a scan of any size while reading it, to one point per box
  scantruss sweep SCAN --length 3,4,5 --effort quick,normal -o FOLDER
                                           make many grids to choose from: a table and pictures
  scantruss print GRID OUT.3mf|OUT.stl --member-diameter D --node-diameter D [--scale S]
                                           turn a grid saved as .json into one watertight solid, or
                                           (--bed, --sockets) into parts with plug joints, or balls for rods
  scantruss families GRID OUT [OUT ...]    move the nodes along the surface, so that members have few lengths
  scantruss schedule GRID|STRUCTURE OUT.xlsx|OUT.csv [--tube DxT]
                                           list nodes, members and panels as a workshop needs them
  scantruss setout GRID|STRUCTURE OUT.dxf|OUT.pdf|OUT.csv [--supports corners]
                                           set out supports (for a grid: --supports), heights and boundaries,
                                           and the order of assembly
  scantruss structure GRID OUT.json --supports corners --loads self,snow:1kN/m2
                                           forces, displacements and checks of the grid as a structure
  scantruss convert FILE OUT [OUT ...]     write a saved grid or structure for other programs: .dxf, .ifc, .saf.xlsx ...
  scantruss studio [SCAN|PROJECT]          do all of this in a browser (extra studio)
  scantruss splice SCAN SCAN [SCAN ...] -o OUT
                                           align overlapping scans and merge them into one cloud
  scantruss demo  [FOLDER]                 run it all on a bundled scan, a shell or (--scan bust) a bust
  scantruss completion bash|zsh|fish       print a script that lets your shell complete commands and options

scantruss COMMAND --help lists the options of a command; --version prints the version.

Exit status (if it is not 0, one line says why):
  0    done
  1    a bug in ScanTruss
  2    the scan, a setting or a file cannot be used
  3    the grid fails its checks; it is written only with --keep-failed
  130  interrupted (Ctrl-C)
  141  the reader of the output has gone, as in "| head -1" (no line)
  143  terminated (SIGTERM)
"""


def run(words: Sequence[str]) -> None:
    """Run one command."""
    if not words or words[0] in ("-h", "--help", "help"):
        print(HELP, end="")
        return
    if words[0] in ("--version", "-V"):
        print(f"scantruss {__version__}")
        return
    from ..runtime.memory import made_before_set_aside, nothing_collected

    with ExitStack() as stack:
        with nothing_collected():
            command = command_of(words)
            stack.enter_context(made_before_set_aside())  # here: the first search after this block would go through all
        if command is not None:
            command()


def command_of(words: Sequence[str]) -> Callable[[], None] | None:
    """Return a command with all that it needs imported; None where only its help was asked for, and is printed."""
    from .commands import COMMANDS

    if words[0] not in COMMANDS:
        raise InputError(
            f"no command {words[0]!r}{did_you_mean(words[0], COMMANDS)}; use one of {' '.join(COMMANDS)}, or --help"
        )
    make_parser, command = COMMANDS[words[0]]
    parser = make_parser()
    if "-h" in words or "--help" in words:
        print(parser.format_help(), end="")
        return None
    values = parser.read(words[1:])
    from ..report import terminal

    terminal.quiet = values.quiet
    import_numba_without_blas()
    return partial(command, values)


def import_numba_without_blas() -> None:
    """Import numba without scipy, of which it imports a part if that is installed: that takes a seventh of a short command.

    Only matrix products in kernels need it, and there are none.
    """
    absent = {name for name in ("scipy", "scipy.linalg.cython_blas") if name not in sys.modules}
    if absent:
        sys.modules.update(dict.fromkeys(absent))  # type: ignore[arg-type]  # as if they could not be imported
        try:
            import numba.np.arraymath  # noqa: F401
        finally:
            for name in absent:
                del sys.modules[name]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after the name of the program; `sys.argv` by default.
    """
    try:
        with signals_heard():
            try:
                run(sys.argv[1:] if arguments is None else arguments)
                sys.stdout.flush()
            except BaseException as error:
                return end(error)
    except KeyboardInterrupt as error:  # while another end was reported
        return end(error)
    return 0


def end(error: BaseException) -> int:
    """Say why a command has ended early and return the exit status; what says nothing in words is raised again."""
    if (number := asked()) is not None:  # whoever was interrupted may have made another error of it
        return refuse(words_of_stop(number), SIGNAL_STATUS[number])
    if isinstance(
        error, BrokenPipeError
    ):  # the reader of the output has gone, as in `scantruss info scan.ply | head -1`
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 141
    if isinstance(error, KeyboardInterrupt):
        return refuse(words_of_stop(signal.SIGINT), SIGNAL_STATUS[signal.SIGINT])
    if isinstance(error, ScanTrussError):
        return refuse(words_of_error(error), 3 if isinstance(error, CertificateError) else 2)
    if isinstance(error, OSError):
        names = " -> ".join(str(name) for name in (error.filename, error.filename2) if name)
        return refuse(f"{error.strerror or error}{f': {names}' if names else ''}")
    if isinstance(error, MemoryError):
        return refuse("not enough memory; use fewer points or a larger --length")
    if os.environ.get("SCANTRUSS_TRACEBACK") or not isinstance(error, Exception):
        raise error
    words = f"{type(error).__name__}: {error}"
    return refuse(f"a bug in ScanTruss, {words}; please report it with what SCANTRUSS_TRACEBACK=1 shows", 1)


def refuse(message: str, status: int = 2) -> int:
    """Print the reason in one line and return the exit status."""
    note_printed()
    print("scantruss:", " ".join(message.split()), file=sys.stderr)
    return status
