"""Sections of bolts: a mesh cut across a bolt, whose halves a control point pulls together.

The nodes on the cut become two each. Those of the one half follow those of the other, shifted by
the displacement s of the control point in x along the bolt, so that s shortens the bolt and the
force on the control point is the tension in it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import as_direction, as_place, require_kind
from fecontact.core.errors import InputError, MeshError, choices, nearest, shown
from fecontact.core.types import Array, Coordinates, Integers
from fecontact.core.units import Unit
from fecontact.fem.constraints import Tie
from fecontact.fem.elements.cell_geometry import centres_of
from fecontact.fem.elements.cell_kinds import row_numbers, unordered
from fecontact.fem.mesh import Mesh


@dataclass(frozen=True)
class PretensionSection:
    """A cut across a bolt, along the sides of cells that are nearest to a plane.

    Parameters
    ----------
    at : (x, y) or (x, y, z)
        Place in the plane [m].
    direction : (x, y) or (x, y, z)
        Normal of the plane, along the bolt; of any length.
    cells : str, optional
        Group of cells that are cut, such as those of the bolt; by default all of the piece of the
        mesh that is nearest to the place.

    Raises
    ------
    InputError
        For a place that is not finite, or a direction that is not finite or zero.
    """

    at: Annotated[Coordinates, Unit("m")]
    direction: Coordinates
    cells: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", as_place(self.at, "PretensionSection: at"))
        object.__setattr__(self, "direction", as_direction(
            self.direction, "PretensionSection: direction"))
        require_kind("PretensionSection", (str, type(None)), cells=self.cells)


def with_pretension(mesh: Mesh, name: str, section: PretensionSection) -> Mesh:
    """The mesh cut by a pretension section: both faces tied, with the control point ``name``.

    The faces become the boundaries ``NAME-below`` and ``NAME-above``, of the parts behind and ahead
    along the direction. A :class:`~fecontact.PointLoad` on the control point with component x is
    the tension of the bolt [N]; the displacement x there is what the bolt is shortened by, and
    ``fixed={name: "x"}`` or a spring holds it.

    Parameters
    ----------
    mesh : Mesh
        Mesh of a solid or a plane body.
    name : str
        Name of the control point.
    section : PretensionSection
        Place, direction and cells of the cut.

    Raises
    ------
    InputError, MeshError
        For names that the mesh does not have, or has, and a plane that misses the cells or leaves
        them joined.
    """
    require_kind("with_pretension", Mesh, mesh=mesh)
    require_kind("with_pretension", str, name=name)
    require_kind("with_pretension", PretensionSection, section=section)
    if len(section.at) != mesh.dimension or len(section.direction) != mesh.dimension:
        raise InputError(f"PretensionSection '{name}': at and direction must have {mesh.dimension} "
                         f"components, as the mesh.")
    inside = _chosen(mesh, name, section)
    ahead = np.asarray((_centres(mesh) - section.at) @ np.array(section.direction) > 0.0)
    cells, number = _sides(mesh)
    both = np.flatnonzero(number[1] == 2)
    pairs = _cells_at(cells, number[0])[both]
    cut = inside[pairs].all(axis=1) & (ahead[pairs].sum(axis=1) == 1)
    if not cut.any():
        raise MeshError(f"PretensionSection '{name}': the plane through {shown(section.at)} cuts "
                        f"no cells{'' if section.cells is None else f' of {section.cells!r}'}; "
                        f"move it into the bolt.")
    return cut_along(mesh, name, mesh._facets[_first_rows(number[0])[both[cut]]],
                     section.direction)


def cut_along(
    mesh: Mesh, name: str, facets: Integers, direction: Sequence[float] | None = None
) -> Mesh:
    """The mesh cut along sides (k, n) of cells within it, as :func:`with_pretension` does.

    The direction is the mean normal of the sides if there is none.

    Raises
    ------
    MeshError
        If a side is none between two cells, or the cut leaves its two halves joined.
    """
    what = f"The section '{name}'"
    if taken := {name, f"{name}-below", f"{name}-above"} & {*mesh.boundaries, *mesh.points}:
        raise MeshError(f"{what} needs the name '{min(taken)}', which the mesh has already; rename "
                        f"one of them.")
    sides, (number, count) = _sides(mesh)
    cut = np.unique(_numbers(mesh, np.asarray(facets)))
    if cut[0] < 0 or (count[cut] != 2).any():
        raise MeshError(f"{what} has {np.count_nonzero(count[cut[cut >= 0]] != 2) or 1} sides that "
                        f"do not lie between two cells; give faces inside the bolt.")
    first = _first_rows(number)[cut]
    along = _mean_normal(mesh, first) if direction is None else np.array(as_direction(
        direction, f"{what}: direction"))
    nodes = np.unique(mesh._facets[first])
    pairs = _cells_at(sides, number)[cut]
    high = _high_cells(mesh, nodes, number, cut, pairs, along)
    if not (high[pairs].sum(axis=1) == 1).all():
        raise MeshError(f"{what} leaves both of its sides joined; let it cut the whole bolt.")
    twin = np.arange(len(mesh.nodes))
    twin[nodes] = len(mesh.nodes) + np.arange(len(nodes))
    cells = np.where(high[:, None], twin[mesh.cells], mesh.cells)
    below = mesh._facets[np.where(high[sides[first]], _last_rows(number)[cut], first)]
    owner = _cells_at(sides, number)[:, 0]
    boundaries = {key: np.where(high[owner[_numbers(mesh, facets_of)]][:, None], twin[facets_of],
                                facets_of) for key, facets_of in mesh.boundaries.items()}
    boundaries |= {f"{name}-below": below, f"{name}-above": twin[below]}
    points = {key: held if len(held) == 1 else np.union1d(held, twin[held])
              for key, held in mesh.points.items()}
    curved, middles = _curved(mesh, high, twin)
    tie = Tie(f"{name}-above", f"{name}-below", name=f"section {name}", control=name,
              direction=tuple((-along).tolist()))
    made = Mesh(np.concatenate([mesh.nodes, mesh.nodes[nodes]]), cells, boundaries, points, curved,
                middles, (), mesh.cell_groups, mesh.materials, mesh.bricks,
                mesh.integration,
                temperature=None if mesh.temperature is None else np.append(
                    mesh.temperature[: len(mesh.nodes)], mesh.temperature[nodes]))
    return replace(made, constraints=(*mesh.constraints, tie), attachments=mesh.attachments)


def _chosen(mesh: Mesh, name: str, section: PretensionSection) -> NDArray[np.bool_]:
    """Mask (M,) of the cells that a section may cut."""
    if section.cells is None:
        piece = mesh.pieces[1]
        nearest_node = np.argmin(np.linalg.norm(mesh.nodes - section.at, axis=1))
        return np.asarray(piece[mesh.cells[:, 0]] == piece[nearest_node])
    if section.cells not in mesh.cell_groups:
        raise MeshError(f"PretensionSection '{name}': the mesh has no group of cells "
                        f"'{section.cells}'{nearest(section.cells, mesh.cell_groups)}; its groups "
                        f"of cells are: {choices(mesh.cell_groups)}.")
    return np.isin(np.arange(len(mesh.cells)), mesh.cell_groups[section.cells])


def _mean_normal(mesh: Mesh, rows: Integers) -> Array:
    """Unit normal of sides of cells, which are outward for their own cells, all to one side."""
    places = mesh.nodes[mesh._facets[rows]]
    ahead = places[:, 1] - places[:, 0]
    if mesh.dimension == 2:
        normals = np.column_stack([ahead[:, 1], -ahead[:, 0]])
    else:
        normals = np.cross(ahead, places[:, -1] - places[:, 0])
    turned = np.where(normals @ normals[0] < 0.0, -1.0, 1.0)
    total = turned @ normals
    return np.asarray(total / np.linalg.norm(total))


def _centres(mesh: Mesh) -> Array:
    return centres_of(mesh.nodes, mesh.cells)


def _sides(mesh: Mesh) -> tuple[Integers, tuple[Integers, Integers]]:
    """Cell of each side of a cell, and the number of each side and how often each occurs."""
    number, count = mesh._facet_number, mesh._cells_at_facets
    return mesh._facet_cells, (number, count)


def _first_rows(number: Integers) -> Integers:
    """First row of each number."""
    return np.unique(number, return_index=True)[1]


def _last_rows(number: Integers) -> Integers:
    return len(number) - 1 - np.unique(number[::-1], return_index=True)[1]


def _cells_at(cells: Integers, number: Integers) -> Integers:
    """First and last cell (F, 2) at each side, which are the same on the outline."""
    return np.column_stack([cells[_first_rows(number)], cells[_last_rows(number)]])


def _numbers(mesh: Mesh, facets: Integers) -> Integers:
    """Numbers of sides (k, n) of the mesh, -1 for others."""
    first = _first_rows(mesh._facet_number)
    return row_numbers(unordered(mesh._facets[first]), unordered(facets))


def _high_cells(
    mesh: Mesh, nodes: Integers, number: Integers, cut: Integers, pairs: Integers, direction: Array,
) -> NDArray[np.bool_]:
    """Mask (M,) of the cells at the nodes of a cut that lie ahead of it."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    touching = np.asarray(np.isin(mesh.cells, nodes).any(axis=1), bool)
    joined = np.setdiff1d(np.arange(int(number.max()) + 1), cut)
    links = _cells_at(mesh._facet_cells, number)[joined]
    links = links[touching[links].all(axis=1)]
    graph = coo_array((np.ones(len(links)), tuple(links.T)), shape=(len(mesh.cells),) * 2)
    label = connected_components(graph, directed=False)[1]
    centres = _centres(mesh)
    lead = (centres[pairs[:, 1]] - centres[pairs[:, 0]]) @ direction
    votes = np.zeros(int(label.max()) + 1)
    np.add.at(votes, label[pairs[:, 1]], lead)
    np.add.at(votes, label[pairs[:, 0]], -lead)
    return np.asarray(touching & (votes[label] > 0.0))


def _curved(
    mesh: Mesh, high: NDArray[np.bool_], twin: Integers
) -> tuple[Integers, Array]:
    """Curved edges of the cut mesh, of which those on the cut are two each, and their middles."""
    if not len(mesh.curved_edges):
        return mesh.curved_edges, np.asarray(mesh.curved_middles)
    which = mesh.edge_numbers(mesh.curved_edges, "curved_edges")
    of_low, of_high = (np.isin(which, mesh.edges[1][cells]) for cells in (~high, high))
    middles = np.asarray(mesh.curved_middles)
    return (np.concatenate([mesh.curved_edges[of_low], twin[mesh.curved_edges[of_high]]]),
            np.concatenate([middles[of_low], middles[of_high]]))
