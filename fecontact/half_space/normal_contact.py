"""Pressures between two half-spaces whose surfaces have a gap, without friction."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_count, as_floats, as_pair, require_flags
from fecontact.core.errors import (
    AnalysisError,
    InputError,
    ModelWarning,
    require_finite,
    require_positive,
)
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike
from fecontact.core.units import Summarised, quantity
from fecontact.fem.material import Material
from fecontact.half_space.influence import DIRECT, Convolution
from fecontact.half_space.surface_compliance import SurfaceCompliance


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class HalfSpaceContact(Summarised):
    """Pressures and displacements of two half-spaces pressed on each other.

    Attributes
    ----------
    pressure : (N, M) array
        Pressure of each pixel, zero or above [Pa].
    displacement : (N, M) array
        Normal displacement u of the surfaces towards their own bodies, both together [m].
    gap : (N, M) array
        Gap ``g + u - approach`` of the deformed surfaces, zero in contact [m].
    approach : float
        Rigid motion of the bodies towards each other from the place where the gap is as given [m].
    sides : (float, float)
        Sides of a pixel along x and y [m].
    compliance : SurfaceCompliance
        Constants of the materials.
    periodic : bool
        Whether the grid repeats itself.
    iterations : int
        Steps of the conjugate gradients.
    """

    pressure: Array
    displacement: Array
    gap: Array
    approach: float
    sides: tuple[float, float]
    compliance: SurfaceCompliance
    periodic: bool
    iterations: int

    @property
    def pixel_area(self) -> float:
        """Area of a pixel [m^2]."""
        return self.sides[0] * self.sides[1]

    @property
    def force(self) -> float:
        """Normal force [N]."""
        return float(self.pressure.sum()) * self.pixel_area

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Pixels (N, M) in contact."""
        return np.asarray(self.pressure > 0.0)

    @property
    def contact_area(self) -> float:
        """Area of the pixels in contact [m^2]."""
        return float(np.count_nonzero(self.touching)) * self.pixel_area

    def summary(self) -> list[tuple[str, str]]:
        """Grid, force, approach, contact area and largest pressure."""
        n, m = self.pressure.shape
        kind = "periodic" if self.periodic else "free"
        return [("grid", f"{n} x {m} pixels, {kind}"),
                ("normal force", quantity(self.force, "N")),
                ("approach", quantity(self.approach, "m")),
                ("contact area", f"{self.contact_area:.5g} m², "
                 f"{100.0 * float(self.touching.mean()):.4g} % of the grid"),
                ("largest pressure", quantity(float(self.pressure.max()), "Pa"))]


def half_space_contact(
    gap: ArrayLike, spacing: float | tuple[float, float],
    materials: Material | Sequence[Material], *,
    force: float | None = None, approach: float | None = None, periodic: bool = False,
    rtol: float = 1e-8, max_iterations: int = 2000,
) -> HalfSpaceContact:
    r"""Pressures of two elastic half-spaces with a gap, without friction and adhesion.

    .. math:: u(x) = \frac{1}{\pi E^*} \int \frac{p(x')}{|x - x'|}\, dA', \qquad
        g + u - \delta \ge 0,\quad p \ge 0,\quad p\,(g + u - \delta) = 0

    by conjugate gradients for these bounds (Polonsky and Keer, *Wear* 231, 1999), on a grid of
    pixels of constant pressure, whose mean displacements are exact. The error of the contact area
    is that of whole pixels.

    Parameters
    ----------
    gap : (N, M) array
        Gap g of the undeformed surfaces at the centres of the pixels; a constant may be added [m].
    spacing : float or (float, float)
        Sides of a pixel along x and y [m].
    materials : Material or two of them
        Material of one body on a rigid one, or of both; isotropic.
    force : float
        Normal force, positive; of a periodic surface that of one period [N].
    approach : float
        In place of the force: rigid approach delta of the bodies [m].
    periodic : bool
        True if the grid is one period of a surface; then give the force. Its displacement has the
        mean zero. Otherwise the surface is free, without contact beyond the grid.
    rtol : float
        Largest error of the gap in contact, relative to the largest displacement.
    max_iterations : int
        Largest number of steps.

    Raises
    ------
    InputError
        For values out of range, both or none of force and approach.
    AnalysisError
        If the steps do not suffice.

    Warns
    -----
    ModelWarning
        If a surface that is not flat and not periodic touches at the edge of the grid.
    """
    owner = "half_space_contact"
    g, sides = checked_grid(gap, spacing, owner)
    require_flags(owner, periodic=periodic)
    require_positive(owner, rtol=rtol)
    as_count(max_iterations, f"{owner}: max_iterations")
    if (force is None) == (approach is None):
        raise InputError(f"{owner}: give either force [N] or approach [m].")
    if periodic and force is None:
        raise InputError(f"{owner}: approach is not for periodic = True, where it does not "
                         f"determine the mean pressure; give force [N].")
    if force is not None:
        require_positive(owner, force=force)
    if approach is not None:
        require_finite(owner, approach=approach)
    compliance = SurfaceCompliance.of(materials, owner)
    convolution = Convolution([(compliance.direct / np.pi, DIRECT)], g.shape, sides, periodic)
    forces, displacement, delta, steps = _conjugate_gradients(
        convolution, g, force, approach, rtol, max_iterations)
    if not periodic and _touches_at_edge(forces, g):
        warnings.warn(
            f"{owner}: the contact reaches the edge of the grid of {g.shape[0]} x {g.shape[1]} "
            f"pixels, beyond which there is none; give a larger grid, or periodic = True if it is "
            f"one period of the surface.", ModelWarning, stacklevel=2)
    return HalfSpaceContact(forces / (sides[0] * sides[1]), displacement,
                            g + displacement - delta, delta, sides, compliance, periodic, steps)


def checked_grid(
    gap: ArrayLike, spacing: float | tuple[float, float], owner: str
) -> tuple[Array, tuple[float, float]]:
    """Gap (N, M) and sides of pixels; InputError for other shapes and values."""
    g = as_floats(gap, f"{owner}: gap")
    if g.ndim != 2 or min(g.shape) < 1 or not np.isfinite(g).all():
        raise InputError(f"{owner}: gap of shape {g.shape} must be a grid (N, M) of finite "
                         f"numbers [m]; fill missing heights first.")
    sides = (spacing, spacing) if isinstance(spacing, Real) else as_pair(
        spacing, f"{owner}: spacing")
    require_positive(owner, spacing=sides[0])
    require_positive(owner, spacing=sides[1])
    return g, (float(sides[0]), float(sides[1]))


def _touches_at_edge(forces: Array, g: Array) -> bool:
    """Whether pixels at the edge of the grid touch above the lowest one, unlike flat punches."""
    inside = np.zeros(g.shape, dtype=bool)
    inside[1:-1, 1:-1] = True
    above = g > float(g.min()) + 1e-12 * float(np.abs(g).max())
    return bool((above & ~inside & (forces > 0.0)).any())


def _conjugate_gradients(
    convolution: Convolution, g: Array, force: float | None, approach: float | None,
    rtol: float, most: int,
) -> tuple[Array, Array, float, int]:
    """Forces (N, M), displacements, approach and number of steps."""
    if force is not None:
        p = np.full(g.shape, force / g.size)
    else:
        depth = np.maximum(float(approach or 0.0) - g, 0.0)
        if not depth.any():
            return depth, np.zeros(g.shape), float(approach or 0.0), 0
        p = depth * float((depth * depth).sum() / (depth * convolution(depth)).sum())
    direction, before, conjugate = np.zeros(g.shape), 1.0, 0.0
    for step in range(1, most + 1):
        u = convolution(p)
        touching = p > 0.0
        delta = float((g + u)[touching].mean()) if force is not None else float(approach or 0.0)
        residual = g + u - delta
        work = float((residual[touching] ** 2).sum())
        scale = float(np.abs(u).max()) or 1.0
        overlap = float(np.maximum(-residual[~touching], 0.0).max(initial=0.0))
        if max(float(np.abs(residual[touching]).max()), overlap) <= rtol * scale:
            return p, u, delta, step
        direction = np.where(touching, residual + conjugate * work / before * direction, 0.0)
        before = work
        response = convolution(direction)
        if force is not None:
            response -= response[touching].mean()
        length = float((residual * direction)[touching].sum()
                       / (response * direction)[touching].sum())
        p = np.where(touching, np.maximum(p - length * direction, 0.0), 0.0)
        inside = (p == 0.0) & (residual < 0.0)
        conjugate = 0.0 if inside.any() else 1.0
        p[inside] -= length * residual[inside]
        if force is not None:
            p *= force / p.sum()
        elif not p.any():
            return p, np.zeros(g.shape), float(approach or 0.0), step
    raise AnalysisError(f"half_space_contact: the pressures did not converge in {most} steps; "
                        f"allow more by max_iterations, or a larger rtol.")
