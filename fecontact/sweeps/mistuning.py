"""Statistics of mistuned wheels: amplification over random deviations of the blades."""

from collections import deque
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.analysis.mistuning import Excitation, whitehead_bound
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_positive
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised, span
from fecontact.reduction.cyclic.cyclic_basis import CyclicBasis
from fecontact.reduction.cyclic.whole_wheel import WholeWheel
from fecontact.sweeps.executors import opened
from fecontact.sweeps.statistics import Estimate, statistics

# Samples of one call of a worker.
_BATCH = 25


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class MistuningSweep(Summarised):
    """Amplifications of wheels with random deviations, made by :func:`mistuning_sweep`.

    Attributes
    ----------
    deviations : (n, N) array
        delta_s of each wheel.
    amplifications : (n,) array
        Largest displacement of any sector over that of the tuned wheel.
    tuned : float
        The latter [m/N].
    """

    deviations: Array
    amplifications: Array
    tuned: float

    @property
    def bound(self) -> float:
        """Whitehead's bound of the amplification."""
        return whitehead_bound(self.deviations.shape[1])

    def statistics(self) -> dict[str, Estimate]:
        """Mean, standard deviation and quantiles with intervals; see ``statistics``."""
        return statistics(self.amplifications)

    def summary(self) -> list[tuple[str, str]]:
        """Samples, amplifications and their bound."""
        return [("wheels", f"{len(self.deviations)} of {self.deviations.shape[1]} sectors"),
                ("amplification", span(self.amplifications, "")),
                ("mean", f"{self.amplifications.mean():.4g}"),
                ("Whitehead's bound", f"{self.bound:.4g}")]


@dataclass(frozen=True, eq=False)
class _Wheels:
    """Mistuned wheels on a worker: excitation, tuned stiffness, and that of each sector's cells."""

    excitation: Excitation
    tuned: Array
    sectors: Array
    band: tuple[float, float]

    def largest(self, deviations: Array) -> list[float]:
        """Largest displacements of wheels with deviations (n, N) [m/N]."""
        return [self.excitation.largest(
            self.tuned + np.tensordot(one, self.sectors, axes=1), self.band)[0]
            for one in deviations]


def _batch(given: tuple[_Wheels, Array]) -> list[float]:
    return given[0].largest(given[1])


def mistuning_sweep(
    wheel: CyclicBasis, group: str, spread: float, order: int, band_hz: tuple[float, float],
    force: tuple[str, str], *, observe: tuple[str, str] | None = None, samples: int = 200,
    seed: int = 0, workers: int | None = 1, executor: Executor | None = None,
) -> MistuningSweep:
    """Amplification of the linear response over random deviations of the blades' stiffness.

    Deviations of each sector are independent and normally distributed about zero. The wheels depend
    on the seed alone, not on the workers.

    Parameters
    ----------
    wheel : CyclicBasis
        With all diameters; few modes suffice where those near the band are among them.
    group : str
        The cells that deviate, ``body.group``, as for :class:`~fecontact.reduction.WholeWheel`.
    spread : float
        Standard deviation of delta_s, positive and below 0.2.
    order : int
        Engine order m.
    band_hz : (float, float)
        Frequencies over which the largest displacement is looked for [Hz].
    force, observe : (point, component)
        As for :func:`fecontact.analysis.mistuned_response`.
    samples : int
        Number of wheels, three or more.
    seed : int
        Of the random numbers.
    workers : int or None
        Processes, 1 for this one alone, None for one per core.
    executor : Executor, optional
        Another executor, as for sweeps.

    Raises
    ------
    InputError, AnalysisError
        For values out of range, and as :func:`fecontact.analysis.amplification`.
    """
    require_positive("mistuning_sweep", spread=spread)
    require_kind("mistuning_sweep", int, samples=samples, seed=seed)
    if samples < 3 or spread >= 0.2:
        raise InputError(f"mistuning_sweep: samples = {samples} must be three or more, and spread "
                         f"= {spread:g} below 0.2.")
    whole = WholeWheel(wheel, np.zeros(wheel.symmetry.sectors), group)
    excitation = Excitation.of(whole, order, force, observe)
    band = (2.0 * np.pi * float(band_hz[0]), 2.0 * np.pi * float(band_hz[1]))
    wheels = _Wheels(excitation, whole.stiffness, np.array(
        [whole.sector_stiffness(s) for s in range(whole.sectors)]), band)
    tuned = excitation.largest(whole.stiffness, band)[0]
    deviations = np.clip(spread * np.random.default_rng(seed).standard_normal(
        (samples, whole.sectors)), -0.9, None)
    batches = deque((wheels, deviations[first : first + _BATCH])
                    for first in range(0, samples, _BATCH))
    if workers == 1 and executor is None:
        found: list[Any] = [_batch(one) for one in batches]
    else:
        with opened(executor, workers) as pool:
            found = [one.result() for one in [pool.submit(_batch, batch) for batch in batches]]
    return MistuningSweep(deviations, np.concatenate(found) / tuned, tuned)
