"""A modal basis in other modes: of linked bodies, or of bodies with further masses."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import require_not_negative
from fecontact.core.types import Array
from fecontact.reduction.eigenmodes import fixed_signs
from fecontact.reduction.modal_basis import ModalBasis


def in_modes(
    basis: ModalBasis, w: Array, modes: Array, damping: Array, load: Array | None
) -> ModalBasis:
    """The basis with modal coordinates p, q = modes p, that have the frequencies w (p,).

    ``damping`` (m, m) and the constant ``load`` (m,) are those along q. The modes are no longer
    blocks of single bodies, so ``modes`` of all parts are empty.
    """
    skew = None if basis.stiffness is None else basis.stiffness - np.diag(
        basis.angular_frequencies**2)
    shapes = basis.mode_shapes
    return replace(
        basis,
        angular_frequencies=w,
        damping=modes.T @ damping @ modes,
        T=basis.T @ modes,
        mode_shapes=None if shapes is None else replace(
            shapes, shapes=shapes.shapes @ modes, stress=shapes.stress @ modes,
            nonlinear_stress=None if shapes.nonlinear_stress is None else replace(
                shapes.nonlinear_stress,
                coordinates=shapes.nonlinear_stress.coordinates @ modes)),
        quality=None,
        inertia_rows=None if basis.inertia_rows is None else basis.inertia_rows @ modes,
        boundary_rows=basis.boundary_rows @ modes,
        stiffness=None if skew is None else np.diag(w**2) + modes.T @ skew @ modes,
        parts=tuple(replace(part, modes=(0, 0)) for part in basis.parts),
        rotation=None if basis.rotation is None else basis.rotation.in_modes(modes),
        constant_load=None if load is None or not load.any() else load @ modes,
        large_deflections=tuple(one.in_modes(modes) for one in basis.large_deflections),
    )


def with_masses(basis: ModalBasis, masses: Mapping[str, float]) -> ModalBasis:
    r"""The basis with further masses at points, such as those of sensors.

    .. math:: M = I + \sum_j m_j R_j^T R_j

    with the rows R_j of the displacements of the points; the new modes are those of M within the
    given ones. They have no moment of inertia, and weight as far as the basis knows its mass.

    Parameters
    ----------
    basis : ModalBasis
        Basis of one or several bodies.
    masses : mapping of point to float
        Masses at named points, zero or above [kg].

    Raises
    ------
    InputError
        For a point that does not exist, or a mass that is negative or not finite.
    """
    require_kind("with_masses", ModalBasis, basis=basis)
    require_kind("with_masses", Mapping, masses=masses)
    d, mass = basis.dimension, np.eye(basis.modes)
    inertia = None if basis.inertia_rows is None else np.array(basis.inertia_rows)
    for point, value in masses.items():
        require_kind("with_masses", str, point=point)
        require_not_negative("with_masses", **{f"mass at '{point}'": value})
        rows = basis.T[basis.point_index(point), :d]
        mass += value * rows.T @ rows
        if inertia is not None:
            inertia += value * rows
    if not any(masses.values()):
        return basis
    # q = S p has p'' with the unit matrix; rigid motions and those orthogonal to them stay apart.
    S = np.linalg.inv(np.linalg.cholesky(mass)).T
    w = basis.angular_frequencies
    rigid = w == 0.0
    free = np.linalg.qr(np.linalg.solve(S, np.eye(len(w))[:, rigid]))[0]
    rest = np.linalg.qr(np.hstack([free, np.eye(len(w))]))[0][:, int(rigid.sum()):]
    values, directions = np.linalg.svd(w[:, None] * (S @ rest), full_matrices=False)[1:]
    found = S @ np.hstack([free, rest @ directions[::-1].T])
    return in_modes(replace(basis, inertia_rows=inertia),
                    np.concatenate([np.zeros(int(rigid.sum())), values[::-1]]),
                    found * fixed_signs(found), basis.damping, basis.constant_load)
