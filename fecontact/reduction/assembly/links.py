"""Links between bodies that do not open: springs, bushings, hinges and welds at named points.

The rows G of rigid links leave the motions ``q = N p`` with N an orthonormal basis of the null
space of G; springs add ``k r^T r`` for the row r of their elongation. Stiffness and mass of what is
left have the eigenmodes P, by which all rows are multiplied.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from typing_extensions import TypeAliasType

from fecontact.core.checks import as_direction, as_floats, require_kind
from fecontact.core.errors import (
    InputError,
    require_finite,
    require_not_negative,
    shown,
)
from fecontact.core.types import Array, ArrayLike, Coordinates
from fecontact.core.units import Unit
from fecontact.laws.base import NormalLaw
from fecontact.reduction.assembly.changed_modes import in_modes
from fecontact.reduction.assembly.face_weld import FaceWeld, welded_rows
from fecontact.reduction.eigenmodes import fixed_signs
from fecontact.reduction.modal_basis import ModalBasis

# Rows and singular values below this, relative to the largest, are round-off.
_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Spring:
    r"""Spring and dashpot between two points, or a point and the base, along a line.

    .. math:: N = c\,(e + s) + b\,\dot e + N_0, \qquad e = d \cdot (u_1 - u_2)

    is the tension [N], which pulls both points together; s is a prescribed shortening, as of a bolt
    that is tightened. d points from the second to the first place, which stay in line with it:
    displacements are small.

    Parameters
    ----------
    first : str
        ``body.point``.
    second : str, optional
        Another point; by default the base, which does not move.
    stiffness : float
        c, zero or above [N/m].
    damping : float
        b, zero or above [N s/m].
    direction : (x, y) or (x, y, z), optional
        d, of any length; by default along the line between the points.
    preload : float
        N_0 [N].
    shortening : float
        s [m].

    Raises
    ------
    InputError
        For values out of range, or a spring to the base without direction.
    """

    first: str
    second: str | None = None
    stiffness: Annotated[float, Unit("N/m")] = 0.0
    damping: Annotated[float, Unit("N s/m")] = 0.0
    direction: Coordinates | None = None
    preload: Annotated[float, Unit("N")] = 0.0
    shortening: Annotated[float, Unit("m")] = 0.0

    def __post_init__(self) -> None:
        check_ends(self)
        require_not_negative("Spring", stiffness=self.stiffness, damping=self.damping)
        require_finite("Spring", preload=self.preload, shortening=self.shortening)

    def tension(
        self, basis: ModalBasis, coordinates: ArrayLike, velocities: ArrayLike | None = None
    ) -> Array:
        """N [N] at modal coordinates (..., m) and velocities of a basis that this spring is in.

        Without velocities that of a state at rest. Raises InputError for unknown points and another
        number of coordinates.
        """
        row, motions = relative_row(basis, self), []
        for name, given in (("coordinates", coordinates), ("velocities", velocities)):
            values = np.zeros(basis.modes) if given is None else np.asarray(given, dtype=float)
            if values.shape[-1:] != (basis.modes,):
                raise InputError(f"Spring: {name} must have {basis.modes} numbers for each state, "
                                 f"not the shape {values.shape}.")
            motions.append(values @ row)
        return np.asarray(self.stiffness * (motions[0] + self.shortening)
                          + self.damping * motions[1] + self.preload)


class NonlinearSpring:
    """A spring between two points that is no part of the stiffness matrix.

    See :mod:`fecontact.reduction.assembly.nonlinear_springs`.
    """

    first: str
    second: str | None
    direction: Coordinates | None

    @property
    def law(self) -> NormalLaw:
        """Law of its node, whose normal force is minus the tension."""
        raise NotImplementedError


@dataclass(frozen=True)
class Bushing:
    """Stiffness and damping of the relative motion of two points along axes and in rotation.

    Parameters
    ----------
    first : str
        ``body.point``.
    second : str, optional
        Another point; by default the base, which does not move.
    stiffness : (c_x, c_y, c_phi), in space six numbers, for x, y, z and rotations about these
        Zero or above [N/m, N m].
    damping : (b_x, b_y, b_phi), in space six numbers
        Zero or above [N s/m, N m s].

    Raises
    ------
    InputError
        For values out of range.
    """

    first: str
    second: str | None = None
    stiffness: tuple[float, ...] = ()
    damping: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _check_points(self)
        for name in ("stiffness", "damping"):
            given = getattr(self, name)
            values = as_floats(given, f"Bushing: {name}")
            if values.shape not in ((0,), (3,), (6,)) or not np.isfinite(values).all() or (
                    values < 0.0).any():
                raise InputError(f"Bushing: {name} = {shown(given)} must be three numbers, for x, "
                                 f"y and rotation (of solids six), zero or above.")
            object.__setattr__(self, name, tuple(values.tolist()))
        for name, other in (("stiffness", self.damping), ("damping", self.stiffness)):
            if not getattr(self, name):
                object.__setattr__(self, name, (0.0,) * (len(other) or 3))
        if len(self.stiffness) != len(self.damping):
            raise InputError(f"Bushing: stiffness and damping must have as many numbers as each "
                             f"other, not {len(self.stiffness)} and {len(self.damping)}.")


@dataclass(frozen=True)
class Hinge:
    """Two points at one place have the same displacement; or one is held by the base.

    Between solids it turns about all axes, as a ball joint does.

    Parameters
    ----------
    first : str
        ``body.point``.
    second : str, optional
        Another point; by default the base, which does not move.
    """

    first: str
    second: str | None = None

    turning: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _check_points(self)


@dataclass(frozen=True)
class Weld(Hinge):
    """Two points at one place have the same displacement and rotation; or one is held by the base.

    Bases with residual vectors or constraint modes of its forces and moments represent the joint
    best: :func:`fecontact.reduction.reduce_bodies` makes them.

    Parameters
    ----------
    first : str
        ``body.point``.
    second : str, optional
        Another point; by default the base, which does not move.
    """

    turning: ClassVar[bool] = False


Link = Spring | Bushing | Hinge | FaceWeld | NonlinearSpring
# Names are of use for nonlinear springs, whose groups and parameters have them.
Links = TypeAliasType("Links", Sequence[Link] | Mapping[str, Link])


def _check_points(link: "Link") -> None:
    owner = type(link).__name__
    require_kind(owner, str, first=link.first)
    require_kind(owner, (str, type(None)), second=link.second)
    if link.first == link.second:
        raise InputError(f"{owner}: first and second are the same point '{link.first}'.")


def check_ends(spring: Spring | NonlinearSpring) -> None:
    """Check the points of a spring, and make its direction a unit vector.

    Raises
    ------
    InputError
        For equal points, a direction of length zero, or a spring to the base without one.
    """
    _check_points(spring)
    owner = type(spring).__name__
    if spring.direction is not None:
        object.__setattr__(spring, "direction", as_direction(
            spring.direction, f"{owner}: direction"))
    elif spring.second is None:
        raise InputError(f"{owner}: a spring to the base needs direction = (x, y).")


def linked(basis: ModalBasis, links: Sequence[Link]) -> ModalBasis:
    """The basis of several bodies with links between them.

    Its modes are those of the linked bodies: no longer blocks of single bodies, so ``modes`` of all
    parts are empty. Rigid links reduce their number; damping becomes a full matrix; constant forces
    of preloaded springs become the ``constant_load``.

    Parameters
    ----------
    basis : ModalBasis
        Basis of one or several bodies.
    links : sequence of Spring, Bushing, Hinge, Weld or FaceWeld
        Between points of the basis; nonlinear springs only count in
        :func:`~fecontact.reduction.assembled_basis`.

    Raises
    ------
    InputError
        For unknown points, rigid links between points at different places, links that no mode
        feels, and links that leave no motion at all.
    """
    require_kind("Links", Sequence, links=links)
    m, d = basis.modes, basis.dimension
    held, springs, stiffness = [np.zeros((0, m))], [np.zeros((0, m))], [np.zeros(0)]
    damping = np.array(basis.damping)
    load = np.zeros(m) if basis.constant_load is None else np.array(basis.constant_load)
    for link in links:
        require_kind("Links", (Spring, Bushing, Hinge, FaceWeld, NonlinearSpring), link=link)
        if isinstance(link, NonlinearSpring):
            raise InputError(f"{_described(link)} is nonlinear and no part of the modes; give it "
                             f"to assembled_basis or ContactSystem, links=.")
        if isinstance(link, FaceWeld):
            held.append(_felt(link, welded_rows(basis, link)))
            continue
        relative = _relative_rows(basis, link)
        if isinstance(link, Hinge):
            _require_one_place(basis, link)
            held.append(_felt(link, relative[: d if link.turning else None]))
            continue
        if isinstance(link, Spring):
            rows = relative_row(basis, link)[None]
            c, b = np.array([link.stiffness]), np.array([link.damping])
            load -= (link.preload + link.stiffness * link.shortening) * rows[0]
        else:
            rows, c, b = relative, np.array(link.stiffness), np.array(link.damping)
            if len(c) != len(rows):
                raise InputError(f"{_described(link)} has {len(c)} stiffnesses, but its points "
                                 f"have {len(rows)} motions; give as many.")
        _felt(link, rows)
        springs.append(rows)
        stiffness.append(c)
        damping += rows.T @ (b[:, None] * rows)
    w, modes = _linked_modes(basis.angular_frequencies, _units(np.concatenate(held)),
                             np.concatenate(springs), np.concatenate(stiffness))
    if not len(w):
        raise InputError("The links leave no motion of the bodies; leave some of them out, or keep "
                         "more modes.")
    return in_modes(basis, w, modes, damping, load)


def _linked_modes(
    w: Array, held: Array, springs: Array, stiffness: Array
) -> tuple[Array, Array]:
    """Frequencies (p,) and modes (m, p) in the given modes with frequencies w (m,).

    Rigid modes are the motions of given rigid modes alone that strain no link, which needs no
    tolerance on frequencies. The others come from the singular values of ``[diag(w); k^1/2 r]``:
    their squares would lose half of the digits of low frequencies.
    """
    rigid = w == 0.0
    strained = np.concatenate([held, _units(springs[stiffness > 0.0])])
    free = np.zeros((len(w), 0))
    if rigid.any():
        # Rows that only strain elastic modes must not be scaled up by their round-off.
        inner = _null_space(strained[:, rigid])
        free = np.zeros((len(w), inner.shape[1]))
        free[rigid] = inner
    rest = _null_space(np.concatenate([held, free.T]))
    strains = np.concatenate([np.diag(w), np.sqrt(stiffness)[:, None] * springs]) @ rest
    values, directions = np.linalg.svd(strains, full_matrices=False)[1:]
    modes = rest @ directions[::-1].T
    return (np.concatenate([np.zeros(free.shape[1]), values[::-1]]),
            np.hstack([free, modes * fixed_signs(modes)]) if modes.shape[1] else free)


def _null_space(rows: Array) -> Array:
    """Orthonormal vectors (m, p) that rows (k, m) map to zero."""
    if not len(rows):
        return np.eye(rows.shape[1])
    values, directions = np.linalg.svd(rows, full_matrices=True)[1:]
    rank = int(np.count_nonzero(values > _ROUND_OFF))
    return directions[rank:].T


def _units(rows: Array) -> Array:
    """Rows of length one, without those of length zero."""
    lengths = np.linalg.norm(rows, axis=1)
    real = lengths > _ROUND_OFF * lengths.max(initial=0.0)
    return np.asarray(rows[real] / lengths[real][:, None])


def _relative_rows(basis: ModalBasis, link: Link) -> Array:
    """Displacements and rotations (3, m) or (6, m) of the first point relative to the second."""
    rows = basis.T[basis.point_index(link.first)]
    return rows if link.second is None else rows - basis.T[basis.point_index(link.second)]


def relative_row(basis: ModalBasis, spring: Spring) -> Array:
    """Elongation (m,) of a spring between points of a basis."""
    ends = [end for end in (spring.first, spring.second) if end is not None]
    direction = spring_direction(spring, *(basis.positions[basis.point_index(end)]
                                           for end in ends))
    return np.asarray(direction @ _relative_rows(basis, spring)[: basis.dimension])


def _felt(link: Link, rows: Array) -> Array:
    if not rows.any():
        raise InputError(f"{_described(link)} has no effect, as its points move in no mode of the "
                         f"bodies along it; leave it out.")
    return rows


def spring_direction(link: Spring | NonlinearSpring, first: Array, *second: Array) -> Array:
    """Unit vector (d,) of a spring between two places (d,), or from one to the base.

    Raises
    ------
    InputError
        If it has neither a direction nor a length.
    """
    if link.direction is not None:
        if len(link.direction) != len(first):
            raise InputError(f"{_described(link)} has direction = {link.direction!r}; it must have "
                             f"{len(first)} components, as the places of its points.")
        return np.array(link.direction)
    length = float(np.linalg.norm(first - second[0]))
    if not length > 0.0:
        raise InputError(f"{_described(link)} has length zero; give its direction = (x, y).")
    return np.asarray((first - second[0]) / length)


def _require_one_place(basis: ModalBasis, link: Hinge) -> None:
    """Rigid links between different places would act on the bodies with a moment."""
    with_nodes = {part.name for part in basis.parts if part.nodes[1]}
    if link.second is None or not {link.first.partition(".")[0],
                                   link.second.partition(".")[0]} <= with_nodes:
        return
    first, second = (basis.positions[basis.point_index(name)] for name in (link.first, link.second))
    assert basis.mode_shapes is not None, "some part has nodes"
    apart = float(np.linalg.norm(first - second))
    if apart > 1e-6 * np.ptp(basis.mode_shapes.nodes, axis=0).max():
        raise InputError(f"{_described(link)} joins points that are {apart:.4g} m apart; put the "
                         f"bodies where they are assembled, or use a Bushing or Spring.")


def _described(link: Link) -> str:
    second = "the base" if link.second is None else f"'{link.second}'"
    return f"The {type(link).__name__} between '{link.first}' and {second}"
