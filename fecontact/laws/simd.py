"""Laws for eight contact nodes at once, one in each SIMD lane, made of the laws themselves.

They serve runs of many small systems side by side (:mod:`fecontact.integrate.simd`). Arguments and
results are those of :mod:`fecontact.laws.signatures`, eight of each, parameters ``p`` (k, 8). A law
whose branches only choose values by :func:`fecontact.core.simd.functions.select` is compiled for
eight numbers; one with other branches is called for one lane after the other.
"""

from contextlib import suppress
from types import FunctionType
from typing import Any
from weakref import WeakKeyDictionary

from numba import types

from fecontact.core.addresses import function_at
from fecontact.core.compiled import CompiledLaw, compile_law, law_at
from fecontact.core.errors import InputError
from fecontact.core.kernel_parts import part
from fecontact.core.records import Matrix, numba_type
from fecontact.core.simd.functions import lane_of, rows, with_lane
from fecontact.core.simd.vectors import WIDTH, lanes, spread

_NODE = types.UniTuple(lanes, 3)(lanes, lanes, numba_type(Matrix))
_SIGNAL = types.UniTuple(lanes, 2)(lanes, numba_type(Matrix))
node_lanes_at = function_at(_NODE, only_reads=True)
signal_lanes_at = function_at(_SIGNAL, only_reads=True)


# Functions for eight lanes, in which ``law`` stands for a part of them; it is no variable of an
# outer function, since numba would not find their stored code again.
law: Any = None


def _at_once(a, b, p):
    """The law with eight numbers in place of each."""
    return law(a, b, rows(p))


def _at_once_in_time(t, p):
    return law(t, rows(p))


def _one_by_one(a, b, p):
    """The law for one lane after the other."""
    force, by_first, by_second = spread(0.0), spread(0.0), spread(0.0)
    for lane in range(WIDTH):
        found = law(lane_of(a, lane), lane_of(b, lane), p[:, lane])
        force = with_lane(force, lane, found[0])
        by_first = with_lane(by_first, lane, found[1])
        by_second = with_lane(by_second, lane, found[2])
    return force, by_first, by_second


def _one_by_one_in_time(t, p):
    value, rate = spread(0.0), spread(0.0)
    for lane in range(WIDTH):
        found = law(lane_of(t, lane), p[:, lane])
        value, rate = with_lane(value, lane, found[0]), with_lane(rate, lane, found[1])
    return value, rate


_MADE: WeakKeyDictionary[CompiledLaw, CompiledLaw | None] = WeakKeyDictionary()


def simd_law(one: CompiledLaw) -> CompiledLaw | None:
    """The function for eight lanes of a normal law, a friction law without memory or a signal.

    None if the law cannot be compiled for them.
    """
    if one not in _MADE:
        _MADE[one] = _made(one)
    return _MADE[one]


def _made(one: CompiledLaw) -> CompiledLaw | None:
    signal = one.form.startswith("f(t")
    ways = (_at_once_in_time, _one_by_one_in_time) if signal else (_at_once, _one_by_one)
    inside = part(one.python, error_model="numpy", forceinline=True)
    for way in ways:
        # Compiled code is stored beside the law, under a name of its own. Numba reads the source at
        # that place, which must be the beginning of a function.
        place = one.python.__code__
        function = FunctionType(
            way.__code__.replace(co_filename=place.co_filename,
                                 co_firstlineno=place.co_firstlineno),
            {**globals(), "law": inside}, one.python.__name__)
        function.__module__ = one.python.__module__
        function.__qualname__ = f"{one.python.__qualname__}.eight.{way.__name__}"
        made = compile_law(_SIGNAL if signal else _NODE, f"{one.form}, eight of each", function)
        with suppress(InputError):
            made.address  # noqa: B018 - compiles it
            return made
    return None


def simd_address(address: int) -> int | None:
    """Address of the function for eight lanes of the law at an address; None if there is none."""
    found = simd_law(law_at(address))
    return None if found is None else found.address
