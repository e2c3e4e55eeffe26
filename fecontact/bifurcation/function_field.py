"""A vector field from a user's function of one state."""

from collections.abc import Callable, Iterable, Mapping
from types import CodeType, MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fecontact.bifurcation import function_kernels as kernels
from fecontact.bifurcation.vector_field import Array, VectorField
from fecontact.compiled import CompiledLaw, compile_law
from fecontact.errors import InputError, choices, require_finite

_FORM = "f(t, x, p, out)"
_WAYS = ("automatic", "complex", "differences")
# What takes complex numbers and loses their imaginary part.
_NOT_ANALYTIC = {"abs", "absolute", "fabs", "sign", "real", "imag", "conj", "conjugate", "angle"}


class FunctionField(VectorField):
    """See :meth:`VectorField.from_function`.

    Attributes
    ----------
    differentiation : str
        'complex' or 'differences': how derivatives that are not given are formed.
    """

    def __init__(
        self,
        rates: CompiledLaw,
        jacobian: CompiledLaw | None,
        complex_rates: CompiledLaw | None,
        parameters: Mapping[str, float],
        state_names: tuple[str, ...],
        scales: Array,
        period: Callable[[Mapping[str, float]], float] | None,
    ) -> None:
        self.parameters = MappingProxyType(dict(parameters))
        self.state_names = state_names
        self.differentiation = "differences" if complex_rates is None else "complex"
        self._rates, self._jacobian, self._complex = rates, jacobian, complex_rates
        self._scales, self._period = scales, period

    def rates(self, t: Array, x: Array, values: Array) -> Array:
        """Rates (N, d); see :meth:`VectorField.rates`."""
        f = np.empty_like(x)
        kernels.batch_rates(self._rates.address, t, x, values, f)
        return f

    def derivatives(
        self, t: Array, x: Array, values: Array, active: Iterable[int] = ()
    ) -> tuple[Array, Array, Array]:
        """Rates and their derivatives; see :meth:`VectorField.derivatives`."""
        chosen = np.array(tuple(active), dtype=np.int64)
        n, d = x.shape
        f, J, P = np.empty((n, d)), np.empty((n, d, d)), np.empty((n, d, len(chosen)))
        kernels.batch_rates(self._rates.address, t, x, values, f)
        if self._jacobian is not None:
            kernels.batch_jacobians(self._jacobian.address, t, x, values, J)
        states = self._jacobian is None
        if states or len(chosen):
            if self._complex is not None:
                kernels.complex_steps(self._complex.address, t, x, values, chosen, states, J, P)
            else:
                kernels.differences(self._rates.address, t, x, values, self._scales, chosen,
                                    states, J, P)
        return f, J, P

    def forcing_period(self, values: Array) -> float | None:
        """Period as the user gives it [s]; None where f does not depend on t."""
        if self._period is None:
            return None
        return float(self._period(dict(zip(self.parameters, values.tolist(), strict=True))))

    def state_scales(self, values: Array) -> Array:
        """Typical sizes (d,) as the user gives them."""
        return self._scales


def function_field(
    function: Callable[..., Any],
    parameters: Mapping[str, float],
    states: int | Iterable[str],
    jacobian: Callable[..., Any] | None,
    differentiation: str,
    scales: ArrayLike | None,
    period: Callable[[Mapping[str, float]], float] | None,
) -> FunctionField:
    """See :meth:`VectorField.from_function`."""
    if differentiation not in _WAYS:
        raise InputError(f"differentiation = {differentiation!r} must be one of "
                         f"{choices(_WAYS)}.")
    names = (tuple(f"x{i + 1}" for i in range(states)) if isinstance(states, int)
             else tuple(states))
    if not names:
        raise InputError("A vector field needs at least one state.")
    require_finite("Vector field", **dict(parameters))
    typical = np.ones(len(names)) if scales is None else np.array(scales, dtype=float)
    if typical.shape != (len(names),) or not (typical > 0.0).all():
        raise InputError(f"scales = {scales!r} must hold {len(names)} numbers above zero, one for "
                         f"each state.")
    rates = compile_law(kernels.RATES, _FORM, function)
    _ = rates.address
    given = None if jacobian is None else compile_law(kernels.JACOBIAN, _FORM, jacobian)
    if given is not None:
        _ = given.address
    complex_rates = None
    if differentiation != "differences":
        complex_rates = _analytic(function, required=differentiation == "complex")
    return FunctionField(rates, given, complex_rates, parameters, names, typical, period)


def _analytic(function: Callable[..., Any], required: bool) -> CompiledLaw | None:
    """The function for complex numbers, if it is analytic as far as can be seen."""
    used = _names(function, set()) & _NOT_ANALYTIC
    if used:
        if required:
            raise InputError(f"The function {function.__name__} uses {choices(used)}, which the "
                             f"complex step does not get right; choose "
                             f"differentiation = 'differences' or give a jacobian.")
        return None
    compiled = compile_law(kernels.COMPLEX_RATES, _FORM, function)
    try:
        _ = compiled.address
    except InputError as error:
        if required:
            raise InputError(f"The function {function.__name__} does not take complex numbers; use "
                             f"numpy functions and no comparisons, or choose "
                             f"differentiation = 'differences'.") from error
        return None
    return compiled


def _names(function: Any, seen: set[int]) -> set[str]:
    """Names that a function uses, and those of the functions that it calls."""
    function = getattr(function, "py_func", function)
    code = getattr(function, "__code__", None)
    if not isinstance(code, CodeType) or id(code) in seen:
        return set()
    seen.add(id(code))
    names = set(code.co_names)
    closure = getattr(function, "__closure__", None) or ()
    outside = dict(zip(code.co_freevars, (cell.cell_contents for cell in closure), strict=False))
    for name in (*code.co_names, *code.co_freevars):
        called = outside.get(name, function.__globals__.get(name))
        if callable(called):
            if called is abs:
                names.add("abs")
            names |= _names(called, seen)
    return names
