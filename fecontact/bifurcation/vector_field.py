"""Vector fields x' = f(t, x, p), evaluated at many places at once."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.arguments import require_kind
from fecontact.errors import InputError, choices, nearest

Array = NDArray[np.float64]


class VectorField(ABC):
    """Rates x' = f(t, x, p) of d states with k parameters, for N places at once.

    Parameters are named; where an array of values (k,) is asked for, they stand in the order of
    :attr:`parameters`.

    Attributes
    ----------
    parameters : mapping
        Name and base value of each parameter, in order; read-only.
    state_names : tuple of str
        Names (d,) of the states.
    """

    parameters: Mapping[str, float]
    state_names: tuple[str, ...]

    @abstractmethod
    def rates(self, t: Array, x: Array, values: Array) -> Array:
        """Rates f (N, d) at times t (N,) and states x (N, d), for parameter values (k,)."""

    @abstractmethod
    def derivatives(
        self, t: Array, x: Array, values: Array, active: Iterable[int] = ()
    ) -> tuple[Array, Array, Array]:
        """Rates f (N, d), df/dx (N, d, d) and df/dp (N, d, a) to parameters of indices ``active``.

        All are C-contiguous.
        """

    def forcing_period(self, values: Array) -> float | None:
        """Period of f in t [s]; None where f does not depend on t."""
        return None

    def state_scales(self, values: Array) -> Array:
        """Typical size (d,) of each state; ones where nothing is known."""
        return np.ones(self.dimension)

    @property
    def dimension(self) -> int:
        """Number d of states."""
        return len(self.state_names)

    @property
    def values(self) -> Array:
        """Base values (k,) of the parameters, a new array."""
        return np.array(list(self.parameters.values()), dtype=float)

    def index(self, name: str) -> int:
        """Place of a parameter.

        Raises
        ------
        InputError
            If there is none of this name; it lists those that exist.
        """
        require_kind("A vector field", str, parameter=name)
        names = tuple(self.parameters)
        if name not in names:
            raise InputError(f"The vector field has no parameter {name!r}{nearest(name, names)}; "
                             f"its parameters are: {choices(names)}.")
        return names.index(name)

    def values_with(self, **changes: float) -> Array:
        """Parameter values (k,): the base values with some changed by name."""
        values = self.values
        for name, value in changes.items():
            values[self.index(name)] = value
        return values

    @staticmethod
    def from_function(
        function: Callable[..., Any],
        parameters: Mapping[str, float],
        states: int | Iterable[str],
        *,
        jacobian: Callable[..., Any] | None = None,
        differentiation: str = "automatic",
        scales: ArrayLike | None = None,
        period: Callable[[Mapping[str, float]], float] | None = None,
    ) -> "VectorField":
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
            scales, else differences; see :attr:`differentiation` of the result. Where it turns
            out wrong later, as functions do that overflow, differences take its place there, with
            a warning.
        scales : sequence, optional
            Typical size (d,) of each state; one by default. Smaller states are fine.
        period : callable, optional
            Period in t from the parameters by name, for a function that depends on t.

        Raises
        ------
        InputError
            If the function cannot be compiled, or does not allow the differentiation asked for.
            With 'complex', derivatives raise :class:`AnalysisError` where it turns out wrong.
        """
        from fecontact.bifurcation.function_field import function_field

        return function_field(function, parameters, states, jacobian, differentiation, scales,
                              period)


def require_field(given: object) -> None:
    """InputError for what is no vector field, such as a contact system itself."""
    if not isinstance(given, VectorField):
        raise InputError(f"A vector field is needed, not a {type(given).__name__}; make one with "
                         f"contact_field(system, names of parameters), or with "
                         f"VectorField.from_function.")
