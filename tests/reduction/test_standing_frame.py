"""Bodies of revolution that rotate, in the frame at rest: waves, a spring and a mass that stand."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from sectors import ring_sector
from test_rotation import ring

from fecontact import (
    ContactSystem,
    ElasticBody,
    InputError,
    Interface,
    Load,
    Material,
    Mesh,
    PointLoad,
    Study,
    basis_from_matrices,
    equilibrium,
    generate,
    modal_basis,
    simulate,
)
from fecontact.analysis import campbell, complex_modes
from fecontact.bifurcation import (
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
    observe,
    orbit_branch,
    periodic_motion,
)
from fecontact.fem import CyclicSymmetry, Ring, Rotation
from fecontact.fem.standing_frame import convective_matrices
from fecontact.io import read_basis, write_basis
from fecontact.laws import Frictionless, Harmonic, LinearContact
from fecontact.reduction import PointPairing, Spring, assembled_basis, linked, sector_modes

STEEL = Material(2.1e11, 0.3, 7850.0)
W = 300.0


def standing(speed, **options):
    return Rotation(speed, (0.0, 0.0), frame="standing", **options)


@pytest.fixture(scope="module")
def disc():
    return ElasticBody(generate(Ring(0.2, 0.05, 0.01, element_size=0.06, layers=1)), STEEL,
                       fixed={"inner": "xyz"})


def test_waves_of_a_ring_seen_from_rest():
    """sqrt(w_n^2 + (n (n^2 - 1) W / (n^2 + 1))^2) +- n (n^2 - 1) W / (n^2 + 1), inextensional."""
    body = ElasticBody(ring(1.0, 0.04, 96), STEEL)
    still = modal_basis(body, 12, contact_nodes=1).angular_frequencies
    w = {2: still[3], 3: still[5]}
    speed = 0.6 * w[2]
    found = 2.0 * np.pi * complex_modes(modal_basis(
        body, 12, contact_nodes=1, rotation=standing(speed))).frequencies_hz
    for n in (2, 3):
        turned = n * (n**2 - 1) / (n**2 + 1) * speed
        root = np.sqrt(w[n] ** 2 + turned**2)
        for expected in (root + turned, root - turned):
            assert np.abs(found / expected - 1.0).min() < 3e-4


def test_waves_of_a_disc_differ_by_its_turns(disc):
    """With n waves around, by n W from the frequencies in the rotating frame."""
    turning, seen = (complex_modes(modal_basis(
        disc, 24, contact=(), rotation=Rotation(W, frame=frame))).frequencies_hz
        for frame in ("rotating", "standing"))
    shift = W / (2.0 * np.pi)
    for n, first in ((0, 2), (1, 0), (2, 3), (3, 5)):
        pair = turning[first : first + (2 if n else 1)]
        for way in (-1.0, 1.0) if n else (0.0,):
            assert np.abs(seen - pair.mean() - way * n * shift).min() < 5e-3 * shift


def test_a_spring_that_stands_on_a_disc(disc):
    """Two waves with w = a cos + b sin: (w^2 - n^2 W^2) +- 2 n W between them, c at a place.

    Beyond w / n a wave that runs backwards stands still or is carried forwards.
    """
    basis = modal_basis(disc, 5, contact=(), points={"rim": (0.2, 0.0, 0.01)},
                        rotation=standing(W, stress_stiffening=False)).select([3, 4])
    w, n, c = float(basis.angular_frequencies.mean()), 2, 2e6
    row = basis.point_row("rim", "z")
    # The spring leaves the wave that has a node at its place.
    turn = np.array([row, [-row[1], row[0]]]) / np.linalg.norm(row)
    for speed in (W, 0.4 * w / n, 1.2 * w / n):
        held = linked(basis.with_rotation_speed(speed), [Spring(
            "rim", stiffness=c, direction=(0.0, 0.0, 1.0))])
        K = (w**2 - (n * speed) ** 2) * np.eye(2) + c * np.outer(row, row)
        G = 2.0 * n * speed * turn.T @ np.array([[0.0, 1.0], [-1.0, 0.0]]) @ turn
        exact = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -G]]))
        found = np.linalg.eigvals(np.block([
            [np.zeros((2, 2)), np.eye(2)], [-held.stiffness_matrix, -held.damping]]))
        assert np.sort(np.abs(found)) == pytest.approx(np.sort(np.abs(exact)), rel=1e-2)
        assert found.real.max() == pytest.approx(exact.real.max(), abs=1e-2 * w)
    diagram = campbell(basis, np.linspace(0.0, 1.1 * w / n, 23))
    # A constant force at rest excites the wave that it meets standing.
    assert diagram.critical_speeds(0)[0] == pytest.approx(w / n, rel=5e-3)


@pytest.mark.parametrize("frame", ["standing", "rotating"])
def test_forced_vibration_of_a_disc_that_turns(disc, frame):
    """Harmonic balance and a run: |r_b (K - w^2 + i w C)^-1 r_a|, a force at one of two points.

    Waves that run either way differ by which of the points is which.
    """
    basis = modal_basis(disc, 5, contact=(), damping=0.05, rotation=Rotation(W, frame=frame),
                        points={"rim": (0.2, 0.0, 0.01), "side": (0.1, 0.17, 0.01)})
    hertz, row, seen = 330.0, basis.point_row("rim", "z"), basis.point_row("side", "z")
    system = ContactSystem(basis, load=Load(forces=(
        PointLoad("rim", "z", signal=Harmonic(3.0, hertz)),)))
    w = 2.0 * np.pi * hertz
    dynamic = basis.stiffness_matrix - w**2 * np.eye(5) + 1j * w * basis.damping
    exact, other = (3.0 * abs(seen @ np.linalg.solve(one, row)) for one in (dynamic, dynamic.T))
    assert abs(exact / other - 1.0) > (0.05 if frame == "standing" else 1e-5)
    found = frequency_response(
        system, (hertz, 1.1 * hertz), "load.forces.0.signal.frequency_hz", observe=("side", "z"),
        options=ContinuationOptions(points=1), method=HarmonicBalance([0, 1], 32, stability=None))
    assert abs(found.harmonic(1)[0]) == pytest.approx(exact, rel=1e-8)
    run = simulate(system, 40.0 / hertz, outputs=2001)
    last = np.asarray(run.displacement("side"))[-51:, 2]
    assert 0.5 * np.ptp(last) == pytest.approx(exact, rel=2e-3)


def test_orbits_of_a_disc_that_turns(disc):
    """Collocation over the frequency of a force, beside the linear response."""
    basis = modal_basis(disc, 3, contact=(), damping=0.05, rotation=standing(W),
                        points={"rim": (0.2, 0.0, 0.01), "side": (0.1, 0.17, 0.01)})
    hertz, name = 330.0, "load.forces.0.signal.frequency_hz"
    system = ContactSystem(basis, load=Load(forces=(
        PointLoad("rim", "z", signal=Harmonic(3.0, hertz)),)))
    field = contact_field(system, [name])
    orbits = observe(field, orbit_branch(
        field, periodic_motion(system, transient=40.0 / hertz), name, bounds=(hertz, 1.02 * hertz),
        method=Collocation(intervals=8), options=ContinuationOptions(points=3)), "side", "z")
    row, seen = basis.point_row("rim", "z"), basis.point_row("side", "z")
    for point in orbits.points:
        w = 2.0 * np.pi * point.parameter
        dynamic = basis.stiffness_matrix - w**2 * np.eye(3) + 1j * w * basis.damping
        exact = 3.0 * abs(seen @ np.linalg.solve(dynamic, row))
        assert point.values["observed_amplitude"] == pytest.approx(exact, rel=1e-3)
        assert point.values["stable"]


def test_a_disc_that_turns_under_a_pad_that_stands(disc, tmp_path):
    """Only the disc's coordinates have Coriolis terms; the pad rests on it with its load."""
    rim = {"rim": (0.2, 0.0, 0.01)}
    turning = modal_basis(disc, 12, contact=(), points=rim, rotation=standing(W))
    pad = basis_from_matrices(0.5 * np.eye(3), np.diag([1e6, 1e6, 0.0]), {"P": np.vstack([
        np.eye(3), np.zeros((3, 3))])}, dimension=3)
    pairing = PointPairing("pad", "P", "disc", "rim")
    both = assembled_basis({"pad": pad, "disc": turning}, {"pad": pairing})
    assert not both.rotation.coriolis[:3].any()
    assert both.rotation.coriolis[3:, 3:] == pytest.approx(turning.rotation.coriolis)
    write_basis(tmp_path / "both.h5", both)
    assert read_basis(tmp_path / "both.h5").rotation.standing
    system = ContactSystem(
        bodies={"pad": pad, "disc": turning},
        interfaces=[Interface("pad", pairing, LinearContact(1e7), Frictionless())],
        load=Load(forces=(PointLoad("pad.P", "z", signal=-40.0),)))
    assert equilibrium(system).normal_force.sum() == pytest.approx(40.0, rel=1e-6)
    rotating = modal_basis(disc, 12, contact=(), points=rim, rotation=Rotation(
        W, stress_stiffening=False))
    with pytest.raises(InputError, match=r"'disc' does not rotate as 'pad' does.* 'standing'"):
        assembled_basis({"pad": pad, "disc": rotating}, {"pad": pairing})


def test_bodies_without_axis_do_not_stand():
    block = ElasticBody(rectangle(0.4, 0.2, 8, 4), STEEL)
    with pytest.raises(InputError, match="frame = 'standing' is for bodies of revolution"):
        modal_basis(block, 6, contact=(), rotation=standing(W))
    with pytest.raises(InputError, match="frame = 'fixed' must be"):
        Rotation(W, frame="fixed")
    with pytest.raises(InputError, match="has frame = 'standing'; sectors are those"):
        sector_modes(ElasticBody(ring_sector(4)), CyclicSymmetry("bottom", "top", 4), 2,
                     rotation=standing(W))
    study = Study.from_toml(
        "[geometry]\nshape = 'ring'\nouter_radius = 0.2\ninner_radius = 0.05\nthickness = 0.01\n"
        "element_size = 0.06\n[body]\nfixed = { inner = 'xyz' }\n[body.rotation]\nspeed = 300.0\n"
        "frame = 'standing'\n[basis]\nmodes = 6\ncontact = []\n")
    assert study.modal_basis().rotation.standing


def test_each_material_has_its_density():
    """int rho N_phi^T N_phi of the displacement x is int rho y^2, half the polar moment."""
    ring = generate(Ring(0.5, 0.4, 0.1, element_size=0.1, layers=2))
    low = ring.nodes[ring.cells].mean(axis=1)[:, 2] < ring.nodes[:, 2].mean()
    mesh = Mesh(ring.nodes, ring.cells, ring.boundaries, {}, ring.curved_edges,
                   ring.curved_middles, cell_groups={"low": np.flatnonzero(low),
                                                     "high": np.flatnonzero(~low)})
    body = ElasticBody(mesh, {"low": Material(density=1000.0),
                                 "high": Material(density=5000.0)})
    turning = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    _, second = convective_matrices(body, turning, np.zeros(3))
    x, y, _ = body.nodes.T
    assert x @ (second @ x) == pytest.approx(y @ (body.component_mass @ y), rel=1e-9)
