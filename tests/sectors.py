"""Sectors of wheels, and the whole wheels that they make."""

import numpy as np
from meshes_for_tests import grid
from scipy.spatial import cKDTree

from fecontact import Mesh


def ring_sector(sectors, radial=2, around=4, *, inner=0.6, outer=1.0, wavy=0.1, triangles=False):
    """A sector of a ring, as wide as it is wavy: boundaries bottom (low) and top (high)."""
    alpha = 2.0 * np.pi / sectors

    def warp(at):
        r = at[:, 0] * (1.0 + wavy * np.cos(sectors * at[:, 1]) + 0.5 * wavy * np.sin(
            sectors * at[:, 1]))
        return np.column_stack([r * np.cos(at[:, 1] - 0.1), r * np.sin(at[:, 1] - 0.1)])

    return grid(np.linspace(inner, outer, radial + 1), np.linspace(0.0, alpha, around + 1),
                triangles=triangles, warp=warp)


def hexagon_sector(count=3, height=None):
    """A sixth of a hexagon, an equilateral triangle with its tip on the axis; a solid by height.

    Boundaries low, high and outer, of a solid also bottom.
    """
    number, plane = {}, []
    for i in range(count + 1):
        for j in range(count + 1 - i):
            number[i, j] = len(plane)
            plane.append([i + 0.5 * j, np.sqrt(0.75) * j])
    cells = [[number[i, j], number[i + 1, j], number[i, j + 1]]
             for i in range(count) for j in range(count - i)]
    cells += [[number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]]
              for i in range(count - 1) for j in range(count - 1 - i)]
    plane, cells = np.array(plane) / count, np.array(cells)
    sides = {"low": [(number[i, 0], number[i + 1, 0]) for i in range(count)],
             "high": [(number[0, j], number[0, j + 1]) for j in range(count)],
             "outer": [(number[count - j, j], number[count - j - 1, j + 1])
                       for j in range(count)]}
    if height is None:
        return Mesh(plane, cells, sides)
    n = len(plane)
    nodes = np.concatenate([np.column_stack([plane, np.full(n, z)]) for z in (0.0, height)])
    # Cut prisms along the order of radii, which both faces have in common.
    rank = np.round(1e6 * np.hypot(*plane.T)) + 1e-3 * np.arange(n)
    solid = []
    for cell in cells:
        a, b, c = sorted(cell, key=lambda at: rank[at])
        solid += [(a, b, c, c + n), (a, b, b + n, c + n), (a, a + n, b + n, c + n)]
    mesh = Mesh(nodes, solid)
    faces = {}
    for name, ends in sides.items():
        on = np.isin(np.arange(2 * n) % n, np.ravel(ends))
        faces[name] = mesh.outline[on[mesh.outline].all(axis=1)]
    faces["bottom"] = mesh.outline[(nodes[mesh.outline][:, :, 2] == 0.0).all(axis=1)]
    return Mesh(nodes, solid, faces)


def whole_wheel(mesh, symmetry):
    """All sectors in one mesh, with the boundaries that meet no neighbour."""
    nodes = np.concatenate([symmetry.turned(mesh.nodes, s) for s in range(symmetry.sectors)])
    tree = cKDTree(nodes)
    first = np.array([min(group) for group in tree.query_ball_point(nodes, 1e-7)])
    kept, number = np.unique(first, return_inverse=True)
    shift = len(mesh.nodes) * np.arange(symmetry.sectors)

    def all_of(rows):
        return np.concatenate([number[np.asarray(rows) + s] for s in shift])

    return Mesh(nodes[kept], all_of(mesh.cells), {
        name: all_of(facets) for name, facets in mesh.boundaries.items()
        if name not in (symmetry.low, symmetry.high)})


def shrouded_sector(sectors, columns=4, *, split=1e-4):
    """A piece of a ring with a blade and a shroud on it: low, high, root; left, right (shroud).

    Sides of the shroud are ``split`` rad within the sector, so that neighbours do not touch. Cells
    of the blade are the group 'blade', its tip is the point 'tip'.
    """
    alpha = 2.0 * np.pi / sectors
    angles = np.linspace(-0.5 * alpha, 0.5 * alpha, columns + 1)
    narrow = np.linspace(-0.5 * alpha + split, 0.5 * alpha - split, columns + 1)
    radii = np.array([0.2, 0.24, 0.3, 0.36, 0.39])
    number, nodes, middle = {}, [], columns // 2
    for i, r in enumerate(radii):
        for j in range(columns + 1):
            if i < 2 or i > 2 or abs(j - middle) <= 1:
                number[i, j] = len(nodes)
                at = (angles if i < 2 else narrow)[j]
                nodes.append((r * np.cos(at), r * np.sin(at)))
    cells, blade = [], []
    for i in range(len(radii) - 1):
        for j in range(columns):
            corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            if i in (1, 2) and j not in (middle - 1, middle):
                continue
            if i in (1, 2):
                blade.append(len(cells))
            cells.append([number[at] for at in corners])

    def side(j, rows):
        return [(number[i, j], number[i + 1, j]) for i in rows]

    return Mesh(np.array(nodes), cells, {
        "low": side(0, [0]), "high": side(columns, [0]), "left": side(0, [3]),
        "right": side(columns, [3]), "root": [(number[0, j], number[0, j + 1])
                                             for j in range(columns)]},
        {"tip": number[4, middle]}, cell_groups={"blade": blade})
