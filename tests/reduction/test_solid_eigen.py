"""Modes of solids by factors and by multigrid, against closed forms and each other."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array, eye_array
from scipy.sparse.linalg import eigsh, splu
from skfem import MeshHex, MeshTet
from solid_blocks import block_mesh

import fecontact.reduction.solvers.solid_solver as solid_solver
from fecontact import (
    AnalysisError,
    ElasticBody,
    InputError,
    Material,
    Mesh,
    ModelWarning,
    modal_basis,
)
from fecontact.fem.elements.cell_kinds import CELL_KINDS
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.eigenmodes import FreeSystem, eigenmodes, strain_energies
from fecontact.reduction.solvers.factorisation import (
    CholmodFactors,
    factorised,
    nested_dissection,
)
from fecontact.reduction.solvers.lobpcg import lowest_modes
from fecontact.reduction.solvers.solid_solver import aspect_ratios, suited
from fecontact.reduction.static_modes.flexibility import Flexibility
from fecontact.reduction.static_modes.iterated_flexibility import IteratedFlexibility

STEEL = Material(2.1e11, 0.3, 7850.0)


def block(cells, sides=(1.0, 1.0, 1.0), hexahedra=False, warp=None):
    """Mesh of a block with its faces at both ends of x."""
    kind = MeshHex if hexahedra else MeshTet
    grid = kind.init_tensor(*(np.linspace(0.0, a, n + 1)
                              for a, n in zip(sides, cells, strict=True)))
    nodes = grid.p.T if warp is None else warp(grid.p.T)
    # scikit-fem takes the corners of hexahedra in an order of its own.
    members = grid.t.T[:, np.argsort(CELL_KINDS[3, 8].order)] if hexahedra else grid.t.T
    plain = Mesh(nodes, members)
    ends = {name: plain.outline[(np.abs(nodes[plain.outline, 0] - x) < 1e-9).all(axis=1)]
            for name, x in (("left", 0.0), ("right", sides[0]))}
    return Mesh(nodes, members, {name: faces for name, faces in ends.items() if len(faces)})


@pytest.fixture(scope="module")
def cube():
    return ElasticBody(block((5, 5, 5)), STEEL)


# Solvers -----------------------------------------------------------------------------------------

@pytest.mark.parametrize(("body", "name"), [
    (ElasticBody(block((6, 4, 3), (1.5, 1.0, 0.7)), STEEL), "free"),
    (ElasticBody(block((6, 4, 3), (1.5, 1.0, 0.7)), STEEL, fixed={"left": "xyz"}), "clamped"),
    (ElasticBody(block((6, 4, 3), (1.5, 1.0, 0.7)), STEEL, fixed={"left": "x"}), "sliding"),
    (ElasticBody(block((4, 3, 2), hexahedra=True), STEEL, fixed={"right": "yz"}), "hexahedra"),
    (ElasticBody(block((9, 8, 6)), STEEL, degree=1), "linear"),
])
def test_solvers_agree(body, name):
    direct, shapes = eigenmodes(body, 16, "direct")
    iterative, others = eigenmodes(body, 16, "iterative")
    rigid = {"free": 6, "clamped": 0, "sliding": 3, "hexahedra": 1, "linear": 6}[name]
    assert (direct[:rigid] == 0.0).all()
    assert (iterative[:rigid] == 0.0).all()
    assert iterative[rigid:] == pytest.approx(direct[rigid:], rel=1e-10)
    M = body.mass
    assert np.abs(others.T @ (M @ others) - np.eye(16)).max() < 1e-10
    # Equal frequencies leave the shapes undetermined, the spans are the same.
    last = 16 - int(direct[15] < direct[14] * (1.0 + 1e-6))
    cosines = np.linalg.svd(shapes[:, :last].T @ (M @ others), compute_uv=False)[:last]
    assert cosines == pytest.approx(np.ones(last), abs=1e-9)


@pytest.mark.parametrize("eigensolver", ["direct", "iterative"])
def test_modes_do_without_libraries_that_have_no_wheels_everywhere(cube, monkeypatch, eigensolver):
    """METIS orders factors, PyAMG has coarse levels: others serve, with more memory."""
    monkeypatch.setattr("fecontact.reduction.solvers.multigrid._FACTORISED", 0)
    expected = eigenmodes(cube, 12, eigensolver)[0]
    for name in ("pymetis", "pyamg"):
        monkeypatch.setitem(sys.modules, name, None)
    assert eigenmodes(cube, 12, eigensolver)[0][6:] == pytest.approx(expected[6:], rel=1e-10)


def test_against_scipy(cube):
    w = eigenmodes(cube, 12, "iterative")[0]
    expected = eigsh(cube.stiffness, 12, cube.mass, sigma=-1e6, return_eigenvectors=False)
    assert w[6:] ** 2 == pytest.approx(np.sort(expected)[6:], rel=1e-9)


def test_rigid_modes_are_exact(cube):
    w, shapes = eigenmodes(cube, 8, "iterative")
    assert (w[:6] == 0.0).all()
    force = np.abs(cube.stiffness @ shapes[:, :6]).max()
    assert force < 1e-14 * abs(cube.stiffness).max() * np.abs(shapes).max() * 30
    assert strain_energies(cube, shapes[:, :6]).max() < 1e-25 * strain_energies(cube, shapes).max()


def test_strain_energies_are_those_of_the_stiffness(cube):
    w, shapes = eigenmodes(cube, 10)
    expected = 0.5 * (shapes * (cube.stiffness @ shapes)).sum(axis=0)
    assert strain_energies(cube, shapes)[6:] == pytest.approx(expected[6:], rel=1e-12)
    assert w[6:] ** 2 == pytest.approx(2.0 * expected[6:], rel=1e-12)


def test_aggregates(cube, monkeypatch):
    """Linear elements through smoothed aggregation, as in large bodies."""
    import fecontact.reduction.solvers.multigrid as multigrid

    expected = eigenmodes(cube, 14, "direct")[0]
    monkeypatch.setattr(multigrid, "_FACTORISED", 100)
    monkeypatch.setattr(multigrid, "_COARSEST", 50)
    solver = FreeSystem.of(cube, "iterative").iterative
    assert len(solver.mesh_cycle.levels) > 1
    assert eigenmodes(cube, 14, "iterative")[0][6:] == pytest.approx(expected[6:], rel=1e-10)


@pytest.mark.parametrize("coarsest", [50, 1])
def test_aggregates_of_nodes_that_slide_along_walls(coarsest, monkeypatch):
    """Along edges between walls an aggregate has less than six motions, on two levels or three."""
    import fecontact.reduction.solvers.multigrid as multigrid

    mesh = block_mesh((9, 8, 6), (1.0, 1.0, 0.7), tetrahedra=True)
    body = ElasticBody(mesh, STEEL, degree=1, fixed={
        "left": "x", "right": "x", "front": "y", "back": "y", "contact": "z", "top": "z"})
    expected = eigenmodes(body, 12, "direct")[0]
    monkeypatch.setattr(multigrid, "_FACTORISED", 100)
    monkeypatch.setattr(multigrid, "_COARSEST", coarsest)
    solver = FreeSystem.of(body, "iterative").iterative
    assert len(solver.mesh_cycle.levels) == (1 if coarsest == 50 else 2)
    found = solver.modes(12, np.zeros((len(body.nodes) * 3, 0)))
    assert found.converged
    assert found.steps <= 20
    assert np.sqrt(found.squares) == pytest.approx(expected, rel=1e-10)


def test_steps_do_not_grow_with_the_mesh():
    """Multigrid: twice as fine a mesh takes no more steps."""
    steps = []
    for n in (4, 8):
        system = FreeSystem.of(ElasticBody(block((n, n, n)), STEEL), "iterative")
        found = system.iterative.modes(10, system.rigid)
        assert found.converged
        steps.append(found.steps)
    assert steps[1] <= steps[0] + 2
    assert steps[1] <= 18


def test_thin_plates_fall_back(monkeypatch):
    """A plate of 1 : 200 is too thin for multigrid: the direct solver takes over, and says so."""
    body = ElasticBody(block((8, 8, 1), (1.0, 1.0, 0.005)), replace(STEEL, poisson_ratio=0.49))
    assert np.median(aspect_ratios(body)) > 5.0
    monkeypatch.setattr(solid_solver, "_FEW", 0)
    assert not suited(body)
    system = FreeSystem.of(body, "iterative")
    assert not system.iterative.modes(6, system.rigid).converged
    w = eigenmodes(body, 12, "direct")[0]
    with pytest.warns(ModelWarning, match="does not converge in 60 steps.* direct solver takes"):
        fallen = eigenmodes(body, 12, "iterative")[0]
    assert (fallen == w).all()


def test_choice(monkeypatch):
    """Compact bodies of many unknowns are iterated."""
    monkeypatch.setattr(solid_solver, "_FEW", 2000)
    mesh = block((5, 5, 5))
    assert suited(ElasticBody(mesh, STEEL))
    assert not suited(ElasticBody(block((2, 2, 2)), STEEL))
    assert not suited(ElasticBody(mesh, replace(STEEL, poisson_ratio=0.48)))
    assert not suited(ElasticBody(block((5, 5, 5), (1.0, 1.0, 0.1)), STEEL))
    assert FreeSystem.of(ElasticBody(mesh, STEEL)).iterative is not None
    assert FreeSystem.of(ElasticBody(mesh, STEEL), "direct").iterative is None
    with pytest.raises(InputError, match=r"eigensolver = 'lanczos' must be one of"):
        eigenmodes(ElasticBody(mesh, STEEL), 8, "lanczos")


@pytest.mark.parametrize(("noise", "reached"), [(0.0, 1e-6), (1e-12, 1e-5), (1.0, 1e-4)])
def test_accuracy_is_stated(noise, reached):
    """Residuals end at the tolerance, or where round-off ends them, but no frequency above 1e-8."""
    squares = np.linspace(1.0, 3.0, 400)[:, None] ** 4
    rough = squares * np.linspace(0.7, 1.6, 400)[::-1, None]
    start = np.random.default_rng(0).standard_normal((400, 16))
    found = lowest_modes(lambda x: squares * x, lambda x: x.copy(), lambda x: x / rough, start, 5,
                         np.zeros((400, 0)), tolerance=1e-6, noise=np.array([noise]))
    assert found.converged
    assert reached / 100.0 < found.errors.max() <= reached
    assert np.sqrt(found.squares) == pytest.approx(np.sqrt(squares[:5, 0]), rel=reached**2)


def test_aspect_ratios():
    """Cubes count 1, cells stretched by 7 count 7, a regular tetrahedron 1."""
    cubes = ElasticBody(block((2, 2, 2), hexahedra=True), STEEL)
    assert aspect_ratios(cubes) == pytest.approx(np.ones(8), rel=1e-12)
    flat = ElasticBody(block((2, 2, 2), (1.0, 1.0, 1.0 / 7.0), hexahedra=True), STEEL)
    assert aspect_ratios(flat) == pytest.approx(np.full(8, 7.0), rel=1e-12)
    corners = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
    regular = ElasticBody(Mesh(corners, [[0, 1, 2, 3]]), STEEL)
    assert aspect_ratios(regular) == pytest.approx([1.0], rel=1e-12)


@pytest.mark.parametrize("fixed", [{}, {"left": "xyz"}, {"left": "x"}])
def test_deflections_agree(fixed):
    body = ElasticBody(block((5, 4, 4), (1.2, 1.0, 0.9)), STEEL, fixed=fixed)
    one, other = (FreeSystem.of(body, way) for way in ("direct", "iterative"))
    forces = np.random.default_rng(1).standard_normal((one.stiffness.shape[0], 40))
    expected, found = one.deflection(forces), other.deflection(forces)
    assert "factors" not in other.__dict__
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()
    assert other.deflection(forces[:, 0]) == pytest.approx(found[:, 0], rel=1e-6, abs=1e-22)


@pytest.mark.parametrize("nodes", [3, 24])
def test_modal_bases_agree(nodes):
    """Residual vectors of few and of many rows, without and with factors."""
    mesh = block((6, 5, 4), (1.3, 1.0, 0.8))
    below = mesh.outline[(mesh.nodes[mesh.outline, 2] < 1e-9).all(axis=1)]
    mesh = Mesh(mesh.nodes, mesh.cells, {"bottom": below})
    bases = [modal_basis(ElasticBody(mesh, STEEL), 10, contact="bottom", contact_nodes=nodes,
                         reduction="residual", tolerance=0.2, eigensolver=way)
             for way in ("direct", "iterative")]
    one, other = bases
    assert one.angular_frequencies.shape == other.angular_frequencies.shape
    assert other.angular_frequencies == pytest.approx(one.angular_frequencies, rel=1e-5)
    assert other.quality.compliance == pytest.approx(one.quality.compliance, rel=1e-7)


def test_cholmod_where_it_is_installed():
    """CHOLMOD agrees with SuperLU and the iterative solver, and refuses a singular stiffness."""
    pytest.importorskip("sksparse.cholmod")
    body = ElasticBody(block((4, 3, 3)), STEEL)
    system = FreeSystem.of(body, "direct")
    assert isinstance(system.factors, CholmodFactors)
    K = system.stiffness[system.held][:, system.held].tocsc()
    force = np.random.default_rng(0).standard_normal((K.shape[0], 3))
    expected = splu(K).solve(force)
    assert np.abs(system.factors.solve(force) - expected).max() < 1e-9 * np.abs(expected).max()
    L, diagonal, place = system.factors.triangle()
    product = (L.toarray() * diagonal) @ L.toarray().T
    assert np.abs(product[np.ix_(place, place)] - K).max() < 1e-13 * abs(K).max()
    assert eigenmodes(body, 12, "direct")[0][6:] == pytest.approx(
        eigenmodes(body, 12, "iterative")[0][6:], rel=1e-9)
    rows = csr_array(np.eye(6, K.shape[0] + 6))
    compliance = Flexibility(system, rows).compliance
    assert compliance == pytest.approx(
        IteratedFlexibility(FreeSystem.of(body, "iterative"), rows, accuracy=1e-7).compliance,
        abs=1e-6 * compliance.max())
    with pytest.raises(AnalysisError, match="stiffness of the supported body is singular"):
        factorised((system.stiffness - 1e-2 * abs(system.stiffness).max() * eye_array(
            system.stiffness.shape[0])).tocsc())


def test_nested_dissection():
    """Factors of cubes have less fill than by minimum degree, and solve the same equations."""
    body = ElasticBody(block((3, 3, 3)), STEEL, fixed={"left": "xyz"})
    system = FreeSystem.of(body, "direct")
    nodes = body.expansion.indices // 3
    order = nested_dissection(system.stiffness, nodes)
    assert (np.sort(order) == np.arange(len(nodes))).all()
    dissected, plain = factorised(system.stiffness, nodes), factorised(system.stiffness)
    force = np.random.default_rng(0).standard_normal((len(nodes), 3))
    assert dissected.solve(force) == pytest.approx(plain.solve(force), rel=1e-8, abs=1e-18)
    L, diagonal, place = dissected.triangle()
    product = (L.toarray() * diagonal) @ L.toarray().T
    K = system.stiffness.toarray()
    assert np.abs(product[np.ix_(place, place)] - K).max() < 1e-13 * np.abs(K).max()
    larger = FreeSystem.of(ElasticBody(block((6, 6, 6)), STEEL), "direct")
    fill = [factorised(larger.stiffness[larger.held][:, larger.held], way).triangle()[0].nnz
            for way in (larger.held // 3, None)]
    assert fill[0] < 0.9 * fill[1]


# Closed and published forms ----------------------------------------------------------------------

def rates(values, exact):
    errors = np.abs(np.array(values) / exact - 1.0)
    return np.log2(errors[:-1] / errors[1:])


@pytest.mark.parametrize(("degree", "cells", "rate", "within"), [
    (1, (4, 8, 16), 2.0, 0.1), (2, (2, 4, 8), 4.0, 0.15),
])
@pytest.mark.parametrize("hexahedra", [False, True])
def test_rates_of_a_bar(degree, cells, rate, within, hexahedra):
    """Longitudinal waves in a bar that may not spread: f = c / (2 L) with the pressure wave."""
    E, nu, rho = STEEL.youngs_modulus, STEEL.poisson_ratio, STEEL.density
    speed = np.sqrt(E * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) / rho)
    found = []
    for n in cells:
        mesh = block((n, 1, 1), (1.0, 0.02, 0.02), hexahedra)
        sides = {axis: mesh.outline[np.ptp(mesh.nodes[mesh.outline, k], axis=1) < 1e-9]
                 for k, axis in ((1, "y"), (2, "z"))}
        mesh = Mesh(mesh.nodes, mesh.cells, sides)
        body = ElasticBody(mesh, STEEL, degree=degree, fixed={"y": "y", "z": "z"})
        found.append(eigenfrequencies_hz(body, 2))
    assert (np.array(found)[:, 0] == 0.0).all()
    assert rates(np.array(found)[:, 1], speed / 2.0) == pytest.approx([rate] * 2, abs=within)


@pytest.mark.parametrize(("degree", "cells", "rate"), [(1, (4, 8), 2.0), (2, (2, 4), 4.0)])
def test_lame_modes_of_a_free_cube(degree, cells, rate):
    """u = (sin kx cos ky, -cos kx sin ky, 0), k = pi / a, about the centre: w^2 = 2 k^2 G / rho."""
    exact = np.pi * np.sqrt(2.0 * STEEL.youngs_modulus / 2.6 / STEEL.density)
    found = []
    for n in cells:
        body = ElasticBody(block((n, n, n), hexahedra=True), STEEL, degree=degree)
        x, y, _ = np.pi * (body.nodes.T - 0.5)
        lame = np.column_stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y), 0.0 * x]).ravel()
        w, shapes = eigenmodes(body, 30)
        share = (lame @ (body.mass @ shapes)) ** 2 / (lame @ (body.mass @ lame))
        assert share.sum() > 0.99
        found.append(np.sqrt(share @ w**2 / share.sum()))
    assert rates(found, exact) == pytest.approx([rate], abs=0.3)
    assert found[-1] == pytest.approx(exact, rel=0.02 if degree == 1 else 1e-3)


def test_cantilever_plate():
    """Leissa's square cantilever plate: w a^2 sqrt(rho h / D) = 3.49, 8.52, 21.4, 27.3, 31.1."""
    material = Material(2.1e11, 0.3, 7850.0)
    h = 0.01
    body = ElasticBody(block((14, 14, 1), (1.0, 1.0, h), hexahedra=True), material,
                       fixed={"left": "xyz"})
    bending = material.youngs_modulus * h**3 / (12.0 * (1.0 - 0.3**2))
    found = 2.0 * np.pi * eigenfrequencies_hz(body, 5) * np.sqrt(material.density * h / bending)
    assert found == pytest.approx([3.4917, 8.5246, 21.429, 27.331, 31.111], rel=0.01)


def test_factors_that_do_not_fit_say_what_to_do(monkeypatch):
    def full(*_, **__):
        raise MemoryError

    monkeypatch.setitem(sys.modules, "sksparse.cholmod", None)
    monkeypatch.setattr("scipy.sparse.linalg.splu", full)
    with pytest.raises(AnalysisError, match=r"of 81 unknowns are larger.*eigensolver = 'iterat"):
        factorised(eye_array(81, format="csc"))
