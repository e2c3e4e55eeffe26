"""Wedges, pyramids and mixed meshes, cut into tetrahedra."""

import meshio
import numpy as np
import pytest
from solid_blocks import block_mesh

from fecontact import ElasticBody, MeshError, modal_basis, read_mesh
from fecontact.fem.mesh_files.cut_cells import PYRAMID, SHAPES, WEDGE, cut_into_tetrahedra
from fecontact.reduction import eigenfrequencies_hz
from fecontact.study.imported import imported

SIZE = (0.2, 0.03, 0.02)


def wedges(counts, size=SIZE):
    """Corners of wedges along x: the hexahedra of a block, cut along a diagonal of y and z."""
    block = block_mesh(counts, size)
    a, b, c, d, e, f, g, h = block.cells.T
    return block.nodes, np.concatenate([np.stack([a, d, h, b, c, g], axis=1),
                                        np.stack([a, h, e, b, g, f], axis=1)])


def second_order(nodes, cells, kind, bend=None):
    """All nodes and second-order cells, whose middles lie where ``bend`` takes straight ones."""
    ends = np.sort(cells[:, np.array(kind.edges)], axis=2)
    pairs, number = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    middles = nodes[pairs].mean(axis=1)
    places = np.concatenate([nodes, middles])
    return (places if bend is None else bend(places),
            np.concatenate([cells, len(nodes) + number.reshape(len(cells), -1)], axis=1))


def deck(path, nodes, *blocks, extra=""):
    types = {4: "C3D4", 10: "C3D10", 5: "C3D5", 13: "C3D13", 6: "C3D6", 15: "C3D15", 8: "C3D8",
             20: "C3D20"}
    text = "*NODE\n" + "".join(f"{k}, {', '.join(map(repr, place))}\n"
                               for k, place in enumerate(nodes.tolist(), start=1))
    first = 1
    for cells in blocks:
        text += f"*ELEMENT, TYPE={types[cells.shape[1]]}, ELSET=E\n" + "".join(
            f"{k}, {', '.join(map(str, row))}\n"
            for k, row in enumerate((cells + 1).tolist(), start=first))
        first += len(cells)
    path.write_text(text + extra)
    return path


def area(mesh, facets):
    a, b, c = np.moveaxis(mesh.nodes[facets], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0


@pytest.mark.parametrize("order", [1, 2])
def test_a_bar_of_wedges_has_the_volume_faces_and_frequencies_of_hexahedra(tmp_path, order):
    nodes, cells = wedges((8, 2, 1))
    if order == 2:
        nodes, cells = second_order(nodes, cells, WEDGE)
    # Triangles are at the ends, S1 at x = 0; below are S3 ... S5.
    low = [(k + 1, side) for k, row in enumerate(cells)
           for side, face in ((3, (0, 1, 4, 3)), (4, (1, 2, 5, 4)), (5, (2, 0, 3, 5)))
           if (nodes[row[list(face)], 2] == 0.0).all()]
    first = np.flatnonzero((nodes[cells[:, :3], 0] == 0.0).all(axis=1)) + 1
    surfaces = ("*SURFACE, NAME=left\n" + "".join(f"{k}, S1\n" for k in first)
                + "*SURFACE, NAME=low\n" + "".join(f"{k}, S{side}\n" for k, side in low))
    mesh = read_mesh(deck(tmp_path / "a.inp", nodes, cells, extra=surfaces))
    assert mesh.kind.name == "tetrahedra"
    assert len(mesh.cells) == 3 * len(cells)
    assert len(mesh.curved_edges) == 0
    assert mesh.volume == pytest.approx(np.prod(SIZE), rel=1e-12)
    assert area(mesh, mesh.boundary("left")) == pytest.approx(SIZE[1] * SIZE[2], rel=1e-12)
    assert area(mesh, mesh.boundary("low")) == pytest.approx(SIZE[0] * SIZE[1], rel=1e-12)
    hexahedra = ElasticBody(block_mesh((8, 2, 1), SIZE), fixed={"left": "xyz"})
    assert eigenfrequencies_hz(ElasticBody(mesh, fixed={"left": "xyz"}), 5) == pytest.approx(
        eigenfrequencies_hz(hexahedra, 5), rel=2e-2)
    basis = modal_basis(ElasticBody(mesh, fixed={"left": "xyz"}), 4, contact="low",
                        contact_nodes=3)
    assert basis.tributary.sum() == pytest.approx(SIZE[0] * SIZE[1], rel=1e-12)


def test_frequencies_of_fifteen_node_wedges_are_about_those_of_calculix(tmp_path):
    """The free bar of 32 wedges C3D15 in CalculiX 2.20, steel: *FREQUENCY."""
    nodes, cells = second_order(*wedges((8, 2, 1)), WEDGE)
    found = eigenfrequencies_hz(ElasticBody(read_mesh(deck(tmp_path / "a.inp", nodes, cells))), 10)
    assert found[6:8] == pytest.approx((2576.396, 3710.544), rel=5e-3)
    assert found[8:] == pytest.approx((6762.118, 7166.114), rel=1.5e-2)


@pytest.mark.parametrize("seed", range(4))
def test_cells_are_cut_alike_on_both_sides_of_a_face_for_any_numbers(tmp_path, seed):
    nodes, cells = wedges((3, 2, 2))
    order = np.random.default_rng(seed).permutation(len(nodes))
    mesh = read_mesh(deck(tmp_path / "a.inp", nodes[order], np.argsort(order)[cells]))
    assert mesh.volume == pytest.approx(np.prod(SIZE), rel=1e-12)
    x, y, z = SIZE
    assert area(mesh, mesh.outline) == pytest.approx(2.0 * (x * y + y * z + z * x), rel=1e-12)


def test_second_order_wedges_follow_curved_faces(tmp_path):
    """A quarter of a tube of 3 x 1 x 1 cells of wedges: the volume of parabolic edges."""
    def bend(places):
        turn, radius = 0.5 * np.pi * places[:, 0], 1.0 + places[:, 1]
        return np.stack([radius * np.cos(turn), radius * np.sin(turn), places[:, 2]], axis=1)

    exact = 0.25 * np.pi * 3.0
    nodes, cells = wedges((3, 1, 1), (1.0, 1.0, 1.0))
    straight = read_mesh(deck(tmp_path / "a.inp", bend(nodes), cells))
    curved = read_mesh(deck(tmp_path / "a.inp", *second_order(nodes, cells, WEDGE, bend)))
    assert straight.volume < 0.96 * exact
    assert curved.volume == pytest.approx(exact, rel=1e-3)
    # Diagonals of the curved faces are curved too.
    ends = curved.curved_edges
    assert len(ends) > np.count_nonzero(np.ptp(curved.nodes[ends][:, :, 2], axis=1) == 0.0)
    radius = np.linalg.norm(curved.curved_middles[:, :2], axis=1)
    outer = (np.linalg.norm(curved.nodes[ends][:, :, :2], axis=2) > 1.999).all(axis=1)
    assert radius[outer] == pytest.approx(2.0, rel=2e-3)


# A cube with a pyramid on top, a wedge at its right side and a tetrahedron at the wedge's end.
PLACES = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1),
                   (0, 1, 1), (0.5, 0.5, 2), (2, 0, 0), (2, 1, 0), (1.5, -1, 0)], float)
MIXED = [("hexahedron", [[0, 1, 2, 3, 4, 5, 6, 7]]), ("pyramid", [[4, 5, 6, 7, 8]]),
         ("wedge", [[1, 9, 5, 2, 10, 6]]), ("tetra", [[1, 9, 5, 11]])]


@pytest.mark.parametrize("seed", [None, 0, 1])
@pytest.mark.parametrize("form", ["a.vtu", "a.msh", "a.inp", "second order"])
def test_mixed_meshes_are_cut_into_tetrahedra(tmp_path, form, seed):
    order = (np.arange(len(PLACES)) if seed is None
             else np.random.default_rng(seed).permutation(len(PLACES)))
    blocks = [(kind, np.argsort(order)[np.array(cells)]) for kind, cells in MIXED]
    nodes = PLACES[order]
    if form == "second order":
        done = []
        for _, cells in blocks:
            pairs = cells[:, np.array(SHAPES[cells.shape[1]].edges)].reshape(-1, 2)
            done.append(np.concatenate([cells, len(nodes) + np.arange(len(pairs))[None]], axis=1))
            nodes = np.concatenate([nodes, nodes[pairs].mean(axis=1)])
        path = deck(tmp_path / "a.inp", nodes, *done)
    elif form == "a.inp":
        path = deck(tmp_path / form, nodes, *(cells for _, cells in blocks))
    else:
        path = tmp_path / form
        meshio.write(path, meshio.Mesh(nodes, blocks), **(
            {"file_format": "gmsh22", "binary": False} if form == "a.msh" else {}))
    mesh = read_mesh(path)
    assert mesh.kind.name == "tetrahedra"
    assert len(mesh.cells) == 6 + 2 + 3 + 1
    assert mesh.volume == pytest.approx(1.0 + 1.0 / 3.0 + 0.5 + 1.0 / 6.0, rel=1e-12)
    assert len(mesh.outline) == 2 * 4 + 4 + (2 * 2 + 1) + 3
    assert len(mesh.curved_edges) == 0


@pytest.mark.parametrize(("corners", "order", "kind", "note"), [
    (6, 1, "C3D6", "64 cells C3D6 are cut into quadratic tetrahedra, which are softer: by"),
    (6, 2, "C3D15", "64 cells C3D15 are cut into quadratic tetrahedra. This raises frequencies"),
    (8, 1, "C3D8R", "32 bricks C3D8R (one point) become second-order hexahedra. With"),
    (8, 1, "C3D8I", "32 bricks C3D8I become second-order hexahedra, with nearly the same"),
    (8, 1, "C3D8", None),
])
def test_an_import_tells_elements_that_are_read_as_others(tmp_path, corners, order, kind, note):
    block = block_mesh((8, 2, 2), SIZE)
    nodes, cells = wedges((8, 2, 2)) if corners == 6 else (block.nodes, block.cells)
    if order == 2:
        nodes, cells = second_order(nodes, cells, WEDGE)
    path = deck(tmp_path / "a.inp", nodes, cells, extra=(
        "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n"
        "*SOLID SECTION, ELSET=E, MATERIAL=STEEL\n"))
    path.write_text(path.read_text().replace("TYPE=C3D8", f"TYPE={kind}"))
    found = imported(path)
    assert dict(found.contents.elements) == {kind: len(cells)}
    assert [one.startswith(note) for one in found.notes] == ([True] if note else [])
    if note:
        assert f"# {note}" in found.toml(tmp_path)


def test_folded_wedges_and_pyramids_are_refused(tmp_path):
    nodes, cells = wedges((1, 1, 1))
    used, folded = np.unique(cells[:1], return_inverse=True)
    folded = folded.reshape(1, 6)
    folded[0, [0, 3]] = folded[0, [3, 0]]
    with pytest.raises(MeshError, match=r"1 wedges have no volume, or are folded or inverted, the "
                                        r"first at \(0\.1, "):
        read_mesh(deck(tmp_path / "a.inp", nodes[used], folded))
    places = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 0)], float)
    with pytest.raises(MeshError, match=r"1 pyramids have no volume"):
        cut_into_tetrahedra(places, np.arange(5), np.arange(5)[None], PYRAMID)
