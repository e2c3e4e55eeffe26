"""Coefficients of contact nodes, as solvers take them: their type and their values."""

from collections.abc import Mapping, Sequence

import numpy as np

from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.types import Array
from fecontact.reduction.modal_basis import ModalBasis

# One number, one for each contact node, or such by the names of interfaces.
Coefficient = float | Sequence[float] | Mapping[str, float | Sequence[float]]


def node_values(
    name: str, given: Coefficient | None, basis: ModalBasis, default: float,
) -> Array:
    """Values (n,) of the contact nodes from one number, one for each node, or by interfaces.

    Interfaces that a mapping does not name have the default, as all nodes without a value.

    Raises
    ------
    InputError
        For unknown interfaces, and lists of another length than the nodes.
    """
    n = basis.contact_nodes
    if not isinstance(given, Mapping):
        return _spread(name, default if given is None else given, n, "contact nodes")
    names = [group for group, _ in basis.groups]
    for interface in given:
        if interface not in names:
            raise InputError(f"SetValued: {name} names the interface {interface!r}"
                             f"{nearest(str(interface), names)}, but the interfaces are: "
                             f"{choices(names)}.")
    return np.concatenate([
        _spread(f"{name}.{group}", given.get(group, default), count, f"nodes of '{group}'")
        for group, count in basis.groups])


def _spread(name: str, given: float | Sequence[float], count: int, nodes: str) -> Array:
    values = np.atleast_1d(np.asarray(given, dtype=float))
    if len(values) not in (1, count):
        raise InputError(f"SetValued: {name} has {len(values)} values; give one number, or one for "
                         f"each of the {count} {nodes}.")
    return np.broadcast_to(values, (count,)).copy()
