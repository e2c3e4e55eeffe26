"""The Rosenbrock-Wanner method Rodas5P: eight stages, order five, stiffly accurate, L-stable.

For y' = f(t, y) with J = df/dy the stages u_i of a step h solve

    (I / (h gamma) - J) u_i = f(t + c_i h, y + sum_j A_ij u_j) + sum_j C_ij u_j / h + d_i h df/dt

and the step ends at y + sum_j A_8j u_j + u_8, whose last term estimates the error. The embedded
solution has order four, and so has the interpolant

    (1 - s) y_0 + s (y_1 + (1 - s) (k_1 + s (k_2 + s k_3))),    k_l = sum_j DENSE_lj u_j

at t + s h. Coefficients: G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and
numerical benchmarks within the Julia Differential Equations package, BIT 63 (2023) 27.
"""

import numpy as np

from fecontact.core.compiled import helper
from fecontact.core.simd.functions import by_kind
from fecontact.core.simd.vectors import fused, read, spread, write

STAGES = 8
ORDER = 5
GAMMA = 0.21193756319429014

_LAST = [-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256,
         0.030198172008377946]


def _lower(*rows: list[float]) -> np.ndarray:
    """Rows of coefficients, filled up with zeros to the seven stages that may precede one."""
    table = np.zeros((STAGES, STAGES - 1))
    for row, values in zip(table[1:], rows, strict=True):
        row[: len(values)] = values
    return table


A = _lower(
    [3.0],
    [2.849394379747939, 0.45842242204463923],
    [-6.954028509809101, 2.489845061869568, -10.358996098473584],
    [2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641],
    _LAST,
    [*_LAST, 1.0],
    [*_LAST, 1.0, 1.0],
)
C = _lower(
    [-14.155112264123755],
    [-17.97296035885952, -2.859693295451294],
    [147.12150275711716, -1.41221402718213, 71.68940251302358],
    [165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306],
    [24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125,
     -0.6610691825249471],
    [30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783,
     -19.097331116725623, -28.087943162872662],
    [37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047,
     -40.06618937091002, -54.66780262877968, -9.48861652309627],
)
NODES = np.array([0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716,
                  0.4288403609558664, 1.0, 1.0, 1.0])
TIME = np.array([GAMMA, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734,
                 2.325825639765069, 0.0, 0.0, 0.0])
DENSE = np.array([
    [25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204,
     0.524948541321073, 1.1241088310450404, 0.4272876194431874, -0.17202221070155493],
    [-9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796,
     20.176138334709044, 15.98066361424651, -6.789040303419874, -6.710236069923372],
    [11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643,
     -52.072871366152654, -59.78993625266729, -0.15582684282751913, 4.883087185713722],
])


# From here on, stages begin at the end of the stage before.
_ENDS = 6
# By stages that add something, and what the stage just before adds.
_A_COLUMNS, _C_COLUMNS = np.ascontiguousarray(A.T), np.ascontiguousarray(C.T)
_A_LAST, _C_LAST = (np.array([0.0, *np.diagonal(table, -1)]) for table in (A, C))


@helper
def combined(row, factor, base, stages, out):
    """Out = base + factor * sum_j row_j stages_j over the seven stages that may precede one."""
    a0, a1, a2, a3 = factor * row[0], factor * row[1], factor * row[2], factor * row[3]
    a4, a5, a6 = factor * row[4], factor * row[5], factor * row[6]
    for i in range(len(out)):
        out[i] = (base[i] + a0 * stages[0, i] + a1 * stages[1, i] + a2 * stages[2, i]
                  + a3 * stages[3, i] + a4 * stages[4, i] + a5 * stages[5, i] + a6 * stages[6, i])


@helper
def _begin_sums(base, sums):
    for k in range(len(base)):
        write(sums[0, k], spread(base[k]))
        write(sums[1, k], spread(0.0))


@helper
def _need_no_sums(base, sums):
    """The stages of eight systems are summed up anew."""


# Fill ``sums`` (2, size, 8) for steps from the state ``base``; see :func:`next_stage`.
begin_stages = by_kind(_begin_sums, _need_no_sums)


@helper
def _by_sums(i, rise, base, stages, sums, place, right):
    """The last stage is one product away from what it is needed for.

    ``sums`` hold what the stages before it add, for all stages to come.
    """
    a, c = read(_A_COLUMNS[i - 1]), read(_C_COLUMNS[i - 1])
    for k in range(len(base)):
        u = stages[i - 1, k]
        place[k] = sums[0, k, i] + _A_LAST[i] * u
        right[k] = rise * (sums[1, k, i] + _C_LAST[i] * u)
        write(sums[0, k], fused(a, spread(u), read(sums[0, k])))
        write(sums[1, k], fused(c, spread(u), read(sums[1, k])))


@helper
def _by_stages(i, rise, base, stages, sums, place, right):
    """The last two stages begin where the stage before each ends."""
    if i < _ENDS:
        for k in range(len(base)):
            moved, pushed = 0.0, 0.0
            for j in range(i):
                moved += A[i, j] * stages[j, k]
                pushed += C[i, j] * stages[j, k]
            place[k], right[k] = base[k] + moved, rise * pushed
    else:
        for k in range(len(base)):
            pushed = 0.0
            for j in range(i):
                pushed += C[i, j] * stages[j, k]
            place[k], right[k] = place[k] + stages[i - 1, k], rise * pushed


# Fill place = base + sum_j A_ij u_j and right = rise * sum_j C_ij u_j of stage i > 0.
next_stage = by_kind(_by_sums, _by_stages)


@helper
def dense_coefficients(stages, out):
    """Fill out (3, size) with the coefficients k_1, k_2, k_3 of the interpolant."""
    for row in range(3):
        a0, a1, a2, a3 = DENSE[row, 0], DENSE[row, 1], DENSE[row, 2], DENSE[row, 3]
        a4, a5, a6, a7 = DENSE[row, 4], DENSE[row, 5], DENSE[row, 6], DENSE[row, 7]
        for i in range(out.shape[1]):
            out[row, i] = (a0 * stages[0, i] + a1 * stages[1, i] + a2 * stages[2, i]
                           + a3 * stages[3, i] + a4 * stages[4, i] + a5 * stages[5, i]
                           + a6 * stages[6, i] + a7 * stages[7, i])


@helper
def interpolated(s, before, after, dense, out):
    """Fill out with the state at the part s of the step."""
    for i in range(len(out)):
        out[i] = one_interpolated(s, i, before, after, dense)


@helper
def one_interpolated(s, i, before, after, dense):
    """Entry i of the state at the part s of the step."""
    return (1.0 - s) * before[i] + s * (after[i] + (1.0 - s) * (
        dense[0, i] + s * (dense[1, i] + s * dense[2, i])))


@helper
def inner_coefficients(before, after, dense, out):
    """Fill out (3, size) with the Bernstein coefficients of the interpolant but the outer ones.

    It is of degree four; the first of its five coefficients is the state before the step, the
    last that after it.
    """
    for i in range(out.shape[1]):
        a, c, k1, k2, k3 = before[i], after[i], dense[0, i], dense[1, i], dense[2, i]
        out[0, i] = 0.75 * a + 0.25 * (c + k1)
        out[1, i] = 0.5 * (a + c) + k1 / 3.0 + k2 / 6.0
        out[2, i] = 0.25 * (a + k1 + k2 + k3) + 0.75 * c
