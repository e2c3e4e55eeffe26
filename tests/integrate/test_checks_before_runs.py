"""Warnings before a run: nothing that holds the body, gaps out of reach, straight arcs."""

import warnings

import numpy as np
import pytest

import fecontact as fc
from fecontact.core.errors import ModelWarning
from fecontact.fem.chords import chords
from fecontact.fem.mesh import Mesh
from fecontact.laws import Constant, ConstantFriction, Frictionless, LinearContact
from fecontact.system.model_limits import (
    Planned,
    implausible_faces,
    implausible_values,
)

WEIGHT = 100.0


def beam(modes=6, **parts):
    body = fc.ElasticBody(fc.generate(fc.Beam(0.2, 0.02, element_size=0.02)), fc.Material(), 0.01)
    basis = fc.modal_basis(body, modes, contact="contact", contact_nodes=3,
                           C=fc.Patch((0.1, 0.02), 0.01), damping=0.01)
    return fc.ContactSystem(basis, **{"normal": LinearContact(1e7), "load": fc.Load(WEIGHT),
                                      "friction": Frictionless(), **parts})


def found(system, duration=1e-3, **state):
    y = np.zeros(system.size)
    y[:] = state.get("state", 0.0)
    return implausible_values(Planned(system, duration, y))


def pull(x=0.0, y=0.0, phi=0.0):
    return fc.Load(forces=tuple(fc.PointLoad("C", name, signal=Constant(1.0))
                                for name, value in (("x", x), ("y", y), ("phi", phi)) if value))


def gravity(x=0.0, y=0.0):
    return fc.Load(gravity=(x, y))


def test_loads_that_nothing_resists_are_named():
    assert found(beam()) == ()
    up, = found(beam(load=fc.Load(-WEIGHT)))
    assert up.startswith("nothing holds the body against a translation away from the ground (y)")
    along, = found(beam(load=gravity(9.81, -9.81)))
    assert "a translation along the ground (x)" in along
    # Friction, a spring or a dashpot at B resist.
    assert found(beam(load=gravity(9.81, -9.81), friction=ConstantFriction(0.3))) == ()
    assert found(beam(load=gravity(9.81, -9.81), drive=fc.Drive(stiffness_x=1e3))) == ()
    assert found(beam(load=gravity(9.81, -9.81), drive=fc.Drive(damping_x=1e3))) == ()
    assert found(beam(load=gravity(9.81, -9.81), drive=fc.Drive(stiffness_y=1e3))) != ()


def test_a_body_that_tips_over_is_not_held():
    """The load acts beyond the ends of the contact: the moment about the last node is not zero."""
    system = beam()
    x = system.basis.contact_x
    assert found(beam(load=gravity(0.0, -9.81))) == ()
    beyond = fc.Load(forces=(fc.PointLoad((float(x.max()) + 0.01, 0.01), "y",
                                          signal=Constant(-WEIGHT)),))
    within = fc.Load(forces=(fc.PointLoad((float(x.max()) - 0.01, 0.01), "y",
                                          signal=Constant(-WEIGHT)),))
    assert found(beam(load=within)) == ()
    message, = found(beam(load=beyond))
    assert "a rotation" in message


def test_simulate_warns_once_before_the_run():
    system = beam(load=fc.Load(-WEIGHT))
    with pytest.warns(ModelWarning, match="nothing holds the body") as caught:
        fc.simulate(system, 1e-5, initial=fc.RigidStart((0.0, 0.0, 0.0)), outputs=2)
    assert len(caught) == 1


@pytest.mark.parametrize("factor", [0.997, 1.003])
def test_gaps_out_of_reach(factor):
    """A body in free fall: it reaches g T^2 / 2, and with a start at v0 another v0 T."""
    T, g, v = 0.01, 9.81, 0.005
    way = 0.5 * g * T**2 + v * T
    system = beam(load=gravity(0.0, -g), gap=factor * way)
    start = np.zeros(system.size)
    m = system.basis.modes
    rigid = system.basis.contact_T[:, 1, :3]
    start[m : m + 3] = np.linalg.lstsq(rigid, np.full(3, -v), rcond=None)[0]
    messages = found(system, T, state=start)
    if factor > 1.0:
        assert any("no contact can close" in one for one in messages)
    run = None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        run = fc.simulate(system, T, initial=start, outputs=4001)
    assert run.normal_force.any() == (factor < 1.0)
    assert (messages == ()) == (factor < 1.0)


def ring(count, curved=False):
    """A quarter of a ring of triangles, 0.1 to 0.12 m, ``count`` elements along the inner arc."""
    angles = np.linspace(-0.75 * np.pi, -0.25 * np.pi, count + 1)
    unit = np.column_stack([np.cos(angles), np.sin(angles)])
    nodes = np.concatenate([0.1 * unit, 0.12 * unit])
    a, b = np.arange(count), np.arange(count) + count + 1
    cells = np.concatenate([np.column_stack([b, b + 1, a]), np.column_stack([b + 1, a + 1, a])])
    outer = np.column_stack([b, b + 1])
    half = 0.5 * (angles[1:] + angles[:-1])
    middles = 0.12 * np.column_stack([np.cos(half), np.sin(half)])
    extra = {"curved_edges": outer, "curved_middles": middles} if curved else {}
    return Mesh(nodes, cells, {"outer": outer, "side": np.array([[0, count + 1]])}, **extra)


@pytest.mark.parametrize("count", [6, 12, 24])
def test_chords_of_a_circle(count):
    found = chords(ring(count), "outer")
    angle = 0.5 * np.pi / count
    assert found.straight == count
    assert found.angle == pytest.approx(angle, rel=1e-9)
    assert found.error == pytest.approx(0.12 * (1.0 - np.cos(0.5 * angle)), rel=1e-6)
    assert chords(ring(count, curved=True), "outer") is None
    assert chords(ring(count), "side") is None


def test_straight_faces_and_polygons_have_no_chords():
    square = fc.generate(fc.Beam(0.2, 0.02, element_size=0.02))
    assert all(chords(square, name) is None for name in square.boundaries)


def test_straight_quadratic_elements_along_an_arc_are_warned_of():
    system = beam()
    body = fc.ElasticBody(ring(12), fc.Material(), 0.01, degree=2)
    message, = implausible_faces({"": body}, {"": ("outer",)}, system)
    error = 1e6 * 0.12 * (1.0 - np.cos(0.25 * np.pi / 12))
    assert "12 elements along the curved boundary 'outer' are straight" in message
    assert f"up to {error:.3g} um" in message
    assert "middle nodes lie on the chords" in message
    curved = fc.ElasticBody(ring(12, curved=True), fc.Material(), 0.01, degree=2)
    assert not [*implausible_faces({"": curved}, {"": ("outer",)}, system)]


def test_chords_of_a_sphere_and_a_cylinder_in_space():
    """Hexahedra of a block bent to a cylinder: sagitta of their chords."""
    n, R = 8, 0.05
    angles = np.linspace(-0.3, 0.3, n + 1)
    nodes, cells = [], []
    for y in (0.0, 0.01):
        for r in (R, 1.2 * R):
            nodes += [[r * np.sin(a), y, -r * np.cos(a)] for a in angles]
    k = n + 1
    for i in range(n):
        inner, outer = i, k + i
        cells.append([outer, outer + 1, outer + 1 + 2 * k, outer + 2 * k,
                      inner, inner + 1, inner + 1 + 2 * k, inner + 2 * k])
    faces = np.array([[k + i, k + i + 2 * k, k + i + 1 + 2 * k, k + i + 1] for i in range(n)])
    mesh = Mesh(np.array(nodes), np.array(cells), {"low": faces})
    given = chords(mesh, "low")
    assert given.straight == n
    assert given.error == pytest.approx(1.2 * R * (1.0 - np.cos(0.3 / n)), rel=1e-3)
