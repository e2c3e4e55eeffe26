"""Static response of large solids to forces at many rows, by iterations and without factors.

Beside modes Phi, which are orthogonal in mass and stiffness, forces W^T f leave

    W^T f - M Phi Phi^T W^T f,

whose response is the residual part. It is sought among displacements B v: all of them, or those
that are quadratic near the loaded nodes and linear elsewhere, where that costs little of the
tolerance.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array
from fecontact.reduction.eigenmodes import FreeSystem
from fecontact.reduction.solvers.multigrid import ByNodes
from fecontact.reduction.solvers.near_solver import NearSolver
from fecontact.reduction.solvers.solid_solver import WIDTH, SolidSolver
from fecontact.reduction.solvers.solver_unknowns import SolverUnknowns
from fecontact.reduction.static_modes.flexibility import Flexibility, Modes, modal_compliance

# Energy norm of the residuals of iterated deflections; the error of compliances is its square.
ACCURACY = 1e-5
# Parts of a tolerance that are left to the iterations and to linear elements, and the factor on the
# estimate of what these lack: it was between half of that and a tenth more.
PART = 0.05
_FAR = 0.1
_SAFETY = 2.0
# Layers of quadratic elements around loaded nodes, and the part of all nodes above which they are
# not worth it.
_LAYERS = (2, 3, 4, 6, 8, 12)
_WORTH = 0.6
# Bytes of deflections that are kept.
_ROOM = 3e9


@dataclass(frozen=True, eq=False)
class TrialSpace:
    """Displacements B v (f,) of the free degrees of freedom among which deflections are sought."""

    system: FreeSystem
    solver: SolidSolver
    near: NearSolver | None = None

    @classmethod
    def whole(cls, system: FreeSystem) -> "TrialSpace":
        """All displacements."""
        assert system.iterative is not None
        return cls(system, system.iterative)

    @classmethod
    def suited(
        cls, system: FreeSystem, rows: Any, modes: Modes, accuracy: float, tolerance: float
    ) -> "TrialSpace":
        """Few displacements that take little of a tolerance of the compliance at rows (k, f).

        All displacements, if there are none.
        """
        whole = cls.whole(system)
        assert system.body is not None
        if system.body.degree == 1 or not whole.solver.plain:
            return whole
        loaded = np.flatnonzero(np.diff(rows.indptr))
        some = rows[loaded[:: -(-len(loaded) // WIDTH)]]
        nodes = np.unique((rows @ system.body.expansion.T).tocsr().indices // 3)
        known = np.diag(modal_compliance(some, *modes))
        for layers in _LAYERS:
            near = NearSolver.of(system.body, whole.solver, nodes, layers)
            if len(near.followers) < (1.0 - _WORTH) * near.spread.shape[0]:
                break
            space = cls(system, near.solver, near)
            responses = StaticResponses.of(space, some, modes, accuracy)
            own = known + np.diag(responses.compliance)
            if responses.converged and (responses.missing <= _FAR * tolerance * own).all():
                return space
        return whole

    def gather(self, forces: Any) -> Array:
        """B^T f (s, k) of forces (f, k)."""
        forces = np.asarray(self.unknowns.pick.T @ forces)
        return forces if self.near is None else np.asarray(self._restriction @ forces)

    def rows(self, rows: Any) -> Any:
        """W B, sparse (k, s), of rows W (k, f)."""
        import scipy.sparse as sp

        found = sp.csr_array(rows @ self.unknowns.pick)
        if self.near is None:
            return found
        return sp.csr_array(found @ sp.kron(self.near.spread, sp.eye_array(3), format="csr"))

    def spread(self, coordinates: Array) -> Array:
        """Displacements B v (f, k) from v (s, k)."""
        if self.near is not None:
            coordinates = ByNodes(self.near.spread) @ coordinates
        return np.asarray(self.unknowns.pick @ coordinates)

    def deflections(self, forces: Array, accuracy: float) -> Array | None:
        """Coordinates v (s, k) under balanced forces B^T f (s, k); None if they do not converge."""
        found, converged = self.solver.deflections(forces, accuracy)
        if converged:
            return found
        if self.near is not None:
            return None
        spread = self.unknowns.spread
        return np.asarray(spread @ self.system.deflection(spread.T @ forces))

    def at_followers(self, forces: Array) -> Array:
        """Forces at the nodes that follow, from forces (f, k) at all free unknowns."""
        if self.near is None:
            return forces[:0]
        whole = np.asarray(self.unknowns.pick.T @ forces).reshape(-1, 3, forces.shape[1])
        return whole[self.near.followers].reshape(-1, forces.shape[1])

    @property
    def unknowns(self) -> SolverUnknowns:
        """Unknowns of the solver of the whole body."""
        assert self.system.iterative is not None
        assert self.system.iterative.unknowns is not None
        return self.system.iterative.unknowns

    @cached_property
    def _restriction(self) -> ByNodes:
        assert self.near is not None
        return ByNodes(self.near.spread.T.tocsr())


@dataclass(frozen=True, eq=False)
class StaticResponses:
    """Residual response to unit forces at rows W (k, f) beside modes, among displacements B v.

    Attributes
    ----------
    compliance : (k, k) array
        Displacements at the rows [m/N].
    found : (s, k) array or None
        v, if they are kept.
    missing : (k,) array
        Estimated bound on the part of the compliance's diagonal that linear elements lack.
    converged : bool
    """

    compliance: Array
    found: Array | None
    missing: Array
    converged: bool

    @classmethod
    def of(cls, space: TrialSpace, rows: Any, modes: Modes, accuracy: float) -> "StaticResponses":
        """The answers, with deflections to an accuracy in the energy norm."""
        count, near = rows.shape[0], space.near
        momentum = space.system.mass @ modes[1]
        at_rows, inertia, own = rows @ modes[1], space.gather(momentum), space.rows(rows)
        far = space.at_followers(momentum)
        compliance, missing = np.zeros((count, count)), np.zeros(count)
        size = own.shape[1]
        found: Array | None = None
        loaded = np.flatnonzero(np.diff(rows.indptr))
        for first in range(0, len(loaded), WIDTH):
            part = loaded[first : first + WIDTH]
            answer = space.deflections(
                own[part].T.toarray() - inertia @ at_rows[part].T, accuracy)
            if answer is None:
                return cls(compliance, None, missing, False)
            if found is None and answer.itemsize * float(size) * count <= _ROOM:
                found = np.zeros((size, count), answer.dtype)
            compliance[:, part] = own @ answer - at_rows @ (inertia.T @ answer)
            if near is not None:
                missing[part] = _SAFETY * near.missing(-far @ at_rows[part].T, answer)
            if found is not None:
                found[:, part] = answer
        return cls(0.5 * (compliance + compliance.T), found, missing, True)


class IteratedFlexibility(Flexibility):
    """Elastic static response to unit forces at the rows W (k, f) of an iterated system.

    ``accuracy`` is the energy norm of the residuals of the deflections under unit forces, relative
    to theirs; what each of them says of its own row is accurate to the square. Where modes are
    completed to a ``tolerance``, linear elements far from the rows may take a part of it.
    """

    def __init__(
        self, system: FreeSystem, rows: Any, modes: Modes | None = None,
        accuracy: float = ACCURACY, tolerance: float = 0.0,
    ) -> None:
        self.system = system
        self.rows = rows.tocsr()
        self.modes = modes or (np.zeros(system.rigid.shape[1]), system.rigid)
        self.accuracy, self.tolerance = accuracy, tolerance
        self._whole: tuple[IteratedFlexibility, NDArray[np.bool_]] | None = None

    def of_rows(self, which: NDArray[np.bool_]) -> "IteratedFlexibility":
        """Flexibility restricted to the rows of a mask."""
        part = IteratedFlexibility(self.system, self.rows[which], self.modes, self.accuracy,
                                   self.tolerance)
        part._whole = self, which
        return part

    @cached_property
    def compliance(self) -> Array:
        """W G W^T (k, k): elastic displacements at the rows per unit force there [m/N]."""
        if self._whole is not None:
            whole, which = self._whole
            return whole.compliance[np.ix_(which, which)]
        return modal_compliance(self.rows, *self.modes) + self._solved[1].compliance

    @cached_property
    def missing(self) -> Array:
        """Part (k,) of the compliance of each row that may be missing in its deflection."""
        if self._whole is not None:
            whole, which = self._whole
            return whole.missing[which]
        own = np.diag(self.compliance)
        return (self.accuracy**2
                + self._solved[1].missing / np.where(own > 0.0, own, 1.0) * (own > 0.0))

    @property
    def space(self) -> TrialSpace:
        """Displacements of which the deflections are."""
        return self._whole[0].space if self._whole is not None else self._solved[0]

    @cached_property
    def _solved(self) -> tuple[TrialSpace, StaticResponses]:
        given = (self.rows, self.modes, self.accuracy)
        space = TrialSpace.whole(self.system)
        if self.tolerance:
            space = TrialSpace.suited(self.system, *given, self.tolerance)
        responses = StaticResponses.of(space, *given)
        if space.near is not None:
            own = np.diag(modal_compliance(self.rows, *self.modes) + responses.compliance)
            if not responses.converged or (
                    responses.missing > 2.0 * _FAR * self.tolerance * own).any():
                space = TrialSpace.whole(self.system)
                responses = StaticResponses.of(space, *given)
        return space, responses

    def coordinates(self, patterns: Array) -> Array:
        """Coordinates v (s, p) of the residual response B v to force patterns (k, p)."""
        if self._whole is not None:
            whole, which = self._whole
            further = np.zeros((len(which), patterns.shape[1]))
            further[which] = patterns
            return whole.coordinates(further)
        space, responses = self._solved
        if responses.found is not None:
            return np.asarray(responses.found @ patterns.astype(responses.found.dtype), dtype=float)
        forces = self.rows.T @ patterns
        forces -= (self.system.mass @ self.modes[1]) @ (self.modes[1].T @ forces)
        found = space.deflections(space.gather(forces), self.accuracy)
        if found is None:
            raise AnalysisError("The deflections under forces at the contact nodes do not "
                                "converge; take eigensolver = 'direct'.")
        return np.asarray(found, dtype=float)

    def deflections(self, patterns: Array) -> Array:
        """G W^T patterns (f, p): elastic displacements under force patterns (k, p) [m/N]."""
        w, shapes = self.modes
        responses = self.space.spread(self.coordinates(patterns))
        responses -= shapes @ ((self.system.mass @ shapes).T @ responses)
        elastic = shapes[:, w > 0.0]
        return np.asarray(responses + elastic @ (
            (elastic.T @ (self.rows.T @ patterns)) / w[w > 0.0, None] ** 2))
