import pickle
from dataclasses import replace

import numpy as np
import pytest

from fecontact import Mesh, MeshError

SQUARE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
# Two quadrilaterals side by side, the second one given clockwise.
NODES = np.array([[0, 0], [1, 0], [3, 0], [0, 1], [1, 1], [3, 1]], float)
CELLS = np.array([[0, 1, 4, 3], [1, 4, 5, 2]])


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def test_area_extent_and_orientation() -> None:
    mesh = Mesh(NODES, CELLS)
    assert mesh.area == pytest.approx(3.0, abs=1e-15)
    assert mesh.extent == pytest.approx(np.hypot(3, 1), abs=1e-15)
    corners = mesh.nodes[mesh.cells]
    turn = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
    assert (turn > 0).all()


def test_triangle_area_is_that_of_the_formula() -> None:
    mesh = Mesh([[0, 0], [4, 1], [1, 3]], [[0, 2, 1]])
    assert mesh.area == pytest.approx(0.5 * (4 * 3 - 1 * 1), abs=1e-14)


def test_outline_runs_round_the_body_once_with_the_body_on_its_left() -> None:
    outline = Mesh(NODES, CELLS).outline
    assert sorted(map(sorted, outline.tolist())) == [[0, 1], [0, 3], [1, 2], [2, 5], [3, 4], [4, 5]]
    start, end = NODES[outline[:, 0]], NODES[outline[:, 1]]
    # Green: the area is half the integral of x dy - y dx along a counter-clockwise outline.
    assert 0.5 * cross(start, end).sum() == pytest.approx(3.0, abs=1e-14)


def test_boundary_is_found_by_name() -> None:
    mesh = Mesh(NODES, CELLS, {"contact": [[0, 1], [2, 1]]}, {"B": 3, "C": [5, 4, 5]})
    assert mesh.boundary("contact").tolist() == [[0, 1], [2, 1]]
    assert mesh.points["B"].tolist() == [3]
    assert mesh.points["C"].tolist() == [4, 5]
    with pytest.raises(MeshError, match=r"no boundary named 'contcat' \(did you mean 'contact'\?\)"
                                        r"; its boundaries are: 'contact'"):
        mesh.boundary("contcat")


def test_mesh_is_immutable_and_owns_its_arrays() -> None:
    nodes = NODES.copy()
    mesh = Mesh(nodes, CELLS)
    nodes[0] = 9
    assert mesh.nodes[0].tolist() == [0, 0]
    with pytest.raises(ValueError, match="read-only"):
        mesh.nodes[0, 0] = 1


def test_mesh_survives_pickling() -> None:
    mesh = pickle.loads(pickle.dumps(Mesh(NODES, CELLS, {"contact": [[0, 1]]})))
    assert mesh.area == pytest.approx(3.0)
    assert mesh.boundary("contact").tolist() == [[0, 1]]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[0, 0, 0, 0]], [[0, 0, 0]]), r"nodes must have shape \(N, 2\), .* not \(1, 4\)"),
        ((SQUARE, [[0, 1]]), r"cells must have shape .* not \(1, 2\)"),
        ((SQUARE, np.empty((0, 3))), r"M > 0, not \(0, 3\)"),
        (([[0, 0], [1, np.nan], [0, 1]], [[0, 1, 2]]), "not finite"),
        ((SQUARE, [[0, 1, 4]]), r"nodes outside 0 \.\.\. 3"),
        ((SQUARE, [[0, 1, -1]]), r"nodes outside 0 \.\.\. 3"),
        ((SQUARE, [[0, 1, 2]]), "1 mesh nodes belong to no cell"),
        ((SQUARE, [[0, 2, 1, 3]]), "no area, or are folded or inverted, the first is cell 0"),
        (([[0, 0], [2, 0], [0.5, 0.5], [0, 2]], [[0, 1, 2, 3]]), "folded"),
        (([[0, 0], [0.7, 0.1], [2.1, 0.3]], [[0, 1, 2]]), "no area"),
        ((SQUARE, [[0, 1, 2, 3]], {"contact": []}), "group 'contact' is empty"),
        ((SQUARE, [[0, 1, 2, 3]], {}, {"B": []}), "group 'B' is empty"),
        ((SQUARE, [[0, 1, 2, 3]], {}, {"B": 4}), r"group 'B' names nodes outside 0 \.\.\. 3"),
        ((SQUARE, [[0, 1, 2, 3]], {"contact": [0, 1, 2]}), r"'contact' must have shape \(k, 2\)"),
        ((SQUARE, [[0, 1, 2, 3]], {"contact": [[0, 2]]}),
         "'contact' has 1 edges that are not on the outline of the mesh, the first joins nodes 0"),
        ((SQUARE, [[0, 1, 2, 3]], {"contact": [[0, 1], [1, 0]]}), "'contact' names an edge twice"),
        ((NODES, [*CELLS.tolist(), [1, 2, 5, 4]]), "edge between mesh nodes 1 and 4 belongs to"),
    ],
)
def test_unusable_meshes_are_refused(arguments: tuple, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        Mesh(*arguments)


def test_nodes_and_cells_of_a_mesh_are_checked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mesh of the same arrays takes what is known; of others, of moved nodes too, all is new."""
    from fecontact.fem import mesh as module

    counted = []
    check = module.require_no_overlap
    monkeypatch.setattr(module, "require_no_overlap",
                        lambda *given: (counted.append(given), check(*given)))
    mesh = Mesh(NODES, CELLS)
    again = replace(mesh, points={"B": [0]})
    assert len(counted) == 1
    assert again.nodes is mesh.nodes
    assert again.boundaries == mesh.boundaries
    folded = mesh.nodes.copy()
    folded[4] = (-0.5, 0.5)
    with pytest.raises(MeshError, match="folded"):
        Mesh(folded, mesh.cells)
    assert len(Mesh(mesh.nodes + 1.0, mesh.cells).outline) == 6
    assert len(counted) == 2
    assert len(replace(pickle.loads(pickle.dumps(mesh)), points={"B": [0]}).outline) == 6
