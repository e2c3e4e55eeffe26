"""Measured profiles of the ground."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fecontact.core.checks import require_flags
from fecontact.core.errors import require_finite, require_positive
from fecontact.core.types import Array
from fecontact.laws.data_columns import read_or_given, require_closed, require_resolved
from fecontact.laws.ground.profile import Profile
from fecontact.laws.piecewise_polynomial import (
    curve_range,
    equivalent_period,
    piecewise,
    piecewise_parameters,
)
from fecontact.laws.signatures import ground_profile


@ground_profile
def _trace(xi, p):
    height, slope, curvature = piecewise(xi, p, 1)
    return p[0] + height, slope, curvature


@dataclass(frozen=True)
class MeasuredProfile(Profile):
    """A measured height trace, interpolated by a cubic spline.

    Slope and curvature are continuous. A trace that is not periodic has zero curvature at its ends;
    beyond them the slope decreases smoothly to zero within twice the distance of the last two
    points, and the height stays constant.

    Parameters
    ----------
    abscissa : (N,) sequence
        Positions along the ground, ascending.
    heights : (N,) sequence
        Heights, positive out of the ground; the last of a periodic trace equals the first.
    file : str, optional
        Text or CSV file with columns of abscissae and heights, instead of both; lines before the
        first line of numbers are a header. It is read once; then ``file`` is None.
    periodic : bool
        Whether the trace is repeated.
    remove_mean : bool
        Whether to subtract the mean height along the trace.
    scale, abscissa_scale : float
        Factors from the units of heights and abscissa to m; for a variation of friction, ``scale``
        converts heights to fractions of the friction force.

    Raises
    ------
    InputError
        For an invalid trace or file, with the position.
    """

    kernel: ClassVar = _trace

    abscissa: tuple[float, ...] = ()
    heights: tuple[float, ...] = ()
    file: str | None = None
    periodic: bool = False
    remove_mean: bool = False
    scale: float = 1.0
    abscissa_scale: float = 1.0

    def __post_init__(self) -> None:
        require_finite("MeasuredProfile", scale=self.scale)
        require_positive("MeasuredProfile", abscissa_scale=self.abscissa_scale)
        require_flags("MeasuredProfile", periodic=self.periodic, remove_mean=self.remove_mean)
        x, y = read_or_given("MeasuredProfile", self.file, abscissa=self.abscissa,
                             heights=self.heights, least=3)
        if self.periodic:
            y = require_closed("MeasuredProfile", "heights", y)
        for name, value in (("abscissa", x), ("heights", y), ("file", None)):
            object.__setattr__(self, name, value)
        places, heights = self._points
        require_resolved("MeasuredProfile",
                         f"abscissa times abscissa_scale = {self.abscissa_scale:g}", places,
                         f"heights times scale = {self.scale:g}", heights)

    @property
    def _points(self) -> tuple[Array, Array]:
        """Places and heights in the unit of length of the system."""
        with np.errstate(over="ignore"):
            return (self.abscissa_scale * np.array(self.abscissa),
                    self.scale * np.array(self.heights))

    @cached_property
    def _curve(self) -> Any:
        from scipy.interpolate import CubicSpline, PPoly

        x, y = self._points
        spline = CubicSpline(x, y, bc_type="periodic" if self.periodic else "natural")
        if self.remove_mean:
            spline.c[3] -= float(spline.integrate(x[0], x[-1])) / (x[-1] - x[0])
        if self.periodic:
            return spline
        # Beyond an end the curvature changes linearly to -slope / h at h, and to zero at 2 h.
        before, after = x[1] - x[0], x[-1] - x[-2]
        (low, high), (rise, fall) = spline(x[[0, -1]]), spline(x[[0, -1]], 1)
        knots = np.concatenate([x[0] - before * np.array([2.0, 1.0]), x,
                                x[-1] + after * np.array([1.0, 2.0])])
        ends = [
            [rise / (6.0 * before**2), 0.0, 0.0, low - rise * before],
            [-rise / (6.0 * before**2), rise / (2.0 * before), 0.5 * rise,
             low - 5.0 / 6.0 * rise * before],
            [-fall / (6.0 * after**2), 0.0, fall, high],
            [fall / (6.0 * after**2), -fall / (2.0 * after), 0.5 * fall,
             high + 5.0 / 6.0 * fall * after],
        ]
        columns = np.array(ends).T
        return PPoly(np.hstack([columns[:, :2], spline.c, columns[:, 2:]]), knots)

    def parameters(self) -> Array:
        """Level, number of pieces, whether they repeat, the knots and the coefficients."""
        return np.concatenate([[0.0], piecewise_parameters(self._curve, self.periodic)])

    @cached_property
    def steepest_slope(self) -> float:
        """Largest magnitude of the slope."""
        return max(abs(value) for value in curve_range(self._curve.derivative()))

    @cached_property
    def height_range(self) -> tuple[float, float]:
        """Smallest and largest height [m], also between the points."""
        return curve_range(self._curve)

    @cached_property
    def shortest_wavelength(self) -> float | None:
        """Wavelength of the sine with the same range and steepest slope [m]; None when flat.

        At least twice the shortest distance of points.
        """
        return equivalent_period(self._curve)
