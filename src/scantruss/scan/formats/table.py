"""The table of formats: suffix, what reads it, what writes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from .content import Cloud, Content
from .dxf_points import read_dxf_points
from .e57 import read_e57
from .geotiff import read_geotiff
from .gltf import read_gltf
from .las import read_las, write_las
from .mesh import read_obj, read_off, read_stl
from .numpy_ import read_npy, read_npz, write_npy, write_npz
from .parquet import read_parquet
from .pcd import read_pcd, write_pcd
from .ply import read_ply, write_ply
from .ptx import read_ptx
from .raster import read_asc
from .text import read_text, write_text
from .threemf import read_3mf
from .vtk_xml import read_vtk_xml

Reader = Callable[[Path, Sequence[str]], Content]  # path and wanted attributes
Writer = Callable[[Path, Cloud], None]


class Format(NamedTuple):
    """One format of scans."""

    read: Reader  #: returns the points and the wanted attributes of a file
    write: Writer | None = None  #: None if the format is only read


SCAN_FORMATS = {
    ".ply": Format(read_ply, write_ply),
    ".las": Format(read_las, write_las),
    ".laz": Format(read_las, write_las),
    ".e57": Format(read_e57),
    ".pcd": Format(read_pcd, write_pcd),
    ".xyz": Format(read_text, write_text),
    ".txt": Format(read_text, write_text),
    ".csv": Format(read_text, write_text),
    ".pts": Format(read_text),
    ".ptx": Format(read_ptx),
    ".asc": Format(read_asc),
    ".npy": Format(read_npy, write_npy),
    ".npz": Format(read_npz, write_npz),
    ".parquet": Format(read_parquet),
    ".obj": Format(read_obj),
    ".stl": Format(read_stl),
    ".glb": Format(read_gltf),
    ".gltf": Format(read_gltf),
    ".3mf": Format(read_3mf),
    ".vtp": Format(read_vtk_xml),
    ".vtu": Format(read_vtk_xml),
    ".tif": Format(read_geotiff),
    ".tiff": Format(read_geotiff),
    ".dxf": Format(read_dxf_points),
    ".off": Format(read_off),
}
READERS = {suffix: own.read for suffix, own in SCAN_FORMATS.items()}
WRITERS = {suffix: own.write for suffix, own in SCAN_FORMATS.items() if own.write}
PACKED = ".gz"  # behind any of them
