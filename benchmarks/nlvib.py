"""The nine examples of NLvib (Krack and Gross): responses and nonlinear modes by harmonic balance.

Each is followed with the harmonics, samples and range of the example; 4 and 6 up to amplitudes at
which no internal resonance is met. Processor time of the whole branch, with the system made anew,
the least of three runs. With a checkout of NLvib each of its example scripts runs in Octave too, up
to the end of its first continuation, which is that of harmonic balance; its own default takes no
derivatives from the elements, so they are switched on. Of example 6 that is the mode down to a
frequency of 1 rad/s.

Usage: python benchmarks/nlvib.py [NUMBER ...] [--quick] [--nlvib FOLDER [--octave PROGRAM]]
"""

import argparse
import os
import re
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import fecontact as fc
from fecontact.bifurcation import Branch, HarmonicBalance, frequency_response, nonlinear_mode
from fecontact.laws import (
    BilateralPolynomial,
    ConstantFriction,
    Frictionless,
    Harmonic,
    JenkinsFriction,
    LinearContact,
    PrescribedForce,
)
from fecontact.reduction import polynomial_stiffness

Array = np.ndarray
FREQUENCY = "load.forces.0.signal.frequency_hz"
RUNS = 3


@dataclass(frozen=True)
class Example:
    """One example.

    Attributes
    ----------
    M, C, K : (d, d) arrays
    rows : (e, d) array
        What moves the elements.
    contact : array or mapping
        The same as contact rows.
    seen : (d,) array
        The displacement that is observed.
    load : (d,) array or None
        Amplitudes of the forces sin w t; None for a mode.
    bounds : (float, float)
        First and last angular frequency, or amplitude of a mode.
    method : HarmonicBalance
    laws : mapping
        Further arguments of the system.
    """

    M: Array
    C: Array
    K: Array
    rows: Array
    contact: Any
    seen: Sequence[float]
    load: Sequence[float] | None
    bounds: tuple[float, float]
    method: HarmonicBalance
    laws: Mapping[str, Any]

    def system(self) -> fc.ContactSystem:
        """The system, with points B of what is observed and 'element0', ... of the elements."""
        points = {"B": along(self.seen)[0]}
        points |= {f"element{e}": along(row)[0] for e, row in enumerate(self.rows)}
        load = fc.Load()
        if self.load is not None:
            points["force"] = along(self.load)[0]
            load = fc.Load(forces=(fc.PointLoad("force", "y", signal=Harmonic(1.0, 1.0)),))
        basis = fc.basis_from_matrices(self.M, self.K, {"contact": self.contact, **points},
                                       damping=self.C)
        return fc.ContactSystem(basis, load=load, **self.laws)

    def branch(self) -> Branch:
        """The response, or the lowest mode."""
        if self.load is None:
            return nonlinear_mode(self.system(), self.bounds, observe=("B", "y"),
                                  method=self.method).branch
        turn = 2.0 * np.pi
        return frequency_response(
            self.system(), (min(self.bounds) / turn, max(self.bounds) / turn), FREQUENCY,
            observe=("B", "y"), start=self.bounds[0] / turn, method=self.method).branches[0]


def chain(springs: Sequence[float]) -> Array:
    """Matrix (n, n) of n masses between n + 1 springs, of which the outer ones are to the base."""
    found = np.diag(np.add(springs[:-1], springs[1:]))
    return found - np.diag(springs[1:-1], 1) - np.diag(springs[1:-1], -1)


def beam(
    length: float, height: float, width: float, young: float, density: float, nodes: int
) -> tuple[Array, Array]:
    """Mass and stiffness of a clamped beam of Euler and Bernoulli's elements."""
    size, h = 2 * nodes, length / (nodes - 1)
    M, K = np.zeros((2, size, size))
    turned = np.array([1.0, h, 1.0, h])
    k = young * width * height**3 / 12.0 / h**3 * np.outer(turned, turned) * [
        [12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]
    m = density * width * height * h / 420.0 * np.outer(turned, turned) * [
        [156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
    for e in range(nodes - 1):
        part = slice(2 * e, 2 * e + 4)
        M[part, part] += m
        K[part, part] += k
    return M[2:, 2:], K[2:, 2:]


def along(*rows: Any) -> Array:
    """Contact nodes that move along y as these rows (n, d) say."""
    found = np.zeros((len(rows), 3, len(rows[0])))
    found[:, 1] = rows
    return found


def across(*rows: Any) -> Array:
    """Contact nodes that slip along x as these rows (n, d) say."""
    return np.roll(along(*rows), -1, axis=1)


def balance(harmonics: Any, samples: int | None = None) -> HarmonicBalance:
    """Harmonic balance without stability."""
    return HarmonicBalance(harmonics, samples, stability=None)


def regularised(limit: float, speed: float) -> dict[str, Any]:
    """Friction ``limit * tanh(v / speed)``."""
    return {"normal": PrescribedForce(1.0), "friction": ConstantFriction(
        limit, smoothing_slope=0.5 * np.pi / speed, smoothing="tanh")}


def duffing() -> Example:
    """One mass with a cubic spring."""
    one = np.eye(1)
    return Example(one, 0.05 * one, one, one, along([1.0]), [1.0], [0.18], (0.5, 1.6), balance(7),
                   {"normal": BilateralPolynomial(0.0, 0.1)})


def cubic_absorber() -> Example:
    """A mass with a small one on it, by cubic springs."""
    rows = np.array([[1.0, 0.0], [1.0, -1.0]])
    return Example(
        np.diag([1.0, 0.05]), chain([0.002, 0.013, 0.0]), chain([1.0, 0.0453, 0.0]), rows,
        {"first": along(rows[0]), "between": along(rows[1])}, [1.0, 0.0], [0.11, 0.0], (0.8, 1.4),
        balance(7), {"normal": {"first": BilateralPolynomial(0.0, 1.0),
                                "between": BilateralPolynomial(0.0, 0.0042)}})


def unilateral_spring() -> Example:
    """Two masses, the first of which meets a stiff spring."""
    K, row = chain([0.0, 1.0, 1.0]), np.array([[1.0, 0.0]])
    return Example(np.eye(2), 0.03 * K, K, row, -along([1.0, 0.0]), [1.0, 0.0], [0.0, 0.1],
                   (0.8, 0.5), balance(21, 1024), {"normal": LinearContact(100.0), "gap": 1.0})


def cubic_mode() -> Example:
    """The mode in phase of two masses, with a cubic spring at the first."""
    row = np.array([[1.0, 0.0]])
    return Example(np.eye(2), np.zeros((2, 2)), chain([1.0, 1.0, 1.0]), row, along([1.0, 0.0]),
                   [1.0, 0.0], None, (1e-2, 2.0), balance(9),
                   {"normal": BilateralPolynomial(0.0, 0.5)})


def friction_mode() -> Example:
    """The mode of two masses of which the small one sticks, then slides."""
    row = np.array([[1.0, 0.0]])
    return Example(np.diag([0.02, 1.0]), np.zeros((2, 2)), chain([0.0, 40.0, 600.0]), row,
                   across([1.0, 0.0]), [0.0, 1.0], None, (10.0**-1.5, 10.0), balance(21, 1024),
                   regularised(5.0, 0.05))


def two_springs(level: float | None = None) -> Example:
    """Quadratic and cubic forces of a potential couple both coordinates; a mode without load."""
    w1, w2 = 1.13, 2.0
    quadratic, cubic = np.zeros((2,) * 3), np.zeros((2,) * 4)
    c = 0.5 * (w1**2 + w2**2)
    for place in np.ndindex(2, 2, 2):
        quadratic[place] = (1.5 * w1**2, 0.5 * w2**2, 0.5 * w1**2, 1.5 * w2**2)[sum(place)]
    for place in np.ndindex(2, 2, 2, 2):
        cubic[place] = (c, 0.0, c / 3.0, 0.0, c)[sum(place)]
    rows, law = polynomial_stiffness(quadratic, cubic)
    losses = 0.0 if level is None else np.diag([2e-3 * w1, 1e-2 * w2])
    return Example(np.eye(2), losses * np.eye(2), np.diag([w1**2, w2**2]), np.eye(2), rows,
                   [1.0, 0.0], None if level is None else [level, level],
                   (1e-6, 0.35) if level is None else (0.9, 1.3), balance(7), {"normal": law})


def all_kinds() -> Example:
    """Three masses with Jenkins elements, cubic springs and a unilateral one."""
    K, ways = chain([1.0, 1.0, 1.0, 1.0]), (across, across, along, along, along)
    rows = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 1.0],
                     [0.0, 0.0, 1.0]])
    names = ("base", "between", "cubic", "other", "stop")
    free, jenkins, hard = Frictionless(), JenkinsFriction(20.0, 1.0), BilateralPolynomial(0.0, 1.0)
    pressed = PrescribedForce(1.0)
    contact = {name: way(row) for name, way, row in zip(
        names, ways, rows * [[1], [1], [1], [1], [-1]], strict=True)}
    return Example(
        np.eye(3), 0.02 * K, K, rows, contact, [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], (0.5, 2.0),
        balance(7, 1024), {
            "gap": np.array([0.0, 0.0, 0.0, 0.0, 0.25]),
            "normal": dict(zip(names, (pressed, pressed, hard, hard, LinearContact(1.0)),
                               strict=True)),
            "friction": dict(zip(names, (jenkins, jenkins, free, free, free), strict=True))})


def beam_with_friction() -> Example:
    """Regularised friction at the fourth of nine nodes, a force at the tip."""
    M, K = beam(2.0, 0.1, 0.3, 185e9, 7830.0, 9)
    contact, tip = np.eye(16)[[4, 14]]
    held = np.delete(np.arange(16), 4)
    stuck, free = lowest(M[np.ix_(held, held)], K[np.ix_(held, held)]), lowest(M, K)
    C = 2e-2 / stuck * K
    Z = K - (1.5 * stuck)**2 * M + 1.5j * stuck * C
    slow = free * abs(contact @ np.linalg.solve(Z, 0.2 * tip))
    return Example(M, C, K, contact[None], across(contact), tip, 0.2 * tip,
                   (1.5 * stuck, 0.9 * free), balance(13, 128), regularised(1.5, slow))


def lowest(M: Array, K: Array) -> float:
    """Lowest angular frequency."""
    return float(np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.min()))


def beam_with_cubic_spring() -> Example:
    """The first mode of a beam with a cubic spring at its tip."""
    M, K = beam(0.7, 0.014, 0.014, 2.05e11, 7800.0, 20)
    tip = np.eye(38)[36]
    return Example(M, np.zeros_like(M), K, tip[None], along(tip), tip, None, (1e-5, 1e-3),
                   balance(5), {"normal": BilateralPolynomial(0.0, 6e9)})


EXAMPLES: dict[int, Callable[[], Example]] = dict(enumerate((
    duffing, cubic_absorber, unilateral_spring, cubic_mode, friction_mode, two_springs, all_kinds,
    beam_with_friction, beam_with_cubic_spring), start=1))
# Wraps the continuation: the first one of a script is timed, and the last.
WRAPPER = """function varargout = solve_and_continue(x0, fun, first, last, ds, varargin)
given = struct(); if numel(varargin) > 0, given = varargin{1}; end
how = optimset('Display', 'off', 'Jacobian', 'on', 'MaxIter', 50);
if isfield(given, 'jac') && ischar(given.jac), how = optimset(how, 'Jacobian', 'off'); end
begin = cputime();
X = nlvib_solve_and_continue(x0, fun, first, last, ds, given, {}, how);
printf('TIME %.4f POINTS %d\\n', cputime() - begin, size(X, 2)); exit(0);
end
"""


def by_nlvib(folder: Path, number: int, octave: str) -> tuple[float, int] | None:
    """Processor time [s] and points of an example in Octave; None if it did not end."""
    place = next(folder.glob(f"EXAMPLES/{number:02d}_*"))
    scripts = sorted(place.glob("*.m"), key=lambda one: ("advanced" not in one.name, one.name))
    with tempfile.TemporaryDirectory() as name:
        own = Path(name)
        source = (folder / "SRC/solve_and_continue.m").read_text(encoding="latin-1")
        (own / "nlvib_solve_and_continue.m").write_text(
            re.sub(r"solve_and_continue\(", "nlvib_solve_and_continue(", source),
            encoding="latin-1")
        (own / "solve_and_continue.m").write_text(WRAPPER, encoding="ascii")
        text = next(one for one in scripts if "residual" not in one.name).read_text(
            encoding="latin-1")
        plain = re.sub(r"^(clearvars|close all|clc).*$", "", text, flags=re.MULTILINE)
        plain = re.sub(r"^addpath.*$", "", plain, flags=re.MULTILINE)
        paths = (own, folder / "SRC", folder / "SRC/MechanicalSystems", place)
        (own / "run_it.m").write_text(
            "".join(f"addpath('{one}', '-end');\n" for one in paths) + plain, encoding="latin-1")
        done = subprocess.run([octave, "--no-gui", "--quiet", str(own / "run_it.m")], cwd=place,
                              capture_output=True, text=True, timeout=3600, check=False)
    found = re.search(r"TIME (\S+) POINTS (\d+)", done.stdout)
    return (float(found[1]), int(found[2])) if found else None


def timed(example: Callable[[], Example], runs: int) -> tuple[float, Branch]:
    """Processor time [s] of a branch, the least of several runs."""
    least = np.inf
    branch = example().branch()  # what is compiled is kept
    for _ in range(runs):
        begin = time.process_time()
        branch = example().branch()
        least = min(least, time.process_time() - begin)
    return least, branch


def result(branch: Branch) -> float:
    """Largest amplitude of a response, angular frequency of a mode at its end."""
    if "mode_number" in branch.attributes:
        return float(2.0 * np.pi / branch.points[-1].values["period"])
    return float(branch.column("observed_amplitude").max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("numbers", nargs="*", type=int, help="examples, by default all")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--nlvib", type=Path, help="folder of a checkout of NLvib")
    parser.add_argument("--octave", default="octave")
    given = parser.parse_args()
    print(f"{'':29}points       time      result  "
          f"{'NLvib: points     time  ratio' * bool(given.nlvib)}")
    for number, example in EXAMPLES.items():
        if number not in (given.numbers or EXAMPLES) or (given.quick and number in (3, 7)):
            continue
        seconds, branch = timed(example, 1 if given.quick else RUNS)
        row = f"{number} {example.__name__.replace('_', ' '):25} {len(branch.points):8} " \
              f"{seconds:8.3f} s  {result(branch):10.5g}"
        other = by_nlvib(given.nlvib.resolve(), number, given.octave) if given.nlvib else None
        if other:
            row += f"  {other[1]:13} {other[0]:8.2f} s  {other[0] / seconds:5.1f}"
        print(f"{row}  {branch.status.name.lower()}", flush=True)


if __name__ == "__main__":
    main()
