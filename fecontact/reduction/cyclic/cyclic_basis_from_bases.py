r"""Sectors of reduced bodies that touch their neighbours, or are joined to them by springs.

With coordinates y of the bodies of one sector, those of the next one are ``y e^{i k alpha}``, so
that rows W_a over the bodies of the sector and W_b over those of the next one make relative
displacements

.. math:: d = (W_a + e^{i k \alpha} W_b) y
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.tables import located
from fecontact.core.types import Array, ComplexArray
from fecontact.fem.cyclic_symmetry import NEXT, CyclicSymmetry
from fecontact.reduction.assembly.assembled_basis import assembled_basis
from fecontact.reduction.assembly.links import NonlinearSpring, Spring, relative_row
from fecontact.reduction.assembly.point_pairing import PointPairing
from fecontact.reduction.cyclic.cyclic_basis import CyclicBasis, DiameterModes
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.mode_shapes import BodyPart


def cyclic_basis_from_bases(
    bases: Mapping[str, ModalBasis],
    sectors: int,
    pairings: Mapping[str, PointPairing] | None = None,
    links: Mapping[str, Spring | NonlinearSpring] | None = None,
) -> CyclicBasis:
    """Modes of a wheel by nodal diameters from the modal bases of the bodies of one sector.

    For blades or masses that only contact and springs join to the next sector; a disc that goes on
    into it needs :func:`~fecontact.reduction.cyclic_basis`. Directions turn with the sector.

    Parameters
    ----------
    bases : mapping of name to ModalBasis
        Bodies of one sector, which do not rotate.
    sectors : int
        N, two or more.
    pairings : mapping of interface to PointPairing
        Between their points; ``next_NAME`` is a body of the next sector.
    links : mapping of name to link
        :class:`Spring` without preload; nonlinear ones, such as
        :class:`~fecontact.reduction.PolynomialSpring`, become interfaces whose law is
        ``spring.law``.

    Raises
    ------
    InputError
        For unknown names, bodies that rotate or have large deflections, and other links.
    """
    owner = "cyclic_basis_from_bases"
    require_kind(owner, Mapping, bases=bases)
    symmetry = CyclicSymmetry("low", "high", sectors)
    given: dict[str, ModalBasis] = {}
    for name, one in bases.items():
        require_kind(f"{owner}: body '{name}'", ModalBasis, basis=one)
        if name.startswith(NEXT):
            raise InputError(f"{owner}: the name '{name}' must not begin with '{NEXT}', which is "
                             f"for bodies of the next sector.")
        if one.rotation is not None or one.large_deflections:
            raise InputError(f"{owner}: body '{name}' rotates or has large deflections; use "
                             f"cyclic_basis, or leave them out.")
        # B and C are nowhere on a wheel.
        given[name] = replace(one, T=np.concatenate([np.zeros((2, *one.T.shape[1:])), one.T[2:]]))
    springs = {name: link for name, link in (links or {}).items() if isinstance(link, Spring)}
    for name, link in (links or {}).items():
        require_kind(f"{owner}: link '{name}'", (Spring, NonlinearSpring), link=link)
        if isinstance(link, Spring) and (link.preload or link.shortening):
            raise InputError(f"{owner}: link '{name}' has a preload; give a PolynomialSpring.")
    pairings = dict(pairings or {})
    with located(f"{owner}:"):
        both = assembled_basis(
            {**given, **{f"{NEXT}{name}": one for name, one in given.items()}}, pairings,
            {name: link for name, link in (links or {}).items() if name not in springs})
        own = assembled_basis(given, {})
        rows = {name: relative_row(both, link) for name, link in springs.items()}
    n = both.contact_nodes
    kept = np.concatenate([np.arange(2 + n), 2 + n + np.flatnonzero(
        [not name.startswith(NEXT) for name in both.extra])])
    diameters = tuple(_diameter(k, symmetry, own, both.T[kept], rows, springs)
                      for k in symmetry.diameters)
    first = diameters[0]
    stiffness = first.stiffness.real
    basis = replace(
        own, angular_frequencies=np.sqrt(np.maximum(np.diag(stiffness), 0.0)),
        damping=first.damping.real, stiffness=stiffness, T=first.T.real,
        positions=both.positions[kept], tributary=both.tributary, groups=both.groups,
        contact_normals=both.contact_normals, on_ground=both.on_ground, springs=both.springs,
        mode_shapes=None, inertia_rows=None,
        parts=tuple(BodyPart(part.name, part.modes, (0, 0)) for part in own.parts))
    gaps = [np.broadcast_to(np.asarray(one.gaps, dtype=float), len(np.asarray(one.tributary)))
            for one in pairings.values()]
    return CyclicBasis(symmetry, {}, diameters, basis, np.concatenate(
        [np.zeros(0), *gaps, np.zeros(len(both.springs))]), basis.boundaries)


def _diameter(
    k: int, symmetry: CyclicSymmetry, own: ModalBasis, T: Array, rows: Mapping[str, Array],
    springs: Mapping[str, Spring],
) -> DiameterModes:
    """Coordinates of the bodies of a sector in waves of the nodal diameter k."""
    phase, m = np.exp(1j * k * symmetry.angle), own.modes
    if symmetry.is_real(k):
        phase = phase.real

    def folded(matrix: Array) -> ComplexArray:
        return np.asarray(matrix[..., :m] + phase * matrix[..., m:], dtype=complex)

    K, C = own.stiffness_matrix.astype(complex), own.damping.astype(complex)
    for name, row in rows.items():
        felt = folded(row)
        both = np.outer(felt.conj(), felt)
        K, C = K + springs[name].stiffness * both, C + springs[name].damping * both
    return DiameterModes(k, K, C, folded(T), own.boundary_rows.astype(complex), {})
