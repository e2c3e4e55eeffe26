"""Cost of residual vectors beside that of the modes: 150,000 unknowns, 40 modes, 200 nodes.

Usage: python benchmarks/reduction.py [repetitions] [--quick]
"""

import statistics
import sys
import time

import numpy as np
from eigen import rectangle

from fecontact import ElasticBody, Mesh
from fecontact.fem.contact_face import contact_nodes
from fecontact.reduction.eigenmodes import FreeSystem, free_modes
from fecontact.reduction.static_modes.residual_vectors import (
    Flexibility,
    modal_compliance,
    residual_modes,
)

MODES, NODES = 40, 200


def main(repetitions: int = 3, quick: bool = False) -> None:
    """Print the table; quickly of meshes a hundred times smaller with fewer nodes, once."""
    shrink, nodes = (10, 8) if quick else (1, NODES)
    if quick:
        repetitions = 1
    print(f"{'body':24s} {'tolerance':>9s} {'vectors':>7s} {'modes [s]':>9s} {'all [s]':>8s} "
          f"{'ratio':>6s} {'missing':>9s}")
    for name, size, corners in (("slender beam, P2", (0.2, 0.02, 430, 43), 3),
                                ("slender beam, Q2", (0.2, 0.02, 430, 43), 4),
                                ("square, Q2", (0.1, 0.1, 136, 136), 4)):
        columns = size[2] // shrink
        plain = rectangle(*size[:2], columns, size[3] // shrink, corners)
        bottom = np.column_stack([np.arange(columns), np.arange(columns) + 1])
        body = ElasticBody(Mesh(plain.nodes, plain.cells, {"contact": bottom}))
        rows = contact_nodes(body, "contact", nodes).matrix
        rows = (rows[np.arange(rows.shape[0]) % 3 < 2] @ body.expansion).tocsr()
        for tolerance in (0.1, 0.05, 0.0):
            alone, whole = [], []
            for _ in range(repetitions):
                system = FreeSystem.of(body)
                begin = time.perf_counter()
                w, shapes = free_modes(system, MODES)
                middle = time.perf_counter()
                flexibility = Flexibility(system, rows)
                more, completing = residual_modes(
                    flexibility, w, shapes, tolerance, np.zeros((len(shapes), 0)))
                whole.append(time.perf_counter() - begin)
                alone.append(middle - begin)
            exact = np.diag(flexibility.compliance)
            kept = np.diag(modal_compliance(rows, np.concatenate([w, more]),
                                            np.hstack([shapes, completing])))
            ratio = statistics.median(a / b for a, b in zip(whole, alone, strict=True))
            print(f"{name:24s} {tolerance:9g} {len(more):7d} {statistics.median(alone):9.2f} "
                  f"{statistics.median(whole):8.2f} {ratio:6.2f} "
                  f"{np.abs(1.0 - kept / exact).max():9.1e}", flush=True)


if __name__ == "__main__":
    main(*(int(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
