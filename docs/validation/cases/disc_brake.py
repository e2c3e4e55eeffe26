"""A disc brake squeals: an annular disc that turns between two pads, as solids.

Springs of a calliper press two pads on both faces of a steel disc, which is fixed at its bore, and
hold them. Friction has a constant coefficient, so nothing falls with slip velocity; the disc turns
as a prescribed motion of its surfaces, without gyroscopic and convective terms, far below its
critical speeds. Friction acts half a thickness away from the middle of the disc and couples its
bending to the pads. Complex modes about steady sliding tell which mode grows; runs in time from
small disturbances grow by its rate and at its frequency, until the pads lift off and the squeal
keeps its size.

Usage: python disc_brake.py [FOLDER] [--quick]
"""

import sys
from functools import cache
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.analysis import ComplexModes, amplitude_spectrum, complex_modes
from fecontact.fem import Pairing, Ring, SolidBlock, pair_faces
from fecontact.integrate import initial_state
from fecontact.laws import ConstantFriction, LinearContact, SlidingRotation
from fecontact.plot import COLOURS, new_figure
from fecontact.reduction import Bushing, Spring, reduce_bodies

INNER, OUTER, THICKNESS = 0.05, 0.12, 0.01  # of the disc [m]
SIDES, RADIUS = (0.03, 0.04, 0.012), 0.095  # of a pad, and where its middle is [m]
PRESS, SPEED = 2000.0, 20.0  # on each pad [N], of the disc [rad/s]
HELD = (2e7, 2e7, 1e5, 2e3, 2e3, 2e2)  # stiffness of the calliper [N/m, N m]
LINING = fc.Material(youngs_modulus=8e9, poisson_ratio=0.25, density=2500.0)
PADS = "pad1", "pad2"  # on top of the disc and below it


@cache
def parts() -> tuple[dict[str, fc.ModalBasis], dict[str, Pairing], list[Bushing | Spring]]:
    """Bases of disc and pads, their faces with contact nodes on the pads, and the calliper."""
    disc = fc.generate(Ring(OUTER, INNER, THICKNESS, element_size=0.03, layers=1))
    block = fc.generate(SolidBlock(*SIDES, drive_height=SIDES[2], element_size=0.012))
    bodies = {"disc": fc.ElasticBody(disc, fixed={"inner": "xyz"})}
    x, y = RADIUS - 0.5 * SIDES[0], 0.5 * SIDES[1]
    placed = (block.placed((x, -y, THICKNESS)), block.placed((x, y, 0.0), (180.0, 0.0, 0.0)))
    faces: dict[str, Pairing] = {}
    links: list[Bushing | Spring] = []
    for name, mesh, face, outward in zip(PADS, placed, ("top", "contact"), (1.0, -1.0),
                                         strict=True):
        bodies[name] = fc.ElasticBody(mesh, LINING)
        faces[name] = pair_faces(bodies, f"{name}.contact", f"disc.{face}", nodes=6,
                                 nodes_on="face")
        links += [Bushing(f"{name}.back", stiffness=HELD,
                          damping=tuple(2e-6 * value for value in HELD)),
                  Spring(f"{name}.back", direction=(0.0, 0.0, outward), preload=PRESS)]
    bases = reduce_bodies(bodies, list(faces.values()), links, damping=0.001, tolerance=0.3,
                          modes={"disc": 12, "pad1": 8, "pad2": 8},
                          each={name: {"points": {"back": "top"}} for name in PADS})
    return bases, faces, links


def brake(friction: float = 0.3) -> fc.ContactSystem:
    """Disc and pads with a coefficient of friction."""
    bases, faces, links = parts()
    return fc.ContactSystem(bodies=bases, links=links, interfaces=[
        fc.Interface(name, face, LinearContact(1e8, damping=20.0),
                     ConstantFriction(friction, smoothing_slope=1e4, smoothing="tanh"),
                     sliding=SlidingRotation(SPEED)) for name, face in faces.items()])


def flutter_mode(modes: ComplexModes) -> int:
    """The mode that grows fastest, or decays most slowly."""
    return int(np.argmax(modes.eigenvalues.real))


def disturbed(system: fc.ContactSystem, size: float) -> np.ndarray:
    """Steady sliding, and the fastest growing mode with this largest deflection of a pad [m]."""
    state = initial_state(system, "sliding", 0.0)
    modes = complex_modes(system, "sliding")
    shape = modes.right[:, flutter_mode(modes)]
    backs = [system.basis.T[system.basis.point_index(f"{name}.back"), :3] for name in PADS]
    moved = np.abs(np.concatenate(backs) @ shape[: system.basis.modes]).max()
    return state + (shape * size / moved).real


def growth(system: fc.ContactSystem, size: float = 1e-9, rtol: float = 1e-9, cycles: int = 10
           ) -> tuple[float, float]:
    """Growth rate [1/s] and frequency [Hz] of a disturbance [m], from a run in time.

    Projected on the mode by its left eigenvector, the run is one complex exponential.
    """
    modes = complex_modes(system, "sliding")
    mode = flutter_mode(modes)
    rest = initial_state(system, "sliding", 0.0)
    run = fc.simulate(system, cycles / modes.frequencies_hz[mode], outputs=20 * cycles + 1,
                      initial=disturbed(system, size), rtol=rtol)
    share = (run.states - rest) @ modes.left[:, mode]
    rate, phase = np.polyfit(run.time, np.stack([np.log(np.abs(share)),
                                                 np.unwrap(np.angle(share))], axis=1), 1)[0]
    return float(rate), float(phase / (2.0 * np.pi))


def squeal(system: fc.ContactSystem, end: float) -> tuple[fc.Trajectory, float]:
    """A run from a disturbance of 4 um, and the frequency in its last third [Hz]."""
    run = fc.simulate(system, end, initial=disturbed(system, 4e-6), outputs=int(end * 2e5) + 1)
    late = run.between(2.0 * end / 3.0)
    return run, amplitude_spectrum(late.time, late.velocity("pad1.back")[:, 1]).peaks(
        1)[0].frequency_hz


def plot(system: fc.ContactSystem, run: fc.Trajectory, frictions: np.ndarray, path: Path) -> None:
    """Growth rates over friction, the motion of a pad, and the forces on both at the end."""
    modes = complex_modes(system, "sliding")
    mode = flutter_mode(modes)
    rate, period = modes.eigenvalues[mode].real, 1.0 / modes.frequencies_hz[mode]
    with new_figure(10.0, 3.4, path) as figure:
        map_, whole, late = figure.subplots(1, 3)
        for friction in frictions:
            found = complex_modes(brake(friction), "sliding")
            near = np.abs(found.frequencies_hz - modes.frequencies_hz[mode]) < 1e3
            for grows, colour in enumerate(COLOURS[:2]):
                rates = found.eigenvalues.real[near & (found.grows == grows)]
                map_.plot(np.full(len(rates), friction), rates, ".", color=colour, ms=5.0,
                          label="grows" if grows else "decays")
        entries = dict(zip(*reversed(map_.get_legend_handles_labels()), strict=True))
        map_.legend(entries.values(), entries, loc="upper left")
        map_.set(xlabel="friction coefficient", ylabel="growth of modes near 8 kHz [1/s]")
        steady = initial_state(system, "sliding", 0.0)[: system.basis.modes]
        along = system.basis.point_row("pad1.back", "y")
        y = 1e6 * (run.modal_coordinates - steady) @ along
        whole.plot(1e3 * run.time, y, color=COLOURS[0], lw=0.6)
        envelope = np.abs(y[run.time < period]).max() * np.exp(rate * run.time)
        shown = envelope < 1.15 * np.abs(y).max()
        whole.plot(1e3 * run.time[shown], envelope[shown], color=COLOURS[1], label="linear growth")
        whole.set(xlabel="time [ms]", ylabel="pad along the disc [µm]")
        whole.legend(loc="lower right")
        part = run.between(run.time[-1] - 3.0 * period)
        for name, colour, (nodes, _, _) in zip(PADS, COLOURS, system.law_groups("normal"),
                                               strict=False):
            pressing = 1e-3 * part.normal_force[:, nodes].sum(axis=1)
            late.plot(1e3 * (part.time - part.time[0]), pressing, color=colour, label=name)
        late.set(xlabel="time at the end [ms]", ylabel="normal force [kN]")
        late.set_ylim(0.0, 5.0)
        late.legend(loc="upper right")


def main(folder: Path = Path(), quick: bool = False) -> None:
    """Prints flutter, growth and limit cycle; a picture in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    system = brake()
    modes = complex_modes(system, "sliding")
    mode = flutter_mode(modes)
    rate, frequency = growth(system)
    print(f"friction 0.3: a mode of {modes.frequencies_hz[mode]:.3f} Hz grows by "
          f"{modes.eigenvalues[mode].real:.3f} 1/s; a run by {rate:.3f} 1/s at {frequency:.3f} Hz")
    run, cycle = squeal(system, 0.012 if quick else 0.02)
    opened = (run.between(2.0 / 3.0 * run.time[-1]).contact_state == fc.ContactState.OPEN).mean()
    print(f"it squeals at {cycle:.0f} Hz, nodes open {opened:.0%} of the time")
    plot(system, run, np.linspace(0.0, 0.6, 4 if quick else 31), folder / "disc_brake.png")


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
