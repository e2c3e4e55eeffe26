"""Problem (f): a bifurcation diagram by brute force, on one core and on all; (b) likewise.

Usage: python benchmarks/ensemble.py [values] [periods] [--problem b] [--quick]

Values of the drive's frequency, some periods of each, states once a period: by default
24 values and 60 periods of (f), then 64 and 100 of (b). The peer is numbalsoda, called in a
compiled loop over the same values with the package's own compiled right-hand side. Errors are
those after three periods, before chaos has its way: the median over the values of the largest
deviation of a displacement, relative to its largest value there, from a run at rtol = 1e-11.

Problem (f) is the impact oscillator of two modes, whose motion is expanded in power series;
``--problem b`` is the friction oscillator of one mode, ``--problem b2`` that of two: stick and
slip, whose runs go side by side in the lanes of vector instructions.
"""

import os
import sys
import time
from collections.abc import Callable

import numpy as np
from integrator_peers import DISPLACEMENT, VELOCITY, _frozen, _pointer
from integrator_problems import Problem, diagram, friction_oscillator
from numba import carray, cfunc, njit
from numpy.typing import NDArray
from usage import explain

from fecontact import ContactSystem
from fecontact.integrate import strobe

Array = NDArray[np.float64]

LEVELS = (1e-3, 1e-4, 1e-5, 1e-6)
# Values and periods; lowest and highest frequency of the drive [Hz].
USUAL = {"f": (24, 60), "b": (64, 100)}
RANGES = {"f": (0.8, 12.7), "b": (1.6, 2.55), "b2": (1.6, 2.55)}


def systems_of(name: str, values: Array) -> list[ContactSystem]:
    """The systems of a problem at many frequencies of the drive."""
    if name == "f":
        return diagram(values)
    system = friction_oscillator(name).system
    return [system.with_({"drive.frequency_hz": float(hz)}) for hz in values]


def numbalsoda_loop(name: str, values: Array) -> Callable[[float, int], Array]:
    """States (V, periods, 2 m) by LSODA in a compiled loop."""
    from numbalsoda import lsoda, lsoda_sig

    system = systems_of(name, values[:1])[0]
    size = system.size
    problem = Problem(name, system, np.zeros(size), np.zeros(2), np.zeros((1, size)))
    rate, _, held = _frozen(problem)
    drive = system.arrays.drive_parameters
    scale, state = np.repeat([DISPLACEMENT, VELOCITY], size // 2), np.empty(size)
    at_scale, at_state = scale.ctypes.data, state.ctypes.data

    @cfunc(lsoda_sig, error_model="numpy")
    def rhs(t, u, du, data):  # type: ignore[no-untyped-def]
        unit, y = carray(_pointer(at_scale), (size,), np.float64), carray(
            _pointer(at_state), (size,), np.float64)
        scaled, out = carray(u, (size,)), carray(du, (size,))
        for i in range(size):
            y[i] = scaled[i] * unit[i]
        rate(t, y, out)
        for i in range(size):
            out[i] /= unit[i]

    address = rhs.address

    @njit
    def loop(drive: Array, values: Array, periods: int, rtol: float, out: Array) -> None:
        for k in range(len(values)):
            drive[:, 1] = 2.0 * np.pi * values[k]
            times = np.arange(periods + 1) / values[k]
            found, _ = lsoda(address, np.zeros(size), times, rtol=rtol, atol=rtol, mxstep=100000000)
            out[k] = found

    def solve(rtol: float, periods: int) -> Array:
        _ = held, rhs, state
        out = np.empty((len(values), periods + 1, size))
        loop(drive, values, periods, rtol, out)
        return out[:, 1:] * scale

    return solve


def own(name: str, values: Array, workers: int) -> Callable[[float, int], Array]:
    """Solver of the same problem by the package."""
    systems = systems_of(name, values)

    def solve(rtol: float, periods: int) -> Array:
        return strobe(systems, transient_periods=1, keep=periods,
                      initial=np.zeros(systems[0].size), rtol=rtol, workers=workers).states

    return solve


def main(count: int = 0, periods: int = 0, quick: bool = False, name: str = "") -> None:
    """Print the table of a problem, or of the usual two; quickly of few values, two tolerances."""
    if not name:
        for name in USUAL:
            print(f"({name})")
            main(count, periods, quick, name)
        return
    usual = USUAL.get(name, USUAL["b"])
    count, periods = count or usual[0], periods or usual[1]
    tolerances = (1e-4, 1e-5, 1e-6, 1e-7)
    if quick:
        count, periods, tolerances = 4, 5, tolerances[1:3]
    values = np.linspace(*RANGES[name], count)
    modes = systems_of(name, values[:1])[0].basis.modes
    wanted = own(name, values, 1)(1e-11, 3)[:, -1, :modes]
    size = np.abs(wanted).max(axis=1, keepdims=True)
    solvers = {"fecontact, 1 thread": own(name, values, 1)}
    if (os.cpu_count() or 1) > 1:
        solvers[f"fecontact, {os.cpu_count()} threads"] = own(name, values, os.cpu_count() or 1)
    try:
        solvers["numbalsoda, 1 thread"] = numbalsoda_loop(name, values)
    except ImportError:
        print("numbalsoda is not installed")
    rows: dict[str, list[tuple[float, float]]] = {name: [] for name in solvers}
    for rtol in tolerances:
        for name, solve in solvers.items():
            found = solve(rtol, 3)[:, -1, :modes]
            error = float(np.median(np.abs(found - wanted).max(axis=1, keepdims=True) / size))
            begin = time.perf_counter()
            solve(rtol, periods)
            seconds = time.perf_counter() - begin
            rows[name].append((seconds, error))
            print(f"{name:22s} rtol {rtol:.0e}  {seconds:8.2f} s  error {error:.1e}", flush=True)
    for name, points in rows.items():
        errors = np.log([error for _, error in points])[::-1]
        seconds = np.log([seconds for seconds, _ in points])[::-1]
        # Errors that no tolerance here reaches from below cost what the loosest one does.
        cells = [f"{np.exp(np.interp(np.log(level), errors, seconds)):8.3f} s"
                 if errors[0] <= np.log(level) else "         -" for level in LEVELS]
        print(f"{name:22s} at 1e-3 ... 1e-6: " + "  ".join(cells))


if __name__ == "__main__":
    explain(__doc__)
    words = [word for word in sys.argv[1:] if word != "--quick"]
    problem = ""
    if "--problem" in words:
        place = words.index("--problem")
        problem = words[place + 1]
        del words[place : place + 2]
    main(*(int(word) for word in words), quick="--quick" in sys.argv, name=problem)
