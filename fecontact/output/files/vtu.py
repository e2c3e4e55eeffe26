"""VTU files: fields at the nodes and cells of bodies, with named components, for ParaView."""

import zlib
from base64 import b64encode
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from fecontact.core.types import Array, Integers
from fecontact.output.files.vtk_cells import cells_of_vtk

_BLOCK = 2**15  # bytes that are compressed together
_TYPES = {"f4": "Float32", "f8": "Float64", "i1": "Int8", "u1": "UInt8", "i4": "Int32",
          "i8": "Int64"}


class VtuField(NamedTuple):
    """Values (N,) or (N, k) of points or cells, and the names of their components."""

    name: str
    of: str  # Point or Cell
    values: NDArray[Any]
    components: tuple[str, ...] = ()


def write_vtu(
    part: Path, nodes: Array, cells: Integers, fields: Iterable[VtuField],
    time: float | None = None,
) -> None:
    """Write fields on cells as a compressed VTU file, with the time it shows [s].

    The cells are those of :func:`~fecontact.output.files.vtk_cells.written_cells`.
    """
    points = np.zeros((len(nodes), 3))
    points[:, : nodes.shape[1]] = nodes
    connectivity, offsets, types = cells_of_vtk(cells, nodes.shape[1])
    data: dict[str, list[str]] = {"Point": [], "Cell": []}
    for one in fields:
        data[one.of].append(_array(one.name, one.values, one.components))
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64" compressor="vtkZLibDataCompressor">',
        "<UnstructuredGrid>",
        *([] if time is None else ["<FieldData>", _array("TimeValue", np.array([time]), (), True),
                                   "</FieldData>"]),
        f'<Piece NumberOfPoints="{len(nodes)}" NumberOfCells="{len(cells)}">',
        "<Points>", _array("Points", points, ("x", "y", "z")), "</Points>",
        "<Cells>", _array("connectivity", connectivity), _array("offsets", offsets[1:]),
        _array("types", types), "</Cells>",
        "<PointData>", *data["Point"], "</PointData>", "<CellData>", *data["Cell"], "</CellData>",
        "</Piece>", "</UnstructuredGrid>", "</VTKFile>", ""]
    part.write_text("\n".join(lines), encoding="ascii", newline="\n")


def _array(
    name: str, values: NDArray[Any], components: tuple[str, ...] = (), whole: bool = False
) -> str:
    """An array as an element of XML; ``whole`` for one that is not of points or cells."""
    values = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    tuples = f' NumberOfTuples="{len(values)}"' if whole else ""
    width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    named = "".join(f" ComponentName{k}={quoteattr(one)}" for k, one in enumerate(components))
    kind = _TYPES[values.dtype.str[1:]]
    return (f'<DataArray type="{kind}" Name={quoteattr(name)}{tuples}{width}{named} '
            f'format="binary">\n{_encoded(values)}\n</DataArray>')


def _encoded(values: NDArray[Any]) -> str:
    """Blocks compressed by zlib, behind their number and sizes, all in base 64."""
    content = values.tobytes()
    blocks = [zlib.compress(content[first : first + _BLOCK])
              for first in range(0, len(content), _BLOCK)]
    header = np.array([len(blocks), _BLOCK, len(content) % _BLOCK, *map(len, blocks)], "<u8")
    return (b64encode(header.tobytes()) + b64encode(b"".join(blocks))).decode("ascii")
