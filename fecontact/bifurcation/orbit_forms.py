"""Normal forms of orbits that were found by shooting or harmonic balance."""

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import (
    NeimarkSackerPoint,
    PeriodDoublingPoint,
    require_no_family,
    with_details,
)
from fecontact.bifurcation.orbits.mesh import require_mesh
from fecontact.bifurcation.orbits.normal_forms import examined, verdict
from fecontact.bifurcation.orbits.starts import MotionStart, corrected_samples
from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.integrate.solvers import SetValued
from fecontact.system.fields.vector_field import VectorField, require_field

# Samples of the orbit, degree of the polynomials, doublings of the intervals, and the change of the
# coefficient from mesh to mesh at which it has converged.
_SAMPLES, _DEGREE, _DOUBLINGS, _CONVERGED = 4001, 4, 4, 1e-3


@one_blas_thread
def with_normal_form(
    field: VectorField, point: BranchPoint, intervals: int = 100
) -> BranchPoint:
    """A period doubling or Neimark-Sacker point with its coefficient and criticality.

    Points of branches by collocation have them; for those by shooting or harmonic balance the orbit
    is computed by collocation at the parameter of the point, on so many intervals and twice as many
    until the coefficient changes by less than 1e-3 of itself, at most four times.

    Parameters
    ----------
    field : VectorField
        Field of the branch.
    point : PeriodDoublingPoint or NeimarkSackerPoint
        A point of a branch of orbits.
    intervals : int
        Intervals of the first mesh; motions with steep friction need many.

    Returns
    -------
    PeriodDoublingPoint or NeimarkSackerPoint
        Point with ``coefficient``, ``coefficient_error`` and ``criticality``; unchanged if
        it has them.

    Raises
    ------
    InputError
        If the point is of another kind, of a set-valued system, or belongs to another field.
    AnalysisError
        If collocation finds no orbit, or one without a critical multiplier.
    """
    require_field(field)
    require_kind("with_normal_form", (PeriodDoublingPoint, NeimarkSackerPoint), point=point)
    require_mesh(intervals, _DEGREE)
    if not point.is_orbit or "parameters" in point.branch.attributes:
        raise InputError(f"{point.place} is none of a branch of orbits over one parameter.")
    if point.criticality is not None:
        return point
    require_no_family(point)
    if isinstance(getattr(point.method, "solver", None), SetValued):
        raise InputError(f"{point.place} is one of a set-valued system, which has no smooth normal "
                         f"form.")
    values, free = point.parameter_values(field), field.index(point.branch.parameter_name)
    widths = np.delete(np.asarray(point.branch.attributes["scales"], dtype=float), -2)
    start = MotionStart(field, values, free, point.orbit(field, _SAMPLES), widths)
    kind = "torus" if isinstance(point, NeimarkSackerPoint) else "period doubling"
    coefficient, error = np.nan, np.nan
    for doubling in range(_DOUBLINGS + 1):
        problem, u = corrected_samples(
            lambda count: start.on_mesh(count, _DEGREE), intervals * 2**doubling)
        found = examined(kind, problem, u, problem.linearise(u))
        if found is None:
            raise AnalysisError(f"{point.place}: the orbit by collocation has no critical "
                                f"multiplier; take more than {intervals} intervals.")
        before, coefficient = coefficient, float(found["coefficient"])
        change = abs(coefficient - before)
        error = max(change, float(found["coefficient_error"]))
        if change <= _CONVERGED * abs(coefficient):
            break
    return with_details(point, **verdict(coefficient, error))
