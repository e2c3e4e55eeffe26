"""Curves of folds and Hopf points in two parameters, against normal forms and polynomials."""

import numpy as np
import pytest
from systems import friction_slope, lorenz_field, two_mass_field, two_mass_jacobian

from fecontact import InputError
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    DoubleHopfPoint,
    ZeroHopfPoint,
    codim2_curve,
    equilibrium_branch,
    find_equilibrium,
    vector_field,
)
from fecontact.io import read_branch, write_branch

BOX = {"b": (-2.0, 2.0), "c": (-2.0, 2.0)}


def takens(t, x, p, out):
    """Normal form of Bogdanov and Takens: folds 4 b = c^2, Hopf points b = 0, c < 0, w^2 = -c."""
    out[0] = x[1]
    out[1] = p[0] + p[1] * x[0] + x[0] * x[0] - x[0] * x[1]


def cusp(t, x, p, out):
    """Folds 27 b^2 = 4 c^3."""
    out[0] = p[0] + p[1] * x[0] - x[0] * x[0] * x[0]


def bautin(t, x, p, out):
    """Hopf points b = 0, w = 1, with the first Lyapunov coefficient 2 c."""
    r = x[0] * x[0] + x[1] * x[1]
    a = p[0] + p[1] * r - r * r
    out[0] = a * x[0] - x[1]
    out[1] = a * x[1] + x[0]


def test_bogdanov_takens():
    field = vector_field(takens, {"b": -1.0, "c": -1.0}, 2)
    branch = equilibrium_branch(field, [-0.6, 0.0], "b", bounds=(-2.0, 2.0))
    hopf = codim2_curve(field, branch.of_kind("Hopf")[0], "c", bounds=BOX)
    assert hopf.status is BranchStatus.STOPPED
    end, = hopf.of_kind("Bogdanov-Takens")
    assert [end.values["b"], end.values["c"]] == pytest.approx([0.0, 0.0], abs=1e-10)
    assert end is hopf.points[-1]
    assert hopf.points[0].values["c"] == pytest.approx(-2.0, rel=1e-12)
    assert hopf.column("b") == pytest.approx(np.zeros(len(hopf)), abs=1e-12)
    w = 2.0 * np.pi * hopf.column("frequency_hz")
    assert w**2 == pytest.approx(-hopf.column("c"), abs=1e-12)
    fold = codim2_curve(field, branch.of_kind("fold")[0], "c", bounds=BOX)
    assert fold.column("b") == pytest.approx(0.25 * fold.column("c") ** 2, abs=1e-12)
    assert sorted([fold.points[0].values["c"], fold.points[-1].values["c"]]) == pytest.approx(
        [-2.0, 2.0], rel=1e-12)
    point, = fold.special
    assert point.kind == "Bogdanov-Takens"
    assert [point.values["b"], point.values["c"]] == pytest.approx([0.0, 0.0], abs=1e-10)


def test_cusp():
    field = vector_field(cusp, {"b": -1.0, "c": 1.0}, 1)
    branch = equilibrium_branch(field, [-1.5], "b", bounds=(-2.0, 2.0))
    curve = codim2_curve(field, branch.of_kind("fold")[0], "c", bounds=BOX)
    assert 27.0 * curve.column("b") ** 2 == pytest.approx(4.0 * curve.column("c") ** 3, abs=1e-10)
    point, = curve.special
    assert point.kind == "cusp"
    assert [point.values["b"], point.values["c"]] == pytest.approx([0.0, 0.0], abs=1e-10)
    ends = [curve.points[k].values["c"] for k in (0, -1)]
    assert ends == pytest.approx([2.0, 2.0], rel=1e-12)


def test_bautin():
    field = vector_field(bautin, {"b": -1.0, "c": 1.0}, 2)
    start, = equilibrium_branch(field, parameter="b", bounds=(-2.0, 2.0)).of_kind("Hopf")
    curve = codim2_curve(field, start, "c", bounds=BOX)
    point, = curve.special
    assert point.kind == "Bautin"
    assert [point.values["b"], point.values["c"]] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert curve.column("first_lyapunov") == pytest.approx(2.0 * curve.column("c"), rel=1e-8,
                                                           abs=1e-9)


def test_a_curve_starts_with_the_parameters_of_its_point():
    """The curve starts with c = 0.5 of the branch, not the base value of the field."""
    field = vector_field(bautin, {"b": -1.0, "c": 1.0}, 2)
    start, = equilibrium_branch(field, find_equilibrium(field, {"c": 0.5}), "b",
                                bounds=(-2.0, 2.0)).of_kind("Hopf")
    assert start.first_lyapunov == pytest.approx(1.0, rel=1e-8)
    curve = codim2_curve(field, start, "c", options=ContinuationOptions(points=3), both=False)
    assert curve.points[0].values["c"] == pytest.approx(0.5, abs=1e-12)
    with pytest.raises(InputError, match="is on no branch of equilibria or orbits"):
        curve.points[0].parameter_values(field)


def zero_hopf(t, x, p, out):
    """A fold a = x^2 and a pair with the real part b - c + x, w = 3."""
    out[0] = p[0] - x[0] * x[0]
    out[1] = (p[1] + x[0]) * x[1] - 3.0 * x[2]
    out[2] = (p[1] + x[0]) * x[2] + 3.0 * x[1]


def double_hopf(t, x, p, out):
    """Two pairs, with real parts a and b, w = 1 and 2."""
    out[0], out[1] = p[0] * x[0] - x[1], p[0] * x[1] + x[0]
    out[2], out[3] = p[1] * x[2] - 2.0 * x[3], p[1] * x[3] + 2.0 * x[2]


def test_zero_hopf_and_double_hopf():
    field = vector_field(zero_hopf, {"a": 0.25, "b": 0.3}, 3)
    branch = equilibrium_branch(field, [0.5, 0.0, 0.0], "a", bounds=(-1.0, 1.0), direction=-1.0)
    box = {"a": (-1.0, 1.0), "b": (-1.0, 1.0)}
    folds = codim2_curve(field, branch.of_kind("fold")[0], "b", bounds=box)
    point, = folds.special
    assert isinstance(point, ZeroHopfPoint)
    assert [point.values["a"], point.values["b"]] == pytest.approx([0.0, 0.0], abs=1e-10)
    assert point.frequency_hz == pytest.approx(3.0 / (2.0 * np.pi), rel=1e-10)
    curve = codim2_curve(field, branch.of_kind("Hopf")[0], "b", bounds=box)
    assert curve.column("a") == pytest.approx(curve.column("b") ** 2, abs=1e-12)
    assert curve.of_kind("zero-Hopf")[0].frequency_hz == pytest.approx(1.5 / np.pi, rel=1e-9)
    field = vector_field(double_hopf, {"a": -1.0, "b": -0.5}, 4)
    start, = equilibrium_branch(field, parameter="a", bounds=(-1.0, 1.0)).of_kind("Hopf")
    curve = codim2_curve(field, start, "b", bounds=box)
    point, = curve.of_kind("double Hopf")
    assert isinstance(point, DoubleHopfPoint)
    assert point.frequency_hz == pytest.approx(0.5 / np.pi, rel=1e-9)
    assert point.values["b"] == pytest.approx(0.0, abs=1e-10)
    assert point.second_frequency_hz == pytest.approx(1.0 / np.pi, rel=1e-9)
    assert curve.column("unstable_besides")[[0, -1]].tolist() in ([0, 2], [2, 0])


def test_curves_through_points_of_codimension_two(tmp_path):
    """From the curve of folds a = 0 to that of Hopf points a = b^2, back, and across."""
    field = vector_field(zero_hopf, {"a": 0.25, "b": 0.3}, 3)
    branch = equilibrium_branch(field, [0.5, 0.0, 0.0], "a", bounds=(-1.0, 1.0), direction=-1.0)
    box = {"a": (-1.0, 1.0), "b": (-1.0, 1.0)}
    folds = codim2_curve(field, branch.of_kind("fold")[0], "b", bounds=box)
    folds = read_branch(write_branch(tmp_path / "folds.h5", folds))
    hopfs = codim2_curve(field, folds.special[0], "b", bounds=box)
    assert hopfs.attributes["kind"] == "Hopf"
    assert hopfs.column("a") == pytest.approx(hopfs.column("b") ** 2, abs=1e-11)
    assert hopfs.column("frequency_hz") == pytest.approx(np.full(len(hopfs), 1.5 / np.pi), rel=1e-9)
    assert np.sort(hopfs.column("b"))[[0, -1]] == pytest.approx([-1.0, 1.0], abs=1e-9)
    hopfs = codim2_curve(field, branch.of_kind("Hopf")[0], "b", bounds=box)
    back = codim2_curve(field, hopfs.of_kind("zero-Hopf")[0], "b", bounds=box)
    assert back.attributes["kind"] == "fold"
    assert back.column("a") == pytest.approx(np.zeros(len(back)), abs=1e-11)
    assert np.sort(back.column("b"))[[0, -1]] == pytest.approx([-1.0, 1.0], abs=1e-9)
    field = vector_field(double_hopf, {"a": -1.0, "b": -0.5}, 4)
    start, = equilibrium_branch(field, parameter="a", bounds=(-1.0, 1.0)).of_kind("Hopf")
    first = codim2_curve(field, start, "b", bounds=box)
    other = codim2_curve(field, first.of_kind("double Hopf")[0], "b", bounds=box)
    assert other.column("b") == pytest.approx(np.zeros(len(other)), abs=1e-11)
    assert np.sort(other.column("a"))[[0, -1]] == pytest.approx([-1.0, 1.0], abs=1e-9)
    assert other.column("frequency_hz") == pytest.approx(np.full(len(other), 1.0 / np.pi), rel=1e-9)


def test_the_folds_through_a_bogdanov_takens_point():
    field = vector_field(takens, {"b": -1.0, "c": -1.0}, 2)
    branch = equilibrium_branch(field, [-0.6, 0.0], "b", bounds=(-2.0, 2.0))
    hopf = codim2_curve(field, branch.of_kind("Hopf")[0], "c", bounds=BOX)
    point, = hopf.of_kind("Bogdanov-Takens")
    fold = codim2_curve(field, point, "c", bounds=BOX)
    assert fold.column("b") == pytest.approx(0.25 * fold.column("c") ** 2, abs=1e-11)
    assert np.sort(fold.column("c"))[[0, -1]] == pytest.approx([-2.0, 2.0], rel=1e-9)
    with pytest.raises(InputError, match="parameter = 'b' is that of the branch"):
        codim2_curve(field, point, "b")


def characteristic_border(B, v0):
    """Resultant of the even and odd parts of the characteristic polynomial, zero for l = i w."""
    a = np.poly(two_mass_jacobian(B, v0))
    return (a[1] * a[2] * a[3] - a[3] ** 2 - a[1] ** 2 * a[4]) / (abs(a[3]) ** 2 + 1e-300)


def test_border_of_steady_sliding_in_force_and_speed():
    """Both curves satisfy Hurwitz' condition; B and mu' enter as their product."""
    field = two_mass_field(0.5)
    branch = equilibrium_branch(field, parameter="B", bounds=(0.0, 12.0))
    box = {"B": (0.0, 30.0), "ground.speed": (0.5, 3.0)}
    bautin_points = []
    for start in branch.of_kind("Hopf"):
        curve = codim2_curve(field, start, "ground.speed", bounds=box)
        B, speed = curve.column("B"), curve.column("ground.speed")
        assert (B.min() < 7.5) & (B.max() == pytest.approx(30.0, rel=1e-12))
        assert speed.min() == pytest.approx(0.5, rel=1e-12)
        assert B * friction_slope(speed) == pytest.approx(
            np.full(len(B), start.parameter * friction_slope(1.0)), rel=1e-9)
        border = [characteristic_border(*pair) for pair in zip(B, speed, strict=True)]
        assert np.abs(border).max() < 1e-8
        assert curve.column("frequency_hz") == pytest.approx(
            np.full(len(B), start.frequency_hz), rel=1e-9)
        bautin_points += curve.of_kind("Bautin")
    assert bautin_points == []


def test_lorenz_border():
    """Hopf points rho = sigma (sigma + b + 3) / (sigma - b - 1)."""
    field = lorenz_field()
    start = equilibrium_branch(field, [1.0, 1.0, 1.0], "rho", bounds=(1.5, 30.0)).of_kind("Hopf")[0]
    curve = codim2_curve(field, start, "sigma",
                         bounds={"rho": (1.0, 60.0), "sigma": (4.0, 40.0)})
    sigma, b = curve.column("sigma"), 8.0 / 3.0
    assert curve.column("rho") == pytest.approx(sigma * (sigma + b + 3.0) / (sigma - b - 1.0),
                                                rel=1e-9)
    assert sigma.max() == pytest.approx(40.0, rel=1e-12)
    assert (curve.column("first_lyapunov") > 0.0).all()


def test_a_start_on_a_bound_of_the_second_parameter():
    """From c = 1 the Hopf points b = 0 go down to c = -2, and not beyond the bound c = 1."""
    field = vector_field(bautin, {"b": -1.0, "c": 1.0}, 2)
    start, = equilibrium_branch(field, parameter="b", bounds=(-2.0, 2.0)).of_kind("Hopf")
    curve = codim2_curve(field, start, "c", bounds={"c": (-2.0, 1.0)})
    assert (curve.status, curve.parameter_names) == (BranchStatus.BOUND, ("b", "c"))
    c = curve.column("c")
    assert c[[0, -1]] == pytest.approx([-2.0, 1.0], rel=1e-9)
    assert (np.diff(c) > 0.0).all()
    outside = codim2_curve(field, start, "c", bounds={"c": (-2.0, 1.0)}, both=False)
    assert (outside.status, len(outside)) == (BranchStatus.BOUND, 1)
    inwards = codim2_curve(field, start, "c", bounds={"c": (-2.0, 1.0)}, both=False, direction=-1.0)
    assert inwards.column("c")[[0, -1]] == pytest.approx([1.0, -2.0], rel=1e-12)
    with pytest.raises(InputError, match="start lies at c = 1, outside its bounds, -2 to 0"):
        codim2_curve(field, start, "c", bounds={"c": (-2.0, 0.0)})


@pytest.mark.parametrize("largest", [0.05, 0.3, 1.0])
def test_a_curve_stays_within_both_ranges(largest):
    """With any steps: the parabola of folds leaves the box at b = 1, not at c = 2."""
    field = vector_field(takens, {"b": -1.0, "c": -1.0}, 2)
    start = equilibrium_branch(field, [-0.6, 0.0], "b", bounds=(-2.0, 2.0)).of_kind("fold")[0]
    options = ContinuationOptions(step=0.05, largest_step=largest, second_bounds=(-1.5, 3.0))
    curve = codim2_curve(field, start, "c", bounds={"b": (-2.0, 1.0)}, options=options)
    assert curve.status is BranchStatus.BOUND
    ends = sorted((point.values["c"], point.values["b"])
                  for point in (curve.points[0], curve.points[-1]))
    assert np.array(ends) == pytest.approx(np.array([[-1.5, 0.5625], [2.0, 1.0]]), rel=1e-10)
    assert curve.column("b").max() < 1.0 + 1e-12
    assert curve.column("c").min() > -1.5 - 1e-12


@pytest.mark.parametrize(("most", "regular"), [(9, 9), (20, 20), (400, None)])
def test_points_to_both_sides_count_together(most, regular):
    field = vector_field(takens, {"b": -1.0, "c": -1.0}, 2)
    start = equilibrium_branch(field, [-0.6, 0.0], "b", bounds=(-2.0, 2.0)).of_kind("fold")[0]
    options = ContinuationOptions(step=0.05, largest_step=0.05, points=most)
    curve = codim2_curve(field, start, "c", bounds=BOX, options=options)
    found = sum(point.kind is None for point in curve)
    c = curve.column("c")
    if regular is None:
        assert c[[0, -1]] in (pytest.approx([-2.0, 2.0]), pytest.approx([2.0, -2.0]))
        assert found < 400
    else:
        assert found == regular
        assert c.min() < c.max() - 0.1
        assert c.min() < -1.0 < c.max()


def test_kind_errors():
    field = two_mass_field(0.5)
    branch = equilibrium_branch(field, parameter="B", bounds=(0.0, 12.0))
    start = branch.of_kind("Hopf")[0]
    with pytest.raises(InputError, match="parameter = 'B' is that of the branch; name another"):
        codim2_curve(field, start, "B")
    with pytest.raises(InputError, match=r"bounds are given for 'v', .*: 'B', 'ground\.speed'"):
        codim2_curve(field, start, "ground.speed", bounds={"v": (0.0, 1.0)})
    with pytest.raises(InputError, match=r"bounds\['B'\] = \(2, 1\) must be two values"):
        codim2_curve(field, start, "ground.speed", bounds={"B": (2, 1)})
    with pytest.raises(InputError, match=r"\(a regular point\) starts no curve; take a point of"):
        codim2_curve(field, branch.points[0], "ground.speed")
    plain = vector_field(bautin, {"b": -1.0, "c": 1.0}, 2)
    start, = equilibrium_branch(plain, parameter="b", bounds=(-2.0, 2.0)).of_kind("Hopf")
    with pytest.raises(InputError, match="no Hopf point of this field: all eigenvalues are real"):
        codim2_curve(vector_field(still, {"b": -1.0, "c": 1.0}, 2), start, "c")


def still(t, x, p, out):
    out[0], out[1] = -x[0], p[1] - x[1]
