"""Options of harmonic balance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.bifurcation.harmonic.engine_order import EngineOrder
from fecontact.core.checks import require_kind
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
    harmonics : int or sequence of int
        H, at least 1: harmonics 0 to H of the period of the orbit, 0 being the mean. A list such as
        ``[1, 3, 5]`` keeps these alone, the others are zero and no unknowns; H is the largest. The
        truncation error counts what they leave out. Under constant loads 0 is needed.
    samples : int, optional
        N, at least 2 H + 2, samples a period. By default 8 H, at least 32, and on branches of
        forced orbits as many more as ``sampling_tolerance`` needs. Kinks of laws need many;
        products of three harmonics are exact above 4 H.
    tolerance : float, optional
        Largest truncation error allowed on a branch: it is followed again with more harmonics, by
        half each time, until it is met, up to ``most_harmonics``. Not with a list of harmonics.
    most_harmonics : int
        Limit for that.
    sampling_tolerance : float, optional
        Largest error from few samples allowed on a branch, relative to the orbit: it is followed
        again with twice the samples until the estimate is met, 'sampling_error' of the branch. By
        default 5e-4 for forced orbits if ``samples`` are not given, up to 4096 samples; if they
        are, ``branch.message`` warns of an error above 5e-3.
    stability : 'transitions', 'Koopman-Hill' or None
        Computation of Floquet multipliers: from the linearised equations along the orbit, or by the
        projection of Bayer and Leine with 2 H harmonics, for smooth systems of few states. None
        leaves multipliers out: points take a fraction of the time, and of special points only folds
        are found. If the folds show that multipliers are wrong, ``branch.message`` says so.
    repeats : EngineOrder, optional
        The wave in which the sectors of a wheel move as one of them does, at other times. With
        ``stability = None`` alone.

    Raises
    ------
    InputError
        If these cannot be used.
    """

    harmonics: int | Sequence[int] = 9
    samples: int | None = None
    tolerance: float | None = None
    most_harmonics: int = 100
    stability: str | None = "transitions"
    sampling_tolerance: float | None = None
    repeats: EngineOrder | None = None

    def __post_init__(self) -> None:
        if isinstance(self.harmonics, Sequence | np.ndarray) and not isinstance(
                self.harmonics, str):
            object.__setattr__(self, "harmonics", self._checked_list(list(self.harmonics)))
        else:
            _require_count("harmonics", self.harmonics)
        _require_count("most_harmonics", self.most_harmonics)
        least = 2 * self.highest + 2
        if self.samples is not None and not (isinstance(self.samples, int | np.integer)
                                             and least <= self.samples <= MOST):
            raise InputError(f"HarmonicBalance: samples = {self.samples!r} must be a whole number "
                             f"from {least}, twice the harmonics and two, to {MOST}.")
        # Cosines and sines of all harmonics at all samples.
        require_memory("HarmonicBalance: harmonics", self.highest, 16.0 * self.count)
        for name in ("tolerance", "sampling_tolerance"):
            if getattr(self, name) is not None:
                require_positive("HarmonicBalance", **{name: getattr(self, name)})
        if self.stability not in _STABILITY:
            raise InputError(f"HarmonicBalance: stability = {self.stability!r} must be "
                             f"'transitions' or 'Koopman-Hill', or None.")
        require_kind("HarmonicBalance", (EngineOrder, type(None)), repeats=self.repeats)
        if self.repeats is not None:
            require_wave(self)

    def _checked_list(self, given: list[int]) -> tuple[int, ...]:
        whole = all(isinstance(k, int | np.integer) and not isinstance(k, bool)
                    and 0 <= k <= MOST for k in given)
        if not whole or len(set(given)) != len(given) or not any(given):
            raise InputError(f"HarmonicBalance: harmonics = {given!r} must be different whole "
                             f"numbers from 0 to {MOST}, at least one of them above 0.")
        if self.tolerance is not None:
            raise InputError(f"HarmonicBalance: tolerance = {self.tolerance:g} adds harmonics to "
                             f"all up to a number; with harmonics = {given!r} leave it out, or "
                             f"give harmonics = {max(given)}.")
        return tuple(sorted(int(k) for k in given))

    @property
    def highest(self) -> int:
        """The largest harmonic H."""
        return max(self.harmonics) if isinstance(self.harmonics, Sequence) else int(self.harmonics)

    @property
    def orders(self) -> tuple[int, ...] | None:
        """Harmonics of the series where some of 0 to H are left out, else None."""
        if not isinstance(self.harmonics, Sequence) or len(self.harmonics) == self.highest + 1:
            return None
        return tuple(self.harmonics)

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
        return int(self.samples or max(_LEAST, _PER_HARMONIC * self.highest))


def require_wave(method: HarmonicBalance) -> None:
    """Raise InputError for options that do not suit one sector of a wheel."""
    if method.stability is not None:
        raise InputError("HarmonicBalance: with repeats there are no multipliers of the whole "
                         "wheel; give stability = None.")


def _require_count(name: str, value: object) -> None:
    if not (isinstance(value, int | np.integer) and 1 <= value <= MOST):
        raise InputError(f"HarmonicBalance: {name} = {value!r} must be a whole number from 1 to "
                         f"{MOST}.")
