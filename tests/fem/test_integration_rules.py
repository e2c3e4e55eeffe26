"""Rules of quadrature of the elements of decks: reduced and full integration, hourglasses."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh, spsolve
from solid_blocks import block_mesh
from test_wedges import SIZE, second_order, wedges

from fecontact import (
    AnalysisError,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    PointLoad,
    Study,
    read_mesh,
    static_solution,
)
from fecontact.fem import stress_of
from fecontact.fem.assembly import assembled
from fecontact.fem.elements.cell_kinds import HEXAHEDRON, WEDGE
from fecontact.fem.finite_strain import FiniteStrainModel
from fecontact.fem.stress_stiffness import stress_stiffness
from fecontact.fem.thermal import held_stress, nodal_temperatures, thermal_forces
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.eigenmodes import strain_energies
from fecontact.study.imported import imported

MATERIAL = ("*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n"
            "*SOLID SECTION, ELSET=E, MATERIAL=STEEL\n")


def bend(places):
    """A bar along x that is curved in y and inclined in z."""
    x, y, z = places.T
    return np.stack([x, y + 0.004 * np.sin(15.0 * x), z + 0.01 * x], axis=1)


def bar(path, name, counts, bent=False, more=""):
    """A deck of a bar of bricks or wedges of a type; two types split it by halves."""
    names = name.split()
    kind = WEDGE if names[0] in ("C3D6", "C3D15") else HEXAHEDRON
    block = block_mesh(counts, SIZE)
    nodes, cells = wedges(counts) if kind == WEDGE else (block.nodes, block.cells)
    if names[0].startswith(("C3D15", "C3D20")):
        nodes, cells = second_order(nodes, cells, kind, bend if bent else None)
    places = "".join(f"{k}, {', '.join(map(repr, place))}\n"
                     for k, place in enumerate(np.round(nodes, 9).tolist(), start=1))
    text = f"*NODE\n{places}"
    for number, rows in enumerate(np.array_split(np.arange(len(cells)), len(names))):
        text += f"*ELEMENT, TYPE={names[number]}, ELSET=E\n" + "".join(
            f"{k + 1}, {', '.join(map(str, cells[k] + 1))}\n" for k in rows)
    path.write_text(text + MATERIAL + more)
    return path


def tip_displacement(mesh, **options):
    mesh = Mesh(mesh.nodes, mesh.cells, {}, {
        "left": np.flatnonzero(mesh.nodes[:, 0] < 1e-9),
        "tip": int(np.linalg.norm(mesh.nodes - SIZE, axis=1).argmin())},
        mesh.curved_edges, mesh.curved_middles, cell_groups=mesh.cell_groups,
        materials=mesh.materials, bricks=mesh.bricks, integration=mesh.integration)
    # A set of corners holds the middles between them too.
    body = ElasticBody(mesh, fixed={"left": "xyz"}, **options)
    moved = static_solution(body, Load(forces=[
        PointLoad("tip", way, signal=value)
        for way, value in zip("xyz", (300.0, 100.0, -200.0), strict=True)]))
    return moved.displacement[mesh.points["tip"][0]]


# Bars in CalculiX 2.20, steel: displacement of the tip of a clamped one [m], and elastic modes of
# a free one [Hz].
CALCULIX = [
    ("C3D20", (8, 2, 1), False, (1.038967e-05, 2.088673e-05, -1.424231e-04),
     (2577.442, 3711.188, 6770.945, 7049.612, 9205.158, 12526.93)),
    ("C3D20R", (8, 2, 2), False, (1.114068e-05, 2.123857e-05, -1.450273e-04),
     (2570.832, 3709.912, 6715.306, 6845.036, 9196.880, 12349.79)),
    ("C3D20R", (8, 2, 2), True, (1.270749e-05, 2.245767e-05, -1.464235e-04),
     (2584.251, 3700.685, 6596.867, 6955.416, 9175.350, 12300.70)),
    ("C3D15", (8, 2, 1), False, (1.018695e-05, 2.087950e-05, -1.418112e-04),
     (2576.396, 3710.544, 6762.117, 7166.114, 9199.549, 12498.97)),
    ("C3D15", (8, 2, 2), True, (1.208037e-05, 2.223920e-05, -1.446198e-04),
     (2586.158, 3701.697, 6635.525, 7044.095, 9180.818, 12343.99)),
    ("C3D8", (8, 2, 2), False, (6.152826e-06, 1.620381e-05, -8.758322e-05),
     (3360.538, 4313.788, 7457.487, 9160.316, 11184.48, 13023.40)),
    ("C3D8R", (8, 2, 2), False, (1.486704e-05, 2.733580e-05, -1.856534e-04),
     (2423.501, 3524.394, 7106.988, 7952.831, 9837.567, 13087.55)),
    ("C3D6", (8, 2, 1), False, (1.205412e-05, 4.407443e-06, -1.479856e-04),
     (2579.999, 4101.721, 7277.140, 7614.164, 10747.54, 13027.32)),
]


@pytest.mark.parametrize(("name", "counts", "bent", "moved", "frequencies"), CALCULIX,
                         ids=[f"{name}{'-curved' * bent}" for name, _, bent, *_ in CALCULIX])
def test_elements_of_decks_are_those_of_calculix(
    tmp_path, name, counts, bent, moved, frequencies
):
    """Mass at the points of the stiffness, as CalculiX has it, is compared too."""
    mesh = read_mesh(bar(tmp_path / "a.inp", name, counts, bent))
    # CalculiX' hourglass stiffness.
    options = {} if name[3] in "12" else {"degree": 1, "hourglass": 0.001 * 1.3}
    assert len(mesh.curved_edges) > 0 or not bent
    assert tip_displacement(mesh, **options) == pytest.approx(moved, rel=1e-6)
    body = ElasticBody(mesh, **options)
    same = [replace(block, mass_rule=(block.local, block.weights)) for block in body.blocks]
    _, lateral, shear = body.elasticity.T
    _, M = assembled(same, lateral, shear, body.densities)
    # At the points of reduced rules it is singular.
    squares = eigsh(body.stiffness, 12, M=sp.kron(M, sp.eye_array(3), format="csc"), sigma=-1e6,
                    return_eigenvectors=False)
    assert np.sqrt(np.sort(squares)[6:]) == pytest.approx(
        2.0 * np.pi * np.array(frequencies), rel=1e-6)


def test_mass_has_the_exact_rule():
    mesh = block_mesh((4, 2, 2), SIZE)
    for options in ({"degree": 1}, {"bricks": "serendipity"}):
        whole, reduced = (ElasticBody(mesh, integration=rule, **options)
                          for rule in ("exact", "reduced"))
        assert abs(whole.mass - reduced.mass).max() == 0.0
        assert abs(whole.stiffness - reduced.stiffness).max() > 0.05 * whole.stiffness.max()


@pytest.mark.parametrize(("options", "expected", "tolerance"), [
    ({"degree": 1, "integration": "exact"}, 0.5, 0.3),
    ({"degree": 1, "integration": "reduced", "hourglass": 1e-7}, 4.0 / 3.0, 0.01),
    ({"bricks": "serendipity", "integration": "reduced"}, 1.0, 2e-3)], ids=str)
def test_reduced_rules_do_not_lock_in_bending(options, expected, tolerance):
    """A bar with nu = 0 beside Euler and Bernoulli's deflection.

    Mean strains of two cells across the height have 1 - 1 / 2^2 of the stiffness.
    """
    mesh = block_mesh((40, 2, 2), (1.0, 0.04, 0.02))
    body = ElasticBody(mesh, Material(2.1e11, 0.0, 7850.0), fixed={"left": "xyz"}, **options)
    right = np.unique(body.facet_nodes(mesh.boundaries["right"]))
    force = np.zeros(body.nodes.shape)
    force[right, 2] = -100.0 / len(right)
    E = body.expansion
    u = E @ spsolve((E.T @ body.stiffness @ E).tocsc(), E.T @ force.ravel())
    exact = -100.0 / (3.0 * 2.1e11 * 0.04 * 0.02**3 / 12.0)
    assert u.reshape(-1, 3)[right, 2].mean() / exact == pytest.approx(expected, rel=tolerance)


def test_stress_is_that_of_bending_at_all_nodes():
    """u = (x z, 0, -x^2 / 2) with noise that the points of reduced integration do not feel."""
    for mesh in (block_mesh((6, 2, 2), SIZE), read_wedges()):
        body = ElasticBody(mesh, Material(2e11, 0.0, 7850.0), bricks="serendipity",
                           integration="reduced")
        x, _, z = body.nodes.T
        u = np.stack([x * z, 0.0 * x, -0.5 * x**2], axis=1).ravel()
        stress = stress_of(body, u.reshape(-1, 1))[..., 0]
        assert stress[:, 0] == pytest.approx(2e11 * z, abs=1.0)
        assert stress[:, 1:] == pytest.approx(0.0, abs=1.0)
        finite = stress_of(body, 1e-7 * u.reshape(-1, 1), finite=True)[..., 0]
        assert finite[:, 0] == pytest.approx(2e4 * z, abs=1e-3)


def read_wedges():
    nodes, cells = wedges((6, 2, 2))
    return Mesh(nodes, cells)


def test_hourglasses_of_a_brick_leave_no_stress():
    """A single brick of 20 nodes has six motions without strain at its eight points."""
    body = ElasticBody(block_mesh((1, 1, 1), (1.0, 1.0, 1.0)), bricks="serendipity",
                       integration="reduced")
    squares, motions = np.linalg.eigh(body.stiffness.toarray())
    still = motions[:, squares < 1e-9 * squares[-1]]
    assert still.shape[1] == 12
    found = stress_of(body, still)
    assert np.abs(found).max() < 1e-9 * 2.1e11
    assert strain_energies(body, still) == pytest.approx(0.0, abs=1e-8 * squares[-1])


@pytest.mark.parametrize("options", [
    {"degree": 1, "integration": "reduced"},
    {"bricks": "serendipity", "integration": "reduced"},
    {"bricks": "serendipity", "integration": "full"}], ids=str)
def test_energies_and_stressed_stiffness_agree_with_the_matrices(options):
    mesh = block_mesh((3, 2, 2), SIZE)
    mesh = replace(mesh, nodes=mesh.nodes + 0.002 * np.sin(60.0 * mesh.nodes[:, ::-1]))
    body = ElasticBody(mesh, **options)
    u = np.random.default_rng(3).standard_normal((body.unknowns, 3))
    assert strain_energies(body, u) == pytest.approx(
        0.5 * (u * (body.stiffness @ u)).sum(axis=0), rel=1e-10)
    # Under uniform tension along x a lateral displacement v(x) has the energy s V v'^2 / 2.
    pulled = np.stack([1e-3 * body.nodes[:, 0], -0.3e-3 * body.nodes[:, 1],
                       -0.3e-3 * body.nodes[:, 2]], axis=1).ravel()
    aside = np.stack([0.0 * body.nodes[:, 0], body.nodes[:, 0], 0.0 * body.nodes[:, 0]],
                     axis=1).ravel()
    assert aside @ (stress_stiffness(body, pulled) @ aside) == pytest.approx(
        2.1e8 * mesh.volume, rel=1e-9)


@pytest.mark.parametrize("degree", [1, 2])
def test_free_expansion_is_without_stress(degree):
    mesh = block_mesh((4, 2, 2), SIZE)
    mesh = replace(mesh, nodes=mesh.nodes + 0.002 * np.sin(60.0 * mesh.nodes[:, ::-1]))
    body = ElasticBody(mesh, Material(2.1e11, 0.3, 7850.0, thermal_expansion=1.2e-5),
                       degree=degree, bricks="serendipity", integration="reduced")
    warm = nodal_temperatures(body, 100.0)
    grown = 1.2e-3 * body.nodes.ravel()
    forces = thermal_forces(body, warm)
    assert body.stiffness @ grown == pytest.approx(forces, abs=1e-10 * np.abs(forces).max())
    stress = stress_of(body, grown[:, None])[..., 0] + held_stress(body, warm)
    assert np.abs(stress).max() < 1e-9 * 2.1e11 * 1.2e-3


def test_plane_elements_with_mean_strain_and_reduced_rules():
    """Shear and a rotation of a distorted plane mesh: patch test, and hourglass stiffness."""
    lines = np.linspace(0.0, 0.1, 5)
    mesh = Mesh.grid(lines, lines)
    mesh = replace(mesh, nodes=mesh.nodes + mesh.nodes.prod(axis=1)[:, None] * [2.0, -1.0])
    for degree in (1, 2):
        for plane in ("stress", "strain"):
            body = ElasticBody(mesh, Material(), 0.01, plane, degree, bricks="serendipity",
                               integration="reduced")
            x, y = body.nodes.T
            u = np.stack([0.3 * x - 0.2 * y, 0.1 * x + 0.4 * y], axis=1).ravel()
            inside = np.ones(len(body.nodes), bool)
            inside[np.unique(body.facet_nodes(mesh.outline))] = False
            force = (body.stiffness @ u).reshape(-1, 2)
            assert np.abs(force[inside]).max() < 1e-10 * np.abs(force).max()
            assert strain_energies(body, u[:, None]) == pytest.approx(
                0.5 * u @ (body.stiffness @ u), rel=1e-10)
            squares = np.linalg.eigvalsh(body.stiffness.toarray())
            assert (squares > 1e-9 * squares[-1]).sum() == len(squares) - 3


def test_a_row_of_reduced_bricks_is_a_mechanism():
    sizes = (0.08, 0.02, 0.02)
    for fixed in ({}, {"left": "xyz"}):
        row = ElasticBody(block_mesh((4, 1, 1), sizes), bricks="serendipity",
                          integration="reduced", fixed=fixed)
        with pytest.raises(AnalysisError, match=r"without strain \(a mechanism\)"):
            eigenfrequencies_hz(row, 12)
    with pytest.raises(AnalysisError, match="mechanism"):
        static_solution(row, Load(gravity=(0.0, 0.0, -9.81)))
    assert eigenfrequencies_hz(replace(row, integration="full"), 2)[0] > 100.0
    wide = ElasticBody(block_mesh((4, 2, 1), sizes), bricks="serendipity", integration="reduced")
    assert (eigenfrequencies_hz(wide, 12)[6:] > 100.0).all()


def test_large_deflections_refuse_hourglass_stiffness():
    body = ElasticBody(block_mesh((2, 2, 2), SIZE), degree=1, integration="reduced")
    with pytest.raises(InputError, match="without hourglass stiffness; give the body integration"):
        FiniteStrainModel(body)


def test_a_deck_of_full_and_reduced_bricks_has_both(tmp_path):
    path = bar(tmp_path / "a.inp", "C3D20R C3D20", (4, 2, 2))
    mesh = read_mesh(path)
    assert mesh.integration == {"C3D20R": "reduced"}
    assert len(mesh.cell_groups["C3D20R"]) == 8
    found = ElasticBody(mesh)
    assert [len(block.nodes) for block in found.blocks] == [8, 8]
    halves = [ElasticBody(mesh, integration=rule) for rule in ("reduced", "full")]
    cells = np.arange(16)
    u = np.random.default_rng(5).standard_normal((found.unknowns, 1))
    group = mesh.cell_groups["C3D20R"]
    assert strain_energies(found, u) == pytest.approx(
        strain_energies(halves[0], u, group)
        + strain_energies(halves[1], u, np.setdiff1d(cells, group)), rel=1e-12)
    for made in (mesh.placed((1.0, 0.0, 0.0)), mesh.refined(), mesh.part(np.arange(12))):
        assert made.integration == {"C3D20R": "reduced"}
    assert mesh.part(np.setdiff1d(cells, group)).integration == {}
    assert imported(path).notes[0].startswith("8 bricks C3D20R have reduced integration as in the")


def test_the_rule_of_a_study_and_of_python(tmp_path):
    bar(tmp_path / "a.inp", "C3D20R", (4, 2, 2))
    study = "[geometry]\nfile = 'a.inp'\n[body]\n{}[basis]\nmodes = 8\ncontact = []\n"
    for text, wanted in (("", "reduced"), ("integration = 'full'\n", "full")):
        body = Study.from_toml(study.format(text), tmp_path / "study.toml").elastic_body()
        assert body.integration == wanted
        assert body.has_reduced_integration == (wanted == "reduced")
        assert ("reduced integration" in str(body)) == (wanted == "reduced")
    mesh = read_mesh(tmp_path / "a.inp")
    with pytest.raises(InputError, match="integration = 'ful' must be one of 'exact', 'full'"):
        ElasticBody(mesh, integration="ful")
    with pytest.raises(InputError, match="integration names 'F', which is no group of cells"):
        ElasticBody(mesh, integration={"F": "full"})
