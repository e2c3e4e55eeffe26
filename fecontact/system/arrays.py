"""Arrays of a contact system for its compiled kernels."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fecontact.core.cache_lines import in_lines
from fecontact.core.checks import whole_number
from fecontact.core.compiled import CompiledLaw
from fecontact.core.errors import InputError, choices, nearest
from fecontact.core.types import Array, Integers
from fecontact.laws.excitation import AXES, Drive, Load
from fecontact.laws.friction.planar import along_slip
from fecontact.laws.friction.stribeck import no_friction
from fecontact.laws.ground.ground import Ground
from fecontact.laws.signals.harmonic import Harmonic
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.system.interfaces import PrescribedMotion
from fecontact.system.loads import load_rows
from fecontact.system.nodes import SystemArrays
from fecontact.system.polynomial_forces import evaluate_polynomial

LawGroup = tuple[slice, Array, Any]

# Return time of elastic Coulomb elements over the shortest time constant of their body.
_RETURN_PART = 1e-6

# Numbers of a drive and a load of which the arrays are multilinear functions.
_MULTILINEAR = frozenset({"load.normal", "drive.frequency_hz", *(
    f"drive.{part}_{axis}" for part in ("stiffness", "damping", "amplitude") for axis in AXES)})


def system_arrays(
    basis: ModalBasis, normal_groups: Iterable[LawGroup], friction_groups: Iterable[LawGroup],
    ground: Ground, drive: Drive, load: Load, gap: Array, motion: PrescribedMotion,
) -> SystemArrays:
    """Matrices, rows, parameters and addresses of the laws of a system.

    The groups are contact nodes that share a law: their place, each one's part of their face, and
    the law; see :meth:`fecontact.ContactSystem.law_groups`.
    """
    d, n = basis.dimension, basis.contact_nodes
    friction_groups = list(friction_groups)
    normal, normal_parameters = law_table(normal_groups)
    friction, friction_parameters = law_table(friction_groups)
    friction[basis.spring_nodes] = no_friction.address
    _set_return_times(basis, friction_groups, friction_parameters)
    # Of a node at least, as kernels take the largest number; without contact no node has it.
    memory = np.zeros(max(n, 1), dtype=np.int64)
    for nodes, _, law in friction_groups:
        memory[nodes] = (d - 1) * law.memory
    scale, surface = ground.friction_scale_kernel, ground.surface_kernel
    first, second = motion.motions[0], motion.motions[-1]
    rows = basis.contact_T
    made = SystemArrays(
        **drive_arrays(basis, drive),
        **load_arrays(basis, load),
        modal_damping=basis.damping,
        rows=rows[:, [0, 2, 1] if d == 3 else [0, 1]],
        places=(basis.contact_places[:, :2].copy() if d == 3
                else np.array(basis.contact_x)[:, None]),
        gap=np.array(np.broadcast_to(gap, n)),
        sliding=_sliding(motion.factors),
        wave_direction=np.array(ground.wave_direction if d == 3 else (1.0, 0.0)),
        bristle_stiffness=_bristles(friction_groups, n, d - 1),
        **_polynomial_arrays(basis),
        normal_parameters=normal_parameters,
        friction_parameters=friction_parameters,
        profile_parameters=ground.profile_parameters(),
        friction_scale_parameters=ground.friction_scale_parameters(),
        ground_motion_parameters=first.motion_parameters(),
        second_motion_parameters=(second.motion_parameters() if second is not first
                                  else np.zeros(1)),
        normal=normal,
        friction=friction,
        planar=_planar(friction_groups) if d == 3 else np.zeros(0, dtype=np.int64),
        memory=memory,
        on_ground=basis.ground_nodes.astype(np.int64),
        profile=ground.profile_kernel.address,
        surface=0 if surface is None else surface.address,
        friction_scale=0 if scale is None else scale.address,
        ground_motion=first.motion_kernel.address,
        second_motion=0 if second is first else second.motion_kernel.address,
        follows_surface=int(ground.normal == "surface"),
    )
    values: Iterator[Any] = (
        in_lines(one) if isinstance(one, np.ndarray) else one for one in made)
    return SystemArrays(*values)


def _polynomial_arrays(basis: ModalBasis) -> dict[str, Any]:
    """Entries of :class:`SystemArrays` of large deflections, those of one body after the other."""
    from scipy.linalg import block_diag

    given, m = basis.large_deflections, basis.modes
    first = np.cumsum([0, *(len(one.coordinates) for one in given)])
    pairs = np.concatenate([np.zeros((0, 2), dtype=np.int64), *(
        one.pairs + start for one, start in zip(given, first, strict=False))])
    return {
        "polynomial": evaluate_polynomial.address if len(pairs) else 0,
        "polynomial_rows": np.concatenate([np.zeros((0, m)), *(one.coordinates for one in given)]),
        "polynomial_pairs": pairs,
        "polynomial_cubic": np.concatenate([np.zeros((0, m)), *(one.cubic for one in given)]),
        "polynomial_quartic": block_diag(*(one.quartic for one in given)) if given else (
            np.zeros((0, 0)))}


def drive_arrays(basis: ModalBasis, drive: Drive) -> dict[str, Any]:
    """Entries of :class:`SystemArrays` that depend on the drive, by name."""
    d = basis.dimension
    B = basis.T[0, :d]
    stiffness, damping = in_lines(basis.stiffness_matrix), in_lines(basis.damping)
    for row, c, b in zip(B, drive.stiffness, drive.damping, strict=False):
        stiffness += c * np.outer(row, row)
        damping += b * np.outer(row, row)
    return {"stiffness": stiffness, "damping": damping,
            "drive_shapes": np.array(B, dtype=float),
            "drive_stiffness": np.array(drive.stiffness[:d], dtype=float),
            "drive_damping": (np.array(drive.damping[:d], dtype=float)
                              if drive.dashpots == "relative" else np.zeros(d)),
            **_motion_arrays(basis, drive)}


def _motion_arrays(basis: ModalBasis, drive: Drive) -> dict[str, Any]:
    """Entries of :class:`SystemArrays` that depend on the motions of the drive, by name."""
    motions = drive.motions[: basis.dimension]
    return {"drive_parameters": _rows([motion.parameters() for motion in motions]),
            "drive": _addresses(motion.kernel for motion in motions)}


def load_arrays(basis: ModalBasis, load: Load) -> dict[str, Any]:
    """Entries of :class:`SystemArrays` that depend on the loads, by name."""
    constant_load, load_shapes = load_rows(basis, load)
    signals = load.signals.values()
    return {"constant_load": basis.centrifugal_load + constant_load, "load_shapes": load_shapes,
            "load_parameters": _rows([signal.parameters() for signal in signals]),
            "load": _addresses(signal.kernel for signal in signals)}


def excited(
    arrays: SystemArrays, basis: ModalBasis, drive: Drive, parts: Mapping[str, Any]
) -> SystemArrays:
    """The arrays with another 'drive' than the one given, or another 'load'."""
    changed: dict[str, Any] = {}
    new = parts.get("drive", drive)
    if new is not drive:
        supports = [(one.stiffness, one.damping, one.dashpots) for one in (drive, new)]
        changed |= (_motion_arrays if supports[0] == supports[1] else drive_arrays)(basis, new)
    if "load" in parts:
        changed |= load_arrays(basis, parts["load"])
    return arrays._replace(**changed)


def multilinear(names: Iterable[str], drive: Drive, load: Load) -> bool:
    """Whether the arrays are known to be affine in each of some parameters, the others fixed.

    They are affine in the numbers of drives and loads, and of their harmonic signals, by what
    :func:`drive_arrays` and :func:`load_arrays` are. ``names`` are dotted; a drive, load or signal
    of another class may do as it likes.
    """
    return all(_multilinear(name, {"drive": drive, "load": load}) for name in names)


def _multilinear(name: str, parts: Mapping[str, Any]) -> bool:
    first, _, inner = name.partition(".")
    owner = parts.get(first)
    if type(owner) not in (Drive, Load):
        return False
    if name in _MULTILINEAR:
        return True
    *path, _ = inner.split(".")
    for step in path:
        number = whole_number(step)
        owner = (owner[number] if isinstance(owner, tuple) and number is not None
                 and number < len(owner) else getattr(owner, step, None))
    return type(owner) is Harmonic


def with_motions(arrays: SystemArrays, factors: Array) -> SystemArrays:
    """Arrays of a system whose other sides move with factors (k, n, 2), k = 1 or 2, in space."""
    return arrays._replace(sliding=_sliding(factors))


def _sliding(factors: Array) -> Array:
    """Factors (n, d - 1, 2) of both motions along the tangents, from those (k, n) or (k, n, 2)."""
    factors = np.asarray(factors, dtype=float)
    by_tangent = factors if factors.ndim == 3 else factors[:, :, None]
    found = np.zeros((factors.shape[1], by_tangent.shape[2], 2))
    found[:, :, : len(factors)] = by_tangent.transpose(1, 2, 0)
    return found


def _planar(friction_groups: list[LawGroup]) -> Integers:
    """Addresses (n,) of friction in two directions; InputError for a law that has none."""
    found = []
    for nodes, _, law in friction_groups:
        kernel = along_slip if law.memory == 0 else law.planar_kernel
        if kernel is None:
            raise InputError(f"{type(law).__name__} has internal variables, but no planar_kernel, "
                             f"its function in two directions, and cannot act on solids; give it "
                             f"one, or use a law without memory.")
        found.append(np.full(nodes.stop - nodes.start, kernel.address, dtype=np.int64))
    return np.concatenate(found)


def _bristles(friction_groups: list[LawGroup], n: int, components: int) -> Array:
    """Stiffness (2, n, s) of the internal variables, and its derivative to the normal force."""
    most = max((law.memory for _, _, law in friction_groups), default=0)
    found = np.zeros((2, n, components * most))
    for nodes, share, law in friction_groups:
        found[:, nodes, : components * law.memory] = np.repeat(
            law.bristle_stiffness_of(share), components, axis=2)
    return found


def _set_return_times(basis: ModalBasis, friction_groups: list[LawGroup], table: Array) -> None:
    """Make the return times of elastic Coulomb elements short for the body that they hold.

    Harmonic balance and equilibria return elements to their limits within this time.
    """
    for nodes, share, law in friction_groups:
        sliders = law.sliders(share) if law.memory else None
        if sliders is not None:
            rows = basis.contact_T[nodes, : basis.dimension]
            held = sliders[0].sum(axis=1) @ (rows**2).sum(axis=(1, 2))
            square = np.linalg.norm(basis.stiffness_matrix, 2) + held
            table[nodes, 0] = _RETURN_PART / np.sqrt(square) if square > 0.0 else _RETURN_PART


def require_laws(
    owner: str, what: str, kind: type, given: Any, group: str, names: Sequence[str]
) -> None:
    """Raise InputError unless this is a law of a kind, or a mapping with one for each of the names.

    The names are those of groups of contact nodes, of a kind such as 'interface'.
    """
    if isinstance(given, Mapping):
        for name in given:
            if name not in names:
                raise InputError(f"{owner}: {what} has a law for the {group} {name!r}"
                                 f"{nearest(str(name), names)}, but the {group}s are: "
                                 f"{choices(names)}.")
        missing = [name for name in names if name not in given]
        if missing:
            raise InputError(f"{owner}: {what} lacks a law for the {group}"
                             f"{'s' * (len(missing) > 1)} {choices(missing)}.")
    for law in given.values() if isinstance(given, Mapping) else (given,):
        if not isinstance(law, kind):
            raise InputError(f"{owner}: {what} = {law!r} must be a {kind.__name__}.")


def groups_of_laws(groups: Iterable[tuple[int, Any]], tributary: Array) -> Iterator[LawGroup]:
    """Nodes, their shares of the face and law of groups of contact nodes, (count, law) each.

    ``tributary`` (n,) are the parts of the face that belong to the nodes.
    """
    first = 0
    for count, law in groups:
        nodes = slice(first, first + count)
        yield nodes, tributary[nodes] / tributary[nodes].sum(), law
        first += count


def law_table(law_groups: Iterable[LawGroup]) -> tuple[Integers, Array]:
    """Addresses (n,) and parameters (n, k) of the laws of all nodes."""
    groups = [(law, law.table(share)) for _, share, law in law_groups]
    nodes = sum(len(table) for _, table in groups)
    addresses = np.empty(nodes, dtype=np.int64)
    tables = np.zeros((nodes, max(table.shape[1] for _, table in groups)))
    first = 0
    for law, table in groups:
        last = first + len(table)
        addresses[first:last], tables[first:last, : table.shape[1]] = law.kernel.address, table
        first = last
    return addresses, tables


def _rows(parameters: list[Array]) -> Array:
    """Parameters of several functions as one array, padded with zeros."""
    table = np.zeros((len(parameters), max((len(row) for row in parameters), default=1)))
    for index, row in enumerate(parameters):
        table[index, : len(row)] = row
    return table


def _addresses(kernels: Iterable[CompiledLaw]) -> Integers:
    return np.array([kernel.address for kernel in kernels], dtype=np.int64)
