"""Rough surfaces with the bearing-area curve of a measured profile."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from fecontact.core.errors import InputError, require_positive, shown
from fecontact.core.tables import located
from fecontact.core.types import Array
from fecontact.core.units import Unit
from fecontact.laws.base import ABOVE_ZERO, PerNode
from fecontact.laws.data_columns import numbers, read_columns, require_growing
from fecontact.laws.normal.rough_surface import RoughSurface, bed_of_asperities
from fecontact.laws.signatures import normal_law

_INTERVALS, _HEAD, _KNOT = 64, 3, 3
_HALF = np.linspace(0.0, 1.0, _INTERVALS // 2 + 1) ** 2 / 2.0
# Dense at both ends, where the curve of rounded peaks and valleys is a square root.
_DEPTHS = np.concatenate([_HALF, 1.0 - _HALF[-2::-1]])
_UNIFORM = (0.0, 0.5, 1.0)


@normal_law
def _measured(u, v, p):
    s = u / p[1]
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    if s < 1.0:
        # The interval of `_DEPTHS`, its start and its width.
        if s < 0.5:
            k = min(int(_INTERVALS * math.sqrt(0.5 * s)), _INTERVALS // 2 - 1)
            start = k * k
            width = 2 * k + 1
        else:
            left = min(int(_INTERVALS * math.sqrt(0.5 * (1.0 - s))), _INTERVALS // 2 - 1)
            k = _INTERVALS - 1 - left
            start = _INTERVALS * _INTERVALS // 2 - (left + 1) * (left + 1)
            width = 2 * left + 1
        unit = 2.0 / (_INTERVALS * _INTERVALS)
        length = width * unit
        x = (s - start * unit) / length
        i = _HEAD + _KNOT * k
        h, m = p[i + 1], p[i + 2] * length
        rise, m_next = p[i + 4] - h, p[i + 5] * length
        b, c = 3.0 * rise - 2.0 * m - m_next, m + m_next - 2.0 * rise
        compression = p[i] + x * length * (h + x * (m / 2.0 + x * (b / 3.0 + x * c / 4.0)))
        bearing = h + x * (m + x * (b + x * c))
        density = (m + x * (2.0 * b + x * 3.0 * c)) / length
    else:
        compression, bearing, density = p[_HEAD + _KNOT * _INTERVALS] + s - 1.0, 1.0, 0.0
    return bed_of_asperities(v, p, compression, bearing, density)


@dataclass(frozen=True)
class MeasuredSurface(RoughSurface):
    r"""Rough surface with a measured bearing-area (Abbott-Firestone) curve.

    .. math:: F = \max(0,\ c R_Z f(s) + \beta c\, h(s)\, v), \qquad s = u / R_Z

    h(s) is the fraction of the surface above the depth s R_Z below the highest peak, by monotone
    cubic interpolation over 64 intervals, and 1 for s > 1; f is the exact integral of that curve.
    Forces below s = 1/64 follow from this interpolation, not from the shape of the highest peaks.
    u is the penetration [m], v its rate [m/s], F the normal force on the body [N], never tensile.
    See :meth:`from_heights` and :meth:`from_file` for profiles.

    Parameters
    ----------
    bearing : sequence
        Bearing fractions h, from 0 at the highest peak to 1 at the deepest valley, not decreasing;
        the same at all nodes. By default heights are uniform.
    depths : sequence
        Depths s of these fractions below the highest peak, divided by R_Z, ascending from 0 to 1;
        equally spaced by default.
    file : str, optional
        File of heights, see :meth:`from_file`, instead of ``bearing``, ``depths`` and
        ``roughness_height``. It is read once; then ``file`` is None.
    scale : float
        Factor from the file's heights to m, positive; 1 after reading.

    Raises
    ------
    InputError
        For values outside these ranges, or an invalid file.
    """

    kernel: ClassVar = _measured
    shared_fields: ClassVar = frozenset({"bearing", "depths", "file", "scale"})
    own_fields: ClassVar = shared_fields

    # From the file if there is one.
    roughness_height: Annotated[
        PerNode | None, ABOVE_ZERO, Unit("m")] = None  # type: ignore[assignment]
    bearing: tuple[float, ...] = _UNIFORM
    depths: tuple[float, ...] = ()
    file: str | None = None
    scale: float = 1.0

    def __post_init__(self) -> None:
        require_positive("MeasuredSurface", scale=self.scale)
        if self.file is not None:
            self._read(self.file)
        elif self.scale != 1.0:
            raise InputError(f"MeasuredSurface: scale = {self.scale!r} has no effect without "
                             f"file; leave it out.")
        if self.roughness_height is None:
            raise InputError("MeasuredSurface lacks roughness_height, the peak-to-valley height "
                             "of the surface [m]; give it, or the file of a profile.")
        super().__post_init__()
        h = numbers("MeasuredSurface", "bearing", self.bearing)
        if len(h) < 3 or h[0] != 0.0 or h[-1] != 1.0 or (np.diff(h) < 0.0).any():
            raise InputError(f"MeasuredSurface: bearing = {shown(list(h))} must be at least three "
                             f"numbers that start with 0, never fall and end with 1.")
        s = numbers("MeasuredSurface", "depths", self.depths)
        if len(s) and (len(s) != len(h) or s[0] != 0.0 or s[-1] != 1.0
                       or (np.diff(s) <= 0.0).any()):
            raise InputError(f"MeasuredSurface: depths = {shown(list(s))} must be as many "
                             f"numbers as bearing has, growing from 0 to 1.")
        object.__setattr__(self, "bearing", h)
        object.__setattr__(self, "depths", s)

    def _read(self, file: str) -> None:
        defaults = {entry.name: entry.default for entry in fields(self)}
        given = ("bearing", "depths", "roughness_height")
        for name in given:
            if not np.array_equal(getattr(self, name), defaults[name]):  # type: ignore[arg-type]
                raise InputError(f"MeasuredSurface: file = {file!r} cannot be combined with "
                                 f"{name}, which it determines; leave one of them out.")
        measured = MeasuredSurface.from_file(file, scale=self.scale, stiffness=self.stiffness)
        for name in given:
            object.__setattr__(self, name, getattr(measured, name))
        object.__setattr__(self, "file", None)
        object.__setattr__(self, "scale", 1.0)

    @classmethod
    def from_heights(
        cls,
        heights: Sequence[float] | Array,
        abscissa: Sequence[float] | Array | None = None,
        *,
        stiffness: PerNode,
        damping: PerNode = 0.0,
    ) -> Self:
        """The surface of a profile trace, linear between its points.

        Parameters
        ----------
        heights : (N,) sequence
            Heights along the trace, positive out of the material [m]; R_Z is their range.
        abscissa : (N,) sequence, optional
            Positions of the heights, ascending [m]; equally spaced by default.
        stiffness, damping : float or (n,) sequence
            c [N/m] and beta c [N s/m].

        Raises
        ------
        InputError
            For fewer than three heights, heights that are all equal or not finite, or an abscissa
            that is not ascending.
        """
        owner = "MeasuredSurface"
        z = np.array(numbers(owner, "heights", heights, least=3))
        x = np.arange(len(z), dtype=float)
        if abscissa is not None:
            x = np.array(numbers(owner, "abscissa", abscissa))
            if len(x) != len(z):
                raise InputError(f"{owner}: abscissa has {len(x)} values for {len(z)} heights.")
            require_growing(owner, "abscissa", x)
        if np.ptp(z) == 0.0:
            raise InputError(f"MeasuredSurface: all heights are {z[0]:g}; a rough surface has at "
                             f"least two different ones.")
        low, high = np.minimum(z[1:], z[:-1]), np.maximum(z[1:], z[:-1])
        width = np.diff(x) / (x[-1] - x[0])
        flat = high == low
        bearing = np.zeros(_INTERVALS + 1)
        bearing[-1] = 1.0
        for k, level in enumerate(z.max() - np.ptp(z) * _DEPTHS[1:-1], start=1):
            above = np.where(flat, low >= level, (high - level) / np.where(flat, 1.0, high - low))
            bearing[k] = min(1.0, width @ np.clip(above, 0.0, 1.0))
        return cls(stiffness, float(np.ptp(z)), damping,
                   tuple(np.maximum.accumulate(bearing).tolist()), tuple(_DEPTHS.tolist()))

    @classmethod
    def from_file(
        cls, file: str | Path, *, stiffness: PerNode, scale: float = 1.0, **options: Any
    ) -> Self:
        """The surface of a trace in a text file.

        Parameters
        ----------
        file : path
            Text or CSV with a column of heights, or columns of abscissae and heights, separated by
            semicolons, tabs, commas or blanks; lines before the first line of numbers are a header,
            ``#`` starts a comment. A decimal comma needs semicolons, tabs or quotes.
        stiffness : float or (n,) sequence
            c [N/m].
        scale : float
            Factor from the file's heights to m; the unit of the abscissae does not matter.
        **options
            See :meth:`from_heights`.

        Raises
        ------
        InputError
            For a file that cannot be read, with the faulty line.
        """
        require_positive("MeasuredSurface", scale=scale)
        columns = read_columns("MeasuredSurface", file, ("abscissa", "height"),
                               first_optional=True)
        heights = scale * columns[-1]
        with located(f"MeasuredSurface: file = '{file}':", "MeasuredSurface"):
            return cls.from_heights(heights, None if len(columns) == 1 else columns[0],
                                    stiffness=stiffness, **options)

    def table(self, share: Array) -> Array:
        """Parameters (n, 3 + 3 k): c, R_Z, beta c, and f, h, h' at k depths."""
        curve = self._curve()
        knots = np.column_stack([curve.antiderivative()(_DEPTHS), curve(_DEPTHS),
                                 curve.derivative()(_DEPTHS)]).reshape(-1)
        return np.column_stack([super().table(share), np.tile(knots, (len(share), 1))])

    def untouched(self, nodes: int) -> Array:
        """Zero (n,), the place of the highest peak."""
        return np.full(nodes, 0.0 if self.kernel is _measured else -np.inf)

    def _curve(self) -> Any:
        from scipy.interpolate import PchipInterpolator

        depths = self.depths or np.linspace(0.0, 1.0, len(self.bearing))
        given = PchipInterpolator(depths, self.bearing)
        return PchipInterpolator(_DEPTHS, np.clip(given(_DEPTHS), 0.0, 1.0))

    @property
    def _complete(self) -> float:
        return float(self._curve().antiderivative()(1.0))

    def _energy(self, s: Array, table: Array) -> Array:
        return np.asarray(self._curve().antiderivative(2)(s))
