"""Nonlinear modes against elliptic integrals, describing functions, and motions that decay."""

from dataclasses import replace

import numpy as np
import pytest
from oscillators import jenkins_system, one_mode
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import ellipk
from systems import TURN, two_mass_field, two_mass_system

import fecontact as fc
from fecontact import io, plot
from fecontact.bifurcation import (
    Branch,
    BranchStatus,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    contact_field,
    equilibrium_branch,
    nonlinear_mode,
    orbit_branch,
)
from fecontact.bifurcation.harmonic.stalled import stall_reason
from fecontact.bifurcation.nonlinear_modes.linear_start import (
    XI,
    unforced,
    with_mass_damping,
)
from fecontact.bifurcation.nonlinear_modes.mode_problem import energy_at
from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import returned_noted
from fecontact.cli.mode_results import mode_csv
from fecontact.core.errors import AnalysisError, InputError
from fecontact.laws import (
    FourParameterIwanFriction,
    Frictionless,
    Harmonic,
    JenkinsFriction,
    LinearContact,
    PrescribedForce,
)
from fecontact.reduction import PolynomialSpring, point_masses
from fecontact.system.forcing_period import common_period

UP = (0.0, 1.0)


def forcing_free(system):
    """Whether nothing excites a system."""
    return common_period(system) is None


def masses(first=0.0, second=0.0, between=0.0, damping=0.0, **parts):
    """Two masses of 1 kg; springs of 1 N/m to the base and between them, with cubic terms."""
    return fc.ContactSystem(
        bodies={"a": point_masses({"p": 1.0}), "b": point_masses({"p": 1.0})},
        links={"a": PolynomialSpring("a.p", None, 1.0, first, damping, UP),
               "b": PolynomialSpring("b.p", None, 1.0, second, damping, UP),
               "ab": PolynomialSpring("a.p", "b.p", 1.0, between, damping, UP)}, **parts)


def duffing_frequency(linear, cubic, amplitude):
    """Angular frequency of x'' + linear x + cubic x^3 = 0."""
    hard = linear + cubic * amplitude**2
    return np.pi / 2.0 * np.sqrt(hard) / ellipk(cubic * amplitude**2 / (2.0 * hard))


def elements(X, springs, limits):
    """Parts of the force of Jenkins elements with x = X cos t: in phase, and -1 times the sine."""
    elastic, lost = np.zeros(len(X)), np.zeros(len(X))
    for k, limit in zip(springs, limits, strict=True):
        part = np.minimum(limit / (k * X), 1.0)
        angle = np.arccos(1.0 - 2.0 * part)
        elastic += k * X / np.pi * (angle - 0.5 * np.sin(2.0 * angle))
        lost += 4.0 * limit / np.pi * (1.0 - part)
    return elastic, lost


@pytest.mark.parametrize(("number", "linear", "cubic"), [(1, 1.0, 0.0), (2, 3.0, 4.0)])
def test_modes_of_two_equal_masses_have_the_frequencies_of_elliptic_integrals(
        number, linear, cubic):
    """In phase the spring between them is at rest; against each other it has eight times the
    cubic term."""
    errors = []
    for H in (3, 7, 11, 15):
        mode = nonlinear_mode(masses(between=0.5), (1e-3, 2.0), number, observe=("a.p", "y"),
                              method=HarmonicBalance(H))
        A = mode.amplitude
        assert A[[0, -1]] == pytest.approx([1e-3, 2.0], rel=1e-6)
        errors.append(np.abs(mode.angular_frequency
                             / duffing_frequency(linear, cubic, A) - 1.0).max())
        assert mode.conservative
        assert np.abs(mode.xi).max() < 1e-12
    if cubic == 0.0:
        assert max(errors) < 1e-12
    else:
        assert errors[0] < 2e-3
        assert errors[1] < 1e-2 * errors[0]
        assert errors[-1] < 1e-8
    # Kinetic and potential energy of both masses.
    energy = 2.0 * (0.5 * linear * A**2 + 0.25 * cubic * A**4)
    assert mode.energy == pytest.approx(energy, rel=3e-7)
    shape = mode.coordinates()
    assert shape[:, 1] == pytest.approx((1.0 if number == 1 else -1.0) * shape[:, 0], abs=1e-9)
    assert np.abs(mode.harmonic(3)[-1]) > (0.02 if cubic else -1.0)


@pytest.fixture(scope="module")
def resonant():
    """Two masses, the first with a hardening spring: their first mode up to large amplitudes."""
    system = masses(first=0.5)
    return system, nonlinear_mode(
        system, (1e-2, 200.0), observe=("b.p", "y"), method=HarmonicBalance(25),
        options=ContinuationOptions(points=2000, step=0.02, largest_step=0.06))


def third_of_first(mode):
    """Third harmonic of the first mass over its first harmonic."""
    return np.abs(mode.coordinates(3)[:, 0] / mode.coordinates(1)[:, 0])


def test_mode_goes_through_its_internal_resonance(resonant):
    """The second mode meets a third of its period: the motion turns into it and back."""
    _, mode = resonant
    assert mode.branch.status is BranchStatus.BOUND
    third = third_of_first(mode)
    inside = third > 1.0
    # One tongue: frequency nearly constant, and the first harmonic passes zero at its end.
    assert third.max() > 50.0
    assert np.ptp(mode.frequency_hz[inside]) < 0.02 * mode.frequency_hz[inside].mean()
    edges = np.flatnonzero(np.diff(inside.astype(int)))
    assert len(edges) == 2
    assert third[0] < 1e-4
    assert third[-1] < 0.1
    # Nothing is left out: where the frequency changes, the motion does so from point to point by a
    # small part of its size only.
    X = np.concatenate([mode.coordinates(k) for k in range(26)], axis=1)
    change = np.linalg.norm(np.diff(X, axis=0), axis=1)
    size = np.maximum.accumulate(np.linalg.norm(X[1:], axis=1))
    frequency = mode.frequency_hz
    rests = np.abs(np.diff(frequency)) < 1e-4 * frequency[1:]
    # There it takes longer steps.
    assert (change > 0.15 * size)[rests].any()
    assert (change < np.where(rests & ~inside[1:], 0.5, 0.15) * size).all()
    # In the limit the second mass vibrates on two springs.
    assert mode.frequency_hz[-1] * 2.0 * np.pi == pytest.approx(np.sqrt(2.0), rel=0.01)
    assert mode.conservative
    assert mode.stable[0]
    assert not mode.stable[-1]
    assert any(point.kind == "branch point" for point in mode.branch.special)


def test_a_file_of_points_takes_each_column_once(resonant, monkeypatch):
    """Otherwise its time grows with the square of the number of points."""
    _, mode = resonant
    taken = []
    column = Branch.column
    monkeypatch.setattr(Branch, "column", lambda branch, name: (
        taken.append(name), column(branch, name))[1])
    lines = mode_csv(mode).splitlines()
    assert len(lines) == len(mode) + 1
    assert len(taken) < 20 < len(mode)


def test_energies_at_the_ends_of_the_resonance(resonant):
    """Largest and smallest energies along the mode, by a cosine series with harmonics up to 41.

    The tongue ends at log10(E) = 3.6703 and returns at 2.4551; 3.3233 and 3.2520 are a second turn.
    """
    _, mode = resonant
    energy = np.log10(mode.energy)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(energy)))) + 1
    X = np.concatenate([mode.coordinates(k) for k in range(26)], axis=1)
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(X, axis=0), axis=1)))
    found = []
    for turn in turns[:4]:
        # Points of the mode lie beside the turns: a polynomial through the five next ones.
        near = slice(turn - 2, turn + 3)
        fit = np.polynomial.Polynomial.fit(way[near], energy[near], 4)
        places = np.array([root.real for root in fit.deriv().roots() if abs(root.imag) < 1e-12])
        found.append(fit(places[np.argmin(np.abs(places - way[turn]))]))
    assert found == pytest.approx([3.6703, 2.4551, 3.3233, 3.2520], abs=2e-3)


def test_a_stalled_mode_of_springs_blames_no_contact(resonant):
    """Springs push in one half of the period and pull in the other: no contact opens."""
    system, mode = resonant
    field = contact_field(unforced(system), {XI: (0.0, with_mass_damping)})
    stalled = replace(mode.branch, status=BranchStatus.STALLED)
    assert stall_reason(field, stalled) == ""


def test_a_mode_that_came_back_to_its_start_says_so(resonant):
    _, mode = resonant
    assert returned_noted(mode) is mode
    back = replace(mode.branch, points=(*mode.branch.points, *mode.branch.points[::-1]))
    assert returned_noted(replace(mode, branch=back)).branch.message.startswith(
        f"The mode turned back at the amplitude {mode.amplitude.max():.4g} and")


def test_modes_without_stability_are_those_with_it():
    """Multipliers of a mode without losses are left out too where none are asked for."""
    plain = HarmonicBalance(5, stability=None)
    found = [nonlinear_mode(masses(first=0.5), (1e-2, 2.0), observe=("b.p", "y"), method=method)
             for method in (HarmonicBalance(5), plain)]
    assert np.array_equal(found[0].frequency_hz, found[1].frequency_hz)
    assert found[0].stable is not None
    assert found[1].stable is None
    assert found[1].conservative
    assert not any({"multipliers", "stable", "trivial_error"} & set(point.values)
                   for point in found[1].branch.points)


@pytest.mark.parametrize("part", [0.3, 1.0])
def test_motions_in_the_resonance_are_those_of_a_run(resonant, part):
    system, mode = resonant
    third = third_of_first(mode)
    index = int(np.argmin(np.abs(third - part)))
    orbit = mode.orbit(index)
    run = fc.simulate(system, orbit.period or orbit.times[-1], initial=orbit.states[0],
                      rtol=1e-10, outputs=1000)
    size = np.abs(orbit.states).max(axis=0)
    assert np.abs(run.states - orbit.states).max() < 2e-4 * size.max()


def test_viscous_damping_is_the_xi_of_the_mode():
    """The damping c M x' is met by xi = c at every amplitude, in every mode."""
    for number in (1, 2):
        system = masses(first=0.5)
        system = system.with_(basis=replace(system.basis, damping=0.06 * np.eye(2)))
        mode = nonlinear_mode(system, (1e-2, 3.0), number, observe=("a.p", "y"))
        assert mode.xi == pytest.approx(0.06, abs=1e-13)
        assert mode.damping_ratio == pytest.approx(0.03 / mode.angular_frequency, rel=1e-12)
        assert not mode.conservative
        assert mode.energy is None
        assert mode.stable is None
        assert np.ptp(mode.frequency_hz) > 0.1 * mode.frequency_hz[0]
        free = nonlinear_mode(masses(first=0.5), (1e-2, 3.0), number, observe=("a.p", "y"))
        assert mode.frequency_hz[-1] == pytest.approx(free.frequency_hz[-1], rel=1e-6)
        # The loss in a period is that of the dashpots.
        motion = mode.orbit(len(mode) - 1, 401)
        power = 0.06 * (motion.states[:, 2:] ** 2).sum(axis=1)
        assert mode.loss[-1] == pytest.approx(np.trapezoid(power, motion.times), rel=1e-10)


def test_linear_mode_of_damping_that_couples_the_modes():
    """At small amplitudes: -w^2 x + i w (C - xi) x + K x = 0 with complex shapes."""
    system = masses()
    C = np.array([[0.3, -0.02], [-0.02, 0.01]])
    system = system.with_(basis=replace(system.basis, damping=C))
    mode = nonlinear_mode(system, (1e-3, 2e-3), 2, observe=("a.p", "y"))
    w, xi, x = mode.angular_frequency[0], mode.xi[0], mode.coordinates()[0]
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    off = (K - w**2 * np.eye(2) + 1j * w * (C - xi * np.eye(2))) @ x
    assert np.abs(off).max() < 1e-9 * np.abs(x).max()
    assert np.abs(x.imag).max() > 1e-2 * np.abs(x).max()
    assert xi == pytest.approx(0.175, abs=0.01)


def test_static_loads_stay_and_loads_in_time_go():
    """A hardening spring is stiffer where a weight holds it: k + 3 c x^2."""
    forces = (fc.PointLoad("a.p", "y", signal=fc.laws.Constant(3.0)),
              fc.PointLoad("a.p", "y", signal=Harmonic(5.0, 0.7 / TURN)))
    system = fc.ContactSystem(
        bodies={"a": point_masses({"p": 1.0})},
        links={"a": PolynomialSpring("a.p", None, 1.0, 0.5, direction=UP)},
        load=fc.Load(forces=forces))
    mode = nonlinear_mode(system, (1e-4, 1.0), observe=("a.p", "y"))
    x = np.roots([0.5, 0.0, 1.0, -3.0])
    x = float(x[np.abs(x.imag) < 1e-9].real[0])
    assert mode.coordinates(0)[0].real == pytest.approx(x, rel=1e-6)
    assert mode.angular_frequency[0] == pytest.approx(np.sqrt(1.0 + 1.5 * x * x), rel=1e-6)
    # The mean moves with the amplitude, and even harmonics appear.
    assert abs(mode.coordinates(0)[-1].real - x) > 0.05
    assert np.abs(mode.harmonic(2)[-1]) > 0.02


def pushed_jenkins(force):
    """A constant force on the mass of ``jenkins_system``, without other damping."""
    return jenkins_system().with_(
        **{"drive.damping_x": 0.0, "drive.amplitude_x": 0.0},
        load=fc.Load(forces=(fc.PointLoad("B", "x", signal=fc.laws.Constant(force)),)))


@pytest.mark.parametrize(("force", "preload", "mean"), [
    (0.8, None, 0.8), (0.8, (0.8 / 1.5, 0.0, 0.8 / 1.5), 0.8 / 1.5), (2.0, (1.0, 0.0, 2.0), 1.0)])
def test_mode_about_the_static_deflection(force, preload, mean):
    """Without preload the spring alone carries the force, with it the element as much as it may."""
    system = pushed_jenkins(force)
    mode = nonlinear_mode(system, (1e-3, 5.0), method=HarmonicBalance(9, 512),
                          preload=None if preload is None else np.array(preload))
    middle = mode.coordinates(0).real[:, 0]
    assert middle[0] == pytest.approx(mean, abs=6e-4)
    # An element at its limit gives back half the range of the motion: k_d X / (k + k_d).
    if force == 2.0:
        small = mode.amplitude < 0.5
        assert middle[small] == pytest.approx(1.0 + 0.5 * mode.amplitude[small], abs=1e-5)
    assert mode.angular_frequency[0] == pytest.approx(np.sqrt(1.5), rel=1e-7)
    # Sliding to both sides leaves nothing of the preload.
    assert middle[-1] == pytest.approx(force, abs=1e-4)
    for amplitude in (0.7, 2.5):
        index = int(np.argmin(np.abs(mode.amplitude - amplitude)))
        orbit = mode.orbit(index)
        run = fc.simulate(with_mass_damping(unforced(system), float(mode.xi[index])),
                          1.0 / mode.frequency_hz[index], initial=orbit.states[0], rtol=1e-9,
                          outputs=len(orbit.times))
        assert np.abs(run.states - orbit.states)[:, 0].max() < 2e-3 * mode.amplitude[index]


def test_free_bodies_vibrate_about_where_they_are():
    """Nothing holds their mean; without losses the mode is that of half the spring each."""
    system = fc.ContactSystem(
        bodies={"a": point_masses({"p": 1.0}), "b": point_masses({"p": 1.0})},
        links={"ab": PolynomialSpring("a.p", "b.p", 1.0, 0.5, direction=UP)})
    mode = nonlinear_mode(system, (1e-2, 2.0), observe=("a.p", "y"), method=HarmonicBalance(15))
    assert mode.angular_frequency == pytest.approx(
        duffing_frequency(2.0, 4.0, mode.amplitude), rel=2e-8)
    assert np.abs(mode.coordinates(0)).max() < 1e-12
    assert mode.conservative
    assert mode.stable.all()


def test_what_depends_on_time_is_left_out_and_the_rest_kept():
    rows = np.zeros((3, 1))
    rows[0, 0] = 1.0
    basis = fc.basis_from_matrices([[2.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows},
                                   translations=[[1.0], [0.0]])
    given = fc.ContactSystem(
        basis, normal=PrescribedForce(1.0), friction=JenkinsFriction(0.5, 1.0),
        drive=fc.Drive(stiffness_x=3.0, motion_x=fc.laws.Constant(0.1), frequency_hz=2.0 / TURN),
        load=fc.Load(gravity=(0.4, 0.0), base_acceleration_x=Harmonic(1.0, 3.0 / TURN), forces=(
            fc.PointLoad("C", "x", signal=fc.laws.Constant(0.5)),
            fc.PointLoad("C", "x", signal=fc.laws.Pulse("half-sine", 1.0, 1.0)))))
    free = unforced(given)
    assert forcing_free(free)
    state = np.zeros(3)
    # Gravity, the constant force and the displaced spring remain, in modal forces.
    assert free.rhs(0.3, state)[1] == pytest.approx((2.0 * 0.4 + 0.5 + 0.3) / np.sqrt(2.0))
    assert (free.rhs(0.3, state) == free.rhs(0.7, state)).all()
    assert given.rhs(0.3, state)[1] != given.rhs(0.7, state)[1]


def test_elements_at_nodes_without_normal_force_slide_in_the_linear_mode():
    """A gap opens one of two nodes: its spring has no part in the frequency."""
    rows = np.zeros((2, 3, 2))
    rows[:, 0, 0] = rows[:, 1, 1] = 1.0
    basis = fc.basis_from_matrices(np.eye(2), np.zeros((2, 2)), {
        "contact": rows, "B": rows[0], "C": rows[0]})
    system = fc.ContactSystem(
        basis, normal=fc.laws.LinearContact(1e4, 0.0), friction=JenkinsFriction(8.0, 1.0),
        drive=fc.Drive(stiffness_x=1.0), load=fc.Load(normal=1.0), gap=(0.0, 1.0))
    mode = nonlinear_mode(system, (1e-6, 1e-4), method=HarmonicBalance(1, 64))
    assert mode.angular_frequency == pytest.approx(np.sqrt(1.0 + 4.0), rel=1e-6)


@pytest.mark.parametrize(("samples", "within"), [(512, 4e-5), (4096, 1e-6)])
def test_one_harmonic_of_a_jenkins_element(samples, within):
    """w^2 = k + f_c / X and xi = c + f_s / (w X) with its describing function f_c, f_s."""
    mode = nonlinear_mode(jenkins_system(), (0.5, 60.0), method=HarmonicBalance(1, samples))
    X = np.abs(mode.harmonic())
    elastic, lost = elements(X, [0.5], [1.0])
    w = np.sqrt(1.0 + elastic / X)
    assert mode.angular_frequency == pytest.approx(w, rel=within)
    assert mode.damping_ratio == pytest.approx((0.02 + lost / (w * X)) / (2.0 * w), abs=within)
    assert mode.damping_ratio.max() > 0.07
    assert mode.loss == pytest.approx(np.pi * X * (0.02 * w * X + lost), rel=30.0 * within)
    # Up to sliding the linear mode with the sticking element.
    stuck = X < 1.9
    assert np.count_nonzero(stuck) > 5
    assert mode.angular_frequency[stuck] == pytest.approx(np.sqrt(1.5), rel=1e-9)


def test_backbone_of_a_bolted_joint():
    """One harmonic of Iwan's law: the sum of its elements, and the loss of its power law."""
    chi, beta = -0.4, 0.2
    law = FourParameterIwanFriction(stiffness=0.5, friction_coefficient=1.0,
                                    chi=chi, beta=beta, elements=20, spacing_ratio=1.3)
    system = fc.ContactSystem(one_mode(), normal=PrescribedForce(1.0), friction=law,
                              drive=fc.Drive(stiffness_x=1.0, amplitude_x=1.0,
                                             frequency_hz=1.0 / TURN))
    mode = nonlinear_mode(system, (0.1, 30.0), method=HarmonicBalance(1, 1024),
                          options=ContinuationOptions(points=300, largest_step=0.15))
    X = np.abs(mode.harmonic())
    springs, limits = (each[0] for each in law.sliders(np.ones(1)))
    elastic, lost = elements(X, springs, limits)
    w = np.sqrt(1.0 + elastic / X)
    assert mode.angular_frequency == pytest.approx(w, rel=3e-6)
    assert mode.damping_ratio == pytest.approx(lost / (2.0 * w**2 * X), abs=3e-6)
    # In microslip a cycle loses 4 r X^(chi + 3) / ((chi + 2) (chi + 3)).
    arm = beta + (chi + 1.0) / (chi + 2.0)
    reach = (1.0 + beta) / (0.5 * arm)
    r = (chi + 1.0) / (reach ** (chi + 2.0) * arm)
    micro = (0.1 * reach < X) & (0.9 * reach > X)
    slope, _ = np.polyfit(np.log(X[micro]), np.log(mode.loss[micro]), 1)
    assert slope == pytest.approx(chi + 3.0, abs=0.015)
    assert mode.loss[micro] == pytest.approx(
        4.0 * r * X[micro] ** (chi + 3.0) / ((chi + 2.0) * (chi + 3.0)), rel=0.03)


def test_beam_with_a_friction_damper_decays_as_its_mode_says():
    """Frequency and damping of a free decay over its amplitude, ten periods at a time."""
    length, height = 0.3, 0.01
    body = fc.ElasticBody(fc.generate(fc.Beam(length, height, height / 2.0)), thickness=0.02,
                          fixed={"left": "xy"})
    beam = fc.modal_basis(body, 3, contact_nodes=2, points={"end": (length, height / 2.0)})
    row = np.zeros((3, 3))
    row[0] = beam.point_row("end", "y")
    w = beam.angular_frequencies
    basis = fc.basis_from_matrices(np.eye(3), np.diag(w**2), {"contact": row[None], "B": row},
                                   damping=np.diag(1e-3 * w))
    system = fc.ContactSystem(
        basis, normal=PrescribedForce(1.0),
        friction=JenkinsFriction(stiffness=400.0, friction_coefficient=0.04))
    mode = nonlinear_mode(system, (5e-5, 1e-3), method=HarmonicBalance(5, 256))
    start = mode.orbit(len(mode) - 1).states[0]
    periods = 170
    run = fc.simulate(system, periods / mode.frequency_hz[-1], initial=start, rtol=1e-8,
                      outputs=100 * periods + 1)
    end = CubicSpline(run.time, run.states[:, :3] @ row[0])
    tops = end.derivative().roots(extrapolate=False)
    tops = tops[(end(tops, 2) < 0.0) & (end(tops) > 0.0)]
    height = end(tops)
    ratio = np.log(height[:-10] / height[10:]) / (20.0 * np.pi)
    frequency, middle = 10.0 / (tops[10:] - tops[:-10]), height[5:-5]
    assert middle.min() < 2.5e-4
    assert middle.max() > 9e-4
    expected = np.interp(middle, mode.amplitude, mode.frequency_hz)
    assert frequency == pytest.approx(expected, rel=2e-5)
    assert ratio == pytest.approx(np.interp(middle, mode.amplitude, mode.damping_ratio), rel=7e-3)
    # The damper doubles the damping and more, and the frequency falls as it slides.
    assert np.ptp(ratio) > 8e-4
    assert np.ptp(frequency) > 0.1


def test_self_excited_mode_passes_the_limit_cycle_where_xi_is_zero():
    """Two masses on a belt: steady sliding grows, xi < 0, up to the cycle that remains."""
    method = HarmonicBalance(25)
    mode = nonlinear_mode(two_mass_system(B=7.3), (0.05, 1.6), observe=(0, "x"), method=method,
                          options=ContinuationOptions(points=200, largest_step=0.1))
    assert mode.xi[0] < -0.1
    assert (mode.damping_ratio < 0.0).any()
    last = int(np.flatnonzero(mode.xi < 0.0)[-1])
    assert 0 < last < len(mode) - 2
    near = slice(last - 2, last + 4)
    period = CubicSpline(mode.xi[near], 1.0 / mode.frequency_hz[near])(0.0)
    amplitude = CubicSpline(mode.xi[near], mode.amplitude[near])(0.0)
    field = two_mass_field()
    hopf = equilibrium_branch(field, parameter="B", bounds=(0.3, 9.6)).of_kind("Hopf")[0]
    cycle = orbit_branch(field, hopf, method=method, bounds=(0.3, 7.5)).at(field, 7.3)
    assert cycle.values["stable"]
    assert period == pytest.approx(cycle.values["period"], rel=1e-5)
    motion = cycle.orbit(samples=2000).states @ field.displacement_row(0)
    assert amplitude == pytest.approx(0.5 * np.ptp(motion), rel=1e-5)


def test_tolerance_takes_as_many_harmonics_as_it_needs():
    mode = nonlinear_mode(masses(between=0.5), (1e-2, 1.0), 2, observe=("a.p", "y"),
                          method=HarmonicBalance(2, tolerance=1e-5))
    assert mode.branch.method.highest > 3
    assert mode.branch.column("truncation_error").max() <= 1e-5


def test_files_give_back_what_was_written(resonant, tmp_path):
    _, mode = resonant
    again = io.read_mode(io.write_mode(tmp_path / "mode.h5", mode))
    assert repr(again) == repr(mode)
    for name in ("amplitude", "frequency_hz", "xi", "energy", "stable", "loss"):
        assert (getattr(again, name) == getattr(mode, name)).all()
    assert (again.coordinates(3) == mode.coordinates(3)).all()
    assert again.orbit(5).states == pytest.approx(mode.orbit(5).states, rel=1e-15)
    io.write_branch(tmp_path / "other.h5", replace(mode.branch, attributes={}))
    with pytest.raises(InputError, match="nonlinear mode"):
        io.read_mode(tmp_path / "other.h5")


def test_picture_shows_frequency_over_amplitude(resonant, tmp_path):
    _, mode = resonant
    figure = plot.plot_nonlinear_mode(mode, path=tmp_path / "mode.png")
    upper, lower = figure.axes
    assert {line.get_linestyle() for line in lower.lines} == {"-", "--"}
    assert lower.get_ylabel() == "energy [kJ]"
    drawn = np.concatenate([line.get_ydata() for line in upper.lines])
    assert drawn.max() == pytest.approx(mode.frequency_hz.max())
    damped = nonlinear_mode(jenkins_system(), (0.5, 6.0), method=HarmonicBalance(1, 128))
    figure = plot.plot_nonlinear_mode([damped, damped], names=["one", "two"], logarithmic=False)
    assert figure.axes[1].get_ylabel() == "damping ratio"
    texts = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert texts == ["one", "two"]
    with pytest.raises(InputError, match="same displacement"):
        plot.plot_nonlinear_mode([mode, damped])
    with pytest.raises(InputError, match="1 names"):
        plot.plot_nonlinear_mode([damped, damped], names=["one"])


@pytest.mark.parametrize(("changes", "told"), [
    ({"mode": 3}, "from 1 to 2; the frequencies at rest are: 0.15915, 0.27566 Hz"),
    ({"mode": True}, "mode = True"),
    ({"bounds": (1.0, 0.5)}, "two amplitudes above zero"),
    ({"bounds": (0.0, 0.5)}, "two amplitudes above zero"),
    ({"observe": ("a.p", "x")}, "does not move in this mode"),
    ({"observe": "a.p"}, "a point and a component")])
def test_bad_arguments(changes, told):
    given = {"bounds": (1e-3, 1.0), "mode": 1, "observe": ("a.p", "y"), **changes}
    with pytest.raises(InputError, match=told):
        nonlinear_mode(masses(), **given)


def test_overdamped_mode_is_told():
    system = fc.ContactSystem(
        bodies={"a": point_masses({"p": 1.0})},
        links={"a": PolynomialSpring("a.p", None, 1.0, 0.5, 3.0, UP)})
    with pytest.raises((InputError, AnalysisError), match="none"):
        nonlinear_mode(system, (1e-3, 1.0), observe=("a.p", "y"))


def test_coordinates_of_a_harmonic_that_was_not_computed():
    mode = nonlinear_mode(masses(), (1e-3, 2e-3), observe=("a.p", "y"), method=HarmonicBalance(2))
    with pytest.raises(InputError, match="from 0 to 2"):
        mode.coordinates(3)


def test_the_undamped_mode_beside_stiff_ones_is_found_in_few_steps(monkeypatch):
    """Rounding of eigenvalues is that of the largest, which lies 6000 times higher here."""
    from fecontact.bifurcation.nonlinear_modes import linear_start

    monkeypatch.setattr(linear_start, "_ITERATIONS", 8)
    n, rng = 40, np.random.default_rng(0)
    w = 2.0 * np.pi * np.geomspace(175.0, 1e6, n)
    E = np.kron(np.diag([0.0, 1.0]), np.eye(n))
    for _ in range(6):
        Q = np.linalg.qr(rng.standard_normal((n, n)))[0]
        K, C = Q @ np.diag(w**2) @ Q.T, Q @ np.diag(0.02 * w + 1.8) @ Q.T
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])
        rate = 0.5 * (0.02 * w[0] + 1.8)
        found, _, xi = linear_start._undamped(
            A, E, complex(-rate, np.sqrt(w[0] ** 2 - rate**2)))
        assert found == pytest.approx(w[0], rel=1e-8)
        assert xi == pytest.approx(2.0 * rate, rel=1e-8)


@pytest.mark.parametrize("method", [HarmonicBalance(41, samples=2048), Shooting()])
def test_energies_depend_neither_on_the_begin_of_a_mode_nor_on_its_steps(method):
    """A mass on a spring, and on a second one from a gap on: all motion is known from its energy.

    A half turn of the first spring's circle, and an arc about the place where both are in balance.
    """
    stiffness, gap = 5.0, 1.0
    row = np.array([[0.0], [1.0], [0.0]])
    basis = fc.basis_from_matrices([[1.0]], [[1.0]], {"contact": row[None], "B": row, "C": row})
    system = fc.ContactSystem(basis, normal=LinearContact(stiffness), friction=Frictionless(),
                              gap=gap)

    def amplitude(above):
        energy = 0.5 * above**2
        pressed = np.sqrt(2.0 * energy * (1.0 + stiffness) - stiffness * gap**2)
        return 0.5 * (above + (stiffness * gap + pressed) / (1.0 + stiffness))

    for low, options in ((0.5, None), (1.3, None),
                         (1.2, ContinuationOptions(step=0.3, largest_step=0.5))):
        mode = nonlinear_mode(system, (low, 4.0), observe=("B", "y"), method=method,
                              options=options)
        A = mode.amplitude
        assert A[[0, -1]] == pytest.approx([low, 4.0], rel=1e-6)
        tops = [a if a <= gap else brentq(lambda top, a=a: amplitude(top) - a, gap, 3.0 * a)
                for a in A]
        assert mode.energy == pytest.approx(0.5 * np.square(tops), rel=5e-6)


@pytest.mark.parametrize("state", [[2.5, 0.7], [-1.5, 0.0], [0.4, -2.0]])
def test_the_energy_of_any_state_is_kinetic_and_potential(state):
    """A mass on a spring, and on a second one of 5 N/m from 1 m on to one side."""
    row = np.array([[0.0], [1.0], [0.0]])
    basis = fc.basis_from_matrices([[1.0]], [[1.0]], {"contact": row[None], "B": row, "C": row})
    system = fc.ContactSystem(basis, normal=LinearContact(5.0), friction=Frictionless(), gap=1.0)
    field = contact_field(system, [])
    x, v = state
    exact = 0.5 * v**2 + 0.5 * x**2 + 2.5 * max(-x - 1.0, 0.0) ** 2
    found = energy_at(field, field.values, np.array(state), np.zeros(1))
    assert found == pytest.approx(exact, rel=1e-3)
    assert found == pytest.approx(exact, rel=1e-12) or x < -1.0
