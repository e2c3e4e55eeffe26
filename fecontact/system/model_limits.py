"""Limits of the model: small displacements and rotations, shallow penetration, plausible values.

They reveal wrong units and unsupported loads. ``CHECKS_BEFORE`` and ``CHECKS_AFTER`` list one
function for each check: of a system before a run; of its states after it. Bodies and the meshes of
faces have checks of their own.
"""

import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fecontact.core.errors import ModelWarning, choices
from fecontact.core.magnitude import magnitude
from fecontact.core.types import Array
from fecontact.fem.chords import chords
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.finite_strain import LARGE_STRAIN
from fecontact.fem.mesh import Mesh
from fecontact.laws.base import FrictionLaw, NormalLaw
from fecontact.laws.excitation import AXES
from fecontact.laws.friction.stribeck import ConstantFriction
from fecontact.laws.normal.linear import PrescribedForce
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.columns import PENETRATION
from fecontact.system.contact_system import ContactSystem
from fecontact.system.loads import mean_load

# Penetration of a rough surface, in roughness heights, beyond which a wrong unit or stiffness is
# likely, since all asperities would be crushed.
DEEPEST = 100.0

# Rotation beyond which displacements are not linear in it [rad].
SMALL_ANGLE = 0.1

# Deflections beyond the fitted range of their forces, in this range.
FITTED = 1.05

# Plausible ranges: extents of bodies [m], Young's moduli [Pa], densities [kg/m^3]. Largest friction
# coefficient, roughness as a part of the body, speed of the ground [m/s], gap in extents of the
# body, and duration in periods of the fastest mode or excitation.
SIZES, MODULI, DENSITIES = (1e-4, 5.0), (1e6, 2e12), (1.0, 25000.0)
FRICTION, ROUGHNESS, SPEED, GAP, PERIODS = 2.0, 0.01, 100.0, 100.0, 1e6
# Most periods of drive, loads, ground and waves, or steps of max_step, in a run, which takes hours.
MOST_PERIODS = 1e9

# Distance of chords from their arc, in penetration scales, and part of a load, below which neither
# counts.
CHORD, HELD = 0.1, 1e-6

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
    """Model of a run: the system, the duration [s] and the initial state (2 m + n s,)."""

    system: ContactSystem
    duration: float
    state: Array

    @cached_property
    def extents(self) -> tuple[float, ...]:
        """Extents of the elastic bodies [m]; none for systems without shapes over a body."""
        shapes, parts = self.system.basis.mode_shapes, self.system.basis.parts
        if shapes is None:
            return ()
        spans = [part.nodes for part in parts if part.nodes[1]] or [(0, len(shapes.nodes))]
        return tuple(float(np.ptp(shapes.nodes[first : first + count], axis=0).max())
                     for first, count in spans)


def implausible_values(planned: Planned) -> tuple[str, ...]:
    """Messages about values that are possible, but more likely an error; usually none."""
    with np.errstate(all="ignore"):
        return tuple(sentence for check in CHECKS_BEFORE for sentence in check(planned))


def warn_of_limits(sentences: Iterable[str], what: str) -> None:
    """Issue a ModelWarning for each sentence, beginning with ``what``: 'In this run'."""
    for sentence in sentences:
        warnings.warn(f"{what} {sentence}", ModelWarning, stacklevel=3)


def _too_far(system: ContactSystem, times: Array, states: Array) -> str | None:
    basis = system.basis
    used = basis.moving_points
    places = basis.positions[used]
    if basis.mode_shapes is not None:
        places = np.vstack([places, basis.mode_shapes.nodes])
    size = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
    # Masses without positions have no size to compare with; a body may have no point that moves.
    if size == 0.0 or not used.any():
        return None
    d = basis.dimension
    rows = basis.T[used, :d].reshape(-1, basis.modes).T
    farthest = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for first in range(0, len(states), _BLOCK):
            moved = states[first : first + _BLOCK, : basis.modes] @ rows
            moved = moved.reshape(len(moved), -1, d)
            moved[..., : d - 1] -= moved[..., : d - 1].mean(axis=1, keepdims=True)
            scale = magnitude(moved)
            moved /= scale
            farthest = max(farthest, scale * float(np.sqrt((moved**2).sum(axis=-1)).max()))
    if farthest <= size:
        return None
    far = f"{farthest:.2g} m" if np.isfinite(farthest) else "more than 1e308 m"
    return (f"points of the body move by {far}, more than its own size of {size:.2g} m; "
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
    if (basis.parts or not len(rows) or basis.large_deflections
            or not np.ptp(basis.positions, axis=0).any()):
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


def _beyond_fit(system: ContactSystem, times: Array, states: Array) -> str | None:
    return beyond_fit(system.basis, states[:, : system.basis.modes])


def beyond_fit(basis: ModalBasis, coordinates: Array) -> str | None:
    """Message about coordinates (N, m) beyond the fitted range of their forces, or large strain."""
    for one in basis.large_deflections:
        with np.errstate(over="ignore", invalid="ignore"):
            reach = one.reach(coordinates)
        if reach > FITTED:
            return (f"a mode with large deflections is deflected by {reach:.3g} times the range in "
                    f"which its forces were fitted, up to {one.largest_displacement:.3g} m; make "
                    f"the basis with a larger largest_displacement.")
        # Bending grows in proportion to the deflection, stretching with its square.
        strain = reach * one.largest_strain
        if strain > LARGE_STRAIN:
            return (f"a mode with large deflections strains the body by up to {strain:.2g}; above "
                    f"{LARGE_STRAIN:g} metals yield and rubber has another law, so lower the "
                    f"loads.")
    return None


def implausible_bodies(bodies: Mapping[str, ElasticBody]) -> Iterator[str]:
    """Messages about size, material and thickness of bodies by name, "" for the only one."""
    for name, body in bodies.items():
        who = f"body '{name}'" if name else "the body"
        yield from implausible_body(who, body)
        size = float(np.ptp(body.mesh.nodes, axis=0).max())
        if body.dimension == 2 and body.plane == "stress" and body.thickness > size:
            yield (f"thickness = {body.thickness:.3g} m of {who} is more than its extent of "
                   f"{size:.3g} m; check its unit, or take plane = \"strain\".")


def implausible_size(who: str, mesh: Mesh) -> Iterator[str]:
    """Message about the extent of a mesh, of a body that it calls ``who``."""
    low, high = SIZES
    size = float(np.ptp(mesh.nodes, axis=0).max())
    if not low <= size <= high:
        yield (f"{who} has an extent of {size:.3g} m, not from {low:g} to {high:g} m; check "
               f"the unit of lengths, and give a mesh in mm the scale 1e-3.")


def implausible_body(who: str, body: ElasticBody) -> Iterator[str]:
    """Messages about the size and the materials of a body, which they call ``who``."""
    yield from implausible_size(who, body.mesh)
    for key, value, (least, most), unit in (
            check for material in body.materials for check in (
                *(("youngs_modulus", one, MODULI, "Pa") for one in material.youngs_moduli),
                ("density", material.density, DENSITIES, "kg/m3"))):
        if not least <= value <= most:
            yield (f"{who} has {key} = {value:.3g} {unit}, not from {least:g} to {most:g} {unit}; "
                   f"check its unit.")


def implausible_faces(
    bodies: Mapping[str, ElasticBody], faces: Mapping[str, tuple[str, ...]], system: ContactSystem
) -> Iterator[str]:
    """Messages about straight elements along curved contact faces, boundaries by body."""
    scale = system.penetration_scale
    for name, body in bodies.items():
        for face in faces.get(name, ()):
            # Plane faces that are paired are smoothed where edges meet at up to 30 degrees.
            smoothed = np.radians(30.0) if name and body.dimension == 2 else 0.0
            found = chords(body.mesh, face, smoothed)
            if found is None or found.error <= CHORD * scale:
                continue
            where = f"'{face}' of body '{name}'" if name else f"'{face}'"
            quadratic = ("although they are quadratic: their middle nodes lie on the chords"
                         if body.degree == 2 else "and successive ones meet at up to "
                         f"{np.degrees(found.angle):.2g} degrees")
            yield (f"{found.straight} elements along the curved boundary {where} are straight, "
                   f"{quadratic}; chords are up to {1e6 * found.error:.3g} um from the curve, an "
                   f"error of gaps that are measured from the mesh: refine it there, or give a "
                   f"mesh of second order whose middle nodes lie on the curve.")


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
    extents = planned.extents
    for *_, law in planned.system.law_groups("normal"):
        height = getattr(law, "roughness_height", None)
        if extents and height is not None and float(np.max(height)) > ROUGHNESS * min(extents):
            yield (f"roughness_height = {float(np.max(height)):.3g} m is more than a hundredth of "
                   f"the body's extent of {min(extents):.3g} m; check its unit.")


def _ground(planned: Planned) -> Iterator[str]:
    """Speed of the ground."""
    # Systems without shapes may have no dimensions.
    speed = planned.system.ground.speed
    if planned.extents and abs(speed) > SPEED:
        yield f"ground.speed = {speed:.3g} m/s is above {SPEED:g} m/s; check its unit."


def _damping(planned: Planned) -> Iterator[str]:
    """Damping ratios, which may be percent; those of Rayleigh damping may be large for some."""
    basis = planned.system.basis
    vibrating = basis.angular_frequencies > 0.0
    if planned.extents and vibrating.any():
        ratios = np.diag(basis.damping)[vibrating] / (2.0 * basis.angular_frequencies[vibrating])
        if (least := float(ratios.min())) > 1.01:
            yield (f"no mode vibrates, as all damping ratios are {least:.3g} or more; give 0.03 "
                   f"for 3 %.")


def _duration(planned: Planned) -> Iterator[str]:
    """Duration in periods of the fastest mode and of the fastest excitation."""
    system, duration = planned.system, planned.duration
    for what, highest, most, remedy in (
            ("mode", float(system.basis.frequencies_hz.max()), math.inf, "keep fewer modes"),
            ("of drive, loads, ground and waves", 1.0 / system.shortest_period(0.0, duration),
             MOST_PERIODS, "lower that frequency")):
        if PERIODS < duration * highest <= most:
            yield (f"the duration is {duration * highest:.2g} periods of the fastest {what}, "
                   f"{highest:.4g} Hz, which takes long; end it earlier, or {remedy}.")


def _unheld(planned: Planned) -> Iterator[str]:
    """Constant loads along a motion that neither stiffness, damping nor contacts resist."""
    system = planned.system
    arrays, basis = system.arrays, system.basis
    if not planned.extents or not basis.rigid_modes:
        return
    constant = mean_load(arrays, system.drive, system.load)
    if not constant.any() or not np.isfinite(constant).all():
        return
    free = _null_space(arrays.stiffness, arrays.damping)
    load = free.T @ constant
    if not free.shape[1] or np.linalg.norm(load) <= HELD * np.linalg.norm(constant):
        return
    open_below = _untouched(system) > -np.inf
    # Friction, springs and laws that may pull resist both ways along their rows.
    both = [arrays.rows[~open_below, 1]]
    for nodes, _, law in system.law_groups("friction"):
        if not _frictionless(law):
            both += list(arrays.rows[nodes, ::2].swapaxes(0, 1))
    held = np.concatenate(both) @ free
    slack = np.eye(free.shape[1]) - np.linalg.pinv(held, rcond=1e-9) @ held
    normals = _unit_rows(arrays.rows[open_below, 1] @ free) @ slack
    remaining = slack @ load
    from scipy.optimize import nnls

    if len(normals):
        # Contacts support the load if it is a sum of forces that press on them.
        pressed = -normals.T
        remaining = remaining - pressed @ nnls(pressed, remaining)[0]
    if np.linalg.norm(remaining) <= HELD * np.linalg.norm(load):
        return
    who, motion = named_motion(basis, free @ remaining)
    yield (f"nothing holds {who} against {motion}: no stiffness, contact or stop resists the "
           f"constant load there, under which it will fly off; check supports, and sign and place "
           f"of the loads.")


def unresisted_motion(system: ContactSystem) -> str | None:
    """A sentence about a rigid motion that nothing but friction resists; None if there is none.

    Stiffness, damping and normal forces that depend on the gap resist a motion.
    """
    arrays = system.arrays
    if not system.basis.rigid_modes:
        return None
    free = _null_space(arrays.stiffness, arrays.damping)
    rows = [arrays.rows[nodes, 1] for nodes, _, law in system.law_groups("normal")
            if not isinstance(law, PrescribedForce)]
    _, sizes, directions = np.linalg.svd(np.concatenate([*rows, np.zeros_like(free.T)]) @ free)
    left = free @ directions[sizes <= 1e-9 * max(1.0, sizes.max(initial=0.0))].T
    if not left.shape[1]:
        return None
    who, motion = named_motion(system.basis, left[:, 0])
    return (f"Nothing but friction resists {motion} of {who}; give it a support, a spring or a "
            f"damper.")


def _gap(planned: Planned) -> Iterator[str]:
    """Gaps that the body cannot close within the run, or that are far larger than it."""
    system, extents = planned.system, planned.extents
    gap = float(np.min(system.arrays.gap + _untouched(system), initial=np.inf))
    if not extents or not np.isfinite(gap) or gap <= system.penetration_scale:
        return
    reach = _reach(planned)
    if reach < gap:
        yield (f"no contact can close: the smallest gap is {gap:.3g} m, but under its loads from "
               f"this start the body moves by less than {_rounded_up(reach)} m; check gap, loads "
               f"and units.")
    elif gap > GAP * max(extents):
        yield (f"the smallest gap of {gap:.3g} m is more than {GAP:g} times the body's extent of "
               f"{max(extents):.3g} m, which will hardly touch; check its unit.")


def _reach(planned: Planned) -> float:
    """Bound on how far contact nodes approach the other side without contact forces [m]."""
    system, T = planned.system, planned.duration
    arrays, basis = system.arrays, system.basis
    stiffness = arrays.stiffness
    if not np.isfinite(stiffness).all() or np.abs(stiffness - stiffness.T).max() > (
            1e-9 * np.abs(stiffness).max()):
        return np.inf
    squares, shapes = np.linalg.eigh(stiffness)
    w = np.sqrt(np.maximum(squares, 0.0))
    w[w < 1e-6 * w.max(initial=0.0)] = 0.0
    damping = np.diag(shapes.T @ arrays.damping @ shapes)
    if (damping < 0.0).any() or np.abs(arrays.damping - arrays.damping.T).max() > (
            1e-9 * np.abs(arrays.damping).max()):
        return np.inf
    m = basis.modes
    q, v = shapes.T @ planned.state[:m], shapes.T @ planned.state[m : 2 * m]
    load = np.abs(shapes.T @ arrays.constant_load)
    springs = arrays.drive_stiffness[:, None] * arrays.drive_shapes
    dashpots = arrays.drive_damping[:, None] * arrays.drive_shapes
    varying = np.zeros(m)
    for row, dashpot, motion in zip(springs, dashpots, system.drive.motions, strict=False):
        if dashpot.any() and motion.largest:
            return np.inf
        varying += motion.largest * np.abs(row @ shapes)
    for row, signal in zip(arrays.load_shapes, system.load.signals.values(), strict=True):
        varying += signal.largest * np.abs(row @ shapes)
    elastic = w > 0.0
    safe = np.where(elastic, w, 1.0)
    # Largest displacement of a damped oscillator under a constant and a bounded force.
    lasting = np.minimum(T, np.divide(2.0, damping, out=np.full(m, np.inf), where=damping > 0.0))
    largest = np.where(
        elastic, np.abs(q) + (np.abs(v) + varying * lasting) / safe + 2.0 * load / safe**2,
        np.abs(q) + np.abs(v) * T + 0.5 * (varying + load) * T**2)
    low, high = system.ground.height_range
    reach = float((np.abs(arrays.rows[:, 1] @ shapes) @ largest).max() + max(abs(low), abs(high)))
    return reach if np.isfinite(reach) else np.inf


def _rounded_up(value: float) -> str:
    """Two digits of a number, rounded up."""
    if value <= 0.0:
        return "1e-15"
    unit = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return f"{np.ceil(value / unit) * unit:.2g}"


def _untouched(system: ContactSystem) -> Array:
    """Penetration (n,) below which normal laws have no force; -inf where they may pull."""
    return np.concatenate([law.untouched(nodes.stop - nodes.start)
                           for nodes, _, law in system.law_groups("normal")])


def _frictionless(law: FrictionLaw) -> bool:
    return isinstance(law, ConstantFriction) and not np.any(
        np.add(law.friction_coefficient, law.viscous_coefficient))


def _null_space(stiffness: Array, damping: Array) -> Array:
    """Orthonormal motions (m, k) that neither stiffness nor damping resists."""
    scale = np.abs(np.diag(stiffness)).max(initial=0.0), np.abs(np.diag(damping)).max(initial=0.0)
    resisted = [matrix / largest for matrix, largest in zip((stiffness, damping), scale,
                                                            strict=True) if largest > 0.0]
    if not resisted:
        return np.eye(len(stiffness))
    _, sizes, rows = np.linalg.svd(np.concatenate(resisted))
    return np.asarray(rows[sizes <= 1e-12].T)


def _unit_rows(rows: Array) -> Array:
    length = np.linalg.norm(rows, axis=1)
    return np.asarray(rows[length > 0.0] / length[length > 0.0, None])


def named_motion(basis: ModalBasis, direction: Array) -> tuple[str, str]:
    """Moving body and kind of motion along modal coordinates (m,): 'the body', 'a rotation'."""
    d = basis.dimension
    if not basis.parts:
        rows = basis.contact_T if basis.contact_nodes else basis.T
        largest = np.abs(rows @ direction).max(axis=0)
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
    _friction, _roughness, _ground, _damping, _duration, _unheld, _gap)
CHECKS_AFTER: tuple[Callable[[ContactSystem, Array, Array], str | None], ...] = (
    _too_far, _turned, _too_deep, _beyond_fit)
