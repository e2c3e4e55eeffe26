"""Normal forms of branch points of equilibria, against closed forms."""

import numpy as np
import pytest
from collocation_fields import lorenz_field

from fecontact.bifurcation import (
    ContinuationOptions,
    CrossingPoint,
    equilibrium_branch,
    find_equilibrium,
    vector_field,
)
from fecontact.io import read_branch, write_branch


def crossing_of(function, states, bounds=(-1.0, 1.0), **parameters):
    field = vector_field(function, parameters or {"p": bounds[0]}, states)
    found, = equilibrium_branch(field, np.zeros(states), bounds=bounds).special
    assert isinstance(found, CrossingPoint)
    return found


def test_the_fork_of_lorenz():
    """On the centre manifold along (1, 1, 0) / sqrt(2): c = -sigma / (2 b (sigma + 1))."""
    field = lorenz_field()
    rest = equilibrium_branch(field, find_equilibrium(field, {"rho": 0.0}), "rho",
                              bounds=(0.0, 14.0))
    point, = rest.special
    assert point.form == "fork"
    assert point.criticality == "supercritical"
    assert point.coefficient == pytest.approx(-10.0 / (2.0 * 8.0 / 3.0 * 11.0), rel=1e-9)


def slaved(t, x, p, out):
    # y = x^2 adds 1 to the coefficient 2.
    out[0] = x[0] * (p[0] + 2.0 * x[0] * x[0]) + x[0] * x[1]
    out[1] = -x[1] + x[0] * x[0]


def hoop(t, x, p, out):
    # A bead on a turning hoop; along (1, 0) the damping 0.1 multiplies -p / 2 by 10.
    out[0] = x[1]
    out[1] = -0.1 * x[1] - np.sin(x[0]) * (1.0 - p[0] * np.cos(x[0]))


def test_forks_with_a_second_state():
    found = crossing_of(slaved, 2)
    assert (found.form, found.criticality) == ("fork", "subcritical")
    assert found.coefficient == pytest.approx(3.0, rel=1e-9)
    found = crossing_of(hoop, 2, (0.0, 2.0))
    assert found.parameter == pytest.approx(1.0, abs=1e-12)
    assert (found.form, found.criticality) == ("fork", "supercritical")
    assert found.coefficient == pytest.approx(-5.0, rel=1e-9)


@pytest.mark.parametrize("a", [-3.0, 1.0, 1e-3])
def test_transcritical_points(a, tmp_path):
    """Beside a cubic term that is larger."""
    def crossing(t, x, p, out):
        out[0] = x[0] * (p[0] + a * x[0] - 2.0 * x[0] * x[0])

    field = vector_field(crossing, {"p": -1.0}, 1)
    branch = equilibrium_branch(field, [0.0], bounds=(-1.0, 1.0))
    for one in (branch, read_branch(write_branch(tmp_path / "branch.h5", branch))):
        found, = one.special
        assert found.form == "transcritical"
        assert found.criticality is None
        assert found.coefficient == pytest.approx(a, rel=1e-9)


@pytest.mark.parametrize("bounds", [(-1.0, 1.0), (-1e3, 1e3)])
def test_the_other_branch_has_the_width_of_the_first_where_the_parameter_is_zero(bounds):
    def fork(t, x, p, out):
        out[0] = p[0] * x[0] - 3.0 * x[0] ** 3

    field = vector_field(fork, {"p": bounds[0]}, 1)
    found, = equilibrium_branch(field, [0.0], bounds=bounds).special
    assert abs(found.parameter) < 1e-9
    other = equilibrium_branch(field, found, options=ContinuationOptions(points=60))
    reached = other.parameter[-1]
    assert 0.5 * bounds[1] < reached < 10.0 * bounds[1]
    assert other.column("state")[-1, 0] ** 2 == pytest.approx(reached / 3.0, rel=1e-9)


def linear(t, x, p, out):
    out[0] = p[0] * x[0]


def test_what_no_normal_form_decides():
    found = crossing_of(linear, 1)
    assert (found.form, found.criticality) == ("fork", "undecided")
