"""Friction between half-spaces under a constant normal load: stick, slip and loss along a path."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_count, as_floats, require_kind
from fecontact.core.errors import AnalysisError, InputError, require_positive
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike
from fecontact.core.units import Summarised, count, quantity
from fecontact.half_space.influence import ACROSS, ALONG, CROSS, DIRECT, Convolution
from fecontact.half_space.normal_contact import HalfSpaceContact

_STICKS = 1.0 - 1e-6  # part of the limit below which a pixel sticks


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class HalfSpaceFriction(Summarised):
    """Tangential tractions of two half-spaces at K points of a path.

    Attributes
    ----------
    contact : HalfSpaceContact
        Pressures, which stay as they are.
    coefficient : float
        Coefficient of friction mu.
    traction : (K, N, M, 2) array
        Tractions along x and y that carry the other body along, at most mu p [Pa].
    slip : (K, N, M, 2) array
        Distance slid since the start, where the surfaces touch [m].
    displacement : (K, 2) array
        Rigid tangential displacement of the bodies against each other [m].
    loss : (K,) array
        Work of friction since the start [J].
    """

    contact: HalfSpaceContact
    coefficient: float
    traction: Array
    slip: Array
    displacement: Array
    loss: Array

    @property
    def force(self) -> Array:
        """Tangential forces (K, 2) [N]."""
        return np.asarray(self.traction.sum(axis=(1, 2)) * self.contact.pixel_area)

    @property
    def sticking(self) -> NDArray[np.bool_]:
        """Pixels (K, N, M) in contact whose traction is below the limit."""
        limit = self.coefficient * self.contact.pressure
        size = np.linalg.norm(self.traction, axis=-1)
        return np.asarray(self.contact.touching & (size < _STICKS * limit))

    def summary(self) -> list[tuple[str, str]]:
        """Points, last force and displacement, sticking part of the contact, loss."""
        part = self.sticking[-1].sum() / max(int(self.contact.touching.sum()), 1)
        return [("path", count(len(self.loss), "point")),
                ("tangential force", quantity(float(np.linalg.norm(self.force[-1])), "N")),
                ("displacement", quantity(float(np.linalg.norm(self.displacement[-1])), "m")),
                ("sticking", f"{100.0 * float(part):.4g} % of the contact"),
                ("loss", quantity(float(self.loss[-1]), "J"))]


def half_space_friction(
    contact: HalfSpaceContact, coefficient: float, *, forces: ArrayLike | None = None,
    displacements: ArrayLike | None = None, rtol: float = 1e-6, max_iterations: int = 5000,
) -> HalfSpaceFriction:
    r"""Coulomb friction of two half-spaces along a path of tangential forces or displacements.

    The pressures p stay those of the contact without friction (Goodman, exact for equal
    materials). Between two points of the path the tractions q minimise

    .. math:: \tfrac12\, q^T K q - q^T (d - s), \qquad |q| \le \mu p

    with the tangential compliance K (Cerruti), the displacement d of the bodies and the distance s
    slid before, so that slip goes along the traction (Panagiotopoulos, 1975; spectral projected
    gradients). Steps that turn should be small: slip is straight within each.

    Parameters
    ----------
    contact : HalfSpaceContact
        Pressures of :func:`fecontact.half_space.half_space_contact`.
    coefficient : float
        Coefficient of friction mu, positive.
    forces : (K, 2) array
        Path of tangential forces along x and y, each below mu times the normal force [N].
    displacements : (K, 2) array
        In place of the forces: path of the rigid displacement of the bodies [m].
    rtol : float
        Largest error of a traction, relative to the largest limit.
    max_iterations : int
        Largest number of steps for each point of the path.

    Raises
    ------
    InputError
        For values out of range, both or none of forces and displacements.
    AnalysisError
        If the steps do not suffice.
    """
    owner = "half_space_friction"
    require_kind(owner, HalfSpaceContact, contact=contact)
    require_positive(owner, coefficient=coefficient, rtol=rtol)
    as_count(max_iterations, f"{owner}: max_iterations")
    if (forces is None) == (displacements is None):
        raise InputError(f"{owner}: give either forces [N] or displacements [m].")
    name = "forces" if displacements is None else "displacements"
    path = as_floats(forces if displacements is None else displacements, f"{owner}: {name}")
    if path.ndim != 2 or path.shape[1] != 2 or not len(path) or not np.isfinite(path).all():
        raise InputError(f"{owner}: {name} of shape {path.shape} must be a path (K, 2) of finite "
                         f"numbers along x and y.")
    if contact.periodic and displacements is not None:
        raise InputError(f"{owner}: the displacement of a periodic surface has no reference; give "
                         f"forces.")
    most = coefficient * contact.force
    largest = float(np.linalg.norm(path, axis=1).max())
    if forces is not None and largest >= most:
        raise InputError(f"{owner}: forces of up to {largest:g} N must be below {most:g} N, "
                         f"coefficient times normal force, beyond which everything slides; "
                         f"prescribe displacements instead.")
    problem = _Increments(contact, coefficient, forces is not None, rtol, max_iterations)
    found = [problem.advance(goal) for goal in path]
    force, slip, displacement, loss = (np.array(one) for one in zip(*found, strict=True))
    return HalfSpaceFriction(contact, float(coefficient), force / contact.pixel_area, slip,
                             displacement, loss)


class _Increments:
    """Solution of one increment after the other; forces (N, M, 2) of the pixels are its state."""

    def __init__(self, contact: HalfSpaceContact, coefficient: float, by_force: bool, rtol: float,
                 most: int) -> None:
        given = contact.compliance
        direct, along = given.direct / np.pi, given.along / np.pi
        shape, sides = contact.pressure.shape, contact.sides
        self._kernels = [
            Convolution(terms, (shape[0], shape[1]), sides, contact.periodic) for terms in (
                [(direct, DIRECT), (along, ALONG)], [(along, CROSS)],
                [(direct, DIRECT), (along, ACROSS)])]
        self._touching = contact.touching
        self._limit = coefficient * contact.pressure * contact.pixel_area
        self._by_force, self._rtol, self._most = by_force, rtol, most
        unit = np.zeros((*shape, 2))
        unit[0, 0, 0] = 1.0
        self._length = 1.0 / float(self._compliance(unit)[0, 0, 0])
        self._force, self._slip = np.zeros((*shape, 2)), np.zeros((*shape, 2))
        self._loss = 0.0

    def _compliance(self, forces: Array) -> Array:
        xx, xy, yy = self._kernels
        x, y = forces[..., 0], forces[..., 1]
        return np.stack([xx(x) + xy(y), xy(x) + yy(y)], axis=-1)

    def advance(self, goal: Array) -> tuple[Array, Array, Array, float]:
        """Forces, slip, displacement and loss at the next point of the path."""
        q = self._project(self._force, goal)
        moved = self._compliance(q)
        target, length = goal, self._length
        for _ in range(self._most):
            gradient = moved + self._slip
            if self._by_force:
                # The displacement at which the pixels that stick have no slip on average.
                stuck = self._touching & (np.linalg.norm(q, axis=-1) < _STICKS * self._limit)
                if not stuck.any():
                    raise AnalysisError(
                        f"half_space_friction: forces = {np.linalg.norm(goal):g} N are so close "
                        f"to sliding, {float(self._limit.sum()):g} N, that no pixel sticks; take "
                        f"smaller forces, a finer grid, or give displacements.")
                target = gradient[stuck].mean(axis=0)
            gradient = gradient - target
            step = self._project(q - length * gradient, goal) - q
            if float(np.abs(step).max()) <= self._rtol * float(self._limit.max()) * max(
                    length / self._length, 1.0):
                break
            response = self._compliance(step)
            bend = float((step * response).sum())
            part = min(1.0, -float((gradient * step).sum()) / bend)
            q, moved = q + part * step, moved + part * response
            length = float((step * step).sum()) / bend
        else:
            raise AnalysisError(f"half_space_friction: the tractions did not converge in "
                                f"{self._most} steps; allow more by max_iterations, or a larger "
                                f"rtol.")
        slip = np.where(self._touching[..., None], target - moved, 0.0)
        sticks = np.linalg.norm(q, axis=-1) < _STICKS * self._limit
        slip[sticks] = self._slip[sticks]
        self._loss += float((q * (slip - self._slip)).sum())
        self._force, self._slip = q, slip
        return q, slip, target, self._loss

    def _project(self, q: Array, goal: Array) -> Array:
        """Nearest forces within the limits; of sum ``goal`` where forces are given."""
        found = np.zeros(q.shape)
        given, limit = q[self._touching], self._limit[self._touching]
        if self._by_force:
            given = given + _common_shift(given, limit, goal)
        size = np.linalg.norm(given, axis=-1)
        found[self._touching] = given * np.minimum(1.0, limit / np.maximum(size, 1e-300))[:, None]
        return found


def _common_shift(q: Array, limit: Array, goal: Array) -> Array:
    """Shift (2,) of vectors (k, 2) after which those cut to their limits have the sum ``goal``.

    It minimises the convex ``sum m(q + shift) - goal . shift``, where m is half the square of a
    vector and linear beyond its limit, by Newton's method with halved steps.
    """
    shift = np.zeros(2)

    def evaluated(shift: Array) -> tuple[float, Array, Array]:
        moved = q + shift
        size = np.maximum(np.linalg.norm(moved, axis=-1), 1e-300)
        cut = np.minimum(size, limit)
        ratio = cut / size
        beyond = np.where(size > limit, ratio, 0.0)
        normal = moved / size[:, None]
        slope = np.eye(2) * ratio.sum() - np.einsum("i,ia,ib->ab", beyond, normal, normal)
        value = float((cut * (size - 0.5 * cut)).sum() - goal @ shift)
        return value, goal - (moved * ratio[:, None]).sum(axis=0), slope

    value, lacks, slope = evaluated(shift)
    for _ in range(100):
        if float(np.abs(lacks).max()) <= 1e-12 * float(limit.sum()):
            break
        step = np.linalg.solve(slope + 1e-9 * np.trace(slope) * np.eye(2), lacks)
        part = 1.0
        while part > 1e-9:
            tried = evaluated(shift + part * step)
            if tried[0] <= value - 1e-4 * part * float(step @ lacks) or np.abs(tried[1]).max() < (
                    0.5 * np.abs(lacks).max()):
                break
            part *= 0.5
        shift = shift + part * step
        value, lacks, slope = tried
    return shift
