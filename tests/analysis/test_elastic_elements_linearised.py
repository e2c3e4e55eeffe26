"""Small motions about states of elastic Coulomb elements, against characteristic polynomials."""

import numpy as np
import pytest
from systems import mode_coupling

import fecontact as fc
from fecontact.analysis import complex_modes, receptance
from fecontact.laws import IwanFriction, JenkinsFriction, PrescribedForce

SPRING, DASHPOT, STIFFNESS, LIMIT, SPEED = 4.0, 0.3, 5.0, 0.2, 0.7
LAWS = {"jenkins": JenkinsFriction(STIFFNESS, LIMIT),
        "iwan": IwanFriction(STIFFNESS, LIMIT, elements=3)}
CASES = [(law, linearised_at) for law in LAWS.values() for linearised_at in ("sliding", "rest")]


def on_belt(law, components=1, **ground):
    """A mass of 1 kg on a spring and a dashpot in each direction, pressed on a belt by 1 N."""
    row = np.eye(3)[:, :components]
    basis = fc.basis_from_matrices(
        np.eye(components), SPRING * np.eye(components), {"contact": row[None], "B": row},
        damping=DASHPOT * np.eye(components), dimension=components + 1)
    return fc.ContactSystem(basis, normal=PrescribedForce(1.0), friction=law,
                            ground=fc.Ground(speed=SPEED, **ground))


def upper(polynomial):
    roots = np.roots(polynomial)
    return roots[roots.imag > 0.0]


@pytest.mark.parametrize(("law", "linearised_at"), CASES)
def test_mode_of_a_mass(law, linearised_at):
    """A constant force in slip, a spring more in stick: l^2 + d l + c = 0."""
    spring = SPRING + (STIFFNESS if linearised_at == "rest" else 0.0)
    modes = complex_modes(on_belt(law), linearised_at)
    assert modes.eigenvalues == pytest.approx(upper([1.0, DASHPOT, spring]), rel=1e-9)
    assert len(modes.real_eigenvalues) == 0
    assert modes.left.T @ modes.right == pytest.approx(np.eye(1))


@pytest.mark.parametrize(("law", "linearised_at"), CASES)
def test_receptance_of_a_mass(law, linearised_at):
    """H = 1 / (c - w^2 + i w d), at frequency zero too."""
    spring = SPRING + (STIFFNESS if linearised_at == "rest" else 0.0)
    f = np.array([0.0, 0.1, 0.5])
    w = 2.0 * np.pi * f
    found = receptance(on_belt(law), f, [("B", "x")], linearised_at=linearised_at)
    assert found.values[:, 0, 0] == pytest.approx(
        1.0 / (spring - w**2 + 1j * w * DASHPOT), rel=1e-9)
    assert found.stable


def test_friction_follows_the_normal_force_in_slip():
    """Hoffmann's model of flutter: l^2 = -2 +- sqrt(1 - 4 mu / 3)."""
    for mu in (0.4, 0.9):
        system = mode_coupling().with_(friction=JenkinsFriction(50.0, mu))
        modes = complex_modes(system, "sliding")
        root = np.sqrt(complex(1.0 - 4.0 * mu / 3.0))
        expected = np.sqrt(np.array([-2.0 + root, -2.0 - root]))
        expected = np.where(expected.imag > 0.0, expected, -expected)
        assert modes.eigenvalues == pytest.approx(
            expected[np.lexsort((-expected.real, np.round(expected.imag, 9)))], abs=1e-9)
        assert len(modes.real_eigenvalues) == 0
        assert modes.grows.any() == (mu > 0.75)


def test_direction_of_slip_turns_in_space():
    """Across the slip, y'' + d y' + c y + k z = 0 and z' = y' - (V / l) z."""
    rate = SPEED / (LIMIT / STIFFNESS)
    polynomial = np.polymul([1.0, DASHPOT, SPRING], [1.0, rate])
    across = np.roots(np.polyadd(polynomial, [STIFFNESS, 0.0]))
    modes = complex_modes(on_belt(LAWS["jenkins"], 2), "sliding")
    expected = np.append(upper([1.0, DASHPOT, SPRING]), across[across.imag > 0.0])
    assert np.sort(modes.eigenvalues) == pytest.approx(np.sort(expected), rel=1e-6)
    assert modes.real_eigenvalues == pytest.approx(across[across.imag == 0.0].real, rel=1e-6)
    w = np.array([0.0, 1.0, 30.0])
    found = receptance(on_belt(LAWS["jenkins"], 2), w / (2.0 * np.pi), [("B", "x"), ("B", "y")],
                       linearised_at="sliding").values
    dynamic = SPRING - w**2 + 1j * w * DASHPOT
    assert found[:, 0, 0] == pytest.approx(1.0 / dynamic, rel=1e-6)
    assert found[:, 1, 1] == pytest.approx(
        1.0 / (dynamic + STIFFNESS * 1j * w / (1j * w + rate)), rel=1e-6)
