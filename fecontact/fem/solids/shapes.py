"""Solids described by their dimensions.

z is normal to the ground, which lies below; the boundary ``contact`` faces it.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from fecontact.core.errors import InputError, choices, require_not_negative, require_positive
from fecontact.core.units import Unit

SolidElement = Literal["hexahedron", "tetrahedron"]

_SAME = 1e-9  # relative: lengths that differ by less are equal


@dataclass(frozen=True)
class SolidBlock:
    """A box [0, length] x [0, width] x [0, height] with all or part of its bottom as contact face.

    Boundaries ``contact`` (centred part of the bottom), ``bottom`` (the rest of it, if any),
    ``left`` (x = 0), ``right``, ``front`` (y = 0), ``back``, ``top``; points ``B`` (middle of the
    left face, at ``drive_height``) and ``C`` (middle of the top).

    Parameters
    ----------
    length, width, height : float
        Sides along x, y and z [m].
    contact_length, contact_width : float or None
        Sides of the contact face along x and y [m]; None for those of the block.
    drive_height : float or None
        Height of B [m]; None for mid-height.
    element_size : float
        Longest side of a hexahedron [m].
    element : "hexahedron" or "tetrahedron"
        Tetrahedra are hexahedra cut into six.

    Raises
    ------
    InputError
        For a value that is not a finite number above zero, a contact face larger than the bottom,
        a drive above the top, or another element.
    """

    length: Annotated[float, Unit("m")] = 0.1
    width: Annotated[float, Unit("m")] = 0.06
    height: Annotated[float, Unit("m")] = 0.04
    contact_length: Annotated[float | None, Unit("m")] = None
    contact_width: Annotated[float | None, Unit("m")] = None
    drive_height: Annotated[float | None, Unit("m")] = None
    element_size: Annotated[float, Unit("m")] = 0.01
    element: SolidElement = "hexahedron"

    def __post_init__(self) -> None:
        require_positive("SolidBlock", length=self.length, width=self.width, height=self.height,
                         element_size=self.element_size)
        for name, limit in (("contact_length", "length"), ("contact_width", "width")):
            if (value := getattr(self, name)) is not None:
                require_positive("SolidBlock", **{name: value})
                _require_at_most("SolidBlock", name, value, limit, getattr(self, limit))
        if self.drive_height is not None:
            require_not_negative("SolidBlock", drive_height=self.drive_height)
            _require_at_most("SolidBlock", "drive_height", self.drive_height, "height",
                             self.height)
        _require_element("SolidBlock", self.element)


@dataclass(frozen=True)
class Plate:
    """A plate [0, length] x [0, width] x [0, thickness] whose whole bottom is the contact face.

    Boundaries ``contact`` (bottom), ``top``, ``left`` (x = 0), ``right``, ``front`` (y = 0),
    ``back``; points ``B`` (middle of the left face), ``C`` (middle of the top) and
    ``bottom_edges`` (the four edges of the bottom, for line supports).

    Parameters
    ----------
    length, width, thickness : float
        Sides along x, y and z [m].
    element_size : float
        Longest side of a hexahedron along x and y [m].
    layers : int
        Hexahedra through the thickness.
    element : "hexahedron" or "tetrahedron"
        Tetrahedra are hexahedra cut into six.

    Raises
    ------
    InputError
        For a value that is not a finite number above zero, or another element.
    """

    length: Annotated[float, Unit("m")] = 0.2
    width: Annotated[float, Unit("m")] = 0.2
    thickness: Annotated[float, Unit("m")] = 0.005
    element_size: Annotated[float, Unit("m")] = 0.02
    layers: int = 1
    element: SolidElement = "hexahedron"

    def __post_init__(self) -> None:
        require_positive("Plate", length=self.length, width=self.width, thickness=self.thickness,
                         element_size=self.element_size)
        _require_count("Plate", "layers", self.layers)
        _require_element("Plate", self.element)


@dataclass(frozen=True)
class Ring:
    """An annular disc about the z axis, from z = 0 to its thickness; a full disc without a bore.

    Boundaries ``contact`` (bottom), ``top``, ``outer`` and, with a bore, ``inner``; points ``B``
    (on the outer face at y = 0, mid-height or the next node above) and ``C`` (on the top: above the
    middle of the full disc, else at y = 0 on the mean radius).

    Parameters
    ----------
    outer_radius, inner_radius : float
        [m]; an inner radius of zero gives a full disc.
    thickness : float
        [m]
    element_size : float
        Longest side of a hexahedron along the outer circumference, and of the others [m].
    layers : int or None
        Hexahedra through the thickness; None for as many as ``element_size`` asks for.
    element : "hexahedron" or "tetrahedron"
        Tetrahedra are hexahedra cut into six. Both are curved along the circumference.

    Raises
    ------
    InputError
        For a value that is not a finite number above zero, a bore that is not smaller than the
        disc, or another element.
    """

    outer_radius: Annotated[float, Unit("m")] = 0.1
    inner_radius: Annotated[float, Unit("m")] = 0.04
    thickness: Annotated[float, Unit("m")] = 0.01
    element_size: Annotated[float, Unit("m")] = 0.015
    layers: int | None = None
    element: SolidElement = "hexahedron"

    def __post_init__(self) -> None:
        require_positive("Ring", outer_radius=self.outer_radius, thickness=self.thickness,
                         element_size=self.element_size)
        require_not_negative("Ring", inner_radius=self.inner_radius)
        _require_below("Ring", "inner_radius", self.inner_radius, "outer_radius",
                       self.outer_radius)
        if self.layers is not None:
            _require_count("Ring", "layers", self.layers)
        _require_element("Ring", self.element)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder or tube that lies on the ground: its axis along y, its lowest line at z = 0.

    Boundaries ``contact`` (the lowest part of the curved face), ``outer`` (the rest of it),
    ``front`` (y = 0), ``back`` and, with a bore, ``inner``; points ``B`` (on the outer face at
    -x, mid-length) and ``C`` (on its top, mid-length).

    Parameters
    ----------
    radius, length : float
        [m]
    inner_radius : float
        Radius of the bore [m]; zero for none.
    contact_angle : float
        Angle that the contact face spans, seen from the axis, 20 to 160 [degrees].
    element_size : float
        Longest side of a hexahedron along the outer circumference, and of the others [m].
    element : "hexahedron" or "tetrahedron"
        Tetrahedra are hexahedra cut into six. Both are curved along the circumference.

    Raises
    ------
    InputError
        For a value out of range, a bore that is not smaller than the cylinder, or another element.
    """

    radius: Annotated[float, Unit("m")] = 0.02
    length: Annotated[float, Unit("m")] = 0.06
    inner_radius: Annotated[float, Unit("m")] = 0.0
    contact_angle: float = 60.0
    element_size: Annotated[float, Unit("m")] = 0.006
    element: SolidElement = "hexahedron"

    def __post_init__(self) -> None:
        require_positive("Cylinder", radius=self.radius, length=self.length,
                         element_size=self.element_size, contact_angle=self.contact_angle)
        require_not_negative("Cylinder", inner_radius=self.inner_radius)
        _require_below("Cylinder", "inner_radius", self.inner_radius, "radius", self.radius)
        if not 20.0 <= self.contact_angle <= 160.0:
            raise InputError(f"Cylinder: contact_angle = {self.contact_angle!r} must be from 20 "
                             f"to 160 degrees.")
        _require_element("Cylinder", self.element)


@dataclass(frozen=True)
class SphereSegment:
    """A round punch about the z axis, its bottom a segment of a sphere that touches the origin.

    Boundaries ``contact`` (the sphere within ``contact_radius`` of the axis), ``bottom`` (the rest
    of the sphere, if any), ``outer`` (the cylinder around it), ``top``; points ``B`` (on the outer
    face at -x, half-way up) and ``C`` (middle of the top). Elements grow from the contact face to
    the others.

    Parameters
    ----------
    radius : float
        Radius of the sphere [m].
    base_radius : float
        Radius of the body seen from above, at most 0.9 times that of the sphere [m].
    height : float
        Height of the body on its axis, more than the sphere rises to the outer face [m].
    contact_radius : float or None
        [m]; None for the whole bottom.
    contact_element_size : float or None
        Longest side of the elements at the contact face [m]; None for ``element_size``.
    element_size : float
        Longest side of a hexahedron far from the contact face [m].
    element : "hexahedron" or "tetrahedron"
        Tetrahedra are hexahedra cut into six. Both are curved.

    Raises
    ------
    InputError
        For a value out of range, or another element.
    """

    radius: Annotated[float, Unit("m")] = 0.05
    base_radius: Annotated[float, Unit("m")] = 0.02
    height: Annotated[float, Unit("m")] = 0.02
    contact_radius: Annotated[float | None, Unit("m")] = None
    contact_element_size: Annotated[float | None, Unit("m")] = None
    element_size: Annotated[float, Unit("m")] = 0.004
    element: SolidElement = "hexahedron"

    def __post_init__(self) -> None:
        require_positive("SphereSegment", radius=self.radius, base_radius=self.base_radius,
                         height=self.height, element_size=self.element_size)
        _require_at_most("SphereSegment", "base_radius", self.base_radius, "0.9 radius",
                         0.9 * self.radius)
        rise = self.radius - math.sqrt(self.radius**2 - self.base_radius**2)
        if self.height <= rise * (1 + _SAME):
            raise InputError(f"SphereSegment: height = {self.height!r} must be above the rise of "
                             f"the sphere to its outer face, {rise:.4g} m.")
        for name, limit in (("contact_radius", "base_radius"),
                            ("contact_element_size", "element_size")):
            if (value := getattr(self, name)) is not None:
                require_positive("SphereSegment", **{name: value})
                _require_at_most("SphereSegment", name, value, limit, getattr(self, limit))
        _require_element("SphereSegment", self.element)


@dataclass(frozen=True)
class LapStrip:
    """One of the two strips of a lap joint with bolt holes: its upper or its lower layer.

    The strips overlap in |x| <= overlap / 2 and touch at z = 0. The upper one reaches to the right,
    x = length - overlap / 2, and lies on the lower one, which reaches to the left. Both are as wide
    as 0 <= y <= width.

    Boundaries ``contact`` (the face in the overlap, of the upper layer facing -z, of the lower one
    +z), ``inner`` (the rest of that side), ``outer`` (the other side) without ``washer_1``,
    ``washer_2``, ... (rings around the holes, where bolts press), ``hole_1``, ... (bores), ``end``
    (the far end), ``tip`` (the near one), ``front`` (y = 0), ``back``; points ``B`` (middle of the
    far end) and ``C`` (middle of the edge of the near end, on the outer side).

    Parameters
    ----------
    length, width, thickness : float
        Size of a strip [m].
    overlap : float
        Overlap of the strips along x [m].
    holes_along, holes_across : int
        Number of holes along x and y, evenly spaced over the overlap.
    hole_radius, washer_radius : float
        [m]
    layer : "upper" or "lower"
    element_size : float
        Longest side of a hexahedron along x and y [m].
    layers : int
        Hexahedra through the thickness.
    element : "hexahedron" or "tetrahedron"
        Tetrahedra are hexahedra cut into six. Both are curved along the holes.

    Raises
    ------
    InputError
        For a value that is not a finite number above zero, an overlap beyond the strip, washers
        that do not fit, or another element or layer.
    """

    length: Annotated[float, Unit("m")] = 0.15
    width: Annotated[float, Unit("m")] = 0.04
    thickness: Annotated[float, Unit("m")] = 0.005
    overlap: Annotated[float, Unit("m")] = 0.06
    holes_along: int = 2
    holes_across: int = 1
    hole_radius: Annotated[float, Unit("m")] = 0.004
    washer_radius: Annotated[float, Unit("m")] = 0.008
    layer: Literal["upper", "lower"] = "upper"
    element_size: Annotated[float, Unit("m")] = 0.006
    layers: int = 1
    element: SolidElement = "hexahedron"

    def __post_init__(self) -> None:
        require_positive("LapStrip", length=self.length, width=self.width,
                         thickness=self.thickness, overlap=self.overlap,
                         hole_radius=self.hole_radius, washer_radius=self.washer_radius,
                         element_size=self.element_size)
        for name in ("holes_along", "holes_across", "layers"):
            _require_count("LapStrip", name, getattr(self, name))
        _require_below("LapStrip", "overlap", self.overlap, "length", self.length)
        _require_below("LapStrip", "hole_radius", self.hole_radius, "washer_radius",
                       self.washer_radius)
        room = 0.5 * min(self.overlap / self.holes_along, self.width / self.holes_across)
        if self.washer_radius > 0.95 * room:
            raise InputError(f"LapStrip: washer_radius = {self.washer_radius!r} must be at most "
                             f"{0.95 * room:.4g} m, so that washers and edges do not touch.")
        if self.layer not in ("upper", "lower"):
            raise InputError(f"LapStrip: layer = {self.layer!r} must be 'upper' or 'lower'.")
        _require_element("LapStrip", self.element)


SolidShape = SolidBlock | Plate | Ring | Cylinder | SphereSegment | LapStrip


def _require_element(owner: str, element: str) -> None:
    allowed = ("hexahedron", "tetrahedron")
    if element not in allowed:
        raise InputError(f"{owner}: element = {element!r} must be one of {choices(allowed)}.")


def _require_count(owner: str, name: str, value: int) -> None:
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise InputError(f"{owner}: {name} = {value!r} must be a whole number of at least 1.")


def _require_at_most(owner: str, name: str, value: float, limit_name: str, limit: float) -> None:
    if value > limit * (1 + _SAME):
        raise InputError(f"{owner}: {name} = {value!r} must not be above {limit_name} = {limit!r}.")


def _require_below(owner: str, name: str, value: float, limit_name: str, limit: float) -> None:
    if value >= limit * (1 - _SAME):
        raise InputError(f"{owner}: {name} = {value!r} must be below {limit_name} = {limit!r}.")
