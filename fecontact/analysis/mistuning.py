r"""Mistuned wheels: linear response to engine orders, and its amplification.

With the stiffness of a group of cells of sector s times ``1 + delta_s``, the modes of the tuned
wheel are coupled (component-mode mistuning in cyclic modal coordinates: Lim, Bladh, Castanier and
Pierre, AIAA Journal 45, 2007):

.. math:: K = diag(\omega^2) + \sum_s \delta_s \Phi_s^T K_b \Phi_s
"""

from dataclasses import dataclass

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.reduction.cyclic.whole_wheel import WholeWheel

# Natural frequencies at which a peak is looked for, and width in half bandwidths.
_TRIED, _WIDTH = 4, 3.0


def whitehead_bound(sectors: int) -> float:
    """Largest amplification of a mistuned wheel of N sectors, (1 + sqrt(N)) / 2 (Whitehead 1966).

    It holds for one mode of each blade and damping that does not couple blades.
    """
    require_kind("whitehead_bound", int, sectors=sectors)
    if sectors < 2:
        raise InputError(f"whitehead_bound: sectors = {sectors} must be two or more.")
    return 0.5 * (1.0 + float(np.sqrt(sectors)))


@dataclass(frozen=True, eq=False)
class Excitation:
    """Engine order m on a wheel: ``F_s = exp(-2 pi i m s / N)`` N at a point of each sector.

    Attributes
    ----------
    force : (M,) complex array
        Modal forces.
    rows : (N, M) array
        The displacement that is observed in each sector.
    damping : (M, M) array
        [1/s].
    """

    force: ComplexArray
    rows: Array
    damping: Array

    @classmethod
    def of(
        cls, whole: WholeWheel, order: int, force: tuple[str, str],
        observe: tuple[str, str] | None = None,
    ) -> "Excitation":
        """From the points and components of force and displacement.

        Raises
        ------
        InputError
            For unknown points, or an order that is not from 0 to N.
        """
        require_kind("mistuned_response", WholeWheel, whole=whole)
        require_kind("mistuned_response", int, order=order)
        N = whole.sectors
        if not 0 <= order <= N:
            raise InputError(f"mistuned_response: order = {order} must be from 0 to the number of "
                             f"sectors, {N}.")
        phases = np.exp(-2.0j * np.pi * order * np.arange(N) / N)
        return cls(phases @ whole.rows(*force), whole.rows(*(observe or force)), whole.damping)

    def response(self, stiffness: Array, w: float) -> ComplexArray:
        """Displacements (N,) of all sectors at an angular frequency [m/N]."""
        dynamic = stiffness - w**2 * np.eye(len(stiffness)) + 1j * w * self.damping
        return np.asarray(self.rows @ np.linalg.solve(dynamic, self.force))

    def largest(self, stiffness: Array, band: tuple[float, float]) -> tuple[float, float]:
        """Largest displacement of any sector over a band of angular frequencies, and its place.

        Raises
        ------
        AnalysisError
            For a band without a natural frequency.
        """
        from scipy.optimize import minimize_scalar

        squares, modes = np.linalg.eigh(stiffness)
        w = np.sqrt(np.maximum(squares, 0.0))
        inside = np.flatnonzero((w >= band[0]) & (w <= band[1]))
        if not len(inside):
            raise AnalysisError(f"The wheel has no natural frequency from "
                                f"{band[0] / (2.0 * np.pi):.6g} to {band[1] / (2.0 * np.pi):.6g} "
                                f"Hz; widen the band.")
        half = 0.5 * np.maximum((modes * (self.damping @ modes)).sum(axis=0), 0.0)

        def size(at: float) -> float:
            return float(np.abs(self.response(stiffness, at)).max())

        seen = np.array([size(w[k]) for k in inside])
        best, place = float(seen.max()), float(w[inside[int(seen.argmax())]])
        for k in inside[np.argsort(-seen)[:_TRIED]]:
            reach = _WIDTH * half[k]
            found = minimize_scalar(lambda at: -size(at), bounds=(
                max(band[0], w[k] - reach), min(band[1], w[k] + reach)), method="bounded",
                options={"xatol": 1e-3 * half[k] + 1e-12 * w[k]}) if reach > 0.0 else None
            if found is not None and -found.fun > best:
                best, place = float(-found.fun), float(found.x)
        return best, place


def mistuned_response(
    whole: WholeWheel, order: int, frequencies_hz: ArrayLike, force: tuple[str, str],
    observe: tuple[str, str] | None = None,
) -> ComplexArray:
    """Linear response (F, N) of all sectors to engine order m, without contact [m/N].

    Parameters
    ----------
    whole : WholeWheel
        Tuned, or with deviations.
    order : int
        m, from 0 to N.
    frequencies_hz : (F,) array
        Frequencies of the force [Hz].
    force : (point, component)
        Place of a force of 1 N in each sector, with the phase ``-2 pi m s / N``: ``("blade.tip",
        "y")``.
    observe : (point, component), optional
        The displacement, by default that of the force.

    Raises
    ------
    InputError
        For unknown points or components, and an order out of range.
    """
    excitation = Excitation.of(whole, order, force, observe)
    hertz = np.atleast_1d(as_floats(frequencies_hz, "mistuned_response: frequencies_hz"))
    return np.array([excitation.response(whole.stiffness, 2.0 * np.pi * f) for f in hertz])


def amplification(
    whole: WholeWheel, order: int, band_hz: tuple[float, float], force: tuple[str, str],
    observe: tuple[str, str] | None = None,
) -> float:
    """Largest displacement of any sector over a band, over that of the tuned wheel.

    Parameters
    ----------
    whole : WholeWheel
        Wheel with deviations.
    order, force, observe : int, (point, component), (point, component)
        See :func:`mistuned_response`.
    band_hz : (float, float)
        Frequencies over which both are looked for [Hz].

    Raises
    ------
    InputError
        As in :func:`mistuned_response`.
    AnalysisError
        For a band without a natural frequency of either wheel.
    """
    excitation = Excitation.of(whole, order, force, observe)
    band = (2.0 * np.pi * float(band_hz[0]), 2.0 * np.pi * float(band_hz[1]))
    tuned = WholeWheel(whole.wheel).stiffness
    return excitation.largest(whole.stiffness, band)[0] / excitation.largest(tuned, band)[0]
