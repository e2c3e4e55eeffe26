"""The Brake-Reuss beam, from a deck to its damping over the amplitude.

Two steel beams of 0.72 m in all overlap by 0.12 m and are held by three bolts. The deck, in Abaqus'
format, has both beams, bolts, washers and nuts as bricks, tied to each other; the thread of each
bolt is a distributing coupling, joined to that of its nut but along the bolt. It is published with
the reference below and not part of this package. The script

1. reads it and computes the free modes, without contact in the lap;
2. pairs the faces of the lap and reduces the beam, which stays free in space;
3. tightens the bolts: pairs of forces on the threads of bolt and nut, which stay;
4. computes the modes about that state, with stuck contacts; and
5. follows the first bending mode over its amplitude: frequency and damping by the extended periodic
   motion concept.

Contact is that of rough surfaces, whose pressure grows with the approach as exp(u / u_0): the
asperities measured by Porter and Brake give u_0 = 2.2 um near the mean pressure in the lap, 12.8
MPa. Tangential stiffness is 2 (1 - nu) / (2 - nu) times the normal one of each contact node under
the bolts (Mindlin). Friction acts along both directions of the lap.

Usage: python brake_reuss_beam.py DECK [FOLDER] [--quick]
       python brake_reuss_beam.py DECK --second-order

The second form prints the free modes of second-order bricks (867,000 unknowns), and ends.

J. H. Porter, M. R. W. Brake, Towards a predictive, physics-based friction model for the dynamics of
jointed structures, Mechanical Systems and Signal Processing 192 (2023) 110210; M. Krack, Nonlinear
modal analysis of nonconservative systems: extension of the periodic motion concept, Computers and
Structures 154 (2015).
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    NonlinearMode,
    nonlinear_mode,
)
from fecontact.fem import Pairing, pair_faces
from fecontact.laws import ExponentialContact, IwanFriction
from fecontact.plot import COLOURS, new_figure
from fecontact.reduction import assembled_basis, eigenfrequencies_hz, reduce_bodies
from fecontact.system import LoadHistory

BOLT = 12249.0  # force of each bolt [N]
PRESSURE, DEPTH = 1e6, 2.2e-6  # of the normal law [Pa, m]: the first is free, as the halves are
RATIO, COEFFICIENT, ELEMENTS = 0.82, 0.03, 5  # of friction
# Published without contact [Hz], and with a flat interface of rough surfaces: amplitude of the end
# [m], frequency [Hz], damping ratio (of which 8.7e-4 is that of the material).
WITHOUT_CONTACT = (70.323, 151.26, 609.25)
PUBLISHED = np.array([
    (9.734e-8, 168.502, 8.728e-4), (6.435e-7, 168.480, 9.554e-4), (1.709e-6, 168.381, 1.328e-3),
    (3.278e-6, 168.153, 2.114e-3), (6.282e-6, 167.539, 4.261e-3), (8.694e-6, 166.919, 6.151e-3),
    (1.203e-5, 166.147, 7.900e-3), (1.663e-5, 165.187, 9.863e-3), (2.295e-5, 164.034, 1.220e-2),
    (3.153e-5, 162.622, 1.525e-2), (4.224e-5, 160.778, 2.074e-2), (5.449e-5, 158.667, 2.631e-2)])
THREADS = [(f"BPT-{k}_Set-1", f"NPT-{k}_Set-1") for k in (1, 2, 3)]


def beam(deck: Path) -> fc.ElasticBody:
    """Both beams and their bolts, bricks with incompatible modes."""
    mesh = fc.read_mesh(deck)
    return fc.ElasticBody(mesh, degree=1)


def reduced(
    body: fc.ElasticBody, nodes: tuple[int, int], tolerance: float = 0.02
) -> tuple[Pairing, fc.ModalBasis]:
    """Faces of the lap with nodes along and across, and the basis of the free beam.

    Damping in proportion to the mass gives the mode the ratio published for small amplitudes.
    """
    bodies = {"beam": body}
    lap = pair_faces(bodies, "beam.BOTBEAM_INSURF", "beam.TOPBEAM_INSURF", nodes=nodes)
    points = {name: name for pair in THREADS for name in pair}
    points |= {"out": "OutNodes"}
    bases = reduce_bodies(bodies, [lap], modes=14, tolerance=tolerance, each={
        "beam": {"points": points, "loads": [name for pair in THREADS for name in pair]}})
    basis, (_, hertz, ratio) = assembled_basis(bases, {"lap": lap}), PUBLISHED[0]
    return lap, replace(basis, damping=4.0 * np.pi * hertz * ratio * np.eye(basis.modes))


def bolted(lap: Pairing, basis: fc.ModalBasis) -> fc.ContactSystem:
    """The beam with tightened bolts, and the friction that belongs to the pressure in the lap."""
    load = fc.Load(forces=tuple(
        fc.PointLoad(f"beam.{name}", "z", signal=sign * BOLT)
        for pair in THREADS for name, sign in zip(pair, (1.0, -1.0), strict=True)))
    normal = ExponentialContact(PRESSURE * lap.tributary.sum(), DEPTH)
    plain = fc.ContactSystem(basis, normal, IwanFriction(1.0, COEFFICIENT, ELEMENTS), load=load)
    pressed = fc.equilibrium(plain).normal_force
    return fc.ContactSystem(basis, normal, IwanFriction(RATIO * pressed / DEPTH, COEFFICIENT,
                                                        ELEMENTS), load=load)


def stuck_modes(system: fc.ContactSystem) -> tuple[LoadHistory, np.ndarray]:
    """The bolted state, and frequencies [Hz] of the modes about it with stuck contacts."""
    rest = fc.load_history(system, fc.LoadPath(steps=1, load_scale=(1.0, 1.0)))
    return rest, np.sort(fc.analysis.prestressed_modes(system, rest).frequencies_hz)


def backbone(system: fc.ContactSystem, rest: LoadHistory, largest: float) -> NonlinearMode:
    """The first mode up to an amplitude of the end [m], with mean and one harmonic."""
    return nonlinear_mode(system, (1e-6, largest), observe=("beam.out", "z"), preload=rest,
                          method=HarmonicBalance(1, 64),
                          options=ContinuationOptions(points=100, step=0.2, largest_step=1.0))


def draw(mode: NonlinearMode, path: Path) -> None:
    """Frequency, relative to that of small amplitudes, and damping beside the published ones."""
    with new_figure(9.0, 3.6, path) as figure:
        frequency, damping = figure.subplots(1, 2)
        for axes, own, column, label in (
                (frequency, 100.0 * (mode.frequency_hz / mode.frequency_hz[0] - 1.0),
                 100.0 * (PUBLISHED[:, 1] / PUBLISHED[0, 1] - 1.0), "change of frequency [%]"),
                (damping, 100.0 * mode.damping_ratio, 100.0 * PUBLISHED[:, 2],
                 "damping ratio [%]")):
            axes.plot(1e6 * mode.amplitude, own, color=COLOURS[0], label="this model")
            axes.plot(1e6 * PUBLISHED[:, 0], column, "o", color=COLOURS[1], ms=4.0,
                      label="Porter and Brake 2023")
            axes.set(xlabel="amplitude of the end [um]", ylabel=label)
            axes.set_xscale("log")
            axes.set_xlim(left=0.9)
            axes.legend()


def draw_pressure(lap: Pairing, system: fc.ContactSystem, path: Path) -> None:
    """Pressure of the contact nodes in the lap under the bolts [MPa]."""
    force = fc.equilibrium(system).normal_force
    with new_figure(9.0, 2.6, path) as figure:
        axes = figure.subplots()
        shown = axes.scatter(1e3 * lap.places[:, 0], 1e3 * lap.places[:, 1], s=260.0, marker="s",
                             c=1e-6 * force / lap.tributary, cmap="viridis")
        figure.colorbar(shown, label="pressure [MPa]")
        axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", ylim=(-16.0, 16.0))


def print_free_modes(frequencies_hz: np.ndarray) -> None:
    """Print the first three elastic modes beside the published ones."""
    free = frequencies_hz[frequencies_hz > 10.0][:3]
    print("free: " + ", ".join(f"{found:.2f} Hz (published {known:g})"
                               for found, known in zip(free, WITHOUT_CONTACT, strict=True)))


def main(deck: Path, folder: Path, quick: bool) -> None:
    """Prints frequencies and the backbone; pictures in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    body = beam(deck)
    lap, basis = reduced(body, (8, 2) if quick else (12, 3))
    print_free_modes(basis.frequencies_hz)
    system = bolted(lap, basis)
    rest, frequencies = stuck_modes(system)
    print(f"bolted: {frequencies[frequencies > 20.0][0]:.2f} Hz with stuck contacts (published "
          f"{PUBLISHED[0, 1]:.2f} Hz)")
    draw_pressure(lap, system, folder / "brake_reuss_pressure.png")
    mode = backbone(system, rest, 4e-6 if quick else 1.6e-5)
    for amplitude, hertz, ratio in PUBLISHED:
        if mode.amplitude[0] <= amplitude <= mode.amplitude[-1]:
            own = [np.interp(amplitude, mode.amplitude, found)
                   for found in (mode.frequency_hz, mode.damping_ratio)]
            print(f"{1e6 * amplitude:5.2f} um: {own[0]:.2f} Hz, damping ratio {own[1]:.5f} "
                  f"(published {hertz:.2f} Hz, {ratio:.5f})")
    draw(mode, folder / "brake_reuss_backbone.png")


if __name__ == "__main__":
    given = [Path(word) for word in sys.argv[1:] if not word.startswith("--")]
    if given and given[0].is_file() and "--second-order" in sys.argv:
        second = fc.ElasticBody(fc.read_mesh(given[0]), degree=2)
        print_free_modes(eigenfrequencies_hz(second, 10))
    elif given and given[0].is_file():
        main(given[0], *given[1:2] or [Path()], quick="--quick" in sys.argv)
    else:
        print("Give the deck of the Brake-Reuss beam (an .inp file) as the first argument; there "
              "is nothing to compute without it.")
