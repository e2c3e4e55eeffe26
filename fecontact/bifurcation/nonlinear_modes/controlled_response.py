"""Responses at a held amplitude: the level of the force follows from the motion."""

from collections.abc import Sequence
from dataclasses import replace
from numbers import Real
from types import NoneType

import numpy as np

from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.problem import ContinuationOptions, options_of
from fecontact.bifurcation.continuation.pseudo_arclength import inside
from fecontact.bifurcation.fields.contact_field import contact_field
from fecontact.bifurcation.fields.observed_row import observed_row
from fecontact.bifurcation.harmonic.forced_starts import Forced
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.harmonic.response import (
    RESPONSES,
    FrequencyResponse,
    amplitude_label,
    branch_of_response,
    observed_amplitudes,
    preloaded,
    until_interrupted,
)
from fecontact.bifurcation.nonlinear_modes.peak_problem import (
    HELD,
    PeakProblem,
    followed,
    problem_at,
)
from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import AnalysisError, FecontactError, InputError
from fecontact.core.resources.blas_threads import one_blas_thread
from fecontact.core.types import Array, ArrayLike
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.vector_field import VectorField
from fecontact.system.forcing_period import DRIVE_FREQUENCY, require_effect
from fecontact.system.quasistatic.history import LoadHistory
from fecontact.system.quasistatic.rest_state import RestState

# First level, relative to the one at which the linear response has the amplitude, factor by which
# the range of levels grows, and how often.
_FIRST, _WIDER, _TIMES = 1e-3, 8.0, 5
_REACHED = "amplitude reached"


@one_blas_thread
def controlled_response(
    system: ContactSystem | VectorField, bounds: tuple[float, float], amplitudes: ArrayLike,
    force: str = "drive.amplitude_x", parameter: str | None = None, *,
    observe: tuple[str | int, str] | Sequence[float] | Array = ("B", "x"),
    method: HarmonicBalance | None = None, options: ContinuationOptions | None = None,
    start: float | None = None, preload: LoadHistory | RestState | Array | None = None,
) -> FrequencyResponse:
    r"""Responses at held amplitudes, as under amplitude control: the level of the force is free.

    With the forced orbit x(t) of frequency w and force P the equations

    .. math:: M \ddot x + f(x, \dot x) = P \cos w t, \qquad
        \tfrac12 (\max_t y - \min_t y) = a, \qquad y = b^T x

    are followed over w with x and P unknown. Orbits between the folds of a response at a constant
    force lie on one branch without folds. ``response.force(level)`` is P, ``response.peak(level)``
    the point of smallest force over amplitude, the resonance. 'stable' is the stability under the
    constant force P, without control.

    Parameters
    ----------
    system : ContactSystem or VectorField
        Excited with a common period.
    bounds : (float, float)
        Range of the parameter [Hz for the frequency of a drive].
    amplitudes : float or sequence
        a above zero, half the range of the observed displacement: a branch for each.
    force : str
        Dotted name of the level that is free, such as 'drive.amplitude_x', zero without motion.
    parameter : str, optional
        Dotted name, by default 'drive.frequency_hz'.
    observe, method, options, start, preload
        As for :func:`fecontact.bifurcation.frequency_response`, by harmonic balance.

    Raises
    ------
    InputError, AnalysisError
        For a parameter or point that does not exist, no excitation with a period, or an amplitude
        that no level of the force reaches at the start.
    """
    require_kind("controlled_response", (ContactSystem, VectorField), system=system)
    require_kind("controlled_response", (str, NoneType), parameter=parameter)
    require_kind("controlled_response", str, force=force)
    require_kind("controlled_response", (Real, NoneType), start=start)
    require_kind("controlled_response", (HarmonicBalance, NoneType), method=method)
    held = np.atleast_1d(as_floats(amplitudes, "controlled_response: amplitudes"))
    if held.ndim != 1 or not len(held) or not (held > 0.0).all():
        raise InputError(f"controlled_response: amplitudes = {amplitudes!r} must be one or several "
                         f"numbers above zero.")
    chosen = options_of(options or RESPONSES, bounds)
    name = parameter or DRIVE_FREQUENCY
    if name == force:
        raise InputError(f"controlled_response: parameter and force are both {force!r}; take "
                         f"another parameter.")
    if isinstance(system, ContactSystem) and not force.startswith("drive."):
        require_effect(system, name)
    field = system if isinstance(system, VectorField) else contact_field(system, [force, name])
    row, observed = observed_row(field, observe)
    values = field.values
    values[field.index(name)] = inside(
        chosen.bounds[0] if start is None else float(start), chosen)
    wanted = Forced(field, values, field.index(force), method or HarmonicBalance(), chosen,
                    preloaded(system, preload))

    def at_amplitude(amplitude: float) -> Branch:
        problem, u = _started(wanted, field.index(name), amplitude, row)
        return followed(problem, u, chosen, name, {
            "parameters": [name, force], "observed": observed, "level": amplitude,
            "level_name": "amplitude", "level_label": amplitude_label(observed)})

    found = until_interrupted(held, at_amplitude)
    return FrequencyResponse(found, "amplitude", held[: len(found)], observed)


def _started(
    wanted: Forced, second: int, amplitude: float, row: Array
) -> tuple[PeakProblem, Array]:
    """Problem, and the orbit of the amplitude at the first value of the ``second`` parameter.

    The response over the level of the force, which is free, begins close to rest and ends at the
    amplitude.
    """
    field, values, force = wanted.field, wanted.values, wanted.free
    plain = replace(wanted.method, tolerance=None, stability=None)
    failed: FecontactError = AnalysisError("")
    highest = abs(float(values[force])) or 1.0
    for _ in range(_TIMES):
        given = replace(
            RESPONSES, locate=False, bounds=(_FIRST * highest, highest),
            events={_REACHED: lambda found: found["observed_amplitude"] / amplitude - 1.0},
            stop_at=[_REACHED])
        try:
            branch = branch_of_response(replace(wanted, method=plain, options=given),
                                        given.bounds[0], row)
        except FecontactError as error:
            failed = error
            break
        sizes = observed_amplitudes(branch, row)
        if sizes[0] >= amplitude:
            highest *= _FIRST * amplitude / sizes[0]
        elif branch.points[-1].kind == _REACHED:
            return problem_at(wanted, branch.points[-1], second, row, HELD, amplitude)
        else:
            # At a constant slope the amplitude would be reached half-way.
            highest *= max(_WIDER, 2.0 * amplitude / sizes[-1])
    names = list(field.parameters)
    raise AnalysisError(f"The amplitude {amplitude:g} was not reached at {names[second]} = "
                        f"{values[second]:g} with any {names[force]} up to {highest:g}; start at "
                        f"another value, or hold a smaller one. {failed}".rstrip())
