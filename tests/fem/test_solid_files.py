"""Solids from files of all formats, written by Gmsh and by hand, with their named faces."""

import math

import meshio
import numpy as np
import pytest
from solid_blocks import block_mesh

from fecontact import ElasticBody, InputError, MeshError, read_mesh
from fecontact.fem.faces.surface import Surface

SIDE, HEIGHT, HOLE = 0.1, 0.03, 0.02
VOLUME = (SIDE**2 - math.pi * HOLE**2) * HEIGHT
AREAS = {"contact": SIDE**2 - math.pi * HOLE**2, "top": SIDE**2 - math.pi * HOLE**2,
         "hole": 2 * math.pi * HOLE * HEIGHT}
FORMATS = {"a.msh": 1e-12, "b.msh2": 1e-12, "a.inp": 1e-12, "a.bdf": 2e-4, "a.med": 1e-12,
           "a.vtk": 1e-12}


@pytest.fixture(scope="module")
def drilled(tmp_path_factory):
    """Plates with a hole: folders of files by kind of elements and order."""
    gmsh = pytest.importorskip("gmsh")
    folders = {}
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        for hexahedra in (False, True):
            for order in (1, 2):
                folder = tmp_path_factory.mktemp("drilled")
                _write(gmsh, folder, hexahedra, order)
                folders[hexahedra, order] = folder
    finally:
        gmsh.finalize()
    return folders


def _write(gmsh, folder, hexahedra, order):
    gmsh.clear()
    gmsh.model.add("drilled")
    occ, half = gmsh.model.occ, SIDE / 2
    if hexahedra:
        plate = occ.addRectangle(-half, -half, 0, SIDE, SIDE)
        flat, _ = occ.cut([(2, plate)], [(2, occ.addDisk(0, 0, 0, HOLE, HOLE))])
        occ.extrude(flat, 0, 0, HEIGHT, [2], recombine=True)
    else:
        plate = occ.addBox(-half, -half, 0, SIDE, SIDE, HEIGHT)
        occ.cut([(3, plate)], [(3, occ.addCylinder(0, 0, 0, 0, 0, HEIGHT, HOLE))])
    occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="steel")
    for _, tag in gmsh.model.getEntities(2):
        x0, _, z0, x1, _, z1 = gmsh.model.getBoundingBox(2, tag)
        name = ("contact" if z1 < 1e-4 else "top" if z0 > HEIGHT - 1e-4 else
                "hole" if max(abs(x0), abs(x1)) < 0.5 * half else "")
        if name:
            gmsh.model.addPhysicalGroup(2, [tag], name=name)
    gmsh.model.addPhysicalGroup(1, [gmsh.model.getEntities(1)[0][1]], name="rim")
    gmsh.model.addPhysicalGroup(0, [gmsh.model.getEntities(0)[0][1]], name="corner")
    for option, value in (("MeshSizeMax", 0.012), ("ElementOrder", order),
                          ("RecombineAll", int(hexahedra)), ("RecombinationAlgorithm", 3)):
        gmsh.option.setNumber(f"Mesh.{option}", value)
    gmsh.model.mesh.generate(3)
    for name in FORMATS:
        gmsh.write(str(folder / name))
    (folder / "b.msh2").rename(folder / "b.msh")


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("hexahedra", [False, True])
def test_all_formats_hold_the_same_solid(drilled, name, order, hexahedra):
    path = drilled[hexahedra, order] / name.replace("msh2", "msh")
    mesh = read_mesh(path)
    assert [*mesh.cell_counts] == ["hexahedra" if hexahedra else "tetrahedra"]
    reference = read_mesh(drilled[hexahedra, order] / "a.msh")
    assert mesh.volume == pytest.approx(reference.volume, rel=FORMATS[name])
    # Curved elements fill the hole's round boundary a hundred times better.
    assert mesh.volume == pytest.approx(VOLUME, rel=1e-4 if order == 2 else 0.01)
    if order == 1:
        assert mesh.volume > 1.004 * VOLUME
    if name == "a.vtk":
        return
    body = ElasticBody(mesh)
    # Nastran has numbers of properties, which Gmsh takes from the surfaces.
    faces = sorted(Surface(body.nodes, body.facet_nodes(rows)).areas.sum()
                   for key, rows in mesh.boundaries.items()
                   if key in AREAS or name == "a.bdf")
    assert faces == pytest.approx(sorted(AREAS.values()), rel=3e-4 if order == 2 else 0.02)


def test_groups_of_lines_and_points_of_a_solid_are_points(drilled):
    mesh = read_mesh(drilled[False, 2] / "a.msh")
    assert len(mesh.points["corner"]) == 1
    assert len(mesh.points["rim"]) > 2
    body = ElasticBody(mesh, fixed={"rim": "z"})
    on_rim = body.nodes[body.fixed_dofs // 3]
    # The circle at an end of the hole, with the middles of its edges.
    assert len(on_rim) == 2 * len(mesh.points["rim"])
    assert np.hypot(on_rim[:, 0], on_rim[:, 1]) == pytest.approx(HOLE, rel=1e-9)


def test_groups_of_the_wrong_dimension_are_told(drilled):
    path = drilled[False, 1] / "a.msh"
    for name, message in (
            ("steel", "'steel', asked for as boundary 'face', holds cells, but a boundary is made "
                      "of faces of the outline; the boundaries are: 'contact', 'hole', 'top'"),
            ("rim", "'rim', asked for as boundary 'face', holds nodes or edges, or faces inside"),
            ("contcat", r"no group 'contcat', .* \(did you mean 'contact'\?\)")):
        with pytest.raises(MeshError, match=message):
            read_mesh(path, boundaries={"face": name})
    with pytest.raises(MeshError, match="The part 'top' holds surfaces, but the file holds a "
                                        "solid; its groups of solid cells are: 'steel'"):
        read_mesh(path, part="top")
    assert read_mesh(path, part="steel").volume == read_mesh(path).volume


def test_boxes_and_places_of_solids(drilled):
    path = drilled[True, 1] / "a.msh"
    mesh = read_mesh(path, scale=10.0, boundaries={"held": (-0.5, -0.5, 0.0, -0.5, 0.5, 0.3),
                                                   "ground": "contact"},
                     points={"C": (0.5, 0.5, 0.3), "B": (0.4, 0.0, 0.15)})
    assert mesh.volume == pytest.approx(1e3 * read_mesh(path).volume, rel=1e-12)
    assert (mesh.nodes[mesh.boundary("held")][..., 0] == -0.5).all()
    assert "contact" not in mesh.boundaries
    assert mesh.nodes[mesh.points["C"][0]] == pytest.approx([0.5, 0.5, 0.3])
    with pytest.raises(MeshError, match=r"Point 'C' at \(0.0, 0.0, 0.15\) is outside the body"):
        read_mesh(path, scale=10.0, points={"C": (0.0, 0.0, 0.15)})
    with pytest.raises(MeshError, match=r"no face of the outline lies in the box .*z = 0 \.\.\. 0"):
        read_mesh(path, boundaries={"held": (5.0, 5.0, 5.0, 6.0, 6.0, 6.0)})
    with pytest.raises(InputError, match=r"or a box \(x0, y0, z0, x1, y1, z1\) in metres"):
        read_mesh(path, boundaries={"held": (0.0, 0.0, 1.0, 1.0)})
    with pytest.raises(InputError, match=r"or a place \(x, y, z\) in metres"):
        read_mesh(path, points={"C": (0.0, 0.0)})


ABAQUS = """*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE={kind}, ELSET=BODY
{cells}
*NSET, NSET=LOW, GENERATE
{low}
*SURFACE, NAME=FACES, TYPE=ELEMENT
{faces}
"""
# Faces S1, S2, ... of Abaqus by their corners, from its manual.
TETRAHEDRON = ("C3D4", [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)])
HEXAHEDRON = ("C3D8R", [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3),
                        (3, 7, 4, 0)])


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_surfaces_and_node_sets_of_abaqus(tetrahedra, tmp_path):
    mesh = block_mesh((2, 1, 1), (0.2, 0.1, 0.05), tetrahedra=tetrahedra)
    kind, sides = TETRAHEDRON if tetrahedra else HEXAHEDRON
    wanted = {frozenset(row) for row in mesh.boundary("top").tolist()}
    faces = [f"{number}, S{side}" for number, cell in enumerate(mesh.cells, start=1)
             for side, corners in enumerate(sides, start=1)
             if frozenset(cell[list(corners)].tolist()) in wanted]
    assert len(faces) == len(wanted)
    order = np.lexsort(mesh.nodes.T)  # nodes of the bottom come first
    number = np.empty(len(order), int)
    number[order] = np.arange(1, len(order) + 1)
    (tmp_path / "a.inp").write_text(ABAQUS.format(
        nodes="\n".join(f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(mesh.nodes[order], 1)),
        kind=kind, faces="\n".join(faces), low="1, 6, 1",
        cells="\n".join(f"{k}, " + ", ".join(map(str, number[row]))
                        for k, row in enumerate(mesh.cells, start=1))))
    read = read_mesh(tmp_path / "a.inp")
    assert read.volume == pytest.approx(1e-3, rel=1e-12)
    for name, height in (("FACES", 0.05), ("LOW", 0.0)):
        places = read.nodes[read.boundary(name)]
        assert (places[..., 2] == height).all()
        assert len(places) == len(wanted)
    assert "ALL" not in read.boundaries or len(read.boundaries["ALL"]) == len(read.outline)


def test_mixed_and_unread_elements_are_told(tmp_path):
    path = tmp_path / "a.vtu"
    hexahedra = block_mesh((1, 1, 1))
    with_roof = np.vstack([hexahedra.nodes, [0.1, 0.05, 0.1]])
    roof = [[4, 6, 7, 8]]
    meshio.write(path, meshio.Mesh(with_roof, [("hexahedron", hexahedra.cells), ("tetra", roof)]))
    with pytest.raises(MeshError, match=r"1 four-sided faces .* put pyramids between"):
        read_mesh(path)
    meshio.write(path, meshio.Mesh(np.tile(with_roof, (2, 1)), [
        ("hexahedron", hexahedra.cells), (kind := "VTK_LAGRANGE_WEDGE", [np.arange(18)])]))
    with pytest.raises(MeshError, match=rf"elements that are not read \({kind}\); mesh with"):
        read_mesh(path)
    surface = [("quad", hexahedra.outline)]
    meshio.write(path, meshio.Mesh(hexahedra.nodes, surface))
    with pytest.raises(MeshError, match=r"holds surfaces only, in space .*; a solid needs"):
        read_mesh(path)
    meshio.write(path, meshio.Mesh(with_roof, [("tetra", roof), ("triangle", [[4, 6, 8]])]))
    assert len(read_mesh(path).cells) == 1  # surfaces on a solid are its faces


def test_surfaces_beside_a_solid_and_faces_without_area_are_told(tmp_path):
    path = tmp_path / "a.vtu"
    mesh = block_mesh((1, 1, 1))
    nodes = np.vstack([mesh.nodes, mesh.nodes + np.eye(3)[0]])
    meshio.write(path, meshio.Mesh(nodes, [("hexahedron", mesh.cells), ("quad", mesh.outline),
                                           ("triangle", [[8, 9, 10], [0, 1, 8]])]))
    with pytest.raises(MeshError, match=r"mixes dimensions: 2 of its surface elements have nodes "
                                        r"that belong to no solid element; mesh all of the body"):
        read_mesh(path)
    # A roof instead of a block: two corners of a hexahedron coincide with two others.
    roof = mesh.nodes.copy()
    high = np.flatnonzero(roof[:, 2] > 0.0)
    roof[high, 0] = 0.0
    meshio.write(path, meshio.Mesh(roof, [("hexahedron", mesh.cells)]))
    with pytest.raises(MeshError, match="1 mesh cells have no volume: they repeat corners"):
        read_mesh(path)


def test_solids_without_a_third_coordinate_or_with_inverted_cells_are_told(tmp_path):
    mesh = block_mesh((2, 2, 2))
    nodes = mesh.nodes.copy()
    middle = np.flatnonzero((np.abs(nodes - [0.1, 0.05, 0.025]) < 1e-9).all(axis=1))
    nodes[middle] += [0.15, 0.0, 0.0]
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(nodes, [("hexahedron", mesh.cells)]))
    with pytest.raises(MeshError, match=r"a\.vtu: \d mesh cells have no volume, or are folded or "
                                        r"inverted, the first is cell \d at \("):
        read_mesh(tmp_path / "a.vtu")
    cut = block_mesh((2, 2, 2), tetrahedra=True)
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(nodes, [("tetra", cut.cells)]))
    with pytest.raises(MeshError, match="inverted or overlapping elements"):
        read_mesh(tmp_path / "a.vtu")
    (tmp_path / "a.msh").write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0\n"
        "$EndNodes\n$Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n")
    with pytest.raises(MeshError, match="1 mesh cells have no volume"):
        read_mesh(tmp_path / "a.msh")
