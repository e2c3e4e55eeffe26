"""Results of a run: modal histories and quantities derived from them."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from functools import cached_property
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised, quantity
from fecontact.integrate.contact_works import ContactWorks
from fecontact.integrate.event_table import Events
from fecontact.integrate.kept_steps import KeptSteps
from fecontact.integrate.recorded import RecordedContact
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.columns import POWERS

if TYPE_CHECKING:
    from fecontact.system.contact_system import ContactSystem


class Status(Enum):
    """End of a run; the value is a sentence for display."""

    FINISHED = "The run reached its end."
    EVENT = "The run ended at an event."
    INTERRUPTED = "The run was interrupted; what was computed until then is kept."
    MINIMUM_STEP = ("The steps of the integrator became too small to go on; what was computed "
                    "until then is kept.")
    ENERGY_GREW = ("The stored energy grew by more than all work put in: a law or the tolerance is "
                   "at fault; see the energy balance.")
    NOT_FINITE = "The motion is no longer finite; what was computed until then is kept."
    ENERGY_NOT_FINITE = ("Energies or forces of the run are not finite, and their balance is "
                         "unknown: a speed, a load or a stiffness is far out of range.")
    PARADOX = ("The contact conditions at rigid stops with friction have no solution for the "
               "accelerations, or several (Painleve's paradox).")
    IMPACT_UNSOLVED = "The conditions of an impact with friction have no solution for the impulses."
    IMPACT_GAINED = "An impact gained energy: use equal restitutions, or impact_law = 'poisson'."
    FAILED = "The integrator could not go on; what was computed until then is kept."


def output_part(t: Array, t_start: float | None, t_end: float | None) -> slice:
    """Output times from ``t_start`` to ``t_end``, both included; the ends of the run by default.

    Raises
    ------
    InputError
        If there are fewer than two output times between them.
    """
    for name, value in (("t_start", t_start), ("t_end", t_end)):
        if value is not None and not (isinstance(value, Real) and value == value):
            raise InputError(f"{name} = {value!r} must be a time of the run.")
    first = float(t[0]) if t_start is None else float(t_start)
    last = float(t[-1]) if t_end is None else float(t_end)
    rounding = 1e-12 * max(abs(float(t[0])), abs(float(t[-1])))
    chosen = slice(int(np.searchsorted(t, first - rounding, side="left")),
                   int(np.searchsorted(t, last + rounding, side="right")))
    if chosen.stop - chosen.start < 2:
        raise InputError(f"There are fewer than two output times from t_start = {first:g} s to "
                         f"t_end = {last:g} s; the run goes from {t[0]:g} s to {t[-1]:g} s.")
    return chosen


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Energies(Summarised):
    """Energies, work put in and energy lost, each (N,) [J]; work and losses count from the start.

    The change of ``stored`` since the first output is that of ``work - lost``, up to the
    integrator's error; see :attr:`imbalance`. The first output shows the state after an impact at
    the start, and ``lost`` what this impact took.

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
    rounding : float
        Largest error of the balance that rounding of forces and places may leave [J].
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
    rounding: float = 0.0

    @property
    def terms(self) -> dict[str, Array]:
        """All energies, works and losses by name, each (N,) [J]."""
        return {one.name: getattr(self, one.name) for one in fields(self)
                if one.name != "rounding"}

    def summary(self) -> list[tuple[str, str]]:
        """Stored energy at both ends, work and losses of the whole time, error of the balance."""
        first, last = (quantity(float(self.stored[k]), "J") for k in (0, -1))
        return [("stored", f"{first} at first, {last} at last"),
                ("work", quantity(float(self.work[-1]), "J")),
                ("lost", quantity(float(self.lost[-1]), "J")),
                ("imbalance", f"{self.imbalance:.2g}")]

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
        """Largest error of the balance of energies, relative to the largest energy in it.

        Zero within rounding.
        """
        return self._relative(float(np.abs(self._unexplained).max()))

    @property
    def growth(self) -> float:
        """Largest gain that the balance does not explain, relative to the largest energy in it."""
        return self._relative(max(float(self._unexplained.max()), 0.0))

    @property
    def _unexplained(self) -> Array:
        # Energies that overflow give NaN here, and a corresponding status.
        with np.errstate(over="ignore", invalid="ignore"):
            put_in = self.work - self.lost
            return self.stored - self.stored[0] - (put_in - put_in[0])

    def _relative(self, error: float) -> float:
        """Error [J] over the largest energy; 0 within rounding."""
        if error <= self.rounding < np.inf:
            return 0.0
        return error / max(float(np.abs(term).max()) for term in self.terms.values())


@read_only_arrays
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
        Integrals of the powers :data:`fecontact.system.columns.POWERS` from the first time
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
        F without the impulses of rigid stops. In space R is (N, n, 2), along both tangents.
    events : Events or None
        Located events in chronological order.
    kept : KeptSteps or None
        Motion between the outputs.
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
    kept: KeptSteps | None = None


_Run = TypeVar("_Run")


@dataclass(frozen=True, eq=False)
class StoredSystem:
    """The system of a run in a file: its basis, and a function that makes it."""

    basis: ModalBasis
    make: "Callable[[], ContactSystem]"


class _System:
    """The attribute ``system`` of a run; a stored one is made where it is first read."""

    def __get__(self, run: Any, owner: Any) -> Any:
        if run is None:
            return self
        given = vars(run)["system"]
        if isinstance(given, StoredSystem):
            given = vars(run)["system"] = given.make()
        return given

    def __set__(self, run: Any, given: Any) -> None:
        vars(run)["system"] = given


def _makes_stored_systems(run: type[_Run]) -> type[_Run]:
    """Let runs be made of a :class:`StoredSystem` too."""
    run.system = _System()  # type: ignore[attr-defined]
    return run


@read_only_arrays
@_makes_stored_systems
@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(ContactWorks, Summarised):
    """Motion of a contact system at N output times.

    Attributes
    ----------
    system : ContactSystem
    time : (N,) array
        [s].
    modal_coordinates, modal_velocities : (N, m) arrays
        q and q'.
    work : (N, p) array
        Integrals of the powers :data:`fecontact.system.columns.POWERS` from the first time
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
        Forces of set-valued contact [N], which do not follow from the state; friction of solids
        is (N, n, 2). None if laws give the forces.
    events : Events or None
        Located events in chronological order; None if none were requested.
    kept : KeptSteps or None
        Motion between the outputs, from which plots are drawn where these are far apart: one to
        twelve states of each step, as the method needs, of long runs at most 20,000 or 16 MB,
        evenly spread.
    recorded : RecordedContact or None
        Contact quantities that were read from a file in place of the laws.
    """

    system: "ContactSystem"
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
    kept: KeptSteps | None = None
    recorded: RecordedContact | None = None

    @property
    def basis(self) -> ModalBasis:
        """Modal basis of the system."""
        basis: ModalBasis = vars(self)["system"].basis
        return basis

    def with_rows(self, **changes: Any) -> "Trajectory":
        """The run with other values of these fields, which makes no stored system."""
        return replace(self, system=vars(self)["system"], **changes)

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

        Work and losses count from the first of them, as in a run that started there. Events
        are those from the first to the last of these times.

        Parameters
        ----------
        t_start, t_end : float, optional
            [s]; by default the ends of the run.

        Raises
        ------
        InputError
            If there are fewer than two output times between them.
        """
        chosen = output_part(self.time, t_start, t_end)
        kept: dict[str, Any] = {
            name: values[chosen]
            for name in ("time", "modal_coordinates", "modal_velocities", "memory",
                         "held_normal_force", "held_friction_force")
            if (values := getattr(self, name)) is not None}
        counted: dict[str, Any] = {
            name: values[chosen] - values[chosen.start]
            for name in ("work", "node_friction_work", "node_creep_work")
            if (values := getattr(self, name)) is not None}
        time = kept["time"]
        events = None if self.events is None else self.events.between(time[0], time[-1])
        recorded = None if self.recorded is None else self.recorded.rows(chosen)
        steps = self.kept
        if steps is not None:
            rows = (steps.time > time[0]) & (steps.time < time[-1])
            steps = steps.part(rows, self.work[chosen.start])
        return self.with_rows(**kept, **counted, events=events, kept=steps, recorded=recorded)

    def joined(self, kept: KeptSteps) -> "Trajectory":
        """The run with rows of what it has kept between its outputs.

        Friction work of the nodes is interpolated between outputs.
        """
        time = np.concatenate([self.time, kept.time])
        order = np.argsort(time, kind="stable")
        m, states = self.basis.modes, kept.states
        added = {"modal_coordinates": states[:, :m], "modal_velocities": states[:, m : 2 * m],
                 "memory": states[:, 2 * m :], "work": kept.work,
                 "held_normal_force": kept.normal_force,
                 "held_friction_force": kept.friction_force}
        columns: dict[str, Any] = {
            name: np.concatenate([values, added[name]])[order] for name in added
            if (values := getattr(self, name)) is not None}
        for name in ("node_friction_work", "node_creep_work"):
            if (values := getattr(self, name)) is not None:
                columns[name] = np.array([np.interp(time[order], self.time, column)
                                          for column in values.T]).reshape(-1, len(time)).T
        recorded = None if self.recorded is None else self.recorded.merged(kept, order)
        return self.with_rows(time=time[order], kept=None, recorded=recorded, **columns)

    @property
    def _finest(self) -> "Trajectory":
        return self if self.kept is None else self.joined(self.kept)

    @cached_property
    def limits_exceeded(self) -> tuple[str, ...]:
        """Messages about states outside the range of validity of the model.

        Displacements beyond the body's size, penetrations beyond a hundred times the roughness
        height; :func:`fecontact.simulate` issues a ModelWarning for each.
        """
        if self.recorded is not None and self.recorded.limits is not None:
            return self.recorded.limits
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
        for row, c, motion in zip(basis.T[0, : basis.dimension], drive.stiffness, drive.motions,
                                  strict=False):
            spring += 0.5 * c * (q @ row - motion.history(t)[:, 0]) ** 2
        elastic = 0.5 * ((q @ basis.stiffness_matrix) * q).sum(axis=1)
        if basis.large_deflections:
            from fecontact.system.polynomial_forces import polynomial_energy

            elastic += polynomial_energy(q, system.arrays)
        bristles = self._bristles[0].sum(axis=1)
        put = dict(zip(POWERS, self.work.T, strict=True))
        return Energies(
            kinetic=0.5 * (rate**2).sum(axis=1),
            elastic=elastic,
            drive_spring=spring,
            contact=self._contact_energy(),
            bristles=bristles,
            bristle_work=bristles - bristles[0] - put["bristles"],
            **{f"{name}_work": put[name] for name in ("drive", "belt_normal", "belt_friction",
                                                      "load", "circulatory")},
            **{name: put[name] for name in ("modal_damping", "dashpots", "contact_damping",
                                            "friction")},
            rounding=self._rounding(),
        )

    def _contact_energy(self) -> Array:
        if self.recorded is not None and self.recorded.energy is not None:
            return self.recorded.energy
        return self.system.stored_energy(self.penetration)

    def _rounding(self) -> float:
        """Energy that rounding of the largest modal forces p leaves undetermined [J].

        It is eps p (q + a), with the largest q of each modal displacement and what the force would
        move in the time T of the run, a = p min(T^2 / 2, 2 / w^2), and the energy of the contact at
        the rounding of places.
        """
        from fecontact.system.loads import load_rows

        system, basis, drive = self.system, self.basis, self.system.drive
        constant, shapes = load_rows(basis, system.load)
        force = np.abs(basis.centrifugal_load + constant)
        shown = basis.T[0, : basis.dimension]
        c = np.array(drive.stiffness[: basis.dimension], dtype=float)[:, None]
        for rows, signals in ((c * shown, drive.motions), (shapes, system.load.signals.values())):
            for row, signal in zip(rows, signals, strict=False):
                force = force + signal.largest * np.abs(row)
        stiffness = np.abs(np.diag(basis.stiffness_matrix) + (c * shown**2).sum(axis=0))
        compliance = np.full(len(force), 0.5 * float(self.time[-1] - self.time[0]) ** 2)
        np.divide(2.0, stiffness, out=compliance, where=compliance * stiffness > 2.0)
        eps, largest = np.finfo(float).eps, np.abs(self.modal_coordinates).max(axis=0)
        depth = eps * np.abs(basis.contact_T) @ largest
        moved = float(eps * force @ (largest + compliance * force))
        try:
            return moved + float(system.stored_energy(depth.max(axis=1)[None])[0])
        except InputError:
            # Without the laws, a stored run knows the energy at its own penetrations alone.
            return moved
