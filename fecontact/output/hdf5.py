"""HDF5 files: written whole or not at all, and the modal basis inside them."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.arguments import as_path
from fecontact.basis import ModalBasis
from fecontact.errors import InputError
from fecontact.field import Field, Quality

_PLAIN = ("angular_frequencies", "damping", "T", "positions", "tributary")
_FIELD = ("nodes", "cells", "outline", "shapes", "stress")


@contextmanager
def new_file(path: str | Path) -> Iterator[Any]:
    """A new HDF5 file, open for writing as ``NAME.part`` and renamed when the block ends well.

    Raises
    ------
    InputError
        If the folder does not exist or cannot be written.
    """
    import h5py

    path = Path(path)
    part = path.with_name(path.name + ".part")
    try:
        file = h5py.File(part, "w")
    except OSError as error:
        raise InputError(f"{path} cannot be written ({_reason(path, error)}); "
                         f"choose a folder that exists and is writable.") from None
    try:
        with file:
            yield file
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


@contextmanager
def open_file(path: str | Path, group: str) -> Iterator[Any]:
    """An HDF5 file, open for reading, that must hold ``group``.

    Raises
    ------
    InputError
        If there is no such file, it is not HDF5, or it has no such group.
    """
    import h5py

    path = as_path(path, "a file of results")
    if not path.is_file():
        raise InputError(f"{path} does not exist.")
    try:
        file = h5py.File(path, "r")
    except OSError:
        raise InputError(f"{path} is not an HDF5 file, or is damaged.") from None
    with file:
        if group not in file:
            raise InputError(f"{path} was not written by fecontact: it has no group '{group}'.")
        yield file


def write_basis(group: Any, basis: ModalBasis) -> None:
    """Write a basis into an HDF5 group."""
    for name in _PLAIN:
        group.create_dataset(name, data=getattr(basis, name))
    group.attrs["extra"] = list(basis.extra)
    group.attrs["groups"] = [name for name, _ in basis.groups]
    group.attrs["group_sizes"] = [count for _, count in basis.groups]
    if basis.quality is not None:
        quality = group.create_group("quality")
        for name, value in vars(basis.quality).items():
            quality.create_dataset(name, data=value)
    if basis.field is None:
        return
    field = group.create_group("field")
    for name in _FIELD:
        field.create_dataset(name, data=getattr(basis.field, name))
    restriction = basis.field.restriction.tocsr()
    for name in ("data", "indices", "indptr"):
        field.create_dataset(f"restriction/{name}", data=getattr(restriction, name))
    field["restriction"].attrs["shape"] = restriction.shape


def read_basis(group: Any) -> ModalBasis:
    """Read a basis from an HDF5 group that :func:`write_basis` filled."""
    import scipy.sparse as sp

    field = None
    if "field" in group:
        stored = group["field"]
        matrix = stored["restriction"]
        field = Field(
            **{name: stored[name][()] for name in _FIELD},
            restriction=sp.csr_array(
                tuple(matrix[name][()] for name in ("data", "indices", "indptr")),
                shape=tuple(int(k) for k in matrix.attrs["shape"]),
            ),
        )
    quality = None
    if "quality" in group:
        stored = {name: item[()] for name, item in group["quality"].items()}
        quality = Quality(**stored | {"mass": float(stored["mass"]),
                                      "vibration_modes": int(stored["vibration_modes"]),
                                      "orthogonality": float(stored["orthogonality"])})
    extra = tuple(str(name) for name in np.atleast_1d(group.attrs["extra"]))
    groups = tuple((str(name), int(count)) for name, count in zip(
        group.attrs["groups"], group.attrs["group_sizes"], strict=True))
    return ModalBasis(**{name: group[name][()] for name in _PLAIN}, extra=extra, field=field,
                      quality=quality, groups=groups)


def _reason(path: Path, error: OSError) -> str:
    if not path.parent.is_dir():
        return f"folder {path.parent} does not exist"
    if not os.access(path.parent, os.W_OK):
        return f"folder {path.parent} is not writable"
    return os.strerror(error.errno) if error.errno else "the file may be open elsewhere"
