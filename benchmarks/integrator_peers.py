"""The solvers that fecontact's integrator is compared with, each in its fastest form.

All take the right-hand side that the package's integrator itself uses, compiled with everything
but time and state frozen into it, and the compiled Jacobian where they accept one.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from integrator_problems import Problem
from numba import carray, cfunc, njit, types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from fecontact.core.records import allocate
from fecontact.core.references import borrowed
from fecontact.integrate.rodas5p import dynamics
from fecontact.integrate.rodas5p.blocks import Blocks, blocks_of
from fecontact.system import jacobian as contact_jacobian
from fecontact.system import nodes

Array = NDArray[np.float64]
Solver = Callable[[float], Array]

# Absolute tolerances per rtol of modal displacements [m sqrt(kg)] and velocities.
DISPLACEMENT, VELOCITY = 1e-3, 1e-2


def absolute(problem: Problem, rtol: float) -> Array:
    """Absolute tolerances (2 m,)."""
    return rtol * np.repeat([DISPLACEMENT, VELOCITY], problem.system.basis.modes)


@intrinsic
def _pointer(typingctx: Any, address: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(address), codegen


def _frozen(problem: Problem) -> tuple[Any, Any, Any]:
    """Compiled ``rate(t, y, out)`` and ``jacobian(t, y, out)``, and what must outlive them."""
    arrays = problem.system.arrays
    n, _, m = arrays.rows.shape
    workspace = {"given": np.zeros(dynamics.GIVEN), "pull": np.zeros(m),
                 "nodes": np.zeros((3, 2 * n))}
    scratch = allocate(dynamics.Gradients, {
        nodes.NODES: n, nodes.MODES: m, nodes.AXES: 2, nodes.MEMORY: int(arrays.memory.max()),
        nodes.COMBINATIONS: 0})
    rows, slopes = np.empty((n, 2, m)), np.empty((n, 2, 2 * m))
    held = {**workspace, "rows": rows, "slopes": slopes,
            **{f"g{k}": item for k, item in enumerate(scratch)},
            **{f"b{k}": item for k, item in enumerate(blocks_of(problem.system.basis, arrays))},
            **{f"s{k}": item for k, item in enumerate(arrays) if isinstance(item, np.ndarray)}}
    lines = [f"    {name} = carray(pointer({item.ctypes.data}), {item.shape}, "
             f"{'i8' if item.dtype == np.int64 else 'f8'})" for name, item in held.items()]
    system = ", ".join(f"s{k}" if isinstance(item, np.ndarray) else str(int(item))
                       for k, item in enumerate(arrays))
    blocks = ", ".join(f"b{k}" for k in range(len(Blocks._fields)))
    gradients = ", ".join(f"g{k}" for k in range(len(scratch)))
    source = "\n".join([
        "def rate(t, y, out):", *lines,
        f"    s = System({system})",
        "    set_given(t, s, given, pull)",
        f"    set_rate(borrowed(y), s, Blocks({blocks}), given, pull, nodes, "
        f"Gradients({gradients}), borrowed(out))",
        "def jacobian(t, y, out):", *lines,
        f"    count = 2 * fill(t, y, System({system}), rows, slopes, out)",
        f"    out[{m}:{2 * m}, :{2 * m}] += dot(rows.reshape(({2 * n}, {m}))[:count].T, "
        f"slopes.reshape(({2 * n}, {2 * m}))[:count])",
    ])
    space: dict[str, Any] = {
        "carray": carray, "f8": np.float64, "i8": np.int64, "pointer": _pointer,
        "borrowed": borrowed, "set_given": dynamics.set_given, "set_rate": dynamics.set_rate,
        "System": nodes.SystemArrays, "Blocks": Blocks, "Gradients": dynamics.Gradients,
        "fill": contact_jacobian.fill_jacobian, "dot": np.dot}
    exec(source, space)
    options = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}}
    return njit(**options)(space["rate"]), njit(**options)(space["jacobian"]), (held, arrays)


def odeint(problem: Problem) -> Solver:
    """LSODA of ODEPACK through scipy's odeint, with Dfun."""
    from scipy.integrate import odeint as run

    rate, jacobian, held = _frozen(problem)
    size = len(problem.state)
    out, matrix = np.empty(size), np.empty((size, size))

    def rhs(t: float, y: Array) -> Array:
        rate(t, y, out)
        return out

    def derivative(t: float, y: Array) -> Array:
        jacobian(t, y, matrix)
        return matrix

    def solve(rtol: float) -> Array:
        _ = held
        return np.asarray(run(rhs, problem.state, problem.times, Dfun=derivative, tfirst=True,
                              rtol=rtol, atol=absolute(problem, rtol), mxstep=10**8))

    return solve


def solve_ivp(method: str) -> Callable[[Problem], Solver]:
    """solve_ivp of scipy."""

    def of(problem: Problem) -> Solver:
        from scipy.integrate import solve_ivp as run

        rate, jacobian, held = _frozen(problem)
        size = len(problem.state)

        def rhs(t: float, y: Array) -> Array:
            out = np.empty(size)
            rate(t, np.ascontiguousarray(y), out)
            return out

        def derivative(t: float, y: Array) -> Array:
            out = np.empty((size, size))
            jacobian(t, np.ascontiguousarray(y), out)
            return out

        def solve(rtol: float) -> Array:
            _ = held
            return np.asarray(run(
                rhs, problem.times[[0, -1]], problem.state, method=method, t_eval=problem.times,
                rtol=rtol, atol=absolute(problem, rtol), jac=derivative).y.T)

        return solve

    return of


def cvode(problem: Problem) -> Solver:
    """CVODE (BDF, dense) of scikit-sundae."""
    from sksundae.cvode import CVODE

    rate, jacobian, held = _frozen(problem)
    size = len(problem.state)
    state, matrix = np.empty(size), np.empty((size, size))

    # CVODE's own arrays are read-only, for which the compiled functions are not made.
    def rhs(t: float, y: Array, out: Array) -> None:
        state[:] = y
        rate(t, state, out)

    def derivative(t: float, y: Array, out: Array, into: Array) -> None:
        state[:] = y
        jacobian(t, state, matrix)
        into[:] = matrix

    def solve(rtol: float) -> Array:
        _ = held
        solver = CVODE(rhs, jacfn=derivative, method="BDF", rtol=rtol,
                       atol=absolute(problem, rtol), max_num_steps=10**8)
        return np.asarray(solver.solve(problem.times, problem.state).y)

    return solve


def numbalsoda(problem: Problem) -> Solver:
    """LSODA translated to C++, called with a compiled right-hand side; it takes no Jacobian.

    It knows one absolute tolerance only: displacements are integrated in units of DISPLACEMENT,
    velocities in units of VELOCITY.
    """
    from numbalsoda import lsoda, lsoda_sig

    rate, _, held = _frozen(problem)
    size = len(problem.state)
    scale, state = np.ascontiguousarray(absolute(problem, 1.0)), np.empty(size)
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

    address, start = rhs.address, problem.state / scale

    @njit
    def run(start: Array, times: Array, rtol: float) -> Any:
        return lsoda(address, start, times, rtol=rtol, atol=rtol, mxstep=100000000)

    def solve(rtol: float) -> Array:
        _ = held, rhs, state
        return np.asarray(run(start, problem.times, rtol)[0] * scale)

    return solve


PEERS: dict[str, Callable[[Problem], Solver]] = {
    "odeint": odeint,
    "numbalsoda": numbalsoda,
    "CVODE": cvode,
    "solve_ivp LSODA": solve_ivp("LSODA"),
    "solve_ivp Radau": solve_ivp("Radau"),
    "solve_ivp BDF": solve_ivp("BDF"),
}
