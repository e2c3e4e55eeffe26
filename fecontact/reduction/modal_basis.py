"""The modal basis: eigenfrequencies, damping and the rows of T at the points of interest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_floats, as_integers, require_kind
from fecontact.core.errors import InputError, choices, nearest, require_finite
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike
from fecontact.core.units import Summarised, count, listed, quantity, span
from fecontact.fem.faces.frames import tangents_of
from fecontact.fem.fields import BodyFields
from fecontact.reduction.basis_checks import (
    check_groups,
    check_shapes,
    check_sides,
    frozen_arrays,
)
from fecontact.reduction.large_deflections.forces import LargeDeflectionForces
from fecontact.reduction.modal_rotation import ModalRotation
from fecontact.reduction.mode_shapes import BodyPart, ModeShapes, ReductionQuality

# Displacements and rotations of a point: x, y, phi in the plane, all but phi in space.
Component = Literal["x", "y", "z", "phi", "phi_x", "phi_y", "phi_z"]
COMPONENTS = get_args(Component)


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class ModalBasis(Summarised):
    """Mass-normalised modes ``q`` of a body, or several, and the motion of points of interest.

    The equations of motion are ``q'' + damping q' + stiffness_matrix q = T^T f + centrifugal_load
    + constant_load`` (4.1-1), where the stiffness matrix is ``diag(angular_frequencies^2)`` unless
    ``stiffness`` is given; the displacements of the points ``w = T q`` (4.1-12), [x, y, phi] for
    each, x tangential to the ground, y away from it, phi counter-clockwise. In space
    [x, y, z, phi_x, phi_y, phi_z], x and y tangential, z away from the ground; shapes below are
    those of the plane with d = 2, in space d = 3.

    Attributes
    ----------
    angular_frequencies : (m,) array
        Frequencies of the symmetric part of the stiffness without rotation [rad/s], ascending, of
        several bodies one after the other; exactly zero for rigid modes.
    damping : (m, m) array
        Modal damping matrix [1/s], ``diag(2 D w)`` for damping ratios D. Its skew part is
        gyroscopic and does no work.
    T : (P, 3, m) or (P, 6, m) array
        Rows of excitation point B, load point C, the n contact nodes and further named points;
        those of a contact node are its motion relative to the other side along its tangent (in
        space two) and normal, and its relative rotation (in space about these three).
    positions : (P, d) array
        Reference places of these points [m].
    tributary : (n,) array
        Length of the contact face represented by each contact node [m], in space area [m^2].
    extra : tuple of str
        Names of the points after the contact nodes.
    mode_shapes : ModeShapes or None
        Mode shapes over the whole body; None for a basis without geometry.
    quality : ReductionQuality or None
        Comparison with the body; None for a basis without one.
    groups : tuple of (str, int)
        Names of the interfaces and their numbers of nodes, in the order of the nodes; by
        default one group 'contact'.
    thickness : float or None
        Out-of-plane thickness of the body [m], which makes pressures of line loads; None where it
        is not known, and in space.
    inertia_rows : (d, m) array or None
        ``1^T M s`` of the modes s for translations along the axes [kg^(1/2)]: the modal forces of
        a unit acceleration; its squares are the effective masses. None if the mass is not known.
    boundaries : tuple of str
        Named boundaries on which loads can act.
    boundary_rows : (b, d, m) array
        Modal forces of a pressure of 1 Pa on each of them, and of a shear of 1 Pa (in space two,
        along t and t2).
    stiffness : (m, m) array or None
        Full modal stiffness [1/s^2] where it is not ``diag(angular_frequencies^2)``: modes coupled
        by circulatory forces, its skew part, or by rotation.
    rotation : ModalRotation or None
        Rotation of the body, whose Coriolis and stiffening terms damping and stiffness include.
    contact_normals : (n, d) array or None
        Unit normal at each contact node, out of the other side; see :attr:`tangents`. None means
        that of the ground everywhere: (0, 1), in space (0, 0, 1).
    on_ground : (n,) bool array or None
        Whether the other side of each contact node is the ground, not a body; None means all.
    parts : tuple of BodyPart
        The bodies, if there are several.
    constant_load : (m,) array or None
        Constant modal forces: of preloaded links between bodies, of a change of temperature, of
        the rotation of a sector.
    springs : tuple of str
        Groups that are no interfaces, but nonlinear springs: one node each, which moves along its
        normal only.
    first_passes : tuple of (str, int)
        Interfaces of two passes, and how many of the nodes belong to the first one.
    large_deflections : tuple of LargeDeflectionForces
        Forces of large deflections, of each body that has them.

    Raises
    ------
    InputError
        For arrays of wrong shape, values that are not finite, tributary lengths or a thickness
        that are not positive, normals that are not of length one, and groups or parts that do not
        add up.
    """

    angular_frequencies: Array
    damping: Array
    T: Array
    positions: Array
    tributary: Array
    extra: tuple[str, ...] = ()
    mode_shapes: ModeShapes | None = None
    quality: ReductionQuality | None = None
    groups: tuple[tuple[str, int], ...] = ()
    thickness: float | None = None
    inertia_rows: Array | None = None
    boundaries: tuple[str, ...] = ()
    boundary_rows: Array = field(default_factory=lambda: np.zeros((0, 2, 0)))
    stiffness: Array | None = None
    rotation: ModalRotation | None = None
    contact_normals: Array | None = None
    on_ground: NDArray[np.bool_] | None = None
    parts: tuple[BodyPart, ...] = ()
    constant_load: Array | None = None
    springs: tuple[str, ...] = ()
    first_passes: tuple[tuple[str, int], ...] = ()
    large_deflections: tuple[LargeDeflectionForces, ...] = ()

    def __post_init__(self) -> None:
        if np.ndim(self.T) != 3 or np.shape(self.T)[1] not in (3, 6):
            raise InputError(f"Modal basis: T must have shape (P, 3, m) in the plane or (P, 6, m) "
                             f"in space, not {np.shape(self.T)}.")
        if not self.boundaries and not np.size(self.boundary_rows):
            object.__setattr__(self, "boundary_rows", np.zeros((0, self.dimension, self.modes)))
        frozen_arrays(self)
        check_groups(self)
        check_shapes(self)
        check_sides(self)

    def summary(self) -> list[tuple[str, str]]:
        """Modes, frequencies, damping, contact nodes and points."""
        elastic = self.angular_frequencies > 0.0
        hertz = [f"{value:.5g}" for value in np.sort(self.frequencies_hz[elastic])]
        middle = hertz if len(hertz) < 6 else [*hertz[:3], "...", hertz[-1]]
        diagonal = (self.damping == np.diag(np.diag(self.damping))).all()
        full = "full matrix" + _skew(self.damping, ", in part gyroscopic")
        groups = [f"{count} {name}" for name, count in self.groups if name not in self.springs]
        return [
            ("modes", f"{self.modes}, {self.rigid_modes} rigid"),
            ("frequencies", f"{', '.join(middle)} Hz" if hertz else "none"),
            ("damping", "none" if not self.damping.any() else full if not diagonal
             else f"ratios {span(self.damping_ratios[elastic])}"),
            *([] if self.stiffness is None else
              [("stiffness", "full matrix" + _skew(self.stiffness, ", in part circulatory"))]),
            *([] if self.rotation is None else
              [("rotation", quantity(self.rotation.speed, "rad/s"))]),
            *([("bodies", listed([
                part.name + f" ({count(part.modes[1], 'mode')})" * (part.modes[1] > 0)
                for part in self.parts]))] if self.parts else []),
            ("contact nodes", f"{np.count_nonzero(~self.spring_nodes)}"
             + (f" ({listed(groups)})" if len(groups) > 1 or (groups and self.parts) else "")),
            *([("nonlinear springs", listed(self.springs))] if self.springs else []),
            *(line for one in self.large_deflections for line in one.summary()),
            ("points", listed(["B", "C", *self.extra])),
            ("shapes over the body", "none" if self.mode_shapes is None
             else f"at {len(self.mode_shapes.nodes)} nodes"),
        ]

    @property
    def dimension(self) -> int:
        """2 in the plane, 3 in space."""
        return 2 if np.shape(self.T)[1] == 3 else 3

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the rows of a point: x, y, phi; in space x, y, z, phi_x, phi_y, phi_z."""
        return ("x", "y", "phi") if self.dimension == 2 else (
            "x", "y", "z", "phi_x", "phi_y", "phi_z")

    def point_row(self, point: str | int, component: str) -> Array:
        """Row (m,) of a component of the motion of a point; InputError for unknown ones."""
        index = self.point_index(point)
        if component not in self.components:
            raise InputError(f"The component {component!r} at {point!r} must be one of "
                             f"{choices(self.components)}.")
        return np.asarray(self.T[index, self.components.index(component)])

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
    def normals(self) -> Array:
        """Unit normal (n, d) at each contact node, out of the other side."""
        if self.contact_normals is None:
            return np.eye(self.dimension)[[-1] * self.contact_nodes]
        return self.contact_normals

    @property
    def tangents(self) -> Array:
        """Unit tangents at each contact node: (n, 2), ``(n_y, -n_x)``; in space (n, 2, 3), t, t2.

        There t is the projection of global x on the tangent plane (of y where the normal is within
        10 degrees of x), ``t2 = n x t``.
        """
        if self.dimension == 2:
            return self.normals[:, ::-1] * [1.0, -1.0]
        return tangents_of(self.normals)

    @property
    def ground_nodes(self) -> NDArray[np.bool_]:
        """Whether the other side of each contact node (n,) is the ground."""
        if self.on_ground is None:
            return np.ones(self.contact_nodes, dtype=bool)
        return self.on_ground

    @property
    def spring_nodes(self) -> NDArray[np.bool_]:
        """Whether each contact node (n,) is a nonlinear spring between two points."""
        return np.repeat([name in self.springs for name, _ in self.groups],
                         [count for _, count in self.groups]).astype(bool)

    @property
    def moving_points(self) -> NDArray[np.bool_]:
        """Whether each point (P,) of T is a place that some mode moves; springs are none."""
        found = np.array(np.abs(self.T).any(axis=(1, 2)))
        found[2 : 2 + self.contact_nodes] &= ~self.spring_nodes
        return found

    @property
    def stiffness_matrix(self) -> Array:
        """Modal stiffness (m, m) [1/s^2]: ``stiffness``, or ``diag(angular_frequencies^2)``."""
        return np.diag(self.angular_frequencies**2) if self.stiffness is None else self.stiffness

    @property
    def centrifugal_load(self) -> Array:
        """Constant modal forces (m,) of the rotation; zero without one."""
        if self.rotation is None:
            return np.zeros(self.modes)
        return self.rotation.speed**2 * self.rotation.load

    def with_rotation_speed(self, speed: float) -> "ModalBasis":
        """A copy whose body rotates at another speed [rad/s]; InputError if it does not rotate."""
        require_finite("with_rotation_speed", speed=speed)
        given = self.rotation
        if given is None:
            raise InputError("The body of this modal basis does not rotate; make the basis by "
                             "modal_basis(body, ..., rotation=Rotation(speed)).")
        return replace(
            self, damping=self.damping + (speed - given.speed) * given.coriolis,
            stiffness=self.stiffness_matrix + (speed**2 - given.speed**2) * given.stiffening,
            rotation=replace(given, speed=float(speed)))

    @property
    def rigid_modes(self) -> int:
        """Number of modes of frequency zero; those of one body come first."""
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
        """T (3 (2 + n), m), in space (6 (2 + n), m), in the order of (4.1-13): B, C, contact."""
        return self.T[: 2 + self.contact_nodes].reshape(-1, self.modes)

    @property
    def contact_T(self) -> Array:
        """Rows (n, 3, m), in space (n, 6, m), of the contact nodes."""
        return self.T[2 : 2 + self.contact_nodes]

    @property
    def contact_x(self) -> Array:
        """Reference abscissae X (n,) of the contact nodes [m]."""
        return self.positions[2 : 2 + self.contact_nodes, 0]

    @property
    def contact_places(self) -> Array:
        """Reference places (n, d) of the contact nodes [m]."""
        return self.positions[2 : 2 + self.contact_nodes]

    @property
    def contact_areas(self) -> Array:
        """Area (n,) of the contact face represented by each contact node [m^2].

        InputError for a basis of the plane without thickness.
        """
        if self.dimension == 3:
            return self.tributary
        if self.thickness is None:
            raise InputError("There are no areas and pressures: the modal basis has no thickness; "
                             "give thickness=... [m] where the basis is made, or use the "
                             "line load [N/m].")
        return self.tributary * self.thickness

    def point_index(self, point: str | int) -> int:
        """Index into ``T`` of B, C, a further named point, or a contact node by its number.

        InputError for an unknown point.
        """
        require_kind("A point", (str, int), point=point)
        if isinstance(point, bool):
            raise InputError(f"A point: {point!r} must be a name, or the number of a contact node.")
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

    @property
    def elastic_compliance(self) -> Array:
        """Displacement (P, d) of each point along each axis per unit force there, in elastic modes.

        That of uncoupled modes: of the body without circulatory forces and rotation.
        """
        elastic = self.angular_frequencies > 0.0
        rows = self.T[:, : self.dimension, elastic] / self.angular_frequencies[elastic]
        return np.asarray((rows**2).sum(axis=2))

    @property
    def elastic_load_compliance(self) -> Array:
        """``f^T u`` of gravity and of the boundary loads as in ReductionQuality, in elastic modes.

        (1 + b, d); NaN for gravity without rows of inertia.
        """
        gravity = np.full((self.dimension, self.modes), np.nan) if self.inertia_rows is None else (
            self.inertia_rows)
        elastic = self.angular_frequencies > 0.0
        rows = np.concatenate([gravity[None], self.boundary_rows])[..., elastic]
        return np.asarray(((rows / self.angular_frequencies[elastic]) ** 2).sum(axis=2))

    def boundary_row(self, boundary: str) -> Array:
        """Rows (d, m) of :attr:`boundary_rows` by name; InputError for an unknown boundary."""
        if boundary not in self.boundaries:
            raise InputError(f"The basis has no boundary '{boundary}'"
                             f"{nearest(boundary, self.boundaries)}; its boundaries are: "
                             f"{choices(self.boundaries) or 'none'}.")
        return np.asarray(self.boundary_rows[self.boundaries.index(boundary)])

    def fields(self, q: ArrayLike, body: str | None = None) -> BodyFields:
        """Displacement and stress over the body at modal coordinates q (m,).

        For example ``basis.fields(equilibrium(system).modal_coordinates)``; with ``body`` those of
        one of several bodies. Stresses are as good as the modes are for the loads: see ``loads`` of
        :func:`~fecontact.modal_basis`. With large deflections they are the second ones of Piola
        and Kirchhoff, see :class:`~fecontact.fem.BodyFields`.

        Raises
        ------
        InputError
            For a basis without shapes over the body, another number of coordinates, or an unknown
            body.
        """
        shapes, values = self.mode_shapes, as_floats(q, "The modal coordinates")
        if shapes is None:
            raise InputError("The modal basis holds no shapes over the body; make it with "
                             "modal_basis(body, ...).")
        if values.shape != (self.modes,):
            raise InputError(f"The modal coordinates must have shape ({self.modes},), not "
                             f"{values.shape}.")
        elements = shapes.cells if shapes.elements is None else shapes.elements
        first, end = 0, len(shapes.nodes)
        if body is not None:
            names = {part.name: part.nodes for part in self.parts}
            if body not in names:
                raise InputError(f"fields: there is no body {body!r}{nearest(body, names)}; the "
                                 f"bodies are: {choices(names) or 'one without a name'}.")
            first, end = names[body][0], sum(names[body])
            elements = elements[(elements[:, 0] >= first) & (elements[:, 0] < end)] - first
        return BodyFields(shapes.nodes[first:end], elements, shapes.shapes[first:end] @ values,
                          shapes.stress_terms[first:end]
                          @ shapes.stress_coordinates(values[None])[0],
                          None if shapes.temperature is None else shapes.temperature[first:end])

    def with_dashpots(self, dashpots: Mapping[str | int, Sequence[float]]) -> "ModalBasis":
        """A copy with dashpots between points of the body and the inertial frame.

        Parameters
        ----------
        dashpots : mapping of point to (b_x, b_y), in space (b_x, b_y, b_z)
            Points by name, contact nodes by number; damping along the axes, zero or above
            [N s/m]. ``b row^T row`` is added to the modal damping matrix, which becomes full.

        Raises
        ------
        InputError
            For a point that does not exist, or a damping that is negative or not finite.
        """
        damping = np.array(self.damping)
        require_kind("with_dashpots", Mapping, dashpots=dashpots)
        for point, given in dashpots.items():
            values = as_floats(given, f"Dashpot at {point!r}: damping")
            if values.shape != (self.dimension,):
                number = ("two numbers, b_x and b_y" if self.dimension == 2 else
                          "three numbers, b_x, b_y and b_z")
                raise InputError(f"Dashpot at {point!r}: damping must be {number}, not an array of "
                                 f"shape {values.shape}.")
            for row, b in zip(self.T[self.point_index(point)], values.tolist(), strict=False):
                if not 0.0 <= b < np.inf:
                    raise InputError(f"Dashpot at {point!r}: damping {b!r} must be finite and "
                                     f"zero or above.")
                damping += b * np.outer(row, row)
        return replace(self, damping=damping)

    def select(self, modes: Sequence[int]) -> "ModalBasis":
        """A copy with the given modes only, by number from 0, in ascending order.

        For example, leaving out the rigid rotation of a block prevents tilting. InputError for a
        mode that does not exist.
        """
        require_kind("select", (Sequence, np.ndarray), modes=modes)
        chosen = np.unique(as_integers(modes, "The modes to select"))
        if not chosen.size or len(chosen) != len(modes) or chosen[0] < 0 or (
                chosen[-1] >= self.modes):
            raise InputError(f"modes {list(modes)} must be different numbers from 0 to "
                             f"{self.modes - 1}, at least one.")
        given, quality, turning = self.mode_shapes, self.quality, self.rotation
        dropped = np.setdiff1d(np.arange(self.modes), chosen)
        if any(one.coordinates[:, dropped].any() or one.cubic[:, dropped].any()
               for one in self.large_deflections):
            raise InputError("select would leave out coordinates on which forces of large "
                             "deflections act; make the basis with fewer modes instead.")
        below = np.searchsorted(chosen, np.arange(self.modes + 1))
        return replace(
            self,
            angular_frequencies=self.angular_frequencies[chosen],
            damping=self.damping[np.ix_(chosen, chosen)],
            T=self.T[:, :, chosen],
            inertia_rows=None if self.inertia_rows is None else self.inertia_rows[:, chosen],
            boundary_rows=self.boundary_rows[..., chosen],
            stiffness=None if self.stiffness is None else self.stiffness[np.ix_(chosen, chosen)],
            rotation=None if turning is None else replace(
                turning, coriolis=turning.coriolis[np.ix_(chosen, chosen)],
                stiffening=turning.stiffening[np.ix_(chosen, chosen)], load=turning.load[chosen]),
            mode_shapes=None if given is None else replace(
                given, shapes=given.shapes[..., chosen], stress=given.stress[..., chosen],
                nonlinear_stress=None if given.nonlinear_stress is None else replace(
                    given.nonlinear_stress,
                    coordinates=given.nonlinear_stress.coordinates[:, chosen])),
            constant_load=None if self.constant_load is None else self.constant_load[chosen],
            large_deflections=tuple(one.in_modes(np.eye(self.modes)[:, chosen])
                                    for one in self.large_deflections),
            parts=tuple(replace(part, modes=(int(below[first]), int(below[end] - below[first])))
                        for part in self.parts
                        for first, end in [(part.modes[0], sum(part.modes))]),
            quality=None if quality is None else replace(
                quality, residuals=quality.residuals[chosen],
                vibration_modes=int(np.count_nonzero(chosen < quality.vibration_modes))),
        )


def _skew(matrix: Array, words: str) -> str:
    return words if (matrix != matrix.T).any() else ""
