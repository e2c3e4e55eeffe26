"""Comparison of runs: parameters that differ, and key numbers side by side."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fecontact.analysis.histories import usual_point
from fecontact.analysis.key_numbers import KeyNumbers, key_numbers
from fecontact.analysis.summaries import Point
from fecontact.core.checks import require_kind
from fecontact.core.dotted_parameters import flattened
from fecontact.core.errors import InputError
from fecontact.core.tables import located
from fecontact.core.units import quantity
from fecontact.integrate.trajectory import Trajectory

# Sections of a study without influence on the motion.
_NOT_COMPARED = ("render", "output", "sweep", "fit")
_LONGEST = 60  # letters of a value in a table


@dataclass(frozen=True)
class Comparison:
    """Differences of runs, the first of which is the reference.

    Attributes
    ----------
    names : tuple of str
        Names of the runs.
    parameters : mapping of key to tuple of str
        Keys of the studies whose values differ, with the value of each run as text; empty where a
        run has none.
    numbers : tuple of KeyNumbers
        Key numbers of each run.
    """

    names: tuple[str, ...]
    parameters: Mapping[str, tuple[str, ...]]
    numbers: tuple[KeyNumbers, ...]

    def parameter_rows(self) -> list[tuple[str, ...]]:
        """Rows of the table of parameters: key and value of each run."""
        return [(key, *values) for key, values in self.parameters.items()]

    def number_rows(self) -> list[tuple[str, ...]]:
        """Rows of the table of key numbers: title, value of each run, change from the first."""
        rows: list[tuple[str, ...]] = [("steady", *(one.motion for one in self.numbers))]
        found = dict.fromkeys(name for one in self.numbers for name in one.values)
        for name in found:
            title = next(one.titles[name] for one in self.numbers if name in one.titles)
            first = self.numbers[0].values.get(name)
            rows.append((title, *(_cell(one, name, first if k else None)
                                  for k, one in enumerate(self.numbers))))
        return rows

    def change(self, name: str, run: int = 1) -> float | None:
        """Relative change of a key number from the first run to another; None without values."""
        first, other = (self.numbers[k].values.get(name) for k in (0, run))
        return None if first is None or other is None or not first else other / first - 1.0


def _cell(numbers: KeyNumbers, name: str, first: float | None) -> str:
    value = numbers.values.get(name)
    if value is None:
        return ""
    text = quantity(value, numbers.unit(name), 4)
    if not first:
        return text
    return f"{text} ({100.0 * (value - first) / abs(first):+.3g} %)"


def compare_runs(
    runs: Mapping[str, Trajectory], points: Sequence[Point] = (), *,
    studies: Sequence[str | None] = (), t_start: float | None = None,
) -> Comparison:
    """Compare runs by the parameters of their studies and by their key numbers.

    Parameters
    ----------
    runs : mapping of name to Trajectory
        The runs; the first is the reference.
    points : sequence of str or int
        Named points and contact nodes; by default the first that moves in all runs of B, the middle
        contact node, C and the other named points.
    t_start
        See :func:`fecontact.analysis.key_numbers`.
    studies : sequence of str or None
        Study of each run as TOML text, as :attr:`fecontact.io.Case.study` holds it.

    Raises
    ------
    InputError
        For fewer than two runs, a point that a run does not have, or another number of studies.
    """
    require_runs("compare_runs", runs)
    chosen = compared_points(runs, points)
    if studies and len(studies) != len(runs):
        raise InputError(f"compare_runs: {len(studies)} studies do not match {len(runs)} runs; "
                         f"give one for each, or none.")
    return Comparison(tuple(runs), differing_parameters(studies), tuple(
        key_numbers(run, chosen, t_start=t_start) for run in runs.values()))


def compared_points(
    runs: Mapping[str, Trajectory], points: Sequence[Point] = ()
) -> tuple[Point, ...]:
    """Points of a comparison: the given ones, or one that moves in all runs if there is any.

    Raises
    ------
    InputError
        For a point that a run does not have.
    """
    require_kind("compare_runs", Sequence, points=points)
    chosen = tuple(points) or (usual_point(*(run.basis for run in runs.values())),)
    for name, run in runs.items():
        where = f"{name}:" if points else (
            f"{name} lacks the default point of {next(iter(runs))}; name a point of all runs, on "
            f"the command line by --point:")
        with located(where):
            for point in chosen:
                run.basis.point_index(point)
    return chosen


def require_runs(what: str, runs: Mapping[str, Trajectory]) -> None:
    """Raise InputError unless there are two runs or more, by their names."""
    require_kind(what, Mapping, runs=runs)
    for name, run in runs.items():
        require_kind(what, Trajectory, **{str(name): run})
    if len(runs) < 2:
        raise InputError(f"{what}: {len(runs)} run{'s' * (len(runs) != 1)} cannot be compared; "
                         f"give two or more.")


def differing_parameters(studies: Sequence[str | None]) -> dict[str, tuple[str, ...]]:
    """Dotted keys of studies (TOML text) that differ, with their values as text."""
    tables = [_texts(tomllib.loads(study or "")) for study in studies]
    keys = dict.fromkeys(key for table in tables for key in table)
    found = {key: tuple(table.get(key, "") for table in tables) for key in keys}
    return {key: tuple(text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
                       for text in values)
            for key, values in found.items() if len(set(values)) > 1}


def _texts(study: Mapping[str, Any]) -> dict[str, str]:
    """Values of the sections that are compared, as text by dotted keys."""
    compared = {name: table for name, table in study.items() if name not in _NOT_COMPARED}
    return {key: f"{value:.10g}" if isinstance(value, float) else str(value)
            for key, value in flattened(compared).items()}
