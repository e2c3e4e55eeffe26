"""Reading and writing of mesh files, and of fields on a mesh for ParaView."""

import contextlib
import io
import math
import re
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.core.checks import as_path, require_kind, require_regular_file
from fecontact.core.errors import (
    InputError,
    MeshError,
    MissingLibraryError,
    ModelWarning,
    choices,
)
from fecontact.core.files.atomic_write import replaced
from fecontact.core.resources.memory import available_memory, shown_memory
from fecontact.core.types import Array, Coordinates, Integers
from fecontact.fem.attachments import counted_attachments
from fecontact.fem.constraints import counted
from fecontact.fem.mesh import Mesh
from fecontact.fem.mesh_files.abaqus import read_inp
from fecontact.fem.mesh_files.ansys import read_cdb
from fecontact.fem.mesh_files.gmsh import read_msh, write_msh
from fecontact.fem.mesh_files.groups import Box, named_boundaries, named_constraints, named_points
from fecontact.fem.mesh_files.med import read_med
from fecontact.fem.mesh_files.nastran import read_nastran
from fecontact.fem.mesh_files.raw import RawMesh, body_mesh
from fecontact.fem.pretension import cut_along

_BYTES_OF_A_GRID_POINT = 200.0  # coordinates and a cell of eight nodes, with copies


def read_mesh(
    path: str | Path,
    *,
    scale: float = 1.0,
    boundaries: Mapping[str, str | Box] | None = None,
    points: Mapping[str, str | Coordinates] | None = None,
    part: str | None = None,
) -> Mesh:
    """Read the mesh of a plane body or of a solid, with named boundaries and points, from a file.

    Formats: Gmsh (.msh 2.2 and 4.1), Abaqus (.inp), Ansys (.cdb, by mapdl-archive), Nastran (.bdf,
    .nas, .fem), MED (.med), VTK (.vtk, .vtu). Files with tetrahedra, hexahedra, wedges or pyramids
    hold solids. Meshes may have elements of several kinds. Boundaries are groups of lines, of
    solids those of surfaces: physical groups (Gmsh), surfaces, element sets and node sets on the
    outline (Abaqus, MED), components of nodes on it (Ansys), elements by property number (Nastran).
    Points are physical points, node sets, groups inside the body, and lines of
    solids. VTK files have no groups. Curved sides of second-order elements are kept, coincident
    nodes merged, nodes without a cell left out. Ties, couplings, equations and sections of bolts of
    Abaqus files, RBE2, RBE3 and MPC of Nastran's become ``mesh.constraints``, whose nodes are not
    merged; masses, springs and dashpots become ``mesh.attachments``. Sections of Abaqus files, and
    materials of Ansys archives,
    become ``mesh.materials``, in SI units if the file's forces are in N and its mass fits to them,
    such as tonnes beside mm.

    Parameters
    ----------
    path : str or Path
        The file; its suffix determines the format.
    scale : float
        Metres per unit of the file: 0.001 for millimetres.
    boundaries : mapping of name to name or (x0, y0, x1, y1), or (x0, y0, z0, x1, y1, z1)
        Boundaries by new name: a group of the file, or the outline within a box [m].
    points : mapping of name to name, (x, y) or (x, y, z)
        Points by new name: a group of the file, or the node nearest to a place [m] in the body.
    part : str, optional
        One of several bodies in the file: a physical group of cells (Gmsh), an element set, part or
        instance (Abaqus), a component of elements (Ansys), a group of cells (MED), a property
        number (Nastran); by default all.

    Raises
    ------
    InputError
        If there is no such file or suffix, scale is not above zero, or a boundary or point is given
        in another form.
    MeshError
        If the file holds no such mesh, or has no such group, part, edges,
        faces or node.
    """
    path = as_path(path, "a mesh")
    with _located(path, scale):
        return _mesh(_raw(path).part(part), scale, boundaries or {}, points or {})


def mesh_from(
    found: Any,
    *,
    scale: float = 1.0,
    boundaries: Mapping[str, str | Box] | None = None,
    points: Mapping[str, str | Coordinates] | None = None,
) -> Mesh:
    """A mesh of meshio, scikit-fem or PyVista, with its groups.

    Groups are the cell sets and point sets of meshio, and what its ``gmsh:physical`` and
    ``field_data`` name; boundaries and subdomains of scikit-fem. PyVista's meshes have none: name
    boundaries and points by their places.

    Parameters
    ----------
    found : meshio.Mesh, skfem.Mesh or pyvista.DataSet
        Mesh of elements that :func:`read_mesh` takes; a plane one in two coordinates or at z = 0.
    scale, boundaries, points
        See :func:`read_mesh`.

    Raises
    ------
    InputError, MeshError
        For another kind of object, and as :func:`read_mesh`.

    Examples
    --------
    >>> import skfem
    >>> from fecontact.fem import mesh_from
    >>> square = skfem.MeshQuad().refined(2).with_boundaries({"base": lambda x: x[1] == 0.0})
    >>> mesh = mesh_from(square, scale=0.01)
    >>> len(mesh.cells), len(mesh.boundaries["base"])
    (16, 4)
    """
    kinds = {one.__module__.partition(".")[0] for one in type(found).__mro__}
    _require_scale("mesh_from", scale)
    if "pyvista" in kinds:
        import pyvista

        raw = _raw_mesh(pyvista.to_meshio(found))
    elif "meshio" in kinds and hasattr(found, "cells"):
        raw = _raw_mesh(found)
    elif "skfem" in kinds and hasattr(found, "facets"):
        raw = _raw_of_skfem(found)
    else:
        raise InputError(f"mesh_from: {type(found).__name__} is no mesh of meshio, scikit-fem or "
                         f"PyVista; give one of these, or read a file by read_mesh.")
    try:
        return _mesh(raw, scale, boundaries or {}, points or {})
    except (MeshError, InputError) as error:
        raise type(error)(f"mesh_from: {error}") from None


def read_bodies(path: str | Path, *, scale: float = 1.0) -> dict[str, Mesh]:
    """Meshes of all parts of a file that are bodies of their own, or of the one body, named "".

    Parameters
    ----------
    path, scale
        See :func:`read_mesh`.

    Raises
    ------
    InputError, MeshError
        As in :func:`read_mesh`.
    """
    path = as_path(path, "a mesh")
    with _located(path, scale):
        raw = _raw(path)
        names = list(raw.parts) if raw.separate else [""]
        return {name: _mesh(raw.part(name or None), scale, {}, {}) for name in names}


def single_nodes(path: str | Path, *, scale: float = 1.0) -> dict[str, Array]:
    """Places [m] of the groups of a file that hold one node, in the middle of an edge or anywhere.

    Parameters
    ----------
    path, scale
        See :func:`read_mesh`.

    Raises
    ------
    InputError, MeshError
        As in :func:`read_mesh`.
    """
    path = as_path(path, "a mesh")
    with _located(path, scale):
        raw = _raw(path)
    return {name: scale * np.asarray(raw.points[nodes[0]], dtype=float)
            for name, nodes in raw.nodes.items() if len(nodes) == 1}


def _require_scale(owner: str, scale: float) -> None:
    if not (isinstance(scale, Real) and 0.0 < scale < np.inf):
        raise InputError(f"{owner}: scale = {scale!r} (metres per unit of the mesh) must be a "
                         f"finite number above zero.")


@contextlib.contextmanager
def _located(path: Path, scale: float) -> Iterator[None]:
    """Begin messages with the file; InputError for a scale that is none."""
    _require_scale(str(path), scale)
    _reader(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    require_regular_file(path, "a mesh")
    try:
        yield
    except (MeshError, InputError) as error:
        raise type(error)(f"{path}: {error}") from None


def _mesh(
    raw: RawMesh, scale: float, boundaries: Mapping[str, str | Box],
    points: Mapping[str, str | Coordinates],
) -> Mesh:
    """Mesh of the contents of a file, with the names of its groups and those given."""
    mesh, groups = body_mesh(raw, scale)
    made = Mesh(mesh.nodes, mesh.cells, named_boundaries(mesh, groups, boundaries),
                named_points(mesh, groups, points), mesh.curved_edges, mesh.curved_middles,
                named_constraints(groups.constraints, boundaries, points), mesh.cell_groups,
                groups.materials, mesh.bricks, mesh.integration, temperature=mesh.temperature,
                node_numbers=mesh.node_numbers)
    for surface, control, direction in raw.sections:
        if surface in groups.inner:
            made = cut_along(made, control, groups.inner[surface], direction)
        elif surface in made.boundaries:
            raise MeshError(f"The surface '{surface}' of a section of a bolt lies on the outline; "
                            f"give faces inside the bolt.")
    return replace(made, attachments=named_constraints(groups.attachments, boundaries, points))


def write_mesh(mesh: Mesh, path: str | Path) -> None:
    """Write a mesh as Gmsh 4.1 text, its groups as physical groups.

    Coordinates are written with all digits, so that :func:`read_mesh` restores the same mesh, with
    the cells of each group together, but for constraints, attachments, materials and incompatible
    modes of bricks, of which a warning tells. The file is written whole or not at all.

    Raises
    ------
    InputError
        If the name does not end in .msh, the file cannot be written, or a group's name holds a
        quotation mark or a line break.
    """
    path = as_path(path, "a mesh")
    require_kind("write_mesh", Mesh, mesh=mesh)
    if path.suffix.lower() != ".msh":
        raise InputError(f"{path}: meshes are written as Gmsh files; choose a name that ends in "
                         f".msh.")
    for name in (*mesh.boundaries, *mesh.points, *mesh.cell_groups):
        if not name.strip() or '"' in name or "\n" in name:
            raise InputError(f"{path}: Gmsh cannot store a group named {name!r}; rename it.")
    lost = [counted(mesh.constraints)] * bool(mesh.constraints)
    lost += [counted_attachments(mesh.attachments)] * bool(mesh.attachments)
    lost += [f"the materials of {choices(mesh.materials)}"] * bool(mesh.materials)
    lost += ["the incompatible modes of its bricks"] * (mesh.bricks == "incompatible")
    lost += ["its temperatures"] * (mesh.temperature is not None)
    if lost:
        warnings.warn(f"{path}: Gmsh cannot store {' and '.join(lost)}; give them to the body "
                      f"anew.", ModelWarning, stacklevel=2)
    with replaced(path) as part, part.open("w", encoding="utf-8", newline="\n") as stream:
        write_msh(mesh, stream)


def _reader(path: Path) -> tuple[Callable[[Path], RawMesh], str]:
    readers: dict[str, tuple[Callable[[Path], RawMesh], str]] = {
        ".msh": (read_msh, "Gmsh"),
        ".inp": (read_inp, "Abaqus"),
        ".cdb": (read_cdb, "Ansys"),
        ".med": (read_med, "MED"),
        ".vtk": (_read_vtk, "VTK"),
        ".vtu": (_read_vtu, "VTU"),
        **dict.fromkeys((".bdf", ".fem", ".nas"), (read_nastran, "Nastran")),
    }
    if path.suffix.lower() in (".brep", ".iges", ".igs", ".step", ".stp"):
        raise InputError(f"{path} is a geometry, not a mesh; mesh it first, for example with "
                         f"`gmsh {path.name} -3 -order 2 -o {path.stem}.msh`, and name its faces "
                         f"by physical groups or by boxes in `boundaries`.")
    if path.suffix.lower() not in readers:
        raise InputError(f"{path}: files of this kind are not read; the suffixes that are: "
                         f"{', '.join(sorted(readers))}.")
    return readers[path.suffix.lower()]


def _raw(path: Path) -> RawMesh:
    """Contents of a mesh file."""
    reader, format_name = _reader(path)
    try:
        return reader(path)
    except (MeshError, InputError, MissingLibraryError):
        raise
    except MemoryError:
        raise MeshError(f"The file declares more data than fits into memory, of which "
                        f"{shown_memory(available_memory())} are free; it is damaged, or too "
                        f"large.") from None
    except OSError as error:
        raise MeshError(f"The file cannot be opened ({error.strerror or error}).") from None
    except Exception as error:
        # Damaged files make readers raise anything.
        detail = " ".join(str(error).split()).rstrip(".")
        if isinstance(error, KeyError):
            detail = f"it lacks {detail}"
        raise MeshError(f"The file cannot be read as {format_name}, it is damaged or of another "
                        f"kind{f' ({detail[:200]})' * bool(detail)}.") from error


def _read_vtk(path: Path) -> RawMesh:
    # meshio fails on many types of data arrays, which follow the mesh in the file.
    mesh_alone = re.split(rb"\n(?:POINT_DATA|CELL_DATA) ", path.read_bytes(), maxsplit=1)[0]
    grid = re.search(rb"\nDIMENSIONS[ \t]+(\d+)[ \t]+(\d+)[ \t]+(\d+)", mesh_alone)
    if grid and math.prod(map(int, grid.groups())) * _BYTES_OF_A_GRID_POINT > available_memory():
        raise MemoryError
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "mesh.vtk")
        copy.write_bytes(mesh_alone + b"\n")
        found = _by_meshio("vtk", copy)
    _require_declared_cells(found, mesh_alone)
    return _raw_mesh(found)


def _require_declared_cells(found: Any, content: bytes) -> None:
    """Refuse a VTK file with fewer cells, or nodes of cells, than its line CELLS declares."""
    declared = re.search(rb"\nCELLS[ \t]+(\d+)[ \t]+(\d+)[ \t\r]*\n", content)
    if declared is None:
        return
    count, nodes = (int(number) for number in declared.groups())
    # Version 5 declares the offsets, one more than cells; earlier ones count a size for each cell.
    if re.match(rb"# vtk DataFile Version [5-9]", content):
        count -= 1
    else:
        nodes -= count
    held = sum(len(block.data) for block in found.cells)
    nodes_held = sum(np.size(block.data) for block in found.cells)
    if (held, nodes_held) != (count, nodes):
        raise MeshError(f"The file declares {count} cells with {nodes} nodes in all, but holds "
                        f"{held} with {nodes_held}; it is cut off or damaged, save it again whole.")


def _read_vtu(path: Path) -> RawMesh:
    content = path.read_bytes()
    if b"vtkLZ4DataCompressor" in content:
        raise MeshError("The file is compressed by LZ4, which meshio does not read; save it with "
                        "ZLib or without compression.")
    pieces = len(re.findall(rb"<Piece\b", content))
    if pieces > 1:
        raise MeshError(f"The file holds {pieces} pieces, of which meshio reads the last; merge "
                        f"them into one.")
    return _raw_mesh(_by_meshio("vtu", path))


def _by_meshio(format_name: str, source: Path) -> Any:
    """Mesh of meshio read from a file, without what meshio prints."""
    import meshio

    with _silence() as printed:
        # meshio.read exits the process if a reader raises.
        found = getattr(meshio, format_name).read(source)
    if "cannot handle" in printed.getvalue():
        raise MeshError("The file holds elements of a kind that meshio does not read; mesh with "
                        "triangles, quadrilaterals, tetrahedra, pyramids, wedges or hexahedra.")
    return found


def _raw_mesh(found: Any) -> RawMesh:
    """Contents of a mesh of meshio, with its groups."""
    edges: dict[str, list[Integers]] = {}
    parts: dict[str, list[tuple[str, Integers]]] = {}
    nodes: dict[str, list[Integers]] = {name: [np.asarray(rows, np.int64).ravel()]
                                        for name, rows in found.point_sets.items()}
    for name, number, rows in _groups_of_meshio(found):
        block = found.cells[number]
        cells = block.data[rows]
        if block.dim >= 2:
            parts.setdefault(name, []).append((block.type, cells))
        elif block.dim == 1:
            edges.setdefault(name, []).append(cells[:, :2])
        else:
            nodes.setdefault(name, []).append(cells.ravel())
    return RawMesh(
        found.points,
        [(block.type, block.data) for block in found.cells if block.dim >= 2],
        edges={name: np.concatenate(rows) for name, rows in edges.items()},
        nodes={name: np.concatenate(rows) for name, rows in nodes.items()},
        parts=parts,
    )


def _groups_of_meshio(found: Any) -> Iterator[tuple[str, int, Any]]:
    """Name, number of the block, and chosen rows of it, of each group of cells."""
    for name, sets in found.cell_sets.items():
        for number, rows in enumerate(sets):
            # Sets of Gmsh's own names list which entities bound which.
            if rows is not None and len(rows) and not name.startswith("gmsh:"):
                yield name, number, np.asarray(rows, np.int64)
    names = {(int(tag), int(dim)): name for name, (tag, dim) in (
        (name, np.ravel(value)[:2]) for name, value in found.field_data.items()
        if np.size(value) >= 2)}
    for key in ("nastran:ref", "gmsh:physical"):
        for number, values in enumerate(found.cell_data.get(key, [])):
            block = found.cells[number]
            if len(values) != len(block.data):
                continue
            for tag in np.unique(values).tolist():
                name = names.get((tag, block.dim), str(tag) if key == "nastran:ref" else "")
                if name and name not in found.cell_sets:
                    yield name, number, np.flatnonzero(values == tag)


def _raw_of_skfem(found: Any) -> RawMesh:
    """Contents of a mesh of scikit-fem, with its boundaries and subdomains."""
    from skfem.io.meshio import to_meshio

    raw = _raw_mesh(to_meshio(found, encode_cell_data=False))
    kind, cells = raw.cells[0]
    groups = {name: np.asarray(found.facets[:, facets].T, np.int64)
              for name, facets in (found.boundaries or {}).items()}
    if raw.is_solid:
        raw.faces = {name: [rows] for name, rows in groups.items()}
    else:
        raw.edges = groups
    raw.cell_sets = {name: [(kind, cells[np.asarray(rows, np.int64)])]
                     for name, rows in (found.subdomains or {}).items()}
    return raw


@contextlib.contextmanager
def _silence() -> Iterator[io.StringIO]:
    """Suppress warnings and the output of meshio."""
    printed = io.StringIO()
    with (contextlib.redirect_stderr(printed), contextlib.redirect_stdout(printed),
          warnings.catch_warnings()):
        warnings.simplefilter("ignore")
        yield printed
