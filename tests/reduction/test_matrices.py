"""Files of matrices: one body in every format, what each format allows, and damaged files."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import block_from_files as block
import h5py
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from fecontact import InputError, basis_from_matrices, modal_basis
from fecontact.io import AssembledMatrix, read_matrix

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="module")
def make():
    """The script that wrote the files."""
    spec = importlib.util.spec_from_file_location("make", DATA / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def written(path, text):
    path.write_text(text)
    return path


def full(found):
    return found.matrix.toarray() if sp.issparse(found.matrix) else found.matrix


# One body in every format ------------------------------------------------------------------------

def test_every_way_in_gives_the_same_basis(make):
    expected = modal_basis(make.block(), block.MODES, contact="bottom", contact_nodes="all")
    for name, basis in block.bases().items():
        of_frequencies, _ = block.difference(basis, expected)
        assert of_frequencies < (2e-5 if name == "universal file" else 1e-10), name
        elastic = slice(3, None)
        for rows, reference in ((basis.T[0], expected.T[0]), (basis.T[1], expected.T[1]),
                                (basis.contact_T, expected.contact_T)):
            error = rows[..., :2, elastic] - reference[..., :2, elastic]
            limit = (2e-5 if name == "universal file" else 1e-9) * np.abs(reference).max()
            assert np.abs(error).max() < limit, name


@pytest.mark.parametrize("files", block.FILES.values(), ids=block.FILES)
def test_files_hold_the_matrices_of_the_body(make, files):
    body = make.block()
    for path, name, matrix in ((*files[:2], body.mass), (*files[2:], body.stiffness)):
        found = read_matrix(DATA / path, name)
        # 16 digits are written.
        assert np.abs(full(found) - matrix.toarray()).max() < 1e-15 * np.abs(matrix).max()
        assert found.source == str(DATA / path)
        if "2.mtx" in path:
            assert found.labels.tolist() == [[101 + k // 2, 1 + k % 2] for k in range(30)]
        else:
            assert found.labels is None


def test_files_are_small_and_made_by_the_script(make, tmp_path, monkeypatch):
    names = {path.name for path in DATA.iterdir() if path.suffix not in (".py", ".md")} - {
        "__pycache__"}
    assert all((DATA / name).stat().st_size < 20_000 for name in names)
    monkeypatch.setattr(make, "HERE", tmp_path)
    make.main()
    assert {path.name for path in tmp_path.iterdir()} == names
    for name in names:
        if name.endswith(".uff"):
            assert len((tmp_path / name).read_text()) == len((DATA / name).read_text())


# Abaqus ------------------------------------------------------------------------------------------

K2 = [[2.0, -1.0], [-1.0, 3.0]]


@pytest.mark.parametrize("text", [
    "1 1  2.0e+00\n1 2 -1.0e+00\n2 1 -1.0e+00\n2 2  3.0e+00\n",
    "1 1 2.\n2 1 -1.\n2 2 3.\n",
    "1 1 2.\n1 2 -1.\n2 2 3.",
    "** written by hand\n1, 1, 2.\n\n1, 2, -1.  ** the coupling\n2, 2, 3.\n",
])
def test_coordinates_in_one_or_both_triangles(tmp_path, text):
    found = read_matrix(written(tmp_path / "K.mtx", text))
    assert full(found).tolist() == K2
    assert found.labels is None


def test_square_files_are_taken_as_they_are(tmp_path):
    """With both triangles there, a difference between them stays, and is found later."""
    text = "1 1 2.\n1 2 -1.\n2 1 -1.5\n2 2 3.\n"
    found = read_matrix(written(tmp_path / "K.mtx", text))
    assert full(found).tolist() == [[2.0, -1.0], [-1.5, 3.0]]
    with pytest.raises(InputError, match=r"mass matrix \(.*K\.mtx\) is not symmetric"):
        basis_from_matrices(found, np.eye(2), {"contact": np.zeros((1, 3, 2))})


def test_matrix_input_with_internal_nodes(tmp_path):
    """Nodes in any order; internal ones, with negative numbers, come last."""
    text = ("** comment\n*MATRIX INPUT, NAME=K, TYPE=SYMMETRIC, SCALE FACTOR=2.\n"
            "-1,1, -1,1,  3.0e+01\n7,1, -1,1,  5.0\n-2,1, -2,1,  4.0\n"
            "7,1, 7,1,  1.0\n5,2, 7,1,  6.0\n5,2, 5,2,  8.0\n5,6, 5,6, 9.0\n")
    found = read_matrix(written(tmp_path / "K.mtx", text))
    assert found.labels.tolist() == [[5, 2], [5, 6], [7, 1], [-1, 1], [-2, 1]]
    assert (full(found) / 2.0).tolist() == [
        [8, 0, 6, 0, 0], [0, 9, 0, 0, 0], [6, 0, 1, 5, 0], [0, 0, 5, 30, 0], [0, 0, 0, 0, 4]]
    assert found.dof(7, 1) == 2
    assert found.dof(-2, 1) == 4
    with pytest.raises(InputError, match=r"K\.mtx: there is no degree of freedom in direction 1 at "
                                         r"node 5; node 5 has the directions \[2, 6\]"):
        found.dof(5, 1)
    with pytest.raises(InputError, match=r"direction 1 at node 9; its nodes run from -2 to 7"):
        found.dof(9, 1)


def test_unsymmetric_matrix_input(tmp_path):
    text = "*matrix input, name=K, type=unsymmetric\n1,1,1,1,2.\n1,1,2,1,5.\n2,1,2,1,3.\n"
    found = read_matrix(written(tmp_path / "K.mtx", text))
    assert full(found).tolist() == [[2.0, 5.0], [0.0, 3.0]]


def test_several_matrices_in_one_file(tmp_path):
    path = written(tmp_path / "both.mtx", "*MATRIX INPUT, NAME=K\n1,1,1,1,2.\n"
                                          "*MATRIX INPUT, NAME=M\n1,1,1,1,7.\n")
    assert full(read_matrix(path, "K")).tolist() == [[2.0]]
    assert full(read_matrix(path, "M")).tolist() == [[7.0]]
    with pytest.raises(InputError, match=r"both\.mtx: Say which matrix .* holds: 'K', 'M'\."):
        read_matrix(path)
    with pytest.raises(InputError, match=r"no matrix 'KK' \(did you mean 'K'\?\); .* 'K', 'M'\."):
        read_matrix(path, "KK")


def test_held_nodes_of_a_beam(tmp_path):
    """A clamped Euler-Bernoulli element of length 1, EI = rho A = 1, as Abaqus writes it.

    Consistent mass, free end only: the lower root is 12.48 1/s^2, 3.533 for the frequency.
    """
    stiffness = {(1, 2, 1, 2): 1e36, (1, 6, 1, 2): 6, (2, 2, 1, 2): -12, (2, 6, 1, 2): 6,
                 (1, 6, 1, 6): 1e36, (2, 2, 1, 6): -6, (2, 6, 1, 6): 2, (2, 2, 2, 2): 12,
                 (2, 6, 2, 2): -6, (2, 6, 2, 6): 4}
    mass = {(1, 2, 1, 2): 156, (1, 6, 1, 2): 22, (2, 2, 1, 2): 54, (2, 6, 1, 2): -13,
            (1, 6, 1, 6): 4, (2, 2, 1, 6): 13, (2, 6, 1, 6): -3, (2, 2, 2, 2): 156,
            (2, 6, 2, 2): -22, (2, 6, 2, 6): 4}
    texts = ["".join("{},{}, {},{}, {:.15e}\n".format(*key, value * factor)
                     for key, value in entries.items())
             for entries, factor in ((mass, 1.0 / 420.0), (stiffness, 1.0))]
    M, K = (read_matrix(written(tmp_path / name, text))
            for name, text in zip(("M.mtx", "K.mtx"), texts, strict=True))
    row = np.zeros((1, 3, 4))
    row[0, 1, K.dof(2, 2)] = row[0, 2, K.dof(2, 6)] = 1.0
    basis = basis_from_matrices(M, K, {"contact": row})
    # (12 - 156 s)(4 - 4 s) = (6 - 22 s)^2 with w^2 = 420 s: 35 s^2 - 102 s + 3 = 0.
    roots = 420.0 * (102.0 + np.array([-1.0, 1.0]) * np.sqrt(102.0**2 - 420.0)) / 70.0
    assert basis.angular_frequencies == pytest.approx(np.sqrt(roots), rel=1e-12)
    assert basis.angular_frequencies[0] == pytest.approx(3.516, rel=6e-3)  # the continuous beam


@pytest.mark.parametrize(("text", "message"), [
    ("1 1 2.\n1 2\n", "Line 2 has 2 columns, but the lines before it have 3"),
    ("** head\n1 1 2.\n\n1 x 2.\n", "Line 4: 'x' is not a number; .* FORMAT=COORDINATE"),
    ("1 1 2.\n2 1 1.\n0 1 2.\n", "Line 3 has the row or column 0; they are counted from 1"),
    ("1 1 2.\n1 1.5 2.\n", "Line 2 has a row, column, node or direction that is no whole number"),
    ("1,1,1,1,2.\n1,1.5,1,1,2.\n", "Line 2 has a row, column, node"),
    ("1,1,1,1,1,2.\n", "six columns, one matrix for each element; leave out ELEMENT BY ELEMENT"),
    ("1 2 3 4\n", "Line 1 has 4 columns; there must be three .* or five"),
    ("1 1 2.\n2 2 1.\n1 1 2.\n", "Line 3 gives an entry a second time"),
    ("*MATRIX INPUT, NAME=K\n1,1,1,1,2.\n1,1,1,1,2.\n", "Line 3 gives an entry a second time"),
    ("*MATRIX INPUT, NAME=K, INPUT=other.mtx\n", "refers to 'other.mtx'"),
    ("** Assembled nodal loads\n*CLOAD, REAL\n2,3, 5.0\n", r"holds loads \(\*CLOAD\), not a matri"),
    ("*MATRIX,TYPE=STIFFNESS\n1.0, 2.0\n", r"holds something else \(\*MATRIX\)"),
    ("", "holds no numbers"), ("** nothing\n", "holds no numbers"),
    ("*MATRIX INPUT, NAME=K\n** nothing\n", "holds no numbers"),
    ("1 1 nan\n", None),
])
def test_damaged_abaqus_files(tmp_path, text, message):
    path = written(tmp_path / "K.mtx", text)
    if message is None:
        with pytest.raises(InputError, match=r"\(.*K\.mtx\) holds values that are not finite"):
            basis_from_matrices(np.eye(1), read_matrix(path), {"contact": np.zeros((1, 3, 1))})
        return
    with pytest.raises(InputError, match=r"K\.mtx: .*" + message):
        read_matrix(path)


def test_two_files_of_different_models(tmp_path):
    M = read_matrix(written(tmp_path / "M.mtx", "1,1, 1,1, 2.\n2,1, 2,1, 2.\n"))
    K = read_matrix(written(tmp_path / "K.mtx", "1,1, 1,1, 2.\n2,1, 2,1, 2.\n2,2, 2,2, 1.\n"))
    with pytest.raises(InputError, match=r"K\.mtx\) has node 2, direction 2, but the mass matrix "
                                         r"\(.*M\.mtx\) has not; write both from one model"):
        basis_from_matrices(M, K, {"contact": np.zeros((1, 3, 3))})


def test_files_without_names_of_degrees_of_freedom():
    with pytest.raises(InputError, match="does not name its degrees of freedom; give them by numb"):
        AssembledMatrix(np.eye(2), None, "K.npy").dof(1, 1)


# Other formats -----------------------------------------------------------------------------------

@pytest.mark.parametrize(("head", "body"), [
    ("coordinate real symmetric", "2 2 3\n1 1 2\n2 1 -1\n2 2 3\n"),
    ("coordinate integer general", "2 2 4\n1 1 2\n2 1 -1\n1 2 -1\n2 2 3\n"),
    ("array real general", "2 2\n2\n-1\n-1\n3\n"),
])
@pytest.mark.parametrize("suffix", [".mtx", ".mm", ".MTX"])
def test_matrix_market(tmp_path, head, body, suffix):
    path = written(tmp_path / f"K{suffix}", f"%%MatrixMarket matrix {head}\n% comment\n{body}")
    found = read_matrix(path)
    assert full(found).tolist() == K2
    assert found.matrix.dtype == float


@pytest.mark.parametrize(("text", "message"), [
    ("%%MatrixMarket matrix coordinate pattern symmetric\n1 1 1\n1 1\n", r"\(pattern\); write it"),
    ("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 2\n", "complex; write its re"),
    ("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1.\n", "cannot be read, it is dam"),
    ("%%MatrixMarket matrix coordinate real general\n1 1 1\n1 z 1.\n", r"cannot be .* \(Line 3"),
])
def test_damaged_matrix_market_files(tmp_path, text, message):
    with pytest.raises(InputError, match=r"K\.mtx: .*" + message):
        read_matrix(written(tmp_path / "K.mtx", text))


def test_matlab_files(tmp_path):
    path = tmp_path / "model.mat"
    scipy.io.savemat(path, {"K": np.array(K2), "names": np.array(["a", "b"]), "n": 2.0,
                            "sub": {"M": np.eye(2)}})
    assert full(read_matrix(path)).tolist() == K2
    assert full(read_matrix(path, "n")).tolist() == [[2.0]]
    with pytest.raises(InputError, match=r"no matrix 'M'.*; the file holds: 'K', 'n'\."):
        read_matrix(path, "M")
    with pytest.raises(InputError, match=r"block\.mat: Say which .* the file holds: 'K', 'M'"):
        read_matrix(DATA / "block.mat")


def test_matlab_73_files(tmp_path):
    """Dense variables are stored by columns; text, cells and structures are left out."""
    path = tmp_path / "model.mat"
    rectangular = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    with h5py.File(path, "w", userblock_size=512) as file:
        file["shapes"] = rectangular.T
        file["shapes"].attrs["MATLAB_class"] = np.bytes_("double")
        file["name"] = np.array([[75], [101]], dtype=np.uint16)
        file["name"].attrs["MATLAB_class"] = np.bytes_("char")
        file.create_group("#refs#")["a"] = np.eye(2)
        file.create_group("structure")["M"] = np.eye(2)
        empty = file.create_group("empty")
        empty.attrs["MATLAB_sparse"] = np.uint64(3)
        empty["jc"] = np.zeros(5, dtype=np.uint64)
        file["z"] = np.array([(1.0, 2.0)], dtype=[("real", float), ("imag", float)])[:, None]
    assert full(read_matrix(path, "shapes")).tolist() == rectangular.tolist()
    assert full(read_matrix(path, "empty")).tolist() == np.zeros((3, 4)).tolist()
    with pytest.raises(InputError, match="complex"):
        read_matrix(path, "z")
    with pytest.raises(InputError, match=r"no matrix 'name'.*; .* holds: 'empty', 'shapes', 'z'\."):
        read_matrix(path, "name")


def test_numpy_files(tmp_path):
    np.save(tmp_path / "K.npy", np.array(K2, dtype=np.float32))
    assert full(read_matrix(tmp_path / "K.npy")).tolist() == K2
    np.savez(tmp_path / "K.npz", K=np.array(K2, dtype=int), n=np.array(3))
    assert full(read_matrix(tmp_path / "K.npz")).tolist() == K2
    sp.save_npz(tmp_path / "S.npz", sp.csr_matrix(K2))
    assert full(read_matrix(tmp_path / "S.npz")).tolist() == K2
    with pytest.raises(InputError, match="one matrix without a name; leave out name = 'K'"):
        read_matrix(tmp_path / "S.npz", "K")
    np.save(tmp_path / "vector.npy", np.ones(3))
    with pytest.raises(InputError, match=r"vector\.npy: the array of shape \(3,\) .* is no matrix"):
        read_matrix(tmp_path / "vector.npy")
    np.save(tmp_path / "objects.npy", np.array([None, {}]), allow_pickle=True)
    with pytest.raises(InputError, match=r"objects\.npy: the file cannot be read"):
        read_matrix(tmp_path / "objects.npy")


@pytest.mark.parametrize("suffix", [".mat", ".npz", ".npy"])
def test_files_of_another_kind(tmp_path, suffix):
    path = written(tmp_path / f"K{suffix}", "this is no matrix at all\n" * 20)
    with pytest.raises(InputError, match=rf"K\{suffix}: the file cannot be read, it is damaged"):
        read_matrix(path)


def test_other_files():
    with pytest.raises(InputError, match=r"K\.op3: matrices are not read .* suffixes that are: "
                                         r"\.dmig, \.full, \.mat, \.mm, \.mtx, \.npy, \.npz, "
                                         r"\.op2, \.op4, \.pch"):
        read_matrix("K.op3")
    with pytest.raises(InputError, match=r"K\.mtx: there is no such file"):
        read_matrix("K.mtx")


def _npz(path, form, **arrays):
    np.savez(path, format=form.encode(), shape=np.array(arrays.pop("shape", (3, 3))), **arrays)


def _hdf5(path, jc, ir, data, rows=3):
    with h5py.File(path, "w") as file:
        group = file.create_group("K")
        group.attrs["MATLAB_sparse"] = np.uint64(rows)
        for name, values in (("jc", jc), ("ir", ir), ("data", data)):
            group[name] = values


_ONES = np.ones(3)
_STARTS = np.array([0, 1, 2, 3], dtype=np.int32)
UNSOUND = {
    "csr-high.npz": lambda path: _npz(path, "csr", data=_ONES, indptr=_STARTS, indices=np.array(
        [0, 1, 100_000_000], dtype=np.int32)),
    "csr-negative.npz": lambda path: _npz(path, "csr", data=_ONES, indptr=_STARTS, indices=np.array(
        [0, 1, -50_000_000], dtype=np.int32)),
    "csc-starts.npz": lambda path: _npz(path, "csc", data=_ONES, indices=np.arange(3), indptr=(
        np.array([0, 900_000_000, 2, 3], dtype=np.int32))),
    "bsr.npz": lambda path: _npz(path, "bsr", data=np.ones((3, 1, 1)), indptr=_STARTS, indices=(
        np.array([0, 1, 70_000_000], dtype=np.int32))),
    "coo.npz": lambda path: _npz(path, "coo", data=_ONES, row=np.array([0, 1, 10**8]),
                                 col=np.arange(3)),
    "dia.npz": lambda path: _npz(path, "dia", data=np.ones((1, 3)), offsets=np.array([10**8])),
    "wide.npz": lambda path: _npz(path, "csr", shape=(3, 10**13), data=_ONES, indptr=_STARTS,
                                  indices=np.arange(3)),
    "long.npz": lambda path: _npz(path, "coo", shape=(10**13, 10**13), data=_ONES,
                                  row=np.arange(3), col=np.arange(3)),
    "high.mat": lambda path: _hdf5(path, _STARTS, np.array([0, 1, 10**8]), _ONES),
    "starts.mat": lambda path: _hdf5(path, np.array([0, 5 * 10**8, 2, 3]), np.arange(3), _ONES),
    "rows.mat": lambda path: _hdf5(path, _STARTS, np.arange(3), _ONES, rows=10**15),
    "count.mtx": lambda path: path.write_text(
        f"%%MatrixMarket matrix coordinate real general\n3 3 {10**12}\n1 1 1.0\n"),
    "dense.mtx": lambda path: path.write_text(
        "%%MatrixMarket matrix array real general\n1000000 1000000\n1.0\n"),
    "beyond.mtx": lambda path: path.write_text(
        "%%MatrixMarket matrix coordinate real general\n3 3 1\n9 1 1.0\n"),
    "size.mtx": lambda path: path.write_text(
        f"%%MatrixMarket matrix coordinate real general\n{10**12} {10**12} 1\n1 1 1.0\n"),
    "large.mtx": lambda path: path.write_text(f"1 1 1.0\n{10**15} {10**15} 1.0\n"),
    "infinite.mtx": lambda path: path.write_text("1 1 1.0\n1e300 inf 1.0\n"),
    "label.mtx": lambda path: path.write_text("1, 1, 1, 1, 1.0\n1e17, 1, 1e17, 1, 1.0\n"),
    "header.npy": lambda path: path.write_bytes(_npy_header((10**6, 10**6))),
    "negative.npy": lambda path: path.write_bytes(_npy_header((-3, 3)) + bytes(72)),
}


def _npy_header(shape):
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return np.lib.format.magic(1, 0) + len(text).to_bytes(2, "little") + text.encode()


_READ = """
import resource, sys
from fecontact import InputError
from fecontact.io import read_matrix
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
for path in sys.argv[1:]:
    try:
        matrix = read_matrix(path).matrix
        print("read", abs(matrix).sum(), matrix.T.tocsr().sum())
    except InputError as error:
        print(error)
"""


def test_unsound_matrices_are_refused_before_they_are_used(tmp_path):
    """In a process of its own: compiled code would write where such indices point."""
    for name, write in UNSOUND.items():
        write(tmp_path / name)
    done = subprocess.run(
        [sys.executable, "-c", _READ, *(str(tmp_path / name) for name in UNSOUND)],
        capture_output=True, text=True, check=False, timeout=100,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])})
    assert done.returncode == 0, done.stderr[-500:]
    lines = done.stdout.splitlines()
    assert len(lines) == len(UNSOUND)
    for name, line in zip(UNSOUND, lines, strict=True):
        assert line.startswith(f"{tmp_path / name}"), line
        assert "MemoryError" not in line


@pytest.mark.parametrize("form", ["csr", "csc", "bsr", "coo", "dia"])
def test_sound_sparse_matrices_of_all_forms_are_read(tmp_path, form):
    matrix = sp.random_array((6, 6), density=0.4, rng=np.random.default_rng(1)) + sp.eye_array(6)
    sp.save_npz(tmp_path / "k.npz", matrix.asformat(form))
    assert np.array_equal(read_matrix(tmp_path / "k.npz").matrix.toarray(), matrix.toarray())
