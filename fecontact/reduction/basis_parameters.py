"""Numbers of a modal basis by dotted names, for maps, branches and sensitivities.

``damping_ratios.I``: damping ratio of mode I, of a diagonal damping matrix; ``damping.I.J`` and
``stiffness.I.J``: entries of the modal matrices [1/s, 1/s^2]; ``rotation.speed``: speed of a body
that rotates [rad/s]. Modes are counted from 0.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.core.checks import whole_number
from fecontact.core.errors import InputError, choices, require_finite
from fecontact.core.types import Array
from fecontact.reduction.modal_basis import ModalBasis

NAMES = ("basis.damping_ratios.I", "basis.damping.I.J", "basis.stiffness.I.J",
         "basis.rotation.speed")
_SPEED = "rotation.speed"


def basis_parameter(basis: ModalBasis, name: str) -> float:
    """Value of a number of a basis by its dotted name.

    Raises
    ------
    InputError
        If there is no such number.
    """
    if name == _SPEED:
        if basis.rotation is None:
            raise InputError("The system has no parameter 'basis.rotation.speed': its body does "
                             "not rotate.")
        return basis.rotation.speed
    kind, place = _place(basis, name)
    return float(_values(basis, kind)[place])


def with_basis_parameters(basis: ModalBasis, changes: Mapping[str, Any]) -> ModalBasis:
    """Copy of a basis with other numbers, by their dotted names.

    Raises
    ------
    InputError
        If there is no such number, or a value is not finite or negative where it is a ratio.
    """
    for name, value in changes.items():
        if name == _SPEED:
            basis = basis.with_rotation_speed(value)
            continue
        kind, place = _place(basis, name)
        require_finite("ContactSystem", **{f"basis.{name}": value})
        values = np.array(_values(basis, kind))
        values[place] = value
        if kind == "stiffness":
            basis = replace(basis, stiffness=values)
            continue
        if kind == "damping_ratios":
            if value < 0.0:
                raise InputError(f"basis.{name} = {value!r} must be zero or above.")
            values = np.diag(2.0 * values * basis.angular_frequencies + _rigid_damping(basis))
        basis = replace(basis, damping=values)
    return basis


def _values(basis: ModalBasis, kind: str) -> Array:
    if kind == "damping_ratios":
        return basis.damping_ratios
    return basis.damping if kind == "damping" else basis.stiffness_matrix


def _rigid_damping(basis: ModalBasis) -> Array:
    """Absolute damping (m,) of rigid modes, which have no ratio."""
    return np.where(basis.angular_frequencies == 0.0, np.diag(basis.damping), 0.0)


def _place(basis: ModalBasis, name: str) -> tuple[str, tuple[int, ...]]:
    """Kind of a number and its index."""
    kind, *numbers = name.split(".")
    lengths = {"damping_ratios": 1, "damping": 2, "stiffness": 2}
    place = tuple(number for text in numbers if (number := whole_number(text)) is not None)
    if not lengths.get(kind) == len(numbers) == len(place):
        raise InputError(f"The system has no parameter 'basis.{name}'; numbers of the basis are "
                         f"{choices(NAMES)}, with numbers I and J of modes from 0.")
    if max(place) >= basis.modes:
        raise InputError(f"The system has no parameter 'basis.{name}': the basis has {basis.modes} "
                         f"modes, counted from 0.")
    if kind == "damping_ratios" and basis.angular_frequencies[place[0]] == 0.0:
        raise InputError(f"The system has no parameter 'basis.{name}': mode {place[0]} is rigid "
                         f"and has no damping ratio; set basis.damping.{place[0]}.{place[0]}.")
    return kind, place
