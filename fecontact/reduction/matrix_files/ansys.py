"""Matrices of Ansys: the assembled equations of an analysis (.full), by PyMAPDL's reader.

An analysis writes the file of its equations, ``jobname.full``, where ``WRFULL`` asks for it or in a
modal analysis anyway.
"""

from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.extras import optional
from fecontact.core.types import Integers
from fecontact.reduction.matrix_files.names import chosen_name

# Displacements and rotations; Ansys counts on with temperatures and the like.
_MECHANICAL = 6


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
