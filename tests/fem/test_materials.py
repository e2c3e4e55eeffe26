"""Several materials in one body, by groups of cells."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from solid_blocks import block_mesh
from test_deck_constraints import displacement, part, point_loads, read

from fecontact import (
    BoundaryLoad,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    MeshError,
    ModelWarning,
    Study,
    modal_basis,
    read_mesh,
    static_solution,
    write_mesh,
)
from fecontact.cli import execute
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.eigenmodes import strain_energies

STEEL, ALUMINIUM = Material(2.1e11, 0.3, 7850.0), Material(7.0e10, 0.33, 2700.0)
SIZE = (0.1, 0.04, 0.03)


def halves(mesh):
    """The mesh with its cells in ``near`` and ``far`` along x."""
    x = mesh.nodes[mesh.cells].mean(axis=1)[:, 0]
    middle = 0.5 * mesh.nodes[:, 0].max()
    return Mesh(mesh.nodes, mesh.cells, mesh.boundaries, mesh.points, cell_groups={
        "near": np.flatnonzero(x < middle), "far": np.flatnonzero(x > middle)})


MESHES = {"triangles": halves(rectangle(0.1, 0.04, 4, 2, triangles=True)),
          "quadrilaterals": halves(rectangle(0.1, 0.04, 4, 2)),
          "tetrahedra": halves(block_mesh((4, 2, 2), SIZE, tetrahedra=True)),
          "hexahedra": halves(block_mesh((4, 2, 2), SIZE))}


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cells", MESHES)
def test_two_bars_in_series(cells, degree):
    """Tension p: u = p (L1 / E1 + L2 / E2), stress p in both, with nu = 0."""
    materials = {"near": Material(2e11, 0.0, 8000.0), "far": Material(5e10, 0.0, 2000.0)}
    body = ElasticBody(MESHES[cells], materials, degree=degree, fixed={"left": (
        "xyz" if MESHES[cells].dimension == 3 else "xy")})
    found = static_solution(body, Load(boundaries=(BoundaryLoad("right", -1e6),)))
    end = body.group_nodes("right")
    assert found.displacement[end, 0] == pytest.approx(1e6 * (0.05 / 2e11 + 0.05 / 5e10), rel=1e-9)
    assert found.stress[:, 0] == pytest.approx(1e6, rel=1e-8)
    assert np.abs(found.stress[:, 1:]).max() < 1e-2
    area = 0.04 * (0.03 if body.dimension == 3 else 1.0)
    assert body.total_mass == pytest.approx(0.05 * area * 10000.0, rel=1e-12)
    assert body.mass.sum() / body.dimension == pytest.approx(body.total_mass, rel=1e-12)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("cells", MESHES)
def test_equal_materials_are_one(cells, plane):
    mesh = MESHES[cells]
    options = {} if mesh.dimension == 3 else {"plane": plane, "thickness": 0.02}
    one, two = (ElasticBody(mesh, material, **options)
                for material in (STEEL, {"far": STEEL, "near": STEEL}))
    for first, second in ((one.stiffness, two.stiffness), (one.mass, two.mass)):
        assert abs(first - second).max() < 1e-12 * abs(first).max()
    moved = np.random.default_rng(0).standard_normal((one.nodes.size, 3))
    assert strain_energies(two, moved) == pytest.approx(strain_energies(one, moved), rel=1e-12)
    bases = [modal_basis(body, 8, contact=()) for body in (one, two)]
    assert bases[1].angular_frequencies == pytest.approx(bases[0].angular_frequencies, rel=1e-9)
    stresses = [np.abs(basis.mode_shapes.stress).max(axis=(0, 1)) for basis in bases]
    assert stresses[1][6:] == pytest.approx(stresses[0][6:], rel=1e-6)


@pytest.mark.parametrize("cells", MESHES)
def test_strain_energies_are_those_of_the_stiffness(cells):
    body = ElasticBody(MESHES[cells], {"near": STEEL, "far": ALUMINIUM})
    moved = np.random.default_rng(1).standard_normal((body.nodes.size, 4))
    assert strain_energies(body, moved) == pytest.approx(
        0.5 * np.einsum("im,im->m", moved, body.stiffness @ moved), rel=1e-10)


def test_a_group_keeps_its_cells_in_refined_and_placed_meshes():
    """Two materials weigh the same before and after; the frequencies converge from above."""
    materials = {"near": STEEL, "far": ALUMINIUM}
    for mesh in MESHES.values():
        other = mesh.refined().placed((0.1,) * mesh.dimension, 30.0, "x")
        bodies = [ElasticBody(one, materials, degree=1) for one in (mesh, other)]
        assert bodies[1].total_mass == pytest.approx(bodies[0].total_mass, rel=1e-12)
        first, second = (eigenfrequencies_hz(body, 8)[-1] for body in bodies)
        assert 0.6 * first < second < first


def test_the_iterative_solver_takes_several_materials():
    body = ElasticBody(MESHES["tetrahedra"].refined(), {"near": STEEL, "far": ALUMINIUM})
    direct, iterated = (eigenfrequencies_hz(body, 12, eigensolver=solver)
                        for solver in ("direct", "iterative"))
    assert iterated == pytest.approx(direct, rel=1e-7)


# Decks ------------------------------------------------------------------------------------------


def deck_of(mesh, sections):
    sets = "".join(f"*ELSET, ELSET={name.upper()}\n" + "".join(f"{cell + 1},\n" for cell in cells)
                   for name, cells in mesh.cell_groups.items())
    return part(mesh, "A") + sets + sections


MATERIALS = ("*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n"
             "*MATERIAL, NAME=ALU\n*DENSITY\n2700.,\n*ELASTIC, TYPE=ISO\n7e10, 0.33\n")
SECTIONS = ("*SOLID SECTION, ELSET=near, MATERIAL=steel\n"
            "*SOLID SECTION, ELSET=FAR, MATERIAL=ALU\n")


def test_sections_of_a_deck_against_calculix(tmp_path):
    """ccx 2.20 for this deck, fixed at the left: *STATIC with *CLOAD at a corner, *FREQUENCY."""
    mesh = read(tmp_path, deck_of(MESHES["tetrahedra"], MATERIALS + SECTIONS))
    assert mesh.materials == {"NEAR": STEEL, "FAR": ALUMINIUM}
    body = ElasticBody(mesh, fixed={"A_left": "xyz"})
    place = np.array((0.1, 0.04, 0.03))
    assert displacement(body, point_loads(tuple(place)), place) == pytest.approx(
        (3.983722e-06, 1.480812e-06, -9.198555e-06), rel=1e-6)
    assert eigenfrequencies_hz(body, 3) == pytest.approx((3690.489, 4625.784, 9707.037), rel=6e-4)
    assert ("material FAR", "70 GPa, Poisson ratio 0.33, 2700 kg/m³") in body.summary()
    # A material that is given goes before those of the file.
    assert ElasticBody(mesh, ALUMINIUM).total_mass == pytest.approx(2700.0 * np.prod(SIZE))


WARM = (MATERIALS.replace("7850.\n", "7850.\n*EXPANSION, ZERO=20.\n1.2e-5\n")
        + "*EXPANSION\n2.3e-5, 20.\n")


def test_thermal_expansion_of_a_deck_against_calculix(tmp_path):
    """ccx 2.20, fixed at the left: *INITIAL CONDITIONS of 20, *TEMPERATURE of 80 at all nodes."""
    mesh = read(tmp_path, deck_of(MESHES["tetrahedra"], WARM + SECTIONS))
    assert [mesh.materials[name].thermal_expansion for name in ("NEAR", "FAR")] == [1.2e-5, 2.3e-5]
    found = static_solution(ElasticBody(mesh, fixed={"A_left": "xyz"}), Load(), temperature=60.0)
    corner = np.linalg.norm(found.nodes - (0.1, 0.04, 0.03), axis=1).argmin()
    assert found.displacement[corner] == pytest.approx(
        (1.099598e-4, 2.698495e-5, 1.945810e-5), rel=1e-6)


TEMPERATURE = "*TEMPERATURE\n"


def heated(temperatures, initial="A, 20.\n"):
    """A deck with initial temperatures and those of a second step."""
    return (deck_of(MESHES["tetrahedra"], WARM + SECTIONS)
            + f"*INITIAL CONDITIONS, TYPE=TEMPERATURE\n{initial}*STEP\n*STATIC\n{TEMPERATURE}"
            f"A, 300.\n*END STEP\n*STEP\n*STATIC\n{temperatures}*END STEP\n")


def at_nodes(function):
    """Data lines of temperatures at all nodes of the ten-node tetrahedra."""
    return "".join(f"{number}, {function(*place):.9g}\n" for number, place in enumerate(
        ElasticBody(MESHES["tetrahedra"]).nodes.tolist(), start=1))


@pytest.mark.parametrize(("function", "initial", "corner", "tolerance"), [
    (lambda x, y, z: 20.0 + 500.0 * x + 800.0 * y - 1500.0 * z, "A, 15.\nA_left_N, 20.\nA, 20.\n",
     (2.487223e-5, -5.338452e-5, 1.437692e-4), 1e-6),
    # CalculiX integrates the square with four points.
    (lambda x, y, z: 20.0 + 300.0 * x + 4e4 * y * y - 9e3 * x * z, "A, 20.\nA_left_N, 15.\n",
     (1.033966e-4, -1.178718e-4, 5.361795e-5), 1.5e-3)])
def test_temperatures_of_a_deck_against_calculix(tmp_path, function, initial, corner, tolerance):
    """ccx 2.20: initial temperatures of sets, those of the last step at each node."""
    mesh = read(tmp_path, heated(TEMPERATURE + at_nodes(function), initial))
    found = static_solution(ElasticBody(mesh, fixed={"A_left": "xyz"}), Load(), temperature="mesh")
    at = np.linalg.norm(found.nodes - (0.1, 0.04, 0.03), axis=1).argmin()
    assert found.displacement[at] == pytest.approx(corner, rel=tolerance)


def test_temperatures_of_steps_and_of_changed_meshes(tmp_path):
    def mean(temperatures, **options):
        mesh = read(tmp_path, heated(temperatures), **options)
        return mesh.temperature.mean()

    assert mean("") == pytest.approx(280.0)
    assert mean("*TEMPERATURE, OP=NEW\n") == 0.0
    assert mean("*TEMPERATURE, OP=NEW\nA, 60.\n", scale=1e-3) == pytest.approx(40.0)
    mesh = read(tmp_path, heated(TEMPERATURE + at_nodes(lambda x, y, z: 20.0 + 500.0 * x)))
    for one in (mesh, mesh.refined(), mesh.refined().placed((0.0, 0.0, 1.0), 90.0)):
        body = ElasticBody(one)
        basis = modal_basis(body, 8, contact=(), reduction="residual", temperature="mesh")
        x = body.nodes[:, 0] if one.nodes[:, 0].max() > 0.05 else body.nodes[:, 1]
        assert basis.mode_shapes.temperature == pytest.approx(500.0 * x, abs=1e-9)
    study = Study.from_toml("[geometry]\nfile = 'a.inp'\n[basis]\nmodes = 8\ncontact = []\n"
                            "reduction = 'residual'\ntemperature = 'mesh'\n", tmp_path / "a.toml")
    assert study.modal_basis().mode_shapes.temperature.max() == pytest.approx(50.0)


def test_import_takes_the_temperature_of_a_deck(tmp_path):
    read(tmp_path, heated(TEMPERATURE + "A, 60.\n"))
    assert execute(["import", str(tmp_path / "a.inp"), "-o", str(tmp_path / "a.toml")]) == 0
    study = Study.read(tmp_path / "a.toml")
    assert study.basis.temperature == "mesh"
    assert study.modal_basis().mode_shapes.temperature == pytest.approx(40.0)


def test_temperatures_that_are_not_read_are_said(tmp_path):
    for options in ("AMPLITUDE=RAMP", "FILE=hot, BSTEP=1"):
        with pytest.warns(ModelWarning, match=f"TEMPERATURE with {options.partition('=')[0]}"):
            mesh = read(tmp_path, heated(f"*TEMPERATURE, {options}\nA, 60.\n"))
        assert mesh.temperature is None
    with pytest.raises(InputError, match="is for meshes of decks with"):
        static_solution(ElasticBody(mesh), Load(), temperature="mesh")
    with pytest.raises(InputError, match="temperature = 'warm' must be a number, or 'mesh'"):
        static_solution(ElasticBody(mesh), Load(), temperature="warm")
    with pytest.raises(MeshError, match=r"\*TEMPERATURE names the node or set 'B'"):
        read(tmp_path, heated("*TEMPERATURE\nB, 60.\n"))
    with pytest.raises(MeshError, match="give a node or set and its temperature"):
        read(tmp_path, heated("*TEMPERATURE\nA\n"))
    with pytest.raises(MeshError, match="Mesh temperature must be 9 finite numbers"):
        rectangle(1.0, 1.0, 2, 2).__class__(rectangle(1.0, 1.0, 2, 2).nodes, rectangle(
            1.0, 1.0, 2, 2).cells, temperature=[1.0])
    hot = read(tmp_path, heated(TEMPERATURE + "A, 60.\n"))
    with pytest.warns(ModelWarning, match="Gmsh cannot store .* its temperatures"):
        write_mesh(hot, tmp_path / "a.msh")


def test_decks_in_millimetres_newtons_and_tonnes(tmp_path):
    text = deck_of(MESHES["tetrahedra"], MATERIALS.replace("2.1e11", "2.1e5").replace(
        "7850.", "7.85e-9").replace("7e10", "7e4").replace("2700.,", "2.7e-9") + SECTIONS)
    found = read(tmp_path, text, scale=1e-3).materials
    assert found["NEAR"].youngs_modulus == pytest.approx(2.1e11)
    assert found["NEAR"].density == pytest.approx(7850.0)
    assert found["FAR"].density == pytest.approx(2700.0)


def test_materials_of_instances_and_of_wedges(tmp_path):
    """Two instances of a part with sections; wedges keep their set."""
    own = deck_of(MESHES["tetrahedra"], SECTIONS)
    text = (f"*PART, NAME=P\n{own}*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=near, PART=P\n"
            "*END INSTANCE\n*INSTANCE, NAME=far, PART=P\n0.1, 0, 0\n*END INSTANCE\n"
            f"*TIE\nfar.A_left, near.A_right\n*END ASSEMBLY\n{MATERIALS}")
    mass = 0.5 * np.prod(SIZE) * (7850.0 + 2700.0)
    assert ElasticBody(read(tmp_path, text)).total_mass == pytest.approx(2.0 * mass)
    with pytest.warns(ModelWarning, match="1 constraint reaches beyond the part 'near'"):
        near = read(tmp_path, text, part="near")
    assert ElasticBody(near).total_mass == pytest.approx(mass)
    wedges = ("*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,1,0,1\n6,0,1,1\n7,1,1,0\n8,1,1,1\n"
              "*ELEMENT, TYPE=C3D6, ELSET=NEAR\n1,1,2,3,4,5,6\n"
              "*ELEMENT, TYPE=C3D6, ELSET=FAR\n2,2,7,3,5,8,6\n")
    body = ElasticBody(read(tmp_path, wedges + MATERIALS + SECTIONS))
    assert body.mesh.cell_groups["FAR"].tolist() == [1]
    assert body.total_mass == pytest.approx(0.5 * (7850.0 + 2700.0))


def test_studies_take_the_materials_of_the_file_unless_they_give_one(tmp_path):
    read(tmp_path, deck_of(MESHES["tetrahedra"], MATERIALS + SECTIONS))
    masses = []
    for body in ("", 'material = "aluminium"'):
        study = Study.from_toml(f"[geometry]\nfile = 'a.inp'\n[body]\n{body}\n[basis]\nmodes = 8\n"
                                "contact = []\n", tmp_path / "study.toml")
        masses.append(study.elastic_body().total_mass)
    assert masses == pytest.approx([0.5 * np.prod(SIZE) * (7850.0 + 2700.0),
                                    2700.0 * np.prod(SIZE)])


def test_written_meshes_keep_their_groups_of_cells(tmp_path):
    """Overlapping groups, cells of no group, and a group of the name of all cells."""
    for mesh in MESHES.values():
        x = mesh.nodes[mesh.cells].mean(axis=1)[:, 0]
        groups = {"near": x < 0.06, "far": x > 0.03, "body": x < 0.02, "first": x == x.min()}
        made = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, cell_groups={
            name: np.flatnonzero(held) for name, held in groups.items()})
        write_mesh(made, tmp_path / "a.msh")
        again = read_mesh(tmp_path / "a.msh")
        assert again.cell_groups.keys() == groups.keys()
        for name, held in groups.items():
            rows = (np.sort(one.cells[one.cell_groups[name]], axis=1) for one in (made, again))
            assert len({tuple(map(tuple, np.unique(each, axis=0))) for each in rows}) == 1
            assert len(again.cell_groups[name]) == held.sum()


def test_written_meshes_lose_incompatible_modes_with_a_warning(tmp_path):
    mesh = MESHES["hexahedra"]
    with pytest.warns(ModelWarning, match=r"cannot store the incompatible modes of its bricks; gi"):
        write_mesh(Mesh(mesh.nodes, mesh.cells, bricks="incompatible"), tmp_path / "a.msh")


# Bad input --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("sections", "message"), [
    (SECTIONS + MATERIALS.replace("NAME=ALU", "NAME=TIN"),
     r"The section of 'FAR' names the material 'ALU', which the file does not hold.*; its "
     r"materials are: 'STEEL', 'TIN'\.$"),
    ("*SOLID SECTION, ELSET=NEAR\n", r"A line \*SOLID SECTION has no MATERIAL=; add it\.$"),
    ("*SOLID SECTION, MATERIAL=STEEL\n", r"A line \*SOLID SECTION has no ELSET=; add it\.$"),
    (SECTIONS + MATERIALS.replace("0.3\n", "0.7\n"), r"poisson_ratio = 0\.7 must be above -1"),
])
def test_bad_sections_are_refused(tmp_path, sections, message):
    with pytest.raises((MeshError, InputError), match=message) as caught:
        read(tmp_path, deck_of(MESHES["tetrahedra"], sections))
    assert str(caught.value).startswith(str(tmp_path / "a.inp"))


@pytest.mark.parametrize("change", [
    ("*DENSITY\n7850.\n", ""),
    ("*ELASTIC\n2.1e11, 0.3\n", "*ELASTIC, TYPE=ORTHO\n1,1,1,1,1,1,1,1\n"),
    ("*ELASTIC\n2.1e11, 0.3\n", ""),
    ("2.1e11, 0.3\n", "2.1e11, 0.3, 20\n2.0e11, 0.3, 200\n")])
def test_materials_that_are_not_read_are_warned_of(tmp_path, change):
    text = deck_of(MESHES["tetrahedra"], MATERIALS.replace(*change) + SECTIONS)
    with pytest.warns(ModelWarning, match=r"a\.inp: the material 'steel' has not one set of "
                                          r"constants .*; give material to the body\.$"):
        assert read(tmp_path, text).materials == {}


@pytest.mark.parametrize(("material", "message"), [
    ({"near": STEEL}, r"^ElasticBody: material leaves 48 of 96 cells without a material, the first "
                      r"at \(0\.\d+, .*\); give the groups of these cells too\.$"),
    ({"near": STEEL, "for": STEEL}, r"material names 'for', which is no group of cells of the mesh "
                                    r"\(did you mean 'far'\?\); its groups of cells are: "),
    ({"near": STEEL, "far": STEEL, "all": STEEL}, r"material gives cells of 'all' a second one"),
    ({"near": "steel", "far": STEEL}, r"near must be a Material or .*, not str"),
])
def test_bad_materials_are_refused(material, message):
    mesh = MESHES["tetrahedra"]
    groups = {**mesh.cell_groups, "all": np.arange(len(mesh.cells))}
    with pytest.raises((InputError, MeshError), match=message):
        ElasticBody(Mesh(mesh.nodes, mesh.cells, cell_groups=groups), material)


def test_groups_of_cells_of_a_file_and_bad_ones(tmp_path):
    mesh = read(tmp_path, deck_of(MESHES["tetrahedra"], ""))
    assert {"NEAR", "FAR"} <= mesh.cell_groups.keys()
    with pytest.raises(MeshError, match=r"group of cells 'x' must hold numbers from 0 to 95"):
        Mesh(mesh.nodes, mesh.cells, cell_groups={"x": [96]})
