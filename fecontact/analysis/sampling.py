"""Spacing of outputs compared with the motion: fastest strong motion, histories without aliases."""

import math
import warnings
from typing import NamedTuple

import numpy as np

from fecontact.analysis.histories import History, Point, history
from fecontact.analysis.resolved import resolved
from fecontact.analysis.spectra import mean_frequency
from fecontact.core.errors import ModelWarning
from fecontact.core.magnitude import magnitude
from fecontact.core.types import Array
from fecontact.core.units import quantity
from fecontact.integrate.trajectory import Trajectory

# Smallest share of the kinetic energy of a modal coordinate whose motion is strong.
_STRONG = 0.01
# Samples per period of the mean frequency of an even history, and most samples of it.
_PER_PERIOD, _MOST = 16, 2**22
# Largest fraction of the time in which the motion between outputs may stay unknown.
_UNKNOWN = 0.01


class Sampled(NamedTuple):
    """A quantity of a run at evenly spaced times.

    time : (N,) [s]
    history : values (N,), unit and title
    note : text for plots about motion between outputs that is not known; else empty
    """

    time: Array
    history: History
    note: str


def fastest_period(trajectory: Trajectory) -> float:
    """Period of the fastest strong motion of a run [s]; infinite at rest.

    That of the modal coordinate with the highest frequency ``rms(q') / (2 pi rms(q))`` among those
    with at least a hundredth of the kinetic energy. Velocities and coordinates are samples of their
    own, so that outputs too far apart do not change their ratio.
    """
    # Squares of large numbers would overflow.
    fast, far = magnitude(trajectory.modal_velocities), magnitude(trajectory.modal_coordinates)
    rates = trajectory.modal_velocities / fast
    moved = trajectory.modal_coordinates / far
    energy = np.square(rates).mean(axis=0)
    strong = energy > _STRONG * energy.max(initial=0.0)
    if not strong.any() or len(rates) < 3:
        return math.inf
    swing = np.square(moved - moved.mean(axis=0)).mean(axis=0)[strong]
    beats = np.square(rates - rates.mean(axis=0)).mean(axis=0)[strong]
    ratio = np.divide(beats, swing, out=np.zeros_like(beats), where=swing > 0.0)
    highest = fast / far * math.sqrt(float(ratio.max()))
    return 2.0 * math.pi / highest if highest > 0.0 else math.inf


def alias_message(trajectory: Trajectory) -> str:
    """Sentence on outputs more than half the fastest period apart; empty if there are none."""
    period = fastest_period(trajectory)
    spacing = float(np.diff(trajectory.time).max())
    if spacing <= 0.5 * period:
        return ""
    duration = float(trajectory.time[-1] - trajectory.time[0])
    enough = math.ceil(duration * _PER_PERIOD / period) + 1
    return (f"outputs lie {quantity(spacing, 's')} apart, more than half the period of the fastest "
            f"strong motion, {quantity(period, 's')} ({quantity(1.0 / period, 'Hz')}), so that "
            f"frequencies appear which it does not have; run with outputs = {enough} or more over "
            f"this interval.")


def warn_of_aliases(trajectory: Trajectory) -> None:
    """Issue a ModelWarning if outputs are more than half the fastest period apart."""
    if message := alias_message(trajectory):
        warnings.warn(f"In this run {message}", ModelWarning, stacklevel=3)


def between_outputs(trajectory: Trajectory, count: int) -> Trajectory:
    """The run with times between its outputs, where these are too few for ``count`` of its times.

    The run itself is returned if it has as many outputs or they resolve its fastest strong motion,
    and where it has not kept enough between them.
    """
    if len(trajectory.time) >= count or not alias_message(trajectory):
        return trajectory
    found = resolved(trajectory)
    return found.trajectory if found.coarse <= _UNKNOWN else trajectory


def coarse_frames_message(trajectory: Trajectory, shown: Array) -> str:
    """Sentence on times to show more than half the fastest period apart; else empty."""
    period = fastest_period(trajectory)
    if len(shown) < 2 or (apart := float(np.diff(shown).max())) <= 0.5 * period:
        return ""
    lasting = 0.1 * period * len(shown)
    remedy = f"draw at most {quantity(lasting, 's')}, by t_start and t_end"
    if len(trajectory.time) <= len(shown):
        remedy = f"run with outputs at most {quantity(0.1 * period, 's')} apart, or {remedy}"
    return (f"frames lie {quantity(apart, 's')} apart, more than half the period of the fastest "
            f"strong motion, {quantity(period, 's')}, which the movie shows too slow or backwards; "
            f"{remedy}.")


def evenly_sampled_history(
    trajectory: Trajectory, quantity_name: str, point: Point | None, component: str
) -> Sampled:
    """A quantity of a run at even times that resolve it, from the motion between the outputs.

    At least 16 times per period of its mean frequency. Even outputs that are that close are
    returned unchanged. Where the run has not kept enough between them, the outputs themselves
    are taken, with a ModelWarning if they are too far apart.
    """
    plain = history(trajectory, quantity_name, point, component)
    time = trajectory.time
    if len(time) < 3:
        return Sampled(time, plain, "")
    found = resolved(trajectory)
    if found.coarse > _UNKNOWN:
        warn_of_aliases(trajectory)
        return Sampled(time, plain, found.note)
    fine = history(found.trajectory, quantity_name, point, component)
    fine_time = found.trajectory.time
    wanted = math.ceil((time[-1] - time[0]) * _PER_PERIOD * mean_frequency(fine_time, fine.values))
    if len(time) > wanted and np.ptp(np.diff(time)) < 1e-6 * np.diff(time).mean():
        return Sampled(time, plain, found.note)
    from scipy.interpolate import CubicSpline

    count = min(max(wanted + 1, len(time), 8), _MOST)
    even = np.linspace(time[0], time[-1], count)
    values = np.asarray(CubicSpline(fine_time, fine.values)(even))
    return Sampled(even, fine._replace(values=values), found.note)
