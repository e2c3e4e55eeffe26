"""Contact of a page: places, states and forces of the contact nodes, and the ground."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import to_rgba_array

from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array, Integers
from fecontact.integrate.trajectory import Trajectory
from fecontact.laws.ground.ground import Ground
from fecontact.laws.ground.height_map import HeightMap
from fecontact.output.diagrams.colours import STATE_COLOURS
from fecontact.output.files.frames import contact_forces
from fecontact.output.plots.solids.plans import FacePlan, face_plan
from fecontact.output.plots.style import state_names
from fecontact.output.render.frames_data import Motion, ground_travel
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


def contact_of_run(run: Trajectory, motion: Motion | None, payload: Payload) -> dict[str, Any]:
    """Contact nodes of a run; with a motion to draw also where they and their feet are."""
    basis, names = run.basis, state_names(run)
    tangents, normals = contact_directions(basis)
    solid = basis.dimension == 3
    axes = (np.concatenate([tangents, normals[:, None]], axis=1) if solid
            else np.stack([tangents, normals], axis=1))
    faces = [{"title": face.title or "contact", "label": face.label, "first": face.nodes.start,
              "abscissa": face.abscissa.tolist(), "sizes": face.tributary.tolist()}
             | ({"plan": _plan_table(face_plan(basis, face), payload)} if solid else {})
             for face in _touching(run)]
    drawn: dict[str, Any] = {} if motion is None else {"placed": motion.contact_rows}
    found = contact_table(axes, np.einsum("tnk,nik->tni", contact_forces(run), axes),
                          np.minimum(run.contact_state, len(names) - 1), names, payload, **drawn)
    found |= {"faces": faces}
    if solid:
        found["areas"] = basis.tributary.tolist()
    if motion is not None:
        found |= {"feet": motion.footed.tolist(), "slides": list(motion.sliding)}
    return found


def contact_table(
    axes: Array, forces: Array, states: Integers, names: Sequence[str], payload: Payload,
    placed: tuple[Array, Array] | None = None,
) -> dict[str, Any]:
    """Contact nodes with their states (N, n) and forces at all times.

    ``forces`` (N, n, d) are those along the ``axes`` (n, d, d) of the nodes [N]. Where bodies are
    drawn, ``placed`` are where the nodes and their feet on other bodies are, (n + f, d) [m], and
    their displacements per modal coordinate, (n + f, d, m).
    """
    largest = float(np.linalg.norm(forces, axis=2).max(initial=0.0))
    # Errors of all components at once.
    step = max(2.0 * _FORCE * largest / np.sqrt(forces.shape[2]), SMALLEST)
    near = [] if placed is None else _alike(axes, placed[0])
    found: dict[str, Any] = {
        "states": list(names), "colours": [STATE_COLOURS.get(name, "") for name in names],
        "state": payload.add(states, later=True),
        "forces": payload.add(forces, step, later=True, near=near),
        "largest": largest, "axes": payload.add(axes, 1e-9), "feet": [],
    }
    if placed is not None:
        places, rows = placed
        sizes = np.abs(rows).max(axis=(0, 1), initial=0.0)
        steps = np.where(sizes > 0.0, _ROWS * sizes, 1.0)
        extent = float(np.linalg.norm(np.ptp(places, axis=0))) or 1.0
        found |= {"places": payload.add(places, 1e-7 * extent),
                  "rows": payload.add(rows, np.tile(steps, (rows.shape[1], 1)))}
    return found


def _plan_table(plan: FacePlan, payload: Payload) -> dict[str, Any]:
    """Facets of the patches of a face in its plan [m], and the lines between patches."""
    step = 1e-4 * float(np.ptp(plan.box, axis=0).max()) or SMALLEST
    return {"corners": payload.add(plan.corners, step), "owner": payload.add(plan.owner),
            "edges": payload.add(plan.edges, step), "labels": plan.labels,
            "box": plan.box.T.ravel().tolist()}


def _alike(axes: Array, places: Array) -> list[int]:
    """For each force (n d) that of the nearest earlier node, which is alike; -1 for the first."""
    n, d = axes.shape[:2]
    nearest = [int(np.linalg.norm(places[:node] - places[node], axis=1).argmin())
               for node in range(1, n)]
    return [-1] * d + [node * d + k for node in nearest for k in range(d)]


def _touching(run: Trajectory) -> tuple[ContactFace, ...]:
    """Faces that may touch; none where nonlinear springs alone join the bodies."""
    try:
        return touching_faces(run.basis, "contact map")
    except AnalysisError:
        return ()


def state_colours(contact: dict[str, Any], shades: int) -> list[list[int]]:
    """Colours of the states, from 0 to 255, as a map of so many shades."""
    rgb = to_rgba_array([colour or _OPEN for colour in contact["colours"]])[:, :3]
    which = np.arange(shades) * len(rgb) // shades
    return np.rint(255.0 * rgb[which]).astype(int).tolist()


def ground_table(motion: Motion, box: Array, payload: Payload) -> dict[str, Any] | None:
    """The ground of a run under bodies in a box (2, d); None without it.

    Its height is ``profile(x - travel)`` above its level, the lowest contact node at rest. In space
    x is the distance along ``direction``, or a map has heights over x and y, and ``travel`` is
    along x and y and about ``centre`` [rad].
    """
    if not motion.has_ground:
        return None
    ground, run, basis = motion.trajectory.system.ground, motion.trajectory, motion.trajectory.basis
    d = basis.dimension
    way = ground_travel(ground, run.time)
    travel = np.column_stack([way, ground.rotation_speed * run.time]) if d == 3 else way[:, 0]
    found: dict[str, Any] = {"profile": np.zeros(1), "heights": None, "first": 0.0, "spacing": 1.0,
                             "origin": (0.0, 0.0), "steps": (1.0, 1.0)}
    if ground.wavy and ground.height_map is not None:
        found |= _height_map(ground.height_map, box, way)
    elif ground.wavy:
        found |= _profile(ground, box, way[:, : d - 1])
    for name in ("profile", "heights"):
        if (values := found[name]) is not None:
            found[name] = payload.add(values, max(1e-4 * float(np.ptp(values)), SMALLEST))
    return found | {
        "wavy": ground.wavy, "gap": motion.gap, "direction": ground.wave_direction,
        "level": float(basis.contact_places[basis.ground_nodes, -1].min()),
        "travel": payload.add(travel, max(1e-6 * float(np.abs(travel).max()), SMALLEST)),
        "drift": motion.drift.ravel().tolist(), "centre": ground.centre,
    }


def _profile(ground: Ground, box: Array, way: Array) -> dict[str, Any]:
    """Heights along the direction of the waves over the box around the bodies."""
    direction = np.array(ground.wave_direction)[: way.shape[1]]
    ends = np.stack(np.meshgrid(*box[:, : way.shape[1]].T), axis=-1) @ direction
    along = way @ direction
    reach = _BESIDE * max(float(np.ptp(ends)), *np.ptp(box[:, : way.shape[1]], axis=0))
    first, last = ends.min() - reach - along.max(), ends.max() + reach - along.min()
    wave = ground.shortest_wavelength or (last - first)
    count = int(np.clip(_PROFILE * (last - first) / wave, 2, _MOST_POINTS))
    x = np.linspace(first, last, count)
    return {"profile": ground.height(x + ground.travel(0.0), 0.0), "first": float(first),
            "spacing": float(x[1] - x[0])}


def _height_map(heights: HeightMap, box: Array, way: Array) -> dict[str, Any]:
    """The part of a map of heights that comes below the bodies, at most one period."""
    spacing = np.array([heights.spacing_x, heights.spacing_y])
    beside = _BESIDE * np.ptp(box[:, :2], axis=0).max()
    first = box[0, :2] - beside - way.max(axis=0)
    # The map repeats itself: one period is enough.
    size = np.minimum(box[1, :2] + beside - way.min(axis=0) - first,
                      np.shape(heights.heights) * spacing)
    points = np.clip(np.ceil(_MAP * size / spacing), 4, _MOST_OF_MAP)
    steps = size / points
    x, y = (first[k] + steps[k] * np.arange(points[k]) for k in (0, 1))
    return {"heights": heights.shape(*np.meshgrid(x, y, indexing="ij"))[..., 0],
            "origin": first.tolist(), "steps": steps.tolist()}
