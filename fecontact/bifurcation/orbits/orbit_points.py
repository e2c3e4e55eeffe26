"""Orbits of points of branches: their method, motion and extremes, by what is stored of them."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from fecontact.bifurcation.fields.contact_field import ContactField
from fecontact.bifurcation.harmonic.estimates import (
    OBSERVED,
    OBSERVED_HARMONICS,
    OBSERVED_SAMPLES,
    observed_of_series,
    peaks,
)
from fecontact.bifurcation.harmonic.layout import balanced
from fecontact.bifurcation.harmonic.method import HarmonicBalance
from fecontact.bifurcation.orbit_methods import Collocation, Shooting
from fecontact.bifurcation.orbits.mesh import extremes, interpolate
from fecontact.bifurcation.orbits.motions import (
    PeriodicMotion,
    collocated,
    joined,
    nodes_on_mesh,
    of_runs,
    run_again,
    sampled_run,
)
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.system.fields.vector_field import VectorField

# Samples per period among which extremes are sought; the error is of the order of their distance
# squared.
_SAMPLES = 4001
# The same where extremes are those of parabolas through the samples.
_FINE = 501


class OrbitPoints(ABC):
    """Points of branches by one method of periodic orbits.

    A point is a :class:`fecontact.bifurcation.BranchPoint`, which asks for what is here.

    Attributes
    ----------
    options : type
        Class of the options of the method.
    stores_orbits : bool
        Whether points hold their whole orbit; others are run again.
    """

    options: ClassVar[type[Any]]
    stores_orbits: ClassVar[bool] = True

    @abstractmethod
    def motion(self, point: Any, field: VectorField | None, samples: int) -> PeriodicMotion:
        """The orbit of a point over one period, both ends included."""

    def trajectory(self, point: Any, field: ContactField, outputs: int) -> Trajectory:
        """The orbit of a point as a run, with work by the trapezoidal rule."""
        return sampled_run(field.system(point.parameter_values(field)),
                           point.orbit(field, outputs))

    def range(self, point: Any, weights: Array) -> tuple[float, float]:
        """Smallest and largest value of ``weights @ x`` over the orbit of a point alone."""
        motion = point.orbit(samples=_FINE)
        low, high = peaks((motion.states @ weights)[None, :-1])
        return float(low[0]), float(high[0])

    def observed(
        self, point: Any, field: VectorField, row: Array, phases: Array
    ) -> tuple[float, float, Array]:
        """Smallest and largest value of ``row @ x`` over an orbit, and values at phases."""
        motion = point.orbit(field, _SAMPLES)
        moved = motion.states @ row
        return (float(moved.min()), float(moved.max()),
                np.interp(phases, motion.times / motion.times[-1], moved))

    def observed_along(
        self, points: Sequence[Any], field: VectorField, row: Array
    ) -> list[dict[str, Any]]:
        """Range and harmonics of ``row @ x`` at points of one branch, to store with them."""
        return [_observed(point.orbit(field, OBSERVED_SAMPLES), row) for point in points]


class CollocatedPoints(OrbitPoints):
    """Orbits by collocation: polynomials on a mesh."""

    options = Collocation

    def motion(self, point: Any, field: VectorField | None, samples: int) -> PeriodicMotion:
        """The polynomials, sampled."""
        known = point.values
        return collocated(point.u, np.asarray(known["mesh"], dtype=float), len(known["minimum"]),
                          float(known["period"]), samples)

    def range(self, point: Any, weights: Array) -> tuple[float, float]:
        """Extremes of the polynomials."""
        nodes, degree = nodes_on_mesh(point.u, np.asarray(point.values["mesh"], dtype=float),
                                      len(weights))
        low, high = extremes((nodes @ weights)[:, None].copy(), degree)
        return float(low[0]), float(high[0])

    def observed(
        self, point: Any, field: VectorField, row: Array, phases: Array
    ) -> tuple[float, float, Array]:
        """Extremes of the polynomials, and values at phases."""
        mesh = np.asarray(point.values["mesh"], dtype=float)
        nodes, _ = nodes_on_mesh(point.u, mesh, len(row))
        return *self.range(point, row), interpolate(mesh, nodes, phases) @ row


class ShotPoints(OrbitPoints):
    """Orbits by shooting: states at the ends of segments, which are run again."""

    options = Shooting
    stores_orbits = False

    def motion(self, point: Any, field: VectorField | None, samples: int) -> PeriodicMotion:
        """The runs of the segments, one after the other; some more samples than asked for."""
        if field is None:
            raise InputError(f"{point.place} was found by shooting, whose orbits are run again; "
                             f"give the field: point.orbit(field).")
        return of_runs(_runs(point, field, samples), float(point.values["period"]))

    def trajectory(self, point: Any, field: ContactField, outputs: int) -> Trajectory:
        """The runs of the segments, one after the other."""
        return joined(_runs(point, field, outputs))


class BalancedPoints(OrbitPoints):
    """Orbits by harmonic balance: Fourier series."""

    options = HarmonicBalance

    def motion(self, point: Any, field: VectorField | None, samples: int) -> PeriodicMotion:
        """The series, sampled."""
        return balanced(point.u, point.values, point.branch.attributes, samples)

    def observed_along(
        self, points: Sequence[Any], field: VectorField, row: Array
    ) -> list[dict[str, Any]]:
        """Range and harmonics of the series."""
        # The numbers of states and parameters are those of the field.
        _ = points[0].parameter_values(field)
        found = observed_of_series(points, row)
        return [{name: values[k] for name, values in found.items()} for k in range(len(points))]


BY_COLLOCATION, BY_SHOOTING, BY_HARMONICS = CollocatedPoints(), ShotPoints(), BalancedPoints()
_BY_OPTIONS: Mapping[type[Any], OrbitPoints] = {
    one.options: one for one in (BY_COLLOCATION, BY_SHOOTING, BY_HARMONICS)}


def holder_of(point: Any) -> OrbitPoints | None:
    """The method by which a point is an orbit; None if it is none."""
    return None if point.header is None else _BY_OPTIONS.get(type(point.header.method))


def orbit_points_of(point: Any) -> OrbitPoints:
    """The method by which a point is an orbit.

    Raises
    ------
    InputError
        If it is none.
    """
    found = holder_of(point)
    if found is None:
        raise InputError(f"{point.place} is no periodic orbit.")
    return found


def _runs(point: Any, field: VectorField, samples: int) -> list[Trajectory]:
    """Runs of the segments of an orbit by shooting."""
    # Shooting is for contact fields alone, the only ones with a system.
    system = field.system(point.parameter_values(field))  # type: ignore[attr-defined]
    return run_again(system, point.u, np.asarray(point.values["mesh"], dtype=float),
                     float(point.values["period"]), samples, point.branch.method.solver)


def _observed(motion: PeriodicMotion, row: Array) -> dict[str, Any]:
    """Range and harmonics of a quantity along an orbit."""
    low, high = peaks((motion.evenly() @ row)[None])
    return dict(zip(OBSERVED, (
        float(low[0]), float(high[0]), float(high[0] - low[0]) / 2.0,
        motion.harmonics(OBSERVED_HARMONICS, observe=row)), strict=True))
