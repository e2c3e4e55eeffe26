"""Modes of a body with 150,000 unknowns: fecontact against scipy's default, side by side.

Usage: python benchmarks/eigen.py [repetitions] [--quick]
"""

import statistics
import sys
import time

import numpy as np
from scipy.sparse.linalg import eigsh

from fecontact import ElasticBody, Mesh
from fecontact.reduction.eigenmodes import backward_error, eigenmodes

MODES = 20


def rectangle(length: float, height: float, nx: int, ny: int, corners: int) -> Mesh:
    """Structured mesh of a rectangle with triangles (3 corners) or quadrilaterals (4)."""
    x, y = np.meshgrid(np.linspace(0.0, length, nx + 1), np.linspace(0.0, height, ny + 1))
    first = (np.arange(nx) + (nx + 1) * np.arange(ny)[:, None]).ravel()
    quads = np.column_stack([first, first + 1, first + nx + 2, first + nx + 1])
    cells = quads if corners == 4 else np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh(np.column_stack([x.ravel(), y.ravel()]), cells)


def main(repetitions: int = 3, quick: bool = False) -> None:
    """Print the table; quickly of meshes a hundred times smaller, once."""
    shrink = 10 if quick else 1
    if quick:
        repetitions = 1
    print(f"{'body':34s} {'scipy [s]':>10s} {'fecontact [s]':>14s} {'ratio':>6s} {'error':>9s}")
    for name, size, corners in (
        ("slender beam", (0.2, 0.02, 430, 43), 3), ("slender beam", (0.2, 0.02, 430, 43), 4),
        ("square", (0.1, 0.1, 136, 136), 3), ("square", (0.1, 0.1, 136, 136), 4),
    ):
        columns, rows = size[2] // shrink, size[3] // shrink
        name += f" {columns} x {rows}, {'P2' if corners == 3 else 'Q2'}"
        body = ElasticBody(rectangle(*size[:2], columns, rows, corners))
        K, M = body.stiffness, body.mass
        # A small part of the lowest elastic eigenvalue: near enough, and K - sigma M is regular.
        sigma = -1e-3 * float(eigenmodes(body, 4)[0][3] ** 2)
        theirs, ours = [], []
        for _ in range(repetitions):
            begin = time.perf_counter()
            eigsh(K, k=MODES, M=M, sigma=sigma)
            theirs.append(time.perf_counter() - begin)
            begin = time.perf_counter()
            w, shapes = eigenmodes(body, MODES)
            ours.append(time.perf_counter() - begin)
        ratio = statistics.median(a / b for a, b in zip(ours, theirs, strict=True))
        error = backward_error(K, M, w**2, shapes).max()
        print(f"{name + f', {K.shape[0]} unknowns':34s} {statistics.median(theirs):10.2f} "
              f"{statistics.median(ours):14.2f} {ratio:6.2f} {error:9.1e}")


if __name__ == "__main__":
    main(*(int(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
