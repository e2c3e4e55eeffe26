"""Reading decks of many nodes: Abaqus decks and Ansys archives of a block of bricks.

The deck has a node set, an element set, a surface and a section with its material. Each is read in
a process of its own; its peak memory is printed beside the memory before reading. meshio reads the
same deck without surfaces, sections and checks.

Usage: python benchmarks/decks.py [NODES ...] [--quick]   (by default 200,000 and 2,000,000;
       5,000,000 make a deck of ten million lines)
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from usage import explain

READ = """
import resource, sys, time
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
if sys.argv[1] == "meshio":
    import meshio
else:
    import fecontact as fc
    fc.read_mesh
    from fecontact.fem.mesh_files import read_mesh
before, begun, used = peak(), time.perf_counter(), time.process_time()
if sys.argv[1] == "meshio":
    found = meshio.read(sys.argv[2])
    count, more = len(found.points), 0
else:
    found = read_mesh(sys.argv[2])
    count, more = len(found.nodes), len(found.boundaries["TOP"])
print(time.perf_counter() - begun, time.process_time() - used, before, peak(), count, more)
"""


def block(nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 3) and bricks (M, 8) of a block with about so many nodes, four times as long."""
    n = max(round((nodes / 4.0) ** (1.0 / 3.0)), 3)
    counts = (4 * n, n, n)
    places = np.stack(np.meshgrid(*(np.linspace(0.0, c * 1e-3, c) for c in counts), indexing="ij"),
                      axis=-1).reshape(-1, 3)
    number = np.arange(len(places)).reshape(counts)
    corner = number[:-1, :-1, :-1].reshape(-1)
    dx, dy = n * n, n
    steps = np.array([0, dx, dx + dy, dy, 1, dx + 1, dx + dy + 1, dy + 1])
    return places, corner[:, None] + steps


def write_inp(path: Path, places: np.ndarray, bricks: np.ndarray) -> None:
    """An Abaqus deck."""
    top = np.flatnonzero(places[bricks].max(axis=1)[:, 2] >= places[:, 2].max()) + 1
    with path.open("w") as deck:
        deck.write("*NODE, NSET=ALL\n")
        np.savetxt(deck, np.column_stack([np.arange(1, len(places) + 1), places]),
                   fmt="%d, %.9g, %.9g, %.9g")
        deck.write("*ELEMENT, TYPE=C3D8, ELSET=BODY\n")
        np.savetxt(deck, np.column_stack([np.arange(1, len(bricks) + 1), bricks + 1]),
                   fmt="%d", delimiter=", ")
        deck.write("*ELSET, ELSET=UPPER\n")
        np.savetxt(deck, top, fmt="%d")
        deck.write("*SURFACE, NAME=TOP\nUPPER, S2\n*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n"
                   "*DENSITY\n7850.\n*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL\n")


def write_cdb(path: Path, places: np.ndarray, bricks: np.ndarray) -> None:
    """An Ansys archive, with a component of the nodes on top."""
    top = np.flatnonzero(places[:, 2] >= places[:, 2].max()) + 1
    with path.open("w") as deck:
        deck.write(f"/PREP7\nET,1,185\nNBLOCK,6,SOLID,{len(places)},{len(places)}\n"
                   f"(3i9,6e20.13)\n")
        zero = np.zeros(len(places))
        np.savetxt(deck, np.column_stack([np.arange(1, len(places) + 1), zero, zero, places]),
                   fmt="%9d%9d%9d" + 3 * "%20.13E")
        deck.write(f"N,R5.3,LOC,-1,\nEBLOCK,19,SOLID,{len(bricks)},{len(bricks)}\n(19i9)\n")
        head = np.tile([1, 1, 1, 1, 0, 0, 0, 0, 8, 0], (len(bricks), 1))
        np.savetxt(deck, np.column_stack([head, np.arange(1, len(bricks) + 1), bricks + 1]),
                   fmt=19 * "%9d")
        deck.write(f"       -1\nCMBLOCK,TOP     ,NODE,{len(top)}\n(8i10)\n")
        for start in range(0, len(top), 8):
            deck.write("".join(f"{n:10d}" for n in top[start : start + 8]) + "\n")


def main(sizes: list[int], quick: bool = False) -> None:
    """Print the table."""
    print(f"{'file':22s} {'nodes':>9s} {'MB':>7s} {'read [s]':>9s} {'cpu [s]':>8s} "
          f"{'memory [MB]':>12s} {'faces':>7s}")
    with tempfile.TemporaryDirectory() as folder:
        for size in sizes or ([5_000] if quick else [200_000, 2_000_000]):
            places, bricks = block(size)
            for suffix, write in ((".inp", write_inp), (".cdb", write_cdb)):
                path = Path(folder, f"block{suffix}")
                write(path, places, bricks)
                for reader in ("fecontact", *(["meshio"] if suffix == ".inp" else [])):
                    done = subprocess.run([sys.executable, "-c", READ, reader, str(path)],
                                          capture_output=True, text=True, check=True)
                    seconds, used, before, peak, count, faces = map(float, done.stdout.split())
                    print(f"{reader + ', ' + suffix:22s} {count:9.0f} "
                          f"{path.stat().st_size / 1e6:7.1f} {seconds:9.2f} {used:8.1f} "
                          f"{peak - before:12.0f} {faces:7.0f}", flush=True)
                path.unlink()


if __name__ == "__main__":
    explain(__doc__)
    main([int(word) for word in sys.argv[1:] if not word.startswith("--")],
         "--quick" in sys.argv)
