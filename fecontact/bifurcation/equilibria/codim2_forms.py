"""Normal form coefficients of points of codimension two of equilibria.

With A the Jacobian, B to E the second to fifth derivatives of the rates, from differences, the
critical eigenvectors q, of Euclidean length one, and those of the transpose p, conj(p) q = 1. The
amplitudes z are those of x = z q + conj(z q) + ...; u those of real vectors, in the direction in
which a and b, the first ones of u^2, are positive.

    cusp              u' = c u^3
    Bautin            l2 = Re c2 / w,  z' = i w z + c1 z |z|^2 + c2 z |z|^4
    Bogdanov-Takens   u'' = a u^2 + b u u'
    zero-Hopf         u' = b u^2 + c |z|^2,  z' = (i w + d u + e u^2) z, d and e real parts
    double Hopf       r1' = r1 (p11 r1^2 + p12 r2^2),  r2' = r2 (p21 r1^2 + p22 r2^2), r = |z|

References
----------
Y. A. Kuznetsov, SIAM J. Numer. Anal. 36, 1104-1124 (1999); Elements of Applied Bifurcation Theory,
3rd ed., chapter 8.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from fecontact.bifurcation.equilibria.normal_forms import (
    along_null_vector,
    bordered,
    critical_pair,
    null_vectors,
)
from fecontact.bifurcation.fields.multilinear_forms import Bend, bend
from fecontact.core.types import Array, ComplexArray
from fecontact.system.fields.vector_field import VectorField

# Rounding of a coefficient relative to the largest of its terms.
_CANCELLATION = 1e-9


class _Forms:
    """Multilinear forms of real and complex arguments, the last one left open: matrices (d, d).

    ``fine`` says which of two differences is taken.
    """

    def __init__(self, bent: Callable[[Array], tuple[Bend, Bend]], fine: bool) -> None:
        self._bent, self._place = bent, 0 if fine else 1

    def _along(self, direction: Array) -> Bend:
        size = float(np.linalg.norm(direction)) or 1.0
        bent = self._bent(direction / size)[self._place]
        return Bend(size * bent.first, size**2 * bent.second, tuple(
            size**order * part for order, part in enumerate(bent.higher, start=3)))

    def B(self, a: Any) -> ComplexArray:
        """Matrix of the form B with the argument a."""
        return np.asarray(self._along(a.real).first + 1j * self._along(a.imag).first)

    def C(self, a: Any, b: Any) -> ComplexArray:
        """Matrix of the form C with the arguments a and b."""
        return np.asarray(self._mixed(a.real, b.real) - self._mixed(a.imag, b.imag)
                          + 1j * (self._mixed(a.real, b.imag) + self._mixed(a.imag, b.real)))

    def _mixed(self, a: Array, b: Array) -> Array:
        """C(a, b, .) for real arguments, by polarisation."""
        sizes = float(np.linalg.norm(a)), float(np.linalg.norm(b))
        if not min(sizes) > 0.0:
            return np.zeros((len(a), len(a)))
        a, b = a / sizes[0], b / sizes[1]
        if np.array_equal(a, b):
            return sizes[0] * sizes[1] * self._along(a).second
        return 0.25 * sizes[0] * sizes[1] * (self._along(a + b).second - self._along(a - b).second)

    def of_fourth(self, q: ComplexArray) -> tuple[ComplexArray, ComplexArray, Array]:
        """D(q, q, q, .), D(q, q, conj(q), .) and E(q, q, conj(q), conj(q), .)."""
        a, b = q.real, q.imag
        (aaa, aaaa), (bbb, bbbb), (plus, plus4), (minus, minus4) = (
            self._along(one).higher for one in (a, b, a + b, a - b))
        aab, abb = (plus - minus - 2.0 * bbb) / 6.0, (plus + minus - 2.0 * aaa) / 6.0
        aabb = (plus4 + minus4 - 2.0 * (aaaa + bbbb)) / 12.0
        return (np.asarray(aaa - 3.0 * abb + 1j * (3.0 * aab - bbb)),
                np.asarray(aaa + abb + 1j * (aab + bbb)),
                np.asarray(aaaa + 2.0 * aabb + bbbb))


def codim2_form(
    kind: str, field: VectorField, x: Array, values: Array, scales: Array, w: float = 0.0,
    other: float = 0.0,
) -> dict[str, Any]:
    """'normal_form' and 'normal_form_error', the coefficients of a kind in the order above.

    Empty for other kinds, and where a resonance makes equations singular; NaN where not defined.
    ``w`` is the angular frequency of the pair, ``other`` that of the second one.
    """
    if kind == "cusp":
        along = along_null_vector(field, x, values, scales)[1]
        if not along:
            return {}
        (_, cubic, _, terms), (_, other_cubic, _, _) = along
        return {"normal_form": np.array([cubic / 6.0]), "normal_form_error": np.array(
            [abs(cubic - other_cubic) / 6.0 + _CANCELLATION * terms])}
    if kind not in ("Bautin", "Bogdanov-Takens", "zero-Hopf", "double Hopf"):
        return {}
    A = field.derivatives(np.zeros(1), x[None], values)[1][0]
    known: dict[bytes, tuple[Bend, Bend]] = {}

    def bent(direction: Array) -> tuple[Bend, Bend]:
        key = direction.tobytes()
        if key not in known:
            known[key] = bend(field, x, values, direction, scales, higher=kind == "Bautin")
        return known[key]

    def found(fine: bool) -> tuple[Array, float]:
        forms = _Forms(bent, fine)
        if kind == "Bautin":
            return _bautin(A, forms, w)
        if kind == "Bogdanov-Takens":
            return _bogdanov_takens(A, forms)
        return _zero_hopf(A, forms, w) if kind == "zero-Hopf" else _double_hopf(A, forms, w, other)

    try:
        with np.errstate(divide="ignore", invalid="ignore"):
            (best, size), (coarse, _) = found(True), found(False)
    except np.linalg.LinAlgError:
        return {}
    return {"normal_form": best,
            "normal_form_error": np.abs(best - coarse) + _CANCELLATION * size}


def _bautin(A: Array, forms: _Forms, w: float) -> tuple[Array, float]:
    """Second Lyapunov coefficient, where the first one is zero."""
    _, q, p = critical_pair(A, 1j * w)
    c, one = q.conj(), np.eye(len(A))
    D, E = forms.of_fourth(q)[:2], forms.of_fourth(q)[2]
    B, Bc, Cqq, Cqc = forms.B(q), forms.B(c), forms.C(q, q), forms.C(q, c)
    h20 = np.linalg.solve(2j * w * one - A, B @ q)
    h11 = -np.linalg.solve(A, B @ c)
    third = Cqq @ c + Bc @ h20 + 2.0 * B @ h11
    G21 = np.vdot(p, third)
    h30 = np.linalg.solve(3j * w * one - A, Cqq @ q + 3.0 * B @ h20)
    h21 = _within(1j * w * one - A, q, p, third - G21 * q)
    B20, B11 = forms.B(h20), forms.B(h11)
    h31 = np.linalg.solve(2j * w * one - A, (
        D[0] @ c + 3.0 * Cqq @ h11 + 3.0 * Cqc @ h20 + 3.0 * B20 @ h11 + Bc @ h30
        + 3.0 * B @ h21 - 3.0 * G21 * h20))
    h22 = -np.linalg.solve(A, (
        D[1] @ c + 4.0 * Cqc @ h11 + 2.0 * (Cqq @ h20.conj()).real + 2.0 * B11 @ h11
        + 4.0 * (B @ h21.conj()).real + B20 @ h20.conj()))
    terms = [
        E @ q, D[0] @ h20.conj(), 3.0 * D[1].conj() @ h20, 6.0 * D[1] @ h11,
        Cqq.conj() @ h30, 3.0 * Cqq @ h21.conj(), 6.0 * Cqc @ h21,
        3.0 * forms.C(h20.conj(), h20) @ q, 6.0 * forms.C(h11, h11) @ q,
        6.0 * forms.C(h20, h11) @ c, 2.0 * Bc @ h31, 3.0 * B @ h22, B20.conj() @ h30,
        3.0 * B20 @ h21.conj(), 6.0 * B11 @ h21]
    return _projected(p, terms, 12.0 * w)


def _bogdanov_takens(A: Array, forms: _Forms) -> tuple[Array, float]:
    """Coefficients a and b of a double eigenvalue zero with one eigenvector."""
    q0, p1 = null_vectors(A)
    q1 = bordered(A, p1, q0, q0)
    p1 = p1 / (p1 @ q1)
    p0 = bordered(A.T, q0, p1, p1)
    p0 = p0 - (p0 @ q1) * p1
    B = forms.B(q0).real
    a, b = 0.5 * p1 @ B @ q0, p0 @ B @ q0 + p1 @ B @ q1
    size = max(np.abs(left) @ np.abs(B) @ np.abs(right)
               for left, right in ((p1, q0), (p0, q0), (p1, q1)))
    return np.copysign(1.0, a) * np.array([a, b]), float(size)


def _zero_hopf(A: Array, forms: _Forms, w: float) -> tuple[Array, float]:
    """Coefficients b, c, Re d and Re e, the last one NaN where b or c is zero."""
    q0, p0 = null_vectors(A)
    p0 = p0 / (p0 @ q0)
    _, q1, p1 = critical_pair(A, 1j * w)
    c, one = q1.conj(), np.eye(len(A))
    B0, B1, C00, C1c = forms.B(q0).real, forms.B(q1), forms.C(q0, q0), forms.C(q1, c)
    G200, G011, H110 = p0 @ B0 @ q0, (p0 @ B1 @ c).real, np.vdot(p1, B0 @ q1)
    h200 = -_within(A, q0, p0, B0 @ q0 - G200 * q0).real
    h011 = -_within(A, q0, p0, (B1 @ c).real - G011 * q0).real
    h020 = np.linalg.solve(2j * w * one - A, B1 @ q1)
    h110 = _within(1j * w * one - A, q1, p1, B0 @ q1 - H110 * q1)
    cubic = C00 @ q0 + 3.0 * B0 @ h200
    mixed = C1c @ q0 + B0 @ h011 + 2.0 * (B1 @ h110.conj()).real
    G300, G111 = (p0 @ cubic).real, (p0 @ mixed).real
    H210 = np.vdot(p1, C00 @ q1 + 2.0 * B0 @ h110 + B1 @ h200)
    H021 = np.vdot(p1, C1c @ q1 + 2.0 * B1 @ h011 + B1.conj() @ h020)
    lower = np.copysign(1.0, G200) * np.array([0.5 * G200, G011, H110.real])
    size = float(np.abs(p0) @ (np.abs(B0) @ np.abs(q0) + np.abs(B1) @ np.abs(q1)))
    if min(abs(G200), abs(G011)) <= _CANCELLATION * size:
        return np.append(lower, np.nan), size
    terms = [H210, H110 * H021.real / G011, -H110 * G300 / G200, H110 * G111 / G011,
             -H021 * G200 / (2.0 * G011)]
    size = max(size, *(float(abs(term)) for term in terms))
    return np.append(lower, 0.5 * sum(terms).real), size


def _double_hopf(A: Array, forms: _Forms, w1: float, w2: float) -> tuple[Array, float]:
    """Coefficients p11, p12, p21 and p22."""
    one = np.eye(len(A))
    pairs = [(w, *critical_pair(A, 1j * w)[1:]) for w in (w1, w2)]
    found: list[float] = []
    sizes: list[float] = []
    for mine, (w, q, p) in enumerate(pairs):
        for other, (v, r, _) in enumerate(pairs):
            B, Br, c = forms.B(q), forms.B(r), r.conj()
            mean = -np.linalg.solve(A, Br @ c)
            above = np.linalg.solve(1j * (w + v) * one - A, B @ r)
            if mine == other:
                terms = [forms.C(q, q) @ c, B.conj() @ above, 2.0 * B @ mean]
            else:
                below = np.linalg.solve(1j * (w - v) * one - A, B @ c)
                terms = [forms.C(r, c) @ q, Br.conj() @ above, Br @ below, B @ mean]
            value, size = _projected(p, terms, 2.0 if mine == other else 1.0)
            found.append(float(value[0]))
            sizes.append(size)
    return np.array(found), max(sizes)


def _projected(p: ComplexArray, terms: list[Any], divisor: float) -> tuple[Array, float]:
    """Real part of conj(p) times a sum, and the largest of its terms."""
    size = max(float(np.abs(p) @ np.abs(term)) for term in terms)
    return np.array([float(np.vdot(p, sum(terms)).real) / divisor]), size / divisor


def _within(M: Any, q: Any, p: Any, rhs: Any) -> Any:
    """Solution h of M h = rhs with conj(p) h = 0, for M q = 0 = conj(p) M."""
    return bordered(M, q, p.conj(), rhs)
