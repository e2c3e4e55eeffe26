"""Plans of contact faces of solids: their patches laid flat, for maps of what acts on them.

Flat faces are seen along their normals, from the body through its face: on the ground x points to
the right and y up. Faces around an axis, as those of bushes, are unrolled.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.core.units import suitable_unit
from fecontact.fem.faces.frames import tangents_of
from fecontact.output.files.contact_facets import ContactFacets, contact_facets
from fecontact.reduction.assembly.contact_faces import ContactFace, shown_faces
from fecontact.reduction.modal_basis import ModalBasis

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROUND = 0.5  # length of the mean normal below which a face goes around an axis
_ALIGNED = 1e-6
_BORDER = "#303030"
# The longest arrow, in distances of neighbouring patches, and of the shorter side of the face.
_REACH, _MOST = 1.3, 0.45


@dataclass(frozen=True, eq=False)
class FacePlan:
    """A contact face laid flat.

    Attributes
    ----------
    face : ContactFace
    corners : (f, c, 2) array
        Facets of its patches in the plan [m], all counter-clockwise.
    owner : (f,) integer array
        Patch of each facet, counted from 0 on this face.
    edges : (e, 2, 2) array
        Lines between patches and around the face [m].
    places : (k, 2) array
        Middles of the patches [m].
    axes : (k, 2, 3) array
        Unit vectors of the plan's two axes at each patch.
    labels : (str, str)
        Names of the axes.
    """

    face: ContactFace
    corners: Array
    owner: Integers
    edges: Array
    places: Array
    axes: Array
    labels: tuple[str, str]

    @cached_property
    def box(self) -> Array:
        """Least and largest coordinates (2, 2) [m]."""
        return np.stack([self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))])

    @property
    def unit(self) -> tuple[float, str]:
        """Factor and symbol of the unit in which it is drawn."""
        return suitable_unit(float(np.abs(self.box).max()), "m")

    @property
    def aspect(self) -> float:
        """Width by height."""
        width, height = self.box[1] - self.box[0]
        return float(width / height)

    @cached_property
    def spacing(self) -> float:
        """Mean distance of neighbouring patches [m]."""
        side = np.roll(self.corners, -1, axis=1)
        area = 0.5 * np.abs((self.corners[..., 0] * side[..., 1]
                             - self.corners[..., 1] * side[..., 0]).sum(axis=1)).sum()
        return float(np.sqrt(area / len(self.places)))

    def directions(self, vectors: Array) -> Array:
        """Components (..., k, 2) along the axes of vectors (..., k, 3) at the patches."""
        return np.einsum("kad,...kd->...ka", self.axes, vectors)

    def paths(self, factor: float) -> list[Any]:
        """Outlines of the patches as paths of matplotlib, places divided by ``factor``."""
        from matplotlib.path import Path

        c = self.corners.shape[1]
        order = np.argsort(self.owner, kind="stable")
        closed = np.concatenate([self.corners, self.corners[:, :1]], axis=1)[order] / factor
        codes = np.array([Path.MOVETO, *[Path.LINETO] * (c - 1), Path.CLOSEPOLY])
        ends = np.searchsorted(self.owner[order], np.arange(len(self.places) + 1))
        return [Path(closed[first:end].reshape(-1, 2), np.tile(codes, end - first))
                for first, end in pairwise(ends.tolist())]


def face_plans(basis: ModalBasis, what: str) -> tuple[FacePlan, ...]:
    """Plans of the contact faces of solids, on which ``what`` is shown.

    Without shapes over the body patches are squares of their areas.
    """
    faces = shown_faces(basis, what)
    patches = None if basis.mode_shapes is None else contact_facets(basis).patches
    return tuple(face_plan(basis, face, patches) for face in faces)


def face_plan(
    basis: ModalBasis, face: ContactFace, patches: ContactFacets | None = None
) -> FacePlan:
    """Plan of one contact face of solids; ``patches`` are those of all faces."""
    if basis.mode_shapes is None:
        return _of_squares(basis, face)
    patches = contact_facets(basis).patches if patches is None else patches
    inside = (face.nodes.start <= patches.owner) & (patches.owner < face.nodes.stop)
    owner = patches.owner[inside] - face.nodes.start
    if len(np.unique(owner)) < face.nodes.stop - face.nodes.start:
        return _of_squares(basis, face)
    facets = patches.facets[inside]
    return _plan(basis, face, basis.mode_shapes.nodes[facets], owner, facets)


def _of_squares(basis: ModalBasis, face: ContactFace) -> FacePlan:
    """A plan of squares of the areas of the nodes, no wider than their least distance."""
    from scipy.spatial.distance import pdist

    places = basis.contact_places[face.nodes]
    side = np.sqrt(basis.contact_areas[face.nodes])
    if len(places) > 1 and (least := float(pdist(places).min())) > 0.0:
        side = np.minimum(side, least)
    t, t2 = np.swapaxes(basis.tangents[face.nodes], 0, 1)
    around = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    corners = np.stack([places + 0.5 * side[:, None] * (a * t + b * t2) for a, b in around], axis=1)
    number = np.arange(4 * len(places)).reshape(-1, 4)
    return _plan(basis, face, corners, np.arange(len(places)), number)


def _plan(
    basis: ModalBasis, face: ContactFace, corners: Array, owner: Integers, facets: Integers
) -> FacePlan:
    normals, count = basis.normals[face.nodes], face.nodes.stop - face.nodes.start
    share = basis.contact_areas[face.nodes]
    mean = share @ normals / share.sum()
    if np.linalg.norm(mean) >= _ROUND:
        axes = tangents_of((mean / np.linalg.norm(mean))[None])
        flat = corners @ axes[0].T
        labels = _name(axes[0, 0], "t"), _name(axes[0, 1], "t2")
        axes = np.repeat(axes, count, axis=0)
    else:
        flat, axes = _unrolled(corners, owner, basis.contact_places[face.nodes], normals, share)
        labels = "along the circumference", "along the axis"
    # Facets are counter-clockwise seen from outside the body, here one looks from inside.
    middles = flat.mean(axis=1)
    sums = np.zeros((count, 2))
    np.add.at(sums, owner, middles)
    places = sums / np.bincount(owner, minlength=count)[:, None]
    return FacePlan(face, flat[:, ::-1], owner, _edges(flat, owner, facets), places, axes, labels)


def _unrolled(
    corners: Array, owner: Integers, places: Array, normals: Array, share: Array
) -> tuple[Array, Array]:
    """Places (f, c, 2) on the circumference and along the axis, and axes (k, 2, 3)."""
    axis = np.linalg.eigh((normals * share[:, None]).T @ normals)[1][:, 0]
    first, second = tangents_of(axis[None])[0]
    # The axis is where the normals meet.
    plane = np.stack([first, second])
    at, looks = places @ plane.T, normals @ plane.T
    looks = looks / np.linalg.norm(looks, axis=1, keepdims=True)
    across = np.stack([-looks[:, 1], looks[:, 0]], axis=1)
    centre = np.linalg.lstsq(across, (across * at).sum(axis=1), rcond=None)[0]
    arms = at - centre
    angle = np.arctan2(arms[:, 1], arms[:, 0])
    radius = float(np.linalg.norm(arms, axis=1).mean())
    ordered = np.sort(angle)
    gaps = np.append(np.diff(ordered), ordered[0] + 2.0 * np.pi - ordered[-1])
    widest = int(gaps.argmax())
    angle = np.mod(angle - ordered[widest] - 0.5 * gaps[widest], 2.0 * np.pi) - np.pi
    turn = ordered[widest] + 0.5 * gaps[widest] + np.pi
    arms = corners @ plane.T - centre
    around = np.arctan2(arms[..., 1], arms[..., 0]) - turn
    middle = angle[owner][:, None]
    around = middle + np.mod(around - middle + np.pi, 2.0 * np.pi) - np.pi
    flat = np.stack([radius * around, corners @ axis], axis=-1)
    at = angle + turn
    along = -np.sin(at)[:, None] * first + np.cos(at)[:, None] * second
    return flat, np.stack([along, np.tile(axis, (len(places), 1))], axis=1)


def _name(direction: Array, name: str) -> str:
    """``x`` for a direction along that axis, ``-x`` against it, else the given name."""
    k = int(np.abs(direction).argmax())
    if abs(direction[k]) < 1.0 - _ALIGNED:
        return name
    return ("-" if direction[k] < 0.0 else "") + "xyz"[k]


def _edges(flat: Array, owner: Integers, facets: Integers) -> Array:
    """Sides (e, 2, 2) of facets that no other facet of the same patch shares."""
    count = facets.shape[1]
    ends = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    rows = np.column_stack([ends, np.repeat(owner, count)])
    _, first, times = np.unique(rows, axis=0, return_index=True, return_counts=True)
    lines = np.stack([flat, np.roll(flat, -1, axis=1)], axis=2).reshape(-1, 2, 2)
    return np.asarray(lines[first[times == 1]])


def draw_plan(axes: "Axes", plan: FacePlan, *, line: float = 0.6, frame: bool = True) -> Any:
    """Draw patches and their borders, and return the patches, a collection of matplotlib.

    With ``frame`` the axes have labels with units.
    """
    from matplotlib.collections import LineCollection, PathCollection

    factor, symbol = plan.unit
    patches = PathCollection(plan.paths(factor), linewidths=0.0, zorder=1.0)
    axes.add_collection(patches)
    axes.add_collection(LineCollection(list(plan.edges / factor), colors=_BORDER,
                                       linewidths=line, zorder=2.0, capstyle="round"))
    low, high = plan.box / factor
    margin = 0.03 * (high - low).max()
    axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin),
             aspect="equal")
    axes.grid(False)
    if frame:
        axes.set_xlabel(f"{plan.labels[0]} [{symbol}]")
        axes.set_ylabel(f"{plan.labels[1]} [{symbol}]")
    return patches


def draw_arrows(
    axes: "Axes", plan: FacePlan, arrows: Array, largest: float, *, line: float = 0.5
) -> Any:
    """Draw arrows (k, 2) from the middles of the patches, scaled by the largest; returns them."""
    factor = plan.unit[0]
    reach = min(_REACH * plan.spacing, _MOST * float(np.ptp(plan.box, axis=0).min())) / factor
    drawn = axes.quiver(*(plan.places / factor).T, *arrows.T, angles="xy", scale_units="xy",
                        scale=largest / reach, color="white", edgecolor=_BORDER, linewidth=line,
                        width=0.10 * reach, units="xy", headwidth=3.6, headlength=4.2,
                        headaxislength=3.8, minlength=0.02, zorder=3.0, clip_on=False)
    # Arrows that reach beyond a face must not shrink the other axes.
    drawn.set_in_layout(False)
    return drawn
