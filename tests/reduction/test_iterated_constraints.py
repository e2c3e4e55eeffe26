"""Iterative modes and deflections of solids with ties, couplings, rigid parts and springs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from meshes_for_tests import joined
from solid_blocks import block_mesh

from fecontact import ElasticBody, Material, Mesh, ModelWarning, modal_basis
from fecontact.fem import Coupling, LinearEquation, PointMass, PointSpring, Term, Tie
from fecontact.reduction.eigenmodes import FreeSystem, eigenmodes, free_modes
from fecontact.reduction.solvers import multigrid
from fecontact.reduction.static_modes import iterated_flexibility, residual_vectors

STEEL = Material()
SIDE = (0.1, 0.1, 0.1)
TIE = Tie("one.right", "two.left")


def cubes(first, second, tetrahedra=False, constraints=(TIE,), **options):
    """Two cubes of so many cells along each side, one behind the other in x."""
    one, two = (block_mesh((n, n, n), SIDE, tetrahedra=tetrahedra) for n in (first, second))
    return ElasticBody(joined(one, two.placed((0.1, 0.0, 0.0)), list(constraints)), STEEL,
                       **options)


def coupled(kind, hub="", attachments=(), place=(0.25, 0.05, 0.03)):
    """A block whose right face is coupled to a point, of which ``hub`` names the support."""
    mesh = block_mesh((6, 3, 3), (0.2, 0.1, 0.1))
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries,
                constraints=[Coupling("right", "hub", place, kind)])
    return ElasticBody(mesh, STEEL, fixed={"hub": hub} if hub else {}, attachments=attachments)


def plates():
    """Two plates with a rigid part between them."""
    plate = block_mesh((5, 5, 1), (0.2, 0.2, 0.02))
    return ElasticBody(joined(plate, plate.placed((0.0, 0.0, 0.05)), [
        Coupling("one.top", "hub", (0.1, 0.1, 0.03)), Coupling("two.contact", "hub")]), STEEL)


def springs(*stiffness):
    """Springs at the point along x, y, z, and a mass."""
    return [*(PointSpring([Term("hub", axis)], k)
              for axis, k in zip(np.eye(3).tolist(), stiffness, strict=True)),
            PointMass("hub", 0.5, (1e-4, 2e-4, 3e-4))]


BODIES = {
    "tie, coarse to fine": lambda: cubes(2, 3),
    "tie, fine to coarse, held": lambda: cubes(3, 2, fixed={"one.left": "xyz"}),
    "tie of tetrahedra, sliding": lambda: cubes(3, 2, True, fixed={"one.left": "x"}),
    "tie of linear elements": lambda: cubes(6, 5, degree=1),
    "kinematic, free": lambda: coupled("kinematic"),
    "kinematic, clamped": lambda: coupled("kinematic", "clamped"),
    "kinematic, turning": lambda: coupled("kinematic", "x y z phi_x"),
    "distributing, free": lambda: coupled("distributing"),
    "distributing, clamped": lambda: coupled("distributing", "clamped"),
    "distributing, hinged": lambda: coupled("distributing", "x y z"),
    "rigid part": plates,
    "springs at a coupling": lambda: coupled("kinematic", "", springs(1e7, 2e7, 3e7)),
    "springs at a face": lambda: coupled("distributing", "", springs(1e8, 2e8, 3e8)),
    "hinge": lambda: cubes(3, 2, fixed={"one.left": "hinge_x"}),
    "equation": lambda: cubes(3, 2, constraints=(TIE, LinearEquation(
        [Term(0, (1.0, 2.0, 0.0)), Term(63 + 26, (0.5, -1.0, 1.0))]))),
}


@cache
def body(name):
    return BODIES[name]()


def check_modes(name):
    """The lowest 12 elastic modes, in few steps, over the same unknowns."""
    system = FreeSystem.of(body(name), "iterative")
    solver, rigid = system.iterative, system.rigid.shape[1]
    w, _ = free_modes(FreeSystem.of(body(name), "direct"), 12 + rigid)
    found = solver.modes(12, solver.unknowns.spread @ system.rigid)
    assert found.converged
    assert found.steps <= 25
    assert np.sqrt(found.squares) == pytest.approx(w[rigid:], rel=1e-9)
    shapes = solver.unknowns.pick @ found.shapes
    assert np.abs(shapes.T @ (system.mass @ shapes) - np.eye(12)).max() < 1e-9
    # The shapes meet all equations.
    assert solver.unknowns.spread @ shapes == pytest.approx(
        found.shapes, abs=1e-9 * np.abs(found.shapes).max())


@pytest.mark.parametrize("name", BODIES)
def test_modes_agree_with_those_of_the_direct_solver(name):
    check_modes(name)


@pytest.mark.parametrize("name", ["tie, fine to coarse, held", "kinematic, free", "rigid part",
                                  "distributing, clamped"])
def test_modes_agree_where_aggregates_solve_the_linear_elements(name, monkeypatch):
    """Smoothed aggregation over constrained unknowns, as in large bodies."""
    monkeypatch.setattr(multigrid, "_FACTORISED", 100)
    monkeypatch.setattr(multigrid, "_COARSEST", 60)
    check_modes(name)


@pytest.mark.parametrize("name", BODIES)
def test_deflections_agree_with_those_by_factors(name):
    direct, system = (FreeSystem.of(body(name), way) for way in ("direct", "iterative"))
    forces = np.random.default_rng(1).standard_normal((direct.stiffness.shape[0], 3))
    expected, found = direct.deflection(forces), system.deflection(forces)
    assert "factors" not in system.__dict__
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()


@pytest.mark.parametrize("name", ["tie, coarse to fine", "distributing, clamped"])
def test_single_precision_suffices_for_deflections_of_few_digits(name):
    system = FreeSystem.of(body(name), "iterative")
    solver = system.iterative
    forces = solver.mass_product(np.random.default_rng(2).standard_normal(
        (solver.moving.size, 2)) * solver.moving.reshape(-1, 1))
    motions = solver.unknowns.spread @ system.rigid
    forces -= solver.mass_product(motions) @ (motions.T @ forces) if motions.size else 0.0
    fine, coarse = (solver.deflections(forces, accuracy)[0] for accuracy in (1e-9, 1e-3))
    assert coarse.dtype == np.float32
    energies = [np.einsum("ij,ij->j", one, forces) for one in (fine, coarse)]
    assert energies[1] == pytest.approx(energies[0], rel=1e-4)


def test_where_single_precision_fails_double_precision_serves():
    """Work that is not positive: here by another sign of the stiffness, else by rounding."""
    solver = FreeSystem.of(body("distributing, clamped"), "iterative").iterative
    single = solver.stiffness.single()

    class Turned:
        def product(self, x):
            return -single.product(x)

    solver.__dict__["_single"] = replace(solver, stiffness=Turned())
    forces = solver.mass_product(np.random.default_rng(2).standard_normal(
        (solver.moving.size, 40)) * solver.moving.reshape(-1, 1))
    fine, _ = solver.deflections(forces, 1e-9)
    coarse, converged = solver.deflections(forces, 1e-3)
    assert converged
    energies = [np.einsum("ij,ij->j", one, forces) for one in (fine, coarse)]
    assert energies[1] == pytest.approx(energies[0], rel=1e-4)
    assert not solver._single._conjugate_gradients(forces.astype(np.float32), 1e-3, 100)[1]


def test_a_modal_basis_with_contact_nodes_beside_a_tie():
    """Residual vectors of few rows without factors, as by factors."""
    tied = body("tie, coarse to fine")
    one, other = (modal_basis(tied, 10, contact="one.contact", contact_nodes=4, tolerance=0.2,
                              reduction="residual", eigensolver=way)
                  for way in ("direct", "iterative"))
    assert other.angular_frequencies == pytest.approx(one.angular_frequencies, rel=1e-5)
    assert other.quality.compliance == pytest.approx(one.quality.compliance, rel=1e-7)


@pytest.mark.parametrize("constrained", [False, True])
def test_many_rows_of_bodies_with_masses_at_points(constrained, monkeypatch):
    """Residual vectors are orthogonal in the mass with that of points, and complete the rows."""
    monkeypatch.setattr(residual_vectors, "_LARGE", 0)
    monkeypatch.setattr(residual_vectors, "_FEW", 8)
    # Linear elements away from the rows, wherever they may be, would leave out the mass.
    for name, value in (("_LAYERS", (1,)), ("_WORTH", 1.0), ("_FAR", 10.0)):
        monkeypatch.setattr(iterated_flexibility, name, value)
    mass = PointMass(0, 0.5)
    found = (coupled("kinematic", attachments=[mass]) if constrained else
             ElasticBody(block_mesh((6, 3, 3), (0.2, 0.1, 0.1)), STEEL, attachments=[mass]))
    one, other = (modal_basis(found, 10, contact="contact", contact_nodes=12, tolerance=0.2,
                              reduction="residual", eigensolver=way)
                  for way in ("direct", "iterative"))
    assert other.quality.orthogonality < 1e-9
    assert 1.0 <= other.modes / one.modes < 1.1
    assert other.quality.compliance[2:] == pytest.approx(one.quality.compliance[2:], rel=0.03)


def test_two_tied_halves_that_match_have_the_modes_of_the_whole():
    whole = ElasticBody(block_mesh((6, 3, 3), (0.2, 0.1, 0.1)), STEEL)
    halves = cubes(3, 3)
    assert eigenmodes(halves, 14, "iterative")[0][6:] == pytest.approx(
        eigenmodes(whole, 14, "iterative")[0][6:], rel=1e-9)


def test_motions_that_no_node_shows_take_the_direct_solver():
    """Nodes on a diagonal do not turn with their point about it: the message says so."""
    mesh = block_mesh((3, 2, 2), SIDE)
    x, y, z = mesh.nodes.T
    line = np.flatnonzero((np.abs(x - 0.1) < 1e-9) & (np.abs(y - z) < 1e-9))
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, {"line": line},
                constraints=[Coupling("line", "hub", (0.1, 0.05, 0.05))])
    found = ElasticBody(mesh, STEEL, fixed={"left": "xyz"})
    with pytest.warns(ModelWarning, match="does not know the motions.* direct solver takes over"):
        assert FreeSystem.of(found, "iterative").iterative is None
    assert FreeSystem.of(found, "auto").iterative is None
