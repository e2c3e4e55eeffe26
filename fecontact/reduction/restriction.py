"""Rows of the points of interest over degrees of freedom of another program."""

import operator
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import InputError
from fecontact.core.types import Array

Place = Sequence[int | None]

_FORMS = {2: "(ix, iy) or (ix, iy, iphi)",
          3: "(ix, iy, iz) or (ix, iy, iz, iphi_x, iphi_y, iphi_z)"}


@dataclass(frozen=True, eq=False)
class Restriction:
    """Rows of all points in the basis' order: B, C, contact nodes, further points.

    Attributes
    ----------
    restriction : sparse (3 P, d) or, in space, (6 P, d) array
        Displacements and rotations of the P points from the degrees of freedom.
    contact_nodes : int
    extra : tuple of str
        Names of the further points.
    groups : tuple of (str, int)
        Names of the interfaces and their numbers of nodes.
    dimension : int
        2 in the plane, 3 in space.
    """

    restriction: Any
    contact_nodes: int
    extra: tuple[str, ...]
    groups: tuple[tuple[str, int], ...]
    dimension: int = 2


def rows_from_dofs(
    d: int,
    contact: Sequence[Place],
    *,
    B: Place | None = None,
    C: Place | None = None,
    points: Mapping[str, Place] | None = None,
    dimension: Literal[2, 3] = 2,
) -> dict[str, Any]:
    """Rows for :func:`fecontact.basis_from_matrices` from numbers of degrees of freedom.

    Parameters
    ----------
    d : int
        Number of degrees of freedom, counted from 0.
    contact : sequence of (ix, iy) or (ix, iy, iphi)
        Degrees of freedom that are the displacements x and y (and the rotation) of each contact
        node; None or -1 for one that the model lacks, which gives a zero row. In space three, ix,
        iy and iz, or six, with the rotations about them.
    B, C : (ix, iy) or (ix, iy, iphi), optional
        Excitation and load point, likewise; zero rows by default.
    points : mapping of name to (ix, iy) or (ix, iy, iphi), optional
        Further points to observe.
    dimension : 2 or 3
        3 for a body in space.

    Returns
    -------
    dict of str to sparse array
        ``contact`` (3 n, d), the others (3, d); in space (6 n, d) and (6, d).

    Raises
    ------
    InputError
        For degrees of freedom out of range, and points of another form.
    """
    require_kind("rows_from_dofs", (Sequence, np.ndarray), contact=contact)
    if not len(contact):
        raise InputError("rows_from_dofs: contact is empty; name the degrees of freedom (ix, iy) "
                         "of at least one contact node.")
    named = {name: place for name, place in (("B", B), ("C", C)) if place is not None}
    rows = {"contact": _unit_rows(d, [(f"contact node {k}", place)
                                      for k, place in enumerate(contact)], dimension)}
    for name, place in {**named, **(points or {})}.items():
        rows[name] = _unit_rows(d, [(f"point {name}", place)], dimension)
    return rows


def stack_restriction(rows: Mapping[str, Any], d: int, dimension: int = 2) -> Restriction:
    """All rows as one sparse matrix; see :meth:`basis_from_matrices` for the forms.

    Raises
    ------
    InputError
        If a block has a wrong shape, or the dimension is neither 2 nor 3.
    """
    if dimension not in (2, 3):
        raise InputError(f"dimension = {dimension!r} must be 2, the plane, or 3, space.")
    import scipy.sparse as sp

    require_kind("basis_from_matrices", Mapping, rows=rows)
    given = rows.get("contact", {})
    named = given if isinstance(given, Mapping) else {"contact": given}
    blocks = {name: _contact_block(block, d, dimension) for name, block in named.items()}
    contact = sp.csr_array(sp.vstack([sp.csr_array((0, d)), *blocks.values()]))
    extra = tuple(name for name in rows if name not in ("B", "C", "contact"))
    each = 3 * (dimension - 1)
    ends = [_point_block(name, rows[name], d, dimension) if name in rows
            else sp.csr_array((each, d)) for name in ("B", "C")]
    restriction = sp.csr_array(sp.vstack(
        [*ends, contact, *(_point_block(name, rows[name], d, dimension) for name in extra)]))
    return Restriction(restriction, contact.shape[0] // each, extra,
                       tuple((name, block.shape[0] // each) for name, block in blocks.items()),
                       dimension)


def _unit_rows(d: int, places: Sequence[tuple[str, Place]], dimension: int) -> Any:
    import scipy.sparse as sp

    where, columns = [], []
    each = 3 * (dimension - 1)
    for k, (name, place) in enumerate(places):
        if isinstance(place, (int, np.integer, str)) or len(place) not in (dimension, each):
            raise InputError(f"rows_from_dofs: {name} must be {_FORMS[dimension]}, not "
                             f"{place!r}.")
        for component, dof in enumerate(place):
            if dof is None:
                continue
            try:
                number = operator.index(dof)
            except TypeError:
                number = d
            if number == -1:
                continue
            if not 0 <= number < d:
                raise InputError(f"rows_from_dofs: {name} names degree of freedom {dof!r}, but "
                                 f"there are {d}, counted from 0.")
            where.append(each * k + component)
            columns.append(number)
    return sp.csr_array((np.ones(len(where)), (where, columns)), shape=(each * len(places), d))


def _contact_block(given: Any, d: int, dimension: int) -> Any:
    """Sparse (r n, d) from (n, r, d), (n, s, d), (r n, d), or a sequence of (r, d) or (s, d).

    A point has r = 3 rows in the plane and 6 in space, of which the first s = 2 or 3 are
    displacements.
    """
    import scipy.sparse as sp

    each = 3 * (dimension - 1)

    if isinstance(given, (list, tuple)) and any(sp.issparse(one) for one in given):
        return sp.csr_array(sp.vstack([_point_block("contact", one, d, dimension)
                                       for one in given]))
    if sp.issparse(given):
        block = given
    else:
        block = _numbers("contact", given)
        if block.ndim == 3 and block.shape[1] in (dimension, each):
            block = np.pad(block, ((0, 0), (0, each - block.shape[1]), (0, 0)))
            block = block.reshape(-1, block.shape[2])
        else:
            block = np.zeros((0, 0))
    if block.shape[1] != d or not block.shape[0] or block.shape[0] % each:
        raise _shape_error("contact", f"(n, {each}, d)", d,
                           f"(n, {dimension}, d) or sparse ({each} n, d)", np.shape(given))
    return sp.csr_array(block, dtype=float)


def _point_block(name: str, given: Any, d: int, dimension: int) -> Any:
    """Sparse (3, d) from (3, d) or (2, d); in space (6, d) from (6, d) or (3, d)."""
    import scipy.sparse as sp

    if not sp.issparse(given):
        given = _numbers(name, given)
        given = given[0] if given.ndim == 3 and len(given) == 1 else given
    each = 3 * (dimension - 1)
    if given.ndim != 2 or given.shape[0] not in (dimension, each) or given.shape[1] != d:
        raise _shape_error(name, f"({each}, d)", d, f"({dimension}, d)", given.shape)
    block = sp.csr_array(given, dtype=float)
    return block if block.shape[0] == each else sp.csr_array(
        sp.vstack([block, sp.csr_array((each - dimension, d))]))


def _numbers(name: str, given: Any) -> Array:
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"rows['{name}'] must hold real numbers in rows of one length, not "
                         f"{type(given).__name__}.") from None


def _shape_error(
    name: str, shape: str, d: int, others: str, found: tuple[int, ...]
) -> InputError:
    return InputError(f"rows['{name}'] must have shape {shape} with d = {d} degrees of freedom, or "
                      f"{others}, not {found}.")
