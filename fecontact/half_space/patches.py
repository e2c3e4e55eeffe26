"""Uniformly loaded patches of a half-space: their mean displacements, and those inside it."""

from dataclasses import dataclass

import numpy as np

from fecontact.core.types import Array, Integers
from fecontact.fem.material import Material
from fecontact.half_space.influence import (
    ACROSS,
    ALONG,
    CROSS,
    DIRECT,
    ODD_X,
    ODD_Y,
    Convolution,
)
from fecontact.half_space.surface_compliance import SurfaceCompliance

_PIXELS = 6  # along a small patch
_SMALL = 0.2  # quantile of areas that says what is small
_MOST = 1500  # pixels along a side
# Part of a pixel by which centres are moved, so that one on an edge belongs to one side alone.
_EDGE = 1e-6


@dataclass(frozen=True, eq=False)
class PixelPatches:
    """Patches of the surface z = 0 as pixels of a regular grid.

    Attributes
    ----------
    owner : (N, M) integer array
        Patch of each pixel, -1 for none.
    areas : (n,) array
        True areas of the patches [m^2].
    origin : (2,) array
        Place of the centre of the first pixel [m].
    side : float
        Side of a pixel [m].
    """

    owner: Integers
    areas: Array
    origin: Array
    side: float

    @classmethod
    def of(cls, polygons: Array, owner: Integers) -> "PixelPatches":
        """Patches of convex polygons (k, c, 2), each a part of the patch ``owner`` (k,)."""
        fans = [polygons[:, [0, i, i + 1]] for i in range(1, polygons.shape[1] - 1)]
        triangles, owners = np.concatenate(fans), np.tile(owner, len(fans))
        edges = triangles[:, 1:] - triangles[:, :1]
        turned = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
        areas = np.zeros(int(owners.max()) + 1)
        np.add.at(areas, owners, 0.5 * np.abs(turned))
        low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        side = float(max(np.sqrt(np.quantile(areas, _SMALL)) / _PIXELS,
                         (high - low).max() / _MOST))
        count = np.ceil((high - low) / side - _EDGE).astype(int)
        origin = 0.5 * (low + high) - 0.5 * side * (count - 1)
        found = np.full(tuple(count), -1)
        for corner, edge, double, number in zip(triangles[:, 0], edges, turned, owners,
                                                strict=True):
            place = corner + np.array([[0.0, 0.0], edge[0], edge[1]])
            first = np.maximum(np.floor((place.min(axis=0) - origin) / side).astype(int), 0)
            last = np.ceil((place.max(axis=0) - origin) / side).astype(int) + 1
            x, y = (origin[a] + side * (np.arange(first[a], min(last[a], count[a])) + _EDGE)
                    - corner[a] for a in range(2))
            s = (x[:, None] * edge[1, 1] - y * edge[1, 0]) / double
            t = (y * edge[0, 0] - x[:, None] * edge[0, 1]) / double
            part = found[first[0] : first[0] + len(x), first[1] : first[1] + len(y)]
            part[(s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)] = number
        empty = np.setdiff1d(np.arange(len(areas)), found)
        for number in empty:  # smaller than a pixel
            centre = triangles[owners == number].mean(axis=(0, 1))
            found[tuple(np.rint((centre - origin) / side).astype(int))] = number
        return cls(found, areas, origin, side)

    @property
    def places(self) -> Array:
        """Centres (N, M, 2) of the pixels [m]."""
        x, y = (self.origin[a] + self.side * np.arange(self.owner.shape[a]) for a in range(2))
        return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)

    def compliance(self, material: Material) -> Array:
        """Mean displacements (n, 3, n, 3) of the patches under unit forces on each [m/N].

        Forces are even over a patch, along x, y and z, which points into the half-space.
        """
        constants = SurfaceCompliance.of(material, "half_space")
        direct, along, odd = (value / np.pi for value in (
            constants.direct, constants.along, constants.coupling))
        n, shape = len(self.areas), (self.owner.shape[0], self.owner.shape[1])
        sides = (self.side, self.side)
        kernels = {
            (0, 0): [(direct, DIRECT), (along, ALONG)], (0, 1): [(along, CROSS)],
            (1, 1): [(direct, DIRECT), (along, ACROSS)], (2, 2): [(direct, DIRECT)],
            (2, 0): [(odd, ODD_X)], (2, 1): [(odd, ODD_Y)]}
        convolutions = {axes: Convolution(terms, shape, sides, periodic=False)
                        for axes, terms in kernels.items()}
        inside = self.owner >= 0
        numbers = self.owner[inside]
        counts = np.bincount(numbers, minlength=n)
        found = np.zeros((n, 3, n, 3))
        for patch in range(n):
            forces = (self.owner == patch) / counts[patch]
            for (a, b), convolution in convolutions.items():
                moved = np.bincount(numbers, convolution(forces)[inside], n) / counts
                found[:, a, patch, b] = moved
                if a != b:
                    found[:, b, patch, a] = moved if a == 0 else -moved
            # A patch of another area than that of its pixels.
            found[patch, :, patch] *= np.sqrt(counts[patch] * self.side**2 / self.areas[patch])
        return found

    def displacements(self, patch: int, places: Array, material: Material) -> Array:
        """Displacements (k, 3, 3) at places (k, 3) in the half-space, of unit forces [m/N].

        The last axis is that of the forces on one patch, along x, y and z (Boussinesq, Cerruti).
        """
        sources = self.places[self.owner == patch]
        x, y = (places[:, None, a] - sources[:, a] for a in range(2))
        z = np.maximum(places[:, 2:], 0.0)
        # Points at the surface lie within a pixel: 0.28 of its side have its mean 1 / r.
        rho = np.sqrt(x * x + y * y + z * z + (0.28 * self.side) ** 2)
        nu = material.poisson_ratio
        free, above = 1.0 - 2.0 * nu, rho + z
        shear = 0.5 * material.youngs_modulus / (1.0 + nu)
        bend = 1.0 / rho**3 - free / (rho * above**2)
        lift = z / rho**3 + free / (rho * above)
        sink = z / rho**3 - free / (rho * above)
        even = 1.0 / rho + free / above
        found = np.stack([
            np.stack([even + x * x * bend, x * y * bend, x * sink], axis=-1),
            np.stack([x * y * bend, even + y * y * bend, y * sink], axis=-1),
            np.stack([x * lift, y * lift, z * z / rho**3 + 2.0 * (1.0 - nu) / rho], axis=-1),
        ], axis=-2)
        return np.asarray(found.mean(axis=1) / (4.0 * np.pi * shear))
