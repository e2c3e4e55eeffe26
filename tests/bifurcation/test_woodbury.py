"""Linear systems of bodies with many modes and few contact nodes, beside those of all unknowns."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
)
from fecontact.bifurcation.harmonic import balance
from fecontact.bifurcation.harmonic.starts import problem_for
from fecontact.bifurcation.harmonic.woodbury import (
    BorderedEquations,
    Factors,
    WoodburySolver,
    contact_directions,
)
from fecontact.laws import JenkinsFriction, RoughSurface


def beam():
    """A free steel beam (three rigid modes, singular stiffness) on two nodes of rough ground."""
    body = fc.ElasticBody(rectangle(0.2, 0.01, 12, 1), fc.Material(), 0.01)
    basis = fc.modal_basis(body, 24, contact="bottom", contact_nodes=2, reduction="vibration",
                           B=(0.0, 0.005), C=(0.1, 0.01), damping=0.02)
    return fc.ContactSystem(
        basis, normal=RoughSurface(1e6, 1e-4, 30.0), friction=JenkinsFriction(2e5, 0.3),
        load=fc.Load(100.0), drive=fc.Drive(stiffness_x=1e5, damping_x=30.0, amplitude_x=4e-4,
                                            frequency_hz=500.0 / TURN))


def test_systems_of_few_contact_displacements_are_those_of_all():
    field = contact_field(beam(), ["drive.frequency_hz"])
    problem = problem_for(field, field.values, 0, HarmonicBalance(9, 96),
                          np.ones(field.dimension + 2))
    rng = np.random.default_rng(4)
    u = np.append(1e-5 * rng.normal(size=problem.size), 500.0 / TURN)
    here, row = problem.linearise(u), rng.normal(size=problem.size + 1)
    directions = problem.directions
    assert directions.shape == (24, 4)
    square = np.vstack([here.condensed, row])
    rhs = np.append(here.residual, 1.0)
    found = WoodburySolver.of(square, directions)
    assert isinstance(found, WoodburySolver)
    assert len(found.core[0]) == 19 * 4 + 2
    exact = np.linalg.solve(square, rhs)
    for solution in (found.solve(rhs), here.solve(row, rhs), Factors.of(square).solve(rhs)):
        assert solution == pytest.approx(exact, rel=1e-7, abs=1e-9 * np.abs(exact).max())


def test_a_response_does_not_depend_on_how_it_is_solved_for(monkeypatch):
    options = ContinuationOptions(points=4, largest_step=0.1, step=0.05)

    def response():
        return frequency_response(beam(), (500.0 / TURN, 900.0 / TURN), options=options,
                                  method=HarmonicBalance(9, samples=96, stability=None))

    few = response()
    monkeypatch.setattr(balance, "contact_directions", lambda *given: None)
    whole = response()
    assert few.branches[0].parameter == pytest.approx(whole.branches[0].parameter, rel=1e-9)
    assert few.amplitude() == pytest.approx(whole.amplitude(), rel=1e-8)


def test_many_contact_nodes_or_few_modes_leave_all_unknowns():
    field = contact_field(beam(), ["drive.frequency_hz"])
    assert contact_directions(field, field.values, 9) is not None
    assert contact_directions(field, field.values, 5) is None  # 264 unknowns


def test_factors_serve_other_last_rows_even_if_the_first_one_is_overwritten():
    class Equations(BorderedEquations):
        condensed = np.array([[2.0, -1.0, 0.5], [0.3, 1.5, -0.7]])

    equations, row, rhs = Equations(), np.array([0.2, 0.1, 1.0]), np.array([1.0, -2.0, 0.5])
    for _ in range(2):
        square = np.vstack([equations.condensed, row])
        assert equations.solve(row, rhs) == pytest.approx(np.linalg.solve(square, rhs), rel=1e-13)
        assert equations.determinant_sign(row) == np.sign(np.linalg.det(square))
        row[:] = [-1.0, 0.4, -0.3]
