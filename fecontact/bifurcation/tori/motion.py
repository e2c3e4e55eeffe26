"""Quasi-periodic motions of branches of tori."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.bifurcation.continuation.point import BranchPoint
from fecontact.bifurcation.harmonic.series import functions_at, turned
from fecontact.bifurcation.tori.series import complex_coefficients, on_lines, orders
from fecontact.core.checks import as_count, as_floats, require_kind
from fecontact.core.errors import InputError
from fecontact.core.read_only import read_only_arrays
from fecontact.core.types import Array, ArrayLike
from fecontact.core.units import Summarised


@read_only_arrays
@dataclass(frozen=True, eq=False, repr=False)
class TorusMotion(Summarised):
    r"""A quasi-periodic motion x(t) = X(2 pi f1 t, 2 pi f2 t).

    .. math:: X(\theta_1, \theta_2) = \sum_k \mathrm{Re} (X_k e^{i (k_1 \theta_1 + k_2 \theta_2)})

    Attributes
    ----------
    frequencies : (2,) array
        f1 and f2 [Hz]; f1 is that of the first excitation, or of the orbit that the torus came
        from.
    harmonics : (int, int)
        H1 and H2.
    coefficients : (L, d) array
        Cosine and sine coefficients of all states; :meth:`harmonic` gives those of one k.
    state_names : tuple of str
        Names (d,) of the states.
    """

    frequencies: Array
    harmonics: tuple[int, int]
    coefficients: Array
    state_names: tuple[str, ...]

    def summary(self) -> list[tuple[str, str]]:
        """Frequencies, and the largest harmonics of the first state."""
        sizes = [(abs(self.harmonic(*k)[0]), tuple(k)) for k in orders(*self.harmonics).tolist()]
        sizes.sort(reverse=True)
        largest = ", ".join(f"{size:.4g} at {k}" for size, k in sizes[:4])
        return [("frequencies", " and ".join(f"{f:.7g} Hz" for f in self.frequencies)),
                ("harmonics", f"{self.harmonics[0]} and {self.harmonics[1]}"),
                (f"largest of {self.state_names[0]}", largest)]

    def harmonic(self, first: int, second: int) -> NDArray[np.complex128]:
        """Coefficients X_k (d,) of k = (first, second), of the frequency k1 f1 + k2 f2.

        X_0 is the mean, |X_k| an amplitude in the unit of the state; zero beyond H1 and H2.
        """
        k = orders(*self.harmonics)
        for sign in (1, -1):
            place = np.flatnonzero((k == [sign * first, sign * second]).all(axis=1))
            if len(place):
                at = 2 * int(place[0])
                if not at:
                    return self.coefficients[0] + 0j
                return np.asarray(self.coefficients[at - 1] - sign * 1j * self.coefficients[at])
        return np.zeros(self.coefficients.shape[1], dtype=complex)

    def states(self, times: ArrayLike) -> Array:
        """States (k, d) at times (k,) [s]."""
        t = as_floats(times, "times")
        angles = 2.0 * np.pi * np.outer(t, orders(*self.harmonics)[1:] @ self.frequencies)
        return np.asarray(functions_at(angles) @ self.coefficients)

    def grid(self, first: int = 64, second: int = 64) -> Array:
        """States (first, second, d) at equidistant theta1 and theta2 from 0 on."""
        count = as_count(first, "grid: first"), as_count(second, "grid: second")
        if count[1] < 2 * self.harmonics[1] + 1:
            raise InputError(f"grid: second = {second!r} must be at least "
                             f"{2 * self.harmonics[1] + 1}, for {self.harmonics[1]} harmonics.")
        c = complex_coefficients(self.coefficients, *self.harmonics)
        return on_lines(c, np.arange(count[0]) / count[0], count[1], 0.0).swapaxes(0, 1)

    def section(self, samples: int = 200) -> Array:
        """States (samples, d) on the closed curve theta1 = 0: the invariant curve of the Poincare
        map over one period 1 / f1.
        """
        return self.grid(1, max(as_count(samples, "section: samples"),
                                2 * self.harmonics[1] + 1))[0]


def torus_motion(point: BranchPoint) -> TorusMotion:
    """The motion of a point of a branch of tori; see :func:`fecontact.bifurcation.torus_branch`.

    Raises
    ------
    InputError
        If the point is no torus.
    """
    require_kind("torus_motion", BranchPoint, point=point)
    if not point.is_torus:
        raise InputError(f"{point.place} is no torus; take a point of torus_branch(...).")
    known = point.branch.attributes
    first, second = (int(H) for H in known["torus_harmonics"])
    names, m = tuple(map(str, known["state_names"])), int(known["torus_displacements"])
    k = orders(first, second)
    c = int(known.get("torus_memory", 0))
    X = point.u[: (2 * len(k) - 1) * (len(names) - m - c)].reshape(2 * len(k) - 1, -1)
    z = np.asarray(point.values["memory"]) if c else np.zeros((len(X), 0))
    frequencies = np.array([point.values["frequency_1"], point.values["frequency_2"]], dtype=float)
    speeds = turned(X[:, :m], 2.0 * np.pi * k @ frequencies)
    return TorusMotion(frequencies, (first, second),
                       np.concatenate([X[:, :m], speeds, X[:, m:], z], axis=1), names)
