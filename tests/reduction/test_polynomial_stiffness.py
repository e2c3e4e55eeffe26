"""Quadratic and cubic stiffness that couples coordinates, against tensors and closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, nonlinear_mode
from fecontact.core.errors import InputError
from fecontact.reduction import polynomial_stiffness


def symmetric(d, indices, seed=1):
    """A random tensor that is the same for any order of its indices."""
    from itertools import permutations

    found = np.random.default_rng(seed).normal(size=(d,) * indices)
    return sum(np.transpose(found, order) for order in permutations(range(indices)))


def forces(rows, law, q):
    """Forces (d,) of the springs on the coordinates."""
    w = rows[:, 1]
    e = w @ q
    return w.T @ (np.array(law.quadratic_stiffness) * e**2 + np.array(law.cubic_stiffness) * e**3)


@pytest.mark.parametrize("d", [1, 2, 3, 5])
@pytest.mark.parametrize("which", ["quadratic", "cubic", "both"])
def test_forces_are_those_of_the_tensors(d, which):
    a, b = symmetric(d, 3), symmetric(d, 4)
    a, b = (a if which != "cubic" else None), (b if which != "quadratic" else None)
    rows, law = polynomial_stiffness(a, b)
    for q in np.random.default_rng(2).normal(size=(5, d)):
        exact = np.zeros(d)
        if a is not None:
            exact += np.einsum("ijk,j,k", a, q, q)
        if b is not None:
            exact += np.einsum("ijkl,j,k,l", b, q, q, q)
        assert forces(rows, law, q) == pytest.approx(exact, rel=1e-10, abs=1e-10)


def test_a_run_of_coupled_coordinates():
    """Two masses with a quadratic and a cubic coupling against an integrator of SciPy."""
    a, b = 0.3 * symmetric(2, 3), 0.1 * symmetric(2, 4)
    K, x0 = np.array([[3.0, -1.0], [-1.0, 2.0]]), np.array([0.3, -0.2])
    rows, law = polynomial_stiffness(a, b)
    points = {name: np.zeros((3, 2)) for name in "BC"}
    points["B"][1, 0] = points["C"][1, 1] = 1.0
    system = fc.ContactSystem(
        fc.basis_from_matrices(np.eye(2), K, {"contact": rows, **points}), normal=law)
    start = fc.integrate.PointStart(displacements={"B": (None, x0[0]), "C": (None, x0[1])})
    run = fc.simulate(system, 10.0, initial=start, rtol=1e-10, outputs=101)

    def rates(t, y):
        q = y[:2]
        return np.concatenate([y[2:], -K @ q - np.einsum("ijk,j,k", a, q, q)
                               - np.einsum("ijkl,j,k,l", b, q, q, q)])

    other = solve_ivp(rates, (0.0, 10.0), np.append(x0, [0.0, 0.0]), "DOP853", run.time,
                      rtol=1e-11, atol=1e-12)
    for name, column in (("B", 0), ("C", 1)):
        assert run.displacement(name)[:, 1] == pytest.approx(other.y[column], abs=1e-7)


def test_a_similar_mode():
    """U = (q1 q2)^2 and two equal springs: along q1 = q2 = s the motion is s'' + s + 2 s^3 = 0."""
    b = np.zeros((2,) * 4)
    for place in ((0, 0, 1, 1), (0, 1, 0, 1), (0, 1, 1, 0), (1, 0, 0, 1), (1, 0, 1, 0),
                  (1, 1, 0, 0)):
        # f_1 = 2 q1 q2^2 is three equal entries.
        b[place] = 2.0 / 3.0
    rows, law = polynomial_stiffness(cubic=b)
    point = np.zeros((3, 2))
    point[1, 0] = 1.0
    coupling = 1e-3 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    system = fc.ContactSystem(fc.basis_from_matrices(
        np.eye(2), np.eye(2) + coupling, {"contact": rows, "B": point}), normal=law)
    mode = nonlinear_mode(system, (1e-3, 0.5), 1, observe=("B", "y"),
                          method=HarmonicBalance([1, 3, 5, 7]))
    from scipy.special import ellipk

    A = mode.amplitude
    hard = 1.0 + 2.0 * A**2
    w = np.pi / 2.0 * np.sqrt(hard) / ellipk(A**2 / hard)
    similar = np.abs(mode.coordinates()[:, 0]) > 0.0
    first = mode.angular_frequency[similar]
    assert first == pytest.approx(w[similar], rel=1e-6)


@pytest.mark.parametrize(("given", "told"), [
    ({}, "give quadratic, cubic or both"),
    ({"quadratic": np.ones((2, 2, 2)), "cubic": np.ones((3,) * 4)}, "as many coordinates each"),
    ({"quadratic": np.ones((2, 2))}, r"quadratic has the shape \(2, 2\); it must have 3 indices"),
    ({"cubic": np.arange(16.0).reshape((2,) * 4)}, "cubic must be finite, and the same for any"),
    ({"cubic": np.full((2,) * 4, np.nan)}, "cubic"),
    ({"quadratic": np.zeros((2, 2, 2))}, "all coefficients are zero"),
    ({"quadratic": np.ones((9, 9, 9))}, "quadratic has 9 coordinates; it may have at most 8"),
])
def test_bad_tensors(given, told):
    with pytest.raises(InputError, match=told):
        polynomial_stiffness(**given)
