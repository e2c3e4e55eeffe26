r"""Forces that are polynomials of the modal coordinates, with one potential, in compiled code.

With D linear combinations c = R x of the coordinates x and P products p of two of them,

.. math::

    V = p \cdot L x + \tfrac12\, p \cdot Q p, \qquad p_r = c_{i_r} c_{j_r},

the force on the coordinates is the negative derivative of V. Q belongs to a symmetric tensor of
fourth degree, so that with g = Q p and l = L x

.. math::

    \frac{\partial V}{\partial x} = R^T f + L^T p, \qquad
    \frac{\partial^2 V}{\partial x^2} = R^T G + G^T R,

where f collects ``(g_r + l_r) dp_r / dc``, and G (D, m) ``(3 g_r + l_r) / 2`` times the rows of R,
and ``dp_r / dc`` times those of L. G stands for the second derivatives wherever a method keeps
them. The arrays are ``polynomial_rows`` R, ``polynomial_pairs`` (i, j), ``polynomial_cubic`` L and
``polynomial_quartic`` Q of :class:`fecontact.system.SystemArrays`; without such forces they
are empty.
"""

import numpy as np
from numpy.typing import NDArray

from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.records import Matrix, Vector
from fecontact.core.simd.vectors import somewhere
from fecontact.core.types import Array
from fecontact.system.nodes import SystemArrays


@helper
def has_polynomial(s):
    """Whether a system has forces that are polynomials of the modal coordinates."""
    return s.polynomial != 0


@helper
def _work_arrays(s):
    """Rows (5, k) for c and f, p, and the slopes of :func:`_evaluate`."""
    return np.empty((5, max(len(s.polynomial_rows), len(s.polynomial_pairs))))


@helper
def _project(x, rows, c):
    """Fill c (D,) with the combinations of coordinates."""
    for a in range(len(rows)):
        total = 0.0
        for i in range(rows.shape[1]):
            total += rows[a, i] * x[i]
        c[a] = total


@helper
def _set_slopes(x, p, s, quartic, cubic):
    """Fill ``quartic`` (P,) with Q p and ``cubic`` (P,) with L x."""
    L, Q = s.polynomial_cubic, s.polynomial_quartic
    for r in range(len(Q)):
        by_products, by_coordinates = 0.0, 0.0
        for k in range(len(Q)):
            by_products += Q[r, k] * p[k]
        for k in range(L.shape[1]):
            by_coordinates += L[r, k] * x[k]
        quartic[r], cubic[r] = by_products, by_coordinates


@helper
def _evaluate(x, s, c, p, quartic, cubic):
    """Fill c (D,), the products p (P,), and Q p and L x (P,) at coordinates x (m,)."""
    pairs = s.polynomial_pairs
    _project(x, s.polynomial_rows, c)
    for r in range(len(pairs)):
        p[r] = c[pairs[r, 0]] * c[pairs[r, 1]]
    _set_slopes(x, p, s, quartic, cubic)


@helper
def _add_forces(c, p, quartic, cubic, s, f, out):
    """Add to out (m,) the forces; f (D,) is a work array."""
    rows, pairs, L = s.polynomial_rows, s.polynomial_pairs, s.polynomial_cubic
    for a in range(len(rows)):
        f[a] = 0.0
    for r in range(len(pairs)):
        i, j, slope, part = pairs[r, 0], pairs[r, 1], quartic[r] + cubic[r], p[r]
        f[i] += slope * c[j]
        f[j] += slope * c[i]
        for k in range(L.shape[1]):
            out[k] -= part * L[r, k]
    for a in range(len(rows)):
        part = f[a]
        for k in range(rows.shape[1]):
            out[k] -= part * rows[a, k]


@helper
def _set_gradient(c, quartic, cubic, s, gradient):
    """Fill G (D, m) by Q p, L x and c, or by their changes."""
    rows, pairs, L = s.polynomial_rows, s.polynomial_pairs, s.polynomial_cubic
    for a in range(len(rows)):
        for k in range(rows.shape[1]):
            gradient[a, k] = 0.0
    for r in range(len(pairs)):
        i, j = pairs[r, 0], pairs[r, 1]
        half, first, second = 0.5 * (3.0 * quartic[r] + cubic[r]), c[i], c[j]
        for k in range(rows.shape[1]):
            gradient[i, k] += half * rows[j, k] + second * L[r, k]
            gradient[j, k] += half * rows[i, k] + first * L[r, k]


@kernel(by_address=True)
def evaluate_polynomial(x: Vector, s: SystemArrays, gradient: Matrix, out: Vector) -> None:
    """Add the forces at coordinates x (m,) to out (m,), and fill their ``gradient`` G (D, m).

    What is empty is left out. ``SystemArrays.polynomial`` is its address, so that it is compiled
    for systems that have such forces alone.
    """
    work = _work_arrays(s)
    _evaluate(x, s, work[0], work[2], work[3], work[4])
    if len(out) > 0:
        _add_forces(work[0], work[2], work[3], work[4], s, work[1], out)
    if len(gradient) > 0:
        _set_gradient(work[0], work[3], work[4], s, gradient)


_evaluate_at = function_at(evaluate_polynomial)


@helper
def add_polynomial(x, s, gradient, out):
    """Add to out (m,) the forces at coordinates x (m,), and fill their ``gradient`` G (D, m)."""
    if s.polynomial != 0:
        _evaluate_at(s.polynomial)(x, s, gradient, out)


@helper
def add_polynomial_forces(x, s, out):
    """Add to out (m,) the forces at coordinates x (m,)."""
    add_polynomial(x, s, s.polynomial_rows[:0], out)


@helper
def set_polynomial_gradient(x, s, gradient):
    """Fill the gradient G (D, m) of the forces at coordinates x (m,)."""
    add_polynomial(x, s, gradient, x[:0])


@routine
def set_polynomial_change(x, change, s, gradient):
    """Fill ``gradient`` with the derivative of G along a ``change`` (m,) of the coordinates x."""
    pairs, work = s.polynomial_pairs, _work_arrays(s)
    c, dc, dp = work[0], work[1], work[2]
    _project(x, s.polynomial_rows, c)
    _project(change, s.polynomial_rows, dc)
    for r in range(len(pairs)):
        dp[r] = c[pairs[r, 0]] * dc[pairs[r, 1]] + dc[pairs[r, 0]] * c[pairs[r, 1]]
    _set_slopes(change, dp, s, work[3], work[4])
    _set_gradient(dc, work[3], work[4], s, gradient)


@routine
def add_polynomial_stiffness(factor, gradient, s, out):
    """Add a multiple of the second derivatives of V, by G, to the first m columns of out (m, k)."""
    rows = s.polynomial_rows
    m = rows.shape[1]
    for a in range(len(rows)):
        for i in range(m):
            part = factor * rows[a, i]
            # Most combinations are coordinates themselves.
            if somewhere(part != 0.0):
                for k in range(m):
                    out[i, k] += part * gradient[a, k]
                for k in range(m):
                    out[k, i] += part * gradient[a, k]


@routine
def add_polynomial_product(factor, gradient, x, s, out):
    """Add to out (m,) a multiple of the second derivatives of V, by G, times x (m,)."""
    rows = s.polynomial_rows
    m = rows.shape[1]
    for a in range(len(rows)):
        moved, pushed = 0.0, 0.0
        for k in range(m):
            moved += rows[a, k] * x[k]
            pushed += gradient[a, k] * x[k]
        moved, pushed = factor * moved, factor * pushed
        for k in range(m):
            out[k] += pushed * rows[a, k] + moved * gradient[a, k]


@routine
def polynomial_potential(x, s):
    """V at coordinates x (m,) [J]."""
    work, total = _work_arrays(s), 0.0
    _evaluate(x, s, work[0], work[2], work[3], work[4])
    for r in range(len(s.polynomial_pairs)):
        total += work[2, r] * (0.5 * work[3, r] + work[4, r])
    return total


@kernel
def _fill_potentials(x: Matrix, s: SystemArrays, out: Vector) -> None:
    """Fill out (N,) with V at coordinates x (N, m)."""
    for n in range(len(x)):
        out[n] = polynomial_potential(x[n], s)


def polynomial_energy(x: Array, s: SystemArrays) -> Array:
    """V (...,) at coordinates x (..., m) [J]."""
    found = np.zeros(x.shape[:-1])
    if len(s.polynomial_pairs):
        _fill_potentials(np.ascontiguousarray(x).reshape(-1, x.shape[-1]), s, found.reshape(-1))
    return found


@kernel
def _fill_stiffness(x: Vector, s: SystemArrays, out: Matrix) -> None:
    """Add to out (m, m) the second derivatives of V at coordinates x (m,)."""
    gradient = np.empty_like(s.polynomial_rows)
    set_polynomial_gradient(x, s, gradient)
    add_polynomial_stiffness(1.0, gradient, s, out)


def polynomial_stiffness_at(x: Array, s: SystemArrays) -> Array:
    """Second derivatives (m, m) of V at coordinates x (m,)."""
    found = np.zeros((len(x), len(x)))
    _fill_stiffness(np.ascontiguousarray(x), s, found)
    return found


def coupled_by_polynomial(s: SystemArrays) -> NDArray[np.bool_]:
    """Whether the polynomial forces couple two coordinates (m, m)."""
    rows = s.polynomial_rows != 0.0
    i, j = s.polynomial_pairs.T
    moved = (rows[i] | rows[j]).astype(int)
    felt = moved + ((s.polynomial_quartic != 0.0).astype(int) @ moved) + (
        s.polynomial_cubic != 0.0)
    coupled = felt.T @ felt > 0
    return np.asarray(coupled | coupled.T)
