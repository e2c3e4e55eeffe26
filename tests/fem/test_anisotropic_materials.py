"""Anisotropic materials: stiffness, axes, stress, modes, damping, decks and study files."""

from itertools import product

import numpy as np
import pytest
from meshes_for_tests import rectangle
from solid_blocks import block_mesh
from test_deck_constraints import part, read
from test_materials import MESHES

from fecontact import (
    BoundaryLoad,
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    MeshError,
    ModelWarning,
    Study,
    generate,
    modal_basis,
    static_solution,
)
from fecontact.fem import (
    AnisotropicMaterial,
    CurveAxes,
    CylindricalAxes,
    FieldAxes,
    MaterialAxes,
    Ring,
    Rotation,
    stress_of,
)
from fecontact.fem.material_axes import rotated_stiffness
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.eigenmodes import strain_energies

# Carbon fibres in epoxy, nearly as in Jones, Mechanics of Composite Materials, but orthotropic.
E, NU, G, RHO = (140e9, 10e9, 8e9), (0.3, 0.25, 0.4), (5e9, 4e9, 3e9), 1600.0
PLY = AnisotropicMaterial.orthotropic(E, NU, G, RHO)
XYZ = MaterialAxes()
TILTED = MaterialAxes((1.0, 2.0, 0.5), (-1.0, 1.0, 0.7), about=3, angle=20.0)


def fully_anisotropic(axes=XYZ):
    """Orthotropic stiffness seen in other axes, which fill all entries."""
    C = rotated_stiffness(np.array(PLY.stiffness), TILTED.at(np.zeros((1, 3))))[0]
    return AnisotropicMaterial(C.tolist(), RHO, axes)


def as_orthotropic(one, axes=XYZ):
    E, nu = one.youngs_modulus, one.poisson_ratio
    return AnisotropicMaterial.orthotropic((E,) * 3, (nu,) * 3, (E / (2.0 + 2.0 * nu),) * 3,
                                           one.density, axes)


@pytest.mark.parametrize("axes", [MaterialAxes(), TILTED, CylindricalAxes((-1.0, 0.3, 0.2),
                                                                          (1.0, 0.2, 3.0))])
@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("cells", MESHES)
def test_isotropic_written_as_orthotropic_is_isotropic(cells, plane, axes):
    steel, mesh = Material.named("steel"), MESHES[cells]
    if mesh.dimension == 2 and axes != XYZ:
        axes = MaterialAxes((1.0, 2.0), (-1.0, 1.0))
    options = {"plane": plane, "thickness": 0.02} if mesh.dimension == 2 else {}
    one, other = (ElasticBody(mesh, of, **options) for of in (steel, as_orthotropic(steel, axes)))
    assert abs(one.stiffness - other.stiffness).max() < 1e-13 * abs(one.stiffness).max()
    assert abs(one.mass - other.mass).max() < 1e-13 * abs(one.mass).max()
    moved = np.random.default_rng(0).standard_normal((one.nodes.size, 2))
    assert strain_energies(other, moved) == pytest.approx(strain_energies(one, moved), rel=1e-12)
    stresses = [modal_basis(body, 8, contact=()).mode_shapes.stress[:, :, 6:]
                for body in (one, other)]
    assert np.abs(stresses[1]) == pytest.approx(np.abs(stresses[0]),
                                                abs=1e-6 * np.abs(stresses[0]).max())


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("cells", MESHES)
def test_energies_are_those_of_the_stiffness(cells, degree):
    """Materials with and without axes in one body; distorted cells by quadrature."""
    mesh = MESHES[cells]
    nodes = mesh.nodes + 0.002 * np.random.default_rng(3).standard_normal(mesh.nodes.shape)
    mesh = Mesh(nodes, mesh.cells, cell_groups=mesh.cell_groups)
    axes = MaterialAxes((1.0, 2.0), (-1.0, 1.0)) if mesh.dimension == 2 else TILTED
    body = ElasticBody(mesh, {"near": AnisotropicMaterial(PLY.stiffness, RHO, axes),
                              "far": Material.named("steel")}, degree=degree)
    moved = np.random.default_rng(1).standard_normal((body.nodes.size, 4))
    assert strain_energies(body, moved) == pytest.approx(
        0.5 * np.einsum("im,im->m", moved, body.stiffness @ moved), rel=1e-10)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("tetrahedra", [False, True])
def test_patch_test(tetrahedra, degree):
    """Displacements linear in space: no forces inside, the stress is C times the strain."""
    mesh = block_mesh((3, 2, 2), tetrahedra=tetrahedra)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.outline)
    nodes = mesh.nodes.copy()
    nodes[inner] += 0.004 * np.random.default_rng(2).standard_normal((len(inner), 3))
    material = fully_anisotropic(TILTED)
    body = ElasticBody(Mesh(nodes, mesh.cells), material, degree=degree)
    gradient = 1e-3 * np.random.default_rng(4).standard_normal((3, 3))
    moved = (body.nodes @ gradient.T).ravel()
    inside = ~np.isin(np.round(body.nodes, 9), np.round([0.0, 0.2, 0.1, 0.05], 9)).any(axis=1)
    force = (body.stiffness @ moved).reshape(-1, 3)
    assert np.abs(force[inside]).max() < 1e-12 * np.abs(force).max()
    e = 0.5 * (gradient + gradient.T)
    # The tensor itself, without matrices of six components.
    axes, C = TILTED.at(np.zeros((1, 3)))[0], np.array(material.stiffness)
    number = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
    tensor = np.einsum("pi,qj,rk,sl,pqrs->ijkl", axes, axes, axes, axes,
                       C[number[:, :, None, None], number])
    expected = np.einsum("ijkl,kl->ij", tensor, e)
    found = stress_of(body, moved[:, None])[:, :, 0]
    wanted = expected[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    assert found == pytest.approx(np.tile(wanted, (len(found), 1)),
                                  abs=1e-9 * np.abs(wanted).max())
    own = axes @ expected @ axes.T
    assert stress_of(body, moved[:, None], "material")[:, :, 0] == pytest.approx(
        np.tile(own[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]], (len(found), 1)),
        abs=1e-9 * np.abs(own).max())
    assert strain_energies(body, moved[:, None])[0] == pytest.approx(
        0.5 * np.einsum("ij,ij", expected, e) * 0.2 * 0.1 * 0.05, rel=1e-11)


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_plane_bodies_in_tension(plane):
    """Tension along x of a ply whose axes are turned by 30 degrees about z."""
    axes = MaterialAxes(angle=30.0, about=3)
    body = ElasticBody(rectangle(0.1, 0.04, 4, 2), AnisotropicMaterial(PLY.stiffness, RHO, axes),
                       plane=plane)
    S = np.linalg.inv(rotated_stiffness(np.array(PLY.stiffness), axes.at(np.zeros((1, 3))))[0])
    if plane == "strain":
        S = S - S[:, 2:3] * S[2:3] / S[2, 2]
    load = Load(boundaries=(BoundaryLoad("right", -1e6), BoundaryLoad("left", -1e6)))
    found = static_solution(body, load)
    assert found.stress[:, [0, 1, 3]] == pytest.approx(
        np.tile([1e6, 0.0, 0.0], (len(found.stress), 1)), abs=1e-2)
    across = 0.0 if plane == "stress" else -1e6 * np.linalg.inv(rotated_stiffness(
        np.array(PLY.stiffness), axes.at(np.zeros((1, 3))))[0])[2, 0] / np.linalg.inv(
            rotated_stiffness(np.array(PLY.stiffness), axes.at(np.zeros((1, 3))))[0])[2, 2]
    assert found.stress[:, 2] == pytest.approx(across, abs=1e-2)
    ends = [found.displacement[body.group_nodes(name)] for name in ("left", "right")]
    assert (ends[1] - ends[0])[:, 0].mean() == pytest.approx(0.1 * S[0, 0] * 1e6, rel=1e-9)
    c, s = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
    own = static_solution(body, load, stress_axes="material").stress
    assert own[:, [0, 1, 3]] == pytest.approx(
        np.tile([1e6 * c * c, 1e6 * s * s, -1e6 * c * s], (len(own), 1)), abs=1e-2)


# Waves between sliding walls ---------------------------------------------------------------------


def christoffel_hz(sides, count):
    """Lowest frequencies of a box of the ply with sliding walls.

    ``u_i = a_i sin(k_i x_i) prod cos(k_j x_j)`` with ``k_i = n_i pi / L_i``: the walls meet neither
    displacements along their normal nor shear, and ``(Gamma - rho w^2) a = 0`` with
    ``Gamma_ii = C_ii k_i^2 + G_ij k_j^2 + G_ik k_k^2, Gamma_ij = (C_ij + G_ij) k_i k_j``.
    """
    C = np.array(PLY.stiffness)
    G = {(0, 1): C[3, 3], (1, 2): C[4, 4], (0, 2): C[5, 5]}
    d, found = len(sides), []
    for n in product(range(8), repeat=d):
        k = np.pi * np.array(n) / np.array(sides)
        shear = [[G.get((min(i, j), max(i, j)), 0.0) for j in range(d)] for i in range(d)]
        matrix = (C[:d, :d] + shear) * np.outer(k, k) + np.diag(shear @ k**2)
        used = np.flatnonzero(k)
        # Components without their sine are zero.
        matrix = matrix[np.ix_(used, used)]
        found += np.sqrt(np.linalg.eigvalsh(matrix) / RHO).tolist()
    return np.sort(found)[:count] / (2.0 * np.pi)


WALLS = {"left": "x", "right": "x", "front": "y", "back": "y", "contact": "z", "top": "z"}


@pytest.mark.parametrize(("tetrahedra", "counts", "error", "rate"), [
    (False, ((2, 2, 2), (4, 4, 4)), 8e-3, 3.8), (True, ((4, 3, 3), (8, 6, 6)), 1.2e-2, 3.5)])
def test_a_box_with_sliding_walls_meets_christoffel(tetrahedra, counts, error, rate):
    """Errors fall like h^4 and are above zero."""
    sides = (0.1, 0.08, 0.06)
    exact = christoffel_hz(sides, 6)
    errors = [eigenfrequencies_hz(ElasticBody(
        block_mesh(one, sides, tetrahedra=tetrahedra), PLY, fixed=WALLS), 6) / exact - 1.0
        for one in counts]
    assert min(errors[1]) > 0.0
    assert max(errors[0]) < error
    assert np.log2(errors[0] / errors[1]).min() > rate


def test_a_rectangle_with_sliding_walls_meets_christoffel():
    """In plane strain the plane waves of a solid; errors fall like h^4."""
    sides = (0.1, 0.08)
    exact = christoffel_hz(sides, 3)
    errors = [eigenfrequencies_hz(ElasticBody(
        rectangle(*sides, count, count), PLY, plane="strain",
        fixed={"left": "x", "right": "x", "bottom": "y", "top": "y"}), 3) / exact - 1.0
        for count in (4, 8)]
    assert max(errors[1]) < 2e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.95, abs=0.08)


@pytest.mark.parametrize("tetrahedra", [False, True])
def test_turned_axes_of_a_turned_body_give_the_same_frequencies(tetrahedra):
    """A body turned with the axes of its material, or mirrored, vibrates as before."""
    mesh = block_mesh((3, 2, 2), (0.1, 0.05, 0.03), tetrahedra=tetrahedra)
    for axes in (TILTED, CylindricalAxes((0.2, -0.4, 0.1), (0.1, 1.0, 2.0), about=1, angle=25.0),
                 CylindricalAxes((0.2, -0.4, 0.1), (0.1, 1.0, 2.0), about=3, angle=25.0),
                 *(CurveAxes(((-0.02, 0.01, 0.0), (0.05, 0.03, 0.01), (0.12, 0.0, 0.03)),
                             (0.1, -0.2, 1.0), about, 25.0) for about in (1, 2, 3)),
                 FieldAxes(((0.0, 0.0, 0.0), (0.11, 0.02, 0.01)), ((1.0, 1.0, 0.0),
                           (0.0, 1.0, 3.0)), ((0.0, 0.0, 1.0), (1.0, 0.2, 0.1)), 2, 25.0)):
        of = fully_anisotropic(axes)
        still = Mesh(mesh.nodes, mesh.cells, cell_groups={"all": np.arange(len(mesh.cells))},
                     materials={"all": of})
        expected = eigenfrequencies_hz(ElasticBody(still), 9)[6:]
        for move in ({"rotation": (20.0, -50.0, 110.0), "shift": (0.3, -0.2, 0.1)},
                     {"mirror": "x"}, {"mirror": "z", "rotation": (15.0, 0.0, 40.0)}):
            placed = still.placed(**move)
            assert placed.materials["all"] != of
            assert eigenfrequencies_hz(ElasticBody(placed), 9)[6:] == pytest.approx(
                expected, rel=1e-9)
        # The axes matter: a body turned without them has other frequencies.
        turned = still.placed(rotation=(20.0, -50.0, 110.0), shift=(0.3, -0.2, 0.1))
        other = eigenfrequencies_hz(ElasticBody(turned, of), 9)[6:]
        assert np.abs(other / expected - 1.0).max() > 1e-2


def circle(count, radius=0.075):
    """Points of a closed circle about z."""
    turn = np.linspace(0.0, 2.0 * np.pi, count + 1)[:-1]
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.0 * turn], axis=1).tolist()
    return (*points, points[0])


@pytest.mark.parametrize("ring", [
    AnisotropicMaterial.orthotropic((10e9, 40e9, 10e9), (0.0, 0.0, 0.0), (4e9,) * 3, RHO,
                                    CylindricalAxes()),
    AnisotropicMaterial.orthotropic((40e9, 10e9, 10e9), (0.0, 0.0, 0.0), (4e9,) * 3, RHO,
                                    CurveAxes(circle(48)))])
def test_a_pressed_tube_with_cylindrical_axes(ring):
    """Lekhnitskii, Anisotropic Plates: a ring in plane stress under inner pressure p.

    ``s_r = p c^(k+1) / (1 - c^(2k)) ((r/b)^(k-1) - (r/b)^(-k-1))`` with ``c = a / b`` and
    ``k = sqrt(E_theta / E_r)``.
    """
    mesh = generate(Ring(0.1, 0.05, 0.01, element_size=0.0125, layers=1))
    body = ElasticBody(mesh, ring, fixed={"contact": "z"})
    found = static_solution(body, Load(boundaries=(BoundaryLoad("inner", 1e6),)),
                            stress_axes="material")
    r = np.hypot(*found.nodes[:, :2].T)
    k, c, at = 2.0, 0.5, r / 0.1
    exact = 1e6 * c ** (k + 1) / (1 - c ** (2 * k)) * (at ** (k - 1) - at ** (-k - 1))
    hoop = 1e6 * c ** (k + 1) / (1 - c ** (2 * k)) * k * (at ** (k - 1) + at ** (-k - 1))
    radial, along = (1, 0) if isinstance(ring.axes, CurveAxes) else (0, 1)
    assert found.stress[:, radial] == pytest.approx(exact, abs=0.08e6)
    assert found.stress[:, along] == pytest.approx(hoop, abs=0.12e6)
    assert np.abs(found.stress[:, 3]).max() < 0.06e6


def test_the_iterative_solver_takes_anisotropic_materials():
    mesh = block_mesh((8, 5, 4), tetrahedra=True)
    body = ElasticBody(mesh, AnisotropicMaterial.transversely_isotropic(
        (30e9, 15e9), (0.3, 0.35), 7e9, RHO, TILTED))
    direct, iterated = (eigenfrequencies_hz(body, 12, eigensolver=solver)
                        for solver in ("direct", "iterative"))
    assert iterated == pytest.approx(direct, rel=1e-7)


def test_rotation_stiffens_an_orthotropic_body_as_an_isotropic_one():
    aluminium = Material.named("aluminium")
    speeds = [modal_basis(ElasticBody(rectangle(0.3, 0.02, 8, 2), of, fixed={"left": "xy"}), 4,
                          contact=(), rotation=Rotation(300.0)).stiffness_matrix
              for of in (aluminium, as_orthotropic(aluminium))]
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-7, abs=1e-7 * np.abs(speeds[0]).max())


# Damping -----------------------------------------------------------------------------------------


def test_loss_factors_count_by_elastic_energy():
    """Two bars in series: the energy in each is L / E of the total in the static limit."""
    lossy = {"near": Material(2e11, 0.0, 1.0, 0.02), "far": Material(5e10, 0.0, 4e4, 0.08)}
    body = ElasticBody(MESHES["hexahedra"], lossy, fixed={"left": "xyz", "front": "y", "back": "y",
                                                          "contact": "z", "top": "z"})
    basis = modal_basis(body, 6, contact=(), damping="materials")
    shapes = basis.mode_shapes.shapes.reshape(-1, basis.modes)
    for mode in range(basis.modes):
        u = shapes[:, mode]
        part = strain_energies(body, u[:, None], np.flatnonzero(body.cell_materials == 0))[0]
        share = 2.0 * part / basis.angular_frequencies[mode] ** 2
        assert basis.damping_ratios[mode] == pytest.approx(
            0.5 * (0.02 * share + 0.08 * (1.0 - share)), rel=1e-9)
    # A light bar that carries a heavy one: a wave cos(w t) in the heavy one.
    equal = {name: Material(2e11, 0.3, 7850.0, 0.03) for name in ("near", "far")}
    free = modal_basis(ElasticBody(MESHES["triangles"], equal), 8, contact=(), damping="materials")
    assert free.damping_ratios == pytest.approx([0.0] * 3 + [0.015] * 5, abs=1e-12)


# Study files -------------------------------------------------------------------------------------


def test_axes_along_a_circle_are_those_around_its_centre():
    """Axis 1 is circumferential and axis 2 points inwards; the error falls with the third power."""
    places = np.random.default_rng(5).uniform([-0.1, -0.1, -0.02], [0.1, 0.1, 0.02], (200, 3))
    places = places[np.hypot(*places[:, :2].T) > 0.02]
    radial, around, along = np.moveaxis(CylindricalAxes().at(places), 1, 0)
    exact = np.stack([around, -radial, along], axis=1)
    errors = [np.abs(CurveAxes(circle(count)).at(places) - exact).max() for count in (12, 24, 48)]
    assert errors[-1] < 1e-4
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 2.7


def test_axes_along_a_helix():
    """The tangent of a helix at its closest place, also for places beside it and at its ends."""
    turn = np.linspace(0.0, 3.0 * np.pi, 121)
    helix, slope = (np.stack(one, axis=1) for one in (
        (np.cos(turn), np.sin(turn), 0.2 * turn), (-np.sin(turn), np.cos(turn), 0.2 + 0.0 * turn)))
    slope /= np.linalg.norm(slope, axis=1, keepdims=True)
    # Beside it along its principal normal and binormal.
    normal = -np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    axes = CurveAxes(tuple(helix.tolist()), (0.0, 0.0, 2.0))
    found = axes.at(helix + 0.1 * normal - 0.05 * np.cross(slope, normal))
    assert found[:, 0] == pytest.approx(slope, abs=1e-4)
    assert found[:, 1] == pytest.approx(normal, abs=1e-4)
    assert np.einsum("nai,nbi->nab", found, found) == pytest.approx(
        np.broadcast_to(np.eye(3), found.shape), abs=1e-12)
    assert axes.at(helix[:1] - slope[:1])[0, 0] == pytest.approx(slope[0], abs=1e-4)
    straight = CurveAxes(((0.0, 0.0), (1.0, 1.0)), about=3, angle=90.0).at(np.ones((1, 3)))[0]
    assert straight == pytest.approx(np.array([[-1, 1, 0], [-1, -1, 0], [0, 0, 2 ** 0.5]])
                                     / 2 ** 0.5)


def test_energies_along_a_curve_are_those_of_the_stiffness():
    body = ElasticBody(block_mesh((4, 2, 2), (0.1, 0.05, 0.03)), fully_anisotropic(
        CurveAxes(((0.0, 0.0, 0.0), (0.05, 0.02, 0.0), (0.1, 0.0, 0.01)))))
    assert len(body.anisotropic[0]) == 16
    moved = np.random.default_rng(1).standard_normal((body.nodes.size, 4))
    assert strain_energies(body, moved) == pytest.approx(
        0.5 * np.einsum("im,im->m", moved, body.stiffness @ moved), rel=1e-10)


@pytest.mark.parametrize(("change", "message"), [
    ({"points": ((0, 0, 0),)}, r"points = \(\(0, 0, 0\),\) must be two or more places"),
    ({"points": ((0, 0, 0), (1, 0, 0), (1, 0, 0))}, r"points 2 and 3 lie at one place, \[1\.0, 0"),
    ({"points": ((0, 0, 0), (1, np.nan, 0))}, r"points = \(1, nan, 0\) must be coordinates"),
    ({"third": (0, 0, 0)}, r"third = \(0, 0, 0\) must be longer than zero"),
    ({"about": 4}, r"about = 4 must be 1, 2 or 3"),
    ({"angle": np.inf}, r"angle"),
])
def test_bad_curves_are_refused(change, message):
    with pytest.raises(InputError, match=rf"CurveAxes.*{message}"):
        CurveAxes(**{"points": ((0, 0, 0), (1, 0, 0)), **change})


def test_places_without_axes_along_a_curve_are_refused():
    with pytest.raises(InputError, match=r"\(0, 0, 0\), a whole arc of the curve is equally close"):
        CurveAxes(circle(64)).at(np.zeros((1, 3)))
    with pytest.raises(InputError, match=r"\(1, 1, 1\), the curve is parallel to third = "):
        CurveAxes(((0, 0, 0), (0, 0, 1))).at(np.ones((1, 3)))


def test_axes_by_a_field_are_those_of_the_closest_place():
    """Samples of cylindrical axes: exact at their places, and within their distance elsewhere."""
    places = np.random.default_rng(5).uniform([0.05, -0.1, -0.02], [0.1, 0.1, 0.02], (2000, 3))
    round_ones = CylindricalAxes(about=2, angle=30.0)
    exact = round_ones.at(places)
    field = FieldAxes(places[:1000], exact[:1000, 0], exact[:1000, 1] + 0.3 * exact[:1000, 0])
    found = field.at(places)
    assert found[:1000] == pytest.approx(exact[:1000], abs=1e-12)
    gap = np.linalg.norm(places[1000:, None] - places[:1000], axis=2).min(axis=1)
    assert (np.abs(found - exact)[1000:].max(axis=(1, 2)) < gap / 0.05).all()
    assert FieldAxes(about=3, angle=90.0).at(np.ones((1, 3)))[0] == pytest.approx(
        np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]))
    scaled = field.scaled(2.0).at(2.0 * places)
    assert scaled == pytest.approx(found, abs=1e-14)


def test_a_body_with_the_axes_of_each_cell_is_that_of_the_axes():
    """A field given at the centres of all cells is the curve that it was taken from."""
    curve = CurveAxes(((0.0, 0.0, 0.0), (0.05, 0.02, 0.0), (0.1, 0.0, 0.01)))
    body = ElasticBody(block_mesh((4, 2, 2), (0.1, 0.05, 0.03)), fully_anisotropic(curve))
    centres = body.cell_centres(np.arange(16))
    rows = curve.at(centres)
    field = FieldAxes(centres, rows[:, 0], rows[:, 1])
    other = ElasticBody(body.mesh, fully_anisotropic(field))
    assert abs(other.stiffness - body.stiffness).max() < 1e-9 * abs(body.stiffness).max()


@pytest.mark.parametrize(("change", "message"), [
    ({"along": ((1, 0, 0),)}, r"along must be 2 finite .* not an array of shape \(1, 3\)"),
    ({"across": ((0, 1, 0), (2, 0, 0))}, r"of place 2 span no plane"),
    ({"across": ((0, 0, 0), (0, 1, 0))}, r"of place 1 span no plane"),
    ({"places": ((0, 0, 0), (0, 0, 0))}, r"places holds one place twice"),
    ({"places": ((0, 0, 0), (0, np.nan, 0))}, r"places must be 2 finite"),
    ({"about": 0}, r"about = 0 must be 1, 2 or 3"),
])
def test_bad_fields_are_refused(change, message):
    with pytest.raises(InputError, match=rf"FieldAxes.*{message}"):
        FieldAxes(**{"places": ((0, 0, 0), (1, 0, 0)), "along": ((1, 0, 0), (1, 0, 0)),
                     "across": ((0, 1, 0), (0, 1, 0)), **change})


def study_of(tmp_path, materials, damping="0.0"):
    return Study.from_toml(
        "[geometry]\nshape = 'solid-block'\nlength = 0.1\nwidth = 0.05\nheight = 0.02\n"
        f"element_size = 0.02\n{materials}\n[basis]\nmodes = 8\ncontact = []\n"
        f"damping = {damping}\n", tmp_path / "study.toml")


def test_materials_of_studies(tmp_path):
    table = ("[[body.materials]]\nyoungs_modulus = [140e9, 10e9, 8e9]\npoisson_ratio = [0.3, 0.25, "
             "0.4]\nshear_modulus = [5e9, 4e9, 3e9]\ndensity = 1600.0\nloss_factor = 0.02\n"
             "axes = {point = [0.0, 1.0, 0.0], direction = [0.0, 0.0, 1.0]}\n")
    study = study_of(tmp_path, table, "'materials'")
    body = study.elastic_body()
    assert body.materials[0] == AnisotropicMaterial.orthotropic(
        E, NU, G, RHO, CylindricalAxes((0.0, 1.0, 0.0)), 0.02)
    assert study.modal_basis().damping_ratios[6:] == pytest.approx(0.01)
    assert Study.from_tables(study.tables()).elastic_body().materials == body.materials
    along = study_of(tmp_path, table.replace(
        "point = [0.0, 1.0, 0.0], direction = [0.0, 0.0, 1.0]",
        "points = [[0.0, 0.0, 0.0], [0.05, 0.02, 0.0], [0.1, 0.0, 0.0]], third = [0, 0, 1]"))
    assert along.elastic_body().materials[0].axes == CurveAxes(
        ((0.0, 0.0, 0.0), (0.05, 0.02, 0.0), (0.1, 0.0, 0.0)))
    assert Study.from_tables(along.tables()).elastic_body().materials == (
        along.elastic_body().materials)
    field = study_of(tmp_path, table.replace(
        "point = [0.0, 1.0, 0.0], direction = [0.0, 0.0, 1.0]",
        "places = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]], along = [[1, 0, 0], [1, 1, 0]], "
        "across = [[0, 1, 0], [0, 1, 0]]"))
    assert field.elastic_body().materials[0].axes == FieldAxes(
        ((0.0, 0.0), (0.1, 0.0)), ((1.0, 0.0), (1.0, 1.0)), ((0.0, 1.0), (0.0, 1.0)))
    assert Study.from_tables(field.tables()).elastic_body().materials == (
        field.elastic_body().materials)
    fibres = study_of(tmp_path, "[[body.materials]]\nyoungs_modulus = [140e9, 10e9]\n"
                      "poisson_ratio = [0.3, 0.4]\nshear_modulus = 5e9\ndensity = 1600.0\n")
    assert fibres.elastic_body().materials[0] == AnisotropicMaterial.transversely_isotropic(
        (140e9, 10e9), (0.3, 0.4), 5e9, RHO)
    rows = [list(row) for row in PLY.stiffness]
    whole = study_of(tmp_path, f"[[body.materials]]\nstiffness = {rows}\ndensity = 1600.0\n"
                     "axes = {first = [0.0, 1.0, 0.0], second = [0.0, 0.0, 1.0]}\n")
    assert whole.elastic_body().materials[0].axes == MaterialAxes((0.0, 1.0), (0.0, 0.0, 1.0))


@pytest.mark.parametrize(("table", "message"), [
    ("youngs_modulus = 1e9\n", r"'density', 'poisson_ratio' is missing; give it, or a material"),
    ("material = 'steel'\naxes = {first = [0, 1, 0], second = [1, 0, 0]}\n",
     r"'axes' is for an anisotropic material"),
    ("youngs_modulus = [1e9, 1e9, 1e9]\ndensity = 1e3\n",
     r"needs 'poisson_ratio', 'shear_modulus' too"),
    ("youngs_modulus = [1e9, 1e9, 1e9]\npoisson_ratio = [0.3, 0.3, 0.3]\nshear_modulus = 1e9\n"
     "density = 1e3\n", r"must be three numbers each"),
    ("stiffness = [[1.0, 2.0]]\ndensity = 1e3\n", r"stiffness must be 6 rows of 6 finite numbers"),
    ("cells = 'no'\nmaterial = 'steel'\n", r"material names 'no', which is no group of cells"),
    ("material = 'steel'\n[[body.materials]]\nmaterial = 'steel'\n",
     r"materials has 2 materials, one of them without cells; name the group"),
    ("cells = 'a'\nmaterial = 'steel'\n[[body.materials]]\ncells = 'a'\nmaterial = 'steel'\n",
     r"materials names the cells 'a' twice"),
    ("youngs_modulus = [1e9, 1e9, 1e9]\npoisson_ratio = [0.3, 0.3, 0.3]\ndensity = 1e3\n"
     "shear_modulus = [1e9, 1e9, 1e9]\naxes = {first = [1, 0, 0], second = [2, 0, 0]}\n",
     r"first = .* and second = .* span no plane"),
])
def test_bad_materials_of_studies_are_refused(tmp_path, table, message):
    with pytest.raises((InputError, MeshError), match=message):
        study_of(tmp_path, f"[[body.materials]]\n{table}").elastic_body()


def test_a_single_material_and_materials_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"'material' and materials both describe the material"):
        study_of(tmp_path, "[body]\nmaterial = 'steel'\n[[body.materials]]\nmaterial = 'steel'\n")


# Admissibility -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("change", "message"), [
    ({"youngs_moduli": (1e9, -1e9, 1e9)}, r"E_2 = -1000000000\.0 must be a finite number above"),
    ({"shear_moduli": (1e9, 0.0, 1e9)}, r"G_13 = 0\.0 must be a finite number above zero"),
    ({"poisson_ratios": (3.8, 0.25, 0.4)}, r"nu_12 = 3\.8 must lie between -3\.742 and 3\.742, the "
                                           r"root of E_1 / E_2"),
    ({"poisson_ratios": (3.0, 3.0, 0.1)}, r"= -0\.\d+, which must be above zero, so that every"),
    ({"poisson_ratios": (0.3, 0.25)}, r"poisson_ratios = .* must be three finite numbers"),
    ({"density": 0.0}, r"density = 0\.0 must be a finite number above zero"),
])
def test_inadmissible_constants_are_refused(change, message):
    given = {"youngs_moduli": E, "poisson_ratios": NU, "shear_moduli": G, "density": RHO}
    with pytest.raises(InputError, match=message):
        AnisotropicMaterial.orthotropic(**{**given, **change})


@pytest.mark.parametrize(("row", "column", "value", "message"), [
    (3, 3, -1.0, r"C_12,12 = -1 Pa must be above zero"),
    (0, 1, 50e9, r"C_11,22 = 5e\+10 Pa must be smaller in magnitude than .*, the root of C_11,11"),
    (4, 3, None, r"stiffness must be symmetric, but has .* in row 5, column 4"),
    (None, None, None, r"its smallest eigenvalue, with entries over the roots .* above zero"),
])
def test_inadmissible_stiffness_is_refused(row, column, value, message):
    C = np.array(PLY.stiffness)
    if row is None:
        C[:3, :3] = np.where(np.eye(3), 1e9, -0.6e9)
    elif value is None:
        C[row, column] = 1e9
    else:
        C[row, column] = C[column, row] = value
    with pytest.raises(InputError, match=message):
        AnisotropicMaterial(C.tolist(), RHO)


def test_axes_that_no_plane_body_or_no_cell_has_are_refused():
    with pytest.raises(InputError, match=r"make stresses that shear it across this plane"):
        ElasticBody(rectangle(0.1, 0.04, 2, 2), AnisotropicMaterial(PLY.stiffness, RHO, TILTED))
    one = block_mesh((1, 1, 1))
    with pytest.raises(InputError, match=r"the centre of a cell, \(0\.1, .*, lies on the line"):
        ElasticBody(one, AnisotropicMaterial(PLY.stiffness, RHO, CylindricalAxes((0.1, 0.05, 0))))
    with pytest.raises(InputError, match=r"stress_of: axes = 'material' of a plane body"):
        static_solution(ElasticBody(rectangle(0.1, 0.04, 2, 2), AnisotropicMaterial(
            PLY.stiffness, RHO, MaterialAxes((0, 0, 1), (1, 1, 0)))), Load(),
            stress_axes="material")


# Decks -------------------------------------------------------------------------------------------


CONSTANTS = {
    "ENGINEERING CONSTANTS": "140e9, 10e9, 8e9, 0.3, 0.25, 0.4, 5e9, 4e9\n3e9,\n",
    "ORTHO": ", ".join(repr(PLY.stiffness[i][j]) for i, j in (
        (0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))) + ", 5e9, 4e9\n3e9\n",
}
CONSTANTS["ANISO"] = (CONSTANTS["ORTHO"].split(", 5e9")[0] + ", 0, 0\n0, 5e9, 0, 0, 0, 0, 4e9, 0\n"
                      "0, 0, 0, 0, 3e9\n")

BLOCK = block_mesh((3, 2, 2), tetrahedra=True)


def deck(kind, orientation="", option="", mesh=BLOCK):
    return (f"{part(mesh, 'A')}*ELSET, ELSET=ALL, GENERATE\n1, {len(mesh.cells)}\n{orientation}"
            f"*SOLID SECTION, ELSET=ALL, MATERIAL=PLY{option}\n*MATERIAL, NAME=PLY\n"
            f"*ELASTIC, TYPE={kind}\n{CONSTANTS[kind]}*DENSITY\n1600.,\n")


@pytest.mark.parametrize("kind", CONSTANTS)
def test_anisotropic_materials_of_decks(tmp_path, kind):
    found = read(tmp_path, deck(kind)).materials["ALL"]
    assert np.array(found.stiffness) == pytest.approx(np.array(PLY.stiffness), rel=1e-12)
    assert (found.density, found.axes, found.loss_factor) == (1600.0, MaterialAxes(), 0.0)
    lossy = deck(kind).replace("*DENSITY", "*DAMPING, STRUCTURAL=0.04\n*DENSITY")
    assert read(tmp_path, lossy).materials["ALL"].loss_factor == 0.04


def test_expansion_of_decks(tmp_path):
    """One number for isotropic materials; more gives a warning and leaves the material as is."""
    plain = deck("ORTHO").replace(f"TYPE=ORTHO\n{CONSTANTS['ORTHO']}",
                                  "TYPE=ISO\n7e10, 0.33\n")
    for lines in ("2.3e-5,\n", "2.3e-5, 20.\n"):
        text = plain.replace("*DENSITY", f"*EXPANSION\n{lines}*DENSITY")
        assert read(tmp_path, text).materials["ALL"].thermal_expansion == 2.3e-5
    for text in (plain.replace("*DENSITY", "*EXPANSION\n2.3e-5, 20.\n2.5e-5, 90.\n*DENSITY"),
                 deck("ORTHO").replace("*DENSITY", "*EXPANSION\n2.3e-5,\n*DENSITY")):
        with pytest.warns(ModelWarning, match=r"'PLY' has an \*EXPANSION over directions or temp"):
            found = read(tmp_path, text).materials["ALL"]
        assert getattr(found, "thermal_expansion", 0.0) == 0.0


@pytest.mark.parametrize(("lines", "axes"), [
    ("*ORIENTATION, NAME=O\n0, 1, 0, -1, 0, 0\n", MaterialAxes((0, 1, 0), (-1, 0, 0))),
    ("*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR\n1, 2, 1, 1, 1, 2, 1, 1, 1\n3, 30.\n",
     MaterialAxes((0, 1, 0), (0, 0, 1), 3, 30.0)),
    ("*ORIENTATION, SYSTEM=CYLINDRICAL, NAME=O\n-1, 0, 0, -1, 0, 2\n1, 45\n",
     CylindricalAxes((-1, 0, 0), (0, 0, 1), 1, 45.0))])
def test_orientations_of_decks(tmp_path, lines, axes):
    text = deck("ENGINEERING CONSTANTS", lines, ", ORIENTATION=o")
    assert read(tmp_path, text).materials["ALL"].axes == axes
    if isinstance(axes, CylindricalAxes):
        assert read(tmp_path, text, scale=1e-3).materials["ALL"].axes.point == (-1e-3, 0.0, 0.0)


@pytest.mark.parametrize("kind", CONSTANTS)
def test_frequencies_against_calculix(tmp_path, kind):
    """ccx 2.20 with *FREQUENCY for this deck, fixed at the left, by another quadrature of mass."""
    mesh = block_mesh((6, 3, 2), (0.1, 0.04, 0.03), tetrahedra=True)
    text = deck(kind, "*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR\n1, 2, 0.5, -1, 1, 0.7\n",
                ", ORIENTATION=O", mesh)
    body = ElasticBody(read(tmp_path, text), fixed={"A_left": "xyz"})
    assert eigenfrequencies_hz(body, 4) == pytest.approx(
        (1157.650, 1544.523, 4042.065, 5385.604), rel=2e-4)


def distribution(mesh, first=", 1, 0, 0, 0, 1, 0\n", turn=""):
    """Every other cell has axes of its own."""
    rows = "".join(f"{k}, 1., 2., .5, -1., 1., .7\n" for k in range(1, len(mesh.cells) + 1, 2))
    return (f"*DISTRIBUTION, NAME=D, LOCATION=ELEMENT, TABLE=T\n{first}{rows}"
            f"*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR\nD\n{turn}")


def test_frequencies_of_a_distribution_against_calculix(tmp_path):
    """ccx 2.20 with *FREQUENCY for this deck, fixed at the left."""
    mesh = block_mesh((6, 3, 2), (0.1, 0.04, 0.03), tetrahedra=True)
    text = deck("ORTHO", distribution(mesh), ", ORIENTATION=O", mesh)
    body = ElasticBody(read(tmp_path, text), fixed={"A_left": "xyz"})
    assert eigenfrequencies_hz(body, 4) == pytest.approx(
        (1855.988, 3014.366, 4007.273, 7072.389), rel=2e-4)


def test_distributions_of_sets_of_a_turned_instance_in_millimetres(tmp_path):
    """Each cell finds its directions, which turn with the instance and about axis 3."""
    own = deck("ORTHO", distribution(BLOCK, turn="3, 90.\n"), ", ORIENTATION=O")
    own, at, rest = own.partition("*MATERIAL")
    text = (f"*PART, NAME=P\n{own}*END PART\n*ASSEMBLY, NAME=X\n*INSTANCE, NAME=I, PART=P\n"
            f"0, 0, 1\n0, 0, 0, 0, 0, 1, 90\n*END INSTANCE\n*END ASSEMBLY\n{at}{rest}")
    mesh = read(tmp_path, text, scale=1e-3)
    axes = mesh.materials["ALL"].axes.at(ElasticBody(mesh).cell_centres(np.arange(len(mesh.cells))))
    # Of the other cells: x, turned to y by the instance, and about z to -x.
    assert axes[1::2, 0] == pytest.approx(np.tile([-1.0, 0.0, 0.0], (len(axes) // 2, 1)), abs=1e-9)
    third = np.cross([1.0, 2.0, 0.5], [-1.0, 1.0, 0.7])
    x, y, z = third / np.linalg.norm(third)
    assert axes[::2, 2] == pytest.approx(np.tile([-y, x, z], (len(axes) // 2, 1)), abs=1e-9)
    by_set = distribution(BLOCK, first="").split("1, 1., 2.", 1)[0] + (
        "ALL, 0, 1, 0, 0, 0, 1\n*ORIENTATION, NAME=O\nD\n")
    found = read(tmp_path, deck("ORTHO", by_set, ", ORIENTATION=O")).materials["ALL"].axes
    assert found.at(np.zeros((1, 3)))[0] == pytest.approx(np.eye(3)[[1, 2, 0]])


@pytest.mark.parametrize(("first", "message"), [
    ("", r"distribution 'D' has no directions for 36 elements of 'ALL'; add a first line"),
    (", 1, 0, 0, 0, 1\n", r"distribution 'D' has the line ', 1, 0, 0, 0, 1'; it must be an elem"),
    ("NONE, 1, 0, 0, 0, 1, 0\n", r"refers to a set 'NONE' that it does not hold"),
    (", 1, 0, 0, 2, 0, 0\n", r"FieldAxes: along = .* span no plane"),
])
def test_bad_distributions_are_refused(tmp_path, first, message):
    with pytest.raises((MeshError, InputError), match=message) as caught:
        read(tmp_path, deck("ORTHO", distribution(BLOCK, first), ", ORIENTATION=O"))
    assert str(caught.value).startswith(str(tmp_path / "a.inp"))


def test_orientation_of_a_turned_instance(tmp_path):
    own = deck("ORTHO", "*ORIENTATION, NAME=O\n1, 0, 0, 0, 1, 0\n", ", ORIENTATION=O")
    own, at, rest = own.partition("*MATERIAL")
    text = (f"*PART, NAME=P\n{own}*END PART\n*ASSEMBLY, NAME=X\n*INSTANCE, NAME=I, PART=P\n"
            f"0, 0, 1\n0, 0, 0, 0, 0, 1, 90\n*END INSTANCE\n*END ASSEMBLY\n{at}{rest}")
    axes = read(tmp_path, text).materials["ALL"].axes
    assert axes.first == pytest.approx((0.0, 1.0, 0.0), abs=1e-15)
    assert axes.second == pytest.approx((-1.0, 0.0, 0.0), abs=1e-15)


@pytest.mark.parametrize(("lines", "message"), [
    ("*ORIENTATION, NAME=O, SYSTEM=SPHERICAL\n0, 0, 0, 0, 0, 1\n",
     r"the orientation 'O' is given by SYSTEM=SPHERICAL, which is not read"),
    ("*ORIENTATION, NAME=O, DEFINITION=NODES\n1, 2, 3\n", r"given by DEFINITION=NODES"),
    ("*ORIENTATION, NAME=O\nFIELD\n3, 0\n",
     r"has the data .*, which are not two points, nor a \*DISTRIBUTION of directions"),
])
def test_orientations_that_are_not_read_are_warned_of(tmp_path, lines, message):
    with pytest.warns(ModelWarning, match=rf"{message}.*give material to the body\.$"):
        assert read(tmp_path, deck("ORTHO", lines, ", ORIENTATION=O")).materials == {}


@pytest.mark.parametrize(("change", "message"), [
    (("O\n1", "P\n1"), r"The section of 'ALL' names the orientation 'O', which the file .*'P'"),
    (("0, 1, 0\n", "2, 0, 0\n"), r"The points of the orientation 'O' give no axes: .* span no pla"),
    (("0.3, 0.25", "3.9, 0.25"), r"nu_12 = 3\.9 must lie between"),
])
def test_bad_orientations_and_constants_of_decks_are_refused(tmp_path, change, message):
    text = deck("ENGINEERING CONSTANTS", "*ORIENTATION, NAME=O\n1, 0, 0, 0, 1, 0\n",
                ", ORIENTATION=O")
    with pytest.raises((MeshError, InputError), match=message) as caught:
        read(tmp_path, text.replace(*change))
    assert str(caught.value).startswith(str(tmp_path / "a.inp"))


def test_unknown_orientations_of_isotropic_materials_are_refused(tmp_path):
    text = deck("ORTHO", "", ", ORIENTATION=O").replace(
        f"TYPE=ORTHO\n{CONSTANTS['ORTHO']}", "TYPE=ISO\n7e10, 0.33\n")
    with pytest.raises(MeshError, match=r"The section of 'ALL' names the orientation 'O', which"):
        read(tmp_path, text)


def test_cylindrical_axes_are_radial_circumferential_and_along_the_line():
    axes = CylindricalAxes(point=(1.0, 0.0, 0.0))
    found = axes.at(np.array([[3.0, 0.0, 5.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.0]]))
    assert found[0] == pytest.approx(np.eye(3))
    assert found[1] == pytest.approx(np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    assert found[2] == pytest.approx(np.diag([-1.0, -1.0, 1.0]))
    # Turned about the radius, axis 2 climbs along the line as a right-handed screw.
    climbing = CylindricalAxes(about=1, angle=30.0).at(np.array([[2.0, 0.0, 0.0]]))[0]
    assert climbing[1] == pytest.approx([0.0, np.sqrt(0.75), 0.5])
    assert climbing[2] == pytest.approx([0.0, -0.5, np.sqrt(0.75)])
