"""Modes of bodies with 150,000 unknowns: fecontact against scipy's default, side by side.

Usage: python benchmarks/eigen.py [repetitions] [--quick]
       python benchmarks/eigen.py --solids [unknowns] [shape ...] [solver ...] [--quick]

Solids are a cube of side 1, a plate 1 x 1 x 0.05 and the cube of two halves, tied, whose meshes do
not match, of quadratic tetrahedra; solvers are "scipy" (not for the tied halves), "direct" and
"iterative", each in a process of its own, whose largest memory is printed. By default all of them,
with 50,000 unknowns. Times are those of the modes, without the assembly, which has a
column of its own.
"""

import json
import resource
import statistics
import subprocess
import sys
import time

import numpy as np
from scipy.sparse.linalg import eigsh
from skfem import MeshTet
from usage import explain

from fecontact import ElasticBody, Material, Mesh
from fecontact.fem import Tie
from fecontact.reduction.eigenmodes import FreeSystem, backward_error, eigenmodes, free_modes

MODES = 20
SHAPES = {"cube": (1.0, 1.0, 1.0), "plate": (1.0, 1.0, 0.05), "tied": (0.5, 1.0, 1.0)}
SOLVERS = ("scipy", "direct", "iterative")


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


def block(shape: str, unknowns: int) -> Mesh:
    """Mesh of a shape whose quadratic elements have so many unknowns."""
    if shape != "tied":
        return grid(SHAPES[shape], unknowns)
    first = grid(SHAPES[shape], 0.66 * unknowns)
    second = grid(SHAPES[shape], 0.34 * unknowns).placed((0.5, 0.0, 0.0))
    meeting = [mesh.outline[(np.abs(mesh.nodes[mesh.outline, 0] - 0.5) < 1e-9).all(axis=1)]
               for mesh in (first, second)]
    count = len(first.nodes)
    return Mesh(np.concatenate([first.nodes, second.nodes]),
                np.concatenate([first.cells, second.cells + count]),
                {"one": meeting[0], "two": meeting[1] + count}, constraints=[Tie("one", "two")])


def grid(sides: tuple[float, float, float], unknowns: float) -> Mesh:
    """Cells about as long as wide, so many that quadratic elements have so many unknowns."""
    length = (3.0 * np.prod(sides) / unknowns) ** (1.0 / 3.0) * 2.0
    # Nodes on the faces make more of thin bodies.
    for _ in range(20):
        cells = np.maximum(np.round(np.array(sides) / length), 1).astype(int)
        if 3 * np.prod(2 * cells + 1) <= 1.05 * unknowns:
            break
        length *= 1.02
    found = MeshTet.init_tensor(*(np.linspace(0.0, a, n + 1)
                                  for a, n in zip(sides, cells, strict=True)))
    return Mesh(found.p.T, found.t.T)


def solved(shape: str, solver: str, unknowns: int) -> None:
    """Print what one solver finds, as JSON."""
    begin = time.perf_counter()
    body = ElasticBody(block(shape, unknowns), Material.named("steel"))
    K, M = body.stiffness, body.mass
    _ = body.expansion
    ready = time.perf_counter()
    if solver == "scipy":
        # Well below the lowest elastic mode.
        waves = float(np.max(body.elasticity[2])) / body.material.density
        sigma = -1e-3 * waves * (np.pi / body.mesh.extent) ** 2
        squares = eigsh(K, k=MODES + 6, M=M, sigma=sigma, return_eigenvectors=True)[0]
        w = np.sqrt(np.sort(squares)[6:])
    else:
        w = free_modes(FreeSystem.of(body, solver), MODES + 6)[0][6:]
    end = time.perf_counter()
    print(json.dumps({"unknowns": K.shape[0], "assembly": ready - begin, "time": end - ready,
                      "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2,
                      "w": w.tolist()}))


def solids(unknowns: int, shapes: list[str], solvers: list[str]) -> None:
    """Print the table of solids."""
    print(f"{'body':6s} {'unknowns':>9s} {'solver':>10s} {'assembly [s]':>13s} {'modes [s]':>10s} "
          f"{'times faster':>13s} {'memory [GB]':>12s} {'difference':>11s}")
    for shape in shapes:
        first = None
        for solver in solvers:
            if (shape, solver) == ("tied", "scipy"):
                continue
            done = subprocess.run(
                [sys.executable, __file__, "--one", shape, solver, str(unknowns)], check=True,
                capture_output=True, text=True)
            found = json.loads(done.stdout)
            first = first or found
            difference = np.abs(np.array(found["w"]) / first["w"] - 1.0).max()
            print(f"{shape:6s} {found['unknowns']:9d} {solver:>10s} {found['assembly']:13.2f} "
                  f"{found['time']:10.2f} {first['time'] / found['time']:13.1f} "
                  f"{found['memory']:12.2f} {difference:11.1e}", flush=True)


def chosen(words: list[str], quick: bool) -> None:
    """Solids, by the words of the command line."""
    numbers = [int(word) for word in words if word.isdigit()]
    solids(numbers[0] if numbers else 3000 if quick else 50_000,
           [name for name in SHAPES if name in words] or list(SHAPES),
           [name for name in SOLVERS if name in words] or list(SOLVERS))


if __name__ == "__main__":
    given = [word for word in sys.argv[1:] if word != "--quick"]
    if given[:1] == ["--one"]:
        solved(given[1], given[2], int(given[3]))
        raise SystemExit(0)
    explain(__doc__)
    if given[:1] == ["--solids"]:
        chosen(given[1:], "--quick" in sys.argv)
    else:
        main(*(int(word) for word in given), quick="--quick" in sys.argv)
        if "--quick" in sys.argv:
            print()
            chosen([], True)
