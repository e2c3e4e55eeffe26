"""Orbits of three periods at resonances 1:3, in closed form."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_orbit_curves import circle_field

from fecontact import AnalysisError, InputError
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    orbit_branch,
    vector_field,
)
from fecontact.io import read_branch, write_branch

BOX = {"e": (-0.3, 0.3), "f": (-0.3, 0.3)}
C, B = -1.3 + 0.7j, 0.5 * np.exp(1.1j)


def third(t, x, p, out):
    # w' = (e + i (f + 2 / 3)) w + C w |w|^2 + (B1 + i B2) conj(w)^2 exp(i phi) across the circle,
    # w = a + i z with a = r - 1 - 0.2 z^2: in three turns w = z exp(i phi / 3) of
    # z' = (e + i f) z + C z |z|^2 + B conj(z)^2.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    c, s, z = x[0] / r, x[1] / r, x[2]
    a = r - 1.0 - 0.2 * z * z
    R, u, v = a * a + z * z, a * a - z * z, -2.0 * a * z
    k, m = p[2] * c - p[3] * s, p[2] * s + p[3] * c
    g, h = p[0] - 1.3 * R, p[1] + 2.0 / 3.0 + 0.7 * R
    dz = g * z + h * a + k * v + m * u
    radial = g * a - h * z + k * u - m * v + 0.4 * z * dz
    out[0], out[1] = radial * c - 2.0 * r * s, radial * s + 2.0 * r * c
    out[2] = dz


def driven(t, x, p, out):
    # The same with phi = 2 t, about the motion x1 = cos 2 t, x2 = sin 2 t.
    z = x[1] - np.sin(2.0 * t)
    a = x[0] - np.cos(2.0 * t) - 0.2 * z * z
    c, s = np.cos(2.0 * t), np.sin(2.0 * t)
    R, u, v = a * a + z * z, a * a - z * z, -2.0 * a * z
    k, m = p[2] * c - p[3] * s, p[2] * s + p[3] * c
    g, h = p[0] - 1.3 * R, p[1] + 2.0 / 3.0 + 0.7 * R
    dz = g * z + h * a + k * v + m * u
    out[0] = g * a - h * z + k * u - m * v + 0.4 * z * dz - 2.0 * s
    out[1] = dz + 2.0 * c


def resonance(B):
    """The field, and the curve of tori e = 0 through its resonance f = 0."""
    field, t, circle = circle_field(third, e=-0.2, f=-0.1, B1=B.real, B2=B.imag)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "e",
                          method=Collocation(intervals=16), bounds=BOX["e"], scales=np.ones(3))
    return field, codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "f", bounds=BOX)


@pytest.fixture(scope="module")
def strong():
    field, tori = resonance(B)
    return field, tori.of_kind("resonance 1:3")[0]


def plane(curve):
    """e + i f at all points."""
    return curve.column("e") + 1j * curve.column("f")


def squares(point):
    """Least and largest |w|^2 over an orbit."""
    x = point.orbit(samples=601).states
    r, z = np.hypot(x[:, 0], x[:, 1]), x[:, 2]
    R = (r - 1.0 - 0.2 * z * z) ** 2 + z * z
    return R.min(), R.max()


def test_normal_form(strong):
    """|w|^2 = 2 |z|^2 of a vector of unit mean square; the torus is stable as c < 0."""
    _, point = strong
    assert [point.values["e"], point.values["f"]] == pytest.approx([0.0, 0.0], abs=1e-8)
    expected = {"b": np.sqrt(2.0) * np.pi * abs(B), "c": 2.0 * np.pi * C.real}
    assert point.normal_form == pytest.approx(expected, rel=3e-8)
    for name, error in point.normal_form_errors.items():
        assert abs(point.normal_form[name] - expected[name]) < error < 1e-6


@pytest.mark.parametrize("over", ["e", "f"])
def test_orbits_of_three_periods_on_both_sides(strong, over):
    """Saddles near the point, |e + i f + C R| = |B| sqrt(R) of one R = |w|^2 all along."""
    field, point = strong
    branch = orbit_branch(field, point, over, method=Collocation(state_tolerance=1e-8),
                          bounds=BOX[over], both=True,
                          options=ContinuationOptions(largest_step=0.03))
    assert branch.status is {"e": BranchStatus.BOUND, "f": BranchStatus.CLOSED}[over]
    names = {"e": 0.0, "f": 0.0}
    for at in branch.points:
        names[over] = at.parameter
        low, high = squares(at)
        assert high == pytest.approx(low, rel=1e-4)
        assert abs(complex(*names.values()) + C * high) == pytest.approx(
            abs(B) * np.sqrt(high), rel=1e-4)
    assert branch.column("period") == pytest.approx(np.full(len(branch), 3.0 * np.pi), rel=1e-9)
    near = [at for at in branch.points if squares(at)[1] < 1e-3]
    assert {np.sign(at.parameter) for at in near} == {-1.0, 1.0}
    assert {at.values["unstable"] for at in near} == {1}
    one = orbit_branch(field, point, over, bounds=BOX[over], direction=-1.0,
                       options=ContinuationOptions(points=3))
    assert max(at.parameter for at in one.points) < 0.0
    if over == "e":
        # |B|^2 = 2 |C| |e| (1 + cos a), the angle a being that from C to e.
        fold, = branch.of_kind("fold")
        assert fold.parameter == pytest.approx(-0.125 / (abs(C) - C.real), rel=1e-8)


def test_folds_of_orbits_of_three_periods(strong):
    """On the parabola |B|^2 = 2 |C| |E| + 2 Re(E conj(C)), E = e + i f."""
    field, point = strong
    folds = codim2_curve(field, point, "f", bounds=BOX)
    E = plane(folds)
    assert 2.0 * (abs(C) * np.abs(E) + (E * np.conj(C)).real) == pytest.approx(
        np.full(len(E), 0.25), rel=1e-7)
    assert np.abs(E).min() == pytest.approx(0.0625 / abs(C), rel=1e-2)
    assert np.abs(E).max() > 0.3
    assert folds.column("period") == pytest.approx(np.full(len(E), 3.0 * np.pi), rel=1e-9)


def neutral(E):
    """Deviation from multipliers mu and 1 / mu: e = 2.6 R, |E + C R| = |B| sqrt(R)."""
    R = E.real / 2.6
    return np.abs(E + C * R) ** 2 - abs(B) ** 2 * R


def test_neutral_saddles_through_the_point(strong, tmp_path):
    """The curve touches that of tori, e = 0, and goes on at its other side."""
    field, point = strong
    curve = codim2_curve(field, point, "f", to="neutral saddle", bounds=BOX)
    E = plane(curve)
    assert np.abs(neutral(E)).max() < 1e-9
    assert np.abs(E).min() < 1e-3
    assert E.imag.min() < -0.15
    assert E.imag.max() > 0.05
    assert (E.real > -1e-9).all()
    assert E.real[[0, -1]] == pytest.approx([0.3, 0.3], rel=1e-9)
    assert curve.attributes["kind"] == "neutral saddle"
    again = read_branch(write_branch(tmp_path / "curve.h5", curve))
    assert (plane(again) == E).all()


def test_driven_orbits_of_three_periods():
    field = vector_field(driven, {"e": -0.2, "f": -0.1, "B1": B.real, "B2": B.imag}, 2,
                         period=np.pi)
    t = np.linspace(0.0, np.pi, 400)
    motion = np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)
    branch = orbit_branch(field, PeriodicMotion(t, motion), "e", method=Collocation(intervals=16),
                          bounds=BOX["e"], scales=np.ones(2))
    tori = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "f", bounds=BOX)
    point, = tori.of_kind("resonance 1:3")
    assert point.normal_form == pytest.approx(
        {"b": np.sqrt(2.0) * np.pi * abs(B), "c": 2.0 * np.pi * C.real}, rel=1e-7)
    saddles = orbit_branch(field, point, bounds=BOX["e"], options=ContinuationOptions(points=20))
    assert saddles.attributes["periods"] == 3
    assert saddles.points[0].values["unstable"] == 1
    curve = codim2_curve(field, point, "f", to="neutral saddle", bounds=BOX)
    assert np.abs(neutral(plane(curve))).max() < 1e-9


def van_der_pol(t, x, p, out):
    out[0] = x[1]
    out[1] = (1.0 - x[0] * x[0]) * x[1] - x[0] + p[0] * np.cos(p[1] * t)


def run(F, w, start, end):
    """States at the end of a run by another integrator."""
    return solve_ivp(lambda t, x: [x[1], (1.0 - x[0] ** 2) * x[1] - x[0] + F * np.cos(w * t)],
                     (0.0, end), start, method="DOP853", rtol=1e-11, atol=1e-12, dense_output=True)


def test_forced_van_der_pol():
    """Orbits of three periods close in runs; after half a period the motion is that with -x.

    The multiplier of that half is a third root of one at one point, and a sixth one, for which
    conj(z)^2 does not resonate, at the other.
    """
    field = vector_field(van_der_pol, {"F": 6.0, "w": 2.2}, 2,
                         period=lambda values: 2.0 * np.pi / values["w"])
    T = 2.0 * np.pi / 2.2
    t = np.linspace(59.0 * T, 60.0 * T, 400)
    motion = run(6.0, 2.2, [1.0, 0.0], t[-1]).sol(t).T
    branch = orbit_branch(field, PeriodicMotion(t - t[0], motion), "F",
                          method=Collocation(intervals=30), bounds=(0.5, 14.0), direction=-1.0)
    box = {"F": (0.5, 14.0), "w": (1.2, 6.0)}
    tori = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "w", bounds=box)
    symmetric, point = sorted(tori.of_kind("resonance 1:3"), key=lambda at: at.parameter)
    assert symmetric.normal_form["b"] < 1e-9
    with pytest.raises(AnalysisError, match="no orbit of 3 periods to this side"):
        orbit_branch(field, symmetric, bounds=box["F"])
    saddles = orbit_branch(field, point, bounds=box["F"],
                           method=Collocation(state_tolerance=1e-7))
    for at in saddles.points[:20:5]:
        F, start = at.parameter, at.orbit(field).states[0]
        end = run(F, point.values["w"], start, 6.0 * np.pi / point.values["w"]).y[:, -1]
        assert end == pytest.approx(start, abs=1e-8)
        third_of = run(F, point.values["w"], start, 2.0 * np.pi / point.values["w"]).y[:, -1]
        assert np.abs(third_of - start).max() > 1e-3
    assert saddles.points[0].values["unstable"] == 1


def test_orbits_of_three_periods_are_as_accurate_as_those_of_one():
    """The tolerances and the limit of intervals, three of them for each, are those of the curve."""
    field, t, circle = circle_field(third, e=-0.2, f=-0.1, B1=B.real, B2=B.imag)
    method = Collocation(16, tolerance=1e-8, most_intervals=100, state_tolerance=1e-8)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "e", method=method,
                          bounds=BOX["e"], scales=np.ones(3))
    tori = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "f", bounds=BOX)
    point, = tori.of_kind("resonance 1:3")
    saddles = orbit_branch(field, point, bounds=BOX["e"], options=ContinuationOptions(points=3))
    folds = codim2_curve(field, point, "f", bounds=BOX, options=ContinuationOptions(points=3))
    for found in (saddles, folds):
        assert found.method.tolerance == 1e-8
        assert found.method.state_tolerance == 1e-8
        assert found.method.most_intervals == 300
        assert found.method.intervals % 3 == 0
        assert found.column("state_error").max() <= 1e-8
        assert found.message == ""


def test_what_is_not_there(strong):
    field, point = strong
    with pytest.raises(InputError, match="must be one of them"):
        orbit_branch(field, point, "B1")
    with pytest.raises(InputError, match="known are: 'fold', 'neutral saddle'"):
        codim2_curve(field, point, "f", to="period doubling", bounds=BOX)
    # Folds lie at |E| >= |B|^2 / (4 |C|), far away.
    field, tori = resonance(2.0 * B / abs(B))
    far, = tori.of_kind("resonance 1:3")
    with pytest.raises(AnalysisError, match="no fold of orbits of three periods was found beside"):
        codim2_curve(field, far, "f", bounds=BOX)
