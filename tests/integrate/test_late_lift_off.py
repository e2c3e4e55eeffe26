"""Bristles fade within 1e-7 s where a mass lifts off, however late in a run that is."""

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact.laws import BoucWenFriction, LinearContact, LuGreFriction, RoughSurface


@pytest.mark.parametrize("normal", [LinearContact(50.0, 0.5), RoughSurface(50.0, 0.01)],
                         ids=["linear", "rough"])
@pytest.mark.parametrize("friction", [
    LuGreFriction(0.5, 0.4, bristle_stiffness=100.0, stribeck_velocity=0.3, stribeck_exponent=2.0),
    BoucWenFriction(0.4, yield_displacement=0.01)], ids=["lugre", "bouc-wen"])
def test_bouncing_on_a_belt(normal, friction):
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    basis = fc.basis_from_matrices(2.0 * np.eye(2), np.diag([3.0, 2.0]),
                                   {"contact": rows[None], "B": rows, "C": rows},
                                   damping=0.1 * np.eye(2))
    system = fc.ContactSystem(
        basis, normal=normal, friction=friction, ground=fc.Ground(speed=0.4),
        drive=fc.Drive(stiffness_y=1.0, amplitude_y=1.5, frequency_hz=0.8 / TURN),
        load=fc.Load(normal=0.5))
    run = fc.simulate(system, 30.0, outputs=301, rtol=1e-6)
    assert run.status.name == "FINISHED"
    closed = run.normal_force[:, 0] != 0.0
    # It lifts off late, too.
    assert (closed[:-1] & ~closed[1:])[run.time[:-1] > 20.0].any()
    assert np.abs(run.energies.imbalance).max() < 1e-5
