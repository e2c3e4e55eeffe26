"""Damage of HDF5 files, found before the library reads them.

The HDF5 library may loop for ever, or crash, in a file whose structure is damaged. Files written by
fecontact end in a checksum, which is compared. Other files are first read by a process of their
own, with a limit of time.
"""

import math
import os
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

from fecontact.core.files.stored import DENSEST, DamagedError

_TITLE = b"\nfecontact crc32 "
_LENGTH = len(_TITLE) + 9  # eight hexadecimal digits and a line break
_BLOCK = 1 << 20
_PATIENCE, _RATE = 10.0, 20e6  # processor time of the check: seconds, and bytes per second
# The check of one file, without this package, so that it starts at once.
_CHECK = """
import sys
path, seconds, densest = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
import h5py
import math
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except (ImportError, ValueError, OSError):
    pass
def read(name, item):
    dict(item.attrs)
    if isinstance(item, h5py.Dataset) and not item.external and not item.is_virtual and item.shape:
        if math.prod(item.shape) * item.dtype.itemsize <= densest * item.id.get_storage_size():
            item[()]
try:
    with h5py.File(path, "r") as file:
        read("/", file)
        file.visititems(read)
except Exception:
    pass
"""


def append_checksum(path: Path) -> None:
    """Append the checksum of its content to a file; OSError if it cannot be written."""
    ending = _ending(path, path.stat().st_size)
    with path.open("ab") as file:
        file.write(ending)


def open_hdf5(path: Path) -> Any:
    """An HDF5 file of any origin, open for reading.

    Raises
    ------
    DamagedError
        If its checksum is wrong, or reading it does not end.
    OSError
        If it cannot be opened, or is not HDF5.
    """
    import h5py

    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(size - _LENGTH, 0))
        found = file.read()
    if not found.startswith(_TITLE):
        _require_readable(path, size)
    elif found != _ending(path, size - _LENGTH):
        raise DamagedError("its content does not fit the checksum written with it; take another "
                           "copy, or compute it again")
    return h5py.File(path, "r")


def _ending(path: Path, size: int) -> bytes:
    """The checksum of the first ``size`` bytes of a file, as the end of this file."""
    checksum = 0
    with path.open("rb") as file:
        while size > 0 and (block := file.read(min(_BLOCK, size))):
            checksum = zlib.crc32(block, checksum)
            size -= len(block)
    return _TITLE + b"%08x\n" % checksum


def _require_readable(path: Path, size: int) -> None:
    """Raise DamagedError if another process does not come to the end of reading the file."""
    seconds = math.ceil(_PATIENCE + size / _RATE)
    try:
        code = subprocess.run(
            [sys.executable, "-c", _CHECK, os.path.abspath(path), str(seconds), str(DENSEST)],
            capture_output=True, stdin=subprocess.DEVNULL, check=False, timeout=20.0 * seconds,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}).returncode
    except subprocess.TimeoutExpired:
        code = -1
    except OSError:  # no processes to be had
        return
    if code < 0:
        raise DamagedError("the HDF5 library fails to read it to its end; take another copy, or "
                           "compute it again")
