"""Fits of synthetic truths: how often intervals of 95 % cover them, and Bouc-Wen from a swept sine.

1. Loops of Iwan and four-parameter Iwan elements, and the force of a rough surface that is pressed
   and relieved, with noise of 1, 3 and 10 % of the largest force.
2. The motion of a mass with LuGre or Bouc-Wen friction on which a drive pulls, with the same noise.
3. Ring-downs of a mass with Bouc-Wen friction, with noise of 1, 3, 10 % of the first amplitude.
4. The hysteretic system of Noel and Schoukens, m y'' + c y' + k y + z = u with z' = alpha y' - beta
   (gamma |y'| z + delta y' |z|), from a swept sine with noise of 1 %. Its hysteresis has no limit
   (gamma + delta < 0), which BoucWenFriction cannot say: a law of our own does.
5. Time of a fit of five parameters to a backbone: a beam with four-parameter Iwan friction, spring
   and dashpot at its end, frequencies with noise of 0.01 %, damping ratios of 1 %.

Usage: python benchmarks/fit_coverage.py [--quick] [--trials N]

J.-P. Noel, M. Schoukens, Hysteretic benchmark with a dynamic nonlinearity, Workshop on Nonlinear
System Identification Benchmarks (2016).
"""

import sys
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.polynomial import chebyshev
from scipy.interpolate import CubicSpline
from usage import explain

import fecontact as fc
from fecontact.bifurcation import ContinuationOptions
from fecontact.fitting import BackboneData, DecayData, FitData, HistoryData, LoopData
from fecontact.laws import (
    BoucWenFriction,
    FourParameterIwanFriction,
    FrictionLaw,
    IwanFriction,
    LuGreFriction,
    PrescribedForce,
    RoughSurface,
    SweptSine,
    memory_friction_law,
)
from fecontact.measured import AmplitudeCurve, ring_down
from fecontact.study import FitParameter

Array = np.ndarray
ROW = np.array([[1.0], [0.0], [0.0]])
PULL = 1e-3 * np.concatenate([np.linspace(0.0, 1.0, 20), np.linspace(1.0, -1.0, 40)[1:],
                              np.linspace(-1.0, 1.0, 40)[1:]])


def body(mass: float, spring: float, damping: float) -> fc.ModalBasis:
    """A mass on a spring."""
    return fc.basis_from_matrices([[mass]], [[spring]], {"contact": ROW[None], "B": ROW, "C": ROW},
                                  damping=[[damping]])


def coverage(title: str, truth: fc.ContactSystem, ranges: dict[str, FitParameter],
             data: Callable[[np.random.Generator], FitData], trials: int) -> None:
    """Fit data of many draws of noise, and print how many intervals cover the truth.

    Searches begin at the truth, which saves half of their time.
    """
    rng = np.random.default_rng(7)
    ranges = {name: replace(one, start=truth.parameter(name)) for name, one in ranges.items()}
    inside = dict.fromkeys(ranges, 0)
    squares, begin = [], time.perf_counter()
    for _ in range(trials):
        found = fc.fit(truth, ranges, data(rng), exact=False)
        squares.append(found.chi_square / found.freedom)
        for name, (low, high) in found.intervals().items():
            inside[name] += low <= truth.parameter(name) <= high
    shown = ", ".join(f"{name.rpartition('.')[2]} {100.0 * count / trials:.1f} %"
                      for name, count in inside.items())
    print(f"{title}: {trials} trials, covered: {shown}; chi square / freedom "
          f"{np.mean(squares):.3f}; {(time.perf_counter() - begin) / trials:.2f} s a fit",
          flush=True)


def fitted_force(
    title: str, truth: fc.ContactSystem, ranges: dict[str, FitParameter], x: Array, noise: float,
    trials: int, **how: str,
) -> None:
    """Coverage of fits to the force over a displacement x [m]."""
    force = LoopData(x, np.zeros(len(x)), 1.0, **how).predicted(truth)
    deviation = noise * float(np.abs(force).max())
    coverage(f"{title}, noise {100.0 * noise:g} %", truth, ranges, lambda rng: LoopData(
        x, force + deviation * rng.standard_normal(len(force)), deviation, **how), trials)


def loops(noise: float, trials: int) -> None:
    """Loops of an Iwan element."""
    def model(stiffness: float, coefficient: float) -> fc.ContactSystem:
        return fc.ContactSystem(
            body(2.0, 1e4, 0.0), normal=PrescribedForce(50.0),
            friction=IwanFriction(stiffness=stiffness, friction_coefficient=coefficient),
            drive=fc.Drive(stiffness_x=1e6))

    fitted_force("Iwan", model(1e6, 0.4), {
        "friction.stiffness": FitParameter(1e5, 1e7, scale="log"),
        "friction.friction_coefficient": FitParameter(0.05, 2.0, scale="log")}, PULL, noise, trials)


def four_parameters(noise: float, trials: int) -> None:
    """Loops of a four-parameter Iwan element: power, and force at which all of it slides."""
    def model(chi: float, coefficient: float) -> fc.ContactSystem:
        return fc.ContactSystem(
            body(2.0, 1e4, 0.0), normal=PrescribedForce(50.0),
            friction=FourParameterIwanFriction(1e6, coefficient, chi, 0.5),
            drive=fc.Drive(stiffness_x=1e6))

    fitted_force("four-parameter Iwan", model(-0.4, 0.4), {
        "friction.chi": FitParameter(-0.95, -0.01),
        "friction.friction_coefficient": FitParameter(0.05, 2.0, scale="log")},
        0.1 * PULL, noise, trials)


def rough(noise: float, trials: int) -> None:
    """Force of a rough surface that is pressed and relieved."""
    across = np.array([[0.0], [1.0], [0.0]])
    basis = fc.basis_from_matrices([[2.0]], [[1e4]], {
        "contact": across[None], "B": across, "C": across})

    def model(stiffness: float, height: float) -> fc.ContactSystem:
        return fc.ContactSystem(basis, normal=RoughSurface(stiffness, height),
                                drive=fc.Drive(stiffness_y=1e8))

    press = -4e-5 * np.concatenate([np.linspace(0.0, 1.0, 40), np.linspace(1.0, 0.0, 40)[1:]])
    fitted_force("rough surface", model(1e7, 1e-5), {
        "normal.stiffness": FitParameter(1e6, 1e8, scale="log"),
        "normal.roughness_height": FitParameter(1e-6, 1e-4, scale="log")},
        press, noise, trials, along="motion_y")


def motion(
    title: str, truth: FrictionLaw, ranges: dict[str, FitParameter], noise: float, trials: int,
) -> None:
    """Coverage of fits to the motion of a mass with friction that a drive pulls to and fro."""
    def model(law: FrictionLaw) -> fc.ContactSystem:
        return fc.ContactSystem(
            body(2.0, 1e4, 20.0), normal=PrescribedForce(50.0), friction=law,
            drive=fc.Drive(stiffness_x=5e4, amplitude_x=1e-3, frequency_hz=10.0))

    times, rest = np.linspace(0.0, 0.2, 201), np.zeros(2 + truth.memory)
    how = {"initial": rest, "rtol": 1e-6}
    clean = HistoryData(times, np.zeros(len(times)), 1.0, **how).predicted(model(truth))
    deviation = noise * float(np.abs(clean).max())
    coverage(f"{title}, noise {100.0 * noise:g} %", model(truth), ranges,
             lambda rng: HistoryData(times, clean + deviation * rng.standard_normal(len(times)),
                                     deviation, **how), trials)


def bristles(noise: float, trials: int) -> None:
    """Motion with LuGre friction: kinetic coefficient and stiffness of the bristles."""
    def law(coefficient: float, stiffness: float) -> FrictionLaw:
        return LuGreFriction(0.5, coefficient, 1e-2, 2.0, stiffness, 10.0)

    motion("LuGre", law(0.4, 1e4), {
        "friction.kinetic_coefficient": FitParameter(0.05, 0.48, scale="log"),
        "friction.bristle_stiffness": FitParameter(1e3, 1e6, scale="log")}, noise, trials)


def hysteresis(noise: float, trials: int) -> None:
    """Motion with Bouc-Wen friction: coefficient of friction and yield displacement."""
    motion("Bouc-Wen", BoucWenFriction(0.4, 2e-4, 0.6, 1.2), {
        "friction.friction_coefficient": FitParameter(0.05, 2.0, scale="log"),
        "friction.yield_displacement": FitParameter(1e-5, 2e-3, scale="log")}, noise, trials)


@dataclass(frozen=True, eq=False)
class InterpolatedDecay(DecayData):
    """Decays whose curves are polynomials over two parameters, through those of runs.

    Attributes
    ----------
    surface : Surface
        Curves of the model over its parameters.
    """

    surface: "Surface | None" = None

    def at(self, system: fc.ContactSystem, amplitude: Array) -> Array:
        """Frequencies [Hz], then damping ratios."""
        return self.surface.at(system, amplitude)


class Surface:
    """Frequency and damping over amplitude, as Chebyshev polynomials over two parameters.

    Parameters
    ----------
    data : DecayData
        Data whose model gives the curves, at some amplitudes.
    model : ContactSystem
        The model.
    ranges : mapping of dotted name to FitParameter
        Two parameters with logarithmic scale.
    amplitude : (A,) array
        Amplitudes of the data.
    degree : int
        Degree over each parameter.
    """

    def __init__(self, data: DecayData, model: fc.ContactSystem, ranges: dict[str, FitParameter],
                 amplitude: Array, degree: int = 16) -> None:
        self.ranges, self.level = ranges, np.log(amplitude)
        count = degree + 1
        places = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        curves = np.array([[data.at(model.with_({
            name: one.value(0.5 + 0.5 * place) for (name, one), place in zip(
                ranges.items(), both, strict=True)}), amplitude)
            for both in ((x, y) for y in places)] for x in places])
        inverse = np.linalg.inv(chebyshev.chebvander(places, degree))
        self.factors = np.einsum("ix,jy,xyn->ijn", inverse, inverse, curves)

    def at(self, system: fc.ContactSystem, amplitude: Array) -> Array:
        """Frequencies [Hz], then damping ratios over amplitudes."""
        x, y = (chebyshev.chebvander(2.0 * one.place(system.parameter(name)) - 1.0,
                                     len(self.factors) - 1)[0] for name, one in self.ranges.items())
        curves = np.einsum("i,j,ijn->n", x, y, self.factors).reshape(2, -1)
        return CubicSpline(self.level, curves, axis=1)(np.log(amplitude)).ravel()


def decays(noises: Sequence[float], trials: int) -> None:
    """Ring-downs of a mass with Bouc-Wen friction, whose model is interpolated between runs."""
    def model(coefficient: float, deflection: float) -> fc.ContactSystem:
        return fc.ContactSystem(body(2.0, 5e4, 4.0), normal=PrescribedForce(50.0),
                                friction=BoucWenFriction(coefficient, deflection, 0.6, 1.2))

    truth = model(0.3, 4e-4)
    state = np.array([3e-3 * 2.0**0.5, 0.0, 0.0])
    run = fc.simulate(truth, 0.8, initial=state, outputs=4001)
    x = run.displacement("B")[:, 0]
    options = {"window": 6.0, "frequency_hz": 33.0}
    ranges = {"friction.friction_coefficient": FitParameter(0.21, 0.43, scale="log"),
              "friction.yield_displacement": FitParameter(2.4e-4, 6.7e-4, scale="log")}
    data = DecayData(ring_down(run.time, x, **options), state, 0.8, options=options)
    surface = Surface(data, truth, ranges, np.geomspace(1.2e-5, 1.5e-3, 100))
    inner = model(0.31, 3.7e-4)
    off = np.abs(surface.at(inner, data.curve.amplitude) / data.predicted(inner) - 1.0).max()
    print(f"curves over parameters are interpolated to {off:.1e}")
    for noise in noises:
        deviation = noise * float(np.abs(x).max())

        def drawn(rng: np.random.Generator, deviation: float = deviation) -> FitData:
            noisy = x + deviation * rng.standard_normal(len(x))
            return InterpolatedDecay(ring_down(run.time, noisy, **options), state, 0.8,
                                     options=options, surface=surface)

        coverage(f"Bouc-Wen, ring-downs, noise {100.0 * noise:g} %", truth, ranges, drawn, trials)


@memory_friction_law
def unlimited(v, F, z, p, force, rates):
    """R = z, z' = alpha v - beta (gamma |v| z + delta v |z|)."""
    alpha, beta, gamma, delta = p[0], p[1], p[2], p[3]
    force[0], force[1], force[2], force[3] = z[0], 0.0, 0.0, 1.0
    speed, size = abs(v), abs(z[0])
    forward = 1.0 if v >= 0.0 else -1.0
    side = 1.0 if z[0] >= 0.0 else -1.0
    rates[0, 0] = alpha * v - beta * (gamma * speed * z[0] + delta * v * size)
    rates[0, 1] = alpha - beta * (gamma * forward * z[0] + delta * size)
    rates[0, 2] = 0.0
    rates[0, 3] = -beta * (gamma * speed + delta * v * side)


@dataclass(frozen=True)
class UnlimitedBoucWen(FrictionLaw):
    """Bouc-Wen hysteresis without a limit, in the form of Noel and Schoukens, exponent 1.

    Parameters
    ----------
    alpha : float
        Stiffness [N/m].
    beta : float
        Factor of the hysteresis [1/m].
    gamma, delta : float
        Its shape [-].
    """

    kernel: ClassVar = unlimited

    alpha: float
    beta: float
    gamma: float
    delta: float

    @property
    def memory(self) -> int:
        """One internal variable, the force."""
        return 1

    @property
    def state_scale(self) -> np.ndarray:
        """Force of the order met here [N]."""
        return np.ones(1)

    @property
    def velocity_scale(self) -> float:
        """Velocity that changes the force by its scale in 0.1 s."""
        return 10.0 / self.alpha

    def steady_coefficient(self, velocity: np.ndarray) -> np.ndarray:
        """No steady sliding: a limit above all forces met."""
        return np.sign(velocity) * 1e6

    def stick_velocity(self, nodes: int) -> np.ndarray:
        """Velocity (n,) at which nodes count as sticking."""
        return np.full(nodes, self.velocity_scale)

    def sticks(self, slip_velocity, normal_force, friction_force):
        """Nodes never slide freely."""
        return np.ones(np.shape(friction_force), dtype=bool)


def swept(duration: float) -> None:
    """Parameters of the hysteretic system from one swept sine."""
    def model(alpha: float, beta: float, gamma: float, delta: float) -> fc.ContactSystem:
        return fc.ContactSystem(
            body(2.0, 5e4, 10.0), normal=PrescribedForce(1.0),
            friction=UnlimitedBoucWen(alpha, beta, gamma, delta),
            load=fc.Load(forces=[fc.PointLoad("B", "x", signal=SweptSine(
                40.0, 20.0, 50.0, duration))]))

    truth = model(5e4, 1e3, 0.8, -1.1)
    times = np.linspace(0.0, duration, int(750 * duration) + 1)
    # The law gives energy at the turns of its loops.
    warnings.simplefilter("ignore", fc.ModelWarning)
    clean = HistoryData(times, np.zeros(len(times)), 1.0, initial=np.zeros(3), rtol=1e-7).predicted(
        truth)
    noise = 0.01 * float(np.abs(clean).max())
    x = clean + noise * np.random.default_rng(3).standard_normal(len(times))
    data = HistoryData(times, x, noise, initial=np.zeros(3), rtol=1e-7)
    begin = time.perf_counter()
    # beta enters only through its products with gamma and delta: it is held.
    found = fc.fit(model(4e4, 1e3, 0.5, -0.5), {
        "friction.alpha": FitParameter(2e4, 1e5, 4.5e4, "log"),
        "friction.gamma": (0.0, 2.0), "friction.delta": (-2.0, 0.0)}, data, exact=False)
    print(f"swept sine of {duration:g} s, {len(times)} samples: chi square / freedom "
          f"{found.chi_square / found.freedom:.3f}, {time.perf_counter() - begin:.1f} s")
    for name, truth_value in (("alpha", 5e4), ("gamma", 0.8), ("delta", -1.1)):
        low, high = found.intervals()[f"friction.{name}"]
        print(f"  {name} {found[f'friction.{name}']:.6g}, 95 % from {low:.6g} to {high:.6g}; "
              f"truth {truth_value:g}")
    both = fc.fit(model(5e4, 1e3, 0.8, -1.1), {
        "friction.beta": FitParameter(100.0, 1e4, 1e3, "log"), "friction.gamma": FitParameter(
            0.08, 8.0, 0.8, "log"), "friction.delta": (-11.0, 0.0)}, data, exact=False)
    print(f"  with beta too: {'; '.join(both.not_found) or 'all found'}")


def backbone() -> None:
    """Five parameters from a backbone of a beam over three decades of amplitude."""
    mesh = fc.generate(fc.Beam(length=0.3, height=0.02, element_size=0.01))
    beam = fc.ElasticBody(mesh, fc.Material(), 0.03, fixed={"left": "xy"})
    basis = fc.modal_basis(beam, modes=4, contact_nodes=4, B=(0.3, 0.01), C=(0.2, 0.01),
                           damping=0.002)
    truth = fc.ContactSystem(
        basis, normal=PrescribedForce(400.0),
        friction=FourParameterIwanFriction(2e7, 0.4, -0.5, 0.5),
        drive=fc.Drive(stiffness_y=1e5, damping_y=3.0))
    A = np.geomspace(1e-6, 1e-3, 20)
    how = {"component": "y", "options": ContinuationOptions(step=0.1, largest_step=0.2)}
    clean = BackboneData(AmplitudeCurve(A, np.ones(20), np.ones(20)), **how).predicted(truth)
    rng = np.random.default_rng(5)
    spread = np.concatenate([1e-4 * clean[:20], 0.01 * clean[20:]])
    y = clean + spread * rng.standard_normal(40)
    data = BackboneData(AmplitudeCurve(A, y[:20], y[20:], spread[:20], spread[20:]), **how)
    begin, used = time.perf_counter(), time.process_time()
    found = fc.fit(truth, {
        "friction.stiffness": FitParameter(2e6, 2e8, 1e7, "log"),
        "friction.friction_coefficient": FitParameter(0.1, 1.0, 0.3),
        "friction.chi": FitParameter(-0.9, -0.1, -0.3),
        "drive.stiffness_y": FitParameter(2e4, 5e5, 8e4, "log"),
        "drive.damping_y": FitParameter(0.5, 20.0, 2.0, "log")}, data)
    print(f"backbone, five parameters: {time.perf_counter() - begin:.1f} s, processor time "
          f"{time.process_time() - used:.1f} s, {found.starts[0].evaluations} evaluations, chi "
          f"square / freedom {found.chi_square / found.freedom:.3f}")
    for name, (low, high) in found.intervals().items():
        print(f"  {name} {found[name]:.4g}, 95 % from {low:.4g} to {high:.4g}; truth "
              f"{truth.parameter(name):g}")
    for note in found.notes:
        print(f"  {note}")


def main() -> None:
    quick = "--quick" in sys.argv
    trials = int(sys.argv[sys.argv.index("--trials") + 1]) if "--trials" in sys.argv else (
        4 if quick else 1000)
    for noise in ((0.03,) if quick else (0.01, 0.03, 0.1)):
        for case in (loops, four_parameters, rough, bristles, hysteresis):
            case(noise, trials)
    decays((0.03,) if quick else (0.01, 0.03, 0.1), 2 if quick else trials)
    swept(1.0 if quick else 3.0)
    if not quick:
        backbone()


if __name__ == "__main__":
    explain(__doc__)
    main()
