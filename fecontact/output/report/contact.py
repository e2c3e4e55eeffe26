"""Contact of a page: places, states and forces of the contact nodes, and the ground."""

from typing import Any

import numpy as np

from fecontact.core.errors import AnalysisError
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.frames import contact_forces
from fecontact.output.plots.style import STATE_COLOURS, state_names
from fecontact.output.render.frames_data import Motion
from fecontact.output.report.bodies import TOLERANCE
from fecontact.output.report.payload import SMALLEST, Payload
from fecontact.reduction.assembly.contact_faces import (
    ContactFace,
    contact_directions,
    touching_faces,
)

_FORCE = 1e-4  # step of forces, of the largest
_PROFILE = 24  # points of the ground's profile per wave
_MOST_POINTS = 20_000  # of the profile
_BESIDE = 0.6  # ground drawn on either side of the bodies, of their width


def contact_table(run: Trajectory, motion: Motion | None, payload: Payload) -> dict[str, Any]:
    """Contact nodes with their states and forces at all times.

    ``normal`` and ``along`` are the forces (N, n) on the contact nodes along their normals and
    tangents [N]. With a motion to draw, ``places`` and ``rows`` are where these and their ``feet``
    on other bodies are, and their displacements per modal coordinate.
    """
    basis = run.system.basis
    tangents, normals = contact_directions(basis)
    forces = contact_forces(run)
    normal, along = (np.einsum("tnk,nk->tn", forces, axes) for axes in (normals, tangents))
    largest = float(np.linalg.norm(forces, axis=2).max(initial=0.0))
    step = max(_FORCE * largest, SMALLEST)
    names = state_names(run)
    found: dict[str, Any] = {
        "faces": [{"title": face.title or "contact", "label": face.label,
                   "first": face.nodes.start, "abscissa": face.abscissa.tolist(),
                   "lengths": face.tributary.tolist()} for face in _touching(run)],
        "states": list(names),
        "colours": [STATE_COLOURS.get(name, "") for name in names],
        "state": payload.add(np.minimum(run.contact_state, len(names) - 1)),
        "normal": payload.add(normal, step),
        "along": payload.add(along, step),
        "largest": largest,
        "tangents": tangents.tolist(),
        "normals": normals.tolist(),
    }
    if motion is not None:
        places, rows = motion.contact_rows
        extent = float(np.linalg.norm(np.ptp(motion.mode_shapes.nodes, axis=0)))
        sizes = np.abs(rows).max(axis=(0, 1), initial=0.0)
        steps = np.where(sizes > 0.0, 0.1 * TOLERANCE * sizes, 1.0)
        found |= {"feet": motion.footed.tolist(), "slides": list(motion.sliding),
                  "places": payload.add(places, 1e-7 * extent),
                  "rows": payload.add(rows, np.tile(steps, (rows.shape[1], 1)))}
    return found


def _touching(run: Trajectory) -> tuple[ContactFace, ...]:
    """Faces that may touch; none where nonlinear springs alone join the bodies."""
    try:
        return touching_faces(run.system.basis, "contact map")
    except AnalysisError:
        return ()


def ground_table(motion: Motion, payload: Payload) -> dict[str, Any] | None:
    """The ground: its level, its profile over the travelled way, and its travel; None without it.

    A wavy ground is drawn in its true length, so that drift of the bodies along it, ``drift @ q``,
    is not magnified either.
    """
    if not motion.has_ground:
        return None
    ground, run = motion.trajectory.system.ground, motion.trajectory
    basis = run.system.basis
    travel = np.array([ground.travel(float(time)) for time in run.time])
    profile, first, spacing = np.zeros(1), 0.0, 1.0
    if ground.wavy:
        left, right, _, _ = motion.box
        reach = _BESIDE * (right - left)
        first = left - reach - float(travel.max())
        last = right + reach - float(travel.min())
        wave = ground.shortest_wavelength or (last - first)
        x = np.linspace(first, last, int(np.clip(_PROFILE * (last - first) / wave, 2,
                                                 _MOST_POINTS)))
        profile, spacing = ground.height(x + ground.travel(0.0), 0.0), float(x[1] - x[0])
    nodes = basis.ground_nodes
    drift = basis.contact_T[nodes, 0].mean(axis=0) if ground.wavy else np.zeros(basis.modes)
    return {
        "wavy": ground.wavy,
        "level": float(basis.positions[2 : 2 + basis.contact_nodes, 1][nodes].min()),
        "gap": motion.gap,
        "profile": payload.add(profile, max(1e-4 * float(np.ptp(profile)), SMALLEST)),
        "first": first, "spacing": spacing,
        "travel": payload.add(travel, max(1e-6 * float(np.abs(travel).max()), SMALLEST)),
        "drift": drift.tolist(),
    }
