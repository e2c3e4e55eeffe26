"""Set-valued runs miss no change of contact, whatever the length of their steps."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from set_valued_runs import integrate_set_valued
from systems import TURN

import fecontact as fc
from fecontact import Status
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    Harmonic,
    HarmonicSpeed,
    HyperbolicFriction,
    LinearContact,
    PrescribedForce,
    RoughSurface,
)

SIDEWAYS, UPWARDS = [[1.0], [0.0], [0.0]], [[0.0], [1.0], [0.0]]


def mass(row, spring=1.0, dashpot=0.0, **parts):
    """A mass of 1 kg that moves in one direction."""
    basis = fc.basis_from_matrices([[1.0]], [[spring]], {"contact": [row], "B": row, "C": row},
                                   damping=[[dashpot]])
    return fc.ContactSystem(basis, **{"normal": RoughSurface(0.3e6, 5.2e-6, 6.0), **parts})


def bouncing(start, e, times):
    """Displacement of x'' + x = 0 on a stop at -1, its impact times and speeds."""
    moment, speed = np.arccos(-1.0 / start), np.sqrt(start**2 - 1.0)
    x, moments, speeds = start * np.cos(times), [], []
    while moment < times[-1]:
        moments.append(moment)
        speeds.append(speed)
        speed *= e
        late = times > moment
        x[late] = -np.cos(times[late] - moment) + speed * np.sin(times[late] - moment)
        # The circle through -1 without the arc beyond it.
        moment += 2.0 * np.pi - 2.0 * np.arctan(speed)
    return x, moments, speeds


@pytest.mark.parametrize("end", [20.0, 100.0, 1000.0])
def test_all_impacts_are_found(end):
    system = mass(UPWARDS, gap=1.0)
    times = np.linspace(0.0, end, 2001)
    run = integrate_set_valued(system, np.array([1.01, 0.0]), times, rtol=1e-11, restitution=0.5)
    x, _, speeds = bouncing(1.01, 0.5, times)
    assert sum(speed > 1e-4 for speed in speeds) == (3 if end == 20.0 else 11)
    assert run.status is Status.FINISHED
    # Those that pass less than 1e-9 m deep are below the error of the steps.
    felt = sum(0.5 * speed**2 > 1e-9 for speed in speeds)
    # An approach within rounding of the largest speed is no impact.
    assert felt <= run.statistics["impacts"] <= sum(speed > 1e-16 for speed in speeds)
    # An impact at 1e-5 m/s left out shifts the phase by twice that.
    assert run.states[:, 0] == pytest.approx(x, abs=3e-4)
    assert run.states[times <= 60.0, 0] == pytest.approx(x[times <= 60.0], abs=1e-8)


def test_impacts_of_many_random_starts():
    rng = np.random.default_rng(3)
    system = mass(UPWARDS, gap=1.0)
    for _ in range(60):
        start, e, end = rng.uniform(1.0005, 1.2), rng.uniform(0.3, 0.9), rng.uniform(20.0, 400.0)
        times = np.linspace(0.0, end, 50)
        run = integrate_set_valued(system, np.array([start, 0.0]), times, rtol=1e-10, restitution=e)
        x, moments, speeds = bouncing(start, e, times)
        assert run.statistics["impacts"] >= sum(speed > 1e-3 for speed in speeds)
        clear = times < max(t for t, speed in zip(moments, speeds, strict=True) if speed > 1e-3)
        assert run.states[clear, 0] == pytest.approx(x[clear], abs=1e-5)


def test_a_soft_contact_between_the_stages_is_felt():
    """A spring of 1e6 N/m, touched for some milliseconds within steps of seconds."""
    system = mass(UPWARDS, normal=LinearContact(1e6), friction=ConstantFriction(0.0), gap=1.0)
    for end in (20.0, 200.0):
        times = np.linspace(0.0, end, 401)
        run = integrate_set_valued(system, np.array([1.001, 0.0]), times, rtol=1e-9)
        # Down to -1, then a short arc about where both springs balance, then the same way back.
        speed, w = np.sqrt(1.001**2 - 1.0), np.sqrt(1.0 + 1e6)
        touch = np.arccos(-1.0 / 1.001)
        rest = -1e6 / (1.0 + 1e6)
        contact = 2.0 / w * (0.5 * np.pi - np.arctan((rest + 1.0) * w / speed))
        since = np.mod(times, 2.0 * touch + contact)
        x = np.where(since < touch, 1.001 * np.cos(since),
                     1.001 * np.cos(since - 2.0 * touch - contact))
        within = (since > touch) & (since < touch + contact)
        x[within] = (rest - (1.0 + rest) * np.cos(w * (since[within] - touch))
                     - speed / w * np.sin(w * (since[within] - touch)))
        assert run.states[:, 0] == pytest.approx(x, abs=1e-5)
        assert run.normal_force.min() >= 0.0


V = 1.8364


def falling(v):
    return 0.5 * (1.0 + np.exp(-2.0 * np.abs(v)))


def belt_reference(state, speed, times, dashpot=0.1, coefficient=falling):
    """Displacements of x'' + d x' + x = mu (V - x') from phase to phase, events located."""
    t, y, phase = 0.0, np.array(state), -1.0 if state[1] <= speed(0.0) else 1.0
    found = np.empty(len(times))
    if abs(y[1] - speed(0.0)) < 1e-14:
        phase = 0.0
    limit = coefficient(0.0)
    changes = []
    while t < times[-1]:
        rate = (speed(t + 1e-6) - speed(t - 1e-6)) / 2e-6
        pull = -dashpot * y[1] - y[0] - rate
        if phase == 0.0 and abs(pull) > limit * (1.0 + 1e-12):
            phase = np.sign(pull)
        if phase == 0.0:
            def rhs(t, y):
                return [speed(t), (speed(t + 1e-6) - speed(t - 1e-6)) / 2e-6]

            def event(t, y):
                rate = (speed(t + 1e-6) - speed(t - 1e-6)) / 2e-6
                return limit - abs(-dashpot * y[1] - y[0] - rate)
        else:
            def rhs(t, y, phase=phase):
                return [y[1], -dashpot * y[1] - y[0] - phase * coefficient(y[1] - speed(t))]

            def event(t, y, phase=phase, begin=t):
                return 1.0 if t < begin + 1e-5 else phase * (y[1] - speed(t))
        event.terminal, event.direction = True, -1.0
        result = solve_ivp(rhs, (t, times[-1]), y, method="DOP853", rtol=1e-12, atol=1e-13,
                           events=event, max_step=0.02, dense_output=True)
        here = (times >= t) & (times <= result.t[-1])
        if here.any():
            found[here] = result.sol(times[here])[0]
        t, y = result.t[-1], result.y[:, -1]
        if t < times[-1]:
            changes.append(t)
            y[1] = speed(t)
            pull = -dashpot * y[1] - y[0] - (speed(t + 1e-6) - speed(t - 1e-6)) / 2e-6
            phase = 0.0 if phase != 0.0 and abs(pull) <= limit else np.sign(pull)
    return found, changes


def belt(**parts):
    return mass(SIDEWAYS, dashpot=0.1, normal=PrescribedForce(1.0),
                friction=ExponentialFriction(1.0, 0.5, 2.0), **parts)


@pytest.mark.parametrize(("method", "rtol", "tolerance"), [
    ("event-driven", 1e-10, 1e-8), ("time-stepping", 1e-7, 1e-4)])
@pytest.mark.parametrize("end", [20.0, 60.0])
def test_a_short_reversal_of_slip(method, rtol, tolerance, end):
    """The slip velocity comes up to zero within a step, to 1.3e-4 m/s beyond it without stick."""
    times = np.linspace(0.0, 20.0, 101)
    wanted, changes = belt_reference([1.0 - 0.1 * V, V], lambda t: V, times)
    run = integrate_set_valued(belt(ground=fc.Ground(speed=V)), np.array([1.0 - 0.1 * V, V]),
                               np.append(times, end + 1.0), rtol=rtol, method=method)
    assert run.states[:-1, 0] == pytest.approx(wanted, abs=tolerance)
    assert len(changes) > 3


def test_friction_from_many_random_starts():
    rng = np.random.default_rng(5)
    times = np.linspace(0.0, 15.0, 16)
    for _ in range(6):
        speed, x, rate = rng.uniform(0.2, 2.0), rng.uniform(-1.5, 1.5), rng.uniform(-1.0, 1.0)
        wanted, _ = belt_reference([x, rate], lambda t, speed=speed: speed, times)
        for end in (16.0, 160.0):
            run = integrate_set_valued(belt(ground=fc.Ground(speed=speed)), np.array([x, rate]),
                                       np.append(times, end), rtol=1e-10)
            assert run.states[:-1, 0] == pytest.approx(wanted, abs=1e-7)


def test_a_belt_of_changing_speed():
    motion = HarmonicSpeed(0.5, 3.0 / TURN)
    times = np.linspace(0.0, 6.0, 31)
    wanted, changes = belt_reference([0.3, 0.0], lambda t: 0.6 + 0.5 * np.sin(3.0 * t), times)
    assert len(changes) >= 2
    for end in (16.0, 800.0):
        run = integrate_set_valued(belt(ground=fc.Ground(speed=0.6, motion=motion)),
                                   np.array([0.3, 0.0]), np.append(times, end), rtol=1e-10)
        assert run.states[:-1, 0] == pytest.approx(wanted, abs=1e-7)


def test_stick_let_go_for_a_moment():
    """A force that passes the limit of stick for less than a hundredth of its period."""
    for excess in (1e-3, 1e-4, 1e-5):
        system = mass(SIDEWAYS, spring=0.5, normal=PrescribedForce(1.0),
                      friction=ConstantFriction(0.4), drive=fc.Drive(
                          stiffness_x=0.5, amplitude_x=0.8 * (1.0 + excess),
                          frequency_hz=1.5 / TURN))
        run = integrate_set_valued(system, np.zeros(2), np.linspace(0.0, 20.0 * np.pi / 1.5, 201),
                                   rtol=1e-9)
        # Slip begins and ends once in each of the 20 half-periods.
        assert run.statistics["events"] == 40


def test_a_stop_let_go_for_a_moment():
    """A load that lifts a mass off its stop for some hundredths of its period; it does not bounce.

    Up where the load passes the weight, down where the parabola about that moment ends:
    y'' = A (sin(w t) - 1 / (1 + excess)) with a balance of impulses over three times that way.
    """
    for excess in (1e-3, 1e-4):
        system = mass(UPWARDS, spring=1e-9, load=fc.Load(1.0, (fc.PointLoad(
            "C", "y", signal=Harmonic(1.0 + excess, 2.0 / TURN)),)))
        run = integrate_set_valued(system, np.zeros(2), np.linspace(0.0, 10.0 * np.pi, 201),
                                   rtol=1e-9, restitution=0.0)
        assert run.statistics["impacts"] == 10
        assert run.statistics["events"] == 20


def test_impacts_on_passing_waves():
    """A mass thrown onto waves that pass below it, against impacts located by solve_ivp."""
    amplitude, length, speed, e = 0.02, 0.5, 0.3, 0.4
    system = mass(UPWARDS, load=fc.Load(3.0), ground=fc.Ground(
        speed=speed, amplitude=amplitude, wavelength=length))
    k = 2.0 * np.pi / length
    times = np.linspace(0.0, 4.0, 81)
    t, y, found, impacts = 0.0, np.array([0.5, 0.0]), np.empty(len(times)), 0

    def above(t, y):
        return y[0] - amplitude * np.sin(-k * speed * t)

    above.terminal, above.direction = True, -1.0
    # Up to the sixth; then they come ever faster, until the mass rests on the waves.
    while impacts < 6:
        result = solve_ivp(lambda t, y: [y[1], -y[0] - 3.0], (t, times[-1]), y, method="DOP853",
                           rtol=1e-12, atol=1e-14, events=above, max_step=0.01, dense_output=True)
        here = (times >= t) & (times <= result.t[-1])
        if here.any():
            found[here] = result.sol(times[here])[0]
        t, y = result.t[-1], result.y[:, -1]
        ground = -k * speed * amplitude * np.cos(-k * speed * t)
        y[1] = ground - e * (y[1] - ground)
        # Beyond the rounding of the touch itself.
        t, y = t + 1e-7, y + 1e-7 * np.array([y[1], -y[0] - 3.0])
        impacts += 1
    before = times < t - 1e-6
    times, found = times[before], found[before]
    for end in (5.0, 40.0):
        run = integrate_set_valued(system, np.array([0.5, 0.0]), np.append(times, end), rtol=1e-11,
                                   restitution=e)
        assert run.states[:-1, 0] == pytest.approx(found, abs=1e-5)


def test_two_events_in_a_period_of_stick_and_slip():
    system = mass(SIDEWAYS, normal=PrescribedForce(1.0), ground=fc.Ground(speed=0.2),
                  friction=HyperbolicFriction(1.0, 0.0, 1.0 / 3.0))
    for rtol in (1e-4, 1e-6, 1e-8, 1e-11):
        run = integrate_set_valued(system, np.array([0.5, 0.2]), np.linspace(0.0, 240.0, 3),
                                   rtol=rtol)
        # Of the period 12.001 s, from the middle of stick.
        assert run.statistics["events"] == 40
