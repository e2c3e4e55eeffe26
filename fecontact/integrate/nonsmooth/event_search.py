"""Compiled search of a step's interpolation for the first change of a cluster or a stop.

Heights and slip velocities on the interpolation are polynomials, whose Bernstein coefficients
bound them: what stays clear of its margin needs no further look, and a crossing is found by
halving, however short. Waves under a node and the speed of the ground go in as polynomials of the
same degree, through places so close that nothing is lost between them.

Flights that have just begun, and forces of what holds, are examined in
:mod:`fecontact.integrate.nonsmooth.steps.flights` and
:mod:`fecontact.integrate.nonsmooth.steps.releases`.
"""

from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.records import Flags
from fecontact.core.types import Array
from fecontact.integrate.bernstein import (
    DEPTH,
    FINEST,
    NOWHERE,
    UNDECIDED,
    first_below,
    first_change,
    fit,
    largest,
    of_nested,
    smallest,
    value,
)
from fecontact.integrate.nonsmooth.dop853 import PARTS, SLOPES
from fecontact.integrate.nonsmooth.problem import (
    CLUSTERS,
    OPEN,
    STICK,
    WITH_WORK,
    Evaluation,
    Limits,
    NonsmoothProblem,
    Output,
    Progress,
)
from fecontact.integrate.nonsmooth.steps.flights import Flights, first_landing
from fecontact.integrate.nonsmooth.steps.releases import QUARTERS, first_let_go
from fecontact.integrate.rodas5p.event_kernels import Watch
from fecontact.laws.signatures import ground_at
from fecontact.system.node_forces import normal_force
from fecontact.system.nodes import NODES, ground_motion

# Rounding of a sum, relative to its parts.
ROUNDING = 2e-15
# Part of the shortest wave that a node may pass in a step, for the polynomial through the places.
_WAVE = 0.25
_PLACES = 0.5 - 0.5 * np.cos(np.pi * np.arange(PARTS + 1) / PARTS)
_PLACES[-1] = 1.0
_FIT = fit(_PLACES)

_NESTED = of_nested(PARTS)
# A contact whose force grows so much between the ends of a step was missed by its stages.
_MISSED = 10.0
ROUGHLY = 2.0**-12


class Workspace(NamedTuple):
    """Workspace of steps from event to event, and of the search in them.

    Attributes
    ----------
    slopes, parts : (SLOPES, size), (PARTS, size) arrays
        Slopes of a step, and the coefficients of its interpolation.
    new, state, rate : (size,) arrays
        The end of a step; a state within it and its slope.
    place : (k + n,) array
        Where each cluster and stop first changes.
    nested, bound, along, values : (PARTS + 1,) arrays
        Polynomials of one node over the step.
    halves : (DEPTH, PARTS + 3) array
        Parts of the step that are left to look at.
    left, scale : (QUARTERS + 2, 2 k + n), (2 k + n,) arrays
        Margins of the forces at some places, and their sizes.
    ends : (2, 2 k + n) array
        Margins of the forces at both ends of the step.
    waiting : (DEPTH, 2) array
        Begins and widths of parts whose forces are left to look at.
    past, fresh : (k + n,) boolean arrays
        Clusters and stops that change at the moment looked at, and those that have just begun to
        move.
    released, arrived, held : (k,) boolean arrays
        Clusters that reach the limit of stick, that come to rest, and that stick.
    gaining : (k,) array
        Slip velocities in the sense of the status, above which clusters whose slip velocity grows
        go on slipping through an event of others; infinite for other clusters.
    touched, parting : (n,) boolean arrays
        Stops that are struck and nodes that touch down, and stops that open.
    flights, node_acceleration, heights : Flights, (SLOPES,), (PARTS + 2,) arrays
        Flights that have just begun, and the acceleration and the height of one of them over the
        step.
    """

    slopes: Annotated[Array, SLOPES, WITH_WORK]
    parts: Annotated[Array, PARTS, WITH_WORK]
    new: Annotated[Array, WITH_WORK]
    state: Annotated[Array, WITH_WORK]
    rate: Annotated[Array, WITH_WORK]
    place: Annotated[Array, CLUSTERS + NODES]
    nested: Annotated[Array, PARTS + 1]
    bound: Annotated[Array, PARTS + 1]
    along: Annotated[Array, PARTS + 1]
    values: Annotated[Array, PARTS + 1]
    halves: Annotated[Array, DEPTH, PARTS + 3]
    left: Annotated[Array, QUARTERS + 2, 2 * CLUSTERS + NODES]
    scale: Annotated[Array, 2 * CLUSTERS + NODES]
    ends: Annotated[Array, 2, 2 * CLUSTERS + NODES]
    waiting: Annotated[Array, DEPTH, 2]
    past: Annotated[Flags, CLUSTERS + NODES]
    fresh: Annotated[Flags, CLUSTERS + NODES]
    released: Annotated[Flags, CLUSTERS]
    arrived: Annotated[Flags, CLUSTERS]
    held: Annotated[Flags, CLUSTERS]
    gaining: Annotated[Array, CLUSTERS]
    touched: Annotated[Flags, NODES]
    parting: Annotated[Flags, NODES]
    flights: Flights
    node_acceleration: Annotated[Array, SLOPES]
    heights: Annotated[Array, PARTS + 2]


class Data(NamedTuple):
    """A run from event to event; what is watched for is noted in ``watch``."""

    problem: NonsmoothProblem
    limits: Limits
    progress: Progress
    output: Output
    kept: Output
    evaluation: Evaluation
    workspace: Workspace
    watch: Watch


@helper
def _along(row, first, Y, workspace, b):
    """Coefficients b of ``row Y[first:]`` over the step; returns the size of its terms."""
    parts, begin, size = workspace.parts, 0.0, 0.0
    for i in range(len(row)):
        begin += row[i] * Y[first + i]
        size += abs(row[i]) * (abs(Y[first + i]) + abs(parts[0, first + i]))
    for i in range(PARTS + 1):
        b[i] = begin
    for k in range(PARTS):
        c = 0.0
        for i in range(len(row)):
            c += row[i] * parts[k, first + i]
        for i in range(PARTS + 1):
            b[i] += c * _NESTED[1 + k, i]
    return size


@helper
def _through(values, b):
    """Add to b the polynomial through values at the places."""
    for k in range(len(b)):
        for i in range(len(values)):
            b[k] += _FIT[k, i] * values[i]


@helper
def _set_slip(k, sign, step, p, Y, workspace):
    """Put ``sign`` times the slip velocity of cluster k, raised by its rounding, into the bound."""
    s, b, values = p.system, workspace.bound, workspace.values
    size = _along(p.rows[k], s.rows.shape[2], Y, workspace, b)
    factor = p.sliding[k]
    speed = factor * ground_motion(step.t, s).speed
    if p.steady != 0:
        for i in range(len(b)):
            b[i] -= speed
    else:
        for i in range(len(b)):
            values[i] = -factor * ground_motion(step.t + _PLACES[i] * step.h, s).speed
            speed = max(abs(speed), abs(values[i]))
        _through(values, b)
    for i in range(len(b)):
        b[i] = sign * b[i] + ROUNDING * (size + abs(speed))


@helper
def _add_ground(j, step, p, Y, workspace):
    """Add the ground under node j to the bound; returns the part that resolves its waves."""
    s, b, x, values = p.system, workspace.bound, workspace.along, workspace.values
    if p.relief[2] == np.inf or not s.on_ground[j]:
        for i in range(len(b)):
            b[i] += p.relief[0] if s.on_ground[j] else 0.0
        return 1.0
    _along(s.rows[j, 0], 0, Y, workspace, x)
    low, high = np.inf, -np.inf
    for i in range(len(x)):
        travel = ground_motion(step.t + _PLACES[i] * step.h, s).travel
        xi = s.places[j, 0] + value(x, _PLACES[i], workspace.nested) - s.sliding[j, 0, 0] * travel
        low, high = min(low, xi), max(high, xi)
        values[i] = ground_at(s.profile)(xi, s.profile_parameters)[0]
    _through(values, b)
    return _WAVE * p.relief[2] / max(high - low, _WAVE * p.relief[2])


@helper
def pressed(u, j, s):
    """Magnitude of the elastic normal force of node j at penetration u."""
    return abs(normal_force(j, u, 0.0, s)[0])


@helper
def _pressed_signs(part, begin, width, rows, data):
    """Signs of a bound less the force of a penetration polynomial.

    For :func:`fecontact.integrate.bernstein.changes_of_sign`.
    """
    above, finest, j, s = data
    first, end = above - pressed(part[0], j, s), begin + width
    if first < 0.0:
        return first, first, end
    if max(pressed(smallest(part), j, s), pressed(largest(part), j, s)) <= above:
        return first, first, end
    if width > finest:
        return first, first, UNDECIDED
    return first, above - pressed(part[len(part) - 1], j, s), end


@helper
def first_pressed(b, above, finest, j, s, stack):
    """Fraction of the step at which the force of a penetration polynomial first exceeds a bound.

    ``b`` are the coefficients of the polynomial. The fraction is exact to ``finest``, the later end
    of that interval. The law's force must not fall while penetration grows, into the ground or into
    a stop above.
    """
    return first_change(_pressed_signs, (above, finest, j, s), b, stack)


@helper
def _search_stops(step, p, progress, w, workspace):
    """Note where open stops close.

    Returns the first such part, the one to which the step has to be shortened, and whether stops
    are closed.
    """
    s, b, Y = p.system, workspace.bound, progress.state
    clusters = len(p.rows)
    first, shorter, forces = 1.0, 1.0, False
    for j in range(len(s.gap)):
        if progress.closed[j]:
            forces = True
            continue
        if workspace.flights.young[j]:
            workspace.place[clusters + j] = first_landing(j, step, p, progress, w, workspace)
            first = min(first, workspace.place[clusters + j])
            continue
        size = _along(s.rows[j, 1], 0, Y, workspace, b)
        size += s.gap[j] + max(abs(p.relief[0]), abs(p.relief[1]))
        for i in range(len(b)):
            b[i] = -b[i] - s.gap[j]
        if largest(b) + p.relief[1] < 0.0:
            continue
        shorter = min(shorter, _add_ground(j, step, p, Y, workspace))
        # On waves a place at which a flight has begun is no landing.
        size = ROUNDING * size + workspace.flights.sunk[j]
        for i in range(len(b)):
            b[i] = size - b[i]
        workspace.place[clusters + j] = first_below(b, workspace.halves)
        first = min(first, workspace.place[clusters + j])
    return first, shorter, forces


@helper
def _search_clusters(step, p, progress, workspace):
    """Note where slip comes to rest; returns the first such part, and whether clusters stick."""
    first, forces = 1.0, False
    for k in range(len(p.rows)):
        status = progress.status[k]
        if status == STICK:
            forces = True
        elif status == 1 or status == -1:
            _set_slip(k, float(status), step, p, progress.state, workspace)
            workspace.place[k] = first_below(workspace.bound, workspace.halves)
            first = min(first, workspace.place[k])
    return first, forces


@helper
def least_depth(j, p, limits):
    """Depth of node j [m] below which errors of the places are not measured relative to these."""
    depth = 0.0
    for i in range(p.rows.shape[1]):
        depth = max(depth, abs(p.system.rows[j, 1, i]) * limits.floor[i])
    return depth


@helper
def missed_force(b, part, j, p, limits):
    """Force of node j in a step that shows a contact which both its ends have missed.

    ``b`` are the coefficients of the penetration; ``part`` of its tolerance is no contact.
    """
    s = p.system
    ends = max(pressed(b[0], j, s), pressed(b[len(b) - 1], j, s))
    return _MISSED * ends + pressed(part * limits.rtol * least_depth(j, p, limits), j, s)


@helper
def _search_nodes(first, forces, step, p, limits, progress, workspace):
    """Note where clusters that are open touch the ground; returns as :func:`_search_stops`."""
    s, b, Y, place = p.system, workspace.bound, progress.state, workspace.place
    shorter = 1.0
    for j in range(len(s.gap)):
        _along(s.rows[j, 1], 0, Y, workspace, b)
        for i in range(len(b)):
            b[i] = -b[i] - s.gap[j]
        low = pressed(smallest(b) + p.relief[0], j, s)
        high = pressed(largest(b) + p.relief[1], j, s)
        if low == 0.0 and high == 0.0:
            continue
        part = _add_ground(j, step, p, Y, workspace)
        before, c = pressed(b[0], j, s), p.cluster[j]
        if progress.status[c] == OPEN:
            if before == 0.0:
                shorter = min(shorter, part)
                touch = first_pressed(b, 0.0, FINEST, j, s, workspace.halves)
                place[c] = min(place[c], touch)
                first = min(first, touch)
            else:
                forces = True
            continue
        above = missed_force(b, 0.01, j, p, limits)
        if max(low, high) <= above and p.relief[0] == p.relief[1] == 0.0:
            continue
        if max(pressed(smallest(b), j, s), pressed(largest(b), j, s)) > above:
            shorter = min(shorter, part, first_pressed(b, above, ROUGHLY, j, s, workspace.halves))
    return first, shorter, forces


@routine
def first_changes(step, p, limits, progress, w, workspace):
    """Fill ``workspace.place``: the part of a step at which each cluster and stop first changes.

    ``workspace.parts`` is the interpolation of the step, ``workspace.ends`` the margins at its ends
    where anything holds. NOWHERE for those that do not change; of what comes later nothing is
    promised. Returns the part to which the step has to be shortened because it passes a contact
    that its stages have missed, or waves too short for it; 1 if it has not.
    """
    workspace.place[:] = NOWHERE
    if p.rigid != 0:
        first, shorter, forces = _search_stops(step, p, progress, w, workspace)
        rest, sticking = _search_clusters(step, p, progress, workspace)
        first, forces = min(first, rest), forces or sticking
    else:
        first, forces = _search_clusters(step, p, progress, workspace)
        first, shorter, forces = _search_nodes(first, forces, step, p, limits, progress, workspace)
    if forces:
        first_let_go(first, step, p, progress, w, workspace)
    return shorter
