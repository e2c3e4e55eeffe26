"""Lengths of steps by the errors of those before, and where they must end.

The control is predictive (Gustafsson). An error counts by its root e^(-1/5), the factor by which a
step would have to change for the error that is allowed.
"""

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.simd.functions import by_kind, reciprocal_fifth_root
from fecontact.core.simd.vectors import select
from fecontact.integrate.rodas5p.tableau import ORDER
from fecontact.integrate.step_loop import STEP

# Entries of the numbers that a run goes on from, after those of the step loop: whether the last
# step was rejected, length and root of the last one that was accepted.
REJECTED_LAST, LAST_STEP, LAST_ROOT = range(STEP + 1, STEP + 4)

SMALLEST_FACTOR = 0.1
_SAFETY, _LARGEST_FACTOR = 0.9, 8.0
_POWER = -1.0 / ORDER
# Errors count as within these bounds.
_LEAST, _LARGEST = 1e-6, 1e10
# The last error counted as a hundredth at least.
_LARGEST_LAST_ROOT = 1e-2**_POWER
# The root of a last step that no step has to shrink after.
_NO_TREND = 1e-30


@helper
def _power(error):
    return error**_POWER


_root = by_kind(_power, reciprocal_fifth_root)


@helper
def root_of(error):
    """The root of an error, given as a multiple of what is allowed; not for NaN."""
    return _root(min(max(error, _LEAST), _LARGEST))


@helper
def growth(root):
    """Factor of the length of the next step, by the error of this one alone."""
    return min(_LARGEST_FACTOR, max(SMALLEST_FACTOR, _SAFETY * root))


@helper
def next_length(h, root, longest, numbers):
    """Length of the step after an accepted one of the length h, which ``numbers`` take note of."""
    return min(h * predicted(growth(root), h, root, _LARGEST_LAST_ROOT, numbers), longest)


@helper
def length_beyond(caution, h, root, longest, numbers):
    """Length of the step after an accepted one that may have been cut at a kink of the forces.

    A cut step is followed by what its error alone allows, up to |``caution``|, its length before
    it was cut; that is zero for other steps. Cut steps begin no trend. Where one allows all growth
    it tells nothing, as it may be as short as a kink is near: the step before it counts then.
    """
    before = numbers[LAST_STEP]
    usual, cut = next_length(h, root, longest, numbers), caution != 0.0
    numbers[LAST_ROOT] = select(cut, _NO_TREND, numbers[LAST_ROOT])
    factor = growth(root)
    length = select(factor < _LARGEST_FACTOR, h * factor, max(h * factor, before))
    return select(cut, min(length, abs(caution)), usual)


@helper
def predicted(factor, h, root, largest_root, numbers):
    """``factor`` of the length of the next step, or less by the trend; ``numbers`` take note."""
    # Steps that had to shrink will have to shrink on.
    trend = h / numbers[LAST_STEP] * (root / numbers[LAST_ROOT])
    factor = select(numbers[LAST_STEP] > 0.0,
                    max(SMALLEST_FACTOR, min(factor, factor * trend)), factor)
    factor = select(numbers[REJECTED_LAST] != 0.0, min(factor, 1.0), factor)
    numbers[LAST_STEP], numbers[LAST_ROOT] = h, min(root, largest_root)
    numbers[REJECTED_LAST] = 0.0
    return factor


@helper
def next_stop(t, breaks, end):
    """The next break or the end, the last time before it, and whether it is a break.

    Signals may jump at all times from the first to the last of a break: it is approached from
    below the first, and the step ends at the last.
    """
    for k in range(len(breaks)):
        if t < breaks[k, 1]:
            return breaks[k, 1], np.nextafter(breaks[k, 0], t), True
    return end, end, False


@helper
def target_of(t, h, exactly, stop):
    """End of a step of about the length h, or ``exactly`` that, but not past ``stop``.

    What would leave a short rest is as long as it takes, or half of that.
    """
    target = t + h
    near = select(target + h > stop, t + 0.5 * (stop - t), target)
    near = select(target + 0.01 * h >= stop, stop, near)
    return select(exactly, min(target, stop), near)
