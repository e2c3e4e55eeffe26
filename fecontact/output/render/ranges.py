"""Ranges of motions over time: largest displacements and stresses, and the box around bodies."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.core.magnitude import magnitude
from fecontact.core.types import Array
from fecontact.fem.von_mises import von_mises_of
from fecontact.output.plots.style import stress_limit

_BLOCK = 2**18  # numbers of a field over nodes and times that stay in cache


@dataclass(frozen=True, eq=False)
class Ranges:
    """Largest values of motions ``sum_m s_m q_m`` over bodies and time.

    ``coordinates`` (N, m + p) are those of the modes and of products behind them, see
    :attr:`~fecontact.reduction.ModeShapes.stress_terms`, which are ``stress`` (P, c, m + p); shapes
    are (P, d, m). The motion ``drift`` (d - 1, m) along the ground is not magnified.
    """

    nodes: Array
    shapes: Array
    stress: Array
    coordinates: Array
    drift: Array

    @property
    def modal(self) -> Array:
        """Modal coordinates (N, m)."""
        return self.coordinates[:, : self.shapes.shape[2]]

    @cached_property
    def largest_displacement(self) -> float:
        """[m]."""
        return float(_largest(self.shapes, self.modal, _length).max())

    @cached_property
    def largest_magnified(self) -> float:
        """Largest displacement without the drift [m]."""
        if not self.drift.any():
            return self.largest_displacement
        return float(_largest(self._drawn(1.0, 0.0), self.modal, _length).max())

    @cached_property
    def _stresses(self) -> Array:
        """Largest von Mises stress (P,) of each node over time."""
        return _largest(self.stress, self.coordinates, von_mises_of)

    @property
    def largest_stress(self) -> float:
        """Largest von Mises stress [Pa]."""
        return float(self._stresses.max())

    @property
    def peak_node(self) -> int:
        """Mesh node of the largest von Mises stress."""
        return int(self._stresses.argmax())

    @property
    def stress_range(self) -> float:
        """End of the colour range [Pa]: singular corners do not darken all others."""
        return stress_limit(self._stresses)

    def box(self, scale: float) -> Array:
        """Smallest and largest coordinates (2, d) of the bodies at rest and magnified [m]."""
        shapes, low, high = self._drawn(scale, 1.0), self.nodes.copy(), self.nodes.copy()
        for nodes, values in _blocks(shapes, self.modal):
            for ends, times in ((low, values.argmin(axis=2)), (high, values.argmax(axis=2))):
                ends[nodes] += np.einsum("pcm,pcm->pc", shapes[nodes], self.modal[times.T])
        places = [self.nodes, low, high]
        return np.stack([np.min(places, axis=(0, 1)), np.max(places, axis=(0, 1))])

    def _drawn(self, scale: float, drift: float) -> Array:
        """Shapes, magnified, whose drift along the ground has another factor."""
        shapes = scale * self.shapes
        shapes[:, :-1] += (drift - scale) * self.drift
        return shapes


def _blocks(field: Array, q: Array) -> Iterator[tuple[slice, Any]]:
    """Sums of a field (P, c, m) with coordinates q (N, m), (c, k, N) for some nodes after others.

    They are in single precision and relative to a common size: good to find times.
    """
    nodes, kinds, modes = field.shape
    used = np.abs(q).max(axis=0, initial=0.0)
    parts = field * used
    unit = float(np.abs(parts).max(initial=0.0)) or 1.0
    rows = np.ascontiguousarray((parts / unit).transpose(1, 0, 2), dtype=np.float32)
    columns = (q / np.where(used > 0.0, used, 1.0)).T.astype(np.float32)
    count = max(1, _BLOCK // (kinds * len(q)))
    for first in range(0, nodes, count):
        chosen = slice(first, first + count)
        yield chosen, (rows[:, chosen].reshape(-1, modes) @ columns).reshape(kinds, -1, len(q))


def _largest(field: Array, q: Array, size: Callable[[Array], Array]) -> Array:
    """Largest size (P,) over time of the sums of a field; ``size`` is of values (c, ...)."""
    at = np.concatenate([size(values).argmax(axis=1) for _, values in _blocks(field, q)])
    found = np.einsum("pcm,pm->cp", field, q[at])
    unit = magnitude(found)
    return size(found / unit) * unit


def _length(values: Array) -> Array:
    return np.sqrt(np.einsum("c...,c...->...", values, values))
