"""The data of a page: one header and many arrays in two compressed parts.

Arrays are whole numbers times a step, so that their error is known beforehand. Differences from row
to row, bytes of equal weight together and gzip bring smooth histories to a fraction of their size.
The first picture needs the first part alone; long histories of contact wait in the second one.
"""

import gzip
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

SMALLEST = 1e-200  # step of what is zero everywhere

_LARGEST = 2.0**31 - 1.0
_FIRST = 35  # code of the first of 91 letters
_LEVEL = 6  # of gzip; 9 takes three times as long for one byte in a thousand


@dataclass
class Payload:
    """Arrays of a page, collected one after the other.

    The block is the lengths of its two parts, ``gzip(length of the header, header as JSON, bytes of
    arrays)``, and ``gzip(bytes of later arrays)``. The header is any JSON with, in the place of
    arrays, what :meth:`add` returned.
    """

    _parts: tuple[list[bytes], list[bytes]] = field(default_factory=lambda: ([], []))
    _sizes: list[int] = field(default_factory=lambda: [0, 0])

    def add(
        self, values: Any, step: Any = 1.0, later: bool = False, near: Sequence[int] = ()
    ) -> dict[str, Any]:
        """Add an array (N, ...) of numbers, to within half a step; returns its description.

        Parameters
        ----------
        values : (N, ...) array
            Finite numbers; whole ones for a step of one.
        step : float or array
            One step, or one of each of the columns ``values.reshape(N, -1)``; positive.
        later : bool
            True if the array is read after the first picture.
        near : sequence of int
            For each column an earlier one that is alike, or -1; empty if none are.
        """
        given = np.asarray(values, dtype=np.float64)
        table = given.reshape(len(given), -1) if given.size else np.zeros((len(given), 0))
        steps = np.broadcast_to(np.asarray(step, dtype=np.float64).reshape(-1), table.shape[1:])
        # Numbers beyond 32 bits would need steps below their rounding errors.
        steps = np.maximum(steps, np.abs(table).max(axis=0, initial=0.0) / _LARGEST)
        whole = np.rint(table / steps).astype(np.int64).T
        change, order = _residues(whole)
        if len(near):
            alike = np.asarray(near)[:, None]
            beside = _residues(whole - np.where(alike < 0, 0, whole[alike[:, 0]]))
            if _bits(beside[0]) < _bits(change):
                change, order = beside
            else:
                near = ()
        # Small changes of either sign become small numbers.
        zigzag = ((change << 1) ^ (change >> 63)).astype(np.uint64)
        planes = max(1, (int(zigzag.max(initial=0)).bit_length() + 7) // 8)
        at = self._sizes[later]
        for plane in range(planes):
            content = ((zigzag >> np.uint64(8 * plane)) & np.uint64(255)).astype(np.uint8)
            self._parts[later].append(content.tobytes())
            self._sizes[later] += content.size
        same = len(steps) and (steps == steps[0]).all()
        found = {"at": at, "planes": planes, "shape": list(given.shape),
                 "step": steps[:1].tolist() if same else steps.tolist()}
        return found | {name: value for name, value in (
            ("order", order - 1), ("later", int(later)), ("near", list(map(int, near)))) if value}

    def block(self, header: Mapping[str, Any]) -> bytes:
        """All data of the page."""
        text = json.dumps(header, ensure_ascii=True, allow_nan=False,
                          separators=(",", ":")).encode()
        # Without a time stamp equal contents are equal bytes.
        first, later = (gzip.compress(b"".join(parts), _LEVEL, mtime=0) for parts in (
            [struct.pack("<I", len(text)), text, *self._parts[0]], self._parts[1]))
        return struct.pack("<II", len(first), len(later)) + first + later


def _residues(whole: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """Differences along the rows of (c, N), or differences of these where they are smaller."""
    change = np.diff(whole, axis=1, prepend=0)
    if whole.shape[1] < 8:
        return change, 1
    second = np.diff(change, axis=1, prepend=0)
    return (second, 2) if _bits(second) < _bits(change) else (change, 1)


def _bits(change: NDArray[np.int64]) -> float:
    """About how many bits differences take."""
    return float(np.log2(1.0 + np.abs(change[:, 2:])).sum())


def as_text(block: bytes) -> str:
    """Bytes as letters that a script of a page may hold, 13 bits in two of 91.

    A tenth shorter than in base64; zeros are added at the end.
    """
    bits = np.unpackbits(np.frombuffer(block, np.uint8))
    groups = np.pad(bits, (0, -len(bits) % 13)).reshape(-1, 13)
    pairs = np.packbits(np.pad(groups, ((0, 0), (3, 0)))).view(">u2")
    codes = np.stack(np.divmod(pairs.astype(np.int64), 91), axis=1).astype(np.uint8) + _FIRST
    codes[codes == ord("<")] = ord("!")
    return codes.tobytes().decode("ascii")
