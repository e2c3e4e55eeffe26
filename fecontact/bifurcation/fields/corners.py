"""Arrays of contact systems between the corners of a box of parameter values."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.types import Array
from fecontact.system.nodes import SystemArrays

_AFFINE_ERROR = 1e-12


@dataclass(frozen=True, eq=False)
class AffineArrays:
    """Arrays over one parameter p, the others fixed: those that vary are views of one vector.

    Attributes
    ----------
    arrays : SystemArrays
    flat, base, slope : (k,) arrays
        Arrays that vary; ``flat[:] = base + p * slope`` sets it.
    low, high : float
        Range of p.
    varying : frozenset of str
        Names of the arrays that vary.
    """

    arrays: SystemArrays
    flat: Array
    base: Array
    slope: Array
    low: float
    high: float
    varying: frozenset[str]


class NotAffineError(Exception):
    """Arrays are not affine in a parameter."""


class Corners:
    """Arrays at the corners of a box of parameter values, and between them.

    ``corners`` are those at the corners between low and high (k,), the first parameter changing
    fastest.
    """

    def __init__(self, low: Array, high: Array, corners: list[SystemArrays]) -> None:
        self.low, self.high = low, high
        self._plain = first = corners[0]
        # Of each parameter, with the values at which they hold.
        self._slopes: dict[int, tuple[bytes, SystemArrays]] = {}
        parts: list[Array] = []
        self._limits = list(zip(low.tolist(), high.tolist(), strict=True))
        self._places: list[tuple[int, slice, tuple[int, ...]]] = []
        start = 0
        for number, given in enumerate(zip(*corners, strict=True)):
            for one in given:
                if one is not given[0]:
                    break
            else:
                continue
            values = [np.asarray(one) for one in given]
            if any(value.shape != values[0].shape for value in values):
                raise NotAffineError
            if not any((value != values[0]).any() for value in values[1:]):
                continue
            if values[0].dtype.kind != "f":
                raise NotAffineError
            size = values[0].size
            parts.append(np.array([value.reshape(-1) for value in values]))
            self._places.append((number, slice(start, start + size), values[0].shape))
            start += size
        self.varying = frozenset(first._fields[number] for number, _, _ in self._places)
        # All varying arrays in one matrix: one product interpolates them.
        self._flat = np.concatenate(parts or [np.empty((len(corners), 0))], axis=1)

    def hold(self, values: Array) -> bool:
        """Whether values (k,) lie in the box."""
        for (low, high), value in zip(self._limits, values.tolist(), strict=True):
            if not low <= value <= high:
                return False
        return True

    def along(self, values: Array, index: int) -> AffineArrays:
        """Arrays of their own over one value, the others fixed."""
        ends = [values.copy(), values.copy()]
        ends[0][index], ends[1][index] = self.low[index], self.high[index]
        low, high = (np.array(self._weights(end)) @ self._flat for end in ends)
        slope = (high - low) / (self.high[index] - self.low[index])
        flat = low.copy()
        return AffineArrays(self._with(flat, list(self._plain)), flat,
                            low - self.low[index] * slope, slope, float(self.low[index]),
                            float(self.high[index]), self.varying)

    def at(self, values: Array) -> SystemArrays:
        """Arrays for values (k,)."""
        return self._with(np.array(self._weights(values)) @ self._flat, list(self._plain))

    def _weights(self, values: Array) -> list[float]:
        weights = [1.0]
        for (low, high), value in zip(self._limits, values.tolist(), strict=True):
            x = (value - low) / (high - low)
            weights = [w * (1.0 - x) for w in weights] + [w * x for w in weights]
        return weights

    def _with(self, flat: Array, arrays: list[Any]) -> SystemArrays:
        for number, place, shape in self._places:
            arrays[number] = flat[place].reshape(shape)
        return SystemArrays(*arrays)

    def slopes(self, values: Array, index: int) -> SystemArrays:
        """Derivatives of the arrays to one value."""
        place = values.copy()
        place[index] = 0.0
        key = place.tobytes()
        if index not in self._slopes or self._slopes[index][0] != key:
            weights = [1.0]
            for each, ((low, high), value) in enumerate(zip(self._limits, values.tolist(),
                                                            strict=True)):
                x, rate = (value - low) / (high - low), 1.0 / (high - low)
                below, above = (-rate, rate) if each == index else (1.0 - x, x)
                weights = [w * below for w in weights] + [w * above for w in weights]
            self._slopes[index] = key, self._with(np.array(weights) @ self._flat,
                                                  self._still.copy())
        return self._slopes[index][1]

    @cached_property
    def _still(self) -> list[Any]:
        """Slopes of what does not vary, zero; addresses of laws and the like unchanged."""
        return [np.zeros_like(array) if isinstance(array, np.ndarray) and array.dtype.kind == "f"
                else array for array in self._plain]

    def agrees(self, arrays: SystemArrays, values: Array) -> bool:
        """Whether the arrays for values (k,) are these."""
        mine = self.at(values)
        for one, other in zip(arrays, mine, strict=True):
            if one is other:
                continue
            expected, found = np.asarray(one), np.asarray(other)
            if expected.shape != found.shape:
                return False
            scale = np.abs(expected).max(initial=0.0)
            if np.abs(expected - found).max(initial=0.0) > _AFFINE_ERROR * scale:
                return False
        return True
