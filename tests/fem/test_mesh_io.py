import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest

from fecontact import InputError, Mesh, MeshError, ModelWarning, read_mesh, write_mesh

# 3 x 2 cells of 0.1 m x 0.05 m: nodes 0 ... 3 along the bottom, 8 ... 11 along the top.
X, Y = np.meshgrid(np.linspace(0.0, 0.3, 4), np.linspace(0.0, 0.1, 3))
NODES = np.column_stack([X.ravel(), Y.ravel()])
QUADS = np.array([[k, k + 1, k + 5, k + 4] for k in (0, 1, 2, 4, 5, 6)])
TRIANGLES = np.concatenate([QUADS[:, [0, 1, 2]], QUADS[:, [0, 2, 3]]])
BOTTOM = np.array([[0, 1], [1, 2], [2, 3]])
LEFT = np.array([[4, 0], [8, 4]])
TOP_MIDDLE = 9


@pytest.fixture(autouse=True)
def silence(capfd: pytest.CaptureFixture[str]) -> Iterator[None]:
    """Whatever is read or written, nothing is printed."""
    yield
    assert capfd.readouterr() == ("", "")


def flat(nodes: np.ndarray = NODES) -> np.ndarray:
    return np.column_stack([nodes, np.zeros(len(nodes))])


def quad_mesh(**groups: dict) -> Mesh:
    return Mesh(NODES, QUADS, **groups)


def same_edges(a: np.ndarray, b: np.ndarray) -> bool:
    return sorted(map(sorted, np.asarray(a).tolist())) == sorted(map(sorted, b.tolist()))


def length(mesh: Mesh, boundary: str) -> float:
    edges = mesh.nodes[mesh.boundary(boundary)]
    return float(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum())


def write_gmsh(path: Path, version: str, binary: bool, cells: np.ndarray = QUADS) -> Path:
    """A file with a curve ``Bottom``, a point ``Drive`` and an empty curve, written by meshio."""
    kind = "quad" if cells.shape[1] == 4 else "triangle"
    blocks = [("vertex", [[TOP_MIDDLE]]), ("line", BOTTOM), (kind, cells)]
    tags = [[3], [7] * len(BOTTOM), [1] * len(cells)]
    dim_tags = np.tile([2, 1], (len(NODES), 1))
    dim_tags[TOP_MIDDLE] = 0, 3
    dim_tags[1] = 1, 7
    mesh = meshio.Mesh(
        flat(), blocks,
        point_data={"gmsh:dim_tags": dim_tags},
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"Drive": [3, 0], "Bottom": [7, 1], "Nothing": [9, 1], "Body": [1, 2]},
    )
    meshio.gmsh.write(path, mesh, version, binary=binary)
    return path


@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
@pytest.mark.parametrize("version", ["2.2", "4.1"])
@pytest.mark.parametrize("cells", [QUADS, TRIANGLES], ids=["quads", "triangles"])
def test_gmsh_groups_are_boundaries_and_points(
    tmp_path: Path, version: str, binary: bool, cells: np.ndarray
) -> None:
    mesh = read_mesh(write_gmsh(tmp_path / "a.msh", version, binary, cells))
    assert mesh.area == pytest.approx(0.03, rel=1e-12)
    assert np.array_equal(mesh.nodes, NODES)
    assert np.array_equal(mesh.cells, cells)
    assert list(mesh.boundaries) == ["Bottom"]
    assert same_edges(mesh.boundary("Bottom"), BOTTOM)
    assert {name: nodes.tolist() for name, nodes in mesh.points.items()} == {"Drive": [TOP_MIDDLE]}


def test_physical_groups_without_a_name_go_by_their_number(tmp_path: Path) -> None:
    path = write_gmsh(tmp_path / "a.msh", "4.1", False)
    text = path.read_text()
    path.write_text(text[:text.index("$PhysicalNames")] + text[text.index("$Entities"):])
    mesh = read_mesh(path, boundaries={"contact": "7"})
    assert same_edges(mesh.boundary("contact"), BOTTOM)
    assert list(mesh.points) == ["3"]


GMSH_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Comments
whatever
$EndComments
$PhysicalNames
3
0 1 "edge"
1 1 "edge"
1 2 "lower side"
$EndPhysicalNames
$Entities
1 2 1 0
1 0 0 0 1 1
1 0 0 0 2 0 0 2 -1 2 2 1 -2
2 2 0 0 2 1 0 0 2 2 -3
1 0 0 0 2 1 0 0 0
$EndEntities
$Nodes
3 5 10 70
0 1 0 1
70
0 0 0
1 1 1 1
20
2 0 0 0.5
2 1 1 3
10
30
40
2 1 0 0.1 0.2
0 1 0 0.1 0.2
9 9 0 0.1 0.2
$EndNodes
$Elements
4 5 1 5
0 1 15 1
1 70
1 1 1 1
2 70 20
1 2 1 1
3 20 10
2 1 2 2
4 70 20 10
5 10 30 70
$EndElements
"""


def test_gmsh_curve_in_two_groups_reversed_and_elements_without_group(tmp_path: Path) -> None:
    """Features that meshio cannot read: the entities 1 (two groups, one reversed) and 2 (none)."""
    path = tmp_path / "a.msh"
    path.write_text(GMSH_41)
    mesh = read_mesh(path)
    # Nodes in the order of their numbers 10, 20, 30, 70; number 40 belongs to no element.
    assert mesh.nodes.tolist() == [[2, 1], [2, 0], [0, 1], [0, 0]]
    assert mesh.area == pytest.approx(2.0)
    assert same_edges(mesh.boundary("edge"), np.array([[1, 3]]))
    assert same_edges(mesh.boundary("lower side"), np.array([[1, 3]]))
    assert mesh.points["edge"].tolist() == [3]


def test_gmsh_22_cells_in_two_groups_are_read_once(tmp_path: Path) -> None:
    path = tmp_path / "a.msh"
    path.write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n5 0 1 0\n$EndNodes\n"
        "$Elements\n5\n1 1 2 4 1 1 2\n2 1 2 6 1 1 2\n3 2 2 1 1 1 2 5\n4 2 2 2 1 1 2 5\n"
        "5 15 1 8 5\n$EndElements\n")
    mesh = read_mesh(path)
    assert mesh.cells.tolist() == [[0, 1, 2]]
    assert same_edges(mesh.boundary("4"), np.array([[0, 1]]))
    assert same_edges(mesh.boundary("6"), np.array([[0, 1]]))
    assert mesh.points["8"].tolist() == [2]


def test_written_mesh_is_read_back_exactly(tmp_path: Path) -> None:
    nodes = NODES * np.pi + 1e-3 / 3
    for cells in (QUADS, TRIANGLES):
        mesh = Mesh(
            nodes, cells,
            {"contact": BOTTOM, "left": LEFT, "B": BOTTOM[:2], "all of it": Mesh(
                nodes, cells).outline},
            {"B": [4], "C": [TOP_MIDDLE, 8], "é": [4]},
        )
        write_mesh(mesh, tmp_path / "a.msh")
        again = read_mesh(tmp_path / "a.msh")
        assert np.array_equal(again.nodes, mesh.nodes)
        assert np.array_equal(again.cells, mesh.cells)
        assert sorted(again.boundaries) == sorted(mesh.boundaries)
        for name, edges in mesh.boundaries.items():
            assert same_edges(again.boundary(name), edges)
        assert {name: group.tolist() for name, group in again.points.items()} == {
            name: group.tolist() for name, group in mesh.points.items()}
    assert [file.name for file in tmp_path.iterdir()] == ["a.msh"]


def test_written_mesh_can_be_read_by_meshio(tmp_path: Path) -> None:
    write_mesh(quad_mesh(boundaries={"contact": BOTTOM}, points={"B": [4]}), tmp_path / "a.msh")
    mesh = meshio.gmsh.read(tmp_path / "a.msh")
    assert np.array_equal(mesh.points, flat())
    assert np.array_equal(mesh.cells_dict["quad"], QUADS)
    lines = mesh.cells_dict["line"][mesh.cell_sets_dict["contact"]["line"]]
    assert same_edges(lines, BOTTOM)


def write_with_meshio(path: Path, file_format: str, cells: np.ndarray = QUADS, **more) -> Path:
    kind = "quad" if cells.shape[1] == 4 else "triangle"
    meshio.write(path, meshio.Mesh(flat(), [(kind, cells)], **more), file_format)
    return path


@pytest.mark.parametrize(
    ("name", "file_format"),
    [("a.vtk", "vtk"), ("a.vtk", "vtk42"), ("a.vtu", "vtu"), ("a.bdf", "nastran"),
     ("a.nas", "nastran"), ("a.inp", "abaqus"), ("a.med", "med"), ("A.MED", "med")],
)
@pytest.mark.parametrize("cells", [QUADS, TRIANGLES], ids=["quads", "triangles"])
def test_other_formats(
    tmp_path: Path, name: str, file_format: str, cells: np.ndarray
) -> None:
    path = write_with_meshio(tmp_path / name, file_format, cells)
    mesh = read_mesh(path, boundaries={"contact": (0, 0, 0.3, 0)}, points={"B": (0.0, 0.05)})
    assert mesh.nodes == pytest.approx(NODES, abs=1e-12)
    assert np.array_equal(mesh.cells, cells)
    assert mesh.area == pytest.approx(0.03, rel=1e-10)
    assert same_edges(mesh.boundary("contact"), BOTTOM)
    assert mesh.points["B"].tolist() == [4]


def test_abaqus_node_sets_by_meshio(tmp_path: Path) -> None:
    path = write_with_meshio(
        tmp_path / "a.inp", "abaqus",
        point_sets={"Bottom": [0, 1, 2, 3], "Two": [0, 2], "All": np.arange(12), "B": [4]})
    mesh = read_mesh(path)
    assert list(mesh.boundaries) == ["Bottom"]
    assert same_edges(mesh.boundary("Bottom"), BOTTOM)
    assert {name: len(nodes) for name, nodes in mesh.points.items()} == {
        "Bottom": 4, "Two": 2, "All": 12, "B": 1}


ABAQUS = """*Heading
 ** Job name: block
*Part, name=Block
*Node
      1,           0.,           0.
      2,         100.,           0.
      3,         200.,           0.
*Node, nset=Upper
     11,           0.,          50.
     12,         100.,          50.
     13,         200.,          50.
*Element, type=CPE4R
 1,  1,  2, 12, 11
*Element, type=CPE4R,
 elset=Second
 2,  2,  3,
 13, 12
*ELEMENT, TYPE=T2D2, ELSET=Bars
 7, 1, 2
*ELEMENT, TYPE=T2D2, ELSET=Bars
 8, 2, 3
*Element, type=MASS, elset=Lump
 9, 3
*Nset, nset=Lower, generate
  1,  3,   1
*Nset, nset=OfSecond, elset=Second
*Nset, nset=Nested
 Lower, 11
*Elset, elset=_Face_S1, internal
 1, Second
*Surface, type=ELEMENT, name=Face
_Face_S1, S1
*Surface, type=ELEMENT, name=Ends
1, S4
Second, S2
*End Part
*Assembly, name=Assembly
*Instance, name=Block-1, part=Block
*End Instance
*Node
      1,          70.,         70.,           0.
*Nset, nset=ReferencePoint
 1,
*Nset, nset=B, instance=Block-1
 11,
*End Assembly
*Step
*Node Output
U,
"""


def test_abaqus_part_with_sets_and_surfaces(tmp_path: Path) -> None:
    path = tmp_path / "a.inp"
    path.write_text(ABAQUS)
    mesh = read_mesh(path, scale=1e-3)
    assert mesh.nodes == pytest.approx(np.array(
        [[0, 0], [0.1, 0], [0.2, 0], [0, 0.05], [0.1, 0.05], [0.2, 0.05]]), abs=1e-15)
    assert mesh.cells.tolist() == [[0, 1, 4, 3], [1, 2, 5, 4]]
    bottom, top = np.array([[0, 1], [1, 2]]), np.array([[4, 3], [5, 4]])
    expected = {"Upper": top, "Lower": bottom, "Bars": bottom, "Face": bottom,
                "OfSecond": np.array([[1, 2], [2, 5], [5, 4]]),
                "Nested": np.array([*bottom.tolist(), [3, 0]]),
                "Ends": np.array([[3, 0], [2, 5]])}
    assert sorted(mesh.boundaries) == sorted(expected)
    for name, edges in expected.items():
        assert same_edges(mesh.boundary(name), edges), name
    assert mesh.points["B"].tolist() == [3]
    assert "ReferencePoint" not in mesh.points


@pytest.mark.parametrize(
    ("kind", "corners"),
    [("CPS3", 3), ("CPE3", 3), ("CPS4", 4), ("cps4r", 4), ("CPE4H", 4), ("CPEG4", 4), ("S4R", 4),
     ("R3D3", 3), ("M3D4", 4), ("STRI3", 3)],
)
def test_abaqus_element_types(tmp_path: Path, kind: str, corners: int) -> None:
    path = tmp_path / "a.inp"
    corner = "4,0,1,0\n" if corners == 4 else ""
    path.write_text(f"*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n{corner}"
                    f"*ELEMENT, TYPE={kind}\n1,{','.join('1234'[:corners])}\n")
    assert read_mesh(path).area == (1.0 if corners == 4 else 0.5)


@pytest.mark.parametrize(
    ("kind", "count"), [("B21", 2), ("B22", 3), ("B33", 2), ("T2D2", 2), ("T3D3", 3), ("R2D2", 2)])
def test_abaqus_line_elements_are_boundaries(tmp_path: Path, kind: str, count: int) -> None:
    path = tmp_path / "a.inp"
    path.write_text("*NODE\n1,0,0\n2,1,0\n3,0,1\n4,0.5,0\n"
                    "*ELEMENT, TYPE=SPRINGA, ELSET=Other\n7,1,4\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n"
                    f"*ELEMENT, TYPE={kind}, ELSET=Foot\n2,{','.join('124'[:count])}\n")
    mesh = read_mesh(path)
    assert list(mesh.boundaries) == ["Foot"]
    assert mesh.boundary("Foot").tolist() == [[0, 1]]


def test_nastran_line_elements_by_property(tmp_path: Path) -> None:
    lines = np.concatenate([BOTTOM, LEFT])
    mesh = meshio.Mesh(flat(), [("line", lines), ("quad", QUADS)],
                       cell_data={"nastran:ref": [[5, 5, 5, 8, 8], [1] * 6]})
    path = tmp_path / "a.bdf"
    meshio.write(path, mesh, "nastran")
    mesh = read_mesh(path, boundaries={"contact": "5"})
    assert sorted(mesh.boundaries) == ["8", "contact"]
    assert same_edges(mesh.boundary("contact"), BOTTOM)
    assert same_edges(mesh.boundary("8"), LEFT)


def test_nastran_without_begin_bulk_in_small_letters(tmp_path: Path) -> None:
    path = tmp_path / "a.fem"
    path.write_text(
        "$ Created by Gmsh\n"
        "grid    1       0       0.00e+000.00e+000.00e+00\n"
        "grid    2       0       1.0000000.00e+000.00e+00\n"
        "grid    3       0       0.00e+002.0000000.00e+00\n"
        "cbar    1       6       1       2       0.      0.      0.\n"
        "ctria3  2       1       1       2       3\n"
        "enddata")
    mesh = read_mesh(path)
    assert mesh.area == pytest.approx(1.0, rel=1e-12)
    assert mesh.boundary("6").tolist() == [[0, 1]]


def write_med(path: Path) -> Path:
    """Groups of edges and nodes; nodes 0 and 3 are in families of their own, as MED does it."""
    lines = np.concatenate([BOTTOM, LEFT])
    mesh = meshio.Mesh(
        NODES, [("line", lines), ("quad", QUADS)],
        point_data={"point_tags": np.array([2, 3, 3, 2, 0, 0, 0, 0, 0, 4, 0, 0])},
        cell_data={"cell_tags": [np.array([-1, -1, -2, -3, -3]), np.zeros(6, int)]},
    )
    mesh.point_tags = {2: ["Ends", "Feet"], 3: ["Feet"], 4: ["Load"]}
    mesh.cell_tags = {-1: ["Bottom"], -2: ["Bottom", "Last"], -3: ["Left"]}
    meshio.write(path, mesh, "med")
    return path


def check_med(path: Path) -> None:
    mesh = read_mesh(path)
    assert np.array_equal(mesh.nodes, NODES)
    assert np.array_equal(mesh.cells, QUADS)
    assert sorted(mesh.boundaries) == ["Bottom", "Feet", "Last", "Left"]
    assert same_edges(mesh.boundary("Bottom"), BOTTOM)
    assert same_edges(mesh.boundary("Feet"), BOTTOM)
    assert same_edges(mesh.boundary("Last"), BOTTOM[2:])
    assert same_edges(mesh.boundary("Left"), LEFT)
    assert {name: nodes.tolist() for name, nodes in mesh.points.items()} == {
        "Ends": [0, 3], "Feet": [0, 1, 2, 3], "Load": [TOP_MIDDLE]}


def test_med_families(tmp_path: Path) -> None:
    check_med(write_med(tmp_path / "a.med"))


def test_med_family_without_group_and_cells_without_family(tmp_path: Path) -> None:
    path = write_med(tmp_path / "a.med")
    with h5py.File(path, "r+") as file:
        (step,) = file["ENS_MAA/mesh"].values()
        del step["MAI/QU4/FAM"]
        file["FAS/mesh/ELEME"].create_group("FAM_-9").attrs["NUM"] = -9
    check_med(path)


def test_vtk_with_data_that_meshio_cannot_read(tmp_path: Path) -> None:
    path = write_with_meshio(tmp_path / "a.vtk", "vtk")
    with path.open("ab") as file:
        file.write(b"\nPOINT_DATA 12\nSCALARS id long\nLOOKUP_TABLE default\n" + bytes(96) + b"\n")
    assert read_mesh(path).area == pytest.approx(0.03)


VTU = """<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="1">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">
0 0 0 2 0 0 2 1 0 0 1 0</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">9</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>"""


def test_vtu_as_text(tmp_path: Path) -> None:
    path = tmp_path / "a.vtu"
    path.write_text(VTU)
    assert read_mesh(path).area == 2.0
    path.write_text(VTU.replace(">9<", ">6<"))  # a strip of triangles
    with pytest.raises(MeshError, match="elements of a kind that meshio does not read"):
        read_mesh(path)


def test_meshio_is_kept_quiet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read = meshio.vtu.read

    def noisy(path: Path) -> meshio.Mesh:
        print("on the one hand")
        print("on the other", file=sys.stderr)
        warnings.warn("beware", DeprecationWarning, stacklevel=1)
        return read(path)

    path = write_with_meshio(tmp_path / "a.vtu", "vtu")
    monkeypatch.setattr(meshio.vtu, "read", noisy)
    assert read_mesh(path).area == pytest.approx(0.03)


def second_order(kind: str, shift: float = 0.0) -> meshio.Mesh:
    """One element of sides 2 and 1 with mid-side nodes, the first one moved down by ``shift``."""
    corners = np.array([[0, 0], [2, 0], [2, 1], [0, 1]], float)[:3 if kind == "triangle6" else 4]
    middles = (corners + np.roll(corners, -1, axis=0)) / 2
    middles[0, 1] -= shift
    nodes = [*corners, *middles] + ([[1, 0.5]] if kind == "quad9" else [])
    bottom = [[0, 1, len(corners)]]
    return meshio.Mesh(
        flat(np.array(nodes)), [("line3", bottom), (kind, [np.arange(len(nodes))])],
        point_data={"gmsh:dim_tags": np.tile([2, 1], (len(nodes), 1))},
        cell_data={"gmsh:physical": [[4], [1]], "gmsh:geometrical": [[4], [1]]},
        field_data={"contact": [4, 1]})


@pytest.mark.parametrize("kind", ["triangle6", "quad8", "quad9"])
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_second_order_elements_keep_corners_and_groups(
    tmp_path: Path, kind: str, version: str
) -> None:
    path = tmp_path / "a.msh"
    source = second_order(kind)
    # Entities are written for those of the nodes: one of them stands for the curve.
    source.point_data["gmsh:dim_tags"][1] = 1, 4
    meshio.gmsh.write(path, source, version, binary=False)
    mesh = read_mesh(path)
    assert mesh.area == (1.0 if kind == "triangle6" else 2.0)
    assert len(mesh.nodes) == mesh.cells.size
    assert mesh.boundary("contact").tolist() == [[0, 1]]
    assert length(mesh, "contact") == 2.0


def test_second_order_elements_of_other_formats(tmp_path: Path) -> None:
    for kind, name in (("triangle6", "a.vtu"), ("quad8", "b.vtk"), ("quad8", "c.med")):
        source = second_order(kind)
        meshio.write(tmp_path / name, meshio.Mesh(source.points, source.cells[1:]))
        assert read_mesh(tmp_path / name).area == (1.0 if kind == "triangle6" else 2.0)
    (tmp_path / "d.inp").write_text(
        "*NODE\n1,0,0\n2,2,0\n3,2,1\n4,0,1\n5,1,0\n6,2,.5\n7,1,1\n8,0,.5\n"
        "*ELEMENT, TYPE=CPE8R\n1,1,2,3,4,5,6,7,8\n*NSET, NSET=Foot\n1,5,2\n*NSET, NSET=Middle\n5\n")
    mesh = read_mesh(tmp_path / "d.inp")
    assert mesh.area == 2.0
    assert mesh.boundary("Foot").tolist() == [[0, 1]]
    assert mesh.points["Foot"].tolist() == [0, 1]
    with pytest.raises(MeshError, match="group 'Middle', asked for as point 'B', is empty"):
        read_mesh(tmp_path / "d.inp", points={"B": "Middle"})


@pytest.mark.parametrize("kind", ["triangle6", "quad8", "quad9"])
def test_curved_sides_are_kept_and_rounded_ones_are_straight(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "a.vtu"
    meshio.write(path, meshio.Mesh(second_order(kind, 0.01).points, second_order(kind).cells))
    curved = read_mesh(path)
    assert curved.curved_edges.shape == (1, 2)
    meshio.write(path, meshio.Mesh(second_order(kind, 1e-6).points, second_order(kind).cells))
    straight = read_mesh(path)
    assert len(straight.curved_edges) == 0
    # A parabola of height h over a chord L cuts off 2 h L / 3.
    ends = curved.nodes[curved.curved_edges[0]]
    length = np.linalg.norm(ends[1] - ends[0])
    assert abs(curved.area - straight.area) == pytest.approx(2.0 / 3.0 * 0.01 * length, rel=1e-9)


def test_coincident_and_unused_nodes_are_dropped(tmp_path: Path) -> None:
    rounded = NODES[QUADS].reshape(-1, 2) + np.random.default_rng(1).uniform(-1, 1, (24, 2)) * 1e-12
    each_its_own = np.concatenate([[[7.0, 7.0]], rounded])
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(
        flat(each_its_own), [("quad", 1 + np.arange(24).reshape(6, 4))]))
    mesh = read_mesh(tmp_path / "a.vtu")
    assert len(mesh.nodes) == 12
    assert mesh.area == pytest.approx(0.03)
    assert len(mesh.outline) == 10


def test_scale_applies_before_boxes_and_places(tmp_path: Path) -> None:
    path = write_gmsh(tmp_path / "a.msh", "4.1", True)
    mesh = read_mesh(path, scale=1e-3, boundaries={"held": (0.0, 1e-4, 0.0, 0.0)},
                     points={"C": (1.99e-4, 1.01e-4)})
    assert mesh.area == pytest.approx(0.03e-6, rel=1e-12)
    assert same_edges(mesh.boundary("held"), LEFT)
    assert mesh.points["C"].tolist() == [10]


def test_groups_are_renamed_and_others_kept(tmp_path: Path) -> None:
    path = write_gmsh(tmp_path / "a.msh", "4.1", True)
    mesh = read_mesh(path, boundaries={"contact": "Bottom", "foot": "Bottom"},
                     points={"B": "Drive", "C": "Bottom"})
    assert sorted(mesh.boundaries) == ["contact", "foot"]
    assert same_edges(mesh.boundary("foot"), BOTTOM)
    assert {name: nodes.tolist() for name, nodes in mesh.points.items()} == {
        "B": [TOP_MIDDLE], "C": [0, 1, 2, 3]}


def test_two_groups_can_swap_names(tmp_path: Path) -> None:
    path = tmp_path / "a.msh"
    write_mesh(quad_mesh(boundaries={"a": BOTTOM, "b": LEFT}), path)
    mesh = read_mesh(path, boundaries={"a": "b", "b": "a"})
    assert same_edges(mesh.boundary("a"), LEFT)
    assert same_edges(mesh.boundary("b"), BOTTOM)


def test_box_takes_edges_that_lie_in_it_and_tolerates_rounding(tmp_path: Path) -> None:
    path = write_with_meshio(tmp_path / "a.vtu", "vtu")
    mesh = read_mesh(path, boundaries={
        "contact": (0.29, -1, 0.05, 1e-3), "right": (0.3 + 1e-9, 0, 0.3 + 1e-9, 0.1)})
    assert same_edges(mesh.boundary("contact"), BOTTOM[1:2])
    assert length(mesh, "right") == pytest.approx(0.1)


def test_place_in_a_cell_is_in_the_body(tmp_path: Path) -> None:
    path = write_with_meshio(tmp_path / "a.vtu", "vtu")
    # Further than half an element from every node, but in the middle of one.
    assert read_mesh(path, points={"B": (0.049, 0.024)}).points["B"].tolist() == [0]
    assert read_mesh(path, points={"B": (-0.04, 0.0)}).points["B"].tolist() == [0]


def test_group_of_inner_edges_is_a_point_set(tmp_path: Path) -> None:
    mesh = meshio.Mesh(flat(), [("line", [[4, 5], [5, 6]]), ("quad", QUADS)],
                       cell_data={"nastran:ref": [[5, 5], [1] * 6]})
    path = tmp_path / "a.bdf"
    meshio.write(path, mesh, "nastran")
    assert read_mesh(path).points["5"].tolist() == [4, 5, 6]
    with pytest.raises(MeshError, match=r"group '5', asked for as boundary 'contact', holds nodes "
                                        r"or edges inside the body.*; the boundaries are: none"):
        read_mesh(path, boundaries={"contact": "5"})


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"boundaries": {"contact": "Bottm"}}, MeshError,
         r"a\.msh: There is no group 'Bottm', asked for as boundary 'contact' \(did you mean "
         r"'Bottom'\?\); the file's groups are: 'Bottom'\."),
        ({"points": {"B": "Drove"}}, MeshError,
         r"no group 'Drove', asked for as point 'B' \(did you mean 'Drive'\?\); the file's groups "
         r"are: 'Bottom', 'Drive'"),
        ({"boundaries": {"contact": "Nothing"}}, MeshError,
         "group 'Nothing', asked for as boundary 'contact', is empty"),
        ({"boundaries": {"contact": "Drive"}}, MeshError,
         "'Drive', asked for as boundary 'contact', holds nodes .*; the boundaries are: 'Bottom'"),
        ({"boundaries": {"contact": (0, 0.02, 1, 0.03)}}, MeshError,
         r"a\.msh: Boundary 'contact' is empty: no edge of the outline lies in the box "
         r"\(0\.0, 0\.02, 1\.0, 0\.03\); the body spans x = 0 \.\.\. 0\.3 m, y = 0 \.\.\. 0\.1 m"),
        ({"boundaries": {"contact": (0, 1, 2)}}, InputError,
         r"a\.msh: Boundary 'contact' must be the name of a group or a box .* not \(0, 1, 2\)"),
        ({"points": {"B": (0.0, "x")}}, InputError,
         r"Point 'B' must be the name of a group or a place .* not \(0\.0, 'x'\)"),
        ({"points": {"B": (0.0, float("nan"))}}, InputError, "Point 'B' must be"),
        ({"points": {"B": (-0.3, 0.1)}}, MeshError,
         r"Point 'B' at \(-0\.3, 0\.1\) is outside the body, 0\.3 m from the nearest node; the "
         r"body spans x = 0"),
        ({"scale": 0.0}, InputError, r"a\.msh: scale = 0\.0 .* must be a finite number above zero"),
        ({"scale": float("nan")}, InputError, "scale = nan"),
    ],
)
def test_requests_that_cannot_be_met(
    tmp_path: Path, arguments: dict, error: type[Exception], message: str
) -> None:
    path = write_gmsh(tmp_path / "a.msh", "4.1", False)
    with pytest.raises(error, match=message):
        read_mesh(path, **arguments)


ONE_TRIANGLE = "*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n"


def nodes_and(cells: str) -> str:
    """Gmsh 2.2 with four nodes, the last one off the plane of the others."""
    count = cells.count("\n")
    return ("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 2\n"
            f"$EndNodes\n$Elements\n{count}\n{cells}$EndElements\n")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.msh", "", r"a\.msh: The file has no complete section \$MeshFormat"),
        ("a.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 3 1 3\n2 1 0",
         r"no complete section \$Nodes"),
        ("a.msh", "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n$Nodes\n$EndNodes\n$Elements\n"
                  "$EndElements\n", r"mesh format 4\.0, but 2\.2 and 4\.1 are read"),
        ("a.msh", GMSH_41.replace("9 9 0 0.1 0.2\n", ""), "section of the file is too short"),
        ("a.msh", GMSH_41.replace("9 9 0 0.1", "9 nine 0 0.1"), "holds words in place of numbers"),
        ("a.msh", GMSH_41.replace("5 10 30 70", "5 10 30 71"), "name nodes that the file does not"),
        ("a.msh", GMSH_41.replace("2 1 2 2\n", "2 1 21 2\n"), "elements of Gmsh's type 21, which"),
        ("a.msh", GMSH_41 + "$PartitionedEntities\n$EndPartitionedEntities\n", "is partitioned"),
        ("a.msh", "$MeshFormat\n4.1 1 8\n\0\0\0\1\n$EndMeshFormat\n$Nodes\n$EndNodes\n$Elements\n"
                  "$EndElements\n", "another byte order"),
        ("a.msh", nodes_and("1 2 2 1 1 1 2 3\n2 2 2 1 1 2 4 3\n"),
         r"holds surfaces only, in space \(z runs from 0 to 2 m\); a solid needs tetrahedra or"),
        ("a.msh", nodes_and("1 6 2 1 1 1 2 3 4 2 3\n"),
         "1 mesh cells have no volume, or are folded or inverted, the first is cell 0"),
        ("a.msh", nodes_and("1 1 2 1 1 1 2\n"), "holds no triangles or quadrilaterals"),
        ("a.msh", nodes_and("1 2 2 1 1 1 2 2\n"), r"a\.msh: 1 mesh cells have no area"),
        ("a.inp", "just some text\n", r"a\.inp: The file holds no \*NODE or no \*ELEMENT data"),
        ("a.inp", "*NODE\n1,0,x\n", r"below a line \*NODE, which begin with '1,0,x', cannot"),
        ("a.inp", "*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2\n",
         "elements CPS3 of another number of nodes than 3"),
        ("a.inp", "*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2,9\n",
         "element 1 names node 9, which the file does not hold; 1 of its elements name"),
        ("a.inp", "*NODE\n1,0,0\n*ELEMENT, TYPE=CAX3\n1,1,2,3\n", r"axisymmetric elements \(CAX3"),
        ("a.inp", "*NODE\n1,0,0,0\n*ELEMENT, TYPE=C3D4\n1,1,1,1,1\n", "have no volume"),
        ("a.inp", "*NODE\n1,0,0,0\n*ELEMENT, TYPE=C3D6\n1,1,1,1,1,1,1\n", "have no volume"),
        ("a.inp", "*NODE\n1,0,0,0\n*ELEMENT, TYPE=C3D7\n1,1,1,1,1,1,1,1\n", "that are not read"),
        ("a.inp", "*NODE, SYSTEM=T\n1,0,0\n",
         r"SYSTEM=T names an unknown system; it may be R \(rectangular\), C \(cylindrical\) or S"),
        ("a.inp", "*SYSTEM\n0,0,0,1,1,0\n2,2,0\n*NODE\n1,0,0\n",
         r"points of the lines '0,0,0,1,1,0; 2,2,0' below \*SYSTEM do not span an x-y plane; give"),
        ("a.inp", "*SYSTEM\n1,2,3,1,2,9\n", r"below \*SYSTEM do not span an x-y plane"),
        ("a.inp", "*SYSTEM\n0,0,0,nan,0,0\n", r"below \*SYSTEM do not span an x-y plane"),
        ("a.inp", "*INCLUDE, INPUT=b.inp\n",
         r"a\.inp includes the file 'b\.inp', but there is no file .*b\.inp; put it there, or"),
        ("a.inp", "*NODE\n1.5,0,0\n", r"line \*NODE, .* cannot be read \(1\.5 is no number of a n"),
        ("a.inp", "*NODE\n1,0,0\n10,1,0\n*NGEN\n1,10,1\n",
         r"makes nodes or elements by \*NGEN, which is not read; write all nodes and elements as"),
        ("a.inp", "*PART, NAME=a\n*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n"
         "*PART, NAME=b\n*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n",
         r"a line \*PART without a line \*END PART, so it may be cut off"),
        ("a.inp", "*PART, NAME=a\n*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n"
         "*END PART\n"
         "*PART, NAME=b\n*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n*END PART\n",
         "holds 2 parts; choose one by part: 'a', 'b'"),
        ("a.inp", f"{ONE_TRIANGLE}*NSET, NSET=N\n1, 2, 4\n",
         "node set 'N' names node 4, which the file does not hold"),
        ("a.inp", f"{ONE_TRIANGLE}*ELSET, ELSET=E, GENERATE\n1, 5, 1\n",
         "element set 'E' names element 5, which the file does not hold"),
        ("a.inp", f"{ONE_TRIANGLE}*SURFACE, NAME=S\n1, S1\n2, S1\n",
         "surface 'S' names element 2, which the file does not hold"),
        ("a.inp", f"{ONE_TRIANGLE}*NSET, NSET=N\n1, 2",
         "last line, '1, 2', has no line break, so the file may be cut off"),
        ("a.inp", f"{ONE_TRIANGLE}*NSET, NSET=Foot\n1, 2\n*NSET, NSET=N\nFo",
         "last line, 'Fo', has no line break, so the file may be cut off"),
        ("a.inp", f"{ONE_TRIANGLE}*SURFACE, NAME=S\n",
         r"ends with the line '\*SURFACE, NAME=S' without its data, so it may be cut off"),
        ("a.inp", "*INSTANCE, NAME=I\n1,2,3\n0,0,0,0,0,0,90\n*END INSTANCE\n",
         "lines '1,2,3; 0,0,0,0,0,0,90' of the instance 'I' must be a translation x, y, z and, on"),
        ("a.inp", "*INSTANCE, NAME=I\n0,0,0,0,0,1,90\n*END INSTANCE\n",
         "the instance 'I' must be a translation"),
        ("a.inp", "*INSTANCE, NAME=I\n0,0,0\n0,0,0,0,0,1\n*END INSTANCE\n",
         "the instance 'I' must be a transl"),
        ("a.inp", "*PART, NAME=Disc\n*END PART\n*INSTANCE, NAME=I, PART=Dsc\n*END INSTANCE\n",
         r"'I' is of the part 'Dsc', which the file does not hold \(did you mean 'Disc'\?\); its"),
        ("a.inp", "*INSTANCE, NAME=I\n*END INSTANCE\n*INSTANCE, NAME=i\n*END INSTANCE\n",
         "holds two instances 'i'; rename one of them"),
        ("a.inp", "*INSTANCE, NAME=I, LIBRARY=old\n*END INSTANCE\n",
         r"from results \(LIBRARY=old\), which are"),
        ("a.inp", "*INSTANCE, NAME=I\n*END INSTANCE\n*NSET, NSET=N, INSTANCE=J\n1\n",
         "set 'N' is of the instance 'J', which the file does not hold.*; its instances are: 'I'"),
        ("a.inp", "*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT, TYPE=CPS3\n1,1,2,3\n*NSET, NSET=N\nM\n",
         "refers to a set 'M' that it does not hold"),
        ("a.inp", "*NODE\n1,0,0\n*ELEMENT\n1,1,1,1\n", r"A line \*ELEMENT lacks TYPE=; add it"),
        ("a.bdf", "GRID,1,,0.,0.,0.\n", "no line ENDDATA, so it may be cut off"),
        ("a.bdf", "this is no mesh\nENDDATA\n", r"a\.bdf: The mesh holds no triangles"),
        ("a.bdf", "CQUAD4* 1               1               1               2\nENDDATA\n",
         r"The CQUAD4 1 of line 1 has 2 nodes; it must have 4, the first ones being its"),
        ("a.bdf", "GRID,1,7,0.,0.,0.\nGRID,2,7,1.,0.,0.\nGRID,3,7,0.,1.,0.\nCTRIA3,1,1,1,2,3\n"
                  "ENDDATA\n",
         r"refers to the coordinate system 7, which it does not hold; its systems are: none"),
        ("a.bdf", "GRID,1,,0.,0.,0.\nCTRIA3,1,1,1,2,3\nENDDATA\n",
         r"a\.bdf: The element 1 names the grid point 2, which the file does not hold; give its"),
        ("a.med", "no HDF5", r"a\.med: The file is not HDF5, or is damaged"),
        ("a.vtk", "no VTK\n", r"cannot be read as VTK, .*\(Illegal VTK header\)"),
        ("a.vtk", "# vtk DataFile Version 5.1\n\nASCII\nDATASET POLYDATA\n",
         r"Only VTK 'UNSTRUCTURED_GRID.* supported \(not POLYDATA\)"),
        ("a.vtu", "no XML", r"as VTU, it is damaged or of another kind\."),
        ("a.vtu", "<VTKFile><Piece /><Piece /></VTKFile>", "holds 2 pieces"),
        ("a.vtu", "<VTKFile compressor='vtkLZ4DataCompressor'></VTKFile>", "compressed by LZ4"),
        ("a.vtu", "<VTKFile type='PolyData'></VTKFile>", "found PolyData"),
    ],
)
def test_files_that_are_no_plane_mesh(
    tmp_path: Path, name: str, content: str, message: str
) -> None:
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(MeshError, match=message) as caught:
        read_mesh(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_of_random_bytes_are_refused(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).bytes(3000)
    for suffix in (".msh", ".inp", ".bdf", ".fem", ".nas", ".med", ".vtk", ".vtu"):
        path = tmp_path / f"a{suffix}"
        path.write_bytes(noise)
        with pytest.raises(MeshError, match=r"The (file|mesh)"):
            read_mesh(path)


def test_truncated_files_are_refused(tmp_path: Path) -> None:
    for path in (write_gmsh(tmp_path / "a.msh", "4.1", True),
                 write_gmsh(tmp_path / "b.msh", "2.2", True),
                 write_with_meshio(tmp_path / "a.vtk", "vtk"),
                 write_with_meshio(tmp_path / "b.vtk", "vtk42"),
                 write_with_meshio(tmp_path / "a.vtu", "vtu"),
                 write_med(tmp_path / "a.med")):
        content = path.read_bytes()
        for part in (0.3, 0.6):
            path.write_bytes(content[:int(part * len(content))])
            with pytest.raises(MeshError, match=r"The (file|mesh)"):
                read_mesh(path)


@pytest.mark.parametrize("file_format", ["vtk", "vtk42"])
@pytest.mark.parametrize("binary", [True, False])
def test_a_cell_lost_at_the_end_is_noticed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], file_format: str, binary: bool
) -> None:
    """Every cut within the last block of a VTK file, at line breaks too."""
    meshio.vtk.write(tmp_path / "a.vtk", meshio.Mesh(flat(), [("quad", QUADS)]),
                     fmt_version="5.1" if file_format == "vtk" else "4.2", binary=binary)
    capfd.readouterr()  # a remark of meshio on text
    content = (tmp_path / "a.vtk").read_bytes()
    for end in range(content.index(b"CELL_TYPES"), len(content.rstrip(b"\n"))):
        (tmp_path / "a.vtk").write_bytes(content[:end])
        with pytest.raises(MeshError, match=r"The (file|mesh)"):
            read_mesh(tmp_path / "a.vtk")


def test_a_grid_that_does_not_fit_into_memory_is_refused(tmp_path: Path) -> None:
    """A file of 100 bytes may claim points without end."""
    (tmp_path / "a.vtk").write_text(
        "# vtk DataFile Version 4.2\nclaim\nASCII\nDATASET STRUCTURED_POINTS\n"
        "DIMENSIONS 100000 100000 100000\nORIGIN 0 0 0\nSPACING 1 1 1\n")
    with pytest.raises(MeshError, match="more data than fits into memory"):
        read_mesh(tmp_path / "a.vtk")


def test_elements_lost_at_the_end_of_a_deck_are_warned_of(tmp_path: Path) -> None:
    """The format gives no counts; nodes without elements are its only trace."""
    path = write_with_meshio(tmp_path / "a.inp", "abaqus")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:-1]))
    with pytest.warns(ModelWarning, match=r"and 1 of 12 nodes belong to no element"):
        assert len(read_mesh(path).cells) == 5
    path.write_text("".join(lines))
    assert len(read_mesh(path).cells) == 6


def test_generated_sets_may_have_holes(tmp_path: Path) -> None:
    """Only the ends of a range must exist; elements that are not read exist too."""
    path = tmp_path / "a.inp"
    path.write_text("*NODE\n1,0,0\n3,1,0\n7,0,1\n*ELEMENT, TYPE=CPS3\n1,1,3,7\n"
                    "*ELEMENT, TYPE=MASS\n5,3\n*NSET, NSET=N, GENERATE\n1,7,1\n"
                    "*ELSET, ELSET=E, GENERATE\n1,5,1\n*SURFACE, NAME=S\nE, S1\n")
    mesh = read_mesh(path)
    assert len(mesh.points["N"]) == 3
    assert len(mesh.boundary("S")) == 1


def test_elements_of_other_kinds_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.vtu"
    meshio.write(path, meshio.Mesh(flat(NODES[[0, 1, 5, 4]]), [("polygon", [[0, 1, 2, 3]])]))
    with pytest.raises(MeshError, match=r"elements that are not read \(polygon\)"):
        read_mesh(path)
    cube = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
    kind = "VTK_LAGRANGE_WEDGE"
    meshio.write(path, meshio.Mesh(np.tile(cube, (3, 1)), [(kind, [np.arange(18)])]))
    with pytest.raises(MeshError, match=rf"solid elements that are not read \({kind}\)"):
        read_mesh(path)


def test_med_with_several_meshes_or_none(tmp_path: Path) -> None:
    path = write_med(tmp_path / "a.med")
    with h5py.File(path, "r+") as file:
        file["ENS_MAA"].create_group("other")
    with pytest.raises(MeshError, match="holds 2 meshes; save one alone"):
        read_mesh(path)
    with h5py.File(path, "w") as file:
        file["something"] = 1
    with pytest.raises(MeshError, match="is HDF5, but holds no MED mesh"):
        read_mesh(path)


def test_missing_files_and_unknown_suffixes(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"b\.msh: there is no such file"):
        read_mesh(tmp_path / "b.msh")
    (tmp_path / "b.msh").mkdir()
    with pytest.raises(InputError, match=r"b\.msh: there is no such file"):
        read_mesh(tmp_path / "b.msh")
    with pytest.raises(InputError, match=r"b\.stl: files of this kind are not read; the suffixes "
                                         r"that are: \.bdf, \.cdb, \.fem, \.inp, \.med, \.msh, "
                                         r"\.nas, \.vtk, \.vtu\."):
        read_mesh(tmp_path / "b.stl")


def test_meshes_that_cannot_be_written(tmp_path: Path) -> None:
    mesh = quad_mesh()
    with pytest.raises(InputError, match=r"a\.vtu: meshes are written as Gmsh files; .* \.msh"):
        write_mesh(mesh, tmp_path / "a.vtu")
    with pytest.raises(InputError, match=r"a\.msh cannot be written: folder .* does not exist; "
                                         r"choose a folder that exists and is writable"):
        write_mesh(mesh, tmp_path / "missing" / "a.msh")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"a\.msh cannot be written: .*file is not a folder"):
        write_mesh(mesh, tmp_path / "file" / "a.msh")
    with pytest.raises(InputError, match="cannot store a group named 'a\"b'"):
        write_mesh(quad_mesh(points={'a"b': [0]}), tmp_path / "a.msh")
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_failed_writing_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.msh"
    path.write_text("old")

    def full(mesh: Mesh, stream) -> None:
        stream.write("half of it")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fecontact.fem.mesh_files.write_msh", full)
    with pytest.raises(InputError, match="no space left on device"):
        write_mesh(quad_mesh(), path)
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["a.msh"]


@pytest.mark.parametrize("content", [
    b"BINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 45812984490 double\n",
    b"ASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 45812984490 double\n0 0 0\n",
    b"ASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 1000000 1000000 10\n"
    b"SPACING 1 1 1\nORIGIN 0 0 0\n"])
def test_a_file_that_declares_a_terabyte(content, tmp_path):
    path = tmp_path / "a.vtk"
    path.write_bytes(b"# vtk DataFile Version 3.0\nx\n" + content)
    with pytest.raises(MeshError, match=r"a\.vtk: The file (declares more data|cannot be read)"):
        read_mesh(path)
