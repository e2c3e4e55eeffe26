"""Plain arrays that the player of a page draws, in the plane (d = 2) and in space (d = 3).

In space the axis z points away from the ground.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components, depth_first_order

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import numbered_rows, unordered
from fecontact.fem.faces.surface import as_triangles
from fecontact.output.files.contact_facets import contact_facets
from fecontact.output.render.frames_data import body_labels
from fecontact.output.render.surfaces import sharp_edges
from fecontact.reduction.assembly.contact_faces import mode_names
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import ModeShapes
from fecontact.reduction.report import BasisReport

# Stresses in their order, in the plane and in space.
COMPONENTS = {4: ("xx", "yy", "zz", "xy"), 6: ("xx", "yy", "zz", "xy", "yz", "zx")}


@dataclass(frozen=True, eq=False)
class DrawnBodies:
    """Bodies and their modes.

    Attributes
    ----------
    nodes : (P, d) array
        Places at rest [m].
    triangles : (k, 3) integer array
        Between these nodes: all of a plane body, the surface of one in space.
    edges : (e, 2) integer array
        Lines on them.
    shapes : (P, d, m) array
        Mode shapes.
    stress : (P, c, m + p) array
        Stresses of the modes and of p products of their coordinates [Pa per unit coordinate],
        ``COMPONENTS[c]``.
    modes : list of (str, str, str, str)
        Name, frequency in Hz, damping ratio and kind of each mode, as text.
    labels : tuple of (str, int)
        Names of several bodies and the nodes at which they are written.
    owners : (P,) integer array or None
        In space the contact node to whose patch each node belongs, -1 for none. Nodes between
        patches are there for each; triangles of patches come last.
    """

    nodes: Array
    triangles: Integers
    edges: Integers
    shapes: Array
    stress: Array
    modes: list[list[str]]
    labels: tuple[tuple[str, int], ...] = ()
    owners: Integers | None = None

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Whether each triangle (k,) is part of a patch."""
        if self.owners is None:
            return np.zeros(len(self.triangles), dtype=bool)
        return np.asarray((self.owners[self.triangles] >= 0).all(axis=1))

    @property
    def dimension(self) -> int:
        """Dimension of the space, 2 or 3."""
        return int(self.nodes.shape[1])

    @property
    def extent(self) -> float:
        """Diagonal of the box around them [m]."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Names of the stresses."""
        return COMPONENTS[self.stress.shape[1]]


def drawn_bodies(basis: ModalBasis) -> DrawnBodies:
    """The bodies of a basis with mode shapes."""
    field = basis.mode_shapes
    assert field is not None
    ratios = [f"{50.0 * rate / w:.3g} %" if w > 0.0 else ""
              for rate, w in zip(np.diag(basis.damping), basis.angular_frequencies, strict=True)]
    # Vibration modes and modes that complete the bases of several bodies are not distinguished.
    kinds = [kind if kind == "rigid" or not basis.parts else ""
             for kind in BasisReport(basis).kinds]
    modes = [[name, f"{hz:.6g}", ratio, kind] for name, hz, ratio, kind in zip(
        mode_names(basis), basis.frequencies_hz, ratios, kinds, strict=True)]
    # Rigid modes without the round-off of their stresses.
    stress = field.stress_terms.copy()
    stress[..., : basis.modes] *= basis.angular_frequencies > 0.0
    if basis.dimension == 3:
        return along_edges(_drawn_solids(basis, field, stress, modes))
    return DrawnBodies(field.nodes, as_triangles(field.cells), field.outline, field.shapes, stress,
                       modes, body_labels(basis))


def _drawn_solids(
    basis: ModalBasis, field: ModeShapes, stress: Array, modes: list[list[str]]
) -> DrawnBodies:
    """The surface of solids, whose patches have nodes of their own."""
    facets, n = field.outline, basis.contact_nodes
    patches = contact_facets(basis)
    # Places of the facets of patches in the outline, by their nodes.
    number = numbered_rows(unordered(np.concatenate([facets, patches.facets])))[1]
    found = np.full(number.max() + 1, -1)
    found[number[len(facets):]] = patches.owner
    owner = found[number[: len(facets)]]
    corners = as_triangles(facets)
    triangle_owner = np.repeat(owner, len(corners) // len(facets))
    key, inverse = np.unique(corners * (n + 1) + triangle_owner[:, None] + 1, return_inverse=True)
    node, owners = key // (n + 1), key % (n + 1) - 1
    vertex = np.zeros(len(field.nodes), dtype=np.int64)
    vertex[node[::-1]] = np.arange(len(node))[::-1]
    return DrawnBodies(
        field.nodes[node], inverse.reshape(corners.shape),
        vertex[sharp_edges(field.nodes, corners)], field.shapes[node], stress[node], modes,
        _labels_on(basis, field.nodes[node], node), owners)


def _labels_on(
    basis: ModalBasis, places: Array, node: Integers
) -> tuple[tuple[str, int], ...]:
    """Names of several bodies and the nodes of the surface next to the middles of their tops."""
    found = []
    for part in basis.parts:
        own = np.flatnonzero((part.nodes[0] <= node) & (node < sum(part.nodes)))
        if not len(own):
            continue
        low, high = places[own].min(axis=0), places[own].max(axis=0)
        top = np.array([*0.5 * (low + high)[:2], high[2]])
        found.append((part.name, int(own[np.linalg.norm(places[own] - top, axis=1).argmin()])))
    return tuple(found)


def along_edges(bodies: DrawnBodies) -> DrawnBodies:
    """Renumber the nodes of the bodies by a walk along edges of their triangles.

    Triangles of patches stay behind the others.

    Fields differ little from one node to the next, which halves the size of large surfaces.
    """
    count = len(bodies.nodes)
    pairs = bodies.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    graph = sp.csr_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(count, count))
    order: list[int] = []
    parts, labels = connected_components(graph, directed=False)
    for first in [int(np.argmax(labels == part)) for part in range(parts)]:
        order += depth_first_order(graph, first, directed=False, return_predecessors=False).tolist()
    place = np.argsort(order)
    triangles = place[bodies.triangles]
    owners = None if bodies.owners is None else bodies.owners[order]
    return replace(
        bodies, nodes=bodies.nodes[order], shapes=bodies.shapes[order],
        stress=bodies.stress[order], edges=place[bodies.edges],
        triangles=triangles[np.lexsort((triangles.min(axis=1), bodies.touching))], owners=owners,
        labels=tuple((name, int(place[node])) for name, node in bodies.labels))
