"""Result of quasi-static loading: equilibria along a path, work and loss, hysteresis loops."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.core.errors import InputError, require_choice
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised, quantity
from fecontact.laws.excitation import AXES
from fecontact.system.contact_quantities import total_friction
from fecontact.system.contact_system import ContactSystem
from fecontact.system.polynomial_forces import polynomial_energy
from fecontact.system.quasistatic.given import travel_forces
from fecontact.system.quasistatic.path import LoadPath
from fecontact.system.quasistatic.pose import PENETRATION
from fecontact.system.quasistatic.rest_state import STATES, ContactPoses, RestState
from fecontact.system.quasistatic.sliders import components


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class Loop(Summarised):
    """Force and displacement of one action between two vertices of a path.

    Attributes
    ----------
    action : str
        'load', 'motion_x', 'motion_y', 'travel', or a force by point and component, 'C.x'; of
        solids 'motion_z' and 'travel_y' too. Of several forces at one place 'forces.K'.
    displacement : (N,) array
        Displacement on which the force does its work [m]; of the load, per unit of its scale
        [N m].
    force : (N,) array
        Force that the action exerts on the body [N]; for the load, its scale [-]; for a travel
        that is an angle, a moment [N m].
    loss : float
        Energy lost in friction from the first of these points to the last [J].
    """

    action: str
    displacement: Array
    force: Array
    loss: float

    def summary(self) -> list[tuple[str, str]]:
        """Action, points and loss."""
        return [("action", self.action), ("points", f"{len(self.force)}"),
                ("loss", quantity(self.loss, "J", 5))]

    @property
    def area(self) -> float:
        """Area within the loop [J], by the trapezoidal rule between the points.

        It is the loss of a closed loop along which nothing else does work, as far as the points
        resolve it.
        """
        return float(np.trapezoid(self.force, self.displacement))


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class LoadHistory(ContactPoses, Summarised):
    r"""Equilibria along a path of quasi-static loading.

    The friction of a node is that of springs c with sliders,

    .. math::

        R^* = c\,(x_j - s - z), \qquad R = R^* \min(1,\ \mu F / |R^*|), \qquad
        z \leftarrow x_j - s - R / c

    In space these are vectors in the tangent plane of the node. Paths of a node that are straight
    within an increment are followed exactly, others are cut until the force turns so little that
    work and loss agree: then forces and losses are right to about twice the root of ``rtol``, as
    long as they turn.

    Jenkins' and Iwan's laws have springs and limits of their own. For laws without memory the
    limit is the coefficient at rest, mu(0+), and the spring is the tangential stiffness of stuck
    contacts, c_T = tangential_ratio c_N, with c_N = dF/du at the first point of the path at which
    ``load_scale`` is largest, held all along; a node that is open there has the mean of the others.
    The ratio 0.82 is 2 (1 - nu) / (2 - nu) of Mindlin for nu = 0.3; measured values reach down to
    half of it. Where the contact force follows waves, so it does here; travel of the ground does
    the work ``-(R + F y_R') ds``. Increments are cut where nodes begin to slip, touch or lift,
    until work, stored energy and loss agree.

    Attributes
    ----------
    modal_coordinates, given, node, slider_force, slider_place : arrays
        As of :class:`RestState`, with an axis of N points before the others.
    sliders : Sliders
        Springs and limits of the nodes.
    system : ContactSystem
        The system.
    path : LoadPath
        The path; N points on it.
    works : (N, 4) array
        Work done so far by loads, drive, travel of the ground, and stiffness that is not symmetric
        [J].
    node_loss : (N, n) array
        Energy lost in friction so far at each node, the sum of R dz [J].
    status : 'finished' or 'no-equilibrium'
        Whether the end of the path was reached. If not, there are only the points up to the last
        equilibrium that was found.
    statistics : dict
        Numbers of increments ``solved``, ``cut``, and of ``jumps``, which no increment however
        short could follow.

    References
    ----------
    R. D. Mindlin, Compliance of elastic bodies in contact, Journal of Applied Mechanics 16 (1949).
    """

    system: ContactSystem
    path: LoadPath
    works: Array
    node_loss: Array
    status: Literal["finished", "no-equilibrium"]
    statistics: dict[str, int]

    def summary(self) -> list[tuple[str, str]]:
        """Points, status, nodes by their state at the end, work and loss."""
        touching = ~self.system.basis.spring_nodes
        states = self.contact_state[-1, touching]
        return [
            ("points", f"{len(self)} of {sum(self.path.section_steps) + 1}, {self.status}"),
            ("at the end", ", ".join(f"{np.count_nonzero(states == code)} {name}"
                                     for code, name in enumerate(STATES))),
            ("normal force", quantity(
                float(self.normal_force[-1, touching].sum()), "N", 4)),
            ("friction force", quantity(total_friction(self.friction_forces[-1]), "N", 4)),
            ("work", quantity(float(self.work[-1]), "J", 4)),
            ("loss", quantity(float(self.loss[-1]), "J", 4)),
        ]

    def __len__(self) -> int:
        return len(self.modal_coordinates)

    @property
    def travel(self) -> Array:
        """Travel (N,) of the ground along x, or of the interface that slides [m], [rad]."""
        return self.travels[:, 0]

    @property
    def work(self) -> Array:
        """Work (N,) done on body and contact so far [J]."""
        return self.works.sum(axis=1)

    @property
    def loss(self) -> Array:
        """Energy dissipated by friction so far (N,) [J]."""
        return self.node_loss.sum(axis=1)

    @property
    def stored(self) -> Array:
        """Energy (N,) of the body, the drive's springs, the normal contact and friction springs."""
        arrays, q = self.system.arrays, self.modal_coordinates
        m = q.shape[1]
        ends = self.given[:, m : m + self.system.basis.dimension]
        springs = arrays.drive_stiffness
        body = 0.5 * np.einsum("ni,ij,nj->n", q, arrays.stiffness, q)
        pulled = ((0.5 * ends - q @ arrays.drive_shapes.T) * springs * ends).sum(axis=1)
        compliance = np.where(self.sliders.rigid > 0.0, 0.0, 1.0 / np.where(
            self.sliders.stiffness > 0.0, self.sliders.stiffness, np.inf))
        squares = (components(self.slider_force, 1) ** 2).sum(axis=-1)
        friction = 0.5 * (squares * compliance).sum(axis=(1, 2))
        return np.asarray(body + polynomial_energy(q, arrays) + pulled + friction
                          + self.system.stored_energy(self.node[..., PENETRATION]))

    @property
    def imbalance(self) -> Array:
        """Work minus loss minus change of the stored energy (N,) [J], zero within errors."""
        return self.work - self.loss - (self.stored - self.stored[0])

    def row(self, vertex: int) -> int:
        """Number of a vertex among the points; negative ones count from the end.

        InputError if there is no such vertex, or the loading did not reach it.
        """
        rows = self.path.rows_of_vertices
        if not isinstance(vertex, int | np.integer) or not -len(rows) <= vertex < len(rows):
            raise InputError(f"vertex = {vertex!r} must be a whole number from 0 to "
                             f"{len(rows) - 1}.")
        if rows[vertex] >= len(self):
            raise InputError(f"vertex = {vertex!r} was not reached: the loading ended at point "
                             f"{len(self) - 1} of {rows[-1]} without an equilibrium.")
        return rows[vertex]

    def state(self, point: int = -1) -> RestState:
        """The state at a point, by default the last, from which runs and modes can start."""
        return RestState(self.modal_coordinates[point], self.given[point], self.node[point],
                         self.slider_force[point], self.slider_place[point], self.sliders)

    def loop(self, first: int = 0, last: int = -1, action: str | None = None) -> Loop:
        """Force over displacement of an action along a part of the path, and its loss.

        Parameters
        ----------
        first, last : int
            Vertices of the path at which the part begins and ends.
        action : str, optional
            As :attr:`Loop.action`; by default the one that does most work, either way.

        Raises
        ------
        InputError
            For vertices that do not exist or were not reached, or an unknown action.
        """
        part = slice(self.row(first), self.row(last) + 1)
        if part.stop - part.start < 2:
            raise InputError(f"loop: first = {first!r} must be a vertex before last = {last!r}.")
        found = {name: (place[part], force[part]) for name, place, force in self._actions()}
        if action is None:
            action = max(found, key=lambda name: _turnover(*found[name]))
        else:
            require_choice("loop", "action", action, found)
        loss = self.loss[part]
        return Loop(action, *found[action], float(loss[-1] - loss[0]))

    def _actions(self) -> Iterator[tuple[str, Array, Array]]:
        """Name, displacement and force of all that may do work."""
        q, given, path = self.modal_coordinates, self.given, self.path
        arrays, m = self.system.arrays, q.shape[1]
        yield "load", q @ arrays.constant_load, path.at_points(path.load_scale)[: len(self)]
        for axis, name in enumerate(AXES[: self.system.basis.dimension]):
            end = given[:, m + axis]
            pull = arrays.drive_stiffness[axis] * (end - q @ arrays.drive_shapes[axis])
            yield f"motion_{name}", end, pull
        forces = travel_forces(self.system, self.tangential_forces)
        for name, travel, force in zip(("travel", "travel_y"), self.travels.T, forces.T,
                                       strict=False):
            yield name, travel, force
        # Those that a path names have become a list beside the system's.
        assert not isinstance(path.forces, Mapping)
        names = [f"{force.point}.{force.along}" for force in self.system.load.forces]
        for k, values in enumerate(path.forces or ()):
            name = names[k] if names.count(names[k]) == 1 else f"forces.{k}"
            yield name, q @ arrays.load_shapes[k], path.at_points(values)[: len(self)]


def _turnover(displacement: Array, force: Array) -> float:
    """Work by and against a force."""
    return float(np.abs(0.5 * (force[1:] + force[:-1]) * np.diff(displacement)).sum())
