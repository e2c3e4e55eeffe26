"""Curves of resonances over a parameter: backbones over the force, peaks over a normal load."""

from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, Literal

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import ContinuationOptions, options_of
from fecontact.bifurcation.continuation.pseudo_arclength import inside
from fecontact.bifurcation.fields.contact_field import ContactField, contact_field
from fecontact.bifurcation.fields.observed_row import observed_row
from fecontact.bifurcation.harmonic.forced_starts import Forced, given_force, rest_state
from fecontact.bifurcation.harmonic.layout import layout_of
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.harmonic.response import (
    RESPONSES,
    branch_of_response,
    observed_amplitudes,
    preloaded,
)
from fecontact.bifurcation.nonlinear_modes.peak_problem import PeakProblem, followed, problem_at
from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError, require_choice
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.core.units import Summarised, listed, span
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import RestState

# Points at most and largest step, unless options say so.
_POINTS, _LARGEST = 400, 0.05
# Distance along the response of the orbits whose amplitudes are compared, with memory, and least
# number of samples by which they differ in phase.
_WINDOW, _SAMPLES = 0.05, 4
_CONDITIONS = ("amplitude", "phase")


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ResonanceCurve(Summarised):
    """Resonances of forced responses over a parameter.

    Points of the branch store 'frequency_hz', 'stable', 'amplitude_rate' (relative change of
    the amplitude along the curve) and what a :class:`~fecontact.bifurcation.FrequencyResponse`
    stores. Points of kind 'extremum' are those of the amplitude over the parameter, 'fold' those
    where the parameter turns.

    Attributes
    ----------
    branch : Branch
        The resonances, in their order.
    observed : str
        Name of the observed displacement, such as 'B x'.
    condition : str
        'amplitude' or 'phase'.
    """

    branch: Branch
    observed: str
    condition: str

    def __len__(self) -> int:
        return len(self.branch)

    @property
    def parameter_name(self) -> str:
        """Name of the parameter."""
        return self.branch.parameter_name

    @property
    def parameter(self) -> Array:
        """Values (N,) of the parameter."""
        return self.branch.parameter

    @property
    def amplitude(self) -> Array:
        """Half the range (N,) of the observed displacement at resonance."""
        return np.asarray(self.branch.column("observed_amplitude"))

    @property
    def frequency_hz(self) -> Array:
        """Frequency (N,) of the resonance [Hz]."""
        return np.asarray(self.branch.column("frequency_hz"))

    def harmonic(self, k: int = 1) -> ComplexArray:
        """Complex harmonic X_k (N,) of the observed displacement, x_k = Re(X_k exp(i k w t))."""
        return np.asarray(self.branch.column("observed_harmonics")[:, k])

    def optimum(self) -> BranchPoint:
        """The point of smallest amplitude, such as the optimum of a damper."""
        return self.branch.points[int(np.argmin(self.amplitude))]

    def summary(self) -> list[tuple[str, str]]:
        """Parameter, amplitudes and frequencies, special points, and how the curve ended."""
        special = [f"{point.kind} at {point.parameter:.5g}" for point in self.branch.special]
        return [("parameter", self.parameter_name), ("range", span(self.parameter)),
                ("observed", self.observed), ("condition", self.condition),
                ("amplitude", span(self.amplitude)), ("frequency", span(self.frequency_hz, "Hz")),
                ("points", f"{len(self)}"), ("special", listed(special, 5)),
                ("end", self.branch.status.name.lower())]


@one_blas_thread
def resonance_curve(
    system: ContactSystem | VectorField, bounds: tuple[float, float], parameter: str,
    frequencies: tuple[float, float], *, frequency: str = "drive.frequency_hz",
    observe: tuple[str | int, str] | ArrayLike = ("B", "x"),
    condition: Literal["amplitude", "phase"] = "amplitude", lag: float = 0.5 * np.pi,
    method: HarmonicBalance | None = None, options: ContinuationOptions | None = None,
    start: float | None = None, preload: LoadHistory | RestState | Array | None = None,
) -> ResonanceCurve:
    """The peak of the frequency response over a parameter, by harmonic balance.

    Over the level of a force it is a resonance backbone; over the normal load of a friction damper
    it shows the optimum. The peak at the start is that of a frequency response; from there the
    condition of the peak is solved with the orbit. Folds are followed around.

    Parameters
    ----------
    system : ContactSystem or VectorField
        Excited with a common period.
    bounds : (float, float)
        Range of the parameter.
    parameter : str
        Dotted name, such as 'drive.amplitude_x' or 'normal.force'.
    frequencies : (float, float)
        Range of the frequency in which the first peak lies [Hz].
    frequency : str
        Dotted name of the frequency of the excitation.
    observe : (point, component) or (d,) sequence
        As for :func:`fecontact.bifurcation.frequency_response`.
    condition : 'amplitude' or 'phase'
        The peak of the observed amplitude, with memory midway between two orbits of the same; or
        a phase of a contact system that is held, by default phase resonance, where the force does
        no work in phase with the displacements.
    lag : float
        For ``condition="phase"``: the angle phi [rad], 0 < phi < pi, by which the displacements X_1
        are behind the given force P, Im(P^H X_1 exp(i phi)) = 0.
    method, options, preload
        As for :func:`fecontact.bifurcation.frequency_response`; by default up to 400 points,
        largest_step 0.05.
    start : float, optional
        Value of the parameter at which the curve starts, by default the lower bound.

    Raises
    ------
    InputError, AnalysisError
        For a parameter or point that does not exist, no excitation with a period, or no resonance
        found to start from.
    """
    require_kind("resonance_curve", (ContactSystem, VectorField), system=system)
    require_kind("resonance_curve", (HarmonicBalance, type(None)), method=method)
    require_choice("resonance_curve", "condition", condition, _CONDITIONS)
    require_kind("resonance_curve", Real, lag=lag)
    if not 0.0 < lag < np.pi:
        raise InputError(f"resonance_curve: lag = {lag!r} must be an angle between 0 and pi rad; "
                         f"pi / 2 is phase resonance.")
    chosen = options_of(
        options or ContinuationOptions(points=_POINTS, largest_step=_LARGEST), bounds)
    field = system if isinstance(system, VectorField) else contact_field(
        system, [frequency, parameter])
    free, second = field.index(frequency), field.index(parameter)
    if free == second:
        raise InputError(f"resonance_curve: parameter and frequency are both {parameter!r}; take "
                         f"another parameter.")
    if condition == "phase" and not isinstance(field, ContactField):
        raise InputError("resonance_curve: condition = 'phase' needs a contact system, whose given "
                         "forces are known; take 'amplitude'.")
    row, observed = observed_row(field, observe)
    values = field.values
    values[second] = inside(chosen.bounds[0] if start is None else float(start), chosen)
    wanted = Forced(field, values, free, method or HarmonicBalance(), chosen,
                    preloaded(system, preload))
    problem, u = _first(wanted, second, frequencies, row, condition, float(lag))
    branch = followed(problem, u, chosen, parameter,
                      {"parameters": [parameter, frequency], "observed": observed})
    return ResonanceCurve(branch, observed, condition)


def resonances_of(branch: Branch) -> ResonanceCurve:
    """A curve of resonances from its branch, such as that of a file.

    Raises
    ------
    InputError
        If it is not that of resonances.
    """
    known = branch.attributes
    if not {"condition", "observed"} <= set(known) or not len(branch):
        raise InputError("The branch is no curve of resonances; make one with resonance_curve.")
    return ResonanceCurve(branch, str(known["observed"]), str(known["condition"]))


def _first(
    wanted: Forced, second: int, frequencies: tuple[float, float], row: Array, condition: str,
    lag: float,
) -> tuple[PeakProblem, Array]:
    """The problem, and the peak of a response."""
    field, values = wanted.field, wanted.values
    # Kinks jump the stability, which does not matter here.
    given = options_of(replace(RESPONSES, locate=False), frequencies)
    branch = branch_of_response(
        replace(wanted, method=replace(wanted.method, tolerance=None), options=given),
        given.bounds[0])
    sizes = observed_amplitudes(branch, row)
    place = int(np.argmax(sizes))
    if place in (0, len(sizes) - 1):
        raise AnalysisError(f"The response has no peak between the frequencies "
                            f"{given.bounds[0]:.6g} and {branch.points[-1].parameter:.6g}; choose "
                            f"others.")
    if condition == "phase" and isinstance(field, ContactField):
        place = _place_of_phase(field, values, wanted.free, branch, lag, place)
    problem, start = problem_at(wanted, branch.points[place], second, row, condition,
                                float(sizes[place]), lag)
    if condition == "amplitude" and layout_of(field).memory:
        # In the scales of the orbit a distance is about a change of phase.
        problem = replace(problem, window=max(
            _WINDOW, _SAMPLES * 2.0 * np.pi / problem.orbit.samples))
    if condition == "phase":
        problem = replace(problem, size=_work(problem, start))
    return problem, start


def _place_of_phase(
    field: ContactField, values: Array, free: int, branch: Branch, lag: float, peak: int
) -> int:
    """Index of the point nearest to the peak beside which the displacements pass the lag."""
    m, b, off = field.system().basis.modes, layout_of(field).harmonic, []
    rest, values = rest_state(field, values), values.copy()
    for point in branch.points:
        values[free] = point.parameter
        P = given_force(field, values, rest, float(point.values["period"]))
        cosines, sines = point.u[b : 3 * b].reshape(2, b)[:, :m]
        off.append(float((np.vdot(P, cosines - 1j * sines) * np.exp(1j * lag)).imag))
    signs = np.sign(off)
    passed = np.flatnonzero(signs[:-1] * signs[1:] <= 0.0)
    if not len(passed):
        raise AnalysisError(f"The displacements do not pass the lag {lag:.4g} rad behind the force "
                            f"between the frequencies {branch.points[0].parameter:.6g} and "
                            f"{branch.points[-1].parameter:.6g}; choose others.")
    return int(passed[np.argmin(np.abs(passed - peak))])


def _work(problem: PeakProblem, u: Array) -> float:
    """Scale of the work of the given force."""
    row: Any = problem.linearise(u).force_row
    return float(np.abs(row) @ np.abs(u[:-2])) or 1.0
