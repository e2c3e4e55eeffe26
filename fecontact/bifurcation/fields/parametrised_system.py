"""Contact systems as functions of parameters, with interpolated arrays.

Building a system and its arrays takes some 0.2 ms of Python. Most arrays are constant or affine in
each parameter; these are interpolated between the corners of a box, after a check at further
points of it, which numbers of drives and loads need not: how they enter is known. The boxes lie
about the base values, each twice as wide as the one before, so that the result depends on the
parameter values alone and not on earlier calls. Where ranges are given, they are the first box.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import product
from numbers import Real
from typing import Any

import numpy as np

from fecontact.bifurcation.fields.corners import AffineArrays, Corners, NotAffineError
from fecontact.core.checks import require_kind
from fecontact.core.dotted_parameters import with_parameters
from fecontact.core.errors import FecontactError, InputError
from fecontact.core.types import Array
from fecontact.core.user_code import made_by
from fecontact.system.arrays import multilinear
from fecontact.system.contact_system import ContactSystem
from fecontact.system.nodes import SystemArrays

Setter = Callable[[ContactSystem, float], ContactSystem]

_CACHED_BOXES = 64
# With more parameters the corners cost more than they save.
_MOST_PARAMETERS = 4
# Largest number of doublings of the box; values farther away are not interpolated.
_MOST_LEVELS = 50
# Part of a range by which its box is wider, for differences at its ends.
_BEYOND = 0.02
# Part of a box, about its middle, within which base values serve to check what is affine.
_WITHIN = 0.9


class ParametrisedSystem:
    """Systems of the same size for parameter values (k,).

    Attributes
    ----------
    base : ContactSystem
        The system before any of the parameters is set.
    parameters : dict
        Names and base values.
    setters : list of functions
        Each makes a system from a system and a value of the parameter.
    own : frozenset of str
        Names of those that a function of the user sets.
    multilinear : bool
        Whether the arrays are known to be affine in each parameter.

    ``ranges`` are those of the parameters, for all of them or none.
    """

    def __init__(
        self, system: ContactSystem, parameters: Mapping[str, Any] | Iterable[str],
        ranges: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        require_kind("A field of a system", ContactSystem, system=system)
        require_kind("A field of a system", Iterable, names=parameters)
        given = (parameters if isinstance(parameters, Mapping)
                 else dict.fromkeys([parameters] if isinstance(parameters, str) else parameters))
        self.base = system
        self._asked = given, ranges
        self.parameters: dict[str, float] = {}
        self.setters: list[Setter] = []
        for name, value in given.items():
            self.parameters[name], setter = _parameter(system, name, value)
            self.setters.append(setter)
        self.own = frozenset(name for name, value in given.items() if isinstance(value, tuple))
        self.multilinear = not self.own and multilinear(self.parameters, system.drive, system.load)
        self._made: OrderedDict[bytes, ContactSystem] = OrderedDict()
        self._size = system.size
        self._known: bytes | None = None
        values = np.array(list(self.parameters.values()), dtype=float)
        if all(value is None for value in given.values()):
            self._known = values.tobytes()
        self._latest: tuple[bytes, SystemArrays] | None = None
        self._boxes: dict[tuple[int, ...], Corners | None] = {}
        self._intervals: dict[tuple[int, int], tuple[float, float]] = {}
        self._base, self._width = values, np.where(values != 0.0, 0.05 * np.abs(values), 0.05)
        self._first: Corners | None = None
        self._given: Corners | None = None
        # The box used last, and its range of values.
        self._recent: tuple[list[tuple[float, float]], Corners] | None = None
        if 0 < len(values) <= _MOST_PARAMETERS:
            self.system(values)
            self._first = self._between(ranges or {}) or self._box((0,) * len(values))
        self._fixed = self.system(values).arrays if not len(values) else None

    def on(self, system: ContactSystem) -> "ParametrisedSystem":
        """Return the family of another system over these parameters."""
        return ParametrisedSystem(system, *self._asked)

    def with_parameter(self, name: str, value: float, setter: Setter) -> "ParametrisedSystem":
        """Return the family over these parameters and, behind them, one that a function sets."""
        given, _ = self._asked
        known = given if isinstance(given, Mapping) else dict.fromkeys(given)
        return ParametrisedSystem(self.base, {**known, name: (value, setter)})

    def _between(self, ranges: Mapping[str, tuple[float, float]]) -> Corners | None:
        """A box of ranges that are given; None where some are not, or none is affine over it."""
        if set(ranges) != set(self.parameters):
            return None
        low, high = np.array([ranges[name] for name in self.parameters], dtype=float).T
        if not (np.isfinite(low).all() and np.isfinite(high).all() and (low < high).all()):
            return None
        for beyond in (_BEYOND, 0.0):
            try:
                self._given = _corners_between(self, low - beyond * (high - low),
                                       high + beyond * (high - low))
            except (NotAffineError, FecontactError):
                continue
            return self._given
        return None

    def system(self, values: Array) -> ContactSystem:
        """The system itself; those made last are kept.

        Raises
        ------
        InputError
            If a value is out of its parameter's range, or changes the number of states.
        """
        key = values.tobytes()
        found = self._made.get(key)
        if found is not None:
            return found
        made = self.base
        if key == self._known:
            return made
        for setter, value in zip(self.setters, values.tolist(), strict=True):
            made = setter(made, value)
        if made.size != self._size:
            raise InputError(f"The parameters {_named(self.parameters, values)} make a system of "
                             f"{made.size} states from one of {self._size}; their number must "
                             f"stay the same.")
        self._made[key] = made
        if len(self._made) > _CACHED_BOXES:
            self._made.popitem(last=False)
        return made

    def excited(self, values: Array) -> SystemArrays:
        """Arrays for values of drives and loads alone, without a system that is kept.

        Raises
        ------
        InputError
            If a value is out of its parameter's range.
        """
        parts = {name.partition(".")[0] for name in self.parameters}
        return self.base.arrays_with(with_parameters(
            {part: getattr(self.base, part) for part in parts},
            dict(zip(self.parameters, values.tolist(), strict=True))))

    @property
    def base_values(self) -> Array:
        """Values (k,) of the parameters before any is set."""
        return self._base

    def made_for(self, values: Array, index: int) -> list[float]:
        """Values of one parameter, the others as given, for which there are systems already."""
        known = [np.frombuffer(key) for key in self._made]
        others = np.delete(values, index).tolist()
        return [float(each[index]) for each in known
                if np.delete(each, index).tolist() == others]

    def arrays(self, values: Array) -> SystemArrays:
        """Arrays of the system for the kernels."""
        if self._fixed is not None:
            return self._fixed
        key = values.tobytes()
        if self._latest is not None and self._latest[0] == key:
            return self._latest[1]
        corners = self._corners_of(values)
        found = self.system(values).arrays if corners is None else corners.at(values)
        self._latest = (key, found)
        return found

    def slopes(self, values: Array, index: int, step: float) -> SystemArrays:
        """Derivatives of the arrays to one parameter; addresses of laws and the like unchanged.

        Where arrays are not affine they are differences of fourth order over a step, which may
        leave the allowed range.
        """
        corners = None if self._fixed is not None else self._corners_of(values)
        if corners is not None:
            return corners.slopes(values, index)
        sides = []
        for place in (1.0, -1.0, 2.0, -2.0):
            moved = values.copy()
            moved[index] += place * step
            sides.append(self.system(moved).arrays)
        here = self.system(values).arrays
        return SystemArrays(*(_slope(step, *each) for each in zip(here, *sides, strict=True)))

    def affine(self, values: Array, index: int) -> AffineArrays | None:
        """Arrays over one parameter about its value; None where they are not affine in it."""
        corners = None if self._fixed is not None else self._corners_of(values)
        return None if corners is None else corners.along(values, index)

    def _corners_of(self, values: Array) -> Corners | None:
        """The box for these values; None where they are not interpolated."""
        if self._first is None:
            return None
        if self._given is not None and self._given.hold(values):
            return self._given
        if self._recent is not None and _inside(values, self._recent[0]):
            return self._recent[1]
        levels = tuple(_level(value - base, width) for value, base, width in zip(
            values.tolist(), self._base.tolist(), self._width.tolist(), strict=True))
        if any(abs(level) > _MOST_LEVELS for level in levels):
            return None
        corners = self._box(levels)
        if corners is None or not corners.hold(values):
            return None
        self._recent = [
            (max(low, base + least), min(high, base + most))
            for low, high, base, (least, most) in zip(
                corners.low.tolist(), corners.high.tolist(), self._base.tolist(),
                map(_offsets, levels, self._width.tolist()), strict=True)], corners
        return corners

    def _box(self, levels: tuple[int, ...]) -> Corners | None:
        """The box of given doublings in each parameter; None if no array is affine in it."""
        if levels not in self._boxes:
            low, high = np.array([self._interval(index, level)
                                  for index, level in enumerate(levels)]).T
            try:
                made = _corners_between(self, low, high)
            except (NotAffineError, FecontactError):
                made = None
            self._boxes[levels] = made
        return self._boxes[levels]

    def _interval(self, index: int, level: int) -> tuple[float, float]:
        """Interval of one parameter about its base value, within its range."""
        key = (index, level)
        if key not in self._intervals:
            base, width = float(self._base[index]), float(self._width[index])
            far = base + np.copysign(1.0, level) * width * 2.0 ** (abs(level) - 1 if level else 0)
            # Zero is a likely end of a range.
            ends = [end for end in (far, 0.0) if self._allowed(index, end)
                    and abs(end - base) <= abs(far - base)]
            beside = base - np.copysign(1.0, level) * width
            if not self._allowed(index, beside):
                beside = base
            end = ends[0] if ends else base
            if end == beside:
                end = base + np.copysign(1.0, level) * width
            self._intervals[key] = (min(end, beside), max(end, beside))
        return self._intervals[key]

    def _allowed(self, index: int, value: float) -> bool:
        values = self._base.copy()
        values[index] = value
        try:
            self.system(values)
        except FecontactError:
            return False
        return True

    @property
    def varying(self) -> frozenset[str] | None:
        """Names of the arrays that depend on the parameters; None where that is not known."""
        if self._fixed is not None:
            return frozenset()
        return None if self._first is None else self._first.varying


def _slope(step: float, here: Any, above: Any, below: Any, far_above: Any, far_below: Any) -> Any:
    """Derivative of fourth order of one array; ``here`` if it does not hold numbers of laws."""
    if not (isinstance(here, np.ndarray) and here.dtype.kind == "f"):
        return here
    return (8.0 * (above - below) - (far_above - far_below)) / (12.0 * step)


def _level(off: float, width: float) -> int:
    """Least n, with the sign of ``off``, for which |off| lies within 2^(|n| - 1) widths."""
    if abs(off) <= width:
        return 0 if off >= 0.0 else -1
    doublings = int(np.ceil(np.log2(abs(off) / width))) if np.isfinite(off) else _MOST_LEVELS
    return (doublings + 1) * (1 if off > 0.0 else -1)


def _offsets(level: int, width: float) -> tuple[float, float]:
    """Offsets between which :func:`_level` gives a level in spite of rounding."""
    far = (1.0 - 1e-9) * width * 2.0 ** (abs(level) - 1 if level else 0)
    near = (1.0 + 1e-9) * width * 2.0 ** (abs(level) - 2) if abs(level) > 1 else 0.0
    return (near, far) if level >= 0 else (-far, -near)


def _inside(values: Array, limits: list[tuple[float, float]]) -> bool:
    for value, (low, high) in zip(values.tolist(), limits, strict=True):
        if not low <= value < high:
            return False
    return True


def _corners_between(family: ParametrisedSystem, low: Array, high: Array) -> Corners:
    # The first parameter changes fastest, as in the weights.
    order = [np.array(corner[::-1])
             for corner in product(*zip(low[::-1].tolist(), high[::-1].tolist(), strict=True))]
    if family.multilinear:
        return Corners(low, high, [family.excited(corner) for corner in order])
    result = Corners(low, high, [family.system(corner).arrays for corner in order])
    inside = np.modf(np.sqrt(2.0) * np.arange(1.0, 1.0 + len(low)))[0]
    other, base = low + (1.0 - inside**2) * (high - low), family.base_values
    # There is a system for the base values already.
    if (np.abs(base - 0.5 * (low + high)) < 0.5 * _WITHIN * (high - low)).all():
        other = base
    for point in (low + inside * (high - low), other):
        if not result.agrees(family.system(point).arrays, point):
            raise NotAffineError
    return result


def _parameter(system: ContactSystem, name: str, given: Any) -> tuple[float, Setter]:
    """Base value and setter of a parameter."""
    if isinstance(given, tuple) and len(given) == 2 and callable(given[1]):
        value, own = given
        if not isinstance(value, Real) or isinstance(value, bool):
            raise InputError(f"Parameter {name!r}: its value {value!r} must be a number.")
        return float(value), partial(made_by, own)
    if given is not None and (not isinstance(given, Real) or isinstance(given, bool)):
        raise InputError(f"Parameter {name!r} = {given!r} must be a number, None for the value "
                         f"that the system has, or a pair (value, function) of a function "
                         f"(system, value) -> system.")
    known = system.parameter(name)
    if known is None:
        system.with_(**{name: given})  # raises, with the names that exist
    value = known if given is None else given
    if not isinstance(value, Real) or isinstance(value, bool):
        raise InputError(f"Parameter {name!r} has the value {value!r}, which is not one number; "
                         f"give a pair (value, function) instead.")
    return float(value), partial(_with_value, name)


def _with_value(name: str, system: ContactSystem, number: float) -> ContactSystem:
    """The system with another value of a parameter; a function of its own can be pickled."""
    return system.with_(**{name: number})


def _named(parameters: Mapping[str, float], values: Array) -> str:
    return ", ".join(f"{name} = {value:g}"
                     for name, value in zip(parameters, values.tolist(), strict=True))
