"""Nonlinear modes of a study, part by part, so that an interrupted one goes on where it was."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from fecontact.bifurcation.continuation.follow import regular
from fecontact.bifurcation.continuation.problem import BranchStatus, ContinuationOptions
from fecontact.bifurcation.harmonic.engine_order import EngineOrder
from fecontact.bifurcation.nonlinear_modes.nonlinear_mode import (
    NonlinearMode,
    continued_mode,
    nonlinear_mode,
)
from fecontact.bifurcation.responses import observed_point

if TYPE_CHECKING:
    from fecontact.bifurcation.response_options import ResponseSettings
    from fecontact.system.contact_system import ContactSystem
    from fecontact.system.quasistatic.history import LoadHistory

# First and largest step, and points after which a mode is stored.
_STEP, _LARGEST, _PART = 0.02, 0.1, 50


def mode_options(points: int) -> ContinuationOptions:
    """Options of the continuation for modes of studies."""
    return ContinuationOptions(points=points, step=_STEP, largest_step=_LARGEST)


def unfinished(mode: NonlinearMode, points: int) -> bool:
    """Whether a mode was interrupted, or has fewer points than are asked for now."""
    status = mode.branch.status
    return status is BranchStatus.INTERRUPTED or (
        status is BranchStatus.POINTS and regular(mode.branch.points) < points)


def follow_mode(
    system: "ContactSystem", wanted: "ResponseSettings", amplitudes: tuple[float, float],
    number: int, progress: Callable[[int], None] | None = None, *,
    earlier: NonlinearMode | None = None,
    keep: Callable[[NonlinearMode], object] | None = None,
    preload: "LoadHistory | None" = None, wave: EngineOrder | None = None,
) -> NonlinearMode:
    """Follow a nonlinear mode with harmonics and observed point of ``[response]``.

    Parameters
    ----------
    system : ContactSystem
        System that vibrates.
    wanted : ResponseSettings
        Method, points, what is observed.
    amplitudes : (float, float)
        At which it begins and ends.
    number : int
        Of the linear mode, from 1.
    progress : callable, optional
        Called with the number of points.
    earlier : NonlinearMode, optional
        Result of an interrupted computation of the mode: it goes on at the end of the last
        whole part, so that the numbers are those of a computation without interruption. With a
        tolerance the mode is followed again, since harmonics or samples may still grow.
    keep : callable, optional
        Given what there is after each part, as interrupted.
    preload : LoadHistory, optional
        Whose end elements that never slide keep.
    wave : EngineOrder, optional
        The travelling wave of a wheel, of which the system is one sector.
    """
    observe = observed_point(system, wanted)
    method = replace(wanted.harmonic_balance(), repeats=wave)
    parts = not method.refines
    mode = _whole_parts(earlier) if earlier is not None and parts else None
    while True:
        done = 0 if mode is None else regular(mode.branch.points)
        most = min(wanted.points, done + _PART) if parts else wanted.points
        options = replace(mode_options(most), progress=_counted(progress, done))
        try:
            mode = (nonlinear_mode(system, amplitudes, number, observe=observe, method=method,
                                   options=options, preload=preload) if mode is None
                    else continued_mode(system, mode, amplitudes, observe, options, wave))
        except KeyboardInterrupt:
            if mode is None:
                raise
            return _interrupted(mode)
        branch = mode.branch
        if branch.status is not BranchStatus.POINTS or regular(branch.points) >= wanted.points:
            return mode
        if keep is not None:
            keep(_interrupted(mode))


def _whole_parts(mode: NonlinearMode) -> NonlinearMode | None:
    """The mode up to the end of its last whole part; None without one.

    Each part begins with the first step, in an uninterrupted computation too.
    """
    regular = [k for k, point in enumerate(mode.branch.points) if point.kind is None]
    whole = len(regular) // _PART * _PART
    if whole == 0:
        return None
    return replace(mode, branch=replace(
        mode.branch, points=mode.branch.points[: regular[whole - 1] + 1],
        status=BranchStatus.POINTS))


def _interrupted(mode: NonlinearMode) -> NonlinearMode:
    return replace(mode, branch=replace(mode.branch, status=BranchStatus.INTERRUPTED))


def _counted(progress: Callable[[int], None] | None, done: int) -> Callable[[int], None] | None:
    return None if progress is None else lambda points: progress(done + points)
