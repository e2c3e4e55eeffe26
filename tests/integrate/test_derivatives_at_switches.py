"""Derivatives of set-valued runs that begin or end with an impact, or as a body breaks away."""

import numpy as np
import pytest
from systems import belt_of_unit_mass, mass_in_y

import fecontact as fc
from fecontact import ModelWarning, sensitivity
from fecontact.integrate import SetValued
from fecontact.laws import ConstantFriction

GRAVITY, REBOUND, END = 9.81, 0.6, 0.2


def ball(**parts):
    """A mass over rigid ground, falling."""
    return mass_in_y(1.0, load=fc.Load(GRAVITY), friction=ConstantFriction(0.0), **parts)


def differentiated(start, **options):
    return sensitivity(ball(), END, initial=np.array(start),
                       solver=SetValued(restitution=REBOUND), **options)


# Impacts -----------------------------------------------------------------------------------------

@pytest.mark.parametrize("height", [0.0, 1e-7, 1e-2])
def test_derivatives_of_an_impact_at_the_start(height):
    """The saltation: a higher start strikes later by dy / |v|, with a speed that weight changes.

    From the height h with the speed w down the ball strikes at t* with V = sqrt(w^2 + 2 g h) and
    rises with e V: y = e V (T - t*) - g (T - t*)^2 / 2.
    """
    w, g, e = 2.0, GRAVITY, REBOUND

    def end(h, w):
        V = np.sqrt(w**2 + 2.0 * g * h)
        left = END - (V - w) / g
        return np.array([e * V * left - 0.5 * g * left**2, e * V - g * left])

    d = 1e-6
    # The formula goes on below the ground.
    exact = np.column_stack([(end(height + d, w) - end(height - d, w)) / (2.0 * d),
                             -(end(height, w + d) - end(height, w - d)) / (2.0 * d)])
    found = differentiated([height, -w])
    assert found.states[-1] == pytest.approx(end(height, w), rel=1e-9)
    assert found.monodromy == pytest.approx(exact, rel=2e-6)
    assert not found.note
    assert found.sided[0, 0] == pytest.approx(exact, rel=1e-3)


def test_derivatives_of_a_start_that_leaves_the_ground():
    """Free flight, though a state below the ground would be taken out of it."""
    found = differentiated([0.0, 1.5])
    assert found.monodromy == pytest.approx(np.array([[1.0, END], [0.0, 1.0]]), rel=1e-6, abs=1e-6)
    assert not found.note


def test_an_impact_at_the_very_end_has_no_derivative():
    height = 0.5 * GRAVITY * END**2
    with pytest.warns(ModelWarning, match=r"to y\[0\] from "
                                          r"t = 0 to 0.2 s.*no derivative"):
        found = differentiated([height, 0.0])
    assert found.note


# Friction ----------------------------------------------------------------------------------------

STATIC = SetValued(static_coefficient=0.8)


@pytest.mark.parametrize(("start", "solver", "named"), [
    ([0.8, 0.2], STATIC, ["y[0]", "y[1]", "the parameter"]),
    ([0.5, 0.2], STATIC, ["y[1]", "the parameter"]),
    ([0.5, 0.2], SetValued(), ["y[1]", "the parameter"]),
])
def test_at_breakaway_there_is_no_derivative(start, solver, named):
    """On the belt at the limit of stick: faster than the belt a mass sticks again, slower it slips.

    With a static coefficient the force falls at the limit: a mass ahead slides at once, one behind
    rides on for the time dx / V.
    """
    with pytest.warns(ModelWarning, match="there is no derivative") as warned:
        found = sensitivity(belt_of_unit_mass(), 0.7, initial=np.array(start), solver=solver,
                            parameter="ground.speed")
    assert len(warned) == 1
    for name in ("y[0]", "y[1]", "the parameter"):
        assert (f"to {name} from t = 0 to 0.7 s" in found.note) == (name in named)


def test_derivatives_to_the_sides_of_breakaway():
    """Ahead, into slip, the circle about 1/2; behind, the circle begins dx / V later."""
    with pytest.warns(ModelWarning, match="there is no derivative"):
        found = sensitivity(belt_of_unit_mass(), 0.7, initial=np.array([0.8, 0.2]), solver=STATIC)
    c, s = np.cos(0.7), np.sin(0.7)
    # About 1/2 from (0.3, 0.2).
    rates = np.array([-0.3 * s + 0.2 * c, -0.3 * c - 0.2 * s])
    ahead, behind = found.sided[:, 0, :, 0]
    assert ahead == pytest.approx([c, -s], abs=1e-5)
    assert behind == pytest.approx(rates / 0.2, abs=1e-4)


@pytest.mark.parametrize("start", [[0.3, 0.2], [0.4, 0.2], [0.8, 0.0], [1.0, -0.1]])
def test_derivatives_off_the_switches_have_no_note(start):
    found = sensitivity(belt_of_unit_mass(), 0.7, initial=np.array(start), solver=STATIC,
                        parameter="ground.speed")
    assert not found.note
    assert np.abs(np.diff(found.sided, axis=0)).max() < 1e-4
