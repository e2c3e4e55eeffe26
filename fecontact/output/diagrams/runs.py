"""Diagrams of a run: motions, forces and energies over time, and phase planes."""

from collections.abc import Sequence

import numpy as np

from fecontact.analysis.histories import Point, is_displaced, is_relative, point_name, usual_point
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.output.diagrams.colours import COLOURS, ENERGY_COLOURS, distinct_colours
from fecontact.output.diagrams.diagram import WIDTH, Curve, Diagram, Level
from fecontact.reduction.assembly.contact_faces import contact_faces, several_bodies

AXES = ("x", "y", "z")
# Title of each diagram of energies, attribute of their sum, attributes of the terms.
_ENERGIES = (
    ("stored energy", "stored", ("kinetic", "elastic", "drive_spring", "contact", "bristles")),
    ("work put in", "work", ("drive_work", "belt_normal_work", "belt_friction_work", "load_work",
                             "circulatory_work", "bristle_work")),
    ("energy lost", "lost", ("modal_damping", "dashpots", "contact_damping", "friction")),
)
_PALE = "#b8b4ad"
_FLAT = 1e-9  # of the largest motion, below which a curve is round-off
_MOST_MIDDLES = 5  # contact nodes shown by default
_FASTEST = 5.0  # largest ground speed shown in a phase plane, as a multiple of the body's velocity
_TIME = "time [s]"


def motion_diagrams(
    run: Trajectory, points: Sequence[Point]
) -> dict[tuple[str, int], Diagram]:
    """Displacements and velocities of points, by their name and the number of their axis.

    Without the curves of points that do not move along an axis.
    """
    d = run.basis.dimension
    motions = {what: [getattr(run, what)(point)[:, :d] for point in points]
               for what in ("displacement", "velocity")}
    names, colours = [labelled(point, run) for point in points], distinct_colours(len(points))
    found: dict[tuple[str, int], Diagram] = {}
    for (what, values), unit in zip(motions.items(), ("m", "m/s"), strict=True):
        largest = max((float(np.abs(one).max()) for one in values), default=0.0)
        for axis in range(d):
            found[what, axis] = _over_time(run, f"{what} {AXES[axis]} [{unit}]", tuple(
                Curve(name, colour, run.time, one[:, axis], WIDTH if number else 2.0)
                for number, (name, colour, one) in enumerate(zip(names, colours, values,
                                                                 strict=True))
                if np.abs(one[:, axis]).max() > _FLAT * largest))
    return found


def force_diagrams(run: Trajectory) -> list[Diagram]:
    """Total normal force of each face, then their total friction, along tangents or its size."""
    faces, basis = contact_faces(run.basis), run.basis
    if not basis.contact_nodes:
        return []
    single = not faces[0].name
    colours = [""] if single else distinct_colours(len(faces))

    def of_faces(title: str, values: Array) -> Diagram:
        return _over_time(run, f"{title} [N]", tuple(
            Curve(face.name, colour, run.time, values[:, face.nodes].sum(axis=1))
            for face, colour in zip(faces, colours, strict=True)))

    normal = of_faces("total normal force", run.normal_force)
    along = -run.friction_forces
    if basis.dimension == 2:
        return [normal, of_faces(f"total friction on the body, +{'x' if single else 't'}",
                                 along[:, :, 0])]
    totals = [np.einsum("fnk,nkd->fd", along[:, face.nodes], basis.tangents[face.nodes])
              for face in faces]
    if single:
        size = np.linalg.norm(totals[0], axis=1)
        return [normal, _over_time(run, "total friction on the body [N]", (
            Curve("size", _PALE, run.time, size, 2.4), Curve("x", "", run.time, totals[0][:, 0]),
            Curve("y", COLOURS[1], run.time, totals[0][:, 1])))]
    sizes = _over_time(run, "size of total friction [N]", tuple(
        Curve(face.name, colour, run.time, np.linalg.norm(total, axis=1))
        for face, colour, total in zip(faces, colours, totals, strict=True)))
    ways = ("t", "t2") if several_bodies(basis) else ("x", "y")
    return [normal, sizes, *(of_faces(f"total friction on the body, +{way}", along[:, :, k])
                             for k, way in enumerate(ways))]


def forces_on_body_diagram(run: Trajectory, width: float = WIDTH) -> Diagram:
    """Sums of the normal forces and of the friction on the body over time, in one diagram.

    Friction is along +x in the plane and along x and y in space. Of several bodies each interface
    has its sums along its normals and tangents, in space the size of its friction.
    """
    basis, normal = run.basis, run.normal_force
    faces, space = contact_faces(basis), basis.dimension == 3
    along = (-np.einsum("fnk,nkd->fnd", run.friction_forces, basis.tangents) if space
             else -run.friction_forces)
    curves: list[Curve] = []
    if not faces[0].name:
        curves.append(Curve("normal" if space else "normal force", "", run.time,
                            normal.sum(axis=1), width))
        named = (("friction x", COLOURS[0]), ("friction y", COLOURS[1])) if space else (
            ("friction on the body, +x", COLOURS[3]),)
        curves += [Curve(name, colour, run.time, along[:, :, axis].sum(axis=1), width)
                   for axis, (name, colour) in enumerate(named) if along[:, :, axis].any()]
        return _over_time(run, "total [N]", tuple(curves))
    for face, colour in zip(faces, distinct_colours(len(faces)), strict=True):
        curves.append(Curve(f"{face.name}: normal", colour, run.time,
                            normal[:, face.nodes].sum(axis=1), width))
        total = along[:, face.nodes].sum(axis=1)
        if along[:, face.nodes].any():
            curves.append(Curve(
                f"{face.name}: friction", colour, run.time,
                np.linalg.norm(total, axis=1) if space else total[:, 0], width,
                dashed=True))
    return _over_time(run, "total [N]", tuple(curves))


def energy_diagrams(run: Trajectory) -> list[Diagram]:
    """Stored energy, work put in and energy lost, each with its terms and total.

    Without terms that stay zero, and without diagrams of such terms alone.
    """
    energies = run.energies
    found: list[Diagram] = []
    for title, total, names in _ENERGIES:
        terms = {name: getattr(energies, name) for name in names}
        curves = [Curve(name.removesuffix("_work").replace("_", " "), ENERGY_COLOURS[name],
                        run.time, term)
                  for name, term in terms.items() if term.any()]
        if curves or not found:
            found.append(_over_time(run, f"{title} [J]", (
                *curves, Curve("total", "", run.time, getattr(energies, total), 1.8))))
    # Without drive, friction and damping nothing is put in or lost.
    shown = [one for one in found if len(one.curves) > 1]
    return shown or found[:1]


def labelled(point: Point, run: Trajectory) -> str:
    """Name of a point, and whether its motion is relative to another body."""
    basis = run.basis
    way = ", relative (t, n)" if basis.dimension == 2 else ", relative (t, t2, n)"
    return point_name(point, basis) + way * is_relative(point, basis)


def phase_diagram(run: Trajectory, point: Point, axis: int, curve: Curve | None = None) -> Diagram:
    """Velocity of a point over its displacement along an axis, by its number.

    The end of the run is marked, and the speed of the ground where it is not much larger than the
    velocities. A ``curve`` is drawn in the place of the end and the ground.
    """
    x, v = run.displacement(point)[:, axis], run.velocity(point)[:, axis]
    motion = (Curve("", COLOURS[0], x, v, 1.0) if curve is None else
              Curve("motion", "#b9c4cc", x, v, 0.6))
    second = curve or Curve("end of the run", COLOURS[1], x[-1:], v[-1:], 0.0, marker=6.0)
    speed = 0.0 if curve else ground_speed(run, axis)
    shown = 0.0 < abs(speed) <= _FASTEST * float(np.abs(v).max())
    return Diagram(f"displacement {AXES[axis]} [m]", f"velocity {AXES[axis]} [m/s]",
                   (motion, second), title=labelled(point, run),
                   levels=(Level(speed, name="ground", dashed=True),) if shown else ())


def ground_speed(run: Trajectory, axis: int) -> float:
    """Steady speed of the ground along an axis [m/s]; zero where it has none everywhere."""
    ground, d = run.system.ground, run.basis.dimension
    if ground.rotation_speed or axis == d - 1:
        return 0.0
    if axis == 0:
        return ground.speed if ground.motion is None else 0.0
    return ground.speed_y if ground.motion_y is None else 0.0


def usual_points(run: Trajectory) -> tuple[Point, ...]:
    """Point B if it moves and the middle contact node of each face, or the default point."""
    basis = run.basis
    middles = [(face.nodes.start + face.nodes.stop) // 2 for face in contact_faces(basis)
               if face.nodes.stop > face.nodes.start]
    found = (*(("B",) if is_displaced("B", basis) else ()), *middles[:_MOST_MIDDLES])
    return found or (usual_point(basis),)


def _over_time(run: Trajectory, label: str, curves: tuple[Curve, ...]) -> Diagram:
    ends = (float(run.time[0]), float(run.time[-1])) if len(run.time) > 1 else (None, None)
    return Diagram(_TIME, label, curves, x_limits=ends)
