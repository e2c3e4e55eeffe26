"""A body at rest under friction: displacements, forces, and what its sliders remember."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, count, quantity
from fecontact.system.contact_system import ContactSystem
from fecontact.system.quasistatic.increment import FORCE, PLACE, PRESSING, Sliders

STATES = ("open", "stick", "slip")
OPEN, STICK, SLIP = range(len(STATES))
# Relative distance from its limit at which a slider counts as sliding.
_AT_LIMIT = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class RestState(Summarised):
    """Equilibrium of a body at rest, which depends on how it was loaded.

    Attributes
    ----------
    modal_coordinates : (m,) array
        q.
    given : (m + 3,) array
        Modal forces of the loads, displacements of the driven ends of the springs at B in x and y
        [m], travel of the ground [m].
    node : (n, 6) array
        F [N], the force that friction sees [N], penetration [m], place relative to the ground [m],
        force in -x [N] and its part that leans with the ground [N].
    slider_force, slider_place : (n, e) arrays
        R of the sliders of each node [N], and the place to which each has slid [m].
    sliders : Sliders
        Stiffness [N/m] and limit, as a part of F, of each slider, and whether it sticks rigidly.
    """

    modal_coordinates: Array
    given: Array
    node: Array
    slider_force: Array
    slider_place: Array
    sliders: Sliders

    def summary(self) -> list[tuple[str, str]]:
        """Nodes by their state, normal and friction force."""
        states = self.contact_state
        return [
            ("nodes", ", ".join(f"{np.count_nonzero(states == code)} {name}"
                                for code, name in enumerate(STATES))),
            ("normal force", quantity(float(self.normal_force.sum()), "N", 4)),
            ("friction force", quantity(float(self.friction_force.sum()), "N", 4)),
            ("sliders", f"{count(self.slider_force.shape[1], 'slider')} per node"),
        ]

    @property
    def normal_force(self) -> Array:
        """F (n,) [N]."""
        return self.node[:, FORCE]

    @property
    def friction_force(self) -> Array:
        """R (n,), on the body in -x [N]."""
        return self.slider_force.sum(axis=1)

    @property
    def travel(self) -> float:
        """Travel of the ground [m]."""
        return float(self.given[-1])

    @property
    def deflection(self) -> Array:
        """Deflections (n, e) of the springs of the sliders [m]; zero where sticking is rigid."""
        return np.where(self.sliders.rigid > 0.0, 0.0,
                        self.node[:, PLACE, None] - self.slider_place)

    @property
    def at_limit(self) -> Any:
        """Whether each slider (n, e) is at its limit."""
        limit = self.sliders.limit * self.node[:, PRESSING, None]
        return np.abs(self.slider_force) >= (1.0 - _AT_LIMIT) * limit

    @property
    def contact_state(self) -> Integers:
        """State (n,) of each node: 0 open, 1 stick, 2 slip (all its sliders at their limits)."""
        return contact_states(self.node[:, FORCE], self.at_limit)

    def check(self, system: ContactSystem) -> None:
        """Raise InputError unless the state fits a system."""
        n, m = system.basis.contact_nodes, system.basis.modes
        if len(self.modal_coordinates) != m or len(self.node) != n:
            raise InputError(f"The state at rest has {len(self.modal_coordinates)} modes and "
                             f"{len(self.node)} contact nodes, but the system has {m} and {n}; "
                             f"load that system itself with load_history.")

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
                out[nodes, : law.memory] = self.slider_force[nodes, : law.memory] / springs[0]
        return out


def contact_states(normal_force: Array, at_limit: Any) -> Integers:
    """States (..., n) of nodes from F (..., n) and their sliders at the limit (..., n, e)."""
    return np.where(normal_force == 0.0, OPEN,
                    np.where(at_limit.all(axis=-1), SLIP, STICK)).astype(np.int64)
