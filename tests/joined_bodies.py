"""Bases of several bodies, put together by hand from bases of single ones."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from synthetic import basis, run

from fecontact import ContactSystem, ModalBasis
from fecontact.laws import ConstantFriction, LinearContact
from fecontact.reduction import ModeShapes
from fecontact.reduction.modal_basis import BodyPart


@dataclass(frozen=True)
class Touch:
    """An interface: mesh nodes of a body with their normals, on another body or the ground."""

    name: str
    body: str
    nodes: np.ndarray
    normals: np.ndarray
    tributary: np.ndarray
    other: str | None = None


def moved(body, shift=(0.0, 0.0), angle=0.0):
    """A body in another place: rotated about the origin, then shifted."""
    c, s = np.cos(angle), np.sin(angle)
    turn, field = np.array([[c, -s], [s, c]]), body.mode_shapes
    return replace(body, mode_shapes=replace(
        field, nodes=field.nodes @ turn.T + shift,
        shapes=np.einsum("ij,njm->nim", turn, field.shapes)))


def foot(field, place):
    """Nodes and weights of the point of an outline that is closest to a place."""
    a, b = field.nodes[field.outline[:, 0]], field.nodes[field.outline[:, 1]]
    along = b - a
    part = np.clip(((place - a) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    best = np.linalg.norm(a + part[:, None] * along - place, axis=1).argmin()
    return field.outline[best], np.array([1.0 - part[best], part[best]])


def joined(bodies, touches):
    """An assembled basis: modes block by block, rows of relative motion along t and n."""
    fields = {name: body.mode_shapes for name, body in bodies.items()}
    nodes = np.cumsum([0, *(len(field.nodes) for field in fields.values())])
    modes = np.cumsum([0, *(body.modes for body in bodies.values())])
    start = dict(zip(bodies, nodes, strict=False))
    N, m = nodes[-1], modes[-1]
    shapes, stress = np.zeros((N, 2, m)), np.zeros((N, 4, m))
    for field, n0, n1, m0, m1 in zip(fields.values(), nodes, nodes[1:], modes, modes[1:],
                                     strict=False):
        shapes[n0:n1, :, m0:m1], stress[n0:n1, :, m0:m1] = field.shapes, field.stress
    n = sum(len(touch.nodes) for touch in touches)
    rows, j, places = sp.lil_array((3 * (2 + n), 2 * N)), 2, np.zeros((2 + n, 2))
    for touch in touches:
        for node, (x, y) in zip(touch.nodes, touch.normals, strict=True):
            places[j] = fields[touch.body].nodes[node]
            parts = [(start[touch.body] + node, 1.0)]
            if touch.other is not None:
                parts += [(start[touch.other] + k, -weight)
                          for k, weight in zip(*foot(fields[touch.other], places[j]), strict=True)]
            for k, weight in parts:
                rows[3 * j, 2 * k : 2 * k + 2] = weight * np.array([[y, -x]])
                rows[3 * j + 1, 2 * k : 2 * k + 2] = weight * np.array([[x, y]])
            j += 1
    restriction = sp.csr_array(rows)
    offsets = nodes[:-1]
    cells, outline = (np.concatenate([getattr(field, name) + offset for field, offset in
                                      zip(fields.values(), offsets, strict=True)])
                      for name in ("cells", "outline"))
    w = np.concatenate([body.angular_frequencies for body in bodies.values()])
    return ModalBasis(
        w, np.diag(0.02 * w), (restriction @ shapes.reshape(2 * N, m)).reshape(-1, 3, m), places,
        np.concatenate([touch.tributary for touch in touches]),
        mode_shapes=ModeShapes(np.concatenate([field.nodes for field in fields.values()]), cells,
                               outline, shapes, stress, restriction),
        groups=tuple((touch.name, len(touch.nodes)) for touch in touches),
        contact_normals=np.concatenate([touch.normals for touch in touches]),
        on_ground=np.concatenate([np.full(len(touch.nodes), touch.other is None)
                                  for touch in touches]),
        parts=tuple(BodyPart(name, (int(m0), int(m1 - m0)), (int(n0), int(n1 - n0)))
                    for name, m0, m1, n0, n1 in zip(bodies, modes, modes[1:], nodes, nodes[1:],
                                                    strict=False)))


def line(nodes, first, direction):
    """Numbers of the nodes on a line through a place, in order along a direction."""
    direction = np.asarray(direction, dtype=float)
    away = nodes - first
    on = np.flatnonzero(np.abs(away @ [-direction[1], direction[0]]) < 1e-9)
    return on[np.argsort(nodes[on] @ direction)]


def touch(name, bodies, body, first, tangent, other=None):
    """Contact of all nodes of a straight face; the normal is the tangent turned to the left."""
    nodes = bodies[body].mode_shapes.nodes
    found = line(nodes, first, tangent)
    tangent = np.asarray(tangent, dtype=float)
    length = np.linalg.norm(np.diff(nodes[found], axis=0), axis=1)
    tributary = 0.5 * (np.append(0.0, length) + np.append(length, 0.0))
    normals = np.tile([-tangent[1], tangent[0]], (len(found), 1))
    return Touch(name, body, found, normals, tributary, other)


def stack(angle=0.0):
    """A block in the middle of a beam, and the beam on the ground; or both turned by an angle.

    Meshes do not match. If turned, the beam's lower face rests on nothing: there is no ground.
    """
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    beam = moved(basis(columns=20, rows=4), angle=angle)
    block = moved(basis(length=0.05, height=0.03, columns=7, rows=4),
                  shift=turn @ [0.06, 0.02], angle=angle)
    bodies = {"block": block, "beam": beam}
    touches = [touch("shoe", bodies, "block", turn @ [0.06, 0.02], turn[:, 0], "beam")]
    if not angle:
        touches.append(touch("foot", bodies, "beam", (0.0, 0.0), (1.0, 0.0)))
    return joined(bodies, touches)


def stack_system(angle=0.0):
    return ContactSystem(stack(angle), normal=LinearContact(1e8), friction=ConstantFriction(0.3))


def stack_run(angle=0.0, times=51, system=None):
    """Both bodies shake; the block presses on the beam all the time."""
    system = stack_system(angle) if system is None else system
    t = np.linspace(0.0, 0.02, times)
    m = system.basis.modes
    w = 2.0 * np.pi * np.linspace(80.0, 400.0, m)
    size = 2e-5 * np.array([1.0, 0.4, 3.0, 0.3, 0.05] * (m // 5))
    q, rate = size * np.sin(w * t[:, None]), size * w * np.cos(w * t[:, None])
    n = np.array([-np.sin(angle), np.cos(angle)])
    q[:, :2] -= 1e-4 * n
    done = run(times=2)
    return replace(done, system=system, time=t, modal_coordinates=q, modal_velocities=rate,
                   work=np.zeros((times, done.work.shape[1])))
