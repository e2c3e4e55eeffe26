"""Fields on lines along a torus, with up to two excitations of any frequencies."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.tori.method import SecondExcitation
from fecontact.core.errors import InputError, choices
from fecontact.core.types import Array
from fecontact.laws.signals.harmonic import Harmonic, Harmonics, Signal
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.forcing_period import common_multiple, source_periods

_PHASE = "phase of the second excitation"


@dataclass(frozen=True, eq=False)
class Excitation:
    """A field whose rates depend on two angles, as far as they depend on time.

    Attributes
    ----------
    field : VectorField
        The field of the branch.
    first, second : function, optional
        Frequency [Hz] of each excitation for parameter values (k,); None where there is none.
    shifted : VectorField, optional
        The field that is evaluated, where there is a second excitation.
    phase : int
        Place of the phase of the second excitation [rad] among its parameters.
    periods : int
        Number of periods of the first excitation in 1 / f1.
    """

    field: VectorField
    first: Callable[[Array], float] | None
    second: Callable[[Array], float] | None = None
    shifted: VectorField | None = None
    phase: int = -1
    periods: int = 1

    def frequencies(self, values: Array) -> tuple[float | None, float | None]:
        """Prescribed frequencies [Hz]; None for those that the motion finds."""
        return (None if self.first is None else self.first(values) / self.periods,
                None if self.second is None else self.second(values))

    def without_elements(self) -> "Excitation":
        """The excitation of the field without elastic Coulomb elements."""
        assert isinstance(self.field, ContactField)
        shifted = self.shifted
        return replace(self, field=self.field.without_elements(),
                       shifted=shifted.without_elements() if isinstance(shifted, ContactField)
                       else None)

    def on_lines(
        self, taus: Array, x: Array, values: Array, frequency: float, active: Iterable[int] = (),
        *, derivatives: bool = True,
    ) -> tuple[Array, Array, Array]:
        """Rates (Q, P, d) and derivatives at states x (Q, P, d) of Q lines; see `.series`.

        ``frequency`` is f1, ``taus`` (P,) are those of the points; derivatives (Q, P, d, d) to
        states and (Q, P, d, a) to parameters are empty without ``derivatives``.
        """
        Q, P, d = x.shape
        t = np.zeros(P) if self.first is None else taus / frequency
        if self.shifted is None:
            parts = [(self.field, np.tile(t, Q), x.reshape(Q * P, d), values)]
        else:
            parts = [(self.shifted, t, x[j], self._with_phase(values, 2.0 * np.pi * j / Q))
                     for j in range(Q)]
        chosen, nothing = tuple(active), np.zeros((0, 0))
        found = [field.derivatives(t, np.ascontiguousarray(at), given, chosen) if derivatives
                 else (field.rates(t, np.ascontiguousarray(at), given), nothing, nothing)
                 for field, t, at, given in parts]
        f, J, by_parameters = (np.concatenate(part) for part in zip(*found, strict=True))
        if not derivatives:
            return f.reshape(Q, P, d), J, by_parameters
        return (f.reshape(Q, P, d), J.reshape(Q, P, d, d),
                by_parameters.reshape(Q, P, d, len(chosen)))

    def _with_phase(self, values: Array, phase: float) -> Array:
        assert self.shifted is not None
        found = np.append(values, 0.0) if len(values) < len(self.shifted.parameters) else (
            values.copy())
        found[self.phase] += phase
        return found


def excitation_of(field: VectorField, second: SecondExcitation | str | None) -> Excitation:
    """The excitation of a field; see :func:`fecontact.bifurcation.torus_branch`.

    Raises
    ------
    InputError
        If the second one is none of this field.
    AnalysisError
        If the first one has no period.
    """
    if second is None:
        forced = field.forcing_period(field.values) is not None
        return Excitation(field, partial(_frequency, field) if forced else None)
    if isinstance(second, SecondExcitation):
        if field.forcing_period(field.values) is None:
            raise InputError("torus_branch: second = SecondExcitation(...) needs a field with a "
                             "period, that of the first excitation; give vector_field(..., "
                             "period=...).")
        given = second.frequency_hz
        if isinstance(given, str):
            place = field.index(given)
            own: Callable[[Array], float] = lambda values: float(values[place])  # noqa: E731
        else:
            constant = float(given)
            own = lambda values: constant  # noqa: E731
        return Excitation(field, partial(_frequency, field), own, field,
                          field.index(second.phase))
    if not isinstance(field, ContactField):
        raise InputError(f"torus_branch: second = {second!r} names an excitation of a contact "
                         f"system; for a field of your own give SecondExcitation(phase, "
                         f"frequency_hz).")
    _names(field.system(), second)
    shifted = ContactField(field.family.with_parameter(_PHASE, 0.0, partial(_delayed, second)))
    return Excitation(field, partial(_frequency_of, field, second, False),
                      partial(_frequency_of, field, second, True), shifted)


def _frequency(field: VectorField, values: Array) -> float:
    period = field.forcing_period(values)
    assert period is not None
    return 1.0 / period


def _frequency_of(field: ContactField, second: str, chosen: bool, values: Array) -> float:
    """Common frequency [Hz] of the excitations that belong to the second, or of the others."""
    period = common_multiple([period for name, period in source_periods(field.system(values))
                              if _belongs(name, second) == chosen])
    assert period is not None
    return 1.0 / period


def _belongs(name: str, second: str) -> bool:
    return name == second or name.startswith(f"{second}.")


def _names(system: ContactSystem, second: str) -> list[str]:
    """Names of the signals of the second excitation.

    Raises
    ------
    InputError
        If there are none, or no others.
    """
    names = [name for name, _ in source_periods(system)]
    chosen = [name for name in names if _belongs(name, second)]
    if not chosen or len(chosen) == len(names) or second.startswith("ground"):
        raise InputError(f"torus_branch: second = {second!r} must name some of the excitations "
                         f"{choices(names)}, and leave others for the first; the ground is always "
                         f"the first.")
    return chosen


def _delayed(second: str, system: ContactSystem, phase: float) -> ContactSystem:
    """The system with its second excitation ahead by a phase [rad] of its frequency."""
    names = _names(system, second)
    periods = [period for name, period in source_periods(system) if name in names]
    period = common_multiple(periods)
    assert period is not None
    drive, load, time = system.drive, system.load, phase / (2.0 * np.pi) * period
    for name in names:
        part, _, key = name.partition(".")
        if part == "drive":
            axis = key[-1]
            moved = _ahead(time, drive.motions["xyz".index(axis)])
            changes: dict[str, Any] = {key: moved, f"amplitude_{axis}": 0.0}
            drive = replace(drive, **changes)
        elif key.startswith("forces."):
            forces = list(load.forces)
            place = int(key.removeprefix("forces."))
            forces[place] = replace(forces[place], signal=_ahead(time, load.signals[key]))
            load = replace(load, forces=tuple(forces))
        elif "." not in key:
            ahead: dict[str, Any] = {key: _ahead(time, load.signals[key])}
            load = replace(load, **ahead)
        else:
            raise InputError(f"torus_branch: second: {name} cannot be shifted in time; let it be "
                             f"the first excitation.")
    if drive.motion_x is not None and drive.motion_y is not None:
        drive = replace(drive, frequency_hz=0.0)
    return system.with_({name: value for name, value, before in (
        ("drive", drive, system.drive), ("load", load, system.load)) if value is not before})


def _ahead(time: float, signal: Signal) -> Signal:
    """The signal as it is a time [s] later."""
    if isinstance(signal, Harmonic):
        return replace(signal, phase=signal.phase + 2.0 * np.pi * signal.frequency_hz * time)
    if isinstance(signal, Harmonics):
        phases = signal.phases or (0.0,) * len(signal.frequencies_hz)
        return replace(signal, phases=tuple(
            phase + 2.0 * np.pi * f * time
            for phase, f in zip(phases, signal.frequencies_hz, strict=True)))
    raise InputError(f"torus_branch: second: a {type(signal).__name__} cannot be shifted in time; "
                     f"give a Harmonic or Harmonics.")
