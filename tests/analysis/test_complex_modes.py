"""Complex modes against closed forms: eigenvalues, left and right eigenvectors, sensitivities."""

import numpy as np
import pytest
from systems import mode_coupling, rotor

from fecontact import InputError, basis_from_matrices
from fecontact.analysis import ComplexModes, complex_modes
from fecontact.bifurcation import contact_field, find_equilibrium

MU = "friction.friction_coefficient"


def test_jeffcott_rotor_whirls_from_300_on():
    """With z = x + i y: l^2 + 3 l + 1e4 - i speed = 0; unstable above 100 (2 + 1) / 1."""
    for speed in (0.0, 150.0, 299.9, 300.1, 600.0):
        modes = complex_modes(rotor(speed))
        expected = np.roots([1.0, 3.0, 1e4 - 1j * speed])
        expected = np.where(expected.imag > 0.0, expected, expected.conj())
        assert np.sort(modes.eigenvalues.real) == pytest.approx(np.sort(expected.real), rel=1e-9)
        assert (len(modes.growing()) == 1) == (speed > 300.0)
    # The growing mode is a forward circle: y follows x by a quarter of a period.
    modes = complex_modes(rotor(600.0))
    x, y = modes.displacement(rotor(600.0), int(np.argmin(modes.damping_ratios)))[2, :2]
    assert y / x == pytest.approx(-1j, abs=1e-9)


def test_gyroscopic_frequencies():
    """x'' - g y' + w^2 x = 0, y'' + g x' + w^2 y = 0: sqrt(w^2 + g^2/4) -+ g/2."""
    row = np.zeros((3, 2))
    row[0, 0] = row[1, 1] = 1.0
    basis = basis_from_matrices(np.eye(2), 9.0 * np.eye(2), {"contact": row[None]},
                                damping=[[0.0, -8.0], [8.0, 0.0]])
    assert "full matrix, in part gyroscopic" in str(basis)
    modes = complex_modes(basis)
    assert 2.0 * np.pi * modes.frequencies_hz == pytest.approx([1.0, 9.0], rel=1e-12)
    assert modes.damping_ratios == pytest.approx([0.0, 0.0], abs=1e-13)
    assert not modes.grows.any()


def test_left_eigenvectors_are_biorthonormal():
    rng = np.random.default_rng(3)
    A = rng.standard_normal((9, 9))
    modes = ComplexModes.of(A)
    assert modes.left.T @ modes.right == pytest.approx(np.eye(len(modes.eigenvalues)), abs=1e-12)
    assert pytest.approx(modes.eigenvalues[:, None] * modes.left.T, abs=1e-12) == modes.left.T @ A
    assert A @ modes.right == pytest.approx(modes.eigenvalues * modes.right, abs=1e-12)
    assert 2 * len(modes.eigenvalues) + len(modes.real_eigenvalues) == 9
    change = rng.standard_normal((9, 9))
    above, below = (ComplexModes.of(A + h * change).eigenvalues for h in (1e-6, -1e-6))
    assert modes.sensitivity(change) == pytest.approx((above - below) / 2e-6, rel=1e-6)
    with pytest.raises(InputError, match=r"shape \(9, 9\), not \(2, 2\)"):
        modes.sensitivity(np.eye(2))
    with pytest.raises(InputError, match=r"square matrix of finite numbers, .* \(2, 3\)"):
        ComplexModes.of(np.zeros((2, 3)))


def test_repeated_eigenvalues():
    """Both planes of a rotor at rest vibrate alike."""
    modes = complex_modes(rotor(0.0))
    assert modes.left.T @ modes.right == pytest.approx(np.eye(2), abs=1e-10)


def test_slopes_of_flutter():
    """l^2 = -2 +- root, root = sqrt(1 - 4 mu / 3), so that dl/dmu = -+ 1 / (3 l root)."""
    for mu in (0.4, 0.7, 0.9):
        equilibrium = find_equilibrium(contact_field(mode_coupling(), [MU]), {MU: mu})
        slopes, modes = equilibrium.eigenvalue_slopes(MU), equilibrium.modes
        root = modes.eigenvalues**2 + 2.0
        assert root**2 == pytest.approx(np.full(2, 1.0 - 4.0 * mu / 3.0), abs=1e-9)
        assert slopes == pytest.approx(-1.0 / (3.0 * modes.eigenvalues * root), rel=1e-7)


def test_modes_coincide_at_the_onset_of_flutter():
    """The closer to mu = 3/4, the worse conditioned: left and right shapes become orthogonal."""
    field = contact_field(mode_coupling(), [MU])
    near, nearer = (find_equilibrium(field, {MU: 0.75 - gap}).modes.condition.max()
                    for gap in (1e-3, 1e-5))
    assert nearer / near == pytest.approx(10.0, rel=0.01)
    block = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.array([[2.0, 0.0], [1.0, 2.0]]),
                                                      np.zeros((2, 2))]])
    assert ComplexModes.of(block).condition.min() > 1e6


def test_linearised_contact():
    """The function takes the same Jacobian as the equilibrium of the field."""
    system = mode_coupling(0.1, 0.9)
    modes = complex_modes(system, "sliding")
    expected = find_equilibrium(contact_field(system, [MU])).modes
    assert modes.eigenvalues == pytest.approx(expected.eigenvalues, rel=1e-9)
    free = complex_modes(system).eigenvalues.imag
    K = np.array([[2.0, 1.0], [1.0, 2.0 / 3.0]])
    assert free == pytest.approx(np.sqrt(np.linalg.eigvalsh(K) - 0.05**2), rel=1e-9)
    with pytest.raises(InputError, match="A modal basis has no contact"):
        complex_modes(system.basis, "sliding")


def test_fast_decays_hide_no_frequencies():
    """Oscillators of 1 ... 1e6 rad/s and a rigid motion beside rates of -1e12: sliders at rest."""
    w = np.array([0.0, 1.0, 7.0, 1e3, 1e6])
    A = np.zeros((13, 13))
    A[:5, 5:10], A[5:10, :5], A[10:, 10:] = np.eye(5), -np.diag(w**2), -1e12 * np.eye(3)
    found = ComplexModes.of(A, zero=1e-7)
    assert found.frequencies_hz == pytest.approx(w[1:] / (2.0 * np.pi), rel=1e-9)
    assert len(found.real_eigenvalues) == 5
