"""Runs by power series: closed forms, the implicit integrator, and no touch-down missed."""

from math import factorial

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from systems import SURFACE, TURN, friction_oscillator, impact_oscillator, mass_in_y

import fecontact as fc
from fecontact import ContactSystem, Drive, Load, ModalBasis, PointLoad, Status, simulate
from fecontact.core.compiled import kernel
from fecontact.core.errors import InputError
from fecontact.core.records import Matrix, Vector
from fecontact.integrate import Auto, ContactEvents, Crossing, PowerSeries, Rodas5P, Scipy
from fecontact.integrate.rodas5p import driver
from fecontact.integrate.series import polynomials
from fecontact.integrate.series.branches import MOST_MODES
from fecontact.integrate.series.method import SMALL, Data, advance
from fecontact.laws import (
    ConstantFriction,
    Harmonics,
    LinearContact,
    ParabolicSurface,
    PowerContact,
    RoughSurface,
    Step,
    TwoSidedStop,
)
from fecontact.laws.pieces import DAMPING, ELASTIC, LOWER, RELEASE, UPPER

SERIES, STEPS = PowerSeries(), Rodas5P()
SOLVERS = {solver.name: solver for solver in (Auto(), SERIES, STEPS)}


@kernel
def first_zero(p: Vector, limit: float, workspace: Matrix) -> float:
    """First zero found by the kernels."""
    return polynomials.first_zero(p, limit, workspace)


def oscillator(w=(0.0, 900.0), damping=(0.0, 0.02), y=((1.0, 0.6),), **parts):
    """Modes that move one or several nodes up and down, driven at the first."""
    w, y = np.array(w), np.atleast_2d(y)
    T = np.zeros((2 + len(y), 3, len(w)))
    T[:2, 1], T[2:, 1] = y[0], y
    basis = ModalBasis(w, np.diag(2.0 * np.array(damping) * w), T, np.zeros((2 + len(y), 2)),
                       np.full(len(y), 1.0 / len(y)))
    return ContactSystem(basis, **{"normal": SURFACE, **parts})


def random_system(rng):
    """A system that series are for, a state from which it starts, and a length of time."""
    m = int(rng.integers(1, 5))
    n = int(rng.integers(1, 4)) if m > 1 else 1
    w = np.sort(10.0 ** rng.uniform(0.5, 3.2, m))
    if rng.random() < 0.4:
        w[0] = 0.0
    c, wE = 10.0 ** rng.uniform(3.0, 6.0), 10.0 ** rng.uniform(0.7, 2.3)
    d = 0.0 if rng.random() < 0.3 else 10.0 ** rng.uniform(-3.5, -1.5) * np.sqrt(c)
    factor = 10.0 ** rng.uniform(-2.0, 0.0)
    normal = [RoughSurface(c, 10.0 ** rng.uniform(-6.0, -3.0), d), LinearContact(c, d),
              PowerContact(c, 1.0, factor), PowerContact(1e3 * c, 2.0, factor),
              TwoSidedStop(c, 10.0 ** rng.uniform(-5.0, -3.0), float(rng.integers(1, 3)), factor),
              ][rng.integers(5)]
    forces = (PointLoad("C", "y", signal=Harmonics(
        tuple(rng.normal(size=2)), (2.0 * wE / TURN, 3.1 * wE / TURN), (0.3, 1.0))),)
    system = oscillator(
        w, 10.0 ** rng.uniform(-4.0, -0.7, m) * (rng.random(m) < 0.7), rng.normal(size=(n, m)),
        normal=normal, gap=rng.choice([0.0, 1e-5, 1e-4]),
        drive=Drive(stiffness_y=10.0 ** rng.uniform(1.0, 3.0), damping_y=rng.uniform(0.0, 0.1),
                    amplitude_y=10.0 ** rng.uniform(-4.0, -2.5), frequency_hz=wE / TURN,
                    dashpots=rng.choice(["relative", "absolute"])),
        load=Load(rng.choice([0.0, 1.0, 3.0]), forces=forces if rng.random() < 0.4 else ()))
    state = rng.normal(size=2 * m) * np.repeat([1e-4, 1e-1], m) * 10.0 ** rng.uniform(-1.0, 0.5)
    return system, state, float(rng.uniform(0.3, 2.0) * 2.0 * np.pi / wE)


def assert_as_by_steps(seed):
    """A random system moves as it does by the implicit integrator."""
    system, state, end = random_system(np.random.default_rng(seed))
    times = np.linspace(0.0, end, 41)
    runs = []
    for rtol, method in ((1e-9, "power-series"), (1e-8, "rodas5p"), (1e-11, "rodas5p")):
        run = driver.start(system, state, times, rtol=rtol, method=method,
                           events=(ContactEvents(),))
        while run.advance(10_000) == 0:
            pass
        runs.append(run)
    own, rough, fine = runs
    for values, other, wanted in ((own.states, rough.states, fine.states),
                                  (own.work, rough.work, fine.work)):
        scale = np.abs(wanted).max(axis=0)
        scale = np.where(scale > 0.0, scale, 1.0) if values is own.states else scale.max()
        error = (np.abs(values - wanted) / scale).max()
        assert error <= 30.0 * (np.abs(other - wanted) / scale).max() + 1e-8, seed


def assert_no_contact_missed(seed):
    """By the law itself, forces occur between touch-down and lift-off, and only then."""
    system, state, end = random_system(np.random.default_rng(seed))
    run = simulate(system, end, initial=state, outputs=2001, events=ContactEvents(),
                   solver=SERIES, rtol=1e-8)
    assert run.status is Status.FINISHED, seed
    forces = np.abs(run.normal_force)
    least = 1e-8 * forces.max()
    for j in range(forces.shape[1]):
        begins = run.events.only("touch-down", j).time
        ends = run.events.only("lift-off", j).time
        closed = int(forces[0, j] > 0.0)
        at = np.searchsorted(begins, run.time) - np.searchsorted(ends, run.time) + closed
        near = np.concatenate([[-1.0], begins, ends, [end + 1.0]])
        clear = np.abs(run.time[:, None] - near).min(axis=1) > 1e-9 * end
        clear[0] = False
        assert set(at[clear]) <= {0, 1}, seed
        assert (forces[clear & (at == 0), j] <= least).all(), seed
        assert (forces[clear & (at == 1), j] > 0.0).all(), seed


# Zeros -------------------------------------------------------------------------------------------

def test_the_first_zero_of_random_polynomials():
    rng = np.random.default_rng(0)
    count = polynomials.COEFFICIENTS
    workspace = np.zeros(polynomials.WORKSPACE)
    for trial in range(3000):
        if trial % 2:
            p = np.poly(rng.uniform(0.0, 1.5, rng.integers(1, 7)))[::-1]
            p *= np.sign(p[0])
        else:
            w, phase = rng.uniform(0.1, 9.0), rng.uniform(-0.5, 0.5) * np.pi
            p = np.array([w**k / factorial(k) * np.cos(phase + 0.5 * k * np.pi)
                          for k in range(count)])
        c, limit = np.zeros(count), rng.uniform(0.2, 1.0)
        c[: len(p)] = p
        roots = np.roots(c[::-1])
        roots = roots[np.abs(roots.imag) < 1e-9].real
        first = min([root for root in roots if 0.0 < root <= limit], default=2.0 * limit)
        assert first_zero(c, limit, workspace) == pytest.approx(first, abs=1e-7)


def test_zeros_that_touch():
    """(x - a)^2 + e has two zeros, or none, however near they are."""
    count, workspace = polynomials.COEFFICIENTS, np.zeros(polynomials.WORKSPACE)
    for a in np.random.default_rng(1).uniform(0.05, 0.95, 300):
        for distance in (1e-3, 1e-5, 1e-7):
            c = np.zeros(count)
            c[:3] = a * a - distance**2, -2.0 * a, 1.0
            assert first_zero(c, 1.0, workspace) == pytest.approx(a - distance,
                                                                  abs=1e-15 / distance)
            c[0] = a * a + distance**2
            assert first_zero(c, 1.0, workspace) == 2.0
    c = np.zeros(count)
    assert first_zero(c, 1.0, workspace) == 2.0  # zero everywhere
    c[1] = 1.0
    assert first_zero(c, 1.0, workspace) == 2.0  # zero at the start alone
    c[1] = -1.0
    assert first_zero(c, 1.0, workspace) == 0.0


# Laws --------------------------------------------------------------------------------------------

@pytest.mark.parametrize("law", [
    RoughSurface(0.3e6, 5.2e-6, 6.0), RoughSurface(0.3e6, 5.2e-6), LinearContact(1e5, 3.0),
    LinearContact(1e5), PowerContact(1e5, 1.0, 0.3), PowerContact(1e10, 2.0, 0.3),
    TwoSidedStop(1e5, 1e-5, 1.0, 0.3), TwoSidedStop(1e10, 1e-5, 2.0, 0.3)])
def test_pieces_are_the_law(law):
    rng = np.random.default_rng(2)
    pieces, p = law.pieces(np.ones(1))[0], law.table(np.ones(1))[0]
    assert (pieces[1:, LOWER] == pieces[:-1, UPPER]).all()
    for u, v in zip(rng.uniform(-2e-5, 2e-5, 500), rng.uniform(-5.0, 5.0, 500), strict=True):
        piece = pieces[(pieces[:, LOWER] < u) & (u < pieces[:, UPPER])][0]
        powers = np.array([1.0, u, u * u])
        force = piece[ELASTIC:DAMPING] @ powers + piece[DAMPING:RELEASE] @ powers * v
        release = piece[RELEASE:]
        acts = release.any() and (release[2] == 0.0 or release @ [1.0, u, v] > 0.0)
        wanted = law.kernel.python(u, v, p)[0]
        assert (force if acts else 0.0) == pytest.approx(wanted, rel=1e-12, abs=1e-12)


def test_laws_without_pieces():
    share = np.ones(1)
    assert ParabolicSurface(1e5, 1e-5).pieces(share) is None
    assert PowerContact(1e5, 1.5).pieces(share) is None
    assert TwoSidedStop(1e5, 1e-5, 1.5).pieces(share) is None


# Motion ------------------------------------------------------------------------------------------

def test_a_ball_that_bounces_for_ever():
    """On a linear spring, under gravity: fall and contact have closed forms."""
    g, k, height = 9.81, 1e5, 0.01
    system = mass_in_y(normal=LinearContact(k), friction=ConstantFriction(0.0),
                       load=Load(normal=g), gap=0.0)
    w, speed = np.sqrt(k), np.sqrt(2.0 * g * height)
    # u = g/k (1 - cos wt) + v/w sin wt is zero again after this time.
    contact = 2.0 * (np.pi - np.arctan2(speed / w, g / k)) / w
    fall = np.sqrt(2.0 * height / g)
    period = 2.0 * fall + contact
    start = np.array([height - 0.125 * g * fall**2, -0.5 * g * fall])
    run = simulate(system, 400.0 * period, initial=start, solver=SERIES,
                   outputs=np.arange(401) * period, events=ContactEvents(), rtol=1e-12)
    assert run.states == pytest.approx(np.tile(start, (401, 1)), rel=1e-10)
    downs = run.events.only("touch-down").time
    assert downs == pytest.approx(0.5 * fall + period * np.arange(400), rel=1e-11)
    assert run.events.only("lift-off").time == pytest.approx(downs + contact, rel=1e-11)
    assert run.energies.growth < 1e-11


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_errors_follow_the_tolerance(rtol):
    """Free vibration of two modes under a harmonic drive, far from the ground."""
    system = oscillator((20.0, 900.0), (0.01, 0.02), gap=1.0, drive=Drive(
        stiffness_y=50.0, amplitude_y=1e-3, frequency_hz=40.0 / TURN))
    state = np.array([1e-3, -2e-4, 0.1, 0.0])
    times = np.linspace(0.0, 1.0, 301)
    run = driver.start(system, state, times, rtol=rtol, work=False, method="power-series")
    run.advance(10**6)
    s = system.arrays
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-s.stiffness, -s.damping]])
    b = np.concatenate([np.zeros(2), 50.0 * 1e-3 * s.drive_shapes[1]])
    # Im p exp(iWt) is the steady motion.
    p = np.linalg.solve(40.0j * np.eye(4) - A, b)
    rates, V = np.linalg.eig(A)
    c = np.linalg.solve(V, state - p.imag)
    wanted = np.real((V * c) @ np.exp(np.outer(rates, times)) + 0j).T + np.imag(
        np.outer(np.exp(40.0j * times), p))
    error = (np.abs(run.states - wanted).max(axis=0) / np.abs(wanted).max(axis=0)).max()
    assert error < max(0.1 * rtol, 1e-12)
    assert error > 1e-7 * rtol


@pytest.mark.parametrize("seed", range(24))
def test_random_systems_move_as_by_steps(seed):
    assert_as_by_steps(seed)


@pytest.mark.slow
def test_many_random_systems_move_as_by_steps():
    for seed in range(1000, 1300):
        assert_as_by_steps(seed)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_no_contact_is_missed():
    for seed in range(200):
        assert_no_contact_missed(seed)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_no_contact_of_very_many_is_missed():
    for seed in range(10_000, 14_000):
        assert_no_contact_missed(seed)


def graze(rng, depth):
    """Whether a beat of two modes touches a gap that is less than its largest value by a part."""
    w = rng.uniform(10.0, 50.0) * np.array([1.0, rng.uniform(2.0, 30.0)])
    a, phases = rng.uniform(0.3, 1.0, 2) * np.array([1.0, 0.5]), rng.uniform(0.0, 2.0 * np.pi, 2)
    end = 2.0 * np.pi / w[0]

    def u(t):
        return -a @ np.sin(np.multiply.outer(w, t) + phases[:, None])

    times = np.linspace(0.0, end, 4001)
    values = u(times)
    inner = 1 + np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:]))
    # Peaks are compared as they are, not at the times around them.
    tops = [minimize_scalar(lambda t: -u(np.array([t]))[0], method="bounded",
                            bounds=(times[k - 1], times[k + 1]), options={"xatol": 1e-15})
            for k in inner if values[k] > values.max() - 0.05]
    if not tops:
        return None
    top = min(tops, key=lambda found: found.fun)
    if not 0.02 * end < top.x < 0.98 * end or values[[0, -1]].max() > -top.fun - 0.01:
        return None
    system = oscillator(w, (0.0, 0.0), ((1.0, 1.0),), normal=LinearContact(1e3),
                        gap=-top.fun * (1.0 - depth))
    state = np.concatenate([a * np.sin(phases), w * a * np.cos(phases)])
    run = driver.start(system, state, np.array([0.0, end]), rtol=1e-11, work=False,
                       events=(ContactEvents(),), method="power-series")
    run.advance(10**5)
    return "touch-down" in run.events.kind


def assert_grazing_found(seeds):
    tried = 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        depth = 10.0 ** rng.uniform(-12.0, -3.0)
        for sign in (1.0, -1.0):
            touched = graze(np.random.default_rng(seed), sign * depth)
            if touched is not None:
                tried += 1
                assert touched == (sign > 0.0), (seed, sign * depth)
    assert tried > len(seeds)


def test_grazing_contacts_are_found():
    assert_grazing_found(range(150))


@pytest.mark.slow
def test_very_many_grazing_contacts_are_found():
    assert_grazing_found(range(1000, 7000))


def test_rebounds_that_accumulate():
    """A ball with damping comes to rest on the ground after ever shorter rebounds."""
    g, k, R = 9.81, 1e6, 1e-4
    system = mass_in_y(normal=RoughSurface(k, R, 150.0), friction=ConstantFriction(0.0),
                       load=Load(normal=g))
    start, runs = np.array([0.02, 0.0]), []
    for solver, rtol in ((SERIES, 1e-8), (STEPS, 1e-11)):
        runs.append(simulate(system, 3.0, initial=start, solver=solver, rtol=rtol,
                             events=ContactEvents(), outputs=301))
    series, steps = runs
    assert series.status is Status.FINISHED
    downs = series.events.only("touch-down").time
    assert len(downs) > 8
    assert (np.diff(downs)[1:] < np.diff(downs)[:-1]).all()
    assert downs == pytest.approx(steps.events.only("touch-down").time, rel=1e-7)
    # c u^2 / (2 R) = g at rest.
    assert series.states[-1] == pytest.approx([-np.sqrt(2.0 * R * g / k), 0.0], abs=1e-11)


# Runs --------------------------------------------------------------------------------------------

def progressed(run, steps):
    while run.advance(steps) == 0:
        pass
    return run


def test_runs_go_on_bit_for_bit():
    system, state = impact_oscillator(2, 9.845), np.zeros(4)
    times = np.linspace(0.0, 3.0, 400)
    options = {"rtol": 1e-6, "method": "power-series", "events": (ContactEvents(),)}
    whole = progressed(driver.start(system, state, times, **options), 10**9)
    parts = progressed(driver.start(system, state, times, **options), 1)
    assert (whole.states == parts.states).all()
    assert (whole.work == parts.work).all()
    assert (whole.events.time == parts.events.time).all()
    assert len(whole.events) > 20


def test_a_checkpoint_of_series(tmp_path):
    system, file = impact_oscillator(2, 9.845), tmp_path / "run.checkpoint"
    solver = PowerSeries(file)
    options = {"initial": np.zeros(4), "events": ContactEvents(), "outputs": 20001}
    whole = simulate(system, 400.0, **options, solver=SERIES)

    def stop(time):
        if 1.0 < time < 399.0:
            raise KeyboardInterrupt

    part = simulate(system, 400.0, **options, solver=solver, progress=stop)
    assert part.status is Status.INTERRUPTED
    with pytest.raises(InputError, match="checkpoint of another run"):
        simulate(system, 400.0, **options, solver=Rodas5P(file))
    rest = simulate(system, 400.0, **options, solver=solver)
    assert 0 < len(part.events) < len(whole.events)
    assert (rest.states == whole.states).all()
    assert (rest.work == whole.work).all()
    assert (rest.events.states == whole.events.states).all()


def test_neither_outputs_nor_the_end_change_the_motion():
    system = impact_oscillator(2, 64.32)
    options = {"initial": np.zeros(4), "solver": SERIES, "events": ContactEvents()}
    many = simulate(system, 1.0, outputs=1001, **options)
    few = simulate(system, 1.0, outputs=[0.0, 0.3, 1.0], **options)
    longer = simulate(system, 7.0, outputs=7001, **options)
    assert (many.events.time == few.events.time).all()
    assert (many.states[-1] == few.states[-1]).all()
    count = len(many.events)
    assert (longer.events.time[:count] == many.events.time).all()
    assert longer.states[:990] == pytest.approx(many.states[:990], rel=1e-12, abs=1e-16)


def test_a_run_that_stops_at_its_first_contact():
    system, start = impact_oscillator(1), np.zeros(2)
    runs = [simulate(system, 1.0, initial=start, solver=solver, rtol=1e-11,
                     events=ContactEvents(stop="touch-down")) for solver in (SERIES, STEPS)]
    assert runs[0].status is runs[1].status is Status.EVENT
    assert runs[0].time[-1] == pytest.approx(runs[1].time[-1], rel=1e-9)
    assert runs[0].events.kind == runs[1].events.kind == ("touch-down", "stick")
    assert runs[0].states[-1] == pytest.approx(runs[1].states[-1], rel=1e-7, abs=1e-12)


def test_energy_to_round_off():
    run = simulate(impact_oscillator(2), 2.0, initial=np.zeros(4), solver=SERIES, rtol=1e-12)
    assert run.energies.growth < 1e-13
    assert run.work[-1] == pytest.approx(simulate(
        impact_oscillator(2), 2.0, initial=np.zeros(4), solver=STEPS, rtol=1e-10).work[-1],
        rel=1e-6, abs=1e-12)


def test_the_tolerance_holds_on_another_integrator():
    system = impact_oscillator(2)
    start = np.array([0.0, 0.0, -0.05, 0.0])
    own = simulate(system, 0.02, initial=start, solver=SERIES)
    other = simulate(system, 0.02, initial=start, solver=Scipy("LSODA"), rtol=1e-11)
    scale = np.abs(other.states).max(axis=0)
    assert (np.abs(own.states - other.states) / scale).max() < 1e-6


# Choice ------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("changes", "events", "said"), [
    ({"normal": ParabolicSurface(1e5, 1e-5)}, None, "ParabolicSurface is not piecewise polynomial"),
    ({"normal": PowerContact(1e5, 1.5)}, None, "PowerContact is not piecewise polynomial"),
    ({"friction": ConstantFriction(0.3)}, None, "there is friction"),
    ({"ground": fc.Ground(speed=1.0, amplitude=1e-6, wavelength=0.1)}, None, "the ground is wavy"),
    ({"load": Load(forces=(PointLoad("C", "y", signal=Step(0.1, 1.0)),))}, None, "Step is neither"),
    ({}, Crossing(0, "y"), "events other than ContactEvents"),
    ({"ground": fc.Ground(speed=1.0)}, ContactEvents(),
     "ContactEvents are located in them only where contact nodes do not slide"),
])
def test_what_series_are_not_for(changes, events, said):
    system = oscillator(**changes)
    options = {"initial": np.zeros(4), "outputs": 11, "events": events}
    with pytest.raises(InputError, match=rf"PowerSeries\(\) is for .* but {said}.*take Auto\(\)"):
        simulate(system, 0.01, **options, solver=SERIES)
    taken, steps = (simulate(system, 0.01, **options, solver=solver)
                    for solver in (Rodas5P(), STEPS))
    assert (taken.states == steps.states).all()
    assert "jacobians" in taken.statistics


def test_when_they_are_taken():
    def takes(system):
        run = driver.start(system, np.zeros(system.size), np.array([0.0, 1.0]), rtol=1e-6)
        return run.series is not None

    assert takes(impact_oscillator(1))
    assert takes(impact_oscillator(2))
    assert not takes(friction_oscillator())
    count = MOST_MODES + 1
    assert not takes(oscillator(np.linspace(10.0, 90.0, count), np.zeros(count), np.ones(count)))
    # A mode that need not be resolved is left to implicit steps.
    assert not takes(oscillator((10.0, 3e3), (0.0, 0.9)))
    assert takes(oscillator((10.0, 3e3), (0.0, 0.01)))
    assert not takes(oscillator((10.0, 1e4), (0.0, 0.01)))


def test_ensembles_and_derivatives():
    systems = [impact_oscillator(2, w) for w in (20.0, 64.32)]
    times = np.linspace(0.0, 0.5, 6)
    found = {use: fc.ensemble(systems, times, initial=np.zeros(4), solver=solver,
                              rtol=1e-9) for use, solver in SOLVERS.items()}
    assert (found["auto"].states == found["power-series"].states).all()
    assert found["auto"].states == pytest.approx(found["rodas5p"].states, rel=1e-5, abs=1e-8)
    assert (found["auto"].steps < found["rodas5p"].steps).all()
    run = driver.start(systems[0], np.zeros(4), times, rtol=1e-6, vary=True)
    assert run.series is None


@pytest.mark.parametrize(("modes", "nodes"), SMALL.sizes)
def test_what_small_systems_take_for_granted(modes, nodes):
    rng = np.random.default_rng(modes)
    system = oscillator(np.linspace(5.0, 300.0, modes), np.full(modes, 0.01),
                        rng.normal(size=(nodes, modes)), load=Load(1.0))
    state = 1e-3 * rng.normal(size=2 * modes)
    runs = [driver.start(system, state, np.linspace(0.0, 0.2, 11), rtol=1e-8, method="power-series")
            for _ in range(2)]
    said = SMALL.values(modes, nodes)
    for values in (runs[0].problem, runs[0].progress, runs[0].output, runs[0].watch,
                   runs[0].series):
        for field, expected in said.get(type(values), {}).items():
            value = getattr(values, field)
            if isinstance(expected, tuple):
                for length, wanted in zip(value.shape, expected, strict=True):
                    assert wanted in (length, None), field
            else:
                assert value == expected, field
    own = runs[0]
    progressed(own, 10**9)
    general = runs[1]
    advance(Data(general.problem, general.progress, general.output, general.kept, general.watch,
                 general.series), 10**9)
    assert own.states == pytest.approx(general.states, rel=1e-9, abs=1e-14)
