"""Functions that kernels call by their addresses."""

from typing import Any

from numba import types
from numba.core.datamodel.models import PrimitiveModel
from numba.core.typing import Signature
from numba.extending import intrinsic, lower_builtin, register_model

from fecontact.core.records import eight_type, is_eight, signature_of


def contract_signature(contract: Any) -> Any:
    """The signature that numba has for a ``Callable[[...], ...]``, or for a kernel of that."""
    if isinstance(contract, Signature):
        return contract
    return signature_of(getattr(contract, "py_func", contract))


class _FunctionAt(types.Callable):
    """Numba's type of an address of a function in C that takes and returns numba's values.

    Where an argument is eight numbers, it is that of a function of eight numbers.
    """

    def __init__(self, signature: Any, only_reads: bool) -> None:
        self.signature, self.only_reads = signature, only_reads
        super().__init__(name=f"FunctionAt({signature}, {only_reads})")

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """Signature of the function if the number of arguments agrees, else None."""
        wanted = eight_type(self.signature) if any(map(is_eight, args)) else self.signature
        return wanted.replace(recvr=self) if len(args) == len(wanted.args) else None

    def get_call_signatures(self) -> Any:
        """Signature of the function."""
        return [self.signature], False

    def get_impl_key(self, sig: Any) -> Any:
        """All such functions are called in the same way."""
        return type(self)


@register_model(_FunctionAt)
class _FunctionAtModel(PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, dmm.lookup(types.int64).get_value_type())


@lower_builtin(_FunctionAt, _FunctionAt, types.VarArg(types.Any))
def _call_at(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    kind = signature.args[0]
    contract = types.FunctionType(Signature(signature.return_type, signature.args[1:], None))
    pointer = builder.inttoptr(args[0], context.get_value_type(contract.ftype))
    attributes = ("nounwind", "readonly") if kind.only_reads else ("nounwind",)
    return builder.call(pointer, args[1:], attrs=attributes)


def function_at(contract: Any, *, only_reads: bool = False) -> Any:
    """A function for kernels that turns an address into a callable.

    ``contract`` is its type, ``Callable[[...], ...]``, or a kernel of that. Functions that
    store nothing, ``only_reads``, leave what kernels have read as it was.
    """
    kind = _FunctionAt(contract_signature(contract), only_reads)

    @intrinsic
    def at(typingctx: Any, address: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return args[0]

        return kind(types.int64), codegen

    return at
