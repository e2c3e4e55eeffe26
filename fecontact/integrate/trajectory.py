"""Results of a run: modal histories and quantities derived from them."""

from dataclasses import dataclass, field, replace
from enum import Enum, IntEnum
from functools import cached_property
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.core.types import Array
from fecontact.core.units import Summarised, quantity
from fecontact.integrate.events import Events
from fecontact.laws.wear import WearLaw
from fecontact.system import kernels as kernels
from fecontact.system.contact_system import ContactSystem
from fecontact.system.powers import POWERS


class Status(Enum):
    """How a run ended; the value is a sentence for display."""

    FINISHED = "The run reached its end."
    EVENT = "The run ended at an event."
    INTERRUPTED = "The run was interrupted; what was computed until then is kept."
    MINIMUM_STEP = ("The steps of the integrator became too small to go on; what was computed "
                    "until then is kept.")
    ENERGY_GREW = ("The stored energy grew by more than all work put in: a law or the tolerance is "
                   "at fault; see the energy balance.")
    NOT_FINITE = "The motion grew beyond all numbers; what was computed until then is kept."
    ENERGY_NOT_FINITE = ("Energies or forces of the run are beyond all numbers, so that nothing "
                         "can be said of their balance: a speed, a load or a stiffness is far out "
                         "of range.")
    PARADOX = "Rigid stops with friction have no acceleration, or several (Painleve's paradox)."
    IMPACT_UNSOLVED = "No impulses meet the conditions of an impact with friction."
    IMPACT_GAINED = "An impact gained energy: use equal restitutions, or impact_law = 'poisson'."
    FAILED = "The integrator could not go on; what was computed until then is kept."


class ContactState(IntEnum):
    """State of a contact node."""

    OPEN = 0
    STICK = 1
    SLIP = 2


@dataclass(frozen=True, eq=False)
class Energies:
    """Energies, work put in and energy lost, each (N,) [J]; work and losses count from the start.

    ``stored - stored[0] = work - lost`` up to the integrator's error, see :attr:`imbalance`.

    Attributes
    ----------
    kinetic, elastic, drive_spring, contact, bristles : (N,) arrays
        Stored: in motion, in the modes (by the symmetric part of their stiffness, for a body that
        rotates with the potential of centrifugal forces on its displacements), in the springs at
        B, in the contact, in the internal variables of friction.
    drive_work, belt_normal_work, belt_friction_work, load_work, circulatory_work : (N,) arrays
        Put in: by the driven ends of the springs at B, by the normal forces and by the friction
        of the moving ground, by the loads, by stiffness that is not symmetric. With
        ``ground.normal = "vertical"`` the normal forces of waves at rest do work too.
    bristle_work : (N,) array
        Put in by normal forces that change the stiffness of the bristles.
    modal_damping, dashpots, contact_damping, friction : (N,) arrays
        Lost: in the modes, in the dashpots at B, in the contact's normal damping, by friction
        between body and ground.
    """

    kinetic: Array
    elastic: Array
    drive_spring: Array
    contact: Array
    bristles: Array
    drive_work: Array
    belt_normal_work: Array
    belt_friction_work: Array
    load_work: Array
    circulatory_work: Array
    bristle_work: Array
    modal_damping: Array
    dashpots: Array
    contact_damping: Array
    friction: Array

    @property
    def stored(self) -> Array:
        """Kinetic energy and all stored energy [J]."""
        return self.kinetic + self.elastic + self.drive_spring + self.contact + self.bristles

    @property
    def work(self) -> Array:
        """All work put in [J]."""
        return (self.drive_work + self.belt_normal_work + self.belt_friction_work + self.load_work
                + self.circulatory_work + self.bristle_work)

    @property
    def lost(self) -> Array:
        """All energy lost [J]."""
        return self.modal_damping + self.dashpots + self.contact_damping + self.friction

    @property
    def imbalance(self) -> float:
        """Largest ``|stored - stored[0] - work + lost|`` relative to the largest energy in it."""
        error = float(np.abs(self._unexplained).max())
        return error / self._scale if self._scale > 0.0 else 0.0

    @property
    def growth(self) -> float:
        """Largest ``stored - stored[0] - work + lost`` relative to the largest energy in it."""
        error = max(float(self._unexplained.max()), 0.0)
        return error / self._scale if self._scale > 0.0 else 0.0

    @property
    def _unexplained(self) -> Array:
        # Energies that overflow give NaN here, and a corresponding status.
        with np.errstate(over="ignore", invalid="ignore"):
            return self.stored - self.stored[0] - self.work + self.lost

    @property
    def _scale(self) -> float:
        terms = [getattr(self, name) for name in self.__dataclass_fields__]
        return max(float(np.abs(term).max()) for term in terms)


@dataclass(frozen=True, eq=False)
class Solution:
    """Results of a solver at N output times; of a run that ended early, also the last state.

    Attributes
    ----------
    time : (N,) array
        [s].
    states : (N, 2 m + n s) array
        y = [q, q', z].
    work : (N, p) array
        Integrals of the powers :data:`fecontact.system.powers.POWERS` from the first time
        [J]. Energy lost in impacts on rigid stops is part of ``contact_damping``.
    status : Status
        How the run ended.
    statistics : mapping
        Numbers of steps, rejected steps, events and so on, seconds, message of the solver.
    node_friction_work, node_creep_work : (N, n) arrays or None
        Energy dissipated by friction at each node since the first time, and the part of it that
        is lost in stick, by the creep of smoothed friction [J].
    normal_force, friction_force : (N, n) arrays or None
        F and R of each node [N] if they do not follow from the state, as in set-valued contact;
        F without the impulses of rigid stops.
    events : Events or None
        Located events in chronological order.
    """

    time: Array
    states: Array
    work: Array
    status: Status
    statistics: dict[str, Any]
    node_friction_work: Array | None = None
    node_creep_work: Array | None = None
    normal_force: Array | None = None
    friction_force: Array | None = None
    events: Events | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Summarised):
    """Motion of a contact system at N output times.

    Attributes
    ----------
    system : ContactSystem
    time : (N,) array
        [s].
    modal_coordinates, modal_velocities : (N, m) arrays
        q and q'.
    work : (N, p) array
        Integrals of the powers :data:`fecontact.system.powers.POWERS` from the first time
        [J].
    status : Status
        How the run ended.
    statistics : mapping
        Counts of the integrator: steps, right-hand sides, Jacobians, factorisations; seconds.
    memory : (N, n s) array or None
        Internal variables z of friction with memory, node by node; None without memory.
    node_friction_work, node_creep_work : (N, n) arrays or None
        Energy lost by friction at each node, and the part of it in stick [J], if the integrator
        stores them; see :attr:`friction_work` and :attr:`creep_work`.
    held_normal_force, held_friction_force : (N, n) arrays or None
        Forces of set-valued contact [N], which do not follow from the state; None if laws give the
        forces.
    events : Events or None
        Located events in chronological order; None if none were requested.
    """

    system: ContactSystem
    time: Array
    modal_coordinates: Array
    modal_velocities: Array
    work: Array
    status: Status = Status.FINISHED
    statistics: dict[str, Any] = field(default_factory=dict)
    memory: Array | None = None
    node_friction_work: Array | None = None
    node_creep_work: Array | None = None
    held_normal_force: Array | None = None
    held_friction_force: Array | None = None
    events: Events | None = None

    def summary(self) -> list[tuple[str, str]]:
        """Status, time span and system; nothing that is costly to compute."""
        steps = self.statistics.get("steps")
        facts = [
            ("status", self.status.name.lower().replace("_", " ")),
            ("time", f"{quantity(float(self.time[0]), 's', 5)} ... "
                     f"{quantity(float(self.time[-1]), 's', 5)}"),
            ("outputs", f"{len(self.time)}"),
            *([] if steps is None else [("steps", f"{steps}")]),
            *([] if self.events is None else [("events", f"{len(self.events.time)}")]),
        ]
        return [*facts, *(row for row in self.system.summary()
                          if row[0] not in ("sliding", "ground", "drive", "load"))]

    @property
    def states(self) -> Array:
        """States y = [q, q', z] (N, 2 m + n s)."""
        return np.hstack([self.modal_coordinates, self.modal_velocities,
                          *(() if self.memory is None else (self.memory,))])

    def between(self, t_start: float | None = None, t_end: float | None = None) -> "Trajectory":
        """Part of the run with the output times from ``t_start`` to ``t_end``, both included.

        Work and losses count from the first of them, as in a run that started there.

        Parameters
        ----------
        t_start, t_end : float, optional
            [s]; by default the ends of the run.

        Raises
        ------
        InputError
            If there are fewer than two output times between them.
        """
        t = self.time
        for name, value in (("t_start", t_start), ("t_end", t_end)):
            if value is not None and not (isinstance(value, Real) and value == value):
                raise InputError(f"{name} = {value!r} must be a time of the run.")
        first = float(t[0]) if t_start is None else float(t_start)
        last = float(t[-1]) if t_end is None else float(t_end)
        rounding = 1e-12 * max(abs(float(t[0])), abs(float(t[-1])))
        begin = int(np.searchsorted(t, first - rounding, side="left"))
        chosen = slice(begin, int(np.searchsorted(t, last + rounding, side="right")))
        if chosen.stop - begin < 2:
            raise InputError(f"There are fewer than two output times from t_start = {first:g} s to "
                             f"t_end = {last:g} s; the run goes from {t[0]:g} s to {t[-1]:g} s.")
        kept: dict[str, Any] = {
            name: values[chosen]
            for name in ("time", "modal_coordinates", "modal_velocities", "memory",
                         "held_normal_force", "held_friction_force")
            if (values := getattr(self, name)) is not None}
        counted: dict[str, Any] = {
            name: values[chosen] - values[begin]
            for name in ("work", "node_friction_work", "node_creep_work")
            if (values := getattr(self, name)) is not None}
        return replace(self, **kept, **counted)

    def displacement(self, point: str | int | tuple[float, float]) -> Array:
        """Displacement x, y [m] and rotation phi [rad] (N, 3) of a point.

        Parameters
        ----------
        point : str, int or (x, y)
            'B', 'C' or a further named point; a contact node by its number from 0; or the
            displacement node of the body nearest to a place (then without phi: (N, 2)).
        """
        return self.modal_coordinates @ self._rows(point).T

    def velocity(self, point: str | int | tuple[float, float]) -> Array:
        """Velocity [m/s] and angular velocity [rad/s] (N, 3) of a point; see displacement."""
        return self.modal_velocities @ self._rows(point).T

    def _rows(self, point: str | int | tuple[float, float]) -> Array:
        basis = self.system.basis
        if isinstance(point, str | int | np.integer):
            return basis.T[basis.point_index(point if isinstance(point, str) else int(point))]
        if basis.mode_shapes is None:
            raise InputError(f"The point {point} cannot be found: the modal basis holds no mode "
                             f"shapes; use a named point or a contact node.")
        distance = np.linalg.norm(basis.mode_shapes.nodes - np.asarray(point, dtype=float), axis=1)
        nearest_node = int(np.argmin(distance))
        reach = np.ptp(basis.mode_shapes.nodes, axis=0).max()
        if distance[nearest_node] > 0.1 * reach:
            raise InputError(f"The point {point} lies outside the body, {distance.min():.3g} m "
                             f"away from it.")
        return basis.mode_shapes.shapes[nearest_node]

    @cached_property
    def _contact(self) -> Array:
        history = self.system.contact_history(self.time, self.states)
        for column, held in ((kernels.NORMAL_FORCE, self.held_normal_force),
                             (kernels.FRICTION_FORCE, self.held_friction_force)):
            if held is not None:
                history[:, :, column] = held
        return history

    @property
    def normal_force(self) -> Array:
        """Normal forces F (N, n) on the body, zero or above [N]."""
        return self._contact[:, :, kernels.NORMAL_FORCE]

    @property
    def friction_force(self) -> Array:
        """Friction forces R (N, n); on the body they act in -x [N]."""
        return self._contact[:, :, kernels.FRICTION_FORCE]

    @property
    def penetration(self) -> Array:
        """Penetrations u (N, n), negative where open [m]."""
        return self._contact[:, :, kernels.PENETRATION]

    @property
    def penetration_rate(self) -> Array:
        """Rates u' (N, n) of the penetrations, positive towards the ground [m/s]."""
        return self._contact[:, :, kernels.PENETRATION_RATE]

    @property
    def slip_velocity(self) -> Array:
        """Slip velocities (N, n) of the body relative to the ground [m/s]."""
        return self._contact[:, :, kernels.SLIP_VELOCITY]

    @property
    def friction_work(self) -> Array:
        """Energy (N, n) lost by friction at each node since the first time [J].

        What bristles store and give back is not part of it. From the integrator if stored, else by
        the trapezoidal rule over the output times.
        """
        if self.node_friction_work is not None:
            return self.node_friction_work
        storing = self._bristles[1]
        return self._summed(self.friction_force * self.slip_velocity - storing)

    @property
    def creep_work(self) -> Array:
        """Part (N, n) of :attr:`friction_work` that is lost in stick [J].

        Smoothed friction creeps where a rough surface rests; that wears nothing. Zero for friction
        with memory. From the integrator if stored, else by the trapezoidal rule.
        """
        if self.node_creep_work is not None:
            return self.node_creep_work
        if self.held_friction_force is not None:
            return np.zeros_like(self.friction_force)
        stick = (self.contact_state == ContactState.STICK) & (self.system.arrays.memory == 0)
        return self._summed(np.where(stick, self.friction_force * self.slip_velocity, 0.0))

    def _summed(self, power: Array) -> Array:
        """Integral (N, n) of powers (N, n) from the first time by the trapezoidal rule."""
        steps = 0.5 * np.diff(self.time)[:, None] * (power[1:] + power[:-1])
        return np.vstack([np.zeros(power.shape[1]), np.cumsum(steps, axis=0)])

    @cached_property
    def _bristles(self) -> tuple[Array, Array]:
        """Energy (N, n) that the internal variables store [J], and the power into it [W]."""
        return self.system.bristle_energy(self.time, self.states)

    @property
    def slip_work(self) -> Array:
        """Energy (N, n) lost by friction in slip since the first time [J]; it never falls."""
        return np.asarray(np.maximum.accumulate(self.friction_work - self.creep_work, axis=0))

    def wear_depth(self, law: WearLaw, thickness: float) -> Array:
        """Depth (N, n) worn off the body in slip at each node since the first time [m].

        ``law`` is an EnergyWear or ArchardWear, ``thickness`` that of the face out of the plane
        [m]. Raises InputError for anything else, or a thickness that is not above zero.
        """
        require_kind("wear_depth", WearLaw, law=law)
        require_positive("wear_depth", thickness=thickness)
        slips = self.contact_state == ContactState.SLIP
        power = self.friction_force * self.slip_velocity - self._bristles[1]
        pressed = np.abs(self.normal_force * self.slip_velocity)
        volume = law.volume(self.slip_work, np.where(slips, power, 0.0),
                            np.where(slips, pressed, 0.0))
        return volume / (self.system.basis.tributary * thickness)

    @property
    def line_load(self) -> Array:
        """Normal force per length of the contact face (N, n) [N/m]."""
        return self.normal_force / self.system.basis.tributary

    @property
    def pressure(self) -> Array:
        """Normal force per area (N, n) [Pa]; InputError if the basis has no thickness."""
        return self.normal_force / self.system.basis.contact_areas

    @cached_property
    def contact_state(self) -> NDArray[np.int8]:
        """State (N, n) of the contact nodes, values of :class:`ContactState`.

        Open without normal force; sticking below the slip velocity of largest friction.
        """
        stick = self.system.sticks(self.slip_velocity, self.normal_force, self.friction_force)
        state = np.where(stick, ContactState.STICK, ContactState.SLIP)
        return np.where(self.normal_force != 0.0, state, ContactState.OPEN).astype(np.int8)

    @cached_property
    def limits_exceeded(self) -> tuple[str, ...]:
        """Messages about states outside the range of validity of the model.

        Displacements beyond the body's size, penetrations beyond a hundred times the roughness
        height; :func:`fecontact.simulate` issues a ModelWarning for each.
        """
        from fecontact.system.model_limits import limits_exceeded

        return limits_exceeded(self.system, self.time, self.states)

    @cached_property
    def energies(self) -> Energies:
        """Energies, work and losses of the run; not finite where they overflow."""
        with np.errstate(over="ignore", invalid="ignore"):
            return self._energies()

    def _energies(self) -> Energies:
        system, basis = self.system, self.system.basis
        drive, t = system.drive, self.time
        q, rate = self.modal_coordinates, self.modal_velocities
        spring = np.zeros(len(t))
        for axis, c in ((0, drive.stiffness_x), (1, drive.stiffness_y)):
            motion = drive.motions[axis]
            ends = motion.history(t)[:, 0]
            spring += 0.5 * c * (q @ basis.T[0, axis] - ends) ** 2
        bristles = self._bristles[0].sum(axis=1)
        put = dict(zip(POWERS, self.work.T, strict=True))
        return Energies(
            kinetic=0.5 * (rate**2).sum(axis=1),
            elastic=0.5 * ((q @ basis.stiffness_matrix) * q).sum(axis=1),
            drive_spring=spring,
            contact=system.stored_energy(self.penetration),
            bristles=bristles,
            bristle_work=bristles - bristles[0] - put["bristles"],
            **{f"{name}_work": put[name] for name in ("drive", "belt_normal", "belt_friction",
                                                      "load", "circulatory")},
            **{name: put[name] for name in ("modal_damping", "dashpots", "contact_damping",
                                            "friction")},
        )
