"""Nonlinear modes by shooting: periodic motions under negative damping from runs."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import continue_branch
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.estimates import observed_values
from fecontact.bifurcation.harmonic.layout import Layout
from fecontact.bifurcation.harmonic.series import real_coefficients
from fecontact.bifurcation.nonlinear_modes.linear_start import XI, LinearStart
from fecontact.bifurcation.nonlinear_modes.mode_problem import (
    AlongMode,
    known_stability,
    mean_square_velocity,
)
from fecontact.bifurcation.orbit_methods import Shooting
from fecontact.bifurcation.orbits.shooting import ShootingProblem
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ComplexArray

# Harmonics of what is observed, from the samples of the runs.
_HARMONICS = 63


@dataclass(frozen=True, eq=False)
class ShootingMode(AlongMode, ShootingProblem):
    """Orbits of an autonomous system over xi, with what is observed of them.

    Multipliers are stored of conservative motions alone; none makes a special point.

    Attributes
    ----------
    row : (d,) array
        Row of the observed displacement.
    conservative : bool
        Whether xi is zero within rounding where the mode begins.
    """

    row: Array = field(default_factory=lambda: np.zeros(0))
    conservative: bool = False

    ends: ClassVar[Mapping[str, BranchStatus]] = {}

    def point(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, Any]:
        """Period, velocities, extremes, and what is observed; stability where nothing is lost."""
        found = super().point(u, linearisation, tangent)
        T, d = self.period(u), self.field.dimension
        samples = linearisation.paths[:, :-1].reshape(-1, d)
        m = d // 2
        H = min(_HARMONICS, len(samples) // 2 - 1)
        waves = 2.0 / len(samples) * np.fft.rfft(samples[:, :m], axis=0)[: H + 1]
        waves[0] *= 0.5
        layout, X = Layout(d, m), real_coefficients(waves)
        return {**{name: found[name] for name in ("mesh", "minimum", "maximum")},
                **(known_stability(found, 1) if self.conservative else {}), "period": T,
                "mean_square_velocity": mean_square_velocity(layout, X, T),
                **observed_values(layout, X, T, self.row)}

    def tests(self, u: Array, linearisation: Any, tangent: Array) -> dict[str, float]:
        """None."""
        return {}

    def ended(self, u: Array, linearisation: Any, tangent: Array) -> BranchStatus | None:
        """None: a mode ends at its amplitudes."""
        return None


def leaving_by_shooting(
    start: LinearStart, shape: ComplexArray, scales: Array, row: Array, method: Shooting
) -> tuple[ShootingMode, Array, Array]:
    """Problem, unknowns and direction of the linear mode of a shape (d,), at its amplitude.

    ``scales`` (d + 2,) are those of the states, the period and xi.

    Raises
    ------
    InputError
        For a user's field, friction with memory, rigid motions, or a set-valued solver.
    """
    known = start.field
    if not isinstance(known, ContactField):
        raise InputError("nonlinear_mode: shooting is for contact systems; take HarmonicBalance() "
                         "for a vector field.")
    if known.dimension > 2 * start.displacements:
        raise InputError("nonlinear_mode: friction with memory sticks at any deflection, so that "
                         "its runs have no isolated periodic motion; take HarmonicBalance().")
    if len(start.loose):
        raise InputError("nonlinear_mode: nothing holds a rigid motion of the system, so that its "
                         "runs have no isolated periodic motion; take HarmonicBalance().")
    if not method.solver.smooth:
        raise InputError("nonlinear_mode: Shooting(solver=SetValued()) has no modes; take a "
                         "smoothed law and Auto().")
    mesh = np.linspace(0.0, 1.0, method.segments + 1)
    waves = (np.exp(2.0j * np.pi * mesh[:-1])[:, None] * shape).real
    first = start.state + waves
    problem = ShootingMode(
        known, start.values, start.free, mesh, first[0].copy(), scales, rtol=method.rtol,
        derivative_rtol=method.derivative_rtol, solver=method.solver,
        limits=np.full(known.dimension, np.inf), row=row, conservative=start.lossless)
    u = np.concatenate([first.reshape(-1), [2.0 * np.pi / start.angular_frequency, start.xi]])
    leaving = np.append(waves.reshape(-1), [0.0, 0.0])
    return problem, u, leaving / np.sqrt(problem.weights() @ leaving**2)


def followed_by_shooting(
    start: LinearStart, begin: tuple[ShootingMode, Array, Array], method: Shooting,
    options: ContinuationOptions,
) -> Branch:
    """The branch of a mode from its start."""
    problem, u, leaving = begin
    return continue_branch(
        problem, u, options, name=XI, tangent=leaving,
        attributes=problem.attributes() | {"conservative": problem.conservative})
