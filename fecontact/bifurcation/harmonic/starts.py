"""Starts of branches of orbits by harmonic balance: from collocation, and at special points.

A start is a problem, its unknowns u and the direction in which the branch leaves.
"""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.newton import damped_newton
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.predictor import BENT
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.compiled.balance import CompiledBalance
from fecontact.bifurcation.harmonic.engine_order import WaveField, Waves
from fecontact.bifurcation.harmonic.layout import kept_by, layout_of
from fecontact.bifurcation.harmonic.method import HarmonicBalance, require_wave
from fecontact.bifurcation.harmonic.problem import HarmonicProblem
from fecontact.bifurcation.harmonic.series import with_harmonics
from fecontact.bifurcation.orbits import starts as orbit_starts
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

Start = tuple[HarmonicProblem, Array, Array]
T = TypeVar("T", Array, Array | None)

_CORRECTIONS = 40
# Least size of an equation, in that of the largest one, by which it is divided at a branch point.
_ZERO_ROW = 1e-8
# Largest modal displacement at rest that is rounding.
_NO_REST = 1e-14
# Further values of a parameter, as factors, at which the period is asked for.
_BESIDE = (0.97, 1.043)
# Relative difference of numbers that count as the same.
_SAME = 1e-13
# Values at which the period is asked for are apart by this part at least: of values that are the
# same within rounding both the periods and the products are.
_APART = 0.01


def problem_for(
    field: VectorField, values: Array, free: int, method: HarmonicBalance, scales: Array,
    periods: int = 1, offsets: Array | None = None, limits: Array | None = None,
) -> HarmonicProblem:
    """The problem of a field; ``scales`` (d + 2,) of states, period and parameter.

    The former grow with the orbit up to the limits (d,), if there are any.
    ``offsets`` (c,) are those of elements that never slide, see :func:`kept_by`.
    """
    if isinstance(field, ContactField) and field.system().basis.large_deflections:
        _require_even(method)
    layout = layout_of(field)
    found = HarmonicProblem(
        field, values.copy(), free, method.highest, method.count,
        np.zeros((2 * method.highest + 1, layout.harmonic)), scales, layout, periods,
        *timing_of(field, values, free), kept_by(field, layout, offsets), orders=method.orders,
        stability=method.stability, limits=limits, waves=_waves_of(field, method))
    if found.waves is None:
        # The problem is new: nobody has it yet.
        object.__setattr__(found, "compiled", CompiledBalance.of(found))
    return found


def timing_of(
    field: VectorField, values: Array, free: int
) -> tuple[float | None, float | None]:
    """Period of the forcing times a parameter, and the period; None for what is not constant.

    In the first case the parameter is a frequency. In both the period need not be asked for at
    other values, which takes long with contact systems. Known where the parameter is the drive's
    frequency and nothing else repeats; else compared at values beside the given one, or at those
    for which there are systems already.
    """
    if isinstance(field, ContactField) and field.constant_period:
        return None, field.forcing_period(values)
    here = float(values[free])
    try:
        if (isinstance(field, ContactField) and here > 0.0
                and field.repeats_with_drive(values, free)):
            return 1.0, None
    except FecontactError:
        return None, None
    made = field.family.made_for(values, free) if isinstance(field, ContactField) else []
    places = [value for value in made if value * here > 0.0 and value != here][: 1 + len(_BESIDE)]
    if len(places) <= len(_BESIDE) or np.ptp(places) < _APART * abs(here):
        places = [here, *(here * factor for factor in _BESIDE)]
    periods, products = [], []
    for value in places:
        beside = values.copy()
        beside[free] = value
        try:
            period = field.forcing_period(beside)
        except FecontactError:
            return None, None
        if period is None or value == 0.0:
            return None, None
        periods.append(period)
        products.append(period * value)
    return _constant(products), _constant(periods)


def _constant(found: list[float]) -> float | None:
    return found[0] if np.ptp(found) <= _SAME * abs(found[0]) else None


def _waves_of(field: VectorField, method: HarmonicBalance) -> Waves | None:
    """Equations of sectors of a wheel.

    Raises
    ------
    InputError
        For the field of one sector with another engine order, multipliers or tolerance.
    """
    if isinstance(field, WaveField):
        given = method.repeats or field.waves
        if given is not field.waves:
            raise InputError("HarmonicBalance: repeats are another wave than that of the field; "
                             "leave them out.")
        require_wave(method)
        return Waves(field.waves, field.unfolded)
    if method.repeats is not None:
        raise InputError("HarmonicBalance: repeats=EngineOrder(...) needs the field of its wave; "
                         "make it by its method field.")
    return None


def _require_even(method: HarmonicBalance) -> None:
    """Raise InputError unless stretching can follow all harmonics of bending.

    Odd harmonics of bending stretch a body with the even ones beside them. A last odd one without
    its upper neighbour meets a far too stiff body.
    """
    even = range(0, method.highest + 1, 2)
    orders = method.orders or range(method.highest + 1)
    if method.highest % 2 or set(even) - set(orders):
        raise InputError(f"HarmonicBalance: harmonics = {method.harmonics!r} do not suit large "
                         f"deflections, in which the body stretches with twice the frequency of "
                         f"its bending; give an even number, harmonics = "
                         f"{method.highest + method.highest % 2}.")


def require_mean(method: HarmonicBalance, rest: Array) -> None:
    """Raise InputError if the mean is left out, but the displacements at rest (m,) are not zero."""
    if method.orders is not None and 0 not in method.orders and np.abs(rest).max() > _NO_REST:
        raise InputError(f"HarmonicBalance: harmonics = {list(method.orders)} leave out the mean, "
                         f"but constant loads deflect the system at rest; add 0 to the list.")


def unknowns(problem: HarmonicProblem, states: Array, period: float) -> Array:
    """Unknowns u of states (N, d) at the samples of a period [s]."""
    layout = problem.layout
    X = problem.series.projection @ states[:, layout.columns]
    X.reshape(-1)[problem.left_out] = 0.0
    return np.concatenate([X.reshape(-1), [period] if problem.autonomous else [],
                           [problem.values[problem.free]]])


def start_of(
    start: orbit_starts.Begun, method: HarmonicBalance, limits: Array | None
) -> tuple[HarmonicProblem, Array, Array | None]:
    """Problem, unknowns and direction, if there is one, from those by collocation."""
    found, nodes, leaving = start
    problem = replace(problem_for(found.field, found.parameters(nodes), found.free, method,
                                  found.scales, found.periods), limits=limits)
    phases = problem.series.times
    sampled = orbit_starts.at_phase(found, nodes, phases)
    u = unknowns(problem, sampled, found.period(nodes))
    problem = replace(problem, kept=problem.kept.left_by(sampled),
                      reference=problem.coefficients(u).copy())
    if leaving is None:
        return problem, u, None
    tangent = unknowns(problem, orbit_starts.at_phase(found, leaving, phases), 0.0)
    tangent[-problem.common :] = leaving[found.size :]
    return problem, u, tangent / np.sqrt(problem.weights() @ tangent**2)


def restored(field: VectorField, point: BranchPoint) -> Start:
    """Problem, unknowns and tangent of a point of a branch by harmonic balance.

    Raises
    ------
    InputError
        If the point is not such an orbit, or belongs to another field.
    """
    known = point.branch.attributes
    if "engine_order" in known and not isinstance(field, WaveField):
        order = known["engine_order"]
        raise InputError(f"{point.place} is a wave of a wheel under engine order {order}; give the "
                         f"field EngineOrder(wheel, {order}).field(...).")
    if type(point.branch.method) is not HarmonicBalance or "period" not in point.values:
        raise InputError(f"{point.place} is no periodic orbit by harmonic balance.")
    values, free = point.parameter_values(field), field.index(point.branch.parameter_name)
    problem = problem_for(field, values, free, point.branch.method,
                          np.asarray(known["scales"], dtype=float), int(known["periods"]),
                          known.get("kept_deflections"))
    if len(point.u) != problem.size + problem.common:
        raise InputError(f"{point.place} has {len(point.u)} unknowns, which are not those of this "
                         f"field.")
    return (replace(problem, reference=problem.coefficients(point.u).copy(),
                    limits=known.get("limits"), row=known.get("observed_row")), point.u,
            point.tangent)


def converged_orbit(
    problem: HarmonicProblem, u: Array, tolerance: float = 1e-8
) -> tuple[HarmonicProblem, Array]:
    """The orbit near u at fixed parameter.

    Raises
    ------
    AnalysisError
        If Newton's method does not converge, or converges to an equilibrium.
    """
    row = unit(len(u))
    found = problem.found(u, row, tolerance)
    if found is not None:
        return problem, found[0]
    name = list(problem.field.parameters)[problem.free]
    where = f"at {name} = {u[-1]:.6g}, from the period {problem.period(u):.6g} s"

    def motion(u: Array) -> float:
        return float(np.abs(problem.coefficients(u)[1:]).max())

    begin = motion(u)
    u, norm, converged = damped_newton(problem, u, row, tolerance, _CORRECTIONS)
    if not converged:
        raise AnalysisError(f"No periodic orbit was found {where}: Newton's method does not "
                            f"converge (residual {norm:.3g}); start nearer to it, or take other "
                            f"than {problem.harmonics} harmonics.")
    if problem.autonomous and motion(u) <= 1e-4 * begin:
        raise AnalysisError(f"No periodic orbit was found {where}: the iteration ends without any "
                            f"motion, as at an equilibrium; start from a motion of larger "
                            f"amplitude.")
    return replace(problem, reference=problem.coefficients(u).copy()), u


def doubled(problem: HarmonicProblem, u: Array) -> Start:
    """Start on the doubled orbits at a period doubling u, with all harmonics up to twice H.

    The direction is the null vector of the odd harmonics of the doubled period, which change sign
    after one period.
    """
    X = problem.coefficients(u)
    twice = np.zeros((4 * problem.harmonics + 1, X.shape[1]))
    twice[0], twice[3::4], twice[4::4] = X[0], X[1::2], X[2::2]
    common = u[-problem.common :].copy()
    periods, scales = problem.periods, problem.scales.copy()
    scales[-2] *= 2.0
    if problem.autonomous:
        common[0] *= 2.0
    else:
        periods *= 2
    result = replace(problem, harmonics=2 * problem.harmonics, samples=2 * problem.samples,
                     orders=None, reference=twice, periods=periods, scales=scales,
                     predictor=BENT)
    start = np.append(twice.reshape(-1), common)
    odd = np.zeros(twice.shape, dtype=bool)
    odd[1::4] = odd[2::4] = True
    places = np.flatnonzero(odd.reshape(-1))
    _, _, vectors = np.linalg.svd(result.linearise(start).condensed[np.ix_(places, places)])
    leaving = np.zeros_like(start)
    leaving[places] = vectors[-1]
    return result, start, leaving


def crossing(problem: HarmonicProblem, u: Array, incoming: Array) -> Start:
    """Start on the other branch of orbits through a branch point u.

    ``incoming`` is the direction of the first branch nearby.
    """
    row = problem.weights() * incoming
    equations = problem.linearise(u).condensed
    sizes = np.abs(equations).max(axis=1)
    # One of the equations may be zero within rounding.
    sizes = np.maximum(sizes, _ZERO_ROW * sizes.max())
    _, _, vectors = np.linalg.svd(equations / sizes[:, None])
    first, second = vectors[-2:]
    return problem, u, (row @ second) * first - (row @ first) * second


def with_more(
    problem: HarmonicProblem, u: Array, tangent: T, method: HarmonicBalance
) -> tuple[HarmonicProblem, Array, T]:
    """Problem, unknowns and tangent with another number of harmonics and samples."""
    result = replace(problem, harmonics=method.highest, samples=method.count,
                     reference=with_harmonics(problem.coefficients(u), method.highest),
                     orders=method.orders, stability=method.stability, predictor=BENT)

    def changed(vector: Array) -> Array:
        X = with_harmonics(problem.coefficients(vector), method.highest).reshape(-1)
        X[result.left_out] = 0.0
        return np.append(X, vector[-problem.common :])

    found = changed(u)
    return (replace(result, reference=result.coefficients(found).copy()), found,
            tangent if tangent is None else changed(tangent))
