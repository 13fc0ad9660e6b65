"""The table of formats in which grids and structures are written and read, `write` and `read_model`.

A format is one module with an encoder (and a reader, where it has one) and one row here, which names its functions: a module is
imported when a file of its format is written or read. Where an extra is not installed, that is said before any work.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FormatError, InputError
from ..grid.grid import Grid
from ..grid.upward import picture_notes
from ..runtime.files import write_files
from ..runtime.memory import nothing_collected
from ..runtime.ours import FORCE_ARGUMENT, check_ours
from ..runtime.places import check_place, nearest_suffix, suffix_of
from ..scan.cloud import PointCloud
from ..scan.formats.extras import need_library
from ..settings import UNITS
from .csv import encode_csv, nodes_path
from .model import Model, members_of, model_of_grid, model_of_truss
from .style import PAGE_POINTS, FileStyle

if TYPE_CHECKING:
    from ..structure.report import StructureReport
    from ..structure.results import Solution
    from ..structure.truss import Truss
    from .drawing_in import Drawing

Encoder = Callable[[Model, Path, FileStyle], dict[Path, bytes]]

GRID, STRUCTURE = "grid", "structure"


@dataclass(frozen=True)
class FileFormat:
    """What is known of a format."""

    name: str
    encode: Encoder | None  #: what its files hold: a pure function of the model
    loses: str = ""  #: what it cannot hold of a grid or a structure
    loses_of_structure: str = ""  #: what it cannot hold of a structure besides
    most_points: int = -1  #: of a scan that it holds; a scan with no more loses nothing
    holds: tuple[str, ...] = (GRID, STRUCTURE)
    needs_unit: bool = False  #: whether a grid without a unit is refused
    wants_system: bool = False  #: whether programs need the reference system to place it
    read: Callable[[Path], Model] | None = None
    draw: Callable[[Path], Drawing] | None = None  #: reads lines and faces from other programs
    library: str = ""  #: module that must be installed
    extra: str = ""  #: of pyproject.toml, which brings it
    reads_with: str = ""  #: module that must be installed to read; its extra is `extra`


def function(name: str) -> Callable[..., Any]:
    """Return the function of this package, such as "dxf.encode_dxf", that imports its module when it is called."""
    module, called = name.rsplit(".", 1)

    def call(*arguments: Any, **options: Any) -> Any:
        return getattr(import_module(f".{module}", __package__), called)(*arguments, **options)

    return call


def one(encode: str) -> Encoder:
    """Return the encoder of a format with one file; `encode` is given the model and the style."""
    return lambda model, path, style: {path: function(encode)(model, style)}


NO_MARKS = "triangles, marks or results (nodes and members are counted from 1)"
NO_STRUCTURE = "sections, supports, loads or results"

#: suffix -> format
FORMATS: dict[str, FileFormat] = {
    ".csv": FileFormat(
        "CSV",
        lambda model, path, style: encode_csv(model, path, style),
        loses="panels",
        loses_of_structure=NO_STRUCTURE,
    ),
    ".json": FileFormat("JSON", lambda model, path, style: {path: function("json.encode_model")(model)},
                        read=function("json.read_json")),
    ".obj": FileFormat("OBJ", lambda model, path, style: {path: function("obj.encode_obj")(members_of(model), style.obj)},
                       draw=function("drawing_files.draw_obj"), loses="marks or groups", loses_of_structure=NO_STRUCTURE),
    ".ply": FileFormat("PLY", lambda model, path, style: {path: function("ply.encode_ply")(members_of(model))},
                       draw=function("drawing_files.draw_ply"), loses="marks or groups", loses_of_structure=NO_STRUCTURE),
    ".png": FileFormat("PNG", lambda model, path, style: {
        path: function("drawing.picture.encode_picture")(model.as_grid("PNG"), model.cloud, style=style)}, holds=(GRID,)),
    ".3dm": FileFormat("3DM", one("rhino.encode_3dm"), draw=function("drawing_files.draw_3dm"),
                       loses_of_structure="loads or results", library="rhino3dm", extra="cad"),
    ".3mf": FileFormat("3MF", one("solid_bodies.encode_3mf_bodies"), holds=(STRUCTURE,),
                       loses_of_structure="panels, exact coordinates (m from the origin), supports, loads or results"),
    ".compas.json": FileFormat("COMPAS JSON", one("compas.encode_compas"), draw=function("compas.draw_compas"),
                                loses_of_structure="loads, releases or results"),
    ".dxf": FileFormat("DXF", one("dxf.encode_dxf"), draw=function("drawing_files.draw_dxf"),
                       loses_of_structure="loads or results", library="ezdxf", extra="cad"),
    ".geojson": FileFormat("GeoJSON", one("geojson.encode_geojson"), wants_system=True,
                           loses_of_structure="stiffness, loads, displacements or reactions"),
    ".glb": FileFormat("GLB", one("glb.encode_glb"), loses="marks or exact coordinates (float32, relative to the origin)",
                       loses_of_structure="supports, loads or forces"),
    ".html": FileFormat("HTML", one("page.encode_page"), loses=f"more than {PAGE_POINTS:,} points of the scan", most_points=PAGE_POINTS,
                        loses_of_structure="loads"),
    ".ifc": FileFormat("IFC", one("ifc.encode_ifc"), needs_unit=True, draw=function("ifc_in.draw_ifc"),
                       reads_with="ifcopenshell", extra="bim"),
    ".inp": FileFormat("Abaqus", one("abaqus.encode_inp"), holds=(STRUCTURE,), loses_of_structure=NO_MARKS),
    ".karamba.json": FileFormat("JSON for Karamba", one("karamba.encode_karamba"), loses_of_structure="releases or results"),
    ".py": FileFormat("OpenSees", one("opensees.encode_py"), holds=(STRUCTURE,), loses_of_structure=NO_MARKS),
    ".s2k": FileFormat("SAP2000", one("s2k.encode_s2k"), holds=(STRUCTURE,), loses_of_structure="triangles or results"),
    ".saf.xlsx": FileFormat("SAF", one("saf.encode_saf"), holds=(STRUCTURE,),
                            loses_of_structure="triangles, displacements, reactions or more than a million rows of forces"),
    ".step": FileFormat("STEP", one("step.encode_step"), loses="panels", loses_of_structure=NO_STRUCTURE, needs_unit=True),
    ".stp": FileFormat("STEP", one("step.encode_step"), loses="panels", loses_of_structure=NO_STRUCTURE, needs_unit=True),
    ".stl": FileFormat("STL", one("solid_bodies.encode_stl_bodies"), holds=(STRUCTURE,),
                       loses_of_structure="panels, marks, exact coordinates (mm from the origin), supports, loads or results"),
    ".tcl": FileFormat("OpenSees", one("opensees.encode_tcl"), holds=(STRUCTURE,), loses_of_structure=NO_MARKS),
    ".xlsx": FileFormat("XLSX", one("tables.encode_xlsx_model")),
    ".vtu": FileFormat("VTU", one("vtu.encode_vtu"), loses="marks (members are counted from 0)", loses_of_structure="loads"),
}  # fmt: skip

SOLID_SUFFIXES = (".3mf", ".stl")


def suffixes_of(kind: str = "") -> list[str]:
    """Return the suffixes in which a grid, a structure or either ("") is written, sorted."""
    return sorted(suffix for suffix, row in FORMATS.items() if row.encode and (not kind or kind in row.holds))


def check_output(path: str | Path, kind: str = GRID, also: tuple[str, ...] = ()) -> Path:
    """Return the path if a grid or a structure can be written there; called before the long work starts.

    Parameters
    ----------
    path : str or Path
    kind : str
        "grid", "structure" or either, "".
    also : tuple of str
        Suffixes of files that are written besides those of the table.

    Raises
    ------
    FormatError
        The suffix is unknown, its extra is not installed, the folder does not exist or cannot be written to, or a folder has this name.
    """
    path, known = Path(path), suffixes_of(kind)
    if path.suffix.lower() in also:
        return check_place(path, also)
    what = f"a {kind or 'grid or structure'}"
    if path.suffix.lower() in SOLID_SUFFIXES and path.suffix.lower() not in known:
        raise FormatError(
            f'no format for "{path.suffix}" of {what}; use one of {" ".join(known)}, '
            f"or write a .json and make the solid from it with: scantruss print"
        )
    if suffix_of(path, FORMATS) not in ("", *known) and kind == GRID:
        raise FormatError(
            f"{FORMATS[suffix_of(path, FORMATS)].name} holds structures; make one of the grid with: scantruss structure"
        )
    path = check_place(path, [*known, *also])
    row = FORMATS[suffix_of(path, known)]
    check_library(row)
    if path.suffix.lower() == ".csv":
        check_place(nodes_path(path), (".csv", path.suffix))
    return path


def check_model_unit(path: Path, unit: str) -> None:
    """Refuse a format that needs a unit, of a grid that has none; called as soon as that is known.

    Raises
    ------
    FormatError
        The message says how to give one.
    """
    row = FORMATS[suffix_of(path, FORMATS)]
    if row.needs_unit and not unit:
        known = "|".join(name for name in UNITS if name)
        raise FormatError(f"{row.name} needs a unit, and that of the grid is not known; give it with --unit {known}")


def check_library(row: FileFormat, *, reading: bool = False) -> None:
    """Refuse a format whose library is not installed.

    Raises
    ------
    FormatError
        It is missing; the message has the command that installs it.
    """
    library = row.reads_with or row.library if reading else row.library
    need_library(row.name, library, row.extra)


def losses(model: Model, path: str | Path) -> list[str]:
    """Return the note on what the format of a path does not hold of a model; none where it holds all."""
    row = FORMATS[suffix_of(Path(path), FORMATS)]
    points = 0 if model.cloud is None else len(model.cloud.points)
    lost = [
        row.loses if points > row.most_points else "",
        *([row.loses_of_structure] if model.truss is not None else []),
    ]
    words = ", ".join(each for each in lost if each)
    unplaced = f"the reference system is not known, so {row.name} names none; give it with --system EPSG:CODE"
    return [f"{row.name} holds no {words}"] * bool(words) + [unplaced] * (row.wants_system and not model.system)


def shown_otherwise(model: Model, path: str | Path) -> list[str]:
    """Return a note where a picture of a grid shows another axis up than z, which all files have up; none of other formats."""
    is_of_grid = suffix_of(Path(path), FORMATS) == ".png" and model.truss is None and model.grid is not None
    return picture_notes(model.grid, model.cloud) if is_of_grid and model.grid is not None else []


def model_of(
    what: Grid | Truss | Solution | Model, *, cloud: PointCloud | None = None, report: StructureReport | None = None
) -> Model:
    """Return the model of a grid, a structure or its results."""
    if isinstance(what, Model):
        return what
    if isinstance(what, Grid):
        return model_of_grid(what, cloud)
    from ..structure.truss import Truss  # which grids do not load

    if isinstance(what, Truss):
        return model_of_truss(what)
    if not hasattr(what, "truss"):
        raise InputError(f"a grid, a structure or its solution is needed, got {type(what).__name__}")
    return model_of_truss(what.truss, what, report)


def write(
    what: Grid | Truss | Solution | Model,
    path: str | Path,
    *,
    cloud: PointCloud | None = None,
    style: FileStyle | None = None,
    report: StructureReport | None = None,
    force: bool = False,
) -> list[Path]:
    """Write a grid or a structure; the suffix of the path names the format.

    Parameters
    ----------
    what : Grid, Truss, Solution or Model
        What to write; a Solution is a structure with its results.
    path : str or Path
        File ending in a suffix of `FORMATS`, such as .json, .dxf, .ifc or .saf.xlsx.
    cloud : PointCloud, optional
        The scan, drawn in pictures.
    style : FileStyle, optional
        Choices that formats leave open: views and size of a picture, faces or lines in OBJ, decimal comma in CSV, bodies in IFC.
    report : StructureReport, optional
        Of a Solution: the utilization of its members.
    force : bool
        Whether to write over a file that ScanTruss did not write, as its content tells.

    Returns
    -------
    list of Path
        The files written; two for .csv, one otherwise.

    Raises
    ------
    FormatError
        Unknown suffix, an extra that is not installed, no such folder, no space, or a file of somebody else there; nothing
        half-written is left.
    """
    if not isinstance(path, str | Path):
        raise FormatError(f"write needs a grid or structure, then a file name, got {type(path).__name__} as the file")
    model = model_of(what, cloud=cloud, report=report)
    path = check_output(path, GRID if model.truss is None else STRUCTURE)
    check_model_unit(path, model.unit)
    if not force:
        check_ours(path, "result", FORCE_ARGUMENT)
    encode = FORMATS[suffix_of(path, suffixes_of())].encode
    assert encode is not None  # `check_output` knows only formats that are written
    with nothing_collected():
        return write_files(encode(model, path, style or FileStyle()), force=force)


def read_model(path: str | Path, merge: float | None = None) -> Model:
    """Read a grid or a structure; the suffix of the path names the format.

    Parameters
    ----------
    path : str or Path
        A .json that `scantruss grid` or `scantruss structure` wrote (a structure with load cases is solved again), or lines and faces
        from another program: .obj, .ply, .dxf, .3dm, .ifc, .compas.json. The notes of the model say what was found in these.
    merge : float, optional
        Ends of such lines closer than this become one node; by default a thousandth of their median length.

    Raises
    ------
    FormatError
        Unknown suffix, an extra that is not installed, the file cannot be read, or it is not a grid.
    """
    path = Path(path)
    known = {suffix: row for suffix, row in FORMATS.items() if row.read or row.draw}
    row = known.get(suffix_of(path, known))
    if row is None:
        raise FormatError(
            f'no reader for "{path.suffix or path.name}"; use one of {" ".join(sorted(known))}{nearest_suffix(path, known)}'
        )
    if not path.is_file():
        raise FormatError(f"there is no file {path}; name a grid or a structure, such as one saved as .json")
    check_library(row, reading=True)
    if row.draw is None:
        assert row.read is not None
        return row.read(path)
    from .drawing_in import grid_of_drawing

    grid, notes = grid_of_drawing(row.draw(path), path.name, merge)
    return replace(model_of_grid(grid), notes=notes)
