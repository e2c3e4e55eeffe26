"""Springs between two points whose force is not linear: polynomial, with play, piecewise linear.

They are no part of the stiffness matrix. Each becomes one node of the system whose only motion is
the elongation along its direction, with a law that pulls as well as pushes.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, ClassVar

import numpy as np

from fecontact.core.errors import InputError, choices, nearest, require_finite
from fecontact.core.tables import located
from fecontact.core.types import Array, Coordinates
from fecontact.core.units import Unit
from fecontact.laws.normal.bilateral import (
    BilateralLaw,
    BilateralPiecewise,
    BilateralPlay,
    BilateralPolynomial,
)
from fecontact.reduction.assembly.links import Links, NonlinearSpring, check_ends, spring_direction
from fecontact.reduction.modal_basis import ModalBasis


@dataclass(frozen=True)
class _LawSpring(NonlinearSpring):
    """A spring with a bilateral law, whose parameters have the names of the spring's own."""

    made_of: ClassVar[Any]

    def __post_init__(self) -> None:
        check_ends(self)
        _ = self.law

    @property
    def law(self) -> BilateralLaw:
        """Law of the tension over the elongation."""
        kind = self.made_of
        with located(f"{type(self).__name__}:", kind.__name__):
            given = {entry.name: getattr(self, entry.name) for entry in fields(kind)}
            require_finite(kind.__name__, **{
                name: value for name, value in given.items() if name not in kind.shared_fields})
            return kind(**given)


@dataclass(frozen=True)
class PolynomialSpring(_LawSpring):
    r"""Spring and dashpot with polynomial forces between two points, or a point and the base.

    .. math::

        N = c\,\epsilon + c_2\,\epsilon^2 + c_3\,\epsilon^3 + c_5\,\epsilon^5 + N_0
        + b\,\dot e + b_2\,|\dot e|\,\dot e + b_3\,\dot e^3, \qquad
        \epsilon = e + s, \quad e = d \cdot (u_1 - u_2)

    is the tension [N], which pulls both points together. d points from the second to the first
    place, which stay in line with it: displacements are small.

    Parameters
    ----------
    first : str
        ``body.point``.
    second : str, optional
        Another point; by default the base, which does not move.
    stiffness, cubic_stiffness : float
        c, c_3 [N/m], [N/m^3]; c is below zero for a spring with two places of rest, c_3 above zero
        for one that hardens, below for one that softens.
    damping : float
        b, zero or above [N s/m].
    direction : (x, y) or (x, y, z), optional
        d, of any length; by default along the line between the points.
    preload : float
        N_0 [N].
    shortening : float
        s: prescribed shortening, or how much longer the spring is between the points than when it
        is free [m].
    quadratic_stiffness, quintic_stiffness : float
        c_2, c_5 [N/m^2], [N/m^5], of any sign.
    quadratic_damping, cubic_damping : float
        b_2, b_3, zero or above [N s^2/m^2], [N s^3/m^3].

    Raises
    ------
    InputError
        For values out of range, a spring to the base without direction, or without any stiffness
        and damping.
    """

    first: str
    second: str | None = None
    stiffness: Annotated[float, Unit("N/m")] = 0.0
    cubic_stiffness: Annotated[float, Unit("N/m^3")] = 0.0
    damping: Annotated[float, Unit("N s/m")] = 0.0
    direction: Coordinates | None = None
    preload: Annotated[float, Unit("N")] = 0.0
    shortening: Annotated[float, Unit("m")] = 0.0
    quadratic_stiffness: Annotated[float, Unit("N/m^2")] = field(default=0.0, kw_only=True)
    quintic_stiffness: Annotated[float, Unit("N/m^5")] = field(default=0.0, kw_only=True)
    quadratic_damping: Annotated[float, Unit("N s^2/m^2")] = field(default=0.0, kw_only=True)
    cubic_damping: Annotated[float, Unit("N s^3/m^3")] = field(default=0.0, kw_only=True)

    made_of: ClassVar = BilateralPolynomial

    def __post_init__(self) -> None:
        super().__post_init__()
        if not any((self.stiffness, self.quadratic_stiffness, self.cubic_stiffness,
                    self.quintic_stiffness, self.damping, self.quadratic_damping,
                    self.cubic_damping)):
            raise InputError("PolynomialSpring: all stiffnesses and dampings are zero; give at "
                             "least one of them.")


@dataclass(frozen=True)
class PlaySpring(_LawSpring):
    r"""Spring with play between two points, or a point and the base: stiff beyond a clearance.

    .. math::

        N = N_0 \quad (|\epsilon| \le h), \qquad
        N = N_0 \pm (c\,(|\epsilon| - h) \pm b\,\dot e) \quad (\pm\epsilon > h), \qquad
        \epsilon = e + s, \quad e = d \cdot (u_1 - u_2)

    N is the tension [N], which pulls both points together. What the bracket gives is never
    negative: neither side holds the spring back.

    Parameters
    ----------
    first : str
        ``body.point``.
    second : str, optional
        Another point; by default the base, which does not move.
    stiffness : float
        c beyond the clearance, above zero [N/m].
    clearance : float
        h: play to either side, zero or above [m].
    damping : float
        b beyond the clearance, zero or above [N s/m].
    direction : (x, y) or (x, y, z), optional
        d, of any length; by default along the line between the points.
    preload : float
        N_0, a constant tension [N].
    shortening : float
        s: prescribed shortening [m], which moves the middle of the play to e = -s.

    Raises
    ------
    InputError
        For values out of range, or a spring to the base without direction.
    """

    first: str
    second: str | None = None
    stiffness: Annotated[float, Unit("N/m")] = 0.0
    clearance: Annotated[float, Unit("m")] = 0.0
    damping: Annotated[float, Unit("N s/m")] = 0.0
    direction: Coordinates | None = None
    preload: Annotated[float, Unit("N")] = 0.0
    shortening: Annotated[float, Unit("m")] = 0.0

    made_of: ClassVar = BilateralPlay


@dataclass(frozen=True)
class PiecewiseSpring(_LawSpring):
    r"""Piecewise linear spring and dashpot between two points, or a point and the base.

    .. math:: N = N(e + s) + b\,\dot e + N_0, \qquad e = d \cdot (u_1 - u_2)

    is the tension [N], which pulls both points together; N(e) is linear between the given points
    and goes on as straight beyond the first and the last one.

    Parameters
    ----------
    first : str
        ``body.point``.
    second : str, optional
        Another point; by default the base, which does not move.
    elongations : sequence
        At least two, ascending [m].
    forces : sequence
        Tension at each of them [N].
    damping : float
        b, zero or above [N s/m].
    direction : (x, y) or (x, y, z), optional
        d, of any length; by default along the line between the points.
    preload : float
        N_0 [N].
    shortening : float
        s: prescribed shortening [m].

    Raises
    ------
    InputError
        For values out of range, a table without two ascending elongations or with equal forces,
        or a spring to the base without direction.
    """

    first: str
    second: str | None = None
    elongations: Annotated[tuple[float, ...], Unit("m")] = ()
    forces: Annotated[tuple[float, ...], Unit("N")] = ()
    damping: Annotated[float, Unit("N s/m")] = 0.0
    direction: Coordinates | None = None
    preload: Annotated[float, Unit("N")] = 0.0
    shortening: Annotated[float, Unit("m")] = 0.0

    made_of: ClassVar = BilateralPiecewise

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("elongations", "forces"):
            object.__setattr__(self, name, getattr(self.law, name))


def nonlinear_springs(
    links: Links
) -> dict[str, NonlinearSpring]:
    """The nonlinear springs among links by name; those of a sequence are ``spring_1`` and on."""
    if isinstance(links, Mapping):
        return {name: one for name, one in links.items() if isinstance(one, NonlinearSpring)}
    found = [one for one in links if isinstance(one, NonlinearSpring)]
    return {f"spring_{k}": one for k, one in enumerate(found, start=1)}


@dataclass(frozen=True, eq=False)
class SpringRow:
    """Direction (2,) of a spring, and the places (2,) and points of its ends."""

    direction: Array
    place: Array
    ends: tuple[tuple[str, str], ...]


def spring_row(bases: Mapping[str, ModalBasis], name: str, spring: NonlinearSpring) -> SpringRow:
    """Ends and direction of a nonlinear spring between points of bodies.

    Raises
    ------
    InputError
        For ends that are no points of the bodies, and points that no mode moves along it.
    """
    ends, places, felt = [], [], []
    with located(f"Link '{name}':"):
        for end in (spring.first, spring.second):
            if end is None:
                continue
            body, _, point = end.partition(".")
            if body not in bases:
                raise InputError(f"'{end}' is a point of no body{nearest(body, bases)}; the bodies "
                                 f"are {choices(bases)}.")
            index = bases[body].point_index(point)
            ends.append((body, point))
            places.append(bases[body].positions[index])
            felt.append(bases[body].T[index, : bases[body].dimension])
        direction = spring_direction(spring, *places)
        if not any((direction @ rows).any() for rows in felt):
            raise InputError("the spring has no effect, as its points move in no mode of the "
                             "bodies along it; leave it out.")
    return SpringRow(np.asarray(direction), np.asarray(places[0]), tuple(ends))
