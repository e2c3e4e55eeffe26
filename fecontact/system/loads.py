"""Loads of a system as modal forces."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array
from fecontact.core.units import listed, quantity
from fecontact.laws.base import NormalLaw
from fecontact.laws.excitation import (
    AXES,
    BOUNDARY_STRESSES,
    Drive,
    Load,
)
from fecontact.laws.normal.linear import PrescribedForce
from fecontact.laws.signals.base import Signal
from fecontact.laws.signals.harmonic import Constant
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.nodes import SystemArrays


@dataclass(frozen=True)
class ActingLoad:
    """A part of the load: the modal forces ``value row``.

    Attributes
    ----------
    what : str
        Name of the load for messages.
    row : (m,) array
    value : float or Signal
    still : str
        Motion that no mode has if the row is zero, as a clause of the error message.
    """

    what: str
    row: Array
    value: float | Signal
    still: str


def acting_loads(basis: ModalBasis, load: Load) -> Iterator[ActingLoad]:
    """Parts of a load that are not zero; those in time in the order of ``load.signals``.

    InputError for points or boundaries that the basis does not have, gravity or base acceleration
    with a basis without rows of inertia, and places outside the body or for a basis without shapes.
    """
    if basis.constant_load is not None:
        yield ActingLoad("the preload of links or the temperature", basis.constant_load, 1.0,
                         "they hold, or the body is held")
    yield from load_parts(load, basis.components, partial(_point_rows, basis),
                          partial(_inertia, basis), basis.boundary_row)


def load_parts(
    load: Load, components: tuple[str, ...], point_rows: Callable[[Any], Array],
    inertia: Callable[[str], Array], boundary_rows: Callable[[str], Array],
) -> Iterator[ActingLoad]:
    """Parts of a load that are not zero, by what gives their rows.

    ``point_rows`` gives the rows of the displacement ``components`` of a point, ``inertia`` those
    of unit accelerations along the axes for a load of some name, ``boundary_rows`` those of unit
    stresses on a boundary.
    """
    d = 2 if len(components) == 3 else 3
    if load.normal:
        yield ActingLoad(f"normal = {load.normal!r}", point_rows("C")[d - 1], -load.normal,
                         f"'C' moves along {AXES[d - 1]}")
    if load.gravity is not None and len(load.gravity) != d:
        raise InputError(f"Load: gravity = {load.gravity} must have {d} components, as the body "
                         f"is {'plane' if d == 2 else 'a solid'}.")
    for axis, g in enumerate(load.gravity or ()):
        if g:
            what = f"gravity = {load.gravity}"
            yield ActingLoad(what, inertia(what)[axis], g, f"the body moves along {AXES[axis]}")
    for force in load.forces:
        if not force.suits(components):
            raise InputError(f"Load: a force at {force.point!r} has the component "
                             f"{force.component!r}, but points of this body have "
                             f"{choices(components)}.")
        turn = "turns" if force.moment else f"moves along {force.along}"
        yield ActingLoad(f"a force at {force.point!r} with component {force.component!r}",
                         force.row(point_rows(force.point), components),
                         force.signal, f"{force.point!r} {turn}")
    for axis, signal in enumerate(load.base_accelerations):
        if signal is not None:
            what = f"base_acceleration_{AXES[axis]}"
            if axis >= d:
                raise InputError(f"Load: {what} acts on solids only, but the body is plane.")
            yield ActingLoad(what, -inertia(what)[axis], signal,
                             f"the body moves along {AXES[axis]}")
    for one in load.boundaries:
        rows = boundary_rows(one.boundary)
        for index, name in enumerate(BOUNDARY_STRESSES):
            value = getattr(one, name)
            if isinstance(value, Signal) or value:
                if index >= d:
                    raise InputError(f"Load: {name} on '{one.boundary}' acts on solids only, but "
                                     f"the body is plane.")
                yield ActingLoad(f"{name} on '{one.boundary}'", rows[index], value,
                                 f"'{one.boundary}' moves along with it")


def load_rows(basis: ModalBasis, load: Load) -> tuple[Array, Array]:
    """Constant modal forces (m,), and those (k, m) of unit values of ``load.signals``."""
    constant, in_time = np.zeros(basis.modes), []
    for part in acting_loads(basis, load):
        if isinstance(part.value, Signal):
            in_time.append(part.row)
        else:
            constant = constant + part.value * part.row
    return constant, np.array(in_time, dtype=float).reshape(-1, basis.modes)


def mean_load(arrays: SystemArrays, drive: Drive, load: Load) -> Array:
    """Modal forces (m,) of constant loads and of springs with constant driven ends.

    Other signals are taken to have zero mean.
    """
    found = arrays.constant_load.copy()
    springs = arrays.drive_stiffness[:, None] * arrays.drive_shapes
    given = [*zip(springs, drive.motions[: len(springs)], strict=True),
             *zip(arrays.load_shapes, load.signals.values(), strict=True)]
    for shape, source in given:
        if isinstance(source, Constant):
            found += source.value * shape
    return found


def under_constant(arrays: SystemArrays, load: Array) -> SystemArrays:
    """Arrays of a system under constant modal forces (m,) alone."""
    return arrays._replace(constant_load=load, drive_shapes=np.zeros_like(arrays.drive_shapes),
                           load_shapes=np.zeros_like(arrays.load_shapes))


def work_of_loads(basis: ModalBasis, load: Load, depth: float) -> float:
    """Magnitude of the work of the constant loads when the body moves by a small depth [J]."""
    constant, _ = load_rows(basis, replace(load, normal=0.0))
    largest = np.abs(basis.T[:, : basis.dimension]).max(axis=(0, 1))
    moved = np.divide(depth, largest, out=np.zeros(basis.modes), where=largest > 0.0)
    return float(abs(load.normal) * depth + np.abs(constant) @ moved)


# Forces count as at most the first and at least the second in scales of tolerances [N].
_LARGEST_FORCE, _LEAST_FORCE = 1.0, 1e-9


def force_scale(basis: ModalBasis, drive: Drive, load: Load,
                laws: Iterable[tuple[slice, Array, NormalLaw]]) -> float:
    """Scale of the forces on a body for tolerances, 1 N or below [N].

    It is the sum of the magnitudes of its loads, of what springs of the drive pull at the largest
    drive displacements, and of prescribed normal forces; 1 N if there are none.
    """
    largest = np.abs(basis.T[:, : basis.dimension]).max(axis=(0, 1))
    total = sum(float(np.sum(law.force)) for _, _, law in laws if isinstance(law, PrescribedForce))
    total += sum(c * motion.largest for c, motion in
                 zip(drive.stiffness, drive.motions, strict=True))
    for part in acting_loads(basis, load):
        value = part.value.largest if isinstance(part.value, Signal) else abs(part.value)
        row = np.divide(part.row, largest, out=np.zeros(basis.modes), where=largest > 0.0)
        total += value * float(np.linalg.norm(row))
    if not total > 0.0:
        return _LARGEST_FORCE
    return float(np.clip(total, _LEAST_FORCE, _LARGEST_FORCE))


def require_motion(basis: ModalBasis, drive: Drive, load: Load) -> None:
    """Raise InputError for a drive or load in a direction in which no mode moves its point."""
    for axis, name in enumerate(AXES[: basis.dimension]):
        for part, values in (("stiffness", drive.stiffness), ("damping", drive.damping)):
            if values[axis] and not basis.T[0, axis].any():
                raise _without_effect(f"Drive: {part}_{name} = {values[axis]!r}",
                                      f"'B' moves along {name}")
    for acting in acting_loads(basis, load):
        if not acting.row.any():
            raise _without_effect(f"Load: {acting.what}", acting.still)


def _without_effect(what: str, still: str) -> InputError:
    return InputError(f"{what} has no effect, as {still} in no mode of the basis; leave it out, or "
                      f"give the basis a point that moves so: points B and C are keys of [basis] "
                      f"in a study, arguments of modal_basis, rows of basis_from_matrices.")


def load_summary(load: Load) -> str:
    """Constant forces and the number of loads in time, for people."""
    parts = [quantity(load.normal, "N")]
    if load.gravity is not None:
        parts.append(f"gravity ({', '.join(f'{g:.4g}' for g in load.gravity)}) m/s²")
    if load.boundaries:
        parts.append(f"on {listed([one.boundary for one in load.boundaries])}")
    if load.signals:
        parts.append(f"{len(load.signals)} in time")
    return ", ".join(parts)


def _inertia(basis: ModalBasis, what: str) -> Array:
    if basis.rotation is not None and not basis.rotation.standing:
        raise InputError(f"Load: {what} cannot act on a body that rotates: its direction would "
                         f"turn in the frame of the body; give forces at points instead.")
    if basis.inertia_rows is None:
        raise InputError(f"Load: {what} needs the inertia of the body, but the basis has no "
                         f"inertia_rows; make it from a body, or give translations with its "
                         f"mass matrix.")
    return basis.inertia_rows


def _point_rows(basis: ModalBasis, point: str | int | tuple[float, ...]) -> Array:
    """Rows (3, m), in space (6, m), of a named point, a contact node or a place."""
    if not isinstance(point, tuple):
        return np.asarray(basis.T[basis.point_index(point)])
    if basis.mode_shapes is None:
        raise InputError(f"Load: a force at {point} needs shapes over the body, which the basis "
                         f"does not hold; use a named point.")
    return basis.mode_shapes.rows_at(point, "Load: a force")
