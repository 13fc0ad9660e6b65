"""The kind of a file by its first bytes, so that a wrong suffix is refused with a clear message."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...errors import FormatError, ScanTrussError

BYTES_OF_KIND = 4096  # bytes examined

_SIGNATURES = (
    (b"ply\n", "a PLY file"),
    (b"ply\r", "a PLY file"),
    (b"LASF", "a LAS or LAZ file"),
    (b"\x93NUMPY", "an NPY file"),
    (b"ASTM-E57", "an E57 file"),
    (b"PK\x03\x04", "a zip archive"),
    (b"PK\x05\x06", "a zip archive"),
    (b"PAR1", "a Parquet file"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive"),
    (b"Rar!", "a RAR archive"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"\x89PNG", "a PNG picture"),
    (b"GIF8", "a GIF picture"),
    (b"II*\x00", "a TIFF picture"),
    (b"MM\x00*", "a TIFF picture"),
    (b"%PDF", "a PDF document"),
    (b"{\\rtf", "an RTF document"),
    (b"glTF", "a glTF file"),
    (b"\xd0\xcf\x11\xe0", "an old Office document"),
    (b"\x7fELF", "a program"),
    (b"MZ\x90", "a program"),
)
_TEXTS = (
    (rb"\s*<(!doctype\s+html|html|head|body)", "a web page"),
    (rb"\s*<(\?xml|svg)", "an XML file"),
    (rb"(\s*#[^\n]*\n)*\s*VERSION\s[^\n]*\n(\s*#[^\n]*\n)*\s*(FIELDS|COLUMNS)\s", "a PCD file"),
    (rb"# \.PCD", "a PCD file"),
    (rb"solid\b[^\n]*\n\s*(facet|endsolid)\b", "an STL file"),
    (rb"(\s*#[^\n]*\n)*\s*(ST)?C?N?4?n?OFF\b", "an OFF file"),
    (rb"\s*ncols\s+\d+\s+nrows\s+\d+", "a raster (ESRI ASCII grid)"),
    (rb"(?s)(.*\n)?v[ \t]+[-+.\d]+[ \t]+[-+.\d][^\n]*\n", "an OBJ file"),
    (rb"(?s)\s*(\[\s*[\[{\"\d-]|{\s*\").*[\]\":,]", "a JSON file"),
)


def read_head(path: Path) -> bytes:
    """Return the first bytes of a file; FormatError where it is missing, a folder or empty."""
    try:
        if path.is_dir():
            raise FormatError(f"{path} is a folder; name a scan file, or a pattern such as '{path}/*.laz'")
        if not path.exists():
            raise FormatError(f"{path} does not exist; check the name of the scan")
        with path.open("rb") as file:
            head = file.read(BYTES_OF_KIND)
    except (OSError, ValueError) as error:
        raise FormatError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not head:
        raise FormatError(f"{path} is empty; a scan with at least 3 points is needed")
    return head


def kind_of(head: bytes) -> str:
    """Return the kind of a file by its first bytes; "" if they are of no known one."""
    for signature, kind in _SIGNATURES:
        if head.startswith(signature):
            return kind
    text = head.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    for pattern, kind in _TEXTS:
        if re.match(pattern, text, re.IGNORECASE if kind in ("a web page", "a raster (ESRI ASCII grid)") else 0):
            return kind
    return ""


def is_text(head: bytes) -> bool:
    """Return whether the first bytes are text (UTF-8, UTF-16 with a mark, or one byte a letter)."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return True
    control = sum(byte < 32 and byte not in b"\t\n\r\f\v\x1a\x1b" for byte in head)
    return control == 0


def wrong_kind(path: Path, head: bytes, wanted: str) -> FormatError:
    """Return the error for a file that is not what its suffix says."""
    kind = kind_of(head) or ("plain text" if is_text(head) else "other binary data")
    return FormatError(f"{path} is not {wanted} but {kind}; give it the suffix of what it is, or export the scan again")


@contextmanager
def reading_as(path: Path, kind: str) -> Iterator[None]:
    """Say in one line that a library cannot read a file; our own errors, and those not caused by the file, pass unchanged."""
    try:
        yield
    except (ScanTrussError, MemoryError, OSError):
        raise
    except BaseException as error:
        if not (isinstance(error, Exception) or type(error).__name__ == "PanicException"):  # Rust's, not an Exception
            raise
        reason = " ".join((str(error).strip() or type(error).__name__).split())[:120]
        raise FormatError(f"{path} cannot be read as {kind} ({reason}); copy or export it again") from None
