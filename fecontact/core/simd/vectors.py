"""Eight numbers at once, in kernels.

Small matrices are too short for vector instructions, and so are small systems; eight of them side
by side are not. Arrays whose last axis has :data:`WIDTH` entries are read and written as one value,
which takes ``+ - * /`` and comparisons with others of its kind and with numbers; LLVM makes of it
what the processor has. Comparisons give a mask, eight truth values, which takes ``& | ~``.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, overload, register_model

WIDTH = 8
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_TRUTHS = ir.VectorType(ir.IntType(1), WIDTH)
_BYTE = ir.IntType(8)


class _Lanes(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Lanes")


class _Mask(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Mask")


lanes, mask = _Lanes(), _Mask()


@register_model(_Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


@register_model(_Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _TRUTHS)


def _pointer(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    array = context.make_array(kind)(context, builder, value)
    return builder.bitcast(array.data, _VECTOR.as_pointer())


def _spread(builder: Any, number: Any, kind: Any = _VECTOR) -> Any:
    empty, index = ir.Constant(kind, ir.Undefined), ir.IntType(32)
    first = builder.insert_element(empty, number, ir.Constant(index, 0))
    return builder.shuffle_vector(first, empty, ir.Constant(ir.VectorType(index, WIDTH), None))


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
    """Vector with a number in each of its eight SIMD lanes."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _spread(builder, args[0])

    return lanes(types.float64), codegen


def _library(name: str, builder: Any, args: Any) -> Any:
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(_VECTOR, [_VECTOR] * len(args)),
        f"llvm.{name}.v{WIDTH}f64")
    return builder.call(function, args)


@intrinsic
def magnitude(typingctx: Any, numbers: Any) -> Any:
    """Absolute values."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _library("fabs", builder, args)

    return lanes(lanes), codegen


@intrinsic
def root(typingctx: Any, numbers: Any) -> Any:
    """Square roots."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _library("sqrt", builder, args)

    return lanes(lanes), codegen


@intrinsic
def whole(typingctx: Any, numbers: Any) -> Any:
    """Largest whole numbers not above."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _library("floor", builder, args)

    return lanes(lanes), codegen


@intrinsic
def signed(typingctx: Any, sizes: Any, signs: Any) -> Any:
    """Numbers of these sizes with the signs of others."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _library("copysign", builder, args)

    return lanes(lanes, lanes), codegen


@intrinsic
def fused(typingctx: Any, a: Any, b: Any, c: Any) -> Any:
    """The sum a b + c, rounded once."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _library("fma", builder, args)

    return lanes(lanes, lanes, lanes), codegen


@intrinsic
def scaled(typingctx: Any, numbers: Any, powers: Any) -> Any:
    """Numbers times two to whole powers; both they and the results must be normal."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        integers = ir.VectorType(ir.IntType(64), WIDTH)
        # The sum's last bits are those of the whole number; they become those of the exponent.
        shifted = builder.fadd(args[1], _constant(1.5 * 2.0**52))
        power = builder.shl(builder.bitcast(shifted, integers), _constant(52, integers))
        return builder.bitcast(builder.add(builder.bitcast(args[0], integers), power), _VECTOR)

    return lanes(lanes, lanes), codegen


@intrinsic
def exponent(typingctx: Any, numbers: Any) -> Any:
    """Whole numbers e with 2^e <= x < 2^(e + 1), of normal x above zero."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        integers = ir.VectorType(ir.IntType(64), WIDTH)
        bits = builder.lshr(builder.bitcast(args[0], integers), _constant(52, integers))
        # The bits of 2^52 and those of the exponent are 2^52 + exponent.
        whole = builder.or_(bits, _constant(0x4330000000000000, integers))
        return builder.fsub(builder.bitcast(whole, _VECTOR), _constant(2.0**52 + 1023.0))

    return lanes(lanes), codegen


def _constant(value: Any, kind: Any = _VECTOR) -> Any:
    return ir.Constant(kind, [value] * WIDTH)


@intrinsic
def where_larger(typingctx: Any, a: Any, b: Any, then: Any, otherwise: Any) -> Any:
    """``then`` where a > b, else ``otherwise``."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">", args[0], args[1]), args[2], args[3])

    return lanes(lanes, lanes, lanes, lanes), codegen


@intrinsic
def _chosen(typingctx: Any, where: Any, then: Any, otherwise: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        then, otherwise = (
            value if kind == lanes else _spread(builder, value)
            for kind, value in zip(signature.args[1:], args[1:], strict=True))
        return builder.select(args[0], then, otherwise)

    return lanes(mask, then, otherwise), codegen


def chosen(where: Any, then: Any, otherwise: Any) -> Any:
    """``then`` where the mask is true, else ``otherwise``; either may be a number."""
    raise NotImplementedError


@overload(chosen)
def _typed_chosen(where, then, otherwise):
    return lambda where, then, otherwise: _chosen(where, then, otherwise)


@intrinsic
def bits(typingctx: Any, where: Any) -> Any:
    """A mask as an integer with one bit per lane; zero where none is true."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], _BYTE), ir.IntType(64))

    return types.int64(mask), codegen


@intrinsic
def mask_of(typingctx: Any, given: Any) -> Any:
    """The mask of an integer with one bit per lane."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(builder.trunc(args[0], _BYTE), _TRUTHS)

    return mask(types.int64), codegen


def _provide(operation: Any, result: Any, build: Callable[[Any, Any, Any], Any]) -> None:
    """Let lanes take an operator with two operands, one of which may be a number."""

    @intrinsic
    def combined(typingctx: Any, a: Any, b: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            given = [value if kind == lanes else _spread(builder, value)
                     for kind, value in zip(signature.args, args, strict=True)]
            return build(builder, *given)

        return result(a, b), codegen

    # numba compares the annotations of this one with those of what it returns.
    def typed(a, b):
        kinds = (a, b)
        if lanes in kinds and all(kind in (lanes, types.float64) for kind in kinds):
            return lambda a, b: combined(a, b)
        return None

    overload(operation)(typed)


def _provide_for_masks(operation: Any, build: Callable[[Any, Any, Any], Any]) -> None:
    @intrinsic
    def combined(typingctx: Any, a: Any, b: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return build(builder, *args)

        return mask(mask, mask), codegen

    def typed(a, b):
        if isinstance(a, _Mask) and isinstance(b, _Mask):
            return lambda a, b: combined(a, b)
        return None

    overload(operation)(typed)


def _compared(sign: str) -> Callable[[Any, Any, Any], Any]:
    return lambda builder, a, b: builder.fcmp_ordered(sign, a, b)


for _operation, _build in ((operator.add, ir.IRBuilder.fadd), (operator.iadd, ir.IRBuilder.fadd),
                           (operator.sub, ir.IRBuilder.fsub), (operator.mul, ir.IRBuilder.fmul),
                           (operator.truediv, ir.IRBuilder.fdiv)):
    _provide(_operation, lanes, _build)
for _operation, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"),
                          (operator.ge, ">="), (operator.eq, "==")):
    _provide(_operation, mask, _compared(_sign))
for _operation, _build in ((operator.and_, ir.IRBuilder.and_), (operator.or_, ir.IRBuilder.or_)):
    _provide_for_masks(_operation, _build)


@intrinsic
def _negative(typingctx: Any, numbers: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.fneg(args[0])

    return lanes(lanes), codegen


@intrinsic
def _opposite(typingctx: Any, where: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.not_(args[0])

    return mask(mask), codegen


@overload(operator.neg)
def _typed_negative(a):
    return (lambda a: _negative(a)) if isinstance(a, _Lanes) else None


@overload(operator.invert)
def _typed_opposite(a):
    return (lambda a: _opposite(a)) if isinstance(a, _Mask) else None
