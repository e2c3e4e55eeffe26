"""Equations of harmonic balance of contact systems in compiled code."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.fields.corners import AffineArrays
from fecontact.bifurcation.harmonic.compiled import arrays
from fecontact.bifurcation.harmonic.compiled.evaluation import (
    condense_plain,
    condense_sampled,
    evaluate_plain,
    evaluate_sampled,
)
from fecontact.bifurcation.harmonic.elements import element_forces
from fecontact.core.types import Array
from fecontact.system.elastic_sliders import without_elements
from fecontact.system.jacobian import batch_rates
from fecontact.system.nodes import SystemArrays

# Most unknowns that compiled code without LAPACK solves for together.
MOST_UNKNOWNS = 160
# Places within the range of the parameter that tell whether loads are affine in it.
_PLACES = np.array([0.02, 0.98, 0.31])
# Relative error of such loads.
_AFFINE = 1e-13
# Part of the forces on a body at rest up to which their mean is nothing.
_NOTHING = 1e-14
# Arrays of a system that do not act on contact forces.
_OF_BODY = frozenset({"stiffness", "damping", "modal_damping", "constant_load", "drive_shapes",
                      "drive_stiffness", "drive_damping", "drive_parameters", "load_shapes",
                      "load_parameters"})


@dataclass(eq=False)
class CompiledBalance:
    """Data of a field over one parameter for compiled code, kept for all problems along a branch.

    Problems are those of :class:`fecontact.bifurcation.harmonic.balance.Balance`.

    Attributes
    ----------
    contact_field : ContactField
    affine : AffineArrays or None
        Arrays of the system about the last value.
    held : tuple, optional
        Index of the parameter, period times it, and the values of the others for ``affine``.
    known : dict
        Equations by harmonics, samples and periods.
    """

    contact_field: ContactField
    affine: AffineArrays | None = None
    held: tuple[int, float | None, bytes] | None = None
    known: dict[tuple[Any, ...], arrays.Equations] = field(default_factory=dict)

    @classmethod
    def of(cls, problem: Any) -> "CompiledBalance | None":
        """Data of a problem; None if its period, or its change with the parameter, is unknown."""
        found = problem.field
        if (not isinstance(found, ContactField) or problem.autonomous
                or (problem.turn is None and problem.fixed is None)):
            return None
        return cls(found)

    def equations(self, problem: Any, value: float) -> arrays.Equations | None:
        """Equations about a value of the parameter; None where its arrays are not affine in it.

        There is one workspace for equations of a size: what is found there has to be copied. None
        also for more unknowns with internal variables, a list of harmonics, or loads that are not
        affine.
        """
        small = problem.size <= MOST_UNKNOWNS
        if not problem.size or not (small or not (problem.layout.memory or problem.orders)):
            return None
        near, others = self.affine, problem.values.copy()
        others[problem.free] = 0.0
        held = problem.free, problem.turn, others.tobytes()
        if near is None or self.held != held or not near.low < value < near.high:
            self.held = held
            values = problem.values.copy()
            values[problem.free] = value
            near = self.affine = self.contact_field.family.affine(
                values, problem.free)
            self.known.clear()
        if near is None:
            return None
        key = problem.harmonics, problem.samples, problem.periods, problem.orders
        if key not in self.known:
            self.known[key] = self._made(problem, near, value)
        found = self.known[key]
        if not small and found.contact is near.arrays:
            return None
        if found.kept_offsets is not problem.kept.offsets:
            found = self.known[key] = found._replace(
                kept_offsets=problem.kept.offsets,
                offsets=problem.kept.offsets[: 0 if problem.kept.exact else None])
        return found

    def _made(
        self, problem: Any, near: AffineArrays, value: float
    ) -> arrays.Equations:
        layout, series = problem.layout, problem.series
        m, L = layout.displacements, 2 * problem.harmonics + 1
        numbers = np.zeros(arrays.TIMED + 1)
        numbers[arrays.KINKS] = self.contact_field.kinked
        if problem.turn is not None:
            numbers[arrays.TURN] = problem.periods * problem.turn
        else:
            numbers[arrays.PERIOD] = problem.period(np.array([value]))
        numbers[arrays.LOW], numbers[arrays.HIGH] = near.low, near.high
        most = m if problem.size <= MOST_UNKNOWNS else max(1, MOST_UNKNOWNS // L)
        workspace = arrays.workspace_for(problem.harmonics, problem.samples, m, layout.memory,
                                         layout.nodes, most, problem.kept.exact,
                                         near.arrays.rows.shape[1])
        contact, kept = near.arrays, problem.kept
        body, given = np.zeros((4, m, m)), np.zeros((2, problem.samples, m))
        found = self._without_contact(problem, near)
        if found is not None:
            contact = _contact_alone(contact)
            body, given, rests = found
            numbers[arrays.STEADY] = self._steady(near)
            numbers[arrays.RESTS] = rests and numbers[arrays.STEADY]
            numbers[arrays.PLAIN] = (numbers[arrays.STEADY] and problem.size <= MOST_UNKNOWNS
                                     and (kept.exact or not layout.memory)
                                     and self._plain(near))
        plain = numbers[arrays.PLAIN] != 0.0
        marched = slice(0, 0 if kept.exact else None)
        elements = kept.elements if kept.exact else kept.elements[:0]
        return arrays.Equations(
            without_elements(contact) if kept.exact else contact, near.flat, near.base,
            near.slope, series.times, series.values, series.projection, series.cosines,
            series.sines, body, given,
            series.projection @ given, kept.rows[marched], kept.offsets[marched],
            kept.blocks, elements, kept.offsets, contact, problem.onsets,
            np.full(m, np.inf), numbers, layout.nodes, problem.rows_kept, workspace,
            (evaluate_plain if plain else evaluate_sampled).address,
            (condense_plain if plain else condense_sampled).address,
            element_forces.address if len(elements) else 0)

    def _without_contact(
        self, problem: Any, near: AffineArrays
    ) -> tuple[Array, Array, bool] | None:
        """``body`` and ``given`` of the equations, and whether contact and loads leave rest alone.

        The latter holds for all values of the parameter if contact forces do not depend on it. None
        where loads are not affine.
        """
        m, system = problem.layout.displacements, near.arrays
        places = near.low + (near.high - near.low) * _PLACES
        still = np.zeros((problem.samples, self.contact_field.dimension))
        rates, free = np.empty_like(still), system._replace(rows=system.rows[:0])
        times, found, bodies = still[:, 0], [], []
        for place in places:
            near.flat[:] = near.base + place * near.slope
            times = problem.series.times * problem.period(np.array([place]))
            batch_rates(times, still, free, rates)
            found.append(rates[:, m : 2 * m].copy())
            bodies.append([system.stiffness.copy(), system.damping.copy()])
        batch_rates(times, still, system, rates)
        loads, matrices, rest = np.array(found), np.array(bodies), rates[:, m : 2 * m]
        body, given = (np.array(_line(places, values)) for values in (matrices, loads))
        off = np.abs(given[0] + np.multiply.outer(places, given[1]) - loads).max(axis=(1, 2))
        if (off > _AFFINE * np.abs(given).max() * np.maximum(np.abs(places), 1.0)).any():
            return None
        means = loads.mean(axis=1)
        return body.reshape(4, m, m), given, bool(
            np.abs(rest.mean(axis=0)).max() <= _NOTHING * np.abs(rest).max()
            and np.abs(means - means[-1]).max() <= _NOTHING * np.abs(loads).max())

    def _steady(self, near: AffineArrays) -> bool:
        """Whether contact forces depend neither on the parameter nor on time."""
        ground = self.contact_field.system().ground
        return (not ground.wavy and ground.friction_variation is None
                and near.varying <= _OF_BODY)

    def _plain(self, near: AffineArrays) -> bool:
        """Whether contact forces are those of plane bodies on ground of constant speed."""
        return (near.arrays.rows.shape[1] == 2
                and self.contact_field.system().prescribed_motion.constant)


def _line(places: Array, values: Array) -> tuple[Array, Array]:
    """Values at p = 0 and slopes of the line through values at the first two places."""
    slope = (values[1] - values[0]) / (places[1] - places[0])
    return values[0] - places[0] * slope, slope


def _contact_alone(system: SystemArrays) -> SystemArrays:
    """Arrays of a system without all that acts on its body beside contact."""
    return system._replace(
        stiffness=np.zeros_like(system.stiffness), damping=np.zeros_like(system.damping),
        constant_load=np.zeros_like(system.constant_load),
        drive_shapes=system.drive_shapes[:0], drive_stiffness=system.drive_stiffness[:0],
        drive_damping=system.drive_damping[:0], drive_parameters=system.drive_parameters[:0],
        drive=system.drive[:0], load_shapes=system.load_shapes[:0],
        load_parameters=system.load_parameters[:0], load=system.load[:0])
