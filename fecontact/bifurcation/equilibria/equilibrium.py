"""Equilibria of vector fields and contact systems, their stability and modes."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.checks import as_floats, require_kind, require_state
from fecontact.core.errors import AnalysisError, InputError, require_positive
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.core.units import Summarised
from fecontact.system.complex_modes import ComplexModes, sorted_eigenvalues, unstable_count
from fecontact.system.fields.vector_field import VectorField, parameters_listed, require_field

_RESIDUAL = 1e-8


def solution(matrix: Array, rhs: Array) -> Array:
    """Solution (n,) of ``matrix x = rhs``; the shortest one of a singular system that has some.

    Raises
    ------
    AnalysisError
        If the system is singular and has none.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, rhs))
    except np.linalg.LinAlgError:
        x = np.linalg.lstsq(matrix, rhs, rcond=None)[0]
    left = np.abs(matrix @ x - rhs)
    if (left > _RESIDUAL * (np.abs(matrix) @ np.abs(x) + np.abs(rhs))).any():
        raise AnalysisError("The equations are singular and have no solution there: nothing "
                            "holds the solution in some direction.")
    return np.asarray(x)


@dataclass(frozen=True, eq=False)
class DenseEquations:
    """Equations about some unknowns: the residual (N,) and its derivative (N, N + 1).

    The first rows and columns of the latter are the Jacobian of ``states`` states. ``made`` are
    intermediate results.
    """

    residual: Array
    matrix: Array
    states: int
    made: dict[str, Any] = dataclasses.field(default_factory=dict)

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution (N + 1,) of ``[[matrix], [row]] x = rhs``."""
        return solution(np.vstack([self.matrix, row]), rhs)

    @property
    def jacobian(self) -> Array:
        """Derivative of the rates to the states."""
        return self.matrix[: self.states, : self.states]

    @cached_property
    def eigenvalues(self) -> ComplexArray:
        """Eigenvalues of the Jacobian, the largest real part first."""
        return sorted_eigenvalues(self.jacobian)


_ITERATIONS = 60
# Rates, in the sizes of the terms of which they are the sum, that are rounding.
_AT_REST = 1e-13
# Differences for the slopes of eigenvalues: step relative to the parameter, weights by place.
_SLOPE_STEP = 1e-4
_DIFFERENCES = (
    {-2: 1.0 / 12.0, -1: -2.0 / 3.0, 1: 2.0 / 3.0, 2: -1.0 / 12.0},
    {0: -25.0 / 12.0, 1: 4.0, 2: -3.0, 3: 4.0 / 3.0, 4: -0.25},
    {0: 25.0 / 12.0, -1: -4.0, -2: 3.0, -3: -4.0 / 3.0, -4: 0.25},
)


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(Summarised):
    """An equilibrium, and the linear motion about it.

    Attributes
    ----------
    field : VectorField
    values : (k,) array
        Parameter values.
    state : (d,) array
        x with f(x, p) = 0; for contact systems steady sliding.
    """

    field: VectorField
    values: Array
    state: Array

    @cached_property
    def jacobian(self) -> Array:
        """Derivative df/dx (d, d)."""
        return self.field.derivatives(np.zeros(1), self.state[None], self.values)[1][0]

    @cached_property
    def eigenvalues(self) -> ComplexArray:
        """Eigenvalues (d,) [1/s], the largest real part first."""
        return sorted_eigenvalues(self.jacobian)

    @property
    def stable(self) -> bool:
        """Whether no eigenvalue has a positive real part."""
        return self.unstable_directions == 0

    @property
    def unstable_directions(self) -> int:
        """Number of eigenvalues with positive real parts; see :func:`unstable_count`."""
        return int(unstable_count(self.eigenvalues))

    @cached_property
    def modes(self) -> ComplexModes:
        """Frequencies, damping ratios and eigenvectors of the linear motion."""
        return ComplexModes.of(self.jacobian)

    def summary(self) -> list[tuple[str, str]]:
        """Parameters, stability, and the eigenvalue of the largest real part."""
        largest = self.eigenvalues[0]
        turning = f" at {abs(largest.imag) / (2.0 * np.pi):.4g} Hz" if largest.imag else ""
        return [("parameters", parameters_listed(self.field, self.values)),
                ("stable", "yes" if self.stable else "no"),
                ("largest growth rate", f"{largest.real:.4g} 1/s{turning}")]

    def eigenvalue_slopes(self, parameter: str) -> ComplexArray:
        """Derivatives (r,) of the eigenvalues of :attr:`modes` to a parameter.

        The equilibrium moves with the parameter: ``s^T (dA/dp) r`` with the left and
        right eigenvectors s, r and the change of the Jacobian A along the equilibria, by
        differences of fourth order.

        Raises
        ------
        InputError
            If the field has no such parameter.
        AnalysisError
            If the equilibrium cannot be continued, as at a fold.
        """
        field, t = self.field, np.zeros(1)
        index = field.index(parameter)
        P = field.derivatives(t, self.state[None], self.values, (index,))[2][0, :, 0]
        moving = solution(self.jacobian, -P)
        step = _SLOPE_STEP * (abs(float(self.values[index])) or 1.0)

        def jacobian(place: int) -> Array:
            values = self.values.copy()
            values[index] += place * step
            state = self.state + place * step * moving
            return field.derivatives(t, state[None], values)[1][0]

        # One-sided where the other side is out of the parameter's range.
        for weights in _DIFFERENCES:
            try:
                change = sum(weight * jacobian(place) for place, weight in weights.items())
            except InputError:
                if weights is _DIFFERENCES[-1]:
                    raise
                continue
            break
        return self.modes.sensitivity(np.asarray(change) / step)


@one_blas_thread
def find_equilibrium(
    field: VectorField,
    parameters: Mapping[str, float] | None = None,
    *,
    start: ArrayLike | None = None,
    tolerance: float = 1e-12,
) -> Equilibrium:
    """An equilibrium f(x, p) = 0 by damped Newton's method.

    Parameters
    ----------
    field : VectorField
        Its rates must not depend on time.
    parameters : mapping, optional
        Values that differ from the field's base values, by name.
    start : (d,) sequence, optional
        Where to begin; for contact systems that of
        steady sliding (:func:`fecontact.equilibrium`) by default, else zero.
    tolerance : float
        Size of the last Newton step, relative to the state.

    Raises
    ------
    AnalysisError
        If the field depends on time, or none is found; the message says where it got stuck.
    InputError
        If a parameter is unknown or out of range, or the start has other than d finite values.
    """
    require_field(field)
    require_kind("find_equilibrium", (Mapping, type(None)), parameters=parameters)
    require_positive("find_equilibrium", tolerance=tolerance)
    values = field.values_with(**dict(parameters or {}))
    require_autonomous(field, values)
    if start is None:
        start = steady_sliding(field, values) if isinstance(field, ContactField) else np.zeros(
            field.dimension)
    x = np.array(as_floats(start, "The start of an equilibrium"))
    if x.shape != (field.dimension,):
        raise InputError(f"The start of an equilibrium must have {field.dimension} values, not "
                         f"shape {x.shape}.")
    require_state(x)
    found = newton(field, x, values, tolerance)
    if found is None:
        rate = np.abs(field.rates(np.zeros(1), x[None], values)).max()
        raise AnalysisError(f"No equilibrium was found for {parameters_listed(field, values)} from "
                            f"the given start, where the largest rate is {rate:.3g}; give a start "
                            f"that is nearer, for example from a run that comes to rest, or follow "
                            f"one from other parameters.")
    return Equilibrium(field, values, found[0])


def newton(
    field: VectorField, start: Array, values: Array, tolerance: float
) -> tuple[Array, Array] | None:
    """Damped Newton's method: halve each step until the next one is shorter.

    Gives x (d,) and the Jacobian (d, d) before the last step.
    """
    x, t = start, np.zeros(1)
    least = 1e-14 * float(np.linalg.norm(field.state_scales(values)))
    for _ in range(_ITERATIONS):
        f, J, _ = field.derivatives(t, x[None], values)
        try:
            step = solution(J[0], -f[0])
        except AnalysisError:
            # Bristles may approach their limit algebraically, with no linear rate.
            rests = (np.abs(f[0]) <= _AT_REST * np.abs(J[0]) @ np.abs(x)).all()
            return (x, J[0]) if rests else None
        size = float(np.linalg.norm(step))
        if not np.isfinite(size):
            return None
        if size <= max(tolerance * float(np.linalg.norm(x)), least):
            return x + step, J[0]
        part = 1.0
        while part > 1e-6:
            trial = x + part * step
            # Natural monotonicity test: the next step with the old Jacobian.
            ahead = field.rates(t, trial[None], values)[0]
            if np.isfinite(ahead).all() and _simplified(J[0], ahead) < (1.0 - 0.5 * part) * size:
                break
            part *= 0.5
        else:
            # The rates are as small as rounding allows.
            return (x, J[0]) if size <= 1e-7 * np.linalg.norm(x) else None
        x = trial
    return None


def _simplified(J: Array, f: Array) -> float:
    try:
        return float(np.linalg.norm(solution(J, f)))
    except AnalysisError:
        return np.inf


def steady_sliding(field: ContactField, values: Array) -> Array:
    """State [q, 0, z] of steady sliding of a contact system, to start Newton's method."""
    from fecontact.system.statics.equilibrium import equilibrium_state

    return equilibrium_state(field.system(values), "sliding", 0.0)


def require_autonomous(field: VectorField, values: Array) -> None:
    """Raise AnalysisError where the rates depend on time."""
    period = field.forcing_period(values)
    if period is not None:
        raise AnalysisError(f"The system is driven with the period {period:.6g} s and has no "
                            f"equilibrium; take the drive's amplitude and the ground's waviness "
                            f"away (drive.amplitude_x = 0, ground.amplitude = 0), or look for "
                            f"periodic orbits.")


def default_scales(begin: Equilibrium) -> Array:
    """Sizes (d,) of the states, for arclengths and differences.

    The sizes of the field; for contact systems the largest displacement, and for velocities that
    times the frequency of the least damped mode.
    """
    field = begin.field
    if not isinstance(field, ContactField):
        return field.state_scales(begin.values)
    system = field.system(begin.values)
    m = system.basis.modes
    displacement = float(np.abs(begin.state[:m]).max()) or 1.0
    modes = begin.modes
    w = (float(np.abs(modes.eigenvalues[np.argmin(modes.damping_ratios)]))
         if len(modes.eigenvalues) else 1.0)
    return np.concatenate([np.full(m, displacement), np.full(m, w * displacement),
                           system.memory_scales])
