"""Impacts: contact phases with impulse, energy taken and velocities; rest after chatter."""

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.analysis.contact_phases import ContactMotion, Nodes
from fecontact.analysis.periodicity import drive_period
from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError, require_not_negative, require_positive
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory

# Gauss-Lobatto points and weights on [0, 1]; they include the ends, needed for the peak force.
_PARTS = 0.5 + 0.5 * np.array([-1.0, -math.sqrt(3.0 / 7.0), 0.0, math.sqrt(3.0 / 7.0), 1.0])
_WEIGHTS = np.array([0.05, 49.0 / 180.0, 16.0 / 45.0, 49.0 / 180.0, 0.05])


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Impacts:
    """Contact phases in the order of their touch-down, each (k,).

    Values at touch-down are NaN for a phase that began before the run, values at lift-off for one
    that continues beyond its end.

    Attributes
    ----------
    touch_down, lift_off : (k,) arrays
        Times at which the normal force begins and first returns to zero [s].
    impact_velocity, separation_velocity : (k,) arrays
        Approach velocity at touch-down and separation velocity at lift-off [m/s]; the mean over
        the face for several nodes.
    peak_force : (k,) array
        Largest total normal force [N].
    impulse : (k,) array
        Integral of the total normal force [N s].
    energy_taken : (k,) array
        Energy that the normal contact takes from the motion and does not give back by the end of
        the phase [J]: the integral of the sum of F u' over the nodes. For one mass m that strikes
        at v and leaves at e v it is ``m v^2 (1 - e^2) / 2``, and the impulse ``m (1 + e) v``.
    """

    touch_down: Array
    lift_off: Array
    impact_velocity: Array
    separation_velocity: Array
    peak_force: Array
    impulse: Array
    energy_taken: Array

    def __len__(self) -> int:
        return len(self.touch_down)

    def __getitem__(self, chosen: slice | NDArray[np.bool_] | NDArray[np.intp]) -> "Impacts":
        return Impacts(*(getattr(self, entry.name)[chosen] for entry in fields(self)))

    @property
    def duration(self) -> Array:
        """Duration (k,) of the contact [s]."""
        return self.lift_off - self.touch_down

    @property
    def restitution(self) -> Array:
        """Separation velocity over impact velocity (k,): 1 for an elastic impact of one mass.

        It is a ratio of means over the face, not one of energies: for an elastic body it may
        exceed 1, even where the contact takes energy, as vibration returns what earlier impacts
        put into it. Impulse and :attr:`energy_taken` describe such an impact.
        """
        return self.separation_velocity / self.impact_velocity

    def per_period(self, period: float, t_start: float, t_end: float) -> NDArray[np.intp]:
        """Number of touch-downs in each whole period [s] from ``t_start`` to ``t_end`` [s]."""
        require_positive("per_period", period=period)
        count = int((t_end - t_start) / period * (1.0 + 1e-9))
        if count < 1:
            raise InputError(f"t_end = {t_end!r} must be at least one period of {period!r} s after "
                             f"t_start = {t_start!r}.")
        edges = t_start + period * np.arange(count + 1)
        return np.asarray(np.histogram(self.touch_down, edges)[0])


class Rest(NamedTuple):
    """Rest after chatter: a lasting contact with vanishing velocity.

    Attributes
    ----------
    touch_down : float
        Touch-down of the lasting contact [s].
    at_rest : float
        Time from which the velocity stays small [s].
    lift_off : float
        End of the contact [s]; NaN if the run ends before.
    impacts : int
        Number of touch-downs since the previous rest or the start of the run, including that of
        the lasting contact.
    """

    touch_down: float
    at_rest: float
    lift_off: float
    impacts: int


def find_impacts(
    trajectory: Trajectory, nodes: Nodes = None, *, shortest_flight: float = 0.0
) -> Impacts:
    """Contact phases of a run.

    Touch-down and lift-off are located between output times by the normal force of the law, with
    errors of third order in the output interval.

    Parameters
    ----------
    trajectory : Trajectory
        A run with several output times in each contact.
    nodes : int, str or None
        Number of a contact node, name of an interface, or None for all nodes. A face is in
        contact while any of its nodes is.
    shortest_flight : float
        Phases separated by less than this time are merged [s].

    Raises
    ------
    InputError
        For nodes that do not exist, a negative time, a run with rigid stops, or normal laws that
        press and pull and never open.
    AnalysisError
        If a whole contact lies between two output times; more outputs are needed.
    """
    require_kind("find_impacts", Trajectory, trajectory=trajectory)
    require_not_negative("find_impacts", shortest_flight=shortest_flight)
    motion = ContactMotion.of(trajectory, nodes)
    motion.require_openings("find_impacts")
    touching = (motion.force != 0.0).any(axis=1)
    _require_resolved(motion, touching)
    found = motion.switches
    rate, down = found.rate @ motion.weights, found.down
    # A phase cut by an end of the run is NaN there.
    head = [np.nan] if touching[0] else []
    tail = [np.nan] if touching[-1] else []
    begins, ends = np.append(head, found.time[down]), np.append(found.time[~down], tail)
    begin_rate, end_rate = np.append(head, rate[down]), np.append(rate[~down], tail)

    phase, pieces = motion.pieces()
    part = np.broadcast_to(_PARTS, (len(phase), len(_PARTS)))
    penetration, velocity = pieces.between(part)
    node_force = motion.law_force(penetration, velocity)
    force, power = node_force.sum(axis=-1), (node_force * velocity).sum(axis=-1)
    impulse, energy, peak = np.zeros((3, len(begins)))
    np.add.at(impulse, phase, (pieces.t1 - pieces.t0) * (force @ _WEIGHTS))
    np.add.at(energy, phase, (pieces.t1 - pieces.t0) * (power @ _WEIGHTS))
    # The force of a two-sided stop may be of either sign.
    np.maximum.at(peak, phase, np.abs(force).max(axis=1, initial=0.0))
    side = np.where(impulse < 0.0, -1.0, 1.0)
    phases = Impacts(begins, ends, side * begin_rate, -side * end_rate, peak, np.abs(impulse),
                     energy)
    return _joined(phases, shortest_flight)


def find_rests(
    trajectory: Trajectory,
    nodes: Nodes = None,
    *,
    longer_than: float | None = None,
    slower_than: float = 0.1,
    shortest_flight: float = 0.0,
) -> list[Rest]:
    """Find where a run comes to rest on the ground or a stop, as after chatter.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    nodes : int, str or None
        See :func:`find_impacts`.
    longer_than : float, optional
        Minimum duration of the contact [s]; a tenth of the drive period by default.
    slower_than : float
        Velocity limit at rest, as a fraction of the largest impact velocity of the run.
    shortest_flight : float
        See :func:`find_impacts`.

    Raises
    ------
    InputError, AnalysisError
        As in :func:`find_impacts`, and for a run without a drive if ``longer_than`` is not given.
    """
    require_kind("find_rests", Trajectory, trajectory=trajectory)
    require_positive("find_rests", slower_than=slower_than)
    if longer_than is None:
        longer_than = 0.1 * drive_period(trajectory.system)
    require_positive("find_rests", longer_than=longer_than)
    impacts = find_impacts(trajectory, nodes, shortest_flight=shortest_flight)
    motion = ContactMotion.of(trajectory, nodes)
    speed = np.abs(motion.rate @ motion.weights)
    fast = slower_than * np.nanmax(impacts.impact_velocity, initial=0.0)
    rests: list[Rest] = []
    before = 0
    for number, (begin, end) in enumerate(zip(impacts.touch_down, impacts.lift_off, strict=True)):
        first = motion.time[0] if np.isnan(begin) else begin
        last = motion.time[-1] if np.isnan(end) else end
        inside = np.flatnonzero((motion.time >= first) & (motion.time <= last))
        # A contact that ends in lift-off has a velocity at its end: use the first half only.
        half = inside[motion.time[inside] <= 0.5 * (first + last)]
        moving = half[speed[half] > fast]
        if last - first <= longer_than or (len(moving) and moving[-1] == half[-1]):
            continue
        settled = motion.time[moving[-1] + 1] if len(moving) else first
        rests.append(Rest(float(begin), float(settled), float(end), number + 1 - before))
        before = number + 1
    return rests


def _require_resolved(motion: ContactMotion, touching: NDArray[np.bool_]) -> None:
    """Raise if a node must have been in contact between two output times without contact.

    Its velocity reverses from approach to separation by a change that the accelerations at both
    outputs do not explain, and free flight from the first output would reach the ground.
    """
    free = ~(touching[1:] | touching[:-1])[:, None]
    turns = free & (motion.rate[:-1] > 0.0) & (motion.rate[1:] < 0.0)
    index = np.flatnonzero(turns.any(axis=1))
    step = np.diff(motion.time)[index, None]
    v0, v1 = motion.rate[index], motion.rate[index + 1]
    a0, a1 = motion.acceleration(index), motion.acceleration(index + 1)
    change = v1 - v0
    reached = motion.penetration[index] + step * (v0 + 0.5 * step * np.minimum(a0, 0.0))
    hidden = turns[index] & (reached > 0.0) & (
        np.abs(change - 0.5 * step * (a0 + a1)) > 0.5 * np.abs(change))
    if hidden.any():
        first = index[np.flatnonzero(hidden.any(axis=1))[0]]
        begin, end = motion.time[first : first + 2]
        raise AnalysisError(
            f"A contact began and ended between the output times {begin:.6g} and {end:.6g} s, "
            f"{end - begin:.3g} s apart; run with more outputs, at least ten in the "
            f"shortest contact.")


def _joined(impacts: Impacts, shortest_flight: float) -> Impacts:
    """Merge phases separated by less than ``shortest_flight``."""
    if len(impacts) < 2 or shortest_flight <= 0.0:
        return impacts
    apart = impacts.touch_down[1:] - impacts.lift_off[:-1] >= shortest_flight
    first = np.concatenate([[0], np.flatnonzero(apart) + 1])
    last = np.append(first[1:] - 1, len(impacts) - 1)
    return Impacts(
        impacts.touch_down[first], impacts.lift_off[last], impacts.impact_velocity[first],
        impacts.separation_velocity[last], np.maximum.reduceat(impacts.peak_force, first),
        np.add.reduceat(impacts.impulse, first), np.add.reduceat(impacts.energy_taken, first))
