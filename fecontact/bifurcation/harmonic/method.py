"""Options of harmonic balance."""

from dataclasses import dataclass

import numpy as np

from fecontact.core.errors import InputError, require_positive
from fecontact.core.resources.memory import require_memory

_STABILITY = ("transitions", "Koopman-Hill", None)
# Samples per harmonic, and at least.
_PER_HARMONIC, _LEAST = 8, 32
# Largest number of harmonics or samples, and of samples that are taken for a tolerance.
MOST, MOST_SAMPLED = 100_000, 4096
# Largest error from few samples by default.
_SAMPLING = 5e-4


@dataclass(frozen=True)
class HarmonicBalance:
    """Truncated Fourier series, their forces by alternating frequency and time, for any field.

    Suited to smooth vibration with few harmonics, and to systems with many modes: of contact
    systems only displacements are unknown, 2 H + 1 numbers a mode, and internal variables of
    friction at the samples, which are eliminated node by node. Points store 'truncation_error'
    (harmonics that are neglected, relative to the orbit) and 'residual' (of the equations in time,
    relative to the rates).

    Parameters
    ----------
    harmonics : int
        H, at least 1: harmonics of the period of the orbit.
    samples : int, optional
        N, at least 2 H + 2, samples a period. By default 8 H, at least 32, and on branches of
        forced orbits as many more as ``sampling_tolerance`` needs. Kinks of laws need many;
        products of three harmonics are exact above 4 H.
    tolerance : float, optional
        Largest truncation error allowed on a branch: it is followed again with more harmonics, by
        half each time, until it is met, up to ``most_harmonics``.
    most_harmonics : int
        Limit for that.
    sampling_tolerance : float, optional
        Largest error from few samples allowed on a branch, relative to the orbit: it is followed
        again with twice the samples until the estimate is met, 'sampling_error' of the branch. By
        default 5e-4 for forced orbits if ``samples`` are not given, up to 4096 samples; if they
        are, ``branch.message`` warns of an error above 5e-3.
    stability : 'transitions', 'Koopman-Hill' or None
        How Floquet multipliers are found: from the linearised equations along the orbit, or by the
        projection of Bayer and Leine with 2 H harmonics, which suits smooth systems of few states.
        None for none: folds alone are found then, but points take a fraction of the time. Branches
        whose folds show that multipliers are wrong have none either, and say so.

    Raises
    ------
    InputError
        If these cannot be used.
    """

    harmonics: int = 9
    samples: int | None = None
    tolerance: float | None = None
    most_harmonics: int = 100
    stability: str | None = "transitions"
    sampling_tolerance: float | None = None

    def __post_init__(self) -> None:
        for name in ("harmonics", "most_harmonics"):
            value = getattr(self, name)
            if not (isinstance(value, int | np.integer) and 1 <= value <= MOST):
                raise InputError(f"HarmonicBalance: {name} = {value!r} must be a whole number from "
                                 f"1 to {MOST}.")
        least = 2 * self.harmonics + 2
        if self.samples is not None and not (isinstance(self.samples, int | np.integer)
                                             and least <= self.samples <= MOST):
            raise InputError(f"HarmonicBalance: samples = {self.samples!r} must be a whole number "
                             f"from {least}, twice the harmonics and two, to {MOST}.")
        # Cosines and sines of all harmonics at all samples.
        require_memory("HarmonicBalance: harmonics", self.harmonics, 16.0 * self.count)
        for name in ("tolerance", "sampling_tolerance"):
            if getattr(self, name) is not None:
                require_positive("HarmonicBalance", **{name: getattr(self, name)})
        if self.stability not in _STABILITY:
            raise InputError(f"HarmonicBalance: stability = {self.stability!r} must be "
                             f"'transitions' or 'Koopman-Hill', or None.")

    @property
    def refines(self) -> bool:
        """Whether branches may be followed again."""
        return self.tolerance is not None or self.sampling_tolerance is not None

    @property
    def sampling(self) -> float | None:
        """Largest error from few samples on a branch of forced orbits; None where any is taken."""
        if self.sampling_tolerance is None and self.samples is None:
            return _SAMPLING
        return self.sampling_tolerance

    @property
    def count(self) -> int:
        """Number N of samples."""
        return int(self.samples or max(_LEAST, _PER_HARMONIC * self.harmonics))
