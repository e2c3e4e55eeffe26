"""Arrays without reference counts, and functions that vanish into their callers.

Counting references is an atomic operation for every view of an array that a kernel takes. For
systems of few modes these, and not the arithmetic, would be the cost of a right-hand side.
"""

from collections.abc import Callable
from typing import Any

from numba import njit
from numba.core import cgutils, types
from numba.extending import intrinsic

from fecontact.compiled import _FASTMATH


@intrinsic
def borrowed(typingctx: Any, array: Any) -> Any:
    """The same array, or tuple of arrays, without reference counts.

    Only for what the caller of the kernel holds: an array made inside it is freed after its last
    use under its own name.
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _without_owner(context, builder, signature.args[0], args[0])

    return array(array), codegen


def _without_owner(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.BaseTuple):
        members: Any = kind
        items = [_without_owner(context, builder, item, builder.extract_value(value, index))
                 for index, item in enumerate(members)]
        return context.make_tuple(builder, kind, items)
    if not isinstance(kind, types.Array):
        return value
    array = context.make_array(kind)(context, builder, value)
    array.meminfo = cgutils.get_null_value(array.meminfo.type)
    array.parent = cgutils.get_null_value(array.parent.type)
    return array._getvalue()


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function that becomes part of its callers' code."""
    return njit(error_model="numpy", fastmath=_FASTMATH, forceinline=True)(function)
