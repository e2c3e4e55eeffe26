"""``[geometry]`` of a study file: a shape and its dimensions, or the file of a mesh."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from fecontact.core.errors import InputError, choices, nearest, require_positive
from fecontact.core.tables import convert_fields, from_table, located, shown, to_table
from fecontact.core.types import Coordinates
from fecontact.fem.mesh import Mesh
from fecontact.fem.mesh_files.groups import Box
from fecontact.fem.pretension import PretensionSection, with_pretension
from fecontact.fem.shapes import Beam, Block, Pendulum
from fecontact.fem.solids.shapes import (
    Cylinder,
    LapStrip,
    Plate,
    Ring,
    SolidBlock,
    SolidShape,
    SphereSegment,
)

SHAPES: Mapping[str, type] = {
    "beam": Beam, "pendulum": Pendulum, "block": Block, "solid-block": SolidBlock, "plate": Plate,
    "ring": Ring, "cylinder": Cylinder, "sphere-segment": SphereSegment, "lap-strip": LapStrip,
}


@dataclass(frozen=True)
class MeshFile:
    """``[geometry]`` with the file of a mesh; see :func:`fecontact.read_mesh`.

    Parameters
    ----------
    file : str
        The mesh, relative to the study file.
    scale : float
        Factor from the file's unit of length to m.
    boundaries : mapping of name to name or box
        Boundaries to name: a group of the file, or the outline within [x0, y0, x1, y1], of solids
        [x0, y0, z0, x1, y1, z1] [m].
    points : mapping of name to name or place
        Points to name: a group of the file, or the node nearest to [x, y], of solids [x, y, z] [m].
    part : str, optional
        Body to take if the file has several: name of a group of cells.
    pretension : mapping of name to table
        ``[geometry.pretension.NAME]``: sections of bolts. NAME is the control point; a force on it
        along x is the tension of the bolt.
    """

    file: str
    scale: float = 1.0
    boundaries: Mapping[str, str | Box] = field(default_factory=dict)
    points: Mapping[str, str | Coordinates] = field(default_factory=dict)

    part: str | None = None
    pretension: Mapping[str, PretensionSection] = field(default_factory=dict)

    def __post_init__(self) -> None:
        convert_fields(self)
        require_positive("MeshFile", scale=self.scale)

    def mesh(self, folder: Path) -> Mesh:
        """Read the mesh; ``folder`` is that of the study file."""
        from fecontact.fem.mesh_files import read_mesh

        mesh = read_mesh(folder / self.file, scale=self.scale,
                         boundaries=self.boundaries or None, points=self.points or None,
                         part=self.part)
        for name, section in self.pretension.items():
            mesh = with_pretension(mesh, name, section)
        return mesh


Geometry = Beam | Pendulum | Block | SolidShape | MeshFile


def geometry_from_table(table: Any, where: str) -> Geometry:
    """Geometry described by ``[geometry]``; raises as :func:`~fecontact.core.tables.from_table`."""
    if not isinstance(table, Mapping) or ("shape" in table) == ("file" in table):
        raise InputError(f"{where} must have either a shape ({choices(SHAPES)}) or the file of a "
                         f"mesh.")
    if "file" in table:
        return from_table(MeshFile, table, where)
    shape = table["shape"]
    if not isinstance(shape, str) or shape not in SHAPES:
        raise InputError(f"{where}: shape = {shown(shape)} must be one of {choices(SHAPES)}"
                         f"{nearest(str(shape), SHAPES)}.")
    dimensions = {key: value for key, value in table.items() if key != "shape"}
    return cast(Geometry, from_table(SHAPES[shape], dimensions, where))


def geometry_mesh(geometry: Geometry, folder: Path, where: str) -> Mesh:
    """The mesh of a geometry; ``folder`` is that of the study file, ``where`` begins messages."""
    from fecontact.fem.generate import generate

    with located(where, type(geometry).__name__):
        if isinstance(geometry, MeshFile):
            return geometry.mesh(folder)
        return generate(geometry)


def geometry_table(geometry: Geometry, *, defaults: bool = True) -> dict[str, Any]:
    """Table of a geometry; the inverse of :func:`geometry_from_table`."""
    shape = {kind: name for name, kind in SHAPES.items()}.get(type(geometry))
    table = to_table(geometry, defaults=defaults)
    return table if shape is None else {"shape": shape, **table}


def body_table(body: Any, geometry: Geometry, *, defaults: bool = True) -> dict[str, Any]:
    """Table of a ``[body]``, without defaults of plane bodies where the shape is a solid."""
    table = to_table(body, defaults=defaults)
    if isinstance(geometry, SolidShape):
        needed = to_table(body, defaults=False)
        return {key: value for key, value in table.items()
                if key in needed or key not in ("thickness", "plane")}
    return table
