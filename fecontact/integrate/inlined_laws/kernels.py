"""Kernels made from intermediate code that is kept on disk.

Most of the time of compilation goes into making intermediate code of Python. It is the same for all
constants that are linked to it, and is stored as it is before it is optimised.
"""

import copy
import hashlib
from collections.abc import Callable
from functools import cache
from typing import Any

import llvmlite
from llvmlite.binding import parse_bitcode
from numba import njit
from numba.core.compiler import Compiler, compile_result
from numba.core.compiler_lock import global_compiler_lock
from numba.core.funcdesc import default_mangler, qualifying_prefix
from numba.core.lowering import Environment

from fecontact.core.compiled import _FASTMATH, _stamp
from fecontact.core.kernel_parts import _KernelLibrary, _PartLibrary

_ENTRIES = ("llvm_func_name", "llvm_cpython_wrapper_name", "llvm_cfunc_wrapper_name")


class _Intermediate(_PartLibrary):
    """Code of a kernel with its entries, before it is optimised."""

    def serialize_using_object_code(self) -> Any:
        """The intermediate code alone: there is no other."""
        return self.name, "intermediate", self._final_module.as_bitcode()


class _IntermediateCompiler(Compiler):
    def define_pipelines(self) -> Any:
        state = self.state
        state.library = _Intermediate(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().define_pipelines()


def _dispatcher(function: Any, variant: str, **options: Any) -> Any:
    found = njit(cache=True, error_model="numpy", fastmath=_FASTMATH, nogil=True, **options)(
        function.py_func)
    # Code for the version of LLVM: numba has its own in the mark of each file.
    _stamp(found, found, variant=f"{llvmlite.__version__} {variant}")
    return found


@cache
def intermediate(function: Any, signature: Any) -> Any:
    """What is stored of a kernel before optimisation, compiled where it is not."""
    dispatcher = _dispatcher(function, "intermediate", pipeline_class=_IntermediateCompiler)
    stored = dispatcher._cache
    found = _stored(stored, signature, dispatcher)
    if found is None:
        stored.disable()
        dispatcher.compile(signature)
        found = dispatcher.overloads[signature.args]._reduce()
        stored._impl.locator.ensure_cache_path()
        stored._cache_file.save(_key(stored, signature, dispatcher), found)
    return found


def is_stored(function: Any, signature: Any) -> bool:
    """Whether there is intermediate code of a kernel already."""
    dispatcher = _dispatcher(function, "intermediate", pipeline_class=_IntermediateCompiler)
    return _key(dispatcher._cache, signature, dispatcher) in (
        dispatcher._cache._cache_file._load_index())


def _key(stored: Any, signature: Any, dispatcher: Any) -> Any:
    return stored._index_key(signature, dispatcher.targetctx.codegen())


def _stored(stored: Any, signature: Any, dispatcher: Any) -> Any:
    return stored._cache_file.load(_key(stored, signature, dispatcher))


def kernel_of(
    function: Any, signature: Any, constants: str, announce: Callable[[bool], None],
) -> Any:
    """A kernel for fixed values and laws, as :func:`fecontact.core.compiled.kernel` makes them.

    Parameters
    ----------
    function : kernel
        That for all values.
    signature : signature of numba
        Its signature.
    constants : str
        Intermediate code of the values and laws.
    announce : callable
        Called before it has to be compiled: with whether its intermediate code is stored.
    """
    dispatcher = _dispatcher(function, constants)
    context, stored = dispatcher.targetctx, dispatcher._cache
    compiled = stored.load_overload(signature, context)
    if compiled is None:
        announce(is_stored(function, signature))
        given = intermediate(function, signature)
        with global_compiler_lock:
            compiled = _compiled(given, context, constants)
        stored.save_overload(signature, compiled)
    dispatcher.add_overload(compiled)
    dispatcher.disable_compile()
    return dispatcher


def _compiled(given: Any, context: Any, constants: str) -> Any:
    """The compiled kernel of stored intermediate code and constants."""
    (name, _, code), before, environment, signature, *_ = given
    # The loader takes the first function of a name that it has seen: each kernel has its own.
    own = copy.copy(before)
    mark = hashlib.sha256(constants.encode()).hexdigest()
    prefix = qualifying_prefix(own.modname, own.qualname)
    mangled = {"abi_tags": own.abi_tags, "uid": f"{own.uid}x{mark}"}
    own.mangled_name = default_mangler(prefix, own.argtypes, **mangled)
    own.env_name = default_mangler(f".NumbaEnv.{prefix}", own.argtypes, **mangled)
    module = parse_bitcode(code)
    for entry in _ENTRIES:
        module.get_function(getattr(before, entry)).name = getattr(own, entry)
    module.get_global_variable(before.env_name).name = own.env_name

    library = _KernelLibrary(context.codegen(), name)
    library.constants = constants
    library.enable_object_caching()
    library._final_module = module
    library.finalize()
    surroundings = Environment.from_fndesc(own)
    surroundings.consts[:] = environment.consts
    return compile_result(
        typing_context=context.typing_context, target_context=context, library=library,
        entry_point=context.get_executable(library, own, surroundings), fndesc=own,
        environment=surroundings, signature=signature, objectmode=False, lifted=(),
        type_annotation="", reload_init=(), referenced_envs=())
