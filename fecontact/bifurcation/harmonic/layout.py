"""Conversion of states to unknowns of harmonic balance, and back."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.problem import enlarged
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.series import basis_at, differentiated
from fecontact.bifurcation.orbits.motions import PeriodicMotion
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
    def rows(self) -> Integers:
        """Indices (b,) of the equations of q and y among the rates."""
        m = self.displacements
        return np.arange(m, self.states - self.memory)


def layout_of(field: VectorField) -> Layout:
    """Layout of the states of a field: displacements and memory of contact systems alone."""
    if not isinstance(field, ContactField):
        return Layout(field.dimension)
    modes, nodes = field.system().basis.modes, field.system().basis.contact_nodes
    memory = field.dimension - 2 * modes
    return Layout(field.dimension, modes, memory, nodes if memory else 0)


def element_rows(field: VectorField, layout: Layout) -> Array:
    """Rows (c, m) of the displacements that deflect springs with sliders; zero for other variables.

    Bristles that never slide are no springs: their deflection stays about zero.
    """
    rows = np.zeros((layout.memory, layout.displacements))
    if not (layout.memory and isinstance(field, ContactField)):
        return rows
    system = field.system()
    arrays, s = system.arrays, layout.memory // layout.nodes
    tangents = arrays.rows[:, ::2].swapaxes(0, 1)
    for nodes, share, law in system.law_groups("friction"):
        if law.memory and law.sliders(share) is not None:
            for node in range(layout.nodes)[nodes]:
                for k in range(law.memory * len(tangents)):
                    rows[node * s + k] = tangents[k % len(tangents)][node]
    return rows


def memory_blocks(field: VectorField, layout: Layout) -> Integers:
    """Numbers (n,) of internal variables of each node that act on each other; 0 for all of them."""
    if not (layout.memory and isinstance(field, ContactField)):
        return np.zeros(layout.nodes, dtype=np.int64)
    system = field.system()
    return np.where(slider_counts(system) > 0, system.basis.dimension - 1, 0)


def element_counts(field: VectorField, layout: Layout) -> Integers:
    """Numbers (n,) of elements of the nodes; zero for all where other internal variables exist."""
    if not (layout.memory and isinstance(field, ContactField)):
        return np.zeros(layout.nodes, dtype=np.int64)
    system = field.system()
    counts = slider_counts(system)
    tangents = system.basis.dimension - 1
    alone = np.array_equal(tangents * counts, system.arrays.memory)
    return counts if alone else np.zeros_like(counts)


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


def grown(layout: Layout, scales: Array, X: Array, limits: Array | None) -> Array:
    """Scales enlarged with coefficients X (L, b) of an orbit or torus, up to limits if any."""
    if limits is None:
        return scales
    sizes = scales[: layout.states].copy()
    sizes[layout.columns] = np.sqrt(np.einsum("ki,ki->i", X[1:], X[1:]))
    return enlarged(scales, sizes, limits)


def series_states(layout: Layout, X: Array, z: Array, period: float, times: Array) -> Array:
    """States (k, d) at times tau (k,); internal variables linear between their samples."""
    return filled(layout, X, around(z, times), period, basis_at(times, len(X) // 2))


def around(samples: Array, times: Array) -> Array:
    """Values (k, c) at times tau of a periodic function, linear between its samples (N, c)."""
    place = np.mod(times, 1.0) * len(samples)
    first = place.astype(int) % len(samples)
    part = (place - np.floor(place))[:, None]
    return np.asarray((1.0 - part) * samples[first] + part * samples[(first + 1) % len(samples)])


def layout_from(attributes: Mapping[str, Any]) -> Layout:
    """Layout of the states from the attributes of a branch."""
    return Layout(len(attributes["state_names"]), int(attributes["displacements"]),
                  int(attributes["memory"]), int(attributes["memory_nodes"]))


def balanced(
    u: Array, values: Mapping[str, Any], attributes: Mapping[str, Any], samples: int
) -> PeriodicMotion:
    """Sample an orbit by harmonic balance over one period, both ends included.

    ``values`` are those stored of the point, ``attributes`` those of its branch.
    """
    layout, period = layout_from(attributes), float(values["period"])
    phases = np.linspace(0.0, 1.0, samples)
    X = u[: (2 * int(attributes["harmonics"]) + 1) * layout.harmonic].reshape(-1, layout.harmonic)
    z = np.asarray(values.get("memory", np.zeros((1, 0))))
    return PeriodicMotion(phases * period, series_states(layout, X, z, period, phases), period)
