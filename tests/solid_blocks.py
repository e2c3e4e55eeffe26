"""Blocks of hexahedra or tetrahedra with named faces, and facets of curved surfaces."""

import numpy as np

from fecontact import ElasticBody, Mesh
from fecontact.fem.elements.cell_kinds import padded
from fecontact.fem.faces.surface import Surface

_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
                     (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
_TETRAHEDRA = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))


def block_mesh(counts, size=(0.2, 0.1, 0.05), *, tetrahedra=False):
    """From the origin to ``size``, with the faces contact, top, left, right, front, back."""
    lines = [np.linspace(0.0, side, count + 1) for side, count in zip(size, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape([len(line) for line in lines])
    nx, ny, nz = counts
    cells = np.stack([number[i : nx + i, j : ny + j, k : nz + k] for i, j, k in _CORNERS],
                     axis=-1).reshape(-1, 8)
    if tetrahedra:
        cells = np.concatenate([cells[:, list(part)] for part in _TETRAHEDRA])
    return Mesh(nodes, cells, _faces(nodes, cells, size))


def _faces(nodes, cells, size):
    outline = Mesh(nodes, cells).outline
    return {name: outline[(np.abs(nodes[outline][:, :, axis] - at) < 1e-12).all(axis=1)]
            for name, axis, at in (("contact", 2, 0.0), ("top", 2, size[2]), ("left", 0, 0.0),
                                   ("right", 0, size[0]), ("front", 1, 0.0), ("back", 1, size[1]))}


def mixed_mesh(counts=(1, 1, 1), size=(0.2, 0.1, 0.05), bend=None):
    """A block of hexahedra, wedges, pyramids and tetrahedra, so many columns of each along x.

    Nodes of hexahedra within the block are taken by ``bend`` to other places.
    """
    block = block_mesh((4 * counts[0], *counts[1:]), size)
    column = np.floor(block.nodes[block.cells].mean(axis=1)[:, 0] / (size[0] / (4 * counts[0])))
    kind = (column // counts[0]).astype(int)
    nodes = block.nodes.copy()
    if bend is not None:
        inside = ((nodes > 1e-12) & (nodes < np.array(size) - 1e-12)).all(axis=1)
        nodes[inside] = bend(nodes[inside])
    hexahedra = block.cells
    wedges = np.concatenate([hexahedra[kind == 1][:, list(part)]
                             for part in ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7))])
    centres = len(nodes) + np.arange(np.count_nonzero(kind == 2))[:, None]
    around, last = hexahedra[kind == 2], column[kind == 2] == 3 * counts[0] - 1
    nodes = np.concatenate([nodes, nodes[around].mean(axis=1)])
    pyramids, tetrahedra = [], [hexahedra[kind == 3][:, list(part)] for part in _TETRAHEDRA]
    for face in ((0, 1, 2, 3), (7, 6, 5, 4), (4, 5, 1, 0), (5, 6, 2, 1), (6, 7, 3, 2),
                 (7, 4, 0, 3)):
        whole = ~last if face == (5, 6, 2, 1) else np.ones(len(around), bool)
        pyramids.append(np.concatenate([around[:, list(face)], centres], axis=1)[whole])
    # Diagonals from corner 1 to corner 6, as those of the tetrahedra beside.
    tetrahedra += [np.concatenate([around[last][:, list(part)], centres[last]], axis=1)
                   for part in ((6, 1, 5), (1, 6, 2))]
    cells = padded([hexahedra[kind == 0], wedges, *pyramids, *tetrahedra])
    return Mesh(nodes, cells, _faces(nodes, cells, size))


def block_body(counts, size=(0.2, 0.1, 0.05), *, tetrahedra=False, **options):
    """Elastic body of :func:`block_mesh`."""
    return ElasticBody(block_mesh(counts, size, tetrahedra=tetrahedra), **options)


def quadratic_grid(place, nu, nv, *, triangles=False):
    """Facets of second order over a grid of ``place(u, v)``, u and v from 0 to 1."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 2 * nu + 1), np.linspace(0.0, 1.0, 2 * nv + 1),
                       indexing="ij")
    number = np.arange(u.size).reshape(u.shape)

    def at(i, j):
        return number[i : i + 2 * nu - 1 : 2, j : j + 2 * nv - 1 : 2].ravel()

    if triangles:
        corners = (((0, 0), (2, 0), (2, 2), (1, 0), (2, 1), (1, 1)),
                   ((0, 0), (2, 2), (0, 2), (1, 1), (1, 2), (0, 1)))
    else:
        corners = (((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)),)
    facets = np.concatenate([np.stack([at(i, j) for i, j in one], axis=1) for one in corners])
    return Surface(np.stack(place(u.ravel(), v.ravel()), axis=1), facets)
