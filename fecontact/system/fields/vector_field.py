"""Vector fields x' = f(t, x, p), evaluated at many places at once."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from copy import copy
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from fecontact.core.checks import merged, require_kind
from fecontact.core.errors import InputError, choices, nearest, require_finite
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised, listed

if TYPE_CHECKING:
    from fecontact.system.contact_system import ContactSystem


class VectorField(Summarised, ABC):
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

    def rough_derivatives(
        self, t: Array, x: Array, values: Array, active: Iterable[int], sizes: Array,
        step: float | None,
    ) -> tuple[Array, Array, Array] | None:
        """Derivatives as in :meth:`derivatives` without checks; None if that saves little time.

        Plain differences over a step in ``sizes`` (d,) of the states may be used too, unless
        ``step`` is None.
        """
        return None

    def summary(self) -> list[tuple[str, str]]:
        """States, and parameters with their base values."""
        return [("states", listed(self.state_names)),
                ("parameters", parameters_listed(self, self.values))]

    def as_new(self) -> Self:
        """Field without results of earlier calls; the field itself if it keeps none."""
        return self

    def parameter_label(self, name: str) -> str:
        """Label of a parameter for axes, with its meaning and unit where they are known."""
        return name

    def forcing_period(self, values: Array) -> float | None:
        """Period of f in t [s]; None where f does not depend on t."""
        return None

    def state_scales(self, values: Array) -> Array:
        """Typical size (d,) of each state; ones where nothing is known."""
        return np.ones(self.dimension)

    def in_time(self) -> "VectorField | ContactSystem":
        """System to integrate in time: this field, or the contact system that it is made of."""
        return self

    def kernel(self) -> Any:
        """The field at its base values as a FieldKernel; None if Python evaluates it."""
        return None

    def heed(self, wrong: Integers) -> None:
        """Told how often each column (d,) of Jacobians of the :meth:`kernel` was wrong."""
        return

    def with_(
        self, changes: Mapping[str, float] | None = None, /, **by_name: float
    ) -> Self:
        """Copy of the field with other base values of some parameters.

        Raises
        ------
        InputError
            If there is no parameter of such a name, or a value is no finite number.
        """
        changes = merged(changes, by_name)
        require_finite("with_", **changes)
        changed = self.values_with(**changes).tolist()
        made = copy(self)
        made.parameters = MappingProxyType(dict(zip(self.parameters, changed, strict=True)))
        return made

    def __copy__(self) -> Self:
        made = object.__new__(type(self))
        vars(made).update(vars(self))
        return made

    def __getstate__(self) -> dict[str, Any]:
        # Views of mappings cannot be pickled.
        return vars(self) | {"parameters": dict(self.parameters)}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        vars(self).update(state)
        self.parameters = MappingProxyType(state["parameters"])

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

    def state_index(self, name: str | int) -> int:
        """Place of a state, by its name or its number from 0.

        Raises
        ------
        InputError
            If there is none; it lists those that exist.
        """
        number = isinstance(name, int | np.integer) and not isinstance(name, bool)
        if number and 0 <= int(name) < self.dimension:
            return int(name)
        if name not in self.state_names:
            raise InputError(f"The vector field has no state {name!r}"
                             f"{nearest(str(name), self.state_names)}; its states are: "
                             f"{choices(self.state_names)}.")
        return self.state_names.index(str(name))

    def parameter_or_only(self, name: str | None) -> str:
        """The name, checked; without one the only parameter that there is.

        Raises
        ------
        InputError
            If there is none of this name, or no name and not just one parameter.
        """
        names = tuple(self.parameters)
        if name is None:
            if len(names) != 1:
                raise InputError(f"parameter is missing; name the one that is varied: "
                                 f"{choices(names)}.")
            return names[0]
        return names[self.index(name)]

    def values_with(self, **changes: float) -> Array:
        """Parameter values (k,): the base values with some changed by name.

        Raises
        ------
        InputError
            If there is no parameter of such a name, or a value is no finite number.
        """
        values = self.values
        for name, value in changes.items():
            place = self.index(name)
            require_finite("The vector field", **{name: value})
            values[place] = value
        return values


def require_field(given: object) -> None:
    """Raise InputError unless this is a vector field; a contact system itself is none."""
    if not isinstance(given, VectorField):
        raise InputError(f"A vector field is needed, not a {type(given).__name__}; make one with "
                         f"contact_field(system, names of parameters), or with "
                         f"vector_field(function, ...).")


def parameters_listed(field: VectorField, values: Array) -> str:
    """Names and values (k,) of the parameters of a field: ``rho = 28, sigma = 10``."""
    return listed([f"{name} = {value:g}" for name, value in
                   zip(field.parameters, values.tolist(), strict=True)], 8)
