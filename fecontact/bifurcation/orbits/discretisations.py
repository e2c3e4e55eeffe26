"""The methods of periodic orbits; a new one is one entry."""

from typing import Any

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.harmonic.branches import ByHarmonics
from fecontact.bifurcation.orbits.by_collocation import ByCollocation
from fecontact.bifurcation.orbits.by_shooting import ByShooting
from fecontact.bifurcation.orbits.discretisation import Discretisation
from fecontact.bifurcation.orbits.orbit_points import orbit_points_of

DISCRETISATIONS: tuple[Discretisation, ...] = (ByCollocation(), ByShooting(), ByHarmonics())

_BY_OPTIONS = {one.options: one for one in DISCRETISATIONS}


def discretisation_by(method: Any) -> Discretisation:
    """The discretisation with these options."""
    return _BY_OPTIONS[type(method)]


def discretisation_of(point: BranchPoint) -> Discretisation:
    """The discretisation by which a point is an orbit.

    Raises
    ------
    InputError
        If it is none.
    """
    return _BY_OPTIONS[orbit_points_of(point).options]
