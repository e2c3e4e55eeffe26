"""The modal basis: from matrices, damping, names, signs, files."""

import h5py
import numpy as np
import pytest
from meshes_for_tests import rectangle

from fecontact import (
    ElasticBody,
    InputError,
    Material,
    ModalBasis,
    Rayleigh,
    basis_from_matrices,
    modal_basis,
)
from fecontact.io import read_basis, write_basis
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.damping import modal_damping
from fecontact.reduction.eigenmodes import fixed_signs

NO_CONTACT = {"contact": np.zeros((1, 3, 2))}


def chain_rows(d=2):
    """Each mass a contact node that moves along x."""
    rows = np.zeros((d, 3, d))
    rows[:, 0] = np.eye(d)
    return {"contact": rows}


def chain(D=0.1, gamma=2.5, kappa=2.0, delta=1.0):
    """The chain of two masses of section 4.4."""
    return basis_from_matrices(
        np.diag([gamma, 1.0]), [[1.0 + kappa, -1.0], [-1.0, 1.0]], chain_rows(),
        damping=2.0 * D * np.array([[1.0 + delta, -1.0], [-1.0, 1.0]]))


# From matrices -----------------------------------------------------------------------------------

def test_chain_of_two_masses():
    basis = chain()
    # gamma l^2 - (gamma + 1 + kappa) l + kappa = 0 for l = w^2.
    root = np.sqrt((2.5 + 3.0) ** 2 - 4.0 * 2.5 * 2.0)
    expected = np.sqrt([(5.5 - root) / 5.0, (5.5 + root) / 5.0])
    assert basis.angular_frequencies == pytest.approx(expected, rel=1e-14)
    assert basis.rigid_modes == 0
    assert basis.frequencies_hz == pytest.approx(expected / (2.0 * np.pi), rel=1e-14)
    # T^-1 = T^T M for mass-normalised modes; the physical damping matrix is recovered.
    T = basis.contact_T[:, 0]
    assert np.linalg.inv(T @ T.T) == pytest.approx(np.diag([2.5, 1.0]), abs=1e-14)
    inverse = np.linalg.inv(T)
    assert inverse.T @ basis.damping @ inverse == pytest.approx(
        0.2 * np.array([[2.0, -1.0], [-1.0, 1.0]]), abs=1e-14)
    assert inverse.T @ np.diag(expected**2) @ inverse == pytest.approx(
        np.array([[3.0, -1.0], [-1.0, 1.0]]), abs=1e-13)
    with pytest.raises(InputError, match="not diagonal"):
        _ = basis.damping_ratios


def test_damped_eigenvalues_of_the_chain():
    """Eigenvalues of the modal equations are the roots of det(M s^2 + C s + K), a polynomial."""
    D = 0.1
    basis = chain(D)
    A = np.block([[np.zeros((2, 2)), np.eye(2)],
                  [-np.diag(basis.angular_frequencies**2), -basis.damping]])
    a = np.polynomial.Polynomial([3.0, 4.0 * D, 2.5])
    b = np.polynomial.Polynomial([1.0, 2.0 * D, 1.0])
    c = np.polynomial.Polynomial([1.0, 2.0 * D])
    roots = (a * b - c * c).roots()
    assert np.sort_complex(np.linalg.eigvals(A)) == pytest.approx(np.sort_complex(roots),
                                                                  abs=1e-12)


def test_rigid_and_elastic_modes_of_a_free_chain():
    """Three equal masses, two springs: w^2 = 0, k/m, 3 k/m."""
    K = 900.0 * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    basis = basis_from_matrices(4.0 * np.eye(3), K, chain_rows(3), damping=0.02)
    assert basis.angular_frequencies[0] == 0.0
    assert basis.angular_frequencies == pytest.approx([0.0, 15.0, 15.0 * np.sqrt(3.0)], rel=1e-13)
    assert basis.rigid_modes == 1
    assert basis.contact_T[:, 0, 0] == pytest.approx(np.full(3, 1.0 / np.sqrt(12.0)), rel=1e-13)
    assert basis.damping_ratios == pytest.approx([0.0, 0.02, 0.02], rel=1e-14)


def test_masses_without_springs_are_all_rigid():
    basis = basis_from_matrices(np.diag([2.0, 5.0]), np.zeros((2, 2)), chain_rows())
    assert basis.angular_frequencies.tolist() == [0.0, 0.0]
    T = basis.contact_T[:, 0]
    assert np.linalg.inv(T @ T.T) == pytest.approx(np.diag([2.0, 5.0]), abs=1e-14)


@pytest.mark.parametrize(("height", "fixed", "tolerance"), [
    (0.01, {}, 1e-6), (0.01, {"left": "xy"}, 1e-6), (0.002, {"left": "xy"}, 1e-4)])
def test_matrices_of_a_slender_finite_element_body(height, fixed, tolerance):
    """The lowest elastic frequency is 1e-6 of the highest, and is not taken for a rigid one."""
    body = ElasticBody(rectangle(1.0, height, 60, 1), Material(), fixed=fixed)
    free = np.setdiff1d(np.arange(2 * len(body.nodes)), body.fixed_dofs)
    basis = basis_from_matrices(
        body.mass[free][:, free].toarray(), body.stiffness[free][:, free].toarray(),
        {"contact": np.zeros((1, 3, len(free)))})
    expected = 2.0 * np.pi * eigenfrequencies_hz(body, 8)
    assert basis.rigid_modes == np.count_nonzero(expected == 0.0)
    assert basis.angular_frequencies[:8] == pytest.approx(expected, rel=tolerance)
    assert (np.diff(basis.angular_frequencies) >= 0.0).all()


def test_rows_names_and_places():
    rows = {"tip": [[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]], "C": [[0, 0], [1.0, 0], [0, 0]],
            **chain_rows()}
    basis = basis_from_matrices(np.eye(2), np.diag([1.0, 4.0]), rows,
                                contact_x=[0.1, 0.4], tributary=[0.2, 0.6])
    assert basis.T.shape == (5, 3, 2)
    assert basis.extra == ("tip",)
    assert (basis.T[0] == 0.0).all()
    assert basis.T[1].tolist() == [[0, 0], [1, 0], [0, 0]]
    assert basis.contact_T[:, 0].tolist() == [[1, 0], [0, 1]]
    assert basis.T[4].tolist() == [[0, 1], [0, 0], [0, 0]]
    assert basis.contact_x.tolist() == [0.1, 0.4]
    assert basis.tributary.tolist() == [0.2, 0.6]
    assert [basis.point_index(name) for name in ("B", "C", 0, 1, "tip")] == [0, 1, 2, 3, 4]
    assert basis.T_matrix.shape == (12, 2)
    default = basis_from_matrices(np.eye(2), np.eye(2), chain_rows())
    assert default.tributary.tolist() == [0.5, 0.5]
    assert default.contact_x.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(("point", "message"), [
    (2, "Contact node 2 .* there are 2"), (-1, "Contact node -1"), ("tipp", "did you mean 'tip'"),
])
def test_unknown_points(point, message):
    rows = {"tip": np.zeros((3, 2)), **chain_rows()}
    basis = basis_from_matrices(np.eye(2), np.eye(2), rows)
    with pytest.raises(InputError, match=message):
        basis.point_index(point)


@pytest.mark.parametrize(("mass", "stiffness", "options", "message"), [
    (np.ones((1, 2)), np.eye(2), {}, "mass matrix must be square"),
    (2.0, 1.0, {}, "mass matrix must be square"),
    (np.zeros((0, 0)), np.zeros((0, 0)), {}, "not empty"),
    (np.eye(2), np.eye(3), {}, "stiffness matrix must be square"),
    ([[1.0, 0.5], [0.0, 1.0]], np.eye(2), {}, "mass matrix is not symmetric"),
    (np.diag([1.0, 0.0]), np.eye(2), {}, "mass matrix is not positive definite"),
    (np.diag([1.0, -1.0]), np.eye(2), {}, "mass matrix is not positive definite"),
    (np.eye(2), np.diag([1.0, -1e-6]), {}, r"not positive semi-definite.* -1\.000e-06"),
    (np.eye(2), [[np.nan, 0], [0, 1]], {}, "stiffness matrix holds values that are not finite"),
    ("heavy", np.eye(2), {}, "mass must be an array of real numbers .*, not 'heavy'"),
    (np.eye(2), np.eye(2), {"damping": np.ones((3, 3))}, r"damping matrix must have shape \(2, 2"),
    (np.eye(2), np.eye(2), {"damping": -0.1}, "-0.1 must be zero or above"),
    (np.eye(2), np.eye(2), {"damping": [0.1, 0.1, 0.1]}, "2 ratios"),
    (np.eye(2), np.eye(2), {"damping": float("inf")}, "inf is not finite"),
    (np.eye(2), np.eye(2), {"damping": "light"}, "must be real numbers, not 'light'"),
    (np.eye(2), np.eye(2), {"contact_x": [0.0, 1.0]}, "contact_x must have one value .* 1 contact"),
    (np.eye(2), np.eye(2), {"tributary": [1.0, 1.0]}, "tributary must have one value"),
    (np.eye(2), np.eye(2), {"tributary": [0.0]}, "tributary lengths must be above zero"),
    (np.eye(2), np.eye(2), {"tributary": [np.nan]}, "tributary holds values that are not finite"),
])
def test_matrices_are_checked(mass, stiffness, options, message):
    with pytest.raises(InputError, match=message):
        basis_from_matrices(mass, stiffness, NO_CONTACT, **options)


@pytest.mark.parametrize(("rows", "message"), [
    ({"contact": np.zeros((3, 2))}, r"rows\['contact'\]"),
    ({"contact": np.zeros((0, 3, 2))}, r"rows\['contact'\]"),
    ({**NO_CONTACT, "B": np.zeros((3, 3))}, r"rows\['B'\] must have shape \(3, d\) with d = 2"),
    ({**NO_CONTACT, "B": 1.0}, r"rows\['B'\]"),
    ({"contact": np.full((1, 3, 2), np.nan)}, "T holds values that are not finite"),
])
def test_rows_are_checked(rows, message):
    with pytest.raises(InputError, match=message):
        basis_from_matrices(np.eye(2), np.eye(2), rows)


@pytest.mark.parametrize(("name", "value", "message"), [
    ("damping", np.zeros((3, 3)), r"damping must have shape \(2, 2\)"),
    ("T", np.zeros((4, 3, 2)), r"T must have shape \(3, 3, 2\)"),
    ("positions", np.zeros((3, 3)), r"positions must have shape \(3, 2\)"),
    ("angular_frequencies", [0.0, np.inf], "angular_frequencies holds"),
])
def test_shapes_of_a_basis_are_checked(name, value, message):
    parts = {"angular_frequencies": [1.0, 2.0], "damping": np.zeros((2, 2)),
             "T": np.zeros((3, 3, 2)), "positions": np.zeros((3, 2)), "tributary": [1.0]}
    ModalBasis(**parts)
    with pytest.raises(InputError, match=message):
        ModalBasis(**{**parts, name: value})


def test_arrays_cannot_be_changed():
    basis = chain()
    for name in ("angular_frequencies", "damping", "T", "positions", "tributary"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(basis, name)[...] = 1.0


# Damping -----------------------------------------------------------------------------------------

W = np.array([0.0, 3.0, 10.0])


@pytest.mark.parametrize(("damping", "diagonal"), [
    (0.0, [0.0, 0.0, 0.0]), (0.02, [0.0, 0.12, 0.4]), ([0.5, 0.1, 0.01], [0.0, 0.6, 0.2]),
    (Rayleigh(0.3, 1e-3), [0.3, 0.309, 0.4]), (Rayleigh(), [0.0, 0.0, 0.0]),
    (Rayleigh(stiffness_factor=0.01), [0.0, 0.09, 1.0]),
])
def test_modal_damping(damping, diagonal):
    assert modal_damping(damping, W) == pytest.approx(np.diag(diagonal), abs=1e-15)


def test_full_modal_damping_matrix():
    matrix = np.array([[0.1, 0.2, 0.0], [0.2, 0.5, 0.0], [0.0, 0.0, 1.0]])
    got = modal_damping(matrix, W)
    assert (got == matrix).all()
    assert got is not matrix


def test_rayleigh_damping_in_given_degrees_of_freedom():
    """a M + b K as a matrix and as Rayleigh factors give the same basis."""
    M, K = np.diag([2.5, 1.0]), np.array([[3.0, -1.0], [-1.0, 1.0]])
    factors = basis_from_matrices(M, K, chain_rows(), damping=Rayleigh(0.3, 0.02))
    matrix = basis_from_matrices(M, K, chain_rows(), damping=0.3 * M + 0.02 * K)
    assert factors.damping == pytest.approx(matrix.damping, abs=1e-14)
    w = factors.angular_frequencies
    assert factors.damping_ratios == pytest.approx(0.3 / (2.0 * w) + 0.01 * w, rel=1e-14)


def test_rayleigh_factors_are_checked():
    with pytest.raises(InputError, match="mass_factor = -1"):
        Rayleigh(-1.0)
    with pytest.raises(InputError, match="stiffness_factor = nan"):
        Rayleigh(0.0, float("nan"))


def test_damping_ratios_of_a_finite_element_body():
    body = ElasticBody(rectangle(1.0, 0.1, 10, 1), Material())
    basis = modal_basis(body, 5, contact="bottom", contact_nodes=1, damping=[0, 0, 0, 0.01, 0.03])
    assert basis.damping_ratios == pytest.approx([0, 0, 0, 0.01, 0.03], rel=1e-14)
    w = 2.0 * np.pi * eigenfrequencies_hz(body, 5)
    assert np.diag(basis.damping) == pytest.approx([0, 0, 0, 0.02 * w[3], 0.06 * w[4]], rel=1e-12)


# Signs and files ---------------------------------------------------------------------------------

def test_signs():
    shapes = np.array([[-0.5, 0.2, -1.0, -0.999], [0.4, -0.7, 1.0, 1.0], [0.1, 0.3, 0.2, 0.0]])
    assert fixed_signs(shapes).tolist() == [-1.0, -1.0, -1.0, -1.0]
    assert fixed_signs(-shapes).tolist() == [1.0, 1.0, 1.0, 1.0]


def test_signs_do_not_depend_on_the_solver():
    basis, again = chain(), chain()
    T = basis.contact_T[:, 0]
    assert (basis.T == again.T).all()
    largest = np.argmax(np.abs(T * [[np.sqrt(2.5)], [1.0]]), axis=0)
    assert largest.shape == (2,)
    first = np.argmax(np.abs(T) >= 0.99 * np.abs(T).max(axis=0), axis=0)
    assert (T[first, [0, 1]] > 0.0).all()


def test_saved_and_loaded(tmp_path):
    body = ElasticBody(rectangle(1.0, 0.1, 10, 2, points={"tip": (1.0, 0.1)}), Material())
    basis = modal_basis(body, 7, contact="bottom", contact_nodes=4, B="left", C=(0.5, 0.05),
                        points={"tip": "tip"}, damping=0.01)
    write_basis(tmp_path / "beam.h5", basis)
    loaded = read_basis(tmp_path / "beam.h5")
    for name in ("angular_frequencies", "damping", "T", "positions", "tributary"):
        assert np.array_equal(getattr(loaded, name), getattr(basis, name)), name
        assert getattr(loaded, name).dtype == getattr(basis, name).dtype
    assert loaded.extra == ("tip",)
    for name in ("nodes", "cells", "outline", "shapes", "stress"):
        stored, given = getattr(loaded.mode_shapes, name), getattr(basis.mode_shapes, name)
        assert np.array_equal(stored, given), name
        assert stored.dtype == given.dtype
    assert loaded.mode_shapes.restriction.shape == basis.mode_shapes.restriction.shape
    assert (loaded.mode_shapes.restriction != basis.mode_shapes.restriction).nnz == 0
    assert [path.name for path in tmp_path.iterdir()] == ["beam.h5"]


def test_saved_and_loaded_without_a_field(tmp_path):
    basis = chain()
    write_basis(str(tmp_path / "chain.h5"), basis)
    loaded = read_basis(str(tmp_path / "chain.h5"))
    assert loaded.mode_shapes is None
    assert loaded.extra == ()
    assert np.array_equal(loaded.T, basis.T)
    assert np.array_equal(loaded.damping, basis.damping)


def test_files_are_checked(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_basis(tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text("no basis")
    with pytest.raises(InputError, match="not an HDF5 file"):
        read_basis(tmp_path / "text.h5")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["data"] = 1.0
    with pytest.raises(InputError, match="no group 'basis'"):
        read_basis(tmp_path / "other.h5")
    with pytest.raises(InputError, match="does not exist"):
        write_basis(tmp_path / "nowhere" / "chain.h5", chain())


def test_an_old_file_survives_a_failed_save(tmp_path, monkeypatch):
    path = tmp_path / "chain.h5"
    write_basis(path, chain())
    before = path.read_bytes()

    def fail(*_):
        raise RuntimeError("disk full")

    monkeypatch.setattr("fecontact.output.files.hdf5.store_basis", fail)
    with pytest.raises(RuntimeError, match="disk full"):
        write_basis(path, chain(0.3))
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["chain.h5"]
