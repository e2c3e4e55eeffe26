"""Distributed loads of Abaqus and CalculiX decks, as studies of them have them.

Displacements are those of CalculiX 2.20 for the same decks (C3D8, *STATIC, *NODE PRINT), whose
bricks have the same stiffness as trilinear ones here.
"""

import numpy as np
import pytest
from ansys_archives import archive, material
from solid_blocks import block_mesh

from fecontact import InputError, MeshError, Study, read_mesh, static_solution
from fecontact.fem.elements.cell_kinds import CELL_KINDS, HEXAHEDRON
from fecontact.fem.faces.surface import Surface
from fecontact.fem.mesh_files.deck_contents import COMPONENTS
from fecontact.fem.mesh_files.nastran_loads import nastran_contents
from fecontact.study.imported import imported

PLACES = np.array([(0.2, 0.1, 0.05), (0.1, 0.1, 0.025)])


def deck(load, scale=1.0, kind="C3D8"):
    """A block of 4 x 3 x 2 bricks, held at the left; in m, N, kg or in mm, N, t."""
    mesh = block_mesh((4, 3, 2), (0.2, 0.1, 0.05))
    text = "*NODE\n" + "".join(f"{k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(
        (mesh.nodes / scale).tolist(), start=1))
    text += f"*ELEMENT, TYPE={kind}, ELSET=EALL\n" + "".join(
        f"{k}, {', '.join(map(str, row))}\n" for k, row in enumerate(
            (mesh.cells + 1).tolist(), start=1))
    for name, numbers in (
            ("NSET, NSET=HELD", np.flatnonzero(mesh.nodes[:, 0] < 1e-9) + 1),
            ("ELSET, ELSET=UP", np.flatnonzero(mesh.nodes[mesh.cells][:, :, 2].max(axis=1)
                                               > 0.049) + 1)):
        text += f"*{name}\n" + "".join(f"{number},\n" for number in numbers)
    constants = ("2.1e11, 0.3", "7850.") if scale == 1.0 else ("2.1e5, 0.3", "7.85e-9")
    return (f"{text}*SURFACE, NAME=ROOF\nUP, S2\n*MATERIAL, NAME=STEEL\n*ELASTIC\n{constants[0]}\n"
            f"*DENSITY\n{constants[1]}\n*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n"
            f"*BOUNDARY\nHELD, 1, 3\n*STEP\n*STATIC\n{load}*END STEP\n"
            "*STEP\n*DLOAD\nEALL, GRAV, 99., 0., 0., 1.\n*END STEP\n")


# Displacements at the places [m].
CALCULIX = {
    "SIDES": [
        (2.311965e-05, -8.341398e-06, -0.000131664),
        (1.622578e-06, -2.522538e-06, -4.758102e-05)],
    "ROOF": [
        (2.145387e-05, -4.676113e-08, -0.0001310384),
        (1.221193e-07, 7.233577e-08, -4.715075e-05)],
    "GRAVITY": [
        (4.512212e-08, -2.719108e-08, -2.151024e-07),
        (8.615404e-09, -1.175749e-08, -7.761388e-08)],
    "CENTRIF": [
        (1.782248e-06, 3.273016e-05, -6.56416e-05),
        (-7.685675e-06, 1.394769e-05, -2.382579e-05)],
    "MM": [
        (2.14944e-05, -4.707765e-08, -0.0001312893),
        (1.221193e-07, 7.233577e-08, -4.72413e-05)],
}
SIDES = ("*DLOAD\nUP, P2, 2e6\n1, P1, -3e6\n3, P1, -3e6\n24, P5, 1.5e6\n24, P4, 2e6\n1, P3, 2.5e5\n"
         "24, P5, 1e6\n")


def displacement(tmp_path, load, scale=1.0, file="a.inp"):
    """Displacements (2, 3) at the places of the deck's study, and the study."""
    return displacement_of(imported(written(tmp_path / file, load, scale), scale), tmp_path)


def displacement_of(found, tmp_path):
    """Displacements (2, 3) of an imported file, all of whose loads are taken, and its study."""
    assert all("bricks C3D8 become" in note for note in found.notes)
    text = found.toml(tmp_path)
    assert "left out" not in text
    study = Study.from_toml(text, tmp_path / "a.toml").with_(
        **{"body.degree": 1, "body.bricks": "full"})
    body = study.elastic_body()
    state = static_solution(body, study.load, rotation=study.body.rotation)
    at = [int(np.linalg.norm(body.nodes - place, axis=1).argmin()) for place in PLACES]
    return state.displacement[at], study


@pytest.mark.parametrize(("load", "scale", "expected"), [
    (SIDES, 1.0, "SIDES"),
    ("*DSLOAD\nroof, P, 2e6\n", 1.0, "ROOF"),
    ("*DLOAD\nEALL, GRAV, 9.81, 3., -2., -6.\n", 1.0, "GRAVITY"),
    ("*DLOAD\nEALL, CENTRIF, 1e4, 0.1, -0.5, 0., 0., 3., 4.\n", 1.0, "CENTRIF"),
    ("*DLOAD\nUP, P2, 2.\nEALL, GRAV, 9810., 0., 0., -1.\n", 1e-3, "MM"),
], ids=["sides", "surface", "gravity", "centrifugal", "mm"])
def test_displacements_are_those_of_calculix(load, scale, expected, tmp_path):
    found, _ = displacement(tmp_path, load, scale)
    assert found == pytest.approx(np.array(CALCULIX[expected]),
                                  abs=1e-6 * np.abs(CALCULIX[expected]).max())


# Files of Nastran and Ansys -------------------------------------------------------------------


MESH = block_mesh((4, 3, 2), (0.2, 0.1, 0.05))
HELD = (np.flatnonzero(MESH.nodes[:, 0] < 1e-9) + 1).tolist()
# Cells of the upper layer, and the corners of their upper faces, from 1 on.
UP = np.flatnonzero(MESH.nodes[MESH.cells][:, :, 2].max(axis=1) > 0.049) + 1
TIP, HIGH = (1 + int(np.linalg.norm(MESH.nodes - place, axis=1).argmin()) for place in PLACES)


def bulk(load, scale=1.0):
    """The block as bulk data; ``load`` is the case control, and the cards after a line BULK."""
    case, _, cards = load.rpartition("BULK\n")
    text = f"{case}BEGIN BULK\n" + "".join(
        f"GRID,{k},,{x:.12f},{y:.12f},{z:.12f}\n" for k, (x, y, z) in enumerate(
            (MESH.nodes / scale).tolist(), 1))
    for k, row in enumerate((MESH.cells + 1).tolist(), 1):
        text += f"CHEXA,{k},1,{','.join(map(str, row[:6]))}\n+,{row[6]},{row[7]}\n"
    held = "".join(f"SPC1,3,123,{node}\n" for node in HELD)
    return f"{text}{held}{cards}ENDDATA\n"


def written(path, load, scale):
    """A file of a format with the block and a load."""
    if path.suffix != ".cdb":
        path.write_text((bulk if path.suffix == ".bdf" else deck)(load, scale))
        return path
    E, rho = (2.1e11, 7850.0) if scale == 1.0 else (2.1e5, 7.85e-9)
    held = "".join(f"D,{node:8d},{label}  ,  0.00000000    ,  0.00000000    \n" for node in HELD
                   for label in ("UX", "UY", "UZ"))
    return archive(path, 185, MESH.nodes / scale, MESH.cells + 1,
                   f"{material(EX=E, NUXY=0.3, DENS=rho)}\n{held}{load.rstrip()}" if (
                       path.stem == "a") else f"{material(EX=E, NUXY=0.3, DENS=rho)}\n"
                   + in_blocks(held + load.rstrip()))


def pload4(pressure, *elements, side=5, number=7):
    """Cards of a pressure on a side of elements, by two points across it."""
    facet = HEXAHEDRON.facets[side]
    return "".join(f"PLOAD4,{number},{element},{pressure},,,,{row[facet[1]]},{row[facet[3]]}\n"
                   for element, row in ((one, MESH.cells[one - 1] + 1) for one in elements))


def in_blocks(text):
    """Commands D, F and SFE of a block as recent archives write them."""
    rows = {"D": [], "F": [], "SFE": []}
    others = []
    lines = iter(text.splitlines())
    for line in lines:
        words = [word.strip() for word in line.split(",")]
        if words[0] == "SFE":
            values = next(lines).split()
            rows["SFE"] += [f"{words[1]:>9}{words[2]:>4}   1{''.join(f'{x:>20}' for x in values)}",
                            f"{words[1]:>9}{words[2]:>4}   2{'  0.00000000          ' * 4}"]
        elif words[0] in ("D", "F"):
            rows[words[0]].append(f"{words[1]:>9}{words[2]:>4}  {words[3]:>16}    0.00000000")
        else:
            others.append(line)
    heads = {"D": f"DBLOCK,{len(rows['D']):10d}\n(i9,a6,2(pg16.9))",
             "F": f"FBLOCK,{len(rows['F']):10d}\n(i9,a6,2(pg16.9))",
             "SFE": "SFEBLOCK,4,PRES,        24,        24,0\n(i9,i4,i4,6(pg20.9))"}
    ends = {"D": "", "F": "", "SFE": "SFE,end,LOC,       -1,\n"}
    return "\n".join(others) + "\n" + "".join(
        "\n".join([heads[name], *held, ends[name]]) for name, held in rows.items() if held)


def sfe(pressure, *elements, face=6, inline=False):
    """Commands of a pressure on a face of elements, with their values on the same line or below."""
    value = f"  {pressure:.8E}    "
    return "".join(f"SFE,{one:8d},{face:4d},PRES,  0," + (
        f"{','.join([value] * 4)}\n" if inline else f"R5.0\n{value * 4}\n") for one in elements)


TOP = HEXAHEDRON.facets.index((4, 5, 6, 7))
# Sides of cells by the places of their corners: S1 is below, S2 above, S3 ... S6 around.
AROUND = {number: next(k for k, facet in enumerate(HEXAHEDRON.facets) if {*facet} == {*corners})
          for number, corners in enumerate(((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (1, 2, 5, 6),
                                            (2, 3, 6, 7), (0, 3, 4, 7)), start=1)}
GRAVITY = 9.81 / 7.0  # along 3, -2, -6


@pytest.mark.parametrize(("file", "load", "scale", "expected"), [
    ("a.bdf", pload4(2e6, *UP, side=TOP), 1.0, "ROOF"),
    ("a.bdf", pload4(2e6, *UP, side=AROUND[2]) + pload4(-3e6, 1, 3, side=AROUND[1])
     + pload4(2.5e6, 24, side=AROUND[5]) + pload4(2e6, 24, side=AROUND[4])
     + pload4(2.5e5, 1, side=AROUND[3]), 1.0, "SIDES"),
    ("a.bdf", f"GRAV,7,,{GRAVITY},3.,-2.,-6.\n", 1.0, "GRAVITY"),
    ("a.bdf", "LOAD = 12\nBULK\nLOAD,12,2.0,.5,7,-.25,8\n" + pload4(2.0, *UP, side=TOP)
     + "GRAV,8,0,19620.,0.,0.,1.\nGRAV,9,,5.,1.,0.,0.\n", 1e-3, "MM"),
    ("a.cdb", sfe(2e6, *UP), 1.0, "ROOF"),
    ("blocks.cdb", sfe(2e6, *UP), 1.0, "ROOF"),
    ("a.cdb", sfe(2e6, *UP, inline=True) + sfe(-3e6, 1, 3, face=1) + sfe(2.5e6, 24, face=4)
     + sfe(2e6, 24, face=3) + sfe(2.5e5, 1, face=2), 1.0, "SIDES"),
    ("a.cdb", f"ACEL,  {-3 * GRAVITY:.8E}    ,  {2 * GRAVITY:.8E}    ,  {6 * GRAVITY:.8E}\n", 1.0,
     "GRAVITY"),
    ("a.cdb", sfe(2.0, *UP) + "ACEL,  0.00000000    ,  0.00000000    ,  9810.00000\n", 1e-3, "MM"),
])
def test_loads_of_nastran_and_ansys_are_those_of_calculix(file, load, scale, expected, tmp_path):
    found, study = displacement(tmp_path, load, scale, file)
    # Files of Nastran have no material: that of the study is steel.
    assert len(study.body.fixed) == 1
    assert found == pytest.approx(np.array(CALCULIX[expected]),
                                  abs=2e-6 * np.abs(CALCULIX[expected]).max())


# A cube, a wedge at its right side and a tetrahedron at the wedge's end, all under pressure.
MIXED = """\
LOAD = 12
SPC = 3
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,1.,1.,0.
GRID,4,,0.,1.,0.
GRID,5,,0.,0.,1.
GRID,6,,1.,0.,1.
GRID,7,,1.,1.,1.
GRID,8,,0.,1.,1.
GRID,10,,2.,0.,0.
GRID,11,,2.,1.,0.
GRID,12,,1.5,-1.,0.
CHEXA,1,1,1,2,3,4,5,6
+,7,8
CPENTA,2,1,2,6,10,3,7,11
CTETRA,3,1,2,10,6,12
LOAD,12,2.,1.5,7,-.5,8
PLOAD4,7,1,10.,,,,1,8
PLOAD4,7,1,30.,,,,8,6
PLOAD4,7,2,20.,,,,3
PLOAD4,7,2,5.,,,,10,7
PLOAD4,8,2,-7.,,,,2,11
PLOAD4,7,3,3.,,,,12,6
PLOAD4,7,3,4.,,,,12,2
FORCE,8,1,,3.,1.,2.,-2.
FORCE,7,12,,3.,1.,2.,-2.
MOMENT,7,12,,4.,1.,0.,0.
SPC1,3,123,1,4,5,8
ENDDATA
"""


def test_sums_of_forces_of_nastran_are_those_of_another_reader(tmp_path):
    """Force and moment about the origin by sum_forces_moments of pyNastran 1.4.1."""
    (tmp_path / "a.bdf").write_text(MIXED)
    mesh, contents = read_mesh(tmp_path / "a.bdf"), nastran_contents(tmp_path / "a.bdf")
    assert contents.distributed.unread == []
    force, moment = np.zeros(3), np.zeros(3)
    for name, pressure in contents.distributed.pressures:
        surface = Surface(mesh.nodes, mesh.boundaries[name])
        force -= pressure * surface.area_vectors.sum(axis=0)
        moment -= pressure * np.cross(surface.centres, surface.area_vectors).sum(axis=0)
    for name, component, value in contents.forces:
        way = value * np.eye(6)[COMPONENTS.index(component)]
        force += way[:3]
        moment += way[3:] + np.cross(mesh.nodes[mesh.points[name][0]], way[:3])
    assert force == pytest.approx([15.0, -15.0, -111.5])
    assert moment == pytest.approx([-9.5, 91.75, -9.0])


@pytest.mark.parametrize(("file", "load"), [
    ("a.bdf", "LOAD = 12\nBULK\nLOAD,12,4.0,.5,7\n"
     f"FORCE,7,{TIP},0,10.,3.,0.,-10.\nFORCE*,7,{HIGH},,5.0\n*,0.,5.,0.\n"),
    *((name, f"F,{TIP:8d},FX  ,  60.0000000    ,  0.00000000    \nF,{TIP},FZ,-200.\n"
       f"F,{HIGH},FY,50.\n") for name in ("a.cdb", "blocks.cdb")),
])
def test_forces_of_nastran_and_ansys_are_those_of_a_deck(file, load, tmp_path):
    """The deck names nodes by their numbers, and holds them so in place of their set."""
    expected, _ = displacement(
        tmp_path, f"*CLOAD\n{TIP}, 1, 60.\n{TIP}, 3, -200.\n{HIGH}, 2, 50.\n")
    found, _ = displacement(tmp_path, load, 1.0, file)
    assert np.abs(expected).max() > 1e-8
    text = deck(f"*NSET, NSET=T\n{TIP},\n*CLOAD\nT, 1, 60.\nT, 3, -200.\n{HIGH}, 2, 50.\n")
    (tmp_path / "b.inp").write_text(text.replace("HELD, 1, 3\n", "".join(
        f"{node}, 1, 3\n" for node in HELD)))
    numbered, study = displacement_of(imported(tmp_path / "b.inp"), tmp_path)
    assert study.body.fixed == {"BOUNDARY 1-3": "xyz"}
    assert numbered == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(("system", "expected"), [
    # Axes x, y, z of the system lie along the basic y, z, x.
    ("CORD2R,4,0,7.,7.,7.,8.,7.,7.\n+,7.,9.,7.\n", (3.0, 1.0, -2.0)),
    # The tip lies at a quarter turn: r is y, theta is -x.
    ("CORD2C,4,0,.2,0.,0.,.2,0.,1.\n+,1.,0.,0.\n", (2.0, 1.0, 3.0)),
    # Below the axis by a quarter turn, and a quarter turn about it: theta is -z, phi is -x.
    ("CORD2S,4,0,.2,0.,.05,.2,0.,1.\n+,1.,0.,.05\n", (-3.0, 1.0, 2.0)),
])
def test_forces_of_nastran_along_axes_of_systems(tmp_path, system, expected):
    more = f"{system}FORCE,7,{TIP},4,10.,1.,-2.,3.\nMOMENT,7,{TIP},4,-2.,1.,-2.,3.\n"
    more += "GRAV,7,4,2.,0.,3.,4.\n" * ("CORD2R" in system)
    (tmp_path / "a.bdf").write_text(bulk(more))
    found = nastran_contents(tmp_path / "a.bdf")
    assert found.distributed.unread == []
    assert [component for _, component, _ in found.forces] == list(COMPONENTS)
    assert [value for *_, value in found.forces] == pytest.approx(
        [factor * value for factor in (10.0, -2.0) for value in expected])
    if "CORD2R" in system:
        assert found.distributed.gravity == [("", pytest.approx((8.0, 0.0, 6.0)))]


def test_rotation_of_an_archive_is_that_of_a_deck(tmp_path):
    expected, _ = displacement(tmp_path, "*DLOAD\nEALL, CENTRIF, 2500., 0., 0., 0., 0., 3., 4.\n")
    found, study = displacement(tmp_path, "OMEGA,  0.0    ,  30.0    ,  40.0\n", 1.0, "a.cdb")
    assert study.body.rotation.speed == pytest.approx(50.0)
    assert found == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_moments_of_nastran_act_on_points_that_others_follow(tmp_path):
    end = [k + 1 for k, place in enumerate(MESH.nodes) if place[0] > 0.199]
    hub = len(MESH.nodes) + 1
    text = bulk(f"MOMENT,7,{hub},0,2.0,1.,0.,-3.\nRBE2,9,{hub},123456,"
                f"{','.join(map(str, end[:5]))}\n+,{','.join(map(str, end[5:]))}\n")
    (tmp_path / "a.bdf").write_text(text.replace(
        "CHEXA,1,1", f"GRID,{hub},,0.2,0.05,0.025\nCHEXA,1,1"))
    study = Study.from_toml(imported(tmp_path / "a.bdf").toml(tmp_path), tmp_path / "a.toml")
    assert [(one.point, one.component, one.signal.value) for one in study.load.forces] == [
        (f"point {hub}", "phi_x", 2.0), (f"point {hub}", "phi_z", -6.0)]


@pytest.mark.parametrize(("file", "load", "sentences"), [
    ("a.bdf", pload4(2.0, *UP, side=TOP) + pload4(2.0, *UP, side=TOP, number=8),
     ("Each of the sets of loads '7', '8', of which no LOAD = of the case control names",)),
    ("a.bdf", "RFORCE,7,1,,3.,0.,0.,1.\nGRAV,7,4,9.81,0.,0.,1.\n"
     "CORD2C,4,0,0.,0.,0.,0.,0.,1.\n+,1.,0.,0.\n" + pload4("1.,2.,3.", 1),
     ("RFORCE is left out", "GRAV along the axes of the round system 4 is left out",
      "PLOAD4 with a direction or a pressure that varies is left out")),
    ("a.bdf", "PLOAD4,7,1,2.,,,,1,2\n", ("PLOAD4 on no side of a solid element (the element 1)",)),
    ("a.bdf", f"SPC,3,{TIP},3,.001\n", ("SPC with displacements other than zero is left out",)),
    ("a.cdb", f"SFE,1,1,PRES,0,1.,2.,1.,1.\nD,{TIP},UX,.001\nF,{TIP},HEAT,3.\nBF,1,TEMP,20.\n",
     ("a pressure that varies is left out", "D UX other than zero is left out",
      "F HEAT is left out", "BF is left out")),
])
def test_loads_of_nastran_and_ansys_that_are_not_taken_are_named(file, load, sentences, tmp_path):
    text = imported(written(tmp_path / file, load, 1.0)).toml(tmp_path)
    for sentence in sentences:
        assert sentence in text, text
    study = Study.from_toml(text, tmp_path / "a.toml")
    assert (study.load is None or study.load.gravity, not study.load or study.load.boundaries) in (
        (None, ()), (True, True))


def test_supports_of_several_components_are_groups_of_their_own(tmp_path):
    (tmp_path / "a.bdf").write_text(bulk(f"SPC1,3,3,{TIP}\n"))
    mesh = read_mesh(tmp_path / "a.bdf")
    assert sorted(mesh.points["SPC 3"] + 1) == sorted([*HELD, TIP])
    assert (mesh.points["SPC 3 3"] + 1).tolist() == [TIP]
    assert nastran_contents(tmp_path / "a.bdf").supports == (
        ("SPC 3 123", "x y z"), ("SPC 3 3", "z"))
    study = Study.from_toml(imported(tmp_path / "a.bdf").toml(tmp_path), tmp_path / "a.toml")
    assert study.body.fixed == {"SPC 3 123": "xyz", "SPC 3 3": "z"}


@pytest.mark.parametrize("corners", [4, 6, 8])
def test_sides_of_cells_by_two_of_their_points(corners, tmp_path):
    """By the rule of PLOAD4: for tetrahedra a corner and the one opposite, else across the side."""
    from fecontact.fem.mesh_files.nastran_loads import _side

    numbers = tuple(range(11, 11 + corners))
    for facet in CELL_KINDS[3, corners].facets:
        wanted = {numbers[k] for k in facet}
        first = numbers[facet[0]]
        other = (({*numbers} - wanted).pop() if corners == 4
                 else numbers[facet[2]] if len(facet) == 4 else None)
        assert {*_side(numbers, first, other)} == wanted


@pytest.mark.parametrize(("file", "load", "message"), [
    ("a.bdf", "FORCE,7,999,,1.,1.,0.,0.\n", r"FORCE of line \d+ names the point 999"),
    ("a.bdf", f"FORCE,7,{TIP},,x,1.,0.,0.\n", r"'x' is not a number"),
    ("a.bdf", "GRAV,7,,9.81,a,0.,1.\n", r"'a' is not a number"),
    ("a.cdb", "SFE,99,1,PRES,0,2.\n", r"pressure on face 1 of element 99, which no solid"),
    ("a.cdb", "SFE,1,7,PRES,0,2.\n", r"pressure on face 7 of element 1, which no solid"),
    ("a.cdb", "ACEL,0,x,0\n", r"ACEL holds the values '0,x,0', which are no numbers"),
])
def test_bad_loads_of_nastran_and_ansys(file, load, message, tmp_path):
    path = written(tmp_path / file, load, 1.0)
    with pytest.raises((MeshError, InputError), match=message):
        read_mesh(path)


# Local axes of nodes: supports, then forces of 6 along the local x and 2 along z of a node ------


@pytest.mark.parametrize(("transform", "held", "fixed", "forces"), [
    ("TYPE=R\n0., 1., 0., -1., 0., 0.", "1, 1", "y", {"y": 6.0, "z": 2.0}),
    ("TYPE=R\n0., 1., 0., 0., 0., 1.", "2, 3", "xz", {"y": 6.0, "x": 2.0}),
    ("TYPE=R\n3., 4., 0., -4., 3., 0.", "1, 2", "xy", {"x": 3.6, "y": 4.8, "z": 2.0}),
    ("TYPE=R\n3., 4., 0., -4., 3., 0.", "1, 3", "xyz", {"x": 3.6, "y": 4.8, "z": 2.0}),
    # The tip lies at the radius (0.1, 0.05) of the axis.
    ("TYPE=C\n.1, .05, 0., .1, .05, 1.", "3, 3", "z",
     {"x": 12.0 / 5.0**0.5, "y": 6.0 / 5.0**0.5, "z": 2.0}),
])
def test_supports_and_forces_of_decks_act_along_transforms(transform, held, fixed, forces,
                                                           tmp_path):
    text = deck(f"*CLOAD\n{TIP}, 1, 6.\n{TIP}, 3, 2.\n").replace("HELD, 1, 3", f"HELD, {held}")
    before = f"*NSET, NSET=LOCAL\nHELD, {TIP}\n*TRANSFORM, NSET=LOCAL, {transform}\n*BOUNDARY\n"
    (tmp_path / "a.inp").write_text(text.replace("*BOUNDARY\n", before))
    study = Study.from_toml(imported(tmp_path / "a.inp").toml(tmp_path), tmp_path / "a.toml")
    assert study.body.fixed == {"HELD": fixed}
    found = {one.component: one.signal.value for one in study.load.forces}
    assert found == pytest.approx(forces)


def test_supports_along_axes_that_are_not_those_of_the_coordinates_are_named(tmp_path):
    text = deck("").replace("*BOUNDARY\nHELD, 1, 3", "*TRANSFORM, NSET=HELD\n3., 4., 0., -4., 3., "
                            "0.\n*BOUNDARY\nHELD, 1, 1\nHELD, 3, 3")
    (tmp_path / "a.inp").write_text(text)
    found = imported(tmp_path / "a.inp").toml(tmp_path)
    assert ("The support of HELD in x, z of its local axes is held in z of the coordinates alone: "
            in found)
    assert Study.from_toml(found, tmp_path / "a.toml").body.fixed == {"HELD": "z"}


@pytest.mark.parametrize(("angles", "fixed", "forces"), [
    ((90.0, 0.0, 0.0), "y", {"y": 6.0, "z": 2.0}),
    ((0.0, 90.0, 0.0), "x", {"x": 6.0, "y": -2.0}),
    ((0.0, 0.0, 90.0), "z", {"z": -6.0, "x": 2.0}),
    ((90.0, 90.0, 0.0), "y", {"y": 6.0, "x": 2.0}),
    ((90.0, 90.0, 90.0), "x", {"x": -6.0, "y": 2.0}),
])
def test_supports_and_forces_of_archives_act_along_rotated_axes(angles, fixed, forces, tmp_path):
    nodes = np.column_stack([MESH.nodes, np.tile(angles, (len(MESH.nodes), 1))])
    held = "".join(f"D,{node:8d},UX  ,  0.00000000    ,  0.00000000    \n" for node in HELD)
    path = archive(tmp_path / "a.cdb", 185, nodes, MESH.cells + 1,
                   f"{material(EX=2.1e11, NUXY=0.3, DENS=7850.0)}\n{held}F,{TIP},FX,6.\n"
                   f"F,{TIP},FZ,2.")
    study = Study.from_toml(imported(path).toml(tmp_path), tmp_path / "a.toml")
    assert study.body.fixed == {"D UX": fixed}
    found = {one.component: one.signal.value for one in study.load.forces}
    assert found == pytest.approx(forces)


@pytest.mark.parametrize(("options", "fixed"), [
    (", OP=NEW", {"TIP": "xy"}), (", OP=MOD", {"HELD": "xyz", "TIP": "xy"})])
def test_new_supports_of_the_first_step_replace_those_before(options, fixed, tmp_path):
    """OP=NEW counts in the first *BOUNDARY of the step; the second one adds to it."""
    (tmp_path / "a.inp").write_text(deck(
        f"*NSET, NSET=TIP\n{TIP}, {HIGH}\n*BOUNDARY{options}\nTIP, 1\n"
        f"*BOUNDARY, OP=NEW\nTIP, 2\n"))
    study = Study.from_toml(imported(tmp_path / "a.inp").toml(tmp_path), tmp_path / "a.toml")
    assert study.body.fixed == fixed


# Studies --------------------------------------------------------------------------------------


def test_the_basis_of_the_study_has_the_loads(tmp_path):
    load = "*DLOAD\nUP, P2, 2e6\nEALL, GRAV, 9.81, 0., 0., -1.\n"
    _, study = displacement(tmp_path, load)
    assert study.basis.loads == ("DLOAD-1", "gravity")
    assert [(one.boundary, one.pressure) for one in study.load.boundaries] == [("DLOAD-1", 2e6)]
    assert study.load.gravity == pytest.approx((0.0, 0.0, -9.81))


def test_what_is_not_taken_is_named(tmp_path):
    """Loads of parts of the body, of inner sides, of other kinds and in time; of second steps."""
    (tmp_path / "a.inp").write_text(deck(
        "*DLOAD\nUP, GRAV, 9.81, 0., 0., -1.\n2, P1, 5.\nEALL, BX, 3.\n"
        "UP, CENTRIF, 4., 0., 0., 0., 0., 0., 1.\n"
        "*DLOAD, AMPLITUDE=A\nUP, P2, 1.\n*DSLOAD\nROOF, TRVEC, 1., 0., 0., 1.\n"
        "*BOUNDARY\nHELD, 1, 1, 0.001\n*CLOAD, AMPLITUDE=A, FOLLOWER\n"
        "*CLOAD\nHELD, 1, 5.\n*NODE, NSET=FREE\n9999, 1., 0., 0.\n*BOUNDARY\nFREE, 1, 3\n"))
    text = imported(tmp_path / "a.inp").toml(tmp_path)
    for wanted in ("Gravity on UP is left out: gravity must act on all cells.",
                   "The pressure on DLOAD-1 is left out: DLOAD-1 is not a boundary of the bodies.",
                   "Centrifugal force on UP is left out", "*DLOAD BX is left out",
                   "*BOUNDARY with displacements other than zero is left out",
                   "The option AMPLITUDE of *CLOAD is left out",
                   "The option FOLLOWER of *CLOAD is left out",
                   "*DSLOAD TRVEC is left out", "*DLOAD with AMPLITUDE is left out",
                   "The force on HELD is left out: HELD is not a single point of the bodies.",
                   "The support of FREE is left out: FREE is not a group of the bodies"):
        assert wanted in text, wanted
    study = Study.from_toml(text, tmp_path / "a.toml")
    assert (study.load.gravity, study.load.boundaries, study.body.rotation) == (None, (), None)


@pytest.mark.parametrize(("line", "sentence"), [
    ("HELDD, 1, 3", "The support of HELDD is left out: HELDD is not a group of the bodies"),
    ("HELD, 1, 3, 0.1", "*BOUNDARY with displacements other than zero is left out: only supports "),
])
def test_lost_supports_are_among_the_notes(line, sentence, tmp_path):
    """Without a study too, and once in its comments."""
    (tmp_path / "a.inp").write_text(deck("").replace("HELD, 1, 3", line))
    found = imported(tmp_path / "a.inp")
    assert [sentence in note for note in found.notes].count(True) == 1
    assert found.toml(tmp_path).count(sentence) == 1


def test_materials_that_properties_name_in_vain_are_told(tmp_path):
    (tmp_path / "a.bdf").write_text(bulk("PSOLID,1,4\n"))
    assert "The deck gives the body no material. The study takes steel: correct [body]." in (
        imported(tmp_path / "a.bdf").notes)


def test_a_sum_of_sets_of_supports_acts(tmp_path):
    (tmp_path / "a.bdf").write_text(
        "SPC = 9\n" + bulk(f"SPC1,4,3,{TIP}\nSPCADD,9,3,4\nSPC1,5,1,{TIP}\n"))
    assert set(nastran_contents(tmp_path / "a.bdf").supports) == {
        ("SPC 3", "x y z"), ("SPC 4", "z")}


@pytest.mark.parametrize(("load", "message"), [
    ("*DLOAD\nUP, P2\n", r"\*DLOAD has the line 'UP, P2' with too few values; P2 needs 1"),
    ("*DLOAD\nEALL, GRAV, 9.81\n", r"with too few values; GRAV needs 4"),
    ("*DSLOAD\nROOF, P\n", r"\*DSLOAD has the line 'ROOF, P' with too few values; P needs 1"),
    ("*DLOAD\nnone, P1, 2.\n", r"refers to a set 'none' that it does not hold"),
    ("*DLOAD\nUP, P1, x\n", r"\*DLOAD"),
])
def test_bad_loads(load, message, tmp_path):
    (tmp_path / "a.inp").write_text(deck(load))
    with pytest.raises(MeshError, match=message):
        read_mesh(tmp_path / "a.inp")


@pytest.mark.parametrize(("sets", "supports", "fixed"), [
    ("*NSET, NSET=TWICE\nHELD\n", "HELD, 3, 3\nTWICE, 1, 2", {"HELD": "z", "TWICE": "xy"}),
    ("*NSET, NSET=TWICE\nHELD\n", "TWICE, 1, 2\nHELD, 3, 3", {"HELD": "z", "TWICE": "xy"}),
    (f"*NSET, NSET=ONE\n{TIP}\n", f"{TIP}, 1, 2\nONE, 3, 3", {"ONE": "xyz", "BOUNDARY 1-2": "xy"}),
])
def test_supports_of_a_set_by_several_names_add_up(sets, supports, fixed, tmp_path):
    text = deck("").replace("*BOUNDARY\nHELD, 1, 3", f"{sets}*BOUNDARY\n{supports}")
    (tmp_path / "a.inp").write_text(text)
    study = Study.from_toml(imported(tmp_path / "a.inp").toml(tmp_path), tmp_path / "a.toml")
    assert study.body.fixed == fixed
