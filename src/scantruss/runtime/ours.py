"""Whether a file was written by ScanTruss, judged by its content: only such a file is written over without being asked for."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

from .. import __version__
from ..errors import FormatError

MADE_BY = f"ScanTruss {__version__}"  #: stands near the beginning of every file that can hold it
CLOUD_MARK = f"point cloud by {MADE_BY}"  #: the same of a cloud, which no other result may replace
BYTES_WITH_MARK = 8192  # bytes from the beginning in which the mark stands
FORCE_OPTION = "add --force to replace it (what is read comes first, and a pattern such as *.ply needs quotes)"  # on a command line
FORCE_ARGUMENT = "give force=True to replace it"  # in Python
LARGEST_PDF = 50_000_000  # bytes of a PDF file in which the mark is sought
# tables have no place for a mark: those of members, of nodes, of a sweep, of schedules, of setting out
TABLE_HEADS = re.compile(
    rb"id,start,end,start_x|id,x[^,]*,y[^,]*,z[^,]*,valence,|[^\n]*length std/mean[^\n]*[,| ]certificate\b|node,node type,ring,"
    rb"|[^\n]*\brise[ ,|]+mass \[kg\]"
    rb"|node,hole,member,|member,start,end,group,|panel,node 1,|(node|panel|length) type,count,|item,group,count,|warning,at,with,"
    rb"|section,at,x|boundary,node,|step,(nodes|member),|node,scan x [^\n]*,(held|set at step),"
)


def kind_of_ours(path: Path) -> str:
    """Return "cloud" or "result" for a file that ScanTruss has written; "" for any other, and for one that cannot be read."""
    try:
        with path.open("rb") as file:
            head = file.read(BYTES_WITH_MARK)
            if head.startswith(b"%PDF"):  # what made it stands at its end
                file.seek(0)
                head = b"".join(re.findall(rb"/Creator \(ScanTruss \d", file.read(LARGEST_PDF)))
        if head.startswith(b"PK") and zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as content:
                name = next(
                    (
                        name
                        for name in content.namelist()
                        if name.endswith((".model", "made_by.npy", "docProps/core.xml"))
                    ),
                    None,
                )
                head = b"" if name is None else content.open(name).read(BYTES_WITH_MARK)
    except (OSError, zipfile.BadZipFile, EOFError):
        return ""
    text = head.replace(b"\x00", b"")  # numpy keeps text in four bytes a letter
    if b"point cloud by ScanTruss" in text or (text.startswith(b"LASF") and b"ScanTruss" in text):
        return "cloud"
    return (
        "result"
        if re.search(rb"ScanTruss \d|scantruss-grid", text) or TABLE_HEADS.match(text.replace(b";", b","))
        else ""
    )


def check_ours(path: Path, kind: str, replace: str = FORCE_OPTION) -> None:
    """Refuse to write over a file of somebody else that is not empty, or over a cloud where the result is none.

    `replace` says how it is replaced all the same.

    Raises
    ------
    FormatError
        There is a file that ScanTruss did not write, or one of another kind.
    """
    if path.is_file() and path.stat().st_size and kind_of_ours(path) != kind:
        raise FormatError(
            f"{path} exists already and is not a {kind} that ScanTruss wrote; name a new file, or {replace}"
        )
