"""Quasi-periodic motions beside averaged solutions, runs and orbits by other methods."""

import numpy as np
from comparison import Comparison, comparisons

import fecontact as fc
from fecontact.bifurcation import (
    BranchPoint,
    ContinuationOptions,
    SecondExcitation,
    TorusBalance,
    VectorField,
    contact_field,
    orbit_branch,
    periodic_motion,
    torus_branch,
    torus_motion,
    vector_field,
)
from fecontact.laws import ExponentialFriction, RoughSurface

TURN = 2.0 * np.pi


def section() -> str:
    """One table."""
    rows = closed_form() + van_der_pol() + two_oscillators() + duffing() + friction()
    return f"""## Quasi-periodic motions

Tori are followed by `torus_branch`. The first one has a closed form. Averaged solutions have errors
of the order of eps and of the force. Runs and the Neimark-Sacker point by collocation have only the
errors of their tolerances.

{comparisons(rows)}
"""


def first(field: VectorField, start, name: str, H: int | tuple[int, int], **options) -> BranchPoint:
    """The torus near a start."""
    return torus_branch(field, start, name, method=TorusBalance(H),
                        options=ContinuationOptions(points=1), **options).points[0]


def settled(system, initial, begin: float, end: float, outputs: int):
    """The end of a run."""
    times = np.append(0.0, np.linspace(begin, end, outputs))
    return fc.simulate(system, end, initial=initial, outputs=times, rtol=1e-10).between(begin)


def closed_form() -> list[Comparison]:
    """A plane that turns, with r' = r + r^2 (cos w t - 1): 1 / r is linear.

    The torus of the tutorial of COCO (H. Dankowicz, F. Schilder, Recipes for Continuation, SIAM
    2013).
    """

    def rates(t, x, p, out):
        grows = 1.0 + np.hypot(x[0], x[1]) * (np.cos(p[1] * t) - 1.0)
        out[0] = grows * x[0] - p[0] * x[1]
        out[1] = grows * x[1] + p[0] * x[0]

    w = 1.5
    field = vector_field(rates, {"turn": 1.0, "w": w}, 2, period=lambda p: TURN / p["w"])
    point = first(field, settled(field, [1.0, 0.0], 60.0, 260.0, 4001), "w", (12, 1))
    a = 1.0 / np.sqrt(1.0 + w**2)
    root = np.sqrt(1.0 - a * a)
    return [Comparison("torus of a plane that turns: first harmonic", 1.0 / root,
                       abs(torus_motion(point).harmonic(0, 1)[0])),
            Comparison("torus of a plane that turns: third harmonic beside it",
                       ((1.0 - root) / a) ** 3 / root,
                       abs(torus_motion(point).harmonic(3, 1)[0])),
            Comparison("torus of a plane that turns: smaller multiplier", np.exp(-TURN / w),
                       point.values["multipliers"].min())]


def van_der_pol() -> list[Comparison]:
    """X'' - eps (1 - x^2) x' + x = F cos w t: beside entrainment and far from it."""

    def rates(t, x, p, out):
        out[0] = x[1]
        out[1] = p[0] * (1.0 - x[0] * x[0]) * x[1] - x[0] + p[1] * np.cos(p[2] * t)

    def forced(eps: float, force: float, w: float) -> VectorField:
        return vector_field(rates, {"eps": eps, "F": force, "w": w}, 2,
                            period=lambda p: TURN / p["w"])

    free, locking = 1.0 - 0.1**2 / 16.0, 0.003
    field = forced(0.1, 4.0 * locking, free + 2.0 * locking)
    point = first(field, settled(field, [2.0, 0.0], 600.0, 8000.0, 6000), "w", 6)
    beat = TURN * (point.values["frequency_1"] - point.values["frequency_2"])
    field = forced(0.02, 0.3, 1.3)
    far = torus_motion(first(field, settled(field, [2.0, 0.0], 1000.0, 2000.0, 8001), "w", 4))
    field = forced(0.1, 1.3, 1.3)
    orbits = orbit_branch(field, periodic_motion(field, initial=[1.0, 0.0]), "F",
                          bounds=(0.5, 1.4), direction=-1.0)
    tori = torus_branch(field, orbits.of_kind("Neimark-Sacker")[0], bounds=(0.85, 1.4),
                        method=TorusBalance((4, 3)))
    back = torus_branch(field, tori.points[-1], bounds=(0.8, 1.2), direction=-1.0)
    b = 0.3 / (1.3**2 - 1.0)
    return [Comparison("forced van der Pol, eps = 0.1, F = 0.012: beat at twice the detuning of "
                       "entrainment (Adler)", np.sqrt(3.0) * locking, beat),
            Comparison("forced van der Pol, eps = 0.02, F = 0.3, w = 1.3: free amplitude",
                       np.sqrt(4.0 - 2.0 * b**2), abs(far.harmonic(0, 1)[0])),
            Comparison("forced van der Pol, eps = 0.1, w = 1.3: F where tori end, by averaging",
                       np.sqrt(2.0 * ((1.0 - 1.3**2) ** 2 + (0.1 * 1.3 / 2.0) ** 2)),
                       back.points[-1].parameter),
            Comparison("the same, by the multipliers of orbits (collocation)",
                       orbits.of_kind("Neimark-Sacker")[0].parameter, back.points[-1].parameter)]


def two_oscillators() -> list[Comparison]:
    """Two van der Pol oscillators, not coupled: each has its own frequency and decay."""

    def rates(t, x, p, out):
        out[0] = x[1]
        out[1] = 0.2 * (1.0 - x[0] * x[0]) * x[1] - x[0] + p[0] * (x[2] - x[0])
        out[2] = x[3]
        out[3] = 0.2 * (1.0 - x[2] * x[2]) * x[3] - 2.0 * x[2] + p[0] * (x[0] - x[2])

    field = vector_field(rates, {"coupling": 0.0}, 4)
    times, w = np.linspace(0.0, 400.0, 4001), np.array([1.0, np.sqrt(2.0)])
    guess = np.concatenate([[2.0 * np.cos(one * times), -2.0 * one * np.sin(one * times)]
                            for one in w]).T
    point = first(field, (times, guess), "coupling", 6)
    found = np.sort([TURN * point.values[f"frequency_{k}"] for k in (1, 2)])
    exponent = np.log(point.values["multipliers"].min()) * point.values["frequency_1"]
    return [Comparison(f"two van der Pol oscillators, eps = 0.2: w{k + 1}",
                       one - 0.2**2 / 16.0 / one, value)
            for k, (one, value) in enumerate(zip(w, found, strict=True))] + [
        Comparison("two van der Pol oscillators, eps = 0.2: smallest exponent", -0.2, exponent)]


def duffing() -> list[Comparison]:
    """Two tones of frequencies without a common period, beside a long run."""

    def rates(t, x, p, out):
        out[0] = x[1]
        out[1] = (-0.1 * x[1] - x[0] - 0.5 * x[0] * x[0] * x[0] + 0.4 * np.cos(1.7 * t)
                  + p[0] * np.cos(np.sqrt(2.0) * t + p[1]))

    field = vector_field(rates, {"second": 0.3, "phase": 0.4}, 2, period=TURN / 1.7)
    run = settled(field, [0.0, 0.0], 300.0, 40000.0, 400_001)
    point = first(field, run, "second", 8,
                  second=SecondExcitation("phase", np.sqrt(2.0) / TURN))
    grid = torus_motion(point).grid(200, 200)
    return [Comparison("two-tone Duffing: largest x, of 40,000 s", run.states[:, 0].max(),
                       point.values["maximum"][0]),
            Comparison("two-tone Duffing: mean square of x", np.mean(run.states[:, 0] ** 2),
                       np.mean(grid[:, :, 0] ** 2)),
            Comparison("two-tone Duffing: sum of the exponents, minus the damping", -0.1,
                       np.log(point.values["multipliers"]).sum() * 1.7 / TURN)]


def friction() -> list[Comparison]:
    """The block on wavy ground of `examples/beating_friction.py`."""
    rows = np.zeros((3, 2))
    rows[0, 0] = rows[1, 1] = 1.0
    basis = fc.basis_from_matrices(5.632 * np.eye(2), np.zeros((2, 2)),
                                   {"contact": rows[None], "B": rows, "C": rows})
    system = fc.ContactSystem(
        basis, normal=RoughSurface(10e6, 10e-6, 40.0),
        friction=ExponentialFriction(0.8, 0.55, 50.0, 1e3),
        ground=fc.Ground(speed=20e-3, amplitude=35e-6, wavelength=4.4e-3),
        drive=fc.Drive(stiffness_x=5610.0, damping_x=20.0), load=fc.Load(14.0))
    name = "ground.amplitude"
    high, low = (contact_field(system.with_({name: value}), [name]) for value in (35e-6, 31e-6))
    orbits = orbit_branch(high, periodic_motion(high, transient=60.0), bounds=(32e-6, 38e-6),
                          direction=-1.0)
    run = settled(low.system(), "rest", 60.0, 80.0, 4001)
    tori = torus_branch(low, run, bounds=(30e-6, 38e-6), method=TorusBalance(7))
    return [Comparison("block on wavy ground: height of the waves that entrain it [m], by the "
                       "multipliers of orbits", orbits.of_kind("Neimark-Sacker")[0].parameter,
                       tori.points[-1].parameter)]
