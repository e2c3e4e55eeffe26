"""Branches of periodic orbits by shooting."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.follow import follow
from fecontact.bifurcation.continuation.problem import Settings
from fecontact.bifurcation.continuation.pseudo_arclength import require_inside
from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.fields.vector_field import require_field
from fecontact.bifurcation.orbits.orbit_options import settings_of, sizes_of, width_of
from fecontact.bifurcation.orbits.shooting import shooting_from
from fecontact.bifurcation.orbits.starts import from_samples
from fecontact.core.checks import as_floats
from fecontact.core.errors import AnalysisError, InputError

Array = NDArray[np.float64]


def orbits_by_shooting(
    field: ContactField, parameter: str, times: ArrayLike, states: ArrayLike, *,
    values: ArrayLike | None = None, period: float | None = None, periods: int = 1,
    settings: Settings | None = None, bounds: tuple[float, float] | None = None,
    segments: int = 4, rtol: float = 1e-9, derivative_rtol: float | None = None,
    scales: ArrayLike | None = None, width: float | None = None, direction: float = 1.0,
    both: bool = False,
) -> Branch:
    """The branch through the orbit to which a motion of a contact system has settled.

    By multiple shooting with the compiled integrator, for steep friction and many states, where
    collocation (:func:`fecontact.bifurcation.orbits.branches.orbits_from_motion`) needs many
    intervals. The stored values have the same names; minimum and maximum are those of samples, and
    period doublings come without normal forms.

    Parameters
    ----------
    field : ContactField
        From :func:`fecontact.contact_field`.
    parameter : str
        The one that is varied.
    times, states : (k,) and (k, d) array
        The motion, over at least one period; its end counts. Orbits whose period is unknown begin
        where it is fastest, if it is at least two periods long.
    segments : int
        Pieces of the period, each run for itself: more of them for unstable orbits.
    rtol : float
        Relative tolerance of the runs.
    derivative_rtol : float, optional
        That of their derivatives, as for :func:`fecontact.sensitivity`. With many fast modes that
        the motion hardly excites, 1e-2 saves most of the time, and changes their small multipliers
        alone; with impacts it spoils all of them.
    values, period, periods, settings, bounds, scales, width, direction, both
        See :func:`fecontact.bifurcation.orbits.branches.orbits_from_motion`.

    Raises
    ------
    InputError
        If the samples do not cover a period, the field is not one of a contact system, or the
        bounds exclude the start.
    AnalysisError
        If Newton's method finds no orbit near them.
    """
    require_field(field)
    free = field.index(parameter)
    given = field.values if values is None else np.array(values, dtype=float)
    chosen = settings_of(settings, bounds)
    require_inside(float(given[free]), chosen)
    motion = as_floats(times, "times"), as_floats(states, "states")
    if motion[1].ndim != 2 or motion[1].size == 0:
        raise InputError(f"states must be those of a motion (k, d), not of shape "
                         f"{motion[1].shape}.")
    amplitudes = np.ptp(motion[1], axis=0) / 2.0
    sizes, _ = sizes_of(scales, np.maximum(amplitudes, 1e-3 * amplitudes.max()) + 1e-300)
    if (period is not None and isinstance(field, ContactField)
            and motion[1].shape == (motion[0].size, field.dimension)
            and field.forcing_period(given) is None):
        motion = _to_fastest(*motion, sizes, period, field.system().basis.modes)
    found = from_samples(field, given, free, *motion, period, 200, 4, periods,
                         np.append(sizes, width_of(width, chosen, given[free])))
    problem, u = shooting_from(*found, segments, rtol, derivative_rtol)
    attributes = {"state_names": list(field.state_names), "parameter_names": list(field.parameters),
                  "parameter_values": given, "scales": problem.scales, "segments": segments,
                  "periods": periods, "rtol": rtol}
    if derivative_rtol is not None:
        attributes["derivative_rtol"] = derivative_rtol
    try:
        return follow(problem, u, chosen, name=parameter, direction=direction, both=both,
                      attributes=attributes)
    except (AnalysisError, InputError) as error:
        raise AnalysisError(f"No periodic orbit was found at {parameter} = {given[free]:.6g} near "
                            f"the motion: Newton's method does not converge; run it longer until "
                            f"it has settled, or take more than {segments} segments.") from error


def _to_fastest(
    times: Array, states: Array, sizes: Array, period: float, modes: int
) -> tuple[Array, Array]:
    """The motion up to where it was fastest, within a period before its end.

    There the phase is fixed best; beside transitions of stick and slip an orbit that is guessed
    is far off.
    """
    last = np.flatnonzero(times > times[-1] - period)
    if len(last) == 0 or times[last[0]] - times[0] < period:
        return times, states
    speeds = np.linalg.norm(states[last, modes : 2 * modes] / sizes[:modes], axis=1)
    end = last[np.argmax(speeds)] + 1
    return times[:end], states[:end]
