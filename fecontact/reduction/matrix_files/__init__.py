"""Files of mass, stiffness and damping matrices."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_path, require_regular_file
from fecontact.core.errors import InputError, MissingLibraryError
from fecontact.core.files.hdf5_check import open_hdf5
from fecontact.core.files.stored import array, npy_array, npz_arrays, reading, sound_sparse, values
from fecontact.core.read_only import read_only_arrays
from fecontact.reduction.matrix_files.abaqus import read_abaqus_matrix
from fecontact.reduction.matrix_files.ansys import read_full, read_rst
from fecontact.reduction.matrix_files.names import chosen_name
from fecontact.reduction.matrix_files.nastran import read_dmig, read_op2, read_op4
from fecontact.reduction.matrix_files.substructure import HEADING, read_substructure

_BANNER = b"%%MatrixMarket"
# Suffixes of files that hold matrices, but that no library reads, and what to do instead.
_UNREAD = {
    ".sub": "superelements of Ansys (.sub) are not read; write them as Matrix Market in Ansys, by "
            "*DMAT,K,D,IMPORT,SUB,NAME.sub,STIFF and *EXPORT,K,MMF,K.mtx (and with MASS for the "
            "mass), or read the equations of the whole part (.full).",
    ".fil": "results files of Abaqus (.fil) are not read; write matrices as text, by *SUBSTRUCTURE "
            "MATRIX OUTPUT, OUTPUT FILE=USER DEFINED.",
}


@read_only_arrays
@dataclass(frozen=True, eq=False)
class AssembledMatrix:
    """A matrix from a file.

    Attributes
    ----------
    matrix : (d, d) array or sparse array
        In the units of the file. Recovery matrices and mode shapes are (k, d).
    labels : (d, 2) or (k, 2) integer array or None
        Node and direction (1, 2, 3: displacements; 4, 5, 6: rotations) of each row; None where the
        file does not name them.
    source : str
        The file, for messages.
    """

    matrix: Any
    labels: NDArray[np.int64] | None
    source: str

    def dof(self, node: int, direction: int) -> int:
        """Number of a degree of freedom, counted from 0.

        Raises
        ------
        InputError
            If the file does not name degrees of freedom, or lacks this one.
        """
        if self.labels is None:
            raise InputError(f"{self.source}: the file does not name its degrees of freedom; give "
                             f"them by number.")
        found = np.flatnonzero((self.labels == (node, direction)).all(axis=1))
        if not found.size:
            here = self.labels[self.labels[:, 0] == node, 1].tolist()
            what = f"node {node} has the directions {here}" if here else \
                f"its nodes run from {self.labels[:, 0].min()} to {self.labels[:, 0].max()}"
            raise InputError(f"{self.source}: there is no degree of freedom in direction "
                             f"{direction} at node {node}; {what}.")
        return int(found[0])


def read_matrix(path: str | Path, name: str | None = None) -> AssembledMatrix:
    """Read a mass, stiffness or damping matrix, or mode shapes, from a file.

    Matrix Market (.mtx, .mm), MATLAB (.mat up to version 7.3), NumPy and SciPy (.npy, .npz), and
    the text files of Abaqus' ``*MATRIX OUTPUT`` (.mtx) in the formats COORDINATE and MATRIX
    INPUT and of ``*SUBSTRUCTURE MATRIX OUTPUT`` (named STIFFNESS, MASS), and DMIG of Nastran's
    punch files (.pch, .dmig); the format of a .mtx file is found from its content. One triangle of
    a symmetric matrix suffices. By pyYeti (``fecontact[nastran]``) OUTPUT4 and OUTPUT2 of Nastran
    (.op4, .op2): an external superelement (EXTSEOUT) has KXX and MXX in its OUTPUT4, in MUG1 the
    displacements of the points that were asked for (see :class:`~fecontact.reduction.Recovery`),
    and labels if the punch file of the same name, .pch or .asm, lies beside it. By PyMAPDL's reader
    (``fecontact[ansys]``) the equations of Ansys (.full; named STIFFNESS, MASS), without the
    degrees of freedom that are held, and results of its modal analyses (.rst; named MODES,
    FREQUENCIES [Hz], PLACES).

    Parameters
    ----------
    path : str or Path
        The file.
    name : str, optional
        Name of the matrix in a file with several.

    Raises
    ------
    InputError
        If the file or matrix does not exist, or the file is damaged or of another kind.
    MissingLibraryError
        If the library that reads such files is not installed.
    """
    path = as_path(path, "a matrix")
    readers = {".mtx": _read_mtx, ".mm": _read_mtx, ".mat": _read_mat, ".npz": _read_npz,
               ".npy": _read_npy, ".pch": read_dmig, ".dmig": read_dmig, ".op4": read_op4,
               ".op2": read_op2, ".full": read_full, ".rst": read_rst}
    if path.suffix.lower() in _UNREAD:
        raise InputError(f"{path}: {_UNREAD[path.suffix.lower()]}")
    if path.suffix.lower() not in readers:
        raise InputError(f"{path}: matrices are not read from files of this kind; the suffixes "
                         f"that are: {', '.join(sorted(readers))}.")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    require_regular_file(path, "a matrix")
    try:
        matrix, labels = readers[path.suffix.lower()](path, name)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    except (MemoryError, MissingLibraryError):
        raise
    except Exception as error:
        # Damaged files make readers raise anything.
        detail = " ".join(str(error).split()).rstrip(".")
        raise InputError(f"{path}: the file cannot be read, it is damaged or of another kind"
                         f"{f' ({detail[:200]})' * bool(detail)}.") from error
    return AssembledMatrix(_real(path, matrix), labels, str(path))


def _read_mtx(path: Path, name: str | None) -> tuple[Any, NDArray[np.int64] | None]:
    with path.open("rb") as stream:
        first = stream.readline()
    if not first.startswith(_BANNER):
        text = path.read_text(encoding="utf-8", errors="replace")
        if f"*{HEADING}" in text.upper():
            return read_substructure(text, name)
        return read_abaqus_matrix(path, name)
    from scipy.io import mminfo, mmread

    _require_no_name(name)
    if b"pattern" in first.lower():
        raise InputError("The Matrix Market file says where the matrix has entries, but not which "
                         "(pattern); write it with values.")
    rows, columns, entries, form, _, symmetry = mminfo(path)
    if form == "array":
        entries = rows * columns // (1 if symmetry == "general" else 2)
    if 2 * entries > path.stat().st_size:  # a digit and a blank each, at least
        raise InputError(f"The file declares {entries} numbers, more than it holds.")
    return mmread(path, spmatrix=False), None


def _read_mat(path: Path, name: str | None) -> tuple[Any, None]:
    import h5py

    if h5py.is_hdf5(path):
        with open_hdf5(path) as file:
            return _chosen({key: _from_hdf5(file[key]) for key in file
                            if not key.startswith("#")}, name), None
    from scipy.io import loadmat

    variables = loadmat(path, spmatrix=False)
    return _chosen({key: value for key, value in variables.items()
                    if not key.startswith("__")}, name), None


def _from_hdf5(item: Any) -> Any:
    """A variable of a MATLAB 7.3 file: stored by columns, sparse ones as a group."""
    import h5py
    import scipy.sparse as sp

    if isinstance(item, h5py.Dataset):
        if item.attrs.get("MATLAB_class") in (b"char", b"cell"):
            return None
        value = values(item).T
        return value["real"] + 1j * value["imag"] if value.dtype.names else value
    if "MATLAB_sparse" not in item.attrs:
        return None
    starts = array(item, "jc", (None,), "i")
    shape = (int(item.attrs["MATLAB_sparse"]), len(starts) - 1)
    if "data" not in item:
        return sp.csc_array(shape)
    return sp.csc_array((values(item["data"]), array(item, "ir", (None,), "i"), starts),
                        shape=shape)


def _read_npz(path: Path, name: str | None) -> tuple[Any, None]:
    import scipy.sparse as sp

    arrays = npz_arrays(path)
    if {"format", "shape", "data"} <= set(arrays):
        _require_no_name(name)
        return sp.load_npz(path), None
    return _chosen(arrays, name), None


def _read_npy(path: Path, name: str | None) -> tuple[Any, None]:
    _require_no_name(name)
    with path.open("rb") as stream:
        return npy_array(stream, path.stat().st_size), None


def _chosen(variables: Mapping[str, Any], name: str | None) -> Any:
    """The variable of that name, or the only matrix among them."""
    matrices = {key: value for key, value in variables.items()
                if getattr(value, "ndim", 0) == 2 and value.dtype.kind in "biufc"}
    large = {key: value for key, value in matrices.items() if min(value.shape) > 1} or matrices
    return matrices[chosen_name(matrices, name, large)]


def _require_no_name(name: str | None) -> None:
    if name is not None:
        raise InputError(f"The file holds one matrix without a name; leave out name = '{name}'.")


def _real(path: Path, matrix: Any) -> Any:
    import scipy.sparse as sp

    if matrix.dtype.kind == "c":
        raise InputError(f"{path}: the matrix is complex; write its real part.")
    if matrix.ndim != 2 or matrix.dtype.kind not in "biuf":
        raise InputError(f"{path}: the array of shape {matrix.shape} and type {matrix.dtype} is "
                         f"no matrix of numbers.")
    if not sp.issparse(matrix):
        return np.asarray(matrix, float)
    with reading(path, "no sound sparse matrix"):
        return sp.csc_array(sound_sparse(matrix), dtype=float)
