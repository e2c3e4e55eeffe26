"""Measured heights of the ground over two directions."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np

from fecontact.core.checks import as_floats, as_path
from fecontact.core.compiled import helper, kernel
from fecontact.core.errors import InputError, require_finite, require_positive
from fecontact.core.records import Matrix, Vector
from fecontact.core.types import Array, ArrayLike
from fecontact.core.units import Unit
from fecontact.laws.data_columns import read_columns
from fecontact.laws.ground.scanned_heights import is_scan, read_scan
from fecontact.laws.signatures import ground_surface, surface_at

# Leading parameters of the kernel: level, origin, spacing, numbers of points.
_HEAD = 7

_UNEVEN = 0.01  # of the spacing: rounding of the places in a file


@kernel
def _shape(address: int, x: Vector, y: Vector, p: Vector, out: Matrix) -> None:
    for k in range(len(x)):
        found = surface_at(address)(x[k], y[k], p)
        for c in range(6):
            out[k, c] = found[c]


@helper
def _weights(u):
    """Cubic B-spline weights of four points at the part u of an interval, with two derivatives."""
    v = 1.0 - u
    return ((v * v * v / 6.0, (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0,
             (4.0 - 6.0 * v * v + 3.0 * v * v * v) / 6.0, u * u * u / 6.0),
            (-0.5 * v * v, u * (1.5 * u - 2.0), v * (2.0 - 1.5 * v), 0.5 * u * u),
            (v, 3.0 * u - 2.0, 3.0 * v - 2.0, u))


@ground_surface
def _spline(x, y, p):
    nx, ny = int(p[5]), int(p[6])
    a, b = (x - p[1]) / p[3], (y - p[2]) / p[4]
    i, k = math.floor(a), math.floor(b)
    wx, sx, bx = _weights(a - i)
    wy, sy, by = _weights(b - k)
    height, zx, zy, zxx, zxy, zyy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for r in range(4):
        row = int(i + r - 1) % nx
        level, slope, bend = 0.0, 0.0, 0.0
        for c in range(4):
            value = p[7 + row * ny + int(k + c - 1) % ny]
            level += wy[c] * value
            slope += sy[c] * value
            bend += by[c] * value
        height += wx[r] * level
        zx += sx[r] * level
        zy += wx[r] * slope
        zxx += bx[r] * level
        zxy += sx[r] * slope
        zyy += wx[r] * bend
    return (p[0] + height, zx / p[3], zy / p[4], zxx / (p[3] * p[3]), zxy / (p[3] * p[4]),
            zyy / (p[4] * p[4]))


def _even_places(where: str, axis: str, given: Array) -> tuple[float, float, int]:
    """First place, distance and number of the different places along an axis."""
    order = np.sort(given)
    step = float(np.ptp(order)) / max(len(order) - 1, 1)
    places = order[np.append(True, np.diff(order) > 1e-3 * step)]
    count = len(places)
    if count < 2:
        raise InputError(f"{where} has one {axis} only, {order[0]:g}; a map of heights needs at "
                         f"least four different x and y.")
    spacing = float(places[-1] - places[0]) / (count - 1)
    away = np.abs(places - np.linspace(places[0], places[-1], count))
    if away.max() > _UNEVEN * spacing:
        worst = int(away.argmax())
        raise InputError(f"{where} has uneven places in {axis}: {places[worst]:g} is not a whole "
                         f"number of spacings, {spacing:g} m, from {places[0]:g}; interpolate the "
                         f"heights to an even grid.")
    return float(places[0]), spacing, count


@dataclass(frozen=True)
class HeightMap:
    r"""Heights of the ground below solids, measured over a grid that repeats itself.

    .. math:: z(x, y) = \sum_{ij} c_{ij}\, B_3\left(\tfrac{x - x_0}{h_x} - i\right)
        B_3\left(\tfrac{y - y_0}{h_y} - j\right)

    the bicubic spline through all points, with continuous slopes and curvatures. The map is
    repeated in both directions: its last row borders on its first one.

    Parameters
    ----------
    heights : (N, M) sequence
        Heights z at N places in x and M in y, positive out of the ground; at least 4 x 4 [m].
    spacing_x, spacing_y : float
        Distances h_x and h_y between the points, positive; required with heights [m].
    origin_x, origin_y : float
        Place of the first point [m].
    file : str, optional
        Text or CSV file with columns x, y and height in metres, one line for each point of the grid
        in any order, instead of all the others; lines before the first of numbers are a header.
        Or a scan: SDF, X3P, OPD and other formats of profilometers, whose first point is the
        origin, by ``pip install 'fecontact[topography]'``; points that were not measured are
        interpolated. It is read once; then ``file`` is None.

    Raises
    ------
    InputError
        For heights that are not a grid of finite numbers, or are too few, and for files whose
        points are not those of an even grid.
    """

    kernel: ClassVar = _spline

    heights: Annotated[tuple[tuple[float, ...], ...], Unit("m")] = ()
    spacing_x: Annotated[float, Unit("m")] = 0.0
    spacing_y: Annotated[float, Unit("m")] = 0.0
    origin_x: Annotated[float, Unit("m")] = 0.0
    origin_y: Annotated[float, Unit("m")] = 0.0
    file: str | None = None

    def __post_init__(self) -> None:
        if self.file is not None:
            self._read(self.file)
        require_positive("HeightMap", spacing_x=self.spacing_x, spacing_y=self.spacing_y)
        require_finite("HeightMap", origin_x=self.origin_x, origin_y=self.origin_y)
        grid = as_floats(self.heights, "HeightMap: heights")
        if grid.ndim != 2 or min(grid.shape) < 4 or not np.isfinite(grid).all():
            raise InputError(f"HeightMap: heights of shape {grid.shape} must be a grid of finite "
                             f"numbers, at least 4 x 4.")
        object.__setattr__(self, "heights", tuple(tuple(row) for row in grid.tolist()))

    def _read(self, file: str) -> None:
        """Take over the heights, the spacing and the origin of a file."""
        as_path(file, "a height map")
        for name in ("heights", "spacing_x", "spacing_y", "origin_x", "origin_y"):
            if np.size(given := getattr(self, name)) and np.any(given):
                raise InputError(f"HeightMap: file = {file!r} cannot be combined with {name}; give "
                                 f"the file alone, or the heights and their spacing.")
        if is_scan(file):
            heights, dx, dy = read_scan("HeightMap", file)
            self._take(heights, dx, dy, 0.0, 0.0)
            return
        x, y, z = read_columns("HeightMap", file, ("x", "y", "height"))
        where = f"HeightMap: file = '{file}'"
        first, step, n = _even_places(where, "x", x)
        first_y, step_y, m = _even_places(where, "y", y)
        at = np.rint((x - first) / step) * m + np.rint((y - first_y) / step_y)
        if len(z) != n * m or len(np.unique(at)) != n * m:
            raise InputError(f"{where} has {len(z)} lines, but its {n} different x and {m} "
                             f"different y make a grid of {n * m} points; give each point once.")
        self._take(z[np.argsort(at)].reshape(n, m), step, step_y, first, first_y)

    def _take(self, heights: Array, dx: float, dy: float, x: float, y: float) -> None:
        for name, value in (("heights", heights), ("spacing_x", dx), ("spacing_y", dy),
                            ("origin_x", x), ("origin_y", y), ("file", None)):
            object.__setattr__(self, name, value)

    def parameters(self) -> Array:
        """Level, origin, spacing, numbers of points and the coefficients c."""
        return np.concatenate([[0.0, self.origin_x, self.origin_y, self.spacing_x, self.spacing_y],
                               np.shape(self.heights), self._coefficients.ravel()])

    @cached_property
    def _coefficients(self) -> Array:
        from scipy.ndimage import spline_filter

        return np.asarray(spline_filter(np.array(self.heights), order=3, mode="grid-wrap"))

    @cached_property
    def _samples(self) -> Array:
        """The six values of the map at points four times as dense."""
        n, m = np.shape(self.heights)
        x = self.origin_x + self.spacing_x * np.arange(4 * n) / 4.0
        y = self.origin_y + self.spacing_y * np.arange(4 * m) / 4.0
        return self.shape(*np.meshgrid(x, y, indexing="ij"))

    @cached_property
    def steepest_slope(self) -> float:
        """Upper bound of the slope, by the differences of the coefficients."""
        c = self._coefficients
        along = np.abs(c - np.roll(c, 1, axis=0)).max() / self.spacing_x
        across = np.abs(c - np.roll(c, 1, axis=1)).max() / self.spacing_y
        return float(np.hypot(along, across))

    @cached_property
    def height_range(self) -> tuple[float, float]:
        """Bounds of the height [m], by the coefficients."""
        return float(self._coefficients.min()), float(self._coefficients.max())

    @cached_property
    def shortest_wavelength(self) -> float | None:
        """Wavelength of the sine with the same range and steepest slope [m]; None when flat.

        At least twice the smaller spacing.
        """
        heights = self._samples[..., 0]
        slope = float(np.hypot(self._samples[..., 1], self._samples[..., 2]).max())
        if np.ptp(heights) == 0.0 or slope == 0.0:
            return None
        return max(math.pi * float(np.ptp(heights)) / slope,
                   2.0 * min(self.spacing_x, self.spacing_y))

    @property
    def flat(self) -> bool:
        """Whether the height is the same everywhere."""
        return self.shortest_wavelength is None

    def shape(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Height, z_x, z_y, z_xx, z_xy and z_yy (..., 6) at places (...,) of its own frame [m]."""
        along, across = as_floats(x, "HeightMap: x"), as_floats(y, "HeightMap: y")
        try:
            places = np.broadcast_arrays(along, across)
        except ValueError:
            raise InputError(f"HeightMap: x has the shape {along.shape}, y {across.shape}; give "
                             f"both for each place.") from None
        out = np.empty((places[0].size, 6))
        _shape(self.kernel.address, places[0].ravel(), places[1].ravel(), self.parameters(), out)
        return out.reshape(*places[0].shape, 6)
