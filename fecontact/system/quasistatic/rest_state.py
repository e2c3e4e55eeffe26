"""A body at rest under friction: displacements, forces, and what its sliders remember."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, count, quantity
from fecontact.system.contact_quantities import total_friction
from fecontact.system.contact_system import ContactSystem
from fecontact.system.node_forces import normal_values
from fecontact.system.quasistatic.pose import (
    AGAINST,
    FORCE,
    PENETRATION,
    PER_TANGENT,
    PLACE,
    PRESSING,
    Sliders,
)
from fecontact.system.quasistatic.sliders import components

STATES = ("open", "stick", "slip")
OPEN, STICK, SLIP = range(len(STATES))
_KINDS = ("plane bodies", "solids")
# Relative distance from its limit at which a slider counts as sliding.
_AT_LIMIT = 1e-9
# Difference from the normal forces of a system, as a part of the largest one, that is rounding.
_SAME_FORCE = 1e-6
# Part of its limit by which a slider starts a run inside: at it, rounding would let it slide on.
_INSIDE = 1e-13


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ContactPoses:
    """Forces, slips and states of contact nodes in equilibria; of several with an axis (N, ...)."""

    modal_coordinates: Array
    given: Array
    node: Array
    slider_force: Array
    slider_place: Array
    sliders: Sliders

    @property
    def normal_force(self) -> Array:
        """F (n,) [N]."""
        return self.node[..., FORCE]

    @property
    def friction_force(self) -> Array:
        """R (n,), on the body in -x [N]; in space along the first tangent."""
        return self.friction_forces[..., 0]

    @property
    def friction_forces(self) -> Array:
        """Friction forces (n, 1), in space (n, 2), against the tangents [N]."""
        return self._forces.sum(axis=-2)

    @property
    def friction_limit(self) -> Array:
        """Largest friction force (n,) under the normal forces [N]."""
        return self.sliders.limit.sum(axis=-1) * self.node[..., PRESSING]

    @property
    def tangential_forces(self) -> Array:
        """Forces (n, 1), in space (n, 2), against the tangents, along the surface too [N]."""
        return self.node[..., AGAINST::PER_TANGENT]

    @property
    def slip(self) -> Array:
        """Displacement (n,) of each node relative to the ground along the first tangent [m]."""
        return self.node[..., PLACE]

    @property
    def slips(self) -> Array:
        """Displacements (n, 1), in space (n, 2), relative to the ground [m]."""
        return self.node[..., PLACE::PER_TANGENT]

    @property
    def travels(self) -> Array:
        """Travel (1,) of the ground along x, in space (2,) with that along y [m]."""
        return self.given[..., -self._forces.shape[-1] :]

    @property
    def at_limit(self) -> Any:
        """Whether each slider (n, e) is at its limit."""
        limit = self.sliders.limit * self.node[..., PRESSING, None]
        return np.linalg.norm(self._forces, axis=-1) >= (1.0 - _AT_LIMIT) * limit

    @property
    def contact_state(self) -> Integers:
        """State (n,) of each node: 0 open, 1 stick, 2 slip (all its sliders at their limits)."""
        return np.where(self.normal_force == 0.0, OPEN,
                        np.where(self.at_limit.all(axis=-1), SLIP, STICK)).astype(np.int64)

    @property
    def _forces(self) -> Array:
        return components(self.slider_force, self.node.ndim - 2)


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class RestState(ContactPoses, Summarised):
    """Equilibrium of a body at rest, which depends on how it was loaded.

    Attributes
    ----------
    modal_coordinates : (m,) array
        q.
    given : (m + 3,) array
        Modal forces of the loads, displacements of the driven ends of the springs at B in x and y
        [m], travel of the ground [m]; in space (m + 5,), with z and the travel along y.
    node : (n, 6) array
        F [N], the force that friction sees [N], penetration [m], place relative to the ground [m],
        force in -x [N] and its part that follows the surface [N]; in space (n, 9), the last three
        along the first tangent, then along the second one.
    slider_force, slider_place : (n, e) arrays
        R of the sliders of each node [N], and the place to which each has slid [m]; in space
        (n, e, 2), along the tangents.
    sliders : Sliders
        Stiffness [N/m] and limit, as a part of F, of each slider, and whether it sticks rigidly.
    """

    def summary(self) -> list[tuple[str, str]]:
        """Nodes by their state, normal and friction force."""
        states = self.contact_state
        return [
            ("nodes", ", ".join(f"{np.count_nonzero(states == code)} {name}"
                                for code, name in enumerate(STATES))),
            ("normal force", quantity(float(self.normal_force.sum()), "N", 4)),
            ("friction force", quantity(total_friction(self.friction_forces), "N", 4)),
            ("sliders", f"{count(self.slider_force.shape[1], 'slider')} per node"),
        ]

    @property
    def travel(self) -> float:
        """Travel of the ground along x, or of the interface that slides [m], [rad]."""
        return float(self.travels[0])

    @property
    def deflection(self) -> Array:
        """Deflections (n, e) of the springs of the sliders [m]; zero where sticking is rigid.

        In space (n, e, 2), along the tangents.
        """
        shape = self.slider_force.shape
        place = self.node[:, None, PLACE::PER_TANGENT].reshape(len(self.node), 1, *shape[2:])
        rigid = self.sliders.rigid.reshape(*shape[:2], *([1] * len(shape[2:])))
        return np.where(rigid > 0.0, 0.0, place - self.slider_place)

    def check(self, system: ContactSystem) -> None:
        """Raise InputError unless the state fits a system."""
        n, m = system.basis.contact_nodes, system.basis.modes
        solid, rests = system.basis.dimension == 3, self.slider_force.ndim == 3
        if len(self.modal_coordinates) != m or len(self.node) != n or solid != rests:
            raise InputError(f"The state at rest has {len(self.modal_coordinates)} modes and "
                             f"{len(self.node)} contact nodes of {_KINDS[rests]}, but the system "
                             f"has {m} and {n} of {_KINDS[solid]}; load that system itself with "
                             f"load_history.")
        force, slope = np.empty(n), np.empty(n)
        normal_values(system.arrays.normal, np.ascontiguousarray(self.node[:, PENETRATION]),
                      np.zeros(n), system.arrays.normal_parameters, force, slope)
        wrong = np.abs(force - self.node[:, FORCE])
        if wrong.max(initial=0.0) > _SAME_FORCE * np.abs(self.node[:, FORCE]).max(initial=0.0):
            j = int(np.argmax(wrong))
            raise InputError(f"The state at rest has the normal force {self.node[j, FORCE]:g} N at "
                             f"contact node {j}, where the normal law of the system has "
                             f"{force[j]:g} N; load that system itself with load_history.")

    def memory(self, system: ContactSystem) -> Array:
        """Internal variables (n, s) of the system's friction at this state.

        InputError where a friction law has internal variables that are not deflections of springs.
        """
        self.check(system)
        out = np.zeros((system.basis.contact_nodes, system.memory))
        for nodes, share, law in system.law_groups("friction"):
            if law.memory:
                springs = law.sliders(share)
                if springs is None or law.memory > self.slider_force.shape[1]:
                    raise InputError(f"{type(law).__name__} cannot go on from this state at rest, "
                                     f"whose friction is that of other springs; use the friction "
                                     f"law with which it was loaded.")
                sliding = self.at_limit[nodes, : law.memory]
                force = self.slider_force[nodes, : law.memory]
                inside = np.where(sliding, 1.0 - _INSIDE, 1.0)
                force = force * inside.reshape(*inside.shape, *([1] * (force.ndim - 2)))
                stiffness = springs[0].reshape(*springs[0].shape, *([1] * (force.ndim - 2)))
                out[nodes, : force[0].size] = (force / stiffness).reshape(len(force), -1)
        return out
