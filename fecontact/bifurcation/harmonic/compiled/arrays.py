"""Arrays of compiled harmonic balance: equations, workspace, results of steps."""

from typing import NamedTuple

import numpy as np

from fecontact.core.records import Array4, Block, IntegerVector, Matrix, Vector
from fecontact.system.nodes import SystemArrays


class Workspace(NamedTuple):
    """Workspace of one orbit; n unknown coefficients of m modes, N samples, d states.

    Modes in ``order`` (m,), of which the first ``coupled`` (1,) are solved for together, k
    coefficients, the others each for itself with the mean stiffness and damping ``alone`` (2, m);
    ``extent`` (3, m, 2 m) is least, largest and mean derivative of the contact forces.
    ``square`` and ``condensed`` hold (k, k) and (k, k + 1) derivatives, ``a`` factors of (k + 1,
    k + 1); ``column`` (n,) is the derivative to the parameter, ``linear`` (2, m, m) are stiffness
    and damping. ``along`` (n + 1,) is the solution of the equations without right side that has one
    in the last row. Plain contact forces are found row by row over the samples: ``motion`` (2 m, N)
    displacements and velocities, ``contact_forces`` (m, N), ``node`` (9, N) what belongs to a node;
    ``widths`` (m, N) is what kinks add, see
    :func:`fecontact.bifurcation.harmonic.compiled.kinks.add_kinks`. ``friction`` (3, t n, N) is
    that of elements which are followed one by one, with what it is beside the parameter;
    ``by_node`` (t n, N, d (2 H + 1)) are its derivatives, ``left`` (N, c) work array for
    deflections.
    """

    t: Vector
    x: Matrix
    y: Matrix
    z: Matrix
    target: Matrix
    f: Matrix
    f_marched: Matrix
    J: Block
    J_marched: Block
    coefficients: Block
    rows: Matrix
    spectra: Vector
    square: Vector
    followed: Block
    forces: Block
    slopes: Array4
    condensed: Vector
    a: Vector
    pivots: IntegerVector
    order: IntegerVector
    coupled: IntegerVector
    alone: Matrix
    extent: Block
    linear: Block
    column: Vector
    residual: Vector
    perturbed: Vector
    along: Vector
    vectors: Matrix
    motion: Matrix
    contact_forces: Matrix
    node: Matrix
    widths: Matrix
    friction: Block
    by_node: Block
    left: Matrix


class Equations(NamedTuple):
    """Equations of orbits over one parameter p, and how a branch is followed.

    Arrays of ``contact`` that depend on p are parts of ``flat`` = ``base`` + p ``slope``. Where the
    loads are affine in p at the samples, it is the system of the contact forces alone; stiffness
    and damping are ``body`` (4, m, m), values at p = 0 and slopes of both, loads ``given`` (2, N,
    m) at the samples, and ``load_harmonics`` (2, 2 H + 1, m). Otherwise ``contact`` is the whole
    system and these are zero. ``springs`` (c, m) and ``offsets`` (c,) give the deflections to
    which internal variables return, ``blocks`` (n,) how many of a node act on each other; these are
    none where all are elements that are followed one by one, ``elements`` (n,) their numbers, with
    ``kept_offsets`` (c,) of those that never slide. Then ``contact`` is without them, ``whole``
    with them. ``onsets`` (k, n) the penetrations at which normal forces have kinks. Numbers are the
    period times p or 0, the period, least and largest p for which this holds, whether contact
    forces do not depend on p and t, whether they are plain, of displacements and velocities in the
    plane alone, bounds of the branch, tolerance, largest step, largest turn, Newton's rounding,
    whether folds are located, whether all forces at rest have no mean; and of Newton's method the
    size of a second step over the square of the first, negative if unknown, with the number of
    times it was relied on; and whether contact forces may have kinks; and what
    :func:`fecontact.bifurcation.harmonic.elements.element_forces` returned last. ``limits`` (m,)
    bound the scales of the displacements; ``nodes`` have internal variables. ``kept`` are the rows
    of the coefficients (2 H + 1, m) that are unknown, the others are zero. Last are addresses of
    the functions of :mod:`fecontact.bifurcation.harmonic.compiled.evaluation` that evaluate and
    condense these equations, and of that of elements, zero without any.
    """

    contact: SystemArrays
    flat: Vector
    base: Vector
    slope: Vector
    tau: Vector
    values: Matrix
    projection: Matrix
    cosines: Matrix
    sines: Matrix
    body: Block
    given: Block
    load_harmonics: Block
    springs: Matrix
    offsets: Vector
    blocks: IntegerVector
    elements: IntegerVector
    kept_offsets: Vector
    whole: SystemArrays
    onsets: Matrix
    limits: Vector
    numbers: Vector
    nodes: int
    kept: IntegerVector
    workspace: Workspace
    evaluate: int
    condense: int
    element_forces: int


(TURN, PERIOD, LOW, HIGH, STEADY, PLAIN, FIRST_BOUND, LAST_BOUND, TOLERANCE, LARGEST_STEP,
 LARGEST_TURN, ROUNDING, FOLDS, RESTS, SQUARE, TRUSTED, KINKS, TIMED) = range(18)

class Reached(NamedTuple):
    """Points that were reached, K at most.

    u, tangent (K, n + 1), internal variables z (K, N, c), accelerations (K, N, m), mean derivatives
    of these (K, m, 2 m) to q and q', scales (K, m + 1) for the step behind, lengths (K,) of the
    steps, which points are folds (K,), and ``step`` (1,).
    """

    u: Matrix
    tangent: Matrix
    z: Block
    forces: Block
    mean: Block
    scales: Matrix
    lengths: Vector
    folds: IntegerVector
    step: Vector


def workspace_for(
    harmonics: int, samples: int, modes: int, memory: int, nodes: int, coupled: int,
    exact: bool, axes: int,
) -> Workspace:
    """Workspace for a system of so many modes and internal variables, on so many nodes.

    At most ``coupled`` modes are solved for together. Internal variables that are ``exact`` are
    those of elements that are followed one by one; nodes move along so many ``axes``.
    """
    deflections, followed = memory, nodes * (axes - 1) if exact else 0
    memory = 0 if exact else memory
    L, N, m, c = 2 * harmonics + 1, samples, modes, memory
    n, d, k = L * m, 2 * m + c, L * coupled
    s = c // nodes if nodes else 0
    return Workspace(
        np.empty(N), np.empty((N, d)), np.empty((N, d)), np.empty((N, deflections)),
        np.empty((N, c)),
        np.empty((N, d)), np.empty((N if c else 0, d)), np.empty((N, d, d)),
        np.empty((N if c else 0, d, d)),
        np.empty((2, m, L)), np.empty((max(m, 2 * coupled**2), N)), np.empty(4 * L * coupled**2),
        np.empty(k * k), np.empty((N if c else 0, c, n + 1)),
        np.empty((N if c else 0, m, n + 1)), np.empty((N, nodes, s, s)), np.empty(k * (k + 1)),
        np.empty((k + 1) ** 2), np.empty(k + 1, dtype=np.int64), np.arange(m),
        np.array([coupled]), np.empty((2, m)), np.empty((3, m, 2 * m)), np.empty((2, m, m)),
        np.empty(n), np.empty(n), np.empty(n), np.empty(n + 1), np.empty((16, n + 1)),
        np.empty((d - c, N)), np.empty((m, N)), np.empty((9, N)), np.zeros((m, N)),
        np.empty((3, followed, N)), np.empty((followed, N, axes * L)),
        np.empty((N, deflections if exact else 0)))
