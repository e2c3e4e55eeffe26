"""Orbits whose multipliers miss jumps of the normal force at touch-down."""

from collections.abc import Sequence

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.core.errors import InputError
from fecontact.integrate.jumping_nodes import jumping_nodes
from fecontact.system import columns
from fecontact.system.elastic_sliders import slider_counts
from fecontact.system.fields.vector_field import VectorField

# Samples of an orbit among which a touch-down is sought.
_SAMPLES = 400


def missed_jumps(field: VectorField, points: Sequence[BranchPoint]) -> str:
    """Note on orbits of a branch whose multipliers lack the saltation at touch-downs, if any.

    Multipliers come from Jacobians along the orbit, in which a jump of the force does not show.
    """
    if not isinstance(field, ContactField) or not points:
        return ""
    # A law that jumps along a branch, as its dashpot grows from zero, jumps at one of its ends.
    if not any(_jumps(field, point) for point in (points[0], points[-1])):
        return ""
    missed = sum(_touches_down(field, point) for point in points)
    if not missed:
        return ""
    return (f"The multipliers of {missed} of {len(points)} orbits miss jumps of the normal force "
            f"at touch-down, as of LinearContact with damping, and so do their stability and "
            f"special points: follow them with method = Shooting().")


def require_smooth_friction(field: VectorField) -> None:
    """Raise InputError for friction by elastic Coulomb elements, which switch along an orbit."""
    if isinstance(field, ContactField) and slider_counts(field.system()).any():
        raise InputError("Collocation does not locate where elastic Coulomb elements "
                         "(JenkinsFriction, IwanFriction, FourParameterIwanFriction) begin and end "
                         "to slide; follow the orbits with method = Shooting() or "
                         "HarmonicBalance().")


def _jumps(field: ContactField, point: BranchPoint) -> bool:
    return bool(jumping_nodes(field.system(point.parameter_values(field))).any())


def _touches_down(field: ContactField, point: BranchPoint) -> bool:
    """True if a node whose normal force jumps is open at a sample and closed at the next one."""
    system = field.system(point.parameter_values(field))
    motion = point.orbit(field, samples=_SAMPLES)
    closed = system.contact_history(
        np.ascontiguousarray(motion.times), np.ascontiguousarray(motion.states))[
            :, jumping_nodes(system), columns.NORMAL_FORCE] != 0.0
    return bool((np.roll(closed, 1, axis=0) != closed).any())
