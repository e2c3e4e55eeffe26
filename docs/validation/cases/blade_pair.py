"""Two blades with a damper pressed against their platforms: responses over the centrifugal load.

Both blades vibrate in the plane, fixed at their roots; a plate that centrifugal force presses
against their ends rubs on both. Forces in opposition move the blades against each other: the plate
stays, and each blade rubs on it. (Blades that move together carry the plate along, and it damps
nothing.) With a small load the plate slides all the time, with a large one it sticks and couples
the blades by its contacts alone: in between friction takes most energy, and the largest amplitude
is least, at mu N = pi F / 2 for the force F on a blade, and pi F / k with the stiffness k of a
contact.

Usage: python blade_pair.py [FOLDER] [--quick]
"""

import sys
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.bifurcation import (
    BranchStatus,
    ContinuationOptions,
    FrequencyResponse,
    HarmonicBalance,
    contact_field,
    frequency_response,
)
from fecontact.fem import pair_faces
from fecontact.laws import Harmonic, JenkinsFriction, LinearContact
from fecontact.plot import COLOURS, new_figure
from fecontact.reduction import Spring, reduce_bodies

LENGTH, HEIGHT, APART = 0.15, 0.008, 0.03  # of a blade, and between the two [m]
FORCE, COEFFICIENT, RATIO = 0.5, 0.3, 0.002  # N, friction, modal damping
NORMAL, TANGENTIAL = 2e7, 1.5e5  # stiffness of a contact [N/m]
BEST = np.pi * FORCE / COEFFICIENT  # load of both blades [N]
FREQUENCY = "excitation.frequency_hz"  # of both forces


def blade_pair(load: float, angle: float = np.pi, frequency_hz: float = 300.0) -> fc.ContactSystem:
    """Blades with a plate pressed on their ends [N]; ``angle`` between the blades [rad]."""
    width, size = 0.004, 0.004
    places = {"first": 0.0, "second": APART}
    blade = fc.Beam(LENGTH, HEIGHT, size)
    bodies = {name: fc.ElasticBody(fc.generate(blade).placed((0.0, y)), thickness=0.02,
                                   fixed={"left": "xy"}) for name, y in places.items()}
    bodies["plate"] = fc.ElasticBody(
        fc.generate(fc.Block(width, APART + HEIGHT, element_size=size)).placed((LENGTH, 0.0)),
        fc.Material.named("aluminium"), thickness=0.02)
    middle = 0.5 * (APART + HEIGHT)
    faces = [pair_faces(bodies, f"{name}.right", "plate.left", nodes=1) for name in places]
    links = [Spring("plate.back", direction=(1, 0), stiffness=1e3, damping=1.0, preload=load),
             Spring("plate.back", direction=(0, 1), stiffness=1e3, damping=1.0)]
    points = {name: {"points": {"end": (LENGTH, y + 0.5 * HEIGHT)}} for name, y in places.items()}
    points["plate"] = {"points": {"back": (LENGTH + width, middle)}}
    bases = reduce_bodies(bodies, faces, links, modes={"first": 3, "second": 3, "plate": 3},
                          damping=RATIO, each=points)
    forces = [fc.PointLoad(f"{name}.end", "y", signal=Harmonic(FORCE, frequency_hz, phase))
              for name, phase in zip(places, (0.0, angle), strict=True)]
    return fc.ContactSystem(
        bodies=bases, links=links, load=fc.Load(forces=tuple(forces)), interfaces=[
            fc.Interface(name, face, LinearContact(NORMAL, damping=50.0),
                         JenkinsFriction(TANGENTIAL, COEFFICIENT))
            for name, face in zip(places, faces, strict=True)])


def excited_at(system: fc.ContactSystem, frequency_hz: float) -> fc.ContactSystem:
    """The system with both forces at a frequency."""
    return system.with_({f"load.forces.{number}.signal.frequency_hz": frequency_hz
                         for number in range(2)})


def responses(
    loads: list[float], angle: float, bounds: tuple[float, float] = (280.0, 430.0),
    method: HarmonicBalance | None = None,
) -> FrequencyResponse:
    """Responses of the end of the first blade over the frequency [Hz], one for each load [N]."""
    found = []
    for load in loads:
        field = contact_field(blade_pair(load, angle), {FREQUENCY: (bounds[0], excited_at)})
        found.append(frequency_response(
            field, bounds, observe=("first.end", "y"),
            method=method or HarmonicBalance(3, 256, stability=None),
            options=ContinuationOptions(points=2000, largest_step=0.1)))
    return FrequencyResponse(tuple(one.branches[0] for one in found), "centrifugal load [N]",
                             np.array(loads), found[0].observed)


def estimate(loads: np.ndarray) -> np.ndarray:
    """Amplitude at resonance [m] of one harmonic with the plate at rest: 4 S (A - S / k) = pi F A.

    S is the friction of one blade; infinite where it cannot take what the force gives.
    """
    S = 0.5 * COEFFICIENT * np.asarray(loads)
    excess = 4.0 * S - np.pi * FORCE
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(excess > 0.0, 4.0 * S**2 / TANGENTIAL / excess, np.inf)


def peaks(response: FrequencyResponse) -> np.ndarray:
    """Largest amplitude [m] of each level."""
    return np.array([response.amplitude(level).max() for level in range(len(response.levels))])


def draw(response: FrequencyResponse, path: Path) -> None:
    """Responses, and peaks over the load."""
    with new_figure(10.0, 4.4, path) as figure:
        left, right = figure.subplots(1, 2)
        for level, colour in zip(range(len(response.levels)), COLOURS, strict=False):
            left.plot(response.branches[level].parameter, 1e6 * response.amplitude(level),
                      color=colour, label=f"{response.levels[level]:.3g} N")
        left.set(xlabel="frequency [Hz]", ylabel="amplitude of a blade [µm]")
        left.legend(title="load")
        loads = np.geomspace(0.57, 3.3, 300) * BEST
        right.plot(loads, 1e6 * estimate(loads), color=COLOURS[6], label="one harmonic, alone")
        right.plot(response.levels, 1e6 * peaks(response), "o", color=COLOURS[0],
                   label="harmonic balance")
        right.axvline(BEST, color=COLOURS[5], linewidth=0.8, linestyle=":")
        left.set_ylim(bottom=0.0)
        right.set(xlabel="load [N]", ylim=(0.0, 25.0), ylabel="largest amplitude of a blade [µm]")
        right.legend()


def main(folder: Path = Path(), quick: bool = False) -> None:
    """Prints peaks over the load; a picture in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    ratios = [1.0, 2.0] if quick else [0.7, 0.8, 1.0, 1.2, 1.5, 2.0, 3.0]
    response = responses([ratio * BEST for ratio in ratios], np.pi)
    for level, load in enumerate(response.levels):
        peak = response.peak(level)
        print(f"load {load:6.2f} N: {peak.parameter:.2f} Hz, "
              f"{1e6 * peaks(response)[level]:.3f} um, one harmonic {1e6 * estimate(load):.3f} um")
        if response.branches[level].status is not BranchStatus.BOUND:
            print(f"  not the whole response: {response.branches[level].status.value}")
    draw(response, folder / "blade_pair.png")


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
