"""Coefficients and criticality of doublings and tori found by shooting and harmonic balance."""

import numpy as np
import pytest
from systems import two_mass_field
from test_orbit_curves import circle_field, doubling, torus

from fecontact import InputError
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    PeriodicMotion,
    Shooting,
    equilibrium_branch,
    orbit_branch,
    with_normal_form,
)


@pytest.mark.parametrize(("function", "kind", "known", "parameters"), [
    (torus, "Neimark-Sacker", -2.0 * np.pi, {"lam": -0.2, "a": 0.3}),
    (doubling, "period doubling", -0.5 * np.pi, {"lam": -0.4, "k": -0.5})])
def test_closed_forms_by_harmonic_balance(function, kind, known, parameters):
    """w' = ... - w |w|^2 across the circle, of unit mean square if w = sqrt(2) z; a' = k a^3."""
    field, t, circle = circle_field(function, **parameters)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                          method=HarmonicBalance(harmonics=9), bounds=(-0.5, 0.5),
                          scales=np.ones(3))
    point, = branch.of_kind(kind)
    assert point.criticality is None
    found = with_normal_form(field, point, intervals=12)
    assert type(found) is type(point)
    assert found.criticality == "supercritical"
    assert found.coefficient == pytest.approx(known, rel=1e-5)
    assert found.coefficient_error < 1e-2
    assert with_normal_form(field, found) is found
    with pytest.raises(InputError, match="point must be a PeriodDoublingPoint or"):
        with_normal_form(field, branch.points[0])


def test_a_doubling_by_shooting():
    field = two_mass_field()
    sliding = equilibrium_branch(field, parameter="B", bounds=(0.3, 8.3))
    orbits = orbit_branch(field, sliding.of_kind("Hopf")[0], method=Collocation(intervals=100),
                          bounds=(0.3, 8.3))
    known, = orbits.of_kind("period doubling")
    near = max((at for at in orbits.points if at.parameter < 8.08), key=lambda at: at.parameter)
    shot = orbit_branch(field, near.orbit(field, 2000), "B", method=Shooting(),
                        bounds=(7.5, 8.11), options=ContinuationOptions(
                            step=5e-3, largest_step=0.05, points=60))
    point, = shot.of_kind("period doubling")
    found = with_normal_form(field, point)
    assert found.criticality == known.criticality == "supercritical"
    # The eigenfunction has unit mean square in the scales of the branch.
    same = orbit_branch(field, near.orbit(field, 2000), "B", method=Collocation(intervals=200),
                        bounds=(7.5, 8.11), scales=shot.attributes["scales"][:4])
    again, = same.of_kind("period doubling")
    assert found.coefficient == pytest.approx(again.coefficient, rel=2e-3)
