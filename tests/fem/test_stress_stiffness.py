"""Geometric stiffness of all kinds of cells, against differences of an energy."""

import numpy as np
import pytest
from bodies_of_all_cells import BODIES, MATERIAL, plane
from solid_blocks import block_body

from fecontact.fem.stress_stiffness import stress_stiffness


def energy(body, stressing, moved):
    """Energy of Green's strain of displacements under the stress of others, both linear in it.

    int sigma : E + E : C : E / 2 with E = (G + G^T + G^T G) / 2, G the gradient of ``moved``.
    """
    d, (_, lateral, shear) = body.dimension, body.elasticity[0]
    total = 0.0
    for block in body.blocks:
        slopes, volumes = block.gradients()

        def gradients(values, nodes=block.nodes, slopes=slopes):
            return np.einsum("eki,eqkj->ijeq", values.reshape(-1, d)[nodes], slopes)

        def stress(strain):
            trace = sum(strain[i, i] for i in range(d))
            return np.array([[2.0 * shear * strain[i, j] + (i == j) * lateral * trace
                              for j in range(d)] for i in range(d)])

        def symmetric(G):
            return 0.5 * (G + np.swapaxes(G, 0, 1))

        G = gradients(moved)
        green = symmetric(G) + 0.5 * np.einsum("kixy,kjxy->ijxy", G, G)
        given = stress(symmetric(gradients(stressing)))
        density = (given * green).sum(axis=(0, 1)) + 0.5 * (stress(green) * green).sum(axis=(0, 1))
        total += (density * volumes).sum()
    return body.thickness * total


@pytest.mark.parametrize("name", BODIES)
def test_second_derivative_of_an_energy(name):
    """K + K_sigma is the second derivative of the energy of a body under a stress."""
    body = BODIES[name]()
    rng = np.random.default_rng(4)
    stressing, moved = 0.02 * rng.standard_normal((2, body.unknowns))
    geometric = stress_stiffness(body, stressing)
    assert abs(geometric - geometric.T).max() == 0.0
    h = 2e-3
    values = [energy(body, stressing, k * h * moved) for k in range(-2, 3)]
    second = (-values[0] + 16.0 * values[1] - 30.0 * values[2] + 16.0 * values[3]
              - values[4]) / (12.0 * h**2)
    linear, added = moved @ body.stiffness @ moved, moved @ geometric @ moved
    assert second - linear == pytest.approx(added, rel=1e-5, abs=1e-6 * abs(linear))
    assert abs(added) > 1e-3 * abs(linear)


def test_uniform_tension_stiffens_rotation_by_its_stress():
    """v^T K_sigma v of a rotation by one radian about z is the stress times the volume."""
    for body in (plane(False, 2), block_body((2, 2, 1), material=MATERIAL),
                 block_body((2, 2, 1), material=MATERIAL, degree=1, bricks="incompatible")):
        d, E, nu = body.dimension, MATERIAL.youngs_modulus, MATERIAL.poisson_ratio
        strain = np.array([1e-3, -nu * 1e-3, -nu * 1e-3])[:d]
        turned = np.zeros((len(body.nodes), d))
        turned[:, 0], turned[:, 1] = -body.nodes[:, 1], body.nodes[:, 0]
        v = turned.ravel()
        found = v @ stress_stiffness(body, (body.nodes * strain).ravel()) @ v
        volume = body.total_mass / MATERIAL.density
        assert found == pytest.approx(1e-3 * E * volume, rel=1e-9)
