"""Frequency responses of a solid with friction in two directions, and of two bodies, and runs."""

import numpy as np
import pytest
from systems import TURN

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
)
from fecontact.fem import pair_faces
from fecontact.laws import ConstantFriction, Harmonic, IwanFriction, JenkinsFriction, LinearContact
from fecontact.reduction import reduce_bodies

MASS, G = 2.0, 9.81
INERTIA = MASS / 12.0 * np.array([0.1, 0.05, 0.13])
CORNERS = np.array([(x, y, -0.05) for x in (-0.1, 0.1) for y in (-0.15, 0.15)])


def rigid_rows(places):
    rows = np.tile(np.eye(6), (len(places), 1, 1))
    for row, (x, y, z) in zip(rows, places, strict=True):
        row[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return rows


def block(friction):
    """A block on four corners, driven along both tangents, through springs of different length."""
    basis = fc.basis_from_matrices(
        np.diag([MASS] * 3 + [*INERTIA]), np.diag([2e4, 1e4, 5e5, 200.0, 200.0, 200.0]),
        {"contact": rigid_rows(CORNERS), "B": np.eye(6)}, dimension=3, contact_places=CORNERS,
        tributary=np.full(4, 0.015), translations=np.eye(3, 6),
        damping=np.diag([24.0, 20.0, 60.0, 0.05, 0.05, 0.05]))
    return fc.ContactSystem(
        basis, normal=LinearContact(4e6, 400.0), friction=friction,
        load=fc.Load(gravity=(0.0, 0.0, -G)),
        drive=fc.Drive(stiffness_x=2e4, damping_x=10.0, amplitude_x=4e-4, stiffness_y=1e4,
                       damping_y=5.0, amplitude_y=5e-4, frequency_hz=130.0 / TURN))


def last_period(system, period, count, rtol=1e-8):
    """States of the last of so many periods from rest, and how far they are from repeating."""
    ends = fc.simulate(system, count * period, initial="rest", rtol=rtol,
                       outputs=np.array([0.0, (count - 1) * period, count * period])).states
    run = fc.simulate(system, period, initial=ends[-1], rtol=rtol, outputs=501)
    return run.states, np.abs(ends[-1] - ends[-2]).max() / np.abs(ends[-1]).max()


@pytest.mark.slow
@pytest.mark.parametrize("friction", [
    JenkinsFriction(4e4, 0.3),
    IwanFriction(8e4, 0.3, elements=2)])
def test_block_that_slips_in_two_directions(friction):
    """The path of the block is an ellipse; a run comes to the same motion to some 1e-4."""
    system = block(friction)
    found = frequency_response(
        system, (125.0 / TURN, 140.0 / TURN), method=HarmonicBalance(
            9, samples=256, stability=None), options=ContinuationOptions(largest_step=0.2))
    field = contact_field(system, ["drive.frequency_hz"])
    here = found.branches[0].at(field, 130.0 / TURN)
    states, off = last_period(system, TURN / 130.0, 50)
    assert off < 1e-7
    mine = here.orbit(samples=501).states
    for along in (0, 2):
        size = np.ptp(states[:, along]) / 2.0
        assert np.abs(mine[:, along] - states[:, along]).max() < 5e-4 * size
    z = slice(12, None)
    assert np.abs(mine[:, z] - states[:, z]).max() < 2e-3 * np.abs(states[:, z]).max()
    # Both directions move, out of phase, and all elements reach their limit.
    X = [here.u.reshape(-1)[:114].reshape(19, 6)[1:3, along] for along in (0, 2)]
    (a, b), (c, d) = X
    assert abs(a * d - b * c) > 0.05 * np.linalg.norm(X[0]) * np.linalg.norm(X[1])


def pair_of_beams():
    """Two clamped beams on each other, the upper one pressed down; a force shakes its end."""
    mesh = fc.generate(fc.Beam(length=0.1, height=0.004, element_size=0.004))
    bodies = {f"beam{k}": fc.ElasticBody(mesh.placed((0.0, k * 0.004)), thickness=0.01,
                                         fixed={"left": "xy"}) for k in range(2)}
    face = pair_faces(bodies, "beam1.contact", "beam0.top", nodes=5, nodes_on="face")
    bases = reduce_bodies(bodies, [face], modes=3, reduction="vibration", damping=0.03,
                          each={name: {"B": "", "C": "top" if name == "beam1" else "",
                                       "points": {"end": "right"}} for name in bodies})
    return fc.ContactSystem(
        bodies=bases, drive=fc.Drive(),
        interfaces=[fc.Interface("face", face, LinearContact(2e7),
                                 ConstantFriction(0.3, smoothing_slope=50.0))],
        load=fc.Load(60.0, (fc.PointLoad("beam1.end", "y", signal=Harmonic(9.0, 300.0 / TURN)),)))


def test_two_beams_with_an_interface():
    """Normal contact and friction between the bodies, below their first resonance."""
    system, name = pair_of_beams(), "load.forces.0.signal.frequency_hz"
    found = frequency_response(
        system, (1200.0 / TURN, 1600.0 / TURN), name, observe=("beam1.end", "y"),
        method=HarmonicBalance(12, samples=256),
        options=ContinuationOptions(largest_step=0.2))
    field = contact_field(system, [name])
    f = 1500.0 / TURN
    here = found.branches[0].at(field, f)
    assert here.values["stable"]
    states, off = last_period(system.with_(**{name: f}), 1.0 / f, 60)
    assert off < 1e-6
    mine = here.orbit(samples=501).states
    row = field.displacement_row("beam1.end", "y")
    assert np.abs((mine - states) @ row).max() < 1e-3 * np.ptp(states @ row) / 2.0
    for k in range(6):
        size = np.ptp(states[:, k]) / 2.0
        if size > 1e-2 * np.ptp(states[:, 0]):
            assert np.abs(mine[:, k] - states[:, k]).max() < 1e-2 * size
    # Nodes are nearly relieved during the period.
    force = fc.simulate(system.with_(**{name: f}), 1.0 / f, initial=states[-1],
                        outputs=101).normal_force
    assert (force.min(axis=0) < 0.2 * force.max(axis=0)).any()
