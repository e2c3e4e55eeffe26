"""Tori of oscillators with elastic Coulomb elements."""

import numpy as np
import pytest
from bifurcation.torus_fields import error_of_derivatives, first_torus, torus_problem

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    TorusBalance,
    contact_field,
    orbit_branch,
    torus_branch,
    torus_motion,
)
from fecontact.bifurcation.harmonic.layout import layout_of
from fecontact.bifurcation.tori.elements import elements_of
from fecontact.core.errors import InputError
from fecontact.laws import (
    Constant,
    Harmonic,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    LuGreFriction,
    PrescribedForce,
)

FIRST_HZ, SECOND_HZ = 1.0, 0.9 * np.sqrt(2.0)
STIFFNESS = 30.0
MU = "friction.friction_coefficient"
SECOND = "load.forces.1"
JENKINS = JenkinsFriction(STIFFNESS, 0.5)


def oscillator(friction=JENKINS, damping=0.3, one=1.0, other=0.8, *more, first=FIRST_HZ, press=1.0):
    """A mass on a spring and elements, under two tones."""
    basis = fc.basis_from_matrices(
        np.eye(1), [[STIFFNESS]], {"contact": [[[1.0], [0.0]]], "P": [[1.0], [0.0]]},
        damping=[[damping]])
    forces = [fc.PointLoad("P", "x", signal=Harmonic(one, first))]
    forces += [fc.PointLoad("P", "x", signal=Harmonic(other, SECOND_HZ))] if other else []
    return fc.ContactSystem(basis, normal=PrescribedForce(press), friction=friction,
                            load=fc.Load(forces=(*forces, *more)))


def pressed():
    """A mass that rises and falls with the second tone, pressed onto a spring by 2 N."""
    rows = np.eye(2)
    basis = fc.basis_from_matrices(np.eye(2), np.diag([30.0, 100.0]),
                                   {"contact": [rows], "P": rows}, damping=np.diag([0.3, 1.0]))
    return fc.ContactSystem(
        basis, normal=LinearContact(200.0, 1.0, preload=2.0), friction=JENKINS,
        load=fc.Load(forces=(fc.PointLoad("P", "x", signal=Harmonic(1.0, FIRST_HZ)),
                             fc.PointLoad("P", "y", signal=Harmonic(0.8, SECOND_HZ)))))


def in_space():
    """A mass on one element along two tangents, each with a tone of its own."""
    basis = fc.basis_from_matrices(
        np.eye(3), np.diag([30.0, 40.0, 100.0]), {"contact": [np.eye(3)], "P": np.eye(3)},
        dimension=3, damping=np.diag([0.3, 0.3, 1.0]))
    return fc.ContactSystem(
        basis, normal=LinearContact(200.0, 1.0, preload=1.0), friction=JENKINS,
        load=fc.Load(forces=(fc.PointLoad("P", "x", signal=Harmonic(1.0, FIRST_HZ)),
                             fc.PointLoad("P", "y", signal=Harmonic(0.8, SECOND_HZ)),
                             fc.PointLoad("P", "z", signal=Harmonic(0.2, FIRST_HZ)))))


def steady(system, begin=60.0, time=30.0, initial="rest"):
    run = fc.simulate(system, begin + time, initial=initial, rtol=1e-9,
                      outputs=np.append(0.0, np.linspace(begin, begin + time, 3001)))
    return run.between(begin)


def one(system, start, method, second=SECOND):
    return first_torus(contact_field(system, [MU]), start, second=second, method=method)


def misfit(motion, run, states):
    """Largest difference of the first states from a run, in their ranges."""
    x = run.states[:, :states]
    return (np.abs(motion.states(run.time)[:, :states] - x).max(axis=0) / np.ptp(x, axis=0)).max()


@pytest.mark.parametrize("system", [oscillator(), oscillator(IwanFriction(30.0, 0.5, elements=6)),
                                    pressed(), in_space()], ids=["Jenkins", "Iwan", "pressed",
                                                                 "in space"])
def test_samples_and_harmonics_converge_to_a_long_run(system):
    run, n = steady(system), 2 * system.basis.modes
    coarse, fine = (one(system, run, TorusBalance(H, samples))
                    for H, samples in ((3, 16), (7, 60)))
    assert misfit(torus_motion(coarse), run, n) < 0.02
    assert misfit(torus_motion(fine), run, n) < min(
        8e-3, 0.45 * misfit(torus_motion(coarse), run, n))
    for name in ("sampling_error", "truncation_error"):
        assert fine.values[name] < min(0.006, 0.7 * coarse.values[name])
    assert fine.values["stable"]
    # Elements that slide forget.
    assert fine.values["multipliers"].min() < 1e-4
    # Series of deflections overshoot at the corners, but are near elsewhere.
    off = np.abs(torus_motion(fine).states(run.time) - run.states)[:, n:]
    assert np.all(off.mean(axis=0) < 0.15 * np.ptp(run.states[:, n:], axis=0))


def test_an_element_that_never_slides_is_a_spring():
    force = fc.PointLoad("P", "x", signal=Constant(3.0))
    system = oscillator(JENKINS, 0.3, 1.0, 0.8, force, press=100.0)
    run = steady(system, 120.0, initial=[0.05, 0.0, 0.02])
    point = one(system, run, TorusBalance(2))
    motion = torus_motion(point)
    for k, f, size in (((1, 0), FIRST_HZ, 1.0), ((0, 1), SECOND_HZ, 0.8)):
        w = 2.0 * np.pi * f
        exact = size / abs(2.0 * STIFFNESS - w * w + 0.3j * w)
        assert abs(motion.harmonic(*k)[0]) == pytest.approx(exact, rel=1e-9)
    # It keeps what it was ahead of the mass: 30 x + 30 (x - 0.03) = 3.
    assert motion.harmonic(0, 0)[[0, 2]].real == pytest.approx([0.065, 0.035], abs=1e-6)
    finer = torus_motion(one(system, point, TorusBalance(3)))
    assert finer.harmonic(0, 0) == pytest.approx(motion.harmonic(0, 0), abs=1e-6)
    assert misfit(motion, run, 3) < 1e-5
    decay = np.exp(-0.15 / FIRST_HZ)
    assert point.values["multipliers"] == pytest.approx([1.0, decay, decay], rel=1e-5)


def test_on_a_circle_the_force_lags_behind_the_velocity():
    """An element that slides on a circle of radius R has sin(psi) = limit / R, in steady motion."""
    field = contact_field(in_space(), [MU])
    elements = elements_of(field, layout_of(field))
    radius, f = 0.03, 1.3
    X = np.zeros((9, 3))
    X[1, 0] = X[2, 1] = radius
    limit = elements.friction(1e3 * X, (1, 1), (f, 0.7 * f), np.arange(8) / 8, 3,
                              field.values).deflections
    limit = np.linalg.norm(limit[0, 0])
    assert limit < radius
    errors = []
    for P in (40, 80):
        tau = np.arange(P) / P
        found = elements.friction(X, (1, 1), (f, 0.7 * f), tau, 3, field.values)
        along = np.stack([-np.sin(2.0 * np.pi * tau), np.cos(2.0 * np.pi * tau)], axis=1)
        z = found.deflections
        assert np.linalg.norm(z, axis=2) == pytest.approx(np.full(z.shape[:2], limit), rel=1e-12)
        angle = np.arccos((z * along).sum(axis=2) / limit)
        errors.append(np.abs(angle - np.arcsin(limit / radius)).max())
        assert found.forces[:, :, 0] == pytest.approx(STIFFNESS * z)
    assert errors[1] < min(2e-3, 0.3 * errors[0])


def test_a_second_tone_of_nothing_leaves_the_orbit():
    system = oscillator(other=1e-9)
    point = one(system, steady(system), TorusBalance((9, 1), (200, 9)))
    orbit = orbit_branch(
        contact_field(oscillator(other=0.0), [MU]), steady(oscillator(other=0.0)),
        method=HarmonicBalance(harmonics=9), options=ContinuationOptions(points=1)).points[0]
    exact = orbit.orbit(None, 1001)
    assert torus_motion(point).states(exact.times)[:, :2] == pytest.approx(
        exact.states[:, :2], abs=2e-4 * np.abs(exact.states[:, 1]).max())


def driven_flutter():
    """Negative damping lets the mass vibrate by itself as far as the element lets it."""
    return oscillator(JENKINS, -0.2, 0.3, 0.0, first=0.45)


@pytest.mark.parametrize("system", [oscillator(), pressed(), in_space(), driven_flutter()],
                         ids=["plane", "pressed", "in space", "driven flutter"])
def test_derivatives_are_those_of_differences(system):
    second = SECOND if len(system.load.forces) > 1 else None
    problem, u = torus_problem(contact_field(system, [MU]), steady(system, 150.0, 60.0),
                               second=second, method=TorusBalance(2))
    rng = np.random.default_rng(3)
    size = np.abs(u[: problem.size]).max()
    # Beside the torus, where no motion is exactly zero.
    u[: problem.size] += 0.02 * size * rng.standard_normal(problem.size)
    assert error_of_derivatives(problem, u, 1e-7) < 1e-6


def test_self_excited_vibration_under_a_drive_finds_its_frequency():
    system = driven_flutter()
    run = steady(system, 200.0, 60.0)
    point = one(system, run, TorusBalance(6, 50), second=None)
    motion = torus_motion(point)
    t, window = run.time - run.time[0], np.hanning(len(run.time))
    for k in ((1, 0), (0, 1), (2, -1)):
        f = k[0] * motion.frequencies[0] + k[1] * motion.frequencies[1]
        turning = window * run.states[:, 0] * np.exp(-2j * np.pi * f * t)
        assert 2.0 * abs(turning.sum()) / window.sum() == pytest.approx(
            abs(motion.harmonic(*k)[0]), rel=0.02)
    # The phase of the vibration does not drift against the frequency found.
    turning = run.states[:, 0] * np.exp(-2j * np.pi * motion.frequencies[1] * t)
    half = np.hanning(1500)
    drift = np.angle((half * turning[-1500:]).sum() / (half * turning[:1500]).sum())
    assert abs(drift) / (2.0 * np.pi * 30.0) < 1e-3 * motion.frequencies[1]
    stuck = np.sqrt(2.0 * STIFFNESS) / (2.0 * np.pi)
    free = np.sqrt(STIFFNESS) / (2.0 * np.pi)
    assert free < point.values["frequency_2"] < stuck
    assert point.values["trivial_error"] < 0.05
    assert point.values["stable"]


@pytest.mark.slow
def test_followed_saved_and_gone_on_with(tmp_path):
    system = oscillator()
    branch = torus_branch(contact_field(system, [MU]), steady(system), second=SECOND,
                          method=TorusBalance(5, 40), bounds=(0.5, 0.56))
    last = branch.points[-1]
    assert last.parameter == pytest.approx(0.56)
    moved = system.with_({MU: 0.56})
    assert misfit(torus_motion(last), steady(moved), 2) < 5e-3
    fc.io.write_branch(tmp_path / "tori.h5", branch)
    again = fc.io.read_branch(tmp_path / "tori.h5")
    assert np.array_equal(torus_motion(again.points[-1]).coefficients,
                          torus_motion(last).coefficients)
    back = torus_branch(contact_field(moved, [MU]), again.points[-1], second=SECOND,
                        direction=-1.0, bounds=(0.5, 0.56))
    first = torus_motion(branch.points[0]).harmonic(1, 0)[0]
    assert torus_motion(back.points[-1]).harmonic(1, 0)[0] == pytest.approx(first, rel=1e-5)


def test_elements_beside_bristles_are_refused():
    row = np.array([[1.0, 0.0], [0.0, 0.0]])
    basis = fc.basis_from_matrices(np.eye(2), 30.0 * np.eye(2), {
        "contact": {"one": [row], "other": [row[:, ::-1]]}, "P": row})
    lugre = LuGreFriction(0.4, 0.4, 1e-2, 1.0, bristle_stiffness=30.0, bristle_damping=0.1)
    system = fc.ContactSystem(
        basis, normal=PrescribedForce(1.0), friction={"one": JENKINS, "other": lugre},
        load=fc.Load(forces=(fc.PointLoad("P", "x", signal=Harmonic(1.0, FIRST_HZ)),
                             fc.PointLoad("P", "x", signal=Harmonic(0.8, SECOND_HZ)))))
    with pytest.raises(InputError, match="beside other internal variables"):
        torus_branch(contact_field(system, ["load.forces.0.signal.amplitude"]),
                     fc.simulate(system, 5.0), second=SECOND)
