"""The loop over the steps of a run, the same for all methods that go on by steps they may refuse.

A method is a list of compiled functions of its own data. The loop is compiled for each of them.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from fecontact.core.compiled import helper, kernel

# How a call of the loop ended.
RUNNING, FINISHED, MINIMUM_STEP, NOT_FINITE, STOPPED, PARADOX, IMPACT_UNSOLVED = range(7)
# First entries of ``progress.numbers``: the time reached, and the length of the next step; and of
# ``progress.counts``, of which the last three are about what is kept between outputs: the rows so
# far, the places passed since the last row, and how often every second row was dropped.
TIME, STEP = range(2)
COUNTS = 8
STARTED, OUTPUTS, STEPS, REJECTIONS, RATES, KEPT, PASSED, HALVED = range(COUNTS)
# Outcome of an attempt at a step: taken; repeated as the state at its start has been corrected;
# repeated with exactly the length that is returned; with about that length; with a shorter one, as
# its error was too large or not finite, or its impulses were not found.
TAKEN, ANEW, CUT, SHORTER, FAILED, NOT_A_NUMBER, NOT_SOLVED = range(7)
# Rows between outputs that a step may keep at most.
MOST_PLACES = 16
# The part of a step after which a run ends that goes on.
BEYOND = 2.0


@helper
def _nothing(t, data):
    """Nothing."""
    return RUNNING


@helper
def _no_events(data):
    """False: none are noted."""
    return False


@helper
def _no_end(step, data):
    """Beyond the step."""
    return BEYOND


@helper
def _keep_nothing(step, writes, data):
    """Nothing."""


@helper
def _never(part, step, data):
    """Nothing: runs do not end within steps."""


@helper
def is_crowded(counts, times):
    """Whether the rows kept between outputs, which have room for these times, are to be halved."""
    return len(times) > 0 and counts[KEPT] + MOST_PLACES > len(times)


@helper
def _keep_none(row, step, reached, data):
    """Nothing: no rows are kept between outputs."""


def _keeping(fill: Any, places: int) -> tuple[Any, Any]:
    """The functions by which a loop keeps rows at so many places of each step.

    A place is kept unless an output lies between it and the place before. Where the rows have been
    halved, only every second, fourth ... of the places in a row is.
    """

    @helper
    def keep(row, step, reached, data):
        """Keep rows of a step up to the time reached, whose first output is in ``row``."""
        kept, counts, times = data.kept, data.progress.counts, data.output.times
        if len(kept.times) == 0:
            return
        for k in range(1, places + 1):
            time = step.target if k == places else step.t + step.h * k / places
            if time > reached:
                break
            shown = row < counts[OUTPUTS] and times[row] <= time
            while row < counts[OUTPUTS] and times[row] <= time:
                row += 1
            if shown:
                counts[PASSED] = 0
            elif time > step.t:
                counts[PASSED] += 1
                if counts[PASSED] >= 1 << counts[HALVED]:
                    kept.times[counts[KEPT]] = time
                    fill(counts[KEPT], kept, step, data)
                    counts[KEPT] += 1
                    counts[PASSED] = 0

    @helper
    def crowded(data):
        """Whether a step may have more rows than there is room for."""
        return is_crowded(data.progress.counts, data.kept.times)

    return keep, crowded


class Method(NamedTuple):
    """The compiled functions of a method that the loop calls, with its ``data``, a record.

    The record has ``progress`` with ``state``, ``numbers`` and ``counts``, and ``output`` with
    ``times`` and ``states``. A step has its begin ``t``, its length ``h`` and the time ``target``
    at its end.

    Attributes
    ----------
    name : str
    data : type
        The record.
    aim(t, h, last, smallest, data)
        The step to try, of about the length h; ``last`` is the outcome of the attempt before.
    attempt(step, last, smallest, data)
        Try it; the outcome, and the length of the next attempt or step.
    fill(row, output, step, data)
        Fill a row of ``data.output``, or of ``data.kept``, whose time is in the step.
    go_on(step, h, data)
        Make the state at the end of the step the state of the run; how the run stands, and the
        length of the next step, which is h but for what happens there.
    begin(t, data)
        Prepare the first step of a run; how it stands. The first row of the states is filled;
        ``counts[OUTPUTS] = 0`` leaves it to the first step.
    resume(t, data)
        Set the data that is not kept between calls.
    close(step, writes, data)
        Finish an accepted step before its outputs are filled; ``writes`` says if there are any.
    full(data)
        Whether there is no room left for the events of a step.
    find_end(step, data)
        Note the events of a step; the part of it after which the run ends.
    stop_at(part, step, data)
        Make the state at that part the state of the run.
    places : int
        Rows between outputs are kept in ``data.kept``, a record like ``data.output``, at so many
        places of each step, MOST_PLACES at most; zero if there is no such record. The call returns
        where there may be no room for those of the next step.
    """

    name: str
    data: type
    next_target: Callable[..., Any]
    attempt: Callable[..., Any]
    fill: Callable[..., Any]
    go_on: Callable[..., Any]
    begin: Callable[..., Any] = _nothing
    resume: Callable[..., Any] = _nothing
    close: Callable[..., Any] = _keep_nothing
    full: Callable[..., Any] = _no_events
    find_end: Callable[..., Any] = _no_end
    stop_at: Callable[..., Any] = _never
    places: int = 0


def step_loop(method: Method, constants: str = "") -> Any:
    """The compiled loop ``advance(data, most)`` of a method; ``constants`` as for a kernel.

    It goes on until ``most`` steps have been tried and one was taken, and returns how it ended.
    Rows of the output are filled that belong to the times passed. A run that is continued gives
    the same numbers as one that was not interrupted. Where events find no
    room the call returns.
    """
    next_target, attempt, fill, go_on, begin, resume, close, full, find_end, stop_at = method[2:-1]
    keep, crowded = _keeping(fill, method.places) if method.places else (_keep_none, _no_events)

    def advance(data, most):
        progress, output = data.progress, data.output
        numbers, counts, times = progress.numbers, progress.counts, output.times
        smallest = 1e-14 * max(abs(times[0]), abs(times[-1]))
        if counts[STARTED] == 0:
            for k in range(len(progress.state)):
                output.states[0, k] = progress.state[k]
            counts[STARTED], counts[OUTPUTS] = 1, 1
            status = begin(numbers[TIME], data)
            if status != RUNNING:
                return status
        t, h = numbers[TIME], numbers[STEP]
        resume(t, data)
        last, attempts = TAKEN, 0
        while counts[OUTPUTS] < len(times):
            # A step that failed is repeated before the call returns: derivatives are not kept.
            if last == TAKEN and (attempts >= most or full(data) or crowded(data)):
                break
            attempts += 1
            step = next_target(t, h, last, smallest, data)
            last, h = attempt(step, last, smallest, data)
            if last != TAKEN:
                counts[REJECTIONS] += 1
                if last >= FAILED and not h >= smallest:
                    numbers[TIME], numbers[STEP] = t, h
                    if last == FAILED:
                        return MINIMUM_STEP
                    return NOT_FINITE if last == NOT_A_NUMBER else IMPACT_UNSOLVED
                continue

            part = find_end(step, data)
            ends = part <= 1.0
            reached = step.t + part * step.h if part < 1.0 else step.target
            first = row = counts[OUTPUTS]
            close(step, times[row] <= reached, data)
            while row < len(times) and times[row] <= reached:
                fill(row, output, step, data)
                row += 1
            counts[OUTPUTS] = row
            keep(first, step, reached, data)
            counts[STEPS] += 1
            if ends:
                stop_at(part, step, data)
                numbers[TIME], numbers[STEP] = reached, step.h
                return STOPPED
            status, h = go_on(step, h, data)
            t = step.target
            if status != RUNNING:
                numbers[TIME], numbers[STEP] = t, h
                return status
        numbers[TIME], numbers[STEP] = t, h
        return FINISHED if counts[OUTPUTS] == len(times) else RUNNING

    advance.__qualname__ = f"advance_{method.name}"
    advance.__annotations__ = {"data": method.data, "most": int, "return": int}
    return kernel(advance, constants=constants, nogil=True)

