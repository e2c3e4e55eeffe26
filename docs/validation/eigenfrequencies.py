"""Eigenfrequencies: beams, and the tapered membrane of NAFEMS."""

import numpy as np
from comparison import Comparison, comparisons

from fecontact import Beam, ElasticBody, Material, Mesh, generate
from fecontact.reduction import eigenfrequencies_hz

STEEL = Material(2.1e11, 0.3, 7850.0)
FREE = (53.14689, 146.40358, 286.72805)
CLAMPED = (8.355411, 52.33805, 146.43822)
MEMBRANE = (44.6170, 130.0094, 162.6887, 245.9858, 379.7170, 391.4042)
MEMBRANE_PUBLISHED = (44.623, 130.03, 162.70, 246.05, 379.90, 391.44)


def section() -> str:
    """Tables of free, clamped and tapered bodies."""
    free = eigenfrequencies_hz(ElasticBody(generate(Beam(1.0, 0.01, 0.0033)), STEEL), 6)[3:]
    near = np.concatenate([[0.0], 0.005 * 0.5 ** np.arange(7)[::-1]])
    clamped = eigenfrequencies_hz(ElasticBody(
        Mesh.grid(np.concatenate([near, np.linspace(0.005, 0.05, 8)[1:],
                                   np.linspace(0.05, 1.0, 201)[1:]]),
                   np.concatenate([near, 0.01 - near[-2::-1]])),
        STEEL, fixed={"left": "xy"}), 3)
    membrane = eigenfrequencies_hz(ElasticBody(tapered(), Material(200e9, 0.3, 8000.0), 0.05,
                           fixed={"left": "xy"}), 6)
    rows = [Comparison(f"free beam, mode {k + 1} [Hz]", *pair)
            for k, pair in enumerate(zip(FREE, free, strict=True))]
    rows += [Comparison(f"clamped beam, mode {k + 1} [Hz]", *pair)
             for k, pair in enumerate(zip(CLAMPED, clamped, strict=True))]
    rows += [Comparison(f"NAFEMS FV32, mode {k + 1} [Hz] (published {published})", *pair)
             for k, (published, *pair) in enumerate(
                 zip(MEMBRANE_PUBLISHED, MEMBRANE, membrane, strict=True))]
    return f"""## Eigenfrequencies

The reference for steel beams of 1 m x 10 mm in plane stress are converged values of plane
elasticity, which differ from beam theory by up to 2e-3. The mesh of the clamped beam is graded into
its corners. The reference for the tapered membrane of NAFEMS FV32 are converged values; the
published values are upper bounds.

{comparisons(rows)}
"""


def tapered() -> Mesh:
    """10 m long, 5 m high at the left and 1 m at the right, graded into the clamped corners."""
    near = np.concatenate([[0.0], 0.5 ** np.arange(6)[::-1]])
    xs = np.concatenate([near / 4.0, np.linspace(0.25, 10.0, 40)[1:]])
    parts = np.concatenate([near / 20.0, np.linspace(0.05, 0.95, 19)[1:-1],
                            1.0 - near[::-1] / 20.0])
    mesh = Mesh.grid(xs, parts)
    x, part = mesh.nodes.T
    return Mesh(np.column_stack([x, (part - 0.5) * (5.0 - 0.4 * x)]), mesh.cells,
                dict(mesh.boundaries), {})
