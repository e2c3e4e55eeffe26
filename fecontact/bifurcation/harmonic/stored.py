"""Values that branches store of orbits by harmonic balance, computed on first use."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fecontact.bifurcation.harmonic import estimates
from fecontact.bifurcation.harmonic.estimates import OBSERVED, observed_of_orbits
from fecontact.bifurcation.harmonic.layout import Layout, all_coefficients
from fecontact.core.read_only import read_only
from fecontact.core.types import Array

ERRORS, _EXTREMES = ("truncation_error", "residual"), ("minimum", "maximum")


@dataclass(eq=False)
class StoredOrbits:
    """Values of K orbits by name, such as 'maximum', for all of them at once.

    Attributes
    ----------
    layout : Layout
        How states become unknowns.
    X : (K, 2 H + 1, b) array
        Coefficients.
    z : (K, N, c) array
        Internal variables at the samples.
    periods : (K,) array
        T [s].
    forces, mean, sizes : (K, N, b), (K, b, ...) and (K, b) or (b,) arrays
        Data from which errors are estimated; see :func:`estimates.neglected`.
    row : (d,) array, optional
        Displacement that is observed.
    known : dict
        Values by name that are there, a sequence of K each.
    orders : tuple of int, optional
        Harmonics of the orbits where some are left out.
    """

    layout: Layout
    X: Array
    z: Array
    periods: Array
    forces: Array
    mean: Array
    sizes: Array
    row: Array | None = None
    known: dict[str, Any] = field(default_factory=dict)
    orders: tuple[int, ...] | None = None

    def names(self) -> tuple[str, ...]:
        """Names of all values, in the order in which they are stored."""
        first = ("period", *ERRORS, *_EXTREMES, *(("memory",) if self.layout.memory else ()))
        more = () if self.row is None else OBSERVED
        return (*first, *(name for name in self.known if name not in first and name not in more),
                *more)

    def column(self, name: str) -> Any:
        """The values (K, ...) of a name."""
        if name not in self.known:
            self.known.update(self._made(name))
            self._release()
        return self.known[name]

    def _release(self) -> None:
        """Drop what no value is left to be made from."""
        if all(name in self.known for name in ERRORS):
            self.forces = self.mean = self.sizes = np.empty(0)
        if all(name in self.known for name in self.names()):
            self.X = self.z = np.empty(0)

    def _made(self, name: str) -> dict[str, Any]:
        layout, X = self.layout, self.X
        if name == "period":
            return {name: self.periods.tolist()}
        if name == "memory" and layout.memory:
            return {name: self.z}
        if name in _EXTREMES:
            whole = all_coefficients(layout, X, self.periods[:, None, None])
            return dict(zip(_EXTREMES, estimates.extremes(whole, self.z), strict=True))
        if name in ERRORS:
            found = estimates.neglected(X, self.forces, self.mean, self.periods, self.sizes,
                                        self.orders)
            return {each: values.tolist() for each, values in zip(ERRORS, found, strict=True)}
        if name in OBSERVED and self.row is not None:
            return observed_of_orbits(layout, X, self.periods, self.row)
        raise KeyError(name)


class StoredValues(Mapping[str, Any]):
    """The values of one of several orbits, to be read like a dict; copies and files hold a dict."""

    __slots__ = ("_index", "_orbits")

    def __init__(self, orbits: StoredOrbits, index: int) -> None:
        self._orbits, self._index = orbits, index

    def __getitem__(self, name: str) -> Any:
        return read_only(self._orbits.column(name)[self._index])

    def __iter__(self) -> Iterator[str]:
        return iter(self._orbits.names())

    def __len__(self) -> int:
        return len(self._orbits.names())

    def __contains__(self, name: object) -> bool:
        return name in self._orbits.names()

    def __or__(self, other: Mapping[str, Any]) -> dict[str, Any]:
        return {**self, **other} if isinstance(other, Mapping) else NotImplemented

    def __ror__(self, other: Mapping[str, Any]) -> dict[str, Any]:
        return {**other, **self} if isinstance(other, Mapping) else NotImplemented

    def __reduce__(self) -> tuple[Any, ...]:
        # Without what the values of the other orbits are made from.
        return dict, (dict(self),)

    def __repr__(self) -> str:
        return repr(dict(self))
