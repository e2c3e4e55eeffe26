"""Warnings and refusals of runs; CVODE; steep smoothing; wear."""

import numpy as np
import pytest
from systems import beam, friction_oscillator, impact_oscillator
from test_events import START, drop

from fecontact import (
    ContactSystem,
    Interface,
    Load,
    ModelWarning,
    PointLoad,
    RigidStart,
    Status,
    Trajectory,
    basis_from_matrices,
    equilibrium,
    simulate,
)
from fecontact.integrate import CVODE, EventDriven, initial_state, smoothing_cost
from fecontact.laws import (
    BilateralPolynomial,
    Constant,
    ConstantFriction,
    ExponentialFriction,
    LinearContact,
    NormalLaw,
    PrescribedForce,
    RoughSurface,
    normal_law,
)
from fecontact.reduction import PointPairing, point_masses
from fecontact.system.columns import POWERS
from fecontact.system.model_limits import limits_exceeded


def test_cvode_agrees():
    pytest.importorskip("sksundae")
    system = friction_oscillator(3)
    one = simulate(system, 1.0, outputs=201, rtol=1e-8)
    other = simulate(system, 1.0, outputs=201, solver=CVODE(), rtol=1e-9)
    assert other.status is Status.FINISHED
    size = np.abs(one.states).max(axis=0)
    assert (np.abs(one.states - other.states).max(axis=0) < 2e-4 * size + 1e-15).all()
    assert other.energies.imbalance < 1e-4
    assert other.statistics["solver"] == other.statistics["method"] == "cvode"


def test_cvode_drops_on_a_spring():
    pytest.importorskip("sksundae")
    run = simulate(drop(), 1.1, initial=START, outputs=[0.0, 1.0, 1.1], solver=CVODE(),
                   rtol=1e-9)
    assert run.states[1:, 0] == pytest.approx([-1.332162981855, -0.856394405035], rel=1e-6)


@pytest.mark.parametrize("slope", [1e7, 1e8, 1e9])
def test_steep_smoothing_approaches_set_valued_friction(slope):
    """Period of the belt oscillator: 1.361213293 s set-valued, less by what the smoothing costs."""
    system = friction_oscillator(
        2, **{"drive.amplitude_x": 0.0, "friction.smoothing_slope": slope})
    run = simulate(system, 5.0, outputs=50001)
    assert run.status is Status.FINISHED
    x = run.displacement(0)[:, 0]
    rises = np.flatnonzero((x[:-1] < 1.4e-3) & (x[1:] >= 1.4e-3))
    crossing = run.time[rises] + 1e-4 * (1.4e-3 - x[rises]) / (x[rises + 1] - x[rises])
    periods = np.diff(crossing)
    # Break-away falls by about (2 mu' / (pi k_s))^(1/2); the period with it.
    assert periods[1:] == pytest.approx(1.361213293, rel=0.08 * np.sqrt(1e6 / slope))
    assert run.energies.imbalance < 1e-4


def test_users_are_told_what_smoothing_costs():
    cost = smoothing_cost(friction_oscillator(2), 2.0 * np.pi / 13.8 * 20.0)
    assert cost.break_away == pytest.approx(0.8, rel=1e-6)
    v = np.logspace(-6.0, -3.0, 30001)
    curve = (0.25 * np.exp(-1e3 * v) + 0.55) * 2.0 / np.pi * np.arctan(1e6 * v)
    assert cost.break_away_smoothed == pytest.approx(curve.max(), rel=1e-6)
    assert cost.orbit_difference > 0.5


def test_options_of_set_valued_runs():
    system = friction_oscillator(2, **{"drive.amplitude_x": 0.0})
    run = simulate(system, 2.3, outputs=2301,
                   solver=EventDriven(static_coefficient=0.9))
    assert run.status is Status.FINISHED
    # The belt stretches the spring of 5610 N/m by 1 mm/s until the contact holds no longer.
    pull = np.abs(run.friction_force[:, 0]) / run.normal_force[:, 0]
    assert pull.max() == pytest.approx(0.9, rel=1e-3)
    assert run.time[np.argmax(pull)] == pytest.approx(0.9 * 14.0 / 5.61, rel=1e-3)
    assert run.statistics["solver"] == run.statistics["method"] == "event-driven"
    assert run.statistics["static_coefficient"] == 0.9


def test_a_deep_start_is_warned_of():
    system = impact_oscillator(2)
    with pytest.warns(UserWarning, match=r"0\.0033 m deep in the ground"):
        simulate(system, 1e-4, initial=np.array([-1e-3, 0.0, 0.0, 0.0]), outputs=2)
    simulate(system, 1e-4, initial=np.array([-1e-6, 0.0, 0.0, 0.0]), outputs=2)


def test_springs_and_prescribed_forces_have_no_depth_to_warn_of():
    """Nodes with a force that does not end are in nothing, beside a contact far from its limit."""
    rows = np.zeros((3, 3, 3))
    rows[:, 1] = np.eye(3)
    basis = basis_from_matrices(np.eye(3), np.eye(3), {"contact": {
        "spring": rows[:1], "pressed": rows[1:2], "open": rows[2:]}})
    system = ContactSystem(basis, normal={
        "spring": BilateralPolynomial(1e6), "pressed": PrescribedForce(1.0),
        "open": LinearContact(1e6)}, gap=np.array([0.0, 0.0, 1.0]))
    deep = np.array([-0.1, -0.1, 0.0, 0.0, 0.0, 0.0])
    simulate(system, 1e-6, initial=deep, outputs=2)
    deep[2] = -1.1
    with pytest.warns(UserWarning, match=r"0\.1 m deep in the ground, 1e\+05 times the 1e-06 m"):
        run = simulate(system, 1e-9, initial=deep, outputs=2)
    simulate(system, 2e-9, t_start=1e-9, initial=run, outputs=2)


def test_a_start_at_the_depth_of_the_load_is_none_to_warn_of():
    """A stiff linear contact under a high load is far beyond its scale, the depth under 1 N."""
    system = ContactSystem(
        bodies={"block": point_masses({"p": 1.0})},
        interfaces=[Interface("floor", PointPairing("block", "p"),
                              LinearContact(1e9), ConstantFriction(0.0))],
        load=Load(forces=(PointLoad("block.p", "y", signal=Constant(-1000.0)),)))
    rest = initial_state(system, "rest", 0.0)
    simulate(system, 1e-6, initial=rest, outputs=2)
    deep = rest.copy()
    deep[: system.basis.modes] *= 20.0
    with pytest.warns(UserWarning, match="deep in the ground"):
        simulate(system, 1e-6, initial=deep, outputs=2)


@normal_law
def _pump(u, v, p):
    """A spring that pushes harder on the way out: a motor."""
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    return p[0] * u * (1.0 - 0.5 * np.tanh(100.0 * v)), p[0] * u, 0.0


class Motor(NormalLaw):
    """A law whose work is not that of the damping it claims to have."""

    kernel = _pump

    @property
    def penetration_scale(self):
        return 1e-3

    def table(self, share):
        return np.full((len(share), 1), 1e4)

    def stored_energy(self, penetration, share):
        return 3e4 * np.maximum(penetration, 0.0) ** 2


def test_energy_from_nowhere_has_a_status():
    """Stored energy that is claimed but not put in."""
    system = drop().with_(normal=Motor(), gap=0.0)
    run = simulate(system, 0.5, initial=np.array([0.05, 0.0]))
    assert run.status is Status.ENERGY_GREW
    assert run.energies.growth > 0.01
    assert simulate(drop(), 0.5, initial=START).status is Status.FINISHED


@pytest.mark.filterwarnings("ignore::fecontact.core.errors.ModelWarning")
def test_energies_beyond_all_numbers_have_a_status():
    """The energy of 1e200 kg overflows with (9e59)^2; the motion does not."""
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    basis = basis_from_matrices(1e200 * np.eye(2), np.zeros((2, 2)),
                                {"contact": rows[None], "C": rows})
    system = ContactSystem(basis, RoughSurface(10e6, 10e-6, 40.0),
                           ExponentialFriction(0.8, 0.55, 1e3),
                           load=Load(14.0))
    run = simulate(system, 0.1, initial=RigidStart(velocity=(9e59, 0.0, 0.0)), outputs=11)
    assert run.status is Status.ENERGY_NOT_FINITE
    assert not np.isfinite(run.energies.imbalance)


def test_runs_warn_where_they_leave_the_limits_of_the_model():
    """A mass on two nodes, 20 mm apart: thrown up farther than that, pressed in deeper than it."""
    rows = np.zeros((2, 3, 1))
    rows[:, 1, 0] = 1.0
    basis = basis_from_matrices([[1.0]], [[0.0]], {"contact": rows, "C": rows[0]},
                                contact_x=[0.0, 0.02])
    system = ContactSystem(basis, RoughSurface(1e6, 1e-5),
                           friction=ExponentialFriction(0.8, 0.55, 1e3))
    with pytest.warns(ModelWarning, match=r"In this run points of the body move by 0\.021 m, more "
                                          r"than its own size of 0\.02 m"):
        run = simulate(system, 0.21, initial=np.array([0.0, 0.1]))
    assert len(run.limits_exceeded) == 1
    assert simulate(system, 0.19, initial=np.array([0.0, 0.1])).limits_exceeded == ()
    # Squares of these displacements are beyond all numbers.
    far = Trajectory(system, np.zeros(2), np.array([[0.0], [1e200]]), np.zeros((2, 1)),
                     np.zeros((2, len(POWERS))))
    assert "points of the body move by 1e+200 m, more than its own size" in far.limits_exceeded[0]
    # v (m / c)^(1/2) deep: 1.1 mm are 110 roughness heights, 0.9 mm are 90.
    with pytest.warns(ModelWarning, match=r"contact node 0 is 0\.0011 m deep .* 1\.1e\+02 times"):
        simulate(system, 5e-3, initial=np.array([0.0, -1.1]))
    assert simulate(system, 5e-3, initial=np.array([0.0, -0.9])).limits_exceeded == ()


def test_sliding_far_along_the_ground_is_within_the_limits():
    """Two metres over level ground, on a face of 20 mm: a rigid translation is exact."""
    rows = np.zeros((2, 3, 2))
    rows[:, 0, 0] = rows[:, 1, 1] = 1.0
    basis = basis_from_matrices(np.eye(2), np.zeros((2, 2)), {"contact": rows, "C": rows[0]},
                                contact_x=[0.0, 0.02])
    system = ContactSystem(basis, RoughSurface(1e6, 1e-5), ConstantFriction(0.1), load=Load(10.0))
    start = np.concatenate([equilibrium(system).modal_coordinates, [2.0, 0.0]])
    run = simulate(system, 3.0, initial=start)
    # v^2 / (2 mu N / m)
    assert run.displacement(0)[-1, 0] == pytest.approx(2.0, rel=1e-3)
    assert run.limits_exceeded == ()


def test_rotations_beyond_small_angles_are_told():
    """A free beam turned as a whole by 0.38 rad, and by 0.05 rad."""
    system = beam()
    for angle, told in ((0.38, True), (0.05, False)):
        state = initial_state(system, RigidStart((0.0, 0.0, angle)), 0.0)
        found = limits_exceeded(system, np.zeros(1), state[None])
        assert any("the body turns by 0.38 rad" in one for one in found) == told
