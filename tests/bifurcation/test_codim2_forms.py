"""Normal forms of points of codimension two, behind nonlinear changes of coordinates."""

import numpy as np
import pytest

from fecontact.bifurcation import codim2_curve, equilibrium_branch, vector_field
from fecontact.io import read_branch, write_branch

BOX = {"a": (-1.0, 1.0), "b": (-1.0, 1.0)}


def at(function, start, states, kind, found, first="a", second="b", **parameters):
    """A special point of the curve through the first one of some kind."""
    field = vector_field(function, {"a": -0.5, "b": -0.4, **parameters}, states)
    branch = equilibrium_branch(field, start, first, bounds=BOX[first], both=True)
    curve = codim2_curve(field, branch.of_kind(kind)[0], second, bounds=BOX)
    return curve, curve.of_kind(found)[0]


def close(point, rel=1e-6, **expected):
    """The coefficients, and errors that are honest but small."""
    assert point.normal_form == pytest.approx(expected, rel=rel)
    for name, error in point.normal_form_errors.items():
        assert abs(point.normal_form[name] - expected[name]) <= error + 1e-9
        assert error < 1e-3 * abs(expected[name])


def cusp(t, x, p, out):
    # u' = a + b u - 2 u^3, v' = u^2 - v, in u = x1 + 0.3 x2^2 + 0.1 x1 x2
    # and v = x2.
    v = x[1]
    u = x[0] * (1.0 + 0.1 * v) + 0.3 * v * v
    du = p[0] + p[1] * u - 2.0 * u * u * u
    out[1] = u * u - v
    out[0] = (du - (0.1 * x[0] + 0.6 * v) * out[1]) / (1.0 + 0.1 * v)


def curved_cusp(t, x, p, out):
    # x1' = a + b x1 + x1 x2, x2' = -x2 - 3 x1^2: on x2 = -3 x1^2 + ..., x1' = -3 x1^3.
    out[0] = p[0] + p[1] * x[0] + x[0] * x[1]
    out[1] = -x[1] - 3.0 * x[0] * x[0]


@pytest.mark.parametrize(("function", "c"), [(cusp, -2.0), (curved_cusp, -3.0)])
def test_cusp(function, c):
    _, point = at(function, [0.5, 0.1], 2, "fold", "cusp", b=0.6, a=-0.1)
    close(point, c=c)


def bautin(t, x, p, out):
    # z' = (a + 2 i) z + b z |z|^2 + 1.5 z |z|^4 for z = u + i v, with u = x1 + 0.3 x2^2 - 0.2 x2^3
    # and v = x2 + 0.4 u^2 + 0.1 u^3.
    u = x[0] + 0.3 * x[1] * x[1] - 0.2 * x[1] * x[1] * x[1]
    v = x[1] + 0.4 * u * u + 0.1 * u * u * u
    r = u * u + v * v
    g = p[0] + p[1] * r + 1.5 * r * r
    du, dv = g * u - 2.0 * v, g * v + 2.0 * u
    out[1] = dv - (0.8 * u + 0.3 * u * u) * du
    out[0] = du - (0.6 * x[1] - 0.6 * x[1] * x[1]) * out[1]


def test_bautin(tmp_path):
    """r^2 is twice the |z|^2 of an eigenvector of length one: l2 = 1.5 * 4 / 2."""
    curve, point = at(bautin, [0.0, 0.0], 2, "Hopf", "Bautin")
    assert [point.values["a"], point.values["b"]] == pytest.approx([0.0, 0.0], abs=1e-8)
    close(point, l2=3.0)
    again, = read_branch(write_branch(tmp_path / "curve.h5", curve)).of_kind("Bautin")
    assert again.normal_form == point.normal_form
    assert again.normal_form_errors == point.normal_form_errors
    assert curve.points[0].normal_form == {}


def takens(t, x, p, out):
    # u' = v, v' = a + b u + 1.5 u^2 - 0.8 u v, u = x1 + 0.3 x2^2 + 0.2 x1 x2 about x = 0.
    u = x[0]
    v = x[1] + 0.6 * u * u - 0.3 * u * x[1]
    dv = p[0] + p[1] * u + 1.5 * u * u - 0.8 * u * v
    out[0] = v
    out[1] = (dv - (1.2 * u - 0.3 * x[1]) * v) / (1.0 - 0.3 * u)


@pytest.mark.parametrize("kind", ["fold", "Hopf"])
def test_bogdanov_takens(kind):
    """The change v = x2 + 0.6 u^2 - ... leaves a = 1.5 and b = -0.8 as they are."""
    _, point = at(takens, [-0.35, 0.0], 2, kind, "Bogdanov-Takens", a=-0.3, b=-0.4)
    close(point, a=1.5, b=-0.8)


def zero_hopf(t, x, p, out):
    # (1 + 0.4 u) times u' = a + 1.3 u^2 - 0.9 r^2, r' = r (b + 0.6 u + 0.5 u^2), w = 3, where
    # u = x1 + 0.2 x2^2 - 0.3 x2 x3 + 0.1 x2^3 and v = x2 + 0.25 u^2 - 0.15 u x3.
    u = x[0] + 0.2 * x[1] * x[1] - 0.3 * x[1] * x[2] + 0.1 * x[1] * x[1] * x[1]
    z = x[2]
    v = x[1] + 0.25 * u * u - 0.15 * u * z
    speed = 1.0 + 0.4 * u
    g = p[1] + 0.6 * u + 0.5 * u * u
    du = speed * (p[0] + 1.3 * u * u - 0.9 * (v * v + z * z))
    dv, dz = speed * (g * v - 3.0 * z), speed * (g * z + 3.0 * v)
    out[1] = dv - (0.5 * u - 0.15 * z) * du + 0.15 * u * dz
    out[0] = du - (0.4 * x[1] - 0.3 * z + 0.3 * x[1] * x[1]) * out[1] + 0.3 * x[1] * dz
    out[2] = dz


@pytest.mark.parametrize("kind", ["fold", "Hopf"])
def test_zero_hopf(kind):
    """Orbitally equivalent fields: e + d alpha with the speed 1 + alpha u is e again."""
    _, point = at(zero_hopf, [0.6, 0.0, 0.0], 3, kind, "zero-Hopf", a=-0.5, b=-0.3)
    # r^2 = 2 |z|^2.
    close(point, b=1.3, c=-1.8, d=0.6, e=0.5)


def two_pairs(t, x, p, out):
    # r' = r (a - 1.1 r^2 - 0.4 s^2), s' = s (b + 2 r^2 - 0.7 s^2), with sheared coordinates.
    u = x[0] + 0.3 * x[1] * x[1] - 0.2 * x[2] * x[3] + 0.1 * x[2] * x[2] * x[2]
    y, z = x[1] + 0.2 * u * x[3], x[3]
    v = x[2] + 0.25 * u * u - 0.15 * y * z
    r, s = u * u + y * y, v * v + z * z
    g, k = p[0] - 1.1 * r - 0.4 * s, p[1] + 2.0 * r - 0.7 * s
    du, dy = g * u - y, g * y + u
    dv, dz = k * v - 1.7 * z, k * z + 1.7 * v
    out[3] = dz
    out[2] = dv - 0.5 * u * du + 0.15 * (dy * z + y * dz)
    out[1] = dy - 0.2 * (du * x[3] + u * dz)
    out[0] = (du - 0.6 * x[1] * out[1] + 0.2 * (out[2] * x[3] + x[2] * dz)
              - 0.3 * x[2] * x[2] * out[2])


def test_double_hopf():
    _, point = at(two_pairs, np.zeros(4), 4, "Hopf", "double Hopf")
    close(point, p11=-2.2, p12=-0.8, p21=4.0, p22=-1.4)
    _, point = at(two_pairs, np.zeros(4), 4, "Hopf", "double Hopf", "b", "a")
    close(point, p11=-1.4, p12=4.0, p21=-0.8, p22=-2.2)


def oscillator(t, x, p, out):
    # The catalytic oscillator of MatCont's manual.
    z = 1.0 - x[0] - x[1] - x[2]
    out[0] = 5.0 * z * z - 2.0 * x[0] * x[0] - 10.0 * x[0] * x[1]
    out[1] = p[0] * z - 0.1 * x[1] - 10.0 * x[0] * x[1]
    out[2] = 0.0675 * (z - p[1] * x[2])


def test_published_values_of_a_catalytic_oscillator():
    """Values printed by MatCont; the sign of a and b is that of a vector."""
    field = vector_field(oscillator, {"q2": 2.204678, "k": 0.4}, 3)
    branch = equilibrium_branch(field, [0.001137, 0.891483, 0.062345], "q2", bounds=(0.5, 2.3),
                                direction=-1.0)
    curve = codim2_curve(field, branch.of_kind("fold")[0], "k",
                         bounds={"q2": (0.5, 2.5), "k": (0.05, 2.0)})
    one, other = sorted(curve.of_kind("Bogdanov-Takens"), key=lambda point: point.values["k"])
    point, = curve.of_kind("cusp")
    assert [one.values["q2"], one.values["k"]] == pytest.approx([1.161199, 0.722339], rel=1e-6)
    assert [one.normal_form["a"], one.normal_form["b"]] == pytest.approx(
        [4.822563e-2, 1.937632], rel=1e-6)
    assert [other.normal_form["a"], other.normal_form["b"]] == pytest.approx(
        [8.378442e-2, 2.136280], rel=1e-6)
    assert point.normal_form["c"] == pytest.approx(0.3627844, rel=3e-5)


def lorenz84(t, x, p, out):
    # The extended model of Lorenz' atmosphere of 1984.
    out[0] = -x[1] * x[1] - x[2] * x[2] - 0.25 * (x[0] - p[0]) - 0.987 * x[3] * x[3]
    out[1] = x[0] * x[1] - x[0] * x[2] - x[1] + 0.25
    out[2] = x[0] * x[1] + x[0] * x[2] - x[2]
    out[3] = -1.04 * x[3] + 0.987 * x[3] * x[0] + p[1]


def test_second_lyapunov_coefficient_of_an_atmosphere():
    """Values of BifurcationKit.jl (test/lorenz84.jl), whose l2 is w times as large.

    Its Bogdanov-Takens point is one of Newton's method, its Bautin point is where a step of the
    curve is bisected to 1e-3 of l2.
    """
    field = vector_field(lorenz84, {"F": 3.0, "T": 0.04}, 4)
    box = {"F": (0.5, 4.0), "T": (-0.05, 0.1)}
    branch = equilibrium_branch(field, [2.9787, -0.0387, 0.0582, -0.0211], "F", bounds=(0.5, 3.2),
                                both=True)
    hopf = min(branch.of_kind("Hopf"), key=lambda point: abs(point.parameter - 2.4672))
    curve = codim2_curve(field, hopf, "T", bounds=box)
    point, = curve.of_kind("Bautin")
    w = 2.0 * np.pi * point.values["frequency_hz"]
    assert w == pytest.approx(0.6903636672622595, abs=1e-5)
    assert w * point.normal_form["l2"] == pytest.approx(0.15555332623343107, rel=2e-3)
    takens, = curve.of_kind("Bogdanov-Takens")
    assert [takens.normal_form["a"], takens.normal_form["b"]] == pytest.approx(
        [0.2144233509273467, 0.6065145518280868], rel=1e-8)
