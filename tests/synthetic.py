"""Runs whose fields are known in closed form: rectangles with analytic mode shapes."""

import numpy as np
import scipy.sparse as sp

from fecontact import ContactSystem, Ground, ModalBasis, Trajectory
from fecontact.laws import ExponentialFriction, RoughSurface
from fecontact.reduction import ModeShapes
from fecontact.system.columns import POWERS

YOUNGS_MODULUS = 2.1e11


def rectangle(length, height, columns, rows, triangles=False):
    """Nodes, cells and outline edges of a structured mesh on [0, length] x [0, height]."""
    x, y = np.meshgrid(np.linspace(0.0, length, columns + 1), np.linspace(0.0, height, rows + 1))
    nodes = np.column_stack([x.ravel(), y.ravel()])
    number = np.arange(len(nodes)).reshape(rows + 1, columns + 1)
    cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]],
                     axis=-1).reshape(-1, 4)
    loop = np.concatenate([number[0], number[1:, -1], number[-1, -2::-1], number[-2:0:-1, 0]])
    if triangles:
        cells = np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
    return nodes, cells, np.column_stack([loop, np.roll(loop, -1)])


def shapes_and_stress(nodes, length, height):
    """Translation x, y, rotation, stretch along x and the first bending of a rectangle.

    Stretch and bending have unit amplitude at the ends; stresses are those of the stretch
    (uniform, uniaxial) and of the fibres of the bent rectangle.
    """
    x, y = nodes[:, 0] - 0.5 * length, nodes[:, 1] - 0.5 * height
    one, zero = np.ones(len(nodes)), np.zeros(len(nodes))
    k = np.pi / length
    bend, slope = -np.cos(k * x) + 0.5, k * np.sin(k * x)
    shapes = np.stack([
        np.column_stack([one, zero]), np.column_stack([zero, one]), np.column_stack([-y, x]),
        np.column_stack([2.0 * x / length, zero]), np.column_stack([-y * slope, bend]),
    ], axis=-1)
    stress = np.zeros((len(nodes), 4, 5))
    stress[:, 0, 3] = YOUNGS_MODULUS * 2.0 / length
    stress[:, 0, 4] = -YOUNGS_MODULUS * y * k**2 * np.cos(k * x)
    return shapes, stress


def basis(length=0.2, height=0.02, columns=40, rows=6, contact_nodes=5, triangles=False):
    """Modal basis of a rectangle: three rigid modes, stretch at 9 kHz, bending at 2 kHz."""
    nodes, cells, outline = rectangle(length, height, columns, rows, triangles)
    shapes, stress = shapes_and_stress(nodes, length, height)
    bottom = np.flatnonzero(nodes[:, 1] == 0.0)
    edges = np.linspace(0.0, length, contact_nodes + 1)
    middles = 0.5 * (edges[:-1] + edges[1:])
    places = np.array([[0.0, 0.5 * height], [0.5 * length, height],
                       *([middle, 0.0] for middle in middles)])
    segment = np.clip(np.searchsorted(edges, nodes[bottom, 0], side="right") - 1, 0,
                      contact_nodes - 1)
    matrix = sp.lil_array((3 * len(places), 2 * len(nodes)))
    for point, place in enumerate(places):
        patch = [np.argmin(np.linalg.norm(nodes - place, axis=1))] if point < 2 else \
            bottom[segment == point - 2]
        for node in patch:
            matrix[3 * point, 2 * node] = matrix[3 * point + 1, 2 * node + 1] = 1.0 / len(patch)
    restriction = sp.csr_array(matrix)
    modes = shapes.shape[2]
    T = (restriction @ shapes.reshape(-1, modes)).reshape(-1, 3, modes)
    frequencies = 2.0 * np.pi * np.array([0.0, 0.0, 0.0, 2000.0, 9000.0])
    order = [0, 1, 2, 4, 3]
    return ModalBasis(
        angular_frequencies=frequencies,
        damping=np.diag(0.02 * frequencies),
        T=T[:, :, order],
        positions=places,
        tributary=np.full(contact_nodes, length / contact_nodes),
        mode_shapes=ModeShapes(nodes, cells, outline, shapes[:, :, order].copy(),
                    stress[:, :, order].copy(), restriction),
    )


def run(body=None, times=101, size=2e-5, waviness=0.0, speed=0.02):
    """Sliding with stick-slip in x, bouncing and rocking in y, bending and stretching."""
    body = basis() if body is None else body
    system = ContactSystem(
        body, normal=RoughSurface(3e5, 5.2e-6, 6.0), friction=ExponentialFriction(0.8, 0.55, 1e3),
        ground=Ground(speed=speed, amplitude=waviness, wavelength=0.03))
    t = np.linspace(0.0, 0.02, times)
    w = 2.0 * np.pi * np.array([100.0, 50.0, 150.0, 200.0, 500.0])
    a = size * np.array([1.0, 0.4, 3.0, 0.3, 0.05])
    drift = np.zeros((2, 5))
    drift[0, 0], drift[1, 0] = 0.0, speed
    q = a * np.sin(w * t[:, None])
    rate = a * w * np.cos(w * t[:, None])
    middle = slice(times // 3, times // 2)
    rate[middle] = 0.0
    rate[middle, 0] = speed
    return Trajectory(system, t, q, rate, np.zeros((times, len(POWERS))),
                      statistics={"steps": 17, "seconds": 0.25})
