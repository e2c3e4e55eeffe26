"""Options of harmonic balance with two base frequencies, and the second excitation."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.checks import as_texts, require_flags
from fecontact.core.errors import InputError, require_positive
from fecontact.core.resources.memory import require_memory

# Samples per harmonic in each direction, and at least.
_PER_HARMONIC, _LEAST, MOST = 4, 16, 200


@dataclass(frozen=True)
class TorusBalance:
    """Harmonic balance of quasi-periodic motions: Fourier series of two angles.

    The motion is x(t) = X(2 pi f1 t, 2 pi f2 t) with the harmonics k1 f1 + k2 f2, |k1| <= H1,
    0 <= k2 <= H2. Forces are evaluated on a grid of both angles (alternating frequency and time),
    so that all smooth laws work unchanged; elastic Coulomb elements are followed along motions.
    Displacements of contact systems, other internal variables of friction and the states of other
    fields are unknown: (2 H1 + 1) (2 H2 + 1) numbers each.

    Parameters
    ----------
    harmonics : int or (int, int)
        H1 and H2, at least 1.
    samples : int or (int, int), optional
        N1 and N2, at least 2 H + 2. By default 4 H + 2, at least 16, exact for products of three
        harmonics. Kinks of laws need more: see 'sampling_error' of the points.
    stability : bool
        Whether to compute multipliers.
    tolerance : float
        Truncation error of the torus, relative to its size, above which a branch ends, as where the
        torus breaks up or locks.

    Raises
    ------
    InputError
        If these cannot be used.
    """

    harmonics: int | tuple[int, int] = 7
    samples: int | tuple[int, int] | None = None
    stability: bool = True
    tolerance: float = 0.05

    def __post_init__(self) -> None:
        pair = self._pair("harmonics", self.harmonics, (1, 1))
        object.__setattr__(self, "harmonics", pair)
        given: object = self.samples
        if given is None:
            given = [max(_LEAST, _PER_HARMONIC * H + 2) for H in pair]
        found = self._pair("samples", given, (2 * pair[0] + 2, 2 * pair[1] + 2))
        object.__setattr__(self, "samples", found)
        require_flags("TorusBalance", stability=self.stability)
        require_positive("TorusBalance", tolerance=self.tolerance)
        unknowns = (2 * pair[0] + 1) * (2 * pair[1] + 1)
        require_memory("TorusBalance: harmonics", unknowns, 64.0 * unknowns)

    def _pair(self, name: str, given: object, least: tuple[int, int]) -> tuple[int, int]:
        found: list[Any] = (list(given) if isinstance(given, Sequence | np.ndarray)
                            else [given, given])
        fine = not isinstance(given, str) and len(found) == 2 and all(
            isinstance(one, int | np.integer) and not isinstance(one, bool)
            and low <= one <= 16 * MOST for one, low in zip(found, least, strict=True))
        if not fine or (name == "harmonics" and max(found) > MOST):
            raise InputError(f"TorusBalance: {name} = {given!r} must be one or two whole numbers, "
                             f"from {least[0]} and {least[1]} on.")
        return int(found[0]), int(found[1])

    @property
    def orders(self) -> tuple[int, int]:
        """H1 and H2."""
        assert isinstance(self.harmonics, tuple)
        return self.harmonics

    @property
    def counts(self) -> tuple[int, int]:
        """N1 and N2."""
        assert isinstance(self.samples, tuple)
        return self.samples


@dataclass(frozen=True)
class SecondExcitation:
    """The second of two excitations, of any frequency, in a field of your own.

    The field's period is that of the first one. The second one enters as a function of
    2 pi f2 t + phase.

    Parameters
    ----------
    phase : str
        Name of the field's parameter that is this phase [rad].
    frequency_hz : float or str
        f2 [Hz], or the name of the field's parameter that it is.

    Raises
    ------
    InputError
        If these cannot be used.
    """

    phase: str
    frequency_hz: float | str

    def __post_init__(self) -> None:
        as_texts([self.phase], "SecondExcitation: phase")
        if not isinstance(self.frequency_hz, str):
            require_positive("SecondExcitation", frequency_hz=self.frequency_hz)
