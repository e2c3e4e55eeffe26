"""Vector fields from a user's function of one state."""

import pickle
import warnings
from collections.abc import Callable, Iterable, Mapping
from copy import copy
from dataclasses import replace
from functools import partial
from types import CodeType, MappingProxyType
from typing import Any, Self

import numpy as np

from fecontact.core.checks import as_count, as_floats, as_texts, require_kind, require_within
from fecontact.core.compiled import CompiledLaw, compile_law
from fecontact.core.errors import (
    AnalysisError,
    InputError,
    choices,
    require_choice,
    require_finite,
    require_positive,
    shown,
)
from fecontact.core.types import Array, ArrayLike, Integers
from fecontact.system.fields import function_kernels as kernels
from fecontact.system.fields.one_place import compiled_field
from fecontact.system.fields.vector_field import VectorField

_FORM = "f(t, x, p, out)"
_WAYS = ("automatic", "complex", "differences")
# Samples at which the complex step is checked against differences before it is used.
_SAMPLES = 16
# Bits of a NaN that no computation makes; sums with it keep them.
_UNFILLED = 0x7FF8FEC0_47AC7000
_NONE = np.zeros(0, dtype=np.int64)
# States below this part of their scales are zero.
_NOTHING = 1e-60
# Most states of a field, against typing errors.
_MOST_STATES = 100_000
# Functions that accept complex numbers but are not analytic.
_NOT_ANALYTIC = {"abs", "absolute", "fabs", "sign", "real", "imag", "conj", "conjugate", "angle"}


class FunctionField(VectorField):
    """See :meth:`vector_field`.

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
        required: bool = False,
    ) -> None:
        self.parameters = MappingProxyType(dict(parameters))
        self.state_names = state_names
        self.differentiation = "differences" if complex_rates is None else "complex"
        self._rates, self._jacobian, self._complex = rates, jacobian, complex_rates
        self._scales, self._period, self._required = scales, period, required
        self._was_wrong = False
        # A value may pass zero, and be rounding there.
        base = np.abs(self.values)
        self._sizes = np.where(base > 0.0, base, 1.0)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return copy(self)

    def __getstate__(self) -> dict[str, Any]:
        for function in self.functions:
            _require_importable(getattr(function, "python", function))
        # Without the compiled code, which belongs to this process.
        return {name: replace(value) if isinstance(value, CompiledLaw) else value
                for name, value in super().__getstate__().items()}

    @property
    def functions(self) -> tuple[Any, ...]:
        """Rates, Jacobian, rates of complex numbers and period; None for those it has not."""
        return self._rates, self._jacobian, self._complex, self._period

    def rates(self, t: Array, x: Array, values: Array) -> Array:
        """Rates (N, d); see :meth:`VectorField.rates`."""
        f = np.empty_like(x)
        kernels.batch_rates(self._rates.address, t, x, values, f)
        return f

    def derivatives(
        self, t: Array, x: Array, values: Array, active: Iterable[int] = ()
    ) -> tuple[Array, Array, Array]:
        """Rates and their derivatives; see :meth:`VectorField.derivatives`.

        Warns
        -----
        UserWarning
            If the complex step is wrong at some of the places, and differences take its place.

        Raises
        ------
        AnalysisError
            If it is wrong, and was asked for.
        """
        chosen = np.array(tuple(active), dtype=np.int64)
        f, J, P, wrong = self.checked(t, x, values, chosen)
        self.heed(wrong, chosen)
        return f, J, P

    def checked(
        self, t: Array, x: Array, values: Array, active: Integers
    ) -> tuple[Array, Array, Array, Integers]:
        """Derivatives as in :meth:`derivatives`, and counts (d + a,) of failed complex steps."""
        # Products of states beside zero would underflow in the complex step.
        x = np.where(np.abs(x) < _NOTHING * self._scales, 0.0, x)
        way = kernels.EXTRAPOLATED if self._complex is None else kernels.COMPLEX
        return self._derived(way, t, x, values, active, self._scales)

    def _derived(
        self, way: int, t: Array, x: Array, values: Array, active: Integers, scales: Array,
        step: float = 0.0,
    ) -> tuple[Array, Array, Array, Integers]:
        """Derivatives and counts as of :meth:`checked`, in one of the ways of the kernels."""
        (n, d), a, states = x.shape, len(active), self._jacobian is None
        f, J, P = np.empty((n, d)), np.empty((n, d, d)), np.empty((n, d, a))
        wrong = np.zeros(d + a, dtype=np.int64)
        kernels.batch_rates(self._rates.address, t, x, values, f)
        if self._jacobian is not None:
            kernels.batch_jacobians(self._jacobian.address, t, x, values, J)
        if states or a:
            complex_rates = 0 if self._complex is None else self._complex.address
            kernels.fill_derivatives(
                kernels.Steps(way, step, self._rates.address, complex_rates),
                kernels.Places(t, x, f, values, scales, self._sizes, active, states),
                kernels.workspace_for(d, len(values)), J, P, wrong)
        return f, J, P, wrong

    def rough_derivatives(
        self, t: Array, x: Array, values: Array, active: Iterable[int], sizes: Array,
        step: float | None,
    ) -> tuple[Array, Array, Array] | None:
        """See :meth:`VectorField.rough_derivatives`.

        By the complex step without a check unless it was wrong before, or central differences;
        :meth:`as_new` forgets what was before.
        """
        chosen = np.array(tuple(active), dtype=np.int64)
        if self._complex is not None and not self._was_wrong:
            f, J, P, _ = self._derived(kernels.UNCHECKED, t, x, values, chosen, sizes)
            if np.isfinite(J.sum() + P.sum()):
                return f, J, P
        if step is None:
            return None
        return self._derived(kernels.ONE_STEP, t, x, values, chosen, sizes, step)[:3]

    def as_new(self) -> Self:
        """Copy of the field without a record of failed complex steps."""
        made = copy(self)
        made._was_wrong = False
        return made

    def heed(self, wrong: Integers, active: Integers = _NONE) -> None:
        """Warn of a complex step that failed at places (d + a,), or raise; see derivatives."""
        if wrong.any():
            self._was_wrong = True
            message = self.complaint(wrong, active)
            if self._required:
                raise AnalysisError(message)
            warnings.warn(f"{message} Where the step is wrong, differences take its place.",
                          stacklevel=3)

    def kernel(self) -> Any:
        """The field for kernels; see :meth:`VectorField.kernel`."""
        jacobian, analytic = (0 if one is None else one.address
                              for one in (self._jacobian, self._complex))
        return compiled_field(self._rates.address, jacobian, analytic, self.values, self._scales)

    def complaint(self, wrong: Integers, active: Integers) -> str:
        """Message for which states and parameters the complex step fails."""
        parameters = list(self.parameters)
        names = [*self.state_names, *(parameters[index] for index in active)]
        listed = ", ".join(repr(name) for name, count in zip(names, wrong, strict=True) if count)
        return (f"The complex step does not get the derivatives of {self._rates.python.__name__} "
                f"to {listed} right; choose differentiation = 'differences' or give a jacobian.")

    def forcing_period(self, values: Array) -> float | None:
        """Period as the user gives it [s]; None where f does not depend on t."""
        if self._period is None:
            return None
        period = self._period(dict(zip(self.parameters, values.tolist(), strict=True)))
        require_positive("The function given as period of a vector field", period=period)
        return float(period)

    def state_scales(self, values: Array) -> Array:
        """Typical sizes (d,) as the user gives them."""
        return self._scales


def vector_field(
    function: Callable[..., Any],
    parameters: Mapping[str, float],
    states: int | Iterable[str],
    *,
    jacobian: Callable[..., Any] | None = None,
    differentiation: str = "automatic",
    scales: ArrayLike | None = None,
    period: float | Callable[[Mapping[str, float]], float] | None = None,
) -> VectorField:
    """A vector field from a function of one state, compiled by numba.

    Parameters
    ----------
    function : callable
        ``f(t, x, p, out)`` that fills out (d,) with the rates at the state x (d,), for the
        parameters p (k,). It is compiled: arithmetic, ``math`` or ``numpy`` functions, loops.
    parameters : mapping
        Names and base values, in the order of p.
    states : int or sequence of str
        Number of states, or their names.
    jacobian : callable, optional
        ``g(t, x, p, out)`` that fills out (d, d) with df_i/dx_j.
    differentiation : 'automatic', 'complex' or 'differences'
        How derivatives that are not given are formed. 'differences' are central ones,
        extrapolated to order six, over steps that are halved, from 2e-3 of the larger of the
        state and its scale on, until truncation is below rounding: good to some 1e-11 of the
        rates over the scale, with kinks and steep laws beside the state too. 'complex' is the
        complex step, exact to round-off for functions that are analytic and accept complex
        numbers (``numpy`` functions instead of those of ``math``; no comparisons, abs, sign,
        min or max of states, no powers of negative numbers). It is compared with differences
        wherever it is used, and refused where it is wrong by more than 1e-7. 'automatic' is
        complex if that is right at samples of either sign around zero, up to twice the
        scales, else differences; see ``differentiation`` of the result. Where it turns
        out wrong later, as functions do that overflow, differences take its place there, with
        a warning.
    scales : sequence, optional
        Typical size (d,) of each state; one by default. Smaller states are fine.
    period : float or callable, optional
        Period in t [s], or that from the parameters by name, for a function that depends on t.

    Raises
    ------
    InputError
        If the function cannot be compiled, uses states or parameters that there are not, leaves
        entries of ``out`` as they are, or does not allow the differentiation asked for.
        With 'complex', derivatives raise :class:`AnalysisError` where it turns out wrong.
    """
    require_choice("vector_field", "differentiation", differentiation, _WAYS)
    for name, given_function in (("function", function), ("jacobian", jacobian)):
        if not (callable(given_function) or (name == "jacobian" and given_function is None)):
            raise InputError(f"vector_field: {name} = {shown(given_function)} must be a function "
                             f"{_FORM}.")
    require_kind("vector_field", Mapping, parameters=parameters)
    as_texts(tuple(parameters), "vector_field: names of parameters")
    require_finite("Vector field", **parameters)
    names = _state_names(states)
    typical = np.ones(len(names)) if scales is None else as_floats(scales, "scales")
    if typical.shape != (len(names),) or not ((typical > 0.0) & (typical < np.inf)).all():
        raise InputError(f"scales = {shown(scales)} must hold {len(names)} numbers above zero, one "
                         f"for each state.")
    period_of = _period_of(period)
    rates = compile_law(kernels.RATES, _FORM, function)
    _require_compiled(rates, "function")
    given = None if jacobian is None else compile_law(kernels.JACOBIAN, _FORM, jacobian)
    if given is not None:
        _require_compiled(given, "jacobian")
    values, d = np.array(list(parameters.values()), dtype=float), len(names)
    for name, compiled, shape in (("function", rates, (d,)), ("jacobian", given, (d, d))):
        if compiled is not None:
            for x in (typical.copy(), -typical):
                out = np.full(shape, _UNFILLED, dtype=np.int64).view(float)
                if require_within(f"vector_field: the {name}", compiled.python,
                                  f"states: {d}, parameters: {len(values)}", 1.0, x, values, out):
                    _require_filled(name, compiled.python.__name__, out)
    required = differentiation == "complex"
    complex_rates = None
    if differentiation != "differences":
        complex_rates = _analytic(function, required)
    if complex_rates is not None:
        made = FunctionField(rates, given, complex_rates, parameters, names, typical, period_of,
                             required)
        message = _wrong_at_samples(made)
        if message is None:
            return made
        if required:
            raise InputError(message)
    return FunctionField(rates, given, None, parameters, names, typical, period_of)


def _require_filled(name: str, function: str, out: Array) -> None:
    """Raise InputError if a function has left entries of ``out`` as they were."""
    left = np.argwhere(out.view(np.int64) == _UNFILLED)
    if len(left):
        first = ", ".join(map(str, left[0]))
        raise InputError(f"vector_field: the {name} {function} leaves out[{first}] as it is; "
                         f"fill all {out.size} entries of out, with zeros too, or declare fewer "
                         f"states.")


def _require_compiled(function: CompiledLaw, name: str) -> None:
    """Raise InputError, which speaks of no law, unless the function can be compiled."""
    try:
        _ = function.address
    except InputError as error:
        what = str(error).replace("The law ", f"vector_field: the {name} ")
        raise InputError(what.replace("a compiled law", "a compiled function").replace(
            "check parameters in __post_init__ of the law's class, and return", "return")) from None


def _state_names(states: int | Iterable[str]) -> tuple[str, ...]:
    """The names of the states, or x1, x2, ... of so many."""
    if isinstance(states, int | np.integer) or not isinstance(states, Iterable):
        many = as_count(states, "vector_field: states, their number,")
        if many > _MOST_STATES:
            raise InputError(f"vector_field: states = {shown(states)} must be at most "
                             f"{_MOST_STATES}.")
        return tuple(f"x{i + 1}" for i in range(many))
    names = as_texts(tuple(states), "vector_field: states")
    if not names or len(set(names)) < len(names):
        raise InputError(f"vector_field: states = {shown(states)} must be at least one name, all "
                         f"different, or a number of states.")
    return names


def _period_of(period: Any) -> Callable[[Mapping[str, float]], float] | None:
    if period is None or callable(period):
        return period
    try:
        require_positive("vector_field", period=period)
    except InputError:
        raise InputError(f"period = {shown(period)} must be a number above zero [s], or a function "
                         f"that returns it from the parameters by name.") from None
    return partial(_constant, float(period))


def _constant(period: float, parameters: Mapping[str, float]) -> float:
    return period


def _require_importable(function: Any) -> None:
    """Raise InputError for a function that pickle cannot name to another process."""
    try:
        pickle.dumps(function)
    except (pickle.PicklingError, AttributeError, TypeError):
        name = getattr(function, "__qualname__", shown(function))
        raise InputError(f"The vector field cannot be pickled, for a file or for another process, "
                         f"because its function {name} is a lambda or stands inside another "
                         f"function; define it by def at the top level of a module.") from None


def _wrong_at_samples(field: FunctionField) -> str | None:
    """Why the complex step fails at samples within twice the scales; None if it does not.

    The samples are those of a Kronecker sequence: without order, but always the same.
    """
    d = field.dimension
    spread = np.arange(1.0, _SAMPLES + 1.0)[:, None] * np.sqrt(np.arange(2.0, d + 2.0) + 0.37)
    x = (4.0 * np.modf(spread)[0] - 2.0) * field.state_scales(field.values)
    period = field.forcing_period(field.values) or 0.0
    t = period * np.arange(_SAMPLES) / _SAMPLES
    every = np.arange(len(field.parameters))
    wrong = field.checked(t, x, field.values, every)[3]
    return field.complaint(wrong, every) if wrong.any() else None


def _analytic(function: Callable[..., Any], required: bool) -> CompiledLaw | None:
    """The function for complex numbers; None if it is visibly not analytic."""
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
    except (InputError, NotImplementedError) as error:
        if required:
            raise InputError(f"The function {function.__name__} does not take complex numbers; use "
                             f"numpy functions and no comparisons, or choose "
                             f"differentiation = 'differences'.") from error
        return None
    return compiled


def _names_of(code: Any) -> set[str]:
    """Names that the code of a function uses, and that of functions inside it."""
    if not isinstance(code, CodeType):
        return set()
    return set(code.co_names).union(*(_names_of(inner) for inner in code.co_consts))


def _names(function: Any, seen: set[int]) -> set[str]:
    """Names that a function uses, and those of the functions that it calls."""
    function = getattr(function, "py_func", function)
    code = getattr(function, "__code__", None)
    if not isinstance(code, CodeType) or id(code) in seen:
        return set()
    seen.add(id(code))
    names = _names_of(code)
    closure = getattr(function, "__closure__", None) or ()
    outside = dict(zip(code.co_freevars, (cell.cell_contents for cell in closure), strict=False))
    for name in (*code.co_names, *code.co_freevars):
        called = outside.get(name, function.__globals__.get(name))
        if callable(called):
            if called is abs:
                names.add("abs")
            names |= _names(called, seen)
    return names
