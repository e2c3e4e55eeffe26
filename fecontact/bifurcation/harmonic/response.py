"""Nonlinear frequency responses: branches of forced orbits at several levels."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from numbers import Integral, Real
from types import NoneType
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.attempts import first_that_goes
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchHeader, BranchPoint, as_field
from fecontact.bifurcation.continuation.points import (
    UNRESOLVED,
    UNRESOLVED_MEANING,
    details_of,
    special_point,
)
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions, options_of
from fecontact.bifurcation.continuation.pseudo_arclength import inside
from fecontact.bifurcation.fields.contact_field import ContactField, field_between
from fecontact.bifurcation.fields.observed_row import observed_row
from fecontact.bifurcation.harmonic import branches
from fecontact.bifurcation.harmonic.engine_order import WaveField
from fecontact.bifurcation.harmonic.estimates import observed_of_series
from fecontact.bifurcation.harmonic.forced_starts import (
    Forced,
    require_period,
    start_of,
    values_to_start_at,
)
from fecontact.bifurcation.harmonic.layout import Layout, layout_from, layout_of
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.harmonic.stalled import stall_reason
from fecontact.bifurcation.orbit_methods import Method
from fecontact.bifurcation.orbits.branches import based, orbit_branch
from fecontact.bifurcation.orbits.discretisations import DISCRETISATIONS, discretisation_by
from fecontact.bifurcation.orbits.from_run import periodic_motion
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.bifurcation.orbits.orbit_points import orbit_points_of
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import (
    AnalysisError,
    FecontactError,
    InputError,
    require_not_negative,
    shown,
)
from fecontact.core.read_only import read_only_arrays
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.core.units import Summarised, listed, span
from fecontact.integrate.initial_state import initial_state
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.forcing_period import DRIVE_FREQUENCY, require_effect
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import RestState

# Options of branches, unless others are given.
RESPONSES = ContinuationOptions(points=2000, largest_step=0.03)


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class FrequencyResponse(Summarised):
    """Responses over a frequency, or another parameter, one branch for each level.

    Points of the branches store 'observed_amplitude', 'observed_minimum', 'observed_maximum' and
    'observed_harmonics' (16,) of the observed quantity, in its unit: complex X_k, k = 0..15, with
    x(t) = sum_k Re(X_k exp(i k w t)), w = 2 pi / period.

    Attributes
    ----------
    branches : tuple of Branch
        One for each level.
    level_name : str or None
        Name of the parameter that differs between them.
    levels : (k,) array
        Its values; one that is not a number without such a parameter.
    observed : str
        Name of the observed displacement, such as 'B x'.
    """

    branches: tuple[Branch, ...]
    level_name: str | None
    levels: Array
    observed: str

    def __post_init__(self) -> None:
        if len(self.branches) != len(self.levels) or not self.branches:
            raise InputError(f"FrequencyResponse: {len(self.branches)} branches do not go with "
                             f"{len(self.levels)} levels; each level has one.")

    @property
    def parameter_name(self) -> str:
        """Name of the parameter over which the branches run."""
        return self.branches[0].parameter_name

    def _branch(self, level: int) -> Branch:
        """Branch of a level."""
        count = len(self.branches)
        if not (isinstance(level, Integral) and -count <= level < count):
            raise InputError(f"FrequencyResponse: level = {shown(level)} must be the number of one "
                             f"of its {count} levels, from 0 to {count - 1}.")
        return self.branches[level]

    def amplitude(self, level: int = 0) -> Array:
        """Half the range (N,) of the observed quantity at the points of a branch."""
        return np.asarray(self._branch(level).column("observed_amplitude"))

    def harmonic(self, k: int = 1, level: int = 0) -> ComplexArray:
        """Complex amplitude (N,) of harmonic k of the excitation, x_k = Re(X_k exp(i k w t)).

        Raises
        ------
        InputError
            If the branch has fewer harmonics.
        """
        branch = self._branch(level)
        most = highest_harmonic(branch)
        if not (isinstance(k, Integral) and 0 <= k <= most):
            raise InputError(f"FrequencyResponse.harmonic: k = {shown(k)} must be a whole number "
                             f"from 0 to {most}, the highest harmonic of the response.")
        return np.asarray(branch.column("observed_harmonics")[
            :, k * int(branch.attributes["periods"])])

    def phase(self, level: int = 0) -> Array:
        """Phase (N,) [rad], x_1 = |X_1| sin(w t + phase), continuous along the branch.

        It begins within -pi to pi: a drive or load A sin w t leads below resonance to about zero,
        far above to -pi.
        """
        return np.unwrap(np.angle(1j * self.harmonic(1, level)))

    @property
    def force_name(self) -> str | None:
        """Name of the level of the force where amplitudes are held, which is free then."""
        return self.branches[0].parameter_names[1] if len(
            self.branches[0].parameter_names) > 1 else None

    def force(self, level: int = 0) -> Array:
        """Level (N,) of the force that holds the amplitude, in its unit.

        Raises
        ------
        InputError
            If the amplitude is not held.
        """
        if self.force_name is None:
            raise InputError("FrequencyResponse.force: amplitudes follow from a given force; those "
                             "of controlled_response are held.")
        return np.asarray(self._branch(level).column(self.force_name))

    def _gain(self, level: int) -> Array:
        """Amplitude (N,), over the level of the force where the amplitude is held."""
        found = self.amplitude(level)
        return found if self.force_name is None else found / np.abs(self.force(level))

    def of(
        self, system: ContactSystem | VectorField, observe: tuple[str | int, str] | ArrayLike
    ) -> "FrequencyResponse":
        """Response of the same orbits with another displacement observed.

        Parameters
        ----------
        system : ContactSystem or VectorField
            System or field of the response.
        observe : (point, component) or (d,) sequence
            As for :func:`frequency_response`.

        Raises
        ------
        InputError
            For a point that does not exist, internal variables, or another system.
        """
        require_kind("FrequencyResponse.of", (ContactSystem, VectorField), system=system)
        field = as_field(system, self.branches[0].attributes)
        row, observed = observed_row(field, observe)
        _require_observable(layout_of(field), row)
        return replace(self, observed=observed, branches=tuple(
            _observed_along(branch, field, row, {"observed": observed, "observed_row": row})
            for branch in self.branches))

    def peak(self, level: int = 0) -> BranchPoint:
        """The point of largest amplitude of a branch, or of smallest force at a held one."""
        return self._branch(level).points[int(np.argmax(self._gain(level)))]

    def peak_reached(self, level: int = 0) -> bool:
        """Whether the amplitude falls on both sides of the peak, and the branch is whole.

        Or the force rises. A branch that ends before its bound may have a larger peak beyond.
        Closed branches have no ends.
        """
        branch, place = self._branch(level), int(np.argmax(self._gain(level)))
        return branch.status is BranchStatus.CLOSED or (
            branch.status is BranchStatus.BOUND and 0 < place < len(branch) - 1)

    def summary(self) -> list[tuple[str, str]]:
        """Parameter, levels, special points of each branch, and how branches ended."""
        special = [f"{point.kind} at {point.parameter:.5g}" for branch in self.branches
                   for point in branch.special]
        ends = dict.fromkeys(branch.status.name.lower() for branch in self.branches)
        ranges = np.concatenate([branch.parameter for branch in self.branches])
        rising = [f"{value:.5g}" for level, value in enumerate(self.levels)
                  if not self.peak_reached(level)]
        where = f" at {listed(rising, 6)}" if self.level_name else ""
        extreme = "amplitude is largest" if self.force_name is None else "force is smallest"
        return [("parameter", self.parameter_name), ("range", span(ranges)),
                *([(self.level_name, listed([f"{level:.5g}" for level in self.levels], 6))]
                  if self.level_name else []),
                ("observed", self.observed),
                ("points", listed([str(len(branch)) for branch in self.branches], 6)),
                ("special", listed(special, 5)),
                *([(UNRESOLVED, UNRESOLVED_MEANING)]
                  if any(point.kind == UNRESOLVED for branch in self.branches
                         for point in branch.special) else []),
                *([("peak", f"perhaps not reached{where}: the {extreme} at an end, or a branch "
                            f"stops before its bound")]
                  if rising else []),
                ("ends", ", ".join(ends))]


def highest_harmonic(branch: Branch) -> int:
    """Highest harmonic of the excitation that the points of a branch of a response store."""
    stored = branch.column("observed_harmonics").shape[1] - 1
    # Harmonics that a series does not have are stored as zero.
    stored = min(stored, getattr(branch.method, "highest", stored))
    return stored // int(branch.attributes["periods"])


@one_blas_thread
def frequency_response(
    system: ContactSystem | VectorField, bounds: tuple[float, float],
    parameter: str | None = None, *, levels: Mapping[str, ArrayLike] | None = None,
    observe: tuple[str | int, str] | ArrayLike = ("B", "x"),
    method: Method | None = None, options: ContinuationOptions | None = None,
    start: float | None = None, preload: LoadHistory | RestState | Array | None = None,
) -> FrequencyResponse:
    """Nonlinear frequency responses by any orbit method, with stability and special points.

    A branch starts at one end from rest: the first step of Newton's method is the linear response.
    Where that does not converge, the level is raised to its value along a branch, the other end is
    tried, and last the motion to which a run settles. Folds are followed around. Collocation and
    shooting start from the orbit that harmonic balance finds in this way, or from a run.

    Parameters
    ----------
    system : ContactSystem or VectorField
        Excited with a common period.
    bounds : (float, float)
        Range of the parameter [Hz for the frequency of a drive].
    parameter : str, optional
        Dotted name, by default 'drive.frequency_hz'; the only parameter of a vector field. Any
        other gives responses over it, such as the amplitude of a force.
    levels : mapping of one name, optional
        Another parameter and its values, a branch for each: ``{"drive.amplitude_x": [1.0, 2.0]}``.
    observe : (point, component) or (d,) sequence
        Displacement that is observed; a row of the states of a vector field, by default its first.
    method : HarmonicBalance, Collocation or Shooting, optional
        By default harmonic balance. Shooting is for contact systems alone; it suits steep friction
        and impacts, whose orbits need many harmonics, and each point takes several runs.
    options : ContinuationOptions, optional
        Steps, tolerances; by default up to 2000 points, largest_step 0.03.
    start : float, optional
        Where branches start, by default the lower end; inside, they are followed both ways.
    preload : LoadHistory, RestState or (d,) array, optional
        State [q, q', z] of elements that never slide. Default: no deflection where the body rests
        under the mean loads without friction.

    Raises
    ------
    InputError, AnalysisError
        For a parameter or point that does not exist, the frequency of a drive that moves nothing,
        no excitation with a period, or a level at which no orbit is found to start from.
    """
    require_kind("frequency_response", (ContactSystem, VectorField), system=system)
    require_kind("frequency_response", (str, NoneType), parameter=parameter)
    require_kind("frequency_response", (Real, NoneType), start=start)
    require_kind("frequency_response", (*(one.options for one in DISCRETISATIONS), NoneType),
                 method=method)
    held = preloaded(system, preload)
    chosen = options_of(options or RESPONSES, bounds)
    level_name, values = levels_of(levels)
    if isinstance(system, ContactSystem):
        name = parameter or DRIVE_FREQUENCY
        # Levels may be those of the drive, which is at rest without them.
        if not (level_name or "").startswith("drive."):
            require_effect(system, name)
        ranges = {name: (float(chosen.bounds[0]), float(chosen.bounds[1]))}
        if level_name:
            ranges[level_name] = (float(values.min()), float(values.max()))
        field: VectorField = field_between(system, tuple(ranges.items()))
    else:
        field, name = system, system.parameter_or_only(parameter)
    how = method or HarmonicBalance()
    if how.repeats is not None:
        field = how.repeats.field(field)
    if isinstance(field, WaveField) and held is not None:
        held = field.waves.state(field, held)
    row, observed = observed_row(field, observe)
    low, high = chosen.bounds
    if level_name == name:
        raise InputError(f"frequency_response: levels are those of {name!r}, over which the "
                         f"response runs; give another parameter.")
    if not np.isfinite(low if start is None else start):
        raise InputError(f"frequency_response: bounds = {bounds!r} must be two finite values of "
                         f"{name!r}, the smaller one first; the branch starts at the lower one.")
    if name.endswith("frequency_hz"):
        require_not_negative("frequency_response: bounds", **{name: low})
    first = inside(low if start is None else float(start), chosen)
    level = None if level_name is None else field.index(level_name)
    follow = branch_of_response if discretisation_by(how).finds_responses else _by_orbit_method

    def at_level(value: float) -> Branch:
        given = field.values if level_name is None else field.values_with(**{level_name: value})
        wanted = Forced(field, given, field.index(name), how, chosen, held, level)
        return follow(wanted, first, row, _with_level(field, observed, row, level_name, value),
                      both=low < first < high)

    found = until_interrupted(values, at_level)
    return FrequencyResponse(found, level_name, values[: len(found)], observed)


def until_interrupted(values: Array, follow: Callable[[float], Branch]) -> tuple[Branch, ...]:
    """A branch for each value, up to the one during which the user interrupts.

    Raises
    ------
    KeyboardInterrupt
        If there is no branch yet.
    """
    found: list[Branch] = []
    for value in values.tolist():
        try:
            found.append(follow(value))
        except KeyboardInterrupt:
            if not found:
                raise
            break
        if found[-1].status is BranchStatus.INTERRUPTED:
            break
    return tuple(found)


def amplitude_label(observed: str) -> str:
    """Label of an amplitude: displacements of points have units, states of vector fields none."""
    names = observed.split()
    unit = "" if len(names) != 2 else " [rad]" if names[1].startswith("phi") else " [m]"
    return f"amplitude of {observed}{unit}"


def preloaded(
    system: ContactSystem | VectorField, preload: LoadHistory | RestState | Array | None
) -> Array | None:
    """State (d,) of a preload; None without one."""
    if preload is None:
        return None
    if not isinstance(system, ContactSystem):
        raise InputError("preload is for contact systems; a vector field has no springs and "
                         "sliders that keep a deflection.")
    return initial_state(system, preload, 0.0)


def levels_of(levels: Mapping[str, ArrayLike] | None) -> tuple[str | None, Array]:
    """Name of the parameter that differs between levels, and its values."""
    if levels is None:
        return None, np.array([np.nan])
    require_kind("frequency_response", Mapping, levels=levels)
    if len(levels) != 1:
        raise InputError(f"levels has {len(levels)} names; give one parameter with its values, "
                         f"such as {{'drive.amplitude_x': [1e-3, 2e-3]}}.")
    (name, given), = levels.items()
    values = np.atleast_1d(as_floats(given, f"levels: {name}"))
    if values.ndim != 1 or not len(values):
        raise InputError(f"levels: {name} must be one or several numbers.")
    return name, values


def branch_of_response(
    wanted: Forced, first: float, row: Array | None = None,
    further: Mapping[str, Any] | None = None, *, both: bool = False,
) -> Branch:
    """The branch at one level, from the first value of the parameter, by harmonic balance.

    ``row`` (d,) is what is observed, if anything, ``further`` are attributes of the branch.
    """
    field, options = wanted.field, wanted.options
    if row is not None:
        _require_observable(layout_of(field), row)
    begin, problem, u = start_of(wanted, first, both=both)
    if row is not None:
        problem = replace(problem, row=row)
    branch = branches.follow(problem, u, None, wanted.method, options, further,
                             direction=_inwards(begin, options), both=both)
    message = stall_reason(field, branch)
    return branch if message == branch.message else replace(branch, message=message)


def _inwards(begin: float, options: ContinuationOptions) -> float:
    """Direction of a branch that begins at a value of the parameter."""
    return 1.0 if begin < options.bounds[1] else -1.0


def _by_orbit_method(
    wanted: Forced, first: float, row: Array, further: Mapping[str, Any], *, both: bool
) -> Branch:
    """The branch at one level by collocation or shooting, from the orbit of harmonic balance.

    Where harmonic balance finds none, it starts from the motion to which a run settles, if need be
    at the other end; set-valued orbits from a run by their solver, as harmonic balance knows
    smoothed laws alone.
    """
    field, options, solver = wanted.field, wanted.options, wanted.method.solver
    _require_observable(layout_of(field), row)

    def followed(begin: float, motion: PeriodicMotion) -> Branch:
        return orbit_branch(based(field, wanted.at(begin).values), motion, wanted.name,
                            method=wanted.method, options=options,
                            direction=_inwards(begin, options), both=both)

    def from_run(begin: float) -> Branch:
        assert isinstance(field, ContactField)
        there = wanted.at(begin)
        require_period(there)
        period = field.forcing_period(there.values)
        return followed(begin, periodic_motion(field.system(there.values), longest_period=period,
                                               solver=solver))

    try:
        if not solver.smooth:
            raise AnalysisError("Harmonic balance knows no set-valued laws.")
        begin, problem, u = start_of(replace(wanted, method=HarmonicBalance(stability=None)),
                                     first, both=both)
        found = problem.linearise(u)
        states = np.vstack([found.states, found.states[:1]])
        attempts = [partial(followed, begin, PeriodicMotion(
            np.linspace(0.0, 1.0, len(states)) * found.period, states, found.period))]
    except FecontactError:
        if not isinstance(field, ContactField):
            raise
        attempts = [partial(from_run, begin)
                    for begin in values_to_start_at(wanted, first, both=both)]
    try:
        branch = first_that_goes(attempts, lambda attempt: attempt())
    except AnalysisError as error:
        if not layout_of(field).memory:
            raise
        raise AnalysisError(f"{error} Friction elements that never slide keep any deflection, so "
                            f"that their orbits are not isolated: follow them by "
                            f"HarmonicBalance(), or start where they slide.") from error
    return _observed_along(branch, field, row, further)


def _observed_along(
    branch: Branch, field: VectorField, row: Array, further: Mapping[str, Any]
) -> Branch:
    """The branch with values of an observed quantity at its points, and further attributes."""
    seen = orbit_points_of(branch.points[0]).observed_along(branch.points, field, row)
    attributes = {**branch.attributes, **further}
    header = BranchHeader(branch.parameter_name, attributes)
    points = [special_point(point.u, point.tangent, {**point.values, **values}, point.kind,
                            details_of(point), header)
              for point, values in zip(branch.points, seen, strict=True)]
    return replace(branch, points=tuple(points), attributes=attributes)


def observed_amplitudes(branch: Branch, row: Array) -> Array:
    """Half the range (N,) of an observed quantity at the points of a branch of orbits."""
    _require_observable(layout_from(branch.attributes), row)
    return np.array(observed_of_series(branch.points, row)["observed_amplitude"])


def _require_observable(layout: Layout, row: Array) -> None:
    if row[layout.internal].any():
        raise InputError("Internal variables of friction cannot be observed; choose a displacement "
                         "or a velocity.")


def _with_level(
    field: VectorField, observed: str, row: Array, level_name: str | None, level: float
) -> dict[str, Any]:
    """Attributes of a branch of responses."""
    label = field.parameter_label(level_name) if level_name else ""
    return {"observed": observed, "observed_row": row, "level": level,
            "level_name": level_name or "", "level_label": label}


def response_of(branches_by_name: Mapping[str, Branch]) -> FrequencyResponse:
    """A response from its branches, such as those of a file.

    Raises
    ------
    InputError
        If they are not those of a response.
    """
    found = list(branches_by_name.values())
    if not found or not all("observed" in branch.attributes and "level" in branch.attributes
                            for branch in found):
        raise InputError("The branches are not those of a frequency response; make one with "
                         "frequency_response.")
    known = found[0].attributes
    return FrequencyResponse(tuple(found), str(known["level_name"]) or None,
                             np.array([float(branch.attributes["level"]) for branch in found]),
                             str(known["observed"]))
