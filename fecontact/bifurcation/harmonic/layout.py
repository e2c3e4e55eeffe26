"""Conversion of states to unknowns of harmonic balance, and back."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.problem import enlarged
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.memory import Kept
from fecontact.bifurcation.harmonic.series import basis_at, differentiated
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.bifurcation.orbits.unknowns import FreeParameters
from fecontact.core.types import Array, Integers
from fecontact.system.elastic_sliders import slider_counts
from fecontact.system.fields.vector_field import VectorField


@dataclass(frozen=True)
class Layout:
    """Conversion of states x = [q, q', y, z] to unknowns.

    Attributes
    ----------
    states : int
        Their number d.
    displacements : int
        Number m of displacements q, which come first and whose rates are the states behind them;
        only q is unknown.
    memory : int
        Number c of internal variables z, the last states, which follow from q.
    nodes : int
        Number of contact nodes to which these belong.
    """

    states: int
    displacements: int = 0
    memory: int = 0
    nodes: int = 0

    @property
    def harmonic(self) -> int:
        """Number b of functions that are Fourier series: q and y."""
        return self.states - self.displacements - self.memory

    @cached_property
    def columns(self) -> Integers:
        """Indices (b,) of q and y among the states."""
        m = self.displacements
        return np.concatenate([np.arange(m), np.arange(2 * m, self.states - self.memory)])

    @cached_property
    def rows(self) -> slice:
        """Places (b,) of the equations of q and y among the rates."""
        return slice(self.displacements, self.states - self.memory)

    @cached_property
    def internal(self) -> slice:
        """Places (c,) of the internal variables z among the states."""
        return slice(self.states - self.memory, self.states)


def layout_of(field: VectorField) -> Layout:
    """Layout of the states of a field: displacements and memory of contact systems alone."""
    if not isinstance(field, ContactField):
        return Layout(field.dimension)
    modes, nodes = field.system().basis.modes, field.system().basis.contact_nodes
    memory = field.dimension - 2 * modes
    return Layout(field.dimension, modes, memory, nodes if memory else 0)


def kept_by(field: VectorField, layout: Layout, offsets: Array | None = None) -> Kept:
    """Deflections of elements that never slide; by default without any at zero displacement.

    Rows are those of springs with sliders. Bristles that never slide are no springs: their
    deflection stays about zero. No elements are followed one by one where other internal variables
    exist.
    """
    rows = np.zeros((layout.memory, layout.displacements))
    given = np.zeros(layout.memory) if offsets is None else np.array(offsets, dtype=float)
    blocks = elements = np.zeros(layout.nodes, dtype=np.int64)
    if layout.memory and isinstance(field, ContactField):
        system = field.system()
        arrays, counts, s = system.arrays, slider_counts(system), layout.memory // layout.nodes
        tangents = arrays.rows[:, ::2].swapaxes(0, 1)
        blocks = np.where(counts > 0, len(tangents), 0)
        if np.array_equal(len(tangents) * counts, arrays.memory):
            elements = counts
        for nodes, share, law in system.law_groups("friction"):
            if law.memory and law.sliders(share) is not None:
                for node in range(layout.nodes)[nodes]:
                    for k in range(law.memory * len(tangents)):
                        rows[node * s + k] = tangents[k % len(tangents)][node]
    return Kept(rows, given, blocks, elements)


def orbit_weights(sizes: Array, others: Array, functions: int) -> Array:
    """Weights (..., n) of coefficients and further unknowns for scales (..., b) and (..., e).

    The sum of weighted squares of coefficients of so many functions is the mean of scaled states.
    """
    over = np.full((functions, 1), 0.5)
    over[0] = 1.0
    coefficients = over * sizes[..., None, :] ** -2.0
    return np.concatenate([coefficients.reshape(*sizes.shape[:-1], -1), others**-2.0], axis=-1)


def filled(layout: Layout, X: Array, z: Array, period: float, values: Array) -> Array:
    """States (N, d) from coefficients, internal variables (N, c) and the basis (N, 2 H + 1)."""
    m, end = layout.displacements, layout.states - layout.memory
    moved = np.asarray(values @ X)
    if end == layout.harmonic == layout.states:
        return moved
    x = np.empty((len(values), layout.states))
    x[:, :m], x[:, 2 * m : end], x[:, end:] = moved[:, :m], moved[:, m:], z
    x[:, m : 2 * m] = values @ (differentiated(X[:, :m]) / period)
    return x


def all_coefficients(layout: Layout, X: Array, period: float | Array) -> Array:
    """Coefficients (..., 2 H + 1, d - c) of q, q' and y from those of q and y."""
    m = layout.displacements
    q, y = X[..., :m], X[..., m:]
    return np.concatenate([q, differentiated(q) / period, y], axis=-1) if m else X


class SeriesUnknowns(FreeParameters):
    """Coefficients (L, b) of series first among the unknowns, those of an orbit or a torus.

    Scales begin with those of the d states; ``limits`` (d,) bound their growth, None keeps them.
    """

    reference: Array
    scales: Array
    layout: Layout
    limits: Array | None = None

    @property
    def size(self) -> int:
        """Number L b of coefficients."""
        return self.reference.size

    def coefficients(self, u: Array) -> Array:
        """Coefficients (L, b) of q and y."""
        return u[: self.size].reshape(self.reference.shape)

    @property
    def sizes(self) -> Array:
        """Scales (b,) of q and y."""
        return self.scales[self.layout.columns]

    @property
    def common_scales(self) -> Array:
        """Scales of the unknowns behind the coefficients."""
        raise NotImplementedError

    @cached_property
    def _weights(self) -> Array:
        return orbit_weights(self.sizes, self.common_scales, len(self.reference))

    def weights(self) -> Array:
        """Weights of the inner product: mean of scaled q and y, and further unknowns."""
        return self._weights

    def phase_row_of(self, rate: Array) -> Array:
        """Row (L b,) of the phase condition <X, rate> = 0 with a rate (L, b) of the reference."""
        row = rate * self.sizes**-2.0
        return np.asarray((row / (np.abs(row).max() or 1.0)).reshape(-1))

    def _grown(self, u: Array) -> Array:
        """Scales of all unknowns, enlarged with the motion."""
        if self.limits is None:
            return self.scales
        layout, X = self.layout, self.coefficients(u)
        sizes = self.scales[: layout.states].copy()
        sizes[layout.columns] = np.sqrt(np.einsum("ki,ki->i", X[1:], X[1:]))
        return enlarged(self.scales, sizes, self.limits)


def around(samples: Array, times: Array) -> Array:
    """Values (..., k, c) at times tau (k,), linear between periodic samples (..., N, c)."""
    N = samples.shape[-2]
    place = np.mod(times, 1.0) * N
    first = place.astype(int) % N
    part = (place - np.floor(place))[:, None]
    return np.asarray((1.0 - part) * samples[..., first, :]
                      + part * samples[..., (first + 1) % N, :])


def layout_from(attributes: Mapping[str, Any]) -> Layout:
    """Layout of the states from the attributes of a branch."""
    return Layout(len(attributes["state_names"]), int(attributes["displacements"]),
                  int(attributes["memory"]), int(attributes["memory_nodes"]))


def balanced(
    u: Array, values: Mapping[str, Any], attributes: Mapping[str, Any], samples: int
) -> PeriodicMotion:
    """Sample an orbit by harmonic balance over one period, both ends included.

    Internal variables are linear between their samples. ``values`` are those stored of the point,
    ``attributes`` those of its branch.
    """
    layout, period = layout_from(attributes), float(values["period"])
    phases = np.linspace(0.0, 1.0, samples)
    count = 2 * attributes["method"].highest + 1
    X = u[: count * layout.harmonic].reshape(-1, layout.harmonic)
    z = around(np.asarray(values.get("memory", np.zeros((1, 0)))), phases)
    states = filled(layout, X, z, period, basis_at(phases, len(X) // 2))
    return PeriodicMotion(phases * period, states, period)
