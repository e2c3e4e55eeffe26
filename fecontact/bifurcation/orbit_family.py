"""Families of periodic orbits of conservative systems."""

from dataclasses import dataclass, fields, replace
from functools import cache, cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.attempts import first_that_goes
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.inner_product import unit
from fecontact.bifurcation.continuation.points import HopfPoint
from fecontact.bifurcation.continuation.problem import (
    ContinuationOptions,
    options_of,
    require_direction,
    sizes_of,
)
from fecontact.bifurcation.continuation.rounding import Rounding
from fecontact.bifurcation.orbit_methods import Collocation, Method
from fecontact.bifurcation.orbits import starts
from fecontact.bifurcation.orbits.branches import as_motion, values_of
from fecontact.bifurcation.orbits.discretisations import DISCRETISATIONS, discretisation_by
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.bifurcation.orbits.multiplier_rounding import MultiplierRounding
from fecontact.bifurcation.orbits.same_orbit import VANISHING
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.integrate.field_runs.field_run import FieldRun
from fecontact.integrate.trajectory import Trajectory
from fecontact.system.fields.vector_field import VectorField, require_field

# Change of the unfolding parameter that rounding and discretisation may make.
_STAYS = 1e-6
# Part of a step to which special points are located, and tolerance of Newton's method, which the
# unfolding parameter shows.
_PRECISION, _TOLERANCE = 1e-9, 1e-11
# Distance of a multiplier from the unit circle beyond which a perturbation grows; beyond the first
# of the others it may, beyond the second it must. Where two meet, they are known to the
# square root of rounding only.
_GROWS, _MAY, _MUST = 1e-6, 1e-9, 1e-4


class _FamilyRounding(MultiplierRounding):
    """No folds; multipliers that meet are known to the square root of rounding only."""

    def unstable(self, linearisation: Any, values: Any) -> tuple[int, int]:
        """Least and largest number of growing perturbations."""
        multipliers = values["multipliers"]
        return _beyond(multipliers, _MUST), _beyond(multipliers, _MAY)

    def kinds(self, tangents: Any, values: Any, tests: Any) -> set[str]:
        """A fold, wherever the unfolding parameter turns."""
        return {"fold"}


class _FamilyTests:
    """Orbits of a conservative system: two multipliers are one, the others come in pairs mu, 1/mu.

    A pair leaves the unit circle at -1, where orbits of twice the period begin, or at 1, at a
    branch point of families. Turns of the unfolding parameter, and pairs on the circle, are no
    special points.
    """

    confirms: ClassVar[frozenset[str]] = frozenset()

    @cached_property
    def rounding(self) -> Rounding:
        """No folds; small Newton steps are rounding as for other orbits."""
        known = super().rounding  # type: ignore[misc]
        return _FamilyRounding(known.width, known.steps)

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """As of other orbits; unstable are those of which a perturbation grows exponentially."""
        found: dict[str, Any] = dict(super().point(  # type: ignore[misc]
            u, linearisation, tangent))
        unstable = _beyond(found["multipliers"], _GROWS)
        return found | {"unstable": unstable, "stable": unstable == 0}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """Functions that change sign where a pair meets at -1, and at 1."""
        others = _others(linearisation.floquet.multipliers)
        size = 1.0 + np.abs(others)
        return {"period doubling": float(np.prod((others + 1.0) / size).real),
                "branch point": float(np.prod((others - 1.0) / size).real),
                **{name: value for name, value in super().tests(  # type: ignore[misc]
                    u, linearisation, tangent).items() if name == VANISHING}}

    def examine(
        self, kind: str, u: Array, linearisation: Any, tangent: Array
    ) -> dict[str, Any] | None:
        """No data: test functions alone decide on special points."""
        return {}


@cache
def _family_of(kind: Any) -> type[Any]:
    """The problem of families for a kind of problems of orbits."""
    made: type[Any] = type(f"Family{kind.__name__}", (_FamilyTests, kind), {})
    return dataclass(frozen=True, eq=False)(made)


def _others(multipliers: ComplexArray) -> ComplexArray:
    """The multipliers except the two that are one."""
    return multipliers[np.argsort(np.abs(multipliers - 1.0))[2:]]


def _beyond(multipliers: ComplexArray, distance: float) -> int:
    return int(np.count_nonzero(np.abs(_others(multipliers)) > 1.0 + distance))


@one_blas_thread
def orbit_family(
    field: VectorField,
    start: HopfPoint | PeriodicMotion | Trajectory | FieldRun | tuple[ArrayLike, ArrayLike],
    unfolding: str | None = None,
    *,
    method: Method | None = None,
    options: ContinuationOptions | None = None,
    bounds: tuple[float, float] | None = None,
    scales: ArrayLike | None = None,
    direction: float = 1.0,
    both: bool = False,
) -> Branch:
    r"""Follow the periodic orbits of a conservative system at fixed parameters.

    A first integral leaves a family of orbits, and no equation for each. The unfolding parameter
    lambda, such as a damping, is free in place of one: in

    .. math::

        \dot x = f(x) + \lambda g(x), \qquad \oint \nabla H \cdot g \, dt \ne 0

    there are periodic orbits for lambda = 0 alone, where it stays along the branch to rounding.
    Special points are 'period doubling' and 'branch point'; an orbit is 'stable' if no perturbation
    grows exponentially.

    Parameters
    ----------
    field : VectorField
        Does not depend on time.
    start : HopfPoint, PeriodicMotion, Trajectory, FieldRun or (times, states)
        The orbit of this size is the first; at a Hopf point over lambda the smallest one.
    unfolding : str, optional
        Name of lambda; by default the only parameter of the field.
    method, options, scales
        As for :func:`fecontact.bifurcation.orbit_branch`; collocation finds the first orbit.
    bounds : (float, float), optional
        Of the period [s].
    direction, both : float, bool
        Above zero towards larger orbits, else towards smaller ones; or both ways, from a motion.

    Raises
    ------
    InputError, AnalysisError
        If lambda does not stay, and as :func:`fecontact.bifurcation.orbit_branch`.

    References
    ----------
    F. J. Munoz-Almaraz et al., Continuation of periodic orbits in conservative and Hamiltonian
    systems, Physica D 181 (2003) 1.
    """
    require_field(field)
    require_kind("orbit_family", (HopfPoint, PeriodicMotion, Trajectory, FieldRun, tuple),
                 start=start)
    require_kind("orbit_family", (*(one.options for one in DISCRETISATIONS), type(None)),
                 method=method)
    how = method or Collocation()
    by = discretisation_by(how)
    by.require_family(how, field)
    require_direction("orbit_family", direction)
    free = field.index(field.parameter_or_only(unfolding))
    if field.forcing_period(field.values) is not None:
        raise InputError("orbit_family: the field depends on time, and so has no families of "
                         "orbits; follow its orbits with orbit_branch.")
    chosen = options_of(options, bounds)
    chosen = replace(chosen, bounds=(-np.inf, np.inf), second_bounds=chosen.bounds,
                     tolerance=min(chosen.tolerance, _TOLERANCE))
    if isinstance(start, HopfPoint):
        if both or field.index(start.branch.parameter_name) != free:
            raise InputError(f"{start.place} has a family to one side, over "
                             f"{start.branch.parameter_name!r}; leave out both, and name that "
                             f"parameter.")
        begun = starts.at_hopf(field, start, *by.mesh(how), chosen, scales, 1.0)
        return _stays(field, free, first_that_goes(
            begun, lambda found: _followed(found[0], chosen, how, found[1])))
    motion = as_motion(start)
    values = values_of(motion, field, free, chosen)
    sizes, limits = sizes_of(scales, motion.amplitudes + 1e-300)
    given = starts.MotionStart(field, values, free, replace(motion, periods=1),
                               np.append(sizes, 1.0))
    intervals, degree = by.mesh(how)
    problem, u = starts.corrected_samples(
        lambda intervals: given.on_mesh(intervals, degree), intervals, family=True)
    low, high = chosen.second_bounds
    if not low <= problem.period(u) <= high:
        raise InputError(f"The start has the period {problem.period(u):.6g} s, outside the bounds "
                         f"{low:g} to {high:g} s.")
    tangent = problem.linearise(u).solve(starts.size_row(problem, u), unit(len(u)))
    tangent = np.copysign(1.0, direction) * tangent / np.sqrt(problem.weights() @ tangent**2)
    return _stays(field, free, _followed((problem, u, tangent), chosen, how, limits, both))


def _followed(
    start: starts.Start, options: ContinuationOptions, method: Method, limits: Array | None,
    both: bool = False,
) -> Branch:
    """Follow a family from a start on a mesh."""
    problem, u, tangent = discretisation_by(method).projected(start, method, limits)
    kept = {entry.name: getattr(problem, entry.name) for entry in fields(problem)}
    if "precision" in kept:
        kept["precision"] = _PRECISION
    kind: Any = type(problem)
    family = _family_of(kind)(**kept)
    return continue_branch(family, u, options, name=problem.parameter_name, tangent=tangent,
                           both=both,
                           attributes=problem.attributes() | {"family": True})


def _stays(field: VectorField, free: int, family: Branch) -> Branch:
    """The family; InputError unless its parameter stayed where it was."""
    moved = float(np.ptp(family.parameter))
    if moved > _STAYS * (1.0 + abs(float(family.parameter[0]))):
        name = list(field.parameters)[free]
        raise InputError(f"The orbits are no family at one value of {name!r}, which moves by "
                         f"{moved:.3g} along them: the field is not conservative; follow them "
                         f"with orbit_branch.")
    return family
