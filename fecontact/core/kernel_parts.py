"""Functions that become part of kernels, compiled as far as that needs and no further.

Numba makes machine code of every function, with entries for Python and C, and optimises what is
called anew in each caller. A part is left as intermediate code, and optimised with its kernel.
"""

from collections.abc import Callable
from functools import cached_property
from itertools import product
from typing import Any

from llvmlite.binding import Linkage, parse_assembly
from llvmlite.ir import CallInstr
from numba import types
from numba.core import ir, sigutils
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import build_definitions, mk_unique_var
from numba.core.registry import CPUDispatcher
from numba.core.typeconv.rules import default_type_manager
from numba.core.untyped_passes import FixupArgs

from fecontact.core.records import holds_arrays
from fecontact.core.references import borrowed

_NO_ENTRY = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


# Kernels are compiled for writeable arrays. Python may hand them read-only ones of results too, to
# which they must not write; without a conversion numba would refuse them as another type.
for _kind, _dimensions in product(
        (types.float64, types.int64, types.int32, types.complex128, types.boolean), range(1, 5)):
    _array = types.Array(_kind, _dimensions, "C")
    default_type_manager.set_unsafe_convert(_array.copy(readonly=True), _array)


class _NoMachineCode:
    """A code generator whose libraries are not loaded and therefore have no environment."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, env_name: str, env: Any) -> None:
        """Do nothing: the kernel provides the environment."""


class _Library(JITCodeLibrary):
    """Code whose functions are optimised one by one before it is joined with other code."""

    def _optimize_functions(self, ll_module: Any) -> None:
        # Numba does it for declarations, and for functions that read a single field, too.
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration and not function.name.startswith("Reference("):
                passes, builder = self._codegen._function_pass_manager()
                passes.run(function, builder)


class _PartLibrary(_Library):
    """Intermediate code of a part and of what it calls."""

    @property
    def codegen(self) -> Any:
        return _NoMachineCode(self._codegen)

    def get_pointer_to_function(self, name: str) -> int:
        """Zero, as for functions that are not defined."""
        self._ensure_finalized()
        return 0

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


class _KernelLibrary(_Library):
    """Code of a kernel, which is seen from outside by its entries only.

    Its routines stay functions of their own, unless ``constants`` make them short.
    """

    constants = ""

    def _optimize_final_module(self) -> None:
        entries = {function.name for function in self._final_module.functions
                   if function.linkage == Linkage.external}
        if self.constants:
            module = parse_assembly(self.constants)
            module.triple = self._final_module.triple
            module.data_layout = self._final_module.data_layout
            self._final_module.link_in(module)
        for function in self._final_module.functions:
            if not function.is_declaration and function.name not in entries:
                function.linkage = Linkage.internal
                inlined = b"alwaysinline" in b" ".join(function.attributes)
                if not (self.constants or inlined) and function.name.startswith("_ZN9fecontact"):
                    function.add_function_attribute("noinline")
        super()._optimize_final_module()
        # Compiled laws hold functions of the same names that may be shared. The loader would give
        # them these, which may have lost arguments. Optimisation knows some by their names.
        for function in self._final_module.functions:
            if not function.is_declaration and function.name not in entries:
                function.name += ".inner"


class _LawLibrary(JITCodeLibrary):
    """Code of a law, which becomes part of its entry, as it raises no exceptions.

    Numba's entries call it instead, and its results go through memory.
    """

    def add_ir_module(self, module: Any) -> None:
        """Add intermediate code, in which calls of the law may be replaced by its code."""
        if module.name == "cfunc_wrapper":
            for function in module.functions:
                for block in function.blocks:
                    for step in block.instructions:
                        if isinstance(step, CallInstr):
                            step.attributes.discard("noinline")
        super().add_ir_module(module)

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and not function.name.startswith("cfunc."):
                function.linkage = Linkage.internal
        super()._optimize_final_module()


@register_pass(mutates_CFG=False, analysis_only=False)
class _Borrow(FunctionPass):
    """Arrays and records that a kernel is given are borrowed from who calls it."""

    _name = "borrow"

    def __init__(self) -> None:
        """Do nothing: the pass has no state."""

    def run_pass(self, state: Any) -> bool:
        """Put calls of :func:`borrowed` before the first use of arguments."""
        blocks = state.func_ir.blocks
        first = blocks[min(blocks)]
        body = []
        for step in first.body:
            body.append(step)
            if isinstance(step, ir.Assign) and isinstance(step.value, ir.Arg) and (
                    holds_arrays(state.args[step.value.index])):
                held = ir.Var(first.scope, mk_unique_var("held"), step.loc)
                borrow = ir.Var(first.scope, mk_unique_var("borrow"), step.loc)
                body += [
                    ir.Assign(ir.Global("borrowed", borrowed, step.loc), borrow, step.loc),
                    ir.Assign(ir.Expr.call(borrow, [held], (), step.loc), step.target, step.loc)]
                step.target = held
        first.body = body
        state.func_ir._definitions = build_definitions(blocks)
        return True


# Numba's hash of flags, which depends on their names alone, and the values of those not set.
_HASH = int(Flags.__hash__(Flags()))
_DEFAULTS = {name: option.default for name, option in Flags.options.items()}


class _Flags(Flags):
    """Numba's flags, which it compares at each call that it types, by reading all of them twice.

    Only those that are set on one side are read here.
    """

    def __hash__(self) -> int:
        return _HASH

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Flags):
            return NotImplemented
        mine, others = self._values, other._values
        if mine == others:
            return True
        for name in mine.keys() | others.keys():
            default = _DEFAULTS[name]
            if mine.get(name, default) != others.get(name, default):
                return False
        return True


class _PlainCompiler(Compiler):
    """Numba's compiler, which spends less time on its flags."""

    def __init__(self, *settings: Any) -> None:
        super().__init__(*settings)
        self.state.flags = _Flags(self.state.flags)


class BorrowingCompiler(_PlainCompiler):
    """A compiler of functions that borrow what they are given."""

    def define_pipelines(self) -> Any:
        """Numba's passes and that."""
        passes, = super().define_pipelines()
        passes.add_pass_after(_Borrow, FixupArgs)
        passes.finalize()
        return [passes]


class LawCompiler(BorrowingCompiler):
    """A compiler of laws."""

    def define_pipelines(self) -> Any:
        """Numba's passes, for such a library."""
        state = self.state
        state.library = _LawLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().define_pipelines()


def kernel_compiler(constants: str) -> Any:
    """A compiler whose kernels have fixed values by :func:`fecontact.core.constants.constants`."""

    class KernelCompiler(BorrowingCompiler):
        def define_pipelines(self) -> Any:
            state = self.state
            state.library = _KernelLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
            state.library.constants = constants
            state.library.enable_object_caching()
            return super().define_pipelines()

    return KernelCompiler


class _OfParts:
    def define_pipelines(self: Any) -> Any:
        state = self.state
        state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return super().define_pipelines()  # type: ignore[misc]


class PartCompiler(_OfParts, _PlainCompiler):
    """A compiler of parts."""


class _BorrowingPartCompiler(_OfParts, BorrowingCompiler):
    """A compiler of parts that borrow what they are given."""


class _Part(CPUDispatcher):
    """A part; where Python calls it, a second one is compiled that has an entry."""

    @cached_property
    def _callable(self) -> Any:
        options = {key: value for key, value in self.targetoptions.items() if key not in _NO_ENTRY}
        return CPUDispatcher(self.py_func, targetoptions=options)

    def __call__(self, *arguments: Any) -> Any:
        return self._callable(*arguments)

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, unless that is done.

        Numba does the same, and tells each function under way, of which there are many at a time,
        about every lock: a part takes no time of its own that anybody asks for. A constant that is
        given has the type of other numbers here, so that nothing is compiled for it alone.
        """
        given, result = sigutils.normalize_signature(sig)
        arguments = tuple(map(types.unliteral, given))
        found = self.overloads.get(arguments)
        if found is None:
            found = self._compiler.compile(arguments, result)
            self.add_overload(found)
        return found.entry_point


def part(function: Callable[..., Any], *, borrows: bool = False, **options: Any) -> Any:
    """A function that kernels call; ``options`` are those of numba."""
    return _Part(function, targetoptions={"nopython": True, "boundscheck": None, **_NO_ENTRY,
                                          **options},
                 pipeline_class=_BorrowingPartCompiler if borrows else PartCompiler)
