"""Underplatform dampers of a meshed sector: preload, the linear limits, elastic dampers."""

import numpy as np
import platform_damper as example
import pytest

from fecontact import equilibrium
from fecontact.bifurcation import (
    ContinuationOptions,
    EngineOrder,
    HarmonicBalance,
    frequency_response,
)


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


def test_elastic_damper_is_softer(wheel):
    """A wedge of steel is nearly rigid beside its contacts, and softer."""
    rigid = example.linear(wheel, stuck=True)[0]
    elastic = example.linear(example.wheel(4, damper="elastic"), stuck=True)[0]
    assert 0.9 * rigid < elastic < rigid
