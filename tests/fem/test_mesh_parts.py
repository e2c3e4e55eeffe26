"""Meshes placed by shift, rotation and mirror, and single parts of files with several bodies."""

from pathlib import Path

import meshio
import numpy as np
import pytest

from fecontact import Block, InputError, Mesh, MeshError, generate, read_mesh

# Two unit squares of triangles, the upper on the lower one, each with nodes of its own.
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
CORNERS = np.array([[0, 1, 2], [0, 2, 3]])
NODES = np.concatenate([SQUARE, SQUARE + np.array([0.0, 1.0])])
TOP, BOTTOM = np.array([[2, 3]]), np.array([[4, 5]])


def test_a_placed_mesh_is_mirrored_turned_and_shifted():
    mesh = generate(Block(width=0.12, height=0.06, contact_length=0.04, element_size=0.02))
    placed = mesh.placed(shift=(1.0, 2.0), rotation=90.0, mirror="x")
    x, y = mesh.nodes.T
    assert (placed.nodes == np.column_stack([1.0 - y, 2.0 - x])).all()  # (x, y) -> (-x, y) -> ...
    assert placed.area == pytest.approx(mesh.area, rel=1e-13)
    assert placed.points.keys() == mesh.points.keys()
    for name, edges in mesh.boundaries.items():
        assert (placed.boundaries[name] == edges).all()
    # The body stays on the left-hand side of its outline.
    ends = placed.nodes[placed.outline]
    left = np.column_stack([-(ends[:, 1] - ends[:, 0])[:, 1], (ends[:, 1] - ends[:, 0])[:, 0]])
    inward = placed.nodes.mean(axis=0) - ends.mean(axis=1)
    assert ((left * inward).sum(axis=1) > 0.0).all()


@pytest.mark.parametrize("degrees", [-450.0, -90.0, 30.0, 137.0, 270.0])
def test_rotations_are_counter_clockwise_in_degrees(degrees):
    mesh = Mesh(SQUARE, CORNERS)
    number = np.exp(1j * np.radians(degrees)) * (SQUARE @ [1.0, 1j])
    turned = mesh.placed(rotation=degrees).nodes
    assert turned == pytest.approx(np.column_stack([number.real, number.imag]), abs=1e-14)
    if degrees % 90.0 == 0.0:
        assert set(np.unique(turned)) <= {-1.0, 0.0, 1.0}
    back = mesh.placed(rotation=degrees).placed(rotation=-degrees)
    assert back.nodes == pytest.approx(SQUARE, abs=1e-14)


@pytest.mark.parametrize(("given", "message"), [
    ({"mirror": "z"}, "mirror = 'z' must be 'x' or 'y'"),
    ({"shift": (1.0, np.nan)}, "shift = .* must be two finite numbers"),
    ({"shift": 3.0}, "shift = 3.0 must be two finite numbers"),
    ({"rotation": np.inf}, "rotation = inf must be a finite angle in degrees"),
])
def test_bad_placements_are_named(given, message):
    with pytest.raises(InputError, match=message):
        Mesh(SQUARE, CORNERS).placed(**given)


def two_in_gmsh(path: Path, version: str) -> Path:
    blocks = [("line", TOP), ("line", BOTTOM), ("triangle", CORNERS), ("triangle", CORNERS + 4)]
    tags = [[7], [8], [1, 1], [2, 2]]
    dim_tags = np.repeat([[2, 1], [2, 2]], 4, axis=0)
    dim_tags[[2, 4]] = [1, 7], [1, 8]
    meshio.gmsh.write(path, meshio.Mesh(
        np.column_stack([NODES, np.zeros(8)]), blocks, point_data={"gmsh:dim_tags": dim_tags},
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"rim": [7, 1], "lining": [8, 1], "disc": [1, 2], "pad": [2, 2]}),
        version, binary=False)
    return path


def two_in_med(path: Path) -> Path:
    mesh = meshio.Mesh(NODES, [("line", np.concatenate([TOP, BOTTOM])),
                               ("triangle", np.concatenate([CORNERS, CORNERS + 4]))],
                       cell_data={"cell_tags": [np.array([-1, -2]), np.array([-3, -3, -4, -4])]})
    mesh.cell_tags = {-1: ["rim"], -2: ["lining"], -3: ["disc"], -4: ["pad"]}
    mesh.point_tags = {}
    meshio.med.write(path, mesh)
    return path


NODE_ROWS = "*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n"
UPPER_ROWS = "5,0,1\n6,1,1\n7,1,2\n8,0,2\n"
SETS = (f"{NODE_ROWS}{UPPER_ROWS}*ELEMENT,TYPE=CPS3,ELSET=disc\n1,1,2,3\n2,1,3,4\n"
        "*ELEMENT,TYPE=CPS3,ELSET=pad\n3,5,6,7\n4,5,7,8\n"
        "*SURFACE,NAME=rim\n2,S2\n*SURFACE,NAME=lining\n3,S1\n")
PARTS = (f"*PART,NAME=disc\n{NODE_ROWS}*ELEMENT,TYPE=CPS3\n1,1,2,3\n2,1,3,4\n*END PART\n"
         f"*PART,NAME=pad\n*NODE\n1,0,1\n2,1,1\n3,1,2\n4,0,2\n"
         "*ELEMENT,TYPE=CPS3\n1,1,2,3\n2,1,3,4\n*END PART\n"
         "*ASSEMBLY,NAME=all\n*INSTANCE,NAME=d,PART=disc\n*END INSTANCE\n"
         "*INSTANCE,NAME=p,PART=pad\n*END INSTANCE\n"
         "*NSET,NSET=rim,INSTANCE=d\n3,4\n*NSET,NSET=lining,INSTANCE=p\n1,2\n*END ASSEMBLY\n")


def written(kind: str, folder: Path) -> Path:
    if kind in ("2.2", "4.1"):
        return two_in_gmsh(folder / "two.msh", kind)
    if kind == "med":
        return two_in_med(folder / "two.med")
    path = folder / "two.inp"
    path.write_text({"sets": SETS, "parts": PARTS}[kind])
    return path


@pytest.mark.parametrize("kind", ["2.2", "4.1", "med", "sets", "parts"])
def test_parts_of_a_file_are_bodies_of_their_own(kind, tmp_path, capfd):
    path = written(kind, tmp_path)
    disc, pad = read_mesh(path, part="disc"), read_mesh(path, part="pad")
    assert (len(disc.nodes), len(disc.cells)) == (len(pad.nodes), len(pad.cells)) == (4, 2)
    assert disc.nodes[:, 1].max() == pad.nodes[:, 1].min() == 1.0
    # Nodes of the two sides coincide, but each has its own boundary alone.
    assert list(disc.boundaries) == ["rim"]
    assert list(pad.boundaries) == ["lining"]
    assert (disc.nodes[disc.boundary("rim")][..., 1] == 1.0).all()
    with pytest.raises(MeshError, match=r"two\.\w+: The file has no part 'dsc' \(did you mean "
                                        r"'disc'\?\); its groups of cells are: 'disc', 'pad'"):
        read_mesh(path, part="dsc")
    assert capfd.readouterr().err == ""


def test_several_parts_of_abaqus_need_a_choice(tmp_path):
    with pytest.raises(MeshError, match="holds 2 parts; choose one by part: 'disc', 'pad'"):
        read_mesh(written("parts", tmp_path))
