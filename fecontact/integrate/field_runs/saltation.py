r"""Jumps of derivatives where forces jump, as at touch-down on a spring with a dashpot.

If the penetration u of a node passes, at the rate u', a level at which the rates y' of the state
jump by D, a motion beside it, whose penetration differs by du, passes it by du / u' earlier, and
feels D for so long (saltation):

.. math:: dy^+ = dy^- + D\, du / u', \qquad du = \nabla u \cdot dy^- + (\partial u / \partial p) dp
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array
from fecontact.integrate.events import ContactEvents
from fecontact.integrate.rodas5p.driver import start
from fecontact.integrate.run_limits import largest_motions
from fecontact.integrate.step_runs import finish
from fecontact.laws.base import NormalLaw
from fecontact.system import columns, kernels
from fecontact.system.contact_system import ContactSystem
from fecontact.system.elastic_sliders import slider_counts
from fecontact.system.node_forces import normal_values

# Parts of the penetration scale: how far from a level forces are examined, within what an event is
# at a level, and by what nodes are moved for derivatives of their penetration.
_ASIDE, _AT_LEVEL, _MOVE = 1e-6, 1e-4, 1e-2
# So much closer to a level a force that does not jump has changed much less across it.
_CLOSER, _JUMPS = 1e-3, 0.5
# A change of the rates at once by more than this part of what they change beside it is a jump.
_JUMP = 1e-3

Above = tuple[ContactSystem, ContactSystem, float]


@dataclass(frozen=True, eq=False)
class Passage:
    """A node that passes a level at which its force jumps.

    ``jump`` (size,) is D / u', ``ahead`` (size,) is grad u and ``moved`` is du/dp.
    """

    time: float
    jump: Array
    ahead: Array
    moved: float

    def across(self, columns: Array) -> Array:
        """Derivatives (size, k) after it; the last of size + 1 columns is that to the parameter."""
        ahead = self.ahead @ columns
        if columns.shape[1] > len(self.jump):
            ahead[-1] += self.moved
        return np.asarray(columns + self.jump[:, None] * ahead)


def jumping_nodes(system: ContactSystem) -> NDArray[np.bool_]:
    """Whether the normal force (n,) of each node jumps where it begins or ends, at some rate."""
    found = np.zeros(system.basis.contact_nodes, dtype=np.bool_)
    for nodes, share, law in system.law_groups("normal"):
        near, speed = _ASIDE * law.penetration_scale, system.velocity_scale
        for level in law.onsets(len(share)):
            for rate in (-speed, speed):
                found[nodes] |= _jumps(law, level, near, np.full(len(share), rate),
                                       law.table(share))
    return found


def _jumps(
    law: NormalLaw, level: Array, near: float, rate: Array, table: Array,
) -> NDArray[np.bool_]:
    """Whether forces (n,) differ across a level as much as from a thousand times closer to it."""
    def across(by: float) -> Array:
        out, slope = np.empty((2, len(level))), np.empty(len(level))
        for row, side in zip(out, (by, -by), strict=True):
            normal_values(np.full(len(level), law.kernel.address), level + side, rate, table, row,
                          slope)
        return np.abs(out[0] - out[1])

    # Laws without an onset name a level beyond all forces, where these have no difference.
    with np.errstate(invalid="ignore"):
        return np.asarray(across(_CLOSER * near) > _JUMPS * across(near))


def passages(
    system: ContactSystem, state: Array, times: Array, rtol: float, max_step: float | None = None,
    beside: Above | None = None,
) -> list[Passage]:
    """Passages of nodes through levels at which their forces jump, in a run over these times.

    ``beside`` is the system with a parameter moved up and down, and the difference of both.
    """
    jumping = jumping_nodes(system)
    if not jumping.any():
        return []
    run = start(system, state, times[[0, -1]], rtol=rtol, max_step=max_step, work=False,
                events=[ContactEvents()], method="rodas5p")
    # The function that needs derivatives reports a failed run.
    finish(run)
    levels, events = run.problem.control.levels, run.events
    found = []
    for t, kind, node, y in zip(events.time.tolist(), events.kind, events.node.tolist(),
                                events.states, strict=True):
        if kind in ("touch-down", "lift-off") and jumping[node]:
            passed = _passage(system, levels[:, node], t, node, y, beside)
            if passed is not None:
                found.append(passed)
    return found


def _passage(
    system: ContactSystem, levels: Array, time: float, node: int, y: Array, beside: Above | None,
) -> Passage | None:
    """Jump of the derivatives as a node passes a level; None for a level that it does not reach."""
    def penetrations(states: Array, of: ContactSystem = system) -> Array:
        return of.contact_history(np.full(len(states), time), states)[
            :, node, columns.PENETRATION]

    depth = system.penetration_scale
    contact = system.contact_history(np.array([time]), y[None])[0, node]
    u, rate = float(contact[columns.PENETRATION]), float(contact[columns.PENETRATION_RATE])
    level = float(levels[np.argmin(np.abs(levels - u))])
    if not abs(u - level) < _AT_LEVEL * depth or rate == 0.0:
        return None
    m, ahead = system.basis.modes, np.zeros(len(y))
    steps = _MOVE * depth / largest_motions(system)
    moves = steps[:, None] * np.eye(m, len(y))
    ahead[:m] = (penetrations(y + moves) - penetrations(y - moves)) / (2.0 * steps)
    near = ahead * (_ASIDE * depth / (ahead @ ahead))
    middle = y + ahead * ((level - u) / (ahead @ ahead))
    # Forces of the other nodes stay as they are.
    alone = np.arange(system.basis.contact_nodes) == node
    arrays = system.arrays._replace(rows=alone[:, None, None] * system.arrays.rows)

    def rates(state: Array) -> Array:
        out = np.empty(len(y))
        kernels.right_hand_side(time, state, arrays, out)
        # Steps carry the derivatives of internal variables over the passage themselves.
        out[2 * m :] = 0.0
        return out

    # Both sides up to the level.
    way = np.sign(rate) * near
    if slider_counts(system)[node] and not system.contact_history(
            np.array([time]), (middle - way)[None])[0, node, columns.NORMAL_FORCE]:
        # Elastic elements begin without deflection; in the open they have followed the slip.
        middle[2 * m :].reshape(len(alone), -1)[node] = 0.0
    after, further = rates(middle + way), rates(middle + 2.0 * way)
    before, earlier = rates(middle - way), rates(middle - 2.0 * way)
    jump = 2.0 * after - further - (2.0 * before - earlier)
    change = np.abs(np.array([after - further, before - earlier])).max()
    if not np.abs(jump).max() > _JUMP * change:
        return None
    moved = 0.0
    if beside is not None:
        above, below, width = beside
        moved = float((penetrations(y[None], above) - penetrations(y[None], below))[0]) / width
    return Passage(time, jump / rate, ahead, moved)


def with_passages(times: Array, found: Sequence[Passage]) -> Array:
    """Output times of a run whose derivatives are to be :func:`joined` at the passages."""
    return np.unique(np.concatenate([times, [one.time for one in found]]))


def joined(columns: Array, times: Array, found: Sequence[Passage]) -> Array:
    """Derivatives (N - 1, size, k) between times (N,), from those between :func:`with_passages`.

    ``columns`` are these (P - 1, size, k); with k = size + 1 the last is that to the parameter.
    """
    size = columns.shape[1]
    every = with_passages(times, found)
    out, at = [], 0
    for end in times[1:]:
        whole = np.eye(size, columns.shape[2])
        while at < len(every) - 1 and every[at + 1] <= end:
            forced = columns[at].copy()
            forced[:, :size] = 0.0
            whole = columns[at][:, :size] @ whole + forced
            at += 1
            for one in found:
                if one.time == every[at]:
                    whole = one.across(whole)
        out.append(whole)
    return np.array(out).reshape(len(times) - 1, size, columns.shape[2])


def touch_down_on_jumps(system: ContactSystem, times: Array, states: Array) -> bool:
    """Whether a node whose normal force jumps is open at one of the times and closed at the next.

    ``states`` (N, size) are those of a closed orbit at ``times`` (N,).
    """
    jumping = jumping_nodes(system)
    if not jumping.any():
        return False
    closed = system.contact_history(times, states)[:, jumping, columns.NORMAL_FORCE] != 0.0
    return bool((np.roll(closed, 1, axis=0) != closed).any())
