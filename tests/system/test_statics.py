"""Equilibrium at rest and in steady sliding against closed forms and an independent solver."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from model_for_tests import Model
from scipy.optimize import brentq, minimize
from systems import TURN, mass_in_plane

from fecontact import (
    AnalysisError,
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    Load,
    Material,
    Mesh,
    ModelWarning,
    basis_from_matrices,
    equilibrium,
    modal_basis,
)
from fecontact.integrate import initial_state
from fecontact.laws import ExponentialContact, ExponentialFriction, RoughSurface

STIFFNESS, R = 10e6, 10e-6
NORMAL = RoughSurface(STIFFNESS, R, 40.0)
LENGTH, HEIGHT, THICKNESS = 0.2, 0.02, 0.01

# Presses far through the roughness, where the law is a plain spring.
deep = pytest.mark.filterwarnings("ignore::fecontact.core.errors.ModelWarning")


def mass_point(**parts):
    """The mass of the friction oscillator, without ground motion and drive."""
    return mass_in_plane(5.632, **{"normal": NORMAL, "load": Load(14.0), **parts})


def beam(contact_nodes=8, modes=12, B=(0.0, 0.01), C=(0.1, 0.02), fixed=None, **parts):
    mesh = rectangle(LENGTH, HEIGHT, 16, 2)
    body = ElasticBody(mesh, Material(), THICKNESS, fixed=fixed or {})
    basis = modal_basis(body, modes, contact="bottom", contact_nodes=contact_nodes, B=B, C=C,
                        damping=0.01)
    return ContactSystem(basis,
                         **{"friction": ExponentialFriction(0.8, 0.55, 1e3), "normal": NORMAL,
                                   "load": Load(14.0), **parts})


def contact(system, q, t=0.0):
    """Normal force, friction, penetration of each node at rest in q."""
    y = np.concatenate([q, np.zeros(len(q))])
    return system.contact_history(np.array([t]), y[None])[0, :, :3].T


def penetration_of(force):
    """Closed form of the rough surface: c u^2 / (2 R_Z), then c (u - R_Z / 2)."""
    if force < STIFFNESS * R / 2.0:
        return np.sqrt(2.0 * R * force / STIFFNESS)
    return force / STIFFNESS + R / 2.0


# One mass ----------------------------------------------------------------------------------------

@deep
@pytest.mark.parametrize("force", [1e-6, 0.14, 14.0, 49.9, 50.1, 140.0, 1e5])
@pytest.mark.parametrize("gap", [0.0, 3e-6])
def test_mass_on_the_ground(force, gap):
    system = mass_point(load=Load(force), gap=gap)
    q = equilibrium(system).modal_coordinates
    depth = -system.basis.T[2, 1] @ q - gap
    assert depth == pytest.approx(penetration_of(force), rel=1e-9)
    assert contact(system, q)[0] == pytest.approx([force], rel=1e-9)
    assert abs(system.basis.T[2, 0] @ q) < 1e-12


def test_spring_and_contact_carry_the_load_together():
    system = mass_point(drive=Drive(stiffness_y=2e6), load=Load(14.0))
    depth = brentq(lambda u: STIFFNESS * u**2 / (2.0 * R) + 2e6 * u - 14.0, 0.0, R)
    q = equilibrium(system).modal_coordinates
    assert -system.basis.T[2, 1] @ q == pytest.approx(depth, rel=1e-10)
    assert contact(system, q)[0] == pytest.approx([14.0 - 2e6 * depth], rel=1e-8)


def test_held_above_the_ground():
    """The spring alone carries the load: no contact."""
    system = mass_point(drive=Drive(stiffness_y=1000.0), load=Load(14.0), gap=0.02)
    q = equilibrium(system).modal_coordinates
    assert system.basis.T[2, 1] @ q == pytest.approx(-0.014, rel=1e-10)
    assert contact(system, q)[0].tolist() == [0.0]


def test_pulled_off_the_ground_against_a_spring():
    system = mass_point(drive=Drive(stiffness_y=1000.0), load=Load(-5.0))
    q = equilibrium(system).modal_coordinates
    assert system.basis.T[2, 1] @ q == pytest.approx(0.005, rel=1e-10)


@pytest.mark.parametrize("speed", [1e-3, -1e-3, 0.3, 1e-7])
def test_steady_sliding(speed):
    """x = mu N / c, dragged along by the ground."""
    system = mass_point(ground=Ground(speed=speed), drive=Drive(stiffness_x=5610.0))
    q = equilibrium(system, "sliding").modal_coordinates
    v = abs(speed)
    mu = (0.25 * np.exp(-1000.0 * v) + 0.55) * 2.0 / np.pi * np.arctan(1e6 * v)
    x, y = system.basis.T[2, :2] @ q
    assert x == pytest.approx(np.sign(speed) * mu * 14.0 / 5610.0, rel=1e-9)
    assert y == pytest.approx(-penetration_of(14.0), rel=1e-9)
    # It is an equilibrium of the whole system.
    rate = system.rhs(0.0, np.concatenate([q, np.zeros(2)]))
    assert np.abs(rate).max() < 1e-9 * 14.0


def test_drive_is_at_its_mean():
    drive = Drive(stiffness_x=5610.0, stiffness_y=1e5, amplitude_x=0.5e-3, amplitude_y=1e-3,
                  frequency_hz=13.8 / TURN)
    for time in (0.0, 0.1):
        q = equilibrium(mass_point(drive=drive), time=time).modal_coordinates
        undriven = mass_point(drive=Drive(stiffness_x=5610.0, stiffness_y=1e5))
        still = equilibrium(undriven).modal_coordinates
        assert q == pytest.approx(still, rel=1e-12)


# The pressed beam --------------------------------------------------------------------------------

def energy_minimum(system):
    """The equilibrium without friction as the minimum of the potential energy."""
    model = Model(system)
    m = model.m
    stiffness = np.diag(model.w**2)
    for i, axis in enumerate("xy"):
        c = model.values[f"drive.stiffness_{axis}"]
        stiffness = stiffness + c * np.outer(model.T[0, i], model.T[0, i])

    def state(p):
        return np.concatenate([p / scale, np.zeros(m)])

    def potential(p):
        q = state(p)[:m]
        return (model.stored(0.0, state(p)) + model.values["load.normal"] * model.T[1, 1] @ q) * 1e3

    def gradient(p):
        q = state(p)[:m]
        force = stiffness @ q + model.values["load.normal"] * model.T[1, 1]
        for j in range(model.n):
            force = force - model.T[2 + j, 1] * model.node(j, 0.0, state(p))[0]
        return force / scale * 1e3

    largest = system.normal.stiffness
    scale = np.sqrt(np.diag(stiffness) + largest * (model.T[2:, 1] ** 2).mean(axis=0))
    scale = np.maximum(scale, 1e-3)
    found = minimize(potential, np.zeros(m), jac=gradient, method="BFGS",
                     options={"gtol": 1e-9, "maxiter": 5000})
    return state(found.x)[:m]


@pytest.mark.parametrize("C_at", [(0.1, 0.02), (0.13, 0.02)])
@pytest.mark.parametrize("load", [1.4, 400.0])
def test_pressed_beam_against_energy_minimum(load, C_at):
    system = beam(C=C_at, load=Load(load))
    q = equilibrium(system).modal_coordinates
    force = contact(system, q)[0]
    assert force.sum() == pytest.approx(load, rel=1e-9)
    moment = force @ (system.basis.contact_x - C_at[0])
    assert moment == pytest.approx(0.0, abs=1e-9 * load * LENGTH)
    expected = contact(system, energy_minimum(system))[0]
    assert force == pytest.approx(expected, abs=1e-5 * load)
    assert np.ptp(force) > 0.05 * force.mean()
    rate = system.rhs(0.0, np.concatenate([q, np.zeros(len(q))]))
    mass = 7850.0 * LENGTH * HEIGHT * THICKNESS
    assert np.abs(rate).max() < 1e-8 * load / np.sqrt(mass)


@deep
def test_stiff_body_pressed_off_its_middle():
    """Rigid body on linear springs c / L: p = N / L (1 + 12 e s / L^2), s from the middle."""
    basis = modal_basis(
        ElasticBody(rectangle(LENGTH, 0.1, 16, 8), Material(), THICKNESS), 3, contact="bottom",
        contact_nodes=8, C=(0.12, 0.1))
    system = ContactSystem(basis, normal=RoughSurface(STIFFNESS, 1e-9, 0.0), load=Load(400.0),
                           friction=ExponentialFriction(0.8, 0.55, 1e3))
    q = equilibrium(system).modal_coordinates
    force = contact(system, q)[0]
    s = basis.contact_x - 0.1
    factor = 12.0 / (1.0 - 1.0 / 8**2)
    assert force == pytest.approx(400.0 / 8 * (1.0 + factor * 0.02 * s / LENGTH**2), rel=1e-3)


@deep
def test_stiff_body_lifts_off_on_one_side():
    """Load outside the middle third: a triangle of pressure over 3 (L / 2 - e)."""
    n = 40
    mesh = rectangle(LENGTH, 0.1, 40, 4)
    basis = modal_basis(ElasticBody(mesh, Material(), THICKNESS), 3, contact="bottom",
                        contact_nodes=n, C=(0.15, 0.1))
    system = ContactSystem(basis, normal=RoughSurface(STIFFNESS, 1e-9, 0.0), load=Load(400.0),
                           friction=ExponentialFriction(0.8, 0.55, 1e3))
    q = equilibrium(system).modal_coordinates
    force = contact(system, q)[0]
    reach = 3.0 * 0.05
    from_edge = LENGTH - basis.contact_x
    triangle = 2.0 * 400.0 / reach * (1.0 - from_edge / reach) * LENGTH / n
    assert force[from_edge > reach + 0.005].max() == 0.0
    assert force == pytest.approx(np.maximum(triangle, 0.0), abs=0.01 * triangle.max())
    assert force.sum() == pytest.approx(400.0, rel=1e-9)
    assert force @ (basis.contact_x - 0.15) == pytest.approx(0.0, abs=1e-7)


def test_number_of_nodes_does_not_matter_for_a_uniformly_pressed_body():
    """With rigid modes only and the load in the middle, the depth is that of one mass."""
    for n in (1, 2, 7, "all"):
        mesh = rectangle(LENGTH, HEIGHT, 16, 2)
        basis = modal_basis(ElasticBody(mesh, Material(), THICKNESS), 3, contact="bottom",
                            contact_nodes=n, C=(0.1, 0.02))
        system = ContactSystem(basis, normal=RoughSurface(STIFFNESS, R, 0.0), load=Load(14.0),
                               friction=ExponentialFriction(0.8, 0.55, 1e3))
        depth = contact(system, equilibrium(system).modal_coordinates)[2]
        assert depth == pytest.approx(np.full(len(depth), penetration_of(14.0)), rel=1e-8)


def test_pressure_converges_with_the_number_of_nodes():
    """The total moment-free distribution, as the depth at the ends, tends to a limit."""
    depths = [equilibrium(s).penetration[[0, -1]].mean() / penetration_of(400.0)
              for s in (beam(n, load=Load(400.0)) for n in (8, 16, 33))]
    assert abs(depths[2] - depths[1]) < 0.02
    assert abs(depths[1] - depths[0]) < 0.05


def test_sliding_beam_leans_on_its_leading_edge():
    """Friction at the face tips the body about the height of the spring at B."""
    system = beam(12, C=(0.1, 0.02), ground=Ground(speed=0.05),
                  drive=Drive(stiffness_x=1e5), load=Load(400.0))
    q = equilibrium(system, "sliding").modal_coordinates
    F, friction, _ = contact(system, q)
    v = 0.05
    mu = (0.25 * np.exp(-1000.0 * v) + 0.55) * 2.0 / np.pi * np.arctan(1e6 * v)
    assert F.sum() == pytest.approx(400.0, rel=1e-9)
    assert friction == pytest.approx(-mu * F, rel=1e-9)
    x_B = system.basis.T[0, 0] @ q
    assert 1e5 * x_B == pytest.approx(mu * 400.0, rel=1e-9)
    # Drag +mu N at y = 0 and the spring's pull at 0.01: counter-clockwise, the right is lifted.
    moment = F @ (system.basis.contact_x - 0.1) + 0.01 * mu * 400.0
    assert moment == pytest.approx(0.0, abs=1e-8 * 400.0 * LENGTH)


# Wavy ground -------------------------------------------------------------------------------------

WAVE = Ground(speed=1e-3, amplitude=200e-6, wavelength=2.5e-3)
K = 2.0 * np.pi / WAVE.wavelength


def slope(ground, xi):
    k = 2.0 * np.pi / ground.wavelength
    return ground.amplitude * k * np.cos(k * xi)


@pytest.mark.parametrize("stiffness", [2e3, 5610.0, 1e5])
@pytest.mark.parametrize("time", [0.0, 0.7, 1.4])
def test_mass_on_a_wave(time, stiffness):
    """The slope balances the spring: c_x x = -F y_R', on the side of the trough."""
    system = mass_point(ground=WAVE, drive=Drive(stiffness_x=stiffness))
    x, y = system.basis.T[2, :2] @ equilibrium(system, time=time).modal_coordinates

    def pull(x):
        return stiffness * x + 14.0 * slope(WAVE, x - 1e-3 * time)

    # Downhill until the spring holds it: the first root on that side.
    side = -np.sign(pull(0.0)) * np.linspace(0.0, 2.5e-3, 20001)
    first = np.flatnonzero(np.sign(pull(side)) != np.sign(pull(0.0)))[0]
    expected = brentq(pull, *sorted(side[[first - 1, first]]), xtol=1e-15)
    assert x == pytest.approx(expected, rel=1e-9)
    height = 200e-6 * np.sin(K * (x - 1e-3 * time))
    assert y == pytest.approx(height - penetration_of(14.0), rel=1e-9)


def test_mass_with_a_vertical_contact_force_stays_where_it_is():
    ground = Ground(speed=1e-3, amplitude=200e-6, wavelength=2.5e-3, normal="vertical")
    system = mass_point(ground=ground, drive=Drive(stiffness_x=5610.0))
    x, y = system.basis.T[2, :2] @ equilibrium(system, time=0.7).modal_coordinates
    assert x == pytest.approx(0.0, abs=1e-12)
    assert y == pytest.approx(200e-6 * np.sin(-K * 0.7e-3) - penetration_of(14.0), rel=1e-8)


@pytest.mark.parametrize("time", [0.0, 0.3, 0.625])
def test_free_mass_rests_in_the_next_trough(time):
    """At 0.625 s it stands in a trough, at 1.875 s balanced on a crest."""
    system = mass_point(ground=WAVE)
    x, y = system.basis.T[2, :2] @ equilibrium(system, time=time).modal_coordinates
    assert x == pytest.approx(1e-3 * time - 0.625e-3, abs=1e-12)
    assert y == pytest.approx(-200e-6 - penetration_of(14.0), rel=1e-9)
    x, y = system.basis.T[2, :2] @ equilibrium(system, time=1.875).modal_coordinates
    assert abs(x) == pytest.approx(1.25e-3, rel=1e-9)
    assert y == pytest.approx(-200e-6 - penetration_of(14.0), rel=1e-9)


@pytest.mark.parametrize("time", [0.0, 0.7, 1.875])
def test_runs_from_rest_start_where_the_body_stands(time):
    """Friction holds it on the slope; its normal force carries the load."""
    system = mass_point(ground=WAVE)
    state = initial_state(system, "rest", time)
    x, y = system.basis.T[2, :2] @ state[:2]
    assert x == pytest.approx(0.0, abs=1e-18)
    assert y == pytest.approx(200e-6 * np.sin(-K * 1e-3 * time) - penetration_of(14.0), rel=1e-9)
    vertical = system.with_(**{"ground.normal": "vertical"})
    assert state[:2] == pytest.approx(equilibrium(vertical, time=time).modal_coordinates, rel=1e-12)


def test_beam_on_waves_is_in_balance():
    """Forces and moments of slopes, spring (0.01 m above the face) and load."""
    ground = Ground(speed=0.01, amplitude=20e-6, wavelength=0.08)
    system = beam(16, ground=ground, drive=Drive(stiffness_x=1e5), load=Load(40.0),
                  normal=RoughSurface(STIFFNESS, R, 0.0))
    for time in (0.7, 1.6, 3.0):
        q = equilibrium(system, time=time).modal_coordinates
        F, _, u = contact(system, q, time)
        spring = 1e5 * system.basis.T[0, 0] @ q
        x = system.basis.contact_T[:, 0] @ q
        inclined = F @ slope(ground, system.basis.contact_x + x - 0.01 * time)
        assert F.sum() == pytest.approx(40.0, rel=1e-8)
        assert spring == pytest.approx(-inclined, abs=1e-8)
        moment = F @ (system.basis.contact_x - 0.1) + 0.01 * spring
        assert moment == pytest.approx(0.0, abs=1e-8)
        assert ((F > 0.0) == (u > 0.0)).all()
        assert np.count_nonzero(F) < 16
        assert abs(spring) > 1e-4


def test_light_body_slides_off_a_crest_until_its_nodes_carry_it():
    """Free along the ground: no force along it remains, and the energy has fallen."""
    basis = modal_basis(ElasticBody(rectangle(LENGTH, HEIGHT, 16, 2), Material(), THICKNESS), 6,
                        contact="bottom", contact_nodes=6, C=(0.1, HEIGHT))
    ground = Ground(amplitude=2e-4, wavelength=0.15)
    system = ContactSystem(basis, normal=RoughSurface(1e7, 1e-6, 0.0), load=Load(2.0),
                           ground=ground, friction=ExponentialFriction(0.8, 0.55, 1e3))
    q = equilibrium(system).modal_coordinates
    F = contact(system, q)[0]
    x = basis.contact_T[:, 0] @ q
    assert F.sum() == pytest.approx(2.0, rel=1e-8)
    assert F @ (basis.contact_x - 0.1) == pytest.approx(0.0, abs=1e-9)
    assert F @ slope(ground, basis.contact_x + x) == pytest.approx(0.0, abs=1e-9)
    assert np.abs(x).max() > 1e-3
    standing = initial_state(system, "rest", 0.0)[: basis.modes]

    def energy(q):
        stored = system.stored_energy(contact(system, q)[2])
        return 0.5 * ((basis.angular_frequencies * q) ** 2).sum() + 2.0 * basis.T[1, 1] @ q + stored

    assert energy(q) < energy(standing) - 1e-5


# No equilibrium ----------------------------------------------------------------------------------

def test_steady_sliding_needs_flat_ground():
    system = mass_point(ground=Ground(speed=1e-3, amplitude=1e-6))
    with pytest.raises(AnalysisError, match="wavy ground"):
        equilibrium(system, "sliding")


def test_nothing_holds_the_sliding_mass():
    system = mass_point(ground=Ground(speed=1e-3))
    with pytest.raises(AnalysisError, match=r"steady sliding.*translation along the ground \(x\)"):
        equilibrium(system, "sliding")


def test_nothing_presses_the_mass():
    with pytest.raises(AnalysisError, match=r"static equilibrium.*load\.normal = -5 N.*lifts off"):
        equilibrium(mass_point(load=Load(-5.0)))


def test_load_beside_the_face_tips_the_body():
    mesh = rectangle(LENGTH, HEIGHT, 16, 2, split=((0.0, 0.1),))
    basis = modal_basis(ElasticBody(mesh, Material(), THICKNESS), 8, contact="feet",
                        contact_nodes=4, C=(0.15, 0.02))
    # Without rotation nodes stand in the middles of their four segments of the face.
    with pytest.raises(AnalysisError, match=r"tips over \(its loads have the resultant -14 N in y, "
                                            r"which meets the ground at x = 0\.15 m; the contact "
                                            r"nodes hold it at x = 0\.0125 to 0\.0875 m\)"):
        equilibrium(ContactSystem(basis, normal=NORMAL, load=Load(14.0),
                                         friction=ExponentialFriction(0.8, 0.55, 1e3)))


def test_sliding_block_tips_over_its_short_face():
    """Contact length below 2 mu times the height of the spring: no steady sliding."""
    mesh = rectangle(0.02, 0.1, 4, 10)
    basis = modal_basis(ElasticBody(mesh, Material(), THICKNESS), 6, contact="bottom",
                        contact_nodes=4, B=(0.0, 0.08), C=(0.01, 0.1))
    friction = ExponentialFriction(0.5, 0.5, 0.0)
    system = ContactSystem(basis, normal=RoughSurface(STIFFNESS, R, 1.0), load=Load(14.0),
                           friction=friction, ground=Ground(speed=0.1),
                           drive=Drive(stiffness_x=1e5))
    with pytest.raises(AnalysisError, match=r"tips over"):
        equilibrium(system, "sliding")
    low = system.with_(**{"friction.static_coefficient": 0.05,
                          "friction.kinetic_coefficient": 0.05})
    F = contact(low, equilibrium(low, "sliding").modal_coordinates)[0]
    assert F.sum() == pytest.approx(14.0, rel=1e-9)


def test_body_that_only_one_point_holds():
    """One contact node, load beside it: nothing holds the rotation."""
    system = beam(1, C=(0.15, 0.02))
    with pytest.raises(AnalysisError, match="rotation"):
        equilibrium(system)


def test_body_without_load_just_touches():
    for system in (mass_point(load=Load(0.0)), beam(load=Load(0.0)), mass_point(
            load=Load(0.0), drive=Drive(stiffness_y=99.0))):
        assert (equilibrium(system).modal_coordinates == 0.0).all()


def test_point_pushed_across_names_both():
    """No friction, no spring: a force along the ground cannot be held."""
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    slanted = np.array([[0.0, 0.0], [0.6, 0.8], [0.0, 0.0]])
    basis = basis_from_matrices(np.eye(2), np.zeros((2, 2)),
                                {"contact": rows[None], "C": slanted})
    with pytest.raises(AnalysisError, match=r"translation along the ground \(x\)"):
        equilibrium(ContactSystem(basis, normal=NORMAL, load=Load(14.0),
                                         friction=ExponentialFriction(0.8, 0.55, 1e3)))


@pytest.mark.parametrize("height", [-3e-3, -1e-4, 1e-4, 3e-3])
def test_ground_far_from_the_reference_place(height):
    """The start of the search does not matter: a deep trough, a high crest it stands on."""
    ground = Ground(amplitude=abs(height), wavelength=0.08, normal="vertical")
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    basis = basis_from_matrices(np.eye(2), np.zeros((2, 2)),
                                {"contact": rows[None], "C": rows},
                                contact_x=[np.sign(height) * 0.02])
    system = ContactSystem(basis, normal=NORMAL, load=Load(14.0), ground=ground,
                           friction=ExponentialFriction(0.8, 0.55, 1e3))
    q = equilibrium(system).modal_coordinates
    assert q[1] == pytest.approx(height - penetration_of(14.0), rel=1e-9)


@deep
@pytest.mark.parametrize("seed", range(6))
def test_light_bodies_on_waves_and_gaps(seed):
    """Penetrations far below waves and gaps: which nodes touch is not known beforehand."""
    rng = np.random.default_rng(seed)
    for n, modes, at in ((2, 5, 0.1), (8, 5, 0.05), (16, 12, 0.13), (33, 3, 0.17), (33, 20, 0.03)):
        mesh = rectangle(LENGTH, HEIGHT, 16, 2)
        basis = modal_basis(ElasticBody(mesh, Material(), THICKNESS), modes, contact="bottom",
                            contact_nodes=n, C=(at, HEIGHT))
        load = 10.0 ** rng.uniform(-3.0, 1.0)
        system = ContactSystem(
            basis, normal=RoughSurface(10.0 ** rng.uniform(6.0, 9.0), 1e-7, 0.0), load=Load(load),
            ground=Ground(amplitude=2e-4, wavelength=10.0 ** rng.uniform(-1.5, 0.0),
                          normal="vertical"),
            gap=tuple(rng.uniform(0.0, 1e-5, n)), friction=ExponentialFriction(0.8, 0.55, 1e3))
        F, _, u = contact(system, equilibrium(system).modal_coordinates)
        assert F.sum() == pytest.approx(load, rel=1e-6)
        assert F @ (basis.contact_x - at) == pytest.approx(0.0, abs=1e-6 * load * LENGTH)
        assert ((F > 0.0) == (u > 0.0)).all()


# Runaways, and what leaves the limits of the model ------------------------------------------------

def bracket(reduction="residual", B=(LENGTH, HEIGHT), **parts):
    """Feet under the left half, the load beyond them, a spring that cannot hold the rotation."""
    mesh = rectangle(LENGTH, HEIGHT, 16, 2, split=((0.0, 0.1),))
    basis = modal_basis(ElasticBody(mesh, Material(), THICKNESS), 8, reduction=reduction,
                        contact="feet", contact_nodes=4, C=(0.19, HEIGHT), B=B)
    return ContactSystem(basis, **{"normal": RoughSurface(1e5, 1e-6, 0.0),
                                   "friction": ExponentialFriction(0.8, 0.55, 1e3),
                                   "load": Load(100.0),
                                   "drive": Drive(stiffness_x=1e5), **parts})


@pytest.mark.parametrize("friction", [False, True])
@pytest.mark.parametrize("reduction", ["vibration", "residual"])
@pytest.mark.parametrize("stiffness", [1e5, 1e7, 1e9])
def test_rounding_of_a_runaway_is_no_balance(friction, reduction, stiffness):
    """The spring pulls along the ground at the height of the tilt's own axis."""
    system = bracket(reduction, normal=RoughSurface(stiffness, 1e-6, 0.0),
                     ground=Ground(speed=0.1 if friction else 0.0))
    with pytest.raises(AnalysisError, match="tips over"):
        equilibrium(system, "sliding" if friction else "rest")


def test_a_spring_that_holds_the_bracket_far_off_is_reported():
    """Tilt about the feet's outer edge: c_y (0.2 - X)^2 phi = N (0.19 - X), X the last node."""
    system = bracket("vibration", drive=Drive(stiffness_x=1e5, stiffness_y=100.0),
                     normal=RoughSurface(1e9, 1e-6, 0.0))
    edge = system.basis.contact_x.max()
    with pytest.warns(ModelWarning, match=r"In equilibrium points of the body move by"):
        q = equilibrium(system).modal_coordinates
    tilt = -(100.0 * (0.19 - edge)) / (100.0 * (LENGTH - edge) ** 2)
    assert system.basis.contact_T[0, 2] @ q == pytest.approx(tilt, rel=1e-2)
    stiff = system.with_(**{"drive.stiffness_y": 1e6})
    equilibrium(stiff)


def test_pressed_deeper_than_a_hundred_roughness_heights():
    soft = mass_point(normal=RoughSurface(1e3, 1e-5, 0.0))
    with pytest.warns(ModelWarning, match="contact node 0 is 0.014 m deep .* 1.4e.03 times"):
        equilibrium(soft)
    # 14 N on 14.2e3 N/m: 99.1 heights.
    equilibrium(mass_point(normal=RoughSurface(14.0 / (98.6 * 1e-5), 1e-5, 0.0)))
    with pytest.warns(ModelWarning, match="101 times|1e.02 times"):
        equilibrium(mass_point(normal=RoughSurface(14.0 / (100.6 * 1e-5), 1e-5, 0.0)))


def test_block_on_rough_ground_with_an_exponential_law():
    """Least potential by a trust region; forces are e^12 times those of touching nodes."""
    n, depth, load = 40, 1e-7, 1e4
    mesh = Mesh.grid(np.linspace(-0.02, 0.02, n + 1), np.linspace(0.0, 0.02, 9))
    basis = modal_basis(ElasticBody(mesh, Material(210e9, 0.3, 7800.0), 0.01), 6,
                        contact="bottom", contact_nodes=n, C="top", reduction="residual",
                        tolerance=0.0)
    gap = np.random.default_rng(1).uniform(0.0, 3e-6, n)
    found = equilibrium(ContactSystem(
        basis, normal=ExponentialContact(1.0, depth), friction=ExponentialFriction(0.8, 0.55, 1e3),
        load=Load(load), gap=tuple(gap)))
    rows, pushed = basis.contact_T[:, 1], load * basis.point_row("C", "y")
    stiffness = np.diag(basis.angular_frequencies**2)
    held = 1e8 * np.outer(basis.point_row("C", "x"), basis.point_row("C", "x"))

    def forces(q):
        return np.exp(np.minimum((-rows @ q - gap) / depth, 50.0)) / n

    q = np.zeros(basis.modes)
    for _ in range(200):
        gradient = (stiffness + held) @ q - rows.T @ forces(q) + pushed
        curvature = stiffness + held + (rows.T * forces(q) / depth) @ rows
        step = np.linalg.solve(curvature, -gradient)
        # Penetrations change by one depth at most, over which the law grows by e.
        q += step * min(1.0, depth / np.abs(rows @ step).max())
    assert forces(q).sum() == pytest.approx(load, rel=1e-9)
    assert found.normal_force == pytest.approx(forces(q), rel=1e-6, abs=1e-6 * load)
