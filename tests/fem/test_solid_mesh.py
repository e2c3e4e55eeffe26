"""Meshes of solids: volume, outline, placing, refinement, curved edges; unusable meshes."""

import numpy as np
import pytest
from solid_blocks import block_mesh

from fecontact import InputError, Mesh, MeshError

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
                 (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
TETRAHEDRON = CUBE[[0, 1, 3, 4]]


def outward(mesh, facets):
    """Area vectors of faces by the cross product of their diagonals or sides."""
    at = mesh.nodes[facets]
    if facets.shape[1] == 3:
        return 0.5 * np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
    return 0.5 * np.cross(at[:, 2] - at[:, 0], at[:, 3] - at[:, 1])


def distorted(tetrahedra):
    """A block whose inner nodes are moved, and cells of both orientations."""
    mesh = block_mesh((3, 3, 3), (0.3, 0.2, 0.1), tetrahedra=tetrahedra)
    rng = np.random.default_rng(3)
    inner = ((mesh.nodes > 1e-9) & (mesh.nodes < np.array([0.3, 0.2, 0.1]) - 1e-9)).all(axis=1)
    nodes = mesh.nodes + 0.006 * rng.standard_normal(mesh.nodes.shape) * inner[:, None]
    cells = mesh.cells.copy()
    turned = [0, 2, 1, 3] if tetrahedra else [4, 5, 6, 7, 0, 1, 2, 3]
    cells[::2] = cells[::2][:, turned]
    return Mesh(nodes, cells, mesh.boundaries)


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_outline_encloses_the_volume_and_looks_outwards(tetrahedra):
    mesh = distorted(tetrahedra)
    assert mesh.dimension == 3
    assert mesh.volume == pytest.approx(0.3 * 0.2 * 0.1, rel=1e-12)
    areas = outward(mesh, mesh.outline)
    assert np.abs(areas.sum(axis=0)).max() < 1e-15
    # Gauss: the flux of x through the outline is three times the volume.
    centres = mesh.nodes[mesh.outline].mean(axis=1)
    assert (areas * centres).sum() == pytest.approx(3.0 * 0.006, rel=1e-12)
    assert outward(mesh, mesh.boundary("contact")).sum(axis=0) == pytest.approx(
        [0.0, 0.0, -0.06], abs=1e-15)
    assert sum(map(len, mesh.boundaries.values())) == len(mesh.outline)


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_faces_given_the_other_way_round_are_turned(tetrahedra):
    mesh = block_mesh((1, 2, 1), tetrahedra=tetrahedra)
    turned = Mesh(mesh.nodes, mesh.cells, {"top": mesh.boundary("top")[:, ::-1]})
    assert outward(turned, turned.boundary("top")).sum(axis=0)[2] == pytest.approx(0.02, rel=1e-12)


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_refined_cells_fill_the_body_and_its_faces(tetrahedra):
    mesh = distorted(tetrahedra)
    fine = mesh.refined()
    assert len(fine.cells) == 8 * len(mesh.cells)
    assert fine.volume == pytest.approx(mesh.volume, rel=1e-12)
    assert np.array_equal(fine.nodes[:len(mesh.nodes)], mesh.nodes)
    for name, faces in mesh.boundaries.items():
        assert len(fine.boundary(name)) == 4 * len(faces)
        assert outward(fine, fine.boundary(name)).sum(axis=0) == pytest.approx(
            outward(mesh, faces).sum(axis=0), abs=1e-15)
    assert len(fine.refined().cells) == 64 * len(mesh.cells)


def parabolic(tetrahedra):
    """A block whose top is raised to z = 1 + x (1 - x), by its edges alone."""
    mesh = block_mesh((1, 1, 1), (1.0, 1.0, 1.0), tetrahedra=tetrahedra)
    ends = mesh.edges[0]
    middle = mesh.nodes[ends].mean(axis=1)
    bent = (middle[:, 2] == 1.0) & (middle[:, 0] == 0.5)
    middles = middle[bent] + [0.0, 0.0, 0.25]
    return Mesh(mesh.nodes, mesh.cells, mesh.boundaries, {}, ends[bent], middles)


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_curved_edges_bound_the_volume_also_when_refined_and_placed(tetrahedra):
    mesh = parabolic(tetrahedra)
    assert mesh.volume == pytest.approx(1.0 + 1.0 / 6.0, rel=1e-12)
    for other in (mesh.refined(), mesh.placed((3.0, -1.0, 2.0), (30.0, -40.0, 75.0), "z")):
        assert other.volume == pytest.approx(mesh.volume, rel=1e-12)
    fine = mesh.refined()
    top = fine.curved_middles[np.isin(fine.curved_edges, fine.boundary("top")).all(axis=1)]
    x, _, z = top.T
    assert np.abs(z - 1.0 - x * (1.0 - x)).max() < 1e-14


def test_plane_curved_edges_bound_the_area_also_when_refined():
    mesh = Mesh([(0, 0), (2, 0), (2, 1), (0, 1)], [[0, 1, 2, 3]], {}, {}, [[3, 2]], [(1, 1.3)])
    for other in (mesh, mesh.refined(), mesh.refined().refined(), mesh.placed((1, 2), 30.0, "x")):
        assert other.area == pytest.approx(2.0 + 2.0 / 3.0 * 2.0 * 0.3, rel=1e-12)


def test_placed_solids_are_turned_about_the_axes_in_their_order():
    mesh = block_mesh((1, 1, 1), (1.0, 2.0, 3.0))
    assert mesh.placed(rotation=90.0).nodes == pytest.approx(
        mesh.nodes[:, [1, 0, 2]] * [-1.0, 1.0, 1.0], abs=0.0)
    # About x, then the fixed y: (x, y, z) -> (x, -z, y) -> (y, -z, -x).
    assert mesh.placed((0.0, 0.0, 1.0), (90.0, 90.0, 0.0)).nodes == pytest.approx(
        mesh.nodes[:, [1, 2, 0]] * [1.0, -1.0, -1.0] + [0.0, 0.0, 1.0], abs=0.0)
    flat = mesh.placed(mirror="z")
    assert flat.volume == pytest.approx(6.0, rel=1e-14)
    assert outward(flat, flat.boundary("contact")).sum(axis=0)[2] == pytest.approx(2.0)
    for given, message in (({"shift": (1.0, 2.0)}, "three finite numbers"),
                           ({"rotation": (1.0, 2.0)}, "or three about x, y, z"),
                           ({"mirror": "w"}, "'x', 'y' or 'z'")):
        with pytest.raises(InputError, match=message):
            mesh.placed(**given)


FLAT = CUBE * [1.0, 1.0, 0.0]
FOLDED = CUBE.copy()
FOLDED[6] = [0.2, 0.2, 0.1]


def test_hanging_nodes_are_refused():
    """Nodes of a square beside two, and of cubes where one is cut into eight."""
    square = [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (2, 0.5), (2, 1), (1, 0.5)]
    cells = [[0, 1, 2, 3], [1, 4, 5, 7], [7, 5, 6, 2]]
    with pytest.raises(MeshError, match="node 7 lies inside the edge between mesh nodes 1 and 2"):
        Mesh(square, cells)
    thirds = [(2, 1 / 3), (2, 2 / 3), (1, 1 / 3), (1, 2 / 3)]
    with pytest.raises(MeshError, match="node 8 lies inside the edge between mesh nodes 1 and 2"):
        Mesh([*square[:5], (2, 1), *thirds],
             [[0, 1, 2, 3], [1, 4, 6, 8], [8, 6, 7, 9], [9, 7, 5, 2]])
    # A slit whose sides have nodes of their own is part of a body.
    Mesh([*square, (1, 1)], [[0, 1, 2, 3], [1, 4, 5, 7], [7, 5, 6, 8]])
    large = Mesh(CUBE, [np.arange(8)])
    small = large.placed((1.0, 0.0, 0.0)).refined()
    nodes, number = np.unique(np.concatenate([large.nodes, small.nodes]), axis=0,
                              return_inverse=True)
    with pytest.raises(MeshError, match=r"hanging node.* share whole faces"):
        Mesh(nodes, number.reshape(-1)[np.concatenate([large.cells, small.cells + 8])])


@pytest.mark.parametrize(("arguments", "message"), [
    ((CUBE, [[0, 1, 2]]), r"\(M, 4\) for tetrahedra, .* or \(M, 8\) for hexahedra .* not \(1, 3\)"),
    ((FLAT, [np.arange(8)]), "1 mesh cells have no volume, or are folded or inverted, the first"),
    ((FLAT[:4], [[0, 1, 2, 3]]), "1 mesh cells have no volume, the first is cell 0"),
    ((FOLDED, [np.arange(8)]), "folded or inverted, the first is cell 0"),
    ((CUBE, [[0, 1, 2, 3, 4, 5, 7, 6]]), "folded or inverted"),
    # The fifth node of the second cell has gone through the face that both share.
    (([*TETRAHEDRON, (0.2, 0.2, 0.3)], [[0, 1, 2, 3], [1, 2, 0, 4]]),
     r"faces have both of their cells on one side, the first at \(0\.333333, 0\.333333, 0\): the "
     r"mesh has inverted or overlapping elements"),
    (([*TETRAHEDRON, (0, 0, -1.0), (0, 0, -2.0)], [[0, 1, 2, 3], [0, 1, 2, 4], [0, 1, 2, 5]]),
     "face of mesh nodes .* belongs to more than two cells"),
    ((TETRAHEDRON, [[0, 1, 2, 3]], {"a": [[0, 1]]}), r"must have shape \(k, 3\), rows of nodes"),
    ((CUBE, [np.arange(8)], {"a": [[0, 1, 2]]}), r"must have shape \(k, 4\)"),
    ((CUBE, [np.arange(8)], {"a": [[0, 1, 6, 7]]}),
     "'a' has 1 faces that are not on the outline of the mesh, the first has the nodes 0, 1, 6, 7"),
    ((CUBE, [np.arange(8)], {"a": [[0, 1, 2, 3], [3, 2, 1, 0]]}), "'a' names a face twice"),
    ((TETRAHEDRON, [[0, 1, 2, 3]], {}, {}, [[0, 1]]), r"curved_middles must be .* shape \(1, 3\)"),
    ((CUBE, [np.arange(8)], {}, {}, [[0, 6]], [[0.5, 0.5, 0.5]]), "must be edges of cells"),
    ((TETRAHEDRON, [[0, 1, 2, 3]], {}, {}, [[0, 1]], [[0.5, 0.6, 0.6]]),
     "1 curved mesh cells are folded, the first is cell 0"),
])
def test_unusable_solids_are_refused(arguments, message):
    with pytest.raises(MeshError, match=message):
        Mesh(*arguments)


@pytest.mark.parametrize("shape", ["block", "plate"])
def test_overlapping_parts_are_refused(shape):
    """Parts without common nodes; those that touch, or lie apart, are accepted."""
    part = block_mesh((2, 2, 2)) if shape == "block" else Mesh(
        [(0, 0), (0.5, 0), (1, 0), (0, 1), (0.5, 1), (1, 1)], [[0, 1, 4, 3], [1, 2, 5, 4]])
    across = (0.0,) * (part.dimension - 1)

    def joined(shift, scale=1.0):
        nodes = np.concatenate([part.nodes, scale * part.nodes + shift])
        return Mesh(nodes, np.concatenate([part.cells, part.cells + len(part.nodes)]))

    for shift in (np.ptp(part.nodes[:, 0]), 2.0 * np.ptp(part.nodes[:, 0])):
        assert len(joined((shift, *across)).cells) == 2 * len(part.cells)
    for shift, scale in (((0.7 * np.ptp(part.nodes[:, 0]), *across), 1.0),
                         ((0.1 * np.ptp(part.nodes, axis=0)), 0.05)):
        with pytest.raises(MeshError, match=r"Mesh cells \d+ and \d+ overlap at \(.*; remove"):
            joined(shift, scale)


def test_area_is_of_plane_bodies_and_volume_of_solids():
    with pytest.raises(MeshError, match="A solid has a volume"):
        _ = block_mesh((1, 1, 1)).area
    with pytest.raises(MeshError, match="A plane body has an area"):
        _ = Mesh([(0, 0), (1, 0), (0, 1)], [[0, 1, 2]]).volume


def test_summary_tells_what_a_solid_is():
    said = dict(block_mesh((2, 1, 1), (0.2, 0.1, 0.05)).summary())
    assert said["hexahedra"] == "2"
    assert said["volume"] == "0.001 m³"
    assert said["boundary contact"] == "2 faces"
    assert said["z"] == "0 ... 0.05 m"
