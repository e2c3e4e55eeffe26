"""Floquet multipliers about a constant state of a field whose rates are periodic in time."""

import numpy as np

from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.floquet import Floquet
from fecontact.core.checks import as_count, as_floats
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike
from fecontact.system.fields.vector_field import VectorField, require_field

# Degree of the polynomials, and least and largest number of intervals over one period of the rates.
_DEGREE, _LEAST, _MOST = 4, 20, 2560
# Change of the multipliers, in the largest one or in 1, at which the intervals suffice. On a border
# of stability two of them meet, and rounding changes each by its root: there a change below the
# second number ends the search once it falls no more on twice the intervals.
_CONVERGED, _MET = 1e-9, 1e-5
# Largest rate at the state, in parts of its largest derivative times the scale of the states.
_AT_REST = 1e-9


@one_blas_thread
def floquet_multipliers(
    field: VectorField, state: ArrayLike | None = None, *, periods: int = 1
) -> Floquet:
    """Floquet multipliers (d,) about a constant state x0 with f(t, x0, p) = 0 at all times t.

    They are the eigenvalues of the fundamental matrix over one period T of the rates: a small
    deviation from the state grows by such a factor in each period. The state is stable if all lie
    within the unit circle. An example is parametric resonance, as of Mathieu's equation
    x'' + (a + b cos t) x = 0 about x = 0.

    Intervals of collocation are doubled until the multipliers change by less than 1e-9, relative to
    the largest one or to 1, or by rounding alone.

    Parameters
    ----------
    field : VectorField
        Rates of a period in time, at the base values of the parameters.
    state : (d,) sequence, optional
        The constant state; by default zero.
    periods : int
        Number of periods of the rates over which deviations are followed.

    Returns
    -------
    Floquet
        With ``multipliers`` (d,) by falling modulus, ``unstable`` (their number outside the unit
        circle) and ``stable``.

    Raises
    ------
    InputError
        If the rates do not depend on time, or are not zero at the state.
    AnalysisError
        If the multipliers do not converge.
    """
    require_field(field)
    count = as_count(periods, "floquet_multipliers: periods")
    x = (np.zeros(field.dimension) if state is None
         else as_floats(state, "floquet_multipliers: state"))
    if x.shape != (field.dimension,):
        raise InputError(f"floquet_multipliers: state must hold {field.dimension} numbers, one for "
                         f"each state of the field, not have the shape {x.shape}.")
    values = field.values
    period = field.forcing_period(values)
    if period is None:
        raise InputError("floquet_multipliers: the rates of the field do not depend on time; take "
                         "find_equilibrium(field, start=state), whose eigenvalues tell the "
                         "stability, or give vector_field the period of the rates.")
    _require_rest(field, x, values, period)
    intervals = _LEAST * count
    found, change = _on(field, x, values, intervals, count), np.inf
    while intervals < _MOST * count:
        intervals *= 2
        coarser, before = found, change
        found = _on(field, x, values, intervals, count)
        change = _apart(coarser, found)
        if change <= _CONVERGED or before < change <= _MET:
            return found
    raise AnalysisError(f"The Floquet multipliers still change on {intervals} intervals; the "
                        f"rates change too fast within one period of {period:.6g} s, or are not "
                        f"smooth in time.")


def _on(
    field: VectorField, state: Array, values: Array, intervals: int, periods: int
) -> Floquet:
    """Multipliers on a number of equal intervals."""
    nodes = np.tile(state, (intervals * _DEGREE, 1))
    problem = CollocationProblem(
        field, values, 0, np.linspace(0.0, 1.0, intervals + 1), _DEGREE, nodes,
        np.ones(field.dimension + 2), periods)
    return problem.linearise(np.append(nodes.ravel(), values[0])).floquet


def _apart(one: Floquet, other: Floquet) -> float:
    """Largest distance between multipliers, each from the nearest of the other ones, relative."""
    away = np.abs(one.multipliers[:, None] - other.multipliers)
    size = max(1.0, float(np.abs(other.multipliers).max()))
    return float(max(away.min(axis=0).max(), away.min(axis=1).max())) / size


def _require_rest(field: VectorField, state: Array, values: Array, period: float) -> None:
    """Raise InputError unless the rates at a state are zero at all times of a period."""
    times: Array = np.linspace(0.0, period, 32, endpoint=False)
    rates, slopes, _ = field.derivatives(times, np.tile(state, (len(times), 1)), values)
    scale = float(np.abs(slopes).max()) * max(1.0, float(np.abs(state).max()))
    place = int(np.abs(rates).max(axis=1).argmax())
    worst = float(np.abs(rates[place]).max())
    if not worst <= _AT_REST * scale:
        raise InputError(f"floquet_multipliers: the state is not at rest: at t = "
                         f"{times[place]:.6g} s a rate is {worst:.3g}, and must be 0 at all times; "
                         f"give the constant state, or follow the periodic motion with "
                         f"orbit_branch, whose points store their multipliers.")
