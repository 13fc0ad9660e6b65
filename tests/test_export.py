"""Files of grids: what is written is read back by independent readers, whole or not at all."""

import csv
import io
import json
import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Never, Self

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from small_grids import cloud_over, dome, fan, icosahedron, make_grid, rich, two_pieces
from typed import known

import scantruss as st
from scantruss.export.formats import check_output, suffixes_of
from scantruss.runtime.files import SaveTogether, write_files

GRIDS = [fan, icosahedron, two_pieces, rich, dome]
NOBODY = 65534  # user
UTM = np.array([500000.1, 4500000.2, 100.3])


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two arrays are the same to the last bit, NaN and the sign of 0 included."""
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def naive_obj(text: str) -> tuple[np.ndarray, np.ndarray]:
    """Read an OBJ file the obvious way."""
    words = [line.split() for line in text.splitlines()]
    nodes = [[float(w) for w in row[1:]] for row in words if row and row[0] == "v"]
    return np.array(nodes), np.array([[int(w) - 1 for w in row[1:]] for row in words if row and row[0] == "f"])


@pytest.mark.parametrize("make", GRIDS)
def test_obj_holds_nodes_in_the_scans_own_frame_to_the_last_bit(make: Callable[..., st.Grid], tmp_path: Path) -> None:
    grid = make(origin=UTM)
    assert st.write(grid, tmp_path / "a.obj") == [tmp_path / "a.obj"]
    nodes, triangles = naive_obj((tmp_path / "a.obj").read_text())
    assert same(nodes, grid.nodes + UTM)
    assert np.array_equal(triangles, grid.triangles)
    assert "unit: mm" in (tmp_path / "a.obj").read_text()


@pytest.mark.parametrize("make", GRIDS)
@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_trimesh_reads_what_is_written(make: Callable[..., st.Grid], suffix: str, tmp_path: Path) -> None:
    import trimesh

    grid = make()
    st.write(grid, tmp_path / f"a{suffix}")
    mesh = trimesh.load(tmp_path / f"a{suffix}", process=False, maintain_order=True)
    used = np.unique(grid.triangles)  # trimesh drops a node without a triangle from an OBJ
    expected = (grid.nodes + grid.origin)[used]
    found = mesh.vertices[np.unique(mesh.faces)]
    assert np.array_equal(found, expected)
    assert np.array_equal(np.searchsorted(np.unique(mesh.faces), mesh.faces), np.searchsorted(used, grid.triangles))


def test_ply_says_double_and_unit(tmp_path: Path) -> None:
    st.write(rich(), tmp_path / "a.ply")
    header = (tmp_path / "a.ply").read_bytes().split(b"end_header\n")[0].decode()
    assert "property double x" in header and "comment unit: mm" in header and "element vertex 7" in header


@pytest.mark.parametrize("make", GRIDS)
def test_json_is_read_back_without_loss(make: Callable[..., st.Grid], tmp_path: Path) -> None:
    grid = make()
    st.write(grid, tmp_path / "a.json")
    back = st.read_grid(tmp_path / "a.json")
    for name in ("nodes", "triangles", "fixed", "origin"):
        assert same(getattr(back, name), getattr(grid, name)), name
    assert (back.deviation is None) == (grid.deviation is None)
    assert grid.deviation is None or same(known(back.deviation), grid.deviation)
    assert (back.unit, back.settings, back.before) == (grid.unit, grid.settings, grid.before)
    st.write(back, tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


numbers = some.floats(allow_nan=False, allow_infinity=False, width=64, min_value=-1e100, max_value=1e100)


@some.composite
def any_grids(draw: some.DrawFn) -> st.Grid:
    count = draw(some.integers(3, 9))
    places = draw(some.lists(numbers, min_size=3 * count, max_size=3 * count))
    corners = some.permutations(range(count)).map(lambda ids: ids[:3])
    triangles = draw(some.lists(corners, min_size=0, max_size=6))
    fixed = draw(some.sets(some.integers(0, count - 1)))
    origin = np.array(draw(some.lists(numbers, min_size=3, max_size=3)))
    unit = draw(some.sampled_from(["", "mm", "cm", "m", "inch", "foot"]))
    return make_grid(places, triangles, fixed=fixed, origin=origin, unit=unit)


@given(any_grids())
def test_json_keeps_any_numbers(tmp_path_factory: pytest.TempPathFactory, grid: st.Grid) -> None:
    path = tmp_path_factory.mktemp("any") / "a.json"
    # quality and topology are not the matter here, and of numbers without sense they may overflow
    grid.__dict__["quality"], grid.__dict__["topology"] = fan().quality, fan().topology
    st.write(grid, path)
    back = st.read_grid(path)
    assert same(back.nodes, grid.nodes) and same(back.origin, grid.origin) and same(back.triangles, grid.triangles)
    assert same(back.fixed, grid.fixed) and back.unit == grid.unit


def test_json_tells_other_programs_what_follows(tmp_path: Path) -> None:
    grid = rich()
    st.write(grid, tmp_path / "a.json")
    values = json.loads((tmp_path / "a.json").read_text())
    assert values["format"] == "scantruss-grid" and values["version"] == st.__version__
    assert values["members"] == grid.edges.tolist() and values["fixed"] == [0, 3]
    assert [sorted(loop) for loop in values["boundary_loops"]] == [[1, 2, 3, 4, 5, 6]]
    assert values["topology"] == grid.topology.to_dict()
    figures = grid.quality.to_dict()  # one deviation is not known here, so their mean is not either
    assert values["quality"] == {name: None if figure != figure else figure for name, figure in figures.items()}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{}", 'no "format"'),
        ("[1, 2]", 'no "format"'),
        ("not json", "not JSON"),
        ("\udcff", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('{"format": "scantruss-grid", "format_version": 99}', "newer"),
        ('{"format": "scantruss-grid"}', "a damaged grid: format_version is missing"),
        ('{"format": "scantruss-grid", "format_version": 1}', "unit is missing"),
    ],
)
def test_other_json_is_refused_in_words(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(st.FormatError, match=words) as error:
        st.read_grid(tmp_path / "a.json")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("nodes", [[0, 0]], "3 columns"),
        ("nodes", [[0, 0, 0], [1, 2]], "damaged"),
        ("nodes", [["0", "0", "0"]], "numbers"),
        ("nodes", [[float("nan"), 0, 0]], "not JSON"),
        ("triangles", [[0, 1, 7]], "ids of nodes, 0 to 6"),
        ("triangles", [[0, 1, -1]], "ids of nodes"),
        ("triangles", [[0, 1, 2.5]], "ids of nodes"),
        ("triangles", 5, "damaged"),
        ("fixed", [9], "ids of nodes"),
        ("origin", [1, 2], "3 columns"),
        ("origin", [1, 2, 10**400], "numbers"),
        ("unit", "furlong", "unknown unit"),
        ("unit", ["mm"], "damaged"),
        ("deviation", [1.0], "1 deviations for 7 nodes"),
        ("settings", {"length": -1}, "length must be a positive number"),
        ("settings", {"colour": 1}, "unknown setting"),
        ("before", {"colour": 1}, "damaged"),
    ],
)
def test_a_damaged_grid_is_refused_in_words(key: str, value: Any, words: str, tmp_path: Path) -> None:
    st.write(rich(), tmp_path / "a.json")
    values = json.loads((tmp_path / "a.json").read_text()) | {key: value}
    (tmp_path / "a.json").write_text(json.dumps(values))
    with pytest.raises(st.FormatError, match=words) as error:
        st.read_grid(tmp_path / "a.json")
    assert "\n" not in str(error.value)


def test_a_missing_grid_is_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(st.FormatError, match="No such file"):
        st.read_grid(tmp_path / "a.json")


@pytest.mark.parametrize("make", GRIDS)
def test_csv_holds_members_and_beside_them_nodes(make: Callable[..., st.Grid], tmp_path: Path) -> None:
    grid = make()
    assert st.write(grid, tmp_path / "a.csv") == [tmp_path / "a.csv", tmp_path / "a_nodes.csv"]
    members, nodes = (list(csv.DictReader(io.StringIO((tmp_path / n).read_text()))) for n in ("a.csv", "a_nodes.csv"))
    places = np.array([[float(row[f"{c} [mm]"]) for c in "xyz"] for row in nodes])
    assert same(places, grid.nodes + grid.origin)
    assert [[int(row["start"]), int(row["end"])] for row in members] == grid.edges.tolist()
    for row in members:
        a, b = int(row["start"]), int(row["end"])
        ends = [[float(row[f"{end}_{c} [mm]"]) for c in "xyz"] for end in ("start", "end")]
        assert ends == [places[a].tolist(), places[b].tolist()]
        assert float(row["length [mm]"]) == pytest.approx(np.linalg.norm(grid.nodes[a] - grid.nodes[b]), rel=1e-15)
        shared = sum({a, b} <= set(triangle) for triangle in grid.triangles.tolist())
        assert int(row["boundary"]) == (shared == 1)
    for k, row in enumerate(nodes):
        assert int(row["id"]) == k and int(row["valence"]) == (grid.edges == k).sum()
        assert int(row["fixed"]) == grid.fixed[k]
        assert int(row["boundary"]) == any(k in loop for loop in grid.boundary_loops)


def test_without_a_unit_none_is_said(tmp_path: Path) -> None:
    st.write(fan(unit=""), tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text().splitlines()[0].startswith("id,start,end,start_x,")


@pytest.mark.parametrize("suffix", suffixes_of("grid"))
def test_same_grid_same_bytes(suffix: str, tmp_path: Path) -> None:
    grid = rich()
    first = st.write(grid, tmp_path / f"a{suffix}", cloud=cloud_over(grid))
    second = st.write(grid.replace(seconds={"grid": 1.0}), tmp_path / f"b{suffix.upper()}", cloud=cloud_over(grid))
    assert [p.read_bytes() for p in first] == [p.read_bytes() for p in second]


@pytest.mark.parametrize("suffix", suffixes_of("grid"))
def test_a_grid_without_triangles_is_written(suffix: str, tmp_path: Path) -> None:
    for path in st.write(make_grid([(0, 0, 0)], []), tmp_path / f"a{suffix}"):
        assert path.stat().st_size > 0


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a.jsn", 'no format for ".jsn"; use one of .3dm .compas.json .csv '),
        ("a.jsn", "the nearest is .json"),
        ("a", 'no format for "a"; use one of .3dm .compas.json .csv'),
        ("a.stl", 'no format for ".stl" of a grid'),
        ("a.3mf", "scantruss print"),
        ("none/a.obj", "none does not exist"),
        ("file/a.obj", "is a file, not a folder"),
        ("folder.obj", "it is a folder"),
        ("b.csv", "b_nodes.csv: it is a folder"),
        ("x" * 300 + ".obj", "File name too long"),
    ],
)
def test_places_where_nothing_can_be_written_are_refused(name: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder.obj").mkdir()
    (tmp_path / "b_nodes.csv").mkdir()
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(st.FormatError) as error:
        st.write(fan(), tmp_path / name)
    assert words in str(error.value) and "\n" not in str(error.value)
    assert sorted(tmp_path.rglob("*")) == before


@contextmanager
def as_nobody(folder: str) -> Iterator[None]:
    """Own a folder as a user who may not write everywhere, and be that user; as we are where we are not the superuser."""
    if os.geteuid() != 0:
        yield
        return
    os.chown(folder, NOBODY, -1)
    os.setresuid(NOBODY, NOBODY, 0)
    try:
        yield
    finally:
        os.setresuid(0, 0, 0)


PROTECTS = hasattr(os, "geteuid") and (os.geteuid() != 0 or hasattr(os, "setresuid"))


@pytest.mark.skipif(not PROTECTS, reason="here no folder is protected from us by its mode")
def test_a_protected_folder_is_refused_before_the_work() -> None:
    with tempfile.TemporaryDirectory() as name, as_nobody(name):  # not in tmp_path, which is the superuser's alone
        assert check_output(Path(name) / "a.obj").parent == Path(name)
        Path(name).chmod(0o500)
        with pytest.raises(st.FormatError, match="no permission"):
            check_output(Path(name) / "a.obj")
        Path(name).chmod(0o700)


@pytest.mark.parametrize("full_at", [1, 2])
def test_a_full_disk_leaves_what_was_there(full_at: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = [tmp_path / "a.csv", tmp_path / "a_nodes.csv"]
    for path in paths:
        path.write_bytes(b"old")
    opened = Path.open
    count = 0

    def open_on_a_full_disk(self: Path, mode: str = "r", *rest: Any, **more: Any) -> Any:
        nonlocal count
        stream = opened(self, mode, *rest, **more)
        count += "x" in mode
        return Full(stream) if count == full_at and "x" in mode else stream

    monkeypatch.setattr(Path, "open", open_on_a_full_disk)
    with pytest.raises(st.FormatError, match="No space left on device"):
        st.write(fan(), tmp_path / "a.csv", force=True)
    assert sorted(tmp_path.iterdir()) == paths
    assert [path.read_bytes() for path in paths] == [b"old", b"old"]


class Full:
    """A file on a disk with no more room than four bytes."""

    def __init__(self, stream: Any) -> None:
        self.stream = stream

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> Any:
        self.stream.close()

    def write(self, content: Any) -> Never:
        self.stream.write(content[:4])
        raise OSError(28, "No space left on device")


def test_a_stopped_run_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: Any) -> Never:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", stop)
    with pytest.raises(KeyboardInterrupt):
        write_files({tmp_path / "a.obj": b"new"})
    assert list(tmp_path.iterdir()) == []


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "true.obj").touch()
    (tmp_path / "a.obj").symlink_to(tmp_path / "true.obj")
    write_files({tmp_path / "a.obj": b"new"})
    assert (tmp_path / "a.obj").is_symlink() and (tmp_path / "true.obj").read_bytes() == b"new"


def test_a_link_to_another_folder_is_written_through_with_nothing_left_beside_either(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    (tmp_path / "here" / "a.obj").symlink_to(tmp_path / "there" / "true.obj")
    with SaveTogether() as save:
        save.beside(tmp_path / "here" / "a.obj").write_bytes(b"new")
        save.json(tmp_path / "here" / "b.json", {})
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a.obj", "b.json", "here", "there", "true.obj"]
    assert (tmp_path / "here" / "a.obj").is_symlink() and (tmp_path / "there" / "true.obj").read_bytes() == b"new"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_pipe_stays_a_pipe_and_gets_the_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.obj")
    received = []
    reader = threading.Thread(target=lambda: received.append((tmp_path / "a.obj").read_bytes()))
    reader.start()
    write_files({tmp_path / "a.obj": b"new"})
    reader.join()
    assert received == [b"new"] and (tmp_path / "a.obj").is_fifo() and len(list(tmp_path.iterdir())) == 1


def test_files_get_the_usual_permissions(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    write_files({tmp_path / "a.obj": b"new"})
    assert (tmp_path / "a.obj").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("elements", ["faces", "lines", "both"])
@pytest.mark.parametrize("make", GRIDS)
def test_obj_holds_lines_as_well_as_faces_on_request(
    make: Callable[..., st.Grid], elements: str, tmp_path: Path
) -> None:
    grid = make(origin=UTM)
    st.write(grid, tmp_path / "a.obj", style=st.FileStyle(obj=elements))
    text = (tmp_path / "a.obj").read_text()
    nodes, triangles = naive_obj(text)
    lines = np.array([[int(w) - 1 for w in row.split()[1:]] for row in text.splitlines() if row.startswith("l ")])
    assert same(nodes, grid.scan_nodes)
    assert np.array_equal(triangles, grid.triangles) if elements != "lines" else not len(triangles)
    assert np.array_equal(lines, grid.members) if elements != "faces" else not len(lines)


@pytest.mark.parametrize("make", GRIDS)
def test_tables_with_a_decimal_comma_hold_the_same_numbers(make: Callable[..., st.Grid], tmp_path: Path) -> None:
    grid = make(origin=UTM)
    st.write(grid, tmp_path / "a.csv")
    st.write(grid, tmp_path / "b.csv", style=st.FileStyle(decimal_comma=True))
    for end in ("", "_nodes"):
        point, comma = ((tmp_path / f"{name}{end}.csv").read_text(encoding="utf-8") for name in "ab")
        rows = list(csv.reader(io.StringIO(comma), delimiter=";"))
        plain = list(csv.reader(io.StringIO(point)))
        assert rows[0] == plain[0] and "." not in "".join(map("".join, rows[1:]))
        assert [[word.replace(",", ".") for word in row] for row in rows[1:]] == plain[1:]


def test_members_and_nodes_in_the_scans_frame_have_names() -> None:
    grid = rich(origin=UTM)
    assert np.array_equal(grid.members, grid.edges)
    assert same(grid.scan_nodes, grid.nodes + UTM)


def test_a_style_that_is_none_is_refused() -> None:
    with pytest.raises(st.InputError, match="an OBJ file holds faces, lines, both, got 'points'"):
        st.FileStyle(obj="points")
