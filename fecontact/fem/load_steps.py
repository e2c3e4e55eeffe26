r"""Static equilibrium paths of bodies with large deflections, by load steps or arc length.

Internal forces f(q) balance the loads, ``f(q) = lambda p(q)``. Newton's method solves this with one
more equation for a step from a known point: in load steps lambda is given, with the arc length the
next point lies in a plane normal to the tangent (Riks, J. Appl. Mech. 39, 1972), so that the path
passes limit points. Each iteration solves two systems with one factorised tangent (Crisfield,
Comput. Struct. 13, 1981).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol, get_args

import numpy as np

from fecontact.core.errors import InputError, require_choice, require_finite, require_positive
from fecontact.core.types import Array
from fecontact.fem.finite_strain import StrainState

Steps = Literal["load", "arc"]
# Iterations of Newton's method that a step should take, and bounds of the change of its length.
_WANTED, _LEAST, _MOST = 5, 0.4, 1.6
# Times as many iterations are allowed while contacts change.
_CHANGING = 5
# Displacement of an iteration, relative to the whole, that is rounding.
_ROUNDING = 1e-11
Loads = Callable[[Array], tuple[Array, Any]]


class Equations(Protocol):
    """Internal forces of a body over its free unknowns (f,), such as a FiniteStrainModel."""

    @property
    def expansion(self) -> Any:
        """All displacements from the free unknowns, sparse (d n, f)."""

    def state(self, q: Array) -> StrainState:
        """Energy, forces and tangent at free unknowns."""


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """Rigid modes of a body that nothing holds, which its equilibria leave out.

    Attributes
    ----------
    shapes : (f, r) array
        Mass-normalised rigid modes Phi over the free unknowns.
    inertia : (f, r) array
        M Phi: displacements u obey ``(M Phi)^T u = 0``, and forces M Phi mu balance the loads.
    """

    shapes: Array
    inertia: Array


@dataclass(frozen=True)
class DeflectionSteps:
    """Options of :func:`fecontact.analysis.deflection_path`.

    Parameters
    ----------
    by : 'load' or 'arc'
        Steps of the load factor, or of the arc length, which passes limit points: there the load
        that a body carries has a maximum or minimum.
    first, smallest, largest : float
        Length of the first step, and bounds: parts of the load with ``by = 'load'``. An arc of
        length 1 is as long as the linear response to the whole load.
    most : int
        Largest number of steps.
    tolerance : float
        Largest residual of the forces, relative to the whole load.
    iterations : int
        Most iterations of a step before it is halved. Those after which contacts close, open, slide
        or stick do not count, up to five times as many.

    Raises
    ------
    InputError
        For values out of range.
    """

    by: Steps = "load"
    first: float = 0.1
    smallest: float = 1e-5
    largest: float = 1.0
    most: int = 200
    tolerance: float = 1e-8
    iterations: int = 15

    def __post_init__(self) -> None:
        owner = "DeflectionSteps"
        require_choice(owner, "by", self.by, get_args(Steps))
        require_positive(owner, first=self.first, smallest=self.smallest, largest=self.largest,
                         tolerance=self.tolerance)
        require_finite(owner, most=self.most, iterations=self.iterations)
        if not self.smallest <= self.first <= self.largest:
            raise InputError(f"{owner}: first = {self.first!r} must lie between smallest = "
                             f"{self.smallest!r} and largest = {self.largest!r}.")
        for name in ("most", "iterations"):
            value = getattr(self, name)
            if type(value) is not int or value < 1:
                raise InputError(f"{owner}: {name} = {value!r} must be a whole number of at least "
                                 f"1.")
        if not self.tolerance < 0.1:
            raise InputError(f"{owner}: tolerance = {self.tolerance!r} must be below 0.1.")


@dataclass(frozen=True, eq=False)
class PathPoint:
    """A state of equilibrium: free unknowns q (f,), load factor, and what was found there.

    ``unstable`` is the number of negative eigenvalues of the tangent.
    """

    q: Array
    factor: float
    state: StrainState
    unstable: int


@dataclass(frozen=True, eq=False)
class FollowedPath:
    """Points of a path from the body without load, and whether the whole load was reached."""

    points: list[PathPoint]
    reached: bool
    message: str


def follow(
    model: Equations, loads: Loads, options: DeflectionSteps,
    stop: Callable[[Array], bool] | None = None, free: FreeMotion | None = None,
    accepted: Callable[[Array], None] | None = None, begin: Array | None = None,
) -> FollowedPath:
    """Follow the equilibria of a body from no load to the load factor 1, or until ``stop``.

    Parameters
    ----------
    model : Equations
        Internal forces of the body, and of contacts if it has any.
    loads : callable
        Forces p (f,) of the whole load at free unknowns q, and their derivative or None.
    options : DeflectionSteps
        Steps.
    stop : callable, optional
        True for free unknowns q with which the path ends, at whatever load factor.
    free : FreeMotion, optional
        Rigid modes of a body that nothing holds.
    accepted : callable, optional
        Called with the free unknowns of each point once it belongs to the path, for forces that
        depend on its history.
    begin : (f,) array, optional
        Free unknowns of the first point, which is known; near zero by default.
    """
    zero = np.zeros(model.expansion.shape[1]) if begin is None else begin
    newton = _Newton(model, loads, options, free, zero)
    keep = accepted or (lambda q: None)
    # Contacts may press without load.
    start = newton.at_load(zero, 0.0)
    if start is None:
        keep(zero)
        return FollowedPath([newton.point(zero, 0.0)], False,
                            "There is no equilibrium without load under the forces of the contacts "
                            "alone.")
    here, _ = start
    if begin is None:
        keep(here.q)
    points, message = [here], ""
    if not newton.loaded:
        keep(here.q)
        return FollowedPath([here, newton.point(here.q, 1.0)], True, "There is no load.")
    length, heading = options.first, newton.linear
    newton.scale = float(np.linalg.norm(newton.linear[:-1]))
    while len(points) <= options.most:
        tangent = newton.tangent(here, heading)
        last = stop is None and options.by == "load" and here.factor + length >= 1.0 - 1e-12
        found = newton.step(here, tangent, (1.0 - here.factor) if last else length, options.by)
        if (found is not None and stop is None and options.by == "arc"
                and found[0].factor > 1.0):
            # The path passes the whole load within this step: end on it.
            share = (1.0 - here.factor) / (found[0].factor - here.factor)
            guess = here.q + share * (found[0].q - here.q)
            found, last = newton.at_load(guess, 1.0), True
        if found is None:
            length *= 0.5
            if length < options.smallest:
                message = (f"The load factor {here.factor:.6g} could not be passed with steps of "
                           f"{options.smallest:g}" + (
                               "; at a limit point take steps of the arc length, by = 'arc'."
                               if options.by == "load" else "."))
                break
            continue
        there, iterations = found
        heading = np.append(there.q - here.q, there.factor - here.factor)
        points.append(there)
        here = there
        keep(here.q)
        if last or (stop is not None and stop(here.q)):
            return FollowedPath(points, True, "The whole load is reached.")
        length = min(options.largest, length * float(np.clip(
            np.sqrt(_WANTED / max(iterations, 1)), _LEAST, _MOST)))
    return FollowedPath(points, False, message or (
        f"The load factor {here.factor:.6g} was reached in {options.most} steps; allow more by "
        f"most."))


class _Newton:
    """Newton's method with the tangent of internal forces and loads.

    Points are (q, factor); ``scale`` makes displacements comparable with the factor.
    """

    def __init__(
        self, model: Equations, loads: Loads, options: DeflectionSteps, free: FreeMotion | None,
        begin: Array,
    ) -> None:
        self.model, self.loads, self.options, self.free = model, loads, options, free
        self.scale = 1.0
        load, state = loads(begin)[0], model.state(begin)
        self.loaded = bool(load.any())
        self.size = float(np.linalg.norm(load if self.loaded else state.force)) or 1.0
        self.linear = np.append(self._factors(state.tangent).solve(load), 1.0)

    def point(self, q: Array, factor: float) -> PathPoint:
        """The equilibrium (q, factor) with its tangent."""
        state = self.model.state(q)
        K = self._matrix(state, factor, self.loads(q)[1])
        return PathPoint(q, factor, state, _negative(self._factors(K)))

    def tangent(self, here: PathPoint, heading: Array) -> Array:
        """Direction (f + 1,) of the path with unit length, on the side of ``heading``."""
        force, slope = self.loads(here.q)
        response = self._factors(self._matrix(here.state, here.factor, slope)).solve(force)
        found = np.append(response, 1.0)
        found *= np.sign(self._product(found, heading)) or 1.0
        return found / np.sqrt(self._product(found, found))

    def step(
        self, here: PathPoint, tangent: Array, length: float, by: Steps
    ) -> tuple[PathPoint, int] | None:
        """Next point and the number of iterations, or None."""
        if by == "load":
            # The tangent of the path in units of the load factor.
            ahead = length * tangent[:-1] / tangent[-1] if tangent[-1] > 1e-3 else 0.0
            return self.at_load(here.q + ahead, here.factor + length)
        start = here.q + length * tangent[:-1], here.factor + length * tangent[-1]
        return self._solve(*start, tangent)

    def at_load(self, q: Array, factor: float) -> tuple[PathPoint, int] | None:
        """Point at a load factor."""
        return self._solve(q, factor, None)

    def _solve(
        self, q: Array, factor: float, normal: Array | None
    ) -> tuple[PathPoint, int] | None:
        largest = 1e3 * max(self.scale, float(np.linalg.norm(q)))
        iteration, contacts = 0, b""
        for number in range(_CHANGING * self.options.iterations):
            state = self.model.state(q)
            iteration += number == 0 or state.contacts == contacts
            contacts = state.contacts
            if iteration > self.options.iterations:
                return None
            force, slope = self.loads(q)
            residual = factor * force - state.force
            if self.free is not None:
                residual = residual - self.free.inertia @ (self.free.shapes.T @ residual)
            error = float(np.linalg.norm(residual)) / self.size
            factors = self._factors(self._matrix(state, factor, slope))
            if error <= max(self.options.tolerance, state.rounding / self.size):
                return PathPoint(q, factor, state, _negative(factors)), iteration - 1
            change, shift = factors.solve(residual), 0.0
            if normal is not None:
                response = factors.solve(force)
                weights = normal[:-1] / self.scale**2
                shift = -float(weights @ change) / float(weights @ response + normal[-1])
                change = change + shift * response
            size = float(np.linalg.norm(change))
            if not np.isfinite(size) or size > largest:
                return None
            q, factor = q + change, factor + shift
            if size <= _ROUNDING * float(np.linalg.norm(q)):
                return self.point(q, factor), iteration
        return None

    def _product(self, a: Array, b: Array) -> float:
        return float(a[:-1] @ b[:-1] / self.scale**2 + a[-1] * b[-1])

    def _factors(self, matrix: Any) -> Any:
        return _factors(matrix) if self.free is None else _FreeFactors(matrix, self.free)

    def _matrix(self, state: StrainState, factor: float, slope: Any) -> Any:
        return state.tangent if slope is None else (state.tangent - factor * slope).tocsc()


class _FreeFactors:
    """Factors of a tangent K with displacements without rigid part.

    ``[K, M Phi; (M Phi)^T, 0] [u; mu] = [p; 0]``. Springs at r unknowns hold the body for the
    factors; a small system takes their forces away again. ``U`` is that of the held body.
    """

    def __init__(self, matrix: Any, free: FreeMotion) -> None:
        import scipy.sparse as sp
        from scipy.linalg import qr

        size, count = free.shapes.shape
        pins = qr(free.shapes.T, mode="r", pivoting=True)[1][:count]
        spring = float(abs(matrix.diagonal()).mean())
        held = np.zeros(size)
        held[pins] = spring
        factors = _factors((matrix + sp.diags_array(held)).tocsc())
        self.U, self._solve, self._pins = factors.U, factors.solve, pins
        self._inertia = free.inertia
        columns = np.zeros((size, 2 * count))
        columns[:, :count] = free.inertia
        columns[pins, np.arange(count, 2 * count)] = spring
        self._columns = factors.solve(columns)
        self._small = np.vstack([free.inertia.T @ self._columns, self._columns[pins]])
        self._small[count:, count:] -= np.eye(count)

    def solve(self, force: Array) -> Array:
        """Displacement (f,) under forces (f,)."""
        u = self._solve(force)
        known = np.append(self._inertia.T @ u, u[self._pins])
        return np.asarray(u - self._columns @ np.linalg.solve(self._small, known))


def _factors(matrix: Any) -> Any:
    """Factors of a tangent, which may be indefinite."""
    from scipy.sparse.linalg import splu

    try:
        return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                    options={"SymmetricMode": True})
    except RuntimeError:  # exactly singular: nothing holds the body
        raise InputError(
            "The tangent stiffness is singular, as nothing holds the body against a motion without "
            "strain; support it by fixed.") from None


def _negative(factors: Any) -> int:
    """Number of negative pivots, which is that of negative eigenvalues of a symmetric matrix."""
    return int(np.count_nonzero(factors.U.diagonal() < 0.0))
