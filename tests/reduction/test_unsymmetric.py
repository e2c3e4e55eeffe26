"""Matrices that are not symmetric: circulatory and gyroscopic parts, their work and their files."""

import numpy as np
import pytest
import scipy.sparse as sp
from systems import rotor

from fecontact import ContactSystem, InputError, ModalBasis, basis_from_matrices, simulate
from fecontact.analysis import receptance
from fecontact.integrate import Scipy, SetValued
from fecontact.io import read_basis, write_basis
from fecontact.laws import ConstantFriction, LinearContact


def apart(basis, **parts):
    return ContactSystem(basis, normal=LinearContact(1.0), friction=ConstantFriction(0.0),
                         gap=10.0, **parts)


def random_matrices(d=5, seed=2):
    rng = np.random.default_rng(seed)
    M, K = (a @ a.T + np.eye(d) for a in rng.standard_normal((2, d, d)))
    return M, K + rng.standard_normal((d, d)), rng.standard_normal((d, d))


@pytest.mark.parametrize("form", [np.asarray, sp.csr_array])
def test_full_matrices_keep_the_equations(form):
    """All modes of the symmetric part: the same eigenvalues as M x'' + C x' + K x = 0."""
    M, K, C = random_matrices()
    K = K + 5.0 * np.eye(5)
    rows = np.zeros((1, 3, 5))
    rows[0, :2, :2] = np.eye(2)
    basis = basis_from_matrices(form(M), form(K), {"contact": rows, "B": rows[0]}, damping=form(C),
                                symmetric=False)
    assert basis.stiffness is not None
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(M, 0.5 * (K + K.T))).real)
    assert basis.angular_frequencies**2 == pytest.approx(squares, rel=1e-10)
    one, zero = np.eye(5), np.zeros((5, 5))
    inverse = np.linalg.inv(M)
    expected = np.linalg.eigvals(np.block([[zero, one], [-inverse @ K, -inverse @ C]]))
    found = np.linalg.eigvals(apart(basis).jacobian(0.0, np.zeros(10)))
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(expected), rel=1e-9)
    f = 0.3
    dynamic = K + 2j * np.pi * f * C - (2.0 * np.pi * f) ** 2 * M
    response = receptance(basis, f, [("B", "x")], [("B", "x"), ("B", "y")]).values[0, :, 0]
    assert response == pytest.approx(np.linalg.inv(dynamic)[:2, 0], rel=1e-9)


@pytest.mark.parametrize("form", [np.triu, np.tril, lambda K: K + np.eye(5, k=2)])
def test_a_stiffness_that_is_not_symmetric_must_be_declared(form):
    M, K, _ = random_matrices()
    K = form(0.5 * (K + K.T) + 5.0 * np.eye(5))
    with pytest.raises(InputError, match=r"stiffness matrix is not symmetric.*symmetric=False"):
        basis_from_matrices(M, K, {"contact": np.zeros((1, 3, 5))})


def test_rounding_is_no_circulatory_force():
    K = np.array([[2.0, -1.0], [-1.0 - 1e-12, 2.0]])
    assert basis_from_matrices(np.eye(2), K, {"contact": np.zeros((1, 3, 2))}).stiffness is None


@pytest.mark.parametrize("solver", [None, Scipy("Radau"), SetValued()])
def test_whirl_on_the_border(solver):
    """At 300 rad/s r e^(100 i t) keeps its size: 3e4 r^2 W are put in and lost."""
    system, r = apart(rotor(300.0)), 1e-3
    start = r * np.linalg.solve(system.basis.contact_T[0, :2], np.diag([1.0, 100.0]))
    options = {} if solver is None else {"solver": solver}
    run = simulate(system, 0.2, initial=start.T.ravel(), outputs=21, rtol=1e-8, **options)
    energies = run.energies
    flow = 3e4 * r**2 * run.time
    assert energies.circulatory_work == pytest.approx(flow, rel=1e-4, abs=1e-10)
    assert energies.modal_damping == pytest.approx(flow, rel=1e-4, abs=1e-10)
    assert energies.elastic == pytest.approx(0.5 * 1e4 * r**2, rel=1e-4)
    assert energies.imbalance < 1e-6


def test_gyroscopic_forces_do_no_work():
    """A particle in a magnetic field of rate g: circles of radius v / g, at constant energy."""
    rows = np.eye(3, 2)[None]
    basis = basis_from_matrices(np.eye(2), np.zeros((2, 2)), {"contact": rows},
                                damping=[[0.0, -8.0], [8.0, 0.0]])
    system = apart(basis)
    run = simulate(system, 2.0, initial=[0.0, 0.0, 0.4, 0.0], outputs=41, rtol=1e-9)
    T = basis.contact_T[0, :2]
    x, y = T @ run.modal_coordinates.T
    v = T @ [0.4, 0.0]
    angle = np.arctan2(v[1], v[0]) - 8.0 * run.time
    centre = 0.4 / 8.0 * np.array([np.sin(angle[0]), -np.cos(angle[0])])
    assert x == pytest.approx(centre[0] - 0.05 * np.sin(angle), abs=1e-7)
    assert y == pytest.approx(centre[1] + 0.05 * np.cos(angle), abs=1e-7)
    assert np.abs(run.energies.modal_damping).max() < 1e-14
    assert run.energies.kinetic == pytest.approx(np.full(41, 0.08), rel=1e-6)


def test_stiffness_is_selected_stored_and_checked(tmp_path):
    M, K, C = random_matrices()
    basis = basis_from_matrices(M, K + 5.0 * np.eye(5), {"contact": np.zeros((1, 3, 5))}, damping=C,
                                symmetric=False)
    assert "stiffness: full matrix, in part circulatory" in str(basis)
    write_basis(tmp_path / "basis.h5", basis)
    assert (read_basis(tmp_path / "basis.h5").stiffness == basis.stiffness).all()
    part = basis.select([1, 3])
    assert (part.stiffness_matrix == basis.stiffness[np.ix_([1, 3], [1, 3])]).all()
    for stiffness, words in ((np.eye(2), r"stiffness must have shape \(5, 5\), not \(2, 2\)"),
                             (np.full((5, 5), np.nan), "stiffness holds values that are not fin")):
        with pytest.raises(InputError, match=words):
            ModalBasis(basis.angular_frequencies, basis.damping, basis.T, basis.positions,
                       basis.tributary, stiffness=stiffness)
