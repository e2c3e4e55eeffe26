"""Structured meshes for the tests, built from coordinates alone."""

import numpy as np

from fecontact import Mesh
from fecontact.fem.elements.cell_kinds import padded


def grid(xs, ys, *, triangles=False, warp=None, points=None, reverse=(), split=()):
    """Mesh of the cells between the lines x = xs, y = ys.

    The boundaries are left, right, bottom, top; those in ``reverse`` have their edges turned
    round and in another order. ``split`` names x intervals of the bottom: a boundary ``feet``.
    ``points`` maps names to places, the nearest node is taken. ``warp`` moves the nodes.
    ``triangles`` may say of centres of cells which are cut.
    """
    xs, ys = np.asarray(xs, float), np.asarray(ys, float)
    x, y = np.meshgrid(xs, ys)
    nodes = np.column_stack([x.ravel(), y.ravel()])
    number = np.arange(len(nodes)).reshape(len(ys), len(xs))
    cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]],
                     axis=-1).reshape(-1, 4)
    cut = np.full(len(cells), triangles) if isinstance(triangles, bool) else triangles(
        nodes[cells].mean(axis=1))
    cells = padded([cells[~cut], cells[cut][:, [0, 1, 2]], cells[cut][:, [0, 2, 3]]])
    boundaries = {name: np.column_stack([line[:-1], line[1:]]) for name, line in (
        ("bottom", number[0]), ("right", number[:, -1]), ("top", number[-1]),
        ("left", number[:, 0]))}
    bottom = boundaries["bottom"]
    if split:
        middle = nodes[bottom].mean(axis=1)[:, 0]
        kept = [(low < middle) & (middle < high) for low, high in split]
        boundaries["feet"] = bottom[np.logical_or.reduce(kept)]
    for name in reverse:
        shuffled = np.random.default_rng(5).permutation(len(boundaries[name]))
        boundaries[name] = boundaries[name][shuffled, ::-1]
    named = {name: int(np.argmin(np.linalg.norm(nodes - np.asarray(place), axis=1)))
             for name, place in (points or {}).items()}
    if warp is not None:
        nodes = warp(nodes)
    return Mesh(nodes, cells, boundaries, named)


def rectangle(length, height, columns, rows, **options):
    """Uniform mesh on [0, length] x [0, height]."""
    return grid(np.linspace(0.0, length, columns + 1), np.linspace(0.0, height, rows + 1),
                **options)


def joined(first, second, constraints=(), points=None):
    """Two meshes as pieces of one, their boundaries as one.NAME and two.NAME."""
    count = len(first.nodes)
    boundaries = {f"{name}.{key}": facets + shift
                  for name, mesh, shift in (("one", first, 0), ("two", second, count))
                  for key, facets in mesh.boundaries.items()}
    return Mesh(np.concatenate([first.nodes, second.nodes]),
                np.concatenate([first.cells, second.cells + count]), boundaries, points or {},
                constraints=constraints)


def halved_towards_zero(length, times):
    """0 ... length, halved towards 0 so many times."""
    return np.concatenate([[0.0], length * 0.5 ** np.arange(times)[::-1]])


def clamped_beam(length, height, columns, times):
    """Beam whose cells are halved into the two corners of the left edge."""
    near = halved_towards_zero(0.5 * height, times)
    xs = np.concatenate([near, np.linspace(0.5 * height, 5.0 * height, 8)[1:],
                         np.linspace(5.0 * height, length, columns + 1)[1:]])
    return grid(xs, np.concatenate([near, height - near[-2::-1]]))


def tapered_membrane(columns, rows, times, triangles=False):
    """NAFEMS FV32: length 10, height 5 at the left and 1 at the right, graded to the left."""
    step = 10.0 / columns
    xs = np.concatenate([halved_towards_zero(step, times), np.linspace(step, 10.0, columns)[1:]])
    near = halved_towards_zero(1.0 / rows, times)
    ys = np.concatenate([near, np.linspace(1.0 / rows, 1.0 - 1.0 / rows, rows - 1)[1:-1],
                         1.0 - near[::-1]])

    def warp(nodes):
        x, eta = nodes.T
        return np.column_stack([x, (eta - 0.5) * (5.0 - 0.4 * x)])

    return grid(xs, ys, triangles=triangles, warp=warp)


def skewed(nodes):
    """Shear, stretch and ripple that keep straight-sided cells valid, a turn and a shift."""
    x, y = nodes.T
    bent = np.column_stack([x + 0.3 * y + 0.02 * np.sin(7.0 * y),
                            y + 0.1 * x + 0.02 * np.cos(5.0 * x)])
    c, s = np.cos(0.4), np.sin(0.4)
    return bent @ np.array([[c, s], [-s, c]]) + np.array([0.7, -0.3])
