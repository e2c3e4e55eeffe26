"""Pairing of faces of solids: patches of the one, their feet on the facets of the other.

Every quadrature point of a face looks for the closest place of the other one, where the line
between them is normal to the facet there. The foot of a contact node is the mean of those of its
points, its displacement their mean, interpolated by the shape functions of the facets, so that
opposite forces are uniform traction on the patch and the same traction on the other face. Points
without a partner do not count to the area of their patch.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError
from fecontact.core.types import Array, Integers
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.faces.contact_patches import (
    Count,
    check_facets_down,
    contact_patches,
    face_surface,
)
from fecontact.fem.faces.facets import closest_local
from fecontact.fem.faces.frames import tangents_of
from fecontact.fem.faces.surface import Patches, Surface, functions_at
from fecontact.fem.pairing_report import PairingReport, closed_gaps
from fecontact.fem.points import node_matrix

_COUNT = "pair_faces: nodes"
_FACING = 0.1  # least cosine between opposed normals: 84 degrees
_SLACK = 1e-3  # of a facet: how far a place may lie beside the other face
_NEAREST = 24  # facets among which the closest place is looked for
_LEAST = 0.25  # of the points of a facet that must have a partner for it to count


@dataclass(frozen=True, eq=False)
class SolidFace:
    """A named boundary of a body, ``label`` "BODY.BOUNDARY"."""

    body: ElasticBody
    boundary: str
    label: str

    @property
    def surface(self) -> Surface:
        """Facets of the face."""
        return face_surface(self.body, self.boundary)

    @property
    def spacing(self) -> float:
        """Mean distance of displacement nodes [m]."""
        return float(np.sqrt(self.surface.areas.mean())) / self.body.degree


@dataclass(frozen=True, eq=False)
class Feet:
    """Closest places on a surface of places in space, each where ``valid``.

    ``facets`` and ``weights`` (s, n) are the facet and its shape functions at the foot, ``places``
    and ``normals`` (s, 3) the foot and the outward normal there, ``gaps`` (s,) the distances along
    it, below zero behind the surface [m]. ``averted`` marks places that face away from it.
    """

    valid: NDArray[np.bool_]
    averted: NDArray[np.bool_]
    facets: Integers
    weights: Array
    places: Array
    normals: Array
    gaps: Array


def closest_places(other: Surface, places: Array, looks: Array) -> Feet:
    """Feet of places (s, 3) with outward normals ``looks`` (s, 3) on another surface."""
    from scipy.spatial import cKDTree

    count = len(places)
    found = Feet(np.zeros(count, bool), np.zeros(count, bool), np.zeros(count, np.int64),
                 np.zeros((count, other.facets.shape[1])), np.zeros((count, 3)),
                 np.zeros((count, 3)), np.full(count, np.inf))
    near = min(_NEAREST, len(other.facets))
    order = cKDTree(other.centres).query(places, near)[1].reshape(count, near)
    size = np.sqrt(other.areas)
    for rank in range(near):
        left = np.flatnonzero(~found.valid)
        if not len(left):
            break
        facet = order[left, rank]
        nodes = other.facets[facet]
        corners = other.places[nodes]
        weights, foot, normal = _at(nodes, corners, closest_local(nodes, corners, places[left]))
        away = places[left] - foot
        gap = (away * normal).sum(axis=1)
        beside = np.linalg.norm(away - gap[:, None] * normal, axis=1)
        on = beside <= _SLACK * size[facet]
        facing = (normal * looks[left]).sum(axis=1) < -_FACING
        found.averted[left[on & ~facing]] = True
        good = on & facing
        kept = left[good]
        found.valid[kept] = True
        for name, values in (("facets", facet), ("weights", weights), ("places", foot),
                             ("normals", normal), ("gaps", gap)):
            getattr(found, name)[kept] = values[good]
    return found


def _at(nodes: Integers, corners: Array, local: Array) -> tuple[Array, Array, Array]:
    """Shape functions (s, n), places and unit normals (s, 3) on facets (s, n, 3)."""
    values, slopes = functions_at(nodes, local)
    along = np.einsum("snd,snx->dsx", slopes, corners)
    normals = np.cross(along[0], along[1])
    return (values, np.einsum("sn,snx->sx", values, corners),
            normals / np.linalg.norm(normals, axis=1, keepdims=True))


def paired_solids(
    face: SolidFace, other: SolidFace, count: Count, reach: float | None, overlap: float,
) -> dict[str, Any]:
    """Arguments of :class:`fecontact.fem.Pairing` for two faces of solids.

    Raises
    ------
    InputError
        If no part of the face has a partner, or it lies deeper in the other one than ``overlap``.
    """
    import scipy.sparse as sp

    surface, opposite = face.surface, other.surface
    limit = max(float(np.linalg.norm(np.ptp(one.places[np.unique(one.facets)], axis=0)))
                for one in (surface, opposite)) if reach is None else reach
    _, places, looks, _ = surface.sampled
    k, g = places.shape[:2]
    found = closest_places(opposite, places.reshape(-1, 3), looks.reshape(-1, 3))
    valid = found.valid & (np.abs(found.gaps) <= limit)
    _require_partners(face, other, found, limit)
    covered = valid.reshape(k, g)
    kept = covered.mean(axis=1) >= _LEAST
    if not kept.any():
        raise InputError(f"pair_faces: only parts of facets of '{face.label}' have a partner on "
                         f"'{other.label}'; refine the mesh or give other faces.")
    within = replace(surface.only(kept), covered=covered[kept])
    patches = contact_patches(within, face.boundary, count, _COUNT)
    samples = np.flatnonzero(np.repeat(kept, g) & valid)
    owner = np.repeat(patches.owner, g)[covered[kept].ravel()]
    weights = within.sampled[3].ravel()[covered[kept].ravel()]
    share = weights / patches.areas[owner]

    def mean(values: Array) -> Array:
        out = np.zeros((patches.count, *values.shape[1:]))
        np.add.at(out, owner, share.reshape(-1, *[1] * (values.ndim - 1)) * values)
        return out

    normals = mean(found.normals[samples])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tangents, feet_places = tangents_of(normals), mean(found.places[samples])
    edge = float(np.sqrt(min(surface.areas.mean(), opposite.areas.mean())))
    gaps, closed = closed_gaps(mean(found.gaps[samples]), patches.centres, overlap, edge,
                               face.label, other.label)
    foot = found.facets[samples]
    at_node = sp.csr_array(sp.coo_array(
        ((share[:, None] * found.weights[samples]).ravel(),
         (np.repeat(owner, opposite.facets.shape[1]), opposite.facets[foot].ravel())),
        shape=(patches.count, len(other.body.nodes))))
    chosen = np.unique(opposite.facets)
    feet = sp.csr_array(sp.kron(at_node[:, chosen], sp.eye_array(6))
                        @ node_matrix(other.body, chosen))
    arms = patches.centres - feet_places
    report = PairingReport(
        face.label, other.label, patches.count, surface.centres[~kept],
        tuple(_reasons(found, kept, g, other.label)),
        float(patches.areas.sum() / surface.areas.sum()),
        _unevenness(surface, opposite, at_node.T @ patches.areas, limit),
        float(gaps.max()), closed,
        float(np.linalg.norm(np.einsum("nix,nx->ni", tangents, arms), axis=1).max()))
    return {"body": face.label.partition(".")[0], "other": other.label.partition(".")[0],
            "places": patches.centres, "normals": normals, "tangents": tangents, "gaps": gaps,
            "tributary": patches.areas, "nodes": patches.rows(), "feet": feet,
            "feet_places": feet_places, "report": report, "patches": patches}


def grounded_solid(
    face: SolidFace, count: Count, reach: float | None, overlap: float
) -> dict[str, Any]:
    """Arguments of :class:`fecontact.fem.Pairing` for a face above the ground, z = 0."""
    surface = face.surface
    check_facets_down(surface, face.boundary)
    whole = contact_patches(surface, face.boundary, count, _COUNT)
    kept = whole.centres[:, 2] <= (np.inf if reach is None else reach)
    if not kept.any():
        raise InputError(f"pair_faces: no node of '{face.label}' is within reach = {reach:g} m of "
                         f"the ground, z = 0; the lowest is {whole.centres[:, 2].min():.4g} m "
                         f"above it.")
    number = np.cumsum(kept) - 1
    patches = Patches(surface.only(kept[whole.owner]), number[whole.owner[kept[whole.owner]]],
                      int(kept.sum()))
    gaps, closed = closed_gaps(patches.centres[:, 2], patches.centres, overlap,
                               float(np.sqrt(surface.areas.mean())), face.label,
                               "the ground, z = 0,")
    normals = np.tile([0.0, 0.0, 1.0], (patches.count, 1))
    report = PairingReport(
        face.label, "ground", patches.count, whole.centres[~kept],
        ("is out of reach",) * int((~kept).sum()),
        float(patches.areas.sum() / whole.areas.sum()), 0.0, float(gaps.max()), closed, 0.0)
    return {"body": face.label.partition(".")[0], "other": None, "places": patches.centres,
            "normals": normals, "tangents": tangents_of(normals), "gaps": gaps,
            "tributary": patches.areas, "nodes": patches.rows(), "feet": None,
            "feet_places": patches.centres * [1.0, 1.0, 0.0], "report": report,
            "patches": patches}


def check_solids_apart(first: SolidFace, second: SolidFace) -> None:
    """InputError if two faces of one body share facets."""
    if first.body is not second.body:
        return
    both = np.concatenate([np.sort(face.body.mesh.boundary(face.boundary), axis=1)
                           for face in (first, second)])
    if len(np.unique(both, axis=0)) < len(both):
        raise InputError(f"pair_faces: '{first.label}' and '{second.label}' share facets; a face "
                         f"cannot touch itself, give two boundaries.")


def _require_partners(face: SolidFace, other: SolidFace, found: Feet, limit: float) -> None:
    if (found.valid & (np.abs(found.gaps) <= limit)).any():
        return
    names = f"pair_faces: no node of '{face.label}' has a partner on '{other.label}'"
    if found.valid.any():
        gaps = found.gaps[found.valid]
        gap = float(gaps[np.argmin(np.abs(gaps))])
        raise InputError(
            f"{names}: the closest lies {-gap:.4g} m behind it, so that the faces look away from "
            f"each other; put the bodies on the right sides of each other or give other faces."
            if gap < 0.0 else f"{names}: the closest is {gap:.4g} m away, beyond reach = "
            f"{limit:.4g} m; move the bodies closer or raise reach.")
    if found.averted.any():
        raise InputError(f"{names}: their outward normals point the same way; give faces that look "
                         f"at each other.")
    raise InputError(f"{names}: they lie beyond its ends; move the bodies opposite to each other, "
                     f"refine the mesh or give other faces.")


def _reasons(found: Feet, kept: NDArray[np.bool_], points: int, other: str) -> list[str]:
    """Why each facet that is not kept has no partner."""
    near, averted = (flags.reshape(-1, points) for flags in (found.valid, found.averted))
    return ["is out of reach" if near[facet].mean() >= _LEAST else
            f"looks away from {other}" if averted[facet].any() else
            f"is beyond the ends of {other}" for facet in np.flatnonzero(~kept)]


def _unevenness(surface: Surface, opposite: Surface, loads: Array, limit: float) -> float:
    """Largest error of the nodal loads (N,) of a uniform pressure, over the mean of a node."""
    _, places, looks, _ = opposite.sampled
    back = closest_places(surface, places.reshape(-1, 3), looks.reshape(-1, 3))
    covered = (back.valid & (np.abs(back.gaps) <= limit)).reshape(places.shape[:2])
    exact = np.zeros(len(opposite.places))
    np.add.at(exact, opposite.facets, replace(opposite, covered=covered).shape_integrals)
    loaded = np.unique(opposite.facets[covered.any(axis=1)])
    mean = exact.sum() / max(len(loaded), 1)
    return float(np.abs(loads - exact).max() / mean) if mean > 0.0 else 0.0
