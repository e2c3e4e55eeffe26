"""Derivatives of runs that differences of runs contradict come with a warning."""

from dataclasses import replace

import numpy as np
import pytest
from systems import friction_oscillator, mass_in_y

from fecontact import Load, ModelWarning, sensitivity
from fecontact.integrate import sensitivities as module
from fecontact.laws import Frictionless, LinearContact

DEPTH = 1e-3


def spring_over_ground(height):
    """A unit mass on a unit spring that swings from 2 d to the ground at y = 0, start included."""
    system = mass_in_y(1.0, spring=1.0, load=Load(-DEPTH), normal=LinearContact(1e8),
                       friction=Frictionless())
    return system, np.array([2.0 * DEPTH + height, 0.0])


def test_a_grazing_run_has_a_warning():
    """The speed after a touch at depth h changes by sqrt(h): there is no derivative at h = 0."""
    system, start = spring_over_ground(0.0)
    with pytest.warns(ModelWarning, match=r"differ from differences of runs from t = 0 to 4 s"):
        found = sensitivity(system, 4.0, initial=start)
    assert "%" in found.note
    unchecked = sensitivity(system, 4.0, initial=start, check=False)
    assert not unchecked.note
    assert (unchecked.monodromy == found.monodromy).all()


def test_a_run_that_clears_the_ground_has_none():
    system, start = spring_over_ground(-0.1 * DEPTH)
    found = sensitivity(system, 4.0, initial=start)
    assert not found.note
    assert found.monodromy == pytest.approx(
        np.array([[np.cos(4.0), np.sin(4.0)], [-np.sin(4.0), np.cos(4.0)]]), rel=1e-6)


@pytest.mark.parametrize("column", [0, 3, "parameter"])
def test_each_wrong_column_is_found(monkeypatch, column):
    """Half as large again in one column, in one of two spans."""
    right = module.differentiated

    def wrong(*arguments):
        found = right(*arguments)
        forced, transitions = found.forced.copy(), found.transitions.copy()
        target = forced[1] if column == "parameter" else transitions[1, :, column]
        target *= 1.5
        return replace(found, forced=forced, transitions=transitions)

    system = friction_oscillator(2, **{"friction.smoothing_slope": 3e3})
    options = {"outputs": 3, "parameter": "ground.speed"}
    assert not sensitivity(system, 0.1, **options).note
    monkeypatch.setattr(module, "differentiated", wrong)
    with pytest.warns(ModelWarning, match=r"from t = 0\.05 to 0\.1 s"):
        sensitivity(system, 0.1, **options)
