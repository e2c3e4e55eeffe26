"""Equations of harmonic balance of contact systems in compiled code."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField, affine_arrays
from fecontact.bifurcation.fields.parametrised_system import AffineArrays
from fecontact.bifurcation.harmonic.compiled import arrays

# Most unknowns for which compiled code without LAPACK is faster.
_MOST_UNKNOWNS = 160


@dataclass(eq=False)
class CompiledBalance:
    """What compiled code needs of a field over one parameter, kept for all problems along a branch.

    Problems are those of :class:`fecontact.bifurcation.harmonic.balance.Balance`.

    Attributes
    ----------
    contact_field : ContactField
    affine : AffineArrays or None
        Arrays of the system about the last value.
    held : tuple, optional
        Index of the parameter, period times it, and the values of the others, for which these are.
    known : dict
        Equations by harmonics, samples and periods.
    """

    contact_field: ContactField
    affine: AffineArrays | None = None
    held: tuple[int, float | None, bytes] | None = None
    known: dict[tuple[int, int, int], arrays.Equations] = field(default_factory=dict)

    @classmethod
    def of(cls, problem: Any) -> "CompiledBalance | None":
        """None where the period is unknown, or changes with the parameter in an unknown way."""
        found = problem.field
        if (not isinstance(found, ContactField) or problem.autonomous
                or not (problem.turn is not None or found.constant_period)):
            return None
        return cls(found)

    def equations(self, problem: Any, value: float) -> arrays.Equations | None:
        """Equations about a value of the parameter; None where its arrays are not affine in it.

        There is one room for all equations of a size: what is found there has to be copied.
        """
        if not 0 < problem.size <= _MOST_UNKNOWNS:
            return None
        near, others = self.affine, problem.values.copy()
        others[problem.free] = 0.0
        held = problem.free, problem.turn, others.tobytes()
        if near is None or self.held != held or not near.low < value < near.high:
            self.held = held
            values = problem.values.copy()
            values[problem.free] = value
            near = self.affine = affine_arrays(self.contact_field, values, problem.free)
            self.known.clear()
        if near is None:
            return None
        key = problem.harmonics, problem.samples, problem.periods
        if key not in self.known:
            self.known[key] = self._made(problem, near, value)
        found = self.known[key]
        if found.offsets is not problem.kept.offsets:
            found = self.known[key] = found._replace(offsets=problem.kept.offsets)
        return found

    def _made(
        self, problem: Any, near: AffineArrays, value: float
    ) -> arrays.Equations:
        layout, series = problem.layout, problem.series
        numbers = np.zeros(arrays.ROUNDING + 1)
        if problem.turn is not None:
            numbers[arrays.TURN] = problem.periods * problem.turn
        else:
            numbers[arrays.PERIOD] = problem.period(np.array([value]))
        numbers[arrays.LOW], numbers[arrays.HIGH] = near.low, near.high
        room = arrays.room_for(problem.harmonics, problem.samples, layout.displacements,
                                layout.memory, layout.nodes)
        return arrays.Equations(
            near.arrays, near.flat, near.base, near.slope, series.times, series.values,
            series.projection, series.cosines, series.sines, problem.kept.rows,
            problem.kept.offsets, np.full(layout.displacements, np.inf), numbers, layout.nodes,
            room)
