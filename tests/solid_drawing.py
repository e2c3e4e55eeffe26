"""A block in space that slides and rocks on the ground, as a page draws it, from closed forms."""

from dataclasses import dataclass

import numpy as np

from fecontact.core.units import UNITS
from fecontact.output.plots.solids.plans import FacePlan
from fecontact.output.report.bodies import Motions
from fecontact.output.report.contact import contact_table
from fecontact.output.report.drawing import DrawnBodies, along_edges, sharp_edges
from fecontact.output.report.page import page
from fecontact.output.report.payload import Payload
from fecontact.output.report.run_report import colour_maps, moving_tables

SIZE = np.array([0.1, 0.06, 0.02])
STIFFNESS, COEFFICIENT = 4e7, 0.4


def box_surface(counts):
    """Nodes and triangles of the surface of the block, of equal cells along each axis."""
    grids, triangles, first = [], [], 0
    for axis in range(3):
        a, b = [k for k in range(3) if k != axis]
        u, v = np.meshgrid(*(np.linspace(0.0, SIZE[k], counts[k] + 1) for k in (a, b)),
                           indexing="ij")
        number = np.arange(u.size).reshape(u.shape)
        quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]],
                         axis=-1).reshape(-1, 4)
        for end in (0.0, SIZE[axis]):
            places = np.zeros((u.size, 3))
            places[:, a], places[:, b], places[:, axis] = u.ravel(), v.ravel(), end
            grids.append(places)
            triangles.append(first + quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))
            first += u.size
    nodes, number = np.unique(np.concatenate(grids).round(12), axis=0, return_inverse=True)
    return nodes, number.ravel()[np.concatenate(triangles)]


def shapes_at(places, modes):
    """Shapes (P, 3, m): three translations, three small rotations, waves in z and x."""
    x = places - 0.5 * SIZE
    found = np.zeros((len(places), 3, modes))
    found[:, [0, 1, 2], [0, 1, 2]] = 1.0
    for k in range(3):
        found[:, :, 3 + k] = np.cross(np.eye(3)[k], x)
    for k in range(6, modes):
        i, j = 1 + (k - 6) % 4, (k - 6) // 4
        found[:, 2, k] = np.cos(np.pi * i * places[:, 0] / SIZE[0]) * np.cos(
            np.pi * j * places[:, 1] / SIZE[1])
        found[:, 0, k] = 0.1 * np.sin(np.pi * i * places[:, 0] / SIZE[0])
    return found


def stress_at(places, modes):
    """Stresses (P, 6, m) of the waves, smooth over the surface."""
    found = np.zeros((len(places), 6, modes))
    for k in range(6, modes):
        for c in range(6):
            found[:, c, k] = 1e11 * (1.0 + 0.2 * c) * (k - 5) * np.cos(
                (k - 5) * places[:, 0] / SIZE[0] + c * places[:, 1] / SIZE[1])
    return found


@dataclass(frozen=True)
class Solid:
    """The drawn block: its motion, contact and ground."""

    motions: Motions
    time: np.ndarray
    axes: np.ndarray
    forces: np.ndarray
    states: np.ndarray
    places: np.ndarray
    rows: np.ndarray
    face: dict
    travel: np.ndarray
    profile: np.ndarray
    first: float
    spacing: float


def squares(places, sides):
    """A plan whose patches are rectangles about places (k, 2)."""
    corners = places[:, None] + 0.5 * sides * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 2)
    return FacePlan(None, corners, np.arange(len(places)), edges, places, np.empty(0), ("x", "y"))


def solid(counts=(10, 6, 4), modes=20, times=201, nodes=(8, 5), waviness=0.0, end=0.02):
    """The block from 0 to ``end`` [s], its nodes in any order, as meshes have them."""
    places, triangles = box_surface(counts)
    order = np.random.default_rng(3).permutation(len(places))
    places, triangles = places[order], np.argsort(order)[triangles]
    t = np.linspace(0.0, end, times)
    k = np.arange(modes)
    size = 1e-5 * np.where(k < 3, [3.0, 1.0, 0.6][0], 1.0) / (1.0 + 0.5 * np.maximum(k - 5, 0))
    size[3:6] *= 8.0
    turn = 2.0 * np.pi * (170.0 + 130.0 * k) * t[:, None]
    q = size * (np.sin(turn + k) + 0.3 * np.sin(2.7 * turn) * (np.sin(900.0 * t)[:, None] > 0.0))
    rate = np.gradient(q, t, axis=0)
    bodies = along_edges(DrawnBodies(places, triangles, sharp_edges(places, triangles),
                         shapes_at(places, modes), stress_at(places, modes),
                         [[f"mode {k}", f"{170 + 130 * k}", "1 %", ""] for k in range(modes)],
                         (("block", int(np.argmax(places.sum(axis=1)))),)))
    edges = [np.linspace(0.0, SIZE[a], 2 * nodes[a] + 1)[1::2] for a in (0, 1)]
    plan = np.stack(np.meshgrid(*edges, indexing="ij"), axis=-1).reshape(-1, 2)
    below = np.column_stack([plan, np.zeros(len(plan))])
    rows = shapes_at(below, modes)
    moved, speed = (np.einsum("pcm,tm->tpc", rows, one) for one in (q, rate))
    travel = 0.5 * t
    pressed = np.maximum(0.0, 1e-5 - moved[:, :, 2]) * STIFFNESS
    slip = speed[:, :, :2] - [0.5, 0.0]
    size_of_slip = np.linalg.norm(slip, axis=2, keepdims=True)
    along = -COEFFICIENT * pressed[:, :, None] * slip / np.maximum(size_of_slip, 0.45)
    states = np.where(pressed == 0.0, 0, np.where(size_of_slip[..., 0] < 0.45, 1, 2))
    face = {"title": "contact", "label": "contact position x", "first": 0,
            "abscissa": plan[:, 0].tolist(), "plan": squares(plan, np.divide(SIZE[:2], nodes)),
            "sizes": np.full(len(plan), SIZE[0] * SIZE[1] / len(plan)).tolist()}
    profile, x = np.zeros(1), np.linspace(-0.1, 0.2, 721)
    drift = np.zeros((2, modes))
    if waviness:
        profile, drift[0] = waviness * np.sin(2.0 * np.pi * x / 0.03), rows[:, 0].mean(axis=0)
    return Solid(Motions(bodies, q, drift), t, np.broadcast_to(np.eye(3), (len(plan), 3, 3)),
                 np.concatenate([along, pressed[:, :, None]], axis=2), states, below, rows, face,
                 travel, profile, x[0], x[1] - x[0])


def solid_header(drawn, payload, scale=50.0):
    """The header of its page."""
    force = drawn.forces[:, :, 2].sum(axis=1)
    chart = {"title": "total normal force", "unit": "N", "factor": 1.0,
             "lines": [{"name": "contact", "colour": "#0072b2",
                        "y": payload.add(force, 1e-4 * force.max())}]}
    box = drawn.motions.ranges.box(scale)
    contact = contact_table(drawn.axes, drawn.forces, drawn.states, ("open", "stick", "slip"),
                            payload, (drawn.places, drawn.rows))
    plan = drawn.face["plan"]
    contact["faces"] = [drawn.face | {"plan": {
        "corners": payload.add(plan.corners, 1e-6), "owner": payload.add(plan.owner),
        "edges": payload.add(plan.edges, 1e-6), "labels": plan.labels,
        "box": plan.box.T.ravel().tolist()}}]
    ground = {"wavy": len(drawn.profile) > 1, "level": 0.0, "gap": 0.0,
              "profile": payload.add(drawn.profile, 1e-9), "first": drawn.first,
              "spacing": drawn.spacing, "travel": payload.add(drawn.travel, 1e-9),
              "drift": drawn.motions.drift.ravel().tolist(), "direction": (1.0, 0.0),
              "centre": (0.0, 0.0), "heights": None}
    return {"format": 2, "title": "Block in space", "status": "synthetic", "good": True,
            "notes": [], "facts": [], "numbers": [], "system": [], "study": [], "versions": [],
            "units": UNITS, "spectra": [],
            "time": payload.add(drawn.time, 1e-9), "charts": [chart], "phases": [],
            "energies": [], "balance": "", "maps": colour_maps(),
            "contact": contact, "ground": ground,
            **moving_tables(drawn.motions, scale, box, payload)}


def write_solid(drawn, path, scale=50.0):
    """The page of the block, whose path is returned."""
    payload = Payload()
    header = solid_header(drawn, payload, scale)
    path.write_text(page("Block in space", payload.block(header)))
    return path
