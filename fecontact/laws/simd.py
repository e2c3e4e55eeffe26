"""Laws for eight contact nodes at once, one in each SIMD lane, made of the laws themselves.

They serve runs of many small systems side by side (:mod:`fecontact.integrate.simd`). Arguments and
results are those of :mod:`fecontact.laws.signatures`, eight of each. A law whose branches only
choose values by :func:`fecontact.core.simd.vectors.select` is compiled for eight numbers; one
with other branches is called for one lane after the other.
"""

from contextlib import suppress
from types import FunctionType
from typing import Any
from weakref import WeakKeyDictionary

from fecontact.core.compiled import CompiledLaw, compile_law, law_at
from fecontact.core.errors import InputError
from fecontact.core.kernel_parts import part
from fecontact.core.records import eight_type
from fecontact.core.simd.functions import in_lane, lane_of, with_lane
from fecontact.core.simd.kinds import WIDTH
from fecontact.core.simd.vectors import spread

# Functions for eight lanes, in which ``law`` stands for a part of them; it is no variable of an
# outer function, since numba would not find their stored code again.
law: Any = None


def _two_and_parameters(a, b, p):
    force, by_first, by_second = spread(0.0), spread(0.0), spread(0.0)
    for lane in range(WIDTH):
        found = law(lane_of(a, lane), lane_of(b, lane), in_lane(p, lane))
        force = with_lane(force, lane, found[0])
        by_first = with_lane(by_first, lane, found[1])
        by_second = with_lane(by_second, lane, found[2])
    return force, by_first, by_second


def _time_and_parameters(t, p):
    value, rate = spread(0.0), spread(0.0)
    for lane in range(WIDTH):
        found = law(lane_of(t, lane), in_lane(p, lane))
        value, rate = with_lane(value, lane, found[0]), with_lane(rate, lane, found[1])
    return value, rate


def _with_memory(v, F, z, p, force, rates):
    for lane in range(WIDTH):
        law(lane_of(v, lane), lane_of(F, lane), in_lane(z, lane), in_lane(p, lane),
            in_lane(force, lane), in_lane(rates, lane))


# Calls of a law for one lane after the other, by its number of arguments.
_ONE_BY_ONE = dict(zip(
    (2, 3, 6), (_time_and_parameters, _two_and_parameters, _with_memory), strict=True))


_MADE: WeakKeyDictionary[CompiledLaw, CompiledLaw | None] = WeakKeyDictionary()


def simd_law(one: CompiledLaw) -> CompiledLaw | None:
    """The function for eight lanes of a normal law, a friction law in the plane or a signal.

    None if the law cannot be compiled for them.
    """
    if one not in _MADE:
        _MADE[one] = _made(one)
    return _MADE[one]


def _made(one: CompiledLaw) -> CompiledLaw | None:
    signature = eight_type(one.signature)
    for function in (one.python, _one_by_one(one)):
        made = compile_law(signature, f"{one.form}, eight of each", function)
        with suppress(InputError):
            made.address  # noqa: B018 - compiles it
            return made
    return None


def _one_by_one(one: CompiledLaw) -> FunctionType:
    """The function that calls a law for one lane after the other."""
    way = _ONE_BY_ONE[len(one.signature.args)]
    inside = part(one.python, error_model="numpy", forceinline=True)
    # Compiled code is stored beside the law, under a name of its own. Numba reads the source at
    # that place, which must be the beginning of a function.
    place = one.python.__code__
    function = FunctionType(
        way.__code__.replace(co_filename=place.co_filename, co_firstlineno=place.co_firstlineno),
        {**globals(), "law": inside}, one.python.__name__)
    function.__module__ = one.python.__module__
    function.__qualname__ = f"{one.python.__qualname__}.eight.{way.__name__}"
    return function


def simd_address(address: int) -> int | None:
    """Address of the function for eight lanes of the law at an address; None if there is none."""
    found = simd_law(law_at(address))
    return None if found is None else found.address
