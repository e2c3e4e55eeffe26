"""Starts of curves of folds and of Hopf points of equilibria over two parameters."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint, attributes_of
from fecontact.bifurcation.continuation.points import HopfPoint
from fecontact.bifurcation.continuation.problem import sizes_of
from fecontact.bifurcation.equilibria.codim2_problems import (
    FoldCurve,
    HopfCurve,
    PlaneCurve,
    hopf_borders,
    scaled,
)
from fecontact.bifurcation.equilibria.equilibrium import Equilibrium, default_scales
from fecontact.bifurcation.equilibria.normal_forms import critical_pair, null_vectors
from fecontact.core.errors import InputError
from fecontact.core.types import Array, ArrayLike

# Limit of the growth of the scales along a curve, in those at its start.
_GROWTH = 1e4


def equilibrium_curve(
    begin: Equilibrium, names: tuple[str, str], square: float | None, widths: Mapping[str, float],
    scales: ArrayLike | None,
) -> tuple[PlaneCurve, Array, dict[str, Any]]:
    """Problem, unknowns and attributes of the curve through a fold or Hopf point of equilibria.

    Parameters
    ----------
    begin : Equilibrium
        With an eigenvalue at zero, or a pair on the imaginary axis.
    names : (str, str)
        The first and the second parameter.
    square : float or None
        Square of the pair's angular frequency, 0 at a Bogdanov-Takens point; None at folds.
    scales
        As for :func:`fecontact.bifurcation.codim2_curve`.
    widths : mapping
        Width of the diagram in each parameter by name; by default the size of its value.
    """
    field = begin.field
    first, second = names
    active = (field.index(second), field.index(first))
    if scales is None:
        sizes = np.maximum(default_scales(begin), np.abs(begin.state))
        limits = _GROWTH * sizes
    else:
        sizes, _ = sizes_of(scales, default_scales(begin))
        limits = sizes
    width = [widths.get(name, abs(float(begin.values[index])) or 1.0)
             for name, index in zip((second, first), active, strict=True)]
    plane = begin.values[list(active)]
    known = attributes_of(field, begin.values) | {"widths": np.array(width)}
    if square is None:
        v, w = null_vectors(scaled(begin.jacobian, sizes))
        fold = FoldCurve(field, begin.values, active, np.concatenate([sizes, width]),
                         np.concatenate([limits, width]), w, v)
        return fold, np.concatenate([begin.state, plane]), known
    J = scaled(begin.jacobian, sizes)
    b, c = hopf_borders(J, square)
    size = square or float(np.linalg.norm(J)) ** 2
    hopf = HopfCurve(field, begin.values, active, np.concatenate([sizes, [size], width]),
                     np.concatenate([limits, [_GROWTH * size], width]), b, c)
    return hopf, np.concatenate([begin.state, [square], plane]), known


def critical_square(begin: Equilibrium, point: BranchPoint) -> float | None:
    """Square of the angular frequency at a Hopf point of a branch; None at a fold.

    Raises
    ------
    InputError
        If the Jacobian has no pair of eigenvalues at the Hopf point.
    """
    if not isinstance(point, HopfPoint):
        return None
    if not (begin.eigenvalues.imag > 0.0).any():
        raise InputError(f"{point.place} is no Hopf point of this field: all eigenvalues are real.")
    return critical_pair(begin.jacobian)[0].imag ** 2
