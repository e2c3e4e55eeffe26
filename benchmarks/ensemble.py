"""Problem (f): a bifurcation diagram by brute force, on one core and on all.

Usage: python benchmarks/ensemble.py [values] [periods] [--quick]

1000 values of the drive's frequency, 300 periods each, states once a period, if not told
otherwise; the peer is numbalsoda, called in a compiled loop over the same values with the
package's own compiled right-hand side. Errors are those after three periods, before chaos has
its way: the median over the values of the largest deviation of a displacement, relative to its
largest value there, from a run at rtol = 1e-11.
"""

import os
import sys
import time
from collections.abc import Callable

import numpy as np
from integrator_peers import _frozen, _pointer
from integrator_problems import Problem, diagram
from numba import carray, cfunc, njit
from numpy.typing import NDArray

from fecontact.integrate import strobe

Array = NDArray[np.float64]

LEVELS = (1e-3, 1e-4, 1e-5, 1e-6)
SCALE = np.array([1e-3, 1e-3, 1e-2, 1e-2])


def numbalsoda_loop(values: Array) -> Callable[[float, int], Array]:
    """States (V, periods, 4) by LSODA in a compiled loop."""
    from numbalsoda import lsoda, lsoda_sig

    system = diagram(values[:1])[0]
    problem = Problem("f", system, np.zeros(4), np.zeros(2), np.zeros((1, 4)))
    rate, _, held = _frozen(problem)
    drive = system.arrays.drive_parameters
    scale, state = SCALE.copy(), np.empty(4)
    at_scale, at_state = scale.ctypes.data, state.ctypes.data

    @cfunc(lsoda_sig, error_model="numpy")
    def rhs(t, u, du, data):  # type: ignore[no-untyped-def]
        unit, y = carray(_pointer(at_scale), (4,), np.float64), carray(
            _pointer(at_state), (4,), np.float64)
        scaled, out = carray(u, (4,)), carray(du, (4,))
        for i in range(4):
            y[i] = scaled[i] * unit[i]
        rate(t, y, out)
        for i in range(4):
            out[i] /= unit[i]

    address = rhs.address

    @njit
    def loop(drive: Array, values: Array, periods: int, rtol: float, out: Array) -> None:
        for k in range(len(values)):
            drive[:, 1] = values[k]
            times = np.arange(periods + 1) * (2.0 * np.pi / values[k])
            found, _ = lsoda(address, np.zeros(4), times, rtol=rtol, atol=rtol, mxstep=100000000)
            out[k] = found

    def solve(rtol: float, periods: int) -> Array:
        _ = held, rhs, state
        out = np.empty((len(values), periods + 1, 4))
        loop(drive, values, periods, rtol, out)
        return out[:, 1:] * scale

    return solve


def own(values: Array, workers: int) -> Callable[[float, int], Array]:
    """The same by the package."""
    systems = diagram(values)

    def solve(rtol: float, periods: int) -> Array:
        return strobe(systems, transient_periods=1, keep=periods, initial=np.zeros(4), rtol=rtol,
                      workers=workers).states

    return solve


def main(count: int = 1000, periods: int = 300, quick: bool = False) -> None:
    """Print the table; quickly of a few values and two tolerances."""
    tolerances = (1e-4, 1e-5, 1e-6, 1e-7)
    if quick:
        count, periods, tolerances = 4, 5, tolerances[1:3]
    values = np.linspace(5.0, 80.0, count)
    wanted = own(values, 1)(1e-11, 3)[:, -1, :2]
    size = np.abs(wanted).max(axis=1, keepdims=True)
    solvers = {"fecontact, 1 thread": own(values, 1)}
    if (os.cpu_count() or 1) > 1:
        solvers[f"fecontact, {os.cpu_count()} threads"] = own(values, os.cpu_count() or 1)
    try:
        solvers["numbalsoda, 1 thread"] = numbalsoda_loop(values)
    except ImportError:
        print("numbalsoda is not installed")
    rows: dict[str, list[tuple[float, float]]] = {name: [] for name in solvers}
    for rtol in tolerances:
        for name, solve in solvers.items():
            found = solve(rtol, 3)[:, -1, :2]
            error = float(np.median(np.abs(found - wanted).max(axis=1, keepdims=True) / size))
            begin = time.perf_counter()
            solve(rtol, periods)
            seconds = time.perf_counter() - begin
            rows[name].append((seconds, error))
            print(f"{name:22s} rtol {rtol:.0e}  {seconds:8.2f} s  error {error:.1e}", flush=True)
    for name, points in rows.items():
        errors = np.log([error for _, error in points])[::-1]
        seconds = np.log([seconds for seconds, _ in points])[::-1]
        cells = [f"{np.exp(np.interp(np.log(level), errors, seconds)):8.2f} s"
                 if errors[0] <= np.log(level) <= errors[-1] else "         -" for level in LEVELS]
        print(f"{name:22s} at 1e-3 ... 1e-6: " + "  ".join(cells))


if __name__ == "__main__":
    main(*(int(given) for given in sys.argv[1:] if given != "--quick"),
         quick="--quick" in sys.argv)
