"""Classes of special points of branches, by their kind."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.point import BranchHeader, BranchPoint
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ComplexArray

# Kind of a point at which the stability changes though no test function has a zero, or that finer
# meshes do not have.
UNRESOLVED = "unresolved"
UNRESOLVED_MEANING = ("the stability changes and no bifurcation explains it: multipliers are too "
                      "inaccurate there, or a force has a kink")


class _NormalForm(BranchPoint):
    """Points of orbits whose normal form says where others begin."""

    @property
    def coefficient(self) -> float | None:
        """Coefficient of the normal form; None where it is not known, as by other methods."""
        found = self._details.get("coefficient")
        return None if found is None else float(found)

    @property
    def coefficient_error(self) -> float | None:
        """Error of the coefficient, of orbits by collocation; None where it is not known."""
        found = self._details.get("coefficient_error")
        return None if found is None else float(found)


class FoldPoint(_NormalForm):
    """Fold (limit point), at which a branch of equilibria or orbits turns."""

    @property
    def null_vector(self) -> Array:
        """Direction (d,) in which equilibria go."""
        return np.asarray(self._detail("null_vector"))

    @property
    def coefficient(self) -> float | None:
        """Quadratic coefficient b of the normal form y' = b y^2; None of orbits by other methods.

        Of orbits by collocation |b| with time in periods, y the amplitude of an eigenfunction of
        unit mean square in the scales of the branch.
        """
        return super().coefficient


class HopfPoint(BranchPoint):
    """Hopf point, at which periodic orbits are born of an equilibrium."""

    @property
    def angular_frequency(self) -> float:
        """Imaginary part w of the critical pair of eigenvalues [rad/s]."""
        return float(self._detail("angular_frequency"))

    @property
    def frequency_hz(self) -> float:
        """Frequency of the critical pair, w / (2 pi) [Hz]."""
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
    """Period doubling, at which orbits of twice the period begin."""


class NeimarkSackerPoint(_NormalForm):
    """Neimark-Sacker point, at which a torus is born of an orbit."""

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
    def form(self) -> str | None:
        """'fork' or 'transcritical', of equilibria; None of orbits and at a double zero."""
        found = self._details.get("form")
        return None if found is None else str(found)

    @property
    def coefficient(self) -> float | None:
        """Coefficient c of equilibria, in y' = k m y + c y^3 (fork) or k m y + c y^2.

        None of orbits and at a double zero eigenvalue.
        """
        found = self._details.get("coefficient")
        return None if found is None else float(found)


class UnresolvedPoint(BranchPoint):
    """Change of stability where no test function has a zero, or the mesh is too coarse."""

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
        """Number of unstable directions after the point."""
        return int(self._detail("unstable_after"))


class DiscontinuityPoint(BranchPoint):
    """Border of its contact states that a set-valued orbit meets; see docs/set-valued.md."""

    @property
    def time(self) -> float:
        """Time from the first event to the border [s]."""
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
    """Zero-Hopf point: a curve of folds or Hopf points has both a zero and an imaginary pair."""

    @property
    def frequency_hz(self) -> float:
        """Frequency of the pair [Hz]."""
        return float(self.values["frequency_hz"] if "frequency_hz" in self.values
                     else self._detail("frequency_hz"))


class DoubleHopfPoint(BranchPoint):
    """Double Hopf point, at which a curve of Hopf points has a second imaginary pair."""

    @property
    def frequency_hz(self) -> float:
        """Frequency of the pair that is followed [Hz]."""
        return float(self.values["frequency_hz"])

    @property
    def second_frequency_hz(self) -> float:
        """Frequency of the other pair [Hz]."""
        return float(self._detail("second_frequency_hz"))


_BORDERS = ("grazing", "grazing-sliding", "crossing-sliding", "switching-sliding",
            "adding-sliding", "impact-sliding", "lift-off", "corner")
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


def over_first(point: BranchPoint, kind: str | None) -> BranchPoint:
    """A point of a curve over two parameters as one of some kind on a branch over the first."""
    known = point.branch.attributes
    second = str(known["parameters"][1])
    values = np.array(known["parameter_values"], dtype=float)
    values[list(map(str, known["parameter_names"])).index(second)] = point.u[-2]
    kept = {name: value for name, value in known.items()
            if name not in ("parameters", "kind", "limits", "widths")}
    kept["parameter_values"] = values
    if "scales" in known:
        kept["scales"] = np.delete(np.asarray(known["scales"], dtype=float), -2)
    # Curves of equilibria may have a frequency among their unknowns.
    states = len(point.values["state"]) if "state" in point.values else len(point.u) - 2
    places = [*range(states), -1] if "state" in point.values else np.delete(
        np.arange(len(point.u)), -2)
    return special_point(point.u[places], point.tangent[places], point.values, kind, {},
                         BranchHeader(point.branch.parameter_name, kept))


def branch_points(
    u: Array, tangents: Array, values: Iterable[Mapping[str, Any]], folds: Iterable[int],
    header: BranchHeader | None,
) -> list[BranchPoint]:
    """Points and folds for rows of u and tangents (K, N + 1), ``folds`` (K,) being 0 or 1.

    Each takes a third of the time that a frozen dataclass takes.
    """
    found = []
    nothing: dict[str, Any] = {}
    new = object.__new__
    for at, tangent, stored, fold in zip(u, tangents, values, folds, strict=True):
        point: BranchPoint = new(FoldPoint if fold else BranchPoint)
        own = point.__dict__
        own["u"], own["tangent"], own["values"] = at, tangent, stored
        own["kind"], own["_details"], own["header"] = "fold" if fold else None, nothing, header
        found.append(point)
    return found


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


def require_no_family(point: BranchPoint) -> None:
    """Raise InputError for an orbit of a family, which lies between others at its parameters."""
    if point.header is not None and "family" in point.header.attributes:
        raise InputError(f"{point.place} is one of a family of orbits at the same parameters; use "
                         f"orbit_family(field, point.orbit(field)).")


def details_of(point: BranchPoint) -> Mapping[str, Any]:
    """Details of a special point by name, for files."""
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
