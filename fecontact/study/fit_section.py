"""Ranges of parameters that are fitted to measurements."""

import math
from dataclasses import dataclass
from numbers import Real
from typing import Literal

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Array


@dataclass(frozen=True)
class FitParameter:
    """Range in which a parameter is sought: ``{ low = 0.1, high = 1.0, scale = "log" }``.

    Parameters
    ----------
    low, high : float
        Bounds, in the unit of the parameter.
    start : float, optional
        First guess; by default the middle of the range on its scale.
    scale : 'linear' or 'log'
        Whether equal steps are equal differences or equal ratios; 'log' suits parameters of which
        the order of magnitude is sought.

    Raises
    ------
    InputError
        For bounds that are not finite or not in this order, a start outside of them, or bounds that
        are not above zero with scale = 'log'.
    """

    low: float
    high: float
    start: float | None = None
    scale: Literal["linear", "log"] = "linear"

    def __post_init__(self) -> None:
        for name in ("low", "high", "start"):
            value = getattr(self, name)
            if value is None and name == "start":
                continue
            if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
                raise InputError(f"FitParameter: {name} = {value!r} must be a finite number.")
            object.__setattr__(self, name, float(value))
        if self.scale not in ("linear", "log"):
            raise InputError(f"FitParameter: scale = {self.scale!r} must be 'linear' or 'log'.")
        if not self.low < self.high:
            raise InputError(f"FitParameter: high = {self.high:g} must lie above low = "
                             f"{self.low:g}.")
        if self.scale == "log" and not self.low > 0.0:
            raise InputError(f"FitParameter: low = {self.low:g} must be above zero for scale = "
                             f"'log'.")
        if self.start is not None and not self.low <= self.start <= self.high:
            raise InputError(f"FitParameter: start = {self.start:g} must lie from low = "
                             f"{self.low:g} to high = {self.high:g}.")

    def value(self, place: float) -> float:
        """Value at a place within the range, from 0 at ``low`` to 1 at ``high``."""
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** place)
        return float(self.low + place * (self.high - self.low))

    def place(self, value: float) -> float:
        """Place of a value within the range, the inverse of :meth:`value`."""
        if self.scale == "log":
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def slope(self, value: float) -> float:
        """Derivative of the value over the place, at a value."""
        if self.scale == "log":
            return value * math.log(self.high / self.low)
        return self.high - self.low

    @property
    def first(self) -> float:
        """Place of the first guess."""
        return 0.5 if self.start is None else self.place(self.start)


def places_of(parameters: tuple[FitParameter, ...], values: Array) -> Array:
    """Places (p,) of values (p,)."""
    return np.array([one.place(float(value))
                     for one, value in zip(parameters, values, strict=True)])


def values_of(parameters: tuple[FitParameter, ...], places: Array) -> Array:
    """Values (p,) at places (p,)."""
    return np.array([one.value(float(place))
                     for one, place in zip(parameters, places, strict=True)])
