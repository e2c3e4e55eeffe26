"""Meshes and materials of Ansys archives: degenerate bricks, dropped middles, what is not read."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from ansys_archives import archive, material

import fecontact as fc
from fecontact import ModelWarning
from fecontact.core.errors import MeshError, MissingLibraryError
from fecontact.fem import AnisotropicMaterial
from fecontact.reduction import eigenfrequencies_hz

pytest.importorskip("mapdl_archive")
STEEL = {"EX": 2.1e11, "NUXY": 0.3, "DENS": 7850.0}


def box(n=(3, 2, 2), size=(0.3, 0.2, 0.1)):
    """Nodes of a box, and bricks by their corners, from 1 on."""
    places = [np.linspace(0.0, length, count + 1) for length, count in zip(size, n, strict=True)]
    nodes = np.array(list(itertools.product(*places)))
    number = np.arange(1, len(nodes) + 1).reshape([count + 1 for count in n])
    bricks = [[number[i + a, j + b, k + c] for c in (0, 1)
               for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
              for i, j, k in itertools.product(*map(range, n))]
    return nodes, bricks


def test_bricks_with_their_material_have_the_frequencies_of_a_grid(tmp_path):
    nodes, bricks = box()
    base = np.flatnonzero(nodes[:, 0] == 0.0) + 1
    group = (f"CMBLOCK,BASE    ,NODE,{len(base):8d}\n(8i10)\n"
             + "\n".join("".join(f"{n:10d}" for n in base[k : k + 8])
                         for k in range(0, len(base), 8))
             + "\nCMBLOCK,FRONT   ,ELEM,       2\n(8i10)\n         1        -4")
    path = archive(tmp_path / "box.cdb", 185, nodes, bricks, f"{group}\n{material(**STEEL)}")
    mesh = fc.read_mesh(path)
    assert mesh.materials == {"material 1": fc.Material(2.1e11, 0.3, 7850.0)}
    assert sorted(mesh.cell_groups) == ["FRONT", "material 1"]
    assert len(mesh.cell_groups["FRONT"]) == 4  # the first to the fourth
    assert len(mesh.boundaries["BASE"]) == 4
    grid = fc.Mesh.grid(*(np.unique(column) for column in nodes.T))
    found, wanted = (eigenfrequencies_hz(fc.ElasticBody(one, fc.Material(2.1e11, 0.3, 7850.0),
                                                     fixed={name: "xyz"}), 4)
                     for one, name in ((mesh, "BASE"), (grid, "left")))
    assert found == pytest.approx(wanted, rel=1e-9)
    # In millimetres, newtons and tonnes, of bricks with extra shapes.
    scaled = fc.read_mesh(archive(
        tmp_path / "mm.cdb", 185, 1e3 * nodes, bricks,
        material(EX=2.1e5, PRXY=0.3, DENS=7.85e-9), option=2), scale=1e-3)
    assert scaled.materials["material 1"].density == pytest.approx(7850.0)
    assert scaled.materials["material 1"].youngs_modulus == pytest.approx(2.1e11)
    assert (mesh.bricks, scaled.bricks) == ("full", "incompatible")


@pytest.mark.parametrize(("kind", "option", "rule"), [
    (185, 0, "full"), (185, 1, "reduced"), (185, 3, "full"), (186, 0, "reduced"), (186, 1, "full"),
    (45, 1, "reduced"), (95, None, "full")])
def test_key_options_choose_the_rule_of_integration(tmp_path, kind, option, rule):
    path = archive(tmp_path / "a.cdb", kind, *box((2, 1, 1)), option=option)
    mesh = fc.read_mesh(path)
    assert mesh.integration == rule
    assert mesh.bricks == ("incompatible" if (kind, option) == (185, 3) else "full")
    # The second brick of another type.
    text = path.read_text().replace(f"ET,        1,{kind}", f"ET,        1,{kind}\nET,2,185")
    lines = text.splitlines()
    at = next(k for k, line in enumerate(lines) if line == "       -1") - 1
    lines[at] = f"{1:9d}{2:9d}{lines[at][18:]}"
    path.write_text("\n".join(lines))
    expected = {"reduced integration": "reduced"} if rule == "reduced" else "full"
    assert fc.read_mesh(path).integration == expected


def second_order(nodes, shapes):
    """Bricks of twenty nodes of cells by their corners I to P, and all nodes."""
    places, edges, rows = [*nodes], {}, []
    ends = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
            (0, 4), (1, 5), (2, 6), (3, 7)]
    for cell in shapes:
        row = list(cell)
        for a, b in ends:
            pair = tuple(sorted((cell[a], cell[b])))
            if pair[0] == pair[1]:
                row.append(pair[0])
                continue
            if pair not in edges:
                places.append((nodes[pair[0] - 1] + nodes[pair[1] - 1]) / 2.0)
                edges[pair] = len(places)
            row.append(edges[pair])
        rows.append(row)
    return np.array(places), rows


CUBE = np.array([(x, y, z) for z in (0.0, 1.0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
CENTRE = np.array([[0.5, 0.5, 0.5]])
# Of a cube: itself, two wedges, six pyramids, five tetrahedra, as bricks that repeat corners.
WEDGES = [[1, 2, 3, 3, 5, 6, 7, 7], [1, 3, 4, 4, 5, 7, 8, 8]]
PYRAMIDS = [[*face, 9, 9, 9, 9] for face in (
    (1, 2, 3, 4), (5, 8, 7, 6), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1))]
TETRAHEDRA = [[a, b, c, c, d, d, d, d] for a, b, c, d in (
    (1, 2, 3, 6), (1, 3, 4, 8), (1, 6, 8, 5), (3, 8, 6, 7), (1, 3, 8, 6))]


@pytest.mark.parametrize("order", [185, 186])
@pytest.mark.parametrize(("nodes", "cells"), [
    (CUBE, [[1, 2, 3, 4, 5, 6, 7, 8]]), (CUBE, WEDGES),
    (np.concatenate([CUBE, CENTRE]), PYRAMIDS), (CUBE, TETRAHEDRA)],
    ids=["brick", "wedges", "pyramids", "tetrahedra"])
def test_bricks_that_repeat_corners_fill_the_cube(tmp_path, nodes, cells, order):
    if order == 186:
        nodes, cells = second_order(nodes, cells)
        assert not len(fc.read_mesh(archive(tmp_path / "a.cdb", order, nodes, cells)).curved_edges)
        # A middle that is moved bends its edge, each of the twelve of the cube.
        for a, b in itertools.combinations(CUBE, 2):
            if np.abs(a - b).sum() != 1.0:
                continue
            middle, moved = 0.5 * (a + b), nodes.copy()
            outwards = np.where(a == b, 0.1 * np.sign(a - 0.5), 0.0)
            moved[(np.abs(nodes - middle) < 1e-12).all(axis=1)] += outwards
            bent = fc.read_mesh(archive(tmp_path / "b.cdb", order, moved, cells))
            # Where cells are cut, diagonals of the faces beside it bend too.
            ends = [sorted(map(tuple, bent.nodes[pair])) for pair in bent.curved_edges]
            place = ends.index(sorted([tuple(a), tuple(b)]))
            assert bent.curved_middles[place] == pytest.approx(middle + outwards)
            assert all(tuple(a) in pair or tuple(b) in pair for pair in ends)
            assert len(ends) == 1 or len(cells) in (2, 6)
        return
    mesh = fc.read_mesh(archive(tmp_path / "a.cdb", order, nodes, cells))
    assert float(dict(mesh.summary())["volume"].split()[0]) == pytest.approx(1.0, rel=1e-12)


def test_middles_that_were_dropped_are_straight(tmp_path):
    nodes, cells = second_order(CUBE, [[1, 2, 3, 4, 5, 6, 7, 8]])
    for place in (8, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19):
        cells[0][place] = 0
    nodes[9] = (1.2, 0.5, 0.0)  # the middle between the second corner and the third
    mesh = fc.read_mesh(archive(tmp_path / "a.cdb", 186, nodes, cells))
    assert len(mesh.curved_edges) == 1
    assert mesh.curved_middles[0] == pytest.approx([1.2, 0.5, 0.0])


@pytest.mark.parametrize(("kind", "cells", "triangles"), [
    (182, [[1, 2, 3, 4]], 0), (182, [[1, 2, 3, 3], [1, 3, 4, 4]], 2),
    (183, [[1, 2, 3, 4, 5, 6, 7, 8]], 0), (183, [[1, 2, 3, 3, 5, 6, 3, 9]], 1)])
def test_plane_elements(tmp_path, kind, cells, triangles):
    nodes = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (1, 0, 0), (2, 0.5, 0),
                      (1, 1, 0), (0, 0.5, 0), (1, 0.5, 0)], float)
    mesh = fc.read_mesh(archive(tmp_path / "a.cdb", kind, nodes, cells))
    assert mesh.cells.shape == ((triangles or 1), 3 if triangles else 4)
    area = 1.0 if len(cells) * triangles == 1 else 2.0
    assert float(dict(mesh.summary())["area"].split()[0]) == pytest.approx(area)


def test_orthotropic_materials_by_minor_or_major_ratios(tmp_path):
    """nu_xy / E_x = nu_yx / E_y, PR.. is the first and NU.. the second of these."""
    nodes, bricks = box((1, 1, 1))
    moduli = {"EX": 1e11, "EY": 2e10, "EZ": 1e10, "GXY": 5e9, "GYZ": 3e9, "GXZ": 4e9,
              "DENS": 1500.0}
    major = {"PRXY": 0.3, "PRXZ": 0.25, "PRYZ": 0.2}
    minor = {"NUXY": 0.3 * 0.2, "NUXZ": 0.25 * 0.1, "NUYZ": 0.2 * 0.5}
    wanted = AnisotropicMaterial.orthotropic((1e11, 2e10, 1e10), (0.3, 0.25, 0.2), (5e9, 4e9, 3e9),
                                             1500.0)
    for ratios in (major, minor):
        path = archive(tmp_path / "a.cdb", 185, nodes, bricks, material(**moduli, **ratios))
        found = fc.read_mesh(path).materials["material 1"]
        np.testing.assert_allclose(found.stiffness, wanted.stiffness, rtol=1e-12)


@pytest.mark.parametrize(("further", "message"), [
    ("CE,R5.0,DEFI,       2,       1,  0.00000000    \nCE,R5.0,NODE,       1,UX  , 1.0,",
     r"2 constraint equations \(CE\), which stiffen the mesh"),
    ("CP,       1,UX  ,       1,       2,", r"1 coupled degrees of freedom \(CP\)"),
])
def test_what_stiffens_the_mesh_is_refused(tmp_path, further, message):
    nodes, bricks = box((1, 1, 1))
    with pytest.raises(MeshError, match=message):
        fc.read_mesh(archive(tmp_path / "a.cdb", 185, nodes, bricks, further))
    with pytest.raises(MeshError, match=r"elements of the types '?181'? .* SOLID185"):
        fc.read_mesh(archive(tmp_path / "shell.cdb", 181, nodes, [[1, 2, 4, 3]]))


def test_cut_and_empty_archives_are_named(tmp_path):
    nodes, bricks = box()
    path = archive(tmp_path / "a.cdb", 185, nodes, bricks)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:-8], "       -1", ""]))
    with pytest.raises(MeshError, match=r"declares 12 rows of EBLOCK, but holds \d+; it is cut"):
        fc.read_mesh(path)
    path.write_text("/PREP7\nFINISH\n")
    with pytest.raises(MeshError, match="holds no NBLOCK or no EBLOCK"):
        fc.read_mesh(path)


def test_loads_and_materials_over_temperature_are_told(tmp_path):
    nodes, bricks = box((1, 1, 1))
    path = archive(tmp_path / "a.cdb", 185, nodes, bricks,
                   "D,       1,UX  ,  0.00000000    ,  0.00000000    \nBF,       1,TEMP,  20.0")
    with pytest.warns(ModelWarning, match=r"holds 1 body loads \(BF\), which are not read; give"):
        fc.read_mesh(path)
    path = archive(tmp_path / "b.cdb", 185, nodes, bricks,
                   "MPDATA,R5.0, 2,EX  ,       1, 1, 7.0E+10, 6.0E+10,")
    with pytest.warns(ModelWarning, match="material 1 depends on temperature, so that no material"):
        assert not fc.read_mesh(path).materials


def test_without_the_library_its_extra_is_named(tmp_path, monkeypatch):
    import sys

    nodes, bricks = box((1, 1, 1))
    path = archive(tmp_path / "a.cdb", 185, nodes, bricks)
    monkeypatch.setitem(sys.modules, "mapdl_archive", None)
    with pytest.raises(MissingLibraryError, match=r"pip install 'fecontact\[ansys\]'"):
        fc.read_mesh(path)


def test_archives_that_ansys_wrote():
    """Archives of a beam of 1 x 1 x 5, one of tetrahedra of 1 x 1 x 10, and a blade's sector."""
    import mapdl_archive

    folder = Path(mapdl_archive.__file__).parent / "examples"
    found = {name: fc.read_mesh(folder / f"{name}.cdb")
             for name in ("HexBeam", "TetBeam", "sector", "academic_rotor")}
    volumes = {name: float(dict(mesh.summary())["volume"].split()[0])
               for name, mesh in found.items()}
    assert volumes["HexBeam"] == pytest.approx(5.0, rel=1e-9)
    assert volumes["TetBeam"] == pytest.approx(10.0, rel=1e-6)
    assert found["HexBeam"].materials["material 1"] == fc.Material(7e10, 0.35, 2700.0)
    assert len(found["academic_rotor"].cells) == 524
    assert "REFINE" in found["sector"].boundaries
    material = found["HexBeam"].materials["material 1"]
    places = (np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, 3), np.linspace(0.0, 5.0, 11))
    assert found["HexBeam"].bricks == "serendipity"
    hertz, wanted = (
        eigenfrequencies_hz(fc.ElasticBody(mesh, material, bricks="serendipity",
                                           integration="full"), 10)
        for mesh in (found["HexBeam"], fc.Mesh.grid(*places)))
    assert hertz[6:] == pytest.approx(wanted[6:], rel=1e-9)


def test_layered_solids_and_damping_of_archives(tmp_path):
    path = archive(tmp_path / "a.cdb", 186, *box((2, 1, 1)),
                   material(**STEEL, DMPS=0.02, ALPX=1e-5))
    with pytest.warns(ModelWarning, match="materials of the file have DMPS, which are not read"):
        mesh = fc.read_mesh(path)
    assert mesh.materials["material 1"].thermal_expansion == 1e-5
    path.write_text(path.read_text().replace("NBLOCK", "KEYOP,1,3,1\nNBLOCK", 1))
    with pytest.raises(MeshError, match="layered solids"):
        fc.read_mesh(path)
