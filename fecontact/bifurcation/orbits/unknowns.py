"""Parameters and period among the unknowns of orbits and tori.

The last unknowns are the free parameters; the period of an orbit stands before them where it is
unknown, which it is if rates do not depend on time.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Relative step of differences in an unknown.
_DIFFERENCE = 1e-5


def beside(u: Array, place: int = -1, least: float = 1e-3) -> tuple[Array, Array]:
    """Unknowns with more and with less of one of them, in parts of its size or the least one."""
    step = np.zeros_like(u)
    step[place] = _DIFFERENCE * max(abs(float(u[place])), least)
    return u + step, u - step


def by_differences(
    function: Callable[[Array], Array | float], u: Array, place: int = -1, least: float = 1e-3
) -> Array:
    """Derivative of a function of the unknowns to one of them, by central differences."""
    more, less = beside(u, place, least)
    return np.asarray((function(more) - function(less)) / (more[place] - less[place]))


def forcing_period(field: VectorField, values: Array, free: int) -> float | None:
    """Period of the forcing [s], None for an autonomous field.

    Where the free parameter is an amplitude of zero, nothing excites the system: the period is that
    of values beside it, if these have the same one.
    """
    found = field.forcing_period(values)
    if found is not None:
        return found
    step = np.zeros_like(values)
    step[free] = _DIFFERENCE * max(abs(float(values[free])), 1e-3)
    near, farther = (field.forcing_period(values + part * step) for part in (1.0, 2.0))
    return near if near == farther else None


class FreeParameters:
    """Values (k,) of parameters of a field, ``free`` followed, and perhaps a ``second`` one."""

    field: Any
    values: Array
    free: int
    second: int | None = None

    @cached_property
    def active(self) -> tuple[int, ...]:
        """Indices of the parameters that are unknowns, in their order in u."""
        return (self.free,) if self.second is None else (self.second, self.free)

    @property
    def parameter_name(self) -> str:
        """Name of the parameter that is followed."""
        return list(self.field.parameters)[self.free]

    def parameters(self, u: Array) -> Array:
        """Parameter values (k,)."""
        values = self.values.copy()
        values[self.free] = u[-1]
        if self.second is not None:
            values[self.second] = u[-2]
        return values

    def named(self, u: Array) -> dict[str, float]:
        """Values of the parameters that are unknowns, by name."""
        names, count = list(self.field.parameters), len(self.active)
        return {names[index]: float(value)
                for index, value in zip(self.active, u[-count:], strict=True)}


class OrbitUnknowns(FreeParameters):
    """Period and parameters of an orbit over ``periods`` periods of the forcing of a field."""

    field: VectorField
    periods: int

    @cached_property
    def autonomous(self) -> bool:
        """Whether the period is an unknown."""
        return forcing_period(self.field, self.values, self.free) is None

    @cached_property
    def common(self) -> int:
        """Number of unknowns that are no states: parameters, and the period if it is unknown."""
        return len(self.active) + self.autonomous

    def period(self, u: Array) -> float:
        """Period T [s] of the orbit.

        Raises
        ------
        AnalysisError
            If nothing excites the system there with a period.
        """
        if self.autonomous:
            return float(u[-self.common])
        given = forcing_period(self.field, self.parameters(u), self.free)
        if given is None:
            raise AnalysisError(f"Nothing excites the system with a period at "
                                f"{self.parameter_name} = {u[-1]:.6g}; choose bounds that leave "
                                f"out this value.")
        return self.periods * given
