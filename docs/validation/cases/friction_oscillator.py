"""A block on a moving belt, held by a spring whose end swings: Sextro, section 4.3.

With two modes (rigid along and across the belt) the motion is one loop of stick and slip in the
phase plane. A third, elastic mode vibrates at the drive after each slip; waves of the belt make
slips of many lengths, whether the contact force is vertical, as in the source, or normal to the
slopes. So do a wave spectrum and a coefficient of friction that varies along the
belt. At last the block is a soft finite-element body, whose face sticks and slips in parts.

The source prints neither the third mode nor where B is: here it has 30 Hz, and amplitudes of 0.5
at B and -0.5 at the contact, relative to the rigid mode.

Usage: python friction_oscillator.py [FOLDER] [--quick]   (half a minute; prints, draws)
"""

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import fecontact as fc
from fecontact.analysis import Peak, amplitude_spectrum, periodicity
from fecontact.laws import (
    ExponentialFriction,
    FourierSeries,
    PrescribedForce,
    RandomRoughness,
    RoughSurface,
)

MASS, BELT_SPEED, NORMAL_FORCE = 5.632, 1e-3, 14.0  # kg, m/s, N
DRIVE_HZ = 13.8 / (2.0 * math.pi)  # 13.8 rad/s in the source
PERIOD = 1.0 / DRIVE_HZ
ELASTIC_HZ, ELASTIC_DAMPING, AT_DRIVE, AT_CONTACT = 30.0, 0.01, 0.5, -0.5

LAWS: dict[str, Any] = {
    "normal": RoughSurface(stiffness=10e6, roughness_height=10e-6, damping=40.0),
    "friction": ExponentialFriction(static_coefficient=0.8, kinetic_coefficient=0.55,
                                       decay=1000.0, smoothing_slope=1e6),
    "drive": fc.Drive(stiffness_x=5610.0, damping_x=0.768, amplitude_x=0.5e-3,
                      frequency_hz=DRIVE_HZ),
    "load": fc.Load(normal=NORMAL_FORCE),
}
EVEN = fc.Ground(speed=BELT_SPEED)
# The source keeps the contact force vertical; "surface" makes it normal to the slope.
WAVY = fc.Ground(speed=BELT_SPEED, amplitude=200e-6, wavelength=2.5e-3, normal="vertical")
INCLINED = replace(WAVY, normal="surface")


def basis(modes: int) -> fc.ModalBasis:
    """One point mass with 1 (along the belt), 2 (and across it) or 3 (and elastic) modes."""
    w = np.zeros(modes)
    T = np.zeros((3, 3, modes))
    T[:, 0, 0] = 1.0 / math.sqrt(MASS)
    if modes > 1:
        T[:, 1, 1] = 1.0 / math.sqrt(MASS)
    if modes > 2:
        w[2] = 2.0 * math.pi * ELASTIC_HZ
        T[0, 0, 2], T[2, 0, 2] = (part / math.sqrt(MASS) for part in (AT_DRIVE, AT_CONTACT))
    return fc.ModalBasis(w, np.diag(2.0 * ELASTIC_DAMPING * w), T, np.zeros((3, 2)), [1.0])


def oscillator(modes: int, ground: fc.Ground = EVEN, **laws: Any) -> fc.ContactSystem:
    """The oscillator on a belt."""
    return fc.ContactSystem(basis(modes), **{**LAWS, "ground": ground, **laws})


def prescribed(modes: int = 1) -> fc.ContactSystem:
    """The normal force of the static equilibrium, prescribed, without a mode across the belt."""
    force = fc.equilibrium(oscillator(2)).normal_force[0]
    return oscillator(modes, normal=PrescribedForce(float(force)), load=fc.Load())


def spectrum_of_waves(seed: int = 2) -> fc.Ground:
    """Belt with a wave spectrum down to waves of 1 mm, half as steep as the single wave."""
    return fc.Ground(speed=BELT_SPEED, normal="vertical", profile=RandomRoughness(
        rms_height=60e-6, hurst_exponent=1.0, roll_off_wavelength=5e-3,
        cut_off_wavelength=1e-3, length=50e-3, seed=seed))


def fourier_waves() -> fc.Ground:
    """Belt with four waves of a Fourier series."""
    return fc.Ground(speed=BELT_SPEED, normal="vertical", profile=FourierSeries(
        wavelength=5e-3, amplitudes=(100e-6, 150e-6, 40e-6, 20e-6), phases=(0.3, 0.0, 2.0, 4.0)))


def random_friction(seed: int = 1) -> fc.Ground:
    """Level belt whose coefficient of friction varies at random, by 8 % in the mean square."""
    return fc.Ground(speed=BELT_SPEED, friction_variation=RandomRoughness(
        rms_height=0.08, hurst_exponent=0.8, roll_off_wavelength=5e-3, cut_off_wavelength=0.5e-3,
        length=50e-3, seed=seed))


CASES = {
    "b: two modes": lambda: oscillator(2),
    "c: three modes": lambda: oscillator(3),
    "d: three modes, waves": lambda: oscillator(3, WAVY),
    "three modes, inclined force": lambda: oscillator(3, INCLINED),
    "three modes, four waves": lambda: oscillator(3, fourier_waves()),
    "three modes, wave spectrum": lambda: oscillator(3, spectrum_of_waves()),
    "three modes, random friction": lambda: oscillator(3, random_friction()),
}


def settled(system: fc.ContactSystem, skip: int = 40, periods: int = 100, outputs: int = 400,
            **options: Any) -> fc.Trajectory:
    """Some periods of the drive after those of the transients."""
    times = np.concatenate([[0.0], np.linspace(skip, skip + periods, periods * outputs + 1)
                            * PERIOD])
    return fc.simulate(system, times[-1], outputs=times, **options).between(skip * PERIOD)


class Slip(NamedTuple):
    """A whole slip of the contact: start and duration [s], distance on the belt [m]."""

    start: float
    duration: float
    distance: float


def slips(run: fc.Trajectory) -> list[Slip]:
    """The slips of a run, those under way at its ends left out, and creep of less than 1 um."""
    sliding = run.contact_state[:, 0] == fc.ContactState.SLIP
    change = np.flatnonzero(sliding[1:] != sliding[:-1]) + 1
    begins = [k for k in change if sliding[k]]
    found = []
    for first in begins:
        later = change[change > first]
        if len(later):
            part = slice(first, later[0] + 1)
            distance = -np.trapezoid(run.slip_velocity[part, 0], run.time[part])
            found.append(Slip(float(run.time[first]), float(np.ptp(run.time[part])),
                              float(distance)))
    return [slip for slip in found if slip.distance > 1e-6]


def different(lengths: NDArray[np.float64], part: float = 0.02) -> int:
    """Number of different lengths, alike within ``part`` of the longest."""
    count, begin = 0, -math.inf
    for length in np.sort(lengths):
        if length > begin + part * lengths.max():
            count, begin = count + 1, length
    return count


def ringing(run: fc.Trajectory, point: str | int = "B") -> Peak:
    """Strongest vibration above 10 Hz of a point in the longest stick of a run."""
    sticking = run.contact_state[:, 0] == fc.ContactState.STICK
    edges = np.flatnonzero(np.diff(np.concatenate([[0], sticking.astype(int), [0]])))
    first, last = max(zip(edges[::2], edges[1::2], strict=True), key=lambda ends: np.diff(ends))
    t, v = run.time[first:last], run.velocity(point)[first:last, 0]
    found = amplitude_spectrum(t, np.diff(v, prepend=v[0]) / (t[1] - t[0]))
    peak = next(peak for peak in found.peaks(20, least=1e-6) if peak.frequency_hz > 10.0)
    # Of the acceleration, in which the motion with the belt and the drive is small.
    return peak._replace(value=peak.value / (2.0 * math.pi * peak.frequency_hz))


def held_frequency() -> float:
    """Frequency [Hz] of three modes with the contact held: their one motion without x there."""
    body = basis(3)
    free = np.array([-AT_CONTACT, 1.0])
    stiffness = np.diag(body.angular_frequencies[[0, 2]] ** 2)
    B = body.T[0, 0, [0, 2]]
    stiffness += LAWS["drive"].stiffness_x * np.outer(B, B)
    return math.sqrt(free @ stiffness @ free / (free @ free)) / (2.0 * math.pi)


def soft_block(nodes: int = 16, youngs_modulus: float = 5e6) -> fc.ContactSystem:
    """The block as a body: of the same mass, soft as rubber, so that its face strains."""
    width, height, density = 0.12, 0.06, 7850.0
    shape = fc.Block(width, height, contact_length=0.08, drive_height=0.01, element_size=0.01)
    body = fc.ElasticBody(fc.generate(shape), fc.Material(youngs_modulus, 0.3, density),
                          thickness=MASS / (density * width * height))
    return fc.ContactSystem(
        fc.modal_basis(body, 10, contact_nodes=nodes, damping=0.02, B=fc.Patch("B", 0.006), C="top",
                       reduction="residual", tolerance=0.2), **{**LAWS, "ground": EVEN})


def figure(runs: dict[str, fc.Trajectory], path: Path | None = None) -> Any:
    """Phase planes of B and of the contact, one row a run, as in Fig. 4.3-2."""
    from fecontact.plot import COLOURS, new_figure

    with new_figure(8.0, 2.6 * len(runs), path) as drawn:
        axes = drawn.subplots(len(runs), 2, sharex=True, sharey="col", squeeze=False)
        for row, (name, run) in zip(axes, runs.items(), strict=True):
            for axis, (point, title) in zip(row, (("B", "drive B"), (0, "contact")), strict=True):
                x, v = run.displacement(point)[:, 0], run.velocity(point)[:, 0]
                axis.plot(1e3 * x, 1e3 * v, color=COLOURS[0], linewidth=0.6)
                axis.axhline(1e3 * BELT_SPEED, color="#303030", linewidth=0.7,
                             linestyle=(0, (4, 3)))
                axis.set_title(f"{name}, {title}", fontsize=9.5)
            row[0].set_ylabel("velocity [mm/s]")
        for axis in axes[-1]:
            axis.set_xlabel("displacement [mm]")
    return drawn


def side_by_side(runs: dict[str, fc.Trajectory], path: Path | None = None) -> Any:
    """Phase planes and normal forces of several runs, one column a run."""
    from fecontact.plot import COLOURS, new_figure

    with new_figure(4.6 * len(runs), 7.6, path) as drawn:
        axes = drawn.subplots(3, len(runs), sharey="row", squeeze=False)
        for (first, second, third), (name, run) in zip(axes.T, runs.items(), strict=True):
            for axis, point, where in ((first, "B", "drive B"), (second, 0, "contact")):
                x, v = run.displacement(point)[:, 0], run.velocity(point)[:, 0]
                axis.plot(1e3 * x, 1e3 * v, color=COLOURS[0], linewidth=0.5)
                axis.axhline(1e3 * BELT_SPEED, color="#303030", linewidth=0.7,
                             linestyle=(0, (4, 3)))
                axis.set_title(f"{name}, {where}", fontsize=9.5)
                axis.set_xlabel("displacement [mm]")
            third.plot(run.time - run.time[0], run.normal_force[:, 0], color=COLOURS[1],
                       linewidth=0.5)
            third.set_xlabel("time [s]")
        for axis, label in zip(axes[:, 0], ("velocity [mm/s]", "velocity [mm/s]",
                                            "normal force [N]"), strict=True):
            axis.set_ylabel(label)
    return drawn


def main(folder: Path = Path("friction-oscillator"), quick: bool = False) -> None:
    """Run all cases; print slips, periods and vibrations, and draw them."""
    skip, periods, end = (12, 24, 0.1) if quick else (40, 100, 1.4)
    folder.mkdir(parents=True, exist_ok=True)
    runs = {name: settled(case(), skip, periods) for name, case in CASES.items()}
    print(f"{'case':30s} {'periods':>7s} {'slips':>6s} {'different':>9s}   {'length [mm]':13s}   "
          f"ringing at B")
    for name, run in runs.items():
        lengths = 1e3 * np.array([slip.distance for slip in slips(run)])
        periods = periodicity(run, t_start=run.time[0], largest=8).periods or "-"
        peak = ringing(run) if run.system.basis.modes > 2 else None
        rings = f"{peak.frequency_hz:.2f} Hz, {1e3 * peak.value:.2f} mm/s" if peak else "-"
        print(f"{name:30s} {periods!s:>7s} {len(lengths):6d} {different(lengths):9d}   "
              f"{lengths.min():.3f} - {lengths.max():.3f}   {rings}")
    print(f"With the contact held the three modes vibrate at {held_frequency():.2f} Hz.")
    print(f"Normal force found by the static equilibrium: {prescribed().normal.force:.6f} N")
    names = list(runs)
    shown = {name: run.between(run.time[-1] - 20 * PERIOD) for name, run in runs.items()}
    figure({n: shown[n] for n in names[:3]}, folder / "phase.png")
    side_by_side({"vertical": shown[names[2]], "inclined": shown[names[3]]},
                 folder / "inclined.png")

    block = soft_block()
    print(f"Soft block: {block.basis.contact_nodes} contact nodes, elastic modes from "
          f"{block.basis.frequencies_hz[3]:.1f} Hz")
    run = fc.simulate(block, end, outputs=round(4000 * end) + 1, rtol=1e-5)
    parts = (run.contact_state == fc.ContactState.SLIP).mean(axis=1)
    print(f"Part of the time in which only a part of its face slips: "
          f"{((parts > 0.0) & (parts < 1.0)).mean():.0%}")


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
