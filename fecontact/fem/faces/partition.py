"""Cutting a face into patches of nearly equal area and compact shape.

Several ways of cutting are tried: into strips of equal area, these again across, in directions of
the face, about an axis, or by halving again and again. The one whose patches have the least
second moments and differences of area is taken, so that a face with a grid of facets is cut along
its lines. Nothing is random; equal faces are cut equally.
"""

import itertools
from collections.abc import Iterator

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.elements.cell_kinds import edges_around
from fecontact.fem.faces.frames import frames_of
from fecontact.fem.faces.surface import Surface, corners_of

# Differences of area count so much against second moments.
_UNEQUAL = 10.0
# Numbers of strips around that of square patches that are tried.
_AROUND = 2
# Coordinates closer than this fraction of the extent count as equal.
_SAME = 1e-7
# Least distance of the middles of neighbours in a grid of patches, of their mean distance.
_APART = 0.3
# A face is flat enough to have a direction if its mean normal is at least so long.
_FLAT = 0.5


def partition(surface: Surface, count: int) -> Integers:
    """Patch (k,) of each facet, of patches that are numbered along x, then y, then z.

    Connected parts of a face are cut by themselves, into numbers in proportion to their areas;
    ``count`` is from their number to the number of facets.
    """
    part = parts_of(surface)
    sizes = np.bincount(part)
    totals = np.bincount(part, surface.areas).astype(float)
    shares = _shared_out(count, totals, sizes)
    owner = np.empty(len(part), dtype=np.int64)
    first = 0
    for number, share in enumerate(shares):
        which = part == number
        owner[which] = first + _cut(surface.only(which), share)
        first += share
    return _numbered(surface, owner, count)


def grid_partition(surface: Surface, along: int, across: int) -> Integers | None:
    """Patch (k,) of each facet of a connected face, of ``along`` strips of ``across`` patches.

    Strips follow each other along the first tangent of the face and are cut along the second one,
    or, on a ring, a bore or a shaft, follow each other around its axis and are cut along it or away
    from it; whichever makes the more compact patches. None if the facets make no such grid. The
    patches are numbered as those of :func:`partition`.
    """
    count = along * across
    best, least = None, np.inf
    pairs = [_along_first(surface, frame[:2]) for frame in itertools.islice(_frames(surface), 2)]
    for u, v in [*pairs, *([_around(surface)] if _closes(surface) else [])]:
        owner = _strips(u, v, surface.areas, count, along)
        if _is_grid(u, v, surface.areas, owner, along, across) and (
                cost := _cost(surface, owner, count)) < least * (1.0 - 1e-6):
            best, least = owner, cost
    return None if best is None else _numbered(surface, best, count)


def _closes(surface: Surface) -> bool:
    """Whether a connected face closes around an axis, by its numbers of corners, edges, facets."""
    corners = corners_of(surface.facets)
    edges = np.unique(edges_around(corners)[0], axis=0)
    return len(np.unique(corners)) - len(edges) + len(corners) == 0


def _is_grid(
    u: Array, v: Array, areas: Array, owner: Integers, along: int, across: int
) -> bool:
    """Whether strips follow each other along u, and their patches along v.

    A grid of fewer lines of facets than strips would be cut across instead.
    """
    count = along * across
    sizes = np.bincount(owner, areas, minlength=count)
    if (sizes == 0.0).any():
        return False
    middles, places = (np.bincount(owner, areas * one, minlength=count).reshape(along, across)
                       for one in (u, v))
    strips = middles.sum(axis=1) / sizes.reshape(along, across).sum(axis=1)
    steps = np.diff(places / sizes.reshape(along, across), axis=1)
    return bool((np.diff(strips) > _APART * np.ptp(u) / along).all()
                and (steps > _APART * np.ptp(v) / across).all())


def _along_first(surface: Surface, pair: Array) -> tuple[Array, Array]:
    """Two coordinates (2, k) of the facets, that which rises most along the first tangent first."""
    mean = surface.area_vectors.sum(axis=0)
    size = float(np.linalg.norm(mean))
    if size <= _FLAT * surface.areas.sum():
        return pair[0], pair[1]
    first = surface.centres @ frames_of(mean[None] / size)[0][0]
    rises = np.abs((pair - pair.mean(axis=1)[:, None]) @ (first - first.mean()))
    return (pair[0], pair[1]) if rises[0] >= rises[1] * (1.0 - 1e-9) else (pair[1], pair[0])


def _numbered(surface: Surface, owner: Integers, count: int) -> Integers:
    """The patches (k,) numbered along x, then y, then z of their centres."""
    centres = surface.patches(owner).centres
    places = np.round(centres / (1e-6 * max(float(np.ptp(surface.centres, axis=0).max()), 1e-300)))
    rank = np.empty(count, dtype=np.int64)
    rank[np.lexsort(places.T[::-1])] = np.arange(count)
    return rank[owner]


def parts_of(surface: Surface) -> Integers:
    """Number (k,) of the connected part of each facet; parts are connected by nodes."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    k, n = surface.facets.shape
    member = sp.csr_array((np.ones(k * n), (np.repeat(np.arange(k), n), surface.facets.ravel())))
    return np.asarray(connected_components(member @ member.T, directed=False)[1], dtype=np.int64)


def _shared_out(count: int, areas: Array, most: Integers) -> list[int]:
    """Integers of sum ``count``, at least one each and ``most`` at most, as the areas are."""
    shares = np.ones(len(areas), dtype=int)
    for _ in range(count - len(areas)):
        shares[np.argmax(np.where(shares < most, areas / shares, 0.0))] += 1
    return [int(share) for share in shares]


def _cut(surface: Surface, count: int) -> Integers:
    """Patch (k,) of each facet of a connected part."""
    k = len(surface.facets)
    if count == k:
        return np.arange(k)
    if count == 1:
        return np.zeros(k, dtype=np.int64)
    best, least = np.zeros(k, dtype=np.int64), np.inf
    for owner in _ways(surface, count):
        size = np.bincount(owner, minlength=count)
        if (size == 0).any():
            continue
        cost = _cost(surface, owner, count)
        if cost < least * (1.0 - 1e-6):
            best, least = owner, cost
    return best


def _cost(surface: Surface, owner: Integers, count: int) -> float:
    areas = np.bincount(owner, surface.areas)
    mean = np.stack([np.bincount(owner, surface.areas * axis) for axis in surface.centres.T])
    away = surface.centres - (mean / areas)[:, owner].T
    spread = float((surface.areas * (away**2).sum(axis=1)).sum())
    total = surface.areas.sum()
    # Square patches of equal area have the spread total^2 / (6 count).
    return 6.0 * count * spread / total**2 + _UNEQUAL * float(
        ((areas * count / total - 1.0) ** 2).mean())


def _ways(surface: Surface, count: int) -> Iterator[Integers]:
    """All ways of cutting that are tried; the last ones give every patch a facet."""
    frames = list(_frames(surface))
    for pair in [frame[:2] for frame in frames] + [_around(surface)]:
        for u, v in ((pair[0], pair[1]), (pair[1], pair[0])):
            ideal = np.sqrt(count * np.ptp(u) / max(np.ptp(v), 1e-300))
            low, high = int(max(ideal - _AROUND, 1.0)), int(min(ideal + _AROUND + 1.0, count))
            for strips in range(min(low, count), high + 1):
                yield _strips(u, v, surface.areas, count, strips)
    for frame in frames:
        yield _halved(frame, surface.areas, count)


def _frames(surface: Surface) -> Iterator[Array]:
    """Coordinates (3, k) of the facets along the axes of the face."""
    mean = surface.area_vectors.sum(axis=0) / surface.areas.sum()
    size = float(np.linalg.norm(mean))
    centre = np.average(surface.centres, axis=0, weights=surface.areas)
    arm = surface.centres - centre
    if size > _FLAT:
        along = frames_of(mean[None] / size)[0]
        yield _rounded(along @ arm.T)
        flat = along @ arm.T
        turn = _smallest_rectangle(flat[:2])
        yield _rounded(np.vstack([turn @ flat[:2], flat[2:]]))
    else:
        yield _rounded(arm.T)
    spread = (surface.areas[:, None] * arm).T @ arm
    yield _rounded(np.linalg.eigh(spread)[1].T[::-1] @ arm.T)


def _rounded(coordinates: Array) -> Array:
    extent = max(float(np.ptp(coordinates, axis=1).max()), 1e-300)
    return np.asarray(np.round(coordinates / (_SAME * extent)) * (_SAME * extent))


def _smallest_rectangle(flat: Array) -> Array:
    """Rotation (2, 2) to the sides of the smallest rectangle about points (2, k)."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = flat[:, ConvexHull(flat.T).vertices]
    except (QhullError, ValueError):
        return np.eye(2)
    sides = np.roll(hull, -1, axis=1) - hull
    c, s = sides / np.linalg.norm(sides, axis=0)
    turns = np.moveaxis(np.array([[c, s], [-s, c]]), 2, 0)
    areas = np.ptp(turns @ hull, axis=2).prod(axis=1)
    # Of equal ones the first, whatever their round-off.
    return np.asarray(turns[np.flatnonzero(areas <= areas.min() * (1.0 + 1e-6))[0]])


def _around(surface: Surface) -> tuple[Array, Array]:
    """Lengths around an axis, and along it or away from it: of rings, bores and shafts."""
    mean = surface.area_vectors.sum(axis=0) / surface.areas.sum()
    size = float(np.linalg.norm(mean))
    unit = surface.area_vectors / surface.areas[:, None]
    axis = mean / size if size > _FLAT else np.linalg.eigh(
        (surface.areas[:, None] * unit).T @ unit)[1][:, 0]
    axis = axis * (1.0 if axis[np.argmax(np.abs(axis))] > 0.0 else -1.0)
    arm = surface.centres - np.average(surface.centres, axis=0, weights=surface.areas)
    x, y, z = frames_of(axis[None])[0] @ arm.T
    radius = np.hypot(x, y)
    angle = np.round(np.arctan2(y, x) / _SAME) * _SAME % (2.0 * np.pi)
    order = np.sort(angle)
    gaps = np.diff(order, append=order[0] + 2.0 * np.pi)
    widest = int(np.argmax(gaps))
    if gaps[widest] > 0.5:  # a sector begins behind the gap, a ring anywhere
        angle = (angle - order[(widest + 1) % len(order)] + _SAME) % (2.0 * np.pi)
    across = radius if size > _FLAT else z
    return angle * radius.mean(), _rounded(across[None])[0]


def _strips(u: Array, v: Array, areas: Array, count: int, strips: int) -> Integers:
    """Strips of equal area across u, each cut into patches of equal area across v."""
    shares = np.full(strips, count // strips)
    # Strips with one patch more are spread evenly.
    shares += np.diff((np.arange(strips + 1) * (count % strips)) // strips)
    strip = _slices(np.lexsort((v, u)), areas, shares)
    owner = np.empty(len(u), dtype=np.int64)
    first = 0
    for number, share in enumerate(shares.tolist()):
        which = np.flatnonzero(strip == number)
        owner[which] = first + _slices(np.lexsort((u[which], v[which])), areas[which],
                                       np.ones(share))
        first += share
    return owner


def _slices(order: Integers, areas: Array, shares: Array) -> Integers:
    """Slice (k,) of each facet, with areas in proportion to the shares, in the given order."""
    reached = np.cumsum(areas[order]) - 0.5 * areas[order]
    ends = np.cumsum(shares)[:-1] * (areas.sum() / shares.sum())
    found = np.empty(len(order), dtype=np.int64)
    found[order] = np.searchsorted(ends, reached)
    return found


def _halved(coordinates: Array, areas: Array, count: int) -> Integers:
    """Patches by halving across the longest extent again and again."""
    owner = np.zeros(len(areas), dtype=np.int64)
    todo = [(np.arange(len(areas)), count, 0)]
    while todo:
        which, share, first = todo.pop()
        owner[which] = first
        if share == 1:
            continue
        left = share // 2
        extents = np.ptp(coordinates[:, which], axis=1)
        # Of equal extents the first, whatever their round-off.
        longest = int(np.flatnonzero(extents >= extents.max() * (1.0 - 1e-6))[0])
        others = [coordinates[i, which] for i in range(3) if i != longest]
        order = which[np.lexsort((*others[::-1], coordinates[longest, which]))]
        reached = np.cumsum(areas[order]) - 0.5 * areas[order]
        cut = int(np.searchsorted(reached, areas[which].sum() * left / share))
        cut = min(max(cut, left), len(order) - (share - left))
        todo += [(order[:cut], left, first), (order[cut:], share - left, first + left)]
    return owner
