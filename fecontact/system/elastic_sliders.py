"""Elastic Coulomb elements: springs in series with sliders, whose deflections have limits.

Elements are integrated exactly in time. The deflection z follows the slip velocity, in slip too,
and the force is that of the deflection within its limit l = mu F / k. The excess |z| - l is then
the distance that the element has slid. Slip ends where the excess is largest: z returns to the
limit.
"""

from typing import Any

import numpy as np

from fecontact.core.compiled import helper, kernel, routine
from fecontact.core.records import IntegerVector, Matrix, Vector
from fecontact.core.types import Array, Integers
from fecontact.laws.friction.planar import along_slip
from fecontact.laws.friction.stribeck import no_friction
from fecontact.system.node_forces import force_workspace, node_forces
from fecontact.system.nodes import (
    SystemArrays,
    ground_motion,
    memory_of,
    most_memory,
    node_motion,
    size_of,
)
from fecontact.system.powers import BRISTLES, FRICTION, POWER_COUNT

# An element that sticks again is short of its limit by this part, so that a parameter that changes
# for derivatives does not let it slide.
SHORT = 2e-8
# Parts of its limit within which an element is at it, and by which its deflection is kept on one
# side of the limit: more than a parameter that changes for derivatives makes of the limit.
_ROUNDING, _APART = 1e-11, 1e-4


@routine
def pressing_at(j, y, moved, s, force, rates):
    """Normal force of node j in the state y, what friction sees of it, and the contact."""
    return node_forces(j, node_motion(j, y, s), moved, memory_of(j, y, s), s, force, rates)


@helper
def limit_of(j, i, count, pressing, s):
    """Largest deflection of element i of the ``count`` elements of node j [m]."""
    p = s.friction_parameters[j]
    return p[1 + count + i] * pressing / p[1 + i]


@routine
def limits_at(moved, y, s, counts, force, rates):
    """Largest deflections (n, elements) of all elements in the state y [m]."""
    limits = np.zeros((len(counts), most_memory(s)))
    for j in range(len(counts)):
        if counts[j] > 0:
            _, pressing, _ = pressing_at(j, y, moved, s, force, rates)
            for i in range(counts[j]):
                limits[j, i] = limit_of(j, i, counts[j], pressing, s)
    return limits


@helper
def deflection_of(z, i, s):
    """Magnitude of the deflection of element i [m]."""
    tangents = s.rows.shape[1] - 1
    across = z[tangents * i + 1] if tangents > 1 else 0.0
    return size_of((z[tangents * i], across))


@helper
def return_deflection(z, i, size, target, s):
    """Reduce the deflection of element i from the magnitude ``size`` to ``target``."""
    tangents = s.rows.shape[1] - 1
    for k in range(tangents * i, tangents * (i + 1)):
        z[k] *= target / size


@routine
def set_sides(moved, y, s, counts, force, rates, sides):
    """Fill ``sides`` (n, elements): 1 for elements that slide in the state y, -1 that stick.

    Zero for elements of open contacts, and for elements at their limit within rounding.
    """
    sides[:] = 0
    limits = limits_at(moved, y, s, counts, force, rates)
    for j in range(len(counts)):
        for i in range(counts[j]):
            limit, size = limits[j, i], deflection_of(memory_of(j, y, s), i, s)
            if limit > 0.0 and abs(size - limit) > _ROUNDING * limit:
                sides[j, i] = 1 if size > limit else -1


@routine
def keep_sides(moved, y, s, counts, force, rates, sides):
    """Move deflections of the state y that are beyond their limit to the other of its ``sides``.

    Derivatives of the forces there are those of elements that slide, or stick, all along a step.
    """
    limits = limits_at(moved, y, s, counts, force, rates)
    for j in range(len(counts)):
        z = memory_of(j, y, s)
        for i in range(counts[j]):
            limit, size = limits[j, i], deflection_of(z, i, s)
            target = limit * (1.0 + _APART * sides[j, i])
            if size > 0.0 and (target - size) * sides[j, i] > 0.0:
                return_deflection(z, i, size, target, s)


@routine
def widen_scales(moved, y, s, counts, force, rates, scale):
    """Make ``scale`` (size,), what errors count relative to, larger for elements that slide at y.

    An error of the deflection z turns their force, c times the limit l, by l / |z| of it. A limit
    far below its scale is on its way to or from zero: its force acts for as short a time.
    """
    limits, tangents = limits_at(moved, y, s, counts, force, rates), s.rows.shape[1] - 1
    for j in range(len(counts)):
        first = len(y) + (j - len(counts)) * most_memory(s)
        for i in range(counts[j]):
            limit, size = limits[j, i], deflection_of(memory_of(j, y, s), i, s)
            if size > limit:
                least = max(limit, _ROUNDING * size)
                for k in range(first + tangents * i, first + tangents * (i + 1)):
                    scale[k] *= size / least * max(1.0, scale[k] / least)


@routine
def return_to_limits(t, y, s, counts, force, rates):
    """Return all deflections of the state y at time t to their limits."""
    limits = limits_at(ground_motion(t, s), y, s, counts, force, rates)
    for j in range(len(counts)):
        z = memory_of(j, y, s)
        for i in range(counts[j]):
            limit, size = limits[j, i], deflection_of(z, i, s)
            if size > limit:
                return_deflection(z, i, size, limit, s)


@kernel
def return_states(times: Vector, states: Matrix, s: SystemArrays, counts: IntegerVector) -> None:
    """Return all deflections of states (N, size) at N times to their limits."""
    force, rates = force_workspace(s)
    for k in range(len(times)):
        return_to_limits(times[k], states[k], s, counts, force, rates)


@kernel
def excesses(t: float, y: Vector, s: SystemArrays, counts: IntegerVector, out: Matrix) -> None:
    """Fill out (n, elements) with |z| less the limit of each element [m]; -inf where none is."""
    force, rates = force_workspace(s)
    limits = limits_at(ground_motion(t, s), y, s, counts, force, rates)
    out[:] = -np.inf
    for j in range(len(counts)):
        for i in range(counts[j]):
            out[j, i] = deflection_of(memory_of(j, y, s), i, s) - limits[j, i]


@kernel
def stick_again(t: float, y: Vector, s: SystemArrays, counts: IntegerVector, ends: Matrix) -> None:
    """Return the elements to their limits for which ``ends`` (n, elements) is not zero."""
    force, rates = force_workspace(s)
    limits = limits_at(ground_motion(t, s), y, s, counts, force, rates)
    for j in range(len(counts)):
        z = memory_of(j, y, s)
        for i in range(counts[j]):
            limit, size = limits[j, i], deflection_of(z, i, s)
            if ends[j, i] != 0.0 and size > limit:
                return_deflection(z, i, size, limit * (1.0 - SHORT), s)


def slider_counts(system: Any) -> Integers:
    """Number (n,) of elastic Coulomb elements of each contact node of a system."""
    counts = np.zeros(system.basis.contact_nodes, dtype=np.int64)
    for nodes, share, law in system.law_groups("friction"):
        if law.memory and law.sliders(share) is not None:
            counts[nodes] = law.memory
    return counts


def without_elements(arrays: SystemArrays) -> SystemArrays:
    """Arrays of a system whose nodes feel no friction, with its parameters."""
    return arrays._replace(
        memory=np.zeros_like(arrays.memory),
        friction=np.full_like(arrays.friction, no_friction.address),
        planar=np.full_like(arrays.planar, along_slip.address if len(arrays.planar) else 0),
        bristle_stiffness=np.zeros((2, len(arrays.memory), 0)))


def exact_arrays(arrays: SystemArrays, counts: Integers) -> SystemArrays:
    """Arrays for runs that return elements to their limits at the end of slip.

    The energy stored in the elements is left out of the powers: it follows from the states.
    """
    if not counts.any():
        return arrays
    friction, stored = arrays.friction_parameters.copy(), arrays.bristle_stiffness.copy()
    friction[counts > 0, 0] = 0.0
    stored[:, counts > 0] = 0.0
    return arrays._replace(friction_parameters=friction, bristle_stiffness=stored)


def within_limits(system: Any, times: Array, states: Array, counts: Integers) -> Array:
    """Copy of the states (N, size) at N times with all deflections within their limits."""
    found = np.array(states, dtype=float)
    if counts.any():
        return_states(np.ascontiguousarray(times, dtype=float), found, system.arrays, counts)
    return found


def booked(
    system: Any, counts: Integers, times: Array, states: Array, work: Array,
    start: tuple[float, Array],
) -> tuple[Array, Array]:
    """States within their limits, and work in which springs of elements store what they took.

    Parameters
    ----------
    system : ContactSystem
        With these elements or without.
    counts : (n,) array
        Elements of each node.
    times, states, work : (N,), (N, size), (N, p) or (N, p + 2 n) arrays
        Of a run; not changed.
    start : (time, (size,) array)
        Time and state at the start of the run.
    """
    if not counts.any() or not len(times):
        return states, work
    states, work = within_limits(system, times, states, counts), work.copy()
    first = within_limits(system, np.array(start[:1]), start[1][None], counts)
    stored = stored_in_sliders(system, states, counts) - stored_in_sliders(system, first, counts)
    work[:, BRISTLES] += stored.sum(axis=1)
    work[:, FRICTION] -= stored.sum(axis=1)
    if work.shape[1] > POWER_COUNT:
        work[:, POWER_COUNT : POWER_COUNT + stored.shape[1]] -= stored
    return states, work


def stored_in_sliders(system: Any, states: Array, counts: Integers) -> Array:
    """Energy (N, n) that the springs of the elements store in states (N, size) [J]."""
    n, m = system.basis.contact_nodes, system.basis.modes
    stiffness = np.where(counts[:, None] > 0, system.arrays.bristle_stiffness[0], 0.0)
    squares = states[:, 2 * m :].reshape(len(states), n, -1) ** 2
    return np.asarray(0.5 * (stiffness * squares).sum(axis=2))
