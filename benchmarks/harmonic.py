"""Time to follow frequency responses by harmonic balance, beside plain NumPy and collocation.

Duffing's oscillator and a mass with a Jenkins element, nine harmonics: NumPy has the alternating
frequency and time method with matrices, derivatives in closed form, Newton's method and
pseudo-arclength, for any M, C and K, and no stability, extremes or errors; fecontact makes the
latter two when they are asked for, which is not in these times. Then a body of 20 modes on 40
contact nodes beside collocation, with errors of the states at the first point relative to 25
harmonics. Processor time per point, the least of five runs, of the body of one. Each run has a
system of its own, made before, as M, C and K are for NumPy: all that follows from them is made
anew, and nothing is left from a run before but compiled code. The modes of the body and the motion
from which collocation starts are made before, too.

Usage: python benchmarks/harmonic.py [--quick]
"""

import os
import sys
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from usage import explain

import fecontact as fc
from fecontact.bifurcation import (
    Branch,
    Collocation,
    ContinuationOptions,
    HarmonicBalance,
    contact_field,
    frequency_response,
    orbit_branch,
)
from fecontact.laws import (
    BilateralPolynomial,
    ConstantFriction,
    JenkinsFriction,
    PrescribedForce,
    RoughSurface,
)

Array = np.ndarray
HARMONICS = 9


class Numpy:
    """Harmonic balance of M q'' + C q' + K q + f(q) = e(t) in plain NumPy.

    Coefficients are those of 1, cos, sin, cos 2, ...; each element has a row over the displacements
    and a function of its displacement over the samples that gives force and derivative, the latter
    a matrix (N, L) or, without memory, samples (N,).
    """

    def __init__(self, samples: int, M: Array, C: Array, K: Array, force: Array,
                 elements: list[tuple[Array, Callable[..., tuple[Array, Array]]]]) -> None:
        tau = 2.0 * np.pi * np.arange(samples) / samples
        k = np.arange(1, HARMONICS + 1)
        self.values = np.ones((samples, 2 * HARMONICS + 1))
        self.values[:, 1::2] = np.cos(np.outer(tau, k))
        self.values[:, 2::2] = np.sin(np.outer(tau, k))
        self.projection = 2.0 / samples * self.values.T
        self.projection[0] /= 2.0
        D = np.zeros((2 * HARMONICS + 1,) * 2)
        D[2 * k - 1, 2 * k], D[2 * k, 2 * k - 1] = k, -k
        self.inertia, self.damping = np.kron(D @ D, M), np.kron(D, C)
        self.stiffness = np.kron(np.eye(len(D)), K)
        self.force, self.elements = force, elements

    def equations(self, X: Array) -> tuple[Array, Array]:
        """Residual (n,) and its derivatives (n, n + 1) to coefficients and frequency."""
        q, w, L = X[:-1], X[-1], 2 * HARMONICS + 1
        J = np.empty((len(q), len(X)))
        linear = w * w * self.inertia + w * self.damping + self.stiffness
        R = linear @ q - self.force
        J[:, :-1] = linear
        J[:, -1] = (2.0 * w * self.inertia + self.damping) @ q
        for row, law in self.elements:
            force, slope = law(self.values @ (q.reshape(L, -1) @ row), self.values)
            R += np.outer(self.projection @ force, row).reshape(-1)
            by_row = self.projection @ (slope[:, None] * self.values if slope.ndim == 1 else slope)
            J[:, :-1] += np.kron(by_row, np.outer(row, row)) if len(row) > 1 else by_row
        return R, J

    def follow(self, first: float, last: float, step: float, largest: float) -> Array:
        """Points (k, n + 1) of the branch from rest at one frequency [rad/s] to another."""
        X = np.append(np.zeros(len(self.force)), first)
        for _ in range(30):
            R, J = self.equations(X)
            change = np.linalg.solve(J[:, :-1], -R)
            X[:-1] += change
            if np.linalg.norm(change) < 1e-8 * (1.0 + np.linalg.norm(X)):
                break
        found, tangent, unit = [X], np.append(np.zeros(len(X) - 1), 1.0), np.zeros(len(X))
        unit[-1] = 1.0
        R, J = self.equations(X)
        while X[-1] < last:
            tangent = np.linalg.solve(np.vstack([J, tangent]), unit)
            tangent /= np.linalg.norm(tangent)
            while True:
                Y, needed = X + step * tangent, 0
                for count in range(1, 11):
                    R, J = self.equations(Y)
                    change = np.linalg.solve(np.vstack([J, tangent]),
                                             -np.append(R, tangent @ (Y - X) - step))
                    Y, needed = Y + change, count
                    if np.linalg.norm(change) < 1e-8 * (1.0 + np.linalg.norm(Y)):
                        break
                else:
                    step *= 0.5
                    continue
                break
            X = Y
            found.append(X)
            step = min(step * (1.5 if needed < 4 else 0.8), largest)
        return np.array(found)


def cubic(x: Array, values: Array) -> tuple[Array, Array]:
    """Force and derivative of the cubic spring."""
    return 0.1 * x**3, 0.3 * x**2


def jenkins(x: Array, values: Array) -> tuple[Array, Array]:
    """Force and derivatives (N, L) of a spring of 0.5 N/m that slides at 1 N, in two periods."""
    force, slopes = np.zeros(len(x)), np.zeros_like(values)
    held, slope, here, row = 0.0, np.zeros(values.shape[1]), x[-1], values[-1]
    for k in [*range(len(x)), *range(len(x))]:
        held, slope = held + 0.5 * (x[k] - here), slope + 0.5 * (values[k] - row)
        if abs(held) > 1.0:
            held, slope = np.sign(held), np.zeros_like(slope)
        force[k], slopes[k], here, row = held, slope, x[k], values[k]
    return force, slopes


def duffing_system() -> fc.ContactSystem:
    """X'' + .05 x' + x + .1 x^3 = .18 sin W t."""
    rows = np.zeros((3, 1))
    rows[1, 0] = 1.0
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows},
                                   damping=[[0.05]])
    return fc.ContactSystem(basis, normal=BilateralPolynomial(0.0, 0.1), drive=fc.Drive(
        stiffness_y=1.0, amplitude_y=0.18, frequency_hz=0.13))


def jenkins_system() -> fc.ContactSystem:
    """X'' + .02 x' + x + f = sin W t."""
    rows = np.zeros((3, 1))
    rows[0, 0] = 1.0
    basis = fc.basis_from_matrices([[1.0]], [[0.0]], {"contact": rows[None], "B": rows, "C": rows},
                                   damping=[[0.02]])
    return fc.ContactSystem(
        basis, normal=PrescribedForce(1.0), friction=JenkinsFriction(0.5, 1.0),
        drive=fc.Drive(stiffness_x=1.0, amplitude_x=1.0, frequency_hz=0.175))


def modes_of_body() -> fc.ModalBasis:
    """20 modes of a steel block with 40 contact nodes."""
    shape = fc.ElasticBody(fc.generate(fc.Beam(0.2, 0.02, element_size=0.005)), fc.Material(), 0.01)
    return fc.modal_basis(shape, 20, contact_nodes=40, reduction="vibration", B=(0.0, 0.01),
                          C=(0.1, 0.02), damping=0.02)


def body(basis: fc.ModalBasis) -> fc.ContactSystem:
    """The block on rough ground, pressed and driven to and fro."""
    return fc.ContactSystem(
        basis, normal=RoughSurface(1e6, 1e-4, 300.0),
        friction=ConstantFriction(0.3, smoothing_slope=50.0), load=fc.Load(100.0),
        drive=fc.Drive(stiffness_x=1e5, damping_x=30.0, amplitude_x=2e-4, frequency_hz=80.0))


def least_time(
    task: Callable[[Any], object], rounds: int, made: Callable[[], object] = object,
) -> tuple[float, Any]:
    """Least processor time of a task [s] with what is made before each round; what it returns."""
    best, result = np.inf, None
    for _ in range(rounds):
        given, result = made(), None  # What the last round made is let go of here.
        start = time.process_time()
        result = task(given)
        best = min(best, time.process_time() - start)
    return best, result


def oscillator(name: str, rounds: int, points: int) -> None:
    """One row of the first table."""
    if name == "Duffing":
        system, observe, samples, element = duffing_system, ("B", "y"), 72, cubic
        bounds, damping, force, largest = (0.1, 0.29), 0.05, 0.18, 8.6 / points
    else:
        system, observe, samples, element = jenkins_system, ("B", "x"), 256, jenkins
        bounds, damping, force, largest = (0.16, 0.24), 0.02, 1.0, 16.0 / points
    load = np.zeros(2 * HARMONICS + 1)
    load[2] = force
    spent, found = least_time(lambda _: Numpy(
        samples, np.eye(1), damping * np.eye(1), np.eye(1), load,
        [(np.ones(1), element)]).follow(2.0 * np.pi * bounds[0], 2.0 * np.pi * bounds[1], 0.01,
                                        largest), rounds)
    numpy_each = 1e6 * spent / len(found)
    peak = np.hypot(found[:, 1], found[:, 2]).max()
    print(f"{name:8s} NumPy                    {len(found):5d} points {numpy_each:8.1f} us a point")
    for stability in (None, "transitions"):
        method = HarmonicBalance(HARMONICS, samples=samples, stability=stability)
        for count in (points, 5 * points):
            options = ContinuationOptions(points=10_000, largest_step=4.6 / count
                                          if name == "Duffing" else 4.0 / count, step=1e-3)
            spent, response = least_time(
                lambda made, method=method, options=options: frequency_response(
                    made, bounds, observe=observe, method=method, options=options), rounds, system)
            branch = response.branches[0]
            each = 1e6 * spent / len(branch)
            off = np.abs(response.harmonic(1)).max() / peak - 1.0
            print(f"{name:8s} fecontact {stability or 'no stability':14s} {len(branch):5d} points "
                  f"{each:8.1f} us a point, NumPy over it {numpy_each / each:6.2f}, "
                  f"peak {off:8.1e}")


def largest_error(mine: Branch, exact: Branch, modes: int) -> float:
    """Largest difference of displacements at the first point, relative to their amplitude."""
    one, other = (branch.points[0].orbit(samples=201).states[:, :modes] for branch in (mine, exact))
    return float(np.abs(one - other).max() / np.abs(other - other.mean(axis=0)).max())


def table_of_body(points: int, intervals: tuple[int, ...]) -> None:
    """The second table."""
    basis = modes_of_body()
    options = ContinuationOptions(points=points, largest_step=0.03)

    def response(harmonics: int, stability: str | None, count: int = points) -> Branch:
        return frequency_response(body(basis), (80.0, 320.0), method=HarmonicBalance(
            harmonics, stability=stability), options=ContinuationOptions(
                points=count, largest_step=0.03)).branches[0]

    def collocated(count: int) -> Branch:
        return orbit_branch(
            contact_field(body(basis), ["drive.frequency_hz"]), start,
            method=Collocation(count, state_tolerance=None), bounds=(80.0, 320.0),
            options=options)

    exact = response(25, None, 2)
    start = exact.points[0].orbit(contact_field(body(basis), ["drive.frequency_hz"]))
    for stability in (None, "transitions"):
        spent, branch = least_time(lambda _, stability=stability: response(HARMONICS, stability), 1)
        print(f"harmonic balance {stability or 'no stability':14s} {len(branch):4d} points "
              f"{1e3 * spent / len(branch):7.2f} ms a point, {spent:5.2f} s in all, error "
              f"{largest_error(branch, exact, 20):.1e}", flush=True)
    for count in intervals:
        spent, branch = least_time(lambda _, count=count: collocated(count), 1)
        print(f"collocation      {count:3d} intervals  {len(branch):4d} points "
              f"{1e3 * spent / len(branch):7.2f} ms a point, {spent:5.2f} s in all, error "
              f"{largest_error(branch, exact, 20):.1e}", flush=True)


def main(quick: bool = False) -> None:
    """Print both tables."""
    rounds, points = (1, 100) if quick else (5, 200)
    for name in ("Duffing", "Jenkins"):
        oscillator(name, rounds, points)
    table_of_body(3 if quick else 200, (12,) if quick else (10, 12, 16))


if __name__ == "__main__":
    explain(__doc__)
    main("--quick" in sys.argv)
