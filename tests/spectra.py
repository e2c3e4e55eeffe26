"""Spectra of real matrices compared without regard to the order of their values."""

import numpy as np


def spectral_distance(found, wanted):
    """Largest distance of a value of either spectrum from the nearest one of the other.

    Sorted lists would not do: real parts of a conjugate pair may differ by rounding, which then
    decides its order.
    """
    distances = np.abs(np.subtract.outer(found, wanted))
    assert distances.shape[0] == distances.shape[1]
    return max(distances.min(axis=0).max(), distances.min(axis=1).max())
