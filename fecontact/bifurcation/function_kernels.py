"""Compiled loops over many states for a vector field that is given by its address."""

import numpy as np
from numba import types

from fecontact.compiled import block, f8, function_at, i8, integers, kernel, matrix, vector

c16 = types.complex128
complex_vector = types.Array(c16, 1, "C")

RATES = types.void(f8, vector, vector, vector)
JACOBIAN = types.void(f8, vector, vector, matrix)
COMPLEX_RATES = types.void(f8, complex_vector, complex_vector, complex_vector)

_rates_at = function_at(RATES)
_jacobian_at = function_at(JACOBIAN)
_complex_rates_at = function_at(COMPLEX_RATES)

# Step of the complex step: its square is lost against one.
_TINY = 1e-30
# Step of central differences of fourth order, relative to the state.
_STEP = 2e-4


@kernel(types.void(i8, vector, matrix, vector, matrix))
def batch_rates(address, t, x, p, f):  # type: ignore[no-untyped-def]
    """Fill f (N, d)."""
    function = _rates_at(address)
    for k in range(len(t)):
        function(t[k], x[k], p, f[k])


@kernel(types.void(i8, vector, matrix, vector, block))
def batch_jacobians(address, t, x, p, J):  # type: ignore[no-untyped-def]
    """Fill J (N, d, d) by the function that gives one."""
    function = _jacobian_at(address)
    for k in range(len(t)):
        function(t[k], x[k], p, J[k])


@kernel(types.void(i8, vector, matrix, vector, integers, types.boolean, block, block))
def complex_steps(address, t, x, p, active, states, J, P):  # type: ignore[no-untyped-def]
    """Fill J (N, d, d) if ``states``, and P (N, d, a), by the complex step."""
    function = _complex_rates_at(address)
    d = x.shape[1]
    y, q, out = np.empty(d, c16), p.astype(c16), np.empty(d, c16)
    for k in range(len(t)):
        for i in range(d):
            y[i] = x[k, i]
        if states:
            for j in range(d):
                y[j] = complex(x[k, j], _TINY)
                function(t[k], y, q, out)
                for i in range(d):
                    J[k, i, j] = out[i].imag / _TINY
                y[j] = x[k, j]
        for a in range(len(active)):
            q[active[a]] = complex(p[active[a]], _TINY)
            function(t[k], y, q, out)
            for i in range(d):
                P[k, i, a] = out[i].imag / _TINY
            q[active[a]] = p[active[a]]


@kernel(types.void(i8, vector, matrix, vector, vector, integers, types.boolean, block, block))
def differences(address, t, x, p, scales, active, states, J, P):  # type: ignore[no-untyped-def]
    """Fill J (N, d, d) if ``states``, and P (N, d, a), by central differences of fourth order."""
    function = _rates_at(address)
    d = x.shape[1]
    y, q = np.empty(d), p.copy()
    near, far = np.empty(d), np.empty(d)
    for k in range(len(t)):
        y[:] = x[k]
        for j in range(d if states else 0):
            h = _STEP * max(abs(x[k, j]), scales[j])
            y[j] = x[k, j] + h
            function(t[k], y, q, near)
            J[k, :, j] = 8.0 * near
            y[j] = x[k, j] - h
            function(t[k], y, q, near)
            y[j] = x[k, j] + 2.0 * h
            function(t[k], y, q, far)
            J[k, :, j] -= 8.0 * near + far
            y[j] = x[k, j] - 2.0 * h
            function(t[k], y, q, far)
            J[k, :, j] = (J[k, :, j] + far) / (12.0 * h)
            y[j] = x[k, j]
        for a in range(len(active)):
            at = active[a]
            h = _STEP * (abs(p[at]) if p[at] != 0.0 else 1.0)
            q[at] = p[at] + h
            function(t[k], y, q, near)
            P[k, :, a] = 8.0 * near
            q[at] = p[at] - h
            function(t[k], y, q, near)
            q[at] = p[at] + 2.0 * h
            function(t[k], y, q, far)
            P[k, :, a] -= 8.0 * near + far
            q[at] = p[at] - 2.0 * h
            function(t[k], y, q, far)
            P[k, :, a] = (P[k, :, a] + far) / (12.0 * h)
            q[at] = p[at]
