"""Uncertainty of multipliers by rounding along a branch of orbits."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.rounding import FLAT, RestingParameter
from fecontact.core.types import Array

# Largest error of the trivial multiplier with which others are known at all.
WORST = 0.1
# Error of the trivial multiplier above which the mesh is too coarse for any conclusion.
LOST = 0.5
# Slope of the parameter, in widths of the diagram, below which its sign may be rounding where
# multipliers are lost.
_FLAT_LOST = 1e-4
# A multiplier differs from one if its distance exceeds this multiple of the trivial error.
_RESOLVED = 10.0


class MultiplierRounding(RestingParameter):
    """Rounding on branches of orbits with multipliers.

    Differences that grow by more than the inverse of rounding along one part of an orbit, and
    shrink along another, as on canards, leave the trivial multiplier anywhere: the multipliers are
    lost. Towards a homoclinic orbit, on a canard and in a conservative family the parameter changes
    by less than rounding: its turns are no folds, and sign changes in the test for branch points no
    crossings. In a conservative family a second multiplier equals one throughout.
    """

    def unstable(self, linearisation: Any, values: Mapping[str, Any]) -> tuple[int, int]:
        """Range of the number of unstable multipliers, given their errors."""
        found: tuple[int, int] = linearisation.floquet.unstable_range
        return found

    def lost(self, values: Mapping[str, Any]) -> bool:
        """Whether the multipliers of an orbit are lost."""
        return float(values.get("trivial_error", 0.0)) > WORST

    def kinds(self, tangents: Any, values: Any, tests: Any) -> set[str]:
        """Folds and branch points where the parameter rests, and all where multipliers are lost."""
        slopes = self.slopes(tangents)
        flat = [abs(slope) < FLAT for slope in slopes]
        found = super().kinds(tangents, values, tests)
        signs = [np.sign(test.get("branch point", 0.0)) * (-1.0 if slope <= -FLAT else 1.0)
                 for slope, test in zip(slopes, tests, strict=True)]
        if any(flat) and signs[0] == signs[1]:
            found.add("branch point")
        if all(flat) and all(_near_one(stored) for stored in values):
            found.add("branch point")
        if any(self.lost(stored) for stored in values):
            found.add("branch point")
            if any(float(stored["trivial_error"]) > LOST for stored in values):
                found |= {"period doubling", "torus"}
        return found

    def turns(self, tangents: tuple[Array, Array], values: Any) -> bool:
        """Whether multipliers are lost, and a slope is below the errors of tangents there."""
        return (any(self.lost(stored) for stored in values)
                and min(map(abs, self.slopes(tangents))) < _FLAT_LOST)

    def note(self, points: Sequence[BranchPoint]) -> str:
        """Note on lost multipliers; empty if there are none."""
        places = [point.parameter for point in points if self.lost(point.values)]
        folds = [f"{point.parameter:.10g}" for point in points
                 if point.kind == "fold" and self.lost(point.values)]
        if not places:
            return ""
        said = (f"Multipliers of {len(places)} orbit{'s' if len(places) > 1 else ''} are lost in "
                f"rounding, at parameters from {min(places):.10g} to {max(places):.10g}: nothing "
                f"is known of their stability, and of special points only folds are sought among "
                f"them.")
        return said if not folds else (
            f"{said} Beside the fold{'s' if len(folds) > 1 else ''} at {', '.join(folds)} a period "
            f"doubling may be hidden.")


def _near_one(stored: Mapping[str, Any]) -> bool:
    """Whether a second multiplier is indistinguishable from one."""
    off = np.sort(np.abs(np.asarray(stored["multipliers"]) - 1.0))
    error = max(float(stored["trivial_error"]), 1e-10)
    return len(off) > 1 and bool(off[1] <= _RESOLVED * error)
