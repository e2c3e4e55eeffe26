"""Compiled steps of bodies with more modes than are solved for together; loads and parameters."""

from dataclasses import fields, replace

import numpy as np
import pytest
from meshes_for_tests import rectangle
from systems import TURN
from test_plain_contact_forces import duffing_in_y

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
)
from fecontact.bifurcation.continuation.pseudo_arclength import start_of
from fecontact.bifurcation.fields.contact_field import field_between
from fecontact.bifurcation.harmonic.compiled import balance as compiled
from fecontact.bifurcation.harmonic.compiled.arrays import RESTS
from fecontact.bifurcation.harmonic.compiled.balance import CompiledBalance
from fecontact.bifurcation.harmonic.compiled.step_batches import StepBatches
from fecontact.bifurcation.harmonic.problem import CompiledLinearisation, HarmonicProblem
from fecontact.bifurcation.harmonic.starts import problem_for, restored, timing_of
from fecontact.laws import (
    ConstantFriction,
    JenkinsFriction,
    PrescribedForce,
    RoughSurface,
)

BOUNDS = (500.0 / TURN, 1500.0 / TURN)


def block(stiffness=1e6, damping=0.02):
    """A steel block of 12 modes on eight nodes of rough ground; 228 unknowns with 9 harmonics."""
    body = fc.ElasticBody(rectangle(0.2, 0.02, 16, 2), fc.Material(), 0.01)
    basis = fc.modal_basis(body, 12, contact="bottom", contact_nodes=8, reduction="vibration",
                           B=(0.0, 0.01), C=(0.1, 0.02), damping=damping)
    return fc.ContactSystem(
        basis, normal=RoughSurface(stiffness, 1e-4, 300.0),
        friction=ConstantFriction(0.3, smoothing_slope=50.0), load=fc.Load(100.0),
        drive=fc.Drive(
            stiffness_x=1e5, damping_x=30.0, amplitude_x=2e-4, frequency_hz=500.0 / TURN))


@pytest.fixture
def batches(monkeypatch):
    """Numbers of steps that compiled code has made, one for each call."""
    made, plain = [], StepBatches.batch

    def counted(self, *given):
        found = plain(self, *given)
        made.append(0 if found is None else len(found.points))
        return found

    monkeypatch.setattr(StepBatches, "batch", counted)
    return made


def test_steps_of_a_body_are_those_of_plain_code(batches, monkeypatch):
    """Compiled steps give the response of plain code, although they solve for four modes alone."""
    options = ContinuationOptions(points=25, largest_step=0.05)
    fast = frequency_response(block(), BOUNDS, options=options).branches[0]
    assert sum(batches) >= 20
    monkeypatch.setattr(CompiledBalance, "of", lambda problem: None)
    slow = frequency_response(block(), BOUNDS, options=options).branches[0]
    field = contact_field(block(), ["drive.frequency_hz"])
    end = min(fast.parameter[-1], slow.parameter[-1])
    for part in (0.3, 0.9):
        value = BOUNDS[0] + part * (end - BOUNDS[0])
        mine, theirs = fast.at(field, value), slow.at(field, value)
        size = np.abs(theirs.u[:-1]).max()
        assert mine.u[:-1] == pytest.approx(theirs.u[:-1], abs=1e-8 * size)
    for point in fast.points[3::7]:
        problem, u, tangent = restored(field, point)
        here = problem.linearise(u)
        # The residual is small beside the forces of the highest modes.
        stiffness = field.system().arrays.stiffness.diagonal().max()
        assert np.abs(here.residual).max() < 1e-9 * stiffness * np.abs(u[:-1]).max()
        scaled = np.abs(here.condensed * tangent).sum(axis=1)
        # Tangents are those at the prediction of the step.
        assert np.abs(here.condensed @ tangent).max() < 1e-3 * scaled.max()
        stored = problem.point(u, here, tangent)
        for name in ("minimum", "maximum"):
            assert point.values[name] == pytest.approx(stored[name], rel=1e-6, abs=1e-9)
        for name in ("truncation_error", "residual"):
            assert point.values[name] == pytest.approx(stored[name], rel=0.02)
        assert np.abs(point.values["multipliers"]) == pytest.approx(
            np.abs(stored["multipliers"]), abs=1e-7)


def test_the_tangent_of_a_compiled_step_is_that_of_all_equations(batches):
    """Modes are solved for apart; iteration makes good what that neglects."""
    field = contact_field(block(), ["drive.frequency_hz"])
    options = ContinuationOptions(bounds=BOUNDS, step=0.01, largest_step=0.01)
    response = frequency_response(block(), BOUNDS, options=ContinuationOptions(points=1),
                                  method=HarmonicBalance(9, stability=None))
    problem, u, _ = restored(field, response.branches[0].points[0])
    start = start_of(problem, u, options, None, 1.0)
    far = replace(start, u=np.append(start.u[:-1], 1400.0 / TURN))
    found = problem.fast_steps(options).batch(problem, start, 0.01, 6, far)
    assert batches[0] >= 3
    workspace = problem.equations(500.0 / TURN).workspace
    assert 1 <= workspace.coupled[0] < 12
    for at in found.points:
        unit = np.zeros(len(u))
        unit[-1] = 1.0
        weights = problem.weights()
        exact = np.linalg.solve(np.vstack([problem.linearise(at.u).condensed,
                                           weights * at.tangent]), unit)
        exact /= np.sqrt(weights @ exact**2)
        # Tangents are those at the prediction of the step.
        assert np.sqrt(weights @ (exact - at.tangent) ** 2) < 1e-3
    last = found.points[-1].tangent
    assert np.sqrt(weights @ (exact - last) ** 2) < 1e-8


def test_contact_as_stiff_as_the_modes_is_left_to_plain_code(batches):
    """Modes cannot be solved for separately with such a contact."""
    options = ContinuationOptions(points=4, largest_step=0.05)
    method = HarmonicBalance(9, stability=None)
    found = frequency_response(block(1e11), (2e4 / TURN, 3e4 / TURN), method=method,
                               options=options)
    assert len(found.branches[0]) == 4
    assert sum(batches) == 0


def masses(friction):
    """Three masses in a row, two of them on the ground, with a force in two harmonics."""
    rows = np.zeros((2, 3, 3))
    rows[0, 0, 0], rows[1, 0, 2] = 1.0, 1.0
    B = np.zeros((3, 3))
    B[0, 1] = 1.0
    K = np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    basis = fc.basis_from_matrices(np.eye(3), K, {"contact": rows, "B": B, "C": B},
                                   damping=0.04 * K)
    return fc.ContactSystem(
        basis, normal=PrescribedForce((1.0, 0.4)), friction=friction,
        drive=fc.Drive(stiffness_x=1.0, damping_x=0.2, amplitude_x=0.8, frequency_hz=0.9 / TURN,
                       dashpots="relative"))


@pytest.mark.parametrize("name", ["drive.frequency_hz", "drive.amplitude_x",
                                  "drive.stiffness_x", "friction.friction_coefficient"])
@pytest.mark.parametrize("friction", [JenkinsFriction((0.5, 0.3), 0.5),
                                      ConstantFriction(0.3, smoothing_slope=3.0)])
def test_derivatives_are_those_of_the_residual(name, friction):
    """Loads, stiffness and damping are linear in the parameter; laws are differenced."""
    field = contact_field(masses(friction), [name])
    problem = problem_for(field, field.values, 0, HarmonicBalance(3, 48),
                          np.ones(field.dimension + 2))
    u = np.append(np.random.default_rng(2).normal(size=problem.size), field.values[0])
    here = problem.linearise(u)
    assert isinstance(here, CompiledLinearisation)
    steady = problem.equations(float(u[-1])).numbers[4]
    assert steady == (name.startswith("drive"))
    differences = np.empty(here.condensed.shape)
    for k in range(len(u)):
        h = 1e-6 * np.eye(len(u))[k]
        differences[:, k] = (problem.evaluate(u + h).residual
                             - problem.evaluate(u - h).residual) / 2e-6
    assert here.condensed == pytest.approx(differences, abs=1e-6 * np.abs(differences).max())


@pytest.mark.parametrize("friction", [JenkinsFriction((0.5, 0.3), 0.5),
                                      ConstantFriction(0.3, smoothing_slope=3.0)])
@pytest.mark.parametrize("affine", [True, False])
def test_residual_and_forces_are_those_of_plain_code(friction, affine, monkeypatch):
    """With a dashpot between the driven point and its moving end, whose pull grows with p.

    Loads that are not affine in the parameter are taken with the contact forces.
    """
    if not affine:
        monkeypatch.setattr(compiled, "_AFFINE", -1.0)
    field = contact_field(masses(friction), ["drive.frequency_hz"])
    method, scales = HarmonicBalance(4, 64), np.ones(field.dimension + 2)
    fast = problem_for(field, field.values, 0, method, scales)
    u = np.append(np.random.default_rng(3).normal(size=fast.size), 0.7 / TURN)
    one = fast.linearise(u)
    assert fast.equations(0.7 / TURN).body.any() == affine
    monkeypatch.setattr(CompiledBalance, "of", lambda problem: None)
    other = problem_for(field, field.values, 0, method, scales).linearise(u)
    assert isinstance(one, CompiledLinearisation)
    assert one.residual == pytest.approx(other.residual, abs=1e-12)
    assert one.memory == pytest.approx(other.memory, abs=1e-12)
    # The last derivatives are those to the angular frequency.
    unit = np.append(np.ones(fast.size), TURN)
    assert one.condensed / unit == pytest.approx(other.condensed / unit, abs=1e-7)
    for mine, theirs in zip(one._samples(), other._samples(), strict=True):
        assert mine == pytest.approx(theirs, abs=1e-12)


def test_problems_with_equations_of_their_own_are_evaluated_by_these():
    class Other(HarmonicProblem):
        def linearise(self, u):
            return "its own"

    field = contact_field(masses(ConstantFriction(0.3, smoothing_slope=3.0)),
                          ["drive.frequency_hz"])
    plain = problem_for(field, field.values, 0, HarmonicBalance(2), np.ones(field.dimension + 2))
    other = Other(**{entry.name: getattr(plain, entry.name) for entry in fields(plain)})
    u = np.append(np.zeros(plain.size), 0.9 / TURN)
    assert other.evaluate(u) == "its own"
    assert isinstance(plain.evaluate(u), CompiledLinearisation)


@pytest.mark.parametrize(("name", "bounds", "rests"), [
    ("drive.amplitude_y", (0.1, 1.8), True),
    ("drive.frequency_hz", (0.6 / TURN, 1.8 / TURN), True),
    # The value in the midst of the range at which forces are taken is zero.
    ("load.normal", (-0.31, 0.69), False), ("normal.preload", (-0.31, 0.69), False),
    ("load.normal", (-0.3024, 0.6976), False), ("normal.preload", (-0.3024, 0.6976), False)])
def test_bodies_rest_at_zero_only_if_no_value_of_the_parameter_moves_them(name, bounds, rests):
    """A load or preload of 0.6 N moves the mass though one of 0 N does not."""
    system, value = duffing_in_y(), 0.6 / TURN if name.endswith("hz") else 0.6
    field = field_between(system, ((name, bounds),))
    problem = problem_for(field, np.array([value]), 0, HarmonicBalance(3), np.ones(4))
    assert bool(problem.equations(value).numbers[RESTS]) == rests
    first = frequency_response(system, bounds, name, start=value, observe=("B", "y"),
                               options=ContinuationOptions(points=1)).branches[0].points[0]
    mean = float(first.u[0])
    assert (abs(mean) < 1e-9) == rests


@pytest.mark.parametrize(("name", "product", "period"), [
    ("drive.frequency_hz", 1.0, None), ("drive.amplitude_x", None, 2.0 * np.pi / 0.9),
    ("drive.stiffness_x", None, 2.0 * np.pi / 0.9)])
def test_how_the_period_depends_on_a_parameter(name, product, period):
    field = contact_field(masses(ConstantFriction(0.3, smoothing_slope=3.0)), [name])
    found = timing_of(field, 1.1 * field.values, 0)
    for mine, known in zip(found, (product, period), strict=True):
        assert mine == (None if known is None else pytest.approx(known, rel=1e-12))
