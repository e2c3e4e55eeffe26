"""Eigenvalues of a product of matrices, without forming the product.

P = M_(N-1) ... M_1 M_0 may have eigenvalues from 1e-300 to 1e300, of which the product formed in
floating point keeps only the largest sixteen decades. The periodic QR algorithm (Bojanczyk, Golub
and Van Dooren 1992) rotates the factors instead: orthogonal changes of basis between neighbours
make M_1 .. M_(N-1) upper triangular and M_0 upper Hessenberg, shifted steps reduce M_0 to upper
triangular form, and each eigenvalue is the product of corresponding diagonal entries.
"""

import math

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.linalg.transition_matrices import condense_products
from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Block, ComplexVector
from fecontact.core.types import Array

_EPS = float(np.finfo(float).eps)
_STEPS = 60  # shifted steps for one eigenvalue before giving up


@helper
def _rotation(x, y):
    """Real c and complex s with [[c, s], [-s', c]] [x, y] = [r, 0]."""
    size = math.hypot(abs(x), abs(y))
    if size == 0.0 or abs(y) == 0.0:
        return 1.0, 0.0 + 0.0j
    if abs(x) == 0.0:
        return 0.0, y.conjugate() / abs(y)
    c = abs(x) / size
    return c, (x / abs(x)) * y.conjugate() / size


@helper
def _rows(a, k, c, s, first, last):
    """Rotate rows k, k + 1 from the left, columns first .. last - 1."""
    for i in range(first, last):
        x, y = a[k, i], a[k + 1, i]
        a[k, i] = c * x + s * y
        a[k + 1, i] = c * y - s.conjugate() * x


@helper
def _columns(a, k, c, s, last):
    """Multiply from the right by the inverse of the same rotation, rows 0 .. last - 1."""
    for i in range(last):
        x, y = a[i, k], a[i, k + 1]
        a[i, k] = c * x + s.conjugate() * y
        a[i, k + 1] = c * y - s * x


@helper
def _upward(H, k, c, s):
    """Propagate a rotation of rows k, k + 1 of H[0] through the triangular factors to H[0].

    It changes the basis between H[0] and H[1]; the last rotation acts on the columns of H[0].
    """
    K, d, _ = H.shape
    for j in range(1, K):
        a = H[j]
        _columns(a, k, c, s, k + 2)
        c, s = _rotation(a[k, k], a[k + 1, k])
        _rows(a, k, c, s, k, d)
        a[k + 1, k] = 0.0
    _columns(H[0], k, c, s, d)


@helper
def _to_hessenberg(H):
    """Make H[1:] upper triangular and H[0] upper Hessenberg by changes of basis."""
    K, d, _ = H.shape
    for j in range(1, K):
        a = H[j]
        for k in range(d - 1):
            for i in range(d - 2, k - 1, -1):
                c, s = _rotation(a[i, k], a[i + 1, k])
                _rows(a, i, c, s, k, d)
                a[i + 1, k] = 0.0
                _columns(H[(j + 1) % K], i, c, s, d)
    for k in range(d - 2):
        for i in range(d - 2, k, -1):
            c, s = _rotation(H[0, i, k], H[0, i + 1, k])
            _rows(H[0], i, c, s, k, d)
            H[0, i + 1, k] = 0.0
            _upward(H, i, c, s)


@helper
def _corner(H, k):
    """Product of the blocks k, k + 1 of H[1:], upper triangular, scaled by 2^-exponent."""
    a, b, c = 1.0 + 0.0j, 0.0 + 0.0j, 1.0 + 0.0j
    exponent = 0
    for j in range(1, len(H)):
        b = H[j, k, k] * b + H[j, k, k + 1] * c
        a *= H[j, k, k]
        c *= H[j, k + 1, k + 1]
        largest = max(abs(a), abs(b), abs(c))
        if largest > 0.0:
            shift = math.frexp(largest)[1]
            scale = math.ldexp(1.0, -shift)
            a *= scale
            b *= scale
            c *= scale
            exponent += shift
    return a, b, c, exponent


@helper
def _shift(H, last):
    """Eigenvalue of the last block of the product nearest its corner, and its exponent."""
    a, b, c, exponent = _corner(H, last - 1)
    h = H[0]
    p = a * h[last - 1, last - 1] + b * h[last, last - 1]
    q = a * h[last - 1, last] + b * h[last, last]
    r = c * h[last, last - 1]
    t = c * h[last, last]
    half = (p - t) / 2.0
    root = np.sqrt(half * half + q * r)
    if (half * root.conjugate()).real < 0.0:
        root = -root
    bottom = half + root
    return (t - q * r / bottom if abs(bottom) > 0.0 else t), exponent


@helper
def _step(H, first, last, exceptional):
    """One shifted step on the block first .. last."""
    K, d, _ = H.shape
    sigma, power = _shift(H, last)
    a, b, c, exponent = _corner(H, first)
    h = H[0]
    x = a * h[first, first] + b * h[first + 1, first]
    y = c * h[first + 1, first]
    # Scale the shift to the first column; omit a shift out of range.
    difference = min(max(power - exponent, -1000), 900)
    x -= sigma * math.ldexp(1.0, difference)
    if exceptional:
        x, y = 0.6 * x + 0.8 * y, y
    cosine, sine = _rotation(x, y)
    # The rotation changes the basis of x_0: rows of the last factor, columns of H[0].
    _columns(h, first, cosine, sine, d)
    for j in range(K - 1, 0, -1):
        f = H[j]
        _rows(f, first, cosine, sine, first, d)
        # From the right: the row (first + 1) becomes [0, r].
        u, v = f[first + 1, first], f[first + 1, first + 1]
        size = math.hypot(abs(u), abs(v))
        if size == 0.0 or abs(u) == 0.0:
            cosine, sine = 1.0, 0.0 + 0.0j
        elif abs(v) == 0.0:
            cosine, sine = 0.0, 1.0 + 0.0j
        else:
            cosine = abs(v) / size
            sine = -(v / abs(v)).conjugate() * u / size
            sine = sine.conjugate()
        _columns(f, first, cosine, sine, d)
        f[first + 1, first] = 0.0
    _rows(h, first, cosine, sine, 0, d)
    for k in range(first + 1, last):
        cosine, sine = _rotation(h[k, k - 1], h[k + 1, k - 1])
        _rows(h, k, cosine, sine, k - 1, d)
        h[k + 1, k - 1] = 0.0
        _upward(H, k, cosine, sine)


@helper
def _plain_step(H, first, last, cosines, sines):
    """One step without a shift, which separates eigenvalues that differ by decades."""
    d = H.shape[1]
    for k in range(first, last):
        c, s = _rotation(H[0, k, k], H[0, k + 1, k])
        cosines[k], sines[k] = c, s
        _rows(H[0], k, c, s, k, d)
        H[0, k + 1, k] = 0.0
    for k in range(first, last):
        _upward(H, k, cosines[k], sines[k])


@kernel
def product_eigenvalues(M: Block, values: ComplexVector) -> bool:
    """Fill the d eigenvalues of M[N - 1] ... M[0] (N, d, d), largest first; overwrites M.

    Returns whether the iteration converged.
    """
    H = M[: condense_products(M)].astype(np.complex128)
    K, d, _ = H.shape
    _to_hessenberg(H)
    h = H[0]
    cosines, sines = np.empty(d), np.empty(d, dtype=np.complex128)
    last, tries = d - 1, 0
    while last > 0:
        first = last
        while first > 0:
            size = abs(h[first, first]) + abs(h[first - 1, first - 1])
            if abs(h[first, first - 1]) <= _EPS * size:
                h[first, first - 1] = 0.0
                break
            first -= 1
        if first == last:
            last -= 1
            tries = 0
            continue
        tries += 1
        if tries > _STEPS:
            return False
        if tries == 1:
            _plain_step(H, first, last, cosines, sines)
        else:
            _step(H, first, last, tries % 10 == 0)
    for i in range(d):
        value, exponent = 1.0 + 0.0j, 0
        for j in range(K):
            value *= H[j, i, i]
            size = abs(value)
            if not size < np.inf:
                return False
            if size == 0.0:
                break
            shift = math.frexp(size)[1]
            value *= math.ldexp(1.0, -shift)
            exponent += shift
        exponent = min(max(exponent, -1100), 1023)
        value = complex(math.ldexp(value.real, exponent), math.ldexp(value.imag, exponent))
        k = i
        while k > 0 and abs(values[k - 1]) < abs(value):
            values[k] = values[k - 1]
            k -= 1
        values[k] = value
    return True


def eigenvalues_of_product(factors: Array) -> NDArray[np.complex128]:
    """Eigenvalues (d,) of M[N - 1] ... M[0] for M (N, d, d), by falling modulus.

    Each is accurate to about the round-off of the factors times its condition number, even if it
    is much smaller than the others. Below 1e-308 it becomes zero, above 1e308 infinite.

    Raises
    ------
    ArithmeticError
        If the iteration does not converge (seen only for matrices that are not finite).
    """
    values = np.empty(factors.shape[1], dtype=complex)
    if not product_eigenvalues(np.array(factors, dtype=float, order="C"), values):
        raise ArithmeticError("the periodic QR algorithm did not converge")
    return values
