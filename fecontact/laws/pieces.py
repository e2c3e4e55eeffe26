r"""Normal laws that are polynomials of the penetration piece by piece.

Between two penetrations the force is

.. math:: F = e_0 + e_1 u + e_2 u^2 + (d_0 + d_1 u + d_2 u^2)\, v

where :math:`r_0 + r_1 u + r_2 v > 0`, and zero elsewhere: contacts do not pull. Pieces are rows of
lower and upper penetration, e, d and r; a piece without force has zeros.
"""

from collections.abc import Sequence

import numpy as np

from fecontact.core.types import Array

# Columns of a piece.
LOWER, UPPER, ELASTIC, DAMPING, RELEASE = 0, 1, 2, 5, 8
PIECE = 11


def pieces_of(nodes: int, rows: Sequence[Sequence[Array | float]]) -> Array:
    """Pieces (n, p, 11) of n nodes from entries that are the same for all or given for each."""
    table = np.zeros((nodes, len(rows), PIECE))
    for k, row in enumerate(rows):
        for column, entry in enumerate(row):
            table[:, k, column] = entry
    return table
