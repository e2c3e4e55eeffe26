"""The modal basis: eigenfrequencies, damping and the rows of T at the points of interest."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.damping import Damping, modal_damping
from fecontact.errors import InputError, choices, nearest

if TYPE_CHECKING:
    from fecontact.basis_report import BasisReport

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Field:
    """Modes over the whole body: what is needed to draw it and to load it anywhere.

    Attributes
    ----------
    nodes : (N, 2) array
        Reference places of the displacement nodes [m].
    cells : (M, 3) or (M, 4) integer array
        First-order cells between these nodes (each finite element is cut into four).
    outline : (k, 2) integer array
        Edges on the outline, as pairs of nodes.
    shapes : (N, 2, m) array
        Mass-normalised mode shapes, x and y.
    stress : (N, 4, m) array
        Stresses xx, yy, zz, xy of the modes, averaged at the nodes [Pa per unit coordinate].
    restriction : sparse (3 P, 2 N) array
        Displacements and rotation of the P points from those of the nodes (node by node, x then
        y), so that ``T = restriction @ shapes``; its transpose spreads a force at a point over
        the body.
    """

    nodes: Array
    cells: NDArray[np.int64]
    outline: NDArray[np.int64]
    shapes: Array
    stress: Array
    restriction: Any


@dataclass(frozen=True, eq=False)
class Quality:
    """How a basis relates to the finite-element body that it came from.

    Attributes
    ----------
    mass : float
        Mass of the body [kg].
    vibration_modes : int
        Number of leading modes that are eigenmodes of the body; the others complete them.
    residuals : (m,) array
        ``|K s - w^2 M s| / (|K| |s|)`` of each mode s; small for eigenmodes only.
    orthogonality : float
        Largest entry of ``shapes^T M shapes - 1``.
    participation : (2, m) array
        ``s^T M 1`` for translations in x and in y [kg^(1/2)]; its square is the effective mass.
    compliance : (P, 2) array
        Elastic displacement of each point in x and y per unit force there, of the whole body
        (inertia balances what the supports do not) [m/N].
    """

    mass: float
    vibration_modes: int
    residuals: Array
    orthogonality: float
    participation: Array
    compliance: Array


@dataclass(frozen=True, eq=False)
class ModalBasis:
    """Mass-normalised modes ``q`` of a body and its motion at the points of interest.

    The equations of motion are ``q'' + damping q' + angular_frequencies^2 q = T^T f`` (4.1-1),
    the displacements of the points ``w = T q`` (4.1-12), [x, y, phi] for each, x tangential to
    the ground, y away from it, phi counter-clockwise.

    Attributes
    ----------
    angular_frequencies : (m,) array
        [rad/s], ascending; exactly zero for rigid modes.
    damping : (m, m) array
        Modal damping matrix [1/s], ``diag(2 D w)`` for damping ratios D.
    T : (P, 3, m) array
        Rows of excitation point B, load point C, the n contact nodes and further named points.
    positions : (P, 2) array
        Reference places of these points [m].
    tributary : (n,) array
        Length of the contact face that each contact node stands for [m].
    extra : tuple of str
        Names of the points after the contact nodes.
    field : Field or None
        Modes over the whole body; None for a basis without geometry.
    quality : Quality or None
        How the basis relates to the body; None for a basis without one.
    """

    angular_frequencies: Array
    damping: Array
    T: Array
    positions: Array
    tributary: Array
    extra: tuple[str, ...] = ()
    field: Field | None = None
    quality: Quality | None = None

    def __post_init__(self) -> None:
        for name in ("angular_frequencies", "damping", "T", "positions", "tributary"):
            array = np.array(getattr(self, name), dtype=float, order="C")
            if not np.isfinite(array).all():
                raise InputError(f"Modal basis: {name} holds values that are not finite.")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not (self.tributary > 0.0).all():
            raise InputError(f"Modal basis: tributary lengths must be above zero, not "
                             f"{self.tributary.min()}.")
        m = len(self.angular_frequencies)
        points = 2 + len(self.tributary) + len(self.extra)
        for name, shape in (("damping", (m, m)), ("T", (points, 3, m)), ("positions", (points, 2))):
            if getattr(self, name).shape != shape:
                raise InputError(f"Modal basis: {name} must have shape {shape}, not "
                                 f"{getattr(self, name).shape}.")

    @property
    def modes(self) -> int:
        """Number of modes m."""
        return len(self.angular_frequencies)

    @property
    def contact_nodes(self) -> int:
        """Number of contact nodes n."""
        return len(self.tributary)

    @property
    def frequencies_hz(self) -> Array:
        """Eigenfrequencies (m,) [Hz]."""
        return self.angular_frequencies / (2.0 * np.pi)

    @property
    def rigid_modes(self) -> int:
        """Number of modes of frequency zero; they come first."""
        return int(np.count_nonzero(self.angular_frequencies == 0.0))

    @property
    def damping_ratios(self) -> Array:
        """Damping ratios D (m,), zero for rigid modes; InputError if damping is not modal."""
        diagonal = np.diag(self.damping)
        if (self.damping != np.diag(diagonal)).any():
            raise InputError("The damping matrix is not diagonal, so there are no damping ratios.")
        w = self.angular_frequencies
        return np.divide(diagonal, 2.0 * w, out=np.zeros_like(w), where=w > 0.0)

    @property
    def T_matrix(self) -> Array:
        """T (3 (2 + n), m) in the order of (4.1-13): B, C, contact nodes."""
        return self.T[: 2 + self.contact_nodes].reshape(-1, self.modes)

    @property
    def contact_T(self) -> Array:
        """Rows (n, 3, m) of the contact nodes."""
        return self.T[2 : 2 + self.contact_nodes]

    @property
    def contact_x(self) -> Array:
        """Reference abscissae X (n,) of the contact nodes [m]."""
        return self.positions[2 : 2 + self.contact_nodes, 0]

    def point_index(self, point: str | int) -> int:
        """Index into ``T`` of B, C, a further named point, or a contact node by its number."""
        if isinstance(point, int):
            if not 0 <= point < self.contact_nodes:
                raise InputError(f"Contact node {point} does not exist; there are "
                                 f"{self.contact_nodes}, counted from 0.")
            return 2 + point
        names = ("B", "C", *self.extra)
        if point not in names:
            raise InputError(f"There is no point '{point}'{nearest(point, names)}; the named "
                             f"points are {choices(names)}, contact nodes go by number.")
        index = names.index(point)
        return index if index < 2 else index + self.contact_nodes

    @classmethod
    def from_matrices(
        cls,
        mass: ArrayLike,
        stiffness: ArrayLike,
        rows: Mapping[str, ArrayLike],
        *,
        damping: Damping = 0.0,
        contact_x: ArrayLike | None = None,
        tributary: ArrayLike | None = None,
    ) -> "ModalBasis":
        """Basis of all modes of given matrices, for bodies meshed elsewhere or chains of masses.

        Parameters
        ----------
        mass, stiffness : (d, d) arrays
            Symmetric; the mass positive definite, the stiffness positive semi-definite.
        rows : mapping
            ``contact`` (n, 3, d): displacements x, y and rotation of each contact node from the
            d degrees of freedom; ``B`` and ``C`` (3, d), zero when left out; further named
            points (3, d).
        damping : float, (d,) sequence, Rayleigh or (d, d) array
            Ratios of the modes, Rayleigh factors, or the damping matrix in the given degrees
            of freedom.
        contact_x, tributary : (n,) arrays, optional
            Abscissae (default zero) and lengths (default equal, of sum one) of the contact nodes.

        Raises
        ------
        InputError
            For matrices that are not square, of one size, symmetric or definite as required,
            and for rows of another width.
        """
        from scipy.linalg import LinAlgError, eigh

        mass, stiffness = _real("mass", mass), _real("stiffness", stiffness)
        d = len(mass) if mass.ndim else 0
        for name, matrix in (("mass", mass), ("stiffness", stiffness)):
            if not d or matrix.shape != (d, d):
                raise InputError(f"The {name} matrix must be square, not empty and of the mass "
                                 f"matrix's size, not of shape {matrix.shape}.")
            if not np.isfinite(matrix).all():
                raise InputError(f"The {name} matrix holds values that are not finite.")
            asymmetry = np.abs(matrix - matrix.T).max() / max(np.abs(matrix).max(), 1e-300)
            if asymmetry > 1e-10:
                raise InputError(f"The {name} matrix is not symmetric: its largest asymmetry is "
                                 f"{asymmetry:.1e} of its largest entry.")
        try:
            squares, shapes = eigh(stiffness, mass)
        except LinAlgError:
            raise InputError("The mass matrix is not positive definite.") from None
        digit = np.finfo(float).eps * max(abs(squares[-1]), abs(squares[0]))
        if squares[0] < -10.0 * d * digit:
            raise InputError(f"The stiffness matrix is not positive semi-definite: its smallest "
                             f"eigenvalue relative to the mass is {squares[0]:.3e} 1/s^2.")
        # Rayleigh quotients: those of rigid modes come out below a tenth of the last digit of the
        # largest, for any number of unknowns, and the lowest of a slender body not far above.
        squares = (shapes * (stiffness @ shapes)).sum(axis=0)
        w = np.sqrt(np.where(squares <= 100.0 * digit, 0.0, squares))
        order = np.argsort(w, kind="stable")
        w, shapes = w[order], shapes[:, order]
        shapes = shapes * fixed_signs(shapes)
        contact = _rows("contact", rows, d, "(n, 3, d)")
        names = [name for name in rows if name not in ("B", "C", "contact")]
        points = [_rows(name, rows, d, "(3, d)") for name in ("B", "C")]
        T = np.concatenate([*points, contact, *(_rows(name, rows, d, "(3, d)") for name in names)])
        n = len(contact)
        positions = np.zeros((len(T), 2))
        for name, given in (("contact_x", contact_x), ("tributary", tributary)):
            if given is not None and _real(name, given).shape != (n,):
                raise InputError(f"{name} must have one value for each of the {n} contact nodes, "
                                 f"not shape {np.shape(given)}.")
        if contact_x is not None:
            positions[2 : 2 + n, 0] = contact_x
        physical = np.ndim(damping) == 2 if not hasattr(damping, "mass_factor") else False
        if physical:
            matrix = np.asarray(damping, dtype=float)
            if matrix.shape != (d, d):
                raise InputError(f"The damping matrix must have shape ({d}, {d}), not "
                                 f"{matrix.shape}.")
            damping = shapes.T @ matrix @ shapes
        return cls(
            angular_frequencies=w,
            damping=modal_damping(damping, w),
            T=T @ shapes,
            positions=positions,
            tributary=np.full(n, 1.0 / n) if tributary is None else np.asarray(tributary, float),
            extra=tuple(names),
        )

    @property
    def elastic_compliance(self) -> Array:
        """Displacement (P, 2) of each point in x and y per unit force there, in elastic modes."""
        elastic = self.angular_frequencies > 0.0
        rows = self.T[:, :2, elastic] / self.angular_frequencies[elastic]
        return np.asarray((rows**2).sum(axis=2))

    def report(self) -> "BasisReport":
        """How good the basis is, as numbers and as a text; see :class:`BasisReport`."""
        from fecontact.basis_report import BasisReport

        return BasisReport(self)

    def save(self, path: str | Path) -> None:
        """Write the basis to an HDF5 file, whole or not at all."""
        from fecontact.output.hdf5 import new_file, write_basis

        with new_file(path) as file:
            write_basis(file.create_group("basis"), self)

    @classmethod
    def load(cls, path: str | Path) -> "ModalBasis":
        """Read a basis that :meth:`save` wrote, or that of a case; exact to the last bit."""
        from fecontact.output.hdf5 import open_file, read_basis

        with open_file(path, "basis") as file:
            return read_basis(file["basis"])


def fixed_signs(shapes: Array) -> Array:
    """Signs (m,) that make the first of the largest components of each column positive.

    Components within one per cent of the largest count as equal to it, so that round-off
    between the two ends of a symmetric body does not decide.
    """
    size = np.abs(shapes)
    first = np.argmax(size >= 0.99 * size.max(axis=0), axis=0)
    return np.where(shapes[first, np.arange(shapes.shape[1])] < 0.0, -1.0, 1.0)


def _real(name: str, values: ArrayLike) -> Array:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be an array of real numbers, not "
                         f"{type(values).__name__}.") from None


def _rows(name: str, rows: Mapping[str, ArrayLike], d: int, shape: str) -> Array:
    if name not in rows:
        if name == "contact":
            raise InputError("rows must have an entry 'contact' of shape (n, 3, d).")
        return np.zeros((1, 3, d))
    block = _real(f"rows['{name}']", rows[name])
    if block.ndim == 2 and shape == "(3, d)":
        block = block[None]
    if block.ndim != 3 or block.shape[1:] != (3, d) or not len(block):
        raise InputError(f"rows['{name}'] must have shape {shape} with d = {d}, not "
                         f"{np.shape(rows[name])}.")
    return block
