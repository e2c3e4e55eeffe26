"""Values of records that are the same in all calls of a kernel, for which it is compiled.

Loops over a known number of entries are then written out, and branches left out that are not taken.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils

from fecontact.core.records import numba_type
from fecontact.core.references import Reference

_I64 = ir.IntType(64)


def constants(given: Mapping[Any, Mapping[str, Any]]) -> str:
    """Intermediate code that gives fields of tuples fixed values in a kernel.

    Parameters
    ----------
    given : mapping
        For each record its fields: a shape, whose entries may be None, of an array; an integer
        array for that and its entries; an integer for a number.
    """
    module = ir.Module("constants")
    for record, fields in given.items():
        owner = Reference(numba_type(record)).name
        for field, value in fields.items():
            name = f"{owner}.{field}"
            if not isinstance(value, np.ndarray | tuple):
                _define(module, name, _I64(value))
                continue
            shape = value.shape if isinstance(value, np.ndarray) else value
            for axis, length in enumerate(shape):
                if length is not None:
                    _define(module, f"{name}.{axis}", _I64(length))
            if isinstance(value, np.ndarray):
                entries = ir.Constant(ir.ArrayType(_I64, value.size), value.ravel().tolist())
                table = cgutils.global_constant(module, f"{name}.entries", entries)
                _define(module, f"{name}.data", table.bitcast(_I64.as_pointer()))
    return str(module)


def _define(module: Any, name: str, value: Any) -> None:
    function = ir.Function(module, ir.FunctionType(value.type, [cgutils.voidptr_t]), name)
    function.attributes.add("alwaysinline")
    ir.IRBuilder(function.append_basic_block()).ret(value)
