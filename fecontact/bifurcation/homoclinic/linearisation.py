"""Equations of a homoclinic orbit about some unknowns, and solutions of systems with them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fecontact.bifurcation.homoclinic import open_mesh
from fecontact.bifurcation.homoclinic.saddle import left_subspaces, like
from fecontact.bifurcation.linalg import bordered_kernels, condensation
from fecontact.bifurcation.linalg.bordered import Border
from fecontact.bifurcation.orbits.mesh import rule
from fecontact.bifurcation.orbits.unknowns import FreeParameters
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Step of the differences of the subspaces, in scales of the states and widths of the diagram.
_DIFFERENCE = 1e-5


@dataclass(frozen=True, eq=False)
class OpenOrbit(FreeParameters):
    """A homoclinic orbit; u = [nodes ((N m + 1) d), saddle (d), second, first parameter].

    Attributes
    ----------
    field, values : VectorField, (k,) array
        Both free parameters are taken from u.
    free, second : int
        Indices of the first and the second parameter.
    mesh : (N + 1,) array
        Ends of the intervals, from 0 to 1.
    degree : int
        m.
    time : float
        Length T of the interval [s].
    reference : (N m + 1, d) array
        Nodes of the orbit that fixes the phase.
    scales : (d + 2,) array
        Scales of the states and of both parameters.
    rows : pair of arrays
        Left subspaces of the saddle of the orbit before, stable and unstable.
    """

    field: VectorField
    values: Array
    free: int
    mesh: Array
    degree: int
    time: float
    reference: Array
    scales: Array
    rows: tuple[Array, Array]
    second: int | None = None

    @property
    def sizes(self) -> Array:
        """Scales (d,) of the states."""
        return self.scales[:-2]

    @property
    def size(self) -> int:
        """Number of nodal unknowns, those of the last node included."""
        return self.reference.size

    def nodes(self, u: Array) -> Array:
        """Nodes (N m + 1, d)."""
        return u[: self.size].reshape(self.reference.shape)

    def rest(self, u: Array) -> Array:
        """The saddle (d,)."""
        return np.ascontiguousarray(u[self.size : -2])


class HomoclinicLinearised:
    """Residual at u, and solutions of [[G_u], [row]] du = rhs.

    Rows: collocation (N m d), saddle (d), projections (d), phase.
    """

    def __init__(self, problem: OpenOrbit, u: Array) -> None:
        self.problem, self.u = problem, u
        self._x, self._slopes = open_mesh.at_gauss_points(problem.mesh, problem.nodes(u),
                                                          problem.degree)
        self._rest, self._values = problem.rest(u), problem.parameters(u)

    @cached_property
    def _derivatives(self) -> tuple[Array, Array, Array]:
        """Rates and derivatives at the Gauss points."""
        problem = self.problem
        found = problem.field.derivatives(np.zeros(len(self._x)), self._x, self._values,
                                          problem.active)
        if not all(np.isfinite(each).all() for each in found):
            raise AnalysisError("The rates are not finite there.")
        return found

    @cached_property
    def _at_saddle(self) -> tuple[Array, Array, Array]:
        f, J, P = self.problem.field.derivatives(np.zeros(1), self._rest[None], self._values,
                                                 self.problem.active)
        return f[0], J[0], P[0]

    @property
    def jacobian(self) -> Array:
        """Derivative (d, d) of the rates at the saddle."""
        return self._at_saddle[1]

    def _projections(self, jacobian: Array) -> tuple[Array, Array]:
        """L_s and L_u, which act on states, for a Jacobian at the saddle."""
        sizes = self.problem.sizes
        found = left_subspaces(jacobian * sizes / sizes[:, None])
        stable, unstable = (like(rows, reference) / sizes for rows, reference in
                            zip(found, self.problem.rows, strict=True))
        return stable, unstable

    def _at_ends(self, projections: tuple[Array, Array]) -> Array:
        """L_s (x(0) - s) and L_u (x(T) - s), together (d,)."""
        nodes = self.problem.nodes(self.u)
        stable, unstable = projections
        return np.concatenate([stable @ (nodes[0] - self._rest),
                               unstable @ (nodes[-1] - self._rest)])

    @cached_property
    def _phase_row(self) -> Array:
        """Row (N m + 1, d), the same for all nodes at one reference."""
        problem = self.problem
        return open_mesh.phase_row(problem.reference / problem.sizes, problem.degree) \
            / problem.sizes

    @cached_property
    def residual(self) -> Array:
        """Residual of all equations."""
        problem = self.problem
        f = self._derivatives[0]
        steps = np.repeat(np.diff(problem.mesh) * problem.time, problem.degree)[:, None]
        phase = float((self._phase_row * (problem.nodes(self.u) - problem.reference)).sum())
        return np.concatenate([(self._slopes - steps * f).reshape(-1), self._at_saddle[0],
                               self._at_ends(self._projections(self.jacobian)), [phase]])

    @cached_property
    def _factors(self) -> condensation.CondensedFactors:
        problem = self.problem
        f, J, P = self._derivatives
        basis = rule(problem.degree)
        factors = condensation.factors_for(len(problem.mesh) - 1, problem.degree, f.shape[1], 2)
        condensation.condense(J, f, P, np.diff(problem.mesh), problem.time, basis.values,
                              basis.slopes, 0, factors)
        return factors

    @cached_property
    def _of_ends(self) -> Array:
        """Derivatives (d, 3 d + 2) of :meth:`_at_ends` to x(0), x(T), s and both parameters."""
        problem, d = self.problem, self.problem.field.dimension
        stable, unstable = self._projections(self.jacobian)
        n = len(stable)
        found = np.zeros((d, 3 * d + 2))
        found[:n, :d], found[n:, d : 2 * d] = stable, unstable
        found[:n, 2 * d : 3 * d], found[n:, 2 * d : 3 * d] = -stable, -unstable
        for k, step in enumerate((_DIFFERENCE * problem.scales).tolist()):
            sides = []
            for sign in (1.0, -1.0):
                rest, values = self._rest.copy(), self._values.copy()
                if k < d:
                    rest[k] += sign * step
                else:
                    values[problem.active[k - d]] += sign * step
                _, J, _ = problem.field.derivatives(np.zeros(1), rest[None], values)
                sides.append(self._at_ends(self._projections(J[0])))
            found[:, 2 * d + k] += (sides[0] - sides[1]) / (2.0 * step)
        return found

    @cached_property
    def _small(self) -> tuple[Array, Array]:
        """Reduced rows (3 d + 1, 3 d + 2) without the last one, and what the phase row reduces."""
        d = self.problem.field.dimension
        end, (_, J, P) = self._factors.end, self._at_saddle
        small = np.zeros((3 * d + 1, 3 * d + 2))
        small[:d, : 2 * d], small[:d, 3 * d :] = end[:, : 2 * d], end[:, 2 * d :]
        small[d : 2 * d, 2 * d : 3 * d], small[d : 2 * d, 3 * d :] = J, P
        small[2 * d : 3 * d] = self._of_ends
        small[3 * d], weights = self._reduced(np.concatenate(
            [self._phase_row.reshape(-1), np.zeros(d + 2)]))
        return small, weights

    @cached_property
    def adjoint(self) -> tuple[Array, Array, Array]:
        """Ends (d,) of the bounded solution p of p' = -f_x^T p, and int p f_p dt (2,).

        The latter is of length one in widths of the diagram; its direction is that in which the
        manifolds part as the second and the first parameter change, at right angles to the curve.
        """
        d = self.problem.field.dimension
        rows = self._small[0][: 3 * d]
        left = np.linalg.svd(rows[:, : 3 * d] / np.abs(rows[:, : 3 * d]).max(axis=1)[:, None])[0]
        found = left[:, -1] / np.abs(rows[:, : 3 * d]).max(axis=1)
        parts = (found @ rows[:, 3 * d :]) * self.problem.scales[-2:]
        found, parts = (each / np.linalg.norm(parts) for each in (found, parts))
        stable, unstable = self._projections(self.jacobian)
        n = len(stable)
        return (found[2 * d : 2 * d + n] @ stable, found[2 * d + n :] @ unstable, parts)

    def _reduced(self, row: Array) -> tuple[Array, Array]:
        """A row over u reduced to x(0), x(T), s and the parameters, and its multiples."""
        d = self.problem.field.dimension
        last = self.problem.size - d
        border = Border(self._factors, np.concatenate([row[:last], row[-2:]]))
        found = np.zeros(3 * d + 2)
        found[: 2 * d], found[3 * d :] = border.small[: 2 * d], border.small[2 * d :]
        found[d : 3 * d] += row[last:-2]
        return found, border.weights

    def solve(self, row: Array, rhs: Array) -> Array:
        """Solution of [[G_u], [row]] du = rhs; not finite where the matrix is singular."""
        d = self.problem.field.dimension
        last = self.problem.size - d
        small, phase = self._small
        own, weights = self._reduced(row)
        reduced, side = np.empty(len(weights)), np.empty(d)
        bordered_kernels.reduce_side(self._factors, np.ascontiguousarray(rhs[:last]), reduced,
                                     side)
        # The right-hand side has the saddle and the projections next, then both borders.
        right = np.concatenate([side, rhs[last : last + 2 * d],
                                [rhs[-2] - phase @ reduced, rhs[-1] - weights @ reduced]])
        try:
            found = np.linalg.solve(np.vstack([small, own]), right)
        except np.linalg.LinAlgError:
            return np.full(len(row), np.nan)
        out = np.empty(len(row))
        bordered_kernels.expand(self._factors, reduced, found[:d].copy(),
                                found[d : 2 * d].copy(), found[3 * d :].copy(), out[:last])
        out[last:] = found[d:]
        return out
