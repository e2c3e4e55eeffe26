"""Laws for eight contact nodes at once, one in each SIMD lane, made of the laws themselves.

They serve runs of many small systems side by side (:mod:`fecontact.integrate.lanes`). Arguments and
results are those of :mod:`fecontact.laws.signatures`, eight of each, parameters ``p`` (k, 8). A law
whose branches only choose values by :func:`fecontact.core.lanes.functions.select` is compiled for
eight numbers; one with other branches is called for one lane after the other.
"""

from collections.abc import Callable
from contextlib import suppress
from typing import Any
from weakref import WeakKeyDictionary

from numba import types

from fecontact.core.addresses import function_at
from fecontact.core.compiled import CompiledLaw, compile_law, law_at
from fecontact.core.errors import InputError
from fecontact.core.kernel_parts import part
from fecontact.core.lanes.functions import lane_of, rows, with_lane
from fecontact.core.lanes.vectors import WIDTH, lanes, spread
from fecontact.core.records import Matrix, numba_type

_NODE = types.UniTuple(lanes, 3)(lanes, lanes, numba_type(Matrix))
_SIGNAL = types.UniTuple(lanes, 2)(lanes, numba_type(Matrix))
node_lanes_at = function_at(_NODE, only_reads=True)
signal_lanes_at = function_at(_SIGNAL, only_reads=True)


def _at_once(law: Any, signal: bool) -> Callable[..., Any]:
    """The law with eight numbers in place of each."""
    if signal:
        return lambda t, p: law(t, rows(p))
    return lambda a, b, p: law(a, b, rows(p))


def _one_by_one(law: Any, signal: bool) -> Callable[..., Any]:
    """A loop over the lanes."""

    def at_times(t, p):
        value, rate = spread(0.0), spread(0.0)
        for lane in range(WIDTH):
            found = law(lane_of(t, lane), p[:, lane])
            value, rate = with_lane(value, lane, found[0]), with_lane(rate, lane, found[1])
        return value, rate

    def at_nodes(a, b, p):
        force, by_first, by_second = spread(0.0), spread(0.0), spread(0.0)
        for lane in range(WIDTH):
            found = law(lane_of(a, lane), lane_of(b, lane), p[:, lane])
            force = with_lane(force, lane, found[0])
            by_first = with_lane(by_first, lane, found[1])
            by_second = with_lane(by_second, lane, found[2])
        return force, by_first, by_second

    return at_times if signal else at_nodes


_MADE: WeakKeyDictionary[CompiledLaw, CompiledLaw | None] = WeakKeyDictionary()


def simd_law(law: CompiledLaw) -> CompiledLaw | None:
    """The function for eight lanes of a normal law, a friction law without memory or a signal.

    None if the law cannot be compiled for them.
    """
    if law not in _MADE:
        _MADE[law] = _made(law)
    return _MADE[law]


def _made(law: CompiledLaw) -> CompiledLaw | None:
    signal = law.form.startswith("f(t")
    one = part(law.python, error_model="numpy", forceinline=True)
    for wrapped in (_at_once, _one_by_one):
        function = wrapped(one, signal)
        # Compiled code is stored beside the law, under a name of its own.
        function.__code__ = function.__code__.replace(co_filename=law.python.__code__.co_filename)
        function.__module__ = law.python.__module__
        function.__qualname__ = f"{law.python.__qualname__}.eight.{wrapped.__name__}"
        function.__name__ = law.python.__name__
        made = compile_law(_SIGNAL if signal else _NODE, f"{law.form}, eight of each", function)
        with suppress(InputError):
            made.address  # noqa: B018 - compiles it
            return made
    return None


def simd_address(address: int) -> int | None:
    """Address of the function for eight lanes of the law at an address; None if there is none."""
    law = simd_law(law_at(address))
    return None if law is None else law.address
