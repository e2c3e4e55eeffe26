"""Histories of a run by name, such as the displacement x of B or the friction force of node 3."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.types import Array
from fecontact.integrate.trajectory import Trajectory
from fecontact.reduction.assembly.contact_faces import node_name
from fecontact.reduction.modal_basis import ModalBasis

if TYPE_CHECKING:
    from fecontact.system.contact_system import ContactSystem

Point = str | int | tuple[float, ...]

_OF_POINTS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
_OF_NODES = {"normal_force": "N", "friction_force": "N", "penetration": "m",
             "penetration_rate": "m/s", "slip_velocity": "m/s", "line_load": "N/m",
             "pressure": "Pa", "friction_work": "J"}
_TOTALS = {"total_normal_force": "normal_force", "total_friction_force": "friction_force",
           "total_friction_work": "friction_work"}

QUANTITIES = (*_OF_POINTS, *_OF_NODES, *_TOTALS)


class History(NamedTuple):
    """One quantity of a run over its output times.

    values : (N,)
    unit : SI unit
    title : display text, such as ``velocity x of B``
    """

    values: Array
    unit: str
    title: str


def history(
    trajectory: Trajectory, quantity: str = "displacement", point: Point | None = None,
    component: str = "x",
) -> History:
    """A quantity of a run at one point over time.

    Parameters
    ----------
    trajectory : Trajectory
        The run.
    quantity : str
        'displacement', 'velocity' or 'acceleration' of any point; 'normal_force', 'friction_force',
        'penetration', 'penetration_rate', 'slip_velocity', 'line_load', 'pressure' or
        'friction_work' of a contact node; 'total_normal_force', 'total_friction_force' or
        'total_friction_work' of the whole face.
    point : str, int, (x, y) or (x, y, z), optional
        See :meth:`Trajectory.displacement`; by default the first that moves of B, the middle
        contact node, C and the other named points.
    component : 'x', 'y' or 'phi', of solids also 'z', 'phi_x', 'phi_y', 'phi_z'
        Component of motions of points: tangential, normal, or rotation. Contact nodes
        of several bodies move relative to the other side, along their tangents and normals.

    Raises
    ------
    InputError
        For a quantity, point or component that does not exist, and for a contact quantity at a
        point that is not a contact node; for the pressure, if the basis has no thickness. Without
        a point, if no point of the basis moves.
    """
    require_kind("history", Trajectory, trajectory=trajectory)
    unit = quantity_unit(quantity, component)
    title, basis = quantity.replace("_", " "), trajectory.basis
    point = usual_point(basis) if point is None else point
    if quantity in _TOTALS:
        return History(getattr(trajectory, _TOTALS[quantity]).sum(axis=1), unit, title)
    if quantity in _OF_NODES:
        if isinstance(point, bool) or not isinstance(point, int | np.integer):
            raise InputError(f"The {title} is one of contact nodes, not of point = {point!r}; give "
                             f"the number of a node, from 0 to "
                             f"{basis.contact_nodes - 1}.")
        node = basis.point_index(int(point)) - 2
        return History(getattr(trajectory, quantity)[:, node], unit,
                       f"{title} of {point_name(point, basis)}")
    motion = getattr(trajectory, quantity)(point)
    components = basis.components[: motion.shape[1]]
    if component not in components:
        raise InputError(f"component = {component!r} is not one of {point_name(point, basis)}; "
                         f"choose from {choices(components)}.")
    if is_relative(point, basis):
        title = f"relative {title}"
        ways = {"x": "along t", "y": "along n"} if basis.dimension == 2 else {
            "x": "along t", "y": "along t2", "z": "along n"}
        way = ways.get(component, component)
    else:
        way = component
    return History(motion[:, components.index(component)], unit,
                   f"{title} {way} of {point_name(point, basis)}")


def quantity_unit(quantity: str, component: str = "x") -> str:
    """SI unit of a quantity of :func:`history`; InputError for one that is not known."""
    if quantity not in QUANTITIES:
        raise InputError(f"quantity = {quantity!r} is not known{nearest(str(quantity), QUANTITIES)}"
                         f"; choose from {choices(QUANTITIES)}.")
    turns = quantity in _OF_POINTS and component.startswith("phi")
    unit = {**_OF_POINTS, **_OF_NODES}[_TOTALS.get(quantity, quantity)]
    return unit.replace("m", "rad") if turns else unit


def usual_point(basis: ModalBasis, *others: ModalBasis) -> str | int:
    """Default point: the first that moves of B, the middle contact node, C, other named points.

    It moves in all bases if there is such a point.

    Raises
    ------
    InputError
        If the first basis observes no motion.
    """
    require_observed_motion(basis)
    middle = [basis.contact_nodes // 2] if basis.contact_nodes else []
    points: tuple[str | int, ...] = ("B", *middle, "C", *basis.extra)
    moving = [one for one in points if is_displaced(one, basis)]
    return next((one for one in moving if all(is_displaced(one, other) for other in others)),
                moving[0] if moving else "B")


def observes_motion(basis: ModalBasis) -> bool:
    """Return True if some mode moves or turns a point of a basis."""
    return bool(basis.T.any())


def require_observed_motion(basis: ModalBasis) -> None:
    """Raise InputError if no mode moves or turns a point of a basis."""
    if not observes_motion(basis):
        raise InputError(f"No moving point of the body is observed; {how_to_observe(basis)}.")


def how_to_observe(basis: ModalBasis) -> str:
    """How a study observes a point, as the end of a sentence."""
    place = ", ".join("xyz"[: basis.dimension])
    return f"name one by points = {{ tip = [{place}] }} of [basis], with its coordinates in m"


def is_displaced(point: str | int, basis: ModalBasis) -> bool:
    """Return True if a basis has a point that some mode displaces; rotations do not count."""
    if point not in ("B", "C", *range(basis.contact_nodes), *basis.extra):
        return False
    return bool(basis.T[basis.point_index(point), : basis.dimension].any())


def usual_component(system: "ContactSystem") -> str:
    """Component in which a system moves most: the one that alone is driven or excited, else x.

    Varying forces count where nothing is driven.
    """
    drive = system.drive
    if not any(drive.moves):
        # A system has loaded the compiler already, which stored runs do without.
        from fecontact.laws.signals.harmonic import Constant

        along = {force.component for force in system.load.forces
                 if not isinstance(force.signal, Constant)}
        return next((axis for axis in "yz" if along == {axis}), "x")
    if drive.stiffness_z > 0.0 and not (drive.stiffness_x or drive.stiffness_y):
        return "z"
    return "y" if drive.stiffness_y > 0.0 and drive.stiffness_x == 0.0 else "x"


def component_of(run: Trajectory) -> str:
    """Component in which the system of a run moves most, see :func:`usual_component`."""
    return (run.recorded and run.recorded.component) or usual_component(run.system)


def is_relative(point: Point, basis: ModalBasis) -> bool:
    """Whether the motion of a point is that of a contact node relative to another body."""
    return isinstance(point, int | np.integer) and not basis.ground_nodes[point]


def point_name(point: Point, basis: ModalBasis | None = None) -> str:
    """Display name of a point: ``B``, ``contact node 3``, ``(0.1, 0.02) m``.

    In a basis of several bodies ``pad.tip``, and ``shoe: node 3`` of an interface.
    """
    if isinstance(point, str):
        return point
    if isinstance(point, int | np.integer):
        return f"contact node {point}" if basis is None else node_name(basis, int(point))
    return f"({', '.join(f'{place:g}' for place in point)}) m"
