"""Points of branches.

A point knows the parameter and the attributes of its branch, so that other branches can start from
it alone. Results at a special point are kept by name in private; each class of
:mod:`fecontact.bifurcation.continuation.points` reads its own names as attributes, and files store
them all.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField, require_field

if TYPE_CHECKING:
    from fecontact.bifurcation.orbit_methods import Method
    from fecontact.bifurcation.orbits.motions import PeriodicMotion
    from fecontact.integrate.trajectory import Trajectory


# Coefficients of points of codimension two, in the order in which they are stored.
_NORMAL_FORMS: Mapping[str, tuple[str, ...]] = {
    "cusp": ("c",), "Bautin": ("l2",), "Bogdanov-Takens": ("a", "b"),
    "zero-Hopf": ("b", "c", "d", "e"), "double Hopf": ("p11", "p12", "p21", "p22"),
    "generalised period doubling": ("e",), "Chenciner": ("d",), "resonance 1:1": ("a", "b"),
    "resonance 1:2": ("c", "d"), "resonance 1:3": ("b", "c"), "resonance 1:4": ("a", "b", "d"),
    "fold-flip": ("b", "c", "d", "e"), "fold-Neimark-Sacker": ("b", "c", "d", "e"),
    **dict.fromkeys(("flip-Neimark-Sacker", "double Neimark-Sacker"),
                    ("p11", "p12", "p21", "p22"))}


def attributes_of(field: VectorField, values: Array) -> dict[str, Any]:
    """Names of the states and parameters of a field, with their values, as a branch keeps them."""
    return {"state_names": list(field.state_names), "parameter_names": list(field.parameters),
            "parameter_values": values}


def as_field(given: VectorField | ContactSystem, known: Mapping[str, Any]) -> VectorField:
    """The field of a branch with the attributes ``known``, from the field or its contact system.

    Raises
    ------
    InputError
        If it is neither, or a system without parameters of these names.
    """
    if not isinstance(given, ContactSystem):
        require_field(given)
        return given
    from fecontact.bifurcation.fields.contact_field import contact_field

    return contact_field(given, [str(name) for name in known.get("parameter_names", ())])


@read_only_arrays
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

    @property
    def method(self) -> Any:
        """Options of the method of its orbits; None if it has none."""
        return self.attributes.get("method")


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class BranchPoint(Summarised):
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
        Kind of a special point: 'fold', 'Hopf', ...; None for regular points. On a branch a
        special point has the class of its kind, such as
        :class:`fecontact.bifurcation.HopfPoint`.
    header : BranchHeader or None
        Parameter and attributes of its branch; None while the point is on no branch.
    """

    u: Array
    tangent: Array
    values: Mapping[str, Any] = field(default_factory=dict)
    kind: str | None = None
    _details: Mapping[str, Any] = field(default_factory=dict, repr=False)
    header: BranchHeader | None = field(default=None, repr=False)

    def summary(self) -> list[tuple[str, str]]:
        """Kind, parameters, period and stability, and what else is stored."""
        names = ("parameter",) if self.header is None else self.header.attributes.get(
            "parameters", (self.header.parameter_name,))
        known = self.values
        return [
            ("kind", self.kind or "regular"),
            (str(names[0]), self.parameter_text()),
            *((str(name), f"{known[name]:.7g}") for name in names[1:] if name in known),
            *((name, f"{known[name]:.7g}") for name in ("period", "time") if name in known),
            *([("criticality", self.criticality)] if self.criticality else []),
            *([("stable", "yes" if known["stable"] else "no")]
              if self.kind is None and "stable" in known else []),
            ("values", ", ".join(known) or "none"),
        ]

    @property
    def parameter(self) -> float:
        """Value of the parameter."""
        return float(self.u[-1])

    @property
    def place(self) -> str:
        """Parameter and kind of the point, for messages: 'The point at B = 0.5 (fold)'."""
        name = "the parameter" if self.header is None else self.header.parameter_name
        return f"The point at {name} = {self.parameter:.6g} ({self.kind or 'a regular point'})"

    @property
    def is_orbit(self) -> bool:
        """Whether the point is a periodic orbit."""
        from fecontact.bifurcation.orbits.orbit_points import holder_of

        return "period" in self.values and holder_of(self) is not None

    @property
    def stores_orbit(self) -> bool:
        """Whether the point holds its whole orbit; :meth:`orbit` runs others again."""
        from fecontact.bifurcation.orbits.orbit_points import orbit_points_of

        return orbit_points_of(self).stores_orbits

    @property
    def method(self) -> "Method":
        """The method by which an orbit was computed, with its options.

        Raises
        ------
        InputError
            If the point is no orbit of a branch.
        """
        from fecontact.bifurcation.orbits.orbit_points import orbit_points_of

        orbit_points_of(self)
        found: Method = self.branch.method
        return found

    @property
    def is_homoclinic(self) -> bool:
        """Whether the point is an orbit homoclinic to a saddle."""
        return "saddle" in self.values and "time" in self.values

    @property
    def is_torus(self) -> bool:
        """Whether the point is a torus: a quasi-periodic motion."""
        return self.header is not None and "torus_harmonics" in self.header.attributes

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

        Parameters that the branch does not know have the field's base values.

        Raises
        ------
        InputError
            If the point is on no branch over one parameter, or of orbits under a condition over
            two, or the field has other parameters or
            another number of states.
        """
        require_field(field)
        known = self.branch.attributes
        if "condition" in known:
            return self._curve_values(field)
        if "parameters" in known or "parameter_values" not in known:
            raise InputError(f"{self.place} is on no branch of equilibria or orbits over one "
                             f"parameter; at a value on a curve over two an event of "
                             f"ContinuationOptions gives a point.")
        values = self._values_of(field, self.branch.parameter_name)
        states = len(known.get("state_names", field.state_names))
        if states != field.dimension:
            raise InputError(f"{self.place} has {states} states, but the field {field.dimension}.")
        return values

    def _curve_values(self, field: VectorField) -> Array:
        """Values (k,) of all parameters of a field at a point of a curve over two of them."""
        return self._values_of(field, *self.branch.attributes["parameters"])

    def _values_of(self, field: VectorField, *unknown: str) -> Array:
        """Values (k,) of the parameters of the branch, the last unknowns those of these names."""
        known, values = self.branch.attributes, field.values
        names = known.get("parameter_names", list(field.parameters))
        for name, value in zip(names, np.asarray(known["parameter_values"]), strict=True):
            values[field.index(str(name))] = value
        for name, value in zip(unknown, self.u[::-1].tolist(), strict=False):
            values[field.index(str(name))] = value
        return values

    def orbit(
        self, field: VectorField | ContactSystem | None = None, samples: int = 1000
    ) -> "PeriodicMotion":
        """The orbit over one period, both ends included; a homoclinic one over its interval.

        Parameters
        ----------
        field : VectorField or ContactSystem, optional
            Field or system of the branch; orbits found by shooting are run again and need it.
            With it the motion knows its parameter values and the names of its states.
        samples : int
            Number of times; orbits by shooting may have some more.

        Raises
        ------
        InputError
            If the point is no orbit, or was found by shooting and there is no field.
        """
        from fecontact.bifurcation.homoclinic.open_mesh import sampled
        from fecontact.bifurcation.orbits.orbit_points import orbit_points_of

        self._require_orbit("orbit: samples", samples)
        if field is not None:
            field = as_field(field, self.branch.attributes)
        if self.is_homoclinic:
            found = sampled(self.u, np.asarray(self.values["mesh"], dtype=float),
                            len(self.values["saddle"]), float(self.values["time"]), samples)
            return found if field is None else replace(
                found, parameter_values=self._curve_values(field), state_names=field.state_names)
        values = None if field is None else self.parameter_values(field)
        found = orbit_points_of(self).motion(self, field, samples)
        periods = int(self.branch.attributes["periods"]) if self.header is not None else 1
        return replace(found, periods=periods, parameter_values=values,
                       state_names=() if field is None else field.state_names)

    def trajectory(
        self, field: VectorField | ContactSystem, outputs: int = 1001
    ) -> "Trajectory":
        """The orbit over one period as a trajectory, which can be plotted, stored and rendered.

        Orbits by shooting are run again. Of others the work is integrated over the outputs by the
        trapezoidal rule, so that the error of energies falls with the square of their distance.

        Parameters
        ----------
        field : ContactField or ContactSystem
            Field or system of the branch.
        outputs : int
            Number of times; orbits by shooting may have some more.

        Raises
        ------
        InputError
            If the point is no orbit, or the field is not that of a contact system.
        """
        from fecontact.bifurcation.fields.contact_field import ContactField
        from fecontact.bifurcation.orbits.orbit_points import orbit_points_of

        require_kind("trajectory", (ContactField, ContactSystem), field=field)
        self._require_orbit("trajectory: outputs", outputs)
        known = as_field(field, self.branch.attributes)
        assert isinstance(known, ContactField)
        return orbit_points_of(self).trajectory(self, known, outputs)

    def _require_orbit(self, name: str, samples: int) -> None:
        if not (isinstance(samples, int | np.integer) and samples >= 2):
            raise InputError(f"{name} = {samples!r} must be a whole number from 2 on.")
        if not (self.is_orbit or self.is_homoclinic):
            raise InputError(f"{self.place} is no periodic orbit.")

    @property
    def located(self) -> bool:
        """Whether a special point was located to the precision of its method.

        If not, :attr:`parameter_error` says how far it may be off.
        """
        return bool(self._details.get("located", True))

    @property
    def parameter_error(self) -> float:
        """Error of a special point's parameter; NaN where it is not estimated.

        On branches and curves of orbits by collocation it is the change of the parameter on a finer
        mesh or, where the point is not found there, over the stretch that was searched.
        """
        return float(self._details.get("parameter_error", np.nan))

    @property
    def second_parameter_error(self) -> float:
        """Error of the second parameter, on curves of orbits over two; see parameter_error."""
        return float(self._details.get("second_parameter_error", np.nan))

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

    @property
    def normal_form(self) -> dict[str, float]:
        r"""Coefficients by name, of points of codimension two; empty for others.

        With amplitudes z of critical eigenvectors of length one, x = z q + conj(z q), u of real
        ones and r = |z|: 'c' of a cusp, u' = c u^3; 'l2' of a Bautin point, the second Lyapunov
        coefficient, r' = w l2 r^5; 'a' and 'b' of a Bogdanov-Takens point, u'' = a u^2 + b u u',
        a > 0; 'b', 'c', 'd' and 'e' of a zero-Hopf point, u' = b u^2 + c r^2, r' = (d u + e u^2) r,
        b > 0; 'p11' to 'p22' of a double Hopf point, r1' = r1 (p11 r1^2 + p12 r2^2),
        r2' = r2 (p21 r1^2 + p22 r2^2), first the pair that is followed. One that is not defined is
        left out, as 'e' is where b or c is zero.

        Of orbits by collocation eigenfunctions have unit mean square in the scales of the curve,
        time is in periods, and amplitudes turn with the multipliers: u' = c u^3 of a cusp,
        u' = e u^5 of a generalised period doubling, r' = d r^5 of a Chenciner point;
        u'' = a u^2 + b u u', a > 0, of a resonance 1:1, u'' = c u^3 + d u^2 u' of 1:2,
        z' = b conj(z)^2 + (c + i f) z r^2, b > 0, of 1:3 (f depends on the choice of z),
        z' = (a + i b) z r^2 + d conj(z)^3, d > 0, of 1:4; the form of a zero-Hopf point where a
        fold meets a doubling (r its amplitude) or a pair, that of a double Hopf point where a pair
        meets a doubling (r1) or another pair.

        References
        ----------
        Y. A. Kuznetsov, SIAM J. Numer. Anal. 36, 1104-1124 (1999). V. De Witte, F. Della Rossa,
        W. Govaerts, Y. A. Kuznetsov, SIAM J. Appl. Dyn. Syst. 12, 722-788 (2013).
        """
        return self._by_name("normal_form")

    @property
    def normal_form_errors(self) -> dict[str, float]:
        """Errors of :attr:`normal_form`.

        Of equilibria differences of two formulas for the derivatives, of orbits the change from
        half the intervals, with that between two sizes of the amplitudes. Infinite for cubic and
        quintic terms of orbits along which second derivatives jump, as those of friction with
        exp(-b |v|) do at zero slip: the share of such jumps is not in the coefficients.
        """
        return self._by_name("normal_form_error")

    def _by_name(self, detail: str) -> dict[str, float]:
        found = np.atleast_1d(self._details.get(detail, ()))
        names = _NORMAL_FORMS[str(self.kind)] if len(found) else ()
        return {name: value for name, value in zip(names, found.tolist(), strict=True)
                if not np.isnan(value)}

    def _detail(self, name: str) -> Any:
        if name not in self._details:
            known = f"; known are {choices(self._details)}" if self._details else ""
            raise InputError(f"{self.place} has no {name}{known}.")
        return self._details[name]
