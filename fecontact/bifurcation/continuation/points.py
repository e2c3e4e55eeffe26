"""Points of branches: what each stores, and the kinds of special points.

A point knows the parameter and the attributes of its branch, so that other branches can start from
it alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.bifurcation.fields.vector_field import VectorField, require_field
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array, ComplexArray

if TYPE_CHECKING:
    from fecontact.bifurcation.orbits.motions import PeriodicMotion


@dataclass(frozen=True, eq=False)
class BranchHeader:
    """What belongs to all points of a branch.

    Attributes
    ----------
    parameter_name : str
        Name of the parameter.
    attributes : mapping
        Numbers, texts, arrays.
    """

    parameter_name: str
    attributes: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """One solution on a branch.

    Attributes
    ----------
    u : (N + 1,) array
        Unknowns, the parameter last.
    tangent : (N + 1,) array
        Direction of the branch.
    values : mapping
        What the problem stores of each solution, such as states and stability.
    kind : str or None
        What is special about the point: 'fold', 'Hopf', ...; None for the others.
    details : mapping
        What is known of a special point; those of :class:`HopfPoint`, :class:`FoldPoint` and the
        other kinds are their properties too.
    header : BranchHeader or None
        What belongs to the whole branch; None while the point is on no branch.
    """

    u: Array
    tangent: Array
    values: Mapping[str, Any] = field(default_factory=dict)
    kind: str | None = None
    details: Mapping[str, Any] = field(default_factory=dict)
    header: BranchHeader | None = field(default=None, repr=False)

    @property
    def parameter(self) -> float:
        """Value of the parameter."""
        return float(self.u[-1])

    @property
    def place(self) -> str:
        """Where and what the point is, for messages: 'The point at B = 0.5 (fold)'."""
        name = "the parameter" if self.header is None else self.header.parameter_name
        return f"The point at {name} = {self.parameter:.6g} ({self.kind or 'a regular point'})"

    @property
    def is_orbit(self) -> bool:
        """Whether the point is a periodic orbit."""
        return "period" in self.values and "mesh" in self.values

    @property
    def by_shooting(self) -> bool:
        """Whether the point is an orbit found by shooting."""
        return self.header is not None and "segments" in self.header.attributes

    @property
    def branch(self) -> BranchHeader:
        """What belongs to the whole branch.

        Raises
        ------
        InputError
            If the point is on no branch.
        """
        if self.header is None:
            raise InputError(f"{self.place} belongs to no branch; take one from a branch, such as "
                             f"branch.points[-1].")
        return self.header

    def parameter_values(self, field: VectorField) -> Array:
        """Values (k,) of all parameters of a field at the point.

        Those that the branch does not know have the field's base values.

        Raises
        ------
        InputError
            If the point is on no branch over one parameter, or the field has other parameters or
            another number of states.
        """
        require_field(field)
        known, values = self.branch.attributes, field.values
        if "second" in known or "parameter_values" not in known:
            raise InputError(f"{self.place} is on no branch of equilibria or orbits over one "
                             f"parameter.")
        names = known.get("parameter_names", list(field.parameters))
        for name, value in zip(names, np.asarray(known["parameter_values"]), strict=True):
            values[field.index(str(name))] = value
        values[field.index(self.branch.parameter_name)] = self.parameter
        states = len(known.get("state_names", field.state_names))
        if states != field.dimension:
            raise InputError(f"{self.place} has {states} states, but the field {field.dimension}.")
        return values

    def orbit(self, field: VectorField | None = None, samples: int = 1000) -> "PeriodicMotion":
        """The orbit over one period, both ends included.

        Parameters
        ----------
        field : VectorField, optional
            That of the branch; orbits found by shooting are run again and need it. With it the
            motion knows its parameter values, and can start a branch over another parameter.
        samples : int
            Number of times; orbits by shooting may have some more.

        Raises
        ------
        InputError
            If the point is no orbit, or was found by shooting and there is no field.
        """
        from fecontact.bifurcation.orbits.motions import collocated, run_again

        if not (isinstance(samples, int | np.integer) and samples >= 2):
            raise InputError(f"orbit: samples = {samples!r} must be a whole number from 2 on.")
        if not self.is_orbit:
            raise InputError(f"{self.place} is no periodic orbit.")
        values = None if field is None else self.parameter_values(field)
        mesh, period = np.asarray(self.values["mesh"], dtype=float), float(self.values["period"])
        if not self.by_shooting:
            found = collocated(self.u, mesh, len(self.values["minimum"]), period, samples)
        elif field is None:
            raise InputError(f"{self.place} was found by shooting, whose orbits are run again; "
                             f"give the field: point.orbit(field).")
        else:
            # Shooting is for contact fields alone, the only ones with a system.
            found = run_again(field.system(values), self.u, mesh, period,  # type: ignore[attr-defined]
                              samples)
        periods = int(self.branch.attributes["periods"]) if self.header is not None else 1
        return replace(found, periods=periods, parameter_values=values)

    def _detail(self, name: str) -> Any:
        if name not in self.details:
            known = f"; known are {choices(self.details)}" if self.details else ""
            raise InputError(f"{self.place} has no {name}{known}.")
        return self.details[name]


class _LocatedAgain:
    """Points that are located again on finer meshes."""

    @property
    def parameter_error(self: Any) -> float:
        """By how much the parameter changes on finer meshes; of orbits by collocation."""
        return float(self._detail("parameter_error"))


class _NormalForm:
    """Points of orbits whose normal form says where others begin."""

    @property
    def coefficient(self: Any) -> float:
        """Coefficient of the normal form; of orbits by collocation."""
        return float(self._detail("coefficient"))

    @property
    def coefficient_error(self: Any) -> float:
        """Error of the coefficient."""
        return float(self._detail("coefficient_error"))

    @property
    def criticality(self: Any) -> str:
        """'supercritical', 'subcritical' or 'undecided'; of orbits by collocation."""
        return str(self._detail("criticality"))


class FoldPoint(_LocatedAgain, BranchPoint):
    """Where a branch of equilibria or orbits turns."""

    @property
    def null_vector(self) -> Array:
        """Direction (d,) in which equilibria go."""
        return np.asarray(self._detail("null_vector"))

    @property
    def coefficient(self) -> float:
        """Quadratic coefficient of the normal form of equilibria."""
        return float(self._detail("coefficient"))


class HopfPoint(BranchPoint):
    """Where periodic orbits are born of an equilibrium."""

    @property
    def angular_frequency(self) -> float:
        """Imaginary part w of the critical pair of eigenvalues [rad/s]."""
        return float(self._detail("angular_frequency"))

    @property
    def frequency_hz(self) -> float:
        """Its frequency, w / (2 pi) [Hz]."""
        return float(self._detail("frequency_hz"))

    @property
    def period(self) -> float:
        """2 pi / w, period of the orbits that are born [s]."""
        return float(self._detail("period"))

    @property
    def eigenvector(self) -> ComplexArray:
        """Eigenvector (d,) of i w."""
        return np.asarray(self._detail("eigenvector"))

    @property
    def crossing_speed(self) -> float:
        """Rate of the critical pair's real part with the parameter."""
        return float(self._detail("crossing_speed"))

    @property
    def first_lyapunov(self) -> float:
        """First Lyapunov coefficient."""
        return float(self._detail("first_lyapunov"))

    @property
    def first_lyapunov_error(self) -> float:
        """Error of the first Lyapunov coefficient."""
        return float(self._detail("first_lyapunov_error"))

    @property
    def criticality(self) -> str:
        """'supercritical', 'subcritical' or 'undecided'."""
        return str(self._detail("criticality"))


class PeriodDoublingPoint(_LocatedAgain, _NormalForm, BranchPoint):
    """Where orbits of twice the period begin."""


class NeimarkSackerPoint(_LocatedAgain, _NormalForm, BranchPoint):
    """Where a torus is born of an orbit."""

    @property
    def angle(self) -> float:
        """Angle of the critical multipliers exp(+- i angle) [rad]."""
        return float(self._detail("angle"))


class CrossingPoint(_LocatedAgain, BranchPoint):
    """A branch point: where two branches cross."""

    @property
    def null_vector(self) -> Array:
        """A direction (d,) in which the Jacobian of an equilibrium vanishes."""
        return np.asarray(self._detail("null_vector"))

    @property
    def other_tangent(self) -> Array:
        """Direction (d + 1,) of the other branch of equilibria."""
        return np.asarray(self._detail("other_tangent"))


class UnresolvedPoint(_LocatedAgain, BranchPoint):
    """Where the stability changes without a reason that was found, or a mesh is too coarse."""

    @property
    def instead_of(self) -> str | None:
        """What the point looks like on the mesh of the branch alone."""
        found = self.details.get("instead_of")
        return None if found is None else str(found)


_KINDS: Mapping[str | None, type[BranchPoint]] = {
    "fold": FoldPoint, "Hopf": HopfPoint, "period doubling": PeriodDoublingPoint,
    "Neimark-Sacker": NeimarkSackerPoint, "branch point": CrossingPoint,
    "unresolved": UnresolvedPoint}


def on_branch(point: BranchPoint, header: BranchHeader) -> BranchPoint:
    """The point as one of a branch, of the class of its kind."""
    require_kind("A branch", BranchPoint, point=point)
    return _KINDS.get(point.kind, BranchPoint)(point.u, point.tangent, point.values, point.kind,
                                               point.details, header)
