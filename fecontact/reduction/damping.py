"""Modal damping matrices from damping ratios, Rayleigh factors or loss factors."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from fecontact.core.checks import as_floats
from fecontact.core.errors import InputError, require_not_negative
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.fem.elastic_body import ElasticBody
from fecontact.reduction.eigenmodes import strain_energies


@dataclass(frozen=True)
class Rayleigh:
    """Damping matrix ``mass_factor * M + stiffness_factor * K``.

    The damping ratio is ``mass_factor / (2 w) + stiffness_factor w / 2``; rigid modes have the
    absolute damping ``mass_factor``.

    Parameters
    ----------
    mass_factor : float
        Factor of the mass [1/s], zero or above.
    stiffness_factor : float
        Factor of the stiffness [s], zero or above.
    """

    mass_factor: Annotated[float, Unit("1/s")] = 0.0
    stiffness_factor: Annotated[float, Unit("s")] = 0.0

    def __post_init__(self) -> None:
        require_not_negative("Rayleigh damping", mass_factor=self.mass_factor,
                             stiffness_factor=self.stiffness_factor)


@dataclass(frozen=True)
class LossFactor:
    """Damping ratios ``D = loss_factor / 2`` of all modes from the loss factor of the material.

    This damping is viscous, and right at the resonance of each mode only: there the energy lost
    per cycle is ``2 pi loss_factor`` times the largest elastic energy, as that of the material is
    at every frequency. A mode of frequency f_i that moves with another frequency f loses f / f_i
    times as much: too little below its resonance, too much above.

    Parameters
    ----------
    loss_factor : float
        Twice the damping ratio of all modes, zero or above.
    """

    loss_factor: float

    def __post_init__(self) -> None:
        require_not_negative("LossFactor", loss_factor=self.loss_factor)


Damping = float | Rayleigh | LossFactor | Literal["materials"] | Sequence[float] | Array


def material_damping_ratios(body: ElasticBody, shapes: Array) -> Array:
    """Damping ratios (m,) of modes (d N, m) from the loss factors of a body's materials.

    ``D_k = 1/2 sum_m eta_m E_mk / E_k`` with the elastic energy E_mk of mode k in the material m,
    of E_k in all; zero of rigid modes (Johnson and Kienholz, AIAA Journal 20, 1982). As
    :class:`LossFactor` it is right at the resonance of each mode only.
    """
    energies = np.zeros((len(body.materials), shapes.shape[1]))
    for which in range(len(body.materials)):
        cells = np.flatnonzero(body.cell_materials == which)
        energies[which] = strain_energies(body, shapes, cells)
    total = strain_energies(body, shapes) if body.added else energies.sum(axis=0)
    losses = np.array([one.loss_factor for one in body.materials])
    return np.asarray(0.5 * losses @ energies / np.where(total > 0.0, total, 1.0))


def modal_damping(
    damping: Damping, angular_frequencies: Array
) -> Array:
    """Modal damping matrix (m, m) [1/s], so that ``q'' + damping q' + w^2 q = R``.

    Parameters
    ----------
    damping : float, (m,) sequence, Rayleigh, LossFactor or (m, m) array
        One damping ratio for all modes, one per mode, Rayleigh factors, a loss factor, or the
        full matrix.
        A ratio D gives ``2 D w``, which is zero for rigid modes.
    angular_frequencies : (m,) array
        [rad/s].

    Raises
    ------
    InputError
        For negative ratios, values that are not finite, or a wrong number of values.
    """
    count = len(angular_frequencies)
    if isinstance(damping, Rayleigh):
        return np.diag(damping.mass_factor
                       + damping.stiffness_factor * angular_frequencies**2)
    if isinstance(damping, LossFactor):
        damping = 0.5 * damping.loss_factor
    values = as_floats(damping, "The damping of a modal basis")
    if not np.isfinite(values).all():
        raise InputError(f"Damping {damping!r} is not finite.")
    if values.shape == (count, count) and values.ndim == 2:
        return values.copy()
    if values.ndim > 1 or values.shape not in ((), (count,)):
        raise InputError(
            f"Damping must be one ratio, {count} ratios (one per mode), Rayleigh factors or a "
            f"{count} x {count} matrix, not an array of shape {values.shape}."
        )
    if (values < 0).any():
        raise InputError(f"Damping ratio {values.min()} must be zero or above.")
    return np.diag(np.broadcast_to(2.0 * values * angular_frequencies, (count,)))
