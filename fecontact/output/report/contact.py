"""Contact of a page: places, states and forces of the contact nodes, and the ground."""

from dataclasses import replace
from typing import Any

import numpy as np

from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.files.frames import contact_forces
from fecontact.output.plots.style import STATE_COLOURS, state_names
from fecontact.output.render.frames_data import Motion
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
_BESIDE = 0.6  # ground drawn on either side of the bodies, of their width


def drawn_contact(run: Trajectory, motion: Motion | None) -> DrawnContact:
    """Contact nodes of a run; with a motion to draw also where they and their feet are."""
    axes = np.stack(contact_directions(run.system.basis), axis=1)
    names = state_names(run)
    found = DrawnContact(
        faces=[{"title": face.title or "contact", "label": face.label,
                "first": face.nodes.start, "abscissa": face.abscissa.tolist(),
                "sizes": face.tributary.tolist()} for face in _touching(run)],
        axes=axes, forces=np.einsum("tnk,nik->tni", contact_forces(run), axes),
        states=np.minimum(run.contact_state, len(names) - 1), names=names)
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
        "faces": contact.faces,
        "states": list(contact.names),
        "colours": [STATE_COLOURS.get(name, "") for name in contact.names],
        "state": payload.add(contact.states, later=True),
        "forces": payload.add(contact.forces, step, later=True, near=_alike(contact)),
        "largest": largest,
        "axes": payload.add(contact.axes, 1e-9),
    }
    if contact.places is not None and contact.rows is not None:
        sizes = np.abs(contact.rows).max(axis=(0, 1), initial=0.0)
        steps = np.where(sizes > 0.0, _ROWS * sizes, 1.0)
        extent = float(np.linalg.norm(np.ptp(contact.places, axis=0))) or 1.0
        found |= {"feet": np.asarray(contact.feet, dtype=int).tolist(),
                  "slides": list(contact.sliding),
                  "places": payload.add(contact.places, 1e-7 * extent),
                  "rows": payload.add(contact.rows, np.tile(steps, (contact.rows.shape[1], 1)))}
    return found


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
        return touching_faces(run.system.basis, "contact map")
    except AnalysisError:
        return ()


def drift_rows(motion: Motion) -> Array:
    """Mean displacement (m,) along wavy ground of the contact nodes on it; zero on flat ground.

    A wavy ground is drawn in its true length, so that drift of the bodies along it, ``drift @ q``,
    is not magnified either.
    """
    basis = motion.trajectory.system.basis
    if not (motion.has_ground and motion.trajectory.system.ground.wavy):
        return np.zeros(basis.modes)
    return np.asarray(basis.contact_T[basis.ground_nodes, 0].mean(axis=0))


def drawn_ground(motion: Motion, ends: tuple[float, float]) -> DrawnGround | None:
    """The ground of a run under bodies between two abscissae; None without it."""
    if not motion.has_ground:
        return None
    ground, run = motion.trajectory.system.ground, motion.trajectory
    basis = run.system.basis
    travel = np.array([ground.travel(float(time)) for time in run.time])
    profile, first, spacing = np.zeros(1), 0.0, 1.0
    if ground.wavy:
        reach = _BESIDE * (ends[1] - ends[0])
        first = ends[0] - reach - float(travel.max())
        last = ends[1] + reach - float(travel.min())
        wave = ground.shortest_wavelength or (last - first)
        x = np.linspace(first, last, int(np.clip(_PROFILE * (last - first) / wave, 2,
                                                 _MOST_POINTS)))
        profile, spacing = ground.height(x + ground.travel(0.0), 0.0), float(x[1] - x[0])
    places = basis.positions[2 : 2 + basis.contact_nodes]
    return DrawnGround(float(places[basis.ground_nodes, -1].min()), motion.gap, travel, profile,
                       first, spacing, drift_rows(motion))


def ground_table(ground: DrawnGround, payload: Payload) -> dict[str, Any]:
    """The ground: its level, its profile over the travelled way, and its travel."""
    profile, travel = ground.profile, ground.travel
    return {
        "wavy": ground.wavy, "level": ground.level, "gap": ground.gap,
        "profile": payload.add(profile, max(1e-4 * float(np.ptp(profile)), SMALLEST)),
        "first": ground.first, "spacing": ground.spacing,
        "travel": payload.add(travel, max(1e-6 * float(np.abs(travel).max()), SMALLEST)),
        "drift": ground.drift.tolist(),
    }
