"""Small dense systems of equations that may be singular."""

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import AnalysisError

Array = NDArray[np.float64]

_CONSISTENT = 1e-8


def solution(matrix: Array, rhs: Array) -> Array:
    """Solution (n,) of ``matrix x = rhs``; the shortest one of a singular system that has some.

    Raises
    ------
    AnalysisError
        If the system is singular and has none.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, rhs))
    except np.linalg.LinAlgError:
        x = np.linalg.lstsq(matrix, rhs, rcond=None)[0]
    left = np.abs(matrix @ x - rhs)
    if (left > _CONSISTENT * (np.abs(matrix) @ np.abs(x) + np.abs(rhs))).any():
        raise AnalysisError("The equations are singular and have no solution there: nothing "
                            "holds the solution in some direction.")
    return np.asarray(x)
