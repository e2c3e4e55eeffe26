"""The key numbers of a run: frequency, amplitudes, forces, friction power, and steady motion."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.analysis.histories import observes_motion, point_name, usual_point
from fecontact.analysis.periodicity import Steadiness, drive_period, steadiness
from fecontact.analysis.sampling import alias_message
from fecontact.analysis.spectra import FEWEST_PERIODS
from fecontact.analysis.summaries import RUN_SUMMARIES, Point, coarse_note
from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, ModelWarning
from fecontact.core.units import quantity
from fecontact.integrate.trajectory import Trajectory
from fecontact.reduction.assembly.contact_faces import contact_faces

_NORMAL = ("mean_normal_force", "peak_normal_force")
_FORCES = (*_NORMAL, "mean_friction_force", "peak_friction_force")
_STILL = 1e-9  # of the largest amplitude, below which a component does not move


@dataclass(frozen=True)
class KeyNumbers:
    """Key numbers of a run.

    Attributes
    ----------
    values : mapping of name to number
        In SI units; names are those of summaries of sweeps, such as ``amplitude_x@B``.
    steadiness : Steadiness
        Whether the motion has become steady; see :func:`fecontact.analysis.steadiness`.
    interval : (float, float)
        Time over which the values are taken [s].
    titles : mapping of name to text
        Names for display, also of frequencies that the interval is too short to resolve.
    drive_period : float or None
        Period of the drive [s].
    note : str
        Where outputs are too few for the numbers, and nothing is known between them, what that may
        do to them; else empty.
    """

    values: Mapping[str, float]
    steadiness: Steadiness
    interval: tuple[float, float]
    titles: Mapping[str, str]
    drive_period: float | None = None
    note: str = ""

    def unit(self, name: str) -> str:
        """SI unit of a value."""
        return RUN_SUMMARIES[name.partition("@")[0]].unit

    def rows(self) -> list[tuple[str, str]]:
        """Names and values with units as text, and the state of the motion."""
        return [("steady", self.motion), *(
            (title, quantity(self.values[name], self.unit(name), 4) if name in self.values
             else f"fewer than {FEWEST_PERIODS:g} periods; run for longer")
            for name, title in self.titles.items()), *(
            [("outputs", self.note)] if self.note else [])]

    @property
    def motion(self) -> str:
        """The state of the motion as text."""
        found = self.steadiness
        if found.kind == "at rest":
            return "yes, at rest"
        if found.kind == "unknown":
            return "unknown: too few output times"
        if found.period is None:
            return f"no, motion repeats with an error of {100.0 * found.misfit:.3g} % of its size"
        text = f"yes, periodic with {quantity(found.period, 's', 4)}"
        if self.drive_period is None:
            return text
        ratio = found.period / self.drive_period
        whole = round(ratio)
        if whole < 1 or abs(ratio - whole) > 0.01 * whole:
            return text
        return f"{text}, {whole} drive period{'s' * (whole > 1)}"


def key_numbers(
    trajectory: Trajectory, points: Sequence[Point] = (), *, t_start: float | None = None
) -> KeyNumbers:
    """Key numbers of a run over its second half.

    Dominant frequency (largest peak of the velocity spectrum), amplitudes (half the range) of
    points in each direction, mean and peak of the total normal and friction forces, of several
    interfaces of each, mean power lost by friction. Without friction its numbers are left out.
    Frequencies need even output times and five periods; without them, and of points that do not
    move, they are left out. Without points that move, frequencies and amplitudes are left out.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    points : sequence of str or int
        Named points and contact nodes; B by default, or the contact node in the middle.
    t_start : float, optional
        Start of the interval [s]; by default the middle of the run. Steadiness is judged
        on the last quarter of the run.

    Raises
    ------
    InputError
        For a point that does not exist, or fewer than two output times after ``t_start``.
    """
    require_kind("key_numbers", Trajectory, trajectory=trajectory)
    t, basis = trajectory.time, trajectory.basis
    begin = 0.5 * float(t[0] + t[-1]) if t_start is None else t_start
    late = trajectory if len(t) < 4 and t_start is None else trajectory.between(begin)
    values: dict[str, float] = {}
    titles: dict[str, str] = {}

    def take(name: str, title: str, **options: Point) -> None:
        bare = name.partition("@")[0]
        try:
            with warnings.catch_warnings():
                # The note says so once.
                warnings.simplefilter("ignore", ModelWarning)
                value = float(RUN_SUMMARIES[bare].function(late, **options))
        except InputError:
            if bare == "dominant_frequency":  # uneven or too few output times
                return
            raise
        if not np.isfinite(value):
            return
        titles[name] = title
        if bare != "dominant_frequency" or value * np.ptp(late.time) >= FEWEST_PERIODS:
            values[name] = value

    found = steadiness(trajectory)
    require_kind("key_numbers", Sequence, points=points)
    chosen = tuple(points)
    if not chosen and observes_motion(basis):
        chosen = (usual_point(basis),)
    for point in chosen:
        # Outputs too far apart show frequencies that the motion does not have.
        if found.kind != "at rest" and not alias_message(late):
            take(f"dominant_frequency@{point}", f"dominant frequency at {point_name(point, basis)}",
                 point=point)
    for point in chosen:
        for axis in "xyz"[: basis.dimension]:
            take(f"amplitude_{axis}@{point}", f"amplitude {axis} at {point_name(point, basis)}",
                 point=point)
    amplitudes = [name for name in values if name.startswith("amplitude")]
    largest = max((values[name] for name in amplitudes), default=0.0)
    for name in amplitudes:
        if values[name] <= _STILL * largest < largest:
            del values[name], titles[name]
    if basis.contact_nodes:
        faces = [face.name for face in contact_faces(basis) if face.name]
        rubbing = bool(trajectory.friction_forces.any())
        for face in faces or [""]:
            for name in _FORCES if rubbing else _NORMAL:
                way = f" in -{'t' if face else 'x'}" * (name == "mean_friction_force")
                title = name.replace("_", " ") + way + f" of {face}" * bool(face)
                take(name + f"@{face}" * bool(face), title, **({"face": face} if face else {}))
        if rubbing:
            take("friction_power", "mean friction power")
    return KeyNumbers(values, found, (float(late.time[0]), float(late.time[-1])), titles,
                      _drive_period(trajectory), coarse_note(late))


def _drive_period(trajectory: Trajectory) -> float | None:
    try:
        return drive_period(trajectory.system)
    except InputError:
        return None
