"""From a 3D scan straight to a free-form grid truss (Ding, Xu and Luo 2017).

In one call: `grid_from_scan(path, settings)` or `grid_from_points(points, settings)`, with `Settings(length=...)`; then `write`.
Step by step: `read_points` (and `clean_points`), `sample_surface`, `find_boundary`, `find_constraints`, `orientation_fields`,
`advance_fronts`, `optimize_fronts`. A `Grid` has nodes, triangles, members, `quality` and, if it was checked, a `certificate`.
`print_model` writes a solid for printing, `schedule` lists what a workshop makes. What cannot be done raises a `ScanTrussError`:
`InputError`, `FormatError`, `FrontError` or `CertificateError`.
"""

import os
import sys


def end_at_once(*_: object) -> None:
    """Answer Ctrl-C in one line before `runtime.stopping` does: nothing is there yet to be cleaned up."""
    os.write(2, b"scantruss: interrupted; nothing was written\n")
    os._exit(130)


def _is_command() -> bool:
    """Whether this is the first import of a process started as `scantruss` or `python -m scantruss`, not of a program that uses us."""
    if sys.argv[:1] == ["-m"]:  # so it is while a module is being found that is to be run
        return "-m scantruss" in " ".join(sys.orig_argv)
    return "".join(sys.argv[:1]).replace(os.sep, "/").rpartition("/")[2] in ("scantruss", "scantruss.exe")


if _is_command():
    # what `signal` is made of: that takes as long to import as all else until here
    import _signal  # type: ignore[import-not-found]

    # what is ignored stays so, as in the background of a shell
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
        _signal.signal(_signal.SIGINT, end_at_once)

TYPE_CHECKING = False  # typing takes as long to import as all else until Ctrl-C is listened to
if TYPE_CHECKING:  # a name is imported when it is first used, so that the command line starts quickly
    from typing import Any

    from .boundary.find import Boundary as Boundary
    from .boundary.find import find_boundary as find_boundary
    from .candidates import advance_fronts as advance_fronts
    from .candidates import optimize_fronts as optimize_fronts
    from .check.certify import certify as certify
    from .constraints.find import find_constraints as find_constraints
    from .errors import CertificateError as CertificateError
    from .errors import FormatError as FormatError
    from .errors import FrontError as FrontError
    from .errors import InputError as InputError
    from .errors import ScanTrussError as ScanTrussError
    from .export.formats import read_model as read_model
    from .export.formats import write as write
    from .export.json import read_grid as read_grid
    from .export.printed.write import PrintedParts as PrintedParts
    from .export.printed.write import print_parts as print_parts
    from .export.solid import print_model as print_model
    from .export.style import FileStyle as FileStyle
    from .front.advance import advance_front as advance_front
    from .front.orientation_field import orientation_fields as orientation_fields
    from .grid.certificate import Certificate as Certificate
    from .grid.grid import Grid as Grid
    from .grid.quality import GridQuality as GridQuality
    from .grid.topology import Topology as Topology
    from .improve.optimize import optimize_grid as optimize_grid
    from .layouts.alike import PartKinds as PartKinds
    from .layouts.double_layer import DoubleLayer as DoubleLayer
    from .layouts.double_layer import double_layer as double_layer
    from .layouts.families import Families as Families
    from .layouts.families import few_lengths as few_lengths
    from .layouts.joints_alike import few_joints as few_joints
    from .layouts.panels_alike import few_panels as few_panels
    from .pipeline import grid_from_points as grid_from_points
    from .pipeline import grid_from_scan as grid_from_scan
    from .scan.clean.steps import CleanCloud as CleanCloud
    from .scan.clean.steps import clean_points as clean_points
    from .scan.cloud import PointCloud as PointCloud
    from .scan.formats.reading import read_points as read_points
    from .schedules.files import write_schedules as write_schedules
    from .schedules.make import schedule as schedule
    from .schedules.records import Schedule as Schedule
    from .schedules.records import Schedules as Schedules
    from .schedules.settings import ScheduleSettings as ScheduleSettings
    from .setout.files import write_setting_out as write_setting_out
    from .setout.make import SettingOut as SettingOut
    from .setout.make import set_out as set_out
    from .setout.settings import SetoutSettings as SetoutSettings
    from .settings import Settings as Settings
    from .structure.json import read_structure as read_structure
    from .structure.nonlinear import solve_path as solve_path
    from .structure.statics import solve as solve
    from .structure.truss import Truss as Truss
    from .surface.samples import sample_surface as sample_surface

__version__ = "0.1.0"

_HOMES = {
    "ScanTrussError": "errors", "InputError": "errors", "FrontError": "errors", "FormatError": "errors",
    "CertificateError": "errors",
    "Settings": "settings",
    "PointCloud": "scan.cloud", "read_points": "scan.formats.reading",
    "clean_points": "scan.clean.steps", "CleanCloud": "scan.clean.steps",
    "sample_surface": "surface.samples",
    "Boundary": "boundary.find", "find_boundary": "boundary.find",
    "find_constraints": "constraints.find",
    "orientation_fields": "front.orientation_field",
    "advance_front": "front.advance", "advance_fronts": "candidates", "optimize_fronts": "candidates",
    "Grid": "grid.grid", "GridQuality": "grid.quality", "Topology": "grid.topology",
    "optimize_grid": "improve.optimize",
    "Certificate": "grid.certificate", "certify": "check.certify",
    "grid_from_points": "pipeline", "grid_from_scan": "pipeline",
    "write": "export.formats", "read_model": "export.formats", "FileStyle": "export.style", "read_grid": "export.json",
    "few_lengths": "layouts.families", "Families": "layouts.families",
    "few_joints": "layouts.joints_alike", "few_panels": "layouts.panels_alike", "PartKinds": "layouts.alike",
    "double_layer": "layouts.double_layer", "DoubleLayer": "layouts.double_layer",
    "print_model": "export.solid", "print_parts": "export.printed.write", "PrintedParts": "export.printed.write",
    "schedule": "schedules.make", "ScheduleSettings": "schedules.settings", "write_schedules": "schedules.files",
    "Schedule": "schedules.records", "Schedules": "schedules.records",
    "set_out": "setout.make", "SettingOut": "setout.make", "SetoutSettings": "setout.settings",
    "write_setting_out": "setout.files",
    "Truss": "structure.truss", "solve": "structure.statics", "solve_path": "structure.nonlinear", "read_structure": "structure.json",
}  # fmt: skip

__all__ = sorted([*_HOMES, "__version__"])


def __getattr__(name: str) -> "Any":
    """Import a public name on first use, so that the command line starts quickly."""
    if name not in _HOMES:
        raise AttributeError(f"module 'scantruss' has no attribute {name!r}")
    import importlib

    _show_in_notebooks()
    return getattr(importlib.import_module(f"scantruss.{_HOMES[name]}"), name)


def _show_in_notebooks() -> None:
    """Show grids and clouds as pictures where a notebook or IPython runs us."""
    if "IPython" in sys.modules and (shell := sys.modules["IPython"].get_ipython()) is not None:
        import importlib

        importlib.import_module("scantruss.report.notebook").show_pictures(shell)


def __dir__() -> list[str]:
    return __all__
