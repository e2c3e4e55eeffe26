"""Curves of folds, doublings and tori of orbits against branches at other parameters."""

import numpy as np
import pytest
from collocation_fields import two_masses_field

from fecontact.bifurcation.equilibrium_branch import equilibrium_branch
from fecontact.bifurcation.orbit_curves import orbit_curve
from fecontact.bifurcation.orbits import orbits_from_hopf, orbits_from_motion
from fecontact.bifurcation.problem import Settings
from fecontact.bifurcation.vector_field import VectorField
from fecontact.errors import InputError


def first_branch(**changes):
    field = two_masses_field(**changes)
    sliding = equilibrium_branch(field, "B", np.zeros(4), bounds=(0.2, 12.0))
    return field, orbits_from_hopf(field, sliding, sliding.of_kind("Hopf")[0], intervals=80,
                                   bounds=(0.2, 12.0))


@pytest.fixture(scope="module")
def masses():
    return first_branch()


@pytest.mark.parametrize(("kind", "second", "tolerance"), [
    ("fold", "v0", 1e-9), ("period doubling", "D", 1e-8)])
def test_curve_agrees_with_branches(masses, kind, second, tolerance):
    field, branch = masses
    start, = branch.of_kind(kind)
    curve = orbit_curve(field, branch, start, second, bounds=(0.2, 20.0),
                        settings=Settings(step=0.005, largest_step=0.03, points=12))
    assert len(curve) == 12
    assert curve.parameter[0] == pytest.approx(start.parameter, rel=tolerance)
    end = curve.points[-1]
    assert abs(end.values[second] / field.parameters[second] - 1.0) > 0.1
    _, other = first_branch(**{second: end.values[second]})
    expected, = other.of_kind(kind)
    assert end.parameter == pytest.approx(expected.parameter, rel=tolerance)
    assert end.values["period"] == pytest.approx(expected.values["period"], rel=tolerance)


def torus(t, x, p, out):
    # A circle of radius one; across it w' = (lam - a^2 + 0.7 i) w - w |w|^2, w = r - 1 + i z.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    growth = p[0] - p[1] * p[1] - a * a - z * z
    radial = growth * a - 0.7 * z
    out[0] = radial * C - 2.0 * r * S
    out[1] = radial * S + 2.0 * r * C
    out[2] = growth * z + 0.7 * a


def test_curve_of_tori():
    field = VectorField.from_function(torus, {"lam": -0.2, "a": 0.3}, 3)
    t = np.linspace(0.0, np.pi, 400)
    circle = np.stack([np.cos(2.0 * t), np.sin(2.0 * t), 0.0 * t], axis=1)
    branch = orbits_from_motion(field, "lam", t, circle, period=np.pi, bounds=(-0.5, 0.5),
                                intervals=16, scales=np.ones(3))
    point, = branch.of_kind("Neimark-Sacker")
    curve = orbit_curve(field, branch, point, "a", direction=-1.0, bounds=(-0.1, 0.5),
                        settings=Settings(points=30), width=1.0)
    assert curve.parameter == pytest.approx(curve.column("a") ** 2, abs=1e-9)
    # It goes through the turning point a = 0, and on.
    assert curve.column("a").min() < -0.1
    turning, = curve.special
    assert turning.kind == "turning point"
    assert turning.values["a"] == pytest.approx(0.0, abs=1e-6)


def test_kind_errors(masses):
    field, branch = masses
    with pytest.raises(InputError, match="'a regular point'; curves start at 'fold'"):
        orbit_curve(field, branch, branch.points[3], "v0")
    fold, = branch.of_kind("fold")
    with pytest.raises(InputError, match="no parameter 'speed'"):
        orbit_curve(field, branch, fold, "speed")
    with pytest.raises(InputError, match="second = 'B' is the parameter of the branch"):
        orbit_curve(field, branch, fold, "B")
