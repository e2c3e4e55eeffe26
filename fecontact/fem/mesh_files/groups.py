"""Named boundaries and points of a mesh, from groups of its file, boxes and coordinates."""

from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

import numpy as np

from fecontact.core.errors import InputError, MeshError, choices, nearest
from fecontact.core.types import Array, Coordinates, Integers
from fecontact.fem.attachments import Attachment
from fecontact.fem.constraints import Constraint
from fecontact.fem.interpolation import interpolation
from fecontact.fem.mesh import Mesh
from fecontact.fem.mesh_files.raw import Groups, on_outline

# Opposite corners (x0, y0, x1, y1), or (x0, y0, z0, x1, y1, z1).
Box = tuple[float, float, float, float] | tuple[float, float, float, float, float, float]

_Named = TypeVar("_Named", Constraint, Attachment)

_BOX_TOLERANCE = 1e-6  # of the body's size


def named_boundaries(
    mesh: Mesh, groups: Groups, wanted: Mapping[str, str | Box]
) -> dict[str, Integers]:
    """Boundaries of the file, and those requested under new names.

    Raises
    ------
    MeshError
        If a group does not exist or is not a boundary, or no edge or face lies in a box.
    InputError
        If a boundary is given by neither a name nor four numbers, of a solid six.
    """
    side = "edges" if mesh.dimension == 2 else "faces"
    taken = {source for source in wanted.values() if isinstance(source, str)}
    found = {name: edges for name, edges in groups.boundaries.items() if name not in taken}
    for name, source in wanted.items():
        if not isinstance(source, str):
            found[name] = _facets_in_box(mesh, name, source)
        elif source in groups.boundaries:
            found[name] = groups.boundaries[source]
        elif source in groups.points:
            raise MeshError(f"The group '{source}', asked for as boundary '{name}', holds nodes or "
                            f"{'' if mesh.dimension == 2 else 'edges, or '}{side} inside the body, "
                            f"but a boundary is made of {side} of the outline; the boundaries "
                            f"are: {choices(groups.boundaries)}.")
        elif source in groups.cells:
            raise MeshError(f"The group '{source}', asked for as boundary '{name}', holds cells, "
                            f"but a boundary is made of {side} of the outline; the boundaries "
                            f"are: {choices(groups.boundaries)}.")
        else:
            raise _no_group("boundary", name, source, groups, groups.boundaries)
    return found


def named_points(
    mesh: Mesh, groups: Groups, wanted: Mapping[str, str | Coordinates]
) -> dict[str, Integers]:
    """Points of the file, and those requested under new names.

    Raises
    ------
    MeshError
        If there is no such group, or a place is outside the body.
    InputError
        If a point is given by neither a name nor two numbers.
    """
    taken = {source for source in wanted.values() if isinstance(source, str)}
    found = {name: nodes for name, nodes in groups.points.items() if name not in taken}
    for name, source in wanted.items():
        if not isinstance(source, str):
            found[name] = _node_at(mesh, name, source)
        elif source in groups.points:
            found[name] = groups.points[source]
        elif source in groups.boundaries:
            found[name] = np.unique(groups.boundaries[source])
        else:
            raise _no_group("point", name, source, groups,
                            {**groups.points, **groups.boundaries})
    return found


def named_constraints(
    given: Iterable[_Named], boundaries: Mapping[str, Any], points: Mapping[str, Any]
) -> tuple[_Named, ...]:
    """Constraints or attachments of the file with the new names of its groups."""
    new = {source: name for name, source in (*points.items(), *boundaries.items())
           if isinstance(source, str)}
    return tuple(one.renamed(new) for one in given)


def _no_group(
    kind: str, name: str, source: str, groups: Groups, available: Mapping[str, Any]
) -> MeshError:
    if source in groups.empty:
        return MeshError(f"The group '{source}', asked for as {kind} '{name}', is empty: the file "
                         f"names it, but puts no nodes or edges of the body into it.")
    return MeshError(f"There is no group '{source}', asked for as {kind} '{name}'"
                     f"{nearest(source, available)}; the file's groups are: {choices(available)}.")


def _facets_in_box(mesh: Mesh, name: str, box: Box) -> Integers:
    d = mesh.dimension
    corners = "(x0, y0, x1, y1)" if d == 2 else "(x0, y0, z0, x1, y1, z1)"
    values = _numbers(box, 2 * d, f"Boundary '{name}' must be the name of a group or a box "
                                  f"{corners} in metres")
    low = np.minimum(values[:d], values[d:]) - _BOX_TOLERANCE * mesh.extent
    high = np.maximum(values[:d], values[d:]) + _BOX_TOLERANCE * mesh.extent
    facets = on_outline(mesh, np.all((mesh.nodes >= low) & (mesh.nodes <= high), axis=1))
    if not len(facets):
        raise MeshError(f"Boundary '{name}' is empty: no {'edge' if d == 2 else 'face'} of the "
                        f"outline lies in the box {tuple(values.tolist())}; the body spans "
                        f"{_span(mesh)}.")
    return facets


def _node_at(mesh: Mesh, name: str, place: Coordinates) -> Integers:
    axes = "(x, y)" if mesh.dimension == 2 else "(x, y, z)"
    where = _numbers(place, mesh.dimension, f"Point '{name}' must be the name of a group or a "
                                            f"place {axes} in metres")
    distance = np.linalg.norm(mesh.nodes - where, axis=1)
    node = int(np.argmin(distance))
    around = mesh.nodes[mesh.cells[(mesh.cells == node).any(axis=1)]]
    element_size = np.linalg.norm(np.roll(around, -1, axis=1) - around, axis=2).max()
    if distance[node] > element_size / 2 and not _inside(mesh, where):
        raise _outside(mesh, name, where, float(distance[node]))
    return np.array([node])


def _inside(mesh: Mesh, place: Array) -> bool:
    """True if a place lies in a cell with straight edges."""
    try:
        interpolation(mesh.nodes, mesh.elements, place, "")
    except InputError:
        return False
    return True


def _outside(mesh: Mesh, name: str, place: Array, distance: float) -> MeshError:
    return MeshError(f"Point '{name}' at {tuple(place.tolist())} is outside the body, "
                     f"{distance:.3g} m from the nearest node; the body spans {_span(mesh)}.")


def _numbers(values: Any, count: int, message: str) -> Array:
    try:
        numbers = np.array(values, float)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise InputError(f"{message}, not {values!r}.")
    return numbers


def _span(mesh: Mesh) -> str:
    return ", ".join(f"{axis} = {low:g} ... {high:g} m" for axis, low, high in zip(
        "xyz", mesh.nodes.min(axis=0), mesh.nodes.max(axis=0), strict=False))
