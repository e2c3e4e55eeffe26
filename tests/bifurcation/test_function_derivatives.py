"""Derivatives of vector fields from functions, against closed forms.

The complex step loses them in many ways: powers of negative bases lie on a branch cut, abs and sign
drop the imaginary part, hyperbolic functions overflow where the real ones do not.
"""

import math
import warnings
from contextlib import suppress

import numba
import numpy as np
import pytest

from fecontact import AnalysisError, InputError
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    PeriodicMotion,
    codim2_curve,
    equilibrium_branch,
    find_equilibrium,
    orbit_branch,
    vector_field,
)

size_of = numba.njit(lambda x: abs(x))


@numba.njit
def far(x):
    return size_of(x) * x


def cube(t, x, p, out):
    out[0] = p[0] * x[0]**3


def fourth(t, x, p, out):
    out[0] = p[0] * x[0]**4


def inverse(t, x, p, out):
    out[0] = p[0] * x[0]**-1


def power(t, x, p, out):
    out[0] = p[0] * np.power(x[0], 5)


def of_lambda(t, x, p, out):
    size = lambda y: abs(y)  # noqa: E731
    out[0] = p[0] * size(x[0]) * x[0]


def of_inner_function(t, x, p, out):
    def size(y):
        return np.sqrt(np.abs(y)**2)
    out[0] = p[0] * size(x[0]) * x[0]


def of_other_functions(t, x, p, out):
    out[0] = p[0] * far(x[0])


def tangent(t, x, p, out):
    out[0] = p[0] * np.tanh(1000.0 * x[0])


def hyperbola(t, x, p, out):
    out[0] = p[0] / np.cosh(800.0 * x[0])


def logistic(t, x, p, out):
    out[0] = p[0] / (1.0 + np.exp(-900.0 * x[0]))


def larger(t, x, p, out):
    out[0] = p[0] * np.maximum(x[0], 0.25) * x[0]


def larger_of_python(t, x, p, out):
    out[0] = p[0] * max(x[0], 0.25) * x[0]


def by_where(t, x, p, out):
    out[0] = p[0] * np.where(x[0] > 0.0, x[0], 2.0 * x[0]).item()


def by_comparison(t, x, p, out):
    out[0] = p[0] * (x[0] if x[0] > 0.0 else 2.0 * x[0])


def signed(t, x, p, out):
    out[0] = p[0] * np.sign(x[0]) * x[0] * x[0]


def cast(t, x, p, out):
    out[0] = p[0] * float(x[0]) * x[0]


def real_part(t, x, p, out):
    out[0] = p[0] * x[0].real * x[0]


def steep(t, x, p, out):
    out[0] = p[0] * math.atan(1e6 * x[0])


def narrow(t, x, p, out):
    out[0] = p[0] * math.exp(-1e6 * abs(x[0])) * x[0]


def offset(t, x, p, out):
    out[0] = p[0] * ((math.fabs(x[0]) + 1e5) - 1e5)


CATALOGUE = [
    (cube, lambda x: 3.0 * x**2),
    (fourth, lambda x: 4.0 * x**3),
    (inverse, lambda x: -1.0 / x**2),
    (power, lambda x: 5.0 * x**4),
    (of_lambda, lambda x: 2.0 * abs(x)),
    (of_inner_function, lambda x: 2.0 * abs(x)),
    (of_other_functions, lambda x: 2.0 * abs(x)),
    (tangent, lambda x: 1000.0 * (1.0 - np.tanh(1000.0 * x)**2)),
    (hyperbola, lambda x: -800.0 * np.tanh(800.0 * x) / np.cosh(np.clip(800.0 * x, -700, 700))),
    (logistic, lambda x: 225.0 / np.cosh(np.clip(450.0 * x, -300, 300))**2),
    (larger, lambda x: np.where(x > 0.25, 2.0 * x, 0.25)),
    (larger_of_python, lambda x: np.where(x > 0.25, 2.0 * x, 0.25)),
    (by_where, lambda x: np.where(x > 0.0, 1.0, 2.0)),
    (by_comparison, lambda x: np.where(x > 0.0, 1.0, 2.0)),
    (signed, lambda x: 2.0 * abs(x)),
    (cast, lambda x: 2.0 * x),
    (real_part, lambda x: 2.0 * x),
    (steep, lambda x: 1e6 / (1.0 + (1e6 * x)**2)),
    (narrow, lambda x: np.exp(-1e6 * abs(x)) * (1.0 - 1e6 * abs(x))),
]
PLACES = np.array([-2.1, -1.0, -0.5, -1e-3, -3e-6, 1e-6, 2e-4, 0.3, 1.7])


@pytest.mark.parametrize(("function", "slope"), CATALOGUE)
def test_derivatives_are_those_of_the_closed_form(function, slope):
    """To state and parameter; and what is found is said: no warning is needed."""
    field = vector_field(function, {"p": 1.5}, 1)
    x = PLACES[:, None].copy()
    f, J, P = field.derivatives(np.zeros(len(x)), x, field.values, (0,))
    exact = 1.5 * slope(PLACES)
    near = 1e-9 * np.abs(exact) + 1e-11 * np.abs(f[:, 0] / PLACES) + 1e-100
    assert (np.abs(J[:, 0, 0] - exact) <= near).all()
    assert P[:, 0, 0] == pytest.approx(f[:, 0] / 1.5, rel=1e-9)


@pytest.mark.parametrize("function", [case[0] for case in CATALOGUE[:11] + CATALOGUE[14:17]
                                      if case[0] not in (larger, hyperbola)])
def test_the_complex_step_is_refused_where_it_is_wrong(function):
    with pytest.raises(InputError, match=r"does not get .* right|complex step|complex numbers"):
        vector_field(function, {"p": 1.5}, 1, differentiation="complex")


def test_the_complex_step_of_hyperbolic_functions_is_refused_or_right():
    """Some C libraries have the cosine of large complex numbers right."""
    field = None
    with suppress(InputError):
        field = vector_field(hyperbola, {"p": 1.5}, 1, differentiation="complex")
    if field is not None:
        x = PLACES[:, None].copy()
        _, J, _ = field.derivatives(np.zeros(len(x)), x, field.values, (0,))
        exact = -1200.0 * np.tanh(800.0 * PLACES) / np.cosh(np.clip(800.0 * PLACES, -700, 700))
        assert J[:, 0, 0] == pytest.approx(exact, rel=1e-9, abs=1e-100)


def moved(t, x, p, out):
    out[0] = np.tanh(x[0] - p[0])


def test_what_goes_wrong_on_the_way_is_said():
    """Right around the scale, but 800 of them away complex numbers overflow."""
    field = vector_field(moved, {"p": 0.0}, 1, scales=[10.0])
    assert field.differentiation == "complex"
    x = np.array([[0.3], [-800.0], [0.7]])
    with pytest.warns(UserWarning, match=r"derivatives of moved to 'x1', 'p'.*differences take"):
        _, J, P = field.derivatives(np.zeros(3), x, field.values, (0,))
    assert J[:, 0, 0] == pytest.approx(1.0 / np.cosh(np.clip(x[:, 0], -300, 300))**2, rel=1e-9)
    assert P[:, 0, 0] == pytest.approx(-J[:, 0, 0], rel=1e-12)
    strict = vector_field(moved, {"p": 0.0}, 1, scales=[10.0],
                          differentiation="complex")
    with pytest.raises(AnalysisError, match="does not get the derivatives of moved to 'x1' right"):
        strict.derivatives(np.zeros(3), x, field.values)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        strict.derivatives(np.zeros(2), x[::2].copy(), field.values)


@pytest.mark.parametrize(("way", "error"), [("complex", 1e-14), ("differences", 2e-9)])
def test_rough_derivatives(way, error):
    """Complex steps are exact, others of second order: x^2 h^2 / 6 of the third derivative."""
    field = vector_field(moved, {"p": 0.1}, 1, differentiation=way)
    x, none = PLACES[:, None].copy(), np.zeros(len(PLACES))
    exact = 1.0 / np.cosh(PLACES - 0.1) ** 2
    step, errors = 1e-5, []
    for factor in (1.0, 100.0):
        f, J, P = field.rough_derivatives(none, x, field.values, (0,), np.array([2.0]),
                                          step * factor)
        assert f[:, 0] == pytest.approx(np.tanh(PLACES - 0.1), rel=1e-15)
        errors.append(np.abs(J[:, 0, 0] - exact).max())
        assert P[:, 0, 0] == pytest.approx(-exact, abs=max(error, 1e4 * error * (factor - 1.0)))
    assert errors[0] <= error
    # Newton's method needs the same equations with derivatives and without.
    exactly = field.rough_derivatives(none, x, field.values, (), np.array([2.0]), None)
    assert (exactly is None) == (way == "differences")
    if way == "differences":
        third = np.abs(exact * (4.0 - 6.0 * exact)).max()
        assert errors[1] == pytest.approx(third * (2e-3) ** 2 / 6.0, rel=0.02)


def test_rough_derivatives_where_the_complex_step_fails():
    """Far from the scale it overflows; what is not finite is never given away, nor used again."""
    field = vector_field(moved, {"p": 0.0}, 1, scales=[10.0])
    x = np.array([[0.3], [-800.0]])
    for _ in range(2):
        _, J, P = field.rough_derivatives(np.zeros(2), x, field.values, (0,), np.ones(1), 1e-4)
        assert J[:, 0, 0] == pytest.approx([1.0 / np.cosh(0.3) ** 2, 0.0], abs=1e-8)
        assert P[:, 0, 0] == pytest.approx(-J[:, 0, 0], abs=1e-8)
        with pytest.warns(UserWarning, match="complex step"):
            field.derivatives(np.zeros(2), x, field.values, (0,))


def bounded(t, x, p, out):
    # s' = p + q s - s^3 + tanh(s) / 10 with s = r - 1.
    r = np.sqrt(x[0] * x[0] + x[1] * x[1])
    s = r - 1.0
    radial = p[0] + p[1] * s - s * s * s + 0.1 * np.tanh(s)
    out[0] = radial * x[0] / r - 2.0 * x[1]
    out[1] = radial * x[1] / r + 2.0 * x[0]


def test_curves_do_not_depend_on_what_a_field_was_asked_before():
    """Complex numbers overflow far away; a curve computed near zero keeps the complex step."""
    field = vector_field(bounded, {"p": 0.2, "q": 0.3}, 2)
    assert field.differentiation == "complex"
    t = np.linspace(0.0, np.pi, 400)
    circle = 1.8 * np.stack([np.cos(2.0 * t), np.sin(2.0 * t)], axis=1)
    branch = orbit_branch(field, PeriodicMotion(t, circle, period=np.pi), "p", direction=-1.0,
                          method=Collocation(intervals=16), bounds=(-0.3, 0.3), scales=np.ones(2))
    fold = branch.of_kind("fold")[0]

    def curve():
        return codim2_curve(field, fold, "q", bounds={"p": (-0.3, 0.3), "q": (-0.5, 0.5)},
                            options=ContinuationOptions(points=10))

    before = curve()
    with pytest.warns(UserWarning, match="complex step"):
        field.derivatives(np.zeros(1), np.array([[-800.0, 1.0]]), field.values)
    after = curve()
    assert len(after) == len(before) > 5
    for one, other in zip(before, after, strict=True):
        assert other.u.tolist() == one.u.tolist()


def test_rounding_is_no_derivative_of_zero():
    """Over steps shorter than the rounding of 1e5 the function does not change at all."""
    field = vector_field(offset, {"p": 1.5}, 1)
    _, J, _ = field.derivatives(np.zeros(2), np.array([[0.3], [-1.7]]), field.values)
    assert J[:, 0, 0] == pytest.approx([1.5, -1.5], rel=1e-7)


def falling(t, x, p, out):
    out[0] = p[0] + x[0]**3


def test_eigenvalue_of_a_cube():
    found = find_equilibrium(vector_field(falling, {"p": 0.125}, 1), start=[-0.6])
    assert found.state[0] == pytest.approx(-0.5, rel=1e-12)
    assert found.eigenvalues[0] == pytest.approx(0.75, rel=1e-10)


def oscillator(t, x, p, out):
    out[0] = x[1]
    out[1] = -x[0] + p[0] * x[1] - p[1] * x[0]**3 - x[1]**3


def test_normal_form_and_multipliers_with_powers():
    """x'' + x - mu x' + b x^3 + x'^3 = 0.

    Averaging gives the first Lyapunov coefficient -3/8 for an eigenvector with |q|^2 = 1 (where
    x = r cos t is z q + its conjugate with |z| = r / sqrt 2, and r' = -3/8 r^3), and Liouville the
    product of the multipliers.
    """
    field = vector_field(oscillator, {"mu": -0.3, "b": 0.7}, 2)
    assert field.differentiation == "differences"
    rest = equilibrium_branch(field, parameter="mu", bounds=(-0.3, 0.5))
    point, = rest.of_kind("Hopf")
    assert point.parameter == pytest.approx(0.0, abs=1e-10)
    assert point.first_lyapunov == pytest.approx(-0.75, rel=1e-6)
    orbits = orbit_branch(field, point, method=Collocation(intervals=30), bounds=(-0.3, 0.5))
    last = orbits.points[-1]
    assert last.parameter == pytest.approx(0.5, abs=1e-9)
    mesh = np.asarray(last.values["mesh"])
    nodes = last.u[:-2].reshape(-1, 2)
    roots, weights = np.polynomial.legendre.leggauss(4)
    places = np.linspace(0.0, 1.0, 5)
    basis = [np.polynomial.Polynomial.fromroots(np.delete(places, k)) for k in range(5)]
    values = np.array([[b((r + 1.0) / 2.0) / b(places[k]) for k, b in enumerate(basis)]
                       for r in roots])
    closed = np.vstack([nodes, nodes[:1]])
    mean = sum(width * weights / 2.0 @ (last.parameter
                                        - 3.0 * (values @ closed[4 * j:4 * j + 5, 1])**2)
               for j, width in enumerate(np.diff(mesh)))
    expected = np.exp(mean * last.values["period"])
    assert np.prod(last.values["multipliers"]).real == pytest.approx(expected, rel=1e-7)


def saddle(t, x, p, out):
    # At rest at (1, 0) for m = -1, where the terms cancel; df/dc = y.
    out[0] = x[1]
    out[1] = p[0] + p[1] * x[1] + x[0] * x[0] + x[0] * x[1]


def test_terms_that_cancel_do_not_refute_the_complex_step():
    """Near the rest point the rates do not change by more than their rounding."""
    field = vector_field(saddle, {"m": -1.0, "c": 0.2}, 2)
    assert field.differentiation == "complex"
    k = np.arange(4000.0)
    away = 10.0 ** (-16.0 + 13.0 * np.modf(0.61803 * k)[0])
    x = np.stack([1.0 + away * np.sin(k), away * np.cos(1.3 * k)], axis=1)
    for c in (-0.3, 0.2, 0.7434):
        P = field.derivatives(np.zeros(len(k)), x, np.array([-1.0, c]), (0, 1))[2]
        assert P[:, 1, 1] == pytest.approx(x[:, 1], rel=1e-12, abs=0.0)


def test_states_at_rounding_of_zero_are_zero():
    """The complex step underflows there; a saddle at zero comes as near along a curve."""
    def product(t, x, p, out):
        out[0] = p[0] * x[0] - x[1]
        out[1] = x[0] * x[1] + p[1] * x[1]

    field = vector_field(product, {"a": 2.0, "b": 3.0}, 2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for size in (1e-50, 1e-150, 1e-250, 1e-300, 5e-324, 0.0):
            x = size * np.array([[1.0, -2.0]])
            _, J, P = field.derivatives(np.zeros(1), x, field.values, (0, 1))
            assert J[0] == pytest.approx(np.array([[2.0, -1.0], [0.0, 3.0]]), rel=1e-12)
            expected = np.array([[1.0, 0.0], [0.0, -2.0]]) * (size if size > 1e-60 else 0.0)
            assert P[0] == pytest.approx(expected, rel=1e-12, abs=0.0)
