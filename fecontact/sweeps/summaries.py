"""Summaries of a run: scalar functions of a :class:`Trajectory`.

Each has a name, used in study files and as a column of the table of a sweep. ``NAME@POINT``
selects another point than the default: ``amplitude_x@C``, or ``amplitude_y@0`` for the first
contact node. ``NAME@INTERFACE`` sums forces over one interface. ``FILE.py:FUNCTION`` is a user
function of a Trajectory that returns a number.
"""

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from fecontact.analysis.summaries import RUN_SUMMARIES, Summary, duration
from fecontact.core.checks import whole_number
from fecontact.core.errors import FecontactError, InputError, choices, nearest
from fecontact.core.user_code import user_function
from fecontact.integrate.trajectory import Trajectory
from fecontact.laws.wear import WearLaw

# Where a study gives what some summaries need.
_GIVEN = {"wear": "a wear law; give its coefficient in [wear]",
          "thickness": "the thickness of the body, the same for several; give it in [body]"}


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
        Names of summaries, written as in ``[sweep]``.
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


def summaries_table() -> str:
    """Names, units and meanings of all summaries, as a table in Markdown."""
    rows = []
    for name, one in SUMMARIES.items():
        known = inspect.signature(one.function).parameters
        also = " or ".join(f"`{name}@{what.upper()}`" for what, key in (
            ("point", "point"), ("interface", "face")) if key in known)
        meaning = one.text.replace("``", "`") + (f" Also {also}." if also else "")
        rows.append(f"| `{name}` | {one.unit} | {meaning} |")
    return "\n".join(["Numbers that `summaries` may name; POINT is a named point or the number of "
                      "a contact node, B by default:", "", "| summary | unit | meaning |",
                      "|---|---|---|", *rows])


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
        if key in ("point", "face"):
            continue
        if known.get(key) is not None:
            options[key] = known[key]
        elif parameter.default is inspect.Parameter.empty:
            raise InputError(f"The summary '{bare}' needs {_GIVEN.get(key, key)}.")
    if at:
        known_options = inspect.signature(function).parameters
        if "face" in known_options:
            options["face"] = point
        elif "point" in known_options:
            number = whole_number(point)
            options["point"] = point if number is None else number
        else:
            raise InputError(f"The summary '{bare}' is not one of a point; leave out "
                             f"'@{point}'.")
    return partial(function, **options) if options else function


def wear_depth(trajectory: Trajectory, wear: WearLaw, thickness: float) -> float:
    """Largest wear depth along the face, by the law of ``[wear]``."""
    solid = trajectory.system.basis.dimension == 3
    return float(trajectory.wear_depth(wear, None if solid else thickness)[-1].max())


def wear_rate(trajectory: Trajectory, wear: WearLaw, thickness: float) -> float:
    """Largest wear depth along the face over the time of the run, by the law of ``[wear]``."""
    return wear_depth(trajectory, wear, thickness) / duration(trajectory)


def lyapunov_exponent(trajectory: Trajectory) -> float:
    """Largest Lyapunov exponent, from another run of equal length from the first state."""
    from fecontact.bifurcation.attractors.lyapunov import lyapunov_exponents

    time = duration(trajectory)
    found = lyapunov_exponents(trajectory.system, time, initial=trajectory.states[0],
                               transient=0.1 * time)
    return float(found.exponents[0])


SUMMARIES: Mapping[str, Summary] = {**RUN_SUMMARIES, **{
    function.__name__: Summary(function, unit) for function, unit in (
        (wear_depth, "m"), (wear_rate, "m/s"), (lyapunov_exponent, "1/s"))}}
