"""The printed model in parts: watertight, volumes that add up, parts on the bed, joints with their clearance, balls that take rods."""

import csv
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as some
from small_grids import dome, fan, icosahedron, make_grid, two_pieces

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.engraving import letter_height
from scantruss.export.printed.nodes import build_nodes
from scantruss.export.printed.parts import Joint, build_parts, check_apart, check_joint, divide_for_bed
from scantruss.export.printed.plates import PrintedPart, lay_out, pack
from scantruss.export.printed.write import print_parts
from scantruss.export.solid import as_solid, build_solid, is_watertight, unite
from scantruss.schedules.joints import find_joints

GRIDS = {
    "dome": lambda: dome(6, 30.0),
    "fan": lambda: fan(40.0),
    "closed": lambda: icosahedron(40.0),
    "two": lambda: two_pieces(40.0),
}
SIZES: dict[str, Any] = {"member": 3.0, "node": 6.0, "scale": 1.0, "clearance": 0.3, "sides": 12, "marks": False}
BED = (90.0, 80.0, 60.0)


def parts_of(name: str, **others: Any) -> list[PrintedPart]:
    return build_parts(GRIDS[name](), **(SIZES | {"bed": BED} | others))


@pytest.mark.parametrize("name", GRIDS)
def test_parts_are_watertight_keep_their_openings_hold_each_node_once_and_fit_the_bed(name: str) -> None:
    grid, parts = GRIDS[name](), parts_of(name)
    assert len(parts) > 1
    assert sorted(np.concatenate([part.nodes for part in parts]).tolist()) == np.unique(grid.edges).tolist()
    plates = lay_out(parts, BED, 5.0, "mm")
    solids = [solid for plate in plates for _, solid in plate]
    assert len(solids) == len(parts) and len({name for plate in plates for name, _ in plate}) == len(parts)
    for solid in solids:
        assert is_watertight(solid.triangles) and solid.components == 1 and solid.notes == []
        mesh = trimesh.Trimesh(solid.vertices, solid.triangles, process=False)
        assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume == pytest.approx(solid.volume)
        assert (solid.vertices >= -1e-9).all() and (solid.vertices <= np.array(BED) + 1e-9).all()
    for plate in plates:
        for (_, one), (_, two) in combinations(plate, 2):
            low = np.maximum(one.vertices.min(axis=0), two.vertices.min(axis=0))[:2]
            high = np.minimum(one.vertices.max(axis=0), two.vertices.max(axis=0))[:2]
            assert (low - high).max() >= 5.0 - 1e-9  # apart by the gap


@pytest.mark.parametrize("name", GRIDS)
def test_volumes_add_up_and_only_the_clearance_is_missing(name: str) -> None:
    parts = parts_of(name)
    volumes = [part.body.volume() for part in parts]
    whole = build_solid(GRIDS[name](), member_diameter=3.0, node_diameter=6.0)
    assert unite([part.body for part in parts]).volume() == pytest.approx(sum(volumes), rel=1e-9)
    radius, clearance = 3.0, 0.3
    half = 1.4 * radius + clearance
    joints = sum(1 for a, b in GRIDS[name]().edges if part_at(parts, a) != part_at(parts, b))
    ring = (
        np.pi * ((radius + clearance) ** 2 - radius**2) * 2 * (half + clearance)
        + np.pi * 2 * (radius + clearance) ** 2 * clearance
    )
    socket = np.pi * ((1.5 + clearance) ** 2 * (radius + clearance) - 1.5**2 * radius)
    coupling = np.pi * radius**2 * 2 * half
    assert -joints * (ring + 1.1 * socket) <= sum(volumes) - whole.volume <= joints * coupling


def part_at(parts: list[PrintedPart], node: int) -> int:
    return next(k for k, part in enumerate(parts) if node in part.nodes)


def test_both_halves_of_a_member_that_is_cut_carry_its_mark() -> None:
    """Letters are taken off outside, clear of the ball and the coupling."""
    plain, marked = (parts_of("fan", marks=marks) for marks in (False, True))
    grid, joint = GRIDS["fan"](), Joint(3.0, SIZES["clearance"])
    part_of = np.empty(len(grid.nodes), int)
    for number, part in enumerate(marked):
        part_of[part.nodes] = number
    cut = grid.edges[part_of[grid.edges[:, 0]] != part_of[grid.edges[:, 1]]]
    normals = find_joints(grid).normal
    taken = [
        np.concatenate(
            [
                each.to_mesh64().vert_properties[:, :3]
                for each in (one.body - other.body).decompose()
                if each.volume() > 1e-3
            ]
        )
        for one, other in zip(plain, marked, strict=True)
    ]
    assert len(cut) > 2
    for near, far in [*cut.tolist(), *cut[:, ::-1].tolist()]:
        way = (grid.nodes[far] - grid.nodes[near]) / np.linalg.norm(grid.nodes[far] - grid.nodes[near])
        points = taken[part_of[near]] - grid.nodes[near]
        along = points @ way
        across = points - along[:, None] * way
        clear = (along > 3.0) & (along < 20.0 - joint.reach) & (np.linalg.norm(across, axis=1) < 1.5 + 1e-6)
        assert clear.sum() > 20 and (across[clear] @ (normals[near] + normals[far]) > 0).all()


@pytest.mark.parametrize("name", ["dome", "closed"])
def test_joints_have_the_clearance_and_slide_together_along_one_direction(name: str) -> None:
    """Drawn apart by a little, two parts are apart by that little at their faces, and by the clearance around their pegs."""
    grid = GRIDS[name]()
    bed = (60.0, 60.0, 60.0)
    parts = parts_of(name, bed=bed)
    part_of = np.array([part_at(parts, node) for node in range(len(grid.nodes))])
    joint = check_joint(grid, 3.0, 6.0, 1.0, 0.3)
    same, wanted = divide_for_bed(grid.nodes, grid.edges, bed, 3.0, joint.reach)
    np.testing.assert_array_equal(same, part_of)
    found = 0
    for a, b in combinations(range(len(parts)), 2):
        between = (np.sort(part_of[grid.edges], axis=1) == (a, b)).all(axis=1)
        if not between.any():
            continue
        [way] = np.unique(wanted[between].round(9), axis=0)
        lower = (grid.nodes[parts[a].nodes] @ way).mean() < (grid.nodes[parts[b].nodes] @ way).mean()
        one, two = (parts[a].body, parts[b].body) if lower else (parts[b].body, parts[a].body)
        assert (one ^ two).volume() == pytest.approx(0.0, abs=1e-9)
        for step in (0.1, 0.3, 2.0):
            assert one.min_gap(two.translate(tuple(way * step)), 1.0) >= min(step, 0.3) * (1 - 1e-6)
        assert one.min_gap(two.translate(tuple(-way * 0.1)), 1.0) == 0.0  # the faces meet
        side = np.cross(way, np.eye(3)[np.abs(way).argmin()])
        side /= np.linalg.norm(side)
        assert (one ^ two.translate(tuple(side * 0.4 + way * 0.1))).volume() > 0.0  # pegs hold them sideways
        found += 1
    assert found > 1


def test_the_same_parts_again() -> None:
    one, two = (parts_of("dome", marks=True) for _ in range(2))
    for first, second in zip(one, two, strict=True):
        assert first.name == second.name
        np.testing.assert_array_equal(first.body.to_mesh64().vert_properties, second.body.to_mesh64().vert_properties)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"clearance": 0.9}, "leaves no wall around a socket"),
        ({"clearance": 0.0}, "clearance must be a positive number"),
        ({"bed": (20.0, 20.0, 20.0)}, "a node with half of its members needs"),
        ({"node": 14.0}, "and a plug joint needs"),
    ],
)
def test_what_does_not_work_is_refused_in_figures(change: dict[str, Any], words: str) -> None:
    with pytest.raises(st.InputError, match=words):
        parts_of("dome", **change)


def test_lengths_in_refusals_have_their_unit() -> None:
    grid = replace(GRIDS["dome"](), unit="mm")
    refused: list[tuple[dict[str, Any], str]] = [
        ({"member": 3.0, "node": 2.0}, r"a node .* members, so give at least 3 mm"),
        ({"clearance": 0.9}, r"clearance 0\.9 mm leaves .* couplings of \S+ mm; give at most \S+ mm or"),
        ({"bed": (20.0, 20.0, 20.0)}, r"needs \S+ x \S+ x \S+ mm and the bed is 20 x 20 x 20 mm;"),
        ({"node": 14.0}, r"has \S+ mm from its middle .* needs \S+ mm; give"),
    ]
    for change, words in refused:
        with pytest.raises(st.InputError, match=words):
            build_parts(grid, **(SIZES | {"bed": BED} | change))


def test_parts_that_overlap_are_refused() -> None:
    one, two, *_ = parts_of("dome")
    check_apart([one, two])
    with pytest.raises(st.InputError, match=f"{one.name} and {two.name} would overlap by"):
        check_apart([one, replace(two, body=one.body.translate((0.1, 0.0, 0.0)))])


@given(some.lists(some.tuples(*[some.floats(0.1, 10.0)] * 3), min_size=1, max_size=30))
def test_packed_parts_lie_on_the_bed_and_apart(sizes: list[tuple[float, float, float]]) -> None:
    bed, gap = (10.0, 12.0, 10.0), 0.5
    plates = pack(np.array(sizes), bed, gap)
    assert sorted(place.part for plate in plates for place in plate) == list(range(len(sizes)))
    for plate in plates:
        boxes = []
        for place in plate:
            w, d, _ = sizes[place.part]
            w, d = (d, w) if place.turned else (w, d)
            assert place.x >= 0 and place.y >= 0 and place.x + w <= bed[0] + 1e-9 and place.y + d <= bed[1] + 1e-9
            boxes.append((place.x, place.y, place.x + w, place.y + d))
        for a, b in combinations(boxes, 2):
            assert max(a[0] - b[2], b[0] - a[2], a[1] - b[3], b[1] - a[3]) >= gap - 1e-9
    assert all(plates)


def test_marks_are_engraved_outside_and_take_little() -> None:
    grid = dome(4, 30.0)
    plain = build_solid(grid, member_diameter=3.0, node_diameter=9.0, sides=32)
    marked = build_solid(grid, member_diameter=3.0, node_diameter=9.0, sides=32, marks=True)
    assert is_watertight(marked.triangles) and marked.genus == plain.genus and marked.notes == []
    taken = (plain.volume - marked.volume) / (16 + len(grid.edges))
    height = letter_height("N001", 4.5)
    assert 0 < taken < 1.1 * 4.5 * height * 4.5 and 1.0 < height < 3.0
    normals = find_joints(grid).normal
    new = marked.vertices[
        ~np.isin(marked.vertices.round(6).view("f8,f8,f8"), plain.vertices.round(6).view("f8,f8,f8")).ravel()
    ]
    near = np.linalg.norm(new[:, None] - grid.nodes, axis=2)
    at = near.argmin(axis=1)
    on_ball = near.min(axis=1) < 4.5 + 1e-6
    up = ((new - grid.nodes[at]) * normals[at]).sum(axis=1)
    assert (up[on_ball] > 0).all() and set(at[on_ball].tolist()) == set(range(16))
    start, end = grid.nodes[grid.edges].transpose(1, 0, 2)
    way, middle = (end - start) / grid.lengths[:, None], (start + end) / 2
    out = normals[grid.edges].sum(axis=1)
    away = new[~on_ball, None] - middle
    along = (away * way).sum(axis=2)
    across = np.linalg.norm(away - along[:, :, None] * way, axis=2)
    across[np.abs(along) > (grid.lengths - 9.0) / 2] = np.inf  # beyond the clear length
    of = across.argmin(axis=1)
    assert set(of.tolist()) == set(range(len(grid.edges))) and across.min(axis=1).max() < 1.5 + 1e-6
    assert ((away[np.arange(len(of)), of] * out[of]).sum(axis=1) > 0).all()


@pytest.mark.parametrize("name", ["dome", "closed"])
def test_balls_take_their_rods_and_no_sockets_meet(name: str) -> None:
    grid = GRIDS[name]()
    balls, floor = build_nodes(grid, **(SIZES | {"node": 16.0, "marks": True}))
    from manifold3d import Manifold

    for ball in balls:
        node = int(ball.nodes[0])
        solid = as_solid(ball.body, "mm", 1, 0)
        assert (
            is_watertight(solid.triangles) and solid.genus == 0 and solid.components == 1
        )  # sockets that met would make a tunnel
        mine = np.flatnonzero((grid.edges == node).any(axis=1))
        for member in mine.tolist():
            a, b = grid.edges[member].tolist()
            way = (grid.nodes[b] - grid.nodes[a]) / grid.lengths[member] * (1 if a == node else -1)
            rod = Manifold.cylinder(8.0, 1.5, 1.5, 64).translate((0.0, 0.0, float(floor[node]) + 1e-3))
            x = np.cross(np.eye(3)[np.abs(way).argmin()], way)
            x /= np.linalg.norm(x)
            rod = rod.transform(np.stack([x, np.cross(way, x), way, np.zeros(3)], axis=1))
            assert (rod ^ ball.body).volume() == pytest.approx(0.0, abs=1e-9)
            thick = Manifold.cylinder(8.0, 1.9, 1.9, 64).translate((0.0, 0.0, float(floor[node]) + 1e-3))
            assert (
                thick.transform(np.stack([x, np.cross(way, x), way, np.zeros(3)], axis=1)) ^ ball.body
            ).volume() > 0.1
    with pytest.raises(
        st.InputError, match=r"sockets of N\d+ would meet in a ball of 6 mm; it needs a --node-diameter of"
    ):
        build_nodes(grid, **SIZES)


def test_the_command_writes_plates_or_balls_or_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(dome(5, 30.0), "grid.json")
    sizes = "--member-diameter 3 --node-diameter 6"
    for _ in range(2):  # our own are replaced
        assert main(f"print grid.json a.3mf {sizes} --bed 100x90x60 --marks".split()) == 0
    said = capsys.readouterr().out
    assert "parts with plug joints" in said and "marks are" in said
    files = sorted(tmp_path.glob("a_*.3mf"))
    parts = build_parts(dome(5, 30.0), **(SIZES | {"bed": (100.0, 90.0, 60.0), "marks": True, "clearance": 0.45}))
    volume = 0.0
    for file in files:
        scene = trimesh.load(file)
        for mesh in scene.geometry.values():
            assert mesh.is_watertight and (mesh.bounds[1] <= np.array([100, 90, 60]) + 1e-4).all()
            volume += mesh.volume
    assert volume == pytest.approx(sum(part.body.volume() for part in parts), rel=1e-5)
    assert main(f"print grid.json b.stl {sizes} --bed 100x90x60".split()) == 0
    assert all(trimesh.load(file).is_watertight for file in tmp_path.glob("b_*.stl"))
    assert main("print grid.json n.stl --member-diameter 3 --node-diameter 14 --sockets --clearance 0.2".split()) == 0
    assert len(list(tmp_path.glob("n_N*.stl"))) == 25
    head, *rows = csv.reader(Path("n_rods.csv").read_text().splitlines())
    made = build_nodes(dome(5, 30.0), **(SIZES | {"node": 14.0, "clearance": 0.2, "sides": 32}))[1]
    grid = dome(5, 30.0)
    assert head == ["rod", "start", "end", "length [mm]"] and len(rows) == len(grid.edges)
    np.testing.assert_allclose([float(row[3]) for row in rows], grid.lengths - made[grid.edges].sum(axis=1))
    assert main("print grid.json p.3mf --member-diameter 3 --node-diameter 14 --sockets --bed 60x60x20".split()) == 0
    assert 1 < len(list(tmp_path.glob("p_*.3mf"))) < 25
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for line, reason in (
        (f"{sizes} --bed 100x90", "200x200x200"),
        (f"{sizes} --bed 10x10x10", "give a larger --bed"),
        (f"{sizes} --sockets", "would meet"),
        (f"{sizes} --clearance 0.2", "give --bed or --sockets"),
        (f"{sizes} --bed 100x90x60 --clearance 2", "no wall"),
    ):
        assert main(["print", "grid.json", "c.3mf", *line.split()]) == 2
        said = capsys.readouterr().err
        assert reason in said and said.count("\n") == 1, said
    Path("q_1.3mf").write_text("mine")
    assert main(f"print grid.json q.3mf {sizes} --bed 100x90x60".split()) == 2
    assert "q_1.3mf exists already" in capsys.readouterr().err
    Path("q_1.3mf").unlink()
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_parts_need_a_bed_of_three_sizes(tmp_path: Path) -> None:
    for bed, words in (
        (None, "parts need the bed"),
        ((1.0, 2.0), "three positive numbers"),
        ((1.0, 2.0, 0.0), "three positive"),
    ):
        with pytest.raises(st.InputError, match=words):
            print_parts(fan(40.0), tmp_path / "a.3mf", member_diameter=3.0, node_diameter=6.0, bed=bed)  # type: ignore[arg-type]
    strip = make_grid([(0, 0, 0), (100, 0, 0), (50, 80, 0)], [(0, 1, 2)])
    made = print_parts(strip, tmp_path / "a.3mf", member_diameter=3.0, node_diameter=6.0, bed=(200.0, 200.0, 200.0))
    assert made.files == ("a_1.3mf",) and made.parts == 1


def test_parts_lie_with_their_outside_and_its_marks_up() -> None:
    normals = find_joints(GRIDS["dome"]()).normal
    for part in parts_of("dome"):
        assert part.flat[2] @ normals[part.nodes].sum(axis=0) > 0
        assert np.linalg.det(part.flat) == pytest.approx(1.0)
