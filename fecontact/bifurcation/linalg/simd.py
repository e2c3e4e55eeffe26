"""Eight numbers at once, in kernels.

Small matrices are too short for vector instructions, eight of them side by side are not. Arrays
whose last axis has :data:`WIDTH` entries are read and written as one value, which takes
``+ - * /`` with others of its kind; LLVM makes of it what the processor has.
"""

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, overload, register_model

WIDTH = 8
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class _Lanes(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Lanes")


lanes = _Lanes()


@register_model(_Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _pointer(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    array = context.make_array(kind)(context, builder, value)
    return builder.bitcast(array.data, _VECTOR.as_pointer())


@intrinsic
def read(typingctx: Any, row: Any) -> Any:
    """The eight numbers of a row (8,)."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(_pointer(context, builder, signature.args[0], args[0]), align=8)

    return lanes(row), codegen


@intrinsic
def write(typingctx: Any, row: Any, numbers: Any) -> Any:
    """Fill a row (8,)."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[1], _pointer(context, builder, signature.args[0], args[0]), align=8)
        return context.get_dummy_value()

    return types.void(row, lanes), codegen


@intrinsic
def gather(typingctx: Any, values: Any, places: Any, further: Any) -> Any:
    """The numbers values[places[lane] + further]; ``places`` (8,) are integers."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        source = context.make_array(signature.args[0])(context, builder, args[0]).data
        where = context.make_array(signature.args[1])(context, builder, args[1]).data
        first = builder.gep(source, [args[2]])
        result = ir.Constant(_VECTOR, ir.Undefined)
        for lane in range(WIDTH):
            index = ir.Constant(ir.IntType(32), lane)
            place = builder.load(builder.gep(where, [index]))
            number = builder.load(builder.gep(first, [place]))
            result = builder.insert_element(result, number, index)
        return result

    return lanes(values, places, types.int64), codegen


@intrinsic
def spread(typingctx: Any, number: Any) -> Any:
    """The same number eight times."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        empty, index = ir.Constant(_VECTOR, ir.Undefined), ir.IntType(32)
        first = builder.insert_element(empty, args[0], ir.Constant(index, 0))
        return builder.shuffle_vector(first, empty, ir.Constant(ir.VectorType(index, WIDTH), None))

    return lanes(types.float64), codegen


@intrinsic
def magnitude(typingctx: Any, numbers: Any) -> Any:
    """Absolute values."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(_VECTOR, [_VECTOR]), f"llvm.fabs.v{WIDTH}f64")
        return builder.call(function, args)

    return lanes(lanes), codegen


@intrinsic
def where_larger(typingctx: Any, a: Any, b: Any, then: Any, otherwise: Any) -> Any:
    """``then`` where a > b, else ``otherwise``."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", args[0], args[1]), args[2], args[3])

    return lanes(lanes, lanes, lanes, lanes), codegen


def _provide(operation: Any, instruction: str) -> None:
    """Let lanes take an operator."""

    @intrinsic
    def combined(typingctx: Any, a: Any, b: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return getattr(builder, instruction)(*args)

        return lanes(lanes, lanes), codegen

    # numba compares the annotations of this one with those of what it returns.
    def typed(a, b):
        if isinstance(a, _Lanes) and isinstance(b, _Lanes):
            return lambda a, b: combined(a, b)
        return None

    overload(operation)(typed)


for _operation, _instruction in ((operator.add, "fadd"), (operator.sub, "fsub"),
                                 (operator.mul, "fmul"), (operator.truediv, "fdiv")):
    _provide(_operation, _instruction)
