"""Energy, forces and tangent of bodies with large deflections, and pressures that follow them."""

import numpy as np
import pytest
from bodies_of_all_cells import BODIES, MATERIAL, mixed, plane
from meshes_for_tests import rectangle, skewed
from solid_blocks import block_body, block_mesh

from fecontact import ElasticBody, Mesh
from fecontact.fem import AnisotropicMaterial, LinearEquation, PointSpring, Term
from fecontact.fem.finite_strain import FiniteStrainModel
from fecontact.fem.follower_pressure import follower_pressure

WOOD = AnisotropicMaterial.orthotropic((3e3, 2e2, 1e2), (0.3, 0.4, 0.3), (2e2, 1e2, 5e1), 1.0)


def linked():
    """Supported, with a spring and an equation between displacements."""
    spring = PointSpring((Term("corner", (1.0, 2.0)),), 1e3)
    equal = LinearEquation((Term("corner", (1.0, 0.0)), Term((4, 5), (-1.0, 0.5))))
    return plane(False, 2, fixed={"left": "xy"}, attachments=[spring], constraints=[equal])


FREE = BODIES | {
    "mixed, bricks": lambda: mixed(1, bricks="incompatible"),
    "wood": lambda: block_body((2, 1, 1), material=WOOD),
    "incompatible modes": lambda: block_body((2, 2, 1), material=MATERIAL, degree=1,
                                             bricks="incompatible"),
}
ALL = FREE | {"linked": linked}


def rotation(d):
    """A rotation by about 70 degrees, in space about a skew axis."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec([0.5, -0.4, 1.0]).as_matrix()
    c, s = np.cos(1.2), np.sin(1.2)
    return turn if d == 3 else np.array([[c, -s], [s, c]])


@pytest.mark.parametrize("name", ALL)
def test_force_and_tangent_are_derivatives(name):
    """Central differences of the energy and the force; at rest the tangent is the stiffness."""
    body = ALL[name]()
    model = FiniteStrainModel(body)
    rng = np.random.default_rng(1)
    q, v = rng.standard_normal((2, model.expansion.shape[1]))
    size = np.ptp(body.nodes, axis=0).max()
    q, h = 0.02 * size * q, 1e-5 * size
    at, ahead, behind = (model.state(one) for one in (q, q + h * v, q - h * v))
    assert (ahead.energy - behind.energy) / (2.0 * h) == pytest.approx(at.force @ v, rel=1e-5)
    slope = at.tangent @ v
    assert (ahead.force - behind.force) / (2.0 * h) == pytest.approx(
        slope, abs=1e-6 * np.abs(slope).max())
    assert abs(at.tangent - at.tangent.T).max() == 0.0
    K = model.state(0.0 * q).tangent
    linear = body.expansion.T @ body.stiffness @ body.expansion
    n = linear.shape[0]
    if K.shape[0] > n:  # incompatible modes, condensed
        K, linear = K.toarray(), linear.toarray()
        K = K[:n, :n] - K[:n, n:] @ np.linalg.solve(K[n:, n:], K[n:, :n])
    assert abs(K - linear).max() < 1e-12 * abs(linear).max()


@pytest.mark.parametrize("name", FREE)
def test_patch_under_finite_rotation(name):
    """A rigid rotation gives no force; uniform strain that is turned has the energy of C."""
    body = FREE[name]()
    model, d = FiniteStrainModel(body), body.dimension
    extra = model.expansion.shape[1] - body.unknowns

    def state(F):
        moved = body.nodes @ (F - np.eye(d)).T
        return model.state(np.append(moved.ravel(), np.zeros(extra)))

    turn = rotation(d)
    rigid = state(turn)
    scale = np.abs(body.stiffness).max() * np.ptp(body.nodes)
    assert np.abs(rigid.force).max() < 1e-13 * scale
    assert rigid.strain < 1e-13
    stretch = np.eye(d) + 0.05 * np.random.default_rng(3).standard_normal((d, d))
    found = state(turn @ stretch)
    green = 0.5 * (stretch.T @ stretch - np.eye(d))
    if name != "wood":
        _, lateral, shear = body.elasticity[0]
        density = 0.5 * lateral * np.trace(green)**2 + shear * (green**2).sum()
        volume = body.thickness * sum(block.volumes.sum() for block in body.blocks)
        assert found.energy == pytest.approx(density * volume, rel=1e-10)
    # No forces inside, on the bubbles too.
    inside = np.ones(len(body.nodes), bool)
    inside[np.unique(body.facet_nodes(body.mesh.outline))] = False
    forces = found.force[:body.unknowns].reshape(-1, d)
    assert np.abs(forces[inside]).max(initial=0.0) < 1e-10 * np.abs(forces).max()
    assert np.abs(found.force[body.unknowns:]).max(initial=0.0) < 1e-10 * np.abs(forces).max()


@pytest.mark.parametrize("solid", [False, True])
def test_follower_pressure_does_the_work_of_the_volume(solid):
    """On a closed outline f . v = -p dV/dv; the load stiffness is the derivative of f."""
    if solid:
        mesh = block_mesh((2, 1, 1), (1.0, 0.4, 0.3))
        mesh = Mesh(mesh.nodes, mesh.cells, {"all": mesh.outline})
        body = ElasticBody(mesh, MATERIAL)
    else:
        mesh = rectangle(1.0, 0.4, 3, 2, warp=skewed)
        body = ElasticBody(Mesh(mesh.nodes, mesh.cells, {"all": mesh.outline}), MATERIAL,
                           thickness=0.2)
    p, rng = 3e5, np.random.default_rng(2)
    u, v = 0.02 * rng.standard_normal((2, *body.nodes.shape))

    def volume(moved):
        total = 0.0
        for block in body.blocks:
            gradients, volumes = block.gradients()
            F = np.einsum("eki,eqkj->eqij", (body.nodes + moved)[block.nodes], gradients)
            total += body.thickness * (np.linalg.det(F) * volumes).sum()
        return total

    force, slope = follower_pressure(body, {"all": p}, u)
    h = 1e-4
    exact = -p * (volume(u + h * v) - volume(u - h * v)) / (2.0 * h)
    assert force @ v.ravel() == pytest.approx(exact, rel=1e-6)
    ahead, behind = (follower_pressure(body, {"all": p}, u + s * h * v)[0] for s in (1.0, -1.0))
    found = slope @ v.ravel()
    assert (ahead - behind) / (2.0 * h) == pytest.approx(found, abs=1e-8 * np.abs(found).max())
    assert abs(slope - slope.T).max() < 1e-12 * abs(slope).max()
