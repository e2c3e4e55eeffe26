"""Small systems in space, pressed and sheared, for tests of quasi-static loading."""

import numpy as np

import fecontact as fc
from fecontact.laws import Constant, JenkinsFriction, LinearContact

HELD = 1e12


def node(friction, load=10.0, held=HELD, normal=None, **parts):
    """A mass with one contact node, held along x and y by springs, free along z."""
    rows = np.eye(6, 3)
    basis = fc.basis_from_matrices(np.eye(3), np.diag([held, held, 0.0]), {
        "contact": rows[None], "B": rows, "C": rows}, dimension=3)
    return fc.ContactSystem(basis, normal=normal or LinearContact(1e6), friction=friction,
                            load=fc.Load(load), **parts)


def jenkins(stiffness=2e4, coefficient=0.4, load=10.0, **parts):
    """A node with a Jenkins element, whose force is at most 4 N by default."""
    return node(JenkinsFriction(stiffness, coefficient), load, **parts)


def chain(friction, k=1e4, dimension=3, load=10.0, angle=0.0, force=0.0):
    """Two masses with a node each, joined by equal springs along the ground, each pressed.

    A force on the second one points along an angle to x.
    """
    d = dimension
    springs = np.kron([[k, -k], [-k, k]], np.diag([1.0] * (d - 1) + [0.0]))
    rows = np.zeros((2, 3 * (d - 1), 2 * d))
    rows[0, :d, :d] = rows[1, :d, d:] = np.eye(d)
    basis = fc.basis_from_matrices(np.eye(2 * d), springs, {"contact": rows}, dimension=d)
    up = "xyz"[d - 1]
    pull = force * np.array([np.cos(angle), np.sin(angle)])[: d - 1]
    forces = [fc.PointLoad(j, up, signal=Constant(-load)) for j in (0, 1)]
    forces += [fc.PointLoad(1, axis, signal=Constant(float(value)))
               for axis, value in zip("xy", pull, strict=False)]
    return fc.ContactSystem(basis, normal=LinearContact(2e6, 50.0), friction=friction,
                            load=fc.Load(forces=tuple(forces)))


def circle(radius, count, turns=1.0):
    """Places (count + 1, 2) on a circle that begins at (radius, 0)."""
    t = np.linspace(0.0, 2.0 * np.pi * turns, count + 1)
    return radius * np.column_stack([np.cos(t), np.sin(t)])


def dragged(places, steps=1):
    """The path whose ground goes the other way, so that a held node goes over these places."""
    x, y = -np.asarray(places).T
    return fc.LoadPath(travel=tuple(x), travel_y=tuple(y), steps=steps)
