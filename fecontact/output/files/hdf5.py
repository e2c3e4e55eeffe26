"""HDF5 files: written whole or not at all, and the modal basis inside them."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_path, require_file, require_kind
from fecontact.core.errors import InputError
from fecontact.core.files.atomic_write import replaced
from fecontact.core.files.hdf5_check import append_checksum, open_hdf5
from fecontact.core.files.stored import (
    DamagedError,
    array,
    bounded,
    indices,
    member,
    reading,
    require_lengths,
    sound_sparse,
    values,
)
from fecontact.core.progress import held_back_interrupt
from fecontact.core.types import Array
from fecontact.fem.elements.cell_kinds import CELL_KINDS, widths
from fecontact.reduction.large_deflections.forces import LargeDeflectionForces
from fecontact.reduction.modal_basis import ModalBasis
from fecontact.reduction.modal_rotation import ModalRotation
from fecontact.reduction.mode_shapes import (
    BodyPart,
    ModeShapes,
    NonlinearStress,
    ReductionQuality,
)

# Higher levels of deflate take longer and gain three per cent.
COMPRESSED: dict[str, Any] = {"shuffle": True, "compression": "gzip", "compression_opts": 1}
_PLAIN = ("angular_frequencies", "damping", "T", "positions", "tributary")
_OPTIONAL = ("inertia_rows", "stiffness", "contact_normals", "on_ground", "constant_load")
_MODE_SHAPES = ("nodes", "cells", "outline", "shapes", "stress")


class _Sink(io.FileIO):
    """File object for HDF5 that never raises: it keeps the first error and drops later writes.

    After a failed write, HDF5 crashes the process when it closes the file.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self.error: OSError | None = None

    def write(self, content: Any) -> int:
        view = memoryview(content).cast("B")
        done = 0
        while self.error is None and done < len(view):
            try:
                done += super().write(view[done:])
            except OSError as error:
                self.error = error
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.error = self.error or error
            return size or 0


@contextmanager
def new_file(path: str | Path) -> Iterator[Any]:
    """Open a new HDF5 file for writing; it is moved into place if the block succeeds.

    The file ends in a checksum of its content, by which :func:`open_file` finds damage.

    Ctrl-C is deferred until then: an exception inside the library would leave a broken file open.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    import h5py

    with held_back_interrupt() as check:
        with replaced(path) as part:
            with _Sink(part) as sink:
                try:
                    with h5py.File(sink, "w") as file:
                        yield file
                except Exception:
                    if sink.error is None:
                        raise
                if sink.error is not None:
                    raise sink.error
            append_checksum(part)
        check()


# Functions that read files with such a group.
_READERS = {"branches": "read_branches", "branch": "read_branch", "wear": "read_wear",
            "run": "read_run", "trajectory": "read_case", "basis": "read_basis"}


@contextmanager
def open_file(path: str | Path, group: str) -> Iterator[Any]:
    """Open an HDF5 file for reading; it must contain ``group``.

    Raises
    ------
    InputError
        If the file does not exist, is not HDF5, or lacks the group; other errors in the block are
        converted too, see :func:`fecontact.core.files.stored.reading`.
    """
    path = as_path(path, "a file of results")
    require_file(path, "a file of results")
    if not path.is_file():
        raise InputError(f"{path} does not exist; give a file that fecontact wrote.")
    with reading(path, "not an HDF5 file, or is damaged"):
        file = open_hdf5(path)
    with reading(path), file:
        if group not in file:
            for other, reader in _READERS.items():
                if other in file:
                    raise InputError(f"{path} holds no '{group}', but '{other}'; read it with "
                                     f"{reader}.")
            raise InputError(f"{path} was not written by fecontact: it has no group '{group}'.")
        yield file


def write_basis(path: str | Path, basis: ModalBasis) -> None:
    """Write a modal basis to an HDF5 file, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    require_kind("write_basis", ModalBasis, basis=basis)
    with new_file(path) as file:
        store_basis(file.create_group("basis"), basis)


def read_basis(path: str | Path) -> ModalBasis:
    """Read a basis written by :func:`write_basis`, or that of a case, exactly.

    Raises
    ------
    InputError
        If the file does not exist, or its basis is missing or damaged.
    """
    with open_file(path, "basis") as file:
        return stored_basis(member(file, "basis"))


def store_basis(group: Any, basis: ModalBasis) -> None:
    """Write a basis into an HDF5 group."""
    for name in _PLAIN:
        group.create_dataset(name, data=getattr(basis, name))
    for name in _OPTIONAL:
        if getattr(basis, name) is not None:
            given = getattr(basis, name)
            group.create_dataset(name, data=given.astype("i1" if given.dtype == bool else float))
    if basis.parts:
        parts = group.create_dataset("parts", data=[(*part.modes, *part.nodes)
                                                    for part in basis.parts])
        parts.attrs["names"] = [part.name for part in basis.parts]
    if basis.rotation is not None:
        rotation = group.create_group("rotation")
        for name, value in vars(basis.rotation).items():
            rotation.create_dataset(name, data=value)
    for number, forces in enumerate(basis.large_deflections):
        stored = group.create_group(f"large_deflections/{number}")
        for name, value in vars(forces).items():
            if isinstance(value, np.ndarray):
                stored.create_dataset(name, data=value)
            else:
                stored.attrs[name] = value
    group.attrs["extra"] = list(basis.extra)
    if basis.boundaries:
        group.create_dataset("boundary_rows", data=basis.boundary_rows)
        group["boundary_rows"].attrs["names"] = list(basis.boundaries)
    group.attrs["groups"] = [name for name, _ in basis.groups]
    group.attrs["group_sizes"] = [count for _, count in basis.groups]
    if basis.springs:
        group.attrs["springs"] = list(basis.springs)
    if basis.first_passes:
        group.attrs["first_passes"] = [name for name, _ in basis.first_passes]
        group.attrs["first_pass_sizes"] = [count for _, count in basis.first_passes]
    if basis.thickness is not None:
        group.attrs["thickness"] = basis.thickness
    if basis.quality is not None:
        quality = group.create_group("quality")
        for name, value in vars(basis.quality).items():
            quality.create_dataset(name, data=value)
    if basis.mode_shapes is None:
        return
    shapes = group.create_group("mode_shapes")
    for name in _MODE_SHAPES:
        store_compressed(shapes, name, getattr(basis.mode_shapes, name))
    for name in ("elements", "outline_nodes", "temperature"):
        if getattr(basis.mode_shapes, name) is not None:
            store_compressed(shapes, name, getattr(basis.mode_shapes, name))
    if basis.mode_shapes.nonlinear_stress is not None:
        nonlinear = shapes.create_group("nonlinear_stress")
        for name, value in vars(basis.mode_shapes.nonlinear_stress).items():
            store_compressed(nonlinear, name, value)
    restriction = basis.mode_shapes.restriction.tocsr()
    for name in ("data", "indices", "indptr"):
        shapes.create_dataset(f"restriction/{name}", data=getattr(restriction, name))
    shapes["restriction"].attrs["shape"] = restriction.shape


def store_compressed(group: Any, name: str, values: Any) -> None:
    """Write an array, compressed without loss from 64 kB on."""
    options = COMPRESSED if values.nbytes >= 2**16 else {}
    group.create_dataset(name, data=values, **options)


def stored_basis(group: Any) -> ModalBasis:
    """Read a basis from an HDF5 group written by :func:`store_basis`.

    Raises
    ------
    DamagedError, KeyError, InputError
        If the group holds other data; see :func:`fecontact.core.files.stored.reading`.
    """
    w = array(group, "angular_frequencies", (None,))
    m = len(w)
    T = array(group, "T", (None, None, m))
    if T.shape[1] not in (3, 6):
        raise DamagedError(f"T has {T.shape[1]} rows for each point, not 3 or 6")
    d = 2 if T.shape[1] == 3 else 3
    extra = tuple(str(name) for name in np.atleast_1d(group.attrs["extra"]))
    names, sizes = (np.atleast_1d(group.attrs[name]) for name in ("groups", "group_sizes"))
    require_lengths("'group_sizes'", len(names), sizes)
    boundaries: tuple[str, ...] = ()
    tributary = array(group, "tributary", (None,))
    shapes = {"inertia_rows": (d, m), "stiffness": (m, m), "constant_load": (m,),
              "contact_normals": (len(tributary), d)}
    given: dict[str, Any] = {name: array(group, name, shape) for name, shape in shapes.items()
                             if name in group}
    if "on_ground" in group:
        given["on_ground"] = array(
            group, "on_ground", (len(tributary),), "i").astype(bool)
    if "boundary_rows" in group:
        stored = member(group, "boundary_rows")
        boundaries = tuple(str(name) for name in np.atleast_1d(stored.attrs["names"]))
        given["boundary_rows"] = array(group, "boundary_rows", (len(boundaries), d, m))
    return ModalBasis(
        w, array(group, "damping", (m, m)), T, array(group, "positions", (len(T), d)),
        tributary, extra=extra,
        mode_shapes=(_read_mode_shapes(member(group, "mode_shapes"), m, T)
                     if "mode_shapes" in group else None),
        quality=(_read_quality(member(group, "quality"), m, (len(T), d), len(boundaries))
                 if "quality" in group else None),
        groups=tuple((str(name), int(count)) for name, count in zip(names, sizes, strict=True)),
        boundaries=boundaries, parts=_read_parts(group) if "parts" in group else (), **given,
        thickness=float(group.attrs["thickness"]) if "thickness" in group.attrs else None,
        springs=tuple(str(name) for name in np.atleast_1d(group.attrs.get("springs", ()))),
        first_passes=tuple((str(name), int(count)) for name, count in zip(*(
            np.atleast_1d(group.attrs.get(key, ())) for key in (
                "first_passes", "first_pass_sizes")), strict=True)),
        rotation=_read_rotation(member(group, "rotation"), m) if "rotation" in group else None,
        large_deflections=(_read_large_deflections(member(group, "large_deflections"), m)
                           if "large_deflections" in group else ()))


def _read_large_deflections(group: Any, modes: int) -> tuple[LargeDeflectionForces, ...]:
    found = []
    for number in range(len(group)):
        one = member(group, str(number))
        coordinates = bounded(one, "coordinates", (None, modes))
        d = len(coordinates)
        pairs = indices(one, "pairs", (None, 2), d)
        numbers = {name: float(one.attrs[name]) for name in (
            "largest_displacement", "largest_strain", "force_error", "displacement_error",
            "stress_error", "other_load_error")}
        found.append(LargeDeflectionForces(
            coordinates, pairs, bounded(one, "cubic", (len(pairs), modes)),
            bounded(one, "quartic", (len(pairs), len(pairs))), bounded(one, "ranges", (d, 2)),
            states=int(one.attrs["states"]), **numbers))
    return tuple(found)


def _read_parts(group: Any) -> tuple[BodyPart, ...]:
    blocks = array(group, "parts", (None, 4), "i").tolist()
    names = np.atleast_1d(group["parts"].attrs["names"])
    require_lengths("the names of 'parts'", len(blocks), names)
    return tuple(BodyPart(str(name), (block[0], block[1]), (block[2], block[3]))
                 for name, block in zip(names, blocks, strict=True))


def _read_mode_shapes(group: Any, modes: int, T: Array) -> ModeShapes:
    import scipy.sparse as sp

    d = 2 if T.shape[1] == 3 else 3
    nodes = bounded(group, "nodes", (None, d))
    N = len(nodes)
    cells = indices(group, "cells", (None, None), N)
    _require_widths("cells", cells, "corners", [corners for of, corners in CELL_KINDS if of == d])
    stored = member(group, "restriction")
    shape = tuple(int(length) for length in np.atleast_1d(stored.attrs["shape"]))
    if shape != (T.shape[0] * T.shape[1], d * N):
        raise DamagedError(f"the restriction has shape {shape}, not "
                           f"{(T.shape[0] * T.shape[1], d * N)}")
    rows = array(stored, "indptr", (shape[0] + 1,), "i")
    columns = array(stored, "indices", (None,), "i")
    restriction = sp.csr_array((bounded(stored, "data", (len(columns),)), columns, rows),
                               shape=shape)
    outline = indices(group, "outline", (None, None), N)
    if outline.shape[1] not in ((2,) if d == 2 else (3, 4)):
        raise DamagedError(f"the outline has shape {outline.shape}")
    nodes_of = None
    if "outline_nodes" in group:
        nodes_of = array(group, "outline_nodes", (len(outline),), "i")
        if nodes_of.size and not -1 <= nodes_of.min() <= nodes_of.max() < len(T) - 2:
            raise DamagedError("'outline_nodes' names contact nodes that are not there")
    components, nonlinear = 4 if d == 2 else 6, None
    if "nonlinear_stress" in group:
        given = member(group, "nonlinear_stress")
        coordinates = bounded(given, "coordinates", (None, modes))
        powers = array(given, "powers", (None, len(coordinates)), "i")
        nonlinear = NonlinearStress(coordinates, powers, bounded(
            given, "stress", (N, components, len(powers)), 1e100))
    return ModeShapes(nodes, cells, outline, bounded(group, "shapes", (N, d, modes)),
                      bounded(group, "stress", (N, components, modes), 1e100),
                      sound_sparse(restriction), _elements(group, N, d), nodes_of, nonlinear,
                      bounded(group, "temperature", (N,)) if "temperature" in group else None)


def _elements(group: Any, nodes: int, dimension: int) -> Any:
    if "elements" not in group:
        return None
    elements = indices(group, "elements", (None, None), nodes)
    _require_widths("elements", elements, "nodes", sorted(
        number for (of, _), kind in CELL_KINDS.items() if of == dimension
        for number in kind.counts))
    return elements


def _require_widths(what: str, rows: Any, parts: str, known: list[int]) -> None:
    """Refuse rows that have another number of nodes, but for repeats of the last, than known."""
    size = widths(rows)
    if not np.isin(size, known).all():
        raise DamagedError(f"{what} have {size.max()} {parts}, not "
                           f"{', '.join(map(str, known[:-1]))} or {known[-1]}")


def _read_rotation(group: Any, modes: int) -> ModalRotation:
    speed, stressed = (values(member(group, name)).item() for name in ("speed", "stressed"))
    axis, centre = (tuple(bounded(group, name, (3,)).tolist()) for name in ("axis", "centre"))
    return ModalRotation(
        float(speed), bounded(group, "coriolis", (modes, modes)),
        bounded(group, "stiffening", (modes, modes)), bounded(group, "load", (modes,)), axis,
        centre, bool(stressed), bool(values(member(group, "standing")).item()))


def _read_quality(
    group: Any, modes: int, points: tuple[int, int], boundaries: int
) -> ReductionQuality:
    mass, count, orthogonality = (
        values(member(group, name)).item() for name in ("mass", "vibration_modes",
                                                        "orthogonality"))
    return ReductionQuality(
        mass=float(mass), vibration_modes=int(count), orthogonality=float(orthogonality),
        residuals=array(group, "residuals", (modes,)),
        compliance=array(group, "compliance", points),
        load_compliance=array(group, "load_compliance", (1 + boundaries, points[1])))
