"""Tasks of a step that go over the contact nodes, and how threads take parts of them.

The thread of the run announces a task by a ticket: number of the task, number of parts, and how
many parts have been taken from either end. It takes parts from the first on, its helpers from the
last on, each by one atomic addition that tells which one; so the same nodes mostly stay in the
cache of the same core. It goes on when all parts are done. Nobody waits for a thread that has not
taken a part: one that does not run, on a busy computer, or has left, is not missed.
"""

from collections.abc import Callable

from numba import types
from numba.extending import intrinsic

from fecontact.core.addresses import function_at
from fecontact.core.compiled import helper
from fecontact.integrate.rodas5p import state

# Node forces and the rates at a stage; rates and gradients at the end of a step; rates in time; the
# Jacobian, of answers of the nodes and of products by modes; error of the slip velocities; powers
# at a point of a step.
STAGE, END, TIME_RATE, JACOBIAN, PRODUCTS, SLIP_ERROR, POWERS = range(7)
# Entries of Team.numbers: accelerations of the ground or the time, and what the task was given.
TIME, VALUE = 0, 2
NUMBERS = 3
# Entries of Team.words, those that are written on cache lines of their own: the ticket, parts
# done, whether helpers shall leave; functions that let other threads go first and that sleep, and
# how long.
_LINE = 8
TICKET, DONE, LEAVE, YIELD, SLEEP, PAUSE = 0, _LINE, 2 * _LINE, 3 * _LINE, 3 * _LINE + 1, (
    3 * _LINE + 2)
WORDS = 4 * _LINE

SHARE = Callable[[int, float, state.Problem, state.Progress, state.Room], float]
WORK = Callable[[int, int, int, state.Problem, state.Progress, state.Room], int]
share_at, work_at = function_at(SHARE), function_at(WORK)
_WORDS = types.Array(types.int64, 1, "C")
_yield_at, _sleep_at = function_at(types.int32()), function_at(types.int32(types.int32))

# Looks at the ticket before a thread lets others go first, before it sleeps in between, and before
# it leaves: some microseconds, milliseconds and a second.
_LOOKS, _YIELDS, _SLEEPS = 3000, 5000, 10_000


def _place(context, builder, signature, args):
    array = context.make_array(signature.args[0])(context, builder, args[0])
    return builder.gep(array.data, [args[1]])


@intrinsic
def load(typingctx, words, place):
    """An entry that other threads write."""
    def codegen(context, builder, signature, args):
        return builder.load_atomic(_place(context, builder, signature, args), "seq_cst", 8)

    return types.int64(_WORDS, types.int64), codegen


@intrinsic
def store(typingctx, words, place, value):
    """Write an entry that other threads read, after all that was written before."""
    def codegen(context, builder, signature, args):
        builder.store_atomic(args[2], _place(context, builder, signature, args), "seq_cst", 8)
        return args[2]

    return types.int64(_WORDS, types.int64, types.int64), codegen


@intrinsic
def add(typingctx, words, place, value):
    """Add to an entry that other threads write; returns what it was before."""
    def codegen(context, builder, signature, args):
        return builder.atomic_rmw("add", _place(context, builder, signature, args), args[2],
                                  "seq_cst")

    return types.int64(_WORDS, types.int64, types.int64), codegen


@helper
def announce(task, parts, words):
    """Offer a task of so many parts."""
    store(words, DONE, 0)
    number = (load(words, TICKET) >> 32) + 1
    store(words, TICKET, (number & 0x7FFFFFFF) << 32 | task << 24 | parts << 16)


@helper
def _left(ticket):
    """Whether a part had not been taken, and how many had been, from the first and the last on."""
    first, last, parts = ticket & 255, ticket >> 8 & 255, ticket >> 16 & 255
    return first + last < parts, first, last


@helper
def take_first(words):
    """The next part from the first on; -1 if all are taken."""
    some, first, _ = _left(add(words, TICKET, 1))
    return first if some else -1


@helper
def take_last(words):
    """Task, part and number of parts, from the last part on; a part of -1 if all are taken."""
    # Looked at first: additions must not fill the ticket.
    if not _left(load(words, TICKET))[0]:
        return 0, -1, 0
    ticket = add(words, TICKET, 256)
    some, _, last = _left(ticket)
    parts = ticket >> 16 & 255
    return ticket >> 24 & 255, parts - 1 - last if some else -1, parts


@helper
def wait_for(parts, words):
    """Wait until so many parts are done."""
    looks = 0
    while load(words, DONE) < parts:
        looks += 1
        if looks > _LOOKS:
            _yield_at(words[YIELD])()


@helper
def rest(looks, words):
    """Let time pass after so many looks in vain; whether to look again."""
    if looks > _LOOKS + _YIELDS:
        _sleep_at(words[SLEEP])(words[PAUSE])
    elif looks > _LOOKS:
        _yield_at(words[YIELD])()
    return looks < _LOOKS + _YIELDS + _SLEEPS and load(words, LEAVE) == 0
