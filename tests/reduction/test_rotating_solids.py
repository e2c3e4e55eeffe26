"""Solids that rotate: rigid bodies, beams, discs, the plane body they contain."""

import numpy as np
import pytest
from meshes_for_tests import rectangle
from solid_blocks import block_body, block_mesh

from fecontact import (
    ContactSystem,
    ElasticBody,
    InputError,
    Interface,
    Load,
    Material,
    Mesh,
    equilibrium,
    generate,
    modal_basis,
    static_solution,
)
from fecontact.analysis import complex_modes
from fecontact.fem import Ring, Rotation, pair_faces
from fecontact.io import read_basis, write_basis
from fecontact.laws import Frictionless, LinearContact
from fecontact.reduction import FaceWeld, assembled_basis, reduce_bodies

STEEL = Material(2.1e11, 0.3, 7850.0)


def test_rigid_box_spins_and_precesses():
    """Euler's equations about steady spin: W for tilt and shift, W sqrt((C-A)(C-B)/(A B)).

    The spin is about z, A, B and C the moments of inertia about x, y and z. Stiffness of the
    stress, softening and Coriolis forces have to cancel for a turn about the axis.
    """
    a, b, c = 0.2, 0.14, 0.05
    A, B, C = b**2 + c**2, a**2 + c**2, a**2 + b**2
    W, centre = 30.0, (0.5 * a, 0.5 * b, 0.3)
    body = block_body((2, 2, 1), (a, b, c), material=STEEL)
    basis = modal_basis(body, 6, contact=(), rotation=Rotation(W, centre))
    found = np.sort(np.abs(np.linalg.eigvals(np.block([
        [np.zeros((6, 6)), np.eye(6)], [-basis.stiffness_matrix, -basis.damping]]))))
    precession = W * np.sqrt((C - A) * (C - B) / (A * B))
    # Free motion along z and turns about it: four zeros; shift in x and y: W twice a pair.
    assert found[:4] == pytest.approx(np.zeros(4), abs=1e-3 * W)
    assert found[4:] == pytest.approx(np.sort([*[W] * 6, *[precession] * 2]), rel=1e-6)


def test_axis_may_point_anywhere():
    """A body and its axis turned together have the same frequencies."""
    mesh = block_mesh((3, 1, 1), (0.3, 0.05, 0.03))
    rotation = Rotation(400.0, (0.0, 0.02, 0.01))
    turn = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    turned = Mesh(mesh.nodes @ turn.T, mesh.cells, mesh.boundaries)
    found = [complex_modes(modal_basis(
        ElasticBody(one, STEEL, fixed={"left": "xyz"}), 8, contact=(), rotation=how)).frequencies_hz
        for one, how in ((mesh, rotation), (turned, Rotation(
            400.0, tuple(turn @ rotation.centre), axis=tuple(3.0 * turn[:, 2]))))]
    assert found[1] == pytest.approx(found[0], rel=1e-6)


def test_slice_of_a_solid_is_the_plane_body():
    """A solid whose faces slide along z is in plane strain; it turns like the plane body."""
    size, W, centre = (0.4, 0.1, 0.02), 900.0, (-0.1, 0.05)
    plane = ElasticBody(rectangle(*size[:2], 6, 2), STEEL, size[2], "strain",
                        fixed={"left": "xy"})
    mesh = block_mesh((6, 2, 1), size)
    solid = ElasticBody(mesh, STEEL, fixed={"left": "xyz", "contact": "z", "top": "z"})
    found = [modal_basis(body, 6, contact=(), rotation=Rotation(W, centre))
             for body in (plane, solid)]
    for name in ("frequencies_hz", "centrifugal_load"):
        first, second = (np.abs(getattr(one, name)) for one in found)
        assert second == pytest.approx(first, rel=1e-6, abs=1e-7 * first.max())
    first, second = (np.linalg.eigvals(one.stiffness_matrix) for one in found)
    assert np.sort(second.real) == pytest.approx(np.sort(first.real), rel=1e-6)
    first, second = (complex_modes(one).frequencies_hz for one in found)
    assert second == pytest.approx(first, rel=1e-6)


def test_rotating_cantilever_flaps():
    """Wright and others (1982): 4.1373 and 11.2023 at W = 2 and 10 over sqrt(E I / (m L^4)).

    In the plane of rotation the square is less by W^2. The modes at rest carry it; with the static
    state at speed in the modes (``prestress``) few of them do.
    """
    L, h, b = 1.0, 0.02, 0.03
    slim = Material(2.1e11, 0.0, 7850.0)
    body = ElasticBody(block_mesh((20, 1, 1), (L, b, h)), slim, fixed={"left": "xyz"})
    unit = np.sqrt(slim.youngs_modulus * h**2 / (12.0 * slim.density * L**4))
    centre = (0.0, 0.5 * b, 0.5 * h)
    for speed, flap in ((2.0, 4.1373), (10.0, 11.2023)):
        rotation = Rotation(speed * unit, centre, coriolis=False)
        basis = modal_basis(body, 24, contact=(), rotation=rotation)
        found = np.sqrt(np.linalg.eigvalsh(basis.stiffness_matrix)) / unit
        assert np.abs(found / flap - 1.0).min() < 3e-3
        state = static_solution(body, Load(), rotation=rotation)
        few = modal_basis(body, 2, contact=(), prestress=state)
        assert few.angular_frequencies[0] / unit == pytest.approx(flap, rel=3e-3)
    # Bending in the plane of rotation is b / h times as stiff at rest.
    speed = 2.0
    flap = np.sqrt(3.51602**2 * (b / h) ** 2 + (4.1373**2 - 3.51602**2) - speed**2)
    basis = modal_basis(body, 24, contact=(), rotation=Rotation(2.0 * unit, centre, coriolis=False))
    found = np.sqrt(np.linalg.eigvalsh(basis.stiffness_matrix)) / unit
    assert np.abs(found / flap - 1.0).min() < 5e-3


def test_rotating_disc_of_lamb_and_southwell():
    """A free thin disc at high speed is a membrane.

    8 w^2 = W^2 [k (k + 2) (3 + nu) - n^2 (1 + 3 nu)] with n nodal diameters, s nodal circles, k =
    n + 2 s. The sum of this and of the square at rest is a bound from below (Southwell), reached
    to a few per cent.
    """
    nu = STEEL.poisson_ratio
    body = ElasticBody(generate(Ring(0.2, 0.0, 0.0005, element_size=0.05, layers=1)), STEEL)
    still = modal_basis(body, 14, contact=())
    flat = np.abs(still.mode_shapes.shapes[:, 2]).max(axis=0) > 10.0 * np.abs(
        still.mode_shapes.shapes[:, :2]).max(axis=(0, 1))
    rest = still.angular_frequencies[flat & (still.angular_frequencies > 0.0)]
    W = 6.0 * rest[0]
    basis = modal_basis(body, 40, contact=(), rotation=Rotation(W, coriolis=False))
    found = np.linalg.eigvalsh(basis.stiffness_matrix) / W**2

    def membrane(n, s):
        k = n + 2 * s
        return (k * (k + 2) * (3.0 + nu) - n**2 * (1.0 + 3.0 * nu)) / 8.0

    for n, s, at_rest in ((2, 0, rest[0]), (3, 0, rest[3])):
        bound = membrane(n, s) + (at_rest / W) ** 2
        near = found[np.argmin(np.abs(found - bound))]
        assert bound * (1.0 - 2e-3) < near < bound * 1.03
    # A turn of the disc about a diameter is at rest in the inertial frame.
    assert np.abs(found - 1.0).min() < 1e-3


def test_centrifugal_load_presses_a_contact():
    """A block beyond the axis presses on a stop with m W^2 r, as in the plane."""
    W, size = 50.0, (0.04, 0.04, 0.05)
    body = block_body((1, 1, 1), size, material=STEEL, fixed={"left": "xy"})
    centre = (0.02, 0.02, 2.0)
    basis = modal_basis(body, 12, contact_nodes=1, rotation=Rotation(
        W, centre, axis=(0.0, 1.0, 0.0)))
    system = ContactSystem(basis, normal=LinearContact(1e9), friction=Frictionless())
    force = equilibrium(system).normal_force.sum()
    mass = body.total_mass
    assert force == pytest.approx(mass * W**2 * (2.0 - 0.5 * size[2]), rel=1e-4)
    state = static_solution(ElasticBody(body.mesh, STEEL, fixed={"contact": "z", "left": "xy"}),
                            Load(), rotation=Rotation(W, centre, axis=(0.0, 1.0, 0.0)))
    top = state.displacement[body.nodes[:, 2] > size[2] - 1e-9, 2]
    assert (top < 0.0).all()


def test_bodies_that_rotate_together_press_each_other(tmp_path):
    """A block that can slide outwards presses on the next one with m W^2 r."""
    W, size = 40.0, 0.1
    rotation = Rotation(W, (-0.5, 0.5 * size), stress_stiffening=False)
    bodies = {"inner": ElasticBody(rectangle(size, size, 2, 2), STEEL, fixed={"bottom": "y"}),
              "outer": ElasticBody(rectangle(size, size, 2, 2).placed((size, 0.0)), STEEL,
                                   fixed={"right": "xy"})}
    pairing = pair_faces(bodies, "inner.right", "outer.left", nodes=2)
    bases = reduce_bodies(bodies, [pairing], modes=6, rotation=rotation)
    system = ContactSystem(bodies=bases, interfaces=[
        Interface("root", pairing, LinearContact(1e10), Frictionless())])
    force = equilibrium(system).normal_force.sum()
    assert force == pytest.approx(bodies["inner"].total_mass * W**2 * (0.5 + 0.5 * size), rel=1e-4)
    faster = equilibrium(system.with_(**{"basis.rotation.speed": 2.0 * W})).normal_force.sum()
    assert faster == pytest.approx(4.0 * force, rel=1e-3)
    write_basis(tmp_path / "basis.h5", system.basis)
    assert read_basis(tmp_path / "basis.h5").rotation.centre == (-0.5, 0.05, 0.0)
    slower = reduce_bodies(bodies, [pairing], modes=6, rotation=rotation,
                           each={"outer": {"rotation": Rotation(
                               W, (-0.4, 0.05), stress_stiffening=False)}})
    with pytest.raises(InputError, match="'outer' does not rotate as 'inner' does"):
        assembled_basis(slower, {"root": pairing})


def test_welded_halves_rotate_like_the_whole():
    """With the stress of their common state, in which the inner half carries the outer one."""
    free, rotation = (Rotation(250.0, (0.0, 0.02), stress_stiffening=on) for on in (False, True))
    whole = ElasticBody(rectangle(1.0, 0.04, 20, 1), STEEL, fixed={"left": "xy"})
    halves = {"first": ElasticBody(rectangle(0.5, 0.04, 10, 1), STEEL, fixed={"left": "xy"}),
              "second": ElasticBody(rectangle(0.5, 0.04, 10, 1).placed((0.5, 0.0)), STEEL)}
    weld = FaceWeld(pair_faces(halves, "first.right", "second.left"))

    def joined(each, how):
        return assembled_basis(reduce_bodies(halves, [], [weld], modes=14, rotation=how,
                                             each=each), {}, [weld])

    basis = joined({}, free)
    q = np.linalg.solve(basis.stiffness_matrix, basis.centrifugal_load)
    basis = joined({name: {"prestress": basis.fields(q, name)} for name in halves}, free)
    expected = modal_basis(whole, 24, contact=(), rotation=rotation)
    found, wanted = (complex_modes(one).frequencies_hz[:3] for one in (basis, expected))
    assert found == pytest.approx(wanted, rel=2e-3)
    with pytest.raises(InputError, match="pull on each other"):
        joined({}, rotation)
    with pytest.raises(InputError, match=r"no body 'third'.*'first'"):
        basis.fields(np.zeros(basis.modes), "third")


def test_bad_axes_are_refused():
    plane = ElasticBody(rectangle(0.2, 0.1, 2, 1), STEEL)
    for rotation in (Rotation(1.0, axis=(1.0, 0.0, 0.0)), Rotation(1.0, (0.0, 0.0, 1.0))):
        with pytest.raises(InputError, match="a plane body turns about z"):
            modal_basis(plane, 4, contact=(), rotation=rotation)
    for arguments, words in (({"axis": (0.0, 0.0, 0.0)}, "longer than zero"),
                             ({"axis": (1.0, 0.0)}, "three components"), ({"axis": "z"}, "axis"),
                             ({"centre": (1.0,)}, "coordinates")):
        with pytest.raises(InputError, match=words):
            Rotation(1.0, **arguments)
