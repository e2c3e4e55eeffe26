"""Options of the methods that follow periodic orbits."""

from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.orbits.mesh import require_mesh, require_segments
from fecontact.core.checks import require_rtol
from fecontact.core.errors import InputError, require_positive
from fecontact.integrate.solvers import AUTO, Solver, require_solver


@dataclass(frozen=True)
class Collocation:
    """Orthogonal collocation at Gauss points on an adaptive mesh, for any vector field.

    Parameters
    ----------
    intervals : int
        Least number of mesh intervals, at least 2. A smaller ``most_intervals`` is raised to it.
    degree : int
        Degree of the polynomial on each interval, 2 to 7.
    tolerance : float
        Largest error of the parameter of special points, in widths of the diagram: each is located
        again on twice the intervals until its ``parameter_error`` is smaller, up to
        ``most_intervals``.
    most_intervals : int
        Largest number of intervals of a point. The checks of a special point may use more: twice
        its intervals, for a coefficient up to 16 times ``intervals``.
    state_tolerance : float, optional
        Largest error 'state_error' of the states of an orbit, relative to their ranges. Above it a
        point is computed again on more intervals; below a tenth of it their number falls again.
        None keeps ``intervals``. The last Newton step is at most a hundredth of it.

    Raises
    ------
    InputError
        If these cannot be used.
    """

    intervals: int = 50
    degree: int = 4
    tolerance: float = 1e-7
    most_intervals: int = 800
    state_tolerance: float | None = 1e-5

    solver: ClassVar[Solver] = AUTO
    repeats: ClassVar[None] = None

    def __post_init__(self) -> None:
        require_mesh(self.intervals, self.degree)
        require_positive("Collocation", tolerance=self.tolerance)
        if not (isinstance(self.most_intervals, int | np.integer) and self.most_intervals >= 2):
            raise InputError(f"Collocation: most_intervals = {self.most_intervals!r} must be a "
                             f"whole number of at least 2.")
        object.__setattr__(self, "most_intervals", max(self.intervals, self.most_intervals))
        if self.state_tolerance is not None:
            require_positive("Collocation", state_tolerance=self.state_tolerance)


@dataclass(frozen=True)
class Shooting:
    """Multiple shooting with the compiled integrator, for contact systems only.

    Suited to steep friction, impacts and many states, where collocation needs many intervals.
    Extremes are those of samples. ``with_normal_form`` computes normal forms, except of set-valued
    orbits.

    Parameters
    ----------
    segments : int
        Number of segments of the period, integrated separately; use more for unstable orbits.
    rtol : float
        Relative tolerance of the runs.
    derivative_rtol : float, optional
        Relative tolerance of the derivatives, as for :func:`fecontact.sensitivity`. With many
        fast modes that the motion hardly excites, 1e-2 saves most of the time and affects only
        their small multipliers; with impacts it makes all multipliers inaccurate.
    solver : Auto, Rodas5P, Radau or SetValued
        Solver of the segments. SetValued is for friction without smoothing and starts from a motion
        of the same solver. Its orbits are split at their events in place of ``segments``; if this
        is not possible (docs/set-valued.md), derivatives are differences of runs.

    Raises
    ------
    InputError
        If these cannot be used.
    """

    segments: int = 4
    rtol: float = 1e-9
    derivative_rtol: float | None = None
    solver: Solver = AUTO

    repeats: ClassVar[None] = None

    def __post_init__(self) -> None:
        require_segments(self.segments)
        require_solver(self.solver, "derivatives")
        require_rtol(self.rtol, "Shooting: rtol")
        if self.derivative_rtol is not None:
            require_positive("Shooting", derivative_rtol=self.derivative_rtol)


Method: TypeAlias = Collocation | Shooting | HarmonicBalance
