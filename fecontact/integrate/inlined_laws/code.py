"""Intermediate code in which the laws of a system are constants of the kernels that call them.

Kernels find laws by addresses in tables. Where a table is a constant and the code of the laws is at
hand, a call by address becomes a direct one, and the law a part of the loop around it.
"""

import re
from collections.abc import Iterator, Mapping
from itertools import count
from typing import Any

from llvmlite import ir
from llvmlite.binding import Linkage, ModuleRef, parse_assembly
from numba.core import cgutils

from fecontact.core.compiled import CompiledLaw
from fecontact.core.errors import InputError
from fecontact.core.references import Reference

# A law, laws of several nodes or signals, None or a number for what is none.
Given = CompiledLaw | None | tuple[CompiledLaw | None, ...]

_I64 = ir.IntType(64)

# Functions of the interpreter and of memory that is counted: laws that call them may raise or
# allocate.
_OF_PYTHON = ("NRT_", "Py", "_Py", "numba_")
# What belongs to the process in which a law was compiled: names of modules and scopes.
_HEADER = re.compile(r"^(; ModuleID|source_filename|target ).*\n", re.MULTILINE)
_SCOPE = re.compile(r'!"(?:_Z|cfunc)[^"]*"')
_ATTRIBUTES = re.compile(r"^attributes #.*$", re.MULTILINE)


def with_laws(constants: str, tuple_type: Any, given: Mapping[str, Given]) -> str:
    """Intermediate code that gives fields of a tuple the addresses of laws, which it holds.

    Parameters
    ----------
    constants : str
        What is fixed besides, of :func:`fecontact.core.references.constants`.
    tuple_type : type of numba
        That of the tuple.
    given : mapping
        Laws by fields: one or None for a number, a tuple of them for an array.

    Raises
    ------
    InputError
        For a law that cannot be a part of a kernel.
    """
    laws = dict.fromkeys(law for value in given.values() for law in _each(value) if law is not None)
    names = {law: f"law{number}" for number, law in enumerate(laws)}
    tables = ir.Module("tables")
    functions: dict[CompiledLaw | None, Any] = {None: ir.Constant(_I64, 0)}
    for law, name in names.items():
        function = ir.Function(tables, ir.FunctionType(ir.VoidType(), []), name)
        functions[law] = function.ptrtoint(_I64)
    for field, value in given.items():
        name = f"{Reference(tuple_type).name}.{field}"
        if not isinstance(value, tuple):
            _define(tables, name, functions[value])
            continue
        entries = ir.Constant(ir.ArrayType(_I64, len(value)), [functions[law] for law in value])
        table = cgutils.global_constant(tables, f"{name}.entries", entries)
        _define(tables, f"{name}.data", table.bitcast(_I64.as_pointer()))
    module = parse_assembly(constants)
    for law, name in names.items():
        module.link_in(_code_of(law, name))
    module.link_in(parse_assembly(str(tables)))
    for name in names.values():
        function = module.get_function(name)
        function.linkage = Linkage.internal
        function.add_function_attribute("alwaysinline")
    return str(module)


def _each(value: Given) -> Iterator[CompiledLaw | None]:
    yield from value if isinstance(value, tuple) else (value,)


def _define(module: ir.Module, name: str, value: Any) -> None:
    function = ir.Function(module, ir.FunctionType(value.type, [cgutils.voidptr_t]), name)
    function.attributes.add("alwaysinline")
    ir.IRBuilder(function.append_basic_block()).ret(value)


def _code_of(law: CompiledLaw, name: str) -> ModuleRef:
    """The code of a law in which its entry has this name, and nothing else is seen from outside.

    Two laws may be functions of one name, and one law has other names in every process that
    compiles it: neither is left, so that codes are equal if, and only if, they do the same.
    """
    compiled = law._compiled
    text = str(compiled._library._get_module_for_linking())
    for pattern, instead in ((_HEADER, ""), (_SCOPE, '!""')):
        text = pattern.sub(instead, text)
    # Numba keeps the entry apart from the function behind it; neither throws.
    text = _ATTRIBUTES.sub(lambda found: re.sub(r"\bnoinline\b", "nounwind", found[0]), text)
    module = parse_assembly(text)
    numbers = count()
    for item in (*module.global_variables, *module.functions):
        if item.is_declaration:
            continue
        entry = item.name == compiled._wrapper_name
        item.name = name if entry else f"{name}.{next(numbers)}"
        item.linkage = Linkage.external if entry else Linkage.internal
    # What follows an exception goes with the proof that there is none.
    library = compiled._library.codegen.create_library(name)
    library._final_module = module
    library._optimize_final_module()
    module = library._final_module
    python = [item.name for item in module.functions
              if item.is_declaration and item.name.startswith(_OF_PYTHON)]
    # Numbers that are addresses mean something else in another process.
    if python or compiled._library.has_dynamic_globals or "inttoptr (i64" in text:
        raise InputError(f"The law {law.python.__name__} does more than arithmetic (it allocates, "
                         f"may raise, or calls functions of other libraries) and cannot become "
                         f"part of the step loop; leave inline_laws out.")
    return module
