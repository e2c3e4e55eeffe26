"""Modes of a cyclic structure by nodal diameters, from one sector."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fecontact.core.checks import as_integers, require_kind
from fecontact.core.errors import InputError, shown
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ComplexArray, Integers
from fecontact.core.units import Summarised, span
from fecontact.fem.cyclic_symmetry import (
    CyclicSymmetry,
    SectorNodes,
    cyclic_expansion,
    sector_nodes,
)
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.fields import linear_cells
from fecontact.fem.rotation import Rotation
from fecontact.reduction.eigenmodes import FreeSystem, free_modes, frequencies_of
from fecontact.reduction.reduce_body import first_order
from fecontact.reduction.sector_rotation import SectorRotation, sector_rotation
from fecontact.reduction.solid_motions import rigid_motions
from fecontact.reduction.static_modes.residual_vectors import completing

# Singular values of motions below which they keep the symmetry and the supports: faces of files in
# single precision match no better.
_KEPT = 1e-4


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class SectorModes(Summarised):
    """Modes of a wheel of equal sectors, by nodal diameters k.

    The displacement of sector s (from 0), in its own coordinates, which turn with it, is
    ``Re(shape e^{i k s alpha})``. For 0 < k < N / 2 a mode is double: real and imaginary part, or
    waves that travel forwards and backwards. For k = 0 and N / 2 it is real and single.

    Attributes
    ----------
    symmetry : CyclicSymmetry
    diameters : tuple of int
        k of the K rows below.
    frequencies_hz : (K, m) array
        [Hz], ascending in each row; exactly zero for rigid modes.
    shapes : (K, N, d, m) complex array
        Displacements of the nodes of the sector, ``shape^H M shape = 1`` with its mass.
    nodes : (N, d) array
        Reference places of the nodes of the sector [m].
    elements : (E, n) integer array
        Nodes of each of its elements.
    outline : (k, n) integer array
        First-order edges or facets of its outline that meet no neighbour.
    joined : SectorNodes
        Nodes that it shares with its neighbours.
    rotation : SectorRotation or None
        Terms of a rotation in these modes; ``rotation.frequencies_hz(speed)`` are those at speed.
    """

    symmetry: CyclicSymmetry
    diameters: tuple[int, ...]
    frequencies_hz: Array
    shapes: ComplexArray
    nodes: Array
    elements: Integers
    outline: Integers
    joined: SectorNodes
    rotation: SectorRotation | None = None

    def summary(self) -> list[tuple[str, str]]:
        """Sectors, nodal diameters and frequencies."""
        return [("sectors", f"{self.symmetry.sectors}"),
                ("nodal diameters", ", ".join(map(str, self.diameters))),
                ("modes of each", f"{self.frequencies_hz.shape[1]}"),
                ("frequencies", span(self.frequencies_hz.ravel(), "Hz"))]

    def row(self, diameter: int) -> int:
        """Row of a nodal diameter; InputError for one that is not there."""
        if diameter not in self.diameters:
            raise InputError(f"SectorModes: diameter = {diameter!r} must be one of "
                             f"{', '.join(map(str, self.diameters))}.")
        return self.diameters.index(diameter)

    @property
    def wheel_frequencies_hz(self) -> Array:
        """All frequencies of the wheel [Hz], ascending, double ones twice."""
        return np.sort(np.concatenate([
            np.repeat(row, 1 if self.symmetry.is_real(k) else 2)
            for k, row in zip(self.diameters, self.frequencies_hz, strict=True)]))

    def on_wheel(self, diameter: int, mode: int, phase: float = 0.0) -> "WheelShape":
        """A mode over the whole wheel, mass-normalised, at a phase of its vibration [rad].

        Phases 0 and pi / 2 are the two modes of a pair. InputError for a mode that is not there.
        """
        row = self.row(diameter)
        require_kind("on_wheel", int, mode=mode)
        if not 0 <= mode < self.frequencies_hz.shape[1]:
            raise InputError(f"on_wheel: mode = {mode} must be from 0 to "
                             f"{self.frequencies_hz.shape[1] - 1}.")
        symmetry, d, count = self.symmetry, self.nodes.shape[1], len(self.nodes)
        N = symmetry.sectors
        size = np.sqrt((1.0 if symmetry.is_real(diameter) else 2.0) / N)
        shape = size * self.shapes[row, :, :, mode] * np.exp(1j * phase)
        sectors = range(N)
        moved = [(shape * np.exp(1j * diameter * s * symmetry.angle)).real
                 @ symmetry.rotation(d, s).T for s in sectors]
        nodes = np.concatenate([symmetry.turned(self.nodes, s) for s in sectors])
        # A node between two sectors is one of the next, a node on the axis one of the first.
        owner = np.arange(N * count).reshape(N, count)
        if self.joined.weights is None:
            owner[:, self.joined.high] = np.roll(owner, -1, axis=0)[:, self.joined.low]
        owner[:, self.joined.on_axis] = owner[0, self.joined.on_axis]
        kept, number = np.unique(owner, return_inverse=True)
        number = number.reshape(N, count)
        cells = linear_cells(self.nodes, self.elements)
        return WheelShape(nodes[kept], np.concatenate([one[cells] for one in number]),
                          np.concatenate([one[self.outline] for one in number]),
                          np.concatenate(moved)[kept])


@read_only_arrays
@dataclass(frozen=True, eq=False)
class WheelShape:
    """A displacement over all sectors, one after the other.

    Attributes
    ----------
    nodes : (n, d) array
        Places [m].
    cells, outline : integer arrays
        First-order cells, and edges or facets of the outline.
    displacement : (n, d) array
        [kg^(-1/2)]
    """

    nodes: Array
    cells: Integers
    outline: Integers
    displacement: Array


def sector_modes(
    body: ElasticBody,
    symmetry: CyclicSymmetry,
    modes: int = 6,
    *,
    diameters: Sequence[int] | Literal["all"] = "all",
    rotation: Rotation | None = None,
) -> SectorModes:
    """Modes of a wheel of N equal sectors, each nodal diameter from one sector.

    Displacements of the face ``high`` are eliminated by ``u_H = e^{i k alpha} R u_L``, which makes
    stiffness and mass Hermitian, for k = 0 and N / 2 real. Frequencies are those of the whole wheel
    of the same mesh, to round-off.

    Parameters
    ----------
    body : ElasticBody
        The sector, plane or solid, with supports that are alike in all sectors.
    symmetry : CyclicSymmetry
        The faces that meet the neighbours, N and the axis.
    modes : int
        Number of modes of each nodal diameter, the lowest, rigid ones included.
    diameters : sequence of int or 'all'
        Nodal diameters k from 0 to N / 2.
    rotation : Rotation, optional
        About the axis of the symmetry. Modes stay those at rest and carry the motion at speed: keep
        enough of them.

    Raises
    ------
    InputError, MeshError
        For faces that do not match, with the place, and how far; see
        :func:`fecontact.fem.cyclic_symmetry.sector_nodes`; nodal diameters out of range.
    """
    require_kind("sector_modes", ElasticBody, body=body)
    nodes = sector_nodes(body, symmetry)
    chosen = chosen_diameters(symmetry, diameters)
    found = [modes_of_diameter(body, symmetry, nodes, k, modes) for k in chosen]
    frequencies, shapes = (np.array(one) for one in zip(*found, strict=True))
    turning = None
    if rotation is not None:
        turning = sector_rotation(body, symmetry, rotation, frequencies**2, shapes,
                                  alike(body, symmetry, nodes))
    return SectorModes(
        symmetry, tuple(chosen), frequencies / (2.0 * np.pi), shapes, body.nodes,
        body.elements, _open_outline(body, symmetry), nodes, turning)


def chosen_diameters(
    symmetry: CyclicSymmetry, diameters: Iterable[int] | str, owner: str = "sector_modes"
) -> list[int]:
    """Nodal diameters, ascending; InputError for those out of range."""
    if isinstance(diameters, str):
        if diameters != "all":
            raise InputError(f"{owner}: diameters = {diameters!r} must be 'all' or a list of "
                             f"whole numbers.")
        return list(symmetry.diameters)
    chosen = np.unique(as_integers(diameters, f"{owner}: diameters"))
    if not chosen.size or chosen[0] < 0 or chosen[-1] > symmetry.sectors // 2:
        raise InputError(f"{owner}: diameters = {shown(diameters)} must be from 0 to N / 2 = "
                         f"{symmetry.sectors // 2}, at least one.")
    return [int(one) for one in chosen]


def alike(
    body: ElasticBody, symmetry: CyclicSymmetry, nodes: SectorNodes
) -> tuple[Any, FreeSystem]:
    """Motions B, sparse (d N, n), in which all sectors move alike, with their stiffness and mass.

    These are those of the nodal diameter 0, to which loads that are the same for all belong.
    """
    B, inverse = cyclic_expansion(body, symmetry, nodes, 0)
    K, M = ((B.T @ one @ B).tocsc() for one in (body.stiffness, body.mass))
    return B, FreeSystem(K, M, _rigid(body, B, inverse, M))


def modes_of_diameter(
    body: ElasticBody, symmetry: CyclicSymmetry, nodes: SectorNodes, diameter: int, count: int,
    rows: Any = None,
) -> tuple[Array, ComplexArray]:
    """Angular frequencies (m,) and shapes (N, d, m) of a nodal diameter.

    With ``rows``, sparse (p, d N), residual vectors follow the modes: with them the static response
    to forces along these displacements is exact, and more modes than there are unknowns are all
    of them. The response is that of all sectors, to forces with the phase of the diameter.
    """
    B, inverse = cyclic_expansion(body, symmetry, nodes, diameter)
    K, M = (B.conj().T @ one @ B for one in (body.stiffness, body.mass))
    rigid = _rigid(body, B, inverse, M)
    if rows is not None:
        count = min(count, K.shape[0])
    found: Any
    deflections: Any
    if symmetry.is_real(diameter):
        system = FreeSystem(K.tocsc(), M.tocsc(), rigid)
        _, found = free_modes(system, count)
    else:
        system = FreeSystem(_as_real(K), _as_real(M), _real_pairs(rigid))
        _, pairs = free_modes(system, 2 * count)
        found = _one_of_each(_from_halves(pairs), K, M, count)
    if rows is not None and rows.shape[0]:
        forces = (B.conj().T @ rows.T.conj()).toarray()
        if symmetry.is_real(diameter):
            deflections = system.deflection(np.ascontiguousarray(forces.real))
        else:
            deflections = _from_halves(system.deflection(np.vstack([forces.real, forces.imag])))
        found = np.hstack([found, completing(FreeSystem(K, M, rigid), found, deflections)])
    shapes = np.asarray(B @ found, dtype=complex)
    # Rayleigh quotients of strains do not carry the rounding of K.
    w = np.sqrt(frequencies_of(body, shapes.real) ** 2 + frequencies_of(body, shapes.imag) ** 2)
    w[: rigid.shape[1]] = 0.0
    largest = shapes[np.abs(shapes).argmax(axis=0), np.arange(shapes.shape[1])]
    return w, (shapes * (np.abs(largest) / largest)).reshape(-1, body.dimension, shapes.shape[1])


def _from_halves(pairs: Array) -> ComplexArray:
    """Complex vectors (n, k) of real ones (2 n, k), real parts above imaginary ones."""
    half = len(pairs) // 2
    return np.asarray(pairs[:half] + 1j * pairs[half:])


def _rigid(body: ElasticBody, B: Any, inverse: Any, M: Any) -> Any:
    """Mass-normalised rigid motions (n, r) with the phase of a nodal diameter."""
    motions = rigid_motions(body.nodes / body.mesh.extent, np.zeros(body.dimension))
    unknowns = inverse @ motions
    _, values, directions = np.linalg.svd(motions - B @ unknowns, full_matrices=False)
    kept = directions[values <= _KEPT * np.linalg.norm(motions)].conj().T
    rigid = unknowns @ kept
    gram = rigid.conj().T @ (M @ rigid)
    return np.asarray(rigid @ np.linalg.inv(np.linalg.cholesky(gram).conj().T))


def _as_real(matrix: Any) -> Any:
    """Real symmetric matrix (2 n, 2 n) of a Hermitian one, with each eigenvalue twice."""
    import scipy.sparse as sp

    real, imaginary = matrix.real, matrix.imag
    return sp.csc_array(sp.block_array([[real, -imaginary], [imaginary, real]]))


def _real_pairs(vectors: ComplexArray) -> Array:
    """Columns (2 n, 2 r) of complex ones and of these times i."""
    return np.block([[vectors.real, -vectors.imag], [vectors.imag, vectors.real]])


def _one_of_each(pairs: ComplexArray, K: Any, M: Any, count: int) -> ComplexArray:
    """Modes (n, m) of the space that pairs (n, 2 m) of them span, each pair the same mode."""
    from scipy.linalg import eigh

    size, turn = np.linalg.eigh(pairs.conj().T @ (M @ pairs))
    basis = pairs @ (turn[:, -count:] / np.sqrt(size[-count:]))
    small = [basis.conj().T @ (one @ basis) for one in (K, M)]
    _, found = eigh(*(0.5 * (one + one.conj().T) for one in small))
    return np.asarray(basis @ found)


def _open_outline(body: ElasticBody, symmetry: CyclicSymmetry) -> Integers:
    """First-order edges (k, 2) or facets of the outline without the faces that meet neighbours."""
    joined = {tuple(sorted(facet)) for name in (symmetry.low, symmetry.high)
              for facet in body.mesh.boundary(name).tolist()}
    kept = [tuple(sorted(facet)) not in joined for facet in body.mesh.outline.tolist()]
    return first_order(body, body.mesh.outline[kept])
