"""Scalar functions of a run: amplitudes, forces, powers, frequencies, shares of contact states.

Sweeps, key numbers and comparisons take them from :data:`RUN_SUMMARIES` by name. They are those of
the motion between the outputs too, as far as the run has kept it; where it has not, and straight
lines between outputs may cut off peaks, a ModelWarning says so.
"""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.histories import require_observed_motion, usual_point
from fecontact.analysis.resolved import resolved
from fecontact.analysis.sampling import warn_of_aliases
from fecontact.core.docstrings import summary
from fecontact.core.errors import InputError, ModelWarning, choices
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.reduction.assembly.contact_faces import contact_faces
from fecontact.system.columns import POWERS
from fecontact.system.contact_quantities import ContactState

Point = str | int

# Part of the time in which straight lines between outputs may cut off peaks, beyond which numbers
# come with a warning.
_COARSE = 0.1


@dataclass(frozen=True)
class Summary:
    """A number of a run: the function that computes it from a run, and its unit."""

    function: Callable[..., float]
    unit: str

    @property
    def text(self) -> str:
        """Description for display."""
        return summary(self.function)


def duration(trajectory: Trajectory) -> float:
    """Time from the first to the last output [s]."""
    return float(trajectory.time[-1] - trajectory.time[0])


def coarse_note(trajectory: Trajectory) -> str:
    """How outputs too far apart may change numbers of a run; empty if it has kept enough."""
    found = resolved(trajectory)
    return found.note if found.coarse > _COARSE else ""


def _fine(trajectory: Trajectory) -> Trajectory:
    """The run with what it has kept between outputs that are too far apart."""
    if note := coarse_note(trajectory):
        warnings.warn(f"In this run there are {note}.", ModelWarning, stacklevel=3)
    return resolved(trajectory).trajectory


def _mean(trajectory: Trajectory, values: NDArray[Any]) -> float:
    return float(np.trapezoid(values, trajectory.time)) / duration(trajectory)


def _part(trajectory: Trajectory, state: ContactState) -> float:
    basis = trajectory.basis
    lengths = np.where(basis.spring_nodes, 0.0, basis.tributary)
    if not lengths.any():
        return float("nan")
    fine = _fine(trajectory)
    return _mean(fine, (fine.contact_state == state) @ lengths) / float(lengths.sum())


def largest_displacement(trajectory: Trajectory) -> float:
    """Largest displacement of B, C, the contact nodes and other named points at any time."""
    basis = trajectory.basis
    require_observed_motion(basis)
    rows = basis.T[basis.moving_points, : basis.dimension]
    moved = np.einsum("pkm,tm->tpk", rows, _fine(trajectory).modal_coordinates)
    if basis.dimension == 3:
        return float(np.linalg.norm(moved, axis=-1).max(initial=0.0))
    return float(np.hypot(moved[..., 0], moved[..., 1]).max(initial=0.0))


def amplitude_x(trajectory: Trajectory, point: Point | None = None) -> float:
    """Half the range of the displacement x of a point."""
    return 0.5 * float(np.ptp(_of_point(trajectory, point)[:, 0]))


def amplitude_y(trajectory: Trajectory, point: Point | None = None) -> float:
    """Half the range of the displacement y of a point."""
    return 0.5 * float(np.ptp(_of_point(trajectory, point)[:, 1]))


def amplitude_z(trajectory: Trajectory, point: Point | None = None) -> float:
    """Half the range of the displacement z of a point of a solid."""
    if trajectory.basis.dimension == 2:
        raise InputError("plane bodies do not move along z; take amplitude_x or amplitude_y.")
    return 0.5 * float(np.ptp(_of_point(trajectory, point)[:, 2]))


def rms_velocity(trajectory: Trajectory, point: Point | None = None) -> float:
    """Root mean square of the velocity of a point, of all directions together."""
    fine = _fine(trajectory)
    return float(np.sqrt(_mean(fine, (_velocity(fine, point) ** 2).sum(axis=1))))


def _velocity(trajectory: Trajectory, point: Point | None) -> Array:
    """Velocity (N, d) of a point [m/s]."""
    found = trajectory.velocity(usual_point(trajectory.basis) if point is None else point)
    return found[:, : trajectory.basis.dimension]


def _of_point(trajectory: Trajectory, point: Point | None) -> Array:
    return _fine(trajectory).displacement(
        usual_point(trajectory.basis) if point is None else point)


def stick_fraction(trajectory: Trajectory) -> float:
    """Fraction of time and contact length in stick."""
    return _part(trajectory, ContactState.STICK)


def slip_fraction(trajectory: Trajectory) -> float:
    """Fraction of time and contact length in slip."""
    return _part(trajectory, ContactState.SLIP)


def open_fraction(trajectory: Trajectory) -> float:
    """Fraction of time and contact length without contact."""
    return _part(trajectory, ContactState.OPEN)


def mean_normal_force(trajectory: Trajectory, face: str | None = None) -> float:
    """Mean over time of the sum of the normal forces, without those of nonlinear springs."""
    nodes = _nodes(trajectory, face)
    touching, fine = ~trajectory.basis.spring_nodes[nodes], _fine(trajectory)
    return _mean(fine, fine.normal_force[:, nodes][:, touching].sum(axis=1))


def peak_normal_force(trajectory: Trajectory, face: str | None = None) -> float:
    """Largest sum of the normal forces."""
    return float(_fine(trajectory).normal_force[:, _nodes(trajectory, face)].sum(axis=1).max())


def mean_friction_force(trajectory: Trajectory, face: str | None = None) -> float:
    """Mean over time of the sum of the friction forces; on the body they act in -x."""
    nodes, fine = _nodes(trajectory, face), _fine(trajectory)
    return _mean(fine, fine.friction_force[:, nodes].sum(axis=1))


def peak_friction_force(trajectory: Trajectory, face: str | None = None) -> float:
    """Largest magnitude of the sum of the friction forces, of solids of both directions."""
    total = _fine(trajectory).friction_forces[:, _nodes(trajectory, face)].sum(axis=1)
    return float(np.linalg.norm(total, axis=1).max())


def _nodes(trajectory: Trajectory, face: str | None) -> slice:
    """Contact nodes of an interface by its name; by default all of them."""
    if face is None:
        return slice(None)
    faces = {one.name: one.nodes for one in contact_faces(trajectory.basis) if one.name}
    if face not in faces:
        raise InputError(f"There is no interface '{face}'; " + (
            f"choose from {choices(faces)}." if faces else "the run has only one."))
    return faces[face]


def peak_line_load(trajectory: Trajectory) -> float:
    """Largest normal force per length of the contact face."""
    return float(_fine(trajectory).line_load.max())


def peak_pressure(trajectory: Trajectory) -> float:
    """Largest normal force per area of the contact face."""
    return float(_fine(trajectory).pressure.max())


def friction_power(trajectory: Trajectory) -> float:
    """Mean power lost by friction between body and ground."""
    return _power(trajectory, "friction")


def belt_power(trajectory: Trajectory) -> float:
    """Mean power supplied by the moving ground through friction and normal forces."""
    return _power(trajectory, "belt_friction") + _power(trajectory, "belt_normal")


def _power(trajectory: Trajectory, name: str) -> float:
    work = trajectory.work[:, POWERS.index(name)]
    return float(work[-1] - work[0]) / duration(trajectory)


def dominant_frequency(trajectory: Trajectory, point: Point | None = None) -> float:
    """Frequency of the largest peak in the spectrum of a point's velocity (Hann window)."""
    t = trajectory.time
    velocity = _velocity(trajectory, point)
    if len(t) < 8:
        raise InputError(f"the frequency needs at least 8 output times, not {len(t)}.")
    if not np.allclose(np.diff(t), t[1] - t[0], rtol=1e-6):
        raise InputError("the frequency needs equally spaced output times.")
    warn_of_aliases(trajectory)
    window = np.hanning(len(t))[:, None]
    if not np.ptp(velocity, axis=0).any():
        return float("nan")
    size = np.abs(np.fft.rfft((velocity - velocity.mean(axis=0)) * window, axis=0))
    power = (size**2).sum(axis=1)
    k = int(np.argmax(power[1:-1])) + 1
    # The logarithm of a window's peak is close to a parabola.
    low, middle, high = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
    bend = low - 2.0 * middle + high
    shift = 0.5 * (low - high) / bend if bend < 0.0 else 0.0
    return float(k + shift) / (len(t) * float(t[1] - t[0]))


def periods(trajectory: Trajectory) -> float:
    """Number of drive periods, else of maxima, after which the run repeats; 0 if it does not."""
    from fecontact.analysis.periodicity import periodicity

    found = periodicity(trajectory, t_start=float(trajectory.time[0]))
    return float(found.periods or 0)


def end_time(trajectory: Trajectory) -> float:
    """Time at which the run ended, on schedule or at an event."""
    return float(trajectory.time[-1])


def energy_imbalance(trajectory: Trajectory) -> float:
    """Error of the energy balance relative to the largest energy in it."""
    return trajectory.energies.imbalance


RUN_SUMMARIES: Mapping[str, Summary] = {
    function.__name__: Summary(function, unit) for function, unit in (
        (largest_displacement, "m"), (amplitude_x, "m"), (amplitude_y, "m"), (amplitude_z, "m"),
        (rms_velocity, "m/s"), (stick_fraction, ""), (slip_fraction, ""), (open_fraction, ""),
        (mean_normal_force, "N"), (peak_normal_force, "N"), (mean_friction_force, "N"),
        (peak_friction_force, "N"), (peak_line_load, "N/m"), (peak_pressure, "Pa"),
        (friction_power, "W"), (belt_power, "W"), (dominant_frequency, "Hz"), (periods, ""),
        (end_time, "s"), (energy_imbalance, ""),
    )
}
