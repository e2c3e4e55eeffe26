"""The section ``[response]`` of a study file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from fecontact.bifurcation.range_settings import RangeSettings
from fecontact.core.errors import InputError, require_positive
from fecontact.core.tables import convert_fields

if TYPE_CHECKING:
    from fecontact.bifurcation.harmonic.method import HarmonicBalance
    from fecontact.bifurcation.orbit_methods import Method

_FREQUENCY = "frequency_hz"


@dataclass(frozen=True)
class ResponseSettings(RangeSettings):
    """``[response]``: frequency responses, by default by harmonic balance.

    See :func:`fecontact.bifurcation.frequency_response`; harmonics, samples, preload and what is
    observed also hold for nonlinear modes.

    Parameters
    ----------
    parameter : str
        Dotted name of the number of the study that changes along a response, a frequency or any
        other, such as the amplitude of a force.
    bounds : (float, float), optional
        Its least and largest value, of a frequency in Hz.
    start : float, optional
        Where responses start; the least value by default, inside they are followed both ways.
    levels : table of one list, optional
        Another parameter and its values, a response for each:
        ``levels = { "drive.amplitude_x" = [1e-5, 2e-5] }``.
    method : 'harmonic balance', 'collocation' or 'shooting'
        How orbits are found: as Fourier series, by collocation on an adaptive mesh, or with the
        compiled integrator, for steep friction and impacts. Keys of harmonics and samples,
        tolerances and stability are for harmonic balance, and so are nonlinear modes.
    intervals : int
        For collocation: mesh intervals of an orbit.
    segments : int
        For shooting: pieces of an orbit that are run for themselves; more for unstable orbits.
    amplitudes : list of float, optional
        In place of levels: amplitudes of what is observed that are held, half the range [m, rad], a
        response for each, in which the level of the force is free; by harmonic balance.
    force : str, optional
        Dotted name of that level; by default the amplitude of the drive along ``component``.
    harmonics : int or list of int
        Harmonics of the period of the excitation: all up to a number, or those of a list alone,
        ``[1, 3, 5]``; 0 is the mean.
    samples : int, optional
        Samples a period, at least 2 harmonics + 2; by default as many as ``sampling_tolerance``
        needs, from 8 harmonics or 32.
    tolerance : float, optional
        Largest truncation error, relative to the orbit, for which harmonics are added.
    most_harmonics : int
        Limit for that.
    sampling_tolerance : float, optional
        Largest error from few samples, relative to the orbit, for which samples are doubled;
        5e-4 by default where ``samples`` are not given.
    stability : 'transitions', 'Koopman-Hill' or 'none'
        How the stability of orbits is computed; without it points take a fraction of the time and
        folds alone are found.
    engine_order : int, optional
        Of one sector of a wheel, ``[symmetry]``: forces reach sector s a time engine_order s T / N
        later, and the wheel answers with a wave, by harmonic balance without stability.
    preload : bool
        Whether friction elements that never slide keep what ``[preload]`` has left in them;
        otherwise they have no deflection at rest.
    step, largest_step : float
        First and largest step, in parts of the diagram.
    points : int
        Most points of a response.
    point : str or int, optional
        Observed point: 'B', 'C', a further named point, or a contact node by its number; B by
        default, or the middle of the contact where nothing is named B.
    component : 'x', 'y', 'z', 'phi', 'phi_x', 'phi_y' or 'phi_z', optional
        Its component; by default that of the drive.
    also : list of str
        Further displacements whose amplitude and phase the CSV file holds, such as
        ``["C x", "B y"]``: a point or number of a contact node, and a component.
    """

    section = "response"

    parameter: str = "drive.frequency_hz"
    bounds: tuple[float, float] | None = None
    start: float | None = None
    levels: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    amplitudes: tuple[float, ...] = ()
    force: str | None = None
    method: Literal["harmonic balance", "collocation", "shooting"] = "harmonic balance"
    intervals: int = 50
    segments: int = 4
    harmonics: int | tuple[int, ...] = 9
    samples: int | None = None
    tolerance: float | None = None
    most_harmonics: int = 100
    sampling_tolerance: float | None = None
    stability: Literal["transitions", "Koopman-Hill", "none"] = "transitions"
    engine_order: int | None = None
    preload: bool = False
    step: float = 0.01
    largest_step: float = 0.03
    points: int = 2000
    point: str | int | None = None
    component: Literal["x", "y", "z", "phi", "phi_x", "phi_y", "phi_z"] | None = None
    also: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        convert_fields(self)
        require_positive("ResponseSettings", step=self.step, largest_step=self.largest_step,
                         points=self.points)
        self._check_levels()
        self._check_amplitudes()
        _ = self.also_observed
        self.require_range()
        self._check_engine_order()
        _ = self.harmonic_balance(), self.orbit_method()

    def _check_levels(self) -> None:
        if len(self.levels) > 1:
            raise InputError(f"ResponseSettings: levels names {len(self.levels)} parameters; give "
                             f"one with its values.")
        for name, values in self.levels.items():
            if not values or not all(map(math.isfinite, values)):
                raise InputError(f"ResponseSettings: levels: {name} = {list(values)} must be a "
                                 f"list of at least one finite number.")
            if name == self.parameter:
                raise InputError(f"ResponseSettings: levels names '{name}', over which the "
                                 f"responses go; take another parameter for the levels.")

    def _check_amplitudes(self) -> None:
        given = list(self.amplitudes)
        if not given and self.force is not None:
            raise InputError(f"ResponseSettings: force = '{self.force}' is the level that is free "
                             f"where amplitudes are held; give amplitudes too.")
        if not all(0.0 < one < math.inf for one in given):
            raise InputError(f"ResponseSettings: amplitudes = {given} must be a list of numbers "
                             f"above zero.")
        if given and self.levels:
            raise InputError(f"ResponseSettings: amplitudes = {given} are held, so that the force "
                             f"has no levels; leave out one of the two.")
        if given and self.method != "harmonic balance":
            raise InputError(f"ResponseSettings: method = '{self.method}' cannot hold amplitudes; "
                             f"take 'harmonic balance'.")
        if given and self.force == self.parameter:
            raise InputError(f"ResponseSettings: force names '{self.force}', over which the "
                             f"responses go; take another one.")

    def _check_engine_order(self) -> None:
        if self.engine_order is None:
            return
        if self.engine_order < 1:
            raise InputError(f"ResponseSettings: engine_order = {self.engine_order} must be from 1 "
                             f"to the number of sectors.")
        for key, usual in (("method", "harmonic balance"), ("amplitudes", ())):
            if (given := getattr(self, key)) != usual:
                raise InputError(f"ResponseSettings: {key} = {given!r} and engine_order do not go "
                                 f"together; leave {key} out.")
        if self.stability == "Koopman-Hill":
            raise InputError("ResponseSettings: stability = 'Koopman-Hill' is not known from one "
                             "sector of a wheel, engine_order; leave it out, and see "
                             "wheel_stability in Python.")

    def require_range(self) -> None:
        """Raise InputError unless the steps, the bounds and the start go together."""
        super().require_range()
        if self.bounds is not None and self.over_frequency and self.bounds[0] <= 0.0:
            raise InputError(f"ResponseSettings: bounds = {list(self.bounds)} must be frequencies "
                             f"above zero [Hz].")

    @property
    def over_frequency(self) -> bool:
        """Whether the parameter is a frequency [Hz]."""
        return self.parameter.rpartition(".")[2] == _FREQUENCY

    @property
    def also_observed(self) -> tuple[tuple[str | int, str], ...]:
        """Points and components of the further displacements."""
        found: list[tuple[str | int, str]] = []
        for text in self.also:
            point, _, component = text.strip().rpartition(" ")
            if not point:
                raise InputError(f"ResponseSettings: also = {list(self.also)} must name a point "
                                 f"and a component each, like 'C x'.")
            found.append((int(point) if point.isdigit() else point.strip(), component))
        return tuple(found)

    @property
    def level_name(self) -> str | None:
        """The parameter of the levels."""
        return next(iter(self.levels), None)

    def orbit_method(self) -> "Method":
        """Method by which responses are followed."""
        from fecontact.bifurcation.orbit_methods import Collocation, Shooting

        if self.method == "collocation":
            return Collocation(intervals=self.intervals)
        if self.method == "shooting":
            return Shooting(segments=self.segments)
        return self.harmonic_balance()

    def harmonic_balance(self) -> "HarmonicBalance":
        """Harmonic balance with the numbers of the section, for modes too."""
        from fecontact.bifurcation.harmonic.method import HarmonicBalance

        most = self.most_harmonics
        return HarmonicBalance(self.harmonics, self.samples, self.tolerance,
                               max(self.harmonics, most) if isinstance(self.harmonics, int)
                               else most,
                               None if self.stability == "none" or self.engine_order is not None
                               else self.stability,
                               self.sampling_tolerance)


def flat_levels(table: Any) -> Any:
    """``[response]`` with levels by dotted names, which TOML may have read as nested tables."""
    if not isinstance(table, Mapping) or not isinstance(table.get("levels"), Mapping):
        return table
    return {**table, "levels": dict(_leaves(table["levels"], ""))}


def _leaves(table: Mapping[str, Any], prefix: str) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in table.items():
        found += (_leaves(value, f"{prefix}{key}.") if isinstance(value, Mapping)
                  else [(f"{prefix}{key}", value)])
    return found
