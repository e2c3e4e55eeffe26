"""Loads and motions of a path as rows of numbers, and whose motion the travel is."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np

from fecontact.core.checks import whole_number
from fecontact.core.errors import InputError
from fecontact.core.tables import located
from fecontact.core.types import Array
from fecontact.core.units import listed
from fecontact.laws.excitation import PointLoad
from fecontact.laws.signals.harmonic import Constant
from fecontact.system.arrays import with_motions
from fecontact.system.contact_system import ContactSystem
from fecontact.system.interfaces import MotionSource, motion_sources
from fecontact.system.nodes import SystemArrays
from fecontact.system.quasistatic.path import LoadPath


def with_named_forces(system: ContactSystem, path: LoadPath) -> tuple[ContactSystem, LoadPath]:
    """The system with all forces that a path names, and the path with their values in order.

    Forces that the system lacks get their values at the end of the path, so that it rests there.
    InputError for a point or a component that does not exist.
    """
    if not isinstance(path.forces, Mapping):
        return system, path
    basis, left = system.basis, dict(path.forces)
    forces, values = list(system.load.forces), []
    for force in forces:
        value = left.pop(f"{force.point}.{force.component}", None)
        values.append(path.constant_part(_constant(force.signal)) if value is None else value)
    for name, value in left.items():
        point, _, component = name.rpartition(".")
        number = whole_number(point)
        place: str | int = point if number is None else number
        with located(f"LoadPath: forces.{name}:"):
            basis.point_row(place, component)
        at_end = value[-1] if isinstance(value, tuple) else float(value or 0.0)
        forces.append(PointLoad(place, cast(Any, component), signal=at_end))
        values.append(value)
    return (system.with_(load=replace(system.load, forces=tuple(forces))),
            replace(path, forces=tuple(values)))


def given_rows(system: ContactSystem, path: LoadPath) -> Array:
    """Rows (N, m + 2 d - 1) of a path: modal forces of the loads, driven ends, travel.

    InputError for another number of forces than the system has, motions in space of a plane body,
    and a travel that could be that of several sides.
    """
    arrays, forces, own = system.arrays, system.load.forces, path.forces
    assert not isinstance(own, Mapping)
    d = system.basis.dimension
    scale = path.at_points(path.load_scale)
    loads = np.outer(scale, arrays.constant_load)
    if own is not None and len(own) != len(forces):
        raise InputError(f"LoadPath: forces has {len(own)} entries, but the system has "
                         f"{len(forces)} in load.forces; give one for each, or name them.")
    for k, signal in enumerate(system.load.signals.values()):
        value = (scale * _constant(signal) if own is None or k >= len(forces)
                 else path.at_points(own[k]))
        loads += np.outer(value, arrays.load_shapes[k])
    if d == 2:
        for name in ("motion_z", "travel_y"):
            if getattr(path, name) is not None:
                raise InputError(f"LoadPath: {name} is for solids, but the body is plane; leave "
                                 f"it out.")
    ends = [scale * _constant(motion) if end is None else path.at_points(end)
            for end, motion in zip((path.motion_x, path.motion_y, path.motion_z)[:d],
                                   system.drive.motions[:d], strict=True)]
    travel = [path.at_points(path.travel), path.at_points(path.travel_y or 0.0)][: d - 1]
    _require_one_side(system, path, travel)
    return np.ascontiguousarray(np.column_stack([loads, *ends, *travel]))


def travelling(system: ContactSystem) -> SystemArrays:
    """Arrays of a system of which the travel of paths is the motion of the other sides.

    In space the first motion is that of the ground along x, or of the one interface that slides
    along its velocity; the second one is that of the ground along y.
    """
    basis = system.basis
    if basis.dimension == 2:
        return system.arrays
    factors = np.zeros((2, basis.contact_nodes, 2))
    ground, sliding = _sides(system)
    if not sliding:
        for by, source in zip(factors, ground, strict=False):
            by[source.nodes] = source.along
    elif not ground and len(sliding) == 1:
        factors[0, sliding[0].nodes] = sliding[0].along
    return with_motions(system.arrays, factors)


def travelled(system: ContactSystem, travel: Array) -> Array:
    """Distance (n,), in space (n, 2), that the other side of each node has travelled [m]."""
    found = travelling(system).sliding[:, :, : len(travel)] @ travel
    return np.asarray(found[:, 0] if len(travel) == 1 else found)


def travel_forces(system: ContactSystem, forces: Array) -> Array:
    """Forces (..., k) on the body along the travels, of nodes (..., n, k) against tangents [N]."""
    k = forces.shape[-1]
    return -np.einsum("...jt,jtk->...k", forces, travelling(system).sliding[:, :, :k])


def _sides(system: ContactSystem) -> tuple[list[MotionSource], list[MotionSource]]:
    """Motion sources of the ground, and of the interfaces that slide."""
    sources = motion_sources(system.basis, system.ground, system.sliding)
    count = len(sources) - len(system.sliding)
    return sources[:count], sources[count:]


def _require_one_side(system: ContactSystem, path: LoadPath, travel: list[Array]) -> None:
    ground, sliding = _sides(system)
    sides = [source.what for source in (*ground[:1], *sliding)]
    if any(one.any() for one in travel) and len(sides) > 1:
        raise InputError(f"load_history: travel moves one side, but the system has "
                         f"{listed(sides)}; leave out the sliding of interfaces that rest.")
    if path.travel_y is not None and sliding:
        raise InputError(f"LoadPath: travel_y is that of the ground, but {sides[0]} goes along its "
                         f"own direction; give travel, and that direction to the interface.")


def _constant(source: Any) -> float:
    """Constant part of a signal."""
    return float(source.value) if isinstance(source, Constant) else 0.0
