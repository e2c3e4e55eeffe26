"""Elastic Coulomb elements in time, beside solutions that are exact piece by piece."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from systems import TURN

import fecontact as fc
from fecontact.integrate import Rodas5P, Scipy
from fecontact.laws import (
    BilateralPolynomial,
    FourParameterIwanFriction,
    Harmonic,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    PowerContact,
    PrescribedForce,
)

K, C, W = 1.0, 0.02, 1.15
T = 2.0 * np.pi / W


def mass(friction, time=1.0):
    """A mass of 1 kg that a spring of 1 N/m moves by sin(W t); its unit of time may change."""
    row = np.array([[[1.0], [0.0], [0.0]]])
    basis = fc.basis_from_matrices([[time**2]], [[0.0]], {"contact": row, "B": row[0]})
    return fc.ContactSystem(
        basis, normal=PrescribedForce(1.0), friction=friction, drive=fc.Drive(
            stiffness_x=K, damping_x=C * time, amplitude_x=1.0, frequency_hz=W / time / TURN))


def exact_motion(springs, limits, times):
    """Displacements and velocities (N, 2) of :func:`mass` from rest.

    Matrix exponentials between the times at which elements begin or end to slide, by root finding.
    """
    springs, limits = np.array(springs), np.array(limits)
    largest, sides = limits / springs, np.zeros(len(springs))
    z, y, t, found = np.zeros(len(springs)), np.array([0.0, 0.0, 0.0, 1.0, 1.0]), 0.0, []
    h = T / 50.0
    while len(found) < len(times):
        sticks, x, start = sides == 0.0, y[0], z.copy()
        A = np.zeros((5, 5))
        A[0, 1], A[2, 3], A[3, 2] = 1.0, W, -W
        A[1] = [-K - springs[sticks].sum(), -C, K, 0.0,
                (springs * (x - z))[sticks].sum() - (limits * sides).sum()]
        step, here, part, event = expm(h * A), y, 0.0, None

        def at(s, A=A, y=y):
            return expm(s * A) @ y

        while event is None and t + part < times[-1]:
            ahead, ends = step @ here, []
            for i in range(len(springs)):
                def beyond(s, i=i, x=x, start=start, at=at):
                    return abs(start[i] + at(s)[0] - x) - largest[i]

                if sticks[i] and beyond(part + h) > 0.0 > beyond(part):
                    ends.append((brentq(beyond, part, part + h, xtol=1e-15), i))
                elif not sticks[i] and sides[i] * here[1] > 0.0 > sides[i] * ahead[1]:
                    ends.append((brentq(lambda s, at=at: at(s)[1], part, part + h, xtol=1e-15), i))
            event = min(ends) if ends else None
            here, part = ahead, part + h
        length = event[0] if event else part
        while len(found) < len(times) and times[len(found)] <= t + length:
            found.append(at(times[len(found)] - t)[:2])
        y, t = at(length), t + length
        z[sticks] += y[0] - x
        if event and sticks[event[1]]:
            sides[event[1]] = np.sign(z[event[1]])
        elif event:
            z[~sticks] = sides[~sticks] * largest[~sticks] * (1.0 - 1e-13)
            sides[:] = 0.0
    return np.array(found)


LAWS = {"jenkins": (JenkinsFriction(0.5, 1.0), [0.5], [1.0]),
        "iwan": (IwanFriction(0.5, 1.0, elements=3), [0.5 / 3.0] * 3, [1 / 9, 3 / 9, 5 / 9])}


@pytest.mark.parametrize("name", LAWS)
def test_runs_agree_with_the_exact_solution(name):
    law, springs, limits = LAWS[name]
    times = np.linspace(0.0, 20.0 * T, 401)
    exact = exact_motion(springs, limits, times)
    size = np.abs(exact[:, 0]).max()
    for rtol, error in ((1e-6, 2e-5), (1e-9, 5e-8)):
        run = fc.simulate(mass(law), times[-1], outputs=times, rtol=rtol)
        assert np.abs(run.states[:, :2] - exact).max() < error * size
        assert np.abs(run.energies.imbalance) < 3e-6
        assert run.states[:, 2:] == pytest.approx(np.clip(
            run.states[:, 2:], *(np.array(limits) / springs * side for side in (-1.0, 1.0))))


def test_settled_motion_repeats_at_the_default_tolerance():
    system = mass(JenkinsFriction(0.5, 1.0))
    run = fc.simulate(system, 200.0 * T, outputs=200 * 20 + 1)
    x = run.states[-20 * 20 :, 0].reshape(20, 20)
    assert np.ptp(x, axis=0).max() < 5e-5
    assert x[-1].max() == pytest.approx(4.65, abs=0.05)


def test_outputs_and_end_do_not_change_the_motion():
    system = mass(JenkinsFriction(0.5, 1.0))
    few = fc.simulate(system, 8.0 * T, outputs=np.array([0.0, 3.0 * T, 8.0 * T]))
    many = fc.simulate(system, 8.0 * T, outputs=801)
    longer = fc.simulate(system, 16.0 * T, outputs=np.array([0.0, 8.0 * T, 16.0 * T]))
    assert few.states[-1] == pytest.approx(many.states[-1], abs=2e-5)
    assert few.states[-1] == pytest.approx(longer.states[1], abs=2e-5)


def test_law_is_independent_of_the_rate():
    slow, fast = (fc.simulate(mass(JenkinsFriction(0.5, 1.0), time), 5.0 * T * time, outputs=101,
                              rtol=1e-8) for time in (1.0, 1e-3))
    assert slow.displacement("B")[:, 0] == pytest.approx(fast.displacement("B")[:, 0], abs=1e-5)
    assert slow.friction_force == pytest.approx(fast.friction_force, abs=1e-5)


def swept(x, limits, z):
    """Deflections along displacements (N, d) within limits (N,), by Moreau's catching-up."""
    found = [z]
    for move, limit in zip(np.diff(x, axis=0), limits[1:], strict=True):
        z = z + move
        size = np.linalg.norm(z)
        z = z * min(1.0, limit / size) if size > 0.0 else z
        found.append(z)
    return np.array(found)


def test_normal_force_that_varies_and_opens():
    rows = np.array([[[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]])
    basis = fc.basis_from_matrices(np.eye(2), np.diag([1.0, 4.0]), {
        "contact": rows, "B": rows[0], "C": rows[0]}, damping=0.1 * np.eye(2))
    law = JenkinsFriction(2.0, 0.5)
    system = fc.ContactSystem(
        basis, normal=LinearContact(20.0, 0.0), friction=law, load=fc.Load(1.0, forces=(
            fc.PointLoad("C", "x", signal=Harmonic(1.5, 1.0 / TURN)),
            fc.PointLoad("C", "y", signal=Harmonic(3.0, 1.7 / TURN)))))
    run = fc.simulate(system, 40.0, outputs=40001, rtol=1e-8)
    F, x = run.normal_force[:, 0], run.displacement("C")[:, :1]
    assert F.min() == 0.0
    z = swept(x, 0.5 * F / 2.0, run.states[0, 4:])[:, 0]
    assert run.states[:, 4] == pytest.approx(z, abs=2e-3 * np.abs(z).max())
    assert run.friction_force[:, 0] == pytest.approx(2.0 * z, abs=4e-3 * np.abs(z).max())
    assert abs(run.energies.imbalance) < 1e-6
    assert run.friction_work[-1, 0] == pytest.approx(
        np.sum(0.5 * (z[1:] + z[:-1]) * 2.0 * np.diff(x[:, 0])) - z[-1] ** 2, rel=1e-3)


def in_space(friction):
    row = np.eye(3)[:, :2]
    basis = fc.basis_from_matrices(np.eye(2), np.diag([1.0, 1.3]), {
        "contact": row[None], "C": row}, damping=0.05 * np.eye(2), dimension=3)
    return fc.ContactSystem(basis, normal=PrescribedForce(1.0), friction=friction, load=fc.Load(
        forces=(fc.PointLoad("C", "x", signal=Harmonic(2.0, 0.9 / TURN)),
                fc.PointLoad("C", "y", signal=Harmonic(1.5, 1.3 / TURN)))))


def test_elements_turn_on_the_edge_of_their_disc():
    law = IwanFriction(2.0, 1.0, elements=2)
    run = fc.simulate(in_space(law), 30.0, outputs=60001, rtol=1e-7)
    for i, limit in enumerate((0.25, 0.75)):
        z = swept(run.displacement("C")[:, :2], np.full(60001, limit), np.zeros(2))
        own = run.states[:, 4 + 2 * i : 6 + 2 * i]
        assert np.abs(own - z).max() < 2e-3 * limit
        assert np.linalg.norm(own, axis=1).max() <= limit * (1.0 + 1e-9)
    assert abs(run.energies.imbalance) < 1e-5


def bouncing(normal):
    """A mass in space with two elements that three forces shake; its contact opens at times."""
    rows = np.eye(3)
    basis = fc.basis_from_matrices(np.eye(3), np.diag([1.0, 1.3, 4.0]), {
        "contact": rows[None], "C": rows}, damping=0.1 * np.eye(3), dimension=3)
    law = IwanFriction(20.0, 0.5, elements=2)
    return fc.ContactSystem(basis, normal=normal, friction=law, load=fc.Load(forces=(
        fc.PointLoad("C", "x", signal=Harmonic(2.0, 0.9 / TURN)),
        fc.PointLoad("C", "y", signal=Harmonic(1.5, 1.3 / TURN)),
        fc.PointLoad("C", "z", signal=Harmonic(3.0, 1.7 / TURN)))))


@pytest.mark.parametrize("normal", [LinearContact(20.0, 0.0), PowerContact(20.0, 2.0),
                                    BilateralPolynomial(5.0, 1.0, 0.0)])
def test_elements_turn_where_the_normal_force_vanishes(normal):
    """Deflections in space are those of the disc that follows the motion, where F passes zero."""
    system = bouncing(normal)
    rough, run = (fc.simulate(system, 20.0, outputs=80001, rtol=rtol) for rtol in (1e-6, 1e-9))
    F = np.abs(run.normal_force[:, 0])
    vanishes = (F == 0.0) | (np.diff(np.sign(run.normal_force[:, 0]), append=0.0) != 0.0)
    assert (F > 0.0).mean() > 0.02
    assert np.count_nonzero(np.diff(vanishes)) > 8
    for i in range(2):
        z = swept(run.displacement("C")[:, :2], (0.125, 0.375)[i] * F / 10.0, np.zeros(2))
        own = run.states[:, 6 + 2 * i : 8 + 2 * i]
        assert np.abs(own - z).max() < 2e-3 * np.abs(z).max()
    assert np.abs(rough.states[:, :3] - run.states[:, :3]).max() < 1e-5 * np.abs(run.states).max()
    assert abs(run.energies.imbalance) < 1e-5


@pytest.mark.parametrize("name", LAWS)
def test_derivatives_are_those_of_differences(name):
    system = mass(LAWS[name][0])
    start = fc.simulate(system, 6.2 * T, outputs=2, rtol=1e-10).states[-1]
    parameter = "friction.friction_coefficient"
    for part in (0.3, 1.0):
        span = {"t_start": 6.2 * T, "outputs": 2}
        end = (6.2 + part) * T
        found = fc.sensitivity(system, end, initial=start, parameter=parameter, rtol=1e-9, **span)

        def ends(state, mu=1.0, span=span, end=end):
            return fc.simulate(system.with_(**{parameter: mu}), end, initial=state, rtol=1e-12,
                               **span).states[-1]

        h = 1e-5
        columns = [(ends(start + h * one) - ends(start - h * one)) / (2.0 * h)
                   for one in np.eye(2, len(start))]
        assert found.monodromy[:, :2] == pytest.approx(np.array(columns).T, abs=2e-4)
        forced = (ends(start, 1.0 + h) - ends(start, 1.0 - h)) / (2.0 * h)
        assert found.parameter_derivative == pytest.approx(forced, abs=2e-4)
        assert found.states[-1] == pytest.approx(ends(start), abs=1e-6)


def complex_steps(end, values):
    """Derivatives of the entries (size,) of an analytic function to each of its values."""
    moved = np.array(values, dtype=complex) + 1e-30j * np.eye(len(values))
    return np.array([end(*row) for row in moved]).imag.T / 1e-30


@pytest.mark.parametrize("stiffness", [1.0, 1e4])
def test_derivatives_where_slip_begins(stiffness):
    """A mass is thrown along the ground: x'' = -k x, and from k x = mu F on x'' = -mu F."""
    limit, v, T = 0.3, 1.0, 1.0
    row = np.array([[[1.0], [0.0], [0.0]]])
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": row, "B": row[0]})
    system = fc.ContactSystem(basis, normal=PrescribedForce(1.0),
                              friction=JenkinsFriction(stiffness, limit))

    def end(speed, mu):
        w = np.sqrt(stiffness)
        x, slower = mu / stiffness, np.sqrt(speed**2 - mu**2 / stiffness)
        # Of sin(w t) = w x / speed; numpy's arcsine loses small imaginary parts.
        left = T - np.arctan(w * x / slower) / w
        return x + slower * left - 0.5 * mu * left**2, slower - mu * left

    wanted = complex_steps(end, (v, limit))
    found = fc.sensitivity(system, T, initial=[0.0, v, 0.0], rtol=1e-8,
                           parameter="friction.friction_coefficient")
    assert found.monodromy[:2, 1] == pytest.approx(wanted[:, 0], abs=1e-6)
    assert found.parameter_derivative[:2] == pytest.approx(wanted[:, 1], abs=1e-6)
    assert not found.note


def test_derivatives_where_a_contact_closes_and_sticks():
    """A mass falls on a spring over a belt: the normal force and the deflection begin at zero."""
    c, k, T = 1e5, 1e4, 4e-3
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    basis = fc.basis_from_matrices(np.eye(2), np.zeros((2, 2)), {"contact": rows[None], "B": rows})
    system = fc.ContactSystem(basis, normal=LinearContact(c, 0.0),
                              friction=JenkinsFriction(k, 0.3), ground=fc.Ground(speed=0.1))

    def end(x, y, vx, vy, belt):
        touch, w, wy = -y / vy, np.sqrt(k), np.sqrt(c)
        s = T - touch
        z = (vx - belt) * np.sin(w * s) / w
        return (x + vx * touch + belt * s + z, vy * np.sin(wy * s) / wy,
                belt + (vx - belt) * np.cos(w * s), vy * np.cos(wy * s), z)

    state = [0.0, 1e-4, 0.02, -0.1]
    wanted = complex_steps(end, (*state, 0.1))
    found = fc.sensitivity(system, T, initial=[*state, 0.0], rtol=1e-8, parameter="ground.speed",
                           outputs=[0.0, 0.53e-3, T])
    size = np.abs(wanted).max(axis=1)
    assert np.abs(found.states[-1] - end(*state, 0.1)).max() < 1e-8
    assert (np.abs(found.monodromy[:, :4] - wanted[:, :4]).max(axis=1) < 1e-6 * size).all()
    assert (np.abs(found.parameter_derivative - wanted[:, 4]) < 1e-6 * size).all()


def test_derivatives_where_the_normal_force_passes_zero():
    """An element slides until the normal force is zero, and sticks from there on, as |F| rises."""
    c, k, mu, T = 1e5, 1e4, 0.3, 3e-3
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    basis = fc.basis_from_matrices(np.eye(2), np.zeros((2, 2)), {"contact": rows[None], "B": rows})
    system = fc.ContactSystem(basis, normal=BilateralPolynomial(c, 0.0, 0.0),
                              friction=JenkinsFriction(k, mu), ground=fc.Ground(speed=0.1))

    def end(x, y, vx, vy, belt):
        w, wz = np.sqrt(c), np.sqrt(k)
        passes = np.arctan(-w * y / vy) / w
        s = T - passes
        # The friction is mu y'' until then.
        slower = vx - mu * (vy / np.cos(w * passes) - vy)
        there = x + (vx + mu * vy) * passes + mu * y
        z = (slower - belt) * np.sin(wz * s) / wz
        return (there + belt * s + z, vy / np.cos(w * passes) * np.sin(w * s) / w,
                belt + (slower - belt) * np.cos(wz * s),
                vy / np.cos(w * passes) * np.cos(w * s), z)

    state = [0.0, -1e-4, 0.2, 0.1]
    wanted = complex_steps(end, (*state, 0.1))
    for outputs in ([0.0, T], [0.0, 0.97e-3, 1.1e-3, T]):
        found = fc.sensitivity(system, T, initial=[*state, mu * c * 1e-4 / k], rtol=1e-11,
                               parameter="ground.speed", outputs=outputs)
        size = np.abs(wanted).max(axis=1)
        assert np.abs(found.states[-1] - end(*state, 0.1)).max() < 1e-8
        assert (np.abs(found.monodromy[:, :4] - wanted[:, :4]).max(axis=1) < 1e-6 * size).all()
        assert (np.abs(found.parameter_derivative - wanted[:, 4]) < 1e-6 * size).all()


@pytest.mark.slow
def test_derivatives_where_sliding_elements_lift_off_in_space():
    """Directions of slip turn ever faster as the normal force vanishes; forces do not."""
    system = bouncing(LinearContact(20.0, 0.0))
    start = fc.simulate(system, 2.0, outputs=2, rtol=1e-10).states[-1]
    times = np.linspace(2.0, 8.0, 7)
    found = fc.sensitivity(system, 8.0, initial=start, t_start=2.0, outputs=times, rtol=1e-8)
    lifts = fc.simulate(system, 8.0, initial=start, t_start=2.0, outputs=6001).normal_force[:, 0]
    assert np.count_nonzero(np.diff(lifts > 0.0)) > 3
    assert not found.note
    h = 1e-6
    moves = h * np.eye(6, len(start))
    ends = [[fc.simulate(system, 8.0, initial=start + sign * move, t_start=2.0, outputs=2,
                         rtol=1e-12).states[-1] for move in moves] for sign in (1.0, -1.0)]
    wanted = ((np.array(ends[0]) - np.array(ends[1])) / (2.0 * h)).T
    assert np.abs(found.monodromy[:6, :6] - wanted[:6]).max() < 1e-4 * np.abs(wanted).max()


def test_what_does_not_serve_the_elements_says_so():
    system = mass(JenkinsFriction(0.5, 1.0))
    field = fc.bifurcation.contact_field(system, ["drive.frequency_hz"])
    motion = fc.simulate(system, 2.0 * T, outputs=201)
    with pytest.raises(fc.InputError, match="Collocation does not locate where elastic Coulomb"):
        fc.bifurcation.orbit_branch(field, motion)


def test_scipy_agrees_with_the_exact_solution():
    law, springs, limits = LAWS["jenkins"]
    times = np.linspace(0.0, 2.0 * T, 41)
    run = fc.simulate(mass(law), times[-1], outputs=times, rtol=1e-7, solver=fc.integrate.Scipy())
    assert np.abs(run.states[:, :2] - exact_motion(springs, limits, times)).max() < 1e-5


def test_scipy_returns_elements_of_every_node():
    """Two masses: one at rest, and that of the exact solution on the second node."""
    _, springs, limits = LAWS["jenkins"]
    rows = np.zeros((2, 3, 2))
    rows[0, 0, 0] = rows[1, 0, 1] = 1.0
    basis = fc.basis_from_matrices(np.eye(2), np.zeros((2, 2)), {"contact": rows, "B": rows[1]})
    system = fc.ContactSystem(
        basis, normal=PrescribedForce((1.0, 1.0)), friction=JenkinsFriction((0.5, 0.5), 1.0),
        drive=fc.Drive(stiffness_x=K, damping_x=C, amplitude_x=1.0, frequency_hz=W / TURN))
    times = np.linspace(0.0, 5.0 * T, 101)
    exact = exact_motion(springs, limits, times)[:, 0]
    run = fc.simulate(system, times[-1], outputs=times, rtol=1e-7, solver=fc.integrate.Scipy())
    assert np.abs(run.displacement(1)[:, 0] - exact).max() < 1e-5 * np.abs(exact).max()
    assert np.abs(run.displacement(0)).max() < 1e-9


def test_shooting_finds_the_settled_amplitude():
    bifurcation = fc.bifurcation
    system = mass(JenkinsFriction(0.5, 1.0))
    exact = exact_motion([0.5], [1.0], np.linspace(59.0 * T, 60.0 * T, 2001))[:, 0]
    run = fc.simulate(system, 20.0 * T, outputs=20 * 100 + 1)
    field = bifurcation.contact_field(system, ["drive.frequency_hz"])
    branch = bifurcation.orbit_branch(
        field, run, method=bifurcation.Shooting(), bounds=(1.1 / TURN, 1.2 / TURN),
        options=bifurcation.ContinuationOptions(points=2))
    x = branch.points[0].orbit(field, 2001).states[:, 0]
    assert np.ptp(x) == pytest.approx(np.ptp(exact), rel=1e-5)


def test_segalmans_parameters():
    chi, phi_max, R, S, F = -0.3, 2e-4, 4e6, 3e5, 50.0
    law = FourParameterIwanFriction.from_distribution(chi, phi_max, R, S, F, elements=40)
    assert law.distribution(F) == pytest.approx((chi, phi_max, R, S))
    # Segalman (2005): F_S and K_T are integrals of the distribution.
    power = R * phi_max ** (chi + 1.0)
    assert law.stiffness == pytest.approx(power / (chi + 1.0) + S)
    assert law.friction_coefficient * F == pytest.approx(
        phi_max * (power / (chi + 2.0) + S))
    with pytest.raises(fc.InputError, match=r"S = -1\.0 must be a finite number, zero or above"):
        FourParameterIwanFriction.from_distribution(chi, phi_max, R, -1.0, F)


def test_normal_force_that_jumps_at_touch():
    """An element begins at zero where a contact closes, though the force of its dashpot jumps.

    A mass falls on a spring and a dashpot over a belt: z = V t from the touch on, within mu F / k.
    """
    c, d, g, drop, speed, mu, stiffness = 4e3, 40.0, 9.81, 1e-3, 0.02, 0.5, 4e3
    rows = np.array([[0.0], [1.0], [0.0]])
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "C": rows})
    system = fc.ContactSystem(
        basis, normal=LinearContact(c, d), load=fc.Load(g), ground=fc.Ground(speed=-speed),
        friction=JenkinsFriction(stiffness, mu))
    touch, step = np.sqrt(2.0 * drop / g), 5e-5
    times = np.append(0.0, touch + step * np.arange(1, 401))
    run = fc.simulate(system, times[-1], outputs=times, rtol=1e-8, initial=[drop, 0.0, 0.0])
    motion = expm(step * np.array([[0.0, 1.0, 0.0], [-c, -d, g], [0.0, 0.0, 0.0]]))
    fall, forces, z = np.array([0.0, g * touch, 1.0]), [0.0], [0.0]
    for _ in times[1:]:
        fall = motion @ fall
        forces.append(max(0.0, c * fall[0] + d * fall[1]))
        z.append(min(z[-1] + speed * step, mu * forces[-1] / stiffness))
    assert run.normal_force[:, 0] == pytest.approx(np.array(forces), abs=1e-5 * max(forces))
    assert run.states[:, 2] == pytest.approx(np.array(z), abs=1e-5 * max(z))
    assert forces[1] > 0.1 * max(forces)
    assert z[-1] > 0.1 * max(z)


def test_runs_of_scipy_pass_contacts_that_close_with_a_stretched_element():
    """The element slides from the touch on; the step there began at its own end for ever."""
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    basis = fc.basis_from_matrices(2.0 * np.eye(2), np.diag([500.0, 0.0]),
                                   {"contact": rows[None], "B": rows, "C": rows})
    system = fc.ContactSystem(
        basis, normal=LinearContact(1e5, 200.0), friction=JenkinsFriction(2e4, 0.5),
        drive=fc.Drive(stiffness_x=2e3, amplitude_x=0.01, frequency_hz=1.6),
        load=fc.Load(20.0, (fc.PointLoad("C", "y", signal=Harmonic(30.0, 4.3)),)))
    run, other = (fc.simulate(system, 0.2, outputs=41, rtol=rtol, solver=solver)
                  for solver, rtol in ((Scipy("LSODA"), 1e-6), (Rodas5P(), 1e-8)))
    force = other.normal_force[:, 0]
    assert force[0] > 0.0
    assert force.min() == 0.0
    assert force[-5:].max() > 0.0
    assert run.modal_coordinates == pytest.approx(other.modal_coordinates, abs=1e-6)
    assert abs(run.energies.imbalance) < 1e-5
