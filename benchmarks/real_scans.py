"""docs/real-scans.md: real scans at two lengths, with pictures: `python -m benchmarks.real_scans --data DIR [--only WORD] [--large DIR]`.

Each scan is made at the length that `scantruss info` suggests and at 1.4 times that. DIR or SCANTRUSS_DATA holds the scans. Each
section of the page is written as soon as its scan is done; `--only` does the scans whose names hold a word and leaves the other
sections. `--large` also keeps the pictures at full size, with captions: look at all of them, and say in `WEAKEST` which are worst.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from PIL import Image

import scantruss as st
from scantruss.cli.options import option_of
from scantruss.export.drawing.picture import encode_picture
from scantruss.export.drawing.refusal import encode_refusal
from scantruss.export.drawing.style import PictureStyle
from scantruss.pipeline import grid_from_cloud
from scantruss.report.advice import Advice

from .all_scans import data_folder
from .page import parts

DOCS = Path(__file__).resolve().parents[1] / "docs"
PICTURES = "real-scans"  # folder of the pictures, and name of the page
SIZE, COLOURS = (480, 360), 12  # of a picture on the page; as many colours again for what is rare
WIDE = 320  # of a picture as it is shown [pixel]
PLAIN = PictureStyle(size=(960, 720))
LEAST_SHARE = 0.0005  # of the scan, from which what is left out is told
STANFORD = "Stanford Computer Graphics Laboratory"
ODEDSTEIN = "odedstein/meshes"
PDAL = "PDAL test data, BSD-3-Clause"
MODELS = "alecjacobson/common-3d-test-models"


@dataclass(frozen=True)
class Scan:
    """A scan, what it is, and what was set besides the length."""

    file: str
    what: str
    source: str
    set: dict[str, Any] = field(default_factory=dict)


SCANS = (
    Scan("scallop.ply", "Scallop valve, vertices of a mesh", "cran/geomorph, Serb et al. 2011, GPL-3"),
    Scan("scallop_dense.laz", "The same, resampled evenly", "cran/geomorph, GPL-3"),
    Scan("bunny_scans/bun000.ply", "Bunny, one range scan from the front", STANFORD),
    Scan("bunny_scans/bun090.ply", "Bunny, one range scan from the side", STANFORD),
    Scan("bunny_scans/bun180.ply", "Bunny, one range scan from behind", STANFORD),
    Scan("bunny_zipper.ply", "Bunny, ten scans merged", STANFORD),
    Scan("bunnyDouble.e57", "Bunny without its base", "libE57Format-test-data, Test Data License"),
    Scan("humface.csv", "Face", "cran/Rvcg, GPL-2 or later"),
    Scan("demosthenes_lowres.ply", "Demosthenes, bust in the Louvre", f"{ODEDSTEIN}, ryanfb, CC BY 4.0"),
    Scan("nefertiti_lowres.obj", "Nefertiti, bust", f"{ODEDSTEIN}, Al-Badri and Nelles, public domain"),
    Scan("kitten.xyz", "Kitten, closed, with a handle", "CGAL data, CC0 1.0"),
    Scan("blackVase.ply", "Vase with an inner side", "vtk-data, Nikolov, CC BY 4.0"),
    Scan("roof_sample_c.las", "Gable roof, airborne lidar", PDAL, {"classes": (6,)}),
    Scan("hillside_hexbin-crop.las", "Mountain side, airborne lidar", PDAL),
    Scan("quarry_samp53-utm-ground.pcd", "Quarry, airborne lidar, ground", "PointCloudLibrary/data, Sithole and Vosselman, BSD-3-Clause"),
    Scan("autzen_trim.laz", "River and trees, airborne lidar", PDAL, {"classes": (2,)}),
    Scan("srtm_bigtujunga_utm11.laz", "Mountains, radar from space", "TopoToolbox/DEMs, NASA/USGS SRTM, public domain"),
    Scan("nc_lidar_south.laz", "Town and woods, airborne lidar, last returns", "OSGeo/GRASS North Carolina set, CC BY-SA 3.0",
         {"z_unit": "foot", "unit": "m", "returns": "last"}),
    Scan("rocker_arm.ply", "Machine part with fillets (points of a model)", f"{MODELS}, INRIA"),
    Scan("fandisk.ply", "Machine part with sharp edges (points of a model)", f"{MODELS}, Hoppe et al. 1994"),
    Scan("cheburashka.obj", "Figure with thin limbs (points of a model)", f"{MODELS}, I. Baran"),
)  # fmt: skip

WEAKEST = (
    "The figure with thin limbs has a hand cut off with members of 0.057, its other arm ends in a point, and its slit between the legs is"
    " filled.",
    "The range scans of the bunny from the front and from the side have notches in their edges, gaps bridged and holes closed where the"
    " scanner saw little; a paw is left out.",
    "The vase with members of 28 has a ragged lip, as that is rounded within less than a member; its wall of 10 carries a grid on"
    " either side.",
)
HEAD = """\
# Real scans

Each scan at the length that `scantruss info` suggests and at 1.4 times that, by `scantruss grid` with no other settings than those named.
*Lost*: what the grid leaves out of the scan, and why, from its certificate. *95 %*: how far from the grid 95 % of the points lie at most,
in members. In the pictures what is left out is coloured. The scans are not part of ScanTruss; their sources are named. Written by
`python -m benchmarks.real_scans`."""


@dataclass(frozen=True)
class Run:
    """What came of a scan at a length."""

    length: float  #: [scan unit]
    unit: str
    large: bytes  #: picture with captions
    small: bytes  #: picture of the page
    nodes: int
    verdict: str
    found: st.Certificate | None


def runs_of(scan: Scan, data: Path) -> list[Run]:
    """Return a run for each of the two lengths."""
    settings = st.Settings(length=1.0, thin_spacing=0.0, **scan.set)  # the length follows
    cloud = st.read_points(data / "real" / scan.file, unit=settings.unit, selection=settings.selection)
    advice = Advice(cloud, settings)
    suggested = advice.suggest()
    return [run(cloud, settings.replace(length=length)) for length in (suggested, advice.next_above(suggested))]


def run(cloud: st.PointCloud, settings: st.Settings) -> Run:
    """Make a grid and its pictures, or a picture of why there is none."""
    try:
        grid, words = grid_from_cloud(cloud, settings), ""
        large, plain = encode_picture(grid, cloud), encode_picture(grid, cloud, caption=False, style=PLAIN)
    except st.FrontError as error:
        grid, words = error.grid, str(error).partition(";")[0]
        large, plain = encode_refusal(error, cloud), encode_refusal(error, cloud, style=PLAIN)
        if grid is not None and len(grid.triangles):
            plain = encode_picture(grid, cloud, caption=False, style=PLAIN)
    found = None if grid is None else grid.certificate
    verdict = f"refused: {words}" if words else "passed with warnings" if found and found.warnings else "passed"
    image = Image.open(io.BytesIO(plain)).convert("RGB").resize(SIZE, Image.Resampling.LANCZOS)
    colours: list[int] = []
    for method in (Image.Quantize.MEDIANCUT, Image.Quantize.MAXCOVERAGE):  # the second keeps few dots in strong colours
        colours += (image.quantize(COLOURS, method).getpalette() or [])[: 3 * COLOURS]
    small, palette = io.BytesIO(), Image.new("P", (1, 1))
    palette.putpalette(colours)
    image.quantize(palette=palette, dither=Image.Dither.NONE).save(small, "PNG", optimize=True)
    return Run(
        settings.length, cloud.unit, large, small.getvalue(), 0 if grid is None else len(grid.nodes), verdict, found
    )


def lost_of(found: st.Certificate) -> str:
    """Return what a grid leaves out, and why, in a few words."""
    shares: dict[str, float] = {}
    for part in found.left_out:
        if part.points:
            shares[part.words] = shares.get(part.words, 0.0) + part.share
    said = [
        f"{share:.1%} {words}"
        for words, share in sorted(shares.items(), key=lambda kind: -kind[1])
        if share >= LEAST_SHARE
    ]
    holes = sum(part.number for part in found.left_out if part.kind == "hole")
    return "; ".join([*said, *([f"{holes} {'hole' if holes == 1 else 'holes'} closed"] * (holes > 0))]) or "nothing"


def lines_of(scan: Scan, runs: list[Run]) -> Iterator[str]:
    """Yield the lines of the page about a scan: a column for each run."""
    told = "".join(f" `{option_of(name)} {words_of(value)}`" for name, value in scan.set.items())
    yield f"`{Path(scan.file).name}`{told}. {scan.source}.\n"
    yield row_of("length", (f"{each.length:g} {each.unit}".rstrip() for each in runs))
    yield "| --- | --- | --- |"
    place = f"{PICTURES}/{Path(scan.file).stem}"
    yield row_of("", (f'<img src="{place}_{n}.png" width="{WIDE}" alt="{scan.what}">' for n in range(1, len(runs) + 1)))
    yield row_of("nodes", (f"{each.nodes:,}" for each in runs))
    yield row_of("verdict", (each.verdict for each in runs))
    yield row_of("lost", (lost_of(each.found) if each.found else "all" for each in runs))
    yield row_of("95 %", (p95_of(each) for each in runs))


def row_of(name: str, values: Iterable[str]) -> str:
    """Return a row of a table."""
    return f"| {name} | {' | '.join(values)} |"


def p95_of(one: Run) -> str:
    """Return how far 95 % of the points lie from the grid at most [member]."""
    return (
        ""
        if one.found is None or one.found.scan_distance is None
        else f"{one.found.scan_distance.p95 / one.length:.2f}"
    )


def words_of(value: Any) -> str:
    """Return a value as an option takes it."""
    return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)


def write_section(scan: Scan, runs: list[Run]) -> None:
    """Write the pictures of a scan and its section; the others stay as they are."""
    (DOCS / PICTURES).mkdir(exist_ok=True)
    for number, each in enumerate(runs, 1):
        (DOCS / PICTURES / f"{Path(scan.file).stem}_{number}.png").write_bytes(each.small)
    file = DOCS / f"{PICTURES}.md"
    sections = parts(file.read_text(encoding="utf-8"), "##") if file.exists() else {}
    sections[scan.what] = "\n".join(lines_of(scan, runs))
    weakest = "\n".join(f"{number}. {said}" for number, said in enumerate(WEAKEST, 1))
    bodies = {"Where it is weakest": weakest} | {
        each.what: sections[each.what] for each in SCANS if each.what in sections
    }
    page = [HEAD, *(f"## {title}\n\n{body}" for title, body in bodies.items())]
    file.write_text("\n\n".join(page) + "\n", encoding="utf-8", newline="\n")


def main() -> int:
    """Run the scans on two processors, and write their sections."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", help="folder of scans; SCANTRUSS_DATA if left out")
    parser.add_argument("--only", default="", help="part of the names of the scans to do")
    parser.add_argument("--large", type=Path, help="folder for the pictures at full size")
    options = parser.parse_args()
    if (data := data_folder(options.data)) is None:
        print("no scans there; name their folder by --data", file=sys.stderr)
        return 2
    if options.large:
        options.large.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(2) as pool:
        waiting = {pool.submit(runs_of, scan, data): scan for scan in SCANS if options.only in scan.file}
        for done in as_completed(waiting):
            scan, runs = waiting[done], done.result()
            write_section(scan, runs)
            print(
                "\n".join(
                    [scan.what, *(line for line in lines_of(scan, runs) if line.startswith("| ") and "img" not in line)]
                ),
                flush=True,
            )
            for number, each in enumerate(runs if options.large else (), 1):
                (options.large / f"{Path(scan.file).stem}_{number}.png").write_bytes(each.large)
    return 0


if __name__ == "__main__":
    sys.exit(main())
