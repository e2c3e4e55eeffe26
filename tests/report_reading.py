"""Content of a report, read from its file."""

import re

import numpy as np

from fecontact.output.report.payload import from_text, stored_array, unpacked


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
