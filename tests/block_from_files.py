"""A free steel block from files of matrices in every format, and from modes.

Its lower face is the contact, B and C are two of its nodes. Matrices agree to round-off, the
universal file to the six digits that it holds.
"""

from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from fecontact import ModalBasis, basis_from_matrices, basis_from_modes
from fecontact.io import AssembledMatrix, read_matrix, read_uff
from fecontact.reduction import normalisation, rows_from_dofs

DATA = Path(__file__).resolve().parent / "data"
MODES = 8
CONTACT_X = [0.0, 0.025, 0.05, 0.075, 0.1]
# Mass and stiffness: files, and names in the files.
FILES = {
    "Matrix Market": ("block_mass.mtx", None, "block_stiffness.mtx", None),
    "Abaqus, COORDINATE": ("block_MASS1.mtx", None, "block_STIF1.mtx", None),
    "Abaqus, MATRIX INPUT": ("block_MASS2.mtx", None, "block_STIF2.mtx", None),
    "MATLAB 5": ("block.mat", "M", "block.mat", "K"),
    "MATLAB 7.3": ("block_v73.mat", "M", "block_v73.mat", "K"),
    "SciPy": ("block_mass.npz", None, "block_stiffness.npz", None),
    "NumPy, several arrays": ("block.npz", "M", "block.npz", "K"),
    "NumPy": ("block_mass.npy", None, "block_stiffness.npy", None),
}


def rows(stiffness: AssembledMatrix) -> dict[str, object]:
    """Points of interest: nodes 101 ... 105 touch the ground, B is 106 and C 113."""
    def place(node: int) -> tuple[int, int]:
        if stiffness.labels is not None:
            return stiffness.dof(node, 1), stiffness.dof(node, 2)
        return 2 * (node - 101), 2 * (node - 101) + 1  # two for each node, in order

    return rows_from_dofs(stiffness.matrix.shape[0], [place(node) for node in range(101, 106)],
                          B=place(106), C=place(113))


def from_files(mass: str, mass_name: str | None, stiffness: str,
               stiffness_name: str | None) -> ModalBasis:
    """The basis of two matrices."""
    M, K = read_matrix(DATA / mass, mass_name), read_matrix(DATA / stiffness, stiffness_name)
    return basis_from_matrices(M, K, rows(K), modes=MODES, damping=0.01, contact_x=CONTACT_X)


def from_own_modes() -> ModalBasis:
    """The basis of modes of another solver, scaled to a length of one as it happens."""
    M, K = (read_matrix(DATA / f"block_{name}.npy") for name in ("mass", "stiffness"))
    squares, shapes = eigh(K.matrix, M.matrix, subset_by_index=[0, MODES - 1])
    shapes /= np.linalg.norm(shapes, axis=0)
    assert normalisation(shapes, M).name == "length one"
    w = np.sqrt(np.where(np.arange(MODES) < 3, 0.0, squares))  # a free plane body: three are rigid
    return basis_from_modes(shapes, rows(K), angular_frequencies=w, mass=M, damping=0.01,
                            contact_x=CONTACT_X)


def bases() -> dict[str, ModalBasis]:
    """The basis by each way in."""
    found = {name: from_files(*files) for name, files in FILES.items()}
    found["modes of SciPy"] = from_own_modes()
    found["universal file"] = read_uff(DATA / "block.uff").modal_basis(
        contact=range(101, 106), B=106, C=113)
    return found


def difference(basis: ModalBasis, other: ModalBasis) -> tuple[float, float]:
    """Largest relative differences of frequencies, and of T.

    Rigid modes may be rotated among themselves; their products are compared instead.
    """
    r = other.rigid_modes
    w, expected = basis.angular_frequencies[r:], other.angular_frequencies[r:]
    T, reference = basis.T_matrix, other.T_matrix
    rigid = T[:, :r] @ T[:, :r].T - reference[:, :r] @ reference[:, :r].T
    return (float(np.abs(w / expected - 1.0).max()),
            float(max(np.abs(T[:, r:] - reference[:, r:]).max() / np.abs(reference).max(),
                      np.abs(rigid).max() / np.abs(reference).max() ** 2)))
