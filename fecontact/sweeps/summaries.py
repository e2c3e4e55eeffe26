"""Summaries of a run: scalar functions of a :class:`Trajectory`.

Each has a name, used in study files and as a column of the table of a sweep. ``NAME@POINT``
selects another point than the default: ``amplitude_x@C``, or ``amplitude_y@0`` for the first
contact node. ``FILE.py:FUNCTION`` is a user function of a Trajectory that returns a number.
"""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import whole_number
from fecontact.core.docstrings import summary
from fecontact.core.errors import FecontactError, InputError, choices, nearest
from fecontact.core.types import Array
from fecontact.core.user_code import user_function
from fecontact.integrate.contact_quantities import ContactState
from fecontact.integrate.trajectory import Trajectory
from fecontact.laws.wear import WearLaw
from fecontact.system.powers import POWERS

Point = str | int
# Where a study gives what some summaries need.
_GIVEN = {"wear": "a wear law; give its coefficient in [wear]",
          "thickness": "the thickness of the body, the same for several; give it in [body]"}


@dataclass(frozen=True)
class Summary:
    """A number stored for each case: the function that computes it from a run, and its unit."""

    function: Callable[..., float]
    unit: str

    @property
    def text(self) -> str:
        """Description for display."""
        return summary(self.function)


def summarise(
    trajectory: Trajectory, functions: Mapping[str, Callable[[Trajectory], float]],
    t_start: float | None = None,
) -> dict[str, float]:
    """Summaries of a run after a start time [s]; see :func:`functions_for`.

    Raises
    ------
    InputError
        If fewer than two output times remain.
    FecontactError
        As raised by the functions, with the name of the summary.
    """
    late = trajectory if t_start is None else trajectory.between(t_start)
    values = {}
    for name, function in functions.items():
        try:
            values[name] = float(function(late))
        except FecontactError as error:
            raise type(error)(f"{name}: {error}") from None
    return values


def functions_for(
    names: Sequence[str], folder: Path | None = None, **known: Any
) -> dict[str, Callable[[Trajectory], float]]:
    """Functions of a Trajectory by the names of summaries.

    Parameters
    ----------
    names : sequence of str
        As in ``[sweep]``.
    folder : Path, optional
        Folder to which files of user functions are relative.
    **known
        Further inputs of some summaries: ``wear``, a wear law, ``thickness`` [m].

    Raises
    ------
    InputError
        If a summary does not exist, or an input that it needs is not given.
    """
    return {name: _function(name, folder or Path(), known) for name in names}


def unit_of(name: str) -> str:
    """Unit of a summary; empty for dimensionless summaries and user functions."""
    found = SUMMARIES.get(name.partition("@")[0])
    return "" if found is None else found.unit


def _function(name: str, folder: Path, known: Mapping[str, Any]) -> Callable[[Trajectory], float]:
    if ".py:" in name:
        file, _, wanted = name.rpartition(":")
        return user_function(folder / file, wanted)
    bare, at, point = name.partition("@")
    if bare not in SUMMARIES:
        raise InputError(f"There is no summary '{bare}'{nearest(bare, SUMMARIES)}; there are: "
                         f"{choices(SUMMARIES)}, or FILE.py:FUNCTION.")
    function = SUMMARIES[bare].function
    options: dict[str, Any] = {}
    for key, parameter in list(inspect.signature(function).parameters.items())[1:]:
        if key == "point":
            continue
        if known.get(key) is not None:
            options[key] = known[key]
        elif parameter.default is inspect.Parameter.empty:
            raise InputError(f"The summary '{bare}' needs {_GIVEN.get(key, key)}.")
    if at:
        if "point" not in inspect.signature(function).parameters:
            raise InputError(f"The summary '{bare}' is not one of a point; leave out "
                             f"'@{point}'.")
        number = whole_number(point)
        options["point"] = point if number is None else number
    return partial(function, **options) if options else function


def usual_point(trajectory: Trajectory) -> Point:
    """Default point: B, or the middle contact node for a basis without B."""
    basis = trajectory.system.basis
    return "B" if basis.T[0].any() else basis.contact_nodes // 2


def _duration(trajectory: Trajectory) -> float:
    return float(trajectory.time[-1] - trajectory.time[0])


def _mean(trajectory: Trajectory, values: NDArray[Any]) -> float:
    return float(np.trapezoid(values, trajectory.time)) / _duration(trajectory)


def _part(trajectory: Trajectory, state: ContactState) -> float:
    basis = trajectory.system.basis
    lengths = np.where(basis.spring_nodes, 0.0, basis.tributary)
    if not lengths.any():
        return float("nan")
    return float((trajectory.contact_state == state).mean(axis=0) @ lengths / lengths.sum())


def largest_displacement(trajectory: Trajectory) -> float:
    """Largest displacement of B, C, the contact nodes and other named points at any time."""
    basis = trajectory.system.basis
    moved = np.einsum("pkm,tm->tpk", basis.T[:, : basis.dimension], trajectory.modal_coordinates)
    if basis.dimension == 3:
        return float(np.linalg.norm(moved, axis=-1).max())
    return float(np.hypot(moved[..., 0], moved[..., 1]).max())


def amplitude_x(trajectory: Trajectory, point: Point | None = None) -> float:
    """Half the range of the displacement x of a point."""
    return 0.5 * float(np.ptp(_of_point(trajectory, point)[:, 0]))


def amplitude_y(trajectory: Trajectory, point: Point | None = None) -> float:
    """Half the range of the displacement y of a point."""
    return 0.5 * float(np.ptp(_of_point(trajectory, point)[:, 1]))


def amplitude_z(trajectory: Trajectory, point: Point | None = None) -> float:
    """Half the range of the displacement z of a point of a solid."""
    if trajectory.system.basis.dimension == 2:
        raise InputError("plane bodies do not move along z; take amplitude_x or amplitude_y.")
    return 0.5 * float(np.ptp(_of_point(trajectory, point)[:, 2]))


def rms_velocity(trajectory: Trajectory, point: Point | None = None) -> float:
    """Root mean square of the velocity of a point, of all directions together."""
    return float(np.sqrt(_mean(trajectory, (_velocity(trajectory, point) ** 2).sum(axis=1))))


def _velocity(trajectory: Trajectory, point: Point | None) -> Array:
    """Velocity (N, d) of a point [m/s]."""
    found = trajectory.velocity(usual_point(trajectory) if point is None else point)
    return found[:, : trajectory.system.basis.dimension]


def _of_point(trajectory: Trajectory, point: Point | None) -> Array:
    return trajectory.displacement(usual_point(trajectory) if point is None else point)


def stick_fraction(trajectory: Trajectory) -> float:
    """Fraction of time and contact length in stick."""
    return _part(trajectory, ContactState.STICK)


def slip_fraction(trajectory: Trajectory) -> float:
    """Fraction of time and contact length in slip."""
    return _part(trajectory, ContactState.SLIP)


def open_fraction(trajectory: Trajectory) -> float:
    """Fraction of time and contact length without contact."""
    return _part(trajectory, ContactState.OPEN)


def mean_normal_force(trajectory: Trajectory) -> float:
    """Mean over time of the sum of the normal forces, without those of nonlinear springs."""
    touching = ~trajectory.system.basis.spring_nodes
    return _mean(trajectory, trajectory.normal_force[:, touching].sum(axis=1))


def peak_normal_force(trajectory: Trajectory) -> float:
    """Largest sum of the normal forces."""
    return float(trajectory.normal_force.sum(axis=1).max())


def mean_friction_force(trajectory: Trajectory) -> float:
    """Mean over time of the sum of the friction forces; on the body they act in -x."""
    return _mean(trajectory, trajectory.friction_force.sum(axis=1))


def peak_friction_force(trajectory: Trajectory) -> float:
    """Largest magnitude of the sum of the friction forces."""
    return float(np.abs(trajectory.friction_force.sum(axis=1)).max())


def peak_line_load(trajectory: Trajectory) -> float:
    """Largest normal force per length of the contact face."""
    return float(trajectory.line_load.max())


def peak_pressure(trajectory: Trajectory) -> float:
    """Largest normal force per area of the contact face."""
    return float(trajectory.pressure.max())


def friction_power(trajectory: Trajectory) -> float:
    """Mean power lost by friction between body and ground."""
    return _power(trajectory, "friction")


def belt_power(trajectory: Trajectory) -> float:
    """Mean power supplied by the moving ground through friction and normal forces."""
    return _power(trajectory, "belt_friction") + _power(trajectory, "belt_normal")


def _power(trajectory: Trajectory, name: str) -> float:
    work = trajectory.work[:, POWERS.index(name)]
    return float(work[-1] - work[0]) / _duration(trajectory)


def wear_depth(trajectory: Trajectory, wear: WearLaw, thickness: float) -> float:
    """Largest wear depth along the face, by the law of ``[wear]``."""
    solid = trajectory.system.basis.dimension == 3
    return float(trajectory.wear_depth(wear, None if solid else thickness)[-1].max())


def wear_rate(trajectory: Trajectory, wear: WearLaw, thickness: float) -> float:
    """Largest wear depth along the face over the time of the run, by the law of ``[wear]``."""
    return wear_depth(trajectory, wear, thickness) / _duration(trajectory)


def dominant_frequency(trajectory: Trajectory, point: Point | None = None) -> float:
    """Frequency of the largest peak in the spectrum of a point's velocity (Hann window)."""
    t = trajectory.time
    velocity = _velocity(trajectory, point)
    if len(t) < 8:
        raise InputError(f"the frequency needs at least 8 output times, not {len(t)}.")
    if not np.allclose(np.diff(t), t[1] - t[0], rtol=1e-6):
        raise InputError("the frequency needs equally spaced output times.")
    window = np.hanning(len(t))[:, None]
    size = np.abs(np.fft.rfft((velocity - velocity.mean(axis=0)) * window, axis=0))
    power = (size**2).sum(axis=1)
    k = int(np.argmax(power[1:-1])) + 1
    # The logarithm of a window's peak is close to a parabola.
    low, middle, high = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
    bend = low - 2.0 * middle + high
    shift = 0.5 * (low - high) / bend if bend < 0.0 else 0.0
    return float(k + shift) / (len(t) * float(t[1] - t[0]))


def periods(trajectory: Trajectory) -> float:
    """Number of drive periods after which the run repeats; 0 if it does not."""
    from fecontact.analysis.periodicity import periodicity

    found = periodicity(trajectory, t_start=float(trajectory.time[0]))
    return float(found.periods or 0)


def lyapunov_exponent(trajectory: Trajectory) -> float:
    """Largest Lyapunov exponent, from another run of equal length from the first state."""
    from fecontact.bifurcation.attractors.lyapunov import lyapunov_exponents

    duration = _duration(trajectory)
    found = lyapunov_exponents(trajectory.system, duration, initial=trajectory.states[0],
                               transient=0.1 * duration)
    return float(found.exponents[0])


def end_time(trajectory: Trajectory) -> float:
    """Time at which the run ended, on schedule or at an event."""
    return float(trajectory.time[-1])


def energy_imbalance(trajectory: Trajectory) -> float:
    """Error of the energy balance relative to the largest energy in it."""
    return trajectory.energies.imbalance


SUMMARIES: Mapping[str, Summary] = {
    function.__name__: Summary(function, unit) for function, unit in (
        (largest_displacement, "m"), (amplitude_x, "m"), (amplitude_y, "m"), (amplitude_z, "m"),
        (rms_velocity, "m/s"), (stick_fraction, ""), (slip_fraction, ""), (open_fraction, ""),
        (mean_normal_force, "N"), (peak_normal_force, "N"), (mean_friction_force, "N"),
        (peak_friction_force, "N"), (peak_line_load, "N/m"), (peak_pressure, "Pa"),
        (friction_power, "W"), (belt_power, "W"), (wear_depth, "m"), (wear_rate, "m/s"),
        (dominant_frequency, "Hz"), (periods, ""), (lyapunov_exponent, "1/s"), (end_time, "s"),
        (energy_imbalance, ""),
    )
}
