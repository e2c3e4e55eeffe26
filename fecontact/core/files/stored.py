"""Checked reading of arrays and attributes from HDF5 files.

Files may be damaged, or come from other versions. Shapes, types and sizes are checked before
anything is allocated or passed to compiled code, which does not check them.
"""

import io
import json
import math
import zipfile
from collections.abc import Iterator, Sized
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError

T = TypeVar("T")
Shape = tuple[int | None, ...]

DENSEST = 1100  # upper bound of the compression ratio of deflate
LARGEST = 20_000_000  # rows and columns of a sparse matrix
_KINDS = {"f": ("fiu", np.float64), "i": ("iu", np.int64)}


class DamagedError(ValueError):
    """The stored data is invalid; :func:`reading` adds the name of the file."""


@contextmanager
def reading(path: str | Path, what: str = "damaged or of another version of fecontact"
            ) -> Iterator[None]:
    """Turn the errors of readers of damaged files into one sentence that names the file.

    Raises
    ------
    InputError
        For every error except MemoryError.
    """
    try:
        yield
    except MemoryError:
        raise
    except InputError as error:
        if str(error).startswith(str(path)):
            raise
        raise InputError(f"{path} is {what} ({str(error).rstrip('.')}).") from None
    except Exception as error:  # damaged files make libraries raise anything
        detail = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        if isinstance(error, KeyError):
            detail = f"it lacks {detail}"
        if isinstance(error, RecursionError):
            detail = "it is nested too deeply"
        raise InputError(f"{path} is {what} ({detail[:300]}).") from None


def member(group: Any, name: str) -> Any:
    """A dataset or group of an HDF5 group, in the same file.

    Raises
    ------
    DamagedError
        If there is none, or it lies in another file.
    """
    import h5py

    place = group
    for part in name.split("/"):
        if not isinstance(place, h5py.Group) or place.get(part, getlink=True) is None:
            raise DamagedError(f"it lacks '{group.name.rstrip('/')}/{name}'")
        if isinstance(place.get(part, getlink=True), h5py.ExternalLink):
            raise DamagedError(f"'{name}' lies in another file")
        place = place[part]
    return place


def array(group: Any, name: str, shape: Shape, kind: str = "f") -> NDArray[Any]:
    """A dataset of an HDF5 group as an array of floats ('f') or of 64-bit integers ('i').

    ``shape`` holds None where a length may be any.

    Raises
    ------
    DamagedError
        If there is none, or it has another shape or type, or the file does not hold its values.
    """
    data = member(group, name)
    accepted, dtype = _KINDS[kind]
    found = getattr(data, "shape", None)
    if found is None or len(found) != len(shape) or any(
            wanted not in (None, length) for wanted, length in zip(shape, found, strict=True)):
        listed = ", ".join("any" if length is None else str(length) for length in shape)
        raise DamagedError(f"'{data.name}' has shape {found}, not ({listed})")
    if data.dtype.kind not in accepted:
        raise DamagedError(f"'{data.name}' is of type {data.dtype}")
    return np.asarray(values(data), dtype=dtype)


def bounded(group: Any, name: str, shape: Shape, largest: float = 1e60) -> NDArray[np.float64]:
    """Floats of a dataset, as :func:`array`; DamagedError for NaN and values beyond ``largest``."""
    found = array(group, name, shape)
    if not (np.abs(found) <= largest).all():
        raise DamagedError(f"'{member(group, name).name}' holds values that are not finite or "
                           f"beyond {largest:g}")
    return found


def indices(group: Any, name: str, shape: Shape, end: int) -> NDArray[np.int64]:
    """Array of integers from 0 to below ``end``, read by :func:`array`."""
    found = array(group, name, shape, "i")
    _require_within(found, 0, end)
    return found


def values(data: Any) -> Any:
    """Values of an HDF5 dataset.

    Raises
    ------
    DamagedError
        If it is not a dataset, or the file does not hold all of its values.
    """
    import h5py

    if not isinstance(data, h5py.Dataset) or data.shape is None:
        raise DamagedError(f"'{data.name}' is no dataset")
    if data.external or data.is_virtual:
        raise DamagedError(f"the values of '{data.name}' lie in another file")
    needed = math.prod(data.shape) * data.dtype.itemsize
    filtered = data.id.get_create_plist().get_nfilters() > 0
    if needed > data.id.get_storage_size() * (DENSEST if filtered else 1):
        raise DamagedError(f"'{data.name}' declares {needed:.3g} bytes, more than the file holds")
    return data[()]


def texts(group: Any, name: str, count: int | None = None) -> list[str]:
    """The strings of a dataset (k,)."""
    data = member(group, name)
    found = values(data)
    if getattr(found, "ndim", 0) != 1 or (count is not None and len(found) != count) or not all(
            isinstance(item, bytes | str) for item in found.tolist()):
        raise DamagedError(f"'{data.name}' is no list of texts, one for each of the others")
    return [item.decode() if isinstance(item, bytes) else item for item in found.tolist()]


def text(group: Any, name: str) -> str:
    """A string attribute of an HDF5 group."""
    found = group.attrs[name]
    if not isinstance(found, str):
        raise DamagedError(f"the attribute '{name}' of '{group.name}' is no text")
    return found


def from_json(content: str, kind: type[T], what: str) -> T:
    """Value of a JSON text, checked to be of a type."""
    found = json.loads(content)
    if not isinstance(found, kind):
        raise DamagedError(f"{what} is {type(found).__name__}, not {kind.__name__}")
    return found


def sound_sparse(matrix: Any) -> Any:
    """Check the indices of a sparse matrix, which scipy's kernels do not.

    Raises
    ------
    DamagedError
        If they lie outside its shape, or it is too large.
    """
    if max(matrix.shape) > LARGEST:
        raise DamagedError(f"a matrix of shape {matrix.shape} is larger than {LARGEST} rows or "
                           f"columns")
    rows, columns = matrix.shape
    if matrix.format in ("csr", "csc", "bsr"):
        matrix.check_format(full_check=True)
    elif matrix.format == "coo":
        _require_within(matrix.row, 0, rows)
        _require_within(matrix.col, 0, columns)
    elif matrix.format == "dia":
        _require_within(matrix.offsets, 1 - rows, columns)
    return matrix


def _require_within(numbers: NDArray[Any], first: int, end: int) -> None:
    if numbers.size and (numbers.min() < first or numbers.max() >= end):
        raise DamagedError(f"indices from {numbers.min()} to {numbers.max()} lie outside of "
                           f"{first} to {end - 1}")


def npz_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """All arrays of a .npz file, by name.

    Raises
    ------
    DamagedError
        For one that is cut off, or that holds objects.
    """
    found = {}
    whole = path.stat().st_size
    with zipfile.ZipFile(path) as archive:
        for entry in archive.infolist():
            if entry.file_size > DENSEST * max(min(entry.compress_size, whole), 1):
                raise DamagedError(f"'{entry.filename}' is larger than the file can hold")
            with archive.open(entry) as stream:
                found[entry.filename.removesuffix(".npy")] = npy_array(stream, entry.file_size)
    return found


def npy_array(stream: Any, size: int) -> NDArray[Any]:
    """The array of a .npy stream of ``size`` bytes; DamagedError as :func:`npz_arrays`."""
    version = np.lib.format.read_magic(stream)
    readers = {(1, 0): np.lib.format.read_array_header_1_0,
               (2, 0): np.lib.format.read_array_header_2_0}
    if version not in readers:
        raise DamagedError(f"an array is stored in version {version} of the format")
    shape, by_columns, dtype = readers[version](stream)
    needed = math.prod(shape) * dtype.itemsize
    if dtype.hasobject or not all(length >= 0 for length in shape) or needed > size:
        raise DamagedError(f"an array of shape {shape} and type {dtype} is not held by the file")
    content = io.BytesIO(stream.read(needed)).getbuffer()
    if len(content) != needed:
        raise DamagedError(f"an array of shape {shape} is cut short")
    flat = np.frombuffer(content, dtype=dtype, count=math.prod(shape)).copy()
    return flat.reshape(shape, order="F" if by_columns else "C")


def require_lengths(what: str, length: int, items: Sized) -> None:
    """Raise DamagedError unless there are ``length`` items."""
    if len(items) != length:
        raise DamagedError(f"{what} has {len(items)} values, not {length}")
