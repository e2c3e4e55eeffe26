"""Derivatives of the rates of systems of many modes, which add the forces of all nodes together."""

import numpy as np
import pytest

from fecontact import ContactSystem, Ground, ModalBasis
from fecontact.bifurcation import contact_field
from fecontact.laws import ConstantFriction, DahlFriction, LinearContact

NODES, STATES = 5, 12


def random_system(rng, modes, dimension, friction):
    """A body of random shapes at its nodes."""
    w = np.sort(rng.uniform(1.0, 10.0, modes))
    T = rng.normal(size=(NODES + 2, 3 if dimension == 2 else 6, modes))
    basis = ModalBasis(w, np.diag(0.1 * w), T, rng.normal(size=(NODES + 2, dimension)),
                       np.ones(NODES))
    return ContactSystem(basis, normal=LinearContact(10.0, 2.0), friction=friction,
                         ground=Ground(speed=0.3), gap=0.0)


@pytest.mark.parametrize("friction", [ConstantFriction(0.5, 3.0), DahlFriction(0.5, 10.0)])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("modes", [7, 8, 9, 11, 12, 13])
def test_jacobian_is_the_derivative_of_the_rates(modes, dimension, friction):
    rng = np.random.default_rng(modes)
    system = random_system(rng, modes, dimension, friction)
    field = contact_field(system, ["ground.speed"])
    t, x = np.zeros(STATES), rng.normal(size=(STATES, system.size))
    forces = system.contact_history(t, x)[..., 0]
    assert 0.2 < np.mean(forces > 0.0) < 0.8
    found, J, _ = field.derivatives(t, x, field.values)
    step = 1e-6
    for place, f, jacobian in zip(x, found, J, strict=True):
        assert f == pytest.approx(system.rhs(0.0, place), rel=1e-12, abs=1e-12)
        rises = [system.rhs(0.0, place + along) - system.rhs(0.0, place - along)
                 for along in step * np.eye(system.size)]
        # Internal variables of open nodes decay within 1e-7 s.
        size = np.abs(jacobian).max(axis=1, keepdims=True)
        assert np.abs(jacobian - np.array(rises).T / (2.0 * step)) / size == pytest.approx(
            0.0, abs=1e-6)
