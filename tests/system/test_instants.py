"""A system in one state: forces, gaps, accelerations, linear motion; stable equilibria."""

import numpy as np
import pytest
from synthetic import basis
from systems import mass_in_plane

from fecontact import (
    ContactState,
    ContactSystem,
    Drive,
    Ground,
    InputError,
    Load,
    equilibrium,
    simulate,
)
from fecontact.laws import (
    ConstantFriction,
    ExponentialFriction,
    LinearContact,
    LuGreFriction,
    RoughSurface,
)

MASS, SPRING, NORMAL, SPEED = 2.0, 800.0, 30.0, 0.2


def on_belt(friction, **parts):
    """A mass on a belt, pressed on and held by a spring along it."""
    given = {"normal": LinearContact(1e5, damping=50.0), "load": Load(NORMAL),
             "ground": Ground(speed=SPEED), "drive": Drive(stiffness_x=SPRING)} | parts
    return mass_in_plane(MASS, friction=friction, **given)


def test_quantities_are_those_of_runs():
    system = ContactSystem(basis(contact_nodes=4), RoughSurface(1e6, 1e-6, 3.0),
                           ConstantFriction(0.4), ground=Ground(speed=0.1), load=Load(2.0))
    run = simulate(system, 2e-4, outputs=6, initial="rest")
    for k, time in enumerate(run.time):
        instant = system.at(run.states[k], time=time)
        for name in ("normal_force", "friction_force", "friction_forces", "penetration",
                     "penetration_rate", "slip_velocity", "slip_velocities", "slip_power",
                     "contact_state", "modal_coordinates", "modal_velocities"):
            assert getattr(instant, name) == pytest.approx(getattr(run, name)[k]), name
        assert instant.gap == pytest.approx(-run.penetration[k])
        assert instant.displacement("B") == pytest.approx(run.displacement("B")[k])
        assert instant.velocity(2) == pytest.approx(run.velocity(2)[k])


def test_accelerations_are_those_of_newtons_law():
    system = on_belt(ConstantFriction(0.3))
    rows = system.basis.contact_T[0, :2]
    x, y, u, v = 3e-3, -1e-4, 0.1, -0.02
    state = np.concatenate([np.linalg.solve(rows, [x, y]), np.linalg.solve(rows, [u, v])])
    instant = system.at(state)
    force = 1e5 * 1e-4 + 50.0 * 0.02
    assert instant.normal_force == pytest.approx([force])
    # It is slower than the belt, which pulls it along: R < 0 acts in +x.
    assert instant.friction_force == pytest.approx([-0.3 * force], rel=1e-3)
    assert instant.contact_state == [ContactState.SLIP]
    wanted = np.array([-SPRING * x - instant.friction_force[0], force - NORMAL]) / MASS
    assert rows @ instant.modal_accelerations == pytest.approx(wanted)


def test_rest_has_no_friction_and_sliding_that_of_the_belt():
    system = on_belt(ConstantFriction(0.3))
    rest = equilibrium(system)
    assert (rest.kind, rest.stable) == ("rest", True)
    assert rest.normal_force == pytest.approx([NORMAL])
    assert rest.gap == pytest.approx([-NORMAL / 1e5])
    assert rest.friction_force == rest.slip_velocity == [0.0]
    assert rest.displacement(0)[0] == pytest.approx(0.0, abs=1e-12)
    sliding = equilibrium(system, "sliding")
    assert sliding.slip_velocity == pytest.approx([-SPEED])
    assert sliding.friction_force == pytest.approx([-0.3 * NORMAL], rel=1e-3)
    assert sliding.displacement(0)[0] == pytest.approx(0.3 * NORMAL / SPRING, rel=1e-3)
    assert np.abs(sliding.modal_accelerations).max() < 1e-9 * NORMAL
    assert (sliding.state[2:] == 0.0).all()


@pytest.mark.parametrize(("damping", "stable"), [(0.99, False), (1.01, True)])
def test_sliding_on_falling_friction_is_stable_beyond_the_damping_of_the_slope(damping, stable):
    """m x'' + (d - N |mu'|) x' + c x = 0 about steady sliding."""
    friction = ExponentialFriction(0.6, 0.3, 4.0, smoothing_slope=1e6)
    slope = NORMAL * 0.3 * 4.0 * np.exp(-4.0 * SPEED)
    system = on_belt(friction, drive=Drive(stiffness_x=SPRING, damping_x=damping * slope))
    sliding = equilibrium(system, "sliding")
    assert sliding.stable == stable
    slowest = sliding.eigenvalues[np.argmin(np.abs(np.abs(sliding.eigenvalues.imag)
                                                   - np.sqrt(SPRING / MASS)))]
    assert slowest.real == pytest.approx((1.0 - damping) * slope / (2.0 * MASS), rel=0.05)


def test_bristles_are_bent_as_in_steady_sliding():
    friction = LuGreFriction(static_coefficient=0.5, kinetic_coefficient=0.3, stribeck_velocity=0.1,
                             stribeck_exponent=2.0, bristle_stiffness=1e4, bristle_damping=1.0)
    sliding = equilibrium(on_belt(friction), "sliding")
    assert np.abs(sliding.system.rhs(0.0, sliding.state)).max() < 1e-9 * NORMAL
    coefficient = 0.3 + 0.2 * np.exp(-(SPEED / 0.1) ** 2)
    assert sliding.friction_force == pytest.approx([-coefficient * NORMAL], rel=1e-6)


def test_rest_on_waves_is_in_a_trough():
    wavy = Ground(amplitude=1e-3, wavelength=0.02)
    free = on_belt(ConstantFriction(0.3), ground=wavy, drive=Drive(stiffness_x=1.0))
    found = equilibrium(free)
    assert found.stable
    # There the ground is the waves' amplitude below its mean.
    height = found.displacement(0)[1] + found.penetration[0]
    assert height == pytest.approx(-1e-3, rel=1e-2)


def test_changes_by_mapping_and_by_name_are_the_same():
    system = on_belt(ConstantFriction(0.3))
    both = system.with_({"ground.speed": 0.5, "gap": 1e-6})
    assert (both.ground.speed, both.gap) == (0.5, 1e-6)
    assert system.with_({"ground.speed": 0.5}, gap=1e-6).parameters() == both.parameters()
    assert system.with_(ground=Ground(speed=0.5), gap=1e-6).parameters() == both.parameters()
    for given in (3, ["ground.speed"]):
        with pytest.raises(InputError, match="must be a mapping of names"):
            system.with_(given)
