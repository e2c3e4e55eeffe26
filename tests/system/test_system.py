"""The contact system: right-hand side, Jacobian and powers against the model written out."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from model_for_tests import Model
from systems import TURN

from fecontact import (
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    InputError,
    Load,
    Material,
    ModalBasis,
    RigidStart,
    basis_from_matrices,
    modal_basis,
)
from fecontact.integrate import initial_state
from fecontact.laws import ExponentialFriction, RoughSurface
from fecontact.system import columns
from fecontact.system.columns import POWERS
from fecontact.system.kernels import contact_at
from fecontact.system.powers import powers

R = 10e-6


def random_basis(n, m, seed=0):
    """Modes of no body: full damping matrix, rows of any sign in all components."""
    rng = np.random.default_rng(seed)
    w = np.sort(rng.uniform(10.0, 500.0, m))
    w[: min(2, m - 1)] = 0.0
    half = rng.standard_normal((m, m))
    return ModalBasis(
        angular_frequencies=w, damping=half @ half.T, T=rng.standard_normal((2 + n, 3, m)),
        positions=rng.uniform(0.0, 0.01, (2 + n, 2)), tributary=rng.uniform(0.5, 2.0, n))


def random_system(n=3, m=10, seed=0, **parts):
    """A system with everything in it."""
    parts = {
        "normal": RoughSurface(1e6, R, 40.0),
        "friction": ExponentialFriction(0.8, 0.55, 1e3, 1e6),
        "ground": Ground(speed=1e-3, amplitude=20e-6, wavelength=2.5e-3),
        "drive": Drive(5610.0, 99.0, 0.768, 0.02, 0.5e-3, -0.47e-3, 13.8 / TURN),
        "load": Load(14.0), "gap": 1e-6, **parts,
    }
    return ContactSystem(random_basis(n, m, seed),
                         **{"friction": ExponentialFriction(0.8, 0.55, 1e3), **parts})


def state_with(system, t, penetration, rate, slip, seed=1):
    """A state whose first contact nodes have the given u, u' and slip velocities."""
    basis, ground = system.basis, system.ground
    n, m = basis.contact_nodes, basis.modes
    rng = np.random.default_rng(seed)
    gap = np.broadcast_to(system.gap, n)
    x = rng.uniform(-1e-3, 1e-3, n)
    xi = basis.contact_x + x - ground.speed * t
    k = 2.0 * np.pi / ground.wavelength
    lifting = ground.amplitude * k * np.cos(k * xi) * slip
    rows = np.vstack([basis.contact_T[:, 0], basis.contact_T[:, 1]])
    place = np.concatenate([x, ground.amplitude * np.sin(k * xi) - gap - penetration])
    speed = np.concatenate([slip + ground.speed, lifting - rate])
    free = np.linalg.svd(rows)[2][2 * n :]
    return np.concatenate([
        np.linalg.lstsq(rows, place, rcond=None)[0] + free.T @ rng.uniform(-1e-4, 1e-4, len(free)),
        np.linalg.lstsq(rows, speed, rcond=None)[0] + free.T @ rng.uniform(-1e-2, 1e-2, len(free)),
    ]) if 2 * n <= m else None


# Penetration in R_Z, its rate [m/s], slip velocity [m/s] of three nodes.
STATES = {
    "open": ([-1.0, -0.1, -50.0], [0.1, -0.1, 0.0], [1e-3, 1e-6, -1.0]),
    "partly in contact": ([0.2, 0.5, 0.95], [0.001, 0.0, -0.0005], [1e-3, -1e-3, 2e-3]),
    "fully in contact": ([1.2, 3.0, 10.0], [0.01, 0.0, -0.01], [1e-3, -1e-3, 2e-3]),
    "clipped by damping": ([0.1, 0.7, 2.0], [-0.3, -0.4, -2.0], [1e-3, 1e-6, -1.0]),
    "stick": ([0.5, 1.5, 5.0], [0.0, 0.001, -0.001], [1e-8, -3e-7, 4e-5]),
    "slip both ways": ([0.5, 1.5, 5.0], [0.0, 0.001, -0.001], [0.02, -0.3, 1e-4]),
    "at rest": ([0.5, 1.5, 5.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    "one of each": ([-0.3, 0.4, 2.0], [0.02, -0.9, 0.01], [1e-3, 1e-3, 1e-7]),
}

SYSTEMS = {
    "all": {},
    "flat ground": {"ground": Ground(speed=1e-3)},
    "ground at rest": {"ground": Ground(amplitude=50e-6, wavelength=1e-3)},
    "no drive": {"drive": Drive()},
    "vertical": {"ground": Ground(0.01, 50e-6, 1e-3, normal="vertical")},
    "dashpots to the base": {"drive": Drive(3e3, 2e3, 0.7, 0.4, 1e-3, 5e-4, 13.8 / TURN,
                                            dashpots="relative")},
    "back": {"ground": Ground(speed=-0.3, amplitude=20e-6, wavelength=2.5e-3)},
    "rising friction": {"friction": ExponentialFriction(0.2, 0.6, 300.0, 1e5)},
    "per node": {
        "normal": RoughSurface((1e6, 2e6, 3e5), (R, 2 * R, 0.5 * R), (1.0, 40.0, 200.0)),
        "friction": ExponentialFriction((0.8, 0.3, 0.1), 0.2, (1000.0, 10.0, 0.0), (1e6, 1e5, 1e4)),
        "gap": (0.0, 1e-6, 5e-5)},
}


def scale_of(model, t, y):
    """Size of the largest terms of y' and of its Jacobian."""
    forces = [abs(model.T[2 + j]).max() * model.node(j, t, y)[0] for j in range(model.n)]
    springs = np.abs(model.w**2 * y[: model.m]).max() + np.abs(model.C @ y[model.m :]).max()
    return max(max(forces), springs, 14.0 * abs(model.T[1, 1]).max(), 1e-6)


@pytest.mark.parametrize("parts", SYSTEMS)
@pytest.mark.parametrize("case", STATES)
def test_right_hand_side_jacobian_and_powers(case, parts):
    system = random_system(**SYSTEMS[parts])
    model = Model(system)
    height = np.broadcast_to(system.normal.roughness_height, 3)
    s, rate, slip = (np.array(values) for values in STATES[case])
    t = 0.37
    y = state_with(system, t, s * height, rate, slip)

    # The state is the one that was meant.
    history = system.contact_history(np.array([t]), y[None])[0]
    assert history[:, columns.PENETRATION] == pytest.approx(s * height, abs=1e-9 * R)
    assert history[:, columns.PENETRATION_RATE] == pytest.approx(rate, abs=1e-12)
    assert history[:, columns.SLIP_VELOCITY] == pytest.approx(slip, abs=1e-14)
    # Friction of slope 1e6 F turns the rounding of the slip velocity into a force.
    slope = 1e6 * history[:, columns.NORMAL_FORCE].max() if case == "at rest" else 0.0
    rounding = 1e-10 + 1e-16 * slope
    for j in range(3):
        expected = model.node(j, t, y)
        *expected, incline = expected
        assert history[j] == pytest.approx([*expected, incline * expected[4]], rel=1e-8,
                                           abs=rounding)
    if case in ("open", "clipped by damping"):
        assert (history[:, columns.NORMAL_FORCE] == 0.0).all() or parts == "per node"

    size = scale_of(model, t, y)
    assert np.abs(system.rhs(t, y) - model.rhs(t, y)).max() < 1e-9 * size
    expected = model.jacobian(t, y)
    assert np.abs(system.jacobian(t, y) - expected).max() < 1e-9 * np.abs(expected).max()
    # Entries that differ in size by many orders: each against its own terms.
    assert system.jacobian(t, y) == pytest.approx(
        expected, rel=1e-5, abs=1e-11 * np.abs(expected).max())

    values, of_nodes = np.empty(len(POWERS)), np.empty(6)
    creep = np.array([2e-7, 1.1e-3, 0.1])
    powers(t, y, system.arrays, creep, values, of_nodes)
    got = dict(zip(POWERS, values, strict=True))
    assert of_nodes[:3].sum() == pytest.approx(got["friction"], rel=1e-12)
    assert (of_nodes[3:] == np.where(np.abs(slip) < creep, of_nodes[:3], 0.0)).all()
    expected = model.powers(t, y)
    largest = max(abs(value) for value in expected.values())
    for name, value in got.items():
        assert value == pytest.approx(expected[name], rel=1e-7, abs=1e-10 * largest), name
    for name in ("modal_damping", "dashpots", "contact_damping", "friction"):
        assert got[name] >= -1e-12 * largest, name
    # Power that is put in and not lost is stored.
    balance = (got["drive"] + got["belt_normal"] + got["belt_friction"] + got["load"]
               - got["modal_damping"] - got["dashpots"] - got["contact_damping"]
               - got["friction"])
    assert model.stored_rate(t, y) == pytest.approx(balance, abs=1e-9 * largest)


@pytest.mark.parametrize(("n", "m"), [(1, 1), (1, 2), (2, 1), (5, 3), (40, 20)])
def test_any_number_of_nodes_and_modes(n, m):
    rng = np.random.default_rng(n + 100 * m)
    system = random_system(n, m, seed=n + m, ground=Ground(1e-3, 0.5e-6, 2.5e-3))
    model = Model(system)
    for t, size in ((0.0, R), (0.2, 0.1 * R), (3.0, 20 * R)):
        y = rng.standard_normal(2 * m) * np.repeat([size, 1e-3], m)
        scale = scale_of(model, t, y)
        assert np.abs(system.rhs(t, y) - model.rhs(t, y)).max() < 1e-10 * scale * n
        expected = model.jacobian(t, y)
        assert system.jacobian(t, y) == pytest.approx(
            expected, rel=1e-6, abs=1e-10 * np.abs(expected).max())


def test_jacobian_against_central_differences():
    """Without the model written out: fourth-order differences of the right-hand side itself."""
    system = random_system()
    y = state_with(system, 0.1, np.array([0.5, 2.0, 0.8]) * R, np.array([0.01, 0.0, -0.001]),
                   np.array([1e-3, -2e-3, 5e-3]))
    m = system.basis.modes
    J = system.jacobian(0.1, y)
    for k in range(2 * m):
        h = 1e-9 if k < m else 1e-7
        step = np.zeros(2 * m)
        step[k] = h
        f = {i: system.rhs(0.1, y + i * step) for i in (-2, -1, 1, 2)}
        slope = (8.0 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12.0 * h)
        assert J[:, k] == pytest.approx(slope, rel=1e-5, abs=2e-6 * np.abs(J[:, k]).max())


def test_stored_contact_energy_of_the_law_is_that_of_the_model():
    system = random_system(**SYSTEMS["per node"])
    model = Model(system)
    for s in (-0.5, 0.3, 0.9, 1.4, 8.0):
        u = s * np.array([R, 2 * R, 0.5 * R])
        y = state_with(system, 0.0, u, np.zeros(3), np.zeros(3))
        q = y[: model.m]
        rest = 0.5 * (model.w * q) @ (model.w * q) + 0.5 * y[model.m :] @ y[model.m :]
        springs = 0.5 * 5610.0 * (model.T[0, 0] @ q) ** 2 + 0.5 * 99.0 * (model.T[0, 1] @ q) ** 2
        stored = system.normal.stored_energy(u, system.share).sum()
        assert stored == pytest.approx(model.stored(0.0, y) - rest - springs,
                                       abs=1e-9 * (rest + springs))


# Signs by hand -----------------------------------------------------------------------------------

def mass_point(mass=2.0, **parts):
    """One mass, free in x and y, everything at the same point."""
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    basis = basis_from_matrices(mass * np.eye(2), np.zeros((2, 2)),
                                {"contact": rows[None], "B": rows, "C": rows})
    return ContactSystem(basis, **{"normal": RoughSurface(0.3e6, 5.2e-6, 6.0),
                                   "friction": ExponentialFriction(0.8, 0.55, 1e3), **parts})


def acceleration(system, t=0.0, place=(0.0, 0.0), velocity=(0.0, 0.0)):
    """Acceleration x'', y'' of the mass."""
    root = np.sqrt(2.0)
    y = root * np.array([*place, *velocity])
    return system.rhs(t, y)[2:] / root


def test_contact_pushes_up_and_drags_along():
    system = mass_point(normal=RoughSurface(1e6, 1e-5, 0.0), ground=Ground(speed=0.1),
                        friction=ExponentialFriction(0.5, 0.5, 0.0, 1e6))
    # Penetration 25 um: F = 1e6 (25 - 5) um = 20 N; ground to the right drags to the right.
    F = 20.0
    drag = 0.5 * F * (2.0 / np.pi) * np.arctan(1e5)
    assert acceleration(system, 0.0, (0.3, -25e-6)) == pytest.approx([drag / 2, F / 2], rel=1e-12)
    assert acceleration(system, 0.0, (0.3, -25e-6), (0.2, 0.0)) == pytest.approx(
        [-drag / 2, F / 2], rel=1e-12)
    assert acceleration(system, 0.0, (0.3, 1e-9)).tolist() == [0.0, 0.0]


def test_load_presses_down():
    assert acceleration(mass_point(load=Load(14.0)), 0.0, (0.0, 1.0)) == pytest.approx(
        [0.0, -7.0], rel=1e-14)


def test_spring_and_absolute_dashpot_at_the_excitation_point():
    drive = Drive(stiffness_x=100.0, damping_x=3.0, amplitude_x=0.5, frequency_hz=2.0 / TURN,
                  stiffness_y=50.0, damping_y=4.0, amplitude_y=0.25)
    system = mass_point(drive=drive)
    for t in (0.0, 0.4, 1.1):
        ends = np.array([0.5, 0.25]) * np.sin(2.0 * t)
        # At t = 0 the moving end has its highest speed; the dashpots do not feel it.
        expected = -np.array([100.0, 50.0]) * (np.array([0.2, 3.0]) - ends) / 2.0
        assert acceleration(system, t, (0.2, 3.0)) == pytest.approx(expected, rel=1e-12)
        damped = expected - np.array([3.0, 4.0]) * np.array([0.7, -0.6]) / 2.0
        assert acceleration(system, t, (0.2, 3.0), (0.7, -0.6)) == pytest.approx(damped, rel=1e-12)


def test_waviness_travels_with_the_ground():
    ground = Ground(speed=0.02, amplitude=1e-4, wavelength=0.05)
    system = mass_point(normal=RoughSurface(1e6, 1e-5, 0.0), ground=ground,
                        friction=ExponentialFriction(0.0, 0.0, 1000.0))
    # The crest lies at a quarter of the wavelength and has moved by V t.
    crest = 0.05 / 4.0 + 0.02 * 0.6
    assert acceleration(system, 0.6, (crest, 0.0))[1] == pytest.approx(0.5 * 1e6 * 95e-6, rel=1e-9)
    assert acceleration(system, 0.6, (crest + 0.025, 0.0))[1] == 0.0


def test_node_places_enter_the_phase():
    rows = np.zeros((2, 3, 2))
    rows[:, 0, 0] = rows[:, 1, 1] = 1.0
    basis = basis_from_matrices(np.eye(2), np.zeros((2, 2)), {"contact": rows},
                                contact_x=[0.0125, 0.0375])
    system = ContactSystem(basis, normal=RoughSurface(2e6, 1e-5, 0.0),
                           ground=Ground(amplitude=1e-4, wavelength=0.05),
                           friction=ExponentialFriction(0.8, 0.55, 1e3))
    history = system.contact_history(np.zeros(1), np.zeros((1, 4)))[0]
    assert history[:, columns.PENETRATION] == pytest.approx([1e-4, -1e-4], rel=1e-12)
    assert history[:, columns.NORMAL_FORCE] == pytest.approx([1e6 * 95e-6, 0.0], rel=1e-12)


def test_ground_lifting_follows_the_chain_rule():
    ground = Ground(speed=0.02, amplitude=1e-4, wavelength=0.05)
    system = mass_point(ground=ground)
    root = np.sqrt(2.0)
    y = root * np.array([0.01, -1e-3, 0.3, 0.05])
    step = 1e-7

    def height(t):
        return float(ground.height(np.array([0.01 + 0.3 * t]), t)[0])

    lifting = (height(step) - height(-step)) / (2.0 * step)
    history = system.contact_history(np.zeros(1), y[None])[0, 0]
    assert history[columns.GROUND_RATE] == pytest.approx(lifting, rel=1e-7)
    assert history[columns.PENETRATION_RATE] == pytest.approx(lifting - 0.05, rel=1e-9)


# Finite-element bodies ---------------------------------------------------------------------------

def beam(contact_nodes, **options):
    mesh = rectangle(0.2, 0.02, 12, 2, points={"B": (0.0, 0.01), "C": (0.1, 0.02)})
    return modal_basis(
        ElasticBody(mesh, Material(), 0.01), 8, contact="bottom", contact_nodes=contact_nodes,
        damping=0.01, **options)


@pytest.mark.parametrize("n", [2, 5, 12, "all"])
def test_rigid_translation_is_the_same_for_any_number_of_nodes(n):
    parts = {"normal": RoughSurface(3e6, R, 40.0), "ground": Ground(speed=0.01),
             "friction": ExponentialFriction(0.8, 0.55, 1e3)}
    for depth, rate in ((0.4e-5, 0.001), (3e-5, -0.01), (2e-5, 0.2)):
        start = RigidStart((1e-3, -depth, 0.0), (0.004, -rate, 0.0))
        results = []
        for nodes in (1, n):
            system = ContactSystem(beam(nodes), **parts)
            y = initial_state(system, start, 0.0)
            state = system.contact_history(np.zeros(1), y[None])[0]
            results.append((state[:, :2].sum(axis=0), system.rhs(0.0, y)))
        (force, rhs), (other, other_rhs) = results
        assert other == pytest.approx(force, rel=1e-9)
        # A uniform pressure loads every mode alike.
        assert other_rhs == pytest.approx(rhs, abs=1e-8 * np.abs(rhs).max())


def test_rigid_modes_feel_the_resultant():
    """The acceleration of the rigid modes times the mass is the sum of all forces."""
    system = ContactSystem(
        beam(5), normal=RoughSurface(3e6, R, 40.0), ground=Ground(speed=0.01),
        friction=ExponentialFriction(0.8, 0.55, 1e3), load=Load(14.0),
        drive=Drive(stiffness_x=1e4, damping_x=2.0, amplitude_x=1e-4, frequency_hz=30.0 / TURN))
    model = Model(system)
    rng = np.random.default_rng(7)
    t, y = 0.05, rng.standard_normal(16) * np.repeat([1e-6, 1e-3], 8)
    mass = 7850.0 * 0.2 * 0.02 * 0.01
    body = np.array([model.node(j, t, y)[:2] for j in range(5)])
    w_B, v_B = model.T[0] @ y[:8], model.T[0] @ y[8:]
    spring = 1e4 * (w_B[0] - 1e-4 * np.sin(30.0 * 0.05)) + 2.0 * v_B[0]
    rhs = system.rhs(t, y)[8:] * np.sqrt(mass)
    assert rhs[0] == pytest.approx(-body[:, 1].sum() - spring, rel=1e-9)
    assert rhs[1] == pytest.approx(body[:, 0].sum() - 14.0, rel=1e-9)
    # Moments about the centre (0.1, 0.01); contact forces act at y = 0.
    inertia = 7850.0 * 0.01 * 0.2 * 0.02 * (0.2**2 + 0.02**2) / 12.0
    moment = ((system.basis.contact_x - 0.1) @ body[:, 0] - 0.01 * body[:, 1].sum())
    assert system.rhs(t, y)[10] * np.sqrt(inertia) == pytest.approx(moment, rel=1e-9)


def test_share_follows_tributary_length():
    system = ContactSystem(beam("all"), normal=RoughSurface(3e6, R, 40.0),
                           friction=ExponentialFriction(0.8, 0.55, 1e3))
    assert system.share.sum() == pytest.approx(1.0, rel=1e-14)
    assert system.arrays.normal_parameters[:, 0].sum() == pytest.approx(3e6, rel=1e-13)
    assert system.arrays.normal_parameters[:, 2].sum() == pytest.approx(40.0, rel=1e-13)
    assert (system.arrays.normal_parameters[:, 1] == R).all()


# Parameters and copies ---------------------------------------------------------------------------

def test_parameters_by_their_dotted_names():
    system = random_system()
    values = system.parameters()
    assert values["ground.speed"] == 1e-3
    assert values["ground.amplitude"] == 20e-6
    assert values["ground.wavelength"] == 2.5e-3
    assert values["drive.frequency_hz"] == 13.8 / TURN
    assert (values["drive.amplitude_x"], values["drive.amplitude_y"]) == (0.5e-3, -0.47e-3)
    assert (values["drive.stiffness_x"], values["drive.stiffness_y"]) == (5610.0, 99.0)
    assert (values["drive.damping_x"], values["drive.damping_y"]) == (0.768, 0.02)
    assert values["load.normal"] == 14.0
    assert (values["normal.stiffness"], values["normal.roughness_height"]) == (1e6, R)
    assert values["normal.damping"] == 40.0
    assert (values["friction.static_coefficient"], values["friction.kinetic_coefficient"]) == (
        0.8, 0.55)
    assert (values["friction.decay"], values["friction.smoothing_slope"]) == (1000.0, 1e6)


_OTHER = {"arctan": "tanh", "surface": "vertical", "absolute": "relative"}


def test_every_parameter_changes_the_motion_and_only_in_the_copy():
    system = random_system()
    y = state_with(system, 0.3, np.array([0.4, 2.0, 0.9]) * R, np.array([0.001, 0.002, 0.0]),
                   np.array([1e-3, 2e-5, -1e-3]))
    before = system.rhs(0.3, y)
    for name, value in system.parameters().items():
        other = _OTHER[value] if isinstance(value, str) else 1.01 * value or 0.01
        changed = system.with_(**{name: other})
        assert changed.parameters()[name] == other
        assert system.parameters()[name] == value
        difference = np.abs(changed.rhs(0.3, y) - before).max()
        assert difference > 1e-9, name
        if name in ("friction.smoothing", "friction.viscous_coefficient"):
            continue  # the model written out for tests has the source's law alone
        expected = Model(changed).rhs(0.3, y)
        assert changed.rhs(0.3, y) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    assert (system.rhs(0.3, y) == before).all()


def test_copies_with_several_changes():
    system = random_system()
    copy = system.with_(**{"ground.speed": 0.5, "ground.amplitude": 0.0, "gap": (0.0, 1e-6, 0.0),
                           "load.normal": 3.0})
    assert copy.ground == Ground(0.5, 0.0, 2.5e-3)
    assert copy.gap == (0.0, 1e-6, 0.0)
    assert copy.load == Load(3.0)
    assert copy.friction is system.friction
    assert copy.basis is system.basis
    whole = system.with_(ground=Ground(speed=0.1), drive=Drive())
    assert whole.ground == Ground(speed=0.1)
    assert whole.drive == Drive()
    same = system.with_()
    assert type(same) is ContactSystem
    assert (same.ground, same.drive, same.gap) == (system.ground, system.drive, system.gap)


@pytest.mark.parametrize("order", [1, -1])
def test_a_part_and_one_of_its_parameters(order):
    """Both count, in whichever order they are given."""
    changes = [("ground", Ground(speed=0.1, amplitude=1e-5)), ("ground.wavelength", 0.07)][::order]
    copy = random_system().with_(**dict(changes))
    assert copy.ground == Ground(0.1, 1e-5, 0.07)


def test_another_basis_and_values_for_its_nodes():
    system = random_system(normal=RoughSurface((1e6, 2e6, 3e6), R), gap=(0.0, 1e-6, 2e-6))
    copy = system.with_(**{"basis": random_basis(2, 4), "normal.stiffness": (1e6, 2e6), "gap": 0.0})
    assert copy.arrays.normal_parameters[:, 0].tolist() == [1e6, 2e6]


def test_systems_cannot_be_changed():
    with pytest.raises(AttributeError):
        random_system().load = Load(1.0)


@pytest.mark.parametrize(("name", "value", "message"), [
    ("friction.static_coeficient", 0.7, "did you mean 'friction.static_coefficient'"),
    ("speed", 1.0, "no parameter 'speed'"), ("ground.", 1.0, "no parameter 'ground.'"),
    ("gap.x", 1.0, "no parameter 'gap.x'"), ("basis.T", 1.0, "no parameter 'basis.T'"),
    ("ground.speed", float("nan"), "Ground: speed = nan"),
    ("normal.stiffness", (1.0, 2.0), "stiffness has 2 values for 3 contact nodes"),
    ("friction.decay", (1.0, 2.0), "decay has 2 values for 3 contact nodes"),
    ("gap", (1.0, 2.0), "gap has 2 values for 3 contact nodes"),
    ("gap", -1e-6, "gap = -1e-06 must be finite and zero or above"),
    ("gap", float("nan"), "gap = nan"),
    ("gap", "wide", "gap = 'wide' must be a number"),
    ("ground", 0.1, "ground = 0.1 must be a Ground"), ("basis", None, "basis = None"),
    ("normal", Ground(), "must be a NormalLaw"), ("load", Drive(), "must be a Load"),
    ("normal", ExponentialFriction(0.8, 0.55, 1e3), "must be a NormalLaw"),
    ("friction", RoughSurface(1e6, R), "must be a FrictionLaw"), ("drive", Load(), "a Drive"),
])
def test_changes_are_checked(name, value, message):
    with pytest.raises(InputError, match=message):
        random_system().with_(**{name: value})


def test_states_of_another_size_are_refused():
    system = random_system()
    for size in (0, 5, 19, 21):
        for function in (system.rhs, system.jacobian):
            with pytest.raises(InputError, match="20 values"):
                function(0.0, np.zeros(size))
    with pytest.raises(InputError, match="20"):
        system.contact_history(np.zeros(2), np.zeros((2, 19)))
    with pytest.raises(InputError, match="2 times"):
        system.contact_history(np.zeros(2), np.zeros((3, 20)))


def test_states_of_other_layout_and_type():
    system = random_system()
    y = state_with(system, 0.0, np.array([0.4, 2.0, 0.9]) * R, np.zeros(3), np.full(3, 1e-3))
    expected = system.rhs(0.0, y)
    assert (system.rhs(0, np.repeat(y, 2)[::2]) == expected).all()
    assert (system.rhs(0, y.tolist()) == expected).all()
    assert (system.jacobian(0, np.repeat(y, 2)[::2]) == system.jacobian(0.0, y)).all()
    assert np.isfinite(system.rhs(0, np.zeros(20, dtype=int))).all()
    many = np.column_stack([y, y]).T
    assert (system.contact_history([0.0, 0.0], many[:, :])[0] ==
            system.contact_history(np.zeros(1), y[None])[0]).all()


def test_contact_of_one_state_is_that_of_a_history():
    system = random_system()
    states = np.random.default_rng(4).standard_normal((3, system.size)) * 1e-5
    times = np.array([0.0, 0.2, 0.7])
    history = system.contact_history(times, states)
    assert history.any()
    for k in range(3):
        assert contact_at(times[k], states[k], system.arrays) == pytest.approx(
            history[k], rel=1e-12)
