"""Contact nodes on a face of a solid: patches of its facets, or every facet."""

from typing import Literal

import numpy as np

from fecontact.core.errors import InputError
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.partition import partition, parts_of
from fecontact.fem.faces.surface import Patches, Surface

_UP = 1e-9  # of the area


def face_surface(body: ElasticBody, boundary: str) -> Surface:
    """The facets of a named boundary of a solid; MeshError if the mesh has none of that name."""
    return Surface(body.nodes, body.facet_nodes(body.mesh.boundary(boundary)))


def contact_patches(
    surface: Surface, boundary: str, count: int | Literal["all"], key: str = "contact_nodes"
) -> Patches:
    """Patches of nearly equal area, or with 'all' one for each facet.

    ``key`` names the count in messages.

    Raises
    ------
    InputError
        For fewer patches than connected parts of the face, or more than it has facets.
    """
    facets = len(surface.facets)
    if count == "all":
        return surface.patches(np.arange(facets))
    least = int(parts_of(surface).max()) + 1
    if isinstance(count, bool) or not isinstance(count, int) or not least <= count <= facets:
        raise InputError(f"{key} = {count!r} must be 'all' or a whole number from {least} to "
                         f"{facets}, the number of facets on boundary '{boundary}'; refine the "
                         f"mesh for more.")
    return surface.patches(partition(surface, count))


def check_facets_down(surface: Surface, boundary: str) -> None:
    """Raise :class:`InputError` unless all facets face the ground below."""
    up = surface.area_vectors[:, 2]
    if -up.sum() < 0.5 * surface.areas.sum() or (up > _UP * surface.areas).any():
        raise InputError(f"Boundary '{boundary}' does not face the ground, which lies below the "
                         f"body (towards -z), with all its facets; turn the mesh or choose another "
                         f"contact boundary.")
