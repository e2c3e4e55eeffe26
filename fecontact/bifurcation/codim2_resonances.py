"""Curves of orbits of three and four periods that begin at resonances 1:3 and 1:4."""

from dataclasses import replace

import numpy as np

from fecontact.bifurcation.continuation.attempts import first_found
from fecontact.bifurcation.continuation.branch import Branch
from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import FoldPoint, special_point
from fecontact.bifurcation.continuation.problem import ContinuationOptions
from fecontact.bifurcation.orbits.branches import based, method_of_several, orbit_branch
from fecontact.bifurcation.orbits.curves.resonant import (
    AWAY,
    StrongResonance,
    is_single,
    of_several,
)
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.core.errors import AnalysisError, FecontactError
from fecontact.core.ties import first_largest, first_least
from fecontact.system.fields.vector_field import VectorField

# Width about such an orbit, and steps, for folds.
_ABOUT = 0.3
_SEARCH = ContinuationOptions(step=1e-3, largest_step=0.02, points=200, stop_at=("fold",))
# Angles from c to e at which orbits of three periods are followed to folds; opposite to c the folds
# are far.
_ANGLES = np.pi * np.array([0.0, 0.5, -0.5, 0.75, -0.75])


def folds_at_quarter(
    field: VectorField, point: BranchPoint, parameter: str, side: float
) -> FoldPoint:
    """A fold of orbits of four periods beside a resonance 1:4 of a curve of tori.

    With the amplitude z of the vector of the multiplier i, the fourth iterate goes along
    z' = e z + C z |z|^2 + D conj(z)^3. For |C| > |D| it has no or eight rest points besides zero;
    the folds e = -t C (1 +- i tan a), t > 0, sin a = |D / C|, lie between (Kuznetsov, Elements of
    Applied Bifurcation Theory, section 9.5.4). Between both, orbits start at the smaller rest
    points of e = -t C, and are followed to the fold at the ``side`` of e with the larger angle (1)
    or the smaller one (-1).

    Raises
    ------
    AnalysisError
        If |C| <= |D|, or no fold is found.
    """
    at = StrongResonance(field, point, parameter, 4)
    C, D = at.c, at.b
    if not abs(C) > abs(D):
        raise AnalysisError(f"{point.place}: no folds of orbits of four periods begin there; its "
                            f"normal form has |C / D| = {abs(C / D):.4g}, and must exceed 1; "
                            f"follow the orbits around it with orbit_branch(field, point).")
    towards = at.towards(-C)
    place = first_least(np.abs(towards))
    turn = np.exp(0.25j * np.angle(D / C))

    def find(attempt: tuple[int, float]) -> FoldPoint | None:
        place, away = attempt
        shift = away * towards
        size = float(np.sqrt(abs(at.exponent(shift)) / (abs(C) + abs(D))))
        for end in _followed(at, at.motion(shift, size * turn), place).of_kind("fold"):
            shift[place] = (end.parameter - at.u[place - 2]) / at.widths[place]
            if (at.exponent(shift) / -C).imag * side > 0.0:
                return end
        return None

    # Over one parameter alone the orbits may never meet the fold to that side.
    tried = [(over, away) for over in (place, 1 - place) for away in AWAY]
    return first_found(tried, find, f"{point.place}: no fold of orbits of four periods was found "
                                    f"beside it; follow these from a run near it.")


def fold_at_third(field: VectorField, point: BranchPoint, parameter: str) -> FoldPoint:
    """A fold of orbits of three periods beside a resonance 1:3 of a curve of tori.

    The orbits go along z' = e z + b conj(z)^2 + c z |z|^2: those with |e + c R| = |b| sqrt(R),
    R = |z|^2, surround the point, and meet others in folds where |b|^2 = 2 |c e| (1 + cos a) with
    the angle a from c to e: a parabola about the point, near it where b is small.

    Raises
    ------
    AnalysisError
        If no fold is found.
    """
    at = StrongResonance(field, point, parameter, 3)
    last: FecontactError | None = None
    for angle in _ANGLES:
        towards = at.towards(at.c * np.exp(1j * angle))
        place = first_largest(np.abs(towards))
        for away in AWAY:
            try:
                branch = _followed(at, of_several(at, away * towards), place)
            except FecontactError as error:
                last = error
                continue
            if is_single(branch.points[0], 3):
                continue
            found = branch.of_kind("fold")
            if found:
                return found[first_least([abs(end.parameter - float(at.u[place - 2]))
                                          for end in found])]
            break
    raise AnalysisError(f"{point.place}: no fold of orbits of three periods was found beside it; "
                        f"follow these with orbit_branch(field, point), which surround it as "
                        f"saddles, and start from a fold of theirs.") from last


def neutral_saddle_at_third(
    field: VectorField, point: BranchPoint, parameter: str
) -> BranchPoint:
    """A neutral saddle of three periods beside a resonance 1:3 of a curve of tori.

    The curve of saddles with multipliers mu and 1 / mu, Re e = - 2 Re c |z|^2, touches that of
    tori, Re e = 0, at the point.

    Raises
    ------
    AnalysisError
        If none is found.
    """
    at = StrongResonance(field, point, parameter, 3)
    towards = at.towards(1j)

    def find(away: float) -> BranchPoint | None:
        motion = of_several(at, away * towards)
        found = _followed(at, motion, 1, replace(_SEARCH, points=1)).points[0]
        return None if is_single(found, 3) else special_point(
            found.u, found.tangent, found.values, "neutral saddle", {}, found.header)

    return first_found((side * away for away in AWAY for side in (1.0, -1.0)), find,
                       f"{point.place}: no saddle of three periods was found beside it.")


def _followed(
    at: StrongResonance, motion: PeriodicMotion, place: int,
    options: ContinuationOptions = _SEARCH,
) -> Branch:
    """Orbits of several periods over the second (0) or the first parameter (1), to a fold."""
    name, width, orbit = at.names[place], float(at.widths[place]), at.orbit
    assert motion.parameter_values is not None
    value = float(motion.parameter_values[orbit.field.index(name)])
    return orbit_branch(
        based(orbit.field, motion.parameter_values), motion, name,
        method=method_of_several(at), options=options,
        scales=orbit.scales[: orbit.field.dimension], width=width,
        bounds=(value - _ABOUT * width, value + _ABOUT * width), both=True)
