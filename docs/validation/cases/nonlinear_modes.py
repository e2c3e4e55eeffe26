"""Nonlinear modes of a beam with a friction damper, and of two masses with a hardening spring.

A damper on the end of a cantilever sticks in small vibrations and slides in large ones: the first
mode loses frequency over its amplitude, and its damping has a maximum. What the mode says of
frequency and damping is compared with a free decay, and the peaks of forced responses with those
that follow from the mode. The damper's best normal load for a force F is pi F / 2 divided by its
friction coefficient, which the curve of resonances over the load shows. The two masses have an
internal resonance: at a third of its frequency the second mode takes the motion over.

Usage: python nonlinear_modes.py [FOLDER] [--quick]
"""

import sys
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    ModeResponse,
    NonlinearMode,
    frequency_response,
    mode_response,
    nonlinear_mode,
    resonance_curve,
)
from fecontact.plot import COLOURS, new_figure
from fecontact.reduction import PolynomialSpring, point_masses

LENGTH, HEIGHT = 0.3, 0.01
STIFFNESS, COEFFICIENT, LOAD, RATIO = 2000.0, 0.4, 0.5, 5e-4  # N/m, -, N, modal damping
FORCES = [0.05, 0.1, 0.15]  # N, at the end
FREQUENCY = "load.forces.0.signal.frequency_hz"
AMPLITUDE = "load.forces.0.signal.amplitude"


def damped_beam(force: float = FORCES[0]) -> fc.ContactSystem:
    """A cantilever in three modes; the contact node is its end, moving across the beam."""
    body = fc.ElasticBody(fc.generate(fc.Beam(LENGTH, HEIGHT, 0.5 * HEIGHT)), thickness=0.02,
                          fixed={"left": "xy"})
    beam = fc.modal_basis(body, 3, contact_nodes=2, points={"end": (LENGTH, 0.5 * HEIGHT)})
    row = np.zeros((3, beam.modes))
    row[0] = beam.point_row("end", "y")
    w = beam.angular_frequencies
    basis = fc.basis_from_matrices(np.eye(beam.modes), np.diag(w**2),
                                   {"contact": row[None], "B": row},
                                   damping=np.diag(2.0 * RATIO * w))
    return fc.ContactSystem(
        basis, normal=fc.laws.PrescribedForce(LOAD),
        friction=fc.laws.JenkinsFriction(STIFFNESS, COEFFICIENT),
        load=fc.Load(forces=(fc.PointLoad("B", "x", signal=fc.laws.Harmonic(
            force, beam.frequencies_hz[0])),)))


def two_masses() -> fc.ContactSystem:
    """Two masses of 1 kg on three springs of 1 N/m, the first of which hardens."""
    up = (0.0, 1.0)
    return fc.ContactSystem(
        bodies={"a": point_masses({"p": 1.0}), "b": point_masses({"p": 1.0})},
        links={"a": PolynomialSpring("a.p", None, 1.0, 0.5, direction=up),
               "b": PolynomialSpring("b.p", None, 1.0, direction=up),
               "ab": PolynomialSpring("a.p", "b.p", 1.0, direction=up)})


def decay(system: fc.ContactSystem, mode: NonlinearMode, periods: int) -> np.ndarray:
    """Amplitude [m], frequency [Hz] and damping ratio (3, k) of a free decay, over five periods."""
    free = system.with_(load=fc.Load())
    run = fc.simulate(free, periods / mode.frequency_hz[-1],
                      initial=mode.orbit(len(mode) - 1).states[0], rtol=1e-8,
                      outputs=100 * periods + 1)
    x = run.displacement("B")[:, 0]
    top = np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:])) + 1
    before, at, after = x[top - 1], x[top], x[top + 1]
    off = 0.5 * (before - after) / (before - 2.0 * at + after)
    peak, time = at - 0.25 * (before - after) * off, run.time[top] + off * run.time[1]
    ratio = np.log(peak[:-5] / peak[5:]) / (10.0 * np.pi)
    return np.array([np.sqrt(peak[:-5] * peak[5:]), 5.0 / (time[5:] - time[:-5]), ratio])


def draw(mode: NonlinearMode, seen: np.ndarray, path: Path) -> None:
    """The mode of the beam, with the free decay upon it."""
    figure = fc.plot.plot_nonlinear_mode(mode)
    for axes, found in zip(figure.axes, seen[1:], strict=True):
        axes.plot(seen[0], found, ".", color=COLOURS[1], markersize=4.0)
    figure.savefig(path)


def draw_responses(found: ModeResponse, exact: fc.bifurcation.FrequencyResponse,
                   mode: NonlinearMode, path: Path) -> None:
    """Responses of harmonic balance, those of the mode (circles), and its backbone."""
    with new_figure(9.0, 5.0, path) as figure:
        axes = figure.subplots()
        for level, colour in zip(range(len(exact.levels)), COLOURS, strict=False):
            axes.plot(exact.branches[level].parameter, 1e3 * exact.amplitude(level), color=colour,
                      label=f"{exact.levels[level]:g} N")
            axes.plot(found.frequency_hz(level), 1e3 * found.amplitude(level), "o", color=colour,
                      markersize=3.5, markerfacecolor="white", markevery=9)
        axes.plot(mode.frequency_hz, 1e3 * mode.amplitude, ":", color="#303030", label="mode")
        axes.set(xlabel="frequency [Hz]", ylabel="amplitude of the end [mm]",
                 xlim=(90.0, 98.0), ylim=(0.0, 1.1e3 * found.peak(len(exact.levels) - 1).amplitude))
        axes.legend()


def main() -> None:
    """Prints modes and resonances; pictures in the folder."""
    quick = "--quick" in sys.argv
    given = [word for word in sys.argv[1:] if not word.startswith("--")]
    folder = Path(given[0] if given else ".")
    folder.mkdir(parents=True, exist_ok=True)
    system, method = damped_beam(), HarmonicBalance(3 if quick else 5, 256)
    mode = nonlinear_mode(system, (2e-5, 3e-3), method=method)
    print(f"beam: {mode.frequency_hz[0]:.3f} Hz sticking, {mode.frequency_hz[-1]:.3f} Hz sliding, "
          f"damping ratio up to {mode.damping_ratio.max():.5f}")
    seen = decay(system, mode, 60 if quick else 160)
    slides = seen[0] > 4e-4
    off = [np.abs(seen[k][slides] / np.interp(seen[0][slides], mode.amplitude, known) - 1.0).max()
           for k, known in ((1, mode.frequency_hz), (2, mode.damping_ratio))]
    print(f"free decay: frequency off by {100.0 * off[0]:.4f} %, damping by {100.0 * off[1]:.2f} %")
    draw(mode, seen, folder / "damped_beam_mode.png")
    levels = {AMPLITUDE: FORCES[1:2] if quick else FORCES}
    found = mode_response(mode, system, levels=levels, frequency=FREQUENCY)
    exact = frequency_response(system, (89.0, 99.0), FREQUENCY, levels=levels, method=method)
    for level, force in enumerate(exact.levels):
        peak = found.peak(level)
        print(f"{force:5.2f} N: peak {1e3 * exact.amplitude(level).max():.4f} mm, of the mode "
              f"{1e3 * peak.amplitude:.4f} mm at {peak.frequency_hz:.3f} Hz")
    draw_responses(found, exact, mode, folder / "damped_beam_responses.png")
    curve = resonance_curve(
        damped_beam(FORCES[1]), (0.3, 0.8), "normal.force", (89.0, 102.0), frequency=FREQUENCY,
        condition="phase", method=method, options=ContinuationOptions(points=80))
    print(f"best load {curve.optimum().parameter:.4f} N, classical estimate "
          f"{0.5 * np.pi * FORCES[1] / COEFFICIENT:.4f} N")
    masses = nonlinear_mode(two_masses(), (1e-2, 200.0), observe=("b.p", "y"),
                            method=HarmonicBalance(15 if quick else 25))
    third = np.abs(masses.coordinates(3)[:, 0] / masses.coordinates(1)[:, 0])
    print(f"two masses: internal resonance at {masses.frequency_hz[third.argmax()]:.4f} Hz")
    fc.plot.plot_nonlinear_mode(masses, path=folder / "internal_resonance.png")


if __name__ == "__main__":
    main()
