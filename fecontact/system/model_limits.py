"""Limits of the model: small displacements and rotations, shallow penetration, plausible values.

They reveal wrong units and unsupported loads. ``CHECKS_BEFORE`` and ``CHECKS_AFTER`` list one
function for each check: before a run, of its bodies and system; after it, of its states.
"""

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.core.errors import ModelWarning, choices
from fecontact.core.types import Array
from fecontact.fem.elastic_body import ElasticBody
from fecontact.laws.base import NormalLaw
from fecontact.laws.excitation import AXES
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem
from fecontact.system.kernels import PENETRATION

# Penetration of a rough surface, in roughness heights, beyond which a wrong unit or stiffness is
# likely, since all asperities would be crushed.
DEEPEST = 100.0

# Rotation beyond which displacements are not linear in it [rad].
SMALL_ANGLE = 0.1

# Plausible ranges: extents of bodies [m], Young's moduli [Pa], densities [kg/m^3]. Largest friction
# coefficient, roughness as a part of the body, speed of the ground [m/s], gap in extents of the
# body, and duration in periods of the fastest mode.
SIZES, MODULI, DENSITIES = (1e-4, 5.0), (1e6, 2e12), (1.0, 25000.0)
FRICTION, ROUGHNESS, SPEED, GAP, PERIODS = 2.0, 0.01, 100.0, 100.0, 1e6

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
    found = (check(system, times, states) for check in CHECKS_AFTER)
    return tuple(sentence for sentence in found if sentence)


@dataclass(frozen=True)
class Planned:
    """Model of a run: the system, its elastic bodies by name, and the duration [s]."""

    system: ContactSystem
    bodies: Mapping[str, ElasticBody]
    duration: float


def implausible_values(planned: Planned) -> tuple[str, ...]:
    """Messages about values that are possible, but more likely a wrong unit; usually none."""
    return tuple(sentence for check in CHECKS_BEFORE for sentence in check(planned))


def warn_of_limits(sentences: Iterable[str], what: str) -> None:
    """Issue a ModelWarning for each sentence, beginning with ``what``: 'In this run'."""
    for sentence in sentences:
        warnings.warn(f"{what} {sentence}", ModelWarning, stacklevel=3)


def _too_far(system: ContactSystem, times: Array, states: Array) -> str | None:
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


def _turned(system: ContactSystem, times: Array, states: Array) -> str | None:
    """Rotation of a single body, the median over its points, beyond small angles."""
    basis = system.basis
    rows = basis.T[:, basis.dimension :]
    rows = rows[np.abs(rows).any(axis=(1, 2))]
    # Masses without positions have no rotation in space, only a coordinate of that name.
    if basis.parts or not len(rows) or not np.ptp(basis.positions, axis=0).any():
        return None
    largest = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for first in range(0, len(states), _BLOCK):
            angles = np.einsum("pcm,tm->tpc", rows, states[first : first + _BLOCK, : basis.modes])
            largest = max(largest, float(np.median(np.linalg.norm(angles, axis=2), axis=1).max()))
    if not largest > SMALL_ANGLE or _too_far(system, times, states):
        return None
    return (f"the body turns by {largest:.2g} rad; rotations above {SMALL_ANGLE:g} rad are not "
            f"small, as the equations assume, so check the supports and the loads.")


def _bodies(planned: Planned) -> Iterator[str]:
    """Size, material and thickness of the bodies."""
    low, high = SIZES
    for name, body in planned.bodies.items():
        who = f"body '{name}'" if name else "the body"
        size, material = float(np.ptp(body.mesh.nodes, axis=0).max()), body.material
        if not low <= size <= high:
            yield (f"{who} has an extent of {size:.3g} m, not from {low:g} to {high:g} m; check "
                   f"the unit of lengths, and give a mesh in mm the scale 1e-3.")
        for key, value, (least, most), unit in (
                ("youngs_modulus", material.youngs_modulus, MODULI, "Pa"),
                ("density", material.density, DENSITIES, "kg/m3")):
            if not least <= value <= most:
                yield (f"{key} = {value:.3g} {unit} of {who} is not from {least:g} to {most:g} "
                       f"{unit}; check its unit.")
        if body.dimension == 2 and body.plane == "stress" and body.thickness > size:
            yield (f"thickness = {body.thickness:.3g} m of {who} is more than its extent of "
                   f"{size:.3g} m; check its unit, or take plane = \"strain\".")


def _friction(planned: Planned) -> Iterator[str]:
    """Coefficients of friction."""
    for *_, law in planned.system.law_groups("friction"):
        for key, value in vars(law).items():
            if key.endswith("coefficient") and key != "viscous_coefficient" and (
                    (largest := float(np.max(value))) > FRICTION):
                yield (f"{key} = {largest:.3g} of {type(law).__name__} is above {FRICTION:g}; "
                       f"check it.")


def _roughness(planned: Planned) -> Iterator[str]:
    """Roughness compared with the smallest body."""
    extents = [float(np.ptp(body.mesh.nodes, axis=0).max()) for body in planned.bodies.values()]
    for *_, law in planned.system.law_groups("normal"):
        height = getattr(law, "roughness_height", None)
        if extents and height is not None and float(np.max(height)) > ROUGHNESS * min(extents):
            yield (f"roughness_height = {float(np.max(height)):.3g} m is more than a hundredth of "
                   f"the body's extent of {min(extents):.3g} m; check its unit.")


def _ground(planned: Planned) -> Iterator[str]:
    """Speed and distance of the ground."""
    ground, gap = planned.system.ground, float(np.min(planned.system.arrays.gap))
    if abs(ground.speed) > SPEED:
        yield f"ground.speed = {ground.speed:.3g} m/s is above {SPEED:g} m/s; check its unit."
    extents = [float(np.ptp(body.mesh.nodes, axis=0).max()) for body in planned.bodies.values()]
    if extents and gap > GAP * max(extents):
        yield (f"the smallest gap of {gap:.3g} m is more than {GAP:g} times the body's extent of "
               f"{max(extents):.3g} m, which will hardly touch; check its unit.")


def _duration(planned: Planned) -> Iterator[str]:
    """Duration in periods of the fastest mode."""
    highest = float(planned.system.basis.frequencies_hz.max())
    if planned.duration * highest > PERIODS:
        yield (f"it lasts {planned.duration * highest:.2g} periods of the fastest mode, "
               f"{highest:.4g} Hz, and will take long; end it earlier, or keep fewer modes.")


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


CHECKS_BEFORE: tuple[Callable[[Planned], Iterator[str]], ...] = (
    _bodies, _friction, _roughness, _ground, _duration)
CHECKS_AFTER: tuple[Callable[[ContactSystem, Array, Array], str | None], ...] = (
    _too_far, _turned, _too_deep)
