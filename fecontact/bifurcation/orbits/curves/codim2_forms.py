"""Normal form coefficients of points of codimension two of orbits.

With time in periods of the orbit, critical vectors of unit mean square in the scaled states, real
amplitudes u and complex ones z, r = |z|, each turned by its multiplier from period to period:

    cusp                        u' = c u^3
    generalised period doubling u' = e u^5
    Chenciner                   r' = d r^5
    resonance 1:1               u'' = a u^2 + b u u', a > 0
    resonance 1:2               u'' = c u^3 + d u^2 u'
    resonance 1:3               z' = b conj(z)^2 + (c + i f) z r^2, b > 0; f depends on the choice
                                of z
    resonance 1:4               z' = (a + i b) z r^2 + d conj(z)^3, d > 0
    fold-flip                   u' = b u^2 + c v^2, v' = (d u + e u^2) v, b > 0
    fold-Neimark-Sacker         u' = b u^2 + c r^2, r' = (d u + e u^2) r, b > 0
    flip-, double Neimark-S.    u' = u (p11 u^2 + p12 r^2), r' = r (p21 u^2 + p22 r^2)

References
----------
Y. A. Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed., chapters 8 and 9. V. De Witte,
F. Della Rossa, W. Govaerts and Y. A. Kuznetsov, SIAM J. Appl. Dyn. Syst. 12, 722-788 (2013).
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from fecontact.bifurcation.orbits.collocation_equations import (
    CollocationEquations,
    CollocationLinearisation,
)
from fecontact.bifurcation.orbits.curves.centre_manifold import CentreManifold, Series
from fecontact.bifurcation.orbits.kinks import JacobianKinks
from fecontact.core.errors import AnalysisError, FecontactError
from fecontact.core.types import Array

# Radii of the amplitudes at which series are fitted, where one is the range of the states. Those
# below the least usual one are for orbits that feel a steep law, where others agree worse than so.
_RADII = (0.5, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)
_LEAST_USUAL = 1e-3
_WELL_ENOUGH = 1e-4
# Relative difference between two radii at which no other one is tried, and relative error that no
# agreement shows: the point itself is known to the root of rounding along its curve.
_AGREEMENT = 1e-7
# Two smaller radii contradict a value where both differ from it by this multiple of their own
# difference. Rounding does not: it grows so fast that the last radius differs from all others.
_CONTRADICTION = 2.0
# Part of the largest term below which a coefficient that divides counts as zero.
_CANCELLATION = 1e-9


class Form(NamedTuple):
    """Data of a normal form.

    ``multipliers`` are those of the amplitudes, from the critical pair (first) and the pair beside
    it, ``order`` is that of the series, and ``formula`` gives the coefficients.
    """

    multipliers: Callable[[complex, complex], Sequence[complex]]
    order: int
    formula: Callable[[Series], list[float]]
    chain: bool = False


def orbit_form(
    kind: str, problem: CollocationEquations, u: Array, linearised: CollocationLinearisation,
    pair: complex = 1.0, beside: complex = 1.0,
) -> dict[str, Any]:
    """'normal_form' and 'normal_form_error', the coefficients of a kind in the order above.

    ``pair`` is the critical multiplier with positive imaginary part of a curve of tori, and
    ``beside`` that of a pair besides the critical one. The error is that of :func:`agreed`; that of
    the mesh is not in it. It is infinite where second derivatives jump along the orbit, as those of
    friction with exp(-b |v|) do at zero slip: the share of such jumps in third derivatives is left
    out. Empty for other kinds, and where nothing is found.
    """
    if kind not in _FORMS:
        return {}
    form = _FORMS[kind]
    multipliers = form.multipliers(_on_circle(pair), _on_circle(beside))
    try:
        manifold = CentreManifold(problem, u, linearised, multipliers, form.chain)
        value, error, _ = agreed(manifold, form.order, form.formula)
        if form.order > 2 and JacobianKinks(linearised).passages:
            error = np.full_like(error, np.inf)
    except (FecontactError, np.linalg.LinAlgError):
        return {}
    return {"normal_form": value, "normal_form_error": error} if np.isfinite(value).any() else {}


def agreed(
    manifold: CentreManifold, order: int, formula: Callable[[Series], list[float]]
) -> tuple[Array, Array, Series]:
    """Coefficients of a series from the two radii that agree best, their error, the series.

    The error is the difference between the two radii, or from smaller radii that agree with each
    other but not with them. Radii at which the rates are not finite are left out.

    Raises
    ------
    AnalysisError
        If less than two are left.
    """
    found: list[tuple[Array, Series]] = []
    with np.errstate(all="ignore"):
        for radius in _RADII:
            errors = _errors([value for value, _ in found])
            enough = _AGREEMENT if radius >= _LEAST_USUAL else _WELL_ENOUGH
            if errors and min(relative for _, relative in errors) < enough:
                break
            series = Series(manifold, order, radius)
            if series.is_finite:
                # A coefficient that the formula leaves open is NaN at all radii.
                found.append((np.array(formula(series)), series))
        errors = _errors([value for value, _ in found])
    if not errors:
        raise AnalysisError(f"The rates about the orbit are not finite at amplitudes of "
                            f"{_RADII[-2]:g} of its range; the field must be smooth there.")
    place = min(range(len(errors)), key=lambda one: errors[one][1])
    value, series = found[place + 1]
    floor = _AGREEMENT * np.nanmax(np.abs(value))
    return value, np.maximum(errors[place][0], floor), series


def _errors(values: Sequence[Array]) -> list[tuple[Array, float]]:
    """Errors of the values of radii after the first one, and these relative to the largest value.

    The radii fall.
    """
    steps = [np.abs(after - before) for before, after in pairwise(values)]
    found = []
    for place, value in enumerate(values[1:]):
        error = steps[place]
        for later in range(place + 1, len(steps)):
            away = np.minimum(np.abs(values[later] - value), np.abs(values[later + 1] - value))
            if np.nanmax(away) > _CONTRADICTION * np.nanmax(steps[later]):
                error = np.maximum(error, away)
        size = np.nanmax(np.abs(value))
        relative = 0.0 if size == 0.0 else float(np.nanmax(error) / size)
        found.append((error, relative if np.isfinite(relative) else np.inf))
    return found


def _on_circle(multiplier: complex) -> complex:
    return multiplier / abs(multiplier)


def _two_of(one: complex) -> list[complex]:
    return [one, one.conjugate()]


def _third(order: int) -> complex:
    return complex(np.exp(2j * np.pi / order))


def _at_1_1(series: Series) -> list[float]:
    a, b = series.term(1, 2, 0).real, series.term(1, 1, 1).real
    return [abs(a), float(np.copysign(1.0, a)) * b]


def _at_1_4(series: Series) -> list[float]:
    turning = series.term(0, 2, 1)
    return [turning.real, turning.imag, abs(series.term(0, 0, 3))]


def _with_fold(series: Series) -> list[float]:
    """Coefficients of a fold with a doubling (u, v) or a pair (u, z, conj(z))."""
    pair = (1, 1) if len(series.powers[0]) == 3 else (2,)
    none = (0,) * len(pair)
    one = (1, *none[1:])
    cubic = (2, 1) if len(pair) == 2 else (3,)
    g20, g02 = series.term(0, 2, *none).real, series.term(0, 0, *pair).real
    g30, g12 = series.term(0, 3, *none).real, series.term(0, 1, *pair).real
    g11, g21, g03 = (series.term(1, power, *rest).real
                     for power, rest in ((1, one), (2, one), (0, cubic)))
    e = np.nan
    if min(abs(g20), abs(g02)) > _CANCELLATION * max(abs(g20), abs(g02), abs(g11)):
        e = (g21 + g11 * g03 / g02 - 1.5 * g11 * g30 / g20 + 0.5 * g11 * g12 / g02
             - g03 * g20 / g02)
    return [*(float(np.copysign(1.0, g20)) * np.array([g20, g02, g11])).tolist(), e]


def _two_cubic(series: Series) -> list[float]:
    """Coefficients of a doubling (u) or a pair (w, conj(w)), and another pair (z, conj(z))."""
    none, square, cube, one = (((0,), (2,), (3,), (1,)) if len(series.powers[0]) == 3
                               else ((0, 0), (1, 1), (2, 1), (1, 0)))
    place = len(none)
    return [series.term(at, *powers).real for at, powers in (
        (0, (*cube, 0, 0)), (0, (*one, 1, 1)), (place, (*square, 1, 0)),
        (place, (*none, 2, 1)))]


_FORMS: dict[str, Form] = {
    "cusp": Form(lambda pair, beside: [1.0], 3, lambda series: [series.term(0, 3).real]),
    "generalised period doubling": Form(
        lambda pair, beside: [-1.0], 5, lambda series: [series.term(0, 5).real]),
    "Chenciner": Form(lambda pair, beside: _two_of(pair), 5,
                      lambda series: [series.term(0, 3, 2).real]),
    "resonance 1:1": Form(lambda pair, beside: [1.0, 1.0], 2, _at_1_1, chain=True),
    "resonance 1:2": Form(
        lambda pair, beside: [-1.0, -1.0], 3,
        lambda series: [series.term(1, 3, 0).real, series.term(1, 2, 1).real], chain=True),
    "resonance 1:3": Form(
        lambda pair, beside: _two_of(_third(3)), 3,
        lambda series: [abs(series.term(0, 0, 2)), series.term(0, 2, 1).real]),
    "resonance 1:4": Form(lambda pair, beside: _two_of(_third(4)), 3, _at_1_4),
    "fold-flip": Form(lambda pair, beside: [1.0, -1.0], 3, _with_fold),
    "fold-Neimark-Sacker": Form(lambda pair, beside: [1.0, *_two_of(beside)], 3, _with_fold),
    "flip-Neimark-Sacker": Form(lambda pair, beside: [-1.0, *_two_of(beside)], 3, _two_cubic),
    "double Neimark-Sacker": Form(
        lambda pair, beside: [*_two_of(pair), *_two_of(beside)], 3, _two_cubic)}
