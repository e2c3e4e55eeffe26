"""Cost of residual vectors beside that of the modes: 150,000 unknowns, 40 modes, 200 nodes.

Usage: python benchmarks/reduction.py [repetitions] [--quick]
       python benchmarks/reduction.py --solid [unknowns] [nodes] [modes ...] [--quick]

The solid is a cube of quadratic tetrahedra with 20 and with 40 elastic modes, by default of 150,000
unknowns with 400 contact nodes of three directions each, at the tolerance of 0.1.
"""

import statistics
import sys
import time

import numpy as np
import scipy.sparse as sp
from eigen import block, rectangle
from usage import explain

from fecontact import ElasticBody, Material, Mesh
from fecontact.fem.contact_face import contact_nodes
from fecontact.reduction.eigenmodes import FreeSystem, free_modes
from fecontact.reduction.reduce_body import displacement_rows
from fecontact.reduction.static_modes.flexibility import Flexibility, modal_compliance
from fecontact.reduction.static_modes.residual_vectors import flexibility_of, residual_modes

MODES, NODES = 40, 200
SOLID_MODES = (20, 40)


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
                flexibility = Flexibility(system, rows, (w, shapes))
                more, completing = residual_modes(flexibility, tolerance,
                                                  np.zeros((len(shapes), 0)))
                whole.append(time.perf_counter() - begin)
                alone.append(middle - begin)
            exact = np.diag(flexibility.compliance)
            kept = np.diag(modal_compliance(rows, np.concatenate([w, more]),
                                            np.hstack([shapes, completing])))
            ratio = statistics.median(a / b for a, b in zip(whole, alone, strict=True))
            print(f"{name:24s} {tolerance:9g} {len(more):7d} {statistics.median(alone):9.2f} "
                  f"{statistics.median(whole):8.2f} {ratio:6.2f} "
                  f"{np.abs(1.0 - kept / exact).max():9.1e}", flush=True)


def solid(unknowns: int = 150_000, nodes: int = 400, *modes: int) -> None:
    """Print times of the clock and of all cores for a cube, and what is missing at some rows."""
    plain = block("cube", unknowns)
    below = plain.outline[(plain.nodes[plain.outline, 2] < 1e-9).all(axis=1)]
    body = ElasticBody(Mesh(plain.nodes, plain.cells, {"contact": below}), Material.named("steel"))
    rows = sp.csr_array(displacement_rows(contact_nodes(body, "contact", nodes).matrix, 3)
                        @ body.expansion)
    some = rows[:: -(-rows.shape[0] // 60)]
    forces = some.T.toarray()
    exact = (forces * FreeSystem.of(body).deflection(forces, 1e-6)).sum(axis=0)

    def clocks() -> np.ndarray:
        return np.array([time.perf_counter(), time.process_time()])

    for count in modes or SOLID_MODES:
        system = FreeSystem.of(body)
        begin = clocks()
        w, shapes = free_modes(system, 6 + count)
        middle = clocks()
        flexibility = flexibility_of(system, rows, 0.1, (w, shapes))
        more, completing = residual_modes(flexibility, 0.1, np.zeros((len(shapes), 0)))
        alone, vectors = middle - begin, clocks() - middle
        kept = np.diag(modal_compliance(some, np.concatenate([w, more]),
                                        np.hstack([shapes, completing])))
        print(f"cube, P2, {rows.shape[1]} unknowns, {nodes} nodes: {count} modes {alone[0]:.1f} s "
              f"(cores {alone[1]:.1f} s), {len(more)} residual vectors {vectors[0]:.1f} s "
              f"({vectors[1]:.1f} s), ratio {vectors[0] / alone[0]:.2f} "
              f"({vectors[1] / alone[1]:.2f}), missing {np.max(1.0 - kept / exact):.3f}",
              flush=True)


if __name__ == "__main__":
    explain(__doc__)
    words = sys.argv[1:]
    quick = "--quick" in words
    numbers = [int(given) for given in words if not given.startswith("--")]
    if "--solid" in words:
        solid(*numbers or (3000, 30) if quick else numbers)
    else:
        main(*numbers, quick=quick)
    if quick and "--solid" not in words:
        solid(3000, 30)
