"""Contact nodes on a face of a solid: patches of its facets, or every facet."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.types import Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.partition import grid_partition, partition, parts_of
from fecontact.fem.faces.surface import Patches, Surface

_UP = 1e-9  # of the area

# Contact nodes on a face: their number, one for each facet, or numbers along two directions.
Count = int | Literal["all"] | Sequence[int]


def face_surface(body: ElasticBody, boundary: str) -> Surface:
    """The facets of a named boundary of a solid; MeshError if the mesh has none of that name."""
    return Surface(body.nodes, body.facet_nodes(body.mesh.boundary(boundary)))


def contact_patches(
    surface: Surface, boundary: str, count: Count, key: str = "contact_nodes"
) -> Patches:
    """Patches of nearly equal area, or with 'all' one for each facet.

    Two numbers are those along both directions of the face, see :func:`grid_partition`. ``key``
    names the count in messages.

    Raises
    ------
    InputError
        For fewer patches than connected parts of the face, or more than it has facets; for two
        numbers, if the face has several parts or cannot be cut so.
    """
    facets = len(surface.facets)
    if count == "all":
        return surface.patches(np.arange(facets))
    if isinstance(count, tuple | list):
        return surface.patches(_grid(surface, boundary, count, key))
    least = int(parts_of(surface).max()) + 1
    if isinstance(count, bool) or not isinstance(count, int) or not least <= count <= facets:
        raise InputError(f"{key} = {count!r} must be 'all' or a whole number from {least} to "
                         f"{facets}, the number of facets on boundary '{boundary}'; refine the "
                         f"mesh for more.")
    return surface.patches(partition(surface, count))


def _grid(surface: Surface, boundary: str, counts: Sequence[int], key: str) -> Integers:
    """Patch (k,) of each facet for numbers of patches along both directions."""
    facets, given = len(surface.facets), list(counts)
    if len(given) != 2 or not all(isinstance(one, int) and not isinstance(one, bool) and one > 0
                                  for one in given) or given[0] * given[1] > facets:
        raise InputError(f"{key} = {given} must be two whole numbers above zero, along both "
                         f"directions of boundary '{boundary}', with a product of at most "
                         f"{facets}, its number of facets; refine the mesh for more.")
    if parts_of(surface).any():
        raise InputError(f"{key} = {given} cannot be numbers along both directions, because "
                         f"boundary '{boundary}' has several parts; give each a boundary of its "
                         f"own, or one number.")
    found = grid_partition(surface, given[0], given[1])
    if found is None:
        raise InputError(f"{key} = {given}: the facets of boundary '{boundary}' do not make so "
                         f"many patches along its two directions; refine the mesh, or give one "
                         f"number.")
    return found


def check_facets_down(surface: Surface, boundary: str) -> None:
    """Raise :class:`InputError` unless all facets face the ground below."""
    up = surface.area_vectors[:, 2]
    if -up.sum() < 0.5 * surface.areas.sum() or (up > _UP * surface.areas).any():
        raise InputError(f"Boundary '{boundary}' does not face the ground, which lies below the "
                         f"body (towards -z), with all its facets; turn the mesh or choose another "
                         f"contact boundary.")
