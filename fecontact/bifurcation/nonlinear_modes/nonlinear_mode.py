"""Nonlinear modes: frequency, damping and shape of a system's own motion over its amplitude."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from types import NoneType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions, options_of
from fecontact.bifurcation.continuation.pseudo_arclength import start_of
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.fields.observed_row import observed_row
from fecontact.bifurcation.harmonic import branches, starts
from fecontact.bifurcation.harmonic.engine_order import EngineOrder
from fecontact.bifurcation.harmonic.layout import layout_from
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.harmonic.problem import HarmonicProblem
from fecontact.bifurcation.harmonic.series import complex_harmonics
from fecontact.bifurcation.harmonic.stalled import stall_reason
from fecontact.bifurcation.nonlinear_modes.linear_start import (
    CONSERVATIVE,
    LinearStart,
    field_over_xi,
    linear_start,
    linear_start_of_field,
)
from fecontact.bifurcation.nonlinear_modes.mode_problem import (
    PERIOD_SCALE,
    ModeProblem,
    followed_by_shooting,
    leaving_by_shooting,
)
from fecontact.bifurcation.orbit_methods import Shooting
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.core.units import Summarised, listed, span
from fecontact.integrate.initial_state import initial_state
from fecontact.system.contact_quantities import ContactState
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import RestState

# Points at most and steps, unless options say so: a step of one is the amplitude itself, and the
# parts of frequency and damping below.
_POINTS, _STEP, _LARGEST = 2000, 0.02, 0.1
_XI_SCALE = 0.2
# Smallest scale of a coordinate relative to the largest one, and part of the linear mode that the
# observed point must have.
_LEAST_SCALE, _LEAST_SEEN = 1e-3, 1e-4
# Part of the smallest amplitude below which the mode ends.
_BELOW = 0.99
# Relative distance of frequencies that are the same, and of amplitudes; most points between two of
# the mode.
_SAME, _MET, _MOST_BETWEEN = 1e-12, 1e-6, 200
# Corrections of the motion with which a mode begins, at most.
_STARTS = 20
_ENDS = ("largest amplitude", "smallest amplitude")


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class NonlinearMode(Summarised):
    """A periodic motion of a system without excitation, over its amplitude.

    The points of its branch run over xi; they store 'period', 'minimum' and 'maximum' (d,),
    'mean_square_velocity', 'observed_amplitude' and 'observed_harmonics' as those of a
    :class:`~fecontact.bifurcation.FrequencyResponse`, 'truncation_error' and 'residual' (by
    harmonic balance), and if nothing is lost 'multipliers' and 'stable'. A point of kind 'branch
    point', by harmonic balance, is where a mode meets another one.

    Attributes
    ----------
    branch : Branch
        The motions, in their order along the mode.
    number : int
        Number of the mode of the system at rest with which it begins, from 1.
    observed : str
        Whose amplitude it is, such as 'B x'.
    """

    branch: Branch
    number: int
    observed: str

    def __len__(self) -> int:
        return len(self.branch)

    @property
    def amplitude(self) -> Array:
        """Half the range (N,) of the observed displacement over a period."""
        return np.asarray(self.branch.column("observed_amplitude"))

    @property
    def angular_frequency(self) -> Array:
        """Omega (N,) [rad/s]."""
        return np.asarray(2.0 * np.pi / self.branch.column("period"))

    @property
    def frequency_hz(self) -> Array:
        """Frequency (N,) [Hz]."""
        return np.asarray(1.0 / self.branch.column("period"))

    @property
    def xi(self) -> Array:
        """Negative damping xi (N,) [1/s] that makes the motion periodic."""
        return self.branch.parameter

    @property
    def damping_ratio(self) -> Array:
        """Damping ratio (N,), xi / (2 Omega)."""
        return np.asarray(self.xi / (2.0 * self.angular_frequency))

    @property
    def conservative(self) -> bool:
        """Whether no energy is lost: xi is zero within rounding throughout."""
        return bool((np.abs(self.xi) <= CONSERVATIVE * self.angular_frequency).all())

    @property
    def loss(self) -> Array:
        """Energy (N,) lost in one period, xi times the integral of q'^T q' [J].

        For a travelling wave, energy lost in one sector, as :attr:`energy`.
        """
        return np.asarray(self.xi * self.branch.column("period") * self._square)

    @property
    def energy(self) -> Array | None:
        """Energy (N,) of the motion above that of rest [J]; None with losses, and of fields.

        Kinetic and potential energy of the motion, by harmonic balance their mean over a period. Of
        travelling waves the integral of Omega dJ along the mode over its action
        ``J = int q'^T q' dt / (2 pi)``; their mode is to begin where it is linear.
        """
        if not self.conservative or np.isnan(self._square).any():
            return None
        if "energy" in self.branch.points[0].values:
            return np.asarray(self.branch.column("energy"))
        w = self.angular_frequency
        return _integral(w, np.asarray(self._square / w))

    @property
    def stable(self) -> NDArray[np.bool_] | None:
        """Whether the motion (N,) is stable; None unless conservative.

        Perturbations of a conservative motion do not decay; those of a stable one do not grow.
        """
        if not (self.conservative and "stable" in self.branch.points[0].values):
            return None
        return np.asarray(self.branch.column("stable")).astype(bool)

    def harmonic(self, k: int = 1) -> ComplexArray:
        """Complex harmonic X_k (N,) of the observed displacement, x_k = Re(X_k exp(i k w t))."""
        return np.asarray(self.branch.column("observed_harmonics")[:, k])

    def coordinates(self, k: int = 1) -> ComplexArray:
        """Complex harmonic (N, m) of the modal coordinates q, or of all states of a field.

        The coordinates of a travelling wave are modes of the diameter 0, for the mean, and
        displacements of its contact nodes and points;
        :func:`fecontact.bifurcation.wheel_motion` has its modes.

        Raises
        ------
        InputError
            If the motion has fewer harmonics, or was found by shooting.
        """
        known = self.branch.attributes
        _require_harmonics(self.branch, "coordinates")
        layout = layout_from(known)
        H, m, b = self.branch.method.highest, layout.displacements or layout.states, layout.harmonic
        if not (isinstance(k, int | np.integer) and 0 <= k <= H):
            raise InputError(f"coordinates: k = {k!r} must be a whole number from 0 to {H}, the "
                             f"number of harmonics.")
        return np.array([complex_harmonics(point.u[: (2 * H + 1) * b].reshape(-1, b)[:, :m])[k]
                         for point in self.branch.points])

    def orbit(self, index: int, samples: int = 1000) -> PeriodicMotion:
        """The motion at one of the points over a period, both ends included."""
        return self.branch.points[index].orbit(samples=samples)

    def at(
        self, system: ContactSystem, *, amplitude: float | None = None,
        frequency_hz: float | None = None, wave: EngineOrder | None = None,
    ) -> "NonlinearMode":
        """The mode at one amplitude or one frequency: a mode of a single point, solved there.

        Parameters
        ----------
        system : ContactSystem
            The system of the mode.
        amplitude : float, optional
            Amplitude of the observed displacement, in its unit.
        frequency_hz : float, optional
            Frequency [Hz], in place of the amplitude.
        wave : EngineOrder, optional
            Wave of the mode, if it is a travelling wave.

        Raises
        ------
        InputError
            If the mode has no such amplitude or frequency, or has it several times.
        """
        _require_harmonics(self.branch, "at")
        require_kind("NonlinearMode.at", (EngineOrder, NoneType), wave=wave)
        own, given = (self.branch.attributes.get("engine_order"),
                      None if wave is None else wave.order)
        if own != given:
            raise InputError("NonlinearMode.at: wave is for modes of travelling waves; leave it "
                             "out." if own is None else
                             f"NonlinearMode.at: the mode is a wave of engine order {own}; give "
                             f"wave=EngineOrder(wheel, {own}).")
        if not int(self.branch.attributes["displacements"]):
            raise InputError("NonlinearMode.at: is for modes of contact systems; take the points "
                             "of the mode.")
        if (amplitude is None) == (frequency_hz is None):
            raise InputError("NonlinearMode.at: give either amplitude or frequency_hz.")
        if amplitude is not None:
            return _solved(self, system, _bracket("amplitude", self.amplitude, amplitude, ""),
                           float(amplitude), wave)
        assert frequency_hz is not None
        place = _bracket("frequency_hz", self.frequency_hz, frequency_hz, " Hz")
        ends, known = self.amplitude[place : place + 2], self.frequency_hz[place : place + 2]
        if frequency_hz in known.tolist():
            return _solved(self, system, place, float(ends[int(known[1] == frequency_hz)]), wave)

        def off(A: float) -> float:
            found = _solved(self, system, place, A, wave)
            return float(found.frequency_hz[0]) - float(frequency_hz)

        from scipy.optimize import brentq

        return _solved(self, system, place, float(brentq(off, *ends, rtol=1e-12)), wave)

    @property
    def _square(self) -> Array:
        return np.asarray(self.branch.column("mean_square_velocity"))

    def summary(self) -> list[tuple[str, str]]:
        """Amplitudes, frequencies, damping, points where modes meet, and how it ended."""
        special = [f"{point.kind} at {point.values['observed_amplitude']:.5g}"
                   for point in self.branch.special]
        stable = self.stable
        return [
            ("mode", f"{self.number}"), ("observed", self.observed),
            ("amplitude", span(self.amplitude)), ("frequency", span(self.frequency_hz, "Hz")),
            ("damping ratio", "none" if self.conservative else span(self.damping_ratio)),
            ("points", f"{len(self)}"),
            *([("special", listed(special, 5))] if special else []),
            *([("stable", f"{int(stable.sum())} of {len(self)} points")]
              if stable is not None else []),
            ("end", self.branch.status.name.lower())]


@one_blas_thread
def nonlinear_mode(
    system: ContactSystem | VectorField, bounds: tuple[float, float], mode: int = 1, *,
    observe: tuple[str | int, str] | ArrayLike = ("B", "x"),
    method: HarmonicBalance | Shooting | None = None,
    options: ContinuationOptions | None = None,
    preload: LoadHistory | RestState | Array | None = None, unfolding: str | None = None,
) -> NonlinearMode:
    r"""A nonlinear mode: frequency, damping and shape over the amplitude.

    Extended periodic motion concept: a negative damping makes the motion periodic,

    .. math:: M x'' + C x' + K x + f(x, x') - \xi M x' = f_{static},

    with :math:`\Omega` and :math:`\xi` unknown; :math:`\xi / (2 \Omega)` is the damping ratio.
    Without losses xi is zero. The branch starts from the linear mode about the static deflection,
    in which friction with memory sticks. Drives and loads in time are left out.

    Parameters
    ----------
    system : ContactSystem or VectorField
        With smoothed laws.
    bounds : (float, float)
        Amplitudes at which the mode begins and ends [m, rad for a rotation].
    mode : int
        Number of the linear mode, from 1, by frequency.
    observe : (point, component) or (d,) sequence
        Displacement, half the range of which is the amplitude, as for responses.
    method : HarmonicBalance or Shooting, optional
        Kinks need many samples. Shooting is for contact systems, friction without memory. With
        ``repeats=EngineOrder(wheel, m)`` a travelling wave as under engine order m, counted among
        the modes of its nodal diameter.
    options : ContinuationOptions, optional
        By default up to 2000 points, step 0.02, largest_step 0.1 (longer with many modes), in
        units of the amplitude, a fifth of the frequency, and a damping ratio of 0.1.
    preload : LoadHistory, RestState or (d,) array, optional
        As for responses.
    unfolding : str, optional
        Parameter xi of a field, linear in its rates as in ``x'' + f(x, x') - xi x' = 0``, by
        default its only one; zero is the field itself.

    Raises
    ------
    InputError, AnalysisError
        For a mode or point that does not exist, that does not move in the mode, or no motion found.

    References
    ----------
    M. Krack, Nonlinear modal analysis of nonconservative systems: extension of the periodic motion
    concept, Computers and Structures 154 (2015).
    """
    require_kind("nonlinear_mode", (ContactSystem, VectorField), system=system)
    require_kind("nonlinear_mode", (HarmonicBalance, Shooting, NoneType), method=method)
    require_kind("nonlinear_mode", (str, NoneType), unfolding=unfolding)
    low, high = _amplitudes(bounds)
    chosen = method or HarmonicBalance()
    start = _begun(system, mode, preload, unfolding, chosen.repeats)
    # Of proportional coordinates each adds to the length of a step.
    longer = max(1.0, np.sqrt(0.5 * start.displacements))
    given = options_of(options or ContinuationOptions(
        points=_POINTS, step=_STEP * longer, largest_step=_LARGEST * longer), None)
    row, observed = observed_row(start.field, observe)
    ends = _between(given, low, high)
    further = {"observed": observed, "mode_number": int(mode), "rest": start.state[
        : start.displacements]}
    shape, scales = _first_motion(start, row, observed, low)
    leave, follow = _WAYS[type(chosen)]

    def leaving(factor: float) -> tuple[Any, Array, Array]:
        return leave(start, factor * shape, scales, row, chosen)

    begin = leaving(1.0)
    try:
        branch = follow(start, _of_amplitude(begin, leaving, low, ends), chosen, ends)
    except FecontactError as error:
        raise AnalysisError(f"No nonlinear mode was followed from the linear one at "
                            f"{start.angular_frequency / (2.0 * np.pi):.5g} Hz and the amplitude "
                            f"{low:g}; {_remedy(preload)} ({error})") from None
    return returned_noted(NonlinearMode(_ended(branch, further), mode, observed))


def _of_amplitude(
    begin: tuple[Any, Array, Array], leaving: Callable[[float], tuple[Any, Array, Array]],
    amplitude: float, options: ContinuationOptions,
) -> tuple[Any, Array, Array]:
    """Problem, unknowns and direction of the motion of an amplitude.

    ``begin`` are those of the linear mode at the amplitude, ``leaving(factor)`` at so many times
    it. Where motions are not linear, that next to it has another amplitude.
    """
    factor = 1.0
    for _ in range(_STARTS):
        problem, guess, heading = begin
        found = start_of(problem, guess, options, heading, 1.0)
        ratio = float(found.values["observed_amplitude"]) / amplitude
        if abs(ratio - 1.0) <= 0.1 * _MET:
            break
        factor /= ratio
        begin = leaving(factor)
    return problem, found.u, heading


def returned_noted(mode: NonlinearMode) -> NonlinearMode:
    """The mode; the message of its branch says if it came back to the amplitude of its start."""
    A = mode.amplitude
    if mode.branch.status is not BranchStatus.BOUND or A[-1] > A[0]:
        return mode
    note = (f"The mode turned back at the amplitude {A.max():.4g} and returned to its start; if it "
            f"turned at a kink of a contact law, take more samples or smaller steps.")
    message = f"{mode.branch.message} {note}".strip()
    return replace(mode, branch=replace(mode.branch, message=message))


def _remedy(preload: LoadHistory | RestState | Array | None) -> str:
    """Advice if a mode cannot be followed from the linear one."""
    if isinstance(preload, LoadHistory | RestState):
        states = np.atleast_2d(preload.contact_state)[-1]
        slips = np.count_nonzero(states == ContactState.SLIP)
        if slips:
            return (f"of the {len(states)} contact nodes {slips} are at their friction limit in "
                    f"the preload, and slip at any amplitude: leave preload out, or give one in "
                    f"which all nodes stick")
    return "begin at a smaller one, where the motion is linear"


def _followed(
    start: LinearStart, begin: tuple[ModeProblem, Array, Array], method: HarmonicBalance,
    options: ContinuationOptions,
) -> Branch:
    """The branch of a mode from its start by harmonic balance."""
    problem, u, leaving = begin
    branch = branches.follow(problem, u, leaving, method, options)
    return replace(branch, message=stall_reason(start.field, branch), attributes={
        **branch.attributes, "conservative": problem.conservative, "rigid_motions": problem.loose})


def _begun(
    system: ContactSystem | VectorField, mode: int,
    preload: LoadHistory | RestState | Array | None, unfolding: str | None,
    wave: EngineOrder | None,
) -> LinearStart:
    """The linear mode of a system, of one of its travelling waves or of a field."""
    if isinstance(system, ContactSystem):
        if unfolding is not None:
            raise InputError("nonlinear_mode: unfolding is for vector fields; the negative damping "
                             "of a contact system is that of all its masses.")
        held = None if preload is None else initial_state(system, preload, 0.0)
        if wave is not None and held is not None:
            held = wave.state(field_over_xi(system, 0.0, wave), held)
        return linear_start(system, mode, held, wave)
    if wave is not None:
        raise InputError("nonlinear_mode: repeats=EngineOrder(...) is for contact systems, of the "
                         "basis of its wheel.")
    if isinstance(system, ContactField):
        raise InputError("nonlinear_mode: give the contact system in place of its field.")
    if preload is not None:
        raise InputError("nonlinear_mode: preload is for contact systems.")
    return linear_start_of_field(system, unfolding, mode)


def continued_mode(
    system: ContactSystem, mode: NonlinearMode, bounds: tuple[float, float],
    observe: tuple[str | int, str], options: ContinuationOptions,
    wave: EngineOrder | None = None,
) -> NonlinearMode:
    """A mode that was interrupted, followed on from its last regular point."""
    low, high = _amplitudes(bounds)
    known, points = mode.branch.attributes, list(mode.branch.points)
    while points[-1].kind is not None and len(points) > 1:
        points.pop()
    last = points[-1]
    field = field_over_xi(system, last.parameter, wave)
    plain, u, tangent = starts.restored(field, last)
    problem = _mode_problem(
        plain, row=observed_row(field, observe)[0], conservative=bool(known["conservative"]),
        loose=np.asarray(known["rigid_motions"]).reshape(-1, plain.layout.displacements),
        home=np.asarray(known["rest"]))
    left = max(2, options.points - len(points) + 1)
    rest = branches.follow(problem, u, tangent, known["method"],
                           _between(replace(options, points=left), low, high))
    ended = _ended(replace(rest, message=stall_reason(field, rest)), {})
    return replace(mode, branch=replace(
        mode.branch, points=(*points, *ended.points[1:]), status=ended.status,
        message=ended.message))


def _require_harmonics(branch: Branch, name: str) -> None:
    """Raise InputError unless a mode was found by harmonic balance."""
    if type(branch.method) is not HarmonicBalance:
        raise InputError(f"NonlinearMode.{name}: the mode was found by shooting and has no "
                         f"harmonics of its coordinates; find it by HarmonicBalance().")


def _bracket(name: str, values: Array, wanted: float, unit: str) -> int:
    """Index of the point behind which values (N,) pass a wanted one, once."""
    value = as_floats(wanted, f"NonlinearMode.at: {name}")
    if value.ndim or not np.isfinite(value):
        raise InputError(f"NonlinearMode.at: {name} = {wanted!r} must be a finite number.")
    off = values - float(value)
    near = np.abs(off) <= (_MET if name == "amplitude" else _SAME) * np.abs(values)
    passed = np.flatnonzero((off[:-1] * off[1:] < 0.0) & ~near[:-1] & ~near[1:])
    found = [*passed.tolist(), *np.minimum(np.flatnonzero(near), len(values) - 2).tolist()]
    if not found:
        raise InputError(f"NonlinearMode.at: {name} = {float(value):g}{unit} must lie within the "
                         f"mode, from {values.min():.6g} to {values.max():.6g}{unit}.")
    if len(found) > 1 and name == "frequency_hz":
        raise InputError(f"NonlinearMode.at: the mode has the frequency {float(value):g} Hz "
                         f"{len(found)} times; give the amplitude.")
    if len(found) > 1 and max(found) - min(found) > 1:
        raise InputError(f"NonlinearMode.at: the mode has the amplitude {float(value):g} "
                         f"{len(found)} times; take a point of its branch.")
    return int(min(found))


def _solved(
    mode: NonlinearMode, system: ContactSystem, place: int, amplitude: float,
    wave: EngineOrder | None,
) -> NonlinearMode:
    """The mode at an amplitude between two neighbouring points."""
    points, A = mode.branch.points, mode.amplitude
    for k in (place, place + 1):
        if abs(A[k] - amplitude) <= _MET * amplitude:
            return _with_points(mode, points[k])
    rises = A[place + 1] > A[place]
    bounds = (0.5 * A[place], amplitude) if rises else (amplitude / _BELOW, 2.0 * A[place])
    point, _, component = mode.observed.rpartition(" ")
    length = float(np.log(max(A[place + 1], amplitude) / min(A[place], amplitude)))
    step = float(np.clip(abs(length), 1e-4, _STEP))
    known = _with_points(mode, *points[: place + 1])
    found = continued_mode(
        system, known, bounds, (int(point) if point.isdigit() else point, component),
        ContinuationOptions(points=place + _MOST_BETWEEN, step=step, largest_step=_LARGEST), wave)
    last = found.branch.points[-1]
    if abs(float(last.values["observed_amplitude"]) / amplitude - 1.0) > _MET:
        raise AnalysisError(f"The mode was not found at the amplitude {amplitude:g}; take its "
                            f"points beside it.")
    return _with_points(mode, last)


def with_point(
    mode: NonlinearMode, system: ContactSystem, place: int, amplitude: float
) -> NonlinearMode:
    """The mode with one more point, behind that of number ``place`` and before the next."""
    points = mode.branch.points
    between = _solved(mode, system, place, amplitude, None).branch.points
    return _with_points(mode, *points[: place + 1], *between, *points[place + 1 :])


def _with_points(mode: NonlinearMode, *points: BranchPoint) -> NonlinearMode:
    """The mode with these points alone."""
    return replace(mode, branch=replace(mode.branch, points=points))


def mode_of(branch: Branch) -> NonlinearMode:
    """A nonlinear mode from its branch, such as that of a file.

    Raises
    ------
    InputError
        If it is not that of a mode.
    """
    known = branch.attributes
    if not {"mode_number", "observed"} <= set(known) or not len(branch):
        raise InputError("The branch is not that of a nonlinear mode; make one with "
                         "nonlinear_mode.")
    return NonlinearMode(branch, int(known["mode_number"]), str(known["observed"]))


def _amplitudes(bounds: tuple[float, float]) -> tuple[float, float]:
    found = as_floats(bounds, "nonlinear_mode: bounds")
    if found.shape != (2,) or not 0.0 < found[0] < found[1] < np.inf:
        raise InputError(f"nonlinear_mode: bounds = {bounds!r} must be two amplitudes above zero, "
                         f"the smaller one first.")
    return float(found[0]), float(found[1])


def _leaving(
    start: LinearStart, shape: ComplexArray, scales: Array, row: Array, method: HarmonicBalance
) -> tuple[ModeProblem, Array, Array]:
    """Problem, unknowns and direction of the linear mode at its amplitude."""
    d, m, T = start.field.dimension, start.displacements, 2.0 * np.pi / start.angular_frequency
    starts.require_mean(method, start.state[:m])
    plain = starts.problem_for(start.field, start.values, start.free, method, scales)
    waves = np.exp(2.0j * np.pi * plain.series.times)[:, None]
    leaving = starts.unknowns(plain, (waves * shape).real, 0.0)
    leaving[-2:] = 0.0
    u = starts.unknowns(plain, np.tile(start.state, (plain.samples, 1)), T) + leaving
    problem = _mode_problem(
        plain, reference=plain.coefficients(leaving).copy(), limits=np.full(d, np.inf), row=row,
        conservative=start.lossless and not plain.layout.memory, loose=start.loose,
        home=start.state[:m], kept=plain.kept.left_by(start.state[None]))
    return problem, u, leaving / np.sqrt(problem.weights() @ leaving**2)


def _first_motion(
    start: LinearStart, row: Array, observed: str, amplitude: float
) -> tuple[ComplexArray, Array]:
    """Shape (d,) of the linear mode at an amplitude, and scales (d + 2,) of states, T and xi.

    The observed displacement begins at its largest value.
    """
    m, w, shape = start.displacements, start.angular_frequency, start.shape
    seen = complex(row @ shape)
    if abs(seen) <= _LEAST_SEEN * np.linalg.norm(row[:m]) * np.linalg.norm(shape[:m]):
        raise InputError(f"{observed} does not move in this mode, at {w / (2.0 * np.pi):.5g} Hz, "
                         f"or hardly; observe another displacement.")
    shape = shape * amplitude / seen
    sizes = np.abs(shape)
    sizes = np.maximum(sizes, _LEAST_SCALE * sizes[:m].max())
    return shape, np.concatenate([sizes, [PERIOD_SCALE * 2.0 * np.pi / w, _XI_SCALE * w]])


def _mode_problem(plain: HarmonicProblem, **changes: Any) -> ModeProblem:
    """The problem of a mode that has what that of an orbit has, with changes."""
    known = {entry.name: getattr(plain, entry.name) for entry in fields(plain)}
    return ModeProblem(**{**known, **changes})


def _between(options: ContinuationOptions, low: float, high: float) -> ContinuationOptions:
    """The options with ends at two amplitudes."""
    return replace(
        options, bounds=(-np.inf, np.inf), locate=True, stop_at=(*options.stop_at, *_ENDS),
        events={**options.events, _ENDS[0]: _beyond(high), _ENDS[1]: _beyond(_BELOW * low)})


def _beyond(amplitude: float) -> Any:
    def off(values: Mapping[str, Any]) -> float:
        return float(values["observed_amplitude"]) / amplitude - 1.0

    return off


def _ended(branch: Branch, attributes: dict[str, Any]) -> Branch:
    """The branch with attributes; its last point is regular where it ends at an amplitude."""
    last = branch.points[-1]
    points, status = branch.points, branch.status
    if last.kind in _ENDS:
        points = (*points[:-1], BranchPoint(last.u, last.tangent, last.values))
        status = BranchStatus.BOUND
    return replace(branch, points=points, status=status,
                   attributes={**branch.attributes, **attributes})


def _integral(rate: Array, over: Array) -> Array:
    """Integral (N,) of a rate along a curve from zero, by splines through its points.

    Up to the first point the rate is constant.
    """
    from scipy.interpolate import CubicSpline

    first = rate[0] * over[0]
    chord = np.hypot(np.diff(rate) / rate[0], np.diff(over) / np.maximum(over[1:], over[:-1]))
    kept = np.append(True, chord > 1e-12)
    if np.count_nonzero(kept) < 2:
        return np.full(len(rate), first)
    s = np.append(0.0, np.cumsum(chord[kept[1:]]))
    rates, overs = CubicSpline(s, rate[kept]), CubicSpline(s, over[kept])
    # Three Gauss points integrate the product of both cubics exactly.
    nodes, weights = np.polynomial.legendre.leggauss(3)
    middle, half = 0.5 * (s[1:] + s[:-1]), 0.5 * np.diff(s)
    places = middle[:, None] + half[:, None] * nodes
    parts = half * ((rates(places) * overs(places, 1)) @ weights)
    whole = np.append(0.0, np.cumsum(parts))
    return np.asarray(first + whole[np.cumsum(kept) - 1])


# How each method leaves the linear mode, and follows it.
_WAYS: Mapping[type, tuple[Callable[..., Any], Callable[..., Branch]]] = {
    HarmonicBalance: (_leaving, _followed), Shooting: (leaving_by_shooting, followed_by_shooting)}
