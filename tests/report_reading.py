"""Content of a report, read from its file."""

import gzip
import json
import re
import struct

import numpy as np

FIRST = 35  # code of the first of 91 letters


def from_text(text):
    """The bytes of :func:`as_text`, and zeros."""
    codes = np.frombuffer(text.encode("ascii"), np.uint8).astype(np.int64)
    codes[codes == ord("!")] = ord("<")
    first, second = (codes - FIRST).reshape(-1, 2).T
    pairs = (91 * first + second).astype(">u2").view(np.uint8)
    return np.packbits(np.unpackbits(pairs).reshape(-1, 16)[:, 3:]).tobytes()


def unpacked(block):
    """Header and bytes of the arrays of a block, first and later ones."""
    first, later = struct.unpack_from("<II", block)
    content = gzip.decompress(block[8 : 8 + first])
    (length,) = struct.unpack_from("<I", content)
    return (json.loads(content[4 : 4 + length]),
            (content[4 + length :], gzip.decompress(block[8 + first : 8 + first + later])))


def stored_array(described, contents):
    """The array that a header describes."""
    shape = tuple(described["shape"])
    rows, columns = shape[0], int(np.prod(shape[1:], dtype=int))
    if not rows * columns:
        return np.zeros(shape)
    content = contents[described.get("later", 0)]
    planes = np.frombuffer(content, np.uint8, described["planes"] * rows * columns,
                           described["at"]).reshape(described["planes"], columns, rows)
    zigzag = sum(plane.astype(np.int64) << 8 * k for k, plane in enumerate(planes))
    whole = np.asarray((zigzag >> 1) ^ -(zigzag & 1))
    for _ in range(1 + described.get("order", 0)):
        whole = np.cumsum(whole, axis=1)
    for column, other in enumerate(described.get("near", ())):
        whole[column] += whole[other] if other >= 0 else 0
    return (whole.T * np.asarray(described["step"])).reshape(shape)


class Shown:
    """The data of a page: its header, and its arrays by what the header says of them."""

    def __init__(self, path):
        self.text = path.read_text(encoding="utf-8")
        block = re.search(r'id="payload">([!#-;=-}]+)</script>', self.text).group(1)
        self.header, self._content = unpacked(from_text(block))

    def array(self, *names):
        found = self.header
        for name in names:
            found = found[name]
        return stored_array(found, self._content)

    @property
    def displacement(self):
        """(N, P, d) of the nodes at all times."""
        shapes = self.array("bodies", "shapes")
        return np.einsum("pcm,tm->tpc", shapes, self.array("coordinates")[:, : shapes.shape[2]])

    @property
    def stress(self):
        """(N, P) von Mises stress of plane bodies."""
        names = self.header["bodies"]["components"]
        parts = dict.fromkeys(("xx", "yy", "zz", "xy"), 0.0) | dict(zip(names, np.moveaxis(
            np.einsum("pcm,tm->tpc", self.array("bodies", "stress"), self.array("coordinates")),
            2, 0), strict=True))
        xx, yy, zz, xy = parts.values()
        return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * xy**2)

    @property
    def forces(self):
        """(N, n, d) on the contact nodes along x, y (and z)."""
        return np.einsum("tni,nik->tnk", self.array("contact", "forces"),
                         self.array("contact", "axes"))
