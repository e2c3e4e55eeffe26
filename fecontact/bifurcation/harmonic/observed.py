"""Observed values of orbits by harmonic balance: range and harmonics of one displacement."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fecontact.bifurcation.harmonic.estimates import peaks
from fecontact.bifurcation.harmonic.layout import Layout, layout_from
from fecontact.bifurcation.harmonic.series import complex_harmonics, differentiated, uniform_basis
from fecontact.core.types import Array

# Samples a period of what is observed, and harmonics of it that are stored.
OBSERVED_SAMPLES, OBSERVED_HARMONICS = 512, 15
OBSERVED = ("observed_minimum", "observed_maximum", "observed_amplitude", "observed_harmonics")


def observed_values(
    layout: Layout, X: Array, period: float, row: Array
) -> dict[str, Any]:
    """Values to store of an orbit with the coefficients X (2 H + 1, b) of q and y.

    'observed_minimum', 'observed_maximum', half their difference as 'observed_amplitude', and
    'observed_harmonics' (16,), complex.
    """
    found = observed_of_orbits(layout, X[None], np.array([period]), row)
    return {name: values[0] for name, values in found.items()}


def observed_of_orbits(
    layout: Layout, X: Array, periods: Array, row: Array
) -> dict[str, Any]:
    """Values of K orbits with coefficients X (K, 2 H + 1, b) and periods (K,), K by each name."""
    K, H, m = len(X), X.shape[1] // 2, layout.displacements
    observes = X[..., :m] @ row[:m] + X[..., m:] @ row[2 * m : m + layout.harmonic]
    if m and row[m : 2 * m].any():
        observes = observes + differentiated(X[..., :m]) @ row[m : 2 * m] / periods[:, None]
    low, high = peaks(observes @ uniform_basis(OBSERVED_SAMPLES, H).T)
    harmonics = np.zeros((K, max(H, OBSERVED_HARMONICS) + 1), dtype=complex)
    harmonics[:, : H + 1] = complex_harmonics(observes.T).T
    return dict(zip(OBSERVED, (low.tolist(), high.tolist(), ((high - low) / 2.0).tolist(),
                               harmonics[:, : OBSERVED_HARMONICS + 1]), strict=True))


def observed_of_series(points: Sequence[Any], row: Array) -> dict[str, Any]:
    """Values (N, ...) by name of orbits of one branch by harmonic balance."""
    known = points[0].branch.attributes
    layout, H = layout_from(known), known["method"].highest
    b = layout.harmonic
    X = np.array([point.u[: (2 * H + 1) * b] for point in points]).reshape(-1, 2 * H + 1, b)
    periods = np.array([float(point.values["period"]) for point in points])
    return observed_of_orbits(layout, X, periods, row)
