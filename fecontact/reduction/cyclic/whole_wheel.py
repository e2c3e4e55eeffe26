r"""Whole wheels from the modes of one sector: all sectors, with interfaces between each two.

Real coordinates (a, b) of a mode of the nodal diameter k move sector s by

.. math:: u_s = \sqrt{2 / N} Re(\Phi_k (a + i b) e^{i k s \alpha})

and those of k = 0 and N / 2, which have no b, by half the square. They are mass-normalised.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fecontact.core.checks import as_floats, require_kind
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike, ComplexArray
from fecontact.core.units import listed
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.group_stiffness import group_stiffness
from fecontact.reduction.cyclic.cyclic_basis import CyclicBasis
from fecontact.reduction.modal_basis import ModalBasis


@read_only_arrays
@dataclass(frozen=True, eq=False)
class WholeWheel:
    """All sectors of a wheel in the modes of all nodal diameters, tuned or mistuned.

    Parameters
    ----------
    wheel : CyclicBasis
        Modes of the wheel for all diameters.
    deviations : (N,) numbers, optional
        delta_s of the stiffness of a group of cells, above -1: ``K_s = (1 + delta_s) K`` in
        sector s.
    group : 'body.group', optional
        The cells whose stiffness deviates, a group of the mesh such as 'blade.aerofoil'; a body
        alone stands for all its cells.

    Raises
    ------
    InputError
        For a wheel that lacks diameters, unknown groups, and deviations that are not N numbers
        above -1.
    """

    wheel: CyclicBasis
    deviations: ArrayLike | None = None
    group: str | None = None

    def __post_init__(self) -> None:
        require_kind("WholeWheel", CyclicBasis, wheel=self.wheel)
        symmetry = self.wheel.symmetry
        missing = set(symmetry.diameters) - {one.diameter for one in self.wheel.diameters}
        if missing:
            raise InputError(f"WholeWheel: the wheel lacks the nodal diameters "
                             f"{listed([str(k) for k in sorted(missing)])}; make it by "
                             f"cyclic_basis(..., diameters='all').")
        if (self.deviations is None) != (self.group is None):
            raise InputError("WholeWheel: give deviations and group together, or none of them.")
        if self.deviations is None:
            return
        given = as_floats(self.deviations, "WholeWheel: deviations")
        if given.shape != (symmetry.sectors,) or not (given > -1.0).all() or not np.isfinite(
                given).all():
            raise InputError(f"WholeWheel: deviations must be {symmetry.sectors} numbers above -1, "
                             f"one of each sector, not {self.deviations!r}.")
        object.__setattr__(self, "deviations", given)
        _ = self._deviating

    @property
    def sectors(self) -> int:
        """N."""
        return self.wheel.symmetry.sectors

    @cached_property
    def blocks(self) -> list[tuple[int, int, int]]:
        """Diameter, first coordinate and number of modes of each diameter."""
        found, first = [], 0
        for one in self.wheel.diameters:
            m = len(one.stiffness)
            found.append((one.diameter, first, m))
            first += m if self.wheel.symmetry.is_real(one.diameter) else 2 * m
        return found

    @property
    def modes(self) -> int:
        """Number of coordinates."""
        k, first, m = self.blocks[-1]
        return first + m * (1 if self.wheel.symmetry.is_real(k) else 2)

    def in_sector(self, sector: int, parts: list[ComplexArray]) -> Array:
        """Real rows (..., M) of a sector from complex ones (..., m_k) of each diameter."""
        N, alpha = self.sectors, self.wheel.symmetry.angle
        found = []
        for (k, _, _), one in zip(self.blocks, parts, strict=True):
            turned = one * np.exp(1j * k * sector * alpha)
            if self.wheel.symmetry.is_real(k):
                found.append(turned.real / np.sqrt(N))
            else:
                found += [np.sqrt(2.0 / N) * turned.real, -np.sqrt(2.0 / N) * turned.imag]
        return np.concatenate(found, axis=-1)

    def real(self, parts: list[ComplexArray]) -> Array:
        """Real matrix (M, M) of complex ones (m_k, m_k) of each diameter."""
        from scipy.linalg import block_diag

        return np.asarray(block_diag(*(
            one.real if self.wheel.symmetry.is_real(k) else np.block(
                [[one.real, -one.imag], [one.imag, one.real]])
            for (k, _, _), one in zip(self.blocks, parts, strict=True))))

    @cached_property
    def _deviating(self) -> tuple[ElasticBody, str, str]:
        """Body, its name and group of cells whose stiffness deviates."""
        assert self.group is not None
        require_kind("WholeWheel", str, group=self.group)
        name, _, cells = self.group.partition(".")
        bodies = self.wheel.bodies
        if name not in bodies:
            raise InputError(f"WholeWheel: group names the body '{name}'{nearest(name, bodies)}; "
                             f"the bodies are {choices(bodies)}.")
        groups = bodies[name].mesh.cell_groups
        if cells and cells not in groups:
            raise InputError(f"WholeWheel: body '{name}' has no group of cells '{cells}'"
                             f"{nearest(cells, groups)}; it has {choices(groups) or 'none'}.")
        return bodies[name], name, cells

    @cached_property
    def _gram(self) -> tuple[Array, list[int]]:
        """Stiffness of the deviating cells in real and imaginary parts of all shapes."""
        body, name, cells = self._deviating
        K = group_stiffness(body, cells)
        parts = [one.shapes[name].reshape(body.unknowns, -1) for one in self.wheel.diameters]
        whole = np.hstack(parts)
        both = np.hstack([whole.real, whole.imag])
        return np.asarray(both.T @ (K @ both)), [one.shape[1] for one in parts]

    def sector_stiffness(self, sector: int) -> Array:
        """Stiffness (M, M) of the deviating cells of one sector."""
        gram, sizes = self._gram
        total = sum(sizes)
        # Parts of the shapes by themselves: the real part of a shape is 1, the imaginary one i.
        columns, first = [], 0
        for (k, _, _), m in zip(self.blocks, sizes, strict=True):
            phase = np.exp(1j * k * sector * self.wheel.symmetry.angle)
            size = np.sqrt((1.0 if self.wheel.symmetry.is_real(k) else 2.0) / self.sectors)
            rows = np.arange(first, first + m)
            for turn in ((phase,) if self.wheel.symmetry.is_real(k) else (phase, 1j * phase)):
                block = np.zeros((2 * total, m))
                block[rows, np.arange(m)] = size * turn.real
                block[total + rows, np.arange(m)] = -size * turn.imag
                columns.append(block)
            first += m
        moved = np.hstack(columns)
        return np.asarray(moved.T @ gram @ moved)

    @cached_property
    def stiffness(self) -> Array:
        """Modal stiffness (M, M) with the deviations [1/s^2]."""
        found = self.real([one.stiffness for one in self.wheel.diameters])
        if self.deviations is not None:
            for sector, deviation in enumerate(np.asarray(self.deviations)):
                if deviation:
                    found = found + deviation * self.sector_stiffness(sector)
        return 0.5 * (found + found.T)

    @cached_property
    def damping(self) -> Array:
        """Modal damping (M, M) of the tuned wheel [1/s]."""
        return self.real([one.damping for one in self.wheel.diameters])

    def rows(self, point: str, component: str) -> Array:
        """Rows (N, M) of a component of the motion of a point in all sectors."""
        basis = self.wheel.basis
        index = basis.point_index(point)
        if component not in basis.components:
            raise InputError(f"The component {component!r} at {point!r} must be one of "
                             f"{choices(basis.components)}.")
        column = basis.components.index(component)
        parts = [one.T[index, column] for one in self.wheel.diameters]
        return np.array([self.in_sector(s, parts) for s in range(self.sectors)])

    @cached_property
    def basis(self) -> ModalBasis:
        """Basis of the whole wheel, for contact systems.

        Interface NAME between sector s and what it touches is ``NAME_s``, point ``body.name`` of
        sector s ``s.body.name``; directions turn with the sector.
        """
        own, N, d = self.wheel.basis, self.sectors, self.wheel.basis.dimension
        n, symmetry = own.contact_nodes, self.wheel.symmetry
        parts = [one.T for one in self.wheel.diameters]
        each = [self.in_sector(s, parts) for s in range(N)]
        groups, places, nodes, normals = [], [], [], []
        first = 0
        for name, count in own.groups:
            for s in range(N):
                groups.append((f"{name}_{s}", count))
                nodes.append(each[s][2 + first : 2 + first + count])
                places.append(symmetry.turned(own.positions[2 + first : 2 + first + count], s))
                normals.append(np.arange(first, first + count))
            first += count
        order = np.concatenate([np.zeros(0, int), *normals])
        squares = np.maximum(np.diag(self.stiffness), 0.0)
        load = own.constant_load
        return ModalBasis(
            angular_frequencies=np.sqrt(squares), damping=self.damping,
            T=np.concatenate([np.zeros((2, *own.T.shape[1:2], self.modes)), *nodes,
                              *(one[2 + n :] for one in each)]),
            positions=np.concatenate([np.zeros((2, d)), *places, *(
                symmetry.turned(own.positions[2 + n :], s) for s in range(N))]),
            tributary=own.tributary[order], groups=tuple(groups),
            extra=tuple(f"{s}.{name}" for s in range(N) for name in own.extra),
            thickness=own.thickness, stiffness=self.stiffness,
            contact_normals=None if own.contact_normals is None else own.contact_normals[order],
            on_ground=None if own.on_ground is None else own.on_ground[order],
            springs=tuple(f"{name}_{s}" for name in own.springs for s in range(N)),
            constant_load=None if load is None else np.append(
                np.sqrt(N) * load, np.zeros(self.modes - len(load))))

    def per_sector(self, laws: Mapping[str, object]) -> dict[str, object]:
        """Laws of all interfaces from those of one sector, by name."""
        return {f"{name}_{s}": law for name, law in laws.items() for s in range(self.sectors)}

    def gaps(self, gaps: Array) -> Array:
        """Gaps of all contact nodes from those (n,) of one sector [m]."""
        return np.concatenate([np.zeros(0), *(gaps[part] for part in self._by_group())])

    def _by_group(self) -> Iterator[slice]:
        first = 0
        for _, count in self.wheel.basis.groups:
            for _ in range(self.sectors):
                yield slice(first, first + count)
            first += count
