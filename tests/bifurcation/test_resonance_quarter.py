"""Folds of orbits of four periods at resonances 1:4, in closed form."""

import numpy as np
import pytest
from test_orbit_curves import circle_field

from fecontact import AnalysisError, InputError
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    orbit_branch,
)
from fecontact.io import read_branch, write_branch

BOX = {"e": (-0.3, 0.3), "f": (-0.3, 0.3)}


def quarter(t, x, p, out):
    # w' = (e + i (f + 0.5)) w + (-1.3 + 0.7 i) w |w|^2 + (D1 + i D2) conj(w)^3 exp(i phi) across
    # the circle, w = a + i z with a = r - 1 - 0.2 z^2: in four turns w = z exp(i phi / 4) of
    # z' = (e + i f) z + (-1.3 + 0.7 i) z |z|^2 + D conj(z)^3. If p[4] > 0, |w|^2 saturates there.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, z = x[0] / r, x[1] / r, x[2]
    a = r - 1.0 - 0.2 * z * z
    s = a * a + z * z
    u, v = a * (a * a - 3.0 * z * z), z * (z * z - 3.0 * a * a)
    k, m = p[2] * C - p[3] * S, p[2] * S + p[3] * C
    if p[4] > 0.0:
        s = p[4] * np.arctan(s / p[4])
    g, h = p[0] - 1.3 * s, p[1] + 0.5 + 0.7 * s
    dz = g * z + h * a + k * v + m * u
    radial = g * a - h * z + k * u - m * v + 0.4 * z * dz
    out[0], out[1] = radial * C - 2.0 * r * S, radial * S + 2.0 * r * C
    out[2] = dz


def resonance(D, saturation=0.0):
    """The field, and the curve of tori e = 0 through its resonance f = 0."""
    field, t, circle = circle_field(quarter, e=-0.2, f=-0.1, D1=D.real, D2=D.imag,
                                    saturation=saturation)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "e",
                          method=Collocation(intervals=16), bounds=BOX["e"], scales=np.ones(3))
    tori = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "f", bounds=BOX)
    return field, tori


@pytest.mark.parametrize("size", [0.9, 1.4])
def test_folds_from_a_resonance_1_4(size, tmp_path):
    """Rest points |(e + i f) / R + C| = |D|, R = |z|^2, are double where sin a = +- |D / C| for the
    angle a from -C to e + i f. For |D| = 1.4 one of them has e < 0, which no f leads to from -C.
    """
    D, C = size * np.exp(1.1j), -1.3 + 0.7j
    field, tori = resonance(D)
    point, = read_branch(write_branch(tmp_path / "tori.h5", tori)).of_kind("resonance 1:4")
    assert [point.values["e"], point.values["f"]] == pytest.approx([0.0, 0.0], abs=1e-8)
    for to, side in ((None, 1.0), ("other fold", -1.0)):
        folds = codim2_curve(field, point, "f", to=to, bounds=BOX)
        found = folds.column("e") + 1j * folds.column("f")
        far = np.abs(found) > 1e-3
        assert np.abs(found).min() < 1e-3
        assert far.sum() > 5
        assert np.sin(np.angle(found[far] / -C)) == pytest.approx(
            np.full(far.sum(), side * abs(D / C)), abs=1e-7)
        assert np.abs(np.angle(found[far] / -C)).max() < 0.5 * np.pi
        assert np.abs(found).max() > 0.3
        assert folds.column("period") == pytest.approx(np.full(len(folds), 4.0 * np.pi), rel=1e-9)
    with pytest.raises(InputError, match="no curve to = 'period doubling' begins there; known "
                                         "are: 'fold', 'other fold'"):
        codim2_curve(field, point, "f", to="period doubling", bounds=BOX)


@pytest.mark.parametrize(("saturation", "rel"), [(0.0, 1e-7), (1e-3, 1e-5), (1e-5, 1e-4)])
def test_normal_form(saturation, rel):
    """|w|^2 = 2 |z|^2 of a vector of unit mean square.

    At a saturation of 1e-5 series at radii from 1 % to 50 % of the range agree well, without a, b.
    """
    _, tori = resonance(0.9 * np.exp(1.1j), saturation)
    point, = tori.of_kind("resonance 1:4")
    expected = {"a": -2.6 * np.pi, "b": 1.4 * np.pi, "d": 1.8 * np.pi}
    assert point.normal_form == pytest.approx(expected, rel=rel)
    for name, error in point.normal_form_errors.items():
        assert abs(point.normal_form[name] - expected[name]) < error < 100.0 * rel


@pytest.mark.parametrize("size", [0.9, 1.6])
def test_orbits_of_four_periods(size):
    """|E + C R| = |D| R of E = e + i f and one R = |w|^2 all along.

    For |C| < |D| they surround the point; else both orbits lie between the folds, where the sine
    of the angle from -C to E is less than |D / C|.
    """
    C, D = -1.3 + 0.7j, size * np.exp(1.1j)
    field, tori = resonance(D)
    point, = tori.of_kind("resonance 1:4")
    branch = orbit_branch(field, point, "e", bounds=(-0.05, 0.05), both=True,
                          options=ContinuationOptions(largest_step=0.03))
    E, R = branch.parameter, []
    for at in branch.points:
        x = at.orbit(samples=601).states
        r, z = np.hypot(x[:, 0], x[:, 1]), x[:, 2]
        R.append(((r - 1.0 - 0.2 * z * z) ** 2 + z * z).mean())
    assert abs(E + C * np.array(R)) == pytest.approx(size * np.array(R), rel=1e-5)
    assert branch.column("period") == pytest.approx(np.full(len(E), 4.0 * np.pi), rel=1e-9)
    near = branch.points[int(np.argmin(np.abs(E)))]
    assert near.values["unstable"] == 1
    if size > abs(C):
        assert [E.min(), E.max()] == pytest.approx([-0.05, 0.05], rel=1e-9)
        return
    # e > 0 along f = 0 is the side of -C, at an angle with the sine 0.7 / |C| < |D / C|.
    assert E.min() > 0.0
    with pytest.raises(AnalysisError, match="no orbit of 4 periods to this side"):
        orbit_branch(field, point, "e", bounds=BOX["e"], direction=-1.0)


def test_there_are_no_folds_where_the_cubic_term_that_turns_is_larger():
    field, tori = resonance(1.6 * np.exp(1.1j))
    with pytest.raises(AnalysisError, match=r"no folds of orbits .* has \|C / D\| = 0\.9228"):
        codim2_curve(field, tori.of_kind("resonance 1:4")[0], "f", bounds=BOX)
