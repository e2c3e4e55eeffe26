"""Fits that a study describes: its ``[fit]`` section as data, and the fit of them."""

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.analysis.histories import quantity_unit
from fecontact.analysis.receptance import response_unit
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.core.checks import require_kind
from fecontact.core.errors import FecontactError, InputError, ModelWarning, choices
from fecontact.core.tables import located
from fecontact.fitting.data import FitData
from fecontact.fitting.data_in_time import DecayData, HistoryData, LoopData
from fecontact.fitting.data_of_modes import (
    BackboneData,
    FrequencyData,
    ReceptanceData,
    ResponseData,
)
from fecontact.fitting.fit_model import fit
from fecontact.fitting.result import Fit
from fecontact.measured.measured_units import response_kind
from fecontact.measured.measurement import Axis, Measurement
from fecontact.measured.read_measurements import read_measurement
from fecontact.measured.ring_down import ring_down
from fecontact.study.fit_section import FitDataSettings, FitSettings
from fecontact.study.study import Study
from fecontact.system.contact_system import ContactSystem

# Words of problems of a measurement that a fit does not stop for.
_UNEVEN = ("gap", "ascend")
_DOUBTS = (*_UNEVEN, "thousandth", "overloaded")


def fit_study(
    study: Study, *, workers: int | None = 1, folder: str | Path | None = None,
    overwrite: bool = False, progress: bool | Callable[[int, int], None] | None = None,
) -> Fit:
    """Fit the parameters of ``[fit]`` of a study to its measurements.

    Parameters
    ----------
    study : Study
        Study with a section ``[fit]``.
    workers, folder, overwrite, progress
        See :func:`fecontact.fit`.

    Raises
    ------
    InputError
        Without this section, for files that cannot be read, and as :func:`fecontact.fit`.
    """
    settings = settings_of(study)
    return fit(study, settings.parameters, study_data(study), starts=settings.starts,
               seed=settings.seed, loss=settings.loss, loss_scale=settings.loss_scale,
               exact=settings.exact, workers=workers, folder=folder, overwrite=overwrite,
               progress=progress)


def settings_of(study: Study) -> FitSettings:
    """Section ``[fit]`` of a study; InputError without it."""
    require_kind("fit_study", Study, study=study)
    if study.fit is None:
        raise InputError(f"{study.title} has no section [fit]; add one with the ranges of "
                         f"parameters in [fit.parameters] and measurements in [[fit.data]].")
    return study.fit


class UnusableError(InputError):
    """Measured values that cannot be used, which does not hinder the other data of a fit."""


def study_data(study: Study) -> tuple[FitData, ...]:
    """Measurements of ``[[fit.data]]`` of a study.

    Data that are not spaced as they must be, or lack numbers in between, are left out with a
    warning if there are others.

    Parameters
    ----------
    study : Study
        Study with a section ``[fit]``.

    Raises
    ------
    InputError
        For files that cannot be read, channels that do not exist, and values that cannot be used.
    """
    found: list[FitData] = []
    refused: list[UnusableError] = []
    for number, one in enumerate(settings_of(study).data):
        try:
            with located(f"{study.title}: [[fit.data]] {number}:"):
                found.append(replace(_KINDS[one.kind](study, one), changes=dict(one.changes)))
        except UnusableError as error:
            refused.append(error)
    if refused and not found:
        raise refused[0]
    for lost in refused:
        warnings.warn(f"{lost} The fit goes on without these data.", ModelWarning, stacklevel=2)
    return tuple(found)


def _measurement(
    study: Study, one: FitDataSettings, axis: Axis, *channels: str | None, even: bool = False
) -> Measurement:
    """Measurement of a file, without the rows in which the channels that are used lack numbers.

    Rows stay if they must be evenly spaced. Warnings tell what looks wrong.
    """
    assert one.file is not None
    found = read_measurement(study.folder / one.file, axis=axis, units=dict(one.units) or None)
    found = found.between(one.t_start, one.t_end) if axis == "time" else found
    used = [found.names[found.index(name)] for name in channels]
    doubts = [problem for problem in found.problems if any(word in problem for word in _DOUBTS)]
    doubts += [note for note in found.notes if any(f"'{name}'" in note for name in used)]
    known = found if even else found.known(*used)
    if lost := len(found) - len(known):
        doubts.append(f"In {lost} of {len(found)} rows there is no number for {choices(used)}; the "
                      f"other rows are taken")
    for problem in doubts:
        warnings.warn(f"{one.file}: {problem}.", ModelWarning, stacklevel=2)
    return known


def _channel(test: Measurement, channel: str | None, unit: str) -> int:
    """Number of a channel; InputError if it has another unit."""
    k = test.index(channel)
    given = test.channels[k].unit
    if given not in ("", unit):
        raise InputError(f"channel '{test.names[k]}' has the unit {given}, but {unit} is needed "
                         f"here; name another channel, or give its unit in units.")
    return k


def _initial(study: Study, one: FitDataSettings) -> Any:
    if one.initial == "preload":
        return _Preloaded(study)
    return np.array(one.initial) if isinstance(one.initial, tuple) else one.initial


class _Preloaded:
    """State at the end of ``[preload]`` of a study, of a system with other parameters."""

    def __init__(self, study: Study) -> None:
        if study.preload is None:
            raise InputError("initial = 'preload' needs the section [preload].")
        self.path = study.preload

    def __call__(self, system: ContactSystem) -> Any:
        return self.path.load(system)


def _loop(study: Study, one: FitDataSettings) -> FitData:
    test = _measurement(study, one, "time", one.channel, one.against)
    x, force = (test.series(_channel(test, name, unit))[1] for name, unit in (
        (one.against, "m"), (one.channel, "N")))
    return LoopData(x, force, one.deviation, one.along, name=one.name)


def _history(study: Study, one: FitDataSettings) -> FitData:
    test = _measurement(study, one, "time", one.channel)
    time, values, _, _ = test.series(_channel(test, one.channel, quantity_unit(
        one.quantity, one.component)))
    return HistoryData(time, values, one.deviation, one.quantity, one.point, one.component,
                       _initial(study, one), name=one.name)


def _decay(study: Study, one: FitDataSettings) -> FitData:
    curve, options = _curve(study, one)
    assert one.t_end is not None
    return DecayData(curve, _initial(study, one), one.t_end, one.quantity, one.point,
                     one.component, options, name=one.name)


def _backbone(study: Study, one: FitDataSettings) -> FitData:
    return BackboneData(_curve(study, one)[0], one.mode, one.point, one.component,
                        HarmonicBalance(one.harmonics), name=one.name)


def _curve(study: Study, one: FitDataSettings) -> tuple[Any, dict[str, Any]]:
    options: dict[str, Any] = {"window": one.window}
    if one.frequency_hz is not None:
        options["frequency_hz"] = one.frequency_hz
    if one.t_start is not None:
        options["t_start"] = one.t_start
    test = _measurement(study, one, "time", one.channel, even=True)
    k = test.index(one.channel)
    try:
        return ring_down(test, channel=k, resample=one.resample, **options), options
    except FecontactError as error:
        sound = len(test.known(test.names[k])) == len(test) and not any(
            word in problem for problem in test.problems for word in _UNEVEN)
        if sound:
            raise
        raise UnusableError(str(error)) from None


def _frequencies(study: Study, one: FitDataSettings) -> FitData:
    return FrequencyData(np.array(one.frequencies_hz), one.deviation,
                         None if one.modes is None else np.array(one.modes),
                         None if one.about == "none" else one.about, name=one.name)


def _receptance(study: Study, one: FitDataSettings) -> FitData:
    test = _measurement(study, one, "frequency", one.channel)
    k = test.index(one.channel)
    kind = response_kind(test.channels[k].unit)
    pushed, seen = (one.excitation, one.excitation_component), (one.point, one.component)
    _channel(test, one.channel, response_unit(kind, seen, pushed))
    return ReceptanceData(test.abscissa, np.asarray(test.values[:, k], dtype=complex), pushed,
                          seen, one.deviation, kind, None if one.about == "none" else one.about,
                          name=one.name)


def _response(study: Study, one: FitDataSettings) -> FitData:
    test = _measurement(study, one, "frequency", one.channel)
    return ResponseData(test.abscissa, np.abs(test.values[:, test.index(one.channel)]),
                        one.deviation, one.point, one.component,
                        method=HarmonicBalance(one.harmonics, stability=None), name=one.name)


_KINDS: dict[str, Callable[[Study, FitDataSettings], FitData]] = {
    "loop": _loop, "history": _history, "ring-down": _decay, "backbone": _backbone,
    "frequencies": _frequencies, "receptance": _receptance, "response": _response}

