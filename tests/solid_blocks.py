"""Blocks of hexahedra or tetrahedra with named faces, and facets of curved surfaces."""

import numpy as np

from fecontact import ElasticBody, Mesh
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
    outline = Mesh(nodes, cells).outline
    faces = {
        name: outline[(np.abs(nodes[outline][:, :, axis] - at) < 1e-12).all(axis=1)]
        for name, axis, at in (("contact", 2, 0.0), ("top", 2, size[2]), ("left", 0, 0.0),
                               ("right", 0, size[0]), ("front", 1, 0.0), ("back", 1, size[1]))}
    return Mesh(nodes, cells, faces)


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
