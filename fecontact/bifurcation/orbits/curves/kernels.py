"""Compiled loops over the Gauss points of curves of orbits.

Arrays at Gauss points are (N m, d) for N intervals of m points, nodes as in
:mod:`fecontact.bifurcation.orbits.collocation_kernels`.
"""

import math
from typing import NamedTuple

from fecontact.core.compiled import kernel
from fecontact.core.records import Block, ComplexMatrix, Matrix, Vector


@kernel
def open_values(nodes: Matrix, end: Vector, values: Matrix, out: Matrix) -> None:
    """Fill out (N m, d) with the values of nodes (N m, d) that end at ``end`` (d,)."""
    m = len(values)
    total, d = nodes.shape
    for j in range(total // m):
        for point in range(m):
            row = j * m + point
            for i in range(d):
                out[row, i] = 0.0
            for k in range(m + 1):
                node, value = j * m + k, values[point, k]
                for i in range(d):
                    out[row, i] += value * (nodes[node, i] if node < total else end[i])


@kernel
def applied(matrices: Block, vectors: Matrix, out: Matrix) -> None:
    """Fill out (N m, d) with the products of matrices (N m, d, d) and vectors."""
    rows, d = vectors.shape
    for row in range(rows):
        for i in range(d):
            total = 0.0
            for c in range(d):
                total += matrices[row, i, c] * vectors[row, c]
            out[row, i] = total


@kernel
def multiplied(
    real: Block, imaginary: Block, sign: float, vectors: ComplexMatrix, out: ComplexMatrix,
) -> None:
    """Fill out (N m, d) with the products of matrices, real + sign i imaginary, and vectors."""
    rows, d = vectors.shape
    for row in range(rows):
        for i in range(d):
            total = 0.0j
            for c in range(d):
                total += complex(real[row, i, c], sign * imaginary[row, i, c]) * vectors[row, c]
            out[row, i] = total


@kernel
def unit_factor(widths: Vector, part: Matrix, before: Matrix) -> float:
    """Factor that gives part (N m, d) the mean square one, and the direction of ``before``.

    Where there are no such vectors before, these are (0, 0).
    """
    total, d = part.shape
    m = total // len(widths)
    square, along = 0.0, 0.0
    for row in range(total):
        own = 0.0
        for i in range(d):
            own += part[row, i] ** 2
            if len(before) > 0:
                along += part[row, i] * before[row, i]
        square += widths[row // m] * own
    return math.copysign(1.0 / math.sqrt(square), along if len(before) > 0 else 1.0)


@kernel
def central(up: Block, down: Block, here: Block, step: float, first: Block, second: Block) -> None:
    """Fill first and second (N m, d, k), differences of matrices to both sides and here."""
    rows, d, columns = up.shape
    one, two = 0.5 / step, 1.0 / (step * step)
    for row in range(rows):
        for i in range(d):
            for c in range(columns):
                a, b = up[row, i, c], down[row, i, c]
                first[row, i, c] = one * (a - b)
                second[row, i, c] = two * ((a + b) - 2.0 * here[row, i, c])


class TermDerivatives(NamedTuple):
    """Derivatives of the rates at N m Gauss points.

    ``J`` (N m, d, d) and ``P`` (N m, d, q) to states and parameters; ``bend`` and ``shift`` of
    these along the states of a term.
    """

    J: Block
    P: Block
    bend: Block
    shift: Block


@kernel
def add_term(
    left: Matrix, states: Matrix, period: float, T: float, widths: Vector,
    derivatives: TermDerivatives, points: Matrix, common: Vector,
) -> None:
    """Add a term to the derivative of a test function, see the module ``singularity``.

    ``points`` (N m, d) are its derivatives to the states at the Gauss points, over the width of
    the interval, ``common`` those to the period, where there is room, and to the parameters.
    """
    J, P, bend, shift = derivatives.J, derivatives.P, derivatives.bend, derivatives.shift
    rows, d, q = P.shape
    m = rows // len(widths)
    first = len(common) - q
    for row in range(rows):
        h = widths[row // m]
        for i in range(d):
            w = left[row, i]
            along = 0.0
            for c in range(d):
                points[row, c] += w * (T * bend[row, i, c] + period * J[row, i, c])
                along += J[row, i, c] * states[row, c]
            if first > 0:
                common[0] += h * w * along
            for c in range(q):
                common[first + c] += h * w * (T * shift[row, i, c] + period * P[row, i, c])
