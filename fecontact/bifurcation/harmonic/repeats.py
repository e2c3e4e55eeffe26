r"""Bodies that move as another one does at another time, in harmonic balance.

Under engine order m a wheel of N equal sectors answers with a wave: sector s moves as sector 0
does, a time later, ``u_s(t) = u_0(t - m s T / N)`` with the period T of the excitation. The forces
on sector 0 then follow from its own motion and those of its two neighbours, which are known from
it. The equations of the neighbours are replaced by this relation.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.series import shifted
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, nearest, require_finite
from fecontact.core.types import Array, Integers
from fecontact.system.fields.vector_field import VectorField


@dataclass(frozen=True)
class Repeats:
    """Bodies whose modal coordinates are those of one body at other times.

    Their equations of motion, and the loads on them, do not count. Modal coordinates must mean the
    same for all of them: give them the same basis, with directions that turn with the sector.

    Parameters
    ----------
    body : str
        The body whose equations are solved.
    shifts : mapping of name to float
        For each other body, how much later than ``body`` it moves, in periods of the orbit:
        ``q_name(t) = q_body(t - shift T)``.

    Raises
    ------
    InputError
        For shifts that are not finite, none, or one of the body itself.
    """

    body: str
    shifts: Mapping[str, float]

    def __post_init__(self) -> None:
        require_kind("Repeats", str, body=self.body)
        require_kind("Repeats", Mapping, shifts=self.shifts)
        for name, shift in self.shifts.items():
            require_kind("Repeats: shifts", str, name=name)
            require_finite(f"Repeats: shifts of '{name}'", shift=shift)
        if not self.shifts or self.body in self.shifts:
            raise InputError(f"Repeats: shifts must name at least one body other than "
                             f"'{self.body}'.")
        object.__setattr__(self, "shifts", MappingProxyType(dict(self.shifts)))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.body, dict(self.shifts))

    def attributes(self) -> dict[str, Any]:
        """Values by name, for branches to store."""
        return {"repeats_of": self.body, "repeated": list(self.shifts),
                "repeat_shifts": np.array(list(self.shifts.values()))}

    @classmethod
    def stored(cls, attributes: Mapping[str, Any]) -> "Repeats | None":
        """The reverse of :meth:`attributes`."""
        if "repeats_of" not in attributes:
            return None
        return cls(str(attributes["repeats_of"]), dict(zip(
            map(str, attributes["repeated"]), map(float, attributes["repeat_shifts"]),
            strict=True)))


@dataclass(frozen=True, eq=False)
class Ties:
    """Modes (k,) of the body that is solved for, and those of each other one with its shift."""

    own: Integers
    others: tuple[tuple[Integers, float], ...]
    repeats: Repeats

    def left_out(self, shape: tuple[int, int]) -> Integers:
        """Indices of the coefficients (2 H + 1, b) that are zero: none."""
        return np.zeros(0, dtype=np.int64)

    def residual(
        self, coefficients: Array, found: Array, period: float, parameter: float, kept: Integers
    ) -> None:
        """Put what the others differ by into the rows of their modes of found (2 H + 1, b)."""
        for modes, shift in self.others:
            found[:, modes] = coefficients[:, modes] - shifted(coefficients[:, self.own], -shift)

    def derivatives(
        self, matrix: Array, coefficients: Array, balance: Array, period: float, parameter: float,
        by_common: Array, kept: Integers,
    ) -> None:
        """Put the derivatives of :meth:`residual` into a matrix ((2 H + 1) b, columns)."""
        L = len(coefficients)
        turns = np.eye(L)
        for modes, shift in self.others:
            by_own = shifted(turns, -shift)
            b = len(matrix) // L
            for mode, own in zip(modes, self.own, strict=True):
                rows = np.arange(L) * b + mode
                matrix[rows] = 0.0
                matrix[rows, rows] = 1.0
                matrix[rows[:, None], (np.arange(L) * b + own)[None]] = -by_own


def ties_of(repeats: Repeats, field: VectorField) -> Ties:
    """Numbers of the modes of the bodies of a field.

    Raises
    ------
    InputError
        For a field without such bodies, or with other numbers of modes.
    """
    parts = {part.name: part.modes for part in field.system().basis.parts} if isinstance(
        field, ContactField) else {}
    found = []
    for name in (repeats.body, *repeats.shifts):
        if name not in parts:
            raise InputError(f"Repeats: there is no body '{name}'{nearest(name, parts)}; the "
                             f"bodies of the system are: {choices(parts) or 'none'}.")
        if not parts[name][1]:
            raise InputError(f"Repeats: links have made common modes of body '{name}' and "
                             f"others; give elastic links between sectors as "
                             f"PolynomialSpring, which keeps the modes apart.")
        if parts[name][1] != parts[repeats.body][1]:
            raise InputError(f"Repeats: body '{name}' has {parts[name][1]} modes and "
                             f"'{repeats.body}' {parts[repeats.body][1]}; give them the same "
                             f"basis.")
        found.append(parts[name][0] + np.arange(parts[name][1]))
    return Ties(found[0], tuple(zip(found[1:], repeats.shifts.values(), strict=True)), repeats)
