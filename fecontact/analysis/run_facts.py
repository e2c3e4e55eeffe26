"""The main facts of a run as pairs of name and text, and sentences on its limitations."""

import numpy as np

from fecontact.analysis.histories import how_to_observe, observes_motion
from fecontact.core.units import quantity
from fecontact.integrate.event_table import Events
from fecontact.integrate.trajectory import Status, Trajectory
from fecontact.reduction.assembly.contact_faces import contact_faces, several_bodies
from fecontact.system.contact_quantities import ContactState

ROUGH_SLOPE = 0.3  # of the ground, above which friction along x is a rough assumption


def run_facts(trajectory: Trajectory) -> list[tuple[str, str]]:
    """Duration, steps, energy balance, largest displacement and shares of the contact states."""
    size, place = largest_displacement(trajectory)
    time, statistics = trajectory.time, trajectory.statistics
    seconds = statistics.get("seconds", 0.0)
    return [
        ("time", f"{quantity(float(time[0]), 's')} ... {quantity(float(time[-1]), 's')}"),
        (("steps", f"{statistics['steps']} in {seconds:.1f} s") if "steps" in statistics else
         ("computed", f"in {seconds:.1f} s")),
        ("energy imbalance", f"{trajectory.energies.imbalance:.1e} of the largest energy"),
        *(() if trajectory.events is None else (("events", _events(trajectory.events)),)),
        ("largest displacement", f"{quantity(size, 'm')} at {place}"),
        *_contact_rows(trajectory),
    ]


def _contact_rows(trajectory: Trajectory) -> list[tuple[str, str]]:
    """Bodies, if there are several, and shares of the contact states, for each interface."""
    basis = trajectory.basis
    if not several_bodies(basis):
        shares = contact_shares(trajectory) if basis.contact_nodes else {}
        return [(f"contact {name}", f"{100.0 * share:.1f} %") for name, share in shares.items()]
    rows = [("bodies", dict(basis.summary()).get("bodies", "1"))]
    for face in contact_faces(basis) if basis.contact_nodes else ():
        if face.spring:
            force = np.abs(trajectory.normal_force[:, face.nodes]).max()
            rows.append((face.title, f"nonlinear spring, at most {quantity(float(force), 'N')}"))
            continue
        shares = contact_shares(trajectory, face.nodes)
        rows.append((face.title, f"{len(face.abscissa)} nodes, " + ", ".join(
            f"{100.0 * share:.1f} % {name}" for name, share in shares.items())))
    return rows


def _events(events: Events) -> str:
    """Numbers of events by kind."""
    kinds = dict.fromkeys(events.kind)
    return ", ".join(f"{events.kind.count(kind)} {kind}" for kind in kinds) or "none"


def largest_displacement(trajectory: Trajectory) -> tuple[float, str]:
    """Largest displacement [m] of the bodies at all output times, and where it occurs."""
    basis, q = trajectory.basis, trajectory.modal_coordinates
    if basis.mode_shapes is not None:
        shapes, places = basis.mode_shapes.shapes, basis.mode_shapes.nodes
    else:
        used = basis.moving_points
        shapes, places = basis.T[used, : basis.dimension], basis.positions[used]
    rows = shapes.reshape(-1, basis.modes).T
    best, node = 0.0, 0
    for block in np.array_split(q, max(1, q.shape[0] * rows.shape[1] // 2**21)):
        motion = np.linalg.norm((block @ rows).reshape(len(block), -1, basis.dimension),
                                axis=2).max(axis=0)
        if motion.max() > best:
            best, node = float(motion.max()), int(motion.argmax())
    body = [f" of {part.name}" for part in basis.parts
            if basis.mode_shapes is not None and part.nodes[0] <= node < sum(part.nodes)]
    where = ", ".join(f"{axis} = {at:.4g} m" for axis, at in zip(
        "xyz", places[node].tolist(), strict=False))
    return best, where + "".join(body)


def contact_shares(trajectory: Trajectory, nodes: slice = slice(None)) -> dict[str, float]:
    """Fractions of time and contact face of some nodes that are open, in stick and in slip.

    Without friction forces they are open or closed.
    """
    weight = trajectory.basis.tributary[nodes]
    states = trajectory.contact_state[:, nodes]
    found = {state.name.lower(): float(((states == state) @ (weight / weight.sum())).mean())
             for state in ContactState}
    if trajectory.friction_force.any():
        return found
    return {"open": found["open"], "closed": found["stick"] + found["slip"]}


def notes(trajectory: Trajectory) -> list[str]:
    """Sentences on limitations of the result."""
    found = []
    if trajectory.status is not Status.FINISHED:
        message = trajectory.statistics.get("message")
        found.append(trajectory.status.value + (f" {message}" if message else ""))
    if not observes_motion(trajectory.basis):
        found.append(f"No moving point of the body is observed: amplitudes and plots of motions "
                     f"are left out; {how_to_observe(trajectory.basis)}.")
    ground = trajectory.system.ground
    slope = ground.steepest_slope
    if slope > ROUGH_SLOPE:
        along = "x" if trajectory.basis.dimension == 2 else "the level ground"
        what = (f"friction acts along {along}" if ground.normal == "surface" else
                f"the contact force is vertical and friction acts along {along}")
        found.append(f"The ground's slope reaches {slope:.2f}; above {ROUGH_SLOPE} it is a rough "
                     f"assumption that {what}.")
    return found
