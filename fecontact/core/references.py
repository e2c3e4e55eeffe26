"""References to named tuples of arrays, for kernels that hand large ones on.

A compiled function takes a tuple by value: some hundred numbers for each tuple of arrays, at every
call, and the compiler spends most of its time on them. A reference is one pointer. Fields are read
when they are named, so that functions are written as if they had the tuple itself.
"""

import hashlib
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.imputils import lower_cast
from numba.core.typeconv import Conversion
from numba.core.typeconv.rules import default_type_manager
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    register_model,
    unbox,
)

from fecontact.core.simd.kinds import has_eight

_I32, _I64 = ir.IntType(32), ir.IntType(64)


class Reference(types.Type):
    """Numba's type of a reference to a named tuple of the type ``tuple_type``."""

    def __init__(self, tuple_type: Any) -> None:
        self.tuple_type = tuple_type
        # Types are compared by their names, which become part of those of functions: keep it short.
        digest = hashlib.sha256(_described(tuple_type).encode()).hexdigest()[:16]
        super().__init__(name=f"Reference({tuple_type.instance_class.__name__}, {digest})")

    def can_convert_to(self, typingctx: Any, other: Any) -> Any:
        """A reference serves where the tuple itself is expected."""
        return Conversion.safe if other == self.tuple_type else None


def reference_to(tuple_type: Any) -> Reference:
    """The reference that a kernel takes, to which Python gives the tuple itself."""
    reference = Reference(tuple_type)
    default_type_manager.set_safe_convert(tuple_type, reference)
    return reference


def _described(kind: Any) -> str:
    if not isinstance(kind, types.BaseNamedTuple):
        return str(kind)
    owner = kind.instance_class
    fields = ", ".join(map(_described, kind))
    return f"{owner.__module__}.{owner.__qualname__}({fields})"


@register_model(Reference)
class _ReferenceModel(models.PrimitiveModel):
    """A pointer to the fields, which stay as they are for as long as it is used."""

    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, dmm.lookup(fe_type.tuple_type).get_value_type().as_pointer())


def _field_type(kind: Any, index: int) -> Any:
    return kind.types[index] if isinstance(kind, types.NamedTuple) else kind.dtype


@infer_getattr
class _Fields(AttributeTemplate):
    key = Reference

    def generic_resolve(self, kind: Any, name: str) -> Any:
        """The type of a field; of a tuple within, a reference."""
        if name not in kind.tuple_type.fields:
            return None
        field = _field_type(kind.tuple_type, kind.tuple_type.fields.index(name))
        if isinstance(field, types.Array) and field.ndim == 0:
            return field.dtype
        return Reference(field) if isinstance(field, types.BaseNamedTuple) else field


@lower_getattr_generic(Reference)
def _field(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    return _read(context, builder, kind, value, kind.tuple_type.fields.index(name))


@lower_cast(Reference, types.BaseTuple)
def _value(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    items = []
    for index, field in enumerate(wanted):
        item = _read(context, builder, given, value, index)
        if isinstance(field, types.BaseNamedTuple):
            item = _value(context, builder, Reference(field), field, item)
        items.append(item)
    return context.make_tuple(builder, wanted, items)


def _read(context: Any, builder: Any, kind: Any, value: Any, index: int) -> Any:
    """A field; of a tuple within, a reference."""
    field = _field_type(kind.tuple_type, index)
    if isinstance(field, types.BaseNamedTuple):
        return cgutils.gep_inbounds(builder, value, 0, index)
    name = f"{kind.name}.{kind.tuple_type.fields[index]}"
    if isinstance(field, types.Array):
        array = _array(context, builder, field, name, value, index)
        return array._getvalue() if field.ndim else context.unpack_value(
            builder, field.dtype, array.data, align=1)
    if isinstance(context.get_value_type(field), ir.Aggregate):
        raise NotImplementedError(f"{name} is neither a number nor an array")
    return _asked(builder, name, value, index)


def _array(context: Any, builder: Any, field: Any, name: str, value: Any, index: int) -> Any:
    """An array without reference counts; all else follows from its shape.

    An array without axes is read as its entry.
    """
    array = context.make_array(field)(context, builder)
    members = array._datamodel._fields
    shape = [_asked(builder, f"{name}.{axis}", value, index, members.index("shape"), axis)
             for axis in range(field.ndim)]
    item = context.get_constant(
        types.intp, context.get_abi_sizeof(context.get_data_type(field.dtype)))
    strides: list[Any] = []
    count = context.get_constant(types.intp, 1)
    for length in reversed(shape):
        strides.insert(0, builder.mul(count, item))
        count = builder.mul(count, length)
    array.meminfo = cgutils.get_null_value(array.meminfo.type)
    array.parent = cgutils.get_null_value(array.parent.type)
    array.nitems, array.itemsize = count, item
    array.data = _asked(builder, f"{name}.data", value, index, members.index("data"))
    array.shape = cgutils.pack_array(builder, shape, _I64)
    array.strides = cgutils.pack_array(builder, strides, _I64)
    return array


def _asked(builder: Any, name: str, value: Any, *place: int) -> Any:
    """A number or an address of a tuple, by a function that ``constants`` may replace."""
    # The fields do not change: loops need not read them again after each number they store.
    kind = builder.gep(value, [_I32(0), *map(_I32, place)]).type.pointee
    function = builder.module.globals.get(name)
    if function is None:
        function = ir.Function(builder.module, ir.FunctionType(kind, [cgutils.voidptr_t]), name)
        function.linkage = "linkonce_odr"
        for attribute in ("alwaysinline", "nounwind", "readnone"):
            function.attributes.add(attribute)
        inside = ir.IRBuilder(function.append_basic_block())
        pointer = inside.bitcast(function.args[0], value.type)
        found = inside.load(cgutils.gep_inbounds(inside, pointer, 0, *place))
        found.set_metadata("invariant.load", builder.module.add_metadata([]))
        inside.ret(found)
    return builder.call(function, [builder.bitcast(value, cgutils.voidptr_t)])


def _write(builder: Any, value: Any, place: Any) -> None:
    if isinstance(value.type, ir.Aggregate):
        for index in range(len(value.type)):
            _write(builder, builder.extract_value(value, index),
                   cgutils.gep_inbounds(builder, place, 0, index))
    else:
        builder.store(value, place)


def without_owner(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """An array, or a tuple of arrays, without reference counts."""
    if isinstance(kind, types.BaseTuple):
        items = [without_owner(context, builder, item, builder.extract_value(value, index))
                 for index, item in enumerate(kind)]
        return context.make_tuple(builder, kind, items)
    if not isinstance(kind, types.Array):
        return value
    array = context.make_array(kind)(context, builder, value)
    array.meminfo = cgutils.get_null_value(array.meminfo.type)
    array.parent = cgutils.get_null_value(array.parent.type)
    return array._getvalue()


@unbox(Reference)
def _given_by_python(kind: Any, value: Any, c: Any) -> Any:
    """A reference to a copy on the stack of the entry; who calls holds the arrays meanwhile."""
    place = cgutils.alloca_once(c.builder, c.context.get_value_type(kind.tuple_type))
    failed = c.builder.call(_filler(kind, c), [value, place])
    return NativeValue(_written(c.builder, place), is_error=failed)


def _filler(kind: Any, c: Any) -> Any:
    """A function that writes the fields of a Python tuple; whether one of them cannot be read.

    The fields of numba's own entries are hundreds of branches, which take longer to compile than
    many a kernel.
    """
    name = f"fill.{kind.name}"
    function = c.builder.module.globals.get(name)
    if function is not None:
        return function
    place = c.context.get_value_type(kind.tuple_type).as_pointer()
    function = ir.Function(c.builder.module,
                           ir.FunctionType(cgutils.bool_t, [c.pyapi.pyobj, place]), name)
    function.linkage = "linkonce_odr"
    function.attributes.add("noinline")
    builder = ir.IRBuilder(function.append_basic_block())
    inside = c._replace(builder=builder, pyapi=c.context.get_python_api(builder))
    array_type = ir.FunctionType(_I32, [c.pyapi.pyobj, cgutils.voidptr_t])
    adapt = cgutils.get_or_insert_function(c.builder.module, array_type, "numba_adapt_ndarray")
    failed = cgutils.false_bit
    for index in range(len(kind.tuple_type)):
        field = _field_type(kind.tuple_type, index)
        item = inside.pyapi.tuple_getitem(function.args[0], index)
        target = cgutils.gep_inbounds(builder, function.args[1], 0, index)
        if isinstance(field, types.Array):
            whole = target
            if has_eight(field):
                # Python has a last axis of the eight numbers.
                stored = types.Array(types.float64, field.ndim + 1, "C")
                whole = builder.alloca(c.context.get_value_type(stored))
            code = builder.call(adapt, [item, builder.bitcast(whole, cgutils.voidptr_t)])
            wrong = cgutils.is_not_null(builder, code)
            if has_eight(field):
                _write_rows(c.context, builder, field, stored, whole, target)
        elif isinstance(field, types.BaseNamedTuple):
            wrong = builder.call(_filler(Reference(field), inside), [item, target])
        else:
            found = inside.unbox(field, item)
            builder.store(found.value, target)
            wrong = found.is_error
        failed = builder.or_(failed, wrong)
    builder.ret(failed)
    return function


def _write_rows(
    context: Any, builder: Any, field: Any, stored: Any, whole: Any, target: Any,
) -> None:
    """Fill the place of an array of eight numbers each by that with an axis of them."""
    given = context.make_array(stored)(context, builder, ref=whole)
    found = context.make_array(field)(context, builder, ref=target)
    found.data = builder.bitcast(given.data, found.data.type)
    found.shape = cgutils.pack_array(
        builder, cgutils.unpack_tuple(builder, given.shape, stored.ndim)[: field.ndim], _I64)


@lower_cast(types.BaseTuple, Reference)
def _reference(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    """A reference to a copy on the stack of what calls; arrays stay that one's."""
    place = cgutils.alloca_once(builder, value.type)
    _write(builder, value, place)
    return _written(builder, place)


def _written(builder: Any, place: Any) -> Any:
    """The place; no read of it comes before what has been written there."""
    pointer = ir.FunctionType(place.type, [place.type])
    return builder.asm(pointer, "", "=r,0,~{memory}", [place], True)


@intrinsic
def borrowed(typingctx: Any, array: Any) -> Any:
    """Return the array without reference counts, or a reference to a named tuple of arrays.

    Use it only for what the caller of the kernel holds: an array made inside the kernel is freed
    after its last use under its own name.
    """

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        if not isinstance(array, types.BaseNamedTuple):
            return without_owner(context, builder, array, args[0])
        return _reference(context, builder, array, signature.return_type, args[0])

    return (Reference(array) if isinstance(array, types.BaseNamedTuple) else array)(array), codegen
