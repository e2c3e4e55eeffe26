"""Data in time and along paths: histories, ring-downs, hysteresis loops."""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from fecontact.analysis.histories import Point, history, quantity_unit
from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError, choices
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.fitting.data import Curve, FitData, finite_columns, freeze, spread
from fecontact.integrate.sensitivities import differentiated
from fecontact.integrate.simulate import simulate
from fecontact.integrate.solvers import AUTO
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.measured.amplitude_curve import AmplitudeCurve
from fecontact.measured.ring_down import ring_down
from fecontact.system.contact_system import ContactSystem
from fecontact.system.quasistatic.loading import load_history
from fecontact.system.quasistatic.path import LoadPath

_SAMPLES = 24.0  # outputs of a decay in a period of its highest frequency
_OVERLAP = 0.95  # of the windows along the run of a model
_SLOPE = 0.1  # of log amplitude, over which the slope at the end of a curve is taken
_STEP = 0.02  # of log amplitude, over which slopes of a model are taken
_MOVED = ("displacement", "velocity")


def _run(system: ContactSystem, initial: Any, times: Array, rtol: float) -> Trajectory:
    """Run over given times; AnalysisError unless it reaches their end."""
    state = initial(system) if callable(initial) else initial
    run = simulate(system, float(times[-1]), t_start=float(times[0]), initial=state, outputs=times,
                   rtol=rtol, keep_steps=False)
    if run.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if run.status is not Status.FINISHED:
        raise AnalysisError(run.status.value)
    return run


@read_only_arrays
@dataclass(frozen=True, eq=False)
class HistoryData(FitData):
    """A quantity over time, compared with a run.

    Parameters
    ----------
    time, values : (n,) arrays
        Ascending times [s], at least two, and measured values in SI units.
    deviation : float or (n,) array, optional
        Standard deviations; without any, they follow from the residuals.
    quantity, point, component
        See :func:`fecontact.analysis.history`.
    initial : optional
        State at the first time, as for :func:`fecontact.simulate`, or a function of the system that
        gives it.
    rtol : float
        Relative tolerance of the run.

    Raises
    ------
    InputError
        For arrays that do not fit together, are not finite, or times that do not ascend.
    """

    time: Array
    values: Array
    deviation: Any = None
    quantity: str = "displacement"
    point: Point = "B"
    component: str = "x"
    initial: Any = "rest"
    rtol: float = 1e-8

    def __post_init__(self) -> None:
        columns = finite_columns("HistoryData", time=self.time, values=self.values)
        quantity_unit(self.quantity)
        if len(columns["time"]) < 2 or not (np.diff(columns["time"]) > 0.0).all():
            raise InputError("HistoryData: times must ascend; give two at least.")
        freeze(self, **columns, deviation=spread(self.deviation, len(columns["time"]),
                                                 "HistoryData"))

    def predicted(self, system: ContactSystem) -> Array:
        """Quantity of a run (n,)."""
        run = _run(system, self.initial, self.time, self.rtol)
        return np.asarray(history(run, self.quantity, self.point, self.component).values)

    def derivative(self, system: ContactSystem, parameter: str) -> Array | None:
        """Derivative of the computed steps, of displacements and velocities from a given state."""
        if self.quantity not in _MOVED or not isinstance(self.initial, list | tuple | np.ndarray):
            return None
        try:
            value = system.parameter(parameter)
        except InputError:
            return None
        if not isinstance(value, float):
            return None
        found = differentiated(system, self.time, np.asarray(self.initial, dtype=float), parameter,
                               AUTO, self.rtol)
        assert found.forced is not None
        moved = np.zeros(found.states.shape)
        for k, (transition, forced) in enumerate(zip(found.transitions, found.forced,
                                                     strict=True)):
            moved[k + 1] = transition @ moved[k] + forced
        m = system.basis.modes
        row = system.basis.point_row(self.point, self.component)  # type: ignore[arg-type]
        part = moved[:, :m] if self.quantity == "displacement" else moved[:, m : 2 * m]
        return np.asarray(part @ row)

    def curves(self) -> list[Curve]:
        """One curve over time."""
        unit = quantity_unit(self.quantity, self.component)
        return [Curve("time [s]", self.time, f"{self.quantity.replace('_', ' ')} [{unit}]",
                      slice(0, len(self.time)))]


@dataclass(frozen=True, eq=False, kw_only=True)
class CurveData(FitData):
    """Base class of data that are a curve of frequency and damping over amplitude.

    Parameters
    ----------
    slopes : (2, N) array, optional
        Slopes of frequency [Hz] and damping ratio over log amplitude, by which errors of the
        amplitude count. A fit takes those of its model; until then they are those of the curve.
    """

    slopes: Array | None = None

    @property
    def _curve(self) -> AmplitudeCurve:
        found: AmplitudeCurve = getattr(self, "curve")  # noqa: B009 (a field of subclasses)
        return found

    @property
    def measured(self) -> Array:
        """Frequencies [Hz], then damping ratios."""
        return np.concatenate([self._curve.frequency_hz, self._curve.damping_ratio])

    def at(self, system: ContactSystem, amplitude: Array) -> Array:
        """Frequencies [Hz], then damping ratios of a model, over amplitudes."""
        raise NotImplementedError

    def predicted(self, system: ContactSystem) -> Array:
        """Frequencies and damping ratios of a model, at the measured amplitudes."""
        return self.at(system, self._curve.amplitude)

    @property
    def _covariance(self) -> Array | None:
        """Covariances (N, 2, 2) of frequency and damping ratio at the measured amplitudes."""
        return self._curve.covariance_at_amplitude(self.slopes)

    @property
    def deviations(self) -> Array | None:
        """Standard deviations of both at the measured amplitudes; None without any."""
        found = self._covariance
        return None if found is None else np.sqrt(np.concatenate([found[:, 0, 0], found[:, 1, 1]]))

    def whitened(self, values: Array) -> Array:
        """Changes of frequencies in deviations, then what damping changes besides them."""
        found = self._covariance
        return values if found is None else _unpaired(np.linalg.solve(
            np.linalg.cholesky(found), _paired(values)), values.shape)

    def coloured(self, values: Array) -> Array:
        """Changes of frequencies and damping ratios, the inverse of whitening."""
        found = self._covariance
        return values if found is None else _unpaired(
            np.linalg.cholesky(found) @ _paired(values), values.shape)

    def weighted_by(self, system: ContactSystem) -> "FitData":
        """Copy in which errors of the amplitude count by the slopes of a model."""
        A = self._curve.amplitude
        if self._curve.amplitude_deviation is None:
            return self
        ends = self.at(system, np.concatenate([A * np.exp(-_STEP), A * np.exp(_STEP)]))
        low, high = np.moveaxis(ends.reshape(2, 2, len(A)), 1, 0)
        return replace(self, slopes=(high - low) / (2.0 * _STEP))

    @property
    def deviation_freedom(self) -> float:
        """Degrees of freedom of the deviations of the curve."""
        return self._curve.deviation_freedom

    def curves(self) -> list[Curve]:
        """Frequency and damping ratio over amplitude."""
        curve = self._curve
        n, label = len(curve), f"amplitude [{curve.unit}]"
        return [Curve(label, curve.amplitude, "frequency [Hz]", slice(0, n), True),
                Curve(label, curve.amplitude, "damping ratio", slice(n, 2 * n), True)]


def _paired(values: Array) -> Array:
    """Values (2 N, ...) of two quantities as (N, 2, m)."""
    return np.moveaxis(values.reshape(2, len(values) // 2, -1), 0, 1)


def _unpaired(values: Array, shape: tuple[int, ...]) -> Array:
    """Inverse of :func:`_paired`."""
    return np.moveaxis(values, 1, 0).reshape(shape)


@read_only_arrays
@dataclass(frozen=True, eq=False)
class DecayData(CurveData):
    """Frequency and damping over amplitude of a ring-down, compared with those of a run.

    The run is evaluated as the measurement was. At amplitudes outside of it, frequency and damping
    go on linearly over the logarithm of the amplitude.

    Parameters
    ----------
    curve : AmplitudeCurve
        Result of :func:`fecontact.measured.ring_down` for the measurement, with its deviations.
    initial : array or function
        State from which the run decays, as for :class:`HistoryData`.
    t_end : float
        Duration of the run [s].
    quantity, point, component
        Quantity of the run, see :func:`fecontact.analysis.history`.
    options : mapping
        Arguments of :func:`fecontact.measured.ring_down`, the same as for the measurement.
    rtol : float
        Relative tolerance of the run.

    Raises
    ------
    InputError
        For a curve that is none, or a duration that is not above zero.
    """

    curve: AmplitudeCurve
    initial: Any
    t_end: float
    quantity: str = "displacement"
    point: Point = "B"
    component: str = "x"
    options: dict[str, Any] = field(default_factory=dict)
    rtol: float = 1e-8

    def __post_init__(self) -> None:
        require_kind("DecayData", AmplitudeCurve, curve=self.curve)
        quantity_unit(self.quantity)
        if not (isinstance(self.t_end, int | float) and 0.0 < self.t_end < np.inf):
            raise InputError(f"DecayData: t_end = {self.t_end!r} must be a time above zero.")

    def at(self, system: ContactSystem, amplitude: Array) -> Array:
        """Frequencies [Hz], then damping ratios of a run, over amplitudes."""
        highest = float(self.curve.frequency_hz.max())
        count = max(64, int(np.ceil(self.t_end * highest * _SAMPLES)) + 1)
        run = _run(system, self.initial, np.linspace(0.0, self.t_end, count), self.rtol)
        values = history(run, self.quantity, self.point, self.component)
        order = {"velocity": 1, "acceleration": 2}.get(self.quantity, 0)
        # Windows of the same length, close together, between which the curve is interpolated.
        found = ring_down(run.time, values.values, derivative=order, **{
            "frequency_hz": float(np.median(self.curve.frequency_hz)), **self.options,
            "overlap": _OVERLAP})
        return _extended(found, amplitude)


def _extended(curve: AmplitudeCurve, amplitude: Array) -> Array:
    """Frequencies and damping ratios (2 N,) at amplitudes, beyond the ends of a curve too."""
    known = np.sort(curve.amplitude)
    low, high = float(known[0]), float(known[-1])
    values = np.stack(curve.at(np.clip(amplitude, low, high)))
    # A step along the curve, over which the slope at its end is taken.
    inner = min(_SLOPE, 0.5 * np.log(high / low))
    if inner > 0.0:
        for end, side in ((low, 1.0), (high, -1.0)):
            at_end, within = (np.stack(curve.at(place)) for place in (
                end, end * np.exp(side * inner)))
            beyond = side * np.log(end / amplitude)
            values += np.where(beyond > 0.0, beyond, 0.0) * (
                (at_end - within) / inner)[:, None]
    return np.concatenate(values)


@read_only_arrays
@dataclass(frozen=True, eq=False)
class LoopData(FitData):
    """Force over displacement of quasi-static loading, such as a hysteresis loop.

    The record begins with the first loading: friction has no history before it.

    Parameters
    ----------
    displacement, force : (n,) arrays
        Measured displacements [m] and forces [N] in their order.
    deviation : float or (n,) array, optional
        Standard deviations of the forces; without any, they follow from the residuals.
    along : str
        Kind of displacement: 'motion_x', 'motion_y', 'motion_z' of the driven end of the
        springs at B, or 'travel', 'travel_y' of the ground.
    path : LoadPath, optional
        Path with n points, in place of the one along the displacements; the forces are those of
        ``along``, any action of :meth:`fecontact.system.LoadHistory.loop`.
    tangential_ratio, tangential_stiffness, rtol
        See :func:`fecontact.load_history`.

    Raises
    ------
    InputError
        For arrays that do not fit together or to the path, or an unknown action without a path.
    """

    compared: ClassVar[str] = "force"

    displacement: Array
    force: Array
    deviation: Any = None
    along: str = "motion_x"
    path: LoadPath | None = None
    tangential_ratio: float = 0.82
    tangential_stiffness: Any = None
    rtol: float = 1e-7

    def __post_init__(self) -> None:
        columns = finite_columns("LoopData", displacement=self.displacement, force=self.force)
        require_kind("LoopData", (LoadPath, type(None)), path=self.path)
        known = ("motion_x", "motion_y", "motion_z", "travel", "travel_y")
        if self.path is None and self.along not in known:
            raise InputError(f"LoopData: along = {self.along!r} must be one of {choices(known)}, "
                             f"or give a path.")
        if self.path is not None and sum(self.path.section_steps) + 1 != len(columns["force"]):
            raise InputError(f"LoopData: the path has {sum(self.path.section_steps) + 1} points "
                             f"for {len(columns['force'])} forces; give one force for each.")
        freeze(self, **columns, deviation=spread(self.deviation, len(columns["force"]),
                                                 "LoopData"))
        if self.path is None:
            freeze(self, path=self._plain_path())

    def _plain_path(self) -> LoadPath:
        """Path along the displacements."""
        return LoadPath(**{self.along: tuple(self.displacement.tolist())}, steps=1)

    def predicted(self, system: ContactSystem) -> Array:
        """Forces (n,) of the model [N]."""
        assert self.path is not None
        found = load_history(system, self.path, tangential_ratio=self.tangential_ratio,
                             tangential_stiffness=self.tangential_stiffness, rtol=self.rtol)
        if found.status != "finished":
            raise AnalysisError(f"The loading ends at point {len(found) - 1} of "
                                f"{len(self.force) - 1} without an equilibrium.")
        return np.asarray(found.loop(action=self.along).force)

    def rescaled(self, factor: float) -> "LoopData | None":
        """Copy with displacements that are a factor times as large; None along a path."""
        if self.path != self._plain_path():
            return None
        return replace(self, displacement=factor * self.displacement, path=None)

    def curves(self) -> list[Curve]:
        """Force over displacement."""
        return [Curve("displacement [m]", self.displacement, "force [N]",
                      slice(0, len(self.force)))]


