"""Tables of meshes and runs printed by commands."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from fecontact.fem.mesh import Mesh
    from fecontact.integrate.events import Events
    from fecontact.integrate.trajectory import Trajectory
    from fecontact.integrate.wear import WearHistory
    from fecontact.reduction.assembly.interface_compliance import InterfaceCompliance
    from fecontact.reduction.modal_basis import ModalBasis
    from fecontact.system.complex_modes import ComplexModes
    from fecontact.system.quasistatic.history import LoadHistory

ROUGH_SLOPE = 0.3  # of the ground, above which friction along x is a rough assumption


def table(*headings: str, rows: Iterable[Iterable[str]], left: int = 1) -> Any:
    """Table for the terminal; the first ``left`` columns are left-aligned, the others right."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    result = Table(*headings, box=SIMPLE_HEAD, show_header=any(headings), pad_edge=False)
    for column in result.columns[left:]:
        column.justify = "right"
    for row in rows:
        result.add_row(*row)
    return result


def mesh_table(mesh: "Mesh") -> Any:
    """Counts, size and groups of a mesh."""
    return table("", "", rows=mesh.summary())


def run_table(trajectory: "Trajectory") -> Any:
    """Summary of a run."""
    from fecontact.core.units import quantity

    size, place = largest_displacement(trajectory)
    time, statistics = trajectory.time, trajectory.statistics
    seconds = statistics.get("seconds", 0.0)
    rows = [
        ("time", f"{quantity(float(time[0]), 's')} ... {quantity(float(time[-1]), 's')}"),
        (("steps", f"{statistics['steps']} in {seconds:.1f} s") if "steps" in statistics else
         ("computed", f"in {seconds:.1f} s")),
        ("energy imbalance", f"{trajectory.energies.imbalance:.1e}"),
        *(() if trajectory.events is None else (("events", _events(trajectory.events)),)),
        ("largest displacement", f"{quantity(size, 'm')} at {place}"),
        *_contact_rows(trajectory),
    ]
    return table("", "", rows=rows)


def _contact_rows(trajectory: "Trajectory") -> list[tuple[str, str]]:
    """Shares of the contact states, of several bodies for each interface with its nodes."""
    from fecontact.core.units import quantity
    from fecontact.reduction.assembly.contact_faces import contact_faces

    basis = trajectory.system.basis
    faces = contact_faces(basis)
    if not faces[0].name:
        shares = contact_shares(trajectory)
        return [(f"contact {name}", f"{100.0 * share:.1f} %") for name, share in shares.items()]
    rows = [("bodies", dict(basis.summary()).get("bodies", "1"))]
    for face in faces:
        if face.spring:
            force = np.abs(trajectory.normal_force[:, face.nodes]).max()
            rows.append((face.title, f"nonlinear spring, at most {quantity(force, 'N')}"))
            continue
        shares = contact_shares(trajectory, face.nodes)
        rows.append((face.title, f"{len(face.abscissa)} nodes, " + ", ".join(
            f"{100.0 * share:.1f} % {name}" for name, share in shares.items())))
    return rows


def compliance_table(interfaces: "Iterable[InterfaceCompliance]") -> Any:
    """Parts of the static compliance of interfaces that the modes resolve, in per cent."""
    rows = []
    for one in interfaces:
        figures = [f"{100.0 * part:.2f}" for axis in (1, 0) for part in (
            one.uniform[axis], one.nodes[:, axis].mean(), one.nodes[:, axis].min())]
        rows.append((one.name, f"{len(one.nodes)}", *figures))
    return table("interface", "nodes", "pressure", "mean", "worst", "traction", "mean", "worst",
                 rows=rows)


def preload_table(history: "LoadHistory", basis: "ModalBasis") -> Any:
    """Summary of a history of loading, of several bodies with the states and forces by interface.

    Their sum over faces of different directions would mean nothing.
    """
    from fecontact.core.units import quantity
    from fecontact.reduction.assembly.contact_faces import contact_faces
    from fecontact.system.quasistatic.rest_state import STATES

    faces, rows = contact_faces(basis), dict(history.summary())
    if not faces[0].name:
        return table("", "", rows=rows.items())
    for total in ("at the end", "normal force", "friction force"):
        rows.pop(total)
    found = [("points", rows.pop("points"))]
    for face in faces:
        states, forces = history.contact_state[-1, face.nodes], [
            quantity(float(values[-1, face.nodes].sum()), "N", 4)
            for values in (history.normal_force, history.friction_force)]
        found.append((face.title, "at the end " + ", ".join(
            f"{np.count_nonzero(states == code)} {name}" for code, name in enumerate(STATES))))
        found.append((f"{face.name}: forces", f"normal {forces[0]}, friction {forces[1]}"))
    return table("", "", rows=[*found, *rows.items()])


def wear_table(history: "WearHistory", basis: "ModalBasis") -> Any:
    """Summary of wear, of several bodies with the depth by interface."""
    from fecontact.core.units import quantity
    from fecontact.reduction.assembly.contact_faces import contact_faces

    faces, rows = contact_faces(basis), dict(history.summary())
    if not faces[0].name:
        return table("", "", rows=rows.items())
    rows.pop("depth")
    volume = rows.pop("volume")
    for face in faces:
        depth = history.depth[-1, face.nodes]
        least, most = (quantity(float(value), "m") for value in (depth.min(), depth.max()))
        place = quantity(float(face.abscissa[depth.argmax()]), "m")
        rows[face.title] = f"{least} ... {most}, most at {face.axis} = {place}"
    return table("", "", rows=[*rows.items(), ("volume", volume)])


def complex_table(modes: "ComplexModes") -> Any:
    """Frequencies and damping ratios of complex modes, and which of them grow."""
    rows = [(str(number), f"{hertz:.6g}", f"{ratio:.3%}", "grows" if grows else "")
            for number, (hertz, ratio, grows) in enumerate(zip(
                modes.frequencies_hz.tolist(), modes.damping_ratios.tolist(),
                modes.grows.tolist(), strict=True))]
    return table("mode", "frequency [Hz]", "damping", "", rows=rows)


def _events(events: "Events") -> str:
    """Numbers of events by kind."""
    kinds = dict.fromkeys(events.kind)
    return ", ".join(f"{events.kind.count(kind)} {kind}" for kind in kinds) or "none"


def largest_displacement(trajectory: "Trajectory") -> tuple[float, str]:
    """Largest displacement [m] of the bodies at all output times, and where it occurs."""
    basis, q = trajectory.system.basis, trajectory.modal_coordinates
    if basis.mode_shapes is not None:
        shapes, places = basis.mode_shapes.shapes, basis.mode_shapes.nodes
    else:
        used = np.abs(basis.T).any(axis=(1, 2))
        shapes, places = basis.T[used, :2], basis.positions[used]
    rows = shapes.reshape(-1, basis.modes).T
    best, node = 0.0, 0
    for block in np.array_split(q, max(1, q.shape[0] * rows.shape[1] // 2**21)):
        motion = np.linalg.norm((block @ rows).reshape(len(block), -1, 2), axis=2).max(axis=0)
        if motion.max() > best:
            best, node = float(motion.max()), int(motion.argmax())
    body = [f" of {part.name}" for part in basis.parts
            if basis.mode_shapes is not None and part.nodes[0] <= node < sum(part.nodes)]
    return best, f"x = {places[node, 0]:.4g} m, y = {places[node, 1]:.4g} m" + "".join(body)


def contact_shares(trajectory: "Trajectory", nodes: slice = slice(None)) -> dict[str, float]:
    """Fractions of time and contact length of some nodes that are open, in stick and in slip."""
    from fecontact.integrate.trajectory import ContactState

    weight = trajectory.system.basis.tributary[nodes]
    states = trajectory.contact_state[:, nodes]
    return {state.name.lower(): float(((states == state) @ (weight / weight.sum())).mean())
            for state in ContactState}


def notes(trajectory: "Trajectory") -> list[str]:
    """Sentences on limitations of the result."""
    from fecontact.integrate.trajectory import Status

    found = []
    if trajectory.status is not Status.FINISHED:
        message = trajectory.statistics.get("message")
        found.append(trajectory.status.value + (f" {message}" if message else ""))
    ground = trajectory.system.ground
    slope = ground.steepest_slope
    if slope > ROUGH_SLOPE:
        what = ("friction acts along x" if ground.normal == "surface" else
                "the contact force is vertical and friction acts along x")
        found.append(f"The ground's slope reaches {slope:.2f}; above {ROUGH_SLOPE} it is a rough "
                     f"assumption that {what}.")
    return found


def file_size(path: Path) -> str:
    """Readable size of a file."""
    size = float(path.stat().st_size)
    for unit in ("B", "kB", "MB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.3g} GB"
