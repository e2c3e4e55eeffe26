"""Damping of a bolted plate: what microslip in the lap takes from a cycle, over the amplitude.

Two plates with holes overlap; bolts, springs with a prescribed shortening between the rings of the
washers, press them on each other. One plate is clamped at its far end, the other one is free. The
lap sticks in small vibrations; in larger ones its rim slips, in two directions, so that frequency
falls and damping grows. Ring-downs in time are set beside an estimate without time integration: the
loop of force and deflection under a force distributed as the inertia of the mode, alpha M phi, that
grows and falls slowly, the second time. With the tip of the loop X = phi . M q and its area D

    omega^2 = alpha / X,        zeta = zeta_0 + D / (2 pi alpha X)

where zeta_0 is the damping of the stuck plate. That leaves out what other modes do as the lap
slips: the frequency agrees to 2e-4, its shift to a tenth, the damping to 6 %. The loop is
computed by Newton's method with return of the friction forces to their discs, written here from the
equations alone. Its area is the work of friction in the slip.

Usage: python bolted_plate.py [FOLDER] [--quick]

H. Festjens, G. Chevallier, J.-L. Dion, A numerical tool for the design of assembled structures
under dynamic loads, International Journal of Mechanical Sciences 75 (2013); R. M. Lacayo, M. S.
Allen, Updating structural models containing nonlinear Iwan joints using quasi-static modal
analysis, Mechanical Systems and Signal Processing 118 (2019).
"""

import sys
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.analysis import complex_modes
from fecontact.fem import LapStrip, pair_faces
from fecontact.integrate import initial_state
from fecontact.laws import JenkinsFriction, LinearContact
from fecontact.plot import COLOURS, new_figure
from fecontact.reduction import Spring, reduce_bodies

STRIP = {"length": 0.15, "width": 0.04, "thickness": 0.005, "overlap": 0.06, "element_size": 0.012}
BOLT, SHORTENING = 1e8, 1e-5  # stiffness [N/m] and shortening [m] of each bolt
STIFFNESS, RATIO, COEFFICIENT = 1e9, 0.8, 0.3  # of the lap [N/m]; along over across; friction


@cache
def plate() -> fc.ContactSystem:
    """The bolted plates with 16 contact nodes in the lap."""
    bodies = {"lower": fc.ElasticBody(fc.generate(LapStrip(layer="lower", **STRIP)),
                                      fixed={"end": "xyz"}),
              "upper": fc.ElasticBody(fc.generate(LapStrip(layer="upper", **STRIP)))}
    face = pair_faces(bodies, "upper.contact", "lower.contact", nodes=16)
    # The lower layer is the upper one turned about y, so that its holes count from the other side.
    bolts = [Spring(f"upper.head{k}", f"lower.nut{3 - k}", stiffness=BOLT, shortening=SHORTENING)
             for k in (1, 2)]
    bases = reduce_bodies(bodies, [face], bolts, modes=6, damping=0.0005, each={
        "upper": {"points": {"head1": "washer_1", "head2": "washer_2", "end": "end"}},
        "lower": {"points": {"nut1": "washer_1", "nut2": "washer_2"}}})
    return fc.ContactSystem(bodies=bases, links=bolts, interfaces=[fc.Interface(
        "lap", face, LinearContact(STIFFNESS, damping=1e-6 * STIFFNESS),
        JenkinsFriction(RATIO * STIFFNESS, COEFFICIENT))])


@dataclass(frozen=True)
class StuckMode:
    """A mode of the plate with a stuck lap, about the rest under the bolts.

    ``shape`` (m,) has length one, as modal coordinates are mass-normalised.
    """

    rest: np.ndarray
    shape: np.ndarray
    angular_frequency: float
    damping_ratio: float

    @property
    def end(self) -> float:
        """Largest deflection of the free end per modal amplitude, with its sign."""
        basis = plate().basis
        moved = basis.T[basis.point_index("upper.end"), :3] @ self.shape
        return float(moved[np.abs(moved).argmax()])


@cache
def stuck_mode(number: int = 0) -> StuckMode:
    """The mode with this number, the first bending out of the plane by default."""
    system = plate()
    m, rest = system.basis.modes, initial_state(system, "rest", 0.0)
    modes = complex_modes(system, rest)
    # Deflections of the stuck springs that stay make frequencies of zero.
    k = np.flatnonzero(modes.frequencies_hz > 1.0)[number]
    shape = modes.right[m : 2 * m, k]
    shape = (shape / shape[np.abs(shape).argmax()]).real
    return StuckMode(rest, shape / np.linalg.norm(shape), float(np.abs(modes.eigenvalues[k])),
                     float(modes.damping_ratios[k]))


@dataclass(frozen=True)
class Loop:
    """A closed loop of the force alpha and the modal deflection, from tip to tip and back."""

    force: np.ndarray
    deflection: np.ndarray
    loss: float  # work of friction in the slip [J]

    @property
    def area(self) -> float:
        """Work of the force in the cycle [J]."""
        f, x = self.force, self.deflection
        return float(np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(x)))

    @property
    def amplitude(self) -> float:
        """Half the way from tip to tip."""
        return float(0.5 * np.ptp(self.deflection))

    def damped(self, mode: StuckMode) -> tuple[float, float]:
        """Frequency [Hz] and damping ratio."""
        alpha = self.force.max()
        frequency = np.sqrt(alpha / self.amplitude) / (2.0 * np.pi)
        return float(frequency), float(mode.damping_ratio + self.loss / (
            2.0 * np.pi * alpha * self.amplitude))


def loop(mode: StuckMode, alpha: float, steps: int = 15) -> Loop:
    """The second loop under alpha M phi, without any of the package's solvers.

    In the first one friction still finds its way: where the pressure varies it slips more.
    Raises RuntimeError where Newton's method finds no equilibrium.
    """
    basis = plate().basis
    rows, share = basis.contact_T[:, :3], basis.tributary / basis.tributary.sum()
    along, normal = rows[:, :2], rows[:, 2]
    c, k = STIFFNESS * share, RATIO * STIFFNESS * share
    stiffness = np.diag(basis.angular_frequencies**2)
    q = mode.rest[: basis.modes].copy()
    slipped = along @ q  # friction is free of forces at rest

    def state(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        depth = -normal @ q
        return np.maximum(c * depth, 0.0), c * (depth > 0.0), k[:, None] * (along @ q - slipped)

    path = alpha * np.concatenate([np.linspace(start, stop, n + 1)[1:] for start, stop, n in (
        (0.0, 1.0, steps), *2 * ((1.0, -1.0, 2 * steps), (-1.0, 1.0, 2 * steps)))])
    found, lost = [], []
    for load in path:
        for _ in range(60):
            F, closed, trial = state(q)
            size, limit = np.linalg.norm(trial, axis=1), COEFFICIENT * F
            slips = size > limit
            beyond = np.where(slips, size, 1.0)
            way = trial / beyond[:, None]
            R = np.where(slips[:, None], limit[:, None] * way, trial)
            unbalanced = (basis.constant_load + load * mode.shape - stiffness @ q + F @ normal
                          - np.einsum("nk,nkm->m", R, along))
            turn = np.eye(2) - slips[:, None, None] * (way[:, :, None] * way[:, None, :])
            turn *= np.where(slips, k * limit / beyond, k)[:, None, None]
            slope = np.einsum("nkm,nkl,nlp->mp", along, turn, along)
            tilted = np.einsum("nkm,nk->nm", along, way) * (slips * COEFFICIENT * closed)[:, None]
            slope += stiffness + (normal.T * closed) @ normal - tilted.T @ normal
            q = q + np.linalg.solve(slope, unbalanced)
            if np.abs(unbalanced).max() < 1e-10 * np.abs(basis.constant_load).max():
                break
        else:
            raise RuntimeError(f"no equilibrium at alpha = {load:g}")
        before = slipped
        slipped = along @ q - R / k[:, None]
        lost.append(float((R * (slipped - before)).sum()))
        found.append(float(mode.shape @ q))
    last = 5 * steps - 1
    return Loop(path[last:], np.array(found[last:]), sum(lost[last + 1 :]))


def ring_down(mode: StuckMode, amplitude: float, cycles: int) -> tuple[fc.Trajectory, np.ndarray]:
    """A run, and amplitude, frequency [Hz] and damping ratio (cycles - 1, 3) of its cycles.

    The plate starts from rest with the velocity of the mode, of the given modal amplitude.
    Frequency and damping are those of two cycles, before and after each top.
    """
    system = plate()
    m, w = system.basis.modes, mode.angular_frequency
    state = mode.rest.copy()
    state[m : 2 * m] = w * amplitude * mode.shape
    run = fc.simulate(system, 2.0 * np.pi * (cycles + 1.6) / w, initial=state,
                      outputs=200 * (cycles + 2))
    x = (run.modal_coordinates - mode.rest[:m]) @ mode.shape
    ups = np.flatnonzero((x[1:] > 0.0) & (x[:-1] <= 0.0))
    at = run.time[ups] - x[ups] * np.diff(run.time)[ups] / (x[ups + 1] - x[ups])
    # Half the way from tip to tip: slip may leave the rest a little away.
    sizes = np.array([0.5 * np.ptp(x[a:b]) for a, b in pairwise(ups)])
    frequencies = 2.0 / (at[3:] - at[1:-2]) if len(at) > 3 else np.zeros(0)
    decay = np.log(sizes[1:-1] / sizes[2:]) / (2.0 * np.pi)
    middle = np.sqrt(sizes[1:-1] * sizes[2:])
    return run, np.column_stack([middle, frequencies, decay])


def estimate(mode: StuckMode, deflections: np.ndarray) -> np.ndarray:
    """Modal amplitude, frequency [Hz] and damping ratio (n, 3) by loops.

    ``deflections`` [m] are those of the free end that the force would cause in the stuck plate.
    """
    loops = [loop(mode, mode.angular_frequency**2 * y / abs(mode.end)) for y in deflections]
    return np.array([(one.amplitude, *one.damped(mode)) for one in loops])


def plot(mode: StuckMode, estimated: np.ndarray, runs: list[np.ndarray], path: Path) -> None:
    """A loop, and frequency and damping over the amplitude of the free end."""
    scale = 1e3 * abs(mode.end)
    one = loop(mode, mode.angular_frequency**2 * 2e-3 / abs(mode.end))
    with new_figure(10.0, 3.4, path) as figure:
        cycle, frequency, damping = figure.subplots(1, 3)
        x = one.deflection - 0.5 * (one.deflection.max() + one.deflection.min())
        # The secant through the tips is subtracted: the loop would look like a line otherwise.
        spring = one.force.max() / one.amplitude * x
        cycle.plot(scale * x, (one.force - spring) / one.force.max(), color=COLOURS[0])
        cycle.set(xlabel="free end [mm]", ylabel="(force - secant) / largest force")
        for axes, column, label, factor in ((frequency, 1, "frequency [Hz]", 1.0),
                                            (damping, 2, "damping ratio [%]", 100.0)):
            axes.plot(scale * estimated[:, 0], factor * estimated[:, column], color=COLOURS[0],
                      label="slow loops")
            found = np.concatenate(runs)
            axes.plot(scale * found[:, 0], factor * found[:, column], "o", color=COLOURS[1],
                      ms=4.0, label="ring-downs")
            axes.set(xlabel="amplitude of the free end [mm]", ylabel=label)
            axes.set_xlim(left=0.0)
            axes.legend()


def main(folder: Path = Path(), quick: bool = False) -> None:
    """Prints loops and ring-downs beside each other; a picture in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    mode = stuck_mode()
    print(f"stuck: {mode.angular_frequency / (2.0 * np.pi):.4f} Hz, "
          f"damping ratio {mode.damping_ratio:.6f}")
    estimated = estimate(mode, np.geomspace(3e-4, 5e-3, 10 if quick else 21))
    runs = []
    for amplitude in (1e-3,) if quick else (0.6e-3, 1.2e-3, 3e-3):
        runs.append(ring_down(mode, amplitude / abs(mode.end), 2 if quick else 4)[1])
        for size, frequency, ratio in runs[-1]:
            by_loop = [np.interp(size, estimated[:, 0], estimated[:, k]) for k in (1, 2)]
            print(f"end {1e3 * size * abs(mode.end):.3f} mm: {frequency:.4f} Hz, damping ratio "
                  f"{ratio:.5f}; loop {by_loop[0]:.4f} Hz, {by_loop[1]:.5f}")
    plot(mode, estimated, runs, folder / "bolted_plate.png")


if __name__ == "__main__":
    main(*(Path(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
