"""Error and time of the reduced model of large deflections beside the whole body.

A clamped steel strip of quadratic quadrilaterals is let go from static deflections. The whole body
is integrated by the generalised alpha method (Chung and Hulbert 1993), with Newton's method in each
step; the reduced one, of the first and the third mode, by fecontact's integrator. Frequencies of
the free vibration stand beside the backbone of the nonlinear mode of the reduced model: each
deflection gives a point of the backbone of the whole body, and the last lines compare both.

A second table has the time of a step with one to ten modes with large deflections, without contact
and with 20 contact nodes with friction, beside that of the same coordinates without these forces.

Usage: python benchmarks/large_deflections.py [columns] [--quick]
"""

import sys
import time
import warnings
from dataclasses import replace

import numpy as np
from scipy.sparse.linalg import splu
from usage import explain

import fecontact as fc
from fecontact.bifurcation import HarmonicBalance, nonlinear_mode
from fecontact.fem.finite_strain import FiniteStrainModel
from fecontact.fem.load_steps import DeflectionSteps, follow
from fecontact.integrate import Rodas5P
from fecontact.laws import ConstantFriction, Harmonic, LinearContact
from fecontact.reduction import LargeDeflections

LENGTH, HEIGHT, WIDTH = 1.0, 4e-3, 0.01
AMPLITUDES = (0.25, 0.5, 1.0)  # initial deflections in thicknesses
PERIODS, STEPS = 6, 200  # of the lowest linear frequency, and steps in each
COLUMNS, CONTACTS = 20, 20  # of the strip of the second table, and its contact nodes
COUNTS, LONGEST = (1, 2, 3, 5, 10), 5e-5  # modes, and longest step [s]


def strip(columns: int) -> fc.ElasticBody:
    """The strip, with a point in the middle."""
    mesh = fc.Mesh.grid(np.linspace(0.0, LENGTH, columns + 1), np.linspace(0.0, HEIGHT, 3))
    return fc.ElasticBody(mesh, fc.Material.named("steel"), thickness=WIDTH,
                          fixed={"left": "xy", "right": "xy"})


class WholeBody:
    """The strip by all its unknowns."""

    def __init__(self, columns: int) -> None:
        self.body = body = strip(columns)
        self.model = FiniteStrainModel(body)
        self.mass = (body.expansion.T @ body.mass @ body.expansion).tocsc()
        middle = int(np.argmin(np.linalg.norm(
            body.nodes - np.array([0.5 * LENGTH, 0.5 * HEIGHT]), axis=1)))
        self.row = body.expansion.tocsr()[[2 * middle + 1]]

    def bent(self, load: np.ndarray, size: float) -> np.ndarray:
        """Free unknowns under nodal forces in proportion to a load, the middle moved by a size."""
        force = self.model.free(load)
        force /= (self.row @ splu(self.model.state(0.0 * force).tangent).solve(force))[0] / size
        path = follow(self.model, lambda q: (force, None),
                      DeflectionSteps("arc", first=0.2, largest=0.2),
                      lambda q: bool((self.row @ q)[0] >= size))
        return path.points[-1].q

    def free_vibration(self, q: np.ndarray, step: float, count: int) -> np.ndarray:
        """Deflections of the middle (count + 1,) after the start at rest from q."""
        least = 0.8  # of the amplitude that a step leaves of the highest frequencies
        of_mass, of_force = (2.0 * least - 1.0) / (least + 1.0), least / (least + 1.0)
        gamma = 0.5 - of_mass + of_force
        beta = 0.25 * (1.0 - of_mass + of_force) ** 2
        v, force = np.zeros_like(q), self.model.state(q, tangent=False).force
        a = splu(self.mass).solve(-force)
        found = [float((self.row @ q)[0])]
        for _ in range(count):
            start = q + step * v + step**2 * (0.5 - beta) * a
            new, old = a.copy(), force
            for _ in range(20):
                state = self.model.state(start + beta * step**2 * new)
                residual = (self.mass @ ((1.0 - of_mass) * new + of_mass * a)
                            + (1.0 - of_force) * state.force + of_force * old)
                matrix = (1.0 - of_mass) * self.mass + (
                    (1.0 - of_force) * beta * step**2) * state.tangent
                change = splu(matrix.tocsc()).solve(residual)
                new = new - change
                moved = beta * step**2 * np.linalg.norm(change)
                if moved <= 1e-8 * np.linalg.norm(start):
                    break
            q, force = start + beta * step**2 * new, state.force
            v, a = v + step * ((1.0 - gamma) * a + gamma * new), new
            found.append(float((self.row @ q)[0]))
        return np.array(found)


def frequency(times: np.ndarray, deflection: np.ndarray) -> float:
    """Frequency of a vibration [Hz] from its zeros."""
    at = np.flatnonzero(deflection[:-1] * deflection[1:] < 0.0)
    zeros = times[at] - deflection[at] * np.diff(times)[at] / np.diff(deflection)[at]
    return float(0.5 * (len(zeros) - 1) / (zeros[-1] - zeros[0]))


def with_modes(count: int, contacts: int, columns: int) -> fc.ContactSystem:
    """The strip with so many modes, all of them with large deflections, pushed in its middle."""
    face = {"contact": "bottom", "contact_nodes": contacts} if contacts else {"contact": ()}
    laws = {"normal": LinearContact(1e6, 10.0), "friction": ConstantFriction(0.3),
            "gap": 0.05 * HEIGHT} if contacts else {}
    basis = fc.modal_basis(
        strip(columns), count, B="", C="", damping=0.01,
        large_deflections=LargeDeflections(0.6 * HEIGHT, count, stretching_damping=0.1),
        points={"middle": (0.5 * LENGTH, 0.5 * HEIGHT)}, **face)
    push = Harmonic(1.0 if contacts else 0.05, 22.0)
    return fc.ContactSystem(basis, load=fc.Load(
        forces=(fc.PointLoad("middle", "y", signal=push),)), **laws)


def time_of_step(system: fc.ContactSystem, duration: float) -> tuple[float, int]:
    """Time of a step [s], the best of three runs of as long steps, and their number."""
    start, best = np.zeros(system.size), np.inf
    fc.simulate(system, 0.1 * duration, initial=start, outputs=2, solver=Rodas5P())  # compiles
    for _ in range(3):
        begin = time.perf_counter()
        run = fc.simulate(system, duration, initial=start, outputs=2, rtol=1e-3,
                          solver=Rodas5P(), max_step=LONGEST)
        best = min(best, time.perf_counter() - begin)
    steps = int(dict(run.summary())["steps"].split()[0].replace(",", ""))
    return best / steps, steps


def costs(quick: bool) -> None:
    """Print the table of times of a step."""
    print(f"\n{'contact nodes':>13s} {'modes':>5s} {'coordinates':>11s} {'steps':>6s} "
          f"{'step [us]':>9s} {'linear [us]':>11s} {'ratio':>6s}")
    for contacts in (0, CONTACTS):
        for count in COUNTS[: 2 if quick else None]:
            with warnings.catch_warnings():
                # Of resonances with modes that are left out.
                warnings.simplefilter("ignore", fc.ModelWarning)
                system = with_modes(count, contacts, 10 if quick else COLUMNS)
            linear = system.with_(basis=replace(system.basis, large_deflections=()))
            duration = 0.05 if quick else 0.5
            each, steps = time_of_step(system, duration)
            without, _ = time_of_step(linear, duration)
            print(f"{contacts:13d} {count:5d} {system.basis.modes:11d} {steps:6d} "
                  f"{1e6 * each:9.2f} {1e6 * without:11.2f} {each / without:6.2f}")


def main(columns: int = 60, quick: bool = False) -> None:
    """Print the table; quickly with a coarse mesh and one deflection."""
    columns = 16 if quick else columns
    whole = WholeBody(columns)
    begin = time.perf_counter()
    basis = fc.modal_basis(strip(columns), 3, contact=(), points={"middle": (
        0.5 * LENGTH, 0.5 * HEIGHT)}, large_deflections=LargeDeflections(
            1.2 * HEIGHT, (0, 2), stretching_damping=0.1))
    fitted = time.perf_counter() - begin
    system, row = fc.ContactSystem(basis), basis.point_row("middle", "y")
    begin = time.perf_counter()
    mode = nonlinear_mode(system, (0.05 * HEIGHT, 1.1 * HEIGHT), observe=("middle", "y"),
                          method=HarmonicBalance(4, stability=None))
    followed = time.perf_counter() - begin
    print(f"{whole.mass.shape[0]} unknowns; basis of {basis.modes} in {fitted:.1f} s, "
          f"{basis.large_deflections[0].states} static solutions; backbone in {followed:.1f} s")
    print(f"{'deflection':>10s} {'whole [Hz]':>10s} {'reduced [Hz]':>12s} {'backbone [Hz]':>13s} "
          f"{'motion off by':>13s} {'whole [s]':>9s} {'reduced [s]':>11s} {'ratio':>7s}")
    step = 1.0 / (STEPS * basis.frequencies_hz[0])
    count = PERIODS * STEPS
    begins = np.zeros(system.size)
    fc.simulate(system, step, initial=begins, outputs=2)  # compiles
    waited, off = 0.0, 0.0
    for size in AMPLITUDES[1:2] if quick else AMPLITUDES:
        shapes = basis.mode_shapes.shapes.reshape(-1, basis.modes)
        inertia = whole.body.mass @ shapes
        q = whole.bent(inertia[:, 0] * np.sign(row[0]), size * HEIGHT)
        state = np.append(inertia.T @ whole.model.displacement(q).ravel(), np.zeros(basis.modes))
        begin = time.perf_counter()
        run = fc.simulate(system, count * step, initial=state, outputs=count + 1, rtol=1e-5)
        quick_time = time.perf_counter() - begin
        begin = time.perf_counter()
        exact = whole.free_vibration(q, step, count)
        slow_time = time.perf_counter() - begin
        found = run.displacement("middle")[:, 1]
        error = np.abs(found - exact).max() / np.abs(exact).max()
        own, other = (frequency(run.time, one) for one in (found, exact))
        waited += slow_time
        on_mode = np.interp(np.abs(exact).max(), mode.amplitude, mode.frequency_hz)
        print(f"{size:10.2f} {other:10.3f} {own:12.3f} {on_mode:13.3f} {error:13.4f} "
              f"{slow_time:9.2f} {quick_time:11.4f} {slow_time / quick_time:7.0f}")
        off = max(off, abs(on_mode / other - 1.0))
    points = 1 if quick else len(AMPLITUDES)
    count = len(mode.amplitude)
    print(f"backbone: {count} points in {followed:.2f} s, {points} of the whole body in "
          f"{waited:.1f} s; a point {waited / points * count / followed:.0f} times as fast, "
          f"frequencies off by {off:.1e}")
    costs(quick)


if __name__ == "__main__":
    explain(__doc__)
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    main(*numbers, quick="--quick" in sys.argv)
