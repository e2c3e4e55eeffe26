"""Supports, masses, springs and loads at reference points, against closed forms."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from solid_blocks import block_mesh

from fecontact import (
    ElasticBody,
    InputError,
    Load,
    Material,
    Mesh,
    MeshError,
    PointLoad,
    modal_basis,
    static_solution,
)
from fecontact.fem import Coupling, LinearEquation, PointMass, PointSpring, Rotation, Term
from fecontact.reduction import eigenfrequencies_hz
from fecontact.reduction.damping import material_damping_ratios
from fecontact.reduction.eigenmodes import eigenmodes
from fecontact.system.loads import load_rows

# A bar of length L and square cross-section A x A, whose right end is rigid with the point "hub".
L, A = 0.4, 0.02
BAR = Material(2.0e11, 0.3, 7800.0, loss_factor=0.01)
END = (L, A / 2, A / 2)
INERTIA = A**4 / 12
SHEAR = 1.0 / (5.0 / 6.0 * (2.0e11 / 2.6) * A**2)
UNITS = np.eye(6)
PLATE = rectangle(0.1, 0.1, 2, 2)


def bar(*attachments, fixed=None, place=END, kind="kinematic", cells=(12, 2, 2)):
    mesh = block_mesh(cells, (L, A, A))
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries,
                constraints=[Coupling("right", "hub", place, kind)])
    return ElasticBody(mesh, BAR, fixed={"left": "xyz"} if fixed is None else fixed,
                       attachments=attachments)


def spring(component, stiffness, damping=0.0, at="hub"):
    unit = UNITS[component]
    return PointSpring([Term(at, unit[:3], unit[3:])], stiffness, damping)


@pytest.mark.parametrize("kind", ["kinematic", "distributing"])
def test_rows_of_a_reference_point_are_its_motion(kind):
    """Rigid motions are exact, also with the work of forces and moments there."""
    body = bar(fixed={}, place=(L + 0.1, 0.03, -0.01), kind=kind)
    rows = body.motion_rows("hub")
    rng = np.random.default_rng(1)
    shift, turn = rng.standard_normal((2, 3))
    moved = (shift + np.cross(turn, body.nodes)).ravel()
    assert rows @ moved == pytest.approx(np.concatenate(
        [shift + np.cross(turn, (L + 0.1, 0.03, -0.01)), turn]), rel=1e-10)


def test_a_moment_at_a_reference_point_bends_and_twists_a_bar():
    """phi = M L / (E I), u = M L^2 / (2 E I) + F (L^3 / 3 E I + shear); torsion constant .1406."""
    found = static_solution(bar(), Load(forces=(
        PointLoad("hub", "phi_z", signal=5.0), PointLoad("hub", "y", signal=30.0),
        PointLoad("hub", "phi_x", signal=3.0))))
    body = bar()
    moved = body.motion_rows("hub") @ found.displacement.ravel()
    EI, GJ = 2.0e11 * INERTIA, 2.0e11 / 2.6 * 0.1406 * A**4
    assert moved[1] == pytest.approx(
        5.0 * L**2 / (2 * EI) + 30.0 * (L**3 / (3 * EI) + SHEAR * L), rel=1e-2)
    assert moved[5] == pytest.approx(5.0 * L / EI + 30.0 * L**2 / (2 * EI), rel=1e-2)
    assert moved[3] == pytest.approx(3.0 * L / GJ, rel=5e-2)


def test_a_heavy_mass_and_inertia_at_the_end_of_a_bar():
    """Two coordinates, u and phi, with the inverse of [[L^3/3, L^2/2], [L^2/2, L]] / (E I)."""
    m, J = 40.0, 0.8
    flexibility = np.array([[L**3 / 3, L**2 / 2], [L**2 / 2, L]]) / (2.0e11 * INERTIA)
    flexibility[0, 0] += SHEAR * L
    expected = 1.0 / np.sqrt(np.linalg.eigvals(flexibility @ np.diag([m, J])).real) / (2 * np.pi)
    body = bar(PointMass("hub", m, (J, J, J)))
    found = eigenfrequencies_hz(body, 6)
    assert found[:2] == pytest.approx([expected.min()] * 2, rel=1e-2)
    assert np.abs(found / expected.max() - 1.0).min() < 1e-2
    assert body.total_mass == pytest.approx(m + 7800.0 * L * A**2)
    assert dict(body.summary())["attachments"] == "1 point mass"


@pytest.mark.parametrize("turn", [None, ((0.1, 0.2, 0.3), (20.0, -40.0, 70.0), "x")])
def test_a_point_mass_is_a_rigid_block_of_its_mass_and_inertia(turn):
    """A dense piece of the mesh, all of whose nodes follow the reference point, mirrored too."""
    size, density = (0.05, 0.03, 0.02), 3.0e4
    own, block = block_mesh((6, 2, 2), (L, A, A)), block_mesh((2, 1, 1), size).placed(
        (0.42, 0.01, -0.03))
    count = len(own.nodes)
    names = {name: facets for name, facets in own.boundaries.items() if name in ("left", "right")}
    couplings = [Coupling("right", "hub", (0.41, 0.02, 0.03))]
    both = Mesh(np.concatenate([own.nodes, block.nodes]),
                np.concatenate([own.cells, block.cells + count]), names,
                {"block": np.arange(count, count + len(block.nodes))}, cell_groups={
                    "own": np.arange(len(own.cells)),
                    "block": np.arange(len(own.cells), len(own.cells) + len(block.cells))},
                constraints=[*couplings, Coupling("block", "hub")])
    centre, m = np.array((0.42, 0.01, -0.03)) + 0.5 * np.array(size), density * np.prod(size)
    J = m / 12.0 * (np.sum(np.square(size)) * np.eye(3) - np.diag(np.square(size)))
    arm = centre - (0.41, 0.02, 0.03)
    J += m * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    # A mass at its own centre, rigid with the point; and what is left of the inertia at the point.
    mass = Mesh(own.nodes, own.cells, names, constraints=[
        Coupling("right", "mass", tuple(centre))], attachments=[
            PointMass("mass", m, (*np.diag(J - m * (arm @ arm * np.eye(3) - np.outer(arm, arm))),
                                  0.0, 0.0, 0.0))])
    if turn is not None:
        both, mass = both.placed(*turn), mass.placed(*turn)
    materials = {"own": BAR, "block": Material(1e13, 0.0, density)}
    whole = ElasticBody(both, materials, fixed={"left": "xyz"}, degree=1)
    found = eigenfrequencies_hz(ElasticBody(mass, BAR, fixed={"left": "xyz"}, degree=1), 6)
    assert found == pytest.approx(eigenfrequencies_hz(whole, 6), rel=1e-8)


def test_springs_at_a_free_body_are_its_rigid_modes():
    """Soft springs in three directions at the centre of mass; its rotations stay free."""
    mesh = block_mesh((4, 2, 2), (L, A, A))
    body = ElasticBody(Mesh(mesh.nodes, mesh.cells, mesh.boundaries, constraints=[
        Coupling("top", "hub", (L / 2, A / 2, A / 2), "distributing")]), BAR,
        attachments=[spring(axis, (axis + 1) * 1e3) for axis in range(3)])
    found = eigenfrequencies_hz(body, 8)
    assert (found[:3] == 0.0).all()
    expected = np.sqrt(np.array([1e3, 2e3, 3e3]) / (7800.0 * L * A**2)) / (2 * np.pi)
    assert found[3:6] == pytest.approx(expected, rel=1e-3)


def test_stiff_springs_are_supports():
    """All six components: by supports of the point, by springs, and as the clamped face."""
    clamped = eigenfrequencies_hz(bar(fixed={"hub": "clamped"}), 4)
    springs = bar(*(spring(component, 1e13) for component in range(6)), fixed={})
    assert eigenfrequencies_hz(springs, 4) == pytest.approx(clamped, rel=1e-5)
    plain = ElasticBody(bar().mesh, BAR, fixed={"right": "xyz"}, constraints=())
    assert eigenfrequencies_hz(plain, 4) == pytest.approx(clamped, rel=1e-9)


@pytest.mark.parametrize(("kind", "free"), [
    ("clamped", 0), ("xyz", 3), ("hinge", 3), ("hinge_z", 1), ("xy", 4), ("x phi_x phi_y", 3),
    ("phi_z", 5)])
def test_rigid_modes_that_supports_of_a_reference_point_leave(kind, free):
    body = bar(fixed={"hub": kind}, place=(L + 0.1, 0.0, 0.03))
    w, shapes = eigenmodes(body, free + 1)
    assert (np.count_nonzero(w == 0.0), w[free] > 10.0) == (free, True)
    motion = body.motion_rows("hub") @ shapes
    names = ("x", "y", "z", "phi_x", "phi_y", "phi_z")
    held = {"clamped": names, "hinge": names[:3], "hinge_z": names[:5]}.get(
        kind, kind.split() if " " in kind or "phi" in kind else list(kind))
    assert motion[[names.index(one) for one in held]] == pytest.approx(0.0, abs=1e-9)


def test_a_spring_joins_two_pieces():
    """Two masses and a spring: w^2 = k (1 / m1 + 1 / m2), with eleven rigid modes left."""
    pieces = [block_mesh((1, 1, 1), (0.1, 0.1, 0.1)), block_mesh((1, 1, 1), (0.1, 0.1, 0.2))]
    mesh = Mesh(np.concatenate([pieces[0].nodes, pieces[1].placed((0.2, 0.0, 0.0)).nodes]),
                np.concatenate([pieces[0].cells, pieces[1].cells + 8]),
                {"one": pieces[0].boundaries["right"], "two": pieces[1].boundaries["left"] + 8})
    with pytest.raises(MeshError, match="consists of 2 pieces that share no node"):
        ElasticBody(mesh)
    k = 1e4
    ends = [Term("one point", (1.0, 0.0, 0.0)), Term("two point", (-1.0, 0.0, 0.0))]
    body = ElasticBody(mesh, BAR, degree=1, constraints=[
        Coupling(name, f"{name} point", (0.15, 0.05, z), "distributing")
        for name, z in (("one", 0.05), ("two", 0.1))],
        attachments=[PointSpring(ends, k)])
    found = eigenfrequencies_hz(body, 12)
    assert (found[:11] == 0.0).all()
    assert found[11] == pytest.approx(np.sqrt(k * (1.0 / 7.8 + 1.0 / 15.6)) / (2 * np.pi), rel=1e-3)


def test_a_basis_has_reference_points():
    """Static deflection and turn there under a force and a moment, and gravity of the mass."""
    body = bar(PointMass("hub", 10.0), spring(1, 2e4, damping=30.0))
    basis = modal_basis(body, 6, contact=(), B="hub", points={"tip": "hub"},
                        reduction="residual", tolerance=0.0, loads=("hub", "gravity"))
    assert basis.positions[0] == pytest.approx(END)
    load = Load(gravity=(0.0, -9.81, 0.0), forces=(PointLoad("tip", "y", signal=20.0),
                                                   PointLoad("tip", "phi_z", signal=-4.0)))
    found = static_solution(body, load, points={"tip": "hub"})
    expected = body.motion_rows("hub") @ found.displacement.ravel()
    constant, forces = load_rows(basis, load)
    q = np.linalg.solve(basis.stiffness_matrix, constant + forces.T @ [20.0, -4.0])
    assert basis.T[basis.point_index("tip")] @ q == pytest.approx(expected, rel=1e-7, abs=1e-12)
    tip = basis.T[0, 1]
    assert basis.damping == pytest.approx(30.0 * np.outer(tip, tip), abs=1e-9)


def test_loss_factors_count_the_energy_of_springs():
    """Half of the energy in a spring of the bar's own stiffness halves its damping ratio."""
    k = 3.0 / (L**3 / (2.0e11 * INERTIA))
    body = bar(PointMass("hub", 100.0), spring(1, k))
    _, shapes = eigenmodes(body, 2)
    ratios = np.sort(material_damping_ratios(body, shapes))
    assert ratios == pytest.approx([0.0025, 0.005], rel=1e-2)


def test_plane_reference_points():
    """A plane frame's end with a mass, an inertia and a turning spring."""
    mesh = rectangle(0.4, 0.02, 20, 2)
    mesh = Mesh(mesh.nodes, mesh.cells, mesh.boundaries, constraints=[
        Coupling("right", "hub", (0.4, 0.01))])
    width = 0.02
    turning = PointSpring([Term("hub", (0, 0), (1.0,))], 5e4)
    body = ElasticBody(mesh, BAR, width, fixed={"left": "xy"},
                       attachments=[PointMass("hub", 40.0, 0.8), turning])
    flexibility = np.array([[L**3 / 3, L**2 / 2], [L**2 / 2, L]]) / (2.0e11 * INERTIA)
    flexibility[0, 0] += SHEAR * L
    K = np.linalg.inv(flexibility) + np.diag([0.0, 5e4])
    expected = np.sqrt(np.linalg.eigvals(np.linalg.solve(np.diag([40.0, 0.8]), K)).real)
    found = eigenfrequencies_hz(body, 4)
    assert found[0] == pytest.approx(expected.min() / (2 * np.pi), rel=1e-2)
    assert np.abs(2 * np.pi * found / expected.max() - 1.0).min() < 1e-2
    held = ElasticBody(mesh, BAR, width, fixed={"hub": "x phi"})
    assert np.count_nonzero(eigenfrequencies_hz(held, 3) == 0.0) == 1


def test_plane_masses_move_and_turn_with_their_point():
    """Twice the energy of unit motions: m of shifts, J + m r^2 of a turn about a place r away."""
    mesh = Mesh(PLATE.nodes, PLATE.cells, PLATE.boundaries,
                constraints=[Coupling("right", "hub", (0.13, 0.05))])
    bare, heavy = (ElasticBody(mesh, attachments=masses)
                   for masses in ((), [PointMass("hub", 3.0, inertia=0.02)]))
    x, y = bare.nodes.T
    for motion, energy in ((np.stack([np.ones_like(x), 0.0 * x], 1), 3.0),
                           (np.stack([0.05 - y, x - 0.13], 1), 0.02),
                           (np.stack([-y, x], 1), 0.02 + 3.0 * (0.13**2 + 0.05**2))):
        moved = motion.ravel()
        assert moved @ (heavy.mass @ moved) - moved @ (bare.mass @ moved) == pytest.approx(
            energy, rel=1e-9)


def test_a_refined_mesh_keeps_its_attachments():
    mesh = block_mesh((2, 1, 1))
    edge = tuple(int(node) for node in mesh.outline[0][:2])
    given = [PointMass(edge, 2.0), PointSpring([Term(edge, (0, 0, 1)), Term(0, (0, 0, -1))], 3.0)]
    finer = Mesh(mesh.nodes, mesh.cells, attachments=given).refined()
    middle = mesh.nodes[list(edge)].mean(axis=0)
    assert finer.nodes[finer.attachments[0].at] == pytest.approx(middle)
    assert finer.attachments[1].terms[0].at == finer.attachments[0].at
    assert dict(finer.summary())["attachments"] == "1 point mass, 1 spring"


@pytest.mark.parametrize(("make", "message"), [
    (lambda: PointMass("hub", -1.0), r"PointMass 'a point mass': mass = -1\.0 must be"),
    (lambda: PointMass("hub", 1.0, (1.0, 2.0)), r"inertia = .* must be one number, of solids thr"),
    (lambda: PointMass("hub", 1.0, (1.0, 1.0, 1.0, 2.0, 0.0, 0.0)), r"must be positive semi-def"),
    (lambda: PointMass(1.5, 1.0), r"PointMass 'a point mass': at must be .*, not float"),
    (lambda: PointSpring([], 1.0), r"PointSpring 'a spring': terms is empty; give at least one"),
    (lambda: PointSpring([Term("hub", (1, 0, 0))], -1.0), r"'a spring': stiffness = -1\.0 must be"),
    (lambda: bar(PointMass("hab", 1.0)), r"'hab' is neither a point of the mesh with one node"),
    (lambda: bar(PointMass(0, 1.0, 1.0)), r"turns with '0', which has no rotation of its own; "),
    (lambda: bar(PointSpring([Term("hub", (1, 0))])), r"each term needs 3 coefficients of the "),
    (lambda: bar(LinearEquation([Term("hub", (1, 0, 0))])), r"attachments must be PointMass or P"),
    (lambda: bar(fixed={"hub": "clamp"}),
     r"fixed\['hub'\] = 'clamp' must be one of 'clamped', .*, or some of 'phi_x', .* with spaces"),
    (lambda: bar(spring(0, 1.0), fixed={"hub": "x"}).springs, r"'a spring' has no effect, as its "),
    (lambda: modal_basis(ElasticBody(PLATE, attachments=[PointMass(0, 1.0)]), 6, contact=(),
                         rotation=Rotation(10.0)), r"without masses and springs at points"),
    (lambda: ElasticBody(PLATE, attachments=[PointMass(0, 1.0, (1.0, 1.0, 1.0))]),
     r"inertia of a plane body is one number"),
    (lambda: modal_basis(bar(), 3, contact=(), points={"a": "hab"}), r"no point or boundary 'ha"),
])
def test_bad_input(make, message):
    with pytest.raises((InputError, MeshError), match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
