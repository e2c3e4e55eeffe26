"""Static states of a body with large deflections under loads in proportion to the inertia of modes.

Coordinates and loads are in units of equal energy, one where the first chosen mode alone has the
largest displacement; displacements are in units of this one.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array, Integers
from fecontact.fem.body_forces import inertia_forces
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.fields import stress_of
from fecontact.fem.finite_strain import FiniteStrainModel
from fecontact.fem.load_steps import DeflectionSteps, FreeMotion, follow
from fecontact.reduction.eigenmodes import FreeSystem


@dataclass(frozen=True, eq=False)
class Samples:
    """States of equilibrium under loads on d modes.

    Attributes
    ----------
    q, loads : (n, d) arrays
        Coordinates of the modes, and their loads.
    rest : (n, f) array
        Free displacements that are not those of the modes.
    stress : (n, N c) array
        Stress at the nodes that is not linear in the coordinates [Pa].
    largest_stress, strain : float
        Largest component of the whole stress [Pa], and of the strain.
    """

    q: Array
    loads: Array
    rest: Array
    stress: Array
    largest_stress: float
    strain: float


@dataclass(frozen=True, eq=False)
class _Path:
    """States on one path: free displacements (n, f), loads (n, m), stress (n, N c), strain."""

    u: Array
    loads: Array
    stress: Array
    strain: float


class LoadedStates:
    """Paths of equilibrium of a body under loads on its modes.

    Parameters
    ----------
    body : ElasticBody
        The body. If nothing holds it, its states have no part of rigid modes.
    system : FreeSystem
        Equations of the free unknowns.
    w, shapes : (m,) and (f, m) arrays
        Angular frequencies [rad/s] and free shapes of its modes.
    first : int
        Mode whose displacement is ``size``.
    size : float
        Largest displacement [m].
    geometric : sparse (d N, d N) array, optional
        Geometric stiffness of a stress in the body.
    """

    def __init__(
        self, body: ElasticBody, system: FreeSystem, w: Array, shapes: Array, first: int,
        size: float, geometric: Any = None,
    ) -> None:
        self.model, self.shapes, self.size = FiniteStrainModel(body, geometric), shapes, size
        self.system = system
        self.inertia = np.asarray(system.mass @ shapes)
        whole = np.asarray(body.expansion @ shapes)
        moved = whole.reshape(-1, body.dimension, len(w))
        self.reach = np.linalg.norm(moved, axis=1).max(axis=0)
        self.unit = size / self.reach[first] * w[first] / np.where(w > 0.0, w, w[first])
        self.force = w**2 * self.unit
        self.energy = float(self.force[first] * self.unit[first])
        self.linear_stress = stress_of(body, whole).reshape(-1, len(w))
        more = self.model.expansion.shape[1] - len(shapes)
        self.free = None if not system.rigid.shape[1] else FreeMotion(*(
            np.pad(one, ((0, more), (0, 0))) for one in (system.rigid, system.inertia)))
        self._paths: dict[tuple[object, ...], _Path] = {}

    def samples(
        self, modes: Integers, loads: list[Array], step: float, further: Array | None = None
    ) -> Samples:
        """States under loads (d,) on modes (d,) and their multiples, ``step`` of arc apart.

        ``further`` are forces (f,) beside the loads, whose absolute values have the sum one.
        """
        paths = [self._path(modes, load, step) if further is None else
                 self._followed(modes, load / np.abs(load).sum(), step, further) for load in loads]
        u = np.concatenate([one.u for one in paths])
        q = u @ self.inertia[:, modes]
        stress = np.concatenate([one.stress for one in paths])
        return Samples(
            q / self.unit[modes], np.concatenate([one.loads for one in paths])[:, modes],
            (u - q @ self.shapes[:, modes].T) / self.size,
            stress - q @ self.linear_stress[:, modes].T, float(np.abs(stress).max()),
            max(one.strain for one in paths))

    def _path(self, modes: Integers, load: Array, step: float) -> _Path:
        """States up to the largest displacement; those of known loads are not computed again."""
        key = (step, *((int(mode), float(one)) for mode, one in zip(modes, load, strict=True)
                       if one))
        if key not in self._paths:
            self._paths[key] = self._followed(modes, load / np.abs(load).sum(), step)
        return self._paths[key]

    def other_load(self, modes: Integers, share: float) -> tuple[Array, Array]:
        """Forces (f,) that leave modes (d,) alone, and the linear displacement (f,) under them.

        Those of a uniform acceleration along the most compliant axis, of a body that nothing holds
        of one that grows with the square of its longest coordinate, without their part on the
        modes, with a ``share`` of the energy that the first of the modes has at the coordinate one.
        """
        body = self.model.body
        accelerations = inertia_forces(body)
        rigid, inertia = self.system.rigid, self.system.inertia
        if rigid.shape[1]:
            away = body.nodes - body.nodes.mean(axis=0)
            square = away[:, np.ptp(away, axis=0).argmax()] ** 2
            accelerations = accelerations * np.repeat(square, body.dimension)[:, None]
        forces = np.asarray(body.expansion.T @ accelerations)
        forces = forces - self.inertia[:, modes] @ (self.shapes[:, modes].T @ forces)
        forces = forces - inertia @ (rigid.T @ forces)
        moved = self.system.deflection(forces)
        energies = (forces * moved).sum(axis=0)
        axis = int(energies.argmax())
        scale = np.sqrt(share * self.energy / energies[axis])
        return scale * forces[:, axis], scale * moved[:, axis]

    def _followed(
        self, modes: Integers, direction: Array, step: float, further: Array | None = None
    ) -> _Path:
        free, unit = len(self.shapes), self.unit[modes]
        forces = np.zeros(self.model.expansion.shape[1])
        inertia = self.inertia[:, modes]
        forces[:free] = inertia @ (self.force[modes] * direction)
        if further is not None:
            forces[:free] += further

        def far(q: Array) -> bool:
            return bool(np.abs(inertia.T @ q[:free] / unit).sum() >= 1.0)

        options = DeflectionSteps("arc", first=step, largest=step, most=400)
        found = follow(self.model, lambda q: (forces, None), options, far, self.free)
        if not found.reached:
            raise AnalysisError(f"large_deflections: the statics under the loads of the modes do "
                                f"not reach largest_displacement = {self.size:g} m. "
                                f"{found.message} Take a smaller one.")
        points = found.points[1:]
        unknowns = np.array([one.q for one in points])
        loads = np.zeros((len(points), len(self.unit)))
        loads[:, modes] = np.array([one.factor for one in points])[:, None] * direction
        return _Path(unknowns[:, :free], loads,
                     self.model.stress(unknowns.T).reshape(-1, len(points)).T,
                     max(one.state.strain for one in points))
