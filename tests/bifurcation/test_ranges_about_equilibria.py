"""Ranges of quantities over orbits relative to the equilibrium."""

import numpy as np
import pytest
from systems import two_mass_field

from fecontact.bifurcation import (
    Collocation,
    equilibrium_branch,
    find_equilibrium,
    orbit_branch,
    quantity_range,
    vector_field,
)
from fecontact.core.errors import AnalysisError, InputError


def circle(t, x, p, out):
    a, b = x[0] - 3.0 * p[0], x[1] + 2.0
    out[0] = p[0] * a - b - a * (a * a + b * b)
    out[1] = a + p[0] * b - b * (a * a + b * b)


def test_circles_about_an_equilibrium_that_moves():
    field = vector_field(circle, {"mu": -0.5}, ["a", "b"])
    steady = equilibrium_branch(field, [-1.5, -2.0], "mu", bounds=(-0.5, 1.0))
    hopf, = steady.of_kind("Hopf")
    orbits = orbit_branch(field, hopf, method=Collocation(intervals=20), bounds=(-0.5, 1.0))
    for point in orbits.points[1:]:
        mu = point.parameter
        assert quantity_range(point, [1.0, 0.0]) == pytest.approx(
            (3.0 * mu - np.sqrt(mu), 3.0 * mu + np.sqrt(mu)), abs=1e-6)
        for row in ([1.0, 0.0], [0.0, 1.0]):
            assert quantity_range(point, row, about=field) == pytest.approx(
                (-np.sqrt(mu), np.sqrt(mu)), abs=1e-6)
    assert quantity_range(steady.points[1], [1.0, 0.0], about=field) == pytest.approx((0.0, 0.0),
                                                                                      abs=1e-12)


def test_contact_systems_about_steady_sliding():
    field = two_mass_field()
    row = field.displacement_row(1)
    name = next(iter(field.parameters))
    low, high = field.values[0], 1.5 * field.values[0]
    steady = equilibrium_branch(field, None, name, bounds=(low, high))
    for point in steady.points[::3]:
        values = dict(zip(field.parameters, point.parameter_values(field), strict=True))
        assert quantity_range(point, row)[0] == pytest.approx(
            row @ find_equilibrium(field, values).state, rel=1e-9)
        assert quantity_range(point, row, about=field)[1] == pytest.approx(
            0.0, abs=1e-9 * abs(quantity_range(point, row)[1]))


def test_driven_fields_have_no_equilibrium():
    def driven(t, x, p, out):
        out[0] = np.cos(t) - x[0]
        out[1] = p[0] * x[0] - x[1]

    field = vector_field(driven, {"c": 1.0}, ["a", "b"], period=2.0 * np.pi)
    times = np.linspace(0.0, 2.0 * np.pi, 41)
    states = 0.5 * np.stack([np.cos(times) + np.sin(times), np.sin(times)], axis=1)
    branch = orbit_branch(field, (times, states), "c", method=Collocation(intervals=10),
                          bounds=(0.9, 1.1))
    with pytest.raises(AnalysisError, match="driven"):
        quantity_range(branch.points[0], [1.0, 0.0], about=field)


@pytest.mark.parametrize("period", [0.0, -1.0, np.inf, "2 pi"])
def test_periods_of_fields_are_times(period):
    with pytest.raises(InputError, match=r"period = .* must be a number above zero"):
        vector_field(circle, {"mu": 0.5}, ["a", "b"], period=period)
