"""Derivatives of motions and orbits whose normal forces jump at touch-down."""

import numpy as np
import pytest
from spectra import spectral_distance
from systems import TURN, mass_in_plane

from fecontact import (
    ContactSystem,
    Drive,
    Ground,
    Load,
    basis_from_matrices,
    sensitivity,
    simulate,
)
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    Shooting,
    contact_field,
    lyapunov_exponents,
    orbit_branch,
)
from fecontact.integrate import ContactEvents, Rodas5P
from fecontact.integrate.jumping_nodes import jumping_nodes
from fecontact.laws import (
    ConstantFriction,
    LinearContact,
    PowerContact,
    RoughSurface,
    Sine,
    TwoSidedStop,
)

W = 90.0
T = 2.0 * np.pi / W
DAMPED = LinearContact(2e4, 20.0)
NEVER = Rodas5P()
START = np.array([5e-3, 0.0, 0.0, 0.0])


def driven(normal=DAMPED, amplitude=1.5e-2, **parts):
    return mass_in_plane(
        spring=1e3, normal=normal, friction=ConstantFriction(0.3, smoothing_slope=1e2),
        drive=Drive(stiffness_x=5e3, damping_x=30.0, stiffness_y=2e3, damping_y=30.0,
                    amplitude_y=amplitude, amplitude_x=1e-4, frequency_hz=W / TURN),
        load=Load(14.0), **{"ground": Ground(speed=0.02), **parts})


def end(system, state):
    return simulate(system, T, initial=state, outputs=2, rtol=1e-12).states[-1]


def differences(system, state, move=1e-7):
    return np.stack([(end(system, state + move * one) - end(system, state - move * one)) / (
        2.0 * move) for one in np.eye(len(state))], axis=1)


def off(found, wanted):
    return np.abs(found - wanted).max() / np.abs(wanted).max()


@pytest.mark.parametrize("outputs", [2, 6])
@pytest.mark.parametrize(("ground", "settings", "relative"), [
    (Ground(speed=0.02), {"solver": NEVER}, 1e-7),
    (Ground(speed=0.02), {"rtol": 1e-6}, 1e-4),
    (Ground(speed=0.02), {}, 1e-7),
    (Ground(speed=0.02, profile=Sine(2e-4, 5e-2)), {}, 1e-6),
], ids=["Rodas5P", "coarse", "collocation", "waves"])
def test_touch_down_on_a_dashpot(ground, settings, relative, outputs):
    system = driven(ground=ground)
    found = sensitivity(system, T, initial=START, outputs=outputs, **settings)
    assert found.states.shape == (outputs, 4)
    assert off(found.monodromy, differences(system, START)) < relative


def test_touch_downs_of_several_nodes():
    """Six modes and three nodes are too many for steps by collocation."""
    random = np.random.default_rng(3)
    rows = np.zeros((5, 3, 6))
    rows[:, :2] = 0.3 * random.normal(size=(5, 2, 6))
    rows[:, 1, 0] = 1.0
    modes = basis_from_matrices(
        np.eye(6), np.diag([0.0, 2e3, 5e3, 2e4, 4e4, 7e4]),
        {"contact": rows[:3], "B": rows[3], "C": rows[4]}, damping=np.diag([1.0, 2, 3, 4, 5, 6]))
    system = ContactSystem(modes, normal=LinearContact(2e4, 30.0),
                           friction=ConstantFriction(0.3, smoothing_slope=1e2),
                           ground=Ground(speed=0.05), load=Load(20.0))
    start = np.concatenate([[1e-3], np.zeros(5), [-0.1], np.zeros(5)])
    run = simulate(system, T, initial=start, outputs=2, rtol=1e-10, events=[ContactEvents()])
    assert run.events.kind.count("touch-down") >= 3
    found = sensitivity(system, T, initial=start, rtol=1e-10)
    assert off(found.monodromy, differences(system, start)) < 1e-5


@pytest.mark.parametrize("settings", [{"solver": NEVER}, {}], ids=["Rodas5P", "collocation"])
def test_touch_down_beside_a_law_with_more_levels(settings):
    """Forces of stops begin at two penetrations, that of a spring with a dashpot at one."""
    rows = np.zeros((3, 3, 2))
    rows[:, 1] = [1.0, 0.3], [0.2, 1.0], [1.0, 0.0]
    modes = basis_from_matrices(
        np.eye(2), np.diag([1e3, 2e3]),
        {"contact": {"floor": rows[:1], "stops": rows[1:2]}, "B": rows[2], "C": rows[2]},
        damping=np.eye(2))
    system = ContactSystem(modes, normal={"floor": DAMPED, "stops": TwoSidedStop(1e4, 1e-2)},
                           friction=ConstantFriction(0.0))
    start = np.array([5e-3, 1e-3, -0.1, 0.05])
    run = simulate(system, T, initial=start, outputs=2, events=[ContactEvents()])
    assert "touch-down" in run.events.kind
    found = sensitivity(system, T, initial=start, **settings)
    assert off(found.monodromy, differences(system, start)) < 1e-7


@pytest.mark.parametrize("settings", [{"solver": NEVER}, {}], ids=["Rodas5P", "collocation"])
@pytest.mark.parametrize("gap", [0.0, 1e-6, 1e-3])
@pytest.mark.parametrize("normal", [DAMPED, LinearContact(2e4), RoughSurface(1e6, 1e-5, 20.0)],
                         ids=["jump", "kink", "rough"])
def test_derivative_to_a_gap(normal, gap, settings):
    """A gap has no size of its own where it is zero; the penetration scale is 5e-5 or 1e-5 m."""
    system = driven(normal, gap=gap)
    move = 1e-9
    below = gap - move if gap else 0.0
    ends = [end(system.with_(gap=one), START) for one in (gap + move, below)]
    wanted = (ends[0] - ends[1]) / (gap + move - below)
    found = sensitivity(system, T, initial=START, parameter="gap", rtol=1e-9, **settings)
    assert off(found.parameter_derivative, wanted) < 1e-3


@pytest.mark.parametrize("name", ["drive.amplitude_y", "normal.damping", "normal.stiffness"])
def test_derivative_to_other_parameters(name):
    system = driven()
    value = system.parameter(name)
    ends = [end(system.with_(**{name: value * (1.0 + by)}), START) for by in (1e-5, -1e-5)]
    found = sensitivity(system, T, initial=START, parameter=name, solver=NEVER)
    assert off(found.parameter_derivative, (ends[0] - ends[1]) / (2e-5 * value)) < 1e-6


@pytest.mark.parametrize(("normal", "jumps"), [
    (DAMPED, True), (LinearContact(2e4), False), (RoughSurface(1e6, 1e-5, 20.0), False),
    (TwoSidedStop(1e4, 1e-3, damping_factor=0.5), False), (PowerContact(1e9, 1.5, 1.0), False),
], ids=["dashpot", "spring", "rough", "stops", "Hunt-Crossley"])
def test_which_laws_jump(normal, jumps):
    assert jumping_nodes(driven(normal)).tolist() == [jumps]


def test_growth_over_one_interval():
    """Directions at the start are those of a fixed random matrix, made orthogonal."""
    system = driven()
    directions = np.linalg.qr(np.random.default_rng(0).normal(size=(4, 2)))[0]
    R = np.linalg.qr(differences(system, START) @ directions)[1]
    found = lyapunov_exponents(system, T, initial=START, interval=T, count=2, rtol=1e-9)
    assert found.history[-1] * T == pytest.approx(np.log(np.abs(np.diag(R))), abs=1e-5)


def branch_of(method, amplitude=1.5e-2, normal=DAMPED):
    system = driven(normal, amplitude)
    field = contact_field(system, "drive.amplitude_y")
    start = simulate(system, 200 * T, outputs=2).states[-1]
    run = simulate(system, T, initial=start, outputs=401)
    return system, orbit_branch(field, run, "drive.amplitude_y", method=method,
                                options=ContinuationOptions(points=4),
                                bounds=(0.99 * amplitude, 1.01 * amplitude))


def test_multipliers_by_shooting():
    system, branch = branch_of(Shooting())
    assert "jumps" not in branch.message
    point = branch.points[0]
    system = system.with_(**{"drive.amplitude_y": point.parameter})
    wanted = np.linalg.eigvals(differences(system, point.u[:4]))
    assert spectral_distance(point.values["multipliers"], wanted) < 1e-5


@pytest.mark.parametrize("method", [Collocation(), HarmonicBalance(40)])
def test_multipliers_that_miss_jumps_are_named(method):
    _, branch = branch_of(method)
    count = len(branch.points)
    assert (f"The multipliers of {count} of {count} orbits miss jumps of the normal force at "
            f"touch-down, as of LinearContact with damping, and so do their stability and special "
            f"points: follow them with method = Shooting().") in branch.message


@pytest.mark.parametrize("method", [Collocation(), HarmonicBalance(9)])
@pytest.mark.parametrize(("amplitude", "normal"), [(1e-3, DAMPED), (1.5e-2, LinearContact(2e4))],
                         ids=["closed", "no dashpot"])
def test_nothing_is_said_where_nothing_jumps(method, amplitude, normal):
    _, branch = branch_of(method, amplitude, normal)
    assert "jumps" not in branch.message
