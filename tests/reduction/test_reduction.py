"""Residual vectors and Craig-Bampton against the full finite-element body."""

from functools import partial

import numpy as np
import pytest
import scipy.sparse as sp
from meshes_for_tests import rectangle

import fecontact
from fecontact import ElasticBody, InputError
from fecontact.io import read_basis, write_basis
from fecontact.reduction import BasisReport, eigenfrequencies_hz
from fecontact.reduction.eigenmodes import FreeSystem
from fecontact.reduction.solvers.factorisation import SymmetricFactors
from fecontact.reduction.static_modes.craig_bampton import craig_bampton
from fecontact.reduction.static_modes.flexibility import Flexibility

modal_basis = partial(fecontact.modal_basis, contact="bottom")

SUPPORTS = [{}, {"left": "xy"}, {"B": "xy"}, {"left": "x"}]


def beam(fixed=None, **kwargs):
    mesh = rectangle(0.2, 0.02, 24, 4, points={"B": (0.0, 0.01), "C": (0.1, 0.02)})
    return ElasticBody(mesh, thickness=0.01, fixed=fixed or {}, **kwargs)


def elastic_flexibility(body):
    """P^T K^+ P by dense algebra, P taking out what accelerates the body as a whole."""
    system = FreeSystem.of(body)
    K, M, R = system.stiffness.toarray(), system.mass.toarray(), system.rigid
    project = np.eye(len(K)) - (M @ R) @ R.T
    values, vectors = np.linalg.eigh(K)
    keep = slice(R.shape[1], None)
    inverse = (vectors[:, keep] / values[keep]) @ vectors[:, keep].T
    return project.T @ inverse @ project


def loaded_rows(body, basis):
    rows = basis.mode_shapes.restriction[np.arange(basis.mode_shapes.restriction.shape[0]) % 3 < 2]
    return sp.csr_array(rows @ body.expansion)


@pytest.mark.parametrize("fixed", SUPPORTS)
@pytest.mark.parametrize("nodes", [7, "all"])
def test_flexibility_is_the_inverse_of_the_stiffness_beside_rigid_motion(fixed, nodes):
    body = beam(fixed)
    rows = loaded_rows(body, modal_basis(body, 5, contact_nodes=nodes))
    exact = elastic_flexibility(body)
    flexibility = Flexibility(FreeSystem.of(body), rows)
    whole = rows @ (rows @ exact).T
    assert np.abs(flexibility.compliance - whole).max() < 1e-9 * np.abs(whole).max()
    patterns = np.random.default_rng(1).standard_normal((rows.shape[0], 4))
    deflections = exact @ (rows.T @ patterns)
    assert np.abs(flexibility.deflections(patterns) - deflections).max() < (
        1e-8 * np.abs(deflections).max())


def test_substitutions_solve_the_factorised_system():
    system = FreeSystem.of(beam({"left": "xy"}))
    factors = SymmetricFactors(system.factors)
    rng = np.random.default_rng(2)
    rows = sp.random_array((130, system.stiffness.shape[0]), density=0.01, rng=rng, format="csr")
    places, half = factors.forward_substitute(rows)
    exact = np.linalg.solve(system.stiffness.toarray(), rows.T.toarray())
    assert np.abs(half.T @ half - rows @ exact).max() < 1e-9 * np.abs(rows @ exact).max()
    assert np.abs(factors.back_substitute(places, half) - exact).max() < 1e-9 * np.abs(exact).max()


@pytest.mark.parametrize("fixed", SUPPORTS)
@pytest.mark.parametrize("nodes", [7, "all"])
def test_all_residual_vectors_make_static_compliance_exact(fixed, nodes):
    body = beam(fixed)
    basis = modal_basis(body, 8, contact_nodes=nodes, reduction="residual", tolerance=0.0)
    rows = loaded_rows(body, basis)
    whole = np.diag(rows @ (rows @ elastic_flexibility(body)).T).reshape(-1, 2)
    assert np.abs(basis.elastic_compliance - whole).max() < 1e-8 * whole.max()
    moving = whole > 1e-6 * whole.max()
    assert np.abs(basis.elastic_compliance[moving] / whole[moving] - 1.0).max() < 1e-8
    assert BasisReport(basis).compliance_error.max() < 1e-8
    plain = modal_basis(body, 8, contact_nodes=nodes)
    assert BasisReport(plain).contact_error.max() > 0.1


@pytest.mark.parametrize("fixed", SUPPORTS)
def test_craig_bampton_makes_static_compliance_exact(fixed):
    body = beam(fixed)
    basis = modal_basis(body, 6, contact_nodes=7, reduction="craig-bampton")
    rows = loaded_rows(body, basis)
    whole = np.diag(rows @ (rows @ elastic_flexibility(body)).T).reshape(-1, 2)
    moving = whole > 1e-6 * whole.max()
    assert np.abs(basis.elastic_compliance[moving] / whole[moving] - 1.0).max() < 1e-8


@pytest.mark.parametrize("tolerance", [0.3, 0.1, 0.03, 0.01])
def test_interface_reduction_meets_its_tolerance_and_not_by_much(tolerance):
    body = beam()
    basis = modal_basis(body, 8, contact_nodes=24, reduction="residual", tolerance=tolerance)
    error = BasisReport(basis).compliance_error
    assert error.max() <= tolerance * (1.0 + 1e-9)
    assert error.max() > 0.5 * tolerance
    assert error.min() > -1e-9
    full = modal_basis(body, 8, contact_nodes=24, reduction="residual", tolerance=0.0)
    assert basis.modes < full.modes


@pytest.mark.parametrize("reduction", ["residual", "craig-bampton"])
@pytest.mark.parametrize("fixed", SUPPORTS)
def test_completed_basis_is_orthonormal_in_mass_and_diagonal_in_stiffness(fixed, reduction):
    body = beam(fixed)
    basis = modal_basis(body, 8, contact_nodes=6, reduction=reduction, tolerance=0.0)
    shapes = basis.mode_shapes.shapes.reshape(-1, basis.modes)
    assert np.abs(shapes.T @ (body.mass @ shapes) - np.eye(basis.modes)).max() < 1e-8
    squares = basis.angular_frequencies**2
    stiffness = shapes.T @ (body.stiffness @ shapes)
    assert np.abs(stiffness - np.diag(squares)).max() < 1e-8 * squares[-1]
    np.testing.assert_allclose(basis.T.reshape(-1, basis.modes),
                               basis.mode_shapes.restriction @ shapes, atol=1e-12)
    assert np.all(np.diff(basis.angular_frequencies) >= 0.0)
    assert basis.rigid_modes == FreeSystem.of(body).rigid.shape[1]


def test_residual_vectors_leave_the_vibration_modes_as_they_are():
    body = beam()
    plain = modal_basis(body, 10, contact_nodes=6)
    full = modal_basis(body, 10, contact_nodes=6, reduction="residual", tolerance=0.0)
    np.testing.assert_allclose(full.angular_frequencies[:10], plain.angular_frequencies,
                               rtol=1e-12)
    np.testing.assert_allclose(full.T[..., :10], plain.T, rtol=0, atol=1e-9)
    # They lie above the next eigenfrequency, as Rayleigh's principle demands.
    assert full.frequencies_hz[10] > eigenfrequencies_hz(body, 11)[10]


@pytest.mark.parametrize("fixed", SUPPORTS)
def test_craig_bampton_frequencies_are_upper_bounds_that_close_in(fixed):
    body = beam(fixed)
    exact = eigenfrequencies_hz(body, 9)
    rigid = np.count_nonzero(exact == 0.0)
    errors = []
    for count in (4, 12, 30):
        basis = modal_basis(body, count, contact_nodes=4, reduction="craig-bampton")
        errors.append(basis.frequencies_hz[rigid:9] / exact[rigid:] - 1.0)
        assert errors[-1].min() > -1e-9
    assert errors[0].max() > errors[1].max() > errors[2].max()
    assert errors[2].max() < 2e-3


def test_fixed_interface_modes_are_those_of_the_body_held_at_its_interface():
    body = beam()
    rows = loaded_rows(body, modal_basis(body, 3, contact_nodes="all"))[4:]
    system = FreeSystem.of(body)
    w, _ = craig_bampton(system, rows, 20)
    held = ElasticBody(body.mesh, body.material, body.thickness, fixed={"bottom": "xy"})
    only = Flexibility(system, rows)
    # Static shapes alone: as many modes as rows, all rigid ones among them.
    alone, _ = craig_bampton(system, rows, 0)
    assert len(alone) == rows.shape[0] + 3
    assert len(w) == rows.shape[0] + 3 + 20
    assert only.compliance.shape == (rows.shape[0],) * 2
    # The lowest modes of the body on rigid supports at its face span what was added.
    exact = 2.0 * np.pi * eigenfrequencies_hz(held, 6)
    K = sp.csc_array(body.stiffness)
    from fecontact.reduction.static_modes.craig_bampton import (
        _fixed_interface_modes,
        _independent,
    )

    patterns = _independent(only)
    shapes = _fixed_interface_modes(system, rows.T @ patterns, only.deflections(patterns),
                                    patterns.T @ (rows @ system.rigid), 6)
    shapes /= np.sqrt((shapes * (body.mass @ shapes)).sum(axis=0))
    found = np.sort(np.sqrt((shapes * (K @ shapes)).sum(axis=0)))
    np.testing.assert_allclose(found, exact, rtol=1e-7)


def test_free_body_under_a_constant_force_moves_as_the_full_model():
    body = beam()
    basis = modal_basis(body, 10, contact_nodes=5, reduction="residual", tolerance=0.0)
    force = np.zeros((len(basis.T), 3))
    force[2:7, 0], force[2:7, 1] = [3.0, 1.0, 0.0, -1.0, 2.0], [1.0, 0.0, -2.0, 0.5, 1.0]
    modal = np.einsum("pam,pa->m", basis.T, force)
    rigid, elastic = np.split(np.arange(basis.modes), [3])
    w = basis.angular_frequencies[elastic]
    reduced = basis.T[:, :2, elastic] @ (modal[elastic] / w**2)
    load = body.expansion.T @ (basis.mode_shapes.restriction.T @ force.ravel())
    exact = basis.mode_shapes.restriction @ (elastic_flexibility(body) @ load)
    exact = exact.reshape(-1, 3)[:, :2]
    assert np.abs(reduced - exact).max() < 1e-8 * np.abs(exact).max()
    total = force.sum(axis=0)[:2] / basis.quality.mass
    acceleration = basis.T[:, :2, rigid] @ modal[rigid]
    angular = (acceleration[2, 1] - acceleration[6, 1]) / (basis.positions[2, 0]
                                                           - basis.positions[6, 0])
    middle = acceleration[2:7].mean(axis=0)
    assert middle[1] == pytest.approx(
        total[1] + angular * (basis.positions[2:7, 0].mean() - 0.1), rel=1e-9)


def test_craig_bampton_and_residual_vectors_agree_in_a_transient():
    """Step forces at the contact of the free beam, in closed form mode by mode."""
    body = beam()
    times = np.linspace(0.0, 3e-4, 400)
    motions = []
    for reduction, modes in (("residual", 12), ("craig-bampton", 16)):
        basis = modal_basis(body, modes, contact_nodes=5, reduction=reduction, tolerance=0.0)
        modal = basis.T[3, 1] - 0.4 * basis.T[5, 0]
        w = basis.angular_frequencies[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            history = np.where(w > 0.0, (1.0 - np.cos(w * times)) / w**2, times**2 / 2.0)
        motions.append(basis.T[2:7, :2] @ (modal[:, None] * history))
    difference = np.abs(motions[0] - motions[1]).max()
    assert difference < 5e-3 * np.abs(motions[0]).max()


def test_effective_masses_sum_to_the_body():
    basis = modal_basis(beam(), 30, contact_nodes=5)
    share = BasisReport(basis).effective_mass
    np.testing.assert_allclose(share.sum(axis=1), 1.0, rtol=1e-10)
    clamped = BasisReport(modal_basis(beam({"left": "xy"}), 1, contact_nodes=5)).effective_mass
    assert clamped[1, 0] == pytest.approx(0.613, abs=0.01)  # first mode of the cantilever
    assert basis.quality.mass == pytest.approx(0.2 * 0.02 * 0.01 * 7850.0, rel=1e-12)


def test_report_says_what_to_do():
    poor = modal_basis(beam(), 6, contact_nodes=5)
    text = str(BasisReport(poor))
    assert "is missing. Complete the modes with reduction = \"residual\"" in text
    assert "contact nodes: 5 on 'bottom'" in text
    good = modal_basis(beam(), 6, contact_nodes=5, reduction="residual", tolerance=0.02)
    assert "Static deflections of the contact nodes are right to" in str(BasisReport(good))
    assert BasisReport(good).time_step == pytest.approx(0.05 / good.frequencies_hz[-1])
    assert BasisReport(good).orthogonality < 1e-10
    assert BasisReport(good).residuals[:6].max() < 1e-12
    assert BasisReport(good).residuals[6:].min() > 1e-9


def test_damping_ratios_of_completing_modes_are_that_of_the_last_mode():
    basis = modal_basis(beam(), 5, contact_nodes=4, damping=[0.0, 0.0, 0.0, 0.01, 0.02],
                        reduction="residual", tolerance=0.0)
    np.testing.assert_allclose(basis.damping_ratios[3:5], [0.01, 0.02])
    np.testing.assert_allclose(basis.damping_ratios[5:], 0.02)


def test_quality_is_saved(tmp_path):
    basis = modal_basis(beam(), 6, contact_nodes=5, reduction="residual")
    write_basis(tmp_path / "basis.h5", basis)
    loaded = read_basis(tmp_path / "basis.h5")
    assert str(BasisReport(loaded)) == str(BasisReport(basis))
    np.testing.assert_array_equal(loaded.quality.compliance, basis.quality.compliance)


def test_bad_requests_are_refused():
    body = beam()
    with pytest.raises(InputError, match=r"reduction = 'residuals' .*did you mean 'residual'"):
        modal_basis(body, 6, contact_nodes=5, reduction="residuals")
    with pytest.raises(InputError, match=r"tolerance = 1\.5 must be zero or above"):
        modal_basis(body, 6, contact_nodes=5, reduction="residual", tolerance=1.5)
    with pytest.raises(InputError, match="at least the number of rigid modes, 3"):
        modal_basis(body, 2, contact_nodes=5, reduction="residual")
    with pytest.raises(InputError, match="its interface"):
        modal_basis(body, 10**6, contact_nodes=5, reduction="craig-bampton")
