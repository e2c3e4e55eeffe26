"""A bolt between two plates that presses a sleeve together, as a mesh and as a deck.

Five by five bricks of 10 mm in plan: the bolt in the middle, the sleeve along the rim. Plates are
the first and the last of five layers; the sleeve parts at the joint, below its third brick.
"""

import numpy as np
from solid_blocks import block_mesh

from fecontact import Mesh

STEP = 0.01
SIDES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (1, 2, 5, 6), (2, 3, 6, 7), (0, 3, 4, 7))


def clamp_mesh(refinement=1):
    """The clamp as one piece, with the faces contact (the bottom) and top."""
    n = refinement
    counts = (5 * n, 5 * n, 5 * n)
    block = block_mesh(counts, (5 * STEP,) * 3)
    column, row, layer = (block.nodes[block.cells].mean(axis=1) // STEP).astype(int).T
    away = np.maximum(np.abs(column - 2), np.abs(row - 2))
    plates, bolt = (layer == 0) | (layer == 4), away == 0
    sleeve = (away == 2) & ~plates
    kept = plates | bolt | sleeve
    used = np.unique(block.cells[kept])
    number = np.full(len(block.nodes), -1)
    number[used] = np.arange(len(used))
    groups = {"bolt": bolt & ~plates, "sleeve": sleeve}
    return Mesh(block.nodes[used], number[block.cells[kept]],
                {name: number[block.boundaries[name]] for name in ("contact", "top")},
                cell_groups={name: np.flatnonzero(mask[kept]) for name, mask in groups.items()})


def clamp_deck(mesh, joint):
    """Nodes, bricks, surfaces and a pre-tension section of the clamp, cut at the ``joint``.

    ``joint`` maps the names of both faces of the joint to their facets in ``mesh``.
    """
    text = "*NODE, NSET=ALL\n" + "".join(
        f"{k}, {', '.join(map(repr, place))}\n" for k, place in enumerate(mesh.nodes.tolist(), 1))
    text += "*ELEMENT, TYPE=C3D8, ELSET=BODY\n" + "".join(
        f"{k}, {', '.join(map(str, row))}\n" for k, row in enumerate((mesh.cells + 1).tolist(), 1))
    for name, facets in {**mesh.boundaries, **joint}.items():
        wanted = {frozenset(facet) for facet in facets.tolist()}
        text += f"*SURFACE, NAME={name}\n" + "".join(
            f"{k}, S{number}\n" for k, row in enumerate(mesh.cells.tolist(), 1)
            for number, side in enumerate(SIDES, 1) if frozenset(row[at] for at in side) in wanted)
    bolt = mesh.cell_groups["bolt"]
    low = bolt[(mesh.nodes[mesh.cells[bolt]][:, :, 2].max(axis=1) < 2.01 * STEP)
               & (mesh.nodes[mesh.cells[bolt]][:, :, 2].max(axis=1) > 1.99 * STEP)]
    section = "".join(f"{k + 1}, S2\n" for k in low)
    held = "".join(f"{k + 1},\n" for k in np.unique(mesh.boundaries["contact"]))
    return (f"{text}*SURFACE, NAME=CUT\n{section}*NODE, NSET=BOLT\n9001, 0.1, 0, 0\n"
            f"*PRE-TENSION SECTION, SURFACE=CUT, NODE=9001\n0., 0., 1.\n*NSET, NSET=HELD\n{held}"
            "*MATERIAL, NAME=M\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n"
            "*SOLID SECTION, ELSET=BODY, MATERIAL=M\n")
