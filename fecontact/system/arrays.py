"""Arrays of a contact system for its compiled kernels."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from fecontact.core.compiled import CompiledLaw
from fecontact.core.types import Array, Integers
from fecontact.laws.excitation import Drive, Load
from fecontact.laws.ground.ground import Ground
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.nodes import SystemArrays
from fecontact.system.loads import load_rows

LawGroup = tuple[slice, Array, Any]


def system_arrays(
    basis: ModalBasis, normal_groups: Iterable[LawGroup], friction_groups: Iterable[LawGroup],
    ground: Ground, drive: Drive, load: Load, gap: Array, *, motion: Ground, sliding: Array,
) -> SystemArrays:
    """Matrices, rows, parameters and addresses of the laws of a system.

    The groups are contact nodes that share a law: their place, each one's part of their face, and
    the law; see :meth:`fecontact.ContactSystem.law_groups`. ``motion`` moves the other side of node
    j, ``sliding[j]`` times.
    """
    B = basis.T[0]
    stiffness = np.array(basis.stiffness_matrix)
    damping = basis.damping.copy()
    springs = np.array([drive.stiffness_x, drive.stiffness_y], dtype=float)
    dashpots = np.array([drive.damping_x, drive.damping_y], dtype=float)
    for axis, c, b in ((0, drive.stiffness_x, drive.damping_x),
                       (1, drive.stiffness_y, drive.damping_y)):
        stiffness += c * np.outer(B[axis], B[axis])
        damping += b * np.outer(B[axis], B[axis])
    n = basis.contact_nodes
    friction_groups = list(friction_groups)
    normal, normal_parameters = _law_table(normal_groups)
    friction, friction_parameters = _law_table(friction_groups)
    memory = [np.full(nodes.stop - nodes.start, law.memory, dtype=np.int64)
              for nodes, _, law in friction_groups]
    constant_load, load_shapes = load_rows(basis, load)
    signals = load.signals.values()
    scale = ground.friction_scale_kernel
    return SystemArrays(
        stiffness=stiffness,
        damping=damping,
        modal_damping=basis.damping.copy(),
        constant_load=basis.centrifugal_load + constant_load,
        drive_shapes=np.array(B[:2], dtype=float),
        drive_stiffness=springs,
        drive_damping=dashpots if drive.dashpots == "relative" else np.zeros(2),
        load_shapes=load_shapes,
        Tx=basis.contact_T[:, 0].copy(),
        Ty=basis.contact_T[:, 1].copy(),
        abscissa=basis.contact_x.copy(),
        gap=np.array(np.broadcast_to(gap, n)),
        sliding=np.array(sliding, dtype=float),
        bristle_stiffness=_bristles(friction_groups, n),
        normal_parameters=normal_parameters,
        friction_parameters=friction_parameters,
        profile_parameters=ground.profile_parameters(),
        friction_scale_parameters=ground.friction_scale_parameters(),
        ground_motion_parameters=motion.motion_parameters(),
        drive_parameters=_rows([motion.parameters() for motion in drive.motions]),
        load_parameters=_rows([signal.parameters() for signal in signals]),
        normal=normal,
        friction=friction,
        memory=np.concatenate(memory),
        on_ground=basis.ground_nodes.astype(np.int64),
        drive=_addresses(motion.kernel for motion in drive.motions),
        load=_addresses(signal.kernel for signal in signals),
        profile=ground.profile_kernel.address,
        friction_scale=0 if scale is None else scale.address,
        ground_motion=motion.motion_kernel.address,
        leans=int(ground.normal == "surface"),
    )


def _bristles(friction_groups: list[LawGroup], n: int) -> Array:
    """Stiffness (2, n, s) of the internal variables, and its derivative to the normal force."""
    found = np.zeros((2, n, max((law.memory for _, _, law in friction_groups), default=0)))
    for nodes, share, law in friction_groups:
        found[:, nodes, : law.memory] = law.bristle_stiffness_of(share)
    return found


def _law_table(law_groups: Iterable[LawGroup]) -> tuple[Integers, Array]:
    """Addresses (n,) and parameters (n, k) of the laws of all nodes."""
    groups = [(law, law.table(share)) for _, share, law in law_groups]
    width = max(table.shape[1] for _, table in groups)
    return (np.concatenate([np.full(len(table), law.kernel.address, dtype=np.int64)
                            for law, table in groups]),
            np.vstack([np.pad(table, ((0, 0), (0, width - table.shape[1])))
                       for _, table in groups]))


def _rows(parameters: list[Array]) -> Array:
    """Parameters of several functions as one array, padded with zeros."""
    table = np.zeros((len(parameters), max((len(row) for row in parameters), default=1)))
    for index, row in enumerate(parameters):
        table[index, : len(row)] = row
    return table


def _addresses(kernels: Iterable[CompiledLaw]) -> Integers:
    return np.array([kernel.address for kernel in kernels], dtype=np.int64)
