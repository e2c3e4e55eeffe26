"""Parts of meshes, and meshes bent to another shape."""

import numpy as np
import pytest

from fecontact import ElasticBody, InputError, Material, Mesh, MeshError
from fecontact.fem import LinearEquation, Term


def plate():
    return Mesh.grid(np.linspace(0.0, 0.4, 5), np.linspace(0.0, 0.2, 3))


def box():
    return Mesh.grid(*(np.linspace(0.0, size, n) for size, n in ((0.4, 5), (0.2, 3), (0.1, 2))))


def test_a_part_has_its_share_of_area_boundaries_and_points():
    whole = plate()
    left = whole.nodes[whole.cells, 0].max(axis=1) < 0.21
    part = whole.part(left)
    assert part.area == pytest.approx(0.5 * whole.area)
    assert len(part.boundary("bottom")) == 2
    assert "right" not in part.boundaries
    assert set(part.points) == {"bottom left", "top left"}
    assert part.nodes[part.points["top left"]] == pytest.approx(np.array([[0.0, 0.2]]))
    by_number = whole.part(np.flatnonzero(left))
    assert np.array_equal(part.cells, by_number.cells)


def test_sides_that_are_cut_off_or_inside_are_no_boundary():
    """A boundary in the middle of the body is on the outline of one of two parts alone."""
    whole = plate()
    top = whole.nodes[whole.cells, 1].max(axis=1) > 0.11
    upper = whole.part(top)
    assert sorted(upper.boundaries) == ["left", "right", "top"]
    assert len(upper.boundary("left")) == 1
    assert len(upper.outline) == 2 * (4 + 1)


def test_a_part_of_a_solid_keeps_groups_of_cells_with_their_material():
    whole = box()
    halves = {"soft": np.arange(4), "hard": np.arange(4, 8)}
    mesh = Mesh(whole.nodes, whole.cells, whole.boundaries, cell_groups=halves,
                materials={"soft": Material(1e9, 0.3, 1000.0), "hard": Material(2e11, 0.3, 8000.0)})
    part = mesh.part([2, 3, 4])
    assert {name: numbers.tolist() for name, numbers in part.cell_groups.items()} == {
        "soft": [0, 1], "hard": [2]}
    cell = 0.1 * 0.1 * 0.1
    body = ElasticBody(part, part.materials)
    assert body.mass.sum() / 3.0 == pytest.approx(cell * (2 * 1000.0 + 8000.0))
    assert part.volume == pytest.approx(3 * cell)


@pytest.mark.parametrize("order", [1.0, -1.0])
def test_a_grid_becomes_a_ring(order):
    """The area of a polygon of 64 sides; both ways round."""
    n, inner, outer = 64, 0.5, 1.0
    strip = Mesh.grid(np.linspace(0.0, np.pi, n // 2 + 1), np.linspace(inner, outer, 5))
    ring = strip.mapped(lambda x: np.column_stack(
        [order * x[:, 1] * np.cos(x[:, 0]), x[:, 1] * np.sin(x[:, 0])]))
    exact = 0.25 * n * np.sin(2.0 * np.pi / n) * (outer**2 - inner**2)
    assert ring.area == pytest.approx(exact, rel=1e-12)
    assert np.linalg.norm(ring.nodes[ring.boundary("bottom")], axis=2) == pytest.approx(inner)


def test_middles_of_curved_edges_move_along():
    """A triangle with a parabola of rise h over its longest side l has 2/3 h l more area."""
    bulged = Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]]),
                  curved_edges=np.array([[1, 2]]), curved_middles=np.array([[0.6, 0.6]]))
    assert bulged.area == pytest.approx(0.5 + 2.0 / 3.0 * 0.1 * 2.0, rel=1e-12)
    assert bulged.mapped(lambda x: x * [2.0, 1.0]).area == pytest.approx(
        2.0 * bulged.area, rel=1e-12)


def test_a_solid_is_bent_with_its_faces():
    bent = box().mapped(lambda x: x * [1.0, -1.0, 2.0])
    assert bent.volume == pytest.approx(2.0 * box().volume)
    assert bent.nodes[bent.boundary("top")][..., 2] == pytest.approx(0.2)


@pytest.mark.parametrize(("cells", "message"), [
    ([], "at least one"), ([8], "from 0 to 7"), ([True] * 3, "8 flags")])
def test_cells_that_do_not_exist_are_told(cells, message):
    with pytest.raises(InputError, match=message):
        plate().part(cells)


def test_meshes_that_cannot_be_cut_or_mapped_say_so():
    tied = Mesh(plate().nodes, plate().cells, constraints=[
        LinearEquation([Term(0, (1.0, 0.0)), Term(1, (-1.0, 0.0))])])
    with pytest.raises(InputError, match="constraints"):
        tied.part([0])
    with pytest.raises(InputError, match="constraints"):
        tied.mapped(lambda x: x)
    with pytest.raises(InputError, match="shape"):
        plate().mapped(lambda x: x[:, 0])
    with pytest.raises(MeshError):
        plate().mapped(lambda x: x * [1.0, 0.0])
