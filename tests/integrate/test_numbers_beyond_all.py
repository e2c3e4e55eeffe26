"""Whole numbers that no float holds, and functions of events that are no numbers."""

import numpy as np
import pytest
from systems import friction_oscillator, lorenz_field, mass_in_y

import fecontact as fc
from fecontact import Event, InputError, event, simulate
from fecontact.bifurcation import lyapunov_exponents, periodic_motion, poincare_scan, vector_field
from fecontact.bifurcation.orbits.floquet import require_same
from fecontact.integrate import Rodas5P, SetValued, strobe
from fecontact.laws import Step, Tabulated

HUGE = 10**400


@pytest.mark.parametrize("call", [
    lambda s: simulate(s, HUGE),
    lambda s: simulate(s, 1.0, t_start=-HUGE),
    lambda s: simulate(s, 1.0, outputs=HUGE),
    lambda s: simulate(s, 1.0, outputs=[0, HUGE]),
    lambda s: simulate(s, 1.0, max_step=HUGE),
    lambda s: simulate(lorenz_field(), HUGE, initial=[1.0, 1.0, 1.0]),
    lambda s: strobe(s, transient_periods=HUGE, keep=1),
    lambda s: strobe(s, transient_periods=1, keep=HUGE),
    lambda s: strobe(s, transient_periods=1, keep=1, period=HUGE),
    # Below the most periods, but more than memory has room for.
    lambda s: strobe(s, transient_periods=1, keep=10**14),
    lambda s: strobe(s, transient_periods=-10**5000, keep=1),
    lambda s: lyapunov_exponents(s, duration=1.0, transient=-10**5000),
    lambda s: poincare_scan(s, "drive.frequency_hz", [13.0, HUGE], transient_periods=1),
    lambda s: poincare_scan(s, "drive.frequency_hz", [13.0], transient_periods=HUGE),
    lambda s: periodic_motion(s, transient=HUGE),
    lambda s: s.with_(**{"ground.speed": HUGE}),
    lambda s: Step(HUGE, 1.0),
    lambda s: fc.Load(HUGE),
    lambda s: Tabulated((0, HUGE), (0, 1)),
    lambda s: SetValued(restitution=HUGE),
])
def test_whole_numbers_beyond_all_floats_are_named(call):
    with pytest.raises(InputError) as told:
        call(friction_oscillator())
    assert len(str(told.value)) < 400


@event
def _root(t, y, p):
    return np.sqrt(0.3 - abs(t - 0.5)) - 2.0


@pytest.mark.parametrize("solver", [Rodas5P(), SetValued()], ids=["rodas5p", "set-valued"])
def test_events_that_are_no_numbers_for_a_while_are_named(solver):
    """Finite from 0.2 to 0.8 s only; at the end of this run it is a number again."""
    with pytest.raises(InputError, match=r"'event 0' is not a finite number"):
        simulate(mass_in_y(gap=1.0), 0.7, initial=np.zeros(2), events=Event(_root), solver=solver)


def test_a_function_that_is_no_field_is_not_called_a_law():
    with pytest.raises(InputError, match=r"^vector_field: the function .*is not one of the form"):
        vector_field(lambda t, x: x, {"a": 1.0}, 1)


def test_multipliers_of_derivatives_that_are_not_finite_are_uncertain():
    with pytest.warns(fc.ModelWarning, match="are uncertain"):
        require_same(np.array([0.5, 0.1]), [np.full((2, 1, 2, 2), np.inf)], "speed = 1")
