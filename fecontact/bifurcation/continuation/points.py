"""Points of branches, and the classes of special points.

A point knows the parameter and the attributes of its branch, so that other branches can start from
it alone. What a method finds at a special point is kept by name in private; each class reads its
own names as attributes, and files store them all.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array, ComplexArray
from fecontact.system.fields.vector_field import VectorField, require_field

if TYPE_CHECKING:
    from fecontact.bifurcation.orbits.motions import PeriodicMotion
    from fecontact.integrate.trajectory import Trajectory

# Kind of a point at which the stability changes though no test function has a zero, or that finer
# meshes do not have.
UNRESOLVED = "unresolved"


@dataclass(frozen=True, eq=False)
class BranchHeader:
    """Parameter and attributes of a branch, known to all its points.

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
        Stored values of the solution, such as state and stability.
    kind : str or None
        What is special about the point: 'fold', 'Hopf', ...; None for the others. On a branch a
        special point has the class of its kind, such as :class:`HopfPoint`.
    header : BranchHeader or None
        Parameter and attributes of its branch; None while the point is on no branch.
    """

    u: Array
    tangent: Array
    values: Mapping[str, Any] = field(default_factory=dict)
    kind: str | None = None
    _details: Mapping[str, Any] = field(default_factory=dict, repr=False)
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
        return "period" in self.values and ("mesh" in self.values or self.by_harmonics)

    @property
    def is_homoclinic(self) -> bool:
        """Whether the point is an orbit homoclinic to a saddle."""
        return "saddle" in self.values and "time" in self.values

    @property
    def by_shooting(self) -> bool:
        """Whether the point is an orbit found by shooting."""
        return self.header is not None and "segments" in self.header.attributes

    @property
    def by_harmonics(self) -> bool:
        """Whether the point is an orbit found by harmonic balance."""
        return self.header is not None and "harmonics" in self.header.attributes

    @property
    def branch(self) -> BranchHeader:
        """Parameter and attributes of the branch.

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
        if "parameters" in known or "parameter_values" not in known:
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
        """The orbit over one period, both ends included; a homoclinic one over its interval.

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
        from fecontact.bifurcation.harmonic.layout import balanced
        from fecontact.bifurcation.homoclinic.open_mesh import sampled
        from fecontact.bifurcation.orbits.motions import collocated, of_runs

        self._require_orbit("orbit: samples", samples)
        if self.is_homoclinic:
            return sampled(self.u, np.asarray(self.values["mesh"], dtype=float),
                           len(self.values["saddle"]), float(self.values["time"]), samples)
        values = None if field is None else self.parameter_values(field)
        period = float(self.values["period"])
        mesh = np.asarray(self.values.get("mesh", ()), dtype=float)
        if self.by_harmonics:
            found = balanced(self.u, self.values, self.branch.attributes, samples)
        elif not self.by_shooting:
            found = collocated(self.u, mesh, len(self.values["minimum"]), period, samples)
        elif field is None:
            raise InputError(f"{self.place} was found by shooting, whose orbits are run again; "
                             f"give the field: point.orbit(field).")
        else:
            found = of_runs(self._runs(field, samples), period)
        periods = int(self.branch.attributes["periods"]) if self.header is not None else 1
        return replace(found, periods=periods, parameter_values=values)

    def trajectory(self, field: VectorField, outputs: int = 1001) -> "Trajectory":
        """The orbit over one period as a trajectory, which can be plotted, stored and rendered.

        Orbits by shooting are run again. Of others the work is integrated over the outputs by the
        trapezoidal rule, so that the error of energies falls with the square of their distance.

        Parameters
        ----------
        field : ContactField
            That of the branch.
        outputs : int
            Number of times; orbits by shooting may have some more.

        Raises
        ------
        InputError
            If the point is no orbit, or the field is not that of a contact system.
        """
        from fecontact.bifurcation.fields.contact_field import ContactField
        from fecontact.bifurcation.orbits.motions import joined, sampled_run

        require_kind("trajectory", ContactField, field=field)
        self._require_orbit("trajectory: outputs", outputs)
        if self.by_shooting:
            return joined(self._runs(field, outputs))
        system = field.system(self.parameter_values(field))  # type: ignore[attr-defined]
        return sampled_run(system, self.orbit(field, outputs))

    def _require_orbit(self, name: str, samples: int) -> None:
        if not (isinstance(samples, int | np.integer) and samples >= 2):
            raise InputError(f"{name} = {samples!r} must be a whole number from 2 on.")
        if not (self.is_orbit or self.is_homoclinic):
            raise InputError(f"{self.place} is no periodic orbit.")

    def _runs(self, field: VectorField, samples: int) -> "list[Trajectory]":
        """Runs of the segments of an orbit by shooting."""
        from fecontact.bifurcation.orbits.motions import run_again, solver_of

        # Shooting is for contact fields alone, the only ones with a system.
        system = field.system(self.parameter_values(field))  # type: ignore[attr-defined]
        return run_again(system, self.u, np.asarray(self.values["mesh"], dtype=float),
                         float(self.values["period"]), samples, solver_of(self.branch.attributes))

    @property
    def located(self) -> bool:
        """Whether a special point was located to the precision of its method.

        If not, :attr:`parameter_error` says how far it may be off.
        """
        return bool(self._details.get("located", True))

    @property
    def parameter_error(self) -> float:
        """Error of a special point's parameter; NaN where it is not estimated.

        On branches of orbits by collocation it is the change of the parameter on a finer mesh.
        """
        return float(self._details.get("parameter_error", np.nan))

    def parameter_text(self, digits: int = 7) -> str:
        """The parameter; with its error where that is estimated, and the digits that it leaves."""
        error, value = self.parameter_error, self.parameter
        if not error > 0.0:
            return f"{value:.{digits}g}"
        known = int(np.ceil(np.log10(max(abs(value), error) / error))) + 1
        return f"{value:.{min(max(known, 3), 12)}g} +- {error:.1g}"

    @property
    def criticality(self) -> str | None:
        """'supercritical', 'subcritical' or 'undecided'; None where no normal form tells it.

        It is known at Hopf points, at forks of equilibria, and of orbits by collocation at period
        doublings and Neimark-Sacker points; of others
        :func:`fecontact.bifurcation.with_normal_form` finds it.
        """
        found = self._details.get("criticality")
        return None if found is None else str(found)

    def _detail(self, name: str) -> Any:
        if name not in self._details:
            known = f"; known are {choices(self._details)}" if self._details else ""
            raise InputError(f"{self.place} has no {name}{known}.")
        return self._details[name]


class _NormalForm(BranchPoint):
    """Points of orbits whose normal form says where others begin."""

    @property
    def coefficient(self) -> float:
        """Coefficient of the normal form; of orbits by collocation."""
        return float(self._detail("coefficient"))

    @property
    def coefficient_error(self) -> float:
        """Error of the coefficient."""
        return float(self._detail("coefficient_error"))


class FoldPoint(BranchPoint):
    """Where a branch of equilibria or orbits turns."""

    @property
    def null_vector(self) -> Array:
        """Direction (d,) in which equilibria go."""
        return np.asarray(self._detail("null_vector"))

    @property
    def coefficient(self) -> float:
        """Quadratic coefficient b of the normal form y' = b y^2.

        Of orbits by collocation |b| with time in periods, y the amplitude of an eigenfunction of
        unit mean square in the scales of the branch.
        """
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

class PeriodDoublingPoint(_NormalForm):
    """Where orbits of twice the period begin."""


class NeimarkSackerPoint(_NormalForm):
    """Where a torus is born of an orbit."""

    @property
    def angle(self) -> float:
        """Angle of the critical multipliers exp(+- i angle) [rad]."""
        return float(self._detail("angle"))


class CrossingPoint(BranchPoint):
    """A branch point: where two branches cross."""

    @property
    def null_vector(self) -> Array:
        """A direction (d,) in which the Jacobian of an equilibrium vanishes."""
        return np.asarray(self._detail("null_vector"))

    @property
    def other_tangent(self) -> Array:
        """Direction (d + 1,) of the other branch of equilibria."""
        return np.asarray(self._detail("other_tangent"))

    @property
    def form(self) -> str:
        """'fork' or 'transcritical', of equilibria."""
        return str(self._detail("form"))

    @property
    def coefficient(self) -> float:
        """Coefficient c of equilibria, in y' = k m y + c y^3 (fork) or k m y + c y^2."""
        return float(self._detail("coefficient"))


class UnresolvedPoint(BranchPoint):
    """Where the stability changes but no test function has a zero, or the mesh is too coarse."""

    @property
    def instead_of(self) -> str | None:
        """Kind that the point has on the mesh of the branch, but not on finer ones."""
        found = self._details.get("instead_of")
        return None if found is None else str(found)

    @property
    def unstable_before(self) -> int:
        """Number of unstable directions before the point; where no test function has a zero."""
        return int(self._detail("unstable_before"))

    @property
    def unstable_after(self) -> int:
        """Number of unstable directions behind it."""
        return int(self._detail("unstable_after"))


class DiscontinuityPoint(BranchPoint):
    """Where a set-valued orbit meets a border of its contact states; see docs/set-valued.md."""

    @property
    def time(self) -> float:
        """When the orbit meets it, from its first event on [s]."""
        return float(self._detail("time"))

    @property
    def nodes(self) -> tuple[int, ...]:
        """The contact nodes that meet it."""
        return tuple(int(node) for node in np.atleast_1d(self._detail("nodes")))

    @property
    def persists(self) -> bool:
        """Whether the branch goes on with orbits of another kind; if not, it ends."""
        return bool(self._detail("persists"))


class ZeroHopfPoint(BranchPoint):
    """Where a curve of folds or Hopf points has both a zero and an imaginary pair."""

    @property
    def frequency_hz(self) -> float:
        """Frequency of the pair [Hz]."""
        return float(self.values["frequency_hz"] if "frequency_hz" in self.values
                     else self._detail("frequency_hz"))


class DoubleHopfPoint(BranchPoint):
    """Where a curve of Hopf points has a second imaginary pair."""

    @property
    def frequency_hz(self) -> float:
        """Frequency of the pair that is followed [Hz]."""
        return float(self.values["frequency_hz"])

    @property
    def second_frequency_hz(self) -> float:
        """Frequency of the other pair [Hz]."""
        return float(self._detail("second_frequency_hz"))


_BORDERS = ("grazing", "grazing-sliding", "crossing-sliding", "switching-sliding",
            "adding-sliding", "lift-off", "corner")
_KINDS: Mapping[str | None, type[BranchPoint]] = {
    **dict.fromkeys(_BORDERS, DiscontinuityPoint),
    "fold": FoldPoint, "Hopf": HopfPoint, "period doubling": PeriodDoublingPoint,
    "Neimark-Sacker": NeimarkSackerPoint, "branch point": CrossingPoint,
    UNRESOLVED: UnresolvedPoint, "zero-Hopf": ZeroHopfPoint, "double Hopf": DoubleHopfPoint}


def special_point(
    u: Array, tangent: Array, values: Mapping[str, Any], kind: str | None,
    details: Mapping[str, Any], header: BranchHeader | None = None,
) -> BranchPoint:
    """A point of the class of its kind, with what was found there by name."""
    return _KINDS.get(kind, BranchPoint)(u, tangent, values, kind, details, header)


def on_branch(point: BranchPoint, header: BranchHeader) -> BranchPoint:
    """The point as one of a branch, of the class of its kind."""
    if not isinstance(point, BranchPoint):
        require_kind("A branch", BranchPoint, point=point)
    known = point.header
    if (known is not None and known.attributes is header.attributes
            and known.parameter_name == header.parameter_name
            and type(point) is _KINDS.get(point.kind, BranchPoint)):
        return point
    return special_point(point.u, point.tangent, point.values, point.kind, point._details, header)


def details_of(point: BranchPoint) -> Mapping[str, Any]:
    """What was found at a special point by name, for files."""
    return point._details


def with_details(point: BranchPoint, **details: Any) -> BranchPoint:
    """The point with more, or other, that was found there."""
    return replace(point, _details={**point._details, **details})


def unresolved(point: BranchPoint) -> BranchPoint:
    """A special point that finer meshes do not have; how well it was located is kept."""
    kept = {name: value for name, value in point._details.items()
            if name in ("located", "parameter_error")}
    return special_point(point.u, point.tangent, point.values, UNRESOLVED,
                         {**kept, "instead_of": point.kind}, point.header)
