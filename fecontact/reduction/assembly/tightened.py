"""Bolts that are tightened by a force and then hold their length.

While a bolt is tightened, its force F acts on the control point of its section, whose displacement
x is the shortening s. Afterwards a stiff spring holds the shortening s_0 that has been reached:
with the stiffness c the force in the bolt is ``F - c (s - s_0)``, and s stays s_0 as c grows.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, require_finite, require_positive
from fecontact.core.types import Array, ArrayLike
from fecontact.reduction.assembly.links import Spring, linked
from fecontact.reduction.modal_basis import ModalBasis

# Stiffness of a spring that holds a bolt, over that of the body against its shortening.
_STIFF = 1e4


@dataclass(frozen=True, eq=False)
class TightenedBolts:
    """A basis with bolts that hold their length.

    Attributes
    ----------
    basis : ModalBasis
        With the springs that hold the bolts, and their forces as ``link_load``.
    tension : mapping of name to float
        Force of each bolt when it was tightened [N].
    shortening : mapping of name to float
        s_0 of each bolt [m].
    stiffness : mapping of name to float
        c of each spring [N/m].
    """

    basis: ModalBasis
    tension: Mapping[str, float]
    shortening: Mapping[str, float]
    stiffness: Mapping[str, float]

    def forces(self, coordinates: ArrayLike) -> dict[str, float]:
        """Tension of each bolt [N] at modal coordinates (m,) of ``basis``."""
        q = as_floats(coordinates, "The modal coordinates")
        if q.shape != (self.basis.modes,):
            raise InputError(f"The modal coordinates must have shape ({self.basis.modes},), not "
                             f"{q.shape}.")
        return {name: force - self.stiffness[name] * (
            float(self.basis.point_row(name, "x") @ q) - self.shortening[name])
            for name, force in self.tension.items()}


def tightened(
    basis: ModalBasis, coordinates: ArrayLike, forces: Mapping[str, float], *,
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
        Whose points are the control points of sections, see
        :func:`fecontact.fem.with_pretension`; with residual vectors of their forces (``loads``).
    coordinates : (m,) array
        Modal coordinates of the tightened state.
    forces : mapping of name to float
        Tension of each bolt in this state [N].
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
    require_finite("tightened", **{f"forces of {name}": force for name, force in forces.items()})
    c, s = {}, {}
    for name in forces:
        row = basis.point_row(name, "x")
        c[name] = _STIFF / _compliance(basis, row, name) if stiffness is None else float(stiffness)
        s[name] = float(row @ q)
    along = tuple(np.eye(basis.dimension)[0].tolist())
    springs = [Spring(name, direction=along, stiffness=c[name],
                      shortening=-s[name] - force / c[name]) for name, force in forces.items()]
    return TightenedBolts(linked(basis, springs), dict(forces), s, c)


def _compliance(basis: ModalBasis, row: Array, name: str) -> float:
    """Elastic displacement along a row per unit force; InputError if it is zero."""
    w = basis.angular_frequencies
    found = float(((row[w > 0.0] / w[w > 0.0]) ** 2).sum())
    if not found > 0.0:
        raise InputError(f"tightened: '{name}' moves in no elastic mode in x; name the control "
                         f"point of a section, and give it in loads of the basis.")
    return found
