"""Meshes of solids with named faces and points, swept from plane patches."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fecontact.core.errors import InputError
from fecontact.core.resources.memory import available_memory
from fecontact.core.types import Array
from fecontact.fem.mesh import Mesh
from fecontact.fem.solids.shapes import (
    Cylinder,
    LapStrip,
    Plate,
    Ring,
    SolidBlock,
    SolidShape,
    SphereSegment,
)
from fecontact.fem.solids.swept_blocks import (
    Patch2D,
    Sweep,
    arc,
    between,
    full_disc,
    lines,
    rectangle,
    segment,
    swept_mesh,
)

MAX_CELLS = 2_000_000
_BYTES = 12_000.0  # memory per hexahedron during meshing
_MOST_PARTS = MAX_CELLS + 1  # of a line; so many are refused
_NEAR = 1e-6  # of the solid's size: how close corners are to the face they lie on

# Names of faces by their corners (k, n, 3) and area vectors (k, 3).
_Names = Callable[[Array, Array], Array]


@dataclass(frozen=True, eq=False)
class _Solid:
    """A sweep with the names of its faces, points and groups; see :func:`swept_mesh`."""

    sweep: Sweep
    names: _Names
    points: dict[str, tuple[float, float, float]]
    groups: dict[str, Callable[[Array], Array]] = field(default_factory=dict)


def generate_solid(shape: SolidShape) -> Mesh:
    """The mesh of a solid; InputError for keys that make too many elements."""
    tetrahedra = shape.element == "tetrahedron"
    each = 6 if tetrahedra else 1
    most = int(min(MAX_CELLS, available_memory() / _BYTES * each)) // each
    # A patch has at least 2 x 2 hexahedra in a layer, those around a hole 16.
    counts = _given(shape, "layers", "holes_along", "holes_across")
    least = math.prod(counts.values(), start=16 if isinstance(shape, LapStrip) else 4)
    sizes = _given(shape, "element_size", "contact_element_size")
    if least <= most:
        solid = _solid(shape)
        if (count := solid.sweep.count) <= most:
            return swept_mesh(solid.sweep, tetrahedra, solid.names, solid.points, solid.groups)
        coarse = 10.0 * max(value for value in vars(shape).values() if isinstance(value, float))
        least = _count_of(shape, sizes, coarse)
    if least > most:
        raise InputError(f"{_keys_make(shape, counts)} {float(min(least * each, 10**99)):.3g} or "
                         f"more elements, more than {most * each}; take fewer.")
    fine = min(sizes.values())
    while coarse > 1.1 * fine:
        middle = math.sqrt(fine) * math.sqrt(coarse)
        if _count_of(shape, sizes, middle) > most:
            fine = middle
        else:
            coarse = middle
    raise InputError(f"{_keys_make(shape, sizes)} {count * each:.3g} or more elements, more than "
                     f"{most * each}; take at least {1.1 * coarse:.2g} m.")


def _given(shape: SolidShape, *keys: str) -> dict[str, Any]:
    """Values of those keys that the shape has."""
    return {key: value for key in keys if (value := getattr(shape, key, None)) is not None}


def _keys_make(shape: SolidShape, values: Mapping[str, float]) -> str:
    """Begin a sentence: ``Plate: layers = 3 makes``."""
    return (f"{type(shape).__name__}: "
            f"{', '.join(f'{key} = {value!r}' for key, value in values.items())} "
            f"{'makes' if len(values) == 1 else 'make'}")


def _count_of(shape: SolidShape, sizes: Mapping[str, float], least: float) -> int:
    """Number of hexahedra with element sizes of at least that [m]."""
    coarser: dict[str, Any] = {key: max(value, least) for key, value in sizes.items()}
    return _solid(replace(shape, **coarser)).sweep.count


def _solid(shape: SolidShape) -> _Solid:
    match shape:
        case SolidBlock():
            return _block(shape)
        case Plate():
            return _plate(shape)
        case Ring():
            return _ring(shape)
        case Cylinder():
            return _cylinder(shape)
        case SphereSegment():
            return _sphere_segment(shape)
        case LapStrip():
            return _lap_strip(shape)


def _block(shape: SolidBlock) -> _Solid:
    L, W, H = shape.length, shape.width, shape.height
    a = L if shape.contact_length is None else shape.contact_length
    b = W if shape.contact_width is None else shape.contact_width
    drive = H / 2 if shape.drive_height is None else shape.drive_height
    size = shape.element_size
    z = _divided(size, 0.0, H, drive)
    sweep = Sweep([rectangle(_divided(size, 0.0, L, L / 2, (L - a) / 2, (L + a) / 2),
                             _divided(size, 0.0, W, W / 2, (W - b) / 2, (W + b) / 2))],
                  z / H, lambda xy, w: np.concatenate([xy, H * w[..., None]], axis=-1))

    def touching(at: Array) -> Array:
        middle = np.abs(at.mean(axis=1)[:, :2] - [L / 2, W / 2])
        return np.asarray((middle < [a / 2, b / 2]).all(axis=1))

    return _Solid(sweep, _box_names(touching),
                 {"B": (0.0, W / 2, drive), "C": (L / 2, W / 2, H)})


def _plate(shape: Plate) -> _Solid:
    L, W, H = shape.length, shape.width, shape.thickness
    size, near = shape.element_size, _NEAR * max(shape.length, shape.width)
    layers = shape.layers
    middle = H / 2 if layers % 2 == 0 else H * (layers // 2) / layers
    sweep = Sweep([rectangle(_divided(size, 0.0, L, L / 2), _divided(size, 0.0, W, W / 2))],
                  lines(layers), lambda xy, w: np.concatenate([xy, H * w[..., None]], axis=-1))

    def bottom_edges(nodes: Array) -> Array:
        x, y, z = nodes.T
        rim = (x < near) | (x > L - near) | (y < near) | (y > W - near)
        return np.asarray(rim & (z < 1e-6 * H))

    return _Solid(sweep, _box_names(lambda at: np.ones(len(at), bool)),
                 {"B": (0.0, W / 2, middle), "C": (L / 2, W / 2, H)},
                 {"bottom_edges": bottom_edges})


def _ring(shape: Ring) -> _Solid:
    R, r, H, size = shape.outer_radius, shape.inner_radius, shape.thickness, shape.element_size
    layers = shape.layers or _count(H, size)
    patches = _round(R, r, 0.25 * math.pi, size)
    sweep = Sweep(patches, lines(layers),
                  lambda xy, w: np.concatenate([xy, H * w[..., None]], axis=-1))
    middle = H * ((layers + 1) // 2) / layers
    return _Solid(sweep, _round_names(R, r, 2, ("contact", "top")),
                 {"B": (R, 0.0, middle), "C": (0.5 * (R + r) if r else 0.0, 0.0, H)})


def _cylinder(shape: Cylinder) -> _Solid:
    R, r, L, size = shape.radius, shape.inner_radius, shape.length, shape.element_size
    half = math.radians(0.5 * shape.contact_angle)
    y = _divided(size, 0.0, L, L / 2)

    def lift(xy: Array, w: Array) -> Array:
        # The plane of the patches, turned up: x, and z from the axis; y along the sweep.
        return np.stack([xy[..., 0], L * w, R + xy[..., 1]], axis=-1)

    around = _round_names(R, r, 1, ("front", "back"))

    def names(at: Array, normals: Array) -> Array:
        found = around(at - [0.0, 0.0, R], normals)
        x, _, z = (at.mean(axis=1) - [0.0, 0.0, R]).T
        low = np.abs(np.arctan2(x, -z)) < half
        return np.where((found == "outer") & low, "contact", found)

    return _Solid(Sweep(_round(R, r, half, size), y / L, lift), names,
                 {"B": (-R, L / 2, R), "C": (0.0, L / 2, 2 * R)})


def _sphere_segment(shape: SphereSegment) -> _Solid:
    R, a, H = shape.radius, shape.base_radius, shape.height
    c = a if shape.contact_radius is None else shape.contact_radius
    fine = shape.contact_element_size or shape.element_size
    inside = c < a * (1 - 1e-9)
    core = (0.6 * c)
    side = _count(0.5 * math.pi * c, fine)
    disc = full_disc(c, core, 0.25 * math.pi, (side, side), lines(_count(c - 0.8 * core, fine)))
    patches = list(disc)
    if inside:
        across = _growing(a - c, fine, shape.element_size)
        patches += [between(arc(c, t, t + 0.5 * math.pi), arc(a, t, t + 0.5 * math.pi),
                            lines(side), across)
                    for t in (0.25 * math.pi + 0.5 * math.pi * k for k in range(4))]
    z = _growing(H, fine, shape.element_size)

    def lift(xy: Array, w: Array) -> Array:
        low = R - np.sqrt(R**2 - np.minimum((xy**2).sum(axis=-1), a**2))
        return np.concatenate([xy, (low + w * (H - low))[..., None]], axis=-1)

    def names(at: Array, normals: Array) -> Array:
        x, y, z = np.moveaxis(at, 2, 0)
        away = np.hypot(x, y)
        top = (z > H - _NEAR * a).all(axis=1)
        outer = (away > a * (1 - _NEAR)).all(axis=1)
        contact = (away < c * (1 + _NEAR)).all(axis=1)
        return np.select([top, outer, contact], ["top", "outer", "contact"], "bottom")

    rise = R - math.sqrt(R**2 - a**2)
    half = z[len(z) // 2]
    return _Solid(Sweep(patches, z, lift), names,
                 {"B": (-a, 0.0, rise + half * (H - rise)), "C": (0.0, 0.0, H)})


def _lap_strip(shape: LapStrip) -> _Solid:
    L, W, H, lap = shape.length, shape.width, shape.thickness, shape.overlap
    size, r, washer = shape.element_size, shape.hole_radius, shape.washer_radius
    nx, ny = shape.holes_along, shape.holes_across
    cell = lap / nx, W / ny
    # An even number of elements along x and y: the corners of the cells are at whole ones.
    counts = [2 * _count(0.5 * side, size) for side in cell]
    patches: list[Patch2D] = []
    centres = [(-lap / 2 + (i + 0.5) * cell[0], (j + 0.5) * cell[1])
               for i in range(nx) for j in range(ny)]
    sides = [lines(count) for count in counts]
    ring = lines(_count(washer - r, size))
    beyond = lines(_count(math.hypot(0.5 * cell[0], 0.5 * cell[1]) - washer, 1.5 * size))
    for centre in centres:
        patches += _cell_with_hole(centre, cell, r, washer, sides, ring, beyond)
    far = _divided(size, lap / 2, L - lap / 2)
    patches.append(rectangle(far, W * lines(min(ny * counts[1], _MOST_PARTS))))
    sign = 1.0 if shape.layer == "upper" else -1.0

    def lift(xy: Array, w: Array) -> Array:
        # The lower layer is the upper one turned about the y axis.
        return np.stack([sign * xy[..., 0], xy[..., 1], sign * H * w], axis=-1)

    near = _NEAR * L

    def names(at: Array, normals: Array) -> Array:
        x, y, z = np.moveaxis(at * [sign, 1.0, sign], 2, 0)
        middle = np.stack([x.mean(axis=1), y.mean(axis=1)], axis=1)
        column, row = ((middle - [-lap / 2, 0.0]) // cell).T.astype(int)
        owner = np.clip(column, 0, nx - 1) * ny + np.clip(row, 0, ny - 1)
        away = np.hypot(*(np.stack([x, y], -1) - np.array(centres)[owner][:, None]).T).T
        number = np.char.add("_", (owner + 1).astype(str))
        low, high = (np.abs(z) < near).all(axis=1), (np.abs(z - H) < near).all(axis=1)
        hole = (np.abs(away - r) < near).all(axis=1) & ~low & ~high
        ring = high & (away < washer + near).all(axis=1)
        return np.select(
            [hole, ring, low & (middle[:, 0] < lap / 2), low, high,
             (x > L - lap / 2 - near).all(axis=1), (x < near - lap / 2).all(axis=1),
             (y < near).all(axis=1)],
            [np.char.add("hole", number), np.char.add("washer", number), "contact", "inner",
             "outer", "end", "tip", "front"], "back")

    middle = W / 2 if counts[1] * ny % 2 == 0 else W / 2 - 0.5 * cell[1] / counts[1]
    level = H * ((shape.layers + 1) // 2) / shape.layers
    return _Solid(Sweep(patches, lines(shape.layers), lift), names,
                 {"B": (sign * (L - lap / 2), middle, sign * level),
                  "C": (-sign * lap / 2, middle, sign * H)})


def _cell_with_hole(
    centre: tuple[float, float], cell: tuple[float, float], hole: float, washer: float,
    sides: Sequence[Array], ring: Array, beyond: Array,
) -> list[Patch2D]:
    """A rectangle around a round hole: a ring to the washer's rim, and from there to the sides."""
    x, y = 0.5 * cell[0], 0.5 * cell[1]
    corners = [(centre[0] + i * x, centre[1] + j * y) for i, j in ((-1, -1), (1, -1), (1, 1),
                                                                   (-1, 1))]
    tilt = math.atan2(y, x)
    angles = [-math.pi + tilt, -tilt, tilt, math.pi - tilt, math.pi + tilt]
    patches = []
    for k in range(4):
        along = sides[k % 2]
        inner, rim = (arc(radius, angles[k], angles[k + 1], centre) for radius in (hole, washer))
        side = segment(corners[k], corners[(k + 1) % 4])
        patches += [between(inner, rim, along, ring), between(rim, side, along, beyond)]
    return patches


def _round(outer: float, inner: float, half: float, size: float) -> list[Patch2D]:
    """A disc or ring, with lines at ``half`` [rad] to both sides of -y and +y."""
    counts = tuple(2 * _count(0.5 * angle * outer, size) for angle in (2 * half,
                                                                       math.pi - 2 * half))
    if inner == 0.0:
        core = 0.6 * outer
        return full_disc(outer, core, half, (counts[0], counts[1]),
                         lines(_count(outer - 0.85 * core, size)))
    across = lines(2 * _count(0.5 * (outer - inner), size))
    angles = [-0.5 * math.pi - half, -0.5 * math.pi + half, 0.5 * math.pi - half,
              0.5 * math.pi + half, 1.5 * math.pi - half]
    return [between(arc(inner, angles[k], angles[k + 1]), arc(outer, angles[k], angles[k + 1]),
                    lines(counts[k % 2]), across) for k in range(4)]


def _box_names(touching: Callable[[Array], Array]) -> _Names:
    def names(at: Array, normals: Array) -> Array:
        main = np.abs(normals).argmax(axis=1)
        facing = np.eye(3, dtype=bool)[main]
        low, high = facing & (normals < 0.0), facing & (normals > 0.0)
        return np.select(
            [low[:, 2] & touching(at), low[:, 2], high[:, 2], low[:, 0], high[:, 0], low[:, 1]],
            ["contact", "bottom", "top", "left", "right", "front"], "back")

    return names


def _round_names(outer: float, inner: float, axis: int, ends: tuple[str, str]) -> _Names:
    """Names of the faces of a body of rotation about an axis."""

    def names(at: Array, normals: Array) -> Array:
        across = [i for i in range(3) if i != axis]
        away = np.linalg.norm(at[..., across], axis=2)
        flat = np.abs(normals[:, axis]) > 0.5 * np.linalg.norm(normals, axis=1)
        return np.select(
            [flat & (normals[:, axis] < 0), flat, (away > 0.5 * (outer + inner)).all(axis=1)],
            [*ends, "outer"], "inner")

    return names


def _divided(size: float, first: float, last: float, *between: float) -> Array:
    """Lines from first to last that include those between, with steps of at most ``size``."""
    kept = [first, last]
    for value in between:
        if all(abs(value - line) > 1e-9 * (last - first) for line in kept):
            kept.append(value)
    kept.sort()
    parts = [np.linspace(a, b, _count(b - a, size) + 1)[:-1]
             for a, b in itertools.pairwise(kept)]
    return np.append(np.concatenate(parts), last)


def _count(length: float, size: float) -> int:
    """Number of parts of a length that are at most as long as a size."""
    return int(np.clip(math.ceil(length / max(size, 1e-99) - 1e-6), 1, _MOST_PARTS))


def _growing(length: float, first: float, last: float) -> Array:
    """Lines from 0 to 1 over a length, steps growing from the first size to about the last one."""
    steps = [min(first, length)]
    reach = steps[0]
    while reach < length * (1 - 1e-9) and len(steps) < _MOST_PARTS:
        steps.append(min(1.35 * steps[-1], max(last, first)))
        reach += steps[-1]
    reached = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(reached / reached[-1])
