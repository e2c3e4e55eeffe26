"""Forces, slip and losses of the contact nodes in a run."""

from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.laws.wear import WearLaw
from fecontact.system import kernels
from fecontact.system.contact_system import ContactSystem


class ContactState(IntEnum):
    """State of a contact node."""

    OPEN = 0
    STICK = 1
    SLIP = 2


@read_only_arrays
class ContactQuantities:
    """What follows at the contact nodes from states, or is held by a run of set-valued contact."""

    system: ContactSystem
    time: Array
    node_friction_work: Array | None
    node_creep_work: Array | None
    held_normal_force: Array | None
    held_friction_force: Array | None

    @property
    def states(self) -> Array:
        """States y = [q, q', z] (N, 2 m + n s)."""
        raise NotImplementedError

    @cached_property
    def _contact(self) -> Array:
        history = self.system.contact_history(self.time, self.states)
        if self.held_normal_force is not None:
            history[:, :, kernels.NORMAL_FORCE] = self.held_normal_force
        if self.held_friction_force is not None:
            columns = self._columns(kernels.FRICTION_FORCE, kernels.FRICTION_ACROSS)
            held = self.held_friction_force
            history[:, :, columns] = held.reshape(*held.shape[:2], len(columns))
        return history

    @property
    def normal_force(self) -> Array:
        """Normal forces F (N, n) on the body, zero or above [N]."""
        return self._contact[:, :, kernels.NORMAL_FORCE]

    @property
    def friction_force(self) -> Array:
        """Friction forces R (N, n) along the first tangent; on the body they act in -x [N]."""
        return self._contact[:, :, kernels.FRICTION_FORCE]

    @property
    def friction_forces(self) -> Array:
        """Friction forces (N, n, 1), in space (N, n, 2), against the tangents [N]."""
        return self._contact[:, :, self._columns(kernels.FRICTION_FORCE, kernels.FRICTION_ACROSS)]

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
        """Slip velocities (N, n) relative to the ground, along the first tangent [m/s]."""
        return self._contact[:, :, kernels.SLIP_VELOCITY]

    @property
    def slip_velocities(self) -> Array:
        """Slip velocities (N, n, 1), in space (N, n, 2), along the tangents [m/s]."""
        return self._contact[:, :, self._columns(kernels.SLIP_VELOCITY, kernels.SLIP_ACROSS)]

    def _columns(self, along: int, across: int) -> list[int]:
        return [along] if self.system.basis.dimension == 2 else [along, across]

    @property
    def slip_power(self) -> Array:
        """Power (N, n) of the friction forces in the slip velocities [W]."""
        return np.asarray((self.friction_forces * self.slip_velocities).sum(axis=-1))

    @property
    def friction_work(self) -> Array:
        """Energy (N, n) lost by friction at each node since the first time [J].

        What bristles store and give back is not part of it. From the integrator if stored, else by
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
        if self.system.basis.dimension == 3:
            if thickness is not None:
                raise InputError(f"wear_depth: thickness = {thickness!r} is for plane bodies; "
                                 f"leave it out for a solid.")
            thickness = 1.0
        elif thickness is None:
            raise InputError("wear_depth: give thickness, that of the plane body's face [m].")
        require_positive("wear_depth", thickness=thickness)
        slips = self.contact_state == ContactState.SLIP
        power = self.slip_power - self._bristles[1]
        pressed = np.abs(self.normal_force) * np.linalg.norm(self.slip_velocities, axis=-1)
        volume = law.volume(self.slip_work, np.where(slips, power, 0.0),
                            np.where(slips, pressed, 0.0))
        return volume / (self.system.basis.tributary * thickness)

    @property
    def line_load(self) -> Array:
        """Normal force per length of a plane body's face (N, n) [N/m]; InputError for solids."""
        basis = self.system.basis
        if basis.dimension == 3:
            raise InputError("Line loads are those of plane bodies; take the pressure of a solid.")
        return self.normal_force / basis.tributary

    @property
    def pressure(self) -> Array:
        """Normal force per area (N, n) [Pa]; InputError if the basis has no thickness."""
        return self.normal_force / self.system.basis.contact_areas

    @cached_property
    def contact_state(self) -> NDArray[np.int8]:
        """State (N, n) of the contact nodes, values of :class:`ContactState`.

        Open without normal force; sticking below the slip velocity of largest friction.
        """
        slip, friction = self.slip_velocity, self.friction_force
        if self.system.basis.dimension == 3:
            slip, friction = (np.linalg.norm(both, axis=-1)
                              for both in (self.slip_velocities, self.friction_forces))
        stick = self.system.sticks(slip, self.normal_force, friction)
        state = np.where(stick, ContactState.STICK, ContactState.SLIP)
        return np.where(self.normal_force != 0.0, state, ContactState.OPEN).astype(np.int8)
