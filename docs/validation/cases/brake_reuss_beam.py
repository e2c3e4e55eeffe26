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

Contact is that of elastic-plastic asperities with measured heights (`AsperityContact`): the bolts
flatten them, the vibration is elastic. Each asperity sticks with Mindlin's stiffness and slides at
its own limit, along both directions of the lap; ten elements stand for all of a node. The lap is
flat, or has its measured shape. The file of the surface is published with the reference too.
Modulus and density are those of the published model, not the deck's; free modes are printed for the
deck's.

Usage: python brake_reuss_beam.py DECK SURFACE [FOLDER] [--quick]
       python brake_reuss_beam.py DECK --second-order

The second form prints the free modes of second-order bricks (867,000 unknowns), and ends.

J. H. Porter, M. R. W. Brake, Towards a predictive, physics-based friction model for the dynamics of
jointed structures, Mechanical Systems and Signal Processing 192 (2023) 110210; M. Krack, Nonlinear
modal analysis of nonconservative systems: extension of the periodic motion concept, Computers and
Structures 154 (2015).
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.io import loadmat

import fecontact as fc
from fecontact.bifurcation import (
    ContinuationOptions,
    HarmonicBalance,
    NonlinearMode,
    nonlinear_mode,
)
from fecontact.fem import Pairing, pair_faces
from fecontact.laws import AsperityContact, IwanFriction
from fecontact.plot import COLOURS, new_figure
from fecontact.reduction import (
    assembled_basis,
    eigenfrequencies_hz,
    reduce_bodies,
    with_masses,
)
from fecontact.system import LoadHistory

BOLT = 12249.0  # force of each bolt [N]
MODULUS, POISSON, YIELD = 192.31e9, 0.3, 331.7e6  # of the asperities [Pa]
COEFFICIENT, ELEMENTS = 0.03, 10  # of friction
# Published without contact [Hz], and with a flat interface of rough surfaces: amplitude of the end
# [m], frequency [Hz], damping ratio (of which 8.7e-4 is that of the material).
WITHOUT_CONTACT = (70.323, 151.26, 609.25)
PUBLISHED = np.array([
    (9.734e-8, 168.502, 8.728e-4), (6.435e-7, 168.480, 9.554e-4), (1.709e-6, 168.381, 1.328e-3),
    (3.278e-6, 168.153, 2.114e-3), (6.282e-6, 167.539, 4.261e-3), (8.694e-6, 166.919, 6.151e-3),
    (1.203e-5, 166.147, 7.900e-3), (1.663e-5, 165.187, 9.863e-3), (2.295e-5, 164.034, 1.220e-2),
    (3.153e-5, 162.622, 1.525e-2), (4.224e-5, 160.778, 2.074e-2), (5.449e-5, 158.667, 2.631e-2)])
# With the measured shape.
PUBLISHED_SHAPE = np.array([
    (9.839e-8, 180.627, 8.780e-4), (3.456e-7, 180.622, 8.891e-4), (1.272e-6, 180.573, 1.075e-3),
    (2.437e-6, 180.447, 1.538e-3), (4.655e-6, 180.032, 3.078e-3), (8.850e-6, 178.603, 8.386e-3),
    (1.378e-5, 176.233, 1.611e-2), (1.799e-5, 174.222, 2.105e-2), (2.293e-5, 172.215, 2.456e-2),
    (3.046e-5, 169.768, 2.799e-2), (3.739e-5, 167.819, 3.114e-2), (4.680e-5, 165.517, 3.454e-2),
    (5.364e-5, 164.058, 3.655e-2), (6.409e-5, 162.073, 3.940e-2)])
# Bending modes with stuck contacts [Hz], flat and with the measured shape.
PUBLISHED_STUCK = {"flat": (168.503, 580.408, 1177.650),
                   "measured shape": (180.629, 595.282, 1199.900)}
# Steel and accelerometer of the model with these results; the deck has 200 GPa and 7800 kg/m^3.
STEEL, SENSOR = fc.Material(MODULUS, 0.29, 7784.3), 0.8e-3
THREADS = [(f"BPT-{k}_Set-1", f"NPT-{k}_Set-1") for k in (1, 2, 3)]


def beam(deck: Path, material: fc.Material | None = None) -> fc.ElasticBody:
    """Both beams and their bolts, bricks with incompatible modes; by default of its own steel."""
    return fc.ElasticBody(fc.read_mesh(deck), material, degree=1, bricks="incompatible",
                          integration="full")


def reduced(
    body: fc.ElasticBody, nodes: tuple[int, int], modes: int
) -> tuple[Pairing, fc.ModalBasis]:
    """Faces of the lap with nodes along and across, and the basis of the free beam.

    Of the modes that all residual vectors give, the lowest are kept: they hold the compliance under
    the stiff contact better than as many residual vectors chosen by a larger tolerance. Damping in
    proportion to the mass gives the mode the ratio published for small amplitudes.
    """
    bodies = {"beam": body}
    lap = pair_faces(bodies, "beam.BOTBEAM_INSURF", "beam.TOPBEAM_INSURF", nodes=nodes)
    points = {name: name for pair in THREADS for name in pair}
    points |= {"out": "OutNodes"}
    bases = reduce_bodies(bodies, [lap], modes=14, tolerance=1e-4, each={
        "beam": {"points": points, "loads": [name for pair in THREADS for name in pair]}})
    basis, (_, hertz, ratio) = assembled_basis(bases, {"lap": lap}), PUBLISHED[0]
    basis = basis.select(range(modes))
    return lap, replace(basis, damping=4.0 * np.pi * hertz * ratio * np.eye(basis.modes))


@dataclass(frozen=True)
class Surface:
    """Measured asperities, and the shape of the faces of the lap.

    density is that of the gaps of asperities at equal distances from 0 to gap_range [m], per_area
    their number [1/m^2], radius that of a pair [m], places (k, 2) and gaps (k,) those of the lap
    [m].
    """

    density: tuple[float, ...]
    gap_range: float
    per_area: float
    radius: float
    places: np.ndarray
    gaps: np.ndarray

    @classmethod
    def read(cls, file: Path) -> "Surface":
        """From the file that Porter and Brake published."""
        found = loadmat(file)
        grid = found["mesoscale_xygap"]
        grid = grid[np.isfinite(grid).all(axis=1)]
        return cls(tuple(found["pzinterp"][0]), float(found["z_max"].item()),
                   float(found["area_density"].item()), float(found["Re"].item()), grid[:, :2],
                   grid[:, 2])

    def law(self, lap: Pairing, yield_stress: float = YIELD) -> AsperityContact:
        """Law of the new faces of the lap."""
        return AsperityContact(tuple(self.per_area * lap.tributary), self.radius,
                               0.5 * MODULUS / (1.0 - POISSON**2), self.gap_range, self.density,
                               yield_stress, POISSON)

    def gap(self, lap: Pairing) -> tuple[float, ...]:
        """Mean gap of the patch about each contact node, zero at the closest one [m]."""
        middle = 0.5 * (lap.places.min(axis=0) + lap.places.max(axis=0))
        places = (lap.places - middle)[:, :2]
        near = ((self.places[:, None] - places) ** 2).sum(axis=2).argmin(axis=1)
        found = np.array([self.gaps[near == node].mean() for node in range(len(places))])
        return tuple((found - found.min()).tolist())


def bolted(
    lap: Pairing, basis: fc.ModalBasis, surface: Surface, *, shaped: bool = False,
    yield_stress: float = YIELD,
) -> fc.ContactSystem:
    """The beam with tightened bolts, whose asperities have been flattened by them.

    The lap is flat, or has the measured shape.
    """
    load = fc.Load(forces=tuple(
        fc.PointLoad(f"beam.{name}", "z", signal=sign * BOLT)
        for pair in THREADS for name, sign in zip(pair, (1.0, -1.0), strict=True)))
    gap = surface.gap(lap) if shaped else 0.0
    new, share = surface.law(lap, yield_stress), lap.tributary / lap.tributary.sum()
    pressed = fc.equilibrium(fc.ContactSystem(basis, new, IwanFriction(1.0, COEFFICIENT, ELEMENTS),
                                              load=load, gap=gap)).penetration
    return fc.ContactSystem(basis, new.flattened(pressed), new.friction(
        share, pressed, COEFFICIENT, ELEMENTS), load=load, gap=gap)


def stuck_modes(system: fc.ContactSystem) -> tuple[LoadHistory, np.ndarray]:
    """The bolted state, and frequencies [Hz] of the modes about it with stuck contacts."""
    rest = fc.load_history(system, fc.LoadPath(steps=1, load_scale=(1.0, 1.0)))
    return rest, np.sort(fc.analysis.prestressed_modes(system, rest).frequencies_hz)


def backbone(system: fc.ContactSystem, rest: LoadHistory, largest: float) -> NonlinearMode:
    """The first mode up to an amplitude of the end [m], with mean and one harmonic."""
    return nonlinear_mode(system, (1e-6, largest), observe=("beam.out", "z"), preload=rest,
                          method=HarmonicBalance(1, 64),
                          options=ContinuationOptions(points=100, step=0.2, largest_step=1.0))


def draw(modes: Mapping[str, NonlinearMode], path: Path) -> None:
    """Frequency, relative to that of small amplitudes, and damping beside the published ones."""
    with new_figure(9.0, 3.6, path) as figure:
        axes = figure.subplots(1, 2)
        for k, (name, mode) in enumerate(modes.items()):
            for one, values in zip(axes, (
                    100.0 * (mode.frequency_hz / mode.frequency_hz[0] - 1.0),
                    100.0 * mode.damping_ratio), strict=True):
                one.plot(1e6 * mode.amplitude, values, color=COLOURS[k], label=name)
        for name, known, marker in (("flat", PUBLISHED, "o"),
                                    ("measured shape", PUBLISHED_SHAPE, "^")):
            for one, values in zip(axes, (
                    100.0 * (known[:, 1] / known[0, 1] - 1.0), 100.0 * known[:, 2]), strict=True):
                one.plot(1e6 * known[:, 0], values, marker, color="black", ms=4.0,
                         label=f"{name}, published")
        for one, label in zip(axes, ("change of frequency [%]", "damping ratio [%]"), strict=True):
            one.set(xlabel="amplitude of the end [um]", ylabel=label)
            one.set_xscale("log")
            one.set_xlim(left=0.9)
        axes[1].legend()


def draw_pressure(lap: Pairing, systems: Mapping[str, fc.ContactSystem], path: Path) -> None:
    """Pressure of the contact nodes in the lap under the bolts [MPa]."""
    with new_figure(9.0, 2.4 * len(systems), path) as figure:
        every = np.atleast_1d(figure.subplots(len(systems), 1))
        for axes, (name, system) in zip(every, systems.items(), strict=True):
            force = fc.equilibrium(system).normal_force
            shown = axes.scatter(1e3 * lap.places[:, 0], 1e3 * lap.places[:, 1], s=260.0,
                                 marker="s", c=1e-6 * force / lap.tributary, cmap="viridis")
            figure.colorbar(shown, label="pressure [MPa]")
            axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", ylim=(-16.0, 16.0),
                     title=name)


def print_free_modes(frequencies_hz: np.ndarray) -> None:
    """Print the first three elastic modes beside the published ones."""
    free = frequencies_hz[frequencies_hz > 10.0][:3]
    print("free: " + ", ".join(f"{found:.2f} Hz (published {known:g})"
                               for found, known in zip(free, WITHOUT_CONTACT, strict=True)))


def main(deck: Path, file: Path, folder: Path, quick: bool) -> None:
    """Prints frequencies and the backbones; pictures in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    lap, basis = reduced(beam(deck, STEEL), *(((8, 2), 60) if quick else ((12, 3), 90)))
    print_free_modes(basis.frequencies_hz * np.sqrt(2e11 / MODULUS * STEEL.density / 7800.0))
    basis = with_masses(basis, {"beam.out": SENSOR})
    surface = Surface.read(file)
    systems = {"flat": bolted(lap, basis, surface),
               "flat, elastic": bolted(lap, basis, surface, yield_stress=0.0),
               "measured shape": bolted(lap, basis, surface, shaped=True)}
    modes = {}
    for name, system in systems.items():
        rest, frequencies = stuck_modes(system)
        bending = frequencies[frequencies > 20.0][[0, 2, 4]]
        known = PUBLISHED_STUCK["measured shape" if "shape" in name else "flat"]
        print(f"{name}, bending modes with stuck contacts: " + ", ".join(
            f"{found:.2f} Hz (published {one:g})"
            for found, one in zip(bending, known, strict=True)), flush=True)
        modes[name] = mode = backbone(system, rest, 4e-6 if quick else 2.4e-5)
        print("amplitude [um], change of frequency [%] and damping ratio, both published")
        curve = PUBLISHED_SHAPE if "shape" in name else PUBLISHED
        for amplitude, hertz, ratio in curve:
            if mode.amplitude[0] <= amplitude <= mode.amplitude[-1]:
                own, damping = (np.interp(amplitude, mode.amplitude, found)
                                for found in (mode.frequency_hz, mode.damping_ratio))
                print(f"{1e6 * amplitude:5.2f} {100.0 * (own / mode.frequency_hz[0] - 1.0):+.3f} "
                      f"{damping:.5f} {100.0 * (hertz / curve[0, 1] - 1.0):+.3f} {ratio:.5f}",
                      flush=True)
    draw_pressure(lap, {name: systems[name] for name in ("flat", "measured shape")},
                  folder / "brake_reuss_pressure.png")
    draw(modes, folder / "brake_reuss_backbone.png")


if __name__ == "__main__":
    given = [Path(word) for word in sys.argv[1:] if not word.startswith("--")]
    if given and given[0].is_file() and "--second-order" in sys.argv:
        second = fc.ElasticBody(fc.read_mesh(given[0]), degree=2)
        print_free_modes(eigenfrequencies_hz(second, 10))
    elif len(given) > 1 and given[0].is_file() and given[1].is_file():
        main(given[0], given[1], given[2] if len(given) > 2 else Path(), "--quick" in sys.argv)
    else:
        print("Give the deck of the Brake-Reuss beam (an .inp file) and its surface (a .mat file) "
              "as first arguments; there is nothing to compute without them.")
