"""Linear buckling of an elastic body under static loads."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.core.checks import require_kind
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, Integers
from fecontact.core.units import Summarised
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.fields import body_elements
from fecontact.fem.points import Place
from fecontact.laws.excitation import Load
from fecontact.reduction.eigenmodes import FreeSystem, fixed_signs
from fecontact.reduction.prestress import geometric_stiffness
from fecontact.system.statics.static_solution import static_solution

# Unknowns below which all factors are computed by the dense solver.
_DENSE = 600
# Load factors beyond this, over the smallest, count as infinite.
_INFINITE = 1e9


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class BucklingLoads(Summarised):
    """Load factors at which a body buckles, and the shapes in which it does.

    Attributes
    ----------
    load_factors : (k,) array
        Positive, ascending: the body buckles under so many times its loads. Empty if these loads
        cannot make it buckle.
    nodes : (N, d) array
        Reference places of the displacement nodes [m].
    elements : (E, n) integer array
        Nodes of each element, as those of :class:`~fecontact.fem.BodyFields`.
    shapes : (N, d, k) array
        Displacements of the nodes, the largest one.
    """

    load_factors: Array
    nodes: Array
    elements: Integers
    shapes: Array

    def summary(self) -> list[tuple[str, str]]:
        """The load factors."""
        found = ", ".join(f"{factor:.5g}" for factor in self.load_factors)
        return [("load factors", found or "none: these loads do not make the body buckle")]


def buckling_loads(
    body: ElasticBody,
    load: Load,
    count: int = 4,
    *,
    points: Mapping[str, Place] | None = None,
    time: float = 0.0,
) -> BucklingLoads:
    r"""Lowest load factors of linear buckling, of a body that supports hold.

    .. math:: (K + \lambda K_\sigma) \phi = 0

    with the geometric stiffness :math:`K_\sigma` of the stress under the loads, whose response is
    taken as linear up to buckling. Loads keep their directions.

    Parameters
    ----------
    body : ElasticBody
        With supports against all rigid motions.
    load : Load
        As of :func:`~fecontact.static_solution`.
    count : int
        Number k of load factors, if there are so many.
    points, time : mapping, float
        As of :func:`~fecontact.static_solution`.

    Raises
    ------
    InputError, MeshError
        As :func:`~fecontact.static_solution`; for a body that can move without strain, hinges or
        couplings, and a count that is not from 1 to the number of unknowns.
    """
    import scipy.sparse as sp
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    fields = static_solution(body, load, points=points, time=time)
    require_kind("buckling_loads", int, count=count)
    system = FreeSystem.of(body, "direct")
    if system.rigid.shape[1]:
        raise InputError("buckling_loads is for bodies that supports hold against all rigid "
                         "motions; support the body with fixed.")
    K, E = system.stiffness, body.expansion
    size = K.shape[0]
    if not 1 <= count <= size:
        raise InputError(f"buckling_loads: count = {count!r} must be from 1 to the number of "
                         f"unknowns, {size}.")
    stress = sp.csc_array(E.T @ geometric_stiffness(body, fields) @ E)
    if size <= _DENSE or 3 * count > size:
        from scipy.linalg import eigh

        inverse, shapes = eigh(-stress.toarray(), K.toarray(),
                               subset_by_index=[size - count, size - 1])
    else:
        start = np.random.default_rng(0).standard_normal(size)
        try:
            inverse, shapes = eigsh(
                -stress, k=count, M=K, which="LA", v0=start, ncv=min(size, max(24, 3 * count)),
                Minv=LinearOperator(K.shape, system.factors.solve, dtype=float))
        except ArpackNoConvergence:
            raise AnalysisError("The load factors of buckling have not converged; ask for fewer "
                                "of them.") from None
    positive = inverse > np.abs(inverse).max(initial=0.0) / _INFINITE
    order = np.flatnonzero(positive)[np.argsort(-inverse[positive])]
    moved = np.asarray(E @ shapes[:, order])
    moved *= fixed_signs(moved) / np.abs(moved).max(axis=0)
    return BucklingLoads(1.0 / inverse[order], body.nodes, body_elements(body),
                         moved.reshape(*body.nodes.shape, -1))
