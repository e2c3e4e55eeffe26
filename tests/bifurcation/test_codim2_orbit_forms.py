"""Normal forms of points of codimension two of orbits, behind changes of coordinates and time.

Across a circle of radius one, on which phi' = 2, fields are those of normal forms in amplitudes a,
z and s with r = 1 + a + 0.2 z^2; the speed along all orbits is 1 + 0.4 (r - 1). Where a = cos w t,
the angle then lags by 0.8 / w sin w t, which counts in the mean square of a vector.
"""

import numpy as np
import pytest
from test_orbit_curves import circle_field, doubling

from fecontact.bifurcation import (
    Collocation,
    PeriodicMotion,
    codim2_curve,
    orbit_branch,
    vector_field,
)
from fecontact.io import read_branch, write_branch

# |w|^2 in |z|^2 of vectors of unit mean square: of a pair that turns with w = 0.7, and u^2 of a
# direction that turns with w = 0.5, half of its square along a.
PAIR = 2.0 / (1.0 + 0.5 * (0.8 / 0.7) ** 2)
HALF = 1.0 / (1.0 + 0.5 * 0.8**2)
BOX = {"lam": (-0.3, 0.5), "k": (-0.5, 0.5)}


def found(function, states, first, start, second, kind, period=None, beside=None, **values):
    """The special points of some kind of a curve through the first point of a branch."""
    field = vector_field(function, {"lam": -0.2, "k": -0.4, **values}, states, period=period)
    t = np.linspace(0.0, np.pi, 400)
    motion = np.zeros((400, states))
    motion[:, 0], motion[:, 1] = np.cos(2.0 * t), np.sin(2.0 * t)
    if beside is not None:
        motion[:, 3] = beside
    branch = orbit_branch(field, PeriodicMotion(t, motion, period=np.pi), first,
                          method=Collocation(intervals=16), bounds=BOX[first],
                          scales=np.ones(states))
    curve = codim2_curve(field, branch.of_kind(start)[0], second, bounds=BOX)
    return curve, curve.of_kind(kind)


def close(point, rel=1e-6, **expected):
    """The coefficients, in pi (the period), and errors that are honest but small."""
    assert point.normal_form == pytest.approx(
        {name: np.pi * value for name, value in expected.items()}, rel=rel, abs=1e-8)
    for name, error in point.normal_form_errors.items():
        assert abs(point.normal_form[name] - np.pi * expected[name]) <= 1.1 * error + 1e-9
        assert error < 1e-3 * max(1.0, abs(expected[name]))


def cusp(t, x, p, out):
    # a' = lam + k a - 2 a^3 with r = 1 + a + 0.2 z^2, z' = a^2 - z.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z = x[0] / r, x[1] / r, x[2]
    a, speed = r - 1.0 - 0.2 * z * z, 1.0 + 0.4 * (r - 1.0)
    dz = a * a - z
    radial = speed * (p[0] + p[1] * a - 2.0 * a * a * a + 0.4 * z * dz)
    out[0], out[1] = radial * C - 2.0 * speed * r * S, radial * S + 2.0 * speed * r * C
    out[2] = speed * dz


def test_cusp():
    field, t, circle = circle_field(cusp, lam=0.2, k=0.5)
    a = np.roots([-2.0, 0.0, 0.5, 0.2]).real.max()
    branch = orbit_branch(field, PeriodicMotion(t, (1.0 + a) * circle, period=np.pi), "lam",
                          method=Collocation(intervals=16), bounds=(-0.3, 0.3), scales=np.ones(3),
                          direction=-1.0)
    curve = codim2_curve(field, branch.of_kind("fold")[0], "k", bounds=BOX)
    point, = curve.of_kind("cusp")
    close(point, c=-2.0)


def test_generalised_period_doubling():
    """a' = -a^5 along the direction that turns by half a turn."""
    field, t, circle = circle_field(doubling, lam=-0.4, k=-0.5)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                          method=Collocation(intervals=16), bounds=(-0.5, 0.5), scales=np.ones(3))
    curve = codim2_curve(field, branch.of_kind("period doubling")[0], "k", bounds=BOX)
    close(curve.of_kind("generalised period doubling")[0], e=-1.0)


def chenciner(t, x, p, out):
    # w' = (lam + 0.7 i) w + (k - 0.2 + 0.5 i) w |w|^2 + (-1.5 + 0.3 i) w |w|^4, w = a + i z.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z = x[0] / r, x[1] / r, x[2]
    a, speed = r - 1.0 - 0.2 * z * z, 1.0 + 0.4 * (r - 1.0)
    s = a * a + z * z
    g, h = p[0] + (p[1] - 0.2) * s - 1.5 * s * s, 0.7 + 0.5 * s + 0.3 * s * s
    dz = speed * (g * z + h * a)
    radial = speed * (g * a - h * z) + 0.4 * z * dz
    out[0], out[1] = radial * C - 2.0 * speed * r * S, radial * S + 2.0 * speed * r * C
    out[2] = dz


def driven_chenciner(t, x, p, out):
    # The same about the motion cos 2 t, sin 2 t, with x1 = cos 2 t + a + 0.2 z^2, x2 = sin 2 t + z.
    z = x[1] - np.sin(2.0 * t)
    a = x[0] - np.cos(2.0 * t) - 0.2 * z * z
    s = a * a + z * z
    g, h = p[0] + (p[1] - 0.2) * s - 1.5 * s * s, 0.7 + 0.5 * s + 0.3 * s * s
    dz = g * z + h * a
    out[0] = g * a - h * z + 0.4 * z * dz - 2.0 * np.sin(2.0 * t)
    out[1] = dz + 2.0 * np.cos(2.0 * t)


@pytest.mark.parametrize(("function", "states", "period"), [
    (chenciner, 3, None), (driven_chenciner, 2, np.pi)])
def test_chenciner(function, states, period, tmp_path):
    curve, (point,) = found(function, states, "lam", "Neimark-Sacker", "k", "Chenciner", period)
    assert [point.values["lam"], point.values["k"]] == pytest.approx([0.0, 0.2], abs=1e-8)
    close(point, rel=1e-5, d=-1.5 * (2.0 if period else PAIR) ** 2)
    again, = read_branch(write_branch(tmp_path / "curve.h5", curve)).of_kind("Chenciner")
    assert again.normal_form == point.normal_form
    assert again.normal_form_errors == point.normal_form_errors
    assert curve.points[0].normal_form == {}


def takens(t, x, p, out):
    # a'' = lam + k a + 1.5 a^2 - 0.8 a a' across the circle, a' = z.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z = x[0] / r, x[1] / r, x[2]
    a, speed = r - 1.0 - 0.2 * z * z, 1.0 + 0.4 * (r - 1.0)
    dz = speed * (p[0] + p[1] * a + 1.5 * a * a - 0.8 * a * z)
    radial = speed * z + 0.4 * z * dz
    out[0], out[1] = radial * C - 2.0 * speed * r * S, radial * S + 2.0 * speed * r * C
    out[2] = dz


@pytest.mark.parametrize("kind", ["fold", "Neimark-Sacker"])
def test_resonance_1_1(kind):
    """With a change of the phase that leaves them as they are."""
    field, t, circle = circle_field(takens, lam=-0.05, k=-0.5)
    a = np.roots([1.5, -0.5, -0.05]).min()
    branch = orbit_branch(field, PeriodicMotion(t, (1.0 + a) * circle, period=np.pi), "lam",
                          method=Collocation(intervals=16), bounds=(-0.3, 0.3), scales=np.ones(3))
    curve = codim2_curve(field, branch.of_kind(kind)[0], "k", bounds=BOX)
    point, = curve.of_kind("resonance 1:1")
    close(point, a=1.5 * np.pi, b=-0.8)


def half(t, x, p, out):
    # w = (a + i b) exp(i phi / 2), a' = b, b' = lam a + k b - 1.2 a^3 + 0.7 a^2 b, r = 1 + Re w.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z = x[0] / r, x[1] / r, x[2]
    u, speed = r - 1.0 - 0.2 * z * z, 1.0 + 0.4 * (r - 1.0)
    square = (u * u + z * z + (u * u - z * z) * C + 2.0 * u * z * S) / 2.0
    e, f = p[0] - 1.2 * square, p[1] + 0.7 * square
    ca, sa = (u * (1.0 + C) + z * S) / 2.0, (u * S + z * (1.0 - C)) / 2.0
    cb, sb = (z * (1.0 + C) - u * S) / 2.0, (z * S - u * (1.0 - C)) / 2.0
    dz = speed * (sb + (e * ca + f * cb) + u)
    radial = speed * (cb - (e * sa + f * sb) - z) + 0.4 * z * dz
    out[0], out[1] = radial * C - 2.0 * speed * r * S, radial * S + 2.0 * speed * r * C
    out[2] = dz


def test_resonance_1_2():
    _, (point,) = found(half, 3, "k", "Neimark-Sacker", "lam", "resonance 1:2", lam=-0.25)
    close(point, c=-1.2 * HALF * np.pi, d=0.7 * HALF)
    field = vector_field(half, {"lam": -0.25, "k": -0.4}, 3)
    doublings = codim2_curve(field, point, "lam", bounds=BOX)
    again, = doublings.of_kind("resonance 1:2")
    close(again, c=-1.2 * HALF * np.pi, d=0.7 * HALF)


def flip_fold(t, x, p, out):
    # s' = lam + 1.3 s^2 - 0.9 a^2, a' = (k + 0.6 s + 0.5 s^2) a, a turned by half a turn, x4 = s.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z, s = x[0] / r, x[1] / r, x[2], x[3]
    u, speed = r - 1.0 - 0.2 * z * z, 1.0 + 0.4 * (r - 1.0) + 0.2 * s
    square = (u * u + z * z + (u * u - z * z) * C + 2.0 * u * z * S) / 2.0
    growth = p[1] + 0.6 * s + 0.5 * s * s
    low, high = (growth - 1.0) / 2.0, (growth + 1.0) / 2.0
    dz = speed * (low * z + high * (S * u - C * z) + u)
    radial = speed * (low * u + high * (C * u + S * z) - z) + 0.4 * z * dz
    out[0], out[1] = radial * C - 2.0 * speed * r * S, radial * S + 2.0 * speed * r * C
    out[2] = dz
    out[3] = speed * (p[0] + 1.3 * s * s - 0.9 * square)


def turning_fold(t, x, p, out):
    # s' = lam + 1.3 s^2 - 0.9 |w|^2, w' = (k + 0.6 s + 0.5 s^2 + 0.7 i) w, w = a + i z, x4 = s.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z, s = x[0] / r, x[1] / r, x[2], x[3]
    a, speed = r - 1.0 - 0.2 * z * z, 1.0 + 0.4 * (r - 1.0) + 0.2 * s
    growth = p[1] + 0.6 * s + 0.5 * s * s
    dz = speed * (growth * z + 0.7 * a)
    radial = speed * (growth * a - 0.7 * z) + 0.4 * z * dz
    out[0], out[1] = radial * C - 2.0 * speed * r * S, radial * S + 2.0 * speed * r * C
    out[2] = dz
    out[3] = speed * (p[0] + 1.3 * s * s - 0.9 * (a * a + z * z))


@pytest.mark.parametrize(("first", "start", "second"), [
    ("lam", "fold", "k"), ("k", "critical", "lam")])
@pytest.mark.parametrize(("function", "critical", "kind", "c"), [
    (flip_fold, "period doubling", "fold-flip", -0.9 * HALF),
    (turning_fold, "Neimark-Sacker", "fold-Neimark-Sacker", -0.9 * PAIR)])
def test_folds_with_another_multiplier(function, critical, kind, c, first, start, second):
    """Behind a change of time in which e is that of the field again."""
    s = -np.sqrt(0.2 / 1.3)
    _, (point,) = found(function, 4, first, critical if start == "critical" else start, second,
                        kind, beside=s, k=-0.3)
    assert [point.values["lam"], point.values["k"]] == pytest.approx([0.0, 0.0], abs=1e-6)
    close(point, rel=1e-5, b=1.3, c=c, d=0.6, e=0.5)


def two_tori(t, x, p, out):
    # w' = (lam - 1.1 |w|^2 - 0.4 |v|^2 + 0.7 i) w, v' = (k - 0.1 + 2 |w|^2 - 0.7 |v|^2 + 0.45 i) v.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z, v, y = x[0] / r, x[1] / r, x[2], x[3], x[4]
    a, speed = r - 1.0 - 0.2 * z * z, 1.0 + 0.4 * (r - 1.0)
    one, other = a * a + z * z, v * v + y * y
    g, k = p[0] - 1.1 * one - 0.4 * other, p[1] - 0.1 + 2.0 * one - 0.7 * other
    dz = speed * (g * z + 0.7 * a)
    radial = speed * (g * a - 0.7 * z) + 0.4 * z * dz
    out[0], out[1] = radial * C - 2.0 * speed * r * S, radial * S + 2.0 * speed * r * C
    out[2] = dz
    out[3], out[4] = speed * (k * v - 0.45 * y), speed * (k * y + 0.45 * v)


def flip_and_torus(t, x, p, out):
    # a' = (k - 1.1 a^2 - 0.4 |v|^2) a, turned by half a turn, v' = (lam - 0.1 + 2 a^2 - ...) v.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z, v, y = x[0] / r, x[1] / r, x[2], x[3], x[4]
    u, speed = r - 1.0 - 0.2 * z * z, 1.0 + 0.4 * (r - 1.0)
    one, other = (u * u + z * z + (u * u - z * z) * C + 2.0 * u * z * S) / 2.0, v * v + y * y
    g, k = p[1] - 1.1 * one - 0.4 * other, p[0] - 0.1 + 2.0 * one - 0.7 * other
    low, high = (g - 1.0) / 2.0, (g + 1.0) / 2.0
    dz = speed * (low * z + high * (S * u - C * z) + u)
    radial = speed * (low * u + high * (C * u + S * z) - z) + 0.4 * z * dz
    out[0], out[1] = radial * C - 2.0 * speed * r * S, radial * S + 2.0 * speed * r * C
    out[2] = dz
    out[3], out[4] = speed * (k * v - 0.45 * y), speed * (k * y + 0.45 * v)


@pytest.mark.parametrize(("function", "first", "start", "second", "kind", "expected"), [
    (two_tori, "lam", "Neimark-Sacker", "k", "double Neimark-Sacker",
     (-1.1 * PAIR, -0.8, 2.0 * PAIR, -1.4)),
    (flip_and_torus, "k", "period doubling", "lam", "flip-Neimark-Sacker",
     (-1.1 * HALF, -0.8, 2.0 * HALF, -1.4)),
    (flip_and_torus, "lam", "Neimark-Sacker", "k", "flip-Neimark-Sacker",
     (-1.1 * HALF, -0.8, 2.0 * HALF, -1.4))])
def test_two_amplitudes(function, first, start, second, kind, expected):
    _, (point,) = found(function, 5, first, start, second, kind)
    close(point, **dict(zip(("p11", "p12", "p21", "p22"), expected, strict=True)))
