"""Sampled motions of orbits by harmonic balance."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fecontact.bifurcation.harmonic.balance import Layout, series_states
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.core.types import Array


def layout_from(attributes: Mapping[str, Any]) -> Layout:
    """Layout of the states from the attributes of a branch."""
    return Layout(len(attributes["state_names"]), int(attributes["displacements"]),
                  int(attributes["memory"]), int(attributes["memory_nodes"]))


def parts(u: Array, attributes: Mapping[str, Any]) -> tuple[Array, Array]:
    """Coefficients (2 H + 1, b) and internal variables (N, c) of the unknowns of a branch."""
    layout = layout_from(attributes)
    size = (2 * int(attributes["harmonics"]) + 1) * layout.harmonic
    count = int(attributes["samples"]) * layout.memory
    return (u[:size].reshape(-1, layout.harmonic),
            u[size : size + count].reshape(int(attributes["samples"]), layout.memory))


def balanced(
    u: Array, attributes: Mapping[str, Any], period: float, samples: int
) -> PeriodicMotion:
    """Sample an orbit by harmonic balance over one period, both ends included."""
    phases = np.linspace(0.0, 1.0, samples)
    X, z = parts(u, attributes)
    states = series_states(layout_from(attributes), X, z, period, phases)
    return PeriodicMotion(phases * period, states, period)
