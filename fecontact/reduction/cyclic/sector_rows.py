"""Contact nodes and points of one sector of a wheel: their rows over the nodes of its bodies."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.checks import as_texts, require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.types import Array, ComplexArray
from fecontact.fem.cyclic_symmetry import NEXT, CyclicSymmetry
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.pairing import Pairing
from fecontact.fem.points import Place, place_rows
from fecontact.reduction.assembly.assembled_basis import node_frames
from fecontact.reduction.reduce_body import displacement_rows


def owned(what: str, name: str, bodies: Mapping[str, Any]) -> tuple[str, str]:
    """Body and place of a name ``body.place``."""
    owner, _, place = name.partition(".")
    if owner not in bodies or not place:
        raise InputError(f"cyclic_basis: {what} names '{name}', which must be a body and a name "
                         f"with a dot between, such as '{next(iter(bodies))}.tip'; the bodies are "
                         f"{choices(bodies)}.")
    return owner, place


@dataclass(frozen=True, eq=False)
class SectorRows:
    """Contact nodes and points of a sector, in the order of interfaces and names.

    ``rows`` are those of each interface and point: a body, whether it is that of the next sector,
    and its sparse rows.
    """

    dimension: int
    symmetry: CyclicSymmetry
    positions: Array
    normals: Array
    tributary: Array
    gaps: Array
    on_ground: Any
    groups: tuple[tuple[str, int], ...]
    rows: list[list[tuple[str, bool, Any]]]

    @classmethod
    def of(
        cls, bodies: Mapping[str, ElasticBody], symmetry: CyclicSymmetry,
        pairings: Mapping[str, Pairing], points: Mapping[str, Place],
    ) -> "SectorRows":
        """Rows of pairings and points; InputError for those of other bodies or meshes."""
        import scipy.sparse as sp

        dimensions = {body.dimension for body in bodies.values()}
        if len(dimensions) > 1:
            raise InputError("cyclic_basis: bodies must be all in the plane or all in space.")
        d = dimensions.pop()
        rows: list[list[tuple[str, bool, Any]]] = []
        made: list[Pairing] = []
        for name, one in pairings.items():
            require_kind(f"cyclic_basis: pairing '{name}'", Pairing, pairing=one)
            frames = node_frames(one.normals)
            sides = []
            for owner, matrix in ((one.body, one.nodes), (one.other, one.feet)):
                if owner is None:
                    continue
                body = owner.removeprefix(NEXT)
                if body not in bodies or matrix.shape[1] != bodies[body].unknowns:
                    raise InputError(
                        f"cyclic_basis: interface '{name}' pairs a face of '{owner}', which is no "
                        f"body of the sector, {choices(bodies)}, or of the next one, or has "
                        f"another mesh; pair the faces of the same bodies.")
                sign = 1.0 if matrix is one.nodes else -1.0
                sides.append((body, body != owner, sp.csr_array(sign * (frames @ matrix))))
            rows.append(sides)
            made.append(one)
        places = []
        for name, place in points.items():
            owner, point = owned("points", name, bodies)
            found = place_rows(bodies[owner], place, point)
            rows.append([(owner, False, sp.csr_array(found.matrix))])
            places.append(found.position)
        return cls(
            d, symmetry,
            np.concatenate([np.zeros((2, d)), *(one.places for one in made),
                            np.reshape(places, (-1, d))]),
            np.concatenate([np.zeros((0, d)), *(one.normals for one in made)]),
            np.concatenate([np.zeros(0), *(one.tributary for one in made)]),
            np.concatenate([np.zeros(0), *(one.gaps for one in made)]),
            np.concatenate([np.zeros(0, bool), *(
                np.full(len(one.gaps), one.other is None) for one in made)]).astype(bool),
            tuple((name, len(one.gaps)) for name, one in pairings.items()), rows)

    def in_sector(self, matrix: Any, diameter: int) -> Any:
        """Rows over the nodes of the next sector as rows over those of this one."""
        import scipy.sparse as sp

        R = np.exp(1j * diameter * self.symmetry.angle) * self.symmetry.rotation(self.dimension)
        if self.symmetry.is_real(diameter):
            R = R.real
        count = matrix.shape[1] // self.dimension
        return sp.csr_array(matrix @ sp.kron(sp.eye_array(count), R))

    def loaded(self, body: str, diameter: int) -> Any:
        """Rows of displacements of a body at which forces act, sparse (p, d N)."""
        import scipy.sparse as sp

        found = [displacement_rows(self.in_sector(matrix, diameter) if further else matrix,
                                   self.dimension)
                 for sides in self.rows for owner, further, matrix in sides if owner == body]
        if not found:
            return sp.csr_array((0, 1))
        return sp.csr_array(sp.vstack(found))

    def T(self, shapes: Mapping[str, ComplexArray], diameter: int) -> ComplexArray:
        """Rows (P, 3, m) or (P, 6, m) of B and C, which are nowhere, contact nodes and points."""
        each = 3 * (self.dimension - 1)
        m = sum(one.shape[1] for one in shapes.values())
        found = [np.zeros((2 * each, m), dtype=complex)]
        for sides in self.rows:
            block = np.zeros((sides[0][2].shape[0], m), dtype=complex)
            for owner, further, matrix in sides:
                first = 0
                for name, one in shapes.items():
                    if name == owner:
                        rows = self.in_sector(matrix, diameter) if further else matrix
                        block[:, first : first + one.shape[1]] += rows @ one
                    first += one.shape[1]
            found.append(block)
        return np.concatenate(found).reshape(-1, each, m)


def known_bodies(what: str, names: Iterable[str], bodies: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of bodies; InputError for unknown ones."""
    found = as_texts(names, f"cyclic_basis: {what}")
    for name in found:
        if name not in bodies:
            raise InputError(f"cyclic_basis: {what} names the body '{name}'"
                             f"{nearest(name, bodies)}; the bodies are {choices(bodies)}.")
    return tuple(found)
