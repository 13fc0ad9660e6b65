"""The benchmarks tell what is there: known nets by hand, ways that are missing or crash, tables, what became slower."""

import copy
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT))  # last: its folder pytest is not the module pytest

from benchmarks import __main__ as benchmarks_main  # noqa: E402
from benchmarks import own, page  # noqa: E402
from benchmarks.peers import figures, runs, tables, ways  # noqa: E402
from benchmarks.peers.clouds import Cloud, clouds  # noqa: E402
from shapes import make  # noqa: E402

CLOUD = Cloud("flat_plate", 2_000, 200, 0.0)


def nothing(scan: Any) -> Any:
    """A way that gives no mesh."""


def plate_net(
    across: int, up: int, corners: Sequence[tuple[float, float]] = ((-30.0, -20.0), (30.0, 20.0))
) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and triangles of a plate divided into rectangles, each into two triangles."""
    (left, low), (right, high) = corners
    x, y = np.meshgrid(np.linspace(left, right, across + 1), np.linspace(low, high, up + 1), indexing="ij")
    nodes = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    a = (np.arange(across)[:, None] * (up + 1) + np.arange(up)).ravel()
    return nodes, np.concatenate([np.stack([a, a + up + 1, a + up + 2], 1), np.stack([a, a + up + 2, a + 1], 1)])


def row(way: str, seconds: float = 1.0, right: bool = True, cloud: Cloud = CLOUD, **found: Any) -> runs.Row:
    known = {
        "right": right,
        "manifold": True,
        "loops": 1,
        "true_loops": 1,
        "euler": 1,
        "true_euler": 1,
        "components": 1,
    }
    return runs.Row(
        cloud,
        way,
        "done",
        "",
        {"seconds": seconds, "search": 1.0},
        {**known, "shape_mean": 0.99, "cv": 0.05, "boundary": 0.1, **found},
    )


def test_a_net_of_right_triangles_has_the_figures_known_by_hand() -> None:
    shape = replace(make("flat_plate", 2_000), length=10.0)
    found = figures.figures(shape, *plate_net(6, 4))
    legs, slants = 6 * 5 + 7 * 4, 6 * 4
    mean = (10 * legs + np.sqrt(200) * slants) / (legs + slants)
    assert (found.right, found.loops, found.euler, found.triangles, found.nodes) == (True, 1, 1, 48, 35)
    assert found.shape_mean == pytest.approx(np.sqrt(3) / 2) and found.shape_std == pytest.approx(0, abs=1e-9)
    assert found.angle_min == pytest.approx(45) and found.valence6 == 1.0 and found.length == pytest.approx(mean / 10)
    spread = np.sqrt((legs * (10 - mean) ** 2 + slants * (np.sqrt(200) - mean) ** 2) / (legs + slants))
    assert found.cv == pytest.approx(spread / mean)
    assert (
        found.deviation == pytest.approx(0, abs=1e-12)
        and found.boundary == pytest.approx(0, abs=1 / 200)
        and found.uncovered == 0
    )


def test_a_net_that_lies_off_is_seen_in_deviation_rim_and_cover() -> None:
    shape = replace(make("flat_plate", 20_000), length=2.0)
    nodes, triangles = plate_net(20, 20, ((-30.0, -20.0), (10.0, 20.0)))  # ends 20 before the boundary of x = 30
    found = figures.figures(shape, nodes + [0, 0, 0.5], triangles)
    assert found.deviation == pytest.approx(0.25) and found.deviation_max == pytest.approx(0.25)
    assert found.boundary == pytest.approx(np.hypot(20, 0.5) / 2, rel=1e-3)
    assert found.uncovered == pytest.approx((20 - np.sqrt(1 - 0.25)) / 60, abs=0.01)


def test_a_hole_and_a_leaf_make_a_net_wrong() -> None:
    shape = replace(make("flat_plate", 2_000), length=10.0)
    nodes, triangles = plate_net(6, 4)
    holed = figures.figures(shape, nodes, np.delete(triangles, [9, 9 + 24], axis=0))
    assert not holed.right and (holed.loops, holed.euler, holed.manifold) == (2, 0, True)
    leaf = figures.figures(
        shape, np.concatenate([nodes, [[0, 0, 9]]]), np.concatenate([triangles, [[8, 14, len(nodes)]]])
    )
    assert not leaf.right and not leaf.manifold


def test_a_way_that_is_missing_crashes_or_never_ends_leaves_a_row_that_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone = ways.Way("gone", (), ("no_such_package",), "", "", nothing)
    monkeypatch.setattr(ways, "WAYS", (gone,))
    job = {key: str(tmp_path / key) for key in ("points", "grid", "answer", "log")} | {"way": "gone"}
    from benchmarks.peers.child import measured

    assert measured(job) == {"result": "missing", "words": "No module named 'no_such_package'"}
    (tmp_path / "ends.py").write_text("import os\nos.kill(os.getpid(), 11)\n")
    (tmp_path / "stays.py").write_text("import time\ntime.sleep(60)\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert runs.run_child(job, 30, "ends")["words"].startswith("signal 11")
    assert runs.run_child(job, 0.5, "stays") == {"result": "out of time", "words": "more than 0.5 s"}
    missing = runs.Row(CLOUD, "gone", "missing", "No module named 'no_such_package'", {}, {})
    assert "| gone | missing |" in tables.summary([row("ScanTruss normal"), missing])
    assert tables.losses([row("ScanTruss normal"), missing]) == []


def test_rows_are_kept_and_what_ran_out_of_time_is_not_tried_on_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    way = ways.Way("slow", (), (), "", "", nothing)
    asked = []

    def run(cloud: Any, way: Any, limit: float, repeats: int) -> runs.Row:
        asked.append(cloud)
        return runs.Row(cloud, way.name, "out of time" if cloud.points > 50 else "failed", "", {}, {})

    monkeypatch.setattr(runs, "run", run)
    plan = list(clouds(["scallop"], [10, 100, 1_000], [5], [0.0]))
    first = list(runs.all_rows(plan, [way], limit=1.0, kept=tmp_path))
    assert [row.result for row in first] == ["failed", "out of time", "not run"] and len(asked) == 2
    with (tmp_path / "rows.jsonl").open("a") as file:
        file.write('{"key": "half a li')
    assert list(runs.all_rows(plan, [way], limit=1.0, kept=tmp_path)) == first and len(asked) == 2


@pytest.mark.parametrize(
    "name", ["child.py", "clouds.py", "figures.py", "measure.py", "shapes.py", "scans.py", "surfaces.py", "truths.py"]
)
def test_rows_measured_otherwise_are_not_kept(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    runs.yardstick.cache_clear()
    way = ways.Way("slow", (), (), "", "", nothing)
    before = runs.key_of(CLOUD, way, 1.0, 1)
    assert runs.key_of(CLOUD, way, 1.0, 1) == before
    runs.yardstick.cache_clear()
    real = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: real(path) + b"#" * (path.name == name))
    assert runs.key_of(CLOUD, way, 1.0, 1) != before
    runs.yardstick.cache_clear()


@pytest.mark.parametrize(
    ("said", "kept"),
    [
        ("cannot import name x from y (/home/me/env/y/__init__.py)", "cannot import name x from y (__init__.py)"),
        ("OSError: '/tmp/b' and \"/opt/lib/libusb-1.0.so.0\": none", "OSError: 'b' and \"libusb-1.0.so.0\": none"),
        ("C:\\Users\\me\\scan.ply is cut off", "scan.ply is cut off"),
        ("loops 2/1, and/or 3 m/s", "loops 2/1, and/or 3 m/s"),
    ],
)
def test_the_words_of_a_way_name_no_folder(said: str, kept: str) -> None:
    assert runs.without_folders(said) == kept


def test_a_way_that_crashes_is_told_without_our_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(job: Any, limit: float) -> dict[str, str]:
        assert np.load(job["points"]).shape == (2_000, 3)  # the cloud as it is made today
        return {"result": "crashed", "words": f"exit status 1 {tmp_path}/way.py"}

    monkeypatch.setattr(runs, "run_child", refuse)
    found = runs.run(CLOUD, ways.Way("w", (), (), "", "", nothing), 1.0)
    assert (found.result, found.words) == ("crashed", "exit status 1 way.py")


def test_ways_that_are_missing_or_do_not_apply_are_not_told_as_wrong() -> None:
    other = replace(CLOUD, shape="sphere")
    rows = [
        row("ScanTruss normal"),
        row("good"),
        row("bad", right=False),
        runs.Row(CLOUD, "gone", "missing", "", {}, {}),
        row("ScanTruss normal", cloud=other),
        runs.Row(other, "good", "does not apply", "a closed surface", {}, {}),
        row("bad", cloud=other),
        runs.Row(other, "gone", "missing", "", {}, {}),
    ]
    assert tables.findings(rows)[0] == (
        "Right topology: ScanTruss normal on **2 of 2** clouds; of 2 other programs 1 on every cloud to which it applies."
    )


def test_losses_name_the_way_that_is_better_and_only_where_it_is_right() -> None:
    rows = [
        row("ScanTruss quick", 1.0),
        row("ScanTruss normal", 2.0),
        row("fast", 0.5, boundary=0.6),
        row("wrong", 0.1, right=False),
    ]
    lost = tables.losses(rows)
    assert any(
        text.startswith("time in neighbour searches: fast is better than ScanTruss quick on 1 of 1") for text in lost
    )
    assert not any("wrong" in text.split(":")[1] for text in lost) and not any(
        "boundary" in text.split(":")[0] for text in lost
    )
    assert "| ScanTruss normal | 1 of 1 | 1.0 |" in tables.summary(
        rows
    ) and "| fast | 1 of 1 | 0.2 |" in tables.summary(rows)
    assert "wrong: loops" in tables.every_run(rows) and len(tables.every_run(rows).splitlines()) == len(rows) + 1


def test_a_section_is_written_anew_and_the_others_stay() -> None:
    one = page.Section("Speed", "speed", "**1**", "earlier text", ("slow.",))
    text = page.with_section(
        page.with_section("", one), page.Section("Random surfaces", "random", "**2**", "other", ())
    )
    again = page.with_section(text, replace(one, text="later text", losses=()))
    assert (
        again.count("## Speed\n") == 2
        and "earlier text" not in again
        and "later text" in again
        and "other" in again
        and "slow" not in again
    )
    assert again.index("## What is lost") < again.index("## Speed") < again.index("## Random")


@pytest.mark.parametrize("given", [["scans", "--data", "{folder}"], ["scans", "--data={folder}"]])
def test_the_page_tells_no_path_of_the_machine(
    given: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def measured(options: Any, command: str) -> page.Section:
        assert options.data == str(tmp_path)
        return page.Section("Simulated and real scans", command, "**1**", "rows", ())

    monkeypatch.setitem(benchmarks_main.MAKERS, "scans", measured)
    file = tmp_path / "page.md"
    arguments = [word.format(folder=tmp_path) for word in given]
    assert benchmarks_main.main([*arguments, "--page", str(file), "--ways", "a b,c"]) == 0
    text = file.read_text()
    assert "python -m benchmarks scans --data DATA --page PAGE --ways 'a b,c'`" in text and str(tmp_path) not in text


@pytest.mark.parametrize(
    "given, written",
    [(["own", "--page", "{folder}/page.md"], "numbers.json"), (["own", "{folder}/new.json"], "new.json")],
)
def test_our_own_figures_are_written_beside_the_page_or_where_it_is_said(
    given: list[str], written: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    saved = []
    monkeypatch.setattr(own, "record", lambda quick: {"quick": quick})
    monkeypatch.setattr(own, "save", lambda figures, file: saved.append((figures, file)))
    assert benchmarks_main.main([word.format(folder=tmp_path) for word in given]) == 0
    assert saved == [({"quick": False}, tmp_path / written)]


def test_compare_marks_what_is_slower_or_worse_and_nothing_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old: dict[str, Any] = {
        "format": 1, "machine": "m", "times": {"a": {"ratio": 1.0, "low": 0.9, "high": 1.1}},
        "quality": {"a": {"cv": 0.05, "right": True, "angle_min": 40.0}},
    }  # fmt: skip
    own.save(old, tmp_path / "old")
    assert own.compare(tmp_path / "old", tmp_path / "old") == 0

    def changed(time: dict[str, float] | None = None, **quality: Any) -> tuple[int, str]:
        new = copy.deepcopy(old)
        new["times"]["a"].update(time or {})
        new["quality"]["a"].update(quality)
        own.save(new, tmp_path / "new")
        capsys.readouterr()
        return own.compare(tmp_path / "old", tmp_path / "new"), capsys.readouterr().out

    status, out = changed({"ratio": 1.5, "low": 1.4, "high": 1.6})
    assert status == 1 and "slower  a: neighbour searches 1 -> 1.5 x 1.500" in out
    assert changed({"ratio": 1.5, "low": 1.0, "high": 2.0})[0] == 0  # a noisy run proves nothing
    assert changed({"ratio": 1.2, "low": 1.19, "high": 1.21})[0] == 0  # within the tolerance
    assert changed({"ratio": 0.1, "low": 0.1, "high": 0.1}, cv=0.01, angle_min=50.0)[0] == 0
    assert changed(cv=0.06)[0] == 1 and changed(right=False)[0] == 1 and changed(cv=0.0505)[0] == 0


def test_a_row_of_another_version_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "runs" / "rows.jsonl"
    keys = [json.dumps([{"shape": "scallop"}, way, version, "yard", 1.0, 3]) for way, version in ("a1", "b1", "a2")]
    for key in keys:
        runs.Store(path).add(key, runs.Row(CLOUD, "way", key[-20:], "", {}, {}))
    assert list(runs.Store(path).rows) == [keys[1], keys[2]]
    assert [entry.name for entry in path.parent.iterdir()] == ["rows.jsonl"]
