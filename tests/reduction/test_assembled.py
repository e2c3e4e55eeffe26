"""Bases from matrices and modes of other programs, against bodies of this one and closed forms."""

import numpy as np
import pytest
import scipy.sparse as sp
from meshes_for_tests import rectangle, skewed

from fecontact import (
    ElasticBody,
    InputError,
    LossFactor,
    Rayleigh,
    basis_from_matrices,
    basis_from_modes,
    modal_basis,
)
from fecontact.io import AssembledMatrix
from fecontact.reduction import normalisation, rows_from_dofs
from fecontact.reduction.static_modes.null_space import null_space, relative_energies

SUPPORTS = {"free": {}, "hinged": {"hinge": "xy"}, "on rollers": {"left": "x"},
            "clamped": {"left": "xy"}}


def body_and_matrices(columns, rows, fixed, warp=None):
    """A block, its mass, stiffness and rows over the free degrees of freedom."""
    body = ElasticBody(rectangle(0.1, 0.05, columns, rows, warp=warp,
                                 points={"hinge": (0.0, 0.025), "B": (0.1, 0.05)}), fixed=fixed)
    free = np.setdiff1d(np.arange(2 * len(body.nodes)), body.fixed_dofs)
    basis = modal_basis(body, 12, contact="bottom", contact_nodes=3, damping=0.01)
    restriction = basis.mode_shapes.restriction[:, free]
    given = {"B": restriction[:3], "C": restriction[3:6], "contact": restriction[6:]}
    return basis, body.mass[free][:, free], body.stiffness[free][:, free], given


def assert_same(basis, expected, frequencies=1e-10, rows=1e-8):
    r = expected.rigid_modes
    assert basis.rigid_modes == r
    assert basis.angular_frequencies[r:] == pytest.approx(
        expected.angular_frequencies[r:], rel=frequencies)
    size = np.abs(expected.T).max()
    assert np.abs(basis.T[..., r:] - expected.T[..., r:]).max() < rows * size
    # Rigid modes may be turned among themselves.
    products = [T[:, :r] @ T[:, :r].T for T in (basis.T_matrix, expected.T_matrix)]
    assert np.abs(products[0] - products[1]).max() < rows * size**2


# Matrices of bodies ------------------------------------------------------------------------------

@pytest.mark.parametrize("fixed", SUPPORTS.values(), ids=SUPPORTS)
@pytest.mark.parametrize("columns", [6, 24])
def test_matrices_give_the_basis_of_their_body(fixed, columns):
    """The dense solver below 600 degrees of freedom, Lanczos above."""
    expected, M, K, rows = body_and_matrices(columns, columns // 2, fixed)
    assert (M.shape[0] > 600) == (columns == 24)
    sparse = basis_from_matrices(M, K, rows, modes=12, damping=0.01)
    assert_same(sparse, expected)
    assert sparse.damping_ratios == pytest.approx(expected.damping_ratios, rel=1e-12)
    dense = basis_from_matrices(M.toarray(), K.toarray(), rows, modes=12)
    assert dense.angular_frequencies == pytest.approx(sparse.angular_frequencies, rel=1e-12)
    assert np.abs(dense.T - sparse.T).max() < 1e-9 * np.abs(sparse.T).max()


@pytest.mark.parametrize("columns", [6, 24])
def test_a_turned_and_skewed_body(columns):
    _, M, K, _ = body_and_matrices(columns, columns // 2, {}, warp=skewed)
    x = np.zeros((1, 3, M.shape[0]))
    basis = basis_from_matrices(M, K, {"contact": x}, modes=6)
    assert basis.rigid_modes == 3


def test_all_modes_are_kept_without_a_number():
    expected, M, K, rows = body_and_matrices(3, 1, {})
    basis = basis_from_matrices(M, K, rows)
    assert basis.modes == M.shape[0]
    assert_same(basis_from_matrices(M, K, rows, modes=12), expected)
    # All modes span everything: Phi Phi^T = M^-1.
    inverse = np.linalg.inv(M.toarray())
    T = basis.T_matrix
    W = sp.vstack([rows["B"], rows["C"], rows["contact"]])
    admittance = T @ T.T
    assert admittance == pytest.approx(W @ inverse @ W.T, rel=1e-9,
                                       abs=1e-9 * np.abs(admittance).max())


def test_fewer_modes_than_rigid_ones():
    _, M, K, rows = body_and_matrices(6, 3, {})
    basis = basis_from_matrices(M, K, rows, modes=2)
    assert basis.angular_frequencies.tolist() == [0.0, 0.0]


def test_soft_springs_are_not_taken_for_rigid():
    """A block a x b on two springs k in x at its left corners, 1e-13 of its own stiffness.

    It sways with 2 k / m and tilts with 2 k (b / 2)^2 / J, J = m (a^2 + b^2) / 12. Rounding of the
    body's stiffness is some 1e-3 of the springs.
    """
    k, m = 100.0, 0.1 * 0.05 * 7850.0
    _, M, K, _ = body_and_matrices(24, 12, {})
    d = M.shape[0]
    softened = sp.lil_array(K)
    for corner in (0, 12 * 25):
        softened[2 * corner, 2 * corner] += k
    basis = basis_from_matrices(M, softened, {"contact": np.zeros((1, 3, d))}, modes=4)
    assert basis.rigid_modes == 1
    tilt = 2.0 * k * 0.025**2 / (m * (0.1**2 + 0.05**2) / 12.0)
    assert basis.angular_frequencies[1:3] ** 2 == pytest.approx([tilt, 2.0 * k / m], rel=1e-2)


@pytest.mark.parametrize("pieces", [3, 7])
def test_several_pieces_have_more_rigid_modes(pieces):
    """Below and above the size for the dense solver."""
    _, M, K, _ = body_and_matrices(6, 3, {})
    all_of = [sp.block_diag([one] * pieces) for one in (M, K)]
    r, d = 3 * pieces, pieces * M.shape[0]
    basis = basis_from_matrices(*all_of, {"contact": sp.csr_array((3, d))}, modes=r + pieces)
    assert basis.rigid_modes == r
    alone = basis_from_matrices(M, K, {"contact": np.zeros((1, 3, M.shape[0]))}, modes=4)
    assert basis.angular_frequencies[r:] == pytest.approx(
        np.full(pieces, alone.angular_frequencies[3]), rel=1e-10)


@pytest.mark.parametrize("d", [4, 700])
def test_masses_without_springs(d):
    mass = 1.0 + np.arange(d)
    basis = basis_from_matrices(sp.diags_array(mass), sp.csc_array((d, d)),
                                rows_from_dofs(d, [(0, None), (1, 2)]), modes=3)
    assert basis.angular_frequencies.tolist() == [0.0] * 3
    # The rigid modes are the single masses: 1 / sqrt(m) in turn.
    assert basis.contact_T[0, 0] == pytest.approx([1.0, 0.0, 0.0])
    assert basis.contact_T[1, 1] == pytest.approx([0.0, 0.0, 1.0 / np.sqrt(3.0)])


def test_long_chain_by_lanczos():
    """Free chain of n equal masses: w_k = 2 sqrt(c/m) sin(pi k / 2 n)."""
    n, c, m = 3000, 1e6, 0.5
    main = np.full(n, 2.0 * c)
    main[[0, -1]] = c
    K = sp.diags_array([main, np.full(n - 1, -c), np.full(n - 1, -c)], offsets=[0, 1, -1])
    basis = basis_from_matrices(sp.diags_array(np.full(n, m)), K,
                                rows_from_dofs(n, [(0, -1), (n - 1, -1)]), modes=6)
    k = np.arange(6)
    assert basis.angular_frequencies[0] == 0.0
    assert basis.angular_frequencies == pytest.approx(
        2.0 * np.sqrt(c / m) * np.sin(0.5 * np.pi * k / n), rel=1e-8)
    # Mode k: sqrt(2 / (n m)) cos(pi k / 2 n) at the first mass, with changing sign at the last.
    end = np.sqrt(2.0 / (n * m)) * np.cos(0.5 * np.pi * k[1:] / n)
    assert basis.contact_T[0, 0, 1:] == pytest.approx(end, rel=1e-6)
    assert basis.contact_T[1, 0, 1:] == pytest.approx(end * (-1.0) ** k[1:], rel=1e-6)


def test_condensed_matrices_with_a_given_number_of_rigid_modes():
    """A stiffness with few digits resists rigid motion; saying rigid=3 puts it right."""
    _, M, K, rows = body_and_matrices(6, 3, {})
    exact = basis_from_matrices(M, K, rows, modes=8)
    rng = np.random.default_rng(3)
    K = K.toarray()
    noise = 1e-11 * np.abs(K).max() * rng.standard_normal(K.shape)
    K = K + noise + noise.T
    with pytest.raises(InputError, match=r"not positive semi-definite: its lowest eigenvalue .* "
                                         r"\(rigid=3 for a free"):
        basis_from_matrices(M, K, rows, modes=8)
    assert_same(basis_from_matrices(M, K, rows, modes=8, rigid=3), exact, 1e-7, 1e-6)
    with pytest.raises(InputError, match="rigid = 4 modes are asked for, but the stiffness"):
        basis_from_matrices(M, K, rows, modes=8, rigid=4)


@pytest.mark.parametrize("columns", [6, 24])
def test_too_few_rigid_modes(columns):
    _, M, K, rows = body_and_matrices(columns, columns // 2, {})
    with pytest.raises(InputError, match="rigid = 1, but the stiffness matrix leaves 3 displ"):
        basis_from_matrices(M, K, rows, modes=8, rigid=1)


def test_asymmetry_of_the_last_digits():
    expected, M, K, rows = body_and_matrices(6, 3, {"left": "xy"})
    noise = sp.csr_array(np.triu(np.random.default_rng(1).standard_normal(K.shape)))
    uneven = [A + 1e-12 * np.abs(A).max() * noise for A in (M, K)]
    assert_same(basis_from_matrices(*uneven, rows, modes=12), expected, 1e-7, 1e-6)


def test_large_matrices_with_a_given_number_of_rigid_modes():
    expected, M, K, rows = body_and_matrices(24, 12, {})
    assert_same(basis_from_matrices(M, K, rows, modes=12, rigid=3), expected)


def test_null_space_does_not_depend_on_its_start():
    _, M, K, _ = body_and_matrices(24, 12, {}, warp=skewed)
    d = M.shape[0]
    first = null_space(K, M, np.linalg.qr(null_space(K, M, _rigid(d)))[0])
    turned = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    second = null_space(K, M, first @ turned)
    assert np.abs(first - second).max() < 1e-9 * np.abs(first).max()
    assert first.T @ (M @ first) == pytest.approx(np.eye(3), abs=1e-12)
    assert np.abs(relative_energies(K, first)).max() < 1e-15


def _rigid(d):
    """Three vectors that are independent at the three degrees of freedom picked as supports."""
    return np.random.default_rng(0).standard_normal((d, 3))


def test_held_degrees_of_freedom_of_abaqus():
    """1e36 on the diagonal of the stiffness holds a degree of freedom."""
    _, M, K, rows = body_and_matrices(6, 3, {})
    clamped = sp.lil_array(K)
    held = np.array([0, 1, 7])
    for dof in held:
        clamped[dof, dof] = 1e36
    basis = basis_from_matrices(M, clamped, rows, modes=6, damping=0.3 * M + 1e-6 * K)
    kept = np.setdiff1d(np.arange(M.shape[0]), held)
    M, K = M[kept][:, kept], K[kept][:, kept]
    rows = {name: block[:, kept] for name, block in rows.items()}
    expected = basis_from_matrices(M, K, rows, modes=6, damping=Rayleigh(0.3, 1e-6))
    assert_same(basis, expected)
    assert basis.damping == pytest.approx(
        expected.damping, rel=1e-9, abs=1e-9 * expected.damping.max())


# Damping, rows -----------------------------------------------------------------------------------

def test_damping_matrices_and_factors():
    _, M, K, rows = body_and_matrices(6, 3, {"left": "xy"})
    C = 0.3 * M + 1e-6 * K
    expected = basis_from_matrices(M, K, rows, modes=5, damping=Rayleigh(0.3, 1e-6)).damping
    for damping in (C, C.toarray(), AssembledMatrix(C, None, "C.mtx")):
        found = basis_from_matrices(M, K, rows, modes=5, damping=damping).damping
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected.max())
    lossy = basis_from_matrices(M, K, rows, modes=5, damping=LossFactor(0.04))
    assert lossy.damping_ratios == pytest.approx(np.full(5, 0.02))


def test_forms_of_rows():
    _, M, K, rows = body_and_matrices(6, 3, {})
    contact = rows["contact"].toarray().reshape(3, 3, -1)
    flat = contact.copy()
    flat[:, 2] = 0.0
    forms = [
        (contact, contact), (list(contact), contact), (rows["contact"].tocoo(), contact),
        ([sp.csr_array(one) for one in contact], contact), (contact[:, :2], flat),
        ([sp.csr_array(one[:2]) for one in contact], flat),
    ]
    for given, meant in forms:
        basis = basis_from_matrices(M, K, {"contact": given, "B": rows["B"][:2]}, modes=12)
        assert basis.T_matrix.shape == (15, 12)
        reference = basis_from_matrices(M, K, {"contact": meant, "B": rows["B"]}, modes=12)
        assert (basis.contact_T == reference.contact_T).all()
        assert (basis.T[0, :2] == reference.T[0, :2]).all()
        assert (basis.T[0, 2] == 0.0).all()


def test_rows_from_numbers():
    rows = rows_from_dofs(6, [(0, 1), (2, None, 5), (-1, np.int64(3))], B=(4, 5),
                          points={"tip": (5, -1)})
    contact = rows["contact"].toarray().reshape(3, 3, 6)
    expected = np.zeros((3, 3, 6))
    for node, component, dof in ((0, 0, 0), (0, 1, 1), (1, 0, 2), (1, 2, 5), (2, 1, 3)):
        expected[node, component, dof] = 1.0
    assert (contact == expected).all()
    assert rows["B"].toarray().tolist() == [[0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1], [0] * 6]
    assert list(rows) == ["contact", "B", "tip"]
    basis = basis_from_matrices(np.eye(6), np.diag(np.arange(1.0, 7.0)), rows)
    assert basis.extra == ("tip",)
    assert basis.contact_T[1].tolist() == [[0, 0, 1, 0, 0, 0], [0] * 6, [0, 0, 0, 0, 0, 1]]


@pytest.mark.parametrize(("arguments", "options", "message"), [
    ((4, []), {}, "contact is empty"),
    ((4, [(0, 1), (2, 4)]), {}, "contact node 1 names degree of freedom 4, but there are 4, count"),
    ((4, [(0, -2)]), {}, "contact node 0 names degree of freedom -2"),
    ((4, [(0, 1)]), {"B": (1.5, 2)}, "point B names degree of freedom 1.5"),
    ((4, [(0, 1)]), {"C": (1,)}, r"point C must be \(ix, iy\) or \(ix, iy, iphi\), not \(1,\)"),
    ((4, [0, 1]), {}, "contact node 0 must be"),
    ((4, [(0, 1)]), {"points": {"tip": (9, 1)}}, "point tip names degree of freedom 9"),
])
def test_numbers_are_checked(arguments, options, message):
    with pytest.raises(InputError, match=message):
        rows_from_dofs(*arguments, **options)


# Checks of matrices ------------------------------------------------------------------------------

TWO = np.array([[2.0, -1.0], [-1.0, 2.0]])
ONE_ROW = {"contact": np.zeros((1, 3, 2))}
LABELS = np.array([[7, 1], [7, 2]])
OTHERS = np.array([[8, 1], [8, 2]])


@pytest.mark.parametrize(("mass", "stiffness", "options", "message"), [
    (np.eye(2), sp.csc_array((2, 3)), {}, r"stiffness matrix must be square .* \(2, 3\)"),
    (np.eye(2), np.eye(3), {}, r"stiffness .* of the mass matrix's size, \(2, 2\), not \(3, 3\)"),
    (np.eye(2), 1j * TWO, {}, "stiffness matrix is complex"),
    (np.eye(2), [[2.0, np.inf], [np.inf, 2.0]], {},
     r"stiffness matrix holds values that are not finite, the first one in row 1, column 0"),
    ([[2.0, -1.0], [-1.1, 2.0]], TWO, {},
     r"mass matrix is not symmetric: .* row 0, column 1 \(-1\) and in row 1, column 0 "
     r"\(-1.1\), counted from 0, differ by 5.0e-02"),
    (np.diag([1.0, 0.0]), TWO, {},
     r"mass matrix is not positive definite: its diagonal entry at degree of freedom 1 \(counted "
     r"from 0\) is 0, .* massless degree of freedom"),
    (AssembledMatrix(np.diag([-3.0, 1.0]), LABELS, "M.mtx"), TWO, {},
     r"mass matrix \(M.mtx\) .* at node 7, direction 1 is -3"),
    ([[1.0, 2.0], [2.0, 1.0]], TWO, {}, "not positive definite, although its diagonal is"),
    (np.eye(2), -TWO, {}, "not positive semi-definite: its lowest eigenvalue .* -3.000e"),
    (AssembledMatrix(np.eye(2), LABELS, "M.mtx"), AssembledMatrix(TWO, OTHERS, "K.mtx"), {},
     r"mass matrix \(M.mtx\) has node 7, direction 1, but the stiffness matrix \(K.mtx\) has"),
    (AssembledMatrix(np.eye(2), LABELS, "M"), AssembledMatrix(TWO, LABELS[::-1], "K"), {},
     "in different orders"),
    (AssembledMatrix(np.eye(1), LABELS[:1], "M"), AssembledMatrix(TWO, LABELS, "K"), {},
     r"stiffness matrix \(K\) has node 7, direction 2, but the mass matrix \(M\) has not"),
    (np.eye(2), TWO, {"damping": np.eye(3)}, r"damping matrix must have shape \(2, 2\)"),
    (np.eye(2), TWO, {"damping": sp.eye_array(3)}, r"damping matrix must have shape \(2, 2\)"),
    (np.eye(2), TWO, {"modes": 0}, "modes = 0 must be a whole number from 1 to .* 2"),
    (np.eye(2), TWO, {"modes": 2.0}, "modes = 2.0 must be a whole number"),
    (np.eye(2), TWO, {"rigid": -1}, "rigid = -1 must be None or a whole number from 0"),
    (np.eye(2), TWO, {"rigid": 1}, "rigid = 1 modes are asked for, but the stiffness matrix resi"),
    (np.eye(2), TWO, {"contact_x": [1.0, 2.0]}, "contact_x must have one value"),
])
def test_matrices_are_checked(mass, stiffness, options, message):
    with pytest.raises(InputError, match=message):
        basis_from_matrices(mass, stiffness, ONE_ROW, **options)


def test_large_matrices_are_checked():
    d = 2100
    rows = {"contact": sp.csr_array((3, d))}
    identity = sp.eye_array(d, format="csc")
    chain = sp.diags_array([np.full(d, 2.0), np.full(d - 1, -1.0), np.full(d - 1, -1.0)],
                           offsets=[0, 1, -1])
    with pytest.raises(InputError, match="there are 2100 degrees of freedom, more than 2000; say"):
        basis_from_matrices(identity, chain, rows)
    negative = sp.lil_array(chain)
    negative[5, 5] = negative[100, 100] = -9.0
    with pytest.raises(InputError, match="not positive semi-definite: it has 2 negative eigenval"):
        basis_from_matrices(identity, negative, rows, modes=3)
    with pytest.raises(InputError, match="leaves more than 500 displacements without resistance"):
        basis_from_matrices(identity, sp.csc_array((d, d)), rows, modes=3)
    with pytest.raises(InputError, match="not positive semi-definite: its diagonal"):
        basis_from_matrices(identity, -chain, rows, modes=3)
    with pytest.raises(InputError, match="mass matrix is not positive definite, although"):
        basis_from_matrices(chain - 1.5 * identity, chain, rows, modes=3)


# Given modes -------------------------------------------------------------------------------------

def given_modes(scale):
    """A basis, and its modes over all degrees of freedom with another scale."""
    expected, M, _, rows = body_and_matrices(6, 3, {})
    shapes = expected.mode_shapes.shapes.reshape(-1, expected.modes)
    scales = {"mass-normalised": np.ones(12),
              "largest component one": np.abs(shapes).max(axis=0),
              "length one": np.linalg.norm(shapes, axis=0),
              "other": 1.0 + np.arange(12)}[scale]
    return expected, M, rows, shapes / scales, 1.0 / scales**2


@pytest.mark.parametrize("scale", ["mass-normalised", "largest component one", "length one",
                                   "other"])
def test_normalisation_is_found_and_put_right(scale):
    expected, M, rows, shapes, masses = given_modes(scale)
    found = normalisation(shapes, M)
    assert found.name == scale
    assert found.modal_masses == pytest.approx(masses, rel=1e-10)
    assert found.worst_off_diagonal < 1e-9
    f = expected.frequencies_hz
    for given in ({"mass": M}, {"mass": M.toarray()}, {"modal_mass": masses}):
        basis = basis_from_modes(shapes, rows, frequencies_hz=f, damping=0.01, **given)
        assert_same(basis, expected, 1e-14, 1e-9)
        assert basis.damping_ratios == pytest.approx(expected.damping_ratios, rel=1e-12)


def test_modes_in_another_order_and_with_other_signs():
    expected, _, rows, shapes, masses = given_modes("other")
    order = np.random.default_rng(2).permutation(12)
    ratios = 0.001 * (1.0 + np.arange(12))
    basis = basis_from_modes(
        -shapes[:, order], rows, angular_frequencies=expected.angular_frequencies[order],
        modal_mass=masses[order], damping=ratios[order])
    assert basis.angular_frequencies == pytest.approx(expected.angular_frequencies, rel=1e-14)
    assert np.abs(basis.T[..., 3:] - expected.T[..., 3:]).max() < 1e-12 * np.abs(expected.T).max()
    assert basis.damping_ratios[3:] == pytest.approx(ratios[3:], rel=1e-12)


def test_modal_damping_matrix_turns_with_the_modes():
    """The physical damping seen at the points, T D T^T, does not depend on order and signs."""
    expected, _, rows, shapes, _ = given_modes("mass-normalised")
    C = np.random.default_rng(2).standard_normal((12, 12))
    C = C @ C.T
    order = np.r_[0:3, 11:2:-1]
    signs = (-1.0) ** np.arange(12)
    basis = basis_from_modes(
        (shapes * signs)[:, order], rows, frequencies_hz=expected.frequencies_hz[order],
        modal_mass=1.0, damping=(C * np.outer(signs, signs))[np.ix_(order, order)])
    seen = expected.T_matrix @ C @ expected.T_matrix.T
    assert basis.T_matrix @ basis.damping @ basis.T_matrix.T == pytest.approx(
        seen, rel=1e-9, abs=1e-9 * np.abs(seen).max())


def test_modes_of_another_order_of_unknowns_are_not_orthogonal():
    expected, M, rows, shapes, _ = given_modes("mass-normalised")
    wrong = np.concatenate([shapes[0::2], shapes[1::2]])
    products = wrong.T @ (M @ wrong)
    products /= np.sqrt(np.outer(np.diag(products), np.diag(products)))
    worst = np.abs(np.triu(products, 1))
    i, j = np.unravel_index(np.argmax(worst), worst.shape)
    with pytest.raises(InputError, match=f"not mass-orthogonal: modes {i} and {j} .* product "
                                         f"{worst.max():.3g}, more than 0.001"):
        basis_from_modes(wrong, rows, frequencies_hz=expected.frequencies_hz, mass=M)
    basis = basis_from_modes(wrong, rows, frequencies_hz=expected.frequencies_hz, mass=M,
                             orthogonality=1.0)
    assert basis.modes == 12


EYE = np.eye(2)


@pytest.mark.parametrize(("shapes", "options", "message"), [
    (EYE, {"modal_mass": 1.0}, "either frequencies_hz .* or angular_frequencies"),
    (EYE, {"modal_mass": 1.0, "frequencies_hz": [1, 2], "angular_frequencies": [1, 2]}, "either"),
    (EYE, {"frequencies_hz": [1, 2]}, "either mass, the mass matrix, or modal_mass"),
    (EYE, {"frequencies_hz": [1, 2], "mass": EYE, "modal_mass": 1.0}, "either mass"),
    (EYE, {"frequencies_hz": [1, 2, 3], "modal_mass": 1.0}, "must be 2 finite numbers"),
    (EYE, {"frequencies_hz": [1, -2], "modal_mass": 1.0}, r"at least zero, .* not \[1, -2\]"),
    (EYE, {"frequencies_hz": [1, 2], "modal_mass": [1.0, 0.0]}, "modal_mass must be one number"),
    (EYE, {"frequencies_hz": [1, 2], "modal_mass": [1.0] * 3}, "modal_mass must be one number"),
    (EYE, {"frequencies_hz": [1, 2], "mass": np.eye(3)}, "mass matrix must be 2 x 2, as the shape"),
    (EYE, {"frequencies_hz": [1, 2], "mass": -EYE}, "Mode 0 .* has the modal mass -1"),
    (1j * EYE, {"frequencies_hz": [1, 2], "modal_mass": 1.0}, "Mode shapes are complex"),
    (np.ones(2), {"frequencies_hz": [1, 2], "modal_mass": 1.0}, r"shape \(d, m\), .* not \(2,\)"),
    (np.nan * EYE, {"frequencies_hz": [1, 2], "modal_mass": 1.0}, "hold values that are not finit"),
    (np.ones((3, 2)), {"frequencies_hz": [1, 2], "modal_mass": 1.0}, "with d = 3 degrees"),
])
def test_modes_are_checked(shapes, options, message):
    with pytest.raises(InputError, match=message):
        basis_from_modes(shapes, ONE_ROW, **options)


def test_a_single_mode():
    found = normalisation([[1.0], [0.0]], np.diag([4.0, 1.0]))
    assert found.worst_off_diagonal == 0.0
    assert found.worst_pair == (0, 0)
    basis = basis_from_modes([[1.0], [0.0]], rows_from_dofs(2, [(0, 1)]), mass=np.diag([4, 1]),
                             frequencies_hz=[3.0])
    assert basis.contact_T[0].tolist() == [[0.5], [0.0], [0.0]]
