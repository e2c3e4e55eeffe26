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
