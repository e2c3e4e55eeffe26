"""Derivatives of runs with friction that has memory, across touch-downs and lift-offs."""

from pathlib import Path

import numpy as np
import pytest
from systems import mass_in_y

from fecontact import Ground, Load, ensemble, sensitivity, simulate
from fecontact.integrate import ContactEvents
from fecontact.laws import BoucWenFriction, DahlFriction, LuGreFriction

FOLDER = Path(__file__).parents[2] / "benchmarks"
GRAVITY = 9.81
# Steps of differences, in parts of the scales of the state.
STEPS = (1e-5, 1e-6)


# Closed forms ------------------------------------------------------------------------------------

MU, SIGMA, SPEED, HEIGHT = 0.5, 1e5, 0.02, 1e-3


@pytest.mark.parametrize("friction", [
    DahlFriction(MU, SIGMA), BoucWenFriction(MU, MU / SIGMA),
    LuGreFriction(MU, MU, stribeck_velocity=1e-3, bristle_stiffness=SIGMA, stribeck_exponent=2.0)])
def test_deflection_since_touch_down(friction):
    """A mass falls from h onto ground with the speed V: z = -l (1 - exp(-s / l)), l = mu / sigma.

    s = V (t - sqrt(2 h / g)) is the way of the ground since touch-down, and Bouc-Wen's z is the
    same in units of l. So z depends on the height and on the speed at the start by the time of
    touch-down alone.
    """
    system = mass_in_y(1.0, load=Load(GRAVITY), friction=friction, ground=Ground(speed=SPEED))
    length = MU / SIGMA
    unit = 1.0 if isinstance(friction, DahlFriction | LuGreFriction) else 1.0 / length
    touched = np.sqrt(2.0 * HEIGHT / GRAVITY)
    lasted = 0.7 * length / SPEED
    found = sensitivity(system, touched + lasted, initial=np.array([HEIGHT, 0.0, 0.0]),
                        parameter="ground.speed", rtol=1e-10)
    fall = np.exp(-SPEED * lasted / length)
    assert found.states[-1, 2] == pytest.approx(-unit * length * (1.0 - fall), rel=1e-6)
    # dt/dh = 1 / (g t), dt/dv = 1 / g for a speed v upwards at the start.
    later = unit * SPEED * fall
    assert found.monodromy[2, :2] == pytest.approx(
        [later / (GRAVITY * touched), later / GRAVITY], rel=1e-5)
    assert found.parameter_derivative[2] == pytest.approx(-unit * lasted * fall, rel=1e-5)
    # The internal variable from before the flight has decayed.
    assert found.monodromy[2, 2] == 0.0


@pytest.mark.parametrize("friction", [
    DahlFriction(MU, SIGMA), BoucWenFriction(MU, MU / SIGMA),
    LuGreFriction(MU, MU, stribeck_velocity=1e-3, bristle_stiffness=SIGMA, stribeck_exponent=2.0)])
def test_long_flights_keep_derivatives_finite(friction):
    """Internal variables decay below the smallest numbers: y = h + v t - g t^2 / 2 all the same."""
    system = mass_in_y(1.0, load=Load(GRAVITY), friction=friction, ground=Ground(speed=SPEED))
    found = sensitivity(system, 0.2, initial=np.array([0.5, 0.0, 0.3 * MU / SIGMA]))
    assert found.monodromy == pytest.approx(
        np.array([[1.0, 0.2, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]), rel=1e-9, abs=1e-9)


# Random systems ----------------------------------------------------------------------------------

@pytest.fixture
def systems(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    import random_systems

    return random_systems


def difference(ends_at, scales):
    """Derivative of ends_at(step) / scales at 0, and how far two steps are apart."""
    one, other = ((ends_at(step) - ends_at(-step)) / (2.0 * step * scales) for step in STEPS)
    return one, np.abs(one - other).max() / max(np.abs(one).max(), 1e-12)


# Of each law, runs in the plane and in space, on wavy ground, with normal forces that jump or are
# cut off, and with a flight at the end.
@pytest.mark.parametrize("number", [
    pytest.param(54, id="LuGre"), pytest.param(138, id="LuGre, two nodes, cut off"),
    pytest.param(82, id="LuGre, flight"), pytest.param(25, id="Dahl"),
    pytest.param(11, id="Dahl, waves in space"), pytest.param(123, id="Dahl, space"),
    pytest.param(137, id="Dahl, many impacts"), pytest.param(195, id="Bouc-Wen, space"),
    pytest.param(97, id="Bouc-Wen, flight"), pytest.param(69, id="Bouc-Wen, jumps of force")])
def test_derivatives_of_random_systems(systems, number):
    """Against differences of tight runs: to every entry of the start, and to the load."""
    case = systems.random_case(number)
    system, m, end, name = case.system, case.system.basis.modes, 0.05, "load.normal"
    run = simulate(system, end, initial=case.state, outputs=201, rtol=1e-9, events=ContactEvents())
    assert any(kind in ("touch-down", "lift-off") for kind in run.events.kind)
    found = sensitivity(system, end, initial=case.state, parameter=name, rtol=1e-10)
    value, size = system.parameter(name), system.size
    scales = np.concatenate([np.ptp(run.states[:, :m], axis=0), np.ptp(run.states[:, m : 2 * m],
                                                                      axis=0),
                             system.memory_scales])
    derivatives = np.column_stack([found.monodromy * scales, found.parameter_derivative * value])

    def ends(systems, starts):
        found = ensemble(systems, [0.0, end], initial=np.array(starts), rtol=1e-11, workers=1)
        assert found.finished.all()
        return found.states[:, -1]

    met = 0
    for column in range(size + 1):
        def ends_at(step, column=column):
            if column == size:
                return ends([system.with_(**{name: value * (1.0 + step)})], [case.state])[0]
            return ends([system], [case.state + step * scales * np.eye(size)[column]])[0]

        wanted, apart = difference(ends_at, scales)
        if apart < 1e-4:
            met += 1
            own = derivatives[:, column] / scales
            assert np.abs(own - wanted).max() < 5e-4 * np.abs(wanted).max() + 1e-9, column
    assert met > 0.6 * size
