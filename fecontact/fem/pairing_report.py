"""Report on the pairing of two faces, and messages for faces that cannot be paired."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised, count, listed, quantity
from fecontact.fem.face_curve import Closest, Face
from fecontact.fem.face_samples import Samples

SAME = 1e-9  # of an edge: gaps and lengths below this are round-off
_TINY = 1e-12  # [m], less than an atom: shown as zero


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class PairingReport(Summarised):
    """Result of the pairing of two faces: contact nodes, coverage and gaps.

    Parameters
    ----------
    face, other : str
        The face with the contact nodes and the other side, "BODY.BOUNDARY" or "ground".
    nodes : int
        Contact nodes.
    left_out : (k, d) array
        Places of the face's displacement nodes without a partner, of solids of its facets [m].
    reasons : tuple of str
        Reason why each of these places has no partner.
    covered : float
        Share of the length of the face that has a partner.
    unevenness : float
        Largest error of the loads that a uniform pressure puts on the nodes of the other side, over
        the load of a node whose edges are wholly in contact: 0 where the loads are exact.
    largest_gap, closed_overlap : float
        Largest initial gap, and largest overlap set to zero [m].
    largest_offset : float
        Largest distance along the tangent between the places where opposite normal forces act [m];
        times the force, the moment by which they do not balance.
    """

    face: str
    other: str
    nodes: int
    left_out: Array
    reasons: tuple[str, ...]
    covered: float
    unevenness: float
    largest_gap: float
    closed_overlap: float
    largest_offset: float

    @property
    def _places(self) -> str:
        return "node" if self.left_out.shape[1] == 2 else "facet"

    def summary(self) -> list[tuple[str, str]]:
        """Numbers of nodes, gaps, overlaps, and how evenly the other side is loaded."""
        where = [f"({_coordinates(place)}) m {reason}"
                 for place, reason in zip(self.left_out, self.reasons, strict=True)]
        return [
            ("faces", f"{self.face} on {self.other}"),
            ("nodes", f"{self.nodes}"),
            ("without partner", f"{count(len(where), self._places)}: {listed(where, 3)}" if where
             else "none"),
            ("covered", f"{100.0 * self.covered:.4g} %"),
            ("largest gap", quantity(self.largest_gap, "m")),
            ("overlap closed", quantity(self.closed_overlap, "m")),
            ("unevenness", f"{100.0 * _beyond(self.unevenness, SAME):.3g} %"),
            ("largest offset", quantity(_beyond(self.largest_offset, _TINY), "m")),
        ]


def _coordinates(place: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in place.tolist())


def _beyond(value: float, least: float) -> float:
    """A value, or zero where it is round-off."""
    return value if value >= least else 0.0


def no_partner(samples: Samples, found: Closest, face: Face, other: Face, limit: float) -> str:
    """Message that says why no node within ``limit`` has a partner."""
    names = f"pair_faces: no node of '{face.label}' has a partner on '{other.label}'"
    wide = samples.closest(other, np.inf)
    if wide.valid.any() and not found.valid.any():
        gap = wide.gaps[wide.valid][np.argmin(np.abs(wide.gaps[wide.valid]))]
        if gap < 0.0:
            return (f"{names}: the closest lies {-gap:.4g} m behind it, so that the faces look "
                    f"away from each other; put the bodies on the right sides of each other or "
                    f"give other faces.")
        return (f"{names}: the closest is {gap:.4g} m away, beyond reach = {limit:.4g} m; move the "
                f"bodies closer or raise reach.")
    if wide.averted.any() and not wide.valid.any():
        return (f"{names}: their outward normals point the same way; give faces that look at each "
                f"other.")
    return (f"{names}: they lie beyond its ends; move the bodies opposite to each other, refine "
            f"the mesh or give other faces.")


def reasons(
    found: Closest, shared: NDArray[np.bool_], other: str, kept: NDArray[np.bool_]
) -> tuple[str, ...]:
    """Why each node that is not kept has no partner."""
    return tuple(
        "is on both faces" if shared[j] else f"is {found.nearest[j]:.3g} m away, out of reach"
        if np.isfinite(found.nearest[j]) and not found.valid[j]
        else f"looks away from {other}" if found.averted[j]
        else f"is beyond the ends of {other}" for j in np.flatnonzero(~kept))


def closed_gaps(
    gaps: Array, places: Array, overlap: float, edge: float, face: str, other: str
) -> tuple[Array, float]:
    """Gaps without overlaps, and the largest of these [m].

    Overlaps up to ``overlap`` times ``edge`` are closed; InputError for a deeper one.
    """
    deepest, allowed, tiny = int(np.argmin(gaps)), overlap * edge, SAME * edge
    depth = -float(gaps[deepest])
    if depth > max(allowed, tiny):
        raise InputError(f"pair_faces: '{face}' starts {depth:.4g} m inside {other} at "
                         f"({_coordinates(places[deepest])}) m, deeper than overlap = {overlap:g} "
                         f"edges, {allowed:.4g} m; move the bodies apart, give faces that look at "
                         f"each other, or raise overlap.")
    return np.where(gaps < tiny, 0.0, gaps), depth if depth > tiny else 0.0
