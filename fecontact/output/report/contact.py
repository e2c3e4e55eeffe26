"""Contact of a page: places, states and forces of the contact nodes, and the ground."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.laws.ground.ground import Ground
from fecontact.laws.ground.height_map import HeightMap
from fecontact.output.diagrams.colours import STATE_COLOURS
from fecontact.output.files.frames import contact_forces
from fecontact.output.plots.solids.plans import FacePlan, face_plan
from fecontact.output.plots.style import state_names
from fecontact.output.render.frames_data import Motion
from fecontact.output.report.bodies import PRESSURE, STATE
from fecontact.output.report.drawing import DrawnContact, DrawnGround
from fecontact.output.report.payload import SMALLEST, Payload
from fecontact.reduction.assembly.contact_faces import (
    ContactFace,
    contact_directions,
    touching_faces,
)

_FORCE = 0.95e-4  # largest error of a force, of the largest force
_ROWS = 3e-6  # step of the rows of contact nodes, of their largest value
_PROFILE = 24  # points of the ground's profile per wave
_MOST_POINTS = 20_000  # of the profile
_MAP = 4  # points of a map of heights per measured one, along each axis
_MOST_OF_MAP = 256
_OPEN = "#dddddd"  # of open contact on the faces of solids
_BESIDE = 0.6  # ground drawn on either side of the bodies, of their width


def drawn_contact(run: Trajectory, motion: Motion | None) -> DrawnContact:
    """Contact nodes of a run; with a motion to draw also where they and their feet are."""
    basis, names = run.basis, state_names(run)
    tangents, normals = contact_directions(basis)
    solid = basis.dimension == 3
    axes = (np.concatenate([tangents, normals[:, None]], axis=1) if solid
            else np.stack([tangents, normals], axis=1))
    found = DrawnContact(
        faces=[{"title": face.title or "contact", "label": face.label,
                "first": face.nodes.start, "abscissa": face.abscissa.tolist(),
                "sizes": face.tributary.tolist()}
               | ({"plan": face_plan(basis, face)} if solid else {})
               for face in _touching(run)],
        axes=axes, forces=np.einsum("tnk,nik->tni", contact_forces(run), axes),
        states=np.minimum(run.contact_state, len(names) - 1), names=names,
        areas=basis.tributary if solid else None)
    if motion is None:
        return found
    places, rows = motion.contact_rows
    return replace(found, places=places, rows=rows, feet=motion.footed, sliding=motion.sliding)


def contact_table(contact: DrawnContact, payload: Payload) -> dict[str, Any]:
    """Contact nodes with their states and forces at all times.

    ``forces`` (N, n, d) are those along the ``axes`` of the nodes [N]. Where bodies are drawn,
    ``places`` and ``rows`` are where the nodes and their ``feet`` on other bodies are, and their
    displacements per modal coordinate.
    """
    lengths = np.linalg.norm(contact.forces, axis=2)
    largest = float(lengths.max(initial=0.0))
    # Errors of all components at once.
    d = contact.forces.shape[2]
    step = max(2.0 * _FORCE * largest / np.sqrt(d), SMALLEST)
    found: dict[str, Any] = {
        "faces": [face | ({"plan": _plan_table(face["plan"], payload)} if "plan" in face else {})
                  for face in contact.faces],
        "states": list(contact.names),
        "colours": [STATE_COLOURS.get(name, "") for name in contact.names],
        "state": payload.add(contact.states, later=True),
        "forces": payload.add(contact.forces, step, later=True, near=_alike(contact)),
        "largest": largest,
        "axes": payload.add(contact.axes, 1e-9),
    }
    if contact.areas is not None:
        found["areas"] = contact.areas.tolist()
    if contact.places is not None and contact.rows is not None:
        sizes = np.abs(contact.rows).max(axis=(0, 1), initial=0.0)
        steps = np.where(sizes > 0.0, _ROWS * sizes, 1.0)
        extent = float(np.linalg.norm(np.ptp(contact.places, axis=0))) or 1.0
        found |= {"feet": np.asarray(contact.feet, dtype=int).tolist(),
                  "slides": list(contact.sliding),
                  "places": payload.add(contact.places, 1e-7 * extent),
                  "rows": payload.add(contact.rows, np.tile(steps, (contact.rows.shape[1], 1)))}
    return found


def _plan_table(plan: FacePlan, payload: Payload) -> dict[str, Any]:
    """Facets of the patches of a face in its plan [m], and the lines between patches."""
    step = 1e-4 * float(np.ptp(plan.box, axis=0).max()) or SMALLEST
    return {"corners": payload.add(plan.corners, step), "owner": payload.add(plan.owner),
            "edges": payload.add(plan.edges, step), "labels": plan.labels,
            "box": plan.box.T.ravel().tolist()}


def _alike(contact: DrawnContact) -> list[int]:
    """For each force (n d) that of the nearest earlier node, which is alike; -1 for the first."""
    if contact.places is None:
        return []
    n, d = contact.axes.shape[:2]
    nearest = [int(np.linalg.norm(contact.places[:node] - contact.places[node], axis=1).argmin())
               for node in range(1, n)]
    return [-1] * d + [node * d + k for node in nearest for k in range(d)]


def _touching(run: Trajectory) -> tuple[ContactFace, ...]:
    """Faces that may touch; none where nonlinear springs alone join the bodies."""
    try:
        return touching_faces(run.basis, "contact map")
    except AnalysisError:
        return ()


def painted_ends(contact: DrawnContact) -> dict[str, list[float]]:
    """Values at both ends of the colours of what the contact faces of solids are painted with."""
    assert contact.areas is not None
    largest = float((np.abs(contact.forces[:, :, -1]) / contact.areas).max(initial=0.0))
    return {PRESSURE: [0.0, largest or 1.0], STATE: [-0.5, len(contact.names) - 0.5]}


def state_colours(contact: DrawnContact, shades: int) -> list[list[int]]:
    """Colours of the states, from 0 to 255, as a map of so many shades."""
    colours = [STATE_COLOURS.get(name, _OPEN) for name in contact.names]
    rgb = [[int(colour[at : at + 2], 16) for at in (1, 3, 5)] for colour in colours]
    return [rgb[k * len(rgb) // shades] for k in range(shades)]


def drift_rows(motion: Motion) -> Array:
    """Mean displacement (m,) along wavy ground of the contact nodes on it; zero on flat ground.

    In space (2, m), along x and y.

    A wavy ground is drawn in its true length, so that drift of the bodies along it, ``drift @ q``,
    is not magnified either.
    """
    basis = motion.trajectory.basis
    along = 0 if basis.dimension == 2 else slice(2)
    rows = basis.contact_T[:, along]
    if not (motion.has_ground and motion.trajectory.system.ground.wavy):
        return np.zeros(rows.shape[1:])
    return np.asarray(rows[basis.ground_nodes].mean(axis=0))


def drawn_ground(motion: Motion, box: Sequence[float]) -> DrawnGround | None:
    """The ground of a run under bodies in a box [x0, x1, y0, y1, ...]; None without it."""
    if not motion.has_ground:
        return None
    ground, run = motion.trajectory.system.ground, motion.trajectory
    basis, direction = run.basis, np.array(ground.wave_direction)
    way = np.array([ground.travel(float(time)) for time in run.time])
    ends, travel, along = box[:2], way, way
    if basis.dimension == 3:
        across = Ground(speed=ground.speed_y, motion=ground.motion_y)
        travel = np.column_stack([way, [across.travel(float(time)) for time in run.time],
                                  ground.rotation_speed * run.time])
        along = travel[:, :2] @ direction
        # Heights are stored along a direction over the box around the bodies.
        corners = np.array([(x, y) for x in box[:2] for y in box[2:4]]) @ direction
        ends = [float(corners.min()), float(corners.max())]
    profile, first, spacing = np.zeros(1), 0.0, 1.0
    if ground.wavy and ground.height_map is None:
        sides = [] if basis.dimension == 2 else [box[1] - box[0], box[3] - box[2]]
        reach = _BESIDE * max([ends[1] - ends[0], *sides])
        first = ends[0] - reach - float(along.max())
        last = ends[1] + reach - float(along.min())
        wave = ground.shortest_wavelength or (last - first)
        x = np.linspace(first, last, int(np.clip(_PROFILE * (last - first) / wave, 2,
                                                 _MOST_POINTS)))
        profile, spacing = ground.height(x + ground.travel(0.0), 0.0), float(x[1] - x[0])
    places = basis.positions[2 : 2 + basis.contact_nodes]
    found = DrawnGround(float(places[basis.ground_nodes, -1].min()), motion.gap, travel, profile,
                        first, spacing, drift_rows(motion), ground.wave_direction, ground.centre)
    if ground.height_map is None or not ground.wavy:
        return found
    return _with_map(found, ground.height_map, box)


def _with_map(ground: DrawnGround, heights: HeightMap, box: Sequence[float]) -> DrawnGround:
    """Add the part of a map of heights that comes below the bodies, at most one period."""
    lines = []
    beside = _BESIDE * max(box[1] - box[0], box[3] - box[2])
    for axis, count in enumerate(np.shape(heights.heights)):
        spacing = (heights.spacing_x, heights.spacing_y)[axis]
        way = ground.travel[:, axis]
        first = box[2 * axis] - beside - float(way.max())
        size = box[2 * axis + 1] + beside - float(way.min()) - first
        # The map repeats itself: one period is enough.
        size = min(size, count * spacing)
        points = int(np.clip(np.ceil(_MAP * size / spacing), 4, _MOST_OF_MAP))
        lines.append((first, size / points, points))
    x, y = (first + step * np.arange(points) for first, step, points in lines)
    return replace(ground, heights=heights.shape(*np.meshgrid(x, y, indexing="ij"))[..., 0],
                   origin=(lines[0][0], lines[1][0]), steps=(lines[0][1], lines[1][1]))


def ground_table(ground: DrawnGround, payload: Payload) -> dict[str, Any]:
    """The ground: its level, its profile over the travelled way, and its travel."""
    profile, travel = ground.profile, ground.travel
    return {
        "wavy": ground.wavy, "level": ground.level, "gap": ground.gap,
        "profile": payload.add(profile, max(1e-4 * float(np.ptp(profile)), SMALLEST)),
        "first": ground.first, "spacing": ground.spacing,
        "travel": payload.add(travel, max(1e-6 * float(np.abs(travel).max()), SMALLEST)),
        "drift": ground.drift.ravel().tolist(), "direction": ground.direction,
        "centre": ground.centre, "origin": ground.origin, "steps": ground.steps,
        "heights": None if ground.heights is None else payload.add(
            ground.heights, max(1e-4 * float(np.ptp(ground.heights)), SMALLEST)),
    }
