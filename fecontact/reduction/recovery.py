"""Shapes over a body for reduced models of other programs, from a recovery matrix."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.fields import linear_cells, stress_of
from fecontact.reduction.matrix_files import AssembledMatrix
from fecontact.reduction.mode_shapes import ModeShapes
from fecontact.reduction.reduce_body import first_order

# Distance of a point of a file and a node of the body, by the size of the body.
_SAME_PLACE = 1e-4
# Deviation of an entry of the matrix from zero and one that still counts as rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Recovery:
    """Displacements of the nodes of a body from the degrees of freedom of a reduced model.

    ``u = matrix @ x`` with the degrees of freedom x, node by node and axis by axis. Pictures,
    movies and files of a basis that is made with it show the body, and its stress by the elements
    and materials of the body.

    Attributes
    ----------
    body : ElasticBody
        The body that is shown, of N nodes. It only gives places, cells and stress: its stiffness is
        not used.
    matrix : sparse (dimension N, d) array
        Displacements [m] of ``body.nodes`` per unit of each degree of freedom.

    Raises
    ------
    InputError
        For a matrix of another shape, or with values that are not finite.

    Examples
    --------
    >>> import numpy as np
    >>> import fecontact as fc
    >>> from fecontact.reduction import Recovery, rows_from_dofs
    >>> body = fc.ElasticBody(fc.Mesh.grid([0.0, 0.1, 0.2], [0.0, 0.1]), thickness=0.1, degree=1)
    >>> basis = fc.basis_from_matrices(body.mass, body.stiffness, rows_from_dofs(12, [(0, 1)]),
    ...                                recovery=Recovery(body, np.eye(12)))
    >>> basis.mode_shapes.shapes.shape                  # nodes, axes, modes
    (6, 2, 12)
    """

    body: ElasticBody
    matrix: Any

    def __post_init__(self) -> None:
        import scipy.sparse as sp

        require_kind("Recovery", ElasticBody, body=self.body)
        given = self.matrix.matrix if isinstance(self.matrix, AssembledMatrix) else self.matrix
        try:
            matrix = sp.csr_array(given, dtype=float)
        except (TypeError, ValueError):
            raise InputError(f"Recovery: matrix must be an array of real numbers or a sparse "
                             f"matrix, not {type(given).__name__}.") from None
        rows = self.body.nodes.size
        if matrix.ndim != 2 or matrix.shape[0] != rows or not np.isfinite(matrix.data).all():
            raise InputError(f"Recovery: matrix must have {rows} rows of finite numbers, one for "
                             f"each displacement of the {len(self.body.nodes)} nodes of the body, "
                             f"not the shape {matrix.shape}; Recovery.of chooses rows by labels.")
        object.__setattr__(self, "matrix", matrix)

    @classmethod
    def of(
        cls, body: ElasticBody, matrix: AssembledMatrix, places: Mapping[int, Sequence[float]],
    ) -> "Recovery":
        """Rows of a recovery matrix with labels, for the nodes of a body at the same places.

        Parameters
        ----------
        body : ElasticBody
            The body. Every node needs a point at its place; ``degree=1`` has nodes at the corners
            of the cells alone.
        matrix : AssembledMatrix
            Matrix whose rows have labels, such as MUG1 of Nastran's external superelements. The
            directions 1, 2, 3 are displacements along the axes of the body.
        places : mapping of label to (x, y) or (x, y, z)
            Places of the points of the file [m], such as those of
            :func:`~fecontact.reduction.grid_places`.

        Raises
        ------
        InputError
            For a matrix without labels, and nodes of the body without a point, or without a row.
        """
        from scipy.spatial import cKDTree

        require_kind("Recovery.of", ElasticBody, body=body)
        require_kind("Recovery.of", AssembledMatrix, matrix=matrix)
        require_kind("Recovery.of", Mapping, places=places)
        if matrix.labels is None:
            raise InputError(f"Recovery.of: {matrix.source} does not name the rows of its matrix; "
                             f"give Recovery(body, matrix) with the rows in the order of the nodes "
                             f"of the body.")
        d = body.dimension
        labels = np.array(list(places), np.int64)
        try:
            found = np.array([np.asarray(place, float)[:d] for place in places.values()])
            found = found.reshape(len(labels), d)
        except (TypeError, ValueError):
            raise InputError(f"Recovery.of: places must hold {d} coordinates for each "
                             f"label.") from None
        size = float(np.linalg.norm(np.ptp(body.nodes, axis=0)))
        away, nearest = cKDTree(found).query(body.nodes) if len(found) else (
            np.full(len(body.nodes), np.inf), np.zeros(0, np.int64))
        apart = np.flatnonzero(away > _SAME_PLACE * size)
        if len(apart):
            at = ", ".join(f"{value:g}" for value in body.nodes[apart[0]])
            raise InputError(f"Recovery.of: {len(apart)} of the {len(body.nodes)} nodes of the "
                             f"body have no point at their place, the first at ({at}) m; give "
                             f"places in metres, and a body of degree=1 if its cells have no "
                             f"middle nodes.")
        row = {(node, way): k for k, (node, way) in enumerate(matrix.labels.tolist())}
        wanted = [(int(label), way) for label in labels[nearest] for way in range(1, d + 1)]
        missing = [one for one in wanted if one not in row]
        if missing:
            raise InputError(f"Recovery.of: {matrix.source} has no row for direction "
                             f"{missing[0][1]} at node {missing[0][0]}, nor for "
                             f"{len(missing) - 1} other displacements of the body; write the "
                             f"displacements of all nodes, or show a body of fewer nodes.")
        rows = _csr(matrix.matrix)[[row[one] for one in wanted]]
        return cls(body, rows)

    def without(self, dofs: NDArray[np.bool_]) -> "Recovery":
        """The recovery without the marked degrees of freedom."""
        return replace(self, matrix=self.matrix[:, ~dofs])

    def require_columns(self, count: int) -> None:
        """Raise InputError unless the matrix has ``count`` columns."""
        if self.matrix.shape[1] != count:
            raise InputError(f"Recovery: matrix must have {count} columns, one for each degree of "
                             f"freedom, not {self.matrix.shape[1]}.")

    def mode_shapes(self, shapes: Array, rows: Any) -> ModeShapes:
        """Shapes over the body of modes (d, m); ``rows`` (r P, d) are those of the points."""
        body = self.body
        moved = np.asarray(self.matrix @ shapes)
        elements = body.elements
        return ModeShapes(
            nodes=body.nodes, cells=linear_cells(body.nodes, elements),
            outline=first_order(body, body.mesh.outline),
            shapes=moved.reshape(-1, body.dimension, shapes.shape[1]),
            stress=stress_of(body, moved), restriction=_csr(rows @ self._displacements),
            elements=elements)

    def places(self, rows: Any) -> Array:
        """Places (P, dimension) of points: of the nodes that their rows (r P, d) move.

        Points that no node of the body moves lie at zero.
        """
        d = self.body.dimension
        each, spread = 3 * (d - 1), abs(_csr(rows @ self._displacements)).tocoo()
        displaced = spread.row % each < d
        point, node = spread.row[displaced] // each, spread.col[displaced] // d
        weights, found = np.zeros(rows.shape[0] // each), np.zeros((rows.shape[0] // each, d))
        np.add.at(weights, point, spread.data[displaced])
        np.add.at(found, point, spread.data[displaced, None] * self.body.nodes[node])
        return np.divide(found, weights[:, None], out=found, where=weights[:, None] > 0.0)

    @property
    def _displacements(self) -> Any:
        """Nodal displacement that equals each degree of freedom, sparse (d, dimension N).

        Degrees of freedom that are no displacement, such as rotations and modal coordinates, have
        rows of zeros.
        """
        import scipy.sparse as sp

        matrix = self.matrix.copy()
        matrix.data[np.abs(matrix.data) < _ROUNDING] = 0.0
        matrix.eliminate_zeros()
        alone = np.flatnonzero(np.diff(matrix.indptr) == 1)
        dof, value = matrix.indices[matrix.indptr[alone]], matrix.data[matrix.indptr[alone]]
        unit = np.abs(value - 1.0) < _ROUNDING
        dofs, first = np.unique(dof[unit], return_index=True)
        return sp.csr_array((np.ones(len(dofs)), (dofs, alone[unit][first])),
                            shape=matrix.shape[::-1])


def _csr(matrix: Any) -> Any:
    import scipy.sparse as sp

    return sp.csr_array(matrix)


