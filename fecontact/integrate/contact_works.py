"""Losses of the contact nodes over a run."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.integrate.recorded import RecordedContact
from fecontact.laws.wear import WearLaw
from fecontact.system import columns
from fecontact.system.contact_quantities import ContactQuantities, ContactState


@read_only_arrays
class ContactWorks(ContactQuantities):
    """Contact quantities (N, n) at the times of a run, and what friction has lost until then."""

    time: Array
    node_friction_work: Array | None
    node_creep_work: Array | None
    held_normal_force: Array | None
    held_friction_force: Array | None
    recorded: RecordedContact | None

    @property
    def states(self) -> Array:
        """States y = [q, q', z] (N, 2 m + n s)."""
        raise NotImplementedError

    @cached_property
    def _contact(self) -> Array:
        history = self.system.contact_history(self.time, self.states)
        if self.held_normal_force is not None:
            history[:, :, columns.NORMAL_FORCE] = self.held_normal_force
        if self.held_friction_force is not None:
            both = self._columns(columns.FRICTION_FORCE, columns.FRICTION_ACROSS)
            held = self.held_friction_force
            history[:, :, both] = held.reshape(*held.shape[:2], len(both))
        return history

    def _column(self, column: int) -> Array:
        if self.recorded is not None and column in self.recorded.contact:
            return self.recorded.contact[column]
        return super()._column(column)

    @cached_property
    def contact_state(self) -> NDArray[np.int8]:
        """State (N, n) of the contact nodes, values of :class:`ContactState`.

        Open without normal force; sticking below the slip velocity of largest friction.
        """
        if self.recorded is not None and self.recorded.contact_state is not None:
            return self.recorded.contact_state
        return super().contact_state

    @cached_property
    def modal_accelerations(self) -> Array:
        """Rates q'' (N, m) of the modal velocities under all forces.

        InputError for set-valued contact, whose forces do not follow from the state.
        """
        if self.held_normal_force is not None or self.held_friction_force is not None:
            raise InputError("The accelerations of a run with set-valued contact are not known, as "
                             "its forces and impulses do not follow from the state; take the "
                             "velocity, or a normal and a friction law.")
        rates = [self.system.rhs(t, y) for t, y in zip(self.time, self.states, strict=True)]
        m = self.basis.modes
        return np.stack(rates)[:, m : 2 * m]

    @property
    def friction_work(self) -> Array:
        """Energy (N, n) lost by friction at each node since the first time [J].

        Energy that bristles store is not part of it. From the integrator if stored, else by
        the trapezoidal rule over the output times.
        """
        if self.node_friction_work is not None:
            return self.node_friction_work
        storing = self._bristles[1]
        return self._summed(self.slip_power - storing)

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
        return self._summed(np.where(stick, self.slip_power, 0.0))

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

    def wear_depth(self, law: WearLaw, thickness: float | None = None) -> Array:
        """Depth (N, n) worn off the body in slip at each node since the first time [m].

        ``law`` is an EnergyWear or ArchardWear, ``thickness`` that of the face of a plane body out
        of the plane [m]. Raises InputError for anything else, or a thickness that is not above
        zero.
        """
        require_kind("wear_depth", WearLaw, law=law)
        if self.basis.dimension == 3:
            if thickness is not None:
                raise InputError(f"wear_depth: thickness = {thickness!r} is for plane bodies; "
                                 f"leave it out for a solid.")
            thickness = 1.0
        elif thickness is None:
            raise InputError("wear_depth: give thickness, that of the plane body's face [m].")
        require_positive("wear_depth", thickness=thickness)
        fine = self._finest
        slips = fine.contact_state == ContactState.SLIP
        power = fine.slip_power - fine._bristles[1]
        pressed = np.abs(fine.normal_force) * np.linalg.norm(fine.slip_velocities, axis=-1)
        outputs = np.searchsorted(fine.time, self.time)
        lost, rubbed = (fine._summed(np.where(slips, one, 0.0))[outputs]
                        for one in (power, pressed))
        return law.volume(self.slip_work, lost, rubbed) / (self.basis.tributary * thickness)

    @property
    def _finest(self) -> "ContactWorks":
        """The run with all times at which its motion is known."""
        return self
