"""Files packed by gzip (scan.xyz.gz): unpacked into the system's folder for temporary files, up to a bound."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...errors import FormatError
from ...runtime.files import temporary_folder
from .kinds import read_head, wrong_kind

MOST_PACKED = 100  # text of points packs to a third or a tenth; zeros pack to a thousandth
BYTES_ALWAYS_UNPACKED = 1 << 26  # bytes that any file may unpack to
UNPACKED_BYTES_PER_BLOCK = 1 << 20  # bytes


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """Give the path of the unpacked file, for as long as it is needed; messages name the packed one.

    Raises
    ------
    FormatError
        The file is no gzip archive, damaged, cut off, or unpacks to more than any scan would.
    """
    head = read_head(path)
    if not head.startswith(b"\x1f\x8b"):
        raise wrong_kind(path, head, "a gzip archive")
    with temporary_folder() as folder:
        inner = folder / path.name[:-3]
        _unpack(path, inner)
        try:
            yield inner
        except FormatError as error:
            raise FormatError(str(error).replace(str(inner), str(path))) from None


def _unpack(path: Path, inner: Path) -> None:
    try:
        with gzip.open(path) as source, inner.open("wb") as target:
            size = 0
            while block := source.read(UNPACKED_BYTES_PER_BLOCK):
                size += len(block)
                check_size(path, size)
                target.write(block)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise FormatError(f"{path} cannot be unpacked ({' '.join(str(error).split())}); copy it again") from None


def check_size(path: Path, size: int) -> None:
    """Refuse a packed file that unpacks to more bytes than any scan would."""
    most = max(BYTES_ALWAYS_UNPACKED, MOST_PACKED * path.stat().st_size)
    if size > most:
        raise FormatError(f"{path} unpacks to over {most:,} bytes, which no scan of its size does; unpack it yourself")
