"""A contact system in one state."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ComplexArray
from fecontact.system.complex_modes import sorted_eigenvalues
from fecontact.system.contact_quantities import ContactQuantities


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Instant(ContactQuantities):
    """A contact system in one state, see :meth:`ContactSystem.at`.

    Attributes
    ----------
    system : ContactSystem
    time : float
        [s]
    modal_coordinates, modal_velocities : (m,) arrays
        q and q'.
    memory : (n s,) array
        Internal variables z of friction with memory, node by node.
    """

    system: Any  # a ContactSystem, whose own module uses this one
    time: float
    modal_coordinates: Array
    modal_velocities: Array
    memory: Array

    @property
    def state(self) -> Array:
        """State y = [q, q', z] (2 m + n s,)."""
        return np.concatenate([self.modal_coordinates, self.modal_velocities, self.memory])

    @cached_property
    def _contact(self) -> Array:
        return self.system.contact_history(np.array([self.time]), self.state[None])[0]

    @cached_property
    def modal_accelerations(self) -> Array:
        """Rates q'' (m,) of the modal velocities under all forces, from the equations of motion."""
        m = self.system.basis.modes
        return self.system.rhs(self.time, self.state)[m : 2 * m]

    @cached_property
    def eigenvalues(self) -> ComplexArray:
        """Eigenvalues [1/s] of the linear motion about the state, the largest real part first."""
        return sorted_eigenvalues(self.system.jacobian(self.time, self.state))
