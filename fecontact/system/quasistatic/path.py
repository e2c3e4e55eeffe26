"""Paths of quasi-static loading: loads and motions at vertices, straight lines between."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from fecontact.core.checks import as_count, as_floats
from fecontact.core.errors import InputError, require_finite, shown
from fecontact.core.types import Array
from fecontact.core.units import Unit

Values = float | tuple[float, ...]

_HISTORIES = ("load_scale", "motion_x", "motion_y", "motion_z", "travel", "travel_y")
_OPTIONAL = ("motion_x", "motion_y", "motion_z", "travel_y")
_MOST = 1_000_000


@dataclass(frozen=True)
class LoadPath:
    """A path of loads, drive and ground, without time: values at vertices, linear between.

    Each value is one number, which is held, or one for each vertex; at least one of them is a list.
    Where a drive or load of the system is given in time, its constant part counts (that of a
    ``Constant`` signal; all others have none) unless the path gives its own values.

    Parameters
    ----------
    load_scale : float or list
        Factor of constant loads and constant parts [-].
    forces : mapping of text to float or list, or list of these, optional
        Forces and moments by point and component, ``{"C.x": (0.0, 30.0)}`` [N], [N m]: those of
        the system there, or further ones. Or the values of its ``load.forces``, in their order.
        They are not scaled. ``history.system`` has the further ones with their last values.
    motion_x, motion_y, motion_z : float or list, optional
        Displacements of the driven ends of the springs at B, along z of solids [m].
    travel : float or list
        Travel s of the ground in +x [m], or of the one interface that slides, along its velocity
        [m], [rad].
    travel_y : float or list, optional
        Travel of the ground in +y below solids [m]; zero by default.
    steps : int or list
        Increments between two vertices, of each of the sections if it is a list. They are the
        points at which results are given; increments are cut further where accuracy needs it.

    Raises
    ------
    InputError
        For lists of unequal lengths, fewer than two vertices, values that are not finite, or
        numbers of steps below one.
    """

    load_scale: float | tuple[float, ...] = 1.0
    forces: (tuple[float | tuple[float, ...], ...] | dict[str, float | tuple[float, ...]]
             | None) = None
    motion_x: Annotated[float | tuple[float, ...] | None, Unit("m")] = None
    motion_y: Annotated[float | tuple[float, ...] | None, Unit("m")] = None
    motion_z: Annotated[float | tuple[float, ...] | None, Unit("m")] = field(
        default=None, kw_only=True)
    travel: Annotated[float | tuple[float, ...], Unit("m")] = 0.0
    travel_y: Annotated[float | tuple[float, ...] | None, Unit("m")] = field(
        default=None, kw_only=True)
    steps: int | tuple[int, ...] = 20

    def __post_init__(self) -> None:
        for name in _HISTORIES:
            object.__setattr__(self, name, _values(getattr(self, name), name))
        if isinstance(self.forces, Mapping):
            for name in self.forces:
                if not all(str(name).rpartition(".")):
                    raise InputError(f"LoadPath: forces names {shown(name)}; give a point and a "
                                     f"component of it, such as 'C.x' or '0.y'.")
            object.__setattr__(self, "forces", {
                name: _values(value, f"forces.{name}") for name, value in self.forces.items()})
        elif self.forces is not None:
            if not isinstance(self.forces, tuple | list | np.ndarray):
                raise InputError(f"LoadPath: forces = {shown(self.forces)} must be a mapping "
                                 f"such as {{'C.x': (0.0, 30.0)}}, or a list with one entry for "
                                 f"each of load.forces.")
            object.__setattr__(self, "forces", tuple(
                _values(value, f"forces[{k}]") for k, value in enumerate(self.forces)))
        lengths = {name: len(value) for name, value in self._histories()
                   if isinstance(value, tuple)}
        if not lengths or max(lengths.values()) < 2:
            raise InputError("LoadPath: a path needs at least two vertices; give a list of two "
                             "values or more for load_scale, forces, motion_x, motion_y, motion_z, "
                             "travel or travel_y.")
        if len(set(lengths.values())) > 1:
            given = ", ".join(f"{name} has {length}" for name, length in lengths.items())
            raise InputError(f"LoadPath: all lists need one value for each vertex, but {given}.")
        self._set_steps()

    def _set_steps(self) -> None:
        given = self.steps
        if isinstance(given, tuple | list | np.ndarray):
            counts = tuple(as_count(count, "LoadPath: steps") for count in given)
            if len(counts) != self.vertices - 1:
                raise InputError(f"LoadPath: steps has {len(counts)} values for "
                                 f"{self.vertices - 1} sections between {self.vertices} vertices; "
                                 f"give one number, or one for each section.")
            object.__setattr__(self, "steps", counts)
        else:
            object.__setattr__(self, "steps", as_count(given, "LoadPath: steps"))
        if sum(self.section_steps) > _MOST:
            raise InputError(f"LoadPath: steps = {shown(given)} are {sum(self.section_steps)} "
                             f"increments; at most {_MOST} are possible.")

    def _histories(self) -> list[tuple[str, Values | None]]:
        given = [(name, getattr(self, name)) for name in _HISTORIES]
        forces = self.forces or ()
        if isinstance(forces, Mapping):
            return given + [(f"forces.{name}", value) for name, value in forces.items()]
        return given + [(f"forces[{k}]", value) for k, value in enumerate(forces)]

    def constant_part(self, value: float) -> Values:
        """Constant part of a load at the vertices: the value times the scale."""
        if isinstance(self.load_scale, tuple):
            return tuple(value * scale for scale in self.load_scale)
        return value * self.load_scale

    @property
    def vertices(self) -> int:
        """Number of vertices."""
        return max(len(value) for _, value in self._histories() if isinstance(value, tuple))

    @property
    def section_steps(self) -> tuple[int, ...]:
        """Number of increments of each section between two vertices."""
        if isinstance(self.steps, tuple):
            return self.steps
        return (self.steps,) * (self.vertices - 1)

    @property
    def rows_of_vertices(self) -> tuple[int, ...]:
        """Number of each vertex among all points of the path."""
        return (0, *np.cumsum(self.section_steps).tolist())

    def at_points(self, values: Values) -> Array:
        """Values (N,) at all points of the path, of values that are held or given at vertices."""
        at_vertices = np.broadcast_to(np.asarray(values, dtype=float), (self.vertices,))
        return np.interp(np.arange(self.rows_of_vertices[-1] + 1), self.rows_of_vertices,
                         at_vertices)


def _values(given: object, name: str) -> Values | None:
    """One number or a tuple of them."""
    if given is None and name in _OPTIONAL:
        return None
    array = as_floats(given, f"LoadPath: {name}")
    if array.ndim > 1 or not array.size:
        raise InputError(f"LoadPath: {name} = {shown(given)} must be a number or a list of "
                         f"numbers, one for each vertex.")
    for value in array.reshape(-1).tolist():
        require_finite("LoadPath", **{name: value})
    return tuple(array.tolist()) if array.ndim else float(array)
