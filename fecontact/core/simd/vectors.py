"""Eight numbers at once, in kernels.

Small matrices are too short for vector instructions, and so are small systems; eight of them side
by side are not. Arrays whose last axis has :data:`WIDTH` entries are read and written as one value,
which takes ``+ - * /`` and comparisons with others of its kind and with numbers; LLVM makes of it
what the processor has. Comparisons give a mask, eight truth values, which takes ``& | ~``.
"""

import math
import operator
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typeconv.rules import default_type_manager
from numba.core.typing.templates import AbstractTemplate, ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast

from fecontact.core.simd.kinds import TRUTHS, VECTOR, WIDTH, lanes, mask

_BYTE = ir.IntType(8)


def _pointer(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    array = context.make_array(kind)(context, builder, value)
    return builder.bitcast(array.data, VECTOR.as_pointer())


def _spread(builder: Any, number: Any, kind: Any = VECTOR) -> Any:
    empty, index = ir.Constant(kind, ir.Undefined), ir.IntType(32)
    first = builder.insert_element(empty, number, ir.Constant(index, 0))
    return builder.shuffle_vector(first, empty, ir.Constant(ir.VectorType(index, WIDTH), None))


def _code(build: Callable[..., Any]) -> Callable[..., Any]:
    """Code of an intrinsic that a builder makes of its arguments alone."""
    return lambda context, builder, signature, args: build(builder, *args)


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
        result = ir.Constant(VECTOR, ir.Undefined)
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
    return lanes(types.float64), _code(_spread)


# A float where eight numbers are wanted, in a result or at the end of a branch.
default_type_manager.set_promote(types.float64, lanes)


@lower_cast(types.float64, lanes)
def _float_to_lanes(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    return _spread(builder, value)


default_type_manager.set_promote(types.boolean, mask)


@lower_cast(types.boolean, mask)
@lower_cast(types.BooleanLiteral, mask)
def _truth_to_mask(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    return _spread(builder, value, TRUTHS)


def _library(name: str) -> Callable[..., Any]:
    def build(builder: Any, *args: Any) -> Any:
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(VECTOR, [VECTOR] * len(args)),
            f"llvm.{name}.v{WIDTH}f64")
        return builder.call(function, args)

    return build


@intrinsic
def whole(typingctx: Any, numbers: Any) -> Any:
    """Largest whole numbers not above."""
    return lanes(lanes), _code(_library("floor"))


@intrinsic
def signed(typingctx: Any, sizes: Any, signs: Any) -> Any:
    """Numbers of these sizes with the signs of others."""
    return lanes(lanes, lanes), _code(_library("copysign"))


@intrinsic
def fused(typingctx: Any, a: Any, b: Any, c: Any) -> Any:
    """The sum a b + c, rounded once."""
    return lanes(lanes, lanes, lanes), _code(_library("fma"))


@intrinsic
def scaled(typingctx: Any, numbers: Any, powers: Any) -> Any:
    """Numbers times two to whole powers; both they and the results must be normal."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        integers = ir.VectorType(ir.IntType(64), WIDTH)
        # The sum's last bits are those of the whole number; they become those of the exponent.
        shifted = builder.fadd(args[1], _constant(1.5 * 2.0**52))
        power = builder.shl(builder.bitcast(shifted, integers), _constant(52, integers))
        return builder.bitcast(builder.add(builder.bitcast(args[0], integers), power), VECTOR)

    return lanes(lanes, lanes), codegen


@intrinsic
def exponent(typingctx: Any, numbers: Any) -> Any:
    """Whole numbers e with 2^e <= x < 2^(e + 1), of normal x above zero."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        integers = ir.VectorType(ir.IntType(64), WIDTH)
        bits = builder.lshr(builder.bitcast(args[0], integers), _constant(52, integers))
        # The bits of 2^52 and those of the exponent are 2^52 + exponent.
        whole = builder.or_(bits, _constant(0x4330000000000000, integers))
        return builder.fsub(builder.bitcast(whole, VECTOR), _constant(2.0**52 + 1023.0))

    return lanes(lanes), codegen


def _constant(value: Any, kind: Any = VECTOR) -> Any:
    return ir.Constant(kind, [value] * WIDTH)


@intrinsic
def bits(typingctx: Any, where: Any) -> Any:
    """A mask as an integer with one bit per lane; zero where none is true."""
    return types.int64(mask), _code(
        lambda builder, where: builder.zext(builder.bitcast(where, _BYTE), ir.IntType(64)))


@intrinsic
def mask_of(typingctx: Any, given: Any) -> Any:
    """The mask of an integer with one bit per lane."""
    return mask(types.int64), _code(
        lambda builder, given: builder.bitcast(builder.trunc(given, _BYTE), TRUTHS))


def _provide(function: Any, kind: Any, result: Any, build: Callable[..., Any],
             count: int = 2) -> None:
    """Let a function or an operator take lanes, or masks; one of two may be a single value.

    It is one instruction where it stands. Functions of Python that return one would be compiled
    and copied for each.
    """

    @infer_global(function)
    class _Function(ConcreteTemplate):
        cases: ClassVar = [signature(result, *[kind] * count)]

    @lower_builtin(function, *[kind] * count)
    def _code_of(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return build(builder, *args)


def select(where: Any, then: Any, otherwise: Any) -> Any:
    """``then`` where a condition holds, else ``otherwise``; both are computed."""
    return then if where else otherwise


@infer_global(select)
class _Select(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        """Eight numbers where a value or the condition is eight."""
        where, *values = args
        kind = lanes if lanes in values or where == mask else types.float64
        return signature(kind, where if where == mask else types.boolean, kind, kind)


def somewhere(where: Any) -> Any:
    """True if a condition holds, of eight numbers if it holds for at least one of them."""
    return where


def everywhere(where: Any) -> Any:
    """True if a condition holds, of eight numbers if it holds for each of them."""
    return where


def opposite(where: Any) -> Any:
    """The opposite of a condition, of one number or of eight."""
    return not where


def _of_any(builder: Any, where: Any) -> Any:
    return builder.icmp_unsigned("!=", builder.bitcast(where, _BYTE), _BYTE(0))


def _of_all(builder: Any, where: Any) -> Any:
    return builder.icmp_unsigned("==", builder.bitcast(where, _BYTE), _BYTE(-1))


lower_builtin(select, types.Any, types.Any, types.Any)(
    lambda context, builder, sig, args: builder.select(*args))
for _function, _folded in ((somewhere, _of_any), (everywhere, _of_all)):
    _provide(_function, types.boolean, types.boolean, lambda builder, where: where, 1)
    _provide(_function, mask, types.boolean, _folded, 1)
for _kind in (types.boolean, mask):
    _provide(opposite, _kind, _kind, ir.IRBuilder.not_, 1)


def _compared(sign: str) -> Callable[[Any, Any, Any], Any]:
    return lambda builder, a, b: builder.fcmp_ordered(sign, a, b)


def _chosen(sign: str) -> Callable[[Any, Any, Any], Any]:
    return lambda builder, a, b: builder.select(builder.fcmp_ordered(sign, b, a), b, a)


def _hypotenuse(builder: Any, a: Any, b: Any) -> Any:
    return _library("sqrt")(builder, builder.fadd(builder.fmul(a, a), builder.fmul(b, b)))


for _name, _build in (("add", ir.IRBuilder.fadd), ("sub", ir.IRBuilder.fsub),
                      ("mul", ir.IRBuilder.fmul), ("truediv", ir.IRBuilder.fdiv)):
    _provide(getattr(operator, _name), lanes, lanes, _build)
    _provide(getattr(operator, f"i{_name}"), lanes, lanes, _build)
for _operation, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"),
                          (operator.ge, ">="), (operator.eq, "==")):
    _provide(_operation, lanes, mask, _compared(_sign))
_provide(operator.ne, lanes, mask, lambda builder, a, b: builder.fcmp_unordered("!=", a, b))
for _operation, _build in ((operator.and_, ir.IRBuilder.and_), (operator.or_, ir.IRBuilder.or_)):
    _provide(_operation, mask, mask, _build)
_provide(min, lanes, lanes, _chosen("<"))
_provide(max, lanes, lanes, _chosen(">"))
_provide(np.hypot, lanes, lanes, _hypotenuse)
_provide(abs, lanes, lanes, _library("fabs"), 1)
_provide(math.sqrt, lanes, lanes, _library("sqrt"), 1)
_provide(operator.neg, lanes, lanes, ir.IRBuilder.fneg, 1)
_provide(operator.invert, mask, mask, ir.IRBuilder.not_, 1)
