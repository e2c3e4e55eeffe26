"""Vibration modes about a state at rest under friction."""

from typing import Literal

import numpy as np
from scipy.linalg import null_space

from fecontact.core.checks import require_kind
from fecontact.core.errors import require_choice
from fecontact.system.complex_modes import ComplexModes
from fecontact.system.contact_system import ContactSystem
from fecontact.system.equilibrium.statics import at_rest, follower
from fecontact.system.jacobian import jacobian
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import RestState

# Part of the largest eigenvalue below which rounding hides rigid modes, which are double roots.
_ZERO = 1e-7


def prestressed_modes(
    system: ContactSystem,
    state: LoadHistory | RestState,
    *,
    at_limit: Literal["stick", "slip"] = "stick",
) -> ComplexModes:
    r"""Modes of small vibrations about a state of contacts that friction holds.

    "Prestressed" means that state alone: no geometric stiffness of the stressed body is included.
    The tangent of the normal law, with its damping, acts at nodes in contact, and the springs of
    sliders that stick; rigid sticking is a constraint. Open nodes add nothing. A slider that slides
    follows the normal force, ``dR = phi\, dF\, \mathrm{sgn} R``, which makes the stiffness
    unsymmetric, so that modes may be complex and may grow. Modes of steady sliding are those of
    ``fecontact.analysis.complex_modes(system, "sliding")``.

    Parameters
    ----------
    system : ContactSystem
        The system.
    state : LoadHistory or RestState
        State at rest, the last one of a history.
    at_limit : 'stick' or 'slip'
        What sliders that are at rest at their limit do: small vibrations take them back as often as
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
    sliders, Tx = rest.sliders, system.arrays.Tx
    closed = rest.normal_force != 0.0
    sliding = rest.at_limit & (sliders.limit > 0.0) & (at_limit == "slip")
    sticking = closed[:, None] & (sliders.limit > 0.0) & ~sliding
    # Sliding sliders as a friction law that follows the normal force.
    follow = (sliders.limit * np.sign(rest.slider_force) * sliding).sum(axis=1, keepdims=True)
    arrays = at_rest(system.arrays, rest.travel)._replace(
        friction=np.full(n, follower.address), friction_parameters=np.ascontiguousarray(follow))
    full = np.empty((2 * m, 2 * m))
    jacobian(0.0, np.concatenate([rest.modal_coordinates, np.zeros(m)]), arrays, full)
    rigid = (sticking & (sliders.rigid > 0.0)).any(axis=1)
    springs = np.where(sticking & (sliders.rigid == 0.0), sliders.stiffness, 0.0).sum(axis=1)
    full[m:, :m] -= (Tx.T * springs) @ Tx
    free = null_space(Tx[rigid]) if rigid.any() else np.eye(m)
    within = np.kron(np.eye(2), free)
    return ComplexModes.of(full, within=within, zero=_ZERO)
