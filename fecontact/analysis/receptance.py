"""Frequency responses: receptance, mobility and accelerance of a body, free or in contact."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError, choices, nearest
from fecontact.core.types import Array, ArrayLike
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem

Place = tuple[str | int, str]
Kind = Literal["receptance", "mobility", "accelerance"]

_POWERS = {"receptance": 0, "mobility": 1, "accelerance": 2}
_COMPONENTS = {"x": 0, "y": 1, "phi": 2}
_UNITS = {"x": "m", "y": "m", "phi": "rad"}
_RATES = ("", "/s", "/s^2")
_CHUNK = 2_000_000  # entries of dynamic stiffness matrices at a time


@dataclass(frozen=True, eq=False)
class Receptance:
    """Complex response to harmonic forces, ``response = values . force exp(i w t)``.

    Attributes
    ----------
    frequency_hz : (F,) array
        [Hz].
    values : (F, R, E) complex array
        Response r to excitation e; see :meth:`unit`.
    responses, excitations : tuples of (point, component)
        Components x, y, and phi: a rotation as response, a moment as excitation.
    kind : 'receptance', 'mobility' or 'accelerance'
        Displacement, velocity or acceleration per force.
    growing : (k,) complex array
        Eigenvalues of the system, linearised where it was, with positive real parts [1/s], those
        with positive or no imaginary part, the largest real part first. If there are any, free
        vibrations grow over the response to the force, which is then not to be seen.
    """

    frequency_hz: Array
    values: NDArray[np.complex128]
    responses: tuple[Place, ...]
    excitations: tuple[Place, ...]
    kind: Kind
    growing: NDArray[np.complex128] = field(default_factory=lambda: np.zeros(0, dtype=complex))

    @property
    def stable(self) -> bool:
        """Whether free vibrations die away, or at least do not grow."""
        return len(self.growing) == 0

    @property
    def growth_in_words(self) -> str:
        """The vibration that grows fastest, for people; empty if none does."""
        if self.stable:
            return ""
        fastest = self.growing[0]
        at = f" at {fastest.imag / (2.0 * np.pi):.3g} Hz" if fastest.imag > 0.0 else ""
        return f"vibrations{at} grow by {fastest.real:.3g} 1/s" if at else (
            f"deviations grow by {fastest.real:.3g} 1/s")

    def unit(self, response: int = 0, excitation: int = 0) -> str:
        """Unit of one of the responses, like m/N."""
        moved = _UNITS[self.responses[response][1]] + _RATES[_POWERS[self.kind]]
        push = "N m" if self.excitations[excitation][1] == "phi" else "N"
        return f"{moved}/({push})" if " " in push else f"{moved}/{push}"

    @property
    def magnitude(self) -> Array:
        """Magnitudes (F, R, E)."""
        return np.abs(self.values)

    @property
    def phase(self) -> Array:
        """Phases (F, R, E) by which the responses lead the forces, from -pi to pi [rad]."""
        return np.angle(self.values)


def receptance(
    body: ModalBasis | ContactSystem,
    frequency_hz: ArrayLike,
    excitations: Sequence[Place],
    responses: Sequence[Place] | None = None,
    *,
    kind: Kind = "receptance",
    linearised_at: Initial | None = None,
) -> Receptance:
    r"""Response of a body to harmonic forces at its points.

    .. math:: H(\omega) = (i \omega)^p\, T_r
        \big[\operatorname{diag}(w_i^2) + c\, T_B^T T_B + i \omega (D + b\, T_B^T T_B)
        - \omega^2 I\big]^{-1} T_e^T

    with the springs c and dashpots b of the drive, whose far ends rest, and p = 0, 1, 2 for
    receptance, mobility, accelerance. Linearised at a state, the contact's stiffness and damping
    come in by the Jacobian there; a node that sticks is held by its friction's slope
    dR/dv, as by a dashpot. An unstable state, of which the result says so, never answers a force
    in this way: what grows from it ends somewhere else.

    Parameters
    ----------
    body : ModalBasis or ContactSystem
        A basis is the body alone; a system has the springs and dashpots of its drive.
    frequency_hz : (F,) array
        [Hz], zero or above.
    excitations, responses : sequences of (point, component)
        Points by name, contact nodes by number; 'x', 'y' or 'phi'. Responses where the
        excitations are by default.
    kind : 'receptance', 'mobility' or 'accelerance'
        Displacement, velocity or acceleration per force.
    linearised_at : 'rest', 'sliding' or (2 m + n s,) array, optional
        Equilibrium about which a system moves, with its contact; see
        :func:`fecontact.integrate.initial_state`.

    Raises
    ------
    InputError
        For points, components or a kind that do not exist, negative frequencies, or a
        linearisation of a basis.
    AnalysisError
        Where the response is infinite: at frequency zero of a body that nothing holds, or at an
        undamped eigenfrequency; and if there is no equilibrium.
    """
    require_kind("receptance", (ModalBasis, ContactSystem), body=body)
    basis = body.basis if isinstance(body, ContactSystem) else body
    if kind not in _POWERS:
        raise InputError(f"kind = {kind!r} must be one of {choices(_POWERS)}"
                         f"{nearest(str(kind), _POWERS)}.")
    f = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    if f.ndim != 1 or not (np.isfinite(f).all() and (f >= 0.0).all()):
        raise InputError("frequency_hz must be finite numbers, zero or above.")
    inputs = tuple(excitations)
    outputs = inputs if responses is None else tuple(responses)
    pushed, seen = _rows(basis, inputs), _rows(basis, outputs)
    m = basis.modes
    if linearised_at is not None:
        if not isinstance(body, ContactSystem):
            raise InputError("A modal basis has no contact to be linearised; give a ContactSystem.")
        state = initial_state(body, linearised_at, 0.0)
        matrix = body.jacobian(0.0, state)
        into = np.zeros((len(matrix), len(inputs)))
        into[m : 2 * m] = pushed.T
        out = np.zeros((len(outputs), len(matrix)))
        out[:, :m] = seen
        terms: tuple[Array, Array, Array | None] = (-matrix, np.eye(len(matrix)), None)
        growing = _growing(matrix)
    else:
        if isinstance(body, ContactSystem):
            stiffness, damping = body.arrays.stiffness, body.arrays.damping
        else:
            stiffness, damping = np.diag(basis.angular_frequencies**2), basis.damping
        into, out, terms = pushed.T, seen, (stiffness, damping, np.eye(m))
        growing = _growing(np.block([[np.zeros((m, m)), np.eye(m)], [-stiffness, -damping]]))
    values = _response(2.0 * np.pi * f, terms, into, out)
    values *= ((2j * np.pi * f) ** _POWERS[kind])[:, None, None]
    return Receptance(f, values, outputs, inputs, kind, growing)


def _growing(matrix: Array) -> NDArray[np.complex128]:
    """Eigenvalues of the state matrix with positive real parts; those of a pair once."""
    found = np.linalg.eigvals(matrix).astype(complex)
    size = np.abs(found)
    # Less is round-off, of undamped modes and of rigid ones.
    zero = 1e-10 * size + 1e-13 * size.max()
    found = found[(found.real > zero) & (found.imag >= 0.0)]
    return np.asarray(found[np.argsort(-found.real)])


def _response(
    w: Array, terms: tuple[Array, Array, Array | None], into: Array, out: Array
) -> NDArray[np.complex128]:
    """``out (constant + i w rate - w^2 mass)^-1 into`` at each w."""
    constant, rate, mass = terms
    size = len(constant)
    chunk = max(1, _CHUNK // size**2)
    values = np.empty((len(w), len(out), into.shape[1]), dtype=complex)
    for first in range(0, len(w), chunk):
        part = w[first : first + chunk, None, None]
        matrix = constant + 1j * part * rate
        if mass is not None:
            matrix = matrix - part**2 * mass
        try:
            solution = np.linalg.solve(matrix, into.astype(complex))
        except np.linalg.LinAlgError:
            solution = np.full((len(part), size, into.shape[1]), np.nan + 0j)
        values[first : first + chunk] = out @ solution
    if not np.isfinite(values).all():
        first = int(np.flatnonzero(~np.isfinite(values).all(axis=(1, 2)))[0])
        at = w[first] / (2.0 * np.pi)
        raise AnalysisError(f"The response at or near {at:g} Hz is infinite: nothing holds the "
                            f"body there; leave this frequency out, or give damping or a spring.")
    return values


def _rows(basis: ModalBasis, places: tuple[Place, ...]) -> Array:
    rows = []
    for place in places:
        if not isinstance(place, tuple) or len(place) != 2:
            raise InputError(f"{place!r} must be a pair of a point and a component, like "
                             f"('B', 'x').")
        point, component = place
        if component not in _COMPONENTS:
            raise InputError(f"The component {component!r} at {point!r} must be one of "
                             f"{choices(_COMPONENTS)}.")
        rows.append(basis.T[basis.point_index(point), _COMPONENTS[component]])
    if not rows:
        raise InputError("A frequency response needs at least one excitation and one response.")
    return np.array(rows)
