"""Curves over two parameters are continued from any of their points, against closed forms."""

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    codim2_curve,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.io import read_branch, write_branch

FEW = ContinuationOptions(step=0.01, largest_step=0.02, points=8)
BOUNDS = {"m": (-2.0, 2.0), "n": (-2.0, 2.0)}


def cubic(t, x, p, out):
    """Folds at 27 m^2 = 4 n^3."""
    out[0] = p[0] + p[1] * x[0] - x[0] ** 3


def spiral(t, x, p, out):
    """A Hopf point at m = n^2, and orbits of radius r = (m - n^2)^(1/2) in the time 2 pi."""
    growth = p[0] - p[1] * p[1] - x[0] * x[0] - x[1] * x[1]
    out[0] = growth * x[0] - x[1]
    out[1] = growth * x[1] + x[0]


def two_circles(t, x, p, out):
    """r' = r (m + 2 n r^2 - r^4), turning by 1 + r^2 / 10: orbits turn at m = -n^2, r^2 = n."""
    square = x[0] * x[0] + x[1] * x[1]
    growth, w = p[0] + 2.0 * p[1] * square - square * square, 1.0 + 0.1 * square
    out[0] = growth * x[0] - w * x[1]
    out[1] = growth * x[1] + w * x[0]


def across(t, x, p, out):
    """A circle in the time pi; across it w' = (m - n^2 - |w|^2 + 0.7 i) w."""
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    growth = p[0] - p[1] * p[1] - a * a - z * z
    radial = growth * a - 0.7 * z
    out[0], out[1] = radial * C - 2.0 * r * S, radial * S + 2.0 * r * C
    out[2] = growth * z + 0.7 * a


def orbits(field, radius, period, size):
    t = np.linspace(0.0, period, 401)
    circle = radius * np.stack([np.cos(TURN * t / period), np.sin(TURN * t / period),
                                0.0 * t], axis=1)[:, :size]
    return orbit_branch(field, (t, circle), "m", method=Collocation(intervals=12),
                        bounds=(-1.0, 2.0), scales=np.ones(size),
                        options=ContinuationOptions(step=0.01, largest_step=0.05))


def folds():
    field = vector_field(cubic, {"m": 2.0, "n": 0.8}, ["x"])
    branch = equilibrium_branch(field, [1.5], "m", bounds=(-2.0, 2.0), direction=-1.0)
    return field, branch.of_kind("fold")[0], lambda m, n: 27.0 * m**2 - 4.0 * n**3


def hopf_points():
    field = vector_field(spiral, {"m": -0.5, "n": 0.4}, ["x", "y"])
    branch = equilibrium_branch(field, [0.0, 0.0], "m", bounds=(-2.0, 2.0))
    return field, branch.of_kind("Hopf")[0], lambda m, n: m - n**2


def folds_of_orbits():
    field = vector_field(two_circles, {"m": 0.3, "n": 0.6}, ["x", "y"])
    square = 0.6 + np.sqrt(0.36 + 0.3)
    branch = orbits(field, np.sqrt(square), TURN / (1.0 + 0.1 * square), 2)
    if not branch.of_kind("fold"):
        branch = orbit_branch(field, branch.points[0], direction=-1.0, bounds=(-1.0, 2.0))
    return field, branch.of_kind("fold")[0], lambda m, n: m + n**2


def tori():
    field = vector_field(across, {"m": -0.2, "n": 0.3}, ["x", "y", "z"])
    branch = orbits(field, 1.0, np.pi, 3)
    return field, branch.of_kind("Neimark-Sacker")[0], lambda m, n: m - n**2


@pytest.mark.parametrize("made", [folds, hopf_points, folds_of_orbits, tori])
def test_a_regular_point_goes_on_along_its_curve(made, tmp_path):
    field, start, off = made()
    curve = codim2_curve(field, start, "n", bounds=BOUNDS, options=FEW, both=False)
    write_branch(tmp_path / "curve.h5", curve)
    last = read_branch(tmp_path / "curve.h5").points[-1]
    assert last.kind is None
    heading = float(np.sign(last.tangent[-1]))
    on = codim2_curve(field, last, "n", bounds=BOUNDS, options=FEW, both=False, direction=heading)
    back = codim2_curve(field, last, "n", bounds=BOUNDS, options=FEW, both=False,
                        direction=-heading)
    for each in (curve, on, back):
        assert len(each) >= 8
        assert np.abs(off(each.parameter, each.column("n"))).max() < 1e-6
    assert on.attributes["kind"] == curve.attributes["kind"]
    assert on.points[0].parameter == pytest.approx(last.parameter, abs=1e-9)
    away = np.abs(on.parameter - curve.parameter[0])
    assert (np.diff(away) > 0.0).all()
    assert np.abs(back.parameter - last.parameter).max() > 0.1 * away[0]


def test_a_cusp_goes_on_along_its_curve():
    field, start, off = folds()
    curve = codim2_curve(field, start, "n", bounds=BOUNDS,
                         options=ContinuationOptions(step=0.02, largest_step=0.05))
    cusp, = curve.of_kind("cusp")
    sides = [codim2_curve(field, cusp, "n", bounds=BOUNDS, options=FEW, both=False, direction=side)
             for side in (1.0, -1.0)]
    for side in sides:
        assert np.abs(off(side.parameter, side.column("n"))).max() < 1e-6
    assert sides[0].parameter[-1] * sides[1].parameter[-1] < 0.0


def test_orbits_of_a_curve_of_folds_go_on_with_their_period():
    field, start, _ = folds_of_orbits()
    curve = codim2_curve(field, start, "n", bounds=BOUNDS, options=FEW, both=False)
    at = curve.points[5]
    kept = codim2_curve(field, at, "n", bounds=BOUNDS, options=FEW, both=False, keep="period")
    assert kept.column("period") == pytest.approx(at.values["period"], rel=1e-9)
    square = at.values["n"]
    assert kept.parameter == pytest.approx(square**2 - 2.0 * square * kept.column("n"), abs=1e-7)


def test_another_curve_must_begin_at_the_point():
    field, start, _ = folds()
    curve = codim2_curve(field, start, "n", bounds=BOUNDS, options=FEW, both=False)
    with pytest.raises(fc.InputError, match="leave it out to follow the curve"):
        codim2_curve(field, curve.points[3], "n", to="Hopf")
