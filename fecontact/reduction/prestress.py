"""Stress of a static state in the stiffness of a body and of its modes.

``modal_basis(body, prestress=fields)`` takes the fields of :func:`~fecontact.static_solution`, or
``basis.fields(q)`` of an equilibrium with contact: its modes are those of ``K + K_sigma``. A body
that can rotate keeps the modes without stress, and ``ModalBasis.stiffness`` couples them.
Displacements count from the body without loads.
"""

from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.fem.constraints import Coupling
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.fields import BodyFields
from fecontact.fem.stress_stiffness import stress_stiffness
from fecontact.reduction.eigenmodes import rigid_modes


def geometric_stiffness(body: ElasticBody, prestress: BodyFields) -> Any:
    """Geometric stiffness of a static state, sparse (d N, d N).

    Raises
    ------
    InputError
        For a state of another body, or a body with hinges or couplings.
    """
    require_kind("modal_basis", BodyFields, prestress=prestress)
    if prestress.displacement.shape != body.nodes.shape:
        raise InputError(f"modal_basis: prestress has displacements of shape "
                         f"{prestress.displacement.shape}, but those of this body have the shape "
                         f"{body.nodes.shape}; give the static state of the same body.")
    refuse_circles(body, "prestress")
    if body.hinges:
        raise InputError("prestress is that of bodies without hinges, whose nodes would run on "
                         "circles; leave it out, or the hinges.")
    return stress_stiffness(body, prestress.displacement.ravel(), prestress.temperature)


def refuse_circles(body: ElasticBody, what: str) -> None:
    """Raise InputError for couplings: ``what`` would need the curvature of their motion."""
    if any(isinstance(one, Coupling) for one in body.equations):
        raise InputError(f"{what} is that of bodies without couplings, whose nodes would run on "
                         f"circles; leave it out, or the couplings.")


def resists_rotation(body: ElasticBody, stress: Any) -> bool:
    """Whether a geometric stiffness resists rigid motions that the supports allow: rotations."""
    rigid = rigid_modes(body)
    resisted = np.abs(stress @ rigid).max(initial=0.0)
    return bool(resisted > 1e-9 * np.abs(stress).max() * np.abs(rigid).max(initial=0.0))


def coupled(w: Array, shapes: Array, stress: Any) -> Array:
    """Modal stiffness (m, m) with a geometric stiffness."""
    added = shapes.T @ (stress @ shapes)
    return np.asarray(np.diag(w**2) + 0.5 * (added + added.T))
