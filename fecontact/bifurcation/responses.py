"""Frequency responses of a study: those of its section ``[response]``, level by level."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from fecontact.analysis.histories import usual_component, usual_point
from fecontact.bifurcation.continuation.problem import BranchStatus, titled
from fecontact.bifurcation.harmonic.engine_order import EngineOrder
from fecontact.bifurcation.harmonic.response import FrequencyResponse, frequency_response
from fecontact.bifurcation.nonlinear_modes.controlled_response import controlled_response
from fecontact.core.errors import FecontactError, InputError, choices

if TYPE_CHECKING:
    from fecontact.bifurcation.response_options import ResponseSettings
    from fecontact.system.contact_system import ContactSystem
    from fecontact.system.quasistatic.history import LoadHistory


@dataclass
class Responses:
    """Computed responses of a study.

    Attributes
    ----------
    response : FrequencyResponse or None
        Levels in the order of the study; None where no level has one.
    notes : list of str
        Sentences on levels that could not be followed.
    interrupted : bool
        Whether Ctrl-C ended it.
    """

    response: FrequencyResponse | None = None
    notes: list[str] = field(default_factory=list)
    interrupted: bool = False


def observed_point(
    system: "ContactSystem", wanted: "ResponseSettings"
) -> tuple[str | int, str]:
    """Point and component that are observed; InputError if these or further ones do not exist."""
    basis, point = system.basis, wanted.point
    if point is None:
        if wanted.engine_order is not None:
            raise InputError(f"ResponseSettings: point is missing, a named point of the sector; "
                             f"choose from {choices(basis.extra)}.")
        point = usual_point(basis)
    component = wanted.component or usual_component(system)
    for seen in ((point, component), *wanted.also_observed):
        _ = basis.point_row(*seen)
    return point, component


def follow_responses(
    system: "ContactSystem", wanted: "ResponseSettings",
    progress: Callable[[str, float], None] | None = None,
    earlier: FrequencyResponse | None = None,
    keep: Callable[[FrequencyResponse], object] | None = None,
    preload: "LoadHistory | None" = None, wave: EngineOrder | None = None,
) -> Responses:
    """Follow the responses at all levels, one after the other.

    Parameters
    ----------
    system : ContactSystem
        System that vibrates.
    wanted : ResponseSettings
        Range, levels, method.
    progress : callable, optional
        Told the level or amplitude that is being followed, and which part of its range is done.
    earlier : FrequencyResponse, optional
        Result of an interrupted computation: finished levels are taken from it, the
        one that was interrupted is followed again, so that the numbers are those of a computation
        without interruption.
    keep : callable, optional
        Given what there is after each level.
    preload : LoadHistory, optional
        Whose end elements that never slide keep.
    wave : EngineOrder, optional
        The wave of a wheel, of which the system is one sector.

    Raises
    ------
    FecontactError
        If no level has a response.
    """
    observe, result = observed_point(system, wanted), Responses()
    failed: FecontactError | None = None
    start = None if wanted.start is None else wanted.first
    held = bool(wanted.amplitudes)
    name = "amplitude" if held else wanted.level_name
    for value in wanted.amplitudes or next(iter(wanted.levels.values()), (np.nan,)):
        title = "Response" if name is None else f"{name} = {value:g}"
        known = _level_of(earlier, value)
        try:
            options = titled(wanted.options(), title, progress)
            if known is not None and known.branches[0].status is not BranchStatus.INTERRUPTED:
                found = known
            elif held:
                force = wanted.force or _force_along(observe[1])
                found = controlled_response(
                    system, wanted.checked_bounds, [value], force, wanted.parameter,
                    observe=observe, method=wanted.harmonic_balance(), options=options,
                    start=start, preload=preload)
            else:
                found = frequency_response(
                    system, wanted.checked_bounds, wanted.parameter, observe=observe,
                    levels=None if name is None else {name: [value]},
                    method=wanted.orbit_method() if wave is None else replace(
                        wanted.harmonic_balance(), repeats=wave),
                    options=options, start=start, preload=preload)
        except KeyboardInterrupt:
            if result.response is None:
                raise
            result.interrupted = True
            break
        except FecontactError as error:
            failed = error
            result.notes.append(f"{title}: no response was followed: {error}")
            continue
        result.response = found if result.response is None else _joined(result.response, found)
        if keep is not None:
            keep(result.response)
        if found.branches[0].status is BranchStatus.INTERRUPTED:
            result.interrupted = True
            break
    if result.response is None and failed is not None:
        raise failed
    return result


def _force_along(component: str) -> str:
    """The drive's amplitude along a component of displacement; along x for a rotation."""
    return f"drive.amplitude_{'x' if component.startswith('phi') else component}"


def _level_of(earlier: FrequencyResponse | None, value: float) -> FrequencyResponse | None:
    """The response at one level of an earlier computation."""
    if earlier is None:
        return None
    for branch, level in zip(earlier.branches, earlier.levels, strict=True):
        if level == value or (np.isnan(level) and np.isnan(value)):
            return replace(earlier, branches=(branch,), levels=np.array([level]))
    return None


def _joined(one: FrequencyResponse, other: FrequencyResponse) -> FrequencyResponse:
    return replace(one, branches=(*one.branches, *other.branches),
                   levels=np.concatenate([one.levels, other.levels]))
