"""Elastic Coulomb elements that harmonic balance follows exactly, against densely sampled ones."""

import numpy as np
import pytest
from oscillators import jenkins, one_mode
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, contact_field
from fecontact.bifurcation.harmonic.compiled.balance import CompiledBalance
from fecontact.bifurcation.harmonic.elements import (
    Displacements,
    ElementForces,
    follow_elements,
)
from fecontact.bifurcation.harmonic.series import basis_at, differentiated, series
from fecontact.bifurcation.harmonic.starts import converged_orbit, problem_for
from fecontact.laws import (
    DahlFriction,
    Frictionless,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    PrescribedForce,
)

T, H = 5.0, 3
CONSTANT, PRESSED = PrescribedForce(1.0), LinearContact(3.0, 0.4, preload=2.5)
CASES = {
    "one": (CONSTANT, JenkinsFriction(0.5, 0.5), {}),
    "several": (CONSTANT, IwanFriction(2.0, 0.8, elements=5), {}),
    "normal force": (PRESSED, IwanFriction(2.0, 0.6, elements=3), {}),
    "ground": (PRESSED, IwanFriction(2.0, 0.8, elements=3), {"ground": fc.Ground(speed=0.03)}),
}


def plane(case):
    """A mass with a node that moves along its tangent and its normal."""
    normal, friction, parts = CASES[case]
    rows = np.eye(3, 2)
    basis = fc.basis_from_matrices(np.eye(2), np.diag([0.3, 4.0]), {
        "contact": rows[None], "B": rows, "C": rows}, damping=0.1 * np.eye(2))
    return fc.ContactSystem(basis, normal=normal, friction=friction, drive=fc.Drive(
        stiffness_x=1.0, stiffness_y=1.0, damping_x=0.05, amplitude_x=1.2, amplitude_y=0.3,
        frequency_hz=1.3 / TURN), **parts)


ONE = JenkinsFriction(0.5, 0.5)


def in_space(friction=ONE, normal=CONSTANT, **parts):
    """A mass with a node that moves along both tangents and its normal, driven along all three."""
    rows = np.eye(6, 3)
    basis = fc.basis_from_matrices(
        np.eye(3), np.array([[0.3, 0.1, 0.0], [0.1, 0.2, 0.1], [0.0, 0.1, 4.0]]),
        {"contact": rows[None], "B": rows, "C": rows}, dimension=3, damping=0.1 * np.eye(3))
    return fc.ContactSystem(basis, normal=normal, friction=friction, drive=fc.Drive(
        stiffness_x=1.0, stiffness_y=0.8, stiffness_z=1.0, damping_x=0.05, damping_y=0.6,
        amplitude_x=1.2, amplitude_y=1.5, amplitude_z=0.5, frequency_hz=1.3 / TURN), **parts)


IN_SPACE = {
    "one": (in_space, "drive.frequency_hz"),
    "several": (lambda: in_space(IwanFriction(0.5, 0.5, elements=3)), "friction.stiffness"),
    "normal force": (lambda: in_space(normal=LinearContact(3.0, 0.4, preload=1.5)),
                     "drive.frequency_hz"),
    "open at times": (lambda: in_space(normal=LinearContact(3.0, 0.4), gap=0.1),
                      "drive.amplitude_z"),
    "ground": (lambda: in_space(ground=fc.Ground(speed=0.03)), "ground.speed"),
}


def coefficients(seed=0):
    """Motions that slide to and fro, along the normal too."""
    size = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0])
    return np.random.default_rng(seed).normal(size=(7, 2)) * [0.8, 0.1] / size[:, None]


def followed(system, X, samples, offsets=None):
    """Friction (N,), deflections (N, c) and derivatives (N, 2 L) by the code under test."""
    count = system.friction.memory
    found = ElementForces(np.zeros((1, samples)), np.zeros((samples, count)),
                          np.zeros((1, samples, 2 * len(X))))
    assert follow_elements(Displacements(X, T, series(H, samples).values), system.arrays,
                           np.array([count]), np.zeros(count) if offsets is None else offsets,
                           True, found)
    return found.friction[0], found.deflections, found.rows[0]


def densely(system, X, samples=20_000, start=0.0, periods=2):
    """Friction over the last of some periods, deflections moved and cut off at each sample."""
    tau = np.arange(periods * samples) / samples
    q, v = basis_at(tau, H) @ X, basis_at(tau, H) @ differentiated(X) / T
    law = system.normal
    force = np.full(len(tau), 1.0) if law is CONSTANT else np.maximum(
        2.5 - 3.0 * q[:, 1] - 0.4 * v[:, 1], 0.0)
    slip = q[:, 0] - system.ground.speed * tau * T
    p = system.arrays.friction_parameters[0]
    count = len(p) // 2
    springs, shares = p[1 : 1 + count], p[1 + count :]
    z, found = np.full(count, start), np.empty(len(tau))
    for k, way in enumerate(np.diff(slip, prepend=slip[0])):
        z = np.clip(z + way, -shares * force[k] / springs, shares * force[k] / springs)
        found[k] = springs @ z
    return found[-samples:]


@pytest.mark.parametrize("case", CASES)
def test_harmonics_of_friction_are_of_fourth_order_in_the_distance_of_samples(case):
    system, X = plane(case), coefficients()
    exact = densely(system, X, start=float(X[0, 0] + X[1::2, 0].sum()),
                    periods=10 if case == "ground" else 2)
    exact = series(H, len(exact)).projection @ exact
    off = [np.abs(series(H, N).projection @ followed(system, X, N)[0] - exact).max()
           for N in (16, 32, 64)]
    assert off[0] < 4e-3
    assert off[2] < max(off[0] / 60.0, 3e-5)


@pytest.mark.parametrize("samples", [17, 40])
@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_differences(case, samples):
    system = plane(case)
    for seed in range(4):
        X, h = coefficients(seed), 1e-6
        rows = followed(system, X, samples)[2]
        for axis in range(2):
            for k in range(len(X)):
                move = np.zeros_like(X)
                move[k, axis] = h
                sides = [followed(system, X + sign * move, samples)[0] for sign in (1.0, -1.0)]
                assert rows[:, axis * len(X) + k] == pytest.approx(
                    (sides[0] - sides[1]) / (2.0 * h), abs=1e-7 * np.abs(rows).max())


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("name", ["drive.frequency_hz", "friction.stiffness",
                                  "friction.friction_coefficient", "ground.speed"])
@pytest.mark.parametrize("case", ["normal force", "ground"])
def test_derivatives_of_the_equations_are_differences(case, name, compiled, monkeypatch):
    if not compiled:
        monkeypatch.setattr(CompiledBalance, "of", lambda problem: None)
    field = contact_field(plane(case), [name])
    problem = problem_for(field, field.values, 0, HarmonicBalance(H, 24),
                          np.ones(field.dimension + 2))
    u = np.append(coefficients().reshape(-1), field.values[0])
    here, h = problem.linearise(u).condensed, 1e-6
    differences = np.stack([
        (problem.linearise(u + move).residual - problem.linearise(u - move).residual) / (2.0 * h)
        for move in h * np.eye(len(u))], axis=1)
    assert here == pytest.approx(differences, abs=3e-6 * np.abs(differences).max())


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("case", IN_SPACE)
def test_derivatives_in_two_directions_are_differences(case, compiled, monkeypatch):
    if not compiled:
        monkeypatch.setattr(CompiledBalance, "of", lambda problem: None)
    make, name = IN_SPACE[case]
    field = contact_field(make(), [name])
    problem, u = start(field, 2, 24)
    u[:-1] = 0.8 * np.random.default_rng(5).normal(size=problem.size)
    here = problem.linearise(u)
    assert here.memory.any()
    differences = np.stack([
        (problem.linearise(u + h).residual - problem.linearise(u - h).residual) / 2e-6
        for h in 1e-6 * np.eye(len(u))], axis=1)
    assert here.condensed == pytest.approx(differences, abs=2e-6 * np.abs(differences).max())


@pytest.mark.parametrize("dimension", [2, 3])
def test_work_grows_with_the_number_of_elements_alone(dimension):
    """No array of compiled code has the square of their number."""
    system = (plane("several") if dimension == 2 else in_space()).with_(
        friction=IwanFriction(2.0, 0.8, elements=40))
    problem, u = start(contact_field(system, ["drive.frequency_hz"]), 2, 32)
    workspace = problem.equations(float(u[-1])).workspace
    assert workspace.J.shape == (32, 2 * dimension, 2 * dimension)
    assert workspace.z.shape == (32, 40 * (dimension - 1))
    assert workspace.by_node.shape == (dimension - 1, 32, 5 * dimension)


def test_derivatives_to_an_unknown_period():
    """On a belt, whose motion has no period of its own."""
    field = contact_field(plane("ground").with_(drive=fc.Drive()), ["ground.speed"])
    problem = problem_for(field, field.values, 0, HarmonicBalance(2, 24),
                          np.ones(field.dimension + 2))
    assert problem.autonomous
    u = np.concatenate([coefficients()[:5].reshape(-1), [T, 0.03]])
    differences = np.stack([
        (problem.linearise(u + h).residual - problem.linearise(u - h).residual) / 2e-6
        for h in 1e-6 * np.eye(len(u))], axis=1)
    assert problem.linearise(u).condensed == pytest.approx(
        differences, abs=3e-6 * np.abs(differences).max())


def test_an_element_gives_up_no_more_of_its_deflection_than_it_must():
    """Kept 0.5 under a motion of amplitude 0.8 and the limit 1: it moves from -0.6 to 1."""
    system = plane("one")
    X = np.zeros((7, 2))
    X[2, 0] = 0.8
    one = system.with_(friction=JenkinsFriction(0.5, 0.5))
    for kept, wanted in ((0.1, 0.1), (0.5, 0.2), (-3.0, -0.2)):
        z = followed(one, X, 32, np.array([kept]))[1][:, 0]
        assert z == pytest.approx(wanted + 0.8 * np.sin(TURN * np.arange(32) / 32), abs=1e-5)


def test_a_travelling_other_side_holds_elements_at_their_limit():
    """One that travels by a thousandth of the limit in a period, until it drags the mass."""
    system = fc.ContactSystem(
        one_mode(), normal=PrescribedForce(1.0), friction=JenkinsFriction(0.5, 1.0),
        ground=fc.Ground(speed=2e-3 / TURN),
        drive=fc.Drive(stiffness_x=1.0, damping_x=0.02, amplitude_x=0.01, frequency_hz=1.0 / TURN))
    field = contact_field(system, ["drive.frequency_hz"])
    problem, u = converged_orbit(*start(field, 3, 64))
    assert problem.coefficients(u)[0, 0] == pytest.approx(1.0, abs=0.02)
    assert problem.linearise(u).memory.max() == pytest.approx(-2.0, abs=0.05)


def start(field, harmonics, samples):
    """A problem and its unknowns at rest."""
    problem = problem_for(field, field.values, 0, HarmonicBalance(harmonics, samples),
                          np.ones(field.dimension + 2))
    return problem, np.append(np.zeros(problem.size), field.values[0])


def test_nodes_without_elements_have_no_deflection():
    """A node beside one with two elements; earlier contents of the workspace do not matter."""
    rows = np.zeros((2, 3, 2))
    rows[0, 0, 0] = rows[1, 0, 1] = 1.0
    basis = fc.basis_from_matrices(np.eye(2), np.diag([1.0, 2.0]), {
        "contact": {"one": rows[:1], "other": rows[1:]}, "B": rows[0], "C": rows[0]})
    system = fc.ContactSystem(
        basis, normal=CONSTANT, drive=fc.Drive(stiffness_x=1.0, amplitude_x=2.0,
                                               frequency_hz=0.9 / TURN),
        friction={"one": IwanFriction(0.5, 0.5, elements=2), "other": Frictionless()})
    problem, u = start(contact_field(system, ["drive.frequency_hz"]), 2, 32)
    problem.equations(float(u[-1])).workspace.z[:] = np.nan
    z = problem.linearise(u).memory
    assert z.shape == (32, 4)
    assert np.isfinite(z).all()
    assert not z[:, 2:].any()


def test_nodes_with_elements_stand_beside_nodes_with_bristles():
    """Both are marched then; against a run in time."""
    rows = np.zeros((2, 3, 2))
    rows[0, 0, 0] = rows[1, 0, 1] = 1.0
    basis = fc.basis_from_matrices(np.eye(2), [[1.5, -0.5], [-0.5, 1.5]], {
        "contact": {"one": rows[:1], "other": rows[1:]}, "B": rows[0], "C": rows[0]})
    system = fc.ContactSystem(
        basis, normal=CONSTANT,
        friction={"one": DahlFriction(0.5, 1.0), "other": JenkinsFriction(0.5, 0.3)},
        drive=fc.Drive(stiffness_x=1.0, damping_x=0.1, amplitude_x=2.0, frequency_hz=0.9 / TURN))
    problem, u = converged_orbit(*start(contact_field(system, ["drive.frequency_hz"]), 9, 512))
    period = TURN / 0.9
    settled = fc.simulate(system, 60.0 * period, rtol=1e-9, outputs=np.array([0.0, 60.0 * period]))
    run = fc.simulate(system, period, initial=settled.states[-1], rtol=1e-9, outputs=513)
    x = problem.linearise(u).states
    assert x[:, :2] == pytest.approx(run.states[:-1, :2], abs=4e-3)
    assert x[:, 4:] == pytest.approx(run.states[:-1, 4:], abs=2e-2)
    assert np.ptp(x[:, 4:], axis=0).min() > 0.5


def test_multipliers_by_hills_matrix_know_the_elements():
    """Multipliers by Hill's matrix, one a state, agree with those of transitions."""
    problem, u = converged_orbit(*start(jenkins(0.5), 3, 128))
    found = problem.linearise(u)
    by_hill = np.linalg.eigvals(found.by_states.mean(axis=0) * TURN / 0.5)
    assert len(by_hill) == 3
    assert np.sort(np.abs(np.exp(by_hill)))[-1] == pytest.approx(1.0, abs=1e-9)
    assert found.floquet.stable
