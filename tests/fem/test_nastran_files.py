"""Fields, coordinate systems, included files and materials of Nastran's bulk data."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fecontact as fc
from fecontact import InputError, MeshError, ModelWarning, read_mesh
from fecontact.fem import AnisotropicMaterial, CylindricalAxes
from fecontact.fem.elements.cell_kinds import CELL_KINDS
from fecontact.fem.mesh_files.nastran_bulk import _EDGES
from fecontact.fem.mesh_files.nastran_loads import nastran_contents
from fecontact.reduction import eigenfrequencies_hz
from fecontact.study.imported import imported

MESH = fc.Mesh.grid(np.linspace(0.0, 0.3, 4), [0.0, 0.05, 0.1], [0.0, 0.08])
FLAT = fc.Mesh.grid(np.linspace(0.0, 0.3, 4), [0.0, 0.05, 0.1])
PROPERTY = "PSOLID,1,9\n"


def small(name, *words):
    rows = [words[k : k + 8] for k in range(0, len(words), 8)]
    return "".join(f"{name if k == 0 else '+':<8}" + "".join(f"{word:>8}" for word in row) + "\n"
                   for k, row in enumerate(rows))


def large(name, *words):
    words = [*words, *[""] * (-len(words) % 8)]
    rows = [words[k : k + 4] for k in range(0, len(words), 4)]
    return "".join(f"{f'{name}*' if k == 0 else '*':<8}" + "".join(f"{word:>16}" for word in row)
                   + "\n" for k, row in enumerate(rows))


def free(name, *words):
    rows = [words[k : k + 8] for k in range(0, len(words), 8)]
    return "".join(",".join(map(str, [name if k == 0 else "+", *row])) + "\n"
                   for k, row in enumerate(rows))


def bulk(more="", form=free, mesh=MESH, kind="CHEXA", system=""):
    places = np.column_stack([mesh.nodes, np.zeros((len(mesh.nodes), 3 - mesh.nodes.shape[1]))])
    text = "".join(form("GRID", k, system, *(f"{value:.5f}" for value in place))
                   for k, place in enumerate(places.tolist(), 1))
    text += "".join(form(kind, k, 1, *row) for k, row in enumerate((mesh.cells + 1).tolist(), 1))
    return f"BEGIN BULK\n{text}{more}ENDDATA\n"


def written(folder, text, name="a.bdf"):
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize("form", [small, large, free])
def test_fields_of_all_widths_are_read(tmp_path, form):
    card = form("MAT1", 9, "7.1E+10", "", ".33", "2700.", "2.3-5", "", ".01")
    mesh = read_mesh(written(tmp_path, bulk(PROPERTY + card, form)))
    assert_allclose(mesh.nodes, MESH.nodes, atol=1e-15)
    assert mesh.cells.tolist() == MESH.cells.tolist()
    assert mesh.materials == {"1": fc.Material(7.1e10, 0.33, 2700.0, 0.01, 2.3e-5)}
    assert fc.ElasticBody(mesh).total_mass == pytest.approx(0.3 * 0.1 * 0.08 * 2700.0)


@pytest.mark.parametrize(("card", "found"), [
    ("MAT1,9,,2.6e10,.3,2700.\n", (6.76e10, 0.3)),
    ("MAT1,9,7.28e10,2.8e10,,2700.\n", (7.28e10, 0.3)),
    ("MAT1,9,7.28e10,2.8e10,.3,2700.\n", (7.28e10, 0.3))])
def test_two_of_three_elastic_constants_suffice(tmp_path, card, found):
    one, = read_mesh(written(tmp_path, bulk(PROPERTY + card))).materials.values()
    assert (one.youngs_modulus, one.poisson_ratio) == pytest.approx(found, rel=1e-12)


def stiffness():
    """A stiffness without symmetry beside that of energy, positive definite."""
    part = np.random.default_rng(2).uniform(-1.0, 1.0, (6, 6))
    return 1e10 * (part @ part.T + 3.0 * np.eye(6))


UPPER = [(row, column) for row in range(6) for column in range(row, 6)]


def test_anisotropic_materials_are_those_of_a_deck_of_abaqus(tmp_path):
    """MAT9 counts by rows xx, yy, zz, xy, yz, zx, Abaqus by columns xx, yy, zz, xy, xz, yz."""
    C = stiffness()
    words = [9, *(f"{C[row, column]:.9e}" for row, column in UPPER), 4000.0]
    frame = "CORD2R,5,,0.,0.,0.,1.,2.,2.\n+,2.,2.,-1.\n"
    mesh = read_mesh(written(tmp_path, bulk(
        f"PSOLID,1,9,5\n{frame}{large('MAT9', *words)}")))
    order = [0, 1, 2, 3, 5, 4]
    values = [C[order[row], order[column]] for column in range(6) for row in range(column + 1)]
    lines = [", ".join(f"{value:.9e}" for value in values[k : k + 8]) for k in (0, 8, 16)]
    # The axis z of the system lies along (1, 2, 2) / 3, x is what (2, 2, -1) leaves across it.
    z = np.array([1.0, 2.0, 2.0]) / 3.0
    x = np.array([2.0, 2.0, -1.0])
    x = (x - x @ z * z) / np.linalg.norm(x - x @ z * z)
    axes = ", ".join(f"{value:.15f}" for value in (*x, *np.cross(z, x)))
    text = "*NODE\n" + "".join(f"{k}, {a}, {b}, {c}\n"
                               for k, (a, b, c) in enumerate(MESH.nodes.tolist(), 1))
    text += "*ELEMENT, TYPE=C3D8, ELSET=ALL\n" + "".join(
        f"{k}, {', '.join(map(str, row))}\n" for k, row in enumerate((MESH.cells + 1).tolist(), 1))
    text += (f"*ORIENTATION, NAME=O\n{axes}\n*MATERIAL, NAME=M\n*ELASTIC, TYPE=ANISO\n"
             + "\n".join(lines) + "\n*DENSITY\n4000.\n*SOLID SECTION, ELSET=ALL, MATERIAL=M, "
             "ORIENTATION=O\n")
    other = read_mesh(written(tmp_path, text, "a.inp"))
    found, wanted = (eigenfrequencies_hz(fc.ElasticBody(one, degree=1), 12)[6:]
                     for one in (mesh, other))
    assert_allclose(found, wanted, rtol=1e-9)


def test_orthotropic_materials_of_solids_with_cylindrical_axes(tmp_path):
    card = free("MAT11", 9, 9e10, 2e10, 1e10, .3, .2, .1, 7e9, 6e9, 5e9, 1600.)
    mesh = read_mesh(written(tmp_path, bulk(
        f"PSOLID,1,9,5\n{card}CORD2C,5,0,1.,0.,0.,1.,0.,3.\n+,4.,0.,0.\n")))
    one, = mesh.materials.values()
    assert one == AnisotropicMaterial.orthotropic(
        (9e10, 2e10, 1e10), (0.3, 0.2, 0.1), (7e9, 6e9, 5e9), 1600.0,
        CylindricalAxes((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))


@pytest.mark.parametrize("turn", ["", "30.", "5"])
def test_plane_orthotropic_materials(tmp_path, turn):
    """A strip in plane stress under tension along x: E_x = 1 / (c^4 / E_1 + ... ) by its angle."""
    text = bulk("PSHELL,1,9,.01\nMAT8,9,9e10,2e10,.3,7e9,,,1600.\n"
                "CORD2R,5,,0.,0.,0.,0.,0.,1.\n+,.866025403784439,.5,0.\n", mesh=FLAT, kind="CQUAD4")
    if turn:
        text = "".join(f"{row},{turn}\n" if row.startswith("CQUAD4") else f"{row}\n"
                       for row in text.splitlines())
    mesh = read_mesh(written(tmp_path, text))
    slide = {"left": "x", "base": "y"}
    edges = {"left": (0.0, 0.0, 0.0, 0.1), "right": (0.3, 0.0, 0.3, 0.1)}
    mesh = read_mesh(tmp_path / "a.bdf", boundaries=edges, points={"base": (0.0, 0.0)})
    moved = fc.static_solution(
        fc.ElasticBody(mesh, fixed=slide),
        fc.Load(boundaries=[fc.BoundaryLoad("right", pressure=-1e6)]))
    angle = np.radians(30.0) if turn else 0.0
    c, s = np.cos(angle) ** 2, np.sin(angle) ** 2
    flexible = c * c / 9e10 + s * s / 2e10 + c * s * (1.0 / 7e9 - 2.0 * 0.3 / 9e10)
    strain = stress_free_strain(moved)
    assert strain == pytest.approx(1e6 * flexible, rel=1e-6 if not turn else 1e-9)


def stress_free_strain(fields):
    """Mean strain along x of a strip whose left edge keeps its x."""
    x, u = fields.nodes[:, 0], fields.displacement[:, 0]
    return u[np.abs(x - 0.3) < 1e-9].mean() / 0.3


@pytest.mark.parametrize(("cards", "message"), [
    ("PSOLID,1,9\nMAT1,9,7e10,,.3\n", "density = 0.* no material of the file is taken, give"),
    ("PSOLID,1,9\nMAT1,9,7e10,1e10,.3,2700.\n", "MAT1 of line .* is not isotropic: G differs"),
    ("PSOLID,1,8\nMAT1,9,7e10,,.3,2700.\n", "property 1 .* material 8, for which the file ho"),
    ("MAT1,9,7e10,,.3,2700.\n", "holds no PSOLID 1"),
    ("PSOLID,1,9\nMAT8,9,9e10,2e10,.3,7e9,,,1600.\n", "kind MAT8, which is that of plane bodies"),
    ("PSOLID,1,9,-1\nMAT11,9,9e10,2e10,1e10,.3,.2,.1,7e9\n+,6e9,5e9,1600.\n", "of its elements"),
    ("PSOLID,1,9,7\nMAT11,9,9e10,2e10,1e10,.3,.2,.1,7e9\n+,6e9,5e9,1600.\n", "te system 7"),
])
def test_materials_that_are_not_read_are_said(tmp_path, cards, message):
    with pytest.warns(ModelWarning, match=message):
        mesh = read_mesh(written(tmp_path, bulk(cards)))
    assert mesh.materials == {}


def test_masses_in_a_unit_of_force(tmp_path):
    mesh = read_mesh(written(tmp_path, bulk("PSOLID,1,9\nMAT1,9,7e10,,.3,10.\nPARAM,WTMASS,.5\n")))
    assert mesh.materials["1"].density == 5.0


SYSTEM = """\
CORD2R,3,,1.,0.,2.,1.,0.,9.
+,3.,0.,2.
CORD2{kind},7,3,0.,0.,0.,0.,1.,0.
+,0.,0.,5.
"""


@pytest.mark.parametrize("kind", ["R", "C", "S"])
@pytest.mark.parametrize("by_default", [False, True])
def test_places_in_other_systems(tmp_path, kind, by_default):
    """The system has its origin at (1, 0, 2), z along the basic y, and x along the basic z."""
    own = np.roll(MESH.nodes - [1.0, 0.0, 2.0], 1, axis=1)
    r, around = np.hypot(own[:, 0], own[:, 1]), np.degrees(np.arctan2(own[:, 1], own[:, 0]))
    if kind == "C":
        own = np.column_stack([r, around, own[:, 2]])
    elif kind == "S":
        own = np.column_stack([np.hypot(r, own[:, 2]), np.degrees(np.arctan2(r, own[:, 2])),
                               around])
    rows = [row for row in bulk().splitlines() if not row.startswith("GRID")]
    rows[1:1] = [f"GRID,{k},{'' if by_default else 7},{x:.10f},{y:.10f},{z:.10f}"
                 for k, (x, y, z) in enumerate(own.tolist(), 1)]
    rows[-1:] = [*SYSTEM.format(kind=kind).splitlines(), *["GRDSET,,7"] * by_default, "ENDDATA"]
    assert_allclose(read_mesh(written(tmp_path, "\n".join(rows))).nodes, MESH.nodes, atol=1e-9)


def test_a_system_at_grid_points(tmp_path):
    """Its axis z goes from point 1 to point 2 along the basic y, x to point 3 along z."""
    text = bulk("CORD1R,7,90,91,92\n", system=7)
    for number, place in ((90, "0.,0.,0."), (91, "0.,2.,0."), (92, "0.,1.,1.")):
        text = text.replace("ENDDATA\n", f"GRID,{number},,{place}\nENDDATA\n")
    found = read_mesh(written(tmp_path, text)).nodes
    assert_allclose(found, np.roll(MESH.nodes, -1, axis=1), atol=1e-12)


def test_included_files_are_read_once(tmp_path):
    text = bulk()
    grid = "".join(f"{row}\n" for row in text.splitlines() if row.startswith("GRID"))
    rest = "".join(f"{row}\n" for row in text.splitlines() if not row.startswith("GRID"))
    (tmp_path / "the parts").mkdir()
    written(tmp_path / "the parts", grid, "grid points.dat")
    path = written(tmp_path, rest.replace(
        "BEGIN BULK\n", "BEGIN BULK\nINCLUDE 'the parts/grid points.dat'\n"))
    assert_allclose(read_mesh(path).nodes, MESH.nodes, atol=1e-15)
    written(tmp_path / "the parts", "GRID,1,,x,0.,0.\n", "grid points.dat")
    with pytest.raises(InputError, match=r"line 1 of grid points\.dat: 'x' is not a number"):
        read_mesh(path)
    written(tmp_path / "the parts", "include '../a.bdf'\n", "grid points.dat")
    with pytest.raises(MeshError, match=r"includes itself, a\.bdf -> grid points\.dat -> a\.bdf; "):
        read_mesh(path)
    with pytest.raises(MeshError, match=r"includes the file 'b\.dat', but there is no file"):
        read_mesh(written(tmp_path, "INCLUDE 'b.dat'\nENDDATA\n", "c.bdf"))


@pytest.mark.parametrize(("more", "message"), [
    ("GRID,1,,5.,0.,0.\n", "Line .* gives the grid point 1 a second time, at another place"),
    ("CHEXA,1,1,1,2,3,4,5,6\n+,7,8\n", "gives the element 1 a second time"),
    ("CHEXA,90,1,1,2,3,4,5,6\n+,,8,9\n", "The CHEXA 90 of line .* has 8 nodes; it must have 8, t"),
    ("BEGIN SUPER=3\n", "Line .* begins a superelement .*'BEGIN SUPER=3'"),
    ("CTRIAX6,90,1,1,2,3,4,5,6\n", "elements CTRIAX6, which are not read"),
    ("CORD2R,5,6,0.,0.,0.,0.,0.,1.\n+,1.,0.,0.\nCORD2R,6,5,0.,0.,0.,0.,0.,1.\n+,1.,0.,0.\n"
     "GRID,99,5,0.,0.,0.\n", "The coordinate system 5 of line .* refers to itself"),
    ("CORD2R,5,,0.,0.,0.,0.,0.,1.\n+,0.,0.,3.\nGRID,99,5,0.,0.,0.\n", "5 of line .* on one line"),
    ("GRID,99,,0.,0.,0.,,,3\n", "card GRID of line .* has 3 in the field SEID, which makes a s"),
    ("PSOLID,1,9,,,,,PFLUID\n", "PSOLID of line .* has PFLUID in the field FCTN, which makes it"),
    ("PLOAD4,7,1,2.,,,,1,2\n+,0,,,,LINE\n", "PLOAD4 of line .* has LINE in the field SORL, whi"),
    ("NSM1,3,PSOLID,.1,1\n", "The file holds NSM1, which is not read and would stiffen the me"),
    ("GENEL,9\n", "The file holds GENEL, which is not read"),
    ("RBE3,9,,1,1,1.,123,2,3\n", "RBE3 9 of line .* moves its reference point in the component"),
    ("GRID,99,,0.,0.,0.,5\nSPC1,3,1,99\n", "card SPC1 of line .* component 1 of the grid point 99"),
])
def test_bad_files(tmp_path, more, message):
    with pytest.raises((MeshError, InputError), match=message):
        read_mesh(written(tmp_path, bulk(more)))


@pytest.mark.parametrize(("kind", "count", "lacking"), [
    ("CHEXA", 20, (9, 18)), ("CTETRA", 10, (7,)), ("CPENTA", 15, (8, 10)), ("CPYRAM", 13, (12,)),
    ("CTRIA6", 6, (4,)), ("CQUAD8", 8, (7, 5))])
def test_middles_that_elements_leave_out_lie_half_way(tmp_path, kind, count, lacking):
    """All middles lie on parabolas, but those that are left out, on straight edges."""
    shape = next(one for (d, _), one in CELL_KINDS.items() if d == 3 - (kind[1:4] in ("TRI", "QUA"))
                 and one.corners + len(one.edges) == count)
    corners = np.zeros((shape.corners, 3))
    corners[list(shape.order), : shape.dimension] = shape.places[: shape.corners]
    ends = corners[np.array(_EDGES[KINDS[kind]])]
    middles = ends.mean(axis=1)
    middles[:, : shape.dimension] += 0.02
    places = np.concatenate([corners, middles])
    rows = "".join(free("GRID", k, "", *(f"{value:.5f}" for value in place))
                   for k, place in enumerate(places.tolist(), 1))
    nodes = ["" if k in lacking else k for k in range(1, count + 1)]
    text = f"BEGIN BULK\n{rows}{free(kind, 1, 1, *nodes)}ENDDATA\n"
    mesh = read_mesh(written(tmp_path, text))
    assert len(mesh.curved_edges) == len(ends) - len(lacking)
    assert_allclose(mesh.curved_middles - mesh.nodes[mesh.curved_edges].mean(axis=1), 0.02)


KINDS = {"CHEXA": "hexahedron", "CTETRA": "tetra", "CPENTA": "wedge", "CPYRAM": "pyramid",
         "CTRIA6": "triangle", "CQUAD8": "quad"}


def test_components_that_grid_points_hold_are_supports(tmp_path):
    text = bulk().replace("GRID,1,,0.00000,0.00000,0.00000", "GRID,1,,0.,0.,0.,,123")
    mesh = read_mesh(written(tmp_path, text))
    assert mesh.points["PS 123"].tolist() == [0]
    assert nastran_contents(tmp_path / "a.bdf").supports == (("PS 123", "x y z"),)
    assert "123" not in imported(written(tmp_path, bulk().replace(
        "0.00000,0.00000\n", "0.00000,0.00000,,456\n", 1), "b.bdf")).toml(tmp_path)


def test_integration_of_a_property_is_named(tmp_path):
    with pytest.warns(ModelWarning, match=r"PSOLID 1 of line \d+ chooses points of integration"):
        read_mesh(written(tmp_path, bulk("PSOLID,1,9,,TWO\nMAT1,9,7e10,,.3,2700.\n")))


@pytest.mark.parametrize(("card", "more"), [
    ("CQUAD4", ["", "", "", "", ".002", "", ".002"]), ("CQUADR", ["30.", "", "", "", "", "", ".1"])
])
def test_thicknesses_at_corners_are_refused(tmp_path, card, more):
    """THETA, ZOFFS, blank, TFLAG, T1 ... T4 behind the nodes."""
    properties = "PSHELL,1,9,.01\nMAT1,9,7e10,,.3,2700.\n"
    flat = written(tmp_path, bulk(properties, mesh=FLAT, kind=card))
    assert read_mesh(flat).materials == {"1": fc.Material(7e10, 0.3, 2700.0)}
    rows = flat.read_text().splitlines()
    at = next(k for k, row in enumerate(rows) if row.startswith(card))
    assert len(rows[at].split(",")) == 7
    rows[at] += f",{more[0]},{more[1]}\n+,{','.join(more[2:])}"
    flat.write_text("\n".join(rows))
    with pytest.raises(MeshError, match=f"line {at + 1} has thicknesses at its corners"):
        read_mesh(flat)
    flat.write_text(flat.read_text().replace(f"\n+,{','.join(more[2:])}", ""))
    assert read_mesh(flat).materials


def test_masses_without_stiffness_are_refused(tmp_path):
    with pytest.raises(MeshError, match=r"PSHELL of line .* has \.5 in the field NSM, a mass"):
        read_mesh(written(tmp_path, bulk("PSHELL,1,9,.01,,,,,.5\n", mesh=FLAT, kind="CQUAD4")))
    assert read_mesh(written(tmp_path, bulk("PSHELL,1,9,.01,,,,,0.\n", mesh=FLAT, kind="CQUAD4")))
