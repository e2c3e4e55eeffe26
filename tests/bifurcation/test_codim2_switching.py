"""Curves that begin at points of codimension two, in systems in which they are known."""

from dataclasses import replace

import numpy as np
import pytest
from test_codim2_forms import zero_hopf
from test_curves import takens
from test_orbit_curves import circle_field, doubling

from fecontact import AnalysisError, InputError
from fecontact.bifurcation import (
    BranchStatus,
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    codim2_nearby,
    equilibrium_branch,
    orbit_branch,
    vector_field,
)
from fecontact.io import read_branch, write_branch

PLANE = {"b": (-2.0, 1.0), "c": (-2.0, 2.0)}
BOX = {"a": (-1.0, 1.0), "b": (-1.0, 1.0)}


def through(field, start, name, kind, second, box, which=0):
    """The special points of a kind on the curve through that of another kind."""
    branch = equilibrium_branch(field, start, name, bounds=box[name])
    curve = codim2_curve(field, branch.of_kind(kind)[which], second, bounds=box)
    return curve, curve.special


def tangled(t, x, p, out):
    # x'' = b + c x' + x^2 + x x'
    out[0] = x[1]
    out[1] = p[0] + p[1] * x[1] + x[0] * x[0] + x[0] * x[1]


def test_hopf_points_from_a_bogdanov_takens_point_of_folds():
    """w^2 = -c, to one side; the points beyond are neutral saddles."""
    field = vector_field(takens, {"b": -1.0, "c": -1.0}, 2)
    _, special = through(field, [-0.6, 0.0], "b", "fold", "c", PLANE)
    point, = special
    curve = codim2_curve(field, point, "c", bounds=PLANE)
    assert curve.column("b") == pytest.approx(np.zeros(len(curve)), abs=1e-11)
    w = 2.0 * np.pi * curve.column("frequency_hz")
    assert w**2 == pytest.approx(-curve.column("c"), abs=1e-11)
    assert curve.column("c")[[0, -1]] == pytest.approx([0.0, -2.0], abs=2e-5)


@pytest.mark.parametrize("of_folds", [False, True])
def test_homoclinic_orbits_from_a_bogdanov_takens_point(of_folds):
    """b = -(49/25) c^2 + O(c^3), from the point on either curve and to it."""
    field = vector_field(tangled, {"b": -1.0, "c": 0.2}, 2)
    start, name, second = ([-1.0, 0.0], "b", "c") if of_folds else ([-1.0, 0.0], "c", "b")
    _, special = through(field, start, name, "fold" if of_folds else "Hopf", second, PLANE)
    point, = special
    assert point.kind == "Bogdanov-Takens"
    curve = codim2_curve(field, point, second, to="homoclinic", bounds=PLANE)
    b, c = curve.column("b"), curve.column("c")
    assert np.min(b) == pytest.approx(-2.0, rel=1e-9)
    small = (b < -1e-6) & (b > -1e-4)
    assert small.sum() > 1
    assert b[small] == pytest.approx(-1.96 * c[small] ** 2, rel=2e-3)
    # The end that AUTO-07p prints with periodic orbits of the period 60.
    assert c[np.argmin(b)] == pytest.approx(1.06764, abs=6e-6)


def two_pairs(t, x, p, out):
    # Amplitudes r' = r (a - r^2 - 0.4 s^2) and s' = s (b - 2 r^2 - s^2).
    r, s = x[0] * x[0] + x[1] * x[1], x[2] * x[2] + x[3] * x[3]
    g, k = p[0] - r - 0.4 * s, p[1] - 2.0 * r - s
    out[0], out[1] = g * x[0] - x[1], g * x[1] + x[0]
    out[2], out[3] = k * x[2] - 1.7 * x[3], k * x[3] + 1.7 * x[2]


@pytest.mark.parametrize(("first", "second", "slope", "w"), [("a", "b", 2.0, 1.0),
                                                             ("b", "a", 0.4, 1.7)])
def test_tori_from_a_double_hopf_point(first, second, slope, w, tmp_path):
    """Orbits r^2 = a lose stability at b = 2 a, those s^2 = b at a = 0.4 b."""
    field = vector_field(two_pairs, {"a": -0.5, "b": -0.5}, 4)
    curve, special = through(field, np.zeros(4), first, "Hopf", second, BOX)
    point, = read_branch(write_branch(tmp_path / "c.h5", curve)).of_kind("double Hopf")
    tori = codim2_curve(field, point, second, to="Neimark-Sacker", bounds=BOX)
    x, y = tori.column(first), tori.column(second)
    assert y == pytest.approx(slope * x, abs=1e-9)
    assert [x.min(), x.max()] == pytest.approx([0.0, min(1.0, 1.0 / slope)], abs=1e-4)
    assert tori.column("period") == pytest.approx(np.full(len(tori), 2.0 * np.pi / w), rel=1e-9)
    assert tori.status in (BranchStatus.HOPF, BranchStatus.BOUND)
    assert len(special) == 1
    assert not tori.of_kind("Chenciner")
    with pytest.raises(InputError, match="no curve to = 'homoclinic' begins there; known are: "
                                         "'Neimark-Sacker'"):
        codim2_curve(field, point, second, to="homoclinic")


def rolling(t, x, p, out):
    # x' = a + x^2 + r^2, r' = r (b - x + x^2): cycles r^2 = -a at x = 0, b = 0, turn into tori.
    r, g = x[1] * x[1] + x[2] * x[2], p[1] - x[0] + x[0] * x[0]
    out[0] = p[0] + x[0] * x[0] + r
    out[1], out[2] = g * x[1] - x[2], g * x[2] + x[1]


@pytest.mark.parametrize("kind", [pytest.param("fold", marks=pytest.mark.slow), "Hopf"])
def test_tori_from_a_zero_hopf_point(kind):
    field = vector_field(rolling, {"a": -0.5, "b": -0.9}, 3)
    curve, _ = through(field, [0.7, 0.0, 0.0], "a", kind, "b", BOX)
    point = curve.of_kind("zero-Hopf")[0]
    tori = codim2_curve(field, point, "b", to="Neimark-Sacker", bounds=BOX)
    assert tori.column("b") == pytest.approx(np.zeros(len(tori)), abs=1e-10)
    a = tori.column("a")
    assert [a.min(), a.max()] == pytest.approx([-1.0, 0.0], abs=1e-5)
    # The angle is that of the pair +- i sqrt(2 |a|) over the period 2 pi.
    quarter = tori.of_kind("resonance 1:4")
    assert sorted(2.0 * at.values["a"] * -16.0 for at in quarter) == pytest.approx(
        [1.0, 9.0, 25.0], abs=1e-6)


def test_no_bautin_point_beside_a_zero_hopf_point():
    """Hopf points at a = -1.3 u^2, where l1 is (0.6 + u) / u times a positive number."""
    field = vector_field(zero_hopf, {"a": -0.5, "b": -0.3}, 3)
    folds, _ = through(field, [0.6, 0.0, 0.0], "a", "fold", "b", BOX)
    curve = codim2_curve(field, folds.of_kind("zero-Hopf")[0], "b", bounds=BOX)
    bautin, = curve.of_kind("Bautin")
    assert [bautin.values["a"], bautin.values["b"]] == pytest.approx([-0.468, 0.18], rel=1e-6)


def no_torus(t, x, p, out):
    # ``rolling`` with the opposite sign of r^2: no torus.
    r, g = x[1] * x[1] + x[2] * x[2], p[1] + x[0] + x[0] * x[0]
    out[0] = p[0] + x[0] * x[0] + r
    out[1], out[2] = g * x[1] - x[2], g * x[2] + x[1]


def test_there_need_not_be_a_torus():
    field = vector_field(no_torus, {"a": -0.5, "b": -0.4}, 3)
    curve, _ = through(field, [-0.7, 0.0, 0.0], "a", "fold", "b", BOX)
    with pytest.raises(AnalysisError, match="no tori begin there; its normal form has c d = 2, "):
        codim2_curve(field, curve.of_kind("zero-Hopf")[0], "b", to="Neimark-Sacker", bounds=BOX)


def climbing(t, x, p, out):
    # x' = a + x^2 - r^2, r' = r (b + x + x^2): tori at x = 0, b = 0, a > 0, Hopf points at a < 0.
    r, g = x[1] * x[1] + x[2] * x[2], p[1] + x[0] + x[0] * x[0]
    out[0] = p[0] + x[0] * x[0] - r
    out[1], out[2] = g * x[1] - x[2], g * x[2] + x[1]


def test_tori_that_lie_on_no_branch_over_one_parameter():
    field = vector_field(climbing, {"a": -0.5, "b": -0.4}, 3)
    curve, _ = through(field, [-0.7, 0.0, 0.0], "a", "fold", "b", BOX)
    tori = codim2_curve(field, curve.of_kind("zero-Hopf")[0], "b", to="Neimark-Sacker", bounds=BOX)
    assert tori.column("b") == pytest.approx(np.zeros(len(tori)), abs=1e-9)
    assert np.sort(tori.column("a"))[[0, -1]] == pytest.approx([0.0, 1.0], abs=1e-3)


def test_why_nothing_was_found_is_kept(monkeypatch):
    def failing(*_, **__):
        raise AnalysisError("No orbit.")

    monkeypatch.setattr(codim2_nearby, "orbit_branch", failing)
    field = vector_field(tangled, {"b": -1.0, "c": 0.2}, 2)
    _, (point,) = through(field, [-1.0, 0.0], "b", "fold", "c", PLANE)
    with pytest.raises(AnalysisError, match="no homoclinic orbit was found beside it") as found:
        codim2_curve(field, point, "c", to="homoclinic", bounds=PLANE)
    assert str(found.value.__cause__) == "No orbit."


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_folds_from_a_generalised_period_doubling(direction):
    """Doubled orbits turn at k^2 + 4 (lam - 0.3 k) = 0, k > 0, and end where they are single."""
    field, t, circle = circle_field(doubling, lam=-0.4, k=-0.5)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "lam",
                          method=Collocation(intervals=16), bounds=(-0.5, 0.5), scales=np.ones(3))
    box = {"lam": (-0.5, 0.5), "k": (-0.9, 0.9)}
    curve = codim2_curve(field, branch.of_kind("period doubling")[0], "k", bounds=box)
    point, = curve.of_kind("generalised period doubling")
    folds = codim2_curve(field, point, "k", bounds=box, direction=direction)
    k = folds.column("k")
    assert folds.parameter == pytest.approx(0.3 * k - 0.25 * k**2, abs=1e-8)
    assert folds.column("period") == pytest.approx(np.full(len(k), 2.0 * np.pi), rel=1e-8)
    assert [k.min(), k.max()] == pytest.approx([0.0, 0.9], abs=2e-3)
    turning, = folds.special
    assert [turning.kind, turning.parameter] == ["turning point", pytest.approx(0.09, abs=1e-9)]
    # Not once more beyond the point, with the halves exchanged.
    assert (np.diff(np.sign(np.diff(k))) == 0.0).all()


def strong(t, x, p, out):
    # Across the circle a'' = b + c a + a^2 - a a', the normal form of Bogdanov and Takens.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    a = r - 1.0
    out[0] = x[2] * x[0] / r - 2.0 * x[1]
    out[1] = x[2] * x[1] / r + 2.0 * x[0]
    out[2] = p[0] + p[1] * a + a * a - a * x[2]


def test_folds_and_tori_from_a_resonance_1_1():
    """Folds at 4 b = c^2, tori at b = 0, c < 0."""
    field, t, circle = circle_field(strong, b=-0.05, c=-0.5)
    a = np.roots([1.0, -0.5, -0.05]).min()
    branch = orbit_branch(field, PeriodicMotion(t, (1.0 + a) * circle, period=np.pi), "b",
                          method=Collocation(intervals=16), bounds=(-0.3, 0.3), scales=np.ones(3))
    box = {"b": (-0.3, 0.3), "c": (-0.8, 0.8)}
    tori = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "c", bounds=box)
    assert tori.status is BranchStatus.STOPPED
    point, = tori.of_kind("resonance 1:1")
    assert point is tori.points[-1]
    folds = codim2_curve(field, point, "c", bounds=box)
    c = folds.column("c")
    assert folds.parameter == pytest.approx(0.25 * c**2, abs=1e-10)
    assert np.sort(c)[[0, -1]] == pytest.approx([-0.8, 0.8], rel=1e-9)
    # The curve of folds from the branch knows the point too, where its tori begin.
    folds = codim2_curve(field, branch.of_kind("fold")[0], "c", bounds=box)
    assert [at.kind for at in folds.special if at.kind != "turning point"] == ["resonance 1:1"]
    again, = folds.of_kind("resonance 1:1")
    assert [again.values["b"], again.values["c"]] == pytest.approx([0.0, 0.0], abs=1e-5)
    found = codim2_curve(field, again, "c", to="Neimark-Sacker", bounds=box)
    assert found.parameter == pytest.approx(np.zeros(len(found)), abs=1e-10)
    assert np.sort(found.column("c"))[[0, -1]] == pytest.approx([-0.8, 0.0], abs=1e-5)
    assert not found.of_kind("Chenciner")


def test_tori_from_a_resonance_1_1_whatever_rounding_does():
    """At the resonance the equations have two directions; relative changes of 1e-14 of the orbit
    mix them. The tori lie at c < 0, whatever the mixture is.
    """
    field, t, circle = circle_field(strong, b=-0.05, c=-0.5)
    a = np.roots([1.0, -0.5, -0.05]).min()
    branch = orbit_branch(field, PeriodicMotion(t, (1.0 + a) * circle, period=np.pi), "b",
                          method=Collocation(intervals=16), bounds=(-0.3, 0.3), scales=np.ones(3))
    box = {"b": (-0.3, 0.3), "c": (-0.8, 0.8)}
    folds = codim2_curve(field, branch.of_kind("fold")[0], "c", bounds=box)
    point, = folds.of_kind("resonance 1:1")
    rng = np.random.default_rng(0)
    for _ in range(20):
        moved = replace(point, u=point.u * (1.0 + 1e-14 * rng.normal(size=len(point.u))))
        tori = codim2_curve(field, moved, "c", to="Neimark-Sacker", bounds=box,
                            options=ContinuationOptions(points=2))
        c = tori.column("c")
        assert c[-1] < c[0] < 1e-4
        assert c[-1] < -0.01


def half(t, x, p, out):
    # w = (a + i b) exp(i phi / 2) across the circle, a' = b, b' = e a + f b + c a^3 - a^2 b.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, u, v = x[0] / r, x[1] / r, r - 1.0, x[2]
    square = (u * u + v * v + (u * u - v * v) * C + 2.0 * u * v * S) / 2.0
    e, f = p[0] + p[2] * square, p[1] - square
    ca, sa = (u * (1.0 + C) + v * S) / 2.0, (u * S + v * (1.0 - C)) / 2.0
    cb, sb = (v * (1.0 + C) - u * S) / 2.0, (v * S - u * (1.0 - C)) / 2.0
    radial = cb - (e * sa + f * sb) - v
    out[0] = radial * C - 2.0 * r * S
    out[1] = radial * S + 2.0 * r * C
    out[2] = sb + (e * ca + f * cb) + u


def test_doublings_and_tori_of_doubled_orbits_from_a_resonance_1_2():
    """Doublings at e = 0; doubled orbits a^2 = e with tori at f = e, multipliers of w = sqrt(2 e)
    over two turns.
    """
    field, t, circle = circle_field(half, e=-0.3, f=-0.3, c=-1.0)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "f",
                          method=Collocation(intervals=16), bounds=(-0.5, 0.5), scales=np.ones(3))
    box = {"e": (-0.5, 0.5), "f": (-0.5, 0.5)}
    tori = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "e", bounds=box)
    point, = tori.of_kind("resonance 1:2")
    assert (tori.status, point) == (BranchStatus.STOPPED, tori.points[-1])
    assert [point.values["e"], point.values["f"]] == pytest.approx([0.0, 0.0], abs=1e-8)
    doublings = codim2_curve(field, point, "e", bounds=box)
    assert doublings.column("e") == pytest.approx(np.zeros(len(doublings)), abs=1e-8)
    assert np.sort(doublings.column("f"))[[0, -1]] == pytest.approx([-0.5, 0.5], rel=1e-9)
    assert not doublings.of_kind("generalised period doubling")
    doubled = codim2_curve(field, point, "e", to="Neimark-Sacker", bounds=box)
    e = doubled.column("e")
    # At the bound the pair meets the multiplier 1, a resonance 1:1, by roots of rounding.
    assert doubled.column("f") == pytest.approx(e, abs=1e-6)
    assert doubled.column("f")[e < 0.4999] == pytest.approx(e[e < 0.4999], abs=1e-8)
    assert doubled.column("period") == pytest.approx(np.full(len(e), 2.0 * np.pi), rel=1e-8)
    assert [e.min(), e.max()] == pytest.approx([0.0, 0.5], abs=1e-4)
    assert sorted(at.values["e"] for at in doubled.of_kind("resonance 1:4")) == pytest.approx(
        [1.0 / 32.0, 9.0 / 32.0], abs=1e-7)


def test_no_generalised_period_doubling_beside_a_resonance_1_2():
    """The coefficient of the doublings, c / f, has a pole there, whose sign rounding decides."""
    field, t, circle = circle_field(half, e=-0.3, f=-0.3, c=1.0)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "f",
                          method=Collocation(intervals=16), bounds=(-0.5, 0.5), scales=np.ones(3))
    box = {"e": (-0.5, 0.5), "f": (-0.5, 0.5)}
    tori = codim2_curve(field, branch.of_kind("Neimark-Sacker")[0], "e", bounds=box)
    point, = tori.of_kind("resonance 1:2")
    rng = np.random.default_rng(0)
    for _ in range(6):
        moved = replace(point, u=point.u * (1.0 + 1e-14 * rng.normal(size=len(point.u))))
        doublings = codim2_curve(field, moved, "e", bounds=box,
                                 options=ContinuationOptions(points=4))
        assert not doublings.of_kind("generalised period doubling")


def chenciner(t, x, p, out):
    # w' = (lam + 0.7 i) w + (k - 0.2) w |w|^2 - w |w|^4 across the circle.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    square = a * a + z * z
    growth = p[0] + (p[1] - 0.2) * square - square * square
    radial = growth * a - 0.7 * z
    out[0], out[1] = radial * C - 2.0 * r * S, radial * S + 2.0 * r * C
    out[2] = growth * z + 0.7 * a


def flip_fold(t, x, p, out):
    # s' = lam - s^2 beside the circle, a' = (k + 0.3 s) a - a^3 along its twisted direction.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, u, v = x[0] / r, x[1] / r, r - 1.0, x[2]
    square = (u * u + v * v + (u * u - v * v) * C + 2.0 * u * v * S) / 2.0
    growth = p[1] + 0.3 * x[3] - square
    low, high = (growth - 1.0) / 2.0, (growth + 1.0) / 2.0
    radial = low * u + high * (C * u + S * v) - v
    out[0], out[1] = radial * C - 2.0 * r * S, radial * S + 2.0 * r * C
    out[2] = low * v + high * (S * u - C * v) + u
    out[3] = p[0] - x[3] * x[3]


def turning_fold(t, x, p, out):
    # The same with a torus at k + 0.3 s = 0.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    growth = p[1] + 0.3 * x[3] - a * a - z * z
    radial = growth * a - 0.7 * z
    out[0], out[1] = radial * C - 2.0 * r * S, radial * S + 2.0 * r * C
    out[2] = growth * z + 0.7 * a
    out[3] = p[0] - x[3] * x[3]


def two_tori(t, x, p, out):
    # Pairs exp(pi (lam +- 0.7 i)) across the circle and exp(pi (k - 0.1 +- 0.45 i)) beside it.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, a, z = x[0] / r, x[1] / r, r - 1.0, x[2]
    growth, other = p[0] - a * a - z * z, p[1] - 0.1 - x[3] * x[3] - x[4] * x[4]
    radial = growth * a - 0.7 * z
    out[0], out[1] = radial * C - 2.0 * r * S, radial * S + 2.0 * r * C
    out[2] = growth * z + 0.7 * a
    out[3], out[4] = other * x[3] - 0.45 * x[4], other * x[4] + 0.45 * x[3]


def flip_and_torus(t, x, p, out):
    # A doubling at k = 0 along the twisted direction, and a pair exp(pi (lam - 0.1 +- 0.45 i)).
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    C, S, u, v = x[0] / r, x[1] / r, r - 1.0, x[2]
    square = (u * u + v * v + (u * u - v * v) * C + 2.0 * u * v * S) / 2.0
    growth, other = p[1] - square, p[0] - 0.1 - x[3] * x[3] - x[4] * x[4]
    low, high = (growth - 1.0) / 2.0, (growth + 1.0) / 2.0
    radial = low * u + high * (C * u + S * v) - v
    out[0], out[1] = radial * C - 2.0 * r * S, radial * S + 2.0 * r * C
    out[2] = low * v + high * (S * u - C * v) + u
    out[3], out[4] = other * x[3] - 0.45 * x[4], other * x[4] + 0.45 * x[3]


@pytest.mark.parametrize(("function", "first", "start", "second", "kind", "found"), [
    (chenciner, "lam", "Neimark-Sacker", "k", "Chenciner", (0.0, 0.2)),
    (flip_fold, "lam", "fold", "k", "fold-flip", (0.0, 0.0)),
    (flip_fold, "k", "period doubling", "lam", "fold-flip", (0.0, 0.0)),
    (turning_fold, "lam", "fold", "k", "fold-Neimark-Sacker", (0.0, 0.0)),
    (turning_fold, "k", "Neimark-Sacker", "lam", "fold-Neimark-Sacker", (0.0, 0.0)),
    (two_tori, "lam", "Neimark-Sacker", "k", "double Neimark-Sacker", (0.0, 0.1)),
    (flip_and_torus, "k", "period doubling", "lam", "flip-Neimark-Sacker", (0.1, 0.0)),
    (flip_and_torus, "lam", "Neimark-Sacker", "k", "flip-Neimark-Sacker", (0.1, 0.0))])
def test_special_points_of_curves_of_orbits(function, first, start, second, kind, found):
    states = {"chenciner": 3, "two_tori": 5, "flip_and_torus": 5}.get(function.__name__, 4)
    field = vector_field(function, {"lam": 0.25 if states == 4 else -0.2, "k": -0.4}, states)
    t = np.linspace(0.0, np.pi, 400)
    motion = np.zeros((400, states))
    motion[:, 0], motion[:, 1] = np.cos(2.0 * t), np.sin(2.0 * t)
    if states == 4:
        motion[:, 3] = 0.5
    box = {"lam": (-0.3, 0.5), "k": (-0.5, 0.5)}
    branch = orbit_branch(field, PeriodicMotion(t, motion, period=np.pi), first,
                          method=Collocation(intervals=16), bounds=box[first],
                          scales=np.ones(states), direction=-1.0 if start == "fold" else 1.0)
    curve = codim2_curve(field, branch.of_kind(start)[0], second, bounds=box,
                         options=ContinuationOptions(largest_step=0.04))
    point, = [at for at in curve.special if at.kind not in ("turning point", "resonance 1:4")]
    assert point.kind == kind
    assert [point.values["lam"], point.values["k"]] == pytest.approx(found, abs=1e-6)
