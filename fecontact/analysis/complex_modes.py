"""Complex modes of a body or of a contact system about an equilibrium."""

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.complex_modes import ComplexModes as ComplexModes
from fecontact.system.contact_system import ContactSystem
from fecontact.system.linearised import linearised
from fecontact.system.quasistatic.prestressed_modes import prestressed_modes as prestressed_modes


def complex_modes(
    body: ModalBasis | ContactSystem, linearised_at: Initial | None = None, *, time: float = 0.0
) -> ComplexModes:
    r"""Complex modes of linearised equations: frequencies, damping, right and left eigenvectors.

    Those of

    .. math:: A = \begin{bmatrix} 0 & I \\ -K & -C \end{bmatrix}

    with the full modal stiffness K and damping C of the body and, for a system, the springs and
    dashpots of its drive and the Jacobian of the contact. Skew parts, of friction in the
    contact, of damping that rotates or of Coriolis forces, make the shapes complex: the points of
    the body do not move in phase, and a movie (:func:`fecontact.plot.render_mode`) shows
    travelling waves. Elastic Coulomb elements (Jenkins, Iwan) are springs where they stick, and
    their forces follow the limit where they slide: their deflections are no states, and their
    entries in the shapes are zero. In space those across the direction of sliding are states.

    Parameters
    ----------
    body : ModalBasis or ContactSystem
        A basis stands for the body alone, a system includes its drive.
    linearised_at : 'rest', 'sliding' or (2 m + n s,) array, optional
        State at which the contact of a system is linearised, usually an equilibrium; see
        :func:`fecontact.integrate.initial_state`. By default the contact is left out.
    time : float
        Time at which the ground is taken [s].

    Raises
    ------
    InputError
        For a linearisation of a basis, or a state of wrong size.
    AnalysisError
        If there is no such equilibrium.
    """
    require_kind("complex_modes", (ModalBasis, ContactSystem), body=body)
    if linearised_at is not None:
        if not isinstance(body, ContactSystem):
            raise InputError("A modal basis has no contact to be linearised; give a ContactSystem.")
        matrix, within = linearised(body, time, initial_state(body, linearised_at, time))
        return ComplexModes.of(matrix, within=within)
    if isinstance(body, ContactSystem):
        stiffness, damping = body.arrays.stiffness, body.arrays.damping
    else:
        stiffness, damping = body.stiffness_matrix, body.damping
    zero, one = np.zeros_like(stiffness), np.eye(len(stiffness))
    return ComplexModes.of(np.block([[zero, one], [-stiffness, -damping]]))
