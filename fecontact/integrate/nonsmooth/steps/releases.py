"""Compiled search of a step for the moment at which clusters that stick or stops that hold let go.

Forces are evaluated at a few places; the polynomial through these, less its last part, which
estimates its error, bounds them. A part of the step that this leaves undecided is halved and
searched again, and finally examined where the margin is smallest.
"""

import numpy as np

from fecontact.core.compiled import helper, routine
from fecontact.core.copies import put
from fecontact.integrate.bernstein import NOWHERE, fit
from fecontact.integrate.nonsmooth.dop853 import interpolate
from fecontact.integrate.nonsmooth.equations import set_limits, set_rates
from fecontact.integrate.nonsmooth.problem import FORCE, OPEN, STICK

# Rounding of forces that come from a system of equations, relative to their size.
_FORCE_ROUNDING = 1e-13
# Forces are examined in quarters of a part of the step.
QUARTERS = 4
_FIT_QUARTERS = fit(np.arange(QUARTERS + 1) / QUARTERS)
# Size of the part of degree four over its fourth difference, 1 / (128 * 4! / 4^4).
_LAST = 1.0 / 12.0
_SHORTEST = 2.0**-8
# Parabolas by which the least of a force is found, and how much closer each is than the one before.
_PARABOLAS, _CLOSER = 3, 1.0 / 32.0


@helper
def holding(progress):
    """Whether any cluster sticks or any stop is closed."""
    held = False
    for c in range(len(progress.status)):
        held = held or progress.status[c] == STICK
    for j in range(len(progress.closed)):
        held = held or progress.closed[j] != 0
    return held


@routine
def set_left(p, progress, w, out):
    """Fill out (2 k + n,) with the margins of sticking clusters and closed stops, both ways.

    Forces are those in w.
    """
    status, closed, clusters = progress.status, progress.closed, len(p.rows)
    set_limits(p, w)
    out[:] = 1.0
    for k in range(clusters):
        if status[k] == STICK:
            inside = w.pressing[k] > 0.0
            out[k] = w.limit[k] - w.total[k] if inside else -1.0
            out[clusters + k] = w.limit[k] + w.total[k] if inside else -1.0
        elif status[k] == OPEN:
            out[k] = -1.0 if w.pressing[k] > 0.0 else 1.0
    for j in range(len(closed)):
        if closed[j]:
            out[2 * clusters + j] = w.nodes[j, FORCE]


@routine
def _forces(part, step, p, progress, w, workspace, out):
    """Fill out (2 k + n,) with the margins at a part of the step."""
    interpolate(part, progress.state, workspace.parts, workspace.state[: 2 * p.rows.shape[1]])
    set_rates(min(step.t + part * step.h, step.latest), workspace.state, p, progress, w,
              workspace.rate)
    set_left(p, progress, w, out)


@helper
def _past(out, size):
    past = False
    for r in range(len(out)):
        past = past or out[r] < -_FORCE_ROUNDING * size[r]
    return past


@helper
def _narrow(low, high, step, p, progress, w, workspace):
    """Note the contacts that let go first between two parts of the step."""
    clusters, left, size = len(p.rows), workspace.left, workspace.scale
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        _forces(middle, step, p, progress, w, workspace, left[0])
        if _past(left[0], size):
            high = middle
        else:
            low = middle
    _forces(high, step, p, progress, w, workspace, left[0])
    for r in range(len(size)):
        if left[0, r] < -_FORCE_ROUNDING * size[r]:
            workspace.place[r if r < clusters else r - clusters] = high


@helper
def _bound(r, left):
    """Lower bound of the margin of r between the quarters of a part, estimated from them."""
    last = _LAST * abs(left[0, r] - 4.0 * left[1, r] + 6.0 * left[2, r]
                       - 4.0 * left[3, r] + left[4, r])
    least = np.inf
    for k in range(QUARTERS + 1):
        bound = -last
        for i in range(QUARTERS + 1):
            bound += _FIT_QUARTERS[k, i] * left[i, r]
        least = min(least, bound)
    return least


@helper
def _clear(left, size):
    """True if no contact lets go between the quarters of a part, estimated from them."""
    clear = True
    for r in range(len(size)):
        clear = clear and _bound(r, left) >= -_FORCE_ROUNDING * size[r]
    return clear


@helper
def _lowest(begin, width, step, p, progress, w, workspace):
    """Place in a part of the step where a contact lets go for a moment between the quarters.

    NOWHERE if none does. The vertices of parabolas lead to the smallest remaining margins.
    """
    left, size, scratch = workspace.left, workspace.scale, workspace.left[QUARTERS + 1]
    for r in range(len(size)):
        if _bound(r, left) >= -_FORCE_ROUNDING * size[r]:
            continue
        least, apart = 0, width / QUARTERS
        for i in range(1, QUARTERS + 1):
            least = i if left[i, r] < left[least, r] else least
        middle = begin + apart * least
        for _ in range(_PARABOLAS):
            middle = min(max(middle, begin + apart), begin + width - apart)
            _forces(middle - apart, step, p, progress, w, workspace, scratch)
            before = scratch[r]
            _forces(middle + apart, step, p, progress, w, workspace, scratch)
            after = scratch[r]
            _forces(middle, step, p, progress, w, workspace, scratch)
            curved = before - 2.0 * scratch[r] + after
            if curved > 0.0:
                middle += 0.5 * apart * (before - after) / curved
            middle = min(max(middle, begin), begin + width)
            _forces(middle, step, p, progress, w, workspace, scratch)
            if _past(scratch, size):
                return middle
            apart *= _CLOSER
    return NOWHERE


@helper
def first_let_go(end, step, p, progress, w, workspace):
    """Note where sticking clusters and closed stops first let go, up to the part ``end``."""
    left, size, known = workspace.left, workspace.scale, holding(progress)
    size[:] = 0.0
    workspace.waiting[0, 0], workspace.waiting[0, 1], waiting = 0.0, end, 1
    while waiting > 0:
        begin, width = workspace.waiting[waiting - 1, 0], workspace.waiting[waiting - 1, 1]
        low, high = 0.0, NOWHERE
        for i in range(QUARTERS + 1):
            here = begin + width * i / QUARTERS
            if known and (here == 0.0 or here == 1.0):
                put(workspace.ends[int(here)], left[i])
            else:
                _forces(here, step, p, progress, w, workspace, left[i])
            for r in range(len(size)):
                size[r] = max(size[r], abs(left[i, r]))
            if i > 0 and _past(left[i], size):
                low, high = begin + width * (i - 1) / QUARTERS, here
                break
        if high <= 1.0:
            _narrow(low, high, step, p, progress, w, workspace)
            return
        clear = _clear(left, size)
        if not clear and width > _SHORTEST * end:
            workspace.waiting[waiting] = begin, 0.5 * width
            workspace.waiting[waiting - 1] = begin + 0.5 * width, 0.5 * width
            waiting += 1
            continue
        high = NOWHERE if clear else _lowest(begin, width, step, p, progress, w, workspace)
        if high <= 1.0:
            _narrow(begin, high, step, p, progress, w, workspace)
            return
        waiting -= 1
