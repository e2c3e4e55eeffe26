"""Runs do not depend on the size of a body: what is small has the same motion to the tolerance."""

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact.laws import (
    Constant,
    ConstantFriction,
    IwanFriction,
    JenkinsFriction,
    LinearContact,
    PrescribedForce,
)

LAWS = {"jenkins": JenkinsFriction, "iwan": IwanFriction}


def bouncing(kind, mass=1.0, length=1.0, time=1.0):
    """Displacements and forces (N, 4), in parts of their units, of a mass dragged over a belt."""
    stiffness, row = mass / time**2, [[1, 0], [0, 1], [0, 0]]
    basis = fc.basis_from_matrices(
        2.0 * mass * np.eye(2), stiffness * np.diag([3.0, 2.0]), {"contact": [row], "B": row,
        "C": row}, damping=0.1 * mass / time * np.eye(2))
    system = fc.ContactSystem(
        basis, normal=LinearContact(50.0 * stiffness, 0.5 * mass / time),
        friction=LAWS[kind](stiffness=30.0 * stiffness, friction_coefficient=0.4),
        ground=fc.Ground(speed=0.4 * length / time),
        drive=fc.Drive(stiffness_y=stiffness, amplitude_y=1.5 * length,
                       frequency_hz=0.8 / time / TURN),
        load=fc.Load(normal=0.5 * stiffness * length))
    run = fc.simulate(system, 10.0 * time, outputs=101)
    assert run.status is fc.Status.FINISHED
    return np.hstack([run.displacement("C")[:, :2] / length,
                      run.normal_force / (stiffness * length),
                      run.friction_force / (stiffness * length)])


@pytest.mark.parametrize("kind", LAWS)
def test_a_small_body_bounces_as_a_large_one(kind):
    large = bouncing(kind)
    assert (large[:, 2] == 0.0).any()
    assert (large[:, 2] > 1.0).any()
    sizes = np.abs(large).max(axis=0)
    # Of 1e-12 kg, with forces of 1e-8 N, in motions of micrometres and tens of microseconds.
    for size in ((1e-12, 1e-6, 1e-5), (1e-3, 1e-5, 1e-3)):
        np.testing.assert_allclose(bouncing(kind, *size) / sizes, large / sizes, atol=2e-4)


def solid(size):
    """Normal and friction forces of a solid mass pulled askew, in parts of its load."""
    row = np.eye(6, 3)
    basis = fc.basis_from_matrices(2.0 * size**3 * np.eye(3), size * np.diag([9.0, 9.0, 0.0]),
                                   {"contact": row[None], "C": row}, dimension=3)
    force = 20.0 * size**2
    system = fc.ContactSystem(
        basis, normal=LinearContact(4e2 * size, 5.0 * size**2),
        friction=JenkinsFriction(stiffness=3e2 * size, friction_coefficient=0.4),
        load=fc.Load(normal=force, forces=[
            fc.PointLoad("C", axis, signal=Constant(part * force))
            for axis, part in (("x", 0.5), ("y", 0.3))]))
    run = fc.simulate(system, 3.0 * size, initial=np.zeros(system.size), outputs=31,
                      rtol=1e-8)
    return np.column_stack([run.normal_force, run.friction_forces.reshape(31, -1)]) / force


def test_a_small_solid_slides_as_a_large_one():
    large = solid(1.0)
    assert np.hypot(large[:, 1], large[:, 2]).max() > 0.39
    np.testing.assert_allclose(solid(1e-5), large, atol=5e-4)


def test_scale_of_forces():
    row = [[1, 0], [0, 1], [0, 0]]
    basis = fc.basis_from_matrices(4.0 * np.eye(2), np.eye(2), {"contact": [row], "B": row,
                                                               "C": row})

    def scale(normal=None, **given):
        return fc.ContactSystem(basis, normal=normal or LinearContact(10.0),
                                friction=ConstantFriction(0.1), **given).force_scale

    assert scale() == 1.0
    np.testing.assert_allclose(scale(load=fc.Load(normal=3e-6)), 3e-6)
    pulled = fc.Load(forces=[fc.PointLoad("C", "x", signal=Constant(-2e-6))])
    np.testing.assert_allclose(scale(load=pulled), 2e-6)
    driven = fc.Drive(stiffness_x=2e-3, amplitude_x=1e-3, frequency_hz=1.0 / TURN)
    np.testing.assert_allclose(scale(drive=driven), 2e-6)
    np.testing.assert_allclose(scale(PrescribedForce(5e-6)), 5e-6)
    assert scale(load=fc.Load(normal=50.0)) == 1.0
    assert scale(load=fc.Load(normal=1e-30)) == 1e-9
