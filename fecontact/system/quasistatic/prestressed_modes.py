"""Vibration modes about a state at rest under friction."""

from typing import Literal

import numpy as np
from scipy.linalg import null_space

from fecontact.core.checks import require_kind
from fecontact.core.errors import require_choice
from fecontact.core.types import Array, Integers
from fecontact.system.complex_modes import ComplexModes
from fecontact.system.contact_system import ContactSystem
from fecontact.system.jacobian import jacobian
from fecontact.system.quasistatic.given import travelling
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import RestState
from fecontact.system.quasistatic.sliders import components
from fecontact.system.statics.equilibrium import at_rest, follower, planar_follower

# Part of the largest eigenvalue below which rounding hides rigid modes, which are double roots.
_ZERO = 1e-7


def prestressed_modes(
    system: ContactSystem,
    state: LoadHistory | RestState,
    *,
    at_limit: Literal["stick", "slip"] = "stick",
) -> ComplexModes:
    r"""Modes of small vibrations about a state of contacts that friction holds.

    "Prestressed" means that state alone. The stress of the body stiffens it too if its basis was
    made with ``modal_basis(..., prestress=)``.
    The tangent of the normal law, with its damping, acts at nodes in contact, and the springs of
    sliders that stick; rigid sticking is a constraint. Open nodes add nothing. A slider that slides
    follows the normal force, ``dR = phi\, dF\, \mathrm{sgn} R``, which makes the stiffness
    unsymmetric, so that modes may be complex and may grow. In space ``R / |R|`` takes the place of
    the sign, and across that direction the slider still sticks. Modes of steady sliding are those
    of ``fecontact.analysis.complex_modes(system, "sliding")``.

    Parameters
    ----------
    system : ContactSystem
        The system.
    state : LoadHistory or RestState
        State at rest, the last one of a history.
    at_limit : 'stick' or 'slip'
        Behaviour of sliders at rest at their limit: small vibrations take them back as often as
        they move them on, so by default they stick.

    Raises
    ------
    InputError
        For a state of another system.
    """
    require_kind("prestressed_modes", ContactSystem, system=system)
    require_choice("prestressed_modes", "at_limit", at_limit, ("stick", "slip"))
    n, m = system.basis.contact_nodes, system.basis.modes
    require_kind("prestressed_modes", (LoadHistory, RestState), state=state)
    rest = state.state() if isinstance(state, LoadHistory) else state
    rest.check(system)
    sliders, arrays = rest.sliders, travelling(system)
    tangents = system.basis.contact_T[:, : system.basis.dimension - 1]
    closed = (rest.normal_force != 0.0)[:, None] & (sliders.limit > 0.0)
    sliding = closed & rest.at_limit & (at_limit == "slip")
    force = components(rest.slider_force)
    size = np.linalg.norm(force, axis=-1, keepdims=True)
    along = np.where(sliding[..., None] & (size > 0.0), force / np.where(size > 0.0, size, 1.0),
                     0.0)
    # Sliding sliders as a friction law that follows the normal force.
    follow = (sliders.limit[..., None] * along).sum(axis=1)
    arrays = at_rest(arrays, *rest.travels.tolist())._replace(
        friction=np.full(n, follower.address), friction_parameters=np.ascontiguousarray(follow),
        planar=np.full_like(arrays.planar, planar_follower.address))
    full = np.empty((2 * m, 2 * m))
    jacobian(0.0, np.concatenate([rest.modal_coordinates, np.zeros(m)]), arrays, full)
    # Directions (n, e, k, k) in which each slider holds: across its sliding, or all.
    holding = closed[..., None, None] * (np.eye(tangents.shape[1])
                                         - along[..., :, None] * along[..., None, :])
    stiffness = np.where(sliders.rigid == 0.0, sliders.stiffness, 0.0)
    springs = np.einsum("ne,nekl->nkl", stiffness, holding)
    full[m:, :m] -= np.einsum("nki,nkl,nlj->ij", tangents, springs, tangents, optimize=True)
    free = _free(tangents, holding[sliders.rigid > 0.0], np.nonzero(sliders.rigid > 0.0)[0])
    within = np.asarray(np.kron(np.eye(2), free), dtype=float)
    return ComplexModes.of(full, within=within, zero=_ZERO)


def _free(tangents: Array, holding: Array, nodes: Integers) -> Array:
    """Motions (m, k) that rigid sliders of some nodes allow, which they hold by projections."""
    rows = [np.zeros((0, tangents.shape[2]))]
    for node, held in zip(nodes.tolist(), holding, strict=True):
        values, directions = np.linalg.eigh(held)
        rows.append(directions[:, values > 0.5].T @ tangents[node])
    constraints = np.vstack(rows)
    return np.asarray(null_space(constraints)) if len(constraints) else np.eye(tangents.shape[2])
