"""How hard to press a friction damper: resonance of a beam over the normal load of a block.

A block rubs on the end of a cantilever; a spring along the beam's motion holds it. Without load the
beam resonates freely; pressed hard the block moves with it, and the beam resonates at a higher
frequency with the spring. Between the two friction takes most energy: for a force F at the damper
and its spring k, one harmonic and no other damping give at resonance

    4 S (A - S / k) = pi F A,

with the friction S = mu N: A is least, pi F / k, at S = pi F / 2.

Usage: python friction_damper.py [--quick]
"""

import sys

import numpy as np

import fecontact as fc
from fecontact.analysis import receptance
from fecontact.fem import pair_faces
from fecontact.integrate import strobe
from fecontact.laws import ConstantFriction, Harmonic, LinearContact
from fecontact.reduction import Spring, reduce_bodies

LENGTH, HEIGHT = 0.3, 0.01
FORCE, SPRING, COEFFICIENT, RATIO = 1.0, 2e4, 0.3, 0.005  # N, N/m, friction and modal damping
BEST = 0.5 * np.pi * FORCE / COEFFICIENT  # classical estimate of the best normal load [N]
KEPT = 16  # states of the last period


def damped_beam(load: float, frequency_hz: float = 100.0, force: float = FORCE) -> fc.ContactSystem:
    """The beam with the block pressed on its end [N], excited at its end; no load: held off."""
    size = HEIGHT / 4.0
    bodies = {
        "beam": fc.ElasticBody(fc.generate(fc.Beam(LENGTH, HEIGHT, 2.0 * size)), thickness=0.02,
                               fixed={"left": "xy"}),
        "block": fc.ElasticBody(fc.generate(fc.Block(size, HEIGHT, element_size=size)).placed(
            (LENGTH, 0.0)), fc.Material.named("aluminium"), thickness=0.005),
    }
    end, back = (LENGTH, 0.5 * HEIGHT), (LENGTH + size, 0.5 * HEIGHT)
    face = pair_faces(bodies, "block.left", "beam.right", nodes=2)
    links = [Spring("block.back", direction=(1, 0), stiffness=1e3, damping=1.0, preload=load),
             Spring("block.front", direction=(0, 1), stiffness=SPRING, damping=0.3)]
    points = {"beam": {"end": end}, "block": {"front": end, "back": back}}
    bases = reduce_bodies(bodies, [face], links, modes={"beam": 4, "block": 3}, damping=RATIO,
                          each={name: {"points": given} for name, given in points.items()})
    return fc.ContactSystem(
        bodies=bases, links=links, interfaces=[fc.Interface(
            "damper", face, LinearContact(2e7, damping=100.0),
            ConstantFriction(COEFFICIENT, smoothing_slope=1e4), gap=0.0 if load else 1e-3)],
        load=fc.Load(forces=(fc.PointLoad("beam.end", "y", signal=Harmonic(
            force, frequency_hz)),)))


def amplitudes(load: float, frequencies: np.ndarray, periods: int) -> np.ndarray:
    """Amplitudes of the first harmonic of the beam's end [m] after some periods from rest."""
    systems = [damped_beam(load, frequency) for frequency in frequencies]
    found = strobe(systems, transient_periods=KEPT * periods, keep=KEPT,
                   period=1.0 / (KEPT * np.asarray(frequencies)))
    basis = systems[0].basis
    end = found.states[:, :, : basis.modes] @ basis.point_row("beam.end", "y")
    return 2.0 / KEPT * np.abs(end @ np.exp(-2j * np.pi * np.arange(KEPT) / KEPT))


def resonance(load: float, near: float, columns: int = 9) -> tuple[float, float]:
    """Resonance frequency [Hz] and amplitude [m] within 3 % of a frequency, from a sweep.

    A parabola goes through the logarithms of the three highest amplitudes.
    """
    frequencies = near * np.linspace(0.97, 1.03, columns)
    found = amplitudes(load, frequencies, 30)
    top = int(np.clip(found.argmax(), 1, columns - 2))
    part = slice(top - 1, top + 2)
    a, b, c = np.polyfit(frequencies[part] - frequencies[top], np.log(found[part]), 2)
    return float(frequencies[top] - 0.5 * b / a), float(np.exp(c - 0.25 * b * b / a))


def limit(load: float) -> tuple[float, float]:
    """Resonance frequency and amplitude of linear vibrations: of the free or the stuck beam."""
    frequencies = np.linspace(85.0, 120.0, 14_001)
    values = receptance(damped_beam(load), frequencies, [("beam.end", "y")],
                        linearised_at="rest").magnitude[:, 0, 0]
    top = values.argmax()
    return float(frequencies[top]), float(FORCE * values[top])


def estimate(loads: np.ndarray, loss: float = 0.0) -> np.ndarray:
    """Amplitude at resonance of one harmonic; ``loss`` is that of other damping, F / A [N/m]."""
    S = COEFFICIENT * np.asarray(loads)
    # 4 S (A - S / k) + pi loss A^2 = pi F A
    excess = 4.0 * S - np.pi * FORCE
    four = np.maximum(excess**2 + 16.0 * np.pi * loss * S**2 / SPRING, 0.0)
    with np.errstate(divide="ignore"):
        return 8.0 * S**2 / SPRING / (excess + np.sqrt(four))


def between(loads: np.ndarray, amplitude: np.ndarray, free: float, stuck: float) -> np.ndarray:
    """Resonance frequencies [Hz] of one harmonic, where the damper slips in part of each period."""
    angle = np.arccos(1.0 - 2.0 * COEFFICIENT * loads / (SPRING * amplitude))
    part = (angle - 0.5 * np.sin(2.0 * angle)) / np.pi
    return np.sqrt(free**2 + part * (stuck**2 - free**2))


def best(loads: np.ndarray, amplitude: np.ndarray) -> float:
    """Load of the least amplitude [N], from the parabola through three points in logarithms."""
    k = int(np.clip(np.argmin(amplitude), 1, len(loads) - 2))
    x = np.log(loads[k - 1 : k + 2] / loads[k])
    a, b, _ = np.polyfit(x, np.log(amplitude[k - 1 : k + 2]), 2)
    return float(loads[k] * np.exp(-0.5 * b / a))


def main(quick: bool = False) -> None:
    """Prints limits and optimum."""
    free, stuck = limit(0.0), limit(100.0 * BEST)
    for name, (frequency, amplitude) in (("free", free), ("stuck", stuck)):
        print(f"{name}: resonance at {frequency:.2f} Hz, {1e6 * amplitude:.1f} um")
    loss = FORCE / np.sqrt(free[1] * stuck[1])
    ratios = np.array([0.8, 1.0, 1.3]) if quick else np.array(
        [0.6, 0.7, 0.8, 0.9, 1.0, 1.15, 1.3, 1.6, 2.0, 2.5])
    near = between(ratios * BEST, estimate(ratios * BEST, loss), free[0], stuck[0])
    found = np.array([resonance(ratio * BEST, guess, 5 if quick else 9)
                      for ratio, guess in zip(ratios, near, strict=True)])
    for ratio, (frequency, amplitude) in zip(ratios, found, strict=True):
        print(f"{ratio * BEST:6.3f} N: {frequency:.2f} Hz, {1e6 * amplitude:.1f} um, "
              f"estimate {1e6 * estimate(ratio * BEST, loss):.1f} um")
    print(f"best load {best(ratios * BEST, found[:, 1]):.2f} N, estimate {BEST:.2f} N")


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
