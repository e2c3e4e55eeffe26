"""Branches of tori, from Neimark-Sacker points, runs, orbits and other tori."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from fecontact.bifurcation.continuation.attempts import first_that_goes
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.newton import damped_newton
from fecontact.bifurcation.continuation.point import BranchPoint, attributes_of
from fecontact.bifurcation.continuation.points import NeimarkSackerPoint
from fecontact.bifurcation.continuation.problem import (
    ContinuationOptions,
    options_of,
    require_direction,
    sizes_of,
    width_of,
)
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.layout import Layout, layout_of
from fecontact.bifurcation.harmonic.series import real_coefficients, turned
from fecontact.bifurcation.orbits.branches import as_motion, values_of
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.bifurcation.tori.elements import elements_of
from fecontact.bifurcation.tori.excitation import Excitation, excitation_of
from fecontact.bifurcation.tori.from_run import fitted
from fecontact.bifurcation.tori.method import SecondExcitation, TorusBalance
from fecontact.bifurcation.tori.motion import torus_motion
from fecontact.bifurcation.tori.problem import TorusProblem
from fecontact.bifurcation.tori.series import with_orders
from fecontact.core.checks import require_flags, require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.field_runs.field_run import FieldRun
from fecontact.integrate.trajectory import Trajectory
from fecontact.system.elastic_sliders import slider_counts
from fecontact.system.fields.vector_field import VectorField, require_field

# Factors of the first step, tried in this order to leave a Neimark-Sacker point.
_FIRST_STEPS = (1.0, 0.3, 0.1, 3.0)
_SAMPLES = 2001
# Newton's method at fixed parameter: steps, and size of the last one.
_CORRECTIONS, _TOLERANCE = 30, 1e-9
# Part of the torus in the harmonics of the second frequency below which it is an orbit.
_ORBIT = 1e-6


@one_blas_thread
def torus_branch(
    field: VectorField,
    start: BranchPoint | PeriodicMotion | Trajectory | FieldRun | tuple[ArrayLike, ArrayLike],
    parameter: str | None = None, *, second: str | SecondExcitation | None = None,
    method: TorusBalance | None = None, options: ContinuationOptions | None = None,
    bounds: tuple[float, float] | None = None, scales: ArrayLike | None = None,
    width: float | None = None, direction: float = 1.0, both: bool = False,
) -> Branch:
    """Follow quasi-periodic motions with two frequencies over a parameter.

    Points store 'frequency_1' and 'frequency_2' [Hz], 'minimum' and 'maximum' (d,),
    'truncation_error' and 'sampling_error' (relative to the torus), 'multipliers' (d,) (mean growth
    per period 1 / f1), 'stable' and 'trivial_error'. :func:`torus_motion` gives the motion.

    Parameters
    ----------
    field : VectorField
        The system, excited with one period or not at all, or with two by ``second``.
    start : BranchPoint, PeriodicMotion, Trajectory, FieldRun or (times, states)
        A Neimark-Sacker point of orbits by any method; a point of a branch of tori; a steady
        quasi-periodic run; with ``second`` also an orbit, as one without the second excitation.
        Of orbits and runs the free parameter begins at their value, if they know it, and at a point
        of a branch of orbits also the parameter of that branch; others have the field's values.
    parameter : str, optional
        The parameter to vary; by default that of the point, or the only one of the field.
    second : str or SecondExcitation, optional
        A second excitation of any frequency: of contact systems 'drive', 'load' or one of their
        signals, such as 'load.forces.0'; all others, and the ground, are the first one.
    method : TorusBalance, optional
        Harmonics and samples; by default those of the point's branch, or 7 and 30.
    options, bounds : ContinuationOptions and (float, float), optional
        Step lengths, tolerances, stopping conditions; range of the parameter in place of theirs.
    scales, width, direction, both
        See :func:`fecontact.bifurcation.orbit_branch`.

    Raises
    ------
    InputError, AnalysisError
        If the start or the excitations do not suit, for elastic Coulomb elements beside other
        internal variables, or if no torus is found near the start.
    """
    require_field(field)
    require_kind("torus_branch", (BranchPoint, PeriodicMotion, Trajectory, FieldRun, tuple),
                 start=start)
    require_kind("torus_branch", (TorusBalance, type(None)), method=method)
    require_kind("torus_branch", (str, SecondExcitation, type(None)), second=second)
    require_direction("torus_branch", direction)
    require_flags("torus_branch", both=both)
    chosen = options_of(options, bounds)
    name = (start.branch.parameter_name if parameter is None and isinstance(start, BranchPoint)
            else field.parameter_or_only(parameter))
    excitation, free = excitation_of(field, second), field.index(name)
    given: Any = scales, width, chosen
    if isinstance(start, BranchPoint) and start.is_torus:
        problem, u, tangent = _from_torus(excitation, start, free, method, given)
        if name == start.branch.parameter_name:
            return _followed(problem, u, float(np.copysign(1.0, direction)) * tangent, chosen, name,
                             1.0, both)
        return _followed(*_converged(problem, u), None, chosen, name, direction, both)
    own = method or TorusBalance()
    if isinstance(start, NeimarkSackerPoint) and second is None:
        if both or name != start.branch.parameter_name:
            raise InputError(f"{start.place} is where tori begin: they are followed over its own "
                             f"parameter, {start.branch.parameter_name!r}, to one side.")
        return _from_neimark_sacker(excitation, start, free, own, given)
    if isinstance(start, BranchPoint) and not start.is_orbit:
        raise InputError(f"{start.place} has no tori to follow: take a point of the kind "
                         f"'Neimark-Sacker', one of a branch of tori, or a run.")
    if isinstance(start, BranchPoint):
        own_name = start.branch.parameter_name
        field = field.with_({own_name: float(start.parameter_values(field)[field.index(own_name)])})
        excitation, start = excitation_of(field, second), start.orbit(field, _SAMPLES)
    motion = as_motion(start)
    if motion.period is not None and second is None:
        raise InputError("torus_branch: a periodic motion starts tori only with a second "
                         "excitation, second=; else give a Neimark-Sacker point or a "
                         "quasi-periodic run.")
    problem, u = _from_motion(excitation, motion, free, own, given)
    problem, u = _converged(problem, u)
    return _followed(problem, u, None, chosen, name, direction, both)


def _layout(field: VectorField) -> Layout:
    """Layout of the states: deflections of elastic Coulomb elements follow from displacements."""
    if not isinstance(field, ContactField):
        return Layout(field.dimension)
    found = layout_of(field)
    return found if slider_counts(field.system()).any() else replace(found, memory=0, nodes=0)


class _Guess(NamedTuple):
    """Coefficients (L, b) of a torus, its frequencies [Hz], and the amplitudes (d,) of its states.

    ``kept`` (c,) are deflections less displacements of elements that never slide.
    """

    X: Array
    frequencies: tuple[float, float]
    amplitudes: Array
    kept: Array | None


def _problem(
    excitation: Excitation, values: Array, free: int, method: TorusBalance, guess: _Guess,
    given: Any,
) -> tuple[TorusProblem, Array]:
    """Problem, and unknowns of a guess."""
    scales, width, options = given
    sizes, limits = sizes_of(scales, guess.amplitudes + 1e-300)
    layout = _layout(excitation.field)
    elements = elements_of(excitation.field, layout)
    if elements is not None and guess.kept is not None:
        elements = replace(elements, kept=replace(elements.kept, offsets=guess.kept))
    problem = TorusProblem(
        excitation, values, free, method.orders, method.counts, guess.X,
        np.concatenate([sizes, guess.frequencies, [width_of(width, options, values[free])]]),
        layout, method.stability, method.tolerance, limits, elements)
    return problem, np.concatenate([
        guess.X.reshape(-1), [guess.frequencies[i] for i in problem.unknown], [values[free]]])


def _kept(field: VectorField, motion: PeriodicMotion) -> Array | None:
    """Deflections that elements have which never slide, less their displacements."""
    elements = elements_of(field, _layout(field))
    return None if elements is None else elements.kept.left_by(motion.states).offsets


def _of_orbit(layout: Layout, motion: PeriodicMotion, orders: tuple[int, int]) -> Array:
    """Coefficients (L, b) of a periodic motion as a torus."""
    c = motion.harmonics(min(orders[0], max((len(motion.times) - 3) // 2, 0)))[:, layout.columns]
    return with_orders(real_coefficients(c), (len(c) - 1, 0), orders)


def _from_neimark_sacker(
    excitation: Excitation, point: NeimarkSackerPoint, free: int, method: TorusBalance, given: Any
) -> Branch:
    """Tori along the eigenfunction of the critical multipliers."""
    field, options = excitation.field, given[2]
    motion = point.orbit(field, _SAMPLES)
    assert motion.period is not None
    excitation = replace(excitation, periods=motion.periods)
    X = _of_orbit(_layout(field), motion, method.orders)
    frequencies = (1.0 / motion.period, point.angle / (2.0 * np.pi * motion.period))
    values = point.parameter_values(field)
    guess = _Guess(X, frequencies, motion.amplitudes, _kept(field, motion))
    problem, u = _problem(excitation, values, free, method, guess, given)
    leaving = np.zeros_like(X)
    rows = np.arange(2 * method.orders[0] + 1, 6 * method.orders[0] + 3)
    matrix = problem.linearise(u).matrix[rows][:, :, rows]
    n = matrix.shape[0] * matrix.shape[1]
    sizes = np.tile(problem.sizes, len(rows))
    square = matrix.reshape(n, n) * sizes
    square /= np.abs(square).max(axis=1)[:, None]
    leaving[rows] = (sizes * np.linalg.svd(square)[2][-1]).reshape(len(rows), -1)
    tangent = np.append(leaving, np.zeros(problem.common))
    tangent /= np.sqrt(problem.weights() @ tangent**2)

    def go(part: float) -> Branch:
        step = min(max(part * options.step, options.smallest_step), options.largest_step)
        beside = u + step * tangent
        return _followed(replace(problem, reference=problem.coefficients(beside).copy()),
                         beside, tangent, replace(options, step=step),
                         point.branch.parameter_name, 1.0, False)

    return first_that_goes(_FIRST_STEPS, go)


def _from_motion(
    excitation: Excitation, motion: PeriodicMotion, free: int, method: TorusBalance, given: Any
) -> tuple[TorusProblem, Array]:
    """Problem and first guess from an orbit, or from a run."""
    field, layout = excitation.field, _layout(excitation.field)
    values = values_of(motion, field, free, given[2])
    if motion.period is not None:
        excitation = replace(excitation, periods=motion.periods)
    known = excitation.frequencies(values)
    if motion.states.shape[1] != field.dimension:
        raise InputError(f"torus_branch: the motion has {motion.states.shape[1]} states, but the "
                         f"field {field.dimension}.")
    if motion.period is not None:
        X = _of_orbit(layout, motion, method.orders)
        assert known[0] is not None
        assert known[1] is not None
        frequencies = known[0], known[1]
    else:
        fit, frequencies, orders = fitted(motion.times, motion.states[:, layout.columns], known,
                                          method.orders)
        X = with_orders(fit, orders, method.orders)
    guess = _Guess(X, frequencies, motion.amplitudes, _kept(field, motion))
    return _problem(excitation, values, free, method, guess, given)


def _from_torus(
    excitation: Excitation, point: BranchPoint, free: int, method: TorusBalance | None, given: Any
) -> tuple[TorusProblem, Array, Array]:
    """Problem, unknowns and tangent of a point of a branch of tori, on other harmonics perhaps."""
    known, motion = point.branch.attributes, torus_motion(point)
    excitation = replace(excitation, periods=int(known["periods"]))
    H1, H2 = map(int, known["torus_harmonics"])
    N1, N2 = map(int, known["torus_samples"])
    own = method or TorusBalance((H1, H2), (N1, N2), bool(known["torus_multipliers"]),
                                 float(known["tolerance"]))
    values, layout = point.parameter_values(excitation.field), _layout(excitation.field)
    L, n = len(motion.coefficients), len(motion.coefficients) * layout.harmonic
    X, along = (with_orders(vector[:n].reshape(L, -1), motion.harmonics, own.orders)
                for vector in (point.u, point.tangent))
    scales = np.asarray(known["scales"], dtype=float)
    frequencies = float(motion.frequencies[0]), float(motion.frequencies[1])
    guess = _Guess(X, frequencies, scales[: layout.states], known.get("kept_deflections"))
    problem, u = _problem(excitation, values, free, own, guess,
                          (given[0], given[1] or float(scales[-1]), given[2]))
    tangent = np.append(along, point.tangent[n:])
    return problem, u, tangent / np.sqrt(problem.weights() @ tangent**2)


def _converged(problem: TorusProblem, u: Array) -> tuple[TorusProblem, Array]:
    """The torus near u at fixed parameter, by Newton's method with shortened steps.

    Raises
    ------
    AnalysisError
        If it does not converge, or to an orbit.
    """
    u, _, converged = damped_newton(problem, u, unit(len(u)), _TOLERANCE, _CORRECTIONS)
    X = problem.coefficients(u) / problem.sizes
    torus = replace(problem, reference=problem.coefficients(u).copy())
    orbit = problem.unknown and np.abs(turned(X, torus.thinnest)).max() < _ORBIT * np.abs(X).max()
    if not converged or orbit:
        name, end = list(problem.field.parameters)[problem.free], "a periodic orbit"
        raise AnalysisError(f"No torus was found at {name} = {u[-1]:.6g}: Newton's method "
                            f"{f'ends at {end}' if converged else 'does not converge'}; start from "
                            f"a steady quasi-periodic run, or take other harmonics.")
    return torus, u


def _followed(
    problem: TorusProblem, u: Array, tangent: Array | None, options: ContinuationOptions,
    name: str, direction: float, both: bool,
) -> Branch:
    attributes: dict[str, Any] = {
        **attributes_of(problem.field, problem.values), "scales": problem.scales,
        "torus_harmonics": np.array(problem.orders), "torus_samples": np.array(problem.samples),
        "torus_multipliers": int(problem.multipliers), "tolerance": problem.tolerance,
        "torus_displacements": problem.layout.displacements, "periods": problem.excitation.periods}
    if problem.elements is not None:
        attributes |= {"torus_memory": problem.layout.memory,
                       "kept_deflections": problem.elements.kept.offsets}
    return continue_branch(problem, u, options, name=name, tangent=tangent, direction=direction,
                           both=both, attributes=attributes)
