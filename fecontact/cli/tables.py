"""Tables of meshes and runs printed by commands."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.cli.printable import printable
from fecontact.core.units import quantity

if TYPE_CHECKING:
    from fecontact.fem.mesh import Mesh
    from fecontact.integrate.trajectory import Trajectory
    from fecontact.integrate.wear import WearHistory
    from fecontact.reduction.assembly.interface_compliance import InterfaceCompliance
    from fecontact.reduction.modal_basis import ModalBasis
    from fecontact.system.complex_modes import ComplexModes
    from fecontact.system.quasistatic.history import LoadHistory


def table(*headings: str, rows: Iterable[Iterable[str]], left: int = 1) -> Any:
    """Table for the terminal; the first ``left`` columns are left-aligned, the others right.

    Cells are shown as they are, without markup; control characters are escaped.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Column, Table
    from rich.text import Text

    def cell(text: str) -> Text:
        return Text(printable(text))

    result = Table(*(Column(cell(heading)) for heading in headings),
                   box=SIMPLE_HEAD, show_header=any(headings), pad_edge=False)
    for column in result.columns[left:]:
        column.justify = "right"
    for row in rows:
        result.add_row(*map(cell, row))
    return result


def mesh_table(mesh: "Mesh", degree: int) -> Any:
    """Counts, size and groups of a mesh, and the unknowns of finite elements of a degree on it."""
    from fecontact.fem.elastic_body import ElasticBody

    unknowns = ElasticBody(mesh, degree=degree).unknowns
    order = {1: "linear", 2: "quadratic"}[degree]
    return table("", "", rows=[*mesh.summary(),
                               ("unknowns", f"{unknowns}, {order} elements (degree = {degree})")])


def run_table(trajectory: "Trajectory") -> Any:
    """Summary of a run."""
    from fecontact.analysis.run_facts import run_facts

    return table("", "", rows=run_facts(trajectory))


def key_table(trajectory: "Trajectory", points: "Sequence[Any]") -> Any:
    """Key numbers of a run; None for a run that is too short or grew beyond all numbers."""
    from fecontact.analysis.key_numbers import key_numbers

    states = trajectory.states
    if len(states) < 4 or not np.isfinite(states).all():
        return None
    found = key_numbers(trajectory, tuple(point for point in points
                                          if isinstance(point, str | int)))
    begin, end = (quantity(time, "s") for time in found.interval)
    return table(f"from {begin} to {end}", "", rows=found.rows())


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
    from fecontact.reduction.assembly.contact_faces import contact_faces
    from fecontact.system.contact_quantities import total_friction
    from fecontact.system.quasistatic.rest_state import STATES

    faces, rows = contact_faces(basis), dict(history.summary())
    if not faces[0].name:
        return table("", "", rows=rows.items())
    for total in ("at the end", "normal force", "friction force"):
        rows.pop(total)
    found = [("points", rows.pop("points"))]
    for face in faces:
        states, forces = history.contact_state[-1, face.nodes], [
            quantity(value, "N", 4) for value in (
                float(history.normal_force[-1, face.nodes].sum()),
                total_friction(history.friction_forces[-1, face.nodes]))]
        found.append((face.title, "at the end " + ", ".join(
            f"{np.count_nonzero(states == code)} {name}" for code, name in enumerate(STATES))))
        found.append((f"{face.name}: forces", f"normal {forces[0]}, friction {forces[1]}"))
    return table("", "", rows=[*found, *rows.items()])


def wear_table(history: "WearHistory", basis: "ModalBasis") -> Any:
    """Summary of wear, of several bodies with the depth by interface."""
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


def complex_table(modes: "ComplexModes", highest_hz: float) -> Any:
    """Frequencies and damping ratios of complex modes up to a frequency; unstable ones marked."""
    rows = [(str(number), f"{hertz:.6g}", f"{ratio:.3%}", "unstable" if grows else "")
            for number, (hertz, ratio, grows) in enumerate(zip(
                modes.frequencies_hz.tolist(), modes.damping_ratios.tolist(),
                modes.grows.tolist(), strict=True)) if hertz <= highest_hz]
    return table("mode", "frequency [Hz]", "damping", "", rows=rows)


def file_size(path: Path) -> str:
    """Readable size of a file."""
    size = float(path.stat().st_size)
    for unit in ("B", "kB", "MB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.3g} GB"
