"""Contact phases of nodes: penetration between output times, touch-down and lift-off."""

from dataclasses import dataclass
from functools import cached_property
from numbers import Integral
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError, choices, nearest, shown
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.system import columns
from fecontact.system.contact_system import ContactSystem
from fecontact.system.node_forces import normal_values

Integers = NDArray[np.intp]
Nodes = int | str | None


def chosen_nodes(system: ContactSystem, nodes: Nodes) -> Integers:
    """Indices of selected nodes: one node, those of an interface, or all (None).

    Raises
    ------
    InputError
        For a node or an interface that does not exist.
    """
    basis = system.basis
    if nodes is None:
        return np.arange(basis.contact_nodes)
    if isinstance(nodes, str):
        names = [name for name, _ in basis.groups]
        if nodes not in names:
            raise InputError(f"There is no interface '{nodes}'{nearest(nodes, names)}; the "
                             f"interfaces are: {choices(names)}.")
        group = names.index(nodes)
        first = sum(count for _, count in basis.groups[:group])
        return first + np.arange(basis.groups[group][1])
    if not isinstance(nodes, Integral) or isinstance(nodes, bool):
        raise InputError(f"nodes = {shown(nodes)} must be the number of a contact node, counted "
                         f"from 0, the name of an interface, or None for all nodes.")
    return np.array([basis.point_index(int(nodes)) - 2])


class Ends(NamedTuple):
    """End points of p motion segments: times (p,), penetrations and rates (p, k)."""

    t0: Array
    u0: Array
    v0: Array
    t1: Array
    u1: Array
    v1: Array

    def between(self, part: Array) -> Array:
        """Penetrations and rates (2, p, j, k) at fractions (p, j), 0 to 1, of the segments."""
        step, s = (self.t1 - self.t0)[:, None, None], part[:, :, None]
        u0, u1, v0, v1 = (value[:, None] for value in (self.u0, self.u1, self.v0, self.v1))
        rise = (u1 - u0) / step
        square, cube = 3.0 * rise - 2.0 * v0 - v1, v0 + v1 - 2.0 * rise
        return np.stack([u0 + s * step * (v0 + s * (square + s * cube)),
                         v0 + s * (2.0 * square + 3.0 * s * cube)])


class Switches(NamedTuple):
    """Times of touch-down and lift-off of a face.

    interval : (j,), output intervals that contain them
    down : (j,), True for touch-down, False for lift-off
    time : (j,) [s]
    penetration, rate : (j, k) [m, m/s]
    """

    interval: Integers
    down: NDArray[np.bool_]
    time: Array
    penetration: Array
    rate: Array


@dataclass(frozen=True, eq=False)
class ContactMotion:
    """Motion of contact nodes of a run and the resulting normal forces.

    Attributes
    ----------
    trajectory : Trajectory
    nodes : (k,) array
        Indices of the nodes.
    weights : (k,) array
        Fraction of the contact face of these nodes that belongs to each node.
    """

    trajectory: Trajectory
    nodes: Integers
    weights: Array

    @classmethod
    def of(cls, trajectory: Trajectory, nodes: Nodes = None) -> "ContactMotion":
        """Motion of one node, of an interface, or of all contact nodes of a run.

        Raises
        ------
        InputError
            For nodes that do not exist, for systems without contact nodes, and for runs with rigid
            stops, where impacts are instantaneous.
        """
        if not trajectory.basis.contact_nodes:
            raise InputError("The system has no contact nodes, so that its run has no contact "
                             "phases.")
        held = trajectory.held_normal_force
        if held is not None:
            system = trajectory.system
            by_law = system.contact_history(trajectory.time, trajectory.states)[
                :, :, columns.NORMAL_FORCE]
            if trajectory.statistics.get("restitution") is not None or (
                    np.abs(by_law - held).max() > 1e-6 * np.abs(held).max()):
                raise InputError("The impacts of a run with rigid stops take no time, so that it "
                                 "has no contact phases; run it without restitution, with the "
                                 "normal law.")
        chosen = chosen_nodes(trajectory.system, nodes)
        length = trajectory.basis.tributary[chosen]
        return cls(trajectory, chosen, length / length.sum())

    @property
    def time(self) -> Array:
        """Output times (N,) [s]."""
        return self.trajectory.time

    @cached_property
    def penetration(self) -> Array:
        """Penetrations (N, k) at the output times [m]."""
        return self.trajectory.penetration[:, self.nodes]

    @cached_property
    def rate(self) -> Array:
        """Penetration rates (N, k) at the output times [m/s]."""
        return self.trajectory.penetration_rate[:, self.nodes]

    @cached_property
    def force(self) -> Array:
        """Normal forces (N, k) at the output times [N]."""
        return self.trajectory.normal_force[:, self.nodes]

    def require_openings(self, caller: str) -> None:
        """Raise InputError for normal laws that pull where they do not press: they never open."""
        small = 1e-9 * float(np.abs(self.penetration).max(initial=0.0))
        sides = np.array([[small], [-small]]) * np.ones(len(self.nodes))
        press, pull = self.law_force(sides, np.zeros_like(sides))
        bilateral = np.flatnonzero(press * pull < 0.0)
        if len(bilateral):
            raise InputError(f"{caller}: the normal law of contact node {self.nodes[bilateral[0]]} "
                             f"presses and pulls, so that the contact never opens; choose nodes "
                             f"whose law acts on one side or has a play.")

    def law_force(self, penetration: Array, rate: Array) -> Array:
        """Normal forces (..., k) of the laws at penetrations and rates (..., k)."""
        arrays = self.trajectory.system.arrays
        count = penetration.size // len(self.nodes)
        force, slope = np.empty(penetration.size), np.empty(penetration.size)
        normal_values(
            np.tile(arrays.normal[self.nodes], count), penetration.reshape(-1), rate.reshape(-1),
            np.tile(arrays.normal_parameters[self.nodes], (count, 1)), force, slope)
        return force.reshape(penetration.shape)

    @cached_property
    def switches(self) -> Switches:
        """Touch-downs and lift-offs: the first node gains, or the last node loses, its force.

        The motion is extrapolated from the output time on the side without contact, with the
        acceleration there, which contact does not affect.
        """
        touching = (self.force != 0.0).any(axis=1)
        interval = np.flatnonzero(touching[1:] != touching[:-1])
        down = touching[interval + 1]
        side = np.where(down, interval, interval + 1)
        u, v, a = self.penetration[side], self.rate[side], self.acceleration(side)
        step = np.diff(self.time)[interval] * np.where(down, 1.0, -1.0)

        def moved(part: Array) -> tuple[Array, Array]:
            h = (step * part)[:, None]
            return u + h * (v + 0.5 * h * a), v + h * a

        free, contact = np.zeros(len(side)), np.ones(len(side))
        for _ in range(50):
            middle = 0.5 * (free + contact)
            touched = (self.law_force(*moved(middle)) != 0.0).any(axis=1)
            free, contact = np.where(touched, free, middle), np.where(touched, middle, contact)
        return Switches(interval, down, self.time[side] + contact * step, *moved(contact))

    def acceleration(self, index: Integers) -> Array:
        """Second derivatives (j, k) of the penetrations at output times [m/s^2]."""
        system, t = self.trajectory.system, self.time[index]
        states = self.trajectory.states[index]
        rates = np.array([system.rhs(*at) for at in zip(t, states, strict=True)])
        if not len(index):
            return np.empty((0, len(self.nodes)))
        # Central difference of the rates, with the state extrapolated linearly over moving ground.
        tiny = 1e-3 * float(np.diff(self.time).min())
        before, after = (
            system.contact_history(t + h, states + h * rates)[:, self.nodes,
                                                              columns.PENETRATION_RATE]
            for h in (-tiny, tiny))
        return np.asarray((after - before) / (2.0 * tiny))

    def pieces(self) -> tuple[Integers, Ends]:
        """Output intervals with contact, split at the switches, and their phase numbers from 0."""
        touching = (self.force != 0.0).any(axis=1)
        with_contact = touching[1:] | touching[:-1]
        u, v, t = self.penetration, self.rate, self.time
        ends = Ends(t[:-1].copy(), u[:-1].copy(), v[:-1].copy(), t[1:].copy(), u[1:].copy(),
                    v[1:].copy())
        found = self.switches
        for first, chosen in ((0, found.down), (3, ~found.down)):
            for part, values in zip(ends[first : first + 3],
                                    (found.time, found.penetration, found.rate), strict=True):
                part[found.interval[chosen]] = values[chosen]
        begins = np.concatenate([[touching[0] * 1], ~touching[:-1] & touching[1:]])
        # A switch at an output time leaves an interval of zero length.
        kept = with_contact & (ends.t1 > ends.t0)
        return (np.cumsum(begins) - 1)[1:][kept], Ends(*(part[kept] for part in ends))
