"""Elimination of the equations of supports and constraints from the displacements of a body.

All displacements u follow from independent unknowns q, u = G q, with K_r = G^T K G and
M_r = G^T M G. Each equation determines one unknown; chains are resolved by substitution.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.fem.equations import (
    HINGE,
    Equations,
    Unknowns,
    constraint_equations,
    hinge_equations,
)

# Largest coefficient, relative to that of an equation, of what earlier equations imply.
_IMPLIED = 1e-7
# Eigenvalue, relative to the largest, of motions of reference points that move no node.
_UNSEEN = 1e-12


@read_only_arrays
@dataclass(frozen=True, eq=False)
class Elimination:
    """Independent unknowns p of a body with constraints: all unknowns are ``G p``.

    Attributes
    ----------
    matrix : sparse (n, p) array
        G: displacements, angles of hinges and motions of reference points from p.
    numbers : (p,) integers
        Number of each independent unknown among all n.
    rest : sparse (m, p) array
        Equations ``R p = 0`` that remain, mostly of many unknowns, since they were not solved for
        one of these. The largest coefficient of each row is one.
    displacements : int
        Number of displacements, the first of the n unknowns.
    """

    matrix: Any
    numbers: Integers
    rest: Any
    displacements: int

    @cached_property
    def expansion(self) -> Any:
        """Displacements from independent unknowns, sparse (d N, f), which meet ``R p = 0`` too.

        They are displacements without a support or a constraint, then one angle per hinge, then
        displacements and rotations of reference points.
        """
        return self._independent[0]

    @property
    def spread(self) -> Any:
        """The p unknowns from the independent ones, sparse (p, f)."""
        return self._independent[1]

    @cached_property
    def _independent(self) -> tuple[Any, Any]:
        import scipy.sparse as sp

        G = sp.csr_array(self.matrix[:self.displacements])
        Z, numbers = sp.eye_array(len(self.numbers), format="csr"), self.numbers
        if self.rest.shape[0]:
            Z, kept = _null_space(self.rest)
            G, numbers = G @ Z, numbers[kept]
        turn = _seen(sp.csc_array(G), np.flatnonzero(numbers >= self.displacements))
        if turn is None:
            return sp.csc_array(G), sp.csr_array(Z)
        return sp.csc_array(G @ turn), sp.csr_array(Z @ turn)


def eliminated(unknowns: Unknowns) -> Elimination:
    """Equations of supports and constraints of a body, substituted into each other.

    Raises
    ------
    InputError
        For constraints that determine the same displacement in different ways.
    MeshError
        For a tie none of whose nodes are near its face.

    Warns
    -----
    ModelWarning
        For nodes of a tie that are not near its face.
    """
    found = [*hinge_equations(unknowns), *constraint_equations(unknowns)]
    return _substituted_equations(unknowns, found)


def _substituted_equations(unknowns: Unknowns, found: Sequence[Equations]) -> Elimination:
    import scipy.sparse as sp

    free = np.ones(unknowns.count, bool)
    free[unknowns.held] = False
    if not found:
        return Elimination(sp.csr_array(sp.eye_array(unknowns.count, format="csc")[:, free]),
                           np.flatnonzero(free), sp.csr_array((0, np.count_nonzero(free))),
                           unknowns.angles)
    ordered = sorted(found, key=lambda one: not one.strict)
    C = sp.csr_array(sp.vstack([one.matrix for one in ordered]))
    dependent = np.concatenate([one.dependent for one in ordered])
    owner = np.repeat(np.arange(len(ordered)), [len(one.dependent) for one in ordered])
    chosen = np.zeros(len(dependent), bool)
    chosen[np.unique(dependent, return_index=True)[1]] = True
    chosen &= free[dependent]
    chosen[chosen] = _acyclic(C[chosen], dependent[chosen])
    G, unknown = _substituted(C[chosen], dependent[chosen], free)
    left = np.flatnonzero(~chosen)
    rest = sp.csr_array(C[left] @ G)
    size = abs(C[left]).max(axis=1).toarray().ravel()
    implied = abs(rest).max(axis=1).toarray().ravel() <= _IMPLIED * size
    for row in np.flatnonzero(~implied):
        if ordered[owner[left[row]]].strict:
            raise _over_constrained(unknowns, ordered, owner, dependent, left[row])
    kept = np.flatnonzero(~implied)
    return Elimination(G, unknown, sp.csr_array(sp.diags_array(1.0 / size[kept]) @ rest[kept]),
                       unknowns.angles)


def _acyclic(C: Any, dependent: Integers) -> NDArray[np.bool_]:
    """Rows (m,) whose dependent unknown does not come back to them through other rows."""
    from scipy.sparse.csgraph import connected_components

    _, label = connected_components(abs(C[:, dependent]), connection="strong")
    return np.asarray(np.bincount(label)[label] == 1)


def _substituted(
    C: Any, dependent: Integers, free: NDArray[np.bool_]
) -> tuple[Any, Integers]:
    """All unknowns (n, f) from those that are free and not dependent, and numbers (f,) of these."""
    import scipy.sparse as sp

    own = C[:, dependent].diagonal()
    S = sp.csr_array(sp.diags_array(-1.0 / own) @ C)
    among = sp.csr_array(S[:, dependent])
    among.setdiag(0.0)
    among.eliminate_zeros()
    independent = free.copy()
    independent[dependent] = False
    total = term = sp.csr_array(S[:, independent])
    while (term := sp.csr_array(among @ term)).nnz:
        total = total + term
    spread = sp.csr_array((np.ones(len(dependent)), (dependent, np.arange(len(dependent)))),
                          shape=(len(free), len(dependent)))
    kept = np.flatnonzero(independent)
    identity = sp.csr_array((np.ones(len(kept)), (kept, np.arange(len(kept)))),
                            shape=(len(free), len(kept)))
    return sp.csr_array(identity + spread @ total), kept


def _null_space(R: Any) -> tuple[Any, Integers]:
    """Solutions q = Z p of ``R q = 0``, sparse; p are unknowns of q, with these numbers."""
    import scipy.sparse as sp
    from scipy.linalg import qr, solve_triangular

    used = np.unique(R.indices)
    triangle, order = qr(R[:, used].toarray(), mode="r", pivoting=True)
    rank = int(np.count_nonzero(np.abs(np.diag(triangle)) > _IMPLIED * abs(triangle[0, 0])))
    pivots, others = used[order[:rank]], used[order[rank:]]
    values = -solve_triangular(triangle[:rank, :rank], triangle[:rank, rank:])
    size = R.shape[1]
    kept = np.setdiff1d(np.arange(size), pivots)
    rows = np.concatenate([kept, np.repeat(pivots, len(others))])
    columns = np.concatenate([np.arange(len(kept)),
                              np.tile(np.searchsorted(kept, others), rank)])
    Z = sp.csr_array((np.concatenate([np.ones(len(kept)), values.ravel()]), (rows, columns)),
                     shape=(size, len(kept)))
    return Z, kept


def _seen(G: Any, extra: Integers) -> Any:
    """Unknowns, sparse (p, f), without what of those of points ``extra`` moves no node; or None.

    Such are turns about the line on which all nodes of a coupling lie. None stands for all of them.
    """
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    if not len(extra):
        return None
    motions = G[:, extra]
    gram = sp.csr_array(motions.T @ motions)
    parts, label = connected_components(gram, directed=False)
    size = G.shape[1]
    rest = np.setdiff1d(np.arange(size), extra)
    rows, columns, data = [rest], [np.arange(len(rest))], [np.ones(len(rest))]
    count = len(rest)
    for part in range(parts):
        which = np.flatnonzero(label == part)
        own = gram[which][:, which].toarray()
        scale = np.sqrt(np.diag(own))
        scale[scale == 0.0] = 1.0
        values, vectors = np.linalg.eigh(own / np.outer(scale, scale))
        seen = values > _UNSEEN * values[-1]
        turn = np.eye(len(which)) if seen.all() else vectors[:, seen] / scale[:, None]
        row, column = np.nonzero(turn)
        rows.append(extra[which[row]])
        columns.append(count + column)
        data.append(turn[row, column])
        count += turn.shape[1]
    return sp.csc_array(sp.coo_array(
        (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns))),
        shape=(size, count)))


def _over_constrained(
    unknowns: Unknowns, found: Sequence[Equations], owner: Integers, dependent: Integers, row: int
) -> InputError:
    """Error of a displacement that two of supports and constraints determine."""
    unknown, name = int(dependent[row]), found[owner[row]].name
    earlier = owner[np.flatnonzero(dependent == unknown)[0]]
    alone = bool(unknown not in unknowns.held and earlier == owner[row])
    others = {name, "a support" if unknown in unknowns.held else found[earlier].name}
    if others <= {HINGE, "a support"}:
        return InputError("Two supports share a node, and one of them is a hinge; separate them.")
    both = " and ".join(sorted(others, reverse=True))
    if alone:
        both = f"{name}, by itself or in a circle with others,"
    elif len(others) == 1:
        both = f"{name} and another one of this name"
    return InputError(f"{both} determine{'s' * alone} {unknowns.describe(unknown)} in different "
                      f"ways; leave the node out of one of them.")


def selects(G: Any) -> bool:
    """Whether each unknown is one displacement, as it is with fixed displacements alone."""
    return bool(G.nnz == G.shape[1] and (G.data == 1.0).all())


def least_squares(G: Any, displacements: Array) -> Array:
    """Unknowns q (f, k) with ``G q`` closest to displacements (d N, k)."""
    from scipy.sparse.linalg import splu

    right = np.asarray(G.T @ displacements)
    if selects(G):
        return right
    return np.asarray(splu((G.T @ G).tocsc()).solve(right))
