"""Contacts and slips within a step that its stages missed.

The error of a step is estimated from forces at a few places. A node that touches the ground and
leaves it again between two of them moves as if the ground were not there, and the estimate is
small. Therefore the step polynomials of every node are searched after an accepted step. A stretch
in which a gap or slip velocity has another sign than at the ends of the step, or a force at least
twice that at the ends, counts as missed if its impulse would change the state by more than a part
of the tolerance. The step is then repeated up to a place within that stretch. The force at the end
of the new step enters the estimate of the error.
"""

from collections.abc import Callable

from fecontact.core.addresses import function_at
from fecontact.core.compiled import compile_law, helper
from fecontact.integrate.rodas5p import state as run_arrays
from fecontact.integrate.step_polynomials import (
    COEFFICIENTS,
    GAP,
    SEARCH,
    SLIP,
    StepPolynomial,
    at,
    changes,
)
from fecontact.system.node_forces import normal_force, plane_friction

_MISSED = Callable[[
    run_arrays.Step, int, run_arrays.Problem, run_arrays.Progress, run_arrays.Workspace,
], float]
first_missed_at = function_at(_MISSED)

# Smallest missed impulse that counts, as a part of the tolerance.
_PART = 0.1
# Steps end after this part of a stretch.
_JUST_PAST = 0.01
# Places at which the largest value of a stretch is sought.
_LOOKS = 8


@helper
def _matters(impulse, column, h, blocks, control, progress):
    """Whether an impulse on a node would be an error beyond the tolerance of the step."""
    speed_scale = max(progress.numbers[run_arrays.SPEED_SCALE], control.speed_scale)
    allowed = _PART * control.rtol
    for i in range(len(control.largest)):
        kick = abs(blocks.shapes[i, column]) * impulse
        place = max(progress.extremes[i], control.displacement_scale[i])
        if kick * control.largest[i] > allowed * speed_scale or kick * h > allowed * place:
            return True
    return False


@helper
def _law_force(j, u, v, s):
    """Normal force of node j."""
    return normal_force(j, u, v, s)[0]


@helper
def _missed_normal_force(j, inside, level, value, ends, brief, s):
    """Normal force that a stretch of ``brief`` s hides, where the gap over a level is ``value``.

    ``ends`` is the largest gap over the level, of either sign, at ends of the step that belong to
    the stretch.
    """
    if inside:
        size = abs(value)
        return abs(_law_force(j, level + size, 4.0 * size / brief, s)
                   - _law_force(j, level - size, 0.0, s))
    force = abs(_law_force(j, level - value, 0.0, s))
    return force if force > 2.0 * abs(_law_force(j, level - ends, 0.0, s)) else 0.0


@helper
def _missed_friction(j, inside, F, slip, ends, s):
    """Friction force that a stretch hides, for a slip velocity under the normal force F.

    ``ends`` is the largest slip velocity at ends of the step that belong to the stretch.
    """
    force = abs(plane_friction(j, slip, F, s)[0])
    if inside:
        return force + abs(plane_friction(j, -slip, F, s)[0])
    return force if force > 2.0 * abs(plane_friction(j, ends, F, s)[0]) else 0.0


@helper
def _largest(begin, end, b, polynomial):
    """Largest value of a polynomial between two parts of the step, its place, and that at ends.

    Only ends of the step itself count; zero where neither lies between the parts.
    """
    place, largest, ends = begin, 0.0, 0.0
    for look in range(_LOOKS + 1):
        part = begin + (end - begin) * look / _LOOKS
        value = at(part, b, polynomial)
        if abs(value) > abs(largest):
            largest, place = value, part
        if (part == 0.0 or part == 1.0) and abs(value) > abs(ends):
            ends = value
    return place, largest, ends


@helper
def _normal_force(place, polynomial, height):
    """Magnitude of the normal force of a node at a part of the step, without damping."""
    s, n = polynomial.system, len(polynomial.system.gap)
    for i in range(COEFFICIENTS):
        height[i] = polynomial.coefficients[i, n + polynomial.node]
    gap = StepPolynomial(GAP, polynomial.node, 0.0, polynomial.step, s, polynomial.bounds,
                         polynomial.coefficients, polynomial.row)
    return abs(_law_force(polynomial.node, -at(place, height, gap), 0.0, s))


def _first_missed(step, again, problem, progress, workspace):
    """Part of the step at which to end it because of what it did not feel; 2 if there is nothing.

    It is the earliest such place of all nodes: just past the begin of the stretch, or, when this
    is not the first attempt (``again``) or the begin is that of the step, where the force is
    largest.
    """
    s, blocks, control = problem.system, problem.blocks, problem.control
    levels, places = control.levels, workspace.places
    b, height, row = workspace.bound[0], workspace.bound[1], workspace.bound[2]
    n = len(s.gap)
    first = 2.0
    for column in range(2 * n):
        what, j = (SLIP, column) if column < n else (GAP, column - n)
        if workspace.polynomials[SEARCH, column] == 0.0 or (
                what == SLIP and (s.memory[j] > 0 or s.rows.shape[1] > 2)):
            continue
        for level in range(levels.shape[0] if what == GAP else 1):
            shift = levels[level, j] if what == GAP else 0.0
            polynomial = StepPolynomial(what, j, shift, step, s, control.ground,
                                        workspace.polynomials, row)
            found = changes(b, polynomial, workspace.halves, places)
            for k in range(found + 1):
                begin = places[k - 1] if k > 0 else 0.0
                end = places[k] if k < found else 1.0
                if begin >= first:
                    break
                place, largest, ends = _largest(begin, end, b, polynomial)
                inside, brief = begin > 0.0 and end < 1.0, (end - begin) * step.h
                force = 0.0
                if what == GAP:
                    force = _missed_normal_force(j, inside, shift, largest, ends, brief, s)
                elif abs(largest) > control.slip_scale[j]:
                    F = _normal_force(place, polynomial, height)
                    if F > 0.0:
                        force = _missed_friction(j, inside, F, largest, ends, s)
                if force > 0.0 and _matters(2.0 / 3.0 * force * brief, column, step.h, blocks,
                                            control, progress):
                    if again == 0 and begin > 0.0:
                        place = begin + _JUST_PAST * (end - begin)
                    first = min(first, place)
    return first


# By its address: few steps need it, and it need not be compiled into all.
first_missed = compile_law(_MISSED, "first_missed(step, again, problem, progress, workspace)",
                           _first_missed)
