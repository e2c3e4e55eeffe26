"""Frequency responses: receptance, mobility and accelerance of a body, free or in contact."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError, choices, nearest
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.integrate.initial_state import Initial, initial_state
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.contact_system import ContactSystem
from fecontact.system.linearised import linearised

Place = tuple[str | int, str]
Kind = Literal["receptance", "mobility", "accelerance"]

_POWERS = {"receptance": 0, "mobility": 1, "accelerance": 2}
_RATES = ("", "/s", "/s^2")
_CHUNK = 2_000_000  # matrix entries processed at a time


@read_only_arrays
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
        Components x, y and phi; phi is a rotation as response and a moment as excitation.
    kind : 'receptance', 'mobility' or 'accelerance'
        Displacement, velocity or acceleration per force.
    growing : (k,) complex array
        Unstable eigenvalues [1/s] of the linearised system, one of each complex pair, by falling
        real part. If there are any, growing free vibrations mask the forced response.
    """

    frequency_hz: Array
    values: NDArray[np.complex128]
    responses: tuple[Place, ...]
    excitations: tuple[Place, ...]
    kind: Kind
    growing: NDArray[np.complex128] = field(default_factory=lambda: np.zeros(0, dtype=complex))

    @property
    def stable(self) -> bool:
        """True if no free vibration grows."""
        return len(self.growing) == 0

    @property
    def growth_in_words(self) -> str:
        """Description of the fastest-growing vibration; empty if none grows."""
        if self.stable:
            return ""
        fastest = self.growing[0]
        at = f" at {fastest.imag / (2.0 * np.pi):.3g} Hz" if fastest.imag > 0.0 else ""
        return f"vibrations{at} grow by {fastest.real:.3g} 1/s" if at else (
            f"deviations grow by {fastest.real:.3g} 1/s")

    def unit(self, response: int = 0, excitation: int = 0) -> str:
        """Unit of a response, such as m/N."""
        return response_unit(self.kind, self.responses[response], self.excitations[excitation])

    @property
    def magnitude(self) -> Array:
        """Magnitudes (F, R, E)."""
        return np.abs(self.values)

    @property
    def phase(self) -> Array:
        """Phase lead (F, R, E) of the responses over the forces, from -pi to pi [rad]."""
        return np.angle(self.values)


def response_unit(kind: Kind, response: Place, excitation: Place) -> str:
    """SI unit of a frequency response, such as m/N."""
    moved = "rad" if response[1].startswith("phi") else "m"
    push = "(N m)" if excitation[1].startswith("phi") else "N"
    return f"{moved}{_RATES[_POWERS[kind]]}/{push}"


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
        \big[K + c\, T_B^T T_B + i \omega (D + b\, T_B^T T_B) - \omega^2 I\big]^{-1} T_e^T

    with the stiffness and damping matrices K, D of the basis, the springs c and dashpots b of the
    drive, whose far ends are fixed, and p = 0, 1, 2 for receptance, mobility, accelerance.
    Linearisation at a state adds the stiffness and damping of the contact by the Jacobian; a
    sticking node acts as a dashpot with the friction slope dR/dv. The result says if the state is
    unstable; the response is then that of the linear equations only and cannot be observed.

    Parameters
    ----------
    body : ModalBasis or ContactSystem
        A basis stands for the body alone; a system includes springs and dashpots of its drive.
    frequency_hz : (F,) array
        Frequencies [Hz], zero or positive.
    excitations, responses : sequences of (point, component)
        Points by name, contact nodes by number; components 'x', 'y' or 'phi', of solids also 'z',
        'phi_x', 'phi_y', 'phi_z'. By default the responses are those at the excitations.
    kind : 'receptance', 'mobility' or 'accelerance'
        Displacement, velocity or acceleration per force.
    linearised_at : 'rest', 'sliding' or (2 m + n s,) array, optional
        Equilibrium at which a system is linearised, including contact; see
        :func:`fecontact.integrate.initial_state`.

    Raises
    ------
    InputError
        For points, components or a kind that do not exist, negative frequencies, or a
        linearisation of a basis.
    AnalysisError
        If the response is infinite (at frequency zero of an unsupported body, or at an undamped
        eigenfrequency), or if there is no equilibrium.
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
        jacobian, within = linearised(body, 0.0, state)
        matrix = within.T @ jacobian @ within
        into = within[m : 2 * m].T @ pushed.T
        out = seen @ within[:m]
        terms: tuple[Array, Array, Array | None] = (-matrix, np.eye(len(matrix)), None)
        growing = _growing(matrix)
    else:
        if isinstance(body, ContactSystem):
            stiffness, damping = body.arrays.stiffness, body.arrays.damping
        else:
            stiffness, damping = basis.stiffness_matrix, basis.damping
        into, out, terms = pushed.T, seen, (stiffness, damping, np.eye(m))
        growing = _growing(np.block([[np.zeros((m, m)), np.eye(m)], [-stiffness, -damping]]))
    values = _response(2.0 * np.pi * f, terms, into, out)
    values *= ((2j * np.pi * f) ** _POWERS[kind])[:, None, None]
    return Receptance(f, values, outputs, inputs, kind, growing)


def receptance_derivative(
    system: ContactSystem, frequency_hz: Array, excitation: Place, response: Place, kind: Kind,
    stiffness: Array, damping: Array,
) -> ComplexArray:
    r"""Derivatives (F,) of a response without contact, from those of K and D over a parameter.

    .. math:: \frac{dH}{dp} = -(i \omega)^k\, T_r Z^{-1} \Big(\frac{dK}{dp} + i \omega
        \frac{dD}{dp}\Big) Z^{-1} T_e^T, \qquad Z = K + i \omega D - \omega^2 I
    """
    K, D, one = system.arrays.stiffness, system.arrays.damping, np.eye(system.basis.modes)
    w = 2.0 * np.pi * frequency_hz
    moved = _response(w, (K, D, one), _rows(system.basis, (excitation,)).T, one)[:, :, 0]
    seen = _response(w, (K.T, D.T, one), _rows(system.basis, (response,)).T, one)[:, :, 0]
    s = 1j * w
    change = (np.einsum("fi,ij,fj->f", seen, stiffness, moved)
              + s * np.einsum("fi,ij,fj->f", seen, damping, moved))
    return np.asarray(-(s ** _POWERS[kind]) * change)


def _growing(matrix: Array) -> NDArray[np.complex128]:
    """Eigenvalues of the state matrix with positive real part, one of each complex pair."""
    found = np.linalg.eigvals(matrix).astype(complex)
    size = np.abs(found)
    # Smaller real parts are round-off of undamped and rigid modes.
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
        rows.append(basis.point_row(point, component))
    if not rows:
        raise InputError("A frequency response needs at least one excitation and one response.")
    return np.array(rows)
