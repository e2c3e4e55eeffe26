"""Linear buckling of an elastic body under static loads."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fecontact.core.checks import as_count
from fecontact.core.errors import AnalysisError, InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array
from fecontact.core.units import Summarised
from fecontact.fem.elastic_body import ElasticBody
from fecontact.fem.fields import BodyFields
from fecontact.fem.points import Place
from fecontact.fem.thermal import Temperature
from fecontact.laws.excitation import Load
from fecontact.reduction.eigenmodes import FreeSystem, fixed_signs
from fecontact.reduction.prestress import geometric_stiffness
from fecontact.reduction.solvers.factorisation import factorised
from fecontact.system.statics.static_solution import static_solution

# Unknowns below which all factors are computed by the dense solver.
_DENSE = 600
# Load factors beyond so many times the smallest one of either sign count as none.
_NONE = 1e3


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class BucklingLoads(Summarised):
    """Load factors at which a body buckles, and the shapes in which it does.

    Attributes
    ----------
    load_factors : (k,) array
        Positive, ascending: the body buckles under so many times its loads. Those of more than
        a thousand times the smallest one, of these or the reversed loads, are left out: there are
        none for loads that pull.
    shapes : (N, d, k) array
        Displacements of the nodes, the largest component one.
    state : BodyFields
        Displacement and stress under the loads, taken once.
    """

    load_factors: Array
    shapes: Array
    state: BodyFields

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
    temperature: Temperature | None = None,
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
        See :func:`~fecontact.static_solution`.
    count : int
        Number k of load factors, if there are so many.
    points, time, temperature : mapping, float, float or array or function
        See :func:`~fecontact.static_solution`. The factors multiply loads and temperature.

    Raises
    ------
    InputError, MeshError
        As :func:`~fecontact.static_solution`; for a body that can move without strain, hinges or
        couplings, and a count below one.
    """
    import scipy.sparse as sp

    count = as_count(count, "buckling_loads: count")
    state = static_solution(body, load, points=points, time=time, temperature=temperature)
    system = FreeSystem.of(body, "direct")
    if system.rigid.shape[1]:
        raise InputError("buckling_loads is for bodies that supports hold against all rigid "
                         "motions; support the body with fixed.")
    K, E = system.stiffness, body.expansion
    size = K.shape[0]
    stress = sp.csc_array(E.T @ geometric_stiffness(body, state) @ E)
    inverse, shapes = (_all_factors(K, stress) if size <= _DENSE or 3 * count > size
                       else _lowest_factors(system, stress, count))
    positive = inverse > np.abs(inverse).max(initial=0.0) / _NONE
    order = np.flatnonzero(positive)[np.argsort(-inverse[positive])][:count]
    moved = np.asarray(E @ shapes[:, order])
    moved *= fixed_signs(moved) / np.abs(moved).max(axis=0)
    return BucklingLoads(1.0 / inverse[order], moved.reshape(*body.nodes.shape, -1), state)


def _all_factors(K: Any, stress: Any) -> tuple[Array, Array]:
    """Inverse load factors of both signs and their shapes, by the dense solver."""
    from scipy.linalg import eigh

    inverse, shapes = eigh(-stress.toarray(), K.toarray())
    return np.asarray(inverse), np.asarray(shapes)


def _lowest_factors(system: FreeSystem, stress: Any, count: int) -> tuple[Array, Array]:
    """The one of largest size, and the largest positive ones unless it outweighs them."""
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    K, size = system.stiffness, system.stiffness.shape[0]
    if not stress.count_nonzero():
        return np.zeros(0), np.zeros((size, 0))
    options = {"M": K, "v0": np.random.default_rng(0).standard_normal(size),
               "Minv": LinearOperator(K.shape, system.factors.solve, dtype=float)}
    try:
        largest, shape = eigsh(-stress, k=1, which="LM", tol=1e-3, **options)
        if largest[0] < 0.0 and _definite(K - _NONE / largest[0] * stress):
            return largest, shape
        inverse, shapes = eigsh(-stress, k=count, which="LA", ncv=min(size, max(24, 3 * count)),
                                **options)
    except ArpackNoConvergence:
        raise AnalysisError("The load factors of buckling have not converged; ask for fewer of "
                            "them.") from None
    beside = largest < 0.0
    return np.append(inverse, largest[beside]), np.hstack([shapes, shape[:, beside]])


def _definite(matrix: Any) -> bool:
    try:
        factorised(matrix.tocsc(), trouble="indefinite")
    except AnalysisError:
        return False
    return True
