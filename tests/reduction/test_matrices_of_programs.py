"""Matrices in files of Nastran's OUTPUT4 and OUTPUT2, and of Ansys."""

import itertools
import struct
import sys
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from libraries import library
from scipy.sparse.linalg import eigsh

import fecontact as fc
from fecontact import InputError, MissingLibraryError, basis_from_matrices
from fecontact.fem.assembly import assembled
from fecontact.io import read_matrix
from fecontact.reduction import Recovery, rows_from_dofs

SIZE = 8
STIFFNESS = np.diag(np.r_[2.0 * np.ones(SIZE - 1), 1.0]) - np.eye(SIZE, k=1) - np.eye(SIZE, k=-1)
MASS = np.diag(np.arange(1.0, SIZE + 1.0))
# Cards as Nastran punches them: two points with displacements, and two scalar points.
EXTERNAL = ("BEGIN SUPER        7\n$ EXTRN DATA\n"
            "EXTRN          3     123      11     123 2995001       0 2995002       0\n")
LABELS = [[3, 1], [3, 2], [3, 3], [11, 1], [11, 2], [11, 3], [2995001, 0], [2995002, 0]]
op4 = library("pyyeti.nastran.op4")


def superelement(path, **how):
    op4.write(path, {"kxx": STIFFNESS, "mxx": MASS, "mug1": np.ones((3, SIZE))}, **how)
    return path


@pytest.mark.parametrize("how", [{"binary": True}, {"binary": False}, {"sparse": "bigmat"},
                                 {"endian": ">"}], ids=str)
@pytest.mark.parametrize("beside", ["s.pch", "s.asm"])
def test_external_superelements_of_output4(tmp_path, how, beside):
    path = superelement(tmp_path / "s.op4", **how)
    (tmp_path / beside).write_text(EXTERNAL)
    K, M = read_matrix(path, "KXX"), read_matrix(path, "mxx")
    assert (K.matrix != sp.csc_array(STIFFNESS)).nnz == 0
    assert (M.matrix != sp.csc_array(MASS)).nnz == 0
    assert K.labels.tolist() == M.labels.tolist() == LABELS
    assert K.dof(11, 2) == 4
    row = rows_from_dofs(SIZE, [[K.dof(11, 1), K.dof(11, 2)]])
    basis = basis_from_matrices(M, K, {"contact": row})
    exact = np.sqrt(np.linalg.eigvalsh(np.diag(1.0 / MASS.diagonal()**0.5) @ STIFFNESS
                                       @ np.diag(1.0 / MASS.diagonal()**0.5))) / (2.0 * np.pi)
    assert basis.frequencies_hz == pytest.approx(exact, rel=1e-10)


def test_labels_are_those_of_a_matrix_of_their_number(tmp_path):
    path = superelement(tmp_path / "s.op4")
    assert read_matrix(path, "KXX").labels is None
    (tmp_path / "s.pch").write_text("EXTRN          3     123\n")
    assert read_matrix(path, "KXX").labels is None
    with pytest.raises(InputError, match=r"does not name its degrees of freedom"):
        read_matrix(path, "KXX").dof(3, 1)


@pytest.mark.parametrize(("text", "message"), [
    ("EXTRN          3     123      11\n", "line 1 of .*s.pch ends after a point"),
    ("\nEXTRN          a     123\n", "line 2: 'a' is no number"),
])
def test_damaged_labels_are_said(tmp_path, text, message):
    path = superelement(tmp_path / "s.op4")
    (tmp_path / "s.pch").write_text(text)
    with pytest.raises(InputError, match=message):
        read_matrix(path, "KXX")


def test_names_are_those_of_the_file(tmp_path):
    path = superelement(tmp_path / "s.op4")
    with pytest.raises(InputError, match=r"holds: 'KXX', 'MUG1', 'MXX'"):
        read_matrix(path)
    with pytest.raises(InputError, match=r"no matrix 'KX' \(did you mean 'KXX'\?\)"):
        read_matrix(path, "KX")


def record(content):
    """A record of Fortran; whole numbers are keys."""
    words = struct.pack("<i", content) if isinstance(content, int) else content
    return struct.pack("<i", len(words)) + words + struct.pack("<i", len(words))


def output2(path, matrices):
    """A file of OUTPUT2: each matrix has a trailer, and its columns as strings of doubles."""
    parts = []
    for name, matrix in matrices.items():
        label = name.ljust(8).encode()
        parts += [2, label, -1, 7, struct.pack("<7i", 101, len(matrix.T), len(matrix), 6, 2, 8, 9),
                  -2, 1, 0, 4, label + struct.pack("<2i", 1, 1)]
        for number, column in enumerate(matrix.T):
            parts += [-3 - number, 1, 1]
            for row in np.flatnonzero(column):
                parts += [2, struct.pack("<id", row + 1, column[row])]
        parts += [-3 - len(matrix.T), 1, 0, 0]
    path.write_bytes(b"".join(map(record, parts)))
    return path


def test_matrices_of_output2(tmp_path):
    path = output2(tmp_path / "s.op2", {"KAA": STIFFNESS, "MAA": MASS})
    assert (read_matrix(path, "kaa").matrix == STIFFNESS).all()
    assert (read_matrix(path, "MAA").matrix == MASS).all()
    with pytest.raises(InputError, match=r"holds: 'KAA', 'MAA'"):
        read_matrix(path)


@pytest.mark.parametrize("suffix", [".op4", ".op2", ".full", ".rst"])
def test_other_files_are_no_matrices(tmp_path, suffix):
    path = tmp_path / f"s{suffix}"
    path.write_bytes(b"\0\1\2 some text" * 9)
    with pytest.raises(InputError, match=r"s\.\w+: "):
        read_matrix(path, "MODES" if suffix == ".rst" else "K")


def test_equations_of_ansys():
    """Matrices of an example of the reader's package; Ansys gives these frequencies [Hz]."""
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    K, M = (read_matrix(examples.fullfile, name) for name in ("STIFFNESS", "mass"))
    basis = basis_from_matrices(M, K, {}, modes=4, dimension=3)
    assert basis.frequencies_hz == pytest.approx([1283.200, 1283.200, 5781.975, 6919.399],
                                                 rel=1e-6)
    assert K.matrix.shape == (900, 900)
    # 321 nodes, of which 21 are held.
    assert len(np.unique(K.labels[:, 0])) == 300
    assert np.unique(K.labels[:, 1]).tolist() == [1, 2, 3]
    with pytest.raises(InputError, match="'MASS', 'STIFFNESS'"):
        read_matrix(examples.fullfile, "DAMPING")


@pytest.mark.filterwarnings("ignore")  # of the reader
def test_bricks_of_ansys_have_its_matrices_and_frequencies():
    """SOLID186 by default: stiffness at eight points, mass at the fourteen of Irons.

    The scale of one material is not that of the archive. Poisson's ratio of the results is 0.31.
    """
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    hertz = read_matrix(examples.rstfile, "frequencies").matrix[:, 0]
    places = read_matrix(examples.rstfile, "PLACES")
    body = fc.ElasticBody(fc.read_mesh(examples.hexarchivefile), fc.Material(7e10, 0.31, 2700.0))
    assert (body.serendipity, body.integration) == (True, "reduced")
    axes, corners = 0.795822425754222, 0.758786910639328
    points = np.concatenate([axes * np.eye(3), -axes * np.eye(3), corners * np.array(
        list(itertools.product((-1.0, 1.0), repeat=3)))])
    irons = (0.5 + 0.5 * points, np.repeat([0.886426592797784, 0.335180055401662], [6, 8]) / 8.0)
    _, lateral, shear = body.elasticity.T
    mass = sp.csr_array(sp.kron(assembled([replace(block, mass_rule=irons)
                                           for block in body.blocks], lateral, shear,
                                          body.densities)[1], sp.eye_array(3)))
    node = {number: int(np.linalg.norm(body.nodes - place, axis=1).argmin()) for number, place in
            zip(places.labels[::3, 0].tolist(), places.matrix.reshape(-1, 3), strict=True)}
    for name, own in (("STIFFNESS", body.stiffness), ("MASS", mass)):
        given = read_matrix(examples.fullfile, name)
        rows = [3 * node[number] + component - 1 for number, component in given.labels.tolist()]
        found, wanted = own.tocsr()[rows][:, rows], sp.csr_array(given.matrix)
        found = found * (wanted[0, 0] / found[0, 0])
        assert abs(found - wanted).max() < 1e-10 * abs(wanted).max()
    squares = eigsh(body.stiffness, 12, M=mass.tocsc(), sigma=-1e5, return_eigenvectors=False)
    ratio = np.sqrt(np.sort(squares)[6:]) / hertz
    assert ratio == pytest.approx(np.full(6, ratio[0]), rel=1e-9)
    # With the exact mass of the body.
    ratio = fc.modal_basis(body, 12, contact=()).frequencies_hz[6:] / hertz
    assert ratio == pytest.approx(np.full(6, ratio[0]), rel=1e-5)


@pytest.mark.filterwarnings("ignore")  # of the reader
def test_modes_of_ansys():
    """Modes of the reader's example, a free bar, beside this package's on its mesh."""
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    modes, hertz, places = (read_matrix(examples.rstfile, name)
                            for name in ("MODES", "frequencies", "PLACES"))
    body = fc.ElasticBody(fc.read_mesh(examples.hexarchivefile))
    shown = fc.ElasticBody(body.mesh, degree=1)
    points = dict(zip(places.labels[::3, 0].tolist(), places.matrix.reshape(-1, 3), strict=True))
    recovery = Recovery.of(shown, modes, points)
    own = fc.modal_basis(body, 12, contact=())
    # The results of the example are not those of the material in its archive, nu = 0.35.
    ratio = own.frequencies_hz[6:] / hertz.matrix[:, 0]
    assert ratio == pytest.approx(ratio[0], rel=1.5e-2)
    at = [int(np.linalg.norm(own.mode_shapes.nodes - place, axis=1).argmin())
          for place in shown.nodes]
    one = own.mode_shapes.shapes[at].reshape(-1, 12)[:, 6:]
    other = recovery.matrix.toarray()
    alike = (one.T @ other) ** 2 / np.outer((one**2).sum(axis=0), (other**2).sum(axis=0))
    # Bending modes come in pairs, which may be turned.
    for pair in ([0, 1], [2], [3, 4], [5]):
        assert alike[np.ix_(pair, pair)].sum(axis=0) == pytest.approx(1.0, abs=2e-3)
    # A basis with pictures: coordinates of the file are its six modes.
    row = modes.labels.tolist().index([1, 3])
    basis = fc.basis_from_modes(
        modes.matrix, rows_from_dofs(963, [[row - 2, row - 1, row]], dimension=3), dimension=3,
        frequencies_hz=hertz.matrix[:, 0], modal_mass=1.0, damping=0.01)
    assert basis.contact_T[0, :3] == pytest.approx(
        modes.matrix[row - 2 : row + 1] * np.sign(basis.contact_T[0, 2] * modes.matrix[row]))
    with pytest.raises(InputError, match="'FREQUENCIES', 'MODES', 'PLACES'"):
        read_matrix(examples.rstfile)
    with pytest.raises(InputError, match="no matrix 'STRESS'"):
        read_matrix(examples.rstfile, "STRESS")


@pytest.mark.parametrize(("suffix", "extra", "module"), [
    (".op4", "nastran", "pyyeti.nastran.op4"), (".op2", "nastran", "pyyeti.nastran.op2"),
    (".full", "ansys", "ansys.mapdl.reader"), (".rst", "ansys", "ansys.mapdl.reader")])
def test_without_the_library_its_extra_is_named(tmp_path, monkeypatch, suffix, extra, module):
    path = tmp_path / f"s{suffix}"
    path.write_bytes(b"any")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingLibraryError, match=rf"pip install 'fecontact\[{extra}\]'"):
        read_matrix(path, "K")
