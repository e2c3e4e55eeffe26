"""Bases of point masses with springs and dashpots, without a mesh."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, choices, nearest, require_positive, shown
from fecontact.core.types import Array
from fecontact.reduction.from_matrices import basis_from_matrices
from fecontact.reduction.modal_basis import ModalBasis

Pair = tuple[str, str | None]


def point_masses(
    masses: Mapping[str, float],
    springs: Mapping[Pair, Any] | None = None,
    *,
    dashpots: Mapping[Pair, Any] | None = None,
    components: str = "y",
    contact: str | Sequence[str] = (),
) -> ModalBasis:
    """Modal basis of one or several masses with springs to the base and between each other.

    ``point_masses({"a": 1.0, "b": 2.0}, {("a", "b"): 1e4, ("a", None): 2e4})``; each mass is a
    named point, for a :class:`fecontact.reduction.PointPairing` or loads.

    Parameters
    ----------
    masses : mapping of name to mass
        Positive [kg]. Masses named B and C are excitation and load point.
    springs : mapping of (name, name) to stiffness, optional
        Stiffness between two masses, or a mass and the base, which is None: a number for all
        components or one for each, zero or above [N/m].
    dashpots : mapping of (name, name) to damping, optional
        Likewise [N s/m].
    components : 'x', 'y' or 'xy', in space 'z', 'xz', 'yz' or 'xyz'
        Directions in which the masses move; springs along them are independent.
    contact : str or sequence of str
        Masses that are contact nodes on the ground, in the order of the nodes.

    Raises
    ------
    InputError
        For masses that are not positive, unknown names, and values of wrong number or sign.
    """
    require_kind("point_masses", Mapping, masses=masses)
    if components not in ("x", "y", "xy", "z", "xz", "yz", "xyz"):
        raise InputError(f"point_masses: components = {components!r} must be 'x', 'y' or 'xy', in "
                         f"space 'z', 'xz', 'yz' or 'xyz'.")
    dimension: Literal[2, 3] = 3 if "z" in components else 2
    if not masses:
        raise InputError("point_masses: masses is empty; give at least one.")
    for name, value in masses.items():
        require_kind("point_masses", str, name=name)
        require_positive("point_masses", **{f"mass of '{name}'": value})
    axes, numbers = len(components), {name: i for i, name in enumerate(masses)}
    d = axes * len(masses)
    touching = (contact,) if isinstance(contact, str) else tuple(contact)
    for name in touching:
        _require_mass("contact", name, masses)
    rows = {}
    for name, i in numbers.items():
        rows[name] = np.zeros((3 * (dimension - 1), d))
        for k, axis in enumerate(components):
            rows[name]["xyz".index(axis), axes * i + k] = 1.0
    given: dict[str, Any] = dict(rows)
    if touching:
        given["contact"] = np.array([rows[name] for name in touching])
    along = np.zeros((dimension, d))
    for k, axis in enumerate(components):
        along["xyz".index(axis), k::axes] = 1.0
    return basis_from_matrices(
        np.diag(np.repeat([float(value) for value in masses.values()], axes)),
        _between("springs", springs, numbers, axes), given,
        damping=_between("dashpots", dashpots, numbers, axes), translations=along,
        dimension=dimension)


def _between(
    what: str, given: Mapping[Pair, Any] | None, numbers: Mapping[str, int], axes: int
) -> Array:
    """Matrix (d, d) of springs or dashpots."""
    found = np.zeros((axes * len(numbers),) * 2)
    require_kind("point_masses", Mapping, **{what: given or {}})
    for pair, value in (given or {}).items():
        if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] is None or pair[0] == pair[1]:
            raise InputError(f"point_masses: {what} between {pair!r} must be between two masses, "
                             f"or (mass, None) for the base.")
        values = as_floats(value, f"point_masses: {what}")
        if values.shape not in ((), (axes,)) or not (values >= 0.0).all() or not np.isfinite(
                values).all():
            raise InputError(f"point_masses: {what} between {pair!r} = {shown(value)} must be a "
                             f"number, or one for each of the {axes} components, zero or above.")
        ends = [name for name in pair if name is not None]
        for name in ends:
            _require_mass(what, name, numbers)
        relative = np.zeros((axes, len(found)))
        for name, sign in zip(ends, (1.0, -1.0), strict=False):
            relative[:, axes * numbers[name] : axes * (numbers[name] + 1)] = sign * np.eye(axes)
        found += relative.T @ (np.broadcast_to(values, (axes,))[:, None] * relative)
    return found


def _require_mass(what: str, name: Any, masses: Mapping[str, Any]) -> None:
    if name not in masses:
        raise InputError(f"point_masses: {what} names the mass {name!r}"
                         f"{nearest(str(name), masses)}; the masses are {choices(masses)}.")
