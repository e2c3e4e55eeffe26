"""Orbits of several periods beside a strong resonance of a curve of tori."""

from functools import cached_property

import numpy as np

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.continuation.points import over_first
from fecontact.bifurcation.orbits.collocation import CollocationProblem
from fecontact.bifurcation.orbits.curves.centre_manifold import CentreManifold, Series
from fecontact.bifurcation.orbits.curves.codim2 import orbit_curve
from fecontact.bifurcation.orbits.curves.codim2_forms import agreed
from fecontact.bifurcation.orbits.curves.singularity import of_torus
from fecontact.bifurcation.orbits.motions import PeriodicMotion
from fecontact.core.errors import AnalysisError
from fecontact.core.types import Array
from fecontact.system.fields.vector_field import VectorField

# Step of the differences of the multipliers over both parameters, in widths of the diagram.
_SHIFT = 1e-4
# Newton steps to the orbit beside the point, and their length at its end.
_ITERATIONS, _TOLERANCE = 8, 1e-9
# Distances from the point, in widths of the diagram, at which orbits of its periods are sought.
AWAY = (0.01, 0.03, 0.003)
# Difference of the parts of an orbit of several periods, in its range, that is none.
_SINGLE = 1e-6


class StrongResonance:
    """The orbit at a point 'resonance 1:3' or 'resonance 1:4' of a curve, and those near it.

    With the amplitude z of the vector v of unit mean square of the multiplier exp(2 pi i / q) they
    go along z' = e z + c z |z|^2 + b conj(z)^(q - 1), time in periods, e being zero at the point.

    Attributes
    ----------
    point : BranchPoint
    order : int
        q.
    curve : OrbitCurve
        The curve of tori.
    u : (n,) array
        The orbit.
    names : (str, str)
        The second and the first parameter, as in u.
    widths : (2,) array
        Widths of the diagram in both.
    """

    def __init__(self, field: VectorField, point: BranchPoint, parameter: str, order: int) -> None:
        first = point.branch.parameter_name
        self.point, self.order, self.names = point, order, (parameter, first)
        widths = np.asarray(point.branch.attributes["scales"], dtype=float)[-2:]
        self.widths = widths.copy()
        self.curve, self.u, _ = orbit_curve(
            field, over_first(point, "Neimark-Sacker"), parameter,
            dict(zip(self.names, widths.tolist(), strict=True)), None, "Neimark-Sacker")
        self.root = complex(np.exp(2j * np.pi / order))

    @property
    def orbit(self) -> CollocationProblem:
        """The problem of the orbits."""
        return self.curve.orbit

    @cached_property
    def _form(self) -> tuple[complex, complex, Series]:
        manifold = CentreManifold(self.orbit, self.u, self.orbit.linearise(self.u),
                                  (self.root, self.root.conjugate()))

        def formula(series: Series) -> list[float]:
            b, c = series.term(0, 0, self.order - 1), series.term(0, 2, 1)
            return [b.real, b.imag, c.real, c.imag]

        try:
            found, _, series = agreed(manifold, 3, formula)
        except AnalysisError as error:
            raise AnalysisError(f"{self.point.place} has no normal form. {error}") from error
        return complex(*found[:2]), complex(*found[2:]), series

    @property
    def b(self) -> complex:
        """Coefficient of conj(z)^(q - 1)."""
        return self._form[0]

    @property
    def c(self) -> complex:
        """Coefficient of z |z|^2."""
        return self._form[1]

    @cached_property
    def slopes(self) -> Array:
        """Derivatives (2, 2) of Re e and Im e, in rows, to both parameters in widths."""
        rows = []
        for shift in _SHIFT * np.eye(2):
            up, down = (self._exponent(side * shift) for side in (1.0, -1.0))
            rows.append((up - down) / (2.0 * _SHIFT))
        return np.array([np.real(rows), np.imag(rows)])

    def exponent(self, shift: Array) -> complex:
        """The e of a shift (2,) of both parameters in widths, to first order."""
        return complex(*(self.slopes @ shift))

    def towards(self, e: complex) -> Array:
        """Shift (2,) of both parameters in widths, of length one, along which e has this angle."""
        shift = np.linalg.solve(self.slopes, [e.real, e.imag])
        return shift / np.linalg.norm(shift)

    def motion(self, shift: Array, z: complex) -> PeriodicMotion:
        """So many periods at an amplitude, both parameters moved by a shift (2,) in widths."""
        orbit, u, q = self.orbit, self._at(shift), self.order
        x = orbit.at_gauss_points(orbit.nodes(u))[0]
        series = self._form[2]
        rest = series.states([0.0, 0.0])
        turned = [z * self.root**k for k in range(q)]
        states = np.concatenate([x + series.states([one, one.conjugate()]) - rest
                                 for one in turned])
        period = orbit.period(u)
        times = np.concatenate([(k + orbit.times) * period for k in range(q)])
        forced = 1 if orbit.autonomous else q * orbit.periods
        return PeriodicMotion(np.append(times, times[0] + q * period),
                              np.vstack([states, states[:1]]), q * period, forced,
                              orbit.parameters(u))

    def _exponent(self, shift: Array) -> complex:
        pair = of_torus(self.orbit.linearise(self._at(shift)), float(np.angle(self.root))).pair
        assert pair is not None
        return complex(np.log(pair[0] / self.root))

    def _at(self, shift: Array) -> Array:
        """The orbit with both parameters moved."""
        u, orbit = self.u.copy(), self.orbit
        u[-2:] += shift * self.widths
        for _ in range(_ITERATIONS):
            linearised = orbit.linearise(u)
            step = linearised.at_fixed_parameters().solve(
                np.append(-linearised.residual, [0.0, 0.0]))
            u = u + step
            if float(np.sqrt(orbit.weights() @ step**2)) < _TOLERANCE:
                return u
        raise AnalysisError("The orbit beside the resonance was not found.")


def of_several(at: StrongResonance, shift: Array) -> PeriodicMotion:
    """The orbit of q periods beside the point, with both parameters moved in widths.

    Its |z|^2 is the smallest root R of |e + c R|^2 = |b|^2 R^(q - 2).

    Raises
    ------
    AnalysisError
        If there is none.
    """
    e, q = at.exponent(shift), at.order
    R = _least_square(e, at.b, at.c, q)
    if R is None:
        raise AnalysisError(f"{at.point.place}: there is no orbit of {q} periods to this side of "
                            f"it.")
    rest = e + at.c * R
    return at.motion(shift, complex(np.sqrt(R) * np.exp(1j * np.angle(-at.b / rest) / q)))


def _least_square(e: complex, b: complex, c: complex, q: int) -> float | None:
    """Smallest R > 0 with |e + c R|^2 = |b|^2 R^(q - 2), q = 3 or 4; None if there is none."""
    square = abs(c) ** 2 - (abs(b) ** 2 if q == 4 else 0.0)
    half = (e * c.conjugate()).real - (0.5 * abs(b) ** 2 if q == 3 else 0.0)
    inside = half * half - square * abs(e) ** 2
    if not inside >= 0.0:
        return None
    sum_ = -half - float(np.copysign(np.sqrt(inside), half))
    roots = [abs(e) ** 2 / sum_ if sum_ else 0.0, sum_ / square if square else 0.0]
    return min((root for root in roots if root > 0.0), default=None)


def is_single(point: BranchPoint, order: int) -> bool:
    """Whether an orbit of several periods is one of a single period after all."""
    motion = point.orbit(samples=60 * order + 1)
    part = motion.states[:-1].reshape(order, -1, motion.states.shape[1])
    size = np.ptp(motion.states, axis=0).max()
    return bool(np.abs(part - part[:1]).max() < _SINGLE * size)
