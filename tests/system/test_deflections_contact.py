"""Statics with large deflections of bodies that press on each other and slide."""

import numpy as np
import pytest
from meshes_for_tests import grid, rectangle
from solid_blocks import block_mesh

from fecontact import BoundaryLoad, ElasticBody, InputError, Interface, Load, Material, PointLoad
from fecontact.analysis import DeflectionSteps, deflection_path
from fecontact.fem import PointSpring, Term, pair_both_faces, pair_faces
from fecontact.laws import (
    ConstantFriction,
    DahlFriction,
    JenkinsFriction,
    LinearContact,
    PowerContact,
)
from fecontact.system.statics.contact_forces import MovingContact
from fecontact.system.statics.contact_points import interface_points
from fecontact.system.statics.deflecting_bodies import DeflectingBodies, models_of

E, L, H, B = 2e11, 1.0, 1.0 / 250.0, 0.01
STEEL = Material(E, 0.0, 7800.0)
EI = E * B * H**3 / 12.0


def turned(dimension, angle):
    """Rotation in the first and the last direction."""
    found = np.eye(dimension)
    c, s = np.cos(angle), np.sin(angle)
    found[0, 0], found[0, -1], found[-1, 0], found[-1, -1] = c, -s, s, c
    return found


def blocks(dimension, degree):
    """A wider block below another one, and the names of their faces."""
    if dimension == 2:
        low, high = rectangle(1.0, 0.5, 4, 2), rectangle(0.9, 0.5, 3, 2).placed((0.05, 0.5))
        kind, faces = {"thickness": 0.1}, ("one.top", "two.bottom")
    else:
        low = block_mesh((3, 2, 1), (1.0, 0.5, 0.3))
        high = block_mesh((2, 2, 1), (0.9, 0.4, 0.3)).placed((0.05, 0.05, 0.3))
        kind, faces = {}, ("one.top", "two.contact")
    return {name: ElasticBody(mesh, STEEL, degree=degree, **kind)
            for name, mesh in (("one", low), ("two", high))}, faces


@pytest.mark.parametrize("state", ["open", "smooth", "stuck", "sliding"])
@pytest.mark.parametrize(("dimension", "degree"), [(2, 1), (2, 2), (3, 1), (3, 2)])
def test_the_tangent_is_the_derivative_of_the_forces(dimension, degree, state):
    """Differences for turned and strained bodies; forces balance, and do work on the energy."""
    bodies, faces = blocks(dimension, degree)
    friction = {"stuck": JenkinsFriction(1e8, 50.0), "sliding": JenkinsFriction(1e12, 0.01)}
    interface = Interface("seam", pair_faces(bodies, *faces, nodes_on="face"),
                          PowerContact(1e11, 1.5), friction.get(state))
    places, first = DeflectingBodies(models_of(bodies)).places, len(bodies["one"].nodes)
    contact = MovingContact(places, interface_points(bodies, [interface])[0])
    rng = np.random.default_rng(1)
    R, shift = turned(dimension, 0.7), np.full(dimension, 0.013)
    shift[-1] = 0.02 if state == "open" else -0.02
    moved = places @ R.T - places + 2e-3 * rng.normal(size=places.shape)
    moved[first:] += R @ shift
    way, h = rng.normal(size=places.shape), 1e-6
    here, ahead, behind = (contact.forces(at) for at in (
        moved, moved + h * way, moved - h * way))
    energy, force, slope = here.energy, here.force, here.slope
    if state == "open":
        assert energy == 0.0
        assert not force.any()
        assert not slope.nnz or not slope.data.any()
        return
    size = np.abs(force).max()
    assert np.abs(force.reshape(-1, dimension).sum(axis=0)).max() < 1e-12 * size * len(force)
    difference = (ahead.force - behind.force) / (2.0 * h)
    assert slope @ way.ravel() == pytest.approx(difference, abs=1e-6 * np.abs(difference).max())
    slides = contact.accept(moved).slides
    assert slides.all() if state == "sliding" else not slides.any()
    if state == "smooth":
        work = (ahead.energy - behind.energy) / (2.0 * h)
        assert force @ way.ravel() == pytest.approx(work, rel=1e-6)
        assert slope.toarray() == pytest.approx(slope.toarray().T, abs=1e-9 * abs(slope).max())


@pytest.mark.parametrize("kind", ["plane", "solid"])
def test_a_patch_is_in_balance_at_any_angle(kind):
    """Uniform compression passes a contact interface, turned by 60 degrees and more."""
    d, strain = (2, 1e-4) if kind == "plane" else (3, 1e-4)
    if d == 2:
        low, high = rectangle(1.0, 0.5, 3, 2), rectangle(1.0, 0.5, 3, 1).placed((0.0, 0.5))
        faces, options, area = ("one.top", "two.bottom"), {"thickness": B}, B
    else:
        low = block_mesh((2, 2, 1), (1.0, 0.5, 0.3))
        high = block_mesh((2, 2, 1), (1.0, 0.5, 0.3)).placed((0.0, 0.0, 0.3))
        faces, options, area = ("one.top", "two.contact"), {"degree": 1}, 0.5
    bodies = {name: ElasticBody(mesh, STEEL, **options)
              for name, mesh in (("one", low), ("two", high))}
    # The nominal stress of a stretch by 1 - strain is F S.
    stretch = 1.0 - strain
    total = E * area * stretch * 0.5 * (1.0 - stretch**2)
    stiffness = 1e4 * total
    interface = Interface("seam", pair_faces(bodies, *faces), LinearContact(stiffness),
                          JenkinsFriction(stiffness, 0.3))
    plain = DeflectingBodies(models_of(bodies))
    contact = MovingContact(plain.places, interface_points(bodies, [interface])[0])
    whole = DeflectingBodies(plain.models, [contact])
    for angle in (0.0, 1.1, 2.5):
        at = np.array(plain.places)
        at[:, -1] *= stretch
        at[len(bodies["one"].nodes):, -1] -= total / stiffness
        moved = at @ turned(d, angle).T - plain.places
        force = whole.state(moved.ravel()).force.reshape(-1, d)
        height = plain.places[:, -1]
        inside = (height > 1e-9) & (height < height.max() - 1e-9)
        assert np.abs(force[~inside].sum(axis=0)).max() < 1e-9 * total
        assert np.linalg.norm(force[height < 1e-9].sum(axis=0)) == pytest.approx(total, rel=1e-6)
        assert np.abs(force[inside]).max() < 1e-8 * total


def stacked(columns=24, **laws):
    """Two cantilevers, one on the other, and their interface."""
    bodies = {name: ElasticBody(rectangle(L, H, columns, 1).placed((0.0, y)), STEEL,
                                fixed={"left": "xy"}, thickness=B)
              for name, y in (("low", 0.0), ("high", H))}
    return bodies, Interface("seam", pair_faces(bodies, "high.bottom", "low.top", nodes_on="face"),
                             **laws)


def pressed(bodies, interface, factor):
    """Ends of both under a force factor EI / L^2 on the upper one, downwards."""
    load = Load(boundaries=(end_force("high.right", factor),))
    paths = deflection_path(bodies, load, interfaces=[interface])
    assert paths["low"].reached
    return paths


def end_force(boundary, factor):
    return BoundaryLoad(boundary, shear=-factor * EI / L**2 / (H * B))


def test_two_smooth_cantilevers_share_the_force():
    """Each has half of P L^2 / EI = 4: 0.16064 L in, 0.49346 L down (Mattiasson 1981)."""
    bodies, interface = stacked(normal=LinearContact(1e7))
    paths = pressed(bodies, interface, 4.0)
    alone = deflection_path(bodies["low"], Load(boundaries=(end_force("right", 2.0),)))
    for name in ("low", "high"):
        end = paths[name].displacement("right")[-1]
        assert end == pytest.approx(alone.displacement("right")[-1], rel=0.01)
        assert -end[1] == pytest.approx(0.49346, rel=0.01)


def test_two_stuck_cantilevers_are_one():
    """Friction that holds makes them a rod of twice the height: P L^2 / (8 EI) = 1."""
    bodies, interface = stacked(normal=LinearContact(1e9), friction=JenkinsFriction(1e11, 1e6))
    together = (BoundaryLoad("high.top", pressure=1e4), BoundaryLoad("low.bottom", pressure=1e4))
    loads = [Load(boundaries=together), Load(boundaries=(*together, end_force("high.right", 4.0),
                                                         end_force("low.right", 4.0)))]
    paths = deflection_path(bodies, loads, interfaces=[interface], follower=True)
    x, y = np.mean([one.displacement("right")[-1] for one in paths.values()], axis=0)
    assert [-x, -y] == pytest.approx([0.05643, 0.30172], rel=0.012)
    assert paths["low"].slip.max() < 1e-9 * H


def test_a_belt_slips_on_a_drum():
    """The tension falls to T exp(-mu phi) over the angle phi (Euler and Eytelwein)."""
    radius, height, mu, angle, pull = 1.0, 0.002, 0.3, 0.5 * np.pi, 1e4

    def bent(at):
        r, phi = radius + at[:, 1], at[:, 0]
        return np.column_stack([-r * np.cos(phi), r * np.sin(phi)])

    belt = grid(np.linspace(0.0, angle, 33), [0.0, height], warp=bent)
    drum = grid(np.linspace(-0.02, angle + 0.05, 81), [-0.2, 0.0], warp=bent)
    belt, drum = (type(one)(one.nodes, one.cells[:, ::-1], {
        name: facets[:, ::-1] for name, facets in one.boundaries.items()}) for one in (belt, drum))
    bodies = {"belt": ElasticBody(belt, STEEL, fixed={"left": "xy"}, thickness=B),
              "drum": ElasticBody(drum, STEEL, fixed={"bottom": "xy"}, thickness=B)}
    interface = Interface("wrap", pair_faces(bodies, "belt.bottom", "drum.top", nodes_on="face"),
                          LinearContact(1e7), JenkinsFriction(1e9, mu))
    paths = deflection_path(
        bodies, Load(boundaries=(BoundaryLoad("belt.right", pressure=-pull / (height * B)),)),
        interfaces=[interface], steps=DeflectionSteps(first=0.5, largest=0.5))
    path = paths["belt"]
    assert path.normal_force[-1].all()
    assert np.linalg.norm(path.friction_force[-1], axis=1) == pytest.approx(
        mu * path.normal_force[-1])
    # Away from both ends, where the belt bends and lifts off: nodes are halves of cells.
    phi = np.linspace(0.0, angle, 65)
    for first, last in ((8, 32), (32, 56)):
        part = path.normal_force[-1, first : last + 1]
        tensions = pull * np.exp(mu * (phi[[first, last]] - angle))
        assert part.sum() - 0.5 * (part[0] + part[-1]) == pytest.approx(
            np.diff(tensions)[0] / mu, rel=8e-3)
    assert (path.slip[-1] > 0.0).mean() > 0.9


def sliding_block(friction, loads, steps=None):
    """A block on springs, pressed onto a long support along which loads pull it."""
    block = rectangle(0.2, 0.1, 4, 2, points={"low": (0.0, 0.0), "high": (0.2, 0.0)})
    spring = 1e5
    attached = [PointSpring((Term("low", way),), k) for way, k in (
        ((1.0, 0.0), spring), ((0.0, 1.0), 1e6))] + [PointSpring((Term("high", (0.0, 1.0)),), 1e6)]
    bodies = {
        "block": ElasticBody(block.placed((0.3, 0.5)), STEEL, thickness=B, attachments=attached),
        "base": ElasticBody(rectangle(2.0, 0.5, 14, 3), STEEL, fixed={"bottom": "xy"},
                            thickness=B)}
    interface = Interface("foot", pair_faces(bodies, "block.bottom", "base.top", nodes_on="face"),
                          LinearContact(1e11), friction)
    return spring, deflection_path(bodies, loads, interfaces=[interface], steps=steps)["block"]


@pytest.mark.slow
@pytest.mark.parametrize("friction", [ConstantFriction(0.3), JenkinsFriction(1e10, 0.3)])
def test_a_block_slides_over_several_elements_and_back(friction):
    """Pressed with N, pulled with P, let go: at (P - mu N) / k, then at mu N / k."""
    press, pull = 2e5, 1.4e5
    normal = BoundaryLoad("block.top", pressure=press / (0.2 * B))
    loads = [Load(boundaries=(normal,)),
             Load(boundaries=(normal, BoundaryLoad("block.bottom", shear=pull / (0.2 * B)))),
             Load(boundaries=(normal,))]
    spring, path = sliding_block(friction, loads)
    assert path.reached
    x = path.displacement("bottom")[:, 0]
    limit = 0.3 * path.normal_force[-1].sum()
    whole = [int(np.flatnonzero(path.load_factors == k)[0]) for k in (1, 2, 3)]
    far = [0.0, (pull - limit) / spring, limit / spring]
    assert x[whole] == pytest.approx(far, abs=2e-3 * far[1])
    assert far[1] > 5.0 * 2.0 / 14.0
    slid = far[1] + far[1] - far[2]
    assert path.slip[-1] == pytest.approx(np.full(path.slip.shape[1], slid), rel=0.01)
    # Friction is constant, so that steps do not matter.
    assert path.friction_loss[-1] == pytest.approx(limit * slid, rel=0.01)
    assert np.linalg.norm(path.friction_force[-1], axis=1) == pytest.approx(
        0.3 * path.normal_force[-1], rel=1e-6)
    assert path.normal_force[-1].sum() == pytest.approx(press, rel=0.01)


def test_friction_on_the_ground_is_that_of_a_cone():
    """In both directions along flat ground, a brick pulled askew."""
    mesh = block_mesh((1, 1, 1), (0.1, 0.1, 0.1))
    springs = [PointSpring((Term(int(node), tuple(np.eye(3)[way])),), 2.5e4)
               for node in np.flatnonzero(mesh.nodes[:, 2] < 0.05) for way in (0, 1)]
    mu, press, pull = 0.4, 1e5, (6e4, 3e4)
    body = ElasticBody(mesh, STEEL, fixed={"top": "z"}, degree=1, attachments=springs)
    load = Load(boundaries=(BoundaryLoad(
        "top", shear=pull[0] / 0.01, shear_across=pull[1] / 0.01),))
    path = deflection_path(body, load, contact="contact", contact_nodes=1,
                           normal=LinearContact(1e8, preload=press), friction=ConstantFriction(mu))
    force = path.friction_force[-1, 0]
    assert np.hypot(*force[:2]) == pytest.approx(mu * path.normal_force[-1, 0], rel=1e-9)
    assert path.normal_force[-1, 0] == pytest.approx(press, rel=0.02)
    assert abs(force[1] / force[0]) == pytest.approx(0.5, rel=1e-3)
    moved = path.displacement("contact")[-1]
    assert np.hypot(*moved[:2]) == pytest.approx(
        (np.hypot(*pull) - mu * press) / 1e5, rel=0.05)


def test_energy_is_the_work_of_the_load_and_the_loss():
    """Two cantilevers that slide along each other while they bend."""
    bodies, interface = stacked(12, normal=LinearContact(1e8), friction=ConstantFriction(0.5))
    load = Load(boundaries=(BoundaryLoad("high.top", pressure=4.0 * EI / L**3 / B),))
    paths = deflection_path(bodies, load, interfaces=[interface],
                            steps=DeflectionSteps(first=0.05, largest=0.05))
    path = paths["high"]
    # A dead pressure is even over the length.
    work = 4.0 * EI / L**2 * np.trapezoid(path.load_factors, -path.displacement("top")[:, 1])
    assert path.friction_loss[-1] > 2e-3 * work
    assert path.energies[-1] + path.friction_loss[-1] == pytest.approx(work, rel=1e-3)


def test_meshes_that_do_not_match():
    """Two passes over an interface of other cells on either side: a block as one."""
    load = Load(boundaries=(BoundaryLoad("two.top", pressure=1e8),))
    bodies = {
        "one": ElasticBody(rectangle(1.0, 0.5, 5, 2), STEEL, fixed={"bottom": "xy"}, thickness=B),
        "two": ElasticBody(rectangle(1.0, 0.5, 3, 2).placed((0.0, 0.5)), STEEL, thickness=B,
                           fixed={"left": "x", "right": "x"})}
    bodies["two"] = ElasticBody(bodies["two"].mesh, STEEL, thickness=B, fixed={"left": "x"},
                                attachments=[PointSpring((Term(int(node), (0.0, 1.0)),), 1.0)
                                             for node in (0,)])
    interface = Interface("seam", pair_both_faces(bodies, "one.top", "two.bottom"),
                          LinearContact(1e13))
    path = deflection_path(bodies, load, interfaces=[interface])["two"]
    assert path.displacement("top")[-1, 1] == pytest.approx(-1e8 / E, rel=0.01)
    assert path.normal_force[-1].sum() == pytest.approx(1e8 * B, rel=1e-6)


def test_what_does_not_fit_is_refused():
    bodies, interface = stacked(4, normal=LinearContact(1e8))
    load = Load()
    for options, told in (
            ({"body": {}}, "no body"),
            ({"load": []}, "no load"),
            ({"body": {"low": bodies["low"]}}, "not the bodies"),
            ({"load": Load(normal=1.0)}, "load.normal"),
            ({"load": Load(forces=(PointLoad("right", "x", signal=1.0),))}, "BODY.PLACE"),
            ({"contact": "bottom"}, "those of one body"),
            ({"interfaces": [Interface("seam", interface.pairing, LinearContact(1e8),
                                       DahlFriction(1e8, 0.3))]}, "Jenkins")):
        with pytest.raises(InputError, match=told):
            deflection_path(**{"body": bodies, "load": load, "interfaces": [interface], **options})
