"""Set-valued friction and rigid stops against closed forms and published values."""

import numpy as np
import pytest
from set_valued_runs import integrate_set_valued
from systems import TURN, friction_oscillator

from fecontact import (
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    PointLoad,
    Status,
    Trajectory,
    basis_from_matrices,
    equilibrium,
    simulate,
)
from fecontact.integrate import EventDriven, SetValued, TimeStepping, smoothing_cost
from fecontact.integrate.nonsmooth import driver
from fecontact.laws import (
    Constant,
    ConstantFriction,
    ExponentialFriction,
    Frictionless,
    HyperbolicFriction,
    LinearContact,
    LuGreFriction,
    PrescribedForce,
    RoughSurface,
    SpeedRamp,
)
from fecontact.system.powers import CONTACT_DAMPING, FRICTION, LOAD

BOTH = pytest.mark.parametrize(("method", "rtol", "tolerance"), [
    ("event-driven", 1e-11, 1e-11), ("time-stepping", 1e-6, 2e-6)])


def block(mass=1.0, spring=1.0, nodes=1, **parts):
    """A mass that moves along the ground and up and down, on some nodes at one place."""
    row = np.zeros((3, 2))
    row[0, 0] = row[1, 1] = 1.0
    basis = basis_from_matrices(
        mass * np.eye(2), np.diag([spring, 0.0]),
        {"contact": np.repeat(row[None], nodes, axis=0), "B": row, "C": row})
    return ContactSystem(basis, **{"normal": RoughSurface(1e5, 1e-4, 0.0),
                                   "friction": ExponentialFriction(0.8, 0.55, 1e3), **parts})


def start(system, x, x_rate=0.0):
    T = system.basis.T[2, :2]
    return np.concatenate([equilibrium(system).modal_coordinates + np.linalg.solve(T, [x, 0.0]),
                           np.linalg.solve(T, [x_rate, 0.0])])


def along(system, run):
    """Displacement and velocity along the ground of contact node 0."""
    m = system.basis.modes
    return run.states[:, :m] @ system.basis.T[2, 0], run.states[:, m:] @ system.basis.T[2, 0]


def imbalance(system, run):
    m = system.basis.modes
    return Trajectory(system, run.time, run.states[:, :m], run.states[:, m:],
                      run.work).energies.imbalance


def period(system, run, place):
    """Times between passages of a place while it sticks to the ground, where x is V t + const."""
    x, rate = along(system, run)
    V = system.ground.speed
    resting = np.abs(rate - V) < 1e-7 * V
    passing = np.flatnonzero(resting[:-1] & resting[1:] & (x[:-1] < place) & (x[1:] >= place))
    return np.diff(run.time[passing] + (place - x[passing]) / V)


@BOTH
@pytest.mark.parametrize("nodes", [1, 3])
def test_coulomb_decay(nodes, method, rtol, tolerance):
    """Code_Aster SDND100; equal nodes share the force in proportion to their limits."""
    system = block(1.0, 1e4, nodes, friction=ConstantFriction(0.5), load=Load(2.0))
    times = np.pi / 100.0 * np.arange(7)
    run = integrate_set_valued(system, start(system, 0.85e-3), times, rtol=rtol, method=method)
    assert run.status is Status.FINISHED
    x, rate = along(system, run)
    assert x == pytest.approx(1e-3 * np.array([0.85, -0.65, 0.45, -0.25, 0.05, 0.05, 0.05]),
                              abs=tolerance * 1e-3)
    assert rate[-1] == pytest.approx(0.0, abs=1e-12)
    # Stuck: friction is what the spring wants, not what it could be.
    assert run.friction_force[-1] == pytest.approx(-0.5 / nodes, rel=5e-5)
    assert run.work[-1, FRICTION] == pytest.approx(0.5e4 * (0.85e-3**2 - 0.05e-3**2), rel=1e-5)
    assert run.node_friction_work[-1] == pytest.approx(run.work[-1, FRICTION] / nodes, rel=1e-9)
    assert imbalance(system, run) < max(1e3 * tolerance * 1e-3, 1e-9)


@BOTH
def test_belt_with_falling_friction(method, rtol, tolerance):
    """Leine's oscillator."""
    system = block(friction=HyperbolicFriction(1.0, 0.0, 1.0 / 3.0), load=Load(1.0),
                   ground=Ground(speed=0.2))
    run = integrate_set_valued(system, start(system, 0.5, 0.2), np.linspace(0.0, 40.0, 8001),
                               rtol=rtol, method=method)
    assert period(system, run, 0.5) == pytest.approx(
        12.0010312948, rel=1e-9 if method == "event-driven" else 1e-4)
    assert along(system, run)[0].max() == pytest.approx(1.1339446764, rel=1e-5)
    assert imbalance(system, run) < 1e-5


def test_output_times_of_any_layout():
    system = block(spring=1e4, friction=ConstantFriction(0.5), load=Load(2.0))
    state, times = start(system, 0.85e-3), np.linspace(0.0, 0.1, 11)
    run = integrate_set_valued(system, state, times[::2])
    assert (run.states == integrate_set_valued(system, state, times[::2].copy()).states).all()


def test_belt_with_a_jump_from_static_to_kinetic_friction():
    system = block(friction=ConstantFriction(0.5), load=Load(1.0), ground=Ground(speed=0.2))
    run = integrate_set_valued(system, start(system, 0.5, 0.2), np.linspace(0.0, 40.0, 40001),
                               rtol=1e-11, static_coefficient=1.0)
    # Stick for 1 / V; slip back to where the circle about x = 1/2 has the speed V again.
    exact = 5.0 + 2.0 * np.pi - 2.0 * np.arctan(2.5)
    assert exact == pytest.approx(8.902605414, abs=1e-8)
    assert period(system, run, 0.5) == pytest.approx(exact, rel=5e-9)
    assert along(system, run)[0].max() == pytest.approx(1.038516481, abs=1e-7)
    assert imbalance(system, run) < 1e-9


def test_friction_oscillator_without_excitation():
    system = friction_oscillator(2, **{"drive.amplitude_x": 0.0})
    run = integrate_set_valued(system, start(system, 0.0), np.linspace(0.0, 8.0, 8001), rtol=1e-10)
    assert period(system, run, 1.5e-3) == pytest.approx(1.361213293, rel=1e-9)
    x, rate = along(system, run)
    late = run.time > 4.0
    assert x[late].min() == pytest.approx(0.74580e-3, abs=2e-8)
    assert x[late].max() == pytest.approx(2.00476e-3, abs=1e-8)
    resting = np.abs(rate - 1e-3) < 1e-12
    begin = np.flatnonzero(~resting[:-1] & resting[1:]) + 1
    end = np.flatnonzero(resting[:-1] & ~resting[1:])
    leaving = run.time[end] + (1.9962980e-3 - x[end]) / 1e-3
    for row in begin[1:]:
        arriving = run.time[row] - (x[row] - 0.7462635e-3) / 1e-3
        slip = arriving - leaving[leaving < arriving][-1]
        # The places of leaving and arriving are given to 5e-11 m.
        assert slip == pytest.approx(0.1111787754, abs=1e-7)


def den_hartog(beta, ratio, periods, **options):
    """Coulomb friction beta against a force cos(w t), both over the spring's stiffness."""
    system = block(friction=ConstantFriction(beta), load=Load(1.0),
                   drive=Drive(stiffness_x=0.5, amplitude_x=2.0, frequency_hz=ratio / TURN),
                   spring=0.5)
    times = np.linspace(0.0, periods * 2.0 * np.pi / ratio, 400 * periods + 1)
    run = integrate_set_valued(system, start(system, 0.0), times, **options)
    x, rate = along(system, run)
    return x[-801:], rate[-801:]


@pytest.mark.parametrize(("ratio", "beta", "amplitude", "periods"), [
    (0.8, 0.2, 2.7114152554, 120), (0.8, 0.4, 2.5017878810, 80), (0.9, 0.4, 4.6203419164, 120),
    (1.25, 0.4, 1.4800496969, 120), (1.5, 0.2, 0.7659416862, 200), (1.5, 0.6, 0.4, 100)])
def test_den_hartog(ratio, beta, amplitude, periods):
    x, _ = den_hartog(beta, ratio, periods, rtol=1e-9)
    assert 0.5 * np.ptp(x) == pytest.approx(amplitude, rel=2e-4)


@pytest.mark.long
@pytest.mark.parametrize(("ratio", "limit"), [(0.8, 0.8174063857), (1.5, 0.6465790873)])
def test_den_hartog_stops(ratio, limit):
    for beta, stops in ((limit - 0.004, False), (limit + 0.004, True)):
        _, rate = den_hartog(beta, ratio, 150, rtol=1e-9)
        assert (np.abs(rate) < 1e-12).any() == stops


@BOTH
def test_two_independent_nodes_against_two_single_masses(method, rtol, tolerance):
    """Uncoupled masses on one belt, sticking and slipping each for itself."""
    single = [block(mass, spring, friction=ConstantFriction(0.5), load=Load(2.0),
                    ground=Ground(speed=0.02)) for mass, spring in ((1.0, 100.0), (2.0, 300.0))]
    rows = np.zeros((2, 3, 4))
    rows[0, 0, 0] = rows[0, 1, 1] = rows[1, 0, 2] = rows[1, 1, 3] = 1.0
    basis = basis_from_matrices(np.diag([1.0, 1.0, 2.0, 2.0]),
                                np.diag([100.0, 0.0, 300.0, 0.0]),
                                {"contact": rows, "C": rows[0] + rows[1]})
    both = ContactSystem(basis, normal=RoughSurface((1e5, 1e5), 1e-4, 0.0), load=Load(2.0),
                         friction=ConstantFriction(0.5), ground=Ground(speed=0.02))
    times = np.linspace(0.0, 2.0, 401)
    expected = np.array([along(one, integrate_set_valued(one, start(one, 0.03), times,
                                                         rtol=1e-11))[0] for one in single])
    T = basis.T[2:, :2].reshape(4, 4)
    depth = [(one.basis.T[2, :2] @ equilibrium(one).modal_coordinates)[1] for one in single]
    state = np.concatenate([np.linalg.solve(T, [0.03, depth[0], 0.03, depth[1]]), np.zeros(4)])
    run = integrate_set_valued(both, state, times, rtol=rtol, method=method)
    found = (run.states[:, :4] @ basis.T[2:, 0].T).T
    assert np.abs(found - expected).max() < (1e-9 if method == "event-driven" else 1e-3) * 0.03


@pytest.mark.parametrize(("method", "longest", "order"), [
    ("event-driven", 0.6, 8), ("time-stepping", 0.1, 3)])
def test_order_while_nothing_changes(method, longest, order, monkeypatch):
    """Sliding all the time under a driven spring; linear, with a closed form."""
    row = [[1.0], [0.0], [0.0]]
    basis = basis_from_matrices([[1.0]], [[0.5]], {"contact": [row], "B": row, "C": row})
    system = ContactSystem(basis, normal=PrescribedForce(1.0), friction=ConstantFriction(0.5),
                           ground=Ground(speed=50.0), drive=Drive(
                               stiffness_x=0.5, amplitude_x=1.0, frequency_hz=2.0 / TURN))
    end, errors = 12.0, []
    state = np.array([0.5, 0.0])
    for part in (1.0, 0.5, 0.25):
        monkeypatch.setattr(driver, "longest_step", lambda *of, most=part * longest:
                            most if len(of) == 3 else np.inf)
        run = integrate_set_valued(system, state, np.array([0.0, end]), rtol=1e-2, method=method)
        # x'' + x = 1/2 + sin(2 t) / 2 from x = 1/2 at rest.
        errors.append(abs(run.states[-1, 0]
                          - (0.5 + np.sin(end) / 3.0 - np.sin(2.0 * end) / 6.0)))
    found = np.log2(np.array(errors[:-1]) / errors[1:])
    assert found[-1] == pytest.approx(order, abs=0.5)


def ball(**parts):
    row = np.array([[0.0], [1.0], [0.0]])
    return ContactSystem(basis_from_matrices([[1.0]], [[0.0]],
                                             {"contact": row[None], "C": row}),
                         RoughSurface(1e5, 1e-4),
                         **{"friction": ExponentialFriction(0.8, 0.55, 1e3), **parts})


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.6, 0.9])
def test_bouncing_ball(restitution):
    """From a height of 1 m with g = 10 m/s^2, until it rests after infinitely many impacts."""
    times = np.linspace(0.0, 10.0, 5001)
    system = ball(load=Load(10.0))
    run = integrate_set_valued(system, np.array([1.0, 0.0]), times, rtol=1e-10,
                               restitution=restitution)
    assert run.status is Status.FINISHED
    height = 1.0 - 5.0 * times**2
    moment, speed = np.sqrt(0.2), restitution * 10.0 * np.sqrt(0.2)
    for _ in range(400):
        since = times - moment
        height = np.where(since > 0.0, speed * since - 5.0 * since**2, height)
        moment, speed = moment + 0.2 * speed, restitution * speed
    assert moment == pytest.approx(np.sqrt(0.2) * (1 + restitution) / (1 - restitution), rel=1e-9)
    height[times >= moment] = 0.0
    assert run.states[:, 0] == pytest.approx(height, abs=1e-11)
    assert run.states[-1] == pytest.approx(0.0, abs=1e-15)
    assert run.normal_force[-1] == pytest.approx(10.0, rel=1e-12)
    assert run.work[-1, LOAD] == pytest.approx(10.0, rel=1e-12)
    assert run.work[-1, CONTACT_DAMPING] == pytest.approx(10.0, rel=1e-9)


def test_mass_lifted_off_a_rigid_stop():
    """A load a sin(w t) - F lifts it where a sin(w t) = F; until then the stop holds it."""
    row = np.array([[0.0], [1.0], [0.0]])
    basis = basis_from_matrices([[1.0]], [[1.0]], {"contact": row[None], "B": row, "C": row})
    system = ContactSystem(basis, RoughSurface(1e5, 1e-4), load=Load(1.0), drive=Drive(
        stiffness_y=1.0, amplitude_y=2.0, frequency_hz=0.5 / TURN),
        friction=ExponentialFriction(0.8, 0.55, 1e3))
    times = np.linspace(0.0, 2.0, 201)
    run = integrate_set_valued(system, np.zeros(2), times, rtol=1e-10, restitution=0.5)
    leaving = np.pi / 3.0
    resting = times < leaving
    assert run.normal_force[resting, 0] == pytest.approx(
        1.0 - 2.0 * np.sin(0.5 * times[resting]), abs=1e-10)
    # y'' + 2 y = 2 sin(t / 2) - 1 from rest at the moment of leaving.
    amplitude, since, w = 2.0 / 1.75, times[~resting] - leaving, np.sqrt(2.0)
    particular = amplitude * np.sin(0.5 * times[~resting]) - 0.5
    y = (particular - (amplitude * 0.5 - 0.5) * np.cos(w * since)
         - 0.5 * amplitude * np.cos(0.5 * leaving) / w * np.sin(w * since))
    assert run.states[~resting, 0] == pytest.approx(y, abs=1e-9)


def test_cost_of_smoothing():
    system = friction_oscillator(2)
    period = 2.0 * np.pi / 13.8
    cost = smoothing_cost(system, 20.0 * period, outputs=4001)
    assert cost.break_away == pytest.approx(0.8, rel=1e-9)
    assert cost.break_away_smoothed == pytest.approx(0.7775, abs=5e-4)
    assert cost.component == "x of B"
    assert 0.2 < cost.orbit_difference < 2.0
    assert cost.sentence.startswith("In the second half of 9.106 s friction without smoothing")
    assert cost.sentence.endswith(" F_N, not at 0.8 F_N.")
    finer = smoothing_cost(system.with_(**{"friction.smoothing_slope": 1e8}), 20.0 * period,
                           outputs=4001)
    assert finer.orbit_difference < 0.1 * cost.orbit_difference
    group = system.basis.groups[0][0]
    static = smoothing_cost(system, 2.0 * period, outputs=21,
                            solver=SetValued(static_coefficient={group: 0.9}))
    assert static.break_away == pytest.approx(0.9, rel=1e-12)


@pytest.mark.parametrize(("options", "message"), [
    ({"restitution": 1.5}, r"restitution = 1\.5"), ({"restitution": "hard"}, "= 'hard'"),
    ({"static_coefficient": -1.0}, "static_coefficient"),
    ({"static_coefficient": (1.0, 2.0)}, "1 contact nodes"),
])
def test_options_are_checked(options, message):
    system = block(friction=ConstantFriction(0.5), load=Load(1.0))
    with pytest.raises(InputError, match=message):
        simulate(system, 1.0, initial=start(system, 0.0), outputs=3, solver=SetValued(**options))


def test_plane_rigid_stops_are_not_for_time_stepping():
    system = block(friction=ConstantFriction(0.5), load=Load(1.0))
    with pytest.raises(InputError, match=r"TimeStepping\(\) has no rigid stops for plane bodies"):
        simulate(system, 1.0, initial=start(system, 0.0), solver=TimeStepping(restitution=0.5))


@pytest.mark.parametrize("solver", [EventDriven(), TimeStepping()])
def test_bodies_without_friction_swing_on(solver):
    """A mass on a spring that is pressed on a belt: cos(w t), whatever moves below it."""
    rows = [[1.0], [0.0], [0.0]]
    system = ContactSystem(
        basis_from_matrices([[1.0]], [[9.0]], {"contact": [rows]}), normal=PrescribedForce(10.0),
        friction=Frictionless(), ground=Ground(speed=0.5))
    run = simulate(system, 5.0, initial=[1.0, 0.0], outputs=51, rtol=1e-9,
                   solver=solver)
    assert run.states[:, 0] == pytest.approx(np.cos(3.0 * run.time), abs=1e-5)
    assert not run.friction_force.any()


def test_friction_with_memory_has_no_set_valued_limit():
    system = block(friction=LuGreFriction(0.8, 0.55, 1e-3, 2.0, 1e5))
    with pytest.raises(InputError, match="LuGreFriction has no smoothing_slope"):
        integrate_set_valued(system, np.zeros(4), np.linspace(0.0, 1.0, 3))


@pytest.mark.parametrize("method", ["event-driven", "time-stepping"])
def test_steps_end_where_the_speed_of_the_ground_has_a_kink(method):
    """Sticking to a belt that speeds up from 0.1 to 0.4 m/s, the block travels with it."""
    ramp = SpeedRamp(0.4, start=0.513, duration=0.2)
    system = block(friction=ConstantFriction(0.5), load=Load(10.0),
                   ground=Ground(speed=0.1, motion=ramp))
    times = np.linspace(0.0, 1.2, 13)
    run = integrate_set_valued(system, start(system, 0.0, 0.1), times, method=method, rtol=1e-6)
    x, rate = along(system, run)
    since = np.clip(times - 0.513, 0.0, 0.2)
    after = np.maximum(times - 0.713, 0.0)
    # The steps' tolerance leaves 1e-10; a step across the kink 3e-5.
    assert x == pytest.approx(0.1 * times + 0.75 * since**2 + 0.3 * after, abs=1e-9)
    assert rate == pytest.approx(0.1 + 1.5 * since, abs=1e-9)
    assert imbalance(system, run) < 1e-5


def test_from_rest_under_point_loads():
    """Ringing of a stiff contact after its onset shortens no steps once it has decayed."""
    row = np.zeros((3, 2))
    row[0, 0] = row[1, 1] = 1.0
    basis = basis_from_matrices(
        np.eye(2), np.diag([100.0, 1e4]), {"contact": row[None], "B": row, "C": row},
        damping=np.diag([1.0, 200.0]))
    parts = {"normal": LinearContact(1e8), "friction": ConstantFriction(0.3)}
    system = ContactSystem(basis, load=Load(0.0, (
        PointLoad("C", "y", signal=Constant(-14.0)), PointLoad("B", "x", signal=Constant(20.0)))),
                           **parts)
    # The same forces through springs so soft that they stay as they are.
    springs = ContactSystem(basis, drive=Drive(
        stiffness_x=1e-6, motion_x=Constant(2e7), stiffness_y=1e-6, motion_y=Constant(-1.4e7)),
                            **parts)
    times = np.linspace(0.0, 10.0, 101)
    run, other = (integrate_set_valued(each, np.zeros(4), times, method="time-stepping")
                  for each in (system, springs))
    assert run.status is Status.FINISHED
    assert run.statistics["steps"] < 1.5 * other.statistics["steps"]
    # Amplitudes from the onset down to a millionth, fading at 100 /s, at 200 steps a cycle.
    w = np.sqrt(1e8 + 1e4)
    cycles = np.log(1e6) / 100.0 * w / (2.0 * np.pi)
    assert run.statistics["steps"] < 200 * cycles
    sharp = integrate_set_valued(system, np.zeros(4), times, rtol=1e-10, method="event-driven")
    assert run.states[-1, :2] == pytest.approx(sharp.states[-1, :2], rel=1e-5)
    assert run.states[-1, 1] == pytest.approx(-14.0 / w**2, rel=1e-6)
