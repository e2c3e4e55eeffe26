"""The corner at which stick-slip of a beam ends, rounded by the smoothing of friction."""

import beam_stick_slip as example
import numpy as np
import pytest

from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    contact_field,
    equilibrium_branch,
    orbit_branch,
    periodic_motion,
)
from fecontact.laws import ExponentialFriction


def beam(speed):
    """The beam of the example with 10 nodes and 6 modes, and friction of a small slope."""
    return example.beam(speed, 10, 6).with_(friction=ExponentialFriction(0.8, 0.55, 1000.0, 1e4))


def test_orbits_without_stick_turn_into_stick_slip():
    field = contact_field(beam(0.3), {example.SPEED: 0.3})
    steady = equilibrium_branch(field, bounds=(2e-3, 0.3), direction=-1.0,
                                options=ContinuationOptions(step=5e-3, points=300))
    branch = orbit_branch(
        field, steady.of_kind("Hopf")[0], method=Collocation(intervals=80), bounds=(2e-3, 0.3),
        options=ContinuationOptions(step=0.01, largest_step=0.05, points=110, locate=False))
    corner = int(np.argmax(branch.parameter))
    assert branch.parameter[corner] == pytest.approx(0.0975555, abs=2e-6)
    assert not branch.points[corner - 3].values["stable"]
    behind = branch.points[corner + 10 :]
    assert len(behind) > 30
    assert all(point.values["stable"] for point in behind)
    # Runs that begin stuck settle on these orbits.
    point = min(behind, key=lambda point: abs(point.parameter - 0.08))
    run = periodic_motion(beam(point.parameter), initial=example.stuck(beam(point.parameter)),
                          transient=3.0, longest_period=0.3, rtol=1e-8)
    assert run.period == pytest.approx(point.values["period"], rel=1e-5)
