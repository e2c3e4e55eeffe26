"""Motion of points, and forces, slip and state of the contact nodes; all of it in one state."""

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ComplexArray
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system import columns
from fecontact.system.complex_modes import sorted_eigenvalues


class ContactState(IntEnum):
    """State of a contact node."""

    OPEN = 0
    STICK = 1
    SLIP = 2


def total_friction(forces: Array) -> float:
    """Sum of friction forces (n, k) against tangents [N]: in space the size of a vector."""
    total = forces.sum(axis=0)
    return float(total[0]) if len(total) == 1 else float(np.linalg.norm(total))


@read_only_arrays
class ContactQuantities:
    """Motion of points, and forces, gaps and slip of contact nodes, in states of a system.

    Arrays have the shape (..., n) for n nodes: (N, n) in a run, (n,) in one state.
    """

    system: Any  # a ContactSystem, whose own module uses this one
    modal_coordinates: Array
    modal_velocities: Array

    @property
    def basis(self) -> ModalBasis:
        """Modal basis of the system."""
        return self.system.basis

    def displacement(self, point: str | int | tuple[float, ...]) -> Array:
        """Displacement x, y [m] and rotation phi [rad] (..., 3) of a point.

        Of solids x, y, z and the rotations about them (..., 6); of contact nodes in their own
        frame, along the first tangent, the second one in space, and the normal.

        Parameters
        ----------
        point : str, int or (x, y)
            'B', 'C' or a further named point; a contact node by its number from 0; or the
            displacement node of the body nearest to a place (then without rotations).
        """
        return self.modal_coordinates @ self._rows(point).T

    def velocity(self, point: str | int | tuple[float, ...]) -> Array:
        """Velocity [m/s] and angular velocity [rad/s] (..., 3) of a point; see displacement."""
        return self.modal_velocities @ self._rows(point).T

    def acceleration(self, point: str | int | tuple[float, ...]) -> Array:
        """Acceleration [m/s^2] and angular acceleration (..., 3) of a point; see displacement.

        It follows from the forces by the equations of motion. With base acceleration it is that
        relative to the base.
        """
        return self.modal_accelerations @ self._rows(point).T

    @property
    def modal_accelerations(self) -> Array:
        """Rates q'' (..., m) of the modal velocities under all forces."""
        raise NotImplementedError

    def _rows(self, point: str | int | tuple[float, ...]) -> Array:
        basis = self.basis
        if isinstance(point, str | int | np.integer):
            return basis.T[basis.point_index(point if isinstance(point, str) else int(point))]
        if basis.mode_shapes is None:
            raise InputError(f"The point {point} cannot be found: the modal basis holds no mode "
                             f"shapes; use a named point or a contact node.")
        if np.shape(point) != (basis.dimension,):
            axes = "x, y" if basis.dimension == 2 else "x, y, z"
            raise InputError(f"The point {point} must have {basis.dimension} coordinates, {axes} "
                             f"in m.")
        distance = np.linalg.norm(basis.mode_shapes.nodes - np.asarray(point, dtype=float), axis=1)
        nearest_node = int(np.argmin(distance))
        reach = np.ptp(basis.mode_shapes.nodes, axis=0).max()
        if distance[nearest_node] > 0.1 * reach:
            raise InputError(f"The point {point} lies outside the body, {distance.min():.3g} m "
                             f"away from it.")
        return basis.mode_shapes.shapes[nearest_node]

    @cached_property
    def _contact(self) -> Array:
        """Columns of :meth:`ContactSystem.contact_history` (..., n, 6), in space (..., n, 8)."""
        raise NotImplementedError

    @property
    def normal_force(self) -> Array:
        """Normal forces F (..., n) on the body, zero or above [N]."""
        return self._column(columns.NORMAL_FORCE)

    @property
    def friction_force(self) -> Array:
        """Friction forces R (..., n) along the first tangent; on the body they act in -x [N]."""
        return self._column(columns.FRICTION_FORCE)

    @property
    def friction_forces(self) -> Array:
        """Friction forces (..., n, 1), in space (..., n, 2), against the tangents [N]."""
        return self._along_tangents(columns.FRICTION_FORCE, columns.FRICTION_ACROSS)

    @property
    def penetration(self) -> Array:
        """Penetrations u (..., n), negative where open [m]."""
        return self._column(columns.PENETRATION)

    @property
    def gap(self) -> Array:
        """Distances (..., n) to the ground or the other side, negative in contact [m]."""
        return -self.penetration

    @property
    def penetration_rate(self) -> Array:
        """Rates u' (..., n) of the penetrations, positive towards the ground [m/s]."""
        return self._column(columns.PENETRATION_RATE)

    @property
    def slip_velocity(self) -> Array:
        """Slip velocities (..., n) relative to the ground, along the first tangent [m/s]."""
        return self._column(columns.SLIP_VELOCITY)

    @property
    def slip_velocities(self) -> Array:
        """Slip velocities (..., n, 1), in space (..., n, 2), along the tangents [m/s]."""
        return self._along_tangents(columns.SLIP_VELOCITY, columns.SLIP_ACROSS)

    def _columns(self, along: int, across: int) -> list[int]:
        return [along] if self.basis.dimension == 2 else [along, across]

    def _column(self, column: int) -> Array:
        """One of the columns (..., n) of :attr:`_contact`."""
        return self._contact[..., column]

    def _along_tangents(self, along: int, across: int) -> Array:
        """Columns (..., n, 1), in space (..., n, 2), along the tangents."""
        return np.stack([self._column(one) for one in self._columns(along, across)], axis=-1)

    @property
    def slip_power(self) -> Array:
        """Power (..., n) of the friction forces in the slip velocities [W]."""
        return np.asarray((self.friction_forces * self.slip_velocities).sum(axis=-1))

    @property
    def line_load(self) -> Array:
        """Normal force per length of a plane body's face (..., n) [N/m]; InputError for solids."""
        basis = self.basis
        if basis.dimension == 3:
            raise InputError("Line loads are those of plane bodies; take the pressure of a solid.")
        return self.normal_force / basis.tributary

    @property
    def pressure(self) -> Array:
        """Normal force per area (..., n) [Pa]; InputError if the basis has no thickness."""
        return self.normal_force / self.basis.contact_areas

    @cached_property
    def contact_state(self) -> NDArray[np.int8]:
        """State (..., n) of the contact nodes, values of :class:`ContactState`.

        Open without normal force; sticking below the slip velocity of largest friction.
        """
        slip, friction = self.slip_velocity, self.friction_force
        if self.basis.dimension == 3:
            slip, friction = (np.linalg.norm(both, axis=-1)
                              for both in (self.slip_velocities, self.friction_forces))
        stick = self.system.sticks(slip, self.normal_force, friction)
        state = np.where(stick, ContactState.STICK, ContactState.SLIP)
        return np.where(self.normal_force != 0.0, state, ContactState.OPEN).astype(np.int8)


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
