"""Workspace of steps by collocation, and the systems to which they apply."""

from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.records import allocate
from fecontact.core.types import Array, Integers
from fecontact.integrate import bernstein
from fecontact.integrate.collocation.tableau import (
    PLACE_TERMS,
    RATE_TERMS,
    SPEED_TERMS,
    STAGES,
)
from fecontact.integrate.events import AnyEvent
from fecontact.integrate.rodas5p import dynamics
from fecontact.integrate.small_systems import not_small
from fecontact.system.contact_system import ContactSystem
from fecontact.system.nodes import MODES, NODES
from fecontact.system.powers import WORKS

# Largest rtol at which it is taken unasked: steps of Rodas5P do not become much longer above.
ACCURATE = 1e-7
# Errors of a step, in parts of the tolerance of the run, and at least.
_PART, _ROUNDING = 0.1, 1e-13
# Entries of `Collocation.flags`.
BEGINS, JACOBIANS, ITERATIONS = range(3)
# Entries of `Collocation.cuts`: attempts at a step that ended at a switch, the longest of these,
# and by which part the last one ended beyond it.
AGAIN, WHOLE, PAST = range(3)


class Step(NamedTuple):
    """A step that is tried, as :class:`fecontact.integrate.rodas5p.state.Step`.

    ``wanted`` is the length that it should have had.
    """

    t: float
    h: float
    target: float
    latest: float
    at_break: bool
    wanted: float


class Collocation(NamedTuple):
    """A step by collocation: what it hands on to the next one, and workspace.

    P is the number of powers of the system and its nodes, s that of the stages.

    Attributes
    ----------
    tolerance : float
        Error of a step as a part of the scales of the run.
    flags : (3,) integer array
        Whether the equations may change here, so that nothing is extrapolated from the step before;
        Jacobians so far; iterations of the last step.
    cuts : (3,) array
        Why and by how much the step was cut short.
    accelerations : (s + 1, m) array
        At the begin of the step and at its stages.
    before : (s + 1, m) array
        Coefficients of those of the step before.
    matrix, right, pivots : (s m, s m), (s m,), (s m,) arrays
        The linear system of Newton's method.
    small, small_right, small_pivots : (m, m), (m,), (m,) arrays
        Linear system of a defect.
    given, load, speeds : (s, 10), (s, m), (s + 1,) arrays
        Prescribed motions and loads at the stages, and the speed of the ground at the begin too.
    y, after, rate : (2 m,) arrays
        States of a stage and at the end, and a rate.
    places, rates : (s + 3, m), (s + 2, m) arrays
        Coefficients of displacements and velocities over the step.
    powers, work : (s + 1, P), (s + 2, P) arrays
        Powers at the begin and at the stages, and coefficients of their integrals.
    looked : (P,) array
        Powers within the step.
    line, halves, found : (3, s + 3), (d, s + 4), (s + 3,) arrays
        Work arrays of the search for changes of sign.
    """

    tolerance: float
    flags: Annotated[Integers, 3]
    cuts: Annotated[Array, 3]
    accelerations: Annotated[Array, RATE_TERMS, MODES]
    before: Annotated[Array, RATE_TERMS, MODES]
    matrix: Annotated[Array, STAGES * MODES, STAGES * MODES]
    right: Annotated[Array, STAGES * MODES]
    pivots: Annotated[Integers, STAGES * MODES]
    small: Annotated[Array, MODES, MODES]
    small_right: Annotated[Array, MODES]
    small_pivots: Annotated[Integers, MODES]
    given: Annotated[Array, STAGES, dynamics.GIVEN]
    load: Annotated[Array, STAGES, MODES]
    speeds: Annotated[Array, RATE_TERMS]
    y: Annotated[Array, 2 * MODES]
    after: Annotated[Array, 2 * MODES]
    rate: Annotated[Array, 2 * MODES]
    places: Annotated[Array, PLACE_TERMS, MODES]
    rates: Annotated[Array, SPEED_TERMS, MODES]
    powers: Annotated[Array, RATE_TERMS, WORKS]
    work: Annotated[Array, SPEED_TERMS, WORKS]
    looked: Annotated[Array, WORKS]
    line: Annotated[Array, 3, PLACE_TERMS]
    halves: Annotated[Array, bernstein.DEPTH, PLACE_TERMS + 1]
    found: Annotated[Array, PLACE_TERMS]


def collocation_for(modes: int, nodes: int, rtol: float) -> Collocation:
    """Workspace for a system of so many modes and nodes, before its first step."""
    return allocate(Collocation, {MODES: modes, NODES: nodes},
                    tolerance=max(_PART * rtol, _ROUNDING), flags=np.array([1, 0, 0]))


def chosen_collocation(
    system: ContactSystem, rtol: float, events: Sequence[AnyEvent], asked: bool,
) -> Collocation | None:
    """Workspace for a run by collocation; InputError where it is asked for in vain."""
    if not asked and rtol > ACCURATE:
        return None
    found = obstacle(system, events)
    if found is not None:
        if asked:
            raise InputError(f"Radau() is for small plane systems on flat ground, but {found}; "
                             f"take Auto().")
        return None
    return collocation_for(system.basis.modes, system.basis.contact_nodes, rtol)


def obstacle(system: ContactSystem, events: Sequence[AnyEvent]) -> str | None:
    """Why a run of a system with such events cannot be by collocation, or None."""
    large = not_small(system.arrays)
    if large is not None:
        return large
    if system.ground.wavy and system.basis.ground_nodes.any():
        return "the ground is wavy"
    if events:
        return "events are not located in its steps"
    return None
