"""Period of the excitation of a contact system."""

from typing import Any

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.laws.excitation import Drive
from fecontact.laws.ground.fourier_series import FourierSeries
from fecontact.laws.ground.measured_profile import MeasuredProfile
from fecontact.laws.ground.profile import Profile, Sine
from fecontact.laws.ground.random_roughness import RandomRoughness
from fecontact.laws.signals.harmonic import Constant, Harmonic, Harmonics
from fecontact.system.contact_system import ContactSystem
from fecontact.system.fields.in_time import in_time
from fecontact.system.fields.vector_field import VectorField

DRIVE_FREQUENCY = "drive.frequency_hz"
_REPEATING = (Harmonic, Harmonics)


def common_period(system: ContactSystem) -> float | None:
    """Common period [s] of drive, loads and ground; None for an autonomous system.

    AnalysisError if one of them is not periodic, or the periods have no common multiple up to 1000
    times the longest.
    """
    require_kind("common_period", ContactSystem, system=system)
    return common_multiple([period for _, period in source_periods(system)])


def drive_sets_period(system: ContactSystem) -> bool:
    """Whether nothing repeats in time but the drive's motion with its frequency.

    AnalysisError as :func:`common_period`.
    """
    names = {name for name, _ in source_periods(system)}
    return type(system.drive) is Drive and bool(names) and names <= _set_by_frequency(system)


def _set_by_frequency(system: ContactSystem) -> set[str]:
    """Names of the motions of the drive that have its frequency."""
    return {f"drive.motion_{axis}" for axis in "xyz"
            if getattr(system.drive, f"motion_{axis}") is None}


def require_effect(system: ContactSystem, name: str) -> None:
    """Refuse the frequency of the drive as a parameter where only something else excites a system.

    Raises
    ------
    InputError
        If ``name`` is that frequency and the drive moves nothing with it.
    AnalysisError
        As :func:`common_period`.
    """
    names = [source for source, _ in source_periods(system)] if name == DRIVE_FREQUENCY else []
    if names and not _set_by_frequency(system) & set(names):
        other = names[0]
        parameter = ("ground.speed" if other.startswith("ground.") else
                     f"{other}.signal.frequency_hz" if other.startswith("load.forces.") else
                     f"{other}.frequency_hz")
        raise InputError(f"parameter = '{name}' changes nothing: the drive has no spring or no "
                         f"amplitude, and {other} excites the system; take another one, such as "
                         f"'{parameter}'.")


def source_periods(system: ContactSystem) -> list[tuple[str, float]]:
    """Names of the excitations that repeat in time, each with its period [s].

    AnalysisError if one of them is not periodic.
    """
    drive, ground = system.drive, system.ground
    given: list[tuple[str, Any]] = [
        (f"drive.motion_{axis}", motion)
        for axis, acts, motion in zip("xyz", drive.moves, drive.motions, strict=True) if acts]
    given += [(f"load.{name}", signal) for name, signal in system.load.signals.items()]
    periods: list[tuple[str, float]] = []
    for name, source in given:
        if isinstance(source, Constant) or (isinstance(source, _REPEATING)
                                            and source.shortest_period is None):
            continue
        if source.fundamental_hz is None:
            raise AnalysisError(f"{name} is not periodic; periodic orbits need a drive and loads "
                                f"that repeat.")
        periods.append((name, 1.0 / source.fundamental_hz))
    if not system.prescribed_motion.constant:
        raise AnalysisError("A motion of the ground, or of a side that slides, makes its speed "
                            "depend on time; periodic orbits are computed for constant speed.")
    shapes = [("ground.friction_variation", ground.friction_variation)]
    if ground.height_map is not None and ground.wavy and (ground.speed or ground.speed_y):
        raise AnalysisError("ground.height_map repeats in two directions; periodic orbits need "
                            "waves along one, such as a Sine, or ground at rest.")
    if ground.wavy and ground.height_map is None:
        shapes.append(("ground.profile", ground.profile or Sine(ground.amplitude,
                                                                ground.wavelength)))
    for name, shape in shapes:
        speed = ground.speed
        if system.basis.dimension == 3:
            speed = (ground.speed * ground.wave_direction[0]
                     + ground.speed_y * ground.wave_direction[1])
        if shape is not None and not shape.flat and speed != 0.0:
            periods.append((name, _repeat_length(name, shape) / abs(speed)))
    return periods


def forcing_period(system: ContactSystem | VectorField) -> float:
    """Period of the excitation of a system, or of a vector field at its base values [s].

    The period of a contact system is the common period of drive, loads and ground.

    Raises
    ------
    InputError
        If the system is autonomous.
    AnalysisError
        If one of them is not periodic, or the periods have no common multiple up to 1000 times the
        longest.
    """
    moving = in_time("forcing_period", system)
    period = (common_period(moving) if isinstance(moving, ContactSystem)
              else moving.forcing_period(moving.values))
    if period is None:
        raise InputError("The system has no time-dependent excitation, and so no period; give "
                         "period, or a periodic drive.")
    return period


def _repeat_length(name: str, shape: Profile) -> float:
    if isinstance(shape, Sine | FourierSeries):
        return float(shape.wavelength)
    if isinstance(shape, RandomRoughness):
        return float(shape.length)
    if isinstance(shape, MeasuredProfile) and shape.periodic:
        return float(shape.abscissa_scale * (shape.abscissa[-1] - shape.abscissa[0]))
    raise AnalysisError(f"{name} is not periodic; periodic orbits need periodic ground, such as "
                        f"a Sine, a FourierSeries or a periodic MeasuredProfile.")


def common_multiple(periods: list[float]) -> float | None:
    """Common period of some periods [s]; None for none.

    AnalysisError if they have no common multiple up to 1000 times the longest.
    """
    if not periods:
        return None
    if len(periods) == 1:
        return periods[0]
    longest = max(periods)
    for count in range(1, 1001):
        ratios = np.array([count * longest / period for period in periods])
        if (np.abs(ratios - np.round(ratios)) <= 1e-9 * ratios).all():
            return count * longest
    listed = ", ".join(f"{period:.6g} s" for period in periods)
    raise AnalysisError(f"The periods of drive, loads and ground ({listed}) have no common "
                        f"multiple; choose frequencies in the ratio of whole numbers.")
