"""Eigenfrequencies and modes of finite-element bodies against closed forms and published values."""

from dataclasses import replace

import numpy as np
import pytest
from meshes_for_tests import clamped_beam, grid, rectangle, skewed, tapered_membrane

import fecontact.reduction.eigenmodes as eigen
from fecontact import ElasticBody, InputError, Material, Mesh, MeshError
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.eigenmodes import backward_error, eigenmodes, rigid_modes

STEEL = Material(2.1e11, 0.3, 7850.0)


def euler_bernoulli_hz(roots, length, height, material=STEEL):
    """Bending frequencies of a beam of rectangular section with the given roots beta L."""
    stiffness = material.youngs_modulus / (12.0 * material.density)
    return np.asarray(roots) ** 2 / (2.0 * np.pi * length**2) * height * np.sqrt(stiffness)


FREE_FREE = np.array([4.7300407448627, 7.85320462409584, 10.9956078380017])
CLAMPED_FREE = np.array([1.87510406871196, 4.69409113297417, 7.85475743823761])


# Beams -------------------------------------------------------------------------------------------

def test_free_beam_of_quadrilaterals():
    body = ElasticBody(rectangle(1.0, 0.01, 300, 4), STEEL)
    f = eigenfrequencies_hz(body, 6)
    assert (f[:3] == 0.0).all()
    # 300 x 4 Q2 cells are 1.0e-6 high in the third mode.
    assert f[3:] == pytest.approx([53.14689, 146.40358, 286.72805], rel=2e-6)


def test_free_beam_of_triangles():
    body = ElasticBody(rectangle(1.0, 0.01, 300, 4, triangles=True), STEEL)
    # 300 x 4 x 2 P2 cells are 3.2e-6 high in the third mode.
    assert eigenfrequencies_hz(body, 6)[3:] == pytest.approx(
        [53.14689, 146.40358, 286.72805], rel=5e-6)


def test_clamped_beam_graded_into_the_corners():
    body = ElasticBody(clamped_beam(1.0, 0.01, 200, 7), STEEL, fixed={"left": "xy"})
    f = eigenfrequencies_hz(body, 3)
    # 200 columns, halved seven times, are 0.4e-6, 1.0e-6 and 2.1e-6 high.
    assert f == pytest.approx([8.355411, 52.33805, 146.43822], rel=3e-6)


def test_clamped_beam_on_a_uniform_mesh_is_high():
    body = ElasticBody(rectangle(1.0, 0.01, 200, 4), STEEL, fixed={"left": "xy"})
    error = eigenfrequencies_hz(body, 2) / [8.355411, 52.33805] - 1.0
    assert (error > 2e-5).all()
    assert (error < 2e-4).all()


@pytest.mark.parametrize("times", [6, 10, 14])
def test_round_off_on_strongly_graded_meshes(times):
    # Cells of aspect 1e5 swamp K: sums over K lose the first frequency by 1e-4 to 1e-3.
    body = ElasticBody(clamped_beam(1.0, 0.01, 50, times), STEEL, fixed={"left": "xy"})
    error = eigenfrequencies_hz(body, 2) / [8.355411, 52.33805] - 1.0
    assert error == pytest.approx([1.3e-5, 8.35e-5], abs=1.5e-6)


@pytest.mark.parametrize(("roots", "fixed", "first"), [
    (FREE_FREE, {}, 3), (CLAMPED_FREE, {"left": "xy"}, 0),
    ([3.92660231204792, 7.06858274562873], {"left": "xy", "pin": "y"}, 0),
    ([3.92660231204792, 7.06858274562873], {"hinge": "xy"}, 1),
    ([3.92660231204792, 7.06858274562873], {"left": "hinge"}, 1),
    ([np.pi, 2.0 * np.pi], {"left": "hinge", "right": "hinge"}, 0),
])
def test_slender_beams_agree_with_euler_bernoulli(roots, fixed, first):
    # Supports at single nodes act on the beam as such; nu = 0 frees the root of lateral strain.
    material = Material(2.1e11, 0.0, 7850.0)
    errors = []
    for columns, height in ((40, 0.02), (80, 0.01)):
        mesh = rectangle(1.0, height, columns, 2,
                         points={"pin": (1.0, height / 2), "hinge": (0.0, height / 2)})
        body = ElasticBody(mesh, material, fixed=fixed)
        f = eigenfrequencies_hz(body, first + len(roots))[first:]
        errors.append(f / euler_bernoulli_hz(roots, 1.0, height, material) - 1.0)
    # Shear and rotary inertia lower frequencies by a number times (height beta)^2.
    size = (np.asarray(roots) * 0.01) ** 2
    assert (np.abs(errors[1]) < 0.45 * size).all()
    assert (errors[0] < 0.0).all()
    assert errors[0] / errors[1] == pytest.approx(np.full(len(roots), 4.0), rel=0.1)


def test_longitudinal_modes_of_a_bar():
    material = Material(7.0e10, 0.0, 2700.0)
    body = ElasticBody(rectangle(2.0, 0.01, 40, 1), material, fixed={"bottom": "y", "top": "y"})
    expected = np.arange(4) / (2.0 * 2.0) * np.sqrt(7.0e10 / 2700.0)
    assert eigenfrequencies_hz(body, 4) == pytest.approx(expected, rel=3e-6)


@pytest.mark.parametrize("mesh", [(20, 10, 10, False), (24, 12, 10, True)])
def test_nafems_fv32(mesh):
    body = ElasticBody(tapered_membrane(*mesh), Material(200e9, 0.3, 8000.0), 0.05,
                       fixed={"left": "xy"})
    f = eigenfrequencies_hz(body, 6)
    assert f == pytest.approx([44.623, 130.03, 162.70, 246.05, 379.90, 391.44], rel=1e-3)
    converged = np.array([44.6170, 130.0094, 162.6887, 245.9858, 379.7170, 391.4042])
    assert f == pytest.approx(converged, rel=2e-4)
    assert (f > converged * (1.0 - 1e-6)).all()


# Constants and rates -----------------------------------------------------------------------------

def sliding_rectangle_hz(a, b, material, plane, count):
    """Exact frequencies of a rectangle whose sides slide without friction on rigid walls."""
    E, nu, rho = material.youngs_modulus, material.poisson_ratio, material.density
    pressure = E / (1 - nu**2) if plane == "stress" else E * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    shear = E / (2 * (1 + nu))
    i, j = np.meshgrid(np.arange(12), np.arange(12))
    k = np.hypot(i * np.pi / a, j * np.pi / b)
    waves = np.concatenate([np.sqrt(pressure / rho) * k[i + j > 0],
                            np.sqrt(shear / rho) * k[(i > 0) & (j > 0)]])
    return np.sort(waves)[:count] / (2.0 * np.pi)


SLIDING = {"left": "x", "right": "x", "bottom": "y", "top": "y"}


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_sliding_rectangle_is_exact(plane, triangles):
    body = ElasticBody(rectangle(1.0, 0.7, 20, 14, triangles=triangles), STEEL, 0.3, plane,
                       fixed=SLIDING)
    assert eigenfrequencies_hz(body, 6) == pytest.approx(
        sliding_rectangle_hz(1.0, 0.7, STEEL, plane, 6), rel=4e-5 if not triangles else 1e-4)


@pytest.mark.parametrize(("triangles", "degree", "low", "high"), [
    (False, 1, 1.95, 2.05), (True, 1, 1.9, 2.1), (False, 2, 3.9, 4.1), (True, 2, 3.85, 4.15)])
def test_convergence_rate_of_frequencies(triangles, degree, low, high):
    exact = sliding_rectangle_hz(1.0, 0.7, STEEL, "stress", 4)
    cells = (8, 16) if degree == 2 else (20, 40)
    errors = []
    for n in cells:
        mesh = rectangle(1.0, 0.7, n, n, triangles=triangles)
        body = ElasticBody(mesh, STEEL, degree=degree, fixed=SLIDING)
        errors.append(eigenfrequencies_hz(body, 4) / exact - 1.0)
    rates = np.log2(errors[0] / errors[1])
    assert (errors[1] > 0.0).all()
    assert (rates > low).all(), rates
    assert (rates < high).all(), rates


@pytest.mark.parametrize("triangles", [False, True])
def test_convergence_rate_of_a_free_plate(triangles):
    # No closed form: the limit follows from the two finest meshes and the order 4.
    plates = [rectangle(1.0, 0.7, n, n, triangles=triangles) for n in (12, 24, 32, 40)]
    f = [eigenfrequencies_hz(ElasticBody(plate, STEEL), 6)[3:] for plate in plates]
    limit = f[3] + (f[3] - f[2]) / (1.25**4 - 1.0)
    rates = np.log2((f[0] - limit) / (f[1] - limit))
    assert (rates > 3.8).all(), rates
    assert (rates < 4.2).all(), rates


def test_plane_strain_is_plane_stress_of_other_constants():
    E, nu = 2.1e11, 0.3
    mesh = rectangle(0.5, 0.2, 10, 4)
    strain = ElasticBody(mesh, Material(E, nu, 7850.0), plane="strain", fixed={"left": "xy"})
    stress = ElasticBody(mesh, Material(E / (1 - nu**2), nu / (1 - nu), 7850.0), plane="stress",
                         fixed={"left": "xy"})
    assert eigenfrequencies_hz(strain, 8) == pytest.approx(
        eigenfrequencies_hz(stress, 8), rel=1e-11)


def test_frequencies_do_not_depend_on_thickness_and_scale_with_size():
    thin = eigenfrequencies_hz(ElasticBody(rectangle(1.0, 0.3, 8, 3), STEEL, 0.001), 6)
    thick = eigenfrequencies_hz(ElasticBody(rectangle(1.0, 0.3, 8, 3), STEEL, 40.0), 6)
    small = eigenfrequencies_hz(ElasticBody(rectangle(1e-3, 0.3e-3, 8, 3), STEEL), 6)
    assert thick == pytest.approx(thin, rel=1e-10)
    assert small == pytest.approx(1e3 * thin, rel=1e-10)


def test_frequencies_do_not_depend_on_place_and_direction():
    def turned(nodes):
        return nodes @ np.array([[0.6, 0.8], [-0.8, 0.6]]) + [5.0, -3.0]

    straight = eigenfrequencies_hz(ElasticBody(rectangle(1.0, 0.3, 8, 3), STEEL), 6)
    moved = eigenfrequencies_hz(ElasticBody(rectangle(1.0, 0.3, 8, 3, warp=turned), STEEL), 6)
    assert (moved[:3] == 0.0).all()
    assert moved[3:] == pytest.approx(straight[3:], rel=1e-10)


def test_clockwise_cells_are_turned_round():
    mesh = rectangle(1.0, 0.3, 8, 3)
    turned = Mesh(mesh.nodes, mesh.cells[:, ::-1], mesh.boundaries)
    assert eigenfrequencies_hz(ElasticBody(turned, STEEL), 6) == pytest.approx(
        eigenfrequencies_hz(ElasticBody(mesh, STEEL), 6), rel=1e-12)


def test_total_mass():
    body = ElasticBody(rectangle(1.0, 0.7, 5, 5, triangles=True, warp=skewed), STEEL, 0.02)
    along = np.zeros(2 * len(body.nodes))
    along[1::2] = 1.0
    assert along @ body.mass @ along == pytest.approx(7850.0 * 0.02 * body.mesh.area, rel=1e-12)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_patch_test(triangles, degree, plane):
    """A linear displacement field leaves no force inside, and its energy is that of the stress."""
    body = ElasticBody(rectangle(1.0, 0.7, 4, 3, triangles=triangles, warp=skewed), STEEL, 0.02,
                       plane, degree)
    a, b, c, d = 1e-3, -4e-4, 7e-4, 2e-3
    x, y = body.nodes.T
    u = np.column_stack([a * x + b * y, c * x + d * y]).ravel()
    force = body.stiffness @ u
    edge = np.unique(body.edge_nodes(body.mesh.outline))
    inside = np.setdiff1d(np.arange(len(x)), edge)
    assert np.abs(force.reshape(-1, 2)[inside]).max() < 1e-12 * np.abs(force).max()
    E, nu = 2.1e11, 0.3
    strain = np.array([a, d, 0.0])
    if plane == "stress":
        strain[2] = -nu / (1.0 - nu) * (a + d)
    shear = E / (2.0 * (1.0 + nu))
    stress = 2.0 * shear * strain + E * nu / ((1 + nu) * (1 - 2 * nu)) * strain.sum()
    density = 0.5 * (stress @ strain + shear * (b + c) ** 2)
    assert 0.5 * u @ force == pytest.approx(density * 0.02 * body.mesh.area, rel=1e-12)
    if plane == "stress":
        assert stress[2] == pytest.approx(0.0, abs=1e-12 * abs(stress[0]))


# Rigid modes -------------------------------------------------------------------------------------

# A rectangle 2 x 1 with points a (0, 0), b (2, 1), c (0.5, 1), d (2, 0). The rigid motions left:
# x and y: translations; (px, py): rotation about that place.
SUPPORTS = [
    ({}, ["x", "y", (1.0, 0.5)]),
    ({"a": "x"}, ["y", (1.0, 0.0)]),
    ({"b": "y"}, ["x", (2.0, 0.5)]),
    ({"a": "xy"}, [(0.0, 0.0)]),
    ({"a": "x", "b": "y"}, [(2.0, 0.0)]),
    ({"a": "y", "b": "x"}, [(0.0, 1.0)]),
    ({"a": "x", "d": "x"}, ["y", (1.0, 0.0)]),
    ({"a": "y", "d": "y"}, ["x"]),
    ({"a": "x", "b": "x"}, ["y"]),
    ({"a": "y", "b": "y"}, ["x"]),
    ({"a": "xy", "d": "x"}, [(0.0, 0.0)]),
    ({"a": "xy", "d": "y"}, []),
    ({"a": "y", "d": "y", "c": "x"}, []),
    ({"left": "x"}, ["y"]),
    ({"left": "y"}, ["x", (0.0, 0.5)]),
    ({"bottom": "x"}, ["y", (1.0, 0.0)]),
    ({"bottom": "y"}, ["x"]),
    ({"left": "xy"}, []),
    ({"left": "hinge"}, [(0.0, 0.5)]),
    ({"left": "hinge", "d": "y"}, []),
    ({"left": "hinge", "right": "hinge"}, []),
    ({"b": "hinge"}, [(2.0, 1.0)]),
    ({"left": "x", "bottom": "y"}, []),
]


@pytest.mark.parametrize("warped", [False, True], ids=["plain", "far away"])
@pytest.mark.parametrize(("fixed", "motions"), SUPPORTS, ids=str)
def test_rigid_modes_that_supports_leave(fixed, motions, warped):
    shift = np.array([300.0, -50.0]) * warped
    mesh = rectangle(2.0, 1.0, 4, 2, triangles=warped, warp=lambda nodes: nodes + shift,
                     points={"a": (0, 0), "b": (2, 1), "c": (0.5, 1), "d": (2, 0)})
    body = ElasticBody(mesh, STEEL, 0.1, fixed=fixed)
    w, shapes = eigenmodes(body, 5)
    assert np.count_nonzero(w == 0.0) == len(motions)
    assert (w[: len(motions)] == 0.0).all()
    # The lowest elastic frequency of any of these bodies is some 100 rad/s or above.
    assert w[len(motions)] > 100.0
    assert (np.diff(w) >= 0.0).all()
    x, y = (body.nodes - shift).T
    for shape, motion in zip(shapes.T, motions, strict=False):
        if isinstance(motion, tuple):
            expected = np.column_stack([motion[1] - y, x - motion[0]])
        else:
            expected = np.tile([float(motion == "x"), float(motion == "y")], (len(x), 1))
        expected = expected.ravel() / np.sqrt(expected.ravel() @ (body.mass @ expected.ravel()))
        assert shape == pytest.approx(expected, abs=1e-12 * (1.0 + 99.0 * warped)
                                      * np.abs(expected).max())
    assert np.abs(shapes[body.fixed_dofs]).max(initial=0.0) == 0.0


def test_rigid_modes_carry_no_force():
    body = ElasticBody(rectangle(1.0, 0.3, 8, 3, warp=skewed), STEEL)
    force = body.stiffness @ rigid_modes(body)
    assert np.abs(force).max() < 1e-13 * abs(body.stiffness).max() * np.abs(
        rigid_modes(body)).max()


def test_fewer_modes_than_rigid_ones():
    body = ElasticBody(rectangle(1.0, 0.3, 4, 2), STEEL)
    w, shapes = eigenmodes(body, 2)
    assert w.tolist() == [0.0, 0.0]
    assert shapes.shape == (2 * len(body.nodes), 2)


# The solver --------------------------------------------------------------------------------------

BODIES = {
    "dense": (rectangle(1.0, 0.3, 8, 3), {}),
    "free": (rectangle(1.0, 0.05, 40, 3), {}),
    "held": (rectangle(1.0, 0.05, 40, 3, triangles=True), {"left": "xy"}),
    "hinged": (rectangle(1.0, 0.05, 40, 3, points={"hinge": (0, 0.025)}), {"hinge": "xy"}),
    "square with double modes": (rectangle(1.0, 1.0, 12, 12), {}),
    "distorted": (rectangle(1.0, 0.7, 12, 8, warp=skewed), {"bottom": "y"}),
    "small in mm": (rectangle(3e-3, 1e-3, 24, 8), {}),
}


@pytest.mark.parametrize("name", BODIES)
def test_modes_are_orthonormal_and_accurate(name):
    mesh, fixed = BODIES[name]
    body = ElasticBody(mesh, STEEL, fixed=fixed)
    w, shapes = eigenmodes(body, 20)
    assert np.abs(shapes.T @ (body.mass @ shapes) - np.eye(20)).max() < 1e-10
    free = body.expansion.indices
    K, M = body.stiffness[free][:, free], body.mass[free][:, free]
    assert backward_error(K, M, w**2, shapes[free]).max() < 1e-12
    assert np.abs(shapes[body.fixed_dofs]).max(initial=0.0) == 0.0
    stiffness = shapes.T @ (body.stiffness @ shapes)
    assert np.abs(stiffness - np.diag(w**2)).max() < 1e-9 * w[-1] ** 2
    # The first of the largest components (within one per cent) is positive.
    elastic = shapes[:, w > 0.0]
    first = np.argmax(np.abs(elastic) >= 0.99 * np.abs(elastic).max(axis=0), axis=0)
    assert (elastic[first, np.arange(elastic.shape[1])] > 0.0).all()


@pytest.mark.parametrize("name", ["free", "held", "hinged", "distorted"])
def test_dense_and_lanczos_agree(name, monkeypatch):
    mesh, fixed = BODIES[name]
    body = ElasticBody(mesh, STEEL, fixed=fixed)
    monkeypatch.setattr(eigen, "_DENSE", 10**6)
    w, shapes = eigenmodes(body, 12)
    monkeypatch.setattr(eigen, "_DENSE", 0)
    w2, shapes2 = eigenmodes(body, 12)
    assert w2 == pytest.approx(w, rel=1e-10)
    assert np.abs(shapes2 - shapes).max() < 1e-6 * np.abs(shapes).max()


def test_all_modes_of_a_small_body_hold_its_mass_and_stiffness():
    body = ElasticBody(rectangle(1.0, 0.3, 2, 1), STEEL)
    count = 2 * len(body.nodes)
    w, shapes = eigenmodes(body, count)
    assert np.count_nonzero(w == 0.0) == 3
    inverse = shapes @ shapes.T
    assert np.abs(inverse @ body.mass.toarray() - np.eye(count)).max() < 1e-9


def test_modes_are_the_same_every_time():
    mesh, fixed = BODIES["free"]
    first, second = (eigenmodes(ElasticBody(mesh, STEEL, fixed=fixed), 8) for _ in range(2))
    assert (first[0] == second[0]).all()
    assert (first[1] == second[1]).all()


# Errors ------------------------------------------------------------------------------------------

def test_number_of_modes_is_checked():
    body = ElasticBody(rectangle(1.0, 0.3, 2, 1), STEEL, fixed={"left": "xy"})
    for count in (0, -1, 25):
        with pytest.raises(InputError, match=r"24"):
            eigenmodes(body, count)


@pytest.mark.parametrize(("options", "message"), [
    ({"thickness": 0.0}, "thickness = 0.0"),
    ({"thickness": float("nan")}, "thickness = nan"),
    ({"plane": "shell"}, "plane = 'shell'"),
    ({"degree": 3}, "degree = 3"),
    ({"fixed": {"left": "yx"}}, "'yx'"),
])
def test_body_is_checked(options, message):
    with pytest.raises(InputError, match=message):
        ElasticBody(rectangle(1.0, 0.3, 2, 1), STEEL, **options)


def test_unknown_support_names_the_nearest():
    with pytest.raises(MeshError, match=r"'lef'.*did you mean 'left'.*'bottom'"):
        ElasticBody(rectangle(1.0, 0.3, 2, 1), STEEL, fixed={"lef": "xy"})


def test_body_in_two_pieces():
    one = rectangle(1.0, 0.3, 2, 1)
    two = Mesh(np.concatenate([one.nodes, one.nodes + np.array([2.0, 0.0])]),
               np.concatenate([one.cells, one.cells + len(one.nodes)]))
    with pytest.raises(MeshError, match="2 pieces"):
        ElasticBody(two, STEEL)


@pytest.mark.parametrize(("values", "message"), [
    ((0.0, 0.3, 1.0), "youngs_modulus = 0.0"), ((1.0, 0.5, 1.0), "poisson_ratio = 0.5"),
    ((1.0, -1.0, 1.0), "poisson_ratio = -1.0"), ((1.0, 0.3, -1.0), "density = -1.0"),
    ((1.0, float("nan"), 1.0), "poisson_ratio = nan"),
])
def test_material_is_checked(values, message):
    with pytest.raises(InputError, match=message):
        Material(*values)


def test_named_materials():
    named = Material.named("steel")
    assert replace(named, thermal_expansion=0.0) == STEEL
    assert named.thermal_expansion == pytest.approx(1.2e-5)
    with pytest.raises(InputError, match=r"'steal'.*did you mean 'steel'.*'aluminium'"):
        Material.named("steal")


def test_first_order_grid_has_lines_where_they_were_given():
    body = ElasticBody(grid([0.0, 0.1, 1.0], [0.0, 0.4]), STEEL)
    assert sorted(set(np.round(body.nodes[:, 0], 12))) == [0.0, 0.05, 0.1, 0.55, 1.0]
