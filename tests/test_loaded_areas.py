"""Areas that carry loads: laws of their sums and shares on panels of any size, and of the side that is out."""

import numpy as np
import pytest
from small_grids import dome, icosahedron, make_grid

import scantruss as st
from scantruss.grid.grid import Grid
from scantruss.grid.panels import first_triangles, panel_of_triangles, table_of, triangles_of
from scantruss.structure.areas import loaded_areas
from scantruss.structure.truss import Truss, area_vectors


def panel_grid(nodes: np.ndarray, loops: list[list[int]]) -> Grid:
    panels = table_of(loops)
    return make_grid(nodes, triangles_of(nodes, panels), unit="m", panels=panels)


def ring(count: int, rng: np.random.Generator | None = None) -> tuple[np.ndarray, list[int]]:
    """Return a regular panel, or one that is bent and of any shape."""
    angle = 2 * np.pi * np.arange(count) / count
    nodes = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return (nodes if rng is None else nodes + 0.2 * rng.standard_normal(nodes.shape)), list(range(count))


@pytest.mark.parametrize("count", [3, 4, 5, 6, 7])
def test_nodes_of_a_regular_panel_share_its_load_evenly(count: int) -> None:
    nodes, loop = ring(count)
    truss = Truss.from_grid(panel_grid(nodes, [loop]), supports="boundary", loads="cladding:1kN/m2,snow:1kN/m2")
    for case in truss.cases:
        assert case.nodal is not None
        assert case.nodal[:, 2] == pytest.approx(np.full(count, -1000 * np.sin(2 * np.pi / count) / 2))


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_nodes_carry_the_force_and_moment_of_the_area(count: int) -> None:
    rng = np.random.default_rng(count)
    nodes, loop = ring(count, rng)
    areas = loaded_areas(nodes, table_of([loop]))
    forces = rng.standard_normal(areas.vectors.shape)
    nodal = areas.on_nodes(forces)[:, :3]
    assert nodal.sum(axis=0) == pytest.approx(forces.sum(axis=0))
    assert np.cross(nodes, nodal).sum(axis=0) == pytest.approx(np.cross(areas.middles, forces).sum(axis=0))
    flat = area_vectors(nodes, triangles_of(nodes, table_of([loop])))
    assert areas.vectors.sum(axis=0) == pytest.approx(flat.sum(axis=0))  # of any surface within one loop


def test_a_corner_that_turns_inwards_counts_no_area_twice() -> None:
    nodes = np.array([[0, 0, 0], [4, 0, 0], [4, 1, 0], [1, 1, 0], [1, 4, 0], [0, 4, 0]], float)
    areas = loaded_areas(nodes, table_of([list(range(6))]))
    assert (areas.signs < 0).any()
    assert areas.surface.sum() == pytest.approx(7.0) and areas.plan.sum() == pytest.approx(7.0)


def test_triangles_of_panels_are_found_again() -> None:
    panels = table_of([[0, 1, 2], [1, 3, 4, 2], [3, 5, 6, 7, 8, 4]])
    owner = panel_of_triangles(panels)
    assert owner[first_triangles(panels)].tolist() == [0, 1, 2]
    assert first_triangles(panels).tolist() == [int(np.flatnonzero(owner == k)[0]) for k in range(3)]


def test_each_piece_is_loaded_from_above_and_pressed_from_outside() -> None:
    """A dome that faces down, and a closed body inside out, in one grid with a dome that faces up."""
    one, body = dome(6, 2.0), icosahedron(2.0)
    parts = [(one.nodes, one.triangles), (one.nodes + [40, 0, 0], one.triangles[:, ::-1]),
             (body.nodes + [80, 0, 0], body.triangles[:, ::-1])]  # fmt: skip
    starts = np.cumsum([0, *(len(nodes) for nodes, _ in parts)])
    triangles = np.concatenate([faces + start for (_, faces), start in zip(parts, starts, strict=False)])
    grid = make_grid(np.concatenate([nodes for nodes, _ in parts]), triangles, unit="m")
    truss = Truss.from_grid(grid, supports=np.arange(len(grid.nodes)), loads="snow:1kN/m2,wind:1kN/m2:1")
    snow, wind = (case.nodal for case in truss.cases)
    assert snow is not None and wind is not None
    first, second, third = (slice(*pair) for pair in zip(starts, starts[1:], strict=False))
    assert snow[second] == pytest.approx(snow[first]) and wind[second] == pytest.approx(wind[first])
    around = grid.nodes[third] - grid.nodes[third].mean(axis=0)
    assert ((wind[third][:, :3] * around).sum(axis=1) < 0).all()  # pressure pushes inwards
    assert snow[third][around[:, 2].argmax(), 2] < 0 and snow[third][around[:, 2].argmin(), 2] == 0


def test_a_body_with_a_hole_on_top_keeps_its_outside() -> None:
    """Of most of a sphere, open above, more faces down than up; it is no bowl."""
    body = icosahedron(2.0)
    z = body.nodes[body.triangles].mean(axis=1)[:, 2]
    grid = make_grid(body.nodes, body.triangles[z < np.sort(z)[-2]], unit="m")
    truss = Truss.from_grid(grid, supports="lowest:1", loads="wind:1kN/m2:1")
    assert truss.triangles.tolist() == grid.triangles.tolist()


def test_half_of_the_snow_in_every_direction() -> None:
    grid = dome(6, 2.0, unit="m")
    truss = Truss.from_grid(grid, supports="boundary", loads="half-snow:1kN/m2@all")
    assert [case.name for case in truss.cases] == [f"half-snow {angle}" for angle in range(0, 360, 30)]
    some = Truss.from_grid(grid, supports="boundary", loads="half-snow:1kN/m2@30,half-snow:1kN/m2@210")
    both = sum(case.nodal for case in some.cases if case.nodal is not None)
    whole = Truss.from_grid(grid, supports="boundary", loads="snow:1kN/m2").cases[0].nodal
    assert both == pytest.approx(whole)


@pytest.mark.parametrize(
    ("loads", "said"),
    [
        ("half-snow:1kN/m2,half-snow:1kN/m2@0", "the load half-snow 0 is given 2 times"),
        ("snow:1kN/m2@all", "snow has no direction"),
        ("wind:1kN/m2:nan", "coefficients of wind are numbers"),
        ("wind:1kN/m2:inf/0@30", "coefficients of wind are numbers"),
    ],
)
def test_loads_that_say_nothing_are_refused(loads: str, said: str) -> None:
    with pytest.raises(st.InputError, match=said):
        Truss.from_grid(dome(4, 2.0, unit="m"), supports="boundary", loads=loads)


def test_what_faces_no_way_up_has_no_half_of_snow() -> None:
    wall = make_grid([(0, 0, 0), (2, 0, 0), (0, 0, 2), (2, 0, 2)], [(0, 1, 2), (1, 3, 2)], unit="m")
    with pytest.raises(st.InputError, match="no part of the grid faces up"):
        Truss.from_grid(wall, supports="lowest:0", loads="half-snow:1kN/m2")


def test_a_piece_without_support_is_named() -> None:
    grid = dome(4, 2.0)
    both = make_grid(
        [*grid.nodes, *(grid.nodes + [40, 0, 9])], [*grid.triangles, *(grid.triangles + len(grid.nodes))], unit="m"
    )
    with pytest.raises(st.InputError, match="the piece of the node N017 and 15 more has no support"):
        st.solve(Truss.from_grid(both, supports="lowest:3"))
