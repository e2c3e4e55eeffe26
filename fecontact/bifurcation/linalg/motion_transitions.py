"""Transition matrices of linearised equations of motion, q'' = K(t) q + D(t) q'.

By collocation on equal intervals, with the accelerations at the collocation points as unknowns:
velocities and displacements follow from them, with a matrix A of the points, as

    v_i = v_0 + h sum_k A_ik a_k        q_i = q_0 + c_i h v_0 + h^2 sum_k (A A)_ik a_k

That is the method of :func:`fecontact.bifurcation.linalg.condensation.condense` with half the
unknowns. Eight intervals are solved at once, one in each SIMD lane.
"""

from functools import cache

import numpy as np

from fecontact.bifurcation.linalg.simd_lu import eliminate_simd
from fecontact.core.compiled import helper, kernel
from fecontact.core.records import Block, Matrix, Vector
from fecontact.core.simd.kinds import WIDTH
from fecontact.core.simd.vectors import gather, read, spread, write
from fecontact.core.types import Array


@cache
def integrals(points: tuple[float, ...]) -> tuple[Array, Array]:
    """A (s, s) and weights b (s,) of the collocation points c in (0, 1].

    They give integrals, from 0 to each point and to 1, of the polynomial through s values there.
    """
    c = np.array(points)
    basis = [np.polynomial.Polynomial.fromroots(np.delete(c, k)) for k in range(len(c))]
    whole = [(p / p(node)).integ() for p, node in zip(basis, c, strict=True)]
    return np.array([[p(x) for p in whole] for x in c]), np.array([p(1.0) for p in whole])


@helper
def _back(a, size, columns):
    """Solve for all right sides behind the first ``size`` columns of eliminated lanes."""
    for k in range(size - 1, -1, -1):
        c = size
        while c < columns:
            last = min(c + 4, columns)
            r0, r1 = read(a[k, c]), read(a[k, min(c + 1, last - 1)])
            r2, r3 = read(a[k, min(c + 2, last - 1)]), read(a[k, min(c + 3, last - 1)])
            for i in range(k + 1, size):
                factor = read(a[k, i])
                r0 = r0 - factor * read(a[i, c])
                r1 = r1 - factor * read(a[i, min(c + 1, last - 1)])
                r2 = r2 - factor * read(a[i, min(c + 2, last - 1)])
                r3 = r3 - factor * read(a[i, min(c + 3, last - 1)])
            inverse = read(a[k, k])
            write(a[k, c], r0 * inverse)
            if c + 1 < last:
                write(a[k, c + 1], r1 * inverse)
            if c + 2 < last:
                write(a[k, c + 2], r2 * inverse)
            if c + 3 < last:
                write(a[k, c + 3], r3 * inverse)
            c += 4


@kernel
def motion_transitions(
    J: Block, h: float, points: Vector, A: Matrix, b: Vector, out: Block,
) -> None:
    """Fill out (N, 2 m, 2 m) with the transition matrices of [q, q'] over N intervals of length h.

    J (N s, 2 m, 2 m) are the derivatives of [q', q''] at the collocation points, ``points`` (s,),
    A (s, s) and b (s,) those of :func:`integrals`.
    """
    N, d, s = out.shape[0], out.shape[1], len(points)
    m = d // 2
    size, columns = s * m, s * m + d
    workspace = np.empty((size * columns + 1) * WIDTH)
    a = workspace[: size * columns * WIDTH].reshape((size, columns, WIDTH))
    order, pivots = np.empty((size, WIDTH), dtype=np.int64), np.empty(WIDTH)
    places = np.empty(WIDTH, dtype=np.int64)
    values = J.reshape(-1)
    twice = np.zeros((s, s))
    total, once = np.zeros(s), np.empty(s)
    for i in range(s):
        for k in range(s):
            for j in range(s):
                twice[i, k] += A[i, j] * A[j, k]
            total[i] += b[k] * A[k, i]
        once[i] = h * points[i]
    for first in range(0, N, WIDTH):
        for i in range(s):
            for row in range(m):
                for lane in range(WIDTH):
                    places[lane] = ((min(first + lane, N - 1) * s + i) * d + m + row) * d
                for c in range(m):
                    by_place, by_speed = gather(values, places, c), gather(values, places, m + c)
                    for k in range(s):
                        own = 1.0 if k == i and c == row else 0.0
                        write(a[i * m + row, k * m + c], spread(own)
                              - spread(h * h * twice[i, k]) * by_place
                              - spread(h * A[i, k]) * by_speed)
                    write(a[i * m + row, size + c], by_place)
                    write(a[i * m + row, size + m + c], spread(once[i]) * by_place + by_speed)
        eliminate_simd(a, size, order, pivots)
        _back(a, size, columns)
        for lane in range(min(WIDTH, N - first)):
            M = out[first + lane]
            for i in range(m):
                for c in range(d):
                    place, speed = 0.0, 0.0
                    for k in range(s):
                        found = a[k * m + i, size + c, lane]
                        place += total[k] * found
                        speed += b[k] * found
                    own = 1.0 if c == i else 0.0
                    M[i, c] = own + h * h * place + (h if c == m + i else 0.0)
                    M[m + i, c] = h * speed + (1.0 if c == m + i else 0.0)
