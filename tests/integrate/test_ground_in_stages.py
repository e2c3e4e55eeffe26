"""Steps over ground of varying speed: slip in stick against closed forms."""

import numpy as np
import pytest
from systems import TURN

from fecontact import ContactSystem, Ground, basis_from_matrices, sensitivity, simulate
from fecontact.integrate import Radau, Rodas5P
from fecontact.integrate.rodas5p import moving_ground
from fecontact.integrate.trajectory import Status
from fecontact.laws import (
    ConstantFriction,
    DahlFriction,
    ExponentialFriction,
    HarmonicSpeed,
    JenkinsFriction,
    PrescribedForce,
)

SPRING, DASHPOT, SPEED = 100.0, 1.0, 0.05


def on_belt(friction, normal=10.0, axes=1, **ground):
    """A unit mass on a spring and a dashpot that sticks to a belt of oscillating speed.

    With two ``axes`` it also moves across, and so does the belt.
    """
    motion = HarmonicSpeed(SPEED, 1.0)
    if axes == 1:
        rows, space = np.array([[1.0], [0.0], [0.0]]), {}
    else:
        rows, ground["motion_y"] = np.zeros((6, 2)), motion
        rows[0, 0] = rows[1, 1] = 1.0
        space = {"dimension": 3, "contact_places": np.zeros((1, 3)), "tributary": [1.0]}
    modes = basis_from_matrices(np.eye(axes), SPRING * np.eye(axes),
                                {"contact": rows[None], "B": rows}, damping=DASHPOT * np.eye(axes),
                                **space)
    return ContactSystem(modes, normal=PrescribedForce(normal), friction=friction,
                         ground=Ground(motion=motion, **ground))


def test_sums_of_speeds_are_those_of_the_method():
    """Of order five: it integrates speeds up to the fourth power, and accelerations of these."""
    times = moving_ground._TIMES
    for power in range(6):
        speeds = times**power
        assert moving_ground._SPEEDS[-1] @ speeds + moving_ground._RISES[-1] @ speeds == (
            pytest.approx(1.0, rel=1e-11))
        if power < 5:
            travel = moving_ground._TRAVELS[-1] @ speeds + moving_ground._MOVES[-1] @ speeds
            assert travel == pytest.approx(1.0 / (power + 1), rel=1e-11)
    assert np.abs(moving_ground._RISES @ np.ones(6)).max() < 1e-12


@pytest.mark.parametrize(("rtol", "error"), [(1e-4, 4e-3), (1e-6, 3e-4)])
def test_the_work_of_a_belt_is_the_loss_of_the_dashpot(rtol, error):
    run = simulate(on_belt(ConstantFriction(0.5)), 20.0, rtol=rtol, outputs=2001,
                   solver=Rodas5P())
    assert run.status is Status.FINISHED
    work = run.energies.belt_friction_work[-1]
    assert work == pytest.approx(0.5 * DASHPOT * SPEED**2 * 20.0, rel=error)
    assert abs(run.energies.imbalance) < error
    wt = TURN * run.time
    needed = SPEED * (TURN * np.cos(wt) + DASHPOT * np.sin(wt)
                      + SPRING / TURN * (1.0 - np.cos(wt)))
    assert np.abs(run.friction_force[5:, 0] + needed[5:]).max() < 2.0 * error * needed.max() + 2e-3
    # With the ground as it is at the times of the stages it took 18,000 and 29,000.
    assert run.statistics["steps"] < 2500


@pytest.mark.parametrize("friction", [JenkinsFriction(1e6, 0.5), DahlFriction(0.5, 1e6)])
def test_elastic_friction_follows_the_belt(friction):
    run = simulate(on_belt(friction), 5.0, outputs=501, solver=Rodas5P())
    work = run.energies.belt_friction_work[-1]
    assert work == pytest.approx(0.5 * DASHPOT * SPEED**2 * 5.0, rel=2e-3)
    assert abs(run.energies.imbalance) < 1e-4


def test_in_space_the_belt_moves_both_ways():
    along = simulate(on_belt(ConstantFriction(0.5)), 5.0, outputs=101, solver=Rodas5P())
    run = simulate(on_belt(ConstantFriction(0.5), axes=2), 5.0, outputs=101, solver=Rodas5P())
    assert run.states[:, 0] == pytest.approx(run.states[:, 1], abs=1e-9)
    assert run.states[:, 0] == pytest.approx(along.states[:, 0], abs=1e-7)
    assert run.statistics["steps"] < 1000


@pytest.mark.parametrize("parameter", ["ground.motion.amplitude", "ground.motion.frequency_hz",
                                       "ground.speed"])
def test_derivatives_are_those_of_collocation(parameter):
    # The smoothing of the latter is narrow: it is passed within 1 um/s.
    for friction in (ConstantFriction(0.5, 1e3), ExponentialFriction(0.5, 0.4, 1e3)):
        system = on_belt(friction, normal=3.0, speed=0.03)
        ways = [sensitivity(system, 0.7, initial=[1e-3, 0.01], rtol=1e-9, parameter=parameter,
                            solver=solver) for solver in (Rodas5P(), Radau())]
        for name in ("monodromy", "parameter_derivative"):
            one, other = (getattr(way, name) for way in ways)
            assert np.abs(one - other).max() < 1e-5 * np.abs(other).max()
