"""No command writes over a file that ScanTruss did not write itself, whatever the order of its arguments."""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_grids import dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.runtime.ours import kind_of_ours

LENGTH = "1.5"


def plate(shift: float = 0.0) -> np.ndarray:
    rng = np.random.default_rng(3)
    points = np.column_stack([rng.uniform(0, 12, 4000), rng.uniform(0, 9, 4000), np.zeros(4000)])
    points[:, 2] = 0.02 * points[:, 0] ** 2
    return points + [shift, 0.0, 0.0]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with three scans, a list of nodes, a picture and a grid of other programs."""
    monkeypatch.chdir(tmp_path)
    for name in ("a.xyz", "b.xyz", "c.ply", "d.csv"):
        np.savetxt(name, plate(), delimiter="," if name.endswith("csv") else " ", fmt="%.6f")
    head = "ply\nformat ascii 1.0\nelement vertex 4000\nproperty double x\nproperty double y\nproperty double z\nend_header\n"
    (tmp_path / "c.ply").write_text(head + (tmp_path / "a.xyz").read_text())
    (tmp_path / "theirs.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "theirs.json").write_text('{"a": 1}\n')
    (tmp_path / "theirs.png").write_bytes(b"\x89PNG\r\n\x1a\n not ours")
    (tmp_path / "theirs.stl").write_bytes(b"solid theirs\nendsolid\n")
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


WRONG = [
    "grid a.xyz b.xyz c.ply new.json --length L",
    "grid a.xyz b.xyz c.ply d.csv --length L",
    "grid a.xyz new.obj c.ply --length L",
    "grid a.xyz theirs.obj --length L",
    "grid a.xyz new.obj theirs.json --length L",
    "grid a.xyz theirs.png --length L",
    "grid a.xyz new.obj --report theirs.json --length L",
    "grid a.xyz -o c.ply --length L",
    "grid a.xyz new.obj -o theirs.obj --length L",
    "grid theirs.obj a.xyz --length L",
    "grid a.xyz a.xyz --length L",
    "grid a.xyz d.csv --length L",
    "clean a.xyz b.xyz",
    "clean a.xyz c.ply",
    "clean a.xyz b.xyz c.ply",
    "clean a.xyz new.ply --report theirs.json",
    "clean a.xyz -o c.ply",
    "clean new.ply a.xyz",
    "thin a.xyz -o c.ply --spacing 0.5",
    "thin a.xyz b.xyz c.ply --spacing 0.5",
    "thin a.xyz b.xyz -o d.csv --spacing 0.5",
    "splice a.xyz b.xyz -o c.ply",
    "splice a.xyz b.xyz c.ply",
    "sweep a.xyz --length L -o theirs.json",
    "sweep a.xyz c.ply --length L -o folder",
    "print theirs.json theirs.stl --member-diameter 0.1 --node-diameter 0.2",
    "print theirs.stl theirs.json --member-diameter 0.1 --node-diameter 0.2",
    "print theirs.json -o theirs.stl --member-diameter 0.1 --node-diameter 0.2",
    "schedule theirs.json theirs.xlsx --tube 60",
    "schedule theirs.json theirs.json --tube 60",
    "schedule a.xyz d.csv --tube 60",
    "schedule theirs.csv theirs.json --tube 60",
    "convert theirs.json a.xyz",
    "convert theirs.json theirs.stl",
    "convert a.xyz new.dxf",
    "setout theirs.json theirs.json --supports boundary",
    "setout theirs.json d.csv --supports boundary",
    "demo theirs.json",
    "grid theirs.json a.xyz --length L",
    "grid new.obj a.xyz --length L",
    "grid --length L",
    "grid a.xyz",
    "grid a.xyz theirs.csv theirs.obj --length L",
    "grid --length a.xyz L new.obj",
    "grid a.xyz new.obj --settings theirs.png --length L",
    "grid a.xyz new.obj --fixed-file theirs.png --length L",
    "grid a.xyz new.obj --report c.ply --length L",
    "info",
    "info a.xyz b.xyz",
    "info theirs.json",
    "clean",
    "clean a.xyz",
    "clean theirs.json new.ply",
    "clean a.xyz theirs.obj",
    "thin a.xyz c.ply --spacing 0.5",
    "thin -o a.xyz b.xyz --spacing 0.5",
    "thin a.xyz -o theirs.png --spacing 0.5",
    "splice a.xyz -o new.ply",
    "splice a.xyz a.xyz -o new.ply",
    "splice -o a.xyz b.xyz c.ply",
    "sweep --length L -o a.xyz",
    "sweep folder a.xyz --length L -o a.xyz",
    "print a.xyz new.stl --member-diameter 0.1 --node-diameter 0.2",
    "print new.stl theirs.json --member-diameter 0.1 --node-diameter 0.2",
    "print theirs.json new.stl --member-diameter 0.1 --node-diameter 0.2",
    "demo a.xyz",
    "demo folder a.xyz",
    "completion",
    "completion a.xyz",
    "a.xyz grid new.obj --length L",
]


@pytest.mark.parametrize("command", WRONG)
def test_a_wrong_order_of_arguments_harms_nothing(
    place: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    before = contents(place)
    assert main(command.replace("L", LENGTH).split()) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and said.startswith("scantruss: ")
    assert contents(place) == before


def test_several_scans_without_quotes_are_told_of_quotes(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("grid a.xyz b.xyz c.ply new.json --length 1.5", "clean a.xyz b.xyz c.ply", "clean a.xyz c.ply"):
        assert main(command.split()) == 2
        assert "quotes" in capsys.readouterr().err


def test_results_of_our_own_are_replaced_and_those_of_others_by_force(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outs = ["one.obj", "one.json", "one.ply", "one.csv", "one.png"]
    for _ in range(2):
        assert main(["grid", "a.xyz", *outs[:2], "-o", outs[2], "-o", outs[3], "-o", outs[4], "--length", LENGTH]) == 0
        assert main(["grid", "a.xyz", "one.obj", "--length", LENGTH, "--report", "figures.json"]) == 0
        assert main(["clean", "a.xyz", "clean.ply", "-o", "clean.npz", "--report", "steps.json", "--no-smooth"]) == 0
        assert main(["thin", "a.xyz", "-o", "thin.pcd", "-o", "thin.xyz", "--spacing", "0.3"]) == 0
        assert (
            main(["print", "one.json", "m.3mf", "-o", "m.stl", "--member-diameter", "0.1", "--node-diameter", "0.2"])
            == 0
        )
        assert main(["schedule", "one.json", "s.xlsx", "s.csv", "--tube", "60", "--unit", "m"]) == 0
        assert main(["sweep", "a.xyz", "--length", "2", "--effort", "quick", "-o", "sweep", "--workers", "1"]) == 0
    capsys.readouterr()
    assert main(["grid", "a.xyz", "theirs.obj", "--length", LENGTH, "--force"]) == 0
    assert kind_of_ours(place / "theirs.obj") == "result"


def test_a_cloud_of_our_own_is_not_replaced_by_a_grid_nor_a_grid_by_a_cloud(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["clean", "a.xyz", "cloud.ply", "--no-smooth"]) == 0
    assert main(["grid", "a.xyz", "net.ply", "--length", LENGTH]) == 0
    before = contents(place)
    assert main(["grid", "a.xyz", "cloud.ply", "--length", LENGTH]) == 2
    assert main(["clean", "a.xyz", "net.ply", "--no-smooth"]) == 2
    assert contents(place) == before


def test_a_link_to_a_file_of_others_protects_it_and_stays_a_link(place: Path) -> None:
    (place / "link.obj").symlink_to("theirs.obj")
    before = contents(place)
    assert main(["grid", "a.xyz", "link.obj", "--length", LENGTH]) == 2
    assert contents(place) == before
    (place / "fresh.obj").symlink_to("new.obj")
    assert main(["grid", "a.xyz", "fresh.obj", "--length", LENGTH]) == 0
    assert (place / "fresh.obj").is_symlink() and (place / "new.obj").read_text().startswith("#")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_stays_a_pipe(place: Path) -> None:
    os.mkfifo("pipe.obj")
    heard = []
    reader = threading.Thread(target=lambda: heard.append((place / "pipe.obj").read_bytes()))
    reader.start()
    assert main(["grid", "a.xyz", "pipe.obj", "--length", LENGTH]) == 0
    reader.join(10)
    assert heard[0].startswith(b"#") and not (place / "pipe.obj").is_file()


def test_a_file_that_comes_while_we_compute_is_not_replaced(
    place: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from scantruss import pipeline

    made = pipeline.grid_from_cloud

    def meanwhile(*values: Any, **options: Any) -> Any:
        (place / "new.obj").write_text("somebody else's\n")
        return made(*values, **options)

    monkeypatch.setattr(pipeline, "grid_from_cloud", meanwhile)
    assert main(["grid", "a.xyz", "new.obj", "--length", LENGTH]) == 2
    assert (place / "new.obj").read_text() == "somebody else's\n" and "--force" in capsys.readouterr().err


def test_in_python_too_no_file_of_others_is_written_over_unless_by_force(place: Path) -> None:
    grid = dome(5, unit="m")
    made = st.schedule(grid, st.ScheduleSettings(tube=60.0))
    supported = st.set_out(st.Truss.from_grid(grid, supports="boundary"))
    sizes: dict[str, Any] = {"member_diameter": 0.1, "node_diameter": 0.3}
    Path("theirs.xlsx").write_bytes(b"theirs")
    Path("theirs.pdf").write_bytes(b"%PDF theirs")
    Path("rows_nodes.csv").write_text("theirs\n")
    writers: list[Any] = [
        lambda **more: st.write(grid, "theirs.obj", **more),
        lambda **more: st.write(grid, "theirs.json", **more),
        lambda **more: st.write(grid, "theirs.png", **more),
        lambda **more: st.write(grid, "rows.csv", **more),
        lambda **more: st.print_model(grid, "theirs.stl", **sizes, **more),
        lambda **more: st.write_schedules(made, "theirs.xlsx", **more),
        lambda **more: st.write_setting_out(supported, "theirs.pdf", **more),
    ]
    before = contents(place)
    for write in writers:
        with pytest.raises(st.FormatError, match="force=True"):
            write()
        assert contents(place) == before
    for write in writers:
        write(force=True)
        write()  # what is ours is replaced without being asked for


def test_convert_says_what_it_replaced(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number, name in enumerate(("one.json", "two.json")):
        st.write(dome(5 + number, unit="m"), name)
    assert main(["convert", "one.json", "two.json", "new.dxf"]) == 0
    assert "wrote there before: two.json\n" in capsys.readouterr().out
