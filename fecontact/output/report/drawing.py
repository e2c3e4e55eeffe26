"""What the player of a page draws, as plain arrays: the same in the plane and in space.

In the plane d = 2, in space d = 3; there the axis z points away from the ground.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components, depth_first_order

from fecontact.core.types import Array, Integers
from fecontact.output.render.frames_data import body_labels
from fecontact.reduction.assembly.contact_faces import mode_names
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.report import BasisReport

# Stresses in their order, in the plane and in space.
COMPONENTS = {4: ("xx", "yy", "zz", "xy"), 6: ("xx", "yy", "zz", "xy", "yz", "zx")}

_SHARP = 0.85  # cosine of the angle of two triangles whose common edge is drawn


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
    stress : (P, c, m) array
        Stresses of the modes [Pa per unit coordinate], ``COMPONENTS[c]``.
    modes : list of (str, str, str, str)
        Name, frequency in Hz, damping ratio and kind of each mode, as text.
    labels : tuple of (str, int)
        Names of several bodies and the nodes at which they are written.
    """

    nodes: Array
    triangles: Integers
    edges: Integers
    shapes: Array
    stress: Array
    modes: list[list[str]]
    labels: tuple[tuple[str, int], ...] = ()

    @property
    def dimension(self) -> int:
        """Of the space that they lie in."""
        return int(self.nodes.shape[1])

    @property
    def extent(self) -> float:
        """Diagonal of the box around them [m]."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Names of the stresses."""
        return COMPONENTS[self.stress.shape[1]]


@dataclass(frozen=True, eq=False)
class DrawnContact:
    """Contact nodes over N times; feet are their other sides on bodies.

    Attributes
    ----------
    faces : list of dict
        Title, label of the abscissa, first node, abscissae and tributary sizes of each face; in
        space ``plan`` (2, k) are the places of its nodes in the tangent plane.
    axes : (n, d, d) array
        Unit vectors of each node: one tangent or two, then the normal.
    forces : (N, n, d) array
        On the body along these axes [N].
    states : (N, n) integer array
        Numbers of ``names``.
    names : tuple of str
    places : (n + f, d) array or None
        Of contact nodes and feet [m]; None where no body is drawn.
    rows : (n + f, d, m) array or None
        Their displacements per modal coordinate.
    feet : (f,) integer array
        Contact nodes of the feet.
    sliding : tuple of str
        What slides by prescription.
    """

    faces: list[dict[str, object]]
    axes: Array
    forces: Array
    states: NDArray[np.integer]
    names: tuple[str, ...]
    places: Array | None = None
    rows: Array | None = None
    feet: Integers | tuple[int, ...] = ()
    sliding: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class DrawnGround:
    """The ground below the bodies: its height is ``profile(x - travel)`` above its level.

    Attributes
    ----------
    level : float
        Height of the lowest contact node at rest [m].
    gap : float
        Smallest gap below the contact nodes [m].
    travel : (N,) array
        In +x at all times [m].
    profile : (k,) array
        Heights [m] at equal distances; one zero for flat ground.
    first, spacing : float
        Abscissa of the first height, and distance [m].
    drift : (m,) array
        Mean displacement of the contact nodes in x per modal coordinate, which wavy ground, drawn
        in its true length, does not magnify; zero on flat ground.
    """

    level: float
    gap: float
    travel: Array
    profile: Array
    first: float
    spacing: float
    drift: Array

    @property
    def wavy(self) -> bool:
        """Whether it has waves."""
        return len(self.profile) > 1


def drawn_bodies(basis: ModalBasis) -> DrawnBodies:
    """The bodies of a basis with mode shapes."""
    field = basis.mode_shapes
    assert field is not None
    ratios = [f"{50.0 * rate / w:.3g} %" if w > 0.0 else ""
              for rate, w in zip(np.diag(basis.damping), basis.angular_frequencies, strict=True)]
    # The modes that complete the bases of several bodies are not told from vibrations.
    kinds = [kind if kind == "rigid" or not basis.parts else ""
             for kind in BasisReport(basis).kinds]
    modes = [[name, f"{hz:.6g}", ratio, kind] for name, hz, ratio, kind in zip(
        mode_names(basis), basis.frequencies_hz, ratios, kinds, strict=True)]
    # Rigid modes without the round-off of their stresses.
    stress = field.stress * (basis.angular_frequencies > 0.0)
    return DrawnBodies(field.nodes, as_triangles(field.cells), field.outline, field.shapes, stress,
                       modes, body_labels(basis))


def as_triangles(facets: Integers) -> Integers:
    """Triangles (k, 3) of facets (f, 3) or (f, 4), one facet after the other.

    Plane bodies that overlap are drawn in turn.
    """
    if facets.shape[1] == 3:
        return facets
    return facets[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)


def along_edges(bodies: DrawnBodies) -> DrawnBodies:
    """The same bodies with their nodes in the order of a walk along edges of their triangles.

    Fields differ little from one node to the next, so that large surfaces take half of the room.
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
    return replace(
        bodies, nodes=bodies.nodes[order], shapes=bodies.shapes[order],
        stress=bodies.stress[order], edges=place[bodies.edges],
        triangles=triangles[np.argsort(triangles.min(axis=1), kind="stable")],
        labels=tuple((name, int(place[node])) for name, node in bodies.labels))


def sharp_edges(nodes: Array, triangles: Integers) -> Integers:
    """Edges (e, 2) of a surface in space where it ends or bends by more than 30 degrees."""
    corners = nodes[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    pairs = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    found, which, counts = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    of_edge = np.argsort(which.ravel(), kind="stable") // 3
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    second = np.where(counts == 2, first + 1, first)
    bent = (normals[of_edge[first]] * normals[of_edge[second]]).sum(axis=1) < _SHARP
    return found[bent | (counts != 2)]
