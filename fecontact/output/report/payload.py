"""The data of a page: one header and many arrays in one compressed block.

Arrays are whole numbers times a step, so that their error is known beforehand. Differences from row
to row, bytes of equal weight together and gzip bring smooth histories to a fraction of their size.
"""

import base64
import gzip
import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array

SMALLEST = 1e-200  # step of what is zero everywhere

_LARGEST = 2.0**31 - 1.0


@dataclass
class Payload:
    """Arrays of a page, collected one after the other.

    The block is ``gzip(length of the header, header as JSON, bytes of the arrays)``. The header is
    any JSON with, in the place of arrays, what :meth:`add` returned.
    """

    _parts: list[bytes] = field(default_factory=list)
    _size: int = 0

    def add(self, values: Any, step: Any = 1.0) -> dict[str, Any]:
        """Add an array (N, ...) of numbers, to within half a step; returns its description.

        Parameters
        ----------
        values : (N, ...) array
            Finite numbers; whole ones for a step of one.
        step : float or array
            One step, or one of each of the columns ``values.reshape(N, -1)``; positive.
        """
        given = np.asarray(values, dtype=np.float64)
        table = given.reshape(len(given), -1) if given.size else np.zeros((len(given), 0))
        steps = np.broadcast_to(np.asarray(step, dtype=np.float64).reshape(-1), table.shape[1:])
        # Numbers beyond 32 bits would need steps below their rounding errors.
        steps = np.maximum(steps, np.abs(table).max(axis=0, initial=0.0) / _LARGEST)
        whole = np.rint(table / steps).astype(np.int64).T
        change = np.diff(whole, axis=1, prepend=0)
        # Small changes of either sign become small numbers.
        zigzag = ((change << 1) ^ (change >> 63)).astype(np.uint64)
        planes = max(1, (int(zigzag.max(initial=0)).bit_length() + 7) // 8)
        for plane in range(planes):
            self._append(((zigzag >> np.uint64(8 * plane)) & np.uint64(255)).astype(np.uint8))
        same = len(steps) and (steps == steps[0]).all()
        return {"at": self._size - planes * zigzag.size, "planes": planes,
                "shape": list(given.shape), "step": steps[:1].tolist() if same
                else steps.tolist()}

    def block(self, header: Mapping[str, Any]) -> str:
        """The block in base64."""
        text = json.dumps(header, ensure_ascii=True, allow_nan=False).encode()
        content = b"".join([struct.pack("<I", len(text)), text, *self._parts])
        # Without a time stamp equal contents are equal bytes.
        return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")

    def _append(self, values: NDArray[np.uint8]) -> None:
        self._parts.append(values.tobytes())
        self._size += values.size


def unpacked(block: str) -> tuple[dict[str, Any], bytes]:
    """Header and bytes of the arrays of a block."""
    content = gzip.decompress(base64.b64decode(block))
    (length,) = struct.unpack_from("<I", content)
    return json.loads(content[4 : 4 + length]), content[4 + length :]


def stored_array(described: Mapping[str, Any], content: bytes) -> Array:
    """The array that a header describes."""
    shape = tuple(described["shape"])
    rows, columns = shape[0], int(np.prod(shape[1:], dtype=int))
    if not rows * columns:
        return np.zeros(shape)
    planes = np.frombuffer(content, np.uint8, described["planes"] * rows * columns,
                           described["at"]).reshape(described["planes"], columns, rows)
    zigzag = sum(plane.astype(np.int64) << 8 * k for k, plane in enumerate(planes))
    change = (zigzag >> 1) ^ -(zigzag & 1)
    return (np.cumsum(change, axis=1).T * np.asarray(described["step"])).reshape(shape)
