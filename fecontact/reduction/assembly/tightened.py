"""Bolts that are tightened by a force and then hold their length.

While a bolt is tightened, its force F acts on the control point of its section, whose displacement
x is the shortening s; or a pair of forces acts on the reference points of its thread and its nut,
and s is their relative displacement. Afterwards a stiff spring holds the shortening s_0 that has
been reached: with the stiffness c the force in the bolt is ``F - c (s - s_0)``, and s stays s_0 as
c grows.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import (
    InputError,
    choices,
    require_finite,
    require_positive,
    shown,
)
from fecontact.core.types import Array, ArrayLike
from fecontact.reduction.assembly.links import Spring, linked
from fecontact.reduction.modal_basis import ModalBasis

# Control point of a section; or two points and the component x, y or z in which a pair of forces,
# positive on the first, moves them apart.
Bolt = str | tuple[str, str, str]

# Stiffness of a spring that holds a bolt, over that of the body against its shortening.
_STIFF = 1e4


@dataclass(frozen=True, eq=False)
class TightenedBolts:
    """A basis with bolts that hold their length.

    Attributes
    ----------
    basis : ModalBasis
        Basis with the springs that hold the bolts, and their forces as ``constant_load``.
    tension : mapping of bolt to float
        Force of each bolt when it was tightened [N].
    shortening : mapping of bolt to float
        s_0 of each bolt [m].
    stiffness : mapping of bolt to float
        c of each spring [N/m].
    """

    basis: ModalBasis
    tension: Mapping[Bolt, float]
    shortening: Mapping[Bolt, float]
    stiffness: Mapping[Bolt, float]

    def forces(self, coordinates: ArrayLike) -> dict[Bolt, float]:
        """Tension of each bolt [N] at modal coordinates (m,) of ``basis``."""
        q = as_floats(coordinates, "The modal coordinates")
        if q.shape != (self.basis.modes,):
            raise InputError(f"The modal coordinates must have shape ({self.basis.modes},), not "
                             f"{q.shape}.")
        return {bolt: force - self.stiffness[bolt] * (
            float(_row(self.basis, bolt) @ q) - self.shortening[bolt])
            for bolt, force in self.tension.items()}


def tightened(
    basis: ModalBasis, coordinates: ArrayLike, forces: Mapping[Bolt, float], *,
    stiffness: float | None = None,
) -> TightenedBolts:
    """Bolts held at the length to which forces have tightened them.

    For example ``tightened(system.basis, equilibrium(system).modal_coordinates, {"bolt": 12e3})``
    with the load ``PointLoad("bolt", "x", signal=12e3)`` in ``system``; the system afterwards has
    the new basis, and no such load. Loads that come after it change the force in the bolt as far
    as the stiffness of the joint and of the bolt want it.

    Parameters
    ----------
    basis : ModalBasis
        Basis whose points are the control points of sections, see
        :func:`fecontact.fem.with_pretension`; with residual vectors of their forces (``loads``).
    coordinates : (m,) array
        Modal coordinates of the tightened state.
    forces : mapping of bolt to float
        Tension of each bolt in this state [N]. A bolt is the name of its control point, or
        (first, second, component) of two points that a pair of forces, +F on the first, tightens.
    stiffness : float, optional
        c of the springs that hold the bolts [N/m]; by default 10,000 times the stiffness of the
        body against the shortening.

    Raises
    ------
    InputError
        For unknown points, points that do not move in x, and another number of coordinates.
    """
    require_kind("tightened", ModalBasis, basis=basis)
    require_kind("tightened", Mapping, forces=forces)
    q = as_floats(coordinates, "tightened: coordinates")
    if q.shape != (basis.modes,):
        raise InputError(f"tightened: coordinates must have shape ({basis.modes},), not {q.shape}.")
    if stiffness is not None:
        require_positive("tightened", stiffness=stiffness)
    require_finite("tightened", **{f"forces of {bolt}": force for bolt, force in forces.items()})
    c: dict[Bolt, float] = {}
    s: dict[Bolt, float] = {}
    springs = []
    for bolt, force in forces.items():
        row = _row(basis, bolt)
        c[bolt] = _STIFF / _compliance(basis, row, bolt) if stiffness is None else float(stiffness)
        s[bolt] = float(row @ q)
        first, second, axis = (bolt, None, "x") if isinstance(bolt, str) else bolt
        along = np.eye(basis.dimension)["xyz".index(axis)]
        springs.append(Spring(first, second, c[bolt], direction=tuple(along.tolist()),
                              shortening=-s[bolt] - force / c[bolt]))
    return TightenedBolts(linked(basis, springs), dict(forces), s, c)


def _row(basis: ModalBasis, bolt: Bolt) -> Array:
    """Row (m,) of the shortening of a bolt."""
    if isinstance(bolt, str):
        return basis.point_row(bolt, "x")
    if not isinstance(bolt, tuple) or len(bolt) != 3 or bolt[2] not in basis.components[
            : basis.dimension]:
        raise InputError(f"tightened: the bolt {shown(bolt)} must be the name of a control point, "
                         f"or (first, second, component) with the component "
                         f"{choices(basis.components[: basis.dimension])}.")
    first, second, axis = bolt
    return basis.point_row(first, axis) - basis.point_row(second, axis)


def _compliance(basis: ModalBasis, row: Array, bolt: Bolt) -> float:
    """Elastic displacement along a row per unit force; InputError if it is zero."""
    w = basis.angular_frequencies
    found = float(((row[w > 0.0] / w[w > 0.0]) ** 2).sum())
    if not found > 0.0:
        raise InputError(f"tightened: {shown(bolt)} moves in no elastic mode along the bolt; name "
                         f"the control point of a section, and give it in loads of the basis.")
    return found
