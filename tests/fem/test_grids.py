"""Grids between lines of nodes, and meshes of other libraries."""

import meshio
import numpy as np
import pytest
import skfem

from fecontact import ElasticBody, Mesh, modal_basis
from fecontact.core.errors import InputError, MeshError
from fecontact.fem import mesh_from

X, Y, Z = np.linspace(0.0, 0.2, 6), [0.0, 0.01, 0.03], [-0.01, 0.0, 0.02, 0.03]


@pytest.mark.parametrize("lines", [(X, Y), (X, Y, Z)])
def test_grids_have_named_sides_and_corners(lines):
    mesh = Mesh.grid(*lines)
    assert len(mesh.cells) == np.prod([len(line) - 1 for line in lines])
    sides = {"left": (0, 0), "right": (0, -1), "bottom": (-1, 0), "top": (-1, -1)}
    if len(lines) == 3:
        sides |= {"front": (1, 0), "back": (1, -1)}
    assert set(mesh.boundaries) == set(sides)
    for name, (axis, end) in sides.items():
        facets = mesh.boundaries[name]
        assert len(facets) == len(mesh.cells) / (len(lines[axis]) - 1)
        assert (mesh.nodes[facets][..., axis] == lines[axis][end]).all()
    for name, node in mesh.points.items():
        for word in name.split():
            axis, end = sides[word]
            assert mesh.nodes[node[0], axis] == lines[axis][end]
    # Of steel, plane bodies 1 m thick.
    thick = {"thickness": 1.0} if len(lines) == 2 else {}
    assert ElasticBody(mesh, **thick).total_mass == pytest.approx(
        7850.0 * np.prod([np.ptp(line) for line in lines]))


@pytest.mark.parametrize("wrong", [[0.0], [0.0, 0.0, 1.0], [1.0, 0.0], [0.0, np.inf], "ab"])
def test_lines_that_do_not_ascend_are_refused(wrong):
    with pytest.raises(InputError, match=r"Mesh\.grid: y"):
        Mesh.grid(X, wrong)


KINDS = [skfem.MeshTri, skfem.MeshQuad, skfem.MeshTet, skfem.MeshHex]


@pytest.mark.parametrize("kind", KINDS)
def test_meshes_of_scikit_fem_keep_their_groups(kind):
    given = kind().refined(2).with_boundaries({
        "base": lambda x: x[-1] == 0.0, "side": lambda x: x[0] == 1.0}).with_subdomains({
            "half": lambda x: x[0] < 0.5})
    mesh = mesh_from(given, scale=0.1, points={"tip": (0.1,) * given.p.shape[0]})
    assert len(mesh.cells) == given.t.shape[1]
    assert len(mesh.boundaries["base"]) == len(given.boundaries["base"])
    assert (mesh.nodes[mesh.boundaries["side"]][..., 0] == pytest.approx(0.1))
    middles = mesh.nodes[mesh.cells[mesh.cell_groups["half"]]].mean(axis=1)
    assert (middles[:, 0] < 0.05).all()
    assert len(mesh.cell_groups["half"]) == len(given.subdomains["half"])
    assert mesh.nodes[mesh.points["tip"][0]] == pytest.approx(0.1)


def test_meshes_of_meshio_keep_their_groups():
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]]
    by_sets = meshio.Mesh(
        points, [("quad", [[0, 1, 2, 3], [1, 4, 5, 2]]), ("line", [[0, 1], [1, 4]]),
                 ("vertex", [[2]])],
        cell_sets={"base": [None, [0, 1], None], "tip": [None, None, [0]],
                   "right half": [[1], None, None]}, point_sets={"C": [3]})
    physical = meshio.Mesh(
        points, by_sets.cells, field_data={"base": np.array([7, 1]), "tip": np.array([7, 0]),
                                           "right half": np.array([2, 2])},
        point_data={}, cell_data={"gmsh:physical": [np.array([1, 2]), np.array([7, 7]),
                                                    np.array([7])]})
    for given in (by_sets, physical):
        mesh = mesh_from(given)
        assert mesh.boundaries["base"].tolist() == [[0, 1], [1, 4]]
        assert mesh.points["tip"].tolist() == [2]
        assert mesh.cell_groups["right half"].tolist() == [1]
    assert mesh_from(by_sets).points["C"].tolist() == [3]


def test_meshes_of_pyvista_have_the_same_modes():
    pyvista = pytest.importorskip("pyvista")
    box = Mesh.grid(np.linspace(0.0, 0.1, 4), np.linspace(0.0, 0.02, 3), np.linspace(0.0, 0.02, 3))
    cells = np.hstack([np.full((len(box.cells), 1), 8), box.cells])
    grid = pyvista.UnstructuredGrid(cells.ravel(), np.full(len(box.cells), 12), box.nodes)
    found = mesh_from(grid, boundaries={"left": (-1.0, -1.0, -1.0, 1e-9, 1.0, 1.0)})
    assert len(found.boundaries["left"]) == 4
    ours, theirs = (modal_basis(ElasticBody(one, fixed={"left": "xyz"}), 4, contact=())
                    for one in (box, found))
    assert theirs.frequencies_hz == pytest.approx(ours.frequencies_hz, rel=1e-9)


def test_what_is_no_mesh_is_named():
    with pytest.raises(InputError, match="mesh_from: ndarray is no mesh of meshio"):
        mesh_from(np.zeros((3, 2)))
    with pytest.raises(InputError, match="scale"):
        mesh_from(skfem.MeshTri(), scale=0.0)
    with pytest.raises(MeshError, match="mesh_from:"):
        mesh_from(meshio.Mesh([[0, 0, 0], [1, 0, 0]], [("line", [[0, 1]])]))
