"""Equilibria, complex modes, stability maps: closed forms, and a run in time."""

import numpy as np
import pytest
from oscillators import one_mode
from systems import (
    TURN,
    belt,
    friction_slope,
    lorenz_field,
    mode_coupling,
    two_mass_field,
    two_mass_jacobian,
)

from fecontact import (
    AnalysisError,
    ContactSystem,
    Drive,
    ElasticBody,
    Ground,
    InputError,
    Load,
    Material,
    Mesh,
    basis_from_matrices,
    modal_basis,
    sensitivity,
    simulate,
)
from fecontact.bifurcation import (
    contact_field,
    equilibrium_branch,
    find_equilibrium,
    stability_map,
    vector_field,
)
from fecontact.laws import (
    Constant,
    ConstantFriction,
    DahlFriction,
    LinearContact,
    PrescribedForce,
    RoughSurface,
)

MU = "friction.friction_coefficient"


def test_lorenz_equilibria():
    field = lorenz_field()
    found = find_equilibrium(field, {"rho": 20.0}, start=[5.0, 5.0, 15.0])
    root = np.sqrt(19.0 * 8.0 / 3.0)
    assert found.state == pytest.approx([root, root, 19.0], rel=1e-13)
    assert found.stable
    assert found.eigenvalues.sum().real == pytest.approx(-10.0 - 1.0 - 8.0 / 3.0, rel=1e-13)
    origin = find_equilibrium(field, {"rho": 20.0})
    assert origin.unstable_directions == 1
    # (l + b) [(l + sigma) (l + 1) - sigma rho] = 0
    expected = [0.5 * (-11.0 + np.sqrt(81.0 + 40.0 * 20.0)), -8.0 / 3.0,
                0.5 * (-11.0 - np.sqrt(81.0 + 40.0 * 20.0))]
    assert origin.eigenvalues.real == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("B", "speed"), [(1.0, 1.0), (2.5, 1.0), (9.0, 1.3)])
def test_two_masses_have_the_eigenvalues_of_the_equations(B, speed):
    found = find_equilibrium(two_mass_field(B, speed))
    expected = np.linalg.eigvals(two_mass_jacobian(B, speed))
    assert np.sort_complex(found.eigenvalues) == pytest.approx(np.sort_complex(expected),
                                                               abs=1e-12)
    modes = found.modes
    pairs = np.sort_complex(expected[expected.imag > 0.0])
    order = np.argsort(pairs.imag)
    assert modes.frequencies_hz == pytest.approx(pairs.imag[order] / (2.0 * np.pi), rel=1e-12)
    assert modes.damping_ratios == pytest.approx(-pairs.real[order] / np.abs(pairs[order]),
                                                 abs=1e-12)
    assert modes.growing().size == int((pairs.real > 0.0).sum())
    # Both springs carry the friction forces B mu.
    T = found.field.system().basis.contact_T[:, 0]
    force = B * 0.14 * (1.0 + 1.14 * np.exp(-2.0 * speed)) * np.arctan(100.0 * speed)
    stiffness = np.array([[3.0, -1.0], [-1.0, 1.0]])
    assert stiffness @ (T @ found.state[:2]) == pytest.approx([force, force], rel=1e-12)


def test_mode_coupling_flutter():
    """M = I, K = [[2, 1 - 4 mu / 3], [1, 2]]: l^2 = -2 +- sqrt(1 - 4 mu / 3)."""
    field = contact_field(mode_coupling(), ["friction.friction_coefficient"])
    for mu in (0.2, 0.5, 0.74, 0.76, 0.9):
        modes = find_equilibrium(field, {"friction.friction_coefficient": mu}).modes
        root = np.emath.sqrt(1.0 - 4.0 * mu / 3.0)
        expected = np.sqrt(-2.0 + np.array([root, -root]) + 0j)
        growth = np.abs(expected.real).max()
        assert (modes.damping_ratios * np.abs(modes.eigenvalues)).min() == pytest.approx(
            -growth, abs=1e-7)
        assert np.sort(2.0 * np.pi * modes.frequencies_hz) == pytest.approx(
            np.sort(np.abs(expected.imag)), rel=1e-7)
        assert bool(modes.damping_ratios.min() < -1e-6) == (mu > 0.75)
    shape = modes.displacement(field.system().basis, 0)
    assert shape.shape == (3, 3)
    assert shape[2, 0] == pytest.approx(modes.right[:2, 0] @ field.system().basis.T[2, 0])


def damped_coupling(mu=0.9, **changes):
    """Mode coupling with springs and dashpots between the mass and the ground in x and y."""
    row = np.eye(3, 2)
    mass = basis_from_matrices(np.eye(2), [[2.0, 1.0], [1.0, 2.0 / 3.0]],
                               {"contact": row[None], "B": row, "C": row})
    system = ContactSystem(mass, normal=LinearContact(4.0 / 3.0),
                           friction=ConstantFriction(mu, 1e9), ground=Ground(speed=-100.0),
                           load=Load(1.0))
    return system.with_(**changes)


def test_flutter_over_both_dashpots():
    """Equal dashpots d: flutter from mu = 3 (1 + 2 d^2) / 4 on; the map of both is symmetric."""
    names = ("drive.damping_x", "drive.damping_y")
    for d, onset in ((0.1, 0.765), (0.05, 0.75375)):
        field = contact_field(damped_coupling(**dict.fromkeys(names, d)), [MU, names[0]])
        found = stability_map(field, {MU: [onset - 1e-6, onset + 1e-6], names[0]: [d]})
        assert found.unstable[:, 0].tolist() == [0, 2]
        assert found.frequency_hz[:, 0] * 2.0 * np.pi == pytest.approx(np.sqrt(2.0), rel=1e-6)
    d = np.linspace(0.0, 0.6, 13)
    system = damped_coupling(0.8)
    found = stability_map(contact_field(system, names), {names[0]: d, names[1]: d})
    assert found.growth_rate == pytest.approx(found.growth_rate.T, abs=1e-12)
    assert 0.1 < (found.unstable > 0).mean() < 0.9
    # Damping of one direction alone does not move the onset, by Routh's criterion.
    field = contact_field(damped_coupling(), [MU, names[0]])
    found = stability_map(field, {MU: [0.75 - 1e-4, 0.75 + 1e-4], names[0]: d[1:]})
    assert (found.unstable == [[0], [2]]).all()


def test_maps_leave_out_modes_beyond_a_frequency():
    """Two oscillators of 1 and 10 rad/s, the fast one growing by r / 2, the slow one decaying."""
    def oscillators(t, x, p, out):
        out[0], out[2] = x[1], x[3]
        out[1] = -x[0] - 0.1 * x[1]
        out[3] = -100.0 * x[2] + p[0] * x[3] + 0.0 * p[1]

    field = vector_field(oscillators, {"r": 0.2, "s": 0.0}, 4)
    grid = {"r": [0.2, 0.4], "s": [0.0]}
    whole = stability_map(field, grid)
    assert whole.growth_rate[:, 0] == pytest.approx([0.1, 0.2])
    assert (whole.unstable == 2).all()
    usable = stability_map(field, grid, highest_hz=1.0)
    assert usable.growth_rate[:, 0] == pytest.approx([-0.05, -0.05])
    assert usable.frequency_hz[:, 0] == pytest.approx(0.5 / np.pi * np.sqrt(1.0 - 0.05**2))
    assert (usable.unstable == 0).all()
    with pytest.raises(InputError, match="leaves out all modes"):
        stability_map(field, grid, highest_hz=1e-3)


def test_maps_over_numbers_of_the_basis():
    """The entries of the modal damping matrix and the ratios are parameters as others are."""
    system = damped_coupling(0.8)
    K = np.array([[2.0, 1.0 - 4.0 * 0.8 / 3.0], [1.0, 2.0]])
    T = system.basis.contact_T[0, :2]
    a, b = np.array([0.0, 0.1, 0.3]), np.array([-0.1, 0.0, 0.2])
    names = ("basis.damping.0.0", "basis.damping.1.0")
    found = stability_map(contact_field(system, names), dict(zip(names, (a, b), strict=True)))
    for i, j in np.ndindex(3, 3):
        C = T @ np.array([[a[i], 0.0], [b[j], 0.0]]) @ T.T
        expected = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]]))
        assert found.growth_rate[i, j] == pytest.approx(expected.real.max(), abs=1e-8)
    w = system.basis.angular_frequencies
    ratio = system.with_(**{"basis.damping_ratios.1": 0.02})
    assert np.diag(ratio.basis.damping) == pytest.approx([0.0, 0.04 * w[1]], rel=1e-14)
    assert ratio.parameter("basis.damping_ratios.1") == pytest.approx(0.02, rel=1e-14)
    assert system.with_(**{"basis.stiffness.0.1": 0.5}).arrays.stiffness[0, 1] == 0.5
    assert sensitivity(system, 1.0, initial=np.ones(4), parameter="basis.damping.0.0").forced.any()
    for name, words in (("basis.damping.0", "numbers of the basis are"),
                        ("basis.damping.0.2", "the basis has 2 modes"),
                        ("basis.modes", "numbers of the basis are")):
        with pytest.raises(InputError, match=words):
            contact_field(system, [name])
    with pytest.raises(InputError, match=r"damping_ratios\.0 = -0\.1 must be zero or above"):
        system.with_(**{"basis.damping_ratios.0": -0.1})


def beam(mu=0.55):
    """A free steel beam on a belt, with the contact of section 4's friction oscillator."""
    mesh = Mesh.grid(np.linspace(0.0, 0.2, 40), np.linspace(0.0, 0.02, 5))
    body = ElasticBody(mesh, Material.named("steel"), 0.01)
    basis = modal_basis(body, 20, contact="bottom", contact_nodes=40, B=(0.0, 0.01), C=(0.1, 0.02),
                        damping=0.01)
    return ContactSystem(
        basis, normal=RoughSurface(10e6, 10e-6, 40.0), friction=ConstantFriction(mu, 1e6),
        ground=Ground(speed=0.01), load=Load(14.0),
        drive=Drive(stiffness_x=5610.0, damping_x=0.768, motion_x=Constant(-9.5 / 5610.0)))


def test_flutter_of_a_beam_on_a_belt():
    """With constant friction: none at 0.2, at 0.55 growth as the motion in time shows it."""
    system = beam()
    field = contact_field(system, ["friction.friction_coefficient"])
    assert find_equilibrium(field, {"friction.friction_coefficient": 0.2}).stable
    found = find_equilibrium(field)
    modes = found.modes
    k = int(np.argmin(modes.damping_ratios))
    assert modes.growing() == pytest.approx([645.6], abs=0.1)
    growth = modes.eigenvalues[k]
    shape, m = modes.right[:, k], system.basis.modes
    size = 1e-9 / np.abs(system.basis.contact_T[:, 1] @ shape[:m]).max()
    run = simulate(system, 0.02, initial=found.state + size * shape.real, outputs=81, rtol=1e-9)
    moved = (run.modal_coordinates - found.state[:m]) @ system.basis.T_matrix.T
    expected = size * (np.exp(growth * run.time)[:, None] * shape[:m]).real @ (
        system.basis.T_matrix.T)
    assert np.abs(moved - expected).max() < 1e-3 * np.abs(expected).max()


def test_stability_map_of_two_masses():
    """The border is B mu'(v) = const, where the Jacobian of the equations has it."""
    B, speed = np.linspace(0.5, 9.0, 18), np.linspace(0.8, 2.0, 13)
    found = stability_map(two_mass_field(), {"B": B, "ground.speed": speed})
    for i in range(len(B)):
        for j in range(len(speed)):
            expected = np.linalg.eigvals(two_mass_jacobian(B[i], speed[j]))
            assert found.growth_rate[i, j] == pytest.approx(expected.real.max(), abs=1e-11)
            assert found.unstable[i, j] == (expected.real > 0.0).sum()
            critical = expected[np.argmax(expected.real)]
            assert found.frequency_hz[i, j] == pytest.approx(abs(critical.imag) / (2.0 * np.pi),
                                                             rel=1e-9)
    product = np.multiply.outer(B, friction_slope(speed))
    stable = found.unstable == 0
    assert product[stable].min() > product[~stable].max()


def test_map_has_gaps_where_there_is_no_equilibrium():
    def fold(t, x, p, out):
        out[0] = p[0] - x[0] * x[0] + p[1]

    field = vector_field(fold, {"a": 1.0, "b": 0.0}, 1)
    found = stability_map(field, {"a": [1.0, 0.5, -0.5], "b": [0.0, 0.25]}, start=[1.0])
    assert found.unstable.tolist() == [[0, 0], [0, 0], [-1, -1]]
    assert np.isnan(found.critical[2]).all()
    assert found.states[:2, :, 0] == pytest.approx(np.sqrt([[1.0, 1.25], [0.5, 0.75]]), rel=1e-9)
    assert found.growth_rate[:2] == pytest.approx(-2.0 * found.states[:2, :, 0])


def test_map_follows_the_equilibrium_along_both_parameters():
    """sin(x - a - b) has many; the map stays with the one it began with."""
    def waves(t, x, p, out):
        out[0] = -np.sin(x[0] - p[0] - p[1])

    field = vector_field(waves, {"a": 0.0, "b": 0.0}, 1)
    a, b = np.linspace(0.0, 12.0, 25), np.linspace(0.0, 9.0, 19)
    found = stability_map(field, {"a": a, "b": b})
    assert found.states[..., 0] == pytest.approx(np.add.outer(a, b), abs=1e-9)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_bristles_that_come_to_their_limit_ever_more_slowly_have_an_equilibrium(exponent):
    """Where the exponent is not one, nothing in the linear motion holds the deflection there."""
    mu, sigma, force, stiffness = 0.5, 1e4, 10.0, 700.0
    system = ContactSystem(
        one_mode(), normal=PrescribedForce(force), friction=DahlFriction(mu, sigma, exponent),
        ground=Ground(speed=0.05), drive=Drive(stiffness_x=stiffness, damping_x=1.0))
    found = find_equilibrium(contact_field(system, ["ground.speed"]))
    assert found.state == pytest.approx([mu * force / stiffness, 0.0, -mu / sigma], rel=1e-9)
    assert found.eigenvalues.real.max() == pytest.approx(0.0 if exponent > 1.0 else -0.5, abs=1e-9)


def test_kind_errors():
    def nothing(t, x, p, out):
        out[0] = 1.0 + p[0] * x[0] * x[0]

    field = vector_field(nothing, {"a": 1.0}, 1)
    with pytest.raises(AnalysisError, match=r"No equilibrium was found for a = 1 .* give a start"):
        find_equilibrium(field, start=[0.3])
    with pytest.raises(InputError, match="must have 1 values"):
        find_equilibrium(field, start=[0.3, 1.0])
    with pytest.raises(InputError, match=r"holds nan \(value 0 of 1\); every value must be finite"):
        find_equilibrium(field, start=[np.nan])
    with pytest.raises(InputError, match="direction = 0 must be above zero, to go forward"):
        equilibrium_branch(field, [0.3], direction=0)
    driven = belt().with_(**{"drive.amplitude_x": 1e-3, "drive.frequency_hz": 10.0 / TURN})
    with pytest.raises(AnalysisError, match=r"driven with the period 0\.628319 s"):
        find_equilibrium(contact_field(driven, []))
    free = belt().with_(drive=Drive())
    with pytest.raises(AnalysisError, match="nothing holds the body against a translation along"):
        find_equilibrium(contact_field(free, []))
    with pytest.raises(InputError, match="over two parameters, not 1"):
        stability_map(field, {"a": [1.0]})
    with pytest.raises(InputError, match=r"did you mean 'ground\.speed'"):
        stability_map(two_mass_field(), {"B": [1.0], "ground.sped": [1.0]})
