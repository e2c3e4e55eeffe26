"""Waves: contact forces lean with them, so that ground at rest keeps the energy of a body."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from scipy.integrate import solve_ivp
from systems import mass_in_plane

from fecontact import (
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    Load,
    Material,
    modal_basis,
    simulate,
)
from fecontact.bifurcation import contact_field, orbit_branch, periodic_motion
from fecontact.integrate import Rodas5P, Scipy, SetValued
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    FourierSeries,
    LinearContact,
    MeasuredProfile,
    RoughSurface,
)

FREE = ConstantFriction(0.0)
A, LENGTH = 2e-4, 2e-2
K = 2.0 * np.pi / LENGTH
SINE = Ground(amplitude=A, wavelength=LENGTH)
X = np.linspace(0.0, 4e-2, 41)[:-1]
PROFILES = {
    "sine": SINE,
    "fourier": Ground(profile=FourierSeries(4e-2, (1e-4, 8e-5, 0.0, 3e-5), (0.3, 1.0, 0.0, 2.0))),
    "trace": Ground(profile=MeasuredProfile(
        np.append(X, 4e-2), np.append(A * np.sin(K * X) + 4e-5 * np.cos(3.0 * K * X), 4e-5),
        periodic=True)),
}


def mass(ground=SINE, **parts):
    """2 kg pressed by 40 N, free along the ground, without any damping."""
    return mass_in_plane(2.0, **{"normal": RoughSurface(1e6, 1e-5, 0.0), "friction": FREE,
                                 "load": Load(40.0), "ground": ground, **parts})


def beam(ground):
    body = ElasticBody(rectangle(0.06, 0.01, 12, 2), Material(), 0.02)
    basis = modal_basis(body, 6, contact="bottom", contact_nodes=5, C=(0.03, 0.01), B=(0.0, 0.005))
    return ContactSystem(basis, normal=RoughSurface(2e6, 1e-5, 0.0), friction=FREE,
                         load=Load(40.0), ground=ground)


def thrown(system, x, velocity):
    """Standing on the ground at a distance x along it, with a velocity along it."""
    basis, m = system.basis, system.basis.modes
    first = simulate(system, 1e-9, outputs=2).states[0]
    rigid = np.linalg.lstsq(basis.T[2:, 0, :m], np.full(basis.contact_nodes, 1.0), rcond=None)[0]
    return np.concatenate([first[:m] + x * rigid, velocity * rigid])


def total_energy(run):
    """Kinetic, elastic and contact energy, and that of the load, from positions alone."""
    system, basis = run.system, run.system.basis
    q, rate = run.modal_coordinates, run.modal_velocities
    height = q @ basis.T[1, 1]
    return (0.5 * (rate**2).sum(axis=1)
            + 0.5 * ((basis.angular_frequencies * q) ** 2).sum(axis=1)
            + system.stored_energy(run.penetration) + system.load.normal * height)


@pytest.mark.parametrize(("solver", "rtol", "tolerance"), [
    (Rodas5P(), 3e-9, 1e-6), (SetValued(), 1e-9, 2e-6), (Scipy("LSODA"), 1e-10, 1e-5)])
@pytest.mark.parametrize("profile", PROFILES)
def test_frictionless_mass_on_waves_at_rest_keeps_its_energy(profile, solver, rtol, tolerance):
    """The mass glides over crests and through troughs, and bounces as it lands."""
    system = mass(PROFILES[profile])
    run = simulate(system, 0.4, initial=thrown(system, 3e-3, 0.12), outputs=401, rtol=rtol,
                   solver=solver)
    energy = total_energy(run)
    assert np.ptp(run.displacement(0)[:, 0]) > 0.02
    assert np.ptp(energy) < tolerance * 40.0 * A
    assert run.energies.imbalance < tolerance
    assert (run.energies.belt_normal_work == 0.0).all()
    assert (run.energies.friction == 0.0).all()
    # The speed along the ground follows the height.
    assert np.ptp(run.velocity(0)[:, 0]) > 0.03


@pytest.mark.parametrize("profile", PROFILES)
def test_several_nodes_of_an_elastic_body_keep_its_energy(profile):
    system = beam(PROFILES[profile])
    run = simulate(system, 0.1, initial=thrown(system, 1e-3, 0.2), outputs=401, rtol=1e-8)
    energy = total_energy(run)
    assert np.ptp(energy) < 2e-6 * 40.0 * A
    assert np.ptp(run.velocity(2)[:, 0]) > 1e-3
    assert run.energies.imbalance < 1e-6


def test_bounces_on_rigid_waves_reflect_at_the_slope():
    """Restitution one: a ball on a curved table, against impacts located by solve_ivp."""
    system = mass(normal=LinearContact(1e6), load=Load(19.62))
    start = np.array([3e-3, 8e-3, 0.15, 0.0])
    T = system.basis.T[2, :2]
    state = np.concatenate([np.linalg.solve(T, start[:2]), np.linalg.solve(T, start[2:])])
    times = np.linspace(0.0, 0.4, 401)
    run = simulate(system, times[-1], initial=state, outputs=times, rtol=1e-11,
                   solver=SetValued(restitution=1.0))

    def above(t, y):
        return y[1] - A * np.sin(K * y[0])

    above.terminal, above.direction = True, -1.0
    t, y, found, impacts = 0.0, start, np.empty((len(times), 4)), 0
    while True:
        flight = solve_ivp(lambda t, y: [y[2], y[3], 0.0, -9.81], (t, times[-1]), y, rtol=1e-12,
                           atol=1e-15, events=above, max_step=0.01, dense_output=True)
        here = (times >= t) & (times <= flight.t[-1])
        found[here] = flight.sol(times[here]).T
        if flight.status == 0:
            break
        t, y = flight.t[-1], flight.y[:, -1].copy()
        normal = np.array([-A * K * np.cos(K * y[0]), 1.0])
        normal /= np.linalg.norm(normal)
        y[2:] -= 2.0 * (y[2:] @ normal) * normal
        impacts += 1
        # Beyond the rounding of the touch itself.
        t, y = t + 1e-9, y + 1e-9 * np.array([y[2], y[3], 0.0, -9.81])
    assert impacts == run.statistics["impacts"] >= 4
    assert run.displacement(0)[:, :2] == pytest.approx(found[:, :2], abs=2e-6)
    # A vertical blow would leave the speed along the ground as it was.
    assert np.ptp(found[:, 2]) > 0.05
    energy = 0.5 * (run.modal_velocities**2).sum(axis=1) + 19.62 * run.displacement(0)[:, 1]
    assert np.ptp(energy) < 1e-9 * energy[0]
    assert run.energies.contact_damping == pytest.approx(np.zeros(401), abs=1e-9 * energy[0])
    assert run.energies.imbalance < 1e-9


def test_resting_on_rigid_waves_and_sliding_down_them():
    """A closed rigid stop: the pendulum of the trough, m g A k^2 / m for small swings."""
    system = mass(normal=LinearContact(1e6), load=Load(19.62))
    T = system.basis.T[2, :2]
    x = -0.25 * LENGTH + 1e-4
    state = np.concatenate([np.linalg.solve(T, [x, A * np.sin(K * x)]), np.zeros(2)])
    period = 2.0 * np.pi / np.sqrt(9.81 * A * K**2)
    run = simulate(system, 2.0 * period, initial=state, outputs=801, rtol=1e-11,
                   solver=SetValued(restitution=0.0))
    swing = run.displacement(0)[:, 0] + 0.25 * LENGTH
    # But for the finite swing: (k a)^2 / 16 of the frequency.
    assert swing == pytest.approx(1e-4 * np.cos(2.0 * np.pi * run.time / period), abs=1e-7)
    kinetic = 0.5 * (run.modal_velocities**2).sum(axis=1)
    energy = kinetic + 19.62 * run.displacement(0)[:, 1]
    assert np.ptp(energy) < 1e-6 * kinetic.max()
    assert run.energies.imbalance < 1e-6


def test_vertical_contact_forces_gain_the_height_of_the_wave():
    """From a trough up to a crest: no resistance along x, energy N 2 A, of first order in A."""
    gained = []
    for amplitude in (A, 0.5 * A):
        system = mass(Ground(amplitude=amplitude, wavelength=LENGTH, normal="vertical"),
                      normal=RoughSurface(1e7, 1e-5, 0.0))
        speed = 0.02
        run = simulate(system, 0.5 * LENGTH / speed, rtol=1e-9,
                       initial=thrown(system, -0.25 * LENGTH, speed)
                       - np.append(0.0, [amplitude, 0.0, 0.0]) * np.sqrt(2.0))
        energy = total_energy(run)
        assert run.displacement(0)[-1, 0] == pytest.approx(0.25 * LENGTH, rel=1e-9)
        gained.append(energy[-1] - energy[0])
        assert gained[-1] == pytest.approx(40.0 * 2.0 * amplitude, rel=1e-2)
        # It is named: the work of the ground's normal force.
        assert run.energies.belt_normal_work[-1] == pytest.approx(gained[-1], rel=1e-6)
        assert run.energies.imbalance < 1e-6
    assert gained[0] / gained[1] == pytest.approx(2.0, rel=1e-3)


# Moving waves ------------------------------------------------------------------------------------

SPEED = 0.3


def held(normal="surface", **parts):
    """Held by a spring on waves that pass, with friction and damping."""
    return mass(Ground(speed=SPEED, amplitude=A, wavelength=LENGTH, normal=normal), **{
        "normal": RoughSurface(1e6, 1e-5, 30.0),
        "friction": ExponentialFriction(0.3, 0.2, 2.0, 1e3),
        "drive": Drive(stiffness_x=2e4, damping_x=40.0), **parts})


@pytest.mark.parametrize("solver", [Rodas5P(), SetValued()])
def test_work_of_the_belt_is_that_of_the_drag(solver):
    """Against fine quadrature of forces, slopes and speed; a cycle leaves nothing stored."""
    period = LENGTH / SPEED
    system = held()
    if isinstance(solver, SetValued):
        # Sliding all the time: the smoothing makes no difference but for its last percents.
        system = held(friction=ConstantFriction(0.2))
    settled = simulate(system, 60.0 * period, outputs=2, rtol=1e-7, solver=solver)
    run = simulate(system, 61.0 * period, initial=settled, outputs=4001, rtol=1e-9, solver=solver)
    slope = A * K * np.cos(K * (run.displacement(0)[:, 0] - SPEED * run.time))
    F, R = run.normal_force[:, 0], run.friction_force[:, 0]
    energies = run.energies
    quadrature = {
        "belt_normal_work": -np.trapezoid(F * slope * SPEED, run.time),
        "belt_friction_work": -np.trapezoid(R * SPEED, run.time),
        "friction": np.trapezoid(R * run.slip_velocity[:, 0], run.time),
        "dashpots": np.trapezoid(40.0 * run.velocity("B")[:, 0] ** 2, run.time)}
    for name, expected in quadrature.items():
        assert getattr(energies, name)[-1] == pytest.approx(expected, rel=2e-5), name
    # Periodic: what the belt puts in is lost.
    assert run.states[-1] == pytest.approx(run.states[0], abs=1e-5 * np.abs(run.states).max())
    put = energies.belt_normal_work[-1] + energies.belt_friction_work[-1]
    assert put == pytest.approx(energies.lost[-1], rel=1e-5)
    drag = energies.belt_normal_work[-1]
    assert drag > 0.01 * put
    assert energies.imbalance < 1e-6


def test_orbit_over_waves_followed_in_their_amplitude():
    """Collocation, with derivatives to amplitude and wavelength, against a run by scipy."""
    system = held(friction=ConstantFriction(0.2), load=Load(60.0)).with_(
        **{"ground.amplitude": 0.2 * A})
    field = contact_field(system, ["ground.amplitude", "ground.wavelength"])
    start = periodic_motion(system, transient=60.0 * LENGTH / SPEED)
    branch = orbit_branch(field, start, "ground.amplitude", bounds=(0.2 * A, 0.5 * A))
    last = branch.points[-1]
    assert last.parameter == pytest.approx(0.5 * A, rel=1e-9)
    assert last.values["stable"]
    high = system.with_(**{"ground.amplitude": 0.5 * A})
    period = LENGTH / SPEED
    settled = simulate(high, 60.0 * period, outputs=2, rtol=1e-8)
    run = simulate(high, 61.0 * period, initial=settled, outputs=2001, rtol=1e-9,
                   solver=Scipy("Radau"))
    swing = np.ptp(run.modal_coordinates, axis=0)
    low, top = last.values["minimum"][:2], last.values["maximum"][:2]
    assert top - low == pytest.approx(swing, rel=1e-3)
    # The force normal to the slope moves it along the ground; a vertical one would not.
    upright = simulate(high.with_(**{"ground.normal": "vertical"}), 61.0 * period, outputs=2001)
    late = upright.time > 60.0 * period
    assert np.ptp(upright.displacement(0)[late, 0]) < 0.5 * np.ptp(run.displacement(0)[:, 0])


def test_derivatives_to_waves():
    """Derivatives of the rates to amplitude and wavelength, on sloping ground, by differences."""
    field = contact_field(held(), ["ground.amplitude", "ground.wavelength"])
    rng = np.random.default_rng(7)
    t = rng.uniform(0.0, 1.0, 40)
    x = rng.normal(size=(40, 4)) * [1e-2, 2e-4, 0.2, 0.2]
    x[:, 1] += -3e-4
    values = field.values
    _, _, P = field.derivatives(t, x, values, range(2))
    for index, value in enumerate(values):
        def slope(h, index=index, value=value):
            step = h * value * np.eye(2)[index]
            return (field.rates(t, x, values + step) - field.rates(t, x, values - step)) / (
                2.0 * h * value)

        expected = (4.0 * slope(5e-7) - slope(1e-6)) / 3.0
        closed = np.abs(expected[:, 2]) > 0.0
        assert closed.sum() > 10
        scale = np.abs(expected).max(axis=0)
        assert (np.abs(P[:, :, index] - expected) <= 1e-5 * scale).all()
