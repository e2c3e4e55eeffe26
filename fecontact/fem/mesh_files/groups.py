"""Named boundaries and points of a mesh, from groups of its file, boxes and coordinates."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fecontact.core.errors import InputError, MeshError, choices, nearest
from fecontact.core.types import Array, Integers
from fecontact.fem.mesh import Mesh
from fecontact.fem.mesh_files.raw import Groups, edges_on_outline

Box = tuple[float, float, float, float]

_BOX_TOLERANCE = 1e-6  # of the body's size


def named_boundaries(
    mesh: Mesh, groups: Groups, wanted: Mapping[str, str | Box]
) -> dict[str, Integers]:
    """Boundaries of the file, and those requested under new names.

    Raises
    ------
    MeshError
        If a group does not exist or is not a boundary, or no edge lies in a box.
    InputError
        If a boundary is given by neither a name nor four numbers.
    """
    taken = {source for source in wanted.values() if isinstance(source, str)}
    found = {name: edges for name, edges in groups.boundaries.items() if name not in taken}
    for name, source in wanted.items():
        if not isinstance(source, str):
            found[name] = _edges_in_box(mesh, name, source)
        elif source in groups.boundaries:
            found[name] = groups.boundaries[source]
        elif source in groups.points:
            raise MeshError(f"The group '{source}', asked for as boundary '{name}', holds nodes or "
                            f"edges inside the body, but a boundary is made of edges of the "
                            f"outline; the boundaries are: {choices(groups.boundaries)}.")
        else:
            raise _no_group("boundary", name, source, groups, groups.boundaries)
    return found


def named_points(
    mesh: Mesh, groups: Groups, wanted: Mapping[str, str | tuple[float, float]]
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


def _no_group(
    kind: str, name: str, source: str, groups: Groups, available: Mapping[str, Any]
) -> MeshError:
    if source in groups.empty:
        return MeshError(f"The group '{source}', asked for as {kind} '{name}', is empty: the file "
                         f"names it, but puts no nodes or edges of the body into it.")
    return MeshError(f"There is no group '{source}', asked for as {kind} '{name}'"
                     f"{nearest(source, available)}; the file's groups are: {choices(available)}.")


def _edges_in_box(mesh: Mesh, name: str, box: Box) -> Integers:
    values = _numbers(box, 4, f"Boundary '{name}' must be the name of a group or a box "
                              f"(x0, y0, x1, y1) in metres")
    low = np.minimum(values[:2], values[2:]) - _BOX_TOLERANCE * mesh.extent
    high = np.maximum(values[:2], values[2:]) + _BOX_TOLERANCE * mesh.extent
    edges = edges_on_outline(mesh, np.all((mesh.nodes >= low) & (mesh.nodes <= high), axis=1))
    if not len(edges):
        raise MeshError(f"Boundary '{name}' is empty: no edge of the outline lies in the box "
                        f"{tuple(values.tolist())}; the body spans {_span(mesh)}.")
    return edges


def _node_at(mesh: Mesh, name: str, place: tuple[float, float]) -> Integers:
    where = _numbers(place, 2, f"Point '{name}' must be the name of a group or a place (x, y) in "
                               f"metres")
    distance = np.linalg.norm(mesh.nodes - where, axis=1)
    node = int(np.argmin(distance))
    corners = mesh.nodes[mesh.cells]
    around = corners[(mesh.cells == node).any(axis=1)]
    element_size = np.linalg.norm(np.roll(around, -1, axis=1) - around, axis=2).max()
    to_next, to_place = np.roll(corners, -1, axis=1) - corners, where - corners
    left = to_next[..., 0] * to_place[..., 1] - to_next[..., 1] * to_place[..., 0]
    inside = bool((left >= 0).all(axis=1).any())
    if not inside and distance[node] > element_size / 2:
        raise MeshError(f"Point '{name}' at {tuple(where.tolist())} is outside the body, "
                        f"{distance[node]:.3g} m from the nearest node; the body spans "
                        f"{_span(mesh)}.")
    return np.array([node])


def _numbers(values: Any, count: int, message: str) -> Array:
    try:
        numbers = np.array(values, float)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise InputError(f"{message}, not {values!r}.")
    return numbers


def _span(mesh: Mesh) -> str:
    (x0, y0), (x1, y1) = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    return f"x = {x0:g} ... {x1:g} m, y = {y0:g} ... {y1:g} m"
