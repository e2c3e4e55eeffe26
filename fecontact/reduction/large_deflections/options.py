"""Options of forces of large deflections in a modal basis."""

from dataclasses import dataclass
from typing import Annotated

from fecontact.core.errors import InputError, require_not_negative, require_positive
from fecontact.core.units import Unit

# Most modes: the numbers of loads and of coefficients grow with their third and fourth power.
MOST = 10


@dataclass(frozen=True)
class LargeDeflections:
    """Options of ``modal_basis(large_deflections=)``: forces of large deflections of some modes.

    Parameters
    ----------
    largest_displacement : float
        Displacement in the first of the modes up to which the forces are fitted, such as twice the
        thickness of a clamped plate, a third of the length of a cantilever, twice the rise of an
        arch [m]. Other modes are deflected with the same energy at most.
    modes : int or sequence of int
        Number of modes with large deflections, lowest elastic one first, or their numbers from 0,
        rigid ones counted; ten at most.
        All other coordinates of the basis stay linear beside them.
    stretching_damping : float
        Least damping ratio of the vectors that complete the modes, from zero to below 1. Without
        damping they keep ringing at frequencies far above those of the modes, which runs have to
        resolve; 0.1 takes the ringing away and hardly changes the motion of the modes.
    accuracy : float, optional
        Largest errors of forces and displacements, relative, in states that were not fitted, also
        those under loads of another shape. Modes of the basis are added to ``modes`` until they are
        met, first the one that lacks most of the displacement.

    Raises
    ------
    InputError
        For values out of range.
    """

    largest_displacement: Annotated[float, Unit("m")]
    modes: int | tuple[int, ...] = 1
    stretching_damping: float = 0.0
    accuracy: float | None = None

    def __post_init__(self) -> None:
        require_positive("LargeDeflections", largest_displacement=self.largest_displacement)
        require_not_negative("LargeDeflections", stretching_damping=self.stretching_damping)
        if self.stretching_damping >= 1.0:
            raise InputError(f"LargeDeflections: stretching_damping = {self.stretching_damping!r} "
                             f"must be below 1.")
        if self.accuracy is not None:
            require_positive("LargeDeflections", accuracy=self.accuracy)
            if self.accuracy >= 1.0:
                raise InputError(f"LargeDeflections: accuracy = {self.accuracy!r} must be below 1.")
        given = self.modes
        chosen = range(given) if type(given) is int else given
        if not isinstance(chosen, range | tuple | list) or not 1 <= len(chosen) <= MOST or (
                len(set(chosen)) < len(chosen)
                or any(type(one) is not int or one < 0 for one in chosen)):
            raise InputError(f"LargeDeflections: modes = {given!r} must be a number of modes from "
                             f"1 to {MOST}, or up to {MOST} different numbers from 0.")
        if not isinstance(given, int):
            object.__setattr__(self, "modes", tuple(given))

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the modes from 0."""
        return tuple(range(self.modes)) if isinstance(self.modes, int) else self.modes
