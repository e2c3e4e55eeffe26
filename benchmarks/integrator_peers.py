"""The solvers that fecontact's integrator is compared with, each in its fastest form.

All take the package's own compiled right-hand side, and its Jacobian where they accept one.
"""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from integrator_problems import Problem
from numpy.typing import NDArray

from fecontact import contact_jacobian, contact_kernels as kernels

Array = NDArray[np.float64]
Solver = Callable[[float], Array]

DISPLACEMENT = 1e-3
VELOCITY = 1e-2
"""Absolute tolerances per rtol of modal displacements and velocities [m sqrt(kg), .../s]."""


def absolute(problem: Problem, rtol: float) -> Array:
    """Absolute tolerances (2 m,) for the peers that take one per component."""
    m = problem.system.basis.modes
    return rtol * np.repeat([DISPLACEMENT, VELOCITY], m)


def _functions(problem: Problem) -> tuple[Callable[..., Array], Callable[..., Array]]:
    arrays, size = problem.system.arrays, len(problem.state)
    rate, matrix = np.empty(size), np.empty((size, size))

    def rhs(t: float, y: Array) -> Array:
        kernels.right_hand_side(t, y, arrays, rate)
        return rate

    def jacobian(t: float, y: Array) -> Array:
        contact_jacobian.jacobian(t, y, arrays, matrix)
        return matrix

    return rhs, jacobian


def odeint(problem: Problem) -> Solver:
    """LSODA of ODEPACK through scipy's odeint, with Dfun."""
    from scipy.integrate import odeint as run

    rhs, jacobian = _functions(problem)

    def solve(rtol: float) -> Array:
        return np.asarray(run(rhs, problem.state, problem.times, Dfun=jacobian, tfirst=True,
                              rtol=rtol, atol=absolute(problem, rtol), mxstep=10**8))

    return solve


def solve_ivp(method: str) -> Callable[[Problem], Solver]:
    """solve_ivp of scipy."""

    def of(problem: Problem) -> Solver:
        from scipy.integrate import solve_ivp as run

        rhs, jacobian = _functions(problem)

        def solve(rtol: float) -> Array:
            return np.asarray(run(
                lambda t, y: rhs(t, np.ascontiguousarray(y)).copy(), problem.times[[0, -1]],
                problem.state, method=method, t_eval=problem.times, rtol=rtol,
                atol=absolute(problem, rtol),
                jac=lambda t, y: jacobian(t, np.ascontiguousarray(y)).copy()).y.T)

        return solve

    return of


def cvode(problem: Problem) -> Solver:
    """CVODE (BDF, dense) of scikit-sundae."""
    from sksundae.cvode import CVODE

    arrays = problem.system.arrays

    def rhs(t: float, y: Array, rate: Array) -> None:
        kernels.right_hand_side(t, y.copy(), arrays, rate)

    def jacobian(t: float, y: Array, rate: Array, out: Array) -> None:
        matrix = np.empty(out.shape)
        contact_jacobian.jacobian(t, y.copy(), arrays, matrix)
        out[:] = matrix

    def solve(rtol: float) -> Array:
        solver = CVODE(rhs, jacfn=jacobian, method="BDF", rtol=rtol,
                       atol=absolute(problem, rtol), max_num_steps=10**8)
        return np.asarray(solver.solve(problem.times, problem.state).y)

    return solve


def numbalsoda(problem: Problem) -> Solver:
    """LSODA translated to C++, called with a compiled right-hand side; it takes no Jacobian.

    It knows one absolute tolerance only, so velocities are integrated in units of VELOCITY and
    displacements in units of DISPLACEMENT.
    """
    from numba import carray, cfunc, njit
    from numbalsoda import address_as_void_pointer, lsoda, lsoda_sig

    arrays, size = problem.system.arrays, len(problem.state)
    scale = np.ascontiguousarray(absolute(problem, 1.0))
    # Addresses, not arrays, are frozen into the callback: kernels take writable arrays.
    named = {f"a{i}": item for i, item in enumerate(arrays)}
    lines = [f"    v{i} = carray(pointer({item.ctypes.data}), {item.shape}, f8)"
             if isinstance(item, np.ndarray) else f"    v{i} = {int(item)}"
             for i, item in enumerate(arrays)]
    source = "\n".join([
        "def rhs(t, u, du, data):",
        *lines,
        f"    unit = carray(pointer({scale.ctypes.data}), ({size},), f8)",
        f"    y = carray(u, ({size},))",
        f"    out = carray(du, ({size},))",
        f"    state = carray(pointer(work), ({size},), f8)",
        f"    for i in range({size}):",
        "        state[i] = y[i] * unit[i]",
        f"    kernel(t, state, System({', '.join(f'v{i}' for i in range(len(named)))}), out)",
        f"    for i in range({size}):",
        "        out[i] /= unit[i]",
    ])
    work = np.empty(size)
    space: dict[str, Any] = {
        "carray": carray, "f8": np.float64, "kernel": kernels.right_hand_side,
        "System": kernels.SystemArrays, "pointer": address_as_void_pointer,
        "work": work.ctypes.data}
    exec(source, space)
    function = cfunc(lsoda_sig)(space["rhs"])
    address = function.address
    start = problem.state / scale
    keep = (function, work, scale, arrays, ctypes)

    @njit
    def run(start: Array, times: Array, rtol: float) -> Any:
        return lsoda(address, start, times, rtol=rtol, atol=rtol, mxstep=100000000)

    def solve(rtol: float) -> Array:
        _ = keep
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
