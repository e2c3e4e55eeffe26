"""Matrices of Ansys: equations of an analysis (.full) and its results (.rst), by PyMAPDL's reader.

An analysis writes the file of its equations, ``jobname.full``, where ``WRFULL`` asks for it or in a
modal analysis anyway. Results of a modal analysis are modes, mass-normalised by default.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError
from fecontact.core.extras import optional
from fecontact.core.types import Integers
from fecontact.reduction.matrix_files.names import chosen_name

# Displacements and rotations; Ansys counts on with temperatures and the like.
_MECHANICAL = 6
# Number of modal analyses in results files.
_MODAL = 2


def read_full(path: Path, name: str | None) -> tuple[Any, Integers]:
    """Matrix STIFFNESS or MASS (d, d) and the labels (d, 2) of its degrees of freedom.

    Those that are held are left out.

    Raises
    ------
    InputError
        For another name, and degrees of freedom that are no displacements or rotations.
    MissingLibraryError
        If PyMAPDL's reader is not installed.
    """
    import scipy.sparse as sp

    reader = optional("ansys.mapdl.reader", "Reading full files of Ansys")
    file = reader.read_binary(str(path))
    degrees, stiffness, mass = file.load_km(sort=True)
    matrices = {"STIFFNESS": stiffness, "MASS": mass}
    upper = matrices[chosen_name(matrices, None if name is None else name.upper())]
    if upper is None:
        raise InputError("The file holds no mass; write it in a modal analysis.")
    if degrees[:, 1].max(initial=0) >= _MECHANICAL:
        raise InputError("The file has degrees of freedom that are no displacements or rotations.")
    size = int(degrees[:, 0].max()) + 1
    held = degrees[:, 1] * size + degrees[:, 0]
    free = ~np.isin(held, file.const[:, 1] * size + file.const[:, 0])
    whole = sp.csc_array(upper + sp.triu(upper, 1).T)[free][:, free]
    return whole, degrees[free].astype(np.int64) + np.array([0, 1])


def read_rst(path: Path, name: str | None) -> tuple[NDArray[np.float64], Integers | None]:
    """Results of a modal analysis by name.

    MODES (d, m) with labels (d, 2), node and direction; FREQUENCIES (m, 1) [Hz]; PLACES (d, 1),
    coordinates of the nodes with labels (d, 2), node and axis.

    Raises
    ------
    InputError
        For another name, and files that hold no modes.
    MissingLibraryError
        If PyMAPDL's reader is not installed.
    """
    reader = optional("ansys.mapdl.reader", "Reading results of Ansys")
    results = ("MODES", "FREQUENCIES", "PLACES")
    chosen = chosen_name(results, None if name is None else name.upper())
    file = reader.read_binary(str(path))
    kind = getattr(getattr(file, "_resultheader", None), "get", lambda _: None)("kan")
    if not hasattr(file, "nodal_solution") or kind != _MODAL:
        raise InputError("The file holds no results of a modal analysis.")
    if chosen == "FREQUENCIES":
        return np.array(file.time_values, float)[:, None], None
    nodes = np.array(file.mesh.nnum if chosen == "PLACES" else file.nodal_solution(0)[0])
    if chosen == "PLACES":
        values = np.array(file.mesh.nodes, float)[:, :3]
    else:
        values = np.stack([file.nodal_solution(k)[1] for k in range(file.n_results)], axis=2)
    width = values.shape[1]
    labels = np.column_stack([np.repeat(nodes, width), np.tile(np.arange(1, width + 1),
                                                               len(nodes))])
    return values.reshape(len(labels), -1), labels.astype(np.int64)
