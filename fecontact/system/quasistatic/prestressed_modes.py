"""Vibration modes about a state at rest under friction, or about steady sliding."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, require_choice, shown
from fecontact.core.types import Array
from fecontact.core.units import Summarised, count, span
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem
from fecontact.system.jacobian import jacobian
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import RestState
from fecontact.system.statics import at_rest, equilibrium, follower
from fecontact.system.steady_memory import settled

# Eigenvalues below this part of the largest are zero: rigid modes are double roots.
_ZERO = 1e-7


@dataclass(frozen=True, eq=False, repr=False)
class PrestressedModes(Summarised):
    """Modes of the linearised system, one of each complex pair, by ascending frequency.

    Attributes
    ----------
    basis : ModalBasis
        The basis of the coordinates q.
    eigenvalues : (k,) complex array
        [1/s]; small motions go like exp(eigenvalue t).
    shapes : (m, k) complex array
        Modal coordinates of each mode, of norm one, with the largest entry real and positive.
    stuck : (n,) bool array
        Nodes with a sliding friction spring or constraint; none in steady sliding.
    """

    basis: ModalBasis
    eigenvalues: NDArray[np.complex128]
    shapes: NDArray[np.complex128]
    stuck: NDArray[np.bool_]

    def summary(self) -> list[tuple[str, str]]:
        """Number of modes, frequencies, damping, unstable and stuck ones."""
        return [
            ("modes", f"{len(self.eigenvalues)}"),
            ("frequencies", span(self.frequencies_hz, "Hz")),
            ("damping ratios", span(self.damping_ratios)),
            ("growing", count(int(np.count_nonzero(self.eigenvalues.real > 0.0)), "mode")),
            ("stuck", count(int(self.stuck.sum()), "node")),
        ]

    @property
    def frequencies_hz(self) -> Array:
        """Frequencies of the damped vibration (k,) [Hz]; zero where there is none."""
        return np.asarray(self.eigenvalues.imag / (2.0 * np.pi))

    @property
    def damping_ratios(self) -> Array:
        """``-Re / |eigenvalue|`` (k,): negative where a vibration grows, zero for rigid modes."""
        size = np.abs(self.eigenvalues)
        return np.divide(-self.eigenvalues.real, size, out=np.zeros_like(size), where=size > 0.0)

    def displacement(self, mode: int, phase: float = 0.0) -> Array:
        """Displacements (N, 2) over the body in one mode at a phase of its vibration [rad].

        Per unit of the norm of its modal coordinates, at ``basis.mode_shapes.nodes``. InputError
        for a basis without shapes.
        """
        fields = self.basis.mode_shapes
        if fields is None:
            raise InputError("The basis has no shapes over the body; make it from a finite-element "
                             "body to draw its modes.")
        return np.asarray(fields.shapes @ (self.shapes[:, mode] * np.exp(1j * phase)).real)


def prestressed_modes(
    system: ContactSystem,
    state: LoadHistory | RestState | Literal["sliding"],
    *,
    at_limit: Literal["stick", "slip"] = "stick",
) -> PrestressedModes:
    r"""Modes of small vibrations about a state of the contacts.

    "Prestressed" means that state alone: no geometric stiffness of the stressed body is included.
    At rest, the tangent of the normal law, with its damping, acts at nodes in contact, and the
    springs of sliders that stick; rigid sticking is a constraint. Open nodes add nothing. A slider
    that slides follows the normal force, ``dR = phi\, dF\, \mathrm{sgn} R``, which makes the
    stiffness unsymmetric, so that modes may be complex and may grow. In steady sliding, friction is
    linearised about the speed of the ground: mu'(V) F is a damping, negative where friction falls.

    Parameters
    ----------
    system : ContactSystem
        The system.
    state : LoadHistory, RestState or 'sliding'
        State at rest (the last one of a history), or steady sliding.
    at_limit : 'stick' or 'slip'
        What sliders that are at rest at their limit do: small vibrations take them back as often as
        they move them on, so by default they stick.

    Raises
    ------
    InputError
        For a state of another system.
    AnalysisError
        If there is no steady sliding.
    """
    require_kind("prestressed_modes", ContactSystem, system=system)
    require_choice("prestressed_modes", "at_limit", at_limit, ("stick", "slip"))
    n, m = system.basis.contact_nodes, system.basis.modes
    if isinstance(state, str):
        if state != "sliding":
            raise InputError(f"prestressed_modes: state = {shown(state)} must be 'sliding', a "
                             f"LoadHistory or a RestState.")
        y = np.concatenate([equilibrium(system, True, 0.0), np.zeros(system.size - m)])
        matrix = system.jacobian(0.0, settled(0.0, y, system.arrays))
        return _modes(system, matrix, np.eye(m), np.zeros(n, dtype=bool))
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
    return _modes(system, full, free, sticking.any(axis=1))


def _modes(
    system: ContactSystem, matrix: Array, free: Array, stuck: NDArray[np.bool_]
) -> PrestressedModes:
    """Modes of y' = matrix y with q restricted to q = free p."""
    m = system.basis.modes
    states = len(matrix) - 2 * m
    k = free.shape[1]
    widen = np.zeros((len(matrix), 2 * k + states))
    widen[:m, :k] = widen[m : 2 * m, k : 2 * k] = free
    widen[2 * m :, 2 * k :] = np.eye(states)
    values, vectors = np.linalg.eig(widen.T @ matrix @ widen)
    values = np.where(np.abs(values) <= _ZERO * np.abs(values).max(initial=0.0), 0.0, values)
    chosen = np.flatnonzero(values.imag > 0.0)
    real = np.flatnonzero((values.imag == 0.0) & (values != 0.0))
    # Every rigid mode is a double root.
    still = np.flatnonzero(values == 0.0)[::2]
    order: Any = np.concatenate([still, real, chosen]).astype(int)
    order = order[np.lexsort((np.abs(values[order]), values[order].imag))]
    shapes = free @ vectors[:k, order]
    size = np.linalg.norm(shapes, axis=0)
    shapes = shapes / np.where(size > 0.0, size, 1.0)
    largest = shapes[np.abs(shapes).argmax(axis=0), np.arange(len(order))]
    turn = np.where(largest != 0.0, np.conj(largest) / np.where(largest != 0.0, np.abs(largest),
                                                                1.0), 1.0)
    return PrestressedModes(system.basis, values[order].astype(complex), shapes * turn, stuck)
