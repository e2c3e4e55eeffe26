"""Keys of a study that fit its bodies: those for solids, and those for plane bodies."""

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

from fecontact.core.errors import InputError, choices
from fecontact.core.tables import plain, shown
from fecontact.laws.excitation import Drive, Load
from fecontact.laws.ground.ground import Ground
from fecontact.laws.ground.sliding import SlidingRotation
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.study.bodies_section import InterfaceSettings

# Keys that act or vary along a third direction, by their sections.
_IN_SPACE: Mapping[str, tuple[str, ...]] = {
    "ground": ("speed_y", "motion_y", "rotation_speed", "wave_direction", "height_map"),
    "drive": ("stiffness_z", "damping_z", "amplitude_z", "motion_z"),
    "load": ("base_acceleration_z",),
}


class Acting(Protocol):
    """Sections of a study that act on its bodies."""

    @property
    def ground(self) -> Ground:
        """The ground."""

    @property
    def drive(self) -> Drive:
        """Drive at B."""

    @property
    def load(self) -> Load:
        """Loads."""

    @property
    def interfaces(self) -> Mapping[str, InterfaceSettings]:
        """Interfaces of the bodies, with the sliding of their other sides."""


def require_dimension(study: Acting, basis: ModalBasis, title: str) -> None:
    """Refuse keys of solids in a study of plane bodies, and the reverse.

    Raises
    ------
    InputError
        Naming section, key and value.
    """
    solid = basis.dimension == 3
    body, other = ("a solid", "plane bodies") if solid else ("plane", "solids")
    for section, key, value, remedy in _misfits(study, basis):
        raise InputError(f"{title}: [{section}]: {key} = {shown(plain(value))} is for {other}, but "
                         f"the body is {body}; {remedy}.")


def _misfits(study: Acting, basis: ModalBasis) -> Iterator[tuple[str, str, Any, str]]:
    """Section, key, value and remedy of each key that does not fit the dimension of the bodies."""
    d, axes = basis.dimension, "x, y and z" if basis.dimension == 3 else "x and y"
    if d == 2:
        for section, keys in _IN_SPACE.items():
            given = getattr(study, section)
            usual = type(given)()
            for key in keys:
                if (value := getattr(given, key)) != getattr(usual, key):
                    yield section, key, value, "leave it out, or make a solid"
    load = study.load
    if load.gravity is not None and len(load.gravity) != d:
        yield "load", "gravity", load.gravity, f"give the accelerations along {axes}"
    for number, force in enumerate(load.forces):
        where = f"load.forces.{number}"
        if not force.suits(basis.components):
            yield where, "component", force.component, (
                f"choose from {choices(basis.components)}" if isinstance(force.component, str)
                else f"give a direction along {axes}")
        if isinstance(force.point, tuple) and len(force.point) != d:
            yield where, "point", force.point, f"give its coordinates {axes}"
    for number, one in enumerate(load.boundaries):
        if d == 2 and one.shear_across != 0.0:
            yield (f"load.boundaries.{number}", "shear_across", one.shear_across,
                   "give shear, which acts along the boundary")
    for name, interface in study.interfaces.items():
        sliding, where = interface.sliding, f"interfaces.{name}.sliding"
        if d == 2 and sliding is not None:
            key = "centre" if isinstance(sliding, SlidingRotation) else "direction"
            if len(value := getattr(sliding, key)) == 3:
                yield where, key, value, f"give its {axes}"
            if isinstance(sliding, SlidingRotation) and sliding.axis != (0.0, 0.0, 1.0):
                yield where, "axis", sliding.axis, "leave it out"
