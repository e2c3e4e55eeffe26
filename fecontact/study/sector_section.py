"""One sector of a wheel in a study: ``[symmetry]``, its bodies, and ``[mistuning]``."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from fecontact.bifurcation.harmonic.engine_order import EngineOrder
from fecontact.bifurcation.response_options import ResponseSettings
from fecontact.core.errors import InputError, choices
from fecontact.core.tables import convert_fields, located, plain, shown
from fecontact.fem.cyclic_symmetry import CyclicSymmetry
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.pairing import Pairing, TwoPassPairing
from fecontact.fem.rotation import Rotation
from fecontact.laws.excitation import Drive
from fecontact.reduction.cyclic.cyclic_basis import CyclicBasis, cyclic_basis
from fecontact.study.bodies_section import BodyBasisSettings, BodySections, InterfaceSettings

# Keys of [bodies.NAME.basis] that a sector has; others must have their defaults.
_KEYS = ("modes", "rigid", "points", "damping", "loads", "temperature")
# Truncation errors look at harmonics up to this multiple of the highest one.
_LOOKED_AT = 3


@dataclass(frozen=True)
class MistuningSettings:
    """``[mistuning]``: blades of a wheel that differ, for ``fecontact mistuning``.

    Engine order, range and what is observed are those of ``[response]``; the first force of
    ``[[load.forces]]`` acts on each sector.

    Parameters
    ----------
    group : str
        The cells whose stiffness deviates: 'BODY.GROUP' of the mesh, or a body.
    spread : float, optional
        Standard deviation of random deviations, below 0.2.
    deviations : list of float
        In place of it the measured deviation of each sector, above -1: the stiffness is
        (1 + deviation) times that of the tuned wheel.
    samples : int
        Number of random wheels.
    seed : int
        Seed of the random numbers; equal seeds give equal wheels.
    """

    group: str
    spread: float | None = None
    deviations: tuple[float, ...] = ()
    samples: int = 200
    seed: int = 0

    def __post_init__(self) -> None:
        convert_fields(self)
        if (self.spread is None) == (not self.deviations):
            raise InputError("MistuningSettings: give either spread, for random wheels, or "
                             "deviations, measured ones of each sector.")
        if self.spread is not None and not 0.0 < self.spread < 0.2:
            raise InputError(f"MistuningSettings: spread = {self.spread:g} must lie between 0 and "
                             f"0.2.")
        if self.samples < 3 or self.seed < 0:
            raise InputError(f"MistuningSettings: samples = {self.samples} must be three or more, "
                             f"seed = {self.seed} zero or above.")


class Sector(Protocol):
    """Sections of a study that describe one sector of a wheel."""

    @property
    def symmetry(self) -> CyclicSymmetry | None:
        """N, axis, and the boundaries at which sectors meet."""

    @property
    def mistuning(self) -> MistuningSettings | None:
        """Deviations of the blades."""

    @property
    def bodies(self) -> Mapping[str, BodySections]:
        """The bodies of one sector."""

    @property
    def interfaces(self) -> Mapping[str, InterfaceSettings]:
        """Interfaces at which the bodies touch."""

    @property
    def response(self) -> ResponseSettings:
        """Engine order and harmonics."""

    @property
    def drive(self) -> Drive:
        """Drive at B."""


def diameters_of(study: Sector) -> tuple[int, ...] | str:
    """Nodal diameters that the waves of ``[response]`` have; 'all' where they are not known."""
    response, symmetry = study.response, study.symmetry
    if (symmetry is None or response.engine_order is None or study.mistuning is not None
            or response.tolerance is not None):
        return "all"
    given = response.harmonics
    highest = given if isinstance(given, int) else max(given)
    N = symmetry.sectors
    found = {h * response.engine_order % N for h in range(_LOOKED_AT * highest + 2)}
    return tuple(sorted({min(k, N - k) for k in found}))


def sector_basis(
    study: Sector, bodies: Mapping[str, ElasticBody],
    faces: Mapping[str, Pairing | TwoPassPairing], title: str,
) -> CyclicBasis:
    """Modes of the sector of a study by nodal diameters.

    Raises
    ------
    InputError
        For keys that a sector does not have, and as :func:`fecontact.reduction.cyclic_basis`.
    """
    assert study.symmetry is not None
    for where, key, value, remedy in _misfits(study):
        raise InputError(f"{title}: [{where}]: {key} = {shown(plain(value))} is not for one sector "
                         f"of a wheel; {remedy}.")
    settings = {name: one.basis for name, one in study.bodies.items()}
    pairings = {name: one for name, one in faces.items() if isinstance(one, Pairing)}
    with located(f"{title}: [symmetry]:", "CyclicSymmetry", "cyclic_basis", "sector_modes"):
        return cyclic_basis(
            bodies, study.symmetry, pairings,
            modes={name: one.modes for name, one in settings.items()},
            rigid=[name for name, one in settings.items() if one.rigid],
            points={f"{name}.{point}": place for name, one in settings.items()
                    for point, place in one.points.items()},
            loads=[f"{name}.{place}" for name, one in settings.items() for place in one.loads],
            damping={name: one.damping for name, one in settings.items()},
            diameters=diameters_of(study), rotation=_common_rotation(study, title),
            temperature={name: one.temperature for name, one in settings.items()
                         if one.temperature is not None})


def wave_of(study: Sector, wheel: CyclicBasis, title: str) -> EngineOrder:
    """The wave of the engine order of ``[response]``.

    Raises
    ------
    InputError
        Without an engine order, or for one that is out of range.
    """
    order = study.response.engine_order
    if order is None:
        raise InputError(f"{title}: [response] lacks the key 'engine_order'; [symmetry] makes the "
                         f"bodies one sector of a wheel, which answers an engine order with a "
                         f"wave.")
    with located(f"{title}: [response]: engine_order:", "EngineOrder"):
        return EngineOrder(wheel, order)


def _misfits(study: Sector) -> Iterator[tuple[str, str, Any, str]]:
    """Section, key, value and remedy of what a sector does not have."""
    usual = BodyBasisSettings()
    for name, one in study.bodies.items():
        for key in vars(usual):
            if key not in _KEYS and (value := getattr(one.basis, key)) != getattr(usual, key):
                yield (f"bodies.{name}.basis", key, value,
                       f"leave it out, the keys of a sector are {choices(_KEYS)}")
        for place in one.basis.loads:
            if not isinstance(place, str) or place == "gravity":
                yield (f"bodies.{name}.basis", "loads", place,
                       "name boundaries whose loads vary in time")
        if isinstance(one.basis.damping, tuple) or one.basis.damping == "materials":
            yield (f"bodies.{name}.basis", "damping", one.basis.damping,
                   "give one ratio, Rayleigh's factors or a loss factor")
    for name, face in study.interfaces.items():
        if face.passes == 2:
            yield f"interfaces.{name}", "passes", 2, "set passes = 1"
        if face.sliding is not None:
            yield f"interfaces.{name}", "sliding", face.sliding, "leave it out"
    if study.drive != Drive():
        yield "drive", "stiffness_x", study.drive.stiffness_x, (
            "leave [drive] out and excite it by [[load.forces]]")


def _common_rotation(study: Sector, title: str) -> Rotation | None:
    """The rotation of all bodies, which is one."""
    (first, rotation), *others = ((name, one.body.rotation) for name, one in study.bodies.items())
    for name, other in others:
        if other != rotation:
            raise InputError(f"{title}: [bodies.{name}.body] rotation differs from that of "
                             f"[bodies.{first}.body]; the bodies of a wheel turn together, give "
                             f"all the same.")
    return rotation


def usable_of_sector(study: Sector, wheel: CyclicBasis) -> float:
    """Frequency up to which the modes of a sector are usable [Hz]; see ``usable_hz``."""
    found = np.inf
    for part in wheel.basis.parts:
        first, settings = part.modes[0], study.bodies[part.name].basis
        hertz = wheel.basis.frequencies_hz[first : first + min(settings.modes, part.modes[1])]
        if (hertz > 0.0).any():
            found = min(found, float(hertz.max()) / 1.5)
    return float(found)
