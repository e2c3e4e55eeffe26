"""Statistics of mistuned wheels: amplification over random deviations of the blades."""

import hashlib
from collections import deque
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fecontact.analysis.mistuning import Excitation, whitehead_bound
from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError, require_positive
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised, span
from fecontact.reduction.cyclic.cyclic_basis import CyclicBasis
from fecontact.reduction.cyclic.whole_wheel import WholeWheel
from fecontact.sweeps.case import Row
from fecontact.sweeps.dispatch import Job, LostError, results
from fecontact.sweeps.executors import opened
from fecontact.sweeps.statistics import Estimate, statistics
from fecontact.sweeps.store import Store

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
    """Mistuned wheels on a worker: excitation, tuned stiffness, and that of each sector's cells.

    The cases are deviations (N,) of wheels by their keys.
    """

    excitation: Excitation
    tuned: Array
    sectors: Array
    band: tuple[float, float]
    cases: tuple[tuple[str, Array], ...] = ()

    def of(self, deviations: Array) -> "_Wheels":
        """Wheels with deviations (n, N); their keys differ from those of any others."""
        same = hashlib.sha256(repr(self.band).encode())
        for part in (self.excitation.force, self.excitation.rows, self.excitation.damping,
                     self.tuned, self.sectors):
            same.update(np.ascontiguousarray(part).tobytes())
        return replace(self, cases=tuple(
            (hashlib.sha256(same.digest() + one.tobytes()).hexdigest()[:24], one)
            for one in deviations))


def _largest(wheels: _Wheels) -> list[Row]:
    """Largest displacement of any sector of each wheel [m/N]."""
    return [Row(case=key, values={"displacement": wheels.excitation.largest(
        wheels.tuned + np.tensordot(one, wheels.sectors, axes=1), wheels.band)[0]}, reason="")
        for key, one in wheels.cases]


def _compute(
    wheels: _Wheels, rows: dict[str, Row], store: Store | None, executor: Executor | None,
    workers: int | None,
) -> None:
    """Add the wheels that are missing in the rows to them, and to the store."""
    missing = [case for case in wheels.cases if case[0] not in rows]
    batches = [replace(wheels, cases=tuple(missing[first : first + _BATCH]))
               for first in range(0, len(missing), _BATCH)]

    def take(found: list[Row]) -> None:
        rows.update({row["case"]: row for row in found})
        if store is not None:
            store.add(found)

    if workers == 1 and executor is None:
        for batch in batches:
            take(_largest(batch))
    elif batches:
        with opened(executor, workers) as pool:
            for _, found in results(deque(Job(_largest, batch) for batch in batches), pool):
                if isinstance(found, LostError):
                    raise AnalysisError(f"mistuning_sweep: a wheel was not computed: {found}")
                take(found)


def mistuning_sweep(
    wheel: CyclicBasis, group: str, spread: float, order: int, band_hz: tuple[float, float],
    force: tuple[str, str], *, observe: tuple[str, str] | None = None, samples: int = 200,
    seed: int = 0, workers: int | None = 1, executor: Executor | None = None,
    folder: str | Path | None = None, resume: bool = False, overwrite: bool = False,
) -> MistuningSweep:
    """Amplification of the linear response over random deviations of the blades' stiffness.

    Deviations of each sector are independent and normally distributed about zero. The wheels depend
    on the seed alone, not on the workers.

    Parameters
    ----------
    wheel : CyclicBasis
        Wheel with all diameters; few modes suffice where those near the band are among them.
    group : str
        The cells that deviate, ``body.group``, as for :class:`~fecontact.reduction.WholeWheel`.
    spread : float
        Standard deviation of delta_s, positive and below 0.2.
    order : int
        Engine order m.
    band_hz : (float, float)
        Frequencies over which the largest displacement is looked for [Hz].
    force, observe : (point, component)
        See :func:`fecontact.analysis.mistuned_response`.
    samples : int
        Number of wheels, three or more.
    seed : int
        Seed of the random numbers.
    workers : int or None
        Processes, 1 for this one alone, None for one per core.
    executor : Executor, optional
        Another executor, as for sweeps.
    folder : path, optional
        Folder that stores finished wheels, also after an interruption; by default none.
    resume, overwrite : bool
        Go on with the wheels in the folder, or remove them; otherwise they are an error.

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
    tuned = excitation.largest(whole.stiffness, band)[0]
    deviations = np.clip(spread * np.random.default_rng(seed).standard_normal(
        (samples, whole.sectors)), -0.9, None)
    wheels = _Wheels(excitation, whole.stiffness, np.array(
        [whole.sector_stiffness(s) for s in range(whole.sectors)]), band).of(deviations)
    rows: dict[str, Row] = {}
    if folder is None:
        _compute(wheels, rows, None, executor, workers)
    else:
        store = Store(Path(folder))
        with store.begun(resume=resume, overwrite=overwrite):
            rows = store.rows()
            _compute(wheels, rows, store, executor, workers)
    found = np.array([rows[key]["values"]["displacement"] for key, _ in wheels.cases])
    return MistuningSweep(deviations, found / tuned, tuned)
