"""Virtual measurements of a run: anti-alias filter, sampling, noise."""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from fecontact.analysis.sampling import warn_of_aliases
from fecontact.core.checks import as_several, require_kind
from fecontact.core.errors import InputError, ModelWarning, require_positive
from fecontact.core.types import Array
from fecontact.core.units import Unit, quantity
from fecontact.integrate.trajectory import Trajectory
from fecontact.measured.measurement import Measurement
from fecontact.measured.sensors import Sensor

# Fewest outputs of a run in a sampling interval where there is a filter.
_FEWEST = 4
# Largest part of the rms of a channel above half the sampling rate that is not reported.
_ALIAS = 0.01
_CORNER = 1.0 / 2.56  # of the sampling rate, by default


@dataclass(frozen=True)
class Acquisition:
    r"""Sampling of the channels of a virtual measurement.

    Each channel passes a Butterworth low-pass filter

    .. math:: |H(f)|^2 = \frac{1}{1 + (f / f_c)^{2 n}}

    before it is sampled, as one section after another of :func:`scipy.signal.butter`, so that it is
    delayed by ``delay``; white noise is added to the samples.

    Parameters
    ----------
    rate_hz : float
        Sampling rate [Hz].
    corner_hz : float, optional
        f_c, below half the sampling rate [Hz]; by default the rate over 2.56.
    order : int
        n, from 1 to 16; 0 for no filter.
    seed : int
        Seed of the noise. Each channel has its own stream, by its number.

    Raises
    ------
    InputError
        For values out of range.
    """

    rate_hz: Annotated[float, Unit("Hz")]
    corner_hz: Annotated[float | None, Unit("Hz")] = None
    order: int = 8
    seed: int = 0

    def __post_init__(self) -> None:
        owner = type(self).__name__
        require_positive(owner, rate_hz=self.rate_hz)
        for name, value, most in (("order", self.order, 16), ("seed", self.seed, 2**63 - 1)):
            if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
                raise InputError(f"{owner}: {name} = {value!r} must be a whole number from 0 to "
                                 f"{most}.")
        if self.corner_hz is not None and not 0.0 < self.corner_hz < 0.5 * self.rate_hz:
            raise InputError(f"{owner}: corner_hz = {self.corner_hz!r} must lie above zero and "
                             f"below half the sampling rate, {0.5 * self.rate_hz:g} Hz.")

    @property
    def corner(self) -> float:
        """Corner frequency of the filter [Hz]."""
        return _CORNER * self.rate_hz if self.corner_hz is None else self.corner_hz

    @property
    def delay(self) -> float:
        r"""Delay of slow signals by the filter, :math:`\sum_k \sin\theta_k / (2 \pi f_c)` [s].

        Sum over the n poles, whose damping ratios are sin theta_k.
        """
        angles = math.pi * (2.0 * np.arange(self.order) + 1.0) / (2.0 * self.order or 1.0)
        return float(np.sin(angles).sum()) / (2.0 * math.pi * self.corner)

    def filtered(self, values: Array, rate_hz: float) -> Array:
        """Values (N,) at a rate [Hz] after the filter, which starts at rest at the first one."""
        if not self.order:
            return values
        from scipy.signal import butter, sosfilt, sosfilt_zi

        sections = butter(self.order, self.corner, fs=rate_hz, output="sos")
        return np.asarray(sosfilt(sections, values, zi=sosfilt_zi(sections) * values[0])[0])

    @property
    def words(self) -> str:
        """Description of rate and filter."""
        if not self.order:
            return f"sampled at {quantity(self.rate_hz, 'Hz', 5)} without an anti-alias filter"
        return (f"sampled at {quantity(self.rate_hz, 'Hz', 5)} behind a Butterworth filter of "
                f"order {self.order} with its corner at {quantity(self.corner, 'Hz', 4)}, which "
                f"delays by {quantity(self.delay, 's', 3)}")


def measure(
    run: Trajectory, sensors: Sensor | Sequence[Sensor], acquisition: Acquisition, *,
    links: Mapping[str, Any] | None = None, source: str = "virtual measurement",
) -> Measurement:
    """Measure a run by virtual sensors.

    The outputs of the run stand for continuous time: they must be even, with a multiple of the
    sampling rate, at least four times it where there is a filter.

    Parameters
    ----------
    run : Trajectory
        The run. Masses of sensors act in it only if its basis has them; see
        :func:`fecontact.measured.with_sensors`.
    sensors : Accelerometer, ForceGauge, or sequence of them
        One for each channel.
    acquisition : Acquisition
        Sampling rate, filter and seed.
    links : mapping of name to link, optional
        Links between the bodies, for force gauges.
    source : str
        Source of the measurement, for messages.

    Returns
    -------
    Measurement
        One channel for each sensor; ``notes`` state filter, noise and seed. A ModelWarning names
        channels with more than a hundredth of their rms above half the sampling rate, which appears
        at lower frequencies, and outputs that are too far apart.

    Raises
    ------
    InputError
        For outputs at other times, places and links that do not exist, or equal names.
    """
    require_kind("measure", Trajectory, run=run)
    require_kind("measure", Acquisition, acquisition=acquisition)
    given = as_several(sensors, Sensor, "measure", "sensors")
    if not given:
        raise InputError("measure: sensors is empty; give one for each channel.")
    each = _outputs_per_sample(run.time, acquisition)
    warn_of_aliases(run)
    fine, known = each * acquisition.rate_hz, links or {}
    columns, notes = [], [acquisition.words]
    channels = tuple(one.channel(known) for one in given)
    for k, (one, channel) in enumerate(zip(given, channels, strict=True)):
        values = one.sensitivity * one.filtered(one.true_values(run, known), fine)
        values = acquisition.filtered(values, fine)
        _warn_of_alias(channel.name, values, each, acquisition)
        samples = values[::each]
        if spread := one.noise(acquisition.rate_hz):
            generator = np.random.default_rng([acquisition.seed, k])
            samples = samples + spread * generator.standard_normal(len(samples))
            notes.append(f"white noise of {quantity(spread, channel.unit, 3)} rms in "
                         f"'{channel.name}', seed {acquisition.seed}")
        columns.append(samples)
    return Measurement(run.time[::each], np.stack(columns, axis=1), channels, "time", None, source,
                       tuple(notes))


def _outputs_per_sample(time: Array, acquisition: Acquisition) -> int:
    """Number of output intervals in a sampling interval; InputError unless they are even."""
    duration, step = float(time[-1] - time[0]), float(time[-1] - time[0]) / (len(time) - 1)
    least = _FEWEST if acquisition.order else 1
    per = 1.0 / (step * acquisition.rate_hz)
    even = float(np.abs(np.diff(time) - step).max()) <= 1e-6 * step
    if even and round(per) >= least and abs(per / round(per) - 1.0) <= 1e-9 * len(time):
        return round(per)
    wanted = duration * acquisition.rate_hz
    hint = (f"outputs = {least * round(wanted) + 1}" if abs(wanted - round(wanted)) < 1e-6 * wanted
            else f"outputs = {least * max(1, math.ceil(wanted)) + 1} up to t_end = "
                 f"{float(time[0]) + max(1, math.ceil(wanted)) / acquisition.rate_hz:.12g}")
    raise InputError(f"measure: the run has {'' if even else 'uneven '}outputs at {1.0 / step:.6g} "
                     f"Hz; these must be even, and their rate a whole multiple, {least} times at "
                     f"least, of the sampling rate of {acquisition.rate_hz:g} Hz; run with {hint}.")


def _warn_of_alias(name: str, values: Array, each: int, acquisition: Acquisition) -> None:
    """Warn of what a channel has above half the sampling rate."""
    if each == 1:
        return
    power = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values)))) ** 2
    total = float(power.sum())
    first = len(values) // (2 * each) + 1
    part = math.sqrt(float(power[first:].sum()) / total) if total > 0.0 else 0.0
    if part > _ALIAS:
        where = (first + int(np.argmax(power[first:]))) * each * acquisition.rate_hz / len(values)
        folded = abs(where - acquisition.rate_hz * round(where / acquisition.rate_hz))
        remedy = ("lower corner_hz, or a higher order or rate_hz" if acquisition.order
                  else "an anti-alias filter (order = 8), or a higher rate_hz")
        warnings.warn(f"measure: {part:.1%} of the rms of '{name}' lies above half the sampling "
                      f"rate, {0.5 * acquisition.rate_hz:g} Hz; what is strongest there, at "
                      f"{quantity(where, 'Hz')}, appears at {quantity(folded, 'Hz')}. Give "
                      f"{remedy}.", ModelWarning, stacklevel=3)
