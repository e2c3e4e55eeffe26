"""Underplatform dampers of a meshed sector: preload, the linear limits, elastic dampers."""

from dataclasses import replace

import numpy as np
import platform_damper as example
import pytest

from fecontact import AnalysisError, equilibrium
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    contact_field,
    frequency_response,
)
from fecontact.bifurcation.continuation.problem import BranchStatus
from fecontact.bifurcation.harmonic.stalled import stall_reason


@pytest.fixture(scope="module")
def wheel():
    return example.wheel(4)


def test_preload_is_shared_by_both_faces(wheel):
    """Without friction each face of the wedge carries P / (2 cos a)."""
    state = equilibrium(example.system(wheel, 500.0, 600.0), "rest")
    start, end = example.undersides(1.0)
    along = (end - start) / np.linalg.norm(end - start)
    radial = example.polar(1.0, 0.5 * example.ALPHA)
    cosine = abs(radial @ [along[1], -along[0]])
    forces = state.normal_force.reshape(2, -1).sum(axis=1)
    assert forces == pytest.approx(500.0 / (2.0 * cosine), rel=1e-6)


def test_stuck_dampers_are_springs(wheel):
    """A heavy load: the linear response with springs and dashpots, in the order's diameter."""
    hertz, amplitude = example.linear(wheel, stuck=True)
    assert hertz > 1.1 * example.linear(wheel, stuck=False)[0]
    found = frequency_response(
        example.system(wheel, 1e5, hertz), (hertz, 1.01 * hertz), example.NAME,
        observe=("blade.tip", "y"), options=ContinuationOptions(points=1),
        method=HarmonicBalance([0, 1], 48, stability=None,
                               repeats=EngineOrder(wheel, example.ORDER)))
    assert found.branches[0].parameter[0] == pytest.approx(hertz)
    assert found.amplitude()[0] == pytest.approx(amplitude, rel=1e-6)


def test_responses_tend_to_the_stuck_limit(wheel):
    """Amplitudes at the peak over the load, from sliding to stuck."""
    stuck_hz, stuck = example.linear(wheel, stuck=True)
    found = []
    for load in (1000.0, 3000.0):
        response = frequency_response(
            example.system(wheel, load, 0.98 * stuck_hz), (0.98 * stuck_hz, 1.01 * stuck_hz),
            example.NAME, observe=("blade.tip", "y"),
            options=ContinuationOptions(points=400, largest_step=0.2),
            method=HarmonicBalance([0, 1, 3], 96, stability=None,
                                   repeats=EngineOrder(wheel, example.ORDER)))
        assert response.peak_reached()
        found.append(response.amplitude().max() / stuck)
    assert found[1] == pytest.approx(1.0, rel=5e-3)
    assert 0.2 < found[0] < 0.6


def test_dampers_that_lift_off_say_what_to_do():
    """A small load does not hold them: no wave under the whole excitation, or one that stalls."""
    wheel = example.wheel(2)
    hertz, wave = example.linear(wheel, stuck=False)[0], EngineOrder(wheel, example.ORDER)

    def response(load, bounds):
        return frequency_response(
            example.system(wheel, load, bounds[1]), bounds, example.NAME, start=bounds[1],
            observe=("blade.tip", "y"), options=ContinuationOptions(points=5, largest_step=0.2),
            method=HarmonicBalance([0, 1], 24, stability=None, repeats=wave))

    with pytest.raises(AnalysisError, match=r"No wave .* simulate\(wheel_system"):
        response(0.02, (0.999 * hertz, hertz))
    field = wave.field(contact_field(example.system(wheel, 6.0, hertz), [example.NAME]))
    branch = response(6.0, (1.05 * hertz, 1.16 * hertz)).branches[0]
    said = stall_reason(field, replace(branch, status=BranchStatus.STALLED))
    for part in ("Contact opens and closes at", "lacks nodal diameters", "run all sectors"):
        assert part in said


@pytest.mark.slow
def test_a_vanishing_load_leaves_the_wheel_free():
    """All sectors from rest: the build-up at resonance is that without dampers, and linear."""
    hertz, amplitude = example.linear(example.wheel(2), stuck=False)
    free, little = (example.transient(load, hertz, 6) for load in (None, 0.02))
    ends = [np.abs(one[-41:]).max() for one in (free, little)]
    # One mode that builds up from rest, A (1 - exp(-D w t)); others start too.
    assert ends[0] == pytest.approx(amplitude * (1.0 - np.exp(-12e-3 * np.pi)), rel=0.06)
    assert ends[1] == pytest.approx(ends[0], rel=0.03)
    assert np.abs(little - free).max() < 0.1 * np.abs(free).max()


def test_elastic_damper_is_softer(wheel):
    """A wedge of steel is nearly rigid beside its contacts, and softer."""
    rigid = example.linear(wheel, stuck=True)[0]
    elastic = example.linear(example.wheel(4, damper="elastic"), stuck=True)[0]
    assert 0.9 * rigid < elastic < rigid
