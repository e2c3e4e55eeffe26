"""Best-fitting rigid motion of several nodes or of samples of a face."""

from typing import Any

import numpy as np

from fecontact.core.types import Array, Integers

# Axes with the two that follow them.
TURNS = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


def mean_motion(
    count: int, nodes: Integers, places: Array, weights: Array
) -> tuple[Any, Array]:
    """Rows of the best-fitting rigid motion of nodes (k,) with weights (k,), and their centre (d,).

    Rows (3, 2 N) in the plane, (6, 3 N) in space: displacements of the centre, then rotations.
    """
    import scipy.sparse as sp

    if places.shape[1] == 3:
        return sampled_rows(count, nodes[:, None], np.ones((len(nodes), 1)), places, weights)
    share = weights / weights.sum()
    centre = share @ places
    arm = places - centre
    arm = share[:, None] * arm / (share @ arm**2).sum()
    data = np.concatenate([share, share, -arm[:, 1], arm[:, 0]])
    row = np.repeat([0, 1, 2, 2], len(nodes))
    column = np.concatenate([2 * nodes, 2 * nodes + 1, 2 * nodes, 2 * nodes + 1])
    return sp.csr_array(sp.coo_array((data, (row, column)), shape=(3, 2 * count))), centre


def sampled_rows(
    count: int, nodes: Integers, values: Array, places: Array, weights: Array
) -> tuple[Any, Array]:
    """Rows (6, 3 N) of samples' best-fitting rigid motion, and their centre (3,).

    Sample q is at ``places`` (q, 3), moves as ``values`` (q, n) times the displacements of its
    ``nodes`` (q, n), and counts with ``weights`` (q,). Samples on a line give no rotation about it.
    """
    import scipy.sparse as sp

    share = weights / weights.sum()
    centre = share @ places
    arm = places - centre
    spread = (share[:, None] * arm).T @ arm
    # [arm]_x turns a displacement into its moment.
    cross = np.zeros((len(arm), 3, 3))
    for axis, ahead, last in TURNS:
        cross[:, axis, last], cross[:, axis, ahead] = arm[:, ahead], -arm[:, last]
    turning = np.linalg.pinv(np.trace(spread) * np.eye(3) - spread, rcond=1e-9,
                             hermitian=True) @ cross
    each = np.concatenate([np.broadcast_to(np.eye(3), cross.shape), turning], axis=1)
    data = (share[:, None] * values)[:, :, None, None] * each[:, None]
    row = np.broadcast_to(np.arange(6)[:, None], data.shape)
    column = np.broadcast_to(3 * nodes[:, :, None, None] + np.arange(3), data.shape)
    matrix = sp.csr_array(sp.coo_array((data.ravel(), (row.ravel(), column.ravel())),
                                       shape=(6, 3 * count)))
    matrix.eliminate_zeros()
    return matrix, centre
