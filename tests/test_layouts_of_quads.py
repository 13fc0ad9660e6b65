"""Double layers and few lengths of grids of quads and hexagons: what is under what, what holds, and the commands."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.json import encode_json
from scantruss.grid.panels import sides_of, table_of, triangles_of
from scantruss.layouts.families import lengths_needed
from scantruss.structure.layered import framework_of
from scantruss.structure.statics import solve


def vault(count: int = 8, uneven: float = 0.0) -> st.Grid:
    """Quads of about 2 m over a square, shallowly vaulted both ways."""
    x, y = np.meshgrid(np.arange(count + 1.0), np.arange(count + 1.0), indexing="ij")
    plan = 2.0 * np.stack([x.ravel(), y.ravel()], axis=1)
    inner = (np.abs(plan - count) < count).all(axis=1)
    plan += uneven * np.expand_dims(inner, 1) * np.random.default_rng(3).standard_normal(plan.shape)
    away = plan - count
    nodes = np.column_stack([plan, 4.0 - 0.03 * (away**2).sum(axis=1)])
    first = np.array([(count + 1) * i + j for i in range(count) for j in range(count)])
    panels = np.stack([first, first + count + 1, first + count + 2, first + 1], axis=1)
    return grid_of(nodes, panels)


def grid_of(nodes: np.ndarray, panels: np.ndarray) -> st.Grid:
    return st.Grid(
        nodes=nodes,
        triangles=triangles_of(nodes, panels),
        panels=panels,
        fixed=np.zeros(len(nodes), bool),
        unit="m",
        origin=np.zeros(3),
    )


def honeycomb(rows: int = 5) -> st.Grid:
    """Flat hexagons of members of 1 m."""
    turns = np.radians(60.0 * np.arange(6) + 30.0)
    places: dict[tuple[int, int], int] = {}
    nodes: list[list[float]] = []
    loops = []
    for row in range(rows):
        for column in range(rows):
            middle = np.array([3**0.5 * (column + 0.5 * (row % 2)), 1.5 * row])
            loop = []
            for corner in middle + np.stack([np.cos(turns), np.sin(turns)], axis=1):
                key = (round(1000 * corner[0]), round(1000 * corner[1]))
                if key not in places:
                    places[key] = len(nodes)
                    nodes.append([*corner, 0.0])
                loop.append(places[key])
            loops.append(loop)
    return grid_of(np.array(nodes), table_of(loops))


@pytest.mark.parametrize("make", [vault, honeycomb])
@pytest.mark.parametrize("second", ["dual", "same"])
def test_counts_and_depth(make: Callable[[], st.Grid], second: str) -> None:
    grid = make()
    made = st.double_layer(grid, 0.6, second=second)
    nodes, edges, panels = len(grid.nodes), len(grid.edges), len(grid.panel_table)
    inner, corners = int((grid.edge_uses == 2).sum()), len(sides_of(grid.panel_table))
    counts = (edges, inner, corners) if second == "dual" else (edges, edges, nodes + edges)
    assert tuple(len(ids) for ids in made.groups.values()) == counts
    assert np.array_equal(made.nodes[:nodes], grid.nodes) and np.array_equal(made.members[:edges], grid.edges)
    middles = np.array([grid.nodes[loop].mean(axis=0) for loop in grid.panel_loops])
    first = middles if second == "dual" else grid.nodes
    assert np.linalg.norm(made.nodes[nodes:] - first, axis=1) == pytest.approx(0.6)
    assert len(made.layers.panels) == (panels if second == "same" else sum(is_inner(grid)))


def is_inner(grid: st.Grid) -> np.ndarray:
    inner = np.ones(len(grid.nodes), bool)
    inner[grid.edges[grid.edge_uses == 1].ravel()] = False
    return inner


@pytest.mark.parametrize("second", ["dual", "same"])
@pytest.mark.parametrize("edges", ["tapered", "closed"])
def test_quads_held_at_their_boundary_are_no_mechanism_and_their_layers_are_seen_from_one_side(
    second: str, edges: str
) -> None:
    grid = vault()
    truss = st.Truss.from_grid(
        grid, supports="boundary", loads="self,snow:1kN/m2", double_layer=0.8, second_layer=second, layer_edges=edges
    )
    assert truss.pinned and truss.layers is not None
    assert solve(truss).cases[0].displacements[:, 2].min() < 0
    for panel in truss.layers.panels:
        a, b, c = truss.nodes[panel[:3]]
        assert np.cross(b - a, c - b)[2] > 0
    layered = framework_of(truss)
    assert np.array_equal(layered.edges, truss.members) and layered.cells == "quad"
    assert np.bincount(layered.edge_uses[: len(grid.edges)]).tolist() == np.bincount(grid.edge_uses).tolist()
    assert (layered.edge_uses[len(grid.edges) :] == 0).all()


def test_a_layered_structure_of_quads_goes_to_files_schedules_and_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("vault.json").write_bytes(encode_json(vault(4)))
    words = "structure vault.json roof.json roof.obj --supports boundary --loads self --double-layer 0.8m"
    assert main(words.split()) == 0
    assert main("schedule roof.json parts.csv".split()) == 0
    assert Path("parts_inner_panels.csv").exists()
    assert main("setout roof.json site.xlsx".split()) == 0
    assert main("print roof.json roof.stl --member-diameter 0.1 --node-diameter 0.2".split()) == 0
    faces = [line for line in Path("roof.obj").read_text().splitlines() if line.startswith("f ")]
    assert {len(face.split()) for face in faces} == {5}


def test_uneven_quads_come_to_fewer_lengths_on_their_surface() -> None:
    grid = vault(8, uneven=0.12)
    mean = float(grid.lengths.mean())
    found = st.few_lengths(grid, 0.01, 6)
    before, after = (len(lengths_needed(each.lengths, 0.01 * mean, 0.95)) for each in (grid, found.grid))
    assert after <= 6 < before
    made = found.grid
    assert made.panels is not None and grid.panels is not None
    assert np.array_equal(made.panels, grid.panels) and len(made.triangles) == 2 * len(made.panels)
    assert np.array_equal(made.triangles, triangles_of(made.nodes, made.panels))
    surface = 4.0 - 0.03 * ((made.nodes[:, :2] - 8.0) ** 2).sum(axis=1)
    assert np.abs(made.nodes[:, 2] - surface).max() < 0.05 * mean
    boundary = ~is_inner(grid)
    sides = made.nodes[boundary, :2]
    assert np.minimum(np.abs(sides), np.abs(sides - 16.0)).min(axis=1).max() < 1e-6


def test_the_command_takes_quads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("vault.json").write_bytes(encode_json(vault(6, uneven=0.12)))
    words = "families vault.json few.json --count 5 --report few-report.json --keep-failed"
    assert main(words.split()) == 0
    report = json.loads(Path("few-report.json").read_text())
    needed = report["lengths_needed"]["95 % within 1 %"]
    assert needed["after"] < needed["before"]
    assert st.read_grid("few.json").cells == "quad"
