"""Limits of the model: small displacements, shallow penetration, bodies that nothing holds.

They reveal wrong units and unsupported loads.
"""

import warnings
from collections.abc import Iterable

import numpy as np

from fecontact.core.errors import ModelWarning, choices
from fecontact.core.types import Array
from fecontact.laws.base import NormalLaw
from fecontact.laws.excitation import AXES
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem
from fecontact.system.kernels import PENETRATION

# Penetration of a rough surface, in roughness heights, beyond which a wrong unit or stiffness is
# likely, since all asperities would be crushed.
DEEPEST = 100.0

# Output times per batch.
_BLOCK = 4096


def limits_exceeded(system: ContactSystem, times: Array, states: Array) -> tuple[str, ...]:
    """Messages about states outside the range of validity of the model; empty if there are none.

    Parameters
    ----------
    system : ContactSystem
        The system.
    times : (N,) array
        [s].
    states : (N, 2 m + n s) array
        y = [q, q', z].

    Notes
    -----
    Displacements of B, C, the contact nodes and further points are compared with the extent of
    these points and of the mesh, if there is one. Common motion along the ground does not count: a
    body may slide any distance.
    """
    found = (_too_far(system, states), _too_deep(system, times, states))
    return tuple(sentence for sentence in found if sentence)


def warn_of_limits(sentences: Iterable[str], what: str) -> None:
    """Issue a ModelWarning for each sentence, beginning with ``what``: 'In this run'."""
    for sentence in sentences:
        warnings.warn(f"{what} {sentence}", ModelWarning, stacklevel=3)


def _too_far(system: ContactSystem, states: Array) -> str | None:
    basis = system.basis
    used = np.abs(basis.T).any(axis=(1, 2))
    places = basis.positions[used]
    if basis.mode_shapes is not None:
        places = np.vstack([places, basis.mode_shapes.nodes])
    size = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
    # Masses without positions have no size to compare with.
    if size == 0.0:
        return None
    d = basis.dimension
    rows = basis.T[used, :d].reshape(-1, basis.modes).T
    farthest = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for first in range(0, len(states), _BLOCK):
            moved = states[first : first + _BLOCK, : basis.modes] @ rows
            moved = moved.reshape(len(moved), -1, d)
            moved[..., : d - 1] -= moved[..., : d - 1].mean(axis=1, keepdims=True)
            farthest = max(farthest, float(np.sqrt((moved**2).sum(axis=-1)).max()))
    if farthest <= size:
        return None
    return (f"points of the body move by {farthest:.2g} m, more than its own size of {size:.2g} m; "
            f"displacements must be small, so check the supports of the body and the units of "
            f"loads and stiffnesses.")


def _too_deep(system: ContactSystem, times: Array, states: Array) -> str | None:
    rough = [(nodes, law.roughness_height) for nodes, _, law in system.law_groups("normal")
             if isinstance(law, NormalLaw) and hasattr(law, "roughness_height")]
    if not rough:
        return None
    penetration = np.zeros(system.basis.contact_nodes)
    for first in range(0, len(times), _BLOCK):
        part = slice(first, first + _BLOCK)
        history = system.contact_history(times[part], states[part])
        penetration = np.maximum(penetration, history[:, :, PENETRATION].max(axis=0))
    worst, node, worst_height = 0.0, 0, 1.0
    for nodes, height in rough:
        heights = np.broadcast_to(np.asarray(height, dtype=float), penetration[nodes].shape)
        relative = penetration[nodes] / heights
        if relative.max() > worst:
            k = int(np.argmax(relative))
            worst, node, worst_height = float(relative[k]), nodes.start + k, float(heights[k])
    if worst <= DEEPEST:
        return None
    return (f"contact node {node} is {worst * worst_height:.2g} m deep in the ground, "
            f"{worst:.2g} times its roughness height of {worst_height:.2g} m; above {DEEPEST:g} "
            f"times the asperities are crushed, so check load, stiffness and units.")


def named_motion(basis: ModalBasis, direction: Array) -> tuple[str, str]:
    """What moves along modal coordinates (m,), and how: 'the body', 'a rotation'."""
    d = basis.dimension
    if not basis.parts:
        largest = np.abs(basis.contact_T @ direction).max(axis=0)
        size = np.ptp(basis.positions[np.abs(basis.T).any(axis=(1, 2))], axis=0).max()
        named = _named(largest[:d], float(largest[d:].max()) * size)
        if len(named) > 1:
            return "the body", named
        way = "away from" if named == AXES[d - 1] else "along"
        return "the body", f"a translation {way} the ground ({named})"
    found = {}
    for part in basis.parts:
        first, count = part.nodes
        if count and basis.mode_shapes is not None:
            moved, turn = basis.mode_shapes.shapes[first : first + count] @ direction, 0.0
        else:
            points = [basis.point_index(name) for name in basis.extra
                      if name.startswith(f"{part.name}.")]
            rows = basis.T[points] @ direction
            moved, turn = rows[:, :d], float(np.abs(rows[:, d:]).max(initial=0.0))
        if not len(moved):
            continue
        # In a rotation displacements differ between the places, or there are none.
        apart = float(np.ptp(moved, axis=0).max())
        found[part.name] = np.append(np.abs(moved.mean(axis=0)),
                                     turn if turn > 1e9 * np.abs(moved).max() else apart)
    most = max(float(motion.max()) for motion in found.values())
    who = [name for name, motion in found.items() if motion.max() > 0.01 * most]
    *along, turn = found[max(who, key=lambda name: float(found[name].max()))]
    named = _named(np.array(along), float(turn))
    bodies = f"body '{who[0]}'" if len(who) == 1 else f"the bodies {choices(who)}"
    return bodies, f"a translation in {named}" if len(named) == 1 else named


def _named(along: Array, turn: float) -> str:
    """The axis along which all moves but little; else what kind of motion it is."""
    if turn > 0.1 * along.max():
        return "a rotation"
    first, second = np.argsort(-along)[:2]
    return AXES[first] if along[first] > 10.0 * along[second] else "a translation"
